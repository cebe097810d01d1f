"""Games of OpenSpiel are played as what they are."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import conformance
from dmplay.conformance import check
from dmplay.core import WAIT_LABEL
from dmplay.dice import SeededUniforms
from dmplay.errors import BadParameter, BadPolicy, IllegalAction, UnknownName
from dmplay.finding.agents import load_roster
from dmplay.keys.keyboard import Keyboard
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES
from dmplay.reports.problems import load_problem_info
from dmplay.session import SeatedPolicy, Session
from dmplay.solutions.every import solve_problem
from dmplay.views import generic
from tests.support.games import Scripted
from tests.support.guests import Tried, tried

FEW = ("kuhn_poker", "tic_tac_toe", "matrix_rps", "pig")
KINDS = (*FEW, "goofspiel", "backgammon", "leduc_poker", "2048")
GIVEN = {  # what a few need to be given, or load faster with
    "bridge": "bridge(use_double_dummy_result=false)",
    "colored_trails": "",  # 93,123 actions: 5 seconds
    "misere": "misere(game=tic_tac_toe())",
    "repeated_game": "repeated_game(stage_game=matrix_pd(),num_repetitions=3)",
    "turn_based_simultaneous_game": "turn_based_simultaneous_game(game=goofspiel())",
}
REFUSED = {
    "a mean-field game: it has no players": {
        "mfg_crowd_modelling", "mfg_crowd_modelling_2d", "mfg_dynamic_routing", "mfg_garnet",
    },
    "its chance is hidden, and cannot be drawn": {
        "bridge_uncontested_bidding", "negotiation", "stones_and_gems", "tarok",
    },
    "it counts no actions": {"crossword"},
}  # fmt: skip
KUHN = "openspiel:kuhn_poker"


def every() -> list[str]:
    import pyspiel

    return [GIVEN.get(name, name) for name in pyspiel.registered_names() if GIVEN.get(name, name)]


def test_a_few_play_record_undo_and_verify(tmp_path: Path) -> None:
    found = [tried(f"openspiel:{name}", tmp_path / "game.dmt", 6) for name in FEW]
    assert [one.refused for one in found] == [""] * len(FEW)


@pytest.mark.slow
def test_a_hundred_play_record_undo_and_verify_and_the_others_say_why(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    found = [tried(f"openspiel:{name}", tmp_path / "game.dmt", 12) for name in every()]
    played = [one for one in found if not one.refused]
    assert len(played) >= 100
    assert not any("\n" in one.refused for one in found)
    assert all(one.turns for one in played)
    told = {_why(one): set[str]() for one in found if one.refused}
    for one in found:
        if one.refused:
            told[_why(one)].add(one.name.removeprefix("openspiel:"))
    needy = {why for why in told if why not in REFUSED}
    assert {why: told[why] for why in REFUSED} == REFUSED
    assert sum(len(told[why]) for why in needy) <= 10  # wrappers of another game, or of a file
    assert capfd.readouterr().err == ""


def _why(one: Tried) -> str:
    return one.refused.removeprefix(f"{one.name}: ")


@pytest.mark.slow
def test_each_kind_keeps_every_law() -> None:
    assert {name: check(dmplay.load_problem(f"openspiel:{name}")) for name in KINDS} == {
        name: [] for name in KINDS
    }


def test_a_player_knows_its_card_before_it_acts_and_never_the_other() -> None:
    game = Session(dmplay.load_problem(KUHN), dmplay.SeededUniforms(3))
    own, other = (str(game.view(seat).observation) for seat in range(2))
    assert {own, other} < {"0", "1", "2"}
    assert own != other
    assert game.problem.format_transcript_state(game.state) == f"{own} {other}"
    game.advance([1, None])
    assert [str(game.view(seat).observation) for seat in range(2)] == [f"{own}b", f"{other}b"]
    assert game.view(0).rewards is None
    game.advance([None, 0])
    assert game.end_reason == "terminal"
    assert game.total_rewards().tolist() == [1.0, -1.0]
    assert game.problem.format_transcript_state(game.state) == f"{own} {other} bp"


def test_who_only_waits_is_not_asked() -> None:
    board = dmplay.load_problem("openspiel:tic_tac_toe")
    assert board.actions[0].labels[4:] == (
        "x(1-1)",
        "x(1-2)",
        "x(2-0)",
        "x(2-1)",
        "x(2-2)",
        WAIT_LABEL,
    )
    assert board.actions[1].labels[4] == "o(1-1)"
    assert not board.uniform_counts.step
    game = Session(board, Scripted([], []))
    assert [game.is_inactive(0), game.is_inactive(1)] == [False, True]
    with pytest.raises(IllegalAction, match=r"player-1: o\(1-1\) is not legal now; expected one"):
        game.validate_action(1, 4)
    game.advance([4, None])
    assert [game.is_inactive(0), game.is_inactive(1)] == [True, False]
    assert game.turns[-1].actions.tolist() == [4, board.wait_action(1)]
    with pytest.raises(IllegalAction, match="turn 2, player-1: no action given"):
        game.advance([None, None])


def test_chance_is_drawn_by_what_nature_drew() -> None:
    """The cards of Kuhn's poker, each deal as likely, follow from one number."""
    kuhn = dmplay.load_problem(KUHN)
    start = kuhn.sample_initial_states(((np.arange(600) + 0.5) / 600).round(9)[:, None])
    deals, counts = np.unique(
        [kuhn.format_transcript_state(one) for one in start], return_counts=True
    )
    assert deals.tolist() == ["0 1", "0 2", "1 0", "1 2", "2 0", "2 1"]
    assert counts.min() > 70


