"""The arguments and options that commands share, and what completes each of them."""

import inspect
from collections.abc import Callable, Mapping
from functools import wraps
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from dmplay.cli import config
from dmplay.errors import BadParameter
from dmplay.finding.topics import topics
from dmplay.game.formats import FORMATS
from dmplay.terminal import Wishes
from dmplay.words.completion import lists


def problem_of(ctx: typer.Context) -> str:
    """The problem that stands before the cursor, with its variant."""
    # An option that still lacks its value leaves the arguments before it unread.
    base = ctx.params.get("problem") or next((word for word in ctx.args if word[:1] != "-"), "")
    variant = ctx.params.get("variant")
    return f"{base}:{variant}" if variant else str(base)


def source(ctx: typer.Context, option: str) -> str:
    """What gave an option its value: DEFAULT_MAP is a file of settings."""
    return getattr(ctx.get_parameter_source(option), "name", "")


def is_said(ctx: typer.Context, option: str) -> bool:
    """Whether an option has a value that is no file's, so that it is not to be passed over."""
    return ctx.params[option] is not None and source(ctx, option) != "DEFAULT_MAP"


def _heeded(kind: str) -> Callable[[typer.Context, typer.CallbackParam, Any], object]:
    """What is typed of an option; what a file of settings says of it, as far as that fits."""

    def callback(ctx: typer.Context, option: typer.CallbackParam, value: Any) -> object:
        if ctx.resilient_parsing or source(ctx, str(option.name)) != "DEFAULT_MAP":
            return tuple(value) if isinstance(value, list) else value
        from dmplay.cli import fitting

        return fitting.KINDS[kind](ctx, option, value, problem_of(ctx))

    return callback


def _agents(ctx: typer.Context, incomplete: str) -> list[str]:
    from dmplay.words.completion.problem import agents

    return agents(problem_of(ctx), incomplete)


def _seats(ctx: typer.Context, incomplete: str) -> list[str]:
    from dmplay.words.completion.problem import seats

    return seats(problem_of(ctx), incomplete)


def _parameters(ctx: typer.Context) -> list[str]:
    from dmplay.words.completion.problem import parameters

    return parameters(problem_of(ctx))


def _variants(ctx: typer.Context) -> list[str]:
    base = problem_of(ctx)
    return [spec.partition(":")[2] for spec in lists.problems(f"{base}:") if ":" in spec]


def wanted_keys(preset: str | None) -> Any:
    """The keys of a preset, and those of the files."""
    from dmplay.keys import keymap

    return keymap.Keys(preset or "", config.keys())


def _argument(word: str, told: str, complete: Callable[..., list[str]]) -> Any:
    """An argument, as the help writes it, and what completes it."""
    return typer.Argument(metavar=word, help=told, autocompletion=complete)


def _option(
    word: str, told: str, complete: Callable[..., list[str]], *flags: str, **more: Any
) -> Any:
    """An option, its value as the help writes it, and what completes that."""
    return typer.Option(*flags, metavar=word, help=told, autocompletion=complete, **more)


def _seated(told: str, *flags: str) -> Any:
    """An option that names an agent."""
    return _option("AGENT", told, _agents, *flags, callback=_heeded("agent"))


def _everywhere(name: str, told: str, *flags: str, **more: Any) -> Any:
    """An option that one variable sets for every command."""
    return typer.Option(
        *(flags or [f"--{name}"]), envvar=f"DMPLAY_{name.upper()}", help=told, **more
    )


def _switch(name: str, told: str) -> Any:
    """A wish that one variable grants or denies for every command."""
    return _everywhere(name, told, f"--{name}/--no-{name}")


