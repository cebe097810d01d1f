"""The state folder: no game that is played or has turns is lost, and nobody else reads it."""

import os
import time
from pathlib import Path

import pytest

from dmplay.front import print_epilogue
from dmplay.game import saves
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.game.table import GameController
from tests.support.games import verified
from tests.support.programs import ended, run, started

PLAYED = "dmplay: 1\n\nturn: 1\n"


@pytest.fixture
def kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where games are kept."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return saves.saves_folder(os.environ)


def fill(kept: Path, text: str, age: float) -> list[Path]:
    """Thirty games of a text, last written so many seconds after the first second of all."""
    kept.mkdir(parents=True, exist_ok=True)
    paths = [kept / f"{age}-{number:02}.dmt" for number in range(30)]
    for path in paths:
        path.write_text(text)
        os.utime(path, (age, age))
    return paths


def test_a_game_in_play_is_not_removed_however_many_come_after_it(kept: Path) -> None:
    game = start_new_game(GameRequest("hexworld"))
    assert game.recorder is not None
    os.utime(game.recorder.path, (1, 1))
    game.choose(0)
    fill(kept, PLAYED, 9)
    os.utime(game.recorder.path, (1, 1))
    other = start_new_game(GameRequest("hexworld"))
    assert game.recorder.path.exists()
    assert len([*kept.iterdir()]) == saves.MAX_SAVES + 1
    game.finish()
    other.finish()


def test_a_game_is_kept_under_a_name_that_begins_with_that_of_its_problem(tmp_path: Path) -> None:
    for problem, name in (("./tiger.py:Tiger", "tiger.py-Tiger"), ("../a/b.mdp", "a-b.mdp")):
        assert (
            saves.create_game_file(tmp_path, problem)
            .name.partition("-")[2]
            .endswith(f"-{name}.dmt")
        )
        assert not [*tmp_path.glob("*-.*")]


def test_games_of_language_models_push_out_none_of_people(kept: Path) -> None:
    """Nor do those of people push out theirs."""
    for age, player in enumerate(("mcp", "human", "mcp"), 1):
        fill(kept, f'dmplay: 1\nseats: {{"agent": "{player}"}}\n\nturn: 1\n', age)
    start_new_game(GameRequest("hexworld")).finish()
    left = [path.name.partition("-")[0] for path in kept.iterdir()]
    assert (left.count("1"), left.count("2"), left.count("3")) == (0, 19, 19)


def test_games_of_no_turns_push_none_out_and_are_removed(kept: Path) -> None:
    real = fill(kept, PLAYED, 1)[: saves.MAX_SAVES - 1]
    for path in {*kept.iterdir()} - {*real}:
        path.unlink()
    fill(kept, "dmplay: 1\n", 5)
    start_new_game(GameRequest("hexworld")).finish()
    assert {*real} < {*kept.iterdir()}
    assert len([*kept.iterdir()]) == saves.MAX_SAVES


def test_the_file_of_a_game_that_just_begins_is_left_to_it(kept: Path) -> None:
    first = saves.create_save("hexworld")
    second = saves.create_save("hexworld")
    assert first
    assert second
    assert {*kept.iterdir()} == {first, second}
    assert first != second
    old = time.time() - 2 * saves.NEW_FILE_SECONDS
    os.utime(first, (old, old))
    assert saves.remove_old_saves() == 0
    third = saves.create_save("catch")
    assert {*kept.iterdir()} == {second, third}


def test_a_game_of_no_turns_is_not_kept_nor_told_of(tmp_path: Path, kept: Path) -> None:
    done = run(tmp_path, "hexworld", "--seed", "7", stdin="quit\n")
    assert (done.returncode, done.stderr) == (0, "")
    assert [*kept.iterdir()] == []


def test_what_is_told_of_is_there(kept: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for gone in (False, True):
        table = GameController(start_new_game(GameRequest("hexworld", seed=7)))
        table.game.choose(0)
        table.end_game()
        if gone:
            next(iter(table.finished_games)).path.unlink()
        print_epilogue(table)
        assert ("replay: " in capsys.readouterr().err) is not gone


@pytest.mark.usefixtures("kept")
def test_a_new_game_tells_where_the_one_before_it_is_and_none_older() -> None:
    table = GameController(start_new_game(GameRequest("hexworld", seed=7)))
    table.game.choose(0)
    place = table.game.transcript_path
    assert table.restart() == f"new game of hexworld, seed 7. kept: {place}"
    assert table.restart() == "new game of hexworld, seed 7."  # that had no turns


def test_games_that_make_room_are_told_of_once(
    kept: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    fill(kept, PLAYED, 1)
    table = GameController()
    for _ in range(2):
        table.set_game(start_new_game(GameRequest("hexworld", seed=7)))
        table.game.choose(0)
    table.end_game()
    print_epilogue(table)
    told = capsys.readouterr().err.split("\n")
    assert told[-2] == "removed: 12 older games; the last 20 are kept"
    assert "".join(told).count("removed") == 1


def test_bare_resume_passes_over_a_game_of_no_turns(tmp_path: Path, kept: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", stdin="e\n")
    (old,) = kept.iterdir()
    header, opening = old.read_text().split("\n\n")[:2]
    (kept / "zero.dmt").write_text(f"{header}\n\n{opening}\n\n")
    assert saves.find_latest_unfinished() == old


def test_games_begun_at_once_all_have_a_file(tmp_path: Path, kept: Path) -> None:
    old = fill(kept, PLAYED, 1)
    games = [started(tmp_path, "-e", "play hexworld", "-e", "e") for _ in range(8)]
    assert [ended(game) for game in games] == [0] * 8
    new = {*kept.iterdir()} - {*old}
    assert len(new) == 8
    for path in new:
        assert "\nturn: 1\n" in path.read_text()


def test_nobody_else_reads_the_games_that_are_kept(kept: Path) -> None:
    kept.mkdir(parents=True)
    game = start_new_game(GameRequest("crying-baby"))
    assert game.recorder
    assert game.recorder.path.stat().st_mode & 0o777 == 0o600
    assert kept.stat().st_mode & 0o777 == 0o700
    game.finish()


def test_without_a_state_folder_a_game_is_saved_where_a_path_is_given(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    typed = "play hexworld --seed 7\ne\nw\nreroll\nsave g.dmt\ne\n"
    done = run(tmp_path, "shell", stdin=typed)
    assert done.returncode == 0, done.stderr
    told = run(tmp_path, "verify", "--allow-unfinished", "g.dmt").stdout
    assert told == "ok g.dmt (2 turns, unfinished; not re-asked: human)\n1 verified\n"
    assert run(tmp_path, "resume", "g.dmt", stdin="w\nquit\n").returncode == 0
    assert verified(tmp_path / "g.dmt")
