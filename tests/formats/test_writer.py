"""Tests of written problem files: reading and writing them again changes nothing."""

from pathlib import Path

import numpy as np
import pytest

from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.tabular import tabulate
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.formats import cassandra, gambit_nfg
from dmplay.formats.writer import iter_problem_lines, make_valid_names
from dmplay.output.problem_export import convert_problem
from dmplay.registry.problems import load_problem, problem_docstring
from tests.formats.sources import TIGER_TEXT, read_ballet, read_team, read_tiger, write_text_file

FINITE_PROBLEMS = {
    ".pomdp": ("crying-baby", "machine-replacement", "catch", "hexworld:straight-line"),
    ".mdp": ("hexworld",),
    ".dpomdp": ("crying-baby", "hexworld:straight-line", "collaborative-predator-prey:triangle"),
    ".nfg": ("prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma"),
}
NEXT_STATE_REWARD = "R: open-left : tiger-right : tiger-left : * 30\n"


def read_problem(text: str, suffix: str) -> Problem:
    """Read the problem in a written file."""
    if suffix == ".nfg":
        return gambit_nfg.read_nfg("x.nfg", text.encode())
    return cassandra.read_markov_file("x" + suffix, text.encode(), team=suffix == ".dpomdp")


def write_and_read(problem: Problem, suffix: str) -> Problem:
    """Write a problem and read it, and assert that writing it again gives the same file."""
    text = "".join(iter_problem_lines(problem, suffix, problem_docstring(problem)))
    reread = read_problem(text, suffix)
    assert "".join(iter_problem_lines(reread, suffix, problem_docstring(reread))) == text
    return reread


def test_every_finite_problem_survives_writing_and_reading() -> None:
    for suffix, names in FINITE_PROBLEMS.items():
        for name in names:
            problem = load_problem(name)
            reread = write_and_read(problem, suffix)
            assert reread.discount == problem.discount
            for expected, actual in zip(tabulate(problem), tabulate(reread), strict=False):
                if expected is not None:
                    assert actual is not None
                    np.testing.assert_array_equal(expected, actual, name)


def test_problems_read_from_files_survive_writing() -> None:
    for problem, suffix in (
        (read_tiger(), ".pomdp"),
        (read_tiger(("\nR: listen", "\n" + NEXT_STATE_REWARD + "R: listen")), ".pomdp"),
        (
            read_tiger(
                ("\nR: listen", f"\n{NEXT_STATE_REWARD}R: * : 0 : * : hear-left 2\nR: listen")
            ),
            ".pomdp",
        ),
        (read_team(), ".dpomdp"),
        (read_ballet(), ".nfg"),
    ):
        reread = write_and_read(problem, suffix)
        for expected, actual in zip(tabulate(problem), tabulate(reread), strict=True):
            if expected is not None and actual is not None:
                np.testing.assert_array_equal(expected, actual)


def test_a_written_problem_plays_the_same_game_on_the_same_uniforms() -> None:
    baby = load_problem("crying-baby")
    games = [
        Session(item, SeededUniforms(3), turn_limit=20)
        for item in (baby, write_and_read(baby, ".pomdp"))
    ]
    for game in games:
        for turn in range(20):
            game.advance([turn % 3])
    first, second = games
    for item, other_item in zip(first.turns, second.turns, strict=True):
        for part, other_part in zip(item[:5], other_item[:5], strict=True):
            np.testing.assert_array_equal(part, other_part)


def test_invalid_names_are_replaced_by_names_that_the_formats_allow() -> None:
    names = ["(1,-2)", "a b", "a_b", "T", "7", "a-b", "*", ""]
    valid_names = make_valid_names(names, "state")
    assert valid_names == ["s1--2", "a-b", "a_b", "state-T", "s7", "a-b-2", "s-", "state"]
    assert make_valid_names(valid_names, "state") == valid_names
    assert make_valid_names(["0", "1"], "state") == ["0", "1"]
    assert make_valid_names([*"NESWT"], "state") == ["N", "E", "S", "W", "state-T"]


HUNT_NAME = "collaborative-predator-prey"


@pytest.mark.parametrize(
    ("name", "file", "message"),
    [
        ("cart-pole", "x.pomdp", "but the states of this problem are real numbers"),
        ("simple-regulator", "x.mdp", "but an action of this problem is a real number"),
        ("2048", "x.mdp", "dmplay creates the states of this problem only during play"),
        pytest.param(
            "openspiel:kuhn_poker",
            "x.pomdp",
            "dmplay creates the states of this problem only during play",
            marks=pytest.mark.extra("openspiel"),
        ),
        ("crying-baby", "x.mdp", r"\.mdp is for problems without hidden states"),
        ("predator-prey", "x.pomdp",
         r"\.pomdp is for one agent, but this problem has 2; write a \.dpomdp"),
        ("predator-prey", "x.dpomdp", r"rewards of the agents differ, .*; no file format holds"),
        ("rock-paper-scissors", "x.pomdp", r"for one agent, but this problem has 2; write a \.nfg"),
        ("rock-paper-scissors", "x.dpomdp",
         r"rewards of the agents differ, .* for all; write a \.nfg"),
        (HUNT_NAME, "x.dpomdp", f"{HUNT_NAME}: tables: 824 MB, more than the limit of 512 MB"),
        ("hexworld", "x.nfg", r"\.nfg is for games with one visible state"),
        ("hexworld", "x.txt",
         r"-o: got .*x\.txt, expected a name that ends in \.pomdp, \.mdp, \.dpomdp"),
    ],
)  # fmt: skip
def test_a_problem_that_a_format_cannot_store_is_refused(
    tmp_path: Path, name: str, file: str, message: str
) -> None:
    with pytest.raises(BadParameter, match=message):
        convert_problem(name, {}, tmp_path / file, force=False)
    assert not [*tmp_path.iterdir()]


def test_a_problem_file_can_be_converted(tmp_path: Path) -> None:
    source = write_text_file(tmp_path, "tiger.pomdp", TIGER_TEXT)
    path = tmp_path / "tiger.dpomdp"
    output = convert_problem(source, {"discount": "0.5"}, path, force=False)
    assert output == f"{path}: {source}, a POMDP"
    reread = cassandra.read_markov_file("tiger.dpomdp", path.read_bytes(), team=True)
    assert (reread.discount, reread.agents) == (0.5, ("agent1",))
    assert reread.description() == read_tiger().description()
    output = convert_problem("hexworld", {}, tmp_path / "walk.mdp", force=False)
    assert output == f"{tmp_path}/walk.mdp: hexworld, an MDP"
