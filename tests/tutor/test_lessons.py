"""Tests of the built-in lessons: right and wrong answers to each, and their texts."""

import re
from pathlib import Path

import pytest

from dmplay.tutor.game_checks import check_game
from dmplay.tutor.lesson import GameTask, TutorLesson
from dmplay.tutor.lesson_list import load_builtin_lessons
from dmplay.tutor.lesson_run import LessonRun, TutorReply
from dmplay.tutor.progress import PASSED, load_progress
from tests.tutor.lesson_scripts import RIGHT_ANSWERS, WRONG_ANSWERS, WrongAnswer, list_lines

LESSONS = {lesson.name: lesson for lesson in load_builtin_lessons()}
WRONG_CASES = [(name, wrong) for name, answers in WRONG_ANSWERS.items() for wrong in answers]


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def give_answer(run: LessonRun, answer: str) -> TutorReply:
    """Answer the current step: type a line, or play its game."""
    if not isinstance(run.step.task, GameTask):
        return run.check_answer(answer)
    position = run.position
    session, seat = position.session, position.seat
    for action in list_lines(answer):
        if session.over:
            break
        mask = session.legal_actions_mask(seat)
        choice = position.problem.parse_action(seat, action)
        if mask is None or mask[int(choice)]:
            actions: list[float | None] = [None] * len(position.problem.agents)
            actions[seat] = choice
            session.advance(actions)
    return run.check_game(session)


def test_the_lessons_of_the_plan_are_there() -> None:
    assert [lesson.number for lesson in LESSONS.values()] == [*range(1, 8), *range(9, 19)]
    assert {*LESSONS} == {*RIGHT_ANSWERS} == {*WRONG_ANSWERS}


@pytest.mark.parametrize("name", LESSONS)
def test_right_answers_pass_each_step_at_the_first_try(name: str) -> None:
    lesson = LESSONS[name]
    run = LessonRun(lesson)
    for answer in RIGHT_ANSWERS[name]:
        step = run.step
        reply = give_answer(run, answer)
        assert reply.finishes_step, reply.lines
        assert reply.lines[-1].startswith(step.learned)
    assert run.is_over
    assert [step and (step.result, step.tries) for step in load_progress(lesson).steps] == [
        (PASSED, 1)
    ] * len(lesson.steps)


@pytest.mark.parametrize(("name", "wrong"), WRONG_CASES)
def test_a_wrong_answer_gets_its_reason_in_numbers(name: str, wrong: WrongAnswer) -> None:
    run = LessonRun(LESSONS[name], wrong.step - 1)
    reply = give_answer(run, wrong.answer)
    assert not reply.finishes_step
    assert reply.lines[0].startswith("not yet. ")
    assert wrong.reason.lower() in reply.lines[0].lower()
    assert reply.lines[1:] == ("Try again; hint gives you a hint.",)


@pytest.mark.parametrize(("name", "wrong"), WRONG_CASES)
def test_the_first_wrong_answer_never_reveals_the_right_one(name: str, wrong: WrongAnswer) -> None:
    run = LessonRun(LESSONS[name], wrong.step - 1)
    right_answer = RIGHT_ANSWERS[name][wrong.step - 1]
    if right_answer != "0":  # the belief before the cry is 0 as well
        reply = give_answer(run, wrong.answer)
        assert right_answer not in re.split(r"[,;]? |[.]$", " ".join(reply.lines))


@pytest.mark.parametrize("name", LESSONS)
def test_three_kinds_of_wrong_answers_are_tested(name: str) -> None:
    assert len({wrong.reason for wrong in WRONG_ANSWERS[name]}) == 3


@pytest.mark.parametrize("lesson", LESSONS.values(), ids=LESSONS)
def test_a_lesson_is_short(lesson: TutorLesson) -> None:
    assert lesson.minutes <= 10
    assert 3 <= len(lesson.steps) <= 6
    for step in lesson.steps:
        assert 1 <= len(step.text) <= 4
        assert all(len(row) <= 80 for row in step.text)
        assert len(step.hint) <= 160
        assert len(step.learned) <= 160
        assert step.book


@pytest.mark.parametrize("lesson", LESSONS.values(), ids=LESSONS)
def test_each_sentence_of_a_lesson_is_short(lesson: TutorLesson) -> None:
    for step in lesson.steps:
        text = " ".join([*step.text, step.hint, step.learned])
        sentences = text.replace("?", ".").replace(":", ".").replace(";", ".").split(". ")
        assert max(len(sentence.split()) for sentence in sentences) <= 25


@pytest.mark.parametrize("lesson", LESSONS.values(), ids=LESSONS)
def test_an_unplayed_game_passes_no_check(lesson: TutorLesson) -> None:
    for index, step in enumerate(lesson.steps):
        if isinstance(step.task, GameTask):
            position = LessonRun(lesson, index).position
            position.session.end("quit")
            assert not check_game(position, step.task).is_right


def test_the_answer_is_shown_only_after_the_hint_and_three_wrong_tries() -> None:
    run = LessonRun(LESSONS["greedy-is-wrong"])
    for number in range(3):
        with pytest.raises(ValueError, match=f"wrong tries so far: {number}"):
            run.show_answer()
        reply = run.check_answer("w")
    assert reply.lines[-1] == "show prints the answer, and the progress records that."
    assert run.show_answer().lines[0] == "answer: nw."
    (step, *_) = load_progress(run.lesson).steps
    assert step == ("revealed", 3, 1)


def test_the_second_wrong_try_gives_the_hint() -> None:
    run = LessonRun(LESSONS["discount"])
    run.check_answer("(4,0) (5,0) (2,0) (0,0)")
    reply = run.check_answer("(4,0) (5,0) (2,0) (0,0)")
    assert reply.lines[1] == f"hint: {run.step.hint}"


def test_a_game_with_other_draws_or_undone_first_turns_is_not_the_game_of_the_step() -> None:
    run = LessonRun(LESSONS["first-walk"], 2)  # its position is after two turns
    session = run.position.session
    assert run.is_game_of_step(session)
    changed = session.copy_at_start()
    changed.advance([1])
    changed.advance([0])
    assert not run.is_game_of_step(changed)
    assert not run.is_game_of_step(LessonRun(LESSONS["discount"]).position.session)
    rerolled = session.copy_at_start()
    rerolled.append_turns(session.turns)
    rerolled.reroll()
    assert not run.is_game_of_step(rerolled)
