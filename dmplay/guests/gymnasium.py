"""Environments of Gymnasium: `gymnasium:FrozenLake-v1`, `gymnasium:FrozenLake-v1(map_name=8x8)`."""

import inspect
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from dmplay.core import Interval, Labels, Numbers, Problem
from dmplay.errors import BadParameter, UnknownName
from dmplay.guests import tabled
from dmplay.guests.extras import RAISED, called, first_line, library
from dmplay.guests.history import Environment, Known, World, seed, sight
from dmplay.guests.spaces import Actions, numbers, size

EXTRA = "gymnasium"
VERSION = re.compile(r"-v\d+$")
ACTIONS: Mapping[str, str] = {  # as their descriptions have them; the spaces only count
    "Acrobot": "left none right",
    "Blackjack": "stick hit",
    "CartPole": "left right",
    "CliffWalking": "up right down left",
    "CliffWalkingSlippery": "up right down left",
    "FrozenLake": "left down right up",
    "FrozenLake8x8": "left down right up",
    "LunarLander": "none left main right",
    "MountainCar": "left none right",
    "Taxi": "south north east west pickup dropoff",
}


def find(name: str) -> Problem:
    """The environment of this name: by its tables where it tells them, else as it is."""
    env = _made(name)
    if tabled.tells(env.unwrapped):
        return Tabled(name=name)
    made = Observed(name=name)
    made.check()
    return made


def names() -> list[str]:
    """The environments of a registry."""
    return sorted(library("gymnasium", EXTRA, EXTRA).registry)


def _made(name: str, **more: object) -> Any:
    """The environment; raises UnknownName or BadParameter in one line."""
    gymnasium = library("gymnasium", EXTRA, name)
    wanted = called(name.partition(":")[2])
    if wanted.name not in gymnasium.registry and ":" not in wanted.name:
        raise UnknownName("environment", wanted.name, gymnasium.registry, where=EXTRA)
    given = {"disable_env_checker": True, "max_episode_steps": -1, **wanted.given, **more}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return gymnasium.make(wanted.name, **given)
        except (*RAISED, gymnasium.error.Error) as error:
            raise BadParameter(f"{name}: {first_line(error)}") from None


@cache
def _example(name: str) -> Any:
    """An environment that is asked what it is, and never played."""
    return _made(name)


@cache
def _drawing(name: str) -> Any:
    """An environment that draws states; None where it draws none in text."""
    modes = _example(name).unwrapped.metadata.get("render_modes") or ()
    return _made(name, render_mode="ansi").unwrapped if "ansi" in modes else None


def _actions(name: str) -> Actions:
    base = VERSION.sub("", called(name.partition(":")[2]).name)
    return Actions(_example(name).action_space, name, ACTIONS.get(base, "").split())


def _turns(name: str) -> int | None:
    spec = _example(name).spec
    gymnasium = library("gymnasium", EXTRA, name)
    turns: int | None = gymnasium.spec(spec.id).max_episode_steps
    return turns


def _story(name: str) -> str:
    """The first paragraph of an environment's description."""
    told = inspect.getdoc(type(_example(name).unwrapped)) or ""
    parts = [part for part in told.split("\n\n") if part and not part.startswith("#")]
    first = parts[0] if parts else called(name.partition(":")[2]).name
    return " ".join(row for row in first.split("\n") if not row.startswith("#"))


class Playing(World):
    """An environment that is played."""

    def __init__(self, name: str) -> None:
        self._env = _made(name)
        self._actions = _actions(name)

    def begin(self, draw: float) -> Known:
        """The draw seeds its generator."""
        seen, info = self._env.reset(seed=seed(draw))
        return self._known(seen, 0.0, info, over=False)

    def act(self, actions: tuple[float, ...], draw: float) -> Known:
        """The draw seeds its generator anew."""
        from gymnasium.utils.seeding import np_random

        self._env.unwrapped.np_random = np_random(seed(draw))[0]
        action = self._actions.of(actions[0])
        seen, reward, over, cut, info = self._env.step(action)
        return self._known(seen, float(reward), info, over=bool(over or cut))

    def copy(self) -> None:
        """There is none: copies of an environment are fresh ones."""

    def _known(self, seen: Any, reward: float, info: Mapping[str, Any], *, over: bool) -> Known:
        able = [n for n, may in enumerate(info.get("action_mask", ())) if may]
        told = numbers(self._env.observation_space, seen)
        shown = tuple(told) if len(told) > 1 else told[0]
        return Known((reward,), over, (able,) if able else None, (shown,))


@dataclass(frozen=True)
class Observed(Environment):
    """An environment of which only its observations are known."""

    @cached_property
    def actions(self) -> tuple[Labels | Interval]:
        """Those of its space."""
        return (_actions(self.name).known,)

    @cached_property
    def observations(self) -> tuple[Numbers]:
        """The numbers of its space."""
        return (sight(size(_example(self.name).observation_space, self.name), self.name),)

    @property
    def horizon(self) -> int | None:
        """After how many turns it is cut off."""
        return _turns(self.name)

    def world(self) -> World:
        """An environment of its own."""
        return Playing(self.name)

    def story(self) -> str:
        """The environment's own description."""
        return _story(self.name)

    def check(self) -> None:
        """Refuses spaces that cannot be played."""
        _ = self.actions, self.observations


@dataclass(frozen=True)
class Tabled(tabled.Tabled):
    """An environment that tells its tables."""

    @cached_property
    def told(self) -> tabled.Told:
        """Its tables."""
        return tabled.told(_example(self.name).unwrapped)

    @cached_property
    def actions(self) -> tuple[Labels | Interval]:
        """Those of its space."""
        return (_actions(self.name).known,)

    @property
    def horizon(self) -> int | None:
        """After how many turns it is cut off."""
        return _turns(self.name)

    def story(self) -> str:
        """The environment's own description."""
        return _story(self.name)

    def drawn(self, state: int) -> str:
        """The environment's drawing of a state, where it draws any in text."""
        env = _drawing(self.name)
        if env is None:
            return ""
        env.s, env.lastaction = state, None
        return str(env.render())
