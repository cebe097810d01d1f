"""Quantities of problems whose state is visible: values, best actions, outcomes and sweeps."""

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import enumerate_possible_outcomes
from dmplay.errors import BadParameter
from dmplay.registry import agents
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.truth import Truth, format_number

MAX_NAMED_OUTCOMES = 3  # outcomes in an explanation


def state_value(position: PositionInGame, state: str = "", turns_left: int = 0) -> Truth:
    """Return the value of a state: the expected return of the best play from it.

    Without `state` it is that of the position. `turns_left` counts the turns in a game with a
    turn limit.
    """
    q = compute_state_q(position, state, turns_left)
    return Truth(max(q.values()), lambda _: _describe_one_step(position, state))


def action_value(
    position: PositionInGame, action: str, state: str = "", turns_left: int = 0
) -> Truth:
    """Return the value of an action: its expected return if you play best afterwards."""
    q = compute_state_q(position, state, turns_left)
    label = find_action(position, action)
    return Truth(q[label], lambda _: describe_outcomes(position, label, state))


def best_action(position: PositionInGame, state: str = "", turns_left: int = 0) -> Truth:
    """Return the actions with the greatest value in a state."""
    q = compute_state_q(position, state, turns_left)
    names, values = [*q], np.array([*q.values()])
    best = frozenset(names[index] for index in np.flatnonzero(mark_best_actions(values)))

    def explain(answer: str) -> str:
        """Return what a wrong action loses, and where it leads."""
        loss = max(values) - q[answer] if answer in q else np.nan
        cost = f"{answer} is worth {format_number(float(loss))} less than the best action"
        return f"{cost}; {describe_outcomes(position, answer, state)}" if answer in q else ""

    return Truth(best, explain, tuple(names))


def action_loss(
    position: PositionInGame, action: str, state: str = "", turns_left: int = 0
) -> Truth:
    """Return the regret of an action: the value of the best one minus its own."""
    q = compute_state_q(position, state, turns_left)
    label = find_action(position, action)
    loss = max(q.values()) - q[label]
    return Truth(loss, lambda _: describe_outcomes(position, label, state))


def outcomes(position: PositionInGame, action: str, state: str = "") -> Truth:
    """Return the probability of each next state after an action."""
    label = find_action(position, action)
    s = find_state(position, state)
    probabilities = list_outcomes(position, label, s)

    def explain(_: str) -> str:
        """Return how many outcomes there are, and the probability of the likeliest one."""
        return (
            f"there are {len(probabilities)} outcomes with a positive probability; "
            f"the likeliest has {format_number(max(probabilities.values()))}"
        )

    labels = tuple(map(position.problem.format_state, position.problem.enumerate_states()))
    return Truth(probabilities, explain, labels)


def outcome_probability(
    position: PositionInGame, action: str, outcome: str, state: str = ""
) -> Truth:
    """Return the probability that an action leads to the state `outcome`."""
    label = find_action(position, action)
    probabilities = list_outcomes(position, label, find_state(position, state))
    name = position.problem.format_state(find_state(position, outcome))
    others = [p for other, p in probabilities.items() if other != name]
    return Truth(
        probabilities.get(name, 0.0),
        lambda _: f"the other outcomes have {', '.join(map(format_number, others)) or 'none'}",
    )


def find_state(position: PositionInGame, text: str) -> Array:
    """Return the state that a text names, or that of the position if it is empty."""
    if not text:
        return position.session.state
    try:
        return position.problem.parse_state(text)
    except (ValueError, LookupError) as error:
        raise BadParameter(f"state: {error}") from None


def find_action(position: PositionInGame, text: str) -> str:
    """Return the label of the action that a text names."""
    problem, seat = position.problem, position.seat
    return problem.format_action(seat, problem.parse_action(seat, text))


def compute_state_q(position: PositionInGame, state: str, turns_left: int = 0) -> dict[str, float]:
    """Return the value of each legal action in a state, by the agent that gives the hints."""
    problem, session = position.problem, position.session
    provider = agents.find_hint_provider(problem, position.question)
    s = find_state(position, state)
    if provider is None or problem.partially_observable:
        raise BadParameter(f"{position.problem_name} has no values of states")
    turns_done = len(session.turns)
    if turns_left:
        if session.turn_limit is None or turns_left > session.turn_limit:
            raise BadParameter(f"turns_left: got {turns_left}, expected a game of as many turns")
        turns_done = session.turn_limit - turns_left
    policy = provider.policy
    values = policy.action_values(policy.memory_at_turn(s[None], turns_done))
    if values is None:
        raise BadParameter(f"{position.problem_name} has no values of actions")
    legal = problem.legal_actions_mask(s[None])
    labels = problem.actions[position.seat].labels
    return {
        label: float(value)
        for index, (label, value) in enumerate(zip(labels, values[0], strict=True))
        if legal is None or legal[0, position.seat, index]
    }


def list_outcomes(position: PositionInGame, action: str, s: Array) -> dict[str, float]:
    """Return the probability of each next state of a problem with one agent, likeliest first."""
    problem = position.problem
    joint = np.array([[problem.parse_action(0, action)]])
    _, p, outcome = enumerate_possible_outcomes(problem, s[None], joint)
    probabilities: dict[str, float] = {}
    for probability, next_state in zip(p, outcome.state, strict=True):
        name = problem.format_state(next_state)
        probabilities[name] = probabilities.get(name, 0.0) + float(probability)
    return dict(sorted(probabilities.items(), key=lambda pair: -pair[1]))


def describe_outcomes(position: PositionInGame, action: str, state: str) -> str:
    """Return a sentence with the likeliest outcomes of an action and the value of each."""
    probabilities = list_outcomes(position, action, find_state(position, state))
    rows = []
    for name, probability in [*probabilities.items()][:MAX_NAMED_OUTCOMES]:
        value = max(compute_state_q(position, name).values())
        rows.append(f"with {format_number(probability)} to {name}, worth {format_number(value)}")
    return f"{action} leads {'; '.join(rows)}"


def _describe_one_step(position: PositionInGame, state: str) -> str:
    """Return the values of the states next to a state, which its own value depends on."""
    s = find_state(position, state)
    neighbours: dict[str, float] = {}
    for action in compute_state_q(position, state):
        name = next(iter(list_outcomes(position, action, s)))
        neighbours[name] = max(compute_state_q(position, name).values())
    listed = ", ".join(f"{name} {format_number(value)}" for name, value in neighbours.items())
    discount = format_number(position.problem.discount)
    return f"a turn later counts {discount}; the states that you can reach are worth {listed}"
