"""Tests of the cache of solutions, which policies of the same problem share."""

import numpy as np

import dmplay
from dmplay.core.memoization import memoize
from dmplay.core.work_budget import report_progress_to
from tests.support.literature_dec_pomdps import format_dectiger, parse_team_file
from tests.support.literature_pomdps import UnhashableProblem


def test_results_for_unhashable_arguments_are_not_cached() -> None:
    arguments: list[object] = []

    @memoize
    def find(problem: object) -> int:
        arguments.append(problem)
        return len(arguments)

    assert [find(argument) for argument in ([1], [1], (1,), (1,), "a", (1,))] == [1, 2, 3, 3, 4, 3]


def test_an_equilibrium_is_computed_once_for_both_seats() -> None:
    progress: list[float] = []
    for seat in range(2):
        agent = dmplay.load_agent(dmplay.load_problem("rock-paper-scissors"), seat, "nash")
        with (
            report_progress_to(progress.append) if seat else report_progress_to(lambda share: None)
        ):
            agent.choose(agent.initial_memory(np.zeros(1, np.int64)), None, np.zeros((1, 1)))
    assert not progress


def test_a_team_problem_that_is_not_hashable_is_planned_too() -> None:
    tigers = UnhashableProblem(1.0, model=parse_team_file(format_dectiger()).model)
    for seat in range(2):
        agent = dmplay.load_agent(tigers, seat, "joint-plan:horizon=2")
        chosen = agent.choose(agent.initial_memory(np.full(1, -1)), None, np.zeros((1, 0)))
        assert tigers.format_action(seat, chosen[0]) == "listen"
