"""A problem as a finite MDP: its states listed, or grid points over states of real numbers."""

from collections.abc import Callable
from math import prod
from typing import NamedTuple

import numpy as np

from dmplay.algorithms.formula_text import format_weighted_sum
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.problem import ContinuousStates, Problem, checked_state_indices, enumerate_outcomes
from dmplay.core.session import Session
from dmplay.core.state_grid import GridAxis, StateGrid
from dmplay.core.tabular import joint_actions, replace_illegal_actions
from dmplay.core.text import format_count, format_score
from dmplay.errors import BadParameter, BudgetExceeded

MAX_OUTCOMES = 4_000_000  # states times actions times outcomes
GRID_POINTS = 61, 57  # of two numbers with bounds


class FiniteMdp(NamedTuple):
    """An MDP with S states and A actions, each with the list of its K possible next states."""

    states: Array  # [S, ...]
    next_states: Ints  # [S, A, K]; a terminal state leads to itself
    probabilities: Reals  # T(s'|s,a) [S, A, K]
    rewards: Reals  # R(s,a) [S, A], expected; -inf for an illegal action
    terminal: Bools  # [S]
    discount: float
    find_index: Callable[[Array], int]  # the index of a state, or of the nearest grid point
    drawn: Ints  # indices of the states that pictures show
    note: str = ""  # how a state of real numbers became a grid

    def compute_action_values(self, values: Reals) -> Reals:
        """Return Q `[S, A]` of one step of lookahead from U `[S]`."""
        expected = (self.probabilities * values[self.next_states]).sum(axis=2)
        return np.asarray(self.rewards + self.discount * expected)

    def format_lookahead(self, name: str, state: int, action: int, values: Reals) -> str:
        """Return one step of lookahead with its numbers, such as `V = 0 + 0.9 (1 x 5) = 4.5`."""
        if self.terminal[state]:
            return f"{name} = 0"
        # A next state that several events lead to is one term.
        next_states, event_states = np.unique(self.next_states[state, action], return_inverse=True)
        p = np.bincount(event_states, self.probabilities[state, action])
        likeliest = np.argsort(-p, kind="stable")[: np.count_nonzero(p)]
        terms = format_weighted_sum(p[likeliest], values[next_states[likeliest]])
        result = self.compute_action_values(values)[state, action]
        factor = "" if self.discount == 1.0 else f"{self.discount:g} "
        return (
            f"{name} = {format_score(self.rewards[state, action] + 0.0)} + "
            f"{factor}({terms}) = {format_score(result)}"
        )

    def choose_formula_state(self, session: Session | None, change: Reals) -> int:
        """Return the state whose formula is shown: that of the game, or the most changed one."""
        if session is not None and not session.over:
            return self.find_index(session.state)
        return int(self.drawn[np.argmax(change[self.drawn])])


def find_grid(problem: Problem) -> StateGrid | None:
    """Return the problem's grid of states, or one over two bounded numbers, or else None."""
    bounds = problem.state_bounds
    if problem.state_grid is not None or bounds is None:
        return problem.state_grid
    if problem.state_count != ContinuousStates(2) or not np.isfinite(bounds).all():
        return None
    points = map(np.linspace, bounds[0], bounds[1], GRID_POINTS)
    return StateGrid(tuple(GridAxis(f"number {i}", axis) for i, axis in enumerate(points, 1)))


def explain_mdp_misfit(problem: Problem) -> str:
    """Return the reason why a problem cannot be listed as an MDP; '' if it can."""
    if len(problem.agents) > 1:
        return "several agents choose; it plans for one agent"
    if problem.partially_observable:
        return "the algorithm needs a state that the agent sees, but the state is hidden"
    if not problem.action_counts[0]:
        return "its actions are real numbers; it needs a list of actions"
    return _explain_size_misfit(problem)


