"""Solutions of games in which every agent observes the state: their equilibria."""

from collections.abc import Iterable, Sequence

import numpy as np

from dmplay.agents.fully_observable_problems import (
    BestResponseEquilibrium,
    MaximinPolicy,
    find_best_response_equilibrium,
)
from dmplay.agents.matrix_game_agents import RegretMatchingEquilibrium
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_upper_bound
from dmplay.errors import BudgetExceeded
from dmplay.evaluation.solutions.mdps import (
    average_start_values,
    format_start_values,
    select_listed_states,
)
from dmplay.evaluation.solutions.options import resolve_horizon
from dmplay.evaluation.solutions.solution import (
    MIN_SHOWN_PROBABILITY,
    Row,
    Solution,
    list_probabilities,
    make_informed_agent,
)
from dmplay.solvers.games import bimatrix_game, extreme_equilibria, lemke_howson, regret_matching
from dmplay.solvers.games.regret_matching import RegretMatchingResult
from dmplay.solvers.games.shapley import solve_zero_sum

Profile = Sequence[Reals]  # the mixed strategy of each agent


def solve_nash_equilibria(problem: Problem) -> Solution:
    """Return every Nash equilibrium of one round of two agents, or one if they are too many."""
    return _enumerate_equilibria(problem) or solve_by_lemke_howson(problem)


def enumerate_nash_equilibria(problem: Problem) -> Solution:
    """Return every Nash equilibrium of one round of two agents.

    Raise BudgetExceeded if they are too many.
    """
    solution = _enumerate_equilibria(problem)
    if solution is None:
        remedy = "use lemke-howson or regret-matching"
        raise BudgetExceeded("equilibrium enumeration", "too many actions", remedy)
    return solution


def _enumerate_equilibria(problem: Problem) -> Solution | None:
    """Return every Nash equilibrium; None if there are too many actions.

    If there are infinitely many, these are the extreme equilibria, of which all others are
    mixtures.
    """
    payoffs = bimatrix_game.build_payoffs(problem)
    extreme = extreme_equilibria.find_extreme_equilibria(payoffs)
    profiles = extreme or bimatrix_game.enumerate_equilibria_if_small(payoffs)
    if not profiles:
        return None
    method, count = f"{'vertex' if extreme else 'support'} enumeration", len(profiles)
    summary = f"{count} Nash equilibri{'um' if count == 1 else 'a'} of one round"
    if extreme_equilibria.has_mixtures(extreme):
        noun = "extreme Nash equilibria of one round"
        summary = f"{count} {noun}; the others are mixtures of these"
    return _make_round_solution(problem, method, summary, profiles, min_probability=0.0)


def solve_by_lemke_howson(problem: Problem) -> Solution:
    """Return one Nash equilibrium of one round of two agents."""
    payoffs = bimatrix_game.build_payoffs(problem)
    profile = lemke_howson.find_equilibrium(payoffs)
    centered = bimatrix_game.remove_common_part(payoffs)
    largest_gain = max(float(bimatrix_game.compute_regrets(centered, profile).max()), 0.0)
    summary = f"a Nash equilibrium of one round; {_format_largest_gain(largest_gain)}"
    return _make_round_solution(problem, "Lemke-Howson algorithm", summary, [profile], largest_gain)


def solve_by_regret_matching(problem: Problem) -> Solution:
    """Return near-equilibrium strategies of two or more agents in one round."""
    payoffs = bimatrix_game.build_payoffs(problem)
    result = regret_matching.find_equilibrium(payoffs)
    rounds = format_count(result.round_count, "round")
    method = f"regret matching, {rounds}" if result.round_count else "pure actions"
    gain = float(result.regrets.max())
    summary = f"one round; {_format_largest_gain(gain)}"
    if result.pure_count:
        summary += f"; {_describe_other_equilibria(result.pure_count - 1)}"
    return _make_round_solution(problem, method, summary, [result.mixed_strategies], gain)


