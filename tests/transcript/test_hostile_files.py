"""Tests of files that demand more than the limits of a game: every command fails with one line."""

import json
import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pytest

from dmplay.core import safe_files
from dmplay.errors import BadTranscript, DmplayError
from dmplay.game.game_setup import resume_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest, format_settings
from dmplay.game.playback import Playback
from dmplay.game.transcript_verification import rewrite_file, verify
from dmplay.transcript.reader import parse_transcript
from tests.support.games import record_game
from tests.support.interruption import run_with_call_limit

MANY_HEXES = [[q, 0] for q in range(20_000)]


class OversizedCase(NamedTuple):
    """A problem and agent that a file names, and the expected error message."""

    problem: str
    message: str
    agent: str = "random"
    parameters: Mapping[str, object] = {}


OVERSIZED_AGENTS = [
    OversizedCase("crying-baby", "horizon: got 1000000000", "plan:horizon=1000000000"),
    OversizedCase("machine-replacement", "horizon: got 10000", "optimal:horizon=10000"),
    OversizedCase("machine-replacement", "horizon: got 100000000", "qmdp:horizon=100000000"),
    OversizedCase("catch", "horizon: got 1000000", "optimal:horizon=1000000"),
    OversizedCase("catch", "exact search: more than", "optimal:horizon=1000"),
    OversizedCase("travelers-dilemma", "level: got 1000000000", "level-k:level=1000000000"),
    OversizedCase("hexworld", "depth: got 10000000", "search:depth=10000000"),
    OversizedCase(
        "hexworld", "search: 1,222 MB, more than the limit of 512 MB", "search:depth=100000"
    ),
    OversizedCase("hexworld", "simulations: got 10000000", "search:simulations=10000000"),
]
OVERSIZED_PROBLEMS = [
    OversizedCase("hexworld", "bump_cost: got 4294967296", parameters={"bump_cost": 4294967296}),
    OversizedCase(
        "hexworld", "within 1000", parameters={"hexes": [[0, 0], [50_000_000, 0]], "rewards": []}
    ),
    OversizedCase("hexworld", "got 20000 hexes", parameters={"hexes": MANY_HEXES, "rewards": []}),
    OversizedCase("predator-prey", "got 20000 hexes", parameters={"hexes": MANY_HEXES}),
    OversizedCase(
        "collaborative-predator-prey", "got 20000 hexes", parameters={"hexes": MANY_HEXES}
    ),
    OversizedCase(
        "collaborative-predator-prey", "predators: got 1e+15", parameters={"predators": 10**15}
    ),
]
HIGH_DISCOUNT_CASES = [  # solving takes no longer for a discount close to 1
    OversizedCase("crying-baby", "", "optimal", {"discount": 0.99999999}),
    OversizedCase("crying-baby", "", "qmdp", {"discount": 0.99999999}),
    OversizedCase("multicaregiver-crying-baby", "", "best-response", {"discount": 0.99999999}),
    OversizedCase("hexworld", "", "optimal", {"discount": 0.99999999, "bump_cost": 1e6}),
]


def write_unfinished_game(path: Path, case: OversizedCase, turns: int = 9) -> Path:
    """Write an unfinished game of two turns and change its file to this case; return its path."""
    request = GameRequest(
        case.problem, agent="random", other_agent="", seed=1, turns=2, record_path=path
    )
    game = start_new_game(
        GameRequest(**vars(request) | {"other_agent": "random"})
        if _has_two_agents(case)
        else request
    )
    assert game.recorder
    while not game.session.over:
        game.session.advance()
        game.recorder.write_turn()
    text = path.read_text()
    text = re.sub("^turns: 2$", f"turns: {turns}", text, flags=re.MULTILINE)
    text = text.replace('"random"', json.dumps(case.agent), 1)
    set_line = f"set: {json.dumps(case.parameters)}\n" if case.parameters else ""
    path.write_text(text.replace("seats: ", f"{set_line}seats: "))
    game.recorder.close()
    return path


def play_first_turn(request: GameRequest) -> None:
    """Start a game and play its first turn."""
    start_new_game(request).session.advance()


