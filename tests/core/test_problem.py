"""Tests of Problem: its kind, labels, parameter bounds and exact outcomes."""

import tracemalloc
from bisect import bisect_right
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array, Bools, array_bytes
from dmplay.core.chance import (
    MAX_COMPARED_EDGES,
    MAX_INT8_EDGES,
    MIN_GUIDE_ROWS,
    Categorical,
    Chance,
    DiscreteUniform,
    Normal,
    sample_chance_events,
)
from dmplay.core.problem import (
    WAIT_LABEL,
    Outcome,
    Problem,
    checked_state_indices,
    enumerate_outcomes,
    enumerate_possible_outcomes,
    find_seat,
    initial_state_distribution,
    mark_inactive_agents,
)
from dmplay.core.session import Session
from dmplay.core.spaces import INTERVAL_GRID_SIZE, Interval, Labels, RealVector, TextLine
from dmplay.errors import BadParameter, BudgetExceeded, IllegalAction, UnknownName
from dmplay.evaluation.many_games import rollout
from dmplay.problems.cart_pole.rules import CartPole
from dmplay.problems.game_2048.rules import Game2048
from dmplay.problems.rock_paper_scissors.rules import RockPaperScissors
from tests.support.turn_based_games import Nim


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("hexworld", "MDP"),
        ("crying-baby", "POMDP"),
        ("rock-paper-scissors", "simple game"),
        ("predator-prey", "Markov game"),
        ("multicaregiver-crying-baby", "POMG"),
        ("collaborative-predator-prey", "Dec-POMDP"),
    ],
)
def test_the_kind_follows_from_the_attributes(name: str, kind: str) -> None:
    assert dmplay.load_problem(name).kind == kind


def test_rewards_are_per_agent_unless_shared_reward_is_set() -> None:
    assert not dmplay.load_problem("predator-prey").shared_reward
    assert dmplay.load_problem("collaborative-predator-prey").shared_reward


@pytest.mark.parametrize(
    ("name", "parameter", "value", "message"),
    [
        ("hexworld", "slip", 1.5, "slip: got 1.5, expected a number at least 0 and at most 1"),
        ("hexworld", "slip", 1250100,
         "slip: got 1250100, expected a number at least 0 and at most 1"),
        ("cart-pole", "length", 0.0, "length: got 0, expected a number at least 1e-06"),
        ("cart-pole", "pole_mass_in_tau", 1,
         "pole_mass_in_tau: got 1, expected true or false, such as False"),
    ],
)  # fmt: skip
def test_a_parameter_out_of_its_bounds_is_refused(
    name: str, parameter: str, value: float, message: str
) -> None:
    with pytest.raises(BadParameter) as error:
        dmplay.load_problem(name, **{parameter: value})
    assert str(error.value) == message


def test_a_value_outside_the_choices_of_a_parameter_is_refused() -> None:
    message = "^still: got 'brake', expected one of left, coast, right$"
    with pytest.raises(BadParameter, match=message):
        dmplay.load_agent(dmplay.load_problem("mountain-car"), 0, "pump:still=brake")


def test_a_seat_is_found_by_its_name() -> None:
    hunt = dmplay.load_problem("predator-prey")
    assert find_seat(hunt, "prey") == 1
    with pytest.raises(UnknownName, match="unknown seat 'pray'; did you mean prey"):
        find_seat(hunt, "pray")


def test_an_action_is_parsed_from_its_label_or_an_alias() -> None:
    walk = dmplay.load_problem("hexworld")
    assert [walk.parse_action(0, text) for text in ("e", " East ", "north_west")] == [0, 0, 2]
    with pytest.raises(UnknownName, match="unknown action 'up'; expected one of e, ne, nw, w"):
        walk.parse_action(0, "up")


def test_an_interval_action_is_rounded_to_nine_decimals() -> None:
    regulator = dmplay.load_problem("simple-regulator")
    numbers = [regulator.parse_action(0, text) for text in ("1.25", "-0", "1e-12")]
    assert [regulator.format_action(0, number) for number in numbers] == ["1.25", "0", "0"]


@pytest.mark.parametrize("text", ["", "ten", "nan", "inf", "10.5", "-11", "1_0", "٣"])
def test_text_that_is_not_a_number_in_the_interval_is_refused(text: str) -> None:
    with pytest.raises(BadParameter, match="expected a number from -10 to 10"):
        dmplay.load_problem("simple-regulator").parse_action(0, text)


