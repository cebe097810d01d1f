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

from dmplay.disk import read_bytes, write_file
from dmplay.errors import BadFile, BadParameter, UnknownName
from dmplay.finding import problems
from dmplay.finding.ways import CURRENT_FOLDER, rebase_name, transcript_folder
from dmplay.game.request import GameRequest, request_from_header
from dmplay.game.saves import load_transcript
from dmplay.game.seats import HUMAN, load_resumed_players, make_header, make_seat_policy
from dmplay.game.start import MAX_SEED, assign_players
from dmplay.transcript.format import format_lines
from dmplay.transcript.header import Header, collect_header_facts
from dmplay.transcript.keyed import parse_line
from dmplay.transcript.reading import HEADER_KEYS, Block, parse_header, read_incomplete_transcript
from dmplay.transcript.seal import RESUMABLE_END_REASONS

SEEDS_KEY = "seeds"
ASSIGNMENT_KEYS = [SEEDS_KEY if key == "seed" else key for key in HEADER_KEYS]
EXPECTED_SEEDS = f"expected whole numbers, each another, at most {MAX_SEED}, such as 7, 8"
FIXED_OPTIONS = {  # what is not for the player to choose
    "problem": "PROBLEM", "variant": "--variant", "settings": "--set", "agent": "--agent",
    "other_agent": "--vs", "seats": "--seat", "turns": "--turns", "episode": "--episode",
    "strict": "--strict", "reveal": "--reveal", "ghost_agent": "--ghost",
}  # fmt: skip


@dataclass(frozen=True)
class Assignment:
    """What is to be played: the header of the first game, the seeds of all, where it stands."""

    header: Header
    seeds: tuple[int, ...]
    path: Path

    def find_differences(self, other: Header, path: Path) -> list[str]:
        """How a game of which a transcript stands there is not one of these; empty where it is."""
        rules = ("problem", "origin", "parameters", "turns", "episode")
        mine, theirs = (
            replace(one, problem=rebase_name(one.problem, transcript_folder(path), CURRENT_FOLDER))
            for one, path in ((self.header, self.path), (other, path))
        )
        unlike = [name for name in rules if getattr(mine, name) != getattr(theirs, name)]
        unlike += ["seed"] if other.seed not in self.seeds else []
        unlike += ["seats"] if dict(mine.seats) != dict(theirs.seats) else []
        lax = mine.strict and theirs.strict not in (mine.strict, "hints")
        return unlike + (["strict"] if lax else [])

    def build_request(self, options: GameRequest, *, trusted: bool) -> GameRequest:
        """The game of it that a player is to play next, of whom there are files of others."""
        _check_request(options)
        name = rebase_name(self.header.problem, transcript_folder(self.path), CURRENT_FOLDER)
        found = problems.resolve_problem(name, self.header.parameters, trusted=trusted)
        seats, _ = load_resumed_players(
            found.problem, self.header, trusted=trusted, folder=transcript_folder(self.path)
        )
        seed, record = self._choose_next_game(options)
        told = replace(self.header, problem=name, seed=seed, player=options.player)
        asked = request_from_header(told, seats, record, options.key_preferences)
        return replace(
            asked,
            record_frames=options.record_frames,
            force=options.force,
            can_ask=options.can_ask,
            has_rate_option=options.has_rate_option,
        )

    def _choose_next_game(self, options: GameRequest) -> tuple[int, Path]:
        """The seed of the next game, and its file."""
        if options.seed is not None and options.seed not in self.seeds:
            known = ", ".join(map(str, self.seeds))
            raise BadParameter(f"--seed: got {options.seed}, {self.path} has {known}")
        stem = "-".join(re.findall(r"\w+", options.player.lower())) or "game"
        files = {seed: Path(f"{stem}-{seed}.dmt") for seed in self.seeds}
        if options.seed is not None:
            return options.seed, options.record_path or files[options.seed]
        for seed, file in files.items():
            if not file.exists():
                return seed, options.record_path or file
            if (
                load_transcript(file, read_incomplete_transcript).end_reason
                in RESUMABLE_END_REASONS
            ):
                raise BadParameter(f"{file} is unfinished; dmplay resume {file} goes on with it")
        told = ", ".join(map(str, files.values()))
        raise BadParameter(f"{self.path}: you played it all; hand in {told}")


def _check_request(options: GameRequest) -> None:
    """Refuses what the assignment says, and nobody who plays."""
    usual = GameRequest("")
    for name, option in FIXED_OPTIONS.items():
        if (getattr(options, name) or None) != (getattr(usual, name) or None):
            raise BadParameter(f"--assignment says what is played; leave out {option}")
    if not options.player:
        raise BadParameter("--assignment: expected --player NAME too")


def write_assignment(
    request: GameRequest, seeds: tuple[int, ...], path: Path, *, force: bool
) -> str:
    """Writes an assignment of these games; says where it is, and the command that plays it."""
    if not _are_distinct_seeds(seeds):
        raise BadParameter(f"--seeds: got {', '.join(map(str, seeds)) or 'none'}, {EXPECTED_SEEDS}")
    found = problems.resolve_problem(request.problem_name, request.changed_parameters())
    seats = assign_players(request, found)
    if HUMAN not in seats:
        raise BadParameter("assign: no person plays; leave a seat to one")
    for seat, who in enumerate(seats):
        make_seat_policy(found.problem, seat, who, request.turns)  # refuses what cannot sit there
    told = make_header(found, seats, replace(request, seed=seeds[0]), path)
    made = Assignment(told, seeds, path)
    write_file(path, [f"{row}\n" for row in _iter_lines(made)], force=force)
    return f"wrote {path}; dmplay play --assignment {quote(str(path))} --player NAME"


def _iter_lines(assignment: Assignment) -> Iterator[str]:
    for key, value in collect_header_facts(assignment.header).items():
        yield from format_lines({SEEDS_KEY: [*assignment.seeds]} if key == "seed" else {key: value})


def _are_distinct_seeds(seeds: object) -> bool:
    """Whether these are different seeds, at least one."""
    if not isinstance(seeds, list | tuple) or not seeds:
        return False
    whole = all(type(seed) is int and 0 <= seed <= MAX_SEED for seed in seeds)
    return whole and len({*seeds}) == len(seeds)


def read_assignment(path: Path) -> Assignment:
    """The assignment in a file; raises BadFile with the line of a fault, or BadParameter."""
    where = str(path)
    try:
        rows = read_bytes(path).decode().split("\n")
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadFile(where, 1, None, "not UTF-8") from None
    told: dict[str, object] = {}
    for number, row in enumerate(rows, 1):
        if row and not row.startswith("#"):
            key, value = parse_line(row, where, number)
            if key not in ASSIGNMENT_KEYS:
                raise BadFile(where, number, 1, str(UnknownName("key", key, ASSIGNMENT_KEYS)))
            told["seed" if key == SEEDS_KEY else key] = value
    seeds = told.get("seed")
    if not isinstance(seeds, list) or not _are_distinct_seeds(seeds):
        raise BadFile(where, 1, None, f"seeds: {EXPECTED_SEEDS}")
    told["seed"] = seeds[0]
    block = Block(1, tuple(told), tuple(told.values()), (), ())
    return Assignment(parse_header(block, where), tuple(seeds), path)
