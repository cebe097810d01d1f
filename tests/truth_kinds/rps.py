import numpy as np

from dmplay.core import enumerate_outcomes
from dmplay.problems.rock_paper_scissors import RockPaperScissors
from dmplay.solvers import matrix_game
from dmplay.solvers.matrix_game import MixedProfile
from tests.oracles import correlated, responses
from tests.truth_kinds.case import Case, map_by_kind
from tests.truth_kinds.matrices import check_correlated

PROBLEM = RockPaperScissors()
ACTIONS = PROBLEM.actions[0]
PAYOFFS = PROBLEM.payoffs


def payoff(case: Case) -> None:
    a = np.array([[ACTIONS.index(name) for name in case.given["actions"]]])
    case.close("rewards", enumerate_outcomes(PROBLEM, np.zeros(1, int), a).outcomes.rewards[0, 0])


def mixed(case: Case) -> None:
    profile = MixedProfile(*map(np.array, case.given["strategies"]))
    case.close("utilities", matrix_game.compute_utilities(PAYOFFS, profile))
    case.close("regrets", matrix_game.compute_regrets(PAYOFFS, profile))
    best = responses.find_best_responses(PAYOFFS, profile)
    case.close("best_responses", [[ACTIONS[a] for a in actions] for actions in best])


def nash(case: Case) -> None:
    equilibria = matrix_game.enumerate_equilibria(PAYOFFS)
    case.close("equilibria", equilibria)
    case.close("rewards", matrix_game.compute_utilities(PAYOFFS, equilibria[0]))
    case.close(
        "pure",
        [
            profile
            for profile in equilibria
            if max(profile.row_strategy) == max(profile.column_strategy) == 1
        ],
    )


def correlated_check(case: Case) -> None:
    check_correlated(case, PAYOFFS, np.array(case.given["joint"], float))


def check_all_correlated(case: Case) -> None:
    (equilibrium,) = correlated.list_corner_equilibria(PAYOFFS)
    case.close("joint", equilibrium)


KINDS = map_by_kind(
    payoff, mixed, nash, correlated_check, correlated=check_all_correlated,
)  # fmt: skip
LATER: set[str] = set()
