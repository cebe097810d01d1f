"""The play screen as rows of text: title, goal, board and side panel, log, message and keys."""

from collections.abc import Sequence
from functools import lru_cache
from itertools import chain
from typing import NamedTuple

from rich.text import Span, Text

from dmplay.core.action_values import Accuracy
from dmplay.core.text import escape_unprintable, format_reward
from dmplay.draw.canvas import measure_text, split_styled_rows
from dmplay.draw.options import BEST_LABEL, EQUALLY_GOOD_LABEL, MIN_PANEL_COLUMNS, DrawOptions
from dmplay.game.game import Game
from dmplay.game.hints.hint_provider import Hint
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.terminal.styles import ScreenLine, to_rich_text
from dmplay.ui.screen import heading
from dmplay.ui.screen.footer import format_footer, format_page_footer
from dmplay.ui.screen.frame_state import FrameState, Viewport, fit_line
from dmplay.ui.screen.log_rows import MIN_LOG_ROWS, layout_log, list_verdict_lines
from dmplay.ui.screen.text_wrapping import format_panel, wrap_lines
from dmplay.views.protocol import TooSmallNotice

# rows from which the screen has a board; rows from which the goal has its own row
MIN_BOARD_ROWS, MIN_GOAL_ROWS = 4, 20
MIN_NOTE_SCREEN_ROWS = 10  # rows that a screen needs besides the note of a lesson
OTHER_PAGE_ROWS = 4  # rows of the title, the message and the keys; a blank row above the board
MAX_LOG_ROWS_BELOW = 8  # maximum rows of the log below the board while the game goes on
MIN_SIDE_LOG_SCREEN_COLUMNS = 100  # screen columns from which the log is beside the board
MIN_LOG_COLUMNS = 36  # columns reserved for the log beside the board
PanelFacts = tuple[tuple[str, str], ...]  # (name, value) rows of the side panel
# rows of the screen; a tuple if the same rows appear in several frames
ScreenRows = Sequence[ScreenLine]
BLANK_ROW = " "
HIDDEN_REWARD = ("reward", "hidden")


def compose_frame(
    game: Game, viewport: Viewport, frame_state: FrameState, log: Sequence[str]
) -> Text:
    """Return the play screen as text: `viewport.height` rows, none wider than the viewport."""
    return _join_parts(Frame(game, viewport, frame_state, log).compose_parts(), viewport)


