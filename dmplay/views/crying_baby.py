"""How the crying baby looks: what you heard, and what you may believe."""

from collections.abc import Iterator

from rich.text import Text

from dmplay.problems.crying_baby import CryingBaby
from dmplay.problems.multicaregiver_crying_baby import MulticaregiverCryingBaby
from dmplay.session import View
from dmplay.tabular import Tabular
from dmplay.views._advice import (
    format_forecast_rows,
    format_regret_rows,
    format_regret_with_bar,
    iter_with_and_without_rows,
    list_action_keys,
    rank_actions,
)
from dmplay.views._belief import draw_belief_bars, draw_true_state, format_belief, format_sparkline
from dmplay.views._scale import format_signed_fixed
from dmplay.views.canvas import Canvas
from dmplay.views.generic import format_last_observation
from dmplay.views.style import DrawOptions, Lesson

CaregiverProblem = CryingBaby | MulticaregiverCryingBaby
MAX_HISTORY_TURNS = 20  # turns of it that are drawn
WIDE_BAR_COLUMNS, REGRET_BAR_COLUMNS = (
    40,
    10,
)  # columns of a bar where there is room, and of one of a loss
KEYS = {"f": "feed", "s": "sing", "i": "ignore"}


def iter_boards(view: View[CaregiverProblem], options: DrawOptions) -> Iterator[Text]:
    """The last observation, the belief as bars, how it moved; what each action costs."""
    if options.allow_large:
        yield _draw_large_board(view, options)
    after = format_forecast_rows(view, options, view.problem.state_names)
    told = format_regret_rows(options, list_action_keys(KEYS, options)) or [
        _format_expected_rewards(view, options)
    ] * (options.allow_large and not view.end_reason)
    yield from iter_with_and_without_rows(
        _iter_small_boards(view, options), [*told, *after], options
    )


def _iter_small_boards(view: View[CaregiverProblem], options: DrawOptions) -> Iterator[Text]:
    """What was heard and the belief, with its history and without."""
    for history in (True, False):
        canvas = Canvas()
        y = _draw_observation_and_belief(view, canvas, options)
        if history:
            y = _draw_belief_history(view, canvas, y, options)
        draw_true_state(canvas, y, view.problem.state_names, options)
        yield canvas.to_text()


def _draw_observation_and_belief(
    view: View[CaregiverProblem], canvas: Canvas, options: DrawOptions, max_bar_columns: int = 20
) -> int:
    """What was heard and the bars; the row after them."""
    canvas.write_text(0, 0, "heard  ")
    canvas.write_text(
        7,
        0,
        format_last_observation(view),
        "bold yellow" if format_last_observation(view) == "crying" else "bold",
    )
    return draw_belief_bars(
        canvas, 2, view.problem.state_names, view.belief, options, max_bar_columns=max_bar_columns
    )


def _draw_belief_history(
    view: View[CaregiverProblem], canvas: Canvas, y: int, options: DrawOptions
) -> int:
    """How the worst belief moved; the row after it."""
    title = f"history of {view.problem.state_names[-1]} "
    room = max(min(MAX_HISTORY_TURNS, options.width - len(title)), 1)
    canvas.write_text(0, y, title, "dim")
    worst = [float(b[-1]) for b in (view.beliefs or ())[-room:]]
    moved = format_sparkline(worst, options.ascii).ljust(room, " " if options.ascii else "·")
    canvas.write_text(len(title), y, moved, "cyan")
    return y + 1


def _draw_large_board(view: View[CaregiverProblem], options: DrawOptions) -> Text:
    """Everything, with the reward to expect of each action, what it loses and what crying tells."""
    canvas = Canvas()
    y = (
        _draw_belief_history(
            view,
            canvas,
            _draw_observation_and_belief(view, canvas, options, WIDE_BAR_COLUMNS),
            options,
        )
        + 1
    )
    _draw_expected_rewards(view, canvas, y, options)
    y += len(KEYS) + 2
    for row in format_forecast_rows(
        view, options, view.problem.state_names
    ) or _describe_cry_probabilities(view):
        canvas.write_text(0, y, row, "" if options.forecast else "dim")
        y += 1
    draw_true_state(canvas, y, view.problem.state_names, options)
    return canvas.to_text()


