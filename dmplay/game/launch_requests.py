"""Requests for games: a new game, or a transcript to resume, branch or replay."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from dmplay.errors import BadParameter
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES, KeyPreferences
from dmplay.transcript.external_players import HUMAN_PLAYER

if TYPE_CHECKING:  # A report does not need arrays.
    from dmplay.registry.problems import LoadedProblem
    from dmplay.transcript.header import Header

# the lines of a header that are options of a game, under the same names
RECORDED_OPTIONS = (
    "seed", "episode", "turns", "strict", "reveal", "branched", "earlier", "peeked", "player"
)  # fmt: skip
DEFAULT_KEPT_MEGABYTES = 200  # total size of the saved games that are kept


@dataclass(frozen=True)
class GameRequest:
    """The options of a new game."""

    problem: str  # NAME or NAME:VARIANT
    settings: Sequence[str] = ()  # NAME=VALUE
    seed: int | None = None
    episode: int = 0
    agent: str = HUMAN_PLAYER
    other_agent: str = ""
    seats: Sequence[str] = ()  # NAME=AGENT
    turns: int | None = None
    record_path: Path | None = None
    # problem in the name of a new numbered file in the folder `record_path`; "": it is a file
    numbered_file_name: str = field(default="", kw_only=True)
    kept_megabytes: float = DEFAULT_KEPT_MEGABYTES  # total size of the saved games to keep
    record_frames: bool = False
    # those of `rate`, `player` and `frames` that do not come from a settings file; where they have
    # no use, they are an error
    typed_options: frozenset[str] = field(default=frozenset(), kw_only=True)
    force: bool = False
    strict: bool | str = False
    reveal: bool = False
    branched: int | None = None
    earlier: Sequence[Mapping[str, object]] = ()  # the players of the first turns, by change
    peeked: bool = False
    player: str = ""  # the name that the person states
    keep_save: bool = False  # save in the state folder even if only agents play
    is_handed_in: bool = False  # whether leaving pauses the game, which is to be handed in
    key_preferences: KeyPreferences = DEFAULT_KEY_PREFERENCES
    ghost_agent: str = ""  # agent that plays a copy of the game beside the person
    person_label: str = HUMAN_PLAYER  # player of human seats as recorded
    can_ask: bool = True  # whether a person may be asked for actions
    prediction: str = ""  # what the person predicts each turn: belief[:STATE], outcome or value
    states_belief: bool = False  # whether the person states a belief each turn, shown none
    is_seed_visible: bool = True  # whether the seed may be shown before the end
    has_fresh_seed: bool = False  # whether the seed was drawn for this game
    lesson_goal: str = ""  # the goal in a lesson, which then judges the finished game itself
    is_guided: bool = False  # the notes of a lesson advise help
    shows_belief: bool = True  # False if a lesson asks the player to keep the belief itself

    def load_problem(self) -> "LoadedProblem":
        """Return the problem with these settings."""
        from dmplay.registry.problems import resolve_problem

        return resolve_problem(self.problem, parse_settings(self.settings, "--set"))

    def format_command(self, problem_name: str, seed: int) -> str:
        """Return the `dmplay` command that plays the same game with this seed."""
        options = {
            "--set": self.settings,
            "--seat": self.seats,
            "--agent": [self.agent] if self.agent != HUMAN_PLAYER else [],
            "--vs": [self.other_agent] if self.other_agent else [],
            "--ghost": [self.ghost_agent] if self.ghost_agent else [],
            "--predict": [self.prediction] if self.prediction else [],
            "--turns": [] if self.turns is None else [str(self.turns)],
            "--episode": [str(self.episode)] if self.episode else [],
        }
        words = [
            word
            for option, values in options.items()
            for value in values
            for word in (option, value)
        ]
        flags = {"--strict": self.strict, "--reveal": self.reveal}
        flags["--state-belief"] = self.states_belief
        words += [option for option, is_set in flags.items() if is_set is True]
        words += ["--strict=hints"] if self.strict == "hints" else []
        return shlex.join(["dmplay", problem_name, *words, "--seed", str(seed)])


@dataclass(frozen=True)
class ResumeRequest:
    """A request to resume the game of a transcript."""

    path: Path
    trusted: bool = False
    key_preferences: KeyPreferences = DEFAULT_KEY_PREFERENCES
    can_ask: bool = True
    turn_limit: int | None = field(default=None, kw_only=True)  # turn limit if only agents play
    # agent beside the person; '': the recorded one
    ghost_agent: str = field(default="", kw_only=True)


@dataclass(frozen=True)
class BranchRequest(ResumeRequest):
    """A request for a new game that repeats a transcript's first turns."""

    turn: int = 0
    record_path: Path = field(kw_only=True)
    seats: Sequence[str] = field(default=(), kw_only=True)  # NAME=PLAYER, from the next turn on
    force: bool = False
    peek: bool = False


@dataclass(frozen=True)
class ReplayRequest:
    """A request to replay a recorded game."""

    path: Path
    trusted: bool = False
    peek: bool = False  # even if the game can still be resumed


AnyGameRequest = GameRequest | ResumeRequest | BranchRequest | ReplayRequest


def format_variant_name(problem: str, variant: str) -> str:
    """Return the name of a problem's variant, `NAME` or `NAME:VARIANT`."""
    return f"{problem}:{variant}" if variant else problem


def split_shell_words(line: str) -> list[str]:
    """Split a line into words with the quoting rules of a shell.

    Raise BadParameter if a quotation is not closed.
    """
    try:
        return shlex.split(line)
    except ValueError as error:  # an unclosed quotation
        raise BadParameter(f"got {line!r}: {str(error).lower()}") from None


def format_settings(parameters: Mapping[str, object]) -> list[str]:
    """Return parameters as `NAME=VALUE` texts; values that are not texts are in JSON."""
    return [
        f"{key}={value if isinstance(value, str) else json.dumps(value)}"
        for key, value in parameters.items()
    ]


def parse_settings(settings: Sequence[str], option: str) -> dict[str, object]:
    """Return the values by name of an option's `NAME=VALUE` settings.

    Raise BadParameter if a setting has no equals sign.
    """
    values: dict[str, object] = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals:
            raise BadParameter(f"{option}: got {setting!r}, expected NAME=VALUE")
        values[key.strip()] = value.strip()
    return values


def request_from_header(
    header: "Header",
    player_names: Sequence[str],
    record_path: Path,
    key_preferences: KeyPreferences,
) -> GameRequest:
    """Return a request for the game of a transcript's header, with these players."""
    seat_settings = [
        f"{name}={player}" for name, player in zip(header.seats, player_names, strict=True)
    ]
    if [*player_names] == [HUMAN_PLAYER]:  # the default
        seat_settings = []
    options = {name: getattr(header, name) for name in RECORDED_OPTIONS}
    return GameRequest(
        header.problem, format_settings(header.parameters), seats=seat_settings,
        record_path=record_path, key_preferences=key_preferences, is_seed_visible=False, **options,
    )  # fmt: skip
