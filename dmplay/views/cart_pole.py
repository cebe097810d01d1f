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
from dmplay.views._advice import WIDEST, asked, lost
from dmplay.views._scale import Scale, gauge, named, plus
from dmplay.views.canvas import Canvas, written
from dmplay.views.style import BEST, Lesson, Look

KEYS = {
    "h": "left", "l": "right", "left": "left", "right": "right", "a": "left", "d": "right",
}  # fmt: skip
HINTED = {BEST: "bold green"}  # styles of a loss that stand out
ASPECT = 2  # columns that are as long as a row is high
UPRIGHT = 0.75  # columns a row below which a straight pole is drawn upright, piece by piece
STEEPEST = 85.0  # degrees of lean that are drawn; what lies flatter is drawn so


class Size(NamedTuple):
    """A drawing: its columns, the rows for the pole, half the cart, whether it has scales."""

    width: int
    pole: int
    half: int = 2
    scales: bool = False
    straight: bool = False  # whether the pole is of one glyph, and as long as there are rows


MOST = Size(161, 30)  # columns and rows of pole that a drawing grows to
SIZES = (Size(121, 13, 4, True), Size(61, 6, 2, True), Size(61, 5), Size(39, 4), Size(39, 2))
LOW = Size(39, 3)  # on a screen, where the numbers have two rows


def _sizes(look: Look) -> list[Size]:
    """The largest first; one that fills the room beside the panel before those of a transcript."""
    if not look.large:
        return [*SIZES]
    straight = [size._replace(straight=True) for size in (*SIZES[:-1], LOW, SIZES[-1])]
    width, pole = min(look.beside, MOST.width), min(look.height - 8, MOST.pole)
    if width < SIZES[1].width or pole < SIZES[1].pole:
        return straight
    return [Size(width - 1 + width % 2, pole, 4 if width > 100 else 2, True, True), *straight]


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


def _cart(view: View[CartPole], state: Array) -> Cart:
    problem = view.problem
    x, v, theta, omega = map(float, state)
    limits = problem.x_limit, problem.theta_limit
    off, fallen = abs(x) > limits[0], abs(theta) > limits[1] * 2 * math.pi / 360
    return Cart(x, v, math.degrees(theta), math.degrees(omega), *limits, off, fallen)


def boards(view: View[CartPole], look: Look) -> Iterator[Text]:
    """The cart in five sizes and on a screen in one more, then its numbers in a line."""
    cart, problem = _cart(view, view.observation), view.problem
    after = [_cart(view, state) for state in look.outlook.states] if look.outlook else []
    for size in _sizes(look):
        canvas = Canvas()
        margin = size.half + 1
        scale = Scale(-cart.x_limit, cart.x_limit, margin, size.width - 1 - margin)
        # A cart that has left its track stands one column beyond it.
        middle = scale.column(cart.x) + cart.off * int(math.copysign(1, cart.x))
        metre = (scale.right - scale.left) / max(scale.high - scale.low, 1e-9)
        length = size.pole if size.straight else problem.length * metre / ASPECT
        _pole(canvas, cart.theta, length, middle, size)
        _body(canvas, view.last, middle, size)
        _advice(canvas, look, middle, size)
        y = size.pole + 2
        _track(canvas, y, scale, cart)
        if size.scales:
            named(canvas, y + 1, scale, "place (x)" if look.large else "x", "m")
            lean = scale._replace(low=-cart.theta_limit, high=cart.theta_limit)
            gauge(canvas, y + 2, lean, cart.theta, [one.theta for one in after])
            named(canvas, y + 3, lean, "lean (theta)" if look.large else "theta", "deg")
            y += 4
        long = size.width > SIZES[-1].width
        if look.outlook and after:
            what = asked(view, look.outlook, "push {}")
            for row, part in enumerate(_next(what, after[0], long), y + 1):
                canvas.put(0, row, part, "bold cyan")
        elif size.width > look.beside:  # else the panel beside has them
            told = _named(cart) if look.large else [_long(cart) if long else _short(cart)]
            for row, numbers in enumerate(told, y + 1):
                canvas.put(0, row, numbers, "bold")
        yield canvas.text()
    yield written(_short(cart))


