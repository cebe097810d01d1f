"""A budget ends a computation in one line, and tells who watches how far it is."""

import pytest

from dmplay.budget import Budget, Stopped, watched, within
from dmplay.errors import TooMuch


def test_a_budget_ends_in_one_line_that_says_what_would_do() -> None:
    budget = Budget("alpha vectors", "search needs none", work=1e3)
    budget.spend(600)
    with pytest.raises(TooMuch) as caught:
        budget.spend(600)
    assert str(caught.value) == "alpha vectors: more than 1e+03 operations; search needs none"


def test_budgets_share_what_is_given_to_all_of_them() -> None:
    one, other = Budget("sweeps", "a discount", work=50), Budget("plans", "a search", work=50)
    with within(60):
        one.spend(40)
        with pytest.raises(TooMuch, match=r"^plans: more than 6e\+01 operations; a search$"):
            other.spend(30)
    other.spend(30)


def test_memory_is_refused_before_it_is_allocated() -> None:
    with pytest.raises(TooMuch, match=r"^tables: 9,537 MB, more than 512; fewer states$"):
        Budget("tables", "fewer states").hold(1e10)


def test_who_watches_is_told_the_share_and_may_stop_it() -> None:
    shares = []

    def watch(share: float) -> None:
        shares.append(share)
        if share > 0.5:
            raise Stopped

    budget = Budget("sweeps", "a discount", work=10)
    with watched(watch):
        for _ in range(3):
            budget.spend(2)
        with pytest.raises(Stopped):
            budget.spend(2)
    budget.spend(2)
    assert shares == [0.0, 0.2, 0.4, 0.6]
