import numpy as np

from dmplay.chance import Reals, weighted_sum
from dmplay.policies._believing import SparseTransition
from dmplay.policies._joint_plan import PartnerBeliefFilter

SEEN = np.array([[[0.5, 0.0], [0.0, 0.0]], [[0.2, 0.3], [0.0, 0.7]]])  # by turn, `[2, S, S']`
BESIDE_ANYONE = np.array([[[0.5, 0.1], [0.0, 0.3]], [[0.2, 0.3], [0.1, 0.7]]])


def beliefs(rows: int) -> Reals:
    likely = np.random.default_rng(3).random((rows, 2))
    likely[0] = 0.0, 1.0
    return np.asarray(likely / likely.sum(axis=1, keepdims=True))


def test_a_flow_is_of_what_can_happen_and_carries_what_the_whole_array_does() -> None:
    for dense in SEEN:
        flow = SparseTransition.from_dense(dense)
        assert len(flow.source) == np.count_nonzero(dense)
        for rows in (1, 2, 3, 40):  # few and many
            assert (flow.propagate(beliefs(rows)) == weighted_sum(beliefs(rows), dense)).all()


def test_rows_after_many_turns_believe_what_each_would_alone() -> None:
    beside, b = PartnerBeliefFilter.from_arrays(SEEN, BESIDE_ANYONE), beliefs(40)
    for turns in (np.arange(40) % 2, np.zeros(40, np.int64)):
        after = beside.update_beliefs(b, [turns])
        alone = [
            beside.update_beliefs(b[row : row + 1], [turns[row : row + 1]]) for row in range(40)
        ]
        assert (after == np.concatenate(alone)).all()


def test_what_a_foreseen_partner_rules_out_was_done_beside_anyone() -> None:
    after = PartnerBeliefFilter.from_arrays(SEEN, BESIDE_ANYONE).update_beliefs(
        beliefs(2), [np.zeros(2, np.int64)]
    )
    assert after.tolist() == [[0.0, 1.0], [1.0, 0.0]]
