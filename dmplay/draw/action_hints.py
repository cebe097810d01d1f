"""Hints and forecasts in drawings: the regret of each action, and the outcomes of one.

A regret is shown as `best`, or as a negative number: `-0.31`. Its bar is full for the worst action.
Another action without regret than the suggested one is `equal`.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from itertools import chain
from textwrap import wrap

from rich.text import Text

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Problem
from dmplay.core.session import View
from dmplay.core.text import count_probability_decimals
from dmplay.draw import bars
from dmplay.draw.bars import format_likeliest_states
from dmplay.draw.canvas import format_percent, strip_escapes
from dmplay.draw.options import BEST_LABEL, EQUALLY_GOOD_LABEL, DrawOptions, Forecast

MAX_FORECAST_ROWS = 6  # outcomes
MAX_STATE_COLUMNS = 4  # states that have a column each; also the minimum width of such a column
ROW_BAR_COLUMNS = 4  # columns of a bar if all regrets are in one row
INTEGER_THRESHOLD = 999.5  # from this absolute value on, numbers have no decimals
# columns of a number if there is space, and if there is little
MAX_NUMBER_COLUMNS, MIN_NUMBER_COLUMNS = 12, 6


def format_observation(problem: Problem, seat: int, observation: Array) -> str:
    """Format a seat's observation by name, or as a state if the problem hides nothing."""
    if not problem.partially_observable:
        return problem.format_transcript_state(observation)
    return strip_escapes(problem.observations[seat].format_observation(observation))


def list_action_keys(keys: Mapping[str, str], options: DrawOptions) -> list[str]:
    """Return the key of each action as the board shows it."""
    return [options.keys_by_action.get(name, key) for key, name in keys.items()]


def sort_regrets(options: DrawOptions) -> Mapping[int, float]:
    """Return the regret of each legal action, best first; empty without a hint.

    Of equal regrets the suggested action comes first.
    """
    if options.regret is None:
        return {}
    regrets = enumerate(options.regret.tolist())
    legal = {action: value for action, value in regrets if not math.isnan(value)}
    return dict(
        sorted(legal.items(), key=lambda pair: (pair[1], pair[0] != options.suggested_action))
    )


def rank_actions(options: DrawOptions, action_count: int) -> list[int]:
    """Return all actions, best first with a hint and the illegal ones last, else in order."""
    return list(dict.fromkeys([*sort_regrets(options), *range(action_count)]))


def format_regret(options: DrawOptions, action: int, width: int = 6) -> str:
    """Format the regret of an action: `best`, `equal` or `-0.31`; '' if unknown."""
    regrets = sort_regrets(options)
    if action not in regrets:
        return ""
    if regrets[action]:
        return format_significant(-regrets[action], width)
    is_other_suggested = next(iter(regrets)) == options.suggested_action != action
    has_space = len(EQUALLY_GOOD_LABEL) <= width
    return EQUALLY_GOOD_LABEL if is_other_suggested and has_space else BEST_LABEL[:width]


def format_as_loss(regret_text: str) -> str:
    """Return the text of a regret in words: `-0.31` becomes `0.31 less`."""
    number = regret_text.removeprefix("-")
    return regret_text if number == regret_text else f"{number} less"


def format_significant(number: float, width: int) -> str:
    """Format a number with three significant digits, or as many as `width` columns hold."""
    forms = [".3g", ".2g", ".1g", ".2f"] if abs(number) < INTEGER_THRESHOLD else []
    texts = [f"{number:{form}}" for form in [*forms, ".0f"]]
    return next((text for text in texts if len(text) <= width), "#" * width)


def format_regret_bar(options: DrawOptions, action: int, width: int) -> str:
    """Format the regret of an action as a bar, full for the worst action and empty for the best."""
    return _format_padded_bar(options, action, width).rstrip("·.")


def _format_padded_bar(options: DrawOptions, action: int, width: int) -> str:
    """Format the regret of an action as a bar padded to `width` columns."""
    regrets = sort_regrets(options)
    fraction = regrets.get(action, 0.0) / (max(regrets.values(), default=0.0) or 1.0)
    return bars.format_bar(fraction, width, options.ascii)


def format_regret_with_bar(options: DrawOptions, action: int, width: int) -> str:
    """Format the regret of an action as a bar with its number; `best` or `equal` for 0."""
    text = format_regret(options, action, MAX_NUMBER_COLUMNS)
    if text in {"", BEST_LABEL, EQUALLY_GOOD_LABEL}:
        return text
    return f"{_format_padded_bar(options, action, width)} {text}"


