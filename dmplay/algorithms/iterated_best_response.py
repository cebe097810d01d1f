"""Iterated best response: all agents answer the others' last strategies, again and again.

Source: section 24.6, Iterated Best Response.
"""

from collections.abc import Iterator, Sequence

import numpy as np

from dmplay.algorithms import one_round_game as game
from dmplay.algorithms.step import Algorithm, Curve, Step, WatchRequest
from dmplay.core.arrays import Reals
from dmplay.core.problem import Problem
from dmplay.core.text import format_count

DEFAULT_ROUNDS = 200
GAIN_LABEL = "largest gain from a best response"


def explain_misfit(problem: Problem) -> str:
    """Return why iterated best response does not fit a problem; '' if it fits."""
    return game.explain_matrix_game_misfit(problem, "iterated best response")


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the start and one step for each round, until the strategies repeat."""
    problem = request.problem
    payoffs = game.compute_payoffs(problem)
    mixes = [np.full(action_count, 1 / action_count) for action_count in problem.action_counts]
    gains = [game.compute_largest_gain(payoffs, mixes)]
    start_sentences = (
        *game.describe_payoffs(problem),
        "First all actions are equally likely; then all agents switch to best responses.",
        game.BEST_RESPONSE_SENTENCE,
    )
    yield _make_best_response_step(request, payoffs, mixes, gains, "start", start_sentences)
    first_rounds: dict[tuple[int, ...], int] = {}  # the round that first led to these actions
    last_round = request.iterations or DEFAULT_ROUNDS
    for round_number in range(1, last_round + 1):
        actions = tuple(game.choose_best_responses(payoffs, mixes))
        mixes = game.make_pure_strategies(problem, actions)
        gains.append(game.compute_largest_gain(payoffs, mixes))
        cycle_length = round_number - first_rounds.setdefault(actions, round_number)
        responses = game.choose_best_responses(payoffs, mixes)
        sentences = [
            f"The agents switched to {game.format_actions(problem, actions)}.",
            _describe_progress(cycle_length, gains[-1]),
            f"Best responses to these: {game.format_actions(problem, responses)}.",
        ]
        if round_number == 1:
            sentences.append(game.ONE_ROUND_SENTENCE)
        if round_number == last_round and not cycle_length:
            sentences.append("The rounds end here, before any actions came twice.")
        yield _make_best_response_step(
            request, payoffs, mixes, gains, f"round {round_number}", sentences
        )
        if cycle_length:
            return


def _make_best_response_step(  # noqa: PLR0913, PLR0917 - the parts of one step
    request: WatchRequest,
    payoffs: Reals,
    mixes: Sequence[Reals],
    gains: Sequence[float],
    title: str,
    sentences: Sequence[str],
) -> Step:
    """Return a step whose formula and marks are about best responses to the mixes it shows."""
    problem, seat = request.problem, request.seat
    actions = game.choose_best_responses(payoffs, mixes)
    return Step(
        title,
        (*sentences, *game.describe_ties(problem, payoffs, mixes)),
        game.format_response_value(problem, payoffs, mixes, seat, actions[seat]),
        (game.draw_mixed_strategies(problem, mixes, actions), Curve(GAIN_LABEL, tuple(gains))),
    )


def _describe_progress(cycle_length: int, gain: float) -> str:
    """Return a sentence about these actions, given the rounds since they were played, or 0."""
    if cycle_length == 1:
        return (
            "Nothing changed, so this is a Nash equilibrium: no agent gets more by changing only "
            "its own action."
        )
    if cycle_length > 1:
        rounds = format_count(cycle_length, "round")
        return f"The same actions came {rounds} ago: the agents run in a circle, without an end."
    if gain > 0:
        return (
            f"An agent gains {gain:.3g} by changing only its own action, so another round follows."
        )
    return "No agent gains by changing only its own action."


ALGORITHM = Algorithm(
    "iterated-best-response",
    "switch all agents to a best response to the others, round by round",
    "section 24.6, Iterated Best Response",
    explain_misfit,
    iterate_steps,
)
