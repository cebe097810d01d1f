"""Mean returns of simulated games that begin with an action, for agents without action values."""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import Problem, build_percept, validate_outcome
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.core.work_budget import Budget
from dmplay.game.position import Position

GAME_COUNT = 400  # simulated games for each first action
SIMULATION_SEED = 1  # the same random numbers for every first action
MAX_TURNS = 200  # maximum turns of a simulated game


class ActionSimulation(NamedTuple):
    """The returns of simulated games that begin with one action."""

    first_rewards: Reals  # [N]
    returns: Reals  # [N]
    turns: int  # number of turns of each game at most

    @property
    def mean(self) -> float:
        """The mean return."""
        return float(self.returns.mean())


def can_simulate(problem: Problem) -> bool:
    """Return whether games can be simulated from the current state without other agents."""
    return len(problem.agents) == 1 and not problem.partially_observable


def simulate_returns(
    position: Position, policy: Policy, memory: Memory, first_action: float
) -> ActionSimulation:
    """Return the returns of games that begin with an action and then follow the policy.

    `memory` is the policy's memory at the position.
    """
    problem, turns = position.problem, min(position.turns_left or MAX_TURNS, MAX_TURNS)
    s = np.repeat(position.state[None], GAME_COUNT, axis=0)
    memory = tuple(array.repeat(GAME_COUNT, axis=0) for array in memory)
    a = np.full(GAME_COUNT, first_action)
    if problem.actions[0].labels:
        a = a.astype(np.int64)
    returns, weights = np.zeros(GAME_COUNT), np.ones(GAME_COUNT)
    first_rewards = returns
    budget = Budget("the simulation of an action", "play the action instead")
    for turn in range(1, turns + 1):
        budget.spend_work(float(GAME_COUNT), turn / turns)
        u = generate_uniforms(
            SIMULATION_SEED, NATURE_STREAM, turn, rows=GAME_COUNT, count=problem.uniform_counts.step
        )
        outcome = problem.step(s, a[:, None], u)
        validate_outcome(problem, outcome)
        returns = returns + weights * outcome.rewards[:, 0]
        first_rewards = returns if turn == 1 else first_rewards
        memory = policy.update_memory(memory, build_percept(problem, 0, a[:, None], outcome))
        s = outcome.state
        weights = np.where(problem.terminal(s), 0.0, weights * problem.discount)
        a = _choose_actions(problem, policy, memory, s, turn)
    return ActionSimulation(first_rewards, returns, turns)


def _choose_actions(problem: Problem, policy: Policy, memory: Memory, s: Reals, turn: int) -> Reals:
    """Return the policy's action `[N]` in each simulated game."""
    legal = problem.legal_actions_mask(s)
    u = generate_uniforms(
        SIMULATION_SEED, NATURE_STREAM + 1, turn, rows=GAME_COUNT, count=policy.uniform_count
    )
    return np.asarray(policy.choose(memory, None if legal is None else legal[:, 0], u))
