"""Games of perfect information, against recursions and sums that are known."""

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest

from dmplay import Labels, Outcome, Problem, load_agent, rollout
from dmplay.chance import Array, Bools, Chance, Reals
from dmplay.core import WAIT_LABEL, parameter
from dmplay.errors import BadPolicy, BudgetExceeded
from dmplay.finding.agents import find_hint_provider, load_roster
from dmplay.policies.seeing import solve_by_backward_induction
from dmplay.reports.match import EvaluationRequest, make_lineup
from dmplay.solutions.every import solve_problem
from dmplay.solvers import backward_induction, graph
from tests.support.brought import Counted
from tests.support.drawn import Drawn, Pair
from tests.support.toe import Toe
from tests.support.turns import Nim


@dataclass(frozen=True)
class Heaps(Problem):
    """Nim with three heaps: who takes turns takes any number from one; the last one wins."""

    one: int = parameter(3, "in the first heap", 0, 3)
    two: int = parameter(3, "in the second heap", 0, 3)
    three: int = parameter(3, "in the third heap", 0, 3)
    agents = ("left", "right")
    actions = (Labels((*(f"{h}{n}" for h in "abc" for n in "123"), WAIT_LABEL)),) * 2
    state_count = 128

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.tile([self.one, self.two, self.three, 0], (rows, 1))

    def state_indices(self, s: Array) -> Array:
        return np.asarray(s @ [32, 8, 2, 1])

    def enumerate_states(self) -> Array:
        return np.stack(np.unravel_index(np.arange(128), (4, 4, 4, 2)), axis=1)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        rows = np.arange(len(s))
        heap, taken = np.divmod(np.minimum(a[rows, s[:, 3]], 8), 3)
        moved = s.copy()
        moved[rows, heap] -= taken + 1
        moved[:, 3] = 1 - s[:, 3]
        moved = np.where(self.terminal(s)[:, None], s, moved)
        won = 1.0 * (self.terminal(moved) & ~self.terminal(s)) * (1 - 2 * s[:, 3])
        return Outcome(moved, np.stack([won, -won], axis=1), moved)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s[:, :3].sum(axis=1) == 0)

    def legal_actions_mask(self, s: Array) -> Bools:
        able = np.zeros((len(s), 2, 10), bool)
        many = np.repeat(s[:, :3], 3, axis=1)
        rows = np.arange(len(s))
        able[rows, s[:, 3], :9] = many >= np.tile([1, 2, 3], 3)
        able[rows, 1 - s[:, 3], 9] = True
        return able

    def format_state(self, s: Array) -> str:
        return " ".join(map(str, s.tolist()))

    def parse_state(self, text: str) -> Array:
        return np.array([int(one) for one in text.split()])


def test_who_moves_wins_nim_unless_the_sum_is_nought() -> None:
    """Bouton's theorem of 1901: by the binary sum without carrying."""
    found = solve_by_backward_induction(Heaps(), None)
    heaps, mover = found.graph.states[:, :3], found.graph.states[:, 3]
    live = heaps.any(axis=1)
    wins = np.bitwise_xor.reduce(heaps, axis=1) != 0
    sign = np.where(mover == 0, 1, -1) * np.where(wins, 1, -1) * live
    np.testing.assert_array_equal(found.values_by_turns_left[-1], np.stack([sign, -sign], axis=1))
    assert found.gap == 0
    told = solve_problem(Heaps(three=2))
    assert told.method == "backward induction over 88 states, without end"
    assert told.result == "value 1 to left, -1 to right at the start, exact"
    best = {"value left": 1.0, "value right": -1.0, "to decide": "left", "best": "a2 b2 c2"}
    assert told.rows[0] == {"state": "3 3 2 0"} | best


