"""The commands of lessons: `dmplay learn`."""

import os
from glob import escape, glob
from pathlib import Path
from typing import Annotated, Any

import typer
from typer.core import TyperGroup

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.terminal.capabilities import TerminalOptions

# questions are dialogs without motion
QUESTION_OPTIONS = ("plain", "json", "color", "ascii", "theme", "width", "input")
LessonListJson = Annotated[bool, typer.Option("--json", help="print the list of lessons as JSON")]


class LearnGroup(TyperGroup):
    """The group of `dmplay learn`; without the name of a command, `lesson` is meant."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments, with `dmplay learn 8` as `dmplay learn lesson 8`."""
        if not args or (args[0] not in self.commands and args[0] not in {"-h", "--help"}):
            args = ["lesson", *args]
        return list(super().parse_args(ctx, args))


learn_app = typer.Typer(
    cls=LearnGroup,
    rich_markup_mode=None,
    add_completion=False,
    help="""Learn the book's ideas in short lessons.

A lesson takes at most ten minutes. You predict what will happen, play, and compare.
After a wrong answer, dmplay shows with numbers why it is wrong, and you try again.
'dmplay guide lessons' explains how to write your own lessons.

\b
  dmplay learn first            play a first game that explains itself
  dmplay learn                  list the lessons and your progress
  dmplay learn 8                open lesson 8
  dmplay learn ./week3/         list the lessons in a folder
  dmplay learn ./week3/ 2       open lesson 2 of the folder
  dmplay learn --json           print your progress as JSON, for a course page
  dmplay learn puzzle           solve the puzzle of the day
  dmplay learn puzzle hexworld  solve a puzzle of one problem
  dmplay learn from game.dmt    find better actions for your worst choices

\b
'dmplay learn 8' is short for 'dmplay learn lesson 8'.""",
)


def _complete_lessons(incomplete: str) -> list[str]:
    """Return the lessons, or the folders and files of lessons, that complete a word."""
    if os.sep in incomplete:
        paths = sorted(glob(f"{escape(incomplete)}*"))
        folders = [f"{path}{os.sep}" for path in paths if os.path.isdir(path)]
        return [*folders, *(path for path in paths if path.endswith(".toml"))]
    from dmplay.tutor.lesson_list import list_builtin_words

    return [word for word in list_builtin_words() if word.startswith(incomplete)]


def _complete_problems_with_puzzles(incomplete: str) -> list[str]:
    """Return the built-in problems that have puzzles, for completion."""
    from dmplay.tutor.puzzles import list_puzzle_problems

    return [name for name in list_puzzle_problems() if name.startswith(incomplete)]


@learn_app.command("lesson")
@options.with_terminal_options(json=LessonListJson, input=options.AnswerInput)
def lesson(
    words: Annotated[
        list[str],
        options.argument(
            "[FOLDER] [LESSON]", "folder of lessons; number or name of a lesson", _complete_lessons
        ),
    ] = [],  # noqa: B006 - typer reads it once
    restart: Annotated[
        bool, typer.Option("--restart", help="begin at the first step again")
    ] = False,
    trust: Annotated[
        bool,
        typer.Option(
            "--trust", help="run user code: import the problems and agents that the lesson names"
        ),
    ] = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Open a lesson, or list the lessons and your progress.

    A lesson begins at its first step that you have not done. You can leave it at any
    time with 'quit'.

    \b
      dmplay learn lesson 8
      dmplay learn lesson ./week3/ 2
      dmplay learn lesson ./week3/01-cries.toml
    """
    from dmplay.game.command_line_results import LearnCommand
    from dmplay.output.lesson_report import report_lessons

    source, name = _split_lesson_arguments(words)
    if not name:
        return report_lessons(source, as_json=terminal_options.json)
    if terminal_options.json:
        raise BadParameter("--json: prints the list of lessons; leave out the lesson")
    return LearnCommand(name, terminal_options, source, restart, trust)


@learn_app.command("puzzle")
@options.with_terminal_options(*QUESTION_OPTIONS, input=options.AnswerInput)
def puzzle(
    code: Annotated[
        str,
        options.argument(
            "[PROBLEM[:NUMBER]]",
            "problem, or one of its puzzles, such as catch:7 (default: puzzle of the day)",
            _complete_problems_with_puzzles,
        ),
    ] = "",
    solution: Annotated[
        bool, typer.Option("--solution", help="with --json: print the solution too")
    ] = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Solve a puzzle: a position where a simple rule chooses badly.

    You choose the best action. All values are exact expected returns, from the position
    to the end of the game. After a wrong answer, the puzzle comes back after 1, 3 and 7
    days. The puzzle of the day changes at midnight UTC and is the same for all players.

    \b
      dmplay learn puzzle
      dmplay learn puzzle crying-baby
      printf 'nw\\n' | dmplay learn puzzle hexworld:2
      dmplay learn puzzle machine-replacement:7 --json --solution
    """
    if terminal_options.json:
        from dmplay.output.exercise_report import report_puzzle

        return report_puzzle(code, with_solution=solution)
    if solution:
        raise BadParameter("--solution: expected --json too; in a dialog, type show")
    from dmplay.game.command_line_results import PuzzleCommand

    return PuzzleCommand(code, terminal_options)


@learn_app.command("from")
@options.with_terminal_options(*QUESTION_OPTIONS, input=options.AnswerInput)
def learn_from(
    paths: Annotated[
        list[Path],
        typer.Argument(metavar="[GAME]...", help="recorded games (default: the 50 newest saves)"),
    ] = [],  # noqa: B006 - typer reads it once
    trust: options.Trust = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Find better actions for the worst choices in recorded games.

    You choose again in at most five positions. The position of your worst choice comes
    first. This works only if the exact values of the game are known and the file
    verifies. After a wrong answer, the position comes back after 1, 3 and 7 days.

    \b
      dmplay learn from game.dmt
      dmplay learn from
      dmplay learn from game.dmt --json
    """
    if terminal_options.json:
        from dmplay.output.exercise_report import report_mistakes

        return report_mistakes(paths, trusted=trust)
    from dmplay.game.command_line_results import MistakesCommand

    return MistakesCommand(tuple(paths), terminal_options, trust)


def _split_lesson_arguments(words: list[str]) -> tuple[str, str]:
    """Return the folder and the lesson of the arguments, each '' if it is missing."""
    if len(words) > 2:
        raise BadParameter(f"got {words[2]!r}, expected at most a folder and a lesson")
    if not words:
        return "", ""
    first, *others = words
    names_path = os.sep in first or first.endswith(".toml") or first == os.curdir
    if not names_path and not (others and os.path.isdir(first)):
        if others:
            raise BadParameter(f"got {first!r}, expected a folder of lessons")
        return "", first
    if os.path.isfile(first):
        return first, os.path.basename(os.path.splitext(first)[0])
    if not os.path.isdir(first):
        raise BadParameter(f"{first}: no such folder or lesson")
    return first, "".join(others)
