"""What tells games apart is found: leaks are planted, one in each place that is looked at."""

from pathlib import Path

import numpy as np
import pytest

from dmplay.chance import Array, Bools
from dmplay.game.account import Narrator
from dmplay.game.game import Game
from dmplay.painting.painter import Painter
from dmplay.views import generic
from dmplay.words import commands
from dmplay.words.commands import Command
from tests.privacy.arguments import moves
from tests.privacy.elsewhere import asked, completed, left, outside
from tests.privacy.fronts import FILE, FRONTS, Told, alike, both, readable
from tests.privacy.handing_over import sat
from tests.privacy.pairs import BROUGHT, Pair, Side, pair
from tests.support.brought import Vault

FOUND = "can be told apart"
every_front = pytest.mark.parametrize("front", FRONTS)


@pytest.fixture
def twins() -> Pair:
    """Two games of a user's own problem."""
    return pair(BROUGHT, 0)


@every_front
def test_a_command_that_tells_the_state_is_found(
    front: str, twins: Pair, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tell = Command("tell", "", "", lambda table, _: str(table.game.session.state))
    monkeypatch.setitem(commands.COMMANDS_BY_NAME, "tell", tell)
    lines = [*moves(twins), "tell"]
    with pytest.raises(AssertionError, match=FOUND):
        alike(*both(twins, place, lambda side: FRONTS[front](twins.begun(side, FILE), lines)))


@every_front
def test_a_view_that_tells_the_state_is_found(
    front: str, twins: Pair, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It overhears the state, which no view is given, from the problem."""
    overheard: list[str] = []

    def terminal(self: Vault, s: Array) -> Bools:
        overheard.append(str(s))
        return np.zeros(len(s), bool)

    monkeypatch.setattr(Vault, "terminal", terminal)
    monkeypatch.setattr(generic, "describe_turn", lambda view: overheard[-1])
    monkeypatch.setattr(Narrator, "visible_turn_facts", lambda self, view: {"seen": overheard[-1]})
    lines = moves(twins)
    with pytest.raises(AssertionError, match=FOUND):
        alike(*both(twins, place, lambda side: FRONTS[front](twins.begun(side, FILE), lines)))


def test_a_title_that_tells_the_dice_is_found(
    twins: Pair, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def titled(self: Painter) -> None:
        self.stream.write(f"\x1b]0;{playing[-1].seed}\x07")

    playing: list[Game] = []
    monkeypatch.setattr(Painter, "invalidate", titled)

    def play(side: Side) -> list[Told]:
        playing.append(twins.begun(side, FILE))
        return FRONTS["screen"](playing[-1], [])

    with pytest.raises(AssertionError, match=FOUND):
        alike(*both(twins, place, play))


@pytest.mark.parametrize("name", ["rock-paper-scissors", "multicaregiver-crying-baby"])
def test_a_command_that_tells_the_other_choice_is_found(
    name: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    tell = Command("tell", "", "", lambda table, _: str(table.game._pending_choices))
    monkeypatch.setitem(commands.COMMANDS_BY_NAME, "tell", tell)
    twins = pair(name, 1)
    with pytest.raises(AssertionError, match=FOUND):
        alike(*both(twins, place, lambda side: sat(twins, side, ["tell"])))


def test_a_file_that_others_can_read_is_found(twins: Pair, place: Path) -> None:
    def play(side: Side) -> list[Told]:
        left(twins, side)
        FILE.chmod(0o644)
        return [*readable(place)]

    with pytest.raises(AssertionError, match=FOUND):
        alike(*both(twins, place, play))


def test_a_look_from_another_terminal_is_found(
    twins: Pair, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "replay game.dmt --json --trust" in asked(twins, "replay")
    monkeypatch.setattr(
        "dmplay.game.playback.disclose_transcript", lambda transcript, *_, **__: transcript
    )
    with pytest.raises(AssertionError, match=FOUND):
        outside(twins, monkeypatch, "replay", killed=True)


def test_a_completed_seed_is_found(
    twins: Pair, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of a game whose file says that it is over."""

    def play(side: Side) -> list[Told]:
        left(twins, side, None).end_game()
        return completed(twins, side, monkeypatch)

    with pytest.raises(AssertionError, match=FOUND):
        alike(*both(twins, place, play))
