"""Tests of mistakes: the choices of recorded games that lost most."""

import shutil
from datetime import date, timedelta
from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.playback import review
from dmplay.tutor.exercise import Exercise, ExerciseRun
from dmplay.tutor.mistakes import choose_mistakes, list_mistakes
from dmplay.tutor.puzzle_mining import describe_situation
from dmplay.tutor.spaced_repetition import save_first_answer
from tests.support.programs import run_dmplay

TODAY = date(2026, 11, 28)


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress and the saved games of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


def play(folder: Path, name: str, lines: str, *words: str) -> Path:
    """Play a game by typed lines, and return its transcript."""
    path = folder / f"{name}.dmt"
    run_dmplay(folder, name, *words, "-o", str(path), stdin=lines)
    return path


def play_walk(folder: Path) -> Path:
    """Walk west and east in hexworld for four turns, and return the transcript."""
    return play(folder, "hexworld", "e\ne\nw\nw\n", "--seed", "3", "--turns", "4")


def right_answer(exercise: Exercise) -> str:
    """Return the first of the right actions."""
    return exercise.question.right_actions[0]


def test_the_mistakes_are_those_of_the_review_worst_first(tmp_path: Path) -> None:
    path = play_walk(tmp_path)
    reviewed = sorted(review(path), key=lambda move: -(move.regret or 0.0))
    expected = [move for move in reviewed if move.regret]
    exercises = list_mistakes(path)
    assert [item.title for item in exercises] == [
        f"turn {move.turn} of {path.name}" for move in expected
    ]
    for exercise, move in zip(exercises, expected, strict=True):
        assert right_answer(exercise) in move.best
        assert exercise.question.labels[exercise.question.obvious_action or 0] == move.chosen


@pytest.mark.parametrize(
    ("name", "lines", "words"),
    [
        ("hexworld", "e\nw\n" * 10, ("--seed", "3", "--turns", "20")),
        ("crying-baby", "i\n" * 12, ("--seed", "5", "--turns", "12")),
        ("prisoners-dilemma", "d\n" * 10, ("--seat", "agent2=grim")),
    ],
)
def test_no_position_is_asked_twice(
    tmp_path: Path, name: str, lines: str, words: tuple[str, ...]
) -> None:
    exercises = list_mistakes(play(tmp_path, name, lines, *words))
    positions = [
        (describe_situation(exercise.question.position), exercise.question.best_action)
        for exercise in exercises
    ]
    assert exercises
    assert len({*positions}) == len(positions)


def test_a_mistake_shows_what_was_lost_and_what_happened(tmp_path: Path) -> None:
    exercise = list_mistakes(play_walk(tmp_path))[0]
    assert exercise.introduction == ()
    assert exercise.question.prompt().startswith("You have 2 turns left.")
    run = ExerciseRun(exercise)
    assert run.check_answer("w").lines[0] == (
        "not yet. w is worth -0.53, 0.359 less than the best action:"
    )
    reply = run.check_answer("e")
    assert reply.finishes_step
    assert reply.lines[-2:] == (
        "In the game, w was chosen here. It lost 0.359 (0.291 discounted).",
        "turn 3. chose W, moved W to (5,2). reward 0. score 0.",
    )


def test_a_hidden_state_stays_hidden(tmp_path: Path) -> None:
    path = play(tmp_path, "crying-baby", "i\n" * 6, "--seed", "5", "--turns", "6")
    exercises = list_mistakes(path)
    assert exercises
    for exercise in exercises:
        assert not exercise.question.shows_board
        run = ExerciseRun(exercise)
        reply = run.check_answer(right_answer(exercise))
        assert any("Your belief over the hidden states" in line for line in reply.lines)
        assert not any("hidden state:" in line for line in reply.lines)
        assert "reward" not in reply.lines[-1]


def test_games_against_a_known_agent_have_exact_mistakes(tmp_path: Path) -> None:
    path = play(tmp_path, "prisoners-dilemma", "d\n" * 10, "--seat", "agent2=grim")
    exercise = list_mistakes(path)[0]
    assert right_answer(exercise) == "cooperate"
    assert exercise.title.startswith("turn 1 of ")


def test_a_choice_that_counts_as_right_is_no_mistake(tmp_path: Path) -> None:
    players = "--seat", "agent2=level-k", "--turns", "2"
    path = play(tmp_path, "travelers-dilemma", "97\n2\n", *players)
    near, bad = review(path)
    assert 0 < (near.regret or 0.0) < 0.1 < (bad.regret or 0.0)
    assert [item.title for item in list_mistakes(path)] == [f"turn 2 of {path.name}"]


def test_a_missed_mistake_returns_and_a_learned_one_does_not(tmp_path: Path) -> None:
    path = play_walk(tmp_path)
    first, second = list_mistakes(path)
    save_first_answer(first.key, is_right=True, today=TODAY)
    save_first_answer(second.key, is_right=False, today=TODAY)
    tomorrow = choose_mistakes([path], TODAY + timedelta(1))
    assert [item.key for item in tomorrow] == [second.key]


def test_a_named_game_without_open_mistakes_is_asked_again(tmp_path: Path) -> None:
    path = play_walk(tmp_path)
    for exercise in list_mistakes(path):
        save_first_answer(exercise.key, is_right=True, today=TODAY)
    assert len(choose_mistakes([path], TODAY)) == 2


def test_all_saved_games_are_searched_and_due_mistakes_come_first(tmp_path: Path) -> None:
    games = tmp_path / "state" / "dmplay" / "games"
    games.mkdir(parents=True)
    walk = play_walk(tmp_path)
    for number in (1, 2):
        shutil.copy(walk, games / f"{number:06}-hexworld.dmt")
    (games / "000003-hexworld.dmt").write_text("not a transcript")
    exercises = choose_mistakes([], TODAY)
    assert ["000002" in item.key for item in exercises] == [True, True, False, False]
    save_first_answer(exercises[3].key, is_right=False, today=TODAY)
    assert choose_mistakes([], TODAY + timedelta(1))[0].key == exercises[3].key


def test_at_most_five_mistakes_are_asked(tmp_path: Path) -> None:
    walk = "sw\nsw\nse\nw\nw\nne\nnw\n" * 5
    path = play(tmp_path, "hexworld", walk, "--seed", "3", "--turns", "35")
    assert len(list_mistakes(path)) > 5
    assert len(choose_mistakes([path], TODAY)) == 5


def test_a_changed_transcript_is_refused(tmp_path: Path) -> None:
    path = play_walk(tmp_path)
    path.write_text(path.read_text().replace('{"agent": "w"}', '{"agent": "e"}', 1))
    with pytest.raises(BadParameter, match="does not verify; dmplay verify "):
        list_mistakes(path)


def test_a_game_without_exact_values_is_refused(tmp_path: Path) -> None:
    path = play(tmp_path, "mountain-car", "right\n" * 3, "--turns", "3")
    with pytest.raises(BadParameter, match="the exact values of this game are not known"):
        list_mistakes(path)


def test_a_game_without_people_is_refused(tmp_path: Path) -> None:
    path = play(tmp_path, "hexworld", "", "--agent", "optimal", "--seed", "3", "--turns", "4")
    with pytest.raises(BadParameter, match="no person plays in this game"):
        list_mistakes(path)
