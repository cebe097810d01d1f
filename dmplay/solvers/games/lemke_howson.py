"""One equilibrium of a bimatrix game, by complementary pivoting (Lemke and Howson, 1964).

Two linear systems in nonnegative variables, `r + A y = 1` and `B' x + s = 1` (von Stengel, 2002).
Each action has a label: a played action has a weight, an unplayed one a slack. A label is dropped
and its weight enters the basis; the label that leaves enters the other system, until the dropped
label leaves. Each basis is solved from scratch, so that rounding errors do not accumulate; ties are
broken lexicographically, so that no path cycles.
"""

from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Ints, Reals
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BudgetExceeded
from dmplay.solvers.games.bimatrix_game import (
    MixedProfile,
    compute_regrets,
    enumerate_equilibria_if_small,
    needs_exact_arithmetic,
    normalize_payoffs,
)
from dmplay.solvers.games.extreme_equilibria import find_extreme_equilibria
from dmplay.solvers.games.zero_sum import normalize_weights

ZERO_TOLERANCE = 1e-11  # of systems whose entries are about 1
WORK_LIMIT = 2e10
MAX_PIVOTS = 1000  # pivots of a path, after which another label is dropped
MAX_REGRET = 1e-9  # gain of an agent by another strategy, with payoffs scaled to about 1


class _LinearSystem(NamedTuple):
    """A linear system with a column per label, and the labels in its basis."""

    columns: Reals  # [K, labels]
    basis: Ints  # [K]

    def enter_basis(self, label: int) -> int:
        """Bring a label's column into the basis and return the label that leaves it."""
        inverse = np.linalg.inv(self.columns[:, self.basis])
        rise = inverse @ self.columns[:, label]
        candidates = np.flatnonzero(rise > ZERO_TOLERANCE)
        entries = np.column_stack([inverse.sum(axis=1), inverse])
        ratios = entries[candidates] / rise[candidates, None]
        rows = np.arange(len(candidates))
        for ratio_column in ratios.T:
            rows = rows[ratio_column[rows] <= ratio_column[rows].min() + ZERO_TOLERANCE]
            if len(rows) == 1:
                break
        leaving_label = int(self.basis[candidates[rows[0]]])
        self.basis[candidates[rows[0]]] = label
        return leaving_label

    def compute_weights(self) -> Reals:
        """Return the basic solution: the weight of each label, 0 outside the basis."""
        result = np.zeros(self.columns.shape[1])
        result[self.basis] = np.linalg.solve(self.columns[:, self.basis], np.ones(len(self.basis)))
        return result


def find_first_equilibrium(payoffs: Reals) -> MixedProfile:
    """Return the first enumerated equilibrium, or one of a game too large to enumerate."""
    is_exact = needs_exact_arithmetic(payoffs)
    enumerate_all = find_extreme_equilibria if is_exact else enumerate_equilibria_if_small
    equilibria = enumerate_all(payoffs)
    return equilibria[0] if equilibria else find_equilibrium(payoffs)


def find_equilibrium(payoffs: Reals) -> MixedProfile:
    """Return one equilibrium of the payoffs `[A1, A2, 2]`.

    Raises BudgetExceeded if no path leads to one within MAX_PIVOTS.
    """
    budget = Budget("equilibrium", "try fewer actions", WORK_LIMIT)
    scaled = normalize_payoffs(payoffs)
    for label in range(sum(payoffs.shape[:2])):
        profile = _follow_path(payoffs, label, budget)
        if profile and float(compute_regrets(scaled, profile).max()) <= MAX_REGRET:
            return profile
    raise BudgetExceeded(budget.task, f"more than {MAX_PIVOTS} pivots on every path", budget.remedy)


def _follow_path(payoffs: Reals, dropped_label: int, budget: Budget) -> MixedProfile | None:
    """Return the equilibrium to which dropping a label leads, or None after MAX_PIVOTS pivots."""
    rows, columns = payoffs.shape[:2]
    first_payoffs, second_payoffs = np.moveaxis(1.0 + normalize_payoffs(payoffs), 2, 0)
    x_and_s = np.hstack([second_payoffs.T, np.eye(columns)])
    r_and_y = np.hstack([np.eye(rows), first_payoffs])
    systems = (
        _LinearSystem(x_and_s, rows + np.arange(columns)),
        _LinearSystem(r_and_y, np.arange(rows)),
    )
    system_index, label = int(dropped_label >= rows), dropped_label
    for pivot in range(MAX_PIVOTS):
        work = ARRAY_CALL_WORK + 3.0 * len(systems[system_index].basis) ** 3
        budget.spend_work(work, pivot / MAX_PIVOTS)
        label = systems[system_index].enter_basis(label)
        if label == dropped_label:
            first, second = systems[0].compute_weights()[:rows], systems[1].compute_weights()[rows:]
            return MixedProfile(normalize_weights(first), normalize_weights(second))
        system_index = 1 - system_index
    return None
