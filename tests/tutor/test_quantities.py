"""Tests of the quantities against computations by hand and by plain loops."""

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from dmplay.algorithms.registry import find_algorithm
from dmplay.algorithms.step import StateValues, WatchRequest
from dmplay.core.tabular import tabulate
from dmplay.registry.problems import load_problem
from dmplay.tutor.answers import check_answer, describe_right_answer
from dmplay.tutor.lesson import PositionText, Prediction, QuantityCall
from dmplay.tutor.positions import PositionInGame, open_position
from dmplay.tutor.quantity import compute_truth
from dmplay.tutor.truth import format_values


def open_problem(problem: str, **facts: object) -> PositionInGame:
    """Return a position of a problem."""
    return open_position(PositionText(problem, **facts), Path())  # type: ignore[arg-type]


def compute(position: PositionInGame, name: str, **arguments: object) -> object:
    """Return the value of a quantity."""
    return compute_truth(position, QuantityCall(name, arguments)).value


def number(position: PositionInGame, name: str, **arguments: object) -> float:
    """Return the value of a quantity that is a number."""
    value = compute(position, name, **arguments)
    assert isinstance(value, float)
    return value


HEXWORLD = open_problem("hexworld", seed=104)  # at (2,1)
LINE = open_problem("hexworld:straight-line")
BABY = open_problem("crying-baby", turns=10)


def iterate_values(discount: float) -> tuple[list[str], np.ndarray, np.ndarray]:
    """Return the states of hex world, V and Q, by a thousand sweeps in plain loops."""
    problem = load_problem("hexworld")
    tables = tabulate(problem)
    names = [*map(problem.format_state, problem.enumerate_states())]
    values = np.zeros(len(names))
    q = np.zeros((len(names), 6))
    for _ in range(1000):
        for s, a in np.ndindex(q.shape):
            q[s, a] = tables.rewards[s, a, 0] + discount * tables.transition[s, a].dot(values)
        values = q.max(axis=1)
    return names, values, q


@pytest.fixture(scope="module", name="sweeps")
def fixture_sweeps() -> tuple[list[str], np.ndarray, np.ndarray]:
    """Return the states, values and action values of hex world."""
    return iterate_values(0.9)


def test_values_of_states_and_actions_agree_with_plain_sweeps(
    sweeps: tuple[list[str], np.ndarray, np.ndarray],
) -> None:
    names, values, q = sweeps
    for state in ("(2,1)", "(5,2)", "(9,0)"):
        index = names.index(state)
        assert number(HEXWORLD, "state-value", state=state) == pytest.approx(values[index])
        assert number(HEXWORLD, "action-value", state=state, action="w") == pytest.approx(
            q[index, 3]
        )
        assert number(HEXWORLD, "action-loss", state=state, action="w") == pytest.approx(
            values[index] - q[index, 3], abs=1e-9
        )


def test_the_straight_way_at_2_1_is_west_and_loses_what_the_sweeps_say(
    sweeps: tuple[list[str], np.ndarray, np.ndarray],
) -> None:
    names, values, q = sweeps
    index = names.index("(2,1)")
    loss = number(HEXWORLD, "straight-way-loss", state="(2,1)")
    assert loss == pytest.approx(values[index] - q[index, 3])
    assert compute(HEXWORLD, "best-action") == {"nw"}
    assert compute(HEXWORLD, "worst-outcome", action="w") == {"(2,0)"}


def test_the_outcomes_of_west_at_2_1_are_three_hexes() -> None:
    outcomes = compute(HEXWORLD, "outcomes", action="w")
    assert isinstance(outcomes, Mapping)
    assert outcomes == pytest.approx({"(1,1)": 0.7, "(2,0)": 0.15, "(1,2)": 0.15})
    probability = number(HEXWORLD, "outcome-probability", action="w", outcome="(2,0)")
    assert probability == pytest.approx(0.15)
    assert number(HEXWORLD, "outcome-probability", action="w", outcome="(9,0)") == 0


def test_several_tries_miss_an_outcome_with_a_power_of_its_complement() -> None:
    arguments = {"action": "w", "outcome": "(2,0)", "tries": 5}
    assert number(HEXWORLD, "missed-outcome-probability", **arguments) == pytest.approx(0.85**5)
    assert number(HEXWORLD, "missed-outcome-probability", **{**arguments, "tries": 0}) == 1
    never = number(HEXWORLD, "missed-outcome-probability", **{**arguments, "outcome": "(9,0)"})
    assert never == 1


