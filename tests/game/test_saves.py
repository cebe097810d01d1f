"""Tests of the saves folder: played games are not lost, and only their owner can read them."""

import json
import os
import time
from pathlib import Path

import pytest

from dmplay.core import safe_files
from dmplay.errors import BadParameter
from dmplay.game import saves
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.output.saved_games import report_saved_games
from dmplay.transcript.reader import read_outline, read_transcript
from dmplay.ui.game_launcher import print_epilogue
from tests.support.fork_server import wait_for_exit
from tests.support.games import assert_verified
from tests.support.programs import run_dmplay, start_dmplay


@pytest.fixture
def saves_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder of automatically saved games."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    return saves.saves_folder(os.environ)


def write_save(folder: Path, number: int, *, days: float = 2, player: str = "human") -> Path:
    """Write a saved game of 100 kB that was last played some days ago; return its path."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{number:06}-hexworld.dmt"
    text = f'dmplay: 1\nproblem: "hexworld"\nseats: {{"agent": "{player}"}}\nseed: 7\n\nturn: 1\n'
    path.write_text(text + "\n" * (100_000 - len(text)))
    last_played = time.time() - days * 86400
    os.utime(path, (last_played, last_played))
    return path


def kept_numbers(folder: Path) -> list[int]:
    """Return the numbers of the saves in a folder, oldest first."""
    return sorted(int(path.name.partition("-")[0]) for path in folder.glob("*.dmt"))


def test_saves_are_kept_up_to_a_size_and_the_oldest_are_deleted_first(saves_folder: Path) -> None:
    for number in range(1, 31):
        write_save(saves_folder, number)
    assert saves.remove_old_saves(3) == (0, 0)
    assert saves.remove_old_saves(1) == (21, 0)
    assert kept_numbers(saves_folder) == [*range(22, 31)]


def test_saves_are_ordered_by_number_and_not_by_the_clock(saves_folder: Path) -> None:
    for number in range(1, 21):  # The clock went back before the newest games.
        write_save(saves_folder, number, days=2 if number <= 10 else 400)
    saves.remove_old_saves(1)
    assert kept_numbers(saves_folder) == [*range(12, 21)]
    old_name = saves_folder / "20261124-002725-hexworld.dmt"
    write_save(saves_folder, 1).rename(old_name)
    assert [path.name[:6] for path in saves.list_saves()][:2] == ["000020", "000019"]
    assert saves.list_saves()[-1] == old_name


def test_a_game_of_the_last_day_is_not_deleted(saves_folder: Path) -> None:
    for number in range(1, 31):
        write_save(saves_folder, number, days=0.9)
    assert saves.remove_old_saves(1) == (0, 1)
    write_save(saves_folder, 1, days=1.1)
    write_save(saves_folder, 2, days=-300)  # The clock was set back since.
    assert saves.remove_old_saves(1) == (1, 1)
    assert kept_numbers(saves_folder) == [*range(2, 31)]


def test_no_game_is_deleted_before_an_older_one_that_stays(saves_folder: Path) -> None:
    for number in range(1, 31):
        write_save(saves_folder, number, days=400 if number != 5 else 0.1)
    assert saves.remove_old_saves(1) == (4, 1)
    assert kept_numbers(saves_folder) == [*range(5, 31)]


def test_the_number_of_the_newest_game_is_not_used_again(saves_folder: Path) -> None:
    for number in range(1, 5):
        write_save(saves_folder, number, days=400)
    assert saves.remove_old_saves(0.05) == (3, 0.05)
    assert kept_numbers(saves_folder) == [4]
    path = saves.create_save("hexworld")
    assert path
    assert path.name == "000005-hexworld.dmt"


def test_an_old_file_time_does_not_make_room_before_recent_games(
    tmp_path: Path, saves_folder: Path
) -> None:
    for number in range(1, 31):
        write_save(saves_folder, number, days=0.1 if number < 30 else 9000)
    result = run_dmplay(tmp_path, "hexworld", "--seed", "5", "--keep", "1", stdin="e\nquit\n")
    assert result.stderr.endswith(
        "saved games take more than 1 MB, because dmplay never deletes a game of the last 24 "
        "hours, a running game, the newest game or any game newer than one of these\n"
    )
    assert kept_numbers(saves_folder) == [*range(1, 32)]


def test_what_was_removed_and_what_stays_is_one_line(tmp_path: Path, saves_folder: Path) -> None:
    for number in range(1, 31):
        write_save(saves_folder, number, days=9 if number < 10 else 0.1)
    result = run_dmplay(tmp_path, "hexworld", "--seed", "5", "--keep", "1", stdin="e\nnew\ne\n")
    assert result.stderr.splitlines()[-1] == (
        "deleted 9 older saved games to make room; --keep MB raises the limit; saved games take "
        "more than 1 MB, because dmplay never deletes a game of the last 24 hours, a running game, "
        "the newest game or any game newer than one of these"
    )


def test_a_game_in_progress_is_not_deleted(saves_folder: Path) -> None:
    for number in range(1, 5):
        write_save(saves_folder, number)
    game = start_new_game(GameRequest("hexworld"))
    assert game.recorder is not None
    game.choose(0)
    os.utime(game.recorder.path, (1, 1))
    for number in range(6, 32):
        write_save(saves_folder, number)
    assert saves.remove_old_saves(1) == (4, 1)
    assert kept_numbers(saves_folder) == [*range(5, 32)]
    game.finish()


def test_saves_of_language_models_do_not_replace_those_of_people(saves_folder: Path) -> None:
    """Saves of people do not replace those of language models either."""
    for number in range(1, 41):
        player = "mcp" if 5 <= number < 10 or number > 20 else "human"
        write_save(saves_folder, number, player=player)
    saves.remove_old_saves(1)
    numbers = kept_numbers(saves_folder)
    assert [number for number in numbers if number <= 20] == [*range(17, 21)]
    assert [number for number in numbers if number > 20] == [*range(36, 41)]


def test_every_new_save_has_the_next_number(saves_folder: Path) -> None:
    names = [
        path.name for path in (saves.create_save("hexworld"), saves.create_save("catch")) if path
    ]
    assert names == ["000001-hexworld.dmt", "000002-catch.dmt"]
    write_save(saves_folder, 41)
    path = saves.create_save("2048")
    assert path
    assert path.name == "000042-2048.dmt"
    taken = saves_folder / "000043-2048.dmt"
    taken.mkdir()  # as if another program had just taken the name
    assert saves.create_game_file(saves_folder, "2048").name == "000044-2048.dmt"


def test_the_file_name_of_a_save_contains_the_problem_name(tmp_path: Path) -> None:
    for problem, name in (("./tiger.py:Tiger", "tiger.py-Tiger"), ("../a/b.mdp", "a-b.mdp")):
        assert saves.create_game_file(tmp_path, problem).name.partition("-")[2] == f"{name}.dmt"
        assert not [*tmp_path.glob("*-.*")]


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
    assert controller.restart() == f"new game of hexworld, seed 7. saved: {path}"
    assert controller.restart() == "new game of hexworld, seed 7."  # the previous game had no turns


@pytest.mark.parametrize("options", [(), ("--quiet",)])
def test_deleted_saves_are_reported_once(
    options: tuple[str, ...], tmp_path: Path, saves_folder: Path
) -> None:
    for number in range(1, 31):
        write_save(saves_folder, number)
    words = ("hexworld", "--seed", "7", "--keep", "1", *options)
    result = run_dmplay(tmp_path, *words, stdin="e\nnew\ne\nquit\n")
    message = "deleted 21 older saved games to make room; --keep MB raises the limit\n"
    assert result.stderr.endswith(message)
    assert result.stderr.count("deleted ") == 1
    assert kept_numbers(saves_folder) == [*range(22, 33)]


def test_the_size_of_the_saves_is_a_setting_of_the_user_only(
    tmp_path: Path, saves_folder: Path
) -> None:
    for number in range(1, 31):
        write_save(saves_folder, number)
    (tmp_path / "dmplay.toml").write_text("keep = 1\n")
    result = run_dmplay(tmp_path, "hexworld", stdin="e\n")
    assert "use your own config.toml or the command line" in result.stderr
    (tmp_path / "dmplay.toml").rename(tmp_path / "mine.toml")
    config_folder = tmp_path / ".config" / "dmplay"
    config_folder.mkdir(parents=True)
    (tmp_path / "mine.toml").rename(config_folder / "config.toml")
    assert "deleted 21 older saved games" in run_dmplay(tmp_path, "hexworld", stdin="e\n").stderr


def test_listing_saved_games_reads_only_those_that_are_shown(
    saves_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    saves_folder.mkdir(parents=True)
    text = 'dmplay: 1\nproblem: "hexworld"\nseats: {"agent": "human"}\nseed: 7\n\nturn: 0\n\n'
    for number in range(1, 101):
        Path(saves_folder, f"{number:06}-hexworld.dmt").write_text(text)
    read_paths: list[Path] = []
    read_bytes = safe_files.read_bytes

    def read_and_note(path: Path) -> bytes:
        read_paths.append(path)
        return read_bytes(path)

    monkeypatch.setattr(safe_files, "read_bytes", read_and_note)
    rows = report_saved_games(all_games=False, json=False).split("\n")
    assert len(read_paths) == 20
    assert rows[0].endswith("000100-hexworld.dmt: hexworld, agent human; unfinished")
    assert rows[20:] == ["80 older games: dmplay list games --all"]
    assert json.loads(report_saved_games(all_games=False, json=True))["older"] == 80
    assert len(report_saved_games(all_games=True, json=False).split("\n")) == 100


def test_an_outline_has_the_facts_of_the_whole_transcript(tmp_path: Path) -> None:
    commands = "e\nhint\nw\nundo\nw\nhint\nw\nquit\n"
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin=commands)
    outline = read_outline(tmp_path / "g.dmt")
    assert outline.header == read_transcript(tmp_path / "g.dmt").header
    assert (outline.end_reason, outline.turns) == ("quit", 4)
    assert outline.hint_counts == {"agent": 2}
    assert not outline.has_natural_end


def test_an_outline_counts_no_hints_in_a_malformed_line(tmp_path: Path) -> None:
    path = tmp_path / "g.dmt"
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="hint\nw\nquit\n")
    content = path.read_text()
    assert 'help: {"agent": 1}' in content
    path.write_text(content.replace('help: {"agent": 1}', "help: 1"))
    assert read_outline(path).hint_counts == {}


@pytest.mark.parametrize("text", ["", "dmplay: 1\n", "dmplay: 1\n\nturn: 0\n\n", "\xff"])
def test_a_file_that_is_no_transcript_is_not_listed(text: str, tmp_path: Path) -> None:
    (tmp_path / "g.dmt").write_text(text)
    assert [*saves.iter_outlines([tmp_path / "g.dmt", tmp_path / "none.dmt"])] == []


def test_resume_without_a_path_skips_a_game_without_turns(
    tmp_path: Path, saves_folder: Path
) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", stdin="e\n")
    (played_path,) = saves_folder.iterdir()
    header, initial_block = played_path.read_text().split("\n\n")[:2]
    (saves_folder / "zero.dmt").write_text(f"{header}\n\n{initial_block}\n\n")
    assert saves.find_latest_unfinished() == played_path


def test_games_started_simultaneously_each_have_a_file(tmp_path: Path, saves_folder: Path) -> None:
    games = [start_dmplay(tmp_path, "-e", "play hexworld", "-e", "e") for _ in range(8)]
    assert [wait_for_exit(game) for game in games] == [0] * 8
    assert len({*saves_folder.iterdir()}) == 8
    for path in saves_folder.iterdir():
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
    assert output == "ok g.dmt (2 turns, unfinished; not recomputed: human)\n1 verified\n"
    assert run_dmplay(tmp_path, "resume", "g.dmt", stdin="w\nquit\n").returncode == 0
    assert assert_verified(tmp_path / "g.dmt")


def count_read_bytes() -> int:
    """Return the number of bytes that this process has read so far."""
    return int(Path("/proc/self/io").read_text().split()[1])


def test_only_the_end_of_a_finished_game_is_read_to_find_an_unfinished_one(
    saves_folder: Path,
) -> None:
    for number in range(1, 30):
        path = write_save(saves_folder, number)
        with path.open("a") as file:
            file.write('\nend: {"reason": "terminal", "turns": 1, "sha256": "0"}\n')
    before = count_read_bytes()
    with pytest.raises(BadParameter, match="no unfinished game"):
        saves.find_latest_unfinished()
    assert count_read_bytes() - before < 29 * 10_000
    game = start_new_game(GameRequest("hexworld", seed=3, keep_save=True))
    game.choose(0)
    game.finish("quit")
    assert saves.find_latest_unfinished() == game.transcript_path
