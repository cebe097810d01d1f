"""One equilibrium of a bimatrix game, by complementary pivoting (Lemke and Howson, 1964).

Two linear systems, `r + A y = 1` and `B' x + s = 1`, in nothing negative (von Stengel, 2002). Each
action has a label: one that is played has a weight, one that is not has a slack. A label is
dropped and its weight brought in; what must leave for it says what is brought into the other
system, until the label that was dropped leaves. Each basis is solved anew, so that rounding does
not add up; ties are broken lexicographically, so that no path comes to where it was.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ARRAY_CALL_WORK, Budget
from dmplay.chance import Ints, Reals
from dmplay.errors import BudgetExceeded
from dmplay.solvers.matrix_game import MixedProfile, compute_regrets, enumerate_equilibria_if_small
from dmplay.solvers.zero_sum import normalize_weights

ZERO_TOLERANCE = 1e-11  # of systems whose entries are about 1
WORK_LIMIT = 2e10
MAX_PIVOTS = 1000  # pivots of a path, after which another label is dropped
MAX_REGRET = 1e-9  # what an agent may gain, where payoffs are about 1


class _LinearSystem(NamedTuple):
    """Columns by label, and those that are in the basis."""

    columns: Reals  # [K, labels]
    basis: Ints  # [K]

    def enter_basis(self, label: int) -> int:
        """Brings a column in; the label of that which leaves."""
        inverse = np.linalg.inv(self.columns[:, self.basis])
        rise = inverse @ self.columns[:, label]
        able = np.flatnonzero(rise > ZERO_TOLERANCE)
        levels = np.column_stack([inverse.sum(axis=1), inverse])[able] / rise[able, None]
        rows = np.arange(len(able))
        for level in levels.T:
            rows = rows[level[rows] <= level[rows].min() + ZERO_TOLERANCE]
            if len(rows) == 1:
                break
        left = int(self.basis[able[rows[0]]])
        self.basis[able[rows[0]]] = label
        return left

    def compute_weights(self) -> Reals:
        """Those of all labels."""
        found = np.zeros(self.columns.shape[1])
        found[self.basis] = np.linalg.solve(self.columns[:, self.basis], np.ones(len(self.basis)))
        return found


def find_first_equilibrium(payoffs: Reals) -> MixedProfile:
    """The first equilibrium of all that can be listed; where these are too many, one."""
    listed = enumerate_equilibria_if_small(payoffs)
    return listed[0] if listed else find_equilibrium(payoffs)


def find_equilibrium(payoffs: Reals) -> MixedProfile:
    """An equilibrium of the payoffs `[A1, A2, 2]`."""
    budget = Budget("an equilibrium", "try fewer actions", WORK_LIMIT)
    size = max(1.0, float(np.ptp(payoffs)))
    for label in range(sum(payoffs.shape[:2])):
        found = _follow_path(payoffs, label, budget)
        if found and float(compute_regrets(payoffs, found).max()) <= MAX_REGRET * size:
            return found
    raise BudgetExceeded(budget.task, f"more than {MAX_PIVOTS} pivots on every path", budget.remedy)


def _follow_path(payoffs: Reals, dropped_label: int, budget: Budget) -> MixedProfile | None:
    """The equilibrium to which dropping a label leads; None where that is too far."""
    rows, columns = payoffs.shape[:2]
    low, scale = payoffs.min(axis=(0, 1)), np.ptp(payoffs, axis=(0, 1))
    one, other = np.moveaxis(1.0 + (payoffs - low) / np.where(scale > 0, scale, 1.0), 2, 0)
    systems = (
        _LinearSystem(np.hstack([other.T, np.eye(columns)]), rows + np.arange(columns)),  # x and s
        _LinearSystem(np.hstack([np.eye(rows), one]), np.arange(rows)),  # r and y
    )
    turn, label = int(dropped_label >= rows), dropped_label
    for done in range(MAX_PIVOTS):
        budget.spend_work(ARRAY_CALL_WORK + 3.0 * len(systems[turn].basis) ** 3, done / MAX_PIVOTS)
        label = systems[turn].enter_basis(label)
        if label == dropped_label:
            first, second = systems[0].compute_weights()[:rows], systems[1].compute_weights()[rows:]
            return MixedProfile(normalize_weights(first), normalize_weights(second))
        turn = 1 - turn
    return None
