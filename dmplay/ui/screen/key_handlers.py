"""Handle the keys of the play screen."""

from collections.abc import Callable, Sequence
from math import copysign, inf, isinf
from typing import NamedTuple

from dmplay.draw.hex_map import KEY_FAMILY as HEX_KEY_FAMILY
from dmplay.game.game import Game
from dmplay.game.playback import Playback
from dmplay.game.verdict import has_exact_verdict
from dmplay.ui.screen.frame_state import NEXT_PAGE_KEYS
from dmplay.ui.screen.modes import Mode, ModeEvent
from dmplay.ui.screen.play_operations import (
    GAME_OVER_MESSAGE,
    change_speed,
    leave_to_learn,
    play_action,
    quit_game,
    start_clock,
    start_lookahead,
    step_agents,
    submit_prediction,
    toggle_pause,
)
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.post_game_timeline import GameTimeline
from dmplay.ui.screen.realtime_clock import find_clock
from dmplay.ui.screen.replay_keys import (
    REPLAY_HELP,
    WORST_KEY,
    handle_replay_key,
    play_again,
    type_turn,
)
from dmplay.ui.shell.commands import COMMANDS, conceal_choice_errors, find_command, format_help_page

HINT_KEY = "tab"
SPEED_FACTOR = 1.5  # speed factor of one key press
PAGE = 1000.0  # stands for the visible rows
SCROLL_ROWS_BY_KEY = {  # rows to scroll back, by key, for the log and for pages
    "pageup": PAGE, "pagedown": -PAGE, "home": inf, "end": -inf, "wheel up": 3, "wheel down": -3,
}  # fmt: skip
LOOKBACK_HELP = (
    "Enter",
    "look back",
    "after the game: its turns (?! lost much, ?? very much); X worst, Tab why",
)
SCROLL_HELP = ("PgUp", "scroll", "scroll the log; after the game: list its turns")
HEX_SCROLL_HELP = ("Shift-PgUp", "scroll", "scroll the log (PgUp alone moves you NE)")
NUMBER_SCROLL_HELP = ("Shift-PgUp", "scroll", "scroll the log (PgUp alone changes the number)")
RECORD_HELP = ("PgUp", "turns", "after the game: list its turns")


def handle_key(screen: PlayScreen, key: str) -> None:
    """Handle a key on the play screen; raise PlayerQuit if it quits.

    Before a handover only Enter, Space and q work. On a page, keys turn it, or close it and act.
    """
    if screen.viewer:
        screen.handle_viewer_key(key)
        return
    screen.message, screen.loses_medal = "", False
    screen.animation.stop()
    if key != "q":
        screen.modes.handle_event(ModeEvent.KEY_PRESSED)
    if screen.controller.awaiting_handover and key != "q":
        if key in ("enter", "space"):
            screen.controller.complete_handover()
    elif screen.modes.display_mode is not Mode.PAGE or _turn_page(screen, key):
        position = screen.game, len(screen.game.session.turns)
        with screen.show_errors_as_messages():
            _dispatch_key(screen, key)
        if screen.modes.display_mode is Mode.PAGE:
            screen.page_key = key
        if position != (screen.game, len(screen.game.session.turns)):
            screen.number_input.text = ""  # It was typed for another turn.


def _dispatch_key(screen: PlayScreen, key: str) -> None:
    """Try a key as an action, in the lookahead, in the lookback, then as a command."""
    if screen.game.open_question:
        _handle_prediction_key(screen, key)
        return
    if screen.game.choosing_seat is not None and (
        _handle_number_key(screen, key) or _handle_action_key(screen, key)
    ):
        return
    if screen.modes.display_mode is Mode.LOOKAHEAD and _handle_lookahead_key(screen, key):
        return
    if screen.game.lesson_goal and screen.game.session.over and key == "enter":
        quit_game(screen)  # back to the lesson
    if handle_replay_key(screen, key):
        return
    if not _handle_lookback_key(screen, key):
        _handle_command_key(screen, key)


