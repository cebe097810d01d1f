"""Tests of user-defined problems: their agents, hints and text depend on kind and size alone."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import Interval, Labels, Outcome, Tables, Tabular
from dmplay.agents import point_based
from dmplay.agents.base import AdviceQuestion
from dmplay.agents.point_based import PointBasedOptimalPolicy
from dmplay.core.arrays import Array, Bools
from dmplay.core.chance import Categorical, Chance
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.session import Session
from dmplay.core.spaces import TextLine
from dmplay.core.uniforms import SeededUniforms
from dmplay.core.work_budget import limit_total_work
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.evaluation.solutions import solve
from dmplay.evaluation.solutions.options import SolveOptions, use_solve_options
from dmplay.evaluation.solutions.simulated_returns import solve_by_simulation
from dmplay.game import position as advising
from dmplay.game.game import Game
from dmplay.game.seats import HUMAN
from dmplay.registry.agents import find_hint_provider, load_roster, set_horizon_in_name
from dmplay.solvers.mdp import mdp_values
from dmplay.solvers.pomdp import exact_pomdp
from dmplay.solvers.pomdp import point_based as solver
from tests.support.document_examples import TIGER_SOURCE
from tests.support.interruption import run_with_call_limit
from tests.support.literature_pomdps import make_four_by_three
from tests.support.programs import run_dmplay
from tests.support.screens import make_session_game
from tests.support.user_problems import Heap, IntegerStateProblem, Key, RevealingVault, Vault

GUIDE_NAMESPACE: dict[str, type[Tabular]] = {}
exec(TIGER_SOURCE, GUIDE_NAMESPACE)  # the example of the guide
Tiger = GUIDE_NAMESPACE["Tiger"]


@dataclass(frozen=True)
class EndlessTiger(Tiger):  # type: ignore[misc, valid-type]
    """The tiger problem with an infinite horizon."""

    horizon = None
    discount: float = 0.95


@dataclass(frozen=True)
class Lamp(Tabular):
    """Two visible states: light is worth 1 per turn, and the switch costs 0.5."""

    actions = (Labels(("wait", "switch")),)
    state_names, initial_belief = ("dark", "light"), np.array([1.0, 0.0])
    discount: float = 0.5
    tables = Tables(
        np.array([[[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]]),
        np.array([[[0.0], [-0.5]], [[1.0], [0.5]]]),
    )


@dataclass(frozen=True)
class CoinFlip(IntegerStateProblem):
    """A coin that is turned over at random; the observation is whether it was turned."""

    discount: float = 0.9
    actions = (Labels(("heads", "tails")),)
    observations = (Labels(("same", "turned")),)
    state_count, placed, horizon = 2, 0, 5

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return (Categorical(np.ones((rows, 1))),)

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return events[0]

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Categorical(np.full((len(s), 1), 0.5)),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        rewards = np.where(a[:, 0] == s, 1.0, 0.0)
        return Outcome(events[0], rewards[:, None], np.asarray(events[0] != s, int)[:, None])


@dataclass(frozen=True)
class TextCoinFlip(CoinFlip):
    """The coin with text observations."""

    observations = (TextLine(),)  # type: ignore[assignment]


@dataclass(frozen=True)
class EndlessHeap(Heap):
    """A heap with too many states to list, in an undiscounted game."""

    discount: float = 1.0
    state_count = 2**60


@dataclass(frozen=True)
class GrowingTower(IntegerStateProblem):
    """A tower that can grow without end."""

    actions = (Labels(("stay", "grow")),)
    state_count, placed = math.inf, 0

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return ()

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s + a[:, 0], np.asarray(a, float), s + a[:, 0])


@dataclass(frozen=True)
class FourHiddenStates(Tabular):
    """Four hidden states with one action each: the number of plans grows quickly."""

    discount: float = 0.9
    horizon = 6
    actions = (Labels(("look", "a", "b", "c", "d")),)
    observations = (Labels(("x", "y")),)
    state_names = ("a", "b", "c", "d")
    tables = Tables(
        np.stack([np.eye(4)] + [np.full((4, 4), 0.25)] * 4, axis=1),
        np.hstack([np.full((4, 1), -0.1), 2 * np.eye(4) - 1])[:, :, None],
        np.stack(
            [np.array([[0.9, 0.1], [0.6, 0.4], [0.4, 0.6], [0.1, 0.9]])]
            + [np.full((4, 2), 0.5)] * 4
        ),
    )


@dataclass(frozen=True)
class ContinuousLamp(Lamp):
    """A lamp whose actions are real numbers."""

    actions = (Interval(-1.0, 1.0),)  # type: ignore[assignment]


@dataclass(frozen=True)
class FusedLamp(Lamp):
    """A lamp that can stay on forever or go out for good."""

    discount: float = 1.0
    initial_belief = np.array([0.0, 1.0])
    tables = Tables(
        np.array([[[1.0, 0.0]] * 2, [[0.0, 1.0], [1.0, 0.0]]]),
        np.array([[[0.0], [0.0]], [[1.0], [0.5]]]),
    )

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 0)


def make_game(problem: dmplay.Problem, limit: int | None = None) -> Game:
    return make_session_game(
        "mine", Session(problem, SeededUniforms(7, 0), [None], turn_limit=limit), [HUMAN]
    )


@pytest.mark.parametrize(
    ("problem", "fitting", "hint"),
    [
        (Tiger(), ["optimal", "point-based", "plan"], "optimal"),
        (EndlessTiger(), ["optimal", "point-based", "plan", "fib", "qmdp"], "optimal"),
        (CoinFlip(), ["optimal", "point-based"], "optimal"),
        (Lamp(), ["optimal"], "optimal"),
        (Lamp(discount=1.0), ["plan"], "search"),
        (ContinuousLamp(), [], "search"),
        (TextCoinFlip(), [], "search"),
        (EndlessHeap(), [], "search"),
    ],
)
def test_a_problem_has_the_agents_that_its_kind_allows(
    problem: Tabular, fitting: list[str], hint: str
) -> None:
    assert [*load_roster(problem).agents] == [*fitting, "random", "search"]
    assert load_roster(problem, 0).hint_provider == hint


def test_an_endless_game_is_planned_once_it_has_a_turn_limit() -> None:
    endless = Lamp(discount=1.0)
    names = [
        provider.name
        for turns in (None, 4, 10**9)
        if (provider := find_hint_provider(endless, AdviceQuestion(0, turns)))
    ]
    assert [name.partition(":")[0] for name in names] == ["search", "plan", "search"]


def test_an_endless_undiscounted_problem_is_searched_or_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(mdp_values, "MAX_SWEEPS", 1000)
    policy = dmplay.load_agent(FusedLamp(), 0, "optimal")
    with pytest.raises(BudgetExceeded, match="values change by 1 per turn; there is no discount"):
        dmplay.rollout(FusedLamp(), [policy], episodes=1, turn_limit=2)
    assert make_game(FusedLamp()).hint_provider.create_hint().startswith("hint by search: wait. ")
    hint = make_game(FusedLamp(), limit=3).hint_provider.create_hint()
    assert hint == "hint by plan (3 turns left): wait. exact values: wait 3.00, switch 0.50"


def test_an_illegal_action_is_neither_valued_nor_best() -> None:
    solution = solve.solve_problem(Key())
    assert [(row["state"], row["best"]) for row in solution.rows] == [
        ("before", "take"), ("with the key", "open"), ("done", "take wait open"),
    ]  # fmt: skip
    assert [row["value"] for row in solution.rows] == pytest.approx([8.0, 10.0, 0.0])
    assert (
        make_game(Key()).hint_provider.create_hint()
        == "hint by optimal: take. exact values: take 8.00, wait 7.20"
    )
    result = dmplay.rollout(Key(), [dmplay.load_agent(Key(), 0, "optimal")], episodes=1)
    assert result.returns[0, 0] == pytest.approx(8.0)


@dataclass(frozen=True)
class JammedLever(Tabular):
    """The lever of a machine whose state is hidden: it cannot be pulled, and pushing it pays."""

    discount: float = 0.5
    actions, observations = (Labels(("pull", "push", "wait")),), (Labels(("dark",)),)
    state_names = ("even", "odd")
    tables = Tables(np.full((2, 3, 2), 0.5), [[[9.0], [1.0], [0.0]]] * 2, np.ones((3, 2, 1)))

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.tile([False, True, True], (len(s), 1, 1))


@pytest.mark.parametrize("name", ["optimal", "plan:horizon=3", "fib", "qmdp"])
def test_only_legal_actions_are_chosen_with_hidden_states(name: str) -> None:
    result = dmplay.rollout(
        JammedLever(), [dmplay.load_agent(JammedLever(), 0, name)], episodes=1, turn_limit=3
    )
    assert result.returns[0, 0] == pytest.approx(1.75)


@dataclass(frozen=True)
class RestrictedDilemma(MatrixGame):
    """A prisoner's dilemma in which the first player may only talk."""

    discount: float = 0.1
    actions = (Labels(("silent", "talk")),) * 2
    payoffs = np.array([[[-1.0, -1.0], [-4.0, 0.0]], [[0.0, -4.0], [-3.0, -3.0]]])

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.tile([[False, True], [True, True]], (len(s), 1, 1))