def test_the_straight_way_to_one_exit_may_enter_another(
    sweeps: tuple[list[str], np.ndarray, np.ndarray],
) -> None:
    names, values, q = sweeps
    index = names.index("(1,0)")
    loss = number(HEXWORLD, "straight-way-loss", state="(1,0)", exit_state="(9,0)")
    assert loss == pytest.approx(values[index] - q[index, 0])  # east, onto the exit -10
    assert number(HEXWORLD, "straight-way-loss", state="(1,0)") == pytest.approx(0)


def test_of_two_equally_near_exits_the_straight_way_takes_the_better() -> None:
    assert number(HEXWORLD, "straight-way-loss", state="(4,2)") == pytest.approx(0)


def test_the_first_sweeps_of_the_straight_line_by_hand() -> None:
    first = 0.3 * -1
    second = 0.7 * 0.9 * 10 + 0.3 * (-1 + 0.9 * first)
    assert number(LINE, "sweep-value", state="(5,0)", sweep=1) == pytest.approx(first)
    assert number(LINE, "sweep-value", state="(5,0)", sweep=2) == pytest.approx(second)


def test_the_greedy_actions_of_the_straight_line_are_east_from_sweep_six_on() -> None:
    values = [0.0] * 7
    policies = []
    for _ in range(20):
        stay = [0.3 * (-1 + 0.9 * values[q]) for q in range(6)]
        east = [stay[q] + 0.7 * 0.9 * values[q + 1] for q in range(6)]
        west = [stay[q] + 0.7 * 0.9 * values[q - 1] if q else -math.inf for q in range(6)]
        policies.append(all(values[q + 1] > values[q - 1] for q in range(1, 6)))
        values = [*(max(pair) for pair in zip(east, west, strict=True)), 10.0]
    assert number(LINE, "last-policy-change") == policies.index(True) + 1
    for q in range(1, 6):  # the reward of the exit at (6,0) spreads by one hex a sweep
        assert number(LINE, "last-policy-change", state=f"({q},0)") == 7 - q


def test_the_last_hex_with_a_wrong_greedy_action_is_between_the_exits() -> None:
    states = map(HEXWORLD.problem.format_state, HEXWORLD.problem.enumerate_states())
    sweeps = {state: number(HEXWORLD, "last-policy-change", state=state) for state in states}
    assert max(sweeps.values()) == number(HEXWORLD, "last-policy-change") == 10
    assert [state for state, sweep in sweeps.items() if sweep == 10] == ["(3,2)"]


def test_the_reason_for_a_wrong_sweep_is_the_values_of_the_best_two_actions() -> None:
    truth = compute_truth(LINE, QuantityCall("last-policy-change", {"state": "(1,0)"}))
    tie = 0.3 * -1 + 0.9 * -0.3  # east and west before the reward arrives
    assert truth.explain("2") == f"in sweep 2, the best two actions are worth {tie:g} and {tie:g}"


def test_the_residual_bounds_all_later_changes(
    sweeps: tuple[list[str], np.ndarray, np.ndarray],
) -> None:
    _, converged, _ = sweeps
    tables = tabulate(HEXWORLD.problem)
    values = np.zeros(len(converged))
    for sweep in range(1, 30):
        previous = values
        q = tables.rewards[:, :, 0] + 0.9 * np.einsum("sat,t->sa", tables.transition, values)
        values = q.max(axis=1)
        bound = number(HEXWORLD, "largest-later-change", sweep=sweep)
        residual = np.abs(values - previous).max()
        assert bound == pytest.approx(sum(0.9**k * residual for k in range(1, 400)))
        assert np.abs(converged - values).max() <= bound + 1e-9


def test_states_are_ordered_by_their_distance_to_the_exit() -> None:
    states = ["(2,0)", "(5,0)", "(0,0)"]
    assert compute(LINE, "order-of-values", states=states) == ("(5,0)", "(2,0)", "(0,0)")


