"""Quantities of positions: values, best actions, regrets and outcomes."""

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.problem import Problem, enumerate_possible_outcomes
from dmplay.core.text import format_count
from dmplay.core.typed_text import parse_distribution, parse_number, parse_state
from dmplay.errors import BadParameter
from dmplay.game.action_breakdown import merge_outcomes_by_text
from dmplay.game.position import Position
from dmplay.registry.problem_module_exports import get_problem_name
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.truth import Truth, format_number, format_values, list_best_labels

MAX_TERMS = 6  # of a calculation


def state_value(position: Position) -> Truth:
    """Return the value of a state: the expected return of the best play from it."""
    return compute_backup(position, "one turn later")


def sweep_value(position: PositionInGame, state: str, sweep: int) -> Truth:
    """Return the value of a state after this many sweeps of value iteration from V = 0.

    It is the expected return of the best play with as many turns left.
    """
    return compute_backup(position.ask(state=state, turns_left=sweep), f"before sweep {sweep}")


def compute_backup(position: Position, later: str) -> Truth:
    """Return the value of the best action of a position, with the values that it follows from."""
    values = list_action_values(position)
    best = max(values, key=lambda label: values[label])
    breakdown = position.break_down(best)
    if breakdown is None or len(breakdown.outcomes) > MAX_TERMS:
        return Truth(values[best])
    discount, states = format_number(breakdown.discount), merge_outcomes_by_text(breakdown.outcomes)
    calculation = " + ".join(
        f"{format_number(outcome.probability)} x ({format_number(outcome.reward)} + "
        f"{discount} x {format_number(outcome.value_after)})"
        for outcome in breakdown.outcomes
    )
    listed = " and ".join(format_number(state.value_after) for state in states)
    count = format_count(len(states), "next state")  # which are not named
    reason = (
        f"the best action has {count}, with V = {listed} {later}; "
        "each of these steps also has a reward"
    )
    comparison = f"the best action, {best}, is worth {calculation} = {format_number(values[best])}"
    return Truth(values[best], lambda _: reason, comparison=comparison)


def action_value(position: Position, action: str) -> Truth:
    """Return the value of an action: its expected return if you play best afterwards."""
    values, label = list_action_values(position), find_action(position, action)

    def explain(answer: str) -> str:
        """Return the value of the worst next state, or the values in the hidden states."""
        if not position.problem.partially_observable:
            return describe_worst_outcome(position, label)
        return _describe_known_states(position, label, parse_number(answer))

    return Truth(values[label], explain)


def best_action(position: Position) -> Truth:
    """Return the actions with the greatest value."""
    values = list_action_values(position)
    best = list_best_labels(values, position.problem.reward_scale)

    def explain(answer: str) -> str:
        """Return the loss of a wrong action, and its worst outcome."""
        loss = format_number(max(values.values()) - values[answer])
        worst = describe_worst_outcome(position, answer)
        sentence = f"{answer} scores {loss} less on average than the best action"
        return f"{sentence}; {worst}" if worst else sentence

    return Truth(best, explain, tuple(values), format_values(values))


def action_loss(position: Position, action: str) -> Truth:
    """Return the regret of an action: the value of the best one minus its own."""
    values, label = list_action_values(position), find_action(position, action)
    value, best = values[label], max(values.values())

    def explain(answer: str) -> str:
        """Return the value of the action, and that of the best one.

        If another loss is typed, return the value that the best action would then have instead.
        """
        if answer != format_number(best - value):
            implied = format_number(value + parse_number(answer))
            return f"if it were right, the best action would be worth {implied} here"
        worth = f"here, {label} is worth {format_number(value)}"
        is_best = best - value <= VALUE_TOLERANCE * position.problem.reward_scale
        return worth if is_best else f"{worth}, and the best action {format_number(best)}"

    return Truth(best - value, explain)


def order_of_values(position: PositionInGame, states: Sequence[str]) -> Truth:
    """Return these states ordered by their values, the most valuable first."""
    problem = position.problem
    values = {
        problem.format_state(find_state(position, state)): max(
            list_action_values(position.ask(state=state)).values()
        )
        for state in states
    }

    def explain(answer: str) -> str:
        """Return the number of pairs in the wrong order; '' if there is none."""
        tolerance, pairs = (
            VALUE_TOLERANCE * problem.reward_scale,
            [*combinations(answer.split(), 2)],
        )
        wrong_count = sum(values[second] - values[first] > tolerance for first, second in pairs)
        verb = "is" if wrong_count == 1 else "are"
        reason = f"{wrong_count} of the {len(pairs)} pairs {verb} in the wrong order"
        return reason * bool(wrong_count)

    ranked = sorted(values, key=lambda name: -values[name])
    return Truth(tuple(ranked), explain, tuple(values), format_values(values))


def outcomes(position: PositionInGame, action: str, state: str = "") -> Truth:
    """Return the probability of each next state after an action."""
    probabilities = list_outcomes(position, action, state)
    names = list_state_names(position.problem)

    def explain(answer: str) -> str:
        """Return the number of states in the answer, and the number of possible ones."""
        named = [name for name, p in parse_distribution(answer, names).items() if p > 0.0]
        count = format_count(len(named), "next state")
        impossible = sum(name not in probabilities for name in named)
        note = f"; {impossible} of yours cannot follow" if impossible else ""
        return f"you give {count} a probability, and {len(probabilities)} are possible{note}"

    return Truth(probabilities, explain, names)


