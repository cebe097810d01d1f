"""Tests of options that are numbers: other values are refused, wherever they come from."""

import re
from pathlib import Path

import pytest

from dmplay.cli.commands import COMMANDS, build_command
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import BadParameter
from dmplay.game.command_line_results import PlayCommand
from tests.support.programs import run_dmplay

NUMBER_OPTIONS = [
    (name, option.opts[0])
    for name in COMMANDS
    for option in build_command(name).params
    if option.metavar in {"X", "P", "N", "MB", "TURN"} and option.name != "workers"
]
REFUSAL = "got .*, expected a (whole )?number"


@pytest.mark.parametrize("option", ["speed", "play.rate", "solve.work", "run.until-se"])
@pytest.mark.parametrize("number", ["nan", "-nan", "inf", "1e400"])
def test_a_number_of_a_settings_file_is_finite(option: str, number: str, tmp_path: Path) -> None:
    (tmp_path / "state").mkdir()
    config_file = tmp_path / ".config" / "dmplay" / "config.toml"
    config_file.parent.mkdir(parents=True)
    table, _, name = option.rpartition(".")
    config_file.write_text((f"[{table}]\n" if table else "") + f"{name} = {number}\n")
    refused = run_dmplay(tmp_path, "list")
    assert refused.returncode == 2
    assert re.search(REFUSAL, refused.stderr)
    assert len(refused.stderr.splitlines()) == 1


@pytest.mark.parametrize(("name", "option"), NUMBER_OPTIONS)
def test_a_number_of_the_command_line_is_finite_and_in_plain_digits(name: str, option: str) -> None:
    for value in ("nan", "inf", "-inf", "1e400", "9" * 400, "x", "", " 7", "1_000", "\u0663"):
        refusal = (
            f"^{option}: got '{value}', expected (a (whole )?number|at most 9223372036854775807)"
        )
        with pytest.raises(BadParameter, match=refusal):
            interpret_command([name, f"{option}={value}"])


@pytest.mark.parametrize("value", ["", "x", "0", "-1", "1.5", "nan", "\u0663"])
def test_a_number_of_workers_is_auto_or_a_whole_number(value: str) -> None:
    expected = f"^--workers: got '{value}', expected auto or a whole number of at least 1$"
    with pytest.raises(BadParameter, match=expected):
        interpret_command(["run", "catch", f"--workers={value}"])


@pytest.mark.parametrize("number", ["nan", "-nan", "inf", "-inf", "Infinity", "1e400"])
def test_a_rate_after_a_space_is_finite(number: str) -> None:
    arguments = ["play", "hexworld", "--agent", "random", "--turns", "1", "--rate", number]
    expected = f"^--rate: got '{number}', expected a number from 0.1 to 1000$"
    with pytest.raises(BadParameter, match=expected):
        interpret_command(arguments)


def test_a_rate_may_begin_with_a_point() -> None:
    command = interpret_command(["play", "hexworld", "--agent", "random", "--rate", ".5"])
    assert isinstance(command, PlayCommand)
    assert command.realtime_rate == 0.5


def test_a_number_of_an_environment_variable_is_finite(tmp_path: Path) -> None:
    refused = run_dmplay(tmp_path, "hexworld", "--agent", "random", DMPLAY_SPEED="nan")
    assert refused.returncode == 2
    assert refused.stderr.startswith("error: DMPLAY_SPEED: got 'nan', expected a number")
