"""Tests of the forecast of an action's outcomes, which uses only what its seat can know."""

import re
from decimal import Decimal

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core import belief
from dmplay.core.arrays import Reals
from dmplay.core.problem import enumerate_outcomes
from dmplay.core.session import Session
from dmplay.core.text import count_probability_decimals
from dmplay.core.uniforms import NATURE_STREAM, SeededUniforms
from dmplay.errors import BadParameter, IllegalAction
from dmplay.game.game_series import GameController
from dmplay.game.hints.forecast_text import format_forecast
from dmplay.game.launch_requests import GameRequest
from dmplay.game.position import Position
from dmplay.game.turn_events import SAMPLE_COUNT
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.modes import Mode
from dmplay.ui.screen.play_operations import run_typed_line
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import run_line
from tests.support.problem_cases import CASE_NAMES, load_small_problem
from tests.support.screens import make_game, make_session_game, play_keys
from tests.support.turn_based_games import Nim


class InitialUniformsOnly:
    """A source of uniforms for the initial state only."""

    def __init__(self) -> None:
        self.dice = dmplay.SeededUniforms(7)

    def generate_uniforms(self, stream: int, turn: int, reroll: int, count: int) -> Reals:
        """Return the uniforms of the initial state; fail if a turn's are requested."""
        assert (stream, turn) == (NATURE_STREAM, 0)
        return self.dice.generate_uniforms(stream, turn, reroll, count)


def create_session(name: str, *actions: int) -> Session:
    new_session = Session(dmplay.load_problem(name), dmplay.SeededUniforms(7))
    for action in actions:
        new_session.advance([action])
    return new_session


def list_printed_probabilities(text: str) -> list[str]:
    """Return the probabilities of the outcomes in a line of a forecast, without beliefs."""
    assert text.startswith("if ")
    return re.findall(r"\d\.\d+", re.sub(r"\(then [^)]*\)", "", text))


@pytest.mark.parametrize(
    ("name", "action", "printed"),
    [
        ("crying-baby", "sing", ["0.51", "0.49"]),
        ("crying-baby", "feed", ["0.90", "0.10"]),
        ("crying-baby", "ignore", ["0.52", "0.48"]),
        ("hexworld", "w", ["0.70", "0.15", "0.15"]),
        ("machine-replacement", "manufacture", ["1.00"]),
    ],
)
def test_the_printed_probabilities_of_what_an_action_brings_sum_to_one(
    name: str, action: str, printed: list[str]
) -> None:
    text = run_line(GameController(make_game(name)), f"whatif {action}")
    assert list_printed_probabilities(text) == printed
    assert sum(map(Decimal, printed)) == 1


def test_probabilities_that_no_rounding_makes_sum_to_one_keep_two_decimals() -> None:
    assert count_probability_decimals([1 / 3] * 3) == 2
    assert count_probability_decimals([1 / 8] * 8) == 3
    assert count_probability_decimals([0.3336, 0.3336, 0.3328]) == 4


def create_screen(name: str, *seats: str) -> PlayScreen:
    return PlayScreen(
        GameController(make_game(name, *seats)), Terminal(True, "", True, True, False)
    )


def open_position(session: Session, seat: int) -> Position:
    """Return the position of a seat, without a model of the other agents."""
    return Position.with_agent(session, AdviceQuestion.of_session(session, seat), None)


@pytest.mark.parametrize("name", CASE_NAMES)
def test_every_problem_forecasts_an_action_without_drawing_uniforms(name: str) -> None:
    problem = load_small_problem(name)
    session = Session(problem, InitialUniformsOnly())
    for seat in range(len(problem.agents)):
        legal = session.legal_actions_mask(seat)
        action = 0 if legal is None else int(np.flatnonzero(legal)[0])
        if problem.partially_observable and not session.has_visible_beliefs:
            with pytest.raises(BadParameter, match="too many states"):
                open_position(session, seat).forecast(action)
            continue
        outlook = open_position(session, seat).forecast(action)
        assert outlook.probabilities.sum() == pytest.approx(1.0)
        assert len(outlook.outcomes) == len(outlook.probabilities)
        assert (np.diff(outlook.probabilities) <= 0.0).all()
        assert format_forecast(open_position(session, seat), outlook).startswith(
            f"if {problem.format_action(seat, action)}"
        )
        assert not session.turns


def test_a_fully_observable_forecast_has_the_exact_transition_probabilities() -> None:
    before = create_session("hexworld")
    outlook = open_position(before, 0).forecast(5)
    p, outcome = enumerate_outcomes(before.problem, before.state[None], np.array([[5]]))
    assert dict(zip(outlook.outcomes.tolist(), outlook.probabilities.tolist(), strict=True)) == (
        dict(zip(outcome.state[0].tolist(), p[0].tolist(), strict=True))
    )
    assert (
        format_forecast(open_position(before, 0), outlook)
        == "if se: 0.70 (8,1), 0.15 (8,2), 0.15 (7,1)"
    )


def test_a_forecast_from_a_belief_lists_observations_and_posterior_beliefs() -> None:
    before = create_session("crying-baby", 2, 2)
    outlook = open_position(before, 0).forecast(1)
    prior = before.view(0).belief
    assert outlook.beliefs is not None
    for observation, chance, posterior in zip(
        outlook.outcomes, outlook.probabilities, outlook.beliefs, strict=True
    ):
        after = belief.update_belief(before.problem, prior, [1], [int(observation)])
        assert chance == pytest.approx(float(after.likelihood))
        assert posterior == pytest.approx(after.belief)


