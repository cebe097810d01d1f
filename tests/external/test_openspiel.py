"""Tests of OpenSpiel games as problems."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.problem import WAIT_LABEL, find_wait_action
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, BadPolicy, IllegalAction, UnknownName
from dmplay.evaluation.solutions.solve import solve_problem
from dmplay.game.action_input import Keyboard
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.output.problem_and_agent_reports import load_problem_info
from dmplay.registry.agents import load_roster
from dmplay.validation import conformance
from dmplay.validation.conformance import check
from dmplay.views import generic
from tests.support.external_problems import ExternalProblemResult, check_external_problem
from tests.support.games import ScriptedUniforms

pytestmark = pytest.mark.extra("openspiel")

FAST_GAMES = ("kuhn_poker", "tic_tac_toe", "matrix_rps", "pig")
CHECKED_GAMES = (*FAST_GAMES, "goofspiel", "backgammon", "leduc_poker", "2048")
GAME_CALLS = {  # games that need arguments, or load faster with them; '' skips a game
    "bridge": "bridge(use_double_dummy_result=false)",
    "colored_trails": "",  # 93,123 actions: 5 seconds
    "misere": "misere(game=tic_tac_toe())",
    "repeated_game": "repeated_game(stage_game=matrix_pd(),num_repetitions=3)",
    "turn_based_simultaneous_game": "turn_based_simultaneous_game(game=goofspiel())",
}
EXPECTED_REJECTIONS = {
    "a mean-field game, which has no individual players": {
        "mfg_crowd_modelling", "mfg_crowd_modelling_2d", "mfg_dynamic_routing", "mfg_garnet",
    },
    "its chance events are hidden, so dmplay cannot draw them": {
        "bridge_uncontested_bidding", "negotiation", "stones_and_gems", "tarok",
    },
    "it has no list of actions": {"crossword"},
}  # fmt: skip
KUHN_POKER = "openspiel:kuhn_poker"


def list_game_calls() -> list[str]:
    import pyspiel

    return [
        GAME_CALLS.get(name, name)
        for name in pyspiel.registered_names()
        if GAME_CALLS.get(name, name)
    ]


def test_fast_games_can_be_played_recorded_undone_and_verified(tmp_path: Path) -> None:
    results = [
        check_external_problem(f"openspiel:{name}", tmp_path / "game.dmt", 6) for name in FAST_GAMES
    ]
    assert [result.refused for result in results] == [""] * len(FAST_GAMES)


@pytest.mark.slow
def test_a_hundred_games_can_be_played_and_the_others_report_a_reason(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    results = [
        check_external_problem(f"openspiel:{name}", tmp_path / "game.dmt", 12)
        for name in list_game_calls()
    ]
    playable = [result for result in results if not result.refused]
    assert len(playable) >= 100
    assert not any("\n" in result.refused for result in results)
    assert all(result.turns for result in playable)
    names_by_reason = {
        _rejection_reason(result): set[str]() for result in results if result.refused
    }
    for result in results:
        if result.refused:
            names_by_reason[_rejection_reason(result)].add(result.name.removeprefix("openspiel:"))
    other_reasons = {reason for reason in names_by_reason if reason not in EXPECTED_REJECTIONS}
    assert {
        reason: names_by_reason[reason] for reason in EXPECTED_REJECTIONS
    } == EXPECTED_REJECTIONS
    # games that need another game or a file
    assert sum(len(names_by_reason[reason]) for reason in other_reasons) <= 10
    assert capfd.readouterr().err == ""


def _rejection_reason(result: ExternalProblemResult) -> str:
    return result.refused.removeprefix(f"{result.name}: ")


@pytest.mark.slow
def test_games_of_each_kind_satisfy_every_invariant() -> None:
    assert {name: check(dmplay.load_problem(f"openspiel:{name}")) for name in CHECKED_GAMES} == {
        name: [] for name in CHECKED_GAMES
    }


def test_a_player_sees_its_card_before_it_acts_and_never_the_other_card() -> None:
    game = Session(dmplay.load_problem(KUHN_POKER), dmplay.SeededUniforms(3))
    first_card, second_card = (str(game.view(seat).observation) for seat in range(2))
    assert {first_card, second_card} < {"0", "1", "2"}
    assert first_card != second_card
    assert game.problem.format_transcript_state(game.state) == f"{first_card} {second_card}"
    game.advance([1, None])
    assert [str(game.view(seat).observation) for seat in range(2)] == [
        f"{first_card}b",
        f"{second_card}b",
    ]
    assert game.view(0).rewards is None
    game.advance([None, 0])
    assert game.end_reason == "terminal"
    assert game.total_rewards().tolist() == [1.0, -1.0]
    assert game.problem.format_transcript_state(game.state) == f"{first_card} {second_card} bp"


def test_an_inactive_player_does_not_choose() -> None:
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
    game = Session(board, ScriptedUniforms([], []))
    assert [game.is_inactive(0), game.is_inactive(1)] == [False, True]
    with pytest.raises(IllegalAction, match=r"player-1: o\(1-1\) is not legal now; expected one"):
        game.validate_action(1, 4)
    game.advance([4, None])
    assert [game.is_inactive(0), game.is_inactive(1)] == [True, False]
    assert game.turns[-1].actions.tolist() == [4, find_wait_action(board, 1)]
    with pytest.raises(IllegalAction, match="turn 2, player-1: no action given"):
        game.advance([None, None])


def test_chance_outcomes_follow_from_the_uniforms_of_nature() -> None:
    """Each deal of Kuhn poker is equally likely and follows from one uniform."""
    kuhn = dmplay.load_problem(KUHN_POKER)
    start = kuhn.sample_initial_states(((np.arange(600) + 0.5) / 600).round(9)[:, None])
    deals, counts = np.unique(
        [kuhn.format_transcript_state(state) for state in start], return_counts=True
    )
    assert deals.tolist() == ["0 1", "0 2", "1 0", "1 2", "2 0", "2 1"]
    assert counts.min() > 70


def test_search_is_offered_only_for_games_without_hidden_cards() -> None:
    with pytest.raises(BadPolicy, match="search: cannot compute the belief"):
        dmplay.load_agent(dmplay.load_problem(KUHN_POKER), 0, "search")
    board = dmplay.load_problem("openspiel:tic_tac_toe")
    policy = dmplay.load_agent(board, 0, "search")
    session = Session(board, dmplay.SeededUniforms(1), [policy, None])
    for action in ([0, None], [None, 8], [1, None], [None, 7]):
        session.advance(action)
    assert session.fill_in_actions()[0] == 2.0  # x wins in the first row
    assert "search" not in load_problem_info(KUHN_POKER).players
    assert "search" in load_problem_info("openspiel:tic_tac_toe").players


def test_a_game_that_cannot_be_played_is_an_error_of_one_line(
    capfd: pytest.CaptureFixture[str],
) -> None:
    for name, error, message in (
        ("kuhn_pokr", UnknownName, "openspiel: unknown game 'kuhn_pokr'; did you mean kuhn_poker"),
        ("kuhn_poker(cards=3)", BadParameter, r"kuhn_poker\(cards=3\): Unknown parameter 'cards'"),
        (
            "mfg_garnet",
            BadParameter,
            "mfg_garnet: a mean-field game, which has no individual players",
        ),
        ("crossword", BadParameter, "crossword: it has no list of actions"),
    ):
        with pytest.raises(error, match=message):
            dmplay.load_problem(f"openspiel:{name}")
    assert capfd.readouterr().err == ""


def test_action_names_can_depend_on_the_state(monkeypatch: pytest.MonkeyPatch) -> None:
    """White moves first and is OpenSpiel's second player in chess."""
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


