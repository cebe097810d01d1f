"""The step viewer: its keys, its rows in every viewport, and its way back to the game."""

from collections.abc import Iterable

import pytest
from prompt_toolkit.input import PipeInput, create_pipe_input

from dmplay.algorithms.registry import find_algorithm
from dmplay.algorithms.step import WatchRequest
from dmplay.core.work_budget import ComputationStopped
from dmplay.game.watching import WatchedSteps
from dmplay.registry.problems import load_problem
from dmplay.terminal.capabilities import Terminal
from dmplay.terminal.painter import Painter
from dmplay.ui.screen import event_loop
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.shell.commands import PlayerQuit
from dmplay.ui.watch.step_viewer import StepViewer
from tests.support.glyphs import ASCII_CHARACTERS
from tests.support.screens import KEY_SEQUENCES, EmulatedPainter, EmulatedScreen

TERMINAL = Terminal(True, "", True, color=True, ascii=False)
SIZES = [(80, 24), (50, 14), (200, 60), (30, 3), (20, 2), (1, 1), (9, 5)]


def watch(
    algorithm: str = "value-iteration", problem: str = "hexworld", iterations: int | None = None
) -> WatchedSteps:
    """Return the steps of an algorithm on a problem."""
    request = WatchRequest(load_problem(problem), iterations=iterations)
    return WatchedSteps(find_algorithm(algorithm), request, problem)


def open_viewer(
    *keys: str, ascii_: bool = False, watched: WatchedSteps | None = None
) -> StepViewer:
    """Return a viewer after its first frame and these keys."""
    viewer = StepViewer(watched or watch(), TERMINAL._replace(ascii=ascii_))
    for key in ("", *keys):
        viewer.handle_key(key)
    return viewer


def rows_of(viewer: StepViewer, width: int = 80, height: int = 24) -> list[str]:
    """Return the rows of a viewer without trailing blanks."""
    viewport = Viewport(width, height, viewer.terminal.ascii)
    return [row.plain.rstrip() for row in viewer.compose_rows(viewport)]


def title_of(viewer: StepViewer) -> str:
    """Return the title row with single blanks."""
    return " ".join(rows_of(viewer)[0].split())


@pytest.mark.parametrize("ascii_", [False, True])
@pytest.mark.parametrize("size", SIZES)
def test_every_viewport_is_filled_and_does_not_overflow(
    size: tuple[int, int], ascii_: bool
) -> None:
    for keys in ((), ("space", "space"), ("?",), ("1", "2"), ("x",)):
        rows = rows_of(open_viewer(*keys, ascii_=ascii_), *size)
        assert len(rows) == size[1]
        assert max(map(len, rows)) <= size[0]
        assert not ascii_ or {*"".join(rows)} <= ASCII_CHARACTERS


def test_the_first_frame_shows_the_start_and_the_keys() -> None:
    rows = rows_of(open_viewer())
    assert title_of(open_viewer()) == "value-iteration on hexworld step 1: start"
    assert rows[-2] == " book: section 7.5, Value Iteration"
    assert rows[-1] == (
        " Space next  Bksp back  P play  + faster  - slower  End last  ? help  q quit"
    )
    assert rows_of(open_viewer(), 50)[-1] == " Space next  Bksp back  P play  ? help  q quit"


@pytest.mark.parametrize(
    ("keys", "title"),
    [
        (("space",), "step 2: sweep 1"),
        (("right", "enter"), "step 3: sweep 2"),
        (("space", "space", "backspace"), "step 2: sweep 1"),
        (("backspace", "left"), "step 1: start"),
        (("1", "2", "enter"), "step 12: sweep 11"),
        (("1", "2", "backspace", "enter"), "step 1: start"),
        (("7", "escape"), "step 1: start"),
        (("end",), "step 22 of 22: sweep 21"),
        (("end", "home"), "step 1 of 22: start"),
        (("end", "space"), "step 22 of 22: sweep 21"),
    ],
)
def test_keys_move_through_the_steps(keys: tuple[str, ...], title: str) -> None:
    assert title_of(open_viewer(*keys)) == f"value-iteration on hexworld {title}"


def test_a_step_that_does_not_exist_gets_one_line() -> None:
    viewer = open_viewer("9", "9", "enter")
    assert rows_of(viewer)[-2] == (
        " got step 99, expected 1 to 22, the last step of value-iteration"
    )
    assert rows_of(open_viewer("0", "enter"))[-2].startswith(" got step 0, expected 1 to")


