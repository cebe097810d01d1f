"""A file that asks for more than a game can be ends in one line, whatever is done with it."""

import json
import re
from collections.abc import Mapping
from functools import partial
from pathlib import Path
from typing import NamedTuple

import pytest

from dmplay import disk
from dmplay.errors import BadTranscript, DmplayError
from dmplay.game.checking import rewrite_file, verify_file
from dmplay.game.playback import Playback
from dmplay.game.request import GameRequest, ResumeRequest
from dmplay.game.start import resume_game, start_new_game
from tests.support.quick import quickly

ROW = [[q, 0] for q in range(20_000)]


class Case(NamedTuple):
    """What a file asks for, and what it is told."""

    problem: str
    told: str
    agent: str = "random"
    given: Mapping[str, object] = {}


AGENTS = [
    Case("crying-baby", "horizon: got 1e+09", "plan:horizon=1000000000"),
    Case("machine-replacement", "horizon: got 10000", "optimal:horizon=10000"),
    Case("machine-replacement", "horizon: got 1e+08", "qmdp:horizon=100000000"),
    Case("catch", "horizon: got 1e+06", "optimal:horizon=1000000"),
    Case("catch", "exact search: more than", "optimal:horizon=1000"),
    Case("travelers-dilemma", "level: got 1e+09", "level-k:level=1000000000"),
    Case("hexworld", "depth: got 1e+07", "search:depth=10000000"),
    Case("hexworld", "search: 1,222 MB, more than 512", "search:depth=100000"),
    Case("hexworld", "simulations: got 1e+07", "search:simulations=10000000"),
]
PROBLEMS = [
    Case("hexworld", "bump_cost: got 4.29497e+09", given={"bump_cost": 4294967296}),
    Case("hexworld", "within 1000", given={"hexes": [[0, 0], [50_000_000, 0]], "rewards": []}),
    Case("hexworld", "got 20000 hexes", given={"hexes": ROW, "rewards": []}),
    Case("predator-prey", "got 20000 hexes", given={"hexes": ROW}),
    Case("collaborative-predator-prey", "got 20000 hexes", given={"hexes": ROW}),
    Case("collaborative-predator-prey", "predators: got 1e+15", given={"predators": 10**15}),
]
SOLVED = [  # today's answers take no longer where a discount is close to 1
    Case("crying-baby", "", "optimal", {"discount": 0.99999999}),
    Case("crying-baby", "", "qmdp", {"discount": 0.99999999}),
    Case("multicaregiver-crying-baby", "", "best-response", {"discount": 0.99999999}),
    Case("hexworld", "", "optimal", {"discount": 0.99999999, "bump_cost": 1e6}),
]


def asking(path: Path, case: Case, turns: int = 9) -> Path:
    """An unfinished file of two turns that asks for this."""
    asked = GameRequest(
        case.problem, agent="random", other_agent="", seed=1, turns=2, record_path=path
    )
    game = start_new_game(
        GameRequest(**vars(asked) | {"other_agent": "random"}) if _two(case) else asked
    )
    assert game.recorder
    while not game.session.over:
        game.session.advance()
        game.recorder.write_turn()
    text = path.read_text()
    text = re.sub("^turns: 2$", f"turns: {turns}", text, flags=re.MULTILINE)
    text = text.replace('"random"', json.dumps(case.agent), 1)
    given = f"set: {json.dumps(case.given)}\n" if case.given else ""
    path.write_text(text.replace("seats: ", f"{given}seats: "))
    game.recorder.close()
    return path


def advanced(asked: GameRequest) -> None:
    """Begins a game and plays its first turn."""
    start_new_game(asked).session.advance()


def gone_on(path: Path) -> None:
    """Goes on with a game for one turn."""
    resume_game(ResumeRequest(path)).session.advance()


def _two(case: Case) -> bool:
    return case.problem not in ("hexworld", "crying-baby", "machine-replacement", "catch")


@pytest.mark.parametrize("case", AGENTS + PROBLEMS, ids=lambda case: case.told)
def test_what_no_game_can_be_is_a_finding_and_not_gone_on_with(case: Case, tmp_path: Path) -> None:
    path = asking(tmp_path / "game.dmt", case)
    before = path.read_bytes()
    report = quickly(lambda: verify_file(path))
    assert case.told in str(report)
    with pytest.raises(DmplayError, match=re.escape(case.told)):
        quickly(partial(gone_on, path))
    assert path.read_bytes() == before


@pytest.mark.parametrize("case", PROBLEMS, ids=lambda case: case.told)
def test_what_no_problem_can_be_is_not_replayed(case: Case, tmp_path: Path) -> None:
    path = asking(tmp_path / "game.dmt", case)
    with pytest.raises(BadTranscript, match=re.escape(case.told)):
        quickly(lambda: Playback(path))


@pytest.mark.parametrize("case", AGENTS + PROBLEMS, ids=lambda case: case.told)
def test_what_no_game_can_be_is_not_begun(case: Case) -> None:
    asked = GameRequest(
        case.problem, agent=case.agent, seed=1, turns=100_000, parameters=case.given
    )
    with pytest.raises(DmplayError, match=re.escape(case.told)):
        quickly(partial(advanced, asked))


@pytest.mark.parametrize("case", SOLVED, ids=lambda case: case.agent)
def test_what_is_soon_solved_at_any_discount_is_asked_again(case: Case, tmp_path: Path) -> None:
    path = asking(tmp_path / "game.dmt", case)
    assert quickly(lambda: verify_file(path)).turns == 2


@pytest.mark.parametrize("problem", ["multicaregiver-crying-baby", "hexworld", "predator-prey"])
def test_agents_alone_play_no_more_turns_than_their_file_holds(
    problem: str, tmp_path: Path
) -> None:
    path = asking(tmp_path / "game.dmt", Case(problem, ""), turns=10**12)
    told = f"^{path}:.*: turns: got {10**12}, expected at most 10000 where no person plays; if"
    with pytest.raises(BadTranscript, match=told):
        resume_game(ResumeRequest(path))
    game = resume_game(ResumeRequest(path, turn_limit=10**12))
    game.session.advance()
    assert game.recorder
    game.recorder.close()
    with path.open("a") as file:
        file.write('end: {"reason": "turn limit"}\n')
    with pytest.raises(BadTranscript, match=told):
        rewrite_file(path)
    assert verify_file(path).turns == 2


def test_other_seats_than_those_of_the_problem_are_not_sat_in(tmp_path: Path) -> None:
    case = Case("predator-prey", "", given={"predators": 26})
    path = asking(tmp_path / "game.dmt", case)
    with pytest.raises(BadTranscript, match="seats: got predator, prey, expected predator1"):
        resume_game(ResumeRequest(path))


def test_a_file_that_is_too_large_is_not_read(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    with path.open("wb") as file:
        file.truncate(disk.MAX_FILE_BYTES + 1)
    assert "cannot be read: larger than 64 MB" in str(verify_file(path))
