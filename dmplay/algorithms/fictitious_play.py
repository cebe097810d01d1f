"""Fictitious play: each agent answers the frequencies of the others' actions so far.

Source: section 24.8, Fictitious Play. As in the book, each agent counts every action of the others
once before the first round, and the first round is drawn uniformly.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.algorithms import one_round_game as game
from dmplay.algorithms.step import Algorithm, Curve, Step, WatchRequest
from dmplay.core.best_actions import VALUE_TOLERANCE, compute_reward_scale
from dmplay.core.problem import Problem
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms

DEFAULT_ROUNDS = 100
GAIN_LABEL = "largest gain from a best response"
GAIN_SENTENCE = "An agent that leaves its own frequencies for a best response gains at most {:.3g}."


def explain_misfit(problem: Problem) -> str:
    """Return why fictitious play does not fit a problem; '' if it fits."""
    return game.explain_matrix_game_misfit(problem, "fictitious play")


def iterate_steps(request: WatchRequest) -> Iterator[Step]:
    """Yield the start and one step for each round."""
    problem, seat = request.problem, request.seat
    payoffs = game.compute_payoffs(problem)
    counts = [np.ones(action_count) for action_count in problem.action_counts]
    uniforms = generate_uniforms(request.seed, NATURE_STREAM, 0, rows=1, count=len(counts))[0]
    actions = [int(u * len(count)) for u, count in zip(uniforms, counts, strict=True)]
    mixes = [count / count.sum() for count in counts]
    gains = [game.compute_largest_gain(payoffs, mixes)]
    yield Step(
        "start",
        (
            *game.describe_payoffs(problem),
            "Each agent counts the actions of the others, beginning with 1 of each.",
            game.ONE_ROUND_SENTENCE,
            game.BEST_RESPONSE_SENTENCE,
        ),
        pictures=(game.draw_mixed_strategies(problem, mixes), Curve(GAIN_LABEL, tuple(gains))),
    )
    last_round = request.iterations or DEFAULT_ROUNDS
    for round_number in range(1, last_round + 1):
        played = actions
        for count, action in zip(counts, played, strict=True):
            count[action] += 1
        mixes = [count / count.sum() for count in counts]
        actions = game.choose_best_responses(payoffs, mixes)
        gains.append(game.compute_largest_gain(payoffs, mixes))
        is_first, is_last = round_number == 1, round_number == last_round
        yield Step(
            f"round {round_number}",
            (
                *([_describe_end(gains[-1], compute_reward_scale(payoffs))] if is_last else []),
                f"{'A random draw chose' if is_first else 'The agents played'}: "
                f"{game.format_actions(problem, played)}.",
                f"Best responses to these frequencies: {game.format_actions(problem, actions)}.",
                *game.describe_ties(problem, payoffs, mixes),
                *([] if is_last else [GAIN_SENTENCE.format(gains[-1])]),
            ),
            game.format_response_value(problem, payoffs, mixes, seat, actions[seat]),
            (game.draw_mixed_strategies(problem, mixes, actions), Curve(GAIN_LABEL, tuple(gains))),
        )


def _describe_end(gain: float, scale: float) -> str:
    """Return a sentence about the frequencies after the last round; `scale` is of the payoffs."""
    if gain <= VALUE_TOLERANCE * scale:
        return "The rounds end: no agent gains by leaving its frequencies, a Nash equilibrium."
    return (
        f"The rounds end: an agent gains at most {gain:.3g} by leaving its frequencies; a gain of "
        "0 would be a Nash equilibrium."
    )


ALGORITHM = Algorithm(
    "fictitious-play",
    "choose a best reply to the past actions of the others, round by round",
    "section 24.8, Fictitious Play",
    explain_misfit,
    iterate_steps,
)