ENTRY_GAME_TEXT = """EFG 2 R "entry" { "who may enter" "who is there" }
p "" 1 1 "" { "out" "in" } 0
t "" 1 "" { 0, 2 }
p "" 2 1 "" { "fight" "yield" } 0
t "" 2 "" { -1, -1 }
t "" 3 "" { 1, 1 }
"""


def test_a_short_fully_observable_game_is_solved_by_backward_induction(tmp_path: Path) -> None:
    file = tmp_path / "entry.efg"
    file.write_text(ENTRY_GAME_TEXT)
    entry = dmplay.load_problem(str(file))
    policies = [dmplay.load_agent(entry, seat, "optimal") for seat in range(2)]
    assert dmplay.rollout(entry, policies, episodes=1).returns.tolist() == [[1.0, 1.0]]
    solved = solve_problem(entry)
    assert solved.method == "backward induction over 5 states, infinite horizon"
    assert solved.result == "value 1 for player-0, 1 for player-1 at the start, exact"


def test_messages_name_the_file_of_a_game(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "entry (1).efg"
    file.write_text(ENTRY_GAME_TEXT)
    entry = dmplay.load_problem(str(file))
    state = entry.initial_states(1, ())
    with pytest.raises(IllegalAction) as illegal_action:
        entry.resolve_events(state, np.array([[7, 2]]), ())
    assert str(illegal_action.value) == f"{file}: got action 7, which is not a legal action now"
    file.write_text(ENTRY_GAME_TEXT.replace("{ 1, 1 }", "{ 3, 3 }"))
    monkeypatch.setitem(sys.modules, "pyspiel", None)
    with pytest.raises(BadParameter) as missing_library:
        dmplay.load_problem(str(file))
    assert str(missing_library.value).startswith(f"{file}: install the extra openspiel")


def test_branches_with_equal_labels_are_different_branches(tmp_path: Path) -> None:
    file = tmp_path / "coin.efg"
    file.write_text(
        """EFG 2 R "coin" { "ann" "bob" }
c "" 1 "" { "1/2" 1/2 "1/2" 1/2 } 0
p "" 1 1 "" { "1" "1" } 0
t "" 1 "" { 1, -1 }
t "" 2 "" { 2, -2 }
p "" 1 1 "" { "1" "1" } 0
t "" 3 "" { 3, -3 }
t "" 4 "" { 4, -4 }
"""
    )
    coin = dmplay.load_problem(str(file))
    assert coin.actions[0].labels == ("1", "1-(2)", "wait")
    games = dmplay.rollout(
        coin, [dmplay.load_agent(coin, n, "random") for n in range(2)], episodes=60
    )
    assert {*games.returns[:, 0].tolist()} == {1.0, 2.0, 3.0, 4.0}


def test_a_label_with_a_number_is_never_the_label_of_another_action(tmp_path: Path) -> None:
    file = tmp_path / "letters.efg"
    file.write_text(
        """EFG 2 R "letters" { "ann" "bob" }
p "" 1 1 "" { "A" "a" "a-0" } 0
t "" 1 "" { 1, -1 }
t "" 2 "" { 2, -2 }
t "" 3 "" { 3, -3 }
"""
    )
    assert dmplay.load_problem(str(file)).actions[0].labels == ("a-0-0", "a-1", "a-0", "wait")


def test_a_tree_too_deep_for_openspiel_ends_in_one_line(tmp_path: Path) -> None:
    file = tmp_path / "deep.efg"
    rows = [f'p "" 1 {n + 1} "" {{ "on" }} 0' for n in range(14_000)]
    file.write_text("\n".join(['EFG 2 R "deep" { "ann" }', *rows, 't "" 1 "" { 1 }']))
    nested_calls = f"openspiel:{'misere(game=' * 21}tic_tac_toe(){')' * 21}"
    for name, message in (
        (
            f"{file}",
            f"{file}:502:1: got 'p', expected t, because a path has at most 500 nodes before it",
        ),
        (f"openspiel:efg_game(filename={file})", f"{file}:502:1: got 'p'"),
        (f"openspiel:misere(game=efg_game(filename={file}))", f"{file}:502:1: got 'p'"),
        (nested_calls, "openspiel: misere: got more than 20 nested games"),
    ):
        code = f"import dmplay; dmplay.load_problem({name!r})"
        completed = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=False
        )
        assert completed.returncode == 1, completed.stderr
        assert message in completed.stderr.splitlines()[-1]


