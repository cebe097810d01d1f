"""The view of 2048: tiles in boxes, the new tile underlined, and slides animated."""

from collections.abc import Iterator
from functools import cache
from itertools import product
from typing import NamedTuple

import numpy as np
from rich.text import Text

from dmplay.core.arrays import Array, Reals
from dmplay.core.session import View
from dmplay.core.text import format_count
from dmplay.draw import theme
from dmplay.draw.action_hints import (
    MAX_NUMBER_COLUMNS,
    format_regret,
    format_regret_bar,
    sort_regrets,
)
from dmplay.draw.canvas import Canvas, draw_borders, format_percent
from dmplay.draw.options import DrawOptions, Forecast
from dmplay.views.protocol import FinishedGame, Lesson

from .packed_boards import DOWN, RIGHT, UP
from .rules import Game2048, slide_and_score

KEYS = {
    "left": "left", "down": "down", "right": "right", "up": "up",
    "h": "left", "j": "down", "l": "right", "k": "up",
    "a": "left", "s": "down", "d": "right", "w": "up",
}  # fmt: skip
DARK_COLOR, LIGHT_COLOR = 16, 231  # black and white in the ANSI palette
TILE_COLORS = (255, 230, 216, 209, 203, 160, 228, 221, 214, 154, 51, 63, 93, 127, 53, 22)
DARK_TILE_COLORS = {160, 63, 93, 127, 53, 22}  # which need a light number
MARGIN_COLUMNS = 7  # columns on each side of the board for the regret of a slide that way
ARROWS = "←↓→↑"  # indexed by action
ACTIONS_TOP_TO_BOTTOM = (3, 0, 2, 1)  # actions by the side they slide to, from top to bottom
EMPTY_GLYPH = "·"
HAS_MOTION = True  # turns are animated


class BoxLayout(NamedTuple):
    """The size of a cell in columns and rows, and the rows of the border between cells."""

    width: int
    height: int
    border_rows: int = 1

    def get_cell_origin(self, row: float, column: float) -> tuple[int, int]:
        """Return the column and row where a cell begins; fractions lie between two cells."""
        x, y = 1 + column * (self.width + 1), 1 + row * (self.height + self.border_rows)
        return round(x), round(y)

    @property
    def border_position(self) -> tuple[int, int]:
        """The column of the right border and the row of the bottom border."""
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
    """A tile to draw, in a cell or, while it slides, between two cells."""

    row: float
    column: float
    exponent: int
    text: str
    is_new: bool = False


def _format_tile(exponent: int) -> str:
    """Return the number of a tile as text, or a dot for an empty cell."""
    return str(2**exponent) if exponent else EMPTY_GLYPH


def get_tile_style(exponent: int) -> str:
    """Return the style of a tile: the palette colours of its number and its background."""
    if not exponent:
        return "dim"
    tile_color = TILE_COLORS[min(exponent, len(TILE_COLORS)) - 1]
    text_color = LIGHT_COLOR if tile_color in DARK_TILE_COLORS else DARK_COLOR
    return f"bold color({text_color}) on color({tile_color})"


def _find_new_tile(view: View[Game2048]) -> tuple[int, ...] | None:
    """Return the (row, column) of the tile added in the last turn, or None if there is none."""
    if not view.turns_played:
        return None
    before, after = view.observations[-2], view.observations[-1]
    slid_boards, _ = slide_and_score(before[None], np.array([int(view.actions[-1])]))
    changed_cells = np.argwhere(slid_boards[0] != after)
    return tuple(changed_cells[0]) if len(changed_cells) else None


class DisplayedBoard(NamedTuple):
    """A board to draw, with its new tile, and a forecast or sliding tiles if there are any."""

    board: Array  # [4, 4]
    new_tile: tuple[int, ...] | None = None
    title: str = ""
    arrival_probabilities: Reals | None = None  # [4, 4], that a tile arrives in each cell
    sliding_tiles: tuple[DrawnTile, ...] = ()  # tiles between cells, drawn over the board

    @property
    def tiles(self) -> list[DrawnTile]:
        """The tiles to draw: a number, dot or arrival probability per cell, then sliding tiles."""
        cells = product(range(4), repeat=2)
        return [*(self._make_tile(*cell) for cell in cells), *self.sliding_tiles]

    def _make_tile(self, row: int, column: int) -> DrawnTile:
        """Return the tile to draw in a cell."""
        exponent = int(self.board[row, column])
        text = _format_tile(exponent)
        if self.arrival_probabilities is not None:
            text = format_percent(self.arrival_probabilities[row, column]) or text
        return DrawnTile(row, column, exponent, text, (row, column) == self.new_tile)


