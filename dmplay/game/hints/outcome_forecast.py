"""Forecasts of an action's possible outcomes, from the information of its seat."""

from collections.abc import Sequence
from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Array, Reals
from dmplay.core.belief import apply_bayes_rule
from dmplay.core.chance import FiniteChance
from dmplay.core.policy import Memory
from dmplay.core.problem import Problem, enumerate_possible_outcomes, validate_outcome
from dmplay.core.session import Session, View, list_active_seats
from dmplay.core.text import count_probability_decimals, format_number, format_value
from dmplay.core.work_budget import Budget
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.views.protocol import Forecast

N_SAMPLES = 200
QUASI_RANDOM_STEPS = np.sqrt(
    np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0])
)  # irrational steps of quasi-random uniforms
MAX_LISTED_OUTCOMES = 4  # maximum number of listed outcomes
MIN_LISTED_PROBABILITY = 0.005  # smallest listed probability of a belief


class AssumedPlayers(NamedTuple):
    """A hint agent's policy with its present memory, which models the other agents."""

    policy: SeatPolicy
    memory: Memory
    text: str  # the model in words, for example "against tit-for-tat"


def forecast_outcomes(
    session: Session, seat: int, action: float, model: AssumedPlayers | None = None
) -> Forecast:
    """Return the outcomes of an action, most probable first.

    The other agents act as in the model, or else at random. If states are hidden, the forecast is
    computed from the seat's belief only. If chance is continuous or there are too many outcomes,
    the result is 200 samples from fixed quasi-random uniforms, with random other agents.
    """
    action = session.validate_action(seat, action)
    problem, view = session.problem, session.view(seat)
    if problem.partially_observable:
        return _forecast_from_belief(view, action, model)
    chance_list = problem.chance(session.state[None], np.zeros((1, len(problem.agents)), int))
    if all(isinstance(chance, FiniteChance) for chance in chance_list) and _can_list_replies(
        problem, seat
    ):
        try:
            return _forecast_exactly(session, seat, action, model)
        except BudgetExceeded:  # too many outcomes to list
            return _forecast_by_sampling(session, seat, action)
    return _forecast_by_sampling(session, seat, action)


def _can_list_replies(problem: Problem, seat: int) -> bool:
    """Return whether all other agents have finite action sets."""
    return all(
        action_set.labels for other, action_set in enumerate(problem.actions) if other != seat
    )


class JointActions(NamedTuple):
    """The joint actions with one action of a seat, and their probabilities in a model."""

    actions: Array  # [J, n]
    probabilities: Reals  # [J]
    is_modelled: bool  # whether a model predicts the other agents; else they act at random


def enumerate_joint_actions(
    session: Session, seat: int, action: float, model: AssumedPlayers | None = None
) -> JointActions:
    """Return the joint actions with this action of the seat and possible actions of the others.

    Raise BudgetExceeded if they do not fit in memory.
    """
    options_by_seat: list[Sequence[float]] = []
    probabilities_by_seat: list[Sequence[float]] = []
    is_modelled = False
    for other, action_set in enumerate(session.problem.actions):
        if other == seat:
            options_by_seat.append([action])
            probabilities_by_seat.append([1.0])
            continue
        mask = session.legal_actions_mask(other)
        weights = np.ones(len(action_set.labels)) if mask is None else mask.astype(float)
        predicted = model.policy.predict_actions(model.memory, other) if model else None
        if predicted is not None and (predicted[0] * weights).any():
            weights, is_modelled = predicted[0] * weights, True
        possible = np.flatnonzero(weights)
        options_by_seat.append(possible.tolist())
        probabilities_by_seat.append((weights[possible] / weights.sum()).tolist())
    budget = Budget("the forecast of an action", "play the action instead")
    budget.check_memory(
        8.0
        * len(options_by_seat)
        * float(np.prod([float(len(options)) for options in options_by_seat]))
    )
    probabilities = np.array([np.prod(row) for row in product(*probabilities_by_seat)])
    return JointActions(np.array([*product(*options_by_seat)]), probabilities, is_modelled)


def _forecast_exactly(
    session: Session, seat: int, action: float, model: AssumedPlayers | None
) -> Forecast:
    """Return the exact distribution over next states, from all chance events and joint actions."""
    joint = enumerate_joint_actions(session, seat, action, model)
    states = np.repeat(session.state[None], len(joint.actions), axis=0)
    row, p, outcome = enumerate_possible_outcomes(session.problem, states, joint.actions)
    unique_states, indices = _find_unique_states(session.problem, outcome.state)
    probabilities = np.bincount(indices, p * joint.probabilities[row], len(unique_states)).astype(
        float
    )
    order = np.argsort(-probabilities, kind="stable")
    result = Forecast(action, probabilities[order], unique_states[order])
    if model is None or not joint.is_modelled:
        return result
    if len(session.problem.agents) == 2:
        replies = np.zeros(session.problem.action_counts[1 - seat])
        replies[joint.actions[:, 1 - seat].astype(int)] = joint.probabilities
        result = result._replace(reply_probabilities=replies)
    return result._replace(other_players=model.text)


