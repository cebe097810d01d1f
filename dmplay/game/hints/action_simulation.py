"""Returns of simulated games that begin with an action and in which an agent then plays on.

All first actions get the same random numbers, so that their returns differ by what they change.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.action_values import Accuracy, ActionValues, ValuesBasis
from dmplay.core.arrays import Array, Ints, Reals
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import Problem, build_percept, validate_outcome
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.core.work_budget import Budget
from dmplay.game.position import Position
from dmplay.registry.agents import HintAgent, load_roster

GAME_COUNT = 400  # simulated games for each first action
SIMULATION_SEED = 1  # the same random numbers for every first action
MAX_TURNS = 200  # maximum turns of a simulated game
MAX_COMPARED_TURNS = 500  # maximum turns of the games by which actions are compared
# simulated games by which actions are compared: of all actions together, and of each
MAX_COMPARED_GAMES, MAX_GAMES_PER_ACTION, MIN_GAMES_PER_ACTION = 125_000, 1000, 16


class SimulatedGames(NamedTuple):
    """Simulated games: a row for each first action, with the same random numbers in all rows."""

    first_rewards: Reals  # [N, G]
    returns: Reals  # [N, G]
    turn_counts: Reals  # [N, G]
    states: Array  # [N, G, ...], in which they ended

    @property
    def mean(self) -> float:
        """The mean return."""
        return float(self.returns.mean())


class Start(NamedTuple):
    """A position in which simulated games start, with the memory of the agent that plays on."""

    state: Array
    memory: Memory  # one row
    turns_left: int | None
    actions: Array  # first actions


def can_simulate(problem: Problem) -> bool:
    """Return whether games can be simulated from the current state without other agents."""
    return len(problem.agents) == 1 and not problem.partially_observable


def play_on(
    position: Position,
    game_count: int,
    actions: Sequence[float] = (),
    max_turns: int = MAX_COMPARED_TURNS,
) -> SimulatedGames:
    """Return simulated games that begin with each action, in which the hint agent plays on.

    There is a row for each of `actions`, by default for each legal action. `can_simulate` must be
    true of the problem.
    """
    first_actions = np.array(actions or position.legal_actions)
    return position.ask(
        lambda policy, memory: _simulate_games(
            position.problem,
            policy,
            [Start(position.state, memory, position.turns_left, first_actions)],
            game_count,
            max_turns,
        )
    )


def can_compare(agent: HintAgent) -> bool:
    """Return whether games replace the values of an agent: values that are estimates or bounds.

    The agent must be quick enough to play many games, and not sample games itself.
    """
    problem, accuracy = agent.policy.problem, agent.basis.accuracy
    if not (can_simulate(problem) and problem.actions[0].labels and accuracy.is_estimate):
        return False
    samples = type(agent.policy).estimate_returns is not SeatPolicy.estimate_returns
    return not (samples or load_roster(problem).batch_agent)


def compare_returns(agent: HintAgent, starts: Sequence[Start]) -> list[ActionValues]:
    """Return the mean return of each first action of each start, if the agent then plays on.

    The error of an action is that of its difference from the greatest mean; without random events
    there is none. All games are played at once; there are fewer of each if there are many actions.
    """
    problem, policy = agent.policy.problem, agent.policy
    is_random = problem.uniform_counts.step or policy.uniform_count
    action_count = sum(len(start.actions) for start in starts)
    game_count = max(MAX_COMPARED_GAMES // action_count, MIN_GAMES_PER_ACTION)
    game_count = min(game_count, MAX_GAMES_PER_ACTION) if is_random else 1
    games = _simulate_games(problem, policy, starts, game_count, MAX_COMPARED_TURNS)
    basis = ValuesBasis(Accuracy.ESTIMATED, assumed_players=f"if {agent.base_name} plays on")
    comparisons, first = list[ActionValues](), 0
    for start in starts:
        rows = games.returns[first : first + len(start.actions)]
        first += len(start.actions)
        q = np.full(problem.action_counts[0], np.nan)
        q[start.actions] = rows.mean(axis=1)
        values = ActionValues(q, basis, problem.reward_scale, sample_count=game_count)
        if game_count > 1:
            differences = rows[rows.mean(axis=1).argmax()] - rows
            errors = np.full(len(q), np.inf)
            errors[start.actions] = differences.std(axis=1, ddof=1) / game_count**0.5
            values = values._replace(errors=errors, return_bounds=problem.return_bounds)
        comparisons.append(values)
    return comparisons


def _simulate_games(
    problem: Problem, policy: Policy, starts: Sequence[Start], game_count: int, max_turns: int
) -> SimulatedGames:
    """Return games that begin with each first action of each start."""
    rows = [start for start in starts for _ in start.actions]
    shape, total = (len(rows), game_count), len(rows) * game_count
    s = np.stack([start.state for start in rows]).repeat(game_count, axis=0)
    memory = tuple(
        np.concatenate(parts).repeat(game_count, axis=0)
        for parts in zip(*(start.memory for start in rows), strict=True)
    )
    a = np.concatenate([start.actions for start in starts]).repeat(game_count)
    if problem.actions[0].labels:
        a = a.astype(np.int64)
    limits: Ints = np.array([min(start.turns_left or max_turns, max_turns) for start in rows])
    limits, last_turn = limits.repeat(game_count), int(limits.max())
    returns, weights, turn_counts = np.zeros(total), np.ones(total), np.zeros(total)
    first_rewards = returns
    budget = Budget("the simulation of an action", "play the action instead")
    for turn in range(1, last_turn + 1):
        budget.spend_work(float(total), turn / last_turn)
        u = _draw_uniforms(NATURE_STREAM, turn, len(rows), game_count, problem.uniform_counts.step)
        turn_counts += weights > 0.0
        outcome = problem.step(s, a[:, None], u)
        validate_outcome(problem, outcome)
        returns = returns + weights * outcome.rewards[:, 0]
        first_rewards = returns if turn == 1 else first_rewards
        memory = policy.update_memory(memory, build_percept(problem, 0, a[:, None], outcome))
        is_over = (weights == 0.0).reshape(-1, *[1] * (s.ndim - 1))
        s = np.where(is_over, s, outcome.state)
        goes_on = ~problem.terminal(s) & (turn < limits)
        weights = np.where(goes_on, weights * problem.discount, 0.0)
        if not weights.any():
            break
        legal = problem.legal_actions_mask(s)
        u = _draw_uniforms(NATURE_STREAM + 1, turn, len(rows), game_count, policy.uniform_count)
        a = np.asarray(policy.choose(memory, None if legal is None else legal[:, 0], u))
    return SimulatedGames(
        first_rewards.reshape(shape),
        returns.reshape(shape),
        turn_counts.reshape(shape),
        s.reshape(*shape, *s.shape[1:]),
    )


def _draw_uniforms(stream: int, turn: int, row_count: int, game_count: int, count: int) -> Reals:
    """Return the random numbers of a turn `[N * G, count]`, the same in each row of games."""
    u = generate_uniforms(SIMULATION_SEED, stream, turn, rows=game_count, count=count)
    return np.tile(u, (row_count, 1))
