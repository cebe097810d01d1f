"""The reader of lesson files: TOML, checked key by key."""

import inspect
import math
import unicodedata
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from functools import partial
from pathlib import Path

from dmplay.algorithms import registry
from dmplay.core.toml_files import read_toml
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.registry.problems import LoadedProblem, resolve_problem
from dmplay.tutor.lesson import (
    LOOKING_BACK,
    OVER,
    PLAYING,
    GameTask,
    LessonStep,
    PositionText,
    Prediction,
    QuantityCall,
    ScreenNote,
    TutorLesson,
)
from dmplay.tutor.progress import make_step_keys
from dmplay.tutor.quantity import QUANTITIES, Quantity, find_quantity

MAX_TEXT_LINES, MAX_COLUMNS, MAX_SENTENCE_CHARS = 4, 80, 160
UNSET_CONDITIONS: tuple[object, ...] = ("", {})  # values of conditions that a task does not have
MAX_STEPS, MAX_MINUTES, MAX_GOAL_COLUMNS, MAX_TITLE_COLUMNS = 8, 10, 76, 60
MAX_TURNS, MAX_TEXTS = 10_000, 1000  # of a position, so that it opens within seconds
MULTI_LINE_KEYS = ("text", "hint", "learned")
# What the value of a key may look like, for messages.
EXAMPLES: Mapping[str, str] = {
    "title": '"What a cry tells"', "problem": '"crying-baby"', "after": '["feed", "ignore"]',
    "parameters": "{ noise = 0.5 }", "seats": '{ agent2 = "grim" }', "position": "[position]",
    "choices": "{ examine = 1 }", "choices_at_most": "{ examine = 1 }", "quantity": '"belief"',
    "belief": '"hungry 0.3 sated 0.7"', "history": '["feed crying"]', "state": '"hungry"',
    "action": '"feed"', "agent": '"grim"', "rounds": '["cooperate defect"]',
    "states": '["(1,1)", "(2,1)"]', "opponent": '"rock 0.5 paper 0.5"',
    "actions": '["defect", "cooperate"]', "candidates": '["grim", "tit-for-tat"]',
    "outcome": '"(2,0)"', "exit_state": '"(9,0)"', "observation": '"crying"', "below": '"ignore"',
    "above": '"feed"', "watch": '"value-iteration"', "reaches": '"(9,0)"', "beats": '"optimal"',
}  # fmt: skip
GAME_PHASES = (PLAYING, OVER, LOOKING_BACK)
POSITION_KEYS = ("problem", "parameters", "seed", "turns", "seats", "after")


