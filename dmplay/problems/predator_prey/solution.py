"""The equilibrium of a hunt of one predator and one prey."""

from dmplay.core.action_values import Accuracy
from dmplay.core.text import format_count, format_upper_bound
from dmplay.evaluation.solutions.games import list_state_strategies
from dmplay.evaluation.solutions.simulated_returns import solve_by_simulation
from dmplay.evaluation.solutions.solution import Solution, make_informed_agent
from dmplay.solvers.games import markov_game_policy_iteration

from .agents import HuntEquilibrium
from .rules import PredatorPrey


def solve_hunt(problem: PredatorPrey) -> Solution:
    """Return the equilibrium of a small, discounted hunt of one predator and one prey, by states.

    Hunts of more agents are simulated.
    """
    is_small = problem.state_count <= markov_game_policy_iteration.MAX_STATES
    if not (is_small and problem.walker_count == 2 and problem.discount < 1.0):
        return solve_by_simulation(problem)
    result = markov_game_policy_iteration.find_equilibrium(problem)
    predator_gain, prey_gain = map(format_upper_bound, result.regrets)
    rounds = format_count(len(result.value_changes), "round")
    summary = (
        f"last change {result.value_changes[-1]:.1g} after {rounds}; by another policy "
        f"the predator gains at most {predator_gain} and the prey at most {prey_gain}"
    )
    states = problem.enumerate_states()
    return Solution(
        "equilibrium, by policy iteration over matrix games",
        summary,
        list_state_strategies(problem, states, result.action_values, result.policies),
        make_informed_agent(HuntEquilibrium, {"_solution": result}),
        Accuracy.EXACT,
        max(result.regrets),
    )


SOLUTION = solve_hunt
