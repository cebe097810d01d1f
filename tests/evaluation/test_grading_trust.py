"""Tests that grading imports the code of the assignment, and nothing that was handed in."""

import os
from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import BadParameter
from dmplay.evaluation.assignment import read_assignment
from dmplay.evaluation.grading import Grade, grade_files
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.game.player_records import GameResult, ProblemRecord
from dmplay.game.player_records import _is_verified as is_record_verified

SHOP_CODE = """
from dataclasses import dataclass
import numpy as np
from dmplay import Labels, Tables, Tabular
from dmplay.agents.base import SeatPolicy

@dataclass(frozen=True)
class Shop(Tabular):
    agents = ("buyer", "seller")
    actions = (Labels(("buy", "wait")), Labels(("buy", "wait")))
    state_names, initial_belief = ("open",), np.array([1.0])
    tables = Tables(np.ones((1, 4, 1)), np.ones((1, 4, 2)))

class Seller(SeatPolicy):
    def initial_memory(self, observation):
        return ()

    def update_memory(self, memory, percept):
        return ()

    def choose(self, memory, legal, draws):
        return np.ones(len(draws), int)
"""
IMPORT_TRACE = 'from pathlib import Path; Path("imported").write_text("x")\n'
EVIL_CODE = IMPORT_TRACE + SHOP_CODE


