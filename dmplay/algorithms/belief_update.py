"""Belief update: predict the next state, weigh it by the observation, and normalize.

Source: section 19.2, Discrete State Filter. The belief b'(s') is proportional to
O(o | a, s') sum_s T(s' | s, a) b(s).
"""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.algorithms.formula_text import MAX_TERMS, format_number, format_weighted_sum
from dmplay.algorithms.step import Algorithm, BeliefTable, Step, WatchRequest
from dmplay.core.arrays import Reals
from dmplay.core.belief import initial_seat_belief
from dmplay.core.problem import Problem, StatePart
from dmplay.core.session import Session, View
from dmplay.core.text import format_count, format_score
from dmplay.core.uniforms import SeededUniforms

DEFAULT_TURNS = 4  # turns of the short game that is played if there is none
MAX_ROWS = 24  # rows of a table; of more states, the likeliest are listed
PREDICTED_COLUMNS, WEIGHED_COLUMNS, ALL_COLUMNS = 2, 4, 5  # columns after each of the three steps


class BeliefUpdate(NamedTuple):
    """The numbers of one update; the arrays are `[S]`."""

    prior: Reals
    predicted: Reals  # P(s'), before the observation is used
    product: Reals  # P(o, s'), the likelihood of the observation times the predicted belief
    evidence: float  # P(o)
    posterior: Reals


def update_belief(
    problem: Problem, prior: Reals, seat: int, action: int, observation: int
) -> BeliefUpdate:
    """Return the update of a seat's belief `[S]` by its action and its observation.

    The dynamics give P(o, s'), the sum over s of O(o | a, s') T(s' | s, a) b(s). The actions of
    other agents are unknown, and therefore taken to be uniformly random.
    """
    actions: list[int | None] = [None] * len(problem.agents)
    observations = actions.copy()
    actions[seat] = action
    predicted = problem.joint_belief_update(prior, actions, observations)
    observations[seat] = observation
    product = problem.joint_belief_update(prior, actions, observations)
    evidence = float(product.cumsum()[-1])
    return BeliefUpdate(prior, predicted, product, evidence, product / evidence)


