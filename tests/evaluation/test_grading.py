"""Tests of `dmplay grade`: how well people played, and which transcripts are not honest."""

import csv
import io
import json
import shutil
import stat
from collections.abc import Sequence
from pathlib import Path

import pytest

import dmplay
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.evaluation.assignment import read_assignment
from dmplay.evaluation.grading import GRADING_LIMITS, Grade, GradingReport, grade_files
from dmplay.game import transcript_verification
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game, start_new_game
from dmplay.game.launch_requests import BranchRequest, GameRequest
from dmplay.output.grading_report import format_grades
from dmplay.ui.shell.commands import run_line
from tests.support.programs import run_dmplay, run_unprivileged, run_wrapped

ASSIGNMENT_TEXT = (
    'dmplay: 1\nproblem: "hexworld"\nseats: {"agent": "human"}\nseeds: [7, 8]\nturns: 3\n'
)
COMMANDS_BY_GAME: dict[str, Sequence[str]] = {
    "plain": ("e", "ne", "w"),
    "helped": ("hint", "e", "undo", "e", "reroll", "values", "e", "undo 2", "sw"),
    "another": ("w", "w", "ne"),
}


def record_game(path: Path, commands: Sequence[str], **options: object) -> None:
    """Record a hexworld game in which these commands are typed, then quit it."""
    fields = {"problem": "hexworld", "seed": 7, "turns": 3, "record_path": path} | options
    table = GameController(start_new_game(GameRequest(**fields)))  # type: ignore[arg-type]
    for command in commands:
        run_line(table, command)
    table.end_game()


