"""PettingZoo environments, simultaneous or turn-based: `pettingzoo:classic/rps-v2`."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.problem import WAIT_LABEL, Problem
from dmplay.core.spaces import Interval, Labels, RealVector
from dmplay.errors import BadParameter, UnknownName
from dmplay.external.history_problem import (
    EnvironmentProblem,
    ExternalEnvironment,
    TimeStep,
    make_numbers_space,
    seed_from_uniform,
)
from dmplay.external.optional_libraries import (
    LIBRARY_ERRORS,
    import_library,
    parse_library_call,
    summarize_error,
)
from dmplay.external.spaces import ActionSpaceAdapter, flat_dimension, flatten_observation

PIP_EXTRA = "pettingzoo"
ACTION_NAMES: Mapping[str, str] = {"classic/rps-v2": "rock paper scissors"}
ACTION_MASK_KEY = "action_mask"
PLANE_SYMBOLS = ".xo"  # squares of a board: free, the first player's, the second player's


def load_problem(name: str) -> Problem:
    """Return the environment as a problem; raise BadParameter if it cannot be played."""
    problem = PettingZooProblem(name=name)
    problem.check_playable()
    return problem


def list_problem_names() -> list[str]:
    """Return the sorted names of the environments in both registries."""
    pettingzoo = import_library("pettingzoo", PIP_EXTRA, PIP_EXTRA)
    return sorted({*pettingzoo.aec_registry, *pettingzoo.parallel_registry})


def _make_raw_environment(name: str) -> Any:
    """Return a new environment, one with simultaneous actions if it has such a form.

    Raises UnknownName or BadParameter with a message of one line.
    """
    pettingzoo = import_library("pettingzoo", PIP_EXTRA, name)
    from pettingzoo.env_registry.exceptions import FailedToImport

    call = parse_library_call(name.partition(":")[2])
    registry = {**pettingzoo.aec_registry, **pettingzoo.parallel_registry}
    if call.name not in registry:
        raise UnknownName("environment", call.name, registry, error_prefix=PIP_EXTRA)
    form = "parallel" if call.name in pettingzoo.parallel_registry else "aec"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return pettingzoo.make(form, call.name, **call.arguments)
        except (*LIBRARY_ERRORS, FailedToImport) as error:
            raise BadParameter(f"{name}: {summarize_error(error)}") from None


@cache
def _make_example_environment(name: str) -> Any:
    """Return an environment that is only inspected, never played."""
    return _make_raw_environment(name)


@cache
def _make_action_adapters(name: str) -> dict[str, ActionSpaceAdapter]:
    """Return the adapter of each agent's action space."""
    env = _make_example_environment(name)
    action_names = ACTION_NAMES.get(parse_library_call(name.partition(":")[2]).name, "").split()
    return {
        agent: ActionSpaceAdapter(env.action_space(agent), name, action_names)
        for agent in env.possible_agents
    }


def _observation_space(name: str, agent: str) -> Any:
    """Return an agent's observation space, without the action mask."""
    space = _make_example_environment(name).observation_space(agent)
    return space["observation"] if ACTION_MASK_KEY in getattr(space, "spaces", ()) else space


def _is_turn_based(name: str) -> bool:
    """Return whether agents act in turns."""
    return hasattr(_make_example_environment(name), "agent_selection") or hasattr(
        _make_example_environment(name), "last"
    )