@pytest.mark.parametrize(("discount", "probability"), [(0.9, 0.0), (0.7, 1.0), (0.3, 0.0)])
def test_the_exit_that_the_best_play_takes_depends_on_the_discount(
    discount: float, probability: float
) -> None:
    position = open_problem("hexworld", seed=19)  # at (3,2)
    computed = number(position, "exit-probability", exit_state="(0,1)", discount=discount)
    names, _, q = iterate_values(discount)
    reached = np.zeros(len(names))
    reached[names.index("(3,2)")] = 1.0
    transition = tabulate(load_problem("hexworld")).transition
    left_by = 0.0
    for _ in range(500):
        exit_index = names.index("(0,1)")
        left_by += reached[exit_index]
        reached = sum(reached[s] * transition[s, q[s].argmax()] for s in range(len(names)))
    assert computed == pytest.approx(left_by, abs=1e-6)
    assert computed == pytest.approx(probability, abs=1e-6)


def test_an_undone_turn_meets_the_same_draw() -> None:
    position = open_problem("hexworld", seed=7, after=("e", "e"))
    assert compute(position, "state-after-undo", action="e") == {"(8,2)"}  # bumped, as before
    assert compute(position, "state-after-undo", action="sw") == {"(8,1)"}


def test_an_agents_return_is_that_of_its_game_with_the_same_draws() -> None:
    session = HEXWORLD.session.copy_at_start()
    for action in ("nw", "w", "e"):
        session.advance([HEXWORLD.problem.parse_action(0, action)])
    assert number(HEXWORLD, "agent-return", agent="optimal") == session.seat_return(0)


def test_an_agent_plays_on_from_the_position() -> None:
    position = open_problem("hexworld", seed=7, after=("e", "e"))  # a bump costs 0.9
    session = position.session.copy_at_start()
    for action in ("e", "e", "sw", "se", "se", "se"):
        session.advance([position.problem.parse_action(0, action)])
    assert session.over
    assert number(position, "agent-return", agent="optimal") == session.seat_return(0)


def test_a_car_that_only_pushes_right_swings_back() -> None:
    facts = {"start_low": -0.52, "start_high": -0.52, "start_speed": 0.0}
    position = open_problem("mountain-car", parameters=facts)
    x, v, highest = -0.52, 0.0, -1.2
    for _ in range(200):
        v += 0.001 - 0.0025 * math.cos(3 * x)
        x += v
        highest = max(highest, x)
    computed = number(position, "furthest-number", action="right", turns=200)
    assert computed == pytest.approx(highest, abs=1e-6)


def test_beliefs_by_hand() -> None:
    hungry = 0.5 + 0.5 * 0.1
    cry = hungry * 0.8 + (1 - hungry) * 0.1
    computed = number(BABY, "belief", state="hungry", history=["ignore crying"])
    assert computed == pytest.approx(hungry * 0.8 / cry)
    assert number(BABY, "belief", state="hungry", history=["feed crying"]) == 0
    heard = number(BABY, "observation-probability", action="ignore", observation="crying")
    assert heard == pytest.approx(cry)
    distribution = compute(BABY, "belief-distribution", history=["ignore crying"])
    assert isinstance(distribution, Mapping)
    assert sum(distribution.values()) == pytest.approx(1)


@pytest.mark.parametrize(
    ("typed", "reason"),
    [
        ("0.3", "in each possible state, the chance is from 0.0048 to 0.209"),
        ("0.001", "in each possible state, the chance is from 0.0048 to 0.209"),
        ("0.21", "0.21 is the chance in the state 80 alone"),
        ("0.1", "in the state 80 the chance is 0.209, but in 20 it is 0.0048"),
    ],
)
def test_the_reason_for_a_wrong_chance_is_that_of_the_states(typed: str, reason: str) -> None:
    catch = open_problem("catch")
    call = QuantityCall("observation-probability", {"action": "100", "observation": "caught"})
    truth = compute_truth(catch, call)
    chances = [1 / (1 + math.exp((100 - skill) / 15)) for skill in (20, 40, 60, 80)]
    assert truth.value == pytest.approx(sum(chances) / 4)
    assert truth.explain(typed) == reason


def test_the_reason_for_a_wrong_chance_does_not_print_it_if_all_states_have_it() -> None:
    arguments = {"action": "feed", "observation": "crying", "history": ["feed quiet"]}
    truth = compute_truth(BABY, QuantityCall("observation-probability", arguments))
    assert truth.value == pytest.approx(0.1)
    assert truth.explain("0.8") == ""


