"""Commands that play games; they return a request, which the caller executes."""

from pathlib import Path
from typing import Annotated

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.terminal.capabilities import TerminalOptions, current_terminal

ShellInput = Annotated[
    bool, options.shared_switch("input", "read typed commands; --no-input: only from -e or a pipe")
]


@options.with_terminal_options(json=options.JsonLinesFlag)
def play(
    problem: options.OptionalProblemName = "",
    variant: options.VariantName = "",
    set_: options.ParameterSettings = [],  # noqa: B006 - typer reads it once
    seed: options.Seed = None,
    episode: options.EpisodeNumber = 0,
    agent: options.FirstSeatAgent = "human",
    vs: options.OtherAgents = "",
    seat: options.SeatAgents = [],  # noqa: B006
    ghost: options.GhostAgent = "",
    predict: options.PredictionKind = "",
    state_belief: options.StateBelief = False,
    turns: options.TurnLimit = None,
    record: options.RecordPath = None,
    keep: options.KeptMegabytes = 200,
    frames: options.Frames = False,
    force: options.Force = False,
    reveal: options.Reveal = False,
    strict: options.Strict = False,
    strict_hints: options.StrictHints = False,
    quiet: options.Quiet = False,
    keys: options.KeyPreset = None,
    speed: options.PlaybackSpeed = 2.0,
    rate: options.RealTimeRate = None,
    assignment: options.AssignmentFile = None,
    player: options.PlayerName = "",
    trust: options.TrustAssignment = False,
    *,
    terminal_options: TerminalOptions,
    ctx: typer.Context,
) -> object:
    """Play a problem, or watch agents play it.

    Each player of a problem has a seat. You play the first seat, unless --agent names
    an agent. The same seed gives the same random numbers again.

    \b
      dmplay play hexworld --seed 7
      dmplay play prisoners-dilemma --vs grim --turns 20
      dmplay play crying-baby --agent feed-when-crying -o game.dmt
      printf 'ignore\\nfeed\\nquit\\n' | dmplay play crying-baby
    """
    from dmplay.game.command_line_results import PlayCommand
    from dmplay.game.launch_requests import AnyGameRequest, GameRequest, format_variant_name
    from dmplay.output.tables import format_name

    if str(record) == "-" and not quiet:
        raise BadParameter("-o -: expected --quiet too, because the game also prints there")
    if options.option_source(ctx, "player") == "COMMANDLINE" and not format_name(player):
        raise BadParameter(f"--player: got {player!r}, expected a name with a visible character")
    typed_options = {
        name for name in ("rate", "player", "frames") if options.is_set_by_user(ctx, name)
    }
    if "rate" in typed_options and not terminal_options.motion:
        raise BadParameter("--rate: real time needs motion; leave out --no-motion")
    typed_request = GameRequest(
        format_variant_name(problem, variant), tuple(set_), seed, episode, agent=agent,
        other_agent=vs, seats=tuple(seat), ghost_agent=ghost, prediction=predict, turns=turns,
        states_belief=state_belief, record_path=record, kept_megabytes=keep,
        record_frames=frames, force=force, strict="hints" if strict_hints else strict,
        reveal=reveal, player=player,
        key_preferences=options.configured_keys(keys),
        can_ask=current_terminal(terminal_options).can_ask,
        typed_options=frozenset(typed_options),
    )  # fmt: skip
    request: AnyGameRequest = typed_request
    if assignment:
        from dmplay.evaluation.assignment import read_assignment

        request = read_assignment(assignment).build_request(typed_request, trusted=trust)
    elif not problem:
        raise BadParameter("missing argument 'PROBLEM'; see dmplay play --help")
    rate = rate if terminal_options.motion else None
    return PlayCommand(request, terminal_options, quiet, speed, rate)


