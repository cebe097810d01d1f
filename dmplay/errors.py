"""The errors that dmplay raises, each also the builtin error that a caller would expect.

DmplayError
|-- UnknownName (LookupError)            an unknown problem, variant, agent, action ...
|-- BadParameter (ValueError)            a value that a parameter or option cannot take
|-- IllegalAction (ValueError)           an action that the state does not allow
|-- ImpossibleObservation (ValueError)   an observation of probability 0: there is no posterior
|-- EpisodeOver (RuntimeError)           a turn after the end of the episode
|-- BadPolicy (RuntimeError)             a policy that violates its interface
|   `-- Forfeit                          a program that breaks the bot protocol
|-- DiskFull (OSError)                   a file that does not fit on the disk
|-- BudgetExceeded (RuntimeError)        a computation beyond its budget of work or memory
|-- LostGames (RuntimeError)             games whose worker died each time they were played
|-- BadFile (ValueError)                 a file that is not in its format: line and column
|   `-- BadTranscript                    a file that is not a transcript
`-- TranscriptMismatch (AssertionError)  a transcript whose replay differs
"""

from collections.abc import Iterable
from difflib import get_close_matches

MAX_LISTED_NAMES = 16  # maximum names listed in one message
MAX_NAME_CHARS = 200  # maximum characters of a name in a message
MAX_MESSAGE_CHARS = 2000  # maximum characters of a message, which may quote any input


def clip_message(message: str) -> str:
    """Return a message without its middle if it is longer than MAX_MESSAGE_CHARS."""
    if len(message) <= MAX_MESSAGE_CHARS:
        return message
    half = MAX_MESSAGE_CHARS // 2
    return f"{message[:half]} ... {message[-half:]}"


class DmplayError(Exception):
    """The base class of errors that dmplay raises on purpose; their text is one line for people."""

    # index of the entrant in whose games it occurred, if several play the same games
    entrant_index: int | None = None

    def __str__(self) -> str:
        return clip_message(self._format_message())

    def _format_message(self) -> str:
        """Return the whole message, which quotes its input in full."""
        return super().__str__()


def record_seat(error: Exception, seat: int) -> None:
    """Record the seat whose policy raised an error, so that its entrant can be withdrawn."""
    vars(error)["policy_seat"] = seat


def find_policy_seat(error: Exception) -> int | None:
    """Return the seat whose policy raised an error; None if no policy did."""
    seat: int | None = vars(error).get("policy_seat")
    return seat


class UnknownName(DmplayError, LookupError):
    """A name that does not exist; the message suggests similar names, or lists those that do."""

    def __init__(
        self, category: str, name: str, names: Iterable[str], error_prefix: str = ""
    ) -> None:
        all_names = list(names)
        name = name if len(name) <= MAX_NAME_CHARS else f"{name[:MAX_NAME_CHARS]}..."
        close = get_close_matches(name.lower(), all_names, n=3, cutoff=0.5)
        choices = (
            all_names
            if len(all_names) <= MAX_LISTED_NAMES
            else [*all_names[: MAX_LISTED_NAMES - 2], "...", all_names[-1]]
        )
        hint = (
            f"did you mean {' or '.join(close)}?"
            if close
            else f"expected {_format_choices(choices)}"
        )
        super().__init__(
            f"{error_prefix}{': ' if error_prefix else ''}unknown {category} {name!r}; {hint}"
        )


class BadParameter(DmplayError, ValueError):
    """A value that a parameter or an option cannot take."""


class IllegalAction(DmplayError, ValueError):
    """An action that the state does not allow."""


class ImpossibleObservation(DmplayError, ValueError):
    """An observation of probability 0 under the belief: there is no posterior."""


class EpisodeOver(DmplayError, RuntimeError):
    """A turn after the end of the episode."""


class BadPolicy(DmplayError, RuntimeError):
    """A policy that violates its interface, or cannot play this problem."""


class Forfeit(BadPolicy):
    """A program in a seat that breaks the bot protocol: a one-word reason, and details.

    `episode` is its row in a batch of games, and later the game's number; None if no action was
    asked for.
    """

    episode: int | None = None

    def __init__(self, reason: str, details: str, seat: str = "") -> None:
        super().__init__(reason, details, seat)
        self.reason, self.details, self.seat = reason, details, seat

    def _format_message(self) -> str:
        """Return the seat, the reason and the details."""
        return f"{self.seat} forfeits, {self.reason}: {self.details}".removeprefix(" forfeits, ")


class DiskFull(DmplayError, OSError):
    """A file that does not fit on the disk."""


class BudgetExceeded(DmplayError, RuntimeError):
    """A computation beyond its budget: the task, its requirement, and a cheaper alternative."""

    def __init__(self, task: str, requirement: str, remedy: str) -> None:
        super().__init__(f"{task}: {requirement}; {remedy}")


class LostGames(DmplayError, RuntimeError):
    """Games whose worker died each time they were played: the start and stop of each block."""

    def __init__(self, blocks: list[tuple[int, int]], reason: str) -> None:
        super().__init__(blocks, reason)
        self.blocks, self.reason = blocks, reason

    def _format_message(self) -> str:
        """Return the ranges of the lost games and the reason."""
        ranges = ", ".join(f"{first} to {end - 1}" for first, end in self.blocks)
        return f"games {ranges} were lost: {self.reason}"


class BadFile(DmplayError, ValueError):
    """A file that is not in its format, with the line and column of the first error."""

    def __init__(self, path: str, line: int, column: int | None, explanation: str) -> None:
        super().__init__(path, line, column, explanation)
        self.path, self.line, self.column, self.explanation = path, line, column, explanation

    def _format_message(self) -> str:
        """Return the path, line, column and explanation."""
        column = "" if self.column is None else f"{self.column}:"
        return f"{self.path}:{self.line}:{column} {self.explanation}"


class BadTranscript(BadFile):
    """A file that is not a transcript."""


class TranscriptMismatch(DmplayError, AssertionError):
    """A transcript whose replay differs from what it records."""


def _format_choices(names: list[str]) -> str:
    """Return the expected names as text: "one of A, B", or "none"."""
    return f"one of {', '.join(names)}" if names else "none"
