"""How a problem without a view of its own looks: labels and numbers, digits as keys."""

from collections.abc import Iterator
from textwrap import wrap

from rich.text import Text

from dmplay.chance import Array
from dmplay.core import WAIT_LABEL, Problem
from dmplay.describe import format_count
from dmplay.errors import BadParameter
from dmplay.places import locate_definition
from dmplay.session import DEFAULT_TURN_LIMIT, View
from dmplay.views._advice import (
    format_forecast_rows,
    format_observation,
    format_regret_rows,
    format_regret_with_bar,
    iter_with_and_without_rows,
    rank_actions,
)
from dmplay.views._belief import draw_belief_bars, format_likeliest_states, list_state_probabilities
from dmplay.views.canvas import Canvas, format_signed, sanitize_drawing
from dmplay.views.style import DrawOptions, Lesson

MAX_DESCRIBED_STATES = 3  # states that are told in words
BAR_COLUMNS = 20  # columns of a bar
MAX_TEXT_BESIDE_PICTURE = 40  # characters of what was seen that are told beside a picture of it
MAX_DIGIT_KEYS = 10  # keys
MAX_LISTED_ACTIONS = 40  # actions that have a row each
KEYS: dict[str, str] = {}


def format_last_observation(view: View[Problem]) -> str:
    """What the seat saw last, by name."""
    return format_observation(view.problem, view.seat, view.observation)


def iter_boards(view: View[Problem], options: DrawOptions) -> Iterator[Text]:
    """The picture that the problem brings; else the observation and the belief; then the actions.

    Of a hidden state there is a picture only once it is told, below what the seat saw.
    """
    shown = draw_picture(view, options.revealed_state)
    if shown is None:
        yield from _iter_observation_boards(view, options)
    elif view.problem.partially_observable:
        yield from (
            Text("\n\n").join([drawn, shown]) for drawn in _iter_observation_boards(view, options)
        )
        yield from _iter_observation_boards(view, options)
    else:
        yield from _iter_picture_boards(view, options, shown)


def _iter_observation_boards(view: View[Problem], options: DrawOptions) -> Iterator[Text]:
    """What the seat saw: as the problem draws that, else in words."""
    draw = getattr(view.problem, "draw_observation", None)
    drawn = draw(view.observation) if draw and view.problem.partially_observable else ""
    yield from (
        _iter_picture_boards(view, options, sanitize_drawing(drawn))
        if drawn
        else _iter_text_boards(view, options)
    )


def _iter_picture_boards(
    view: View[Problem], options: DrawOptions, picture: Text
) -> Iterator[Text]:
    """A picture, and the actions below it."""
    labels, below = view.action_labels, Canvas()
    after = format_forecast_rows(view, options, [])
    _draw_actions(view, below, 0, options)
    full = Text("\n\n").join([picture, below.to_text()])
    yield from iter_with_and_without_rows([full], ["", *after] if after else [], options)
    rows = options.height - len(picture.plain.split("\n")) - 1
    named = Text("\n\n").join([picture, _draw_action_names(view, options, rows).to_text()])
    yield from iter_with_and_without_rows(
        [named, picture], [*format_regret_rows(options, labels), *after], options
    )


def _draw_action_names(view: View[Problem], options: DrawOptions, rows: int) -> Canvas:
    """The actions by name alone, in so many rows."""
    canvas = Canvas()
    open_ = (
        (view.action_labels or view.problem.actions[view.seat])
        .describe_actions(view.legal_actions_mask)
        .replace(", ", "  ")
    )
    told = wrap(open_, max(options.width, 20), break_on_hyphens=False, max_lines=max(rows, 1))
    for row, text in enumerate(told):
        canvas.write_text(0, row, text)
    return canvas


