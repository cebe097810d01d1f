"""Hints: what a good player would do in a seat, and what that player knows of values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor, isfinite, isnan, log10
from typing import TypeVar

import numpy as np

from dmplay.advice.forecast import forecast_outcomes, format_forecast
from dmplay.budget import limit_total_work
from dmplay.chance import Reals
from dmplay.core import Interval, Policy
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.finding import agents
from dmplay.session import SeatedPolicy, Session, Turn
from dmplay.views.style import REGRET_TOLERANCE, Forecast, Overlay

T = TypeVar("T")
MAX_LISTED_VALUES = 10  # actions whose values are told
HINT_WORK_LIMIT = 1.5e9  # operations of an answer: as much as takes about a second
SEARCH_AGENT = "search"  # asks for no more than it may have
MIN_DECIMALS, MAX_DECIMALS = 2, 6  # decimals of values
WHOLE_NUMBER_SPREAD = 100.0  # values that are so far apart have none
INTERVAL_RESOLUTION = 1e-4  # the share of an interval to which an action is told


def count_decimals(values: Sequence[float]) -> int:
    """The decimals, two to six, that tell these values from one another, or from nothing."""
    apart = _value_spread(values)
    return min(max(1 - floor(log10(apart)), MIN_DECIMALS), MAX_DECIMALS) if apart else MIN_DECIMALS


def count_fewest_decimals(values: Sequence[float]) -> int:
    """As many decimals; none of whole numbers, nor where they are hundreds apart."""
    whole = all(abs(value - round(value)) < REGRET_TOLERANCE for value in values if isfinite(value))
    return 0 if whole or _value_spread(values) >= WHOLE_NUMBER_SPREAD else count_decimals(values)


def _value_spread(values: Sequence[float]) -> float:
    """How far these values are from one another; where they are the same, from nothing."""
    known = [value for value in values if isfinite(value)] or [0.0]
    spread = max(known) - min(known)
    return spread if spread > REGRET_TOLERANCE else abs(known[0])


def format_fixed(value: float, decimals: int) -> str:
    """A value with so many decimals; no zero is negative."""
    return f"{round(value, decimals) + 0.0:.{decimals}f}"


@dataclass(frozen=True, eq=False)
class Hint:
    """What the adviser would do before a turn, and its values, where it knows any."""

    recommendation: str
    labels: Sequence[str]
    values: Reals | None  # [A], nan where not legal
    action: float | None = None  # what is advised; None where several are as good
    action_name: str = ""  # the same by name, to the last digit

    def __str__(self) -> str:
        """In a line."""
        return ". ".join(filter(None, (self.summary, self.values_text)))

    @property
    def recommended_action(self) -> str:
        """What is best, without who says so."""
        return self.recommendation.rpartition(": ")[2]

    @property
    def summary(self) -> str:
        """The same without its values, for who sees them marked."""
        return f"hint {self.recommendation}"

    @cached_property
    def values_text(self) -> str:
        """Its values alone; '' where it knows none."""
        each = ", ".join(
            f"{label} {number}" for label, number in self._format_values(ordered=False)
        )
        return each and f"values: {each}"

    @property
    def data(self) -> dict[str, object]:
        """By whom, what and the values that are known, as data."""
        by, _, _ = self.recommendation.rpartition(": ")
        told = [] if self.values is None else self.values.tolist()
        known = {name: one for name, one in zip(self.labels, told, strict=False) if isfinite(one)}
        return {"by": by.strip("()"), "action": self.action_name, "values": known}

    @cached_property
    def regrets(self) -> Reals | None:
        """What each action `[A]` loses against the best; nan where not legal, or not known."""
        if self.values is None or not np.isfinite(self.values).any():
            return None
        finite = np.where(np.isfinite(self.values), self.values, np.nan)
        lost: Reals = np.nanmax(finite) - finite
        return lost

    @cached_property
    def ranked_actions(self) -> list[tuple[int, float]]:
        """The legal actions with what each loses, the best first; of equals the advised one."""
        lost = [] if self.regrets is None else self.regrets.tolist()
        known = [
            (action, 0.0 if loss <= REGRET_TOLERANCE else loss) for action, loss in enumerate(lost)
        ]
        able = [one for one in known if not isnan(one[1])]
        return sorted(able, key=lambda one: (one[1], one[0] != self.action))

    @cached_property
    def value_rows(self) -> list[tuple[str, str]]:
        """The values of the best actions, the best first."""
        return self._format_values(ordered=True)

    def _format_values(self, *, ordered: bool) -> list[tuple[str, str]]:
        """Actions and their values in as many decimals as tell them apart; of many the best."""
        best = [action for action, _ in self.ranked_actions]
        if self.values is None or not best:
            return []
        order = (
            best[:MAX_LISTED_VALUES] if ordered or len(best) > MAX_LISTED_VALUES else sorted(best)
        )
        known = [(self.labels[action], float(self.values[action])) for action in order]
        places = (count_fewest_decimals if ordered else count_decimals)(
            [value for _, value in known]
        )
        return [(label, format_fixed(value, places)) for label, value in known]


class HintProvider:
    """The problem's own adviser beside a seat of a session; it only looks on."""

    def __init__(self, session: Session, seat: int, player_names: Sequence[str] = ()) -> None:
        self.session = session
        self.seat = seat
        self.player_names = player_names  # who plays, by name
        self._cached_hint: tuple[int, Turn | None, Hint] | None = None  # last, and after which turn
        self._cached_forecast: tuple[int, Turn | None, Forecast] | None = None

    @cached_property
    def _named_policy(self) -> tuple[str, Policy] | None:
        """The agent, if there is one; found out late, as a first frame does not need it."""
        return agents.find_hint_provider(
            self.session.problem, self.seat, self.session.turn_limit, self.player_names
        )

    @property
    def name(self) -> str | None:
        """The agent's name."""
        return self._named_policy and self._named_policy[0]

    @cached_property
    def _follower(self) -> SeatedPolicy | None:
        return (
            SeatedPolicy(self.session, self.seat, self._named_policy[1])
            if self._named_policy
            else None
        )

    def explain_unavailable(self) -> str:
        """Why nobody gives advice here; '' where somebody does."""
        if self.session.over:
            return "the game is over"
        return "" if self._follower else "no agent here knows values; dmplay info lists the agents"

    def _query_agent(self, query: Callable[[SeatedPolicy], T]) -> T:
        """An answer of the agent; of a search, where there is too much for the agent to plan."""
        assert self._follower
        if self.name != SEARCH_AGENT:
            try:
                with limit_total_work(HINT_WORK_LIMIT):
                    return query(self._follower)
            except (BadPolicy, BudgetExceeded):
                search = agents.load_agent(self.session.problem, self.seat, SEARCH_AGENT)
                self._named_policy = SEARCH_AGENT, search
                self._follower = SeatedPolicy(self.session, self.seat, search)
        return query(self._follower)

    def create_hint(self) -> str:
        """What the adviser would do here, with the value of each legal action."""
        why = self.explain_unavailable()
        if why:
            return f"no hint: {why}"
        action = self._choose_action()
        labels, called = (
            self.session.action_labels(self.seat),
            self.session.format_action(self.seat, action),
        )
        advice = Hint(
            self._format_recommendation(action), labels, self._legal_values(), action, called
        )
        self._cached_hint = (*self._turn_key, advice)
        return str(advice)

    @property
    def current_hint(self) -> Hint | None:
        """The hint that was given before this turn, if one was."""
        return self._if_current(self._cached_hint)

    def forecast_action(self, action: float) -> str:
        """What an action may bring, in a line; kept for the board."""
        if self.session.over:
            raise BadParameter("whatif: the game is over")
        outlook = forecast_outcomes(self.session, self.seat, action)
        self._cached_forecast = (*self._turn_key, outlook)
        return format_forecast(self.session, self.seat, outlook)

    def clear_forecast(self) -> None:
        """Forgets what an action may bring."""
        self._cached_forecast = None

    @property
    def current_forecast(self) -> Forecast | None:
        """What the action may bring that was asked about before this turn, if one was."""
        return self._if_current(self._cached_forecast)

    def _if_current(self, cached: tuple[int, Turn | None, T] | None) -> T | None:
        """What was kept, as long as its turn is not played."""
        if cached is None or self.session.over:
            return None
        turns, last, what = cached
        now = self._turn_key
        return what if turns == now[0] and last is now[1] else None

    @property
    def _turn_key(self) -> tuple[int, Turn | None]:
        turns = self.session.turns
        return len(turns), turns[-1] if turns else None

    def describe_choice(self) -> str:
        """The adviser's name, and what it would do here."""
        return self._format_recommendation(self._choose_action())

    def _choose_action(self) -> float:
        return self._query_agent(SeatedPolicy.choose)

    def _format_recommendation(self, action: float) -> str:
        """The adviser's name, and an action; a real number in as many decimals as matter."""
        kind = self.session.problem.actions[self.seat]
        with limit_total_work(HINT_WORK_LIMIT):
            basis = getattr(self._named_policy and self._named_policy[1], "hint_basis", "")
        told = self.session.format_action(self.seat, action)
        if isinstance(kind, Interval) and kind.high > kind.low:
            told = format_fixed(
                action, max(ceil(-log10((kind.high - kind.low) * INTERVAL_RESOLUTION)), 0)
            )
        return f"({basis or self.name}): {told}"

    def describe_values(self) -> str:
        """The adviser's value of each legal action; '' where it knows none."""
        labels = self.session.action_labels(self.seat)
        return Hint("", labels, self._legal_values()).values_text

    def _legal_values(self) -> Reals | None:
        """The value of each action `[A]`, nan where not legal; None where no values are known."""
        values = self._query_agent(SeatedPolicy.action_values) if self._follower else None
        if values is None or not self.session.problem.actions[self.seat].labels:
            return None
        legal = self.session.legal_actions_mask(self.seat)
        return values if legal is None else np.where(legal, values, np.nan)

    def build_overlay(self, kind: str) -> Overlay | None:
        """Values, policy or states of every state, where the adviser knows them."""
        values = self._all_state_values if kind else None
        return None if values is None else Overlay(kind, values)

    @property
    def is_overlay_ready(self) -> bool:
        """Whether overlays cost nothing any more."""
        return "_all_state_values" in vars(self)

    def prepare_overlay(self) -> None:
        """Values every state, for overlays."""
        _ = self._all_state_values

    @cached_property
    def _all_state_values(self) -> Reals | None:
        """The value of every action in every state."""
        problem = self.session.problem
        finite = isinstance(problem.state_count, int) and problem.state_count > 1
        if not finite or problem.observations or self._follower is None:
            return None
        policy = self._follower.policy
        return policy.action_values(policy.initial_memory(problem.enumerate_states()))
