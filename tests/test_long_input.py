"""Tests of input that is far too long: messages stay short, and large pastes are dropped."""

import json
from pathlib import Path

import pytest
from prompt_toolkit.input import DummyInput
from prompt_toolkit.input.vt100_parser import Vt100Parser
from prompt_toolkit.key_binding import KeyPress
from prompt_toolkit.keys import Keys

from dmplay import errors
from dmplay.terminal.input_sequences import MAX_PASTE_CHARS, PASTE_END, PASTE_START
from dmplay.ui.screen.key_reader import KeyReader, attach_key_reader
from dmplay.ui.shell.commands import MAX_LINE_CHARS, split_commands
from tests.support.programs import run_dmplay
from tests.support.terminals import Terminal

LONG_WORD = "x" * 1_000_000
LONG_PATH = "y" * 100_000  # as long as a system lets an argument be
MAX_OUTPUT_CHARS = 6000  # of a program that quotes a long word


@pytest.mark.parametrize(
    "error",
    [
        errors.BadParameter(f"got {LONG_WORD!r}, expected a number"),
        errors.UnknownName("agent", LONG_WORD, ["random"], LONG_WORD),
        errors.Forfeit("garbled", f"said {LONG_WORD}, expected JSON", "agent"),
        errors.BadFile("a.pomdp", 3, 7, f"got {LONG_WORD}"),
        errors.LostGames([(n, n + 1) for n in range(10_000)], "killed"),
        errors.BudgetExceeded(LONG_WORD, "too much", "take less"),
    ],
    ids=lambda error: type(error).__name__,
)
def test_a_message_keeps_its_beginning_and_its_end(error: errors.DmplayError) -> None:
    message = str(error)
    assert len(message) == errors.MAX_MESSAGE_CHARS + len(" ... ")
    assert " ... " in message


def test_a_short_message_is_not_clipped() -> None:
    assert str(errors.BadParameter("got 3, expected 4")) == "got 3, expected 4"
    assert str(errors.Forfeit("late", "over 5 s", "agent")) == "agent forfeits, late: over 5 s"