def test_a_forecast_does_not_depend_on_the_hidden_state() -> None:
    problem, dice = dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(7)
    low_session, high_session = (
        Session(problem, dice, initial_uniforms=np.array([u])) for u in (0.1, 0.9)
    )
    assert int(low_session.state) != int(high_session.state)
    first, second = (
        format_forecast(open_position(session, 0), open_position(session, 0).forecast(0))
        for session in (low_session, high_session)
    )
    assert first == second


def test_continuous_outcomes_are_forecast_from_samples_and_labelled_as_samples() -> None:
    before = create_session("simple-regulator")
    outlook = open_position(before, 0).forecast(0.2)
    assert outlook.is_sampled
    assert len(outlook.outcomes) == SAMPLE_COUNT
    position = float(before.state[0])
    assert outlook.outcomes.mean() == pytest.approx(position + 0.2, abs=0.01)
    assert outlook.outcomes.std() == pytest.approx(0.1, abs=0.01)
    assert format_forecast(open_position(before, 0), outlook).endswith(f"({SAMPLE_COUNT} samples)")


def test_other_agents_are_assumed_random_and_the_forecast_says_so() -> None:
    before = create_session("prisoners-dilemma")
    line = (
        "if defect and the other agent acts at random: "
        "reward 0 if cooperate, -3 if defect; -1.5 on average"
    )
    position = open_position(before, 0)
    assert format_forecast(position, position.forecast(1)) == line


def test_an_inactive_agent_is_not_assumed_to_act_at_random() -> None:
    before = Session(Nim(), SeededUniforms(7))
    assert (
        format_forecast(open_position(before, 0), open_position(before, 0).forecast(0))
        == "if one: 1.00 6-right"
    )


def test_an_illegal_action_cannot_be_forecast() -> None:
    before = create_session("2048", 0)
    legal = before.legal_actions_mask(0)
    assert legal is not None
    with pytest.raises(IllegalAction):
        open_position(before, 0).forecast(int(np.flatnonzero(~legal)[0]))


# On the screen and as typed commands


def test_forecast_mode_shows_each_pressed_action_and_enter_plays_the_last() -> None:
    display = create_screen("hexworld")
    steps = []
    for key in ("W", "l", "n"):
        handle_key(display, key)
        steps.append(
            (display.message, display.frame_state.forecast and display.frame_state.forecast.action)
        )
    assert [action for _, action in steps] == [None, 0.0, 5.0]
    assert steps[2][0] == "if se: 0.70 (8,1), 0.15 (8,2), 0.15 (7,1)"
    assert not display.game.session.turns
    handle_key(display, "enter")
    assert [turn.actions[0] for turn in display.game.session.turns] == [5]
    assert display.frame_state.forecast is None
    assert display.modes.display_mode is Mode.BOARD


def test_a_forecast_on_a_large_board_is_not_repeated_below_it() -> None:
    expected = {
        (80, 24): "what if se? Enter plays it, Esc cancels",
        (50, 14): "if se: 0.70 (8,1), 0.15 ",
    }
    for size, text in expected.items():
        assert text in play_keys(make_game("hexworld"), "W", "n", size=size).last


@pytest.mark.parametrize("key", ["escape", "W", "L", "tab"])
def test_any_other_key_leaves_forecast_mode(key: str) -> None:
    display = create_screen("hexworld")
    for pressed_key in ("W", "l", key):
        handle_key(display, pressed_key)
    assert display.modes.display_mode is Mode.BOARD
    assert display.frame_state.forecast is None
    assert not display.game.session.turns
    handle_key(display, "n")
    assert len(display.game.session.turns) == 1


def test_two_arrow_keys_forecast_a_diagonal_without_playing_it() -> None:
    display = create_screen("hexworld")
    for key in ("W", "down", "right"):
        handle_key(display, key)
    assert display.frame_state.forecast is not None
    assert display.frame_state.forecast.action == 5.0
    assert not display.game.session.turns


def test_enter_forecasts_a_number_and_a_second_enter_plays_it() -> None:
    display = create_screen("simple-regulator")
    for key in ("W", ".", "2", "enter"):
        handle_key(display, key)
    assert display.message.startswith("if 0.2: ")
    handle_key(display, "enter")
    assert [float(turn.actions[0]) for turn in display.game.session.turns] == [0.2]


def test_forecasts_of_one_turn_count_as_one_hint() -> None:
    display = create_screen("hexworld")
    for key in ("W", "l", "n", "escape"):
        handle_key(display, key)
    run_line(display.controller, "whatif e")
    assert display.game.session.hint_counts == {"agent": 1}


def test_a_game_with_strict_hints_shows_no_forecast() -> None:
    session = Session(dmplay.load_problem("hexworld"), dmplay.SeededUniforms(7))
    strict_game = make_session_game(
        "hexworld", session, ["human"], GameRequest("hexworld", strict="hints")
    )
    frames = play_keys(strict_game, "W", "n").frames
    assert "this game forbids hints" in frames[1]
    assert len(session.turns) == 1
    with pytest.raises(BadParameter, match="this game forbids hints"):
        run_line(GameController(strict_game), "whatif e")


def test_the_whatif_command_requires_an_action() -> None:
    controller = GameController(make_game("crying-baby"))
    assert run_line(controller, "whatif feed").startswith(
        "if feed: 0.90 quiet (then belief sated: 1.00)"
    )
    with pytest.raises(BadParameter, match="expected an action"):
        run_line(controller, "whatif")


def test_a_typed_forecast_stays_on_the_board_until_the_next_action() -> None:
    display = create_screen("hexworld")
    run_typed_line(display, "whatif e")
    assert display.frame_state.forecast is not None
    handle_key(display, "l")
    assert display.frame_state.forecast is None
