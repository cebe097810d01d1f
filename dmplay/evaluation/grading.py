"""Grading of transcripts: their verification, their regret, and remarks on how they were played.

The limits of the evidence are in GRADING_LIMITS.
"""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from dmplay.agents.base import AdviceQuestion
from dmplay.core.policy import Policy
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter, DmplayError
from dmplay.evaluation.assignment import Assignment
from dmplay.game.hints.ghost_agent import GHOST_NOTE_PREFIX
from dmplay.game.hints.review import ReviewedAction, review_actions, total_regret
from dmplay.game.seats import HUMAN, list_human_seats, list_judged_seats, list_scripts
from dmplay.game.transcript_verification import load_transcript_problem, verify
from dmplay.registry import agents
from dmplay.registry.problem_name_kinds import names_bot
from dmplay.transcript.concealment import RESUMABLE_END_REASONS, is_concealed
from dmplay.transcript.format import NATURAL_END_REASONS, REPEATED_UNIFORMS_PREFIX
from dmplay.transcript.reader import Transcript, read_transcript
from dmplay.transcript.replay import replay
from dmplay.transcript.verification_report import CHANGED_LINE_ENDS_REMARK, VerificationReport

# Values of one round of a repeated game ignore how the opponent reacts later.
ESTIMATED_REMARK = "estimated regret"
NO_REGRET_REMARK = "no regret, because the values are not exactly about this game"
REVIEW_WORK_LIMIT = 1e9  # to compute the regret of a game
AGENT_MATCH_WORK_LIMIT = 5e7  # to test whether one agent would have chosen the same actions
MIN_TURNS_TO_MATCH = 5  # Shorter games match too many agents.
GRADING_LIMITS = (
    "A verified game follows the rules: its actions and the random numbers of its seed give these "
    "results. The checksum has no key: it detects mistakes, not deliberate changes. No file proves "
    "who played, how many attempts they made, who helped them, or which turns they removed."
)
TRUST_NEEDS_ASSIGNMENT = (
    "--trust: add --assignment FILE; dmplay imports only the problem and the agents that the "
    "assignment names, and no other code that a transcript names"
)


class Grade(NamedTuple):
    """The grade of one game, from the seat of one player."""

    path: str
    verified: bool
    fault: str = ""  # first finding of the verification
    player: str = ""  # name that the person entered
    occupant: str = ""  # of the seat: a person, or the name of an agent
    problem: str = ""
    seat: str = ""
    seed: int | None = None  # None if the game can be resumed and its players may not know the seed
    turns: int = 0
    end_reason: str = ""
    discounted_return: float | None = None  # None if the game does not verify or is unfinished
    # total of all actions, by the hint provider; None if it knows no values or there is no return
    regret: float | None = None
    best_count: int = 0  # of the valued actions
    valued_count: int = 0
    undone_turn_count: int = 0  # turns
    reroll_count: int = 0  # turns
    hint_count: int = 0
    strict: bool | str = False
    peeked: bool = False
    remarks: tuple[str, ...] = ()  # other facts about the game
    identical_files: tuple[str, ...] = ()  # files with the same actions on the same uniforms
    # files of the same player with other actions on the same uniforms
    other_attempts: tuple[str, ...] = ()
    assignment_differences: tuple[str, ...] | None = None  # facts that differ from the assignment

    @property
    def is_finished(self) -> bool:
        """True if the game ended by itself: leaving a game early must not avoid its costs."""
        return self.end_reason in NATURAL_END_REASONS


class GradingReport(NamedTuple):
    """The grades of all files; `file_count` of them were graded, all unless interrupted."""

    grades: tuple[Grade, ...]
    file_count: int
    # assigned seeds without a verified, finished game, by player
    missing_seeds: dict[str, list[int]]


class _GradedGame(NamedTuple):
    """A grade, with the keys that identify its uniforms and its actions."""

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
    """Return a grade for each person in each file, else for each program, else for the first seat.

    If `trusted` is true, the assignment's own problem and agents are imported. Nothing else that a
    file names ever is. Raise BadParameter if it is true and there is no assignment.

    Ctrl-C ends it with the files graded so far, if there is one.
    """
    if trusted and assignment is None:
        raise BadParameter(TRUST_NEEDS_ASSIGNMENT)
    games: list[_GradedGame] = []
    unreviewable: set[tuple[object, ...]] = set()
    file_count = 0
    try:
        for file in files:
            games += _grade_file(file, assignment, unreviewable, trusted=trusted)
            file_count += 1
            progress(file_count / len(files))
    except KeyboardInterrupt:
        if not games:
            raise
    grades = tuple(_add_comparison(game, games) for game in games)
    return GradingReport(grades, file_count, _find_missing_seeds(games, assignment))