def test_nobody_loses_tic_tac_toe_who_knows_it() -> None:
    toe = Toe()
    found = solve_problem(toe)
    assert found.method == "backward induction over 5478 states, without end"
    assert found.result == "value 0 to x, 0 to o at the start, exact"
    assert found.rows[0]["best"] == " ".join(f"cell{n}" for n in range(1, 10))
    best = [load_agent(toe, seat, "optimal") for seat in range(2)]
    careless = [load_agent(toe, seat, "random") for seat in range(2)]
    for seated in (best, [best[0], careless[1]], [careless[0], best[1]]):
        returns = rollout(toe, seated, episodes=50, seed=1).returns
        knows = [returns[:, seat] for seat in range(2) if seated[seat] is best[seat]]
        assert np.min(knows) >= 0.0
        assert np.mean(knows) == 0.0 if seated is best else np.mean(knows) > 0.7
    memory = best[0].initial_memory(np.array([int(toe.parse_state("xx.oo...."))]))
    values = best[0].action_values(memory)
    assert values is not None
    assert values[0, [2, 5]].tolist() == [1.0, 0.0]
    assert np.isinf(values[0, [0, 1, 3, 4, 9]]).all()
    assert best[0].choose(memory, None, np.zeros((1, 0))).tolist() == [2]  # which wins at once


@dataclass(frozen=True)
class InTurn(Drawn):
    """Three who decide in turn, each for itself: the state says who."""

    agents = ("one", "two", "three")

    @property
    def actions(self) -> tuple[Labels, ...]:
        """Three, or to wait."""
        return (Labels(("a", "b", WAIT_LABEL)),) * 3

    def legal_actions_mask(self, s: Array) -> Bools:
        able = np.zeros((len(s), 3, 3), bool)
        able[..., 2] = True
        able[np.arange(len(s)), s % 3] = [True, True, False]
        return able


def by_recursion(problem: Drawn, turns: int) -> Reals:
    """What so many turns are worth, by the definition, to each agent in the start."""

    @cache
    def worth(s: int, left: int) -> tuple[float, ...]:
        if not left or problem.terminal(np.array([s]))[0]:
            return (0.0,) * len(problem.agents)
        able = problem.legal_actions_mask(np.array([s]))[0]
        mover = s % len(problem.agents)
        each: list[Reals] = []
        for action in np.flatnonzero(able[mover]):
            joint = np.full((1, len(problem.agents)), 2)
            joint[0, mover] = action
            here = s, int(problem.joint(joint)[0])
            later = [problem.transition[here][t] * np.array(worth(t, left - 1)) for t in range(5)]
            each.append(problem.rewards[here] + problem.discount * np.sum(later, axis=0))
        chosen = max(each, key=lambda one: float(one[mover]))
        return tuple(chosen.tolist())

    return np.array(worth(0, turns))


def test_ten_drawn_games_are_worth_what_the_recursion_says() -> None:
    for seed in range(10):
        turns = seed % 4 + 2
        discount = 1.0 if seed % 2 else 0.8
        for kind in (Drawn, InTurn):
            problem = kind(seed=seed, turns=turns, discount=discount, ends=seed < 5)
            wanted = by_recursion(problem, turns)
            found = solve_by_backward_induction(problem, turns)
            np.testing.assert_allclose(found.get_values(turns)[0], wanted, atol=1e-9)
            hasty = kind(seed=seed, turns=turns, discount=0.0)
            once = solve_by_backward_induction(hasty, turns).get_values(turns)[0]
            np.testing.assert_allclose(once, by_recursion(hasty, 1), atol=1e-9)
        if discount == 1.0:
            one = Drawn(seed=seed, turns=turns, discount=1.0, ends=seed < 5)
            value = float(by_recursion(one, turns)[0])
            assert solve_problem(one).result == f"value {value:.6g} at the start, exact"
            optimal = load_agent(one, 0, "optimal")
            played = rollout(one, [optimal], episodes=400, seed=seed).returns[:, 0]
            assert abs(played.mean() - value) < 3 * played.std(ddof=1) / 20
            longer = load_agent(one, 0, f"optimal:horizon={turns + 3}")
            values = longer.action_values(longer.initial_memory(np.zeros(1, int)))
            assert values is not None
            assert values.max() == pytest.approx(by_recursion(one, turns + 3)[0])


