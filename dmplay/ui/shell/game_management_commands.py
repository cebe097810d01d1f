"""Shell commands that start, resume, replay, save, branch and export games."""

from collections.abc import Sequence
from pathlib import Path
from shlex import quote

from dmplay.core.parameter_parsing import parse_whole_number
from dmplay.core.problem import find_seat
from dmplay.errors import BadParameter
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.command_reply import make_reply
from dmplay.game.export_formats import EXPORT_FORMATS
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import write_game_copy
from dmplay.game.launch_requests import parse_settings, split_shell_words
from dmplay.game.playback import Playback
from dmplay.game.saves import choose_free_path, copy_transcript
from dmplay.game.seats import list_human_seats, make_seat_policy, name_in_transcript
from dmplay.registry import problems


def play_problem(controller: GameController, argument: str) -> str:
    """Start a new game with the options of `dmplay play`; return a description of it."""
    words = split_shell_words(argument)
    if not words:
        raise BadParameter("play: expected a problem, such as play hexworld --seed 7")
    return controller.run_command_words(["play", *words]) or controller.describe_new_game()


def resume_transcript(controller: GameController, argument: str) -> str:
    """Resume a recorded game, by default the latest unfinished save."""
    reply = controller.run_command_words(["resume", *split_shell_words(argument)])
    turn = f"turn {len(controller.game.session.turns)}."
    return reply or _append_warning(controller, f"resumed {controller.game.problem_name}. {turn}")


def replay_transcript(controller: GameController, argument: str) -> str:
    """Open a recorded game for replay."""
    reply = controller.run_command_words(["replay", *split_shell_words(argument)])
    return reply or _append_warning(
        controller,
        f"replaying {controller.game.problem_name}. step and auto go forward, undo goes back.",
    )


def _append_warning(controller: GameController, reply: str) -> str:
    """Return a reply, followed by the warning of the current game if it has one."""
    return f"{reply} {controller.game.warning}." if controller.game.warning else reply


def restart_with_seed(controller: GameController, argument: str) -> str:
    """Restart the current game with the typed seed; without an argument, return the seed."""
    if not argument:
        game = controller.game
        return f"seed: {game.seed if game.is_seed_visible else 'shown after the game'}"
    number = parse_whole_number(argument)
    if number is None:
        raise BadParameter(f"seed: got {argument!r}, expected a whole number, such as 7")
    return controller.restart_with_new_seed(seed=number)


def seat_agent(controller: GameController, argument: str) -> str:
    """Restart the game with another player in a seat; without an argument, list the players.

    The player is NAME for the first seat, or SEAT NAME. A confirmation may be asked first.
    """
    game = controller.game
    words = argument.split()
    if not words:
        pairs = zip(game.problem.agents, game.player_names, strict=True)
        return f"seats: {', '.join(f'{name} {player}' for name, player in pairs)}."
    name, player = (game.problem.agents[0], words[0]) if len(words) == 1 else words[:2]
    # Raises for an invalid player before the game is restarted.
    make_seat_policy(game.problem, find_seat(game.problem, name), player)
    seats = [*(game.request.seats if game.request else ()), f"{name}={player}"]
    players = [*game.player_names]
    players[find_seat(game.problem, name)] = player
    personal_options = {"player": "", "ghost_agent": "", "is_handed_in": False}
    cleared_options = {} if list_human_seats(players) else personal_options
    return controller.confirmation_question(f"agent {argument}") or controller.restart(
        seats=seats, **cleared_options
    )


def set_parameter(controller: GameController, argument: str) -> str:
    """Restart the game with another parameter value; without an argument, list the parameters."""
    game = controller.game
    if not argument:
        values = problems.parameter_values(game.problem)
        return make_reply([f"{name} {value}" for name, value in values.items()])
    key, _, value = argument.replace("=", " ", 1).partition(" ")
    # Raises for an invalid value before the game is restarted.
    problems.with_parameters(game.problem, {key: value.strip()})
    settings = [*(game.request.settings if game.request else ()), f"{key}={value.strip()}"]
    return controller.confirmation_question(f"set {argument}") or controller.restart(
        settings=settings
    )


def save_transcript(controller: GameController, argument: str) -> str:
    """Copy the transcript to a file; without an argument, return its path.

    Raise BadParameter for a replay, and for a strict game with hidden information.
    """
    game, recorder = controller.game, controller.game.recorder
    if recorder is None and not (argument and game.request):
        path = game.transcript_path
        replay_message = f"this is a replay; its transcript is {path}" if path else ""
        missing_message = "this game is not recorded; --record FILE records it from the start"
        raise BadParameter(f"save: {replay_message or missing_message}")
    if recorder and not argument:
        return recorder.describe_write_error() or f"saved as you play: {recorder.path}"
    name, *extra_words = split_shell_words(argument)
    if extra_words:
        raise BadParameter(
            f"save: got {argument!r}, expected one file; put a name with spaces in quotes"
        )
    if recorder and game.strict and game.is_concealed:
        raise BadParameter(
            f"save: this game is strict, so no copy is written; it is in {recorder.path}"
        )
    if (
        recorder
        and recorder.is_saved
        and _has_same_name_at(game.problem_name, recorder.path, Path(name))
    ):
        copy_transcript(recorder, Path(name))
    else:
        write_game_copy(game, Path(name))
    command, effect = ("replay", "shows") if game.session.over else ("resume", "continues")
    return f"saved {name}; dmplay {command} {quote(name)} {effect} the game"


