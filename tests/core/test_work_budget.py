"""Tests of computation budgets: errors, shared limits and progress callbacks."""

import pytest

from dmplay.core.work_budget import Budget, ComputationStopped, limit_total_work, report_progress_to
from dmplay.errors import BudgetExceeded


def test_an_exceeded_budget_raises_one_line_with_the_remedy() -> None:
    budget = Budget("alpha vectors", "search needs none", work_limit=1e3)
    budget.spend_work(600)
    with pytest.raises(BudgetExceeded) as error:
        budget.spend_work(600)
    assert (
        str(error.value)
        == "alpha vectors: more than the limit of 1e+03 operations; search needs none"
    )


def test_a_total_work_limit_is_shared_by_budgets() -> None:
    sweeps = Budget("sweeps", "a discount", work_limit=50)
    plans = Budget("plans", "a search", work_limit=50)
    with limit_total_work(60):
        sweeps.spend_work(40)
        with pytest.raises(
            BudgetExceeded, match=r"^plans: more than the limit of 6e\+01 operations; a search$"
        ):
            plans.spend_work(30)
    plans.spend_work(30)


def test_memory_is_refused_before_it_is_allocated() -> None:
    with pytest.raises(
        BudgetExceeded, match=r"^tables: 9,537 MB, more than the limit of 512 MB; fewer states$"
    ):
        Budget("tables", "fewer states").check_memory(1e10)


def test_a_progress_callback_receives_shares_and_can_stop_the_work() -> None:
    shares = []

    def watch(share: float) -> None:
        shares.append(share)
        if share > 0.5:
            raise ComputationStopped

    budget = Budget("sweeps", "a discount", work_limit=10)
    with report_progress_to(watch):
        for _ in range(3):
            budget.spend_work(2)
        with pytest.raises(ComputationStopped):
            budget.spend_work(2)
    budget.spend_work(2)
    assert shares == [0.0, 0.2, 0.4, 0.6]
