"""Commands that tell: problems, agents, solutions, figures and settings."""

import os
from typing import Annotated

import typer

from dmplay.cli import config, options
from dmplay.errors import BadParameter
from dmplay.terminal import Wishes, here


@options.wishes("json", "color", "width")
def list_(kind: options.Kind = "", *, wishes: Wishes) -> None:
    """List the problems: table F.1 of the book.

    \b
      dmplay list
      dmplay list pomdp --json
    """
    from dmplay.reports import problems as reports

    reports.print_list(kind, wishes)


@options.wishes("json", "motion")
def solve(
    problem: options.Name,
    variant: options.Variant = "",
    set_: options.Set = [],  # noqa: B006 - typer reads it once
    *,
    wishes: Wishes,
) -> None:
    """Solve a problem: values, best actions or equilibria, and how they were found.

    \b
      dmplay solve hexworld --set slip=0.1
      dmplay solve rock-paper-scissors --json
    """
    from dmplay.game.request import pairs
    from dmplay.reports import solving

    name = f"{problem}:{variant}" if variant else problem
    motion = wishes.motion
    solving.print_solution(name, pairs(set_, "--set"), json=wishes.json, motion=motion)


@options.wishes("color", "ascii", "theme")
def figure(
    name: options.Figure = "",
    svg: Annotated[bool, typer.Option("--svg", help="as a picture")] = False,
    output: options.Output = None,
    *,
    wishes: Wishes,
) -> None:
    """Draw a figure or table of the book's appendix F from the problems themselves.

    \b
      dmplay figure                 names them
      dmplay figure F.2
      dmplay figure F.11 --svg -o regions.svg
    """
    from dmplay.reports import drawing

    if name:
        drawing.print_figure(name, here(wishes), output, svg=svg)
    elif svg or output:
        raise BadParameter("figure: --svg and -o want a figure, as F.2; dmplay figure names them")
    else:
        drawing.print_names()


def agents(problem: options.Name, json: options.Json = False) -> None:
    """List the agents that fit a problem, with their parameters.

    \b
      dmplay agents 2048
      dmplay agents prisoners-dilemma --json
    """
    from dmplay.reports import problems as reports

    reports.print_agents(problem, json=json)


def info(problem: options.Name, json: options.Json = False, keys: options.Keys = None) -> None:
    """Tell all about a problem: spaces, parameters, variants, agents, keys, decisions, source.

    \b
      dmplay info hexworld
      dmplay info crying-baby --json
    """
    from dmplay.reports import problems as reports

    reports.print_info(problem, options.wanted_keys(keys), json=json)


def config_show(ctx: typer.Context, json: options.Json = False) -> None:
    """Show every setting with its value and where it comes from.

    \b
      dmplay config show
      DMPLAY_COLOR=never dmplay config show --json
    """
    from dmplay.cli.settings import in_force, named, shown

    told = [*in_force(ctx.find_root()), *named(config.files())]
    print(shown(told, as_json=json))


def config_path() -> None:
    """Tell where the files of settings are looked for.

    \b
      dmplay config path
    """
    user, project = config.paths(os.environ)
    print(user, project, sep="\n")
