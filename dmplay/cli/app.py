"""The command-line program: aliases, problems as commands, settings files and completion."""

import re
import shlex
from contextlib import suppress
from difflib import get_close_matches
from functools import cache
from itertools import pairwise
from typing import Any

import typer
from typer.core import TyperGroup

from dmplay.cli import config_files
from dmplay.cli.commands import COMMANDS, build_command
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.registry.builtin_names import problem_names

SINGLE_OPTIONS = {  # options given once, with what takes several values instead
    "--agent": "--seat NAME=AGENT sets another seat, and dmplay compare compares agents",
    "--vs": "--seat NAME=AGENT sets one of the other seats",
    "--compare": "--compare AGENT,AGENT compares several agents",
    "--methods": "--methods NAME,NAME draws several methods",
    "--seed": "another seed is another game",
    "--variant": "a game has one variant; --set NAME=VALUE sets a parameter",
}
DEFAULT_RATE = "50"  # turns per second of --rate without a value
RATE_PATTERN = re.compile(r"[-+]*\.?\d|[-+]?(nan|inf(inity)?)$", re.IGNORECASE)


class CommandGroup(TyperGroup):
    """The group of commands; an unknown first word is taken as a problem to play."""

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the names of the commands."""
        return [*COMMANDS]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command, built now; None for another name."""
        return build_command(cmd_name) if cmd_name in COMMANDS else None

    def parse_args(self, ctx: Any, args: list[str]) -> list[str]:
        """Parse the arguments, with `dmplay hexworld` as `dmplay play hexworld`.

        Likewise `dmplay -e` is `dmplay shell -e`, and `dmplay help COMMAND` is `dmplay COMMAND
        --help`.
        """
        if args and args[0] in ("-e", "--execute"):
            args = ["shell", *args]
        if len(args) > 1 and args[0] == "--" and not args[1].startswith("-"):
            args = args[1:]
        # Completion works with an invalid settings file, and `config path` helps to repair it.
        is_lenient = ctx.resilient_parsing or args[:2] == ["config", "path"]
        ignored_errors = (DmplayError,) if is_lenient else ()
        with suppress(*ignored_errors):
            _check_repeated_options(args)
        with suppress(*ignored_errors):
            if (alias := "".join(args[:1])) in (aliases := config_files.merged_aliases()):
                args = [*shlex.split(aliases[alias]), *args[1:]]
        if args[:1] == ["help"]:  # as in the shell
            args = [*args[1:2], "--help"]
        if args and not args[0].startswith("-") and args[0] not in COMMANDS:
            if not ctx.resilient_parsing:
                _check_misspelling(args[0])
            args = ["play", *args]
        with suppress(*ignored_errors):
            if config_files.load_config_files():
                from dmplay.cli.settings import load_command_defaults

                ctx.default_map = load_command_defaults("".join(args[:1]))
        return list(super().parse_args(ctx, [*map(_expand_strict, _insert_default_rate(args))]))

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Return the options, or the commands, problems and aliases, that complete a word."""
        from dmplay.game.completion.name_lists import complete_problems

        options = super().shell_complete(ctx, "-")  # at least --help
        names = [*COMMANDS, *complete_problems(incomplete)]
        with suppress(DmplayError):
            names += config_files.merged_aliases()
        items = options if incomplete.startswith("-") else [*map(type(options[0]), names)]
        return [item for item in items if item.value.startswith(incomplete)]


def _check_misspelling(name: str) -> None:
    """Raise UnknownName if a name resembles a command and no problem."""
    word = name.partition(":")[0]
    close_commands, close_problems = (
        get_close_matches(word, names, cutoff=0.75) for names in (COMMANDS, problem_names())
    )
    if close_commands and not close_problems:
        from dmplay.registry.problems import is_problem_name

        if not is_problem_name(name):
            raise UnknownName("command", word, COMMANDS)


def _check_repeated_options(args: list[str]) -> None:
    """Raise BadParameter if one seat or parameter is set twice; only the last would count."""
    options = ["--variant" if word == "-V" else word.partition("=")[0] for word in args]
    pairs = [*pairwise([*args, ""])]
    for option in ("--seat", "--set"):
        values = [value for word, value in pairs if word == option]
        values += [word.partition("=")[2] for word in args if word.startswith(f"{option}=")]
        names = [value.partition("=")[0].strip() for value in values]
        repeated = next((name for name in names if names.count(name) > 1), None)
        if repeated is not None:
            count = names.count(repeated)
            raise BadParameter(f"{option}: got {repeated} {count} times, expected each name once")
    for option, remedy in SINGLE_OPTIONS.items():
        if options.count(option) > 1:
            raise BadParameter(f"{option}: got {options.count(option)}, expected one; {remedy}")


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


def _insert_default_rate(args: list[str]) -> list[str]:
    """Return the arguments with the default rate inserted after a `--rate` without a value.

    Only the problem may follow that, and so nothing if the problem comes first.
    """
    index = args.index("--rate") + 1 if "--rate" in args else 0
    follows_problem = not "".join(args[1:2]).startswith("-")
    word = "".join(args[index : index + 1])
    has_value = RATE_PATTERN.match(word) or (word and word[0] != "-" and follows_problem)
    return args if not index or has_value else [*args[:index], DEFAULT_RATE, *args[index:]]


@cache
def root_command() -> Any:
    """Return the group of all commands, created once."""
    app = typer.Typer(
        cls=CommandGroup,
        rich_markup_mode=None,
        context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "DMPLAY"},
        help="""Play the decision problems of Algorithms for Decision Making in a terminal.

\b
  dmplay learn first                     play a first game that explains itself
  dmplay hexworld                        play hex world
  dmplay 2048 --seed 7 -o game.dmt       play with a fixed seed, and record it
  dmplay verify game.dmt                 check every number of a recorded game
  dmplay crying-baby --agent random      watch an agent play
  dmplay list                            list all problems
  dmplay learn                           list the lessons and your progress
  dmplay guide                           list the topics of the guide
  dmplay                                 choose a problem from a list and play

\b
'dmplay PROBLEM' is short for 'dmplay play PROBLEM'.
'dmplay -e COMMAND' is short for 'dmplay shell -e COMMAND'.
'dmplay --version' prints the version.
With --debug, dmplay prints the full traceback of an unexpected error.""",
    )
    app.callback()(lambda: None)  # Typer makes a group of it
    group: Any = typer.main.get_command(app)
    for option in group.params:
        option.show_envvar = False
        if option.name == "show_completion":  # Typer's own text is hard to understand
            option.help = "Print the completion script for the current shell."
    return group
