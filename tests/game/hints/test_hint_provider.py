"""Tests that hints, overlays, reviews and an agent's action values agree."""

import re
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import Accuracy, ActionValues
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.policy import Policy
from dmplay.core.session import Session
from dmplay.game.game import Game
from dmplay.game.game_setup import start_new_game
from dmplay.game.hints.hint_provider import (
    MAX_LISTED_VALUES,
    Hint,
    choose_decimals,
    choose_hint_decimals,
    format_fixed,
)
from dmplay.game.hints.review import ReviewedAction, review_actions
from dmplay.game.launch_requests import GameRequest
from dmplay.game.seats import HUMAN
from dmplay.registry import agents
from tests.support.problem_cases import CASE_NAMES, load_problem, load_small_problem
from tests.support.screens import make_session_game

TURN_LIMIT = 3
NAMES_AND_SEATS = [
    (name, seat) for name in CASE_NAMES for seat in range(len(load_problem(name).agents))
]
pytestmark = pytest.mark.usefixtures("coarse")
with_every_seat = pytest.mark.parametrize(("name", "seat"), NAMES_AND_SEATS)


def create_game(name: str, seat: int) -> Game:
    """Create a game with one person and the default agents in the other seats."""
    problem = load_small_problem(name)
    player_names = [
        agents.load_roster(problem, i).default_partner for i in range(len(problem.agents))
    ]
    others = [
        None if i == seat else dmplay.load_agent(problem, i, player_name)
        for i, player_name in enumerate(player_names)
    ]
    player_names[seat] = HUMAN
    return make_session_game(
        name,
        Session(problem, dmplay.SeededUniforms(11), others, turn_limit=TURN_LIMIT),
        player_names,
    )


@cache
def create_hint_policy(name: str, seat: int) -> Policy:
    problem = load_small_problem(name)
    named_policy = agents.find_hint_provider(
        problem, AdviceQuestion(seat, TURN_LIMIT, tuple(create_game(name, seat).player_names))
    )
    return named_policy.policy if named_policy else dmplay.load_agent(problem, seat, "random")


def compute_action_values(game: Game, seat: int) -> Reals | None:
    """Return the action values of a hint policy that follows these turns itself."""
    session, policy = game.session, create_hint_policy(game.problem_name, seat)
    memory = policy.initial_memory(session.observation_after(seat, 0)[None])
    for turn in range(1, len(session.turns) + 1):
        memory = policy.update_memory(memory, session.build_percept(seat, turn))
    action_values = policy.action_values(memory)
    return None if action_values is None else action_values[0]


def play_varied_turns(game: Game, seat: int) -> Iterator[int]:
    """Play turns with a different action each time; yield the number of each turn before it is
    played.
    """
    for turn in range(TURN_LIMIT):
        if game.session.over:
            return
        yield turn
        labels = game.problem.actions[seat].labels
        legal_mask = game.session.legal_actions_mask(seat)
        if not labels:
            game.choose(0.5 * turn)
        else:
            legal = np.arange(len(labels)) if legal_mask is None else np.flatnonzero(legal_mask)
            game.choose(float(legal[turn % len(legal)]))


def parse_hint(hint: str) -> tuple[str, dict[str, str]]:
    """Parse a hint into the recommended action and the text of each value."""
    remark = r"(?:; [a-z ]+: no real difference)?(?: \(.* why lists its assumptions\))?"
    match = re.fullmatch(rf"hint by ([^:]+): (\S+?){remark}(?:\. [a-z, ]+: (.*))?", hint)
    assert match, hint
    pairs = [pair.rsplit(" ", 1) for pair in (match[3] or "").split(", ") if pair]
    return match[2], dict(pairs)


