"""Rules of thumb and quantities of hex world."""

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.hexgrid import Hex, hex_distance, hex_neighbours, path_lengths
from dmplay.core.tabular import tabulate
from dmplay.core.typed_text import parse_state
from dmplay.errors import BadParameter
from dmplay.game.action_breakdown import merge_outcomes_by_text
from dmplay.game.position import Position
from dmplay.game.rules_of_thumb import RuleOfThumb, find_single_best
from dmplay.problems._shared.hex_steps import EXPECT_LIKELIEST_WITHOUT_BUMPS, find_only_best_step
from dmplay.registry.problems import with_parameters
from dmplay.solvers.mdp.mdp_values import compute_optimal_q
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.quantity import Quantity
from dmplay.tutor.state_quantities import find_state_index, list_action_values
from dmplay.tutor.truth import Truth, format_number

from .rules import HexWorld

MIN_LISTED_PROBABILITY = 0.001  # of never leaving hex world


def _walk_to_exit(position: Position, rank_exit: Callable[[float, float], float]) -> int | None:
    """Choose the step towards the good exit of the lowest rank, if there is only one step."""
    problem = position.problem
    assert isinstance(problem, HexWorld)
    lengths = path_lengths(problem.hexes)
    location = int(position.state)
    exits = [(problem.hexes.index(hex_), pay) for hex_, pay in problem.rewards if pay > 0]
    if not exits or location in [index for index, _ in exits]:
        return None
    ranks = [rank_exit(lengths[location, index], pay) for index, pay in exits]
    goal = find_single_best(-np.array(ranks, float))
    if goal is None:
        return None
    return find_only_best_step(position, -lengths[:, exits[goal][0]])


def exit_probability(position: PositionInGame, exit_state: str, discount: float) -> Truth:
    """Return the probability that the best play with this discount leaves hex world by an exit.

    It begins in the state of the position.
    """
    problem = with_parameters(position.problem, {"discount": discount})
    assert isinstance(problem, HexWorld)
    tables = tabulate(problem)
    actions = compute_optimal_q(tables, discount).argmax(axis=1)
    transition = tables.transition[np.arange(len(actions)), actions]
    # An exit absorbs here, so that repeated squaring gives the probability of each exit.
    exits = [problem.hexes.index(hex_) for hex_, _ in problem.rewards]
    transition[exits] = np.eye(len(transition))[exits]
    for _ in range(20):
        transition = transition @ transition
    start = find_state_index(position, "")
    probability = float(transition[start, find_state_index(position, exit_state)])
    never = 1.0 - float(transition[start, exits].sum())  # bumps on the way may cost too much

    def explain(_: str) -> str:
        """Return the value of the best step towards each exit that pays, slips included."""
        start_hex = _find_hex(problem, position.session.state)
        q = compute_optimal_q(tables, discount)[start]
        parts = []
        for hex_, reward in problem.rewards:
            if reward > 0.0:
                action = max(
                    _list_straight_actions(start_hex, [hex_]), key=lambda action: q[action]
                )
                label, value = problem.format_action(0, action), format_number(float(q[action]))
                parts.append(f"{label}, towards {reward:+g}, is worth {value}")
        sentence = f"with slips, {' and '.join(parts)}"
        if never > MIN_LISTED_PROBABILITY:
            probability = format_number(never)
            sentence += f"; with probability {probability}, the best play never leaves at all"
        return sentence

    return Truth(probability, explain)


def straight_way_loss(position: Position, exit_state: str = "") -> Truth:
    """Return the regret of a step straight to an exit, or to the nearest one with a reward.

    Of several such steps it is the best one. The way ignores holes.
    """
    problem, values = position.problem, list_action_values(position)
    assert isinstance(problem, HexWorld)
    goals = [hex_ for hex_, reward in problem.rewards if reward > 0]
    if exit_state:
        goals = [_find_hex(problem, parse_state(problem, exit_state))]
    actions = _list_straight_actions(_find_hex(problem, position.state), goals)
    label = max((position.labels[action] for action in actions), key=lambda label: values[label])

    def explain(_: str) -> str:
        """Return the outcomes of the straight step."""
        listed = ", ".join(
            f"to {outcome.text} with probability {format_number(outcome.probability)}"
            for outcome in merge_outcomes_by_text(position.outcomes(label))
        )
        return f"straight on is {label}; it leads {listed}"

    return Truth(max(values.values()) - values[label], explain)


def _list_straight_actions(start: Hex, goals: Sequence[Hex]) -> list[int]:
    """Return the actions that end nearest to one of the goals, as if there were no holes."""
    distances = [
        min(hex_distance(neighbour, goal) for goal in goals) for neighbour in hex_neighbours(start)
    ]
    return [action for action, distance in enumerate(distances) if distance == min(distances)]


def _find_hex(problem: HexWorld, state: Array) -> Hex:
    """Return the hex of a state; raise BadParameter for the end of the game."""
    if int(state) >= len(problem.hexes):
        raise BadParameter("state: got the end of the game, expected a hex such as (5,2)")
    return problem.hexes[int(state)]


RULES_OF_THUMB = [
    RuleOfThumb(
        "walk straight to the nearest good exit",
        partial(_walk_to_exit, rank_exit=lambda distance, reward: distance),
    ),
    RuleOfThumb(
        "walk straight to the richest exit",
        partial(_walk_to_exit, rank_exit=lambda distance, reward: -reward),
    ),
    EXPECT_LIKELIEST_WITHOUT_BUMPS,
]
PUZZLE_DAY = 0
QUANTITIES = {
    "exit-probability": Quantity(exit_probability, {"discount": (1e-6, 1.0 - 1e-6)}),
    "straight-way-loss": Quantity(straight_way_loss),
}
