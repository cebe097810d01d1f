"""Which key plays which action: a view's keys, those of a preset first, a player's own before all.

lower-case letters, Space, arrows    the game's, and a player's to choose
digits                               an action's number, always
everything else, and q               the shell's
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from dmplay.core import Labels, Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding import modules, problems
from dmplay.finding.names import stem_to_name
from dmplay.views.style import load_view_module

KeyOverrides = tuple[str, Mapping[str, str]]  # the file that has them; key -> action
NO_OVERRIDES: Mapping[str, KeyOverrides] = {}
NAVIGATION_KEYS = ("left", "right", "up", "down", "home", "end", "pageup", "pagedown")
DIGIT_KEYS = "1234567890"  # the key of each action by its number
KEY_PRESETS = {"vi": "hjklyubn", "left": "wasdezx", "arrows": NAVIGATION_KEYS, "digits": DIGIT_KEYS}
ARROW_PAIRS = [f"{one} {other}" for one in ("up", "down") for other in ("left", "right")]
QUIT_KEY = "q"
KEY_SYMBOLS = {
    "left": "←", "right": "→", "up": "↑", "down": "↓",
    "home": "Home", "end": "End", "pageup": "PgUp", "pagedown": "PgDn",
    "up left": "↑←", "up right": "↑→", "down left": "↓←", "down right": "↓→",
}  # fmt: skip


class KeyPreferences(NamedTuple):
    """What a player wants of the keys: a preset, and for families of problems keys of their own."""

    preset: str = ""
    overrides: Mapping[str, KeyOverrides] = NO_OVERRIDES  # by family


DEFAULT_KEY_PREFERENCES = KeyPreferences()  # the view's own keys


class KeyMaps(NamedTuple):
    """Who plays with which keys: the keys of one, and of a second person beside."""

    first_player_keys: Mapping[str, str]  # key -> action
    second_player_keys: Mapping[str, str]


def resolve_key_maps(problem: Problem, preferences: KeyPreferences) -> KeyMaps:
    """The keys in force for a problem; raises BadParameter or UnknownName for what cannot be."""
    if preferences.preset and preferences.preset not in KEY_PRESETS:
        raise BadParameter(
            f"--keys: got {preferences.preset!r}, expected one of {', '.join(KEY_PRESETS)}"
        )
    style, labels = load_view_module(problem), problem.actions[0].labels
    for key in modules.module_keys(problem):
        _reject_reserved_key(key, f"{modules.module_file(problem)}: KEYS")
    left: Mapping[str, str] = getattr(style, "SECOND_PLAYER_KEYS", {})
    typed = hasattr(style, "NUMBER_STEPS")  # digits write a number
    first = _select_preset_keys(preferences.preset, {**style.KEYS, **left}, () if typed else labels)
    keys = {**first, **{key: label for key, label in style.KEYS.items() if key not in first}}
    where, own = "", dict[str, str]()
    for family in _list_key_families(problem):
        if family in preferences.overrides:
            file, more = preferences.overrides[family]
            where, own = f"{file}: keys.{family}", {**own, **more}
    keys = _apply_overrides(keys, own, labels, where)
    right = {key: label for key, label in style.KEYS.items() if key in KEY_PRESETS["vi"]}
    return KeyMaps(keys, right if preferences.preset == "left" else left)


def _list_key_families(problem: Problem) -> list[str]:
    """The names under which keys of a problem are set, the widest first."""
    name = stem_to_name(problems.builtin_stem(problem))
    family: str = getattr(load_view_module(problem), "KEY_FAMILY", name)
    return list(dict.fromkeys((family, name)))


def _select_preset_keys(
    preset: str, available_keys: Mapping[str, str], labels: Sequence[str]
) -> dict[str, str]:
    """The keys of a cluster, where they play every action; Space belongs to all of them."""
    if not preset or not labels:
        return {}
    if preset == "digits" and len(labels) <= len(DIGIT_KEYS):
        return dict(zip(DIGIT_KEYS, labels, strict=False))
    cluster = {*KEY_PRESETS[preset], "space", *(ARROW_PAIRS if preset == "arrows" else ())}
    chosen = {key: label for key, label in available_keys.items() if key in cluster}
    return chosen if {*chosen.values()} == {*labels} else {}


def _apply_overrides(
    keys: Mapping[str, str], overrides: Mapping[str, str], labels: Labels, source: str
) -> dict[str, str]:
    """The keys with a player's own before them."""
    if overrides and not labels:
        raise BadParameter(f"{source}: a number is typed here")
    for key, label in overrides.items():
        _reject_reserved_key(key, source)
        if label not in labels:
            raise UnknownName("action", label, [*map(str, labels)], error_prefix=f"{source}.{key}")
        before = keys.get(key, label)
        if before != label and before not in overrides.values():
            raise BadParameter(f"{source}: {key} plays {before} already; give {before} a key too")
    both = {**overrides, **{key: label for key, label in keys.items() if key not in overrides}}
    for pair in both:
        begins = pair.partition(" ")[0]
        if begins != pair and begins in both:
            raise BadParameter(f"{source}: {begins} begins {pair!r}; give another key")
    return both


def _reject_reserved_key(key: str, source: str) -> None:
    """Refuses a key that is not the player's to choose."""
    letter = len(key) == 1 and key.islower() and key != QUIT_KEY
    if letter or key in (*NAVIGATION_KEYS, *ARROW_PAIRS, "space"):
        return
    if len(key) == 1 or key in ("tab", "enter", "escape", "backspace"):
        raise BadParameter(f"{source}: {key!r} is the shell's or a number; take a small letter")
    raise UnknownName(
        "key", key, ["a letter", "space", *NAVIGATION_KEYS, *ARROW_PAIRS], error_prefix=source
    )


def map_actions_to_keys(keys: Mapping[str, str], labels: Sequence[str]) -> dict[str, str]:
    """The first key of each action, as a board or a row shows it."""
    backwards = reversed([*keys.items()])
    return {label: KEY_SYMBOLS.get(key, key) for key, label in backwards if label in labels}
