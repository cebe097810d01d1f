from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay.core import Problem
from dmplay.errors import BadParameter, BadPolicy
from dmplay.finding.agents import load_roster
from dmplay.hexes import format_hex, hex_distance, path_lengths
from dmplay.problems._hunt import STANDARD_HEXES

E, NE, NW, W, SW, SE = range(6)
PROBLEM = dmplay.load_problem("predator-prey")
STRAIGHT, LEFT, RIGHT = 0.0, 0.7, 0.85  # draws that do not slip, slip to the left, to the right


def hunt(predators: int, prey: int, **parameters: Any) -> Problem:
    return dmplay.load_problem("predator-prey", predators=predators, prey=prey, **parameters)


def stepped(
    problem: Problem, state: str, actions: list[int], draws: list[float]
) -> tuple[str, list[float]]:
    s = problem.parse_state(state)
    after = problem.step(s[None], np.array([actions]), np.array([draws]))
    return problem.format_state(after.state[0]), after.rewards[0].tolist()


def test_the_game_starts_as_in_the_figure() -> None:
    assert PROBLEM.uniform_counts.start == 0
    assert PROBLEM.format_state(PROBLEM.sample_initial_states(np.zeros((1, 0)))[0]) == "(1,2) (2,0)"


@pytest.mark.parametrize(
    "problem",
    [hunt(2, 1), hunt(1, 2), dmplay.load_problem("predator-prey:circle"), hunt(1, 1, slip=0.1)],
)
def test_only_one_against_one_on_the_standard_map_does(problem: Problem) -> None:
    agents = len(problem.agents)
    assert problem.uniform_counts == (0 if problem == hunt(1, 1, slip=0.1) else agents, agents)


def test_a_predator_walks_and_pays_and_a_prey_walks_for_free() -> None:
    assert stepped(PROBLEM, "(1,2) (2,0)", [SW, E], [STRAIGHT, STRAIGHT]) == (
        "(1,1) (3,0)",
        [-1, 0],
    )


def test_a_slip_goes_to_the_side_and_a_bump_costs_a_predator_no_more() -> None:
    assert stepped(PROBLEM, "(1,1) (2,0)", [SW, NW], [RIGHT, LEFT]) == ("(1,1) (1,0)", [-1, 0])
    assert stepped(PROBLEM, "(1,1) (2,0)", [SW, NW], [LEFT, RIGHT]) == ("(2,0) (2,0)", [-1, 0])


def test_two_may_swap_places_without_a_capture() -> None:
    assert stepped(PROBLEM, "(1,0) (2,0)", [E, W], [STRAIGHT, STRAIGHT]) == (
        "(2,0) (1,0)",
        [-1, 0],
    )


@pytest.mark.parametrize("a", range(6))
def test_a_predator_feeds_where_it_stands_and_the_prey_is_born_anywhere(a: int) -> None:
    for place, hex_ in enumerate(STANDARD_HEXES):
        draw = (place + 0.5) / 12
        assert stepped(PROBLEM, "(4,0) (4,0)", [a, a], [draw, draw]) == (
            f"(4,0) {format_hex(hex_)}",
            [1, -100],
        )


def test_three_prey_feed_two_predators_while_a_third_hunts_on() -> None:
    after = stepped(
        hunt(3, 4),
        "(1,0) (1,0) (4,0) (1,0) (1,0) (1,0) (0,2)",
        [E, W, SE, E, E, E, E],
        [STRAIGHT] * 3 + [0.0, 0.5, 0.999, STRAIGHT],
    )
    assert after == (
        "(1,0) (1,0) (4,0) (-1,2) (4,1) (4,0) (1,2)",  # south-east of (4,0) is no hex
        [1.5, 1.5, -1, -100, -100, -100, 0],
    )


def test_captures_on_two_hexes_do_not_mix() -> None:
    _, rewards = stepped(
        hunt(2, 3), "(0,0) (1,0) (0,0) (0,0) (1,0)", [E] * 5, [STRAIGHT] * 2 + [0.5] * 3
    )
    assert rewards == [2, 1, -100, -100, -100]


