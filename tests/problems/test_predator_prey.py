import re
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.core.hexgrid import format_hex, hex_distance, path_lengths
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter, BadPolicy
from dmplay.game.position import Position
from dmplay.problems._shared.hex_hunt import STANDARD_HEXES
from dmplay.problems.predator_prey.teach import give_reasons
from dmplay.registry.agents import load_roster

E, NE, NW, W, SW, SE = range(6)
PROBLEM = dmplay.load_problem("predator-prey")
# uniforms for which an agent does not slip, slips left and slips right
NO_SLIP, SLIP_LEFT, SLIP_RIGHT = 0.0, 0.7, 0.85


def load_hunt(predators: int, prey: int, **parameters: Any) -> Problem:
    return dmplay.load_problem("predator-prey", predators=predators, prey=prey, **parameters)


def step_state(
    problem: Problem, state: str, actions: list[int], uniforms: list[float]
) -> tuple[str, list[float]]:
    s = problem.parse_state(state)
    outcome = problem.step(s[None], np.array([actions]), np.array([uniforms]))
    return problem.format_state(outcome.state[0]), outcome.rewards[0].tolist()


def test_the_game_starts_as_in_the_figure() -> None:
    assert PROBLEM.uniform_counts.start == 0
    assert PROBLEM.format_state(PROBLEM.sample_initial_states(np.zeros((1, 0)))[0]) == "(1,2) (2,0)"


@pytest.mark.parametrize(
    "problem",
    [
        load_hunt(2, 1),
        load_hunt(1, 2),
        dmplay.load_problem("predator-prey:circle"),
        load_hunt(1, 1, slip=0.1),
    ],
)
def test_only_the_standard_game_of_two_agents_has_a_fixed_start(problem: Problem) -> None:
    agents = len(problem.agents)
    assert problem.uniform_counts == (0 if problem == load_hunt(1, 1, slip=0.1) else agents, agents)


def test_a_predator_walks_and_pays_and_a_prey_walks_for_free() -> None:
    assert step_state(PROBLEM, "(1,2) (2,0)", [SW, E], [NO_SLIP, NO_SLIP]) == (
        "(1,1) (3,0)",
        [-1, 0],
    )


def test_a_slip_goes_to_the_side_and_a_bump_costs_a_predator_no_more() -> None:
    assert step_state(PROBLEM, "(1,1) (2,0)", [SW, NW], [SLIP_RIGHT, SLIP_LEFT]) == (
        "(1,1) (1,0)",
        [-1, 0],
    )
    assert step_state(PROBLEM, "(1,1) (2,0)", [SW, NW], [SLIP_LEFT, SLIP_RIGHT]) == (
        "(2,0) (2,0)",
        [-1, 0],
    )


def test_two_may_swap_places_without_a_capture() -> None:
    assert step_state(PROBLEM, "(1,0) (2,0)", [E, W], [NO_SLIP, NO_SLIP]) == (
        "(2,0) (1,0)",
        [-1, 0],
    )


@pytest.mark.parametrize("a", range(6))
def test_a_captured_prey_may_respawn_on_any_hex(a: int) -> None:
    for index, hex_ in enumerate(STANDARD_HEXES):
        uniform = (index + 0.5) / 12
        assert step_state(PROBLEM, "(4,0) (4,0)", [a, a], [uniform, uniform]) == (
            f"(4,0) {format_hex(hex_)}",
            [1, -100],
        )


def test_three_prey_feed_two_predators_while_a_third_hunts_on() -> None:
    outcome = step_state(
        load_hunt(3, 4),
        "(1,0) (1,0) (4,0) (1,0) (1,0) (1,0) (0,2)",
        [E, W, SE, E, E, E, E],
        [NO_SLIP] * 3 + [0.0, 0.5, 0.999, NO_SLIP],
    )
    assert outcome == (
        "(1,0) (1,0) (4,0) (-1,2) (4,1) (4,0) (1,2)",  # there is no hex south-east of (4,0)
        [1.5, 1.5, -1, -100, -100, -100, 0],
    )


def test_captures_on_two_hexes_do_not_mix() -> None:
    _, rewards = step_state(
        load_hunt(2, 3), "(0,0) (1,0) (0,0) (0,0) (1,0)", [E] * 5, [NO_SLIP] * 2 + [0.5] * 3
    )
    assert rewards == [2, 1, -100, -100, -100]


def test_a_captured_prey_respawns_uniformly() -> None:
    s = PROBLEM.parse_state("(2,0) (2,0)")
    p, outcome = dmplay.enumerate_outcomes(PROBLEM, s[None], np.array([[E, E]]))
    assert np.bincount(outcome.state[0, :, 1], p[0]) == pytest.approx(np.full(12, 1 / 12))
    assert (outcome.state[0, :, 0] == s[0]).all()


