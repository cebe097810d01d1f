"""The front end of puzzles and mistakes: a board, a question, and typed answers."""

import sys
from collections.abc import Sequence
from typing import TextIO

from dmplay.core.text import format_count
from dmplay.errors import DmplayError
from dmplay.game.command_line_results import MistakesCommand, PuzzleCommand
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.progress import ProgressBar
from dmplay.terminal.signals import exit_on_signals
from dmplay.tutor import mistakes, puzzles
from dmplay.tutor.action_question import RIGHT_LOSS_LIMIT
from dmplay.tutor.exercise import Exercise, ExerciseRun
from dmplay.tutor.lesson_run import TutorReply
from dmplay.tutor.progress import current_day
from dmplay.ui.lessons.line_dialog import DialogLeft, LineDialog

SMALL_MAP_MARK = "@"  # the mark of the player on small maps, such as those of puzzles
NOT_FINISHED_EXIT_CODE = 1  # a script that ends before every question is answered
QUESTION_HELP = (
    "type an action, or: show (the solution, after one try), look (the board), "
    f"skip (the next question), quit. "
    f"An action counts as right if it loses at most {RIGHT_LOSS_LIMIT}."
)


def play_puzzle(terminal: Terminal, command: PuzzleCommand) -> int:
    """Ask a puzzle, and return the exit code."""
    name, _ = puzzles.split_code(command.code)
    with ProgressBar("looking for positions in which a rule of thumb chooses badly"):
        exercise = puzzles.make_exercise(puzzles.choose_typed_puzzle(command.code, current_day()))
    dialog = QuestionDialog(terminal, sys.stdin)
    code = dialog.ask_all([exercise])
    if not code and name:
        dialog.print_lines(f"dmplay learn puzzle {name} gives another one.")
    return code


def play_mistakes(terminal: Terminal, command: MistakesCommand) -> int:
    """Ask for a better action than those that lost most, and return the exit code."""
    dialog = QuestionDialog(terminal, sys.stdin)
    with ProgressBar("looking for choices that lost much"):
        exercises = mistakes.choose_mistakes(command.paths, current_day(), trusted=command.trusted)
    if not exercises:
        where = " or ".join(map(str, command.paths)) or (
            f"the {mistakes.MAX_SEARCHED_GAMES} newest saved games"
        )
        reason = mistakes.NO_MISTAKES if command.paths else "nothing is new or due"
        dialog.print_lines(f"no mistake to learn from in {where}: {reason}.")
        return 0
    return dialog.ask_all(exercises)


class QuestionDialog(LineDialog):
    """A dialog that asks for the best action in one position after the other."""

    def __init__(self, terminal: Terminal, stdin: TextIO) -> None:
        super().__init__(terminal, stdin)
        self._printed_rules: list[str] = []  # the rules of the last game are not printed again

    def ask_all(self, exercises: Sequence[Exercise]) -> int:
        """Ask all questions, and return the exit code."""
        right_count = finished_count = 0
        try:
            with exit_on_signals():
                for number, exercise in enumerate(exercises, 1):
                    if number > 1:
                        self._print_lines("")
                    run = ExerciseRun(exercise)
                    count_text = f"{number} of {len(exercises)}. " if len(exercises) > 1 else ""
                    self._print_heading(f"{count_text}{exercise.title}.")
                    finished_count += self._ask_question(run)
                    right_count += not run.wrong_count
        except DialogLeft:
            pass
        if len(exercises) > 1:
            self._print_lines(
                f"{finished_count} of {format_count(len(exercises), 'question')} answered, "
                f"{right_count} at the first try."
                + " Those that you missed return tomorrow."
                * (right_count < finished_count)
            )
        is_unfinished_script = not self._terminal.is_interactive and bool(self._stdin.line_count)
        is_finished = finished_count == len(exercises)
        return NOT_FINISHED_EXIT_CODE if is_unfinished_script and not is_finished else 0

    def _ask_question(self, run: ExerciseRun) -> bool:
        """Ask one question until it is answered or skipped; return whether it is answered."""
        exercise = run.exercise
        question = exercise.question
        rules = question.describe_game()
        if rules != self._printed_rules:
            self._print_lines(*rules)
            self._printed_rules = rules
        self._print_lines(*exercise.introduction)
        self._print_exercise_board(exercise)
        self._print_lines(question.prompt(), f"type {question.expected_answer}; quit leaves.")
        while True:
            line = self._read_line("answer> ")
            if line == "skip":
                return False
            try:
                if self._print_reply(self._reply_to_line(run, line)):
                    return True
            except DmplayError as error:
                self._report_error(error)

    def _reply_to_line(self, run: ExerciseRun, line: str) -> TutorReply:
        """Return the reply to a typed line: a command or an answer."""
        match line:
            case "" | "help" | "?":
                return TutorReply((QUESTION_HELP,))
            case "look":
                self._print_lines(
                    *run.exercise.question.describe_game(), *run.exercise.introduction
                )
                self._print_exercise_board(run.exercise)
                return TutorReply(())
            case "show":
                return run.show_solution()
            case "quit" | "q" | "exit":
                raise DialogLeft
        return run.check_answer(line)

    def _print_exercise_board(self, exercise: Exercise) -> None:
        """Print the board, unless it shows a belief, which is part of the solution."""
        question = exercise.question
        if not question.shows_board:
            return
        is_drawn = self._print_board(question.game, question.describe_situation())
        if is_drawn and question.has_map:
            self._print_lines(f"On the map you are {SMALL_MAP_MARK}.")

    def print_lines(self, *lines: str) -> None:
        """Print lines as the dialog prints its own."""
        self._print_lines(*lines)