def test_a_prey_is_as_likely_born_on_each_of_the_twelve_hexes() -> None:
    s = PROBLEM.parse_state("(2,0) (2,0)")
    p, outcome = dmplay.enumerate_outcomes(PROBLEM, s[None], np.array([[E, E]]))
    assert np.bincount(outcome.state[0, :, 1], p[0]) == pytest.approx(np.full(12, 1 / 12))
    assert (outcome.state[0, :, 0] == s[0]).all()


def test_one_hex_is_map_enough() -> None:
    alone = hunt(1, 1, hexes=[[0, 0]])
    p, outcome = dmplay.enumerate_outcomes(alone, np.array([[0, 0]]), np.array([[E, W]]))
    assert p[0].sum() == pytest.approx(1)
    assert (outcome.state == 0).all()


def test_agents_are_numbered_where_there_are_several() -> None:
    assert PROBLEM.agents == ("predator", "prey")
    assert hunt(1, 2).agents == ("predator1", "prey1", "prey2")
    assert hunt(2, 1).agents == ("predator1", "predator2", "prey1")


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
    place = {hex_: index for index, hex_ in enumerate(STANDARD_HEXES)}
    assert steps[place[(1, 1)], place[(3, 1)]] == 3  # (2,1) is a hole: by (2,0) and (3,0)
    assert hex_distance((1, 1), (3, 1)) == 2
    assert (steps == steps.T).all()
    assert path_lengths([(0, 0), (5, 5)]).tolist() == [[0, 2], [2, 0]]


def chosen(problem: Problem, agent: str, seat: int, state: str) -> int:
    policy = dmplay.load_agent(problem, seat, agent)
    s = problem.parse_state(state)[None]
    return int(policy.choose(policy.initial_memory(s), None, np.zeros((1, 0)))[0])


def test_a_predator_chases_along_the_map() -> None:
    assert chosen(PROBLEM, "chase", 0, "(1,1) (3,1)") == SE
    assert chosen(PROBLEM, "chase", 0, "(1,2) (2,0)") == SW
    assert chosen(PROBLEM, "chase", 0, "(-1,2) (0,0)") == SW  # (0,1) is a hole


def test_a_prey_flees_and_prefers_the_first_direction_among_equals() -> None:
    assert chosen(PROBLEM, "flee", 1, "(1,1) (2,0)") == E
    assert chosen(PROBLEM, "flee", 1, "(3,0) (2,0)") == NW  # west is as far
    assert chosen(PROBLEM, "flee", 1, "(1,0) (4,1)") == E  # cornered: every bump is as good


def test_each_minds_the_nearest_of_the_other_kind() -> None:
    problem = hunt(2, 2)
    assert chosen(problem, "chase", 0, "(2,0) (4,1) (0,0) (3,0)") == E
    assert chosen(problem, "flee", 3, "(0,0) (3,0) (1,2) (2,0)") == NW
    assert chosen(problem, "flee", 3, "(0,0) (0,0) (1,2) (2,0)") == E


def test_one_against_one_is_advised_by_the_best_answer_to_the_usual_opponent() -> None:
    for problem in (PROBLEM, dmplay.load_problem("predator-prey:circle")):
        assert [load_roster(problem, seat).hint_provider for seat in range(2)] == [
            "best-response"
        ] * 2
    assert (
        load_roster(dmplay.load_problem("predator-prey", discount=1.0), 1).hint_provider == "flee"
    )


def test_every_seat_is_filled_and_a_large_hunt_is_advised_after_its_kind() -> None:
    problem = hunt(2, 1)
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
    wise, foolish = (
        dmplay.rollout(PROBLEM, [chase, dmplay.load_agent(PROBLEM, 1, name)], episodes=2000)
        for name in ("flee", "random")
    )
    assert wise.returns[:, 1].mean() > foolish.returns[:, 1].mean() + 20


