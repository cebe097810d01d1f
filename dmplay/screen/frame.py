"""The play screen as text: title, board and side panel, log, message and keys, to the column."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

from rich.text import Span, Text

from dmplay.advice.adviser import Hint
from dmplay.core import array_bytes
from dmplay.describe import format_score
from dmplay.game.game import Game
from dmplay.screen import heading
from dmplay.screen.events import MIN_LOG_ROWS, layout_log, list_events
from dmplay.screen.footer import format_footer
from dmplay.screen.shown import EMPTY_FRAME_STATE, FrameState, Viewport, fit_line
from dmplay.screen.wrapping import format_panel, wrap_lines
from dmplay.styles import ScreenLine, to_rich_text
from dmplay.terminal import escape_unprintable
from dmplay.views.canvas import measure_text, split_styled_rows
from dmplay.views.kept import SeatSnapshot
from dmplay.views.style import MIN_PANEL_COLUMNS, DrawOptions, TooSmallNotice

MIN_BOARD_ROWS, MIN_GOAL_ROWS = (
    4,
    20,
)  # rows from which on there is a board, and the goal is always told
MAX_LOG_ROWS_BELOW = 8  # rows of the log below the board at most
MIN_SIDE_LOG_SCREEN_COLUMNS = 100  # columns from which on the log is beside the board
MIN_LOG_COLUMNS = 36  # columns that it then has at least
PanelFacts = tuple[tuple[str, str], ...]  # of the side panel, with their names
ScreenRows = Sequence[ScreenLine]  # rows of the screen; a tuple where they come again
BLANK_ROW = " "


def compose_frame(
    game: Game, viewport: Viewport, frame_state: FrameState, log: Sequence[str]
) -> Text:
    """The whole screen: exactly `height` rows, none wider than the room."""
    return _join_parts(Frame(game, viewport, frame_state, log).compose_parts(), viewport)


class Frame:
    """A game as it stands, in the room there is, with what the front end adds."""

    def __init__(
        self,
        game: Game,
        viewport: Viewport,
        frame_state: FrameState,
        log: Sequence[str],
        snapshot: SeatSnapshot | None = None,
    ) -> None:
        self._game, self._viewport, self._state, self._log = game, viewport, frame_state, log
        self._snapshot = snapshot or game.snapshot()
        self._body_height = viewport.height - 3 - has_goal_row(viewport)  # rows of board and log
        long = len(frame_state.message) >= viewport.width and not (
            frame_state.page_rows or frame_state.handover_agent
        )
        self._log_shows_message = (
            long and viewport.height > MIN_BOARD_ROWS + MIN_LOG_ROWS
        )  # whether the log tells the message

    def compose_parts(self) -> list[ScreenRows]:
        """The whole screen before its rows are fitted; most that comes again is the same object.

        Under four rows: what is most urgent in one, below it the keys, above it the title.
        """
        height, below = (
            self._viewport.height,
            format_footer(self._game, self._viewport, self._state),
        )
        if height < MIN_BOARD_ROWS:
            rows = [self._most_urgent_row(), below][:height]
            return [[self._title_row(), *rows][-height:]]
        return [*self._upper_parts(), [self._message_row(), below]]

    def render_upper(self) -> Text:
        """All but the command row and the key row."""
        return _join_parts(self._upper_parts(), self._viewport)

    def max_scroll_offset(self) -> int:
        """How many rows the log can be scrolled back."""
        laid = self._cached_layout()
        inside = (
            Viewport(self._viewport.width, self._body_height - 1)
            if isinstance(laid, TooSmallNotice)
            else laid.log_viewport
        )
        return max(
            len(wrap_lines(list_events(self._game, self._log), inside)) - inside.height + 1, 0
        )

    def _title_row(self) -> ScreenLine:
        return heading.title_row(self._game, self._snapshot, self._viewport)

    def _most_urgent_row(self) -> ScreenLine:
        """One row: the curtain, a row of a page, the message, what happened last, how it stands."""
        room, shown = self._viewport, self._state
        if shown.handover_agent:
            return _handover_rows(shown.handover_agent, room)[0]
        if shown.page_rows:
            return _current_page(room, shown)[0]
        if shown.message or self._log:
            return f" {escape_unprintable(shown.message or self._log[-1])}"
        board = self._game.draw_board(
            DrawOptions(room.width, 1, room.ascii_only, reserved_rows=MIN_LOG_ROWS + MIN_BOARD_ROWS)
        )
        needed = [board.plain] if isinstance(board, TooSmallNotice) else []
        return " " + ". ".join([*needed, self._game.narrator.describe_situation(self._snapshot)])

    def _message_row(self) -> ScreenLine:
        """The row that answers the last key; empty where the log has room for a long answer."""
        told = "" if self._log_shows_message else self._state.message
        if self._viewport.height == MIN_BOARD_ROWS and not (told or self._state.handover_agent):
            told = self._default_message()
        return fit_line(f" {escape_unprintable(told)}", self._viewport) if told else BLANK_ROW

    def _default_message(self) -> str:
        """What the row of messages tells where the body has one row alone."""
        if self._state.page_rows:
            many = len(split_pages(self._viewport, self._state))
            return f"part {min(self._state.page_index, many - 1) + 1} of {many}. Space goes on"
        return (
            self._log[-1] if self._log else self._game.narrator.describe_situation(self._snapshot)
        )

    def _upper_parts(self) -> list[ScreenRows]:
        """Exactly `height - 2` rows.

        Fit order: the side panel goes first, then the log shrinks to two rows, then the board to
        its smaller forms, at last to one line of text.
        """
        room, shown = self._viewport, self._state
        if shown.handover_agent:
            parts: list[ScreenRows] = [
                [heading.name_row(self._game)],
                _handover_rows(shown.handover_agent, room),
            ]
        elif shown.page_rows:
            parts = [[self._title_row()], _current_page(room, shown)]
        else:
            parts = [[self._title_row()], *self._board_and_log_parts()]
        left = room.height - 2 - sum(map(len, parts))
        return [*parts, [""] * left] if left >= 0 else [[*chain(*parts)][: room.height - 2]]

    def _goal_rows(self, snapshot: SeatSnapshot) -> list[ScreenLine]:
        """The row of the goal, where it has one."""
        return (
            [heading.goal_row(self._game, snapshot, self._viewport)]
            if has_goal_row(self._viewport)
            else []
        )

    def _board_and_log_parts(self) -> list[ScreenRows]:
        """The goal, board, panel and log."""
        game, room, laid = self._game, self._viewport, self._cached_layout()
        long = [self._state.message] if self._log_shows_message else []
        if isinstance(laid, TooSmallNotice):
            return self._too_small_parts(laid, long)
        told = self._log or self._remaining_goal_lines(laid.log_viewport)
        log = layout_log(
            game,
            laid.log_viewport,
            long,
            told,
            self._state.scroll_offset,
            is_side_column=laid.is_log_beside,
        )
        if not laid.is_log_beside:
            return [laid.rows, log]
        rows = [*laid.rows]
        width, first = (
            room.width - laid.log_viewport.width,
            has_goal_row(room) + self._body_height - laid.log_viewport.height,
        )
        rows += [" " * width] * (first + len(log) - len(rows))
        for place, line in enumerate(log, first):
            rows[place] = to_rich_text(rows[place]).copy().append_text(to_rich_text(line))
        return [rows]

    def _too_small_parts(
        self, notice: TooSmallNotice, long_messages: list[str]
    ) -> list[ScreenRows]:
        """What the board needs in its place, and the log or how the game stands."""
        game, room, now = self._game, self._viewport, self._snapshot
        left = Viewport(room.width, max(self._body_height - 1, 0), room.ascii_only)
        top: ScreenRows = [*self._goal_rows(now), notice]
        if self._log or long_messages:
            return [
                top,
                layout_log(game, left, long_messages, self._log, self._state.scroll_offset),
            ]
        stands = wrap_lines(
            [game.narrator.describe_situation(now), *self._remaining_goal_lines(left)], room
        )
        return [top, stands[: left.height]]

    def _remaining_goal_lines(self, log_viewport: Viewport) -> list[str]:
        """What of the goal has no room above, before the first turn."""
        game, room = self._game, self._viewport
        if game.session.turns:
            return []
        return heading.remaining_goal_lines(
            game, self._snapshot, room if has_goal_row(room) else None, log_viewport
        )

    def _cached_layout(self) -> "_BoardLayout | TooSmallNotice":
        """The board and what is around it; of a game that is only looked at that comes again."""
        game = self._game
        if game.human_seats or game.ghost or self._state != EMPTY_FRAME_STATE:
            return self._compute_layout(self._snapshot)
        hidden = game.session.problem.partially_observable
        state = (
            game.reveal and array_bytes(game.session.state)
            if hidden
            else self._snapshot.observation_key
        )
        wanted = (self._viewport, self._body_height, state)
        return game.narrator.view_cache.get_or_compute(
            "laid", self._snapshot, self._compute_layout, wanted
        )

    def _compute_layout(self, snapshot: SeatSnapshot) -> "_BoardLayout | TooSmallNotice":
        """From so many columns on the log is beside the board, else below; what the board needs."""
        room, body = self._viewport, self._body_height
        known, aim = self._panel_facts(snapshot), self._goal_rows(snapshot)
        if room.width >= MIN_SIDE_LOG_SCREEN_COLUMNS:
            board = self._draw_board(snapshot, room.width - MIN_LOG_COLUMNS, body)
            if not isinstance(board, TooSmallNotice):
                laid = _layout_log_beside(known, board, room, body)
                if laid.log_viewport.height >= MIN_LOG_ROWS:
                    return laid._replace(rows=(*aim, *laid.rows))
        board = self._draw_board(snapshot, room.width, max(body - MIN_LOG_ROWS - 1, 1))
        if isinstance(board, TooSmallNotice):
            return board
        laid = _layout_log_below(
            known, board, room, body, is_game_over=snapshot.end_reason is not None
        )
        return laid._replace(rows=(*aim, *laid.rows))

    def _draw_board(self, snapshot: SeatSnapshot, width: int, height: int) -> Text:
        """The drawing in a part of the room."""
        game, room, shown = self._game, self._viewport, self._state
        advised = (
            shown.hint.action if shown.hint and shown.typed_action is None else shown.typed_action
        )
        look = DrawOptions(
            width,
            height,
            room.ascii_only,
            game.hint_provider.build_overlay(shown.overlay),
            show_keys=game.choosing_seat is not None and snapshot.turn < shown.last_key_hint_turn,
            reserved_rows=room.height - self._body_height + MIN_LOG_ROWS + 1,
            allow_large=True,
            regret=shown.hint.regrets if shown.hint else None,
            suggested_action=advised,
            forecast=shown.forecast,
            motion_progress=shown.motion_progress,
            panel_columns=max(MIN_PANEL_COLUMNS + 2 - (room.width - width), 0),
        )
        return game.draw_board(look, snapshot)

    def _panel_facts(self, snapshot: SeatSnapshot) -> PanelFacts:
        """The facts of the side panel."""
        game, shown = self._game, self._state
        advised = not game.session.over and game.human_seats and not game.hints_forbidden
        best = [("best", shown.best_return)] if shown.best_return else []
        facts = [*game.narrator.view_cache.panel_rows(snapshot), *best, *_ghost_facts(game)]
        return (*facts, *(_hint_facts(shown.hint) if advised else []))


def has_goal_row(viewport: Viewport) -> bool:
    """Whether the goal has a row of its own; else the log begins with it."""
    return viewport.height >= MIN_GOAL_ROWS


def _current_page(viewport: Viewport, frame_state: FrameState) -> ScreenRows:
    """The part of the page that is shown; the last where a larger screen needs fewer."""
    parts = split_pages(viewport, frame_state)
    return parts[min(frame_state.page_index, len(parts) - 1)]


def split_pages(viewport: Viewport, frame_state: FrameState) -> list[ScreenRows]:
    """An answer of several lines, in parts that the screen holds."""
    rows = wrap_lines([*map(escape_unprintable, frame_state.page_rows)], viewport)
    body = max(viewport.height - 3, 1)
    if len(rows) <= body:
        return [rows]
    if body == 1:
        return [[row] for row in rows]
    held = body - 1
    many = -(-len(rows) // held)
    parts: list[ScreenRows] = []
    for number in range(1, many + 1):
        part = rows[(number - 1) * held : number * held]
        does = "Space goes on" if number < many else "any key goes back"
        last = (f" part {number} of {many}. {does}", "dim")
        parts.append([*part, *[""] * (held - len(part)), (last,)])
    return parts


def _handover_rows(agent: str, viewport: Viewport) -> ScreenRows:
    """What hides one person's board from the other while they change places."""
    told = (
        f"{escape_unprintable(agent)} is next: nobody else should look now. Enter shows the board."
    )
    rows = wrap_lines([told], viewport)
    return ["", *rows] if len(rows) < viewport.height - 3 else rows


