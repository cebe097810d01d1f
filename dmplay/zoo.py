"""The problems as parallel environments of PettingZoo: every seat is a learner's.

Observations, rewards, masks and illegal moves are those of `dmplay.gym`; where any seat's move is
not legal, no turn passes.
"""

from typing import Any

import numpy as np
import pettingzoo

from dmplay.core import Problem
from dmplay.dice import SeededUniforms, new_seed
from dmplay.errors import BadParameter, IllegalAction
from dmplay.loops.seat import Info, SeatSpaces, Space, render_board, resolve_problem
from dmplay.session import Session

AgentDict = dict[str, Any]


class ParallelEnv(pettingzoo.ParallelEnv):  # type: ignore[misc] # which has no types
    """One game: `reset(seed=s)` begins episode 0 of a seed, `reset()` the next one."""

    metadata = {"render_modes": ["ansi"], "name": "dmplay_v0"}  # noqa: RUF012 - as PettingZoo has it

    def __init__(
        self,
        problem: str | Problem,
        *,
        turns: int | None = None,
        render_mode: str | None = None,
        **parameters: Any,
    ) -> None:
        self.problem = resolve_problem(problem, parameters)
        self.possible_agents = [*self.problem.agents]
        self.agents: list[str] = []
        self.render_mode = render_mode
        self._seats = [SeatSpaces(self.problem, seat) for seat in range(len(self.possible_agents))]
        self._turn_limit = turns
        self._seed, self._episode = -1, 0
        self.session: Session | None = None

    def observation_space(self, agent: str) -> Space:
        """What an agent may see."""
        return self._seats[self.problem.seat_index(agent)].observation_space

    def action_space(self, agent: str) -> Space:
        """What an agent may do."""
        return self._seats[self.problem.seat_index(agent)].action_space

    def reset(
        self, seed: int | None = None, options: Info | None = None
    ) -> tuple[AgentDict, AgentDict]:
        """Begins an episode: `options={"episode": n}` says which of the seed."""
        if seed is not None or self._seed < 0:
            self._seed, self._episode = new_seed() if seed is None else seed, -1
        self._episode = (options or {}).get("episode", self._episode + 1)
        game = self.session = Session(
            self.problem, SeededUniforms(self._seed, self._episode), turn_limit=self._turn_limit
        )
        self.agents = [*self.possible_agents]
        return self._current_observations(game), self._infos(game)

    def step(
        self, actions: AgentDict
    ) -> tuple[AgentDict, AgentDict, AgentDict, AgentDict, AgentDict]:
        """Plays a turn by these actions of all agents; nothing where the game is over."""
        if not self.agents:
            return {}, {}, {}, {}, {}
        game = self._current_session()
        missing = [agent for agent in self.agents if agent not in actions]
        if missing:
            raise IllegalAction(f"step: no action of {', '.join(missing)}; expected one of each")
        told = zip(self._seats, self.agents, strict=True)
        done = [seat.decode_actions(np.asarray(actions[agent])[None])[0] for seat, agent in told]
        paid = np.zeros(len(done))
        if all(_is_legal(game, seat, action) for seat, action in enumerate(done)):
            paid = game.advance(done).rewards
        over, agents = game.end_reason, self.agents
        if over:
            self.agents = []
        return (
            self._current_observations(game),
            dict(zip(agents, paid.tolist(), strict=True)),
            dict.fromkeys(agents, over == "terminal"),
            dict.fromkeys(agents, over not in (None, "terminal")),
            self._infos(game),
        )

    def _current_session(self) -> Session:
        if self.session is None:
            raise BadParameter("step: no game was begun; call reset first")
        return self.session

    def _current_observations(self, session: Session) -> AgentDict:
        turn = len(session.turns)
        joint = session.turns[-1].actions[None] if turn else None
        return {
            agent: one.encode_observations(session.observation_after(one.seat, turn)[None], joint)[
                0
            ]
            for agent, one in zip(self.possible_agents, self._seats, strict=True)
        }

    def _infos(self, session: Session) -> AgentDict:
        pairs = zip(self.possible_agents, self._seats, strict=True)
        return {agent: one.make_info(session.legal_actions_mask(one.seat)) for agent, one in pairs}

    def render(self) -> str | None:
        """The board as the first seat sees it, with `render_mode="ansi"`."""
        return render_board(self._current_session(), 0) if self.render_mode == "ansi" else None


def _is_legal(session: Session, seat: int, action: float) -> bool:
    """Whether a seat's action is legal."""
    legal = session.legal_actions_mask(seat)
    return legal is None or bool(legal[int(action)])
