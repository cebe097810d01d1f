"""The command-line program: all commands, in the order in which the help lists them."""

import os
from functools import cache
from typing import Any

os.environ.setdefault("TYPER_USE_RICH", "0")  # Rich's help takes longer than the rest of the start

import typer

from dmplay.cli import (
    evaluation,
    games,
    grading,
    learn,
    plots,
    reports,
    transcripts,
    watching,
)
from dmplay.cli.command_group import CommandGroup, refuse_infinite_numbers

app = typer.Typer(
    cls=CommandGroup,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"], "auto_envvar_prefix": "DMPLAY"},
    help="""Play the decision problems of Algorithms for Decision Making in a terminal.

\b
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
app.command()(games.play)
app.command()(games.resume)
app.command()(games.replay)
app.command()(games.shell)
app.command()(transcripts.verify)
app.command()(transcripts.export)
app.command()(transcripts.review)
app.command()(games.branch)
app.command()(games.bot)
app.command()(games.mcp)
app.command("list")(reports.list_)
app.command()(reports.records)
app.command()(reports.solve)
app.command()(watching.watch)
app.command()(reports.convert)
app.command()(evaluation.run)
app.command()(evaluation.compare)
app.command()(evaluation.tournament)
app.add_typer(learn.learn_app, name="learn")
app.command()(grading.assign)
app.command()(grading.grade)
app.command()(plots.plot)
app.command()(reports.agents)
app.command()(reports.info)
app.command()(reports.check)
app.command()(reports.guide)

config_app = typer.Typer(
    rich_markup_mode=None,
    help="""Show the settings, and the paths of the files that set them.

An option on the command line overrides a DMPLAY_* variable. A variable
overrides ./dmplay.toml, and ./dmplay.toml overrides your own config.toml.

\b
  dmplay config show
  dmplay config path""",
)
config_app.command("show")(reports.config_show)
config_app.command("path")(reports.config_path)
app.add_typer(config_app, name="config")


@cache
def root_command() -> Any:
    """Return the Click group of all commands, created once."""
    group = typer.main.get_command(app)
    assert isinstance(group, CommandGroup)
    for command in group.commands.values():
        refuse_infinite_numbers(command.params)
    options: list[Any] = list(group.params)
    for option in options:
        if option.name == "show_completion":  # Typer's own text is hard to understand
            option.help = "Print the completion script for the current shell."
    return group
