from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay import Labels
from dmplay.core import belief
from dmplay.core.hexgrid import format_hex
from dmplay.core.policy import Percept, Policy
from dmplay.core.problem import Problem
from dmplay.errors import BadPolicy, BudgetExceeded, ImpossibleObservation
from dmplay.game.game_series import GameController
from dmplay.problems._shared.hex_hunt import STANDARD_HEXES
from dmplay.problems.collaborative_predator_prey.agents import PlansWithPartner
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.registry.agents import load_roster
from dmplay.transcript.format import collect_turn_facts
from dmplay.ui.shell.commands import run_line
from tests.support.screens import make_session_game

E, NE, NW, W, SW, SE = range(6)
PREY, NOTHING = 0, 1
PROBLEM_NAME = "collaborative-predator-prey"
PROBLEM = dmplay.load_problem(PROBLEM_NAME)
NO_SLIP = 0.0  # a uniform for which no predator slips


def list_outcomes(
    problem: Problem, state: str, actions: list[int]
) -> tuple[dict[str, float], np.ndarray]:
    """Return the probability of each next state, and the rewards, which no uniform changes."""
    p, outcome = dmplay.enumerate_outcomes(
        problem, problem.parse_state(state)[None], np.array([actions])
    )
    probabilities: dict[str, float] = {}
    for weight, s in zip(p[0], outcome.state[0], strict=True):
        if weight > 0:
            probabilities[problem.format_state(s)] = probabilities.get(
                problem.format_state(s), 0.0
            ) + float(weight)
    assert (outcome.rewards[0] == outcome.rewards[0, 0]).all()
    return probabilities, outcome.rewards[0, 0]


def load_without_slips(**parameters: Any) -> Problem:
    """Load the problem without slips, so that only the prey moves at random."""
    return dmplay.load_problem(PROBLEM_NAME, slip=0.0, **parameters)


def test_a_free_prey_moves_to_a_neighbour_without_a_predator() -> None:
    probabilities, rewards = list_outcomes(load_without_slips(), "(1,0) (4,1) (2,0)", [E, E])
    assert probabilities == pytest.approx({"(2,0) (4,1) (3,0)": 0.5, "(2,0) (4,1) (1,1)": 0.5})
    assert rewards.tolist() == [-1, -1]


def test_the_prey_avoids_a_hex_even_if_its_predator_leaves() -> None:
    probabilities, _ = list_outcomes(load_without_slips(), "(1,1) (3,0) (2,0)", [NW, W])
    assert probabilities == pytest.approx({"(0,2) (2,0) (1,0)": 1})


def test_a_prey_without_a_free_neighbour_stays() -> None:
    probabilities, _ = list_outcomes(load_without_slips(), "(-1,1) (1,0) (0,0)", [NE, NE])
    assert probabilities == pytest.approx({"(-1,2) (1,1) (0,0)": 1})
    single_predator = load_without_slips(predators=1, hexes=[[0, 0], [5, 5]])
    probabilities, _ = list_outcomes(single_predator, "(5,5) (0,0)", [E])
    assert probabilities == pytest.approx({"(5,5) (0,0)": 1})


def test_a_capture_pays_the_whole_team_and_stops_only_the_captor() -> None:
    probabilities, rewards = list_outcomes(load_without_slips(), "(2,0) (3,0) (2,0)", [E, E])
    assert probabilities == pytest.approx(
        {f"(2,0) (4,0) {format_hex(hex_)}": 1 / 12 for hex_ in STANDARD_HEXES}
    )
    assert rewards.tolist() == [10, 10]


def test_a_capture_by_both_pays_the_same() -> None:
    _, rewards = list_outcomes(PROBLEM, "(2,0) (2,0) (2,0)", [E, E])
    assert rewards.tolist() == [10, 10]


def test_a_turn_uses_three_uniforms_in_every_state() -> None:
    assert PROBLEM.uniform_counts == (3, 3)
    assert dmplay.load_problem(PROBLEM_NAME, predators=4).uniform_counts == (5, 5)


