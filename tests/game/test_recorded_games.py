"""Recorded games are read in one process, with the rows that `dmplay export` prints."""

import csv
import io
import json
from pathlib import Path

import pytest

import dmplay
from dmplay.core.data_frames import collect_columns
from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.launch_requests import ReplayRequest
from dmplay.game.recorded_games import RecordedGame
from dmplay.game.transcript_verification import iter_transcript_files
from dmplay.output.transcript_export import ExportOptions, export_rows, export_transcript
from tests.support.programs import run_dmplay

TRANSCRIPTS = Path(__file__).parent.parent.parent / "transcripts"
SLOW_FOLDERS = ("collaborative_predator_prey",)
UNDONE = "e\nne\nundo\nw\nreroll\n"


@pytest.fixture
def games(tmp_path: Path) -> Path:
    """Return a folder with three games and a file that is none."""
    for name, turns in {"crying-baby": 3, "prisoners-dilemma": 2}.items():
        game = dmplay.play(name, seed=7, turns=turns)
        while not game.over:
            game.act(*[space.labels[0] for space in game.session.problem.actions])
        game.save(tmp_path / f"{name}.dmt")
    (tmp_path / "more").mkdir()
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "more/walk.dmt", stdin=UNDONE)
    (tmp_path / "broken.dmt").write_text("broken\n")
    return tmp_path


def export(path: Path, format_name: str) -> str:
    printout = export_transcript(ReplayRequest(path), [format_name], ExportOptions())
    return "".join(printout.text_chunks)


@pytest.mark.parametrize(
    "path",
    [
        folder_files[0]
        for folder in sorted(TRANSCRIPTS.iterdir())
        if folder.is_dir() and folder.name not in SLOW_FOLDERS
        for folder_files in [[*iter_transcript_files([folder])]]
    ],
    ids=lambda path: path.parent.name,
)
def test_the_rows_of_a_game_are_those_of_its_export(path: Path) -> None:
    game = dmplay.read(path)
    lines = [json.loads(line) for line in export(path, "jsonl").splitlines()]
    assert lines == game.turns
    table = [*csv.DictReader(io.StringIO(export(path, "csv")))]
    assert [row["turn"] for row in table] == [str(row["turn"]) for row in game.turns]
    assert [*table[0]] == [*collect_columns(game.turns)]
    end = json.loads(export(path, "json"))["end"]
    assert end["return"] == pytest.approx(game.returns)
    assert (end["reason"], end["turns"]) == (game.end_reason, len(game.session.turns))


def test_a_path_gives_one_game_and_a_folder_a_pattern_or_a_list_gives_several(games: Path) -> None:
    file = games / "crying-baby.dmt"
    assert isinstance(dmplay.read(file), RecordedGame)
    assert isinstance(dmplay.read(str(file)), RecordedGame)
    assert len(dmplay.read([file])) == 1
    assert len(dmplay.read(f"{games}/**/w*.dmt")) == 1
    assert len(dmplay.read(games / "more")) == 1
    paths = [row["file"] for row in dmplay.read(str(games / "[cp]*.dmt")).list_rows()]
    assert [*dict.fromkeys(paths)] == [str(file), str(games / "prisoners-dilemma.dmt")]
    with pytest.raises(BadParameter, match="no file matches this pattern"):
        dmplay.read(str(games / "q*.dmt"))


def test_a_turn_that_a_game_does_not_have_is_refused(games: Path) -> None:
    game = dmplay.read(games / "crying-baby.dmt")
    for turn in -1, len(game.turns):
        with pytest.raises(BadParameter, match=f"turn: got {turn}, expected 0 to"):
            game.go_to_turn(turn)


def test_a_bad_file_is_named(games: Path) -> None:
    with pytest.raises(BadTranscript, match=r"broken\.dmt:1: not a transcript"):
        dmplay.read(games)
    several = dmplay.read([games], skip_bad=True)
    assert len(several) == 3
    (error,) = several.errors
    assert error.startswith(str(games / "broken.dmt"))


def test_a_folder_is_exported_as_one_table(games: Path) -> None:
    completed = run_dmplay(games, "export", ".", "--csv")
    assert completed.returncode == 3
    assert completed.stderr.startswith("not exported: broken.dmt:1: ")
    assert len(completed.stderr.splitlines()) == 1
    printed = [*csv.DictReader(io.StringIO(completed.stdout))]
    rows = dmplay.read(games, skip_bad=True).list_rows()
    assert len(printed) == len(rows)
    assert [*printed[0]] == [*collect_columns(rows)]
    assert [*printed[0]][:3] == ["file", "problem", "turn"]
    assert [row["event"] for row in printed if row["event"]] == ["undo", "reroll"]
    chunks = export_rows([games], ["jsonl"], ExportOptions()).text_chunks
    assert [json.loads(line) for line in chunks] == rows


def test_several_files_need_a_format_with_rows(games: Path) -> None:
    for arguments, message in {
        ("--svg",): "--svg: expected --csv or --jsonl for a folder or several files",
        ("--csv", "--at", "3"): "--at: only with --svg or --html, not with --csv",
    }.items():
        completed = run_dmplay(games, "export", ".", *arguments)
        assert (completed.returncode, completed.stderr) == (2, f"error: {message}\n")


def test_a_review_adds_values_and_regret_to_the_row_of_the_choice(games: Path) -> None:
    game = dmplay.read(games / "more" / "walk.dmt")
    choices = game.review()
    rows = game.list_rows(review=True)
    reviewed = [row for row in rows if "regret agent" in row]
    assert [row["turn"] for row in reviewed] == [choice.turn for choice in choices]
    assert [row["actions agent"] for row in reviewed] == [choice.chosen for choice in choices]
    assert [row["values agent"] for row in reviewed] == [choice.values for choice in choices]
    assert "regret agent" not in game.turns[1]


@pytest.mark.extra("pandas")
def test_the_turns_of_several_games_are_one_frame(games: Path) -> None:
    frame = dmplay.read(games, skip_bad=True).to_frame(review=True)
    assert frame["file"].nunique() == 3
    totals = frame.groupby("file")["rewards agent"].sum()
    assert totals[str(games / "crying-baby.dmt")] == -25
    assert frame["regret agent"].notna().sum() == 5


def test_hidden_states_of_a_running_game_are_read_only_with_peek(tmp_path: Path) -> None:
    game = dmplay.play("crying-baby", seed=7, turns=3)
    game.act("feed")
    game.save(tmp_path / "game.dmt")
    with pytest.raises(BadParameter, match="this game can still be continued"):
        dmplay.read(tmp_path / "game.dmt")
    with pytest.raises(BadParameter, match="this game can still be continued"):
        dmplay.evaluate_transcripts(tmp_path)
    printout = export_rows([tmp_path], ["csv"], ExportOptions())
    assert ("".join(printout.text_chunks), printout.exit_code) == ("", 3)
    assert str(tmp_path / "game.dmt") in printout.stderr_text
    (player,) = dmplay.evaluate_transcripts(tmp_path, peek=True).players
    assert len(player.all_games) == 1
    assert "state" in dmplay.read(tmp_path / "game.dmt", peek=True).turns[1]
    assert "peeked: true" in (tmp_path / "game.dmt").read_text()
