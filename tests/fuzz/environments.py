"""Random calls of the environments, with arguments that fit or do not."""

import traceback
from collections.abc import Callable
from random import Random
from typing import TYPE_CHECKING, Any

import numpy as np

from dmplay.errors import DmplayError
from tests.fuzz.case import Case, CaseOutcome

if TYPE_CHECKING:
    from dmplay.gym import VectorEnv

PROBLEMS = ("hexworld", "crying-baby", "simple-regulator", "rock-paper-scissors", "cart-pole")
ROWS, CALLS = 3, 6
NONSENSE: tuple[Any, ...] = (
    None, True, -1, 0, 1, 2, 7, 10**20, 0.5, float("nan"), float("inf"), 1j, "", "e", "ansi", b"x",
    [], [0], [0, 1, 2], (0, 1, 2), [[0], [1]], [0, [1]], [None] * ROWS, {}, {"agent": 0}, object(),
    np.array(1), np.array([0, 1, 2]), np.zeros(ROWS), np.zeros((ROWS, 1)), np.array(["a"] * ROWS),
    np.array([None] * ROWS), np.ones(ROWS, bool), np.zeros(ROWS, bool), np.array([True, False]),
    np.array([True, False, True]), np.array([0.0, np.nan, 1.0]), lambda: None, int,
)  # fmt: skip


def draw_environment_case(random: Random) -> Case:
    """Draw the number from which all calls of a case follow."""
    return Case((str(random.getrandbits(40)),))


def run_environment_case(case: Case) -> CaseOutcome:
    """Make an environment and call it; errors of dmplay are the only ones that it may raise."""
    random, refused = Random(case.words[0]), 0
    calls: list[Callable[[], object]] = []
    problem = random.choice(PROBLEMS)
    for _ in range(CALLS):
        try:
            if not calls or random.random() < 0.1:
                calls = _make_environment(random, problem)
            random.choice(calls)()
        except DmplayError:
            refused += 1
        except Exception as error:
            return CaseOutcome(type(error).__name__, trace=traceback.format_exc())
    return CaseOutcome("refused" if refused else "played")


def _make_environment(random: Random, problem: str) -> list[Callable[[], object]]:
    """Make an environment and return the calls that a case chooses from."""
    from dmplay.gym import Env, VectorEnv
    from dmplay.zoo import ParallelEnv

    environment_class = random.choice((Env, VectorEnv, VectorEnv, ParallelEnv))
    arguments: dict[str, Any] = {"turns": 2}
    if environment_class is VectorEnv:
        arguments |= {"num_envs": ROWS, "uniforms": random.choice(("recorded", "fast"))}
    if random.random() < 0.1:
        is_vector = environment_class is VectorEnv
        names = ("num_envs", "uniforms", "seat") if is_vector else ("render_mode", "turns")
        arguments[random.choice(names)] = random.choice(NONSENSE)
    env = environment_class(problem, **arguments)
    if isinstance(env, VectorEnv) and arguments["uniforms"] == "recorded" and env.num_envs == ROWS:
        return [lambda: _reset_rows(random, env, problem), *_list_calls(random, env)]
    return _list_calls(random, env)


def _list_calls(random: Random, env: Any) -> list[Callable[[], object]]:
    """Return calls of an environment with valid and invalid arguments."""

    def draw_options() -> object:
        key = random.choice(("episode", "reset_mask", "options", 1))
        return random.choice((None, {}, {key: random.choice(NONSENSE)}, random.choice(NONSENSE)))

    def step() -> object:
        spaces = getattr(env, "possible_agents", None)
        valid = (
            {agent: env.action_space(agent).sample() for agent in spaces}
            if spaces
            else env.action_space.sample()
        )
        return env.step(valid if random.random() < 0.5 else random.choice(NONSENSE))

    return [
        lambda: env.reset(seed=random.choice((None, 5))),
        lambda: env.reset(seed=random.choice(NONSENSE), options=draw_options()),
        lambda: env.reset(options=draw_options()),
        step,
        step,
        env.render,
        env.action_masks,
    ]


def _reset_rows(random: Random, env: "VectorEnv", problem: str) -> None:
    """Reset rows with seeds of their own, and compare them with single environments."""
    from dmplay.gym import Env

    seeds = [random.randrange(100) for _ in range(ROWS)]
    make_seeds = random.choice((list, tuple, np.array))
    previous, _ = env.reset(seed=make_seeds(seeds))  # type: ignore[arg-type]
    single = Env(problem, turns=2)
    assert all(
        np.array_equal(previous[row], single.reset(seed=seed)[0]) for row, seed in enumerate(seeds)
    ), f"{problem}: the rows are not episode 0 of the seeds {seeds}"
    mask = np.array([True, False, random.random() < 0.5])
    observations, _ = env.reset(seed=seeds[::-1], options={"reset_mask": mask})
    expected = [
        single.reset(seed=seed)[0] if is_reset else previous[row]
        for row, (seed, is_reset) in enumerate(zip(seeds[::-1], mask, strict=True))
    ]
    assert np.array_equal(observations, np.array(expected)), f"{problem}: wrong rows of {mask}"