def test_a_predator_senses_the_prey_on_its_own_and_adjacent_hexes() -> None:
    s = np.array([PROBLEM.parse_state(text) for text in ("(2,0) (3,0) (2,0)", "(1,1) (4,0) (2,0)")])
    assert PROBLEM.get_observations(s).tolist() == [[PREY, PREY], [PREY, NOTHING]]  # type: ignore[attr-defined]


def test_a_sighted_predator_also_observes_its_hex() -> None:
    problem = dmplay.load_problem(f"{PROBLEM_NAME}:sighted")
    s, a = problem.parse_state("(0,0) (1,2) (3,0)")[None], np.array([[E, SW]])
    outcome = problem.step(s, a, np.array([[NO_SLIP, NO_SLIP, 0.0]]))
    assert problem.format_state(outcome.state[0]) == "(1,0) (1,1) (4,0)"
    (labels, _) = problem.observations
    assert isinstance(labels, Labels)
    assert [labels[o] for o in outcome.observations[0]] == ["nothing (1,0)", "nothing (1,1)"]
    near_outcome = problem.step(s, a, np.array([[NO_SLIP, NO_SLIP, 0.9]]))
    assert problem.format_state(near_outcome.state[0]) == "(1,0) (1,1) (2,0)"
    assert [labels[o] for o in near_outcome.observations[0]] == ["prey (1,0)", "prey (1,1)"]
    assert len(labels) == 24


def test_the_team_shares_its_reward_and_does_not_see_the_state() -> None:
    assert PROBLEM.kind == "Dec-POMDP"
    assert not PROBLEM.rewards_observable
    assert PROBLEM.agents == ("predator1", "predator2")


@pytest.mark.parametrize(
    ("name", "seat"),
    [
        (f"{PROBLEM_NAME}:triangle", 0),
        (f"{PROBLEM_NAME}:circle", 1),
        (f"{PROBLEM_NAME}:sighted", 1),
        (PROBLEM_NAME, 0),
    ],
)
def test_a_seat_updates_its_belief_by_bayes_rule_with_random_partners(name: str, seat: int) -> None:
    problem = dmplay.load_problem(name)
    policy = dmplay.load_agent(problem, seat, "chase-belief")
    expected = belief.initial_belief(problem)
    memory = policy.initial_memory(np.full(2, -1))
    s = problem.sample_initial_states(np.array([[0.1, 0.5, 0.8]]))
    for turn, a in enumerate((E, SW, NW)):
        joint = np.array([[a, W] if seat == 0 else [W, a]])
        outcome = problem.step(s, joint, np.array([[0.3, 0.75, 0.1 * turn]]))
        s, observation = outcome.state, outcome.observations[0, seat]
        memory = policy.update_memory(
            memory, Percept(np.full(2, a), np.full(2, observation), None, None)
        )
        actions: list[int | None] = [None, None]
        observations: list[int | None] = [None, None]
        actions[seat], observations[seat] = a, int(observation)
        expected = belief.update_belief(problem, expected, actions, observations).belief
        for row in memory[0]:
            assert row == pytest.approx(expected, abs=1e-12)
        assert expected[problem.state_indices(s)[0]] > 0


def test_an_impossible_observation_is_rejected() -> None:
    # every hex is adjacent to every other
    problem = dmplay.load_problem(f"{PROBLEM_NAME}:triangle")
    policy = dmplay.load_agent(problem, 0, "chase-belief")
    initial_memory = policy.initial_memory(np.array([-1]))
    with pytest.raises(ImpossibleObservation):
        policy.update_memory(
            initial_memory, Percept(np.array([E]), np.array([NOTHING]), None, None)
        )