@with_every_seat
def test_a_hint_recommends_the_best_of_the_values_it_lists(name: str, seat: int) -> None:
    episode = create_game(name, seat)
    if agents.load_roster(episode.problem, seat).hint_provider is None:
        assert episode.hint_provider.create_hint().startswith("no hint")
        return
    for _ in play_varied_turns(episode, seat):
        advice, numbers = parse_hint(episode.hint_provider.create_hint())
        action_values = compute_action_values(episode, seat)
        if action_values is None:
            assert numbers == {}
            continue
        legal_mask = [
            legal_mask
            for _, _, legal_mask in episode.keyboard.list_actions_with_keys(episode.view())
        ]
        labels = episode.problem.actions[seat].labels
        legal = {str(labels[a]): action_values[a] for a in np.flatnonzero(legal_mask)}
        best_mask = mark_best_actions(np.array(list(legal.values())))
        assert advice in [label for label, is_best in zip(legal, best_mask, strict=True) if is_best]
        decimal_counts = {len(number.partition(".")[2]) for number in numbers.values()}
        assert len(decimal_counts) == 1
        (decimals,) = decimal_counts
        for label, number in numbers.items():  # half of the last digit, and errors of rounding
            assert abs(float(number) - legal[label]) <= 0.5 * 10**-decimals + 1e-9
        assert len(numbers) == min(len(legal), MAX_LISTED_VALUES)
        assert min(legal[label] for label in numbers) >= sorted(legal.values())[-len(numbers)]


@pytest.mark.parametrize(
    ("name", "turn_limit", "keys", "hint"),
    [
        (
            "catch",
            1,
            "",
            "hint by optimal (1 turn left): 50. exact values: 10 8.74, 20 16.04, 30 21.35",
        ),
        ("catch", 10, "", "hint by optimal (10 turns left): 50. exact values: 10 153.94"),
        (
            "machine-replacement",
            9,
            "m" * 8,
            "hint by optimal (1 turn left): manufacture. exact values: ",
        ),
        ("crying-baby", 1, "", "hint by optimal (1 turn left): ignore. exact values: feed -10.00"),
    ],
)
def test_a_hint_plans_only_to_the_turn_limit(
    name: str, turn_limit: int, keys: str, hint: str
) -> None:
    problem = dmplay.load_problem(name)
    game = make_session_game(
        name, Session(problem, dmplay.SeededUniforms(11), [None], turn_limit=turn_limit), [HUMAN]
    )
    for key in keys:
        game.choose(game.keyboard.parse_action(game.view(), key))
    assert game.hint_provider.create_hint().startswith(hint)


@pytest.mark.parametrize(
    ("rival", "hint"),
    [
        ("flee", "hint by best-response (50 turns left, against flee): "),
        ("random", "hint by best-response (50 turns left, against random): "),
        ("chase", "hint by best-response (50 turns left, against chase): "),
        ("equilibrium", "hint by best-response (50 turns left, against equilibrium): "),
        ("search", "hint by best-response (50 turns left, if the other agent plays flee): "),
        ("human", "hint by best-response (50 turns left, if the other agent plays flee): "),
    ],
)
def test_a_hint_is_the_best_response_to_the_opponent_if_possible(rival: str, hint: str) -> None:
    problem = dmplay.load_problem("predator-prey:circle")
    other = None if rival == HUMAN else dmplay.load_agent(problem, 1, rival)
    seats = (HUMAN, rival)
    game = make_session_game(
        "predator-prey:circle", Session(problem, dmplay.SeededUniforms(11), [None, other]), seats
    )
    assert game.hint_provider.create_hint().startswith(hint)
    if rival == "random":
        policy = dmplay.load_agent(problem, 0, "best-response:to=random,horizon=50")
        action_values = policy.action_values(policy.initial_memory(game.session.state[None]))
        assert action_values is not None
        game.choose(0.0)
        (move, *_) = review_actions(
            game.session, [AdviceQuestion.of_session(game.session, 0, seats)]
        )
        assert [*move.values.values()] == pytest.approx(action_values[0].tolist())


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([6.2701, 5.4688, 3.0], ["6.27", "5.47", "3.00"]),
        ([-0.0141, -0.0074, -0.01], ["-0.0141", "-0.0074", "-0.0100"]),
        ([0.00001, 0.00002], ["0.000010", "0.000020"]),
        ([-0.0146], ["-0.015"]),
        ([-0.001, 0.5], ["0.00", "0.50"]),
        ([0.0, 0.0], ["0.00", "0.00"]),
        ([-5.6e-17, 0.0], ["0.00", "0.00"]),  # a rounding error
        ([2500.5, -np.inf], ["2500.50", "-inf"]),
    ],
)
def test_values_have_enough_decimals_to_differ(values: list[float], expected: list[str]) -> None:
    assert [format_fixed(value, choose_decimals(values)) for value in values] == expected


