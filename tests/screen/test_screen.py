"""The play screen without a terminal: what each key does, and what each size shows."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from rich.cells import cell_len

import dmplay
from dmplay.chance import Reals
from dmplay.describe import describe_end_reason
from dmplay.dice import SeededUniforms
from dmplay.finding.names import problem_names
from dmplay.game.checking import verify_file
from dmplay.game.game import Game
from dmplay.game.playback import Playback
from dmplay.game.request import GameRequest, ResumeRequest
from dmplay.game.seats import HUMAN
from dmplay.game.start import start_game, start_new_game
from dmplay.game.table import GameController
from dmplay.screen.acts import autoplay_turn
from dmplay.screen.footer import format_footer
from dmplay.screen.frame import compose_frame
from dmplay.screen.press import handle_key as do
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import FrameState, Viewport
from dmplay.screen.wrapping import format_panel, wrap_lines
from dmplay.session import Session
from dmplay.terminal import Terminal
from dmplay.words.commands import COMMANDS, run_line
from tests.support.screens import SEQUENCES, Easel, Paper, Played, game, play, press, seated, secret

HELP = tuple(str(run_line(GameController(game("hexworld")), "help")).split("\n") * 3)
PROBLEMS = ("2048", "crying-baby", "hexworld", "prisoners-dilemma")
SIZES = ((80, 24), (60, 20), (20, 5), (9, 3))
OPEN_BOARD = 1  # a seed of 2048 whose first board slides every way


@pytest.mark.parametrize("size", [(80, 24), (50, 14)])
@pytest.mark.parametrize("problem", PROBLEMS)
def test_what_the_terminal_shows_is_what_was_composed(problem: str, size: tuple[int, int]) -> None:
    shown = play(game(problem), "L", "V", "?", size=size)
    untouched = compose_frame(game(problem), Viewport(*size), FrameState(), [])
    assert shown.frames[0].split("\n") == [row.rstrip() for row in untouched.plain.split("\n")]
    assert len(shown.frames) == 4
    assert "You " in shown.last


# Keys


def bound(played: Game) -> dict[str, str]:
    """The label of each key's action, digits included."""
    labels = map(str, played.problem.actions[0].labels)
    digits = {str(number): label for number, label in enumerate(labels, 1)}
    return {**played.view_module.KEYS, **digits}


def pressed(played: Game, told: list[str]) -> Iterator[str]:
    """Each of these keys, and its turn taken back."""
    for key in bound(played):
        yield key
        (turn,) = played.session.turns
        told.append(played.problem.format_action(0, turn.actions[0]))
        yield "backspace"


@pytest.mark.parametrize("problem", PROBLEMS)
def test_every_key_of_a_view_plays_its_action(problem: str) -> None:
    seats = [HUMAN, "grim"] if problem == "prisoners-dilemma" else [HUMAN]
    played, told = game(problem, *seats, seed=OPEN_BOARD), list[str]()
    press(played, pressed(played, told))
    assert told == [*bound(played).values()]


def easel(played: Game) -> Easel:
    """The screen of a game as it is painted."""
    shown = Easel(Paper(), 80, 24)
    shown.enter_screen()
    PlayScreen(GameController(played), Terminal(True, "", True, False, False)).paint(shown)
    return shown


@pytest.mark.parametrize(
    ("problem", "glyph"), [("hexworld", "@"), ("predator-prey", "A"), ("cart-pole", "")]
)
def test_the_real_cursor_stands_on_the_player(problem: str, glyph: str) -> None:
    screen = easel(game(problem)).paper.screen
    at = screen.display[screen.cursor.y][screen.cursor.x]
    assert (screen.cursor.hidden, at if glyph else "") == (not glyph, glyph)


def test_the_real_cursor_stands_on_the_player_where_others_are_as_well() -> None:
    screen = easel(seated("predator-prey", together(), [HUMAN, HUMAN])).paper.screen
    column, row = screen.cursor.x, screen.cursor.y
    assert screen.display[row][column] == "*"
    assert "Ao" in screen.display[row + 1][column - 2 : column + 3]


def together() -> Session:
    """A hunt in which both are on one hex."""
    hunt = Session(dmplay.load_problem("predator-prey"), SeededUniforms(1))
    hunt.initial_state = np.array([4, 4])
    return hunt


