"""Tests of the transcript format: incremental writing, strict reading and exact replay."""

import json
import os
import pickle
import tracemalloc
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import dmplay
from dmplay.core import safe_files
from dmplay.core.uniforms import SeededUniforms
from dmplay.draw import canvas
from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.game import Game
from dmplay.game.game_setup import branch_game, resume_game, start_new_game
from dmplay.game.launch_requests import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.transcript_verification import rewrite_file, verify
from dmplay.transcript import format as transcript_format
from dmplay.transcript import reader
from dmplay.transcript.format import encode_json, round_number
from dmplay.transcript.line_parser import parse_line
from dmplay.transcript.reader import parse_transcript, read_transcript
from dmplay.transcript.verify import verify_transcript
from tests.support.games import record_game, replace_in_file
from tests.support.seated_agents import ObservationMutatingScript

OLDER_DRAWINGS = sorted((Path(__file__).parent / "older_drawings").glob("*.dmt"))
STRAIGHT_LINE_TEXT = """\
dmplay: 1
problem: "hexworld:straight-line"
seats: {"agent": "script"}
seed: 2

turn: 0
draws: [0.110228589]
state: "(0,0)"

turn: 1
actions: {"agent": "w"}
draws: [0.375235121]
state: "(0,0)"
rewards: {"agent": -1}

turn: 2
actions: {"agent": "e"}
draws: [0.453917248]
state: "(1,0)"
rewards: {"agent": 0}

end: {"reason": "quit", "turns": 2, "return": {"agent": -1}, "total": {"agent": -1}, \
"sha256": "%s"}
"""


@pytest.fixture
def transcript_path(tmp_path: Path) -> Path:
    path = tmp_path / "game.dmt"
    record_game(path, "hexworld:straight-line", "script:w,e", seed=2)
    return path


def list_findings(path: Path) -> list[str]:
    return str(verify(path)).replace(str(path), "game.dmt").splitlines()


def test_a_short_game_has_the_documented_text(transcript_path: Path) -> None:
    end = transcript_path.read_text().splitlines()[-1]
    digest = json.loads(end.removeprefix("end: "))["sha256"]
    assert transcript_path.read_text() == STRAIGHT_LINE_TEXT % digest
    assert verify(transcript_path).is_ok


def test_a_wrong_reward_is_reported_with_line_turn_seat_expected_and_got(
    transcript_path: Path,
) -> None:
    replace_in_file(transcript_path, 'rewards: {"agent": -1}', 'rewards: {"agent": -2}')
    assert (
        list_findings(transcript_path)[0]
        == "game.dmt:14: turn 1, agent: reward: expected -2, got -1"
    )


def test_a_wrong_state_is_reported(transcript_path: Path) -> None:
    replace_in_file(transcript_path, '"(1,0)"', '"(2,0)"')
    assert list_findings(transcript_path) == [
        "game.dmt:19: turn 2: state: expected (2,0), got (1,0)"
    ]


@pytest.mark.parametrize(
    "name", ["Optimal", "optimal ", "\N{CYRILLIC SMALL LETTER O}ptimal", "optimall", "", "human:1"]
)
def test_an_unknown_agent_is_a_finding(transcript_path: Path, name: str) -> None:
    replace_in_file(transcript_path, "script", name)
    assert list_findings(transcript_path)[0].startswith(
        ("game.dmt:3: seats: unknown agent ", "game.dmt:3: seats: agent: got 'human:1', expected ")
    )


@pytest.mark.parametrize(
    ("problem", "agent", "unchecked"),
    [
        ("hexworld", "optimal", []),
        ("hexworld", "script:e", ["script"]),
        ("2048", "expectimax:milliseconds=5", ["expectimax:milliseconds=5"]),
    ],
)
def test_unchecked_players_are_reported(
    problem: str, agent: str, unchecked: list[str], tmp_path: Path
) -> None:
    record_game(tmp_path / "game.dmt", problem, agent, turns=1)
    report = verify(tmp_path / "game.dmt")
    summary = f"1 turn; not recomputed: {unchecked[0]}" if unchecked else "1 turn"
    assert (report.is_ok, report.unchecked_players, report.summary) == (True, unchecked, summary)


