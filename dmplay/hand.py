"""The loop by hand: one game in Python, whose actions and observations are words and numbers."""

import os
from collections.abc import Sequence

from dmplay.bots.end import dismissed
from dmplay.bots.protocol import Facts, choices, learnt, sight
from dmplay.core import Policy, Problem
from dmplay.describe import counted
from dmplay.dice import Dice, fresh
from dmplay.displayed import Displayed
from dmplay.errors import BadPolicy, IllegalAction
from dmplay.finding import agents as known
from dmplay.finding import problems
from dmplay.session import Session


class Hand(Displayed):
    """A game, and the seats in it that are played by hand; a notebook shows its board."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self._seats = [seat for seat, one in enumerate(session.followers) if one is None]

    def _repr_mimebundle_(self, include: object = None, exclude: object = None) -> dict[str, str]:
        return self.session._repr_mimebundle_()

    @property
    def over(self) -> bool:
        """Whether no more turns can be played."""
        return self.session.over

    def _seat(self, agent: str) -> int:
        """The seat of this name; the first that is played by hand if none is named."""
        return self.session.problem.seat(agent) if agent else (self._seats or [0])[0]

    def legal(self, agent: str = "") -> object:
        """The actions that can be done, by name, or the bounds of a number."""
        seat = self._seat(agent)
        return choices(self.session.problem, seat, self.session.legal(seat))

    def seen(self, agent: str = "") -> object:
        """What was seen last: an observation, or the state where agents see it."""
        seat = self._seat(agent)
        now = self.session.observation(seat, len(self.session.turns))
        return sight(self.session.problem, seat, now)

    def act(self, *actions: str | float) -> Facts:
        """Plays a turn by an action for each seat in hand; what it taught the first of them."""
        if len(actions) != len(self._seats):
            names = ", ".join(self.session.problem.agents[seat] for seat in self._seats)
            expected = f"expected one for each of {names}" if names else "agents play every seat"
            raise BadPolicy(f"got {counted(len(actions), 'action')}, {expected}")
        done: list[float | None] = [None] * len(self.session.followers)
        for seat, action in zip(self._seats, actions, strict=True):
            done[seat] = self.session.problem.action(seat, str(action))
        self.session.advance(done)
        if self.over:
            dismissed(self.session, type(self.session.problem).__name__)
        return self.learnt()

    def learnt(self, agent: str = "") -> Facts:
        """What the last turn taught a seat; raises IllegalAction where none was played."""
        seat = self._seat(agent)
        if not self.session.turns:
            raise IllegalAction("no turn was played that could teach anything")
        percept = self.session.percept(seat, len(self.session.turns))
        return learnt(self.session.problem, seat, percept, 0)

    def undo(self, turns: int = 1) -> None:
        """Takes back turns; the same actions then meet the same dice."""
        self.session.undo(turns)

    @property
    def returns(self) -> dict[str, float]:
        """What each agent earned so far: the discounted sum of its rewards.

        Rewards that betray what is hidden are left out until the game is over.
        """
        session = self.session
        if not (self.over or session.problem.rewards_observed):
            return {}
        return dict(zip(session.problem.agents, session.returns().tolist(), strict=True))


def play(
    problem: str | os.PathLike[str] | Problem,
    agents: Sequence[str | Policy | None] = (),
    seed: int | None = None,
    *,
    turns: int | None = None,
) -> Hand:
    """A game to be played by hand: an agent for each seat, None for those in hand; without agents
    all are.
    """
    rules = problems.load(problem) if isinstance(problem, str | os.PathLike) else problem
    sitting = list(agents) or [None] * len(rules.agents)
    if len(sitting) != len(rules.agents):
        raise BadPolicy(
            f"got {counted(len(sitting), 'agent')}, expected one for each of {rules.agents}"
        )
    policies = [
        known.agent(rules, seat, who) if isinstance(who, str) else who
        for seat, who in enumerate(sitting)
    ]
    seed = fresh() if seed is None else seed
    return Hand(Session(rules, Dice(seed), policies, limit=turns))
