"""What whole games cost beside their steps, of the agents that go by what they see alone.

Three floors, all of the same turns: the same states and joint actions in batches as large.
Bare steps are those with nature's dice, of games that are over too, and the legal mask, where
there is one. Random steps have besides the opening of each game, whether it is over and an action
drawn for each seat, as `benchmark_step` of Gymnasium and the speed benchmark of pgx time a step.
With agents, their own dice and thoughts stand for the drawn actions. What remains goes into looking
after it all.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from statistics import median
from time import thread_time

import numpy as np

import dmplay
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Outcome, Percept, Policy, Problem
from dmplay.dice import NATURE_STREAM, generate_uniforms
from dmplay.errors import BadPolicy
from dmplay.finding.agents import load_roster
from dmplay.finding.names import problem_names
from dmplay.policies._matrix_agents import FictitiousPlay, GradientAscent
from dmplay.policies.game_2048 import Corner, Expectimax
from dmplay.policies.kinds import ReactivePolicy, RepeatedGameRule
from dmplay.rollouts import RolloutSpec, rollout, rollout_entrants

GAMES, TURNS, SEED = 10_000, 50, 1
KINDS = (
    ReactivePolicy,
    RepeatedGameRule,
    Corner,
)  # who remembers what it saw last, or what it is about to do
OTHERS = (Expectimax, FictitiousPlay, GradientAscent)  # think for long, or of all rounds

Work = Callable[[], object]


@dataclass
class Noting:
    """An agent whose every thought is noted, to be thought again."""

    policy: Policy
    thoughts: list[Work] = field(default_factory=list)

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
    """Prints a line an agent: nanoseconds a turn of a game, and how many times each floor."""
    print(f"\n{GAMES} games of {TURNS} turns, medians of {runs} runs: nanoseconds a turn of a game")
    print(f"{'':<44} whole  bare steps   times  random steps   times  with agents   times")
    for name in problem_names():
        problem = dmplay.load_problem(name)
        for agent, policies in _teams(problem):
            whole, bare, drawn, needed = _costs(problem, policies, runs)
            floors = (bare, 12), (bare + drawn, 14), (bare + needed, 13)
            told = "".join(f"{floor:{wide}.1f}{whole / floor:8.2f}" for floor, wide in floors)
            print(f"{name + ' ' + agent:<44}{whole:6.1f}{told}", flush=True)


def _teams(problem: Problem) -> Iterator[tuple[str, list[Policy]]]:
    """Each agent in all seats, or in those that it can play beside random ones."""
    seats = range(len(problem.agents))
    for name, make in load_roster(problem, 0).agents.items():
        if issubclass(make, KINDS) and not issubclass(make, OTHERS):
            able = [
                name if name in load_roster(problem, seat).agents else "random" for seat in seats
            ]
            try:
                yield name, [dmplay.load_agent(problem, seat, one) for seat, one in enumerate(able)]
            except BadPolicy:
                continue


def _costs(problem: Problem, policies: Sequence[Policy], runs: int) -> list[float]:
    """What a turn takes in a rollout, as a bare step, and more as a random one or with agents."""
    turns = list[tuple[Array, Array]]()

    def note(s: Array, a: Array, outcome: Outcome) -> Reals:
        turns.append((s, a))
        return np.zeros_like(outcome.rewards)

    noting = [Noting(policy) for policy in policies]
    rollout_entrants(
        problem, [noting], RolloutSpec(range(GAMES), TURNS, SEED, control_variate=note)
    )

    def bare() -> None:
        for turn, (s, a) in enumerate(turns, 1):
            problem.legal_actions_mask(s)
            u = generate_uniforms(
                SEED, NATURE_STREAM, turn, rows=GAMES, count=problem.uniform_counts.step
            )
            problem.step(s, a, u[: len(s)])

    def begun() -> None:
        problem.sample_initial_states(
            generate_uniforms(
                SEED, NATURE_STREAM, 0, rows=GAMES, count=problem.uniform_counts.start
            )
        )
        for s, _ in turns:
            problem.terminal(s)

    def drawn() -> None:
        begun()
        for turn, (s, _) in enumerate(turns, 1):
            legal = problem.legal_actions_mask(s)
            for seat, known in enumerate(problem.actions):
                u = generate_uniforms(SEED, 1 + seat, turn, rows=len(s), count=1)
                known.sample_actions(u[:, 0], None if legal is None else legal[:, seat])

    def needed() -> None:
        begun()
        for turn in range(1, len(turns) + 1):
            for seat, policy in enumerate(policies):
                generate_uniforms(SEED, 1 + seat, turn, rows=GAMES, count=policy.uniform_count)
        for one in noting:
            for thought in one.thoughts:
                thought()

    def whole() -> None:
        rollout(problem, policies, episodes=GAMES, turn_limit=TURNS, seed=SEED)

    played = sum(len(s) for s, _ in turns)
    spent = [[_seconds(work) for work in (whole, bare, drawn, needed)] for _ in range(runs)]
    return [median(each) / played * 1e9 for each in zip(*spent, strict=True)]


def _seconds(work: Work) -> float:
    """The seconds of the processor that something takes."""
    since = thread_time()
    work()
    return thread_time() - since
