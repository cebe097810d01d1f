"""Hints, overlays, reviews and an agent's values tell the same numbers."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.advice.adviser import MOST, Advice, decimals, fewest, fixed
from dmplay.advice.review import Move, moves
from dmplay.chance import Reals
from dmplay.core import Policy
from dmplay.finding import agents
from dmplay.game.game import Game
from dmplay.game.request import Request
from dmplay.game.seats import HUMAN
from dmplay.game.start import new
from dmplay.session import Session
from dmplay.solvers.value_iteration import best
from tests.support.cases import CASES, load, small
from tests.support.screens import seated

TURNS = 3
SEATS = [(name, seat) for name in CASES for seat in range(len(load(name).agents))]
pytestmark = pytest.mark.usefixtures("coarse")
every_seat = pytest.mark.parametrize(("name", "seat"), SEATS)


def game(name: str, seat: int) -> Game:
    """A game of one person and the usual others."""
    problem = small(name)
    who = [agents.roster(problem, i).partner for i in range(len(problem.agents))]
    others = [None if i == seat else dmplay.agent(problem, i, w) for i, w in enumerate(who)]
    who[seat] = HUMAN
    return seated(name, Session(problem, dmplay.Dice(11), others, limit=TURNS), who)


@cache
def adviser_of(name: str, seat: int) -> Policy:
    problem = small(name)
    found = agents.adviser(problem, seat, TURNS)
    return found[1] if found else dmplay.agent(problem, seat, "random")


def values(played: Game, seat: int) -> Reals | None:
    """What an adviser's `values` says that follows these turns by itself."""
    session, adviser = played.session, adviser_of(played.name, seat)
    memory = adviser.begin(session.observation(seat, 0)[None])
    for turn in range(1, len(session.turns) + 1):
        memory = adviser.update(memory, session.percept(seat, turn))
    known = adviser.values(memory)
    return None if known is None else known[0]


def situations(played: Game, seat: int) -> Iterator[int]:
    """The turns of a game in which the person does something else each time, and their number."""
    for turn in range(TURNS):
        if played.session.over:
            return
        yield turn
        labels = played.problem.actions[seat].labels
        able = played.session.legal(seat)
        if not labels:
            played.choose(0.5 * turn)
        else:
            legal = np.arange(len(labels)) if able is None else np.flatnonzero(able)
            played.choose(float(legal[turn % len(legal)]))


def told(hint: str) -> tuple[str, dict[str, str]]:
    """The advice of a hint, and each number in it."""
    found = re.fullmatch(r"hint \(([^)]+)\): (\S+?)(?:\. values: (.*))?", hint)
    assert found, hint
    pairs = [pair.rsplit(" ", 1) for pair in (found[3] or "").split(", ") if pair]
    return found[2], dict(pairs)


@every_seat
def test_a_hint_is_the_best_of_the_values_that_it_tells(name: str, seat: int) -> None:
    played = game(name, seat)
    if agents.roster(played.problem, seat).adviser is None:
        assert played.adviser.hint().startswith("no hint")
        return
    for _ in situations(played, seat):
        advice, numbers = told(played.adviser.hint())
        known = values(played, seat)
        if known is None:
            assert numbers == {}
            continue
        able = [able for _, _, able in played.keyboard.legal(played.view())]
        labels = played.problem.actions[seat].labels
        legal = {str(labels[a]): known[a] for a in np.flatnonzero(able)}
        top = best(np.array(list(legal.values())))
        assert advice in [label for label, first in zip(legal, top, strict=True) if first]
        places = {len(number.partition(".")[2]) for number in numbers.values()}
        assert len(places) == 1
        assert numbers == {label: fixed(legal[label], *places) for label in numbers}
        assert len(numbers) == min(len(legal), MOST)
        assert min(legal[label] for label in numbers) >= sorted(legal.values())[-len(numbers)]


@pytest.mark.parametrize(
    ("name", "turns", "played", "hint"),
    [
        ("catch", 1, "", "hint (optimal:horizon=1): 50. values: 10 8.74, 20 16.04, 30 21.35"),
        ("catch", 10, "", "hint (optimal): 50. values: 10 153.94"),
        ("machine-replacement", 9, "m" * 8, "hint (optimal:horizon=9): manufacture. values: "),
        ("crying-baby", 1, "", "hint (optimal): feed. values: feed -24.67"),
    ],
)
def test_a_hint_for_a_game_of_so_many_turns_plans_no_further(
    name: str, turns: int, played: str, hint: str
) -> None:
    problem = dmplay.load(name)
    one = seated(name, Session(problem, dmplay.Dice(11), [None], limit=turns), [HUMAN])
    for key in played:
        one.choose(one.keyboard.read(one.view(), key))
    assert one.adviser.hint().startswith(hint)


