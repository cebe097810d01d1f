"""What takes long is thought beside the screen: shown, cancelled, and left, the game unharmed."""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import pytest

from dmplay.chance import Array, Chance
from dmplay.dice import SeededUniforms
from dmplay.finding import problems
from dmplay.game.game import Game
from dmplay.game.seats import HUMAN
from dmplay.game.table import GameController
from dmplay.screen.meanwhile import BusyKeyAction, classify_busy_key
from dmplay.session import Session
from dmplay.terminal import Terminal
from dmplay.thought import TaskCancelled, TaskInfo, run_cancellable
from dmplay.words.plain import SentenceReporter, play_by_lines
from tests.support.brought import Heap
from tests.support.screens import Played, play, press, seated
from tests.support.thinkers import BEGUN, RELEASED, Deep, Vast

SHARE = "share"
DILEMMA = problems.resolve_problem("prisoners-dilemma", {}).problem


@pytest.fixture(autouse=True)
def _released() -> Iterator[None]:
    """Nobody thinks on after a test."""
    RELEASED.clear()
    BEGUN.clear()
    yield
    RELEASED.set()


def against(*agents: Deep) -> Game:
    """A dilemma of a person and an agent, or of agents alone."""
    people = [None] * (2 - len(agents))
    session = Session(DILEMMA, SeededUniforms(5), [*people, *agents], turn_limit=4)
    return seated("prisoners-dilemma", session, [*[HUMAN] * len(people), *["deep"] * len(agents)])


def heap() -> Game:
    return seated("heap", Session(Vast(), SeededUniforms(5), turn_limit=2), [HUMAN])


def played(game: Game, *keys: str, motion: bool = True) -> Played:
    """Keys, each after a frame, and what is not there at once is a thought."""
    return press(game, waited(keys), (80, 24), moment=0.0, motion=motion)


def waited(keys: Sequence[str]) -> Iterator[str]:
    """Keys, with frames between until the share is shown where a key is to wait for it."""
    for key in keys:
        while key == SHARE and not BEGUN.is_set():
            yield ""
        yield "" if key == SHARE else key


def until_judged(game: Game) -> Iterator[str]:
    """Keys that end a heap, then frames until it was looked back at, and one after that."""
    yield from ("1", "1")
    while not game.review_lines:
        yield ""
    yield "z"


def test_an_agent_that_thinks_is_named_with_the_share_that_is_done() -> None:
    game = against(Deep())
    frames = played(game, "c", SHARE, "c-c").frames
    shown = next(frame for frame in frames if "42%" in frame)
    assert " deep is thinking ... 42%. Ctrl-C cancels\n" in shown
    assert "turn 0/4" in shown
    assert "c cooperate  d defect" in shown
    assert "cancelled" in frames[-1]


def test_without_motion_a_thought_is_told_once() -> None:
    shown = played(against(Deep()), "c", "c-c", motion=False)
    assert shown.written.count("deep is thinking ... Ctrl-C cancels") == 1
    assert "%" not in shown.written


@pytest.mark.parametrize("key", ["c-c", "escape", "backspace"])
def test_a_move_that_is_cancelled_is_asked_for_again_and_is_the_same(key: str) -> None:
    game, other = against(Deep()), against(Deep())
    assert "cancelled" in played(game, "c", "d", "x", key).last
    assert game.session.turns == []
    RELEASED.set()
    assert "turn 1/4" in play(game, "c").last
    other.choose(0)
    assert [*game.session.turns[0].actions] == [*other.session.turns[0].actions]
    assert len(game.session.turns) == 1


@pytest.mark.parametrize("key", ["q", "c-d"])
@pytest.mark.parametrize("heeds", [True, False])
def test_who_thinks_can_be_left(key: str, heeds: bool) -> None:
    game = against(Deep(heeds=heeds))
    assert played(game, "c", "?", key).code == 0
    assert game.session.turns == []


def test_an_agent_that_does_not_stop_is_left_alone_and_never_moves_for_it() -> None:
    game = against(Deep(heeds=False))
    last = played(game, "c", "c-c").last
    assert "cancelled, but it does not stop: it slows dmplay down until you leave" in last
    RELEASED.set()
    assert "turn 1/4" in play(game, "d").last
    assert game.session.turns[0].actions[0] == 1
    assert len(game.session.turns) == 1


