"""The play screen: the state of the full-screen user interface of a game."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from threading import Thread
from typing import TYPE_CHECKING

from rich.text import Text

from dmplay.core.problem import ContinuousStates
from dmplay.core.text import escape_unprintable, format_reward
from dmplay.core.work_budget import ComputationStopped
from dmplay.errors import DmplayError
from dmplay.game import player_records
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.command_reply import DataReply, Page, TurnReports
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.hints.hint_provider import HINT_OVERLAYS
from dmplay.game.key_bindings import KEY_SYMBOLS
from dmplay.game.playback import Playback
from dmplay.registry.problems import is_built_in
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter
from dmplay.tutor.lesson import LOOKING_BACK, OVER, PLAYING, ScreenNote, find_note
from dmplay.ui.screen import frame
from dmplay.ui.screen.event_log import EventLog
from dmplay.ui.screen.footer import WHY_KEY_HELP, format_footer
from dmplay.ui.screen.frame_state import FrameState, Viewport, find_cursor
from dmplay.ui.screen.log_rows import list_record_lines
from dmplay.ui.screen.modes import Mode, ModeEvent, ScreenModes
from dmplay.ui.screen.number_input import NumberInput
from dmplay.ui.screen.post_game_timeline import GameTimeline, PostGameReview
from dmplay.ui.screen.realtime_clock import CLOCK_START_HINT, RealtimeClock, find_clock
from dmplay.ui.screen.screen_protocols import KeyDrivenScreen
from dmplay.ui.screen.turn_animation import TurnAnimation
from dmplay.ui.shell.commands import PlayerQuit

if TYPE_CHECKING:  # Most games need no algorithms.
    from dmplay.game.watching import WatchedSteps

MAX_POSITION_COLUMNS = 40  # columns of the row that shows the position in a replay
SHORT_LOST_MEDAL = "(no medal)"
OVERLAYS = ("", "values", "policy", "states")
OVERLAY_LABELS = {
    "values": "values",
    "policy": "best actions",
    "states": "the number of the state in which you stand on each hex (0, 1, 2, ...)",
}
VALUES_MEANING = "of each hex, if you stood there"  # the meaning of the values on hex maps
VALUES_TASK = TaskInfo("computing the value of every state")


class PlayScreen:
    """The play screen: its state in addition to the game's, and its painting."""

    thinking_delay_seconds = 0.1  # seconds a key may take before progress is shown

    def __init__(
        self,
        controller: GameController,
        terminal: Terminal,
        speed: float = 2.0,
        realtime_rate: float | None = None,
        notes: Sequence[ScreenNote] = (),
    ) -> None:
        self.controller = controller
        controller.is_interactive = True
        controller.on_intermediate_turn = self.log_new_turns
        controller.open_viewer = self.open_viewer
        controller.open_lesson = None  # The screen is occupied.
        self.viewer: KeyDrivenScreen | None = None  # shows an algorithm in place of the game
        self.terminal = terminal
        self._notes = notes  # what a lesson says about some moments of a game
        self.speed = speed  # turns per second in autoplay
        # turns per second in real time; None if each turn waits for a key
        self.realtime_rate = realtime_rate
        self.is_clock_fixed = realtime_rate is not None  # whether P only pauses the clock
        self.learns_from_game = False  # whether the player left to find better actions
        self.modes = ScreenModes()
        self.message = ""
        self.next_problem = ""  # to play after this game, as the gallery lists them
        self.loses_medal = False  # whether the last key was the first help of the game
        self.lookahead_message = ""  # the previewed action in words
        self.progress_message = ""  # progress of the running task, shown in place of the message
        self.overlay_index = 0
        # whether hex maps show their coordinates; None if they have room for them
        self.show_coordinates: bool | None = None
        # overlay, game, turn and seat of the last recorded hint
        self._recorded_overlay: tuple[object, ...] = ()
        self.page_rows: list[str] = []  # rows of a long message
        self.page_index = 0  # index of the visible page
        self.page_key = ""  # the key that opened the page, and only closes it
        self._viewport = Viewport(80, 24)
        self._reset_for_game()
        if (
            controller.game.human_seats
            and controller.game.request
            and controller.game.recorder is None
        ):
            self.message = "this game is not saved: dmplay has no folder to write to"
        self.message = controller.game.warning or self.message

    def _reset_for_game(self) -> None:
        """Reset the state that belongs to one game, when a new game starts."""
        game = self.game
        self._event_log = EventLog(game)
        self.number_input = NumberInput()  # number that the player is typing
        self.key_prefix = ""  # first arrow of a diagonal
        self.prediction_text = ""  # prediction that the player is typing
        # turn from which the board no longer shows the keys
        if not (self.is_clock_fixed or find_clock(game)):
            self.realtime_rate = None
        self._restart_clock()
        self.post_game_review = PostGameReview()  # review of the game, once it is over
        self.animation = TurnAnimation()
        self.typed_turn = ""  # digits of the turn to go to in a replay
        # of a replay, once its worst choice was asked for
        self.replay_timeline: GameTimeline | None = None
        self.scroll_offset = 0  # rows by which the log is scrolled back
        record = player_records.find_game_record(game)
        self._best_return = (
            format_reward(record.best.discounted_return) if record and record.best else ""
        )

    def _restart_clock(self) -> None:
        """Let the clock wait for its first key, or stop it if there is no rate."""
        game = self.game
        clock = find_clock(game)
        labels = clock.idle_actions if clock else ()
        idle_actions = [game.problem.parse_action(game.viewing_seat, label) for label in labels]
        self.clock = RealtimeClock(
            self.realtime_rate, is_rising=self.is_clock_fixed, idle_actions=idle_actions
        )
        self.modes.set_play_mode(is_realtime=bool(self.realtime_rate and game.human_seats))

    def set_clock_rate(self, rate: float | None) -> None:
        """Start the clock at a rate in turns per second, or let each turn wait for a key."""
        self.realtime_rate = rate
        self._restart_clock()

    @property
    def clock_keys(self) -> tuple[str, ...]:
        """The keys of the clock for the key row; none if the game has no clock."""
        game = self.game
        if game.choosing_seat is None or not (self.realtime_rate or find_clock(game)):
            return ()
        if not self.realtime_rate:
            return ("P real-time",)
        return ("P pause" if self.is_clock_fixed else "P stop", "+ faster", "- slower")

    @property
    def game(self) -> Game:
        """The current game."""
        return self.controller.game

    def measure_viewport(self, painter: Painter) -> Viewport:
        """Measure the terminal and return its viewport, which is also saved."""
        self._viewport = Viewport(*painter.get_size(), self.terminal.ascii)
        return self._viewport

    def paint(self, painter: Painter) -> None:
        """Paint the current screen onto the terminal."""
        if self.viewer:
            self.viewer.paint(painter)
            return
        self._record_overlay_hint()
        self._report_write_notice()
        viewport = self.measure_viewport(painter)
        self._announce_help()
        frame_text = frame.compose_frame(
            self.timeline or self.game, viewport, self.frame_state, self.log
        )
        painter.paint(frame_text, find_cursor(frame_text))

    def _announce_help(self) -> None:
        """Say once, beside the message, that the game counts for no medal because of help."""
        self.loses_medal = self.loses_medal or bool(self.controller.pop_medal_notice())

    def _report_write_notice(self) -> None:
        """Log once that the transcript cannot be written, or is written again."""
        notice = escape_unprintable(self.controller.take_write_notice())
        if notice:
            self._event_log.add_notice(notice)
            self.message = notice

    def _record_overlay_hint(self) -> None:
        """Record a visible overlay of values or policy as a hint, once per turn."""
        game, frame_state = self.game, self.frame_state
        overlay_key = (frame_state.overlay, game, len(game.session.turns), game.viewing_seat)
        is_visible = frame_state.overlay in HINT_OVERLAYS and not (
            frame_state.page_rows or frame_state.handover_agent or game.session.over
        )
        if (
            is_visible
            and overlay_key != self._recorded_overlay
            and game.hint_provider.build_overlay(frame_state.overlay)
        ):
            self._recorded_overlay = overlay_key
            game.record_hint()

    @property
    def frame_state(self) -> FrameState:
        """The state that the screen adds to the game in the current frame."""
        game, adviser, timeline = self.game, self.game.hint_provider, self.timeline
        can_overlay = adviser.is_overlay_ready and not game.hints_forbidden
        is_unstarted = self.modes.play_mode is Mode.REALTIME and not self.clock.is_started
        start_hint = CLOCK_START_HINT if is_unstarted and game.choosing_seat is not None else ""
        state = FrameState(
            self.progress_message
            or self._shorten_message_with_notice
            or start_hint
            or self._next_game_hint,
            OVERLAYS[self.overlay_index] if can_overlay else "",
            self.page_rows if self.modes.display_mode is Mode.PAGE else (),
            self.page_index,
            self.scroll_offset,
            handover_agent=game.problem.agents[game.viewing_seat]
            if self.controller.awaiting_handover
            else "",
            motion_progress=self.animation.progress,
            best_return=self._best_return,
            show_coordinates=self.show_coordinates,
            note=self._find_note() if self._notes else "",
            clock_keys=self.clock_keys,
        )
        if self.replay_timeline:
            state = state._replace(worst_key="X worst" * bool(self.replay_timeline.worst_turns))
        if timeline:
            return state._replace(hint=timeline.move_hints, is_lookback=True)
        typed_action = self.number_input.read_action(game) if self.number_input.text else None
        return state._replace(
            hint=adviser.current_hint, typed_action=typed_action, forecast=adviser.current_forecast
        )

    @property
    def _next_game_hint(self) -> str:
        """The problem to play next, at the end of a game that was opened from the gallery."""
        is_over = self.game.session.over and self.game.human_seats and not self.timeline
        keys = "q, then Enter plays it"
        return f"next game: {self.next_problem}; {keys}" if is_over and self.next_problem else ""

    def _find_note(self) -> str:
        """Return the note of a lesson about this moment; '' if there is none."""
        session = self.game.session
        phase = LOOKING_BACK if self.timeline else OVER if session.over else PLAYING
        return find_note(self._notes, session, phase)

    @property
    def _shorten_message_with_notice(self) -> str:
        """The message, and after the first help that it costs the medal."""
        message = self._shorten_message
        if not self.loses_medal:
            return message
        free_columns = self._viewport.width - len(message) - 3
        notice = player_records.LOST_MEDAL
        notice = notice if len(notice) < free_columns else SHORT_LOST_MEDAL
        return "   ".join(filter(None, [message, notice]))

    @property
    def _shorten_message(self) -> str:
        """The message, shortened to the next keys if it is a preview that the board shows as well.

        A preview also has its short form if its message is too long for the row.
        """
        if not self.lookahead_message or self.message != self.lookahead_message:
            return self.message
        is_continuous = isinstance(self.game.problem.state_count, ContinuousStates)
        if len(self.message) < self._viewport.width and not (
            is_continuous or frame.has_goal_row(self._viewport)
        ):
            return self.message
        return f"what {self.message.partition(': ')[0]}? Enter plays it, Esc cancels"

    @property
    def timeline(self) -> GameTimeline | None:
        """The game at the earlier turn that is shown, or None."""
        return self.post_game_review.timeline if self.modes.is_lookback else None

    @property
    def log(self) -> list[str]:
        """The rows of the event log, limited to the information of the viewing player."""
        if self.timeline:
            return self.timeline.review_rows(self._viewport.width)
        marks = dict[int, str]()  # in a running game they would be hints
        if isinstance(self.game, Playback) and self.replay_timeline:
            marks = self.replay_timeline.verdict.marks
        elif self.game.session.over:
            marks = self.game.verdict.marks
        return [*self._event_log.mark_rows(marks), *self._timeline_rows()]

    def _timeline_rows(self) -> list[str]:
        """Return the timeline of a replay: the position, and the regrets once they are known."""
        game = self.game
        if not isinstance(game, Playback):
            return []
        turn, turn_count = len(game.session.turns), game.count_turns()
        position = f"turn {turn} of {turn_count} "
        if self.replay_timeline and turn < self.replay_timeline.turn_count:
            self.replay_timeline.go_to_turn(turn)
            return [position, *self.replay_timeline.regret_rows(self._viewport.width)]
        columns = min(MAX_POSITION_COLUMNS, max(self._viewport.width - len(position) - 4, 1))
        marker = round((columns - 1) * turn / max(turn_count, 1))
        return [f"{position}{'─' * marker}●{'─' * (columns - 1 - marker)}"]

    def _build_frame(self, viewport: Viewport) -> frame.Frame:
        """Return the current frame for a viewport."""
        return frame.Frame(self.timeline or self.game, viewport, self.frame_state, self.log)

    def render_upper(self, viewport: Viewport) -> Text:
        """Return the current screen as text without the command row and the key row."""
        return self._build_frame(viewport).render_upper()

    def scroll_log(self, rows: float) -> None:
        """Scroll the log back by `rows`, or forward if negative, within its bounds."""
        if not self.controller.awaiting_handover:
            max_offset = self._build_frame(self._viewport).max_scroll_offset()
            self.scroll_offset = int(min(max(self.scroll_offset + rows, 0), max_offset))

    def scroll_log_page(self, page_count: float) -> None:
        """Scroll the log back by one page, or forward if negative, without a gap or overlap."""
        frame_now = self._build_frame(self._viewport)
        page = frame_now.page_height()
        is_on_first_page = 0 < self.scroll_offset <= page + 1
        rows = page if page_count > 0 else -(page + is_on_first_page)
        self.scroll_log(rows)

    def open_record(self) -> None:
        """Open the complete record of a finished game as a page."""
        self.open_page(list_record_lines(self.game, self.log))

    @property
    def has_notes(self) -> bool:
        """Return whether a lesson explains this game to a beginner."""
        return bool(self._notes)

    @property
    def page_count(self) -> int:
        """The number of parts of the open page on this screen."""
        return len(frame.split_pages(self._viewport, self.frame_state))

    def turn_page(self, page_count: float) -> bool:
        """Turn `page_count` pages forward, or back if negative; return whether it moved forward."""
        previous_index = self.page_index
        self.page_index = int(min(max(previous_index + page_count, 0), self.page_count - 1))
        return self.page_index > previous_index

    def toggle_coordinates(self) -> None:
        """Show or hide the coordinates on a hex map; show a message if the board has none."""
        plain_screen = self.render_upper(self._viewport).plain
        for self.show_coordinates in (True, False):
            if self.render_upper(self._viewport).plain != plain_screen:
                state = "shown, as the log names them" if self.show_coordinates else "hidden"
                self.message = f"coordinates: {state}"
                return
        self.show_coordinates = None
        self.message = "this board shows no coordinates"

    def show_next_overlay(self) -> None:
        """Show the next overlay that changes the board, or none after the last one.

        Show a message if the board has no overlays. Raise an error if hints are forbidden.
        """
        self.game.check_hints_allowed("overlay")
        run_cancellable(VALUES_TASK, self.game.hint_provider.prepare_overlay)
        previous_overlay, self.overlay_index = self.overlay_index, 0
        plain_screen = self.render_upper(self._viewport).plain
        for index in range(previous_overlay + 1, len(OVERLAYS)):
            self.overlay_index = index
            if self.render_upper(self._viewport).plain != plain_screen:
                provider = self.game.hint_provider
                shown_turns = len((self.timeline or self.game).session.turns)
                has_values = OVERLAYS[index] == "values"
                label = f"{provider.values_basis.accuracy.words} {VALUES_MEANING}"
                parts = [
                    f"overlay: {label if has_values else OVERLAY_LABELS[OVERLAYS[index]]}",
                    provider.describe_game(shown_turns) * (OVERLAYS[index] in HINT_OVERLAYS),
                ]
                self.message = ", ".join(filter(None, parts))
                return
        self.overlay_index = 0
        self.message = "overlay: none" if previous_overlay else "this board has no overlays"

    @contextlib.contextmanager
    def show_errors_as_messages(self) -> Iterator[None]:
        """Run the block with its errors shown as messages.

        Turns played before an error are logged. Without an error, the visible overlay is prepared;
        after one, an overlay that is not ready is removed.
        """
        try:
            yield
            if self.overlay_index:
                run_cancellable(VALUES_TASK, self.game.hint_provider.prepare_overlay)
        except (DmplayError, ComputationStopped) as error:
            self.log_new_turns()
            self.overlay_index = (
                self.overlay_index if self.game.hint_provider.is_overlay_ready else 0
            )
            agent = self.game.problem.agents[self.game.viewing_seat]
            own_prefix = f"turn {len(self.game.session.turns) + 1}, {agent}: "
            self.message = str(error).removeprefix(own_prefix) or "cancelled"

    def open_viewer(self, watched: "WatchedSteps") -> str:
        """Show the steps of an algorithm instead of the game until the player leaves; return ''."""
        from dmplay.ui.watch.step_viewer import StepViewer

        self.modes.handle_event(ModeEvent.STOPPED)  # agents and the clock wait
        self.viewer = StepViewer(watched, self.terminal, self.speed)
        self.viewer.handle_key("")
        return ""

    def handle_viewer_key(self, key: str) -> None:
        """Pass a key, or '' for a clock beat, to the viewer; return to the game if it quits."""
        if self.viewer:
            try:
                self.viewer.handle_key(key)
            except PlayerQuit:
                self.viewer = None

    def show_reply(self, reply: str) -> None:
        """Show a command's reply: in the message row, or as a page if it has several rows.

        Reports of turns go into the log only. A hint is shortened, because its values are on the
        board.
        """
        rows = reply.split("\n") if isinstance(reply, Page) else []
        if (
            isinstance(reply, DataReply)
            and reply.rows
            and not self._build_frame(self._viewport).fits_log(reply)
        ):
            rows = [*reply.rows]
        hint = self.game.hint_provider.current_hint
        if rows and not isinstance(reply, TurnReports):
            self.open_page(rows)
        else:
            self.modes.handle_event(ModeEvent.CLOSED)
            self.message = "" if rows else reply
            if hint and reply == str(hint):  # The board and the keys show the values.
                keys, reward_text = {}, ""
                if hint.action is not None:
                    listed = self.game.keyboard.list_actions_with_keys(self.game.view())
                    keys = {label: KEY_SYMBOLS.get(key, key) for key, label, _ in listed}
                    reward_text = self.game.describe_expected_reward(hint.action)
                self.message = hint.name_key(keys.get(hint.recommended_action, "")) + reward_text
                footer = format_footer(self.game, self._viewport, self.frame_state).plain
                is_number = self.game.keyboard.is_number_entry(self.game.viewing_seat)
                key_helps = [
                    "Enter plays it" * (is_number and hint.action is not None),
                    WHY_KEY_HELP * (WHY_KEY_HELP not in footer),
                ]
                for key_help in filter(None, key_helps):
                    fits = len(self.message) + len(key_help) + 3 < self._viewport.width
                    self.message += f"   {key_help}" * fits
        self.log_new_turns(rows)

    def may_take_long(self, key: str) -> bool:
        """Return whether a key does more than to play a turn of people in a built-in problem."""
        if self.viewer:
            return self.viewer.may_take_long(key)
        game = self.game
        is_people_only = len(game.human_seats) == len(game.player_names) and not game.ghost
        is_plain_turn = (
            is_people_only
            and self.modes.display_mode is Mode.BOARD
            and not (self.overlay_index or game.predictor)
            and game.is_action_key(key)
        )
        return not (is_plain_turn and is_built_in(game.problem))

    @property
    def follow_up(self) -> Callable[[], None] | None:
        """The review of a game that has just ended; None in all other cases."""
        return self.review_game if self.post_game_review.is_due(self.game) else None

    def review_game(self) -> None:
        """Review the game if it has ended, for the log and for stepping through its turns.

        Its result is recorded at once, as the player may close the window.
        """
        try:
            self.post_game_review.review_game(self.game)
        finally:
            self.controller.record_result()

    def load_hints_in_background(self) -> None:
        """Import the agents that give hints, so that no key press waits for it."""
        game = self.game
        Thread(target=game.import_hint_agents, daemon=True).start()

    def open_page(self, rows: list[str]) -> None:
        """Open a page of rows in place of the board."""
        self.message, self.page_rows, self.page_index, self.page_key = "", rows, 0, ""
        self.modes.handle_event(ModeEvent.PAGE_OPENED)

    def restart_log(self) -> None:
        """Replace the log by the last turn alone, after a jump to another turn of a replay."""
        self._event_log, self.scroll_offset = EventLog(self.game), 0

    def log_new_turns(self, turn_rows: Sequence[str] = ()) -> None:
        """Log the new turns; `turn_rows` are their reports in a command's reply.

        A new game resets the screen.
        """
        if self._event_log.game is not self.game:
            self._reset_for_game()
            self.load_hints_in_background()
        elif self._event_log.add_new_turns(turn_rows):
            self.scroll_offset = 0
            self.message = "" if self.message == self.log[-1] else self.message
        scored = self.game.pop_scored_prediction()
        if scored:
            self._event_log.add_notice(scored.text)

    def show_progress(self, task_info: TaskInfo, progress: str) -> None:
        """Show a running task, its progress if motion is allowed, and the cancel key if it fits."""
        if self.viewer:
            self.viewer.show_progress(task_info, progress)
            return
        message = f"{task_info.message} ... {progress if self.terminal.motion else ''}"
        cancel_help = "Ctrl-C cancels"
        self.progress_message = (
            f"{message}{cancel_help}"
            if len(message + cancel_help) < self._viewport.width
            else message
        )

    def abandon_task(self) -> None:
        """Abandon a task that was cancelled but does not stop, and recreate the game's agents."""
        if self.viewer:
            self.viewer.abandon_task()
        self.game.recreate_agents()
        self.message = "cancelled; play on. The computation still runs to its end in the background"
