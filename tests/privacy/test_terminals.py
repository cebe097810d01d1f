"""In a real terminal a hidden entry writes the same number of bytes per key for every choice."""

from pathlib import Path

import pytest

from tests.privacy.indistinguishable_pairs import SHARED_TURNS, Side, find_pair
from tests.support.terminals import BACKSPACE, CTRL_D, ENTER, Terminal

pytestmark = pytest.mark.slow  # real terminals
TEAM_PROBLEM = "multicaregiver-crying-baby"
ERASE_LINE_KEY = "\x15"  # Ctrl-U


def count_written_bytes(terminal: Terminal, key: str, expected_text: str = "") -> int:
    """Return the number of bytes that are written for a key, which shows this text."""
    before = len(terminal.raw)
    terminal.press(key, expected_text).calm(0.1)
    return len(terminal.raw) - before


@pytest.mark.parametrize(
    ("name", "choices", "next_"),
    [
        ("rock-paper-scissors", ["r", "p", "s", "1"], "agent2 chooses now;"),
        ("prisoners-dilemma", ["c", "d", "1", "2"], "agent2 chooses now;"),
        ("travelers-dilemma", ["25\r", "37\r", "99\r"], "agent2 chooses now;"),
        ("predator-prey", ["l", "h", "1"], "prey chooses"),
        (TEAM_PROBLEM, ["f", "s", "i"], "pass the keyboard to caregiver2"),
    ],
)
def test_every_choice_on_the_screen_writes_equally_many_bytes(
    name: str, choices: list[str], next_: str, tmp_path: Path
) -> None:
    with Terminal(name, "--vs", "human", "--seed", "7", folder=tmp_path) as terminal:
        terminal.ready().calm()
        counts = []
        for choice in (choices[0], *choices):
            counts.append([count_written_bytes(terminal, key) for key in choice[:-1]])
            counts[-1].append(count_written_bytes(terminal, choice[-1], next_))
            handover_keys = [ENTER] if name == TEAM_PROBLEM else []
            for key in (*handover_keys, BACKSPACE, *handover_keys):
                terminal.press(key).calm(0.1)
            terminal.until(lambda: next_ not in terminal.text).calm(0.1)
    assert counts[1:] == [counts[1]] * len(choices)  # the first was typed on another screen


def test_every_letter_in_the_shell_writes_equally_many_bytes(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play rock-paper-scissors --vs human\r", "t0 agent1]>").calm()
        empty, counts, entered = terminal.text, set(), set()
        for word in ("rock", "paper", "scissors", "nonsens", "\t"):
            for letter in word:
                counts.add(count_written_bytes(terminal, letter))
            assert terminal.text == empty
            terminal.press(ERASE_LINE_KEY).calm(0.1)
        for word in ("rock", "paper", "scissors"):
            terminal.press(word).calm(0.1)
            entered.add(count_written_bytes(terminal, ENTER, "agent2]>"))
            terminal.press("undo\r").calm()
        assert len(counts) == len(entered) == 1
        terminal.press(CTRL_D)
        assert terminal.ended() == 0


def test_no_letter_at_a_plain_prompt_is_written(tmp_path: Path) -> None:
    arguments = ("rock-paper-scissors", "--vs", "human", "--seed", "7", "--plain")
    with Terminal(*arguments, folder=tmp_path) as terminal:
        terminal.until("agent1 action>").calm()
        assert {count_written_bytes(terminal, letter) for letter in "scissors"} == {0}


@pytest.mark.parametrize("front", ["plain", "shell"])
def test_the_second_person_sees_the_same_for_every_observation_and_choice_of_the_first(
    front: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    twins = find_pair(TEAM_PROBLEM, 1)
    screens = []
    for number, side in enumerate(twins.sides):
        folder = tmp_path / str(number)
        folder.mkdir()
        monkeypatch.chdir(folder)
        leave_unfinished_game(side)
        arguments = ("resume", "game.dmt", "--plain") if front == "plain" else ("shell",)
        with Terminal(*arguments, folder=folder) as terminal:
            if front == "shell":
                terminal.ready().press("load game.dmt\r", f"t{SHARED_TURNS} caregiver1]>")
            screens.append(
                read_handover_screens(terminal, twins.problem.format_action(0, side.actions[-1][0]))
            )
    assert screens[0] == screens[1]


def leave_unfinished_game(side: Side) -> None:
    """Leave a game of two people before its last turn, as a kill does."""
    game = find_pair(TEAM_PROBLEM, 1).begun(side, Path("game.dmt"), alone=False)
    for joint in side.actions[:SHARED_TURNS]:
        for action in joint:
            game.choose(action)
    assert game.recorder
    game.recorder.close()


def read_handover_screens(terminal: Terminal, action: str) -> list[str]:
    """Return the texts on the terminal from the handover to the second person's choice."""
    notice = "pass the keyboard to caregiver2"
    terminal.until("caregiver1").calm().press(f"{action}\r", notice).calm()
    screens = [terminal.text]
    for line in ("", "look", "state", "transcript", "hint", "nonsense"):
        screens.append(terminal.press(f"{line}\r").calm().text)
    assert "not a legal action" in screens[-1]
    return screens
