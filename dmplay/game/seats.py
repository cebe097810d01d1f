"""Functions that assign players to seats: people, agents, scripts and replays."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from dmplay.agents.base import SCRIPTED_PLAYERS, SeatPolicy, address_opponent, describe_rule
from dmplay.agents.script import Script
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.safe_files import read_bytes
from dmplay.core.session import Session
from dmplay.core.text import escape_unprintable
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.action_input import parse_action_text
from dmplay.game.launch_requests import RECORDED_OPTIONS, GameRequest
from dmplay.game.saves import load_transcript
from dmplay.registry import agents, problems
from dmplay.registry.problem_name_kinds import (
    CURRENT_FOLDER,
    names_bot,
    rebase_name,
    resolve_recorded_name,
    transcript_folder,
)
from dmplay.transcript.concealment import mark_peeked_if_concealed
from dmplay.transcript.external_players import EXTERNAL_PLAYERS, HUMAN_PLAYER
from dmplay.transcript.header import Header
from dmplay.transcript.replay import replay

HUMAN = HUMAN_PLAYER
# their actions cannot be recomputed
UNVERIFIABLE_PLAYERS = (*EXTERNAL_PLAYERS, *SCRIPTED_PLAYERS)


def list_human_seats(player_names: Sequence[str]) -> list[int]:
    """Return the seats that a person or a language model plays."""
    return [seat for seat, player in enumerate(player_names) if player in EXTERNAL_PLAYERS]


def list_judged_seats(player_names: Sequence[str]) -> list[int]:
    """Return the seats whose choices are judged: of people and models, else of programs, else 0."""
    bots = [seat for seat, name in enumerate(player_names) if names_bot(name)]
    return list_human_seats(player_names) or bots or [0]


def list_scripts(session: Session, player_names: Sequence[str]) -> tuple[Script, ...]:
    """Return the scripts that play seats of a session.

    The scripts of a recorded game are its actions, if these reach its turn limit.
    """
    policies = [seated_policy and seated_policy.policy for seated_policy in session.seated_policies]
    scripts = [policy for policy in policies if isinstance(policy, Script)]
    if len(session.turns) == session.turn_limit:
        scripts += [
            Script(
                session.problem, seat, tuple(turn.actions[seat].item() for turn in session.turns)
            )
            for seat, name in enumerate(player_names)
            if name in SCRIPTED_PLAYERS
        ]
    return tuple(scripts)


def list_other_players(session: Session, player_names: Sequence[str]) -> list[tuple[str, str, str]]:
    """Return (agent, player, rule) for each agent that plays beside the people.

    The rule is the first line of the description of its policy, as a clause that calls the opponent
    "you"; '' without a description.
    """
    if not list_human_seats(player_names):
        return []
    seats = zip(session.problem.agents, player_names, session.seated_policies, strict=True)
    return [
        (agent, shorten_player_name(name), rule)
        for agent, name, seated in seats
        if seated and isinstance(seated.policy, SeatPolicy)
        for rule in [address_opponent(describe_rule(type(seated.policy)))]
    ]


def shorten_player_name(player: str) -> str:
    """Return a player's name; that of a `script:` or `replay:` without its actions or its file."""
    kind = player.partition(":")[0]
    return kind if kind in SCRIPTED_PLAYERS else player


def make_seat_policy(
    problem: Problem, seat: int, player: str, turn_limit: int | None = None
) -> Policy | None:
    """Return the policy of a player name for a seat; None for a person.

    `script:` and `replay:` players repeat listed or recorded actions. A bot is started as a
    process.
    """
    kind, _, argument = player.partition(":")
    if player == HUMAN:
        return None
    if kind == "script":
        return Script(problem, seat, _parse_script(problem, seat, argument))
    if kind == "replay":
        replayed_turns = replay(
            mark_peeked_if_concealed(load_transcript(Path(argument)), problem), problem
        ).turns
        return Script(problem, seat, tuple(turn.actions[seat].item() for turn in replayed_turns))
    return agents.load_agent(problem, seat, player, turns=turn_limit)


