"""Hints: the recommended action of a strong agent for a seat, and that agent's action values."""

import inspect
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor, isfinite, log10
from typing import TypeVar

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import UNKNOWN_BASIS, Accuracy, ActionValues, ValuesBasis
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.session import SeatedPolicy, Session, Turn
from dmplay.core.spaces import Interval
from dmplay.core.work_budget import limit_total_work
from dmplay.draw.options import Forecast, Overlay
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.game.hints.action_simulation import (
    GAME_COUNT,
    MAX_TURNS,
    SimulatedGames,
    can_simulate,
    play_on,
)
from dmplay.game.hints.forecast_text import format_forecast
from dmplay.game.position import ADVICE_WORK_LIMIT, Position
from dmplay.registry import agents

T = TypeVar("T")
MAX_LISTED_VALUES = 10  # maximum number of listed action values
TOO_CLOSE = "too close to call"
SAMPLED_VALUES = "mean return (standard error)"
HINT_OVERLAYS = ("values", "policy")  # overlays that count as hints
MIN_DECIMALS, MAX_DECIMALS = 2, 6  # decimals of printed values
MIN_FIXED = 1e-4  # smaller values are printed with an exponent
MAX_SUMMARY_CHARS = 120  # a longer hint leaves the assumptions to its explanation
SAME_BOUND_SHARE = 0.01  # bounds that differ by a smaller share of their range are not told apart
ASSUMPTIONS_HELP = "why lists its assumptions"
WHOLE_NUMBER_SPREAD = 100.0  # values that differ by this or more are printed without decimals
INTERVAL_RESOLUTION = 1e-4  # resolution of a printed real-valued action, as a share of its interval


def choose_decimals(values: Sequence[float], scale: float = 1.0) -> int:
    """Return the number of decimals, at least 2, at which the largest difference of values shows.

    Equal values are compared with zero instead; nan and infinite values are ignored. There are at
    most 6 decimals, unless these would show nothing of the largest value. `scale` is that of the
    problem's rewards.
    """
    spread = _measure_value_range(values, scale)
    decimals = max(1 - floor(log10(spread)), MIN_DECIMALS) if spread else MIN_DECIMALS
    largest = max((abs(value) for value in values if isfinite(value)), default=0.0)
    return decimals if largest < MIN_FIXED else min(decimals, MAX_DECIMALS)


def choose_hint_decimals(values: Sequence[float], scale: float = 1.0) -> int:
    """Return the decimals for values: 0 for whole numbers and for spreads of 100 or more.

    Otherwise it is that of `choose_decimals`.
    """
    are_integers = all(
        abs(value - round(value)) < VALUE_TOLERANCE * scale for value in values if isfinite(value)
    )
    return (
        0
        if are_integers or _measure_value_range(values, scale) >= WHOLE_NUMBER_SPREAD
        else choose_decimals(values, scale)
    )


def _measure_value_range(values: Sequence[float], scale: float) -> float:
    """Return the range of the finite values, or the absolute value if they are all equal.

    A number that is only a rounding error counts as 0.
    """
    finite = [value for value in values if isfinite(value)] or [0.0]
    noise = VALUE_TOLERANCE * scale
    spread = max(finite) - min(finite)
    size = spread if spread > noise else abs(finite[0])
    return size if size > noise else 0.0


def format_fixed(value: float, decimals: int) -> str:
    """Return a value as text with this number of decimals, never as a negative zero.

    With more than 6 decimals the text has an exponent, as `4.31e-09`.
    """
    if decimals > MAX_DECIMALS:
        digits = max(decimals + floor(log10(abs(value))), 0) if value else 0
        return f"{value:.{digits}e}" if value else "0"
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