def test_only_a_finite_problem_enumerates_its_states() -> None:
    assert dmplay.load_problem("crying-baby").enumerate_states().tolist() == [0, 1]
    with pytest.raises(BadParameter, match="CartPole has no finite list of states"):
        dmplay.load_problem("cart-pole").enumerate_states()


def test_afterstates_name_the_legal_actions_and_known_features() -> None:
    assert CartPole().afterstates is None
    problem = Game2048()
    model = problem.afterstates
    assert model is not None
    s = np.zeros((3, 4, 4), np.uint8)
    s[0, 0] = 1
    s[1] = np.arange(16).reshape(4, 4) % 5 + 1
    s[2, 3, 3] = 2
    rewards, features = model.list_features(s)
    assert (rewards > -np.inf).tolist() == problem.legal_actions_mask(s)[:, 0].tolist()
    assert features.shape[1:] == rewards.shape
    assert 0 <= features.min() <= features.max() < model.feature_count


def test_a_boolean_parameter_refuses_numbers() -> None:
    with pytest.raises(BadParameter, match=r"^pole_mass_in_tau: got 1, expected true or false$"):
        CartPole(pole_mass_in_tau=1)  # type: ignore[arg-type]
    assert dmplay.load_problem("cart-pole", pole_mass_in_tau=True) == dmplay.load_problem(
        "cart-pole:gym"
    )


def test_states_outside_the_problem_have_no_index() -> None:
    walk = dmplay.load_problem("hexworld")
    assert checked_state_indices(walk, np.array([0, 24])).tolist() == [0, 24]
    with pytest.raises(BadParameter, match="got state indices 3 to 25, expected 0 to 24, to match"):
        checked_state_indices(walk, np.array([25, 3]))


def test_a_belief_update_marginalizes_unknown_actions_and_observations() -> None:
    baby = dmplay.load_problem("crying-baby")
    feed, quiet, sated = 0, 1, np.array([1.0, 0.0])
    assert baby.joint_belief_update(sated, [feed], [None]).tolist() == [1.0, 0.0]
    assert baby.joint_belief_update(sated, [feed], [quiet]).tolist() == [0.9, 0.0]
    # sated if fed, else hungry with probability 0.1
    marginal = baby.joint_belief_update(sated, [None], [None])
    assert marginal == pytest.approx([2.8 / 3, 0.2 / 3])


def test_real_valued_outcomes_cannot_be_enumerated() -> None:
    regulator = dmplay.load_problem("simple-regulator")
    with pytest.raises(BadParameter, match="draws real numbers, so its outcomes cannot be listed"):
        initial_state_distribution(regulator)


def test_no_states_have_no_outcomes() -> None:
    problem = dmplay.load_problem("hexworld")
    states = problem.enumerate_states()[:0]
    p, outcome = dmplay.enumerate_outcomes(problem, states, np.zeros((0, 1), np.int64))
    assert len(p) == len(outcome.state) == len(outcome.rewards) == 0


def test_too_many_outcomes_are_not_enumerated() -> None:
    class Dizzy(RockPaperScissors):
        def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
            return (DiscreteUniform(np.full(len(s), 5_000), 5_000),) * 2

    game: Problem = Dizzy()
    with pytest.raises(BudgetExceeded, match=r"^listing 25000000 outcomes: 1,907 MB"):
        enumerate_outcomes(game, np.zeros(1, int), np.zeros((1, 2), int))


@pytest.mark.parametrize("action", [-1, 3])
def test_outcomes_of_an_invalid_action_are_not_enumerated(action: int) -> None:
    baby = dmplay.load_problem("crying-baby")
    with pytest.raises(IllegalAction, match=f"^agent: got action {action}, expected 0 to 2$"):
        enumerate_outcomes(baby, np.zeros(2, int), np.array([[0], [action]]))


SYMMETRIC_INTERVAL = Interval(-1.0, 1.0)


def test_bounds_in_the_wrong_order_are_refused() -> None:
    for low, high in ((2.0, 0.0), (0.0, np.inf), (1.0, 1.0)):
        with pytest.raises(ValueError, match=f"Interval.low={low}, high={high}.*expected"):
            Interval(low, high)


