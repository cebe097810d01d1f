"""Environments of PettingZoo, in which all act at once or in turns: `pettingzoo:classic/rps-v2`."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from dmplay.chance import Array
from dmplay.core import WAIT_LABEL, Interval, Labels, Problem, RealVector
from dmplay.errors import BadParameter, UnknownName
from dmplay.guests.extras import LIBRARY_ERRORS, import_library, parse_library_call, summarize_error
from dmplay.guests.history import (
    EnvironmentProblem,
    ExternalEnvironment,
    TimeStep,
    make_numbers_space,
    seed_from_uniform,
)
from dmplay.guests.spaces import ActionSpaceAdapter, flat_dimension, flatten_observation

PIP_EXTRA = "pettingzoo"
ACTION_NAMES: Mapping[str, str] = {"classic/rps-v2": "rock paper scissors"}
ACTION_MASK_KEY = "action_mask"
PLANE_SYMBOLS = ".xo"  # of a board: free, the first's, the second's


def load_problem(name: str) -> Problem:
    """The environment of this name."""
    made = PettingZooProblem(name=name)
    made.check_playable()
    return made


def list_problem_names() -> list[str]:
    """The environments of both registries."""
    pettingzoo = import_library("pettingzoo", PIP_EXTRA, PIP_EXTRA)
    return sorted({*pettingzoo.aec_registry, *pettingzoo.parallel_registry})


def _make_raw_environment(name: str) -> Any:
    """The environment, one in which all act at once where it has such a form."""
    pettingzoo = import_library("pettingzoo", PIP_EXTRA, name)
    from pettingzoo.env_registry.exceptions import FailedToImport

    wanted = parse_library_call(name.partition(":")[2])
    known = {**pettingzoo.aec_registry, **pettingzoo.parallel_registry}
    if wanted.name not in known:
        raise UnknownName("environment", wanted.name, known, error_prefix=PIP_EXTRA)
    form = "parallel" if wanted.name in pettingzoo.parallel_registry else "aec"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return pettingzoo.make(form, wanted.name, **wanted.arguments)
        except (*LIBRARY_ERRORS, FailedToImport) as error:
            raise BadParameter(f"{name}: {summarize_error(error)}") from None


@cache
def _make_example_environment(name: str) -> Any:
    """An environment that is asked what it is, and never played."""
    return _make_raw_environment(name)


@cache
def _make_action_adapters(name: str) -> dict[str, ActionSpaceAdapter]:
    env = _make_example_environment(name)
    words = ACTION_NAMES.get(parse_library_call(name.partition(":")[2]).name, "").split()
    return {
        agent: ActionSpaceAdapter(env.action_space(agent), name, words)
        for agent in env.possible_agents
    }


def _observation_space(name: str, agent: str) -> Any:
    """What an agent observes, beside what it may do."""
    space = _make_example_environment(name).observation_space(agent)
    return space["observation"] if ACTION_MASK_KEY in getattr(space, "spaces", ()) else space


def _is_turn_based(name: str) -> bool:
    """Whether agents act in turns."""
    return hasattr(_make_example_environment(name), "agent_selection") or hasattr(
        _make_example_environment(name), "last"
    )


class PettingZooEnvironment(ExternalEnvironment):
    """An environment that is played."""

    def __init__(self, name: str) -> None:
        self._name, self._env = name, _make_raw_environment(name)
        self._agents: list[str] = list(self._env.possible_agents)
        self._is_turn_based = _is_turn_based(name)
        self._last_observations: dict[str, Any] = {}  # what each observed
        self._infos: Mapping[str, Any] = {}

    def reset(self, draw: float) -> TimeStep:
        """The draw seeds its generator."""
        came = self._env.reset(seed=seed_from_uniform(draw))
        if not self._is_turn_based:
            self._last_observations, self._infos = dict(came[0]), came[1]
        return self._make_time_step({})

    def step(self, actions: tuple[float, ...], draw: float) -> TimeStep:
        """The draw seeds its generator anew, where it says which that is."""
        from gymnasium.utils.seeding import np_random

        if hasattr(self._env.unwrapped, "np_random"):
            self._env.unwrapped.np_random = np_random(seed_from_uniform(draw))[0]
        known = _make_action_adapters(self._name)
        done = {
            a: known[a].to_space_value(act)
            for a, act in zip(self._agents, actions, strict=True)
            if a in self._acting_agents
        }
        if not self._is_turn_based:
            seen, rewards, *_, self._infos = self._env.step(done)
            self._last_observations |= seen
            return self._make_time_step(rewards)
        self._env.step(done[self._env.agent_selection])
        paid = dict(self._env.rewards)
        while self._env.agents and self._is_done(self._env.agent_selection):
            self._env.step(None)
        return self._make_time_step(paid)

    def clone(self) -> None:
        """There is none: copies of an environment are fresh ones."""

    def _is_done(self, agent: str) -> bool:
        return bool(self._env.terminations[agent] or self._env.truncations[agent])

    @property
    def _acting_agents(self) -> list[str]:
        """Who is to act."""
        env = self._env
        return [env.agent_selection] if self._is_turn_based and env.agents else list(env.agents)

    def _make_time_step(self, rewards: Mapping[str, float]) -> TimeStep:
        env, asked = self._env, self._acting_agents
        if self._is_turn_based:
            self._last_observations |= {agent: env.observe(agent) for agent in env.agents}
        able = tuple(self._legal_actions(agent, asked) for agent in self._agents)
        told = [self._flatten_last_observation(agent) for agent in self._agents]
        paid = tuple(float(rewards.get(agent, 0.0)) for agent in self._agents)
        return TimeStep(paid, not env.agents, able, tuple(told))

    def _flatten_last_observation(self, agent: str) -> object:
        """What an agent observed last."""
        seen = self._last_observations[agent]
        seen = seen["observation"] if isinstance(seen, dict) and ACTION_MASK_KEY in seen else seen
        each = flatten_observation(_observation_space(self._name, agent), seen)
        return tuple(each) if len(each) > 1 else each[0]

    def _legal_actions(self, agent: str, acting_agents: list[str]) -> list[int]:
        labels = _make_action_adapters(self._name)[agent].action_set.labels
        if agent not in acting_agents:
            return [len(labels)]
        seen, info = self._last_observations[agent], self._infos.get(agent, {})
        if self._is_turn_based:
            info = self._env.infos.get(agent, {})
        mask = seen.get(ACTION_MASK_KEY) if isinstance(seen, dict) else None
        mask = info.get(ACTION_MASK_KEY) if mask is None else mask
        able = [n for n, may in enumerate(mask if mask is not None else ()) if may]
        return able or list(range(len(labels)))


@dataclass(frozen=True)
class PettingZooProblem(EnvironmentProblem):
    """An environment of several agents, of which only their observations are known."""

    @cached_property
    def agents(self) -> tuple[str, ...]:
        """Those that may come to act."""
        return tuple(_make_example_environment(self.name).possible_agents)

    @cached_property
    def actions(self) -> tuple[Labels | Interval, ...]:
        """Those of its spaces, and to wait."""
        known = [_make_action_adapters(self.name)[agent].action_set for agent in self.agents]
        return tuple(
            Labels((*one, WAIT_LABEL)) if isinstance(one, Labels) else one for one in known
        )

    @cached_property
    def observations(self) -> tuple[RealVector, ...]:
        """The numbers of its spaces, as many for each agent."""
        sizes = {
            flat_dimension(_observation_space(self.name, agent), self.name) for agent in self.agents
        }
        if len(sizes) > 1:
            raise BadParameter(f"{self.name}: its agents observe more or fewer numbers than others")
        return (make_numbers_space(sizes.pop(), self.name),) * len(self.agents)

    def make_environment(self) -> ExternalEnvironment:
        """An environment of its own."""
        return PettingZooEnvironment(self.name)

    def description(self) -> str:
        """The environment's name."""
        return parse_library_call(self.name.partition(":")[2]).name

    def draw_observation(self, seen: Array) -> str:
        """A board, where what is observed are planes of one: whose what is, as the seat sees it."""
        shape = _observation_space(self.name, self.agents[0]).shape
        if len(shape) != 3 or shape[2] >= len(PLANE_SYMBOLS):
            return ""
        planes = seen.reshape(shape).astype(bool)
        whose = (planes * np.arange(1, shape[2] + 1)).max(axis=2)
        return "\n".join(" ".join(PLANE_SYMBOLS[one] for one in row) for row in whose)

    def check_playable(self) -> None:
        """Refuses spaces that cannot be played."""
        known = self.actions, self.observations
        if not all(isinstance(one, Labels) for one in known[0]) and _is_turn_based(
            self.name
        ):
            raise BadParameter(f"{self.name}: agents act with numbers in turns; dmplay cannot wait")
