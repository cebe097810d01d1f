"""Tests of tree search: it plays any problem and uses only the information of its seat."""

from dataclasses import dataclass

import numpy as np
import pytest

import dmplay
from dmplay.agents.best_response_in_team import PartnerBeliefPolicy
from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import Chance, DiscreteUniform, Normal, Uniform
from dmplay.core.policy import Memory, Percept, Policy
from dmplay.core.problem import ContinuousStates, Outcome, Problem, make_initial_observation
from dmplay.core.spaces import Labels
from dmplay.core.uniforms import expand_uniforms
from dmplay.errors import BadParameter, BadPolicy, DmplayError
from dmplay.problems._shared.real_state import RealStateProblem
from dmplay.problems.collaborative_predator_prey.rules import CollaborativePredatorPrey
from dmplay.registry.agents import load_roster, set_horizon_in_name
from dmplay.solvers.search.search_config import SearchConfig
from dmplay.solvers.search.uct import UctResult
from tests.support.literature_dec_pomdps import format_dectiger, parse_team_file
from tests.support.user_problems import IntegerStateProblem


@dataclass(frozen=True)
class CorridorProblem(IntegerStateProblem):
    """A corridor of seven cells; reaching the right end pays 1."""

    actions = (Labels(("left", "right")),)
    state_count, placed = 7, 3
    discount = 0.9

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (DiscreteUniform(np.full(len(s), 5), 5),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        # one step in five goes the wrong way
        step = np.where((events[0] > 0) == (a[:, 0] == 1), 1, -1)
        next_state = np.where(self.terminal(s), s, np.clip(s + step, 0, 6))
        rewards = ((next_state == 6) & (s < 6)).astype(float)
        return Outcome(next_state, rewards[:, None], next_state)

    def terminal(self, s: Array) -> Array:
        return np.asarray(s == 6)


class UnobservedCorridor(CorridorProblem):
    """The same corridor with real states and no observations, so that states cannot be listed."""

    observations = (Labels(("fog",)),)
    state_count = ContinuousStates(1)  # type: ignore[assignment]  # the base class lists its states

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Normal(s, s),)


@dataclass(frozen=True)
class SafeDialProblem(IntegerStateProblem):
    """A problem of one turn with 500 actions; the reward falls with the distance to action 311."""

    actions = (Labels(map(str, range(500))),)
    state_count, placed, horizon = 1, 0, 1

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s, -np.abs(a - 311.0), s)


@dataclass(frozen=True)
class RevealedNumberProblem(RealStateProblem):
    """A choice between 0.55 now and 1 later for naming the sign of a number observed in between."""

    actions = (Labels(("low", "high", "leave")),)
    state_count = ContinuousStates(2)
    horizon = 2

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return (Uniform(np.zeros(rows), np.zeros(rows)), Uniform(np.zeros(rows), np.zeros(rows)))

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Uniform(-np.ones(len(s)), np.ones(len(s))),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        turn, (number, action) = s[:, 0], (s[:, 1], a[:, 0])
        rewards = np.where(turn == 0, 0.55 * (action == 2), (number > 0) == (action == 1))
        next_turn = np.where((turn == 0) & (action != 2), 1.0, 2.0)
        next_state = np.stack([next_turn, events[0]], axis=1)
        return Outcome(
            next_state, np.where(turn < 2, rewards, 0.0)[:, None].astype(float), next_state
        )

    def terminal(self, s: Array) -> Array:
        return np.asarray(s[:, 0] == 2)


