"""The golden format: written a turn at a time, read strictly, replayed to the last number."""

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
from dmplay import disk
from dmplay.dice import SeededUniforms
from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.checking import rewrite_file, verify_file
from dmplay.game.game import Game
from dmplay.game.request import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.start import branch_game, resume_game, start_new_game
from dmplay.transcript import format as transcript_format
from dmplay.transcript import reading
from dmplay.transcript.format import encode_json, round_number
from dmplay.transcript.keyed import parse_line
from dmplay.transcript.reading import parse_transcript, read_transcript
from dmplay.transcript.verify import verify
from dmplay.views import canvas
from tests.support.games import altered, recorded
from tests.support.seats import Rescaling

STRAIGHT = """\
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
def file(tmp_path: Path) -> Path:
    path = tmp_path / "game.dmt"
    recorded(path, "hexworld:straight-line", "script:w,e", seed=2)
    return path


def findings(path: Path) -> list[str]:
    return str(verify_file(path)).replace(str(path), "game.dmt").splitlines()


def test_a_short_game_reads_like_this(file: Path) -> None:
    end = file.read_text().splitlines()[-1]
    digest = json.loads(end.removeprefix("end: "))["sha256"]
    assert file.read_text() == STRAIGHT % digest
    assert verify_file(file).is_ok


def test_a_wrong_fact_is_named_with_line_turn_seat_expected_and_got(file: Path) -> None:
    altered(file, 'rewards: {"agent": -1}', 'rewards: {"agent": -2}')
    assert findings(file)[0] == "game.dmt:14: turn 1, agent: reward: expected -2, got -1"


def test_a_wrong_state_is_named(file: Path) -> None:
    altered(file, '"(1,0)"', '"(2,0)"')
    assert findings(file) == ["game.dmt:19: turn 2: state: expected (2,0), got (1,0)"]


@pytest.mark.parametrize(
    "name", ["Optimal", "optimal ", "\N{CYRILLIC SMALL LETTER O}ptimal", "optimall", "", "human:1"]
)
def test_an_agent_that_there_is_not_is_a_fault(file: Path, name: str) -> None:
    altered(file, "script", name)
    assert findings(file)[0].startswith(
        ("game.dmt:3: seats: unknown agent ", "game.dmt:3: seats: agent: got 'human:1', expected ")
    )


@pytest.mark.parametrize(
    ("problem", "agent", "unasked"),
    [
        ("hexworld", "optimal", []),
        ("hexworld", "script:e", ["script"]),
        ("2048", "expectimax:milliseconds=5", ["expectimax:milliseconds=5"]),
    ],
)
def test_who_was_not_asked_again_is_told(
    problem: str, agent: str, unasked: list[str], tmp_path: Path
) -> None:
    recorded(tmp_path / "game.dmt", problem, agent, turns=1)
    report = verify_file(tmp_path / "game.dmt")
    told = f"1 turn; not re-asked: {unasked[0]}" if unasked else "1 turn"
    assert (report.is_ok, report.unchecked_players, report.summary) == (True, unasked, told)


def test_an_agent_of_ones_own_is_asked_again_only_where_it_is_trusted(tmp_path: Path) -> None:
    path, bot = tmp_path / "game.dmt", f"{tmp_path}/bots.py:Bot"
    (tmp_path / "bots.py").write_text("from dmplay.policies.general import Random as Bot\n")
    recorded(path, "hexworld", bot, turns=1)
    assert (
        verify_file(path).unchecked_players,
        verify_file(path, trusted=True).unchecked_players,
    ) == (["bots.py:Bot"], [])


def test_a_draw_that_is_not_the_seeds_keeps_the_rules(file: Path) -> None:
    altered(file, "0.453917248", "0.453917247")
    assert findings(file) == [
        "game.dmt:18: turn 2: draws: expected [0.453917247], got [0.453917248]",
        "game.dmt: the rules hold, but the inputs are not those of the seed and the agents",
    ]


def test_where_every_draw_differs_the_seed_is_to_blame(file: Path) -> None:
    altered(file, "seed: 2", "seed: 12")
    assert findings(file)[0].startswith("game.dmt:4: every turn: seed: expected the seed of these")


def test_an_agent_that_would_do_otherwise_is_named(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    recorded(path, "prisoners-dilemma", "grim", other_agent="script:cooperate,defect", turns=2)
    altered(
        path,
        '{"agent1": "cooperate", "agent2": "defect"}',
        '{"agent1": "defect", "agent2": "defect"}',
    )
    assert findings(path)[0] == (
        "game.dmt:14: turn 2, agent1: action: expected defect, got cooperate"
    )


def test_a_changed_space_is_found_by_the_checksum(file: Path) -> None:
    altered(file, 'state: "(1,0)"', 'state:  "(1,0)"')
    assert findings(file)[0].startswith('game.dmt:19: line: text: expected state:  "(1,0)"')


def test_a_changed_checksum_is_found_on_its_own_line(file: Path) -> None:
    altered(file, '"sha256": "', '"sha256": "x')
    assert findings(file)[0].startswith("game.dmt:22: line: text: expected end: ")


def test_notes_may_be_added_anywhere(file: Path) -> None:
    rows = file.read_text().splitlines()
    noted = "\n".join(["# first", *rows[:12], "# within", *rows[12:], "# last", ""])
    file.write_text(noted)
    assert verify_file(file).is_ok
    assert rewrite_file(file) == ""
    assert file.read_text() == noted


@pytest.mark.parametrize("row", ["#unspaced", "#", "# a note"])
def test_a_note_stands_after_a_space(file: Path, row: str) -> None:
    file.write_text(f"{row}\n{file.read_text()}")
    expected = "expected 'key: value', '| frame', '# note' or nothing"
    told = [f"game.dmt:1: form: column 1: {expected}"] if row == "#unspaced" else []
    assert findings(file) == told


def test_a_frame_is_compared_after_the_facts(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    recorded(path, "hexworld", "optimal", record_frames=True, turns=1)
    assert verify_file(path).is_ok
    text = path.read_text()
    path.write_text(text.replace("+10", "+11", 1))
    assert " turn 0: frame: expected │     │     │ -10" in findings(path)[0]


def test_any_changed_digit_fails_on_its_line(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    text = recorded(path, "crying-baby", "feed-when-crying", seed=5, turns=1)
    for at in [at for at, glyph in enumerate(text) if glyph.isdigit()]:
        path.write_text(text[:at] + "9012345678"[int(text[at])] + text[at + 1 :])
        found = verify_file(path).findings
        line = text[:at].count("\n") + 1
        assert found, f"line {line}: {text.splitlines()[line - 1]}"
        assert found[0].line == line


def test_an_unfinished_file_is_never_golden(file: Path) -> None:
    rows = file.read_text().splitlines(keepends=True)
    file.write_text("".join(rows[:-1]))
    assert findings(file) == ["game.dmt:22: turn 2: unfinished: no end line"]
    assert verify_file(file).is_unfinished
    assert verify_file(file).is_replayable
    file.write_text("".join(rows[1:]))
    assert not verify_file(file).is_replayable


def test_a_torn_tail_is_cut_and_the_game_goes_on_to_the_same_bytes(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    whole = recorded(path, "crying-baby", "feed-when-crying")
    at = whole.index("\n\nturn: 1\n") + 2
    for cut in range(1, 200, 19):
        path.write_text(whole[: at + cut])
        game = resume_game(ResumeRequest(path))
        while game.play_agent_turn():
            pass
        game.finish()
        assert path.read_text() == whole


def test_a_game_torn_before_its_first_turn_says_so(file: Path) -> None:
    file.write_text(file.read_text()[:20])
    with pytest.raises(BadTranscript, match="torn before its first turn"):
        read_transcript(file)


def test_a_game_that_is_over_cannot_be_resumed(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    recorded(path, "hexworld", "optimal")
    with pytest.raises(BadParameter, match="the game is over"):
        resume_game(ResumeRequest(path))


def test_a_quit_game_is_played_on(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    game.choose(0)
    game.finish("quit")
    again = resume_game(ResumeRequest(path))
    again.choose(1)
    again.finish("quit")
    unbroken = start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "other.dmt"))
    unbroken.choose(0)
    unbroken.choose(1)
    unbroken.finish("quit")
    assert path.read_bytes() == (tmp_path / "other.dmt").read_bytes()


def test_strictness_and_what_was_revealed_are_kept_and_hold_after_a_resumption(
    tmp_path: Path,
) -> None:
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
    assert verify_file(path).is_ok
    again = resume_game(ResumeRequest(path))
    assert again.reveal
    with pytest.raises(BadParameter, match="undo: this game is strict"):
        again.undo()
    again.finish("quit")
    altered(path, "end: ", "undo: 1\n\nend: ")
    assert findings(path) == ["game.dmt:21: form: got undo, but the game is strict"]


def test_a_game_is_written_by_one_program_at_a_time(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    game.choose(0)
    before = path.read_bytes()
    with pytest.raises(BadParameter, match=r"game\.dmt: somebody plays this game now"):
        resume_game(ResumeRequest(path))
    with pytest.raises(BadParameter, match="somebody plays this game now"):
        start_new_game(GameRequest("hexworld", seed=7, record_path=path, force=True))
    assert path.read_bytes() == before
    game.finish("quit")
    resume_game(ResumeRequest(path)).finish("quit")
    assert verify_file(path).is_ok


def test_another_number_of_a_reroll_is_found_on_its_line(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("2048", seed=7, record_path=path))
    game.choose(0)
    game.reroll()
    game.finish("quit")
    assert verify_file(path).is_ok
    altered(path, "reroll: 1", "reroll: 4")
    line = path.read_text().splitlines().index("reroll: 4") + 1
    assert findings(path)[0] == f"game.dmt:{line}: turn 1: reroll: expected 4, got 1"


def taken_back(path: Path) -> Game:
    """A game of three turns of which two were taken back."""
    game = start_new_game(GameRequest("crying-baby", seed=7, record_path=path))
    for action in (0, 1, 2):
        game.choose(action)
    game.undo(2)
    return game


def test_undo_and_reroll_are_kept_and_verified(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = taken_back(path)
    game.choose(2)
    game.reroll()
    game.reroll()
    game.finish()
    text = path.read_text()
    assert "undo: 2\n" in text
    assert "reroll: 2\n" in text
    assert verify_file(path).is_ok
    assert len(resume_game(ResumeRequest(path)).session.turns) == 2


def test_an_existing_file_is_kept_without_force(file: Path) -> None:
    before = file.read_bytes()
    with pytest.raises(BadParameter, match="exists; give another name, or --force"):
        start_new_game(GameRequest("hexworld", seed=7, record_path=file))
    assert file.read_bytes() == before
    start_new_game(GameRequest("hexworld", seed=7, record_path=file, force=True))
    assert file.read_bytes() != before


def test_a_folder_that_is_not_there_is_one_clear_line(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=r"cannot write .*No such file or directory"):
        start_new_game(GameRequest("hexworld", seed=7, record_path=tmp_path / "no" / "game.dmt"))


def test_a_full_disk_stops_neither_the_game_nor_its_player(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(
        disk, "OUTPUT_DEVICES", ("/dev/full",)
    )  # a device, which nobody else may name
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


def test_update_rewrites_facts_and_asks_agents_again(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    right = recorded(path, "prisoners-dilemma", "grim", other_agent="tit-for-tat", turns=4)
    path.write_text(right.replace('"agent1": "cooperate"', '"agent1": "defect"', 1))
    assert not verify_file(path).is_ok
    diff = rewrite_file(path)
    assert '-actions: {"agent1": "defect", "agent2": "cooperate"}' in diff
    assert path.read_text() == right


@pytest.mark.parametrize(
    ("played", "before", "after"),
    [
        (("hexworld", "optimal"), {"seed": 7}, {"seed": 8}),
        (("crying-baby", "random"), {"turns": 4}, {"turns": 2}),
    ],
)
def test_update_follows_a_changed_header_to_another_end(
    tmp_path: Path, played: tuple[str, str], before: dict[str, Any], after: dict[str, Any]
) -> None:
    path = tmp_path / "game.dmt"
    recorded(path, *played, **before)
    other = recorded(tmp_path / "other.dmt", *played, **after)
    (key,) = before
    altered(path, f"\n{key}: {before[key]}", f"\n{key}: {after[key]}")
    rewrite_file(path)
    assert verify_file(path).is_ok
    assert path.read_text() == other


def test_update_keeps_what_was_taken_back(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = taken_back(path)
    game.reroll()
    game.finish("quit")
    right = path.read_text()
    altered(path, "undo: 2", "undo:  2")
    assert not verify_file(path).is_ok
    rewrite_file(path)
    assert path.read_text() == right


def test_update_leaves_an_unfinished_game_unfinished(file: Path) -> None:
    rows = file.read_text().splitlines(keepends=True)
    file.write_text("".join(rows[:-1]))
    rewrite_file(file)
    assert verify_file(file).is_unfinished


HEADER = 'dmplay: 1\nproblem: "hexworld"\nseats: {"agent": "human"}\nseed: 7\n'
OPENING = '\nturn: 0\ndraws: [0.635716]\nstate: "(7,2)"\n\n'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "t:1: empty, expected 'dmplay: 1'"),
        ("hello\n\n", "t:1:1: expected 'key: value', '| frame', '# note' or nothing"),
        ("dmplay: 2\n" + HEADER[10:] + OPENING, "t:1: dmplay: expected format 1"),
        (HEADER.replace("seed: 7", "seed: -7") + OPENING, "t:4: seed: expected a whole number"),
        (HEADER.replace("seed: 7", "seed: 7.5") + OPENING, "t:4: seed: expected a whole number"),
        (HEADER.replace("seed: 7\n", "") + OPENING, "t:1: the header has no seed"),
        (HEADER.replace('"hexworld"', "7") + OPENING, "t:2: problem: expected a name"),
        (HEADER.replace('"human"', "7") + OPENING, "t:3: seats: expected names"),
        (HEADER.replace("seats", 'set: [1]\nseats') + OPENING, "t:3: set: expected values"),
        (HEADER + "strict: 1\n" + OPENING, "t:5: strict: expected true or false"),
        (HEADER.replace('"hexworld"', r'"\ud800"') + OPENING, "t:2: half a character"),
        (HEADER + "turns: 0.5\n" + OPENING, "t:5: turns: expected a whole number"),
        (HEADER + "seed: 8\n" + OPENING, "t:5:1: seed stands twice in this block"),
        (HEADER + "sead: 8\n" + OPENING, "t:5:1: unknown key 'sead'; did you mean seed"),
        (HEADER + OPENING + "trun: 1\n\n", "t:10:1: unknown block 'trun'; did you mean turn"),
        ("seed: 7\n" + HEADER.replace("seed: 7\n", "") + OPENING, "t:1:1: unknown block 'seed'"),
        (HEADER + "\nundo: 1\n\n", "t:6: got undo, expected the opening, 'turn: 0'"),
        (HEADER + OPENING + HEADER + "\n", "t:10: got dmplay, expected a turn, an undo"),
        (HEADER + OPENING.replace("draws", "state: 1\ndraws"), "t:9:1: state stands twice"),
        (HEADER + '\nstate: "(7,2)"\nturn: 0\n\n', "t:6:1: unknown block 'state'"),
        (HEADER + '\nturn: 0\nstate: "(7,2)"\ndraws: [0.1]\n\n', "t:6: keys out of order"),
        (HEADER + "\n| frame\n\n" + OPENING, "t:7: a frame without a turn"),
        (HEADER + OPENING[:-1] + "| x\nbelief: 1\n\n", "t:10:1: belief after the frame"),
        (HEADER + "\nturn: 0\ndraws: [NaN]\n\n", "t:7:8: NaN is not a number"),
        (HEADER + "\nturn: 0\ndraws: \n\n", "t:7:8: expecting value"),
        (HEADER + "\nturn: 0\ndraws: [0.1] 2\n\n", "t:7:14: extra data"),
        (HEADER + "\nturn: 0\ndraws: [1e999]\n\n", "t:7:8: 1e999 is too large"),
        (HEADER + "\nturn: 0\ndraws: [0.1\n\n", "t:7:12: expecting ',' delimiter"),
        (HEADER + "\nturn: 0\ndraws: " + "[" * 100_000 + "\n\n", "t:7:8: nested too deeply"),
        (HEADER + f"\nturn: 0\ndraws: [{'9' * 400}]\n\n", "t:7:8: 999"),
        (HEADER + f"\nturn: 0\nstate: {'[' * 33}{']' * 33}\n\n", "t:7:8: nested too deeply"),
        (HEADER + '\nturn: 0\nstate: {"a": 1, "a": 2}\n\n', "t:7:8: 'a' stands twice"),
        (HEADER + "# " + "x" * 1_000_001 + OPENING, "t:5:1000001: a line of over a million"),
        (HEADER.replace("\n", "\r\n") + OPENING, "t:1: a carriage return"),
    ],
)  # fmt: skip
def test_a_fault_of_form_is_told_with_line_and_column(text: str, message: str) -> None:
    with pytest.raises(BadTranscript) as caught:
        parse_transcript(text.encode(), "t")
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize("name", ["12:3: x.dmt", "a\nok b.dmt", ":.dmt"])
def test_a_fault_is_told_rightly_whatever_the_file_is_called(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_text(HEADER + "seed: 8\n" + OPENING)
    [found] = verify_file(path).findings
    assert found[:5] == ("facts", str(path), 5, "form", "column 1: seed stands twice in this block")
    with pytest.raises(BadTranscript) as caught:
        read_transcript(path)
    error = pickle.loads(pickle.dumps(caught.value))
    assert (error.path, error.line, error.column) == (str(path), 5, 1)
    assert str(error) == f"{path}:5:1: seed stands twice in this block"


def test_a_map_that_cannot_be_drawn_is_a_finding(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    recorded(
        path,
        "hexworld",
        "random",
        record_frames=True,
        turns=1,
        settings=["hexes=[[0,0],[1,0]]", "rewards=[]"],
    )
    far = [[-1000, 0], *([1000, r] for r in range(300))]
    altered(path, "[[0, 0], [1, 0]]", json.dumps(far))
    assert any("frame: expected" in one and "got need 4300x300;" in one for one in findings(path))
    altered(path, json.dumps(far), "[[0, 0], [50000000, 0]]")
    assert any(
        "hexes: got [50000000, 0], expected numbers within 1000" in one for one in findings(path)
    )


def test_a_drawing_that_takes_too_much_is_a_finding(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "game.dmt"
    settings = ["hexes=[[0,0],[1,0]]", "rewards=[]"]
    recorded(path, "hexworld", "random", record_frames=True, turns=1, settings=settings)
    altered(path, "[[0, 0], [1, 0]]", "[[0, 0], [1, 0], [2, 0], [0, 1]]")  # not drawn so far
    monkeypatch.setattr(canvas, "MAX_CELLS", 50)  # as if this map had no bounds
    told = "a drawing: more than 5e+01 operations; try a smaller map"
    assert findings(path) == [f"game.dmt:1: frame: {told}"]


def test_bytes_that_are_not_utf_8_are_told_with_line_and_column() -> None:
    with pytest.raises(BadTranscript, match=r"t:2:5: not UTF-8"):
        parse_transcript(b"dmplay: 1\nabcd\xff\n", "t")


@pytest.mark.parametrize(
    ("block", "message"),
    [
        ('turn: 1\nactions: {"agent": "e"}\ndraws: [1.0]\n', "12: draws: expected numbers from 0"),
        ('turn: 1\nactions: {"agent": "e"}\ndraws: [0.1, 0.2]\n', "12: draws: got 2, expected 1"),
        ('turn: 1\nactions: {"agent": "e"}\ndraws: [true]\n', "12: draws: expected numbers"),
        ('turn: 1\nactions: {"agent": "east by east"}\ndraws: [0.1]\n', "11: actions: agent: unkn"),
        ('turn: 1\nactions: {"agent": 1}\ndraws: [0.1]\n', "11: actions: agent: got 1"),
        ('turn: 1\nactions: {"prey": "e"}\ndraws: [0.1]\n', "11: actions: expected one for each"),
        ("turn: 1\ndraws: [0.1]\n", "10: actions: expected one for each of agent"),
        ('turn: 3\nactions: {"agent": "e"}\ndraws: [0.1]\n', "10: got turn 3, expected 1"),
        ("undo: 1\n", "10: undo 1: 0 turns were played"),
        ("undo: 0\n", "10: undo: expected a whole number, as 1"),
        ("reroll: 1\n", "10: undo 1: 0 turns were played"),
    ],
)
def test_inputs_that_cannot_be_played_are_told_by_line(
    tmp_path: Path, block: str, message: str
) -> None:
    path = tmp_path / "t.dmt"
    path.write_text(HEADER + OPENING + block + "\n")
    told = str(verify_file(path)).removeprefix(f"{path}:")
    line, _, rest = told.partition(": inputs: ")
    assert f"{line}: {rest}".startswith(message)


def test_a_real_action_is_a_number_and_no_text(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    recorded(path, "simple-regulator", "script:1.5,-0.25", turns=2)
    assert verify_file(path).is_ok
    altered(path, '"agent": 1.5', '"agent": "1.5"')
    assert findings(path) == ['game.dmt:12: inputs: actions: agent: got "1.5"']


def test_seats_of_another_problem_are_told(tmp_path: Path) -> None:
    path = tmp_path / "t.dmt"
    path.write_text(HEADER.replace("hexworld", "prisoners-dilemma") + "\nturn: 0\n\n")
    assert "seats: got agent, expected agent1, agent2" in str(verify_file(path))


def test_a_game_with_seats_of_another_problem_is_not_gone_on_with(tmp_path: Path) -> None:
    path = tmp_path / "t.dmt"
    path.write_text(HEADER.replace("hexworld", "prisoners-dilemma") + "\nturn: 0\n\n")
    with pytest.raises(BadTranscript, match="seats: got agent, expected agent1, agent2"):
        resume_game(ResumeRequest(path))


def test_what_a_file_names_is_not_imported_without_trust(tmp_path: Path) -> None:
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')")
    path = tmp_path / "t.dmt"
    path.write_text(HEADER.replace("hexworld", f"{tmp_path}/evil.py:Problem") + OPENING)
    told = str(verify_file(path))
    assert ":2: " in told
    assert "if it is yours, add --trust" in told


def test_missing_and_extra_facts_are_told(file: Path) -> None:
    altered(file, 'rewards: {"agent": 0}\n', 'belief: {"agent": [1]}\n')
    assert findings(file)[:2] == [
        'game.dmt:16: turn 2: rewards: expected nothing, got {"agent": 0}',
        'game.dmt:20: turn 2: belief: expected {"agent": [1]}, got nothing',
    ]


@pytest.mark.parametrize(
    ("old", "new", "finding"),
    [
        ('"quit"', '"terminal"', "22: end: reason: expected terminal, got null"),
        ('"quit"', "null", "22: end: no reason"),  # an end without one
        ('"quit"', '"turn limit"', "22: end: reason: expected turn limit, got null"),  # of none
        # True is not one, nor is false nought.
        (
            'rewards: {"agent": 0}',
            'rewards: {"agent": false}',
            "20: turn 2, agent: reward: expected false, got 0",
        ),
    ],
)
def test_a_wrong_value_is_told(old: str, new: str, finding: str, file: Path) -> None:
    altered(file, old, new)
    assert findings(file)[0] == f"game.dmt:{finding}"


def test_of_many_differences_five_are_shown_and_the_rest_are_counted(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    text = recorded(path, "crying-baby", "random", turns=8)
    path.write_text(text.replace('state: "', 'state: "not '))
    assert len(findings(path)) == 6
    assert findings(path)[-1] == "game.dmt: 4 more differences"


def test_an_end_with_other_keys_is_told(file: Path) -> None:
    altered(file, '"reason": "quit", ', '"reason": "quit", "more": 1, ')
    assert "end: keys: expected" in findings(file)[0]


@given(st.floats(-1e300, 1e300))
def test_a_real_fact_has_at_most_ten_digits_and_is_near(value: float) -> None:
    short = round_number(value)
    assert abs(short - value) <= 1e-9 * abs(value)
    assert round_number(short) == short


@settings(max_examples=200, derandomize=True, deadline=None)
@given(st.binary(max_size=200))
def test_no_bytes_make_the_reader_fail_in_another_way(raw: bytes) -> None:
    with suppress(BadTranscript):
        parse_transcript(HEADER.encode() + OPENING.encode() + raw, "t")


def test_a_second_episode_is_another_game_of_the_same_seed(tmp_path: Path) -> None:
    problem = dmplay.load_problem("crying-baby")
    text = recorded(tmp_path / "g.dmt", "crying-baby", "random", episode=3)
    assert "episode: 3\n" in text
    played = dmplay.rollout(
        problem, [dmplay.load_agent(problem, 0, "random")], episodes=1, seed=7, first_episode=3
    )
    game = dmplay.Session(problem, SeededUniforms(7, 3), [dmplay.load_agent(problem, 0, "random")])
    while not game.over:
        game.advance()
    assert played.returns[0].tolist() == game.returns().tolist()
    assert json.loads(text.splitlines()[-1][5:])["total"]["agent"] == played.total_rewards[0, 0]


@pytest.mark.slow
def test_a_game_that_nothing_ends_stops_at_ten_thousand_turns_and_verifies(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    still = ("rewards=[]", "hexes=[[0,0]]", "bump_cost=0")
    text = recorded(path, "hexworld", "random", settings=still)
    assert '"reason": "turn limit", "turns": 10000' in text
    assert verify_file(path).is_ok


@pytest.mark.parametrize("seed", range(6))
def test_a_reroll_beside_an_agent_that_draws_verifies(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(
        GameRequest("predator-prey", other_agent="random", seed=seed, record_path=path)
    )
    for _ in range(3):
        game.choose(0)
    game.undo(2)
    game.reroll()
    with pytest.raises(BadParameter, match="nothing was taken back"):
        game.redo()
    game.choose(1)
    game.finish()
    assert verify_file(path).is_ok


@pytest.mark.parametrize("who", ["./evil.py:X", "os.path:join"])
def test_no_agent_that_a_file_names_is_imported_without_trust(tmp_path: Path, who: str) -> None:
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')")
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    game.choose(0)
    game.finish()
    altered(path, '"agent": "human"', f'"agent": "{who.replace("./", f"{tmp_path}/")}"')
    with pytest.raises(BadParameter, match="is not built in; if it is yours, add --trust"):
        resume_game(ResumeRequest(path))
    with pytest.raises(BadParameter, match="is not built in; if it is yours, add --trust"):
        branch_game(BranchRequest(path, turn=1, record_path=tmp_path / "other.dmt"))


def test_an_agent_asked_again_that_writes_into_what_it_is_given_is_a_finding(
    tmp_path: Path,
) -> None:
    recorded(tmp_path / "g.dmt", "cart-pole", "random", turns=3)
    problem = dmplay.load_problem("cart-pole")
    report = verify(
        read_transcript(tmp_path / "g.dmt"), problem, [Rescaling(problem, 0, (0, 0, 0))]
    )
    assert "turn 2, agent: Rescaling.update_memory writes into" in str(report)


def test_a_long_list_of_short_ones_is_not_deep() -> None:
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
def test_a_fact_is_written_as_json_writes_it(value: object) -> None:
    assert encode_json(value) == json.dumps(value, ensure_ascii=False)


def test_a_game_of_more_lines_than_are_remembered_is_read_and_written_alike(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = recorded(tmp_path / "g.dmt", "crying-baby", "random", turns=9)
    for module in (reading, transcript_format):
        monkeypatch.setattr(module, "MAX_CACHED_LINES", 2)
    assert recorded(tmp_path / "h.dmt", "crying-baby", "random", turns=9) == text
    assert verify_file(tmp_path / "g.dmt").is_ok


def test_lines_are_counted_however_long_the_file(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    text = recorded(path, "hexworld", "random", turns=3)
    notes = f"# {'x' * 600_000}\n" * 4
    path.write_text(text.replace("\nturn: 2\n", f"\n{notes}turn: 2\n"))
    assert verify_file(path).is_ok
    altered(path, "turn: 3\n", "trun: 3\n")
    [found] = verify_file(path).findings
    line = 1 + path.read_text().split("\n").index("trun: 3")
    assert (found.line, found.what[:27]) == (line, "column 1: unknown block 'tr")


def test_draws_of_no_reroll_are_told_as_draws(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("crying-baby", seed=7, record_path=path))
    game.choose(0)
    game.reroll()
    game.finish()
    assert game.recorder is not None
    (drawn,) = game.session.turns[-1].uniforms.tolist()
    altered(path, str(drawn), "0.5")
    assert "turn 1: draws: expected [0.5]" in str(verify_file(path))


def test_a_turn_takes_few_bytes_once_it_is_read(tmp_path: Path) -> None:
    path, turns = tmp_path / "game.dmt", 300
    recorded(path, "hexworld", "random", turns=turns, settings=["rewards=[]"])
    tracemalloc.start()
    try:
        transcript = read_transcript(path)
        held, _ = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert (held - len(transcript.content)) / turns < 700
