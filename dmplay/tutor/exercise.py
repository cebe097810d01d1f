"""An exercise: a question for the best action, the tries, and the replies to each answer."""

from dataclasses import dataclass

from dmplay.errors import BadParameter
from dmplay.tutor.action_question import ActionQuestion
from dmplay.tutor.lesson_run import TutorReply
from dmplay.tutor.progress import current_day
from dmplay.tutor.spaced_repetition import save_first_answer


@dataclass(frozen=True)
class Exercise:
    """A question for the best action, with what the player learns from it."""

    key: str  # in the file of progress
    title: str
    question: ActionQuestion
    introduction: tuple[str, ...]  # sentences between the rules of the game and the board
    learned: tuple[str, ...]  # sentences after the solution


class ExerciseRun:
    """A run through an exercise, without input and output; it saves the progress."""

    def __init__(self, exercise: Exercise) -> None:
        self.exercise = exercise
        self.wrong_actions = list[int]()

    @property
    def wrong_count(self) -> int:
        """The number of wrong tries."""
        return len(self.wrong_actions)

    def check_answer(self, text: str) -> TutorReply:
        """Return the reply to a typed answer; raise UnknownName if it is not a legal action."""
        question = self.exercise.question
        action = question.parse_answer(text)
        check = question.check_answer(action)
        if check.is_right:
            self._save_first_try(is_right=True)
            others = [question.describe_right_actions()] * (len(question.right_actions) > 1)
            lines = ("right.", *others, *self.describe_solution())
            return TutorReply(lines, finishes_step=True)
        self._save_first_try(is_right=False)
        self.wrong_actions.append(action)
        return TutorReply(
            (
                f"not yet. {check.reason}:",
                *question.explain_action(action),
                "Try again, or type show for the solution.",
            )
        )

    def show_solution(self) -> TutorReply:
        """Return the solution; raise BadParameter before the first wrong try."""
        if not self.wrong_count:
            raise BadParameter("show: expected at least one try first")
        solution = self.exercise.question.describe_right_actions()
        return TutorReply((solution, *self.describe_solution()), finishes_step=True)

    def describe_solution(self) -> tuple[str, ...]:
        """Return the values and outcomes that explain the solution, and what is learned."""
        lines = self.exercise.question.describe_solution(self.wrong_actions)
        return (*lines, *self.exercise.learned)

    def _save_first_try(self, *, is_right: bool) -> None:
        """Save the result of the first try; later ones do not count."""
        if not self.wrong_count:
            save_first_answer(self.exercise.key, is_right=is_right, today=current_day())
