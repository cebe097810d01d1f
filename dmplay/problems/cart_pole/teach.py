"""Reasons for the pushes of the cart."""

import math
from collections.abc import Iterator

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.text import format_count
from dmplay.game.hints.action_simulation import play_on
from dmplay.game.position import Position

from .agents import LEFT, RIGHT, LinearQuadraticPolicy
from .rules import CartPole

SIDES = ("left", "right")
MIN_LEAN_DEGREES, MIN_SWING_DEGREES = 0.05, 0.5  # smaller angles, and swings in 1 s, count as 0
MAX_RETURN_TURNS = 200  # turns within which the cart must begin to roll back


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the effect of a push on the pole and the cart, and on the length of the game."""
    problem = position.problem
    assert isinstance(problem, CartPole)
    s = np.repeat(position.state[None], 2, axis=0)
    after = problem.step(s, np.array([[LEFT], [RIGHT]]), np.zeros((2, 0))).state
    reasons = list[str]()
    if after[LEFT, 3] > after[RIGHT, 3]:  # a push tips the pole to the other side
        reasons += _describe_push(problem, position.state, after, action)
    return reasons + [_compare_ends(position)] * (position.agent is not None)


def _describe_push(problem: CartPole, s: Array, after: Array, action: int) -> Iterator[str]:
    """Yield the effect of a push on the pole, and the need of the cart if that decides.

    `after` are the states after a push to the left and after one to the right.
    """
    policy = LinearQuadraticPolicy(problem, 0)
    gain, push = policy.regulator.gain, f"a push {SIDES[action]}"
    best = RIGHT if gain @ s < 0 else LEFT
    is_for_pole = (RIGHT if gain[2:] @ s[2:] < 0 else LEFT) == best
    lean, swing = _round_degrees(s[2], MIN_LEAN_DEGREES), _round_degrees(s[3], MIN_SWING_DEGREES)
    if (is_for_pole or action != best) and (lean or swing):
        effect = "tips it further"
        if lean * swing < 0:
            next_swing = math.degrees(after[action, 3])
            effect = "speeds this swing up" if abs(next_swing) > abs(swing) else "slows this swing"
            effect = "turns this swing round" if next_swing * swing < 0 else effect
        elif action == ((lean or swing) > 0):
            effect = "moves the cart under it"
        yield f"The pole {_describe_pole(lean, swing)}: {push} {effect}."
    if not is_for_pole:
        x, v = s[:2].tolist()
        is_far = abs(gain[0] * x) > abs(gain[1] * v) and (gain[0] * x < 0) == best
        position_text = f"is {abs(x):.2f} m {SIDES[x > 0]} of the middle"
        cause = position_text if is_far else f"rolls {SIDES[v > 0]} at {abs(v):.2f} m/s"
        text = f"The cart {cause}: a push {SIDES[best]} tips the pole {SIDES[1 - best]}"
        turns = _count_turns_to_roll(problem, policy, after[best], 1 - best)
        if turns and v and (v > 0) == best:
            text += f", and the cart turns back in {turns} turns"
        yield f"{text}."


def _round_degrees(radians: float, least: float) -> float:
    """Return an angle in degrees, or 0 if it is small."""
    degrees = math.degrees(radians)
    return degrees if abs(degrees) >= least else 0.0


def _describe_pole(lean: float, swing: float) -> str:
    """Return the lean and the swing of the pole, of which one is not 0, as a clause."""
    if not lean:
        return f"stands upright and swings {SIDES[swing > 0]}"
    if not swing:
        return f"leans {SIDES[lean > 0]}"
    verb = "falls" if lean * swing > 0 else "swings back"
    return f"leans {SIDES[lean > 0]} and {verb} {SIDES[swing > 0]}"


def _count_turns_to_roll(
    problem: CartPole, policy: LinearQuadraticPolicy, s: Array, side: int
) -> int:
    """Return the turns until the cart rolls to a side if the regulator plays on; 0 if many.

    They include the turn that led to the state.
    """
    states = s[None]
    for turns in range(1, MAX_RETURN_TURNS):
        if problem.terminal(states)[0]:
            break
        if turns > 1 and (states[0, 1] > 0.0) == side and states[0, 1]:
            return turns
        a = policy.choose((states,), None, states)
        states = problem.step(states, a[:, None], np.zeros((1, 0))).state
    return 0


def _compare_ends(position: Position) -> str:
    """Return the turns until the game ends after each push if the hint agent plays on."""
    games = play_on(position, 1)
    assert position.agent
    assert isinstance(position.problem, CartPole)
    condition = f"If {position.agent.base_name} plays on"
    counts, states = games.turn_counts[:, 0].astype(int).tolist(), games.states[:, 0]
    ends = position.problem.terminal(states)
    texts = []
    for count, s, is_over in zip(counts, states, ends, strict=True):
        event = (
            "the pole falls"
            if abs(s[0]) <= position.problem.x_limit
            else "the cart leaves its track"
        )
        turns = format_count(count, "turn")
        texts.append(f"{event} after {turns}" if is_over else f"the game goes on for {turns}")
    if texts[LEFT] == texts[RIGHT]:
        return f"{condition}, {texts[LEFT]}, whichever push comes first."
    order = [RIGHT, LEFT] if counts[RIGHT] < counts[LEFT] else [LEFT, RIGHT]
    first, second = (f"{texts[push]} with {SIDES[push]}" for push in order)
    return f"{condition}, {first}, and {second}."


REASONS = give_reasons
