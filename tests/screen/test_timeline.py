"""After the end: the result, the same dice, and the turns one by one."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from dmplay.cli.errands import interpret_command
from dmplay.game.checking import verify_file
from dmplay.game.game import Game
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.game.table import GameController
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal
from tests.support.games import read_transcript
from tests.support.screens import Easel, Paper, game

MOVES: dict[str, Sequence[str]] = {
    "hexworld": "hhnl",
    "crying-baby": "fsifs",
    "simple-regulator": ("0", "enter", "0", "enter"),
}
TURNS = {"hexworld": 4, "crying-baby": 5, "simple-regulator": 2}
LARGE, SMALL = (80, 24), (50, 14)


def over(name: str, *, ascii_: bool = False, played: Game | None = None) -> PlayScreen:
    """A screen after the last turn of a game."""
    made = played or game(name, turns=TURNS[name])
    terminal = Terminal(True, "", True, True, ascii_)
    screen = PlayScreen(GameController(made, interpret_command), terminal)
    pressed(screen, *MOVES[name])
    return screen


def pressed(screen: PlayScreen, *keys: str, size: tuple[int, int] = LARGE) -> str:
    """What the screen shows after these keys."""
    for key in keys:
        handle_key(screen, key)
    easel = Easel(Paper(), *size)
    screen.paint(easel)
    return easel.paper.text


def kept(place: Path, **wishes: object) -> Game:
    """A game of crying baby with a transcript."""
    request = GameRequest("crying-baby", seed=7, turns=5, record_path=place / "game.dmt")
    return start_new_game(GameRequest(**{**vars(request), **wishes}))


FRAMES: dict[tuple[str, Sequence[str], tuple[int, int], bool], str] = {
    ("hexworld", (), LARGE, False): """\
 hexworld  turn 4/4  score (discounted) -1.539  you: agent  turn limit
 reach +10 or +5; keep off -10; a bump costs 1; 30% of steps slip aside
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   last     E
│     │     │     │     │     │     │  @  │     │     │     │  moved    bumped
│     │     │     │     │     │     │     │     │     │     │  reward   -1.00
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱    goes on  0.70
   │  ◆  │     │     │     │     │           │     │     │     slips aside
   │  +5 │     │     │     │     │           │     │     │       0.15 each
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   discount
│     │     │  ✗  │     │     │     │     │     │     │  ◆  │    0.90 (gamma)
│     │     │ -10 │     │     │     │     │     │     │ +10 │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱
@ you, ◆ pays, ✗ costs

 turn 1. at (6,2). chose W, moved W. reward 0. score 0.
 turn 2. at (5,2). chose W, moved W. reward 0. score 0.
 turn 3. at (5,2). chose SE, bumped, stayed. reward -1. score -0.81.
 turn 4. at (5,2). chose E, bumped, stayed. reward -1. score -1.539.
 review: 1 of 4 moves the best, regret 4.35 in all, most in turn 2
 optimal on the same dice: 8.1; you -1.539
 over: turn limit after 4 turns. agent score (discounted) -1.539, total -2.


 Enter looks back  Tab hint  Bksp undo  ? help  q quit  : command""",
    ("hexworld", ("enter", "left"), LARGE, False): """\
 dmplay hexworld    seed 7   turn 2/4   score (discounted) 0   you: agent
 reach +10 or +5; keep off -10; a bump costs 1; 30% of steps slip aside
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   last     W
│     │     │     │     │     │h ███│  @  │  l  │     │     │  moved    W
│     │     │     │     │     │-1.45│     │ best│     │     │  reward   0.00
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱    goes on  0.70
   │  ◆  │     │     │     │     │           │     │     │     slips aside
   │  +5 │     │     │     │     │           │     │     │       0.15 each
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   discount
│     │     │  ✗  │     │     │     │     │     │     │  ◆  │    0.90 (gamma)
│     │     │ -10 │     │     │     │     │     │     │ +10 │  worth
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱      e      4.80
walls: u -1.16 n -1.16 y -1.47 b -1.47                           ne     3.64
                                                                 se     3.64
                                                                 w      3.35
                                                                 nw     3.32
                                                                 sw     3.32

 turn 2. at (5,2). chose W, moved W. reward 0. score 0.
 regret ██[▆]▁  worst: turn 2, 1, 3
 turn 3 of 4: chose se; e was better by 1.16.


 ← → turns  Enter plays on  N new  ? help  q quit  : command""",
    ("hexworld", ("enter", "left"), SMALL, True): """\
 hexworld  turn 2/4  score 0  you: agent
 / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\
