"""Quantities of states and actions: values, best actions, regrets and outcomes."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.problem import enumerate_possible_outcomes
from dmplay.core.text import format_count
from dmplay.core.typed_text import parse_distribution, parse_state
from dmplay.errors import BadParameter
from dmplay.registry import agents
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.truth import Truth, format_number, list_best_labels, list_values


def state_value(position: PositionInGame, state: str = "", turns_left: int = 0) -> Truth:
    """Return the value of a state: the expected return of the best play from it.

    Without `state` it is that of the position. `turns_left` counts the turns in a game with a
    turn limit.
    """
    q = compute_q(position, state, (), turns_left)
    return Truth(max(q.values()), lambda _: _describe_reachable_states(position, state, turns_left))


def action_value(
    position: PositionInGame,
    action: str,
    state: str = "",
    history: Sequence[str] = (),
    turns_left: int = 0,
) -> Truth:
    """Return the value of an action: its expected return if you play best afterwards.

    If states are hidden, `history` lists what the player did and observed, such as "feed crying".
    """
    q = compute_q(position, state, history, turns_left)
    label = find_action(position, action)
    return Truth(q[label], lambda _: describe_worst_outcome(position, label, state, turns_left))


def best_action(
    position: PositionInGame, state: str = "", history: Sequence[str] = (), turns_left: int = 0
) -> Truth:
    """Return the actions with the greatest value in a state, or after a history."""
    q = compute_q(position, state, history, turns_left)
    best = list_best_labels(q, position.problem.reward_scale)

    def explain(answer: str) -> str:
        """Return the loss of a wrong action, and its worst outcome."""
        loss = format_number(max(q.values()) - q[answer])
        worst = describe_worst_outcome(position, answer, state, turns_left)
        sentence = f"{answer} scores {loss} less on average than the best action"
        return f"{sentence}; {worst}" if worst else sentence

    return Truth(best, explain, tuple(q), list_values(q))


def action_loss(
    position: PositionInGame,
    action: str,
    state: str = "",
    history: Sequence[str] = (),
    turns_left: int = 0,
) -> Truth:
    """Return the regret of an action: the value of the best one minus its own."""
    q = compute_q(position, state, history, turns_left)
    label = find_action(position, action)
    loss = max(q.values()) - q[label]
    return Truth(loss, lambda _: describe_worst_outcome(position, label, state, turns_left))


def order_of_values(position: PositionInGame, states: Sequence[str]) -> Truth:
    """Return these states ordered by their values, the most valuable first."""
    values = {
        position.problem.format_state(find_state(position, state)): max(
            compute_q(position, state).values()
        )
        for state in states
    }

    def explain(answer: str) -> str:
        """Return the number of pairs in the wrong order; '' if there is none."""
        tolerance = VALUE_TOLERANCE * position.problem.reward_scale
        pairs = [*combinations(answer.split(), 2)]
        wrong_count = sum(values[second] - values[first] > tolerance for first, second in pairs)
        if not wrong_count:
            return ""
        verb = "is" if wrong_count == 1 else "are"
        return f"{wrong_count} of the {len(pairs)} pairs {verb} in the wrong order"

    ranked = sorted(values, key=lambda name: -values[name])
    return Truth(tuple(ranked), explain, tuple(values), list_values(values))


def outcomes(position: PositionInGame, action: str, state: str = "") -> Truth:
    """Return the probability of each next state after an action."""
    label = find_action(position, action)
    s = find_state(position, state)
    probabilities = list_outcomes(position, label, s)

    labels = tuple(map(position.problem.format_state, position.problem.enumerate_states()))

    def explain(answer: str) -> str:
        """Return the number of states in the answer, and the number of possible ones."""
        named = [name for name, p in parse_distribution(answer, labels).items() if p > 0.0]
        count = format_count(len(named), "next state")
        impossible = sum(name not in probabilities for name in named)
        note = f"; {impossible} of yours cannot follow" if impossible else ""
        return f"you give {count} a probability, and {len(probabilities)} are possible{note}"

    return Truth(probabilities, explain, labels)


def outcome_probability(
    position: PositionInGame, action: str, outcome: str, state: str = ""
) -> Truth:
    """Return the probability that an action leads to the state `outcome`."""
    label = find_action(position, action)
    probabilities = list_outcomes(position, label, find_state(position, state))
    name = position.problem.format_state(find_state(position, outcome))
    count = format_count(len(probabilities), "next state")
    return Truth(
        probabilities.get(name, 0.0),
        lambda _: f"{count} can follow, and their probabilities add up to 1",
    )


def missed_outcome_probability(
    position: PositionInGame, action: str, outcome: str, tries: int, state: str = ""
) -> Truth:
    """Return the probability that no one of several tries of an action leads to `outcome`."""
    p = outcome_probability(position, action, outcome, state).value
    assert isinstance(p, float)

    def explain(_: str) -> str:
        """Return the probability for one try."""
        return f"with 1 try it is {format_number(1.0 - p)}" if tries > 1 else ""

    value = (1.0 - p) ** tries
    calculation = f"{format_number(1.0 - p)}^{tries} = {format_number(value)}"
    return Truth(value, explain, comparison=calculation)


def find_state(position: PositionInGame, text: str) -> Array:
    """Return the state that a text names, or that of the position if it is empty."""
    return parse_state(position.problem, text) if text else position.session.state


def find_state_index(position: PositionInGame, state: str) -> int:
    """Return the index of a state."""
    return int(position.problem.state_indices(find_state(position, state)[None])[0])


def find_action(position: PositionInGame, text: str) -> str:
    """Return the label of the action that a text names."""
    problem, seat = position.problem, position.seat
    return problem.format_action(seat, problem.parse_action(seat, text))


def compute_q(
    position: PositionInGame, state: str = "", history: Sequence[str] = (), turns_left: int = 0
) -> dict[str, float]:
    """Return the value of each legal action by label, from the agent that gives the hints.

    They are those of a visible state, or of the belief after a history; without both, those of the
    position. Raise BadParameter if that agent has no values of this game, or only upper bounds.
    """
    agent = agents.find_hint_provider(position.problem, position.question)
    if agent is None:
        raise BadParameter(f"{position.problem_name} has no agent with values")
    is_bound = agent.basis.accuracy is Accuracy.UPPER_BOUND
    if agent.basis.scope or is_bound:
        about = f"are about another game ({agent.basis.scope})"
        scope = "are upper bounds" if is_bound else about
        raise BadParameter(f"the values of {position.problem_name} {scope}")
    knowledge = position.ask(agent, state, history, turns_left)
    values = knowledge.values()
    if values is None:
        raise BadParameter(f"{position.problem_name} has no values of actions")
    return {knowledge.labels[action]: float(values.q[action]) for action in knowledge.legal_actions}


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


def describe_worst_outcome(
    position: PositionInGame, action: str, state: str, turns_left: int
) -> str:
    """Return a clause on the worst next state after an action, without its name.

    A lesson may ask for that state. The clause is empty with hidden states and several agents.
    """
    if position.problem.partially_observable or len(position.problem.agents) > 1:
        return ""
    probabilities = list_outcomes(position, action, find_state(position, state))
    values = {name: value_after_turn(position, name, turns_left) for name in probabilities}
    worst = min(values, key=lambda name: values[name])
    value, probability = format_number(values[worst]), format_number(probabilities[worst])
    return f"its worst next state is worth {value} and has probability {probability}"


def value_after_turn(position: PositionInGame, state: str, turns_left: int) -> float:
    """Return the value of a state after one more turn than the position, or than `turns_left`."""
    limit = position.session.turn_limit
    if limit is None:
        return max(compute_q(position, state).values())
    next_turns_left = (turns_left or limit - len(position.session.turns)) - 1
    if next_turns_left == 0:
        return 0.0
    return max(compute_q(position, state, (), next_turns_left).values())


def _describe_reachable_states(position: PositionInGame, state: str, turns_left: int) -> str:
    """Return the values of the states next to a state, on which its own value depends."""
    s = find_state(position, state)
    values: dict[str, float] = {}
    for action in compute_q(position, state, (), turns_left):
        name = next(iter(list_outcomes(position, action, s)))
        if name != position.problem.format_state(s):
            values[name] = value_after_turn(position, name, turns_left)
    listed = ", ".join(f"{name} {format_number(value)}" for name, value in values.items())
    discount = format_number(position.problem.discount)
    return f"rewards a turn later count {discount}; its neighbours are worth {listed}"