@pytest.mark.parametrize(
    ("rival", "hint"),
    [
        ("flee", "hint (best-response): "),
        ("random", "hint (best-response:to=random): "),
        ("chase", "hint (best-response:to=chase): "),
        ("equilibrium", "hint (best-response): "),
        ("human", "hint (best-response): "),
    ],
)
def test_a_hint_answers_who_sits_there_if_it_can(rival: str, hint: str) -> None:
    problem = dmplay.load("predator-prey:circle")
    other = None if rival == HUMAN else dmplay.agent(problem, 1, rival)
    seats = (HUMAN, rival)
    one = seated("predator-prey:circle", Session(problem, dmplay.Dice(11), [None, other]), seats)
    assert one.adviser.hint().startswith(hint)
    if rival == "random":
        answer = dmplay.agent(problem, 0, "best-response:to=random")
        known = answer.values(answer.begin(one.session.state[None]))
        assert known is not None
        one.choose(0.0)
        (move, *_) = moves(one.session, [0], seats)
        assert [*move.values.values()] == known[0].tolist()


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        ([6.2701, 5.4688, 3.0], ["6.27", "5.47", "3.00"]),
        ([-0.0141, -0.0074, -0.01], ["-0.0141", "-0.0074", "-0.0100"]),
        ([0.00001, 0.00002], ["0.000010", "0.000020"]),
        ([-0.0146], ["-0.015"]),
        ([-0.001, 0.5], ["0.00", "0.50"]),
        ([0.0, 0.0], ["0.00", "0.00"]),
        ([2500.5, -np.inf], ["2500.50", "-inf"]),
    ],
)
def test_values_are_told_apart_by_their_decimals(values: list[float], shown: list[str]) -> None:
    assert [fixed(value, decimals(values)) for value in values] == shown


@pytest.mark.parametrize(
    ("values", "shown"),
    [
        ([0.0, 0.0], ["0", "0"]),
        ([3.0, -1.0], ["3", "-1"]),
        ([2500.5, 2000.25], ["2500", "2000"]),
        ([2500.25, 2500.25 + 1e-11], ["2500", "2500"]),
        ([6.2701, 5.0], ["6.27", "5.00"]),
    ],
)
def test_a_screen_has_no_decimals_where_there_are_enough_digits(
    values: list[float], shown: list[str]
) -> None:
    assert [fixed(value, fewest(values)) for value in values] == shown


@every_seat
def test_a_review_values_each_move_as_the_hint_did(name: str, seat: int) -> None:
    played = game(name, seat)
    expected, advised = [], []
    for _ in situations(played, seat):
        expected.append(values(played, seat))
        if expected[-1] is not None:
            advised.append(told(played.adviser.hint())[0])
    reviewed: list[Move] = list(moves(played.session, [seat]))
    known = [one for one in expected if one is not None]
    assert len(reviewed) == len(known) or agents.roster(played.problem, seat).adviser is None
    for move, row, advice in zip(reviewed, known, advised, strict=True):
        labels = played.problem.actions[seat].labels
        assert move.values == {label: row[labels.index(label)] for label in move.values}
        assert advice in move.best
        assert move.regret == pytest.approx(max(move.values.values()) - move.values[move.chosen])


@every_seat
def test_an_overlay_draws_the_values_of_the_hint(name: str, seat: int) -> None:
    played = game(name, seat)
    for _ in situations(played, seat):
        drawn = played.adviser.overlay("values")
        if drawn is None:
            continue
        here = played.problem.index(played.session.state[None])[0]
        known = values(played, seat)
        assert known is not None
        assert drawn.values[here].tolist() == known.tolist()


@pytest.mark.parametrize("name", ["hexworld", "hexworld:straight-line", "predator-prey"])
def test_every_state_of_a_small_seen_problem_has_an_overlay(name: str) -> None:
    assert game(name, 0).adviser.overlay("values") is not None


def test_equals_are_told_behind_the_one_that_is_advised() -> None:
    values = np.array([1.0, np.nan, 3.0, 3.0 - 1e-12, 2.0])
    advice = Advice("(optimal): d", [*"abcde"], values, action=3)
    assert advice.ranked == [(3, 0.0), (2, 0.0), (4, 1.0), (0, 2.0)]
    assert [label for label, _ in advice.worth] == [*"dcea"]
    assert replace(advice, action=None).ranked[0] == (2, 0.0)
    assert replace(advice, values=None).ranked == []


def test_a_number_is_advised_in_as_many_decimals_as_matter_and_told_whole_as_data() -> None:
    played = new(Request("simple-regulator", seed=7, record=Path("/dev/null")))
    assert played.adviser.hint() == "hint (optimal): -0.163"
    assert played.adviser.given
    assert played.adviser.given.facts == {"by": "optimal", "action": "-0.163339281", "values": {}}
