"""Hints, overlays, reviews and an agent's values tell the same numbers."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.advice.adviser import (
    MAX_LISTED_VALUES,
    Hint,
    count_decimals,
    count_fewest_decimals,
    format_fixed,
)
from dmplay.advice.review import ReviewedAction, review_actions
from dmplay.chance import Reals
from dmplay.core import Policy
from dmplay.finding import agents
from dmplay.game.game import Game
from dmplay.game.request import GameRequest
from dmplay.game.seats import HUMAN
from dmplay.game.start import start_new_game
from dmplay.session import Session
from dmplay.solvers.value_iteration import mark_best_actions
from tests.support.cases import CASES, load, small
from tests.support.screens import seated

TURNS = 3
SEATS = [(name, seat) for name in CASES for seat in range(len(load(name).agents))]
pytestmark = pytest.mark.usefixtures("coarse")
every_seat = pytest.mark.parametrize(("name", "seat"), SEATS)


def game(name: str, seat: int) -> Game:
    """A game of one person and the usual others."""
    problem = small(name)
    who = [agents.load_roster(problem, i).default_partner for i in range(len(problem.agents))]
    others = [None if i == seat else dmplay.load_agent(problem, i, w) for i, w in enumerate(who)]
    who[seat] = HUMAN
    return seated(name, Session(problem, dmplay.SeededUniforms(11), others, turn_limit=TURNS), who)


@cache
def adviser_of(name: str, seat: int) -> Policy:
    problem = small(name)
    found = agents.find_hint_provider(problem, seat, TURNS)
    return found[1] if found else dmplay.load_agent(problem, seat, "random")


def values(played: Game, seat: int) -> Reals | None:
    """What an adviser's `values` says that follows these turns by itself."""
    session, adviser = played.session, adviser_of(played.problem_name, seat)
    memory = adviser.initial_memory(session.observation_after(seat, 0)[None])
    for turn in range(1, len(session.turns) + 1):
        memory = adviser.update_memory(memory, session.build_percept(seat, turn))
    known = adviser.action_values(memory)
    return None if known is None else known[0]


def situations(played: Game, seat: int) -> Iterator[int]:
    """The turns of a game in which the person does something else each time, and their number."""
    for turn in range(TURNS):
        if played.session.over:
            return
        yield turn
        labels = played.problem.actions[seat].labels
        able = played.session.legal_actions_mask(seat)
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
    if agents.load_roster(played.problem, seat).hint_provider is None:
        assert played.hint_provider.create_hint().startswith("no hint")
        return
    for _ in situations(played, seat):
        advice, numbers = told(played.hint_provider.create_hint())
        known = values(played, seat)
        if known is None:
            assert numbers == {}
            continue
        able = [able for _, _, able in played.keyboard.list_actions_with_keys(played.view())]
        labels = played.problem.actions[seat].labels
        legal = {str(labels[a]): known[a] for a in np.flatnonzero(able)}
        top = mark_best_actions(np.array(list(legal.values())))
        assert advice in [label for label, first in zip(legal, top, strict=True) if first]
        places = {len(number.partition(".")[2]) for number in numbers.values()}
        assert len(places) == 1
        assert numbers == {label: format_fixed(legal[label], *places) for label in numbers}
        assert len(numbers) == min(len(legal), MAX_LISTED_VALUES)
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
    problem = dmplay.load_problem(name)
    one = seated(
        name, Session(problem, dmplay.SeededUniforms(11), [None], turn_limit=turns), [HUMAN]
    )
    for key in played:
        one.choose(one.keyboard.parse_action(one.view(), key))
    assert one.hint_provider.create_hint().startswith(hint)


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
    problem = dmplay.load_problem("predator-prey:circle")
    other = None if rival == HUMAN else dmplay.load_agent(problem, 1, rival)
    seats = (HUMAN, rival)
    one = seated(
        "predator-prey:circle", Session(problem, dmplay.SeededUniforms(11), [None, other]), seats
    )
    assert one.hint_provider.create_hint().startswith(hint)
    if rival == "random":
        answer = dmplay.load_agent(problem, 0, "best-response:to=random")
        known = answer.action_values(answer.initial_memory(one.session.state[None]))
        assert known is not None
        one.choose(0.0)
        (move, *_) = review_actions(one.session, [0], seats)
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
    assert [format_fixed(value, count_decimals(values)) for value in values] == shown


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
    assert [format_fixed(value, count_fewest_decimals(values)) for value in values] == shown


@every_seat
def test_a_review_values_each_move_as_the_hint_did(name: str, seat: int) -> None:
    played = game(name, seat)
    expected, advised = [], []
    for _ in situations(played, seat):
        expected.append(values(played, seat))
        if expected[-1] is not None:
            advised.append(told(played.hint_provider.create_hint())[0])
    reviewed: list[ReviewedAction] = list(review_actions(played.session, [seat]))
    known = [one for one in expected if one is not None]
    assert (
        len(reviewed) == len(known)
        or agents.load_roster(played.problem, seat).hint_provider is None
    )
    for move, row, advice in zip(reviewed, known, advised, strict=True):
        labels = played.problem.actions[seat].labels
        assert move.values == {label: row[labels.index(label)] for label in move.values}
        assert advice in move.best
        assert move.regret == pytest.approx(max(move.values.values()) - move.values[move.chosen])


@every_seat
def test_an_overlay_draws_the_values_of_the_hint(name: str, seat: int) -> None:
    played = game(name, seat)
    for _ in situations(played, seat):
        drawn = played.hint_provider.build_overlay("values")
        if drawn is None:
            continue
        here = played.problem.state_indices(played.session.state[None])[0]
        known = values(played, seat)
        assert known is not None
        assert drawn.action_values[here].tolist() == known.tolist()


@pytest.mark.parametrize("name", ["hexworld", "hexworld:straight-line", "predator-prey"])
def test_every_state_of_a_small_seen_problem_has_an_overlay(name: str) -> None:
    assert game(name, 0).hint_provider.build_overlay("values") is not None


def test_equals_are_told_behind_the_one_that_is_advised() -> None:
    values = np.array([1.0, np.nan, 3.0, 3.0 - 1e-12, 2.0])
    advice = Hint("(optimal): d", [*"abcde"], values, action=3)
    assert advice.ranked_actions == [(3, 0.0), (2, 0.0), (4, 1.0), (0, 2.0)]
    assert [label for label, _ in advice.value_rows] == [*"dcea"]
    assert replace(advice, action=None).ranked_actions[0] == (2, 0.0)
    assert replace(advice, values=None).ranked_actions == []


def test_a_number_is_advised_in_as_many_decimals_as_matter_and_told_whole_as_data() -> None:
    played = start_new_game(GameRequest("simple-regulator", seed=7, record_path=Path("/dev/null")))
    assert played.hint_provider.create_hint() == "hint (optimal): -0.163"
    assert played.hint_provider.current_hint
    assert played.hint_provider.current_hint.data == {
        "by": "optimal",
        "action": "-0.163339281",
        "values": {},
    }
