"""The screens of a recorded game in another form: what comes again is drawn once."""

from collections import Counter
from pathlib import Path

from dmplay.game.playback import Playback
from dmplay.reports.export import Drawn, screens
from dmplay.screen.shown import Room
from dmplay.styles import Line, words
from tests.support.games import recorded

TURNS = 150


def test_a_turn_draws_its_title_and_a_row_of_the_log_and_boards_are_drawn_once(
    tmp_path: Path,
) -> None:
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=TURNS, settings=["rewards=[]"])
    room, often = Room(80, 24), Counter[str]()

    def draw(row: Line) -> str:
        often[words(row)] += 1
        return words(row)

    drawn, log, game = Drawn(room, draw, "\n"), list[str](), Playback(tmp_path / "g.dmt")
    written = [drawn.screen(game, game.moment(), log)]
    for before in game.run():
        log.append(game.account.change(game.moment(), before))
        written.append(drawn.screen(game, game.moment(), log))
    of_turns = sum(many for row, many in often.items() if "turn " in row)
    shown = "".join(written).count("\n")
    assert of_turns < 2.5 * TURNS
    assert often.total() - of_turns < shown / 3
    assert max(many for row, many in often.items() if "Space step" in row) < TURNS / 10
    assert often[" "] == 1
    alike = [*map(str, screens(Playback(tmp_path / "g.dmt"), room))]
    assert written == alike