@pytest.mark.parametrize(
    ("typed", "reason"),
    [
        ("0.8", "0.8 is P(crying | hungry); the question is P(hungry | crying)"),
        ("0.1", "0.1 is P(crying | sated); the question is P(hungry | crying)"),
        ("0.55", "0.55 is P(hungry) just before 'crying'; the question is P(hungry | crying)"),
        ("0.44", "0.44 is P(hungry and crying); the question is P(hungry | crying)"),
        ("0.889", "0.889 would follow if P(hungry) were 0.5 just before 'crying'"),
    ],
)
def test_the_reason_for_a_wrong_belief_names_the_usual_mistake(typed: str, reason: str) -> None:
    arguments = {"state": "hungry", "history": ["ignore crying"]}
    truth = compute_truth(BABY, QuantityCall("belief", arguments))
    assert truth.value == pytest.approx(0.44 / (0.44 + 0.45 * 0.1))
    assert truth.explain(typed) == reason


def test_an_observation_that_is_equally_likely_in_all_states_changes_no_belief() -> None:
    machine = open_problem("machine-replacement")
    arguments = {"state": "0", "history": ["manufacture nondefective"] * 3}
    truth = compute_truth(machine, QuantityCall("belief", arguments))
    assert truth.value == pytest.approx(0.9**6)
    assert truth.explain("0.9") == (
        "your last action showed nothing about the state; only changes of the state count. "
        "After the first action, it was 0.81"
    )


def test_the_value_of_feeding_lies_on_a_line_between_its_values_in_the_states() -> None:
    arguments = {"action": "feed", "belief": "hungry 0.4 sated 0.6", "turns_left": 2}
    truth = compute_truth(BABY, QuantityCall("belief-value", arguments))
    assert truth.value == pytest.approx(0.6 * -5 + 0.4 * -15)
    assert truth.explain("-12") == (
        "it is 0.7 of the way from -5 (sure of sated) to -15 (sure of hungry)"
    )
    machine = open_problem("machine-replacement", turns=20)
    arguments = {"action": "manufacture", "belief": "0.5 0.25 0.25", "turns_left": 1}
    truth = compute_truth(machine, QuantityCall("belief-value", arguments))
    assert truth.value == pytest.approx(0.5 * 0.9025 + 0.25 * 0.475 + 0.25 * 0.25)
    assert truth.explain("1") == (
        "the values in the states are 0.902 (sure of 0), 0.475 (sure of 1), 0.25 (sure of 2)"
    )


def collide(height: float, rate: float, advised: int, seconds: int) -> float:
    """Return the probability of a collision, by recursion over the gusts."""
    if seconds == 0:
        return float(abs(height) < 50)
    change = min(max(advised - rate, -1), 1) if advised else 0
    return sum(
        p * collide(height + rate, rate + change + gust, advised, seconds - 1)
        for gust, p in ((-2, 0.25), (0, 0.5), (2, 0.25))
    )


@pytest.mark.parametrize(
    ("action", "advised", "height", "rate", "seconds"),
    [
        ("no-advisory", 0, 52, 0, 3),
        ("climb", 5, 0, 0, 9),
        ("descend", -5, 15, -4, 8),
        ("climb", 5, 51, 0, 0),
    ],
)
def test_the_probability_of_a_collision_by_recursion_over_the_gusts(
    action: str, advised: int, height: float, rate: float, seconds: int
) -> None:
    encounter = open_problem("collision-avoidance", parameters={"repaired": True})
    computed = number(
        encounter, "collision-probability", action=action, height=height, rate=rate, seconds=seconds
    )
    assert computed == pytest.approx(collide(height, rate, advised, seconds))


def test_the_probability_of_a_collision_from_52_m_in_three_seconds_by_hand() -> None:
    # The gusts move the height by 2 g1 + g2; below -2 are -6 and -4.
    encounter = open_problem("collision-avoidance")
    arguments = {"action": "no-advisory", "height": 52.0, "rate": 0.0, "seconds": 3}
    truth = compute_truth(encounter, QuantityCall("collision-probability", arguments))
    assert truth.value == pytest.approx(1 / 16 + 2 / 16)
    assert truth.explain("0.5") == (
        "the height at the pass is 52 m on average, in at least 9 of 10 cases from 46 to 58 m"
    )


def test_the_reason_for_a_wrong_belief_is_the_prior_from_which_it_would_follow() -> None:
    arguments = {"state": "hungry", "history": ["ignore crying"]}
    reason = compute_truth(BABY, QuantityCall("belief", arguments)).explain("70%")
    prior = float(reason.partition("were ")[2].split()[0])
    assert prior * 0.8 / (prior * 0.8 + (1 - prior) * 0.1) == pytest.approx(0.7, abs=1e-3)


