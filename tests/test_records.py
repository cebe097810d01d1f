"""Best and last games: which count, what is kept of them, and that none is lost."""

import json
from dataclasses import replace
from pathlib import Path
from threading import Thread

import pytest

from dmplay import disk, records
from dmplay.game.request import BranchRequest, GameRequest, ReplayRequest, ResumeRequest
from dmplay.game.start import start_game, write_game_copy
from dmplay.game.table import GameController
from dmplay.records import ProblemRecord, load_records
from dmplay.reports.records import report_records
from dmplay.words.commands import run_line
from tests.support.games import altered

DILEMMA = GameRequest("prisoners-dilemma", seed=7)
BABY = GameRequest("crying-baby", seed=7)
ANY = [(DILEMMA, "c"), (BABY, "f"), (GameRequest("simple-regulator", seed=7), "0.1")]


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where records are kept."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    records._warn_once.cache_clear()
    return tmp_path / "state" / "dmplay" / "records.json"


def played(wanted: GameRequest, *lines: str) -> Path:
    """Plays a game by typed lines, and leaves it."""
    table = GameController(on_game_end=records.record_finished_game)
    table.set_game(start_game(wanted))
    path = table.game.transcript_path
    for line in lines:
        run_line(table, line)
    table.end_game()
    assert path
    return path


def best(wanted: GameRequest, *lines: str) -> float | None:
    """What is best once this game was played too."""
    played(wanted, *lines)
    found = [one.best and one.best.discounted_return for one in load_records()]
    return found[-1] if found else None


@pytest.mark.parametrize(("wanted", "action"), ANY)
def test_a_game_that_a_person_played_to_its_end_is_the_last_and_the_best(
    wanted: GameRequest, action: str
) -> None:
    path = played(wanted, *[action] * 20 if wanted is not DILEMMA else [action] * 10)
    told = json.loads(path.read_text().splitlines()[-1].removeprefix("end: "))
    [record] = load_records()
    assert record.best == record.last
    assert record.last.discounted_return == told["return"][record.seat]
    assert (record.last.turns, record.last.seed) == (told["turns"], 7)


def test_the_best_is_the_one_of_most_return_and_the_last_is_the_last() -> None:
    for worth, line in ((-30.0, "d"), (-10.0, "c"), (-10.0, "d")):
        assert best(DILEMMA, *["d", *[line] * 9] if line == "d" else ["c"] * 10) in (worth, -27.0)
    [record] = load_records()
    assert record.best
    assert (record.best.discounted_return, record.last.discounted_return) == (-10, -27)


def test_each_variant_parameter_turn_limit_and_seat_has_a_best_of_its_own() -> None:
    for wanted in (
        GameRequest("prisoners-dilemma", turns=2),
        GameRequest("prisoners-dilemma", turns=3),
        GameRequest("prisoners-dilemma", settings=["discount=0.5"]),
        GameRequest("prisoners-dilemma", agent="tit-for-tat", seats=["agent2=human"], turns=2),
    ):
        played(wanted, *["c"] * (wanted.turns or 10))
    assert {(one.turns, *one.parameters, one.seat) for one in load_records()} == {
        (2, "agent1"), (3, "agent1"), (None, "discount", "agent1"), (2, "agent2"),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("wanted", "lines"),
    [
        (DILEMMA, ["hint", *["c"] * 10]),
        (BABY, ["hint", *["f"] * 20]),
        (DILEMMA, ["c", "undo", *["c"] * 10]),
        (DILEMMA, ["c", "reroll", *["c"] * 9]),
        (DILEMMA, ["c", "restart", *["c"] * 10]),
        (DILEMMA, ["c", "seed 7", *["c"] * 10]),
        (replace(BABY, reveal=True), ["f"] * 20),
        (GameRequest("simple-regulator", seed=7, ghost_agent="optimal"), ["0.1"] * 20),
    ],
)
def test_a_game_with_help_or_played_anew_or_revealed_is_the_last_and_no_best(
    wanted: GameRequest, lines: list[str]
) -> None:
    if lines[0] == "hint" and wanted is DILEMMA:
        wanted = replace(wanted, problem="rock-paper-scissors")
        lines = ["hint", *["r"] * 10]
    assert best(wanted, *lines) is None
    assert load_records()[0].last.turns >= 10


