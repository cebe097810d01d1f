"""Tests of the guide: its examples run, and its pages fit the terminal, the pipe and the pager."""

import os
import re
import sys
import textwrap
from pathlib import Path
from types import FrameType

import pytest

import dmplay
from dmplay.cli import main
from dmplay.cli.parsed_command_runner import execute_result, interpret_command, render_for_terminal
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.guide.topics import GUIDE_FOLDER, list_topics, read_topic, topic_title
from dmplay.output import guide_pages
from dmplay.output.pager import print_paged
from dmplay.registry.builtin_names import problem_names
from dmplay.terminal.capabilities import Terminal
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from tests.support.document_examples import PROJECT_ROOT, TIGER_SOURCE, DocumentRunner, parse_blocks
from tests.support.screens import make_game, play_keys
from tests.support.terminals import Terminal as Tty

SCREEN_TERMINAL = Terminal(True, "", True, False, False)
PIPE_TERMINAL = SCREEN_TERMINAL._replace(full_screen=False)
LONG_TEXT = "\n".join(map(str, range(100)))
each_topic = pytest.mark.parametrize("name", list_topics())
SLOW_TOPICS = ("bots", "goldens", "research")  # topics whose examples start processes
EXTRAS_OF_TOPICS = {
    "libraries": ("gymnasium", "openspiel", "pettingzoo"),
    "mcp": ("mcp",),
    "plotting": ("plot",),
    "python": ("gymnasium", "openspiel", "pandas", "pettingzoo"),
    "research": ("mcp", "pandas", "plot"),
}
TOPIC_PARAMETERS = [
    pytest.param(
        name,
        marks=[
            pytest.mark.extra(*EXTRAS_OF_TOPICS.get(name, ())),
            *([pytest.mark.slow] if name in SLOW_TOPICS else []),
        ],
    )
    for name in list_topics()
]


def topic_file(name: str) -> Path:
    """Return the file of a topic, relative to the project."""
    (file,) = GUIDE_FOLDER.glob(f"[0-9][0-9]-{name}.md")
    return file.relative_to(PROJECT_ROOT)


ENVIRONMENT_NAMES = ("Env", "VectorEnv", "ParallelEnv", "env")  # of dmplay.gym and dmplay.zoo


def test_each_public_name_has_a_docstring_and_an_example_in_two_topics() -> None:
    names = vars(dmplay)["__all__"]
    blocks = [*parse_blocks(read_topic("python")), *parse_blocks(read_topic("panels"))]
    words = {word for block in blocks for word in re.findall(r"\w+", block.code)}
    assert [name for name in (*names, *ENVIRONMENT_NAMES) if name not in words] == []
    objects = {name: getattr(dmplay, name) for name in names if name != "WAIT_LABEL"}
    assert [name for name, value in objects.items() if not value.__doc__] == []