def test_only_legal_actions_are_chosen_in_a_repeated_game() -> None:
    for name in {*load_roster(RestrictedDilemma()).agents} - {"search"}:
        policies = [dmplay.load_agent(RestrictedDilemma(), seat, name) for seat in range(2)]
        assert dmplay.rollout(
            RestrictedDilemma(), policies, episodes=1, turn_limit=2
        ).turn_counts.tolist() == [2]
    assert solve.solve_problem(RestrictedDilemma()).rows[0]["agent1"] == "talk"


@dataclass(frozen=True)
class LockedDoors(Tabular):
    """Doors that open only with a key that no agent has."""

    discount: float = 0.9
    actions = (Labels(("listen", "open")),)
    observations = (Labels(("left", "right")),)
    state_names, initial_belief = ("left", "right", "open"), np.array([0.5, 0.5, 0.0])
    tables = Tables(
        np.stack([np.eye(3)] * 2, axis=1),
        np.array([[-1.0, -1.0], [-1.0, -1.0], [0.0, 0.0]])[:, :, None],
        np.full((2, 3, 2), 0.5),
    )

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.stack([np.ones(len(s), bool), s == 2], axis=1)[:, None]


def test_no_belief_value_is_shown_if_legal_actions_reveal_the_state() -> None:
    for kind, agents in ((Vault, {"optimal", "search"}), (RevealingVault, {"search"})):
        assert {"optimal", "search"} & set(load_roster(kind()).agents) == agents
    with use_solve_options(SolveOptions(episodes=2)):
        assert solve.solve_problem(RevealingVault()).method.startswith("not a solution")