def _make_round_solution(  # noqa: PLR0913 - a solution has these parts
    problem: Problem,
    method: str,
    summary: str,
    profiles: Sequence[Profile],
    gain: float = 0.0,
    *,
    min_probability: float = MIN_SHOWN_PROBABILITY,
) -> Solution:
    """Return the solution of one round with these equilibria, in which no agent gains more."""
    is_exact = gain <= VALUE_TOLERANCE * problem.reward_scale
    accuracy = Accuracy.EXACT if is_exact else Accuracy.ESTIMATED
    payoffs, solutions = bimatrix_game.build_payoffs(problem), []
    for profile in profiles:
        result = RegretMatchingResult(tuple(profile), np.zeros(len(profile)), 0)
        agent = make_informed_agent(RegretMatchingEquilibrium, {"_solution": result})
        start = tuple(float(value) for value in _compute_utilities(payoffs, tuple(profile)))
        row: Row = {}
        for seat, name in enumerate(problem.agents):
            row[name] = list_probabilities(problem, seat, profile[seat], min_probability)
            row[f"pays {name}"] = start[seat]
        solutions.append(
            Solution(method, "", [row], agent, accuracy, start_values=start, problem=problem)
        )
    first, is_only = solutions[0], len(solutions) == 1
    return Solution(
        method,
        summary,
        [row for solution in solutions for row in solution.table],
        first.agent if is_only else None,
        accuracy,
        start_values=first.start_values if is_only else (),
        equilibria=tuple(solutions),
    )


def _compute_utilities(payoffs: Reals, profile: tuple[Reals, ...]) -> Iterable[float]:
    """Return the expected payoff of each agent."""
    if len(profile) == 2:
        return bimatrix_game.compute_utilities(payoffs, bimatrix_game.MixedProfile(*profile))
    return [
        float(strategy @ regret_matching.compute_response_values(payoffs, profile, seat))
        for seat, strategy in enumerate(profile)
    ]


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


def solve_zero_sum_game(problem: Problem) -> Solution:
    """Return the values and strategies of a Markov game of two agents with opposed rewards."""
    horizon = resolve_horizon(problem.horizon)
    result = solve_zero_sum(problem, horizon)
    turns_left = None if horizon is None else horizon - 1
    listed = select_listed_states(problem, result.graph)
    listed_live = listed[np.isin(listed, result.graph.nonterminal_states)]
    _, solutions = result.solve_rounded_games(listed_live, problem.discount, turns_left)
    listed_values = np.stack([solutions.values, -result.loss_ratio * solutions.values + 0.0])
    first_values = result.get_values(horizon)
    values = np.stack([first_values, -result.loss_ratio * first_values + 0.0], axis=1)
    span = "infinite horizon" if horizon is None else format_count(horizon, "turn")
    precision = f"error at most {format_upper_bound(result.gap)}" if result.gap else "exact"
    start_values = average_start_values(problem, result.graph, values)
    return Solution(
        f"Shapley's iteration over {format_count(len(values), 'state')}, {span}",
        f"{format_start_values(problem, start_values)}, {precision}",
        list_state_strategies(
            problem, result.graph.states[listed_live], listed_values, solutions[1:]
        ),
        make_informed_agent(MaximinPolicy, {"_solution": result}, horizon=horizon or 0),
        Accuracy.EXACT,
        result.gap,
        start_values,
    )


def solve_best_responses(problem: Problem) -> Solution:
    """Return the result of best responses in a Markov game of several agents."""
    result = find_best_response_equilibrium(problem)
    listed = select_listed_states(problem, result.graph)
    seat_gains = zip(result.regrets, problem.agents, strict=True)
    gains = ", ".join(f"{gain:.2g} for {agent}" for gain, agent in seat_gains)
    start_values = average_start_values(problem, result.graph, result.values)
    states = format_count(len(result.values), "state")
    rounds = format_count(result.round_count, "round")
    return Solution(
        f"best responses over {states}, {rounds}",
        f"{format_start_values(problem, start_values)}; gain by another policy: {gains}",
        list_state_strategies(
            problem,
            result.graph.states[listed],
            result.values[listed].T,
            [policy[listed] for policy in result.policies],
        ),
        BestResponseEquilibrium,
        Accuracy.ESTIMATED,
        start_values=start_values,
    )


def list_state_strategies(
    problem: Problem, states: Array, values: Reals | Sequence[Reals], policies: Sequence[Reals]
) -> list[Row]:
    """Return a row for each state: the values `[S]` and strategies `[S, A]` of all agents."""
    rows: list[Row] = []
    for index, state in enumerate(states):
        row: Row = {"state": problem.format_state(state)}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = float(values[seat][index])
        for seat, agent in enumerate(problem.agents):
            row[agent] = list_probabilities(problem, seat, policies[seat][index])
        rows.append(row)
    return rows
