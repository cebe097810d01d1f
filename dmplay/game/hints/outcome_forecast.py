"""Forecasts of an action's possible outcomes, from the information of its seat."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.belief import apply_bayes_rule
from dmplay.core.chance import FiniteChance
from dmplay.core.problem import (
    ContinuousStates,
    Problem,
    enumerate_possible_outcomes,
    validate_outcome,
)
from dmplay.core.session import Session, View, list_active_seats
from dmplay.core.text import count_probability_decimals
from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.views.protocol import Forecast

N_SAMPLES = 200
QUASI_RANDOM_STEPS = np.sqrt(
    np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0])
)  # irrational steps of quasi-random uniforms
MAX_LISTED_OUTCOMES = 4  # maximum number of listed outcomes
MIN_LISTED_PROBABILITY = 0.005  # smallest listed probability of a belief


def forecast_outcomes(session: Session, seat: int, action: float) -> Forecast:
    """Return the outcomes of an action, most probable first; other agents act at random.

    If states are hidden, the forecast is computed from the seat's belief only. If chance is
    continuous or there are too many outcomes, the result is 200 samples from fixed quasi-random
    uniforms.
    """
    action = session.validate_action(seat, action)
    problem, view = session.problem, session.view(seat)
    if problem.partially_observable:
        return _forecast_from_belief(view, action)
    chance_list = problem.chance(session.state[None], np.zeros((1, len(problem.agents)), int))
    if all(isinstance(chance, FiniteChance) for chance in chance_list) and _can_list_replies(
        problem, seat
    ):
        try:
            return _forecast_exactly(session, seat, action)
        except BudgetExceeded:  # too many outcomes to list
            return _forecast_by_sampling(session, seat, action)
    return _forecast_by_sampling(session, seat, action)


def _can_list_replies(problem: Problem, seat: int) -> bool:
    """Return whether all other agents have finite action sets."""
    return all(
        action_set.labels for other, action_set in enumerate(problem.actions) if other != seat
    )


def enumerate_joint_actions(session: Session, seat: int, action: float) -> Array:
    """Return all joint actions `[J, n]` with this action of the seat and legal actions of others.

    Raise BudgetExceeded if they do not fit in memory.
    """
    legal_masks = map(session.legal_actions_mask, range(len(session.problem.agents)))
    options_by_seat: list[Sequence[float]] = [
        [action]
        if other == seat
        else np.arange(len(action_set.labels))[slice(None) if mask is None else mask].tolist()
        for other, (action_set, mask) in enumerate(
            zip(session.problem.actions, legal_masks, strict=True)
        )
    ]
    budget = Budget("the forecast of an action", "play the action instead")
    budget.check_memory(
        8.0
        * len(options_by_seat)
        * float(np.prod([float(len(options)) for options in options_by_seat]))
    )
    return np.array([*product(*options_by_seat)])


def _forecast_exactly(session: Session, seat: int, action: float) -> Forecast:
    """Return the exact distribution over next states.

    All chance events are enumerated, and the other agents' joint actions are equally likely.
    """
    joint = enumerate_joint_actions(session, seat, action)
    states = np.repeat(session.state[None], len(joint), axis=0)
    _, p, outcome = enumerate_possible_outcomes(session.problem, states, joint)
    unique_states, indices = np.unique(outcome.state, axis=0, return_inverse=True)
    probabilities = np.bincount(indices.reshape(-1), p / len(joint), len(unique_states)).astype(
        float
    )
    order = np.argsort(-probabilities, kind="stable")
    return Forecast(action, probabilities[order], unique_states[order])


def _forecast_by_sampling(session: Session, seat: int, action: float) -> Forecast:
    """Return equally likely sampled next states; the other agents' actions are sampled as well."""
    problem = session.problem
    count = problem.uniform_counts.step
    u = (
        np.outer(
            np.arange(1, N_SAMPLES + 1), np.resize(QUASI_RANDOM_STEPS, count + len(problem.agents))
        )
        % 1.0
    )
    legal_masks = map(session.legal_actions_mask, range(len(problem.agents)))
    joint = np.full((N_SAMPLES, len(problem.agents)), action)
    for other, (action_set, mask) in enumerate(zip(problem.actions, legal_masks, strict=True)):
        if other != seat:
            row_masks = None if mask is None else np.tile(mask, (N_SAMPLES, 1))
            joint[:, other] = action_set.sample_actions(u[:, count + other], row_masks)
    joint = joint.astype(int) if all(action_set.labels for action_set in problem.actions) else joint
    outcome = problem.step(np.repeat(session.state[None], N_SAMPLES, axis=0), joint, u[:, :count])
    validate_outcome(problem, outcome)
    return Forecast(action, np.full(N_SAMPLES, 1.0 / N_SAMPLES), outcome.state, is_sampled=True)


