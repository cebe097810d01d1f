"""What each key does on the play screen."""

from collections.abc import Callable
from math import copysign, inf, isinf
from typing import NamedTuple

from dmplay.game.game import Game
from dmplay.screen.acts import (
    GAME_OVER_MESSAGE,
    change_speed,
    play_action,
    quit_game,
    start_clock,
    start_lookahead,
    step_agents,
    toggle_pause,
)
from dmplay.screen.modes import Mode, ModeEvent
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import KEY_HINT_TURNS, NEXT_PAGE_KEYS
from dmplay.words.commands import COMMANDS, conceal_choice_errors, find_command, format_help_page

SPEED_FACTOR = 1.5  # the speed times this
SCROLL_ROWS_BY_KEY = {  # rows back, by keys that scroll the log, where they play nothing, and pages
    "pageup": 8, "pagedown": -8, "home": inf, "end": -inf, "wheel up": 3, "wheel down": -3,
}  # fmt: skip
SCROLL_HELP = ("PgUp", "scroll", "the log back; PgDn Home End; Shift where they play")


def handle_key(screen: PlayScreen, key: str) -> None:
    """Does what a key says; raises Leave."""
    screen.message = ""
    screen.animation.stop()
    if key != "q":
        screen.modes.handle_event(ModeEvent.KEY_PRESSED)
    if screen.controller.awaiting_handover and key != "q":
        if key in ("enter", "space"):
            screen.controller.complete_handover()
    elif screen.modes.display_mode is Mode.PAGE:
        _turn_page(screen, key)
    else:
        with screen.errors_as_messages():
            _dispatch_key(screen, key)


def _dispatch_key(screen: PlayScreen, key: str) -> None:
    """Plays, looks ahead or back, or does what the shell does."""
    if screen.game.choosing_seat is not None and (
        _handle_number_key(screen, key) or _handle_action_key(screen, key)
    ):
        return
    if screen.modes.display_mode is Mode.LOOKAHEAD and _handle_lookahead_key(screen, key):
        return
    if not _handle_lookback_key(screen, key):
        _handle_command_key(screen, key)


def _turn_page(screen: PlayScreen, key: str) -> None:
    rows = _scroll_rows(key)
    if rows:
        screen.turn_page(-rows if isinf(rows) else -copysign(1, rows))
    elif not (key in NEXT_PAGE_KEYS and screen.turn_page(1)):
        screen.modes.handle_event(ModeEvent.CLOSED)


def _handle_number_key(screen: PlayScreen, key: str) -> bool:
    """Writes or nudges a number, and plays it on Enter."""
    if key == "enter" and screen.number_input.text:
        with conceal_choice_errors(screen.controller):
            play_action(
                screen,
                screen.game.keyboard.parse_action(
                    screen.game.view(), screen.number_input.take_text()
                ),
            )
        return True
    ahead = (
        key == "enter" and screen.modes.display_mode is Mode.LOOKAHEAD
    )  # plays what was looked at
    if ahead or not screen.number_input.handle_key(screen.game, key):
        return False
    screen.message = screen.number_input.describe_input(screen.game)
    return True


def _handle_action_key(screen: PlayScreen, key: str) -> bool:
    """Plays the action of a key, or of two arrows for a diagonal."""
    keyboard, combination = screen.game.keyboard, f"{screen.key_prefix} {key}".strip()
    screen.key_prefix = ""
    found = keyboard.find_key_action(screen.game.viewing_seat, combination)
    if found is not None:
        seat, action = found
        play_action(screen, action, seat)
    elif key in ("up", "down") and any(" " in one for one in keyboard.key_maps.first_player_keys):
        screen.key_prefix = key
        screen.message = f"{key}, then left or right: a diagonal"
    else:
        return False
    return True


def _handle_lookahead_key(screen: PlayScreen, key: str) -> bool:
    """Looks ahead no more: Enter plays what was shown, other keys do what they always do."""
    adviser = screen.game.hint_provider
    foreseen = adviser.current_forecast
    screen.modes.handle_event(ModeEvent.CLOSED)
    adviser.clear_forecast()
    if key == "enter" and foreseen:
        play_action(screen, foreseen.action)
    return key in ("enter", "escape", "W")


