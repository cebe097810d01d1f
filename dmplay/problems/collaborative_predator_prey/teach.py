"""Reasons for the moves of a team that hunts."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from dmplay.agents.best_response_in_team import PartnerBeliefPolicy
from dmplay.core.arrays import Reals
from dmplay.core.hexgrid import DIRECTIONS, format_hex, move_destinations, path_lengths
from dmplay.core.text import format_count
from dmplay.errors import BadParameter, BudgetExceeded
from dmplay.game.position import Position

from .agents import MIN_DIFFERENCE, PLAN_RESOLUTION, PlansWithPartner
from .rules import CollaborativePredatorPrey

MIN_LOOKAHEAD = 3  # turns left from which a value counts more than the next turn's reward


class MoveFacts(NamedTuple):
    """Facts about the belief after a move."""

    capture: float  # probability that a predator is on the hex of the prey
    distance: float  # mean steps from this predator to the prey
    sense: float  # probability that this predator senses the prey


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the likeliest hexes, the way between them, and what a move does better than others."""
    problem, label = position.problem, position.labels[action]
    assert isinstance(problem, CollaborativePredatorPrey)
    try:
        belief = _find_belief(position)
        facts = [_list_facts(position, a) for a in range(len(position.labels))]
    except (BadParameter, BudgetExceeded):  # too many states for a belief
        return []
    reasons = [*_iter_belief_sentences(problem, position.seat, belief)]
    texts = (
        ("a predator is on the prey's hex with probability {:.2f}", "more than"),
        ("you are {:.2f} steps from the prey on average", "nearer than"),
        ("you sense the prey with probability {:.2f}", "more than"),
    )
    ranks = np.round(np.array(facts), 2) * [1, -1, 1]
    others = np.delete(ranks, action, axis=0)
    is_best = ranks[action] > others.max(axis=0)
    if not is_best.any():
        is_best[1] = np.ptp(ranks[:, 1]) > 0.0  # the distance is not best: a number to compare
    for index in np.flatnonzero(is_best).tolist():
        text, comparison = texts[index]
        numbers = [fact[index] for a, fact in enumerate(facts) if a != action]
        is_ahead = ranks[action, index] > others[:, index].max()
        others_text = f"{min(numbers):.2f} to {max(numbers):.2f}"
        end = f", {comparison} after any other move ({others_text})"
        end = end if is_ahead else f"; after other moves {others_text}"
        reasons.append(f"After {label}, {text.format(facts[action][index])}{end}.")
    is_ahead = (ranks[action] > others.max(axis=0)).any()
    has_later_turns = (position.turns_left or MIN_LOOKAHEAD) >= MIN_LOOKAHEAD
    if not is_ahead and has_later_turns and label in position.best_actions():
        text = "Another move looks as good or better next turn"
        reasons.append(f"{text}; the value of {label} also counts later turns.")
    if position.agent and isinstance(position.agent.policy, PlansWithPartner):
        text = f"if two differ by up to {PLAN_RESOLUTION:g}, they may be equal"
        reasons.append(f"The values are estimates: {text}, and the choice is not judged.")
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


def _iter_belief_sentences(
    problem: CollaborativePredatorPrey, seat: int, belief: Reals
) -> Iterator[str]:
    """Yield the likeliest hexes of the prey and all predators, and the way to the prey."""
    joint = belief.reshape((len(problem.hexes),) * problem.walker_count)
    likeliest, texts = list[int](), list[str]()
    others = [walker for walker in range(problem.predators) if walker != seat]
    for walker in (problem.predators, seat, *others):
        chances = joint.sum(axis=tuple(axis for axis in range(joint.ndim) if axis != walker))
        hex_, count = int(chances.argmax()), _count_best(chances)
        text = f"{format_hex(problem.hexes[hex_])} ({chances.max():.2f})"
        texts.append(f"one of {count} hexes ({chances.max():.2f} each)" if count > 1 else text)
        likeliest.append(hex_ if count == 1 else -1)
    yield f"The hint's belief has the prey most likely at {texts[0]}, and you at {texts[1]}."
    prey, own_hex, *_ = likeliest
    if min(prey, own_hex) >= 0:
        steps = path_lengths(problem.hexes)[:, prey]
        ends = move_destinations(problem.hexes)[own_hex, :, 0]
        first = [DIRECTIONS[move] for move in np.flatnonzero(steps[ends] < steps[own_hex])]
        if first:
            way = f"{format_count(int(steps[own_hex]), 'step')}, first by {' or '.join(first)}"
            yield f"From that hex of yours to that of the prey it is {way}."
    for walker, text in zip(others, texts[2:], strict=True):
        yield f"It has {problem.agents[walker]} most likely at {text}."


def _count_best(chances: Reals) -> int:
    """Return the number of hexes that are as likely as the likeliest one, as printed."""
    return int((chances > chances.max() - MIN_DIFFERENCE).sum())


REASONS = give_reasons
