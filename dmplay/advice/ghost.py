"""An agent that plays a person's dice, in a game of its own beside that one."""

from collections.abc import Mapping, Sequence

import numpy as np

from dmplay.budget import Budget
from dmplay.core import Policy, Problem
from dmplay.dice import NATURE_STREAM, SeededUniforms
from dmplay.errors import BadParameter, DmplayError
from dmplay.finding import agents
from dmplay.session import DEFAULT_TURN_LIMIT, Session
from dmplay.terminal import escape_unprintable
from dmplay.thought import TaskInfo, run_cancellable

GHOST_NOTE_PREFIX = "# ghost: "  # begins its note


class Ghost:
    """An agent on the same dice and against the same others, in the seats of the people."""

    def __init__(self, name: str, player_session: Session, policies: Mapping[int, Policy]) -> None:
        self.name = name
        self.seat = min(policies)
        self.player_session = player_session
        others = {
            seat: one.policy for seat, one in enumerate(player_session.seated_policies) if one
        }
        sits = {**others, **policies}
        self.session = player_session.copy_at_start(
            [*map(sits.get, range(len(player_session.seated_policies)))]
        )

    @property
    def is_shown_during_play(self) -> bool:
        """Whether it may be seen before the end: what it does tells nothing that is secret."""
        problem = self.player_session.problem
        return not problem.partially_observable and len(problem.agents) == 1

    def catch_up(self) -> None:
        """Comes to the turn of the person, under the dice that were thrown there."""
        own, theirs = self.session.turns, self.player_session.turns
        while own and not self._matches_turn(len(own)):
            self.session.undo()
        while len(own) < len(theirs) and not self.session.over:
            self._play_turn(len(own) + 1)

    def play_to_end(self) -> None:
        """Comes to the end of its own game, be that sooner or later than the person's."""
        self.catch_up()
        while len(self.session.turns) < DEFAULT_TURN_LIMIT and not self.session.over:
            self._play_turn(len(self.session.turns) + 1)

    def _matches_turn(self, turn: int) -> bool:
        """Whether the person played this turn too, under these dice."""
        theirs = self.player_session.turns[turn - 1 : turn]
        return bool(theirs) and np.array_equal(
            theirs[0].uniforms, self.session.turns[turn - 1].uniforms
        )

    def _play_turn(self, turn: int) -> None:
        most = self.session.turn_limit or DEFAULT_TURN_LIMIT
        Budget("the same dice", "a shorter game").spend_work(1.0, turn / most)
        theirs = self.player_session.turns[turn - 1 : turn]
        self.session.advance((), theirs[0].uniforms if theirs else None)

    @property
    def score(self) -> float:
        """Its return so far."""
        return float(self.session.returns()[self.seat])

    @property
    def player_lead(self) -> float:
        """By how much the person is ahead of it."""
        return float(self.player_session.returns()[self.seat]) - self.score

    @property
    def transcript_note(self) -> str:
        """The line of a transcript that names it."""
        return f"{GHOST_NOTE_PREFIX}{' '.join(escape_unprintable(self.name).split())}"

    def describe_comparison(self) -> str:
        """What each of both came to."""
        yours = float(self.player_session.returns()[self.seat])
        return f"{self.name} on the same dice: {self.score:.6g}; you {yours:.6g}"


def create_ghost(session: Session, human_seats: Sequence[int], name: str) -> Ghost:
    """The agent of this name beside these people; raises BadParameter where it cannot be."""
    if not human_seats:
        raise BadParameter("--ghost: it plays beside a person, and here agents play alone")
    if not _have_common_reward(session.problem, human_seats):
        raise BadParameter("--ghost: it plays beside one person, and here several play")
    known = agents.load_roster(session.problem).agents
    if name.partition(":")[0] not in known and not agents.names_user_code(session.problem, 0, name):
        raise BadParameter(f"--ghost: got {name!r}, expected one of {', '.join(known)}")
    return Ghost(
        name,
        session,
        {seat: agents.load_agent(session.problem, seat, name) for seat in human_seats},
    )


def find_ghost_name(notes: Sequence[str], problem: Problem) -> str:
    """The last ghost that these notes name, if the problem has it; nobody else's code."""
    named = [
        row.removeprefix(GHOST_NOTE_PREFIX) for row in notes if row.startswith(GHOST_NOTE_PREFIX)
    ]
    known = agents.load_roster(problem).agents
    return named[-1] if named and named[-1].partition(":")[0] in known else ""


def create_best_ghost(
    session: Session, human_seats: Sequence[int], player_names: Sequence[str]
) -> Ghost | None:
    """The best agent that is known in place of these people, once the game is over.

    None where there is none, where people play against each other, and where the draws are not
    those of the seed.
    """
    if not (_have_common_reward(session.problem, human_seats) and _uses_seed_uniforms(session)):
        return None
    found = {
        seat: agents.find_hint_provider(session.problem, seat, session.turn_limit, player_names)
        for seat in human_seats
    }
    known = {seat: one[1] for seat, one in found.items() if one}
    first = found[min(human_seats)]
    return Ghost(first[0], session, known) if first and len(known) == len(human_seats) else None


def _have_common_reward(problem: Problem, human_seats: Sequence[int]) -> bool:
    """Whether these people want the same."""
    return len(human_seats) == 1 or problem.shared_reward


def _uses_seed_uniforms(session: Session) -> bool:
    """Whether all that nature drew is what the dice give."""
    if not isinstance(session.uniform_source, SeededUniforms):
        return False
    draws = session.problem.uniform_counts
    drawn = [session.initial_uniforms, *(turn.uniforms for turn in session.turns)]
    counts = [draws.start, *[draws.step] * len(session.turns)]
    return all(
        np.array_equal(
            known, session.uniform_source.generate_uniforms(NATURE_STREAM, turn, 0, count)[0]
        )
        for turn, (known, count) in enumerate(zip(drawn, counts, strict=True))
    )


def describe_ghost_result(
    session: Session, human_seats: Sequence[int], player_names: Sequence[str], ghost: Ghost | None
) -> str:
    """What the ghost, or else the best agent, makes of the dice of a game that is over.

    Nothing where nobody can say.
    """
    try:
        found = ghost or create_best_ghost(session, human_seats, player_names)
        if found is None:
            return ""
        run_cancellable(TaskInfo(f"{found.name} plays the same dice"), found.play_to_end)
    except DmplayError:
        return ""
    return found.describe_comparison()
