"""Reasons for the pushes of the cart."""

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.text import format_count
from dmplay.game.hints.action_simulation import play_on
from dmplay.game.position import Position

from .agents import LEFT, RIGHT, Balance, LinearQuadraticPolicy
from .rules import CartPole

SIDES = ("left", "right")
MIN_LEAN_DEGREES, MIN_SWING_DEGREES = 0.05, 0.5  # smaller angles, and swings in 1 s, count as 0
MAX_RETURN_TURNS = 200  # turns within which the cart must begin to roll back, or the pole to fall
STOP_SHARE = 0.2  # of a swing, which remains after a push that is said to stop it
NEAR_BALANCE = "Pole and cart are so near balance that the next push can make up for either one."


def give_reasons(position: Position, action: int) -> list[str]:
    """Return the effect of a push on the pole and the cart, and on the length of the game."""
    problem = position.problem
    assert isinstance(problem, CartPole)
    s = np.repeat(position.state[None], 2, axis=0)
    after = problem.step(s, np.array([[LEFT], [RIGHT]]), np.zeros((2, 0))).state
    reasons = list[str]()
    if after[LEFT, 3] > after[RIGHT, 3]:  # a push tips the pole to the other side
        reasons += _describe_push(problem, position.state, after, action)
    return reasons + ([*_compare_ends(position)] if position.agent else [])


def _describe_push(problem: CartPole, s: Array, after: Array, action: int) -> Iterator[str]:
    """Yield the effect of a push on the pole, and the need of the cart if that decides.

    A pole that swings back is to stop upright: too slow a swing is sped up, too fast a one slowed.

    `after` are the states after a push to the left and after one to the right.
    """
    policy = LinearQuadraticPolicy(problem, 0)
    gain, push = policy.regulator.gain, f"a push {SIDES[action]}"
    best = RIGHT if gain @ s < 0 else LEFT
    is_for_pole = (RIGHT if gain[2:] @ s[2:] < 0 else LEFT) == best
    lean, swing = _round_degrees(s[2], MIN_LEAN_DEGREES), _round_degrees(s[3], MIN_SWING_DEGREES)
    x, v = s[:2].tolist()
    is_far = abs(gain[0] * x) > abs(gain[1] * v) and (gain[0] * x < 0) == best
    if not is_for_pole and abs(gain[:2] @ s[:2]) < abs(gain @ (after[RIGHT] - after[LEFT])) / 4:
        yield NEAR_BALANCE  # half of what a push changes is more than the cart and the pole need
        return
    if (is_for_pole or action != best) and (lean or swing):
        effect = "tips it further"
        clause = _describe_pole(lean, swing)
        if lean * swing < 0:
            passes = _passes_upright(problem, s)
            # Near the speed that just stands the pole up, the regulator may still push it.
            if passes == ((best if is_for_pole else 1 - best) == (swing > 0)):
                clause += ", fast enough to pass" if passes else ", too slowly to reach"
                clause += " the upright"
            share = math.degrees(after[action, 3]) / swing  # of the swing that remains
            effect = "speeds it up" if share > 1.0 else "slows it"
            effect = "all but stops it" if abs(share) < STOP_SHARE else effect
            effect = "turns it round" if share <= -STOP_SHARE else effect
        elif action == ((lean or swing) > 0):
            effect = "moves the cart under it"
        yield f"The pole {clause}: {push} {effect}."
    if not is_for_pole:
        position_text = f"is {abs(x):.2f} m {SIDES[x > 0]} of the middle"
        cause = position_text if is_far else f"rolls {SIDES[v > 0]} at {abs(v):.2f} m/s"
        text = f"The cart {cause}: a push {SIDES[best]} tips the pole {SIDES[1 - best]}"
        turns = _count_turns_to_roll(problem, policy, after[best], 1 - best)
        if turns and v and (v > 0) == best:
            text += f", and pushes under it turn the cart back in {turns} turns"
        yield f"{text}."


def _passes_upright(problem: CartPole, s: Array) -> bool:
    """Return whether a pole that swings back would pass the upright if nobody pushed the cart."""
    states, free = s[None], replace(problem, force=0.0)
    for _ in range(MAX_RETURN_TURNS):
        states = free.step(states, np.array([[LEFT]]), np.zeros((1, 0))).state
        if states[0, 2] * s[2] <= 0.0:
            return True
        if states[0, 3] * s[2] >= 0.0:
            return False
    return False


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


def _compare_ends(position: Position) -> Iterator[str]:
    """Yield the turns until the game ends after each push if the hint agent plays on."""
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
        yield f"{condition}, {texts[LEFT]}, whichever push comes first."
        return
    order = [RIGHT, LEFT] if counts[RIGHT] < counts[LEFT] else [LEFT, RIGHT]
    first, second = (f"{texts[push]} with {SIDES[push]}" for push in order)
    yield f"{condition}, {first}, and {second}."
    is_balancer = isinstance(position.agent.policy, (Balance, LinearQuadraticPolicy))
    if ends.all() and is_balancer and position.choose()[0] == order[0]:
        yield f"The game is lost, and {position.agent.base_name} does not play for its last turns."


REASONS = give_reasons
