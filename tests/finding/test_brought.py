"""Problems that a user brings: their agents, hints and words, by kind and size alone."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import Interval, Labels, Outcome, Tables, Tabular
from dmplay.advice import adviser as advising
from dmplay.budget import limit_total_work
from dmplay.chance import Array, Bools, Categorical, Chance
from dmplay.core import TextLine
from dmplay.dice import SeededUniforms
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.finding.agents import find_hint_provider, load_roster, plan_for_turn_limit
from dmplay.game.game import Game
from dmplay.game.seats import HUMAN
from dmplay.matrix_game import MatrixGame
from dmplay.policies import point_based
from dmplay.policies.point_based import PointBasedOptimalPolicy
from dmplay.session import Session
from dmplay.solutions import every
from dmplay.solutions.played import SimulationOptions, solve_by_simulation, use_simulation_options
from dmplay.solvers import alpha_vectors, value_iteration
from dmplay.solvers import point_based as solver
from tests.support.blocks import TIGER
from tests.support.brought import Counted, Heap, Key, Telltale, Vault
from tests.support.hidden import four_by_three
from tests.support.programs import run
from tests.support.quick import quickly
from tests.support.screens import seated

TOLD: dict[str, type[Tabular]] = {}
exec(TIGER, TOLD)  # the guide's own
Tiger = TOLD["Tiger"]


@dataclass(frozen=True)
class Patient(Tiger):  # type: ignore[misc, valid-type]
    """The tiger without an end."""

    horizon = None
    discount: float = 0.95


@dataclass(frozen=True)
class Lamp(Tabular):
    """Two states that are seen: light is worth 1 a turn, the switch costs 0.5."""

    actions = (Labels(("wait", "switch")),)
    state_names, initial_belief = ("dark", "light"), np.array([1.0, 0.0])
    discount: float = 0.5
    tables = Tables(
        np.array([[[1.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]]),
        np.array([[[0.0], [-0.5]], [[1.0], [0.5]]]),
    )


@dataclass(frozen=True)
class Flip(Counted):
    """A coin that is turned or not: what is seen is whether it was."""

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
        paid = np.where(a[:, 0] == s, 1.0, 0.0)
        return Outcome(events[0], paid[:, None], np.asarray(events[0] != s, int)[:, None])


@dataclass(frozen=True)
class Spoken(Flip):
    """The coin, told of in words."""

    observations = (TextLine(),)  # type: ignore[assignment]


@dataclass(frozen=True)
class Beans(Heap):
    """A heap of which no list can be made, and whose game goes on for ever."""

    discount: float = 1.0
    state_count = 2**60


@dataclass(frozen=True)
class Tower(Counted):
    """One that grows for ever."""

    actions = (Labels(("stay", "grow")),)
    state_count, placed = math.inf, 0

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return ()

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s + a[:, 0], np.asarray(a, float), s + a[:, 0])


@dataclass(frozen=True)
class Four(Tabular):
    """Four hidden states of which each has an action: plans are soon too many."""

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
class Dial(Lamp):
    """One whose actions are real numbers."""

    actions = (Interval(-1.0, 1.0),)  # type: ignore[assignment]


@dataclass(frozen=True)
class Fused(Lamp):
    """One that can be left on for ever, or goes out for good."""

    discount: float = 1.0
    initial_belief = np.array([0.0, 1.0])
    tables = Tables(
        np.array([[[1.0, 0.0]] * 2, [[0.0, 1.0], [1.0, 0.0]]]),
        np.array([[[0.0], [0.0]], [[1.0], [0.5]]]),
    )

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 0)


def game(problem: dmplay.Problem, limit: int | None = None) -> Game:
    return seated("mine", Session(problem, SeededUniforms(7, 0), [None], turn_limit=limit), [HUMAN])


@pytest.mark.parametrize(
    ("problem", "fitting", "hint"),
    [
        (Tiger(), ["optimal", "point-based", "plan"], "optimal"),
        (Patient(), ["optimal", "point-based", "plan", "qmdp"], "optimal"),
        (Flip(), ["optimal", "point-based"], "optimal"),
        (Lamp(), ["optimal"], "optimal"),
        (Lamp(discount=1.0), ["plan"], "search"),
        (Dial(), [], "search"),
        (Spoken(), [], "search"),
        (Beans(), [], "search"),
    ],
)
def test_a_problem_has_the_agents_that_its_kind_allows(
    problem: Tabular, fitting: list[str], hint: str
) -> None:
    assert [*load_roster(problem).agents] == [*fitting, "random", "search"]
    assert load_roster(problem, 0).hint_provider == hint


def test_the_turns_of_a_game_that_has_no_end_are_planned_once_they_are_known() -> None:
    unending = Lamp(discount=1.0)
    names = [
        found[0] for turns in (None, 4, 10**9) if (found := find_hint_provider(unending, 0, turns))
    ]
    assert [name.partition(":")[0] for name in names] == ["search", "plan", "search"]


def test_what_may_pay_for_ever_undiscounted_is_searched_or_planned(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(value_iteration, "MAX_SWEEPS", 1000)
    best = dmplay.load_agent(Fused(), 0, "optimal")
    with pytest.raises(BudgetExceeded, match="values change by 1 a turn; nothing is discounted"):
        dmplay.rollout(Fused(), [best], episodes=1, turn_limit=2)
    assert game(Fused()).hint_provider.create_hint() == "hint (search): wait"
    told = game(Fused(), limit=3).hint_provider.create_hint()
    assert told == "hint (plan:horizon=3): wait. values: wait 3.00, switch 0.50"


def test_what_is_not_legal_is_neither_valued_nor_best() -> None:
    found = every.solve_problem(Key())
    assert [(row["state"], row["best"]) for row in found.rows] == [
        ("before", "take"), ("with the key", "open"), ("done", "take wait open"),
    ]  # fmt: skip
    assert [row["value"] for row in found.rows] == pytest.approx([8.0, 10.0, 0.0])
    assert (
        game(Key()).hint_provider.create_hint()
        == "hint (optimal): take. values: take 8.00, wait 7.20"
    )
    played = dmplay.rollout(Key(), [dmplay.load_agent(Key(), 0, "optimal")], episodes=1)
    assert played.returns[0, 0] == pytest.approx(8.0)


@dataclass(frozen=True)
class Jammed(Tabular):
    """A lever of a machine nobody sees into: it cannot be pulled, and pays when it is pushed."""

    discount: float = 0.5
    actions, observations = (Labels(("pull", "push", "wait")),), (Labels(("dark",)),)
    state_names = ("even", "odd")
    tables = Tables(np.full((2, 3, 2), 0.5), [[[9.0], [1.0], [0.0]]] * 2, np.ones((3, 2, 1)))

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.tile([False, True, True], (len(s), 1, 1))


@pytest.mark.parametrize("name", ["optimal", "plan:horizon=3", "qmdp"])
def test_where_states_are_hidden_only_what_is_legal_is_done(name: str) -> None:
    played = dmplay.rollout(
        Jammed(), [dmplay.load_agent(Jammed(), 0, name)], episodes=1, turn_limit=3
    )
    assert played.returns[0, 0] == pytest.approx(1.75)


@dataclass(frozen=True)
class Barred(MatrixGame):
    """The prisoner's dilemma of two who cannot both be silent: the first may only talk."""

    discount: float = 0.1
    actions = (Labels(("silent", "talk")),) * 2
    payoffs = np.array([[[-1.0, -1.0], [-4.0, 0.0]], [[0.0, -4.0], [-3.0, -3.0]]])

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.tile([[False, True], [True, True]], (len(s), 1, 1))


