"""The games of a rollout as tables: a row for each game, or for each turn."""

from collections.abc import Iterator
from typing import Any, Self

import numpy as np

from dmplay.core.arrays import Array, Ints, make_readonly
from dmplay.core.data_frames import make_frame
from dmplay.core.problem import Problem
from dmplay.core.session import Session, Turn
from dmplay.core.text import format_count
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.game.turn_facts import Row, flatten_turn_facts
from dmplay.simulation.rollouts import TRAJECTORY_ARRAYS, Rollout
from dmplay.transcript.format import collect_turn_facts

NO_UNIFORMS = make_readonly(np.empty(0))  # of turns whose random numbers were not kept


class PlayedGames(Rollout):
    """The arrays of a rollout, the problem that was played, and the number of each episode."""

    problem: Problem
    episode_numbers: Ints

    @classmethod
    def of_rollout(cls, problem: Problem, rollout: Rollout, episode_numbers: Ints) -> Self:
        """Return the games of a rollout of a problem."""
        games = cls(*rollout)
        games.problem, games.episode_numbers = problem, episode_numbers
        return games

    def list_rows(self) -> list[Row]:
        """Return a row for the start and for each turn of each game, with its episode's number.

        The columns are those of recorded games, without random numbers. Raise BadParameter unless
        all trajectories were kept.
        """
        needed = (getattr(self, name) for name in ("turn_counts", *TRAJECTORY_ARRAYS))
        if {*map(len, needed)} != {len(self.episode_numbers)}:
            raise BadParameter('rows of turns: expected a rollout with keep=["trajectories"]')
        return [
            {"episode": number} | row
            for index, number in enumerate(self.episode_numbers.tolist())
            for row in self._iter_rows(index)
        ]

    def _iter_rows(self, index: int) -> Iterator[Row]:
        """Yield the row of the start, and those of the turns of a game."""
        session = Session(self.problem, SeededUniforms(0))
        session.initial_state = make_readonly(self.states[index, 0, ...])
        session.initial_uniforms = NO_UNIFORMS
        yield flatten_turn_facts(collect_turn_facts(session))
        for turn in range(self.turn_counts[index]):
            results = self.states[index, turn + 1, ...], self.observations[index, turn, ...]
            actions, rewards = self.actions[index, turn], self.rewards[index, turn]
            session.append_turns([Turn(actions, NO_UNIFORMS, *results, rewards)])
            yield flatten_turn_facts(collect_turn_facts(session))

    def to_frame(self, library: str = "") -> Any:
        """Return the rows of turns as a data frame if trajectories were kept, else one per game.

        It is a frame of pandas, or of the `library` polars.
        """
        if len(self.actions):
            return make_frame(self.list_rows(), library)
        columns: dict[str, Array] = {"episode": self.episode_numbers}
        for name in ("returns", "total_rewards"):
            for agent, values in zip(self.problem.agents, getattr(self, name).T, strict=True):
                columns[f"{name.removesuffix('s').replace('_', ' ')} {agent}"] = values
        columns |= {"turns": self.turn_counts, "terminated": self.terminated}
        return make_frame({key: values for key, values in columns.items() if len(values)}, library)

    def __repr__(self) -> str:
        means = ", ".join(f"{mean:.5g}" for mean in self.returns.mean(axis=0) if len(self.returns))
        names = ", ".join(name for name in self._fields if len(getattr(self, name)))
        count = format_count(len(self.episode_numbers), "game", ",")
        return f"<{count}; mean return {means or 'not recorded'}; arrays: {names}>"
