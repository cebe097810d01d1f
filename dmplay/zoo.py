"""The problems as parallel environments of PettingZoo, in which a learner plays every seat.

Observations, the option `observe`, rewards and masks are those of `dmplay.gym`. If the action of
any seat is illegal, no turn passes, but the step counts towards the turn limit: `turns`, else the
problem's horizon, else 10,000. `illegal_reward` is paid only to the seats whose action is illegal.
"""

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
import pettingzoo
from pettingzoo.utils.conversions import parallel_to_aec

from dmplay.core.arrays import Array
from dmplay.core.problem import find_seat
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import IllegalAction
from dmplay.gym import (
    check_render_mode,
    check_reset_options,
    check_started,
    choose_episode_uniforms,
    load_environment_problem,
    make_seat_spaces,
    render_board,
)
from dmplay.registry.problems import ProblemLike
from dmplay.simulation.observed_parts import Space, make_state_space
from dmplay.simulation.seat_spaces import IllegalActionRule, Info, SeatObserver, TurnLimit

AgentDict = dict[str, Any]


class ParallelEnv(pettingzoo.ParallelEnv):  # type: ignore[misc] # PettingZoo is untyped
    """One game at a time: `reset(seed=s)` begins episode 0 of a seed, `reset()` the next one."""

    metadata = {"render_modes": ["ansi", "rgb_array"], "name": "dmplay_v0"}  # noqa: RUF012 - as in PettingZoo

    def __init__(  # noqa: PLR0913 - each is the caller's to choose
        self,
        problem: ProblemLike,
        *,
        turns: int | None = None,
        render_mode: str | None = None,
        illegal: str = "noop",
        illegal_reward: float = -1.0,
        observe: str | Sequence[str] = "observation",
        **parameters: Any,
    ) -> None:
        self.problem = load_environment_problem(type(self), problem, parameters)
        self.possible_agents = [*self.problem.agents]
        self.agents: list[str] = []
        self.render_mode = check_render_mode(render_mode)
        limit = self._turn_limit = TurnLimit.from_option(self.problem, turns)
        self._seats = [
            make_seat_spaces(self.problem, seat, limit, observe)
            for seat in range(len(self.possible_agents))
        ]
        self._illegal_rule = IllegalActionRule.from_option(illegal, illegal_reward)
        self._step_count = 0
        self._uniforms: SeededUniforms | None = None
        self.session: Session | None = None

    def observation_space(self, agent: str) -> Space:
        """Return the observation space of an agent."""
        return self._seats[find_seat(self.problem, agent)].observation_space

    def action_space(self, agent: str) -> Space:
        """Return the action space of an agent."""
        return self._seats[find_seat(self.problem, agent)].action_space

    def reset(
        self, seed: int | None = None, options: Info | None = None
    ) -> tuple[AgentDict, AgentDict]:
        """Begin an episode, and return the observations and infos by agent.

        `options={"episode": n}` chooses the episode of the seed. Other options are ignored, as
        PettingZoo's own tests require.
        """
        values = check_reset_options(options, "episode", ignore_unknown=True)
        self._uniforms = choose_episode_uniforms(self._uniforms, seed, values)
        session = self.session = Session(
            self.problem, self._uniforms, turn_limit=self._turn_limit.steps
        )
        self._observers = [SeatObserver(seat_spaces, session) for seat_spaces in self._seats]
        self.agents, self._step_count = [*self.possible_agents], 0
        return self._current_observations(), self._infos(session)

    def step(
        self, actions: AgentDict
    ) -> tuple[AgentDict, AgentDict, AgentDict, AgentDict, AgentDict]:
        """Play a turn with the actions of all agents, and return PettingZoo's five dictionaries.

        They are empty if the game is over. Raises IllegalAction if an agent's action is missing.
        """
        session = check_started(self.session, "step")
        if not self.agents:
            return {}, {}, {}, {}, {}
        if not isinstance(actions, Mapping):
            raise IllegalAction(
                f"step: got {actions!r}, expected a dict with an action for each agent"
            )
        missing = [agent for agent in self.agents if agent not in actions]
        if missing:
            raise IllegalAction(
                f"step: got no action for {', '.join(missing)}, expected one for each agent"
            )
        pairs = zip(self._seats, self.agents, strict=True)
        joint_actions = [seat.decode_action(actions[agent]) for seat, agent in pairs]
        self._step_count += 1
        illegal_mask = np.array(
            [not _is_legal(session, seat, action) for seat, action in enumerate(joint_actions)]
        )
        rewards = np.where(illegal_mask, self._illegal_rule.reward, 0.0)
        if not illegal_mask.any():
            rewards = session.advance(joint_actions).rewards
        terminated = self._turn_limit.is_terminated(session) or (
            self._illegal_rule.ends_episode and bool(illegal_mask.any())
        )
        truncated = not terminated and self._step_count == self._turn_limit.steps
        agents = self.agents
        if terminated or truncated:
            self.agents = []
        return (
            self._current_observations(),
            dict(zip(agents, rewards.tolist(), strict=True)),
            dict.fromkeys(agents, terminated),
            dict.fromkeys(agents, truncated),
            self._infos(session),
        )

    @cached_property
    def state_space(self) -> Space:
        """The space of `state()`."""
        return make_state_space(self.problem)

    def state(self) -> Array:
        """Return the state of the problem, also if it is hidden from the agents.

        Central critics train on it. Raise BadParameter before the first reset, or for states that
        are text.
        """
        session = check_started(self.session, "state")
        return session.state.astype(self.state_space.dtype)

    def action_masks(self) -> AgentDict:
        """Return the mask `[A]` of the legal actions of every agent, as booleans."""
        infos = self._infos(check_started(self.session, "action_masks"))
        return {
            agent: seat_spaces.action_masks(infos[agent])
            for agent, seat_spaces in zip(self.possible_agents, self._seats, strict=True)
        }

    def _current_observations(self) -> AgentDict:
        """Return the current observation of every agent."""
        pairs = zip(self.possible_agents, self._observers, strict=True)
        turns_left = self._turn_limit.steps - self._step_count
        return {agent: observer.observe(turns_left) for agent, observer in pairs}

    def _infos(self, session: Session) -> AgentDict:
        """Return the info of every agent."""
        pairs = zip(self.possible_agents, self._seats, strict=True)
        turns_left = self._turn_limit.steps - self._step_count
        return {
            agent: seat_spaces.make_info(session.legal_actions_mask(seat_spaces.seat), turns_left)
            for agent, seat_spaces in pairs
        }

    def render(self) -> str | Array | None:
        """Return the board as the first seat sees it, as text or pixels; None without a mode."""
        return render_board(check_started(self.session, "render"), 0, self.render_mode)


def env(problem: ProblemLike, **options: Any) -> pettingzoo.AECEnv:
    """Return the problem as an AEC environment, in which the agents act one after another.

    The options are those of `ParallelEnv`. All agents act before the turn is played.
    """
    return parallel_to_aec(ParallelEnv(problem, **options))


def _is_legal(session: Session, seat: int, action: float) -> bool:
    """Return whether a seat's action is legal."""
    legal_mask = session.legal_actions_mask(seat)
    return legal_mask is None or bool(legal_mask[int(action)])
