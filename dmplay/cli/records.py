"""Commands on recorded games: check them, show them otherwise, look back at them."""

from collections.abc import Sequence
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.terminal import Wishes, here

MISMATCH_CODE = 3


def verify(
    paths: options.Paths,
    update: Annotated[bool, typer.Option("--update", help="show the diff and rewrite")] = False,
    allow_unfinished: Annotated[
        bool, typer.Option("--allow-unfinished", help="a file without an end is no fault")
    ] = False,
    trust: options.Trust = False,
    json: options.Json = False,
    quiet: options.Quiet = False,
) -> object:
    """Check transcripts: facts by a replay, inputs by seed and agents; exit code 3 if one differs.

    \b
      dmplay verify game.dmt
      dmplay verify transcripts
      dmplay verify transcripts --update
    """
    from dmplay.game import checking
    from dmplay.game.errand import Printout

    files = list(checking.files(paths))
    diffs, refused = checking.updates(files, trusted=trust) if update else ([], [])
    reports = [checking.check(file, trusted=trust) for file in files]
    good = [report.ok or (allow_unfinished and report.unfinished) for report in reports]
    rows = [*diffs, *checking.reported(reports, good, json=json, quiet=quiet)]
    code = 0 if all(good) else MISMATCH_CODE
    return Printout("\n".join(rows), errors="\n".join(refused), code=code)


@options.formats
@options.wishes("ascii", "width")
def export(
    file: options.File,
    formats: Sequence[str],
    at: Annotated[
        int | None, typer.Option("--at", metavar="TURN", help="the turn of a picture")
    ] = None,
    height: Annotated[
        int | None, typer.Option("--height", metavar="N", help="rows of the screen", min=1)
    ] = None,
    hint: Annotated[
        bool, typer.Option("--hint", help="a picture for who chooses there, with a hint")
    ] = False,
    output: options.Output = None,
    force: options.Force = False,
    trust: options.Trust = False,
    peek: options.Peek = False,
    *,
    wishes: Wishes,
    ctx: typer.Context,
) -> object:
    """Write a recorded game as a picture, a screen recording, text, a table or data.

    \b
      dmplay export game.dmt --svg -o game.svg
      dmplay export game.dmt --svg --width 100 --height 30 --at 3 --hint
      dmplay export game.dmt --film -o film.svg
      dmplay export game.dmt --csv
    """
    from dmplay.game.request import Recording
    from dmplay.reports.export import Aspect, exported
    from dmplay.screen.shown import Room

    ascii_ = (here(wishes) if str(output or "-") == "-" else wishes).ascii
    typed = [o for o in ("width", "height", "ascii") if options.source(ctx, o) == "COMMANDLINE"]
    aspect = Aspect(Room(wishes.width or 0, height or 0, ascii_), at, hint, typed)
    return exported(Recording(file, trust, peek), formats, aspect, output, force=force)


def review(
    file: options.File,
    write: Annotated[bool, typer.Option("--write", help="keep it in the file as notes")] = False,
    trust: options.Trust = False,
    peek: options.Peek = False,
    json: options.Json = False,
) -> object:
    """Value each move of the people in a game: the best action, and the regret.

    \b
      dmplay review game.dmt
      dmplay review game.dmt --write
    """
    from dmplay.game.request import Recording
    from dmplay.reports.reviewing import reviewed

    return reviewed(Recording(file, trust, peek), write=write, json=json)
