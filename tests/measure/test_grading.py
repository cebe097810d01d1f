"""`dmplay grade`: how well people played what they handed in, and what of it is not honest."""

import csv
import json
import shutil
from collections.abc import Sequence
from pathlib import Path

import pytest

from dmplay.cli.errands import interpret_command
from dmplay.game import checking
from dmplay.game.request import BranchRequest, GameRequest
from dmplay.game.start import start_game, start_new_game
from dmplay.game.table import GameController
from dmplay.measure.assignment import read_assignment
from dmplay.measure.grading import GRADING_LIMITS, Grade, GradingReport, grade_files
from dmplay.reports.grading import format_grades
from dmplay.words.commands import run_line

WALKS = 'dmplay: 1\nproblem: "hexworld"\nseats: {"agent": "human"}\nseeds: [7, 8]\n'
WORDS: dict[str, Sequence[str]] = {
    "plain": ("e", "ne", "w"),
    "helped": ("hint", "e", "undo", "e", "reroll", "values", "e", "undo 2", "sw"),
    "another": ("w", "w", "ne"),
}


def play(path: Path, words: Sequence[str], **more: object) -> None:
    """Records a game of hex world in which these words are typed, and which is left then."""
    told = {"problem": "hexworld", "seed": 7, "record_path": path} | more
    table = GameController(start_new_game(GameRequest(**told)))  # type: ignore[arg-type]
    for word in words:
        run_line(table, word)
    table.end_game()