def resume_for_one_turn(path: Path) -> None:
    """Resume a game and play one turn."""
    resume_game(ResumeRequest(path)).session.advance()


def _has_two_agents(case: OversizedCase) -> bool:
    return case.problem not in ("hexworld", "crying-baby", "machine-replacement", "catch")


@pytest.mark.parametrize(
    "case", OVERSIZED_AGENTS + OVERSIZED_PROBLEMS, ids=lambda case: case.message
)
def test_an_oversized_game_is_a_finding_and_is_not_resumed(
    case: OversizedCase, tmp_path: Path
) -> None:
    path = write_unfinished_game(tmp_path / "game.dmt", case)
    before = path.read_bytes()
    report = run_with_call_limit(lambda: verify(path))
    assert case.message in str(report)
    with pytest.raises(DmplayError, match=re.escape(case.message)):
        run_with_call_limit(partial(resume_for_one_turn, path))
    assert path.read_bytes() == before


@pytest.mark.parametrize("case", OVERSIZED_PROBLEMS, ids=lambda case: case.message)
def test_an_oversized_problem_is_not_replayed(case: OversizedCase, tmp_path: Path) -> None:
    path = write_unfinished_game(tmp_path / "game.dmt", case)
    with pytest.raises(BadTranscript, match=re.escape(case.message)):
        run_with_call_limit(lambda: Playback(path))


@pytest.mark.parametrize(
    "case", OVERSIZED_AGENTS + OVERSIZED_PROBLEMS, ids=lambda case: case.message
)
def test_an_oversized_game_is_not_started(case: OversizedCase) -> None:
    request = GameRequest(
        case.problem,
        agent=case.agent,
        seed=1,
        turns=100_000,
        settings=format_settings(case.parameters),
    )
    with pytest.raises(DmplayError, match=re.escape(case.message)):
        run_with_call_limit(partial(play_first_turn, request))


@pytest.mark.parametrize("case", HIGH_DISCOUNT_CASES, ids=lambda case: case.agent)
def test_an_agent_that_solves_high_discounts_quickly_is_checked(
    case: OversizedCase, tmp_path: Path
) -> None:
    path = write_unfinished_game(tmp_path / "game.dmt", case)
    assert run_with_call_limit(lambda: verify(path)).turns == 2


@pytest.mark.parametrize("problem", ["multicaregiver-crying-baby", "hexworld", "predator-prey"])
def test_games_without_people_cannot_raise_the_turn_limit_in_their_file(
    problem: str, tmp_path: Path
) -> None:
    path = write_unfinished_game(tmp_path / "game.dmt", OversizedCase(problem, ""), turns=10**12)
    pattern = f"^{path}:.*: turns: got {10**12}, expected at most 10000 if only agents play; to"
    with pytest.raises(BadTranscript, match=pattern):
        resume_game(ResumeRequest(path))
    game = resume_game(ResumeRequest(path, turn_limit=10**12))
    game.session.advance()
    assert game.recorder
    game.recorder.close()
    with path.open("a") as file:
        file.write('end: {"reason": "turn limit"}\n')
    with pytest.raises(BadTranscript, match=pattern):
        rewrite_file(path)
    assert verify(path).turns == 2


def test_a_file_with_seats_of_another_problem_is_not_resumed(tmp_path: Path) -> None:
    case = OversizedCase("predator-prey", "", parameters={"predators": 26})
    path = write_unfinished_game(tmp_path / "game.dmt", case)
    with pytest.raises(BadTranscript, match="seats: got predator, prey, expected predator1"):
        resume_game(ResumeRequest(path))


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    with path.open("wb") as file:
        file.truncate(safe_files.MAX_FILE_BYTES + 1)
    assert "cannot be read: larger than 64 MB" in str(verify(path))


def test_a_merge_conflict_is_named_with_its_line(tmp_path: Path) -> None:
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=2)
    lines = (tmp_path / "g.dmt").read_bytes().splitlines(keepends=True)
    raw = b"".join([*lines[:4], b"<<<<<<< HEAD\n", *lines[4:]])
    with pytest.raises(BadTranscript, match=r":5: got the merge conflict marker <<<<<<<"):
        parse_transcript(raw)
