"""How 2048 looks: the board in boxes, the new tile underlined; slides are seen to happen."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.chance import Array, Reals
from dmplay.problems.game_2048 import Game2048, slide_and_score
from dmplay.session import View
from dmplay.tiles import DOWN, RIGHT, UP
from dmplay.views._advice import MAX_NUMBER_COLUMNS, format_regret, format_regret_bar, sort_regrets
from dmplay.views.canvas import Canvas, format_percent
from dmplay.views.style import DrawOptions, Forecast, Lesson

KEYS = {
    "left": "left", "down": "down", "right": "right", "up": "up",
    "h": "left", "j": "down", "l": "right", "k": "up",
    "a": "left", "s": "down", "d": "right", "w": "up",
}  # fmt: skip
DARK_COLOR, LIGHT_COLOR = 16, 231  # numbers of the palette: black and white
TILE_COLORS = (
    (DARK_COLOR, 255), (DARK_COLOR, 230), (DARK_COLOR, 216), (DARK_COLOR, 209), (DARK_COLOR, 203), (LIGHT_COLOR, 160), (DARK_COLOR, 228),
    (DARK_COLOR, 221), (DARK_COLOR, 214), (DARK_COLOR, 154), (DARK_COLOR, 51), (LIGHT_COLOR, 63), (LIGHT_COLOR, 93), (LIGHT_COLOR, 127),
    (LIGHT_COLOR, 53), (LIGHT_COLOR, 22),
)  # fmt: skip
MARGIN_COLUMNS = 7  # columns at either side for what is lost by a slide that way
ARROWS = "←↓→↑"  # by action
ACTIONS_TOP_TO_BOTTOM = (3, 0, 2, 1)  # the actions by where they lead
EMPTY_GLYPH = "·"
HAS_MOTION = True  # a turn is seen to happen


class BoxLayout(NamedTuple):
    """Columns and rows of a cell, and of the lines between two rows of them."""

    width: int
    height: int
    border_rows: int = 1

    def get_cell_origin(self, row: float, column: float) -> tuple[int, int]:
        """Where a cell begins within the board; between two cells where it slides."""
        return round(1 + column * (self.width + 1)), round(
            1 + row * (self.height + self.border_rows)
        )

    @property
    def border_position(self) -> tuple[int, int]:
        """The column and the row of the border at the right and at the bottom."""
        x, y = self.get_cell_origin(4, 4)
        return x - 1, y - self.border_rows


BOX_LAYOUTS = (
    BoxLayout(9, 5),
    BoxLayout(9, 3),
    BoxLayout(7, 3),
    BoxLayout(6, 1),
    BoxLayout(5, 1),
    BoxLayout(5, 1, 0),
)
TRANSCRIPT_LAYOUTS = BOX_LAYOUTS[3:5]


class DrawnTile(NamedTuple):
    """What stands in a cell, or between two."""

    row: float
    column: float
    exponent: int
    text: str
    is_new: bool = False


def _format_tile(exponent: int) -> str:
    return str(2**exponent) if exponent else EMPTY_GLYPH


def get_tile_style(exponent: int) -> str:
    """A tile's number and its filling, from the palette."""
    if not exponent:
        return "dim"
    number, filling = TILE_COLORS[min(exponent, len(TILE_COLORS)) - 1]
    return f"bold color({number}) on color({filling})"


def _find_new_tile(view: View[Game2048]) -> tuple[int, ...] | None:
    """The cell of the tile that came last."""
    if not view.turns_played:
        return None
    before, after = view.observations[-2], view.observations[-1]
    slid, _ = slide_and_score(before[None], np.array([int(view.actions[-1])]))
    found = np.argwhere(slid[0] != after)
    return tuple(found[0]) if len(found) else None


