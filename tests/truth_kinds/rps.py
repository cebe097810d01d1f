import numpy as np

from dmplay.core import enumerate_outcomes
from dmplay.problems.rock_paper_scissors import RockPaperScissors
from dmplay.solvers import matrix_game
from dmplay.solvers.matrix_game import MixedProfile
from tests.oracles import correlated, responses
from tests.truth_kinds.case import Case, by_kind
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
    best = responses.best_responses(PAYOFFS, profile)
    case.close("best_responses", [[ACTIONS[a] for a in one] for one in best])


def nash(case: Case) -> None:
    found = matrix_game.enumerate_equilibria(PAYOFFS)
    case.close("equilibria", found)
    case.close("rewards", matrix_game.compute_utilities(PAYOFFS, found[0]))
    case.close(
        "pure", [one for one in found if max(one.row_strategy) == max(one.column_strategy) == 1]
    )


def correlated_check(case: Case) -> None:
    check_correlated(case, PAYOFFS, np.array(case.given["joint"], float))


def correlated_all(case: Case) -> None:
    (only,) = correlated.equilibria(PAYOFFS)
    case.close("joint", only)


KINDS = by_kind(
    payoff, mixed, nash, correlated_check, correlated=correlated_all,
)  # fmt: skip
LATER: set[str] = set()
