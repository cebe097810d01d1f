"""Text results of commands: a message of one row, or a page of several rows."""

from collections.abc import Mapping, Sequence
from typing import Self


class Page(str):
    """The result of a command, displayed as a separate page."""

    __slots__ = ()


class TurnReports(Page):
    """A page that reports played turns, one row per turn."""

    __slots__ = ()


class DataReply(str):
    """The result of a command in one row, which is also an event with data in JSON output.

    A screen on which the row is too long shows the `rows` as a page, if there are any. Without
    rows, the data say all.
    """

    event: str
    data: Mapping[str, object]
    rows: Sequence[str]

    def __new__(
        cls, text: str, event: str, data: Mapping[str, object], rows: Sequence[str] | None = None
    ) -> Self:
        """Return the text with the name of the event, its data, and the rows of a page.

        By default the text is the only row.
        """
        reply = super().__new__(cls, text)
        reply.event, reply.data, reply.rows = event, data, [text] if rows is None else rows
        return reply


def make_reply(rows: Sequence[str]) -> str:
    """Return a single row as a plain string, several rows as a `Page`, and '' for no rows."""
    return Page("\n".join(rows)) if len(rows) > 1 else (*rows, "")[0]
