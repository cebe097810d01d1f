import math

import numpy as np

import dmplay
from dmplay.problems.prisoners_dilemma.rules import PrisonersDilemma
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.games.bimatrix_game import MixedProfile
from tests.oracles import best_responses
from tests.truth_cases.case import Case, map_by_kind
from tests.truth_cases.matrix_games import check_correlated

PROBLEM = PrisonersDilemma(discount=0.9)
ACTIONS = PROBLEM.actions[0]
PAYOFFS = PROBLEM.payoffs
AGENT_NAMES = {"tit for tat": "tit-for-tat", "grim trigger": "grim"}


def payoff(case: Case) -> None:
    a = np.array([[ACTIONS.index(name) for name in case.inputs["actions"]]])
    _, outcome = dmplay.enumerate_outcomes(PROBLEM, np.zeros(1, int), a)
    case.close("rewards", outcome.rewards[0, 0])


def mixed(case: Case) -> None:
    profile = MixedProfile(*(np.array([p, 1 - p]) for p in case.inputs["p_cooperate"]))
    case.close("utilities", bimatrix_game.compute_utilities(PAYOFFS, profile))
    case.close("regrets", bimatrix_game.compute_regrets(PAYOFFS, profile))


def nash(case: Case) -> None:
    equilibria = bimatrix_game.enumerate_equilibria(PAYOFFS)
    named = [
        [[ACTIONS[int(a)] for a in np.flatnonzero(mix)] for mix in profile]
        for profile in equilibria
    ]
    assert named == case.expect["equilibria"]
    case.close("rewards", bimatrix_game.compute_utilities(PAYOFFS, equilibria[0]))


def correlated(case: Case) -> None:
    # Strictly dominated actions have no weight in a correlated equilibrium, so one cell remains.
    rows, columns = bimatrix_game.find_undominated_actions(PAYOFFS)
    assert len(rows) == len(columns) == 1
    joint = np.zeros((2, 2))
    joint[rows[0], columns[0]] = 1
    case.close("joint", joint)


def correlated_check(case: Case) -> None:
    check_correlated(case, PAYOFFS, np.array(case.inputs["joint"], float))


def hierarchical_softmax(case: Case) -> None:
    profile = bimatrix_game.compute_hierarchical_softmax(
        PAYOFFS, case.inputs["precision"], case.inputs["level"]
    )
    case.close("distribution", profile.row_strategy)
    case.close("distribution", profile.column_strategy)


def count_rounds(discount: float, tolerance: float) -> int:
    """Return the number of rounds after which the rest of an infinite game is negligible.

    The rest, max|R| * discount**n / (1 - discount), is at most half of the tolerance. The other
    half is for rounding.
    """
    negligible_rest = 0.5 * tolerance * (1.0 - discount) / float(abs(PAYOFFS).max())
    return math.ceil(math.log(negligible_rest) / math.log(discount))


def repeated(case: Case) -> None:
    problem = PrisonersDilemma(discount=case.inputs["gamma"])
    names = [AGENT_NAMES.get(rule, rule.replace(" ", "-")) for rule in case.inputs["rules"]]
    rules = [dmplay.load_agent(problem, seat, name) for seat, name in enumerate(names)]
    rounds = count_rounds(problem.discount, case.tol)
    batch = dmplay.rollout(problem, rules, episodes=1, turn_limit=rounds)
    case.close("returns", batch.returns[0])


def repeated_threshold(case: Case) -> None:
    assert case.inputs["rule"] == "grim trigger"
    threshold = best_responses.compute_grim_threshold(
        PAYOFFS, ACTIONS.index("cooperate"), ACTIONS.index("defect")
    )
    case.close("smallest_discount_sustaining_cooperation", threshold)


KINDS = map_by_kind(
    payoff, mixed, nash, correlated, correlated_check, hierarchical_softmax, repeated,
    repeated_threshold,
)  # fmt: skip
LATER: set[str] = set()
