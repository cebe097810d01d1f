"""What an action may bring about before it is played, as far as its seat may know."""

from collections.abc import Sequence
from itertools import product

import numpy as np

from dmplay.belief import bayes
from dmplay.budget import Budget
from dmplay.chance import Array, Finite
from dmplay.core import Continuous, Problem, possible
from dmplay.errors import BadParameter, TooMuch
from dmplay.session import Session, View
from dmplay.views.style import Outlook

SAMPLES = 200
STEPS = np.sqrt(np.array([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0]))  # of the uniforms
LIKELIEST = 4  # outcomes that are told
LEAST = 0.005  # a probability that is told of a belief


def forecast(session: Session, seat: int, action: float) -> Outlook:
    """Every outcome of an action, the likeliest first, the others acting at random.

    Where states hide it follows from the seat's belief alone; where nature draws reals, or there
    are too many outcomes to list, they are samples under uniforms that are always the same.
    """
    action = session.check(seat, action)
    problem, view = session.problem, session.view(seat)
    if problem.hidden:
        return _believed(view, action)
    chances = problem.chance(session.state[None], np.zeros((1, len(problem.agents)), int))
    if all(isinstance(chance, Finite) for chance in chances) and _listed(problem, seat):
        try:
            return _exact(session, seat, action)
        except TooMuch:  # one by one
            return _sampled(session, seat, action)
    return _sampled(session, seat, action)


def _listed(problem: Problem, seat: int) -> bool:
    """Whether the actions of the others can be counted."""
    return all(known.labels for other, known in enumerate(problem.actions) if other != seat)


def replies(session: Session, seat: int, action: float) -> Array:
    """The joint actions `[J, n]` in which a seat does this, and the others what they may."""
    able = map(session.legal, range(len(session.problem.agents)))
    each: list[Sequence[float]] = [
        [action]
        if other == seat
        else np.arange(len(known.labels))[slice(None) if may is None else may].tolist()
        for other, (known, may) in enumerate(zip(session.problem.actions, able, strict=True))
    ]
    budget = Budget("what an action may bring", "play it")
    budget.hold(8.0 * len(each) * float(np.prod([float(len(one)) for one in each])))
    return np.array([*product(*each)])


def _exact(session: Session, seat: int, action: float) -> Outlook:
    """By listing all that nature and the others may do."""
    joint = replies(session, seat, action)
    states = np.repeat(session.state[None], len(joint), axis=0)
    _, p, outcome = possible(session.problem, states, joint)
    seen, which = np.unique(outcome.state, axis=0, return_inverse=True)
    chances = np.bincount(which.reshape(-1), p / len(joint), len(seen)).astype(float)
    order = np.argsort(-chances, kind="stable")
    return Outlook(action, chances[order], seen[order])


def _sampled(session: Session, seat: int, action: float) -> Outlook:
    """Samples, of the others too."""
    problem = session.problem
    count = problem.draws.step
    u = np.outer(np.arange(1, SAMPLES + 1), np.resize(STEPS, count + len(problem.agents))) % 1.0
    able = map(session.legal, range(len(problem.agents)))
    joint = np.full((SAMPLES, len(problem.agents)), action)
    for other, (known, may) in enumerate(zip(problem.actions, able, strict=True)):
        if other != seat:
            each = None if may is None else np.tile(may, (SAMPLES, 1))
            joint[:, other] = known.draw(u[:, count + other], each)
    joint = joint.astype(int) if all(known.labels for known in problem.actions) else joint
    outcome = problem.step(np.repeat(session.state[None], SAMPLES, axis=0), joint, u[:, :count])
    return Outlook(action, np.full(SAMPLES, 1.0 / SAMPLES), outcome.state, sampled=True)


def _believed(view: View[Problem], action: float) -> Outlook:
    """What may be seen, and what would then be believed, from what is believed now."""
    problem, seat = view.problem, view.seat
    if view.beliefs is None:
        raise BadParameter("whatif: too many states to foresee what may be seen")
    budget = Budget("what an action may bring", "play it")
    nothing: list[int | None] = [None] * len(problem.agents)
    did, rows = nothing.copy(), []
    did[seat] = int(action)
    kinds = problem.observation_counts[seat]
    for number in range(kinds):
        budget.spend(float(len(view.belief)) * len(view.belief), number / kinds)
        seen = nothing.copy()
        seen[seat] = number
        rows.append(problem.carry(view.belief, did, seen))
    after = bayes(np.array(rows))
    order = np.argsort(-after.likelihood, kind="stable")
    order = order[after.likelihood[order] > 0.0]
    return Outlook(action, after.likelihood[order], order, after.belief[order])


def told(session: Session, seat: int, outlook: Outlook) -> str:
    """What an action may bring, in a line."""
    problem = session.problem
    name = session.action_name(seat, outlook.action)
    rest = len(session.asked([other for other in range(len(problem.agents)) if other != seat]))
    others = f", the other{'s' * (rest > 1)} at random" if rest else ""
    how = f" ({len(outlook.chances)} samples)" if outlook.sampled else ""
    if problem.states == 1 and not outlook.sampled:
        return f"if {name}{others}: {_pays(session, seat, outlook.action)}"
    if outlook.sampled:
        low, high = outlook.states.min(axis=0), outlook.states.max(axis=0)
        ends = f"{_state(problem, low)} to {_state(problem, high)}"
        return f"if {name}{others}: {ends}{how}"
    each = [
        f"{chance:.2f} {_named(problem, seat, outlook, place)}"
        for place, chance in enumerate(outlook.chances[:LIKELIEST])
    ]
    more = len(outlook.chances) - len(each)
    left = float(outlook.chances[LIKELIEST:].sum())
    return f"if {name}{others}: {', '.join([*each, *[f'{left:.2f} {more} more'] * bool(more)])}"


def _named(problem: Problem, seat: int, outlook: Outlook, place: int) -> str:
    """An outcome: the state, or what is seen and then believed."""
    if outlook.beliefs is None:
        return _state(problem, outlook.states[place])
    seen = problem.observations[seat].told(outlook.states[place])
    belief = outlook.beliefs[place]
    states = problem.enumerated()
    likely = [at for at in np.argsort(-belief, kind="stable")[:LIKELIEST] if belief[at] >= LEAST]
    then = ", ".join(f"{problem.notation(states[at])} {belief[at]:.2f}" for at in likely)
    return f"{seen} (then {then})" if then else seen


def _state(problem: Problem, state: Array) -> str:
    """A state; of reals the first digits."""
    if isinstance(problem.states, Continuous):
        return " ".join(f"{number:.3g}" for number in state)
    return problem.notation(state)


def _pays(session: Session, seat: int, action: float) -> str:
    """What each reply of the others pays; of many, how little and how much."""
    problem, joint = session.problem, replies(session, seat, action)
    states = np.repeat(session.state[None], len(joint), axis=0)
    row, p, outcome = possible(problem, states, joint)
    pays = np.bincount(row, p * outcome.rewards[:, seat], len(joint))
    mean = f"{pays.mean():.4g} on average"
    if len(joint) > LIKELIEST:
        return f"pays {pays.min():g} to {pays.max():g}, {mean}"
    each = [
        f"{' and '.join(_others(problem, seat, one))} pays {pay:g}"
        for one, pay in zip(joint, pays, strict=True)
    ]
    return f"{', '.join(each)}; {mean}"


def _others(problem: Problem, seat: int, joint: Array) -> list[str]:
    """What all but a seat do."""
    return [problem.action_name(i, a) for i, a in enumerate(joint) if i != seat]
