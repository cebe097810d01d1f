"""Tests of each claim of a reason against the dynamics of its problem.

A sentence that no pattern describes is an error, so that no claim remains untested.
"""

import re
from collections.abc import Callable, Iterator

import numpy as np

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.arrays import Array
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.registry import agents

RANDOM_SHARE = 0.6  # of the turns before a position
Claim = Callable[[Session, int, "re.Match[str]"], Iterator[bool]]


def iter_positions(name: str, count: int, max_turns: int = 40) -> Iterator[HintProvider]:
    """Yield positions after games in which the hint's and random actions take turns."""
    random, episode = np.random.default_rng(5), 0
    while count:
        problem, episode = dmplay.load_problem(name), episode + 1
        partner = agents.load_roster(problem).default_partner
        players = ["human", *[partner] * (len(problem.agents) - 1)]
        policies = [None, *(agents.load_agent(problem, 1, player) for player in players[1:])]
        session = Session(problem, SeededUniforms(episode), policies)
        provider = HintProvider(session, AdviceQuestion.of_session(session, 0, players))
        for _ in range(int(random.integers(max_turns))):
            if not session.over:
                legal = provider.position.legal_actions
                action, _ = provider.position.choose()
                is_random = action is None or random.random() < RANDOM_SHARE
                chosen = int(random.choice(legal)) if is_random else action
                session.advance([chosen, *[None] * (len(problem.agents) - 1)])
        if not session.over:
            count -= 1
            yield provider


def check_sentence(session: Session, action: int, sentence: str, claims: dict[str, Claim]) -> int:
    """Return the number of claims of a sentence, all of which are true."""
    for pattern, check in claims.items():
        match = re.fullmatch(pattern, sentence)
        if match:
            results = [*check(session, action, match)]
            assert all(results), (session.state, action, sentence, results)
            return len(results)
    raise AssertionError(f"no claim of this sentence is tested: {sentence}")


def step(session: Session, action: int) -> Array:
    """Return the state after an action without random events."""
    problem = session.problem
    outcome = problem.step(session.state[None], np.array([[action]]), np.zeros((1, 0)))
    return np.asarray(outcome.state[0])


def play_on(session: Session, action: int, agent: str, max_turns: int = 1000) -> Session:
    """Return the session after an action and the choices of an agent up to the end."""
    future = session.copy_at_start()
    future.append_turns(session.turns)
    policy = agents.load_agent(session.problem, 0, agent)
    seated = SeatedPolicy(future, 0, policy)
    future.advance([action])
    last_turn = len(session.turns) + max_turns
    while not future.over and len(future.turns) < last_turn:
        future.advance([seated.choose()])
    return future


# cart-pole


def check_pole(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the pole leans, swings and reacts to a push as a sentence says."""
    lean, verb, swing, push, effect = match.groups()
    _, v, theta, omega = session.state
    after, other = step(session, action), step(session, 1 - action)
    yield push == ("left", "right")[action]
    yield abs(np.degrees(theta)) < 0.05 if lean is None else (theta > 0) == (lean == "right")
    side = lean or swing
    if swing:
        yield (omega > 0) == (swing == "right")
        yield verb is None or (verb == "falls") == (lean == swing) or lean is None
    if effect == "moves the cart under it":
        yield push == side
        yield abs(after[1] - v) > 0 and (after[1] > v) == (side == "right")
        yield (after[3] < omega) == (side == "right")
    elif effect == "tips it further":
        yield (after[3] > max(omega, other[3])) == (side == "right")
    elif effect == "slows this swing":
        yield abs(after[3]) < abs(omega) and after[3] * omega > 0
    elif effect == "speeds this swing up":
        yield abs(after[3]) > abs(omega) and after[3] * omega > 0
    else:
        yield after[3] * omega < 0


def check_cart(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the cart is, rolls and moves back as a sentence says."""
    distance, position_side, direction, speed, push, tip, turns = match.groups()
    x, v, _, omega = session.state
    if distance:
        yield f"{abs(x):.2f}" == distance and (x > 0) == (position_side == "right")
    else:
        yield f"{abs(v):.2f}" == speed and (v > 0) == (direction == "right")
    pushed = ("left", "right").index(push)
    yield (step(session, pushed)[3] > omega) == (tip == "right")
    if turns:
        future = play_on(session, pushed, "regulate", int(turns))
        yield future.state[1] * v < 0 and (v > 0) == pushed


def check_ends(session: Session, action: int, match: re.Match[str]) -> Iterator[bool]:
    """Yield whether the game lasts as long after each push as a sentence says."""
    first, first_push, second, second_push, both = match.groups()
    clauses = {first_push: first, second_push: second} if first else dict.fromkeys(SIDES, both)
    for push, clause in clauses.items():
        future = play_on(session, SIDES.index(push), "regulate")
        count = len(future.turns) - len(session.turns)
        is_fallen = abs(np.degrees(future.state[2])) > 12
        ends = "the pole falls" if is_fallen else "the cart leaves its track"
        turns = f"{count} turn{'s' * (count > 1)}"
        is_over = future.end_reason == "terminal"
        yield clause == (f"{ends} after {turns}" if is_over else f"the game goes on for {turns}")


SIDES = ("left", "right")
SIDE = "(left|right)"
END_EVENT = r"(?:the pole falls|the cart leaves its track) after"
END = rf"((?:{END_EVENT}|the game goes on for) \d+ turns?)"
CLAIMS: dict[str, dict[str, Claim]] = {
    "cart-pole": {
        rf"The pole (?:leans {SIDE}|stands upright)(?: and (falls|swings back|swings) {SIDE})?: "
        rf"a push {SIDE} (moves the cart under it|tips it further|slows this swing|"
        r"speeds this swing up|turns this swing round)\.": check_pole,
        rf"The cart (?:is (\d+\.\d\d) m {SIDE} of the middle|rolls {SIDE} at (\d+\.\d\d) m/s): "
        rf"a push {SIDE} tips the pole {SIDE}(?:, and the cart turns back in (\d+) turns)?\.":
        check_cart,
        rf"If regulate plays on, (?:{END} with a push {SIDE}, and {END} with a push {SIDE}|"
        rf"{END}, whichever push comes first)\.": check_ends,
    },
}  # fmt: skip
