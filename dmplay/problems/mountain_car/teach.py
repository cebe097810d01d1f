"""Reasons for the actions of the mountain car."""

from collections.abc import Iterator

import numpy as np

from dmplay.core.arrays import Array, Reals
from dmplay.core.text import format_count, join_words
from dmplay.game.hints.action_simulation import SimulatedGames, play_on
from dmplay.game.position import Position

from .agents import COAST, LEFT, RIGHT, Optimal
from .rules import TOP_SPEED, MountainCar

MAX_DRIVE_TURNS = 300  # in one direction, until the car rolls back or reaches the goal
GRID_NOTE = "The values below are approximate, so they can differ from this."
TIE_NOTE = "Values estimate minus the turns to the goal, so differences below 1 may be none."
MAX_GRID_ERROR = 1.0  # turns; games that differ by less from the values only round them
MIN_SPEED_CHANGE = 1e-12  # smaller changes are rounding errors


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the effect of an action on the speed, and the turns to the goal after each one."""
    assert isinstance(position.problem, MountainCar)
    reasons = [*_describe_drive(position.problem, position.state, action)]
    if position.agent is not None:
        games = play_on(position, 1)
        reasons.append(_compare_arrivals(position, games))
        if isinstance(position.agent.policy, Optimal):
            reasons += _compare_with_grid(position, games.returns[:, 0])
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
        is_at_top = abs(speed) >= TOP_SPEED
        effect = f"{drive} {'leaves it at top speed' if is_at_top else 'changes nothing'}"
    else:
        effect = f"{drive} {'adds speed' if gain > 0 else 'brakes it'}"
    yield f"The car {motion}: {effect}."
    turns, top = _drive_right(problem, s)
    if turns:
        yield f"Driving right all the way would reach the goal in {format_count(turns, 'turn')}."
    else:
        yield (
            f"Driving right all the way, it would roll back at position {top:.2f}, "
            f"and the goal is at {problem.goal:g}: it first needs more speed."
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


def _compare_arrivals(position: Position, games: SimulatedGames) -> str:
    """Return the turns to the goal after each action if the hint agent plays on."""
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


def _compare_with_grid(position: Position, returns: Reals) -> Iterator[str]:
    """Yield a note if the values of the grid differ from the returns `[A]` of the games."""
    values = position.values()
    assert values is not None
    best = int(values.best_actions[0])
    if returns[best] < returns.max():
        quicker = position.labels[int(returns.argmax())]
        yield (
            f"The values, interpolated on a grid, err here: {quicker} is quicker than "
            f"{position.labels[best]}."
        )
    elif np.abs(values.q - returns).max() >= MAX_GRID_ERROR:
        yield GRID_NOTE
    elif np.unique(returns).size < returns.size:
        yield TIE_NOTE


REASONS = give_reasons
