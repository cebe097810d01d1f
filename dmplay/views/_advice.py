"""What a hint and a what-if add to a drawing: what each action loses, what one may bring.

A loss is told as `best`, or with its sign: `-0.31`; a bar of it is full for the worst action. What
loses nothing though another is advised is `as good`.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from textwrap import wrap

from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.core import Problem
from dmplay.session import View
from dmplay.views import _belief
from dmplay.views._belief import likeliest
from dmplay.views.canvas import bare, percent
from dmplay.views.style import ALIKE, BEST, EQUAL, Look, Outlook

BRANCHES = 6  # outcomes that are told
COLUMNS = 4  # states that have a column each
SHORT = 4  # columns of a bar where all losses stand in one row
MANY = 999.5  # from which on a number has no digits but whole ones
WIDEST, FEWEST = 12, 6  # columns of a number where there is room, and where there is little


def label(problem: Problem, seat: int, observation: Array) -> str:
    """What a seat sees, by name."""
    if not problem.hidden:
        return problem.line(observation)
    return bare(problem.observations[seat].told(observation))


def shown(keys: Mapping[str, str], look: Look) -> list[str]:
    """The key of each action, as a board shows it."""
    return [look.names.get(name, key) for key, name in keys.items()]


def known(look: Look) -> Mapping[int, float]:
    """What each legal action loses, the best first."""
    return {} if look.regret is None else _known((*look.regret.tolist(),), look.advised)


@lru_cache(16)
def _known(regret: Sequence[float], advised: float | None) -> Mapping[int, float]:
    """The same, which every row of a drawing asks for; nobody writes into it."""
    legal = {a: loss * (loss > ALIKE) for a, loss in enumerate(regret) if not math.isnan(loss)}
    return dict(sorted(legal.items(), key=lambda pair: (pair[1], pair[0] != advised)))


def ranked(look: Look, many: int) -> list[int]:
    """So many actions, the best first where regrets are given and the illegal last; else as is."""
    return list(dict.fromkeys([*known(look), *range(many)]))


def lost(look: Look, action: int, width: int = 6) -> str:
    """`best`, or what is lost: `-0.31`; nothing where it is not known."""
    losses = known(look)
    if action not in losses:
        return ""
    if losses[action]:
        return fewest(-losses[action], width)
    advised = any(not loss and one == look.advised for one, loss in losses.items())
    equal = advised and action != look.advised and len(EQUAL) <= width
    return EQUAL if equal else BEST[:width]


def fewest(number: float, width: int) -> str:
    """A number in three digits, or in as many as so few columns hold."""
    forms = [".3g", ".2g", ".1g", ".2f"] if abs(number) < MANY else []
    told = [f"{number:{form}}" for form in [*forms, ".0f"]]
    return next((one for one in told if len(one) <= width), "#" * width)


def bar(look: Look, action: int, width: int) -> str:
    """What is lost as a bar, a full one for the worst action, none for the best."""
    return _bar(look, action, width).rstrip("·.")


def _bar(look: Look, action: int, width: int) -> str:
    losses = known(look)
    share = losses.get(action, 0.0) / (max(losses.values(), default=0.0) or 1.0)
    return _belief.bar(share, width, look.ascii)


def loss(look: Look, action: int, width: int) -> str:
    """A bar of what an action loses against the best, with the number; `best` where nothing."""
    told = lost(look, action, WIDEST)
    return told if told in {"", BEST, EQUAL} else f"{_bar(look, action, width)} {told}"


def losses(look: Look, names: Sequence[str]) -> list[str]:
    """What each action loses in one row, the best first, as many as it holds; none if not asked.

    All of them without bars, or in fewer digits, rather than some with.
    """
    if look.regret is None:
        return []
    row = _row(f"{names[action]} {loss(look, action, SHORT)}" for action in known(look))
    for columns in (WIDEST, FEWEST):
        if len(row) > look.width:
            row = _row(f"{names[action]} {lost(look, action, columns)}" for action in known(look))
    return [row if len(row) <= look.width else row[: max(row.rfind("  ", 0, look.width + 2), 0)]]


def _row(parts: Iterable[str]) -> str:
    return "  ".join(["hint", *parts])


def odds(share: float, width: int) -> str:
    """A probability in so many columns: `0.70`, `.70`, `.7` or a star."""
    texts = (f"{share:.2f}", f"{share:.2f}"[share < 1 :], f"{share:.1f}"[share < 0.95 :])
    return next((text for text in texts if len(text) <= width), "*")


def foreseen(outlook: Outlook, doing: str) -> str:
    """The action of an outlook as a condition: `if you push left`; whether it is from samples."""
    return f"if you {doing}{' (samples)' * outlook.sampled}"


def asked(view: View[Problem], outlook: Outlook, doing: str = "{}") -> str:
    """The action of an outlook by its name as a condition."""
    return foreseen(outlook, doing.format(view.problem.action_name(view.seat, outlook.action)))


def branches(view: View[Problem], look: Look, names: Sequence[str], doing: str = "{}") -> list[str]:
    """How likely each outcome of the action in question is, what is seen, what then to believe."""
    if look.outlook is None:
        return []
    outlook, problem = look.outlook, view.problem
    told = [
        f"{percent(float(chance)):>4} {label(problem, view.seat, seen)}"
        for chance, seen in zip(outlook.chances, outlook.states, strict=True)
    ][:BRANCHES]
    head = asked(view, outlook, doing)
    rows = [head, *told]
    if outlook.beliefs is not None:
        stub = max(map(len, rows))
        heads = _columns(names, names) if len(names) <= COLUMNS else ""
        then = [_believed(names, belief) for belief in outlook.beliefs]
        pairs = zip(rows, [heads, *then], strict=False)
        rows = [f"{row:<{stub}}{tail}".rstrip() for row, tail in pairs]
    more = [f"     … {len(outlook.chances) - BRANCHES} more"]
    return [*rows, *(more if len(outlook.chances) > BRANCHES else [])]


def _believed(names: Sequence[str], belief: Reals) -> str:
    """A belief in columns under the names of the states; of many states the likeliest."""
    if len(names) <= COLUMNS:
        return _columns(names, [f"{share:.2f}" for share in belief])
    return "  " + ", ".join(likeliest(names, belief)[: COLUMNS - 1])


def _columns(names: Sequence[str], cells: Sequence[str]) -> str:
    pairs = zip(names, cells, strict=True)
    return "".join(cell.rjust(max(len(name), COLUMNS) + 2) for name, cell in pairs)


def under(drawings: Iterable[Text], rows: Sequence[str], look: Look) -> Iterator[Text]:
    """The drawings with these rows below; then, for where there is no room, without."""
    if not rows:
        return iter(drawings)
    kept = [*drawings]
    folded = [part for row in rows for part in wrap(row, max(look.width, 1)) or [""]]
    tail = "\n" + "\n".join(folded)
    return chain((drawn.copy().append(tail) for drawn in kept), kept)