def _handle_prediction_key(screen: PlayScreen, key: str) -> None:
    """Type a prediction: Enter submits it, Esc skips it, Backspace erases or undoes the choice."""
    typed_text = " " if key == "space" else key
    if key == "backspace" and not screen.prediction_text:
        screen.game.undo()
        screen.message = "your choice is undone."
        return
    if key == "escape":
        screen.prediction_text = ""
    if key in ("enter", "escape"):
        submit_prediction(screen)
        return
    if key == "backspace":
        screen.prediction_text = screen.prediction_text[:-1]
    elif len(typed_text) == 1 and typed_text.isprintable():
        screen.prediction_text += typed_text
    predictor = screen.game.predictor
    noun = predictor.noun if predictor else ""
    screen.message = f"{noun}: {screen.prediction_text}   ({screen.game.open_question})"


def _turn_page(screen: PlayScreen, key: str) -> bool:
    """Turn the page forward or back, or close it; return whether the key acts on the game too.

    If the page has one part, the arrow and scroll keys do what they do in the game.
    """
    rows, turns = _scroll_rows(key), screen.page_count > 1 or key.startswith("wheel")
    if rows and turns:
        screen.turn_page(-rows if isinf(rows) else -copysign(1, rows))
        return False
    if key in NEXT_PAGE_KEYS and screen.turn_page(1):
        return False
    screen.modes.handle_event(ModeEvent.CLOSED)
    return key not in {"escape", "space", "enter", "q", screen.page_key, "down" if turns else ""}


def _handle_number_key(screen: PlayScreen, key: str) -> bool:
    """Type or step a number, or play it with Enter; return whether the key was used."""
    game, number_input = screen.game, screen.number_input
    if key == "enter" and number_input.text:
        with conceal_choice_errors(screen.controller):
            number_input.submit_text(
                lambda text: play_action(screen, game.keyboard.parse_action(game.view(), text))
            )
        return True
    # Enter then plays the previewed action.
    plays_preview = key == "enter" and screen.modes.display_mode is Mode.LOOKAHEAD
    if plays_preview or not number_input.handle_key(game, key):
        return False
    hint = game.hint_provider.current_hint
    if key == "enter" and hint and hint.action is not None:
        play_action(screen, hint.action)
    else:
        _show_number(screen)
    return True


def _show_number(screen: PlayScreen) -> None:
    """Show the typed number and the effect of Enter as the message."""
    is_lookahead = screen.modes.display_mode is Mode.LOOKAHEAD
    effect = "Enter shows what may follow" if is_lookahead else "Enter plays it"
    screen.message = screen.number_input.describe_input(screen.game, effect)


def _handle_action_key(screen: PlayScreen, key: str) -> bool:
    """Play the action of a key or of two arrow keys; return whether the key was used."""
    keyboard, combination = screen.game.keyboard, f"{screen.key_prefix} {key}".strip()
    screen.key_prefix = ""
    seat_and_action = keyboard.find_key_action(screen.game.viewing_seat, combination)
    if seat_and_action is not None:
        seat, action = seat_and_action
        play_action(screen, action, seat, key)
    elif key in ("up", "down") and any(
        " " in action_key for action_key in keyboard.key_maps.first_player_keys
    ):
        screen.key_prefix = key
        screen.message = f"{key}: now press left or right for a diagonal step"
    else:
        return False
    return True


def _handle_lookahead_key(screen: PlayScreen, key: str) -> bool:
    """End the lookahead; Enter plays the previewed action. Return whether the key was used."""
    hint_provider = screen.game.hint_provider
    forecast = hint_provider.current_forecast
    screen.modes.handle_event(ModeEvent.CLOSED)
    hint_provider.clear_forecast()
    if key == "enter" and forecast:
        play_action(screen, forecast.action)
    return key in ("enter", "escape", "W")