def edited(path: Path, before: str, after: str, *, anew: bool = True) -> None:
    """Changes a transcript as somebody would who hides it: with its checksum, or without."""
    content = path.read_text()
    assert before in content
    path.write_text(content.replace(before, after))
    if anew:
        checking.rewrite_file(path)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Games that were handed in, each in another way."""
    place = tmp_path_factory.mktemp("games")
    for name, words in WORDS.items():
        play(place / f"{name}.dmt", words, player="Ada")
    play(place / "other.dmt", ("e",), seed=9, turns=4, settings=["slip=0.1"], player="Bob")
    play(place / "strict.dmt", ("e",), seed=8, strict="hints", player="Eve")
    play(place / "ghost.dmt", ("e",), seed=8, ghost_agent="random", episode=1)
    play(place / "left.dmt", ("feed",), problem="crying-baby", reveal=True)
    shutil.copy(place / "plain.dmt", place / "copied.dmt")
    edited(place / "copied.dmt", '"Ada"', '"Bob"')
    shutil.copy(place / "plain.dmt", place / "better.dmt")
    edited(place / "better.dmt", "return", "returm", anew=False)
    play(place / "nobody.dmt", ("e",), seed=5)
    edited(place / "nobody.dmt", '"human"', '"optimall"', anew=False)
    (place / "torn.dmt").write_text("dmplay: 1\n")
    play(place / "agent.dmt", (), seed=12, agent="optimal", turns=5)
    branching = BranchRequest(place / "plain.dmt", turn=2, record_path=place / "branched.dmt")
    start_game(branching).finish()
    bot = start_new_game(
        GameRequest("2048", seed=3, agent="random", turns=6, record_path=place / "bot.dmt")
    )
    assert len([*bot.iter_agent_turns()]) == 6
    bot.finish()
    edited(place / "bot.dmt", '"random"', '"human"')
    return place


@pytest.fixture(scope="module")
def found(folder: Path) -> GradingReport:
    """Their grades, as games of an assignment."""
    (folder / "walks").write_text(WALKS)
    return grade_files(
        [*checking.iter_transcript_files([folder])], read_assignment(folder / "walks")
    )


@pytest.fixture(scope="module")
def grades(found: GradingReport) -> dict[str, Grade]:
    """The grades by the names of their files."""
    return {Path(one.path).stem: one for one in found.grades}


def names(paths: Sequence[str]) -> list[str]:
    return [Path(path).stem for path in paths]


def test_a_game_is_graded_by_return_and_regret(grades: dict[str, Grade]) -> None:
    one = grades["plain"]
    assert (one.verified, one.player, one.turns, one.end_reason) == (True, "Ada", 3, "quit")
    assert one.discounted_return == -0.9
    assert one.regret is not None
    assert one.regret > 0
    assert (one.valued_count, one.undone_turn_count, one.reroll_count, one.hint_count) == (
        3,
        0,
        0,
        0,
    )


def test_what_was_taken_back_thrown_again_and_hinted_is_counted(grades: dict[str, Grade]) -> None:
    one = grades["helped"]
    assert (one.undone_turn_count, one.reroll_count, one.hint_count, one.strict) == (3, 1, 2, False)
    assert grades["strict"].strict == "hints"


def test_what_does_not_hold_has_neither_return_nor_regret(grades: dict[str, Grade]) -> None:
    faults = {"better": "return: expected null", "torn": "torn before", "nobody": "'optimall'"}
    for name, fault in faults.items():
        one = grades[name]
        assert (one.verified, one.discounted_return, one.regret) == (False, None, None)
        assert fault in one.fault


def test_a_copy_under_another_name_is_the_same_game(grades: dict[str, Grade]) -> None:
    assert grades["copied"].verified
    assert names(grades["copied"].identical_files) == ["better", "plain"]
    assert "copied" in names(grades["plain"].identical_files)


def test_who_tried_the_same_dice_again_is_told(grades: dict[str, Grade]) -> None:
    assert names(grades["another"].other_attempts) == ["better", "branched", "helped", "plain"]
    assert grades["strict"].other_attempts == ()


def test_an_agent_that_was_handed_in_as_a_person_is_known_by_its_moves(
    grades: dict[str, Grade],
) -> None:
    assert grades["bot"].verified
    assert grades["bot"].remarks == ("as random plays",)
    assert (grades["agent"].occupant, grades["agent"].regret) == ("optimal", None)


def test_how_a_game_was_played_is_told(grades: dict[str, Grade]) -> None:
    assert grades["ghost"].remarks == ("ghost random",)
    assert grades["left"].remarks == ("hidden state shown",)
    assert grades["branched"].remarks == ("branched at turn 2",)


def test_what_was_not_assigned_is_told(grades: dict[str, Grade]) -> None:
    assert grades["plain"].assignment_differences == ()
    assert grades["other"].assignment_differences == ("parameters", "turns", "seed")
    assert grades["ghost"].assignment_differences == ("episode",)
    assert grades["agent"].assignment_differences == ("turns", "seed", "seats")
    assert grades["left"].assignment_differences == ("problem",)


def test_what_a_player_lacks_is_told(found: GradingReport) -> None:
    assert found.missing_seeds == {"Ada": [8], "Bob": [8], "Eve": [7]}


def test_a_secret_game_that_can_be_played_on_tells_nothing(folder: Path, tmp_path: Path) -> None:
    content = (folder / "left.dmt").read_text().replace("reveal: true\n", "")
    (tmp_path / "kept.dmt").write_text(content[: content.index("end:")])
    ((one,), _, _) = grade_files([tmp_path / "kept.dmt"])
    assert (one.verified, one.end_reason, one.discounted_return) == (False, "unfinished", None)


def test_grading_is_interrupted_with_what_was_graded(folder: Path) -> None:
    def stop(share: float) -> None:
        raise KeyboardInterrupt

    files = [folder / "plain.dmt", folder / "copied.dmt"]
    some = grade_files(files, progress=stop)
    assert (len(some.grades), some.file_count) == (1, 1)


def test_the_table_says_what_no_file_proves(found: GradingReport) -> None:
    head, blank, columns, *rows = format_grades(found, found.file_count).splitlines()
    assert not any(" ; " in row for row in rows)  # of a torn file no ending is known
    assert (head, blank) == ("14 games, 11 verified", "")
    assert columns.split()[:5] == ["file", "player", "game", "verified", "return"]
    assert any("quit; not as assigned: parameters, turns, seed" in row for row in rows)
    assert "Bob has no game of seed 8" in rows
    assert " ".join(rows).endswith(GRADING_LIMITS)
    head = format_grades(found, 20).partition("\n")[0]
    assert head == "14 games, 11 verified; interrupted after 14 of 20 files"


def test_the_grades_are_told_as_data(folder: Path, found: GradingReport) -> None:
    data = json.loads(str(interpret_command(["grade", str(folder / "plain.dmt"), "--json"])))
    assert data["proves"] == GRADING_LIMITS
    assert (data["games"][0]["player"], data["games"][0]["return"]) == ("Ada", -0.9)
    rows = [*csv.DictReader(format_grades(found, 14, "csv").splitlines())]
    assert len(rows) == 14
    assert next(row for row in rows if row["marks"])["marks"] == "as random plays"
