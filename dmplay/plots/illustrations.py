"""The illustrations of the book's appendix F: figures F.3 to F.8.

They show states and turns of the problems: random starts of a fixed seed, and what `Problem.step`
makes of a state.
"""

import math
from collections import Counter
from collections.abc import Mapping, Sequence

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.problem import Problem
from dmplay.core.text import format_count
from dmplay.core.uniforms import NATURE_STREAM, generate_uniforms
from dmplay.plots.plot_data import (
    BoardPanel,
    Box,
    Label,
    Plot,
    PlottedTile,
    Polyline,
    Shape,
    ShapesPanel,
)
from dmplay.plots.plotted_problem import PlottedProblem
from dmplay.problems.cart_pole.rules import CartPole
from dmplay.problems.collision_avoidance.rules import (
    ADVISED_RATES,
    COLLISION_DISTANCE,
    GUST_ACCELERATIONS,
    CollisionAvoidance,
)
from dmplay.problems.game_2048.rules import Game2048, slide_and_score
from dmplay.problems.game_2048.view import iter_sliding_tiles
from dmplay.problems.mountain_car.rules import LEFT_WALL, RIGHT_WALL, MountainCar
from dmplay.problems.mountain_car.view import VALLEY_FLOOR_X, compute_hill_height
from dmplay.views.toolkit.plots import Axis

Cell = tuple[int, int]  # row and column

SEED = 11  # of the random starts; in 2048, no tiles of this start merge in a slide down
ACTION_2048 = "down"
MERGE_BOARD = ". . . 2/4 . . ./. . . ./4 2 . ."  # the example in figure F.5
CART_WIDTH, CART_HEIGHT = 0.5, 0.3  # m; the problem has no size of the cart
HILL_POINTS = 181
CALM_SECONDS = 8  # of the flight that shows the vertical rate


def draw_start_of_2048(subject: PlottedProblem) -> Plot:
    """Return figure F.3: a random starting state of 2048."""
    board = _sample_start(subject.problem)
    panel = BoardPanel("", len(board), _list_tiles(board))
    return Plot(f"{subject.title}: a random starting state (seed {SEED})", [panel])


def draw_slide(subject: PlottedProblem) -> Plot:
    """Return figure F.4: a slide in the starting state of figure F.3."""
    return _plot_slide(subject, _sample_start(subject.problem), f"a slide {ACTION_2048}")


def draw_merge(subject: PlottedProblem) -> Plot:
    """Return figure F.5: a slide that merges two tiles."""
    board = subject.problem.parse_state(MERGE_BOARD)
    return _plot_slide(subject, board, f"a slide {ACTION_2048} that merges two tiles")


def _sample_start(problem: Problem) -> Array:
    """Return the initial state of the game with the seed SEED."""
    count = problem.uniform_counts.start
    u = generate_uniforms(SEED, NATURE_STREAM, 0, rows=1, count=count)
    return problem.sample_initial_states(u)[0]  # type: ignore[no-any-return]


def _plot_slide(subject: PlottedProblem, board: Array, what: str) -> Plot:
    """Return a board before a slide, after it, and with the new tile."""
    problem = subject.problem
    assert isinstance(problem, Game2048)
    action = int(problem.parse_action(0, ACTION_2048))
    s, a = board[None], np.array([[action]])
    u = generate_uniforms(SEED, NATURE_STREAM, 1, rows=1, count=problem.uniform_counts.step)
    outcome = problem.step(s, a, u)
    (slid,), _ = slide_and_score(s, a[:, 0])
    (after,), reward = outcome.state, float(outcome.rewards[0, 0])
    ends = _find_ends(board, action)
    merged = [end for end, count in Counter(ends.values()).items() if count > 1]
    panels = [
        BoardPanel("before", len(board), _list_tiles(board, ends=ends)),
        BoardPanel(f"reward {reward:g}", len(board), _list_tiles(slid, marked=merged)),
        BoardPanel("new tile", len(board), _list_tiles(after, marked=_list_cells(after != slid))),
    ]
    notes = [
        "marked: the merged tile, and the new tile" if merged else "marked: the new tile",
        f"the new tile is in a random cell, and a 2 with probability {problem.p_two:g}, else a 4",
    ]
    return Plot(f"{subject.title}: {what}", panels, columns=3, notes=notes)


def _find_ends(board: Array, action: int) -> dict[Cell, Cell]:
    """Return the cell to which the tile of each cell slides."""
    starts, ends = (
        [(round(tile.row), round(tile.column)) for tile in iter_sliding_tiles(board, action, share)]
        for share in (0.0, 1.0)
    )
    return dict(zip(starts, ends, strict=True))


