"""A lesson: its steps, the position of each step, and what the player does there."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # A list of lessons needs no arrays.
    from dmplay.core.session import Session


@dataclass(frozen=True)
class PositionText:
    """A position as a lesson states it: problem, random numbers, players and first turns."""

    problem: str  # a name with its variant, or the path of a file
    parameters: Mapping[str, object] = field(default_factory=dict)
    seed: int = 0
    turns: int | None = None  # turn limit; None for the problem's own
    seats: Mapping[str, str] = field(default_factory=dict)  # the agents of other seats, by seat
    after: tuple[str, ...] = ()  # the player's actions in the turns before the position


@dataclass(frozen=True)
class QuantityCall:
    """The name of a quantity and its arguments, for example the value of the state (2,1)."""

    name: str
    arguments: Mapping[str, object] = field(default_factory=dict)


@dataclass(frozen=True)
class Prediction:
    """A question that the player answers with one typed line.

    The player types the value of the quantity. If `asks` names a parameter of the quantity, the
    player types that argument instead, and the value must be within the bounds.
    """

    quantity: QuantityCall
    asks: str = ""
    tolerance: float = 0.0
    at_least: float | None = None
    at_most: float | None = None
    result: str = ""  # if `asks` is set, the sentence with the value, at {} or at its end
    shows_board: bool = True
    watch: str = ""  # an algorithm to watch after the answer
    watch_first: bool = False  # whether it can be watched before the answer instead


PLAYING, OVER, LOOKING_BACK = "playing", "over", "looking back"  # the phases of a game


@dataclass(frozen=True)
class ScreenNote:
    """A sentence above the board, for one phase of a game and for some of its moments."""

    text: str
    when: str = PLAYING
    turns_at_least: int = 0
    at: tuple[str, ...] = ()  # the states in which it is shown; () for all


def find_note(notes: Sequence[ScreenNote], session: "Session", phase: str) -> str:
    """Return the text of the last note that fits the moment of a game; '' if none does."""
    fitting = (
        note.text
        for note in reversed(notes)
        if note.when == phase
        and note.turns_at_least <= len(session.turns)
        and (not note.at or session.problem.format_state(session.state) in note.at)
    )
    return next(fitting, "")


@dataclass(frozen=True)
class GameTask:
    """A game to play, and the conditions that the finished game must satisfy."""

    goal: str
    ends: bool = False  # whether the problem itself must end the game, not the turn limit
    reaches: str = ""  # a state that the game must visit
    turns_at_most: int | None = None
    turns_at_least: int | None = None
    return_at_least: float | None = None
    beats: str = ""  # an agent; the return must be at least its return on the same draws
    margin: float = 0.0  # amount by which the return may be less; the negative of a required lead
    regret_at_most: float | None = None
    hints_at_most: int | None = None
    choices: Mapping[str, int] = field(default_factory=dict)  # minimum number of each action
    choices_at_most: Mapping[str, int] = field(default_factory=dict)  # maximum number of each
    shows_belief: bool = True  # whether the screen shows the player's belief, if states are hidden
    strict: bool = False  # whether undo and new random numbers are forbidden
    # With notes, it is a usual game, with its verdict and a look back.
    notes: tuple[ScreenNote, ...] = ()

    @property
    def strictness(self) -> bool | str:
        """The strictness of the game: "hints" if no hint is allowed, which forbids undo as well."""
        return "hints" if self.hints_at_most == 0 else self.strict


@dataclass(frozen=True)
class LessonStep:
    """One step of a lesson: a few lines of text and one thing to do."""

    text: tuple[str, ...]
    position: PositionText
    task: Prediction | GameTask
    hint: str
    learned: str
    book: str  # where the book explains it


@dataclass(frozen=True)
class TutorLesson:
    """A lesson that was read from a file."""

    path: Path
    number: int
    title: str
    chapter: str  # the part of the book
    minutes: int
    steps: tuple[LessonStep, ...]
    is_builtin: bool = False
    step_keys: tuple[str, ...] = ()  # of its steps in the file of progress

    @property
    def label(self) -> str:
        """The words for the lesson in a sentence; the first game, of number 0, is no lesson."""
        return f"lesson {self.number}" if self.number or not self.is_builtin else self.title

    @property
    def name(self) -> str:
        """The name of the file without its number and extension, such as `first-walk`."""
        return extract_lesson_name(self.path)

    @property
    def old_key(self) -> str:
        """The key of the lesson in the files of progress of older versions."""
        return self.name if self.is_builtin else str(self.path.resolve())


def extract_lesson_name(path: Path) -> str:
    """Return the name of a lesson file without its number and extension."""
    return path.stem.lstrip("0123456789").lstrip("-_ ") or path.stem
