"""Policy iteration: compute the values of a policy, take better actions, and repeat."""

from collections.abc import Iterator

import numpy as np

from dmplay.algorithms.finite_mdp import (
    FiniteMdp,
    build_finite_mdp,
    explain_mdp_misfit,
    find_grid,
    format_state_name,
    format_value_name,
)
from dmplay.algorithms.step import Algorithm, Curve, StateValues, Step, WatchRequest
from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import compute_tolerance, select_greedy_actions
from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_score

LIMIT_NOTE = "Your game has a turn limit; the values here are for a game without one."
MAX_STATES = 2000  # states of the linear equations that evaluate a policy


def explain_misfit(problem: Problem) -> str:
    """Return the reason why a policy cannot be evaluated by linear equations; '' if it can."""
    obstacle = explain_mdp_misfit(problem)
    if obstacle:
        return obstacle
    if problem.discount == 1.0:
        return "its discount is 1, and a policy may never end; it needs a discount below 1"
    if find_grid(problem) is not None or not isinstance(problem.state_count, int):
        return "its states are real numbers; it needs a list of states"
    return "" if problem.state_count <= MAX_STATES else f"it needs at most {MAX_STATES} states"


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the steps of policy iteration: evaluation and improvement by turns."""
    mdp = build_finite_mdp(request.problem)
    policy = np.where(mdp.terminal, -1, np.isfinite(mdp.rewards).argmax(axis=1))
    scale = request.problem.reward_scale
    values, improved_counts = np.zeros(len(mdp.states)), list[float]()
    yield Step(
        "start",
        (
            "A policy says which action to take in each state.",
            "This one takes the first legal action everywhere.",
            *([LIMIT_NOTE] if request.session and request.session.turn_limit is not None else []),
        ),
        pictures=(StateValues(mdp.states, values, policy),),
    )
    for number in range(1, (request.iterations or MAX_STATES) + 1):
        previous, values = values, evaluate_policy(mdp, policy)
        yield _describe_evaluation(request, mdp, number, policy, values, np.abs(values - previous))
        q = mdp.compute_action_values(values)
        gains = np.where(mdp.terminal, 0.0, q.max(axis=1) - values)
        improved = gains > compute_tolerance(values, scale=scale)
        old_policy, policy = policy, np.where(improved, select_greedy_actions(q, scale), policy)
        improved_counts.append(float(np.count_nonzero(improved)))
        focus = mdp.choose_formula_state(request.session, gains)
        picture = StateValues(mdp.states, values, policy, improved, focus)
        curve = Curve("states with a better action", tuple(improved_counts))
        sentences, formula = _describe_improvement(request, mdp, focus, old_policy, policy, values)
        end = "No action is better than the policy's, so the policy is optimal."
        yield Step(
            f"improvement {number}",
            (
                f"A better action is found in {np.count_nonzero(improved)} "
                f"of {format_count(len(values), 'state')}.",
                *(sentences if improved.any() else (end,)),
            ),
            formula,
            (picture, curve),
        )
        if not improved.any():
            return


def evaluate_policy(mdp: FiniteMdp, policy: Ints) -> Reals:
    """Return U `[S]` of a policy `[S]`, the solution of linear equations (section 7.2)."""
    rows = np.arange(len(policy))
    p, next_states = mdp.probabilities[rows, policy], mdp.next_states[rows, policy]
    transition = np.zeros((len(policy), len(policy)))
    np.add.at(transition, (np.broadcast_to(rows[:, None], p.shape), next_states), p)
    rewards = np.where(mdp.terminal, 0.0, mdp.rewards[rows, policy])
    equations: Reals = np.eye(len(policy)) - mdp.discount * transition
    return np.asarray(np.linalg.solve(equations, rewards) + 0.0, np.float64)  # no negative zero


def _describe_evaluation(  # noqa: PLR0913, PLR0917 - the numbers of one step
    request: WatchRequest, mdp: FiniteMdp, number: int, policy: Ints, values: Reals, change: Reals
) -> Step:
    """Return the step that shows the values of a policy."""
    focus = mdp.choose_formula_state(request.session, change)
    state = format_state_name(request.problem, mdp.states[focus])
    sentences = (
        "V is now the expected return of this policy, in a game without a turn limit.",
        f"It solves {len(values)} linear equations, one for each state.",
    )
    formula = mdp.format_lookahead(format_value_name(state), focus, int(policy[focus]), values)
    changed = change > compute_tolerance(values, scale=request.problem.reward_scale)
    picture = StateValues(mdp.states, values, policy, changed, focus)
    return Step(f"evaluation {number}", sentences, formula, (picture,))


def _describe_improvement(  # noqa: PLR0913, PLR0917 - the numbers of one step
    request: WatchRequest, mdp: FiniteMdp, focus: int, old_policy: Ints, policy: Ints, values: Reals
) -> tuple[tuple[str, ...], str]:
    """Return a sentence on the action of one state, and the formula of its value."""
    action, old_action = int(policy[focus]), int(old_policy[focus])
    state = format_state_name(request.problem, mdp.states[focus])
    if action < 0:
        return (), f"{format_value_name(state)} = 0"
    label = request.problem.format_action(0, action)
    formula = mdp.format_lookahead(f"Q({state}, {label})", focus, action, values)
    if action == old_action:
        return (f"In {state}, {label} remains the best action.",), formula
    old_label, old_value = request.problem.format_action(0, old_action), format_score(values[focus])
    return (f"In {state}, {label} replaces {old_label}, whose value is {old_value}.",), formula


ALGORITHM = Algorithm(
    "policy-iteration",
    "compute the value of a policy, then improve the policy",
    "section 7.4, Policy Iteration",
    explain_misfit,
    iterate_steps,
)
