"""Plots of a recorded game: the belief and the regret by turn."""

import numpy as np

from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_score
from dmplay.draw.axes import Axis
from dmplay.draw.panels import LinePanel, Plot, Series
from dmplay.errors import BadParameter
from dmplay.game.hints.review import ReviewedAction, append_game, total_regret
from dmplay.game.launch_requests import ReplayRequest
from dmplay.game.playback import Playback
from dmplay.game.seats import list_human_seats

MAX_LINES = 6  # of states in a panel; the ones that ever are the likeliest


def plot_belief_path(recording: ReplayRequest) -> Plot:
    """Return the probability of each hidden state by turn, in the belief of each seat."""
    game = Playback(recording.path, trusted=recording.trusted, peek=recording.peek)
    list(game.iter_agent_turns())
    problem = game.session.problem
    if not problem.partially_observable:
        raise BadParameter(f"belief: the agents see the state in {_format_title(game)}")
    seats = list_human_seats(game.player_names) or [*range(len(problem.agents))]
    panels = [_build_belief_panel(game, seat) for seat in seats]
    notes = ["the mark of the true state is on its line"]
    if len(problem.agents) > 1:
        notes.append("a belief takes the unseen actions of the other agents to be uniformly random")
    return Plot(f"{_format_title(game)}: belief by turn", panels, notes=notes)


def _build_belief_panel(game: Playback, seat: int) -> LinePanel:
    """Return a seat's probability of each state by turn, and marks of the true states."""
    problem = game.session.problem
    history = game.session.view(seat).beliefs
    if history is None:
        raise BadParameter(f"belief: there are too many hidden states in {_format_title(game)}")
    beliefs = np.stack([np.asarray(belief) for belief in history])  # [turns + 1, S]
    turns = np.arange(len(beliefs), dtype=float)
    names = [problem.format_state(s) for s in problem.enumerate_states()]
    likeliest = np.argsort(-beliefs.max(axis=0), kind="stable")[:MAX_LINES]
    series = [
        Series(f"P({names[s]})", turns, beliefs[:, s], style=style)
        for style, s in enumerate(sorted(likeliest.tolist()))
    ]
    states = [game.session.initial_state, *(turn.state for turn in game.session.turns)]
    true_states = [names.index(problem.format_state(state)) for state in states]
    series.append(
        Series("true state", turns, beliefs[turns.astype(int), true_states], "points", len(series))
    )
    title = f"belief of {problem.agents[seat]}" if len(problem.agents) > 1 else ""
    x = Axis("turns played", 0.0, max(turns[-1], 1.0), is_whole=True)
    return LinePanel(title, x, Axis("probability", 0.0, 1.0), series)


def plot_regret(recording: ReplayRequest) -> Plot:
    """Return the regret of each choice by turn, a panel for each seat of a person, else for each.

    The regret of an action is how much lower the expected return of the game is after it than after
    the best action.
    """
    game = Playback(recording.path, trusted=recording.trusted, peek=recording.peek)
    reviewed_actions = game.review_choices()
    if not any(action.regret is not None for action in reviewed_actions):
        raise BadParameter(f"regret: no exact values of {game.problem_name}; try dmplay review")
    first, panels, notes = reviewed_actions[0], list[LinePanel](), list[str]()
    seats = [*dict.fromkeys(action.seat for action in reviewed_actions)]
    for seat in seats:
        actions = [action for action in reviewed_actions if action.seat == seat]
        panels.append(_build_regret_panel(game.session.problem, seat, actions))
        player = f" of {seat}" * (len(seats) > 1)
        total, count = format_score(total_regret(actions)), format_count(len(actions), "choice")
        notes.append(f"total regret{player} {total} in {count}")
    game_text = ", ".join(filter(None, (first.basis.scope, first.about)))
    notes += [f"the values in turn {first.turn} are about: {game_text}"] if game_text else []
    return Plot(f"{_format_title(game)}: regret by turn", panels, notes=notes)


def _build_regret_panel(
    problem: Problem, seat: str, reviewed_actions: list[ReviewedAction]
) -> LinePanel:
    """Return the bars of one seat's regrets."""
    actions = [item for item in reviewed_actions if item.regret is not None]
    turns = np.array([action.turn for action in actions], float)
    regrets = np.array([action.discounted_regret for action in actions], float)
    highest = float(regrets.max(initial=0.0))
    return LinePanel(
        f"choices of {seat}" if len(problem.agents) > 1 else "",
        Axis("turn", 0.5, float(turns.max(initial=1.0)) + 0.5, is_whole=True),
        Axis("regret (expected return lost)", 0.0, 1.05 * highest or 1.0),
        [Series("", turns, regrets, "bars")],
    )


def _format_title(game: Playback) -> str:
    """Return the problem of a game with its settings, and the file."""
    path = game.transcript_path
    return append_game(game.problem_name, ", ".join(game.settings)) + (
        f", {path.name}" if path else ""
    )
