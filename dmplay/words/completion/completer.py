"""Completion at the prompt and in the screen's command row."""

from collections.abc import Iterable

from prompt_toolkit.completion import CompleteEvent, Completer, Completion
from prompt_toolkit.document import Document

from dmplay.game.table import Table
from dmplay.words.completion.candidates import candidates


class Words(Completer):
    """What can stand where the cursor is; the fuzzy completer takes away the word under it."""

    def __init__(self, table: Table) -> None:
        self._table = table

    def get_completions(self, document: Document, event: CompleteEvent) -> Iterable[Completion]:
        """All candidates: the completer around this one chooses."""
        before = document.text_before_cursor.rpartition(";")[2]
        for found in candidates(self._table, before):
            yield Completion(found)
