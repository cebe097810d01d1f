"""Tests of the player's records: the games that count, the data stored, and that none is lost."""

import json
from dataclasses import replace
from pathlib import Path
from threading import Thread

import pytest

from dmplay.core import safe_files, state_files
from dmplay.game import player_records
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game, write_game_copy
from dmplay.game.launch_requests import BranchRequest, GameRequest, ReplayRequest, ResumeRequest
from dmplay.game.player_records import ProblemRecord, load_records
from dmplay.output.records_report import report_records
from dmplay.ui.shell.commands import run_line
from tests.support.games import replace_in_file

DILEMMA_REQUEST = GameRequest("prisoners-dilemma", seed=7)
BABY_REQUEST = GameRequest("crying-baby", seed=7)
REQUESTS_WITH_ACTIONS = [
    (DILEMMA_REQUEST, "c"),
    (BABY_REQUEST, "f"),
    (GameRequest("simple-regulator", seed=7), "0.1"),
]


@pytest.fixture(autouse=True)
def records_path(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Path of the records file, in a temporary state folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    state_files.warn_once.cache_clear()
    return tmp_path / "state" / "dmplay" / "records.json"


def play_lines(game_request: GameRequest, *lines: str) -> Path:
    """Play a game by typed lines, end it, and return the path of its transcript."""
    table = GameController(on_game_end=player_records.record_finished_game)
    table.set_game(start_game(game_request))
    path = table.game.transcript_path
    for line in lines:
        run_line(table, line)
    table.end_game()
    assert path
    return path


def play_and_read_best_return(game_request: GameRequest, *lines: str) -> float | None:
    """Play a game and return the best return of the last record, or None."""
    play_lines(game_request, *lines)
    best_returns = [record.best and record.best.discounted_return for record in load_records()]
    return best_returns[-1] if best_returns else None


@pytest.mark.parametrize(("game_request", "action"), REQUESTS_WITH_ACTIONS)
def test_a_game_finished_by_a_person_is_the_last_and_the_best(
    game_request: GameRequest, action: str
) -> None:
    path = play_lines(
        game_request, *[action] * 20 if game_request is not DILEMMA_REQUEST else [action] * 10
    )
    end_facts = json.loads(path.read_text().splitlines()[-1].removeprefix("end: "))
    [record] = load_records()
    assert record.best == record.last
    assert record.last.discounted_return == end_facts["return"][record.seat]
    assert (record.last.turns, record.last.seed) == (end_facts["turns"], 7)


def test_the_best_game_has_the_highest_return() -> None:
    for expected_return, line in ((-30.0, "d"), (-10.0, "c"), (-10.0, "d")):
        assert play_and_read_best_return(
            DILEMMA_REQUEST, *["d", *[line] * 9] if line == "d" else ["c"] * 10
        ) in (expected_return, -27.0)
    [record] = load_records()
    assert record.best
    assert (record.best.discounted_return, record.last.discounted_return) == (-10, -27)


def test_each_variant_parameter_turn_limit_and_seat_has_its_own_best() -> None:
    for game_request in (
        GameRequest("prisoners-dilemma", turns=2),
        GameRequest("prisoners-dilemma", turns=3),
        GameRequest("prisoners-dilemma", settings=["discount=0.5"]),
        GameRequest("prisoners-dilemma", agent="tit-for-tat", seats=["agent2=human"], turns=2),
    ):
        play_lines(game_request, *["c"] * (game_request.turns or 10))
    assert {(record.turns, *record.parameters, record.seat) for record in load_records()} == {
        (2, "agent1"), (3, "agent1"), (None, "discount", "agent1"), (2, "agent2"),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("game_request", "lines"),
    [
        (DILEMMA_REQUEST, ["hint", *["c"] * 10]),
        (BABY_REQUEST, ["hint", *["f"] * 20]),
        (DILEMMA_REQUEST, ["c", "undo", *["c"] * 10]),
        (DILEMMA_REQUEST, ["c", "reroll", *["c"] * 9]),
        (DILEMMA_REQUEST, ["c", "restart", *["c"] * 10]),
        (DILEMMA_REQUEST, ["c", "seed 7", *["c"] * 10]),
        (replace(BABY_REQUEST, reveal=True), ["f"] * 20),
        (GameRequest("simple-regulator", seed=7, ghost_agent="optimal"), ["0.1"] * 20),
    ],
)
def test_a_game_with_hints_retries_or_a_revealed_state_is_never_the_best(
    game_request: GameRequest, lines: list[str]
) -> None:
    if lines[0] == "hint" and game_request is DILEMMA_REQUEST:
        game_request = replace(game_request, problem="rock-paper-scissors")
        lines = ["hint", *["r"] * 10]
    assert play_and_read_best_return(game_request, *lines) is None
    assert load_records()[0].last.turns >= 10


def test_a_restarted_game_is_not_the_best_even_after_a_resume() -> None:
    table = GameController(on_game_end=player_records.record_finished_game)
    table.set_game(start_game(DILEMMA_REQUEST))
    for line in ("c", "restart", "c"):
        run_line(table, line)
    path = table.game.transcript_path
    table.end_game("interrupted")
    assert path
    table.set_game(start_game(ResumeRequest(path)))
    for _ in range(9):
        run_line(table, "c")
    table.end_game()
    assert load_records()[0].best is None
    run_line(table, "new")
    for _ in range(10):
        run_line(table, "c")
    table.end_game()
    assert load_records()[0].best


def play_and_kill(game_request: GameRequest, *lines: str, cut_after: str = "") -> Path:
    """Play a game by typed lines, leave its transcript as a kill would, and return the path.

    The transcript is cut after the text `cut_after`.
    """
    table = GameController()
    table.set_game(start_game(game_request))
    for line in lines:
        run_line(table, line)
    recorder = table.game.recorder
    assert recorder
    recorder.close()  # as after a kill: there is no end line and no record
    content = recorder.path.read_text()
    recorder.path.write_text(
        content[: content.index(cut_after) + len(cut_after)] if cut_after else content
    )
    return recorder.path


@pytest.mark.parametrize(
    ("game_request", "lines", "cut_after"),
    [
        (DILEMMA_REQUEST, ["c", "restart", "c"], ""),
        (DILEMMA_REQUEST, ["c", "reroll"], ""),
        (DILEMMA_REQUEST, ["c", "reroll"], "reroll: 1\n\n"),
        (replace(DILEMMA_REQUEST, ghost_agent="tit-for-tat"), ["c"], ""),
    ],
)
def test_a_killed_game_with_a_retry_or_a_ghost_is_not_the_best(
    game_request: GameRequest, lines: list[str], cut_after: str
) -> None:
    path = play_and_kill(game_request, *lines, cut_after=cut_after)
    table = GameController(on_game_end=player_records.record_finished_game)
    table.set_game(start_game(ResumeRequest(path)))
    while not table.game.session.over:
        run_line(table, "c")
    table.end_game()
    assert [record.best for record in load_records()] == [None]


def test_a_game_resumed_after_another_on_its_seed_is_not_the_best() -> None:
    table = GameController(on_game_end=player_records.record_finished_game)
    table.set_game(start_game(DILEMMA_REQUEST))
    first = table.game.transcript_path
    assert first
    for line in ("c", "restart", *["c"] * 10):
        run_line(table, line)
    table.set_game(start_game(ResumeRequest(first)))
    for _ in range(9):
        run_line(table, "c")
    table.end_game()
    assert [record.best for record in load_records()] == [None]


@pytest.mark.parametrize(
    ("game_request", "lines"),
    [
        (DILEMMA_REQUEST, ["c"] * 9),
        (replace(DILEMMA_REQUEST, other_agent="grim"), ["c"] * 10),
        (replace(DILEMMA_REQUEST, other_agent="human"), ["c"] * 20),
        (replace(DILEMMA_REQUEST, agent="random", keep_save=True), ["auto"]),
    ],
)
def test_unfinished_games_other_opponents_and_agent_games_are_not_recorded(
    game_request: GameRequest, lines: list[str]
) -> None:
    play_lines(game_request, *lines)
    assert load_records() == []


def test_a_branch_is_marked_and_never_the_best_even_after_a_resume() -> None:
    first = play_lines(replace(DILEMMA_REQUEST, record_path=Path("a.dmt")), *["c"] * 10)
    table = GameController(on_game_end=player_records.record_finished_game)
    table.set_game(start_game(BranchRequest(first, turn=3, record_path=Path("b.dmt"))))
    run_line(table, "d")
    table.end_game("interrupted")
    assert "branched: 3\n" in Path("b.dmt").read_text()
    table.set_game(start_game(ResumeRequest(Path("b.dmt"))))
    for _ in range(6):
        run_line(table, "d")
    table.end_game()
    [record] = load_records()
    assert record.best
    assert (record.best.discounted_return, record.last.discounted_return) == (-10, -21)
    table.set_game(start_game(BranchRequest(first, turn=3, record_path=Path("c.dmt"))))
    run_line(table, "new")
    assert table.game.transcript_path
    write_game_copy(table.game, Path("d.dmt"))
    for path in (table.game.transcript_path, Path("d.dmt")):
        assert "branched" not in path.read_text()


def test_a_resumed_game_counts_and_an_altered_one_does_not() -> None:
    for name, counts in (("a.dmt", True), ("b.dmt", False)):
        path = Path(name)
        table = GameController(on_game_end=player_records.record_finished_game)
        table.set_game(
            start_game(replace(DILEMMA_REQUEST, other_agent="tit-for-tat", record_path=path))
        )
        for line in ["c", *["d"] * 4]:
            run_line(table, line)
        table.end_game("interrupted")
        if not counts:
            replace_in_file(
                path,
                '"agent1": "cooperate", "agent2": "cooperate"',
                '"agent1": "defect", "agent2": "cooperate"',
            )
        before = [record.best for record in load_records()]
        table.set_game(start_game(ResumeRequest(path)))
        for _ in range(5):
            run_line(table, "c")
        table.end_game()
        assert (before != [record.best for record in load_records()]) == counts


def test_a_replay_is_not_recorded_as_a_game() -> None:
    path = play_lines(replace(DILEMMA_REQUEST, record_path=Path("a.dmt")), *["c"] * 10)
    before = load_records()
    table = GameController(on_game_end=player_records.record_finished_game)
    table.set_game(start_game(ReplayRequest(path)))
    run_line(table, "auto")
    table.end_game()
    assert load_records() == before


def test_records_are_private_and_concurrent_games_lose_nothing(records_path: Path) -> None:
    paths = [
        play_lines(replace(DILEMMA_REQUEST, turns=n, record_path=Path(f"{n}.dmt")), *["c"] * n)
        for n in (1, 2)
    ]
    assert records_path.stat().st_mode & 0o777 == 0o600
    records_path.unlink()
    tables = [GameController(on_game_end=player_records.record_finished_game) for _ in range(12)]
    for number, table in enumerate(tables, 1):
        table.set_game(
            start_game(replace(DILEMMA_REQUEST, turns=number, record_path=Path(f"x{number}.dmt")))
        )
        for _ in range(number):
            run_line(table, "c")
    threads = [Thread(target=table.end_game) for table in tables]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {record.turns for record in load_records()} == {*range(1, 13)}
    assert len(paths) == 2


def test_a_game_ends_normally_if_records_cannot_be_written(
    records_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    records_path.mkdir(parents=True)
    play_lines(replace(DILEMMA_REQUEST, record_path=Path("a.dmt")), *["c"] * 10)
    warnings = capsys.readouterr().err.splitlines()
    assert len(warnings) <= 2
    assert all(row.startswith("warning: ") for row in warnings)


def test_a_waiting_thread_continues_when_the_lock_is_free(tmp_path: Path) -> None:
    order = []

    def wait() -> None:
        with safe_files.exclusive_lock(tmp_path / "lock"):
            order.append("second")

    with safe_files.exclusive_lock(tmp_path / "lock"):
        waiting_thread = Thread(target=wait)
        waiting_thread.start()
        order.append("first")
    waiting_thread.join()
    assert order == ["first", "second"]


def test_records_are_reported_as_a_table_and_as_json() -> None:
    assert report_records(json=False) == "no finished games"
    assert report_records(json=True) == '{"schema": 1, "records": []}'
    play_lines(replace(DILEMMA_REQUEST, turns=2), *["c"] * 2)
    play_lines(GameRequest("rock-paper-scissors", seed=1), "hint", *["r"] * 10)
    head, first, second = report_records(json=False).splitlines()
    assert head.split() == [
        "problem",
        "seat",
        "record",
        "turns",
        "seed",
        "day",
        "last",
        "best",
        "medal",
        "remark",
    ]
    assert first.split()[:7] == ["prisoners-dilemma", "--turns", "2", "agent1", "-2", "2", "7"]
    assert second.split()[:3] == ["rock-paper-scissors", "agent1", "-"]
    assert second.endswith("no record, because of 1 hint")
    data = json.loads(report_records(json=True))["records"]
    assert [entry["problem"] for entry in data] == ["prisoners-dilemma", "rock-paper-scissors"]
    assert data[0]["best"]["return"] == -2
    assert data[1]["best"] is None


def test_the_record_of_a_running_game_is_that_of_its_settings() -> None:
    game_request = GameRequest("hexworld:straight-line", settings=["slip=0.2"], turns=2, seed=7)
    play_lines(game_request, "e", "e")
    table = GameController()
    table.set_game(start_game(replace(game_request, seed=8)))
    record = player_records.find_game_record(table.game)
    assert isinstance(record, ProblemRecord)
    assert record.last.seed == 7
    table.set_game(start_game(replace(game_request, settings=[])))
    assert player_records.find_game_record(table.game) is None
    table.set_game(start_game(replace(game_request, agent="random")))
    assert player_records.find_game_record(table.game) is None
