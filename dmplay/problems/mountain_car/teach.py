"""Reasons for the actions of the mountain car."""

from collections.abc import Iterator

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.text import format_count, join_words
from dmplay.game.hints.action_simulation import play_on
from dmplay.game.position import Position

from .agents import COAST, LEFT, RIGHT, Optimal
from .rules import MountainCar

MAX_DRIVE_TURNS = 300  # in one direction, until the car rolls back or reaches the goal
GRID_NOTE = "The values are interpolated between points of a grid, so they can differ from this."
MIN_SPEED_CHANGE = 1e-12  # smaller changes are rounding errors


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the effect of an action on the speed, and the turns to the goal after each one."""
    assert isinstance(position.problem, MountainCar)
    reasons = [*_describe_drive(position.problem, position.state, action)]
    if position.agent is not None:
        reasons.append(_compare_arrivals(position))
        if isinstance(position.agent.policy, Optimal):
            reasons.append(GRID_NOTE)
    return reasons


def _describe_drive(problem: MountainCar, s: Array, action: int) -> Iterator[str]:
    """Yield the effect of an action on the speed, and the end of a drive to the right."""
    states = np.repeat(s[None], 3, axis=0)
    actions = np.array([[LEFT], [COAST], [RIGHT]])
    speeds = problem.step(states, actions, np.zeros((3, 0))).state[:, 1].tolist()
    v, speed, coast_speed = float(s[1]), speeds[action], speeds[COAST]
    gain = abs(speed) - abs(coast_speed)
    motion = f"rolls {'right' if v > 0 else 'left'}" if v else "stands still"
    drive = f"driving {'left' if action == LEFT else 'right'}"
    if action == COAST:
        change = abs(speed) - abs(v)
        effect = f"coasting lets the slope {'speed it up' if change > 0 else 'slow it down'}"
        effect = effect if abs(change) > MIN_SPEED_CHANGE else "coasting keeps its speed"
    elif speed * v < 0 or not v:
        effect = f"{drive} makes it roll {'right' if speed > 0 else 'left'}"
        effect = effect if speed else f"{drive} does not move it"
    elif abs(gain) <= MIN_SPEED_CHANGE:
        effect = f"{drive} changes its speed no more than coasting"
    else:
        effect = f"{drive} {'adds speed' if gain > 0 else 'brakes it'}"
    yield f"The car {motion}: {effect}."
    turns, top = _drive_right(problem, s)
    if turns and action == RIGHT:
        yield f"Driving right all the way reaches the goal in {format_count(turns, 'turn')}."
    elif not turns:
        yield (
            f"Even if you drive right all the way, it next rolls back from position {top:.2f}, "
            f"and the goal is at {problem.goal:g}."
        )


def _drive_right(problem: MountainCar, s: Array) -> tuple[int, float]:
    """Return the turns of driving right to the goal, 0 if it rolls back, and the last position."""
    states, has_climbed = s[None], False
    for turns in range(MAX_DRIVE_TURNS):
        if problem.terminal(states)[0]:
            return turns, float(states[0, 0])
        next_states = problem.step(states, np.array([[RIGHT]]), np.zeros((1, 0))).state
        if has_climbed and next_states[0, 1] <= 0.0:
            return 0, float(states[0, 0])
        has_climbed, states = next_states[0, 1] > 0.0, next_states
    return 0, float(states[0, 0])


def _compare_arrivals(position: Position) -> str:
    """Return the turns to the goal after each action if the hint agent plays on."""
    games = play_on(position, 1)
    assert position.agent
    condition = f"If {position.agent.base_name} plays on, the car"
    counts, states = games.turn_counts[:, 0].astype(int).tolist(), games.states[:, 0]
    arrives = position.problem.terminal(states)
    if not arrives.any():
        return f"{condition} does not reach the goal within {format_count(counts[0], 'turn')}."
    texts = [
        str(count) if is_there else "too many"
        for count, is_there in zip(counts, arrives, strict=True)
    ]
    if len({*texts}) == 1:
        turns = format_count(counts[0], "turn")
        return f"{condition} reaches the goal in {turns}, whichever action comes first."
    parts = [f"{text} with {label}" for text, label in zip(texts, position.labels, strict=True)]
    turns = join_words(parts).replace(" with", " turns with", 1)
    return f"{condition} reaches the goal in {turns}."


REASONS = give_reasons
