"""The first rows of the screen: the game and how it stands, what to aim for and what it costs."""

from collections.abc import Iterator, Sequence
from functools import lru_cache

from rich.text import Span, Text

from dmplay.describe import brief, ended, score
from dmplay.game.game import Game
from dmplay.screen.shown import Room
from dmplay.screen.wrapping import worded
from dmplay.session import MOST_TURNS
from dmplay.terminal import clean


def title(game: Game, room: Room) -> Text:
    """The game and how it stands; closer together and without the seed where there is no room."""
    first, told, end = _headed(game, room)
    begin, last = len(first), len(first) + len(told)
    spans = [Span(begin, last, "not bold"), Span(last, last + len(end), "bold")]
    return Text(first + told + end, style="bold", spans=spans[: 1 + bool(end)])


def _headed(game: Game, room: Room) -> tuple[str, str, str]:
    """What is played, how it stands, and how it ended, in a form that the room holds."""
    form = ("", "", "")
    for first, gap, facts in _forms(game):
        form = first, gap[1:] + gap.join(facts), _end(game, gap)
        if sum(map(len, form)) <= room.width:
            break
    return form


def _forms(game: Game) -> Iterator[tuple[str, str, Sequence[str]]]:
    """What is played, the blanks between the facts, and these; each form needs less room."""
    seed = [f"seed {game.seed}"] if game.shows_seed else []
    facts = _facts(game, score(game.problem))
    yield _called(game), "   ", [*seed, *facts]
    close = f" {clean(game.name)} "
    yield close, "  ", facts
    facts = _facts(game, "score")
    for many in range(len(facts), -1, -1):  # a fact is told whole or not at all
        yield close, "  ", facts[:many]


def _end(game: Game, gap: str) -> str:
    ending = game.moment().ending
    why = "over" if ending == "terminal" else ended(ending)
    return f"{gap}{why}" if ending else ""


def _facts(game: Game, called: str) -> list[str]:
    """Turn, score, who you are, and who the others are."""
    now = game.moment()
    limit = f"/{game.session.limit}" if game.session.limit not in (None, MOST_TURNS) else ""
    facts = [f"turn {now.turn}{limit}"]
    if now.paid:
        facts.append(f"{called} {brief(game.account.returned(now))}")
    you = game.watcher if game.people else None
    return [*facts, *_seated(tuple(game.problem.agents), game.seats, you)]


@lru_cache(16)  # who changes seldom
def _seated(agents: Sequence[str], seats: Sequence[str], you: int | None) -> tuple[str, ...]:
    own = () if you is None else (f"you: {agents[you]}",)
    others = enumerate(zip(agents, seats, strict=True))
    return (*own, *(f"{agent}: {clean(who)}" for seat, (agent, who) in others if seat != you))


def name(game: Game) -> Text:
    """What is played."""
    return Text(_called(game), style="bold")


def _called(game: Game) -> str:
    return f" dmplay {clean(game.name)}  "


def goal(game: Game, room: Room) -> Text:
    """What to aim for and what it costs, as many clauses as one row holds; one at least."""
    return _row(tuple(_clauses(game)), room.width)


@lru_cache(16)  # which comes again
def _row(clauses: Sequence[str], width: int) -> Text:
    return Text(f" {_joined(clauses[: max(_held(clauses, width), 1)])}")


def more(game: Game, room: Room | None, within: Room) -> list[str]:
    """What of it that row does not hold whole, all where there is none, as far as there is room."""
    clauses = _clauses(game)
    rest = clauses[_held(clauses, room.width) if room else 0 :]
    held = (n for n in range(len(rest), 1, -1) if _fits(rest[:n], within))
    return [_joined(rest[: next(held, 1)])] if rest else []


def _fits(clauses: Sequence[str], within: Room) -> bool:
    return len(worded([_joined(clauses)], within)) <= within.height


def _clauses(game: Game) -> list[str]:
    return [clean(clause) for clause in game.account.kept.goal(game.moment())]


def _joined(clauses: Sequence[str]) -> str:
    return "; ".join(clauses)


def _held(clauses: Sequence[str], width: int) -> int:
    """How many clauses a row holds."""
    many = range(len(clauses), 0, -1)
    return next((n for n in many if len(_joined(clauses[:n])) < width), 0)
