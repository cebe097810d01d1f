"""No front end and no command tells two games apart that a seat may not tell apart."""

from collections.abc import Callable
from itertools import product
from pathlib import Path

import pytest

import dmplay
from dmplay.finding import problems
from dmplay.game.formats import EXPORT_FORMATS
from dmplay.words.commands import COMMANDS
from dmplay.words.plain import JsonReporter, SentenceReporter
from tests.privacy.arguments import (
    AFTER,
    ASKING,
    KEYS_ASKED,
    MOVING,
    READING,
    moves,
    questions,
    words,
)
from tests.privacy.fronts import FILE, FRONTS, IN_LINES, Told, alike, both, on_screen, to_the_end
from tests.privacy.pairs import EVERY, GUARDED, LOOKED_AT, MOST, TURNS, Pair, Side, pair
from tests.support.cases import same

LAST = [(name, len(dmplay.load_problem(name).agents) - 1) for name in GUARDED]  # seats
FEW = ("machine-replacement", "predator-prey:circle")
every_guarded = pytest.mark.parametrize("name", EVERY)
every_last_seat = pytest.mark.parametrize(("name", "seat"), LAST)
SLOWLY = pytest.param("plain", marks=pytest.mark.slow)
ENDING = [pytest.param(one, marks=() if one == "plain" else pytest.mark.slow) for one in FRONTS]


def test_every_command_and_format_is_asked_something() -> None:
    assert {*ASKING, *READING, *MOVING} == {command.name for command in COMMANDS}
    exported = " ".join(READING["export"])
    assert all(f"{{file}} --{name}" in exported for name in EXPORT_FORMATS)


def test_the_problems_are_those_that_hide_a_state_or_a_choice() -> None:
    stems = {problems.builtin_stem(dmplay.load_problem(name)) for name in GUARDED}
    assert stems == {
        "", "crying_baby", "machine_replacement", "catch", "multicaregiver_crying_baby",
        "collaborative_predator_prey", "prisoners_dilemma", "rock_paper_scissors",
        "travelers_dilemma", "predator_prey",
    }  # fmt: skip


@every_guarded
def test_the_games_are_as_they_were_found_and_differ_in_what_the_seat_may_not_know(
    name: str, place: Path
) -> None:
    twins, sessions = pair(name, 0), []
    for number, side in enumerate(twins.sides):
        game = twins.begun(side, Path(f"{number}.dmt"))
        for joint in side.actions[:LOOKED_AT]:
            game.choose(joint[0])
        told = [turn.actions.tolist() for turn in game.session.turns]
        assert told == [[*joint] for joint in side.actions[:LOOKED_AT]]
        sessions.append(game.session)
    assert sessions[0].uniform_source != sessions[1].uniform_source
    assert twins.problem.partially_observable == (not same(sessions[0].state, sessions[1].state))
    last = [side.actions[-1] for side in twins.sides]
    assert last[0][0] == last[1][0]
    assert all(one != other for one, other in zip(last[0][1:], last[1][1:], strict=True))


@pytest.mark.parametrize("front", [SLOWLY, "json", "shell"])
@every_guarded
def test_no_question_tells_games_apart(name: str, front: str, place: Path) -> None:
    twins = pair(name, 0)
    lines = [*moves(twins), *questions(twins, LOOKED_AT, ASKING)]
    alike(*both(twins, place, lambda side: FRONTS[front](twins.begun(side, FILE), lines)))


@every_guarded
def test_no_key_and_no_slip_tells_games_apart(name: str, place: Path) -> None:
    twins = pair(name, 0)
    lines = [*moves(twins), *questions(twins, LOOKED_AT), *KEYS_ASKED]
    alike(*both(twins, place, lambda side: FRONTS["screen"](twins.begun(side, FILE), lines)))


@pytest.mark.parametrize("front", ["screen", SLOWLY, "json"])
@every_guarded
def test_no_ghost_tells_games_apart(name: str, front: str, place: Path) -> None:
    twins = pair(name, 0)
    lines = [*moves(twins), *AFTER]

    def play(side: Side) -> list[Told]:
        return FRONTS[front](twins.begun(side, FILE, ghost="random"), lines)

    alike(*both(twins, place, play))


@pytest.mark.slow
@every_last_seat
def test_no_question_and_no_small_screen_of_the_last_seat_tells_games_apart(
    name: str, seat: int, place: Path
) -> None:
    twins = pair(name, seat)
    early = [
        *questions(twins, 0, ASKING, READING),
        *moves(twins, 0, 1),
        *questions(twins, 1, ASKING),
        *moves(twins, 1),
    ]
    late = questions(twins, LOOKED_AT, ASKING)
    small = [*moves(twins), *late, *KEYS_ASKED]
    shell, screen = FRONTS["shell"], on_screen((40, 12))
    alike(*both(twins, place, lambda side: shell(twins.begun(side, FILE), early + late)))
    alike(*both(twins, place, lambda side: screen(twins.begun(side, FILE), small)))


def moved(twins: Pair, front: str, line: str, turn: int) -> Callable[[Side], list[Told]]:
    """What comes of a game that a line moves elsewhere, and of a turn there."""
    lines = [*moves(twins), "save copy.dmt", line.format(**words(twins, turn)), *AFTER]
    lines += [*moves(twins, turn, turn + 1), *AFTER] if turn < LOOKED_AT else []
    return lambda side: FRONTS[front](twins.begun(side, FILE), lines)


@pytest.mark.parametrize("command", MOVING)
def test_no_command_that_moves_a_game_tells_it_apart(command: str, place: Path) -> None:
    for line, turn in MOVING[command].items():
        twins = pair("multicaregiver-crying-baby", 0)
        alike(*both(twins, place, moved(twins, "shell", line, turn)))


@pytest.mark.slow
@pytest.mark.parametrize("front", ["screen", "plain", "json"])
@pytest.mark.parametrize("command", MOVING)
def test_no_command_that_moves_a_game_tells_it_apart_at_any_front_end(
    command: str, front: str, place: Path
) -> None:
    for name, (line, turn) in product(FEW, MOVING[command].items()):
        twins = pair(name, 0)
        alike(*both(twins, place, moved(twins, front, line, turn)))


@pytest.mark.slow
@pytest.mark.parametrize("name", MOST)
def test_no_command_that_moves_it_tells_any_game_apart(name: str, place: Path) -> None:
    twins = pair(name, 0)
    for places in MOVING.values():
        for line, turn in places.items():
            alike(*both(twins, place, moved(twins, "shell", line, turn)))


@pytest.mark.parametrize("front", ENDING)
@every_guarded
def test_the_end_tells_what_was_hidden(name: str, front: str, place: Path) -> None:
    twins = pair(name, 0)
    fronts = FRONTS | {
        "plain": to_the_end(SentenceReporter(IN_LINES)),
        "json": to_the_end(JsonReporter()),
    }
    end = moves(twins, 0, TURNS)
    one, other = (
        [each.came.replace(str(side.seed), "") for each in told]
        for side, told in zip(
            twins.sides,
            both(twins, place, lambda side: fronts[front](twins.begun(side, FILE), end)),
            strict=True,
        )
    )
    assert one[:LOOKED_AT] == other[:LOOKED_AT]
    if twins.problem.partially_observable:
        assert one != other
