from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay import Labels, belief
from dmplay.core import Percept, Policy, Problem
from dmplay.errors import BadPolicy, BudgetExceeded, ImpossibleObservation
from dmplay.finding.agents import load_roster
from dmplay.game.table import GameController
from dmplay.hexes import format_hex
from dmplay.problems._hunt import STANDARD_HEXES
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.transcript.format import collect_turn_facts
from dmplay.words.commands import run_line
from tests.support.screens import seated

E, NE, NW, W, SW, SE = range(6)
PREY, NOTHING = 0, 1
NAME = "collaborative-predator-prey"
PROBLEM = dmplay.load_problem(NAME)
STRAIGHT = 0.0  # a draw that does not slip


def outcomes(
    problem: Problem, state: str, actions: list[int]
) -> tuple[dict[str, float], np.ndarray]:
    """The probability of each next state, and the rewards, which no draw changes."""
    p, after = dmplay.enumerate_outcomes(
        problem, problem.parse_state(state)[None], np.array([actions])
    )
    found: dict[str, float] = {}
    for weight, s in zip(p[0], after.state[0], strict=True):
        if weight > 0:
            found[problem.format_state(s)] = found.get(problem.format_state(s), 0.0) + float(weight)
    assert (after.rewards[0] == after.rewards[0, 0]).all()
    return found, after.rewards[0, 0]


def certain(**parameters: Any) -> Problem:
    """Nobody slips, so that only the prey is uncertain."""
    return dmplay.load_problem(NAME, slip=0.0, **parameters)


def test_a_free_prey_moves_to_a_neighbour_without_a_predator() -> None:
    found, rewards = outcomes(certain(), "(1,0) (4,1) (2,0)", [E, E])
    assert found == pytest.approx({"(2,0) (4,1) (3,0)": 0.5, "(2,0) (4,1) (1,1)": 0.5})
    assert rewards.tolist() == [-1, -1]


def test_where_a_predator_was_is_closed_even_if_it_leaves() -> None:
    found, _ = outcomes(certain(), "(1,1) (3,0) (2,0)", [NW, W])
    assert found == pytest.approx({"(0,2) (2,0) (1,0)": 1})


def test_a_prey_without_a_free_neighbour_stays() -> None:
    found, _ = outcomes(certain(), "(-1,1) (1,0) (0,0)", [NE, NE])
    assert found == pytest.approx({"(-1,2) (1,1) (0,0)": 1})
    lonely = certain(predators=1, hexes=[[0, 0], [5, 5]])
    found, _ = outcomes(lonely, "(5,5) (0,0)", [E])
    assert found == pytest.approx({"(5,5) (0,0)": 1})


def test_a_capture_pays_the_whole_team_and_holds_only_the_captor() -> None:
    found, rewards = outcomes(certain(), "(2,0) (3,0) (2,0)", [E, E])
    assert found == pytest.approx(
        {f"(2,0) (4,0) {format_hex(hex_)}": 1 / 12 for hex_ in STANDARD_HEXES}
    )
    assert rewards.tolist() == [10, 10]


def test_a_capture_by_both_pays_no_more() -> None:
    _, rewards = outcomes(PROBLEM, "(2,0) (2,0) (2,0)", [E, E])
    assert rewards.tolist() == [10, 10]


def test_a_turn_is_three_draws_in_every_state() -> None:
    assert PROBLEM.uniform_counts == (3, 3)
    assert dmplay.load_problem(NAME, predators=4).uniform_counts == (5, 5)


def test_a_predator_senses_the_prey_from_its_own_and_the_next_hex() -> None:
    s = np.array([PROBLEM.parse_state(one) for one in ("(2,0) (3,0) (2,0)", "(1,1) (4,0) (2,0)")])
    assert PROBLEM.observe(s).tolist() == [[PREY, PREY], [PREY, NOTHING]]  # type: ignore[attr-defined]


def test_a_sighted_predator_sees_its_hex_too() -> None:
    problem = dmplay.load_problem(f"{NAME}:sighted")
    s, a = problem.parse_state("(0,0) (1,2) (3,0)")[None], np.array([[E, SW]])
    after = problem.step(s, a, np.array([[STRAIGHT, STRAIGHT, 0.0]]))
    assert problem.format_state(after.state[0]) == "(1,0) (1,1) (4,0)"
    (labels, _) = problem.observations
    assert isinstance(labels, Labels)
    assert [labels[o] for o in after.observations[0]] == ["nothing (1,0)", "nothing (1,1)"]
    near = problem.step(s, a, np.array([[STRAIGHT, STRAIGHT, 0.9]]))
    assert problem.format_state(near.state[0]) == "(1,0) (1,1) (2,0)"
    assert [labels[o] for o in near.observations[0]] == ["prey (1,0)", "prey (1,1)"]
    assert len(labels) == 24