def outcome_probability(
    position: PositionInGame, action: str, outcome: str, state: str = ""
) -> Truth:
    """Return the probability that an action leads to the state `outcome`."""
    probabilities = list_outcomes(position, action, state)
    name = position.problem.format_state(find_state(position, outcome))
    reason = "can follow, and their probabilities add up to 1"
    count = format_count(len(probabilities), "next state")
    return Truth(probabilities.get(name, 0.0), lambda _: f"{count} {reason}")


def missed_outcome_probability(
    position: PositionInGame, action: str, outcome: str, tries: int, state: str = ""
) -> Truth:
    """Return the probability that no one of several tries of an action leads to `outcome`."""
    p = outcome_probability(position, action, outcome, state).value
    assert isinstance(p, float)
    value, once = (1.0 - p) ** tries, format_number(1.0 - p)
    reason = f"with 1 try it is {once}" * (tries > 1)
    return Truth(value, lambda _: reason, comparison=f"{once}^{tries} = {format_number(value)}")


def worst_outcome(position: Position, action: str) -> Truth:
    """Return the possible next states with the smallest value after an action."""
    list_action_values(position)  # which checks that they are those of this game
    states = {state.text: state for state in merge_outcomes_by_text(position.outcomes(action))}
    costs = {name: -state.value_after for name, state in states.items()}

    def explain(answer: str) -> str:
        """Return the probability and the value of the named state."""
        if answer not in states:
            return f"the probability that {action} leads to {answer} is 0"
        probability, value = format_number(states[answer].probability), -costs[answer]
        return f"{answer} has probability {probability} and is worth {format_number(value)}"

    worst = list_best_labels(costs, position.problem.reward_scale)
    return Truth(worst, explain, list_state_names(position.problem))


def find_state(position: PositionInGame, text: str) -> Array:
    """Return the state that a text names, or that of the position if it is empty."""
    return parse_state(position.problem, text) if text else position.session.state


def find_state_index(position: PositionInGame, state: str) -> int:
    """Return the index of a state."""
    return int(position.problem.state_indices(find_state(position, state)[None])[0])


def find_action(position: Position | PositionInGame, text: str) -> str:
    """Return the label of the action that a text names."""
    problem, seat = position.problem, position.seat
    return problem.format_action(seat, problem.parse_action(seat, text))


def list_state_names(problem: Problem) -> tuple[str, ...]:
    """Return the names of all states."""
    return tuple(map(problem.format_state, problem.enumerate_states()))


def list_action_values(position: Position) -> dict[str, float]:
    """Return the value of each legal action by label, from the agent that gives the hints.

    Raise BadParameter if that agent has no values of this game, or only upper bounds.
    """
    agent, name = position.agent, get_problem_name(position.problem)
    values = position.values()
    if agent is None or values is None:
        raise BadParameter(f"{name} has no agent with values of actions")
    if position.agent is not agent:
        raise BadParameter(f"the values of {name} take too much work")
    is_bound = agent.basis.accuracy is Accuracy.UPPER_BOUND
    if agent.basis.scope or is_bound:
        about = f"are about another game ({agent.basis.scope})"
        raise BadParameter(f"the values of {name} {'are upper bounds' if is_bound else about}")
    return {position.labels[action]: float(values.q[action]) for action in position.legal_actions}


def list_outcomes(position: PositionInGame, action: str, state: str = "") -> dict[str, float]:
    """Return the probability of each next state of a problem with one agent, likeliest first."""
    problem = position.problem
    joint, s = np.array([[problem.parse_action(0, action)]]), find_state(position, state)
    _, p, outcome = enumerate_possible_outcomes(problem, s[None], joint)
    probabilities: dict[str, float] = {}
    for probability, next_state in zip(p, outcome.state, strict=True):
        name = problem.format_state(next_state)
        probabilities[name] = probabilities.get(name, 0.0) + float(probability)
    return dict(sorted(probabilities.items(), key=lambda pair: -pair[1]))


def describe_worst_outcome(position: Position, action: str) -> str:
    """Return a clause on the value and probability of the worst next state after an action.

    It does not name the state, for which a lesson may ask. It is '' if states are hidden or there
    are several agents.
    """
    has_states = not position.problem.partially_observable and len(position.problem.agents) == 1
    breakdown = position.break_down(action) if has_states else None
    if breakdown is None:
        return ""
    worst = min(merge_outcomes_by_text(breakdown.outcomes), key=lambda outcome: outcome.value_after)
    value, probability = format_number(worst.value_after), format_number(worst.probability)
    return f"its worst next state is worth {value} and has probability {probability}"


def _describe_known_states(position: Position, action: str, answer: float) -> str:
    """Return the value of an action in each hidden state if the player were sure of it.

    With two states, it also returns where a typed value is between them.
    """
    names = list_state_names(position.problem)
    q = position.values_for_belief(np.eye(len(names)))
    if q is None:
        return ""
    values = q[:, position.labels.index(action)]
    listed = [
        f"{format_number(float(v))} (sure of {name})" for name, v in zip(names, values, strict=True)
    ]
    if len(names) != 2 or not np.ptp(values):
        return f"the values in the states are {', '.join(listed)}"
    share = format_number(float((answer - values[0]) / (values[1] - values[0])))
    return f"it is {share} of the way from {listed[0]} to {listed[1]}"
