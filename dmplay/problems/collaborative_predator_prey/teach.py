"""Reasons for the moves of a team that hunts."""

from typing import NamedTuple

import numpy as np

from dmplay.agents.best_response_in_team import PartnerBeliefPolicy
from dmplay.core.arrays import Reals
from dmplay.core.hexgrid import format_hex, path_lengths
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.game.position import Position

from .agents import Qmdp
from .rules import CollaborativePredatorPrey

MIN_DIFFERENCE = 0.005  # probabilities that differ by less are called equal


class MoveFacts(NamedTuple):
    """Facts about the belief after a move."""

    capture: float  # probability that a predator is on the hex of the prey
    distance: float  # mean steps from this predator to the prey
    sense: float  # probability that this predator senses the prey


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the likeliest hexes, and the chances of a capture and of sensing after a move."""
    problem, label = position.problem, position.labels[action]
    assert isinstance(problem, CollaborativePredatorPrey)
    try:
        belief = _find_belief(position)
        facts = [_list_facts(position, a) for a in range(len(position.labels))]
    except (BadParameter, BudgetExceeded):  # too many states for a belief
        return []
    others = [fact for a, fact in enumerate(facts) if a != action]
    reasons = [_describe_belief(problem, position.seat, belief)]
    templates = (
        f"After {label}, a predator is on the prey's hex with probability {{:.2f}}; "
        "after other moves {:.2f} to {:.2f}.",
        "You are then {:.2f} steps from the prey on average; after other moves {:.2f} to {:.2f}.",
        "You then sense the prey with probability {:.2f}; after other moves {:.2f} to {:.2f}.",
    )
    for index, template in enumerate(templates):
        numbers = [fact[index] for fact in others]
        reasons.append(template.format(facts[action][index], min(numbers), max(numbers)))
    signs = np.array([1.0, -1.0, 1.0])
    ranks = np.round(np.array(facts) * signs, 2)
    is_best = ranks[action] == ranks.max(axis=0)
    is_flat = ranks.max(axis=0) == ranks.min(axis=0)
    if (
        not (is_best & ~is_flat).any()
        and position.agent
        and isinstance(position.agent.policy, Qmdp)
    ):
        reasons.append(f"None of this favours {label}: its bound also counts later turns.")
    return reasons


def _find_belief(position: Position) -> Reals:
    """Return the belief `[S]` that the hint uses; raise BadParameter if there is none."""
    if position.agent and isinstance(position.agent.policy, PartnerBeliefPolicy):
        policy, (nodes, *_) = position.agent.policy, position.memory
        return np.asarray(policy.split_nodes(nodes)[0].sum(axis=0))
    belief = position.current_belief
    if belief is None:
        raise BadParameter("expected a belief")
    return belief


def _list_facts(position: Position, action: int) -> MoveFacts:
    """Return the facts about the belief after a move."""
    problem, forecast = position.problem, position.forecast(action)
    assert isinstance(problem, CollaborativePredatorPrey)
    assert forecast.beliefs is not None
    belief = forecast.probabilities @ forecast.beliefs
    states = problem.enumerate_states()
    steps = path_lengths(problem.hexes)[states[:, position.seat], states[:, -1]]
    labels = problem.observations[position.seat]
    senses = [label.startswith("prey") for label in labels.labels]
    senses_prey = np.array(senses)[problem.observation_table[:, position.seat]]
    is_caught = problem.is_prey_captured(states)
    return MoveFacts(*(float(belief @ values) for values in (is_caught, steps, senses_prey)))


def _describe_belief(problem: CollaborativePredatorPrey, seat: int, belief: Reals) -> str:
    """Return the likeliest hexes of the prey and of this predator."""
    joint = belief.reshape((len(problem.hexes),) * problem.walker_count)
    texts = []
    for walker in (problem.predators, seat):
        chances = joint.sum(axis=tuple(axis for axis in range(joint.ndim) if axis != walker))
        hex_, count = format_hex(problem.hexes[chances.argmax()]), _count_best(chances)
        text = f"{hex_} ({chances.max():.2f})"
        texts.append(f"one of {count} hexes ({chances.max():.2f} each)" if count > 1 else text)
    return f"The hint's belief has the prey most likely at {texts[0]}, and you at {texts[1]}."


def _count_best(chances: Reals) -> int:
    """Return the number of hexes that are as likely as the likeliest one, as printed."""
    return int((chances > chances.max() - MIN_DIFFERENCE).sum())


REASONS = give_reasons