def test_illegal_first_actions_are_not_listed_with_hidden_states(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(point_based, "EXACT_WORK_LIMIT", 1e7)
    for problem, first in ((Vault(), ["listen", "take"]), (LockedDoors(), ["listen"])):
        with limit_total_work(1e8):
            solution = solve.solve_problem(problem)
        assert solution.method.startswith("point-based, ")
        assert [row["first"] for row in solution.rows] == first
        assert solution.rows[0]["best"] == "*"


def test_a_long_game_without_a_discount_is_bounded() -> None:
    with use_solve_options(SolveOptions(turns=150)), limit_total_work(1e8):
        solution = solve.solve_problem(make_four_by_three(1.0))
    assert solution.method == "point-based, 150 turns"
    assert solution.result.startswith("value ")
    with (
        use_solve_options(SolveOptions(turns=2000)),
        pytest.raises(BadParameter, match=r"^turns: got 2000, expected"),
    ):
        solve.solve_problem(make_four_by_three(1.0))


def test_an_endless_game_is_simulated_for_a_limited_number_of_turns() -> None:
    with use_solve_options(SolveOptions(episodes=2)):
        assert (
            solve_by_simulation(GrowingTower()).result == "2 games with seed 1, 20 turns on average"
        )


def test_solving_uses_the_requested_amount_of_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver, "DEFAULT_WORK_LIMIT", 2e7)
    with use_solve_options(SolveOptions(work=2.0)):
        result = solve.solve_problem(make_four_by_three(0.95)).result
    assert result.endswith("; for closer bounds: work=20")
    with (
        use_solve_options(options := SolveOptions(work=2.0)),
        pytest.raises(
            BadParameter,
            match=r"^work: has no effect, because this solution computes no bounds; the",
        ),
    ):
        options.check_options_used(solve.solve_problem(Lamp()).method)


