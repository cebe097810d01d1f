"""What words of the command line come to: a game to be played, or a report to be printed."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

from rich.text import Text

from dmplay.errors import BadParameter
from dmplay.game.request import AnyGameRequest, GameRequest, ReplayRequest
from dmplay.terminal import TerminalOptions

DEFAULT_TERMINAL_OPTIONS = TerminalOptions()


class PlayCommand(NamedTuple):
    """A game that is wanted, and how it is to be played."""

    request: AnyGameRequest
    terminal_options: TerminalOptions
    quiet: bool = False
    speed: float = 2.0  # turns a second when agents play
    realtime_rate: float | None = None  # turns a second in real time

    @property
    def has_rate_option(self) -> bool:
        """Whether real time was asked for, and not only by a file of settings."""
        return isinstance(self.request, GameRequest) and self.request.has_rate_option

    @property
    def interactive_request(self) -> AnyGameRequest:
        """The game as one that people play after another: they may be asked, and it is kept."""
        match self.request:
            case GameRequest(has_rate_option=True):
                raise BadParameter("--rate: real time is for the screen that dmplay play opens")
            case GameRequest():
                return replace(self.request, keep_save=True, can_ask=True)
            case ReplayRequest():
                return self.request
        return replace(self.request, can_ask=True)


class Printout(NamedTuple):
    """A report of which there is more to say than its text."""

    text: Text | str
    terminal_options: TerminalOptions = DEFAULT_TERMINAL_OPTIONS
    stderr_text: str = ""  # for the channel of errors
    exit_code: int = 0  # of the process
    paged: bool = False  # whether it is read a screenful at a time
    text_chunks: Iterable[str] = ()  # more text, told as it is made


class ShellCommand(NamedTuple):
    """Games that are wanted one after another, in words."""

    commands: Sequence[str]  # done in place of what is typed
    terminal_options: TerminalOptions
    speed: float
    opens_gallery: bool = (
        False  # whether it begins with the list of problems, where that can be drawn
    )


class BotServerConfig(NamedTuple):
    """An agent that is to play a game which another program keeps, at the other end of a pipe."""

    agent: str
    problem: str


class McpServerConfig(NamedTuple):
    """What a language model at the other end of a pipe may play, and what it may ask for."""

    problems: Sequence[str] = ()  # all that are built in if none is named
    allow_hints: bool = False
    allow_undo: bool = False
    show_belief: bool = False  # whether it is told what its seat is to believe
    seed: int | None = None  # of all games, which are its episodes; fresh dice if there is none
    turn_limit: int | None = None  # after which a game ends
    transcript_folder: Path | None = (
        None  # for transcripts; that of games that are kept if there is none
    )

    @property
    def strict(self) -> bool | str:
        """How strict its games are, as their transcripts say."""
        return not self.allow_undo and (self.allow_hints or "hints")


CliResult = PlayCommand | ShellCommand | BotServerConfig | McpServerConfig | Printout | str
CliInterpreter = Callable[
    [Sequence[str]], PlayCommand | str
]  # what the command line makes of words