def test_an_interval_has_no_labels_and_a_grid_from_low_to_high() -> None:
    assert SYMMETRIC_INTERVAL.labels == ()
    assert SYMMETRIC_INTERVAL.candidate_actions()[[0, INTERVAL_GRID_SIZE // 2, -1]].tolist() == [
        -1,
        0,
        1,
    ]
    assert len(SYMMETRIC_INTERVAL.candidate_actions()) == INTERVAL_GRID_SIZE


def test_a_uniform_maps_to_a_number_of_the_interval_with_nine_decimals() -> None:
    assert SYMMETRIC_INTERVAL.sample_actions(np.array([0.0, 0.5, 0.9999999999]), None).tolist() == [
        -1,
        0,
        1,
    ]


def test_numbers_are_clipped_and_rounded_within_the_bounds() -> None:
    assert SYMMETRIC_INTERVAL.clip_actions(np.array([-3.0, 0.1234567891, 3.0])).tolist() == [
        -1,
        0.123456789,
        1,
    ]


@pytest.mark.parametrize(
    "kinds", [1, 3, MAX_COMPARED_EDGES + 2, MAX_INT8_EDGES + 1, MAX_INT8_EDGES + 2]
)
def test_many_rows_have_the_same_events_as_each_row_alone(kinds: int) -> None:
    edges = np.arange(1, kinds) / kinds
    u = np.r_[edges, np.linspace(0.0, 0.999, MIN_GUIDE_ROWS)][:, None]
    expected = [bisect_right(edges.tolist(), uniform) for uniform in u[:, 0]]
    tiled_edges = np.tile(edges, (len(u), 1))
    for chance in (Categorical(edges[None]), Categorical(tiled_edges)):
        assert chance.sample_events(u).tolist() == expected


def test_crowded_edges_still_give_each_uniform_the_right_event() -> None:
    edges = np.sort(np.r_[np.full(9, 0.25), 0.25 + 1e-9 * np.arange(9), np.zeros(3), np.ones(3)])
    u = np.r_[edges[edges < 1], np.linspace(0.249, 0.251, MIN_GUIDE_ROWS), 0.999999999][:, None]
    chance = Categorical(edges[None])
    expected = [bisect_right(edges.tolist(), uniform) for uniform in u[:, 0]]
    assert chance.sample_events(u).tolist() == expected


def test_a_row_samples_the_same_events_alone_and_in_a_batch() -> None:
    u = np.array([[0.0, 0.299999999, 0.3], [0.3, 0.7, 0.999999999], [0.7, 0.3, 0.5]])
    edges = np.array([[0.3, 0.7], [0.3, 0.3], [0.5, 1.0]])
    counts = np.array([3, 1, 7])
    batch = sample_chance_events(
        (Categorical(edges[:1]), Categorical(edges), DiscreteUniform(counts, 7)), u
    )
    assert [event.tolist() for event in batch] == [[0, 1, 2], [0, 2, 0], [0, 0, 3]]
    for row in range(3):
        row_slice = slice(row, row + 1)
        chances = (
            Categorical(edges[:1]),
            Categorical(edges[row_slice]),
            DiscreteUniform(counts[row_slice], 7),
        )
        single = sample_chance_events(chances, u[row_slice])
        assert [(e.tolist(), e.dtype) for e in single] == [
            (e[row_slice].tolist(), e.dtype) for e in batch
        ]


def test_possible_outcomes_are_those_with_positive_probability() -> None:
    walk = dmplay.load_problem("hexworld", slip=0.0)
    s, a = np.array([8, 3]), np.array([[0], [4]])
    distribution = enumerate_outcomes(walk, s, a)
    row, p, outcome = enumerate_possible_outcomes(walk, s, a)
    assert row.tolist() == [0, 1]
    assert p.tolist() == [1.0, 1.0]
    assert distribution.probabilities.tolist() == [[1.0, 0.0, 0.0]] * 2
    assert outcome.state.tolist() == distribution.outcomes.state[:, 0].tolist()
    assert outcome.rewards.tolist() == distribution.outcomes.rewards[:, 0].tolist()


def test_real_text_and_null_observations_are_formatted() -> None:
    assert RealVector(2).format_observation(np.array([0.5, -1.25])) == "0.5, -1.25"
    assert RealVector(2).format_observation(RealVector(2).null_observation(1)[0]) == "nothing yet"
    assert RealVector().to_json_value(np.array(0.5)) == 0.5
    assert TextLine().format_observation(np.array("a king")) == "a king"
    assert TextLine().format_observation(TextLine().null_observation(1)[0]) == "nothing yet"
    assert TextLine().to_json_value(np.array("a king")) == "a king"


def test_observations_without_labels_cannot_be_counted() -> None:
    class Measured(RockPaperScissors):
        observations = (RealVector(), RealVector())

    with pytest.raises(BadParameter, match="Measured has observations without labels"):
        _ = Measured().observation_counts


def test_only_an_agent_whose_only_action_is_wait_is_inactive() -> None:
    class Passing(Nim):
        actions = (Labels(("one", "two", WAIT_LABEL)), Labels(("one", "two", "pass")))

    start = Nim().initial_states(1, ())
    assert mark_inactive_agents(Nim(), start).tolist() == [[False, True]]
    assert mark_inactive_agents(Passing(), start).tolist() == [[False, False]]
    assert mark_inactive_agents(RockPaperScissors(), np.array([0])).tolist() == [[False, False]]


def test_array_bytes_leaks_no_memory() -> None:
    arrays = [np.array([float(n)]) for n in range(300)]
    assert [array_bytes(array) for array in arrays] == [array_bytes(array[0]) for array in arrays]
    arrays = [array.copy() for array in arrays]
    tracemalloc.start()
    for array in arrays:
        array_bytes(array)
    leaked_bytes, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert leaked_bytes < len(arrays)


def test_a_rounding_error_of_a_sum_is_not_a_negative_probability() -> None:
    rounded = Categorical(np.array([[0.25, 1 + 1.1e-15]]))
    assert rounded.probabilities().tolist() == [[0.25, 0.7500000000000011, 0.0]]
    assert Categorical(np.array([[0.75, 0.75 - 1e-15]])).probabilities().tolist()[0][1] == 0.0
    wrong = Categorical(np.array([[0.75, 0.5]]))
    assert wrong.probabilities().tolist() == [[0.75, -0.25, 0.5]]


class CountingGame2048(Game2048):
    """A game of 2048 that records the batch size of each request for legal actions."""

    queried_states: ClassVar[list[int]] = []

    def legal_actions_mask(self, s: Array) -> Bools:
        self.queried_states.append(len(s))
        return super().legal_actions_mask(s)


def test_a_turn_of_one_agent_computes_the_legal_actions_once() -> None:
    problem = CountingGame2048()
    rollout(problem, [Random(problem, 0)], episodes=3, turn_limit=5)
    assert CountingGame2048.queried_states == [3] * 5


@pytest.mark.parametrize("kind", [Problem, Session])
def test_a_base_class_has_few_public_methods(kind: type) -> None:
    methods = [name for name in vars(kind) if not name.startswith("_")]
    assert len([name for name in methods if callable(getattr(kind, name))]) <= 21


@pytest.mark.parametrize(
    ("name", "state", "text"),
    [
        ("cart-pole", "0.123456 -1.0 0.00123456 2.5", "0.123 -1 0.00123 2.5"),
        ("hexworld", "(7,2)", "(7,2)"),
        ("predator-prey", "(0,2) (3,0)", "predator=(0,2) prey=(3,0)"),
        (
            "collaborative-predator-prey",
            "(4,0) (2,0) (3,1)",
            "predator1=(4,0) predator2=(2,0) prey=(3,1)",
        ),
    ],
)
def test_a_state_is_described_for_readers(name: str, state: str, text: str) -> None:
    problem = dmplay.load_problem(name)
    assert problem.describe_state(problem.parse_state(state)) == text


class CheapNim(Nim):
    """Nim for a millionth of the stake."""

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        outcome = super().resolve_events(s, a, events)
        return outcome._replace(rewards=1e-6 * outcome.rewards)


class NoisyNim(CheapNim):
    """The same game with a random number that nobody uses, so that its outcomes are not listed."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Normal(np.zeros(len(s)), np.ones(len(s))),)


def test_the_scale_of_rewards_is_a_power_of_two_or_1_if_outcomes_cannot_be_listed() -> None:
    games = Nim(), CheapNim(), NoisyNim(), RockPaperScissors()
    assert [game.reward_scale for game in games] == [1.0, 2.0**-20, 1.0, 1.0]
