"""What a hint and a what-if add to a drawing: what each action loses, what one may bring.

A loss is told as `best`, or with its sign: `-0.31`; a bar of it is full for the worst action. What
loses nothing though another is advised is `as good`.
"""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import chain
from textwrap import wrap

from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.core import Problem
from dmplay.session import View
from dmplay.views import _belief
from dmplay.views._belief import format_likeliest_states
from dmplay.views.canvas import format_percent, strip_escapes
from dmplay.views.style import (
    BEST_LABEL,
    EQUALLY_GOOD_LABEL,
    REGRET_TOLERANCE,
    DrawOptions,
    Forecast,
)

MAX_FORECAST_ROWS = 6  # outcomes that are told
MAX_STATE_COLUMNS = 4  # states that have a column each
ROW_BAR_COLUMNS = 4  # columns of a bar where all losses stand in one row
INTEGER_THRESHOLD = 999.5  # from which on a number has no digits but whole ones
MAX_NUMBER_COLUMNS, MIN_NUMBER_COLUMNS = (
    12,
    6,
)  # columns of a number where there is room, and where there is little


def format_observation(problem: Problem, seat: int, observation: Array) -> str:
    """What a seat sees, by name."""
    if not problem.partially_observable:
        return problem.format_transcript_state(observation)
    return strip_escapes(problem.observations[seat].format_observation(observation))


def list_action_keys(keys: Mapping[str, str], options: DrawOptions) -> list[str]:
    """The key of each action, as a board shows it."""
    return [options.keys_by_action.get(name, key) for key, name in keys.items()]


def sort_regrets(options: DrawOptions) -> Mapping[int, float]:
    """What each legal action loses, the best first."""
    return (
        {}
        if options.regret is None
        else _sort_regrets_cached((*options.regret.tolist(),), options.suggested_action)
    )


@lru_cache(16)
def _sort_regrets_cached(
    regret: Sequence[float], suggested_action: float | None
) -> Mapping[int, float]:
    """The same, which every row of a drawing asks for; nobody writes into it."""
    legal = {
        a: loss * (loss > REGRET_TOLERANCE) for a, loss in enumerate(regret) if not math.isnan(loss)
    }
    return dict(sorted(legal.items(), key=lambda pair: (pair[1], pair[0] != suggested_action)))


def rank_actions(options: DrawOptions, action_count: int) -> list[int]:
    """So many actions, the best first where regrets are given and the illegal last; else as is."""
    return list(dict.fromkeys([*sort_regrets(options), *range(action_count)]))


def format_regret(options: DrawOptions, action: int, width: int = 6) -> str:
    """`best`, or what is lost: `-0.31`; nothing where it is not known."""
    losses = sort_regrets(options)
    if action not in losses:
        return ""
    if losses[action]:
        return format_significant(-losses[action], width)
    advised = any(not loss and one == options.suggested_action for one, loss in losses.items())
    equal = advised and action != options.suggested_action and len(EQUALLY_GOOD_LABEL) <= width
    return EQUALLY_GOOD_LABEL if equal else BEST_LABEL[:width]


def format_significant(number: float, width: int) -> str:
    """A number in three digits, or in as many as so few columns hold."""
    forms = [".3g", ".2g", ".1g", ".2f"] if abs(number) < INTEGER_THRESHOLD else []
    told = [f"{number:{form}}" for form in [*forms, ".0f"]]
    return next((one for one in told if len(one) <= width), "#" * width)


def format_regret_bar(options: DrawOptions, action: int, width: int) -> str:
    """What is lost as a bar, a full one for the worst action, none for the best."""
    return _format_padded_bar(options, action, width).rstrip("·.")


def _format_padded_bar(options: DrawOptions, action: int, width: int) -> str:
    losses = sort_regrets(options)
    share = losses.get(action, 0.0) / (max(losses.values(), default=0.0) or 1.0)
    return _belief.format_bar(share, width, options.ascii)


def format_regret_with_bar(options: DrawOptions, action: int, width: int) -> str:
    """A bar of what an action loses against the best, with the number; `best` where nothing."""
    told = format_regret(options, action, MAX_NUMBER_COLUMNS)
    return (
        told
        if told in {"", BEST_LABEL, EQUALLY_GOOD_LABEL}
        else f"{_format_padded_bar(options, action, width)} {told}"
    )