def _handle_lookback_key(screen: PlayScreen, key: str) -> bool:
    """Step through a finished game or branch off; return whether the key was used."""
    timeline, full_timeline = screen.timeline, screen.post_game_review.timeline
    if full_timeline is None or (not timeline and screen.game.is_action_key(key)):
        # A fast player may press an action key after the end; it must not open the lookback.
        return False
    if type_turn(
        screen,
        key,
        lambda: full_timeline.turn_count,
        lambda turn: _look_back(screen, full_timeline, turn),
    ):
        return True
    if timeline and key == "enter":
        play_again(screen, timeline.turns_played)
        return True
    if timeline and key in {HINT_KEY, find_command("why").key}:
        screen.open_page(timeline.explain_choice())
        return True
    if timeline and key == "escape":
        screen.modes.handle_event(ModeEvent.CLOSED)
        return True
    turn = screen.post_game_review.turn_for_key(key, timeline.turns_played if timeline else None)
    if key == WORST_KEY:
        current = timeline.turns_played + 1 if timeline else 0
        if [current] == full_timeline.worst_turns[:1]:  # The look-back shows it already.
            full_timeline.shown_worst_turn = current
        turn = full_timeline.find_next_worst_turn(current) - 1
    if turn is not None:
        _look_back(screen, full_timeline, turn)
    return turn is not None


def _look_back(screen: PlayScreen, timeline: GameTimeline, turn: int) -> None:
    """Show a finished game after this turn; its end is shown as it was."""
    screen.scroll_offset = 0
    if turn == timeline.turn_count:
        screen.modes.handle_event(ModeEvent.CLOSED)
    else:
        timeline.go_to_turn(turn)
        screen.modes.handle_event(ModeEvent.LOOKBACK_STARTED)


def _handle_command_key(screen: PlayScreen, key: str) -> None:
    """Run a key of the screen, scroll the log, run a command's key, or report an unknown key.

    In real time, any other key starts the clock.
    """
    game = screen.game
    if key == HINT_KEY and game.hint_provider.current_hint:
        key = find_command("why").key or key  # the second Tab explains the hint
    screen_key = next(
        (candidate for candidate in SCREEN_KEYS if candidate.is_active_for(key, game)), None
    )
    command = next((candidate for candidate in COMMANDS if candidate.key == key), None)
    if screen_key:
        screen_key.handler(screen)
    elif _scroll_rows(key):
        _scroll_log_or_record(screen, _scroll_rows(key))
    elif command:
        screen.show_reply(command.run(screen.controller, ""))
    elif screen.realtime_rate and game.choosing_seat is not None and not screen.clock.is_started:
        start_clock(screen)
    elif game.choosing_seat is not None and screen.number_input.type_other_key(game, key):
        _show_number(screen)
    elif key != "escape" and key.isprintable():  # Esc only removes the message.
        # In a replayed transcript, N starts no game.
        is_over = game.session.over and game.request is not None
        explanation = "N starts a new game" if is_over else "? lists the keys"
        is_late_action = game.session.over and game.is_action_key(key)
        problem_text = GAME_OVER_MESSAGE if is_late_action else "no such key"
        action_keys = {label: name for name, label, _ in _list_action_keys(game)}
        if key in action_keys:
            problem_text = f"no such key; press {action_keys[key]} for the action {key}"
        if game.choosing_seat is not None and game.keyboard.is_number_entry(game.viewing_seat):
            name = getattr(game.view_module, "NUMBER_NAME", "number")
            numbers = game.keyboard.describe_numbers(game.viewing_seat)
            problem_text = f"no such key; type a {name} ({numbers}), then Enter"
        screen.message = f"{key}: {problem_text}; {explanation}"


def _list_action_keys(game: Game) -> Sequence[tuple[str, str, bool]]:
    """Return the key, the name and the legality of each action; [] if nobody chooses now."""
    return [] if game.choosing_seat is None else game.keyboard.list_actions_with_keys(game.view())


def _scroll_rows(key: str) -> float:
    """Return the rows that a key scrolls back, with or without Shift or Ctrl; 0 for other keys."""
    return SCROLL_ROWS_BY_KEY.get(key.removeprefix("s-").removeprefix("c-"), 0)


def _scroll_log_or_record(screen: PlayScreen, rows: float) -> None:
    """Scroll the log; after the game, open its complete record instead."""
    if screen.game.session.over and not screen.timeline:
        screen.open_record()
        if rows == -inf:
            screen.turn_page(inf)
    elif abs(rows) == PAGE:
        screen.scroll_log_page(copysign(1, rows))
    else:
        screen.scroll_log(rows)


def _has_hex_map(screen: PlayScreen) -> bool:
    """Return whether the game is played on a hex map."""
    return getattr(screen.game.view_module, "KEY_FAMILY", "") == HEX_KEY_FAMILY