def test_agents_that_play_by_themselves_are_stopped_while_they_think() -> None:
    game = against(Deep(), Deep())
    shown = played(game, "P", SHARE, "P", "z")
    assert any("deep is thinking ... 42%" in frame for frame in shown.frames)
    assert "z: no such key" in shown.last
    assert game.session.turns == []


def test_a_hint_is_cancelled_by_an_action_which_is_played() -> None:
    game = heap()
    shown = played(game, "tab", SHARE, "tab", "1")
    assert any("thinking of a hint ... 25%. Ctrl-C cancels" in frame for frame in shown.frames)
    assert "turn 1/2" in shown.last
    assert len(game.session.turns) == 1


@pytest.mark.parametrize("asks", ["tab", "V"])
@pytest.mark.parametrize("key", ["c-c", "escape"])
def test_advice_is_cancelled_and_the_game_goes_on(asks: str, key: str) -> None:
    game = heap()
    shown = played(game, asks, key, "z")
    assert any(frame.endswith(": command") and "\n cancelled\n" in frame for frame in shown.frames)
    assert "z: no such key" in shown.last
    assert game.session.turns == []


def test_a_command_can_be_typed_in_place_of_a_hint() -> None:
    assert "turn 1. " in played(heap(), "tab", ":", "one enter").last


def test_a_hint_asked_for_in_words_is_cancelled_as_well() -> None:
    shown = played(heap(), ":", "hint enter", SHARE, "c-c")
    assert any("thinking of a hint ... 25%" in frame for frame in shown.frames)
    assert "\n cancelled\n" in shown.last


def test_a_game_that_is_over_is_shown_while_it_is_looked_back_at() -> None:
    shown = played(heap(), "1", "1", "L")
    looks = next(frame for frame in shown.frames if "looking back at your moves" in frame)
    assert "over: turn limit after 2 turns" in looks
    assert "looking back" not in shown.last
    assert "review:" not in shown.last


def test_what_is_over_before_it_is_cancelled_is_looked_back_at() -> None:
    RELEASED.set()
    game = heap()
    assert "review: " in press(game, until_judged(game), (80, 24), moment=0.0).last


@dataclass(frozen=True)
class Interrupted(Heap):
    """A heap of which somebody who thinks gets a Ctrl-C."""

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        if len(s) > 1:
            raise KeyboardInterrupt
        return super().chance(s, a)


@pytest.mark.parametrize("asks", ["hint", "values", "policy"])
def test_ctrl_c_while_a_hint_is_thought_of_stays_in_the_game_in_lines(
    asks: str, capsys: pytest.CaptureFixture[str]
) -> None:
    table = GameController(
        seated("heap", Session(Interrupted(), SeededUniforms(5), turn_limit=2), [HUMAN])
    )
    plain = Terminal(False, "--plain", True, False, False)
    play_by_lines(table, plain, io.StringIO(f"{asks}\none\nquit\n"), SentenceReporter(plain))
    told = capsys.readouterr().out.split("\n")
    assert told[2] == "action> cancelled."
    assert told[3].startswith("action> turn 1. ")


def test_ctrl_c_while_an_agent_thinks_ends_the_game_in_lines() -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt) as caught:
        run_cancellable(MOVE, interrupted)
    assert not isinstance(caught.value, TaskCancelled)


MOVE, HINT = TaskInfo("optimal is thinking", is_agent_move=True), TaskInfo("thinking of a hint")


@pytest.mark.parametrize(
    ("about", "acts", "cancels"),
    [
        (MOVE, {"q", "c-d"}, {"c-c", "escape", "backspace", "P", "A"}),
        (HINT, {"q", "c-d", "backspace", "P", "A", ":", "h", "?"}, {"c-c", "escape"}),
    ],
)
def test_what_a_key_does_meanwhile(about: TaskInfo, acts: set[str], cancels: set[str]) -> None:
    keys = ("q", "c-d", "c-c", "escape", "backspace", "P", "A", ":", "h", "?", "tab")
    told = {key: classify_busy_key(key, about, "tab") for key in keys}
    assert {key for key in keys if told[key] is BusyKeyAction.CANCEL_THEN_RUN} == acts
    assert {key for key in keys if told[key] is BusyKeyAction.CANCEL} == cancels
