"""Tests of settings files that are large, deep, or have endless keys and numbers."""

from pathlib import Path

import pytest

from dmplay.cli import config_files
from dmplay.errors import BadParameter
from tests.support.programs import run_dmplay

# A number beyond the upper end of a range is refused as such.
REFUSAL = "expected a (whole )?number"
DOTS = ".".join(["a"] * 200)
DOTS = ".".join(["a"] * 200)


def read_settings(text: str, folder: Path) -> config_files.ConfigFile:
    """Read this text as a settings file of the user."""
    path = folder / "config.toml"
    path.write_text(text)
    return config_files.read_config_file(path, is_user_file=True)


QUOTED_DOTS = DOTS.replace("a", '"a"')
SPACED_DOTS = DOTS.replace(".", " . ")


@pytest.mark.parametrize(
    "text",
    [
        f"{DOTS} = 1", f"[{DOTS}]", f"[[{DOTS}]]", f"play = {{{DOTS} = 1}}", f"\n{SPACED_DOTS} = 1",
        f"{QUOTED_DOTS} = 1",
    ],
)  # fmt: skip
def test_a_key_of_too_many_parts_is_refused_before_it_is_parsed(text: str, tmp_path: Path) -> None:
    """The parser's work grows with the square of the number of parts."""
    line = text.count("\n") + 1
    expected = rf"config.toml: line {line}: got 199 dots, expected at most 100 in a line$"
    with pytest.raises(BadParameter, match=expected):
        read_settings(text, tmp_path)


def test_a_hundred_dots_in_a_line_are_allowed(tmp_path: Path) -> None:
    settings = read_settings(f'[aliases]\nhw = "play hexworld {"." * 100}"', tmp_path)
    assert settings.aliases["hw"].endswith(".")


def test_a_file_that_is_too_large_is_refused_before_it_is_parsed(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=r"config.toml: larger than 64 kB$"):
        read_settings("# a comment\n" * 6000, tmp_path)


@pytest.mark.parametrize("text", ["a = " + "[" * 9000, "a = " + "{a = " * 5000])
def test_deep_arrays_and_tables_are_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=r"config.toml: arrays or tables are nested too deeply$"):
        read_settings(text, tmp_path)


@pytest.mark.parametrize("number", ["9" * 20, "9" * 5000, "0x" + "f" * 30_000, "-" + "9" * 30])
def test_integers_of_more_than_64_bits_are_refused(number: str, tmp_path: Path) -> None:
    for text in (f"speed = {number}", f"theme = {number}", f"[play]\nset = [1, {number}]"):
        with pytest.raises(BadParameter, match=r"got an integer of more than 64 bits$"):
            read_settings(text, tmp_path)


def test_a_long_key_is_clipped_in_the_message(tmp_path: Path) -> None:
    key = "a" * 30_000
    tables = ("", "[play]\n", "[keys]\n", "[keys.hex]\n")
    for text in (f"[{key}]", *(f"{table}{key} = 1" for table in tables)):
        (tmp_path / "dmplay.toml").write_text(text)
        refused = run_dmplay(tmp_path, "list")
        assert refused.returncode == 2
        assert len(refused.stderr) < 3000
