"""The look that a problem's module brings, a part or all of it; the rest is the generic one."""

from collections.abc import Mapping

from dmplay.views import generic


class Brought:
    """A view of the same shape as a module of `views`."""

    def __init__(self, look: object, keys: Mapping[str, str]) -> None:
        self._look = look
        self.KEYS = {**getattr(look, "KEYS", {}), **keys}

    def __getattr__(self, name: str) -> object:
        """A part of the look, or the generic one's."""
        return getattr(self._look if hasattr(self._look, name) else generic, name)
