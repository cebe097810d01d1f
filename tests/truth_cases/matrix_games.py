"""Checks shared by the cases of matrix games."""

from dmplay.core.arrays import Reals
from tests.oracles.best_responses import compute_correlated_gains
from tests.truth_cases.case import Case


def check_correlated(case: Case, payoffs: Reals, joint: Reals) -> None:
    """Check each agent's gain from deviating from a joint distribution, 0 in an equilibrium."""
    gains = compute_correlated_gains(payoffs, joint)
    case.close("best_gain_agent1", gains[0])
    case.close("best_gain_agent2", gains[1])
    assert case.expect["equilibrium"] == (gains <= 1e-9).all()
