"""Solutions of games in which every agent observes the state: their equilibria."""

from collections.abc import Sequence

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_upper_bound
from dmplay.evaluation.solutions.mdps import format_start_values, select_listed_states
from dmplay.evaluation.solutions.options import resolve_horizon
from dmplay.evaluation.solutions.solution import (
    MIN_SHOWN_PROBABILITY,
    Row,
    Solution,
    format_mixed_strategy,
)
from dmplay.solvers.games import (
    best_response_dynamics,
    bimatrix_game,
    extreme_equilibria,
    lemke_howson,
    regret_matching,
)
from dmplay.solvers.games.shapley import solve_zero_sum
from dmplay.solvers.mdp import transition_graph


def solve_nash_equilibria(problem: Problem) -> Solution:
    """Return every Nash equilibrium of one round of two agents, or one if they are too many.

    If there are infinitely many, these are the extreme equilibria, of which all others are
    mixtures.
    """
    payoffs = bimatrix_game.build_payoffs(problem)
    extreme = extreme_equilibria.find_extreme_equilibria(payoffs)
    profiles = extreme or bimatrix_game.enumerate_equilibria_if_small(payoffs)
    if not profiles:
        profile = lemke_howson.find_equilibrium(payoffs)
        centered = bimatrix_game.remove_common_part(payoffs)
        largest_gain = max(float(bimatrix_game.compute_regrets(centered, profile).max()), 0.0)
        rewards = bimatrix_game.compute_utilities(payoffs, profile).tolist()
        summary = f"a Nash equilibrium of one round; {_format_largest_gain(largest_gain)}"
        row = _build_strategy_profile_row(problem, profile, rewards)
        return Solution("Lemke-Howson algorithm", summary, [row])
    rows = []
    for profile in profiles:
        rewards = bimatrix_game.compute_utilities(payoffs, profile).tolist()
        rows.append(_build_strategy_profile_row(problem, profile, rewards, 0.0))
    method, count = f"{'vertex' if extreme else 'support'} enumeration", len(rows)
    summary = f"{count} Nash equilibri{'um' if count == 1 else 'a'} of one round"
    if extreme_equilibria.has_mixtures(extreme):
        noun = "extreme Nash equilibria of one round"
        summary = f"{count} {noun}; the others are mixtures of these"
    return Solution(method, summary, rows)


def solve_many_player_game(problem: Problem) -> Solution:
    """Return near-equilibrium strategies of more than two agents in one round."""
    payoffs = bimatrix_game.build_payoffs(problem)
    result = regret_matching.find_equilibrium(payoffs)
    strategies, rewards = result.mixed_strategies, []
    for seat, strategy in enumerate(strategies):
        values = regret_matching.compute_response_values(payoffs, strategies, seat)
        rewards.append(float(strategy @ values))
    rounds = format_count(result.round_count, "round")
    method = f"regret matching, {rounds}" if result.round_count else "pure actions"
    summary = f"one round; {_format_largest_gain(float(result.regrets.max()))}"
    if result.pure_count:
        summary += f"; {_describe_other_equilibria(result.pure_count - 1)}"
    return Solution(method, summary, [_build_strategy_profile_row(problem, strategies, rewards)])


def _describe_other_equilibria(pure_count: int) -> str:
    """Return text on the equilibria that are not listed, `pure_count` of them in pure actions."""
    if not pure_count:
        return "the only equilibrium in pure actions; there may be mixed ones"
    noun = format_count(pure_count, "other equilibrium").replace("equilibriums", "equilibria")
    verb = "is" if pure_count == 1 else "are"
    return f"there {verb} {noun} in pure actions, and maybe mixed ones"


def _format_largest_gain(gain: float) -> str:
    """Return text on the largest gain of an agent that changes its action."""
    bound = f" more than {format_upper_bound(gain)}" if gain > 0 else ""
    return f"no agent gains{bound} by another action"


def _build_strategy_profile_row(
    problem: Problem,
    strategies: Sequence[Reals],
    payoffs: Sequence[float],
    min_probability: float = MIN_SHOWN_PROBABILITY,
) -> Row:
    """Return a row with the payoff and the strategy of each agent, from `min_probability` on."""
    row: Row = {}
    for seat, (agent, strategy) in enumerate(zip(problem.agents, strategies, strict=True)):
        row[agent] = format_mixed_strategy(problem, seat, strategy, min_probability)
        row[f"pays {agent}"] = float(payoffs[seat])
    return row


def solve_zero_sum_game(problem: Problem) -> Solution:
    """Return the values and strategies of a Markov game of two agents with opposed rewards."""
    horizon = resolve_horizon(problem.horizon)
    result = solve_zero_sum(problem, horizon)
    turns_left = None if horizon is None else horizon - 1
    listed = select_listed_states(problem, result.graph)
    listed_live = listed[np.isin(listed, result.graph.nonterminal_states)]
    _, solutions = result.solve_rounded_games(listed_live, problem.discount, turns_left)
    rows: list[Row] = []
    for index, state_index in enumerate(listed_live.tolist()):
        value = float(solutions.values[index])
        row: Row = {"state": problem.format_state(result.graph.states[state_index])}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = value if seat == 0 else -result.loss_ratio * value + 0.0
        for seat, agent in enumerate(problem.agents):
            row[agent] = format_mixed_strategy(problem, seat, solutions[1 + seat][index])
        rows.append(row)
    start_values = result.get_values(horizon)
    values = np.stack([start_values, -result.loss_ratio * start_values + 0.0], axis=1)
    span = "infinite horizon" if horizon is None else format_count(horizon, "turn")
    precision = f"error at most {format_upper_bound(result.gap)}" if result.gap else "exact"
    method = f"Shapley's iteration over {format_count(len(start_values), 'state')}, {span}"
    value_text = format_start_values(problem, result.graph, values)
    return Solution(method, f"{value_text}, {precision}", rows)


def solve_best_responses(problem: Problem) -> Solution:
    """Return the result of best responses in a Markov game of several agents."""
    graph = transition_graph.build_reachable_graph(problem)
    result = best_response_dynamics.find_equilibrium(problem, graph)
    rows: list[Row] = []
    for state_index in select_listed_states(problem, result.graph).tolist():
        row: Row = {"state": problem.format_state(result.graph.states[state_index])}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = float(result.values[state_index, seat])
        for seat, agent in enumerate(problem.agents):
            row[agent] = format_mixed_strategy(problem, seat, result.policies[seat][state_index])
        rows.append(row)
    seat_gains = zip(result.regrets, problem.agents, strict=True)
    gains = ", ".join(f"{gain:.2g} for {agent}" for gain, agent in seat_gains)
    value_text = format_start_values(problem, result.graph, result.values)
    summary = f"{value_text}; gain by another policy: {gains}"
    states = format_count(len(result.values), "state")
    rounds = format_count(result.round_count, "round")
    return Solution(f"best responses over {states}, {rounds}", summary, rows)
