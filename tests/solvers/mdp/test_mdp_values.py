"""Tests that greedy choices and beliefs of a batch equal those of each row alone."""

import numpy as np
import pytest

from dmplay.core.belief import apply_bayes_rule
from dmplay.core.best_actions import mark_best_actions, select_greedy_actions


def test_greedy_choices_of_a_row_do_not_depend_on_the_batch() -> None:
    values = np.random.default_rng(5).integers(0, 3, (40, 4)).astype(float)
    values[3], values[4, :2] = -np.inf, (2.0 - 1e-10, 2.0)
    choices = select_greedy_actions(values)
    assert choices.tolist() == [int(select_greedy_actions(row)) for row in values]
    assert choices.tolist() == np.argmax(mark_best_actions(values), axis=1).tolist()
    assert choices.tolist() == [row.index(True) for row in mark_best_actions(values).tolist()]


@pytest.mark.parametrize(("rows", "states"), [(40, 7), (4, 300)])
def test_beliefs_of_a_row_are_bitwise_independent_of_the_batch(rows: int, states: int) -> None:
    joint = np.random.default_rng(5).random((rows, states))
    joint[3] = 0.0
    batch = apply_bayes_rule(joint)
    for row, joint_row in enumerate(joint):
        single = apply_bayes_rule(joint_row)
        assert single.belief.tobytes() == batch.belief[row].tobytes()
        assert single.likelihood == batch.likelihood[row]
    assert not batch.belief[3].any()