def simulate_returns(problem: Problem, agent: str, episodes: int, turns: int | None) -> np.ndarray:
    policy = dmplay.load_agent(problem, 0, agent)
    result = dmplay.rollout(problem, [policy], episodes=episodes, turn_limit=turns, seed=1)
    return np.asarray(result.returns[:, 0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "agent", "episodes", "turns", "margin"),
    [
        ("hexworld", "search:simulations=80", 40, 50, 3.0),
        ("crying-baby", "search:simulations=60,depth=10", 40, 20, 10.0),
        ("catch", "search:simulations=100", 60, 10, 20.0),
        ("machine-replacement", "search:simulations=60", 40, 20, 8.0),
        ("cart-pole", "search:simulations=40", 10, 60, 25.0),
        ("mountain-car", "search:simulations=60,depth=60", 40, 150, 10.0),
    ],
)
def test_search_beats_random_play(
    name: str, agent: str, episodes: int, turns: int, margin: float
) -> None:
    problem = dmplay.load_problem(name)
    search_mean = simulate_returns(problem, agent, episodes, turns).mean()
    assert search_mean > simulate_returns(problem, "random", episodes, turns).mean() + margin


def test_search_plays_a_user_defined_problem() -> None:
    returns = simulate_returns(CorridorProblem(), "search:simulations=60", 40, 30)
    assert (returns > 0).all()
    assert returns.mean() > simulate_returns(CorridorProblem(), "random", 40, 30).mean() + 0.1


def choose_first_actions(problem: Problem, seat: int, agent: str, rows: int) -> np.ndarray:
    """Return the first actions in identical games, each with another uniform."""
    search = dmplay.load_agent(problem, seat, agent)
    s = problem.sample_initial_states(np.full((rows, problem.uniform_counts.start), 0.5))
    chosen = search.choose(
        search.initial_memory(make_initial_observation(problem, s, seat)),
        None,
        np.linspace(0, 0.9, rows)[:, None],
    )
    return np.asarray(chosen)


def test_search_responds_to_the_assumed_opponents() -> None:
    problem, defect = dmplay.load_problem("prisoners-dilemma"), 1
    assert problem.format_action(1, defect) == "defect"
    for others in ("random", "always-cooperate", "always-defect"):
        assert (choose_first_actions(problem, 1, f"search:others={others}", 8) == defect).all()
    # tit-for-tat is the default opponent
    assert (choose_first_actions(problem, 1, "search", 8) != defect).all()


def test_search_defects_against_tit_for_tat_only_in_the_last_round() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    policies = [
        dmplay.load_agent(problem, 0, "search"),
        dmplay.load_agent(problem, 1, "tit-for-tat"),
    ]
    assert (
        dmplay.rollout(problem, policies, episodes=3, seed=1).returns[:, 0].tolist() == [-9.0] * 3
    )


def test_search_chooses_real_actions_between_grid_points() -> None:
    problem = dmplay.load_problem("simple-regulator")
    search = dmplay.load_agent(problem, 0, "search:depth=2,rollout=random")
    s = np.array([[4.43], [-3.21]])
    chosen = search.choose(search.initial_memory(s), None, np.array([[0.1], [0.2]]))
    assert np.abs(s[:, 0] + chosen).max() < 0.4
    assert (chosen == np.round(chosen, 9)).all()


def test_search_comes_close_to_the_best_of_many_actions() -> None:
    chosen = choose_first_actions(SafeDialProblem(), 0, "search", 3)
    assert np.abs(chosen - 311).max() <= 12  # 20 of the 500 are tried


def test_search_distinguishes_real_valued_observations() -> None:
    """Check that search never leaves: without the number, staying would be worth 0.5."""
    assert 2 not in choose_first_actions(RevealedNumberProblem(), 0, "search:simulations=800", 8)


def test_search_prefers_the_usual_action_unless_another_is_surely_better() -> None:
    means, actions = np.array([[1.0, 1.5, 0.0], [1.0, 1.5, 0.0]]), np.tile([4, 5, 6], (2, 1))
    result = UctResult(actions, means, np.array([[0.01] * 3, [0.04] * 3]))
    best = np.array([[False, True, False]] * 2)
    choices = result.prefer_usual_action(best, np.array([4, 4]))
    assert choices.tolist() == [[False, True, False], [True, False, False]]
    assert (
        result.prefer_usual_action(best, np.array([7, 7])).tolist() == best.tolist()
    )  # action 7 was not tried


