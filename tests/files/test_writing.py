"""Files that are written: read again they are the same problem, and written again the same file."""

from pathlib import Path

import numpy as np
import pytest

from dmplay.core import Problem
from dmplay.dice import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.files import gambit, markov
from dmplay.files.writing import iter_problem_lines, make_valid_names
from dmplay.finding.problems import full_description, load_problem
from dmplay.reports.converting import convert_problem
from dmplay.session import Session
from dmplay.tabular import tabulate
from tests.files.sources import TIGER, ballet, kept, team, tiger

FINITE = {
    ".pomdp": ("crying-baby", "machine-replacement", "catch", "hexworld:straight-line"),
    ".mdp": ("hexworld",),
    ".dpomdp": ("crying-baby", "hexworld:straight-line", "collaborative-predator-prey:triangle"),
    ".nfg": ("prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma"),
}
AFTER = "R: open-left : tiger-right : tiger-left : * 30\n"


def again(text: str, suffix: str) -> Problem:
    """The problem that a written file holds."""
    if suffix == ".nfg":
        return gambit.read_nfg("x.nfg", text.encode())
    return markov.read_markov_file("x" + suffix, text.encode(), team=suffix == ".dpomdp")


def twice(problem: Problem, suffix: str) -> Problem:
    """The problem, written and read, of which the file is the same when it is written again."""
    text = "".join(iter_problem_lines(problem, suffix, full_description(problem)))
    found = again(text, suffix)
    assert "".join(iter_problem_lines(found, suffix, full_description(found))) == text
    return found


def test_every_finite_problem_is_written_read_and_written_the_same() -> None:
    for suffix, names in FINITE.items():
        for name in names:
            problem = load_problem(name)
            found = twice(problem, suffix)
            assert found.discount == problem.discount
            for one, other in zip(tabulate(problem), tabulate(found), strict=False):
                if one is not None:
                    assert other is not None
                    np.testing.assert_array_equal(one, other, name)


def test_files_are_written_as_they_were_read() -> None:
    for problem, suffix in (
        (tiger(), ".pomdp"),
        (tiger(("\nR: listen", "\n" + AFTER + "R: listen")), ".pomdp"),
        (tiger(("\nR: listen", f"\n{AFTER}R: * : 0 : * : hear-left 2\nR: listen")), ".pomdp"),
        (team(), ".dpomdp"),
        (ballet(), ".nfg"),
    ):
        found = twice(problem, suffix)
        for one, other in zip(tabulate(problem), tabulate(found), strict=True):
            if one is not None and other is not None:
                np.testing.assert_array_equal(one, other)


def test_the_same_dice_play_the_same_game_in_a_file() -> None:
    baby = load_problem("crying-baby")
    games = [
        Session(one, SeededUniforms(3), turn_limit=20) for one in (baby, twice(baby, ".pomdp"))
    ]
    for game in games:
        for turn in range(20):
            game.advance([turn % 3])
    first, second = games
    for one, other in zip(first.turns, second.turns, strict=True):
        for part, same in zip(one, other, strict=True):
            np.testing.assert_array_equal(part, same)


def test_names_are_such_as_the_formats_allow() -> None:
    names = ["(1,-2)", "a b", "a_b", "T", "7", "a-b", "*", ""]
    found = make_valid_names(names, "state")
    assert found == ["s1--2", "a-b", "a_b", "state-T", "s7", "a-b-2", "s-", "state"]
    assert make_valid_names(found, "state") == found
    assert make_valid_names(["0", "1"], "state") == ["0", "1"]
    assert make_valid_names([*"NESWT"], "state") == ["N", "E", "S", "W", "state-T"]


TEAM = "collaborative-predator-prey"


@pytest.mark.parametrize(
    ("name", "file", "told"),
    [
        ("cart-pole", "x.pomdp", "cart-pole: a file lists states and actions, and this"),
        ("2048", "x.mdp", "2048: a file lists states and actions"),
        ("crying-baby", "x.mdp", r"\.mdp is for states that are seen"),
        ("predator-prey", "x.pomdp", r"\.pomdp is for one agent, and here are 2: write a \.dpomdp"),
        ("predator-prey", "x.dpomdp", r"paid differently, .*: a file of several states holds no"),
        ("rock-paper-scissors", "x.pomdp", r"for one agent, and here are 2: write a \.nfg"),
        ("rock-paper-scissors", "x.dpomdp", r"paid differently, .* all alike: write a \.nfg"),
        (TEAM, "x.dpomdp", f"{TEAM}: tables: 824 MB, more than 512"),
        ("hexworld", "x.nfg", r"a \.nfg is a game of one state"),
        ("hexworld", "x.txt", r"-o: got .*x\.txt, expected a name in \.pomdp, \.mdp, \.dpomdp"),
    ],
)
def test_what_a_file_cannot_hold_is_refused(
    tmp_path: Path, name: str, file: str, told: str
) -> None:
    with pytest.raises(BadParameter, match=told):
        convert_problem(name, {}, tmp_path / file, force=False)
    assert not [*tmp_path.iterdir()]


def test_a_file_is_converted_too(tmp_path: Path) -> None:
    source = kept(tmp_path, "tiger.pomdp", TIGER)
    path = tmp_path / "tiger.dpomdp"
    told = convert_problem(source, {"discount": "0.5"}, path, force=False)
    assert told == f"{path}: {source}, a POMDP"
    found = markov.read_markov_file("tiger.dpomdp", path.read_bytes(), team=True)
    assert (found.discount, found.agents) == (0.5, ("agent1",))
    assert found.description() == tiger().description()
    told = convert_problem("hexworld", {}, tmp_path / "walk.mdp", force=False)
    assert told == f"{tmp_path}/walk.mdp: hexworld, an MDP"
