"""Measure the cost of rollouts beyond their steps, for agents that use only their last observation.

There are three baselines, with the same turns: the same states and joint actions in batches of the
same size. Bare steps have uniforms for nature, also in games that are over, and the legal actions
mask if there is one. Random steps add the start of each game, the check for terminal states and a
random action for each seat, as `benchmark_step` of Gymnasium and the speed benchmark of pgx time a
step. With agents, their uniforms and choices replace the random actions. The remaining time is the
overhead of the rollout.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import median
from time import thread_time

import numpy as np

import dmplay
from dmplay.agents.base import ReactivePolicy, RepeatedGameRule
from dmplay.agents.matrix_game_agents import FictitiousPlay, GradientAscent
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory, Percept, Policy
from dmplay.core.problem import Outcome, Problem
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.errors import BadPolicy
from dmplay.evaluation.many_games import rollout
from dmplay.problems.game_2048.agents import Corner, Expectimax
from dmplay.registry.agents import load_roster
from dmplay.registry.builtin_names import problem_names
from dmplay.simulation.rollouts import RolloutSpec, rollout_entrants

EPISODES, TURNS, SEED = 10_000, 50, 1
# policies that remember only their last observation or their next action
MEASURED_POLICY_TYPES = (ReactivePolicy, RepeatedGameRule, Corner)
# policies that compute for long or remember all rounds
EXCLUDED_POLICY_TYPES = (Expectimax, FictitiousPlay, GradientAscent)

Task = Callable[[], object]


@dataclass
class RecordingPolicy:
    """A policy that records its calls, so that they can be repeated."""

    policy: Policy
    thoughts: list[Task] = field(default_factory=list)

    @property
    def uniform_count(self) -> int:
        return self.policy.uniform_count

    def initial_memory(self, observation: Array) -> Memory:
        self.thoughts.append(partial(self.policy.initial_memory, observation))
        return self.policy.initial_memory(observation)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        self.thoughts.append(partial(self.policy.update_memory, memory, percept))
        return self.policy.update_memory(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        self.thoughts.append(partial(self.policy.choose, memory, legal, u))
        return self.policy.choose(memory, legal, u)

    def action_values(self, memory: Memory) -> Reals | None:
        return self.policy.action_values(memory)


def report(runs: int) -> None:
    """Print a line per agent: nanoseconds per turn, and the ratio to each baseline."""
    print(
        f"\n{EPISODES} games of {TURNS} turns, medians of {runs} runs: nanoseconds a turn of a game"
    )
    print(f"{'':<44} whole  bare steps   times  random steps   times  with agents   times")
    for name in problem_names():
        problem = dmplay.load_problem(name)
        for agent, policies in _iter_teams(problem):
            whole, bare, random_part, agent_part = _measure_costs(problem, policies, runs)
            baselines = (bare, 12), (bare + random_part, 14), (bare + agent_part, 13)
            columns = "".join(
                f"{baseline:{width}.1f}{whole / baseline:8.2f}" for baseline, width in baselines
            )
            print(f"{name + ' ' + agent:<44}{whole:6.1f}{columns}", flush=True)


def _iter_teams(problem: Problem) -> Iterator[tuple[str, list[Policy]]]:
    """Yield each agent in all seats; seats it cannot play have random agents."""
    seats = range(len(problem.agents))
    for name, policy_type in load_roster(problem, 0).agents.items():
        if issubclass(policy_type, MEASURED_POLICY_TYPES) and not issubclass(
            policy_type, EXCLUDED_POLICY_TYPES
        ):
            agent_names = [
                name if name in load_roster(problem, seat).agents else "random" for seat in seats
            ]
            try:
                yield (
                    name,
                    [
                        dmplay.load_agent(problem, seat, agent_name)
                        for seat, agent_name in enumerate(agent_names)
                    ],
                )
            except BadPolicy:
                continue


def _measure_costs(problem: Problem, policies: Sequence[Policy], runs: int) -> list[float]:
    """Return the nanoseconds per turn of a rollout, a bare step, the random part and the agents'
    part.
    """
    turns = list[tuple[Array, Array]]()

    def note(s: Array, a: Array, outcome: Outcome) -> Reals:
        turns.append((s, a))
        return np.zeros_like(outcome.rewards)

    recorders = [RecordingPolicy(policy) for policy in policies]
    rollout_entrants(
        problem, [recorders], RolloutSpec(range(EPISODES), TURNS, SEED, control_variate=note)
    )

    def bare() -> None:
        for turn, (s, a) in enumerate(turns, 1):
            problem.legal_actions_mask(s)
            u = generate_uniforms(
                SEED, NATURE_STREAM, turn, rows=EPISODES, count=problem.uniform_counts.step
            )
            problem.step(s, a, u[: len(s)])

    def begun() -> None:
        problem.sample_initial_states(
            generate_uniforms(
                SEED, NATURE_STREAM, 0, rows=EPISODES, count=problem.uniform_counts.start
            )
        )
        for s, _ in turns:
            problem.terminal(s)

    def drawn() -> None:
        begun()
        for turn, (s, _) in enumerate(turns, 1):
            legal = problem.legal_actions_mask(s)
            for seat, actions in enumerate(problem.actions):
                u = generate_uniforms(SEED, 1 + seat, turn, rows=len(s), count=1)
                actions.sample_actions(u[:, 0], None if legal is None else legal[:, seat])

    def needed() -> None:
        begun()
        for turn in range(1, len(turns) + 1):
            for seat, policy in enumerate(policies):
                generate_uniforms(SEED, 1 + seat, turn, rows=EPISODES, count=policy.uniform_count)
        for recorder in recorders:
            for call in recorder.thoughts:
                call()

    def whole() -> None:
        rollout(problem, policies, episodes=EPISODES, turn_limit=TURNS, seed=SEED)

    turn_count = sum(len(s) for s, _ in turns)
    samples = [
        [_measure_seconds(work) for work in (whole, bare, drawn, needed)] for _ in range(runs)
    ]
    return [median(durations) / turn_count * 1e9 for durations in zip(*samples, strict=True)]


def _measure_seconds(task: Task) -> float:
    """Return the processor seconds of a task."""
    start_time = thread_time()
    task()
    return thread_time() - start_time