def _join_parts(parts: Sequence[ScreenRows], viewport: Viewport) -> Text:
    return Text("\n", no_wrap=True).join(
        [to_rich_text(fit_line(row, viewport)) for row in chain(*parts)]
    )


class _BoardLayout(NamedTuple):
    """The goal, the board with the panel beside it, and where the log has its place."""

    rows: tuple[ScreenLine, ...]
    log_viewport: Viewport
    is_log_beside: bool  # whether the log is at the right, in rows that reach to its first column


def _layout_log_beside(
    panel_facts: PanelFacts, board: Text, viewport: Viewport, body_height: int
) -> _BoardLayout:
    """The panel at the right of the board, the log under it."""
    width = viewport.width - measure_text(board)[0] - 2
    facts = format_panel(panel_facts, width)
    rows = [
        row.copy()
        for row in _join_board_and_panel(
            board.plain, tuple(board.spans), panel_facts, width, body_height
        )
    ]
    first = measure_text(board)[0] + 1
    for row in rows[len(facts) :]:
        row.append(" " * (first - len(row)))
    return _BoardLayout(
        (*rows,),
        Viewport(viewport.width - first, body_height - len(facts) - 1, viewport.ascii_only),
        is_log_beside=True,
    )


def _layout_log_below(
    panel_facts: PanelFacts,
    board: Text,
    viewport: Viewport,
    body_height: int,
    *,
    is_game_over: bool,
) -> _BoardLayout:
    """The panel at the right where it has room; the log below, not high while the game goes on."""
    width = viewport.width - measure_text(board)[0] - 2
    facts = panel_facts if width >= MIN_PANEL_COLUMNS else ()
    rows = _join_board_and_panel(
        board.plain, tuple(board.spans), facts, width, max(body_height - MIN_LOG_ROWS - 1, 0)
    )
    left = max(body_height - len(rows) - 1, 0)
    high = left if is_game_over else min(left, MAX_LOG_ROWS_BELOW)
    return _BoardLayout(
        (*rows, ""), Viewport(viewport.width, high, viewport.ascii_only), is_log_beside=False
    )


