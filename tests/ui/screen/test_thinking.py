"""Tests of slow computations in the background: they are shown, and can be cancelled or
abandoned.
"""

import io
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import pytest

from dmplay.core.arrays import Array
from dmplay.core.chance import Chance
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.background_tasks import BackgroundTask, TaskCancelled, TaskInfo, run_cancellable
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.seats import HUMAN
from dmplay.registry import problems
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen import event_loop
from dmplay.ui.screen.busy_keys import BusyKeyAction, classify_busy_key
from dmplay.ui.shell.plain_mode import SentenceReporter, play_by_lines
from tests.support.screens import ScreenRun, make_game, make_session_game, play_keys, press_keys
from tests.support.slow_agents import PROGRESS_EVENT, RELEASE_EVENT, SlowAgent, SlowHeap
from tests.support.user_problems import Heap

WAIT_FOR_PROGRESS = "share"
DILEMMA = problems.resolve_problem("prisoners-dilemma", {}).problem


@pytest.fixture(autouse=True)
def _thinking_events() -> Iterator[None]:
    """Clear the events before a test, and release every thinking agent after it."""
    RELEASE_EVENT.clear()
    PROGRESS_EVENT.clear()
    yield
    RELEASE_EVENT.set()


def make_dilemma(*agents: SlowAgent) -> Game:
    """Make a prisoner's dilemma of a person and an agent, or of two agents."""
    people = [None] * (2 - len(agents))
    session = Session(DILEMMA, SeededUniforms(5), [*people, *agents], turn_limit=4)
    return make_session_game(
        "prisoners-dilemma", session, [*[HUMAN] * len(people), *["deep"] * len(agents)]
    )


def make_heap_game() -> Game:
    return make_session_game("heap", Session(SlowHeap(), SeededUniforms(5), turn_limit=2), [HUMAN])


def press_with_waits(game: Game, *keys: str, motion: bool = True) -> ScreenRun:
    """Press keys, each after a frame; every slow computation is shown immediately."""
    return press_keys(game, iter_keys_with_waits(keys), (80, 24), moment=0.0, motion=motion)


def iter_keys_with_waits(keys: Sequence[str]) -> Iterator[str]:
    """Yield keys; for WAIT_FOR_PROGRESS, yield empty keys until the computation has begun."""
    for key in keys:
        while key == WAIT_FOR_PROGRESS and not PROGRESS_EVENT.is_set():
            yield ""
        yield "" if key == WAIT_FOR_PROGRESS else key


def iter_keys_until_reviewed(game: Game) -> Iterator[str]:
    """Yield keys that end a heap game, empty keys until its review is ready, and one more key."""
    yield from ("1", "1")
    while not game.verdict.choices:
        yield ""
    yield "z"


def test_a_turn_of_people_is_played_in_the_thread_of_the_screen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    threads = list[str]()

    class WatchedTask(BackgroundTask):
        def __init__(self, action: Callable[[], None]) -> None:
            threads.append("background")
            super().__init__(action)

    monkeypatch.setattr(event_loop, "BackgroundTask", WatchedTask)
    game = make_game("hexworld", turns=4)
    assert play_keys(game, "h", "h", "h").code == 0
    assert len(game.session.turns) == 3
    assert not threads
    play_keys(make_game("hexworld", turns=4), "tab")
    assert threads == ["background"], "a hint may take long"


