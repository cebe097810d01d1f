"""Every key that the last row of the screen offers does what the row says, in every problem."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.key_bindings import KEY_SYMBOLS
from dmplay.game.launch_requests import GameRequest
from dmplay.game.playback import Playback
from dmplay.game.seats import HUMAN
from dmplay.registry.builtin_names import problem_names
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.frame import compose_frame
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import PlayerQuit

TERMINAL = Terminal(True, "", True, color=False, ascii=False)
SIZES = (Viewport(80, 24), Viewport(50, 14), Viewport(200, 60))
KEYS_BY_SYMBOL = {symbol: key for key, symbol in KEY_SYMBOLS.items()} | {
    "Tab": "tab", "Bksp": "backspace", "Enter": "enter", "Esc": "escape", "Space": "space",
}  # fmt: skip
REFUSAL = re.compile(
    r"no such key|nothing to (?!improve)|cannot|forbids|no turn|has no|no hint|^M: "
)
# one meaning for each key that is no action, in every problem and in every state of the screen
MEANINGS = {
    "Tab": {"hint", "why"},
    "Bksp": {"undo"},
    "Enter": {"look back", "play on", "play from here", "predicts"},
    "Esc": {"skips", "close"},
    "PgUp": {"log", "by 10"},  # the second where a number is typed
    "W": {"whatif"},
    "Space": {"step", "next"},
    "P": {"play", "real-time", "stop"},
    "+": {"faster"},
    "-": {"slower"},
    "X": {"review", "worst"},  # a replay first reviews its choices
    "M": {"learn"},
    "N": {"new"},
    "R": {"restart"},
    "?": {"help"},
    "q": {"quit"},
    ":": {"command"},
}
MODES = ("start", "hint", "clock", "turn", "end", "lookback", "agents", "replay", "strict", "page")


def press(screen: PlayScreen, *keys: str) -> None:
    """Press keys, and do what they leave to do."""
    for key in keys:
        handle_key(screen, key)
        if screen.follow_up:
            screen.follow_up()


def choose_action(screen: PlayScreen) -> None:
    """Play the first legal action, with keys."""
    game = screen.game
    if game.keyboard.is_number_entry(game.viewing_seat):
        press(screen, "right" if "right" in game.keyboard.number_steps else "up", "enter")
        return
    key, *_ = next(row for row in game.keyboard.list_actions_with_keys(game.view()) if row[2])
    press(screen, key)


def open_screen(name: str, mode: str, folder: Path) -> PlayScreen:
    """Return the screen of a problem in a mode."""
    folder.mkdir(exist_ok=True)
    path = folder / f"{len([*folder.iterdir()])}.dmt"
    request = GameRequest(
        name,
        seed=7,
        turns=2,
        agent="random" if mode in {"agents", "replay"} else HUMAN,
        strict="hints" if mode == "strict" else False,
        record_path=path,
    )
    game = start_new_game(request)
    if mode == "replay":
        for _ in game.iter_agent_turns():
            pass
        game.finish()
        playback = Playback(path)
        playback.go_to_turn(1)
        return PlayScreen(GameController(playback), TERMINAL)
    screen = PlayScreen(GameController(game), TERMINAL)
    if mode == "hint":
        press(screen, "tab")
    if mode == "clock":
        press(screen, "P")
    while mode in {"turn", "end", "lookback"} and game.choosing_seat is not None:
        choose_action(screen)
        if mode == "turn":
            break
    if mode in {"lookback", "page"}:
        press(screen, "enter" if mode == "lookback" else "?")
    return screen


def draw(screen: PlayScreen, viewport: Viewport) -> list[str]:
    """Return the rows of the screen."""
    game = screen.timeline or screen.game
    return compose_frame(game, viewport, screen.frame_state, screen.log).plain.split("\n")


def list_offers(row: str) -> Iterator[tuple[str, str]]:
    """Yield the symbol and the name of each key in a row of keys.

    Numbers to type, and keys in brackets that do nothing, are left out.
    """
    for offer in re.split(r"  +", re.sub(r"\(. moves nothing\)", " ", row).strip()):
        symbol, _, name = offer.partition(" ")
        arrows = re.fullmatch(r"(.+) (turns|by [\d.]+)", offer)
        if arrows:
            yield from ((arrow, arrows.group(2)) for arrow in arrows.group(1).split())
        elif "=" in symbol[1:]:
            yield symbol.partition("=")[0], "an action"
        elif symbol not in {"type", "a"} and not re.fullmatch(r"-?[\d.]{2,} best", offer):
            is_action = re.match(r"$|[▁▂▃▄▅▆▇█-]|best|equal", name)
            yield symbol, "an action" if is_action else name


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", problem_names())
def test_each_offered_key_does_something(name: str, mode: str, tmp_path: Path) -> None:
    screen = open_screen(name, mode, tmp_path)
    offers = dict[str, str]()
    for viewport in SIZES:
        offers |= dict(list_offers(draw(screen, viewport)[-1]))
    screen.game.finish()
    assert {"?", "q"} <= offers.keys() or (mode == "page" and "Esc" in offers)
    for symbol, meaning in offers.items():
        is_arrow = symbol not in MEANINGS and re.fullmatch(r"turns|by [\d.]+", meaning)
        assert meaning == "an action" or is_arrow or meaning in MEANINGS.get(symbol, ())
        if symbol == ":":
            continue  # the event loop opens the row of commands
        screen = open_screen(name, mode, tmp_path)
        before, play_mode = draw(screen, SIZES[1]), screen.modes.play_mode
        try:
            press(screen, KEYS_BY_SYMBOL.get(symbol, symbol))
        except PlayerQuit:
            continue
        finally:
            screen.game.finish()
        has_changed = screen.modes.play_mode is not play_mode or draw(screen, SIZES[1]) != before
        assert has_changed, f"{symbol} {meaning}"
        assert not REFUSAL.search(screen.message), f"{symbol} {meaning}: {screen.message}"