class DisplayedBoard(NamedTuple):
    """A board, the cell of its new tile, and if a slide is foreseen what it says and brings."""

    board: Array  # [4, 4]
    new_tile: tuple[int, ...] | None = None
    title: str = ""
    arrival_probabilities: Reals | None = None  # [4, 4], of a tile to come there
    sliding_tiles: tuple[DrawnTile, ...] = ()  # tiles on their way, above the board

    @property
    def tiles(self) -> list[DrawnTile]:
        """What is drawn: in a cell a number, a dot, or how likely a tile comes there."""
        return [
            *(self._make_tile(row, column) for row in range(4) for column in range(4)),
            *self.sliding_tiles,
        ]

    def _make_tile(self, row: int, column: int) -> DrawnTile:
        exponent = int(self.board[row, column])
        chance = (
            0.0
            if self.arrival_probabilities is None
            else float(self.arrival_probabilities[row, column])
        )
        text = format_percent(chance) or _format_tile(exponent)
        return DrawnTile(row, column, exponent, text, (row, column) == self.new_tile)


def _choose_displayed_board(view: View[Game2048], options: DrawOptions) -> DisplayedBoard:
    """The board as it is, or after a slide that is foreseen, or while a slide is under way."""
    if options.forecast is not None:
        return _forecast_board(view, options.forecast)
    if options.motion_progress < 1 and view.turns_played:
        before, action = view.observations[-2], int(view.actions[-1])
        return DisplayedBoard(
            np.zeros_like(before),
            sliding_tiles=(*_iter_sliding_tiles(before, action, options.motion_progress),),
        )
    return DisplayedBoard(view.observation, _find_new_tile(view))


def _iter_sliding_tiles(board: Array, action: int, motion_progress: float) -> Iterator[DrawnTile]:
    """The tiles of a board when a share of the slide has passed."""
    for line in range(4):
        place, last = -1, 0
        for at in range(4):
            begin = _locate_cell(action, line, at)
            exponent = int(board[begin])
            if not exponent:
                continue
            merges = exponent == last
            place, last = (place, 0) if merges else (place + 1, exponent)
            end = _locate_cell(action, line, place)
            row, column = (
                (1 - motion_progress) * a + motion_progress * b
                for a, b in zip(begin, end, strict=True)
            )
            yield DrawnTile(row, column, exponent, _format_tile(exponent))


def _locate_cell(action: int, line: int, offset: int) -> tuple[int, int]:
    """The cell so far from the edge that a slide goes to."""
    place = 3 - offset if action in (DOWN, RIGHT) else offset
    return (place, line) if action in (DOWN, UP) else (line, place)


def _forecast_board(view: View[Game2048], forecast: Forecast) -> DisplayedBoard:
    """The board after a slide, before a tile comes."""
    action = int(forecast.action)
    (slid,), (pay,) = slide_and_score(view.observation[None], np.array([action]))
    came = (forecast.outcomes != slid) * forecast.probabilities[:, None, None]
    return DisplayedBoard(
        slid, None, f" {view.problem.format_action(0, action)} pays {pay:g} ", came.sum(axis=0)
    )


def iter_boards(view: View[Game2048], options: DrawOptions) -> Iterator[Text]:
    """The board in the boxes there is room for, the largest first, and in rows without borders."""
    shown = _choose_displayed_board(view, options)
    for boxes in BOX_LAYOUTS if options.allow_large else TRANSCRIPT_LAYOUTS:
        right, bottom = boxes.border_position
        if right < options.width and bottom < options.height:
            yield _draw_boxed_board(shown, boxes, options)
    canvas = Canvas()
    for tile in shown.tiles:
        place = round(5 * tile.column), round(tile.row)
        _draw_tile(canvas, place, tile.text.rjust(5), tile)
    for row, action in enumerate(ACTIONS_TOP_TO_BOTTOM):
        if loss := format_regret(options, action):
            canvas.write_text(22, row, f"{ARROWS[action]} {loss}", "green")
    yield canvas.to_text()


def _draw_boxed_board(displayed: DisplayedBoard, boxes: BoxLayout, options: DrawOptions) -> Text:
    """The board in boxes."""
    canvas, left = Canvas(), 0 if options.regret is None else MARGIN_COLUMNS
    right, bottom = boxes.border_position
    _draw_borders(canvas, boxes, left)
    for tile in displayed.tiles:
        x, y = boxes.get_cell_origin(tile.row, tile.column)
        for row in range(y, y + boxes.height):
            canvas.write_text(left + x, row, " " * boxes.width, get_tile_style(tile.exponent))
        if not options.allow_large or tile.text != EMPTY_GLYPH:
            middle = left + x, y + boxes.height // 2
            _draw_tile(canvas, middle, tile.text.center(boxes.width), tile)
    _draw_margins(canvas, displayed, options, (left, right, bottom))
    return canvas.to_text()