class Frame:
    """One frame of the play screen: a game, the viewport, and the state that the screen adds."""

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
        self._goal_rows = self._compose_goal_rows()
        self._body_height = viewport.height - 3 - len(self._goal_rows)  # rows of board and log
        long = len(frame_state.message) >= viewport.width and not (
            frame_state.page_rows or frame_state.handover_agent
        )
        # The log shows the message.
        self._log_shows_message = long and viewport.height > MIN_BOARD_ROWS + MIN_LOG_ROWS

    def compose_parts(self) -> list[ScreenRows]:
        """Return the screen as groups of rows, before they are cut to the viewport's width.

        Rows that did not change are mostly the same objects, so they are cheap to compare. A screen
        of fewer than four rows has the most urgent row, the keys below it, and the title above if
        it fits.
        """
        height = self._viewport.height
        is_page = bool(self._state.page_rows) and not self._state.handover_agent
        footer = (
            format_page_footer(
                self._state.page_index,
                len(split_pages(self._viewport, self._state)),
                self._viewport,
            )
            if is_page
            else format_footer(self._game, self._viewport, self._state)
        )
        if height < MIN_BOARD_ROWS:
            rows = [self._most_urgent_row(), footer][:height]
            return [[self._title_row(), *rows][-height:]]
        return [*self._upper_parts(), [self._message_row(), footer]]

    def render_upper(self) -> Text:
        """Return the screen as text without the command row and the key row."""
        return _join_parts(self._upper_parts(), self._viewport)

    def max_scroll_offset(self) -> int:
        """Return the maximum number of rows by which the log can be scrolled back."""
        viewport = self._log_viewport()
        row_count = len(wrap_lines(self._log, viewport))
        return row_count - viewport.height + 1 if row_count > viewport.height else 0

    def page_height(self) -> int:
        """Return the number of rows of the log that are visible now.

        A log that is scrolled back has one row less, as its last row names the visible rows.
        """
        return max(self._log_viewport().height - bool(self._state.scroll_offset), 1)

    def fits_log(self, text: str) -> bool:
        """Return whether the log, or the message row, has space for all of a text."""
        viewport = self._log_viewport()
        rows = wrap_lines([escape_unprintable(text)], viewport)
        return len(rows) <= 1 or len(rows) <= viewport.height

    def _log_viewport(self) -> Viewport:
        """Return the viewport of the log."""
        layout = self._compute_layout(self._snapshot)
        if isinstance(layout, TooSmallNotice):
            return Viewport(self._viewport.width, self._body_height - 1)
        return layout.log_viewport

    def _title_row(self) -> ScreenLine:
        """Return the title row."""
        return heading.title_row(self._game, self._snapshot, self._viewport)

    def _most_urgent_row(self) -> ScreenLine:
        """Return the most urgent content as one row.

        In this order: the handover notice, the first row of the page, the message or the last
        event, and else the situation, after a notice if the board needs more space.
        """
        viewport, state = self._viewport, self._state
        if state.handover_agent:
            return _handover_rows(state.handover_agent, viewport)[0]
        if state.page_rows:
            return _current_page(viewport, state)[0]
        if state.message or self._log:
            return f" {escape_unprintable(state.message or self._log[-1])}"
        board = self._game.draw_board(
            DrawOptions(
                viewport.width, 1, viewport.ascii_only, reserved_rows=MIN_LOG_ROWS + MIN_BOARD_ROWS
            )
        )
        notice = [board.plain] if isinstance(board, TooSmallNotice) else []
        return " " + ". ".join([*notice, self._game.narrator.describe_situation(self._snapshot)])

    def _message_row(self) -> ScreenLine:
        """Return the message row; it is empty if the log shows the message.

        On a screen of four rows, a default message takes the place of an empty one.
        """
        message = "" if self._log_shows_message else self._state.message
        if self._viewport.height == MIN_BOARD_ROWS and not (message or self._state.handover_agent):
            message = self._default_message()
        return fit_line(f" {escape_unprintable(message)}", self._viewport) if message else BLANK_ROW

    def _default_message(self) -> str:
        """Return the page number, the last event, or the situation, as a default message."""
        if self._state.page_rows:
            part_count = len(split_pages(self._viewport, self._state))
            return (
                f"page {min(self._state.page_index, part_count - 1) + 1} "
                f"of {part_count}; Space shows the next page"
            )
        return (
            self._log[-1] if self._log else self._game.narrator.describe_situation(self._snapshot)
        )

    def _upper_parts(self) -> list[ScreenRows]:
        """Return the rows above the command row, exactly `height - 2` of them.

        If space is short, the side panel goes first, then the log shrinks to two rows, then the
        board takes its smaller forms, and finally one line of text.
        """
        viewport, state = self._viewport, self._state
        if state.handover_agent:
            parts: list[ScreenRows] = [
                [heading.make_name_row(self._game)],
                _handover_rows(state.handover_agent, viewport),
            ]
        elif state.page_rows:
            parts = [[self._title_row()], *self._page_parts()]
        else:
            parts = [[self._title_row()], *self._board_and_log_parts()]
        blank_count = viewport.height - 2 - sum(map(len, parts))
        if blank_count >= 0:
            return [*parts, [""] * blank_count]
        return [[*chain(*parts)][: viewport.height - 2]]

    def _page_parts(self) -> list[ScreenRows]:
        """Return the page; below a short one also the board, with the coordinates it may name."""
        viewport, state = self._viewport, self._state
        page = _current_page(viewport, state)
        free_rows = viewport.height - len(page) - OTHER_PAGE_ROWS
        if free_rows < MIN_BOARD_ROWS:
            return [page]
        plain_state = state._replace(hint=None, show_coordinates=True)
        board = self._draw_board(self._snapshot, viewport.width, free_rows, plain_state)
        if isinstance(board, TooSmallNotice):
            return [page]
        return [page, [BLANK_ROW], split_styled_rows(board.plain, board.spans)]

    def _compose_goal_rows(self) -> list[ScreenLine]:
        """Return the goal row as a list, or [] if the goal has no row of its own.

        A note of a lesson stands above it, if it leaves enough rows for a board, and in its place
        once the game is over.
        """
        goal = (
            [heading.goal_row(self._game, self._snapshot, self._viewport)]
            if has_goal_row(self._viewport)
            else []
        )
        if not self._state.note:
            return goal
        rows = wrap_lines([escape_unprintable(self._state.note)], self._viewport)
        if self._viewport.height < len(rows) + MIN_NOTE_SCREEN_ROWS:
            return goal
        is_over = self._game.session.over or self._state.is_lookback
        return [*(((row, "bold"),) for row in rows), *([] if is_over else goal)]

    def _board_and_log_parts(self) -> list[ScreenRows]:
        """Return the rows of goal, board, panel and log, or a notice if the board does not fit."""
        long_messages = [self._state.message] if self._log_shows_message else []
        if self._game.session.over:
            return self._verdict_parts(long_messages)
        viewport, layout = self._viewport, self._compute_layout(self._snapshot)
        if isinstance(layout, TooSmallNotice):
            return self._too_small_parts(layout, long_messages)
        events_or_goal = self._log or self._remaining_goal_lines(layout.log_viewport)
        log = layout_log(
            layout.log_viewport,
            long_messages,
            events_or_goal,
            self._state.scroll_offset,
            is_side_column=layout.is_log_beside,
        )
        if not layout.is_log_beside:
            return [layout.rows, log]
        rows = [*layout.rows]
        width = viewport.width - layout.log_viewport.width
        first_row = len(self._goal_rows) + self._body_height - layout.log_viewport.height
        rows += [" " * width] * (first_row + len(log) - len(rows))
        for index, line in enumerate(log, first_row):
            rows[index] = to_rich_text(rows[index]).copy().append_text(to_rich_text(line))
        return [rows]

    def _verdict_parts(self, long_messages: list[str]) -> list[ScreenRows]:
        """Return the end of a game: goal, board and panel, the verdict, and the end of the log.

        The verdict is complete if it fits the screen; a board that does not fit above it is left
        out.
        """
        viewport, snapshot = self._viewport, self._snapshot
        message_rows = wrap_lines([*map(escape_unprintable, long_messages)], viewport)
        first_row, *other_rows = wrap_lines(list_verdict_lines(self._game), viewport)
        card: list[ScreenLine] = [((first_row, "bold"),)]
        card += other_rows[: max(self._body_height - len(message_rows) - 1, 0)]
        board_height = self._body_height - len(card) - len(message_rows) - 1
        is_wide = viewport.width >= MIN_SIDE_LOG_SCREEN_COLUMNS
        width = viewport.width - MIN_LOG_COLUMNS * is_wide
        board = self._draw_board(snapshot, width, max(board_height, 1))
        upper_rows: Sequence[ScreenLine] = ()
        if board_height > 0 and not isinstance(board, TooSmallNotice):
            layout = _layout_log_below(
                self._panel_facts(snapshot),
                board,
                viewport,
                self._body_height,
                len(card) + len(message_rows),
            )
            upper_rows = layout.rows
        free_rows = self._body_height - len(upper_rows) - len(card) - len(message_rows)
        # Without the blank row, the last event has one row more.
        has_blank_row = free_rows > len(wrap_lines(self._log[-1:], viewport))
        log_viewport = Viewport(viewport.width, free_rows - has_blank_row, viewport.ascii_only)
        log = layout_log(log_viewport, [], self._log, 0) if log_viewport.height > 0 else []
        lower_rows: list[ScreenLine] = [
            *([""] if log and has_blank_row else []),
            *log,
            *message_rows,
        ]
        return [self._goal_rows, upper_rows, card, lower_rows]

    def _too_small_parts(
        self, notice: TooSmallNotice, long_messages: list[str]
    ) -> list[ScreenRows]:
        """Return the notice that the board does not fit, then the log or the situation."""
        game, viewport, snapshot = self._game, self._viewport, self._snapshot
        log_viewport = Viewport(viewport.width, max(self._body_height - 1, 0), viewport.ascii_only)
        top: ScreenRows = [*self._goal_rows, notice]
        if self._log or long_messages:
            return [
                top,
                layout_log(log_viewport, long_messages, self._log, self._state.scroll_offset),
            ]
        situation_rows = wrap_lines(
            [game.narrator.describe_situation(snapshot), *self._remaining_goal_lines(log_viewport)],
            viewport,
        )
        return [top, situation_rows[: log_viewport.height]]

    def _remaining_goal_lines(self, log_viewport: Viewport) -> list[str]:
        """Return the part of the goal that its row cannot hold, before the first turn; else []."""
        if self._game.session.turns:
            return []
        goal_viewport = self._viewport if has_goal_row(self._viewport) else None
        return heading.remaining_goal_lines(self._game, self._snapshot, goal_viewport, log_viewport)

    def _compute_layout(self, snapshot: SeatSnapshot) -> "_BoardLayout | TooSmallNotice":
        """Compute the layout of board, panel and log; return a notice if the board does not fit.

        From MIN_SIDE_LOG_SCREEN_COLUMNS columns the log is beside the board, if it fits; else
        below.
        """
        viewport, body_height = self._viewport, self._body_height
        panel_facts, goal_rows = self._panel_facts(snapshot), self._goal_rows
        if viewport.width >= MIN_SIDE_LOG_SCREEN_COLUMNS:
            board = self._draw_board(snapshot, viewport.width - MIN_LOG_COLUMNS, body_height)
            if not isinstance(board, TooSmallNotice):
                layout = _layout_log_beside(panel_facts, board, viewport, body_height)
                if layout.log_viewport.height >= MIN_LOG_ROWS:
                    return layout._replace(rows=(*goal_rows, *layout.rows))
        board = self._draw_board(snapshot, viewport.width, max(body_height - MIN_LOG_ROWS - 1, 1))
        if isinstance(board, TooSmallNotice):
            return board
        layout = _layout_log_below(panel_facts, board, viewport, body_height)
        return layout._replace(rows=(*goal_rows, *layout.rows))

    def _draw_board(
        self, snapshot: SeatSnapshot, width: int, height: int, frame_state: FrameState | None = None
    ) -> Text:
        """Draw the board in `width` x `height` cells, or return a notice if it does not fit.

        It shows the hint and the overlay of `frame_state`, by default of this frame's own state.
        """
        game, viewport, state = self._game, self._viewport, frame_state or self._state
        options = DrawOptions(
            width,
            height,
            viewport.ascii_only,
            game.hint_provider.build_overlay(state.overlay, len(game.session.turns))
            if state.overlay
            else None,
            show_keys=game.choosing_seat is not None,
            reserved_rows=viewport.height - self._body_height + MIN_LOG_ROWS + 1,
            allow_large=True,
            regret=state.hint.regrets if state.hint else None,
            suggested_action=state.hint.action if state.hint else None,
            typed_action=state.typed_action,
            forecast=state.forecast,
            motion_progress=state.motion_progress,
            show_coordinates=state.show_coordinates,
            panel_columns=max(MIN_PANEL_COLUMNS + 2 - (viewport.width - width), 0),
        )
        return game.draw_board(options, snapshot)

    def _panel_facts(self, snapshot: SeatSnapshot) -> PanelFacts:
        """Return the side panel's facts: of the view, the record, the ghost and the hint."""
        game, state = self._game, self._state
        shows_hint = not game.session.over and game.human_seats and not game.hints_forbidden
        record = [("record", state.best_return)] if state.best_return else []
        reason = [(heading.explain_hidden_reward(game), "")]
        rows = game.view_module.panel_rows(snapshot.view)
        explained = chain(*([row, *reason * (row == HIDDEN_REWARD)] for row in rows))
        facts = [*explained, *record, *_ghost_facts(game)]
        facts += _hint_facts(state.hint) if shows_hint else []
        return (*facts, *_rule_facts(game))  # last, so that a full panel leaves out the rules


