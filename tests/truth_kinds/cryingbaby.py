from functools import cache

import numpy as np
import pytest

import dmplay
from dmplay import belief
from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.errors import ImpossibleObservation
from dmplay.problems.crying_baby import CryingBaby
from dmplay.solvers import alpha_vectors, value_iteration
from dmplay.solvers.alpha_vectors import AlphaVectorStage
from dmplay.solvers.envelope import compute_upper_envelope
from dmplay.tabular import Tables, tabulate
from tests.truth_kinds.case import Case, by_kind

STATES = ("sated", "hungry")
PROBLEM: Problem = dmplay.load_problem("crying-baby")
ACTIONS = CryingBaby.actions[0]
OBSERVATIONS = CryingBaby.observations[0]


def named(values: np.ndarray) -> dict[str, float]:
    return dict(zip(STATES, values, strict=True))


def model(case: Case) -> None:
    s, a = STATES.index(case.given["state"]), ACTIONS.index(case.given["action"])
    case.close("next", named(tables().transition[s, a]))
    case.close("reward", tables().rewards[s, a, 0])


def observation(case: Case) -> None:
    likely = tables().observation
    assert likely is not None
    a, after = ACTIONS.index(case.given["action"]), STATES.index(case.given["next_state"])
    seen = dict(zip(OBSERVATIONS, likely[a, after], strict=True))
    case.close("observation", seen)


def updated(b: float, action: str, seen: str) -> belief.Posterior:
    before = np.array([1 - b, b])
    return belief.update_belief(
        PROBLEM, before, [ACTIONS.index(action)], [OBSERVATIONS.index(seen)]
    )


def belief_update(case: Case) -> None:
    given = case.given
    if case.expect["observation_probability"] == 0:
        with pytest.raises(ImpossibleObservation):
            updated(given["b"], given["action"], given["observation"])
        return
    posterior = updated(given["b"], given["action"], given["observation"])
    case.close("observation_probability", posterior.likelihood)
    case.close("posterior", posterior.belief[1])


def belief_chain(case: Case) -> None:
    b, likelihood, posteriors = case.given["b"], 1.0, []
    for action, seen in case.given["history"]:
        posterior = updated(b, action, seen)
        b = posterior.belief[1]
        likelihood *= float(posterior.likelihood)
        posteriors.append(b)
    case.close("posteriors", posteriors)
    case.close("likelihood", likelihood)


def always_one_action(case: Case) -> None:
    always = np.tile(np.eye(3)[ACTIONS.index(case.given["action"])], (2, 1))
    case.close("values", named(value_iteration.evaluate_policy(tables(), PROBLEM.discount, always)))


@cache
def tables(discount: float = 0.9) -> Tables:
    return tabulate(dmplay.load_problem("crying-baby", discount=discount))


@cache
def stage(horizon: int, discount: float = 0.9) -> AlphaVectorStage:
    after = stage(horizon - 1, discount).alpha_vectors if horizon > 1 else np.zeros((1, 2))
    return alpha_vectors.backup_vectors(tables(discount), discount, after)


@cache
def unending() -> AlphaVectorStage:
    return alpha_vectors.solve_infinite_horizon(tables(), PROBLEM.discount)


def beliefs(hungry: list[float]) -> np.ndarray:
    return np.column_stack([1 - np.array(hungry), hungry])


def interval(corners: np.ndarray) -> list[float]:
    return [corners[:, 1].min(), corners[:, 1].max()]


def where_best(found: AlphaVectorStage) -> dict[str, list[list[float]]]:
    """The maximal intervals of P(hungry) where each action is best."""
    cells = compute_upper_envelope(found.alpha_vectors)
    intervals: dict[str, list[list[float]]] = {}
    for a, name in enumerate(ACTIONS):
        own = np.flatnonzero(found.first_action_mask[:, a])
        joined: list[list[float]] = []
        for low, high in sorted(
            interval(cells.corner_beliefs[cells.touching_vectors[:, k]]) for k in own
        ):
            if joined and low <= joined[-1][1] + 1e-9:
                joined[-1][1] = high
            else:
                joined.append([low, high])
        intervals[name] = joined
    return intervals


