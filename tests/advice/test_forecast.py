"""What an action may bring is told before it is played, as far as its seat may know."""

import numpy as np
import pytest

import dmplay
from dmplay import belief
from dmplay.advice.forecast import N_SAMPLES, forecast_outcomes, format_forecast
from dmplay.chance import Reals
from dmplay.core import enumerate_outcomes
from dmplay.dice import NATURE_STREAM, SeededUniforms
from dmplay.errors import BadParameter, IllegalAction
from dmplay.game.request import GameRequest
from dmplay.game.table import GameController
from dmplay.screen.acts import run_typed_line
from dmplay.screen.modes import Mode
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.session import Session
from dmplay.terminal import Terminal
from dmplay.words.commands import run_line
from tests.support.cases import CASES, small
from tests.support.screens import game, play, seated
from tests.support.turns import Nim


class Once:
    """Dice for the opening alone."""

    def __init__(self) -> None:
        self.dice = dmplay.SeededUniforms(7)

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """The opening's uniforms; a turn's are asked for by nobody."""
        assert (stream, turn) == (NATURE_STREAM, 0)
        return self.dice.generate_uniforms(stream, turn, reroll, count)


def session(name: str, *actions: int) -> Session:
    made = Session(dmplay.load_problem(name), dmplay.SeededUniforms(7))
    for action in actions:
        made.advance([action])
    return made


def screen(name: str, *seats: str) -> PlayScreen:
    return PlayScreen(GameController(game(name, *seats)), Terminal(True, "", True, True, False))


@pytest.mark.parametrize("name", CASES)
def test_every_problem_tells_what_an_action_may_bring_without_its_dice(name: str) -> None:
    problem = small(name)
    before = Session(problem, Once())
    for seat in range(len(problem.agents)):
        legal = before.legal_actions_mask(seat)
        action = 0 if legal is None else int(np.flatnonzero(legal)[0])
        if problem.partially_observable and not before.has_visible_beliefs:
            with pytest.raises(BadParameter, match="too many states"):
                forecast_outcomes(before, seat, action)
            continue
        outlook = forecast_outcomes(before, seat, action)
        assert outlook.probabilities.sum() == pytest.approx(1.0)
        assert len(outlook.outcomes) == len(outlook.probabilities)
        assert (np.diff(outlook.probabilities) <= 0.0).all()
        assert format_forecast(before, seat, outlook).startswith(
            f"if {problem.format_action(seat, action)}"
        )
        assert not before.turns


def test_an_outcome_of_a_seen_problem_is_as_likely_as_its_rules_say() -> None:
    before = session("hexworld")
    outlook = forecast_outcomes(before, 0, 5)
    p, outcome = enumerate_outcomes(before.problem, before.state[None], np.array([[5]]))
    assert dict(zip(outlook.outcomes.tolist(), outlook.probabilities.tolist(), strict=True)) == (
        dict(zip(outcome.state[0].tolist(), p[0].tolist(), strict=True))
    )
    assert format_forecast(before, 0, outlook) == "if se: 0.70 (8,1), 0.15 (8,2), 0.15 (7,1)"


def test_a_belief_says_what_may_be_seen_and_what_would_then_be_believed() -> None:
    before = session("crying-baby", 2, 2)
    outlook = forecast_outcomes(before, 0, 1)
    known = before.view(0).belief
    assert outlook.beliefs is not None
    for seen, chance, then in zip(
        outlook.outcomes, outlook.probabilities, outlook.beliefs, strict=True
    ):
        after = belief.update_belief(before.problem, known, [1], [int(seen)])
        assert chance == pytest.approx(float(after.likelihood))
        assert then == pytest.approx(after.belief)


def test_a_hidden_state_changes_nothing_of_what_is_foreseen() -> None:
    problem, dice = dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(7)
    one, other = (Session(problem, dice, initial_uniforms=np.array([u])) for u in (0.1, 0.9))
    assert int(one.state) != int(other.state)
    first, second = (
        format_forecast(each, 0, forecast_outcomes(each, 0, 0)) for each in (one, other)
    )
    assert first == second


def test_what_nature_draws_as_reals_is_foreseen_by_samples_said_as_such() -> None:
    before = session("simple-regulator")
    outlook = forecast_outcomes(before, 0, 0.2)
    assert outlook.is_sampled
    assert len(outlook.outcomes) == N_SAMPLES
    now = float(before.state[0])
    assert outlook.outcomes.mean() == pytest.approx(now + 0.2, abs=0.01)
    assert outlook.outcomes.std() == pytest.approx(0.1, abs=0.01)
    assert format_forecast(before, 0, outlook).endswith(f"({N_SAMPLES} samples)")