def has_goal_row(viewport: Viewport) -> bool:
    """Return whether the goal has a row of its own; if not, the log begins with the goal."""
    return viewport.height >= MIN_GOAL_ROWS


def _current_page(viewport: Viewport, frame_state: FrameState) -> ScreenRows:
    """Return the current page of a long message; the last page if there are fewer pages by now."""
    parts = split_pages(viewport, frame_state)
    return parts[min(frame_state.page_index, len(parts) - 1)]


def split_pages(viewport: Viewport, frame_state: FrameState) -> list[ScreenRows]:
    """Split a long message into pages that fit the viewport, with page numbers if several."""
    entries = [wrap_lines([escape_unprintable(entry)], viewport) for entry in frame_state.page_rows]
    rows = [*chain(*entries)]
    body = max(viewport.height - 3, 1)
    if len(rows) <= body:
        return [rows]
    if body == 1:
        return [[row] for row in rows]
    page_height = body - 1
    pages: list[list[ScreenLine]] = [[]]
    for entry in entries:  # one that fits on a page is not divided
        if page_height - len(pages[-1]) < len(entry) <= page_height:
            pages.append([])
        for row in entry:
            if len(pages[-1]) == page_height:
                pages.append([])
            pages[-1].append(row)
    parts: list[ScreenRows] = []
    for page_number, page in enumerate(pages, 1):
        is_last = page_number == len(pages)
        key_help = "Esc closes this page" if is_last else "Space shows the next page"
        page_label = (f" page {page_number} of {len(pages)}; {key_help}", "dim")
        parts.append([*page, *[""] * (page_height - len(page)), (page_label,)])
    return parts