def test_the_team_shares_its_reward_and_does_not_see_the_state() -> None:
    assert PROBLEM.kind == "Dec-POMDP"
    assert not PROBLEM.rewards_observable
    assert PROBLEM.agents == ("predator1", "predator2")


@pytest.mark.parametrize(
    ("name", "seat"),
    [(f"{NAME}:triangle", 0), (f"{NAME}:circle", 1), (f"{NAME}:sighted", 1), (NAME, 0)],
)
def test_the_belief_of_a_seat_is_that_of_bayes_rule_with_random_partners(
    name: str, seat: int
) -> None:
    problem = dmplay.load_problem(name)
    policy = dmplay.load_agent(problem, seat, "chase-belief")
    told = belief.initial_belief(problem)
    memory = policy.initial_memory(np.full(2, -1))
    s = problem.sample_initial_states(np.array([[0.1, 0.5, 0.8]]))
    for turn, a in enumerate((E, SW, NW)):
        joint = np.array([[a, W] if seat == 0 else [W, a]])
        after = problem.step(s, joint, np.array([[0.3, 0.75, 0.1 * turn]]))
        s, seen = after.state, after.observations[0, seat]
        memory = policy.update_memory(memory, Percept(np.full(2, a), np.full(2, seen), None, None))
        actions: list[int | None] = [None, None]
        observations: list[int | None] = [None, None]
        actions[seat], observations[seat] = a, int(seen)
        told = belief.update_belief(problem, told, actions, observations).belief
        for row in memory[0]:
            assert row == pytest.approx(told, abs=1e-12)
        assert told[problem.state_indices(s)[0]] > 0


def test_an_observation_that_cannot_be_is_refused() -> None:
    problem = dmplay.load_problem(f"{NAME}:triangle")  # every hex is next to every other
    policy = dmplay.load_agent(problem, 0, "chase-belief")
    memory = policy.initial_memory(np.array([-1]))
    with pytest.raises(ImpossibleObservation):
        policy.update_memory(memory, Percept(np.array([E]), np.array([NOTHING]), None, None))


def test_chase_belief_goes_to_where_the_prey_most_likely_is() -> None:
    policy = dmplay.load_agent(PROBLEM, 0, "chase-belief")
    beliefs = np.zeros((2, 1728))
    for row, (one, other) in enumerate(
        [("(1,2) (4,0) (2,0)", "(0,0) (4,0) (4,0)"), ("(3,0) (4,0) (0,0)", "(3,0) (0,0) (3,1)")]
    ):
        beliefs[row, PROBLEM.state_indices(PROBLEM.parse_state(one)[None])] = 0.6
        beliefs[row, PROBLEM.state_indices(PROBLEM.parse_state(other)[None])] = 0.4
    assert policy.choose((beliefs,), None, np.zeros((2, 0))).tolist() == [SW, W]


def test_sweep_goes_to_and_fro_and_turns_where_it_loses_the_prey() -> None:
    policy = dmplay.load_agent(PROBLEM, 1, "sweep")
    memory = policy.initial_memory(np.array([-1]))
    course = []
    for seen in (NOTHING, NOTHING, NOTHING, NOTHING, PREY, NOTHING, NOTHING):
        a = policy.choose(memory, None, np.zeros((1, 0)))
        course.append(int(a[0]))
        memory = policy.update_memory(memory, Percept(a, np.array([seen]), None, None))
    assert course == [W, W, W, E, E, W, E]


@pytest.mark.parametrize("name", [NAME, f"{NAME}:circle", f"{NAME}:triangle", f"{NAME}:sighted"])
def test_a_sweeping_team_catches_more_than_chance(name: str) -> None:
    problem = dmplay.load_problem(name)
    swept, random = (
        dmplay.rollout(
            problem, [dmplay.load_agent(problem, i, one) for i in range(2)], episodes=1000
        )
        for one in ("sweep", "random")
    )
    assert swept.total_rewards[:, 0].mean() > random.total_rewards[:, 0].mean()
    assert (swept.total_rewards[:, 0] == swept.total_rewards[:, 1]).all()


@pytest.mark.slow
def test_a_team_that_chases_its_beliefs_catches_more_than_one_that_sweeps() -> None:
    chased, swept = (
        dmplay.rollout(PROBLEM, [dmplay.load_agent(PROBLEM, i, one) for i in range(2)], episodes=60)
        for one in ("chase-belief", "sweep")
    )
    assert chased.total_rewards[:, 0].mean() > swept.total_rewards[:, 0].mean()


def test_a_long_belief_is_shown_but_not_recorded() -> None:
    game = seated(NAME, dmplay.Session(PROBLEM, dmplay.SeededUniforms(5)), ["human", "human"])
    game.session.advance([E, W])
    (_, told) = game.view().beliefs or ()
    assert told == pytest.approx(
        belief.update_belief(
            PROBLEM, belief.initial_belief(PROBLEM), [E, None], [NOTHING, None]
        ).belief
    )
    assert "belief" not in game.narrator.visible_turn_facts(game.snapshot())
    words = run_line(GameController(game), "belief")
    assert words.count("(") == 8 * 3
    assert "1720 other states" in words
    small = dmplay.Session(dmplay.load_problem(f"{NAME}:triangle"), dmplay.SeededUniforms(5))
    assert "belief" in collect_turn_facts(small)


