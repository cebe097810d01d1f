"""The guide, drawn for a terminal or a pipe."""

from collections.abc import Iterable, Iterator
from io import StringIO

from rich.console import Console, ConsoleOptions, RenderResult
from rich.markdown import CodeBlock, Heading, Markdown
from rich.padding import Padding
from rich.segment import Segment
from rich.style import Style
from rich.syntax import ANSISyntaxTheme, Syntax
from rich.text import Text
from rich.theme import Theme

from dmplay.finding.topics import title, topic, topics
from dmplay.terminal import Terminal

WIDE = 100  # columns: longer lines are hard to read
INDENT = 4  # columns before code
RULES = {"h1": "━", "h2": "─"}  # below headings
PROMPT = "$ "
STYLES = Theme({
    "markdown.h1": "bold",
    "markdown.h2": "bold",
    "markdown.code": "cyan",
    "markdown.table.header": "bold",
})  # fmt: skip
COLORS = ANSISyntaxTheme({
    ("Comment",): Style(dim=True),
    ("Keyword",): Style(color="magenta"),
    ("Literal", "String"): Style(color="green"),
    ("Name", "Class"): Style(bold=True),
    ("Name", "Function"): Style(bold=True),
})  # fmt: skip


class _Title(Heading):
    """A heading with a rule below it."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield self.text
        yield Text(RULES.get(self.tag, "") * self.text.cell_len, style="dim")


class _Code(CodeBlock):
    """Code as it is typed, however wide, so that it can be copied; what is printed is wrapped."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        code = str(self.text).rstrip()
        if self.lexer_name != "console":
            text = Syntax(code, self.lexer_name, theme=COLORS).highlight(code)
            yield from map(_whole, text.split("\n"))
            return
        for row in code.split("\n"):
            if row.startswith(PROMPT):
                yield _whole(Text(row, "bold"))
            else:
                yield Padding(Text(row), (0, 0, 0, INDENT))


def _whole(row: Text) -> Text:
    """A row that is not cut, behind its indentation."""
    return Text(" " * INDENT, no_wrap=True, overflow="ignore").append_text(row)


class _Page(Markdown):
    """Markdown with these."""

    elements = Markdown.elements | {"heading_open": _Title, "fence": _Code}


def named() -> str:
    """The name and title of every topic."""
    return "\n".join(f"{name:<13}{title(name)}" for name in topics())


def drawn(name: str, terminal: Terminal) -> Text:
    """A topic, for a terminal."""
    markdown = topic(name).replace("±", "+-" if terminal.ascii else "±")
    return page(markdown, min(terminal.columns, WIDE))


def page(markdown: str, width: int) -> Text:
    """Markdown, drawn in so many columns."""
    console = Console(width=width, file=StringIO(), force_terminal=True, theme=STYLES)
    segments = console.render(_Page(markdown, hyperlinks=False))
    return Text("\n").join(_rows(Segment.split_lines(segments)))


def _rows(lines: Iterable[list[Segment]]) -> Iterator[Text]:
    for line in lines:
        row = Text.assemble(*((piece.text, piece.style or "") for piece in line))
        row.rstrip()
        yield row