def format_regret_rows(options: DrawOptions, names: Sequence[str]) -> list[str]:
    """What each action loses in one row, the best first, as many as it holds; none if not asked.

    All of them without bars, or in fewer digits, rather than some with.
    """
    if options.regret is None:
        return []
    row = _join_hint_row(
        f"{names[action]} {format_regret_with_bar(options, action, ROW_BAR_COLUMNS)}"
        for action in sort_regrets(options)
    )
    for columns in (MAX_NUMBER_COLUMNS, MIN_NUMBER_COLUMNS):
        if len(row) > options.width:
            row = _join_hint_row(
                f"{names[action]} {format_regret(options, action, columns)}"
                for action in sort_regrets(options)
            )
    return [
        row if len(row) <= options.width else row[: max(row.rfind("  ", 0, options.width + 2), 0)]
    ]


def _join_hint_row(parts: Iterable[str]) -> str:
    return "  ".join(["hint", *parts])


def format_probability(probability: float, width: int) -> str:
    """A probability in so many columns: `0.70`, `.70`, `.7` or a star."""
    texts = (
        f"{probability:.2f}",
        f"{probability:.2f}"[probability < 1 :],
        f"{probability:.1f}"[probability < 0.95 :],
    )
    return next((text for text in texts if len(text) <= width), "*")


def format_condition(forecast: Forecast, action_phrase: str) -> str:
    """The action of an outlook as a condition: `if you push left`; whether it is from samples."""
    return f"if you {action_phrase}{' (samples)' * forecast.is_sampled}"


def format_action_condition(
    view: View[Problem], forecast: Forecast, phrase_template: str = "{}"
) -> str:
    """The action of an outlook by its name as a condition."""
    return format_condition(
        forecast, phrase_template.format(view.problem.format_action(view.seat, forecast.action))
    )


def format_forecast_rows(
    view: View[Problem],
    options: DrawOptions,
    state_names: Sequence[str],
    phrase_template: str = "{}",
) -> list[str]:
    """How likely each outcome of the action in question is, what is seen, what then to believe."""
    if options.forecast is None:
        return []
    outlook, problem = options.forecast, view.problem
    told = [
        f"{format_percent(float(chance)):>4} {format_observation(problem, view.seat, seen)}"
        for chance, seen in zip(outlook.probabilities, outlook.outcomes, strict=True)
    ][:MAX_FORECAST_ROWS]
    head = format_action_condition(view, outlook, phrase_template)
    rows = [head, *told]
    if outlook.beliefs is not None:
        stub = max(map(len, rows))
        heads = (
            _format_columns(state_names, state_names)
            if len(state_names) <= MAX_STATE_COLUMNS
            else ""
        )
        then = [_format_belief_columns(state_names, belief) for belief in outlook.beliefs]
        pairs = zip(rows, [heads, *then], strict=False)
        rows = [f"{row:<{stub}}{tail}".rstrip() for row, tail in pairs]
    more = [f"     … {len(outlook.probabilities) - MAX_FORECAST_ROWS} more"]
    return [*rows, *(more if len(outlook.probabilities) > MAX_FORECAST_ROWS else [])]


def _format_belief_columns(names: Sequence[str], belief: Reals) -> str:
    """A belief in columns under the names of the states; of many states the likeliest."""
    if len(names) <= MAX_STATE_COLUMNS:
        return _format_columns(names, [f"{share:.2f}" for share in belief])
    return "  " + ", ".join(format_likeliest_states(names, belief)[: MAX_STATE_COLUMNS - 1])


def _format_columns(names: Sequence[str], cells: Sequence[str]) -> str:
    pairs = zip(names, cells, strict=True)
    return "".join(cell.rjust(max(len(name), MAX_STATE_COLUMNS) + 2) for name, cell in pairs)


def iter_with_and_without_rows(
    drawings: Iterable[Text], rows: Sequence[str], options: DrawOptions
) -> Iterator[Text]:
    """The drawings with these rows below; then, for where there is no room, without."""
    if not rows:
        return iter(drawings)
    kept = [*drawings]
    folded = [part for row in rows for part in wrap(row, max(options.width, 1)) or [""]]
    tail = "\n" + "\n".join(folded)
    return chain((drawn.copy().append(tail) for drawn in kept), kept)
