"""The report of graded transcripts, as a table, CSV or JSON."""

from collections.abc import Sequence
from pathlib import Path
from textwrap import fill

from dmplay.core.text import escape_newlines, format_count, format_json_report, format_number
from dmplay.errors import BadParameter
from dmplay.evaluation.assignment import read_assignment
from dmplay.evaluation.grading import GRADING_LIMITS, Grade, GradingReport
from dmplay.evaluation.grading import grade_files as grades
from dmplay.evaluation.solutions.solution import Row
from dmplay.game import transcript_verification
from dmplay.game.command_line_results import Printout
from dmplay.output.tables import format_csv, format_name, format_table
from dmplay.terminal.progress import ProgressBar
from dmplay.terminal.signals import INTERRUPTED_EXIT_CODE

FAILURE_EXIT_CODE = 3  # if a file does not verify, as of `verify`
PARAGRAPH_COLUMNS = 80  # columns of a paragraph
DATA_KEYS = {
    "occupant": "who",
    "end_reason": "ending",
    "discounted_return": "return",
    "best_count": "best",
    "valued_count": "valued",
    "undone_turn_count": "undo",
    "reroll_count": "reroll",
    "hint_count": "hints",
    "remarks": "marks",
    "identical_files": "same",
    "other_attempts": "tries",
    "assignment_differences": "unlike",
}
LIST_COLUMNS = ("marks", "same", "tries", "unlike")  # fields that are lists of words


def report_grades(
    paths: Sequence[Path],
    assignment: Path | None = None,
    *,
    trusted: bool = False,
    output_format: str = "",
    motion: bool = True,
) -> Printout:
    """Grade transcripts in files and folders, and return a report.

    The games are compared with an assignment if one is given. A path without a transcript gets a
    row too, unless no path has one: then its BadParameter is raised. The exit code is
    INTERRUPTED_EXIT_CODE if some files were not graded, else FAILURE_EXIT_CODE if some failed.
    """
    files, failures = list[Path](), list[Grade]()
    for path in paths:
        try:
            files += transcript_verification.iter_transcript_files([path])
        except (BadParameter, OSError) as error:
            if len(paths) == 1:
                raise
            reason = getattr(error, "strerror", "") or str(error).removeprefix(f"{path}: ")
            failures.append(Grade(str(path), verified=False, fault=reason))
    required = read_assignment(assignment) if assignment else None
    with ProgressBar(
        f"grading {format_count(len(files), 'file')}", quiet=bool(output_format), motion=motion
    ) as bar:
        report = grades(files, required, trusted=trusted, progress=bar)
    report = report._replace(grades=(*report.grades, *failures))
    exit_code = 0 if all(grade.verified for grade in report.grades) else FAILURE_EXIT_CODE
    return Printout(
        format_grades(report, len(files), output_format),
        exit_code=exit_code if report.file_count == len(files) else INTERRUPTED_EXIT_CODE,
    )


def format_grades(grades: GradingReport, file_count: int, output_format: str = "") -> str:
    """Return the grades as a table with notes, or as JSON or CSV."""
    rows = [_make_data_row(grade) for grade in grades.grades]
    if output_format == "json":
        data = {
            "games": rows,
            "missing": grades.missing_seeds,
            "files": grades.file_count,
            "of": file_count,
        }
        return format_json_report(data | {"proves": GRADING_LIMITS})
    if output_format == "csv":
        rows += [
            _make_data_row(
                Grade("", verified=False, player=player, seed=seed, end_reason="missing")
            )
            for player, seeds in grades.missing_seeds.items()
            for seed in seeds
        ]
        return format_csv(
            [row | {key: _join_words(row[key]) for key in LIST_COLUMNS} for row in rows]
        )
    verified_count = sum(grade.verified for grade in grades.grades)
    empty_path_count = sum(not (row.problem or Path(row.path).is_file()) for row in grades.grades)
    headline = f"{format_count(len(rows) - empty_path_count, 'game')}, {verified_count} verified"
    unfinished_count = sum(grade.verified and not grade.is_finished for grade in grades.grades)
    if unfinished_count:
        headline += f", {unfinished_count} of them unfinished (no return)"
    if empty_path_count:
        headline += f"; {format_count(empty_path_count, 'path')} without a transcript"
    if grades.file_count < file_count:
        headline += f"; interrupted after {grades.file_count} of {format_count(file_count, 'file')}"
    missing_lines = [
        f"{format_name(player)} has no finished game with seed {_join_words(seeds)}"
        for player, seeds in grades.missing_seeds.items()
    ]
    game_table = format_table([_build_table_row(grade) for grade in grades.grades])
    return "\n\n".join(
        filter(
            None,
            [
                headline,
                game_table,
                "\n".join(missing_lines),
                fill(GRADING_LIMITS, PARAGRAPH_COLUMNS),
            ],
        )
    )


def _describe_game_end(grade: Grade) -> str:
    """Return the end reason of a game, marked as unfinished unless the game ended by itself."""
    is_enough = grade.is_finished or grade.end_reason in {"", "unfinished"}
    return grade.end_reason if is_enough else f"unfinished ({grade.end_reason})"


def _make_data_row(grade: Grade) -> Row:
    """Return a grade as a row of data for JSON and CSV."""
    return {DATA_KEYS.get(key, key): value for key, value in grade._asdict().items()}


def _join_words(value: object) -> object:
    """Return the items of a sequence joined by commas, or any other value unchanged."""
    return ", ".join(map(str, value)) if isinstance(value, Sequence) else value


def _build_table_row(grade: Grade) -> Row:
    """Return a grade as a table row, with combined numbers and all faults in the last column."""
    notes = [grade.fault] if grade.fault else []
    if grade.assignment_differences:
        notes.append(f"not as assigned: {', '.join(grade.assignment_differences)}")
    notes += (
        [f"the same game as {', '.join(grade.identical_files)}"] if grade.identical_files else []
    )
    notes += [f"tried again in {', '.join(grade.other_attempts)}"] if grade.other_attempts else []
    return {
        "file": escape_newlines(grade.path),
        "player": format_name(grade.player) or format_name(grade.occupant),
        "game": f"{format_name(grade.problem)} {'' if grade.seed is None else grade.seed}",
        "verified": "yes" if grade.verified else "NO",
        "return": "-" if grade.discounted_return is None else grade.discounted_return,
        "regret": "-"
        if grade.regret is None
        else f"{format_number(grade.regret, 3)} ({grade.best_count}/{grade.valued_count} best)",
        "undo": grade.undone_turn_count,
        "reroll": grade.reroll_count,
        "hints": grade.hint_count,
        "strict": "hints" if grade.strict == "hints" else "yes" if grade.strict else "no",
        "peeked": "yes" if grade.peeked else "no",
        "notes": escape_newlines(
            "; ".join(filter(None, [_describe_game_end(grade), *grade.remarks, *notes]))
        ),
    }