@dataclass(frozen=True, eq=False)
class Hint:
    """The recommended action before a turn, and the action values if the agent has them."""

    basis: str  # the agent's name, then the game and the assumptions of its values
    recommended_action: str  # its name; a real action is rounded
    labels: Sequence[str]
    values: ActionValues | None
    action: float | None = None  # the recommended action; None if several are equally good
    action_name: str = ""  # the name of `action` with all digits
    game: str = ""  # the turns and the other players that the values are about
    short_basis: str = ""  # the basis without the assumptions of the agent; '' if it has none

    def __str__(self) -> str:
        """Return the hint on one line."""
        lists_values = self.action is None and self.values and self.values.is_too_close
        return ". ".join(filter(None, (self.summary, "" if lists_values else self.values_text)))

    @property
    def summary(self) -> str:
        """The hint without values."""
        return f"hint by {self._shorten_basis()}: {self._choice_text}"

    def name_key(self, key: str) -> str:
        """Return the summary for a screen, with the key of the recommended action.

        It begins with the action, because the end may be cut.
        """
        name, choice = self.recommended_action, self._choice_text
        if self.action is not None and key not in {"", name}:
            choice = choice.replace(name, f"press {key} ({name})", 1)
        return f"hint: {choice}, by {self._shorten_basis()}"

    def _shorten_basis(self) -> str:
        """Return the name of the agent and the game, with its assumptions if these are short."""
        is_long = len(self.recommendation) > MAX_SUMMARY_CHARS
        basis = self.short_basis if is_long and self.short_basis else self.basis
        agent, _, details = basis.partition(", ")
        return f"{agent} ({details})" if details else agent

    @property
    def recommendation(self) -> str:
        """The recommended action after the name of the agent and its assumptions."""
        name, _, details = self.basis.partition(", ")
        return f"by {name}{f' ({details})' if details else ''}: {self._choice_text}"

    @property
    def _choice_text(self) -> str:
        """The recommended action, and those that bounds do not tell from it."""
        close = self._list_close_actions()
        is_any = len(close) == len(self._actions_by_value)
        text = f"{'every action' if is_any else ' or '.join(close)}: no real difference"
        return f"{self.recommended_action}; {text}" if close else self.recommended_action

    def _list_close_actions(self) -> list[str]:
        """Return the recommended action and those that bounds do not tell from it; [] if none."""
        basis = self.values_basis
        has_close = basis.accuracy.is_bound or basis.resolution > 0.0
        if self.values is None or self.action is None or not has_close:
            return []
        actions, q = self._actions_by_value, self.values.q
        least = max(SAME_BOUND_SHARE * np.ptp(q[actions]), basis.resolution)
        close = [a for a in actions if abs(q[a] - q[int(self.action)]) <= least]
        return [self.labels[action] for action in close] if len(close) > 1 else []

    @cached_property
    def values_text(self) -> str:
        """The list of action values as text; '' if there are none."""
        return self._format_values_text("")

    @property
    def full_values_text(self) -> str:
        """The list of action values as text, with the game that they are about."""
        return self._format_values_text(self.game)

    def _format_values_text(self, game: str) -> str:
        """Return the list of action values as text after their name and the game."""
        value_list = ", ".join(
            f"{label} {number}" for label, number in self._format_values(ordered=False)
        )
        has_errors = self.values is not None and self.values.errors is not None
        name = SAMPLED_VALUES if has_errors else self.values_basis.accuracy.words
        about = f"{', ' if has_errors else ' ('}{game}{')' * (not has_errors)}" if game else ""
        return value_list and f"{name}{about}: {value_list}"

    @property
    def data(self) -> dict[str, object]:
        """The hint as data: the agent, the action, and the finite values by action."""
        return {
            "by": self.basis,
            "action": self.action_name or None,
            **({} if self.action_name else {"reason": self.recommended_action}),
            **self.values_data,
            **({"about": self.game} if self.game else {}),
            **self.values_basis.accuracy.data,
        }

    @property
    def values_data(self) -> dict[str, dict[str, float]]:
        """The finite values by action, with the standard errors of estimates by sampling."""
        if self.values is None:
            return {"values": {}}
        errors = self.values.errors
        data = {"values": self.values.q} | ({} if errors is None else {"standard_errors": errors})
        return {
            name: {
                label: number
                for label, number in zip(self.labels, numbers.tolist(), strict=True)
                if isfinite(number)
            }
            for name, numbers in data.items()
        }

    @property
    def values_basis(self) -> ValuesBasis:
        """The basis of the values."""
        return self.values.basis if self.values else UNKNOWN_BASIS

    @property
    def regrets(self) -> Reals | None:
        """The best value minus the value of each action `[A]`; nan for illegal actions.

        Differences within the errors of the values are 0. None if the agent has no values, if they
        assume how the other agents play, or if they have sampling errors.
        """
        if self.values is None or self.values.errors is not None:
            return None
        basis, regrets = self.values.basis, self.values.regrets
        regrets = np.where(regrets <= basis.resolution, 0.0, regrets)
        return regrets if basis.has_regrets else None

    @property
    def ranked_actions(self) -> list[tuple[int, float]]:
        """The legal actions with their regrets, smallest first; of equals, the recommended one
        first. Empty if there are no regrets.
        """
        regrets = self.regrets
        if regrets is None:
            return []
        return [(action, float(regrets[action])) for action in self._actions_by_value]

    @cached_property
    def _actions_by_value(self) -> list[int]:
        """The legal actions, best first."""
        return self.values.rank_actions(self.action) if self.values else []

    @cached_property
    def value_decimals(self) -> int:
        """The number of decimals of the values on the line of the hint."""
        if self.values is None:
            return MIN_DECIMALS
        if self.values.basis.accuracy is Accuracy.RATING:
            return 0
        listed = self.values.q[self._actions_by_value[:MAX_LISTED_VALUES]]
        return choose_decimals(listed.tolist(), self.values.scale)

    @cached_property
    def value_rows(self) -> list[tuple[str, str]]:
        """The best actions with their values as text, best first."""
        return self._format_values(ordered=True)

    def _format_values(self, *, ordered: bool) -> list[tuple[str, str]]:
        """Return (action, value) texts with enough decimals to distinguish the values.

        At most the 10 best actions are listed, by value if `ordered` is true, some are omitted or
        they have standard errors, else in the problem's order.
        """
        best_first = self._actions_by_value
        if self.values is None or not best_first:
            return []
        errors = self.values.errors
        order = (
            best_first[:MAX_LISTED_VALUES]
            if ordered or errors is not None or len(best_first) > MAX_LISTED_VALUES
            else sorted(best_first)
        )
        listed = self.values.q[order].tolist()
        listed_errors = [] if errors is None else errors[order].tolist()
        are_short = ordered or self.values.basis.accuracy is Accuracy.RATING
        count = choose_hint_decimals if are_short and errors is None else choose_decimals
        decimal_count = count([*listed, *listed_errors], self.values.scale)
        numbers = [format_fixed(value, decimal_count) for value in listed]
        for index, error in enumerate(listed_errors):
            error_text = format_fixed(error, decimal_count) if isfinite(error) else "unknown"
            numbers[index] += f" ({error_text})"
        return [
            (self.labels[action], number) for action, number in zip(order, numbers, strict=True)
        ]


