"""The pages of the guide, rendered for a terminal or a pipe."""

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

from dmplay.guide.topics import read_topic
from dmplay.terminal.capabilities import Terminal

MAX_COLUMNS = 100  # columns, because longer lines are hard to read
CODE_INDENT = 4  # columns before code
HEADING_RULES = {"h1": "━", "h2": "─"}  # character of the rule below a heading
SHELL_PROMPT = "$ "
MARKDOWN_STYLES = Theme({
    "markdown.h1": "bold",
    "markdown.h2": "bold",
    "markdown.code": "cyan",
    "markdown.table.header": "bold",
})  # fmt: skip
CODE_THEME = ANSISyntaxTheme({
    ("Comment",): Style(dim=True),
    ("Keyword",): Style(color="magenta"),
    ("Literal", "String"): Style(color="green"),
    ("Name", "Class"): Style(bold=True),
    ("Name", "Function"): Style(bold=True),
})  # fmt: skip


class _RuledHeading(Heading):
    """A heading with a rule below it."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        yield self.text
        yield Text(HEADING_RULES.get(self.tag, "") * self.text.cell_len, style="dim")


class _UnwrappedCode(CodeBlock):
    """A code block whose code is never wrapped, so that it can be copied; its output is wrapped."""

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        code = str(self.text).rstrip()
        if self.lexer_name != "console":
            text = Syntax(code, self.lexer_name, theme=CODE_THEME).highlight(code)
            yield from map(_make_unwrapped_row, text.split("\n"))
            return
        for row in code.split("\n"):
            if row.startswith(SHELL_PROMPT):
                yield _make_unwrapped_row(Text(row, "bold"))
            else:
                yield Padding(Text(row), (0, 0, 0, CODE_INDENT))


def _make_unwrapped_row(row: Text) -> Text:
    """Return an indented row that is neither wrapped nor cut."""
    return Text(" " * CODE_INDENT, no_wrap=True, overflow="ignore").append_text(row)


class _GuideMarkdown(Markdown):
    """Markdown with ruled headings and unwrapped code."""

    elements = Markdown.elements | {"heading_open": _RuledHeading, "fence": _UnwrappedCode}

    def quote_inline_code(self) -> None:
        """Put inline code between backticks, for output without colours."""
        for token in self.parsed:
            for child in token.children or ():
                if child.type == "code_inline":
                    child.content = f"`{child.content}`"


def render_topic(name: str, terminal: Terminal) -> Text:
    """Return a topic of the guide rendered for a terminal, at most MAX_COLUMNS wide."""
    markdown = read_topic(name).replace("±", "+-" if terminal.ascii else "±")
    width = min(terminal.columns, MAX_COLUMNS)
    return render_markdown(markdown, width, quotes_code=not terminal.color)


def render_markdown(markdown: str, width: int, *, quotes_code: bool = False) -> Text:
    """Return Markdown rendered in `width` columns, with inline code between backticks if asked."""
    document = _GuideMarkdown(markdown, hyperlinks=False)
    if quotes_code:
        document.quote_inline_code()
    console = Console(width=width, file=StringIO(), force_terminal=True, theme=MARKDOWN_STYLES)
    segments = console.render(document)
    return Text("\n").join(_iter_text_rows(Segment.split_lines(segments)))


def _iter_text_rows(lines: Iterable[list[Segment]]) -> Iterator[Text]:
    """Yield lines of segments as texts without trailing blanks."""
    for line in lines:
        row = Text.assemble(*((piece.text, piece.style or "") for piece in line))
        row.rstrip()
        yield row
