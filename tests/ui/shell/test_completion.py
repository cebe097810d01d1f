"""Tests of completion in bash, zsh and fish, by the protocol of their completion scripts."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from dmplay.cli.shell_completion import rejoin_bash_words
from dmplay.registry.builtin_names import problem_names
from tests.support.programs import list_loaded_modules, run_dmplay
from tests.support.terminals import clean_environment

pytestmark = pytest.mark.slow  # starts many processes


def request_completions(folder: Path, **env: str) -> list[str]:
    """Return the lines of the program's completion."""
    completed = run_dmplay(folder, stdin=None, **env)
    assert (completed.returncode, completed.stderr) == (0, "")
    return completed.stdout.splitlines()


def complete_in_bash(line: str, folder: Path) -> list[str]:
    """Complete a line as bash does: words split at `:` and `=`, the cursor behind the last."""
    words = line.replace(":", " : ").replace("=", " = ").split(" ")
    words = [word for word in words[:-1] if word] + words[-1:]
    if len(words) > 1 and words[-2] in ":=" and not words[-1]:
        words.pop()  # the cursor directly follows the sign
    env = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    return request_completions(folder, _DMPLAY_COMPLETE="complete_bash", **env)


def complete_in_zsh(line: str, folder: Path) -> list[str]:
    rows = request_completions(folder, _DMPLAY_COMPLETE="complete_zsh", _TYPER_COMPLETE_ARGS=line)
    entries = shlex.split(rows[0].partition("(")[2].rpartition(")")[0].replace(") complete=(", " "))
    return [re.sub(r"(?<!\\):.*", "", entry).replace(r"\:", ":") for entry in entries]


def complete_in_fish(line: str, folder: Path) -> list[str]:
    env = {"_TYPER_COMPLETE_FISH_ACTION": "get-args", "_TYPER_COMPLETE_ARGS": line}
    rows = request_completions(folder, _DMPLAY_COMPLETE="complete_fish", **env)
    return [row.partition("\t")[0] for row in rows]


@pytest.fixture
def home_folder(tmp_path: Path) -> Path:
    """Create a folder with a transcript and a saved game."""
    (tmp_path / "game.dmt").touch()
    (tmp_path / "notes.txt").touch()
    (tmp_path / "more").mkdir()
    games_folder = tmp_path / "state" / "dmplay" / "games"
    games_folder.mkdir(parents=True)
    (games_folder / "a.dmt").write_text("dmplay: 1\nseed: 1234\n\nturn: 0\n")
    return tmp_path


COMPLETION_CASES = [
    ("dmplay he", ["hexworld"]),
    ("dmplay play p", ["predator-prey", "prisoners-dilemma"]),
    ("dmplay solve ca", ["cart-pole", "catch"]),
    ("dmplay hexworld --ag", ["--agent"]),
    ("dmplay hexworld --agent o", ["optimal"]),
    ("dmplay hexworld --seed ", ["1234"]),
    ("dmplay hexworld --set s", ["slip="]),
    ("dmplay play hexworld -V ", ["straight-line"]),
    ("dmplay play prisoners-dilemma --turns 3 --vs gri", ["grim"]),
    ("dmplay play prisoners-dilemma --seat ", ["agent1=", "agent2="]),
    ("dmplay hexworld --keys ", ["vi", "left", "arrows", "digits"]),
    ("dmplay hexworld --theme h", ["high-contrast"]),
    ("dmplay replay ", ["game.dmt", "more/", "state/"]),
    ("dmplay plot F.1", ["F.1", *(f"F.{n}" for n in range(10, 17))]),
    ("dmplay list PO", ["POMDP", "POMG"]),
    ("dmplay config ", ["show", "path"]),
    ("dmplay verfy --ag", ["--agent"]),
    ("dmplay hexworld:", ["straight-line"]),
    ("dmplay play hexworld:st", ["straight-line"]),
    ("dmplay play machine-replacement --agent threshold:", ["repair=", "examine="]),
    ("dmplay play prisoners-dilemma --seat agent2=gri", ["grim"]),
    ("dmplay hexworld --agent=op", ["optimal"]),
    ("dmplay play prisoners-dilemma --seat=agent2=gri", ["grim"]),
    ("dmplay hexworld --theme=h", ["high-contrast"]),
    ("dmplay machine-replacement --agent=threshold:re", ["repair="]),
]
LIBRARY_COMPLETION_CASES = [
    ("dmplay play openspiel:kuhn", ["kuhn_poker"]),
    ("dmplay gymnasium:FrozenLake-", ["FrozenLake-v1"]),
    ("dmplay info pettingzoo:classic/r", ["classic/rps-v2"]),
]


@pytest.mark.parametrize(
    "cases",
    [
        COMPLETION_CASES,
        pytest.param(
            LIBRARY_COMPLETION_CASES,
            marks=pytest.mark.extra("gymnasium", "openspiel", "pettingzoo"),
        ),
    ],
    ids=["built in", "libraries"],
)
@pytest.mark.parametrize(
    "shell", [complete_in_bash, complete_in_zsh, complete_in_fish], ids=["bash", "zsh", "fish"]
)
def test_valid_completions_are_offered(
    shell: "type[object]", cases: list[tuple[str, list[str]]], home_folder: Path
) -> None:
    """Bash is offered only the missing part of a word after a colon or an equals sign."""
    for line, offered in cases:
        completions: list[str] = shell(line, home_folder)  # type: ignore[call-arg, assignment]
        prefix = "" if shell is complete_in_bash else re.sub("[^:=]*$", "", line.rpartition(" ")[2])
        values = [value for value in completions if not value.endswith("=VALUE")]
        expected = [f"{prefix}{value}" for value in offered]
        if shell is complete_in_zsh:  # unfinished words come first
            values, expected = sorted(values), sorted(expected)
        assert values == expected, line


