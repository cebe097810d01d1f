"""The screens of a recorded game in another form: what comes again is drawn once."""

from collections import Counter
from pathlib import Path

from dmplay.game.playback import Playback
from dmplay.reports.export import ScreenRenderer, iter_screens
from dmplay.screen.shown import Viewport
from dmplay.styles import ScreenLine, to_plain_text
from tests.support.games import recorded

TURNS = 150


def test_a_turn_draws_its_title_and_a_row_of_the_log_and_boards_are_drawn_once(
    tmp_path: Path,
) -> None:
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=TURNS, settings=["rewards=[]"])
    room, often = Viewport(80, 24), Counter[str]()

    def draw(row: ScreenLine) -> str:
        often[to_plain_text(row)] += 1
        return to_plain_text(row)

    drawn, log, game = ScreenRenderer(room, draw, "\n"), list[str](), Playback(tmp_path / "g.dmt")
    written = [drawn.render_screen(game, game.snapshot(), log)]
    for before in game.iter_agent_turns():
        log.append(game.narrator.describe_change(game.snapshot(), before))
        written.append(drawn.render_screen(game, game.snapshot(), log))
    of_turns = sum(many for row, many in often.items() if "turn " in row)
    shown = "".join(written).count("\n")
    assert of_turns < 2.5 * TURNS
    assert often.total() - of_turns < shown / 3
    assert max(many for row, many in often.items() if "Space step" in row) < TURNS / 10
    assert often[" "] == 1
    alike = [*map(str, iter_screens(Playback(tmp_path / "g.dmt"), room))]
    assert written == alike
