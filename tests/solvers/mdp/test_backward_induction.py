"""Tests of backward induction, against recursions and closed forms."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from dmplay import (
    Labels,
    Outcome,
    Policy,
    Problem,
    SeededUniforms,
    Tables,
    Tabular,
    load_agent,
    rollout,
)
from dmplay.agents.base import AdviceQuestion
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.chance import Chance
from dmplay.core.parameters import parameter
from dmplay.core.problem import WAIT_LABEL
from dmplay.core.session import Session
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.output.evaluation_request import EvaluationRequest, load_players
from dmplay.registry.agents import find_hint_provider, load_roster
from dmplay.solvers.mdp import backward_induction, transition_graph
from dmplay.solvers.mdp.backward_induction import solve_by_backward_induction
from tests.support.random_problems import RandomGame, RandomProblem
from tests.support.tic_tac_toe import Toe
from tests.support.turn_based_games import Nim
from tests.support.user_problems import IntegerStateProblem


@dataclass(frozen=True)
class ThreeHeapNim(Problem):
    """Nim with three heaps: take any number from one heap; the last player to take wins."""

    first_heap: int = parameter(3, "in the first heap", 0, 3)
    two: int = parameter(3, "in the second heap", 0, 3)
    three: int = parameter(3, "in the third heap", 0, 3)
    agents = ("left", "right")
    actions = (Labels((*(f"{h}{n}" for h in "abc" for n in "123"), WAIT_LABEL)),) * 2
    state_count = 128

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.tile([self.first_heap, self.two, self.three, 0], (rows, 1))

    def state_indices(self, s: Array) -> Array:
        return np.asarray(s @ [32, 8, 2, 1])

    def enumerate_states(self) -> Array:
        return np.stack(np.unravel_index(np.arange(128), (4, 4, 4, 2)), axis=1)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        rows = np.arange(len(s))
        heap, removed = np.divmod(np.minimum(a[rows, s[:, 3]], 8), 3)
        next_states = s.copy()
        next_states[rows, heap] -= removed + 1
        next_states[:, 3] = 1 - s[:, 3]
        next_states = np.where(self.terminal(s)[:, None], s, next_states)
        first_reward = 1.0 * (self.terminal(next_states) & ~self.terminal(s)) * (1 - 2 * s[:, 3])
        return Outcome(next_states, np.stack([first_reward, -first_reward], axis=1), next_states)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s[:, :3].sum(axis=1) == 0)

    def legal_actions_mask(self, s: Array) -> Bools:
        mask = np.zeros((len(s), 2, 10), bool)
        stones = np.repeat(s[:, :3], 3, axis=1)
        rows = np.arange(len(s))
        mask[rows, s[:, 3], :9] = stones >= np.tile([1, 2, 3], 3)
        mask[rows, 1 - s[:, 3], 9] = True
        return mask

    def format_state(self, s: Array) -> str:
        return " ".join(map(str, s.tolist()))

    def parse_state(self, text: str) -> Array:
        return np.array([int(number) for number in text.split()])


def test_the_player_to_move_wins_nim_unless_the_nim_sum_is_zero() -> None:
    """Check Bouton's theorem of 1901, which uses binary sums without carrying."""
    result = solve_by_backward_induction(ThreeHeapNim(), None)
    heaps, seat = result.graph.states[:, :3], result.graph.states[:, 3]
    nonterminal = heaps.any(axis=1)
    wins = np.bitwise_xor.reduce(heaps, axis=1) != 0
    sign = np.where(seat == 0, 1, -1) * np.where(wins, 1, -1) * nonterminal
    np.testing.assert_array_equal(result.values_by_turns_left[-1], np.stack([sign, -sign], axis=1))
    assert result.gap == 0
    report = solve_problem(ThreeHeapNim(three=2))
    assert report.method == "backward induction over 88 states, infinite horizon"
    assert report.result == "value 1 for left, -1 for right at the start, exact"
    first_row = {"value left": 1.0, "value right": -1.0, "to decide": "left", "best": "a2 b2 c2"}
    assert report.rows[0] == {"state": "3 3 2 0"} | first_row