def _next(what: str, cart: Cart, long: bool) -> list[str]:
    """What an action leads to, the limits passed said; in two rows where one has no room."""
    told = f"place {plus(cart.x, 3)} m, lean {plus(cart.theta, 2)} deg"
    ends = "" if _stands(cart) == "stands" else f", {_stands(cart)}"
    return [f"{what}: {told}{ends}"] if long else [f"{what}{ends}:", told]


def _advice(canvas: Canvas, look: Look, middle: int, size: Size) -> None:
    """At either side of the cart the turns that a push that way loses; at one where there is no
    room.
    """
    left, right = _turns(lost(look, 0, WIDEST)), _turns(lost(look, 1, WIDEST))
    if not left or not right:
        return
    start, end = middle - size.half - 3 - len(left), middle + size.half + 2
    both = f"← {left}  → {right}"
    if start < 0:
        canvas.put(end, size.pole, both, "green")
    elif end + 2 + len(right) > size.width:
        canvas.put(middle - size.half - 1 - len(both), size.pole, both, "green")
    else:
        canvas.put(start, size.pole, f"{left} ←", HINTED.get(left, "green"))
        canvas.put(end, size.pole, f"→ {right}", HINTED.get(right, "green"))


def _turns(loss: str) -> str:
    return f"{loss} {'turn' if loss == '-1' else 'turns'}" if loss.startswith("-") else loss


def _pole(canvas: Canvas, theta: float, length: float, foot: int, size: Size) -> None:
    """The pole, so many rows long where there is room for that."""
    lean = math.radians(min(max(theta, -STEEPEST), STEEPEST))
    length = round(min(max(length, 2), size.pole))
    rows = max(round(length * math.cos(lean)), 1)
    side, before = (1 if lean > 0 else -1), 0
    for row in range(1, rows + 1):
        aside = round(ASPECT * min(row * abs(math.tan(lean)), length * abs(math.sin(lean)))) * side
        upright = ASPECT * abs(math.tan(lean)) < UPRIGHT if size.straight else aside == before
        glyph = "│" if upright else "╱" if side > 0 else "╲"
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


def _named(cart: Cart) -> list[str]:
    """The numbers by their names, in two rows."""
    track, pole = _against(cart)
    return [
        f"place {track} m  speed {plus(cart.v, 2)} m/s",
        f"lean {pole} deg  swings {plus(cart.omega, 0)} deg/s",
    ]


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


def panel(view: View[CartPole]) -> list[tuple[str, str]]:
    """The state, for how long the pole stood, the last push; the limits stand in the goal."""
    cart = _cart(view, view.observation)
    return [
        ("place", f"{plus(cart.x, 2)} m"),
        ("speed", f"{plus(cart.v, 2)} m/s"),
        ("lean", f"{plus(cart.theta, 1)} deg"),
        ("swings", f"{plus(cart.omega, 0)} deg/s"),
        ("stood", f"{view.turn * view.problem.dt:.2f} s"),
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
    cart = _cart(view, view.observation)
    return f"{_stands(cart)}. pushed {view.last}. {_words(cart)}."


def situation(view: View[CartPole]) -> str:
    """Whether it stands, the state, and what would end it."""
    cart = _cart(view, view.observation)
    fails = f"fails past {cart.x_limit:g} m or {cart.theta_limit:g} deg"
    return f"{_stands(cart)}. {_words(cart)}. {fails}."


def _words(cart: Cart) -> str:
    return (
        f"place {plus(cart.x, 2)} m, speed {plus(cart.v, 2)} m/s, "
        f"lean {plus(cart.theta, 1)} deg, swing {plus(cart.omega, 0)} deg/s"
    )