def _choose_displayed_board(view: View[Game2048], options: DrawOptions) -> DisplayedBoard:
    """Return the board as it is, after the forecast slide, or during the animated slide."""
    if options.forecast is not None:
        return _forecast_board(view, options.forecast)
    if options.motion_progress < 1 and view.turns_played:
        before, action = view.observations[-2], int(view.actions[-1])
        tiles = (*iter_sliding_tiles(before, action, options.motion_progress),)
        return DisplayedBoard(np.zeros_like(before), sliding_tiles=tiles)
    return DisplayedBoard(view.observation, _find_new_tile(view))


def iter_sliding_tiles(board: Array, action: int, motion_progress: float) -> Iterator[DrawnTile]:
    """Yield the tiles of a board while it slides.

    `motion_progress` is the part of the slide that is over, from 0 to 1.
    """
    for line in range(4):
        target, previous = -1, 0
        for offset in range(4):
            start = _locate_cell(action, line, offset)
            exponent = int(board[start])
            if not exponent:
                continue
            merges = exponent == previous
            target, previous = (target, 0) if merges else (target + 1, exponent)
            end = _locate_cell(action, line, target)
            pairs = zip(start, end, strict=True)
            row, column = ((1 - motion_progress) * a + motion_progress * b for a, b in pairs)
            yield DrawnTile(row, column, exponent, _format_tile(exponent))


def _locate_cell(action: int, line: int, offset: int) -> tuple[int, int]:
    """Return the cell of a line at an offset from the edge that a slide goes to."""
    position = 3 - offset if action in (DOWN, RIGHT) else offset
    return (position, line) if action in (DOWN, UP) else (line, position)


def _forecast_board(view: View[Game2048], forecast: Forecast) -> DisplayedBoard:
    """Return the board after the forecast slide, with the probabilities of where a tile arrives."""
    action = int(forecast.action)
    (slid_board,), (reward,) = slide_and_score(view.observation[None], np.array([action]))
    arrivals = (forecast.outcomes != slid_board) * forecast.probabilities[:, None, None]
    title = f" {view.problem.format_action(0, action)} pays {reward:g} "
    return DisplayedBoard(slid_board, None, title, arrivals.sum(axis=0))


def iter_boards(view: View[Game2048], options: DrawOptions) -> Iterator[Text]:
    """Yield the boards that fit, the largest boxes first, and last a board without borders."""
    displayed = _choose_displayed_board(view, options)
    for boxes in BOX_LAYOUTS if options.allow_large else TRANSCRIPT_LAYOUTS:
        right, bottom = boxes.border_position
        if right < options.width and bottom < options.height:
            yield _draw_boxed_board(displayed, boxes, options)
    canvas = Canvas()
    for tile in displayed.tiles:
        position = round(5 * tile.column), round(tile.row)
        _draw_tile(canvas, position, tile.text.rjust(5), tile)
    for row, action in enumerate(ACTIONS_TOP_TO_BOTTOM):
        if regret_text := format_regret(options, action):
            canvas.write_text(22, row, f"{ARROWS[action]} {regret_text}", theme.CHOICE)
    yield canvas.to_text()


def _draw_boxed_board(displayed: DisplayedBoard, boxes: BoxLayout, options: DrawOptions) -> Text:
    """Return a board drawn in boxes, with margins for the regrets if there are hints."""
    left = 0 if options.regret is None else MARGIN_COLUMNS
    right, bottom = boxes.border_position
    canvas = _draw_borders(boxes, left).copy()
    for tile in displayed.tiles:
        x, y = boxes.get_cell_origin(tile.row, tile.column)
        for row in range(y, y + boxes.height):
            canvas.write_text(left + x, row, " " * boxes.width, get_tile_style(tile.exponent))
        if not options.allow_large or tile.text != EMPTY_GLYPH:
            middle = left + x, y + boxes.height // 2
            _draw_tile(canvas, middle, tile.text.center(boxes.width), tile)
    _draw_forecast_and_regrets(canvas, displayed, options, (left, right, bottom))
    return canvas.to_text()


@cache
def _draw_borders(boxes: BoxLayout, left: int) -> Canvas:
    """Draw the borders of the board and of its cells."""
    canvas = Canvas()
    draw_borders(canvas, left, 4, (boxes.width, boxes.height), boxes.border_rows)
    return canvas