def _list_cells(mask: Array) -> list[Cell]:
    """Return the rows and columns of the marked cells."""
    return [(row, column) for row, column in np.argwhere(mask).tolist()]


def _list_tiles(
    board: Array, *, ends: Mapping[Cell, Cell] | None = None, marked: Sequence[Cell] = ()
) -> list[PlottedTile]:
    """Return the tiles of a board `[4, 4]` of exponents, with the cells that they slide to."""
    return [
        PlottedTile(
            *cell,
            2 ** int(board[cell]),
            end=ends[cell] if ends and ends[cell] != cell else None,
            is_marked=cell in marked,
        )
        for cell in _list_cells(board > 0)
    ]


def draw_cart_pole(subject: PlottedProblem) -> Plot:
    """Return figure F.6: the cart, its pole, the two pushes and the limits."""
    problem = subject.problem
    assert isinstance(problem, CartPole)
    turns, state = _push_until_pole_leans(problem)
    x, v, theta, omega = state.tolist()
    half, top, limit = CART_WIDTH / 2, 1.15 * problem.length, problem.x_limit
    margin = 0.1 * max(limit, problem.length)
    width = max(limit, abs(x) + half) + margin
    pivot, tip = (x, CART_HEIGHT), _lean_from((x, CART_HEIGHT), theta, problem.length)
    max_angle = math.radians(problem.theta_limit)
    right_limit = _lean_from(pivot, max_angle, top)
    push_height = 0.7 * CART_HEIGHT
    pole_text = f"pole {problem.length:g} m, {problem.mass_pole:g} kg"
    cart_text = f"cart {problem.mass_cart:g} kg, x {x:+.2f} m, v {v:+.2f} m/s"
    shapes: list[Shape] = [
        Polyline([(-limit, 0.0), (limit, 0.0)]),
        Polyline([(-limit, 0.0), (-limit, CART_HEIGHT + top)], is_dashed=True),
        Polyline([(limit, 0.0), (limit, CART_HEIGHT + top)], is_dashed=True),
        Polyline([pivot, _lean_from(pivot, -max_angle, top)], is_dashed=True),
        Polyline([pivot, right_limit], is_dashed=True),
        Polyline([pivot, tip]),
        Box(x - half, 0.02, x + half, CART_HEIGHT),
        Polyline([(x - half, push_height), (x - 3 * half, push_height)], "end"),
        Polyline([(x + half, push_height), (x + 3 * half, push_height)], "end"),
        Label(f"force {problem.force:g} N", x - 3 * half, push_height, "left"),
        Label(f"force {problem.force:g} N", x + 3 * half, push_height),
        Label(pole_text, tip[0], CART_HEIGHT + top, "above"),
        Label(f"theta {math.degrees(theta):+.1f} deg", right_limit[0], CART_HEIGHT + top),
        Label(f"omega {math.degrees(omega):+.0f} deg/s", right_limit[0], CART_HEIGHT + 0.7 * top),
        Label(cart_text, x, -margin / 2, "below"),
    ]
    panel = ShapesPanel(
        "",
        Axis("position x (m)", -width, width),
        Axis("height (m)", -1.5 * margin, CART_HEIGHT + top + margin),
        shapes,
        has_equal_scales=True,
    )
    notes = [
        f"the state after {format_count(turns, 'turn')} of pushes to the left, from rest",
        "v: speed of the cart; theta: angle of the pole; omega: rate of this angle",
        f"dashed: limits of x ({limit:g} m) and theta ({problem.theta_limit:g} deg); "
        "the game ends past a limit",
    ]
    return Plot(f"{subject.title}: the state, the two pushes and the limits", [panel], notes=notes)


def _push_until_pole_leans(problem: CartPole) -> tuple[int, Array]:
    """Return the number of pushes to the left until the pole leans, and the state after them.

    It leans half of its limit. The cart and the pole are at rest at first. There are fewer pushes
    if the game ends before.
    """
    a, no_uniforms = np.zeros((1, 1), np.int64), np.zeros((1, 0))
    s = np.zeros((1, 4))
    for pushes in range(problem.horizon):
        next_s = problem.step(s, a, no_uniforms).state
        is_over = problem.terminal(next_s)[0] or not np.isfinite(next_s).all()
        if is_over or abs(s[0, 2]) > math.radians(problem.theta_limit) / 2:
            return pushes, s[0]
        s = next_s
    return problem.horizon, s[0]


