"""Slides of 2048 are seen to happen, in a few steps that nobody waits for."""

import pytest
from prompt_toolkit.input import create_pipe_input

from dmplay.game.table import GameController
from dmplay.painting.painter import Painter
from dmplay.screen import toolkit
from dmplay.screen.acts import step_agents
from dmplay.screen.motion import ANIMATION_STEPS
from dmplay.screen.press import handle_key
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal
from tests.support.screens import Easel, Paper, Watched, game, play

FULL = Terminal(True, "", True, True, False)
LONG = 60.0  # seconds: no step comes while a test runs
CORNER = ("down", "left", "down", "left")


def screen(*seats: str, motion: bool = True, speed: float = 2.0, name: str = "2048") -> PlayScreen:
    return PlayScreen(GameController(game(name, *seats)), FULL._replace(motion=motion), speed)


def looks(shown: PlayScreen) -> list[str]:
    """What is on the screen, step after step, until nothing moves."""
    easel = Easel(Paper(), 80, 24)
    easel.enter_screen()
    found = []
    while True:
        shown.paint(easel)
        found.append(easel.paper.text)
        if not shown.animation.is_running:
            return found
        shown.animation.advance()


def test_a_slide_is_seen_in_a_few_steps_and_ends_as_one_without_them() -> None:
    moving, still = screen(), screen(motion=False)
    for key in CORNER:
        handle_key(moving, key)
        handle_key(still, key)
        steps = looks(moving)
        assert len({*steps}) == len(steps) == ANIMATION_STEPS + 1
        assert looks(still) == steps[-1:]


def test_a_key_cuts_the_slide_before_it_short() -> None:
    moving, still = screen(), screen(motion=False)
    for key in (*CORNER, ":"):
        handle_key(moving, key)
        handle_key(still, key)
    assert not moving.animation.is_running
    assert looks(moving) == looks(still)


class Hasty(Watched):
    """A screen that is given its next key at every step."""

    def paint(self, painter: Painter) -> None:
        """Paints, and looks at once."""
        self.animation.step_seconds = LONG
        PlayScreen.paint(self, painter)
        self._look(None)


def test_no_key_waits_for_a_slide() -> None:
    played, paper = game("2048"), Paper()
    with create_pipe_input() as pipe:
        hasty = Hasty(played, CORNER, pipe, paper, motion=True)
        hasty.thinking_delay_seconds = LONG
        toolkit.run_event_loop(hasty, Easel(paper, 80, 24), pipe)
    assert len(played.session.turns) == len(CORNER)
    assert len(hasty.frames) == 1 + len(CORNER), "every key has its frame, and none a second"


def test_steps_come_by_themselves() -> None:
    assert play(game("2048"), *CORNER).last == looks(_after(CORNER))[-1]


def _after(keys: tuple[str, ...]) -> PlayScreen:
    still = screen(motion=False)
    for key in keys:
        handle_key(still, key)
    return still


@pytest.mark.parametrize(("speed", "moves"), [(2.0, True), (20.0, False)])
def test_agents_that_play_faster_than_a_slide_are_not_seen_to_slide(
    speed: float, moves: bool
) -> None:
    watched = screen("corner", speed=speed)
    step_agents(watched)
    assert watched.animation.is_running == moves


def test_what_is_taken_back_does_not_slide_and_other_problems_stand_still() -> None:
    moving, other = screen(), screen(name="hexworld")
    for key in ("down", "backspace"):
        handle_key(moving, key)
    handle_key(other, "l")
    assert (len(moving.game.session.turns), len(other.game.session.turns)) == (0, 1)
    assert [shown.animation.is_running for shown in (moving, other)] == [False, False]
