"""All commands, in the order in which the help lists them; each is imported when it is needed."""

import os
from collections.abc import Callable
from functools import cache, partial
from importlib import import_module
from typing import Any

os.environ.setdefault("TYPER_USE_RICH", "0")  # Rich's help takes longer than the rest of the start

import typer

from dmplay.core.running_command import RunningCommand, list_words, set_running_command
from dmplay.errors import BadParameter

COMMANDS = {  # the module in this folder, and the function or the Typer group in it
    "play": "games:play",
    "resume": "games:resume",
    "replay": "games:replay",
    "shell": "games:shell",
    "verify": "transcripts:verify",
    "export": "transcripts:export",
    "review": "transcripts:review",
    "branch": "games:branch",
    "bot": "games:bot",
    "mcp": "games:mcp",
    "list": "reports:list_",
    "records": "reports:records",
    "solve": "reports:solve",
    "watch": "watching:watch",
    "train": "training:train",
    "data": "training:data",
    "convert": "reports:convert",
    "run": "evaluation:run",
    "evaluate": "evaluation:evaluate",
    "compare": "evaluation:compare",
    "tournament": "evaluation:tournament",
    "rerun": "rerun:rerun",
    "learn": "learn:learn_app",
    "assign": "grading:assign",
    "grade": "grading:grade",
    "plot": "plots:plot",
    "agents": "reports:agents",
    "info": "reports:info",
    "check": "reports:check",
    "guide": "reports:guide",
    "config": "reports:config_app",
}

PATH_METAVARS = {"FILE", "DIR", "FOLDER", "PATH", "GAME"}


@cache
def build_command(name: str) -> Any:
    """Return the command of this name; its help leaves out environment variables.

    It refuses empty paths.
    """
    module, _, attribute = COMMANDS[name].partition(":")
    target = getattr(import_module(f"dmplay.cli.{module}"), attribute)
    if not isinstance(target, typer.Typer):
        function, target = target, typer.Typer(add_completion=False, rich_markup_mode=None)
        target.command(name)(function)
    command: Any = typer.main.get_command(target)
    for shown_command in (command, *getattr(command, "commands", {}).values()):
        shown_command.invoke = partial(_record_and_invoke, shown_command, shown_command.invoke)
        for option in shown_command.params:
            option.show_envvar = False
            if _strip_metavar(option) in PATH_METAVARS:
                option.process_value = partial(_refuse_empty_path, option, option.process_value)
    return command


def _record_and_invoke(command: Any, invoke: Callable[[Any], Any], context: Any) -> Any:
    """Run a command, and record it with its options as the source of what is written."""
    if not hasattr(command, "commands"):
        options = {key: context.params[key] for key in sorted(context.params)}
        words = context.command_path.split()[1:]
        words += list_words(command.params, options)
        set_running_command(RunningCommand(tuple(words), options))
        if options.get("meta"):
            from dmplay.output.provenance import find_meta_file

            find_meta_file()  # It refuses a file before the command runs.
    return invoke(context)


def _strip_metavar(option: Any) -> str:
    """Return the metavar of an option without brackets and dots; "" for none."""
    return (option.metavar or "").strip("[].")


def _refuse_empty_path(
    option: Any, process_value: Callable[[Any, Any], Any], context: Any, value: Any
) -> Any:
    """Return the processed value of a path option; raise BadParameter for an empty path.

    An unset variable of a shell, as in `-o "$FILE"`, would otherwise mean the current folder. After
    the processing, Typer 0.29 has a Path, in which an empty path is the current folder.
    """
    if value == "" or (isinstance(value, tuple | list) and "" in value):
        metavar = _strip_metavar(option)
        name = max(option.opts, key=len) if option.param_type_name == "option" else metavar
        raise BadParameter(f"{name}: got an empty path, expected {metavar}")
    return process_value(context, value)
