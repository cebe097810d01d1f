"""Tests of the front end of lessons: scripts, the command line, and the terminal."""

import json
from pathlib import Path

import pytest

from dmplay.tutor.lesson_list import load_builtin_lessons
from tests.support.programs import run_dmplay
from tests.support.terminals import Terminal
from tests.tutor.lesson_scripts import RIGHT_ANSWERS, list_lines

NUMBERS = {lesson.name: lesson.number for lesson in load_builtin_lessons()}
LESSON = """\
title = "Cries"
[position]
problem = "crying-baby"
turns = 2
[[steps]]
text = "Play two turns."
hint = "Feed."
learned = "Good."
[steps.play]
goal = "two turns"
turns_at_least = 2
"""


def make_script(name: str) -> str:
    """Return the script of a lesson with its right answers, one a line."""
    return "\n".join(line for answer in RIGHT_ANSWERS[name] for line in list_lines(answer)) + "\n"


@pytest.mark.slow
@pytest.mark.parametrize("name", NUMBERS)
def test_each_lesson_passes_as_a_script(name: str, tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", str(NUMBERS[name]), stdin=make_script(name))
    assert (result.returncode, result.stderr) == (0, "")
    assert "not yet" not in result.stdout
    end = f"lesson {NUMBERS[name]} is finished: all {len(RIGHT_ANSWERS[name])} steps done.\nnext: "
    assert end in result.stdout


def test_a_wrong_game_is_judged_and_played_again(tmp_path: Path) -> None:
    right_game = [*["cooperate"] * 9, "defect"]
    script = "\n".join(["-27", *["defect"] * 10, "again", *right_game, "quit"])
    result = run_dmplay(tmp_path, "learn", "rounds-matter", stdin=script)
    assert "not yet. You scored -27; the goal is at least -9." in result.stdout
    assert "right. You scored -9; the goal is at least -9." in result.stdout
    assert result.returncode == 1


def test_a_lesson_gives_no_verdict_on_a_wrong_game(tmp_path: Path) -> None:
    script = "0.15\nnw\n(1,1)\nw\nw\nw\nw\nw\n"
    result = run_dmplay(tmp_path, "learn", "4", stdin=script)
    assert "not yet." in result.stdout
    assert "worst:" not in result.stdout
    assert "more" not in result.stdout.partition("not yet.")[2]


def test_the_next_run_goes_on_with_the_first_open_step(tmp_path: Path) -> None:
    first = run_dmplay(tmp_path, "learn", "straight-to-the-exit", stdin="0.15\nquit\n")
    assert first.returncode == 1
    assert "1 of 4 steps done. dmplay learn 4 continues." in first.stdout
    second = run_dmplay(tmp_path, "learn", "4")
    assert "step 2 of 4." in second.stdout
    assert "step 1 of 4." in run_dmplay(tmp_path, "learn", "4", "--restart").stdout


def test_a_finished_lesson_that_is_left_starts_again(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "learn", "1", stdin=make_script("first-walk"))
    left = run_dmplay(tmp_path, "learn", "1", stdin="skip\nquit\n")
    assert left.stdout.endswith(
        "lesson 1 is not finished: 0 of 3 steps done this time. "
        "It was finished before: dmplay learn 1 starts at step 1.\n"
    )
    assert "step 1 of 3." in run_dmplay(tmp_path, "learn", "1").stdout


def test_a_question_about_another_state_has_no_board(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", "12", stdin="look\n")
    text = result.stdout.partition("this question has no board.")[2]
    assert "You are at height 52 with rate 0" in " ".join(text.splitlines())
    assert "40" not in text.partition("answer>")[0]  # the seconds at the start of the game


def test_the_list_shows_the_progress_and_the_next_lesson(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "learn", "1", stdin=make_script("first-walk"))
    rows = run_dmplay(tmp_path, "learn").stdout.splitlines()
    assert rows[1].split() == ["1", "First", "walk", "MDP", "3/3", "7", "done"]
    assert rows[2].split() == ["2", "Discount", "MDP", "0/3", "8"]
    assert rows[-1] == "1 of 17 done. next: dmplay learn 2 (Discount)"


def test_the_progress_is_printed_as_json(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "learn", "1", stdin="(8,2) 1\n" + make_script("first-walk"))
    data = json.loads(run_dmplay(tmp_path, "learn", "--json").stdout)
    assert data["next"] == 2
    first = data["lessons"][0]
    assert (first["number"], first["name"], first["done"]) == (1, "first-walk", True)
    assert first["steps"][0] == {"result": "passed", "tries": 2, "hints": 0}
    assert data["lessons"][1]["steps"] == [None, None, None]


def test_hint_skip_look_and_help_work_at_each_question(tmp_path: Path) -> None:
    script = "help\nhint\nlook\nskip\nskip\n"
    result = run_dmplay(tmp_path, "learn", "watch-v-converge", stdin=script)
    assert "type an answer, or: hint" in result.stdout
    assert "hint: All old V are 0" in result.stdout
    assert result.stdout.count("skipped; the step stays open.") == 2
    assert "step 3 of 4." in result.stdout


def test_an_answer_that_cannot_be_read_ends_a_script(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", "3", stdin="# a comment\nfive\n")
    expected = "error: line 2: got 'five', expected a number, such as 0.15\n"
    assert (result.returncode, result.stderr) == (2, expected)


def test_an_illegal_action_ends_a_script_with_the_number_of_its_line(tmp_path: Path) -> None:
    script = "(8,2) 0.7 (7,2) 0.15 (8,1) 0.15\ne\njump\n"
    result = run_dmplay(tmp_path, "learn", "1", stdin=script)
    assert result.returncode == 2
    assert result.stderr.startswith("error: line 3: unknown action 'jump'")


def test_a_game_that_was_left_is_no_try(tmp_path: Path) -> None:
    (tmp_path / "cries.toml").write_text(LESSON)
    result = run_dmplay(tmp_path, "learn", "./cries.toml", stdin="feed\nquit\n\nfeed\nfeed\n")
    assert "the game was left before its end." in result.stdout
    assert "right. The game lasted 2 turns; 2 are needed." in result.stdout
    assert result.returncode == 0


def test_a_game_without_hints_gives_none(tmp_path: Path) -> None:
    script = "0.907\n0\nfeed\nhint\n"
    result = run_dmplay(tmp_path, "learn", "bayes-at-the-cradle", stdin=script)
    assert result.stderr == "error: line 4: hint: this step of the lesson allows no hints\n"


def test_a_game_may_leave_the_belief_to_the_player(tmp_path: Path) -> None:
    lesson = LESSON.replace("turns_at_least", "belief = false\nturns_at_least")
    (tmp_path / "cries.toml").write_text(lesson)
    script = "belief\nfeed\nfeed\n"
    result = run_dmplay(tmp_path, "learn", "./cries.toml", stdin=script)
    assert "belief: not shown in this step of the lesson; keep it yourself." in result.stdout
    assert "hungry 0" not in result.stdout.partition("turn 0. state")[0]
    assert "right. The game lasted 2 turns" in result.stdout
    (tmp_path / "throws.toml").write_text(lesson.replace("crying-baby", "catch"))
    result = run_dmplay(tmp_path, "learn", "./throws.toml", stdin="10\n10\n")
    assert result.stderr == "error: belief: the board of catch always shows it\n"
    assert result.returncode == 2


def test_another_game_does_not_count(tmp_path: Path) -> None:
    (tmp_path / "cries.toml").write_text(LESSON)
    result = run_dmplay(tmp_path, "learn", "./cries.toml", stdin="new\nfeed\nfeed\n")
    assert "this was another game than the one of this step." in result.stdout


def test_a_folder_of_lessons_is_listed_and_opened(tmp_path: Path) -> None:
    (tmp_path / "week3").mkdir()
    (tmp_path / "week3" / "07-cries.toml").write_text(LESSON)
    listed = run_dmplay(tmp_path, "learn", "./week3/").stdout
    assert listed.endswith("0 of 1 done. next: dmplay learn ./week3/ 7 (Cries)\n")
    assert run_dmplay(tmp_path, "learn", "./week3/", "7", stdin="feed\nfeed\n").returncode == 0
    assert run_dmplay(tmp_path, "learn", "week3", "cries").stdout.startswith("lesson 7: Cries (")
    assert "1 of 1 done." in run_dmplay(tmp_path, "learn", "./week3").stdout
    advice = "error: unknown lesson 'week3'; ./week3 opens the folder of lessons\n"
    assert run_dmplay(tmp_path, "learn", "week3").stderr == advice


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("99",), "unknown lesson '99'; did you mean 9?"),
        (("frist-walk",), "unknown lesson 'frist-walk'; did you mean first-walk"),
        (("./week9/",), "./week9/: no such folder or lesson"),
        (("week9", "2"), "got 'week9', expected a folder of lessons"),
        (("1", "2", "3"), "got '3', expected at most a folder and a lesson"),
        (("1", "--json"), "--json: prints the list of lessons; leave out the lesson"),
    ],
)
def test_wrong_words_get_one_line(words: tuple[str, ...], message: str, tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "learn", *words)
    assert result.returncode == 2
    assert result.stderr.startswith("error: ")
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


