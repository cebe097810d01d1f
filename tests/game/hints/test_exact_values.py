"""Values called exact equal those of the hinted policy, evaluated outcome by outcome.

The evaluation uses only `enumerate_outcomes` and the policy's own choices. It keeps its own belief,
by Bayes' rule, and no solver is called.
"""

from collections import defaultdict
from collections.abc import Callable, Sequence

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import EXACT_VALUES, LOWER_BOUNDS, AdviceQuestion, SeatPolicy
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem, build_percept, enumerate_outcomes
from dmplay.core.session import Session
from dmplay.registry.agents import find_hint_provider
from dmplay.registry.problems import load_variants
from tests.support.literature_pomdps import make_cheese_maze, make_random_problem, make_tiger
from tests.support.random_problems import RandomProblem
from tests.support.user_problems import Heap, Key, RevealingVault, Vault

StateDistribution = dict[int, float]  # probability by the index of the state
Opponent = Callable[[int], Sequence[float]]  # probabilities of the other agent's actions in a state
TURNS = (1, 2, 5, 20)


class Evaluation:
    """The expected return of a policy for a number of turns, outcome by outcome."""

    def __init__(self, problem: Problem, policy: SeatPolicy, opponent: Opponent | None = None):
        self.problem, self.policy, self.opponent = problem, policy, opponent
        self.states = problem.enumerate_states()
        self.cache: dict[object, float] = {}

    def value(self, distribution: StateDistribution, memory: Memory, turns_left: int) -> float:
        """Return the expected return of the policy's choices."""
        key = (
            tuple((s, round(p, 10)) for s, p in sorted(distribution.items())),
            tuple(np.round(array.astype(float), 10).tobytes() for array in memory),
            turns_left,
        )
        if key not in self.cache:
            self.cache[key] = self._compute_value(distribution, memory, turns_left)
        return self.cache[key]

    def _compute_value(
        self, distribution: StateDistribution, memory: Memory, turns_left: int
    ) -> float:
        live = {
            s: p for s, p in distribution.items()
            if not self.problem.terminal(self.states[s : s + 1])[0]
        }  # fmt: skip
        if not turns_left or not live:
            return 0.0
        legal = self.problem.legal_actions_mask(self.states[[*live]])
        legal_row = None if legal is None else legal[:1, self.policy.seat]
        action = int(self.policy.choose(memory, legal_row, np.full((1, 1), 0.5))[0])
        return self.action_value(live, memory, turns_left, action)

    def action_value(
        self, distribution: StateDistribution, memory: Memory, turns_left: int, action: int
    ) -> float:
        """Return the expected return of an action and the policy's choices after it."""
        problem, seat = self.problem, self.policy.seat
        expected, futures = 0.0, defaultdict[bytes, StateDistribution](lambda: defaultdict(float))
        percepts = {}
        for s, p_state in distribution.items():
            for joint_action, p_action in self._joint_actions(s, action):
                p, outcome = enumerate_outcomes(
                    problem, self.states[s : s + 1], np.array([joint_action])
                )
                next_indices = problem.state_indices(outcome.state[0])
                for k in np.flatnonzero(p[0] > 0):
                    weight = p_state * p_action * p[0, k]
                    expected += weight * outcome.rewards[0, k, seat]
                    percept = build_percept(
                        problem, seat, np.array([joint_action]),
                        type(outcome)(*(array[0, k : k + 1] for array in outcome)),
                    )  # fmt: skip
                    observation = percept.observation.tobytes()
                    percepts[observation] = percept
                    futures[observation][int(next_indices[k])] += weight
        for observation, future in futures.items():
            total = sum(future.values())
            posterior = {s: p / total for s, p in future.items()}
            next_memory = self.policy.update_memory(memory, percepts[observation])
            expected += (
                problem.discount * total * self.value(posterior, next_memory, turns_left - 1)
            )
        return expected

    def _joint_actions(self, s: int, action: int) -> list[tuple[tuple[int, ...], float]]:
        """Return the joint actions with their probabilities."""
        if self.opponent is None:
            return [((action,), 1.0)]
        pairs = enumerate(self.opponent(s))
        ordered = [((action, other), p) for other, p in pairs if p > 0]
        return [(pair if self.policy.seat == 0 else pair[::-1], p) for pair, p in ordered]


