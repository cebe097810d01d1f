"""The play screen: the game at a table as it is seen, and what is said beside it."""

import contextlib
from collections.abc import Iterator, Sequence

from rich.text import Text

from dmplay import records
from dmplay.budget import ComputationStopped
from dmplay.core import ContinuousStates
from dmplay.describe import format_score
from dmplay.errors import DmplayError
from dmplay.game.answer import Page, TurnReports
from dmplay.game.game import Game
from dmplay.game.log import EventLog
from dmplay.game.table import GameController
from dmplay.painting.painter import Painter
from dmplay.screen import frame
from dmplay.screen.clock import CLOCK_START_HINT, RealtimeClock
from dmplay.screen.modes import Mode, ModeEvent, ScreenModes
from dmplay.screen.motion import TurnAnimation
from dmplay.screen.number import NumberInput
from dmplay.screen.shown import KEY_HINT_TURNS, FrameState, Viewport, find_cursor
from dmplay.terminal import Terminal
from dmplay.thought import TaskInfo, run_cancellable
from dmplay.timeline import GameTimeline, PostGameReview

OVERLAYS = ("", "values", "policy", "states")
HINT_OVERLAYS = ("values", "policy")  # of them
VALUES_TASK = TaskInfo("valuing every state")


class PlayScreen:
    """The state of the play screen beside the game's own, and how it is shown."""

    thinking_delay_seconds = 0.1  # seconds after which what the game does is shown as thinking

    def __init__(
        self,
        controller: GameController,
        terminal: Terminal,
        speed: float = 2.0,
        realtime_rate: float | None = None,
    ) -> None:
        self.controller = controller
        controller.is_interactive = True
        controller.on_intermediate_turn = self.log_new_turns
        self.terminal = terminal
        self.speed = speed  # turns a second in autoplay
        self.realtime_rate = (
            realtime_rate  # turns a second in real time; None where each turn waits for a key
        )
        self.modes = ScreenModes()
        self.message = ""
        self.lookahead_message = ""  # what an action may bring, in words
        self.progress_message = ""  # what is computed now, in place of the message
        self.overlay_index = 0
        self._recorded_overlay: tuple[object, ...] = ()  # where an overlay was counted last
        self.page_rows: list[str] = []  # an answer of several lines
        self.page_index = 0  # of the page
        self._viewport = Viewport(80, 24)
        self._reset_for_game()
        if (
            controller.game.human_seats
            and controller.game.request
            and controller.game.recorder is None
        ):
            self.message = "this game is not kept: there is no place to write to"
        self.message = controller.game.warning or self.message

    def _reset_for_game(self) -> None:
        """Forgets the game before this one."""
        game = self.game
        self._event_log = EventLog(game)
        self.number_input = NumberInput()  # that is being typed
        self.key_prefix = ""  # the first arrow of a diagonal
        self.last_key_hint_turn = KEY_HINT_TURNS  # the turn from which on the board names no keys
        self.clock = RealtimeClock(self.realtime_rate)
        self.post_game_review = PostGameReview()  # once it is over
        self.animation = TurnAnimation()
        self.scroll_offset = 0  # rows that the log is scrolled back
        record = records.record_for_game(game)
        self._best_return = (
            format_score(record.best.discounted_return) if record and record.best else ""
        )
        self.modes.start_game(is_realtime=bool(self.realtime_rate and game.human_seats))

    @property
    def game(self) -> Game:
        """The game that is played now."""
        return self.controller.game

    def measure_viewport(self, painter: Painter) -> Viewport:
        """The terminal, of the size that it has now."""
        self._viewport = Viewport(*painter.get_size(), self.terminal.ascii)
        return self._viewport

    def paint(self, painter: Painter) -> None:
        """Brings the screen as it is now onto the terminal."""
        self._record_overlay_hint()
        room = self.measure_viewport(painter)
        drawn = frame.compose_frame(self.timeline or self.game, room, self.frame_state, self.log)
        painter.paint(drawn, find_cursor(drawn))

    def _record_overlay_hint(self) -> None:
        """Counts the advice of an overlay once for each turn that it lies on."""
        game, shown = self.game, self.frame_state
        now = (shown.overlay, game, len(game.session.turns), game.viewing_seat)
        lies = shown.overlay in HINT_OVERLAYS and not (
            shown.page_rows or shown.handover_agent or game.session.over
        )
        if (
            lies
            and now != self._recorded_overlay
            and game.hint_provider.build_overlay(shown.overlay)
        ):
            self._recorded_overlay = now
            game.record_hint()

    @property
    def frame_state(self) -> FrameState:
        """What the screen adds to the game."""
        game, adviser, past = self.game, self.game.hint_provider, self.timeline
        drawn = adviser.is_overlay_ready and not game.hints_forbidden
        unstarted = self.modes.play_mode is Mode.REALTIME and not self.clock.is_started
        starts = CLOCK_START_HINT if unstarted and game.choosing_seat is not None else ""
        shown = FrameState(
            self.progress_message or self._displayed_message or starts,
            OVERLAYS[self.overlay_index] if drawn else "",
            self.page_rows if self.modes.display_mode is Mode.PAGE else (),
            self.page_index,
            self.scroll_offset,
            handover_agent=game.problem.agents[game.viewing_seat]
            if self.controller.awaiting_handover
            else "",
            last_key_hint_turn=self.last_key_hint_turn,
            motion_progress=self.animation.progress,
            best_return=self._best_return,
        )
        if past:
            return shown._replace(hint=past.move_hints, is_lookback=True)
        written = self.number_input.read_action(game) if self.number_input.text else None
        return shown._replace(
            hint=adviser.current_hint, typed_action=written, forecast=adviser.current_forecast
        )

    @property
    def _displayed_message(self) -> str:
        """The message; of what an action may bring, where the board has room for it, or no row has,
        how to go on.
        """
        if not self.lookahead_message or self.message != self.lookahead_message:
            return self.message
        numbers = isinstance(self.game.problem.state_count, ContinuousStates)
        if len(self.message) < self._viewport.width and not (
            numbers or frame.has_goal_row(self._viewport)
        ):
            return self.message
        return f"{self.message.partition(': ')[0]}: Enter plays it, Esc leaves"

    @property
    def timeline(self) -> GameTimeline | None:
        """The game at the turn that is looked back at."""
        return self.post_game_review.timeline if self.modes.display_mode is Mode.LOOKBACK else None

    @property
    def log(self) -> list[str]:
        """What happened, as the one before the screen may know it."""
        return (
            self.timeline.review_rows(self._viewport.width)
            if self.timeline
            else self._event_log.rows
        )

    def _build_frame(self, viewport: Viewport) -> frame.Frame:
        """What is seen now, in a room."""
        return frame.Frame(self.timeline or self.game, viewport, self.frame_state, self.log)

    def render_upper(self, viewport: Viewport) -> Text:
        """The screen above its command row."""
        return self._build_frame(viewport).render_upper()

    def scroll_log(self, rows: float) -> None:
        """Goes so many rows back in the log, or on."""
        if not self.controller.awaiting_handover:
            most = self._build_frame(self._viewport).max_scroll_offset()
            self.scroll_offset = int(min(max(self.scroll_offset + rows, 0), most))

    def turn_page(self, page_count: float) -> bool:
        """Goes so many parts on in the page, or back; whether it went on."""
        before, last = self.page_index, len(frame.split_pages(self._viewport, self.frame_state)) - 1
        self.page_index = int(min(max(before + page_count, 0), last))
        return self.page_index > before

    def show_next_overlay(self) -> None:
        """Goes on to what else the board can show, at last nothing; says so if it never can."""
        self.game.check_hints_allowed("overlay")
        run_cancellable(VALUES_TASK, self.game.hint_provider.prepare_overlay)
        before, self.overlay_index = self.overlay_index, 0
        bare = self.render_upper(self._viewport).plain
        for number in range(before + 1, len(OVERLAYS)):
            self.overlay_index = number
            if self.render_upper(self._viewport).plain != bare:
                self.message = f"overlay: {OVERLAYS[number]}"
                return
        self.overlay_index = 0
        self.message = "overlay: none" if before else "this board has no overlays"

    @contextlib.contextmanager
    def errors_as_messages(self) -> Iterator[None]:
        """Turns an error into a message, and logs what happened before it; readies the overlay."""
        try:
            yield
            if self.overlay_index:
                run_cancellable(VALUES_TASK, self.game.hint_provider.prepare_overlay)
        except (DmplayError, ComputationStopped) as error:
            self.log_new_turns()
            self.overlay_index = (
                self.overlay_index if self.game.hint_provider.is_overlay_ready else 0
            )
            self.message = str(error) or "cancelled"

    def show_reply(self, reply: str) -> None:
        """Shows an answer: in its row, or as a page that any key closes; logs what it tells of."""
        rows = reply.split("\n") if isinstance(reply, Page) else []
        advice = self.game.hint_provider.current_hint
        if rows and not isinstance(reply, TurnReports):
            self.open_page(rows)
        else:
            self.modes.handle_event(ModeEvent.CLOSED)
            self.message = "" if rows else reply
            if advice and reply == str(advice):  # its values are marked
                cost = (
                    ""
                    if advice.action is None
                    else self.game.describe_expected_reward(advice.action)
                )
                self.message = f"{advice.summary}{cost}"
        self.log_new_turns(rows)

    def open_page(self, rows: list[str]) -> None:
        """Shows rows in place of the board."""
        self.message, self.page_rows, self.page_index = "", rows, 0
        self.modes.handle_event(ModeEvent.PAGE_OPENED)

    def log_new_turns(self, turn_rows: Sequence[str] = ()) -> None:
        """Logs what happened since the last time; `told` are the turns of an answer."""
        if self._event_log.game is not self.game:
            self._reset_for_game()
        elif self._event_log.add_new_turns(turn_rows):
            self.scroll_offset = 0
            self.message = "" if self.message == self.log[-1] else self.message
        self.post_game_review.review_game(self.game)
        recorder = self.game.recorder
        if recorder and recorder.write_error:
            self.message = f"cannot write {recorder.path}: {recorder.write_error.strerror}"

    def show_progress(self, task_info: TaskInfo, progress: str) -> None:
        """Tells what is thought of, and how far it is where things may move."""
        told = f"{task_info.message} ... {progress if self.terminal.motion else ''}"
        cure = "Ctrl-C cancels"
        self.progress_message = f"{told}{cure}" if len(told + cure) < self._viewport.width else told

    def abandon_task(self) -> None:
        """Goes on without what was cancelled and does not stop."""
        self.game.recreate_agents()
        self.message = "cancelled, but it does not stop: it slows dmplay down until you leave"