@pytest.mark.parametrize(
    "name", ["machine-replacement", "simple-regulator", "predator-prey", "rock-paper-scissors"]
)
def test_a_choice_is_the_same_alone_and_in_a_batch(name: str) -> None:
    problem, rows = dmplay.load_problem(name), 4
    search = dmplay.load_agent(problem, 0, "search:simulations=120,depth=6")
    s = problem.sample_initial_states(
        np.linspace(0, 0.9, rows * problem.uniform_counts.start).reshape(rows, -1)
    )
    memory = search.initial_memory(make_initial_observation(problem, s, 0))
    u = np.linspace(0.1, 0.8, rows)[:, None]
    batch = search.choose(memory, None, u)
    for row in range(rows):
        single = search.choose(tuple(part[[row]] for part in memory), None, u[[row]])
        assert single.tolist() == batch[[row]].tolist()


def test_a_full_batch_of_rows_fits_the_work_budget() -> None:
    for name in ("crying-baby", "prisoners-dilemma", "rock-paper-scissors", "hexworld"):
        tree = SearchConfig(
            dmplay.load_problem(name), 0, simulations=400, depth=20, ucb_constant=1.0
        )
        tree.make_budget(1)
        tree.make_budget(tree.rows_per_block)


REFUSED_OPTIONS = {  # problem and search option: error message
    "prisoners-dilemma others=search": "others: got 'search'",
    "hexworld rollout=search:depth=2": "rollout: got 'search:depth=2'",
    "hexworld rollout=optimol": "did you mean optimal",
    "2048 rollout=expectimax:milliseconds=5": "depend on the clock",
    "prisoners-dilemma others=tit-for-tut": "did you mean tit-for-tat",
}


def test_search_refuses_invalid_policies_for_other_agents_and_rollouts() -> None:
    for case, message in REFUSED_OPTIONS.items():
        name, option = case.split()
        with pytest.raises(DmplayError, match=message):
            dmplay.load_agent(dmplay.load_problem(name), 0, f"search:{option}")


def test_search_returns_no_action_values() -> None:
    search = dmplay.load_agent(CorridorProblem(), 0, "search")
    assert search.action_values(search.initial_memory(np.array([3]))) is None


def test_search_needs_a_belief_where_states_are_hidden() -> None:
    with pytest.raises(
        BadPolicy, match="search: cannot compute the belief over hidden states: UnobservedCorridor"
    ):
        dmplay.load_agent(UnobservedCorridor(), 0, "search")


@pytest.mark.parametrize("option", ["simulations=0", "depth=0", "exploration=-1"])
def test_search_refuses_numbers_out_of_bounds(option: str) -> None:
    with pytest.raises(BadParameter, match=f"{option.partition('=')[0]}: got"):
        dmplay.load_agent(CorridorProblem(), 0, f"search:{option}")


def test_the_uniforms_of_a_search_are_expanded_from_a_single_uniform() -> None:
    u = np.array([0.25, 0.5, 0.999999999])
    expanded = expand_uniforms(u, 5)
    assert expanded.shape == (3, 5)
    assert len(np.unique(expanded)) == 15
    assert (expand_uniforms(u[1:2], 5) == expanded[1]).all()


