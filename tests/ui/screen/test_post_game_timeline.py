"""Tests of a finished game: its result, an agent on the same uniforms, and its turns one by one."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.transcript_verification import verify
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.post_game_timeline import GameTimeline
from tests.support.games import read_transcript
from tests.support.screens import EmulatedPainter, EmulatedScreen, make_game
from tests.support.user_problems import REGULATOR_WITHOUT_AGENTS

KEYS_BY_PROBLEM: dict[str, Sequence[str]] = {
    "hexworld": "hhnl",
    "crying-baby": "fsifs",
    "simple-regulator": ("0", "enter", "0", "enter"),
}
TURN_LIMITS = {"hexworld": 4, "crying-baby": 5, "simple-regulator": 2}
LARGE_SIZE, SMALL_SIZE = (80, 24), (50, 14)


def play_to_end(name: str, *, ascii_: bool = False, current_game: Game | None = None) -> PlayScreen:
    """Play a game to its end, and return the screen."""
    unplayed_game = current_game or make_game(name, turns=TURN_LIMITS[name])
    terminal = Terminal(True, "", True, True, ascii_)
    screen = PlayScreen(GameController(unplayed_game, interpret_command), terminal)
    press_keys(screen, *KEYS_BY_PROBLEM[name])
    return screen


def press_keys(screen: PlayScreen, *keys: str, size: tuple[int, int] = LARGE_SIZE) -> str:
    """Press keys, and return the text of the screen."""
    for key in keys:
        handle_key(screen, key)
        screen.review_game()
    easel = EmulatedPainter(EmulatedScreen(), *size)
    screen.paint(easel)
    return easel.paper.text


def make_saved_game(folder: Path, **changes: object) -> Game:
    """Make a game of crying baby that is written to a transcript."""
    request = GameRequest("crying-baby", seed=7, turns=5, record_path=folder / "game.dmt")
    return start_new_game(GameRequest(**{**vars(request), **changes}))


EXPECTED_FRAMES: dict[tuple[str, Sequence[str], tuple[int, int], bool], str] = {
    ("hexworld", (), LARGE_SIZE, False): """\
 dmplay hexworld    seed 7   turn 4/4   score (discounted) -1.539   turn limit
 reach exit +10 or +5; avoid exit -10; a bump costs 1; 30% of steps slip
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   chose    E
│ -1,2│ 0,2 │ 1,2 │ 2,2 │ 3,2 │ 4,2 │  @  │ 6,2 │ 7,2 │ 8,2 │  result slip bump
│     │     │     │     │     │     │ 5,2 │     │     │     │  reward   -1
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱    forward  0.70
   │  ◆  │ 1,1 │ 2,1 │ ░░░ │ 4,1 │ ░░░   ░░░ │ 7,1 │ 8,1 │     slip
   │  +5 │     │     │ ░░░ │     │ ░░░   ░░░ │     │     │       0.15 each side
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   discount
│ 0,0 │ 1,0 │  ✗  │ 3,0 │ ░░░ │ 5,0 │ 6,0 │ 7,0 │ ░░░ │  ◆  │    0.90 (gamma)
│     │     │ -10 │     │ ░░░ │     │     │     │ ░░░ │ +10 │
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱
@ you, ◆ good exit, ✗ bad exit

 over: you took no exit in 4 turns. your score -1.539 (undiscounted -2).
 verdict: fair choices, bad luck
 bronze medal: your choices lost 5.97 (the regret); gold is for at most 0.07
 choices: best action 1 of 4 times; worst: turn 1, chose w, not se: 5.05 lost
 score -1.54 = best play's average 5.78 - your choices 5.97 - luck 1.35
 same start and luck: optimal scored 8.1, you -1.539
 marks in the log: ?? lost very much (turn 1)
 turn 4. chose E, slipped, bumped, stayed at (5,2). reward -1 (adds -0.73).

 Enter look back  PgUp log  X worst  Tab hint  ? help  q quit  : command""",
    ("hexworld", ("enter", "left"), LARGE_SIZE, False): """\
 dmplay hexworld    seed 7   before turn 3/4   score (discounted) 0
 reach exit +10 or +5; avoid exit -10; a bump costs 1; 30% of steps slip
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   chose    W
│ -1,2│ 0,2 │ 1,2 │ 2,2 │ 3,2 │  h  │  @  │  l  │ 7,2 │ 8,2 │  result   W
│     │     │     │     │     │ best│ 5,2 │ best│     │     │  reward   0
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱    forward  0.70
   │  ◆  │ 1,1 │ 2,1 │ ░░░ │ 4,1 │ ░░░   ░░░ │ 7,1 │ 8,1 │     slip
   │  +5 │     │     │ ░░░ │     │ ░░░   ░░░ │     │     │       0.15 each side
 ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲     ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱   ╲   discount
