"""Arguments and options shared by several commands, with their completions."""

import inspect
import io
import math
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout, suppress
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from dmplay.cli import config_files
from dmplay.core.parameter_parsing import NUMBER_PATTERN, parse_whole_number
from dmplay.errors import BadParameter
from dmplay.game.completion import name_lists
from dmplay.game.export_formats import EXPORT_FORMATS
from dmplay.guide.topics import list_topics
from dmplay.terminal.capabilities import TerminalOptions

MAX_WHOLE_NUMBER = 2**63 - 1  # of a seed in a transcript, and of NumPy


def problem_in_context(ctx: typer.Context) -> str:
    """Return the name of the problem typed before the cursor, with its variant."""
    # While an option lacks its value, Click leaves the arguments before it unparsed.
    base = ctx.params.get("problem") or next((word for word in ctx.args if word[:1] != "-"), "")
    variant = ctx.params.get("variant")
    return f"{base}:{variant}" if variant else str(base)


def option_source(ctx: typer.Context, option: str) -> str:
    """Return the source of an option's value, such as DEFAULT_MAP for a settings file."""
    return getattr(ctx.get_parameter_source(option), "name", "")


def is_set_by_user(ctx: typer.Context, option: str) -> bool:
    """Return whether an option has a value that does not come from a settings file."""
    return ctx.params[option] is not None and option_source(ctx, option) != "DEFAULT_MAP"


