"""What the cases of matrix games ask alike."""

from dmplay.chance import Reals
from tests.oracles.responses import correlated_gains
from tests.truth_kinds.case import Case


def check_correlated(case: Case, payoffs: Reals, joint: Reals) -> None:
    """What each agent gains by leaving a joint distribution, which is nothing at equilibria."""
    gains = correlated_gains(payoffs, joint)
    case.close("best_gain_agent1", gains[0])
    case.close("best_gain_agent2", gains[1])
    assert case.expect["equilibrium"] == (gains <= 1e-9).all()
