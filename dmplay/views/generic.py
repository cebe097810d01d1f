"""The default view, for problems without a view module: labels, numbers and digit keys."""

from collections.abc import Iterator
from textwrap import wrap

from rich.text import Text

from dmplay.core.arrays import Array
from dmplay.core.problem import WAIT_LABEL, Problem
from dmplay.core.session import DEFAULT_TURN_LIMIT, View
from dmplay.core.text import format_count
from dmplay.core.user_code_locations import locate_definition
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    format_forecast_rows,
    format_observation,
    format_regret_rows,
    format_regret_with_bar,
    iter_with_and_without_rows,
    rank_actions,
)
from dmplay.draw.bars import draw_belief_bars, format_likeliest_states, list_state_probabilities
from dmplay.draw.canvas import Canvas, format_signed, sanitize_drawing
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter
from dmplay.formats.file_problems import FileProblem
from dmplay.views.protocol import FinishedGame, Lesson

MIN_ALIVE_PROBABILITY = 1e-9  # of a state in which an action still matters
MAX_DESCRIBED_STATES = 3  # maximum states in a description of the belief
BAR_COLUMNS = 20  # columns of a bar
# longest observation, in characters, that is described if the problem draws pictures
MAX_TEXT_BESIDE_PICTURE = 40
MAX_DIGIT_KEYS = 10  # digit keys
MAX_LISTED_ACTIONS = 40  # maximum actions listed one per row
KEYS: dict[str, str] = {}


def format_last_observation(view: View[Problem]) -> str:
    """Return the seat's last observation as text."""
    return format_observation(view.problem, view.seat, view.observation)


def iter_boards(view: View[Problem], options: DrawOptions) -> Iterator[Text]:
    """Yield the boards, the largest first.

    If the problem draws a picture of the state, the picture replaces the observation and the
    belief. The picture of a hidden state is drawn only if `options.revealed_state` is set; it comes
    below the observation.
    """
    state_picture = draw_picture(view, options.revealed_state)
    if state_picture is not None and not view.problem.partially_observable:
        yield from _iter_picture_boards(view, options, state_picture)
        return
    if state_picture is not None:
        for board in _iter_observation_boards(view, options):
            yield Text("\n\n").join([board, state_picture])
    yield from _iter_observation_boards(view, options)


def _iter_observation_boards(view: View[Problem], options: DrawOptions) -> Iterator[Text]:
    """Yield boards of the observation, drawn by the problem's `draw_observation` if it has one."""
    draw_observation = getattr(view.problem, "draw_observation", None)
    drawing = ""
    if draw_observation and view.problem.partially_observable:
        drawing = draw_observation(view.observation)
    if drawing:
        yield from _iter_picture_boards(view, options, sanitize_drawing(drawing))
    else:
        yield from _iter_text_boards(view, options)


def _iter_picture_boards(
    view: View[Problem], options: DrawOptions, picture: Text
) -> Iterator[Text]:
    """Yield a picture with actions in rows below it, then with action names only, then alone."""
    labels, action_canvas = view.action_labels, Canvas()
    forecast_rows = format_forecast_rows(view, options, [])
    _draw_actions(view, action_canvas, 0, options)
    with_rows = Text("\n\n").join([picture, action_canvas.to_text()])
    yield from iter_with_and_without_rows(
        [with_rows], ["", *forecast_rows] if forecast_rows else [], options
    )
    remaining_rows = options.height - len(picture.plain.split("\n")) - 1
    with_names = Text("\n\n").join(
        [picture, _wrap_legal_action_names(view, options, remaining_rows)]
    )
    yield from iter_with_and_without_rows(
        [with_names, picture], [*format_regret_rows(options, labels), *forecast_rows], options
    )


def _wrap_legal_action_names(view: View[Problem], options: DrawOptions, rows: int) -> Text:
    """Return the names of the legal actions, wrapped into `rows` rows; the rest is cut off."""
    names = _format_legal_actions(view).replace(", ", "  ")
    canvas, columns = Canvas(), max(options.width, 20)
    canvas.write_rows(0, wrap(names, columns, break_on_hyphens=False, max_lines=max(rows, 1)))
    return canvas.to_text()


def _format_legal_actions(view: View[Problem]) -> str:
    """Return the legal actions in one line, separated by commas."""
    actions = view.action_labels or view.problem.actions[view.seat]
    return actions.describe_actions(view.legal_actions_mask)


