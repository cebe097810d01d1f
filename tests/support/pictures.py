"""The README's pictures, as the transcripts beside them are exported today."""

import re
from pathlib import Path

from dmplay.game.playback import Playback
from dmplay.reports.export import DEFAULT_COLUMNS, ExportOptions, render_film, render_svg
from dmplay.screen.shown import Viewport
from tests.support.blocks import README, ROOT

PICTURES = re.findall(r"\((transcripts/\S+\.svg)\)", README)
FILM, STILL = Viewport(DEFAULT_COLUMNS, 18), Viewport(100, 30)


def drawn(picture: str) -> str:
    """`GAME.svg` is the film of `GAME.dmt`; `GAME.3.svg` its screen after turn 3, with a hint."""
    name, _, turn = Path(picture).stem.partition(".")
    game = Playback(ROOT / Path(picture).with_name(f"{name}.dmt"))
    if turn:
        return "".join(render_svg(game, ExportOptions(STILL, int(turn), hint=True)))
    return "".join(render_film(game, ExportOptions(FILM)))
