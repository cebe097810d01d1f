"""What bash, zsh and fish are told can follow, by the protocol that their scripts speak."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

from dmplay.cli.group import rejoin_bash_words
from dmplay.finding.names import problem_names
from tests.support.programs import loaded, run
from tests.support.terminals import clean_environment

pytestmark = pytest.mark.slow  # starts the program again and again


def asked(folder: Path, **env: str) -> list[str]:
    """The lines that the program answers."""
    done = run(folder, stdin=None, **env)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout.splitlines()


def bash(line: str, folder: Path) -> list[str]:
    """As bash asks: words apart at `:` and `=`, the cursor behind the last."""
    words = line.replace(":", " : ").replace("=", " = ").split(" ")
    words = [word for word in words[:-1] if word] + words[-1:]
    if len(words) > 1 and words[-2] in ":=" and not words[-1]:
        words.pop()  # the cursor touches the sign
    env = {"COMP_WORDS": " ".join(words), "COMP_CWORD": str(len(words) - 1)}
    return asked(folder, _DMPLAY_COMPLETE="complete_bash", **env)


def zsh(line: str, folder: Path) -> list[str]:
    told = asked(folder, _DMPLAY_COMPLETE="complete_zsh", _TYPER_COMPLETE_ARGS=line)
    return [re.findall(r'"([^"]*)"', one)[0].replace(r"\\:", ":") for one in told]


def fish(line: str, folder: Path) -> list[str]:
    env = {"_TYPER_COMPLETE_FISH_ACTION": "get-args", "_TYPER_COMPLETE_ARGS": line}
    told = asked(folder, _DMPLAY_COMPLETE="complete_fish", **env)
    return [one.partition("\t")[0] for one in told]


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a transcript, and the state of a game played before."""
    (tmp_path / "game.dmt").touch()
    (tmp_path / "notes.txt").touch()
    (tmp_path / "more").mkdir()
    kept = tmp_path / "state" / "dmplay" / "games"
    kept.mkdir(parents=True)
    (kept / "a.dmt").write_text("dmplay: 1\nseed: 1234\n\nturn: 0\n")
    return tmp_path


CASES = [
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
    ("dmplay figure F.1", [f"F.{n}" for n in range(10, 17)]),
    ("dmplay list PO", ["POMDP", "POMG"]),
    ("dmplay config ", ["show", "path"]),
    ("dmplay verfy --ag", ["--agent"]),
    ("dmplay hexworld:", ["straight-line"]),
    ("dmplay play hexworld:st", ["straight-line"]),
    ("dmplay play openspiel:kuhn", ["kuhn_poker"]),
    ("dmplay gymnasium:FrozenLake-", ["FrozenLake-v1"]),
    ("dmplay info pettingzoo:classic/r", ["classic/rps-v2"]),
    ("dmplay play machine-replacement --agent threshold:", ["repair=", "examine="]),
    ("dmplay play prisoners-dilemma --seat agent2=gri", ["grim"]),
]


@pytest.mark.parametrize("shell", [bash, zsh, fish], ids=["bash", "zsh", "fish"])
def test_what_can_follow_is_offered(shell: "type[object]", place: Path) -> None:
    """Bash is told only what it lacks of a word behind a colon or an equals sign."""
    for line, offered in CASES:
        found: list[str] = shell(line, place)  # type: ignore[call-arg, assignment]
        begun = "" if shell is bash else re.sub("[^:=]*$", "", line.rpartition(" ")[2])
        told = [one for one in found if not one.endswith("=VALUE")]
        assert told == [f"{begun}{one}" for one in offered], line


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
def test_bash_ends_no_word_that_goes_on_and_escapes_blanks(
    line: str, offered: list[str], place: Path
) -> None:
    (place / "a b.dmt").touch()
    assert bash(line, place) == offered


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_script_of_any_shell_can_be_asked_for(shell: str, place: Path) -> None:
    done = run(place, "--show-completion", shell)
    assert f"complete_{shell}" in done.stdout


def test_a_shell_that_is_not_known_is_refused(place: Path) -> None:
    done = run(place, "--install-completion", "csh")
    assert done.returncode == 2
    assert "'csh' is not one of 'bash', 'zsh', 'fish'" in done.stderr


@pytest.mark.parametrize(
    ("words", "at", "found"),
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
def test_words_that_bash_took_apart_are_joined(
    words: list[str], at: int, found: tuple[list[str], int, str]
) -> None:
    assert rejoin_bash_words(words, at) == found


def test_commands_problems_and_aliases_are_offered_first(place: Path) -> None:
    own = place / ".config" / "dmplay"
    own.mkdir(parents=True)
    (own / "config.toml").write_text('[aliases]\nhw = "play hexworld"\n')
    offered = bash("dmplay ", place)
    assert {"play", "verify", "shell", "hw", *problem_names()} <= set(offered)


def test_a_wrong_file_of_settings_does_not_stop_completion(place: Path) -> None:
    (place / "dmplay.toml").write_text("colour = 3\n")
    assert bash("dmplay play he", place) == ["hexworld"]


def test_completion_runs_no_code_of_others(place: Path) -> None:
    (place / "evil.py").write_text("open('ran', 'w').close()\n")
    bash("dmplay play ./evil.py:X --agent ", place)
    assert not (place / "ran").exists()


@pytest.mark.parametrize(
    ("variable", "line", "never"),
    [
        ("complete_bash", "dmplay he", {"numpy", "rich", "prompt_toolkit"}),
        ("complete_bash", "dmplay play he", {"numpy", "rich", "prompt_toolkit"}),
        ("complete_bash", "dmplay hexworld --agent o", {"rich", "prompt_toolkit"}),
    ],
)
def test_a_tab_loads_no_more_than_it_needs(
    variable: str, line: str, never: set[str], place: Path
) -> None:
    code = (
        "import sys\nfrom dmplay.__main__ import main\nsys.argv[1:] = []\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
    )
    env = {"_DMPLAY_COMPLETE": variable, "COMP_WORDS": line, "COMP_CWORD": str(line.count(" "))}
    assert not loaded(code, never, env)


@pytest.mark.slow
def test_bash_itself_completes_a_variant(place: Path) -> None:
    (place / "dmplay").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m dmplay "$@"\n')
    (place / "dmplay").chmod(0o755)
    script = """
        PATH=.:$PATH
        eval "$(_DMPLAY_COMPLETE=source_bash dmplay)"
        COMP_WORDS=(dmplay play hexworld : st) COMP_CWORD=4
        _dmplay_completion dmplay
        printf '%s\\n' "${COMPREPLY[@]}"
    """
    done = subprocess.run(
        ["bash", "-c", script], capture_output=True, text=True, env=clean_environment(place),
        cwd=place, check=True, timeout=60,
    )  # fmt: skip
    assert done.stdout == "straight-line\n"