def _explain_size_misfit(problem: Problem) -> str:
    """Return the reason why the states and outcomes of a problem cannot be listed; '' if none."""
    grid, state_count = find_grid(problem), problem.state_count
    if grid is None and isinstance(state_count, ContinuousStates):
        numbers = format_count(state_count.dimensions, "real number")
        return f"its state is {numbers}; a grid needs two numbers with bounds"
    if grid is None and not isinstance(state_count, int):
        return "it has too many states to list"
    try:
        first_state = (problem.enumerate_states() if grid is None else grid.list_states())[:1]
        p, _ = enumerate_outcomes(problem, first_state, np.zeros((1, 1), np.int64))
    except (BadParameter, BudgetExceeded) as error:
        return str(error)
    if grid is None:
        row_count = state_count if isinstance(state_count, int) else 0
    else:
        row_count = prod(grid.shape) * 2 ** sum(axis.is_interpolated for axis in grid.axes)
    too_many = row_count * problem.action_counts[0] * p.shape[1] > MAX_OUTCOMES
    return f"it has {state_count} states, too many to watch" if too_many else ""


def build_finite_mdp(problem: Problem) -> FiniteMdp:
    """Return a problem of one agent as a finite MDP, over grid points if states are real."""
    grid = find_grid(problem)
    states = problem.enumerate_states() if grid is None else grid.list_states()
    choices, terminal = joint_actions(problem), problem.terminal(states)
    next_states, probabilities, rewards = [], [], []
    for choice in choices:
        a = np.tile(choice, (len(states), 1))
        legal_a = replace_illegal_actions(problem, states, a)
        p, outcome = enumerate_outcomes(problem, states, legal_a)
        reached = outcome.state.reshape(-1, *outcome.state.shape[2:])
        if grid is None:
            corners = checked_state_indices(problem, reached)[:, None]
            weights = np.ones(corners.shape)
        else:
            corners, weights = grid.find_corners(reached)
        corners = corners.reshape(len(states), -1)
        corners[terminal] = np.flatnonzero(terminal)[:, None]
        next_states.append(corners)
        probabilities.append((p[:, :, None] * weights.reshape(*p.shape, -1)).reshape(len(p), -1))
        expected = (p * outcome.rewards[:, :, 0]).sum(axis=1)
        expected[terminal] = 0.0
        rewards.append(np.where((legal_a == a).all(axis=1), expected, -np.inf))
    return FiniteMdp(
        states,
        np.stack(next_states, axis=1),
        np.stack(probabilities, axis=1),
        np.stack(rewards, axis=1),
        terminal,
        problem.discount,
        lambda s: _find_index(problem, grid, s),
        np.arange(len(states)) if grid is None else np.flatnonzero(grid.mark_drawn_states()),
        _describe_grid(grid),
    )


def _find_index(problem: Problem, grid: StateGrid | None, s: Array) -> int:
    """Return the index of a state, or of the grid point with the greatest weight."""
    if grid is None:
        return int(problem.state_indices(s[None])[0])
    corners, weights = grid.find_corners(s[None])
    return int(corners[0, np.argmax(weights[0])])


def _describe_grid(grid: StateGrid | None) -> str:
    """Return a sentence about the grid; '' if the states are listed."""
    if grid is None:
        return ""
    points = " x ".join(map(str, grid.shape))
    note = f"V is interpolated between {points} grid points; the weights are the probabilities."
    return f"{note} {grid.note}".rstrip()


def format_state_name(problem: Problem, state: Array) -> str:
    """Return a state in few characters, such as `(5,2)`, `open` or `(-0.5, 0.01)`."""
    if state.dtype.kind != "f":
        return problem.format_state(state)
    return f"({', '.join(f'{number:.3g}' for number in state)})"


def format_value_name(state_name: str) -> str:
    """Return the name of a state's value in formulas, such as `V(5,2)` or `V(open)`."""
    return f"V{state_name}" if state_name.startswith("(") else f"V({state_name})"
