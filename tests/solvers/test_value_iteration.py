"""Choices by value, and beliefs: of many rows they are what each row alone comes to."""

import numpy as np
import pytest

from dmplay.belief import apply_bayes_rule
from dmplay.solvers.value_iteration import mark_best_actions, select_greedy_actions


def test_the_first_of_the_best_is_the_same_beside_other_rows() -> None:
    values = np.random.default_rng(5).integers(0, 3, (40, 4)).astype(float)
    values[3], values[4, :2] = -np.inf, (2.0 - 1e-10, 2.0)
    found = select_greedy_actions(values)
    assert found.tolist() == [int(select_greedy_actions(row)) for row in values]
    assert found.tolist() == np.argmax(mark_best_actions(values), axis=1).tolist()
    assert found.tolist() == [row.index(True) for row in mark_best_actions(values).tolist()]


@pytest.mark.parametrize(("rows", "states"), [(40, 7), (4, 300)])
def test_a_belief_has_the_same_bits_beside_other_rows(rows: int, states: int) -> None:
    joint = np.random.default_rng(5).random((rows, states))
    joint[3] = 0.0
    beside = apply_bayes_rule(joint)
    for row, one in enumerate(joint):
        alone = apply_bayes_rule(one)
        assert alone.belief.tobytes() == beside.belief[row].tobytes()
        assert alone.likelihood == beside.likelihood[row]
    assert not beside.belief[3].any()