def _complete_agents(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the agents of the typed problem, for completion."""
    from dmplay.game.completion.agents_seats_and_parameters import complete_agents

    return complete_agents(problem_in_context(ctx), incomplete)


def _complete_seats(ctx: typer.Context, incomplete: str) -> list[str]:
    """Return the seats of the typed problem, or the players of a seat, for completion."""
    from dmplay.game.completion.agents_seats_and_parameters import complete_seats

    return complete_seats(problem_in_context(ctx), incomplete)


def _complete_seat_names(ctx: typer.Context) -> list[str]:
    """Return the names of the typed problem's seats, for completion."""
    return [seat.removesuffix("=") for seat in _complete_seats(ctx, "")]


def _complete_parameters(ctx: typer.Context) -> list[str]:
    """Return the parameters of the typed problem, for completion."""
    from dmplay.game.completion.agents_seats_and_parameters import list_parameters

    return list_parameters(problem_in_context(ctx))


def _complete_variants(ctx: typer.Context) -> list[str]:
    """Return the variants of the typed problem, for completion."""
    base = problem_in_context(ctx)
    return [
        spec.partition(":")[2] for spec in name_lists.complete_problems(f"{base}:") if ":" in spec
    ]


def configured_keys(preset: str | None) -> Any:
    """Return the key preferences: the preset, and the keys of settings files."""
    from dmplay.game.key_preferences import KeyPreferences

    return KeyPreferences(preset or "", config_files.merged_keys())


def _complete_safely(complete: Callable[..., list[str]]) -> Callable[..., list[str]]:
    """Return a completion function without its output, and without values of several lines.

    The shell reads the completions from the output, one a line.
    """

    @wraps(complete)
    def complete_quietly(**arguments: Any) -> list[str]:
        """Return the completions."""
        with redirect_stdout(io.StringIO()):  # libraries print greetings
            return [word for word in complete(**arguments) if word.isprintable()]

    return complete_quietly


def argument(metavar: str, help_text: str, complete: Callable[..., list[str]]) -> Any:
    """Return a Typer argument with its metavar, help text and completion."""
    completion = _complete_safely(complete)
    # Typer would end the command at the first path that cannot be read.
    return typer.Argument(
        metavar=metavar, help=help_text, autocompletion=completion, readable=False
    )


def _option(
    metavar: str, help_text: str, complete: Callable[..., list[str]], *flags: str, **extra: Any
) -> Any:
    """Return a Typer option with its metavar, help text and completion."""
    completion = _complete_safely(complete)
    return typer.Option(*flags, metavar=metavar, help=help_text, autocompletion=completion, **extra)


def number_option(
    kind: type[int] | type[float],
    help: str,
    *,
    min: float | None = None,
    max: float | None = None,
    **extra: Any,
) -> Any:
    """Return a Typer option for a finite number of this kind, with its range in the help."""
    bounds = "" if min is None else f"x>={min}" if max is None else f"{min}<=x<={max}"
    limits = (
        "" if min is None else f" of at least {min}" if max is None else f" from {min} to {max}"
    )
    low = -math.inf if min is None else min
    high = max or (MAX_WHOLE_NUMBER if kind is int else math.inf)

    def number(value: Any) -> Any:
        """Return a value as a number; raise BadParameter if it is none, or out of the range."""
        parsed = math.nan
        with suppress(ValueError):  # as for 1.5 as a whole number
            parsed = kind(value) if NUMBER_PATTERN.fullmatch(str(value)) else math.nan
        if low <= parsed <= high and abs(parsed) != math.inf:
            return parsed
        expected = ("a whole number" if kind is int else "a number") + limits
        if high < parsed < math.inf and max is None:
            expected = f"at most {high}"
        raise typer.BadParameter(f"got {value!r}, expected {expected}")

    options = {"metavar": "N" if kind is int else "X", **extra}
    return typer.Option(help=f"{help}  [{bounds}]" if bounds else help, parser=number, **options)


def _agent_option(help_text: str, *flags: str) -> Any:
    """Return a Typer option whose value is an agent."""
    return _option("AGENT", help_text, _complete_agents, *flags)


def shared_switch(name: str, help_text: str) -> Any:
    """Return an on/off option that an environment variable sets for every command."""
    return typer.Option(f"--{name}/--no-{name}", envvar=f"DMPLAY_{name.upper()}", help=help_text)


def _width_option(help_text: str) -> Any:
    """Return a Typer option for a width, which an environment variable sets for every command."""
    return number_option(int, help_text, min=1, envvar="DMPLAY_WIDTH")


ProblemName = Annotated[
    str,
    argument(
        "PROBLEM", "problem: NAME, NAME:VARIANT, FILE or FOLDER/", name_lists.complete_problems
    ),
]
VariantName = Annotated[
    str, _option("NAME", "variant of the problem", _complete_variants, "--variant", "-V")
]
ParameterSettings = Annotated[
    list[str],
    _option(
        "NAME=VALUE", "parameter of the problem (repeatable)", _complete_parameters, "--set",
        envvar="DMPLAY_SET",
    ),
]  # fmt: skip
Seed = Annotated[
    int | None,
    number_option(
        int,
        "random seed (default: a new one)",
        autocompletion=_complete_safely(name_lists.list_saved_seeds),
    ),
]
# Typer 0.27 spells an option like its metavar, unless its flag is given.
FirstSeatAgent = Annotated[str, _agent_option("agent that plays the first seat", "--agent")]
BatchAgent = Annotated[
    str,
    _agent_option(
        "agent that plays the first seat (default: a quick agent; the report names it)", "--agent"
    ),
]
GhostAgent = Annotated[
    str, _agent_option("agent that plays a copy of your game, with the same random numbers")
]
PredictionKind = Annotated[
    str,
    _option(
        "KIND",
        "ask for a prediction before each turn is played; KIND: belief, outcome or value",
        name_lists.complete_prediction_kinds,
    ),
]
StateBelief = Annotated[
    bool,
    typer.Option(
        "--state-belief",
        help="hide the belief, and ask for yours with each action; the transcript records it",
    ),
]
OtherAgents = Annotated[
    str, _agent_option("agent that plays all seats but the first (default: see 'dmplay agents')")
]
AgentsOfOtherSeats = Annotated[
    str, _agent_option("agent that plays the other seats (default: see 'dmplay agents')", "--vs")
]
SeatAgents = Annotated[
    list[str],
    _option("NAME=AGENT", "agent that plays the seat NAME (repeatable)", _complete_seats, "--seat"),
]
EvaluatedSeat = Annotated[
    list[str],
    _option(
        "NAME", "seat to evaluate (default: the first); NAME=AGENT: the agent of another seat",
        _complete_seats, "--seat",
    ),
]  # fmt: skip
CheckedAgent = Annotated[str, _agent_option("agent to check")]
CheckedSeat = Annotated[
    str, _option("NAME", "seat of the agent to check (default: the first)", _complete_seat_names)
]
TranscriptPath = Annotated[
    Path, argument("FILE", "transcript file", name_lists.complete_transcripts)
]
OptionalTranscriptPath = Annotated[
    Path | None,
    argument(
        "FILE",
        "transcript file (default: the newest game that you left)",
        name_lists.complete_transcripts,
    ),
]
OptionalProblemName = Annotated[
    str,
    argument(
        "PROBLEM",
        "problem: NAME, NAME:VARIANT, FILE or FOLDER/; leave it out with --assignment",
        name_lists.complete_problems,
    ),
]
AssignmentFile = Annotated[
    Path | None, typer.Option(metavar="FILE", help="assignment file from dmplay assign")
]
PlayerName = Annotated[str, typer.Option(metavar="NAME", help="your name, for the transcript")]
TranscriptPaths = Annotated[
    list[Path],
    argument("PATH...", "transcript files, or folders of them", name_lists.complete_transcripts),
]
TopicName = Annotated[
    str,
    argument("TOPIC", f"{', '.join(list_topics())} (default: list them)", lambda: [*list_topics()]),
]
ProblemKind = Annotated[
    str,
    argument(
        "KIND",
        "kind of problem, such as MDP (see 'dmplay guide glossary'); or games: saved games",
        lambda: [*name_lists.LIST_FILTERS],
    ),
]
MetaFile = Annotated[
    Path | None,
    typer.Option(metavar="FILE", help="write versions, command and seeds of the output to FILE"),
]
JsonFlag = Annotated[bool, typer.Option("--json", help="print JSON")]
JsonLinesFlag = Annotated[
    bool, typer.Option("--json", help="print JSON Lines, one object per event")
]
Trust = Annotated[
    bool,
    typer.Option(
        "--trust", help="run user code: import the problems and agents that a transcript names"
    ),
]
TrustAssignment = Annotated[
    bool,
    typer.Option(
        "--trust", help="run user code: import the problems and agents that the assignment names"
    ),
]
KeyPreset = Annotated[
    Literal["vi", "left", "arrows", "digits"] | None,
    typer.Option(
        metavar="NAME",
        envvar="DMPLAY_KEYS",
        help="keys: vi (hjklyubn), left (wasdezx, for the left hand), arrows or digits",
    ),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="print only errors")]
