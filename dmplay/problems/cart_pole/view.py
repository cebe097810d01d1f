"""The view of cart-pole: the cart on its track, the pole to scale, and the limits of both.

      ●
     ╱       a row is as high as two columns are wide
     │
   ┌─┴─┐
  →└o─o┘     the arrow is the last push
╋━━━━┷━━━━╋  the ends are the limits
"""

import math
from collections.abc import Iterator
from typing import NamedTuple

from rich.text import Text

from dmplay.core.arrays import Array
from dmplay.core.session import View
from dmplay.core.text import format_count
from dmplay.draw import theme
from dmplay.draw.action_hints import MAX_NUMBER_COLUMNS, format_action_condition, format_regret
from dmplay.draw.canvas import Canvas, draw_text_rows
from dmplay.draw.number_line import NumberLine, draw_gauge, draw_scale_labels, format_signed_fixed
from dmplay.draw.options import BEST_LABEL, DrawOptions
from dmplay.views.protocol import Clock, FinishedGame, Lesson

from .rules import CartPole

KEYS = {
    "left": "left", "right": "right", "h": "left", "l": "right", "a": "left", "d": "right",
}  # fmt: skip
# position, speed, angle and swing, in one row or in two
LONG_STATE, SHORT_STATE = "x {} m  v {} m/s  th {} deg  om {} deg/s", "x {} v {} th {} om {}"
NAMED_STATE = "position {} m  speed {} m/s\nangle {} deg  swing {} deg/s"
UPRIGHT = "the pole still stands"  # outcome if the cart is on the track, too
COLUMNS_PER_ROW = 2  # columns as long as a row is high
SIDES = ("left", "right")
MAX_DANGER_TURNS = 12  # in which a pole passes its limit at its present swing
MAX_UPRIGHT_SLOPE = 0.75  # columns per row; a pole of one glyph that leans less is drawn upright
MAX_DRAWN_LEAN_DEGREES = 85.0  # degrees; a pole that leans more is drawn at this angle


def clock(view: View[CartPole]) -> Clock:
    """Return the clock of real time; pushes that alternate stand for no push."""
    return Clock(1.0 / view.problem.dt, ("left", "right"))


class CartPoleLayout(NamedTuple):
    """A size of drawing: its columns, rows for the pole, half the cart's width, and scales."""

    width: int
    pole_rows: int
    half_cart_columns: int = 2
    has_scales: bool = False
    has_straight_pole: bool = False  # The pole uses a single glyph and all rows.


MAX_LAYOUT = CartPoleLayout(161, 30)  # largest columns and pole rows of a drawing
LAYOUTS = (
    CartPoleLayout(121, 13, 4, True),
    CartPoleLayout(61, 6, 2, True),
    CartPoleLayout(61, 5),
    CartPoleLayout(39, 4),
    CartPoleLayout(39, 2),
)
LOW_LAYOUT = CartPoleLayout(39, 3)  # extra layout on a screen, where the numbers take two rows


def _list_layouts(options: DrawOptions) -> list[CartPoleLayout]:
    """Return the layouts to try, largest first.

    On a screen, a layout that fills the space beside the panel comes before those of a transcript.
    """
    if not options.allow_large:
        return [*LAYOUTS]
    layouts = [*LAYOUTS[:-1], LOW_LAYOUT, LAYOUTS[-1]]
    width = min(options.columns_beside_panel, MAX_LAYOUT.width)
    pole_rows = min(options.height - 8, MAX_LAYOUT.pole_rows)
    if width >= LAYOUTS[1].width and pole_rows >= LAYOUTS[1].pole_rows:
        half_cart_columns = 4 if width > 100 else 2
        layouts.insert(0, CartPoleLayout(width - 1 + width % 2, pole_rows, half_cart_columns, True))
    return [layout._replace(has_straight_pole=True) for layout in layouts]


class CartState(NamedTuple):
    """The state of the cart in metres, degrees and seconds, and the limits."""

    x: float
    v: float
    theta: float
    omega: float
    x_limit: float
    theta_limit: float
    is_off_track: bool  # The cart has left its track.
    has_fallen: bool  # The pole leans beyond its limit.


