"""CLI commands that print reports, such as lists of problems, solutions and settings."""

import os
from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import config_files, options
from dmplay.errors import BadParameter
from dmplay.terminal.capabilities import TerminalOptions, current_terminal


@options.with_terminal_options("json", "color", "width")
def list_(
    kind: options.ProblemKind = "",
    all_: Annotated[
        bool, typer.Option("--all", help="with games: list all saved games, not only the latest 20")
    ] = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """List the problems (table F.1 of the book) or the saved games.

    \b
      dmplay list
      dmplay list pomdp --json
      dmplay list games
    """
    from dmplay.game.command_line_results import Printout

    if kind == "games":
        from dmplay.output import saved_games

        return saved_games.report_saved_games(all_games=all_, json=terminal_options.json)
    if all_:
        raise BadParameter("--all: applies only to saved games; use dmplay list games --all")
    from dmplay.output import problem_table

    return Printout(
        problem_table.report_problem_table(kind, terminal_options),
        terminal_options,
        stderr_text=problem_table.format_load_failures(),
    )


def records(json: options.JsonFlag = False) -> object:
    """Show your best and your latest results, and your best medals.

    Only games that you played to their end count. A game can be your best result, and
    earn a medal, only if all of this is true:

    \b
    - You played from its first turn. It is no branch, and not a restarted game.
    - The usual agents played the other seats.
    - You used no hint, ghost, undo, reroll, --reveal or --peek.
    - Its transcript verifies.

    \b
      dmplay records
      dmplay records --json
    """
    from dmplay.output import records_report

    return records_report.report_records(json=json)


@options.with_terminal_options("json", "motion", motion=options.ProgressMotion)
def solve(
    problem: options.ProblemName,
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    method: Annotated[
        str,
        typer.Option(
            "--method",
            metavar="NAME",
            help="solver: value-iteration, policy-iteration, backward-induction, alpha-vectors, "
            "point-based, joint-plans, central-planner, enumeration, lemke-howson, "
            "regret-matching, shapley-iteration, best-responses or simulation; it must fit the "
            "problem",
        ),
    ] = "",
    episodes: Annotated[
        int | None,
        options.number_option(
            int, "number of games, if dmplay simulates an agent, for example in 2048", min=2
        ),
    ] = None,
    turns: Annotated[
        int | None, options.number_option(int, "number of turns of a game or plan", min=1)
    ] = None,
    workers: options.WorkerCount = "",
    work: Annotated[
        float | None,
        options.number_option(
            float,
            "planning time, if no exact value is known; 2: twice the default",
            min=0.01,
            max=100,
        ),
    ] = None,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Compute the best actions of a problem and their values.

    The report names the method. A value is an expected return. The return of a game is
    the sum of its rewards, and a discount makes later rewards count less.

    \b
    - For players with different goals, the report shows an equilibrium: no player
      gains by changing only its own strategy.
    - For a team, the report shows the best plans, or bounds on their value.
    - If a problem is too large, dmplay simulates an agent. The report says so.

    \b
      dmplay solve hexworld --set slip=0.1
      dmplay solve hexworld --set slip=0:0.5:0.05
      dmplay solve hexworld --method policy-iteration
      dmplay solve 2048 --episodes 100 --workers 2
      dmplay solve rock-paper-scissors --json
      dmplay solve ./tigers.dpomdp --turns 4
      dmplay solve ./hallway.pomdp --work 10
    """
    from dmplay.evaluation.solutions.options import SolveOptions
    from dmplay.game.launch_requests import format_variant_name, parse_settings
    from dmplay.output import solution_report

    solve_options = SolveOptions(
        episodes, turns, options.parse_workers(workers) if workers else None, work, method
    )
    return solution_report.report_solution(
        format_variant_name(problem, variant),
        parse_settings(set_, "--set"),
        solve_options,
        json=terminal_options.json,
        motion=terminal_options.motion,
    )


def convert(
    problem: options.ProblemName,
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="file to write")],
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    force: options.Force = False,
) -> object:
    """Write a problem as a .pomdp, .mdp, .dpomdp or .nfg file.

    Other programs can read these formats. The end of the file name selects the format.

    \b
      dmplay convert crying-baby -o baby.pomdp
      dmplay convert hexworld --set slip=0.2 -o hexworld.mdp
      dmplay convert prisoners-dilemma -o dilemma.nfg
    """
    from dmplay.game.launch_requests import format_variant_name, parse_settings
    from dmplay.output.problem_export import convert_problem

    parameters = parse_settings(set_, "--set")
    return convert_problem(format_variant_name(problem, variant), parameters, output, force=force)


def agents(problem: options.ProblemName, json: options.JsonFlag = False) -> object:
    """List the agents for a problem, with their parameters.

    \b
      dmplay agents 2048
      dmplay agents prisoners-dilemma --json
    """
    from dmplay.output import problem_and_agent_reports

    return problem_and_agent_reports.report_agents(problem, json=json)


def info(
    problem: options.ProblemName, json: options.JsonFlag = False, keys: options.KeyPreset = None
) -> object:
    """Describe a problem: rules, parameters, agents and keys.

    The description also lists the states, actions, observations and variants, and the
    source of the rules. If the book leaves a rule open, the description shows the rule
    that dmplay uses.

    \b
      dmplay info hexworld
      dmplay info crying-baby --json
    """
    from dmplay.output import problem_and_agent_reports

    return problem_and_agent_reports.report_problem(
        problem, options.configured_keys(keys), json=json
    )


def check(
    problem: options.ProblemName,
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    agent: options.CheckedAgent = "",
    seat: options.CheckedSeat = "",
    json: options.JsonFlag = False,
) -> object:
    """Check your own problem, or your own agent, for errors.

    The checks of a problem cover arrays, labels, probabilities, states, agents,
    drawing, and all else that it defines: solution, figures, puzzles and quantities.
    dmplay prints each violation with the line number in your file. If there is a
    violation, the exit code is 2.

    With --agent, the agent plays the problem. Its choices must be legal, the same
    alone and in a batch of games, and the same in other processes. dmplay prints the
    first violation, and the exit code is 1.

    \b
      dmplay check ./tiger.py
      dmplay check ./shop.py:Shop --set price=9
      dmplay check crying-baby --agent ./calm.py:Calm
      dmplay check prisoners-dilemma --agent tit-for-tat --seat agent2
    """
    from dmplay.game.launch_requests import format_variant_name, parse_settings
    from dmplay.terminal.progress import ProgressBar
    from dmplay.validation import check_report

    if seat and not agent:
        raise BadParameter("--seat: expected --agent too, which names the agent to check")
    name, parameters = format_variant_name(problem, variant), parse_settings(set_, "--set")
    with ProgressBar(f"checking {agent or name}", quiet=json):
        if agent:
            return check_report.report_agent_trial(name, parameters, agent, seat, json=json)
        return check_report.report_violations(name, parameters, json=json)


@options.with_terminal_options(
    "plain", "color", "ascii", "theme", "width", plain=options.PagedPlain
)
def guide(
    topic: options.TopicName = "",
    raw: Annotated[bool, typer.Option("--raw", help="print the Markdown source")] = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Read the guide: first game, transcripts, problems and more.

    \b
      dmplay guide                  list the topics
      dmplay guide agents
      dmplay guide agents --raw
    """
    from dmplay.game.command_line_results import Printout
    from dmplay.guide import topics

    if topic and raw:
        return topics.read_topic(topic).removesuffix("\n")
    if topic:
        from dmplay.output import guide_pages

        return Printout(
            guide_pages.render_topic(topic, current_terminal(terminal_options)),
            terminal_options,
            paged=True,
        )
    if raw:
        raise BadParameter("guide: --raw needs a topic, such as agents; dmplay guide lists them")
    return topics.format_topic_list()


config_app = typer.Typer(
    rich_markup_mode=None,
    add_completion=False,
    help="""Show the settings, and the paths of the files that set them.

An option on the command line overrides a DMPLAY_* variable. A variable
overrides ./dmplay.toml, and ./dmplay.toml overrides your own config.toml.

\b
  dmplay config show
  dmplay config path""",
)


@config_app.command("show")
def config_show(ctx: typer.Context, json: options.JsonFlag = False) -> object:
    """Show the settings, their values and where each value comes from.

    The text leaves out default values, except those of 'dmplay play'. With --json,
    all settings are shown.

    \b
      dmplay config show
      DMPLAY_COLOR=never dmplay config show --json
    """
    from dmplay.cli.settings import format_settings, iter_effective_settings, iter_keys_and_aliases

    settings = [*iter_effective_settings(ctx.find_root()), *iter_keys_and_aliases()]
    return format_settings(settings, as_json=json)


@config_app.command("path")
def config_path() -> object:
    """Print the paths of the two settings files.

    \b
      dmplay config path
    """
    return "\n".join(map(str, config_files.config_paths(os.environ)))