def _handover_rows(agent: str, viewport: Viewport) -> ScreenRows:
    """Return the notice that hides a player's board until the keyboard is passed to `agent`."""
    notice = f"pass the keyboard to {escape_unprintable(agent)}; Enter shows the board."
    rows = wrap_lines([notice], viewport)
    return ["", *rows] if len(rows) < viewport.height - 3 else rows


def _join_parts(parts: Sequence[ScreenRows], viewport: Viewport) -> Text:
    """Join groups of rows into one text, each row cut to the viewport's width."""
    return Text("\n", no_wrap=True).join(
        [to_rich_text(fit_line(row, viewport)) for row in chain(*parts)]
    )


class _BoardLayout(NamedTuple):
    """The rows of goal, board and panel, and the position and size of the log."""

    rows: tuple[ScreenLine, ...]
    log_viewport: Viewport
    is_log_beside: bool  # If True, the log is at the right, in rows padded to its first column.


def _layout_log_beside(
    panel_facts: PanelFacts, board: Text, viewport: Viewport, body_height: int
) -> _BoardLayout:
    """Lay out the panel at the right of the board, and the log under the panel."""
    width = viewport.width - measure_text(board)[0] - 2
    facts = format_panel(panel_facts, width)
    rows = [
        row.copy()
        for row in _join_board_and_panel(
            board.plain, tuple(board.spans), panel_facts, width, body_height
        )
    ]
    log_column = measure_text(board)[0] + 1
    for row in rows[len(facts) :]:
        row.append(" " * (log_column - len(row)))
    return _BoardLayout(
        (*rows,),
        Viewport(viewport.width - log_column, body_height - len(facts) - 1, viewport.ascii_only),
        is_log_beside=True,
    )


