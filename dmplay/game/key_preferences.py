"""The player's preferences for keys: a preset, and overrides for families of problems."""

from collections.abc import Mapping
from typing import NamedTuple

KeyOverrides = tuple[str, Mapping[str, str]]  # (config file, key -> action)
NO_OVERRIDES: Mapping[str, KeyOverrides] = {}
NAVIGATION_KEYS = ("left", "right", "up", "down", "home", "end", "pageup", "pagedown")
DIGIT_KEYS = "1234567890"  # keys of the actions by number
KEY_PRESETS = {"vi": "hjklyubn", "left": "wasdezx", "arrows": NAVIGATION_KEYS, "digits": DIGIT_KEYS}


class KeyPreferences(NamedTuple):
    """The player's preferences for keys: a preset, and overrides for families of problems."""

    preset: str = ""
    overrides: Mapping[str, KeyOverrides] = NO_OVERRIDES  # by family


DEFAULT_KEY_PREFERENCES = KeyPreferences()  # the keys of the view