def _iter_text_boards(view: View[Problem], options: DrawOptions) -> Iterator[Text]:
    """Yield boards as text: the observation, the bars of a belief if any, and the actions."""
    labels = view.action_labels
    state_names: list[str] = []
    if options.forecast and view.beliefs is not None:
        state_names = [view.problem.format_state(s) for s in view.problem.enumerate_states()]
    forecast_rows = format_forecast_rows(view, options, state_names)
    full_canvas, small_canvas = _draw_observation(view, options), _draw_observation(view, options)
    y = 2
    if view.beliefs is not None:
        bars, columns = list_state_probabilities(view), BAR_COLUMNS * (1 + options.allow_large)
        y = draw_belief_bars(full_canvas, y, *bars, options, max_bar_columns=columns) + 1
    _draw_actions(view, full_canvas, y, options)
    yield from iter_with_and_without_rows(
        [full_canvas.to_text()], ["", *forecast_rows] if forecast_rows else [], options
    )
    if len(labels) > MAX_LISTED_ACTIONS:
        observation_text = small_canvas.to_text()
        names = _wrap_legal_action_names(view, options, options.height - 2)
        yield Text("\n\n").join([observation_text, names])
    if not labels:
        _draw_actions(view, small_canvas, 2, options)
    yield from iter_with_and_without_rows(
        [small_canvas.to_text()], [*format_regret_rows(options, labels), *forecast_rows], options
    )


def draw_picture(view: View[Problem], state: Array | None) -> Text | None:
    """Return the problem's own picture of a state, or None if it draws none.

    A hidden state is drawn only if `state` is given. Raise BadParameter if the problem's
    `draw_state` returns anything but a string or a rich Text.
    """
    draw_state = getattr(view.problem, "draw_state", None)
    visible_state = state if view.problem.partially_observable else view.observation
    if draw_state is None or visible_state is None:
        return None
    drawing = draw_state(visible_state)
    if not isinstance(drawing, str | Text):
        location = locate_definition(type(view.problem), "draw_state")
        raise BadParameter(
            f"{location} draw_state: got {drawing!r}, expected text, or Text of rich"
        )
    return sanitize_drawing(drawing) if drawing else None


def _draw_observation(view: View[Problem], options: DrawOptions) -> Canvas:
    """Return a canvas with the last observation, or the state if it is not hidden, in one row."""
    canvas = Canvas()
    heading = "observed" if view.problem.partially_observable else "state"
    text = f"{heading}  {format_last_observation(view)}"
    canvas.write_text(0, 0, text[: max(options.width, 1)], "bold")
    return canvas


def _draw_actions(view: View[Problem], canvas: Canvas, y: int, options: DrawOptions) -> None:
    """Draw the actions from row `y` on, the best first with their regrets if there are hints.

    Illegal actions are in brackets. At most MAX_LISTED_ACTIONS actions are drawn.
    """
    labels = view.action_labels
    if not labels:
        canvas.write_text(0, y, view.problem.actions[view.seat].describe_actions())
    ranked_actions = rank_actions(options, len(labels))
    listed_actions = [action for action in ranked_actions if _has_action_row(view, action)]
    label_columns = max((len(labels[action]) for action in listed_actions), default=0)
    has_too_many = view.state_action_labels is not None and len(labels) > MAX_DIGIT_KEYS
    # labels that count from 0 would contradict the digit keys
    without_numbers = has_too_many or labels[:1] == ("0",)
    for row, action in enumerate(listed_actions[:MAX_LISTED_ACTIONS], y):
        legal = _is_legal(view, action)
        name = labels[action] if without_numbers else f"{action + 1} {labels[action]}"
        canvas.write_text(0, row, name if legal else f"[{name}]")
        regret = format_regret_with_bar(options, action, BAR_COLUMNS)
        canvas.write_text(label_columns + 6, row, regret, theme.REGRET)


def _is_legal(view: View[Problem], action: int) -> bool:
    """Return whether an action is legal now."""
    return view.legal_actions_mask is None or bool(view.legal_actions_mask[action])


def _has_action_row(view: View[Problem], action: int) -> bool:
    """Return whether an action has a row: every legal action and some illegal ones.

    An illegal action has one if labels do not depend on the state, there are at most
    MAX_LISTED_ACTIONS actions, and it is not the wait action of a problem with several agents.
    """
    labels = view.action_labels
    is_wait_action = labels[action] == WAIT_LABEL and len(view.problem.agents) > 1
    omits_illegal = view.state_action_labels is not None or len(labels) > MAX_LISTED_ACTIONS
    return _is_legal(view, action) or not (is_wait_action or omits_illegal)


def goal_lines(view: View[Problem]) -> list[str]:
    """Return the problem's own description as the goal, or a generic goal if it has none."""
    summary = _summarize_description(view)
    if summary:
        return [summary]
    clauses, discount = ["get the largest sum of rewards"], view.problem.discount
    if view.turn_limit not in {None, DEFAULT_TURN_LIMIT}:
        clauses.append(f"in {format_count(view.turn_limit, 'turn')}")
    if discount < 1:
        clauses.append(f"a reward one turn later counts {discount:g} times as much")
    return clauses


