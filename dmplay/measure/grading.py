"""What people hand in, graded: whether a game holds, how well it was played, and how honestly.

What can be seen is told; what cannot is said in `PROVES`.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from dmplay.advice.ghost import GHOST
from dmplay.advice.review import Move, moves
from dmplay.budget import within
from dmplay.core import Policy
from dmplay.errors import DmplayError
from dmplay.finding import agents
from dmplay.game.checking import check, loaded
from dmplay.game.game import AGAIN
from dmplay.game.seats import HUMAN, people
from dmplay.measure.assignment import Assignment
from dmplay.session import Follower, Session
from dmplay.transcript.reading import Transcript, read
from dmplay.transcript.replay import replay
from dmplay.transcript.report import Report
from dmplay.transcript.seal import LEFT, sealed

WORK = 1e9  # operations that may go into the regret of a game
GUESS = 5e7  # and into asking an agent whether it would have played so
TELLING = 5  # turns before that says anything
PROVES = (
    "A game that verifies can be played: these moves, by these rules, with the dice of this seed. "
    "The checksum has no key; it guards against slips, not against people. Who played, how often "
    "they tried, who whispered, and what was cut out before it was handed in, no file can prove."
)


class Grade(NamedTuple):
    """A game, from the seat of one who played it."""

    path: str
    verified: bool
    fault: str = ""  # the first that verifying found
    player: str = ""  # who says to be the person
    who: str = ""  # sat there: a person, or the name of an agent
    problem: str = ""
    seat: str = ""
    seed: int | None = None  # None where people can play on who may not know it
    turns: int = 0
    ending: str = ""
    returned: float | None = None  # None where the game does not hold, or can still be played on
    regret: float | None = None  # by the adviser, of all moves; None where nobody knows values
    best: int = 0  # of the moves that were valued
    valued: int = 0
    undo: int = 0  # turns taken back
    reroll: int = 0  # turns thrown again
    hints: int = 0
    strict: bool | str = False
    peeked: bool = False
    marks: tuple[str, ...] = ()  # what else is to be known
    same: tuple[str, ...] = ()  # files with the same moves under the same dice
    tries: tuple[str, ...] = ()  # other games of the same player under the same dice
    unlike: tuple[str, ...] | None = None  # how it is not what was assigned


class Graded(NamedTuple):
    """All that was handed in; `files` of it were looked at, all unless that was interrupted."""

    grades: tuple[Grade, ...]
    files: int
    missing: dict[str, list[int]]  # the seeds of which a player has no game that holds


class _Game(NamedTuple):
    """A grade, and by what its game is known again."""

    grade: Grade
    dice: tuple[object, ...]
    played: tuple[object, ...]


def graded(
    files: Sequence[Path],
    assignment: Assignment | None = None,
    *,
    trusted: bool = False,
    progress: Callable[[float], object] = lambda share: None,
) -> Graded:
    """A grade for each person in each file, or for the first seat where agents alone played.

    Ctrl-C ends it with what was graded so far, if anything was.
    """
    found: list[_Game] = []
    hopeless: set[tuple[object, ...]] = set()
    done = 0
    try:
        for file in files:
            found += _of(file, assignment, hopeless, trusted=trusted)
            done += 1
            progress(done / len(files))
    except KeyboardInterrupt:
        if not found:
            raise
    return Graded(tuple(_beside(one, found) for one in found), done, _missing(found, assignment))


def _of(
    file: Path, assignment: Assignment | None, hopeless: set[tuple[object, ...]], *, trusted: bool
) -> Iterator[_Game]:
    """The grades of one file; problems in which no move can be valued in a moment are noted."""
    report = check(file, trusted=trusted)
    fault = str(report.findings[0]) if report.findings else ""
    try:
        transcript = read(file)
        problem = loaded(transcript, trusted=trusted).problem
        session = replay(transcript, problem)
    except (DmplayError, OSError):
        yield _Game(Grade(str(file), verified=False, fault=fault), (), ())
        return
    header = transcript.header
    names = [*header.seats.values()]
    dice = header.problem, str(sorted(header.parameters.items())), header.seed, header.episode
    shown = transcript.end is not None or header.peeked or not people(names)
    for seat in people(names) or [0]:
        holds = report.ok and not sealed(transcript, problem)
        grade = Grade(
            str(file), report.ok, fault, header.player, names[seat], header.problem,
            problem.agents[seat], header.seed if shown else None, len(session.turns),
            transcript.reason or "unfinished", undo=_taken(transcript, "undo"),
            reroll=_taken(transcript, "reroll"), hints=session.help[problem.agents[seat]],
            strict=header.strict, peeked=header.peeked, marks=(*_marks(transcript, report),),
            unlike=None if assignment is None else (*assignment.differs(header, file),),
        )  # fmt: skip
        if holds:
            grade = _valued(grade, session, seat, names, known=dice[:2] not in hopeless)
            if grade.who == HUMAN and len(session.turns) and grade.regret is None:
                hopeless.add(dice[:2])
        turns = [(turn.actions.tobytes(), turn.draws.tobytes()) for turn in session.turns]
        yield _Game(grade, dice, (*dice[:2], seat, *turns))


def _taken(transcript: Transcript, kind: str) -> int:
    """How many turns were taken back, or thrown again."""
    many = [block[kind] for block in transcript.blocks if block.kind == kind]
    return sum(one if kind == "undo" and isinstance(one, int) else 1 for one in many)


def _marks(transcript: Transcript, report: Report) -> Iterator[str]:
    """What a file says of how its game was played."""
    header = transcript.header
    if header.branched is not None:
        yield f"branched at turn {header.branched}"
    if header.reveal:
        yield "hidden state shown"
    if report.ok and transcript.reason in LEFT:
        yield "can be played on"
    notes = dict.fromkeys(transcript.notes)
    yield from (f"ghost {row.removeprefix(GHOST)}" for row in notes if row.startswith(GHOST))
    if AGAIN in notes:
        yield "dice that were played before"
    unasked = [who for who in report.unasked if who != HUMAN]
    if unasked:
        yield f"not re-asked: {', '.join(unasked)}"
    if report.altered:
        yield report.altered


def _valued(
    grade: Grade, session: Session, seat: int, names: Sequence[str], *, known: bool
) -> Grade:
    """A grade with what its moves earned, and what the adviser thinks of them where it can."""
    grade = grade._replace(returned=float(session.returns()[seat]))
    if names[seat] != HUMAN:
        return grade
    made: list[Move] = []
    with suppress(DmplayError), within(WORK):
        made = [*moves(session, [seat], names)] if known else []
    like = [*_like(session, seat)]
    return grade._replace(
        regret=sum(move.regret for move in made) if made else None,
        best=sum(move.chosen in move.best for move in made),
        valued=len(made),
        marks=(*grade.marks, *(f"as {name} plays" for name in like)),
    )


def _like(session: Session, seat: int) -> Iterator[str]:
    """The agents that would have made every move of a seat, the same luck given."""
    if len(session.turns) < TELLING:
        return
    for name, make in agents.roster(session.problem, seat).agents.items():
        if make.unnamed:  # one of many
            continue
        with suppress(DmplayError), within(GUESS):
            policy = agents.agent(session.problem, seat, name)
            if _plays(policy, session, seat):
                yield name


def _plays(policy: Policy, session: Session, seat: int) -> bool:
    past = session.anew()
    follower = Follower(past, seat, policy)
    for turn in session.turns:
        if not past.waits(seat) and follower.choose() != turn.actions[seat]:
            return False
        past.advance(list(turn.actions), turn.draws)
    return True


def _beside(one: _Game, others: Sequence[_Game]) -> Grade:
    """A grade with what only the other files show."""
    if not one.grade.turns:
        return one.grade
    known = [other for other in others if other.grade.path != one.grade.path]
    same = [other.grade.path for other in known if other.played == one.played]
    again = [
        other.grade.path
        for other in known
        if (other.dice, other.grade.player) == (one.dice, one.grade.player)
        and one.grade.player
        and other.grade.path not in same
    ]
    return one.grade._replace(same=tuple(same), tries=tuple(again))


def _missing(found: Sequence[_Game], assignment: Assignment | None) -> dict[str, list[int]]:
    """The seeds of which a player has no game that holds and was assigned."""
    if assignment is None:
        return {}
    played = defaultdict[str, set[int | None]](set)
    for one in (game.grade for game in found if game.grade.player):
        played[one.player] |= {one.seed} if one.verified and not one.unlike else set()
    left = {who: [s for s in assignment.seeds if s not in had] for who, had in played.items()}
    return {who: seeds for who, seeds in left.items() if seeds}