def test_others_are_taken_to_act_at_random_and_it_is_said() -> None:
    before = session("prisoners-dilemma")
    line = "if defect, the other at random: cooperate pays 0, defect pays -3; -1.5 on average"
    assert format_forecast(before, 0, forecast_outcomes(before, 0, 1)) == line


def test_who_only_waits_does_nothing_at_random() -> None:
    before = Session(Nim(), SeededUniforms(7))
    assert format_forecast(before, 0, forecast_outcomes(before, 0, 0)) == "if one: 1.00 6-right"


def test_an_action_that_is_not_legal_is_not_foreseen() -> None:
    before = session("2048", 0)
    legal = before.legal_actions_mask(0)
    assert legal is not None
    with pytest.raises(IllegalAction):
        forecast_outcomes(before, 0, int(np.flatnonzero(~legal)[0]))


# On the screen and in words


def test_a_look_ahead_shows_action_after_action_and_enter_plays_the_last() -> None:
    shown = screen("hexworld")
    seen = []
    for key in ("W", "l", "n"):
        handle_key(shown, key)
        seen.append(
            (shown.message, shown.frame_state.forecast and shown.frame_state.forecast.action)
        )
    assert [action for _, action in seen] == [None, 0.0, 5.0]
    assert seen[2][0] == "if se: 0.70 (8,1), 0.15 (8,2), 0.15 (7,1)"
    assert not shown.game.session.turns
    handle_key(shown, "enter")
    assert [turn.actions[0] for turn in shown.game.session.turns] == [5]
    assert shown.frame_state.forecast is None
    assert shown.modes.display_mode is Mode.BOARD


def test_what_a_large_board_tells_is_not_told_below_it() -> None:
    words = {(80, 24): "if se: Enter plays it, Esc leaves", (50, 14): "if se: 0.70 (8,1), 0.15 "}
    for size, said in words.items():
        assert said in play(game("hexworld"), "W", "n", size=size).last


@pytest.mark.parametrize("key", ["escape", "W", "L", "tab"])
def test_a_look_ahead_is_left_by_any_other_key(key: str) -> None:
    shown = screen("hexworld")
    for one in ("W", "l", key):
        handle_key(shown, one)
    assert shown.modes.display_mode is Mode.BOARD
    assert shown.frame_state.forecast is None
    assert not shown.game.session.turns
    handle_key(shown, "n")
    assert len(shown.game.session.turns) == 1


def test_a_diagonal_of_two_arrows_is_looked_at_not_played() -> None:
    shown = screen("hexworld")
    for key in ("W", "down", "right"):
        handle_key(shown, key)
    assert shown.frame_state.forecast is not None
    assert shown.frame_state.forecast.action == 5.0
    assert not shown.game.session.turns


def test_a_number_is_looked_at_on_enter_and_played_on_the_next() -> None:
    shown = screen("simple-regulator")
    for key in ("W", ".", "2", "enter"):
        handle_key(shown, key)
    assert shown.message.startswith("if 0.2: ")
    handle_key(shown, "enter")
    assert [float(turn.actions[0]) for turn in shown.game.session.turns] == [0.2]


def test_a_look_ahead_is_counted_as_help_for_each_action_shown() -> None:
    shown = screen("hexworld")
    for key in ("W", "l", "n", "escape"):
        handle_key(shown, key)
    run_line(shown.controller, "whatif e")
    assert shown.game.session.hint_counts == {"agent": 3}


def test_a_game_that_is_strict_about_help_foresees_nothing() -> None:
    made = Session(dmplay.load_problem("hexworld"), dmplay.SeededUniforms(7))
    played = seated("hexworld", made, ["human"], GameRequest("hexworld", strict="hints"))
    frames = play(played, "W", "n").frames
    assert "strict about help" in frames[1]
    assert len(made.turns) == 1
    with pytest.raises(BadParameter, match="strict about help"):
        run_line(GameController(played), "whatif e")


def test_words_ask_for_the_action_to_look_at() -> None:
    table = GameController(game("crying-baby"))
    assert run_line(table, "whatif feed").startswith("if feed: 0.90 quiet (then sated 1.00)")
    with pytest.raises(BadParameter, match="expected an action"):
        run_line(table, "whatif")


def test_the_board_is_told_what_was_asked_in_words_until_the_next_move() -> None:
    shown = screen("hexworld")
    run_typed_line(shown, "whatif e")
    assert shown.frame_state.forecast is not None
    handle_key(shown, "l")
    assert shown.frame_state.forecast is None
