"""The group of all commands: aliases, problems as commands, settings files and completion."""

import math
import shlex
from collections.abc import Callable, Sequence
from contextlib import suppress
from copy import copy
from difflib import get_close_matches
from functools import partial
from typing import Any

import typer
from typer.core import TyperGroup

from dmplay.cli import config_files
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.game.completion import name_lists
from dmplay.registry.builtin_names import problem_names

DEFAULT_RATE = "50"  # turns per second of --rate without a value
BASH_WORD_BREAKS = ":="  # characters at which bash splits words


class CommandGroup(TyperGroup):
    """The group of commands; an unknown first word is taken as a problem to play."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments, with `dmplay hexworld` as `dmplay play hexworld`.

        Likewise `dmplay -e` is `dmplay shell -e`, and `dmplay help COMMAND` is `dmplay COMMAND
        --help`.
        """
        if args and args[0] in ("-e", "--execute"):
            args = ["shell", *args]
        if ctx.resilient_parsing:  # Completion must work with an invalid settings file.
            with suppress(DmplayError):
                args = self._apply_config(ctx, args)
        elif args[:2] != ["config", "path"]:  # it helps to repair a settings file
            args = self._apply_config(ctx, args)
        if args[:1] == ["help"]:  # as in the shell
            args = [*args[1:2], "--help"]
        if args and not args[0].startswith("-") and args[0] not in self.commands:
            if not ctx.resilient_parsing:
                self._check_misspelling(args[0])
            args = ["play", *args]
        return list(super().parse_args(ctx, [*map(_expand_strict, _insert_default_rate(args))]))

    def _check_misspelling(self, name: str) -> None:
        """Raise UnknownName if a name resembles a command and no problem."""
        word = name.partition(":")[0]
        close_commands, close_problems = (
            get_close_matches(word, names, cutoff=0.75)
            for names in (self.commands, problem_names())
        )
        if close_commands and not close_problems and not _is_problem(name):
            raise UnknownName("command", word, self.commands)

    def _apply_config(self, ctx: Any, args: list[str]) -> list[str]:
        """Set option defaults from settings files; return the arguments with the alias expanded."""
        if config_files.load_config_files():
            from dmplay.cli.settings import config_defaults

            ctx.default_map = config_defaults(self.commands)
        expansion = config_files.merged_aliases().get(args[0]) if args else None
        return args if expansion is None else [*shlex.split(expansion), *args[1:]]

    def get_params(self, ctx: Any) -> Any:
        """Return the options of the program, without environment variables in the help."""
        return _hide_variables(super().get_params(ctx))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command, without environment variables in its help."""
        command = super().get_command(ctx, cmd_name)
        if command:
            for shown_command in (command, *getattr(command, "commands", {}).values()):
                _hide_variables(shown_command.params)
        return command

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Return the commands, problems and aliases that complete a word.

        Their help texts are left out, because removing their markup is slow.
        """
        items = super().shell_complete(ctx, incomplete)
        item_class = type(super().shell_complete(ctx, "")[0])
        names = name_lists.complete_problems(incomplete)
        with suppress(DmplayError):
            names += config_files.merged_aliases()
        matches = [name for name in names if name.startswith(incomplete)]
        return [item_class(name) for name in [*(entry.value for entry in items), *matches]]


def _hide_variables(options: Any) -> Any:
    """Hide the environment variables of these options in the help; return the options."""
    for option in options:
        option.show_envvar = False
    return options


def refuse_infinite_numbers(options: Sequence[Any]) -> None:
    """Make every number among these options finite, from whatever source its value comes.

    A comparison with NaN is always false, so the checks of a range let NaN through.
    """
    for option in options:
        if option.type.name.startswith("float"):
            option.type = copy(option.type)  # types without a range are shared
            option.type.convert = partial(_convert_to_finite, option.type.convert)


def _convert_to_finite(convert: Callable[..., float], value: Any, option: Any, ctx: Any) -> float:
    """Return an option's value as a number; raise BadParameter if it is NaN or infinite."""
    if _is_number(value) and not math.isfinite(float(value)):
        raise typer.BadParameter(f"{value} is not a finite number", ctx, option)
    return convert(value, option, ctx)


def _is_number(value: Any) -> bool:
    """Return whether a value is a number or its text, NaN and infinity included."""
    try:
        float(value)
    except (TypeError, ValueError):
        return False
    return True


def _expand_strict(word: str) -> str:
    """Return a word, with `--strict=hints` replaced by `--strict-hints`.

    Raise BadParameter for another value of `--strict`.
    """
    option, equals, value = word.partition("=")
    if option != "--strict" or not equals:
        return word
    if value != "hints":
        raise BadParameter(f"--strict: got {value!r}, expected --strict or --strict=hints")
    return "--strict-hints"


def _is_problem(word: str) -> bool:
    """Return whether a word is the name of a problem, including installed and external ones."""
    from dmplay.registry.problems import is_problem_name

    return is_problem_name(word)


def _insert_default_rate(args: list[str]) -> list[str]:
    """Return the arguments with the default rate inserted after a `--rate` without a value."""
    index = args.index("--rate") + 1 if "--rate" in args else 0
    next_word = "".join(args[index : index + 1])
    if not index or _is_number(next_word) or next_word.lstrip("-+")[:1].isdecimal():
        return args
    return [*args[:index], DEFAULT_RATE, *args[index:]]


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
    return (
        joined_words,
        joined_index,
        prefix.partition("=")[2] if prefix.startswith("--") else prefix,
    )
