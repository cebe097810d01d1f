"""The loop by hand: one game in Python, whose actions and observations are words and numbers."""

import os
from collections.abc import Sequence

from dmplay.bots.end import close_bots
from dmplay.bots.protocol import JsonObject, describe_choices, encode_observation, encode_percept
from dmplay.core import Policy, Problem
from dmplay.describe import format_count
from dmplay.dice import SeededUniforms, new_seed
from dmplay.displayed import NotebookDisplay
from dmplay.errors import BadPolicy, IllegalAction
from dmplay.finding import agents as known
from dmplay.finding import problems
from dmplay.session import Session


class ManualGame(NotebookDisplay):
    """A game, and the seats in it that are played by hand; a notebook shows its board."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self._manual_seats = [
            seat for seat, one in enumerate(session.seated_policies) if one is None
        ]

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        return self.session._repr_mimebundle_()

    @property
    def over(self) -> bool:
        """Whether no more turns can be played."""
        return self.session.over

    def _seat_index(self, agent: str) -> int:
        """The seat of this name; the first that is played by hand if none is named."""
        return self.session.problem.seat_index(agent) if agent else (self._manual_seats or [0])[0]

    def legal_actions(self, agent: str = "") -> object:
        """The actions that can be done, by name, or the bounds of a number."""
        seat = self._seat_index(agent)
        return describe_choices(self.session.problem, seat, self.session.legal_actions_mask(seat))

    def last_observation(self, agent: str = "") -> object:
        """What was seen last: an observation, or the state where agents see it."""
        seat = self._seat_index(agent)
        now = self.session.observation_after(seat, len(self.session.turns))
        return encode_observation(self.session.problem, seat, now)

    def act(self, *actions: str | float) -> JsonObject:
        """Plays a turn by an action for each seat in hand; what it taught the first of them."""
        if len(actions) != len(self._manual_seats):
            names = ", ".join(self.session.problem.agents[seat] for seat in self._manual_seats)
            expected = f"expected one for each of {names}" if names else "agents play every seat"
            raise BadPolicy(f"got {format_count(len(actions), 'action')}, {expected}")
        done: list[float | None] = [None] * len(self.session.seated_policies)
        for seat, action in zip(self._manual_seats, actions, strict=True):
            done[seat] = self.session.problem.parse_action(seat, str(action))
        self.session.advance(done)
        if self.over:
            close_bots(self.session, type(self.session.problem).__name__)
        return self.last_percept()

    def last_percept(self, agent: str = "") -> JsonObject:
        """What the last turn taught a seat; raises IllegalAction where none was played."""
        seat = self._seat_index(agent)
        if not self.session.turns:
            raise IllegalAction("no turn was played that could teach anything")
        percept = self.session.build_percept(seat, len(self.session.turns))
        return encode_percept(self.session.problem, seat, percept, 0)

    def undo(self, turns: int = 1) -> None:
        """Takes back turns; the same actions then meet the same dice."""
        self.session.undo(turns)

    @property
    def returns(self) -> dict[str, float]:
        """What each agent earned so far: the discounted sum of its rewards.

        Rewards that betray what is hidden are left out until the game is over.
        """
        session = self.session
        if not (self.over or session.problem.rewards_observable):
            return {}
        return dict(zip(session.problem.agents, session.returns().tolist(), strict=True))


def play(
    problem: str | os.PathLike[str] | Problem,
    agents: Sequence[str | Policy | None] = (),
    seed: int | None = None,
    *,
    turns: int | None = None,
) -> ManualGame:
    """A game to be played by hand: an agent for each seat, None for those in hand; without agents
    all are.
    """
    rules = problems.load_problem(problem) if isinstance(problem, str | os.PathLike) else problem
    sitting = list(agents) or [None] * len(rules.agents)
    if len(sitting) != len(rules.agents):
        raise BadPolicy(
            f"got {format_count(len(sitting), 'agent')}, expected one for each of {rules.agents}"
        )
    policies = [
        known.load_agent(rules, seat, who) if isinstance(who, str) else who
        for seat, who in enumerate(sitting)
    ]
    seed = new_seed() if seed is None else seed
    return ManualGame(Session(rules, SeededUniforms(seed), policies, turn_limit=turns))