def _draw_borders(canvas: Canvas, boxes: BoxLayout, left: int) -> None:
    """The borders of the board and of its cells."""
    bottom = boxes.border_position[1]
    for y in range(bottom + 1):
        canvas.write_text(left, y, "│".join(["", *[" " * boxes.width] * 4, ""]), "dim")
    for row, ends in enumerate(("┌┬┐", "├┼┤", "├┼┤", "├┼┤", "└┴┘")):
        if boxes.border_rows or ends[1] != "┼":
            line = ends[0] + ends[1].join(["─" * boxes.width] * 4) + ends[2]
            y = bottom if row == 4 else boxes.get_cell_origin(row, 0)[1] - 1
            canvas.write_text(left, y, line, "dim")


def _draw_margins(
    canvas: Canvas, displayed: DisplayedBoard, options: DrawOptions, area: tuple[int, int, int]
) -> None:
    """What is foreseen, and at each edge what is lost by a slide that way."""
    left, width, height = area  # of the board, its borders included
    canvas.write_text(left + 1, 0, displayed.title, "bold")
    for action in sort_regrets(options):
        arrow, loss, bars = (
            ARROWS[action],
            format_regret(
                options, action, MAX_NUMBER_COLUMNS if action in {UP, DOWN} else MARGIN_COLUMNS - 1
            ),
            format_regret_bar(options, action, MARGIN_COLUMNS - 2),
        )
        style = "bold green" if loss == "best" else "green"
        if arrow in "↑↓":
            told = f" {arrow} {loss} {bars}".rstrip() + " "
            canvas.write_text(
                left + (width - len(told)) // 2, 0 if arrow == "↑" else height, told, style
            )
            continue
        for y, told in enumerate((arrow, loss, bars), height // 2 - 1):
            canvas.write_text(
                left - 1 - len(told) if arrow == "←" else left + width + 2, y, told, style
            )


def _draw_tile(canvas: Canvas, position: tuple[int, int], text: str, tile: DrawnTile) -> None:
    """Writes a tile; of a new one the number alone is underlined."""
    (x, y), style = position, get_tile_style(tile.exponent)
    canvas.write_text(x, y, text, style)
    if tile.is_new:
        canvas.write_text(x + len(text) - len(text.lstrip()), y, text.strip(), f"{style} underline")


def goal_lines(view: View[Game2048]) -> list[str]:
    """What pays, what comes, and what ends it."""
    return [
        "merge equal tiles: each new one pays its number",
        "it ends when nothing slides",
        f"{format_percent(view.problem.p_two)} of the tiles that come are 2, the others 4",
    ]


def lesson(view: View[Game2048]) -> Lesson:
    """The slides, what pays, and what comes after each."""
    return Lesson(
        "You slide all tiles of a board of four by four at once, to one of its four sides",
        "You want merges: two equal tiles that meet become one, which pays its number",
        f"A slide is free, but then a tile comes, {format_percent(view.problem.p_two) or '0%'} of them 2 "
        "and the others 4, and when nothing slides any more it is over",
        "left",
    )


def panel_rows(view: View[Game2048]) -> list[tuple[str, str]]:
    """The largest tile; the title has the score."""
    return [("largest", _format_tile(int(view.observation.max())))]


def describe_turn(view: View[Game2048]) -> str:
    """The slide and the new tile."""
    new = _find_new_tile(view)
    if new is None:
        return f"slid {view.last_action_label}."
    tile = _format_tile(int(view.observation[new]))
    return f"slid {view.last_action_label}. new {tile} in row {new[0] + 1}, column {new[1] + 1}."


def describe_situation(view: View[Game2048]) -> str:
    """The rows from the top, then the slides that are open."""
    rows = [
        f"row {number}: {' '.join('empty' if not e else _format_tile(int(e)) for e in row)}."
        for number, row in enumerate(view.observation, 1)
    ]
    can = view.problem.actions[view.seat].describe_actions(view.legal_actions_mask)
    return " ".join([*rows, f"open: {can or 'nothing, the game is over'}."])
