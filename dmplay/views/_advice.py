"""What a hint and a what-if add to a drawing: what each action loses, what one may bring."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from textwrap import wrap

import numpy as np
from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.core import Problem
from dmplay.session import View
from dmplay.views._belief import bar, words
from dmplay.views.canvas import percent
from dmplay.views.style import Look, Outlook

ALIKE = 1e-9  # a loss that is none
BRANCHES = 6  # outcomes that are told
COLUMNS = 4  # states that have a column each
SHORT = 4  # columns of a bar where all losses stand in one row


def label(problem: Problem, seat: int, observation: Array) -> str:
    """What a seat sees, by name."""
    if not problem.hidden:
        return problem.notation(observation)
    return problem.observations[seat].told(observation)


def shown(keys: Mapping[str, str], look: Look) -> list[str]:
    """The key of each action, as a board shows it."""
    return [look.names.get(name, key) for key, name in keys.items()]


def ranked(look: Look, many: int) -> list[int]:
    """So many actions, the best first where regrets are given and the illegal last; else as is."""
    regret = np.zeros(many) if look.regret is None else look.regret
    return [int(action) for action in np.argsort(regret, kind="stable")]  # nan comes last


def loss(look: Look, action: int, width: int) -> str:
    """A bar of what an action loses against the best, with the number; `best` where nothing."""
    if look.regret is None or np.isnan(look.regret[action]):
        return ""
    lost = float(look.regret[action])
    if lost < ALIKE:
        return "best"
    return f"{bar(lost / np.nanmax(look.regret), width, look.ascii)} {lost_by(lost)}"


def lost_by(lost: float) -> str:
    """What is lost, in three digits."""
    return f"{lost:.3g}" if lost < 999.5 else f"{lost:.0f}"


def losses(look: Look, names: Sequence[str]) -> list[str]:
    """What each action loses in one row, the best first, as many as it holds; none if not asked."""
    if look.regret is None:
        return []
    legal = int(np.count_nonzero(~np.isnan(look.regret)))
    row = "loses"
    for action in ranked(look, len(names))[:legal]:
        more = f"{row}  {names[action]} {loss(look, action, SHORT)}"
        if len(more) > look.width:
            break
        row = more
    return [row]


def asked(view: View[Problem], outlook: Outlook, doing: str = "{}") -> str:
    """The action of an outlook as a condition."""
    action = doing.format(view.problem.action_name(view.seat, outlook.action))
    return f"if you {action}{' (samples)' * outlook.sampled}"


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
    return "  " + ", ".join(words(names, belief).split(", ")[: COLUMNS - 1])


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
