"""The way in: answers --version at once, everything else through the command line."""

import os
import sys
from types import TracebackType


def main() -> None:
    """Runs dmplay; the exit code is 0, 1, 2, 3, or 128 and a signal."""
    if sys.argv[1:] == ["--version"]:
        from dmplay import __version__

        print(f"dmplay {__version__}")
        return
    if "--debug" in sys.argv:
        sys.argv.remove("--debug")
    elif not os.environ.get("DMPLAY_DEBUG"):
        sys.excepthook = _unexpected
    from dmplay.cli import run

    sys.exit(run())


def _unexpected(
    kind: type[BaseException], error: BaseException, trace: TracebackType | None
) -> None:
    """One line for a fault of dmplay itself, and the file that tells the rest."""
    import tempfile
    import traceback

    told = "".join(traceback.format_exception(kind, error, trace))
    with tempfile.NamedTemporaryFile(
        "w", prefix="dmplay-", suffix=".log", delete=False, encoding="utf-8"
    ) as log:
        log.write(told)
    print(
        f"error: unexpected {kind.__name__}; {log.name} tells where, --debug shows it",
        file=sys.stderr,
    )


if __name__ == "__main__":
    main()
