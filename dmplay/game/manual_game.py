"""Manual play of one game from Python, with actions and observations as words and numbers."""

import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from dmplay.agents.base import AdviceQuestion
from dmplay.core.data_frames import make_frame
from dmplay.core.notebook_display import NotebookDisplay
from dmplay.core.policy import is_policy_sequence
from dmplay.core.problem import check_problem, find_seat
from dmplay.core.session import Session
from dmplay.core.text import format_count
from dmplay.core.uniforms import SeededUniforms, new_seed
from dmplay.errors import BadPolicy, IllegalAction
from dmplay.external.bots.protocol import (
    JsonObject,
    describe_choices,
    encode_observation,
    encode_percept,
)
from dmplay.external.bots.shutdown import close_bots
from dmplay.game.hints.review import Review, review_actions
from dmplay.game.position import Position
from dmplay.game.seat_status import format_prompt
from dmplay.game.seats import HUMAN
from dmplay.game.session_files import find_recorded_name, write_session
from dmplay.game.turn_facts import Row, join_review, list_session_rows
from dmplay.registry.agents import AgentLike, assign_agents, load_players
from dmplay.registry.problem_module_exports import get_problem_name
from dmplay.registry.problems import ProblemLike, load_problem, resolve_problem


class ManualGame(NotebookDisplay):
    """A game whose manual seats are played from Python; a notebook shows its board."""

    def __init__(
        self, session: Session, players: Sequence[AgentLike | None], problem_name: str = ""
    ) -> None:
        self.session, self._problem_name = session, problem_name
        self._recorded_players = list[str]()
        self._players = list[str]()  # names, also of agents that no name loads again
        for seat, (player, seated) in enumerate(zip(players, session.seated_policies, strict=True)):
            policy = seated.policy if seated else None
            name = find_recorded_name(session.problem, seat, policy, player)
            self._recorded_players.append(name)
            is_unnamed = policy is not None and name == HUMAN
            self._players.append(type(policy).__name__ if is_unnamed else name)
        self._manual_seats = [
            seat for seat, policy in enumerate(session.seated_policies) if policy is None
        ]

    def __repr__(self) -> str:
        players, turns = ", ".join(self._players), len(self.session.turns)
        name = get_problem_name(self.session.problem)
        return f"<Game of {name}: {players}; turn {turns}{', over' * self.over}>"

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        return self.session._repr_mimebundle_()

    @property
    def over(self) -> bool:
        """True if no more turns can be played."""
        return self.session.over

    def _seat_index(self, agent: str) -> int:
        """Return the seat of the agent with this name; by default the first manual seat."""
        return find_seat(self.session.problem, agent) if agent else (self._manual_seats or [0])[0]

    def legal_actions(self, agent: str = "") -> object:
        """Return the legal actions of an agent, by default the first manual one, or its bounds."""
        seat = self._seat_index(agent)
        return describe_choices(self.session.problem, seat, self.session.legal_actions_mask(seat))

    def last_observation(self, agent: str = "") -> object:
        """Return the last observation of a seat, or the state if agents see it."""
        seat = self._seat_index(agent)
        observation = self.session.observation_after(seat, len(self.session.turns))
        return encode_observation(self.session.problem, seat, observation)

    def position(self, agent: str = "") -> Position:
        """Return the knowledge of an agent, by default the first manual one, and its hints."""
        question = self.advice_question(self._seat_index(agent))
        return Position.of_session(self.session, question)

    def advice_question(self, seat: int) -> AdviceQuestion:
        """Return the question that all advice for a seat answers: its turns and other players."""
        return AdviceQuestion.of_session(self.session, seat, self._players)

    def act(self, *actions: str | float) -> JsonObject:
        """Play a turn with one action for each manual seat; return the information that
        the first of them gets.
        """
        if len(actions) != len(self._manual_seats):
            names = ", ".join(self.session.problem.agents[seat] for seat in self._manual_seats)
            expected = (
                f"expected one for each of {names}"
                if names
                else "expected none: agents play every seat"
            )
            raise BadPolicy(f"got {format_count(len(actions), 'action')}, {expected}")
        joint_action: list[float | None] = [None] * len(self.session.seated_policies)
        for seat, action in zip(self._manual_seats, actions, strict=True):
            joint_action[seat] = self.session.problem.parse_action(seat, str(action))
        self.session.advance(joint_action)
        if self.over:
            close_bots(self.session, type(self.session.problem).__name__)
        return self.last_percept()

    def last_percept(self, agent: str = "") -> JsonObject:
        """Return the information that a seat got in its last turn; raise IllegalAction if none."""
        seat = self._seat_index(agent)
        if not self.session.turns:
            raise IllegalAction("no turn has been played yet")
        percept = self.session.build_percept(seat, len(self.session.turns))
        return encode_percept(self.session.problem, seat, percept, 0)

    def undo(self, turns: int = 1) -> None:
        """Undo turns; the same actions then meet the same random events."""
        self.session.undo(turns)

    @property
    def end_reason(self) -> str:
        """The reason why the game is over; '' if it is not."""
        return self.session.end_reason or ""

    @property
    def turns(self) -> list[Row]:
        """A row for the start and for each turn, with the columns of `dmplay export --csv`.

        Until the game is over, they have only what the first manual seat knows.
        """
        return list_session_rows(self.session, None if self.over else self._seat_index(""))

    def review(self, seat: str = "") -> Review:
        """Return the review of each choice of a seat; by default, of all manual seats, or of all.

        It has the values of the actions and the regret, as `dmplay.review` returns them.
        """
        seats = self._manual_seats or range(len(self._players))
        questions = [
            self.advice_question(index)
            for index in ([find_seat(self.session.problem, seat)] if seat else seats)
        ]
        return Review(review_actions(self.session, questions, can_sample=True))

    def prompt(self, seat: str = "", *, belief: bool = False, rules: bool = False) -> str:
        """Return the knowledge of a seat as the text that `dmplay mcp` sends to a language model.

        By default it is the first manual seat. `belief` adds the situation in words with the
        belief, if states are hidden, and `rules` the description and parameters of the problem.
        """
        return format_prompt(
            self.session, self._seat_index(seat), self._players,
            shows_belief=belief, shows_rules=rules,
        )  # fmt: skip

    def list_rows(self, *, review: bool = False) -> list[Row]:
        """Return the rows of the turns; with `review`, also values and regret."""
        return join_review(self.turns, self.review()) if review else self.turns

    def to_frame(self, library: str = "", *, review: bool = False) -> Any:
        """Return the rows as a data frame of pandas, or of the `library` polars."""
        return make_frame(self.list_rows(review=review), library)

    def save(
        self, path: str | os.PathLike[str], *, player: str = "", overwrite: bool = False
    ) -> None:
        """Write the game as a transcript, as `dmplay.save` does; the names of agents are kept.

        `player` is your name, or that of an agent that is recorded as a person.
        """
        loaded = resolve_problem(self._problem_name, {}) if self._problem_name else None
        names = self._recorded_players
        write_session(self.session, Path(path), names, loaded, player=player, overwrite=overwrite)

    @property
    def returns(self) -> dict[str, float]:
        """The discounted sum of rewards of each agent so far.

        It is empty until the game is over if rewards would reveal a hidden state.
        """
        session = self.session
        if not (self.over or session.problem.rewards_observable):
            return {}
        return dict(zip(session.problem.agents, session.returns().tolist(), strict=True))


def play(
    problem: ProblemLike,
    agents: AgentLike | Sequence[AgentLike | None] = (),
    seed: int | None = None,
    *,
    turns: int | None = None,
) -> ManualGame:
    """Return a game to play from Python, with an agent or None (manual) for each seat.

    Without agents, all seats are manual. Without a seed, it is drawn at random. The game ends after
    `turns` turns, by default the problem's horizon.
    """
    loaded = load_problem(problem)
    check_problem(loaded, turns)
    is_empty = is_policy_sequence(agents) and not agents
    players = assign_agents(loaded, [None] * len(loaded.agents) if is_empty else agents)
    policies = load_players(loaded, players, turns=turns)
    seed = new_seed() if seed is None else seed
    session = Session(loaded, SeededUniforms(seed), policies, turns=turns)
    name = os.path.join(os.curdir, problem) if isinstance(problem, os.PathLike) else problem
    return ManualGame(session, players, name if isinstance(name, str) else "")