class TableReader:
    """A table of a lesson file; each of its methods takes one key and checks its value."""

    def __init__(self, table: Mapping[str, object], location: str) -> None:
        self.location = location
        self._table = dict(table)
        self._known_keys: list[str] = []

    def pop_value(self, key: str, kind: type | tuple[type, ...], expected: str) -> object | None:
        """Return the value of a key, None if it is missing; raise BadParameter for another type."""
        self._known_keys.append(key)
        value = self._table.pop(key, None)
        is_wrong_bool = isinstance(value, bool) and kind is not bool
        if value is not None and (is_wrong_bool or not isinstance(value, kind)):
            example = f", for example {key} = {EXAMPLES[key]}" if key in EXAMPLES else ""
            raise self.make_error(key, f"got {value!r}, expected {expected}{example}")
        return value

    def make_error(self, key: str, message: str) -> BadParameter:
        """Return the error for a key of this table."""
        path, _, table_name = self.location.partition(": ")
        return BadParameter(f"{path}: {table_name + '.' if table_name else ''}{key}: {message}")

    def read_text(
        self, key: str, default: str | None = None, max_columns: int = MAX_SENTENCE_CHARS
    ) -> str:
        """Return a text; raise BadParameter if it is too long, or missing and has no default."""
        value = self.pop_value(key, str, "a text")
        if value is None and default is None:
            similar = get_close_matches(key, self._table, 1)
            misspelled = f"; got the key {similar[0]!r}" if similar else ""
            raise self.make_error(key, f"missing, expected a text{misspelled}")
        text = str(default if value is None else value).strip()
        if key not in MULTI_LINE_KEYS and len(text) > max_columns:
            raise self.make_error(key, f"got {len(text)} columns, expected at most {max_columns}")
        return text

    def read_lines(self, key: str) -> tuple[str, ...]:
        """Return the lines of a text; raise BadParameter if they are too many or too long."""
        rows = tuple(row.strip() for row in self.read_text(key).splitlines())
        if not 1 <= len(rows) <= MAX_TEXT_LINES:
            raise self.make_error(key, f"got {len(rows)} lines, expected 1 to {MAX_TEXT_LINES}")
        for number, row in enumerate(rows, 1):
            if len(row) > MAX_COLUMNS:
                expected = f"expected at most {MAX_COLUMNS}"
                raise self.make_error(key, f"line {number}: got {len(row)} columns, {expected}")
        return rows

    def read_sentence(self, key: str) -> str:
        """Return a text as one line; raise BadParameter if it is too long."""
        sentence = " ".join(self.read_text(key).split())
        if not 1 <= len(sentence) <= MAX_SENTENCE_CHARS:
            expected = f"expected 1 to {MAX_SENTENCE_CHARS}"
            raise self.make_error(key, f"got {len(sentence)} characters, {expected}")
        return sentence

    def read_number(self, key: str) -> float | None:
        """Return a number, None if it is missing; raise BadParameter if it is not finite."""
        value = self.pop_value(key, (int, float), "a number")
        if value is not None and not math.isfinite(float(str(value))):
            raise self.make_error(key, f"got {value}, expected a finite number")
        return None if value is None else float(str(value))

    def read_whole_number(self, key: str, low: int = 0, high: float = math.inf) -> int | None:
        """Return a whole number from `low` to `high`, or None if it is missing."""
        value = self.pop_value(key, int, f"a whole number, {low} or more")
        if isinstance(value, int) and not low <= value <= high:
            bounds = f"{low} or more" if high == math.inf else f"{low} to {high}"
            raise self.make_error(key, f"got {value}, expected {bounds}")
        return value if isinstance(value, int) else None

    def read_switch(self, key: str, *, default: bool = False) -> bool:
        """Return true or false."""
        value = self.pop_value(key, bool, "true or false")
        return default if value is None else bool(value)

    def read_table(self, key: str) -> dict[str, object] | None:
        """Return a table, or None if it is missing."""
        value = self.pop_value(key, dict, "a table")
        return dict(value) if isinstance(value, dict) else None

    def read_texts(self, key: str) -> tuple[str, ...]:
        """Return a list of texts, empty if it is missing; raise BadParameter for another value."""
        value = self.pop_value(key, list, "a list of texts")
        if value is None:
            return ()
        assert isinstance(value, list)
        if not all(isinstance(entry, str) for entry in value):
            raise self.make_error(key, f"got {value!r}, expected a list of texts")
        if len(value) > MAX_TEXTS:
            raise self.make_error(key, f"got {len(value)} texts, expected at most {MAX_TEXTS}")
        return tuple(value)

    def read_text_table(self, key: str) -> dict[str, str]:
        """Return a table of texts, empty if it is missing; raise BadParameter for other values."""
        table = self.read_table(key) or {}
        for name, value in table.items():
            if not isinstance(value, str):
                raise self.make_error(f"{key}.{name}", f"got {value!r}, expected a text")
        return {name: str(value) for name, value in table.items()}

    def read_count_table(self, key: str) -> dict[str, int]:
        """Return a table of whole numbers, empty if it is missing."""
        reader = TableReader(self.read_table(key) or {}, f"{self.location}.{key}")
        return {name: reader.read_whole_number(name) or 0 for name in [*reader.unread_values]}

    @property
    def unread_values(self) -> dict[str, object]:
        """The keys that were not taken, with their values."""
        return self._table

    def check_all_read(self) -> None:
        """Raise UnknownName if the table has a key that was not taken."""
        for key in self._table:
            raise UnknownName("key", key, self._known_keys, f"{self.location}: ")