@pytest.mark.slow
def test_qmdp_is_worth_what_the_planner_who_sees_all_is_until_it_acts() -> None:
    for seat in range(2):
        policy = dmplay.load_agent(PROBLEM, seat, "qmdp")
        values = policy.action_values(policy.initial_memory(np.array([-1])))
        assert values is not None
        assert values.max() < 21.0506  # the mean of the best over all states
        sure = np.zeros((1, 1728))
        sure[0, PROBLEM.state_indices(PROBLEM.parse_state("(1,2) (4,0) (2,0)")[None])] = 1.0
        assert int(policy.choose((sure,), None, np.zeros((1, 0)))[0]) == (SW if seat == 0 else W)


@pytest.mark.slow
def test_a_team_that_plans_for_sight_catches_more_than_one_that_chases() -> None:
    sighted = dmplay.load_problem(f"{NAME}:circle", sighted=True)
    planned, chased = (
        dmplay.rollout(
            sighted, [dmplay.load_agent(sighted, i, one) for i in range(2)], episodes=300
        )
        for one in ("qmdp", "chase-belief")
    )
    assert planned.returns[:, 0].mean() > chased.returns[:, 0].mean()


def test_the_reactive_team_senses_nothing_at_first_and_draws_by_its_rule() -> None:
    policy = dmplay.load_agent(PROBLEM, 0, "reactive")
    u = (np.arange(1000)[:, None] + 0.5) / 1000
    first, nothing, near = (
        np.bincount(policy.choose((np.full(1000, o),), None, u), minlength=6)
        for o in (-1, NOTHING, PREY)
    )
    assert first.tolist() == nothing.tolist()
    assert nothing[[NE, NW]].sum() == 0  # to and fro along the rows, and now and then down
    assert near[[E, W, SW]].sum() < 10  # near the prey across them


def test_a_sighted_reactive_team_goes_by_the_same_sense() -> None:
    sighted = dmplay.load_problem(f"{NAME}:sighted")
    u = (np.arange(100)[:, None] + 0.5) / 100
    blind, seeing = (dmplay.load_agent(one, 1, "reactive") for one in (PROBLEM, sighted))
    for sense in (PREY, NOTHING):
        for hex_ in (0, 11):
            told = policy_choice(seeing, 12 * sense + hex_, u)
            assert told == policy_choice(blind, sense, u)


def policy_choice(policy: Policy, observation: int, u: np.ndarray) -> list[int]:
    return [int(a) for a in policy.choose((np.full(len(u), observation),), None, u)]


def test_a_reactive_team_catches_more_than_chance() -> None:
    for name in (NAME, f"{NAME}:circle"):
        problem = dmplay.load_problem(name)
        reacted, random = (
            dmplay.rollout(
                problem, [dmplay.load_agent(problem, i, one) for i in range(2)], episodes=300
            )
            for one in ("reactive", "random")
        )
        assert reacted.returns[:, 0].mean() > random.returns[:, 0].mean()


def test_teams_that_cannot_be_planned_are_refused_and_advised_by_the_chase() -> None:
    three, endless = dmplay.load_problem(NAME, predators=3), dmplay.load_problem(NAME, discount=1.0)
    for problem in (three, endless):
        assert load_roster(problem, 0).hint_provider == "chase-belief"
        for agent in ("qmdp", "reactive"):
            with pytest.raises(BadPolicy):
                dmplay.load_agent(problem, 0, agent)
    assert load_roster(dmplay.load_problem(NAME, predators=26), 0).hint_provider == "chase-belief"
    assert load_roster(PROBLEM, 0).hint_provider == "qmdp"


def test_a_map_too_large_for_a_list_of_where_the_prey_goes_is_refused_at_once() -> None:
    wide = dmplay.load_problem(NAME, hexes=[[q, 0] for q in range(91)])
    assert isinstance(wide, CollaborativePredatorPrey)
    with pytest.raises(BudgetExceeded, match="where the prey goes: 1,046 MB, more than 512"):
        _ = wide.prey_move_probabilities


def test_two_who_always_sense_the_prey_are_advised_to_sweep() -> None:
    """Planning for sight, both would stand still for the same reason, and the prey avoids them."""
    triangle = dmplay.load_problem(f"{NAME}:triangle")
    assert load_roster(triangle, 1).hint_provider == "sweep"
    swept, planned = (
        dmplay.rollout(
            triangle, [dmplay.load_agent(triangle, i, one) for i in range(2)], episodes=100
        )
        for one in ("sweep", "qmdp")
    )
    assert swept.returns[:, 0].mean() > planned.returns[:, 0].mean() + 20