def _has_same_name_at(problem: str, *paths: Path) -> bool:
    """Return whether a problem has the same name in transcripts at these paths.

    Relative file paths in names differ between folders.
    """
    return len({name_in_transcript(problem, path) for path in paths}) == 1


def branch_from_turn(controller: GameController, argument: str) -> str:
    """Start a new game from a turn of the current one, by default the last, in a new transcript.

    Raise BadParameter in a strict game, or if no transcript is written.
    """
    turns = len(controller.game.session.turns)
    if argument and parse_whole_number(argument) is None:
        raise BadParameter(f"branch: got {argument!r}, expected a turn, 0 to {turns}")
    return _branch_with_players(controller, "branch", argument or str(turns), [])


def change_seats(controller: GameController, argument: str) -> str:
    """Continue the game in a new transcript, with other players in these seats from now on.

    Raise BadParameter in a strict game, or if no transcript is written.
    """
    settings = split_shell_words(argument)
    if not settings:
        raise BadParameter("seat: expected NAME=human or NAME=AGENT")
    for name in parse_settings(settings, "seat"):
        find_seat(controller.game.problem, name)
    if controller.game.session.over and not isinstance(controller.game, Playback):
        raise BadParameter("seat: this game is over; branch TURN goes back to a turn")
    turn_text = str(len(controller.game.session.turns))
    return _branch_with_players(controller, "seat", turn_text, settings)


def _branch_with_players(
    controller: GameController, command: str, turn_text: str, seat_settings: Sequence[str]
) -> str:
    """Start a game from a turn of the current one, with these players, in a new transcript."""
    game = controller.game
    if game.strict:
        raise BadParameter(f"{command}: this game is strict, so it has no branches")
    source = game.transcript_path
    if source is None:
        raise BadParameter(
            f"{command}: this game is not recorded; --record FILE records it from the start"
        )
    # The code already runs in the current game.
    trust_option = ["--trust"] if problems.requires_trust(game.problem_name) else []
    controller.run_command_words(
        [
            "branch",
            str(source),
            "--at",
            turn_text,
            "-o",
            str(controller.choose_branch_path(source)),
            *(word for setting in seat_settings for word in ("--seat", setting)),
            *trust_option,
        ]
    )
    return f"branched at turn {turn_text}. {controller.describe_new_game()}"


def export_game(controller: GameController, argument: str) -> str:
    """Export a game, by default the current one, as a picture, a table or data.

    Raise BadParameter if that would reveal hidden information of a game in progress.
    """
    words, written = split_shell_words(argument), "written."
    if not words or words[0].startswith("-"):
        recorder, is_hidden = controller.game.recorder, controller.game.problem.partially_observable
        if recorder is None:
            raise BadParameter("export: this game is not recorded; name a file")
        if is_hidden and not (controller.game.session.over or controller.game.reveal):
            raise BadParameter("export: the file would show hidden states; finish the game first")
        formats = [entry for name, entry in EXPORT_FORMATS.items() if f"--{name}" in words]
        is_picture = len(formats) == 1 and not formats[0].is_text
        if controller.is_interactive and is_picture and not {"-o", "--output"} & {*words}:
            new_path = choose_free_path(Path(f"{recorder.path.stem}.{formats[0].extension}"))
            words += ["-o", str(new_path)]
            written = f"wrote {new_path}"
        words = [str(recorder.path), *words]
    elif "--peek" in words and controller.has_game and controller.game.is_concealed:
        raise BadParameter("export: --peek shows hidden states; finish this game first")
    return controller.run_command_words(["export", *words]) or written


def watch_algorithm(controller: GameController, argument: str) -> str:
    """Show an algorithm on the position of the game, or on the typed problem.

    On the full screen the steps are shown one at a key; elsewhere the last ones are returned.
    """
    words = split_shell_words(argument)
    if len(words) > 1 or not controller.has_game:
        return controller.run_command_words(["watch", *words, "--plain"])
    from dmplay.game.watching import make_game_steps

    watched = make_game_steps(controller.game, *words)
    if controller.open_viewer:
        return controller.open_viewer(watched)
    from dmplay.ui.watch.step_lines import format_last_steps

    return run_cancellable(
        TaskInfo(f"running {watched.algorithm.name}"),
        lambda: make_reply(format_last_steps(watched)),
    )


def open_screen(controller: GameController, argument: str) -> str:
    """Open the full screen; return a line about the return to the shell.

    Raise BadParameter if there is no terminal.
    """
    game = controller.game
    if controller.open_screen is None:
        raise BadParameter("screen: only available in the shell, on a terminal")
    controller.open_screen()
    return f"{game.problem_name}: back in the shell."
