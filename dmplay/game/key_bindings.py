"""Key bindings of actions: a view's keys, then a preset, then the player's config.

lower-case letters, Space, arrows    actions; the player can bind them
digits                               an action's number, always
everything else, and q               the program's commands
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from dmplay.core.problem import Problem
from dmplay.core.spaces import Labels
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.key_preferences import DIGIT_KEYS, KEY_PRESETS, NAVIGATION_KEYS, KeyPreferences
from dmplay.registry import problem_module_exports
from dmplay.views.protocol import load_view_module

ARROW_PAIRS = [
    f"{vertical} {horizontal}" for vertical in ("up", "down") for horizontal in ("left", "right")
]
QUIT_KEY = "q"
KEY_SYMBOLS = {
    "left": "←", "right": "→", "up": "↑", "down": "↓",
    "home": "Home", "end": "End", "pageup": "PgUp", "pagedown": "PgDn",
    "up left": "↑←", "up right": "↑→", "down left": "↓←", "down right": "↓→",
}  # fmt: skip


class KeyMaps(NamedTuple):
    """The keys of a problem: of the first player, and of a second player at the same keyboard."""

    first_player_keys: Mapping[str, str]  # key -> action
    second_player_keys: Mapping[str, str]


def resolve_key_maps(problem: Problem, preferences: KeyPreferences) -> KeyMaps:
    """Return the key maps of a problem after the preset and the overrides.

    Raise BadParameter or UnknownName for a preset, key or action that is not possible.
    """
    if preferences.preset and preferences.preset not in KEY_PRESETS:
        raise BadParameter(
            f"--keys: got {preferences.preset!r}, expected one of {', '.join(KEY_PRESETS)}"
        )
    view_module, labels = load_view_module(problem), problem.actions[0].labels
    for key in problem_module_exports.load_module_keys(problem):
        if not _can_play_action(key):
            raise _make_key_error(key, problem_module_exports.locate_export(problem, "KEYS"))
    second_player_keys: Mapping[str, str] = getattr(view_module, "SECOND_PLAYER_KEYS", {})
    types_numbers = hasattr(view_module, "NUMBER_STEPS")  # Digits write a number.
    preset_keys = _select_preset_keys(
        preferences.preset,
        {**view_module.KEYS, **second_player_keys},
        () if types_numbers else labels,
    )
    keys = {
        **preset_keys,
        **{key: label for key, label in view_module.KEYS.items() if key not in preset_keys},
    }
    source, overrides = "", dict[str, str]()
    for family in _list_config_names(problem):
        if family in preferences.overrides:
            file, file_overrides = preferences.overrides[family]
            source, overrides = f"{file}: keys.{family}", {**overrides, **file_overrides}
    keys = _apply_overrides(keys, overrides, labels, source)
    vi_keys = {key: label for key, label in view_module.KEYS.items() if key in KEY_PRESETS["vi"]}
    return KeyMaps(keys, vi_keys if preferences.preset == "left" else second_player_keys)


def _list_config_names(problem: Problem) -> list[str]:
    """Return the config names of a problem's keys: its KEY_FAMILY if any, then its own name."""
    name = problem_module_exports.get_command_line_name(problem)
    family: str = getattr(load_view_module(problem), "KEY_FAMILY", name)
    return list(dict.fromkeys((family, name)))


def _select_preset_keys(
    preset: str, available_keys: Mapping[str, str], labels: Sequence[str]
) -> dict[str, str]:
    """Return the keys of a preset if they play every action, else none.

    Space belongs to all presets.
    """
    if not preset or not labels:
        return {}
    if preset == "digits" and len(labels) <= len(DIGIT_KEYS):
        return dict(zip(DIGIT_KEYS, labels, strict=False))
    cluster = {*KEY_PRESETS[preset], "space", *(ARROW_PAIRS if preset == "arrows" else ())}
    cluster_keys = {key: label for key, label in available_keys.items() if key in cluster}
    return cluster_keys if {*cluster_keys.values()} == {*labels} else {}


def _apply_overrides(
    keys: Mapping[str, str], overrides: Mapping[str, str], labels: Labels, source: str
) -> dict[str, str]:
    """Return the keys with a player's overrides before them.

    Raise BadParameter or UnknownName for an override of typed numbers, of an unknown action, of a
    key that leaves another action without one, or of a key that begins a combination.
    """
    if overrides and not labels:
        raise BadParameter(
            f"{source}: actions are typed as numbers in this problem, so no key can be set"
        )
    for key, label in overrides.items():
        if not _can_play_action(key):
            raise _make_key_error(key, source)
        if label not in labels:
            raise UnknownName("action", label, [*map(str, labels)], error_prefix=f"{source}.{key}")
        previous_label = keys.get(key, label)
        if previous_label != label and previous_label not in overrides.values():
            raise BadParameter(
                f"{source}: {key} already plays {previous_label}; "
                f"set another key for {previous_label}"
            )
    merged = {**overrides, **{key: label for key, label in keys.items() if key not in overrides}}
    for pair in merged:
        first_key = pair.partition(" ")[0]
        if first_key != pair and first_key in merged:
            raise BadParameter(
                f"{source}: {first_key} is the first key of {pair!r}; set another key"
            )
    return merged


def _can_play_action(key: str) -> bool:
    """Return whether a key can be bound to an action."""
    letter = len(key) == 1 and key.islower() and key != QUIT_KEY
    return letter or key in (*NAVIGATION_KEYS, *ARROW_PAIRS, "space")


def _make_key_error(key: str, source: str) -> BadParameter | UnknownName:
    """Return the error for a key that cannot be bound to an action."""
    if len(key) == 1 or key in ("tab", "enter", "escape", "backspace"):
        reason = "is reserved for commands or numbers; use a lower-case letter"
        return BadParameter(f"{source}: {key!r} {reason}")
    names = ["a letter", "space", *NAVIGATION_KEYS, *ARROW_PAIRS]
    return UnknownName("key", key, names, error_prefix=source)


def map_actions_to_keys(keys: Mapping[str, str], labels: Sequence[str]) -> dict[str, str]:
    """Return the first key of each action, as the screen shows it."""
    backwards = reversed([*keys.items()])
    return {label: KEY_SYMBOLS.get(key, key) for key, label in backwards if label in labels}
