"""Commands that print: problems, agents, solutions, figures, the guide and settings."""

import os
from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import config, options
from dmplay.errors import BadParameter
from dmplay.terminal import Wishes, here


@options.wishes("json", "color", "width")
def list_(kind: options.Kind = "", *, wishes: Wishes) -> object:
    """List the problems: table F.1 of the book. Or the games that are kept.

    \b
      dmplay list
      dmplay list pomdp --json
      dmplay list games
    """
    from dmplay.game.errand import Printout
    from dmplay.reports import games, problems

    if kind == "games":
        return games.listing(json=wishes.json)

    return Printout(problems.listing(kind, wishes), wishes, errors=problems.unlisted())


def records(json: options.Json = False) -> object:
    """Tell your best and your last games: those that you played to their end.

    The best are of games that verify, with no help, nothing taken back, no look at
    what is hidden, no branch, and the usual agents in the other seats.

    \b
      dmplay records
      dmplay records --json
    """
    from dmplay.reports import records

    return records.listing(json=json)


@options.wishes("json", "motion")
def solve(
    problem: options.Name,
    variant: options.Variant = "",
    set_: options.Set = [],  # noqa: B006 - typer reads it once
    episodes: Annotated[
        int | None, typer.Option("--episodes", metavar="N", min=2, help="games, if simulated")
    ] = None,
    turns: Annotated[
        int | None, typer.Option("--turns", metavar="N", min=1, help="of each, or of a plan")
    ] = None,
    workers: options.Workers = "",
    work: Annotated[
        float | None,
        typer.Option("--work", metavar="TIMES", min=0.01, max=100, help="as much work, for bounds"),
    ] = None,
    *,
    wishes: Wishes,
) -> object:
    """Solve a problem: values, best actions or equilibria, and how they were found.

    \b
      dmplay solve hexworld --set slip=0.1
      dmplay solve 2048 --episodes 100 --workers 2
      dmplay solve rock-paper-scissors --json
      dmplay solve ./tigers.dpomdp --turns 4
      dmplay solve ./hallway.pomdp --work 10
    """
    from dmplay.game.request import Request
    from dmplay.reports import solving
    from dmplay.solutions.played import Wish

    asked = Request(problem, variant, set_)
    wish = Wish(episodes, turns, options.many(workers) if workers else None, work)
    return solving.solved(
        asked.name, asked.configured(), wish, json=wishes.json, motion=wishes.motion
    )


def convert(
    problem: options.Name,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="a file")],
    variant: options.Variant = "",
    set_: options.Set = [],  # noqa: B006 - typer reads it once
    force: options.Force = False,
) -> object:
    """Write a finite problem as a file for other programs: .pomdp, .mdp, .dpomdp or .nfg.

    \b
      dmplay convert crying-baby -o baby.pomdp
      dmplay convert hexworld --set slip=0.2 -o hexworld.mdp
      dmplay convert prisoners-dilemma -o dilemma.nfg
    """
    from dmplay.game.request import Request
    from dmplay.reports.converting import converted

    asked = Request(problem, variant, set_)
    return converted(asked.name, asked.configured(), output, force=force)


@options.wishes("color", "ascii", "theme")
def figure(
    name: options.Figure = "",
    svg: Annotated[bool, typer.Option("--svg", help="as a picture")] = False,
    output: options.Output = None,
    force: options.Force = False,
    *,
    wishes: Wishes,
) -> object:
    """Draw a figure or table of the book's appendix F from the problems themselves.

    \b
      dmplay figure                 names them
      dmplay figure F.2
      dmplay figure F.11 --svg -o regions.svg
    """
    from dmplay.reports import drawing

    if name:
        return drawing.drawn(name, output, svg=svg, force=force)._replace(wishes=wishes)
    if svg or output:
        raise BadParameter("figure: --svg and -o want a figure, as F.2; dmplay figure names them")
    return drawing.named()


def agents(problem: options.Name, json: options.Json = False) -> object:
    """List the agents that fit a problem, with their parameters.

    \b
      dmplay agents 2048
      dmplay agents prisoners-dilemma --json
    """
    from dmplay.reports import problems

    return problems.who_plays(problem, json=json)


def info(problem: options.Name, json: options.Json = False, keys: options.Keys = None) -> object:
    """Tell all about a problem: spaces, parameters, variants, agents, keys, decisions, source.

    \b
      dmplay info hexworld
      dmplay info crying-baby --json
    """
    from dmplay.reports import problems

    return problems.info(problem, options.wanted_keys(keys), json=json)


def check(
    problem: options.Name,
    variant: options.Variant = "",
    set_: options.Set = [],  # noqa: B006 - typer reads it once
    json: options.Json = False,
) -> object:
    """Check a problem of yours: arrays, labels, chances, states, agents and look.

    A line for each fault, with the line of your file; exit code 2 where there is one.

    \b
      dmplay check ./tiger.py
      dmplay check ./shop.py:Shop --set price=9
    """
    from dmplay.game.request import Request
    from dmplay.reports import checked

    asked = Request(problem, variant, set_)
    return checked.report(asked.name, asked.configured(), json=json)


@options.wishes("plain", "color", "ascii", "theme", "width")
def guide(
    topic: options.Topic = "",
    raw: Annotated[bool, typer.Option("--raw", help="the Markdown itself")] = False,
    *,
    wishes: Wishes,
) -> object:
    """Read the guide: a first game, transcripts, problems and agents of your own, and more.

    \b
      dmplay guide                  names the topics
      dmplay guide agents
      dmplay guide agents --raw
    """
    from dmplay.finding import topics
    from dmplay.game.errand import Printout
    from dmplay.reports import guide

    if topic and raw:
        return topics.topic(topic).removesuffix("\n")
    if topic:
        return Printout(guide.drawn(topic, here(wishes)), wishes, paged=True)
    if raw:
        raise BadParameter("guide: --raw wants a topic, as agents; dmplay guide names them")
    return guide.named()


def config_show(ctx: typer.Context, json: options.Json = False) -> object:
    """Show every setting with its value and where it comes from.

    \b
      dmplay config show
      DMPLAY_COLOR=never dmplay config show --json
    """
    from dmplay.cli.settings import in_force, named, shown

    settings = [*in_force(ctx.find_root()), *named()]
    return shown(settings, as_json=json)


def config_path() -> object:
    """Tell where the files of settings are looked for.

    \b
      dmplay config path
    """
    return "\n".join(map(str, config.paths(os.environ)))
