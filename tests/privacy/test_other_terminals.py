"""Other terminals, other users and shell completion learn no secret of a running game."""

from itertools import chain
from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.game.export_formats import EXPORT_FORMATS
from dmplay.game.game_series import GameController
from dmplay.ui.shell.commands import COMMANDS, run_line
from dmplay.ui.shell.completer import complete_line
from tests.privacy.command_arguments import PROGRAM_ARGUMENTS
from tests.privacy.front_ends import (
    TRANSCRIPT_PATH,
    Response,
    assert_indistinguishable,
    iter_readable_files,
    play_both,
)
from tests.privacy.indistinguishable_pairs import (
    FAST_BELIEF_PROBLEMS,
    SECRET_PROBLEM_PARAMS,
    SHARED_TURNS,
    Side,
    find_pair,
)
from tests.privacy.other_terminals import (
    PROGRAM_COMMANDS,
    assert_no_leak_outside,
    list_completions,
    start_unfinished_game,
)

every_secret_problem = pytest.mark.parametrize("name", SECRET_PROBLEM_PARAMS)


def test_every_program_command_and_format_is_covered() -> None:
    assert {*PROGRAM_ARGUMENTS} == {*PROGRAM_COMMANDS}
    assert all(f"{{file}} --{name}" in PROGRAM_ARGUMENTS["export"] for name in EXPORT_FORMATS)


@pytest.mark.parametrize("command", PROGRAM_ARGUMENTS)
def test_no_command_in_another_terminal_reveals_a_running_game(
    command: str, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert_no_leak_outside(
        find_pair("multicaregiver-crying-baby", 0), monkeypatch, command, killed=False
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", FAST_BELIEF_PROBLEMS)
def test_no_command_in_another_terminal_reveals_a_killed_game(
    name: str, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for command in ("play", "resume", "replay", "shell", "verify", "export", "review", "branch"):
        assert_no_leak_outside(find_pair(name, 0), monkeypatch, command, killed=True)


@pytest.mark.parametrize("record", [TRANSCRIPT_PATH, None])
@every_secret_problem
def test_other_users_can_read_nothing_that_is_not_revealed(
    name: str, record: Path | None, game_folder: Path
) -> None:
    """If everything is visible, the seeds are equal and only the choice differs."""
    twins = find_pair(name, len(find_pair(name, 0).problem.agents) - 1)
    if not twins.problem.partially_observable:
        same_seed = twins.second._replace(seed=twins.first.seed)
        twins = twins._replace(second=same_seed)

    def play(side: Side) -> list[Response]:
        game = twins.begun(side, record, alone=False)
        for action in chain(*side.actions[:SHARED_TURNS], side.actions[-1][:-1]):
            game.choose(action)
        for line in ("save copy.dmt", "transcript", "hint", "look"):
            run_line(GameController(game, interpret_command), line)
        return [*iter_readable_files(game_folder)]

    first, second = play_both(twins, game_folder, play)
    assert_indistinguishable(first, second)
    assert first


@every_secret_problem
def test_no_completion_at_the_prompt_reveals_which_game_it_is(name: str, game_folder: Path) -> None:
    def play(side: Side) -> list[Response]:
        table = start_unfinished_game(find_pair(name, 0), side, None)
        lines = ["", "play hexworld --seed ", *(f"{command.name} " for command in COMMANDS)]
        return [Response(line, " ".join(complete_line(table, line))) for line in lines]

    assert_indistinguishable(*play_both(find_pair(name, 0), game_folder, play))


@pytest.mark.slow
@pytest.mark.parametrize("name", FAST_BELIEF_PROBLEMS)
def test_no_shell_completion_reveals_which_game_it_is(
    name: str, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    twins = find_pair(name, 0)
    assert_indistinguishable(
        *play_both(twins, game_folder, lambda side: list_completions(twins, side, monkeypatch))
    )
