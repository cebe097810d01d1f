import numpy as np

from dmplay.core import belief
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import enumerate_outcomes
from dmplay.core.tabular import tabulate
from dmplay.problems._shared.constant_state_agents import Optimal
from dmplay.problems.bandit.rules import Bandit
from tests.truth_cases.case import Case, map_by_kind


def make_bandit(case: Case) -> Bandit:
    return Bandit(bandits=case.inputs["bandits"], discount=case.inputs.get("gamma", 1.0))


def find_arm(problem: Bandit, label: str) -> int:
    return problem.actions[0].index(label)


def pull(case: Case) -> None:
    problem, s = make_bandit(case), case.inputs["state"]
    arm = find_arm(problem, case.inputs["arm"])
    p, outcome = enumerate_outcomes(problem, np.array([s]), np.array([[arm]]))
    case.close("reward", p[0] @ outcome.rewards[0, :, 0])
    case.close("win_probability", p[0, problem.observations[0].index("win")])
    case.close("reward", tabulate(problem).rewards[s, arm, 0])


def update(problem: Bandit, b: np.ndarray, arm: str, outcome: str) -> belief.Posterior:
    observation = problem.observations[0].index(outcome)
    return belief.update_belief(problem, b, [find_arm(problem, arm)], [observation])


def belief_update(case: Case) -> None:
    inputs = case.inputs
    posterior = update(make_bandit(case), np.array(inputs["b"]), inputs["arm"], inputs["outcome"])
    case.close("outcome_probability", posterior.likelihood)
    case.close("posterior", posterior.belief)


def belief_chain(case: Case) -> None:
    problem, likelihood = make_bandit(case), 1.0
    b = belief.initial_belief(problem)
    for arm, outcome in case.inputs["history"]:
        posterior = update(problem, b, arm, outcome)
        b, likelihood = posterior.belief, likelihood * float(posterior.likelihood)
    case.close("posterior", b)
    case.close("likelihood", likelihood)


def optimal(case: Case) -> None:
    problem, turns = make_bandit(case), case.inputs["turns"]
    agent = Optimal(problem, 0, horizon=turns)
    (q,) = agent.values_with_turns_left(np.array([case.inputs["b"]]), turns)
    case.close("q", q)
    case.close("value", q.max())
    assert [problem.actions[0].labels[a] for a in np.flatnonzero(mark_best_actions(q))] == (
        case.expect["best"]
    )


def regret(case: Case) -> None:
    problem, turns = make_bandit(case), case.inputs["turns"]
    b = belief.initial_belief(problem)
    value = Optimal(problem, 0, horizon=turns).values_with_turns_left(b[None], turns).max()
    informed_value = turns * float(b @ problem.success_probabilities.max(axis=1))
    case.close("optimal", value)
    case.close("known_bandit", informed_value)
    case.close("regret", informed_value - value)
    case.close("random", turns * float(b @ problem.success_probabilities.mean(axis=1)))


KINDS = map_by_kind(pull, belief_update, belief_chain, optimal, regret)
LATER: set[str] = set()
