"""Plots of the returns of many games, a histogram for each agent.

The return of a game is the sum of its discounted rewards.
"""

from collections.abc import Callable, Sequence

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import compute_reward_scale
from dmplay.core.text import VALUE_DECIMALS, format_count
from dmplay.draw.axes import Axis
from dmplay.draw.panels import LinePanel, Plot, Series
from dmplay.evaluation.many_games import run
from dmplay.output.evaluation_request import EvaluationRequest, limit_turns, load_players
from dmplay.output.tables import format_mean
from dmplay.plots.plotted_problem import load_plotted_problem

MAX_BINS = 40
MAX_DISTINCT_RETURNS = 12  # if there are at most so many, each return has a bar of its own


def plot_returns(
    request: EvaluationRequest,
    compared_agents: Sequence[str],
    episodes: int,
    report_progress: Callable[[int, int], Callable[[float], None]],
) -> Plot:
    """Return a histogram of the first seat's returns for each agent, on the same random numbers.

    `report_progress(number, count)` is the progress callback of one agent's games.
    """
    request = limit_turns(request)
    names = [request.agent, *compared_agents]
    lineups = [load_players(request._replace(agent=name)) for name in names]
    results = [
        run(
            lineup.problem,
            lineup.policies,
            episodes=episodes,
            turns=request.turn_limit,
            seed=request.seed,
            workers=request.workers,
            progress=report_progress(number, len(lineups)),
        )
        for number, lineup in enumerate(lineups)
    ]
    samples = [result.rollout.returns[:, 0] for result in results]
    edges = choose_bin_edges(np.concatenate(samples))
    counts = [np.histogram(sample, edges)[0] for sample in samples]
    seat = lineups[0].problem.agents[0]
    x = Axis(f"return of {seat} (sum of discounted rewards)", float(edges[0]), float(edges[-1]))
    y = Axis("share of games", 0.0, 1.05 * max(float(c.max() / c.sum()) for c in counts))
    panels = []
    for lineup, result, count in zip(lineups, results, counts, strict=True):
        estimate = result.seat_summaries[0].returns
        mean = format_mean(estimate.mean, estimate.standard_error)
        centres = (edges[:-1] + edges[1:]) / 2
        bars = Series("", centres, count / count.sum(), "bars")
        panels.append(LinePanel(f"{lineup.agent_names[0]}: mean {mean}", x, y, [bars]))
    subject = load_plotted_problem(request.problem, request.settings)
    title = f"{subject.title}: returns of {format_count(episodes, 'game', ',')}"
    notes = [f"seed {request.seed}; mean ± standard error"]
    others = lineups[0].agent_names[1:]
    if others:
        pairs = zip(lineups[0].problem.agents[1:], others, strict=True)
        notes.append("other players: " + ", ".join(f"{seat} {name}" for seat, name in pairs))
    limit = request.turn_limit or lineups[0].problem.horizon
    notes += [f"at most {format_count(limit, 'turn')}"] if limit else []
    notes += [result.shortfall_reason for result in results if result.shortfall_reason]
    return Plot(title, panels, notes=notes)


def choose_bin_edges(returns: Reals) -> Reals:
    """Return the edges of the bins: one around each of a few distinct returns, or equal widths.

    The number of equal bins is that of the Freedman-Diaconis rule, at most MAX_BINS.
    """
    scale = compute_reward_scale(returns)
    distinct = scale * np.unique(np.round(returns / scale, VALUE_DECIMALS))
    if len(distinct) == 1:
        return np.array([distinct[0] - scale / 2, distinct[0] + scale / 2])
    steps = np.diff(distinct)
    if len(distinct) <= MAX_DISTINCT_RETURNS and np.allclose(steps, steps[0], atol=0.0):
        return np.append(distinct - steps[0] / 2, distinct[-1] + steps[0] / 2)
    count = len(np.histogram_bin_edges(returns, "fd")) - 1 if np.ptp(returns) else 1
    return np.linspace(distinct[0], distinct[-1], min(max(count, 10), MAX_BINS) + 1)