def least_loss(found: AlphaVectorStage, action: str) -> tuple[float, float]:
    """The least of V(b) - Q(b, action), and the smallest P(hungry) that attains it.

    It is linear between the corners of V and of Q.
    """
    plans = found.plans_by_action[ACTIONS.index(action)]
    corners = [
        compute_upper_envelope(one).corner_beliefs
        for one in (found.alpha_vectors, plans.alpha_vectors)
    ]
    b = beliefs(sorted(np.vstack(corners)[:, 1]))
    loss = alpha_vectors.compute_belief_values(
        found.alpha_vectors, b
    ) - alpha_vectors.compute_belief_values(plans.alpha_vectors, b)
    first = np.flatnonzero(loss <= loss.min() + 1e-10)[0]
    return loss[first], b[first, 1]


def vectors(case: Case, found: AlphaVectorStage) -> None:
    """The vectors are those expected, in any order, each with its actions and interval."""
    cells = compute_upper_envelope(found.alpha_vectors)
    assert len(case.expect["vectors"]) == len(found.alpha_vectors)
    for told in case.expect["vectors"]:
        k = int(np.argmin(abs(found.alpha_vectors - told["alpha"]).max(axis=1)))
        case.equal(told["alpha"], found.alpha_vectors[k])
        assert told["actions"] == [ACTIONS[a] for a in np.flatnonzero(found.first_action_mask[k])]
        if "interval" in told:
            case.equal(
                told["interval"], interval(cells.corner_beliefs[cells.touching_vectors[:, k]])
            )


def finite_horizon(case: Case) -> None:
    found = stage(case.given["horizon"])
    assert len(found.alpha_vectors) == case.expect["count"]
    vectors(case, found)
    at = [float(b) for b in case.expect["values"]]
    known = alpha_vectors.compute_belief_values(found.alpha_vectors, beliefs(at))
    case.close("values", dict(zip(case.expect["values"], known, strict=True)))
    case.close("optimal", where_best(found))


def action_values(case: Case, found: AlphaVectorStage) -> Reals:
    q: Reals = alpha_vectors.compute_action_values(found, beliefs([case.given["b"]]))[0]
    case.close("q", dict(zip(ACTIONS, q, strict=True)))
    assert case.expect["best"] == [
        ACTIONS[a] for a in np.flatnonzero(value_iteration.mark_best_actions(q))
    ]
    return q


def finite_horizon_q(case: Case) -> None:
    action_values(case, stage(case.given["horizon"]))


def singing(case: Case) -> None:
    found = stage(case.given["horizon"], case.given["gamma"])
    intervals = where_best(found)["sing"]
    assert bool(intervals) == case.expect["optimal_somewhere"]
    case.close("intervals", intervals)
    if "smallest_loss" in case.expect:
        loss, at = least_loss(found, "sing")
        case.close("smallest_loss", loss)
        case.close("at", at)


def infinite_horizon(case: Case) -> None:
    q = action_values(case, unending())
    case.close("value", q.max())


def infinite_horizon_policy(case: Case) -> None:
    found = unending()
    if "vectors" in case.expect:
        vectors(case, found)
    elif "belief" in case.expect:
        (ignored,) = where_best(found)["ignore"]
        (fed,) = where_best(found)["feed"]
        case.close("belief", ignored[1])
        case.close("belief", fed[0])
    else:
        loss, at = least_loss(found, "sing")
        case.close("loss", loss)
        case.close("b", at)


KINDS = by_kind(
    model, observation, belief_update, belief_chain, always_one_action, finite_horizon,
    finite_horizon_q, singing, infinite_horizon, infinite_horizon_policy,
)  # fmt: skip
LATER: set[str] = set()
