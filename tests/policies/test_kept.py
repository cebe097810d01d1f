"""What was found for a problem is kept, for all who ask for it again."""

import numpy as np

import dmplay
from dmplay.budget import report_progress_to
from dmplay.policies._kept import memoize
from tests.support.hidden import Listing
from tests.support.teams import dectiger, read


def test_what_cannot_be_told_from_others_is_found_anew() -> None:
    sought: list[object] = []

    @memoize
    def find(problem: object) -> int:
        sought.append(problem)
        return len(sought)

    assert [find(one) for one in ([1], [1], (1,), (1,), "a", (1,))] == [1, 2, 3, 3, 4, 3]


def test_an_equilibrium_is_sought_once_for_both_seats() -> None:
    heard: list[float] = []
    for seat in range(2):
        agent = dmplay.load_agent(dmplay.load_problem("rock-paper-scissors"), seat, "nash")
        with report_progress_to(heard.append) if seat else report_progress_to(lambda share: None):
            agent.choose(agent.initial_memory(np.zeros(1, np.int64)), None, np.zeros((1, 1)))
    assert not heard


def test_a_team_that_cannot_be_told_from_others_is_planned_too() -> None:
    tigers = Listing(1.0, model=read(dectiger()).model)
    for seat in range(2):
        agent = dmplay.load_agent(tigers, seat, "joint-plan:horizon=2")
        chosen = agent.choose(agent.initial_memory(np.full(1, -1)), None, np.zeros((1, 0)))
        assert tigers.format_action(seat, chosen[0]) == "listen"
