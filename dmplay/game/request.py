"""What game is wanted: a new one, or one of a transcript: gone on with, branched, looked at."""

import json
import shlex
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from dmplay.errors import BadParameter
from dmplay.keys.keymap import AS_DRAWN, Keys
from dmplay.transcript.format import PERSON
from dmplay.transcript.header import Header


@dataclass(frozen=True)
class Request:
    """A game that is wanted."""

    problem: str
    variant: str = ""
    settings: Sequence[str] = ()  # NAME=VALUE
    seed: int | None = None
    episode: int = 0
    agent: str = PERSON
    others: str = ""
    seats: Sequence[str] = ()  # NAME=AGENT
    turns: int | None = None
    record: Path | None = None
    frames: bool = False
    timed: bool = field(default=False, kw_only=True)  # by words, not by a file of settings
    force: bool = False
    strict: bool | str = False
    reveal: bool = False
    branched: int | None = None
    peeked: bool = False
    origin: str = ""
    player: str = ""  # who says to be the person
    parameters: Mapping[str, object] = field(default_factory=dict)
    keep: bool = False  # in the state folder, though nobody plays
    keys: Keys = AS_DRAWN
    ghost: str = ""  # the agent that plays the same dice beside the person
    person: str = PERSON  # what the record calls whoever is asked to choose
    asks: bool = True  # whether a person may be asked to choose
    seed_known: bool = True  # whether the player may see the seed before the end
    fresh: bool = False  # whether the seed was drawn for this game

    @property
    def name(self) -> str:
        """The problem with its variant."""
        return f"{self.problem}:{self.variant}" if self.variant else self.problem

    def configured(self) -> dict[str, object]:
        """The parameters that differ from the default."""
        return {**self.parameters, **pairs(self.settings, "--set")}

    @property
    def told(self) -> list[str]:
        """The same, as they are typed."""
        return [*set_to(self.parameters), *self.settings]

    def command(self, name: str, seed: int) -> str:
        """The command that plays the same game with the same dice."""
        options = {
            "--set": self.told,
            "--seat": self.seats,
            "--agent": [self.agent] if self.agent != PERSON else [],
            "--vs": [self.others] if self.others else [],
            "--ghost": [self.ghost] if self.ghost else [],
            "--turns": [] if self.turns is None else [str(self.turns)],
            "--episode": [str(self.episode)] if self.episode else [],
        }
        words = [word for option, each in options.items() for one in each for word in (option, one)]
        wishes = {"--strict": self.strict, "--reveal": self.reveal}
        words += [option for option, wish in wishes.items() if wish is True]
        words += ["--strict=hints"] if self.strict == "hints" else []
        return shlex.join(["dmplay", name, *words, "--seed", str(seed)])


@dataclass(frozen=True)
class Resumption:
    """The game of a transcript, to go on with."""

    path: Path
    trusted: bool = False
    keys: Keys = AS_DRAWN
    asks: bool = True
    turns: int | None = field(default=None, kw_only=True)  # that agents alone may play
    ghost: str = field(default="", kw_only=True)  # beside the person; '' for the one it had


@dataclass(frozen=True)
class Branching(Resumption):
    """A new game that begins as that of a transcript did, up to a turn."""

    turn: int = 0
    record: Path = field(kw_only=True)
    force: bool = False
    peek: bool = False


@dataclass(frozen=True)
class Recording:
    """A recorded game, to look at."""

    path: Path
    trusted: bool = False
    peek: bool = False  # though it can be played on


Wanted = Request | Resumption | Branching | Recording


def words_of(line: str) -> list[str]:
    """The words of a line, as a shell takes them apart."""
    try:
        return shlex.split(line)
    except ValueError as error:  # a quotation without end
        raise BadParameter(f"got {line!r}: {str(error).lower()}") from None


def set_to(parameters: Mapping[str, object]) -> list[str]:
    """Parameters as they are typed."""
    return [f"{key}={json.dumps(one)}" for key, one in parameters.items()]


def pairs(settings: Sequence[str], option: str) -> dict[str, object]:
    """The settings `NAME=VALUE` of an option."""
    found: dict[str, object] = {}
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals:
            raise BadParameter(f"{option}: got {setting!r}, expected NAME=VALUE")
        found[key.strip()] = value.strip()
    return found


def repeated(header: Header, seats: Sequence[str], record: Path, keys: Keys) -> Request:
    """The game of a transcript, with those who sit there now."""
    sitting = [f"{name}={who}" for name, who in zip(header.seats, seats, strict=True)]
    told = vars(header) | {"seats": sitting}
    return Request(**told, agent=seats[0], record=record, keys=keys, seed_known=False)
