"""Tests of the end of a game: the verdict stays on screen, and its keys do what they offer."""

from pathlib import Path

import pytest

from dmplay.game.background_tasks import TaskInfo
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.transcript.recorder import Recorder
from dmplay.ui.screen.busy_keys import BusyKeyAction, classify_busy_key
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.log_rows import list_verdict_lines
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.text_wrapping import wrap_lines
from tests.support.screens import KEY_SEQUENCES
from tests.support.terminals import ENTER, ESCAPE, Terminal
from tests.ui.screen.frames import BASE_TERMINAL, GAMES, SEED, FrameRecorder, _press_keys

PAGE_UP = "\x1b[5~"
SIZES = ((50, 14), (80, 24), (120, 40), (200, 60))


def play_to_end(name: str, folder: Path) -> PlayScreen:
    script = GAMES[name]
    request = GameRequest(name, seed=SEED, turns=script.turns, record_path=folder / "game.dmt")
    screen = PlayScreen(GameController(start_new_game(request)), BASE_TERMINAL)
    _press_keys(screen, f"{script.first} {script.then}")
    assert screen.game.session.over
    return screen


def draw(screen: PlayScreen, size: tuple[int, int]) -> list[str]:
    recorder = FrameRecorder()
    recorder.columns, recorder.rows = size
    screen.paint(recorder)
    return [row.rstrip() for row in recorder.frame.plain.split("\n")]


def iter_key_sequences(name: str) -> list[str]:
    """Return the characters that a terminal sends for the keys of a scripted game."""
    script, sequences = GAMES[name], []
    types_numbers = name in ("simple-regulator", "catch", "travelers-dilemma")
    for step in f"{script.first} {script.then}".split():
        times, _, key = step.rpartition("*")
        sequence = f"{key}{ENTER}" if types_numbers else KEY_SEQUENCES.get(key, key)
        sequences += [sequence] * int(times or 1)
    return sequences


@pytest.mark.parametrize("name", GAMES)
def test_the_verdict_is_visible_as_far_as_it_fits_and_the_log_key_shows_the_rest(
    name: str, tmp_path: Path
) -> None:
    screen = play_to_end(name, tmp_path)
    lines = list_verdict_lines(screen.game)
    assert len(lines) >= 3
    for size in SIZES:
        rows = draw(screen, size)
        card = [row.rstrip() for row in wrap_lines(lines, Viewport(*size))]
        first = rows.index(card[0])
        space = size[1] - 3 - first  # above the rows of messages and keys
        assert rows[first:][: min(len(card), space)] == card[:space]
        for key in ("Enter look back", "PgUp log", "q quit"):
            assert key in rows[-1]
    for key in ("N new", "R restart"):
        assert key in draw(screen, (80, 24))[-1]


@pytest.mark.parametrize("key", ["enter", "left", "X", "pageup", "?"])
def test_the_keys_that_a_finished_game_offers_wait_for_its_review(key: str) -> None:
    review = TaskInfo("reviewing your actions", is_after_game=True)
    assert classify_busy_key(key, review, "h") is BusyKeyAction.RUN_LATER
    assert classify_busy_key(key, review, key) is BusyKeyAction.RUN_LATER
    assert classify_busy_key("escape", review, "h") is BusyKeyAction.CANCEL
    assert classify_busy_key("N", review, "h") is BusyKeyAction.CANCEL_THEN_RUN


@pytest.mark.parametrize("key", ["h", "3", "up", "space"])
def test_an_action_key_pressed_too_late_does_not_cancel_the_review(key: str) -> None:
    review = TaskInfo("reviewing your actions", is_after_game=True)
    assert classify_busy_key(key, review, "h") is BusyKeyAction.IGNORE


def test_a_key_of_a_finished_game_skips_the_game_of_another_agent() -> None:
    ghost = TaskInfo("optimal is playing the same game", is_after_game=True, can_be_skipped=True)
    assert classify_busy_key("enter", ghost, "h") is BusyKeyAction.CANCEL_THEN_RUN
    assert classify_busy_key("h", ghost, "h") is BusyKeyAction.IGNORE


def test_the_hidden_facts_of_two_agents_are_a_table_of_one_row_per_turn(tmp_path: Path) -> None:
    screen = play_to_end("multicaregiver-crying-baby", tmp_path)
    assert screen.game.narrator.debrief_table() == [
        "caregiver1 / caregiver2; one value alone is for all; beliefs as if the others acted at "
        "random",
        "turn  action         state after  observation  reward       belief: sated, hungry",
        "0                    hungry                                 0.500, 0.500",
        "1     ignore         hungry       crying       -10          0.000, 1.000",
        "2     sing / feed    sated        quiet        -10.5 / -15  0.833, 0.167 / 1.000, 0.000",
        "3     feed / ignore  sated        quiet        -2.5 / 0     1.000, 0.000 / 0.952, 0.048",
        "4     ignore         hungry       crying       0            0.000, 1.000",
    ]