@pytest.mark.parametrize(
    ("line", "offered"),
    [
        ("dmplay hexworld --set sl", ["slip=", "slip=VALUE"]),
        ("dmplay play prisoners-dilemma --seat agent2", ["agent2=", "agent2=VALUE"]),
        ("dmplay machine-replacement --agent threshold:re", ["repair=", "repair=VALUE"]),
        ("dmplay review mor", ["more/", "more/..."]),
        ("dmplay review a", ["a\\ b.dmt"]),
    ],
)
def test_bash_does_not_end_incomplete_words_and_escapes_blanks(
    line: str, offered: list[str], home_folder: Path
) -> None:
    (home_folder / "a b.dmt").touch()
    assert complete_in_bash(line, home_folder) == offered


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_of_every_shell_is_printed(shell: str, home_folder: Path) -> None:
    completed = run_dmplay(home_folder, "--show-completion", shell)
    assert f"complete_{shell}" in completed.stdout


def test_an_unknown_shell_is_refused(home_folder: Path) -> None:
    completed = run_dmplay(home_folder, "--install-completion", "csh")
    assert completed.returncode == 2
    assert "unknown value 'csh'; did you mean zsh" in completed.stderr


@pytest.mark.parametrize(
    ("words", "cursor", "expected"),
    [
        (["dmplay", ""], 1, (["dmplay", ""], 1, "")),
        (["dmplay", "a", ":"], 2, (["dmplay", "a:"], 1, "a:")),
        (["dmplay", "a", ":", "b"], 3, (["dmplay", "a:b"], 1, "a:")),
        (["dmplay", "a", ":", "b", ""], 4, (["dmplay", "a:b", ""], 2, "")),
        (["dmplay", "a", ":", "b", "=", "1"], 5, (["dmplay", "a:b=1"], 1, "a:b=")),
        (["dmplay"], 1, (["dmplay", ""], 1, "")),
        (["dmplay", "--set", "a", "="], 3, (["dmplay", "--set", "a="], 2, "a=")),
        (["dmplay", "--set", "=", "a"], 3, (["dmplay", "--set=a"], 1, "")),
        (["dmplay", "--set", "=", "a", "="], 4, (["dmplay", "--set=a="], 1, "a=")),
    ],
)
def test_words_that_bash_split_are_joined(
    words: list[str], cursor: int, expected: tuple[list[str], int, str]
) -> None:
    assert rejoin_bash_words(words, cursor) == expected


def test_commands_problems_and_aliases_are_offered_first(home_folder: Path) -> None:
    config_folder = home_folder / ".config" / "dmplay"
    config_folder.mkdir(parents=True)
    (config_folder / "config.toml").write_text('[aliases]\nhw = "play hexworld"\n')
    offered = complete_in_bash("dmplay ", home_folder)
    assert {"play", "verify", "shell", "hw", *problem_names()} <= set(offered)


def test_an_invalid_settings_file_does_not_stop_completion(home_folder: Path) -> None:
    (home_folder / "dmplay.toml").write_text("colour = 3\n")
    assert complete_in_bash("dmplay play he", home_folder) == ["hexworld"]


def test_completion_runs_no_user_code(home_folder: Path) -> None:
    (home_folder / "evil.py").write_text("open('ran', 'w').close()\n")
    complete_in_bash("dmplay play ./evil.py:X --agent ", home_folder)
    assert not (home_folder / "ran").exists()


@pytest.mark.parametrize(
    ("variable", "line", "unwanted_modules"),
    [
        ("complete_bash", "dmplay he", {"numpy", "rich", "prompt_toolkit"}),
        ("complete_bash", "dmplay play he", {"numpy", "rich", "prompt_toolkit"}),
        ("complete_bash", "dmplay hexworld --agent o", {"rich", "prompt_toolkit"}),
    ],
)
def test_completion_imports_only_the_modules_it_needs(
    variable: str, line: str, unwanted_modules: set[str], home_folder: Path
) -> None:
    code = (
        "import sys\nfrom dmplay.__main__ import main\nsys.argv[1:] = []\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
    )
    env = {"_DMPLAY_COMPLETE": variable, "COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
    assert not list_loaded_modules(code, unwanted_modules, env)


@pytest.mark.slow
def test_a_real_bash_completes_a_variant(home_folder: Path) -> None:
    (home_folder / "dmplay").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m dmplay "$@"\n')
    (home_folder / "dmplay").chmod(0o755)
    script = """
        PATH=.:$PATH
        eval "$(_DMPLAY_COMPLETE=source_bash dmplay)"
        COMP_WORDS=(dmplay play hexworld : st) COMP_CWORD=4
        _dmplay_completion dmplay
        printf '%s\\n' "${COMPREPLY[@]}"
    """
    completed = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, env=clean_environment(home_folder),
        cwd=home_folder, check=True, timeout=60,
    )  # fmt: skip
    assert completed.stdout == "straight-line\n"