def read_lesson(
    path: Path, number: int, *, is_builtin: bool = False, trusted: bool = False
) -> TutorLesson:
    """Return the lesson in a file; raise BadFile or BadParameter if it is not a valid lesson.

    Quantities that only a problem's own code defines are not checked unless that code is trusted.
    """
    content = read_toml(path)
    _check_characters(content, str(path))
    table = TableReader(content, str(path))
    position = table.read_table("position")
    if position is None:
        raise table.make_error("position", "missing, expected a table with the key problem")
    step_tables = table.pop_value("steps", list, "tables [[steps]]") or []
    assert isinstance(step_tables, list)
    if not 1 <= len(step_tables) <= MAX_STEPS:
        raise table.make_error("steps", f"got {len(step_tables)}, expected 1 to {MAX_STEPS}")
    minutes = table.read_whole_number("minutes", 1, MAX_MINUTES) or MAX_MINUTES
    lesson = TutorLesson(
        path,
        number,
        table.read_text("title", None, MAX_TITLE_COLUMNS),
        table.read_text("chapter", "", MAX_TITLE_COLUMNS),
        minutes,
        tuple(
            _read_step(step, position, f"{path}: steps[{index}]", path.parent, trusted=trusted)
            for index, step in enumerate(step_tables, 1)
        ),
        is_builtin,
    )
    table.check_all_read()
    return replace(lesson, step_keys=make_step_keys(content, path.parent))


def _check_characters(value: object, location: str, *, can_have_lines: bool = False) -> None:
    """Raise BadParameter if a text has a control character, which could forge a line on the screen.

    Only the texts of MULTI_LINE_KEYS may have several lines.
    """
    if isinstance(value, dict):
        for key, entry in value.items():
            _check_characters(key, location)
            _check_characters(entry, f"{location}: {key}", can_have_lines=key in MULTI_LINE_KEYS)
    elif isinstance(value, list):
        for entry in value:
            _check_characters(entry, location)
    elif isinstance(value, str):
        lines = value.strip().split("\n") if can_have_lines else [value.strip()]
        for line in lines:
            control = next((c for c in line.strip() if unicodedata.category(c) == "Cc"), "")
            if control:
                raise BadParameter(f"{location}: got the character {control!r}, expected one line")


def _read_step(
    data: object,
    lesson_position: Mapping[str, object],
    location: str,
    folder: Path,
    *,
    trusted: bool,
) -> LessonStep:
    """Return one step of a lesson in a folder; its own position changes that of the lesson."""
    if not isinstance(data, dict):
        raise BadParameter(f"{location}: got {data!r}, expected a table")
    table = TableReader(data, location)
    own_position = table.read_table("position") or {}
    prediction, game = table.read_table("predict"), table.read_table("play")
    if (prediction is None) == (game is None):
        raise BadParameter(f"{location}: expected one of the tables predict and play")
    text = table.read_lines("text")
    position = _read_position({**lesson_position, **own_position}, f"{location}.position")
    load_problem = partial(
        resolve_problem, position.problem, position.parameters, trusted=trusted, folder=folder
    )
    step = LessonStep(
        text,
        position,
        _read_prediction(prediction, f"{location}.predict", load_problem)
        if prediction is not None
        else _read_game_task(game or {}, f"{location}.play"),
        table.read_sentence("hint"),
        table.read_sentence("learned"),
        table.read_text("book", ""),
    )
    table.check_all_read()
    return step


def _read_position(data: Mapping[str, object], location: str) -> PositionText:
    """Return the position of a table."""
    table = TableReader(data, location)
    position = PositionText(
        table.read_text("problem"),
        table.read_table("parameters") or {},
        table.read_whole_number("seed") or 0,
        table.read_whole_number("turns", 1, MAX_TURNS),
        table.read_text_table("seats"),
        table.read_texts("after"),
    )
    table.check_all_read()
    return position


def _read_prediction(
    data: Mapping[str, object], location: str, load_problem: Callable[[], LoadedProblem]
) -> Prediction:
    """Return the question of a table, whose other keys are arguments of the quantity.

    Those of a quantity whose problem cannot be loaded are not checked.
    """
    table = TableReader(data, location)
    name, asks = table.read_text("quantity"), table.read_text("asks", "")
    tolerance = table.read_number("tolerance") or 0.0
    at_least, at_most = table.read_number("at_least"), table.read_number("at_most")
    result, shows_board = table.read_text("result", ""), table.read_switch("board", default=True)
    watch, watch_first = table.read_text("watch", ""), table.read_switch("watch_first")
    try:
        quantity = _find_quantity(name, load_problem)
        if watch:
            registry.find_algorithm(watch)
    except (BadParameter, UnknownName) as error:
        raise BadParameter(f"{location}: {error}") from None
    arguments = _read_arguments(table, quantity, asks) if quantity else table.unread_values
    if asks and at_least is None and at_most is None:
        raise table.make_error("asks", "expected at_least or at_most too, the bounds of the value")
    if watch_first and not watch:
        raise table.make_error("watch_first", "expected watch too, the algorithm")
    call = QuantityCall(name, arguments)
    return Prediction(
        call, asks, tolerance, at_least, at_most, result, shows_board, watch, watch_first
    )