def test_a_game_begun_again_is_no_best_though_it_was_left_and_resumed() -> None:
    table = GameController(on_game_end=records.record_finished_game)
    table.set_game(start_game(DILEMMA))
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


def left_behind(wanted: GameRequest, *lines: str, torn: str = "") -> Path:
    """The file of a game whose program was killed after these lines, cut behind what is torn."""
    table = GameController()
    table.set_game(start_game(wanted))
    for line in lines:
        run_line(table, line)
    recorder = table.game.recorder
    assert recorder
    recorder.close()  # what a kill leaves: no end line, and nobody who keeps it
    content = recorder.path.read_text()
    recorder.path.write_text(content[: content.index(torn) + len(torn)] if torn else content)
    return recorder.path


@pytest.mark.parametrize(
    ("wanted", "lines", "torn"),
    [
        (DILEMMA, ["c", "restart", "c"], ""),
        (DILEMMA, ["c", "reroll"], ""),
        (DILEMMA, ["c", "reroll"], "reroll: 1\n\n"),
        (replace(DILEMMA, ghost_agent="tit-for-tat"), ["c"], ""),
    ],
)
def test_what_keeps_a_game_from_being_the_best_is_seen_though_its_program_was_killed(
    wanted: GameRequest, lines: list[str], torn: str
) -> None:
    path = left_behind(wanted, *lines, torn=torn)
    table = GameController(on_game_end=records.record_finished_game)
    table.set_game(start_game(ResumeRequest(path)))
    while not table.game.session.over:
        run_line(table, "c")
    table.end_game()
    assert [one.best for one in load_records()] == [None]


def test_a_game_left_for_another_of_its_dice_is_no_best_once_it_is_gone_on_with() -> None:
    table = GameController(on_game_end=records.record_finished_game)
    table.set_game(start_game(DILEMMA))
    first = table.game.transcript_path
    assert first
    for line in ("c", "restart", *["c"] * 10):
        run_line(table, line)
    table.set_game(start_game(ResumeRequest(first)))
    for _ in range(9):
        run_line(table, "c")
    table.end_game()
    assert [one.best for one in load_records()] == [None]


@pytest.mark.parametrize(
    ("wanted", "lines"),
    [
        (DILEMMA, ["c"] * 9),
        (replace(DILEMMA, other_agent="grim"), ["c"] * 10),
        (replace(DILEMMA, other_agent="human"), ["c"] * 20),
        (replace(DILEMMA, agent="random", keep_save=True), ["auto"]),
    ],
)
def test_a_game_left_or_against_others_or_of_nobody_is_not_kept(
    wanted: GameRequest, lines: list[str]
) -> None:
    played(wanted, *lines)
    assert load_records() == []


def test_a_branch_is_marked_and_never_the_best_not_even_once_it_was_left() -> None:
    first = played(replace(DILEMMA, record_path=Path("a.dmt")), *["c"] * 10)
    table = GameController(on_game_end=records.record_finished_game)
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


def test_a_game_that_is_gone_on_with_counts_and_one_that_was_altered_does_not() -> None:
    for name, counts in (("a.dmt", True), ("b.dmt", False)):
        path = Path(name)
        table = GameController(on_game_end=records.record_finished_game)
        table.set_game(start_game(replace(DILEMMA, other_agent="tit-for-tat", record_path=path)))
        for line in ["c", *["d"] * 4]:
            run_line(table, line)
        table.end_game("interrupted")
        if not counts:
            altered(
                path,
                '"agent1": "cooperate", "agent2": "cooperate"',
                '"agent1": "defect", "agent2": "cooperate"',
            )
        before = [one.best for one in load_records()]
        table.set_game(start_game(ResumeRequest(path)))
        for _ in range(5):
            run_line(table, "c")
        table.end_game()
        assert (before != [one.best for one in load_records()]) == counts


def test_a_recording_that_is_looked_at_is_no_game() -> None:
    path = played(replace(DILEMMA, record_path=Path("a.dmt")), *["c"] * 10)
    before = load_records()
    table = GameController(on_game_end=records.record_finished_game)
    table.set_game(start_game(ReplayRequest(path)))
    run_line(table, "auto")
    table.end_game()
    assert load_records() == before