def test_optimal_players_never_lose_tic_tac_toe() -> None:
    toe = Toe()
    report = solve_problem(toe)
    assert report.method == "backward induction over 5478 states, infinite horizon"
    assert report.result == "value 0 for x, 0 for o at the start, exact"
    assert report.rows[0]["best"] == " ".join(f"cell{n}" for n in range(1, 10))
    optimal_agents = [load_agent(toe, seat, "optimal") for seat in range(2)]
    random_agents = [load_agent(toe, seat, "random") for seat in range(2)]
    for agents in (
        optimal_agents,
        [optimal_agents[0], random_agents[1]],
        [random_agents[0], optimal_agents[1]],
    ):
        returns = rollout(toe, agents, episodes=50, seed=1).returns
        optimal_returns = [
            returns[:, seat] for seat in range(2) if agents[seat] is optimal_agents[seat]
        ]
        assert np.min(optimal_returns) >= 0.0
        assert (
            np.mean(optimal_returns) == 0.0
            if agents is optimal_agents
            else np.mean(optimal_returns) > 0.7
        )
    memory = optimal_agents[0].initial_memory(np.array([int(toe.parse_state("xx.oo...."))]))
    values = optimal_agents[0].action_values(memory)
    assert values is not None
    assert values[0, [2, 5]].tolist() == [1.0, 0.0]
    assert np.isinf(values[0, [0, 1, 3, 4, 9]]).all()
    assert optimal_agents[0].choose(memory, None, np.zeros((1, 0))).tolist() == [2]  # wins at once


