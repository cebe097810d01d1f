"""Value iteration: the values of k turns from those of k - 1 turns, until they stay the same."""

from collections.abc import Iterator

import numpy as np

from dmplay.algorithms.finite_mdp import (
    FiniteMdp,
    build_finite_mdp,
    find_mdp_obstacle,
    format_state_name,
    format_value_name,
)
from dmplay.algorithms.step import Algorithm, Curve, StateValues, Step, WatchRequest
from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE, select_greedy_actions
from dmplay.core.text import format_count, format_score, format_upper_bound

MAX_SWEEPS = 2000
MAX_ERROR = 5e-4  # distance to the optimal values at which the sweeps stop
UNDISCOUNTED_RESIDUAL = 1e-3  # residual at which they stop without a discount


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the steps of value iteration: V = 0, then one Bellman backup of all states a step."""
    mdp, problem = build_finite_mdp(request.problem), request.problem
    values = np.zeros(len(mdp.states))
    residuals: list[float] = []
    start = "V(s) is the value of state s: the best expected return from there."
    no_turns = "At first V is 0 everywhere, the value of a game with no turn left."
    notes = filter(None, [mdp.note, _describe_turns_left(request)])
    yield Step("start", (start, no_turns, *notes), "", (_picture(mdp, values),))
    last_sweep = request.iterations or MAX_SWEEPS
    for sweep in range(1, last_sweep + 1):
        q = mdp.compute_action_values(values)  # one step of lookahead
        greedy = np.where(mdp.terminal, -1, select_greedy_actions(q))
        previous, values = values, np.where(mdp.terminal, 0.0, q.max(axis=1))  # Bellman backup
        change = np.abs(values - previous)
        residuals.append(float(change.max()))
        has_converged = not request.iterations and is_converged(mdp.discount, residuals[-1])
        is_last = sweep == last_sweep or has_converged
        focus = mdp.choose_focus(request.session, change)
        state, action = format_state_name(problem, mdp.states[focus]), int(greedy[focus])
        sentences = (
            f"V is now {'about ' * bool(mdp.note)}the value of a game with "
            f"{format_count(sweep, 'turn')} left.",
            *([_describe_end(mdp.discount, residuals[-1])] if is_last else []),
            f"{np.count_nonzero(change)} of {len(values)} values changed; the largest change, the "
            f"residual, is {format_score(residuals[-1])}.",
            *_describe_focus(request, mdp, state, action, q[focus]),
        )
        formula = mdp.format_lookahead(format_value_name(state), focus, action, previous)
        pictures = (
            _picture(mdp, values, greedy, change, focus),
            Curve("residual", tuple(residuals)),
        )
        yield Step(f"sweep {sweep}", sentences, formula, pictures)
        if is_last:
            return


def is_converged(discount: float, residual: float) -> bool:
    """Return whether values whose last change is `residual` are close to the optimal ones."""
    if discount == 1.0:
        return residual <= UNDISCOUNTED_RESIDUAL
    return bound_error(discount, residual) <= MAX_ERROR


def bound_error(discount: float, residual: float) -> float:
    """Return the largest possible distance to the optimal values (section 7.5)."""
    return residual * discount / (1.0 - discount)


def _picture(
    mdp: FiniteMdp,
    values: Reals,
    greedy: Ints | None = None,
    change: Reals | None = None,
    focus: int = -1,
) -> StateValues:
    """Return the values of the drawn states, with the greedy actions."""
    rows = mdp.drawn
    return StateValues(
        mdp.states[rows],
        values[rows],
        None if greedy is None else greedy[rows],
        None if change is None else change[rows] > 0,
        int(np.flatnonzero(rows == focus)[0]) if focus in rows else None,
    )


def _describe_turns_left(request: WatchRequest) -> str:
    """Return which sweep is about the game with its turn limit; '' if it has none."""
    session = request.session
    if session is None or session.over or session.turn_limit is None:
        return ""
    turns_left = session.turn_limit - len(session.turns)
    return (
        f"Your game has {format_count(turns_left, 'turn')} left: its values are those of "
        f"sweep {turns_left}, or of the last sweep if that comes first."
    )


def _describe_focus(
    request: WatchRequest, mdp: FiniteMdp, state: str, action: int, q: Reals
) -> tuple[str, ...]:
    """Return a sentence about the action of the formula and the next best one."""
    if action < 0:
        return ()
    reason = "where V changed most"
    if request.session is not None and not request.session.over:
        reason = f"the {'grid point nearest to the ' * bool(mdp.note)}state of the game"
    name, position = request.problem.format_action(0, action), f"in {state}, {reason}"
    others = np.delete(q, action)
    if not np.isfinite(others).any():
        return (f"The formula is for {name} {position}.",)
    if others.max() > q[action] - VALUE_TOLERANCE:
        return (f"The formula is for {name} {position}; another action is equally good.",)
    runner_up = format_score(float(others.max()))
    return (f"The best action {position}, is {name}; the next best has {runner_up}.",)


def _describe_end(discount: float, residual: float) -> str:
    """Return a sentence about the values of the last step."""
    if not is_converged(discount, residual):
        return "The sweeps end here, but the values still change."
    if discount == 1.0:
        return f"The sweeps end: the residual is at most {UNDISCOUNTED_RESIDUAL:g}."
    error = format_upper_bound(bound_error(discount, residual))
    return f"The sweeps end: each V is within {error} of the value of a game without a turn limit."


ALGORITHM = Algorithm(
    "value-iteration",
    "compute the value of each state, one turn more at each step",
    "section 7.5, Value Iteration",
    find_mdp_obstacle,
    iterate_steps,
)
