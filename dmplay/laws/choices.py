"""What every agent keeps: it chooses what is legal, alone as in a batch."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Interval, Labels, Memory, Policy, Problem
from dmplay.laws.breach import CheckResult, CheckResults
from dmplay.laws.samples import (
    is_bitwise_equal,
    make_arrays_readonly,
    slice_rows,
    step_turn,
    turn_uniforms,
)

TRIED_TURNS = 3  # in which an agent is asked


class PolicyCall(NamedTuple):
    """One choice of a policy over a batch, and what it rested on."""

    memory: Memory
    legal_actions_mask: Bools | None
    uniforms: Reals
    actions: Array
    action_values: Reals | None


def check_policy_choices(
    problem: Problem, seat: int, policies: Sequence[Policy], rows: int
) -> CheckResults:
    """An agent chooses what is legal, alone as in a batch; `said` is the method to blame."""
    policy = policies[seat]
    for ask in _iter_policy_calls(problem, seat, policies, rows):
        yield from _check_policy_call(problem.actions[seat], ask)
        many = len(ask.uniforms)
        for some in (slice(0, 1), slice(many - 1, many), slice(many // 3, many // 2 + 1)):
            legal = None if ask.legal_actions_mask is None else ask.legal_actions_mask[some]
            single = _call_policy(policy, slice_rows(ask.memory, some), legal, ask.uniforms[some])
            told = "choose: got another action for a row alone, expected the same as in a batch"
            yield CheckResult(is_bitwise_equal(single.actions, ask.actions[some]), "choose", told)
            told = "action_values: got others for a row alone, expected the same as in a batch"
            if single.action_values is not None and ask.action_values is not None:
                yield CheckResult(
                    is_bitwise_equal(single.action_values, ask.action_values[some]),
                    "action_values",
                    told,
                )


def _check_policy_call(action_space: Labels | Interval, call: PolicyCall) -> CheckResults:
    """What a policy answers is of the right shape and can be done."""
    rows, chosen = len(call.uniforms), call.actions
    holds = isinstance(call.memory, tuple) and all(len(part) == rows for part in call.memory)
    told = f"update_memory: got a memory that is no tuple of arrays with {rows} rows each"
    yield CheckResult(holds, "update_memory", told)
    yield CheckResult(
        isinstance(chosen, np.ndarray) and chosen.shape == (rows,),
        "choose",
        lambda: f"choose: got {chosen!r}, expected an action for each of {rows} rows",
    )
    if isinstance(action_space, Interval):
        told = f"choose: got {chosen.min():g} to {chosen.max():g}, expected {action_space.describe_actions()}"
        holds = bool(((chosen >= action_space.low) & (chosen <= action_space.high)).all())
        yield CheckResult(holds, "choose", told)
        return
    yield CheckResult(
        chosen.dtype.kind in "iu" and bool(((chosen >= 0) & (chosen < len(action_space))).all()),
        "choose",
        lambda: f"choose: got {chosen!r}, expected 0 to {len(action_space) - 1}, an index",
    )
    shape = (
        (rows, len(action_space)) if call.action_values is None else np.shape(call.action_values)
    )
    told = f"action_values: got shape {shape}, expected {(rows, len(action_space))} or None"
    yield CheckResult(shape == (rows, len(action_space)), "action_values", told)
    if call.legal_actions_mask is not None:
        able = call.legal_actions_mask[np.arange(rows), chosen]
        told = (
            "choose: got an action that is not legal, expected one that `legal_actions_mask` marks"
        )
        yield CheckResult(bool(able.all()), "choose", told)


def _call_policy(
    policy: Policy, memory: Memory, legal_actions_mask: Bools | None, u: Reals
) -> PolicyCall:
    return PolicyCall(
        memory,
        legal_actions_mask,
        u,
        policy.choose(memory, legal_actions_mask, u),
        policy.action_values(memory),
    )


def _iter_policy_calls(
    problem: Problem, seat: int, policies: Sequence[Policy], rows: int
) -> Iterator[PolicyCall]:
    """What a seat's policy is asked in the first turns of a batch of games."""
    s = problem.sample_initial_states(turn_uniforms(problem.uniform_counts.start, 0, rows))
    memories = [
        policy.initial_memory(problem.initial_observation(s, at))
        for at, policy in enumerate(policies)
    ]
    for turn in range(1, TRIED_TURNS + 1):
        going = ~problem.terminal(s)
        s = make_arrays_readonly(s[going])[0]
        memories = [make_arrays_readonly(*(part[going] for part in memory)) for memory in memories]
        if not len(s):
            return
        legal = problem.legal_actions_mask(s)
        asks = [
            _call_policy(
                policy,
                memory,
                None if legal is None else legal[:, at],
                make_arrays_readonly(turn_uniforms(policy.uniform_count, turn, len(s), 1 + at))[0],
            )
            for at, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        yield asks[seat]
        a = np.stack([ask.actions for ask in asks], axis=1)
        outcome = step_turn(problem, s, a, turn)
        memories = [
            policy.update_memory(memory, problem.build_percept(at, a, outcome))
            for at, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        s = outcome.state
