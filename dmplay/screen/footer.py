"""The last row of the screen: the keys that count now."""

from collections.abc import Iterable, Iterator, Sequence
from functools import cache, lru_cache
from itertools import product
from typing import NamedTuple

from rich.text import Text

from dmplay.advice.adviser import Advice, fewest, fixed
from dmplay.game.game import Game
from dmplay.keys.keymap import SHOWN
from dmplay.screen.shown import NOTHING, Room, Shown, fitted
from dmplay.views.canvas import BARS
from dmplay.views.style import BEST, EQUAL
from dmplay.words.commands import named

COLON = ": command"
OVER_KEYS = (("new", "restart", "undo", "help", "quit"), ("new", "help", "quit"), ("help", "quit"))
ROW_KEYS = (
    ("hint", "whatif", "undo", "help", "quit"),
    ("hint", "undo", "help", "quit"),
    ("hint", "help", "quit"),
    ("help", "quit"),
)
LABELS = (7, 4)  # columns of a label where not all have room


class Key(NamedTuple):
    """A key that plays: how it is shown, its action, whether it is legal, what is lost by it."""

    key: str
    label: str
    able: bool
    lost: str = ""

    @property
    def words(self) -> str:
        """Key, action and loss between blanks; in their place brackets where it is not legal."""
        key = SHOWN.get(self.key, self.key)
        told = self.label if self.key == self.label else f"{key} {self.label}".strip()
        return f" {told}{self.lost} " if self.able else f"[{told}]"


def keys(game: Game, room: Room, shown: Shown = NOTHING) -> Text:
    """The keys that count now, the game's before the shell's; help and quit are always there."""
    if shown.curtain:
        return fitted(Text(" Enter shows the board  q quit"), room)
    # A recording is never over: one goes back in it.
    ended = game.request is not None and game.session.over
    over, waits = bool(shown.past or ended), game.waiting is not None
    unneeded = 0 if over else 3 if game.unaided else not waits
    barred = "undo" * bool(game.final)
    tails = _tails(_moving(game, shown, ended=ended), unneeded, barred, over=over)
    return _fitted(_forms(game, shown.advice), tails, room) if waits else _alone(tails, room)


@lru_cache(16)
def _alone(tails: Sequence[str], room: Room) -> Text:
    """The shell's keys alone; nobody writes into the row."""
    return _fitted([Text("")], tails, room)


def _fitted(forms: Iterable[Text], tails: Sequence[str], room: Room) -> Text:
    """The first form that there is room for, else the last, and as many of the shell's keys."""
    left, row = room.width - len(tails[-1]) - 1, Text()
    for row in forms:
        if len(row.plain) <= left:
            break
    if len(row.plain) > left > 1:
        row.truncate(left - 1, overflow="ellipsis")
        row.append(" ")
    tail = next((tail for tail in tails if len(row.plain) + 1 + len(tail) <= room.width), tails[-1])
    return fitted(row.append(" ").append(tail, style="dim"), room)


def _forms(game: Game, advice: Advice | None) -> Iterator[Text]:
    """The keys that play, in words and in fewer."""
    if game.keyboard.types_numbers(game.watcher):
        nudges = " ".join(SHOWN.get(key, key) for key in game.keyboard.nudges)
        best = f" {advice.named} {BEST} " if advice else ""
        yield Text(f"{best} type a number, Enter plays it  {nudges} nudge it ")
        yield Text(f"{best} a number, Enter ")
    else:
        legal = [Key(*one) for one in game.keyboard.legal(game.view())]
        yield from (_row(ranked) for ranked in _ranked(legal, advice))
        yield _row(legal)
        for most in (*LABELS, 0):
            cut = [one._replace(label=_cut(one.label, most)) for one in legal]
            if not most or len({one.label for one in cut}) == len(cut):  # tells them apart
                yield _row(cut)


def _cut(label: str, most: int) -> str:
    return label if len(label) <= most else f"{label[: most - 1]}…" if most else ""


def _row(actions: Sequence[Key]) -> Text:
    return Text("".join(action.words for action in actions))


def _ranked(actions: Sequence[Key], advice: Advice | None) -> Iterator[list[Key]]:
    """The legal actions, the best first, each with what it loses as a bar, with names or numbers
    or both or neither.
    """
    both = advice.ranked if advice else []
    if not both or advice is None:
        return
    most, places = both[-1][1], fewest([loss for _, loss in both])
    for numbers, names in product((True, False), repeat=2):
        ranked = []
        for number, loss in both:
            equal = names and advice.action not in {None, number}
            lost = f" {EQUAL if equal else BEST}"
            if loss:
                bar = BARS[min(int(len(BARS) * loss / most), len(BARS) - 1)]
                lost = f" {bar}{fixed(-loss, places) if numbers else ''}"
            label = actions[number].label if names else ""
            ranked.append(actions[number]._replace(label=label, lost=lost))
        yield ranked


@lru_cache(16)
def _tails(moving: Sequence[str], unneeded: int, barred: str, *, over: bool) -> tuple[str, ...]:
    """The shell's keys but one, most of them first, but for so many of these rows."""
    rows = (OVER_KEYS if over else ROW_KEYS)[unneeded:]
    names = [[name for name in row if name != barred] for row in rows]
    tails = ["  ".join([*moving, *map(_shown, some), COLON]) for some in names]
    tails += ["  ".join([*moving, *map(_shown, names[-1])])]
    return (*tails, "  ".join(map(_shown, names[-1])))


def _moving(game: Game, shown: Shown, *, ended: bool) -> tuple[str, ...]:
    """The keys that lead through a game nobody plays, or that is over."""
    if shown.past:
        return ("← → turns", *["Enter plays on"] * (not game.strict))
    if game.people:
        return ("Enter looks back",) * bool(game.session.over and game.session.turns)
    return () if ended else ("Space step", "P play")


@cache
def _shown(name: str) -> str:
    return f"{named(name).shown} {name}"
