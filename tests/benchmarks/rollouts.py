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
from dmplay.dice import NATURE, uniforms
from dmplay.errors import BadPolicy
from dmplay.finding.agents import roster
from dmplay.finding.names import problem_names
from dmplay.policies._matrix_agents import BestResponse, GradientAscent
from dmplay.policies.game_2048 import Corner, Expectimax
from dmplay.policies.kinds import Reactive, Rule
from dmplay.rollouts import Games, rollout, rollouts

GAMES, TURNS, SEED = 10_000, 50, 1
KINDS = (Reactive, Rule, Corner)  # who remembers what it saw last, or what it is about to do
OTHERS = (Expectimax, BestResponse, GradientAscent)  # think for long, or of all rounds

Work = Callable[[], object]


@dataclass
class Noting:
    """An agent whose every thought is noted, to be thought again."""

    policy: Policy
    thoughts: list[Work] = field(default_factory=list)

    @property
    def draws(self) -> int:
        return self.policy.draws

    def begin(self, observation: Array) -> Memory:
        self.thoughts.append(partial(self.policy.begin, observation))
        return self.policy.begin(observation)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        self.thoughts.append(partial(self.policy.update, memory, percept))
        return self.policy.update(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        self.thoughts.append(partial(self.policy.choose, memory, legal, u))
        return self.policy.choose(memory, legal, u)

    def values(self, memory: Memory) -> Reals | None:
        return self.policy.values(memory)


def report(runs: int) -> None:
    """Prints a line an agent: nanoseconds a turn of a game, and how many times each floor."""
    print(f"\n{GAMES} games of {TURNS} turns, medians of {runs} runs: nanoseconds a turn of a game")
    print(f"{'':<44} whole  bare steps   times  random steps   times  with agents   times")
    for name in problem_names():
        problem = dmplay.load(name)
        for agent, policies in _teams(problem):
            whole, bare, drawn, needed = _costs(problem, policies, runs)
            floors = (bare, 12), (bare + drawn, 14), (bare + needed, 13)
            told = "".join(f"{floor:{wide}.1f}{whole / floor:8.2f}" for floor, wide in floors)
            print(f"{name + ' ' + agent:<44}{whole:6.1f}{told}", flush=True)


def _teams(problem: Problem) -> Iterator[tuple[str, list[Policy]]]:
    """Each agent in all seats, or in those that it can play beside random ones."""
    seats = range(len(problem.agents))
    for name, make in roster(problem, 0).agents.items():
        if issubclass(make, KINDS) and not issubclass(make, OTHERS):
            able = [name if name in roster(problem, seat).agents else "random" for seat in seats]
            try:
                yield name, [dmplay.agent(problem, seat, one) for seat, one in enumerate(able)]
            except BadPolicy:
                continue


def _costs(problem: Problem, policies: Sequence[Policy], runs: int) -> list[float]:
    """What a turn takes in a rollout, as a bare step, and more as a random one or with agents."""
    turns = list[tuple[Array, Array]]()

    def note(s: Array, a: Array, outcome: Outcome) -> Reals:
        turns.append((s, a))
        return np.zeros_like(outcome.rewards)

    noting = [Noting(policy) for policy in policies]
    rollouts(problem, [noting], Games(range(GAMES), TURNS, SEED, luck=note))

    def bare() -> None:
        for turn, (s, a) in enumerate(turns, 1):
            problem.legal(s)
            u = uniforms(SEED, NATURE, turn, rows=GAMES, count=problem.draws.step)
            problem.step(s, a, u[: len(s)])

    def begun() -> None:
        problem.start(uniforms(SEED, NATURE, 0, rows=GAMES, count=problem.draws.start))
        for s, _ in turns:
            problem.terminal(s)

    def drawn() -> None:
        begun()
        for turn, (s, _) in enumerate(turns, 1):
            legal = problem.legal(s)
            for seat, known in enumerate(problem.actions):
                u = uniforms(SEED, 1 + seat, turn, rows=len(s), count=1)
                known.draw(u[:, 0], None if legal is None else legal[:, seat])

    def needed() -> None:
        begun()
        for turn in range(1, len(turns) + 1):
            for seat, policy in enumerate(policies):
                uniforms(SEED, 1 + seat, turn, rows=GAMES, count=policy.draws)
        for one in noting:
            for thought in one.thoughts:
                thought()

    def whole() -> None:
        rollout(problem, policies, episodes=GAMES, turns=TURNS, seed=SEED)

    played = sum(len(s) for s, _ in turns)
    spent = [[_seconds(work) for work in (whole, bare, drawn, needed)] for _ in range(runs)]
    return [median(each) / played * 1e9 for each in zip(*spent, strict=True)]


def _seconds(work: Work) -> float:
    """The seconds of the processor that something takes."""
    since = thread_time()
    work()
    return thread_time() - since
