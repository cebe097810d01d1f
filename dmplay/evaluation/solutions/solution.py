"""The solution of a problem: numbers with labels, and the text that is made from them."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from dmplay.agents.base import AdviceQuestion, SeatPolicy, bound_action_values, bound_best_number
from dmplay.core import belief as beliefs
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE, mark_best_actions
from dmplay.core.data_frames import make_frame
from dmplay.core.policy import Memory
from dmplay.core.problem import (
    Problem,
    checked_state_indices,
    find_seat,
    initial_state_distribution,
)
from dmplay.core.text import format_count
from dmplay.core.typed_text import list_state_names, parse_state, read_belief
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.registry.problem_module_exports import get_problem_name

if TYPE_CHECKING:  # Solving and printing need no positions.
    from dmplay.game.position import Position
    from dmplay.registry.agents import AgentLike

MIN_SHOWN_PROBABILITY = 1e-4  # Smaller probabilities of approximate strategies are left out.

Row = dict[str, object]
# A state, the probability of each hidden state, or the text of either; None is the start.
At = str | float | Array | Sequence[float] | Mapping[str, float] | None
AgentMaker = Callable[..., SeatPolicy]


@dataclass(frozen=True, repr=False)
class Solution:
    """A method, its result in words, its numbers in a table, and the agent that knows the values.

    `table` has a row for each state, vector, plan or equilibrium. A cell is a text, a number, None,
    a mark (True or False), the names of some actions (a tuple), or a mapping: of actions to their
    probabilities, or of observations to the next nodes of a plan. `rows` are the same rows as text.
    `agent` knows the values: its name, its class, or a function of the problem and a seat.
    """

    method: str
    result: str = ""
    table: Sequence[Mapping[str, Any]] = ()
    agent: "AgentLike | None" = field(default=None, compare=False)
    accuracy: Accuracy = Accuracy.UNKNOWN
    error: float = 0.0  # maximum distance of the values from the exact ones
    start_values: tuple[float, ...] = ()  # the value at the start to each agent; () if unknown
    start_bounds: tuple[float, float] | None = None  # on the value at the start to every agent
    equilibria: "tuple[Solution, ...]" = ()  # each equilibrium of one round as a solution
    problem: Problem | None = field(default=None, compare=False)  # `solve` sets it

    def __repr__(self) -> str:
        """Return the method, the result and the size of the table in one line."""
        name = "" if self.problem is None else f" of {get_problem_name(self.problem)}"
        size = format_count(len(self.table), "row")
        return f"<Solution{name}, {self.method}: {self.result}; {size}>"

    @property
    def rows(self) -> list[Row]:
        """The table as texts and plain numbers, as it is printed."""
        return [{name: format_cell(cell) for name, cell in row.items()} for row in self.table]

    def to_frame(self, library: str = "") -> Any:
        """Return the table as a data frame of pandas or polars, whichever is installed.

        The cells of a strategy or plan become columns of their own, such as `agent1 rock`.
        """
        return make_frame([_expand_row(row) for row in self.table], library)

    def value(self, at: At = None, seat: int | str = 0, turns_left: int | None = None) -> float:
        """Return the value to a seat at a state or belief; at the start if there is none.

        Raise BadParameter if the solution has no values there.
        """
        if at is None and turns_left is None and self.start_values:
            return self.start_values[find_seat(self._known_problem, seat)]
        if at is None and not self._known_problem.partially_observable:
            return self._compute_start_value(find_seat(self._known_problem, seat), turns_left)
        position = self.position(at, seat, turns_left)
        if _is_over(position):
            return 0.0
        legal = position.view.legal_actions_mask
        legal = None if legal is None else legal[None]
        return float(
            self._compute_values(self._find_policy(position.seat), position.memory, legal)[0]
        )

    def bounds(
        self, at: At = None, seat: int | str = 0, turns_left: int | None = None
    ) -> tuple[float, float]:
        """Return a lower and an upper bound on the value to a seat; both are an exact value.

        Raise BadParameter if the solution has no bounds there.
        """
        if at is None and turns_left is None and self.start_bounds:
            return self.start_bounds
        if self.accuracy is Accuracy.EXACT:
            value = self.value(at, seat, turns_left)
            return value - self.error, value + self.error
        policy = self._find_policy(find_seat(self._known_problem, seat))
        if self.accuracy is Accuracy.LOWER_BOUND:
            position = self.position(at, seat, turns_left)
            bounds = _bound_values(policy, position.memory, position.view.legal_actions_mask)
            if bounds is not None:
                return float(bounds[0][0]), float(bounds[1][0])
        raise BadParameter(f"no bounds ({self.method}): it has {self.accuracy.words} alone")

    def action_values(
        self, at: At = None, seat: int | str = 0, turns_left: int | None = None
    ) -> Reals:
        """Return the value `[A]` of each action of a seat, in the order of its labels.

        It is nan for illegal actions. Raise BadParameter if the solution has no such values there.
        """
        return self._compute_q(self.position(at, seat, turns_left))

    def best_actions(
        self, at: At = None, seat: int | str = 0, turns_left: int | None = None
    ) -> list[str]:
        """Return the names of the actions of greatest value to a seat at a state or belief."""
        position = self.position(at, seat, turns_left)
        q = np.nan_to_num(self._compute_q(position), nan=-np.inf)
        marks = mark_best_actions(q, self._known_problem.reward_scale)
        return [position.labels[a] for a in np.flatnonzero(marks)]

    def policy(self, at: At = None, seat: int | str = 0, turns_left: int | None = None) -> Reals:
        """Return the probability `[A]` with which the solution plays each action of a seat."""
        position = self.position(at, seat, turns_left)
        probabilities = self._find_policy(position.seat).choice_probabilities(position.memory)
        if probabilities is None:
            raise self._make_error("its policy has no probabilities of actions")
        return np.asarray(probabilities[0])

    def position(
        self, at: At = None, seat: int | str = 0, turns_left: int | None = None
    ) -> "Position":
        """Return the position of a seat at a state or belief, with the agent of the solution.

        Without `at`, it is the start, which must be a single state if agents see the state. Without
        `turns_left`, as many turns are left as the solution plans.
        """
        from dmplay.game.position import Position
        from dmplay.registry.agents import HintAgent

        problem, seat = self._known_problem, find_seat(self._known_problem, seat)
        policy = self._find_policy(seat)
        question = AdviceQuestion(seat, getattr(policy, "game_turns", None))
        agent = HintAgent(self.method, policy, question)
        turns_done = _count_turns_done(policy, turns_left)
        if not problem.partially_observable:
            state = self._find_start_state() if at is None else _read_state(problem, at)
            return Position.at_state(problem, question, agent, state, turns_done)
        start = Position.after_history(problem, question, agent, [])
        if policy.current_belief(start.memory) is None:
            if at is None and not turns_done:
                return start
            raise self._make_error("its agents act on what they observed, not on a belief")
        belief = _find_start_belief(problem, seat) if at is None else _read_belief(problem, at)
        return Position.at_belief(problem, question, agent, belief, turns_done)

    @property
    def _known_problem(self) -> Problem:
        """The problem; raise BadParameter if the solution is not one that `solve` returned."""
        if self.problem is None:
            raise BadParameter("this Solution has no problem yet; solve(problem) sets it")
        return self.problem

    @cached_property
    def _policies(self) -> dict[int, SeatPolicy]:
        """The policies made so far, by seat."""
        return {}

    def _find_policy(self, seat: int) -> SeatPolicy:
        """Return the policy that knows the values of a seat; raise BadParameter if none does."""
        if len(self.equilibria) > 1:
            count = len(self.equilibria)
            raise self._make_error(f"there are {count} equilibria; ask solution.equilibria[0]")
        if self.agent is None:
            raise self._make_error("it computes none; its numbers are in solution.table")
        if seat not in self._policies:
            from dmplay.registry.agents import load_agent

            policy = load_agent(self._known_problem, seat, self.agent)
            if not isinstance(policy, SeatPolicy):
                got = f"agent: got {type(policy).__name__}"
                raise BadParameter(f"{got}, expected an agent that inherits from dmplay.SeatPolicy")
            self._policies[seat] = policy
        return self._policies[seat]

    def _list_start_states(self) -> tuple[Reals, Array]:
        """Return the states in which games start, with their probabilities."""
        try:
            return initial_state_distribution(self._known_problem)
        except (BadParameter, BudgetExceeded):
            raise BadParameter("games start in a random state; name a state") from None

    def _find_start_state(self) -> Array:
        """Return the only start state; raise BadParameter if there are several."""
        _, states = self._list_start_states()
        count = len({self._known_problem.format_state(s) for s in states})
        if count != 1:
            raise BadParameter(f"games start in one of {count} states; name a state")
        return np.asarray(states[0])

    def _compute_start_value(self, seat: int, turns_left: int | None) -> float:
        """Return the mean value to a seat over the states in which games start."""
        problem, policy = self._known_problem, self._find_policy(seat)
        probabilities, states = self._list_start_states()
        memory = policy.memory_at_turn(states, _count_turns_done(policy, turns_left))
        legal = problem.legal_actions_mask(states)
        seat_legal = None if legal is None else legal[:, seat]
        values = self._compute_values(policy, memory, seat_legal)
        return float(probabilities @ np.where(problem.terminal(states), 0.0, values))

    def _compute_values(self, policy: SeatPolicy, memory: Memory, legal: Bools | None) -> Reals:
        """Return the value `[B]` of each row of a memory, with legal actions `[B, A]`."""
        q = policy.action_values(memory)
        p = policy.choice_probabilities(memory) if policy.uniform_count else None
        if q is not None and p is not None:  # a mixed strategy need not choose the best actions
            return np.asarray((p * np.where(p > 0.0, q, 0.0)).sum(axis=1))
        if q is not None or type(policy).state_values is not SeatPolicy.state_values:
            return policy.state_values(memory, legal)
        bounds = _bound_values(policy, memory, legal)
        tolerance = VALUE_TOLERANCE * policy.problem.reward_scale
        if bounds is not None and np.allclose(*bounds, atol=tolerance):
            return bounds[0]
        raise self._make_error(f"the agent {type(policy).__name__} has none")

    def _compute_q(self, position: "Position") -> Reals:
        """Return the value `[A]` of each action in a position, nan if it is illegal."""
        policy = self._find_policy(position.seat)
        q = policy.action_values(position.memory) if position.labels else None
        if q is None:
            reason = f"the agent {type(policy).__name__} has none of actions"
            raise self._make_error(reason if position.labels else "actions are real numbers")
        return np.where(position.legal_actions_mask, 0.0 if _is_over(position) else q[0], np.nan)

    def _make_error(self, reason: str) -> BadParameter:
        """Return the error that the solution has no such values, with the reason."""
        return BadParameter(f"no values ({self.method}): {reason}")


def _bound_values(
    policy: SeatPolicy, memory: Memory, legal: Bools | None
) -> tuple[Reals, Reals] | None:
    """Return a lower and an upper bound `[B]` of the value of the best action; None if unknown.

    `legal` is `[B, A]` or `[A]`.
    """
    if not policy.problem.actions[policy.seat].labels:
        best = bound_best_number(policy, memory, legal)
        return None if best is None else (best[0], best[1])
    bounds = bound_action_values(policy, memory)
    if bounds is None:
        return None
    lower, upper = (bounds if legal is None else np.where(legal, bounds, -np.inf)).max(axis=-1)
    return lower, upper


def _count_turns_done(policy: SeatPolicy, turns_left: int | None) -> int:
    """Return the turns done of the planned ones; raise BadParameter if more are left."""
    turns: int | None = getattr(policy, "game_turns", None)
    if turns_left is not None and turns_left not in range(1, (turns or 0) + 1):
        expected = f"1 to {turns}" if turns else "None, as the horizon is infinite"
        raise BadParameter(f"turns_left: got {turns_left!r}, expected {expected}")
    return (turns or 0) - (turns_left or turns or 0)


def _is_over(position: "Position") -> bool:
    """Return whether agents see in a position that the game is over."""
    problem = position.problem
    return not problem.partially_observable and bool(problem.terminal(position.state[None])[0])


def _read_state(problem: Problem, at: At) -> Array:
    """Return the state that a text, number or array names; raise BadParameter if it is none."""
    if isinstance(at, str):
        return parse_state(problem, at)
    start = problem.sample_initial_states(np.zeros((1, problem.uniform_counts.start)))[0]
    state = np.asarray(at)
    if state.shape != start.shape or (start.dtype.kind in "if" and state.dtype.kind not in "iuf"):
        expected = f"a state such as {problem.format_state(start)!r}"
        raise BadParameter(f"got {at!r}, expected {expected}")
    checked_state_indices(problem, state[None])
    return state


def _find_start_belief(problem: Problem, seat: int) -> Reals:
    """Return the belief `[S]` of a seat at the start; raise BadParameter if there are several."""
    belief = beliefs.initial_belief(problem)
    observations = problem.initial_observations(problem.enumerate_states()[belief > 0.0])[:, seat]
    if (observations != observations[0]).any():
        raise BadParameter("games start with an observation; name a belief")
    return belief


def _read_belief(problem: Problem, at: At) -> Reals:
    """Return the belief `[S]` of an array, a mapping or a text; a state's name is certainty."""
    if isinstance(at, str) and at in list_state_names(problem):
        at = {at: 1.0}
    return read_belief(problem, at)