def test_chase_belief_moves_to_the_most_likely_hex_of_the_prey() -> None:
    policy = dmplay.load_agent(PROBLEM, 0, "chase-belief")
    beliefs = np.zeros((2, 1728))
    for row, (likely_state, unlikely_state) in enumerate(
        [("(1,2) (4,0) (2,0)", "(0,0) (4,0) (4,0)"), ("(3,0) (4,0) (0,0)", "(3,0) (0,0) (3,1)")]
    ):
        beliefs[row, PROBLEM.state_indices(PROBLEM.parse_state(likely_state)[None])] = 0.6
        beliefs[row, PROBLEM.state_indices(PROBLEM.parse_state(unlikely_state)[None])] = 0.4
    assert policy.choose((beliefs,), None, np.zeros((2, 0))).tolist() == [SW, W]


def test_sweep_moves_back_and_forth_and_turns_when_it_loses_the_prey() -> None:
    policy = dmplay.load_agent(PROBLEM, 1, "sweep")
    memory = policy.initial_memory(np.array([-1]))
    actions = []
    for observation in (NOTHING, NOTHING, NOTHING, NOTHING, PREY, NOTHING, NOTHING):
        a = policy.choose(memory, None, np.zeros((1, 0)))
        actions.append(int(a[0]))
        memory = policy.update_memory(memory, Percept(a, np.array([observation]), None, None))
    assert actions == [W, W, W, E, E, W, E]


@pytest.mark.parametrize(
    "name",
    [PROBLEM_NAME, f"{PROBLEM_NAME}:circle", f"{PROBLEM_NAME}:triangle", f"{PROBLEM_NAME}:sighted"],
)
def test_a_sweeping_team_catches_more_than_chance(name: str) -> None:
    problem = dmplay.load_problem(name)
    sweep_result, random_result = (
        dmplay.rollout(
            problem, [dmplay.load_agent(problem, i, agent_name) for i in range(2)], episodes=1000
        )
        for agent_name in ("sweep", "random")
    )
    assert sweep_result.total_rewards[:, 0].mean() > random_result.total_rewards[:, 0].mean()
    assert (sweep_result.total_rewards[:, 0] == sweep_result.total_rewards[:, 1]).all()


@pytest.mark.slow
def test_a_team_that_chases_its_beliefs_catches_more_than_one_that_sweeps() -> None:
    chase_result, sweep_result = (
        dmplay.rollout(
            PROBLEM, [dmplay.load_agent(PROBLEM, i, agent_name) for i in range(2)], episodes=60
        )
        for agent_name in ("chase-belief", "sweep")
    )
    assert chase_result.total_rewards[:, 0].mean() > sweep_result.total_rewards[:, 0].mean()


def test_a_long_belief_is_shown_but_not_recorded() -> None:
    game = make_session_game(
        PROBLEM_NAME, dmplay.Session(PROBLEM, dmplay.SeededUniforms(5)), ["human", "human"]
    )
    game.session.advance([E, W])
    (_, seat_belief) = game.view().beliefs or ()
    assert seat_belief == pytest.approx(
        belief.update_belief(
            PROBLEM, belief.initial_belief(PROBLEM), [E, None], [NOTHING, None]
        ).belief
    )
    assert "belief" not in game.narrator.visible_turn_facts(game.snapshot())
    text = run_line(GameController(game), "belief")
    assert text.count("(") == 8 * 3
    assert "1720 other states" in text
    small = dmplay.Session(
        dmplay.load_problem(f"{PROBLEM_NAME}:triangle"), dmplay.SeededUniforms(5)
    )
    assert "belief" in collect_turn_facts(small)


@pytest.mark.slow
def test_qmdp_values_are_below_full_information_and_certainty_leads_to_the_prey() -> None:
    for seat in range(2):
        policy = dmplay.load_agent(PROBLEM, seat, "qmdp")
        values = policy.action_values(policy.initial_memory(np.array([-1])))
        assert values is not None
        assert values.max() < 21.0506  # the mean of the optimal values over all states
        certain_belief = np.zeros((1, 1728))
        certain_belief[0, PROBLEM.state_indices(PROBLEM.parse_state("(1,2) (4,0) (2,0)")[None])] = (
            1.0
        )
        assert int(policy.choose((certain_belief,), None, np.zeros((1, 0)))[0]) == (
            SW if seat == 0 else W
        )


