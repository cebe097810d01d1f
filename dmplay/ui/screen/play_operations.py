"""Actions of the play screen: turns, lookahead, the real-time clock, typed commands."""

from dmplay.core.text import format_count
from dmplay.errors import BadParameter
from dmplay.ui.screen.modes import Mode, ModeEvent
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.realtime_clock import SLOW_MOTION_SHARE, find_clock
from dmplay.ui.screen.turn_animation import ANIMATION_SECONDS
from dmplay.ui.shell.commands import PlayerQuit, iter_commands_until_handover, run_line
from dmplay.ui.shell.game_commands import preview_action

MIN_SPEED, MAX_SPEED = 0.1, 50.0  # turns per second
MAX_BEATS_PER_SECOND = 30.0  # A frame takes some milliseconds, so faster play skips frames.
MAX_TURNS_PER_BEAT = 200  # so that a key stops autoplay at once
GAME_OVER_MESSAGE = "the game is over"
MAX_UNSAVED_TURNS = 20  # number of unsaved turns that one key may discard


def play_action(screen: PlayScreen, action: float, seat: int | None = None, key: str = "") -> None:
    """Play an action, preview it in lookahead mode, or in real time let the clock repeat it.

    `key` is the key of the action, which the clock follows until its release.

    The message tells when the other players must still choose in a game with open views.
    """
    game = screen.game
    if screen.modes.display_mode is Mode.LOOKAHEAD:
        is_own_key = seat in (None, game.viewing_seat)
        screen.message = (
            preview_action(game, action)
            if is_own_key
            else "what if: that key belongs to another player"
        )
        screen.lookahead_message = screen.message if is_own_key else ""
        return
    if screen.realtime_rate:
        screen.clock.press_key(key, action)
        start_clock(screen)
        return
    question = game.ask_for_prediction(action)
    if question:
        screen.message = question
        return
    _play_turn(screen, action, seat)


def submit_prediction(screen: PlayScreen) -> None:
    """Take the typed prediction and play the turn that it is about.

    The text stays if it is invalid, so that the player can correct it.
    """
    predictor = screen.game.predictor
    assert predictor is not None
    action = predictor.answer(screen.prediction_text)
    screen.prediction_text = ""
    _play_turn(screen, action)


def _play_turn(screen: PlayScreen, action: float, seat: int | None = None) -> None:
    """Choose an action, and animate the turn if it is played."""
    game = screen.game
    turn_played = game.choose(action, seat)
    screen.log_new_turns()
    if turn_played:
        _start_animation(screen)
    if not (
        turn_played or game.has_private_views or game.choosing_seat is None
    ):  # With private views the handover screen announces the next player.
        name = game.problem.agents[game.choosing_seat]
        screen.message = f"{name} chooses now; choices stay hidden until all have chosen"


def start_lookahead(screen: PlayScreen) -> None:
    """Start the lookahead mode, in which the next action is previewed and not played.

    Show a message if no person chooses or the clock runs. Raise an error if hints are forbidden.
    """
    game = screen.game
    game.check_hints_allowed("whatif")
    if game.choosing_seat is None:
        screen.message = (
            f"what if: {GAME_OVER_MESSAGE if game.session.over else 'no person plays here'}"
        )
    elif screen.realtime_rate:
        screen.message = "what if: not available in real time"
    else:
        screen.modes.handle_event(ModeEvent.LOOKAHEAD_STARTED)
        is_number = screen.game.keyboard.is_number_entry(screen.game.viewing_seat)
        screen.message = (
            "what if: type a number, then Enter shows what may follow, Esc cancels"
            if is_number
            else "what if: press an action key; then Enter plays it, Esc cancels"
        )


def start_clock(screen: PlayScreen) -> None:
    """Start the countdown of the real-time clock, if it has not started yet."""
    screen.message = screen.clock.start_countdown(len(screen.game.session.turns)) or screen.message


def get_clock_rate(screen: PlayScreen) -> float:
    """Return the current rate of the real-time clock in beats per second."""
    return screen.clock.beats_per_second(len(screen.game.session.turns))


def tick_clock(screen: PlayScreen) -> None:
    """Process one beat of the real-time clock: count down, then repeat the last pressed action."""
    if screen.modes.play_mode is not Mode.REALTIME or screen.game.choosing_seat is None:
        return
    countdown_message = screen.clock.count_down()
    if countdown_message is not None:
        screen.message = countdown_message
        return
    action = screen.clock.find_action(len(screen.game.session.turns))
    if action is not None:
        with screen.show_errors_as_messages():
            screen.game.choose(action)
            screen.log_new_turns()


def toggle_pause(screen: PlayScreen) -> None:
    """Toggle between play and pause: of agents that play alone, or of the real-time clock.

    Show a message if the game is over or there is nothing to start or pause.
    """
    game = screen.game
    if game.session.over:
        screen.message = GAME_OVER_MESSAGE
    elif not game.human_seats and not screen.terminal.motion:
        screen.message = "motion is off (--no-motion); Space plays a turn, :auto plays to the end"
    elif game.human_seats and not screen.is_clock_fixed:
        _toggle_clock(screen)
    else:
        was_running = screen.modes.play_mode in (Mode.AUTOPLAY, Mode.REALTIME)
        screen.modes.handle_event(ModeEvent.STOPPED if was_running else ModeEvent.STARTED)
        screen.message = "paused; P continues" if was_running else ""