def test_the_values_of_a_lamp_are_those_of_the_turns_asked_for() -> None:
    # With one turn left the switch never pays; with two it costs 0.5 and earns 0.5 * 1.
    tables = {}
    for turns in (1, 2, 3):
        with use_solve_options(SolveOptions(turns=turns)):
            solution = solve.solve_problem(Lamp())
        assert solution.method == f"backward induction over 2 states, {turns} turns".replace(
            "1 turns", "1 turn"
        )
        tables[turns] = [(row["value"], row["best"]) for row in solution.rows]
    assert tables == {
        1: [(0.0, "wait"), (1.0, "wait")],
        2: [(0.0, "wait switch"), (1.5, "wait")],
        3: [(0.25, "switch"), (1.75, "wait")],
    }


def test_more_turns_than_can_be_solved_are_refused_with_the_maximum() -> None:
    with (
        use_solve_options(SolveOptions(turns=20_000)),
        pytest.raises(
            BadParameter,
            match=r"^turns: got 20000, expected at most 10000 for 2 states; without turns",
        ),
    ):
        solve.solve_problem(Lamp(discount=0.999999))


def test_turns_beyond_the_discount_have_the_value_of_an_endless_game() -> None:
    with use_solve_options(SolveOptions(turns=10**8)):
        assert solve.solve_problem(Lamp()).result.endswith(
            "; value 0.5 at the start with 100000000 turns"
        )
        result = solve.solve_problem(Lamp(discount=0.999999)).result
    assert result.endswith(
        "; the value of 100000000 turns takes too long to compute; try fewer turns"
    )


def test_observations_that_depend_on_the_previous_state_are_planned_for() -> None:
    solution = solve.solve_problem(CoinFlip())
    assert solution.method == "point-based, 5 turns"
    assert solution.result.startswith("value 4.0951 at the start; ")
    assert [row["best"] for row in solution.rows] == ["*", ""]