def check_solution(problem: Problem, returned: Any) -> Solution:
    """Return the solution that a problem's code returned; raise BadParameter if it is invalid."""
    if not isinstance(returned, Solution):
        expected = "expected a Solution, or None for a general method"
        raise BadParameter(f"returned {type(returned).__name__}, {expected}")
    fields: dict[str, Any] = vars(returned)  # of any types
    table, agent, values = fields["table"], fields["agent"], fields["start_values"]
    is_table = isinstance(table, Sequence) and all(
        isinstance(row, Mapping) and [*row] == [*table[0]] and {*map(type, row)} <= {str}
        for row in table
    )
    if not (is_table and isinstance(fields["method"], str) and isinstance(fields["result"], str)):
        expected = "expected two texts, method and result, and a table of rows with equal columns"
        raise BadParameter(f"returned an invalid Solution, {expected}")
    for cell in (cell for row in table for cell in row.values()):
        if not _is_valid_cell(cell):
            expected = "expected texts, numbers, None, tuples of names, or names with numbers"
            raise BadParameter(f"returned a table with {cell!r}, {expected}")
    if not (agent is None or isinstance(agent, str | SeatPolicy) or callable(agent)):
        expected = "expected an agent: its name, class, function or object"
        raise BadParameter(f"returned the agent {agent!r}, {expected}")
    if not isinstance(fields["accuracy"], Accuracy):
        got = f"returned the accuracy {fields['accuracy']!r}"
        raise BadParameter(f"{got}, expected a member of dmplay.Accuracy, such as Accuracy.EXACT")
    if not isinstance(values, Sequence) or len(values) not in {0, len(problem.agents)}:
        expected = f"expected one number for each of {len(problem.agents)} agents"
        raise BadParameter(f"returned the start_values {values!r}, {expected}")
    return returned


