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

from dmplay.problems.cart_pole import CartPole
from dmplay.session import View
from dmplay.views._scale import Scale, gauge, named, plus
from dmplay.views.canvas import Canvas, written
from dmplay.views.style import Look

KEYS = {
    "h": "left", "l": "right", "left": "left", "right": "right", "a": "left", "d": "right",
}  # fmt: skip
ASPECT = 2  # columns that are as long as a row is high
STEEPEST = 85.0  # degrees of lean that are drawn; what lies flatter is drawn so


class Size(NamedTuple):
    """A drawing: its columns, the rows for the pole, half the cart, whether it has scales."""

    width: int
    pole: int
    half: int = 2
    scales: bool = False


SIZES = (Size(121, 13, 4, True), Size(61, 6, 2, True), Size(61, 5), Size(39, 4), Size(39, 2))


class Cart(NamedTuple):
    """The state in metres and degrees, and the limits."""

    x: float
    v: float
    theta: float
    omega: float
    x_limit: float
    theta_limit: float
    off: bool  # the cart has left its track
    fallen: bool  # the pole leans too far


def _cart(view: View[CartPole]) -> Cart:
    problem = view.problem
    x, v, theta, omega = map(float, view.observation)
    limits = problem.x_limit, problem.theta_limit
    off, fallen = abs(x) > limits[0], abs(theta) > limits[1] * 2 * math.pi / 360
    return Cart(x, v, math.degrees(theta), math.degrees(omega), *limits, off, fallen)


def boards(view: View[CartPole], look: Look) -> Iterator[Text]:
    """The cart in five sizes, then its numbers in a line."""
    cart, problem = _cart(view), view.problem
    for size in SIZES:
        canvas = Canvas()
        margin = size.half + 1
        scale = Scale(-cart.x_limit, cart.x_limit, margin, size.width - 1 - margin)
        # A cart that has left its track stands one column beyond it.
        middle = scale.column(cart.x) + cart.off * int(math.copysign(1, cart.x))
        metre = (scale.right - scale.left) / max(scale.high - scale.low, 1e-9)
        _pole(canvas, cart.theta, problem.length * metre / ASPECT, middle, size)
        _body(canvas, view.last, middle, size)
        y = size.pole + 2
        _track(canvas, y, scale, cart)
        if size.scales:
            named(canvas, y + 1, scale, "x", "m")
            lean = scale._replace(low=-cart.theta_limit, high=cart.theta_limit)
            gauge(canvas, y + 2, lean, cart.theta)
            named(canvas, y + 3, lean, "theta", "deg")
            y += 4
        canvas.put(0, y + 1, _long(cart) if size.width > SIZES[-1].width else _short(cart), "bold")
        yield canvas.text()
    yield written(_short(cart))


def _pole(canvas: Canvas, theta: float, length: float, foot: int, size: Size) -> None:
    """The pole, on the track's scale where there is room for that."""
    lean = math.radians(min(max(theta, -STEEPEST), STEEPEST))
    length = round(min(max(length, 2), size.pole))
    rows = max(round(length * math.cos(lean)), 1)
    side, before = (1 if lean > 0 else -1), 0
    for row in range(1, rows + 1):
        aside = round(ASPECT * min(row * abs(math.tan(lean)), length * abs(math.sin(lean)))) * side
        glyph = "│" if aside == before else "╱" if side > 0 else "╲"
        flat = [(column, "─", "yellow") for column in range(before + side, aside, side)]
        end = (aside, "●", "bold yellow") if row == rows else (aside, glyph, "yellow")
        for column, drawn, style in [*flat, end]:
            if 0 <= foot + column < size.width:
                canvas.put(foot + column, size.pole - row, drawn, style)
        before = aside


def _body(canvas: Canvas, last: str, middle: int, size: Size) -> None:
    """The cart, and beside it the push that it was given."""
    y, half = size.pole, size.half
    deck, wheel = "─" * (half - 1), "─" * (half - 2)
    canvas.put(middle - half, y, f"┌{deck}┴{deck}┐")
    canvas.put(middle - half, y + 1, f"└{wheel}o─o{wheel}┘")
    column = middle - half - 1 if last == "right" else middle + half + 1
    if last and 0 <= column < size.width:
        canvas.put(column, y + 1, "→" if last == "right" else "←", "bold green")


def _track(canvas: Canvas, y: int, scale: Scale, cart: Cart) -> None:
    """The track from limit to limit; a cross at the end that was passed."""
    canvas.put(scale.left, y, "╋" + "━" * (scale.right - scale.left - 1) + "╋")
    canvas.put(scale.column(0), y, "┷")
    if cart.off:
        canvas.put(scale.column(cart.x), y, "✗", "bold red")


def _long(cart: Cart) -> str:
    """The numbers, those that can fail with their limits."""
    track, pole = _against(cart)
    return f"x {track} m  v {plus(cart.v, 2)} m/s  th {pole} deg  om {plus(cart.omega, 0)} deg/s"


def _short(cart: Cart) -> str:
    track, pole = _against(cart)
    return f"x {track} v {plus(cart.v, 2)} th {pole} om {plus(cart.omega, 0)}"


def _against(cart: Cart) -> tuple[str, str]:
    """Place and angle, each against its limit: `+1.00/2.4`, or `+2.41>2.4`."""
    return (
        f"{plus(cart.x, 2)}{'>' if cart.off else '/'}{cart.x_limit:g}",
        f"{plus(cart.theta, 1)}{'>' if cart.fallen else '/'}{cart.theta_limit:g}",
    )


def goal(view: View[CartPole]) -> list[str]:
    """What has to stay where."""
    problem = view.problem
    return [
        f"keep the pole within {problem.theta_limit:g} deg",
        f"the cart within {problem.x_limit:g} m",
        "each turn pays 1",
    ]


def panel(view: View[CartPole]) -> list[tuple[str, str]]:
    """The state, its limits, the last push."""
    cart = _cart(view)
    return [
        ("x", f"{plus(cart.x, 2)} m"),
        ("v", f"{plus(cart.v, 2)} m/s"),
        ("theta", f"{plus(cart.theta, 1)} deg"),
        ("omega", f"{plus(cart.omega, 0)} deg/s"),
        ("fails", f"{cart.x_limit:g} m"),
        ("or", f"{cart.theta_limit:g} deg"),
        ("last", view.last or "-"),
        ("force", f"{view.problem.force:g} N"),
    ]


def _stands(cart: Cart) -> str:
    """What became of it, in words."""
    if cart.off:
        return f"off the track on the {'right' if cart.x > 0 else 'left'}"
    if cart.fallen:
        return f"fell to the {'right' if cart.theta > 0 else 'left'}"
    return "stands"


def told(view: View[CartPole]) -> str:
    """Whether it stands, the push, and the state."""
    cart = _cart(view)
    return f"{_stands(cart)}. pushed {view.last}. {_words(cart)}."


def situation(view: View[CartPole]) -> str:
    """Whether it stands, the state, and what would end it."""
    cart = _cart(view)
    fails = f"fails past {cart.x_limit:g} m or {cart.theta_limit:g} deg"
    return f"{_stands(cart)}. {_words(cart)}. {fails}."


def _words(cart: Cart) -> str:
    return (
        f"x {plus(cart.x, 2)} m, v {plus(cart.v, 2)} m/s, "
        f"theta {plus(cart.theta, 1)} deg, omega {plus(cart.omega, 0)} deg/s"
    )
