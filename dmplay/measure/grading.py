"""What people hand in, graded: whether a game holds, how well it was played, and how honestly.

What can be seen is told; what cannot is said in `PROVES`.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from dmplay.advice.ghost import GHOST_NOTE_PREFIX
from dmplay.advice.review import ReviewedAction, review_actions
from dmplay.budget import limit_total_work
from dmplay.core import Policy
from dmplay.errors import DmplayError
from dmplay.finding import agents
from dmplay.game.checking import load_transcript_problem, verify_file
from dmplay.game.game import REPEATED_UNIFORMS_NOTE
from dmplay.game.seats import HUMAN, list_human_seats
from dmplay.measure.assignment import Assignment
from dmplay.session import SeatedPolicy, Session
from dmplay.transcript.reading import Transcript, read_transcript
from dmplay.transcript.replay import replay
from dmplay.transcript.report import VerificationReport
from dmplay.transcript.seal import RESUMABLE_END_REASONS, is_concealed

REVIEW_WORK_LIMIT = 1e9  # operations that may go into the regret of a game
AGENT_MATCH_WORK_LIMIT = 5e7  # and into asking an agent whether it would have played so
MIN_TURNS_TO_MATCH = 5  # turns before that says anything
GRADING_LIMITS = (
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
    occupant: str = ""  # sat there: a person, or the name of an agent
    problem: str = ""
    seat: str = ""
    seed: int | None = None  # None where people can play on who may not know it
    turns: int = 0
    end_reason: str = ""
    discounted_return: float | None = (
        None  # None where the game does not hold, or can still be played on
    )
    regret: float | None = None  # by the adviser, of all moves; None where nobody knows values
    best_count: int = 0  # of the moves that were valued
    valued_count: int = 0
    undone_turn_count: int = 0  # turns taken back
    reroll_count: int = 0  # turns thrown again
    hint_count: int = 0
    strict: bool | str = False
    peeked: bool = False
    remarks: tuple[str, ...] = ()  # what else is to be known
    identical_files: tuple[str, ...] = ()  # files with the same moves under the same dice
    other_attempts: tuple[str, ...] = ()  # other games of the same player under the same dice
    assignment_differences: tuple[str, ...] | None = None  # how it is not what was assigned


class GradingReport(NamedTuple):
    """All that was handed in; `files` of it were looked at, all unless that was interrupted."""

    grades: tuple[Grade, ...]
    file_count: int
    missing_seeds: dict[str, list[int]]  # the seeds of which a player has no game that holds


class _GradedGame(NamedTuple):
    """A grade, and by what its game is known again."""

    grade: Grade
    uniforms_key: tuple[object, ...]
    actions_key: tuple[object, ...]


def grade_files(
    files: Sequence[Path],
    assignment: Assignment | None = None,
    *,
    trusted: bool = False,
    progress: Callable[[float], object] = lambda share: None,
) -> GradingReport:
    """A grade for each person in each file, or for the first seat where agents alone played.

    Ctrl-C ends it with what was graded so far, if anything was.
    """
    found: list[_GradedGame] = []
    hopeless: set[tuple[object, ...]] = set()
    done = 0
    try:
        for file in files:
            found += _grade_file(file, assignment, hopeless, trusted=trusted)
            done += 1
            progress(done / len(files))
    except KeyboardInterrupt:
        if not found:
            raise
    return GradingReport(
        tuple(_compare_with_others(one, found) for one in found),
        done,
        _find_missing_seeds(found, assignment),
    )


def _grade_file(
    file: Path,
    assignment: Assignment | None,
    unreviewable_problems: set[tuple[object, ...]],
    *,
    trusted: bool,
) -> Iterator[_GradedGame]:
    """The grades of one file; problems in which no move can be valued in a moment are noted."""
    report = verify_file(file, trusted=trusted)
    fault = str(report.findings[0]) if report.findings else ""
    try:
        transcript = read_transcript(file)
        problem = load_transcript_problem(transcript, trusted=trusted).problem
        session = replay(transcript, problem)
    except (DmplayError, OSError):
        yield _GradedGame(Grade(str(file), verified=False, fault=fault), (), ())
        return
    header = transcript.header
    names = [*header.seats.values()]
    dice = header.problem, str(sorted(header.parameters.items())), header.seed, header.episode
    shown = transcript.end_block is not None or header.peeked or not list_human_seats(names)
    for seat in list_human_seats(names) or [0]:
        holds = report.is_ok and not is_concealed(transcript, problem)
        grade = Grade(
            str(file), report.is_ok, fault, header.player, names[seat], header.problem,
            problem.agents[seat], header.seed if shown else None, len(session.turns),
            transcript.end_reason or "unfinished", undone_turn_count=_count_retakes(transcript, "undo"),
            reroll_count=_count_retakes(transcript, "reroll"), hint_count=session.hint_counts[problem.agents[seat]],
            strict=header.strict, peeked=header.peeked, remarks=(*_iter_remarks(transcript, report),),
            assignment_differences=None if assignment is None else (*assignment.find_differences(header, file),),
        )  # fmt: skip
        if holds:
            grade = _add_regret(
                grade, session, seat, names, can_review=dice[:2] not in unreviewable_problems
            )
            if grade.occupant == HUMAN and len(session.turns) and grade.regret is None:
                unreviewable_problems.add(dice[:2])
        turns = [(turn.actions.tobytes(), turn.uniforms.tobytes()) for turn in session.turns]
        yield _GradedGame(grade, dice, (*dice[:2], seat, *turns))


def _count_retakes(transcript: Transcript, kind: str) -> int:
    """How many turns were taken back, or thrown again."""
    many = [block[kind] for block in transcript.blocks if block.kind == kind]
    return sum(one if kind == "undo" and isinstance(one, int) else 1 for one in many)


def _iter_remarks(transcript: Transcript, report: VerificationReport) -> Iterator[str]:
    """What a file says of how its game was played."""
    header = transcript.header
    if header.branched is not None:
        yield f"branched at turn {header.branched}"
    if header.reveal:
        yield "hidden state shown"
    if report.is_ok and transcript.end_reason in RESUMABLE_END_REASONS:
        yield "can be played on"
    notes = dict.fromkeys(transcript.notes)
    yield from (
        f"ghost {row.removeprefix(GHOST_NOTE_PREFIX)}"
        for row in notes
        if row.startswith(GHOST_NOTE_PREFIX)
    )
    if REPEATED_UNIFORMS_NOTE in notes:
        yield "dice that were played before"
    unasked = [who for who in report.unchecked_players if who != HUMAN]
    if unasked:
        yield f"not re-asked: {', '.join(unasked)}"
    if report.problem_change:
        yield report.problem_change


def _add_regret(
    grade: Grade, session: Session, seat: int, names: Sequence[str], *, can_review: bool
) -> Grade:
    """A grade with what its moves earned, and what the adviser thinks of them where it can."""
    grade = grade._replace(discounted_return=float(session.returns()[seat]))
    if names[seat] != HUMAN:
        return grade
    made: list[ReviewedAction] = []
    with suppress(DmplayError), limit_total_work(REVIEW_WORK_LIMIT):
        made = [*review_actions(session, [seat], names)] if can_review else []
    like = [*_iter_matching_agents(session, seat)]
    return grade._replace(
        regret=sum(move.regret for move in made) if made else None,
        best_count=sum(move.chosen in move.best for move in made),
        valued_count=len(made),
        remarks=(*grade.remarks, *(f"as {name} plays" for name in like)),
    )


def _iter_matching_agents(session: Session, seat: int) -> Iterator[str]:
    """The agents that would have made every move of a seat, the same luck given."""
    if len(session.turns) < MIN_TURNS_TO_MATCH:
        return
    for name, make in agents.load_roster(session.problem, seat).agents.items():
        if make.positional_parameter:  # one of many
            continue
        with suppress(DmplayError), limit_total_work(AGENT_MATCH_WORK_LIMIT):
            policy = agents.load_agent(session.problem, seat, name)
            if _matches_all_actions(policy, session, seat):
                yield name


def _matches_all_actions(policy: Policy, session: Session, seat: int) -> bool:
    past = session.copy_at_start()
    follower = SeatedPolicy(past, seat, policy)
    for turn in session.turns:
        if not past.is_inactive(seat) and follower.choose() != turn.actions[seat]:
            return False
        past.advance(list(turn.actions), turn.uniforms)
    return True


def _compare_with_others(game: _GradedGame, others: Sequence[_GradedGame]) -> Grade:
    """A grade with what only the other files show."""
    if not game.grade.turns:
        return game.grade
    known = [other for other in others if other.grade.path != game.grade.path]
    same = [other.grade.path for other in known if other.actions_key == game.actions_key]
    again = [
        other.grade.path
        for other in known
        if (other.uniforms_key, other.grade.player) == (game.uniforms_key, game.grade.player)
        and game.grade.player
        and other.grade.path not in same
    ]
    return game.grade._replace(identical_files=tuple(same), other_attempts=tuple(again))


def _find_missing_seeds(
    games: Sequence[_GradedGame], assignment: Assignment | None
) -> dict[str, list[int]]:
    """The seeds of which a player has no game that holds and was assigned."""
    if assignment is None:
        return {}
    played = defaultdict[str, set[int | None]](set)
    for one in (game.grade for game in games if game.grade.player):
        played[one.player] |= (
            {one.seed} if one.verified and not one.assignment_differences else set()
        )
    left = {who: [s for s in assignment.seeds if s not in had] for who, had in played.items()}
    return {who: seeds for who, seeds in left.items() if seeds}
