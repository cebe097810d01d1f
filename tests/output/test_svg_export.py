"""Tests of the screens of a transcript in another form: rows that repeat are rendered once."""

from collections import Counter
from pathlib import Path

from dmplay.game.playback import Playback
from dmplay.output.transcript_export import ScreenRenderer, iter_screens
from dmplay.screen.frame_state import Viewport
from dmplay.terminal_styles import ScreenLine, to_plain_text
from tests.support.games import record_game

TURN_COUNT = 150


def test_a_turn_renders_its_title_and_log_row_and_boards_are_rendered_once(
    tmp_path: Path,
) -> None:
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=TURN_COUNT, settings=["rewards=[]"])
    viewport, render_counts = Viewport(80, 24), Counter[str]()

    def draw(row: ScreenLine) -> str:
        render_counts[to_plain_text(row)] += 1
        return to_plain_text(row)

    renderer, log, game = (
        ScreenRenderer(viewport, draw, "\n"),
        list[str](),
        Playback(tmp_path / "g.dmt"),
    )
    rendered = [renderer.render_screen(game, game.snapshot(), log)]
    for previous in game.iter_agent_turns():
        log.append(game.narrator.describe_change(game.snapshot(), previous))
        rendered.append(renderer.render_screen(game, game.snapshot(), log))
    turn_renders = sum(count for row, count in render_counts.items() if "turn " in row)
    line_count = "".join(rendered).count("\n")
    assert turn_renders < 2.5 * TURN_COUNT
    assert render_counts.total() - turn_renders < line_count / 3
    assert (
        max(count for row, count in render_counts.items() if "Space step" in row) < TURN_COUNT / 10
    )
    assert render_counts[" "] == 1
    expected = [*map(str, iter_screens(Playback(tmp_path / "g.dmt"), viewport))]
    assert rendered == expected
