"""Tests of the suite of kills itself: it reports the faults that are planted."""

from collections.abc import Iterator
from pathlib import Path
from random import Random

import pytest

from tests.crash_tests.__main__ import format_report
from tests.crash_tests.actions import (
    ACTS,
    BRANCH_EVENTS,
    COPY_NAME,
    RESUME_EVENTS,
    find_temporary_files,
    run_without_kill,
)
from tests.crash_tests.cases import Result, parse_case, run_case
from tests.crash_tests.games import (
    GAMES,
    Game,
    count_events,
    play_without_kill,
    truncate_transcript,
)
from tests.crash_tests.kill_moments import Scale, sample_moment

pytestmark = pytest.mark.slow  # starts the program many times

GAME = Game("hexworld", "person")
CASE = "hexworld/person/{}/call=20"


def format_turns(turns: int) -> str:
    """Return the output of a game after this number of turns."""
    return "".join(f"turn {turn}. at (1,1).\n" for turn in range(1, turns + 1))


def find_faults(act: str, folder: Path, content: bytes, output: str = "") -> Iterator[str]:
    """Return the faults after a kill left this content in the file of the act."""
    ACTS[act].prepare(GAME, folder)
    ACTS[act].file(folder).write_bytes(content)
    return ACTS[act].faults(GAME, folder, output)


@pytest.mark.parametrize("event_count", [0, 1, BRANCH_EVENTS])
def test_no_fault_is_reported_if_every_printed_turn_is_in_the_file(
    event_count: int, tmp_path: Path
) -> None:
    content = truncate_transcript(play_without_kill(GAME), event_count) if event_count else b""
    assert not [*find_faults("play", tmp_path, content, format_turns(event_count))]


def test_a_lost_turn_is_reported(tmp_path: Path) -> None:
    messages = [
        *find_faults(
            "play", tmp_path, truncate_transcript(play_without_kill(GAME), 3), format_turns(4)
        )
    ]
    assert messages == ["lost: 4 turns were told, 3 are kept"]
    messages = [
        *find_faults(
            "resume",
            tmp_path,
            truncate_transcript(play_without_kill(GAME), RESUME_EVENTS),
            format_turns(1),
        )
    ]
    assert messages == [f"lost: {RESUME_EVENTS + 1} turns were told, {RESUME_EVENTS} are kept"]


def test_a_different_game_is_reported(tmp_path: Path) -> None:
    other = truncate_transcript(play_without_kill(GAME).replace(b'"ne"', b'"nw"', 1), 3)
    assert "unequal: what is left is not how the game began" in [
        *find_faults("play", tmp_path, other)
    ]
    assert "unequal: the game that was gone on with" in [*find_faults("play", tmp_path, other)]


def test_a_file_that_cannot_be_resumed_is_reported(tmp_path: Path) -> None:
    (message,) = (
        fault for fault in find_faults("play", tmp_path, b"dmplay: 1\n") if "lost" in fault
    )
    assert message.startswith("lost: not resumed: error: g.dmt:1: ")


@pytest.mark.parametrize("act", ["update", "export"])
def test_a_half_written_file_is_reported(act: str, tmp_path: Path) -> None:
    complete = run_without_kill(ACTS[act], GAME)
    assert not [*find_faults(act, tmp_path, complete)]
    messages = [*find_faults(act, tmp_path, complete[: len(complete) // 2])]
    assert "unequal: neither the old file nor the new one" in messages


def test_a_lost_or_incomplete_copy_is_reported(tmp_path: Path) -> None:
    complete = play_without_kill(GAME)
    assert [*find_faults("save", tmp_path, complete, f"saved {COPY_NAME};")] == [
        "lost: the copy that was told of"
    ]
    (tmp_path / COPY_NAME).write_bytes(truncate_transcript(complete, RESUME_EVENTS - 1))
    assert [*find_faults("save", tmp_path, complete)] == ["unequal: the copy is not whole"]


def test_a_remaining_temporary_file_is_reported(tmp_path: Path) -> None:
    (tmp_path / ".dmplay-1.tmp").touch()
    assert find_temporary_files(tmp_path) == [".dmplay-1.tmp"]


@pytest.mark.parametrize("act", ACTS)
def test_a_case_name_is_enough_to_repeat_the_kill(act: str) -> None:
    case = parse_case(CASE.format(act))
    assert str(case) == CASE.format(act)
    first, second = run_case(case), run_case(case)
    assert first == second
    assert (first.killed, first.faults) == (True, [])


def test_moments_are_of_every_kind_and_within_the_run() -> None:
    scale = Scale(calls=9, seconds=1.0, size=99)
    moments = [sample_moment(Random(seed), scale) for seed in range(99)]
    assert {moment.kind for moment in moments} == {"call", "share", "size"}
    assert {moment.value for moment in moments if moment.kind == "call"} == {*range(1, 10)}
    assert all(moment.value <= scale.size for moment in moments)


def test_a_fault_is_reported_with_its_case_and_counted() -> None:
    case = parse_case(CASE.format("play"))
    rows = format_report(
        [Result(case, True, "part", ["lost: 1"]), Result(case, False, "whole", [])]
    )
    assert rows[0] == f"{case}: lost: 1"
    assert rows[-1] == "all           2      1  1 part, 1 whole; 1 lost, 0 unequal"


@pytest.mark.parametrize("game", [game for game in GAMES if game.by == "person"], ids=str)
def test_a_person_types_a_line_for_each_turn_and_event(game: Game) -> None:
    assert count_events(play_without_kill(game)) == len(game.script)