@lru_cache(1024)
def _join_board_and_panel(
    plain: str, spans: tuple[Span, ...], panel_facts: PanelFacts, width: int, max_rows: int
) -> tuple[Text, ...]:
    """The rows of a drawing with facts beside them; a game shows few that differ, often."""
    rows, facts = split_styled_rows(plain, spans), format_panel(panel_facts, width)
    first = max(map(len, rows)) + 2
    rows += [Text("") for _ in range(len(rows), min(len(facts), max_rows))]
    for row, fact in zip(rows, facts, strict=False):
        row.append(" " * (first - len(row))).append(fact)
    return tuple(rows)


def _ghost_facts(game: Game) -> list[tuple[str, str]]:
    """What the ghost came to so far, and how far the person is ahead."""
    ghost = game.ghost
    if ghost is None or not ghost.is_shown_during_play:
        return []
    lead = "+" * (ghost.player_lead >= 0) + format_score(ghost.player_lead)
    return [("ghost", format_score(ghost.score)), ("lead", lead)]


def _hint_facts(hint: Hint | None) -> list[tuple[str, str]]:
    """The key of hints; once one was given, what it values the actions at, the best first."""
    if hint is None or not hint.value_rows:
        return [("hint", "Tab")]
    return [("worth", ""), *((f"  {label}", number) for label, number in hint.value_rows)]
