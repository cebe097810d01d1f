"""The display of a game in a notebook, by a function that the package registers when it starts.

Drawing belongs to a layer far above the game itself, so this module does not import it.
"""

from collections.abc import Callable

MimeBundle = dict[str, str]  # MIME type -> the game in that form

_render_game: Callable[[object], MimeBundle] | None = None


def register_renderer(render_game: Callable[[object], MimeBundle]) -> None:
    """Have notebooks show every game with this function."""
    global _render_game  # noqa: PLW0603 - one renderer for the whole process
    _render_game = render_game


class NotebookDisplay:
    """A game that a notebook shows as its board, as text and as HTML."""

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> MimeBundle:
        assert _render_game, "importing dmplay registers the renderer"
        return _render_game(self)

    def _repr_html_(self) -> str:
        return self._repr_mimebundle_()["text/html"]