def _toggle_clock(screen: PlayScreen) -> None:
    """Start the clock of the problem in slow motion, or stop it; show a message without one."""
    clock = find_clock(screen.game)
    if clock is None:
        screen.message = "the game waits for your action; there is nothing to pause"
    elif screen.realtime_rate:
        screen.set_clock_rate(None)
        screen.message = "the clock is off: each key plays a turn"
    elif not screen.terminal.motion:
        screen.message = "motion is off (--no-motion); each key plays a turn"
    else:
        rate = max(min(clock.turns_per_second, MAX_SPEED) * SLOW_MOTION_SHARE, MIN_SPEED)
        screen.set_clock_rate(rate)
        screen.message = f"slow motion, {_describe_pace(screen, rate)}; an action key starts it"


def _describe_pace(screen: PlayScreen, rate: float) -> str:
    """Return a rate as text, with that of real time if the problem has a clock."""
    clock, text = find_clock(screen.game), f"{format_count(rate, 'turn', '.3g')} per second"
    return f"{text} (real time: {clock.turns_per_second:.3g})" if clock else text


def step_agents(screen: PlayScreen) -> None:
    """Play one turn of a game without people, and animate it unless the speed is high."""
    session = screen.game.session
    if session.over:
        screen.message = GAME_OVER_MESSAGE
        return
    previous_turn_count = len(session.turns)
    screen.game.play_agent_turn()
    screen.log_new_turns()
    if (
        len(screen.game.session.turns) > previous_turn_count
        and screen.speed * ANIMATION_SECONDS < 1
    ):
        _start_animation(screen)


def _start_animation(screen: PlayScreen) -> None:
    """Start animating the last turn, if the terminal allows motion and the view can animate.

    The turn that ends a person's game does not move, because the review of the game comes next.
    """
    game = screen.game
    is_reviewed = game.session.over and game.human_seats
    has_motion = screen.terminal.motion and getattr(game.view_module, "HAS_MOTION", False)
    if has_motion and not is_reviewed:
        screen.animation.start()


def autoplay_turn(screen: PlayScreen) -> None:
    """Play the turns of one beat in autoplay, usually one; an error stops autoplay."""
    screen.modes.handle_event(ModeEvent.STOPPED)
    with screen.show_errors_as_messages():
        for _ in range(count_turns_per_beat(screen)):
            step_agents(screen)
            if screen.game.session.over:
                break
        screen.modes.handle_event(ModeEvent.STARTED)


def count_turns_per_beat(screen: PlayScreen) -> int:
    """Return the number of turns that autoplay plays before the next frame."""
    return min(max(round(screen.speed / MAX_BEATS_PER_SECOND), 1), MAX_TURNS_PER_BEAT)


def get_autoplay_rate(screen: PlayScreen) -> float:
    """Return the number of beats of autoplay per second."""
    return screen.speed / count_turns_per_beat(screen)


def change_speed(screen: PlayScreen, factor: float) -> None:
    """Multiply the speed of autoplay or the clock, within MIN_SPEED and MAX_SPEED."""
    speed = min(max((screen.realtime_rate or screen.speed) * factor, MIN_SPEED), MAX_SPEED)
    if screen.realtime_rate:
        screen.realtime_rate = screen.clock.rate = speed
    else:
        screen.speed = speed
    screen.message = _describe_pace(screen, speed)


def run_typed_line(screen: PlayScreen, line: str) -> None:
    """Run the commands typed in the command row; raise PlayerQuit if one of them quits.

    Stop before the rest of the line once the keyboard goes to another player.
    """
    screen.modes.handle_event(ModeEvent.CLOSED)
    with screen.show_errors_as_messages():
        for part in iter_commands_until_handover(screen.controller, line):
            screen.show_reply(run_line(screen.controller, part))


def leave_to_learn(screen: PlayScreen) -> None:
    """Raise PlayerQuit to ask for better actions than those that lost most.

    Raise BadParameter if no such action of the game is known.
    """
    if not screen.game.has_known_mistakes:
        from dmplay.tutor.mistakes import NO_MISTAKES  # the lessons are loaded when needed

        is_exact = any(choices.regret is not None for choices in screen.game.verdict.choices)
        reason = NO_MISTAKES if is_exact else "it needs exact values"
        reason = reason if screen.game.session.over else "the game is not over"
        raise BadParameter(f"M: {reason}")
    screen.learns_from_game = True
    raise PlayerQuit


def quit_game(screen: PlayScreen) -> None:
    """Raise PlayerQuit; only warn the first time if a beginner's game, or much, would be lost.

    Much are more than MAX_UNSAVED_TURNS.
    """
    session, recorder = screen.game.session, screen.game.recorder
    unsaved_turns = 0 if recorder and not recorder.write_error else len(session.turns)
    is_explained = screen.has_notes and not session.over
    if screen.modes.display_mode is Mode.QUIT_WARNING or not (
        is_explained or unsaved_turns > MAX_UNSAVED_TURNS
    ):
        raise PlayerQuit
    screen.modes.handle_event(ModeEvent.QUIT_WARNED)
    text = "this game is not over" if is_explained else f"{unsaved_turns} turns are not saved"
    screen.message = f"{text}; press q again to quit"
