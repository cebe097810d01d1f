"""Tests of the saves folder: played games are not lost, and only their owner can read them."""

import os
import time
from pathlib import Path

import pytest

from dmplay.game import saves
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game_launcher import print_epilogue
from tests.support.games import assert_verified
from tests.support.programs import run_dmplay, start_dmplay, wait_for_exit

PLAYED_GAME_TEXT = "dmplay: 1\n\nturn: 1\n"


@pytest.fixture
def saves_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of automatically saved games."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return saves.saves_folder(os.environ)


def write_saves(saves_folder: Path, text: str, age: float) -> list[Path]:
    """Write thirty games with this text and this modification time, in seconds since the epoch."""
    saves_folder.mkdir(parents=True, exist_ok=True)
    paths = [saves_folder / f"{age}-{number:02}.dmt" for number in range(30)]
    for path in paths:
        path.write_text(text)
        os.utime(path, (age, age))
    return paths


def test_a_game_in_progress_is_not_removed_by_newer_games(saves_folder: Path) -> None:
    game = start_new_game(GameRequest("hexworld"))
    assert game.recorder is not None
    os.utime(game.recorder.path, (1, 1))
    game.choose(0)
    write_saves(saves_folder, PLAYED_GAME_TEXT, 9)
    os.utime(game.recorder.path, (1, 1))
    other_game = start_new_game(GameRequest("hexworld"))
    assert game.recorder.path.exists()
    assert len([*saves_folder.iterdir()]) == saves.MAX_SAVES + 1
    game.finish()
    other_game.finish()


def test_the_file_name_of_a_save_contains_the_problem_name(tmp_path: Path) -> None:
    for problem, name in (("./tiger.py:Tiger", "tiger.py-Tiger"), ("../a/b.mdp", "a-b.mdp")):
        assert (
            saves.create_game_file(tmp_path, problem)
            .name.partition("-")[2]
            .endswith(f"-{name}.dmt")
        )
        assert not [*tmp_path.glob("*-.*")]


def test_saves_of_language_models_do_not_replace_those_of_people(saves_folder: Path) -> None:
    """Saves of people do not replace those of language models either."""
    for age, player in enumerate(("mcp", "human", "mcp"), 1):
        write_saves(saves_folder, f'dmplay: 1\nseats: {{"agent": "{player}"}}\n\nturn: 1\n', age)
    start_new_game(GameRequest("hexworld")).finish()
    ages = [path.name.partition("-")[0] for path in saves_folder.iterdir()]
    assert (ages.count("1"), ages.count("2"), ages.count("3")) == (0, 19, 19)


def test_saves_without_turns_are_removed_before_played_games(saves_folder: Path) -> None:
    played_games = write_saves(saves_folder, PLAYED_GAME_TEXT, 1)[: saves.MAX_SAVES - 1]
    for path in {*saves_folder.iterdir()} - {*played_games}:
        path.unlink()
    write_saves(saves_folder, "dmplay: 1\n", 5)
    start_new_game(GameRequest("hexworld")).finish()
    assert {*played_games} < {*saves_folder.iterdir()}
    assert len([*saves_folder.iterdir()]) == saves.MAX_SAVES


def test_the_file_of_a_new_game_is_not_removed(saves_folder: Path) -> None:
    first = saves.create_save("hexworld")
    second = saves.create_save("hexworld")
    assert first
    assert second
    assert {*saves_folder.iterdir()} == {first, second}
    assert first != second
    old_time = time.time() - 2 * saves.NEW_FILE_SECONDS
    os.utime(first, (old_time, old_time))
    assert saves.remove_old_saves() == 0
    third = saves.create_save("catch")
    assert {*saves_folder.iterdir()} == {second, third}


def test_a_game_without_turns_is_neither_saved_nor_reported(
    tmp_path: Path, saves_folder: Path
) -> None:
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", stdin="quit\n")
    assert (result.returncode, result.stderr) == (0, "")
    assert [*saves_folder.iterdir()] == []


def test_the_epilogue_mentions_only_existing_transcripts(
    saves_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for is_deleted in (False, True):
        controller = GameController(start_new_game(GameRequest("hexworld", seed=7)))
        controller.game.choose(0)
        controller.end_game()
        if is_deleted:
            next(iter(controller.finished_games)).path.unlink()
        print_epilogue(controller)
        assert ("replay: " in capsys.readouterr().err) is not is_deleted


@pytest.mark.usefixtures("saves_folder")
def test_a_new_game_reports_the_path_of_the_previous_game_and_no_older_one() -> None:
    controller = GameController(start_new_game(GameRequest("hexworld", seed=7)))
    controller.game.choose(0)
    path = controller.game.transcript_path
    assert controller.restart() == f"new game of hexworld, seed 7. kept: {path}"
    assert controller.restart() == "new game of hexworld, seed 7."  # the previous game had no turns


def test_removed_saves_are_reported_once(
    saves_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_saves(saves_folder, PLAYED_GAME_TEXT, 1)
    controller = GameController()
    for _ in range(2):
        controller.set_game(start_new_game(GameRequest("hexworld", seed=7)))
        controller.game.choose(0)
    controller.end_game()
    print_epilogue(controller)
    lines = capsys.readouterr().err.split("\n")
    assert lines[-2] == "removed: 12 older games; the last 20 are kept"
    assert "".join(lines).count("removed: ") == 1


def test_resume_without_a_path_skips_a_game_without_turns(
    tmp_path: Path, saves_folder: Path
) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", stdin="e\n")
    (played_path,) = saves_folder.iterdir()
    header, initial_block = played_path.read_text().split("\n\n")[:2]
    (saves_folder / "zero.dmt").write_text(f"{header}\n\n{initial_block}\n\n")
    assert saves.find_latest_unfinished() == played_path


def test_games_started_simultaneously_each_have_a_file(tmp_path: Path, saves_folder: Path) -> None:
    old_paths = write_saves(saves_folder, PLAYED_GAME_TEXT, 1)
    games = [start_dmplay(tmp_path, "-e", "play hexworld", "-e", "e") for _ in range(8)]
    assert [wait_for_exit(game) for game in games] == [0] * 8
    new_paths = {*saves_folder.iterdir()} - {*old_paths}
    assert len(new_paths) == 8
    for path in new_paths:
        assert "\nturn: 1\n" in path.read_text()


def test_saves_are_readable_only_by_their_owner(saves_folder: Path) -> None:
    saves_folder.mkdir(parents=True)
    game = start_new_game(GameRequest("crying-baby"))
    assert game.recorder
    assert game.recorder.path.stat().st_mode & 0o777 == 0o600
    assert saves_folder.stat().st_mode & 0o777 == 0o700
    game.finish()


def test_without_a_state_folder_a_game_is_saved_to_a_given_path(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    commands = "play hexworld --seed 7\ne\nw\nreroll\nsave g.dmt\ne\n"
    result = run_dmplay(tmp_path, "shell", stdin=commands)
    assert result.returncode == 0, result.stderr
    output = run_dmplay(tmp_path, "verify", "--allow-unfinished", "g.dmt").stdout
    assert output == "ok g.dmt (2 turns, unfinished; not re-asked: human)\n1 verified\n"
    assert run_dmplay(tmp_path, "resume", "g.dmt", stdin="w\nquit\n").returncode == 0
    assert assert_verified(tmp_path / "g.dmt")