def _handle_lookback_key(screen: PlayScreen, key: str) -> bool:
    """Steps through the turns of a game that is over; plays on from one."""
    past, whole = screen.timeline, screen.post_game_review.timeline
    if past and key == "enter":
        screen.show_reply(find_command("branch").run(screen.controller, str(past.turns_played)))
        return True
    if past and key == "escape":
        screen.modes.handle_event(ModeEvent.CLOSED)
        return True
    if not past and _is_game_key(
        screen.game, key
    ):  # whoever plays fast presses it after the end too
        return False
    turn = screen.post_game_review.turn_for_key(key, past.turns_played if past else None)
    if turn is None or whole is None:
        return False
    screen.scroll_offset = 0
    if turn == whole.turn_count:
        screen.modes.handle_event(ModeEvent.CLOSED)
    else:
        whole.go_to_turn(turn)
        screen.modes.handle_event(ModeEvent.LOOKBACK_STARTED)
    return True


def _is_game_key(game: Game, key: str) -> bool:
    """Whether a key is one of the game's own."""
    return key in game.keyboard.number_steps or bool(
        game.keyboard.find_key_action(game.viewing_seat, key)
    )


def _handle_command_key(screen: PlayScreen, key: str) -> None:
    """Does what a key of the screen or of the shell says."""
    game = screen.game
    own = next((one for one in SCREEN_KEYS if one.is_active_for(key, game)), None)
    command = next((one for one in COMMANDS if one.key == key), None)
    if own:
        own.handler(screen)
    elif _scroll_rows(key):
        screen.scroll_log(_scroll_rows(key))
    elif command:
        screen.show_reply(command.run(screen.controller, ""))
    elif screen.realtime_rate and game.choosing_seat is not None and not screen.clock.is_started:
        start_clock(screen)
    elif key.isprintable():
        late = game.session.over and _is_game_key(game, key)
        screen.message = f"{key}: {GAME_OVER_MESSAGE if late else 'no such key; ? shows them'}"


def _scroll_rows(key: str) -> float:
    """How many rows back a key scrolls, with Shift or Ctrl or without; 0 where it does not."""
    return SCROLL_ROWS_BY_KEY.get(key.removeprefix("s-").removeprefix("c-"), 0)


def _show_help(screen: PlayScreen) -> None:
    """The keys of the game, of the screen and of the commands; commands without one."""
    own = [(key.label, key.name, key.help) for key in SCREEN_KEYS if key.help]
    screen.open_page(format_help_page(screen.game, [*own, SCROLL_HELP]))
    screen.last_key_hint_turn = len(screen.game.session.turns) + KEY_HINT_TURNS


class ScreenKey(NamedTuple):
    """A key that only the screen has: which, how it is shown, its name, what it does."""

    keys: tuple[str, ...]
    label: str
    name: str
    help: str  # '' where the shell's command of this key tells
    handler: Callable[[PlayScreen], None]
    is_agents_only: bool = False  # only where nobody plays

    def is_active_for(self, key: str, game: Game) -> bool:
        """Whether this is the key, and it does something in this game."""
        return key in self.keys and not (self.is_agents_only and game.human_seats)


SCREEN_KEYS = (
    ScreenKey(
        ("V",), "V", "overlay", "values, policy or states on the board, where it has them",
        PlayScreen.show_next_overlay,
    ),
    ScreenKey(("W",), "W", "what if", "what an action may bring, before you play it", start_lookahead),
    ScreenKey(("P", "A"), "P", "pause", "let agents or the clock play, or stop them", toggle_pause),
    ScreenKey(("space", "right"), "Space", "step", "one turn of agents", step_agents, is_agents_only=True),
    ScreenKey(("+",), "+", "faster", "agents play faster", lambda screen: change_speed(screen, SPEED_FACTOR)),
    ScreenKey(("-",), "-", "slower", "agents play slower", lambda screen: change_speed(screen, 1 / SPEED_FACTOR)),
    ScreenKey(("?",), "?", "help", "", _show_help),
    ScreenKey(("q",), "q", "quit", "", quit_game),
)  # fmt: skip