def test_in_rounds_of_a_game_only_what_is_legal_is_done() -> None:
    for name in {*load_roster(Barred()).agents} - {"search"}:
        both = [dmplay.load_agent(Barred(), seat, name) for seat in range(2)]
        assert dmplay.rollout(Barred(), both, episodes=1, turn_limit=2).turn_counts.tolist() == [2]
    assert every.solve_problem(Barred()).rows[0]["agent1"] == "talk"


@dataclass(frozen=True)
class Shut(Tabular):
    """Doors that a key opens which nobody has."""

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


def test_where_what_is_legal_tells_of_the_state_no_value_of_a_belief_is_told() -> None:
    for kind, agents in ((Vault, {"optimal", "search"}), (Telltale, {"search"})):
        assert {"optimal", "search"} & set(load_roster(kind()).agents) == agents
    with use_simulation_options(SimulationOptions(episodes=2)):
        assert every.solve_problem(Telltale()).method.startswith("simulation")


def test_what_is_not_legal_at_the_start_is_not_named_where_states_are_hidden(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(point_based, "EXACT_WORK_LIMIT", 1e7)
    for problem, first in ((Vault(), ["listen", "take"]), (Shut(), ["listen"])):
        with limit_total_work(1e8):
            found = every.solve_problem(problem)
        assert found.method.startswith("point-based, ")
        assert [row["first"] for row in found.rows] == first
        assert found.rows[0]["best"] == "*"


def test_a_long_game_without_a_discount_is_bounded() -> None:
    with use_simulation_options(SimulationOptions(turns=150)), limit_total_work(1e8):
        found = every.solve_problem(four_by_three(1.0))
    assert found.method == "point-based, 150 turns"
    assert found.result.startswith("value ")
    with (
        use_simulation_options(SimulationOptions(turns=2000)),
        pytest.raises(BadParameter, match=r"^--turns: got 2000, expected"),
    ):
        every.solve_problem(four_by_three(1.0))


def test_a_game_that_nothing_ends_is_searched_for_some_turns() -> None:
    with use_simulation_options(SimulationOptions(episodes=2)):
        assert solve_by_simulation(Tower()).result == "2 games of seed 1, 20 turns each"


def test_solving_takes_as_much_work_as_is_wished(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(solver, "DEFAULT_WORK_LIMIT", 2e7)
    with use_simulation_options(SimulationOptions(work=2.0)):
        found = every.solve_problem(four_by_three(0.95)).result
    assert found.endswith("; more work brings them closer: --work 20")
    with (
        use_simulation_options(wish := SimulationOptions(work=2.0)),
        pytest.raises(
            BadParameter,
            match=r"^--work: nothing is brought between two bounds here; the",
        ),
    ):
        wish.check_options_used(every.solve_problem(Lamp()).method)


def test_more_turns_than_count_are_worth_what_a_game_without_end_is() -> None:
    with use_simulation_options(SimulationOptions(turns=10**8)):
        assert every.solve_problem(Lamp()).result.endswith(
            "; value 0.5 at the start of 100000000 turns"
        )
        told = every.solve_problem(Lamp(discount=0.999999)).result
    assert told.endswith("; what 100000000 turns are worth takes too much to tell; try fewer")


def test_what_is_seen_of_the_state_before_is_planned_for_too() -> None:
    found = every.solve_problem(Flip())
    assert found.method == "point-based, 5 turns"
    assert found.result.startswith("value 4.0951 at the start; ")
    assert [row["best"] for row in found.rows] == ["*", ""]


def test_plans_that_are_too_many_are_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(alpha_vectors, "WORK_LIMIT", 1000)
    agent = dmplay.load_agent(Four(discount=1.0), 0, "optimal")
    assert agent.action_values(agent.initial_memory(np.full(1, -1))) is not None
    with pytest.raises(BudgetExceeded, match="there are too many plans; search needs none"):
        dmplay.load_agent(Four(discount=1.0), 0, "plan").action_values((np.full((1, 4), 0.25),))


def test_a_hint_costs_less_than_the_agent_may_that_it_asks(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(point_based, "EXACT_WORK_LIMIT", 1e7)
    monkeypatch.setattr(advising, "HINT_WORK_LIMIT", 1000)
    assert game(Arms(discount=0.6)).hint_provider.create_hint().startswith("hint (search): ")
    monkeypatch.setattr(advising, "HINT_WORK_LIMIT", 6e7)
    hint = game(Arms(discount=0.6)).hint_provider.create_hint()
    assert hint.startswith("hint (point-based, value 1.")
    assert " to 1." in hint
    assert " at the start): " in hint


@dataclass(frozen=True)
class Arms(Tabular):
    """Three arms in a state that stays: each stage has far more plans than the one before."""

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


def test_a_hint_of_too_many_plans_is_soon_given(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(point_based, "EXACT_WORK_LIMIT", 5e6)
    hint = quickly(game(Arms(discount=0.3)).hint_provider.create_hint)
    assert hint.startswith("hint (optimal): ")
    with pytest.raises(BudgetExceeded, match=r"^alpha vectors: 641 MB, more than 512; there"):
        dmplay.load_agent(Arms(), 0, "plan").action_values((np.full((1, 3), 1 / 3),))


def test_a_hint_knows_how_many_turns_are_left() -> None:
    tiger = game(Tiger())
    for _ in range(9):
        tiger.session.advance([0])
    assert tiger.hint_provider.create_hint().startswith("hint (optimal): ")
    values = tiger.hint_provider.describe_values()
    assert float(values.split("listen ")[1].split(",")[0]) == -1.0
    agent = dmplay.load_agent(Tiger(), 0, "optimal")
    returns = dmplay.rollout(Tiger(), [agent], episodes=1000, seed=1).returns[:, 0]
    assert abs(returns.mean() - 9.438) <= 2 * returns.std() / np.sqrt(len(returns))


def test_a_game_of_some_turns_is_planned_to_its_end() -> None:
    assert plan_for_turn_limit(Patient(), 0, "optimal", 3) == "optimal:horizon=3"
    assert plan_for_turn_limit(Patient(), 0, "optimal", 1000) == "optimal"
    with pytest.raises(BadPolicy, match="a game without end needs a discount below 1; --turns"):
        _ = PointBasedOptimalPolicy(Patient(discount=1.0), 0).bounds


def test_the_tiger_is_listened_to_until_a_door_is_worth_it() -> None:
    played = game(Tiger())
    assert played.hint_provider.create_hint() == (
        "hint (optimal): listen. values: listen 9.44, open-left -36.25, open-right -36.25"
    )
    assert played.narrator.describe_situation(played.snapshot()) == (
        "nothing yet. belief: left 0.500, right 0.500. actions: listen, open-left, open-right."
    )


def test_an_unending_tiger_is_worth_what_the_literature_says() -> None:
    policy = dmplay.load_agent(Patient(), 0, "optimal")
    values = policy.action_values(policy.initial_memory(np.full(1, -1)))
    assert values is not None
    assert values.max() == pytest.approx(19.3714, abs=1e-3)


def test_a_lamp_is_switched_on_and_left() -> None:
    policy = dmplay.load_agent(Lamp(), 0, "optimal")
    values = policy.action_values(policy.initial_memory(np.array([0, 1])))
    assert values is not None
    assert values.tolist() == [[0.25, 0.5], [2.0, 0.75]]


def test_a_lamp_goes_where_its_switch_says() -> None:
    played = game(Lamp())
    for action, state in (("wait", "dark"), ("switch", "light"), ("wait", "light")):
        played.choose(played.keyboard.parse_action(played.view(), action))
        assert played.problem.format_state(played.session.state) == state
        assert played.view().observation == played.session.state
    assert [turn.rewards.tolist() for turn in played.session.turns] == [[0.0], [-0.5], [1.0]]


def test_a_problem_without_values_is_advised_by_a_search() -> None:
    assert game(Lamp(discount=1.0)).hint_provider.create_hint().startswith("hint (search): ")


def test_some_turns_of_a_game_without_end_are_planned() -> None:
    lamp = Lamp(discount=1.0)
    assert plan_for_turn_limit(lamp, 0, "plan", 3) == "plan:horizon=3"
    planning = dmplay.load_agent(lamp, 0, "plan:horizon=3")
    values = planning.action_values(planning.initial_memory(np.array([0, 1])))
    assert values is not None
    assert values.tolist() == [[0.5, 1.5], [3.0, 1.0]]
    endless = dmplay.load_agent(lamp, 0, "plan")
    with pytest.raises(BudgetExceeded, match="give a discount below 1, or a last turn: --turns N"):
        endless.action_values(endless.initial_memory(np.array([0])))


def test_each_agent_needs_actions_of_its_own(tmp_path: Path) -> None:
    (tmp_path / "pair.py").write_text(
        TIGER.replace("    state_names", '    agents = ("a", "b")\n    state_names')
    )
    done = run(tmp_path, f"{tmp_path}/pair.py:Tiger")
    assert done.returncode == 2
    assert ":10 actions: got 1 action set for 2 agents, expected one each" in done.stderr
