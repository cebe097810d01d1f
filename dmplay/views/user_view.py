"""The view of a user's problem module, completed by the generic view."""

from collections.abc import Mapping

from dmplay.views import generic


class UserView:
    """A user's view, with the same attributes as a view module."""

    def __init__(self, user_view: object, keys: Mapping[str, str]) -> None:
        self._user_view = user_view
        self.KEYS = {**getattr(user_view, "KEYS", {}), **keys}

    def __getattr__(self, name: str) -> object:
        """Return an attribute of the user's view, or else of the generic view."""
        return getattr(self._user_view if hasattr(self._user_view, name) else generic, name)
