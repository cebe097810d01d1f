"""The course of a lesson: its current step, the tries, and the replies to the answers."""

from collections.abc import Collection, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace

import numpy as np

from dmplay.core.session import Session
from dmplay.core.text import escape_newlines
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, DmplayError
from dmplay.tutor import answers, game_checks, progress
from dmplay.tutor.lesson import GameTask, LessonStep, PositionText, Prediction, TutorLesson
from dmplay.tutor.positions import PositionInGame, open_position
from dmplay.tutor.progress import PASSED, REVEALED, StepRecord
from dmplay.tutor.truth import Truth

TRIES_BEFORE_ANSWER = 3  # wrong tries after which the answer may be shown


@dataclass(frozen=True)
class TutorReply:
    """The reply to an answer: one sentence a line, and whether the step is finished."""

    lines: tuple[str, ...]
    finishes_step: bool = False


class LessonRun:
    """A run through a lesson, without input and output; it saves the progress."""

    def __init__(
        self,
        lesson: TutorLesson,
        first_step: int = 0,
        finished_steps: Collection[int] = (),
        *,
        trusted: bool = False,
    ) -> None:
        self.lesson = lesson
        self.trusted = trusted
        self.index = first_step
        self.finished_steps = {*finished_steps}  # indices of the steps that need not be done
        self._start_step()

    def _start_step(self) -> None:
        """Forget the tries and the hint of the previous step."""
        self.wrong_count = 0
        self.is_hint_given = False
        self._cached_position: PositionInGame | None = None
        self._truth: Truth | None = None
        self._is_truth_known = False

    @property
    def is_over(self) -> bool:
        """True after the last step."""
        return self.index >= len(self.lesson.steps)

    @property
    def is_passed(self) -> bool:
        """True if all steps are finished."""
        return len(self.finished_steps) == len(self.lesson.steps)

    @property
    def step(self) -> LessonStep:
        """The current step."""
        return self.lesson.steps[self.index]

    @property
    def position(self) -> PositionInGame:
        """The game at the position of the current step, opened once."""
        if self._cached_position is None:
            self._cached_position = self._open_position(self.step.position)
        return self._cached_position

    def _open_position(self, position: PositionText) -> PositionInGame:
        """Return the game at a position."""
        with self._name_step_in_errors():
            return open_position(position, self.lesson.path.parent, trusted=self.trusted)

    @contextmanager
    def _name_step_in_errors(self) -> Iterator[None]:
        """Run the block; its errors, faults of the lesson, name the file and the step."""
        try:
            yield
        except DmplayError as error:
            path = escape_newlines(str(self.lesson.path))
            raise BadParameter(f"{path}: steps[{self.index + 1}]: {error}") from None

    @property
    def truth(self) -> Truth | None:
        """The truth that the player predicts in the current step, computed once.

        None for a game, and for a question with many right answers.
        """
        task = self.step.task
        if not self._is_truth_known and isinstance(task, Prediction):
            position = self.position
            with self._name_step_in_errors():
                self._truth = answers.compute_predicted_value(position, task)
            self._is_truth_known = True
        return self._truth

    @property
    def expected_answer(self) -> str:
        """The kind of answer that the current step expects, as text."""
        task = self.step.task
        if isinstance(task, GameTask):
            return task.goal
        return answers.describe_expected_answer(self.position, task, self.truth)

    def check_answer(self, text: str) -> TutorReply:
        """Return the reply to a typed answer; raise BadParameter if it cannot be read."""
        task = self.step.task
        assert isinstance(task, Prediction)
        return self._reply_to_try(answers.check_answer(self.position, task, self.truth, text))

    def check_game(self, session: Session) -> TutorReply:
        """Return the reply to a game that was played for the current step."""
        task = self.step.task
        assert isinstance(task, GameTask)
        position = replace(self.position, session=session)
        with self._name_step_in_errors():
            check = game_checks.check_game_conditions(position, task)
        if check.is_right and task.notes:  # They asked nothing, and said how the game ended.
            return self._finish_step(PASSED, (self.step.learned,))
        return self._reply_to_try(check)

    def is_game_of_step(self, session: Session) -> bool:
        """Return whether a session is the game of the current step: its draws and first turns."""
        expected, first_turn = self.position.session, self.position.first_turn
        return (
            type(session.problem) is type(expected.problem)
            and session.problem == expected.problem
            and session.turn_limit == expected.turn_limit
            and not session.reroll_counts
            and _get_seed_and_episode(session) == _get_seed_and_episode(expected)
            and len(session.turns) >= first_turn
            and all(
                np.array_equal(turn.actions, other.actions)
                for turn, other in zip(session.turns, expected.turns, strict=False)
            )
        )

    def _reply_to_try(self, check: answers.AnswerCheck) -> TutorReply:
        """Return the reply to a right or a wrong try; a right one finishes the step."""
        if check.is_right:
            right = f"right. {_to_sentence(check.reason)}".strip()
            return self._finish_step(PASSED, (right, self._describe_lesson_of_step()))
        self.wrong_count += 1
        lines = [f"not yet. {_to_sentence(check.reason)}".strip()]
        if not self.is_hint_given and self.wrong_count == 1:
            lines.append("Try again; hint gives you a hint, and ? lists the commands.")
        elif not self.is_hint_given:
            lines += self.give_hint().lines
        if self.can_show_answer:
            lines.append("show prints the answer, and the progress records that.")
        return TutorReply(tuple(lines))

    def give_hint(self) -> TutorReply:
        """Return the hint of the current step, and remember that it was given."""
        self.is_hint_given = True
        return TutorReply((f"hint: {self.step.hint}",))

    @property
    def can_show_answer(self) -> bool:
        """True after the hint and three wrong tries."""
        return self.is_hint_given and self.wrong_count >= TRIES_BEFORE_ANSWER

    def show_answer(self) -> TutorReply:
        """Return the answer and finish the step; raise BadParameter before the third wrong try."""
        if not self.can_show_answer:
            needed = f"the hint and {TRIES_BEFORE_ANSWER} wrong tries"
            raise BadParameter(
                f"show: expected {needed} first; wrong tries so far: {self.wrong_count}"
            )
        task = self.step.task
        text = (
            game_checks.describe_model_game(self.position)
            if isinstance(task, GameTask)
            else answers.describe_right_answer(self.position, task, self.truth)
        )
        sentence = f"answer: {text}." if text else "answer: many are right; see the hint."
        reason = _to_sentence(self.truth.comparison) if self.truth else ""
        lines = filter(None, (sentence, reason, self._describe_lesson_of_step()))
        return self._finish_step(REVEALED, tuple(lines))

    def skip_step(self) -> TutorReply:
        """Go on to the next step; the current one stays open."""
        self._go_to_open_step()
        return TutorReply(("skipped; the step stays open.",), finishes_step=True)

    def _finish_step(self, result: str, lines: tuple[str, ...]) -> TutorReply:
        """Save the result of the current step and go on to the next one."""
        tries = self.wrong_count + (result == PASSED)
        step_result = StepRecord(result, tries, int(self.is_hint_given))
        progress.save_step(self.lesson, self.index, step_result)
        self.finished_steps.add(self.index)
        self._go_to_open_step()
        return TutorReply(lines, finishes_step=True)

    def _go_to_open_step(self) -> None:
        """Make the next step that is not finished the current one."""
        self.index += 1
        while self.index in self.finished_steps:
            self.index += 1
        self._start_step()

    def _describe_lesson_of_step(self) -> str:
        """Return the sentence on what the current step teaches, and where the book explains it."""
        step = self.step
        return f"{step.learned} ({step.book})" if step.book else step.learned


def _get_seed_and_episode(session: Session) -> tuple[int, int] | None:
    """Return the seed and the episode of a session's uniforms; None if they are not seeded."""
    source = session.uniform_source
    return (source.seed, source.episode) if isinstance(source, SeededUniforms) else None


def _to_sentence(text: str) -> str:
    """Return a text with a capital letter and a full stop; '' stays empty."""
    return f"{text[:1].upper()}{text[1:]}." if text else ""