PlaybackSpeed = Annotated[
    float,
    number_option(
        float, "turns per second of automatic play (key P)", min=0.1, envvar="DMPLAY_SPEED"
    ),
]
RealTimeRate = Annotated[
    float | None,
    number_option(
        float,
        "play in real time; the clock speeds up to X turns per second (--rate alone: 50)",
        min=0.1,
        max=1000,
    ),
]
EpisodeNumber = Annotated[
    int,
    number_option(
        int, "which game of the seed to play: each seed has the games 0, 1, 2, ...", min=0
    ),
]
TurnLimit = Annotated[int | None, number_option(int, "maximum number of turns per game")]
UnattendedTurnLimit = Annotated[
    int | None, number_option(int, "turn limit; only for games without a person")
]
RecordPath = Annotated[
    Path | None,
    typer.Option("--record", "-o", metavar="FILE", help="write the transcript of the game to FILE"),
]
KeptMegabytes = Annotated[
    int,
    number_option(
        int,
        "maximum total size of saved games, in megabytes",
        min=1,
        metavar="MB",
        envvar="DMPLAY_KEEP",
    ),
]
Frames = Annotated[bool, typer.Option("--frames", help="also record a drawing of every turn")]
Force = Annotated[bool, typer.Option("--force", help="overwrite an existing file")]
Reveal = Annotated[bool, typer.Option("--reveal", help="show the hidden state")]
Strict = Annotated[
    bool,
    typer.Option(
        "--strict",
        help="forbid undo and reroll (new random numbers); --strict=hints also forbids hints",
    ),
]
StrictHints = Annotated[bool, typer.Option("--strict-hints", help="same as --strict=hints")]
Peek = Annotated[
    bool,
    typer.Option("--peek", help="show the hidden facts of an unfinished game; marks it as peeked"),
]
WorkerCount = Annotated[
    str, typer.Option(metavar="N", help="number of worker processes; auto: all cores for long runs")
]
OutputPath = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE", help="file to write (default: print)"),
]


