"""What an action may bring about before it is played, as far as its seat may know."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.belief import apply_bayes_rule
from dmplay.budget import Budget
from dmplay.chance import Array, FiniteChance
from dmplay.core import ContinuousStates, Problem, enumerate_possible_outcomes
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.session import Session, View
from dmplay.views.style import Forecast

N_SAMPLES = 200
QUASI_RANDOM_STEPS = np.sqrt(
    np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0])
)  # of the uniforms
MAX_LISTED_OUTCOMES = 4  # outcomes that are told
MIN_LISTED_PROBABILITY = 0.005  # a probability that is told of a belief


def forecast_outcomes(session: Session, seat: int, action: float) -> Forecast:
    """Every outcome of an action, the likeliest first, the others acting at random.

    Where states hide it follows from the seat's belief alone; where nature draws reals, or there
    are too many outcomes to list, they are samples under uniforms that are always the same.
    """
    action = session.validate_action(seat, action)
    problem, view = session.problem, session.view(seat)
    if problem.partially_observable:
        return _forecast_from_belief(view, action)
    chances = problem.chance(session.state[None], np.zeros((1, len(problem.agents)), int))
    if all(isinstance(chance, FiniteChance) for chance in chances) and _can_list_replies(
        problem, seat
    ):
        try:
            return _forecast_exactly(session, seat, action)
        except BudgetExceeded:  # one by one
            return _forecast_by_sampling(session, seat, action)
    return _forecast_by_sampling(session, seat, action)


def _can_list_replies(problem: Problem, seat: int) -> bool:
    """Whether the actions of the others can be counted."""
    return all(known.labels for other, known in enumerate(problem.actions) if other != seat)


def enumerate_joint_actions(session: Session, seat: int, action: float) -> Array:
    """The joint actions `[J, n]` in which a seat does this, and the others what they may."""
    able = map(session.legal_actions_mask, range(len(session.problem.agents)))
    each: list[Sequence[float]] = [
        [action]
        if other == seat
        else np.arange(len(known.labels))[slice(None) if may is None else may].tolist()
        for other, (known, may) in enumerate(zip(session.problem.actions, able, strict=True))
    ]
    budget = Budget("what an action may bring", "play it")
    budget.check_memory(8.0 * len(each) * float(np.prod([float(len(one)) for one in each])))
    return np.array([*product(*each)])


def _forecast_exactly(session: Session, seat: int, action: float) -> Forecast:
    """By listing all that nature and the others may do."""
    joint = enumerate_joint_actions(session, seat, action)
    states = np.repeat(session.state[None], len(joint), axis=0)
    _, p, outcome = enumerate_possible_outcomes(session.problem, states, joint)
    seen, which = np.unique(outcome.state, axis=0, return_inverse=True)
    chances = np.bincount(which.reshape(-1), p / len(joint), len(seen)).astype(float)
    order = np.argsort(-chances, kind="stable")
    return Forecast(action, chances[order], seen[order])


def _forecast_by_sampling(session: Session, seat: int, action: float) -> Forecast:
    """Samples, of the others too."""
    problem = session.problem
    count = problem.uniform_counts.step
    u = (
        np.outer(
            np.arange(1, N_SAMPLES + 1), np.resize(QUASI_RANDOM_STEPS, count + len(problem.agents))
        )
        % 1.0
    )
    able = map(session.legal_actions_mask, range(len(problem.agents)))
    joint = np.full((N_SAMPLES, len(problem.agents)), action)
    for other, (known, may) in enumerate(zip(problem.actions, able, strict=True)):
        if other != seat:
            each = None if may is None else np.tile(may, (N_SAMPLES, 1))
            joint[:, other] = known.sample_actions(u[:, count + other], each)
    joint = joint.astype(int) if all(known.labels for known in problem.actions) else joint
    outcome = problem.step(np.repeat(session.state[None], N_SAMPLES, axis=0), joint, u[:, :count])
    return Forecast(action, np.full(N_SAMPLES, 1.0 / N_SAMPLES), outcome.state, is_sampled=True)


def _forecast_from_belief(view: View[Problem], action: float) -> Forecast:
    """What may be seen, and what would then be believed, from what is believed now."""
    problem, seat = view.problem, view.seat
    if view.beliefs is None:
        raise BadParameter("whatif: too many states to foresee what may be seen")
    budget = Budget("what an action may bring", "play it")
    nothing: list[int | None] = [None] * len(problem.agents)
    did, rows = nothing.copy(), []
    did[seat] = int(action)
    kinds = problem.observation_counts[seat]
    for number in range(kinds):
        budget.spend_work(float(len(view.belief)) * len(view.belief), number / kinds)
        seen = nothing.copy()
        seen[seat] = number
        rows.append(problem.joint_belief_update(view.belief, did, seen))
    after = apply_bayes_rule(np.array(rows))
    order = np.argsort(-after.likelihood, kind="stable")
    order = order[after.likelihood[order] > 0.0]
    return Forecast(action, after.likelihood[order], order, after.belief[order])


def format_forecast(session: Session, seat: int, forecast: Forecast) -> str:
    """What an action may bring, in a line."""
    problem = session.problem
    name = session.format_action(seat, forecast.action)
    rest = len(
        session.active_seats([other for other in range(len(problem.agents)) if other != seat])
    )
    others = f", the other{'s' * (rest > 1)} at random" if rest else ""
    how = f" ({len(forecast.probabilities)} samples)" if forecast.is_sampled else ""
    if problem.state_count == 1 and not forecast.is_sampled:
        return f"if {name}{others}: {_format_payoffs(session, seat, forecast.action)}"
    if forecast.is_sampled:
        low, high = forecast.outcomes.min(axis=0), forecast.outcomes.max(axis=0)
        ends = f"{_format_state(problem, low)} to {_format_state(problem, high)}"
        return f"if {name}{others}: {ends}{how}"
    each = [
        f"{chance:.2f} {_format_outcome(problem, seat, forecast, place)}"
        for place, chance in enumerate(forecast.probabilities[:MAX_LISTED_OUTCOMES])
    ]
    more = len(forecast.probabilities) - len(each)
    left = float(forecast.probabilities[MAX_LISTED_OUTCOMES:].sum())
    return f"if {name}{others}: {', '.join([*each, *[f'{left:.2f} {more} more'] * bool(more)])}"


def _format_outcome(problem: Problem, seat: int, forecast: Forecast, outcome_index: int) -> str:
    """An outcome: the state, or what is seen and then believed."""
    if forecast.beliefs is None:
        return _format_state(problem, forecast.outcomes[outcome_index])
    seen = problem.observations[seat].format_observation(forecast.outcomes[outcome_index])
    belief = forecast.beliefs[outcome_index]
    states = problem.enumerate_states()
    likely = [
        at
        for at in np.argsort(-belief, kind="stable")[:MAX_LISTED_OUTCOMES]
        if belief[at] >= MIN_LISTED_PROBABILITY
    ]
    then = ", ".join(f"{problem.format_state(states[at])} {belief[at]:.2f}" for at in likely)
    return f"{seen} (then {then})" if then else seen


def _format_state(problem: Problem, state: Array) -> str:
    """A state; of reals the first digits."""
    if isinstance(problem.state_count, ContinuousStates):
        return " ".join(f"{number:.3g}" for number in state)
    return problem.format_state(state)


def _format_payoffs(session: Session, seat: int, action: float) -> str:
    """What each reply of the others pays; of many, how little and how much."""
    problem, joint = session.problem, enumerate_joint_actions(session, seat, action)
    states = np.repeat(session.state[None], len(joint), axis=0)
    row, p, outcome = enumerate_possible_outcomes(problem, states, joint)
    pays = np.bincount(row, p * outcome.rewards[:, seat], len(joint))
    mean = f"{pays.mean():.4g} on average"
    if len(joint) > MAX_LISTED_OUTCOMES:
        return f"pays {pays.min():g} to {pays.max():g}, {mean}"
    each = [
        f"{' and '.join(_other_action_names(problem, seat, one))} pays {pay:g}"
        for one, pay in zip(joint, pays, strict=True)
    ]
    return f"{', '.join(each)}; {mean}"


def _other_action_names(problem: Problem, seat: int, joint: Array) -> list[str]:
    """What all but a seat do."""
    return [problem.format_action(i, a) for i, a in enumerate(joint) if i != seat]