def test_no_search_looks_at_hidden_cards_and_hints_are_honest() -> None:
    with pytest.raises(BadPolicy, match="search needs a belief"):
        dmplay.load_agent(dmplay.load_problem(KUHN), 0, "search")
    board = dmplay.load_problem("openspiel:tic_tac_toe")
    best = dmplay.load_agent(board, 0, "search")
    two = Session(board, dmplay.SeededUniforms(1), [best, None])
    for action in ([0, None], [None, 8], [1, None], [None, 7]):
        two.advance(action)
    assert two.fill_in_actions()[0] == 2.0  # x wins in the first row
    assert "search" not in load_problem_info(KUHN).players
    assert "search" in load_problem_info("openspiel:tic_tac_toe").players


def test_what_cannot_be_played_is_said_in_a_line(capfd: pytest.CaptureFixture[str]) -> None:
    for name, error, told in (
        ("kuhn_pokr", UnknownName, "openspiel: unknown game 'kuhn_pokr'; did you mean kuhn_poker"),
        ("kuhn_poker(cards=3)", BadParameter, r"kuhn_poker\(cards=3\): Unknown parameter 'cards'"),
        ("mfg_garnet", BadParameter, "mfg_garnet: a mean-field game: it has no players"),
        ("crossword", BadParameter, "crossword: it counts no actions"),
    ):
        with pytest.raises(error, match=told):
            dmplay.load_problem(f"openspiel:{name}")
    assert capfd.readouterr().err == ""


def test_names_that_depend_on_the_state_are_those_of_the_state(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """White moves first, and is OpenSpiel's second player of chess."""
    chess = dmplay.load_problem("openspiel:chess")
    game = Session(chess, dmplay.SeededUniforms(1))
    keyboard = Keyboard(chess, [0, 1], DEFAULT_KEY_PREFERENCES)
    for seat, move in ((1, "e4"), (0, "d5"), (1, "exd5"), (0, "Qxd5")):
        action = keyboard.parse_action(game.view(seat), move)
        game.advance([action if n == seat else None for n in range(2)])
    assert chess.format_transcript_state(game.state).startswith(
        "rnb1kbnr/ppp1pppp/8/3q4/8/8/PPPP1PPP/RNBQKBNR w"
    )
    assert game.view(0).last_action_label == "Qxd5"
    assert "player-0 chose Qxd5" in generic.describe_turn(game.view(1))
    monkeypatch.setattr(conformance, "RANDOM_GAMES", 2)
    assert check(dmplay.load_problem("openspiel:ultimate_tic_tac_toe")) == []


ENTRY = """EFG 2 R "entry" { "who may enter" "who is there" }
p "" 1 1 "" { "out" "in" } 0
t "" 1 "" { 0, 2 }
p "" 2 1 "" { "fight" "yield" } 0
t "" 2 "" { -1, -1 }
t "" 3 "" { 1, 1 }
"""


def test_a_short_game_of_which_all_is_seen_is_solved_backwards(tmp_path: Path) -> None:
    file = tmp_path / "entry.efg"
    file.write_text(ENTRY)
    entry = dmplay.load_problem(str(file))
    pair = [dmplay.load_agent(entry, seat, "optimal") for seat in range(2)]
    assert dmplay.rollout(entry, pair, episodes=1).returns.tolist() == [[1.0, 1.0]]
    found = solve_problem(entry)
    assert found.method == "backward induction over 5 states, without end"
    assert found.result == "value 1 to player-0, 1 to player-1 at the start, exact"


def test_a_file_that_is_written_anew_holds_another_game(tmp_path: Path) -> None:
    file = tmp_path / "entry.efg"
    file.write_text(ENTRY)
    before = dmplay.load_problem(str(file))
    file.write_text(ENTRY.replace("{ 1, 1 }", "{ 5, 1 }"))
    after = dmplay.load_problem(str(file))
    assert solve_problem(after).result == "value 5 to player-0, 1 to player-1 at the start, exact"
    assert solve_problem(before).result == "value 1 to player-0, 1 to player-1 at the start, exact"


def test_who_takes_the_last_of_a_pile_loses_and_knows_it() -> None:
    nim = dmplay.load_problem("openspiel:nim(pile_sizes=1;2)")
    first = SeatedPolicy(Session(nim, SeededUniforms(1)), 0, dmplay.load_agent(nim, 0, "optimal"))
    values = first.action_values()
    assert values is not None
    worth = dict(zip(nim.actions[0].labels, values.tolist(), strict=True))
    assert {name: one for name, one in worth.items() if np.isfinite(one)} == {
        "pile-1-take-1": -1.0, "pile-2-take-1": -1.0, "pile-2-take-2": 1.0,
    }  # fmt: skip
    told = {row["state"]: (row["to decide"], row["best"]) for row in solve_problem(nim).rows}
    assert told["(1): 1 0"] == ("player-1", "pile-1-take-1")


@pytest.mark.parametrize("name", ["tic_tac_toe", "chess", "pig"])
def test_a_game_that_is_long_wide_or_drawn_is_searched(name: str) -> None:
    assert load_roster(dmplay.load_problem(f"openspiel:{name}"), 0).hint_provider == "search"