@dataclass(frozen=True)
class Dally(Counted):
    """Who holds the prize may cash it, or dally for a round of the other's."""

    tip: float = parameter(0.0, "what a round pays to who holds the prize")
    agents = ("holder", "other")
    actions = (Labels(("dally", "cash", WAIT_LABEL)), Labels(("on", WAIT_LABEL)))
    state_count, placed = 3, 0

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        moved = np.where(s == 0, 1 + a[:, 0], np.where(s == 1, 0, s))
        paid = np.where(s == 0, np.where(moved == 2, 1.0, self.tip), 0.0)
        return Outcome(moved, np.stack([paid, 0 * paid], axis=1), moved)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 2)

    def legal_actions_mask(self, s: Array) -> Bools:
        able = np.array([[[1, 1, 0], [0, 1, 0]], [[0, 0, 1], [1, 0, 0]], [[0, 0, 1], [0, 1, 0]]])
        return np.asarray(able[s] > 0)


def test_a_game_that_may_go_on_is_played_to_its_end_or_refused() -> None:
    problem = Dally()
    assert solve_problem(problem).rows[0]["best"] == "dally cash"
    seated = [load_agent(problem, seat, "optimal") for seat in range(2)]
    played = rollout(problem, seated, episodes=1)
    assert played.returns.tolist() == [[1.0, 0.0]]
    assert played.turn_counts.tolist() == [1]
    with pytest.raises(
        BudgetExceeded, match="after 50 turns; games need not end; give a discount bel"
    ):
        solve_problem(Dally(tip=1.0))
    endless = solve_problem(Dally(tip=1.0, discount=0.9)).result
    assert endless.startswith("value 5.26316 to holder, 0 to other at the start, at most ")


@dataclass(frozen=True)
class Corridor(Counted):
    """A hundred steps to the end, each of which costs 1."""

    actions = (Labels(("on",)),)
    state_count, placed = 101, 100

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        moved = np.maximum(s - 1, 0)
        return Outcome(moved, (moved - s)[:, None].astype(float), moved)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 0)


def test_a_long_way_to_the_end_is_not_taken_for_one_without() -> None:
    problem = Corridor()
    found = backward_induction.run_backward_induction(
        problem, graph.build_full_graph(problem), None
    )
    assert found.get_values(None)[:, 0].tolist() == [-s for s in range(101)]


@dataclass(frozen=True)
class Siege(Corridor):
    """To hold out costs 1 a turn for ever, to yield 100 at once."""

    actions = (Labels(("hold", "yield")),)
    state_count, placed = 2, 1

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        moved = np.where(a[:, 0] == 1, 0, s)
        return Outcome(moved, np.where(moved < s, -100.0, -1.0)[:, None], moved)


def test_what_lasts_until_the_end_is_the_cheaper_is_waited_for() -> None:
    problem = Siege()
    found = backward_induction.run_backward_induction(
        problem, graph.build_full_graph(problem), None
    )
    assert found.get_values(None)[:, 0].tolist() == [0.0, -100.0]


def test_the_optimum_advises_and_is_refused_where_two_act_at_once() -> None:
    found = find_hint_provider(Nim(), 0)
    assert found is not None
    assert found[0] == "optimal"
    assert [*load_roster(Nim()).agents] == ["optimal", "random", "search"]
    beyond = load_agent(Nim(), 0, "optimal")
    values = beyond.action_values(beyond.initial_memory(np.array([12])))  # which no game comes to
    assert values is not None
    assert np.isinf(values).all()
    with pytest.raises(BadPolicy, match="got agents who act at once"):
        solve_by_backward_induction(Pair(), 3)


def test_who_plays_some_turns_many_times_plans_so_many() -> None:
    match = EvaluationRequest("machine-replacement", agent="optimal", turn_limit=5)
    assert make_lineup(match).agent_names == ["optimal:horizon=5"]
    assert make_lineup(match._replace(turn_limit=None)).agent_names == ["optimal"]
    assert [*load_roster(Drawn(turns=9)).agents][:2] == ["optimal", "plan"]
    assert solve_problem(Drawn(turns=9)).result.endswith(" at the start of 9 turns")
