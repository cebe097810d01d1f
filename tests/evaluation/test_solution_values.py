"""Tests of the numbers of a solution: exact cases, and values computed independently."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import pytest

import dmplay
from dmplay import Accuracy, Labels, Solution, Tables, Tabular
from dmplay.core.arrays import Reals
from dmplay.errors import BadParameter, UnknownName
from dmplay.evaluation.solutions.solve import list_solvers
from tests.support.random_problems import RandomGame, RandomProblem, RandomRivalGame
from tests.truth_cases.case import Case, load_family
from tests.truth_cases.hexworld import make_custom_map

MAX_PLANNED_TURNS = 10  # of a planned exact case; longer ones take seconds


@cache
def solve(name: str, turns: int | None = None, **parameters: float) -> Solution:
    return dmplay.solve(dmplay.load_problem(name, **parameters), turns=turns)


def check_action_values(case: Case, q: Reals, labels: Labels) -> None:
    expected = case.expect["q"]
    case.close("q", dict(zip(labels, q, strict=True)) if isinstance(expected, dict) else q)


def check_hexworld(case: Case) -> None:
    name = case.inputs["map"].replace("_", "-")
    solution = solve("hexworld" if name == "hexworld" else f"hexworld:{name}")
    assert solution.problem is not None
    state = case.inputs["state"] - 1  # a state's number serves as well as its name
    text = solution.problem.format_state(np.array(state))
    case.close("value", solution.value(text))
    case.close("q", solution.action_values(state))
    labels = solution.problem.actions[0].labels
    assert solution.best_actions(text) == [labels[a - 1] for a in case.expect["actions"]]


def check_custom_map(case: Case) -> None:
    solution = dmplay.solve(make_custom_map(case))
    case.close("values", [row["value"] for row in solution.table])
    case.close("values", [solution.value(s) for s in range(len(solution.table))])


def check_alpha_vectors(name: str) -> Callable[[Case], None]:
    def check_vectors(case: Case) -> None:
        solution = solve(name, case.inputs.get("horizon"))
        vectors = [
            {"alpha": [*row.values()][:-1], "actions": row["first"]} for row in solution.table
        ]
        assert len(vectors) == len(case.expect["vectors"])
        for expected in case.expect["vectors"]:
            distances = [
                float(np.abs(np.subtract(vector["alpha"], expected["alpha"])).max())
                for vector in vectors
            ]
            assert min(distances) <= case.tol
            assert [*vectors[int(np.argmin(distances))]["actions"]] == expected["actions"]

    return check_vectors


def check_crying_baby(case: Case) -> None:
    hungry, turns = case.inputs["b"], case.inputs.get("horizon")
    solution = solve("crying-baby", turns)
    assert solution.problem is not None
    belief = [1 - hungry, hungry]
    check_action_values(case, solution.action_values(belief), solution.problem.actions[0].labels)
    assert solution.best_actions(f"hungry {hungry} sated {1 - hungry}") == case.expect["best"]
    if "value" in case.expect:
        case.close("value", solution.value(belief))


def check_with_turns_left(name: str, case: Case) -> None:
    parameters = {"discount": case.inputs["gamma"]} if "gamma" in case.inputs else {}
    solution = solve(name, MAX_PLANNED_TURNS, **parameters)
    assert solution.problem is not None
    b, turns = case.inputs.get("b"), case.inputs["horizon"]
    q = solution.action_values(b, turns_left=turns)
    check_action_values(case, q, solution.problem.actions[0].labels)
    assert solution.value(b, turns_left=turns) == pytest.approx(q.max())


def check_machine(case: Case) -> None:
    check_with_turns_left("machine-replacement", case)


def check_catch(case: Case) -> None:
    check_with_turns_left("catch", case)


def check_bandit(case: Case) -> None:
    inputs = case.inputs
    problem = dmplay.load_problem(
        "bandit", bandits=inputs["bandits"], discount=inputs.get("gamma", 1.0)
    )
    solution = dmplay.solve(problem, turns=inputs["turns"])
    case.close("q", solution.action_values(inputs["b"]))
    case.close("value", solution.value(inputs["b"]))


def check_regulator(case: Case) -> None:
    state = [case.inputs["s"]] if "s" in case.inputs else None
    solution = solve("simple-regulator", discount=case.inputs["gamma"])
    case.close("value", solution.value(state))


def check_collision(case: Case) -> None:
    case.close("q", solve("collision-avoidance").action_values(case.inputs["state"]))


def check_equilibria(name: str) -> Callable[[Case], None]:
    def check_game(case: Case) -> None:
        (equilibrium,) = solve(name).equilibria
        assert equilibrium.problem is not None
        for seat, expected in enumerate(case.expect["equilibria"][0]):
            strategy = equilibrium.policy(seat=seat)
            if isinstance(expected, list) and not isinstance(expected[0], str):
                case.equal(expected, strategy)
                continue
            action = str(expected[0] if isinstance(expected, list) else expected)
            assert strategy[equilibrium.problem.actions[seat].labels.index(action)] == 1.0
        case.close("rewards", [equilibrium.value(seat=seat) for seat in (0, 1)])

    return check_game


CHECKS: dict[tuple[str, str], Callable[[Case], None]] = {
    ("hexworld", "optimal"): check_hexworld,
    ("hexworld", "custom_map"): check_custom_map,
    ("cryingbaby", "finite_horizon"): check_alpha_vectors("crying-baby"),
    ("machine", "alpha_vectors"): check_alpha_vectors("machine-replacement"),
    ("cryingbaby", "finite_horizon_q"): check_crying_baby,
    ("cryingbaby", "infinite_horizon"): check_crying_baby,
    ("machine", "q_values"): check_machine,
    ("catch", "optimal_from_uniform"): check_catch,
    ("catch", "optimal_from_belief"): check_catch,
    ("bandit", "optimal"): check_bandit,
    ("regulator", "optimal_value"): check_regulator,
    ("regulator", "optimal_value_from_start"): check_regulator,
    ("collision", "interpolated_q"): check_collision,
    ("prisoners", "nash"): check_equilibria("prisoners-dilemma"),
    ("rps", "nash"): check_equilibria("rock-paper-scissors"),
    ("travelers", "nash"): check_equilibria("travelers-dilemma"),
}


@pytest.mark.parametrize(("family", "kind"), CHECKS)
def test_a_solution_has_the_values_of_the_exact_cases(family: str, kind: str) -> None:
    content = load_family(family)
    cases = [
        Case(case, content["conventions"]) for case in content["cases"] if case["kind"] == kind
    ]
    short = [case for case in cases if case.inputs.get("horizon", 1) <= MAX_PLANNED_TURNS]
    assert short
    for case in short:
        CHECKS[family, kind](case)


def iterate_values(problem: RandomProblem, turns: int) -> Reals:
    """Return Q `[S, A]` of `turns` turns, nan for illegal actions, by plain value iteration."""
    values = np.zeros(5)
    q = np.zeros((5, 3))
    for _ in range(turns):
        q = problem.rewards[:, :, 0] + problem.discount * problem.transition @ values
        q = np.where(problem.legal_mask[:, 0], q, np.nan)
        values = np.where(problem.terminal(np.arange(5)), 0.0, np.nanmax(q, axis=1))
    return q


@pytest.mark.parametrize("seed", range(5))
def test_the_methods_of_a_random_mdp_have_the_values_of_plain_value_iteration(seed: int) -> None:
    problem = RandomProblem(seed=seed)
    assert list_solvers(problem) == [
        "value-iteration", "policy-iteration", "backward-induction", "simulation",
    ]  # fmt: skip
    expected = iterate_values(problem, 400)
    for method in ("", "value-iteration", "policy-iteration"):
        solution = dmplay.solve(problem, method=method)
        for s in range(4):
            np.testing.assert_allclose(solution.action_values(s), expected[s], atol=1e-7)
            assert solution.value(s) == pytest.approx(np.nanmax(expected[s]), abs=1e-7)
        assert solution.value() == pytest.approx(np.nanmax(expected[0]), abs=1e-7)
    finite = dmplay.solve(problem, turns=6, method="backward-induction")
    for turns in (2, 6):
        q = finite.action_values(1, turns_left=turns)
        np.testing.assert_allclose(q, iterate_values(problem, turns)[1])


@dataclass(frozen=True)
class RandomHidden(Tabular):
    """A random problem with three hidden states, two actions and two observations."""

    seed: int = 0
    discount: float = 0.9
    actions = (Labels(("a", "b")),)
    observations = (Labels(("x", "y")),)
    state_names = ("p", "q", "r")
    initial_belief = np.array([0.5, 0.25, 0.25])

    @property
    def tables(self) -> Tables:
        """The random arrays."""
        generator = np.random.default_rng(self.seed)
        return Tables(
            generator.dirichlet(np.ones(3), (3, 2)),
            generator.normal(size=(3, 2, 1)),
            generator.dirichlet(np.ones(2), (2, 3)),
        )


def compute_belief_q(problem: RandomHidden, b: Reals, turns: int) -> list[float]:
    """Return the value of each action with `turns` turns left, by the tree of all beliefs."""
    tables, q = problem.tables, []
    assert tables.observation is not None
    for a in range(2):
        value = float(b @ tables.rewards[:, a, 0])
        for o in range(2) if turns > 1 else ():
            joint = (b @ tables.transition[:, a]) * tables.observation[a, :, o]
            later = compute_belief_q(problem, joint / joint.sum(), turns - 1)
            value += problem.discount * float(joint.sum()) * max(later)
        q.append(value)
    return q


@pytest.mark.parametrize("seed", range(5))
def test_the_methods_of_a_random_pomdp_have_the_values_of_the_belief_tree(seed: int) -> None:
    problem = RandomHidden(seed=seed)
    assert list_solvers(problem) == ["alpha-vectors", "point-based", "simulation"]
    beliefs = np.random.default_rng(seed).dirichlet(np.ones(3), 3)
    for method in ("", "alpha-vectors", "point-based"):
        solution = dmplay.solve(problem, turns=5, method=method)
        assert solution.accuracy is Accuracy.EXACT
        for b in [*beliefs, np.eye(3)[1]]:
            q = compute_belief_q(problem, b, 5)
            np.testing.assert_allclose(solution.action_values(b), q, atol=1e-8)
            assert solution.bounds(b) == pytest.approx((max(q), max(q)), abs=1e-8)
            later_q = solution.action_values(b, turns_left=2)
            np.testing.assert_allclose(later_q, compute_belief_q(problem, b, 2), atol=1e-8)
        assert solution.value("q") == solution.value({"q": 1.0}) == solution.value([0, 1, 0])
        assert solution.value() == pytest.approx(solution.value(problem.initial_belief))


def test_bounds_hold_at_every_belief() -> None:
    baby = dmplay.load_problem("catch")
    exact = dmplay.solve(baby)
    bounded = dmplay.solve(baby, turns=12, method="point-based", work=0.01)
    longer = dmplay.solve(baby, turns=12)
    assert exact.accuracy is Accuracy.EXACT
    assert bounded.accuracy is Accuracy.LOWER_BOUND
    for b in (None, [0.1, 0.2, 0.3, 0.4], "20"):
        lower, upper = bounded.bounds(b)
        assert lower <= longer.value(b) + 1e-6
        assert longer.value(b) <= upper + 1e-6
        assert bounded.value(b) == pytest.approx(lower)


@pytest.mark.parametrize("name", ["prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma"])
def test_the_methods_of_one_round_have_the_same_equilibrium(name: str) -> None:
    problem = dmplay.load_problem(name)
    methods = list_solvers(problem)[:3]
    assert methods == ["enumeration", "lemke-howson", "regret-matching"]
    solutions = [dmplay.solve(problem, method=method) for method in methods]
    for solution in solutions:
        for seat in (0, 1):
            expected = solutions[0].policy(seat=seat)
            np.testing.assert_allclose(solution.policy(seat=seat), expected, atol=0.01)
            assert solution.value(seat=seat) == pytest.approx(
                solutions[0].value(seat=seat), abs=0.01
            )


def test_several_equilibria_are_solutions_by_themselves(tmp_path: Any) -> None:
    (tmp_path / "chicken.nfg").write_text(
        'NFG 1 R "Chicken" { "one" "two" }\n'
        '{ { "dare" "swerve" } { "dare" "swerve" } }\n\n-9 -9  0 2  2 0  1 1\n'
    )
    solution = dmplay.solve(dmplay.load_problem(tmp_path / "chicken.nfg"))
    with pytest.raises(BadParameter, match=r"3 equilibria; ask solution\.equilibria\[0\]"):
        solution.value()
    pays = [[e.value(seat="one"), e.value(seat="two")] for e in solution.equilibria]
    np.testing.assert_allclose(sorted(pays), [(0, 2), (0.9, 0.9), (2, 0)])
    mixed = solution.equilibria[2]
    assert mixed.table[0]["one"] == pytest.approx({"dare": 0.1, "swerve": 0.9})
    assert mixed.rows[0]["one"] == "dare 0.1 swerve 0.9"
    np.testing.assert_allclose(mixed.action_values(), 0.9)


@pytest.mark.parametrize("seed", range(3))
def test_two_methods_of_a_markov_game_agree_up_to_their_regrets(seed: int) -> None:
    problem = RandomRivalGame(seed=seed)
    exact = dmplay.solve(problem, method="shapley-iteration")
    responses = dmplay.solve(problem, method="best-responses")
    gains = [float(text.split()[0]) for text in responses.result.split("policy: ")[1].split(", ")]
    for seat in (0, 1):
        assert abs(exact.value(seat=seat) - responses.value(seat=seat)) <= 2 * sum(gains) + 1e-6
        values = exact.action_values(0, seat)[exact.policy(0, seat) > 1e-6]
        np.testing.assert_allclose(values, exact.value(0, seat), atol=1e-6)
    assert exact.value(4) == responses.value(4, "two") == 0.0  # The game is over.
    assert exact.value(0, 1) == pytest.approx(-2 * exact.value(0, 0))
    general = dmplay.solve(RandomGame(seed=seed))
    assert general.value("0", "two") == pytest.approx(general.table[0]["value two"], abs=1e-6)


def test_a_joint_plan_has_its_value_at_the_start_alone(tmp_path: Any) -> None:
    (tmp_path / "meet.dpomdp").write_text(
        "agents: 2\ndiscount: 1\nvalues: reward\nstates: left right\nstart: uniform\n"
        "actions:\nstay go\nstay go\nobservations:\nsame other\nsame other\n"
        "T: * :\nuniform\nO: * :\nuniform\nR: * : * : * : * : 0\nR: go go : left : * : * : 3\n"
    )
    solution = dmplay.solve(dmplay.load_problem(tmp_path / "meet.dpomdp"), turns=2)
    assert solution.value() == solution.value(seat="agent2") == pytest.approx(3.0)
    assert solution.best_actions() == ["go"]
    assert solution.table[0]["then"] == {"same": 0, "other": 0}
    assert solution.rows[0]["then"] == "same:0 other:0"
    with pytest.raises(BadParameter, match="its agents act on what they observed"):
        solution.value([0.5, 0.5])


@pytest.mark.parametrize(
    ("name", "at", "message"),
    [
        ("hexworld", "nowhere", "expected a state such as"),
        ("hexworld", [1, 2], "expected a state such as"),
        ("hexworld", 99, "expected 0 to 24"),
        ("crying-baby", [0.5, 0.6], "probabilities that add up to 1.1, expected 1"),
        ("crying-baby", [1.0], "expected a probability for each state: sated, hungry"),
        ("cart-pole", None, "no values \\(Riccati .*: it computes none; its numbers are"),
        ("cart-pole", "0 0 0 0", r"no values \(Riccati"),
    ],
)
def test_a_value_that_is_not_there_is_refused_in_one_line(name: str, at: Any, message: str) -> None:
    with pytest.raises(BadParameter, match=message):
        solve(name).value(at)
    with pytest.raises(BadParameter, match=r"turns_left: got 3, expected None"):
        solve("hexworld").value("(3,2)", turns_left=3)
    with pytest.raises(BadParameter, match="games start in one of 24 states; name a state"):
        solve("hexworld").action_values()
    with pytest.raises(UnknownName, match="unknown seat 'nobody'"):
        solve("hexworld").value("(3,2)", "nobody")


def test_a_method_that_does_not_fit_is_refused_with_those_that_do() -> None:
    problem = dmplay.load_problem("crying-baby")
    expected = "expected one of alpha-vectors, point-based, simulation"
    with pytest.raises(BadParameter, match=f"value-iteration does not fit crying-baby, {expected}"):
        dmplay.solve(problem, method="value-iteration")
    with pytest.raises(UnknownName, match="unknown method 'points'; did you mean point-based"):
        dmplay.solve(problem, method="points")


def test_a_solution_is_one_line_and_a_data_frame() -> None:
    pandas = pytest.importorskip("pandas")
    solution = solve("rock-paper-scissors")
    text = "<Solution of rock-paper-scissors, support enumeration: 1 Nash equilibrium of one round"
    assert repr(solution) == f"{text}; 1 row>"
    frame = solution.to_frame()
    assert isinstance(frame, pandas.DataFrame)
    assert frame["agent1 rock"][0] == pytest.approx(1 / 3)
    assert solve("hexworld").to_frame()["value"].dtype == float