@pytest.mark.parametrize("problem", ["hexworld", "hexworld:straight-line"])
def test_the_greedy_actions_of_a_sweep_are_those_that_the_watched_algorithm_draws(
    problem: str,
) -> None:
    position = open_problem(problem)
    settled = int(number(position, "last-policy-change"))
    request = WatchRequest(position.problem, 0, position.session)
    arrows = []
    for step in find_algorithm("value-iteration").iterate_steps(request):
        picture = step.pictures[0]
        assert isinstance(picture, StateValues)
        actions = picture.actions
        arrows.append([] if actions is None else actions.tolist())
    assert all(drawn == arrows[-1] for drawn in arrows[settled:])
    if problem == "hexworld":  # on the line, wrong actions tie before, and the arrows do not change
        assert arrows[settled - 1] != arrows[settled]


def test_with_a_small_discount_the_best_play_never_walks_to_an_exit() -> None:
    position = open_problem("hexworld", seed=19)  # at (3,2)
    arguments = {"exit_state": "(0,1)", "discount": 0.3}
    reason = compute_truth(position, QuantityCall("exit-probability", arguments)).explain("0.3")
    assert reason.endswith("; with probability 1, the best play never leaves at all")


def test_the_boundary_with_two_turns_left_by_hand() -> None:
    # Feeding costs 5 now and saves 0.9 x 10 x (p + 0.1 (1 - p)).
    boundary = (5 / 9 - 0.1) / 0.9
    computed = number(
        BABY, "best-action-boundary", below="ignore", above="feed", state="hungry", turns_left=2
    )
    assert computed == pytest.approx(boundary)
    assert number(BABY, "alpha-vector-count", turns_left=1) == 1


def recursive_value(belief: np.ndarray, turns: int) -> dict[str, float]:
    """Return the value of each action of the machine, by recursion over all observations."""
    problem = load_problem("machine-replacement")
    tables = tabulate(problem)
    values = {}
    for a, label in enumerate(problem.actions[0].labels):
        value = float(belief @ tables.rewards[:, a, 0])
        predicted = belief @ tables.transition[:, a]
        for o in range(2) if turns > 1 else ():
            joint = predicted * tables.observation_model[a, :, o]
            if joint.sum() > 0:
                later_values = recursive_value(joint / joint.sum(), turns - 1)
                value += joint.sum() * max(later_values.values())
        values[label] = value
    return values


def test_replacing_a_broken_machine_pays_with_six_turns_left() -> None:
    machine = open_problem("machine-replacement", turns=20)
    both_failed = np.array([0.0, 0.0, 1.0])
    five, six = (recursive_value(both_failed, turns) for turns in (5, 6))
    assert max(five, key=lambda action: five[action]) != "replace"
    assert max(six, key=lambda action: six[action]) == "replace"
    assert number(machine, "fewest-turns", action="replace", belief="2 1") == 6
    loss = number(machine, "belief-loss", action="examine", belief="2 1", turns_left=5)
    assert loss == pytest.approx(max(five.values()) - five["examine"])
    arguments = {"action": "examine", "belief": "2 1", "turns_left": 5}
    truth, best = compute_truth(machine, QuantityCall("belief-loss", arguments)), max(five.values())
    assert truth.explain(f"{loss:.3g}") == (
        f"here, examine is worth {five['examine']:g}, and the best action {best:g}"
    )


def test_turns_left_count_from_the_history_of_a_hidden_state() -> None:
    position = open_problem("crying-baby", turns=10)
    arguments = {"action": "feed", "belief": "hungry 0.4 sated 0.6", "turns_left": 2}
    value = number(position, "action-value", **arguments)
    assert value == pytest.approx(0.6 * -5 + 0.4 * -15)
    history = ["ignore quiet", "feed quiet", "ignore crying"]
    hungry = number(position, "belief", state="hungry", history=history)
    arguments = {"action": "feed", "history": history, "turns_left": 2}
    value = number(position, "action-value", **arguments)
    assert value == pytest.approx((1 - hungry) * -5 + hungry * -15)


def test_a_wrong_push_is_explained_by_its_cost_without_noise() -> None:
    regulator = open_problem("simple-regulator", turns=3)
    arguments = {"theta1": -0.5, "state": 2.0, "turns_left": 3}
    numbers = [2.0, 1.0, 0.5]
    cost = sum(0.9**turn * number**2 for turn, number in enumerate(numbers))
    truth = compute_truth(regulator, QuantityCall("linear-policy-loss", arguments))
    assert truth.explain("") == (
        f"without noise, 3 turns cost {cost:.3f} by this rule; the first one alone costs 4"
    )