def format_regret_rows(options: DrawOptions, names: Sequence[str]) -> list[str]:
    """Format the regrets of all actions as one row, best first, cut to the drawing's width.

    The bars go and the digits become fewer before an action is left out. Return [] without a hint.
    """
    if options.regret is None:
        return []
    actions = sort_regrets(options)
    texts = [format_regret_with_bar(options, action, ROW_BAR_COLUMNS) for action in actions]
    row = _format_hint_row([names[action] for action in actions], texts)
    for columns in (MAX_NUMBER_COLUMNS, MIN_NUMBER_COLUMNS):
        if len(row) > options.width:
            texts = [format_regret(options, action, columns) for action in actions]
            row = _format_hint_row([names[action] for action in actions], texts)
    end = len(row) if len(row) <= options.width else row.rfind("; ", 0, options.width + 2)
    return [row[: max(end, 0)]]


def _format_hint_row(names: Sequence[str], regret_texts: Sequence[str]) -> str:
    """Format actions with their regrets: `hint: best feed; sing -0.5`."""
    return "hint: " + "; ".join(
        f"{BEST_LABEL} {name}" if text == BEST_LABEL else f"{name} {text}"
        for name, text in zip(names, regret_texts, strict=True)
    )


def format_probability(probability: float, width: int) -> str:
    """Format a probability in at most `width` columns: `0.70`, `.70`, `.7` or a star."""
    texts = (
        f"{probability:.2f}",
        f"{probability:.2f}"[probability < 1 :],
        f"{probability:.1f}"[probability < 0.95 :],
    )
    return next((text for text in texts if len(text) <= width), "*")


def format_condition(forecast: Forecast, action_phrase: str) -> str:
    """Format a forecast's action as a condition, `if you push left`; note samples."""
    return f"if you {action_phrase}{' (samples)' * forecast.is_sampled}"


def format_action_condition(
    view: View[Problem], forecast: Forecast, phrase_template: str = "{}"
) -> str:
    """Format the action of a forecast by its name as a condition."""
    return format_condition(
        forecast, phrase_template.format(view.problem.format_action(view.seat, forecast.action))
    )


def format_forecast_rows(
    view: View[Problem],
    options: DrawOptions,
    state_names: Sequence[str],
    phrase_template: str = "{}",
) -> list[str]:
    """Return rows with the probability, observation and next belief of forecast outcomes.

    At most MAX_FORECAST_ROWS outcomes are listed. Return [] without a forecast.
    """
    if options.forecast is None:
        return []
    forecast, problem = options.forecast, view.problem
    probabilities = forecast.probabilities.tolist()
    decimals = count_probability_decimals(probabilities) - 2  # of a percentage
    outcome_rows = [
        f"{format_percent(probability, decimals):>{4 + decimals}} "
        f"{format_observation(problem, view.seat, outcome)}"
        for probability, outcome in zip(probabilities, forecast.outcomes, strict=True)
    ][:MAX_FORECAST_ROWS]
    condition = format_action_condition(view, forecast, phrase_template)
    rows = [f"{condition}:", *outcome_rows]
    if forecast.beliefs is not None:
        rows = [f"{condition}:", "chance", *outcome_rows]
        column_width = max(map(len, rows))
        header = "  likeliest states"
        if len(state_names) <= MAX_STATE_COLUMNS:
            header = _format_columns(state_names, state_names)
        belief_texts = [_format_belief_columns(state_names, belief) for belief in forecast.beliefs]
        pairs = zip(rows, ["  belief then:", header, *belief_texts], strict=False)
        rows = [f"{row:<{column_width}}{tail}".rstrip() for row, tail in pairs]
    more_row = [f"     … {len(forecast.probabilities) - MAX_FORECAST_ROWS} more"]
    return [*rows, *(more_row if len(forecast.probabilities) > MAX_FORECAST_ROWS else [])]


def _format_belief_columns(names: Sequence[str], belief: Reals) -> str:
    """Format a belief in columns below the states' names; of many states the likeliest."""
    if len(names) <= MAX_STATE_COLUMNS:
        return _format_columns(names, [f"{probability:.2f}" for probability in belief])
    return "  " + ", ".join(format_likeliest_states(names, belief)[: MAX_STATE_COLUMNS - 1])


def _format_columns(headings: Sequence[str], cells: Sequence[str]) -> str:
    """Align cells to the right in columns as wide as their headings."""
    pairs = zip(headings, cells, strict=True)
    return "".join(cell.rjust(max(len(heading), MAX_STATE_COLUMNS) + 2) for heading, cell in pairs)


def iter_with_and_without_rows(
    drawings: Iterable[Text], rows: Sequence[str], options: DrawOptions
) -> Iterator[Text]:
    """Yield the drawings with rows below them, then the same drawings without.

    Where a forecast does not fit below the row of a hint, which is the first, it takes its place.
    """
    if not rows:
        return iter(drawings)
    boards = [*drawings]
    wrapped = [wrap(row, max(options.width, 1)) or [""] for row in rows]
    has_both = options.forecast is not None and options.regret is not None
    texts = ["\n" + "\n".join(chain(*parts)) for parts in (wrapped, *[wrapped[1:]] * has_both)]
    return chain((board.copy().append(text) for text in texts for board in boards), boards)