@pytest.mark.parametrize("words", [("hexworld", "--seed", "1"), ("shell",)])
def test_a_long_line_of_a_pipe_is_refused_in_one_line(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    refused = run_dmplay(tmp_path, *words, stdin=f"{LONG_WORD}\n")
    assert refused.returncode == 2
    expected = "error: line 1: got a line of 1000000 characters, expected at most 100000\n"
    assert refused.stderr.startswith(expected)
    assert len(refused.stdout) < MAX_OUTPUT_CHARS


def test_a_long_line_is_an_error_event_in_json_and_the_game_goes_on(tmp_path: Path) -> None:
    words = ("hexworld", "--seed", "1", "--turns", "1", "--json")
    played = run_dmplay(tmp_path, *words, stdin=f"{LONG_WORD}\ne\n")
    events = [json.loads(row) for row in played.stdout.splitlines()]
    assert [event["event"] for event in events] == ["start", "ask", "error", "ask", "turn", "end"]
    assert len(played.stdout) < MAX_OUTPUT_CHARS


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.pomdp", f"discount: {LONG_WORD}\n"),
        ("a.nfg", f"NFG 1 R {LONG_WORD}\n"),
        ("a.dmt", f"dmplay: 1\nproblem: {LONG_WORD[:900_000]}\n"),
        ("a.py", f"raise ValueError({LONG_WORD!r})\n"),
    ],
)
def test_a_long_word_of_a_file_is_clipped_in_the_message(
    name: str, text: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text(text)
    words = ("verify", name) if name == "a.dmt" else ("info", f"./{name}")
    refused = run_dmplay(tmp_path, *words)
    assert refused.returncode in (2, 3)
    assert len(refused.stdout + refused.stderr) < MAX_OUTPUT_CHARS


@pytest.mark.parametrize(
    "words",
    [
        ("verify", LONG_PATH),
        ("grade", f"./{LONG_PATH}/"),
        ("tournament", "prisoners-dilemma", "grim", "random", "-o", LONG_PATH),
        ("run", "hexworld", "--episodes", "2", "--every", "1", "--record", LONG_PATH),
        ("check", f"./{LONG_PATH}.py"),
        ("resume", LONG_PATH),
    ],
    ids=lambda words: words[0],
)
def test_a_long_path_is_refused_in_one_clipped_line(words: tuple[str, ...], tmp_path: Path) -> None:
    refused = run_dmplay(tmp_path, *words)
    assert (refused.returncode, refused.stdout, refused.stderr.count("\n")) == (2, "", 1)
    assert refused.stderr.startswith("error: ")
    assert refused.stderr.endswith("File name too long\n")
    assert len(refused.stderr) < MAX_OUTPUT_CHARS


def test_a_warning_about_a_long_state_folder_is_clipped(tmp_path: Path) -> None:
    words = ("hexworld", "--seed", "1", "-q")
    played = run_dmplay(tmp_path, *words, stdin="e\n", XDG_STATE_HOME=f"/{LONG_PATH}")
    assert played.stderr.startswith("warning: this game is not saved: ")
    assert len(played.stderr) < MAX_OUTPUT_CHARS


def test_a_line_of_commands_has_a_maximum_length() -> None:
    assert len(split_commands("e;" * (MAX_LINE_CHARS // 2))) == MAX_LINE_CHARS // 2
    with pytest.raises(errors.BadParameter, match="got a line of 100001 characters, expected"):
        split_commands("e" * (MAX_LINE_CHARS + 1))


def read_paste(text: str, *, chunk_chars: int = 1024) -> list[KeyPress]:
    """Return the keys that a terminal sends for a bracketed paste followed by Enter."""
    keys: list[KeyPress] = []
    parser = KeyReader(keys.append)
    sent = f"{PASTE_START}{text}{PASTE_END}\r"
    for start in range(0, len(sent), chunk_chars):
        parser.feed(sent[start : start + chunk_chars])
    return keys


@pytest.mark.parametrize("chunk_chars", [1, 7, 1024, 100_000])
def test_a_large_paste_becomes_a_comment_and_the_next_key_works(chunk_chars: int) -> None:
    paste, enter = read_paste("e\n" * 20_000, chunk_chars=chunk_chars)
    assert paste.key is Keys.BracketedPaste
    assert paste.data == "# ignored a paste of 40000 characters, expected at most 10000"
    assert enter.key is Keys.ControlM


@pytest.mark.parametrize("chunk_chars", [1, 1024, 100_000])
def test_a_small_paste_is_typed(chunk_chars: int) -> None:
    paste, _ = read_paste("e" * MAX_PASTE_CHARS, chunk_chars=chunk_chars)
    assert paste.data == "e" * MAX_PASTE_CHARS


def test_a_small_paste_after_a_large_one_is_typed() -> None:
    keys: list[KeyPress] = []
    parser = KeyReader(keys.append)
    for text in (LONG_WORD, "ne"):
        parser.feed(f"{PASTE_START}{text}{PASTE_END}")
    assert keys[0].data.startswith("# ignored a paste of 1000000 ")
    assert keys[1].data == "ne"


def test_a_long_unfinished_paste_is_not_collected() -> None:
    parser = KeyReader(lambda key_press: None)
    for piece in (PASTE_START, *["x" * 1024] * 1000):
        parser.feed(piece)
        assert len(parser.sequences._unfinished) <= MAX_PASTE_CHARS + len(PASTE_END)


def test_the_end_of_a_paste_in_two_pieces_is_found() -> None:
    keys: list[KeyPress] = []
    parser = KeyReader(keys.append)
    for piece in (PASTE_START + "x" * 20_000 + PASTE_END[:4], PASTE_END[4:]):
        parser.feed(piece)
    assert keys[0].data == "# ignored a paste of 20000 characters, expected at most 10000"


def test_an_input_is_limited_once_and_one_without_keys_is_left_alone() -> None:
    class VtInput(DummyInput):
        vt100_parser = Vt100Parser(lambda key_press: None)

    limited = VtInput()
    reader = attach_key_reader(limited)
    assert limited.vt100_parser is reader
    assert attach_key_reader(limited) is reader
    attach_key_reader(unlimited := DummyInput())
    assert not hasattr(unlimited, "vt100_parser")


@pytest.mark.slow
@pytest.mark.parametrize(("words", "first_key"), [(("shell",), ""), (("hexworld",), ":")])
def test_a_large_paste_on_a_terminal_is_dropped_with_one_line(
    words: tuple[str, ...], first_key: str, tmp_path: Path
) -> None:
    with Terminal(*words, folder=tmp_path) as terminal:
        terminal.ready().press(first_key).calm()
        terminal.child.send(PASTE_START)
        for _ in range(200):
            terminal.child.send("x" * 1000)
            terminal.read(0)
        terminal.press(PASTE_END, "# ignored a paste of 200000 characters, expected at most 10000")
