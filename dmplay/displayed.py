"""What a notebook shows of a game. Drawing is far below the game itself, and so is found late."""

from importlib import import_module


class NotebookDisplay:
    """A game that a notebook shows as its board, as text and as HTML."""

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        shown: dict[str, str] = import_module("dmplay.reports.notebook").mime_bundle(self)
        return shown

    def _repr_html_(self) -> str:
        return self._repr_mimebundle_()["text/html"]
