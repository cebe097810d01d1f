"""What a view makes of a game, kept by what it looked at: a game comes to few places, often."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import cached_property
from operator import attrgetter
from types import ModuleType
from typing import Any, Generic, TypeVar, cast, overload

import numpy as np
from rich.text import Text

from dmplay.core import Problem, array_bytes
from dmplay.finding.problems import builtin_stem
from dmplay.session import Session, View
from dmplay.views.style import DrawOptions, fit_board, load_view_module

MAX_CACHED_RESULTS = 512  # answers that are kept to one question
STATUS_FIELD, FULL_HISTORY = (
    "status_key",
    "reads_full_history",
)  # what every answer goes by; what is more than the last turn
HASHABLE_FIELDS = (
    "width", "height", "ascii", "show_keys", "suggested_action", "reserved_rows", "allow_large",
    "motion_progress", "panel_columns",
)  # fmt: skip
ARRAY_FIELDS = ("revealed_state", "ghost_state", "regret", "overlay", "forecast")
get_hashable_fields, get_array_fields = attrgetter(*HASHABLE_FIELDS), attrgetter(*ARRAY_FIELDS)

T = TypeVar("T")


class SeatSnapshot:
    """What a seat may know now: the last turn at hand; a view is made where more is looked at."""

    def __init__(
        self,
        session: Session,
        seat: int,
        *,
        rewards_visible: bool = False,
        agents_only: bool = False,
    ) -> None:
        self.agents_only = agents_only  # whether agents alone play
        self.session, self.seat, self.turn = session, seat, len(session.turns)
        self.last_turn = session.turns[-1] if session.turns else None
        self.end_reason = session.end_reason
        self.rewards_visible = (
            rewards_visible or self.end_reason is not None or session.problem.rewards_observable
        )
        last, legal = self.last_turn, session.legal_actions_mask(seat)
        able = None if legal is None else legal.tobytes()
        # What is no list of what was told turn by turn, and whether there was a turn.
        self.status_key = (
            seat,
            self.end_reason,
            session.turn_limit,
            able,
            self.turn > 0,
            self.rewards_visible,
        )
        self.observation_key = array_bytes(session.observation_after(seat, self.turn))
        self.previous_observation_key = last and array_bytes(
            session.observation_after(seat, self.turn - 1)
        )
        self.last_action = last and last.actions.item(seat)
        self.last_reward = last and last.rewards.item(seat)

    def is_current_for(self, seat: int) -> bool:
        """Whether it is still what that seat may know."""
        turns = self.session.turns
        same = seat == self.seat and (turns[-1] if turns else None) is self.last_turn
        return same and self.session.end_reason == self.end_reason

    @cached_property
    def view(self) -> View[Problem]:
        """All that the seat may know."""
        view = self.session.view(self.seat, rewards_visible=self.rewards_visible)
        return (
            replace(view, player_label=view.problem.agents[self.seat]) if self.agents_only else view
        )

    @property
    def joint_action_key(self) -> Hashable:
        """What everybody did."""
        return self.last_turn and array_bytes(self.last_turn.actions)

    @property
    def belief_key(self) -> bytes:
        """What the seat believes."""
        return array_bytes(self.view.belief)

    def read_facts(self, query: "CachedQuery") -> Hashable:
        """What was looked at to answer a question, as what can be compared."""
        return query.read_facts(self)


class TrackingSnapshot(SeatSnapshot):
    """A moment that notes which facts of it are looked at."""

    def __init__(self, snapshot: SeatSnapshot, read_fields: set[str]) -> None:
        super().__init__(snapshot.session, snapshot.seat, rewards_visible=snapshot.rewards_visible)
        self._snapshot, self._read_fields = snapshot, read_fields

    @cached_property
    def view(self) -> View[Problem]:
        """All that the seat may know."""
        view, looked = self._snapshot.view, self._read_fields
        return replace(
            view,
            observations=TrackingSequence(
                view.observations, looked, "observation_key", "previous_observation_key"
            ),
            actions=TrackingSequence(view.actions, looked, "last_action"),
            joint_actions=view.joint_actions
            and TrackingSequence(view.joint_actions, looked, "joint_action_key"),
            rewards=view.rewards and TrackingSequence(view.rewards, looked, "last_reward"),
            beliefs=view.beliefs and TrackingSequence(view.beliefs, looked, "belief_key"),
        )

    def read_facts(self, known: "CachedQuery") -> Hashable:
        """What was looked at to answer a question, as what can be compared."""
        self._read_fields.update(known.read_fields)
        return self._snapshot.read_facts(known)


class TrackingSequence(Sequence[T]):
    """What a seat was told, noting by which names the last of it was looked at."""

    def __init__(self, values: Sequence[T], read_fields: set[str], *field_names: str) -> None:
        self._values, self._read_fields, self._field_names = values, read_fields, field_names

    def __bool__(self) -> bool:
        return bool(self._values)

    def __len__(self) -> int:
        self._read_fields.add(FULL_HISTORY)
        return len(self._values)

    @overload
    def __getitem__(self, index: int) -> T: ...
    @overload
    def __getitem__(self, place: slice) -> Sequence[T]: ...
    def __getitem__(self, place: int | slice) -> T | Sequence[T]:
        known = isinstance(place, int) and -len(self._field_names) <= place < 0
        self._read_fields.add(self._field_names[-1 - place] if known else FULL_HISTORY)  # type: ignore[operator]
        return self._values[place]


class CachedQuery:
    """The facts that were looked at so far to answer it, and the answers by these."""

    def __init__(self, *read_fields: str) -> None:
        self.read_fields = read_fields
        self.read_facts: Callable[[SeatSnapshot], Hashable] = attrgetter(*read_fields)
        self.reads_full_history = FULL_HISTORY in read_fields
        self.results: dict[Hashable, object] = {}


EMPTY_QUERY = CachedQuery(STATUS_FIELD)


class ViewCache:
    """The view of one problem, asked once for each place of a game that differs.

    Views are pure functions of what they are shown. One that looks at the last turn alone answers
    as it did wherever all that it looked at is the same; one that looks further back is asked anew.
    """

    def __init__(self, problem: Problem) -> None:
        self._view_module = load_view_module(problem)
        own = isinstance(self._view_module, ModuleType) and bool(builtin_stem(problem))
        self._is_pure = own and type(problem).action_labels is Problem.action_labels
        self._queries: dict[str, CachedQuery] = {}

    def fit_board(self, snapshot: SeatSnapshot, options: DrawOptions) -> Text:
        """The largest drawing that the room holds; nobody writes into it, as it comes again."""
        wanted = (
            *get_hashable_fields(options),
            *options.keys_by_action.items(),
            *map(_to_hashable, get_array_fields(options)),
        )
        return self.get_or_compute(
            "iter_boards",
            snapshot,
            lambda now: fit_board(self._view_module, now.view, options),
            wanted,
        )

    def goal_lines(self, snapshot: SeatSnapshot) -> list[str]:
        """What to aim for and what it costs."""
        return self.get_or_compute(
            "goal", snapshot, lambda now: self._view_module.goal_lines(now.view)
        )

    def panel_rows(self, snapshot: SeatSnapshot) -> list[tuple[str, str]]:
        """Facts for the side panel."""
        return self.get_or_compute(
            "panel", snapshot, lambda now: self._view_module.panel_rows(now.view)
        )

    def describe_turn(self, snapshot: SeatSnapshot) -> str:
        """What the last turn did."""
        return self.get_or_compute(
            "describe_turn", snapshot, lambda now: self._view_module.describe_turn(now.view)
        )

    def describe_situation(self, snapshot: SeatSnapshot) -> str:
        """Where the game stands."""
        return self.get_or_compute(
            "situation", snapshot, lambda now: self._view_module.describe_situation(now.view)
        )

    def get_or_compute(
        self,
        query_name: str,
        snapshot: SeatSnapshot,
        compute: Callable[[SeatSnapshot], T],
        extra_key: tuple[Hashable, ...] = (),
    ) -> T:
        """The answer to a question about a moment, and to what more is wanted of it."""
        known = self._queries.get(query_name, EMPTY_QUERY)
        if not self._is_pure or known.reads_full_history:
            return compute(snapshot)
        found = known.results.get((extra_key, snapshot.read_facts(known)))
        return (
            self._compute_and_store(query_name, snapshot, compute, extra_key)
            if found is None
            else cast(T, found)
        )

    def _compute_and_store(
        self,
        query_name: str,
        snapshot: SeatSnapshot,
        compute: Callable[[SeatSnapshot], T],
        extra_key: tuple[Hashable, ...],
    ) -> T:
        """An answer that was not given before; older ones are no use where it took a new look."""
        looked, known = set[str](), self._queries.get(query_name, EMPTY_QUERY)
        answer = compute(TrackingSnapshot(snapshot, looked))
        if (
            known is EMPTY_QUERY
            or not looked <= {*known.read_fields}
            or len(known.results) == MAX_CACHED_RESULTS
        ):
            known = CachedQuery(*known.read_fields, *looked.difference(known.read_fields))
            self._queries[query_name] = known
        if not known.reads_full_history:
            known.results[extra_key, snapshot.read_facts(known)] = answer
        return answer


class IdentityCache(Generic[T]):
    """What is made of objects that come again, once of each; so many are remembered."""

    def __init__(self, render: Callable[[T], str], max_entries: int) -> None:
        self._render, self._max_entries = render, max_entries
        self._entries: dict[int, tuple[T, str]] = {}  # by the object itself, which lasts so long

    def get(self, item: T) -> str:
        """What is made of this object."""
        found = self._entries.get(id(item))
        if found is None:
            if len(self._entries) == self._max_entries:
                self._entries.clear()
            self._entries[id(item)] = found = item, self._render(item)
        return found[1]


def _to_hashable(value: Any) -> Hashable:
    """What a look wants, as what can be compared."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return tuple(map(_to_hashable, value)) if isinstance(value, tuple) else cast(Hashable, value)