def _is_valid_cell(cell: object) -> bool:
    """Return whether a cell is a text, a number, None, a tuple of names, or names with numbers."""
    if isinstance(cell, tuple):
        return all(isinstance(name, str) for name in cell)
    if isinstance(cell, Mapping):
        return all(isinstance(key, str) and np.isscalar(cell[key]) for key in cell)
    return isinstance(cell, str | int | float | np.generic | None)


def format_cell(cell: object) -> object:
    """Return a cell of a table as text or as a plain number."""
    if isinstance(cell, np.generic):
        cell = cell.item()
    if isinstance(cell, bool):
        return "*" if cell else ""
    if isinstance(cell, tuple):
        return " ".join(cell)
    if not isinstance(cell, Mapping):
        return cell
    if all(isinstance(number, int) for number in cell.values()):
        return " ".join(f"{name}:{number}" for name, number in cell.items())
    return " ".join(f"{name} {p:.4g}" if len(cell) > 1 else name for name, p in cell.items())


def _expand_row(row: Mapping[str, object]) -> Row:
    """Return a row of a table with a column for each entry of its mappings."""
    expanded: Row = {}
    for name, cell in row.items():
        if isinstance(cell, Mapping):
            expanded |= {f"{name} {label}": number for label, number in cell.items()}
        else:
            expanded[name] = cell if isinstance(cell, bool) else format_cell(cell)
    return expanded


def make_informed_agent(
    agent_class: type[SeatPolicy], property_values: Mapping[str, object], **parameters: object
) -> AgentMaker:
    """Return the function that makes agents which need not compute what is known already.

    `property_values` has the values of their cached properties, by name.
    """

    def make_agent(problem: Problem, seat: int) -> SeatPolicy:
        """Return the agent of a seat."""
        policy = agent_class(problem, seat, **parameters)
        vars(policy).update(property_values)
        return policy

    return make_agent


def list_marked_actions(problem: Problem, marks: Bools, seat: int = 0) -> tuple[str, ...]:
    """Return the names of a seat's marked actions."""
    return tuple(problem.actions[seat].labels[a] for a in np.flatnonzero(marks))


def list_probabilities(
    problem: Problem,
    seat: int,
    probabilities: Reals,
    min_probability: float = MIN_SHOWN_PROBABILITY,
) -> dict[str, float]:
    """Return the actions that a strategy plays with more than `min_probability`, by name.

    It is 0 for exact strategies.
    """
    actions = np.flatnonzero(probabilities > min_probability)
    return {problem.format_action(seat, float(a)): float(probabilities[a]) for a in actions}
