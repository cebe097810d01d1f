"""The guide: each topic does what it says, and is drawn for terminal, pipe and pager."""

import os
import textwrap
from pathlib import Path

import pytest

from dmplay.cli import entry
from dmplay.cli.errands import execute_result, interpret_command
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding.topics import GUIDE_FOLDER, list_topics, read_topic, topic_title
from dmplay.reports import guide
from dmplay.reports.drawing import render_for_terminal
from dmplay.reports.pager import print_paged
from dmplay.terminal import Terminal
from tests.support.blocks import TIGER, Reader, blocks
from tests.support.terminals import Terminal as Tty

SCREEN = Terminal(True, "", True, False, False)
PIPE = SCREEN._replace(full_screen=False)
LONG = "\n".join(map(str, range(100)))
every_topic = pytest.mark.parametrize("name", list_topics())
SLOW = ("bots", "mcp", "goldens")  # which start programs, one after another
EVERY = [
    pytest.param(name, marks=pytest.mark.slow if name in SLOW else ()) for name in list_topics()
]


@pytest.mark.parametrize("name", EVERY)
def test_what_a_topic_says_is_what_happens(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Reader(tmp_path, monkeypatch).follow(read_topic(name))


@every_topic
def test_every_block_of_a_topic_is_run(name: str) -> None:
    assert read_topic(name).count("```") == 2 * len(blocks(read_topic(name)))
    assert all(block.runs for block in blocks(read_topic(name)))


@every_topic
def test_a_topic_names_only_topics_and_commands_that_there_are(name: str) -> None:
    named = [words.split()[0] for words in read_topic(name).split("`dmplay guide ")[1:]]
    assert {word.rstrip("`:.,") for word in named} <= {*list_topics()}


def test_the_first_problem_of_the_guide_is_no_longer_than_fifteen_lines() -> None:
    assert len([line for line in TIGER.splitlines() if line.strip()]) <= 15


def test_no_program_of_the_guide_has_fifteen_lines() -> None:
    programs = [block for block in blocks(read_topic("bots")) if block.name]
    assert [one.language for one in programs] == ["python", "awk", "bash", "c"]
    assert all(len(one.code.splitlines()) < 15 for one in programs)


def test_topics_are_in_reading_order_and_titled_by_their_first_lines() -> None:
    assert [*list_topics()][:2] == ["play", "transcripts"]
    assert [*list_topics()][-1] == "league"
    assert topic_title("play") == "Your first game"
    assert len(list_topics()) == len([*GUIDE_FOLDER.iterdir()])


def test_an_unknown_topic_is_told_the_nearest() -> None:
    with pytest.raises(UnknownName, match="unknown topic 'agnets'; did you mean agents"):
        read_topic("agnets")


def test_what_is_raw_is_the_file_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute_result(interpret_command(["guide", "agents", "--raw"])) == 0
    assert capsys.readouterr().out == read_topic("agents")


def test_all_topics_together_are_not_raw() -> None:
    with pytest.raises(BadParameter, match="--raw wants a topic, as agents"):
        interpret_command(["guide", "--raw"])


@every_topic
def test_a_topic_fits_40_columns_but_for_what_is_typed_in_80_and_in_ascii_is_ascii(
    name: str,
) -> None:
    rows = (row for block in blocks(read_topic(name)) for row in block.code.split("\n"))
    typed = {f"    {row}".rstrip().replace("±", "+-") for row in rows}
    able = PIPE._replace(ascii=True, width=40)
    narrow = guide.render_topic(name, able)
    assert all(len(row) <= (80 if row in typed else 40) for row in narrow.plain.split("\n"))
    assert "…" not in narrow.plain
    assert render_for_terminal(narrow, able).isascii()


def test_code_is_drawn_as_it_is_typed() -> None:
    drawn = guide.render_markdown(f"```python\n{TIGER}```\n", 20).plain
    assert textwrap.dedent(drawn) == TIGER.rstrip()


def test_what_is_typed_stands_out_in_a_session() -> None:
    drawn = guide.render_markdown("```console\n$ dmplay list\n2048\n```\n", 80)
    assert drawn.plain == "    $ dmplay list\n    2048"
    bold = [drawn.plain[span.start : span.end] for span in drawn.spans if "bold" in str(span.style)]
    assert "".join(bold) == "$ dmplay list"


@pytest.fixture
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"COLUMNS": "80", "LINES": "24", "PAGER": "sed s/^/>/"}.items():
        monkeypatch.setenv(name, value)


@pytest.mark.usefixtures("_small")
def test_a_text_longer_than_the_screen_goes_through_the_pager(
    capfd: pytest.CaptureFixture[str],
) -> None:
    print_paged(LONG, SCREEN)
    assert capfd.readouterr().out.startswith(">0\n>1\n")
    print_paged("x" * 81, SCREEN)
    assert capfd.readouterr().out == f">{'x' * 81}\n"


@pytest.mark.usefixtures("_small")
def test_words_are_wrapped_on_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    told = f"  agent           {'word ' * 16}\n    {'more ' * 16}"
    print_paged(told, PIPE, wrap_words=True)
    assert capfd.readouterr().out == f"{told}\n"
    print_paged(told, SCREEN, wrap_words=True)
    indented = " " * 18
    assert capfd.readouterr().out.split("\n") == [
        f"  agent           {'word ' * 12}".rstrip(),
        f"{indented}{'word ' * 4}".rstrip(),
        f"    {'more ' * 15}".rstrip(),
        "    more",
        "",
    ]


@pytest.mark.usefixtures("_small")
@pytest.mark.parametrize(
    ("text", "terminal", "pager"),
    [
        (LONG, PIPE, "sed s/^/>/"),
        ("short", SCREEN, "sed s/^/>/"),
        (LONG, SCREEN, ""),
        (LONG, SCREEN, "no-such-pager -R"),
    ],
)
def test_no_pager_is_used_in_a_pipe_for_little_or_where_there_is_none(
    text: str, terminal: Terminal, pager: str, capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setenv("PAGER", pager)
    print_paged(text, terminal)
    assert capfd.readouterr().out == f"{text}\n"


@pytest.mark.usefixtures("_small")
def test_a_pager_that_is_left_early_is_no_fault(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PAGER", "head -1")
    print_paged(LONG * 400, SCREEN)
    assert capfd.readouterr() == ("0\n", "")


@pytest.mark.slow
def test_less_shows_a_topic_in_colour_and_ctrl_c_is_its_own(tmp_path: Path) -> None:
    with Tty("guide", "problems", folder=tmp_path) as tty:
        prompted = b":\x1b[K"  # as less draws it, and anew once it has heard the Ctrl-C
        tty.until("A dozen lines").until(lambda: tty.raw.endswith(prompted))
        tty.calm()  # until less reads: a signal that comes before has it draw nothing anew
        shown = len(tty.raw)
        tty.press("\x03", lambda: tty.raw[shown:].endswith(prompted))
        tty.press("/", lambda: "/" in tty.text.splitlines()[-1])
        tty.press("An installed\r", "An installed problem")
        tty.press("q")
        assert tty.ended() == 0
        assert "\x1b[1mYour own problem" in tty.printed
        assert tty.left_clean()


def test_a_topic_is_completed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    told = {"_DMPLAY_COMPLETE": "complete_bash", "COMP_WORDS": "dmplay guide tr", "COMP_CWORD": "2"}
    for name, value in told.items():
        monkeypatch.setenv(name, value)
    assert entry.run_command_line() == 0
    assert capsys.readouterr().out.split(os.linesep)[0] == "transcripts"
