"""The first rows of the screen: the game and how it stands, what to aim for and what it costs."""

from collections.abc import Sequence
from functools import lru_cache

from rich.text import Text

from dmplay.describe import brief, ended, score
from dmplay.game.game import Game
from dmplay.screen.shown import Room
from dmplay.screen.wrapping import worded
from dmplay.session import MOST_TURNS
from dmplay.terminal import clean


def title(game: Game, room: Room) -> Text:
    """The game and how it stands; closer together and without the seed where there is no room."""
    seed = [f"seed {game.seed}"] if game.shows_seed else []
    facts = _facts(game, score(game.problem))
    row = _headed(game, name(game), "   ", [*seed, *facts])
    if len(row.plain) <= room.width:
        return row
    close = Text(f" {clean(game.name)} ", style="bold")
    row = _headed(game, close.copy(), "  ", facts)
    if len(row.plain) <= room.width:
        return row
    facts = _facts(game, "score")
    while True:  # a fact is told whole or not at all
        row = _headed(game, close.copy(), "  ", facts)
        if len(row.plain) <= room.width or not facts:
            return row
        facts = facts[:-1]


def _headed(game: Game, first: Text, gap: str, facts: Sequence[str]) -> Text:
    row = first.append(gap[1:] + gap.join(facts), style="not bold")
    if game.session.over:
        why = ended(game.session.ending)
        row.append(f"{gap}{'over' if why == 'terminal' else why}", style="bold")
    return row


def _facts(game: Game, called: str) -> list[str]:
    """Turn, score, who you are, and who the others are."""
    now = game.moment()
    limit = f"/{game.session.limit}" if game.session.limit not in (None, MOST_TURNS) else ""
    facts = [f"turn {now.turn}{limit}"]
    if now.paid:
        facts.append(f"{called} {brief(game.account.returned(now))}")
    if game.people:
        facts.append(f"you: {game.problem.agents[game.watcher]}")
    seats = enumerate(zip(game.problem.agents, game.seats, strict=True))
    you = game.watcher if game.people else None
    return [*facts, *(f"{agent}: {clean(who)}" for seat, (agent, who) in seats if seat != you)]


def name(game: Game) -> Text:
    """What is played."""
    return Text(f" dmplay {clean(game.name)}  ", style="bold")


def goal(game: Game, room: Room) -> Text:
    """What to aim for and what it costs, as many clauses as one row holds; one at least."""
    return _row(f" {_joined(_clauses(game)[: max(_held(game, room), 1)])}")


_row = lru_cache(16)(Text)  # which comes again


def more(game: Game, room: Room | None, within: Room) -> list[str]:
    """What of it that row does not hold whole, all where there is none, as far as there is room."""
    rest = _clauses(game)[_held(game, room) if room else 0 :]
    held = (n for n in range(len(rest), 1, -1) if _fits(rest[:n], within))
    return [_joined(rest[: next(held, 1)])] if rest else []


def _fits(clauses: Sequence[str], within: Room) -> bool:
    return len(worded([_joined(clauses)], within)) <= within.height


def _clauses(game: Game) -> list[str]:
    return [clean(clause) for clause in game.account.kept.goal(game.moment())]


def _joined(clauses: Sequence[str]) -> str:
    return "; ".join(clauses)


def _held(game: Game, room: Room) -> int:
    """How many clauses a row holds."""
    clauses = _clauses(game)
    many = range(len(clauses), 0, -1)
    return next((n for n in many if len(_joined(clauses[:n])) < room.width), 0)