def _show_help(screen: PlayScreen) -> None:
    """Show the help page: the keys of the game, of the screen, and the commands."""
    screen_keys = [
        (key.label, key.name, key.help)
        for key in SCREEN_KEYS
        if key.help and key.is_listed_for(screen)
    ]
    replay_keys = REPLAY_HELP if isinstance(screen.game, Playback) else ()
    lookback_keys = [LOOKBACK_HELP] if screen.game.human_seats else []
    scroll_keys = [SCROLL_HELP]
    if _has_hex_map(screen):
        scroll_keys = [HEX_SCROLL_HELP, RECORD_HELP]
    elif "pageup" in screen.game.keyboard.number_steps:
        scroll_keys = [NUMBER_SCROLL_HELP, RECORD_HELP]
    keys = [*replay_keys, *screen_keys, *lookback_keys, *scroll_keys]
    screen.open_page(format_help_page(screen.game, keys))


def _has_overlay(screen: PlayScreen) -> bool:
    """Return whether the board can show the values of all states."""
    problem = screen.game.problem
    is_finite = isinstance(problem.state_count, int) and problem.state_count > 1
    return is_finite and not problem.observations


def _has_pace(screen: PlayScreen) -> bool:
    """Return whether agents alone play, or the game has a clock."""
    is_timed = screen.realtime_rate or find_clock(screen.game)
    return bool(is_timed) or not screen.game.human_seats


def _has_quiz(screen: PlayScreen) -> bool:
    """Return whether the game can end with a quiz on a person's choices."""
    game = screen.game
    return any(
        has_exact_verdict(game.session, question)
        for question in game.advice_questions
        if game.problem.actions[question.seat].labels
    )


class ScreenKey(NamedTuple):
    """A key that only the play screen has: its names, label, description and handler."""

    keys: tuple[str, ...]
    label: str
    name: str
    help: str  # '' if the command of the same key describes it
    handler: Callable[[PlayScreen], None]
    is_agents_only: bool = False  # only for games without human players
    is_useful: Callable[[PlayScreen], bool] | None = None  # None if it is useful in every game

    def is_active_for(self, key: str, game: Game) -> bool:
        """Return whether this is the pressed key and it works in this game."""
        return key in self.keys and not (self.is_agents_only and game.human_seats)

    def is_listed_for(self, screen: PlayScreen) -> bool:
        """Return whether the help page of this screen lists the key."""
        if self.is_agents_only and screen.game.human_seats:
            return False
        return self.is_useful is None or self.is_useful(screen)


SCREEN_KEYS = (
    ScreenKey(
        ("V",),
        "V",
        "overlay",
        "on hex maps: show values, then best actions, then state numbers (0, 1, 2, ...)",
        PlayScreen.show_next_overlay,
        is_useful=_has_overlay,
    ),
    ScreenKey(
        ("C",),
        "C",
        "coordinates",
        "on hex maps: hide or show the coordinates that the log names",
        PlayScreen.toggle_coordinates,
        is_useful=_has_hex_map,
    ),
    ScreenKey(("W",), "W", "what if", "show the possible outcomes of an action", start_lookahead),
    ScreenKey(
        ("P", "p", "A"),
        "P",
        "pause",
        "start or stop the agents or the clock",
        toggle_pause,
        is_useful=_has_pace,
    ),
    ScreenKey(
        ("space", "right"),
        "Space",
        "step",
        "let the agents play one turn",
        step_agents,
        is_agents_only=True,
    ),
    ScreenKey(
        ("+",),
        "+",
        "faster",
        "let the agents or the clock run faster",
        lambda screen: change_speed(screen, SPEED_FACTOR),
        is_useful=_has_pace,
    ),
    ScreenKey(
        ("-",),
        "-",
        "slower",
        "let the agents or the clock run slower",
        lambda screen: change_speed(screen, 1 / SPEED_FACTOR),
        is_useful=_has_pace,
    ),
    ScreenKey(
        ("M",),
        "M",
        "learn",
        "after the game: a quiz on your worst turns",
        leave_to_learn,
        is_useful=_has_quiz,
    ),
    ScreenKey(("?",), "?", "help", "", _show_help),
    ScreenKey(("q",), "q", "quit", "", quit_game),
)
