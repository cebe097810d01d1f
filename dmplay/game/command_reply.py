"""Text results of commands: a message of one row, or a page of several rows."""

from collections.abc import Sequence


class Page(str):
    """The result of a command, displayed as a separate page."""

    __slots__ = ()


class TurnReports(Page):
    """A page that reports played turns, one row per turn."""

    __slots__ = ()


def format_reply(rows: Sequence[str]) -> str:
    """Return a single row as a plain string, several rows as a `Page`, and '' for no rows."""
    return Page("\n".join(rows)) if len(rows) > 1 else (*rows, "")[0]