│ 0,0 │ 1,0 │  ✗  │ 3,0 │ ░░░ │ 5,0 │ 6,0 │ 7,0 │ ░░░ │  ◆  │    0.90 (gamma)
│     │     │ -10 │     │ ░░░ │     │     │     │ ░░░ │ +10 │  exact values
  ╲ ╱   ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱   ╲ ╱   ╲ ╱         ╲ ╱    2 turns left
numbers and bars: how much less than the best action             e      -0.48
moves into a wall: ne -0.624, nw -0.624, sw -0.624, se -0.624    w      -0.48
                                                                 ne     -1.10
                                                                 nw     -1.10
                                                                 sw     -1.10
                                                                 se     -1.10

 turn 2. chose W, moved W to (5,2). reward 0. score 0.
 value lost each turn █▃[▃]▁  [ ] = next turn; most in turns 1, 3, 2
 next, turn 3: chose se; e or w was better by 0.62, 0.51 of the score.

 ← → turns  X worst  Tab why  Enter play on  N new  R restart  ? help  q quit""",
    ("hexworld", ("enter", "left"), SMALL_SIZE, True): """\
 hexworld  before turn 3/4  score (discounted) 0
 / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\
|   |   |   |   |   | h*| @ | l*|   |   |
 \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ / \\ /
  | +5|   |   | % |   | %   % |   |   |
 / \\ / \\ / \\ / \\   \\ / \\ / \\ / \\ / \\ / \\
|   |   |-10|   | % |   |   |   | % |+10|
 \\ / \\ / \\ / \\ /     \\ / \\ / \\ /     \\ /
* best, # worst

 next, turn 3: chose se; e or w was better by
   0.62.

 < > turns  X worst  Tab why  ? help  q quit""",
    ("crying-baby", (), SMALL_SIZE, False): """\
 crying-baby  turn 5/5  score -19.42  turn limit
 over: the baby went hungry for 1 of 5 turns; you
   fed it 2 times. your score -19.42
   (undiscounted -21).
 verdict: good choices, bad luck
 silver medal: your choices lost 3.29 (the
   regret); gold is for at most 0.08
 choices: best action 2 of 5 times; worst: turn
   4, chose feed, not ignore: 2.83 of the score
   lost, by what you knew then
 score -19.42 = best play's average -13.47 - your
   choices 3.29 - luck 2.66

 Enter look back  PgUp log  ? help  q quit""",
    ("crying-baby", ("left", "left"), SMALL_SIZE, False): """\
 crying-baby  before turn 4/5  score -15.45
heard  quiet

sated   ███████████████████▌ 0.973
hungry  ▌··················· 0.027
chance of hunger, turn by turn ▅▁▁▁
true state: sated
hint: best i; s ▌··· -0.5; f ████ -3.88

 value lost ▁▃▁[▅]▃  most in turns 4, 5, 2
 next, turn 4: chose feed; ignore was better by
   3.88.

 ← → turns  X worst  Tab why  ? help  q quit""",
    ("crying-baby", ("left", "left"), LARGE_SIZE, True): """\
 dmplay crying-baby    seed 7   before turn 4/5   score (discounted) -15.45
 keep the baby sated (not hungry); hunger costs 10, feeding 5, singing 0.5
heard  quiet                                              reward   0
                                                          discount 0.90
sated   #######################################. 0.973    exact values
hungry  #....................................... 0.027    2 turns left
chance of hunger, turn by turn =___                         ignore -1.38
                                                            sing   -1.88
