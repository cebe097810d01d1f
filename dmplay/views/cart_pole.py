"""How cart-pole looks: the cart on its track, the pole to scale, and how far each may go.

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

from dmplay.chance import Array
from dmplay.problems.cart_pole import CartPole
from dmplay.session import View
from dmplay.views._advice import MAX_NUMBER_COLUMNS, format_action_condition, format_regret
from dmplay.views._scale import NumberLine, draw_gauge, draw_scale_labels, format_signed_fixed
from dmplay.views.canvas import Canvas, draw_text_rows
from dmplay.views.style import BEST_LABEL, DrawOptions, Lesson

KEYS = {
    "h": "left", "l": "right", "left": "left", "right": "right", "a": "left", "d": "right",
}  # fmt: skip
REGRET_STYLES = {BEST_LABEL: "bold green"}  # styles of a loss that stand out
COLUMNS_PER_ROW = 2  # columns that are as long as a row is high
MAX_UPRIGHT_SLOPE = (
    0.75  # columns a row below which a straight pole is drawn upright, piece by piece
)
MAX_DRAWN_LEAN_DEGREES = 85.0  # degrees of lean that are drawn; what lies flatter is drawn so


class CartPoleLayout(NamedTuple):
    """A drawing: its columns, the rows for the pole, half the cart, whether it has scales."""

    width: int
    pole_rows: int
    half_cart_columns: int = 2
    has_scales: bool = False
    has_straight_pole: bool = (
        False  # whether the pole is of one glyph, and as long as there are rows
    )


MAX_LAYOUT = CartPoleLayout(161, 30)  # columns and rows of pole that a drawing grows to
LAYOUTS = (
    CartPoleLayout(121, 13, 4, True),
    CartPoleLayout(61, 6, 2, True),
    CartPoleLayout(61, 5),
    CartPoleLayout(39, 4),
    CartPoleLayout(39, 2),
)
LOW_LAYOUT = CartPoleLayout(39, 3)  # on a screen, where the numbers have two rows


def _list_layouts(options: DrawOptions) -> list[CartPoleLayout]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    if not options.allow_large:
        return [*LAYOUTS]
    straight = [
        size._replace(has_straight_pole=True) for size in (*LAYOUTS[:-1], LOW_LAYOUT, LAYOUTS[-1])
    ]
    width, pole = (
        min(options.columns_beside_panel, MAX_LAYOUT.width),
        min(options.height - 8, MAX_LAYOUT.pole_rows),
    )
    if width < LAYOUTS[1].width or pole < LAYOUTS[1].pole_rows:
        return straight
    return [
        CartPoleLayout(width - 1 + width % 2, pole, 4 if width > 100 else 2, True, True),
        *straight,
    ]


class CartState(NamedTuple):
    """The state in metres and degrees, and the limits."""

    x: float
    v: float
    theta: float
    omega: float
    x_limit: float
    theta_limit: float
    is_off_track: bool  # the cart has left its track
    has_fallen: bool  # the pole leans too far


def _read_cart_state(view: View[CartPole], state: Array) -> CartState:
    problem = view.problem
    x, v, theta, omega = map(float, state)
    limits = problem.x_limit, problem.theta_limit
    off, fallen = abs(x) > limits[0], abs(theta) > limits[1] * 2 * math.pi / 360
    return CartState(x, v, math.degrees(theta), math.degrees(omega), *limits, off, fallen)


def iter_boards(view: View[CartPole], options: DrawOptions) -> Iterator[Text]:
    """The cart in five sizes and on a screen in one more, then its numbers in a line."""
    cart, problem = _read_cart_state(view, view.observation), view.problem
    after = (
        [_read_cart_state(view, state) for state in options.forecast.outcomes]
        if options.forecast
        else []
    )
    for size in _list_layouts(options):
        canvas = Canvas()
        margin = size.half_cart_columns + 1
        scale = NumberLine(-cart.x_limit, cart.x_limit, margin, size.width - 1 - margin)
        # A cart that has left its track stands one column beyond it.
        middle = scale.column_of(cart.x) + cart.is_off_track * int(math.copysign(1, cart.x))
        metre = (scale.right - scale.left) / max(scale.high - scale.low, 1e-9)
        length = (
            size.pole_rows if size.has_straight_pole else problem.length * metre / COLUMNS_PER_ROW
        )
        _draw_pole(canvas, cart.theta, length, middle, size)
        _draw_cart(canvas, view.last_action_label, middle, size)
        _draw_hint(canvas, options, middle, size)
        y = size.pole_rows + 2
        _draw_track(canvas, y, scale, cart)
        if size.has_scales:
            draw_scale_labels(
                canvas, y + 1, scale, "place (x)" if options.allow_large else "x", "m"
            )
            lean = scale._replace(low=-cart.theta_limit, high=cart.theta_limit)
            draw_gauge(canvas, y + 2, lean, cart.theta, [one.theta for one in after])
            draw_scale_labels(
                canvas, y + 3, lean, "lean (theta)" if options.allow_large else "theta", "deg"
            )
            y += 4
        long = size.width > LAYOUTS[-1].width
        if options.forecast and after:
            what = format_action_condition(view, options.forecast, "push {}")
            for row, part in enumerate(_format_next_state(what, after[0], long), y + 1):
                canvas.write_text(0, row, part, "bold cyan")
        elif size.width > options.columns_beside_panel:  # else the panel beside has them
            told = (
                _format_state_named(cart)
                if options.allow_large
                else [_format_state_long(cart) if long else _format_state_short(cart)]
            )
            for row, numbers in enumerate(told, y + 1):
                canvas.write_text(0, row, numbers, "bold")
        yield canvas.to_text()
    yield draw_text_rows(_format_state_short(cart))


def _format_next_state(condition: str, cart: CartState, single_row: bool) -> list[str]:
    """What an action leads to, the limits passed said; in two rows where one has no room."""
    told = (
        f"place {format_signed_fixed(cart.x, 3)} m, lean {format_signed_fixed(cart.theta, 2)} deg"
    )
    ends = "" if _describe_outcome(cart) == "stands" else f", {_describe_outcome(cart)}"
    return [f"{condition}: {told}{ends}"] if single_row else [f"{condition}{ends}:", told]


def _draw_hint(
    canvas: Canvas, options: DrawOptions, cart_column: int, layout: CartPoleLayout
) -> None:
    """At either side of the cart the turns that a push that way loses; at one where there is no
    room.
    """
    left, right = (
        _format_turns_lost(format_regret(options, 0, MAX_NUMBER_COLUMNS)),
        _format_turns_lost(format_regret(options, 1, MAX_NUMBER_COLUMNS)),
    )
    if not left or not right:
        return
    start, end = (
        cart_column - layout.half_cart_columns - 3 - len(left),
        cart_column + layout.half_cart_columns + 2,
    )
    both = f"← {left}  → {right}"
    if start < 0:
        canvas.write_text(end, layout.pole_rows, both, "green")
    elif end + 2 + len(right) > layout.width:
        canvas.write_text(
            cart_column - layout.half_cart_columns - 1 - len(both), layout.pole_rows, both, "green"
        )
    else:
        canvas.write_text(start, layout.pole_rows, f"{left} ←", REGRET_STYLES.get(left, "green"))
        canvas.write_text(end, layout.pole_rows, f"→ {right}", REGRET_STYLES.get(right, "green"))


def _format_turns_lost(regret_text: str) -> str:
    return (
        f"{regret_text} {'turn' if regret_text == '-1' else 'turns'}"
        if regret_text.startswith("-")
        else regret_text
    )


def _draw_pole(
    canvas: Canvas, theta: float, length: float, foot_column: int, layout: CartPoleLayout
) -> None:
    """The pole, so many rows long where there is room for that."""
    lean = math.radians(min(max(theta, -MAX_DRAWN_LEAN_DEGREES), MAX_DRAWN_LEAN_DEGREES))
    length = round(min(max(length, 2), layout.pole_rows))
    rows = max(round(length * math.cos(lean)), 1)
    side, before = (1 if lean > 0 else -1), 0
    for row in range(1, rows + 1):
        aside = (
            round(COLUMNS_PER_ROW * min(row * abs(math.tan(lean)), length * abs(math.sin(lean))))
            * side
        )
        upright = (
            COLUMNS_PER_ROW * abs(math.tan(lean)) < MAX_UPRIGHT_SLOPE
            if layout.has_straight_pole
            else aside == before
        )
        glyph = "│" if upright else "╱" if side > 0 else "╲"
        flat = [(column, "─", "yellow") for column in range(before + side, aside, side)]
        end = (aside, "●", "bold yellow") if row == rows else (aside, glyph, "yellow")
        for column, drawn, style in [*flat, end]:
            if 0 <= foot_column + column < layout.width:
                canvas.write_text(foot_column + column, layout.pole_rows - row, drawn, style)
        before = aside


def _draw_cart(canvas: Canvas, last_action: str, cart_column: int, layout: CartPoleLayout) -> None:
    """The cart, and beside it the push that it was given."""
    y, half = layout.pole_rows, layout.half_cart_columns
    deck, wheel = "─" * (half - 1), "─" * (half - 2)
    canvas.write_text(cart_column - half, y, f"┌{deck}┴{deck}┐")
    canvas.write_text(cart_column - half, y + 1, f"└{wheel}o─o{wheel}┘")
    column = cart_column - half - 1 if last_action == "right" else cart_column + half + 1
    if last_action and 0 <= column < layout.width:
        canvas.write_text(column, y + 1, "→" if last_action == "right" else "←", "bold green")


def _draw_track(canvas: Canvas, y: int, scale: NumberLine, cart: CartState) -> None:
    """The track from limit to limit; a cross at the end that was passed."""
    canvas.write_text(scale.left, y, "╋" + "━" * (scale.right - scale.left - 1) + "╋")
    canvas.write_text(scale.column_of(0), y, "┷")
    if cart.is_off_track:
        canvas.write_text(scale.column_of(cart.x), y, "✗", "bold red")


def _format_state_long(cart: CartState) -> str:
    """The numbers, those that can fail with their limits."""
    track, pole = _format_against_limits(cart)
    return f"x {track} m  v {format_signed_fixed(cart.v, 2)} m/s  th {pole} deg  om {format_signed_fixed(cart.omega, 0)} deg/s"


def _format_state_short(cart: CartState) -> str:
    track, pole = _format_against_limits(cart)
    return f"x {track} v {format_signed_fixed(cart.v, 2)} th {pole} om {format_signed_fixed(cart.omega, 0)}"


def _format_state_named(cart: CartState) -> list[str]:
    """The numbers by their names, in two rows."""
    track, pole = _format_against_limits(cart)
    return [
        f"place {track} m  speed {format_signed_fixed(cart.v, 2)} m/s",
        f"lean {pole} deg  swings {format_signed_fixed(cart.omega, 0)} deg/s",
    ]


def _format_against_limits(cart: CartState) -> tuple[str, str]:
    """Place and angle, each against its limit: `+1.00/2.4`, or `+2.41>2.4`."""
    return (
        f"{format_signed_fixed(cart.x, 2)}{'>' if cart.is_off_track else '/'}{cart.x_limit:g}",
        f"{format_signed_fixed(cart.theta, 1)}{'>' if cart.has_fallen else '/'}{cart.theta_limit:g}",
    )


def goal_lines(view: View[CartPole]) -> list[str]:
    """What has to stay where."""
    problem = view.problem
    return [
        f"keep the pole within {problem.theta_limit:g} deg",
        f"the cart within {problem.x_limit:g} m",
        "each turn pays 1",
    ]


def lesson(view: View[CartPole]) -> Lesson:
    """The cart, how far it and its pole may go, and what a turn pays."""
    problem = view.problem
    return Lesson(
        f"You are a cart with a pole on it, and push left or right by {problem.force:g} N "
        f"every {problem.dt:g} s; you cannot do nothing",
        f"You want the pole within {problem.theta_limit:g} degrees of upright and the cart within "
        f"{problem.x_limit:g} m of the middle",
        "A push is free and every turn pays 1, up to the one that fails",
        "right",
    )


def panel_rows(view: View[CartPole]) -> list[tuple[str, str]]:
    """The state, for how long the pole stood, the last push; the limits stand in the goal."""
    cart = _read_cart_state(view, view.observation)
    return [
        ("place", f"{format_signed_fixed(cart.x, 2)} m"),
        ("speed", f"{format_signed_fixed(cart.v, 2)} m/s"),
        ("lean", f"{format_signed_fixed(cart.theta, 1)} deg"),
        ("swings", f"{format_signed_fixed(cart.omega, 0)} deg/s"),
        ("stood", f"{view.turns_played * view.problem.dt:.2f} s"),
        ("last", view.last_action_label or "-"),
        ("force", f"{view.problem.force:g} N"),
    ]


def _describe_outcome(cart: CartState) -> str:
    """What became of it, in words."""
    if cart.is_off_track:
        return f"off the track on the {'right' if cart.x > 0 else 'left'}"
    if cart.has_fallen:
        return f"fell to the {'right' if cart.theta > 0 else 'left'}"
    return "stands"


def describe_turn(view: View[CartPole]) -> str:
    """Whether it stands, the push, and the state."""
    cart = _read_cart_state(view, view.observation)
    return f"{_describe_outcome(cart)}. pushed {view.last_action_label}. {_describe_state(cart)}."


def describe_situation(view: View[CartPole]) -> str:
    """Whether it stands, the state, and what would end it."""
    cart = _read_cart_state(view, view.observation)
    fails = f"fails past {cart.x_limit:g} m or {cart.theta_limit:g} deg"
    return f"{_describe_outcome(cart)}. {_describe_state(cart)}. {fails}."


def _describe_state(cart: CartState) -> str:
    return (
        f"place {format_signed_fixed(cart.x, 2)} m, speed {format_signed_fixed(cart.v, 2)} m/s, "
        f"lean {format_signed_fixed(cart.theta, 1)} deg, swing {format_signed_fixed(cart.omega, 0)} deg/s"
    )
