"""The ghost: an agent that plays a copy of a person's game with the same uniforms."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from dmplay.agents.base import AdviceQuestion, find_values_basis
from dmplay.core.action_values import Horizon, ValuesBasis
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.session import DEFAULT_TURN_LIMIT, Session
from dmplay.core.text import escape_unprintable, format_count, format_reward
from dmplay.core.uniforms import NATURE_STREAM, SeededUniforms
from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.registry import agents

NATURAL_END_REASONS = ("terminal", "horizon", "turn limit")
GHOST_NOTE_PREFIX = "# ghost: "  # beginning of the transcript note


class Ghost:
    """An agent in the people's seats of a copied game, with the same uniforms and other agents."""

    def __init__(
        self,
        name: str,
        player_session: Session,
        policies: Mapping[int, Policy],
        find_basis: Callable[[], ValuesBasis] = ValuesBasis,
    ) -> None:
        self.name, self._find_basis = name, find_basis  # The basis may be slow to find.
        self.seat = min(policies)
        self.player_session = player_session
        others = {
            seat: seated_policy.policy
            for seat, seated_policy in enumerate(player_session.seated_policies)
            if seated_policy
        }
        policy_by_seat = {**others, **policies}
        self.session = player_session.copy_at_start(
            [*map(policy_by_seat.get, range(len(player_session.seated_policies)))]
        )

    @property
    def label(self) -> str:
        """Its name with the game that it plans for."""
        scope = self._find_basis()._replace(horizon=Horizon.GAME, ignores_discount=False).scope
        return f"{self.name} ({scope})" if scope else self.name

    @property
    def plays_longer_game(self) -> bool:
        """True if it plans for turns that this game, which its turn limit ended, did not have."""
        was_cut = self.player_session.end_reason == "turn limit"
        return was_cut and self._find_basis().ignores_turn_limit

    @property
    def is_shown_during_play(self) -> bool:
        """True if its game reveals nothing: one agent and no hidden states."""
        problem = self.player_session.problem
        return not problem.partially_observable and len(problem.agents) == 1

    def catch_up(self) -> None:
        """Play or undo turns up to the player's current turn, with the uniforms of that game."""
        ghost_turns, player_turns = self.session.turns, self.player_session.turns
        while ghost_turns and not self._matches_turn(len(ghost_turns)):
            self.session.undo()
        while len(ghost_turns) < len(player_turns) and not self.session.over:
            self._play_turn(len(ghost_turns) + 1)

    def play_to_end(self) -> None:
        """Play up to the end of the ghost's own game, which may be longer or shorter."""
        self.catch_up()
        while len(self.session.turns) < DEFAULT_TURN_LIMIT and not self.session.over:
            self._play_turn(len(self.session.turns) + 1)

    def _matches_turn(self, turn: int) -> bool:
        """Return whether the player's game has this turn too, with the same uniforms."""
        player_turns = self.player_session.turns[turn - 1 : turn]
        return bool(player_turns) and np.array_equal(
            player_turns[0].uniforms, self.session.turns[turn - 1].uniforms
        )

    def _play_turn(self, turn: int) -> None:
        """Play one turn with the uniforms of the player's turn, or with its own if there is
        none.
        """
        turn_limit = self.session.turn_limit or DEFAULT_TURN_LIMIT
        Budget("the game of the ghost", "play a shorter game").spend_work(1.0, turn / turn_limit)
        player_turns = self.player_session.turns[turn - 1 : turn]
        self.session.advance((), player_turns[0].uniforms if player_turns else None)

    @property
    def score(self) -> float:
        """The ghost's return so far."""
        return float(self.session.returns()[self.seat])

    @property
    def player_lead(self) -> float:
        """The player's return minus the ghost's."""
        return float(self.player_session.returns()[self.seat]) - self.score

    @property
    def transcript_note(self) -> str:
        """The transcript line that names the ghost."""
        return f"{GHOST_NOTE_PREFIX}{' '.join(escape_unprintable(self.name).split())}"

    def _describe_chance(self) -> str:
        """Return which chances both games share, as the beginning of a sentence; '' if none."""
        start_count, step_count = self.session.problem.uniform_counts
        chances = ["start"] * bool(start_count) + ["luck"] * bool(step_count)
        return f"same {' and '.join(chances)}: " if chances else ""

    def describe_comparison(self) -> str:
        """Return a sentence that compares the returns of ghost and player."""
        player_return = float(self.player_session.returns()[self.seat])
        ghost_turns, player_turns = len(self.session.turns), len(self.player_session.turns)
        is_unequal = self.player_session.end_reason not in NATURAL_END_REASONS
        ghost_note = f" in {format_count(ghost_turns, 'turn')}" * is_unequal
        player_note = f" in {format_count(player_turns, 'turn')}" * is_unequal
        ghost_score = format_reward(self.score)
        return (
            f"{self._describe_chance()}{self.label} scored {ghost_score}{ghost_note}, "
            f"you {format_reward(player_return)}{player_note}"
        )