def test_the_values_of_qmdp_count_the_turns_left() -> None:
    """In the last turn every move earns what the present hexes pay, so that none is better."""
    circle = dmplay.load_problem(f"{PROBLEM_NAME}:circle")
    states = [circle.format_state(s) for s in circle.enumerate_states()]
    belief = np.zeros((1, len(states)))
    belief[0, [states.index("(-1,2) (0,2) (0,0)"), states.index("(-1,2) (0,2) (0,2)")]] = 0.5

    def compute_values(name: str, *memory: int) -> np.ndarray:
        """Return the values of the six moves, with a memory after this number of turns."""
        policy = dmplay.load_agent(circle, 0, name)
        values = policy.action_values((belief, *(np.array([turns]) for turns in memory)))
        assert values is not None
        return np.asarray(values[0])

    assert compute_values("qmdp:horizon=3", 2) == pytest.approx([(-1.0 + 10.0) / 2] * 6)
    assert int(compute_values("qmdp:horizon=3", 1).argmax()) == SW
    endless = compute_values("qmdp")
    assert compute_values("qmdp:horizon=250", 0) == pytest.approx(endless, abs=1e-6)


@pytest.mark.slow
def test_a_sighted_team_catches_more_by_qmdp_than_by_chase_belief() -> None:
    sighted = dmplay.load_problem(f"{PROBLEM_NAME}:circle", sighted=True)
    qmdp_result, chase_result = (
        dmplay.rollout(
            sighted, [dmplay.load_agent(sighted, i, agent_name) for i in range(2)], episodes=300
        )
        for agent_name in ("qmdp", "chase-belief")
    )
    assert qmdp_result.returns[:, 0].mean() > chase_result.returns[:, 0].mean()


def test_a_reactive_agent_starts_without_a_sensed_prey_and_samples_its_rule() -> None:
    policy = dmplay.load_agent(PROBLEM, 0, "reactive")
    u = (np.arange(1000)[:, None] + 0.5) / 1000
    first, nothing, near = (
        np.bincount(policy.choose((np.full(1000, o),), None, u), minlength=6)
        for o in (-1, NOTHING, PREY)
    )
    assert first.tolist() == nothing.tolist()
    assert nothing[[NE, NW]].sum() == 0  # back and forth along the rows, and sometimes down
    assert near[[E, W, SW]].sum() < 10  # near the prey, across the rows


def test_a_sighted_reactive_agent_ignores_its_hex() -> None:
    sighted = dmplay.load_problem(f"{PROBLEM_NAME}:sighted")
    u = (np.arange(100)[:, None] + 0.5) / 100
    blind_agent, sighted_agent = (
        dmplay.load_agent(problem, 1, "reactive") for problem in (PROBLEM, sighted)
    )
    for sense in (PREY, NOTHING):
        for hex_ in (0, 11):
            actions = choose_actions(sighted_agent, 12 * sense + hex_, u)
            assert actions == choose_actions(blind_agent, sense, u)


def choose_actions(policy: Policy, observation: int, u: np.ndarray) -> list[int]:
    return [int(a) for a in policy.choose((np.full(len(u), observation),), None, u)]


def test_a_reactive_team_catches_more_than_chance() -> None:
    for name in (PROBLEM_NAME, f"{PROBLEM_NAME}:circle"):
        problem = dmplay.load_problem(name)
        reactive_result, random_result = (
            dmplay.rollout(
                problem, [dmplay.load_agent(problem, i, agent_name) for i in range(2)], episodes=300
            )
            for agent_name in ("reactive", "random")
        )
        assert reactive_result.returns[:, 0].mean() > random_result.returns[:, 0].mean()


