"""The pictures in transcripts/README.md, exported again from the transcripts next to them."""

import re
from pathlib import Path

from dmplay.game.playback import Playback
from dmplay.output.transcript_export import DEFAULT_COLUMNS, ExportOptions, render_film, render_svg
from dmplay.ui.screen.frame_state import Viewport
from tests.support.document_examples import PROJECT_ROOT

PICTURE_PAGE = PROJECT_ROOT / "transcripts" / "README.md"
PICTURE_PATHS = [
    f"transcripts/{path}"
    for path in re.findall(r"\((\S+\.svg)\)", PICTURE_PAGE.read_text(encoding="utf-8"))
]
FILM_VIEWPORT, STILL_VIEWPORT = Viewport(DEFAULT_COLUMNS, 18), Viewport(100, 30)


def export_picture(picture: str) -> str:
    """Export a picture from its transcript.

    `GAME.svg` is the animation of `GAME.dmt`; `GAME.3.svg` is its screen after turn 3, with a hint.
    """
    name, _, turn = Path(picture).stem.partition(".")
    game = Playback(PROJECT_ROOT / Path(picture).with_name(f"{name}.dmt"))
    if turn:
        return "".join(render_svg(game, ExportOptions(STILL_VIEWPORT, int(turn), hint=True)))
    return "".join(render_film(game, ExportOptions(FILM_VIEWPORT)))
