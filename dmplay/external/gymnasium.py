"""Environments of Gymnasium: `gymnasium:FrozenLake-v1`, `gymnasium:FrozenLake-v1(map_name=8x8)`."""

import inspect
import re
import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from typing import Any

from dmplay.core.problem import Problem
from dmplay.core.spaces import Interval, Labels, RealVector
from dmplay.errors import BadParameter, UnknownName
from dmplay.external import transition_tables
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

PIP_EXTRA = "gymnasium"
VERSION_PATTERN = re.compile(r"-v\d+$")
# from the environments' descriptions, since their spaces only number the actions
ACTION_NAMES: Mapping[str, str] = {
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
    """Return the environment as a problem, with its transition table if it has one.

    Raises UnknownName if there is none of this name, or BadParameter if it cannot be played.
    """
    env = _make_raw_environment(name)
    if transition_tables.has_transition_table(env.unwrapped):
        return GymnasiumTableProblem(name=name)
    problem = GymnasiumProblem(name=name)
    problem.check_playable()
    return problem


def list_problem_names() -> list[str]:
    """Return the sorted names of all registered environments."""
    return sorted(import_library("gymnasium", PIP_EXTRA, PIP_EXTRA).registry)


def _make_raw_environment(name: str, **overrides: object) -> Any:
    """Return a new environment; raise UnknownName or BadParameter with a message of one line."""
    gymnasium = import_library("gymnasium", PIP_EXTRA, name)
    call = parse_library_call(name.partition(":")[2])
    if call.name not in gymnasium.registry and ":" not in call.name:
        raise UnknownName("environment", call.name, gymnasium.registry, error_prefix=PIP_EXTRA)
    options = {"disable_env_checker": True, "max_episode_steps": -1, **call.arguments, **overrides}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        try:
            return gymnasium.make(call.name, **options)
        except (*LIBRARY_ERRORS, gymnasium.error.Error) as error:
            raise BadParameter(f"{name}: {summarize_error(error)}") from None


@cache
def _make_example_environment(name: str) -> Any:
    """Return an environment that is only inspected, never played."""
    return _make_raw_environment(name)


@cache
def _make_text_renderer(name: str) -> Any:
    """Return an environment that renders states as text; None if it cannot."""
    modes = _make_example_environment(name).unwrapped.metadata.get("render_modes") or ()
    return _make_raw_environment(name, render_mode="ansi").unwrapped if "ansi" in modes else None


def _make_action_adapter(name: str) -> ActionSpaceAdapter:
    """Return the adapter of the environment's action space, with its known action names."""
    base = VERSION_PATTERN.sub("", parse_library_call(name.partition(":")[2]).name)
    return ActionSpaceAdapter(
        _make_example_environment(name).action_space, name, ACTION_NAMES.get(base, "").split()
    )


def _max_episode_steps(name: str) -> int | None:
    """Return the number of turns after which an episode is truncated; None if there is no limit."""
    spec = _make_example_environment(name).spec
    gymnasium = import_library("gymnasium", PIP_EXTRA, name)
    turns: int | None = gymnasium.spec(spec.id).max_episode_steps
    return turns


def _describe_environment(name: str) -> str:
    """Return the first paragraph of the environment's docstring, or its name if it has none."""
    docstring = inspect.getdoc(type(_make_example_environment(name).unwrapped)) or ""
    paragraphs = [
        paragraph
        for paragraph in docstring.split("\n\n")
        if paragraph and not paragraph.startswith("#")
    ]
    description = paragraphs[0] if paragraphs else parse_library_call(name.partition(":")[2]).name
    return " ".join(row for row in description.split("\n") if not row.startswith("#"))


class GymnasiumEnvironment(ExternalEnvironment):
    """A Gymnasium environment that is being played."""

    def __init__(self, name: str) -> None:
        self._env = _make_raw_environment(name)
        self._action_adapter = _make_action_adapter(name)

    def reset(self, uniform: float) -> TimeStep:
        """Reset the environment with a seed made from the uniform."""
        observation, info = self._env.reset(seed=seed_from_uniform(uniform))
        return self._make_time_step(observation, 0.0, info, over=False)

    def step(self, actions: tuple[float, ...], uniform: float) -> TimeStep:
        """Play a turn, after reseeding the environment's generator from the uniform."""
        from gymnasium.utils.seeding import np_random

        self._env.unwrapped.np_random = np_random(seed_from_uniform(uniform))[0]
        action = self._action_adapter.to_space_value(actions[0])
        observation, reward, terminated, truncated, info = self._env.step(action)
        return self._make_time_step(
            observation, float(reward), info, over=bool(terminated or truncated)
        )

    def clone(self) -> None:
        """Return None: an environment cannot be cloned, only created again."""

    def _make_time_step(
        self, observation: Any, reward: float, info: Mapping[str, Any], *, over: bool
    ) -> TimeStep:
        """Return the time step after a reset or a turn, with the legal actions in `info`."""
        legal_actions = [n for n, is_legal in enumerate(info.get("action_mask", ())) if is_legal]
        values = flatten_observation(self._env.observation_space, observation)
        flat_observation = tuple(values) if len(values) > 1 else values[0]
        return TimeStep(
            (reward,), over, (legal_actions,) if legal_actions else None, (flat_observation,)
        )


@dataclass(frozen=True)
class GymnasiumProblem(EnvironmentProblem):
    """A Gymnasium environment without a transition table: only its observations are available."""

    @cached_property
    def actions(self) -> tuple[Labels | Interval]:
        """The actions of the environment's action space."""
        return (_make_action_adapter(self.name).action_set,)

    @cached_property
    def observations(self) -> tuple[RealVector]:
        """The observation as a vector of all numbers in the environment's observation space."""
        return (
            make_numbers_space(
                flat_dimension(_make_example_environment(self.name).observation_space, self.name),
                self.name,
            ),
        )

    @property
    def horizon(self) -> int | None:
        """The number of turns after which an episode is truncated; None if there is no limit."""
        return _max_episode_steps(self.name)

    def make_environment(self) -> ExternalEnvironment:
        """Return a new environment of this name."""
        return GymnasiumEnvironment(self.name)

    def description(self) -> str:
        """Return the environment's own description."""
        return _describe_environment(self.name)

    def check_playable(self) -> None:
        """Raise BadParameter if the action or observation space cannot be played."""
        _ = self.actions, self.observations


@dataclass(frozen=True)
class GymnasiumTableProblem(transition_tables.TableProblem):
    """A Gymnasium environment with a transition table."""

    @cached_property
    def transition_table(self) -> transition_tables.TransitionTable:
        """The environment's transition table."""
        return transition_tables.read_transition_table(
            _make_example_environment(self.name).unwrapped
        )

    @cached_property
    def actions(self) -> tuple[Labels | Interval]:
        """The actions of the environment's action space."""
        return (_make_action_adapter(self.name).action_set,)

    @property
    def horizon(self) -> int | None:
        """The number of turns after which an episode is truncated; None if there is no limit."""
        return _max_episode_steps(self.name)

    def description(self) -> str:
        """Return the environment's own description."""
        return _describe_environment(self.name)

    def render_table_state(self, state: int) -> str:
        """Return the environment's text rendering of a state; '' if it has none."""
        env = _make_text_renderer(self.name)
        if env is None:
            return ""
        env.s, env.lastaction = state, None
        return str(env.render())