@pytest.mark.parametrize("name", TOPIC_PARAMETERS)
def test_the_examples_of_a_topic_run_as_documented(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    DocumentRunner(tmp_path, monkeypatch).follow(read_topic(name))


@each_topic
def test_every_block_of_a_topic_is_run(name: str) -> None:
    blocks = parse_blocks(read_topic(name))
    assert read_topic(name).count("```") == 2 * len(blocks), f"see {topic_file(name)}"
    for block in blocks:  # a test of its own follows the drawing in `architecture`
        is_drawing = (name, block.language) == ("architecture", "text")
        assert block.runs or is_drawing, f"see {topic_file(name)}: {block.code}"


@each_topic
def test_a_topic_refers_only_to_existing_topics(name: str) -> None:
    references = [text.split()[0] for text in read_topic(name).split("`dmplay guide ")[1:]]
    unknown = {word.rstrip("`:.,") for word in references} - {*list_topics()}
    assert not unknown, f"see {topic_file(name)}"


def test_the_first_problem_of_the_guide_is_no_longer_than_fifteen_lines() -> None:
    assert len([line for line in TIGER_SOURCE.splitlines() if line.strip()]) <= 15


def test_programs_of_the_guide_have_fewer_than_fifteen_lines() -> None:
    programs = [block for block in parse_blocks(read_topic("bots")) if block.name]
    assert [program.language for program in programs] == ["python", "awk", "bash", "c"]
    assert all(len(program.code.splitlines()) < 15 for program in programs)


def test_topics_are_in_reading_order_and_titled_by_their_first_lines() -> None:
    assert [*list_topics()][:2] == ["play", "transcripts"]
    assert [*list_topics()][-3:] == ["architecture", "glossary", "changes"]
    assert topic_title("play") == "Your first game"
    assert len(list_topics()) == len([*GUIDE_FOLDER.glob("*.md")])


def test_the_architecture_topic_names_only_existing_files_and_definitions() -> None:
    prose = re.sub(r"```.*?```", "", read_topic("architecture"), flags=re.DOTALL)
    words = re.findall(r"`([^`\n]+)`", prose.partition("## The life of one turn")[2])
    modules = (path for name in ("dmplay", "tests") for path in (PROJECT_ROOT / name).rglob("*.py"))
    source = "\n".join(path.read_text(encoding="utf-8") for path in modules)
    for word in words:
        if re.search(r"NAME|STEM|FAMILY|GAME\b|TURN\b", word):  # a placeholder
            continue
        if re.match("(dmplay|tests|transcripts)/", word):
            assert (PROJECT_ROOT / word).exists(), f"{word}: see {topic_file('architecture')}"
        elif re.fullmatch(r"\w+\.\w+|\w*[_A-Z]\w*", word) and not word.endswith(".md"):
            name = word.rpartition(".")[2]
            is_defined = re.search(
                rf"\b(def|class) {name}\b|^ *{name}\b.* = ", source, re.MULTILINE
            )
            assert is_defined, f"{word}: see {topic_file('architecture')}"


def test_the_calls_that_the_architecture_topic_draws_happen_in_a_turn(tmp_path: Path) -> None:
    (drawing,) = re.findall(r"```text\n(.*?)```", read_topic("architecture"), re.DOTALL)
    rows = [(len(row) - len(row.lstrip()), *row.split()) for row in drawing.splitlines()]
    ancestors: dict[tuple[str, str], set[tuple[str, str]]] = {}

    def note_call(frame: FrameType | None, event: str, _: object) -> None:
        """Note the functions from which a function was called."""
        assert frame
        called = identify(frame)
        if event == "call" and called in {row[1:] for row in rows}:
            while frame := frame.f_back:
                ancestors.setdefault(called, set()).add(identify(frame))

    def identify(frame: FrameType) -> tuple[str, str]:
        """Return the name of a function and its file in the package."""
        return frame.f_code.co_qualname, frame.f_code.co_filename.rpartition("/dmplay/")[2]

    walk = start_new_game(GameRequest("hexworld", record_path=tmp_path / "walk.dmt"))
    hunt = GameController(make_game("predator-prey", "human", "random"))
    sys.setprofile(note_call)
    try:
        play_keys(walk, "l")
        handle_key(PlayScreen(hunt, PIPE_TERMINAL), "l")  # agents choose in this thread
    finally:
        sys.setprofile(None)
    callers: list[tuple[int, str, str]] = []  # the rows above, by indentation
    for indentation, name, file in rows:
        callers = [row for row in callers if row[0] < indentation]
        assert {row[1:] for row in callers} <= ancestors.get((name, file), set()), (
            f"{name} in {file}: see {topic_file('architecture')}"
        )
        callers.append((indentation, name, file))
    assert len(ancestors) == len(rows)


def test_the_architecture_topic_lists_the_layers_in_the_order_of_imports() -> None:
    section = read_topic("architecture").partition("## The life of one turn")[0]
    entries = [row for row in section.splitlines() if row.startswith("- ")]
    layers = [
        name
        for entry in entries
        for name in re.findall(r"`(\w+)(?:/|\.py)`", entry.partition(":")[0])
    ]
    source = (PROJECT_ROOT / "tests" / "test_layers.py").read_text(encoding="utf-8")
    expected = re.findall(r"\w+", source.partition("LAYERS = (")[2].partition(")")[0])
    assert layers == expected, f"see {topic_file('architecture')} and tests/test_layers.py"


def test_each_term_of_the_glossary_is_two_lines_and_names_a_problem() -> None:
    entries = re.findall(r"^- \*\*.*?(?=\n- |\n\n|\Z)", read_topic("glossary"), re.M | re.S)
    assert len(entries) > 50
    for entry in entries:
        advice = f"see {topic_file('glossary')}: {entry}"
        assert len(entry.strip().splitlines()) == 2, advice
        assert re.search(rf"\b(?:{'|'.join(problem_names())})\b", entry), advice


def test_the_error_for_an_unknown_topic_suggests_the_nearest() -> None:
    with pytest.raises(UnknownName, match="unknown topic 'agnets'; did you mean agents"):
        read_topic("agnets")


def test_raw_output_is_the_file_itself(capsys: pytest.CaptureFixture[str]) -> None:
    assert execute_result(interpret_command(["guide", "agents", "--raw"])) == 0
    assert capsys.readouterr().out == read_topic("agents")


def test_raw_output_requires_a_topic() -> None:
    with pytest.raises(BadParameter, match="--raw needs a topic, such as agents"):
        interpret_command(["guide", "--raw"])


@each_topic
def test_text_fits_40_columns_and_code_80_and_the_ascii_form_is_ascii(name: str) -> None:
    rows = (row for block in parse_blocks(read_topic(name)) for row in block.code.split("\n"))
    code_rows = {f"    {row}".rstrip().replace("±", "+-") for row in rows}
    terminal = PIPE_TERMINAL._replace(ascii=True, width=40)
    text = guide_pages.render_topic(name, terminal)
    for row in text.plain.split("\n"):
        assert len(row) <= (80 if row in code_rows else 40), f"see {topic_file(name)}"
    assert "…" not in text.plain
    assert render_for_terminal(text, terminal).isascii()


def test_code_is_rendered_without_changes() -> None:
    text = guide_pages.render_markdown(f"```python\n{TIGER_SOURCE}```\n", 20).plain
    assert textwrap.dedent(text) == TIGER_SOURCE.rstrip()


def test_commands_of_a_console_session_are_bold() -> None:
    text = guide_pages.render_markdown("```console\n$ dmplay list\n2048\n```\n", 80)
    assert text.plain == "    $ dmplay list\n    2048"
    bold_parts = [
        text.plain[span.start : span.end] for span in text.spans if "bold" in str(span.style)
    ]
    assert "".join(bold_parts) == "$ dmplay list"


def test_inline_code_is_cyan_with_colours_and_between_backticks_without() -> None:
    label = "The line `other seeds` compares you with other games."
    coloured = guide_pages.render_markdown(label, 80)
    assert coloured.plain == label.replace("`", "")
    assert [coloured.plain[span.start : span.end] for span in coloured.spans if span.style] == [
        "other seeds"
    ]
    assert guide_pages.render_markdown(label, 80, quotes_code=True).plain == label


def test_a_topic_has_backticks_only_without_colours() -> None:
    assert "`q` leaves" in guide_pages.render_topic("play", PIPE_TERMINAL).plain
    coloured = guide_pages.render_topic("play", PIPE_TERMINAL._replace(color=True)).plain
    assert "`" not in coloured


@pytest.fixture
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in {"COLUMNS": "80", "LINES": "24", "PAGER": "sed s/^/>/"}.items():
        monkeypatch.setenv(name, value)


@pytest.mark.usefixtures("_small")
def test_a_text_longer_than_the_screen_goes_through_the_pager(
    capfd: pytest.CaptureFixture[str],
) -> None:
    print_paged(LONG_TEXT, SCREEN_TERMINAL)
    assert capfd.readouterr().out.startswith(">0\n>1\n")
    print_paged("x" * 81, SCREEN_TERMINAL)
    assert capfd.readouterr().out == f">{'x' * 81}\n"


@pytest.mark.usefixtures("_small")
def test_words_are_wrapped_on_a_terminal(capfd: pytest.CaptureFixture[str]) -> None:
    text = f"  agent           {'word ' * 16}\n    {'more ' * 16}"
    print_paged(text, PIPE_TERMINAL, wrap_words=True)
    assert capfd.readouterr().out == f"{text}\n"
    print_paged(text, SCREEN_TERMINAL, wrap_words=True)
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
        (LONG_TEXT, PIPE_TERMINAL, "sed s/^/>/"),
        ("short", SCREEN_TERMINAL, "sed s/^/>/"),
        (LONG_TEXT, SCREEN_TERMINAL, ""),
        (LONG_TEXT, SCREEN_TERMINAL, "no-such-pager -R"),
    ],
)
def test_no_pager_is_used_in_a_pipe_for_short_text_or_if_missing(
    text: str, terminal: Terminal, pager: str, capfd: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setenv("PAGER", pager)
    print_paged(text, terminal)
    assert capfd.readouterr().out == f"{text}\n"


@pytest.mark.usefixtures("_small")
def test_quitting_the_pager_early_is_not_an_error(
    capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PAGER", "head -1")
    print_paged(LONG_TEXT * 400, SCREEN_TERMINAL)
    assert capfd.readouterr() == ("0\n", "")


@pytest.mark.slow
def test_less_shows_a_topic_in_colour_and_handles_ctrl_c(tmp_path: Path) -> None:
    with Tty("guide", "problems", folder=tmp_path) as tty:
        prompt = b":\x1b[K"  # the prompt of less, which it draws again after Ctrl-C
        tty.until("A dozen lines").until(lambda: tty.raw.endswith(prompt))
        tty.calm()  # A signal before less reads the keyboard would not redraw the prompt.
        raw_length = len(tty.raw)
        tty.press("\x03", lambda: tty.raw[raw_length:].endswith(prompt))
        tty.press("/", lambda: "/" in tty.text.splitlines()[-1])
        tty.press("An installed\r", "An installed problem")
        tty.press("q")
        assert tty.ended() == 0
        assert "\x1b[1mYour own problem" in tty.printed
        assert tty.left_clean()


def test_topic_names_are_completed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    environment = {
        "_DMPLAY_COMPLETE": "complete_bash",
        "COMP_WORDS": "dmplay guide tr",
        "COMP_CWORD": "2",
    }
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert main.run_command_line() == 0
    assert capsys.readouterr().out.split(os.linesep)[0] == "transcripts"
