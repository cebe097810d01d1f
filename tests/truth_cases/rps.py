import numpy as np

from dmplay.core.problem import enumerate_outcomes
from dmplay.problems.rock_paper_scissors.rules import RockPaperScissors
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.games.bimatrix_game import MixedProfile
from tests.oracles import best_responses, correlated_equilibria
from tests.truth_cases.case import Case, map_by_kind
from tests.truth_cases.matrix_games import check_correlated

PROBLEM = RockPaperScissors()
ACTIONS = PROBLEM.actions[0]
PAYOFFS = PROBLEM.payoffs


def payoff(case: Case) -> None:
    a = np.array([[ACTIONS.index(name) for name in case.inputs["actions"]]])
    case.close("rewards", enumerate_outcomes(PROBLEM, np.zeros(1, int), a).outcomes.rewards[0, 0])


def mixed(case: Case) -> None:
    profile = MixedProfile(*map(np.array, case.inputs["strategies"]))
    case.close("utilities", bimatrix_game.compute_utilities(PAYOFFS, profile))
    case.close("regrets", bimatrix_game.compute_regrets(PAYOFFS, profile))
    best = best_responses.find_best_responses(PAYOFFS, profile)
    case.close("best_responses", [[ACTIONS[a] for a in actions] for actions in best])


def nash(case: Case) -> None:
    equilibria = bimatrix_game.enumerate_equilibria(PAYOFFS)
    case.close("equilibria", equilibria)
    case.close("rewards", bimatrix_game.compute_utilities(PAYOFFS, equilibria[0]))
    case.close(
        "pure",
        [
            profile
            for profile in equilibria
            if max(profile.row_strategy) == max(profile.column_strategy) == 1
        ],
    )


def correlated_check(case: Case) -> None:
    check_correlated(case, PAYOFFS, np.array(case.inputs["joint"], float))


def check_all_correlated(case: Case) -> None:
    (equilibrium,) = correlated_equilibria.list_corner_equilibria(PAYOFFS)
    case.close("joint", equilibrium)


KINDS = map_by_kind(
    payoff, mixed, nash, correlated_check, correlated=check_all_correlated,
)  # fmt: skip
LATER: set[str] = set()