def test_a_user_defined_agent_is_checked_only_with_trust(tmp_path: Path) -> None:
    path, bot = tmp_path / "game.dmt", f"{tmp_path}/bots.py:Bot"
    (tmp_path / "bots.py").write_text("from dmplay.agents.random_agent import Random as Bot\n")
    record_game(path, "hexworld", bot, turns=1)
    assert (verify(path).unchecked_players, verify(path, trusted=True).unchecked_players) == (
        ["bots.py:Bot"],
        [],
    )


def test_a_changed_uniform_violates_the_seed_but_not_the_rules(transcript_path: Path) -> None:
    replace_in_file(transcript_path, "0.453917248", "0.453917247")
    assert list_findings(transcript_path) == [
        "game.dmt:18: turn 2: draws: expected [0.453917247], got [0.453917248]",
        "game.dmt: the results follow from the recorded draws and actions, but these do not all "
        "follow from the seed and the agents",
    ]


def test_a_wrong_seed_is_reported_if_every_uniform_differs(transcript_path: Path) -> None:
    replace_in_file(transcript_path, "seed: 2", "seed: 12")
    assert list_findings(transcript_path)[0].startswith(
        "game.dmt:4: every turn: seed: expected the seed that produces these"
    )


def test_an_action_that_the_agent_would_not_choose_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    record_game(path, "prisoners-dilemma", "grim", other_agent="script:cooperate,defect", turns=2)
    replace_in_file(
        path,
        '{"agent1": "cooperate", "agent2": "defect"}',
        '{"agent1": "defect", "agent2": "defect"}',
    )
    assert list_findings(path)[0] == (
        "game.dmt:14: turn 2, agent1: action: expected defect, got cooperate"
    )


def test_a_changed_space_is_found_by_the_checksum(transcript_path: Path) -> None:
    replace_in_file(transcript_path, 'state: "(1,0)"', 'state:  "(1,0)"')
    assert list_findings(transcript_path)[0].startswith(
        'game.dmt:19: line: text: expected state:  "(1,0)"'
    )


def test_a_changed_checksum_is_found_on_its_own_line(transcript_path: Path) -> None:
    replace_in_file(transcript_path, '"sha256": "', '"sha256": "x')
    assert list_findings(transcript_path)[0].startswith("game.dmt:22: line: text: expected end: ")


def test_notes_may_be_added_anywhere(transcript_path: Path) -> None:
    rows = transcript_path.read_text().splitlines()
    text_with_notes = "\n".join(["# first", *rows[:12], "# within", *rows[12:], "# last", ""])
    transcript_path.write_text(text_with_notes)
    assert verify(transcript_path).is_ok
    assert rewrite_file(transcript_path) == ""
    assert transcript_path.read_text() == text_with_notes


@pytest.mark.parametrize("row", ["#unspaced", "#", "# a note"])
def test_the_text_of_a_note_follows_a_space(transcript_path: Path, row: str) -> None:
    transcript_path.write_text(f"{row}\n{transcript_path.read_text()}")
    expected = "expected 'key: value', '| frame', '# note' or an empty line"
    is_malformed = row == "#unspaced"
    assert list_findings(transcript_path) == [
        f"game.dmt:1: form: column 1: {expected}"
        if is_malformed
        else "ok game.dmt (2 turns; not recomputed: script)"
    ]


def test_a_wrong_frame_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    record_game(path, "hexworld", "optimal", record_frames=True, turns=1)
    assert verify(path).is_ok
    text = path.read_text()
    path.write_text(text.replace("+10", "+11", 1))
    assert " turn 0: frame: expected │     │     │ -10" in list_findings(path)[0]
    other_levels = {finding.level for finding in verify(path, compares_frames=False).findings}
    assert other_levels == {"checksum"}


@pytest.mark.parametrize("path", OLDER_DRAWINGS, ids=lambda path: path.stem)
def test_a_file_with_older_drawings_verifies_without_its_drawings(path: Path) -> None:
    assert verify(path, compares_frames=False).is_ok
    report = verify(path)
    assert {finding.level for finding in report.findings} == {"frame"}
    assert str(report).endswith("--no-frames leaves drawings out, --update redraws them")