def _make_cart_state(view: View[CartPole] | FinishedGame[CartPole], state: Array) -> CartState:
    """Convert a state from radians to degrees and add the limits."""
    x, v, theta, omega = map(float, state)
    limits = view.problem.x_limit, view.problem.theta_limit
    is_off_track, has_fallen = abs(x) > limits[0], abs(theta) > limits[1] * 2 * math.pi / 360
    angles = math.degrees(theta), math.degrees(omega)
    return CartState(x, v, *angles, *limits, is_off_track, has_fallen)


def iter_boards(view: View[CartPole], options: DrawOptions) -> Iterator[Text]:
    """Yield the cart in five sizes, up to seven on a screen, then its numbers in one line."""
    cart, problem = _make_cart_state(view, view.observation), view.problem
    forecast_carts = []
    if options.forecast:
        forecast_carts = [_make_cart_state(view, state) for state in options.forecast.outcomes]
    for layout in _list_layouts(options):
        canvas = Canvas()
        margin = layout.half_cart_columns + 1
        scale = NumberLine(-cart.x_limit, cart.x_limit, margin, layout.width - 1 - margin)
        # A cart that has left its track is drawn one column beyond the end.
        cart_column = scale.column_of(cart.x) + cart.is_off_track * int(math.copysign(1, cart.x))
        columns_per_metre = (scale.right - scale.left) / max(scale.high - scale.low, 1e-9)
        pole_length = problem.length * columns_per_metre / COLUMNS_PER_ROW
        if layout.has_straight_pole:
            pole_length = layout.pole_rows
        _draw_pole(canvas, cart.theta, pole_length, cart_column, layout)
        _draw_cart(canvas, view.last_action_label, cart_column, layout)
        _draw_push_regrets(canvas, options, cart_column, layout)
        y = layout.pole_rows + 2
        _draw_track(canvas, y, scale, cart)
        if layout.has_scales:
            x_name, theta_name = "x", "theta"
            if options.allow_large:
                x_name, theta_name = "position (x)", "angle (theta)"
            draw_scale_labels(canvas, y + 1, scale, x_name, "m")
            lean = scale._replace(low=-cart.theta_limit, high=cart.theta_limit)
            draw_gauge(canvas, y + 2, lean, cart.theta, [state.theta for state in forecast_carts])
            draw_scale_labels(canvas, y + 3, lean, theta_name, "deg")
            y += 4
        single_row = layout.width > LAYOUTS[-1].width
        if options.forecast and forecast_carts:
            condition = format_action_condition(view, options.forecast, "push {}")
            rows = _format_next_state(condition, forecast_carts[0], single_row)
            canvas.write_rows(y + 1, rows, theme.STRONG_DATA)
        # On a wider drawing, the panel beside it has the numbers.
        elif layout.width > options.columns_beside_panel:
            template = LONG_STATE if single_row else SHORT_STATE
            template = NAMED_STATE if options.allow_large else template
            canvas.write_rows(y + 1, _format_state(cart, template).split("\n"), "bold")
        yield canvas.to_text()
    yield draw_text_rows(_format_state(cart, SHORT_STATE))


def _format_next_state(condition: str, cart: CartState, single_row: bool) -> list[str]:
    """Format the state after an action, with the limit it passes, in one row or in two."""
    x, theta = format_signed_fixed(cart.x, 3), format_signed_fixed(cart.theta, 2)
    state_text = f"position {x} m, angle {theta} deg"
    outcome_text = "" if _describe_outcome(cart) == UPRIGHT else f", {_describe_outcome(cart)}"
    if single_row:
        return [f"{condition}: {state_text}{outcome_text}"]
    return [f"{condition}{outcome_text}:", state_text]


def _draw_push_regrets(
    canvas: Canvas, options: DrawOptions, cart_column: int, layout: CartPoleLayout
) -> None:
    """Draw each push's regret in turns at its side of the cart, or both at one side."""
    left_text = _format_turns_lost(format_regret(options, 0, MAX_NUMBER_COLUMNS))
    right_text = _format_turns_lost(format_regret(options, 1, MAX_NUMBER_COLUMNS))
    if not left_text or not right_text:
        return
    y, right_column = layout.pole_rows, cart_column + layout.half_cart_columns + 2
    left_end = cart_column - layout.half_cart_columns - 1
    left_column = left_end - 2 - len(left_text)
    joint_text = f"← {left_text}  → {right_text}"
    if left_column < 0:
        canvas.write_text(right_column, y, joint_text, theme.CHOICE)
    elif right_column + 2 + len(right_text) > layout.width:
        canvas.write_text(left_end - len(joint_text), y, joint_text, theme.CHOICE)
    else:
        left_style, right_style = (
            theme.BEST if text == BEST_LABEL else theme.CHOICE for text in (left_text, right_text)
        )
        canvas.write_text(left_column, y, f"{left_text} ←", left_style)
        canvas.write_text(right_column, y, f"→ {right_text}", right_style)