def test_only_their_owner_reads_records_and_games_that_end_at_once_lose_nothing(
    place: Path,
) -> None:
    paths = [
        played(replace(DILEMMA, turns=n, record_path=Path(f"{n}.dmt")), *["c"] * n) for n in (1, 2)
    ]
    assert place.stat().st_mode & 0o777 == 0o600
    place.unlink()
    tables = [GameController(on_game_end=records.record_finished_game) for _ in range(12)]
    for number, table in enumerate(tables, 1):
        table.set_game(
            start_game(replace(DILEMMA, turns=number, record_path=Path(f"x{number}.dmt")))
        )
        for _ in range(number):
            run_line(table, "c")
    threads = [Thread(target=table.end_game) for table in tables]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert {one.turns for one in load_records()} == {*range(1, 13)}
    assert len(paths) == 2


@pytest.mark.parametrize(
    "content",
    [
        "", "{", "[]", "null", "7", '{"dmplay": 2, "records": []}',
        '{"dmplay": 1, "records": [{}]}', '{"dmplay": 1, "records": 7}', '{"dmplay": 1}',
        "[" * 100_000, "\x00\xff",
        '{"dmplay": 1, "records": [{"problem": "catch", "parameters": {}, "turns": null, "seat": '
        '"agent", "best": null, "last": {"return": NaN, "turns": 1, "seed": 1, "day": ""}}]}',
    ],
)  # fmt: skip
def test_a_file_that_holds_something_else_is_one_warning_and_begins_anew(
    content: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place.parent.mkdir(parents=True)
    place.write_bytes(content.encode("latin-1"))
    assert load_records() == []
    played(DILEMMA, *["c"] * 10)
    assert capsys.readouterr().err == f"warning: {place} holds no records; they begin anew\n"
    assert [one.last.discounted_return for one in load_records()] == [-10]


def test_where_records_cannot_be_written_a_game_ends_as_ever(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place.mkdir(parents=True)
    played(replace(DILEMMA, record_path=Path("a.dmt")), *["c"] * 10)
    told = capsys.readouterr().err.splitlines()
    assert len(told) <= 2
    assert all(row.startswith("warning: ") for row in told)


def test_who_waits_for_a_lock_goes_on_once_it_is_free(tmp_path: Path) -> None:
    done = []

    def wait() -> None:
        with disk.exclusive_lock(tmp_path / "lock"):
            done.append("second")

    with disk.exclusive_lock(tmp_path / "lock"):
        other = Thread(target=wait)
        other.start()
        done.append("first")
    other.join()
    assert done == ["first", "second"]


def test_records_are_told_as_a_table_and_as_data() -> None:
    assert report_records(json=False) == "no game was played to its end"
    assert report_records(json=True) == "[]"
    played(replace(DILEMMA, turns=2), *["c"] * 2)
    played(GameRequest("rock-paper-scissors", seed=1), "hint", *["r"] * 10)
    head, first, second = report_records(json=False).splitlines()
    assert head.split() == ["problem", "seat", "best", "turns", "seed", "day", "last"]
    assert first.split()[:7] == ["prisoners-dilemma", "--turns", "2", "agent1", "-2", "2", "7"]
    assert second.split()[:3] == ["rock-paper-scissors", "agent1", "-"]
    told = json.loads(report_records(json=True))
    assert [one["problem"] for one in told] == ["prisoners-dilemma", "rock-paper-scissors"]
    assert told[0]["best"]["return"] == -2
    assert told[1]["best"] is None


def test_the_record_of_a_game_in_play_is_that_of_its_kind() -> None:
    wanted = GameRequest("hexworld:straight-line", settings=["slip=0.2"], turns=2, seed=7)
    played(wanted, "e", "e")
    table = GameController()
    table.set_game(start_game(replace(wanted, seed=8)))
    found = records.record_for_game(table.game)
    assert isinstance(found, ProblemRecord)
    assert found.last.seed == 7
    table.set_game(start_game(replace(wanted, settings=[])))
    assert records.record_for_game(table.game) is None
    table.set_game(start_game(replace(wanted, agent="random")))
    assert records.record_for_game(table.game) is None