def test_a_fact_that_is_too_long_for_its_row_goes_on_in_the_next() -> None:
    facts = ("last", "NE"), ("slips aside", "0.15 each"), ("who", "one two three four five")
    told = [row.plain.rstrip() for row in format_panel(facts, 17)]
    assert told == [
        "last NE",
        "slips aside",
        "  0.15 each",
        "who",
        "  one two three",
        "  four five",
    ]


def test_the_first_arrow_of_a_diagonal_explains_itself_and_no_other_key_completes_it() -> None:
    shown = play(game("hexworld"), "up", "x", "down", "right")
    assert "up, then left or right: a diagonal" in shown.frames[1]
    assert "x: no such key" in shown.frames[2]
    assert "turn 1. " in shown.last
    assert "chose SE" in shown.last


def test_tab_hints_without_playing() -> None:
    played = game("hexworld")
    assert "hint (optimal): se\n" in play(played, "tab").last
    assert played.session.turns == []


def test_before_the_first_turn_there_are_no_dice_to_throw_anew() -> None:
    assert "reroll: no turn was played yet" in play(game("2048"), ":", "reroll enter").last


def test_a_turn_under_other_dice_is_in_the_log() -> None:
    keys = ("left", ":", "reroll enter", ":", "reroll enter", "L")
    shown = play(game("2048"), *keys, size=(80, 40)).last
    told = [row.strip() for row in shown.split("\n") if "slid left." in row]
    assert told == [
        "turn 1. slid left. new 2 in row 3, column 2. reward 4. score 4.",
        "turn 1, under other dice. slid left. new 2 in row 3, column 2. reward 4. score",
        "turn 1, under other dice. slid left. new 4 in row 4, column 1. reward 4. score",
    ]


@pytest.mark.parametrize("key", ["backspace", "c-_"])
def test_undo_and_redo_have_keys(key: str) -> None:
    played = game("hexworld")
    shown = play(played, "h", "h", key, "c-r")
    assert "undone. turn 1." in shown.frames[3]
    assert "turn 2 " in shown.last
    assert "nothing was taken back" in play(played, "c-r").last
    assert "undo 1: 0 turns were played" in play(game("hexworld"), key).last


def test_what_was_done_before_a_fault_is_logged() -> None:
    shown = play(game("hexworld"), "h", "backspace", ":", "redo space 2 enter")
    assert "redo: nothing was taken back" in shown.last
    assert shown.last.count("turn 1. ") == 2  # played, and played again


@pytest.mark.parametrize("key", ["?", "f1"])
def test_help_names_every_action_and_every_command(key: str) -> None:
    shown = play(game("hexworld"), key, "space", "h")
    page = shown.frames[1] + shown.frames[2]
    for command in COMMANDS:
        assert command.name in page
        assert command.key_label in page
    assert "actions: l e,  u ne,  y nw,  h w,  b sw,  n se" in shown.frames[1]
    for shown_key in "VP+-":
        assert f"   {shown_key} " in shown.frames[1]
    assert "turn 0 " in shown.last
    assert "actions:" not in shown.last


def test_help_brings_the_keys_back_onto_the_board() -> None:
    played = game("hexworld", parameters={"rewards": []})
    shown = play(played, *"hlhlhl", "?", "x")
    named = [any(f"  {key}  │" in frame for key in "hlyubn") for frame in shown.frames]
    assert named == [True] * 5 + [False] * 3 + [True]


def test_a_typed_move_closes_the_help() -> None:
    shown = play(game("hexworld"), "?", ":", "w enter")
    assert "actions: " in shown.frames[1]
    assert "actions: " not in shown.last
    assert "turn 1. at (6,2)" in shown.last


def test_help_that_is_longer_than_the_screen_comes_in_parts() -> None:
    shown = play(game("hexworld"), "?", *["space"] * 6, "h", size=(50, 14))
    for number in range(1, 7):
        goes_on = "Space goes on" if number < 6 else "any key goes back"
        assert f"part {number} of 6. {goes_on}" in shown.frames[number]
    parts = "".join(shown.frames[1:7])
    assert all(command.name in parts for command in COMMANDS)
    assert "part" not in shown.frames[7]
    assert "turn 1 " in shown.last


def test_look_tells_the_whole_situation_though_its_row_cuts_it() -> None:
    shown = play(game("hexworld"), "L").last
    assert "\n at (7,2). E (8,2) floor. NE wall. " in shown
    assert "goal\n   +10 at (9,0): 2 steps.\n" in shown


