"""Completions for bash, zsh, fish and PowerShell, made from those that Typer prints for fish."""

import contextlib
import io
import os
import re
import shlex
from collections.abc import Callable, Sequence

from dmplay.cli.app import root_command
from dmplay.core.parameter_parsing import parse_whole_number

# The variables of Typer's scripts, which the shells evaluate.
COMPLETION_VARIABLE, LINE_VARIABLE = "_DMPLAY_COMPLETE", "_TYPER_COMPLETE_ARGS"
ACTION_VARIABLE = "_TYPER_COMPLETE_FISH_ACTION"  # fish's `is-args` asks whether there are any
BASH_WORD_BREAKS = ":="  # characters at which bash splits words
# word endings after which more can be typed
CONTINUED_ENDINGS = {"=": "VALUE", ":": "VALUE", "/": "..."}
OPTION_VALUE_PATTERN = re.compile(r"(?:^|\s)(--[\w-]+=)\S*$")
Completion = tuple[str, str]  # a word and its help text
# Characters of words that every shell takes as plain text, besides letters and digits. None starts
# an expansion, a quotation or another command.
SAFE_SIGNS = frozenset("_-./:,=+@ ")
SAFE_FIRST_SIGNS = frozenset("_-./")  # zsh expands a first `=`, and PowerShell a first `@`
MAX_WORD_CHARS = 1000  # maximum length of a word that is offered


def print_completions() -> int:
    """Print the completions that a shell requests, or its script; return the exit code."""
    instruction, _, shell = os.environ[COMPLETION_VARIABLE].partition("_")
    formatters: dict[str, Callable[[Sequence[Completion]], list[str]]] = {
        "bash": _format_for_bash, "zsh": _format_for_zsh, "powershell": _format_for_powershell,
        "pwsh": _format_for_powershell,
        "fish": lambda words: ["\t".join(filter(None, word)) for word in words],
    }  # fmt: skip
    if instruction != "complete" or shell not in formatters:
        with contextlib.suppress(SystemExit):
            root_command()(prog_name="dmplay")
        return 0
    line, kept_prefix = os.environ.get(LINE_VARIABLE, ""), ""
    if shell == "bash":
        words = os.environ.get("COMP_WORDS", "").replace(" ", "\n").split("\n")
        joined_words, cursor_index, kept_prefix = rejoin_bash_words(
            words, parse_whole_number(os.environ.get("COMP_CWORD", "")) or 0
        )
        line = " ".join(joined_words[: cursor_index + 1])
    elif formatters[shell] is _format_for_powershell:
        line += "" if os.environ.get("_TYPER_COMPLETE_WORD_TO_COMPLETE") else " "
    completions = _complete_last_word(line)
    if shell != "bash" and (option := OPTION_VALUE_PATTERN.search(line)):
        # Typer completes the value, but these shells replace the word.
        completions = [(option[1] + word, help_text) for word, help_text in completions]
    if shell == "fish" and os.environ.get(ACTION_VARIABLE) == "is-args":
        return 0 if completions else 1  # Without words, fish offers files.
    completions = [(word.removeprefix(kept_prefix), text) for word, text in completions]
    print(*formatters[shell](completions), sep="\n")
    return 0


def _complete_last_word(line: str) -> list[Completion]:
    """Return the safe completions of the last word of a line."""
    os.environ |= {
        COMPLETION_VARIABLE: "complete_fish", ACTION_VARIABLE: "get-args", LINE_VARIABLE: line,
    }  # fmt: skip
    output = io.StringIO()
    with contextlib.redirect_stdout(output), contextlib.suppress(SystemExit):
        root_command()(prog_name="dmplay")
    rows = [row.partition("\t") for row in output.getvalue().split("\n")]
    last_word = line.rpartition(" ")[2]
    partial_word = "" if OPTION_VALUE_PATTERN.search(line) else last_word
    return [(word, text) for word, _, text in rows if is_safe_word(word, partial_word)]


def _format_for_bash(completions: Sequence[Completion]) -> list[str]:
    """Return completions for bash: spaces escaped, and no space added after an unfinished word.

    Bash adds a space after a single completion, so a second one with the same beginning is added.
    """
    words = [word.replace(" ", "\\ ") for word, _ in completions]
    if len(words) == 1 and words[0][-1:] in CONTINUED_ENDINGS:
        words.append(words[0] + CONTINUED_ENDINGS[words[0][-1]])
    return words


def _format_for_zsh(completions: Sequence[Completion]) -> list[str]:
    """Return the command of zsh that offers these completions, or files if there are none.

    It adds no space after an unfinished word.
    """
    if not completions:
        return ["_files"]
    rows: dict[bool, list[str]] = {True: [], False: []}
    for word, text in completions:
        row = word.replace(":", r"\:") + (f":{text}" if text else "")
        rows[word[-1] in CONTINUED_ENDINGS].append(shlex.quote(row))
    return [
        f"local -a unfinished=({' '.join(rows[True])}) complete=({' '.join(rows[False])});",
        "_describe -V word unfinished -S '' -- complete",
    ]


def _format_for_powershell(completions: Sequence[Completion]) -> list[str]:
    """Return completions for PowerShell, each with its help text."""
    return [f"{word}:::{text or ' '}" for word, text in completions]


def rejoin_bash_words(words: Sequence[str], cursor_word: int) -> tuple[list[str], int, str]:
    """Rejoin the words of a line that bash split at `:` and `=`.

    Return the words, the index of the word at the cursor, and the beginning of that word (or of the
    value of `--option=`) that bash keeps, so that completions must not repeat it.
    """
    joined_words: list[str] = []
    joined_index, prefix, continues = 0, "", False
    for index, word in enumerate([*words, ""][: max(len(words), cursor_word + 1)]):
        is_break = word != "" and not word.strip(BASH_WORD_BREAKS)
        previous = ""
        if joined_words and word and (is_break or continues):
            previous = joined_words.pop()
        joined_words.append(previous + word)
        continues = is_break
        if index == cursor_word:
            joined_index, prefix = len(joined_words) - 1, previous + word if is_break else previous
    prefix = prefix.partition("=")[2] if prefix.startswith("--") else prefix
    return joined_words, joined_index, prefix


def is_safe_word(word: str, partial_word: str) -> bool:
    """Return whether a shell can be offered a word, which may come from a stranger's file.

    zsh evaluates what it is offered, and bash puts it into the line unquoted. A word that begins
    like an option is safe only if the partial word does.
    """
    return (
        0 < len(word) <= MAX_WORD_CHARS
        and all(c.isalnum() or c in SAFE_SIGNS for c in word)
        and (word[0].isalnum() or word[0] in SAFE_FIRST_SIGNS)
        and word[-1] != " "
        and (word[0] != "-" or partial_word.startswith("-"))
    )