def _forecast_from_belief(view: View[Problem], action: float) -> Forecast:
    """Return the seat's possible observations, their probabilities and the beliefs after each.

    Observations of probability zero are omitted. Raise BadParameter if the session has no beliefs.
    """
    problem, seat = view.problem, view.seat
    if view.beliefs is None:
        raise BadParameter("whatif: too many states to compute the possible observations")
    budget = Budget("the forecast of an action", "play the action instead")
    unknown: list[int | None] = [None] * len(problem.agents)
    actions, rows = unknown.copy(), []
    actions[seat] = int(action)
    observation_count = problem.observation_counts[seat]
    for observation in range(observation_count):
        budget.spend_work(
            float(len(view.belief)) * len(view.belief), observation / observation_count
        )
        observations = unknown.copy()
        observations[seat] = observation
        rows.append(problem.joint_belief_update(view.belief, actions, observations))
    posterior = apply_bayes_rule(np.array(rows))
    order = np.argsort(-posterior.likelihood, kind="stable")
    order = order[posterior.likelihood[order] > 0.0]
    return Forecast(action, posterior.likelihood[order], order, posterior.belief[order])


def format_forecast(session: Session, seat: int, forecast: Forecast) -> str:
    """Return a forecast as one line of text.

    It lists the outcomes with probabilities, the range of sampled states, or the payoffs of a game
    with a single state.
    """
    problem = session.problem
    name = session.format_action(seat, forecast.action)
    other_count = len(
        list_active_seats(session, [other for other in range(len(problem.agents)) if other != seat])
    )
    agents_text = "the other agents act" if other_count > 1 else "the other agent acts"
    others = f" and {agents_text} at random" if other_count else ""
    sample_note = f" ({len(forecast.probabilities)} samples)" if forecast.is_sampled else ""
    if problem.state_count == 1 and not forecast.is_sampled:
        return f"if {name}{others}: {_format_payoffs(session, seat, forecast.action)}"
    if forecast.is_sampled:
        low, high = forecast.outcomes.min(axis=0), forecast.outcomes.max(axis=0)
        state_range = f"{_format_state(problem, low)} to {_format_state(problem, high)}"
        return f"if {name}{others}: {state_range}{sample_note}"
    listed = forecast.probabilities[:MAX_LISTED_OUTCOMES].tolist()
    omitted_probability = float(forecast.probabilities[MAX_LISTED_OUTCOMES:].sum())
    decimals = count_probability_decimals([*listed, omitted_probability])
    outcomes = [
        f"{probability:.{decimals}f} {_format_outcome(problem, seat, forecast, index)}"
        for index, probability in enumerate(listed)
    ]
    more = len(forecast.probabilities) - len(outcomes)
    if more:
        outcomes.append(f"{omitted_probability:.{decimals}f} for {more} more")
    return f"if {name}{others}: {', '.join(outcomes)}"


def _format_outcome(problem: Problem, seat: int, forecast: Forecast, outcome_index: int) -> str:
    """Return an outcome as text: the next state, or an observation and the most probable states."""
    if forecast.beliefs is None:
        return _format_state(problem, forecast.outcomes[outcome_index])
    observation = problem.observations[seat].format_observation(forecast.outcomes[outcome_index])
    belief = forecast.beliefs[outcome_index]
    states = problem.enumerate_states()
    likely_states = [
        index
        for index in np.argsort(-belief, kind="stable")[:MAX_LISTED_OUTCOMES]
        if belief[index] >= MIN_LISTED_PROBABILITY
    ]
    decimals = count_probability_decimals(belief.tolist())
    belief_text = ", ".join(
        f"{problem.format_state(states[index])} {belief[index]:.{decimals}f}"
        for index in likely_states
    )
    return f"{observation} (then {belief_text})" if belief_text else observation


def _format_state(problem: Problem, state: Array) -> str:
    """Return a state as text; real numbers have three significant digits."""
    if isinstance(problem.state_count, ContinuousStates):
        return " ".join(f"{number:.3g}" for number in state)
    return problem.format_state(state)


def _format_payoffs(session: Session, seat: int, action: float) -> str:
    """Return the expected reward of an action for each reply of the other agents, and the mean.

    If there are more than four replies, only the smallest and the largest reward are given.
    """
    problem, joint = session.problem, enumerate_joint_actions(session, seat, action)
    states = np.repeat(session.state[None], len(joint), axis=0)
    row, p, outcome = enumerate_possible_outcomes(problem, states, joint)
    payoffs = np.bincount(row, p * outcome.rewards[:, seat], len(joint))
    mean = f"{payoffs.mean():.4g} on average"
    if len(joint) > MAX_LISTED_OUTCOMES:
        return f"reward {payoffs.min():g} to {payoffs.max():g}, {mean}"
    parts = [
        f"{payoff:g} if {' and '.join(_other_action_names(problem, seat, reply))}"
        for reply, payoff in zip(joint, payoffs, strict=True)
    ]
    return f"reward {', '.join(parts)}; {mean}"


def _other_action_names(problem: Problem, seat: int, joint: Array) -> list[str]:
    """Return the action names of all seats but one."""
    return [problem.format_action(i, a) for i, a in enumerate(joint) if i != seat]