def test_overlays_take_turns() -> None:
    shown = play(game("hexworld"), "V", "V", "V", "V", size=(80, 24))
    assert "overlay: values" in shown.frames[1]
    assert "│ 7.04│" in shown.frames[1]
    assert "overlay: policy" in shown.frames[2]
    assert "  ↘  " in shown.frames[2]
    assert "overlay: states" in shown.frames[3]
    assert "│  22 │" in shown.frames[3]
    assert "overlay: none" in shown.frames[4]


@pytest.mark.parametrize(("problem", "size"), [("crying-baby", (80, 24)), ("hexworld", (40, 20))])
def test_a_board_without_overlays_says_so(problem: str, size: tuple[int, int]) -> None:
    shown = play(game(problem), "V", size=size)
    assert "this board has no overlays" in shown.last
    assert shown.frames[1].replace("this board has no overlays", "").split() == (
        shown.frames[0].split()
    )


def test_a_key_without_a_meaning_says_so() -> None:
    assert "z: no such key; ? shows them" in play(game("crying-baby"), "z").last


def test_repainting_changes_nothing_on_the_screen() -> None:
    shown = play(game("hexworld"), "h", "c-l")
    assert shown.frames[1] == shown.frames[2]


@pytest.mark.parametrize(("key", "code"), [("q", 0), ("c-d", 0), ("c-c", 130)])
def test_three_keys_leave(key: str, code: int) -> None:
    assert play(game("hexworld"), key, "h").code == code


def test_the_command_row_plays_undoes_refuses_and_closes() -> None:
    played = game("hexworld")
    shown = play(
        played, ":", "w enter", ":", "act space e enter", ":", "undo enter", ":", "hnt enter",
        ":", "undo", "escape", "h",
    )  # fmt: skip
    assert shown.frames[1].split("\n")[-2] == " :"
    assert "turn 1 " in shown.frames[2]
    assert "turn 2 " in shown.frames[4]
    assert "undone. turn 1." in shown.frames[6]
    assert "unknown action 'hnt'; did you mean hint" in shown.frames[8]
    assert " :undo" in shown.frames[10]
    assert " :undo" not in shown.frames[11]
    assert "turn 2 " in shown.last
    assert play(game("hexworld"), ":", "quit enter", "h").code == 0


def test_the_command_row_closed_by_ctrl_c_ends_the_game() -> None:
    assert play(game("hexworld"), ":", "un", "c-c").code == 130


def test_the_command_row_lists_what_completes_it() -> None:
    shown = play(game("hexworld"), ":", "play space hexw", "tab", "escape")
    assert "hexworld:straight-line" in shown.frames[3]


def test_words_typed_in_the_command_row_are_no_keys() -> None:
    played = game("hexworld")
    shown = play(played, ":", "hlq?:")
    assert " :hlq?:" in shown.last
    assert played.session.turns == []


def test_agents_are_stepped_and_a_person_is_not() -> None:
    played = game("hexworld", "optimal")
    assert "turn 2 " in play(played, "space", "right").last
    assert "no such key" in play(game("crying-baby"), "right").last
    assert "turn 0/20" in play(game("crying-baby"), "space").last


def test_what_steps_on_and_lets_play_says_that_the_game_is_over() -> None:
    watched = play(game("hexworld", "script:e"), "space", "space", "space", "P")
    assert ["the game is over" in frame for frame in watched.frames] == [False] * 3 + [True] * 2
    shown = play(game("prisoners-dilemma", "human", "random", turns=1), "c", "P")
    assert "the game is over" in shown.last


def test_turns_that_are_played_at_once_are_all_in_the_log() -> None:
    shown = play(game("hexworld", "optimal"), ":", "auto enter", "x").last
    told = [row.partition(".")[0].strip() for row in shown.split("\n") if " chose " in row]
    assert told == ["turn 1", "turn 2", "turn 3"]


def test_agents_play_and_stop_by_one_key_faster_or_slower() -> None:
    shown = play(game("hexworld", "optimal"), "+", "+", "-", "P", "P")
    assert "3 turns a second" in shown.frames[1]
    assert "4.5 turns a second" in shown.frames[2]
    assert "3 turns a second" in shown.frames[3]
    assert "paused; P goes on" in shown.last
    assert "there is nothing to pause" in play(game("hexworld"), "P").last


