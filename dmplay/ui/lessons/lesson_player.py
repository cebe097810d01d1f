"""The front end of lessons: steps as lines of text, and games on the screen or in lines."""

import sys
from collections.abc import Sequence
from contextlib import suppress
from shlex import quote
from typing import TextIO

from dmplay.core.text import escape_newlines, format_count
from dmplay.errors import BadParameter, DmplayError
from dmplay.game import player_records
from dmplay.game.command_line_results import CliInterpreter, LearnCommand
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.signals import exit_on_signals
from dmplay.transcript.format import NATURAL_END_REASONS
from dmplay.tutor.lesson import GameTask, Prediction, TutorLesson
from dmplay.tutor.lesson_list import find_lesson, load_lessons
from dmplay.tutor.lesson_run import LessonRun, TutorReply
from dmplay.tutor.positions import PositionInGame, make_game_request
from dmplay.tutor.progress import LessonProgress, find_next_lesson, load_all_progress, load_progress
from dmplay.ui.gallery.problem_entries import find_next_problem, list_problem_entries
from dmplay.ui.lessons.line_dialog import DialogLeft, LineDialog
from dmplay.ui.screen.full_screen import run_full_screen, show_game
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.plain_mode import SentenceReporter, play_by_lines

NOT_FINISHED_EXIT_CODE = 1  # a script that ends before the lesson is finished
ANSWER_HELP = (
    "type an answer, or: hint, show (the answer, after three tries), look (the board), "
    "skip (the next step), quit"
)
LEAVE_WORDS = ("quit", "q", "exit")
GAME_HELP = "or type: hint, show, skip, quit"


def play_lesson(
    terminal: Terminal, command: LearnCommand, cli_interpreter: CliInterpreter | None = None
) -> int:
    """Run a lesson with the front end that the terminal allows, and return the exit code.

    It begins with the first step that is not finished, or with the first one if all are. After
    a finished lesson, the player may go on to the next one.
    """
    lesson_set = load_lessons(command.source, trusted=command.trusted)
    lesson: TutorLesson | None = find_lesson(lesson_set, command.lesson)
    restart, code = command.restart, 0
    while lesson is not None:
        results = load_progress(lesson)
        if restart or results.is_finished:
            results = LessonProgress((None,) * len(lesson.steps))
        finished = [index for index, step in enumerate(results.steps) if step]
        run = LessonRun(lesson, results.first_open_step, finished, trusted=command.trusted)
        player = LessonPlayer(run, terminal, sys.stdin, lesson_set.lessons, command.source)
        player.cli_interpreter = cli_interpreter
        code, lesson, restart = player.play(), player.next_lesson, False
    return code


def format_watch_command(name: str, position: PositionInGame) -> str:
    """Return a line with the command that shows an algorithm on the problem of a position."""
    return f"to watch: dmplay watch {name} {quote(position.problem_name)}"


class LessonReporter(SentenceReporter):
    """A reporter of a lesson's games: no introduction, and no verdict at the end."""

    def report_start(self, game: Game) -> None:
        """Print the situation."""
        print(*game.picture_rows(), game.narrator.describe_situation(game.snapshot()), sep="\n")


