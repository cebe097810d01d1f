"""An assignment: a file with the games that several people have to play.

It is the header of their transcripts, with a list of `seeds` in place of one seed:

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

from dmplay.core.safe_files import read_bytes, write_file
from dmplay.errors import BadFile, BadParameter, UnknownName
from dmplay.game.game_setup import MAX_SEED, assign_players
from dmplay.game.launch_requests import GameRequest, ResumeRequest, request_from_header
from dmplay.game.saves import load_transcript
from dmplay.game.seats import HUMAN, load_resumed_players, make_header, make_seat_policy
from dmplay.registry import problems
from dmplay.registry.problem_name_kinds import CURRENT_FOLDER, rebase_name, transcript_folder
from dmplay.transcript.concealment import RESUMABLE_END_REASONS
from dmplay.transcript.format import format_lines
from dmplay.transcript.header import Header, collect_header_facts
from dmplay.transcript.line_parser import parse_line
from dmplay.transcript.reader import HEADER_KEYS, Block, parse_header, read_incomplete_transcript

SEEDS_KEY = "seeds"
ASSIGNMENT_KEYS = [SEEDS_KEY if key == "seed" else key for key in HEADER_KEYS]
EXPECTED_SEEDS = f"expected distinct whole numbers from 0 to {MAX_SEED}, such as 7, 8"
FIXED_OPTIONS = {  # options that a player of an assignment may not set
    "problem": "PROBLEM and --variant", "settings": "--set", "agent": "--agent",
    "other_agent": "--vs", "seats": "--seat", "turns": "--turns", "episode": "--episode",
    "strict": "--strict", "reveal": "--reveal", "ghost_agent": "--ghost",
}  # fmt: skip


@dataclass(frozen=True)
class Assignment:
    """The games to play: the header of the first game, the seeds of all, and the file."""

    header: Header
    seeds: tuple[int, ...]
    path: Path

    def list_differing_facts(self, other: Header, path: Path) -> list[str]:
        """Return the names of the facts in which a game differs; empty if it was assigned.

        `path` is the file of the game's transcript.
        """
        expected, seats = self.header, other.seats
        is_same_problem = self._is_same_name(expected.problem, other.problem, path)
        differences = [] if is_same_problem else ["problem"]
        for name in ("origin", "parameters", "turns", "episode"):
            if getattr(expected, name) != getattr(other, name):
                differences.append(name)
        differences += ["seed"] if other.seed not in self.seeds else []
        are_same_seats = expected.seats.keys() == seats.keys() and all(
            self._is_same_name(player, seats[agent], path)
            for agent, player in expected.seats.items()
        )
        differences += [] if are_same_seats else ["seats"]
        is_less_strict = expected.strict and other.strict not in (expected.strict, "hints")
        return differences + (["strict"] if is_less_strict else [])

    def list_own_names(self, other: Header, path: Path) -> dict[str, str]:
        """Return the names in a transcript's header that are the assignment's own.

        The keys are the names as the transcript at this path writes them; the values are the
        assignment's, relative to the current folder. Loading these runs no code that was handed in.
        """
        expected = self.header
        pairs = [(expected.problem, other.problem)] + [
            (player, other.seats.get(agent, "")) for agent, player in expected.seats.items()
        ]
        return {
            recorded: rebase_name(assigned, transcript_folder(self.path), CURRENT_FOLDER)
            for assigned, recorded in pairs
            if self._is_same_name(assigned, recorded, path)
        }

    def _is_same_name(self, assigned: str, recorded: str, path: Path) -> bool:
        """Return whether a name in a transcript at this path is a name of the assignment.

        Each is relative to its own folder. A game that was played beside a copy of the assignment
        writes the name as the assignment does, wherever the transcript lies now.
        """
        recorded_name, assigned_name = (
            rebase_name(name, transcript_folder(file), CURRENT_FOLDER).removeprefix("./")
            for name, file in ((recorded, path), (assigned, self.path))
        )
        return recorded == assigned or recorded_name == assigned_name

    def build_request(self, options: GameRequest, *, trusted: bool) -> GameRequest | ResumeRequest:
        """Return the request for the next game of a player: the one to resume, or a new one."""
        _check_assigned_request(options)
        seed, record = self._choose_seed_and_path(options)
        if not options.force and self._is_unfinished(record):
            return ResumeRequest(record, trusted, options.key_preferences, options.can_ask)
        name = rebase_name(self.header.problem, transcript_folder(self.path), CURRENT_FOLDER)
        lookup = problems.resolve_problem(name, self.header.parameters, trusted=trusted)
        seats, _ = load_resumed_players(
            lookup.problem, self.header, trusted=trusted, folder=transcript_folder(self.path)
        )
        game_header = replace(self.header, problem=name, seed=seed, player=options.player)
        game_request = request_from_header(game_header, seats, record, options.key_preferences)
        return replace(
            game_request,
            is_handed_in=True,
            record_frames=options.record_frames,
            force=options.force,
            can_ask=options.can_ask,
            typed_options=options.typed_options,
            states_belief=options.states_belief,
        )

    def _choose_seed_and_path(self, options: GameRequest) -> tuple[int, Path]:
        """Return the seed of the next game and the path of its transcript.

        Raises BadParameter if all were played, or the seed is not assigned.
        """
        if options.seed is not None and options.seed not in self.seeds:
            seed_list = ", ".join(map(str, self.seeds))
            raise BadParameter(
                f"--seed: got {options.seed}, expected a seed of {self.path}: {seed_list}"
            )
        stem = "-".join(re.findall(r"\w+", options.player.lower())) or "game"
        files = {seed: Path(f"{stem}-{seed}.dmt") for seed in self.seeds}
        if options.seed is not None:
            return options.seed, options.record_path or files[options.seed]
        for seed, file in files.items():
            if not file.exists() or self._is_unfinished(file):
                return seed, options.record_path or file
        file_list = ", ".join(map(str, files.values()))
        raise BadParameter(f"{self.path}: you have played all games; hand in {file_list}")

    def _is_unfinished(self, path: Path) -> bool:
        """Return whether a file has a game that has not ended and can be resumed.

        Raises BadParameter if it has a game that was not assigned.
        """
        if not path.is_file():
            return False
        transcript = load_transcript(path, read_incomplete_transcript)
        header = transcript.header
        # A problem file that was changed in the meantime is still the same game.
        differences = {*self.list_differing_facts(header, path)} - {"origin"}
        if differences:
            raise BadParameter(
                f"{path}: not a game of {self.path} (different {', '.join(sorted(differences))}); "
                "play in another folder"
            )
        is_sealed = header.strict and header.peeked
        return transcript.end_reason in RESUMABLE_END_REASONS and not is_sealed


def _check_assigned_request(options: GameRequest) -> None:
    """Raise BadParameter for options that the assignment fixes, or without a player's name."""
    defaults = GameRequest("")
    for name, option in FIXED_OPTIONS.items():
        if (getattr(options, name) or None) != (getattr(defaults, name) or None):
            raise BadParameter(f"--assignment: the assignment sets the game; omit {option}")
    if not options.player:
        raise BadParameter("--assignment: got no player name; add --player NAME")


