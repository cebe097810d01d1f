"""An assignment: the games that many people are to play, in a file that is handed out.

It is the header of their transcripts, with all `seeds` in place of one:

    dmplay: 1
    problem: "hexworld"
    seats: {"agent": "human"}
    seeds: [7, 8]
    strict: "hints"
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from shlex import quote

from dmplay.disk import content, write
from dmplay.errors import BadFile, BadParameter, UnknownName
from dmplay.finding import problems
from dmplay.finding.ways import HERE, beside, moved
from dmplay.game.request import Request, repeated
from dmplay.game.saves import readable
from dmplay.game.seats import HUMAN, header, seat_policy, sitting
from dmplay.game.start import LARGEST_SEED, seated
from dmplay.transcript.format import lines
from dmplay.transcript.header import Header, header_facts
from dmplay.transcript.keyed import keyed
from dmplay.transcript.reading import HEADER, Block, header_of, left
from dmplay.transcript.seal import LEFT

SEEDS = "seeds"
KEYS = [SEEDS if key == "seed" else key for key in HEADER]
EXPECTED = f"expected whole numbers, each another, at most {LARGEST_SEED}, such as 7, 8"
SAID = {  # what is not for the player to choose
    "problem": "PROBLEM", "variant": "--variant", "settings": "--set", "agent": "--agent",
    "others": "--vs", "seats": "--seat", "turns": "--turns", "episode": "--episode",
    "strict": "--strict", "reveal": "--reveal", "ghost": "--ghost",
}  # fmt: skip


@dataclass(frozen=True)
class Assignment:
    """What is to be played: the header of the first game, the seeds of all, where it stands."""

    header: Header
    seeds: tuple[int, ...]
    path: Path

    def differs(self, other: Header, place: Path) -> list[str]:
        """How a game of which a transcript stands there is not one of these; empty where it is."""
        rules = ("problem", "origin", "parameters", "turns", "episode")
        mine, theirs = (
            replace(one, problem=moved(one.problem, beside(path), HERE))
            for one, path in ((self.header, self.path), (other, place))
        )
        unlike = [name for name in rules if getattr(mine, name) != getattr(theirs, name)]
        unlike += ["seed"] if other.seed not in self.seeds else []
        unlike += ["seats"] if dict(mine.seats) != dict(theirs.seats) else []
        lax = mine.strict and theirs.strict not in (mine.strict, "hints")
        return unlike + (["strict"] if lax else [])

    def request(self, wanted: Request, *, trusted: bool) -> Request:
        """The game of it that a player is to play next, of whom there are files of others."""
        _settled(wanted)
        name = moved(self.header.problem, beside(self.path), HERE)
        found = problems.resolve(name, self.header.parameters, trusted=trusted)
        seats, _ = sitting(found.problem, self.header, trusted=trusted, folder=beside(self.path))
        seed, record = self._next(wanted)
        told = replace(self.header, problem=name, seed=seed, player=wanted.player)
        asked = repeated(told, seats, record, wanted.keys)
        return replace(
            asked, frames=wanted.frames, force=wanted.force, asks=wanted.asks, timed=wanted.timed
        )

    def _next(self, wanted: Request) -> tuple[int, Path]:
        """The seed of the next game, and its file."""
        if wanted.seed is not None and wanted.seed not in self.seeds:
            known = ", ".join(map(str, self.seeds))
            raise BadParameter(f"--seed: got {wanted.seed}, {self.path} has {known}")
        stem = "-".join(re.findall(r"\w+", wanted.player.lower())) or "game"
        files = {seed: Path(f"{stem}-{seed}.dmt") for seed in self.seeds}
        if wanted.seed is not None:
            return wanted.seed, wanted.record or files[wanted.seed]
        for seed, file in files.items():
            if not file.exists():
                return seed, wanted.record or file
            if readable(file, left).reason in LEFT:
                raise BadParameter(f"{file} is unfinished; dmplay resume {file} goes on with it")
        told = ", ".join(map(str, files.values()))
        raise BadParameter(f"{self.path}: you played it all; hand in {told}")


def _settled(wanted: Request) -> None:
    """Refuses what the assignment says, and nobody who plays."""
    usual = Request("")
    for name, option in SAID.items():
        if (getattr(wanted, name) or None) != (getattr(usual, name) or None):
            raise BadParameter(f"--assignment says what is played; leave out {option}")
    if not wanted.player:
        raise BadParameter("--assignment: expected --player NAME too")


def assigned(request: Request, seeds: tuple[int, ...], path: Path, *, force: bool) -> str:
    """Writes an assignment of these games; says where it is, and the command that plays it."""
    if not _apart(seeds):
        raise BadParameter(f"--seeds: got {', '.join(map(str, seeds)) or 'none'}, {EXPECTED}")
    found = problems.resolve(request.name, request.configured())
    seats = seated(request, found)
    if HUMAN not in seats:
        raise BadParameter("assign: no person plays; leave a seat to one")
    for seat, who in enumerate(seats):
        seat_policy(found.problem, seat, who, request.turns)  # refuses what cannot sit there
    told = header(found, seats, replace(request, seed=seeds[0]), path)
    made = Assignment(told, seeds, path)
    write(path, [f"{row}\n" for row in _rows(made)], force=force)
    return f"wrote {path}; dmplay play --assignment {quote(str(path))} --player NAME"


def _rows(made: Assignment) -> Iterator[str]:
    for key, value in header_facts(made.header).items():
        yield from lines({SEEDS: [*made.seeds]} if key == "seed" else {key: value})


def _apart(seeds: object) -> bool:
    """Whether these are different seeds, at least one."""
    if not isinstance(seeds, list | tuple) or not seeds:
        return False
    whole = all(type(seed) is int and 0 <= seed <= LARGEST_SEED for seed in seeds)
    return whole and len({*seeds}) == len(seeds)


def read(path: Path) -> Assignment:
    """The assignment in a file; raises BadFile with the line of a fault, or BadParameter."""
    where = str(path)
    try:
        rows = content(path).decode().split("\n")
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadFile(where, 1, None, "not UTF-8") from None
    told: dict[str, object] = {}
    for number, row in enumerate(rows, 1):
        if row and not row.startswith("#"):
            key, value = keyed(row, where, number)
            if key not in KEYS:
                raise BadFile(where, number, 1, str(UnknownName("key", key, KEYS)))
            told["seed" if key == SEEDS else key] = value
    seeds = told.get("seed")
    if not isinstance(seeds, list) or not _apart(seeds):
        raise BadFile(where, 1, None, f"seeds: {EXPECTED}")
    told["seed"] = seeds[0]
    block = Block(1, tuple(told), tuple(told.values()), (), ())
    return Assignment(header_of(block, where), tuple(seeds), path)