def _draw_forecast_and_regrets(
    canvas: Canvas, displayed: DisplayedBoard, options: DrawOptions, area: tuple[int, int, int]
) -> None:
    """Draw the title of the forecast, and at each edge the regret of a slide that way."""
    left, width, height = area  # column of the left border; offsets of the right and bottom borders
    long_title = f"{displayed.title.rstrip()}; %: chance of a new tile "
    title = long_title if displayed.title and len(long_title) < width else displayed.title
    canvas.write_text(left + 1, 0, title, "bold")
    for action in sort_regrets(options):
        if title and action == UP:
            continue  # The title is at its place.
        arrow = ARROWS[action]
        number_columns = MAX_NUMBER_COLUMNS if action in {UP, DOWN} else MARGIN_COLUMNS - 1
        regret_text = format_regret(options, action, number_columns)
        regret_bar = format_regret_bar(options, action, MARGIN_COLUMNS - 2)
        style = theme.BEST if regret_text == "best" else theme.CHOICE
        if arrow in "↑↓":
            text = f" {arrow} {regret_text} {regret_bar}".rstrip() + " "
            x, y = left + (width - len(text)) // 2, 0 if arrow == "↑" else height
            canvas.write_text(x, y, text, style)
            continue
        for y, text in enumerate((arrow, regret_text, regret_bar), height // 2 - 1):
            x = left - 1 - len(text) if arrow == "←" else left + width + 2
            canvas.write_text(x, y, text, style)


def _draw_tile(canvas: Canvas, position: tuple[int, int], text: str, tile: DrawnTile) -> None:
    """Draw the text of a tile; in a new tile only the number is underlined."""
    (x, y), style = position, get_tile_style(tile.exponent)
    canvas.write_text(x, y, text, style)
    if tile.is_new:
        canvas.write_text(x + len(text) - len(text.lstrip()), y, text.strip(), f"{style} underline")


def describe_keys(view: View[Game2048]) -> dict[str, str]:
    """Return the effect of the keys that slide nothing."""
    labels, mask = view.problem.actions[view.seat].labels, view.legal_actions_mask
    pairs = [] if mask is None else zip(labels, mask, strict=True)
    return {label: "moves nothing" for label, is_legal in pairs if not is_legal}


def goal_lines(view: View[Game2048]) -> list[str]:
    """Return the scoring rule, the end of the game and the probability of a new 2, as clauses."""
    return [
        "score as many points as possible",
        "a merge of equal tiles pays the new tile",
        "no slide possible: game over",
        f"{format_percent(view.problem.p_two)} of new tiles are 2, the others 4",
    ]


def lesson(view: View[Game2048]) -> Lesson:
    """Return the three sentences that introduce the problem: role, objective and costs."""
    return Lesson(
        "You slide all tiles of a 4x4 board at the same time, to one of its four sides",
        "You want merges: two equal tiles that meet become one tile, which pays its value",
        f"A slide is free and adds a tile; {format_percent(view.problem.p_two) or '0%'} of new "
        "tiles are 2, the others 4; the game ends when no slide is possible",
        "left",
    )


def panel_rows(view: View[Game2048]) -> list[tuple[str, str]]:
    """Return the panel row of the largest tile; the score is in the title of the screen."""
    return [("largest", _format_tile(int(view.observation.max())))]


def describe_turn(view: View[Game2048]) -> str:
    """Return a description of the last slide and of the new tile."""
    new_cell = _find_new_tile(view)
    if new_cell is None:
        return f"slid {view.last_action_label}."
    (row, column), number = new_cell, _format_tile(int(view.observation[new_cell]))
    return f"slid {view.last_action_label}. new {number} in row {row + 1}, column {column + 1}."


def describe_situation(view: View[Game2048]) -> str:
    """Return a description of the rows, from the top, and of the legal slides."""
    cells = [[_format_tile(int(e)) if e else "empty" for e in row] for row in view.observation]
    rows = [f"row {number}: {' '.join(texts)}." for number, texts in enumerate(cells, 1)]
    legal_actions = view.problem.actions[view.seat].describe_actions(view.legal_actions_mask)
    is_over = view.end_reason or not legal_actions
    return " ".join([*rows, "the game is over." if is_over else f"legal: {legal_actions}."])


def describe_end(game: FinishedGame[Game2048]) -> str:
    """Return the largest tile, whether the board is stuck, and the slides to a corner."""
    boards = game.states[1:]
    largest = _format_tile(int(game.states[-1].max()))
    corners = boards[:, ::3, ::3].max(axis=(1, 2), initial=0)
    cornered = int((corners == boards.max(axis=(1, 2), initial=0)).sum())
    slides = format_count(len(game.actions), "slide")
    end = f"; after {slides}, nothing moves" if game.is_terminal else f" in {slides}"
    only = "only " if 2 * cornered < len(game.actions) else ""
    corner_text = "the largest tile was in a corner, out of the way"
    return (
        f"{game.player} reached the tile {largest}{end}; {corner_text}, {only}after {cornered} of "
        "them"
    )
