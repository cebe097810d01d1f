"""What game is wanted: a new one, or one of a transcript: gone on with, branched, looked at."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from dmplay.errors import BadParameter
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES, KeyPreferences
from dmplay.transcript.format import HUMAN_PLAYER
from dmplay.transcript.header import Header


@dataclass(frozen=True)
class GameRequest:
    """A game that is wanted."""

    problem: str
    variant: str = ""
    settings: Sequence[str] = ()  # NAME=VALUE
    seed: int | None = None
    episode: int = 0
    agent: str = HUMAN_PLAYER
    other_agent: str = ""
    seats: Sequence[str] = ()  # NAME=AGENT
    turns: int | None = None
    record_path: Path | None = None
    record_frames: bool = False
    has_rate_option: bool = field(
        default=False, kw_only=True
    )  # by words, not by a file of settings
    force: bool = False
    strict: bool | str = False
    reveal: bool = False
    branched: int | None = None
    peeked: bool = False
    origin: str = ""
    player: str = ""  # who says to be the person
    parameters: Mapping[str, object] = field(default_factory=dict)
    keep_save: bool = False  # in the state folder, though nobody plays
    key_preferences: KeyPreferences = DEFAULT_KEY_PREFERENCES
    ghost_agent: str = ""  # the agent that plays the same dice beside the person
    person_label: str = HUMAN_PLAYER  # what the record calls whoever is asked to choose
    can_ask: bool = True  # whether a person may be asked to choose
    is_seed_visible: bool = True  # whether the player may see the seed before the end
    has_fresh_seed: bool = False  # whether the seed was drawn for this game

    @property
    def problem_name(self) -> str:
        """The problem with its variant."""
        return f"{self.problem}:{self.variant}" if self.variant else self.problem

    def changed_parameters(self) -> dict[str, object]:
        """The parameters that differ from the default."""
        return {**self.parameters, **parse_settings(self.settings, "--set")}

    @property
    def all_settings(self) -> list[str]:
        """The same, as they are typed."""
        return [*format_settings(self.parameters), *self.settings]

    def format_command(self, problem_name: str, seed: int) -> str:
        """The command that plays the same game with the same dice."""
        options = {
            "--set": self.all_settings,
            "--seat": self.seats,
            "--agent": [self.agent] if self.agent != HUMAN_PLAYER else [],
            "--vs": [self.other_agent] if self.other_agent else [],
            "--ghost": [self.ghost_agent] if self.ghost_agent else [],
            "--turns": [] if self.turns is None else [str(self.turns)],
            "--episode": [str(self.episode)] if self.episode else [],
        }
        words = [word for option, each in options.items() for one in each for word in (option, one)]
        wishes = {"--strict": self.strict, "--reveal": self.reveal}
        words += [option for option, wish in wishes.items() if wish is True]
        words += ["--strict=hints"] if self.strict == "hints" else []
        return shlex.join(["dmplay", problem_name, *words, "--seed", str(seed)])


@dataclass(frozen=True)
class ResumeRequest:
    """The game of a transcript, to go on with."""

    path: Path
    trusted: bool = False
    key_preferences: KeyPreferences = DEFAULT_KEY_PREFERENCES
    can_ask: bool = True
    turn_limit: int | None = field(default=None, kw_only=True)  # that agents alone may play
    ghost_agent: str = field(default="", kw_only=True)  # beside the person; '' for the one it had


@dataclass(frozen=True)
class BranchRequest(ResumeRequest):
    """A new game that begins as that of a transcript did, up to a turn."""

    turn: int = 0
    record_path: Path = field(kw_only=True)
    force: bool = False
    peek: bool = False


@dataclass(frozen=True)
class ReplayRequest:
    """A recorded game, to look at."""

    path: Path
    trusted: bool = False
    peek: bool = False  # though it can be played on


AnyGameRequest = GameRequest | ResumeRequest | BranchRequest | ReplayRequest


def split_words(line: str) -> list[str]:
    """The words of a line, as a shell takes them apart."""
    try:
        return shlex.split(line)
    except ValueError as error:  # a quotation without end
        raise BadParameter(f"got {line!r}: {str(error).lower()}") from None


def format_settings(parameters: Mapping[str, object]) -> list[str]:
    """Parameters as they are typed."""
    return [f"{key}={json.dumps(one)}" for key, one in parameters.items()]


def parse_settings(settings: Sequence[str], option: str) -> dict[str, object]:
    """The settings `NAME=VALUE` of an option."""
    found: dict[str, object] = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals:
            raise BadParameter(f"{option}: got {setting!r}, expected NAME=VALUE")
        found[key.strip()] = value.strip()
    return found


def request_from_header(
    header: Header, player_names: Sequence[str], record_path: Path, key_preferences: KeyPreferences
) -> GameRequest:
    """The game of a transcript, with those who sit there now."""
    sitting = [f"{name}={who}" for name, who in zip(header.seats, player_names, strict=True)]
    told = vars(header) | {"seats": sitting}
    return GameRequest(
        **told,
        agent=player_names[0],
        record_path=record_path,
        key_preferences=key_preferences,
        is_seed_visible=False,
    )