@pytest.mark.slow
@pytest.mark.parametrize("name", GAMES)
def test_every_game_ends_with_its_result_and_the_next_keys(name: str, tmp_path: Path) -> None:
    turns = GAMES[name].turns
    limit = ["--turns", str(turns)] if turns else []
    with Terminal(name, "--seed", str(SEED), *limit, "-o", "g.dmt", folder=tmp_path) as terminal:
        terminal.ready()
        for sequence in iter_key_sequences(name):
            terminal.press(sequence).calm(0.03)
        terminal.until(" over: ").until("verdict: ")
        for key in ("Enter look back", "PgUp log", "N new", "R restart", "q quit"):
            terminal.until(key)
        assert "page 1 of" in terminal.press(PAGE_UP).calm().text or "over: " in terminal.text
        terminal.press(ESCAPE, lambda: "over: " in terminal.text and "page 1" not in terminal.text)
        terminal.press(ENTER, " ← → turns  ")
        assert terminal.press("q").ended() == 0
        assert "replay: dmplay replay g.dmt" in terminal.text


@pytest.mark.slow
def test_enter_during_the_review_of_a_hunt_looks_back(tmp_path: Path) -> None:
    words = ("predator-prey", "--seed", "7", "--turns", "50", "-o", "g.dmt")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press("l" * 49).until("turn 49/50")
        terminal.press("l" + ENTER)
        terminal.until("turn 50: chose e")
        terminal.press(ESCAPE, "choices: best action")
        assert terminal.press("q").ended() == 0


@pytest.mark.parametrize(
    ("keys", "is_guided"), [(["tab"], False), (["l", "backspace"], False), (["tab"], True)]
)
def test_the_first_help_of_a_game_says_once_that_it_costs_the_medal(
    keys: list[str], is_guided: bool, tmp_path: Path
) -> None:
    request = GameRequest("hexworld", seed=7, is_guided=is_guided, record_path=tmp_path / "g.dmt")
    screen = PlayScreen(GameController(start_new_game(request)), BASE_TERMINAL)
    recorder = FrameRecorder()
    recorder.columns, recorder.rows = 80, 24
    texts = list[bool]()
    for key in [*keys, "escape", *keys]:
        handle_key(screen, key)
        screen.paint(recorder)
        texts.append("no medal" in recorder.frame.plain)
    expected = [False] * len(texts)
    expected[len(keys) - 1] = not is_guided
    assert texts == expected


def test_the_bars_of_eight_turns_fit_beside_a_shorter_caption(tmp_path: Path) -> None:
    request = GameRequest("rock-paper-scissors", seed=7, turns=8, record_path=tmp_path / "g.dmt")
    screen = PlayScreen(GameController(start_new_game(request)), BASE_TERMINAL)
    _press_keys(screen, "8*r")
    handle_key(screen, "X")
    (row,) = (row for row in draw(screen, (80, 24)) if "value lost" in row)
    assert "…" not in row


def test_quitting_waits_for_the_medal_but_not_for_the_rest_of_the_review() -> None:
    comparison = TaskInfo("comparing", is_after_game=True, delays_quit=True)
    assert classify_busy_key("q", comparison, "h") is BusyKeyAction.RUN_LATER
    review = TaskInfo("reviewing your actions", is_after_game=True)
    assert classify_busy_key("q", review, "h") is BusyKeyAction.CANCEL_THEN_RUN


def test_a_finished_game_is_recorded_before_its_player_leaves_the_screen(tmp_path: Path) -> None:
    """The player may still undo the last turn, so that the file has no end."""
    records = list[tuple[str, str]]()

    def record(recorder: Recorder, medal: str) -> None:
        records.append((recorder.content_with_end.rstrip().rpartition("\n")[2][:4], medal))

    request = GameRequest("hexworld", seed=SEED, record_path=tmp_path / "game.dmt")
    controller = GameController(start_new_game(request), on_game_end=record)
    screen = PlayScreen(controller, BASE_TERMINAL)
    _press_keys(screen, "l b n n")
    assert controller.game.recorder is not None
    assert controller.game.recorder.is_open
    assert records == [("end:", "bronze")]
