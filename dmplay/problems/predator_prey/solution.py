"""The equilibrium of a hunt of one predator and one prey."""

from dmplay.core.text import format_count, format_upper_bound
from dmplay.evaluation.solutions.simulated_returns import solve_by_simulation
from dmplay.evaluation.solutions.solution import Row, Solution, format_mixed_strategy
from dmplay.solvers.games import markov_game_policy_iteration

from .rules import PredatorPrey


def solve_hunt(problem: PredatorPrey) -> Solution:
    """Return the equilibrium of a small, discounted hunt of one predator and one prey, by states.

    Hunts of more agents are simulated.
    """
    is_small = problem.state_count <= markov_game_policy_iteration.MAX_STATES
    if not (is_small and problem.walker_count == 2 and problem.discount < 1.0):
        return solve_by_simulation(problem)
    result = markov_game_policy_iteration.find_equilibrium(problem)
    rows: list[Row] = []
    for index, s in enumerate(problem.enumerate_states()):
        row: Row = {"state": problem.format_state(s)}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = float(result.action_values[seat][index])
        for seat, agent in enumerate(problem.agents):
            row[agent] = format_mixed_strategy(problem, seat, result.policies[seat][index])
        rows.append(row)
    predator_gain, prey_gain = map(format_upper_bound, result.regrets)
    rounds = format_count(len(result.value_changes), "round")
    summary = (
        f"last change {result.value_changes[-1]:.1g} after {rounds}; by another policy "
        f"the predator gains at most {predator_gain} and the prey at most {prey_gain}"
    )
    return Solution("equilibrium, by policy iteration over matrix games", summary, rows)


SOLUTION = solve_hunt