@pytest.fixture(autouse=True)
def _assignment_of_a_shop(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Hand out a shop with its seller, and play one game of it as Max does, in his folder."""
    monkeypatch.chdir(tmp_path)
    Path("shop.py").write_text(SHOP_CODE)
    Path("max").mkdir()
    Path("max", "shop.py").write_text(SHOP_CODE)
    assign = ["assign", "./shop.py", "--seat", "seller=./shop.py:Seller", "--seeds", "7"]
    interpret_command([*assign, "--turns", "2", "-o", "walks"])
    monkeypatch.chdir("max")
    game = start_new_game(
        GameRequest(
            "./shop.py",
            seats=["buyer=human", "seller=./shop.py:Seller"],
            seed=7,
            turns=2,
            player="Max",
            record_path=Path("max.dmt"),
        )
    )
    game.choose(0.0)
    game.choose(0.0)
    game.finish()
    monkeypatch.chdir(tmp_path)


def grade_handed_in(*, trusted: bool = True, changes: tuple[str, str] = ("", "")) -> Grade:
    """Return the grade of Max's game, with a text in its transcript replaced."""
    path = Path("max", "max.dmt")
    content = path.read_text()
    assert changes[0] in content
    path.write_text(content.replace(*changes) if changes[0] else content)
    return grade_files([path], read_assignment(Path("walks")), trusted=trusted).grades[0]


def test_a_game_is_graded_with_the_code_of_the_assignment_not_with_the_copy_beside_it() -> None:
    Path("max", "shop.py").write_text(EVIL_CODE)
    grade = grade_handed_in()
    assert (grade.verified, grade.fault, grade.assignment_differences) == (True, "", ())
    assert grade.discounted_return == 2
    assert not Path("imported").exists()


def test_no_copy_of_the_code_needs_to_be_handed_in() -> None:
    Path("max", "shop.py").unlink()
    assert grade_handed_in().verified
    assert not grade_handed_in(trusted=False).verified


def test_a_path_to_the_assigned_file_is_the_assigned_problem() -> None:
    grade = grade_handed_in(changes=('problem: "./shop.py"', 'problem: "../shop.py"'))
    assert grade.assignment_differences == ()
    assert not Path("imported").exists()


@pytest.mark.parametrize(
    "problem", ["./evil.py", "./shop.py:Shop", "evil:Shop", "evil.py", "gymnasium:evil", "./a/b.py"]
)
def test_another_problem_is_refused_before_it_is_imported(problem: str) -> None:
    for file in ("max/evil.py", "evil.py", "max/b.py"):
        Path(file).write_text(EVIL_CODE)
    grade = grade_handed_in(changes=('problem: "./shop.py"', f'problem: "{problem}"'))
    assert (grade.verified, grade.discounted_return) == (False, None)
    assert grade.assignment_differences == ("problem",)
    assert grade.fault.endswith(
        f": problem '{problem}' is not part of the assignment, so its code is not imported"
    )
    assert (grade.player, grade.problem) == ("Max", problem)
    assert not Path("imported").exists()


def test_an_unknown_variant_of_a_built_in_problem_is_named() -> None:
    grade = grade_handed_in(changes=('problem: "./shop.py"', 'problem: "hexworld:nothing"'))
    assert "unknown variant 'nothing'" in grade.fault
    assert "not imported" not in grade.fault


@pytest.mark.parametrize(
    "agent", ["./evil.py:Seller", "./shop.py:Other", "evil:Seller", "./shop.py:Seller:k=1"]
)
def test_another_agent_is_not_asked_again(agent: str) -> None:
    for file in ("max/evil.py", "evil.py"):
        Path(file).write_text(EVIL_CODE)
    Path("max", "shop.py").write_text(EVIL_CODE)
    grade = grade_handed_in(changes=("./shop.py:Seller", agent))
    assert grade.assignment_differences == ("seats",)
    assert not Path("imported").exists()


def test_a_folder_that_is_a_link_leads_to_no_other_code() -> None:
    Path("elsewhere", "below").mkdir(parents=True)
    Path("elsewhere", "shop.py").write_text(EVIL_CODE)
    os.symlink(Path("elsewhere", "below").resolve(), Path("max", "x"))
    grade_handed_in(changes=('problem: "./shop.py"', 'problem: "x/../../shop.py"'))
    assert not Path("imported").exists()


def test_a_data_file_beside_a_game_does_not_stand_for_the_assigned_one() -> None:
    tiger = "discount: 0.9\nstates: 1\nactions: a b\nobservations: 1\nT: * identity\n"
    tiger += "O: * uniform\nR: * : * : * : * {pay}\n"
    Path("tiger.pomdp").write_text(tiger.format(pay=1))
    Path("max", "tiger.pomdp").write_text(tiger.format(pay=9))
    interpret_command(
        ["assign", "./tiger.pomdp", "--seeds", "3", "--turns", "1", "-o", "walks", "--force"]
    )
    path = Path("max", "max.dmt")
    game = start_new_game(
        GameRequest(
            "./max/tiger.pomdp", seed=3, turns=1, player="Max", record_path=path, force=True
        )
    )
    game.choose(0.0)
    game.finish()
    assert '"tiger.pomdp"' in path.read_text()
    grade = grade_handed_in(changes=('"tiger.pomdp"', '"./tiger.pomdp"'))
    assert (grade.verified, grade.discounted_return) == (False, None)
    assert "reward: expected 9, got 1" in grade.fault


def test_trust_without_an_assignment_is_refused() -> None:
    Path("max", "shop.py").write_text(EVIL_CODE)
    with pytest.raises(BadParameter, match="--trust: add --assignment FILE"):
        interpret_command(["grade", "max", "--trust"])
    assert not Path("imported").exists()


def test_a_record_does_not_import_what_its_file_names_by_now() -> None:
    """A file in a shared folder may be exchanged between the game's end and its verification."""
    Path("evil.py").write_text(EVIL_CODE)
    path = Path("g.dmt")
    game = start_new_game(GameRequest("crying-baby", seed=3, turns=1, record_path=path))
    game.choose(0.0)
    game.finish()
    result = GameResult(0.0, 1, 3, "2026-11-24")
    record = ProblemRecord("crying-baby", {}, 1, "agent", result, best=result)
    assert is_record_verified(path, record)
    path.write_text(path.read_text().replace('"crying-baby"', '"./evil.py"'))
    assert not is_record_verified(path, record)
    assert not Path("imported").exists()