def create_ghost(session: Session, human_seats: Sequence[int], name: str) -> Ghost:
    """Return the named agent as ghost of these seats; it plans for the turns of the game if it can.

    Raise BadParameter if no person plays, several people have different rewards, or the name is
    unknown.
    """
    if not human_seats:
        raise BadParameter("--ghost: needs a human player; only agents play this game")
    if not _have_common_reward(session.problem, human_seats):
        raise BadParameter(
            "--ghost: needs one human player; several with different rewards play this game"
        )
    agent_names = agents.load_roster(session.problem).agents
    if name.partition(":")[0] not in agent_names and not agents.names_user_code(
        session.problem, 0, name
    ):
        raise BadParameter(f"--ghost: got {name!r}, expected one of {', '.join(agent_names)}")
    policies = {seat: _load_agent_for_game(session, seat, name) for seat in human_seats}
    question = AdviceQuestion(min(policies), session.turn_limit)
    return Ghost(
        name,
        session,
        policies,
        lambda: find_values_basis(policies[question.seat], question)._replace(assumed_players=""),
    )


def _load_agent_for_game(session: Session, seat: int, name: str) -> Policy:
    """Return the named agent for a seat; one that plans whole games plans for the turn limit."""
    problem, turns = session.problem, session.turn_limit
    if turns is not None and not agents.names_user_code(problem, seat, name):
        name = agents.set_horizon_in_name(problem, seat, name, turns)
    return agents.load_agent(problem, seat, name, turns=turns)


def find_ghost_name(notes: Sequence[str], problem: Problem) -> str:
    """Return the last ghost that the notes name, if it is a built-in agent; else ''.

    User-defined agents are not loaded from notes.
    """
    ghost_names = [
        row.removeprefix(GHOST_NOTE_PREFIX) for row in notes if row.startswith(GHOST_NOTE_PREFIX)
    ]
    agent_names = agents.load_roster(problem).agents
    return (
        ghost_names[-1] if ghost_names and ghost_names[-1].partition(":")[0] in agent_names else ""
    )


def create_best_ghost(session: Session, questions: Sequence[AdviceQuestion]) -> Ghost | None:
    """Return the agent that gives the hints as ghost of these seats of a finished game.

    None if there is no such agent, if people have different rewards, if other players played the
    first turns, or if the uniforms are not those of the seed.
    """
    seats = [question.seat for question in questions]
    if any(question.earlier_turns for question in questions):
        return None
    if not (_have_common_reward(session.problem, seats) and _uses_seed_uniforms(session)):
        return None
    candidates = [agents.find_hint_provider(session.problem, question) for question in questions]
    hint_agents = [candidate for candidate in candidates if candidate]
    if not questions or len(hint_agents) < len(questions):
        return None
    policies = {agent.question.seat: agent.policy for agent in hint_agents}
    first = hint_agents[0]
    return Ghost(first.base_name, session, policies, lambda: first.basis)


def _have_common_reward(problem: Problem, human_seats: Sequence[int]) -> bool:
    """Return whether these people have the same reward."""
    return len(human_seats) == 1 or problem.shared_reward


def _uses_seed_uniforms(session: Session) -> bool:
    """Return whether all uniforms of a session are generated by its seed, without rerolls."""
    if not isinstance(session.uniform_source, SeededUniforms):
        return False
    uniform_counts = session.problem.uniform_counts
    used_uniforms = [session.initial_uniforms, *(turn.uniforms for turn in session.turns)]
    counts = [uniform_counts.start, *[uniform_counts.step] * len(session.turns)]
    return all(
        np.array_equal(
            used, session.uniform_source.generate_uniforms(NATURE_STREAM, turn, 0, count)[0]
        )
        for turn, (used, count) in enumerate(zip(used_uniforms, counts, strict=True))
    )


def play_ghost(
    session: Session, questions: Sequence[AdviceQuestion], ghost: Ghost | None
) -> Ghost | None:
    """Return the ghost, or the best agent, after its game on the uniforms of a finished game.

    None if there is no such agent or it fails, or if the best agent plays a longer game.
    """
    try:
        opponent = ghost or create_best_ghost(session, questions)
        if opponent is None or (ghost is None and opponent.plays_longer_game):
            return None
        task_info = TaskInfo(
            f"{opponent.name} is playing the same game", is_after_game=True, can_be_skipped=True
        )
        run_cancellable(task_info, opponent.play_to_end)
    except DmplayError:
        return None
    return opponent