class PettingZooEnvironment(ExternalEnvironment):
    """A PettingZoo environment that is being played."""

    def __init__(self, name: str) -> None:
        self._name, self._env = name, _make_raw_environment(name)
        self._agents: list[str] = list(self._env.possible_agents)
        self._is_turn_based = _is_turn_based(name)
        self._last_observations: dict[str, Any] = {}  # the last observation of each agent
        self._infos: Mapping[str, Any] = {}

    def reset(self, uniform: float) -> TimeStep:
        """Reset the environment with a seed made from the uniform."""
        result = self._env.reset(seed=seed_from_uniform(uniform))
        if not self._is_turn_based:
            self._last_observations, self._infos = dict(result[0]), result[1]
        return self._make_time_step({})

    def step(self, actions: tuple[float, ...], uniform: float) -> TimeStep:
        """Play a turn, after reseeding the environment's generator (if any) from the uniform."""
        from gymnasium.utils.seeding import np_random

        if hasattr(self._env.unwrapped, "np_random"):
            self._env.unwrapped.np_random = np_random(seed_from_uniform(uniform))[0]
        adapters = _make_action_adapters(self._name)
        actions_by_agent = {
            agent: adapters[agent].to_space_value(action)
            for agent, action in zip(self._agents, actions, strict=True)
            if agent in self._acting_agents
        }
        if not self._is_turn_based:
            observations, rewards, *_, self._infos = self._env.step(actions_by_agent)
            self._last_observations |= observations
            return self._make_time_step(rewards)
        self._env.step(actions_by_agent[self._env.agent_selection])
        turn_rewards = dict(self._env.rewards)
        while self._env.agents and self._is_agent_done(self._env.agent_selection):
            self._env.step(None)
        return self._make_time_step(turn_rewards)

    def clone(self) -> None:
        """Return None: an environment cannot be cloned, only created again."""

    def _is_agent_done(self, agent: str) -> bool:
        """Return whether an agent is terminated or truncated."""
        return bool(self._env.terminations[agent] or self._env.truncations[agent])

    @property
    def _acting_agents(self) -> list[str]:
        """The agents that are to act now."""
        env = self._env
        return [env.agent_selection] if self._is_turn_based and env.agents else list(env.agents)

    def _make_time_step(self, rewards: Mapping[str, float]) -> TimeStep:
        """Return the time step after a reset or a turn."""
        env, acting_agents = self._env, self._acting_agents
        if self._is_turn_based:
            self._last_observations |= {agent: env.observe(agent) for agent in env.agents}
        legal_actions = tuple(self._legal_actions(agent, acting_agents) for agent in self._agents)
        observations = [self._flatten_last_observation(agent) for agent in self._agents]
        reward_values = tuple(float(rewards.get(agent, 0.0)) for agent in self._agents)
        return TimeStep(reward_values, not env.agents, legal_actions, tuple(observations))

    def _flatten_last_observation(self, agent: str) -> object:
        """Return an agent's last observation as a number, or as a tuple of several."""
        observation = self._last_observations[agent]
        observation = (
            observation["observation"]
            if isinstance(observation, dict) and ACTION_MASK_KEY in observation
            else observation
        )
        values = flatten_observation(_observation_space(self._name, agent), observation)
        return tuple(values) if len(values) > 1 else values[0]

    def _legal_actions(self, agent: str, acting_agents: list[str]) -> list[int]:
        """Return an agent's legal actions: only to wait if it does not act now."""
        labels = _make_action_adapters(self._name)[agent].action_set.labels
        if agent not in acting_agents:
            return [len(labels)]
        observation, info = self._last_observations[agent], self._infos.get(agent, {})
        if self._is_turn_based:
            info = self._env.infos.get(agent, {})
        mask = observation.get(ACTION_MASK_KEY) if isinstance(observation, dict) else None
        mask = info.get(ACTION_MASK_KEY) if mask is None else mask
        legal_actions = [
            n for n, is_legal in enumerate(mask if mask is not None else ()) if is_legal
        ]
        return legal_actions or list(range(len(labels)))


@dataclass(frozen=True)
class PettingZooProblem(EnvironmentProblem):
    """A PettingZoo environment of several agents: only their observations are available."""

    @cached_property
    def agents(self) -> tuple[str, ...]:
        """The agents that can act in the environment."""
        return tuple(_make_example_environment(self.name).possible_agents)

    @cached_property
    def actions(self) -> tuple[Labels | Interval, ...]:
        """The actions of each agent's action space, and to wait if they are labels."""
        spaces = [_make_action_adapters(self.name)[agent].action_set for agent in self.agents]
        return tuple(
            Labels((*space, WAIT_LABEL)) if isinstance(space, Labels) else space for space in spaces
        )

    @cached_property
    def observations(self) -> tuple[RealVector, ...]:
        """The observation of each agent as a vector of numbers, of one length for all agents.

        Raises BadParameter if the lengths differ.
        """
        sizes = {
            flat_dimension(_observation_space(self.name, agent), self.name) for agent in self.agents
        }
        if len(sizes) > 1:
            expected = "expected the same length for all agents"
            raise BadParameter(f"{self.name}: got observations of different lengths, {expected}")
        return (make_numbers_space(sizes.pop(), self.name),) * len(self.agents)

    def make_environment(self) -> ExternalEnvironment:
        """Return a new environment of this name."""
        return PettingZooEnvironment(self.name)

    def description(self) -> str:
        """Return the environment's name."""
        return parse_library_call(self.name.partition(":")[2]).name

    def draw_observation(self, observation: Array) -> str:
        """Return a text board if the observation consists of the planes of one; else ''.

        A square is `x` on the first plane and `o` on the second, as the observing agent sees them.
        """
        shape = _observation_space(self.name, self.agents[0]).shape
        if len(shape) != 3 or shape[2] >= len(PLANE_SYMBOLS):
            return ""
        planes = observation.reshape(shape).astype(bool)
        owners = (planes * np.arange(1, shape[2] + 1)).max(axis=2)
        return "\n".join(" ".join(PLANE_SYMBOLS[owner] for owner in row) for row in owners)

    def check_playable(self) -> None:
        """Raise BadParameter if the action or observation spaces cannot be played."""
        spaces = self.actions, self.observations
        if not all(isinstance(space, Labels) for space in spaces[0]) and _is_turn_based(self.name):
            raise BadParameter(
                f"{self.name}: the agents act in turns with real numbers, expected discrete "
                "actions for turns"
            )
