"""Tests of seats that are taken over or handed over, and of the transcript that says so."""

from pathlib import Path

import pytest

from dmplay.errors import DmplayError
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import branch_game, start_new_game
from dmplay.game.launch_requests import BranchRequest, GameRequest
from dmplay.game.playback import Playback
from dmplay.game.saves import load_transcript
from dmplay.game.transcript_verification import rewrite_file, verify
from dmplay.ui.shell.commands import run_line


def record_walk(path: Path, agent: str = "random", turns: int = 6) -> Path:
    """Record a game of an agent, and return the file."""
    game = start_new_game(
        GameRequest("hexworld", seed=7, agent=agent, turns=turns, record_path=path)
    )
    for _ in game.iter_agent_turns():
        pass
    game.finish()
    return path


def branch(source: Path, target: Path, turn: int, *seats: str) -> Path:
    """Branch a game and let its agents play to the end; return the new file."""
    game = branch_game(BranchRequest(source, turn=turn, record_path=target, seats=seats))
    if not game.human_seats:
        for _ in game.iter_agent_turns():
            pass
    game.finish()
    return target


def test_the_header_says_who_held_the_seat_before(tmp_path: Path) -> None:
    walk = record_walk(tmp_path / "walk.dmt")
    taken = branch(walk, tmp_path / "taken.dmt", 3, "agent=optimal")
    assert (
        'seats: {"agent": "optimal"}\nseed: 7\nturns: 6\nbranched: 3\n'
        'earlier: [{"turns": 3, "seats": {"agent": "random"}}]\n'
    ) in taken.read_text()
    assert Playback(taken).warning == "agent: random until turn 3"


def test_a_seat_changes_hands_more_than_once(tmp_path: Path) -> None:
    walk = record_walk(tmp_path / "walk.dmt")
    first = branch(walk, tmp_path / "first.dmt", 3, "agent=optimal")
    second = branch(first, tmp_path / "second.dmt", 5, "agent=human")
    header = load_transcript(second).header
    assert [entry["turns"] for entry in header.earlier] == [3, 5]
    assert header.count_turns_of_earlier_players() == [5]
    earlier = branch(first, tmp_path / "earlier.dmt", 2, "agent=human")
    assert [entry["turns"] for entry in load_transcript(earlier).header.earlier] == [2, 2]
    assert not any(verify(path).findings for path in (walk, first, second, earlier))


def test_a_branch_without_a_new_player_has_no_earlier_players(tmp_path: Path) -> None:
    walk = record_walk(tmp_path / "walk.dmt")
    same = branch(walk, tmp_path / "same.dmt", 3, "agent=random")
    from_the_start = branch(walk, tmp_path / "start.dmt", 0, "agent=optimal")
    assert "earlier" not in same.read_text() + from_the_start.read_text()


def test_only_the_turns_of_the_present_player_are_recomputed(tmp_path: Path) -> None:
    walk = record_walk(tmp_path / "walk.dmt")
    taken = branch(walk, tmp_path / "taken.dmt", 3, "agent=optimal")
    report = verify(taken)
    assert not report.findings
    assert report.unchecked_players == ["random"]
    assert rewrite_file(taken) == ""
    taken.write_text(taken.read_text().replace("earlier: ", "# earlier: "))
    assert any("action" in str(finding) for finding in verify(taken).findings)


@pytest.mark.parametrize(
    "line",
    ['"human"', '[{"turns": "x", "seats": {}}]', '[{"turns": 1}]', '[{"turns": 1, "seats": 2}]'],
)
def test_a_malformed_line_is_one_finding(line: str, tmp_path: Path) -> None:
    walk = record_walk(tmp_path / "walk.dmt")
    walk.write_text(walk.read_text().replace("turns: 6\n", f"turns: 6\nearlier: {line}\n", 1))
    (finding,) = verify(walk).findings
    assert "earlier" in str(finding)


@pytest.mark.parametrize(
    ("seat", "message"),
    [
        ("nobody=human", "unknown seat 'nobody'"),
        ("agent", "--seat: got 'agent', expected NAME=VALUE"),
        ("agent=nonsense", "unknown agent 'nonsense'"),
    ],
)
def test_a_wrong_seat_is_refused(seat: str, message: str, tmp_path: Path) -> None:
    walk = record_walk(tmp_path / "walk.dmt")
    with pytest.raises(DmplayError, match=message):
        branch(walk, tmp_path / "new.dmt", 2, seat)
    assert not (tmp_path / "new.dmt").exists()


def test_a_seat_of_a_game_without_a_transcript_cannot_be_given_away() -> None:
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=None))
    game.recorder = None
    with pytest.raises(DmplayError, match="seat: this game is not recorded"):
        run_line(GameController(game), "seat agent=optimal")


def test_the_command_seat_needs_a_seat_and_a_player(tmp_path: Path) -> None:
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "game.dmt"))
    controller = GameController(game)
    for line, message in (
        ("seat", "expected NAME=human or NAME=AGENT"),
        ("seat agent", "seat: got 'agent', expected NAME=VALUE"),
        ("seat nobody=human", "unknown seat 'nobody'"),
    ):
        with pytest.raises(DmplayError, match=message):
            run_line(controller, line)
    game.finish()
