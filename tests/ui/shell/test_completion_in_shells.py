"""Tests of the installed completion in the real bash, zsh and fish, each in a terminal."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from string import ascii_lowercase

import pytest

from dmplay.cli.shell_completion import is_safe_word
from dmplay.game.completion.agents_seats_and_parameters import complete_seats
from tests.support.shells import SHELL_COMMANDS, CompletingShell, is_installed

pytestmark = pytest.mark.slow
# Each would create the file pwned if a shell evaluated it, when offered or when run.
HOSTILE_WORDS = (
    r"\$(>pwned)", r"\\$(>pwned)", "$(>pwned)", "`>pwned`", "x;>pwned", "x'$(>pwned)'", "<(>pwned)",
    "=(>pwned)", "x))';>pwned;'((", "${x:-$(>pwned)}", "x|>pwned", "x&>pwned", ">pwned",
    'x"$(>pwned)"',
)  # fmt: skip
SEAT_WORDS = HOSTILE_WORDS[:-1]  # the files cannot quote a quotation mark
NAMES_IN_POMDPS = [word for word in SEAT_WORDS if ":" not in word]  # a colon ends a keyword


def format_dec_pomdp(agents: Sequence[str]) -> str:
    """Return a Dec-POMDP of one state, in which each agent has one action and one observation."""
    ones = "1\n" * len(agents)
    return (
        f"agents: {' '.join(agents)}\ndiscount: 1\nvalues: reward\nstates: 1\nstart: uniform\n"
        f"actions:\n{ones}observations:\n{ones}"
        "T: * : uniform\nO: * : uniform\nR: * : * : * : * : 0\n"
    )


def format_normal_form(agents: Sequence[str]) -> str:
    """Return a game in which each agent has one action."""
    names = " ".join(f'"{agent}"' for agent in agents)
    counts, payoffs = (" ".join(digit * len(agents)) for digit in "10")
    return f'NFG 1 R "a game" {{ {names} }} {{ {counts} }}\n\n{payoffs}\n'


def shells() -> list[object]:
    """Return the shells as parameters; one that the machine lacks is skipped."""
    return [
        pytest.param(
            shell,
            marks=pytest.mark.skipif(not is_installed(shell), reason=f"{shell} is not installed"),
        )
        for shell in SHELL_COMMANDS
    ]


@pytest.fixture(scope="module", params=shells())
def folder_and_shell(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Path, CompletingShell]]:
    folder = tmp_path_factory.mktemp(request.param)
    with CompletingShell(request.param, folder) as shell:
        yield folder, shell


def is_untouched(folder: Path) -> bool:
    """Return whether no word was executed."""
    return not [*folder.rglob("pwned")]


def test_a_file_can_name_a_hostile_seat(tmp_path: Path) -> None:
    """Otherwise the test of seats below would try nothing."""
    (tmp_path / "game.dpomdp").write_text(format_dec_pomdp(NAMES_IN_POMDPS))
    seats = complete_seats(str(tmp_path / "game.dpomdp"))
    assert seats == [f"{word}=" for word in NAMES_IN_POMDPS]
    agents = [f"{letter}{word}" for letter, word in zip(ascii_lowercase, SEAT_WORDS, strict=False)]
    (tmp_path / "game.nfg").write_text(format_normal_form(agents))
    seats = complete_seats(str(tmp_path / "game.nfg"))
    assert [seat[0] for seat in seats] == [agent[0] for agent in agents]
    assert sum("$(>pwned)" in seat for seat in seats) >= 5  # some characters are replaced


@pytest.mark.slow
def test_ordinary_words_are_completed(folder_and_shell: tuple[Path, CompletingShell]) -> None:
    folder, shell = folder_and_shell
    (folder / "a b.dmt").touch()
    assert "hexworld" in shell.complete("dmplay he")
    assert "--agent" in shell.complete("dmplay hexworld --ag")
    assert r"a\ b.dmt" in shell.complete("dmplay verify a")
    assert "straight-line" in shell.complete("dmplay info hexworld:st")


@pytest.mark.slow
@pytest.mark.parametrize(
    ("line", "words"),
    [
        ("dmplay solve hexworld --set sl\tx", "<--set><slip=x>"),
        ("dmplay hexworld --agent search:dep\tx", "<--agent><search:depth=x>"),
        ("dmplay hexworld --agent scr\tjump", "<--agent><script:jump>"),
        ("dmplay prisoners-dilemma --seat agent2\tnone", "<--seat><agent2=none>"),
        ("dmplay hexworld --agent=op\t--bogus", "<--agent=optimal><--bogus>"),
        ("dmplay hexworld --agent=search:dep\tx", "<--agent=search:depth=x>"),
        ("dmplay hexworld --set=sl\tx", "<--set=slip=x>"),
    ],
)
def test_a_space_follows_only_a_finished_word(
    line: str, words: str, folder_and_shell: tuple[Path, CompletingShell]
) -> None:
    """The line goes on after Tab, and the words of the line that is run show what it was."""
    _, shell = folder_and_shell
    assert words in shell.complete_and_run(line)


@pytest.mark.slow
def test_seats_that_a_file_names_are_not_executed(
    folder_and_shell: tuple[Path, CompletingShell],
) -> None:
    folder, shell = folder_and_shell
    (folder / "game.dpomdp").write_text(format_dec_pomdp(NAMES_IN_POMDPS))
    shell.complete("dmplay ./game.dpomdp --seat ", tabs=2)
    assert is_untouched(folder)
    agents = [f"{letter}{word}" for letter, word in zip(ascii_lowercase, SEAT_WORDS, strict=False)]
    (folder / "game.nfg").write_text(format_normal_form(agents))
    for agent in agents:
        shell.complete_and_run(f"dmplay ./game.nfg --seat {agent[0]}")
        assert is_untouched(folder), agent


@pytest.mark.slow
def test_seeds_of_saved_games_are_not_executed(
    folder_and_shell: tuple[Path, CompletingShell],
) -> None:
    folder, shell = folder_and_shell
    games_folder = folder / "home" / "state" / "dmplay" / "games"
    games_folder.mkdir(parents=True)
    for word in HOSTILE_WORDS[:3]:
        text = f"dmplay: 1\nseed: {word}\n\nturn: 0\n\nend: 1\n"
        (games_folder / "1.dmt").write_text(text)
        shell.complete_and_run("dmplay list --seed ")
        shell.complete("dmplay hexworld --seed ", tabs=2)
    assert is_untouched(folder)


@pytest.mark.slow
def test_names_of_files_and_folders_are_not_executed(
    folder_and_shell: tuple[Path, CompletingShell],
) -> None:
    folder, shell = folder_and_shell
    for number, word in enumerate(HOSTILE_WORDS):
        files_folder = folder / f"files{number}"
        (files_folder / f"{word}.dmt").mkdir(parents=True)
        shell.complete(f"dmplay verify files{number}/", tabs=2)
    (folder / "$(>pwned)").mkdir()
    shell.complete("dmplay verify ", tabs=3)
    (folder / "$(>pwned)").rmdir()
    assert is_untouched(folder)


@pytest.mark.slow
def test_aliases_are_not_executed(folder_and_shell: tuple[Path, CompletingShell]) -> None:
    folder, shell = folder_and_shell
    config_file = folder / "home" / ".config" / "dmplay" / "config.toml"
    config_file.parent.mkdir(parents=True, exist_ok=True)
    config_file.write_text('[aliases]\n"zz$(>pwned)" = "list"\n"zy`>pwned`" = "list"\n')
    shell.complete_and_run("dmplay zz")
    shell.complete("dmplay z", tabs=3)
    assert is_untouched(folder)


@pytest.mark.parametrize("word", HOSTILE_WORDS)
def test_hostile_words_are_not_safe(word: str) -> None:
    assert not is_safe_word(word, "")


def test_names_of_problems_agents_and_files_are_safe() -> None:
    words = (
        "hexworld", "gymnasium:FrozenLake-v1", "classic/rps-v2", "threshold:repair=", "agent2=grim",
        "../a b.dmt", "spiel_für_zwei.dmt", "script:left,right",
    )  # fmt: skip
    assert all(is_safe_word(word, "") for word in words)


def test_a_name_is_offered_as_an_option_only_where_one_is_begun() -> None:
    assert is_safe_word("--agent", "--ag")
    assert not is_safe_word("--trust.dmt", "")


def test_blank_endless_and_expanding_words_are_not_safe() -> None:
    words = ("", " a", "a ", "a" * 1001, "~root", "=ls", "@x", "a\nb", "a\u202eb", "\udc80", "*")
    assert not any(is_safe_word(word, "") for word in words)
