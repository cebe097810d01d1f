"""Games of Python code, written as transcripts."""

import os
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import cast

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.safe_files import PRIVATE_FILE_MODE, default_file_mode, write_file
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.game.launch_requests import GameRequest
from dmplay.game.seats import HUMAN, make_header
from dmplay.registry.agents import AgentLike, find_agent_name, load_roster
from dmplay.registry.problems import LoadedProblem, identify_problem
from dmplay.transcript.regeneration import format_session


def save(session: Session, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write the game of a session as a transcript; if it is not over, it can be resumed from it.

    The session is your own, or that of an environment: `env.unwrapped.session`. A seat without an
    agent is recorded as a person's, and so is that of an agent without a name. A problem without a
    name is recorded by its class; give it to `dmplay.read` with `problem=`. Raise BadParameter if
    the file exists and `overwrite` is False, or if it cannot be written.
    """
    if not hasattr(session, "seated_policies"):
        kind = type(session).__name__
        raise BadParameter(f"save: got {kind}, expected a Session; a game of play saves itself")
    players = [
        find_recorded_name(session.problem, seat, seated.policy if seated else None)
        for seat, seated in enumerate(session.seated_policies)
    ]
    write_session(session, Path(path), players, overwrite=overwrite)


def find_recorded_name(
    problem: Problem, seat: int, policy: Policy | None, agent: AgentLike | None = None
) -> str:
    """Return the name by which a transcript records a player, that of a person if there is none.

    A policy of the roster has a name; that of any other is the `agent` from which it was made.
    """
    name = find_agent_name(problem, seat, policy) if policy else HUMAN
    if policy is None or name.partition(":")[0] in load_roster(problem, seat).agents:
        return name
    return agent if isinstance(agent, str) else HUMAN


def write_session(  # noqa: PLR0913 - facts of a header
    session: Session,
    path: Path,
    players: Sequence[str],
    loaded: LoadedProblem | None = None,
    *,
    player: str = "",
    overwrite: bool = False,
) -> None:
    """Write a session with the names of its players; by default, its problem is identified."""
    if path.exists() and not overwrite:
        raise BadParameter(f"save: {path} exists; give another name, or overwrite=True")
    uniforms = cast("SeededUniforms", session.uniform_source)
    loaded = loaded or identify_problem(session.problem)
    has_own_limit = session.turn_limit != session.problem.horizon
    request = GameRequest(
        loaded.name,
        seed=uniforms.seed,
        episode=uniforms.episode,
        turns=session.turn_limit if has_own_limit else None,
        player=player,
    )
    header = make_header(loaded, players, request, path)
    is_private = session.problem.partially_observable and not session.over
    if path.is_file():  # A file that is written again keeps its permissions.
        with suppress(OSError):
            path.chmod(PRIVATE_FILE_MODE if is_private else default_file_mode())
    write_file(path, [format_session(header, session)], force=overwrite, private=is_private)
