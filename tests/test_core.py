"""What a problem derives from its facts: its kind, its words, its bounds and its exact outcomes."""

import tracemalloc
from bisect import bisect_right
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.chance import (
    MAX_COMPARED_EDGES,
    MAX_INT8_EDGES,
    MIN_GUIDE_ROWS,
    Array,
    Bools,
    Categorical,
    Chance,
    DiscreteUniform,
    sample_all,
    sample_unbatched,
)
from dmplay.core import (
    INTERVAL_GRID_SIZE,
    WAIT_LABEL,
    Interval,
    Labels,
    Problem,
    RealVector,
    TextLine,
    array_bytes,
    checked_state_indices,
    enumerate_outcomes,
    enumerate_possible_outcomes,
    initial_state_distribution,
)
from dmplay.errors import BadParameter, BudgetExceeded, IllegalAction, UnknownName
from dmplay.policies.general import Random
from dmplay.problems.cart_pole import CartPole
from dmplay.problems.game_2048 import Game2048
from dmplay.problems.rock_paper_scissors import RockPaperScissors
from dmplay.rollouts import rollout
from tests.support.turns import Nim


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
def test_the_kind_follows_from_the_facts(name: str, kind: str) -> None:
    assert dmplay.load_problem(name).kind == kind


def test_a_problem_pays_each_agent_its_own_unless_it_says_otherwise() -> None:
    assert not dmplay.load_problem("predator-prey").shared_reward
    assert dmplay.load_problem("collaborative-predator-prey").shared_reward


@pytest.mark.parametrize(
    ("name", "parameter", "value", "told"),
    [
        ("hexworld", "slip", 1.5, "slip: got 1.5, expected a number at least 0 and at most 1"),
        ("cart-pole", "length", 0.0, "length: got 0, expected a number at least 1e-06"),
        (
            "cart-pole",
            "pole_mass_in_tau",
            1,
            "pole_mass_in_tau: got 1, expected true or false, such as False",
        ),
    ],
)
def test_a_parameter_out_of_its_bounds_is_refused(
    name: str, parameter: str, value: float, told: str
) -> None:
    with pytest.raises(BadParameter) as caught:
        dmplay.load_problem(name, **{parameter: value})
    assert str(caught.value) == told


def test_a_word_that_a_parameter_cannot_be_is_refused() -> None:
    told = "^still: got 'brake', expected one of left, coast, right$"
    with pytest.raises(BadParameter, match=told):
        dmplay.load_agent(dmplay.load_problem("mountain-car"), 0, "pump:still=brake")


def test_a_seat_is_known_by_its_name() -> None:
    hunt = dmplay.load_problem("predator-prey")
    assert hunt.seat_index("prey") == 1
    with pytest.raises(UnknownName, match="unknown seat 'pray'; did you mean prey"):
        hunt.seat_index("pray")


def test_an_action_is_a_label_or_another_name_of_it() -> None:
    walk = dmplay.load_problem("hexworld")
    assert [walk.parse_action(0, text) for text in ("e", " East ", "north_west")] == [0, 0, 2]
    with pytest.raises(UnknownName, match="unknown action 'up'; expected one of e, ne, nw, w"):
        walk.parse_action(0, "up")


def test_an_action_of_an_interval_is_a_number_of_it_to_nine_decimals() -> None:
    regulator = dmplay.load_problem("simple-regulator")
    numbers = [regulator.parse_action(0, text) for text in ("1.25", "-0", "1e-12")]
    assert [regulator.format_action(0, number) for number in numbers] == ["1.25", "0", "0"]


@pytest.mark.parametrize("text", ["", "ten", "nan", "inf", "10.5", "-11", "1_0", "٣"])
def test_what_is_no_number_of_the_interval_is_no_action(text: str) -> None:
    with pytest.raises(BadParameter, match="expected a number from -10 to 10"):
        dmplay.load_problem("simple-regulator").parse_action(0, text)


def test_only_a_finite_problem_lists_its_states() -> None:
    assert dmplay.load_problem("crying-baby").enumerate_states().tolist() == [0, 1]
    with pytest.raises(BadParameter, match="CartPole has no finite list of states"):
        dmplay.load_problem("cart-pole").enumerate_states()