def test_a_map_may_have_a_single_hex() -> None:
    problem = load_hunt(1, 1, hexes=[[0, 0]])
    p, outcome = dmplay.enumerate_outcomes(problem, np.array([[0, 0]]), np.array([[E, W]]))
    assert p[0].sum() == pytest.approx(1)
    assert (outcome.state == 0).all()


def test_agents_are_numbered_if_there_are_several() -> None:
    assert PROBLEM.agents == ("predator", "prey")
    assert load_hunt(1, 2).agents == ("predator1", "prey1", "prey2")
    assert load_hunt(2, 1).agents == ("predator1", "predator2", "prey1")


def test_states_are_listed_with_the_first_agent_slowest() -> None:
    problem = dmplay.load_problem("predator-prey:triangle", predators=1, prey=2)
    states = problem.enumerate_states()
    assert problem.state_count == len(states) == 27
    assert [problem.format_state(states[i]) for i in (0, 1, 9)] == [
        "(0,1) (0,1) (0,1)",
        "(0,1) (0,1) (0,0)",
        "(0,0) (0,1) (0,1)",
    ]
    assert problem.state_indices(states).tolist() == list(range(27))


def test_paths_go_around_the_holes_of_the_map() -> None:
    steps = path_lengths(STANDARD_HEXES)
    index_of = {hex_: index for index, hex_ in enumerate(STANDARD_HEXES)}
    assert steps[index_of[(1, 1)], index_of[(3, 1)]] == 3  # (2,1) is a hole: by (2,0) and (3,0)
    assert hex_distance((1, 1), (3, 1)) == 2
    assert (steps == steps.T).all()
    assert path_lengths([(0, 0), (5, 5)]).tolist() == [[0, 2], [2, 0]]


def choose_action(problem: Problem, agent: str, seat: int, state: str) -> int:
    policy = dmplay.load_agent(problem, seat, agent)
    s = problem.parse_state(state)[None]
    return int(policy.choose(policy.initial_memory(s), None, np.zeros((1, 0)))[0])


def test_a_predator_chases_along_shortest_paths() -> None:
    assert choose_action(PROBLEM, "chase", 0, "(1,1) (3,1)") == SE
    assert choose_action(PROBLEM, "chase", 0, "(1,2) (2,0)") == SW
    assert choose_action(PROBLEM, "chase", 0, "(-1,2) (0,0)") == SW  # (0,1) is a hole


def test_a_prey_flees_and_prefers_the_first_direction_among_equals() -> None:
    assert choose_action(PROBLEM, "flee", 1, "(1,1) (2,0)") == E
    assert choose_action(PROBLEM, "flee", 1, "(3,0) (2,0)") == NW  # west is equally far
    assert (
        choose_action(PROBLEM, "flee", 1, "(1,0) (4,1)") == E
    )  # cornered: every bump is equally good


def test_each_agent_reacts_to_its_nearest_opponent() -> None:
    problem = load_hunt(2, 2)
    assert choose_action(problem, "chase", 0, "(2,0) (4,1) (0,0) (3,0)") == E
    assert choose_action(problem, "flee", 3, "(0,0) (3,0) (1,2) (2,0)") == NW
    assert choose_action(problem, "flee", 3, "(0,0) (0,0) (1,2) (2,0)") == E


def test_games_of_two_agents_get_hints_from_the_best_response() -> None:
    for problem in (PROBLEM, dmplay.load_problem("predator-prey:circle")):
        assert [load_roster(problem, seat).hint_provider for seat in range(2)] == [
            "best-response"
        ] * 2
    assert (
        load_roster(dmplay.load_problem("predator-prey", discount=1.0), 1).hint_provider == "flee"
    )


def test_a_larger_hunt_gets_chase_and_flee_as_partners_and_hints() -> None:
    problem = load_hunt(2, 1)
    assert [load_roster(problem, seat).default_partner for seat in range(3)] == [
        "chase",
        "chase",
        "flee",
    ]
    assert [load_roster(problem, seat).hint_provider for seat in range(3)] == [
        "chase",
        "chase",
        "flee",
    ]


def test_fleeing_is_worth_more_to_the_prey_than_chance() -> None:
    chase = dmplay.load_agent(PROBLEM, 0, "chase")
    flee_result, random_result = (
        dmplay.rollout(PROBLEM, [chase, dmplay.load_agent(PROBLEM, 1, name)], episodes=2000)
        for name in ("flee", "random")
    )
    assert flee_result.returns[:, 1].mean() > random_result.returns[:, 1].mean() + 20


def test_invalid_maps_are_rejected() -> None:
    for hexes in ([], [[0, 0], [0, 0]], [[0, 0.5]], "here"):
        with pytest.raises(BadParameter):
            load_hunt(1, 1, hexes=hexes)
    with pytest.raises(BadParameter):
        load_hunt(0, 1)