|   |   |   |   |   | h#| @ | l*|   |   |
 \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ /
  | + |   |   |   |   |       |   |   |
 / \\ / \\ / \\ / \\   \\ / \\ / \\ / \\ / \\ / \\
|   |   | x |   |   |   |   |   |   | + |
 \\ / \\ / \\ / \\ /     \\ / \\ / \\ /     \\ /
* best, # loses most

 regret ##[+]_  worst: turn 2, 1, 3
 turn 3 of 4: chose se; e was better by 1.16.

 < > turns  Enter plays on  ? help  q quit""",
    ("crying-baby", (), SMALL, False): """\
 crying-baby  turn 5/5  score -19.42  turn limit
heard  quiet

sated   ███████████████████▊ 0.989
hungry  ▎··················· 0.011
history of hungry ▅▁▁▁▁▁··············
truly sated

 optimal on the same dice: -15; you -19.423
 over: turn limit after 5 turns. agent score
   (discounted) -19.423, total -21.
 rows 24-26 of 26: PgUp PgDn Home End

 Enter looks back  ? help  q quit  : command""",
    ("crying-baby", ("left", "left"), SMALL, False): """\
 crying-baby  turn 3/5  score -15.45  you: agent
heard  quiet

sated   ███████████████████▌ 0.973
hungry  ▌··················· 0.027
history of hungry ▅▁▁▁················
truly sated
hint  i best  s ▏··· -0.139  f ████ -3.05

 regret ▁▂▁[█]▂  worst: turn 4, 2, 5
 turn 4 of 5: chose feed; ignore was better by
   3.05.

 ← → turns  Enter plays on  ? help  q quit""",
    ("crying-baby", ("left", "left"), LARGE, True): """\
 crying-baby  turn 3/5  score (discounted) -15.45  you: agent
 keep the baby sated; hunger costs 10; feeding 5; singing 0.5
heard  quiet                                                reward   0
                                                            discount 0.90
sated   #######################################. 0.973      worth
hungry  #....................................... 0.027        ignore -16.89
history of hungry =___                                        sing   -17.03
                                                              feed   -19.94
expected reward  hunger  effort     sum  in the end
i ignore          -0.27   +0.00   -0.27  best
s sing            -0.27   -0.50   -0.77  .......... -0.139
f feed            -0.27   -5.00   -5.27  ########## -3.05

