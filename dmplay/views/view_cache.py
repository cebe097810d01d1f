"""A cache of the results of view modules, keyed by the facts that each call reads."""

from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from functools import cached_property
from operator import attrgetter
from types import ModuleType
from typing import Any, Generic, TypeVar, cast, overload

import numpy as np
from rich.text import Text

from dmplay.core import Problem, array_bytes
from dmplay.registry.problems import builtin_stem
from dmplay.session import Session, View
from dmplay.views.protocol import DrawOptions, fit_board, load_view_module

MAX_CACHED_RESULTS = 512  # maximum cached results per query
STATUS_FIELD, FULL_HISTORY = (
    "status_key",
    "reads_full_history",
)  # the field that all queries depend on; a mark for reads beyond the last turn
HASHABLE_FIELDS = (
    "width", "height", "ascii", "show_keys", "suggested_action", "reserved_rows", "allow_large",
    "motion_progress", "panel_columns",
)  # fmt: skip
ARRAY_FIELDS = ("revealed_state", "ghost_state", "regret", "overlay", "forecast")
get_hashable_fields, get_array_fields = attrgetter(*HASHABLE_FIELDS), attrgetter(*ARRAY_FIELDS)

T = TypeVar("T")


class SeatSnapshot:
    """A snapshot of what a seat may know now: the last turn, and the whole view on demand."""

    def __init__(
        self,
        session: Session,
        seat: int,
        *,
        rewards_visible: bool = False,
        agents_only: bool = False,
    ) -> None:
        self.agents_only = agents_only  # whether only agents play
        self.session, self.seat, self.turn = session, seat, len(session.turns)
        self.last_turn = session.turns[-1] if session.turns else None
        self.end_reason = session.end_reason
        self.rewards_visible = (
            rewards_visible or self.end_reason is not None or session.problem.rewards_observable
        )
        last_turn, legal = self.last_turn, session.legal_actions_mask(seat)
        legal_bytes = None if legal is None else legal.tobytes()
        # The facts that are not lists with an entry per turn, and whether a turn was played.
        self.status_key = (
            seat,
            self.end_reason,
            session.turn_limit,
            legal_bytes,
            self.turn > 0,
            self.rewards_visible,
        )
        self.observation_key = array_bytes(session.observation_after(seat, self.turn))
        self.previous_observation_key = last_turn and array_bytes(
            session.observation_after(seat, self.turn - 1)
        )
        self.last_action = last_turn and last_turn.actions.item(seat)
        self.last_reward = last_turn and last_turn.rewards.item(seat)

    def is_current_for(self, seat: int) -> bool:
        """Return whether the snapshot is still current for a seat."""
        turns = self.session.turns
        is_same_turn = seat == self.seat and (turns[-1] if turns else None) is self.last_turn
        return is_same_turn and self.session.end_reason == self.end_reason

    @cached_property
    def view(self) -> View[Problem]:
        """The seat's view; if only agents play, its player label is the agent's name."""
        view = self.session.view(self.seat, rewards_visible=self.rewards_visible)
        return (
            replace(view, player_label=view.problem.agents[self.seat]) if self.agents_only else view
        )

    @property
    def joint_action_key(self) -> Hashable:
        """The last joint action as a hashable key, or None before the first turn."""
        return self.last_turn and array_bytes(self.last_turn.actions)

    @property
    def belief_key(self) -> bytes:
        """The seat's current belief as a hashable key."""
        return array_bytes(self.view.belief)

    def read_facts(self, query: "CachedQuery") -> Hashable:
        """Return the values of the fields that a query reads, as a hashable key."""
        return query.read_facts(self)


class TrackingSnapshot(SeatSnapshot):
    """A snapshot that records which of its fields are read."""

    def __init__(self, snapshot: SeatSnapshot, read_fields: set[str]) -> None:
        super().__init__(snapshot.session, snapshot.seat, rewards_visible=snapshot.rewards_visible)
        self._snapshot, self._read_fields = snapshot, read_fields

    @cached_property
    def view(self) -> View[Problem]:
        """The seat's view, whose sequences record reads."""
        view, read_fields = self._snapshot.view, self._read_fields
        return replace(
            view,
            observations=TrackingSequence(
                view.observations, read_fields, "observation_key", "previous_observation_key"
            ),
            actions=TrackingSequence(view.actions, read_fields, "last_action"),
            joint_actions=view.joint_actions
            and TrackingSequence(view.joint_actions, read_fields, "joint_action_key"),
            rewards=view.rewards and TrackingSequence(view.rewards, read_fields, "last_reward"),
            beliefs=view.beliefs and TrackingSequence(view.beliefs, read_fields, "belief_key"),
        )

    def read_facts(self, query: "CachedQuery") -> Hashable:
        """Record the fields of a query as read, and return their values as a hashable key."""
        self._read_fields.update(query.read_fields)
        return self._snapshot.read_facts(query)


class TrackingSequence(Sequence[T]):
    """A sequence that records reads of its last items by name, and other reads as FULL_HISTORY."""

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
    def __getitem__(self, index: slice) -> Sequence[T]: ...
    def __getitem__(self, index: int | slice) -> T | Sequence[T]:
        is_recent = isinstance(index, int) and -len(self._field_names) <= index < 0
        self._read_fields.add(self._field_names[-1 - index] if is_recent else FULL_HISTORY)  # type: ignore[operator]
        return self._values[index]