def _draw_expected_rewards(
    view: View[CaregiverProblem], canvas: Canvas, y: int, options: DrawOptions
) -> None:
    """The reward to expect of each action at once: of hunger under the belief, and of the effort.

    The best first, with what each loses in the end, where that is told.
    """
    heads = "expected reward  hunger  effort     sum"
    canvas.write_text(0, y, heads, "dim")
    canvas.write_text(len(heads) + 2, y, "in the end" if options.regret is not None else "", "dim")
    hunger = float(view.belief[-1]) * view.problem.hungry_reward
    keys, labels = list_action_keys(KEYS, options), view.problem.actions[view.seat].labels
    for row, action in enumerate(rank_actions(options, len(keys)), y + 1):
        effort = view.problem.action_rewards[view.seat][action]
        canvas.write_text(0, row, f"{keys[action]} {labels[action]}")
        each = "".join(
            f"{format_signed_fixed(value, 2):>8}" for value in (hunger, effort, hunger + effort)
        )
        canvas.write_text(15, row, each)
        canvas.write_text(
            len(heads) + 2,
            row,
            format_regret_with_bar(options, action, REGRET_BAR_COLUMNS),
            "yellow",
        )


def _format_expected_rewards(view: View[CaregiverProblem], options: DrawOptions) -> str:
    """The reward to expect of each action at once, in a row."""
    hunger = float(view.belief[-1]) * view.problem.hungry_reward
    each = zip(list_action_keys(KEYS, options), view.problem.action_rewards[view.seat], strict=True)
    return "  ".join(
        ["pays", *(f"{key} {format_signed_fixed(hunger + effort, 2)}" for key, effort in each)]
    )


def _describe_cry_probabilities(view: View[CaregiverProblem]) -> list[str]:
    """How often each baby cries, sung to or not."""
    problem = view.problem
    hungry = _format_cry_probability(problem.cries_hungry, problem.cries_hungry_sung)
    sated = _format_cry_probability(problem.cries_sated, problem.cries_sated_sung)
    return [
        f"a hungry baby cries {hungry}",
        f"a sated one {sated}; unfed, {problem.becomes_hungry:.0%} get hungry",
    ]


def _format_cry_probability(without_song: float, with_song: float) -> str:
    """A probability without a song and with one."""
    return (
        f"{without_song:.0%}, sung to {with_song:.0%}"
        if without_song != with_song
        else f"{without_song:.0%}, sung to or not"
    )


def goal_lines(view: View[CaregiverProblem]) -> list[str]:
    """What hunger and each effort cost this seat, and what crying tells."""
    problem = view.problem
    feeding, singing, _ = problem.action_rewards[view.seat]
    return [
        "keep the baby sated",
        f"hunger costs {-problem.hungry_reward:g}",
        f"feeding {-feeding:g}",
        f"singing {-singing:g}",
        "only its crying tells",
    ]


def lesson(view: View[CaregiverProblem]) -> Lesson:
    """Who cares for whom, what is to be wanted, and what each action costs."""
    problem = view.problem
    feeding, singing, ignoring = (
        f"{0.0 - effort:g}" for effort in problem.action_rewards[view.seat]
    )
    alone = len(problem.agents) == 1
    who = "" if alone else f"{problem.agents[view.seat]}, one of two who cannot talk; you "
    return Lesson(
        f"You {'are ' * (not alone)}{who}care for a baby that is hungry or sated; you only hear "
        "whether it cries",
        "You want it sated: feeding sates it for sure, a song makes its crying tell you more",
        f"A turn that finds it hungry costs {-problem.hungry_reward:g}, feeding {feeding}, "
        f"singing {singing}, ignoring {ignoring}",
        "feed",
    )


def panel_rows(view: View[Tabular]) -> list[tuple[str, str]]:
    """What is not on the board; the reward is hidden until the end, as it betrays the state."""
    reward = f"{view.rewards[-1]:g}" if view.rewards else "hidden"
    return [("reward", reward), ("discount", f"{view.problem.discount:.2f}")]


def describe_turn(view: View[CaregiverProblem]) -> str:
    """What you did, what you heard, what to believe."""
    return (
        f"{format_last_observation(view)}. chose {view.last_action_label}. {describe_belief(view)}"
    )


def describe_situation(view: View[CaregiverProblem]) -> str:
    """The last observation and the belief."""
    return f"heard {format_last_observation(view)}. {describe_belief(view)}"


def describe_belief(view: View[CaregiverProblem]) -> str:
    """The belief in words."""
    return f"belief: {format_belief(view.problem.state_names, view.belief)}."