a hungry baby cries 80%, sung to 90%
a sated one 10%, sung to 0%; unfed, 10% get hungry
truly sated

 turn 3. quiet. chose ignore. belief: sated 0.973, hungry 0.027. reward 0.
   score -15.45.
 regret _._[#].  worst: turn 4, 2, 5
 turn 4 of 5: chose feed; ignore was better by 3.05.


 < > turns  Enter plays on  N new  R restart  ? help  q quit  : command""",
    ("crying-baby", (), LARGE, False): """\
 crying-baby  turn 5/5  score (discounted) -19.42  you: agent  turn limit
 keep the baby sated; hunger costs 10; feeding 5; singing 0.5
heard  quiet                                            reward   -0.5
                                                        discount 0.90
sated   ███████████████████████████████████████▌ 0.989
hungry  ▌······································· 0.011
history of hungry ▅▁▁▁▁▁··············

expected reward  hunger  effort     sum
f feed            -0.11   -5.00   -5.11
s sing            -0.11   -0.50   -0.61
i ignore          -0.11   +0.00   -0.11

a hungry baby cries 80%, sung to 90%
a sated one 10%, sung to 0%; unfed, 10% get hungry
truly sated

   [0.989, 0.01099].
 review: 2 of 5 moves the best, regret 3.35 in all, most in turn 4
 optimal on the same dice: -15; you -19.423
 over: turn limit after 5 turns. agent score (discounted) -19.423, total -21.
 rows 16-19 of 19: PgUp PgDn Home End

 Enter looks back  Tab hint  ? help  q quit  : command""",
}  # fmt: skip


@pytest.mark.parametrize(("name", "keys", "size", "ascii_"), [*FRAMES])
def test_the_end_and_the_turns_before_it_are_shown(
    name: str, keys: Sequence[str], size: tuple[int, int], ascii_: bool
) -> None:
    shown = pressed(over(name, ascii_=ascii_), *keys, size=size)
    assert shown == FRAMES[name, keys, size, ascii_]


def test_keys_lead_to_any_turn_and_no_further() -> None:
    screen = over("crying-baby")
    end = pressed(screen)
    assert "turn 1 of 5" in pressed(screen, "left", "home")
    assert "turn 1 of 5" in pressed(screen, "left")
    assert "turn 2 of 5" in pressed(screen, "right")
    assert "turn 5 of 5" in pressed(screen, *["right"] * 3)
    assert pressed(screen, "right") == end
    for key in ("end", "escape"):
        assert "turn 4 of 5" in pressed(screen, "left", "left")
        assert pressed(screen, key) == end


def test_what_the_end_alone_may_tell_is_told_of_every_turn() -> None:
    shown = pressed(over("crying-baby"), *["left"] * 5)
    assert "truly hungry" in shown
    assert "score (discounted) 0 " in shown
    assert "reward -15.\n   score -15." in pressed(over("crying-baby"), *["left"] * 4)


@pytest.mark.parametrize("key", ["left", "right", "home", "end", "enter"])
def test_no_turn_is_looked_back_at_before_the_end(key: str) -> None:
    screen = PlayScreen(GameController(game("crying-baby")), Terminal(True, "", True, True, False))
    shown = pressed(screen, "f", key)
    assert "of 20" not in shown
    assert "truly" not in shown
    assert "Enter plays on" not in shown


def test_a_game_is_played_on_from_the_turn_that_is_shown_and_marked(tmp_path: Path) -> None:
    screen = over("crying-baby", played=kept(tmp_path))
    shown = pressed(screen, "left", "left", "enter")
    assert "on from turn 3. new game of crying-baby. " in shown
    assert "turn 3/5" in shown
    pressed(screen, "i", "i")
    screen.controller.end_game()
    branch = tmp_path / "game-2.dmt"
    assert read_transcript(branch).header.peeked
    assert not read_transcript(tmp_path / "game.dmt").header.peeked
    assert verify_file(branch).is_ok


@pytest.mark.parametrize(
    ("wishes", "why"),
    [({"strict": True}, "branch: this game is strict"), ({"strict": "hints"}, "branch: this game")],
)
def test_nobody_plays_on_in_a_strict_game(
    tmp_path: Path, wishes: dict[str, object], why: str
) -> None:
    shown = pressed(over("crying-baby", played=kept(tmp_path, **wishes)), "left", "enter")
    assert why in shown
    assert "turn 5 of 5" in shown
    assert "← → turns  N new  R restart  ? help" in shown


def test_a_game_that_is_not_kept_is_not_played_on() -> None:
    assert "branch: no transcript is written" in pressed(over("hexworld"), "enter", "enter")


def test_another_end_is_judged_anew() -> None:
    screen = over("hexworld")
    assert "optimal on the same dice: 8.1; you -1.539" in pressed(screen)
    assert "same dice" not in pressed(screen, "backspace")
    assert "optimal on the same dice: 8.1; you -0.81" in pressed(screen, "u")
    assert "turn 4 of 4: chose ne" in pressed(screen, "enter")


def test_moves_that_nobody_can_value_are_named() -> None:
    shown = pressed(over("simple-regulator"), "enter")
    assert "turn 2 of 2: chose 0." in shown
    assert "regret" not in shown


def test_two_people_see_the_choices_of_both() -> None:
    played = game("travelers-dilemma", turns=1)
    screen = PlayScreen(GameController(played), Terminal(True, "", True, True, False))
    shown = pressed(screen, *"99", "enter", *"50", "enter", "left")
    assert "agent1 chose 99" in shown
    assert "agent2 chose 50" in shown


def test_a_long_game_shows_the_regret_around_the_turn() -> None:
    played = game("hexworld", turns=90)
    screen = PlayScreen(GameController(played), Terminal(True, "", True, True, False))
    shown = pressed(screen, *["l"] * 90, "enter", size=SMALL)
    row = next(row for row in shown.split("\n") if "regret" in row)
    assert len(row) <= SMALL[0]
    assert "]  worst: turn" in row


def test_a_key_of_the_game_that_comes_too_late_does_not_look_back() -> None:
    screen = PlayScreen(
        GameController(game("hexworld", turns=1)), Terminal(True, "", True, True, False)
    )
    end = pressed(screen, "left")
    assert "Enter looks back" in end
    assert "left: the game is over" in pressed(screen, "left")
    assert "what if: the game is over" in pressed(screen, "W")
    assert "turn 1 of 1: chose w" in pressed(screen, "enter")
    assert pressed(screen, "right") == end
    assert "left: the game is over" in pressed(over("simple-regulator"), "left")


def test_other_keys_do_what_they_do_at_the_end() -> None:
    assert "You are @" in pressed(over("hexworld"), "enter", "?")
    assert "no hint: the game is over" in pressed(over("hexworld"), "enter", "tab")
    assert "x: no such key" in pressed(over("hexworld"), "enter", "x")
    assert "turn 4 of 4" in pressed(over("hexworld"), "enter", "x")