def _iter_text_boards(view: View[Problem], options: DrawOptions) -> Iterator[Text]:
    """The observation, the belief where there is one, and the actions with their digits."""
    labels = view.action_labels
    after = format_forecast_rows(
        view,
        options,
        _list_state_names(view) if options.forecast and view.beliefs is not None else [],
    )
    full, small = _draw_observation(view, options), _draw_observation(view, options)
    y = 2
    if view.beliefs is not None:
        most = 2 * BAR_COLUMNS if options.allow_large else BAR_COLUMNS
        y = (
            draw_belief_bars(
                full, y, *list_state_probabilities(view), options, max_bar_columns=most
            )
            + 1
        )
    _draw_actions(view, full, y, options)
    yield from iter_with_and_without_rows([full.to_text()], ["", *after] if after else [], options)
    if len(labels) > MAX_LISTED_ACTIONS:
        seen_ = small.to_text()
        yield Text("\n\n").join(
            [seen_, _draw_action_names(view, options, options.height - 2).to_text()]
        )
    if not labels:
        _draw_actions(view, small, 2, options)
    yield from iter_with_and_without_rows(
        [small.to_text()], [*format_regret_rows(options, labels), *after], options
    )


def draw_picture(view: View[Problem], state: Array | None) -> Text | None:
    """The picture that a problem brings of a state, of one that is hidden only once it is told."""
    draw = getattr(view.problem, "draw_state", None)
    known = state if view.problem.partially_observable else view.observation
    if draw is None or known is None:
        return None
    drawn = draw(known)
    if not isinstance(drawn, str | Text):
        where = locate_definition(type(view.problem), "draw_state")
        raise BadParameter(f"{where} draw_state: got {drawn!r}, expected text, or Text of rich")
    return sanitize_drawing(drawn) if drawn else None


def _draw_observation(view: View[Problem], options: DrawOptions) -> Canvas:
    """A drawing of what was seen."""
    canvas = Canvas()
    what = "seen" if view.problem.partially_observable else "state"
    canvas.write_text(
        0, 0, f"{what}  {format_last_observation(view)}"[: max(options.width, 1)], "bold"
    )
    return canvas


def _draw_actions(view: View[Problem], canvas: Canvas, y: int, options: DrawOptions) -> None:
    """What can be done: the best first, with what each loses, where that is told."""
    labels = view.action_labels
    if not labels:
        canvas.write_text(0, y, view.problem.actions[view.seat].describe_actions())
    shown = [action for action in rank_actions(options, len(labels)) if _is_listed(view, action)]
    longest = max((len(labels[action]) for action in shown), default=0)
    crowd = view.state_action_labels is not None and len(labels) > MAX_DIGIT_KEYS
    bare = crowd or labels[:1] == ("0",)  # whose numbers would be others
    for row, action in enumerate(shown[:MAX_LISTED_ACTIONS], y):
        legal = _is_legal(view, action)
        name = labels[action] if bare else f"{action + 1} {labels[action]}"
        canvas.write_text(0, row, name if legal else f"[{name}]")
        canvas.write_text(
            longest + 6, row, format_regret_with_bar(options, action, BAR_COLUMNS), "yellow"
        )


def _is_legal(view: View[Problem], action: int) -> bool:
    return view.legal_actions_mask is None or bool(view.legal_actions_mask[action])


def _is_listed(view: View[Problem], action: int) -> bool:
    """Whether an action has a row: where it can be done, and else if it has a name and few others.

    Of other states, names that depend on the state say nothing.
    """
    labels = view.action_labels
    waits = labels[action] == WAIT_LABEL and len(view.problem.agents) > 1
    unnamed = view.state_action_labels is not None or len(labels) > MAX_LISTED_ACTIONS
    return _is_legal(view, action) or not (waits or unnamed)


