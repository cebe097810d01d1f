"""The first rows of the screen: the game and how it stands, what to aim for and what it costs."""

from collections.abc import Iterator, Sequence
from functools import lru_cache

from dmplay.describe import brief, ended, score
from dmplay.game.game import Game
from dmplay.screen.shown import Room
from dmplay.screen.wrapping import wrapped
from dmplay.session import MOST_TURNS
from dmplay.styles import Line
from dmplay.terminal import clean
from dmplay.views.kept import Moment

BETWEEN = "; "  # clauses
ENDLESS = (None, MOST_TURNS)  # limits that are not told


def title(game: Game, now: Moment, room: Room) -> Line:
    """The game and how it stands; closer together and without the seed where there is no room."""
    end = now.ending and ("over" if now.ending == "terminal" else ended(now.ending))
    first, told, last = "", "", ""
    for first, gap, facts in _forms(game, now):
        told, last = gap[1:] + gap.join(facts), gap + end if end else ""
        if len(first) + len(told) + len(last) <= room.width:
            break
    row = (first, "bold"), (told, "")
    return (*row, (last, "bold")) if last else row


def _forms(game: Game, now: Moment) -> Iterator[tuple[str, str, Sequence[str]]]:
    """What is played, the blanks between the facts, and these; each form needs less room."""
    seed = [f"seed {game.seed}"] if game.shows_seed else []
    facts = _facts(game, now, score(game.problem))
    yield _called(game), "   ", [*seed, *facts]
    close = f" {clean(game.name)} "
    yield close, "  ", facts
    facts = _facts(game, now, "score")
    for many in range(len(facts), -1, -1):  # a fact is told whole or not at all
        yield close, "  ", facts[:many]


def _facts(game: Game, now: Moment, called: str) -> list[str]:
    """Turn, score, who you are, and who the others are."""
    limit = game.session.limit
    facts = [f"turn {now.turn}" if limit in ENDLESS else f"turn {now.turn}/{limit}"]
    if now.paid:
        facts.append(f"{called} {brief(game.account.returned(now))}")
    you = game.watcher if game.people else None
    facts += _seated(tuple(game.problem.agents), game.seats, you)
    return facts


@lru_cache(16)  # who changes seldom
def _seated(agents: Sequence[str], seats: Sequence[str], you: int | None) -> tuple[str, ...]:
    own = () if you is None else (f"you: {agents[you]}",)
    others = enumerate(zip(agents, seats, strict=True))
    return (*own, *(f"{agent}: {clean(who)}" for seat, (agent, who) in others if seat != you))


def name(game: Game) -> Line:
    """What is played."""
    return ((_called(game), "bold"),)


def _called(game: Game) -> str:
    return f" dmplay {clean(game.name)}  "


def goal(game: Game, now: Moment, room: Room) -> Line:
    """What to aim for and what it costs, as many clauses as one row holds; one at least."""
    return game.account.kept.answer("aim", now, lambda now: _row(game, now, room), (room.width,))


def _row(game: Game, now: Moment, room: Room) -> Line:
    clauses = _clauses(game, now)
    return f" {BETWEEN.join(clauses[: max(_held(clauses, room.width), 1)])}"


def more(game: Game, now: Moment, room: Room | None, within: Room) -> list[str]:
    """What of it that row does not hold whole, all where there is none, as far as there is room."""
    clauses = _clauses(game, now)
    rest = clauses[_held(clauses, room.width) if room else 0 :]
    forms = [BETWEEN.join(rest[:many]) for many in range(len(rest), 0, -1)]
    fitting = (form for form in forms if len(wrapped([form], within)) <= within.height)
    return [next(fitting, forms[-1])] if forms else []


def _clauses(game: Game, now: Moment) -> list[str]:
    return [clean(clause) for clause in game.account.kept.goal(now)]


def _held(clauses: Sequence[str], width: int) -> int:
    """How many clauses a row holds."""
    many = range(len(clauses), 0, -1)
    return next((n for n in many if len(BETWEEN.join(clauses[:n])) < width), 0)