def test_the_clock_shows_a_step_at_each_beat_while_playing_and_stops_at_the_end() -> None:
    viewer = open_viewer("P", "", "")
    assert viewer.is_playing
    assert title_of(viewer).endswith("step 3: sweep 2")
    viewer = open_viewer("P", *[""] * 30)
    assert not viewer.is_playing
    assert title_of(viewer).endswith("step 22 of 22: sweep 21")
    viewer.handle_key("P")
    assert title_of(viewer).endswith("step 1 of 22: start"), "it begins again"
    viewer.handle_key("P")
    assert not viewer.is_playing


def test_without_motion_nothing_plays_by_itself() -> None:
    viewer = StepViewer(watch(), TERMINAL._replace(motion=False))
    for key in ("", "P", ""):
        viewer.handle_key(key)
    assert not viewer.is_playing
    assert rows_of(viewer)[-2] == " motion is off (--no-motion); Space shows the next step"


def test_plus_and_minus_change_the_speed_within_limits() -> None:
    assert open_viewer("+").speed == 3.0
    assert open_viewer("+", "-").speed == 2.0
    assert open_viewer(*["+"] * 30).speed == 60.0
    assert open_viewer(*["-"] * 30).speed == 0.1


def test_the_help_lists_the_keys_and_any_key_closes_it() -> None:
    rows = rows_of(open_viewer("?"))
    assert "   Space      show the next step" in rows
    assert title_of(open_viewer("?", "space")).endswith("step 1: start")


@pytest.mark.parametrize("key", ["q", "escape"])
def test_q_and_escape_quit(key: str) -> None:
    with pytest.raises(PlayerQuit):
        open_viewer(key)


def test_a_typed_number_shows_which_step_it_is_if_that_is_known() -> None:
    assert rows_of(open_viewer("space", "2"))[-2] == " step 2 (sweep 1): Enter goes there"
    assert rows_of(open_viewer("space", "9"))[-2] == " step 9: Enter goes there"


def test_backspace_at_the_first_step_says_so() -> None:
    assert rows_of(open_viewer("backspace"))[-2] == " this is the first step"


def test_an_unknown_key_is_reported() -> None:
    assert rows_of(open_viewer("x"))[-2] == " x: no such key; ? lists the keys"


def test_a_computation_that_was_stopped_continues_with_the_same_step() -> None:
    watched = watch()
    original, stops = watched.algorithm.iterate_steps, iter([True])

    def interrupted(request: WatchRequest):  # type: ignore[no-untyped-def]
        for number, step in enumerate(original(request)):
            if number == 3 and next(stops, False):
                raise ComputationStopped
            yield step

    watched.algorithm = watched.algorithm._replace(iterate_steps=interrupted)
    viewer = open_viewer("space", "space", "space", watched=watched)
    assert rows_of(viewer)[-2] == " cancelled"
    viewer.handle_key("space")
    assert title_of(viewer).endswith("step 4: sweep 3")


class KeyFeedingViewer(StepViewer):
    """A viewer that sends its next key after each frame."""

    def feed(
        self, keys: Iterable[str], pipe: PipeInput, paper: EmulatedScreen
    ) -> "KeyFeedingViewer":
        """Set the keys, the pipe that they are sent to and the paper that frames are read from."""
        self.keys, self.pipe, self.paper = iter(keys), pipe, paper
        self.frames: list[str] = []
        return self

    def paint(self, painter: Painter) -> None:
        """Paint a frame, record it and send the next key."""
        super().paint(painter)
        self.frames.append(self.paper.text)
        if len(self.frames) > 1 and not self.is_playing:
            key = next(self.keys, "q")
            self.pipe.send_text(KEY_SEQUENCES.get(key, key))


def run_viewer(*keys: str, speed: float = 2.0) -> list[str]:
    """Return the frames of a viewer that is run by the event loop with these keys."""
    paper = EmulatedScreen()
    with create_pipe_input() as pipe:
        viewer = KeyFeedingViewer(watch(iterations=5), TERMINAL, speed).feed(keys, pipe, paper)
        assert event_loop.run_event_loop(viewer, EmulatedPainter(paper, 80, 24), pipe) == 0
    return viewer.frames


def test_the_event_loop_passes_keys_to_the_viewer() -> None:
    frames = run_viewer("space", "space", "backspace")
    steps = [frame.split("\n", 1)[0].split("step ")[-1].strip() for frame in frames[1:]]
    assert steps == ["1: start", "2: sweep 1", "3: sweep 2", "2: sweep 1"]


def test_the_event_loop_plays_all_steps_by_its_clock() -> None:
    frames = run_viewer("P", speed=50.0)
    assert "sweep 5" in frames[-1]
