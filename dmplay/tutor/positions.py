"""Games that stand at the position of a lesson's step."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from dmplay.agents.base import AdviceQuestion
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, find_seat
from dmplay.core.session import Session
from dmplay.core.typed_text import parse_belief, parse_history, parse_state
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.game.hints.ghost_agent import Ghost, create_ghost
from dmplay.game.launch_requests import GameRequest, format_settings
from dmplay.game.position import Position
from dmplay.game.seats import HUMAN, list_scripts, make_seat_policy, shorten_player_name
from dmplay.registry import agents
from dmplay.registry.problem_name_kinds import names_bot
from dmplay.registry.problems import LoadedProblem, resolve_problem
from dmplay.transcript.format import resolve_turn_limit
from dmplay.tutor.lesson import GameTask, PositionText
from dmplay.views.protocol import load_view_module


@dataclass(frozen=True)
class PositionInGame:
    """A session at the position of a step, and the question that advice about it answers."""

    problem_name: str
    session: Session
    question: AdviceQuestion
    first_turn: int = 0  # number of turns before the position
    is_trusted: bool = False  # whether agents outside dmplay may run

    @property
    def problem(self) -> Problem:
        """The problem that is played."""
        return self.session.problem

    @property
    def seat(self) -> int:
        """The seat of the player."""
        return self.question.seat

    def ask(
        self,
        agent: agents.HintAgent | None = None,
        *,
        state: str = "",
        history: Sequence[str] = (),
        belief: str = "",
        turns_left: int = 0,
    ) -> Position:
        """Return the player's knowledge here, with an agent, by default that of the hints.

        If all agents see the state, it may be another state or another turn. If states are hidden,
        it may be the knowledge after another history, such as "feed crying", or another belief.
        An agent that plays alone may have more turns left than the game.
        """
        problem, question, session = self.problem, self.question, self.session
        if belief and not problem.partially_observable:
            raise BadParameter("belief: expected a problem with hidden states, or a state instead")
        if state and problem.partially_observable:
            raise BadParameter("state: the states are hidden, expected a history or a belief")
        turns_done, limit = len(history or session.turns), session.turn_limit
        if turns_left and len(problem.agents) == 1:
            question = replace(question, turn_limit=turns_done + turns_left)
        elif turns_left:
            if limit is None or turns_left > limit:
                expected = "expected a game of as many turns"
                raise BadParameter(f"turns_left: got {turns_left}, {expected}")
            turns_done = limit - turns_left
        agent = agent or agents.find_hint_provider(problem, question)
        if history:
            turns = parse_history(problem, self.seat, history)
            return Position.after_history(problem, question, agent, turns)
        if belief:
            probabilities = parse_belief(problem, belief)
            return Position.at_belief(problem, question, agent, probabilities, turns_done)
        if problem.partially_observable or not (state or turns_left):
            return Position.of_session(session, question, agent)
        s = parse_state(problem, state) if state else session.state
        return Position.at_state(problem, question, agent, s, turns_done)


def open_position(position: PositionText, folder: Path, *, trusted: bool = False) -> PositionInGame:
    """Return the game at a position, without a transcript.

    Paths of problem files are relative to `folder`. Code outside dmplay runs only if it is
    trusted.
    """
    loaded = _load_problem(position, folder, trusted=trusted)
    return open_loaded_position(loaded, position, trusted=trusted)


def open_loaded_position(
    loaded: LoadedProblem, position: PositionText, *, trusted: bool
) -> PositionInGame:
    """Return the game of a loaded problem at a position."""
    problem, players = loaded.problem, _choose_players(loaded.problem, position, trusted=trusted)
    policies = [
        make_seat_policy(problem, seat, player, position.turns)
        for seat, player in enumerate(players)
    ]
    turn_limit = resolve_turn_limit(problem, players, position.turns)
    session = Session(problem, SeededUniforms(position.seed), policies, turn_limit=turn_limit)
    seat = players.index(HUMAN)
    for action_text in position.after:
        actions: list[float | None] = [None] * len(players)
        actions[seat] = problem.parse_action(seat, action_text)
        session.advance(actions)
    names = [*map(shorten_player_name, players)]
    question = AdviceQuestion.of_session(session, seat, names, list_scripts(session, players))
    return PositionInGame(loaded.name, session, question, len(session.turns), trusted)


def check_agent_trusted(problem: Problem, seat: int, name: str, *, trusted: bool) -> None:
    """Raise BadParameter if an agent is code outside dmplay, or reads a file, without trust."""
    kind, _, argument = name.partition(":")
    reads_file = kind == "replay" or (kind == "script" and os.path.isfile(argument))
    if trusted or not (
        reads_file or names_bot(name) or agents.names_user_code(problem, seat, name)
    ):
        return
    reason = "reads a file" if reads_file else "is code outside dmplay"
    raise BadParameter(f"agent {name!r} {reason}; if you trust it, add --trust")


def load_agent(position: PositionInGame, seat: int, name: str) -> Policy:
    """Return the agent of this name for a seat; raise BadParameter if it is not trusted."""
    check_agent_trusted(position.problem, seat, name, trusted=position.is_trusted)
    return agents.load_agent(position.problem, seat, name)


def play_ghost(position: PositionInGame, name: str) -> Ghost:
    """Return the finished game of an agent that plays on from the position, with the same draws.

    Raise BadParameter if the agent is not trusted.
    """
    check_agent_trusted(position.problem, position.seat, name, trusted=position.is_trusted)
    return finish_ghost(position, create_ghost(position.session, [position.seat], name))


def finish_ghost(position: PositionInGame, ghost: Ghost) -> Ghost:
    """Let a ghost play on from the position to the end, and return it."""
    ghost.session.append_turns(position.session.turns[: position.first_turn])
    ghost.play_to_end()
    return ghost


def _load_problem(position: PositionText, folder: Path, *, trusted: bool) -> LoadedProblem:
    """Return the problem of a position, whose path is relative to `folder`."""
    return resolve_problem(position.problem, position.parameters, trusted=trusted, folder=folder)


def _choose_players(problem: Problem, position: PositionText, *, trusted: bool) -> list[str]:
    """Return the player of each seat at a position; one of them is a person."""
    named = {find_seat(problem, name): agent for name, agent in position.seats.items()}
    for seat, agent in named.items():
        check_agent_trusted(problem, seat, agent, trusted=trusted)
    own_seat = next((seat for seat in range(len(problem.agents)) if seat not in named), None)
    if own_seat is None:
        raise BadParameter("seats: every seat has an agent, expected one seat for the player")
    players = [
        HUMAN
        if seat == own_seat
        else named.get(seat) or agents.load_roster(problem, seat).default_partner
        for seat in range(len(problem.agents))
    ]
    if position.turns is None:
        return players
    return [
        agents.set_horizon_in_name(problem, seat, player, position.turns)
        for seat, player in enumerate(players)
    ]


def make_game_request(
    position: PositionText, folder: Path, task: GameTask, *, trusted: bool = False
) -> GameRequest:
    """Return the request for the game of a task, which begins like a position.

    Raise BadParameter if the task hides the belief, and the problem's view cannot be drawn so, or
    if a note would tell the hidden state.
    """
    loaded = _load_problem(position, folder, trusted=trusted)
    players = _choose_players(loaded.problem, position, trusted=trusted)
    if not task.shows_belief and getattr(load_view_module(loaded.problem), "NEEDS_BELIEF", False):
        raise BadParameter(f"belief: the board of {loaded.name} always shows it")
    if loaded.problem.partially_observable and any(note.at for note in task.notes):
        raise BadParameter("notes: at: the states are hidden; leave it out")
    seats = [
        f"{name}={player}" for name, player in zip(loaded.problem.agents, players, strict=True)
    ]
    request = GameRequest(
        loaded.name,
        seed=position.seed,
        turns=position.turns,
        agent=players[0],
        strict=task.strictness,
    )
    return replace(
        request,
        settings=format_settings(position.parameters),
        seats=seats[1:],
        lesson_goal="" if task.notes else f"goal: {task.goal}",
        is_guided=bool(task.notes),
        shows_belief=task.shows_belief,
    )