Name = Annotated[str, _argument("PROBLEM", "a problem, or PROBLEM:VARIANT", lists.problems)]
Variant = Annotated[str, _option("NAME", "a named variant", _variants, "--variant", "-V")]
Set = Annotated[
    list[str],
    _everywhere(
        "set",
        "a parameter; may be repeated",
        metavar="K=V",
        autocompletion=_parameters,
        callback=_heeded("parameters"),
    ),
]
Seed = Annotated[int | None, _option("N", "the dice; new ones if not given", lists.seeds, "--seed")]
Agent = Annotated[str, _seated("who plays the first seat", "--agent")]
Ghost = Annotated[str, _seated("who plays the same dice beside you", "--ghost")]
Others = Annotated[str, _seated("who plays all other seats", "--vs")]
Seats = Annotated[
    list[str], _option("NAME=A", "who plays one seat", _seats, "--seat", callback=_heeded("seats"))
]
File = Annotated[Path, _argument("FILE", "a transcript", lists.transcripts)]
LastFile = Annotated[
    Path | None, _argument("FILE", "a transcript; the last game if not given", lists.transcripts)
]
MaybeName = Annotated[
    str,
    _argument("PROBLEM", "a problem, or PROBLEM:VARIANT; none with --assignment", lists.problems),
]
Assignment = Annotated[
    Path | None, typer.Option("--assignment", metavar="FILE", help="what all are to play")
]
Player = Annotated[
    str,
    typer.Option("--player", metavar="NAME", help="who you are", callback=_heeded("wish")),
]
Paths = Annotated[list[Path], _argument("PATH...", "files and folders", lists.transcripts)]
Figure = Annotated[
    str, _argument("FIGURE", "F.2, F.9 ... F.16, T.1, T.2; their names if not given", lists.figures)
]
Topic = Annotated[
    str,
    _argument("TOPIC", f"{', '.join(topics())}; their titles if not given", lambda: [*topics()]),
]
Kind = Annotated[
    str,
    _argument("KIND", "only these, as POMDP; games: those that are kept", lambda: [*lists.KINDS]),
]
Json = Annotated[bool, typer.Option("--json", help="as JSON; of what is played, an object a line")]
Trust = Annotated[bool, typer.Option("--trust", help="import what a transcript names")]
Keys = Annotated[
    Literal["vi", "left", "arrows", "digits"] | None,
    _everywhere("keys", "vi, left, arrows or digits first", metavar="NAME"),
]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="print nothing but errors")]
Speed = Annotated[
    float, _everywhere("speed", "turns a second when agents play", metavar="X", min=0.1)
]
Rate = Annotated[
    float | None,
    typer.Option(
        "--rate",
        metavar="X",
        min=0.1,
        max=1000,
        help="real time: turns a second, 50 if bare",
        callback=_heeded("wish"),
    ),
]
Episode = Annotated[
    int, typer.Option("--episode", metavar="N", min=0, help="which game of the seed")
]
Turns = Annotated[
    int | None, typer.Option("--turns", metavar="N", help="the game ends after so many")
]
Unattended = Annotated[
    int | None, typer.Option("--turns", metavar="N", help="agents alone may play so many")
]
Record = Annotated[
    Path | None, typer.Option("--record", "-o", metavar="FILE", help="write a transcript")
]
Frames = Annotated[
    bool, typer.Option("--frames", help="boards in the transcript too", callback=_heeded("wish"))
]
Force = Annotated[bool, typer.Option("--force", help="overwrite the file")]
Reveal = Annotated[bool, typer.Option("--reveal", help="show the hidden state")]
Strict = Annotated[
    bool, typer.Option("--strict", help="no undo, no reroll; --strict=hints: no help either")
]
StrictHints = Annotated[bool, typer.Option("--strict-hints", help="the same as --strict=hints")]
Peek = Annotated[
    bool, typer.Option("--peek", help="look into a game that can be played on, and mark it so")
]
Workers = Annotated[
    str, typer.Option("--workers", metavar="N", help="processes; auto: as many as pay")
]
Output = Annotated[Path | None, typer.Option("--output", "-o", metavar="FILE", help="a file")]


def many(workers: str) -> int | Literal["auto"]:
    """How many workers a word means."""
    if workers == "auto":
        return "auto"
    if not workers.isdecimal():
        raise BadParameter(f"--workers: got {workers!r}, expected auto or a number")
    return int(workers)


WISHES = {
    "plain": Annotated[bool, _switch("plain", "lines, not the full screen")],
    "json": Json,
    "color": Annotated[
        Literal["auto", "always", "never"],
        _everywhere("color", "auto, always or never", metavar="WHEN"),
    ],
    "ascii": Annotated[bool, _switch("ascii", "draw in ASCII")],
    "theme": Annotated[
        Literal["default", "mono", "high-contrast"],
        _everywhere("theme", "default, mono or high-contrast", metavar="NAME"),
    ],
    "width": Annotated[
        int | None, _everywhere("width", "columns to draw in, if fewer", metavar="N", min=1)
    ],
    "motion": Annotated[bool, _switch("motion", "let things move by themselves")],
    "input": Annotated[bool, _switch("input", "let a person be asked")],
}
Command = Callable[..., object]


def wishes(*some: str) -> Callable[[Command], Command]:
    """Gives a command, in place of its parameter `wishes`, the options of `Wishes`, or some."""
    options = {
        name: (WISHES[name], Wishes._field_defaults[name]) for name in some or Wishes._fields
    }
    return spread("wishes", options, lambda given: Wishes(**given))


def formats(command: Command) -> Command:
    """Gives a command, in place of its parameter `formats`, an option for each."""
    options = {
        name: (Annotated[bool, typer.Option(f"--{name}", help=one.help)], False)
        for name, one in FORMATS.items()
    }
    return spread("formats", options, lambda given: [n for n, wish in given.items() if wish])(
        command
    )


def spread(
    name: str, options: Mapping[str, tuple[Any, object]], gather: Callable[[dict[str, Any]], object]
) -> Callable[[Command], Command]:
    """Gives a command options in place of a parameter, which is what `gather` makes of them.

    Typer has no groups of options; it reads them from a signature.
    """

    def spreading(command: Command) -> Command:
        @wraps(command)
        def run(**given: Any) -> object:
            gathered = gather({option: given.pop(option) for option in options})
            return command(**given, **{name: gathered})

        signature = inspect.signature(command)
        kind = inspect.Parameter.KEYWORD_ONLY
        more = [
            inspect.Parameter(option, kind, default=default, annotation=annotation)
            for option, (annotation, default) in options.items()
        ]
        own = [one.replace(kind=kind) for one in signature.parameters.values()]
        at = [one.name for one in own].index(name)
        changed = signature.replace(parameters=[*own[:at], *more, *own[at + 1 :]])
        run.__signature__ = changed  # type: ignore[attr-defined] # which inspect takes for its own
        return run

    return spreading