def write_assignment(
    request: GameRequest, seeds: tuple[int, ...], path: Path, *, force: bool
) -> str:
    """Write an assignment of these games; return a message with the command that plays it."""
    if not _are_distinct_seeds(seeds):
        raise BadParameter(f"--seeds: got {', '.join(map(str, seeds)) or 'none'}, {EXPECTED_SEEDS}")
    lookup = request.load_problem()
    seats = assign_players(lookup, request.agent, request.other_agent, request.seats, request.turns)
    if HUMAN not in seats:
        raise BadParameter("assign: agents play all seats; leave a seat to a human player")
    for seat, player in enumerate(seats):
        # raises an error for a player that cannot sit there
        make_seat_policy(lookup.problem, seat, player, request.turns)
    game_header = make_header(lookup, seats, replace(request, seed=seeds[0]), path)
    assignment = Assignment(game_header, seeds, path)
    write_file(path, [f"{row}\n" for row in _iter_lines(assignment)], force=force)
    return f"wrote {path}; to play: dmplay play --assignment {quote(str(path))} --player NAME"


def _iter_lines(assignment: Assignment) -> Iterator[str]:
    """Yield the lines of an assignment."""
    for key, value in collect_header_facts(assignment.header).items():
        yield from format_lines({SEEDS_KEY: [*assignment.seeds]} if key == "seed" else {key: value})


def _are_distinct_seeds(seeds: object) -> bool:
    """Return whether these are distinct valid seeds, at least one."""
    if not isinstance(seeds, list | tuple) or not seeds:
        return False
    is_valid = all(type(seed) is int and 0 <= seed <= MAX_SEED for seed in seeds)
    return is_valid and len({*seeds}) == len(seeds)


def read_assignment(path: Path) -> Assignment:
    """Return the assignment in a file.

    Raises BadFile with the line of an error, or BadParameter if the file cannot be read.
    """
    file_name = str(path)
    try:
        text_lines = read_bytes(path).decode().split("\n")
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadFile(file_name, 1, None, "not UTF-8") from None
    values: dict[str, object] = {}
    for number, line in enumerate(text_lines, 1):
        if line and not line.startswith("#"):
            key, value = parse_line(line, file_name, number)
            if key not in ASSIGNMENT_KEYS:
                raise BadFile(file_name, number, 1, str(UnknownName("key", key, ASSIGNMENT_KEYS)))
            values["seed" if key == SEEDS_KEY else key] = value
    seeds = values.get("seed")
    if not isinstance(seeds, list) or not _are_distinct_seeds(seeds):
        raise BadFile(file_name, 1, None, f"seeds: {EXPECTED_SEEDS}")
    values["seed"] = seeds[0]
    block = Block(1, tuple(values), tuple(values.values()), (), ())
    return Assignment(parse_header(block, file_name), tuple(seeds), path)
