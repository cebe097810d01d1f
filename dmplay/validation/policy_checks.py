"""Invariants of every agent: its choices are legal, and the same alone as in a batch."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import Problem, build_percept, make_initial_observation
from dmplay.core.spaces import Interval, Labels
from dmplay.core.violation import CheckResult, CheckResults
from dmplay.simulation.random_play import (
    is_bitwise_equal,
    make_arrays_readonly,
    slice_rows,
    step_turn,
    turn_uniforms,
)

TRIED_TURNS = 3  # turns in which an agent chooses


class PolicyCall(NamedTuple):
    """One choice of a policy over a batch, with its inputs."""

    memory: Memory
    legal_actions_mask: Bools | None
    uniforms: Reals
    actions: Array
    action_values: Reals | None


def check_policy_choices(
    problem: Problem, seat: int, policies: Sequence[Policy], rows: int
) -> CheckResults:
    """Yield checks that an agent chooses legal actions, the same for a row alone as in a batch.

    The `attribute` of each result is the policy's method that is at fault.
    """
    policy = policies[seat]
    for call in _iter_policy_calls(problem, seat, policies, rows):
        yield from _check_policy_call(problem.actions[seat], call)
        row_count = len(call.uniforms)
        for row_slice in (
            slice(0, 1),
            slice(row_count - 1, row_count),
            slice(row_count // 3, row_count // 2 + 1),
        ):
            legal = None if call.legal_actions_mask is None else call.legal_actions_mask[row_slice]
            single = _call_policy(
                policy, slice_rows(call.memory, row_slice), legal, call.uniforms[row_slice]
            )
            message = (
                "choose: got a different action in a smaller batch, expected that of "
                "the whole batch"
            )
            yield CheckResult(
                is_bitwise_equal(single.actions, call.actions[row_slice]), "choose", message
            )
            message = (
                "action_values: got different values in a smaller batch, expected "
                "those of the whole batch"
            )
            if single.action_values is not None and call.action_values is not None:
                yield CheckResult(
                    is_bitwise_equal(single.action_values, call.action_values[row_slice]),
                    "action_values",
                    message,
                )


def _check_policy_call(action_space: Labels | Interval, call: PolicyCall) -> CheckResults:
    """Yield checks that a policy's memory, actions and values have valid shapes and ranges."""
    row_count, actions = len(call.uniforms), call.actions
    is_valid = isinstance(call.memory, tuple) and all(
        len(part) == row_count for part in call.memory
    )
    message = f"update_memory: got a memory that is not a tuple of arrays with {row_count} rows"
    yield CheckResult(is_valid, "update_memory", message)
    yield CheckResult(
        isinstance(actions, np.ndarray) and actions.shape == (row_count,),
        "choose",
        lambda: f"choose: got {actions!r}, expected an action for each of {row_count} rows",
    )
    if isinstance(action_space, Interval):
        message = (
            f"choose: got {actions.min():g} to {actions.max():g}, "
            f"expected {action_space.describe_actions()}"
        )
        is_valid = bool(((actions >= action_space.low) & (actions <= action_space.high)).all())
        yield CheckResult(is_valid, "choose", message)
        return
    yield CheckResult(
        actions.dtype.kind in "iu" and bool(((actions >= 0) & (actions < len(action_space))).all()),
        "choose",
        lambda: f"choose: got {actions!r}, expected indices from 0 to {len(action_space) - 1}",
    )
    shape = (
        (row_count, len(action_space))
        if call.action_values is None
        else np.shape(call.action_values)
    )
    message = f"action_values: got shape {shape}, expected {(row_count, len(action_space))} or None"
    yield CheckResult(shape == (row_count, len(action_space)), "action_values", message)
    if call.legal_actions_mask is not None:
        is_legal = call.legal_actions_mask[np.arange(row_count), actions]
        message = (
            "choose: got an action that is not legal, expected one that `legal_actions_mask` allows"
        )
        yield CheckResult(bool(is_legal.all()), "choose", message)


def _call_policy(
    policy: Policy, memory: Memory, legal_actions_mask: Bools | None, u: Reals
) -> PolicyCall:
    """Call a policy's `choose` and `action_values`, and return the inputs and results."""
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
    """Yield the calls of a seat's policy in the first turns of a batch of games."""
    s = problem.sample_initial_states(turn_uniforms(problem.uniform_counts.start, 0, rows))
    memories = [
        policy.initial_memory(make_initial_observation(problem, s, index))
        for index, policy in enumerate(policies)
    ]
    for turn in range(1, TRIED_TURNS + 1):
        active = ~problem.terminal(s)
        s = make_arrays_readonly(s[active])[0]
        memories = [make_arrays_readonly(*(part[active] for part in memory)) for memory in memories]
        if not len(s):
            return
        legal = problem.legal_actions_mask(s)
        calls = [
            _call_policy(
                policy,
                memory,
                None if legal is None else legal[:, index],
                make_arrays_readonly(turn_uniforms(policy.uniform_count, turn, len(s), 1 + index))[
                    0
                ],
            )
            for index, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        yield calls[seat]
        a = np.stack([call.actions for call in calls], axis=1)
        outcome = step_turn(problem, s, a, turn)
        memories = [
            policy.update_memory(memory, build_percept(problem, index, a, outcome))
            for index, (policy, memory) in enumerate(zip(policies, memories, strict=True))
        ]
        s = outcome.state