def _format_turns_lost(regret_text: str) -> str:
    """Format a regret in turns, unless it is a word such as 'best'."""
    if regret_text.startswith("-"):
        return f"{regret_text} {'turn' if regret_text == '-1' else 'turns'}"
    return regret_text


def _draw_pole(
    canvas: Canvas, theta: float, length: float, foot_column: int, layout: CartPoleLayout
) -> None:
    """Draw the pole with a length in rows, limited to the rows of the layout."""
    lean = math.radians(min(max(theta, -MAX_DRAWN_LEAN_DEGREES), MAX_DRAWN_LEAN_DEGREES))
    length = round(min(max(length, 2), layout.pole_rows))
    rows = max(round(length * math.cos(lean)), 1)
    side, previous_offset, slope = (1 if lean > 0 else -1), 0, abs(math.tan(lean))
    for row in range(1, rows + 1):
        distance = min(row * slope, length * abs(math.sin(lean)))
        offset = round(COLUMNS_PER_ROW * distance) * side
        is_upright = offset == previous_offset
        if layout.has_straight_pole:
            is_upright = COLUMNS_PER_ROW * slope < MAX_UPRIGHT_SLOPE
        glyph = "│" if is_upright else "╱" if side > 0 else "╲"
        flat_columns = range(previous_offset + side, offset, side)
        end_cell = (offset, "●", theme.PIECE) if row == rows else (offset, glyph, theme.PIECE_TRAIL)
        flat_cells = [(x, "─", theme.PIECE_TRAIL) for x in flat_columns]
        for column, character, style in [*flat_cells, end_cell]:
            if 0 <= foot_column + column < layout.width:
                canvas.write_text(foot_column + column, layout.pole_rows - row, character, style)
        previous_offset = offset


def _draw_cart(canvas: Canvas, last_action: str, cart_column: int, layout: CartPoleLayout) -> None:
    """Draw the cart, and the direction of the last push beside it."""
    y, half = layout.pole_rows, layout.half_cart_columns
    deck, wheel = "─" * (half - 1), "─" * (half - 2)
    canvas.write_text(cart_column - half, y, f"┌{deck}┴{deck}┐")
    canvas.write_text(cart_column - half, y + 1, f"└{wheel}o─o{wheel}┘")
    arrow_column = cart_column - half - 1 if last_action == "right" else cart_column + half + 1
    if last_action and 0 <= arrow_column < layout.width:
        canvas.write_text(arrow_column, y + 1, "→" if last_action == "right" else "←", theme.BEST)


def _draw_track(canvas: Canvas, y: int, scale: NumberLine, cart: CartState) -> None:
    """Draw the track between its limits, and a cross at the end that the cart passed."""
    canvas.write_text(scale.left, y, "╋" + "━" * (scale.right - scale.left - 1) + "╋")
    canvas.write_text(scale.column_of(0), y, "┷")
    if cart.is_off_track:
        canvas.write_text(scale.column_of(cart.x), y, "✗", theme.DANGER)


def _format_state(cart: CartState, template: str) -> str:
    """Format the state with its limits: position `+1.00/2.4`, or `+2.41>2.4` beyond."""
    x, theta = format_signed_fixed(cart.x, 2), format_signed_fixed(cart.theta, 1)
    return template.format(
        f"{x}{'>' if cart.is_off_track else '/'}{cart.x_limit:g}",
        format_signed_fixed(cart.v, 2),
        f"{theta}{'>' if cart.has_fallen else '/'}{cart.theta_limit:g}",
        format_signed_fixed(cart.omega, 0),
    )


