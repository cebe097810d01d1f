"""What every agent keeps: it chooses what is legal, alone as in a batch."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Interval, Labels, Memory, Policy, Problem
from dmplay.laws.breach import Fact, Facts
from dmplay.laws.samples import after, draws, frozen, parts, same

TURNS = 3  # in which an agent is asked


class Asked(NamedTuple):
    """One choice of a policy over a batch, and what it rested on."""

    memory: Memory
    legal: Bools | None
    u: Reals
    chosen: Array
    values: Reals | None


def choosing(problem: Problem, seat: int, policies: Sequence[Policy], rows: int) -> Facts:
    """An agent chooses what is legal, alone as in a batch; `said` is the method to blame."""
    policy = policies[seat]
    for ask in _course(problem, seat, policies, rows):
        yield from _answers(problem.actions[seat], ask)
        many = len(ask.u)
        for some in (slice(0, 1), slice(many - 1, many), slice(many // 3, many // 2 + 1)):
            legal = None if ask.legal is None else ask.legal[some]
            single = _asked(policy, parts(ask.memory, some), legal, ask.u[some])
            told = "choose: got another action for a row alone, expected the same as in a batch"
            yield Fact(same(single.chosen, ask.chosen[some]), "choose", told)
            told = "values: got others for a row alone, expected the same as in a batch"
            if single.values is not None and ask.values is not None:
                yield Fact(same(single.values, ask.values[some]), "values", told)


def _answers(known: Labels | Interval, ask: Asked) -> Facts:
    """What a policy answers is of the right shape and can be done."""
    rows, chosen = len(ask.u), ask.chosen
    holds = isinstance(ask.memory, tuple) and all(len(part) == rows for part in ask.memory)
    told = f"update: got a memory that is no tuple of arrays with {rows} rows each"
    yield Fact(holds, "update", told)
    yield Fact(
        isinstance(chosen, np.ndarray) and chosen.shape == (rows,),
        "choose",
        lambda: f"choose: got {chosen!r}, expected an action for each of {rows} rows",
    )
    if isinstance(known, Interval):
        told = f"choose: got {chosen.min():g} to {chosen.max():g}, expected {known.words()}"
        holds = bool(((chosen >= known.low) & (chosen <= known.high)).all())
        yield Fact(holds, "choose", told)
        return
    yield Fact(
        chosen.dtype.kind in "iu" and bool(((chosen >= 0) & (chosen < len(known))).all()),
        "choose",
        lambda: f"choose: got {chosen!r}, expected 0 to {len(known) - 1}, an index",
    )
    shape = (rows, len(known)) if ask.values is None else np.shape(ask.values)
    told = f"values: got shape {shape}, expected {(rows, len(known))} or None"
    yield Fact(shape == (rows, len(known)), "values", told)
    if ask.legal is not None:
        able = ask.legal[np.arange(rows), chosen]
        told = "choose: got an action that is not legal, expected one that `legal` marks"
        yield Fact(bool(able.all()), "choose", told)


def _asked(policy: Policy, memory: Memory, legal: Bools | None, u: Reals) -> Asked:
    return Asked(memory, legal, u, policy.choose(memory, legal, u), policy.values(memory))


def _course(problem: Problem, seat: int, policies: Sequence[Policy], rows: int) -> Iterator[Asked]:
    """What a seat's policy is asked in the first turns of a batch of games."""
    s = problem.start(draws(problem.draws.start, 0, rows))
    memories = [policy.begin(problem.first_sight(s, at)) for at, policy in enumerate(policies)]
    for turn in range(1, TURNS + 1):
        going = ~problem.terminal(s)
        s = frozen(s[going])[0]
        memories = [frozen(*(part[going] for part in memory)) for memory in memories]
        if not len(s):
            return
        legal = problem.legal(s)
        asks = [
            _asked(
                policy,
                memory,
                None if legal is None else legal[:, at],
                frozen(draws(policy.draws, turn, len(s), 1 + at))[0],
            )
            for at, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        yield asks[seat]
        a = np.stack([ask.chosen for ask in asks], axis=1)
        outcome = after(problem, s, a, turn)
        memories = [
            policy.update(memory, problem.percept(at, a, outcome))
            for at, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        s = outcome.state
