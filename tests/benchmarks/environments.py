"""Measure the cost per turn in the loops of other libraries, and of bare steps with uniforms."""

from collections.abc import Callable
from statistics import median
from time import perf_counter, process_time

import numpy as np
from gymnasium.envs.classic_control.cartpole import CartPoleVectorEnv
from gymnasium.vector import VectorEnv as GymnasiumVectorEnv

import dmplay
from dmplay.core.uniforms import make_numpy_generator
from dmplay.gym import Env, VectorEnv
from dmplay.zoo import ParallelEnv

ROW_COUNT, TURNS_PER_RUN = 256, 500
PEER_ROW_COUNTS = (64, 256, 1024, 10_000)
PROBLEMS = ("hexworld", "cart-pole", "predator-prey")

PlayTurn = Callable[[], object]


def _make_bare_step(name: str, rows: int) -> PlayTurn:
    """Return a function that draws uniforms and steps the problem, and does nothing else."""
    problem = dmplay.load_problem(name)
    random = make_numpy_generator(1).random
    s = problem.sample_initial_states(random((rows, problem.uniform_counts.start)))
    a = np.zeros((rows, len(problem.agents)), np.int64)
    return lambda: problem.step(s, a, random((rows, problem.uniform_counts.step)))


def _make_vector_env_step(name: str, dice: str) -> PlayTurn:
    env = VectorEnv(name, ROW_COUNT, uniforms=dice)
    env.reset(seed=1)
    actions = env.action_space.sample()
    return lambda: env.step(actions)


def _make_env_step(name: str) -> PlayTurn:
    env = Env(name)
    env.reset(seed=1)

    def turn() -> None:
        _, _, terminated, truncated, _ = env.step(0)
        if terminated or truncated:
            env.reset()

    return turn


def _make_parallel_env_step(name: str) -> PlayTurn:
    env = ParallelEnv(name)
    env.reset(seed=1)

    def turn() -> None:
        env.step(dict.fromkeys(env.agents, 0))
        if not env.agents:
            env.reset()

    return turn


def report(runs: int) -> None:
    """Print millions of turns per second, and the time per turn as a multiple of a bare step."""
    print(f"loops of other libraries, medians of {runs} runs: million turns a second, times a step")
    for name in PROBLEMS:
        batch_loops = {
            "step": _make_bare_step(name, ROW_COUNT),
            "VectorEnv, fast dice": _make_vector_env_step(name, "fast"),
            "VectorEnv, recorded": _make_vector_env_step(name, "recorded"),
        }
        single_loops = {
            "step": _make_bare_step(name, 1),
            "Env": _make_env_step(name),
            "ParallelEnv": _make_parallel_env_step(name),
        }
        for rows, loops in ((ROW_COUNT, batch_loops), (1, single_loops)):
            rates_by_loop: dict[str, list[float]] = {loop_name: [] for loop_name in loops}
            for _ in range(runs):
                for loop_name, turn in loops.items():
                    start_time = perf_counter()
                    for _ in range(TURNS_PER_RUN):
                        turn()
                    rates_by_loop[loop_name].append(
                        TURNS_PER_RUN * rows / (perf_counter() - start_time) / 1e6
                    )
            bare = median(rates_by_loop["step"])
            for loop_name, rates in rates_by_loop.items():
                rate = median(rates)
                label = f"{loop_name}, {rows} row{'s' * (rows > 1)}"
                print(f"  {name:<15}{label:<32}{rate:8.4f} {bare / rate:7.1f}")
    _compare_with_gymnasium(runs)


def _measure_steps(env: GymnasiumVectorEnv, steps: int) -> float:
    """Return the processor time of a step of random actions, in microseconds."""
    actions = [env.action_space.sample() for _ in range(steps)]
    start_time = process_time()
    for action in actions:
        env.step(action)
    return (process_time() - start_time) / steps * 1e6


def _compare_with_gymnasium(runs: int) -> None:
    """Print the time of a step of cart-pole with fast dice, and of Gymnasium's, interleaved."""
    for rows in PEER_ROW_COUNTS:
        ours = VectorEnv("cart-pole:gym", rows, uniforms="fast")
        peer = CartPoleVectorEnv(num_envs=rows)
        for env in (ours, peer):
            env.reset(seed=1)
        pairs = [(_measure_steps(ours, 200), _measure_steps(peer, 200)) for _ in range(4 * runs)]
        best, best_peer = map(min, zip(*pairs, strict=True))
        print(f"  cart-pole, {rows} rows: {best:.1f} us a step, Gymnasium {best_peer:.1f} us, "
              f"ratio {best_peer / best:.2f}")  # fmt: skip
