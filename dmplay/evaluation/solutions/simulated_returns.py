"""Simulated returns of agents, for problems that are not solved."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.agents.search import TreeSearch
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Ints, Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.text import append_noun, format_count, format_score
from dmplay.core.work_budget import scale_progress
from dmplay.evaluation.solutions.options import DEFAULT_TURNS, get_solve_options
from dmplay.evaluation.solutions.solution import Row, Solution
from dmplay.external.history_problem import ExternalProblem
from dmplay.registry.agents import default_agent_name, load_agent
from dmplay.simulation.rollouts import RolloutSpec, rollout_entrants

DEFAULT_EPISODES, SIMULATION_SEED = 1000, 1
EXTERNAL_SEARCH_EPISODES = 10  # if agents search in an external environment, which is slow
EPISODES_PER_BATCH = 100
# of an external environment, whose turns are played one by one: if the user set no number of
# games, no further batch begins after this many turns
EXTERNAL_EPISODES_PER_BATCH, MAX_EXTERNAL_TURNS = 10, 50_000


class SimulatedReturns(NamedTuple):
    """The returns and lengths of some games."""

    returns: Reals  # [E, n]
    turns: Ints  # [E]


def simulate_games(
    problem: Problem,
    policies: Sequence[Policy],
    *,
    episodes: int,
    turns: int | None,
    stands_for_endless: bool = False,
) -> SimulatedReturns:
    """Play games of one seed and return their returns and lengths.

    The user's number of turns replaces `turns`, unless these games stand for an infinite horizon.

    One process plays them in batches, so that progress is reported. In an external environment
    they are fewer than `episodes` if they are long, unless the user set a number.
    """
    options = get_solve_options()
    options.used_options |= {"episodes", "workers"}
    if not stands_for_endless:
        options.used_options.add("turns")
        turns = options.turns or turns
    is_external = isinstance(problem, ExternalProblem)
    max_turns = math.inf
    if is_external and not options.episodes and options.workers in (None, 1):
        max_turns = MAX_EXTERNAL_TURNS
    episodes, workers = options.episodes or episodes, options.workers or 1
    batch_size = EXTERNAL_EPISODES_PER_BATCH if is_external else EPISODES_PER_BATCH
    if workers != 1:
        batch_size = episodes
    parts = list[SimulatedReturns]()
    start = turns_played = 0
    while start < episodes and turns_played < max_turns:
        count = min(batch_size, episodes - start)
        expected_turns = turns_played / start * count if start else 0.0
        shares = (
            max(start / episodes, turns_played / max_turns),
            max((start + count) / episodes, (turns_played + expected_turns) / max_turns),
        )
        with scale_progress(shares[0], min(shares[1], 1.0)):
            spec = RolloutSpec(range(start, start + count), turns, SIMULATION_SEED, workers)
            (batch,) = rollout_entrants(problem, [policies], spec)
        parts.append(SimulatedReturns(batch.returns, batch.turn_counts))
        start += count
        turns_played += int(batch.turn_counts.sum())
    returns, lengths = zip(*parts, strict=True)
    return SimulatedReturns(np.concatenate(returns), np.concatenate(lengths))


def mean_with_error(sample: Reals) -> dict[str, object]:
    """Return the mean of a sample and its standard error, as columns of a row."""
    error = sample.std(ddof=1) / np.sqrt(len(sample))
    return {"mean return": float(sample.mean()), "standard error": float(error)}


def solve_by_simulation(problem: Problem, agents: Sequence[str] = ()) -> Solution:
    """Return the mean returns of these agents in simulated games, or of the default agents."""
    names = agents or [default_agent_name(problem, seat) for seat in range(len(problem.agents))]
    policies = [load_agent(problem, seat, name) for seat, name in enumerate(names)]
    has_search = any(isinstance(policy, TreeSearch) for policy in policies)
    is_slow = has_search and isinstance(problem, ExternalProblem)
    has_end = problem.state_count == math.inf and has_search == is_slow  # if it is known
    turns = problem.horizon or (None if has_end else DEFAULT_TURNS)
    episodes = EXTERNAL_SEARCH_EPISODES if is_slow else DEFAULT_EPISODES
    simulated = simulate_games(problem, policies, episodes=episodes, turns=turns)
    rows: list[Row] = [
        {"seat": player, "agent": name} | mean_with_error(simulated.returns[:, seat])
        for seat, (player, name) in enumerate(zip(problem.agents, names, strict=True))
    ]
    game_text = format_count(len(simulated.turns), "game")
    length_text = append_noun(format_score(simulated.turns.mean()), "turn")
    summary = f"{game_text} with seed {SIMULATION_SEED}, {length_text} on average"
    method = f"a simulation of {_describe_agents(names)}"
    if not get_solve_options().method:
        method = f"not a solution, but {method}, because dmplay has no exact solution for it"
    means = tuple(simulated.returns.mean(axis=0).tolist())
    return Solution(method, summary, rows, accuracy=Accuracy.ESTIMATED, start_values=means)


def _describe_agents(names: Sequence[str]) -> str:
    """Return the agents of all seats in words, each once."""
    distinct = list(dict.fromkeys(names))
    if distinct == ["random"]:
        return "random play"
    return f"the agent{'s' * (len(distinct) > 1)} {' and '.join(distinct)}"
