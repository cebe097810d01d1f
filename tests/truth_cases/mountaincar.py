from functools import cache

import numpy as np

import dmplay
from dmplay.agents.script import Script
from dmplay.core.problem import Problem
from dmplay.problems.mountain_car.rules import LEFT_WALL, RIGHT_WALL, TOP_SPEED
from tests.oracles import grid_search
from tests.truth_cases.case import Case, load_family, map_by_kind
from tests.truth_cases.deterministic_trajectory import iterate_game

PROBLEM = dmplay.load_problem("mountain-car")
VARIANTS = {  # as in the truth file, whose gym variant keeps the goal at 0.6
    "reference": PROBLEM,
    "speed_first": dmplay.load_problem("mountain-car", speed_first=True),
    "gym": dmplay.load_problem("mountain-car", speed_first=True, wall_stops=True),
}
POLICIES = {
    "pump, coast when still": "pump:still=coast",
    "pump, left when still": "pump:still=left",
    "pump, right when still": "pump:still=right",
    "always left": "always-left",
    "always coast": "always-coast",
    "always right": "always-right",
}

# a finer grid is searched only if the coarser ones do not suffice
GRID_SIZES = ((450, 350), (900, 700), (1800, 1400), (3600, 2800))


def step_case(problem: Problem, case: Case) -> tuple[np.ndarray, float, bool]:
    s, a = np.array([case.inputs["state"]], float), np.array([[case.inputs["action"] + 1]])
    after = problem.step(s, a, np.zeros((1, 0)))
    return after.state[0], float(after.rewards[0, 0]), bool(problem.terminal(after.state)[0])


def step(case: Case) -> None:
    after, reward, is_terminal = step_case(PROBLEM, case)
    case.close("next", after)
    case.close("reward", reward)
    assert is_terminal == case.expect["terminal"]


def clamp(case: Case) -> None:
    for name, expected in case.expect.items():
        after, _, is_terminal = step_case(VARIANTS[name], case)
        case.equal(expected["next"], after)
        assert is_terminal == expected["terminal"]


@cache
def simulate_drives(name: str, cap: int) -> dict[tuple[float, ...], list[np.ndarray]]:
    """Return the path from each start in the cases of a policy, with all drives simulated at once.

    Simulating the drives one by one is slow, because some last 20,000 turns without reaching the
    goal.
    """
    inputs_of_cases = [case["given"] for case in load_family("mountaincar")["cases"]]
    matching = [
        inputs
        for inputs in inputs_of_cases
        if (inputs.get("policy"), inputs.get("cap")) == (name, cap)
    ]
    s = np.array([inputs["start"] for inputs in matching], float)
    policy = dmplay.load_agent(PROBLEM, 0, POLICIES[name])
    path = [s]
    while len(path) <= cap and not PROBLEM.terminal(s).all():
        a = policy.choose(policy.initial_memory(s), None, np.zeros((len(s), 0)))
        s = PROBLEM.step(s, a[:, None], np.zeros((len(s), 0))).state
        path.append(s)
    return {
        tuple(inputs["start"]): list(np.array(path)[:, row]) for row, inputs in enumerate(matching)
    }


def policy_steps(case: Case) -> None:
    start, cap, name = case.inputs["start"], case.inputs["cap"], case.inputs["policy"]
    states = np.array(simulate_drives(name, cap)[tuple(start)])
    is_terminal = PROBLEM.terminal(states)
    reaches_goal = bool(is_terminal.any())
    steps = int(np.argmax(is_terminal)) if reaches_goal else None
    assert steps == case.expect["steps"]
    case.close("undiscounted_return", None if steps is None else -steps)
    case.close("lowest_x", states[:, 0].min())
    case.close("final", states[-1] if reaches_goal else None)
    for variant, expected_steps in case.expect["steps_by_variant"].items():
        if expected_steps is not None:
            policy = dmplay.load_agent(VARIANTS[variant], 0, POLICIES[name])
            path = list(iterate_game(VARIANTS[variant], policy, start, cap))
            assert len(path) == expected_steps
            assert sum(pay for _, pay in path) == -expected_steps


def fewest_steps_known(case: Case) -> None:
    thrusts = [a for a, count in case.expect["bang_bang_segments"] for _ in range(count)]
    script = Script(PROBLEM, 0, tuple(a + 1 for a in thrusts))
    path = list(iterate_game(PROBLEM, script, case.inputs["start"], len(thrusts)))
    is_terminal = [bool(PROBLEM.terminal(s[None])[0]) for s, _ in path]
    assert is_terminal == [False] * (case.expect["by_bang_bang"] - 1) + [True]
    assert case.expect["steps"] <= len(path)
    assert any(
        search_fewest_turns(case.inputs["start"], grid) <= case.expect["steps"]
        for grid in GRID_SIZES
    )


def search_fewest_turns(start: list[float], cells: tuple[int, int]) -> int:
    turns = grid_search.fewest_turns(
        PROBLEM,
        np.array(start),
        low=np.array([LEFT_WALL, -TOP_SPEED]),
        high=np.array([RIGHT_WALL, TOP_SPEED]),
        cells=cells,
    )
    assert turns is not None
    return turns


KINDS = map_by_kind(
    step, clamp, policy_steps, fewest_steps_known, terminal=step,
)  # fmt: skip
LATER: set[str] = set()