def _layout_log_below(
    panel_facts: PanelFacts,
    board: Text,
    viewport: Viewport,
    body_height: int,
    min_rows_below: int = MIN_LOG_ROWS,
) -> _BoardLayout:
    """Lay out the panel at the right of the board, if it fits, and the log below.

    A panel that is longer than the board leaves `min_rows_below` rows; the log has at most
    MAX_LOG_ROWS_BELOW.
    """
    width = viewport.width - measure_text(board)[0] - 2
    facts = panel_facts if width >= MIN_PANEL_COLUMNS else ()
    rows = _join_board_and_panel(
        board.plain, tuple(board.spans), facts, width, max(body_height - min_rows_below - 1, 0)
    )
    log_height = min(max(body_height - len(rows) - 1, 0), MAX_LOG_ROWS_BELOW)
    return _BoardLayout(
        (*rows, ""), Viewport(viewport.width, log_height, viewport.ascii_only), is_log_beside=False
    )


@lru_cache(256)  # A recording shows the same board and facts many times.
def _join_board_and_panel(
    plain: str, spans: tuple[Span, ...], panel_facts: PanelFacts, width: int, max_rows: int
) -> tuple[Text, ...]:
    """Return the rows of a drawing with the panel at its right.

    A panel longer than the drawing has at most `max_rows` rows.
    """
    rows, facts = [*_split_board(plain, spans)], format_panel(panel_facts, width)
    panel_column = max(map(len, rows)) + 2
    rows += [Text("") for _ in range(len(rows), min(len(facts), max_rows))]
    if len(facts) > len(rows) > 1:
        omitted_count = len(facts) - len(rows) + 1
        facts = (*facts[: len(rows) - 1], Text(f"({omitted_count} more)", "dim"))
    joined_rows = [
        _join_row(
            f"{row.plain:<{panel_column}}",
            tuple(row.spans),
            fact.plain,
            _list_spans_with_base(fact),
        )
        for row, fact in zip(rows, facts, strict=False)
    ]
    return (*joined_rows, *rows[len(joined_rows) :])


