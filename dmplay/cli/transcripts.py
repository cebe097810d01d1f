"""CLI commands for transcripts: verify, export and review."""

from collections.abc import Sequence
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.core.text import escape_newlines
from dmplay.errors import BadParameter
from dmplay.terminal.capabilities import TerminalOptions, current_terminal

MISMATCH_EXIT_CODE = 3
LEARNED_SUFFIX = ".npz"  # of the file of a learned agent


def verify(
    paths: options.TranscriptPaths,
    update: Annotated[
        bool, typer.Option("--update", help="rewrite files that differ, and print the diff")
    ] = False,
    allow_unfinished: Annotated[
        bool, typer.Option("--allow-unfinished", help="accept transcripts that have no end")
    ] = False,
    frames: Annotated[
        bool, typer.Option("--frames/--no-frames", help="check the recorded drawings of turns too")
    ] = True,
    retrain: Annotated[
        bool, typer.Option("--retrain", help="repeat the training of learned agents, and compare")
    ] = False,
    trust: options.Trust = False,
    json: options.JsonFlag = False,
    quiet: options.Quiet = False,
) -> object:
    """Check recorded games by computing them again.

    dmplay computes every result again from the recorded actions and random numbers.
    It also generates the random numbers again from the seed. Built-in agents choose
    their actions again, unless they have a time limit. If any result differs from the
    file, the exit code is 3.

    A transcript may contain a drawing of each turn. Another version of dmplay may
    draw turns differently. --no-frames leaves the drawings out of the check.

    The file of a learned agent (.npz) has a digest of its content. With --retrain, dmplay
    also repeats the training from the seed.

    \b
      dmplay verify game.dmt
      dmplay verify transcripts
      dmplay verify transcripts --update
    """
    from dmplay.game import transcript_verification
    from dmplay.game.command_line_results import Printout
    from dmplay.terminal.progress import ProgressBar

    learned = [path for path in paths if path.suffix == LEARNED_SUFFIX]
    if learned:
        from dmplay.output.training_report import verify_learned_files

        if len(learned) < len(paths):
            raise BadParameter("verify: expected transcripts, or files of learned agents")
        lines, are_good = verify_learned_files(learned, retrain=retrain)
        return Printout("\n".join(lines), exit_code=0 if are_good else MISMATCH_EXIT_CODE)
    if retrain:
        raise BadParameter("--retrain: expected files of learned agents (.npz)")
    files = list(transcript_verification.iter_transcript_files(paths))
    reports = []
    with ProgressBar("verifying the files", quiet=quiet or json) as bar:
        diffs, errors = (
            transcript_verification.rewrite_files(files, trusted=trust) if update else ([], [])
        )
        for number, file in enumerate(files, 1):
            report = transcript_verification.verify(file, trusted=trust, compares_frames=frames)
            reports.append(report)
            bar(number / len(files))
    accepted = [report.is_ok or (allow_unfinished and report.is_unfinished) for report in reports]
    rows = [
        *diffs,
        *transcript_verification.format_reports(reports, accepted, json=json, quiet=quiet),
    ]
    code = 0 if all(accepted) else MISMATCH_EXIT_CODE
    return Printout("\n".join(rows), stderr_text="\n".join(errors), exit_code=code)


@options.with_export_formats
@options.with_terminal_options("ascii", "width", width=options.ScreenWidth)
def export(
    paths: options.TranscriptPaths,
    formats: Sequence[str],
    at: Annotated[
        int | None, options.number_option(int, "turn to show, with --svg or --html", metavar="TURN")
    ] = None,
    height: Annotated[
        int | None, options.number_option(int, "height of the screen in rows", min=1)
    ] = None,
    hint: Annotated[
        bool,
        typer.Option("--hint", help="with --svg: also show a hint for the player whose turn it is"),
    ] = False,
    review: Annotated[
        bool,
        typer.Option(
            "--review",
            help="with --csv or --jsonl: also export the values and the regret of each choice",
        ),
    ] = False,
    output: options.OutputPath = None,
    force: options.Force = False,
    meta: options.MetaFile = None,
    trust: options.Trust = False,
    peek: options.Peek = False,
    *,
    terminal_options: TerminalOptions,
    ctx: typer.Context,
) -> object:
    """Export a recorded game as a picture, film, text or data.

    Choose exactly one format. With --csv and --jsonl, you can give several files and
    folders: their turns become one table, with the file in the first column. If a
    file is not a recorded game, dmplay names it and goes on; the exit code is 3.

    \b
      dmplay export game.dmt --svg -o game.svg
      dmplay export game.dmt --svg --width 100 --height 30 --at 3 --hint
      dmplay export game.dmt --film -o film.svg
      dmplay export game.dmt --csv
      dmplay export transcripts --csv -o games.csv
    """
    from dmplay.game.launch_requests import ReplayRequest
    from dmplay.output.transcript_export import ExportOptions, export_rows, export_transcript
    from dmplay.terminal.progress import ProgressBar
    from dmplay.ui.screen.frame_state import Viewport

    is_printed = str(output or "-") == "-"
    ascii_ = (current_terminal(terminal_options) if is_printed else terminal_options).ascii
    explicit_options = [
        o for o in ("width", "height", "ascii") if options.option_source(ctx, o) == "COMMANDLINE"
    ]
    viewport = Viewport(terminal_options.width or 0, height or 0, ascii_)
    aspect = ExportOptions(viewport, at, hint, explicit_options, review)
    if len(paths) > 1 or paths[0].is_dir():
        return export_rows(paths, formats, aspect, output, force=force, trusted=trust, peek=peek)
    (file,) = paths
    recording = ReplayRequest(file, trust, peek)
    with ProgressBar(f"exporting {escape_newlines(str(file))}"):
        return export_transcript(recording, formats, aspect, output, force=force)


def review(
    file: options.TranscriptPath,
    seat: Annotated[
        str,
        typer.Option(
            metavar="SEAT", help="seat to review (default: those of people, or all without people)"
        ),
    ] = "",
    write: Annotated[
        bool,
        typer.Option("--write", help="also write the review into FILE, in lines that begin with #"),
    ] = False,
    trust: options.Trust = False,
    peek: options.Peek = False,
    json: options.JsonFlag = False,
) -> object:
    """Show the best actions, and what each choice of a player lost.

    The return of a game is the sum of its rewards; with a discount, later rewards count
    less. The regret of a choice is the expected return after the best action minus the
    expected return after the chosen action.

    \b
      dmplay review game.dmt
      dmplay review game.dmt --write
    """
    from dmplay.game.launch_requests import ReplayRequest
    from dmplay.output.review_report import report_review

    return report_review(ReplayRequest(file, trust, peek), seat=seat, write=write, json=json)
