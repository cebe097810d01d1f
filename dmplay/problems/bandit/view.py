"""The view of the bandit: wins and pulls of each arm, its chance of a win, and the belief."""

from collections.abc import Iterator

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Ints, Reals
from dmplay.core.session import View
from dmplay.core.text import format_count
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    format_forecast_rows,
    format_regret_rows,
    iter_with_and_without_rows,
)
from dmplay.draw.bars import draw_belief_bars, format_bar, format_belief
from dmplay.draw.canvas import Canvas
from dmplay.draw.options import DrawOptions
from dmplay.problems._shared.hidden_chances import SUCCESS
from dmplay.views.protocol import FinishedGame, Lesson

from .rules import Bandit

NEEDS_BELIEF = True  # no board hides the belief
KEYS: dict[str, str] = {}  # digits pull the arms
BAR_COLUMNS = 10
PHRASE = "pull {}"


def _count_pulls(view: View[Bandit]) -> tuple[Ints, Ints]:
    """Return the wins and the pulls `[A]` of each arm."""
    arms = np.array(view.actions, int).reshape(-1)
    is_win = np.array(view.observations[1:], int).reshape(-1) == SUCCESS
    arm_count = len(view.problem.bandits[0])
    return np.bincount(arms[is_win], minlength=arm_count), np.bincount(arms, minlength=arm_count)


def _compute_win_chances(view: View[Bandit]) -> Reals:
    """Return the chance `[A]` of a win of each arm under the belief."""
    return np.asarray(view.belief @ view.problem.success_probabilities)


def iter_boards(view: View[Bandit], options: DrawOptions) -> Iterator[Text]:
    """Yield the table of arms with belief and last pulls, then with less beside the table."""
    arms = view.problem.actions[view.seat].labels
    rows = [
        *format_regret_rows(options, arms),
        *format_forecast_rows(view, options, view.problem.state_names, PHRASE),
    ]
    boards = [_draw_board(view, options, detail) for detail in reversed(range(4))]
    yield from iter_with_and_without_rows(boards, rows, options)


def _draw_board(view: View[Bandit], options: DrawOptions, detail: int) -> Text:
    """Draw a row for each arm; from a detail of 1 the belief, of 2 its heading, of 3 the pulls."""
    canvas = Canvas()
    canvas.write_text(0, 0, "arm  wins  pulls  chance of a win", "dim")
    wins, pulls = _count_pulls(view)
    labels = view.problem.actions[view.seat].labels
    for row, chance in enumerate(_compute_win_chances(view)):
        canvas.write_text(1, row + 1, labels[row], "bold")
        canvas.write_text(5, row + 1, f"{wins[row]:4}  {pulls[row]:5}")
        bar = format_bar(float(chance), BAR_COLUMNS, options.ascii)
        canvas.write_text(18, row + 1, f"{bar} {chance:.3f}", theme.DATA)
    y = len(labels) + 1
    if detail >= 2:
        canvas.write_text(0, y + 1, f"belief: the true chances of {'/'.join(labels)}", "dim")
        y += 2
    if detail >= 1:
        y = draw_belief_bars(canvas, y, view.problem.state_names, view.belief, options)
    if options.revealed_state is not None:
        name = view.problem.state_names[int(options.revealed_state)]
        canvas.write_text(0, y, f"true bandit {name}", theme.TRUTH)
        y += 1
    if detail >= 3:
        canvas.write_text(0, y, f"pulls  {_format_pulls(view, options)}")
    return canvas.to_text()


def _format_pulls(view: View[Bandit], options: DrawOptions) -> str:
    """Return the last pulls that fit, each with a mark for a win or a loss."""
    labels = view.problem.actions[view.seat].labels
    pairs = zip(view.actions, view.observations[1:], strict=True)
    pulls = [f"{labels[int(a)]}{'✓' if int(outcome) == SUCCESS else '✗'}" for a, outcome in pairs]
    while pulls and len(" ".join(pulls)) + 7 > options.width:
        pulls = pulls[1:]
    return " ".join(pulls) or "nothing yet"


def goal_lines(view: View[Bandit]) -> list[str]:
    """Return the goal: wins, and the hidden chances of a win."""
    count = len(view.problem.bandits)
    row = f"one of the {count} rows, hidden, equally likely at first," if count > 1 else "the row"
    return [
        "win often: pull the arm that wins most",
        "a win pays 1, a loss 0",
        f"the true chances are {row} and never change",
    ]


def lesson(view: View[Bandit]) -> Lesson:
    """Return the introduction: the arms, the wins, and the pulls that are left."""
    arms = view.problem.actions[view.seat].labels
    limit = f"one of your {view.turn_limit} pulls" if view.turn_limit else "a turn"
    bandits = format_count(len(view.problem.bandits), "bandit")
    return Lesson(
        f"You pull one of the arms {', '.join(arms)}; you do not know how often each one wins",
        "You want many wins: a win pays 1, a loss nothing",
        f"A pull is free but uses {limit}; each win or loss is a clue to the bandit",
        arms[0],
        "with the bandit {}",
        "bandit {}",
        (
            f"It is one of {bandits}, at first equally likely: "
            f"{', '.join(view.problem.state_names)} (the chances of {', '.join(arms)})",
            "The chances never change",
        ),
    )


def panel_rows(view: View[Bandit]) -> list[tuple[str, str]]:
    """Return the side panel's rows: wins, pulls and the discount."""
    wins, pulls = _count_pulls(view)
    discount = f"{view.problem.discount:.2f}" if view.problem.discount < 1.0 else "none"
    return [("wins", f"{wins.sum()} of {pulls.sum()}"), ("discount", discount)]


def describe_turn(view: View[Bandit]) -> str:
    """Describe the last pull, and the chance of a win of each arm after it."""
    result = "won" if int(view.observation) == SUCCESS else "lost"
    return f"pulled {view.last_action_label}: {result}. {_describe_win_chances(view)}"


def describe_situation(view: View[Bandit]) -> str:
    """Describe the wins so far, the chance of a win of each arm, and the belief."""
    wins, pulls = _count_pulls(view)
    belief = format_belief(view.problem.state_names, view.belief)
    so_far = f"{wins.sum()} of {format_count(int(pulls.sum()), 'pull')} won."
    return f"{so_far} {_describe_win_chances(view)} belief about the bandit: {belief}."


def _describe_win_chances(view: View[Bandit]) -> str:
    """Return the chance of a win of each arm as a sentence."""
    labels = view.problem.actions[view.seat].labels
    chances = zip(labels, _compute_win_chances(view), strict=True)
    return f"chance of a win: {', '.join(f'{label} {chance:.2f}' for label, chance in chances)}."


def describe_end(game: FinishedGame[Bandit]) -> str:
    """Return the number of wins and of pulls."""
    wins = int((game.observations[:, 0] == SUCCESS).sum())
    return f"{game.player} won {wins} of {format_count(len(game.actions), 'pull')}"
