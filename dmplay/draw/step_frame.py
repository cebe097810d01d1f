"""A step of an algorithm as rows: title, sentences, formula, and as many pictures as fit."""

from rich.text import Text

from dmplay.algorithms.step import BeliefTable, Curve, Picture, Step
from dmplay.core.problem import Problem
from dmplay.core.text import format_count
from dmplay.draw.canvas import join_beside, measure_text, split_rows, wrap_text
from dmplay.draw.options import DrawOptions
from dmplay.draw.watch_panels import draw_algorithm_picture, measure_belief_table

MIN_SECOND_COLUMNS, MAX_SECOND_COLUMNS = 30, 60  # columns of a second picture beside the first
MIN_WIDE_COLUMNS = 110  # columns from which the first picture leaves space beside it
MIN_SECOND_ROWS, MAX_SECOND_ROWS = 8, 14  # rows of a second picture below the first
MIN_PICTURE_ROWS = 7  # rows that sentences leave for the pictures


def compose_step_rows(step: Step, problem: Problem, options: DrawOptions) -> list[Text]:
    """Return exactly `options.height` rows: the sentences, the formula and the pictures."""
    formula = wrap_text(step.formula, options.width, "bold")
    max_rows, sentence_count = options.height - len(formula) - MIN_PICTURE_ROWS, len(step.sentences)
    sentences = wrap_text(" ".join(step.sentences), options.width)
    while sentence_count > 1 and len(sentences) > max_rows:
        sentence_count -= 1  # The most important sentences come first.
        sentences = wrap_text(" ".join(step.sentences[:sentence_count]), options.width)
    rows = [*sentences, *formula]
    space = options.height - len(rows)
    if space > MIN_PICTURE_ROWS + 2:
        rows.append(Text(""))
    rows += compose_pictures(step, problem, options._replace(height=options.height - len(rows)))
    rows += (Text("") for _ in range(options.height - len(rows)))
    for row in rows:
        row.truncate(options.width)
    return rows[: options.height]


def compose_pictures(step: Step, problem: Problem, options: DrawOptions) -> list[Text]:
    """Return the rows of the pictures that fit, with a note that counts the pictures left out."""
    rows, omitted = _place_pictures(step, problem, options)
    note = format_count(omitted, "more picture")
    free_columns = options.width - (measure_text(rows[-1])[0] if rows else 0)
    if omitted and len(rows) >= options.height > MIN_SECOND_ROWS and free_columns < len(note) + 3:
        rows, omitted = _place_pictures(step, problem, options._replace(height=options.height - 1))
        note = format_count(omitted, "more picture")
    if omitted and len(rows) < options.height:
        rows.append(Text(f"{note} in a larger window"[: options.width], "dim"))
    elif omitted and free_columns >= len(note) + 3:
        rows[-1:] = join_beside([rows[-1:], [Text(note, "dim")]], [0, options.width - len(note)])
    return rows[: max(options.height, 0)]


def _place_pictures(step: Step, problem: Problem, options: DrawOptions) -> tuple[list[Text], int]:
    """Return the rows of the first picture, and the others beside or below it while they fit.

    The number is that of the pictures and panels left out.
    """
    rows: list[Text] = []
    omitted = 0
    for picture in step.pictures:
        columns = measure_text(Text("\n").join(rows))[0] + 3 if rows else 0
        free_columns, free_rows = options.width - columns, options.height - len(rows) - 1
        size = options
        if not columns and len(step.pictures) > 1 and options.width >= MIN_WIDE_COLUMNS:
            first_columns = options.width - _minimum_columns(step.pictures[1]) - 3
            if first_columns >= _minimum_columns(picture):
                size = size._replace(width=first_columns)
        minimum = _minimum_columns(picture)
        is_below = bool(rows) and free_columns < minimum
        if is_below and not (
            free_rows >= MIN_SECOND_ROWS or (free_rows > 0 and isinstance(picture, Curve))
        ):
            omitted += 1
            continue
        if is_below:
            size = options._replace(height=min(free_rows, MAX_SECOND_ROWS))
        elif columns:
            width = min(free_columns, max(MAX_SECOND_COLUMNS, minimum))
            size = size._replace(width=width, height=min(options.height, MAX_SECOND_ROWS))
        text, omitted_panels = draw_algorithm_picture(picture, problem, size)
        drawing = split_rows(text)
        rows = (
            [*rows, Text(""), *drawing] if is_below else join_beside([rows, drawing], [0, columns])
        )
        omitted += omitted_panels
    return rows, omitted


def _minimum_columns(picture: Picture) -> int:
    """Return the minimum number of columns of a picture beside another one."""
    if isinstance(picture, BeliefTable):
        return max(measure_belief_table(picture), MIN_SECOND_COLUMNS)
    return MIN_SECOND_COLUMNS
