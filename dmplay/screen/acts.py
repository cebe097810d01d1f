"""What is done on the play screen: actions, looks ahead, real time, agents' turns, typed lines."""

from dmplay.describe import format_count
from dmplay.screen.modes import Mode, ModeEvent
from dmplay.screen.motion import ANIMATION_SECONDS
from dmplay.screen.screen import PlayScreen
from dmplay.words.commands import PlayerQuit, iter_commands_until_handover, run_line
from dmplay.words.game_commands import preview_action

MIN_SPEED, MAX_SPEED = 0.1, 50.0  # turns a second
GAME_OVER_MESSAGE = "the game is over"
MAX_UNSAVED_TURNS = 20  # turns that nobody wants to lose by one key


def play_action(screen: PlayScreen, action: float, seat: int | None = None) -> None:
    """Plays an action, or shows what it may bring; in real time, keeps it for the clock."""
    game = screen.game
    if screen.modes.display_mode is Mode.LOOKAHEAD:
        mine = seat in (None, game.viewing_seat)
        screen.message = preview_action(game, action) if mine else "another's key"
        screen.lookahead_message = screen.message if mine else ""
        return
    if screen.realtime_rate:
        screen.clock.repeated_action = action
        start_clock(screen)
        return
    played = game.choose(action, seat)
    screen.log_new_turns()
    if played:
        _start_animation(screen)
    if not (
        played or game.has_private_views or game.choosing_seat is None
    ):  # a curtain tells it in private
        name = game.problem.agents[game.choosing_seat]
        screen.message = f"{name} chooses; the other choice stays hidden until both are in"


def start_lookahead(screen: PlayScreen) -> None:
    """Asks for an action, to show what it may bring."""
    game = screen.game
    game.check_hints_allowed("whatif")
    if game.choosing_seat is None:
        screen.message = (
            f"what if: {GAME_OVER_MESSAGE if game.session.over else 'nobody chooses here'}"
        )
    elif screen.realtime_rate:
        screen.message = "what if: the clock runs"
    else:
        screen.modes.handle_event(ModeEvent.LOOKAHEAD_STARTED)
        screen.message = "what if: press an action, Enter then plays it, Esc leaves"


def start_clock(screen: PlayScreen) -> None:
    """Lets real time begin, once."""
    screen.message = screen.clock.start(len(screen.game.session.turns)) or screen.message


def clock_rate(screen: PlayScreen) -> float:
    """Beats of the clock a second."""
    return screen.clock.beats_per_second(len(screen.game.session.turns))


def tick_clock(screen: PlayScreen) -> None:
    """A beat of the clock in real time: it counts down, then the last push repeats."""
    if screen.modes.play_mode is not Mode.REALTIME or screen.game.choosing_seat is None:
        return
    told = screen.clock.count_down()
    if told is not None:
        screen.message = told
    elif screen.clock.repeated_action is not None:
        with screen.errors_as_messages():
            screen.game.choose(screen.clock.repeated_action)
            screen.log_new_turns()


def toggle_pause(screen: PlayScreen) -> None:
    """Lets agents play or stops them; stops the clock of real time or lets it go on."""
    game = screen.game
    if game.session.over:
        screen.message = GAME_OVER_MESSAGE
    elif not game.human_seats and not screen.terminal.motion:
        screen.message = "nothing moves by itself; Space steps on, :auto plays to the end"
    elif game.human_seats and not screen.realtime_rate:
        screen.message = "the game waits for you; there is nothing to pause"
    else:
        moving = screen.modes.play_mode in (Mode.AUTOPLAY, Mode.REALTIME)
        screen.modes.handle_event(ModeEvent.STOPPED if moving else ModeEvent.STARTED)
        screen.message = "paused; P goes on" if moving else ""


def step_agents(screen: PlayScreen) -> None:
    """A turn of a game without people."""
    session = screen.game.session
    if session.over:
        screen.message = GAME_OVER_MESSAGE
        return
    before = len(session.turns)
    screen.game.play_agent_turn()
    screen.log_new_turns()
    if len(screen.game.session.turns) > before and screen.speed * ANIMATION_SECONDS < 1:
        _start_animation(screen)


def _start_animation(screen: PlayScreen) -> None:
    """Has the last turn seen to happen, where its view can draw that and things may move."""
    if screen.terminal.motion and getattr(screen.game.view_module, "HAS_MOTION", False):
        screen.animation.start()


def autoplay_turn(screen: PlayScreen) -> None:
    """A turn of a game that plays by itself; an error stops it."""
    screen.modes.handle_event(ModeEvent.STOPPED)
    with screen.errors_as_messages():
        step_agents(screen)
        screen.modes.handle_event(ModeEvent.STARTED)


def change_speed(screen: PlayScreen, factor: float) -> None:
    """Lets agents play so many times as fast."""
    screen.speed = min(max(screen.speed * factor, MIN_SPEED), MAX_SPEED)
    screen.message = f"{format_count(screen.speed, 'turn', '.3g')} a second"


def run_typed_line(screen: PlayScreen, line: str) -> None:
    """Does what a line of the command row says; raises Leave."""
    screen.modes.handle_event(ModeEvent.CLOSED)
    with screen.errors_as_messages():
        for part in iter_commands_until_handover(screen.controller, line):
            screen.show_reply(run_line(screen.controller, part))


def quit_game(screen: PlayScreen) -> None:
    """Leaves the game; where many turns of it are not kept, only when asked twice."""
    recorder = screen.game.recorder
    unkept = 0 if recorder and not recorder.write_error else len(screen.game.session.turns)
    if unkept <= MAX_UNSAVED_TURNS or screen.modes.display_mode is Mode.QUIT_WARNING:
        raise PlayerQuit
    screen.modes.handle_event(ModeEvent.QUIT_WARNED)
    screen.message = f"{unkept} turns are not kept; q once more leaves"