def test_hints_are_imported_when_the_game_starts() -> None:
    """Ask for a hint some time after the first frame: no module of the package is then loaded."""
    code = (
        "import sys, threading\n"
        "from dmplay.game.launch_requests import GameRequest\n"
        "from dmplay.game.game_setup import start_new_game\n"
        "from pathlib import Path\n"
        "game = start_new_game(GameRequest('hexworld', seed=7, record_path=Path('/dev/null')))\n"
        "game.import_hint_agents()\n"
        "before = {*sys.modules}\n"
        "game.hint_provider.create_hint()\n"
        "assert not [name for name in {*sys.modules} - before if name.startswith('dmplay')]\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_a_thinking_agent_is_named_with_its_progress() -> None:
    game = make_dilemma(SlowAgent())
    frames = press_with_waits(game, "c", WAIT_FOR_PROGRESS, "c-c").frames
    progress_frame = next(frame for frame in frames if "42%" in frame)
    assert " deep is thinking ... 42%. Ctrl-C cancels\n" in progress_frame
    assert "turn 0/4" in progress_frame
    assert "c=cooperate  d=defect" in progress_frame
    assert "cancelled" in frames[-1]


def test_without_motion_thinking_is_reported_once() -> None:
    result = press_with_waits(make_dilemma(SlowAgent()), "c", "c-c", motion=False)
    assert result.written.count("deep is thinking ... Ctrl-C cancels") == 1
    assert "%" not in result.written


@pytest.mark.parametrize("key", ["c-c", "escape", "backspace"])
def test_a_cancelled_turn_can_be_played_again_with_the_same_actions(key: str) -> None:
    game, other = make_dilemma(SlowAgent()), make_dilemma(SlowAgent())
    assert "cancelled" in press_with_waits(game, "c", "d", "x", key).last
    assert game.session.turns == []
    RELEASE_EVENT.set()
    assert "turn 1/4" in play_keys(game, "c").last
    other.choose(0)
    assert [*game.session.turns[0].actions] == [*other.session.turns[0].actions]
    assert len(game.session.turns) == 1


@pytest.mark.parametrize("key", ["q", "c-d"])
@pytest.mark.parametrize("stops_when_cancelled", [True, False])
def test_a_game_can_be_quit_while_an_agent_thinks(key: str, stops_when_cancelled: bool) -> None:
    game = make_dilemma(SlowAgent(can_be_cancelled=stops_when_cancelled))
    assert press_with_waits(game, "c", "?", key).code == 0
    assert game.session.turns == []


def test_an_agent_that_ignores_cancelling_is_abandoned_and_its_action_dropped() -> None:
    game = make_dilemma(SlowAgent(can_be_cancelled=False))
    last = press_with_waits(game, "c", "c-c").last
    assert "cancelled; play on. The computation still runs to its end in the background" in last
    RELEASE_EVENT.set()
    assert "turn 1/4" in play_keys(game, "d").last
    assert game.session.turns[0].actions[0] == 1
    assert len(game.session.turns) == 1


def test_autoplay_can_be_paused_while_an_agent_thinks() -> None:
    game = make_dilemma(SlowAgent(), SlowAgent())
    result = press_with_waits(game, "P", WAIT_FOR_PROGRESS, "P", "z")
    assert any("deep is thinking ... 42%" in frame for frame in result.frames)
    assert "z: no such key" in result.last
    assert game.session.turns == []


def test_a_hint_is_cancelled_by_playing_an_action() -> None:
    game = make_heap_game()
    result = press_with_waits(game, "tab", WAIT_FOR_PROGRESS, "tab", "1")
    assert any("computing a hint ... 25%. Ctrl-C cancels" in frame for frame in result.frames)
    assert "turn 1/2" in result.last
    assert len(game.session.turns) == 1


@pytest.mark.parametrize("request_key", ["tab", "V"])
@pytest.mark.parametrize("key", ["c-c", "escape"])
def test_a_cancelled_hint_or_overlay_does_not_end_the_game(request_key: str, key: str) -> None:
    game = make_heap_game()
    result = press_with_waits(game, request_key, key, "z")
    assert any(frame.endswith(": command") and "\n cancelled\n" in frame for frame in result.frames)
    assert "z: no such key" in result.last
    assert game.session.turns == []


def test_a_command_can_be_typed_while_a_hint_is_computed() -> None:
    assert "turn 1. " in press_with_waits(make_heap_game(), "tab", ":", "one enter").last


def test_a_hint_requested_by_command_can_be_cancelled() -> None:
    result = press_with_waits(make_heap_game(), ":", "hint enter", WAIT_FOR_PROGRESS, "c-c")
    assert any("computing a hint ... 25%" in frame for frame in result.frames)
    assert "\n cancelled\n" in result.last


def test_a_finished_game_is_shown_while_it_is_reviewed() -> None:
    result = press_with_waits(make_heap_game(), "1", "1", "", "L", "")
    review_frame = next(frame for frame in result.frames if "reviewing your actions" in frame)
    assert "over: you played all 2 turns" in review_frame
    assert "reviewing" not in result.last
    assert "choices:" not in result.last


def test_a_review_that_is_ready_before_it_is_cancelled_is_shown() -> None:
    RELEASE_EVENT.set()
    game = make_heap_game()
    assert (
        "choices: best action"
        in press_keys(game, iter_keys_until_reviewed(game), (80, 24), moment=0.0).last
    )


@dataclass(frozen=True)
class InterruptedHeap(Heap):
    """A heap that raises KeyboardInterrupt when the chances of several states are computed."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        if len(s) > 1:
            raise KeyboardInterrupt
        return super().chance(s, a)


@pytest.mark.parametrize("command", ["hint", "values", "policy"])
def test_ctrl_c_during_a_hint_does_not_end_a_plain_game(
    command: str, capsys: pytest.CaptureFixture[str]
) -> None:
    table = GameController(
        make_session_game(
            "heap", Session(InterruptedHeap(), SeededUniforms(5), turn_limit=2), [HUMAN]
        )
    )
    plain = Terminal(False, "--plain", True, False, False)
    play_by_lines(table, plain, io.StringIO(f"{command}\none\nquit\n"), SentenceReporter(plain))
    lines = capsys.readouterr().out.split("\n")
    assert lines[2] == "action> cancelled."
    assert lines[3].startswith("action> turn 1. ")


def test_ctrl_c_while_an_agent_thinks_ends_a_plain_game() -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as error:
        run_cancellable(AGENT_MOVE_TASK, interrupted)
    assert not isinstance(error.value, TaskCancelled)


AGENT_MOVE_TASK = TaskInfo("optimal is thinking", is_agent_move=True)
HINT_TASK = TaskInfo("computing a hint")


@pytest.mark.parametrize(
    ("task_info", "acting_keys", "cancelling_keys"),
    [
        (AGENT_MOVE_TASK, {"q", "c-d"}, {"c-c", "escape", "backspace", "P", "A"}),
        (HINT_TASK, {"q", "c-d", "backspace", "P", "A", ":", "h", "?"}, {"c-c", "escape"}),
    ],
)
def test_each_key_during_thinking_is_ignored_cancels_or_acts(
    task_info: TaskInfo, acting_keys: set[str], cancelling_keys: set[str]
) -> None:
    keys = ("q", "c-d", "c-c", "escape", "backspace", "P", "A", ":", "h", "?", "tab")
    action_by_key = {key: classify_busy_key(key, task_info, "tab") for key in keys}
    assert {
        key for key in keys if action_by_key[key] is BusyKeyAction.CANCEL_THEN_RUN
    } == acting_keys
    assert {key for key in keys if action_by_key[key] is BusyKeyAction.CANCEL} == cancelling_keys