@pytest.mark.parametrize(
    ("values", "expected"),
    [
        ([0.0, 0.0], ["0", "0"]),
        ([3.0, -1.0], ["3", "-1"]),
        ([2500.5, 2000.25], ["2500", "2000"]),
        ([2500.25, 2500.25 + 1e-11], ["2500", "2500"]),
        ([6.2701, 5.0], ["6.27", "5.00"]),
    ],
)
def test_a_screen_omits_decimals_if_whole_numbers_differ_enough(
    values: list[float], expected: list[str]
) -> None:
    assert [format_fixed(value, choose_hint_decimals(values)) for value in values] == expected


@with_every_seat
def test_a_review_values_each_action_as_the_hint_did(name: str, seat: int) -> None:
    episode = create_game(name, seat)
    if not episode.problem.actions[seat].labels:  # the hint has no list of values
        return
    expected, recommended = [], []
    for _ in play_varied_turns(episode, seat):
        expected.append(compute_action_values(episode, seat))
        if expected[-1] is not None:
            recommended.append(parse_hint(episode.hint_provider.create_hint())[0])
    reviewed: list[ReviewedAction] = list(
        review_actions(
            episode.session,
            [AdviceQuestion.of_session(episode.session, seat, episode.player_names)],
        )
    )
    available_values = [action_values for action_values in expected if action_values is not None]
    assert (
        len(reviewed) == len(available_values)
        or agents.load_roster(episode.problem, seat).hint_provider is None
    )
    for move, row, advice in zip(reviewed, available_values, recommended, strict=True):
        labels = episode.problem.actions[seat].labels
        is_rating = move.basis.accuracy is Accuracy.RATING
        expected_row = np.round(row) if is_rating else np.asarray(row)
        if move.basis.scope.endswith(" plays on"):  # estimates that simulated games replace
            continue
        assert move.values == {label: expected_row[labels.index(label)] for label in move.values}
        assert advice in move.best
        if move.regret is None:
            assert move.basis.scope or move.basis.accuracy in {
                Accuracy.LOWER_BOUND,
                Accuracy.UPPER_BOUND,
            }
            continue
        if move.basis.resolution and move.chosen in move.best:
            assert move.regret == 0.0
            continue
        assert move.regret == pytest.approx(max(move.values.values()) - move.values[move.chosen])


@with_every_seat
def test_an_overlay_has_the_values_of_the_hint(name: str, seat: int) -> None:
    episode = create_game(name, seat)
    for _ in play_varied_turns(episode, seat):
        overlay = episode.hint_provider.build_overlay("values")
        if overlay is None:
            continue
        state_index = episode.problem.state_indices(episode.session.state[None])[0]
        action_values = compute_action_values(episode, seat)
        assert action_values is not None
        assert overlay.action_values[state_index].tolist() == action_values.tolist()


@pytest.mark.parametrize("name", ["hexworld", "hexworld:straight-line", "predator-prey"])
def test_a_small_fully_observable_problem_has_an_overlay(name: str) -> None:
    assert create_game(name, 0).hint_provider.build_overlay("values") is not None


def test_actions_of_equal_value_are_listed_after_the_recommended_one() -> None:
    values = np.array([1.0, np.nan, 3.0, 3.0 - 1e-12, 2.0])
    advice = Hint("optimal", "d", [*"abcde"], ActionValues(values), action=3)
    assert advice.ranked_actions == [(3, 0.0), (2, 0.0), (4, 1.0), (0, 2.0)]
    assert [label for label, _ in advice.value_rows] == [*"dcea"]
    assert replace(advice, action=None).ranked_actions[0] == (2, 0.0)
    assert replace(advice, values=None).ranked_actions == []


def test_a_recommended_number_is_rounded_in_text_and_precise_in_data() -> None:
    new_game = start_new_game(
        GameRequest("simple-regulator", seed=7, record_path=Path("/dev/null"))
    )
    assert new_game.hint_provider.create_hint() == "hint by optimal (20 turns left): -0.163"
    assert new_game.hint_provider.current_hint
    assert new_game.hint_provider.current_hint.data == {
        "by": "optimal, 20 turns left",
        "action": "-0.163339281",
        "about": "20 turns left",
        "values": {},
    }
