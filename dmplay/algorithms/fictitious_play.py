"""Fictitious play: each agent answers the frequencies of the others' actions so far.

Source: section 24.8, Fictitious Play. As in the book, each agent counts every action of the others
once before the first round, and the first round is drawn uniformly.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.algorithms import one_round_game as game
from dmplay.algorithms.step import Algorithm, Curve, Step, WatchRequest
from dmplay.core.problem import Problem
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms

DEFAULT_ROUNDS = 100
GAIN_LABEL = "largest gain from a best response"


def find_obstacle(problem: Problem) -> str:
    """Return why fictitious play does not fit a problem; '' if it fits."""
    return game.find_game_obstacle(problem, "fictitious play")


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
            "Each agent counts how often the others have played each action.",
            "At the start every count is 1, so that all actions are equally likely.",
            game.ONE_ROUND_SENTENCE,
        ),
        pictures=(game.picture_mixes(problem, mixes), Curve(GAIN_LABEL, tuple(gains))),
    )
    for round_number in range(1, (request.iterations or DEFAULT_ROUNDS) + 1):
        played = actions
        for count, action in zip(counts, played, strict=True):
            count[action] += 1
        mixes = [count / count.sum() for count in counts]
        actions = game.choose_best_responses(payoffs, mixes)
        gains.append(game.compute_largest_gain(payoffs, mixes))
        is_first = round_number == 1
        yield Step(
            f"round {round_number}",
            (
                f"{'A random draw chose' if is_first else 'The best responses were'}: "
                f"{game.format_actions(problem, played)}.",
                f"Next best responses: {game.format_actions(problem, actions)}.",
                f"Against these frequencies, a best response gains at most {gains[-1]:.3g}.",
            ),
            game.format_response_value(problem, payoffs, mixes, seat, actions[seat]),
            (game.picture_mixes(problem, mixes, actions), Curve(GAIN_LABEL, tuple(gains))),
        )


ALGORITHM = Algorithm(
    "fictitious-play",
    "answer how often the others have played each action, round by round",
    "section 24.8, Fictitious Play",
    find_obstacle,
    iterate_steps,
)
