import re

import numpy as np

from dmplay.core.problem import enumerate_outcomes
from dmplay.problems.travelers_dilemma.rules import CLAIMS, MAX_CLAIM, MIN_CLAIM, TravelersDilemma
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.games.bimatrix_game import MixedProfile
from tests.oracles import best_responses
from tests.truth_cases.case import Case, map_by_kind
from tests.truth_cases.matrix_games import check_correlated

PROBLEM = TravelersDilemma()
PAYOFFS = PROBLEM.payoffs


def payoff(case: Case) -> None:
    a = np.array([case.inputs["actions"]]) - MIN_CLAIM
    case.close("rewards", enumerate_outcomes(PROBLEM, np.zeros(1, int), a).outcomes.rewards[0, 0])


def payoff_table(case: Case) -> None:
    cells = PAYOFFS[:, :, 0]
    if "a1 * a2" in case.inputs["question"]:
        cells = CLAIMS[:, None] * CLAIMS * cells
    else:
        assert case.inputs["question"].startswith("sum of agent 1's rewards")
    case.close("sum", cells.sum())


def nash(case: Case) -> None:
    equilibria = bimatrix_game.enumerate_equilibria(PAYOFFS)
    claims = [[CLAIMS[np.flatnonzero(mix)].tolist() for mix in profile] for profile in equilibria]
    assert claims == [[[a], [b]] for a, b in case.expect["equilibria"]]
    case.close("rewards", bimatrix_game.compute_utilities(PAYOFFS, equilibria[0]))
    rows, columns = bimatrix_game.find_undominated_actions(PAYOFFS)
    case.close("surviving_iterated_strict_dominance", CLAIMS[rows])
    assert rows == columns


def correlated_check(case: Case) -> None:
    joint = np.zeros((len(CLAIMS), len(CLAIMS)))
    if "all_mass_on" in case.inputs:
        first, second = case.inputs["all_mass_on"]
        joint[first - MIN_CLAIM, second - MIN_CLAIM] = 1
    else:
        joint[:] = case.inputs["joint"]
    check_correlated(case, PAYOFFS, joint)


def hierarchical_softmax(case: Case) -> None:
    profile = bimatrix_game.compute_hierarchical_softmax(
        PAYOFFS, case.inputs["precision"], case.inputs["level"]
    )
    for p in profile:
        case.close("distribution", p)
        case.close("most_likely", CLAIMS[p >= p.max() * (1 - 1e-9)])
        case.close("mean", (p * CLAIMS).sum())
        case.close("share_97_to_100", p[CLAIMS >= 97].sum())


def parse_mix(text: str) -> np.ndarray:
    """Parse the description of a mixed strategy of claims."""
    p = np.zeros(len(CLAIMS))
    uniform_match = re.fullmatch(r"uniform over (\d+)\.\.(\d+)", text)
    if uniform_match:
        low, high = map(int, uniform_match.groups())
        p[low - MIN_CLAIM : high - MIN_CLAIM + 1] = 1 / (high - low + 1)
        return p
    for part in text.split(", "):
        match = re.fullmatch(r"(half|[\d.]+) (?:on )?(\d+)", part)
        assert match, f"unknown mix {text!r}"
        weight, claim = match.groups()
        p[int(claim) - MIN_CLAIM] = 0.5 if weight == "half" else float(weight)
    return p


def check_best_responses(case: Case, p: np.ndarray) -> np.ndarray:
    """Check the best responses to a mixed strategy; return the expected reward of each claim."""
    profile = MixedProfile(p, p)
    values, others = bimatrix_game.compute_response_values(PAYOFFS, profile)
    np.testing.assert_allclose(values, others, atol=1e-12)
    for best in best_responses.find_best_responses(PAYOFFS, profile):
        case.close("claims", CLAIMS[best])
    case.close("utility", values.max())
    return values


def best_response(case: Case) -> None:
    check_best_responses(case, np.eye(len(CLAIMS))[case.inputs["to"] - MIN_CLAIM])


def best_response_to_mix(case: Case) -> None:
    values = check_best_responses(case, parse_mix(case.inputs["mix"]))
    case.close("utility_of_2", values[0])
    case.close("utility_of_100", values[MAX_CLAIM - MIN_CLAIM])


def best_response_claim(claim: int) -> int:
    p = np.eye(len(CLAIMS))[claim - MIN_CLAIM]
    ((best,), _) = best_responses.find_best_responses(PAYOFFS, MixedProfile(p, p))
    return best + MIN_CLAIM


def iterated_best_response(case: Case) -> None:
    pairs = [tuple(case.inputs["start"])]
    while len(pairs) < 2 or pairs[-1] != pairs[-2]:
        first, second = pairs[-1]
        pairs.append((best_response_claim(second), best_response_claim(first)))
    case.close("steps_until_fixed", len(pairs) - 2)
    case.close("final", pairs[-1])
    case.close("first_ten", (pairs + pairs[-1:] * 10)[1:11])


KINDS = map_by_kind(
    payoff, payoff_table, nash, correlated_check, hierarchical_softmax, best_response,
    best_response_to_mix, iterated_best_response,
)  # fmt: skip
LATER: set[str] = set()