def _lean_from(foot: tuple[float, float], angle: float, length: float) -> tuple[float, float]:
    """Return the upper end of a line that leans this angle in radians to the right."""
    return foot[0] + length * math.sin(angle), foot[1] + length * math.cos(angle)


def draw_valley(subject: PlottedProblem) -> Plot:
    """Return figure F.7: the valley, with the car at its lowest point, and the goal."""
    problem = subject.problem
    assert isinstance(problem, MountainCar)
    positions = np.linspace(LEFT_WALL, RIGHT_WALL, HILL_POINTS).tolist()
    hill = [(x, compute_hill_height(x)) for x in positions]
    floor, goal = VALLEY_FLOOR_X, problem.goal
    low, flag_foot = compute_hill_height(floor), compute_hill_height(goal)
    arrow_height = low + 0.45
    shapes: list[Shape] = [
        Polyline(hill),
        Polyline([hill[0], (LEFT_WALL, 1.4)]),
        Polyline([(goal, flag_foot), (goal, flag_foot + 0.45)]),
        Polyline([(floor - 0.1, arrow_height), (floor - 0.26, arrow_height)], "end"),
        Polyline([(floor + 0.1, arrow_height), (floor + 0.26, arrow_height)], "end"),
        Label("wall", LEFT_WALL, 1.3),
        Label(f"goal {goal:g}", goal, flag_foot + 0.4, "left"),
        Label("", floor, low + 0.1, has_dot=True),
        Label("car", floor, low + 0.25, "above"),
    ]
    panel = ShapesPanel(
        "",
        Axis("position x", LEFT_WALL - 0.05, RIGHT_WALL + 0.05),
        Axis("height of the hill, sin(3x)", -1.1, 1.5),
        shapes,
    )
    notes = ["the car is at the lowest point; it accelerates left or right, or coasts"]
    return Plot(f"{subject.title}: the valley and the goal", [panel], notes=notes)


def draw_encounter(subject: PlottedProblem) -> Plot:
    """Return figure F.8: the state variables of an encounter of two aircraft."""
    problem = subject.problem
    assert isinstance(problem, CollisionAvoidance)
    state = _sample_start(problem)
    height, rate, last_advisory, time = state.tolist()
    advisory = problem.actions[0].labels[ADVISED_RATES.tolist().index(last_advisory)]
    later_height, _, _, later_time = _fly_in_calm_air(problem, state).tolist()
    bound = 1.3 * max(abs(height), abs(later_height), COLLISION_DISTANCE)
    time_height = -0.6 * bound
    shapes: list[Shape] = [
        Polyline([(0.0, 0.0), (time, 0.0)], is_dashed=True),
        Polyline([(0.0, -COLLISION_DISTANCE), (0.0, COLLISION_DISTANCE)]),
        Polyline([(time, 0.0), (time, height)], "both"),
        Polyline([(0.0, time_height), (time, time_height)], "both"),
        Polyline([(time, height), (later_time, later_height)], "end"),
        Label(f"collision: closer than {COLLISION_DISTANCE:g} m", 0.0, COLLISION_DISTANCE),
        Label("", 0.0, 0.0, has_dot=True),
        Label("other aircraft", 0.0, -0.15 * bound),
        Label(f"h = {height:+.0f} m", time, height / 2),
        Label(f"t_col = {time:g} s", time / 2, time_height, "below"),
        Label(f"dh = {rate:+.1f} m/s", later_time, later_height, "left"),
        Label("", time, height, has_dot=True),
        Label(f"our aircraft, a_prev = {advisory}", 0.9 * time, height, "above"),
    ]
    panel = ShapesPanel(
        "",
        Axis("time to collision t_col (s)", -2.0, 1.2 * time),
        Axis("height above the other aircraft h (m)", -bound, bound),
        shapes,
    )
    notes = [
        f"a random starting state (seed {SEED})",
        "dh: vertical rate; its arrow is the flight of "
        f"{CALM_SECONDS} s without an advisory or a gust",
        "a_prev: the last advisory",
    ]
    return Plot(f"{subject.title}: state variables", [panel], notes=notes)


def _fly_in_calm_air(problem: CollisionAvoidance, state: Array) -> Array:
    """Return the state after CALM_SECONDS turns without an advisory or a gust."""
    s, a = state[None], np.array([[problem.parse_action(0, "no-advisory")]], np.int64)
    calm = np.flatnonzero(GUST_ACCELERATIONS == 0)
    for _ in range(CALM_SECONDS):
        s = problem.resolve_events(s, a, (calm,)).state
    return s[0]  # type: ignore[no-any-return]