def edit_transcript(path: Path, before: str, after: str, *, update_checksum: bool = True) -> None:
    """Replace text in a transcript as a cheater would, with or without a new checksum."""
    content = path.read_text()
    assert before in content
    path.write_text(content.replace(before, after))
    if update_checksum:
        transcript_verification.rewrite_file(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Games that were handed in, each in a different way."""
    games_folder = tmp_path_factory.mktemp("games")
    for name, commands in COMMANDS_BY_GAME.items():
        record_game(games_folder / f"{name}.dmt", commands, player="Ada")
    record_game(
        games_folder / "other.dmt", ("e",), seed=9, turns=4, settings=["slip=0.1"], player="Bob"
    )
    record_game(games_folder / "strict.dmt", ("e",), seed=8, strict="hints", player="Eve")
    record_game(games_folder / "ghost.dmt", ("e",), seed=8, ghost_agent="random", episode=1)
    record_game(games_folder / "left.dmt", ("feed",), problem="crying-baby", reveal=True)
    shutil.copy(games_folder / "plain.dmt", games_folder / "copied.dmt")
    edit_transcript(games_folder / "copied.dmt", '"Ada"', '"Bob"')
    shutil.copy(games_folder / "plain.dmt", games_folder / "better.dmt")
    edit_transcript(games_folder / "better.dmt", "return", "returm", update_checksum=False)
    record_game(games_folder / "nobody.dmt", ("e",), seed=5)
    edit_transcript(games_folder / "nobody.dmt", '"human"', '"optimall"', update_checksum=False)
    (games_folder / "torn.dmt").write_text("dmplay: 1\n")
    record_game(games_folder / "agent.dmt", (), seed=12, agent="optimal", turns=5)
    branching = BranchRequest(
        games_folder / "plain.dmt", turn=2, record_path=games_folder / "branched.dmt"
    )
    start_game(branching).finish()
    bot = start_new_game(
        GameRequest("2048", seed=3, agent="random", turns=6, record_path=games_folder / "bot.dmt")
    )
    assert len([*bot.iter_agent_turns()]) == 6
    bot.finish()
    edit_transcript(games_folder / "bot.dmt", '"random"', '"human"')
    return games_folder


@pytest.fixture(scope="module")
def report(folder: Path) -> GradingReport:
    """The grades of these games, checked against an assignment."""
    (folder / "walks").write_text(ASSIGNMENT_TEXT)
    return grade_files(
        [*transcript_verification.iter_transcript_files([folder])],
        read_assignment(folder / "walks"),
    )


@pytest.fixture(scope="module")
def grades(report: GradingReport) -> dict[str, Grade]:
    """The grades by file stem."""
    return {Path(grade.path).stem: grade for grade in report.grades}


def get_stems(paths: Sequence[str]) -> list[str]:
    return [Path(path).stem for path in paths]


def test_a_game_is_graded_by_return_and_regret(grades: dict[str, Grade]) -> None:
    grade = grades["plain"]
    assert (grade.verified, grade.player, grade.turns) == (True, "Ada", 3)
    assert grade.end_reason == "turn limit"
    assert grade.discounted_return == -0.9
    regrets = [move.regret or 0.0 for move in dmplay.review(grade.path)]
    assert grade.regret is not None
    assert grade.regret == pytest.approx(regrets[0] + 0.9 * regrets[1] + 0.81 * regrets[2])
    assert sum(regrets) > grade.regret > 0
    assert (grade.valued_count, grade.undone_turn_count, grade.reroll_count, grade.hint_count) == (
        3,
        0,
        0,
        0,
    )


def test_undos_rerolls_and_hints_are_counted(grades: dict[str, Grade]) -> None:
    grade = grades["helped"]
    assert (grade.undone_turn_count, grade.reroll_count, grade.hint_count, grade.strict) == (
        3,
        1,
        2,
        False,
    )
    assert grades["strict"].strict == "hints"


def test_a_regret_of_estimated_values_is_marked(tmp_path: Path) -> None:
    path = tmp_path / "car.dmt"
    rocks = [*["left"] * 23, *["right"] * 57]
    record_game(path, rocks, problem="mountain-car", turns=None)
    (grade,) = grade_files([path]).grades
    assert grade.end_reason == "terminal"
    assert grade.regret is not None
    assert grade.remarks[:2] == ("regret (if optimal plays on)", "estimated regret")


def test_an_unverified_game_has_neither_return_nor_regret(grades: dict[str, Grade]) -> None:
    messages = {"better": "return: expected null", "torn": "cut off before", "nobody": "'optimall'"}
    for name, message in messages.items():
        grade = grades[name]
        assert (grade.verified, grade.discounted_return, grade.regret) == (False, None, None)
        assert message in grade.fault


def test_a_copy_under_another_name_is_the_same_game(grades: dict[str, Grade]) -> None:
    assert grades["copied"].verified
    assert get_stems(grades["copied"].identical_files) == ["better", "plain"]
    assert "copied" in get_stems(grades["plain"].identical_files)


def test_other_attempts_with_the_same_seed_are_reported(grades: dict[str, Grade]) -> None:
    assert get_stems(grades["another"].other_attempts) == ["better", "branched", "helped", "plain"]
    assert grades["strict"].other_attempts == ()


def test_an_agent_handed_in_as_a_person_is_detected_by_its_actions(
    grades: dict[str, Grade],
) -> None:
    assert grades["bot"].verified
    assert grades["bot"].remarks == (
        "no regret, because the values are not exactly about this game",
        "same actions as random",
    )
    assert (grades["agent"].occupant, grades["agent"].regret) == ("optimal", None)


@pytest.mark.parametrize("player", ["human", "mcp", "bot:walk"])
def test_people_language_models_and_programs_have_the_same_regret(
    tmp_path: Path, player: str
) -> None:
    path = tmp_path / "g.dmt"
    record_game(path, ("e", "e", "e"), turns=3, player="Ada")
    edit_transcript(path, '"human"', f'"{player}"')
    (grade,) = grade_files([path]).grades
    regrets = [move.discounted_regret for move in dmplay.review(path)]
    assert (grade.occupant, grade.best_count) == (player, regrets.count(0.0))
    assert grade.regret == pytest.approx(sum(regrets))
    assert sum(regrets) > 0


def test_marks_show_ghosts_revealed_states_and_branches(grades: dict[str, Grade]) -> None:
    assert grades["ghost"].remarks == ("ghost random",)
    assert grades["left"].remarks == ("hidden state shown",)
    assert grades["branched"].remarks == ("branched at turn 2",)


def test_differences_from_the_assignment_are_reported(grades: dict[str, Grade]) -> None:
    assert grades["plain"].assignment_differences == ()
    assert grades["other"].assignment_differences == ("parameters", "turns", "seed")
    assert grades["ghost"].assignment_differences == ("episode",)
    assert grades["agent"].assignment_differences == ("turns", "seed", "seats")
    assert grades["left"].assignment_differences == ("problem",)


def test_missing_games_of_each_player_are_reported(report: GradingReport) -> None:
    assert report.missing_seeds == {"Ada": [8], "Bob": [8], "Eve": [7, 8]}


def test_an_unfinished_game_with_hidden_states_reveals_no_return(
    folder: Path, tmp_path: Path
) -> None:
    content = (folder / "left.dmt").read_text().replace("reveal: true\n", "")
    (tmp_path / "kept.dmt").write_text(content[: content.index("end:")])
    ((grade,), _, _) = grade_files([tmp_path / "kept.dmt"])
    assert (grade.verified, grade.end_reason, grade.discounted_return) == (
        False,
        "unfinished",
        None,
    )


def test_interrupted_grading_returns_the_finished_grades(folder: Path) -> None:
    def stop(share: float) -> None:
        raise KeyboardInterrupt

    files = [folder / "plain.dmt", folder / "copied.dmt"]
    partial = grade_files(files, progress=stop)
    assert (len(partial.grades), partial.file_count) == (1, 1)


def test_the_table_states_the_limits_of_grading(report: GradingReport) -> None:
    head, blank, columns, *rows = format_grades(report, report.file_count).splitlines()
    assert not any(" ; " in row for row in rows)  # a torn file has no known ending
    unfinished = "7 of them unfinished (no return)"
    assert (head, blank) == (f"14 games, 11 verified, {unfinished}", "")
    assert columns.split()[:5] == ["file", "player", "game", "verified", "return"]
    assert any("unfinished (quit); not as assigned: parameters, turns, seed" in row for row in rows)
    assert "Bob has no finished game with seed 8" in rows
    assert " ".join(rows).endswith(GRADING_LIMITS)
    head = format_grades(report, 20).partition("\n")[0]
    assert head == f"14 games, 11 verified, {unfinished}; interrupted after 14 of 20 files"


def test_grades_are_written_as_json_and_csv(folder: Path, report: GradingReport) -> None:
    data = json.loads(str(interpret_command(["grade", str(folder / "plain.dmt"), "--json"])))
    assert data["proves"] == GRADING_LIMITS
    assert (data["games"][0]["player"], data["games"][0]["return"]) == ("Ada", -0.9)
    rows = [*csv.DictReader(format_grades(report, 14, "csv").splitlines())]
    assert len([row for row in rows if row["ending"] != "missing"]) == 14
    assert (
        next(row for row in rows if row["marks"])["marks"]
        == "no regret, because the values are not exactly about this game, same actions as random"
    )


@pytest.mark.parametrize("turns_before_leaving", [0, 1, 5])
@pytest.mark.parametrize("end_reason", ["quit", "illegal", "interrupted"])
def test_leaving_a_costly_game_early_earns_no_return(
    tmp_path: Path, turns_before_leaving: int, end_reason: str
) -> None:
    """A whole game with the baby costs more than any part of it."""
    path = tmp_path / "left.dmt"
    request = GameRequest("crying-baby", seed=7, turns=6, player="Max", record_path=path)
    table = GameController(start_new_game(request))
    for _ in range(turns_before_leaving):
        run_line(table, "ignore")
    table.game.finish(end_reason)
    ((grade,), _, _) = report = grade_files([path])
    assert (grade.verified, grade.end_reason, grade.is_finished) == (True, end_reason, False)
    assert (grade.discounted_return, grade.regret, grade.valued_count) == (None, None, 0)
    row = format_grades(report, 1).splitlines()[3]
    assert f"unfinished ({end_reason})" in row
    data = json.loads(format_grades(report, 1, "json"))
    assert (data["games"][0]["return"], data["games"][0]["regret"]) == (None, None)
    (cells,) = csv.DictReader(format_grades(report, 1, "csv").splitlines())
    assert (cells["return"], cells["regret"], cells["ending"]) == ("", "", end_reason)


def test_an_unfinished_game_of_the_assignment_is_missing(tmp_path: Path) -> None:
    (tmp_path / "walks").write_text(ASSIGNMENT_TEXT)
    record_game(tmp_path / "left.dmt", ("e",), player="Max")
    record_game(tmp_path / "whole.dmt", ("w", "w", "w"), player="Max", seed=8)
    report = grade_files(
        [tmp_path / "left.dmt", tmp_path / "whole.dmt"], read_assignment(tmp_path / "walks")
    )
    assert [grade.assignment_differences for grade in report.grades] == [(), ()]
    assert [grade.discounted_return is None for grade in report.grades] == [True, False]
    assert report.missing_seeds == {"Max": [7]}
    assert "Max has no finished game with seed 7" in format_grades(report, 2)


@pytest.mark.parametrize(
    ("player", "displayed_name"),
    [
        ("Max" + " " * 60 + "hexworld 7  yes       9", "Max hexworld 7 yes 9"),
        ("Max\nzoe.dmt  Zoe  hexworld 7  yes", "Max\\nzoe.dmt Zoe hexworld 7 yes"),
        ("Max\u2800\u2800\u3164\u3164yes", "Max yes"),
        ("Max\u202eseY", "Max\\u202eseY"),
        ("Max\u00a0\u2003Z\x1b[2J\x85", "Max\\xa0\\u2003Z\\x1b[2J\\x85"),
        ("M" * 500, "M" * 37 + "..."),
        ("\u5b57" * 30, "\u5b57" * 18 + "..."),
        ("a" + "\u0301" * 500, "a" + "\u0301" * 36 + "..."),
        ("Jo", "Jo"),
        ("   ", "human"),
    ],
)
def test_a_player_s_name_cannot_look_like_other_columns_or_rows(
    tmp_path: Path, player: str, displayed_name: str
) -> None:
    record_game(tmp_path / "max.dmt", ("e",), player=player)
    (tmp_path / "walks").write_text(ASSIGNMENT_TEXT)
    report = grade_files([tmp_path / "max.dmt"], read_assignment(tmp_path / "walks"))
    text = format_grades(report, 1)
    head, _, _, row, _, missing, *_ = text.splitlines()
    assert head == "1 game, 1 verified, 1 of them unfinished (no return)"
    assert row.split("  ")[1] == displayed_name
    missing_name = "" if displayed_name == "human" else displayed_name
    assert missing == f"{missing_name} has no finished game with seed 7, 8"
    assert json.loads(format_grades(report, 1, "json"))["games"][0]["player"] == player


def test_text_that_a_spreadsheet_would_run_is_prefixed_in_csv(tmp_path: Path) -> None:
    for number, player in enumerate(
        ["=1+1", "+1+1", "-1+1", "@SUM(1)", "\t=1", "\r=1", "Al\r=1", "-5", "Jo"]
    ):
        record_game(tmp_path / f"{number}.dmt", (), player=player)
    report = grade_files(sorted(tmp_path.glob("*.dmt")))
    text = format_grades(report, 9, "csv")
    rows = [*csv.DictReader(io.StringIO(text, newline=""))]
    players = [row["player"] for row in rows]
    assert players == [
        "'=1+1",
        "'+1+1",
        "'-1+1",
        "'@SUM(1)",
        "'\t'=1",
        "'\r'=1",
        "Al\r'=1",
        "-5",
        "Jo",
    ]
    assert '"Al\r\'=1"' in text


@pytest.mark.parametrize("extra_args", [[], ["--csv"], ["--json"]])
def test_a_path_without_a_transcript_is_named_and_the_others_are_graded(
    tmp_path: Path, extra_args: list[str]
) -> None:
    (tmp_path / "ada").mkdir()
    record_game(tmp_path / "ada" / "game.dmt", COMMANDS_BY_GAME["plain"], player="Ada")
    for name in ("bo", "shut"):
        (tmp_path / name).mkdir()
    (tmp_path / "shut").chmod(0)
    paths = ["ada", "bo", "cy", "shut"]
    outcome = run_wrapped(run_unprivileged, tmp_path, "grade", *paths, *extra_args)
    (tmp_path / "shut").chmod(stat.S_IRWXU)
    assert outcome.returncode == 3
    assert "Permission denied" in outcome.stdout
    assert not outcome.stderr
    assert "no .dmt file in this folder" in outcome.stdout
    assert "no such file or folder" in outcome.stdout
    assert "Ada" in outcome.stdout
    headline = "1 game, 1 verified; 3 paths without a transcript\n"
    assert bool(extra_args) or outcome.stdout.startswith(headline)
    assert run_dmplay(tmp_path, "grade", paths[0]).returncode == 0
    assert run_dmplay(tmp_path, "grade", paths[1]).returncode == 2


def test_a_file_that_does_not_verify_gives_an_exit_code(tmp_path: Path) -> None:
    record_game(tmp_path / "plain.dmt", COMMANDS_BY_GAME["plain"], player="Ada")
    (tmp_path / "torn.dmt").write_text("dmplay: 1\n")
    assert run_dmplay(tmp_path, "grade", ".").returncode == 3


def test_missing_games_are_rows_of_the_csv(report: GradingReport) -> None:
    rows = csv.DictReader(io.StringIO(format_grades(report, len(report.grades), "csv")))
    missing = [
        (row["player"], row["seed"], row["verified"]) for row in rows if row["ending"] == "missing"
    ]
    assert missing == [
        ("Ada", "8", "False"),
        ("Bob", "8", "False"),
        ("Eve", "7", "False"),
        ("Eve", "8", "False"),
    ]