def parse_workers(workers: str) -> int | Literal["auto"]:
    """Return the typed number of workers, or "auto"; raise BadParameter for other texts."""
    if workers == "auto":
        return "auto"
    count = parse_whole_number(workers)
    if not count:
        expected = "auto or a whole number of at least 1"
        raise BadParameter(f"--workers: got {workers!r}, expected {expected}")
    return count


TERMINAL_OPTIONS = {
    "plain": Annotated[bool, shared_switch("plain", "print lines, no full screen")],
    "json": JsonFlag,
    "color": Annotated[
        Literal["auto", "always", "never"],
        typer.Option(
            metavar="WHEN", envvar="DMPLAY_COLOR", help="when to use colours: auto, always or never"
        ),
    ],
    "ascii": Annotated[bool, shared_switch("ascii", "draw with ASCII characters only")],
    "theme": Annotated[
        Literal["auto", "dark", "light", "default", "mono", "high-contrast"],
        typer.Option(
            metavar="NAME",
            envvar="DMPLAY_THEME",
            help="colours: auto (by the background), dark, light, default (the terminal's own), "
            "mono or high-contrast",
        ),
    ],
    "width": Annotated[int | None, _width_option("maximum width in columns")],
    "motion": Annotated[
        bool, shared_switch("motion", "animate moves, and let the key P play turns automatically")
    ],
    "input": Annotated[
        bool,
        shared_switch(
            "input", "let a person type; in a terminal, --no-input needs an agent in every seat"
        ),
    ],
}
ViewerInput = Annotated[
    bool, shared_switch("input", "wait for keys; --no-input prints lines, as --plain does")
]
AnswerInput = Annotated[
    bool, shared_switch("input", "ask again after an invalid answer; --no-input stops there")
]
ScreenWidth = Annotated[int | None, _width_option("width of the screen in columns")]
ProgressMotion = Annotated[bool, shared_switch("motion", "show a progress bar")]
PagedPlain = Annotated[bool, shared_switch("plain", "print the text without a pager")]
Command = Callable[..., object]


def with_terminal_options(*names: str, **replacements: Any) -> Callable[[Command], Command]:
    """Return a decorator that replaces a command's `terminal_options` with single options.

    `names` selects some of them; by default all are added. `replacements` are options whose help
    text suits the command better.
    """
    available = TERMINAL_OPTIONS | replacements
    options = {
        name: (available[name], TerminalOptions._field_defaults[name])
        for name in names or TerminalOptions._fields
    }
    return expand_option_group(
        "terminal_options", options, lambda values: TerminalOptions(**values)
    )


def with_export_formats(command: Command) -> Command:
    """Replace the command's parameter `formats` with one flag per export format."""
    options = {
        name: (Annotated[bool, typer.Option(f"--{name}", help=export_format.help)], False)
        for name, export_format in EXPORT_FORMATS.items()
    }
    return expand_option_group(
        "formats",
        options,
        lambda flags: [format_name for format_name, is_set in flags.items() if is_set],
    )(command)


def expand_option_group(
    name: str,
    options: Mapping[str, tuple[Any, object]],
    collect: Callable[[dict[str, Any]], object],
) -> Callable[[Command], Command]:
    """Return a decorator that replaces a command's parameter with a group of options.

    The command gets the result of `collect` for the option values. Typer has no groups of options;
    it reads them from the signature, which is therefore rewritten.
    """

    def decorate(command: Command) -> Command:
        """Return the command with the options in its signature."""

        @wraps(command)
        def wrapper(**values: Any) -> object:
            """Call the command with the collected options."""
            collected = collect({option: values.pop(option) for option in options})
            return command(**values, **{name: collected})

        signature = inspect.signature(command)
        kind = inspect.Parameter.KEYWORD_ONLY
        option_parameters = [
            inspect.Parameter(option, kind, default=default, annotation=annotation)
            for option, (annotation, default) in options.items()
        ]
        parameters = [parameter.replace(kind=kind) for parameter in signature.parameters.values()]
        position = [parameter.name for parameter in parameters].index(name)
        new_signature = signature.replace(
            parameters=[*parameters[:position], *option_parameters, *parameters[position + 1 :]]
        )
        wrapper.__signature__ = new_signature  # type: ignore[attr-defined] # read by inspect
        return wrapper

    return decorate