def test_the_deepest_tree_fits_into_a_small_stack(tmp_path: Path) -> None:
    file = tmp_path / "path.efg"
    rows = [f'p "" 1 {n + 1} "" {{ "on" }} 0' for n in range(500)]
    file.write_text("\n".join(['EFG 2 R "path" { "ann" }', *rows, 't "" 1 "" { 1 }']))
    game = (sys.executable, "-m", "dmplay", str(file), "--agent", "random", "--quiet")
    record = tmp_path / "path.dmt"
    for command in ((*game, "-o", str(record)), (*game[:3], "verify", str(record))):
        completed = subprocess.run(
            ["bash", "-c", 'ulimit -s 512 && exec "$@"', "bash", *command],
            capture_output=True,
            text=True,
            check=False,
        )
        assert completed.returncode == 0, completed.stderr
    assert completed.stdout == f"ok {record} (500 turns)\n1 verified\n"


def test_a_rewritten_file_is_another_game(tmp_path: Path) -> None:
    file = tmp_path / "entry.efg"
    file.write_text(ENTRY_GAME_TEXT)
    before = dmplay.load_problem(str(file))
    file.write_text(ENTRY_GAME_TEXT.replace("{ 1, 1 }", "{ 5, 1 }"))
    after = dmplay.load_problem(str(file))
    assert solve_problem(after).result == "value 5 for player-0, 1 for player-1 at the start, exact"
    assert (
        solve_problem(before).result == "value 1 for player-0, 1 for player-1 at the start, exact"
    )