def _grade_file(
    file: Path,
    assignment: Assignment | None,
    unreviewable_games: set[tuple[object, ...]],
    *,
    trusted: bool,
) -> Iterator[_GradedGame]:
    """Yield the grades of one file, one for each person, program or first agent.

    The kind of game in which no action can be valued within the work limit is added to
    `unreviewable_games`.
    """
    try:
        transcript = read_transcript(file)
    except (DmplayError, OSError):
        fault = _describe_first_finding(verify(file))
        yield _GradedGame(Grade(str(file), verified=False, fault=fault), (), ())
        return
    header = transcript.header
    assigned_names = None if assignment is None else assignment.list_own_names(header, file)
    differences = None if assignment is None else (*assignment.list_differing_facts(header, file),)
    report = verify(file, trusted=trusted, assigned_names=assigned_names)
    fault = _describe_first_finding(report)
    try:
        lookup = load_transcript_problem(transcript, trusted=trusted, assigned_names=assigned_names)
        problem, session = lookup.problem, replay(transcript, lookup.problem)
    except DmplayError:
        unplayable = Grade(
            str(file), verified=False, fault=fault, player=header.player, problem=header.problem,
            assignment_differences=differences,
        )  # fmt: skip
        yield _GradedGame(unplayable, (), ())
        return
    names = [*header.seats.values()]
    variant = header.problem, str(sorted(header.parameters.items()))
    uniforms_key = (*variant, header.seed, header.episode)
    has_ended = transcript.end_block is not None
    is_seed_visible = has_ended or header.peeked or not list_human_seats(names)
    for seat in list_judged_seats(names):
        is_valid = report.is_ok and not is_concealed(transcript, problem)
        agent, seed = problem.agents[seat], header.seed if is_seed_visible else None
        end_reason = transcript.end_reason or "unfinished"
        grade = Grade(
            str(file), report.is_ok, fault, header.player, names[seat], header.problem, agent,
            seed, len(session.turns), end_reason,
            undone_turn_count=_count_retakes(transcript, "undo"),
            reroll_count=_count_retakes(transcript, "reroll"),
            hint_count=session.hint_counts[agent], strict=header.strict, peeked=header.peeked,
            remarks=(*_iter_play_remarks(transcript, report),), assignment_differences=differences,
        )  # fmt: skip
        if is_valid:
            question = AdviceQuestion.of_session(session, seat, names, list_scripts(session, names))
            question = replace(question, earlier_turns=header.turns_before_these_players)
            game_kind = (*variant, seat, *names)
            can_review = game_kind not in unreviewable_games
            grade = _add_regret(grade, session, question, can_review=can_review)
            is_unreviewable = grade.regret is None and NO_REGRET_REMARK not in grade.remarks
            if grade.is_finished and is_unreviewable:
                unreviewable_games.add(game_kind)
        turn_keys = [(turn.actions.tobytes(), turn.uniforms.tobytes()) for turn in session.turns]
        yield _GradedGame(grade, uniforms_key, (*variant, seat, *turn_keys))


def _describe_first_finding(report: VerificationReport) -> str:
    """Return the first finding of a report as text; '' if there is none."""
    return str(report.findings[0]) if report.findings else ""


def _count_retakes(transcript: Transcript, kind: str) -> int:
    """Return the number of turns that were undone, or rerolled, by the kind of transcript block."""
    values = [block[kind] for block in transcript.blocks if block.kind == kind]
    return sum(value if kind == "undo" and isinstance(value, int) else 1 for value in values)


def _iter_play_remarks(transcript: Transcript, report: VerificationReport) -> Iterator[str]:
    """Yield remarks on how a game was played, from its transcript and verification."""
    header = transcript.header
    if header.branched is not None:
        yield f"branched at turn {header.branched}"
    if header.reveal:
        yield "hidden state shown"
    if report.is_ok and transcript.end_reason in RESUMABLE_END_REASONS:
        yield "can be resumed"
    notes = dict.fromkeys(transcript.notes)
    for note in notes:
        if note.startswith(GHOST_NOTE_PREFIX):
            yield f"ghost {note.removeprefix(GHOST_NOTE_PREFIX)}"
    if any(note.startswith(REPEATED_UNIFORMS_PREFIX) for note in notes):
        yield "random numbers of an earlier game"
    unchecked = [player for player in report.unchecked_players if player != HUMAN]
    if unchecked:
        yield f"not recomputed: {', '.join(unchecked)}"
    if report.has_changed_line_ends:
        yield CHANGED_LINE_ENDS_REMARK
    if report.problem_change:
        yield report.problem_change