def test_a_wrong_loss_is_explained_by_the_value_that_it_gives_to_the_best_action() -> None:
    arguments = {"action": "ignore", "belief": "hungry 1", "turns_left": 2}
    truth = compute_truth(BABY, QuantityCall("belief-loss", arguments))
    assert truth.value == pytest.approx(19 - 15)  # -10 - 0.9 x 10 against -15
    assert truth.explain("1") == "if it were right, the best action would be worth -18 here"


def test_the_cost_of_noise_is_a_geometric_sum() -> None:
    regulator = open_problem("simple-regulator", turns=10)
    cost = sum(0.1**2 * 0.9**turn for turn in range(1, 10))
    truth = compute_truth(regulator, QuantityCall("noise-cost", {"turns_left": 10}))
    assert truth.value == pytest.approx(cost)
    assert truth.explain("0.1") == (
        "yours is 0.01 in each turn on average, but turn 1 costs 0 (you start at 0) and turn 10 "
        "costs 0.0039"
    )
    assert not compute_truth(regulator, QuantityCall("noise-cost", {"turns_left": 2})).explain("1")
    # From 1 with theta1 = -0.5, the mean halves each turn, and the variance is that of a sum.
    loss, mean, variance = 0.0, 1.0, 0.0
    for turn in range(1, 10):
        mean, variance = mean / 2, variance / 4 + 0.01
        loss += 0.9**turn * (mean**2 + variance - 0.01)
    computed = number(regulator, "linear-policy-loss", theta1=-0.5, state=1.0, turns_left=10)
    assert computed == pytest.approx(loss)


def test_best_replies_and_levels_by_hand() -> None:
    game = open_problem("travelers-dilemma", turns=5)
    assert compute(game, "best-reply", opponent="99") == {"98"}
    payoffs = {
        claim: sum(
            claim + 2 if claim < o else claim if claim == o else o - 2 for o in range(2, 101)
        )
        for claim in range(2, 101)
    }
    best = {str(claim) for claim, total in payoffs.items() if total == max(payoffs.values())}
    assert compute(game, "level-k-action", level=1) == best == {"96", "97"}
    assert compute(game, "level-k-action", level=2) == {"95"}
    assert number(game, "equilibrium-payoff") == 2
    assert number(game, "expected-payoff", action="98", opponent="99") == 100


def test_mixed_strategies_by_hand() -> None:
    game = open_problem("rock-paper-scissors", turns=10)
    mix = "rock 0.5 paper 0.25 scissors 0.25"
    assert number(game, "expected-payoff", action="paper", opponent=mix) == pytest.approx(0.25)
    assert compute(game, "best-reply", opponent=mix) == {"paper"}
    assert number(game, "equilibrium-probability", action="rock") == pytest.approx(1 / 3)
    assert compute(game, "agent-action", agent="beat-last", rounds=["paper rock"]) == {"scissors"}


def test_the_score_of_ten_rounds_by_hand() -> None:
    game = open_problem("prisoners-dilemma", turns=10)
    defections = ["defect"] * 10
    once = ["cooperate"] * 4 + ["defect"] + ["cooperate"] * 5
    for agent, actions, score in [
        ("tit-for-tat", defections, 0 - 3 * 9),
        ("tit-for-tat", once, -4 - 0 - 4 - 4),
        ("grim", once, -4 - 0 - 4 * 5),
    ]:
        assert number(game, "repeated-payoff", agent=agent, actions=actions) == score
    call = QuantityCall("repeated-payoff", {"agent": "tit-for-tat", "actions": defections})
    assert compute_truth(game, call).explain("-30") == (
        "the 10 rounds do not all pay you the same, but from -3 to 0"
    )
    with pytest.raises(ValueError, match="expected one that does not act at random"):
        compute(game, "repeated-payoff", agent="random", actions=defections)


def test_values_equal_to_the_last_one_of_a_list_are_not_lower() -> None:
    values = dict.fromkeys("abcdefg", 2.0) | {"h": 2.0, "i": 1.0, "j": 3.0}
    assert format_values(values) == (
        "the values are j: 3, a: 2, b: 2, c: 2, d: 2, e: 2 (also of 3 others); 1 other is lower"
    )
    assert format_values({"a": 1.0, "b": 2.0}) == "the values are b: 2, a: 1"