def _parse_script(problem: Problem, seat: int, script: str) -> tuple[float, ...]:
    """Return the actions of `a,b,c`, or of a file with one or more actions per line.

    In a file, `#` begins a comment. Raise BadParameter with the position of an invalid action.
    """
    if _is_file(script):
        try:
            rows = read_bytes(Path(script)).decode().splitlines()
        except OSError as error:
            raise BadParameter(f"{script}: {error.strerror}") from None
        except UnicodeDecodeError:
            raise BadParameter(f"{script}: not UTF-8, expected lines of actions") from None
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
    for position, word in words:
        try:
            actions.append(parse_action_text(problem, seat, word))
        except DmplayError as error:
            raise BadParameter(f"{position}: {error}") from None
    return tuple(actions)


def _is_file(path: str) -> bool:
    """Return whether a text is the path of an existing file."""
    try:
        return Path(path).is_file()
    except (OSError, ValueError):  # too long or not a valid path
        return False


def load_verifiable_policies(  # noqa: PLR0913 - facts of a header, and options
    problem: Problem,
    player_names: Mapping[str, str],
    *,
    turns: int | None = None,
    trusted: bool,
    folder: Path = CURRENT_FOLDER,
    assigned_names: Mapping[str, str] | None = None,
) -> list[Policy | None]:
    """Return, for each seat of a transcript, the policy that can be run again, or None.

    The player names are resolved, and their code is trusted, by `resolve_recorded_name`.
    """
    resolved = [
        resolve_recorded_name(name, folder, trusted=trusted, assigned_names=assigned_names)
        for name in player_names.values()
    ]
    return [
        _find_verifiable_policy(problem, seat, name, turns, trusted=may_import)
        for seat, (name, may_import) in enumerate(resolved)
    ]


def load_resumed_players(
    problem: Problem, header: Header, *, trusted: bool, folder: Path = CURRENT_FOLDER
) -> tuple[list[str], list[Policy | None]]:
    """Return the players and policies that continue a transcript: its agents, else people.

    Relative paths in player names are resolved against `folder`. User-defined code is imported only
    if
    `trusted` is true; else raise BadParameter.
    """
    players = [
        HUMAN if player.partition(":")[0] in UNVERIFIABLE_PLAYERS else player
        for player in header.seats.values()
    ]
    names = [rebase_name(player, folder, CURRENT_FOLDER) for player in players]
    for name in names:
        base = name.partition(":")[0]
        if name != HUMAN and base not in agents.load_roster(problem).agents and not trusted:
            raise BadParameter(
                f"seats: {name!r} is not built in; if you trust its code, add --trust"
            )
    turns = header.turns
    return names, [make_seat_policy(problem, seat, name, turns) for seat, name in enumerate(names)]


def _find_verifiable_policy(
    problem: Problem, seat: int, player: str, turns: int | None, *, trusted: bool
) -> Policy | None:
    """Return the policy of a player if it chooses the same actions again; else None.

    None for people, scripts, replays, bots, agents with a time limit, missing files and untrusted
    code.
    """
    is_user_code = agents.names_user_code(problem, seat, player)
    if player in UNVERIFIABLE_PLAYERS or names_bot(player) or (is_user_code and not trusted):
        return None
    if agents.is_missing_file(player):
        return None
    policy = agents.load_agent(problem, seat, player, turns=turns)
    # may choose differently next time
    has_time_limit = isinstance(policy, SeatPolicy) and policy.depends_on_clock
    return None if has_time_limit else policy


def name_in_transcript(name: str, path: Path | None) -> str:
    """Return the name of a problem or agent as a transcript at this path records it.

    A relative file path in the name is rebased to the folder of the transcript.
    """
    return rebase_name(name, CURRENT_FOLDER, transcript_folder(path)) if path else name


def make_header(
    loaded_problem: problems.LoadedProblem,
    player_names: Sequence[str],
    request: GameRequest,
    path: Path | None,
) -> Header:
    """Return the header of a game's transcript at this path.

    `script:` and `replay:` players are recorded without the actions or the file.
    """
    players = [
        name_in_transcript(
            request.person_label
            if player == HUMAN
            else agents.add_file_digest(shorten_player_name(player)),
            path,
        )
        for player in player_names
    ]
    seats = loaded_problem.problem.agents
    return Header(
        problem=name_in_transcript(loaded_problem.name, path),
        origin=loaded_problem.origin,
        parameters=loaded_problem.parameters,
        seats=dict(zip(seats, map(escape_unprintable, players), strict=True)),
        **{name: getattr(request, name) for name in RECORDED_OPTIONS},
    )