class LessonPlayer(LineDialog):
    """A player of one lesson: it prints the steps, reads answers and runs the games.

    Its games do not count as records, because their random numbers are always the same, except
    those with notes, whose verdict speaks of records.
    """

    def __init__(
        self,
        run: LessonRun,
        terminal: Terminal,
        stdin: TextIO,
        lessons: Sequence[TutorLesson],
        source: str,
    ) -> None:
        super().__init__(terminal, stdin)
        self._controller = GameController()
        self._run = run
        self._lessons, self._source = lessons, source  # the list of this lesson
        self.next_lesson: TutorLesson | None = None  # the lesson that the player goes on to
        # starts a game from a turn of a game with notes, which is a usual game
        self.cli_interpreter: CliInterpreter | None = None

    def play(self) -> int:
        """Run the lesson from its current step, and return the exit code."""
        lesson = self._run.lesson
        minutes = format_count(lesson.minutes, "minute")
        label = lesson.title if lesson.label == lesson.title else f"{lesson.label}: {lesson.title}"
        self._print_heading(f"{label} (about {minutes})")
        try:
            with exit_on_signals():
                while not self._run.is_over:
                    self._play_step()
        except DialogLeft:
            pass
        finally:
            self._controller.end_game()
        return self._report_end()

    def _report_end(self) -> int:
        """Print whether the lesson is finished and how it goes on; return the exit code."""
        run, lesson = self._run, self._run.lesson
        steps = format_count(len(lesson.steps), "step")
        if run.is_passed:
            all_steps = f": all {steps} done" if len(lesson.steps) > 1 else ""
            self._print_lines(f"{lesson.label} is finished{all_steps}.")
            self._offer_next_lesson()
            return 0
        path = escape_newlines(quote(str(lesson.path)))
        word = str(lesson.number or lesson.name) if lesson.is_builtin else path
        done = f"{len(run.finished_steps)} of {steps} done"
        if load_progress(lesson).is_finished:  # in an earlier run
            done += " this time"
            text = f"{done}. It was finished before: dmplay learn {word} starts at step 1."
        else:
            text = f"{done}. dmplay learn {word} continues."
        self._print_lines(f"{lesson.label} is not finished: {text}")
        is_script = not self._terminal.is_interactive and self._stdin.line_count > 0
        return NOT_FINISHED_EXIT_CODE if is_script else 0

    def _play_step(self) -> None:
        """Print the current step and run it until it is finished or skipped."""
        run, step, finished_count = self._run, self._run.step, len(self._run.finished_steps)
        number = f"step {run.index + 1} of {len(run.lesson.steps)}"
        self._print_lines("")
        if isinstance(step.task, Prediction) and step.task.shows_board:
            self._print_board(self._run.position)
        if not (self._terminal.full_screen and isinstance(step.task, GameTask) and step.task.notes):
            self._print_heading(f"{number}.")  # The notes say what to do.
            self._print_paragraph(step.text)
        if isinstance(step.task, GameTask):
            self._play_games(step.task)
        else:
            position, index = run.position, run.index
            self._read_answers(step.task)
            is_offered = step.task.watch and not step.task.watch_first
            if is_offered and index in run.finished_steps:
                self._offer_algorithm(step.task.watch, position)
                return
        # The next board would push the reply off the screen; a game waits for Enter anyway.
        is_board_next = not run.is_over and isinstance(run.step.task, Prediction)
        if (
            self._terminal.full_screen
            and is_board_next
            and len(run.finished_steps) > finished_count
        ):
            self._read_choice("Enter goes on> ")

    def _offer_algorithm(self, name: str, position: PositionInGame) -> None:
        """Let the player watch an algorithm on the position, or print the command for it."""
        if not self._terminal.full_screen:
            self._print_lines(format_watch_command(name, position))
        elif self._read_choice(f"w watches {name}, Enter goes on> ", "w"):
            self._show_algorithm(name, position)

    def _read_choice(self, prompt: str, choice: str = "") -> bool:
        """Return whether the player types the choice instead of Enter alone."""
        expected = " or ".join(filter(None, (choice, "Enter")))
        while line := self._read_line(prompt):
            if line in LEAVE_WORDS:
                raise DialogLeft
            if line == choice:
                return True
            self._print_lines(f"error: got {line!r}, expected {expected}; the step is done")
        return False

    def _offer_next_lesson(self) -> None:
        """Name the next lesson that is not finished; on a terminal, Enter opens it.

        After the first game it is only named.
        """
        numbers = [0, *(lesson.number for lesson in self._lessons)]  # 0 of the first game
        position = numbers.index(self._run.lesson.number)
        lessons = [*self._lessons[position:], *self._lessons[:position]]
        following = find_next_lesson(lessons, load_all_progress(lessons))
        if following is None:
            return
        words = " ".join(filter(None, ("dmplay learn", self._source, str(following.number))))
        if not self._run.lesson.number:
            problem = find_next_problem(
                list_problem_entries(), self._run.lesson.steps[-1].position.problem
            )
            words = f"dmplay {problem}, or the first lesson: {words}"
        self._print_lines(f"next: {escape_newlines(words)} ({following.title})")
        if self._terminal.full_screen and self._run.lesson.number:  # not a beginner's first game
            with suppress(DialogLeft), exit_on_signals():
                self._read_choice(f"Enter opens lesson {following.number}; q and Enter leave> ")
                self.next_lesson = following

    def _show_algorithm(self, name: str, position: PositionInGame) -> None:
        """Show an algorithm on a position, step by step on the full screen."""
        from dmplay.algorithms.registry import find_algorithm  # imported only if it is watched
        from dmplay.algorithms.step import WatchRequest
        from dmplay.game.watching import WatchedSteps
        from dmplay.ui.watch.step_viewer import StepViewer

        request = WatchRequest(position.problem, position.seat, position.session)
        watched = WatchedSteps(find_algorithm(name), request, position.problem_name)
        code = run_full_screen(StepViewer(watched, self._terminal))
        if code:
            raise SystemExit(code)

    def _read_answers(self, task: Prediction) -> None:
        """Read answers until the step is finished or skipped."""
        self._print_lines(f"type {self._run.expected_answer}.")
        if task.watch_first and self._terminal.full_screen:
            self._print_lines(f"watch draws {task.watch} step by step; q comes back here.")
        elif task.watch_first:
            self._print_lines(format_watch_command(task.watch, self._run.position))
        finishes_step = False
        while not finishes_step:
            line = self._read_line("answer> ")
            try:
                finishes_step = self._print_reply(self._reply_to_line(line))
            except DmplayError as error:
                self._report_error(error)

    def _reply_to_line(self, line: str) -> TutorReply:
        """Return the reply to a typed line: a command of the lesson or an answer."""
        match line:
            case "" | "help" | "?":
                return TutorReply((ANSWER_HELP,))
            case "look":
                return self._show_question()
            case "watch":
                return self._watch_before_answer()
        return self._reply_to_command(line) or self._run.check_answer(line)

    def _watch_before_answer(self) -> TutorReply:
        """Show the algorithm of the question, or print the command for it."""
        task = self._run.step.task
        if not isinstance(task, Prediction) or not task.watch_first:
            raise BadParameter("watch: this question has no picture to watch before the answer")
        if not self._terminal.full_screen:
            return TutorReply((format_watch_command(task.watch, self._run.position),))
        self._show_algorithm(task.watch, self._run.position)
        self._print_paragraph(self._run.step.text)
        return TutorReply(())

    def _show_question(self) -> TutorReply:
        """Print the board of the question again; without one, its text.

        A question about another state or history than that of the position has no board.
        """
        step = self._run.step
        if isinstance(step.task, Prediction) and step.task.shows_board:
            self._print_board(self._run.position)
            return TutorReply(())
        self._print_lines("this question has no board.")
        self._print_paragraph(step.text)
        return TutorReply(())

    def _reply_to_command(self, line: str) -> TutorReply | None:
        """Return the reply to a command that every step has; None for any other line."""
        match line:
            case "hint":
                return self._run.give_hint()
            case "show":
                return self._run.show_answer()
            case "skip":
                return self._run.skip_step()
            case _ if line in LEAVE_WORDS:
                raise DialogLeft
        return None

    def _play_games(self, task: GameTask) -> None:
        """Play the game of the step until it is passed, shown or skipped.

        A game with notes begins at once, as they say what to do.
        """
        asks_first = self._terminal.full_screen and not task.notes
        if asks_first and not self._choose_next_game("start the game"):
            return
        while not self._play_game(task) and self._choose_next_game("play again"):
            pass

    def _choose_next_game(self, purpose: str) -> bool:
        """Read commands until the player starts a game; return False if the step is over.

        `purpose` completes the sentence "press Enter to ...".
        """
        prompt, help_text = f"Enter to {purpose}> ", f"press Enter to {purpose}, {GAME_HELP}"
        while True:
            line = self._read_line(prompt)
            try:
                reply = self._reply_to_command(line)
                if reply is None and line in {"", "again"}:
                    return True
                if reply is None and line not in {"help", "?"}:
                    raise BadParameter(f"got {line!r}; {help_text}")
                if self._print_reply(reply or TutorReply((help_text,))):
                    return False
            except DmplayError as error:
                self._report_error(error)

    def _play_game(self, task: GameTask) -> bool:
        """Play one game and print what the lesson says about it; return whether it is passed."""
        run, step = self._run, self._run.step
        folder = run.lesson.path.parent
        request = make_game_request(step.position, folder, task, trusted=run.trusted)
        game = start_new_game(request)
        for action in step.position.after:
            game.choose(game.problem.parse_action(game.viewing_seat, action))
        if task.notes:
            self._controller = GameController(
                cli_interpreter=self.cli_interpreter,
                on_game_end=player_records.record_finished_game,
            )
        self._controller.set_game(game)
        self._show_game()
        session = self._controller.game.session
        if task.notes and game.session.end_reason in NATURAL_END_REASONS:
            session = game.session  # Another game may follow it on the screen.
        self._controller.end_game()
        if session.end_reason not in NATURAL_END_REASONS:
            self._print_lines("the game was left before its end.")
            if task.notes:  # for a beginner, who cannot know what else to type
                raise DialogLeft
            return False
        if not run.is_game_of_step(session):
            self._print_lines("this was another game than the one of this step.")
            return False
        return self._print_reply(run.check_game(session))

    def _show_game(self) -> None:
        """Run the current game with the front end that the terminal allows."""
        if self._terminal.full_screen:
            notes = task.notes if isinstance(task := self._run.step.task, GameTask) else ()
            code = show_game(PlayScreen(self._controller, self._terminal, notes=notes))
            if code:
                raise SystemExit(code)
            self._print_lines(self._controller.game.narrator.describe_result())
            return
        self._print_lines(
            f"goal: {self._run.expected_answer}. type help, look, legal, or an action."
        )
        earlier = self._stdin.line_count
        play_by_lines(
            self._controller,
            self._terminal,
            self._stdin,  # type: ignore[arg-type] # the methods that it uses
            LessonReporter(self._terminal),
            earlier,
        )
