from functools import cache

import numpy as np

import dmplay
from dmplay.core import Problem
from dmplay.policies.script import Script
from dmplay.problems.mountain_car import LEFT_WALL, RIGHT_WALL, TOP_SPEED
from tests.oracles import grid_search
from tests.truth_kinds.case import Case, by_kind, family
from tests.truth_kinds.course import course

PROBLEM = dmplay.load_problem("mountain-car")
VARIANTS = {  # of the truth file: its gym keeps the goal at 0.6
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

GRIDS = ((450, 350), (900, 700), (1800, 1400), (3600, 2800))  # a finer one only where it is needed


def stepped(problem: Problem, case: Case) -> tuple[np.ndarray, float, bool]:
    s, a = np.array([case.given["state"]], float), np.array([[case.given["action"] + 1]])
    after = problem.step(s, a, np.zeros((1, 0)))
    return after.state[0], float(after.rewards[0, 0]), bool(problem.terminal(after.state)[0])


def step(case: Case) -> None:
    after, reward, over = stepped(PROBLEM, case)
    case.close("next", after)
    case.close("reward", reward)
    assert over == case.expect["terminal"]


def clamp(case: Case) -> None:
    for name, told in case.expect.items():
        after, _, over = stepped(VARIANTS[name], case)
        case.equal(told["next"], after)
        assert over == told["terminal"]


@cache
def drives(name: str, cap: int) -> dict[tuple[float, ...], list[np.ndarray]]:
    """The course from every start that some case asks of this policy, all driven at once.

    One by one the many drives of 20,000 turns that lead nowhere would take a while.
    """
    given = [case["given"] for case in family("mountaincar")["cases"]]
    asked = [one for one in given if (one.get("policy"), one.get("cap")) == (name, cap)]
    s = np.array([one["start"] for one in asked], float)
    policy = dmplay.load_agent(PROBLEM, 0, POLICIES[name])
    path = [s]
    while len(path) <= cap and not PROBLEM.terminal(s).all():
        a = policy.choose(policy.initial_memory(s), None, np.zeros((len(s), 0)))
        s = PROBLEM.step(s, a[:, None], np.zeros((len(s), 0))).state
        path.append(s)
    return {tuple(one["start"]): list(np.array(path)[:, row]) for row, one in enumerate(asked)}


def policy_steps(case: Case) -> None:
    start, cap, name = case.given["start"], case.given["cap"], case.given["policy"]
    states = np.array(drives(name, cap)[tuple(start)])
    over = PROBLEM.terminal(states)
    there = bool(over.any())
    steps = int(np.argmax(over)) if there else None
    assert steps == case.expect["steps"]
    case.close("undiscounted_return", None if steps is None else -steps)
    case.close("lowest_x", states[:, 0].min())
    case.close("final", states[-1] if there else None)
    for variant, told in case.expect["steps_by_variant"].items():
        if told is not None:
            policy = dmplay.load_agent(VARIANTS[variant], 0, POLICIES[name])
            turns = list(course(VARIANTS[variant], policy, start, cap))
            assert len(turns) == told
            assert sum(pay for _, pay in turns) == -told


def fewest_steps_known(case: Case) -> None:
    thrusts = [a for a, count in case.expect["bang_bang_segments"] for _ in range(count)]
    script = Script(PROBLEM, 0, tuple(a + 1 for a in thrusts))
    turns = list(course(PROBLEM, script, case.given["start"], len(thrusts)))
    over = [bool(PROBLEM.terminal(s[None])[0]) for s, _ in turns]
    assert over == [False] * (case.expect["by_bang_bang"] - 1) + [True]
    assert case.expect["steps"] <= len(turns)
    assert any(searched(case.given["start"], grid) <= case.expect["steps"] for grid in GRIDS)


def searched(start: list[float], cells: tuple[int, int]) -> int:
    turns = grid_search.fewest_turns(
        PROBLEM,
        np.array(start),
        low=np.array([LEFT_WALL, -TOP_SPEED]),
        high=np.array([RIGHT_WALL, TOP_SPEED]),
        cells=cells,
    )
    assert turns is not None
    return turns


KINDS = by_kind(
    step, clamp, policy_steps, fewest_steps_known, terminal=step,
)  # fmt: skip
LATER: set[str] = set()
