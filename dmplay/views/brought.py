"""The look that a problem's module brings, a part or all of it; the rest is the generic one."""

from collections.abc import Mapping

from dmplay.views import generic


class UserView:
    """A view of the same shape as a module of `views`."""

    def __init__(self, user_view: object, keys: Mapping[str, str]) -> None:
        self._user_view = user_view
        self.KEYS = {**getattr(user_view, "KEYS", {}), **keys}

    def __getattr__(self, name: str) -> object:
        """A part of the look, or the generic one's."""
        return getattr(self._user_view if hasattr(self._user_view, name) else generic, name)