def _add_regret(
    grade: Grade, session: Session, question: AdviceQuestion, *, can_review: bool
) -> Grade:
    """Return a grade with the return of its actions and, if known, their regret.

    An unfinished game has neither: if rewards are costs, the shortest game would be the best.
    """
    seat = question.seat
    if grade.is_finished:
        grade = grade._replace(discounted_return=float(session.returns()[seat]))
    reviewed: list[ReviewedAction] = []
    with suppress(DmplayError), limit_total_work(REVIEW_WORK_LIMIT):
        if can_review and grade.is_finished:
            reviewed = [*review_actions(session, [question])]
    remarks = [*grade.remarks]
    if reviewed and any(move.regret is None for move in reviewed):
        remarks.append(NO_REGRET_REMARK)
    elif reviewed:
        judged = [move for move in reviewed if not move.is_too_close]
        best_count = sum(move.chosen in move.best for move in judged)
        grade = grade._replace(
            regret=total_regret(reviewed), best_count=best_count, valued_count=len(judged)
        )
        scopes = (move.basis.scope for move in reviewed)
        remarks += dict.fromkeys(f"regret ({scope})" for scope in scopes if scope)
        remarks += [ESTIMATED_REMARK] * any(move.is_estimated for move in reviewed)
    if seat in list_human_seats(question.players) or names_bot(question.players[seat]):
        remarks += [f"same actions as {name}" for name in _iter_matching_agents(session, seat)]
    return grade._replace(remarks=tuple(remarks))


def _iter_matching_agents(session: Session, seat: int) -> Iterator[str]:
    """Yield the names of the agents that would have chosen every action of a seat."""
    if len(session.turns) < MIN_TURNS_TO_MATCH:
        return
    for name, agent_class in agents.load_roster(session.problem, seat).agents.items():
        if agent_class.positional_parameter:  # stands for many agents
            continue
        with suppress(DmplayError), limit_total_work(AGENT_MATCH_WORK_LIMIT):
            policy = agents.load_agent(session.problem, seat, name)
            if _matches_all_actions(policy, session, seat):
                yield name


def _matches_all_actions(policy: Policy, session: Session, seat: int) -> bool:
    """Return whether a policy chooses every action of a seat, given the same uniforms."""
    replayed = session.copy_at_start()
    follower = SeatedPolicy(replayed, seat, policy)
    for turn in session.turns:
        if not replayed.is_inactive(seat) and follower.choose() != turn.actions[seat]:
            return False
        replayed.advance(list(turn.actions), turn.uniforms)
    return True


def _add_comparison(game: _GradedGame, others: Sequence[_GradedGame]) -> Grade:
    """Return the grade of a game, completed with the other files that share its uniforms."""
    if not game.grade.turns:
        return game.grade
    other_games = [other for other in others if other.grade.path != game.grade.path]
    identical, attempts = list[str](), list[str]()
    for other in other_games:
        if other.actions_key == game.actions_key:
            identical.append(other.grade.path)
    for other in other_games:
        is_same_player = game.grade.player and other.grade.player == game.grade.player
        is_attempt = is_same_player and other.uniforms_key == game.uniforms_key
        if is_attempt and other.grade.path not in identical:
            attempts.append(other.grade.path)
    return game.grade._replace(identical_files=tuple(identical), other_attempts=tuple(attempts))


def _find_missing_seeds(
    games: Sequence[_GradedGame], assignment: Assignment | None
) -> dict[str, list[int]]:
    """Return the seeds for which each player has no finished, verified game of the assignment."""
    if assignment is None:
        return {}
    seeds_by_player = defaultdict[str, set[int | None]](set)
    for grade in (game.grade for game in games if game.grade.player):
        is_valid = grade.verified and grade.is_finished and not grade.assignment_differences
        seeds_by_player[grade.player] |= {grade.seed} if is_valid else set()
    missing = {
        player: [seed for seed in assignment.seeds if seed not in played_seeds]
        for player, played_seeds in seeds_by_player.items()
    }
    return {player: seeds for player, seeds in missing.items() if seeds}
