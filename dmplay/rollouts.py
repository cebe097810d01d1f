"""Many games at once: a problem and its policies, to returns."""

import math
from collections.abc import Callable, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from dmplay.budget import Budget, between
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.core import DECIMALS, Memory, Policy, Problem, asked, own
from dmplay.dice import NATURE, uniforms
from dmplay.errors import BadPolicy

MOST_TURNS = 10_000  # where nothing else ends a game


class Rollout(NamedTuple):
    """What came of E games of n agents."""

    returns: Reals  # [E, n], discounted sums of rewards
    totals: Reals  # [E, n], plain sums
    turns: Ints  # [E]
    over: Bools  # [E], in a terminal state
    state: Array  # [E, ...], the last


def rollout(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    policies: Sequence[Policy],
    *,
    episodes: int,
    turns: int | None = None,
    seed: int = 0,
    first: int = 0,
) -> Rollout:
    """Plays episodes `first` .. `first + episodes - 1` of a seed, one policy to a seat.

    Row r is the game that a session plays with `Dice(seed, first + r)`. All rows draw every turn,
    finished or not, so that two policies meet the same luck.
    """
    if len(policies) != len(problem.agents):
        raise BadPolicy(f"got {len(policies)} policies, expected one for each of {problem.agents}")
    limit = turns if turns is not None else problem.horizon
    limit = MOST_TURNS if limit is None else limit

    budget = Budget("a rollout", "try fewer games at a time", math.inf)
    widest = max(*problem.draws, *(policy.draws for policy in policies))
    budget.hold(24.0 * episodes * widest)

    def draw(stream: int, turn: int, count: int) -> Reals:
        return uniforms(seed, stream, turn, first=first, rows=episodes, count=count)

    state = problem.start(draw(NATURE, 0, problem.draws.start))
    final = state.copy()
    returns, totals = (np.zeros((episodes, len(policies))) for _ in range(2))
    length = np.zeros(episodes, np.int64)
    weight = 1.0
    row = np.arange(episodes)  # the games that go on
    memories = [asked("turn 1", one.begin, problem.first_sight(state)) for one in policies]
    for turn in range(1, limit + 1):
        share = (turn - 1) / limit
        budget.spend(0, share)
        going = ~problem.terminal(state)
        if not going.all():
            row, state = row[going], state[going]
            memories = [_rows(memory, going) for memory in memories]
        if not len(row):
            break
        luck = [draw(1 + seat, turn, policy.draws)[row] for seat, policy in enumerate(policies)]
        where = [f"turn {turn}, {agent}" for agent in problem.agents]
        each = zip(where, policies, memories, strict=True)
        choosers = [partial(asked, at, policy.choose, memory) for at, policy, memory in each]
        with between(share, share):
            actions = _chosen(problem, choosers, state, luck)
        outcome = problem.step(state, actions, draw(NATURE, turn, problem.draws.step)[row])
        memories = [
            asked(where[seat], policy.update, memory, problem.percept(seat, actions, outcome))
            for seat, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        final[row] = state = outcome.state
        returns[row] += weight * outcome.rewards
        totals[row] += outcome.rewards
        length[row] = turn
        weight *= problem.discount
    return Rollout(returns, totals, length, problem.terminal(final), final)


def _rows(memory: Memory, going: Bools) -> Memory:
    return tuple(part[going] for part in memory)


def _chosen(
    problem: Problem,
    choosers: Sequence[Callable[[Bools | None, Reals], Array]],
    state: Array,
    luck: Sequence[Reals],
) -> Array:
    """The joint actions `[B, n]` that the policies choose, reals to so many decimals."""
    legal = problem.legal(state)
    chosen = [
        choose(None if legal is None else own(legal[:, seat]), u)
        for seat, (choose, u) in enumerate(zip(choosers, luck, strict=True))
    ]
    actions = np.stack(chosen, axis=1)
    # As in a session, so that the text of an action is the action.
    return np.round(actions, DECIMALS) + 0.0 if actions.dtype.kind == "f" else actions
