"""What can be done at a table, in words: games begun, gone on with, kept and looked at."""

from pathlib import Path
from shlex import quote

from dmplay.errors import BadParameter
from dmplay.finding import problems
from dmplay.finding.typed import parse_whole_number
from dmplay.game.answer import format_reply
from dmplay.game.formats import EXPORT_FORMATS
from dmplay.game.request import split_words
from dmplay.game.saves import copy_transcript
from dmplay.game.seats import list_human_seats, make_seat_policy, name_in_transcript
from dmplay.game.start import write_game_copy
from dmplay.game.table import GameController


def play_problem(controller: GameController, argument: str) -> str:
    """Begins a game, with the options of the command line."""
    words = split_words(argument)
    if not words:
        raise BadParameter("play: expected a problem, as play hexworld --seed 7")
    return controller.run_cli_words(["play", *words]) or controller.describe_new_game()


def resume_transcript(controller: GameController, argument: str) -> str:
    """Goes on with a recorded game."""
    said = controller.run_cli_words(["resume", *split_words(argument)])
    turn = f"turn {len(controller.game.session.turns)}."
    return said or _append_warning(controller, f"resumed {controller.game.problem_name}. {turn}")


def replay_transcript(controller: GameController, argument: str) -> str:
    """Looks at a recorded game."""
    said = controller.run_cli_words(["replay", *split_words(argument)])
    return said or _append_warning(
        controller, f"replaying {controller.game.problem_name}. step, auto and undo move in it."
    )


def _append_warning(controller: GameController, reply: str) -> str:
    """An answer, with what there is to warn of."""
    return f"{reply} {controller.game.warning}." if controller.game.warning else reply


def restart_with_seed(controller: GameController, argument: str) -> str:
    """Begins the same game under these dice; alone, tells them."""
    if not argument:
        return f"seed: {controller.game.seed if controller.game.is_seed_visible else 'told after the game'}"
    number = parse_whole_number(argument)
    if number is None:
        raise BadParameter(f"seed: got {argument!r}, expected a whole number, as 7")
    return controller.restart_with_new_seed(seed=number)


def seat_agent(controller: GameController, argument: str) -> str:
    """Begins the game again with somebody else in a seat; alone, tells who sits where."""
    game = controller.game
    words = argument.split()
    if not words:
        told = zip(game.problem.agents, game.player_names, strict=True)
        return f"seats: {', '.join(f'{name} {who}' for name, who in told)}."
    name, who = (game.problem.agents[0], words[0]) if len(words) == 1 else words[:2]
    make_seat_policy(
        game.problem, game.problem.seat_index(name), who
    )  # refuses what cannot sit there
    seats = [*(game.request.seats if game.request else ()), f"{name}={who}"]
    sitting = [*game.player_names]
    sitting[game.problem.seat_index(name)] = who
    for_people = {} if list_human_seats(sitting) else {"player": "", "ghost_agent": ""}
    return controller.confirmation_question(f"agent {argument}") or controller.restart(
        seats=seats, **for_people
    )


def set_parameter(controller: GameController, argument: str) -> str:
    """Begins the game again with another parameter; alone, tells them all."""
    game = controller.game
    if not argument:
        known = problems.parameter_values(game.problem)
        return format_reply([f"{name} {value}" for name, value in known.items()])
    key, _, value = argument.replace("=", " ", 1).partition(" ")
    problems.with_parameters(game.problem, {key: value.strip()})  # refuses what cannot be
    settings = [*(game.request.settings if game.request else ()), f"{key}={value.strip()}"]
    return controller.confirmation_question(f"set {argument}") or controller.restart(
        settings=settings
    )


def save_transcript(controller: GameController, argument: str) -> str:
    """Copies the transcript so far to a file; alone, tells where it is kept."""
    game, recorder = controller.game, controller.game.recorder
    if recorder is None and not (argument and game.request):
        looked_at = (
            f"a recording is only looked at; it is {game.transcript_path}"
            if game.transcript_path
            else ""
        )
        none = "no transcript is written; --record FILE writes one"
        raise BadParameter(f"save: {looked_at or none}")
    if recorder and not argument:
        return f"kept as you play: {recorder.path}"
    name, *more = split_words(argument)
    if more:
        raise BadParameter(f"save: got {argument!r}, expected one file; quotes hold one together")
    if recorder and game.strict and game.is_concealed:
        raise BadParameter(f"save: this game is strict, and has no copies; it is {recorder.path}")
    if (
        recorder
        and recorder.is_saved
        and _has_same_name_at(game.problem_name, recorder.path, Path(name))
    ):
        copy_transcript(recorder, Path(name))
    else:
        write_game_copy(game, Path(name))
    return f"saved {name}; dmplay resume {quote(name)} goes on"


def _has_same_name_at(problem: str, *paths: Path) -> bool:
    """Whether transcripts there tell of a problem by the same name."""
    return len({name_in_transcript(problem, path) for path in paths}) == 1


def branch_from_turn(controller: GameController, argument: str) -> str:
    """Plays on from an earlier turn, this one if none is named, in a file of its own."""
    game, turns = controller.game, len(controller.game.session.turns)
    if game.strict:
        raise BadParameter("branch: this game is strict")
    if argument and parse_whole_number(argument) is None:
        raise BadParameter(f"branch: got {argument!r}, expected a turn, 0 to {turns}")
    source = game.transcript_path
    if source is None:
        raise BadParameter("branch: no transcript is written; --record FILE writes one")
    at = argument or str(turns)
    trust = (
        ["--trust"] if problems.requires_trust(game.problem_name) else []
    )  # what is played was trusted
    controller.run_cli_words(
        [
            "branch",
            str(source),
            "--at",
            at,
            "-o",
            str(controller.choose_branch_path(source)),
            *trust,
        ]
    )
    return f"on from turn {at}. {controller.describe_new_game()}"


def export_game(controller: GameController, argument: str) -> str:
    """Writes a game, this one if no file is named, as a picture, a table or data."""
    words = split_words(argument)
    if not words or words[0].startswith("-"):
        recorder, hidden = controller.game.recorder, controller.game.problem.partially_observable
        if recorder is None:
            raise BadParameter("export: no transcript is written; name a file")
        if hidden and not (controller.game.session.over or controller.game.reveal):
            raise BadParameter("export: it would tell what is hidden until the game is over")
        asked = [(name, one) for name, one in EXPORT_FORMATS.items() if f"--{name}" in words]
        for name, one in asked:
            if controller.is_interactive and not one.is_text and not {"-o", "--output"} & {*words}:
                told = f"--{name} is for a file; -o game.{one.extension} names it"
                raise BadParameter(f"export: {told}")
        words = [str(recorder.path), *words]
    elif "--peek" in words and controller.has_game and controller.game.is_concealed:
        raise BadParameter("export: --peek is for after this game, in which much is hidden")
    return controller.run_cli_words(["export", *words]) or "written."


def open_screen(controller: GameController, argument: str) -> str:
    """Opens the full screen; back in the shell after it."""
    game = controller.game
    if controller.open_screen is None:
        raise BadParameter("screen: it opens from the shell, on a terminal")
    return controller.open_screen() or f"{game.problem_name} again in words."