@lru_cache(256)
def _split_board(plain: str, spans: tuple[Span, ...]) -> tuple[Text, ...]:
    """Return the rows of a drawing; cached like the joined rows."""
    return tuple(split_styled_rows(plain, spans))


@lru_cache(1024)
def _join_row(
    row: str, row_spans: tuple[Span, ...], fact: str, fact_spans: tuple[Span, ...]
) -> Text:
    """Return a padded row of a drawing with a fact at its right; cached like the rows."""
    return Text(row + fact, spans=[*row_spans, *(span.move(len(row)) for span in fact_spans)])


def _list_spans_with_base(text: Text) -> tuple[Span, ...]:
    """Return the spans of a text, with that of its own style."""
    own_span = [Span(0, len(text), text.style)] if text.style else []
    return *own_span, *text.spans


def _ghost_facts(game: Game) -> list[tuple[str, str]]:
    """Return the panel facts of a visible ghost: its score and the player's lead."""
    ghost = game.ghost
    if ghost is None or not ghost.is_shown_during_play:
        return []
    lead = format_reward(ghost.player_lead, sign="+")
    return [("ghost", format_reward(ghost.score)), ("lead", lead)]


def _rule_facts(game: Game) -> list[tuple[str, str]]:
    """Return the panel facts of the other players: their names and their rules."""
    agents_by_rule: dict[tuple[str, str], list[str]] = {}
    for agent, *rule in game.other_players:
        name, clause = map(escape_unprintable, rule)
        agents_by_rule.setdefault((name, clause), []).append(agent)
    rows = [
        [(", ".join(agents), name), (clause, "")]
        for (name, clause), agents in agents_by_rule.items()
    ]
    return [row for row in chain(*rows) if row[0]]


def _hint_facts(hint: Hint | None) -> list[tuple[str, str]]:
    """Return the panel facts of the hint: action values, best first, or else the hint key.

    Of ratings, which only compare actions, the differences to the best one are shown.
    """
    if hint is None or not hint.value_rows:
        return [("hint", "Tab")]
    name = hint.values_basis.accuracy.words
    heading = [(text, "") for text in (name, *hint.game.split(", ")) if text]
    rows = hint.value_rows
    if hint.values_basis.accuracy is Accuracy.RATING and hint.ranked_actions:
        ranked = hint.ranked_actions[: len(rows)]
        names = {a: EQUALLY_GOOD_LABEL for a, lost in ranked if not lost} | {
            hint.action: BEST_LABEL
        }
        rows = [(hint.labels[a], names.get(a, f"{-lost:.0f}")) for a, lost in ranked]
    return [*heading, *((f"  {label}", number) for label, number in rows)]
