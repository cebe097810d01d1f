"""Who sits where: people, agents, scripts and recordings."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from dmplay.core import Policy, Problem
from dmplay.disk import read_bytes
from dmplay.errors import BadParameter, DmplayError
from dmplay.finding import agents, problems
from dmplay.finding.ways import CURRENT_FOLDER, names_bot, rebase_name, transcript_folder
from dmplay.game.request import GameRequest
from dmplay.game.saves import load_transcript
from dmplay.keys.keyboard import parse_action_text
from dmplay.policies.kinds import SeatPolicy
from dmplay.policies.script import Script
from dmplay.terminal import escape_unprintable
from dmplay.transcript.format import EXTERNAL_PLAYERS, HUMAN_PLAYER
from dmplay.transcript.header import HEADER_LINES, Header
from dmplay.transcript.replay import replay
from dmplay.transcript.seal import disclose_transcript

HUMAN = HUMAN_PLAYER
UNVERIFIABLE_PLAYERS = (
    *EXTERNAL_PLAYERS,
    "script",
    "replay",
)  # seats whose actions only the file can tell


def list_human_seats(player_names: Sequence[str]) -> list[int]:
    """The seats that people play, or a language model."""
    return [seat for seat, who in enumerate(player_names) if who in EXTERNAL_PLAYERS]


def make_seat_policy(
    problem: Problem, seat: int, player: str, turn_limit: int | None = None
) -> Policy | None:
    """The policy that plays a seat of a game of so many turns; None for a person."""
    kind, _, rest = player.partition(":")
    if player == HUMAN:
        return None
    if kind == "script":
        return Script(problem, seat, _parse_script(problem, seat, rest))
    if kind == "replay":
        played = replay(disclose_transcript(load_transcript(Path(rest)), problem), problem).turns
        return Script(problem, seat, tuple(turn.actions[seat].item() for turn in played))
    if names_bot(player):
        return agents.make_bot(problem, seat, player, turn_limit)
    return agents.load_agent(problem, seat, player)


def _parse_script(problem: Problem, seat: int, script: str) -> tuple[float, ...]:
    """Actions from `a,b,c`, or from a file with one action or several to a line."""
    if _is_file(script):
        try:
            rows = read_bytes(Path(script)).decode().splitlines()
        except OSError as error:
            raise BadParameter(f"{script}: {error.strerror}") from None
        except UnicodeDecodeError:
            raise BadParameter(
                f"{script}: got what is no UTF-8, expected lines of actions"
            ) from None
        words = [
            (f"{script}:{number}", word)
            for number, row in enumerate(rows, 1)
            for word in row.partition("#")[0].replace(",", " ").split()
        ]
    else:
        words = [
            (f"script action {n}", word) for n, word in enumerate(script.split(","), 1) if word
        ]
    actions = []
    for where, word in words:
        try:
            actions.append(parse_action_text(problem, seat, word))
        except DmplayError as error:
            raise BadParameter(f"{where}: {error}") from None
    return tuple(actions)


def _is_file(path: str) -> bool:
    try:
        return Path(path).is_file()
    except (OSError, ValueError):  # too long to be a name, or no name
        return False


def load_verifiable_policies(
    problem: Problem,
    player_names: Mapping[str, str],
    *,
    trusted: bool,
    folder: Path = CURRENT_FOLDER,
) -> list[Policy | None]:
    """The agents of a transcript that can be asked what they would do; None for the others.

    A path is told from `folder`.
    """
    names = [rebase_name(who, folder, CURRENT_FOLDER) for who in player_names.values()]
    return [_verifiable_policy(problem, seat, who, trusted) for seat, who in enumerate(names)]


def load_resumed_players(
    problem: Problem, header: Header, *, trusted: bool, folder: Path = CURRENT_FOLDER
) -> tuple[list[str], list[Policy | None]]:
    """Who plays on where a transcript leaves off: its agents, people for all other seats.

    What a file names, a path told from `folder`, is imported only where it is trusted; raises
    BadParameter otherwise.
    """
    known = [
        HUMAN if who.partition(":")[0] in UNVERIFIABLE_PLAYERS else who
        for who in header.seats.values()
    ]
    names = [rebase_name(who, folder, CURRENT_FOLDER) for who in known]
    for name in names:
        base = name.partition(":")[0]
        if name != HUMAN and base not in agents.load_roster(problem).agents and not trusted:
            raise BadParameter(f"seats: {name!r} is not built in; if it is yours, add --trust")
    turns = header.turns
    return names, [make_seat_policy(problem, seat, name, turns) for seat, name in enumerate(names)]


def _verifiable_policy(problem: Problem, seat: int, player: str, trusted: bool) -> Policy | None:
    brought = agents.names_user_code(problem, seat, player)
    if player in UNVERIFIABLE_PLAYERS or names_bot(player) or (brought and not trusted):
        return None
    policy = agents.load_agent(problem, seat, player)
    timed = (
        isinstance(policy, SeatPolicy) and policy.depends_on_clock
    )  # it may do otherwise next time
    return None if timed else policy


def name_in_transcript(name: str, path: Path | None) -> str:
    """The name of a problem or an agent as a transcript there has it."""
    return rebase_name(name, CURRENT_FOLDER, transcript_folder(path)) if path else name


def make_header(
    loaded_problem: problems.LoadedProblem,
    player_names: Sequence[str],
    request: GameRequest,
    path: Path | None,
) -> Header:
    """The header of a game's transcript there; scripts are named without their place."""
    names = [
        who.partition(":")[0]
        if who.startswith(("script:", "replay:"))
        else name_in_transcript(who, path)
        for who in (request.person_label if who == HUMAN else who for who in player_names)
    ]
    told = {line.field: getattr(request, line.field) for line in HEADER_LINES}
    told |= {
        "problem": name_in_transcript(loaded_problem.name, path),
        "origin": loaded_problem.origin,
    }
    told["parameters"] = loaded_problem.parameters
    told["seats"] = dict(
        zip(loaded_problem.problem.agents, map(escape_unprintable, names), strict=True)
    )
    return Header(**told)