def test_the_best_response_earns_more_than_the_natural_play() -> None:
    for seat, natural in enumerate(("chase", "flee")):
        mean_returns = []
        for name in (natural, "best-response"):
            agents = [
                dmplay.load_agent(PROBLEM, i, kind) for i, kind in enumerate(("chase", "flee"))
            ]
            agents[seat] = dmplay.load_agent(PROBLEM, seat, name)
            mean_returns.append(
                dmplay.rollout(PROBLEM, agents, episodes=500).returns[:, seat].mean()
            )
        assert mean_returns[1] > mean_returns[0]


def test_the_best_response_earns_its_value() -> None:
    agents = [
        dmplay.load_agent(PROBLEM, 0, "best-response:to=random"),
        dmplay.load_agent(PROBLEM, 1, "random"),
    ]
    start = PROBLEM.sample_initial_states(np.zeros((1, PROBLEM.uniform_counts.start)))
    values = agents[0].action_values(agents[0].initial_memory(start))
    assert values is not None
    returns = dmplay.rollout(PROBLEM, agents, episodes=1000, turn_limit=150).returns[:, 0]
    assert abs(returns.mean() - values.max()) < 4 * returns.std() / np.sqrt(1000)


def test_best_responses_exist_for_two_predators() -> None:
    problem = dmplay.load_problem("predator-prey:triangle", predators=2)
    agent = dmplay.load_agent(problem, 0, "best-response")
    values = agent.action_values(
        agent.initial_memory(problem.parse_state("(0,1) (0,0) (1,0)")[None])
    )
    assert values is not None
    assert values.shape == (1, 6)


def test_a_best_response_requires_known_opponents_and_a_discount() -> None:
    with pytest.raises(BadParameter, match="expected one of natural, chase, flee, random"):
        dmplay.load_agent(PROBLEM, 0, "best-response:to=sleep")
    with pytest.raises(BadPolicy, match="below 1"):
        dmplay.load_agent(dmplay.load_problem("predator-prey", discount=1.0), 0, "best-response")


@pytest.mark.slow
def test_equilibrium_policies_earn_their_values() -> None:
    agents = [dmplay.load_agent(PROBLEM, seat, "equilibrium") for seat in range(2)]
    start = PROBLEM.sample_initial_states(np.zeros((1, PROBLEM.uniform_counts.start)))
    returns = dmplay.rollout(PROBLEM, agents, episodes=1000, turn_limit=150).returns
    for seat, expected in enumerate((-8.801729, -59.913542)):
        values = agents[seat].action_values(agents[seat].initial_memory(start))
        assert values is not None
        assert values.max() == pytest.approx(expected, abs=1e-6)
        sample = returns[:, seat]
        assert abs(sample.mean() - expected) < 4 * sample.std() / np.sqrt(len(sample))


@pytest.mark.slow
@pytest.mark.parametrize("rival", ["chase", "random", "best-response"])
def test_no_other_predator_lowers_the_value_of_the_equilibrium_prey(rival: str) -> None:
    agents = [dmplay.load_agent(PROBLEM, 0, rival), dmplay.load_agent(PROBLEM, 1, "equilibrium")]
    sample = dmplay.rollout(PROBLEM, agents, episodes=2000, turn_limit=150).returns[:, 1]
    assert sample.mean() > -59.913542 - 4 * sample.std() / np.sqrt(len(sample))


def test_an_equilibrium_requires_two_agents_and_a_discount() -> None:
    with pytest.raises(BadPolicy, match="got 3 agents on 12 hexes"):
        dmplay.load_agent(load_hunt(2, 1), 0, "equilibrium")
    with pytest.raises(BadPolicy, match="below 1"):
        dmplay.load_agent(dmplay.load_problem("predator-prey", discount=1.0), 0, "equilibrium")


@pytest.mark.parametrize("seat", [0, 1])
@pytest.mark.parametrize("prey_hex", ["(-1,1)", "(1,1)", "(3,0)"])
def test_the_distance_is_a_reason_only_for_the_better_step(seat: int, prey_hex: str) -> None:
    for hex_ in map(format_hex, STANDARD_HEXES):
        position = Position.from_text(
            PROBLEM, seat, state=f"{hex_} {prey_hex}", players=["chase", "flee"]
        )
        for action in position.legal_actions:
            reason = give_reasons(position, action)[0]
            distances = [float(number) for number in re.findall(r"\d\.\d\d", reason)]
            if distances:
                is_best = position.labels[action] in position.best_actions()
                assert is_best == ("any other step" in reason)
                is_farther = distances[0] > distances[1]
                assert distances[0] == distances[1] or is_farther == (is_best == (seat == 1))


@pytest.mark.parametrize("prey", ["flee", "random"])
def test_even_best_play_on_the_standard_map_ends_below_0(prey: str) -> None:
    for prey_hex in map(format_hex, STANDARD_HEXES):
        position = Position.from_text(
            PROBLEM, 0, state=f"(1,2) {prey_hex}", players=["chase", prey]
        )
        values = position.values()
        assert values is not None
        assert values.q.max() < 0.0