this turn: effort  reward  then hungry  value below best    feed   -5.27
i ignore    +0.00   -0.27          12%  best
s sing      -0.50   -0.77          12%  #......... -0.5
f feed      -5.00   -5.27           0%  ########## -3.88

a hungry baby cries: 80%, with a song 90%
a sated baby cries: 10%, with a song 0%
an unfed sated baby gets hungry: 10%; if quiet, less
true state: sated

 turn 3. chose ignore, heard quiet. belief: sated 0.973, hungry 0.027. reward
   0. score -15.45.
 value lost each turn _:_[=]:  [ ] = next turn; most in turns 4, 5, 2
 next, turn 4: chose feed; ignore was better by 3.88, 2.83 of the score.

 < > turns  X worst  Tab why  Enter play on  N new  R restart  ? help  q quit""",
    ("crying-baby", (), LARGE_SIZE, False): """\
 crying-baby  turn 5/5  score (discounted) -19.42  turn limit
 keep the baby sated (not hungry); hunger costs 10, feeding 5, singing 0.5
heard  quiet                           reward   -0.5
                                       discount 0.90
sated   ███████████████████▊ 0.989
hungry  ▎··················· 0.011
chance of hunger, turn by turn ▅▁▁▁▁▁
true state: sated

 over: the baby went hungry for 1 of 5 turns; you fed it 2 times. your score
   -19.42 (undiscounted -21).
 verdict: good choices, bad luck
 silver medal: your choices lost 3.29 (the regret); gold is for at most 0.08
 choices: best action 2 of 5 times; worst: turn 4, chose feed, not ignore: 2.83
   of the score lost, by what you knew then
 score -19.42 = best play's average -13.47 - your choices 3.29 - luck 2.66
 same start and luck: optimal scored -15, you -19.42
 marks in the log: ?! lost much (turn 4)

 turn 4. ?! chose feed, heard quiet. belief: sated 1.000, hungry 0.000.
 turn 5. chose sing, heard quiet. belief: sated 0.989, hungry 0.011. reward
   -0.5 (adds -0.33). score -19.42.

 Enter look back  PgUp log  X worst  Tab hint  ? help  q quit  : command""",
}  # fmt: skip


@pytest.mark.parametrize(("name", "keys", "size", "ascii_"), [*EXPECTED_FRAMES])
def test_the_end_and_the_lookback_frames_are_as_expected(
    name: str, keys: Sequence[str], size: tuple[int, int], ascii_: bool
) -> None:
    screen_text = press_keys(play_to_end(name, ascii_=ascii_), *keys, size=size)
    assert screen_text == EXPECTED_FRAMES[name, keys, size, ascii_]


def test_x_and_the_number_of_a_turn_go_to_a_turn_of_a_finished_game() -> None:
    screen = play_to_end("crying-baby")
    assert [choices.worst and choices.worst.turn for choices in screen.game.verdict.choices] == [4]
    assert "next, turn 4: chose feed; ignore was better" in press_keys(screen, "X")
    assert "next, turn 4" not in press_keys(screen, "X")
    assert "next, turn 3" in press_keys(screen, "2", "enter")
    assert press_keys(screen, "5", "enter") == press_keys(play_to_end("crying-baby"))
    assert "turn 6: this game has 5 turns" in press_keys(screen, "6", "enter")


def test_the_log_of_a_finished_game_marks_costly_turns_and_that_of_a_running_one_does_not() -> None:
    screen = play_to_end("crying-baby")
    marks = screen.game.verdict.marks
    assert marks == {4: "?!"}
    assert [row[:10] for row in screen.log if "?" in row] == ["turn 4. ?!"]
    running = PlayScreen(GameController(make_game("crying-baby", turns=9)), screen.terminal)
    press_keys(running, *KEYS_BY_PROBLEM["crying-baby"])
    assert not any("?" in row for row in running.log)


def test_keys_move_between_the_first_turn_and_the_end() -> None:
    screen = play_to_end("crying-baby")
    end = press_keys(screen)
    assert "next, turn 1" in press_keys(screen, "left", "home")
    assert "next, turn 1" in press_keys(screen, "left")
    assert "next, turn 2" in press_keys(screen, "right")
    assert "next, turn 5" in press_keys(screen, *["right"] * 3)
    assert press_keys(screen, "right") == end
    for key in ("end", "escape"):
        assert "next, turn 4" in press_keys(screen, "left", "left")
        assert press_keys(screen, key) == end


def test_the_lookback_shows_the_hidden_facts_of_every_turn() -> None:
    screen_text = press_keys(play_to_end("crying-baby"), *["left"] * 5)
    assert "true state: hungry" in screen_text
    assert "score (discounted) 0\n" in screen_text
    screen_text = press_keys(play_to_end("crying-baby"), *["left"] * 4)
    assert "reward -15. score -15." in " ".join(screen_text.split())


@pytest.mark.parametrize("key", ["left", "right", "home", "end", "enter"])
def test_the_lookback_is_not_available_before_the_end(key: str) -> None:
    screen = PlayScreen(
        GameController(make_game("crying-baby")), Terminal(True, "", True, True, False)
    )
    screen_text = press_keys(screen, "f", key)
    assert "of 20" not in screen_text
    assert "true state" not in screen_text
    assert "Enter play on" not in screen_text


def test_playing_on_from_an_earlier_turn_writes_a_branch_marked_as_peeked(tmp_path: Path) -> None:
    screen = play_to_end("crying-baby", current_game=make_saved_game(tmp_path))
    screen_text = press_keys(screen, "left", "left", "enter")
    assert "turn 4 again, in a new game" in screen_text
    assert "turn 3/5" in screen_text
    press_keys(screen, "i", "i")
    screen.controller.end_game()
    branch = tmp_path / "game-2.dmt"
    assert read_transcript(branch).header.peeked
    assert not read_transcript(tmp_path / "game.dmt").header.peeked
    assert verify(branch).is_ok


@pytest.mark.parametrize(
    ("changes", "message"),
    [({"strict": True}, "branch: this game is strict"), ({"strict": "hints"}, "branch: this game")],
)
def test_a_strict_game_cannot_be_played_on(
    tmp_path: Path, changes: dict[str, object], message: str
) -> None:
    screen_text = press_keys(
        play_to_end("crying-baby", current_game=make_saved_game(tmp_path, **changes)),
        "left",
        "enter",
    )
    assert message in screen_text
    assert "next, turn 5" in screen_text
    assert "← → turns  X worst  Tab why  N new  R restart  ? help" in screen_text


def test_a_game_without_a_transcript_cannot_be_played_on() -> None:
    assert "branch: this game is not recorded" in press_keys(
        play_to_end("hexworld"), "enter", "enter"
    )


def test_a_different_end_is_reviewed_again() -> None:
    screen = play_to_end("hexworld")
    assert "same start and luck: optimal scored 8.1, you -1.539" in press_keys(screen)
    assert "same random numbers" not in press_keys(screen, "backspace")
    assert "same start and luck: optimal scored 8.1, you -0.81" in press_keys(screen, "u")
    assert "next, turn 4: chose ne" in press_keys(screen, "enter")


def test_actions_without_values_are_listed_without_regret(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("push.py").write_text(REGULATOR_WITHOUT_AGENTS)
    game = make_game("./push.py", turns=TURN_LIMITS["simple-regulator"])
    screen_text = press_keys(play_to_end("simple-regulator", current_game=game), "enter")
    assert "next, turn 2: chose 0." in screen_text
    assert "regret" not in screen_text


def test_two_players_see_both_choices_after_the_end() -> None:
    current_game = make_game("travelers-dilemma", turns=1)
    screen = PlayScreen(GameController(current_game), Terminal(True, "", True, True, False))
    screen_text = press_keys(screen, *"99", "enter", *"50", "enter", "left")
    assert "agent1 chose 99" in screen_text
    assert "agent2 chose 50" in screen_text


def test_a_long_game_shows_the_regret_around_the_turn() -> None:
    current_game = make_game("hexworld", turns=90)
    screen = PlayScreen(GameController(current_game), Terminal(True, "", True, True, False))
    screen_text = press_keys(screen, *["l"] * 90, "enter", *["left"] * 3, size=SMALL_SIZE)
    row = next(row for row in screen_text.split("\n") if "value lost" in row)
    assert len(row) <= SMALL_SIZE[0]
    assert row == " value lost …▃▃▃▃▃[▃]▃▃▃  most in turns 2, 3, 4"


def test_dots_say_that_more_turns_lost_as_much_as_the_last_one_named() -> None:
    """Against tit-for-tat, turns 2, 4, 5 and 9 lose 2 each."""
    current_game = make_game("prisoners-dilemma", "human", "tit-for-tat", turns=10)
    screen = PlayScreen(GameController(current_game), Terminal(True, "", True, True, False))
    screen_text = press_keys(screen, *"cdcddcccdd", "enter")
    assert "most in turns 2, 4, 5, ..." in screen_text


def test_a_game_key_after_the_end_does_not_start_the_lookback() -> None:
    screen = PlayScreen(
        GameController(make_game("hexworld", turns=1)), Terminal(True, "", True, True, False)
    )
    end = press_keys(screen, "left")
    assert "Enter look back" in end
    assert "left: the game is over" in press_keys(screen, "left")
    assert "what if: the game is over" in press_keys(screen, "W")
    assert "next, turn 1: chose w" in press_keys(screen, "enter")
    assert press_keys(screen, "right") == end
    assert "left: the game is over" in press_keys(play_to_end("simple-regulator"), "left")


def test_other_keys_act_in_the_lookback_as_at_the_end() -> None:
    assert "You walk from hex to hex" in press_keys(play_to_end("hexworld"), "enter", "?")
    assert "next, turn 4" in press_keys(play_to_end("hexworld"), "enter", "?", "escape")
    reason = press_keys(play_to_end("hexworld"), "enter", "tab")
    assert "why e in the state (5,2) (optimal, 1 turn left)" in reason
    assert "before turn 4/4" in reason
    assert "next, turn 4" in press_keys(play_to_end("hexworld"), "enter", "tab", "escape")
    assert "x: no such key" in press_keys(play_to_end("hexworld"), "enter", "x")
    assert "next, turn 4" in press_keys(play_to_end("hexworld"), "enter", "x")


def test_before_the_first_turn_of_a_finished_game_there_is_no_reward_yet() -> None:
    assert "reward   -\n" in press_keys(play_to_end("crying-baby"), *["left"] * 5)


def test_a_game_with_ratings_shows_the_rating_lost_by_turn() -> None:
    screen = PlayScreen(
        GameController(make_game("2048", turns=4)), Terminal(True, "", True, True, False)
    )
    screen_text = press_keys(screen, "down", "left", "right", "left", "enter")
    assert "regret" not in screen_text
    assert "chose down, not judged (too close to call)." in press_keys(screen, "home")
    move = screen.game.verdict.moves[0]._replace(best=("left",), regret=900.0)
    timeline = GameTimeline(screen.game, [move])
    timeline.go_to_turn(0)
    assert timeline.describe_next_choices().endswith("chose down; left was rated higher.")
    assert timeline.regret_rows(80)[0].startswith("rating lost each turn ")
    assert "the game is over." in screen.game.narrator.describe_situation(screen.game.snapshot())


def test_x_goes_to_the_slide_that_is_rated_far_below_the_best_one() -> None:
    game = make_game("2048", turns=120)
    screen = PlayScreen(GameController(game), Terminal(True, "", True, True, False))
    press_keys(screen, *["up", "left", "down", "right"] * 45)
    screen_text = press_keys(screen, "X")
    losses = {move.turn: move.loss for move in game.verdict.moves}
    worst = max(losses, key=lambda turn: losses[turn])
    assert losses[worst] > game.verdict.moves[0].basis.resolution
    assert f"before turn {worst}/120" in screen_text
    assert "was rated higher" in screen_text


def test_a_look_back_does_not_call_an_action_better_because_of_its_bound() -> None:
    current_game = make_game("collaborative-predator-prey", "human", "chase-belief", turns=3)
    screen = PlayScreen(GameController(current_game), Terminal(True, "", True, True, False))
    press_keys(screen, "u", "y", "l")
    screen_text = press_keys(screen, "enter", "left")
    assert "which does not judge a choice" in screen_text
    assert "was better" not in screen_text