def test_a_map_must_be_one() -> None:
    for hexes in ([], [[0, 0], [0, 0]], [[0, 0.5]], "here"):
        with pytest.raises(BadParameter):
            hunt(1, 1, hexes=hexes)
    with pytest.raises(BadParameter):
        hunt(0, 1)


def test_the_best_response_is_worth_more_than_the_natural_play() -> None:
    for seat, natural in enumerate(("chase", "flee")):
        earned = []
        for name in (natural, "best-response"):
            agents = [
                dmplay.load_agent(PROBLEM, i, kind) for i, kind in enumerate(("chase", "flee"))
            ]
            agents[seat] = dmplay.load_agent(PROBLEM, seat, name)
            earned.append(dmplay.rollout(PROBLEM, agents, episodes=500).returns[:, seat].mean())
        assert earned[1] > earned[0]


def test_the_values_of_the_best_response_come_true() -> None:
    agents = [
        dmplay.load_agent(PROBLEM, 0, "best-response:to=random"),
        dmplay.load_agent(PROBLEM, 1, "random"),
    ]
    start = PROBLEM.sample_initial_states(np.zeros((1, PROBLEM.uniform_counts.start)))
    values = agents[0].action_values(agents[0].initial_memory(start))
    assert values is not None
    returns = dmplay.rollout(PROBLEM, agents, episodes=1000, turn_limit=150).returns[:, 0]
    assert abs(returns.mean() - values.max()) < 4 * returns.std() / np.sqrt(1000)


def test_two_predators_have_a_best_response_to_one_another_and_a_prey() -> None:
    problem = dmplay.load_problem("predator-prey:triangle", predators=2)
    agent = dmplay.load_agent(problem, 0, "best-response")
    values = agent.action_values(
        agent.initial_memory(problem.parse_state("(0,1) (0,0) (1,0)")[None])
    )
    assert values is not None
    assert values.shape == (1, 6)


def test_a_best_response_needs_known_others_and_a_discount() -> None:
    with pytest.raises(BadParameter, match="expected one of natural, chase, flee, random"):
        dmplay.load_agent(PROBLEM, 0, "best-response:to=sleep")
    with pytest.raises(BadPolicy, match="below 1"):
        dmplay.load_agent(dmplay.load_problem("predator-prey", discount=1.0), 0, "best-response")


@pytest.mark.slow
def test_in_equilibrium_both_earn_what_the_values_say() -> None:
    agents = [dmplay.load_agent(PROBLEM, seat, "equilibrium") for seat in range(2)]
    start = PROBLEM.sample_initial_states(np.zeros((1, PROBLEM.uniform_counts.start)))
    returns = dmplay.rollout(PROBLEM, agents, episodes=1000, turn_limit=150).returns
    for seat, wanted in enumerate((-8.801729, -59.913542)):
        values = agents[seat].action_values(agents[seat].initial_memory(start))
        assert values is not None
        assert values.max() == pytest.approx(wanted, abs=1e-6)
        sample = returns[:, seat]
        assert abs(sample.mean() - wanted) < 4 * sample.std() / np.sqrt(len(sample))


@pytest.mark.slow
@pytest.mark.parametrize("rival", ["chase", "random", "best-response"])
def test_the_equilibrium_prey_is_eaten_no_more_by_any_other_predator(rival: str) -> None:
    agents = [dmplay.load_agent(PROBLEM, 0, rival), dmplay.load_agent(PROBLEM, 1, "equilibrium")]
    sample = dmplay.rollout(PROBLEM, agents, episodes=2000, turn_limit=150).returns[:, 1]
    assert sample.mean() > -59.913542 - 4 * sample.std() / np.sqrt(len(sample))


def test_an_equilibrium_is_of_one_against_one_and_discounted() -> None:
    with pytest.raises(BadPolicy, match="got 3 agents on 12 hexes"):
        dmplay.load_agent(hunt(2, 1), 0, "equilibrium")
    with pytest.raises(BadPolicy, match="below 1"):
        dmplay.load_agent(dmplay.load_problem("predator-prey", discount=1.0), 0, "equilibrium")