class HintProvider:
    """An agent that answers a question about the game of a session, without playing in it."""

    def __init__(self, session: Session, question: AdviceQuestion) -> None:
        self.session = session
        self.question = question
        self.seat = question.seat
        self._position: Position | None = None
        self._turn_of_position: Turn | None = None
        self._seated: SeatedPolicy | None = None
        # with turn count and last turn
        self._cached_hint: tuple[int, Turn | None, Hint] | None = None
        self._cached_forecast: tuple[int, Turn | None, Forecast] | None = None
        self._cached_state_values: tuple[int, Reals | None] | None = None  # with turn count

    @property
    def position(self) -> Position:
        """The position of this turn, with the agent that gives the hints."""
        before, (turn_count, last_turn) = self._position, self._turn_key
        if before is None:
            agent = agents.find_hint_provider(self.session.problem, self.question)
        elif before.turns_done == turn_count and self._turn_of_position is last_turn:
            return before
        else:
            agent = before.agent
        memory = None
        if agent is not None:
            if self._seated is None or self._seated.policy is not agent.policy:
                self._seated = SeatedPolicy(self.session, self.seat, agent.policy)
            with suppress(BadPolicy, BudgetExceeded), limit_total_work(ADVICE_WORK_LIMIT):
                memory = self._seated.current_memory()
        self._position = Position.with_agent(self.session, self.question, agent, memory)
        self._turn_of_position = last_turn
        return self._position

    @property
    def _hint_agent(self) -> agents.HintAgent | None:
        """The agent that gives the hints, or None."""
        return self.position.agent

    @property
    def name(self) -> str | None:
        """The name of the hint agent; None if there is none."""
        return self._hint_agent.name if self._hint_agent else None

    def explain_unavailable(self) -> str:
        """Return the reason why no hints are available; '' if they are."""
        if self.session.over:
            return "the game is over"
        return (
            ""
            if self._hint_agent
            else "no agent can give hints in this game; dmplay info lists the agents"
        )

    def create_hint(self) -> str:
        """Return a hint for this turn as text: the recommended action and the value of each legal
        one.
        """
        reason = self.explain_unavailable()
        if reason:
            return f"no hint: {reason}"
        position = self.position
        action, estimates = position.choose()
        hint = Hint(
            self._describe_basis(position),
            _format_recommendation(position, action, estimates),
            position.labels,
            position.values() if estimates is None else estimates,
            action,
            "" if action is None else position.format_action(action),
            self.describe_game(),
            self._describe_short_basis(position),
        )
        self._cached_hint = (*self._turn_key, hint)
        return str(hint)

    @property
    def current_hint(self) -> Hint | None:
        """The hint that was created for this turn; None if there is none."""
        return self._get_if_current(self._cached_hint)

    def forecast_action(self, action: float) -> str:
        """Return the possible outcomes of an action as text, and store them for the board.

        Raise BadParameter if the game is over.
        """
        if self.session.over:
            raise BadParameter("whatif: the game is over")
        result = self.position.forecast(action)
        self._cached_forecast = (*self._turn_key, result)
        return format_forecast(self.position, result)

    def simulate_action(self, action: float) -> SimulatedGames | None:
        """Return simulated games of an action and the hint agent's choices after it.

        None if other agents play or states are hidden.
        """
        if not can_simulate(self.session.problem):
            return None
        return play_on(self.position, GAME_COUNT, [action], MAX_TURNS)

    @property
    def agent_description(self) -> str:
        """The name of the hint agent and its description's first sentence; '' without an agent."""
        if self._hint_agent is None:
            return ""
        doc = inspect.getdoc(type(self._hint_agent.policy)) or ""
        sentence = " ".join(doc.partition("\n\n")[0].split()).rstrip(".")
        return f"{self._hint_agent.base_name} {sentence[:1].lower()}{sentence[1:]}".rstrip()

    def clear_forecast(self) -> None:
        """Remove the stored forecast."""
        self._cached_forecast = None

    @property
    def current_forecast(self) -> Forecast | None:
        """The forecast that was created for this turn; None if there is none."""
        return self._get_if_current(self._cached_forecast)

    def _get_if_current(self, cached: tuple[int, Turn | None, T] | None) -> T | None:
        """Return the cached value if its turn is still to be played; else None."""
        if cached is None or self.session.over:
            return None
        turn_count, last_turn, value = cached
        current_key = self._turn_key
        return value if turn_count == current_key[0] and last_turn is current_key[1] else None

    @property
    def _turn_key(self) -> tuple[int, Turn | None]:
        """The turn count and the last turn, None at the start, which identify the current turn."""
        turns = self.session.turns
        return len(turns), turns[-1] if turns else None

    def describe_choice(self) -> str:
        """Return the name of the hint agent and its recommended action."""
        position = self.position
        recommendation = _format_recommendation(position, *position.choose())
        return Hint(self._describe_basis(position), recommendation, (), None).recommendation

    def _describe_basis(self, position: Position) -> str:
        """Return the hint agent, the game and method of its values, its estimates and tie rule."""
        assert position.agent
        with limit_total_work(ADVICE_WORK_LIMIT):
            basis = position.agent.basis
            is_tie = bool(basis.tie_rule) and len(position.best_actions()) > 1
            name, _, method = (basis.method or position.agent.base_name).partition(", ")
            parts = [
                name,
                self.describe_game(),  # before the longer texts, which a narrow screen cuts
                method,
                self.describe_model(),
                basis.tie_rule if is_tie else "",
            ]
        return ", ".join(filter(None, parts))

    def _describe_short_basis(self, position: Position) -> str:
        """Return the hint agent and the game of its values; '' if that is all there is to tell."""
        assert position.agent
        method = position.agent.basis.method or position.agent.base_name
        name, _, assumptions = method.partition(", ")
        parts = [name, self.describe_game(), ASSUMPTIONS_HELP]
        return ", ".join(filter(None, parts)) if assumptions else ""

    def format_values(self) -> Hint:
        """Return the value of each legal action, without a recommendation."""
        position = self.position
        return Hint("", "", position.labels, position.values(), game=self.describe_game())

    @property
    def values_basis(self) -> ValuesBasis:
        """The basis of the hint agent's values."""
        return self._hint_agent.basis if self._hint_agent else UNKNOWN_BASIS

    def values_by_action(self) -> dict[str, float]:
        """Return the value of each legal action by label; {} if there are only estimates with
        errors, or none.
        """
        hint = self.format_values()
        return {} if hint.values and hint.values.errors is not None else hint.values_data["values"]

    def build_overlay(self, kind: str, turns_done: int | None = None) -> Overlay | None:
        """Return an overlay of this kind with the values of all states; None if there are none.

        They are the values after `turns_done` turns, by default those of the session. After the
        last turn there are neither values nor a policy.
        """
        turn_count = len(self.session.turns) if turns_done is None else turns_done
        limit = self.question.turn_limit
        has_ended = limit is not None and turn_count >= limit
        if not kind or (has_ended and kind in HINT_OVERLAYS):
            return None
        values = self._compute_all_state_values(turn_count)
        return None if values is None else Overlay(kind, values)

    @property
    def is_overlay_ready(self) -> bool:
        """True if the values of all states have been computed."""
        return self._cached_state_values is not None

    def prepare_overlay(self) -> None:
        """Compute the values of all states, for overlays."""
        self._compute_all_state_values(len(self.session.turns))

    def describe_model(self) -> str:
        """Return the hint agent's present estimate of the other players, '' if it has none."""
        if self._hint_agent is None:
            return ""
        return self.position.ask(lambda policy, memory: policy.describe_model(memory))

    def describe_game(self, turns_done: int | None = None) -> str:
        """Return the turns left and the other players that the values are about, as text.

        They are the turns left after `turns_done` turns, by default those of the session.
        """
        turn_count = len(self.session.turns) if turns_done is None else turns_done
        return self._hint_agent.describe_game(turn_count) if self._hint_agent else ""

    def _compute_all_state_values(self, turn_count: int) -> Reals | None:
        """Return the value of every action in every state `[S, A]` after `turn_count` turns.

        None if states are hidden or not enumerable, or if there is no hint agent.
        """
        if self._cached_state_values is None or self._cached_state_values[0] != turn_count:
            self._cached_state_values = turn_count, self._query_all_state_values(turn_count)
        return self._cached_state_values[1]

    def _query_all_state_values(self, turn_count: int) -> Reals | None:
        """Return the value of every action in every state `[S, A]`, not cached; None if unknown."""
        problem = self.session.problem
        finite = isinstance(problem.state_count, int) and problem.state_count > 1
        if not finite or problem.observations or self._hint_agent is None:
            return None
        policy = self._hint_agent.policy
        return policy.action_values(policy.memory_at_turn(problem.enumerate_states(), turn_count))


def _format_recommendation(
    position: Position, action: float | None, estimates: ActionValues | None
) -> str:
    """Return an action as text, or the estimates that are too close to call.

    A real action is rounded by less than 1e-4 of its interval.
    """
    if action is None:
        assert estimates is not None
        text = f"{TOO_CLOSE}; {Hint('', '', position.labels, estimates).values_text}"
        if estimates._replace(return_bounds=None).is_too_close:
            return text
        return f"{text}; {estimates.sample_count} samples of each may miss rare outcomes"
    action_set = position.problem.actions[position.seat]
    if not isinstance(action_set, Interval) or action_set.high <= action_set.low:
        return position.format_action(action)
    return format_real_action(action_set, action)


def format_real_action(interval: Interval, action: float) -> str:
    """Return a real-valued action as text, rounded by less than INTERVAL_RESOLUTION."""
    step = (interval.high - interval.low) * INTERVAL_RESOLUTION
    return format_fixed(action, max(ceil(-log10(step)), 0))