def test_strategies_are_told_apart_by_their_replies() -> None:
    game = open_problem("prisoners-dilemma", turns=10)
    rounds = ["cooperate cooperate", "defect cooperate", "cooperate defect", "cooperate cooperate"]
    names = ["tit-for-tat", "grim", "always-cooperate"]
    matching = compute(game, "matching-agents", rounds=rounds, candidates=names)
    assert matching == {"tit-for-tat"}


def test_both_caregivers_pay_for_two_meals_and_a_hungry_turn() -> None:
    pair = open_problem("multicaregiver-crying-baby", turns=10)
    assert number(pair, "team-cost", state="hungry", actions="feed feed") == 10 + 10 + 2.5 + 5


@pytest.mark.parametrize(("typed", "is_right"), [("27.5", True), ("-27.5", True), ("-20", False)])
def test_a_cost_may_be_typed_as_a_negative_reward(typed: str, is_right: bool) -> None:
    pair = open_problem("multicaregiver-crying-baby", turns=10)
    call = QuantityCall("team-cost", {"state": "hungry", "actions": "feed feed"})
    check = check_answer(pair, Prediction(call), compute_truth(pair, call), typed)
    assert check.is_right == is_right
    if not is_right:
        assert check.reason == (
            "-20, a cost of 20, is too low. The same actions cost 7.5 in all if the state is sated"
        )


def test_the_first_meal_of_a_joint_plan_by_hand() -> None:
    facts = {"becomes_hungry": 0.1}
    pair = open_problem("multicaregiver-crying-baby", parameters=facts, turns=10)
    truth = compute_truth(pair, QuantityCall("planned-action", {"agent": "joint-plan"}))
    assert truth.value == frozenset(["feed"])
    # The partner would have to feed, which costs 5 instead of 2.5; singing costs 0.5 more.
    assert truth.explain("ignore").startswith("ignore is worth 2.5 less than the best action")
    assert truth.explain("sing").startswith("sing is worth 3 less than the best action")


def test_the_equilibrium_on_three_hexes_is_a_distribution() -> None:
    hunt = open_problem("predator-prey:triangle", turns=12)
    probabilities = [
        number(hunt, "agent-probability", agent="equilibrium", state="(0,0) (0,1)", action=action)
        for action in hunt.problem.actions[0].labels
    ]
    assert sum(probabilities) == pytest.approx(1)
    assert sum(p > 0.01 for p in probabilities) == 3


@pytest.mark.parametrize(
    ("typed", "gain", "reply"), [("0.5", 7.5, "sw"), ("1", 30, "sw"), ("0", 30, "e")]
)
def test_without_slips_each_of_three_hexes_is_equally_dangerous(
    typed: str, gain: float, reply: str
) -> None:
    hunt = open_problem("predator-prey:triangle", parameters={"slip": 0.0}, turns=10)
    arguments = {"agent": "equilibrium", "state": "(0,0) (0,1)", "action": "ne"}
    truth = compute_truth(hunt, QuantityCall("agent-probability", arguments))
    assert truth.value == pytest.approx(1 / 3)
    # The prey chooses the hex with the least probability; a capture costs 100, one turn later.
    p = float(typed)
    assert 100 * 0.9 * (1 / 3 - min(p, (1 - p) / 2)) == pytest.approx(gain)
    assert truth.explain(typed) == (
        f"if predator plays ne with {p:g}, and shares out the rest in proportion, "
        f"the reply {reply} earns prey {gain:g} more on average than in the equilibrium"
    )


@pytest.mark.parametrize(
    ("problem", "call", "asks", "typed"),
    [
        ("crying-baby", QuantityCall("belief", {"history": ["feed crying"]}), "state", "sated"),
        (
            "multicaregiver-crying-baby",
            QuantityCall("team-cost", {"state": "hungry"}),
            "actions",
            "feed sing",
        ),
        ("simple-regulator", QuantityCall("noise-cost"), "turns_left", "3"),
        (
            "predator-prey:triangle",
            QuantityCall("agent-probability", {"agent": "equilibrium", "state": "(0,0) (0,1)"}),
            "action",
            "ne",
        ),
    ],
)
def test_an_argument_that_is_no_number_can_be_asked_for(
    problem: str, call: QuantityCall, asks: str, typed: str
) -> None:
    position = open_problem(problem, turns=10)
    prediction = Prediction(call, asks, at_least=0.01)
    assert check_answer(position, prediction, None, typed).is_right
    if asks == "action":
        assert describe_right_answer(position, prediction, None) == "e or ne or nw"
    assert not check_answer(position, Prediction(call, asks, at_least=99.0), None, typed).is_right


