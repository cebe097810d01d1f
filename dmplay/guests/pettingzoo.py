"""Environments of PettingZoo, in which all act at once or in turns: `pettingzoo:classic/rps-v2`."""

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

import numpy as np

from dmplay.chance import Array
from dmplay.core import WAIT, Interval, Labels, Numbers, Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.guests.extras import RAISED, called, first_line, library
from dmplay.guests.history import Environment, Known, World, seed, sight
from dmplay.guests.spaces import Actions, numbers, size

EXTRA = "pettingzoo"
ACTIONS: Mapping[str, str] = {"classic/rps-v2": "rock paper scissors"}
MASK = "action_mask"
PLANES = ".xo"  # of a board: free, the first's, the second's


def find(name: str) -> Problem:
    """The environment of this name."""
    made = Observed(name=name)
    made.check()
    return made


def names() -> list[str]:
    """The environments of both registries."""
    pettingzoo = library("pettingzoo", EXTRA, EXTRA)
    return sorted({*pettingzoo.aec_registry, *pettingzoo.parallel_registry})


def _made(name: str) -> Any:
    """The environment, one in which all act at once where it has such a form."""
    pettingzoo = library("pettingzoo", EXTRA, name)
    from pettingzoo.env_registry.exceptions import FailedToImport

    wanted = called(name.partition(":")[2])
    known = {**pettingzoo.aec_registry, **pettingzoo.parallel_registry}
    if wanted.name not in known:
        raise UnknownName("environment", wanted.name, known, where=EXTRA)
    form = "parallel" if wanted.name in pettingzoo.parallel_registry else "aec"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return pettingzoo.make(form, wanted.name, **wanted.given)
        except (*RAISED, FailedToImport) as error:
            raise BadParameter(f"{name}: {first_line(error)}") from None


@cache
def _example(name: str) -> Any:
    """An environment that is asked what it is, and never played."""
    return _made(name)


@cache
def _actions(name: str) -> dict[str, Actions]:
    env = _example(name)
    words = ACTIONS.get(called(name.partition(":")[2]).name, "").split()
    return {agent: Actions(env.action_space(agent), name, words) for agent in env.possible_agents}


def _space(name: str, agent: str) -> Any:
    """What an agent observes, beside what it may do."""
    space = _example(name).observation_space(agent)
    return space["observation"] if MASK in getattr(space, "spaces", ()) else space


def _turned(name: str) -> bool:
    """Whether agents act in turns."""
    return hasattr(_example(name), "agent_selection") or hasattr(_example(name), "last")


class Playing(World):
    """An environment that is played."""

    def __init__(self, name: str) -> None:
        self._name, self._env = name, _made(name)
        self._agents: list[str] = list(self._env.possible_agents)
        self._turned = _turned(name)
        self._last: dict[str, Any] = {}  # what each observed
        self._info: Mapping[str, Any] = {}

    def begin(self, draw: float) -> Known:
        """The draw seeds its generator."""
        came = self._env.reset(seed=seed(draw))
        if not self._turned:
            self._last, self._info = dict(came[0]), came[1]
        return self._known({})

    def act(self, actions: tuple[float, ...], draw: float) -> Known:
        """The draw seeds its generator anew, where it says which that is."""
        from gymnasium.utils.seeding import np_random

        if hasattr(self._env.unwrapped, "np_random"):
            self._env.unwrapped.np_random = np_random(seed(draw))[0]
        known = _actions(self._name)
        done = {
            a: known[a].of(act)
            for a, act in zip(self._agents, actions, strict=True)
            if a in self._asked
        }
        if not self._turned:
            seen, rewards, *_, self._info = self._env.step(done)
            self._last |= seen
            return self._known(rewards)
        self._env.step(done[self._env.agent_selection])
        paid = dict(self._env.rewards)
        while self._env.agents and self._gone(self._env.agent_selection):
            self._env.step(None)
        return self._known(paid)

    def copy(self) -> None:
        """There is none: copies of an environment are fresh ones."""

    def _gone(self, agent: str) -> bool:
        return bool(self._env.terminations[agent] or self._env.truncations[agent])

    @property
    def _asked(self) -> list[str]:
        """Who is to act."""
        env = self._env
        return [env.agent_selection] if self._turned and env.agents else list(env.agents)

    def _known(self, rewards: Mapping[str, float]) -> Known:
        env, asked = self._env, self._asked
        if self._turned:
            self._last |= {agent: env.observe(agent) for agent in env.agents}
        able = tuple(self._legal(agent, asked) for agent in self._agents)
        told = [self._told(agent) for agent in self._agents]
        paid = tuple(float(rewards.get(agent, 0.0)) for agent in self._agents)
        return Known(paid, not env.agents, able, tuple(told))

    def _told(self, agent: str) -> object:
        """What an agent observed last."""
        seen = self._last[agent]
        seen = seen["observation"] if isinstance(seen, dict) and MASK in seen else seen
        each = numbers(_space(self._name, agent), seen)
        return tuple(each) if len(each) > 1 else each[0]

    def _legal(self, agent: str, asked: list[str]) -> list[int]:
        labels = _actions(self._name)[agent].known.labels
        if agent not in asked:
            return [len(labels)]
        seen, info = self._last[agent], self._info.get(agent, {})
        if self._turned:
            info = self._env.infos.get(agent, {})
        mask = seen.get(MASK) if isinstance(seen, dict) else None
        mask = info.get(MASK) if mask is None else mask
        able = [n for n, may in enumerate(mask if mask is not None else ()) if may]
        return able or list(range(len(labels)))


@dataclass(frozen=True)
class Observed(Environment):
    """An environment of several agents, of which only their observations are known."""

    @cached_property
    def agents(self) -> tuple[str, ...]:
        """Those that may come to act."""
        return tuple(_example(self.name).possible_agents)

    @cached_property
    def actions(self) -> tuple[Labels | Interval, ...]:
        """Those of its spaces, and to wait."""
        known = [_actions(self.name)[agent].known for agent in self.agents]
        return tuple(Labels((*one, WAIT)) if isinstance(one, Labels) else one for one in known)

    @cached_property
    def observations(self) -> tuple[Numbers, ...]:
        """The numbers of its spaces, as many for each agent."""
        sizes = {size(_space(self.name, agent), self.name) for agent in self.agents}
        if len(sizes) > 1:
            raise BadParameter(f"{self.name}: its agents observe more or fewer numbers than others")
        return (sight(sizes.pop(), self.name),) * len(self.agents)

    def world(self) -> World:
        """An environment of its own."""
        return Playing(self.name)

    def story(self) -> str:
        """The environment's name."""
        return called(self.name.partition(":")[2]).name

    def glimpse(self, seen: Array) -> str:
        """A board, where what is observed are planes of one: whose what is, as the seat sees it."""
        shape = _space(self.name, self.agents[0]).shape
        if len(shape) != 3 or shape[2] >= len(PLANES):
            return ""
        planes = seen.reshape(shape).astype(bool)
        whose = (planes * np.arange(1, shape[2] + 1)).max(axis=2)
        return "\n".join(" ".join(PLANES[one] for one in row) for row in whose)

    def check(self) -> None:
        """Refuses spaces that cannot be played."""
        known = self.actions, self.observations
        if not all(isinstance(one, Labels) for one in known[0]) and _turned(self.name):
            raise BadParameter(f"{self.name}: agents act with numbers in turns; dmplay cannot wait")
