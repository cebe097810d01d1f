"""What a command answers: a message of one row, or a page."""

from collections.abc import Sequence


class Page(str):
    """An answer that is read on a page of its own."""

    __slots__ = ()


class TurnReports(Page):
    """Turns that were played and are told, a row each."""

    __slots__ = ()


def format_reply(rows: Sequence[str]) -> str:
    """One row as a message, several as a page."""
    return Page("\n".join(rows)) if len(rows) > 1 else (*rows, "")[0]
