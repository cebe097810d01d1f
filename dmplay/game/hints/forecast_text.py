"""The words of forecasts: the possible outcomes of an action on one line."""

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.problem import Problem
from dmplay.core.text import count_probability_decimals, format_number, format_value
from dmplay.draw.options import Forecast
from dmplay.game.position import Position

MAX_LISTED_OUTCOMES = 4  # maximum number of listed outcomes
MIN_LISTED_PROBABILITY = 0.005  # smallest listed probability of a belief


def format_forecast(position: Position, forecast: Forecast) -> str:
    """Return a forecast as one line of text.

    It lists the outcomes with probabilities, the range of sampled states, or the payoffs of a game
    with a single state.
    """
    problem, other_count = position.problem, len(position.active_others)
    name = position.format_action(forecast.action)
    agents_text = "the other agents act" if other_count > 1 else "the other agent acts"
    others = f" and {agents_text} at random" if other_count else ""
    if forecast.other_players:
        is_condition = forecast.other_players.startswith("if ")
        others = f" {'and ' * is_condition}{forecast.other_players.removeprefix('if ')}"
    sample_note = f" ({len(forecast.probabilities)} samples)" if forecast.is_sampled else ""
    if problem.state_count == 1 and not forecast.is_sampled:
        return f"if {name}{others}: {_format_payoffs(position, forecast)}"
    if forecast.is_sampled:
        low, high = forecast.outcomes.min(axis=0), forecast.outcomes.max(axis=0)
        state_range = f"{problem.describe_state(low)} to {problem.describe_state(high)}"
        return f"if {name}{others}: {state_range}{sample_note}"
    listed = forecast.probabilities[:MAX_LISTED_OUTCOMES].tolist()
    omitted_probability = float(forecast.probabilities[MAX_LISTED_OUTCOMES:].sum())
    decimals = count_probability_decimals([*listed, omitted_probability])
    outcomes = [
        f"{probability:.{decimals}f} {_format_outcome(problem, position.seat, forecast, index)}"
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


def _format_payoffs(position: Position, forecast: Forecast) -> str:
    """Return the reward of an action for each reply of the other agents, and the expected reward.

    If there are more than four replies, only the smallest and the largest reward are given.
    """
    problem, seat = position.problem, position.seat
    payoffs = position.list_payoffs(int(forecast.action))
    probabilities = [payoff.probability for payoff in payoffs]
    rewards = np.array([payoff.reward for payoff in payoffs])
    mean_text = format_value(float(rewards @ probabilities), problem.reward_scale, 4)
    mean = f"{mean_text} on average"
    if len(payoffs) > MAX_LISTED_OUTCOMES:
        return f"reward {format_number(rewards.min())} to {format_number(rewards.max())}, {mean}"
    if len(payoffs) == 1:
        names = _list_other_action_names(problem, seat, payoffs[0].joint_action)
        choose = "other agents choose" if len(names) > 1 else "other agent chooses"
        return f"reward {format_number(rewards[0])}, as the {choose} {' and '.join(names)}"
    decimals = count_probability_decimals(probabilities)
    is_modelled = bool(forecast.other_players)
    parts = [
        f"{format_number(payoff.reward)} if "
        f"{' and '.join(_list_other_action_names(problem, seat, payoff.joint_action))}"
        + f" ({payoff.probability:.{decimals}f})"
        * is_modelled
        for payoff in payoffs
    ]
    return f"reward {', '.join(parts)}; {mean}"


def _list_other_action_names(problem: Problem, seat: int, joint: Array) -> list[str]:
    """Return the action names of all seats but one."""
    return [problem.format_action(i, a) for i, a in enumerate(joint) if i != seat]