def test_a_problem_with_too_many_plans_is_solved_with_bounds(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(exact_pomdp, "WORK_LIMIT", 1000)
    agent = dmplay.load_agent(FourHiddenStates(discount=1.0), 0, "optimal")
    assert agent.action_values(agent.initial_memory(np.full(1, -1))) is not None
    with pytest.raises(BudgetExceeded, match="there are too many plans; use the agent search"):
        dmplay.load_agent(FourHiddenStates(discount=1.0), 0, "plan").action_values(
            (np.full((1, 4), 0.25),)
        )


def test_a_hint_uses_less_work_than_its_agent_may(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(point_based, "EXACT_WORK_LIMIT", 1e7)
    monkeypatch.setattr(advising, "ADVICE_WORK_LIMIT", 1000)
    assert (
        make_game(ThreeArms(discount=0.6))
        .hint_provider.create_hint()
        .startswith("hint by search (")
    )
    monkeypatch.setattr(advising, "ADVICE_WORK_LIMIT", 6e7)
    hint = make_game(ThreeArms(discount=0.6)).hint_provider.create_hint()
    assert hint.startswith("hint by point-based (20 turns left, value 1.")
    assert " to 1." in hint
    assert " at the start): " in hint


@dataclass(frozen=True)
class ThreeArms(Tabular):
    """Three arms in a constant state: each stage has far more plans than the one before."""

    discount: float = 0.95
    horizon = 20
    actions = (Labels(("a", "b", "c")),)
    observations = (Labels(("pays", "does not")),)
    state_names = ("p", "q", "r")
    likely = np.array([[0.8, 0.5, 0.2], [0.2, 0.8, 0.5], [0.5, 0.2, 0.8]])
    tables = Tables(
        np.stack([np.eye(3)] * 3, axis=1),
        likely[:, :, None],
        np.stack([likely.T, 1.0 - likely.T], axis=2),
    )


def test_a_hint_for_a_problem_with_too_many_plans_is_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(point_based, "EXACT_WORK_LIMIT", 5e6)
    hint = run_with_call_limit(make_game(ThreeArms(discount=0.3)).hint_provider.create_hint)
    assert hint.startswith("hint by optimal (20 turns left): ")
    with pytest.raises(
        BudgetExceeded, match=r"^alpha vectors: 641 MB, more than the limit of 512 MB; there"
    ):
        dmplay.load_agent(ThreeArms(), 0, "plan").action_values((np.full((1, 3), 1 / 3),))


def test_a_hint_depends_on_the_number_of_remaining_turns() -> None:
    tiger = make_game(Tiger())
    for _ in range(9):
        tiger.session.advance([0])
    assert tiger.hint_provider.create_hint().startswith("hint by optimal (1 turn left): ")
    values = tiger.hint_provider.format_values().full_values_text
    assert float(values.split("listen ")[1].split(",")[0]) == -1.0
    agent = dmplay.load_agent(Tiger(), 0, "optimal")
    returns = dmplay.rollout(Tiger(), [agent], episodes=1000, seed=1).returns[:, 0]
    assert abs(returns.mean() - 9.438) <= 2 * returns.std() / np.sqrt(len(returns))


def test_a_game_with_a_turn_limit_is_planned_to_its_end() -> None:
    assert set_horizon_in_name(EndlessTiger(), 0, "optimal", 3) == "optimal:horizon=3"
    assert set_horizon_in_name(EndlessTiger(), 0, "optimal", 1000) == "optimal"
    with pytest.raises(
        BadPolicy, match="an infinite horizon needs a discount below 1; or set --turns"
    ):
        _ = PointBasedOptimalPolicy(EndlessTiger(discount=1.0), 0).bounds


def test_the_first_hint_for_the_tiger_is_to_listen() -> None:
    tiger = make_game(Tiger())
    assert tiger.hint_provider.create_hint() == (
        "hint by optimal (10 turns left): listen. "
        "exact values: listen 9.44, open-left -36.25, open-right -36.25"
    )
    assert tiger.narrator.describe_situation(tiger.snapshot()) == (
        "nothing yet. belief: left 0.500, right 0.500. actions: listen, open-left, open-right."
    )


def test_the_endless_tiger_has_the_value_of_the_literature() -> None:
    policy = dmplay.load_agent(EndlessTiger(), 0, "optimal")
    values = policy.action_values(policy.initial_memory(np.full(1, -1)))
    assert values is not None
    assert values.max() == pytest.approx(19.3714, abs=1e-3)


def test_the_optimal_policy_switches_the_lamp_on_and_leaves_it_on() -> None:
    policy = dmplay.load_agent(Lamp(), 0, "optimal")
    values = policy.action_values(policy.initial_memory(np.array([0, 1])))
    assert values is not None
    assert values.tolist() == [[0.25, 0.5], [2.0, 0.75]]


def test_the_switch_changes_the_state_of_the_lamp() -> None:
    lamp = make_game(Lamp())
    for action, state in (("wait", "dark"), ("switch", "light"), ("wait", "light")):
        lamp.choose(lamp.keyboard.parse_action(lamp.view(), action))
        assert lamp.problem.format_state(lamp.session.state) == state
        assert lamp.view().observation == lamp.session.state
    assert [turn.rewards.tolist() for turn in lamp.session.turns] == [[0.0], [-0.5], [1.0]]


def test_a_problem_without_values_gets_hints_from_a_search() -> None:
    assert make_game(Lamp(discount=1.0)).hint_provider.create_hint().startswith("hint by search: ")


def test_a_limited_number_of_turns_of_an_endless_game_is_planned() -> None:
    lamp = Lamp(discount=1.0)
    assert set_horizon_in_name(lamp, 0, "plan", 3) == "plan:horizon=3"
    policy = dmplay.load_agent(lamp, 0, "plan:horizon=3")
    values = policy.action_values(policy.initial_memory(np.array([0, 1])))
    assert values is not None
    assert values.tolist() == [[0.5, 1.5], [3.0, 1.0]]
    endless = dmplay.load_agent(lamp, 0, "plan")
    with pytest.raises(
        BudgetExceeded, match=r"set a discount below 1, or a turn limit \(--turns N"
    ):
        endless.action_values(endless.initial_memory(np.array([0])))


def test_each_agent_needs_its_own_actions(tmp_path: Path) -> None:
    (tmp_path / "pair.py").write_text(
        TIGER_SOURCE.replace("    state_names", '    agents = ("a", "b")\n    state_names')
    )
    process = run_dmplay(tmp_path, f"{tmp_path}/pair.py:Tiger")
    assert process.returncode == 2
    assert (
        ":10 actions: got 1 action set for 2 agents, expected one for each agent" in process.stderr
    )
