"""Iterated best response: all agents answer the others' last strategies, again and again.

Source: section 24.6, Iterated Best Response.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.algorithms import one_round_game as game
from dmplay.algorithms.step import Algorithm, Curve, Step, WatchRequest
from dmplay.core.problem import Problem
from dmplay.core.text import format_count

DEFAULT_ROUNDS = 200
GAIN_LABEL = "largest gain from a best response"


def find_obstacle(problem: Problem) -> str:
    """Return why iterated best response does not fit a problem; '' if it fits."""
    return game.find_game_obstacle(problem, "iterated best response")


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the start and one step for each round, until the strategies repeat."""
    problem, seat = request.problem, request.seat
    payoffs = game.compute_payoffs(problem)
    mixes = [np.full(action_count, 1 / action_count) for action_count in problem.action_counts]
    gains = [game.compute_largest_gain(payoffs, mixes)]
    yield Step(
        "start",
        (
            "Each agent begins with all its actions equally likely.",
            "In each round, all agents switch to a best response at the same time.",
            game.ONE_ROUND_SENTENCE,
        ),
        pictures=(game.picture_mixes(problem, mixes), Curve(GAIN_LABEL, tuple(gains))),
    )
    first_rounds: dict[tuple[int, ...], int] = {}  # the round that first led to these actions
    for round_number in range(1, (request.iterations or DEFAULT_ROUNDS) + 1):
        actions = tuple(game.choose_best_responses(payoffs, mixes))
        formula = game.format_response_value(problem, payoffs, mixes, seat, actions[seat])
        mixes = game.make_pure_mixes(problem, actions)
        gains.append(game.compute_largest_gain(payoffs, mixes))
        first_round = first_rounds.setdefault(actions, round_number)
        yield Step(
            f"round {round_number}",
            (
                f"Best responses to the last round: {game.format_actions(problem, actions)}.",
                _describe_progress(round_number - first_round, gains[-1]),
            ),
            formula,
            (game.picture_mixes(problem, mixes, actions), Curve(GAIN_LABEL, tuple(gains))),
        )
        if first_round < round_number:
            return


def _describe_progress(cycle_length: int, gain: float) -> str:
    """Return a sentence about the next round, given the rounds since the same actions, or 0."""
    if cycle_length == 1:
        return "Nothing changed: this is a Nash equilibrium, in which no agent gains alone."
    if cycle_length > 1:
        rounds = format_count(cycle_length, "round")
        return f"The same actions came {rounds} ago: the agents run in a circle, without an end."
    if gain > 0:
        return f"An agent gains {gain:.3g} by another action, so the next round changes it."
    return "No agent gains by another action."


ALGORITHM = Algorithm(
    "iterated-best-response",
    "switch all agents to a best response to the others, round by round",
    "section 24.6, Iterated Best Response",
    find_obstacle,
    iterate_steps,
)
