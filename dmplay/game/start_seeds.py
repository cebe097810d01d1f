"""Seeds of games that people start: a game should not end almost at once, if others last."""

import math
from collections.abc import Sequence
from contextlib import suppress
from datetime import date
from time import thread_time
from typing import NamedTuple

from dmplay.agents.base import AdviceQuestion
from dmplay.agents.random_agent import Random
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms, new_seed
from dmplay.core.work_budget import ComputationStopped, stop_after_seconds
from dmplay.errors import DmplayError
from dmplay.registry import agents

SHORT_TURNS = 3  # a game that the rules end within them is short
MAX_REDRAWS = 20
MAX_SECONDS = 0.1  # processor time after which a draw is kept
COMPARED_GAMES = 31  # games of the seed 0 that show whether most games last longer


def draw_seed(problem: Problem, episode: int = 0, turn_limit: int | None = None) -> int:
    """Return a new random seed for a person's game, drawn again while that game is short.

    It is short if random play ends it within three turns, or if the agents that give hints do.
    These are asked only if they need not compute a solution first. A draw is kept if the problem's
    games are usually as short, or if drawing takes too long.
    """
    turns = SHORT_TURNS if turn_limit is None else max(1, min(SHORT_TURNS, turn_limit - 1))
    start = _Start(problem, turns, thread_time() + MAX_SECONDS)
    seed = new_seed()
    with suppress(Exception):  # Too slow, or a fault of the problem, which the game shows.
        for redraw in range(MAX_REDRAWS):
            if not start.is_short_for_anyone(SeededUniforms(seed, episode)):
                break
            if not redraw and not start.is_usually_long:
                break
            seed = new_seed()
    return seed


def choose_daily_seed(problem: Problem, day: date) -> int:
    """Return the seed of the game of the day: the date, such as 20261122, or 2026112201 and so on.

    It is the first one whose game is not short under random play, and depends only on the problem
    and the date. It is the date if there is none, or if the problem's games are usually short.
    """
    first, start = int(day.strftime("%Y%m%d")), _Start(problem)
    with suppress(Exception):  # A fault of the problem, which the game shows.
        if start.is_short(SeededUniforms(first)) and start.is_usually_long:
            for seed in range(100 * first + 1, 100 * first + 1 + MAX_REDRAWS):
                if not start.is_short(SeededUniforms(seed)):
                    return seed
    return first


class _Start(NamedTuple):
    """The first turns of a problem's games, which the rules should not end.

    The methods raise ComputationStopped after the deadline, in seconds of this thread.
    """

    problem: Problem
    turns: int = SHORT_TURNS
    deadline: float = math.inf

    @property
    def is_usually_long(self) -> bool:
        """True if most games of random play last longer than these turns."""
        games = (SeededUniforms(0, episode) for episode in range(COMPARED_GAMES))
        return sum(map(self.is_short, games)) < COMPARED_GAMES / 2

    def is_short(self, uniforms: SeededUniforms) -> bool:
        """Return whether the rules end a game of random play within these turns."""
        seats = range(len(self.problem.agents))
        return self._is_ended_by(uniforms, [Random(self.problem, seat) for seat in seats])

    def is_short_for_anyone(self, uniforms: SeededUniforms) -> bool:
        """Return whether a game ends early under random play, or if the hints are followed.

        An agent that begins to compute a solution gives no hints here.
        """
        if type(self.problem).terminal is Problem.terminal:  # as of most problems; saves 30 ms
            return False
        if self.is_short(uniforms):
            return True
        with suppress(ComputationStopped, DmplayError), stop_after_seconds(0.0):
            providers = [
                agents.find_hint_provider(self.problem, AdviceQuestion(seat))
                for seat in range(len(self.problem.agents))
            ]
            policies = [provider.policy for provider in providers if provider]
            return len(policies) == len(providers) and self._is_ended_by(uniforms, policies)
        return False

    def _is_ended_by(self, uniforms: SeededUniforms, policies: Sequence[Policy]) -> bool:
        """Return whether the rules end a game of these policies within these turns."""
        session = Session(self.problem, uniforms, policies, turn_limit=self.turns)
        while not session.over:
            if thread_time() > self.deadline:
                raise ComputationStopped
            session.advance()
        return session.end_reason == "terminal"
