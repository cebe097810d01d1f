"""Another terminal, another user and the shell's completion learn no secret of a game in play."""

from itertools import chain
from pathlib import Path

import pytest

from dmplay.cli.errands import interpret_command
from dmplay.game.formats import EXPORT_FORMATS
from dmplay.game.table import GameController
from dmplay.words.commands import COMMANDS, run_line
from dmplay.words.completion.candidates import complete_line
from tests.privacy.arguments import OUTSIDE
from tests.privacy.elsewhere import PROGRAM, completed, left, outside
from tests.privacy.fronts import FILE, Told, alike, both, readable
from tests.privacy.pairs import EVERY, LOOKED_AT, MOST, Side, pair

every_guarded = pytest.mark.parametrize("name", EVERY)


def test_every_command_of_the_program_and_every_format_is_tried() -> None:
    assert {*OUTSIDE} == {*PROGRAM}
    assert all(f"{{file}} --{name}" in OUTSIDE["export"] for name in EXPORT_FORMATS)


@pytest.mark.parametrize("command", OUTSIDE)
def test_no_command_elsewhere_tells_a_game_in_play_apart(
    command: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    outside(pair("multicaregiver-crying-baby", 0), monkeypatch, command, killed=False)


@pytest.mark.slow
@pytest.mark.parametrize("name", MOST)
def test_no_command_elsewhere_tells_a_killed_game_apart(
    name: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for command in ("play", "resume", "replay", "shell", "verify", "export", "review", "branch"):
        outside(pair(name, 0), monkeypatch, command, killed=True)


@pytest.mark.parametrize("record", [FILE, None])
@every_guarded
def test_other_users_read_nothing_of_what_is_not_revealed(
    name: str, record: Path | None, place: Path
) -> None:
    """Where all is seen the dice are the same here, and only the choice is another."""
    twins = pair(name, len(pair(name, 0).problem.agents) - 1)
    if not twins.problem.partially_observable:
        same_dice = twins.other._replace(seed=twins.one.seed)
        twins = twins._replace(other=same_dice)

    def play(side: Side) -> list[Told]:
        game = twins.begun(side, record, alone=False)
        for action in chain(*side.actions[:LOOKED_AT], side.actions[-1][:-1]):
            game.choose(action)
        for line in ("save copy.dmt", "transcript", "hint", "look"):
            run_line(GameController(game, interpret_command), line)
        return [*readable(place)]

    one, other = both(twins, place, play)
    alike(one, other)
    assert one


@every_guarded
def test_no_completion_at_the_prompt_tells_games_apart(name: str, place: Path) -> None:
    def play(side: Side) -> list[Told]:
        table = left(pair(name, 0), side, None)
        lines = ["", "play hexworld --seed ", *(f"{each.name} " for each in COMMANDS)]
        return [Told(line, " ".join(complete_line(table, line))) for line in lines]

    alike(*both(pair(name, 0), place, play))


@pytest.mark.slow
@pytest.mark.parametrize("name", MOST)
def test_no_completion_of_a_shell_tells_games_apart(
    name: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    twins = pair(name, 0)
    alike(*both(twins, place, lambda side: completed(twins, side, monkeypatch)))