def _find_unique_states(problem: Problem, states: Array) -> tuple[Array, Array]:
    """Return the different states, and the index of each of the states `[K]` among them."""
    if states.dtype != object:
        unique_states, indices = np.unique(states, axis=0, return_inverse=True)
        return unique_states, indices.reshape(-1)
    names = [problem.format_state(state) for state in states]  # objects may have no order
    _, first, indices = np.unique(names, return_index=True, return_inverse=True)
    return states[first], indices.reshape(-1)


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


def _forecast_from_belief(
    view: View[Problem], action: float, model: AssumedPlayers | None
) -> Forecast:
    """Return the seat's possible observations, their probabilities and the beliefs after each.

    Observations of probability zero are omitted. Raise BadParameter if the session has no beliefs.
    """
    problem, seat = view.problem, view.seat
    predicted = model.policy.forecast_observations(model.memory, int(action)) if model else None
    if model and predicted:
        return _order_observations(action, *predicted)._replace(other_players=model.text)
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
    return _order_observations(action, posterior.likelihood, posterior.belief)


def _order_observations(action: float, probabilities: Reals, beliefs: Reals) -> Forecast:
    """Return the forecast of observations `[O]` with the beliefs `[O, S]`, likeliest first."""
    order = np.argsort(-probabilities, kind="stable")
    order = order[probabilities[order] > 0.0]
    return Forecast(action, probabilities[order], order, beliefs[order])


def format_forecast(
    session: Session, seat: int, forecast: Forecast, model: AssumedPlayers | None = None
) -> str:
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
    if forecast.other_players:
        is_condition = forecast.other_players.startswith("if ")
        others = f" {'and ' * is_condition}{forecast.other_players.removeprefix('if ')}"
    sample_note = f" ({len(forecast.probabilities)} samples)" if forecast.is_sampled else ""
    if problem.state_count == 1 and not forecast.is_sampled:
        return f"if {name}{others}: {_format_payoffs(session, seat, forecast.action, model)}"
    if forecast.is_sampled:
        low, high = forecast.outcomes.min(axis=0), forecast.outcomes.max(axis=0)
        state_range = f"{problem.describe_state(low)} to {problem.describe_state(high)}"
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
        return problem.describe_state(forecast.outcomes[outcome_index])
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
        f"{problem.describe_state(states[index])}: {belief[index]:.{decimals}f}"
        for index in likely_states
    )
    return f"{observation} (then belief {belief_text})" if belief_text else observation


def _format_payoffs(
    session: Session, seat: int, action: float, model: AssumedPlayers | None
) -> str:
    """Return the reward of an action for each reply of the other agents, and the expected reward.

    If there are more than four replies, only the smallest and the largest reward are given.
    """
    problem, joint = session.problem, enumerate_joint_actions(session, seat, action, model)
    reply_count = len(joint.actions)
    states = np.repeat(session.state[None], reply_count, axis=0)
    row, p, outcome = enumerate_possible_outcomes(problem, states, joint.actions)
    payoffs = np.bincount(row, p * outcome.rewards[:, seat], reply_count)
    mean_text = format_value(float(payoffs @ joint.probabilities), problem.reward_scale, 4)
    mean = f"{mean_text} on average"
    if reply_count > MAX_LISTED_OUTCOMES:
        return f"reward {format_number(payoffs.min())} to {format_number(payoffs.max())}, {mean}"
    decimals = count_probability_decimals(joint.probabilities.tolist())
    if reply_count == 1:
        names = _other_action_names(problem, seat, joint.actions[0])
        choose = "other agents choose" if len(names) > 1 else "other agent chooses"
        return f"reward {format_number(payoffs[0])}, as the {choose} {' and '.join(names)}"
    parts = [
        f"{format_number(payoff)} if {' and '.join(_other_action_names(problem, seat, reply))}"
        + f" ({probability:.{decimals}f})" * joint.is_modelled
        for reply, payoff, probability in zip(
            joint.actions, payoffs, joint.probabilities, strict=True
        )
    ]
    return f"reward {', '.join(parts)}; {mean}"


def _other_action_names(problem: Problem, seat: int, joint: Array) -> list[str]:
    """Return the action names of all seats but one."""
    return [problem.format_action(i, a) for i, a in enumerate(joint) if i != seat]