def test_a_long_game_that_is_not_kept_is_not_left_by_one_key() -> None:
    played = game("hexworld", parameters={"rewards": []})
    shown = play(played, *"hl" * 11, "q", "h", "q", "q", "h")
    assert "22 turns are not kept; q once more leaves" in shown.frames[23]
    assert "23 turns are not kept; q once more leaves" in shown.frames[25]
    assert len(shown.frames) == 26


def test_a_screen_without_room_for_a_board_is_played_in_text() -> None:
    shown = play(game("hexworld"), "h", size=(20, 6))
    assert shown.frames[0].split("\n")[1:4] == [
        "need 19x9",
        " at (7,2). E (8,2)",
        "   floor. NE wall.",
    ]
    assert shown.last.split("\n")[2:4] == [" turn 1. at (6,2).", "   chose W, moved …"]


@pytest.mark.parametrize(
    ("problem", "agent", "called"),
    [
        ("predator-prey", "chase", "A is the predator, o is the prey"),
        ("prisoners-dilemma", "grim", "agent1   -1"),
        ("hexworld", "optimal", "@ agent"),
        ("collaborative-predator-prey", "sweep", "@ where predator1 may be"),
        ("collaborative-predator-prey", "sweep", "predator1 senses it from the next hex"),
        ("simple-regulator", "optimal", "the push is added to it"),
        ("travelers-dilemma", "random", "agent1 ↓   agent2 →"),
    ],
)
def test_an_agent_that_is_watched_is_called_by_its_name(
    problem: str, agent: str, called: str
) -> None:
    watched = start_new_game(GameRequest(problem, agent=agent, seed=7))
    drawn = compose_frame(watched, Viewport(120, 30), FrameState(), []).plain
    assert called in drawn
    assert "you" not in drawn + watched.narrator.describe_situation(watched.snapshot())


@pytest.mark.parametrize(
    ("problem", "called"),
    [
        ("predator-prey", "A is the predator, o is the prey"),
        ("hexworld", "@ agent"),
        ("collaborative-predator-prey", "@ predator1"),
        ("simple-regulator", "the push is added to it"),
        ("travelers-dilemma", "agent1 ↓   agent2 →"),
    ],
)
def test_whoever_played_a_recorded_game_is_called_by_name(
    problem: str, called: str, tmp_path: Path
) -> None:
    start_new_game(GameRequest(problem, seed=7, record_path=tmp_path / "g.dmt")).finish()
    recorded = Playback(tmp_path / "g.dmt")
    drawn = compose_frame(recorded, Viewport(120, 30), FrameState(), []).plain
    assert called in drawn
    assert "you" not in drawn + recorded.narrator.describe_situation(recorded.snapshot())


def test_a_recording_hides_neither_states_nor_rewards(tmp_path: Path) -> None:
    played = start_new_game(
        GameRequest("crying-baby", agent="feed-when-crying", seed=5, record_path=tmp_path / "g")
    )
    list(played.iter_agent_turns())
    played.finish()
    recorded = Playback(tmp_path / "g")
    recorded.play_agent_turn()
    told = "turn 1. crying. chose ignore. belief: hungry 0.907, sated 0.093. reward -10. score -10."
    assert recorded.narrator.describe_turn(recorded.snapshot()) == told
    drawn = compose_frame(recorded, Viewport(80, 24), FrameState(), []).plain
    assert "truly hungry" in drawn
    assert "reward   -10" in drawn


def test_agents_that_play_behind_a_page_are_logged_turn_by_turn() -> None:
    screen = PlayScreen(
        GameController(game("hexworld", "optimal")), Terminal(True, "", True, False, False)
    )
    do(screen, "?")
    autoplay_turn(screen)
    assert [row.partition(".")[0] for row in screen.log] == ["turn 1"]


def test_a_page_stays_open_on_a_screen_that_needs_fewer_parts() -> None:
    played = game("hexworld")
    shown = FrameState(page_rows=HELP, page_index=9)
    for size in ((80, 4), (80, 10), (80, 24), (200, 60)):
        rows = compose_frame(played, Viewport(*size), shown, []).plain.split("\n")
        assert len(rows) == size[1]


