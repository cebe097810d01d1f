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
from dmplay.finding.names import name_of
from dmplay.views.style import style_of

Own = tuple[str, Mapping[str, str]]  # the file that has them; key -> action
NOTHING: Mapping[str, Own] = {}
ARROWS = ("left", "right", "up", "down", "home", "end", "pageup", "pagedown")
DIGITS = "1234567890"  # the key of each action by its number
CLUSTERS = {"vi": "hjklyubn", "left": "wasdezx", "arrows": ARROWS, "digits": DIGITS}
PAIRS = [f"{one} {other}" for one in ("up", "down") for other in ("left", "right")]
QUIT = "q"
SHOWN = {
    "left": "←", "right": "→", "up": "↑", "down": "↓",
    "home": "Home", "end": "End", "pageup": "PgUp", "pagedown": "PgDn",
    "up left": "↑←", "up right": "↑→", "down left": "↓←", "down right": "↓→",
}  # fmt: skip


class Keys(NamedTuple):
    """What a player wants of the keys: a preset, and for families of problems keys of their own."""

    preset: str = ""
    own: Mapping[str, Own] = NOTHING  # by family


AS_DRAWN = Keys()  # the view's own keys


class Hands(NamedTuple):
    """Who plays with which keys: the keys of one, and of a second person beside."""

    keys: Mapping[str, str]  # key -> action
    other: Mapping[str, str]


def hands(problem: Problem, wanted: Keys) -> Hands:
    """The keys in force for a problem; raises BadParameter or UnknownName for what cannot be."""
    if wanted.preset and wanted.preset not in CLUSTERS:
        raise BadParameter(f"--keys: got {wanted.preset!r}, expected one of {', '.join(CLUSTERS)}")
    style, labels = style_of(problem), problem.actions[0].labels
    for key in modules.keys(problem):
        _check(key, f"{modules.file(problem)}: KEYS")
    left: Mapping[str, str] = getattr(style, "LEFT", {})
    typed = hasattr(style, "NUDGES")  # digits write a number
    first = _preset(wanted.preset, {**style.KEYS, **left}, () if typed else labels)
    keys = {**first, **{key: label for key, label in style.KEYS.items() if key not in first}}
    where, own = "", dict[str, str]()
    for family in _families(problem):
        if family in wanted.own:
            file, more = wanted.own[family]
            where, own = f"{file}: keys.{family}", {**own, **more}
    keys = _with(keys, own, labels, where)
    right = {key: label for key, label in style.KEYS.items() if key in CLUSTERS["vi"]}
    return Hands(keys, right if wanted.preset == "left" else left)


def _families(problem: Problem) -> list[str]:
    """The names under which keys of a problem are set, the widest first."""
    name = name_of(problems.stem(problem))
    family: str = getattr(style_of(problem), "FAMILY", name)
    return list(dict.fromkeys((family, name)))


def _preset(preset: str, known: Mapping[str, str], labels: Sequence[str]) -> dict[str, str]:
    """The keys of a cluster, where they play every action; Space belongs to all of them."""
    if not preset or not labels:
        return {}
    if preset == "digits" and len(labels) <= len(DIGITS):
        return dict(zip(DIGITS, labels, strict=False))
    cluster = {*CLUSTERS[preset], "space", *(PAIRS if preset == "arrows" else ())}
    chosen = {key: label for key, label in known.items() if key in cluster}
    return chosen if {*chosen.values()} == {*labels} else {}


def _with(
    keys: Mapping[str, str], own: Mapping[str, str], labels: Labels, where: str
) -> dict[str, str]:
    """The keys with a player's own before them."""
    if own and not labels:
        raise BadParameter(f"{where}: a number is typed here")
    for key, label in own.items():
        _check(key, where)
        if label not in labels:
            raise UnknownName("action", label, [*map(str, labels)], where=f"{where}.{key}")
        before = keys.get(key, label)
        if before != label and before not in own.values():
            raise BadParameter(f"{where}: {key} plays {before} already; give {before} a key too")
    both = {**own, **{key: label for key, label in keys.items() if key not in own}}
    for pair in both:
        begins = pair.partition(" ")[0]
        if begins != pair and begins in both:
            raise BadParameter(f"{where}: {begins} begins {pair!r}; give another key")
    return both


def _check(key: str, where: str) -> None:
    """Refuses a key that is not the player's to choose."""
    letter = len(key) == 1 and key.islower() and key != QUIT
    if letter or key in (*ARROWS, *PAIRS, "space"):
        return
    if len(key) == 1 or key in ("tab", "enter", "escape", "backspace"):
        raise BadParameter(f"{where}: {key!r} is the shell's or a number; take a small letter")
    raise UnknownName("key", key, ["a letter", "space", *ARROWS, *PAIRS], where=where)


def names(keys: Mapping[str, str], labels: Sequence[str]) -> dict[str, str]:
    """The first key of each action, as a board or a row shows it."""
    backwards = reversed([*keys.items()])
    return {label: SHOWN.get(key, key) for key, label in backwards if label in labels}