@pytest.mark.parametrize("name", ["hexworld", "crying-baby", "catch"])
def test_a_choice_takes_at_most_simulations_times_depth_steps(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, row_counts = dmplay.load_problem(name), [0]
    search = dmplay.load_agent(problem, 0, "search:simulations=50,depth=7")
    s = problem.sample_initial_states(np.full((1, problem.uniform_counts.start), 0.4))
    memory = search.initial_memory(make_initial_observation(problem, s, 0))
    problem_type, step = type(problem), type(problem).step

    def counted(self: Problem, s: Array, a: Array, u: Reals) -> Outcome:
        row_counts.append(len(s))
        return step(self, s, a, u)

    monkeypatch.setattr(problem_type, "step", counted)
    search.choose(memory, None, np.array([[0.5]]))
    assert 0 < sum(row_counts) <= 50 * 7


CAREGIVER_PROBLEM = "multicaregiver-crying-baby"
CRYING, IGNORE = 0, 2


def remember_turns(agent: str, seat: int, turns: list[tuple[int, int]]) -> tuple[Policy, Memory]:
    """Return a caregiver's policy and its memory after these actions and observations."""
    policy = dmplay.load_agent(dmplay.load_problem(CAREGIVER_PROBLEM), seat, agent)
    memory = policy.initial_memory(np.full(1, -1))
    for action, observation in turns:
        percept = Percept(np.full(1, action), np.full(1, observation), None, None)
        memory = policy.update_memory(memory, percept)
    return policy, memory


def test_the_belief_of_a_search_accounts_for_the_partners_responses() -> None:
    """Compare 500 particles with the exact belief beside the default partner."""
    quiet = 1
    for turns in ([(IGNORE, quiet)] * 2, [(IGNORE, CRYING), (IGNORE, quiet)]):
        _, particles = remember_turns("search", 1, turns)
        policy, (exact,) = remember_turns("best-response", 1, turns)
        assert isinstance(policy, PartnerBeliefPolicy)
        hungry = float(policy.split_nodes(exact)[0, :, 1].sum())
        assert abs(float((particles[-2] == 1).mean()) - hungry) < 0.05
        assert (particles[-1] == quiet).all()  # the partner's observations


def test_the_belief_of_a_search_remains_valid_if_partners_act_unexpectedly() -> None:
    """The assumed partner feeds a crying baby, which then stops; this partner did not."""
    _, particles = remember_turns("search", 0, [(IGNORE, CRYING)] * 2)
    assert (particles[-2] == 1).all()


def test_particles_are_the_same_alone_and_in_a_batch() -> None:
    problem, rows = dmplay.load_problem(CAREGIVER_PROBLEM), 5
    search = dmplay.load_agent(problem, 0, "search:simulations=60,depth=4")
    turns = [Percept(np.full(rows, IGNORE), np.arange(rows) % 2, None, None)] * 2
    batch = search.initial_memory(np.full(rows, -1))
    singles = [tuple(part[[row]] for part in batch) for row in range(rows)]
    for turn in turns:
        batch = search.update_memory(batch, turn)
        for row in range(rows):
            percept = Percept(turn.action[[row]], turn.observation[[row]], None, None)
            singles[row] = search.update_memory(singles[row], percept)
    for whole, *parts in zip(batch, *singles, strict=True):
        np.testing.assert_array_equal(whole, np.concatenate(parts))


@pytest.mark.parametrize("turns", [3, 4])
def test_search_in_a_team_earns_at_least_the_value_of_its_joint_plan(turns: int) -> None:
    problem = parse_team_file(format_dectiger())
    mean_returns = []
    for agent in ("joint-plan", "search:simulations=60"):
        names = [set_horizon_in_name(problem, seat, agent, turns) for seat in range(2)]
        team = [dmplay.load_agent(problem, seat, name) for seat, name in enumerate(names)]
        result = dmplay.rollout(problem, team, episodes=12, turn_limit=turns, seed=1)
        mean_returns.append(result.returns[:, 0].mean())
    assert mean_returns[1] >= mean_returns[0] > 0


def test_search_simulates_a_joint_plan_in_the_default_hunt_only() -> None:
    assert load_roster(CollaborativePredatorPrey()).simulation_agent == "joint-plan"
    for hunt in (CollaborativePredatorPrey(sighted=True), CollaborativePredatorPrey(predators=1)):
        assert load_roster(hunt).simulation_agent is None
