"""Results of parsing a command line: a game to play, a server to run, or a report to print."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from dmplay.errors import BadParameter
from dmplay.game.launch_requests import (
    DEFAULT_KEPT_MEGABYTES,
    AnyGameRequest,
    GameRequest,
    ReplayRequest,
)
from dmplay.terminal.capabilities import TerminalOptions

if TYPE_CHECKING:  # A report does not need the algorithms, and plain text no Rich.
    from rich.text import Text

    from dmplay.game.watching import WatchedSteps

DEFAULT_TERMINAL_OPTIONS = TerminalOptions()


class PlayCommand(NamedTuple):
    """A request to play a game in the terminal, with the display options."""

    request: AnyGameRequest
    terminal_options: TerminalOptions
    quiet: bool = False
    speed: float = 2.0  # turns per second when only agents play
    realtime_rate: float | None = None  # turns per second in real time

    @property
    def has_rate_option(self) -> bool:
        """True if `--rate` was given on the command line, not only in a settings file."""
        return isinstance(self.request, GameRequest) and "rate" in self.request.typed_options

    @property
    def interactive_request(self) -> AnyGameRequest:
        """The request with saving and asking enabled, for play in a shell.

        Raises BadParameter if `--rate` was given: real time needs the full screen.
        """
        if self.has_rate_option:
            reason = "the shell cannot play in real time; leave it and use dmplay play"
            raise BadParameter(f"--rate: {reason}")
        match self.request:
            case GameRequest():
                return replace(self.request, keep_save=True, can_ask=True)
            case ReplayRequest():
                return self.request
        return replace(self.request, can_ask=True)


class Printout(NamedTuple):
    """A report with an exit code, an error text and options for printing."""

    text: "Text | str"
    terminal_options: TerminalOptions = DEFAULT_TERMINAL_OPTIONS
    stderr_text: str = ""  # printed to stderr
    exit_code: int = 0  # exit code of the process
    paged: bool = False  # whether to display the text in a pager
    text_chunks: Iterable[str] = ()  # more text, printed as it is generated


class ShellCommand(NamedTuple):
    """A request to run the interactive shell, in which several games can be played."""

    commands: Sequence[str]  # run instead of typed lines
    terminal_options: TerminalOptions
    speed: float
    # whether to open the list of problems first, if the terminal can draw it
    opens_gallery: bool = False


class LearnCommand(NamedTuple):
    """A request to run a lesson in the terminal."""

    lesson: str  # its number or name
    terminal_options: TerminalOptions = DEFAULT_TERMINAL_OPTIONS
    source: str = ""  # the folder of the lesson; '' for the built-in lessons
    restart: bool = False  # whether to begin with the first step, even if it is finished
    trusted: bool = False  # whether code that the lesson names may be run


class PuzzleCommand(NamedTuple):
    """A request to ask a puzzle in the terminal."""

    code: str  # a problem, or a problem and a number; '' for the puzzle of the day
    terminal_options: TerminalOptions = DEFAULT_TERMINAL_OPTIONS


class MistakesCommand(NamedTuple):
    """A request to ask for better actions than those that lost most in recorded games."""

    paths: Sequence[Path] = ()  # the games; () for the saved games
    terminal_options: TerminalOptions = DEFAULT_TERMINAL_OPTIONS
    trusted: bool = False  # whether code outside dmplay may be run


class WatchCommand(NamedTuple):
    """A request to show the steps of an algorithm on the full screen."""

    watched: "WatchedSteps"
    terminal_options: TerminalOptions
    speed: float  # steps per second while playing
    first_step: int = 0  # index of the step to begin with


class BotServerConfig(NamedTuple):
    """A request to run an agent that plays over a pipe in a game of another program."""

    agent: str
    problem: str


class McpServerConfig(NamedTuple):
    """The options of the MCP server that a language model plays through."""

    problems: Sequence[str] = ()  # empty: all built-in problems
    allow_hints: bool = False
    allow_undo: bool = False
    show_belief: bool = False  # whether to send the model the belief of its seat
    seed: int | None = None  # seed of all games, which are its episodes; None: a new seed
    turn_limit: int | None = None  # turn limit of each game
    transcript_folder: Path | None = None  # folder of transcripts; None: the folder of saved games
    kept_megabytes: float = DEFAULT_KEPT_MEGABYTES  # total size of the saved games to keep

    @property
    def strict(self) -> bool | str:
        """The strictness in transcripts: False with undo, else True or "hints" (no hints)."""
        return not self.allow_undo and (self.allow_hints or "hints")


TutorCommand = LearnCommand | PuzzleCommand | MistakesCommand
CliResult = (
    PlayCommand
    | ShellCommand
    | TutorCommand
    | WatchCommand
    | BotServerConfig
    | McpServerConfig
    | Printout
    | str
)
# parses and runs the words of a command line
CliInterpreter = Callable[[Sequence[str]], PlayCommand | TutorCommand | str]