@dataclass(frozen=True)
class TurnTakingGame(RandomProblem):
    """A random game in which three agents decide in turn; the state determines the seat."""

    agents = ("one", "two", "three")

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Two actions for each agent, and waiting."""
        return (Labels(("a", "b", WAIT_LABEL)),) * 3

    def legal_actions_mask(self, s: Array) -> Bools:
        mask = np.zeros((len(s), 3, 3), bool)
        mask[..., 2] = True
        mask[np.arange(len(s)), s % 3] = [True, True, False]
        return mask


def compute_values_by_recursion(problem: RandomProblem, turns: int) -> Reals:
    """Return the value of the start for each agent over this many turns, by the definition."""

    @cache
    def worth(s: int, turns_left: int) -> tuple[float, ...]:
        if not turns_left or problem.terminal(np.array([s]))[0]:
            return (0.0,) * len(problem.agents)
        mask = problem.legal_actions_mask(np.array([s]))[0]
        seat = s % len(problem.agents)
        values: list[Reals] = []
        for action in np.flatnonzero(mask[seat]):
            joint = np.full((1, len(problem.agents)), 2)
            joint[0, seat] = action
            index = s, int(problem.joint(joint)[0])
            next_values = [
                problem.transition[index][t] * np.array(worth(t, turns_left - 1)) for t in range(5)
            ]
            values.append(problem.rewards[index] + problem.discount * np.sum(next_values, axis=0))
        best = max(values, key=lambda candidate: float(candidate[seat]))
        return tuple(best.tolist())

    return np.array(worth(0, turns))


def test_random_games_have_the_values_of_the_recursion() -> None:
    for seed in range(10):
        turns = seed % 4 + 2
        discount = 1.0 if seed % 2 else 0.8
        for problem_class in (RandomProblem, TurnTakingGame):
            problem = problem_class(seed=seed, turns=turns, discount=discount, ends=seed < 5)
            expected = compute_values_by_recursion(problem, turns)
            result = solve_by_backward_induction(problem, turns)
            np.testing.assert_allclose(result.get_values(turns)[0], expected, atol=1e-9)
            myopic = problem_class(seed=seed, turns=turns, discount=0.0)
            one_turn_values = solve_by_backward_induction(myopic, turns).get_values(turns)[0]
            np.testing.assert_allclose(
                one_turn_values, compute_values_by_recursion(myopic, 1), atol=1e-9
            )
        if discount == 1.0:
            single_agent = RandomProblem(seed=seed, turns=turns, discount=1.0, ends=seed < 5)
            value = float(compute_values_by_recursion(single_agent, turns)[0])
            assert solve_problem(single_agent).result == f"value {value:.6g} at the start, exact"
            optimal = load_agent(single_agent, 0, "optimal")
            returns = rollout(single_agent, [optimal], episodes=400, seed=seed).returns[:, 0]
            assert abs(returns.mean() - value) < 3 * returns.std(ddof=1) / 20
            longer_agent = load_agent(single_agent, 0, f"optimal:horizon={turns + 3}")
            values = longer_agent.action_values(longer_agent.initial_memory(np.zeros(1, int)))
            assert values is not None
            assert values.max() == pytest.approx(
                compute_values_by_recursion(single_agent, turns + 3)[0]
            )


@dataclass(frozen=True)
class DelayGame(IntegerStateProblem):
    """A game in which the holder of the prize may cash it or wait for a turn of the other agent."""

    tip: float = parameter(0.0, "what a round pays to who holds the prize")
    agents = ("holder", "other")
    actions = (Labels(("dally", "cash", WAIT_LABEL)), Labels(("on", WAIT_LABEL)))
    state_count, placed = 3, 0

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        next_states = np.where(s == 0, 1 + a[:, 0], np.where(s == 1, 0, s))
        rewards = np.where(s == 0, np.where(next_states == 2, 1.0, self.tip), 0.0)
        return Outcome(next_states, np.stack([rewards, 0 * rewards], axis=1), next_states)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 2)

    def legal_actions_mask(self, s: Array) -> Bools:
        masks = np.array([[[1, 1, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, 0]], [[0, 0, 1], [0, 1, 0]]])
        return np.asarray(masks[s] > 0)


def test_a_game_that_need_not_end_is_solved_only_if_its_values_converge() -> None:
    problem = DelayGame()
    assert solve_problem(problem).rows[0]["best"] == "dally cash"
    agents = [load_agent(problem, seat, "optimal") for seat in range(2)]
    result = rollout(problem, agents, episodes=1)
    assert result.returns.tolist() == [[1.0, 0.0]]
    assert result.turn_counts.tolist() == [1]
    with pytest.raises(
        BudgetExceeded, match="after 50 turns; a game may never end; set a discount bel"
    ):
        solve_problem(DelayGame(tip=1.0))
    endless = solve_problem(DelayGame(tip=1.0, discount=0.9)).result
    assert endless.startswith(
        "value 5.26316 for holder, 0 for other at the start, longer games differ by at most "
    )


@dataclass(frozen=True)
class Corridor(IntegerStateProblem):
    """A corridor of a hundred steps to the end, each of which costs 1."""

    actions = (Labels(("on",)),)
    state_count, placed = 101, 100

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        next_states = np.maximum(s - 1, 0)
        return Outcome(next_states, (next_states - s)[:, None].astype(float), next_states)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 0)


def test_a_long_game_is_not_mistaken_for_an_endless_one() -> None:
    problem = Corridor()
    result = backward_induction.run_backward_induction(
        problem, transition_graph.build_full_graph(problem), None
    )
    assert result.get_values(None)[:, 0].tolist() == [-s for s in range(101)]


@dataclass(frozen=True)
class Siege(Corridor):
    """A siege: holding out costs 1 per turn without end, yielding costs 100 at once."""

    actions = (Labels(("hold", "yield")),)
    state_count, placed = 2, 1

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        next_states = np.where(a[:, 0] == 1, 0, s)
        return Outcome(next_states, np.where(next_states < s, -100.0, -1.0)[:, None], next_states)


def test_iteration_continues_until_ending_the_game_becomes_cheaper() -> None:
    problem = Siege()
    result = backward_induction.run_backward_induction(
        problem, transition_graph.build_full_graph(problem), None
    )
    assert result.get_values(None)[:, 0].tolist() == [0.0, -100.0]


def test_the_optimal_agent_gives_hints_and_rejects_simultaneous_games() -> None:
    hint_agent = find_hint_provider(Nim(), AdviceQuestion(0))
    assert hint_agent is not None
    assert hint_agent.name == "optimal"
    assert [*load_roster(Nim()).agents] == ["optimal", "random", "search"]
    optimal = load_agent(Nim(), 0, "optimal")
    # a state that no game reaches
    values = optimal.action_values(optimal.initial_memory(np.array([12])))
    assert values is not None
    assert np.isinf(values).all()
    with pytest.raises(BadPolicy, match="got a state in which several agents choose"):
        solve_by_backward_induction(RandomGame(), 3)


def test_a_match_with_a_turn_limit_plans_that_many_turns() -> None:
    match = EvaluationRequest("machine-replacement", agent="optimal", turn_limit=5)
    assert load_players(match).agent_names == ["optimal:horizon=5"]
    assert load_players(match._replace(turn_limit=None)).agent_names == ["optimal"]
    assert [*load_roster(RandomProblem(turns=9)).agents][:2] == ["optimal", "plan"]
    assert solve_problem(RandomProblem(turns=9)).result.endswith(" at the start with 9 turns")


@dataclass(frozen=True)
class Pond(IntegerStateProblem):
    """A walk over six cells of a pond, back or on; the last one pays, and the game then ends.

    It is game over in cell 6, the hole, into which `dive` leads from anywhere.
    """

    turns: int = parameter(30, "turns of a game")
    pays: float = parameter(1.0, "reward of the last cell")
    discount: float = parameter(1.0, "factor on later rewards")

    actions = (Labels(("back", "on", "dive")),)
    state_count, placed = 7, 0

    @property
    def horizon(self) -> int:
        return self.turns

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        step = a[:, 0]
        next_states = np.where(step == 2, 6, np.where(step == 1, s + 1, np.maximum(s - 1, 0)))
        return Outcome(next_states, (self.pays * (next_states == 5))[:, None], next_states)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s >= 5)


@pytest.mark.parametrize(
    ("pays", "turns", "expected_turns", "total"),
    [
        (1.0, 30, 5, 1.0),  # the way to the reward takes five turns
        (1.0, 5, 5, 1.0),
        (1.0, 4, 1, 0.0),  # the reward is out of reach: end at once
        (0.0, 30, 1, 0.0),  # nothing pays: end at once
        (-1.0, 30, 1, 0.0),
    ],
)
def test_actions_of_equal_value_end_an_undiscounted_game_soonest(
    pays: float, turns: int, expected_turns: int, total: float
) -> None:
    problem = Pond(turns=turns, pays=pays)
    result = rollout(problem, [load_agent(problem, 0, "optimal")], episodes=2, turn_limit=turns)
    assert result.turn_counts.tolist() == [expected_turns] * 2
    assert result.returns.tolist() == [[total]] * 2


def test_a_hint_says_that_it_is_the_one_of_equals_that_ends_soonest() -> None:
    hint = HintProvider(Session(Pond(), SeededUniforms(1)), AdviceQuestion()).create_hint()
    assert hint == (
        "hint by optimal (tie broken by earliest end): on. "
        "exact values: back 1.00, on 1.00, dive 0.00"
    )
    tight = HintProvider(
        Session(Pond(turns=5), SeededUniforms(1)), AdviceQuestion(0, 5)
    ).create_hint()
    assert tight.startswith("hint by optimal (5 turns left): on. ")


def test_a_state_that_nobody_can_leave_counts_as_an_end() -> None:
    # Waiting costs nothing, and the second "go" pays 5: the third state only leads to itself.
    transition, rewards = np.zeros((3, 2, 3)), np.zeros((3, 2, 1))
    transition[0, 0, 0] = transition[0, 1, 1] = transition[1, 0, 0] = transition[1, 1, 2] = 1.0
    transition[2, :, 2] = 1.0
    rewards[1, 1] = 5.0

    class Ring(Tabular):
        actions = (Labels(("wait", "go")),)
        state_names, horizon = ("start", "mid", "done"), 30
        initial_belief = np.array([1.0, 0.0, 0.0])
        tables = Tables(transition, rewards)

    policy = load_agent(Ring(), 0, "optimal")
    result = rollout(Ring(), [policy], episodes=1, turn_limit=2)
    assert result.returns.tolist() == [[5.0]]
    graph = transition_graph.build_full_graph(Ring())
    induction = backward_induction.run_backward_induction(Ring(), graph, None)
    action_rows = backward_induction.select_soonest_ending_actions(induction, 1.0)
    assert graph.joint_actions[action_rows, 0].tolist() == [1, 1, 0]


def test_a_discount_leaves_the_first_of_equal_actions() -> None:
    problem = Pond(pays=0.0, discount=0.9)
    plan = load_agent(problem, 0, "plan")
    assert result_turns(problem, plan) == 30


def result_turns(problem: Problem, policy: Policy) -> int:
    """Return the number of turns of one game."""
    return int(rollout(problem, [policy], episodes=1).turn_counts[0])


def test_another_agents_loss_is_no_tie() -> None:
    problem = Nim()
    policies = [load_agent(problem, seat, "optimal:horizon=40") for seat in range(2)]
    assert rollout(problem, policies, episodes=1).returns.sum() == 0.0
    memory = policies[0].memory_at_turn(np.array([99]), 1)  # type: ignore[attr-defined]
    assert policies[0].choose(memory, None, np.zeros((1, 0))).tolist() == [0]
