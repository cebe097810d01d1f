"""Tests of the slide animation of 2048: it takes a few steps and never delays a key."""

import pytest
from prompt_toolkit.input import create_pipe_input

from dmplay.game.game_series import GameController
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter
from dmplay.ui.screen import event_loop
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_operations import step_agents
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.screen.turn_animation import ANIMATION_STEPS
from tests.support.screens import (
    EmulatedPainter,
    EmulatedScreen,
    ScriptedScreen,
    make_game,
    play_keys,
)

FULL_SCREEN = Terminal(True, "", True, True, False)
LONG_STEP_SECONDS = 60.0  # longer than a test, so that no step happens by itself
CORNER_KEYS = ("down", "left", "down", "left")


def make_screen(
    *seats: str, motion: bool = True, speed: float = 2.0, name: str = "2048"
) -> PlayScreen:
    return PlayScreen(
        GameController(make_game(name, *seats)), FULL_SCREEN._replace(motion=motion), speed
    )


def render_steps(play_screen: PlayScreen) -> list[str]:
    """Return the text of the screen after each step, until nothing moves."""
    painter = EmulatedPainter(EmulatedScreen(), 80, 24)
    painter.enter_screen()
    texts = []
    while True:
        play_screen.paint(painter)
        texts.append(painter.paper.text)
        if not play_screen.animation.is_running:
            return texts
        play_screen.animation.advance()


def test_a_slide_takes_a_few_steps_and_ends_like_one_without_animation() -> None:
    moving, still = make_screen(), make_screen(motion=False)
    for key in CORNER_KEYS:
        handle_key(moving, key)
        handle_key(still, key)
        steps = render_steps(moving)
        assert len({*steps}) == len(steps) == ANIMATION_STEPS + 1
        assert render_steps(still) == steps[-1:]


def test_a_key_ends_the_previous_slide_early() -> None:
    moving, still = make_screen(), make_screen(motion=False)
    for key in (*CORNER_KEYS, ":"):
        handle_key(moving, key)
        handle_key(still, key)
    assert not moving.animation.is_running
    assert render_steps(moving) == render_steps(still)


class ImpatientScreen(ScriptedScreen):
    """A screen that receives its next key at every step of the animation."""

    def paint(self, painter: Painter) -> None:
        """Paint, and take the next key immediately."""
        self.animation.step_seconds = LONG_STEP_SECONDS
        PlayScreen.paint(self, painter)
        self._look(None)


def test_no_key_waits_for_a_slide() -> None:
    current_game, paper = make_game("2048"), EmulatedScreen()
    with create_pipe_input() as pipe:
        impatient_screen = ImpatientScreen(current_game, CORNER_KEYS, pipe, paper, motion=True)
        impatient_screen.thinking_delay_seconds = LONG_STEP_SECONDS
        event_loop.run_event_loop(impatient_screen, EmulatedPainter(paper, 80, 24), pipe)
    assert len(current_game.session.turns) == len(CORNER_KEYS)
    assert len(impatient_screen.frames) == 1 + len(CORNER_KEYS), (
        "every key has its frame, and none a second"
    )


def test_animation_steps_happen_without_keys() -> None:
    assert (
        play_keys(make_game("2048"), *CORNER_KEYS).last
        == render_steps(_make_still_screen(CORNER_KEYS))[-1]
    )


def _make_still_screen(keys: tuple[str, ...]) -> PlayScreen:
    still = make_screen(motion=False)
    for key in keys:
        handle_key(still, key)
    return still


@pytest.mark.parametrize(("speed", "is_animated"), [(2.0, True), (20.0, False)])
def test_agents_faster_than_a_slide_are_not_animated(speed: float, is_animated: bool) -> None:
    play_screen = make_screen("corner", speed=speed)
    step_agents(play_screen)
    assert play_screen.animation.is_running == is_animated


def test_undone_turns_and_other_problems_are_not_animated() -> None:
    moving, other = make_screen(), make_screen(name="hexworld")
    for key in ("down", "backspace"):
        handle_key(moving, key)
    handle_key(other, "l")
    assert (len(moving.game.session.turns), len(other.game.session.turns)) == (0, 1)
    assert [play_screen.animation.is_running for play_screen in (moving, other)] == [False, False]
