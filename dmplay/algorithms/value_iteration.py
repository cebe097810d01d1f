"""Value iteration: the values of k turns from those of k - 1 turns, until they stay the same."""

from collections.abc import Iterator

import numpy as np

from dmplay.algorithms.finite_mdp import (
    FiniteMdp,
    build_finite_mdp,
    explain_mdp_misfit,
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
    rewards = "sum of rewards" if mdp.discount == 1.0 else "discounted sum of rewards"
    start = f"V(s), the value of state s, is the best expected return ({rewards}) from it."
    no_turns = "At first no turn is left, and V is 0."
    notes = filter(None, [mdp.note, _describe_terminal(mdp), _describe_turns_left(request)])
    yield Step("start", (start, no_turns, *notes), "", (_draw_state_values(mdp, values),))
    state_count = int(np.count_nonzero(~mdp.terminal))
    last_sweep = request.iterations or MAX_SWEEPS
    for sweep in range(1, last_sweep + 1):
        q = mdp.compute_action_values(values)  # one step of lookahead
        greedy = np.where(mdp.terminal, -1, select_greedy_actions(q, problem.reward_scale))
        previous, values = values, np.where(mdp.terminal, 0.0, q.max(axis=1))  # Bellman backup
        change = np.abs(values - previous)
        residuals.append(float(change.max()))
        is_close = is_converged(mdp.discount, residuals[-1], problem.reward_scale)
        has_converged = is_close and not request.iterations
        is_last = sweep == last_sweep or has_converged
        focus = mdp.choose_formula_state(request.session, change)
        state, action = format_state_name(problem, mdp.states[focus]), int(greedy[focus])
        reason = _describe_choice_of_state(request, mdp, change)
        name = f"{'about ' * bool(mdp.note)}the value of a game"
        turns_sentence = f"V is now {name} with {format_count(sweep, 'turn')} left."
        sentences = (
            *([] if has_converged else [turns_sentence]),
            *(_describe_end(mdp.discount, residuals[-1], problem.reward_scale) if is_last else []),
            f"{np.count_nonzero(change)} of {format_count(state_count, 'value')} changed, by at "
            f"most {format_score(residuals[-1])} ({'called ' * (sweep == 1)}the residual).",
            *_describe_formula_actions(request, mdp, state, action, q[focus], reason),
            *([_describe_formula(mdp.discount)] if sweep == 1 else []),
        )
        formula = mdp.format_lookahead(format_value_name(state), focus, action, previous)
        picture = _draw_state_values(mdp, values, greedy, change, focus)
        curve = Curve("residual", tuple(residuals))
        yield Step(f"sweep {sweep}", sentences, formula, (picture, curve))
        if is_last:
            return


def is_converged(discount: float, residual: float, scale: float = 1.0) -> bool:
    """Return whether values whose last change is `residual` are close to the optimal ones.

    `scale` is that of the rewards.
    """
    if discount == 1.0:
        return residual <= UNDISCOUNTED_RESIDUAL * scale
    return bound_error(discount, residual) <= MAX_ERROR * scale


def bound_error(discount: float, residual: float) -> float:
    """Return the largest possible distance to the optimal values (section 7.5)."""
    return residual * discount / (1.0 - discount)


def _draw_state_values(
    mdp: FiniteMdp,
    values: Reals,
    greedy: Ints | None = None,
    change: Reals | None = None,
    focus: int = -1,
) -> StateValues:
    """Return the values of the drawn states, with the greedy actions."""
    rows = mdp.drawn
    actions = None if greedy is None else greedy[rows]
    changed = None if change is None else change[rows] > 0
    focus_row = int(np.flatnonzero(rows == focus)[0]) if focus in rows else None
    return StateValues(mdp.states[rows], values[rows], actions, changed, focus_row)


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


def _describe_terminal(mdp: FiniteMdp) -> str:
    """Return a sentence about the terminal states, which no step counts; '' if there are none."""
    states = format_count(int(np.count_nonzero(mdp.terminal)), "state")
    note = f"After the end of the game ({states}, not drawn), V stays 0."
    return note if mdp.terminal.any() else ""


def _describe_formula(discount: float) -> str:
    """Return the formula of a sweep in words."""
    factor = "" if discount == 1.0 else f"discount {discount:g} x "
    return f"V = reward now + {factor}sum of (probability x old V of the next state)."


def _describe_choice_of_state(request: WatchRequest, mdp: FiniteMdp, change: Reals) -> str:
    """Return why the formula is about its state: the game is in it, or its V changed most."""
    if request.session is not None and not request.session.over:
        return f"the {'grid point nearest to the ' * bool(mdp.note)}state of the game"
    changes = change[mdp.drawn]
    tied_count = np.count_nonzero(np.isclose(changes, changes.max(), rtol=1e-9, atol=0.0))
    state = f"one of {tied_count} states " if tied_count > 1 else ""
    return f"{state}where V changed most"


def _describe_formula_actions(  # noqa: PLR0913, PLR0917 - the parts of one sentence
    request: WatchRequest, mdp: FiniteMdp, state: str, action: int, q: Reals, reason: str
) -> tuple[str, ...]:
    """Return a sentence about the action of the formula and the second-best one."""
    if action < 0:
        return ()
    name, position = request.problem.format_action(0, action), f"in {state}, {reason}"
    others = np.delete(q, action)
    if not np.isfinite(others).any():
        return (f"The formula is for {name} {position}.",)
    tolerance = VALUE_TOLERANCE * request.problem.reward_scale
    equal_count = np.count_nonzero(others > q[action] - tolerance)
    if equal_count:
        are_good = "1 other action is" if equal_count == 1 else f"{equal_count} other actions are"
        if equal_count == np.count_nonzero(np.isfinite(others)):
            are_good = "all actions are"
        return (f"The formula is for {name} {position}; {are_good} equally good.",)
    second = format_score(float(others.max()))
    return (f"The best action {position}, is {name}; the second-best action is worth {second}.",)


def _describe_end(discount: float, residual: float, scale: float) -> tuple[str, ...]:
    """Return sentences about the values of the last step."""
    if not is_converged(discount, residual, scale):
        return ("The sweeps end here, but the values still change.",)
    if discount == 1.0:
        return (f"The sweeps end: the residual is at most {UNDISCOUNTED_RESIDUAL * scale:.2g}.",)
    error = format_upper_bound(bound_error(discount, residual))
    return (
        f"The sweeps end: later changes sum to at most {discount:g} x residual / "
        f"(1 - {discount:g}), so V without a turn limit is within {error}.",
    )


ALGORITHM = Algorithm(
    "value-iteration",
    "compute the value of each state with 1 turn left, then with 2, and so on",
    "section 7.5, Value Iteration",
    explain_mdp_misfit,
    iterate_steps,
)