def check_first_values(
    problem: Problem, turns: int, players: Sequence[str] = (), opponent: Opponent | None = None
) -> bool:
    """Compare the first values of the hint provider, or return False if they are estimates.

    Exact values are equal to those of the policy, and lower bounds are at most as large.
    """
    agent = find_hint_provider(problem, AdviceQuestion(0, turns, tuple(players)))
    assert agent is not None
    name = agent.policy.values_name
    if name not in {EXACT_VALUES, LOWER_BOUNDS} or agent.policy.describe_scope(turns):
        return False
    session = Session(problem, dmplay.SeededUniforms(7), turn_limit=turns)
    observation = np.asarray(session.observation_after(0, 0))[None]
    memory = agent.policy.initial_memory(observation)
    values = agent.policy.action_values(memory)
    assert values is not None
    evaluation = Evaluation(problem, agent.policy, opponent)
    (start,) = problem.state_indices(np.asarray(session.state)[None])
    distribution = (
        dict(enumerate(session.view(0).belief.tolist()))
        if problem.partially_observable
        else {int(start): 1.0}
    )
    distribution = {s: p for s, p in distribution.items() if p > 0}
    legal = session.legal_actions_mask(0)
    for action, value in enumerate(values[0].tolist()):
        if legal is None or legal[action]:
            expected = evaluation.action_value(distribution, memory, turns, action)
            assert value <= expected + 1e-6, (turns, action)
            assert name == LOWER_BOUNDS or value == pytest.approx(expected, abs=1e-6)
    return True


@pytest.mark.parametrize("turns", TURNS)
@pytest.mark.parametrize("name", ["hexworld", "crying-baby"])
def test_exact_values_of_built_in_problems_and_variants(name: str, turns: int) -> None:
    for problem in load_variants(name).values():
        assert check_first_values(problem, turns)


@pytest.mark.parametrize(
    ("name", "turns"),
    [("catch", 1), ("catch", 2), ("catch", 5), ("machine-replacement", 1),
     ("machine-replacement", 2), ("machine-replacement", 5),
     pytest.param("machine-replacement", 20, marks=pytest.mark.slow),
     pytest.param("catch", 10, marks=pytest.mark.slow)],
)  # fmt: skip
def test_exact_values_of_problems_with_many_beliefs(name: str, turns: int) -> None:
    assert check_first_values(dmplay.load_problem(name), turns)


@pytest.mark.parametrize("turns", TURNS)
def test_exact_values_of_user_defined_problems(turns: int) -> None:
    problems = [
        Key(), Heap(), Vault(), RevealingVault(), *(RandomProblem(seed=n) for n in range(6)),
        *(RandomProblem(seed=n, ends=False, turns=turns) for n in range(2)),
    ]  # fmt: skip
    checked = [check_first_values(problem, turns) for problem in problems]
    assert sum(checked) >= 10


@pytest.mark.parametrize("turns", [1, 2, 5])
def test_values_of_problem_files(turns: int) -> None:
    problems = [make_tiger(), make_cheese_maze(), *(make_random_problem(n, 0.9) for n in range(3))]
    checked = [check_first_values(problem, turns) for problem in problems]
    assert any(checked)


@pytest.mark.parametrize("turns", [1, 2, 5])
def test_exact_values_of_a_predator_against_a_prey_that_moves_at_random(turns: int) -> None:
    problem = dmplay.load_problem("predator-prey:circle")
    assert check_first_values(problem, turns, ("human", "random"), lambda s: [1 / 6] * 6)