def _summarize_description(view: View[Problem]) -> str:
    """Return the first paragraph of the problem's description, without its final full stop."""
    paragraph, *_ = view.problem.description().split("\n\n")
    return " ".join(paragraph.split()).rstrip(".")


def lesson(view: View[Problem]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and actions."""
    problem = view.problem
    objective = _summarize_description(view) or "You want the largest sum of rewards"
    other_count = len(problem.agents) - 1
    others = f", one of {other_count + 1} agents" if other_count else ""
    visibility = "the state is hidden" if problem.partially_observable else "you see the state"
    reward_time = "after every turn" if problem.rewards_observable else "at the end"
    actions = problem.actions[view.seat].describe_actions()
    return Lesson(
        f"You are {problem.agents[view.seat]}{others}, and {visibility}",
        objective,
        f"Your actions are {actions}; you see the reward {reward_time}",
    )


def panel_rows(view: View[Problem]) -> list[tuple[str, str]]:
    """Return the panel rows: the last reward and the discount.

    Actions and observations are not repeated, as the log and the board show them.
    """
    reward = format_signed(view.rewards[-1]) if view.rewards else "-"
    return [
        ("reward", reward),
        ("discount", f"{view.problem.discount:g}" if view.problem.discount < 1.0 else "none"),
    ]


def describe_turn(view: View[Problem]) -> str:
    """Return a description of the last turn: the actions, the observation and the belief.

    A long observation is left out if the problem draws pictures.
    """
    is_long = len(format_last_observation(view)) > MAX_TEXT_BESIDE_PICTURE
    omits_observation = hasattr(view.problem, "draw_state") and is_long
    observation = "" if omits_observation else _describe_observation(view).rstrip()
    kind = "observed" if view.problem.partially_observable else "state"
    result = observation and f" {kind} {observation}"
    return f"{_describe_actions(view)}{result}{_describe_belief(view)}{_describe_dead_end(view)}"


def _describe_dead_end(view: View[Problem]) -> str:
    """Return a sentence if the seat knows that no action matters any more, else ''."""
    problem = view.problem
    if not isinstance(problem, FileProblem) or view.beliefs is None:
        return ""
    alive = float(view.belief[~problem.absorbing_states_mask].sum())
    return " nothing can change any more, and every reward is 0." * (alive < MIN_ALIVE_PROBABILITY)


def _describe_observation(view: View[Problem]) -> str:
    """Return the last observation as a sentence, or '' if a visible state is the only one."""
    problem = view.problem
    if problem.state_count == 1 and not problem.partially_observable:
        return ""
    return f"{format_last_observation(view)}. "


def _describe_actions(view: View[Problem]) -> str:
    """Return the last actions as a sentence: the seat's own, or those of all agents if visible.

    Agents that waited for their turn are left out.
    """
    problem, own_sentence = view.problem, f"chose {view.last_action_label}."
    if len(problem.agents) == 1:
        return own_sentence
    if view.joint_actions is None:
        return own_sentence if view.last_action_label != WAIT_LABEL else "waited."
    labels_by_seat = problem.action_labels(view.observations[-2])
    names = [
        labels_by_seat[n][action] if labels_by_seat else problem.format_action(n, action)
        for n, action in enumerate(view.joint_actions[-1].tolist())
    ]
    pairs = zip(problem.agents, names, strict=True)
    choices = [f"{agent} chose {name}" for agent, name in pairs if name != WAIT_LABEL]
    return f"{'; '.join(choices)}."


def describe_situation(view: View[Problem]) -> str:
    """Return a description of the last observation, the belief and the legal actions."""
    facts = f"{_describe_observation(view).rstrip()}{_describe_belief(view)}"
    return f"{facts} actions: {_format_legal_actions(view) or 'none'}.".lstrip()


def _describe_belief(view: View[Problem]) -> str:
    """Return the likeliest states as a sentence, or '' if there is no belief."""
    if view.beliefs is None:
        return ""
    names, probabilities = list_state_probabilities(view)
    # without the entry of the other states
    state_count = len(names) - (len(names) < len(view.belief))
    parts = format_likeliest_states(names[:state_count], probabilities[:state_count])
    end = ", ..." if len(parts) > MAX_DESCRIBED_STATES else "."
    return f" belief: {', '.join(parts[:MAX_DESCRIBED_STATES])}{end}"


def describe_end(game: FinishedGame[Problem]) -> str:
    """Say whether the game was played to its end, or for all its turns."""
    end = "reached the end of the game in" if game.is_terminal else "played all"
    return f"{game.player} {end} {game.turns}".replace("all 1 turn", "the only turn")
