import numpy as np

import dmplay
from dmplay.core import Problem
from dmplay.policies.general import Script
from tests.truth_kinds.case import Case
from tests.truth_kinds.course import course

PROBLEM = dmplay.load("mountain-car")
VARIANTS = {  # of the truth file: its gym keeps the goal at 0.6
    "reference": PROBLEM,
    "speed_first": dmplay.load("mountain-car", speed_first=True),
    "gym": dmplay.load("mountain-car", speed_first=True, wall_stops=True),
}
POLICIES = {
    "pump, coast when still": "pump:still=coast",
    "pump, left when still": "pump:still=left",
    "pump, right when still": "pump:still=right",
    "always left": "always-left",
    "always coast": "always-coast",
    "always right": "always-right",
}


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


def policy_steps(case: Case) -> None:
    given = case.given
    for name, steps in case.expect["steps_by_variant"].items():
        if steps is None and name != "reference":
            continue  # informative, and 20,000 steps long
        problem = VARIANTS[name]
        policy = dmplay.agent(problem, 0, POLICIES[given["policy"]])
        turns = list(course(problem, policy, given["start"], given["cap"]))
        final = turns[-1][0] if turns else np.array([given["start"]], float)
        there = bool(problem.terminal(final.reshape(1, 2))[0])
        assert (len(turns) if there else None) == steps
        if name != "reference":
            continue
        assert steps == case.expect["steps"]
        if there:
            case.close("undiscounted_return", sum(pay for _, pay in turns))
        case.close("lowest_x", min([given["start"][0], *(s[0] for s, _ in turns)]))
        case.close("final", final if there else None)


def fewest_steps_known(case: Case) -> None:
    thrusts = [a for a, count in case.expect["bang_bang_segments"] for _ in range(count)]
    script = Script(PROBLEM, 0, tuple(a + 1 for a in thrusts))
    turns = list(course(PROBLEM, script, case.given["start"], len(thrusts)))
    over = [bool(PROBLEM.terminal(s[None])[0]) for s, _ in turns]
    assert over == [False] * (case.expect["by_bang_bang"] - 1) + [True]
    assert case.expect["steps"] <= len(turns)


KINDS = {
    "step": step,
    "clamp": clamp,
    "terminal": step,
    "policy_steps": policy_steps,
    "fewest_steps_known": fewest_steps_known,  # its V part waits for a solver
}
LATER: set[str] = set()