def explain_misfit(problem: Problem) -> str:
    """Return why the belief update does not fit a problem; '' if it fits."""
    if not problem.partially_observable:
        return "a belief update needs hidden states, but here every agent sees the state"
    if not Session(problem, SeededUniforms(0)).has_visible_beliefs:
        return "a belief update needs few enough states to list, and observations with names"
    return ""


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the first belief, and three steps for each turn of the game."""
    problem, seat, session = request.problem, request.seat, request.session
    if session is None or not session.turns:
        session = play_random_game(problem, request.seed, request.iterations or DEFAULT_TURNS)
        turns = format_count(len(session.turns), "turn")
        origin = f"A random policy has played this game of {turns}, with the seed {request.seed}."
    else:
        origin = _describe_shown_turns(len(session.turns), request.iterations)
    view = session.view(seat)
    first_turn = max(view.turns_played - (request.iterations or view.turns_played), 0) + 1
    belief = initial_seat_belief(problem, seat, view.observations[0])
    for turn in range(1, first_turn):
        belief = _update_after_turn(view, turn, belief).posterior
    yield _describe_start(view, first_turn, belief, origin)
    for turn in range(first_turn, view.turns_played + 1):
        update = _update_after_turn(view, turn, belief)
        yield from _describe_update(view, turn, update)
        belief = update.posterior


def _describe_shown_turns(turn_count: int, iterations: int | None) -> str:
    """Return a sentence about the turns of a game that are shown.

    The game may go on, so that none of them need be its last one.
    """
    first_turn = max(turn_count - (iterations or turn_count), 0) + 1
    if first_turn == turn_count:
        return f"This is turn {turn_count} of your game."
    return f"These are turns {first_turn} to {turn_count} of your game."


def _update_after_turn(view: View[Problem], turn: int, belief: Reals) -> BeliefUpdate:
    """Return the update of the belief `[S]` before a turn by its action and observation."""
    action, observation = int(view.actions[turn - 1]), int(view.observations[turn])
    return update_belief(view.problem, belief, view.seat, action, observation)


def play_random_game(problem: Problem, seed: int, turns: int) -> Session:
    """Return a game of at most this many turns, in which all agents act at random."""
    source = SeededUniforms(seed)
    session = Session(problem, source, turn_limit=turns)
    while not session.over:
        actions: list[float] = []
        for seat, action_set in enumerate(problem.actions):
            u = source.generate_uniforms(1 + seat, len(session.turns) + 1, 0, 1)[0]
            legal = session.legal_actions_mask(seat)
            legal_row = None if legal is None else legal[None]
            actions.append(float(action_set.sample_actions(u, legal_row)[0]))
        session.advance(actions)
    return session


def list_table_rows(problem: Problem, seat: int, beliefs: Sequence[Reals]) -> Sequence[StatePart]:
    """Return the rows of each table for these beliefs `[S]`: all states, or the likeliest.

    If the problem divides its states into parts, which are fewer, each part has a table.
    """
    parts = problem.state_parts(seat)
    if parts:
        return parts.parts
    states = problem.enumerate_states()
    if len(states) <= MAX_ROWS:
        return [StatePart([problem.format_state(s) for s in states], np.arange(len(states)))]
    likeliest = np.argsort(-np.max(beliefs, axis=0), kind="stable")[: MAX_ROWS - 1]
    row_of_state = np.full(len(states), len(likeliest))
    row_of_state[likeliest] = np.arange(len(likeliest))
    labels = [problem.format_state(states[i]) for i in likeliest]
    return [StatePart([*labels, "other states"], row_of_state)]


def _describe_start(view: View[Problem], turn: int, belief: Reals, origin: str) -> Step:
    """Return the step that shows the belief before the first turn shown."""
    tables = [
        BeliefTable(rows.labels, (("prior", rows.sum_states(belief)),))
        for rows in list_table_rows(view.problem, view.seat, [belief])
    ]
    agent = view.problem.agents[view.seat]
    sentences = [
        f"A belief is a probability for each hidden state; this is the belief of {agent}.",
        origin,
        f"The belief uses only the actions and the observations of {agent}.",
    ]
    parts = view.problem.state_parts(view.seat)
    if parts:
        together = f"The belief is about all {parts.noun} together"
        sentences.append(f"{together}; each table shows one of them.")
    title = f"start of turn {turn}" if turn > 1 else "start"
    return Step(title, tuple(sentences), pictures=tuple(tables))


def _describe_update(view: View[Problem], turn: int, update: BeliefUpdate) -> Iterator[Step]:
    """Yield the three steps of a turn; the formulas are about the state that is now likeliest."""
    problem, seat = view.problem, view.seat
    agent = problem.agents[seat]
    tables = list_table_rows(problem, seat, [update.prior, update.posterior])
    rows = tables[0]
    posterior = rows.sum_states(update.posterior)
    focus = int(np.argmax(posterior))
    predicted, product = rows.sum_states(update.predicted), rows.sum_states(update.product)
    observation = problem.observations[seat].format_observation(view.observations[turn])
    evidence = format_score(update.evidence)
    earlier_states = "possible earlier states"
    earlier = [rows.labels[row] for row in np.flatnonzero(rows.sum_states(update.prior)).tolist()]
    if len(earlier) <= MAX_TERMS:
        noun = "possible earlier state" if len(earlier) == 1 else "earlier states"
        earlier_states = f"{noun} {', '.join(earlier)}"

    sentences = [
        f"{agent} chose {_format_action(view, turn)}.",
        f"predicted = sum of (transition probability x prior) over the {earlier_states}.",
    ]
    if others := [name for name in problem.agents if name != agent]:
        sentences.insert(1, f"{' and '.join(others)}: taken to act uniformly at random.")
    transitions, priors = _list_transitions(view, turn, rows, focus, update.prior)
    yield Step(
        f"turn {turn}: predict",
        tuple(sentences),
        f"predicted({rows.labels[focus]}) = {format_weighted_sum(transitions, priors)} "
        f"= {format_score(float(predicted[focus]))}",
        tuple(_build_first_columns(table, update, PREDICTED_COLUMNS) for table in tables),
    )
    possible = predicted > 0
    likelihood = product[possible] / predicted[possible]
    sentences = [
        f"{agent} observed {observation}.",
        "The likelihood is the probability of this observation in each state; product = likelihood "
        "x predicted.",
        f"The evidence P({observation}) = sum of products = {evidence} is the probability of the "
        "observation.",
    ]
    if not possible.all():
        sentences.append("A dash marks a state that is impossible now.")
    yield Step(
        f"turn {turn}: observe",
        tuple(sentences),
        f"P({observation}) = {format_weighted_sum(likelihood, predicted[possible])} = {evidence}",
        tuple(_build_first_columns(table, update, WEIGHED_COLUMNS) for table in tables),
    )
    yield Step(
        f"turn {turn}: normalize",
        (
            "posterior = product / evidence; the evidence is the sum of the products (Bayes' "
            "rule).",
            f"The likeliest is now {rows.labels[focus]}, with probability {posterior[focus]:.3g}.",
        ),
        f"b({rows.labels[focus]}) = {format_number(float(product[focus]))} / {evidence} "
        f"= {format_score(float(posterior[focus]))}",
        tuple(_build_first_columns(table, update, ALL_COLUMNS) for table in tables),
    )


def _format_action(view: View[Problem], turn: int) -> str:
    """Return the label of a seat's action in a turn."""
    if view.past_action_labels:
        return view.past_action_labels[turn - 1]
    return view.problem.format_action(view.seat, view.actions[turn - 1])


def _list_transitions(
    view: View[Problem], turn: int, rows: StatePart, focus: int, prior: Reals
) -> tuple[list[float], list[float]]:
    """Return the probability of a transition to the focus from each possible row, and its prior."""
    actions: list[int | None] = [None] * len(view.problem.agents)
    unknown = actions.copy()
    actions[view.seat] = int(view.actions[turn - 1])
    priors = rows.sum_states(prior)
    transitions = []
    for row in np.flatnonzero(priors):
        part = np.where(rows.value_of_state == row, prior, 0.0)
        next_states = view.problem.joint_belief_update(part, actions, unknown)
        transitions.append(float(rows.sum_states(next_states)[focus] / priors[row]))
    return transitions, priors[priors > 0].tolist()


def _build_first_columns(rows: StatePart, update: BeliefUpdate, column_count: int) -> BeliefTable:
    """Return the first columns of a table.

    The likelihood of a row that the action cannot lead to is NaN: no number is known for it.
    """
    predicted, product = rows.sum_states(update.predicted), rows.sum_states(update.product)
    undefined = np.full(len(predicted), np.nan)
    columns = (
        ("prior", rows.sum_states(update.prior)),
        ("predicted", predicted),
        ("likelihood", np.divide(product, predicted, out=undefined, where=predicted > 0)),
        ("product", product),
        ("posterior", rows.sum_states(update.posterior)),
    )
    return BeliefTable(rows.labels, columns[:column_count])


ALGORITHM = Algorithm(
    "belief-update",
    "compute the probabilities of the hidden states after each observation",
    "section 19.2, Discrete State Filter",
    explain_misfit,
    iterate_steps,
    shows_actions=False,
)
