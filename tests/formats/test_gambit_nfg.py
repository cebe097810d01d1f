"""Tests of Gambit's normal form: payoffs in order or by outcome, strategies named or numbered."""

import pytest

from dmplay.agents.base import SeatPolicy
from dmplay.errors import BadFile, BadParameter, BudgetExceeded
from dmplay.formats import gambit_nfg
from dmplay.registry.agents import load_roster
from dmplay.registry.problem_files import load_data_problem
from tests.formats.sources import BALLET_TEXT, read_ballet

SELTEN_TEXTS = [
    'NFG 1 R "Selten" { "a" "b" } { 3 2 } 1 1 0 2 0 2 1 1 0 3 2 0',
    'NFG 1 D "Selten" { "a" "b" } { { "1" "2" "3" } { "1" "2" } } "" 1 1 0 2. 0 4/2 1 1e0 0 3 2 0',
    'NFG 1 R "Selten" {"a" "b"}{3 2}{{"" 1, 1}{"" 0, 2}{"" 1 1}{"x" 0 3}{"" 2 0}}1 2 2 3 4 5',
]


def test_equivalent_files_are_read_as_the_same_game() -> None:
    for text in SELTEN_TEXTS:
        game = gambit_nfg.read_nfg("selten.nfg", text.encode())
        assert game.payoffs.tolist() == [[[1, 1], [1, 1]], [[0, 2], [0, 3]], [[0, 2], [2, 0]]]
        assert game.actions == (("1", "2", "3"), ("1", "2"))


def test_names_become_labels_that_can_be_typed() -> None:
    game = read_ballet()
    assert game.agents == ("player-1", "player-2")
    assert game.actions == (("ballet", "the-fight"),) * 2
    assert game.description() == 'Ballet or "the" fight\n\nBoth want to meet.'
    assert game.payoffs[0, 0].tolist() == [3, 2]
    assert game.kind == "simple game"
    game = read_ballet(("the fight", "a#b,c"), ('"ballet"', '"Undo"'))
    assert game.actions == (("strategy-undo", "a-b-c"),) * 2


def test_outcome_0_pays_nothing_in_a_game_of_three_players() -> None:
    text = 'NFG 1 R "" {"a" "b" "c"} {2 1 2} {{"" 1 2 3}} 0 1 0 1'
    game = gambit_nfg.read_nfg("three.nfg", text.encode())
    assert game.payoffs[:, 0, :].tolist() == [[[0, 0, 0]] * 2, [[1, 2, 3]] * 2]


def test_two_player_games_have_the_agents_of_matrix_games() -> None:
    game_roster = load_roster(read_ballet(), 1)
    assert {"nash", "frequency"} <= {*game_roster.agents}
    agent = game_roster.agents["nash"](read_ballet(), 0)
    assert isinstance(agent, SeatPolicy)


FAULTS = [
    (("NFG", "EFG"), "1:1: got 'EFG', expected NFG"),
    (("NFG 1", "NFG 2"), "1:5: got '2', expected 1"),
    (("2 3\n", "2\n"), "5:14: got the end of the file, expected a number"),
    (("2 3\n", "2 3 4\n"),
     "5:17: got '4', expected the end of the file, because the payoff table is complete"),
    (("3 2 0", "3 x 0"), "5:3: got 'x', expected a number"),
    (("3 2 0", "3 1/0 0"), "5:3: got '1/0', expected a number"),
    (("3 2 0", "3 9e999999999 0"), "5:3: got '9e999999999', expected a number, at most 1e+100"),
    (("3 2 0", "3 2e300 0"), "5:3: got '2e300', expected a number, at most 1e+100"),
    (('{ "Player 1" "Player 2" }', "{ }"), "expected the name of a player in quotation marks"),
    (('{ "ballet" "the fight" } }', "}"),
     "expected strategies in braces, or their number, for each"),
    (('{ "ballet" "the fight" } }', "0 }"), "got '0', expected strategies in braces"),
]  # fmt: skip


def test_faults_are_reported_with_line_and_column() -> None:
    for change, message in FAULTS:
        with pytest.raises(BadFile) as error:
            read_ballet(change)
        assert message in str(error.value), (change, str(error.value))


def test_a_game_that_exceeds_memory_is_refused_before_it_is_read() -> None:
    text = BALLET_TEXT.replace(
        '{ { "ballet" "the fight" } { "ballet" "the fight" } }', "{ 99999 99999 }"
    )
    with pytest.raises(BudgetExceeded, match="reading the file"):
        gambit_nfg.read_nfg("large.nfg", text.encode())
    with pytest.raises(BadParameter, match=r"none\.nfg: No such file"):
        load_data_problem("none.nfg")
