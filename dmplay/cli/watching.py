"""The CLI command that shows algorithms step by step."""

from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.game.completion import name_lists
from dmplay.terminal.capabilities import TerminalOptions, current_terminal

EXPORTS = ("svg", "film", "html")
EXAMPLE = "dmplay watch value-iteration hexworld"
StepLines = Annotated[bool, typer.Option("--json", help="print JSON Lines, one object per step")]
StepMotion = Annotated[
    bool, options.shared_switch("motion", "let the key P play the steps automatically")
]


@options.with_terminal_options(json=StepLines, motion=StepMotion, input=options.ViewerInput)
def watch(
    algorithm: Annotated[
        str,
        options.argument(
            "ALGORITHM", "algorithm to watch (default: list them)", name_lists.list_algorithms
        ),
    ] = "",
    problem: Annotated[
        str,
        options.argument(
            "PROBLEM",
            "problem: NAME, NAME:VARIANT, FILE or FOLDER/; or a transcript file",
            name_lists.complete_problems,
        ),
    ] = "",
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    at: Annotated[
        int | None,
        options.number_option(
            int, "with a transcript: turn to work on (default: the last)", metavar="TURN"
        ),
    ] = None,
    seat: Annotated[
        str, typer.Option(metavar="NAME", help="seat that the algorithm works for")
    ] = "",
    seed: Annotated[int, options.number_option(int, "seed of the random numbers", min=0)] = 0,
    iterations: Annotated[
        int | None,
        options.number_option(int, "number of repetitions, such as simulations or rounds", min=1),
    ] = None,
    step: Annotated[
        int | None,
        options.number_option(
            int, "begin at step N; in lines and pictures, show only this step", min=1
        ),
    ] = None,
    speed: Annotated[
        float, options.number_option(float, "steps per second of automatic play (key P)", min=0.1)
    ] = 2.0,
    svg: Annotated[bool, typer.Option("--svg", help="write a picture of one step (SVG)")] = False,
    film: Annotated[
        bool, typer.Option("--film", help="write an animated picture of all steps (SVG)")
    ] = False,
    html: Annotated[bool, typer.Option("--html", help="write a page with a slider")] = False,
    height: Annotated[int, options.number_option(int, "height of the picture in rows", min=1)] = 24,
    output: options.OutputPath = None,
    force: options.Force = False,
    trust: options.Trust = False,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Watch an algorithm of the book at work, step by step.

    A step shows what the algorithm does, usually with the formula and its numbers. Space
    shows the next step, Backspace the previous step, and P plays all steps. In a pipe, dmplay
    prints the steps as text.

    \b
      dmplay watch
      dmplay watch value-iteration hexworld
      dmplay watch policy-iteration hexworld --set slip=0.1 --plain
      dmplay watch value-iteration mountain-car --step 40 --svg -o car.svg
      dmplay watch belief-update crying-baby --json
      dmplay watch fictitious-play rock-paper-scissors --html -o play.html
    """
    from dmplay.game import watching
    from dmplay.game.command_line_results import Printout, WatchCommand
    from dmplay.terminal.progress import ProgressBar

    chosen = [name for name, is_set in zip(EXPORTS, (svg, film, html), strict=True) if is_set]
    formats = [*chosen, *(["json"] if terminal_options.json else [])]
    if len(formats) > 1:
        raise BadParameter(f"watch: choose one of {', '.join(f'--{name}' for name in formats)}")
    if output and not chosen:
        raise BadParameter("-o: choose a format, --svg, --film or --html")
    if not algorithm:
        from dmplay.output.algorithm_list import report_algorithms

        return Printout(report_algorithms(json=terminal_options.json))
    target = watching.WatchTarget(problem, variant, set_, seat, at, trust)
    with ProgressBar(f"computing the steps of {algorithm}", quiet=terminal_options.json):
        watched = watching.load_watched_steps(algorithm, target, iterations, seed)
    index = None if step is None else watched.find_typed_step(step)
    if chosen:
        from dmplay.draw.options import DrawOptions
        from dmplay.output.step_export import StepExport, export_algorithm_steps

        size = DrawOptions(terminal_options.width or 80, height, terminal_options.ascii)
        return export_algorithm_steps(
            watched, StepExport(chosen[0], size, index), output, force=force
        )
    if current_terminal(terminal_options).full_screen:
        return WatchCommand(watched, terminal_options, speed, index or 0)
    from dmplay.ui.watch.step_lines import iter_json_lines, iter_lines

    lines = iter_json_lines if terminal_options.json else iter_lines
    return Printout("", terminal_options, text_chunks=lines(watched, index))
