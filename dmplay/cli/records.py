"""Commands on recorded games: check them, show them otherwise, look back at them."""

from collections.abc import Mapping
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
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
) -> int:
    """Check transcripts: facts against a replay, inputs against seed and agents; 3 if one differs.

    \b
      dmplay verify game.dmt
      dmplay verify transcripts
      dmplay verify transcripts --update
    """
    from dmplay.game import checking

    files = list(checking.files(paths))
    if update:
        checking.print_updates(files, trusted=trust)
    reports = [checking.check(file, trusted=trust) for file in files]
    good = [report.ok or (allow_unfinished and report.unfinished) for report in reports]
    checking.print_reports(reports, good, json=json, quiet=quiet)
    return 0 if all(good) else MISMATCH_CODE


@options.wishes("ascii", "width")
def export(
    file: options.File,
    svg: Annotated[bool, typer.Option("--svg", help="a picture of the screen")] = False,
    film: Annotated[bool, typer.Option("--film", help="an animated picture")] = False,
    html: Annotated[bool, typer.Option("--html", help="a page with the screen")] = False,
    cast: Annotated[bool, typer.Option("--cast", help="a recording, asciicast v2")] = False,
    text: Annotated[bool, typer.Option("--text", help="every screen as text")] = False,
    csv: Annotated[bool, typer.Option("--csv", help="a row a turn")] = False,
    json: Annotated[bool, typer.Option("--json", help="the game as one object")] = False,
    at: Annotated[
        int | None, typer.Option("--at", metavar="TURN", help="the turn of a picture")
    ] = None,
    output: options.Output = None,
    trust: options.Trust = False,
    *,
    wishes: Wishes,
) -> None:
    """Write a recorded game as a picture, a screen recording, text, a table or data.

    \b
      dmplay export game.dmt --svg -o game.svg
      dmplay export game.dmt --film -o film.svg
      dmplay export game.dmt --csv
    """
    from dmplay.reports.export import print_export

    wanted = {
        "svg": svg, "film": film, "html": html, "cast": cast, "text": text, "csv": csv,
        "json": json,
    }  # fmt: skip
    printed = output is None or str(output) == "-"
    ascii_ = here(wishes).ascii if printed else wishes.ascii
    form = _one_of(wanted)
    print_export(file, form, at, output, width=wishes.width, ascii_=ascii_, trusted=trust)


def review(
    file: options.File,
    write: Annotated[bool, typer.Option("--write", help="keep it in the file as notes")] = False,
    trust: options.Trust = False,
    json: options.Json = False,
) -> None:
    """Value each move of the people in a game: the best action, and the regret.

    \b
      dmplay review game.dmt
      dmplay review game.dmt --write
    """
    from dmplay.game.review import print_review

    print_review(file, write=write, json=json, trusted=trust)


def _one_of(wanted: Mapping[str, bool]) -> str:
    """The one option that is given."""
    chosen = [name for name, wish in wanted.items() if wish]
    if len(chosen) != 1:
        raise BadParameter(f"export: choose one of {', '.join(f'--{name}' for name in wanted)}")
    return chosen[0]
