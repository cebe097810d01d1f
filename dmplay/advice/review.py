"""Looking back at a person's moves: what each action was worth, the best, and the regret."""

from collections.abc import Iterator, Sequence
from math import ceil
from typing import NamedTuple

import numpy as np

from dmplay.advice.adviser import decimals, fixed
from dmplay.budget import Budget, part
from dmplay.chance import Reals
from dmplay.describe import aligned, counted
from dmplay.finding import agents
from dmplay.session import Follower, Session
from dmplay.solvers.value_iteration import best
from dmplay.thought import About, think

MARK = "# review "
LONGEST = 20  # columns of a bar of regret
LOOKING = About("looking back at your moves")


class Move(NamedTuple):
    """One move of a person, valued."""

    turn: int
    seat: str
    chosen: str
    best: tuple[str, ...]
    regret: float
    values: dict[str, float]

    def __str__(self) -> str:
        """One line."""
        told = f"turn {self.turn}, {self.seat}: chose {self.chosen}"
        places = decimals([*self.values.values()])
        each = ", ".join(f"{name} {fixed(value, places)}" for name, value in self.values.items())
        if self.chosen in self.best:
            return f"{told}, the best. values: {each}"
        names = " or ".join(self.best)
        return f"{told}, best {names}, regret {fixed(self.regret, places)}. values: {each}"


def moves(session: Session, who: Sequence[int], seats: Sequence[str] = ()) -> Iterator[Move]:
    """Every move of these people that the adviser can value, in order; `seats` says who plays."""
    problem = session.problem
    past = session.anew()
    advisers = {}
    for seat in who:
        found = agents.adviser(problem, seat, session.limit, seats)
        if found and problem.actions[seat].labels:
            advisers[seat] = Follower(past, seat, found[1])
    budget = Budget("the review", "a shorter game")
    for number, turn in enumerate(session.turns, 1):
        budget.spend(1.0, (number - 1) / len(session.turns))
        for seat, adviser in advisers.items():
            with part(number - 1, len(session.turns)):
                values = adviser.values()
            if values is not None and not past.waits(seat):
                yield _move(past, seat, number, int(turn.actions[seat]), values)
        past.repeat([turn])


def _move(past: Session, seat: int, turn: int, action: int, values: Reals) -> Move:
    """A move valued against the best that was open."""
    labels = past.labels(seat)
    legal = past.legal(seat)
    able = np.ones(len(labels), bool) if legal is None else legal
    known = np.where(able, values, -np.inf)
    top = tuple(labels[a] for a in np.flatnonzero(best(known)))
    each = {labels[a]: float(known[a]) for a in np.flatnonzero(able)}
    regret = 0.0 if labels[action] in top else float(known.max() - known[action])
    return Move(turn, past.problem.agents[seat], labels[action], top, regret, each)


def summary(made: list[Move]) -> str:
    """How many moves were the best, and what the others lost."""
    if not made:
        return "review: no agent here knows the values of these moves"
    right = sum(move.chosen in move.best for move in made)
    lost = sum(move.regret for move in made)
    worst = max(made, key=lambda move: move.regret)
    total = fixed(lost, decimals([lost]))
    told = f"review: {right} of {counted(len(made), 'move')} the best, regret {total} in all"
    return told if right == len(made) else f"{told}, most in turn {worst.turn}"


def of(session: Session, who: Sequence[int], seats: Sequence[str]) -> list[Move]:
    """The moves of these people, for whom it may take long."""
    return think(LOOKING, lambda: [*moves(session, who, seats)])


def table(made: list[Move]) -> list[str]:
    """The review as columns: turn, choice, best and regret, the worst first; and its sum."""
    most = max((move.regret for move in made), default=0.0)
    places = decimals([move.regret for move in made])
    seats = len({move.seat for move in made}) > 1
    rows = [["turn", *["seat"] * seats, "yours", "best", "regret"]]
    for move in sorted(made, key=lambda move: -move.regret):
        bar = "#" * ceil(LONGEST * (move.regret / most)) if move.regret else ""
        regret = f"{fixed(move.regret, places)} {bar}".strip()
        seat = [move.seat] * seats
        best = "any" if len(move.best) == len(move.values) else " or ".join(move.best)
        rows.append([str(move.turn), *seat, move.chosen, best, regret])
    return [*(aligned(rows) if made else []), summary(made)]


def lines(made: list[Move]) -> list[str]:
    """The review, a line a move, and its sum."""
    return [*map(str, made), summary(made)]


def notes(made: list[Move]) -> list[str]:
    """The review as notes for the end of a transcript."""
    return [f"{MARK}{line.removeprefix('review: ')}\n" for line in lines(made)]