class CachedQuery:
    """The fields that a view function has read so far, and its results by the values of these."""

    def __init__(self, *read_fields: str) -> None:
        self.read_fields = read_fields
        self.read_facts: Callable[[SeatSnapshot], Hashable] = attrgetter(*read_fields)
        self.reads_full_history = FULL_HISTORY in read_fields
        self.results: dict[Hashable, object] = {}


EMPTY_QUERY = CachedQuery(STATUS_FIELD)


class ViewCache:
    """A cache of one problem's view, which computes each result once per distinct snapshot.

    View modules are pure functions of their arguments. A function that reads only the last turn
    returns its cached result whenever all fields that it read are equal. A function that reads
    further back is called every time. Nothing is cached for user-defined views, nor for problems
    whose action labels depend on the state.
    """

    def __init__(self, problem: Problem) -> None:
        self._view_module = load_view_module(problem)
        has_builtin_view = isinstance(self._view_module, ModuleType) and bool(builtin_stem(problem))
        self._is_pure = has_builtin_view and type(problem).action_labels is Problem.action_labels
        self._queries: dict[str, CachedQuery] = {}

    def fit_board(self, snapshot: SeatSnapshot, options: DrawOptions) -> Text:
        """Return the largest board that fits; the text may be shared, so do not change it."""
        options_key = (
            *get_hashable_fields(options),
            *options.keys_by_action.items(),
            *map(_to_hashable, get_array_fields(options)),
        )
        return self.get_or_compute(
            "iter_boards",
            snapshot,
            lambda current: fit_board(self._view_module, current.view, options),
            options_key,
        )

    def goal_lines(self, snapshot: SeatSnapshot) -> list[str]:
        """Return the goal and the costs, as clauses."""
        return self.get_or_compute(
            "goal", snapshot, lambda current: self._view_module.goal_lines(current.view)
        )

    def panel_rows(self, snapshot: SeatSnapshot) -> list[tuple[str, str]]:
        """Return the rows of the side panel, as pairs of label and value."""
        return self.get_or_compute(
            "panel", snapshot, lambda current: self._view_module.panel_rows(current.view)
        )

    def describe_turn(self, snapshot: SeatSnapshot) -> str:
        """Return a description of the last turn."""
        return self.get_or_compute(
            "describe_turn", snapshot, lambda current: self._view_module.describe_turn(current.view)
        )

    def describe_situation(self, snapshot: SeatSnapshot) -> str:
        """Return a description of the current situation."""
        return self.get_or_compute(
            "situation",
            snapshot,
            lambda current: self._view_module.describe_situation(current.view),
        )

    def get_or_compute(
        self,
        query_name: str,
        snapshot: SeatSnapshot,
        compute: Callable[[SeatSnapshot], T],
        extra_key: tuple[Hashable, ...] = (),
    ) -> T:
        """Return the result of a query about a snapshot, from the cache if possible.

        `compute` is called with the snapshot if there is no cached result. `extra_key` holds the
        further arguments that the result depends on.
        """
        query = self._queries.get(query_name, EMPTY_QUERY)
        if not self._is_pure or query.reads_full_history:
            return compute(snapshot)
        cached = query.results.get((extra_key, snapshot.read_facts(query)))
        return (
            self._compute_and_store(query_name, snapshot, compute, extra_key)
            if cached is None
            else cast(T, cached)
        )

    def _compute_and_store(
        self,
        query_name: str,
        snapshot: SeatSnapshot,
        compute: Callable[[SeatSnapshot], T],
        extra_key: tuple[Hashable, ...],
    ) -> T:
        """Compute the result of a query, and cache it unless the query reads the full history.

        Older results are dropped if the query read new fields or its cache is full.
        """
        read_fields, query = set[str](), self._queries.get(query_name, EMPTY_QUERY)
        result = compute(TrackingSnapshot(snapshot, read_fields))
        if (
            query is EMPTY_QUERY
            or not read_fields <= {*query.read_fields}
            or len(query.results) == MAX_CACHED_RESULTS
        ):
            query = CachedQuery(*query.read_fields, *read_fields.difference(query.read_fields))
            self._queries[query_name] = query
        if not query.reads_full_history:
            query.results[extra_key, snapshot.read_facts(query)] = result
        return result


class IdentityCache(Generic[T]):
    """A cache of strings rendered from objects, by object identity.

    The cache is cleared when it holds `max_entries` entries.
    """

    def __init__(self, render: Callable[[T], str], max_entries: int) -> None:
        self._render, self._max_entries = render, max_entries
        # id -> the object, kept alive so that its id stays unique, and its rendering
        self._entries: dict[int, tuple[T, str]] = {}

    def get(self, item: T) -> str:
        """Return the rendering of an object, from the cache if possible."""
        entry = self._entries.get(id(item))
        if entry is None:
            if len(self._entries) == self._max_entries:
                self._entries.clear()
            self._entries[id(item)] = entry = item, self._render(item)
        return entry[1]


def _to_hashable(value: Any) -> Hashable:
    """Return a drawing option in hashable form: arrays as bytes, tuples item by item."""
    if isinstance(value, np.ndarray):
        return value.tobytes()
    return tuple(map(_to_hashable, value)) if isinstance(value, tuple) else cast(Hashable, value)
