"""In a real terminal a hidden entry writes as many bytes a key whatever is chosen."""

from pathlib import Path

import pytest

from tests.privacy.pairs import LOOKED_AT, Side, pair
from tests.support.terminals import BACKSPACE, CTRL_D, ENTER, Terminal

pytestmark = pytest.mark.slow  # real terminals
TEAM = "multicaregiver-crying-baby"
ERASE = "\x15"  # Ctrl-U


def written(terminal: Terminal, key: str, seen: str = "") -> int:
    """How many bytes are written for a key, which shows this."""
    before = len(terminal.raw)
    terminal.press(key, seen).calm(0.1)
    return len(terminal.raw) - before


@pytest.mark.parametrize(
    ("name", "choices", "next_"),
    [
        ("rock-paper-scissors", ["r", "p", "s", "1"], "agent2 chooses;"),
        ("prisoners-dilemma", ["c", "d", "1", "2"], "agent2 chooses;"),
        ("travelers-dilemma", ["25\r", "37\r", "99\r"], "agent2 chooses;"),
        ("predator-prey", ["l", "h", "1"], "prey chooses"),
        (TEAM, ["f", "s", "i"], "caregiver2 is next"),
    ],
)
def test_every_choice_on_the_screen_writes_alike(
    name: str, choices: list[str], next_: str, tmp_path: Path
) -> None:
    with Terminal(name, "--vs", "human", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().calm()
        counts = []
        for choice in (choices[0], *choices):
            counts.append([written(terminal, key) for key in choice[:-1]])
            counts[-1].append(written(terminal, choice[-1], next_))
            curtained = [ENTER] if name == TEAM else []
            for key in (*curtained, BACKSPACE, *curtained):
                terminal.press(key).calm(0.1)
            terminal.until(lambda: next_ not in terminal.text).calm(0.1)
    assert counts[1:] == [counts[1]] * len(choices)  # the first was typed on another screen


def test_every_letter_in_the_shell_writes_alike(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play rock-paper-scissors --vs human\r", "t0 agent1]>").calm()
        empty, counts, entered = terminal.text, set(), set()
        for word in ("rock", "paper", "scissors", "nonsens", "\t"):
            for letter in word:
                counts.add(written(terminal, letter))
            assert terminal.text == empty
            terminal.press(ERASE).calm(0.1)
        for word in ("rock", "paper", "scissors"):
            terminal.press(word).calm(0.1)
            entered.add(written(terminal, ENTER, "agent2]>"))
            terminal.press("undo\r").calm()
        assert len(counts) == len(entered) == 1
        terminal.press(CTRL_D)
        assert terminal.ended() == 0


def test_no_letter_at_a_plain_prompt_is_written(tmp_path: Path) -> None:
    words = ("rock-paper-scissors", "--vs", "human", "--seed", "7", "--plain")
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.until("agent1 action>").calm()
        assert {written(terminal, letter) for letter in "scissors"} == {0}


@pytest.mark.parametrize("front", ["plain", "shell"])
def test_the_second_of_two_people_is_shown_the_same_whatever_the_first_saw_and_chose(
    front: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    twins = pair(TEAM, 1)
    shown = []
    for number, side in enumerate(twins.sides):
        place = tmp_path / str(number)
        place.mkdir()
        monkeypatch.chdir(place)
        unfinished(side)
        words = ("resume", "game.dmt", "--plain") if front == "plain" else ("shell",)
        with Terminal(*words, folder=place) as terminal:
            if front == "shell":
                terminal.ready().press("load game.dmt\r", f"t{LOOKED_AT} caregiver1]>")
            shown.append(seen(terminal, twins.problem.format_action(0, side.actions[-1][0])))
    assert shown[0] == shown[1]


def unfinished(side: Side) -> None:
    """Leaves a game of two people before its last turn, as a kill does."""
    game = pair(TEAM, 1).begun(side, Path("game.dmt"), alone=False)
    for joint in side.actions[:LOOKED_AT]:
        for action in joint:
            game.choose(action)
    assert game.recorder
    game.recorder.close()


def seen(terminal: Terminal, action: str) -> list[str]:
    """All that stands on the terminal from the curtain on, up to the second person's choice."""
    terminal.until("caregiver1").calm().press(f"{action}\r", "caregiver2 is next").calm()
    shown = [terminal.text]
    for line in ("", "look", "state", "transcript", "hint", "nonsense"):
        shown.append(terminal.press(f"{line}\r").calm().text)
    assert "that cannot be played" in shown[-1]
    return shown