DRIVER_TEXT = """EFG 2 R "absent-minded driver" { "driver" "nobody" }
p "" 1 1 "" { "exit" "stay" } 0
t "" 1 "" { 0 0 }
p "" 1 1 "" { "exit" "stay" } 0
t "" 2 "" { 4 0 }
t "" 3 "" { 1 0 }
"""


def test_a_game_whose_number_of_turns_would_reveal_hidden_information_is_refused(
    tmp_path: Path,
) -> None:
    """The driver must not know at which of the two exits it is."""
    file = tmp_path / "driver.efg"
    file.write_text(DRIVER_TEXT)
    with pytest.raises(
        BadParameter, match="the number of turns would reveal hidden information to player-0"
    ) as error:
        dmplay.load_problem(str(file))
    assert "\n" not in str(error.value)


def test_the_optimal_policy_of_nim_values_taking_the_last_object_as_a_loss() -> None:
    nim = dmplay.load_problem("openspiel:nim(pile_sizes=1;2)")
    player = SeatedPolicy(Session(nim, SeededUniforms(1)), 0, dmplay.load_agent(nim, 0, "optimal"))
    values = player.action_values()
    assert values is not None
    values_by_action = dict(zip(nim.actions[0].labels, values.tolist(), strict=True))
    assert {name: value for name, value in values_by_action.items() if np.isfinite(value)} == {
        "pile-1-take-1": -1.0, "pile-2-take-1": -1.0, "pile-2-take-2": 1.0,
    }  # fmt: skip
    decisions = {row["state"]: (row["to decide"], row["best"]) for row in solve_problem(nim).rows}
    assert decisions["(1): 1 0"] == ("player-1", "pile-1-take-1")


@pytest.mark.parametrize("name", ["tic_tac_toe", "chess", "pig"])
def test_a_long_wide_or_stochastic_game_has_hints_by_search(name: str) -> None:
    assert load_roster(dmplay.load_problem(f"openspiel:{name}"), 0).hint_provider == "search"
