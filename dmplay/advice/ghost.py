"""An agent that plays a person's dice, in a game of its own beside that one."""

from collections.abc import Mapping, Sequence

import numpy as np

from dmplay.budget import Budget
from dmplay.core import Policy, Problem
from dmplay.dice import NATURE, Dice
from dmplay.errors import BadParameter, DmplayError
from dmplay.finding import agents
from dmplay.session import MOST_TURNS, Session
from dmplay.terminal import clean
from dmplay.thought import About, think

GHOST = "# ghost: "  # begins its note


class Ghost:
    """An agent on the same dice and against the same others, in the seats of the people."""

    def __init__(self, name: str, beside: Session, policies: Mapping[int, Policy]) -> None:
        self.name = name
        self.seat = min(policies)
        self.beside = beside
        others = {seat: one.policy for seat, one in enumerate(beside.followers) if one}
        sits = {**others, **policies}
        self.session = beside.anew([*map(sits.get, range(len(beside.followers)))])

    @property
    def early(self) -> bool:
        """Whether it may be seen before the end: what it does tells nothing that is secret."""
        problem = self.beside.problem
        return not problem.hidden and len(problem.agents) == 1

    def follow(self) -> None:
        """Comes to the turn of the person, under the dice that were thrown there."""
        own, theirs = self.session.turns, self.beside.turns
        while own and not self._level(len(own)):
            self.session.undo()
        while len(own) < len(theirs) and not self.session.over:
            self._play(len(own) + 1)

    def finish(self) -> None:
        """Comes to the end of its own game, be that sooner or later than the person's."""
        self.follow()
        while len(self.session.turns) < MOST_TURNS and not self.session.over:
            self._play(len(self.session.turns) + 1)

    def _level(self, turn: int) -> bool:
        """Whether the person played this turn too, under these dice."""
        theirs = self.beside.turns[turn - 1 : turn]
        return bool(theirs) and np.array_equal(theirs[0].draws, self.session.turns[turn - 1].draws)

    def _play(self, turn: int) -> None:
        most = self.session.limit or MOST_TURNS
        Budget("the same dice", "a shorter game").spend(1.0, turn / most)
        theirs = self.beside.turns[turn - 1 : turn]
        self.session.advance((), theirs[0].draws if theirs else None)

    @property
    def score(self) -> float:
        """Its return so far."""
        return float(self.session.returns()[self.seat])

    @property
    def lead(self) -> float:
        """By how much the person is ahead of it."""
        return float(self.beside.returns()[self.seat]) - self.score

    @property
    def note(self) -> str:
        """The line of a transcript that names it."""
        return f"{GHOST}{' '.join(clean(self.name).split())}"

    def compared(self) -> str:
        """What each of both came to."""
        yours = float(self.beside.returns()[self.seat])
        return f"{self.name} on the same dice: {self.score:.6g}; you {yours:.6g}"


def beside(session: Session, who: Sequence[int], name: str) -> Ghost:
    """The agent of this name beside these people; raises BadParameter where it cannot be."""
    if not who:
        raise BadParameter("--ghost: it plays beside a person, and here agents play alone")
    if not _together(session.problem, who):
        raise BadParameter("--ghost: it plays beside one person, and here several play")
    known = agents.roster(session.problem).agents
    if name.partition(":")[0] not in known and not agents.is_brought(session.problem, 0, name):
        raise BadParameter(f"--ghost: got {name!r}, expected one of {', '.join(known)}")
    return Ghost(name, session, {seat: agents.agent(session.problem, seat, name) for seat in who})


def noted(notes: Sequence[str], problem: Problem) -> str:
    """The last ghost that these notes name, if the problem has it; nobody else's code."""
    named = [row.removeprefix(GHOST) for row in notes if row.startswith(GHOST)]
    known = agents.roster(problem).agents
    return named[-1] if named and named[-1].partition(":")[0] in known else ""


def best(session: Session, who: Sequence[int], seats: Sequence[str]) -> Ghost | None:
    """The best agent that is known in place of these people, once the game is over.

    None where there is none, where people play against each other, and where the draws are not
    those of the seed.
    """
    if not (_together(session.problem, who) and _of_the_seed(session)):
        return None
    found = {seat: agents.adviser(session.problem, seat, session.limit, seats) for seat in who}
    known = {seat: one[1] for seat, one in found.items() if one}
    first = found[min(who)]
    return Ghost(first[0], session, known) if first and len(known) == len(who) else None


def _together(problem: Problem, who: Sequence[int]) -> bool:
    """Whether these people want the same."""
    return len(who) == 1 or problem.shared_reward


def _of_the_seed(session: Session) -> bool:
    """Whether all that nature drew is what the dice give."""
    if not isinstance(session.source, Dice):
        return False
    draws = session.problem.draws
    drawn = [session.opening, *(turn.draws for turn in session.turns)]
    counts = [draws.start, *[draws.step] * len(session.turns)]
    return all(
        np.array_equal(known, session.source.draw(NATURE, turn, 0, count)[0])
        for turn, (known, count) in enumerate(zip(drawn, counts, strict=True))
    )


def same_dice(
    session: Session, who: Sequence[int], seats: Sequence[str], ghost: Ghost | None
) -> str:
    """What the ghost, or else the best agent, makes of the dice of a game that is over.

    Nothing where nobody can say.
    """
    try:
        found = ghost or best(session, who, seats)
        if found is None:
            return ""
        think(About(f"{found.name} plays the same dice"), found.finish)
    except DmplayError:
        return ""
    return found.compared()