@pytest.mark.slow
def test_a_game_is_played_on_the_full_screen(tmp_path: Path) -> None:
    with Terminal("learn", "first-walk", folder=tmp_path) as terminal:
        terminal.until("answer>")
        terminal.press("\x1b_Gi=31;OK\x1b\\(8,2) 0.7 (7,2) 0.15 (8,1) \x1b[?997;1n0.15\r")
        terminal.until("Enter to start the game>")
        terminal.press("0.5\r")
        terminal.until("error: got '0.5'; press Enter to start the game, or type: hint")
        terminal.press("\r")
        terminal.until("goal: leave by +10")
        for key in "llullnl":
            terminal.press(key)
        terminal.until("Enter back to the lesson")
        assert "expected at best" not in terminal.text
        terminal.press("\r")
        terminal.until("Enter goes on>")
        assert "step 3 of 3." not in terminal.text
        terminal.press("\r")
        terminal.until("step 3 of 3.")
        terminal.press("quit\r")
        terminal.until("2 of 3 steps done")


@pytest.mark.slow
def test_an_algorithm_is_watched_after_the_answer(tmp_path: Path) -> None:
    with Terminal("learn", "watch-v-converge", folder=tmp_path) as terminal:
        terminal.until("answer>")
        for number, answer in enumerate(("-0.3", "5.92", "6"), 2):
            terminal.press(f"{answer}\r")
            terminal.until("Enter goes on>")
            terminal.press("\r")
            terminal.until(f"step {number} of 4.")
        terminal.press("4.256\r")
        terminal.until("w watches value-iteration, Enter goes on>")
        terminal.press("hint\r")
        terminal.until("error: got 'hint', expected w or Enter")
        terminal.press("w\r")
        terminal.until("value-iteration on hexworld")
        terminal.press("q")
        terminal.until("lesson 3 is finished")
        terminal.until("Enter opens lesson 4; q and Enter leave>")
        terminal.press("4\r")
        terminal.until("error: got '4', expected Enter")
        terminal.press("\r")
        terminal.until("lesson 4: Straight to the exit")