def test_a_flag_is_no_number_and_has_no_bounds() -> None:
    with pytest.raises(BadParameter, match=r"^pole_mass_in_tau: got 1, expected true or false$"):
        CartPole(pole_mass_in_tau=1)  # type: ignore[arg-type]
    assert dmplay.load_problem("cart-pole", pole_mass_in_tau=True) == dmplay.load_problem(
        "cart-pole:gym"
    )


def test_what_is_no_state_of_the_problem_has_no_place_among_them() -> None:
    walk = dmplay.load_problem("hexworld")
    assert checked_state_indices(walk, np.array([0, 24])).tolist() == [0, 24]
    with pytest.raises(BadParameter, match="got states 3 to 25, expected 0 to 24, as many as"):
        checked_state_indices(walk, np.array([25, 3]))


def test_a_belief_is_carried_by_what_was_done_and_heard_as_far_as_it_is_known() -> None:
    baby = dmplay.load_problem("crying-baby")
    feed, quiet, sated = 0, 1, np.array([1.0, 0.0])
    assert baby.joint_belief_update(sated, [feed], [None]).tolist() == [1.0, 0.0]
    assert baby.joint_belief_update(sated, [feed], [quiet]).tolist() == [0.9, 0.0]
    either = baby.joint_belief_update(sated, [None], [None])  # fed, or once in ten hungry if not
    assert either == pytest.approx([2.8 / 3, 0.2 / 3])


def test_outcomes_that_are_real_numbers_cannot_be_listed() -> None:
    regulator = dmplay.load_problem("simple-regulator")
    with pytest.raises(BadParameter, match="draws real numbers: its outcomes cannot be listed"):
        initial_state_distribution(regulator)


def test_outcomes_that_are_too_many_are_not_listed() -> None:
    class Dizzy(RockPaperScissors):
        def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
            return (DiscreteUniform(np.full(len(s), 5_000), 5_000),) * 2

    game: Problem = Dizzy()
    with pytest.raises(BudgetExceeded, match=r"^listing 25000000 outcomes one by one: 1,907 MB"):
        enumerate_outcomes(game, np.zeros(1, int), np.zeros((1, 2), int))


@pytest.mark.parametrize("action", [-1, 3])
def test_outcomes_of_what_is_no_action_are_not_listed(action: int) -> None:
    baby = dmplay.load_problem("crying-baby")
    with pytest.raises(IllegalAction, match=f"^agent: got action {action}, expected 0 to 2$"):
        enumerate_outcomes(baby, np.zeros(2, int), np.array([[0], [action]]))


SPAN = Interval(-1.0, 1.0)


