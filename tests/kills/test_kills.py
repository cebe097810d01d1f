"""The suite itself: what a kill must not do is found where it is planted."""

from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from tests.kills.__main__ import report
from tests.kills.acts import ACTS, COPY, EARLY, HALF, drafts, result
from tests.kills.games import GAMES, Game, begun, events, unbroken
from tests.kills.moments import Scale, drawn
from tests.kills.suite import Result, named, tried

pytestmark = pytest.mark.slow  # starts the program again and again

GAME = Game("hexworld", "person")
CASE = "hexworld/person/{}/call=20"


def told(turns: int) -> str:
    """What was printed of so many turns."""
    return "".join(f"turn {turn}. at (1,1).\n" for turn in range(1, turns + 1))


def faults(act: str, folder: Path, content: bytes, printed: str = "") -> Iterator[str]:
    """What is found where a kill left this of the act's file."""
    ACTS[act].prepare(GAME, folder)
    ACTS[act].file(folder).write_bytes(content)
    return ACTS[act].faults(GAME, folder, printed)


@pytest.mark.parametrize("left", [0, 1, EARLY])
def test_nothing_is_said_of_a_game_that_kept_what_it_told(left: int, tmp_path: Path) -> None:
    content = begun(unbroken(GAME), left) if left else b""
    assert not [*faults("play", tmp_path, content, told(left))]


def test_a_lost_turn_is_found(tmp_path: Path) -> None:
    found = [*faults("play", tmp_path, begun(unbroken(GAME), 3), told(4))]
    assert found == ["lost: 4 turns were told, 3 are kept"]
    found = [*faults("resume", tmp_path, begun(unbroken(GAME), HALF), told(1))]
    assert found == [f"lost: {HALF + 1} turns were told, {HALF} are kept"]


def test_what_is_not_the_same_game_is_found(tmp_path: Path) -> None:
    other = begun(unbroken(GAME).replace(b'"ne"', b'"nw"', 1), 3)
    assert "unequal: what is left is not how the game began" in [*faults("play", tmp_path, other)]
    assert "unequal: the game that was gone on with" in [*faults("play", tmp_path, other)]


def test_a_file_that_cannot_be_gone_on_with_is_found(tmp_path: Path) -> None:
    (found,) = (fault for fault in faults("play", tmp_path, b"dmplay: 1\n") if "lost" in fault)
    assert found.startswith("lost: not resumed: error: g.dmt:1: ")


@pytest.mark.parametrize("act", ["update", "export"])
def test_half_of_a_new_file_is_found(act: str, tmp_path: Path) -> None:
    whole = result(ACTS[act], GAME)
    assert not [*faults(act, tmp_path, whole)]
    found = [*faults(act, tmp_path, whole[: len(whole) // 2])]
    assert "unequal: neither the old file nor the new one" in found


def test_a_copy_that_is_lost_or_torn_is_found(tmp_path: Path) -> None:
    whole = unbroken(GAME)
    assert [*faults("save", tmp_path, whole, f"saved {COPY};")] == [
        "lost: the copy that was told of"
    ]
    (tmp_path / COPY).write_bytes(begun(whole, HALF - 1))
    assert [*faults("save", tmp_path, whole)] == ["unequal: the copy is not whole"]


def test_a_draft_that_was_left_is_found(tmp_path: Path) -> None:
    (tmp_path / ".dmplay-1.tmp").touch()
    assert drafts(tmp_path) == [".dmplay-1.tmp"]


@pytest.mark.parametrize("act", ACTS)
def test_a_name_is_enough_to_kill_at_the_same_moment_again(act: str) -> None:
    case = named(CASE.format(act))
    assert str(case) == CASE.format(act)
    first, second = tried(case), tried(case)
    assert first == second
    assert (first.killed, first.faults) == (True, [])


def test_moments_are_of_every_kind_and_within_the_run() -> None:
    scale = Scale(calls=9, seconds=1.0, size=99)
    found = [drawn(Random(seed), scale) for seed in range(99)]
    assert {moment.kind for moment in found} == {"call", "share", "size"}
    assert {moment.value for moment in found if moment.kind == "call"} == {*range(1, 10)}
    assert all(moment.value <= scale.size for moment in found)


def test_a_fault_is_told_with_its_case_and_counted() -> None:
    case = named(CASE.format("play"))
    rows = report([Result(case, True, "part", ["lost: 1"]), Result(case, False, "whole", [])])
    assert rows[0] == f"{case}: lost: 1"
    assert rows[-1] == "all           2      1  1 part, 1 whole; 1 lost, 0 unequal"


@pytest.mark.parametrize("game", [game for game in GAMES if game.by == "person"], ids=str)
def test_a_person_types_a_line_for_each_turn_and_event(game: Game) -> None:
    assert events(unbroken(game)) == len(game.script)
