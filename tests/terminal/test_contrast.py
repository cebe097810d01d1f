"""Tests of the contrast of text in the themes for dark and for light backgrounds.

The contrast is that of WCAG: (L1 + 0.05) / (L2 + 0.05), with the relative luminances of the lighter
and the darker colour. Palette colours from 16 on have the same RGB values on all terminals. No
theme may use one of the 16 named colours: their RGB values differ between terminals, and in the
palettes of xterm and of VGA some are unreadable.
"""

from itertools import product
from pathlib import Path

import pytest
from rich.text import Text

from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.terminal.background import relative_luminance
from dmplay.terminal.styles import COLOR_NAMES, palette_rgb, split_style_runs, to_styled_rows
from dmplay.ui.screen.play_screen import PlayScreen
from tests.ui.screen import frames

MIN_CONTRAST = 4.5
RGB = tuple[int, int, int]
BACKGROUNDS: dict[str, dict[str, RGB]] = {
    "dark": {
        "xterm and VGA": (0, 0, 0), "Visual Studio Code": (30, 30, 30),
        "One Dark": (40, 44, 52), "Solarized dark": (0, 43, 54), "Ubuntu": (48, 10, 36),
    },
    "light": {
        "xterm and VGA": (255, 255, 255), "Solarized light": (253, 246, 227),
        "GNOME": (250, 250, 250), "light grey": (238, 238, 238),
    },
}  # fmt: skip
BACKGROUNDS["high-contrast-light"] = BACKGROUNDS["light"]
# the 16 named colours, of which these are yellow, blue and bright yellow
XTERM = {3: (205, 205, 0), 4: (0, 0, 238), 11: (255, 255, 0)}
VGA = {3: (170, 85, 0), 4: (0, 0, 170), 11: (255, 255, 85)}


def compute_contrast(first: RGB, second: RGB) -> float:
    """Return the contrast of two colours by WCAG, from 1 to 21."""
    darker, lighter = sorted(
        relative_luminance(*(part / 255 for part in color)) for color in (first, second)
    )
    return (lighter + 0.05) / (darker + 0.05)


def find_faults(style: str, theme: str) -> list[str]:
    """Return the faults of a style in a theme: named or dim colours, and low contrast."""
    (row,) = to_styled_rows(Text("text", style), theme)
    codes = row[0][1].split(";") if row[0][1] else []
    colors: dict[str, RGB] = {}
    while codes:
        code = codes.pop(0)
        if code in ("38", "48"):
            _, number = codes.pop(0), int(codes.pop(0))
            colors[code] = palette_rgb(number)
        elif code == "2" or int(code) >= 30:
            return [f"{style!r} has the code {code} in {theme}"]
    if "38" not in colors and "48" not in colors:
        return []  # the text colour of the terminal
    if "38" not in colors:
        return [f"{style!r} has a background, and the text colour of the terminal, in {theme}"]
    grounds = {"its own": colors["48"]} if "48" in colors else BACKGROUNDS[theme]
    return [
        f"{style!r} has a contrast of {contrast:.1f} on the background of {name} in {theme}"
        for name, ground in grounds.items()
        if (contrast := compute_contrast(colors["38"], ground)) < MIN_CONTRAST
    ]


def test_contrast_is_that_of_wcag() -> None:
    black, white, grey = (0, 0, 0), (255, 255, 255), (118, 118, 118)
    assert compute_contrast(black, white) == pytest.approx(21)
    assert compute_contrast(grey, white) == pytest.approx(4.54, abs=0.01)


def test_the_named_colours_of_xterm_and_vga_are_unreadable_on_black_or_white() -> None:
    black, white = (0, 0, 0), (255, 255, 255)
    for palette in (XTERM, VGA):
        assert compute_contrast(palette[4], black) < MIN_CONTRAST
        assert compute_contrast(palette[11], white) < MIN_CONTRAST
    assert compute_contrast(XTERM[3], white) < MIN_CONTRAST


@pytest.mark.parametrize("theme", BACKGROUNDS)
def test_every_named_colour_is_readable_in_the_themes_for_a_background(theme: str) -> None:
    names = ["", *COLOR_NAMES, *(f"bright_{name}" for name in COLOR_NAMES), "color(3)"]
    weights = ("", "bold", "dim", "bold dim", "reverse", "underline italic")
    styles = [f"{weight} {name}".strip() for weight, name in product(weights, names)]
    assert [fault for style in styles for fault in find_faults(style, theme)] == []


@pytest.mark.parametrize("name", frames.GAMES)
def test_every_style_on_the_screen_is_readable(name: str, tmp_path: Path) -> None:
    script = frames.GAMES[name]
    request = GameRequest(
        name, seed=frames.SEED, turns=script.turns, record_path=tmp_path / "game.dmt"
    )
    game = start_new_game(request)
    screen = PlayScreen(GameController(game), frames.BASE_TERMINAL)
    recorder, styles = frames.FrameRecorder(), set()
    recorder.columns, recorder.rows = 120, 40
    for _ in frames.play_to_moments(screen, script):
        screen.paint(recorder)
        styles |= {" ".join(sorted(words)) for words, _ in split_style_runs(recorder.frame)}
    game.finish()
    styles = {style.replace("on_", "on ") for style in styles}
    assert "dim" in styles
    assert [
        fault for style in styles for theme in BACKGROUNDS for fault in find_faults(style, theme)
    ] == []
