"""The way in: answers --version at once, everything else through the command line."""

import sys


def main() -> None:
    """Runs dmplay; the exit code is 0, 1, 2, 3, or 128 and a signal."""
    if sys.argv[1:] == ["--version"]:
        from dmplay import __version__

        print(f"dmplay {__version__}")
        return
    from dmplay.cli import run

    sys.exit(run())


if __name__ == "__main__":
    main()