def test_teams_without_a_plan_are_rejected_and_get_hints_from_chase_belief() -> None:
    three_predators = dmplay.load_problem(PROBLEM_NAME, predators=3)
    undiscounted = dmplay.load_problem(PROBLEM_NAME, discount=1.0)
    for problem in (three_predators, undiscounted):
        assert load_roster(problem, 0).hint_provider == "chase-belief"
        for agent in ("qmdp", "reactive"):
            with pytest.raises(BadPolicy):
                dmplay.load_agent(problem, 0, agent)
    assert (
        load_roster(dmplay.load_problem(PROBLEM_NAME, predators=26), 0).hint_provider
        == "chase-belief"
    )
    assert load_roster(PROBLEM, 0).hint_provider == "qmdp"


def test_a_map_too_large_for_the_moves_of_the_prey_is_rejected_at_once() -> None:
    wide = dmplay.load_problem(PROBLEM_NAME, hexes=[[q, 0] for q in range(91)])
    assert isinstance(wide, CollaborativePredatorPrey)
    with pytest.raises(
        BudgetExceeded, match="a table of the prey's moves: 1,046 MB, more than the limit of 512 MB"
    ):
        _ = wide.prey_move_probabilities


def test_hints_sweep_if_both_predators_always_sense_the_prey() -> None:
    """By QMDP both would stand still for the same reason, and the prey would avoid them."""
    triangle = dmplay.load_problem(f"{PROBLEM_NAME}:triangle")
    assert load_roster(triangle, 1).hint_provider == "sweep"
    sweep_result, qmdp_result = (
        dmplay.rollout(
            triangle, [dmplay.load_agent(triangle, i, agent_name) for i in range(2)], episodes=100
        )
        for agent_name in ("sweep", "qmdp")
    )
    assert sweep_result.returns[:, 0].mean() > qmdp_result.returns[:, 0].mean() + 20


@pytest.mark.parametrize("seat", [0, 1])
@pytest.mark.parametrize("partner", ["sweep", "reactive"])
def test_the_values_of_plans_are_below_those_of_the_same_moves_by_bayes_rule(
    partner: str, seat: int
) -> None:
    hunt = dmplay.load_problem(f"{PROBLEM_NAME}:circle")
    policy = dmplay.load_agent(hunt, seat, f"point-based:to={partner},horizon=6")
    assert isinstance(policy, PlansWithPartner)
    pair = policy.paired_hunt
    beliefs = np.random.default_rng(seat).dirichlet(np.ones(pair.size), 3)
    values = np.random.default_rng(2).random((2, pair.size))
    after = pair.predict(beliefs)
    for action in range(6):
        expected = [
            policy.predict_nodes(row, action).ravel() for row in policy.split_nodes(beliefs)
        ]
        np.testing.assert_allclose(after[:, action], expected, atol=1e-12)
        backed_up = beliefs @ pair.back_up(values, action).T
        np.testing.assert_allclose(backed_up, after[:, action] @ values.T, atol=1e-12)
    for turns_left in range(1, 7):
        memory = (beliefs, np.full(3, 6 - turns_left))
        q = policy.action_values(memory)
        for action in range(6):
            low, high = policy.value_bounds(memory, np.full(3, action))
            assert (low <= q[:, action] + 1e-8).all()
            assert (q[:, action] <= high + 1e-8).all()
            assert turns_left > 3 or low == pytest.approx(high, abs=1e-8)


def test_many_random_choices_beside_a_known_partner_are_judged() -> None:
    game = dmplay.play(PROBLEM, [None, "sweep"], seed=1, turns=20)
    directions, rng = PROBLEM.actions[0].labels, np.random.default_rng(1)
    while not game.over:
        game.act(directions[rng.integers(6)])
    review = game.review()
    judged = [choice for choice in review if choice.is_judged]
    assert 4 <= len(judged) < 20
    for choice in judged:
        q = np.array([*choice.values.values()])
        assert choice.chosen in choice.best or q.max() - choice.values[choice.chosen] > 0.3