@pytest.mark.slow
def test_an_algorithm_is_watched_before_the_answer(tmp_path: Path) -> None:
    with Terminal("learn", "alpha-vectors", folder=tmp_path) as terminal:
        terminal.until("watch draws alpha-vectors step by step")
        terminal.press("watch\r")
        terminal.until("1 turn: plans")
        terminal.press("q")
        terminal.until("What is plan A worth")
        terminal.press("-9\r")
        terminal.until("Enter goes on>")


def test_a_pipe_prints_the_command_of_an_algorithm_to_watch(tmp_path: Path) -> None:
    script = "watch\n-9\n0.506\n0.283\nwatch\n"
    result = run_dmplay(tmp_path, "learn", "alpha-vectors", stdin=script)
    assert result.stdout.count("to watch: dmplay watch alpha-vectors crying-baby") == 4
    expected = "error: line 5: watch: this question has no picture to watch before the answer\n"
    assert (result.returncode, result.stderr) == (2, expected)


@pytest.mark.slow
def test_a_wrong_line_on_a_terminal_is_asked_again(tmp_path: Path) -> None:
    with Terminal("learn", "3", folder=tmp_path) as terminal:
        terminal.until("answer>")
        terminal.press("five\r")
        terminal.until("error: got 'five', expected a number")
        terminal.press("0\r")
        terminal.until("not yet.")
        terminal.press("0\r0\rshow\r")
        terminal.until("answer: -0.3.")


@pytest.mark.slow
@pytest.mark.parametrize("size", [(50, 14), (80, 24), (200, 60)])
def test_the_lines_of_a_lesson_fit_the_terminal(size: tuple[int, int], tmp_path: Path) -> None:
    with Terminal("learn", "4", folder=tmp_path, size=size) as terminal:
        terminal.until("answer>")
        terminal.press("0.15\r")
        terminal.until("Enter goes on>")
        terminal.until("right.")
        terminal.press("\r")
        terminal.until("step 2 of 4.")
        terminal.press("w\r")
        terminal.until("Try again; hint gives you a hint")
        is_wrapped = "play best after it. The rule of thumb says west." in terminal.text
        assert is_wrapped == (size[0] == 50)  # as one paragraph
        assert "worth -10 and has" in terminal.text.replace("\n", " ")


@pytest.mark.slow
def test_the_text_of_a_step_is_one_paragraph_on_a_narrow_terminal(tmp_path: Path) -> None:
    with Terminal("learn", "8", folder=tmp_path, size=(50, 14)) as terminal:
        terminal.until("answer>")
        rows = [row.rstrip() for row in terminal.text.splitlines()]
        first = rows.index("A catcher has the skill 20, 40, 60 or 80, each")
        assert rows[first + 1] == "with probability 0.25. With these skills, a throw"