def _find_quantity(name: str, load_problem: Callable[[], LoadedProblem]) -> Quantity | None:
    """Return a quantity; None if it is not a general one, and the problem cannot be loaded."""
    if name in QUANTITIES:
        return QUANTITIES[name]
    try:
        loaded = load_problem()
    except DmplayError:  # an error when the step begins, but not in a list of lessons
        return None
    return find_quantity(name, loaded.problem, loaded.name)


def _read_arguments(table: TableReader, quantity: Quantity, asks: str) -> dict[str, object]:
    """Return the arguments of a quantity; raise an error for missing, unknown or wrong ones."""
    parameters = quantity.parameters
    names = [name for name in parameters if parameters[name].annotation in (str, int, float)]
    if asks and asks not in names:
        raise table.make_error("asks", str(UnknownName("parameter", asks, names)))
    arguments: dict[str, object] = {}
    for name, parameter in parameters.items():
        if name == asks:
            continue
        value = _read_argument(table, name, parameter.annotation)
        if value is not None:
            arguments[name] = value
        elif parameter.default is inspect.Parameter.empty:
            raise table.make_error(name, "missing, expected an argument of the quantity")
    table.check_all_read()
    try:
        quantity.check_arguments(arguments)
    except BadParameter as error:
        raise BadParameter(f"{table.location}.{error}") from None
    return arguments


def _read_argument(table: TableReader, name: str, annotation: object) -> object:
    """Return one argument, of the type of the parameter; None if it is missing."""
    if annotation is int:
        return table.read_whole_number(name)
    if annotation is float:
        return table.read_number(name)
    if annotation == Sequence[str]:
        return table.read_texts(name) or None
    value = table.pop_value(name, str, "a text")
    return None if value is None else str(value)


def _read_notes(table: TableReader) -> Iterator[ScreenNote]:
    """Yield the notes that a game shows above the board."""
    note_tables = table.pop_value("notes", list, "tables [[steps.play.notes]]") or []
    assert isinstance(note_tables, list)
    for index, data in enumerate(note_tables, 1):
        location = f"{table.location}.notes[{index}]"
        if not isinstance(data, dict):
            raise BadParameter(f"{location}: got {data!r}, expected a table")
        note = TableReader(data, location)
        phase = note.read_text("when", PLAYING)
        if phase not in GAME_PHASES:
            raise UnknownName("phase", phase, GAME_PHASES, f"{location}.when")
        turns = note.read_whole_number("turns_at_least") or 0
        yield ScreenNote(note.read_sentence("text"), phase, turns, note.read_texts("at"))
        note.check_all_read()


def _read_game_task(data: Mapping[str, object], location: str) -> GameTask:
    """Return the game to play and its conditions; raise BadParameter if it has none."""
    table = TableReader(data, location)
    goal = table.read_text("goal", None, MAX_GOAL_COLUMNS)
    task = GameTask(
        goal,
        ends=table.read_switch("ends"),
        reaches=table.read_text("reaches", ""),
        turns_at_most=table.read_whole_number("turns_at_most", 1),
        turns_at_least=table.read_whole_number("turns_at_least", 1),
        return_at_least=table.read_number("return_at_least"),
        beats=table.read_text("beats", ""),
        margin=table.read_number("margin") or 0.0,
        regret_at_most=table.read_number("regret_at_most"),
        hints_at_most=table.read_whole_number("hints_at_most"),
        choices=table.read_count_table("choices"),
        choices_at_most=table.read_count_table("choices_at_most"),
        shows_belief=table.read_switch("belief", default=True),
        strict=table.read_switch("strict"),
        notes=tuple(_read_notes(table)),
    )
    table.check_all_read()
    settings = {"goal", "margin", "shows_belief", "notes"}
    conditions = [value for name, value in vars(task).items() if name not in settings]
    if all(value is None or value is False or value in UNSET_CONDITIONS for value in conditions):
        raise BadParameter(f"{location}: expected a condition, such as ends = true")
    return task
