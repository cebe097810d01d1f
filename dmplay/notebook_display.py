"""The display of a game in a notebook; the drawing code is imported only when it is used.

Drawing belongs to a layer far above the game itself.
"""

from importlib import import_module


class NotebookDisplay:
    """A game that a notebook shows as its board, as text and as HTML."""

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        mime_bundle: dict[str, str] = import_module("dmplay.output.notebook_rendering").mime_bundle(
            self
        )
        return mime_bundle

    def _repr_html_(self) -> str:
        return self._repr_mimebundle_()["text/html"]