@pytest.mark.parametrize(
    ("problem", "name", "arguments", "message"),
    [
        ("hexworld", "state-value", {"state": "nowhere"}, "got 'nowhere', expected a state"),
        ("hexworld", "action-value", {"action": "up"}, "unknown action 'up'"),
        ("hexworld", "best-action", {"belief": "(1,1) 1"}, "expected a problem with hidden states"),
        ("crying-baby", "best-action", {"state": "sated"}, "expected a history or a belief"),
        (
            "machine-replacement",
            "fewest-turns",
            {"action": "replace", "belief": ""},
            "expected 3 numbers: the probabilities of 0, 1 and 2",
        ),
        ("hexworld", "largest-later-change", {"sweep": 0}, "sweep: got 0, expected 1 to 1000"),
        (
            "hexworld",
            "search-error-share",
            {"state": "(2,1)", "simulations": 3},
            "got 3 simulations, expected 6",
        ),
        ("hexworld", "belief", {"state": "(0,0)", "history": ["e x"]}, "expected hidden states"),
        ("2048", "sweep-value", {"state": "", "sweep": 2}, "values of 2048 are about another game"),
        ("crying-baby", "straight-way-loss", {"state": "hungry"}, "expected the problem hexworld"),
        ("hexworld", "best-reply", {"opponent": "e"}, "does not fit .* expected two agents"),
        ("hexworld", "noise-cost", {"turns_left": 3}, "expected the problem simple-regulator"),
        (
            "hexworld",
            "collision-probability",
            {"action": "e", "height": 0.0, "rate": 0.0, "seconds": 3},
            "expected the problem collision-avoidance",
        ),
        (
            "collision-avoidance",
            "collision-probability",
            {"action": "climb", "height": 0.0, "rate": 0.0, "seconds": 41},
            "seconds: got 41, expected 0 to 40",
        ),
        ("collaborative-predator-prey:sighted", "best-action", {}, "are upper bounds"),
        ("predator-prey", "outcomes", {"action": "e"}, "expected one agent"),
        ("rock-paper-scissors", "state-value", {}, "expected one agent"),
        ("simple-regulator", "forward-search-action", {"depth": 1}, "expected named actions"),
        ("simple-regulator", "planned-action", {"agent": "optimal"}, "expected named actions"),
        ("crying-baby", "agent-probability", {"agent": "optimal", "action": "feed"}, "visible"),
        ("hexworld", "planned-action", {"agent": "nash"}, "agent nash is for"),
        ("travelers-dilemma", "level-k-action", {"level": 10**9}, "level: got 1000000000"),
        ("mountain-car", "furthest-number", {"action": "left", "turns": 10**9}, "turns: got 10000"),
        (
            "mountain-car",
            "furthest-number",
            {"action": "left", "turns": 3, "component": 9},
            "component: got 9, but a state has 2 numbers",
        ),
        ("crying-baby", "alpha-vector-count", {"turns_left": 10**5}, "turns_left: got 100000"),
        (
            "hexworld",
            "missed-outcome-probability",
            {"action": "e", "outcome": "(1,1)", "tries": 10**400},
            "tries: got 10000",
        ),
        ("hexworld", "order-of-values", {"states": ["(1,1)"] * 3000}, "states: got 3000 texts"),
        (
            "prisoners-dilemma",
            "matching-agents",
            {"rounds": ["defect defect"] * 2500, "candidates": ["grim"]},
            "rounds: got 2500 texts, expected at most 100",
        ),
        (
            "simple-regulator",
            "linear-policy-loss",
            {"theta1": 0.0, "state": 1e300, "turns_left": 5},
            "state: got 1e.300, expected -1e.06 to 1e.06",
        ),
        (
            "simple-regulator",
            "linear-policy-value",
            {"theta1": 9.0, "state": 1.0, "turns_left": 900},
            "the value is too large for a number",
        ),
    ],
)
def test_a_problem_or_an_argument_that_does_not_fit_is_one_clear_error(
    problem: str, name: str, arguments: dict[str, object], message: str
) -> None:
    with pytest.raises((ValueError, LookupError, RuntimeError), match=message):
        compute(open_problem(problem, turns=5), name, **arguments)
