"""Solutions of games in which everyone sees the state: their equilibria."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.describe import format_count, format_upper_bound
from dmplay.policies import seeing
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solutions.played import resolve_horizon
from dmplay.solutions.seen import format_start_values, select_listed_states
from dmplay.solutions.solution import Row, Solution, format_mixed_strategy
from dmplay.solvers import (
    best_replies,
    extreme_equilibria,
    graph,
    lemke_howson,
    markov_game,
    matrix_game,
    regret_matching,
)
from dmplay.solvers.matrix_game import MixedProfile


def solve_nash_equilibria(problem: Problem) -> Solution:
    """Every Nash equilibrium of one round of two; where these are too many to look for, one.

    Where they are infinitely many, those of which all others are mixtures.
    """
    payoffs = matrix_game.build_payoffs(problem)
    extreme = extreme_equilibria.find_extreme_equilibria(payoffs)
    found = extreme or matrix_game.enumerate_equilibria_if_small(payoffs)
    if not found:
        one = lemke_howson.find_equilibrium(payoffs)
        gain = max(float(matrix_game.compute_regrets(payoffs, one).max()), 0.0)
        pay = matrix_game.compute_utilities(payoffs, one).tolist()
        told = (
            f"a Nash equilibrium of one round; by another action nobody gains {_format_gain(gain)}"
        )
        return Solution(
            "Lemke and Howson's pivoting", told, [_build_strategy_row(problem, one, pay)]
        )
    rows = [
        _build_strategy_row(problem, one, matrix_game.compute_utilities(payoffs, one).tolist())
        for one in found
    ]
    method = f"{'vertex' if extreme else 'support'} enumeration"
    if _has_mixtures(extreme):
        many = f"{len(rows)} extreme Nash equilibria of one round; all others are mixtures of these"
        return Solution(method, many, rows)
    many = f"{len(rows)} Nash equilibri{'um' if len(rows) == 1 else 'a'} of one round"
    return Solution(method, many, rows)


def _has_mixtures(extreme: Sequence[MixedProfile]) -> bool:
    """Whether mixtures of some of these are equilibria too: an agent plays the same in both."""
    return any(
        len({mix.tobytes() for mix in mixes}) < len(extreme) for mixes in zip(*extreme, strict=True)
    )


def solve_many_player_game(problem: Problem) -> Solution:
    """What more than two play in one round, and how far that is from an equilibrium."""
    payoffs = matrix_game.build_payoffs(problem)
    found = regret_matching.find_equilibrium(payoffs)
    each = enumerate(found.mixed_strategies)
    pay = [
        float(mix @ regret_matching.compute_response_values(payoffs, found.mixed_strategies, at))
        for at, mix in each
    ]
    rounds = format_count(found.round_count, "round")
    method = f"regret matching, {rounds}" if found.round_count else "pure actions"
    told = f"one round; by another action nobody gains {_format_gain(float(found.regrets.max()))}"
    return Solution(method, told, [_build_strategy_row(problem, found.mixed_strategies, pay)])


def _format_gain(gain: float) -> str:
    """How much is gained at most."""
    return f"more than {format_upper_bound(gain)}" if gain > 0 else "anything"


def _build_strategy_row(
    problem: Problem, strategies: Sequence[Reals], payoffs: Sequence[float]
) -> Row:
    """What each agent plays, and is paid."""
    row: Row = {}
    for seat, (agent, mix) in enumerate(zip(problem.agents, strategies, strict=True)):
        row[agent] = format_mixed_strategy(problem, seat, mix)
        row[f"pays {agent}"] = float(payoffs[seat])
    return row


def solve_one_on_one_hunt(problem: PredatorPrey) -> Solution:
    """The equilibrium of one predator and one prey, state by state."""
    found = markov_game.find_equilibrium(problem)
    rows: list[Row] = []
    for place, s in enumerate(problem.enumerate_states()):
        row: Row = {"state": problem.format_state(s)}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = float(found.action_values[seat][place])
        for seat, agent in enumerate(problem.agents):
            row[agent] = format_mixed_strategy(problem, seat, found.policies[seat][place])
        rows.append(row)
    gaps = " and ".join(map(format_upper_bound, found.regrets))
    rounds = format_count(len(found.value_changes), "round")
    told = (
        f"change {found.value_changes[-1]:.1g} after {rounds}; by any other policy "
        f"predator and prey gain at most {gaps}"
    )
    return Solution("equilibrium, by policy iteration over matrix games", told, rows)


def solve_zero_sum_game(problem: Problem) -> Solution:
    """What both play in a Markov game of two who are opposed, and what that is worth."""
    horizon = resolve_horizon(problem.horizon)
    found = seeing.solve_zero_sum(problem, horizon)
    before = None if horizon is None else horizon - 1
    shown = select_listed_states(problem, found.graph)
    live = shown[np.isin(shown, found.graph.nonterminal_states)]
    _, both = found.solve_rounded_games(live, problem.discount, before)
    rows: list[Row] = []
    for at, place in enumerate(live.tolist()):
        value = float(both.values[at])
        row: Row = {"state": problem.format_state(found.graph.states[place])}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = value if seat == 0 else -found.loss_ratio * value + 0.0
        for seat, agent in enumerate(problem.agents):
            row[agent] = format_mixed_strategy(problem, seat, both[1 + seat][at])
        rows.append(row)
    first = found.get_values(horizon)
    values = np.stack([first, -found.loss_ratio * first + 0.0], axis=1)
    span = "without end" if horizon is None else format_count(horizon, "turn")
    far = (
        f"at most {format_upper_bound(found.gap)} from the value of the game"
        if found.gap
        else "exact"
    )
    method = f"Shapley's iteration over {format_count(len(first), 'state')}, {span}"
    return Solution(method, f"{format_start_values(problem, found.graph, values)}, {far}", rows)


def solve_best_replies(problem: Problem) -> Solution:
    """What comes of best replies in a Markov game of several, each for itself."""
    found = best_replies.find_equilibrium(problem, graph.build_reachable_graph(problem))
    rows: list[Row] = []
    for place in select_listed_states(problem, found.graph).tolist():
        row: Row = {"state": problem.format_state(found.graph.states[place])}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = float(found.values[place, seat])
        for seat, agent in enumerate(problem.agents):
            row[agent] = format_mixed_strategy(problem, seat, found.policies[seat][place])
        rows.append(row)
    each = zip(found.regrets, problem.agents, strict=True)
    gains = ", ".join(f"{gain:.2g} by {agent}" for gain, agent in each)
    told = f"{format_start_values(problem, found.graph, found.values)}; to be gained by another policy: {gains}"
    states, rounds = (
        format_count(len(found.values), "state"),
        format_count(found.round_count, "round"),
    )
    return Solution(f"best replies over {states}, {rounds}", told, rows)