def goal_lines(view: View[Problem]) -> list[str]:
    """The problem in the words of whoever wrote it; without any, what there is to gather."""
    told = _summarize_description(view)
    if told:
        return [told]
    discount = view.problem.discount
    return [
        "gather the largest sum of rewards",
        *(
            [f"in {format_count(view.turn_limit, 'turn')}"]
            if view.turn_limit not in {None, DEFAULT_TURN_LIMIT}
            else []
        ),
        *([f"what comes a turn later counts {discount:g} as much"] if discount < 1 else []),
    ]


def _summarize_description(view: View[Problem]) -> str:
    """The first paragraph that whoever wrote the problem says of it, without its full stop."""
    first, *_ = view.problem.description().split("\n\n")
    return " ".join(first.split()).rstrip(".")


def lesson(view: View[Problem]) -> Lesson:
    """What the problem says of itself, and where its prices are told."""
    problem, first = (
        view.problem,
        _summarize_description(view) or "You want the largest sum of rewards",
    )
    others = len(problem.agents) - 1
    who = f"You are {problem.agents[view.seat]}{f', one of {others + 1}' if others else ''}"
    sees = "the state is hidden" if problem.partially_observable else "you see the state"
    paid = "after every turn" if problem.rewards_observable else "at the end"
    actions = problem.actions[view.seat].describe_actions()
    return Lesson(f"{who}, and {sees}", first, f"You can do {actions}; the reward is told {paid}")


def panel_rows(view: View[Problem]) -> list[tuple[str, str]]:
    """The last reward and the discount; what was done and seen is in the log and on the board."""
    reward = format_signed(view.rewards[-1]) if view.rewards else "-"
    return [("reward", reward), ("discount", f"{view.problem.discount:g}")]


def describe_turn(view: View[Problem]) -> str:
    """The action and what was seen after it."""
    drawn = (
        hasattr(view.problem, "draw_state")
        and len(format_last_observation(view)) > MAX_TEXT_BESIDE_PICTURE
    )
    return f"{'' if drawn else _describe_observation(view)}{_describe_actions(view)}{_describe_belief(view)}"


def _describe_observation(view: View[Problem]) -> str:
    """What was seen last, a sentence; nothing where there is but one state to see."""
    problem = view.problem
    return (
        ""
        if problem.state_count == 1 and not problem.partially_observable
        else f"{format_last_observation(view)}. "
    )


def _describe_actions(view: View[Problem]) -> str:
    """What was done: by the seat, and by all where they see each other's actions.

    In a game of turns only by those whose turn it was.
    """
    problem, mine = view.problem, f"chose {view.last_action_label}."
    if len(problem.agents) == 1:
        return mine
    if view.joint_actions is None:
        return mine if view.last_action_label != WAIT_LABEL else "waited."
    known = problem.action_labels(view.observations[-2])
    names = [
        known[n][action] if known else problem.format_action(n, action)
        for n, action in enumerate(view.joint_actions[-1].tolist())
    ]
    every = zip(problem.agents, names, strict=True)
    return "; ".join(f"{agent} chose {name}" for agent, name in every if name != WAIT_LABEL) + "."


def describe_situation(view: View[Problem]) -> str:
    """What was seen last and what can be done."""
    can = (view.action_labels or view.problem.actions[view.seat]).describe_actions(
        view.legal_actions_mask
    )
    told = (
        f"{_describe_observation(view).rstrip()}{_describe_belief(view)} actions: {can or 'none'}."
    )
    return told.lstrip()


def _list_state_names(view: View[Problem]) -> list[str]:
    """The names of the states."""
    return [view.problem.format_state(s) for s in view.problem.enumerate_states()]


def _describe_belief(view: View[Problem]) -> str:
    """The likeliest states in words, where there is a belief."""
    if view.beliefs is None:
        return ""
    names, likely = list_state_probabilities(view)
    many = len(names) - (len(names) < len(view.belief))  # without what is left
    told = format_likeliest_states(names[:many], likely[:many])
    return f" belief: {', '.join(told[:MAX_DESCRIBED_STATES])}{', ...' if len(told) > MAX_DESCRIBED_STATES else '.'}"