@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5, 6])
def test_a_curtain_on_the_smallest_screens_names_who_is_next(rows: int) -> None:
    curtain = FrameState(handover_agent="caregiver2")
    drawn = compose_frame(game("multicaregiver-crying-baby"), Viewport(60, rows), curtain, []).plain
    assert "caregiver2 is next" in drawn
    assert "heard" not in drawn


def test_a_log_begins_with_the_goal_where_that_has_no_row_of_its_own() -> None:
    for rows in (19, 24):
        begun, moved = play(game("hexworld"), "l", size=(80, rows)).frames
        assert begun.count("reach +10 or +5") == 1
        assert moved.count("reach +10 or +5") == (rows == 24)


@pytest.mark.parametrize("problem", PROBLEMS)
@pytest.mark.parametrize("rows", [1, 2, 3, 4, 5])
def test_the_smallest_screens_tell_what_is_most_urgent(problem: str, rows: int) -> None:
    played = game(problem)
    shown = play(played, "L", "?", "x", "V", size=(60, rows))
    assert {len(frame.split("\n")) for frame in shown.frames} == {rows}
    begun = " ".join(shown.frames[0].split())
    assert ("need " in begun and "; playing in text" in begun) or rows > 3
    assert played.narrator.describe_situation(played.snapshot())[:20] in " ".join(
        shown.frames[1].split()
    )
    assert " You " in shown.frames[2]


def test_a_terminal_of_one_row_shows_one_line_of_text_while_keys_act() -> None:
    shown = play(game("hexworld"), "l", "e", "?", size=(40, 1))
    assert shown.frames == [
        " need 19x9; playing in text. at (7,2). …",
        " turn 1. at (8,2). chose E, moved E. re…",
        " e: no such key; ? shows them",
        " You are @ and walk from hex to hex;",
    ]


def test_a_line_of_the_log_is_shown_whole_or_its_beginning() -> None:
    rows = play(game("hexworld"), "l", "u", size=(30, 5)).last.split("\n")
    assert rows[2].endswith("…")
    assert rows[2].startswith(" turn 2. at (8,2). chose NE")


def test_a_game_that_is_over_takes_no_more_actions() -> None:
    played = game("crying-baby", turns=1)
    shown = play(played, "f", "f", "tab")
    assert "over: turn limit after 1 turn. " in shown.frames[1]
    assert len(played.session.turns) == 1
    assert "no hint: the game is over" in shown.last


def test_a_hidden_entry_shows_nothing_of_its_length_its_letters_or_what_is_wrong_with_it() -> None:
    first, second = (
        play(game("rock-paper-scissors"), ":", word, "enter") for word in ("rok", "scisors")
    )
    assert first.frames == second.frames
    assert "\n :(what is typed is not shown)" in first.frames[1]
    assert "that cannot be played; help and legal tell what can be typed" in first.last
    claims = game("travelers-dilemma"), game("travelers-dilemma")
    frames = [play(claims[0], "7").last, play(claims[1], "7", "5").last]
    assert frames[0] == frames[1]
    wrong = [play(game("travelers-dilemma"), *keys, "enter").last for keys in ("1", "999")]
    assert wrong[0] == wrong[1]