def test_any_changed_digit_fails_on_its_line(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    text = record_game(path, "crying-baby", "feed-when-crying", seed=5, turns=1)
    for index in [index for index, glyph in enumerate(text) if glyph.isdigit()]:
        path.write_text(text[:index] + "9012345678"[int(text[index])] + text[index + 1 :])
        first_findings = verify(path).findings
        line = text[:index].count("\n") + 1
        assert first_findings, f"line {line}: {text.splitlines()[line - 1]}"
        assert first_findings[0].line == line


def test_an_unfinished_file_does_not_verify(transcript_path: Path) -> None:
    rows = transcript_path.read_text().splitlines(keepends=True)
    transcript_path.write_text("".join(rows[:-1]))
    assert list_findings(transcript_path) == [
        "game.dmt:22: turn 2: unfinished: no end line",
        "game.dmt: everything before it is verified",
    ]
    assert verify(transcript_path).is_unfinished
    assert verify(transcript_path).is_replayable
    transcript_path.write_text("".join(rows[1:]))
    assert not verify(transcript_path).is_replayable


def test_a_game_with_a_torn_tail_is_resumed_to_the_same_text(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    text = record_game(path, "crying-baby", "feed-when-crying")
    start = text.index("\n\nturn: 1\n") + 2
    for cut in range(1, 200, 19):
        path.write_text(text[: start + cut])
        game = resume_game(ResumeRequest(path))
        while game.play_agent_turn():
            pass
        game.finish()
        assert path.read_text() == text


def test_a_game_torn_before_its_first_turn_is_rejected(transcript_path: Path) -> None:
    transcript_path.write_text(transcript_path.read_text()[:20])
    with pytest.raises(BadTranscript, match="cut off before its first turn"):
        read_transcript(transcript_path)


def test_a_game_that_is_over_cannot_be_resumed(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    record_game(path, "hexworld", "optimal")
    with pytest.raises(BadParameter, match="the game is over"):
        resume_game(ResumeRequest(path))


def test_a_quit_game_can_be_resumed(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    game.choose(0)
    game.finish("quit")
    resumed_game = resume_game(ResumeRequest(path))
    resumed_game.choose(1)
    resumed_game.finish("quit")
    unbroken = start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "other.dmt"))
    unbroken.choose(0)
    unbroken.choose(1)
    unbroken.finish("quit")
    assert path.read_bytes() == (tmp_path / "other.dmt").read_bytes()


def test_strict_and_reveal_are_recorded_and_apply_after_a_resume(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(
        GameRequest("crying-baby", seed=7, record_path=path, strict=True, reveal=True)
    )
    game.choose(0)
    game.finish("quit")
    assert path.read_text().startswith(
        'dmplay: 1\nproblem: "crying-baby"\nseats: {"agent": "human"}\nseed: 7\n'
        "strict: true\nreveal: true\n\n"
    )
    assert verify(path).is_ok
    resumed_game = resume_game(ResumeRequest(path))
    assert resumed_game.reveal
    with pytest.raises(BadParameter, match="undo: this game is strict"):
        resumed_game.undo()
    resumed_game.finish("quit")
    replace_in_file(path, "end: ", "undo: 1\n\nend: ")
    assert list_findings(path) == ["game.dmt:21: form: got undo, but the game is strict"]


def test_a_game_is_written_by_one_process_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    game.choose(0)
    before = path.read_bytes()
    with pytest.raises(
        BadParameter, match=r"game\.dmt: this game is running, here or in another dmplay process"
    ):
        resume_game(ResumeRequest(path))
    with pytest.raises(
        BadParameter, match="this game is running, here or in another dmplay process"
    ):
        start_new_game(GameRequest("hexworld", seed=7, record_path=path, force=True))
    assert path.read_bytes() == before
    game.finish("quit")
    resume_game(ResumeRequest(path)).finish("quit")
    assert verify(path).is_ok


def test_a_changed_reroll_number_is_reported_on_its_line(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("2048", seed=7, record_path=path))
    game.choose(0)
    game.reroll()
    game.finish("quit")
    assert verify(path).is_ok
    replace_in_file(path, "reroll: 1", "reroll: 4")
    line = path.read_text().splitlines().index("reroll: 4") + 1
    assert list_findings(path)[0] == f"game.dmt:{line}: turn 1: reroll: expected 4, got 1"


def play_and_undo(path: Path) -> Game:
    """Play three turns of a game and undo two of them."""
    game = start_new_game(GameRequest("crying-baby", seed=7, record_path=path))
    for action in (0, 1, 2):
        game.choose(action)
    game.undo(2)
    return game


def test_undo_and_reroll_are_recorded_and_verified(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = play_and_undo(path)
    game.choose(2)
    game.reroll()
    game.reroll()
    game.finish()
    text = path.read_text()
    assert "undo: 2\n" in text
    assert "reroll: 2\n" in text
    assert verify(path).is_ok
    assert len(resume_game(ResumeRequest(path)).session.turns) == 2


def test_an_existing_file_is_not_overwritten_without_force(transcript_path: Path) -> None:
    before = transcript_path.read_bytes()
    with pytest.raises(BadParameter, match="exists; give another name or use --force"):
        start_new_game(GameRequest("hexworld", seed=7, record_path=transcript_path))
    assert transcript_path.read_bytes() == before
    start_new_game(GameRequest("hexworld", seed=7, record_path=transcript_path, force=True))
    assert transcript_path.read_bytes() != before


def test_a_missing_folder_is_an_error_of_one_line(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=r"cannot write .*No such file or directory"):
        start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "no" / "game.dmt"))


def test_a_full_disk_stops_neither_the_game_nor_its_player(monkeypatch: pytest.MonkeyPatch) -> None:
    # allow this device as an output file
    monkeypatch.setattr(safe_files, "OUTPUT_DEVICES", ("/dev/full",))
    game = start_new_game(
        GameRequest("crying-baby", agent="random", seed=7, record_path=Path("/dev/full"))
    )
    while game.play_agent_turn():
        pass
    game.finish()
    assert game.recorder is not None
    assert game.recorder.write_error is not None
    assert os.strerror(28) in str(game.recorder.write_error)
    assert len(game.session.turns) == 20


def test_update_recomputes_the_actions_of_agents(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    expected = record_game(path, "prisoners-dilemma", "grim", other_agent="tit-for-tat", turns=4)
    path.write_text(expected.replace('"agent1": "cooperate"', '"agent1": "defect"', 1))
    assert not verify(path).is_ok
    diff = rewrite_file(path)
    assert '-actions: {"agent1": "defect", "agent2": "cooperate"}' in diff
    assert path.read_text() == expected


@pytest.mark.parametrize(
    ("players", "before", "after"),
    [
        (("hexworld", "optimal"), {"seed": 7}, {"seed": 8}),
        (("crying-baby", "random"), {"turns": 4}, {"turns": 2}),
    ],
)
def test_update_follows_a_changed_header_to_another_end(
    tmp_path: Path, players: tuple[str, str], before: dict[str, Any], after: dict[str, Any]
) -> None:
    path = tmp_path / "game.dmt"
    record_game(path, *players, **before)
    expected = record_game(tmp_path / "other.dmt", *players, **after)
    (key,) = before
    replace_in_file(path, f"\n{key}: {before[key]}", f"\n{key}: {after[key]}")
    rewrite_file(path)
    assert verify(path).is_ok
    assert path.read_text() == expected


def test_update_preserves_undo_and_reroll(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = play_and_undo(path)
    game.reroll()
    game.finish("quit")
    expected = path.read_text()
    replace_in_file(path, "undo: 2", "undo:  2")
    assert not verify(path).is_ok
    rewrite_file(path)
    assert path.read_text() == expected


def test_update_leaves_an_unfinished_game_unfinished(transcript_path: Path) -> None:
    rows = transcript_path.read_text().splitlines(keepends=True)
    transcript_path.write_text("".join(rows[:-1]))
    rewrite_file(transcript_path)
    assert verify(transcript_path).is_unfinished


HEADER = 'dmplay: 1\nproblem: "hexworld"\nseats: {"agent": "human"}\nseed: 7\n'
TURN_0 = '\nturn: 0\ndraws: [0.635716]\nstate: "(7,2)"\n\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "t:1: empty, expected 'dmplay: 1'"),
        ("hello\n\n", "t:1:1: expected 'key: value', '| frame', '# note' or an empty line"),
        ("dmplay: 2\n" + HEADER[10:] + TURN_0, "t:1: dmplay: expected format 1"),
        (HEADER.replace("seed: 7", "seed: -7") + TURN_0, "t:4: seed: expected a whole number"),
        (HEADER.replace("seed: 7", "seed: 7.5") + TURN_0, "t:4: seed: expected a whole number"),
        (HEADER.replace("seed: 7\n", "") + TURN_0, "t:1: the header has no seed"),
        (HEADER.replace('"hexworld"', "7") + TURN_0, "t:2: problem: expected a name"),
        (HEADER.replace('"human"', "7") + TURN_0, "t:3: seats: expected names"),
        (HEADER.replace("seats", 'set: [1]\nseats') + TURN_0, "t:3: set: expected values"),
        (HEADER + "strict: 1\n" + TURN_0, "t:5: strict: expected true or false"),
        (HEADER.replace('"hexworld"', r'"\ud800"') + TURN_0, "t:2: half of a surrogate pair"),
        (HEADER + "turns: 0.5\n" + TURN_0, "t:5: turns: expected a whole number"),
        (HEADER + "seed: 8\n" + TURN_0, "t:5:1: seed occurs twice in this block"),
        (HEADER + "sead: 8\n" + TURN_0, "t:5:1: unknown key 'sead'; did you mean seed"),
        (HEADER + TURN_0 + "trun: 1\n\n", "t:10:1: unknown block 'trun'; did you mean turn"),
        ("seed: 7\n" + HEADER.replace("seed: 7\n", "") + TURN_0, "t:1:1: unknown block 'seed'"),
        (HEADER + "\nundo: 1\n\n", "t:6: got undo, expected the start, 'turn: 0'"),
        (HEADER + TURN_0 + HEADER + "\n", "t:10: got dmplay, expected a turn, an undo"),
        (HEADER + TURN_0.replace("draws", "state: 1\ndraws"), "t:9:1: state occurs twice"),
        (HEADER + '\nstate: "(7,2)"\nturn: 0\n\n', "t:6:1: unknown block 'state'"),
        (HEADER + '\nturn: 0\nstate: "(7,2)"\ndraws: [0.1]\n\n', "t:6: keys out of order"),
        (HEADER + "\n| frame\n\n" + TURN_0, "t:7: a frame without a turn"),
        (HEADER + TURN_0[:-1] + "| x\nbelief: 1\n\n", "t:10:1: got belief after the frame"),
        (HEADER + "\nturn: 0\ndraws: [NaN]\n\n", "t:7:8: NaN is not a number"),
        (HEADER + "\nturn: 0\ndraws: \n\n", "t:7:8: expecting value"),
        (HEADER + "\nturn: 0\ndraws: [0.1] 2\n\n", "t:7:14: extra data"),
        (HEADER + "\nturn: 0\ndraws: [1e999]\n\n", "t:7:8: 1e999 is too large"),
        (HEADER + "\nturn: 0\ndraws: [0.1\n\n", "t:7:12: expecting ',' delimiter"),
        (HEADER + "\nturn: 0\ndraws: " + "[" * 100_000 + "\n\n", "t:7:8: nested too deeply"),
        (HEADER + f"\nturn: 0\ndraws: [{'9' * 400}]\n\n", "t:7:8: 999"),
        (HEADER + f"\nturn: 0\nstate: {'[' * 33}{']' * 33}\n\n", "t:7:8: nested too deeply"),
        (HEADER + '\nturn: 0\nstate: {"a": 1, "a": 2}\n\n', "t:7:8: the key 'a' occurs twice"),
        (HEADER + "# " + "x" * 1_000_001 + TURN_0, "t:5:1000001: line longer than 1,000,000"),
        (HEADER.replace("\n", "\r") + TURN_0, "t:1: carriage return"),
    ],
)  # fmt: skip
def test_a_format_error_is_reported_with_line_and_column(text: str, message: str) -> None:
    with pytest.raises(BadTranscript) as exc_info:
        parse_transcript(text.encode(), "t")
    assert str(exc_info.value).startswith(message)


@pytest.mark.parametrize("name", ["12:3: x.dmt", "a\nok b.dmt", ":.dmt"])
def test_errors_are_reported_correctly_for_unusual_file_names(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(HEADER + "seed: 8\n" + TURN_0)
    [finding] = verify(path).findings
    assert finding[:5] == (
        "facts",
        str(path),
        5,
        "form",
        "column 1: seed occurs twice in this block",
    )
    with pytest.raises(BadTranscript) as exc_info:
        read_transcript(path)
    error = pickle.loads(pickle.dumps(exc_info.value))
    assert (error.path, error.line, error.column) == (str(path), 5, 1)
    assert str(error) == f"{path}:5:1: seed occurs twice in this block"


def test_a_map_that_cannot_be_drawn_is_a_finding(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    record_game(
        path,
        "hexworld",
        "random",
        record_frames=True,
        turns=1,
        settings=["hexes=[[0,0],[1,0]]", "rewards=[]"],
    )
    far_hexes = [[-1000, 0], *([1000, r] for r in range(300))]
    replace_in_file(path, "[[0, 0], [1, 0]]", json.dumps(far_hexes))
    assert any(
        "frame: expected" in finding and "got board needs 4300x300;" in finding
        for finding in list_findings(path)
    )
    replace_in_file(path, json.dumps(far_hexes), "[[0, 0], [50000000, 0]]")
    assert any(
        "hexes: got [50000000, 0], expected numbers within 1000" in finding
        for finding in list_findings(path)
    )


def test_a_drawing_that_exceeds_its_limit_is_a_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "game.dmt"
    settings = ["hexes=[[0,0],[1,0]]", "rewards=[]"]
    record_game(path, "hexworld", "random", record_frames=True, turns=1, settings=settings)
    # a map that is not cached
    replace_in_file(path, "[[0, 0], [1, 0]]", "[[0, 0], [1, 0], [2, 0], [0, 1]]")
    monkeypatch.setattr(canvas, "MAX_CELLS", 50)  # below the number of cells of this map
    message = "drawing: more than the limit of 5e+01 operations; try a smaller map"
    assert list_findings(path) == [f"game.dmt:1: frame: {message}"]


def test_bytes_that_are_not_utf_8_are_reported_with_line_and_column() -> None:
    with pytest.raises(BadTranscript, match=r"t:2:5: not UTF-8"):
        parse_transcript(b"dmplay: 1\nabcd\xff\n", "t")


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ('turn: 1\nactions: {"agent": "e"}\ndraws: [1.0]\n', "12: draws: expected numbers from 0"),
        (
            'turn: 1\nactions: {"agent": "e"}\ndraws: [0.1, 0.2]\n',
            "12: draws: got 2 numbers, expected 1",
        ),
        ('turn: 1\nactions: {"agent": "e"}\ndraws: [true]\n', "12: draws: expected numbers"),
        ('turn: 1\nactions: {"agent": "east by east"}\ndraws: [0.1]\n', "11: actions: agent: unkn"),
        ('turn: 1\nactions: {"agent": 1}\ndraws: [0.1]\n', "11: actions: agent: got 1"),
        ('turn: 1\nactions: {"prey": "e"}\ndraws: [0.1]\n', "11: actions: expected one for each"),
        ("turn: 1\ndraws: [0.1]\n", "10: actions: expected one for each of agent"),
        ('turn: 3\nactions: {"agent": "e"}\ndraws: [0.1]\n', "10: got turn 3, expected 1"),
        ("undo: 1\n", "10: undo: no turn was played"),
        ("undo: 0\n", "10: undo: expected a whole number of 1 or more"),
        ("reroll: 1\n", "10: undo: no turn was played"),
    ],
)
def test_inputs_that_cannot_be_played_are_reported_with_their_line(
    tmp_path: Path, block: str, message: str
) -> None:
    path = tmp_path / "t.dmt"
    path.write_text(HEADER + TURN_0 + block + "\n")
    report = str(verify(path)).removeprefix(f"{path}:")
    line, _, details = report.partition(": inputs: ")
    assert f"{line}: {details}".startswith(message)


def test_a_real_action_must_be_a_number_not_text(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    record_game(path, "simple-regulator", "script:1.5,-0.25", turns=2)
    assert verify(path).is_ok
    replace_in_file(path, '"agent": 1.5', '"agent": "1.5"')
    assert list_findings(path) == [
        'game.dmt:12: inputs: actions: agent: got "1.5", expected a number'
    ]


def test_seats_of_another_problem_are_reported(tmp_path: Path) -> None:
    path = tmp_path / "t.dmt"
    path.write_text(HEADER.replace("hexworld", "prisoners-dilemma") + "\nturn: 0\n\n")
    assert "seats: got agent, expected agent1, agent2" in str(verify(path))


def test_a_game_with_seats_of_another_problem_is_not_resumed(tmp_path: Path) -> None:
    path = tmp_path / "t.dmt"
    path.write_text(HEADER.replace("hexworld", "prisoners-dilemma") + "\nturn: 0\n\n")
    with pytest.raises(BadTranscript, match="seats: got agent, expected agent1, agent2"):
        resume_game(ResumeRequest(path))


def test_a_problem_that_a_file_names_is_not_imported_without_trust(tmp_path: Path) -> None:
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')")
    path = tmp_path / "t.dmt"
    path.write_text(HEADER.replace("hexworld", f"{tmp_path}/evil.py:Problem") + TURN_0)
    report = str(verify(path))
    assert ":2: " in report
    assert "if you trust its code, add --trust" in report


def test_missing_and_extra_facts_are_reported(transcript_path: Path) -> None:
    replace_in_file(transcript_path, 'rewards: {"agent": 0}\n', 'belief: {"agent": [1]}\n')
    assert list_findings(transcript_path)[:2] == [
        'game.dmt:16: turn 2: rewards: expected nothing, got {"agent": 0}',
        'game.dmt:20: turn 2: belief: expected {"agent": [1]}, got nothing',
    ]


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ('"quit"', '"terminal"', "22: end: reason: expected terminal, got null"),
        ('"quit"', "null", "22: end: no reason, because the game is not over"),
        # a game without a turn limit
        ('"quit"', '"turn limit"', "22: end: reason: expected turn limit, got null"),
        # The boolean false does not equal the number 0.
        (
            'rewards: {"agent": 0}',
            'rewards: {"agent": false}',
            "20: turn 2, agent: reward: expected false, got 0",
        ),
    ],
)
def test_a_wrong_value_is_reported(old: str, new: str, finding: str, transcript_path: Path) -> None:
    replace_in_file(transcript_path, old, new)
    assert list_findings(transcript_path)[0] == f"game.dmt:{finding}"


def test_five_differences_are_printed_and_the_others_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    text = record_game(path, "crying-baby", "random", turns=8)
    path.write_text(text.replace('state: "', 'state: "not '))
    assert len(list_findings(path)) == 6
    assert list_findings(path)[-1] == "game.dmt: 4 more differences"


def test_an_end_line_with_unknown_keys_is_reported(transcript_path: Path) -> None:
    replace_in_file(transcript_path, '"reason": "quit", ', '"reason": "quit", "more": 1, ')
    assert "end: keys: expected" in list_findings(transcript_path)[0]


@given(st.floats(-1e300, 1e300))
def test_a_real_number_is_rounded_to_about_ten_digits(value: float) -> None:
    rounded = round_number(value)
    assert abs(rounded - value) <= 1e-9 * abs(value)
    assert round_number(rounded) == rounded


@settings(max_examples=200, derandomize=True, deadline=None)
@given(st.binary(max_size=200))
def test_the_reader_raises_no_other_error_for_arbitrary_bytes(raw: bytes) -> None:
    with suppress(BadTranscript):
        parse_transcript(HEADER.encode() + TURN_0.encode() + raw, "t")


def test_an_episode_number_selects_another_game_of_the_same_seed(tmp_path: Path) -> None:
    problem = dmplay.load_problem("crying-baby")
    text = record_game(tmp_path / "g.dmt", "crying-baby", "random", episode=3)
    assert "episode: 3\n" in text
    batch = dmplay.rollout(
        problem, [dmplay.load_agent(problem, 0, "random")], episodes=1, seed=7, first_episode=3
    )
    game = dmplay.Session(problem, SeededUniforms(7, 3), [dmplay.load_agent(problem, 0, "random")])
    while not game.over:
        game.advance()
    assert batch.returns[0].tolist() == game.returns().tolist()
    assert json.loads(text.splitlines()[-1][5:])["total"]["agent"] == batch.total_rewards[0, 0]


@pytest.mark.slow
def test_an_endless_game_stops_at_ten_thousand_turns_and_verifies(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    endless_settings = ("rewards=[]", "hexes=[[0,0]]", "bump_cost=0")
    text = record_game(path, "hexworld", "random", settings=endless_settings)
    assert '"reason": "turn limit", "turns": 10000' in text
    assert verify(path).is_ok


@pytest.mark.parametrize("seed", range(6))
def test_a_reroll_against_a_random_agent_verifies(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(
        GameRequest("predator-prey", other_agent="random", seed=seed, record_path=path)
    )
    for _ in range(3):
        game.choose(0)
    game.undo(2)
    game.reroll()
    with pytest.raises(BadParameter, match="no turn was undone"):
        game.redo()
    game.choose(1)
    game.finish()
    assert verify(path).is_ok


@pytest.mark.parametrize("agent", ["./evil.py:X", "os.path:join"])
def test_an_agent_that_a_file_names_is_not_imported_without_trust(
    tmp_path: Path, agent: str
) -> None:
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')")
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    game.choose(0)
    game.finish()
    replace_in_file(path, '"agent": "human"', f'"agent": "{agent.replace("./", f"{tmp_path}/")}"')
    with pytest.raises(BadParameter, match="is not built in; if you trust its code, add --trust"):
        resume_game(ResumeRequest(path))
    with pytest.raises(BadParameter, match="is not built in; if you trust its code, add --trust"):
        branch_game(BranchRequest(path, turn=1, record_path=tmp_path / "other.dmt"))


def test_a_checked_agent_that_modifies_its_observations_is_a_finding(tmp_path: Path) -> None:
    record_game(tmp_path / "g.dmt", "cart-pole", "random", turns=3)
    problem = dmplay.load_problem("cart-pole")
    report = verify_transcript(
        read_transcript(tmp_path / "g.dmt"),
        problem,
        [ObservationMutatingScript(problem, 0, (0, 0, 0))],
    )
    assert "turn 2, agent: ObservationMutatingScript.update_memory modifies an array" in str(report)


def test_a_long_list_of_short_lists_is_not_nested_too_deeply() -> None:
    hexes = [[q, 0] for q in range(40)]
    assert parse_line(f"set: {json.dumps({'hexes': hexes})}", "t", 1) == ("set", {"hexes": hexes})


@settings(max_examples=30, derandomize=True, deadline=None)
@given(
    st.recursive(
        st.text() | st.integers() | st.floats() | st.booleans() | st.none(),
        lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
        max_leaves=8,
    )
)
def test_a_fact_is_encoded_as_the_json_module_does(value: object) -> None:
    assert encode_json(value) == json.dumps(value, ensure_ascii=False)


def test_a_game_with_more_lines_than_the_cache_is_read_and_written_equally(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = record_game(tmp_path / "g.dmt", "crying-baby", "random", turns=9)
    for module in (reader, transcript_format):
        monkeypatch.setattr(module, "MAX_CACHED_LINES", 2)
    assert record_game(tmp_path / "h.dmt", "crying-baby", "random", turns=9) == text
    assert verify(tmp_path / "g.dmt").is_ok


def test_line_numbers_are_correct_in_a_long_file(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    text = record_game(path, "hexworld", "random", turns=3)
    notes = f"# {'x' * 600_000}\n" * 4
    path.write_text(text.replace("\nturn: 2\n", f"\n{notes}turn: 2\n"))
    assert verify(path).is_ok
    replace_in_file(path, "turn: 3\n", "trun: 3\n")
    [finding] = verify(path).findings
    line = 1 + path.read_text().split("\n").index("trun: 3")
    assert (finding.line, finding.what[:27]) == (line, "column 1: unknown block 'tr")


def test_uniforms_that_fit_no_reroll_are_reported_as_uniforms(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("crying-baby", seed=7, record_path=path))
    game.choose(0)
    game.reroll()
    game.finish()
    assert game.recorder is not None
    (uniform,) = game.session.turns[-1].uniforms.tolist()
    replace_in_file(path, str(uniform), "0.5")
    assert "turn 1: draws: expected [0.5]" in str(verify(path))


def test_a_turn_uses_less_than_700_bytes_of_memory(tmp_path: Path) -> None:
    path, turns = tmp_path / "game.dmt", 300
    record_game(path, "hexworld", "random", turns=turns, settings=["rewards=[]"])
    tracemalloc.start()
    try:
        transcript = read_transcript(path)
        used_bytes, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (used_bytes - len(transcript.content)) / turns < 700