@options.with_terminal_options(json=options.JsonLinesFlag)
def resume(
    file: options.OptionalTranscriptPath = None,
    trust: options.Trust = False,
    quiet: options.Quiet = False,
    keys: options.KeyPreset = None,
    turns: options.UnattendedTurnLimit = None,
    ghost: options.GhostAgent = "",
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Resume a game that you left or that was interrupted.

    \b
      dmplay resume
      dmplay resume game.dmt
    """
    from dmplay.game import saves
    from dmplay.game.command_line_results import PlayCommand
    from dmplay.game.launch_requests import ResumeRequest

    file = file or saves.find_latest_unfinished()
    can_ask = current_terminal(terminal_options).can_ask
    request = ResumeRequest(
        file, trust, options.configured_keys(keys), can_ask, turn_limit=turns, ghost_agent=ghost
    )
    return PlayCommand(request, terminal_options, quiet)


@options.with_terminal_options(json=options.JsonLinesFlag, input=options.ViewerInput)
def replay(
    file: options.TranscriptPath,
    trust: options.Trust = False,
    peek: options.Peek = False,
    speed: options.PlaybackSpeed = 2.0,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Replay a recorded game turn by turn.

    These keys work on the full screen:

    \b
      left, right arrow    show the previous or the next turn
      Home, End            go to the start or to the end
      a number and Enter   go to the turn with this number
      P                    play all turns, at --speed
      X                    go to the worst choice, the next worst, and so on
      Enter                start a new game for you from the turn that you see

    \b
      dmplay replay game.dmt
      dmplay replay game.dmt --plain
    """
    from dmplay.game.command_line_results import PlayCommand
    from dmplay.game.launch_requests import ReplayRequest

    return PlayCommand(ReplayRequest(file, trust, peek), terminal_options, speed=speed)


@options.with_terminal_options(json=options.JsonLinesFlag)
def branch(
    file: options.TranscriptPath,
    at: Annotated[
        int,
        options.number_option(
            int, "last turn to repeat; new turns begin after it", min=0, metavar="TURN"
        ),
    ],
    record: Annotated[
        Path, typer.Option("--record", "-o", metavar="FILE", help="file for the new transcript")
    ],
    seat: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=PLAYER",
            help="player of the seat NAME in the new turns: human or an agent (repeatable)",
        ),
    ] = [],  # noqa: B006 - typer copies it
    force: options.Force = False,
    trust: options.Trust = False,
    peek: options.Peek = False,
    quiet: options.Quiet = False,
    keys: options.KeyPreset = None,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Start a new game from any turn of a recorded game.

    The new game repeats the turns up to --at. It gets its own transcript.

    \b
      dmplay branch game.dmt --at 7 -o other.dmt
      dmplay branch game.dmt --at 7 --seat agent=human -o mine.dmt
    """
    from dmplay.game.command_line_results import PlayCommand
    from dmplay.game.launch_requests import BranchRequest

    can_ask = current_terminal(terminal_options).can_ask
    request = BranchRequest(
        file, trust, options.configured_keys(keys), can_ask, at, force, peek,
        record_path=record, seats=seat,
    )  # fmt: skip
    return PlayCommand(request, terminal_options, quiet)


@options.with_terminal_options(
    "plain", "color", "ascii", "theme", "width", "motion", "input", input=ShellInput
)
def shell(
    execute: Annotated[
        list[str],
        typer.Option(
            "--execute", "-e", metavar="COMMAND", help="run COMMAND and exit (repeatable)"
        ),
    ] = [],  # noqa: B006
    speed: options.PlaybackSpeed = 2.0,
    *,
    terminal_options: TerminalOptions,
) -> object:
    """Open a shell in which you play by typed commands.

    You can play one game after another. Commands can also come from -e or from a
    pipe. In this case, the first error ends the shell.

    \b
      dmplay shell < commands.txt
      dmplay -e 'play crying-baby --seed 7' -e feed -e 'hint; quit'
    """
    from dmplay.game.command_line_results import ShellCommand

    if not current_terminal(terminal_options).can_ask and not execute:
        raise BadParameter(
            "--no-input: no prompts are allowed; give commands with -e or through a pipe"
        )
    return ShellCommand(execute, terminal_options, speed)


def bot(
    agent: Annotated[str, typer.Argument(metavar="AGENT", help="agent that chooses the actions")],
    problem: Annotated[
        str, typer.Option("--problem", "-p", metavar="PROBLEM", help="problem to play")
    ],
) -> object:
    """Let an agent of dmplay play in another program.

    The other program runs the game. It sends each observation as a line of JSON to the
    standard input of 'dmplay bot', and reads each action from its standard output.
    'dmplay guide bots' describes the messages.

    \b
      dmplay hexworld --agent 'bot:dmplay bot optimal --problem hexworld'
    """
    from dmplay.game.command_line_results import BotServerConfig

    return BotServerConfig(agent, problem)


def mcp(
    problems: Annotated[
        list[str],
        typer.Argument(metavar="PROBLEM...", help="problems to offer (default: the built-in ones)"),
    ] = [],  # noqa: B006
    hints: Annotated[bool, typer.Option(help="let the model ask for hints")] = False,
    undo: Annotated[bool, typer.Option(help="let the model undo turns")] = False,
    belief: Annotated[
        bool, typer.Option(help="show the model its belief: the probability of each hidden state")
    ] = False,
    seed: Annotated[
        int | None,
        options.number_option(
            int,
            "random seed; it gives a series of games (default: a new one)",
            min=0,
            max=options.MAX_WHOLE_NUMBER,
        ),
    ] = None,
    turns: Annotated[
        int | None, options.number_option(int, "maximum number of turns per game", min=1)
    ] = None,
    folder: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FOLDER", help="folder for the transcripts"),
    ] = None,
    keep: options.KeptMegabytes = 200,
) -> object:
    """Let a language model play (Model Context Protocol).

    dmplay becomes a server for a program that runs a language model. 'dmplay guide mcp'
    explains the setup.

    \b
      dmplay mcp
      dmplay mcp hexworld catch --hints --seed 7 -o games
    """
    from dmplay.game.command_line_results import McpServerConfig

    return McpServerConfig(problems, hints, undo, belief, seed, turns, folder, keep)