def test_a_game_that_is_gone_on_with_tells_its_last_turn(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    begun = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    begun.choose(3)
    begun.finish("interrupted")
    shown = play(start_game(ResumeRequest(path))).last
    assert " turn 1. at (6,2). chose W, moved W. reward 0. score 0." in shown
    assert "undone" not in shown


@pytest.mark.parametrize("keys", ["6 0", "right right left", "4 backspace 6 0"])
def test_a_distance_is_typed_or_nudged_and_thrown_by_enter(keys: str) -> None:
    played = game("catch")
    shown = play(played, *keys.split(), "enter", "enter")
    assert "60 throws 60 m: caught 39%, pays 23 on average   Enter plays it" in shown.frames[-3]
    assert "→60←" in shown.frames[-3]
    assert "threw 60 m." in shown.frames[-2]
    assert "no number is written yet" in shown.last
    assert "type a number, Enter plays it  ← → nudge it" in shown.last
    assert len(played.session.turns) == 1


@pytest.mark.parametrize(
    ("name", "keys", "told"),
    [
        ("catch", "6", "6 throws 60 m: caught 39%, pays 23 on average   Enter plays it"),
        ("catch", "6 1", "61: expected a whole number from 10 to 100 in steps of 10"),
        ("simple-regulator", "-", "-: expected a number from -10 to 10"),
        ("simple-regulator", "- . 2", "-.2 aims at -0.037; costs 0.027 now, 0.011 next on average"),
    ],
)
def test_what_a_number_means_or_costs_is_told_before_it_is_played(
    name: str, keys: str, told: str
) -> None:
    assert f" {told}" in play(game(name), *keys.split()).last


@pytest.mark.parametrize("name", ["machine-replacement", "collision-avoidance"])
def test_a_narrow_key_row_shortens_actions_but_shows_them_all(name: str) -> None:
    row = play(game(name), size=(50, 14)).last.split("\n")[-1]
    assert row.endswith("? help  q quit")
    labels = game(name).problem.actions[0].labels
    assert all(f" {label[:3]}" in row for label in labels)


def test_advice_where_two_choose_at_once_says_what_it_rests_on() -> None:
    shown = play(game("prisoners-dilemma", "human", "grim"), "c", "tab").last
    assert " hint (best reply to what the other's play suggests): defect\n" in shown
    assert "  ████ -1" in shown


# Whole games


def presses(played: Game) -> Iterator[str]:
    """Keys that play a game to its end: now this action, now that, whoever is to choose."""
    for number in count():
        if played.session.over:
            return
        if played.keyboard.is_number_entry(played.viewing_seat):
            yield from "2" if number % 2 else "37"
            yield "enter"
        else:
            able = [
                key
                for key, _, able in played.keyboard.list_actions_with_keys(played.view())
                if able
            ]
            yield able[number * 5 // 3 % len(able)]
        if played.has_private_views and played.choosing_seat is not None:
            yield "enter"


@pytest.mark.parametrize(
    ("line", "width", "rows"),
    [
        (
            "  W       what if        what an action may bring, before you play it",
            40,
            """\
   W       what if        what an
   action may bring, before you play it""",
        ),
        (
            "  W       what if        what an action may bring, before you play it",
            50,
            """\
   W       what if        what an action may
                          bring, before you play
                          it""",
        ),
        (
            "actions: 10,  20,  30,  40,  50,  60,  70,  80,  90,  100",
            50,
            """\
 actions: 10,  20,  30,  40,  50,  60,  70,  80,
   90,  100""",
        ),
    ],
)
def test_what_stands_in_columns_goes_on_below_the_last_where_that_is_wide(
    line: str, width: int, rows: str
) -> None:
    assert [row.rstrip() for row in wrap_lines([line], Viewport(width, 14))] == rows.split("\n")


ALONE = [(name, "") for name in problem_names()]
TOGETHER = [(name, HUMAN) for name in problem_names() if len(dmplay.load_problem(name).agents) > 1]


@pytest.mark.usefixtures("coarse")
@pytest.mark.parametrize(("name", "others"), [*ALONE, *TOGETHER])
def test_every_problem_is_played_to_its_end_by_keys_and_its_transcript_verifies(
    name: str, others: str, tmp_path: Path
) -> None:
    path = tmp_path / "game.dmt"
    played = start_new_game(
        GameRequest(name, seed=7, turns=4, other_agent=others, record_path=path)
    )
    shown = press(played, presses(played))
    assert played.session.end_reason in ("terminal", "horizon", "turn limit")
    end = f"over: {describe_end_reason(played.session.end_reason)} after {len(played.session.turns)} turns. "
    assert end in shown.last
    undo = "" if played.problem.partially_observable else "  Bksp undo"  # what was hidden is shown
    assert shown.last.endswith(f" N new  R restart{undo}  ? help  q quit  : command")
    played.finish()
    report = verify_file(path)
    assert report.is_ok, str(report)
    assert report.turns == len(played.session.turns) > 0


# Several people


def test_two_at_a_keyboard_never_move_one_another() -> None:
    played = game("predator-prey", seed=1)
    shown = play(played, "l", "l", "h", "1", "h")
    assert played.session.turns == []
    assert "prey chooses; the other choice stays hidden" in shown.last
    play(played, "l", "d")
    chosen = played.session.turns[0].actions
    assert [played.problem.format_action(seat, chosen[seat]) for seat in (0, 1)] == ["e", "e"]
    play(played, "a", "h")
    chosen = played.session.turns[1].actions
    assert [played.problem.format_action(seat, chosen[seat]) for seat in (0, 1)] == ["w", "w"]


def test_a_curtain_hides_the_board_between_people_who_see_different_things() -> None:
    played = game("collaborative-predator-prey", "human", "human")
    shown = play(played, "h", "l", "L", "enter", "l", "enter", "h", "enter")
    first, hidden, *_ = shown.frames
    assert "you: predator1" in first
    assert shown.frames[1:4] == [hidden] * 3  # neither a move nor a look comes through
    assert "predator2 is next: nobody else should look now. Enter shows the board." in hidden
    assert "│" not in hidden
    assert "saw" not in hidden
    assert "you: predator2" in shown.frames[4]
    assert "predator1 is next" in shown.frames[5]
    assert "turn 1. " in shown.frames[6]
    assert "you: predator1" in shown.frames[6]
    assert "predator2 is next" in shown.frames[7]
    assert "turn 1. " in shown.last
    assert "you: predator2" in shown.last


def test_each_of_two_people_has_a_log_of_what_it_may_know() -> None:
    played = game("multicaregiver-crying-baby")
    shown = play(played, "f", "enter", "s", "enter", "i", "enter")
    first, second = shown.frames[4], shown.last
    assert "chose feed" in first
    assert "chose sing" not in first
    assert "chose sing" in second
    assert "chose feed" not in second


def test_behind_the_curtain_only_leaving_is_possible() -> None:
    played = game("multicaregiver-crying-baby")
    shown = play(played, "f", ":", "V", "?", "backspace")
    assert shown.frames[1:] == [shown.frames[1]] * 5
    assert play(game("multicaregiver-crying-baby"), "f", "q", "f").code == 0
    assert len(played.session.turns) == 0


def test_a_line_that_goes_on_after_a_choice_tells_nothing_of_the_next_person() -> None:
    played = game("multicaregiver-crying-baby")
    shown = play(played, "f", "enter", "s", "enter", ":", "feed; belief", "enter")
    assert "caregiver2 is next: nobody else should look now" in shown.last
    assert "belief" not in shown.last
    assert len(played.session.turns) == 1


def test_people_who_see_the_same_have_no_curtain() -> None:
    assert "is next" not in play(game("prisoners-dilemma"), "c").last


# Composition


@cache
def situations(problem: str) -> tuple[tuple[Game, FrameState, tuple[str, ...]], ...]:
    """A game begun, going on, with help, with an overlay and a long message, and over."""
    begun = game(problem, parameters={"rewards": []} if problem == "hexworld" else {})
    going, over = game(problem), game(problem)
    log = []
    for played in (going, over):
        for _ in range(3):
            while not played.choose(next(a for a in range(4) if legal(played, a))):
                pass
            log.append(played.narrator.describe_turn(played.snapshot()))
    over.finish("quit")
    long = FrameState(run_line(GameController(game(problem)), "keys"), "values")
    return (
        (begun, FrameState(), ()),
        (going, FrameState(), tuple(log)),
        (going, FrameState(page_rows=HELP), tuple(log)),
        (going, long, tuple(log)),
        (over, FrameState("a message"), tuple(log * 9)),
    )


def legal(played: Game, action: int) -> bool:
    able = played.session.legal_actions_mask(played.viewing_seat)
    return able is None or bool(able[action])


@pytest.mark.parametrize("ascii_", [False, True])
@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_screen_has_exactly_its_rows_and_none_is_too_wide(
    problem: str, size: tuple[int, int], ascii_: bool
) -> None:
    room = Viewport(*size, ascii_)
    for played, shown, log in situations(problem):
        rows = compose_frame(played, room, shown, list(log)).plain.split("\n")
        assert len(rows) == room.height
        assert max(map(cell_len, rows)) <= room.width
        assert not ascii_ or "".join(rows).isascii()


@pytest.mark.parametrize("problem", PROBLEMS)
def test_a_row_that_is_cut_shows_it(problem: str) -> None:
    wide = compose_frame(*_first(problem, 300)).plain.split("\n")
    cut = compose_frame(*_first(problem, 40)).plain.split("\n")
    assert {*cut[0].split()} <= {*wide[0].split()}, "a title tells a fact whole"
    assert not cut[-2].strip(), "the log tells it"
    assert "a message a message" in "\n".join(cut[:-2])


def test_a_path_that_no_row_holds_is_told_whole() -> None:
    path = "/home/somebody/" + "a-folder/" * 9 + "game.dmt"
    rows = compose_frame(
        game("hexworld"), Viewport(50, 24), FrameState(page_rows=[f"transcript: {path}"]), []
    ).plain
    assert f"transcript:{path}" in "".join(rows.split())


def test_a_title_without_room_gives_up_the_seed_before_the_others() -> None:
    whole = play(game("prisoners-dilemma", "human", "tit-for-tat"), size=(100, 24)).last
    assert whole.startswith(
        " dmplay prisoners-dilemma    seed 7   turn 0/10   score 0   "
        "you: agent1   agent2: tit-for-tat\n"
    )
    narrow = play(game("prisoners-dilemma", "human", "tit-for-tat"), size=(80, 24)).last
    assert narrow.startswith(
        " prisoners-dilemma  turn 0/10  score 0  you: agent1  agent2: tit-for-tat\n"
    )


def _first(problem: str, width: int) -> tuple[Game, Viewport, FrameState, list[str]]:
    return game(problem), Viewport(width, 24), FrameState("a message " * 9), []


@pytest.mark.parametrize("width", [50, 60, 80])
@pytest.mark.parametrize("problem", PROBLEMS)
def test_the_key_row_has_all_actions_before_any_key_of_the_shell(problem: str, width: int) -> None:
    played = game(problem)
    row = format_footer(played, Viewport(width, 24)).plain
    for key, label, able in played.keyboard.list_actions_with_keys(played.view()):
        words = label if key == label else f"{key} {label}"
        assert (words if able else f"[{words}]") in row
    assert "? help" in row


def test_labels_that_look_alike_when_they_are_cut_leave_their_keys() -> None:
    played = game("openspiel:tic_tac_toe", "human", "random")
    row = format_footer(played, Viewport(80, 24)).plain
    assert row.startswith(" 1  2  3  4  5  6  7  8  9  Tab hint ")  # the board lists what they play


def test_names_of_outsiders_reach_the_screen_as_what_they_print() -> None:
    evil = seated("hex\x1b]0;x\x07", game("hexworld").session, ["\x9b31m\u202e"])
    text = compose_frame(evil, Viewport(200, 24), FrameState("no \x1b[2J such key"), []).plain
    assert text.replace("\n", "").isprintable()
    assert r"\x1b]0;x\x07" in text


# Privacy


@dataclass(frozen=True)
class Nature:
    """Draws that are always the same: the opening's, then each turn's."""

    opening: float
    turn: float

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """So many of the same number."""
        return np.full((1, count), self.turn if turn else self.opening)


@pytest.mark.parametrize("size", [(80, 24), (50, 14)])
def test_the_screen_of_a_person_is_the_same_bytes_whatever_the_hidden_state(
    size: tuple[int, int],
) -> None:
    keys = (
        "i", "s", "tab", "L", "V", "V", "?", "x", "i", "backspace", "c-r", ":", "state", "enter",
        ":", "belief", "enter", "i",
    )  # fmt: skip
    told: list[tuple[list[int], list[int], Played, dict[str, object], str]] = []
    for nature in (Nature(0.25, 0.5), Nature(0.75, 0.95)):
        session = game("crying-baby", source=nature).session
        played = seated("crying-baby", session, [HUMAN], secret("crying-baby"))
        shown = play(played, *keys, size=size)
        states = [int(turn.state) for turn in played.session.turns]
        seen = [int(turn.observations[0]) for turn in played.session.turns]
        told.append(
            (
                states,
                seen,
                shown,
                played.narrator.visible_turn_facts(played.snapshot()),
                played.narrator.describe_situation(played.snapshot()),
            )
        )
    sated, hungry = told
    assert sated[0] == [0] * 4
    assert hungry[0] == [1] * 4
    assert sated[1] == hungry[1]
    assert sated[2].frames == hungry[2].frames
    assert sated[2].written == hungry[2].written
    assert sated[3:] == hungry[3:]
    assert len(sated[2].frames) == len(keys) + 1


def test_every_key_of_a_view_can_be_typed() -> None:
    for problem in PROBLEMS:
        for key in game(problem).view_module.KEYS:
            assert all(len(word) == 1 or word in SEQUENCES for word in key.split())