def test_an_interval_has_no_labels_and_is_tried_from_end_to_end() -> None:
    assert SPAN.labels == ()
    assert SPAN.candidate_actions()[[0, INTERVAL_GRID_SIZE // 2, -1]].tolist() == [-1, 0, 1]
    assert len(SPAN.candidate_actions()) == INTERVAL_GRID_SIZE


def test_a_uniform_draws_a_number_of_the_interval_to_nine_decimals() -> None:
    assert SPAN.sample_actions(np.array([0.0, 0.5, 0.9999999999]), None).tolist() == [-1, 0, 1]


def test_the_nearest_action_to_a_number_lies_within_the_bounds() -> None:
    assert SPAN.clip_actions(np.array([-3.0, 0.1234567891, 3.0])).tolist() == [-1, 0.123456789, 1]


@pytest.mark.parametrize(
    "kinds", [1, 3, MAX_COMPARED_EDGES + 2, MAX_INT8_EDGES + 1, MAX_INT8_EDGES + 2]
)
def test_many_rows_have_the_events_that_each_has_alone(kinds: int) -> None:
    edges = np.arange(1, kinds) / kinds
    u = np.r_[edges, np.linspace(0.0, 0.999, MIN_GUIDE_ROWS)][:, None]
    alone = [bisect_right(edges.tolist(), one) for one in u[:, 0]]
    every = np.tile(edges, (len(u), 1))
    for chance in (Categorical(edges[None]), Categorical(every)):
        assert chance.sample_events(u).tolist() == alone


def test_where_edges_crowd_each_uniform_lies_between_the_right_two() -> None:
    edges = np.sort(np.r_[np.full(9, 0.25), 0.25 + 1e-9 * np.arange(9), np.zeros(3), np.ones(3)])
    u = np.r_[edges[edges < 1], np.linspace(0.249, 0.251, MIN_GUIDE_ROWS), 0.999999999][:, None]
    chance = Categorical(edges[None])
    assert chance.sample_events(u).tolist() == [
        chance.event_from_uniform(one) for one in u[:, 0].tolist()
    ]


def test_a_row_alone_draws_what_it_draws_beside_others() -> None:
    u = np.array([[0.0, 0.299999999, 0.3], [0.3, 0.7, 0.999999999], [0.7, 0.3, 0.5]])
    edges = np.array([[0.3, 0.7], [0.3, 0.3], [0.5, 1.0]])
    many = np.array([3, 1, 7])
    beside = sample_all(
        (Categorical(edges[:1]), Categorical(edges), DiscreteUniform.from_counts(many, 7)), u
    )
    assert [event.tolist() for event in beside] == [[0, 1, 2], [0, 2, 0], [0, 0, 3]]
    for row in range(3):
        one = slice(row, row + 1)
        chances = (
            Categorical(edges[:1]),
            Categorical(edges[one]),
            DiscreteUniform.from_counts(int(many[row]), 7),
        )
        alone = sample_all(chances, u[one])
        assert [(e.tolist(), e.dtype) for e in alone] == [
            (e[one].tolist(), e.dtype) for e in beside
        ]
        assert sample_unbatched(chances, u[one]) == [int(event[row]) for event in beside]


def test_what_can_happen_is_what_is_listed_with_a_chance() -> None:
    walk = dmplay.load_problem("hexworld", slip=0.0)
    s, a = np.array([8, 3]), np.array([[0], [4]])
    listed = enumerate_outcomes(walk, s, a)
    row, p, outcome = enumerate_possible_outcomes(walk, s, a)
    assert row.tolist() == [0, 1]
    assert p.tolist() == [1.0, 1.0]
    assert listed.probabilities.tolist() == [[1.0, 0.0, 0.0]] * 2
    assert outcome.state.tolist() == listed.outcomes.state[:, 0].tolist()
    assert outcome.rewards.tolist() == listed.outcomes.rewards[:, 0].tolist()


def test_what_is_seen_as_numbers_or_text_is_told_and_so_is_nothing_yet() -> None:
    assert RealVector(2).format_observation(np.array([0.5, -1.25])) == "0.5, -1.25"
    assert RealVector(2).format_observation(RealVector(2).null_observation(1)[0]) == "nothing yet"
    assert RealVector().to_json_value(np.array(0.5)) == 0.5
    assert TextLine().format_observation(np.array("a king")) == "a king"
    assert TextLine().format_observation(TextLine().null_observation(1)[0]) == "nothing yet"
    assert TextLine().to_json_value(np.array("a king")) == "a king"


def test_observations_without_labels_are_not_counted() -> None:
    class Measured(RockPaperScissors):
        observations = (RealVector(), RealVector())

    with pytest.raises(BadParameter, match="Measured has observations without labels"):
        _ = Measured().observation_counts


def test_only_a_seat_that_can_do_no_more_than_wait_is_waiting() -> None:
    class Passing(Nim):
        actions = (Labels(("one", "two", WAIT_LABEL)), Labels(("one", "two", "pass")))

    start = Nim().initial_states(1, ())
    assert Nim().inactive_agents(start).tolist() == [[False, True]]
    assert Passing().inactive_agents(start).tolist() == [[False, False]]
    assert RockPaperScissors().inactive_agents(np.array([0])).tolist() == [[False, False]]


def test_the_bytes_of_an_array_leave_nothing_behind_in_it() -> None:
    arrays = [np.array([float(n)]) for n in range(300)]
    assert [array_bytes(one) for one in arrays] == [array_bytes(one[0]) for one in arrays]
    arrays = [one.copy() for one in arrays]
    tracemalloc.start()
    for one in arrays:
        array_bytes(one)
    left, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert left < len(arrays)


class Asked2048(Game2048):
    """Counts how often it is asked what is legal."""

    asked: ClassVar[list[int]] = []

    def legal_actions_mask(self, s: Array) -> Bools:
        self.asked.append(len(s))
        return super().legal_actions_mask(s)


def test_a_turn_of_one_agent_asks_once_what_is_legal() -> None:
    problem = Asked2048()
    rollout(problem, [Random(problem, 0)], episodes=3, turn_limit=5)
    assert Asked2048.asked == [3] * 5
