"""Environments of Gymnasium: `gymnasium:FrozenLake-v1`, `gymnasium:FrozenLake-v1(map_name=8x8)`."""

import inspect
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from dmplay.core import Interval, Labels, Problem, RealVector
from dmplay.errors import BadParameter, UnknownName
from dmplay.guests import tabled
from dmplay.guests.extras import LIBRARY_ERRORS, import_library, parse_library_call, summarize_error
from dmplay.guests.history import (
    EnvironmentProblem,
    ExternalEnvironment,
    TimeStep,
    make_numbers_space,
    seed_from_uniform,
)
from dmplay.guests.spaces import ActionSpaceAdapter, flat_dimension, flatten_observation

PIP_EXTRA = "gymnasium"
VERSION_PATTERN = re.compile(r"-v\d+$")
ACTION_NAMES: Mapping[str, str] = {  # as their descriptions have them; the spaces only count
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


def load_problem(name: str) -> Problem:
    """The environment of this name: by its tables where it tells them, else as it is."""
    env = _make_raw_environment(name)
    if tabled.has_transition_table(env.unwrapped):
        return GymnasiumTableProblem(name=name)
    made = GymnasiumProblem(name=name)
    made.check_playable()
    return made


def list_problem_names() -> list[str]:
    """The environments of a registry."""
    return sorted(import_library("gymnasium", PIP_EXTRA, PIP_EXTRA).registry)


def _make_raw_environment(name: str, **overrides: object) -> Any:
    """The environment; raises UnknownName or BadParameter in one line."""
    gymnasium = import_library("gymnasium", PIP_EXTRA, name)
    wanted = parse_library_call(name.partition(":")[2])
    if wanted.name not in gymnasium.registry and ":" not in wanted.name:
        raise UnknownName("environment", wanted.name, gymnasium.registry, error_prefix=PIP_EXTRA)
    given = {"disable_env_checker": True, "max_episode_steps": -1, **wanted.arguments, **overrides}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return gymnasium.make(wanted.name, **given)
        except (*LIBRARY_ERRORS, gymnasium.error.Error) as error:
            raise BadParameter(f"{name}: {summarize_error(error)}") from None


@cache
def _make_example_environment(name: str) -> Any:
    """An environment that is asked what it is, and never played."""
    return _make_raw_environment(name)


@cache
def _make_text_renderer(name: str) -> Any:
    """An environment that draws states; None where it draws none in text."""
    modes = _make_example_environment(name).unwrapped.metadata.get("render_modes") or ()
    return _make_raw_environment(name, render_mode="ansi").unwrapped if "ansi" in modes else None


def _make_action_adapter(name: str) -> ActionSpaceAdapter:
    base = VERSION_PATTERN.sub("", parse_library_call(name.partition(":")[2]).name)
    return ActionSpaceAdapter(
        _make_example_environment(name).action_space, name, ACTION_NAMES.get(base, "").split()
    )


def _max_episode_steps(name: str) -> int | None:
    spec = _make_example_environment(name).spec
    gymnasium = import_library("gymnasium", PIP_EXTRA, name)
    turns: int | None = gymnasium.spec(spec.id).max_episode_steps
    return turns


def _describe_environment(name: str) -> str:
    """The first paragraph of an environment's description."""
    told = inspect.getdoc(type(_make_example_environment(name).unwrapped)) or ""
    parts = [part for part in told.split("\n\n") if part and not part.startswith("#")]
    first = parts[0] if parts else parse_library_call(name.partition(":")[2]).name
    return " ".join(row for row in first.split("\n") if not row.startswith("#"))


class GymnasiumEnvironment(ExternalEnvironment):
    """An environment that is played."""

    def __init__(self, name: str) -> None:
        self._env = _make_raw_environment(name)
        self._action_adapter = _make_action_adapter(name)

    def reset(self, draw: float) -> TimeStep:
        """The draw seeds its generator."""
        seen, info = self._env.reset(seed=seed_from_uniform(draw))
        return self._make_time_step(seen, 0.0, info, over=False)

    def step(self, actions: tuple[float, ...], draw: float) -> TimeStep:
        """The draw seeds its generator anew."""
        from gymnasium.utils.seeding import np_random

        self._env.unwrapped.np_random = np_random(seed_from_uniform(draw))[0]
        action = self._action_adapter.to_space_value(actions[0])
        seen, reward, over, cut, info = self._env.step(action)
        return self._make_time_step(seen, float(reward), info, over=bool(over or cut))

    def clone(self) -> None:
        """There is none: copies of an environment are fresh ones."""

    def _make_time_step(
        self, observation: Any, reward: float, info: Mapping[str, Any], *, over: bool
    ) -> TimeStep:
        able = [n for n, may in enumerate(info.get("action_mask", ())) if may]
        told = flatten_observation(self._env.observation_space, observation)
        shown = tuple(told) if len(told) > 1 else told[0]
        return TimeStep((reward,), over, (able,) if able else None, (shown,))


@dataclass(frozen=True)
class GymnasiumProblem(EnvironmentProblem):
    """An environment of which only its observations are known."""

    @cached_property
    def actions(self) -> tuple[Labels | Interval]:
        """Those of its space."""
        return (_make_action_adapter(self.name).action_set,)

    @cached_property
    def observations(self) -> tuple[RealVector]:
        """The numbers of its space."""
        return (
            make_numbers_space(
                flat_dimension(_make_example_environment(self.name).observation_space, self.name),
                self.name,
            ),
        )

    @property
    def horizon(self) -> int | None:
        """After how many turns it is cut off."""
        return _max_episode_steps(self.name)

    def make_environment(self) -> ExternalEnvironment:
        """An environment of its own."""
        return GymnasiumEnvironment(self.name)

    def description(self) -> str:
        """The environment's own description."""
        return _describe_environment(self.name)

    def check_playable(self) -> None:
        """Refuses spaces that cannot be played."""
        _ = self.actions, self.observations


@dataclass(frozen=True)
class GymnasiumTableProblem(tabled.TableProblem):
    """An environment that tells its tables."""

    @cached_property
    def transition_table(self) -> tabled.TransitionTable:
        """Its tables."""
        return tabled.read_transition_table(_make_example_environment(self.name).unwrapped)

    @cached_property
    def actions(self) -> tuple[Labels | Interval]:
        """Those of its space."""
        return (_make_action_adapter(self.name).action_set,)

    @property
    def horizon(self) -> int | None:
        """After how many turns it is cut off."""
        return _max_episode_steps(self.name)

    def description(self) -> str:
        """The environment's own description."""
        return _describe_environment(self.name)

    def render_table_state(self, state: int) -> str:
        """The environment's drawing of a state, where it draws any in text."""
        env = _make_text_renderer(self.name)
        if env is None:
            return ""
        env.s, env.lastaction = state, None
        return str(env.render())