def goal_lines(view: View[CartPole]) -> list[str]:
    """Return the goal: the limits to keep, the reward of a turn, and the effect of a push."""
    problem = view.problem
    tips_away = problem.force > 0.0 and problem.theta_limit < 90.0
    return [
        f"keep the pole within {problem.theta_limit:g} deg of upright",
        f"the cart within {problem.x_limit:g} m",
        "each turn pays 1",
        *(["a push left tips the pole right"] * tips_away),
    ]


def lesson(view: View[CartPole]) -> Lesson:
    """Return the lesson: the pushes, the limits, and the reward of a turn."""
    problem = view.problem
    return Lesson(
        f"You are a cart with a pole on it, and push left or right by {problem.force:g} N "
        f"every {problem.dt:g} s; there is no other action",
        f"You want the pole within {problem.theta_limit:g} degrees of upright and the cart within "
        f"{problem.x_limit:g} m of the middle",
        "A push is free, and every turn pays 1, including the turn that ends the game",
        "right",
    )


def panel_rows(view: View[CartPole]) -> list[tuple[str, str]]:
    """Return the side panel's rows: the state, the time played, the last push and its force."""
    cart = _make_cart_state(view, view.observation)
    return [
        ("x", f"{format_signed_fixed(cart.x, 2)} m"),
        ("speed", f"{format_signed_fixed(cart.v, 2)} m/s"),
        ("angle", f"{format_signed_fixed(cart.theta, 1)} deg"),
        ("swing", f"{format_signed_fixed(cart.omega, 0)} deg/s"),
        ("time", f"{view.turns_played * view.problem.dt:.2f} s"),
        ("last", view.last_action_label or "-"),
        ("force", f"{view.problem.force:g} N"),
    ]


def _describe_outcome(cart: CartState) -> str:
    """Describe whether the pole stands, or the side on which it fell or the cart left."""
    if cart.is_off_track:
        return f"the cart left the track on the {'right' if cart.x > 0 else 'left'}"
    if cart.has_fallen:
        return f"the pole fell to the {'right' if cart.theta > 0 else 'left'}"
    return UPRIGHT


def describe_turn(view: View[CartPole]) -> str:
    """Describe the last turn: the push, the outcome, the danger and the state."""
    cart = _make_cart_state(view, view.observation)
    outcome = _describe_outcome(cart)
    if outcome == UPRIGHT:
        outcome += _describe_danger(cart, view.problem.dt)
    return f"pushed {view.last_action_label}: {outcome}. {_describe_state(cart)}."


def _describe_danger(cart: CartState, dt: float) -> str:
    """Return a clause on a pole that soon passes its limit at its present swing; '' if none."""
    side = cart.omega > 0
    distance, step = cart.theta_limit - cart.theta * (1 if side else -1), abs(cart.omega) * dt
    if distance >= step * MAX_DANGER_TURNS:
        return ""
    turns = format_count(math.ceil(distance / step), "turn")
    return f", but falls {SIDES[side]} fast: past the limit in about {turns}"


def describe_situation(view: View[CartPole]) -> str:
    """Describe the situation: the outcome, the state and the limits."""
    cart = _make_cart_state(view, view.observation)
    fails = f"the game ends beyond {cart.x_limit:g} m or {cart.theta_limit:g} deg"
    return f"{_describe_outcome(cart)}. {_describe_state(cart)}. {fails}."


def _describe_state(cart: CartState) -> str:
    """Describe the state in words and units."""
    return (
        f"position {format_signed_fixed(cart.x, 2)} m, speed {format_signed_fixed(cart.v, 2)} m/s, "
        f"angle {format_signed_fixed(cart.theta, 1)} deg, "
        f"swing {format_signed_fixed(cart.omega, 0)} deg/s"
    )


def describe_end(game: FinishedGame[CartPole]) -> str:
    """Return the number of pushes, and whether the pole fell or the cart left the track."""
    count = len(game.actions)
    pushes = f"{count} push{'es' * (count != 1)}"
    if not game.is_terminal:
        return f"{game.player} kept the pole up for all {pushes}"
    cart = _make_cart_state(game, game.states[-1])
    limit = f"{cart.x_limit:g} m" if cart.is_off_track else f"{cart.theta_limit:g} deg"
    return f"{_describe_outcome(cart)}, past {limit}, after {pushes}" + f" of {game.player}" * (
        game.player != "you"
    )
