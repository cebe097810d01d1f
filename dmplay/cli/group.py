"""The commands as a whole: aliases, problems as commands, files of settings, and completion."""

import shlex
from collections.abc import Sequence
from contextlib import suppress
from difflib import get_close_matches
from typing import Any

from typer.core import TyperGroup

from dmplay.cli import config
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.finding.names import problem_names
from dmplay.words.completion import lists

DEFAULT_RATE = "50"  # turns a second of a bare --rate
BASH_WORD_BREAKS = ":="  # where bash takes words apart


class CommandGroup(TyperGroup):
    """The commands; a first word that is none of them is a problem to play."""

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Reads `dmplay hexworld` as `dmplay play hexworld`, `dmplay -e` as `dmplay shell -e`."""
        if args and args[0] in ("-e", "--execute"):
            args = ["shell", *args]
        if ctx.resilient_parsing:  # a file that is wrong does not stop completion
            with suppress(DmplayError):
                args = self._apply_config(ctx, args)
        elif args[:2] != ["config", "path"]:  # which helps to mend a file
            args = self._apply_config(ctx, args)
        if args[:1] == ["help"]:  # as the shell has it
            args = [*args[1:2], "--help"]
        if args and not args[0].startswith("-") and args[0] not in self.commands:
            if not ctx.resilient_parsing:
                self._check_misspelling(args[0])
            args = ["play", *args]
        return list(super().parse_args(ctx, [*map(_expand_strict, _insert_default_rate(args))]))

    def _check_misspelling(self, name: str) -> None:
        """Refuses what is more like the name of a command than like one of a problem."""
        word = name.partition(":")[0]
        near, other = (
            get_close_matches(word, names, cutoff=0.75)
            for names in (self.commands, problem_names())
        )
        if near and not other and not _is_problem(name):
            raise UnknownName("command", word, self.commands)

    def _apply_config(self, ctx: Any, args: list[str]) -> list[str]:
        """Takes the settings of files as defaults, and their aliases for what they stand for."""
        if config.load_config_files():
            from dmplay.cli.settings import config_defaults

            ctx.default_map = config_defaults(self.commands)
        words = config.merged_aliases().get(args[0]) if args else None
        return args if words is None else [*shlex.split(words), *args[1:]]

    def get_params(self, ctx: Any) -> Any:
        """The options of the program; its help leaves out the variables that set them."""
        return _hide_variables(super().get_params(ctx))

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """A command; its help leaves out the variables that set its options."""
        command = super().get_command(ctx, cmd_name)
        if command:
            _hide_variables(command.params)
        return command

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Commands, problems and aliases; without their help, whose markup is slow to take out."""
        items = super().shell_complete(ctx, incomplete)
        item = type(super().shell_complete(ctx, "")[0])
        names = lists.complete_problems(incomplete)
        with suppress(DmplayError):
            names += config.merged_aliases()
        more = [name for name in names if name.startswith(incomplete)]
        return [item(name) for name in [*(one.value for one in items), *more]]


def _hide_variables(options: Any) -> Any:
    """These options, whose variables no help tells."""
    for one in options:
        one.show_envvar = False
    return options


def _expand_strict(word: str) -> str:
    """A word, `--strict=hints` as the option that it is."""
    option, equals, how = word.partition("=")
    if option != "--strict" or not equals:
        return word
    if how != "hints":
        raise BadParameter(f"--strict: got {how!r}, expected --strict or --strict=hints")
    return "--strict-hints"


def _is_problem(word: str) -> bool:
    """Whether a word that is like a command is the name of a problem all the same."""
    from dmplay.finding.problems import is_problem_name

    return is_problem_name(word)


def _insert_default_rate(args: list[str]) -> list[str]:
    """The words, with its usual value behind a bare --rate."""
    at = args.index("--rate") + 1 if "--rate" in args else 0
    if not at or (args[at:] and args[at].lstrip("-+")[:1].isdecimal()):
        return args
    return [*args[:at], DEFAULT_RATE, *args[at:]]


def rejoin_bash_words(words: Sequence[str], cursor_word: int) -> tuple[list[str], int, str]:
    """The words of a line that bash took apart at `:` and `=`; which of them is the cursor's, and
    how that one, or the value of `--option=`, begins, which bash keeps.
    """
    whole: list[str] = []
    place, kept, goes_on = 0, "", False
    for number, word in enumerate([*words, ""][: max(len(words), cursor_word + 1)]):
        breaks = word != "" and not word.strip(BASH_WORD_BREAKS)
        before = ""
        if whole and word and (breaks or goes_on):
            before = whole.pop()
        whole.append(before + word)
        goes_on = breaks
        if number == cursor_word:
            place, kept = len(whole) - 1, before + word if breaks else before
    return whole, place, kept.partition("=")[2] if kept.startswith("--") else kept
