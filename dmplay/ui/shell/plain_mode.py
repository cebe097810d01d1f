"""Plain mode: play in appended lines, for pipes, screen readers and dumb terminals."""

import contextlib
import getpass
import json
import sys
from collections.abc import Iterator
from typing import TextIO

from dmplay.core.text import escape_unprintable
from dmplay.errors import BadParameter, DmplayError, clip_message
from dmplay.external.bots.protocol import describe_choices
from dmplay.game.background_tasks import TaskCancelled
from dmplay.game.command_reply import DataReply, Page
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.predictions import STATED
from dmplay.terminal.capabilities import Terminal, clear_screen
from dmplay.terminal.capabilities import read_line as typed_line
from dmplay.ui.shell.commands import (
    MAX_LINE_CHARS,
    PlayerQuit,
    iter_commands_until_handover,
    list_commands,
    run_line,
    take_prediction_report,
)


class Reporter:
    """A reporter that prints nothing, and the base class of reporters that print the game."""

    # whether an error in piped input is reported and the next line read
    continues_after_error = False

    def report_start(self, game: Game) -> None:
        """Report a game before its first turn; by default nothing."""

    def report_turn(self, game: Game) -> None:
        """Report the last turn; by default nothing."""

    def report_text(self, text: str) -> None:
        """Report the text of a reply; by default nothing."""

    def report_reply(self, game: Game, text: str, previous_turn_count: int) -> None:
        """Report the reply of a command that played no turn; by default its text.

        `previous_turn_count` is the turn count before the command, so a difference shows an undo.
        """
        self.report_text(text)

    def report_error(self, line_number: int, error: DmplayError) -> None:
        """Report an error in an input line, by default on standard error."""
        message = escape_unprintable(f"error: line {line_number}: {error}")
        print(message, file=sys.stderr, flush=True)

    def start_prompt(self, game: Game) -> str:
        """Return the prompt of the next input line, here ''; subclasses may print a request."""
        return ""

    def report_medal_notice(self, notice: str) -> None:
        """Report that help costs the medal; by default nothing."""

    def prepare_end(self, game: Game) -> None:
        """Compute the verdict on a finished game, before its medal is saved."""

    def report_end(self, game: Game) -> None:
        """Report the end of the game; by default nothing."""


class SentenceReporter(Reporter):
    """A reporter that prints sentences."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal

    def report_start(self, game: Game) -> None:
        """Print a line on the game, and for people the reason for plain mode and the situation."""
        seed = f", seed {game.seed}" if game.is_seed_visible else ""
        if not game.human_seats:
            players = ", ".join(map(escape_unprintable, game.player_names))
            print(f"{escape_unprintable(game.problem_name)}{seed}. {players}.", flush=True)
            return
        help_ = "type help, look, legal, or an action."
        print(
            f"plain mode ({self._terminal.plain_reason}). "
            f"{escape_unprintable(game.problem_name)}{seed}. {help_}"
        )
        situation = game.narrator.describe_situation(game.snapshot())
        print(*game.picture_rows(), situation, sep="\n", flush=True)

    def report_turn(self, game: Game) -> None:
        """Print one line on the last turn.

        If people see different things, print one line for each, or nothing on a terminal, which
        they share.
        """
        if not game.has_private_views:
            print(game.narrator.describe_turn(game.snapshot()), flush=True)
        elif not self._terminal.is_interactive:
            for seat in game.human_seats:
                report = game.narrator.describe_turn(game.snapshot(seat))
                print(f"{game.problem.agents[seat]} {report}", flush=True)

    def report_text(self, text: str) -> None:
        """Print a text with unprintable characters escaped."""
        print(escape_unprintable(text), flush=True)

    def report_error(self, line_number: int, error: DmplayError) -> None:
        """Report an error in an input line: to people at once, for a script with the number."""
        if self._terminal.is_interactive:
            self.report_text(f"error: {error}")
        else:
            super().report_error(line_number, error)

    def start_prompt(self, game: Game) -> str:
        """Return `action> `, after the agent's name if several people play, or `prediction> `."""
        if game.open_question and game.predictor:
            return f"{game.predictor.noun}> "
        agent = f"{game.problem.agents[game.viewing_seat]} " if len(game.human_seats) > 1 else ""
        return f"{agent}action> "

    def report_medal_notice(self, notice: str) -> None:
        """Print that help costs the medal; nothing if it does not."""
        if notice:
            self.report_text(notice)

    def prepare_end(self, game: Game) -> None:
        """Compute the verdict on a finished game, before its medal is saved."""
        game.compute_verdict()

    def report_end(self, game: Game) -> None:
        """Print the result and the hidden information of the game."""
        for row in game.closing_lines():
            print(row, flush=True)


class JsonReporter(Reporter):
    """A reporter that prints JSON Lines to a stream (default: stdout): one object per event."""

    continues_after_error = True

    def __init__(self, output: TextIO | None = None) -> None:
        self._output = output

    def report_start(self, game: Game) -> None:
        """Print the problem, the players, the seed if visible, and the first visible facts."""
        seats = dict(zip(game.problem.agents, game.player_names, strict=True))
        facts: dict[str, object] = {"problem": game.problem_name, "seats": seats}
        if game.is_seed_visible:
            facts["seed"] = game.seed
        self._print_event("start", facts | game.narrator.visible_turn_facts(game.snapshot()))

    def report_turn(self, game: Game) -> None:
        """Print the facts of the turn that the viewing seat may see, or one object per person.

        If only agents play, all facts are printed.
        """
        for seat in game.human_seats if game.has_private_views else [game.viewing_seat]:
            self._print_event("turn", game.narrator.visible_turn_facts(game.snapshot(seat)))

    def report_text(self, text: str) -> None:
        """Print a text as an event `words`."""
        self._print_event("words", {"text": text})

    def report_reply(self, game: Game, text: str, previous_turn_count: int) -> None:
        """Print an undo, a hint, its reasons, or the text of the reply."""
        turn_count, hint = len(game.session.turns), game.hint_provider.current_hint
        if turn_count < previous_turn_count:
            facts = game.narrator.visible_turn_facts(game.snapshot())
            self._print_event("undo", {"turns": previous_turn_count - turn_count} | facts)
        elif isinstance(text, DataReply):
            facts = {"text": str(text)} if text.rows else {}
            self._print_event(text.event, {**text.data, **facts})
        elif hint and text.startswith("hint"):
            seat = game.problem.agents[game.viewing_seat]
            self._print_event("hint", {"seat": seat} | hint.data)
        else:
            self.report_text(text)

    def report_error(self, line_number: int, error: DmplayError) -> None:
        """Print an error with the number of its line."""
        self._print_event("error", {"line": line_number, "text": str(error)})

    def start_prompt(self, game: Game) -> str:
        """Print the seat to choose and its legal actions, before each line that is read;
        return ''. A question that waits for a prediction is printed already.
        """
        if game.open_question:
            return ""
        seat, legal = game.viewing_seat, game.session.legal_actions_mask(game.viewing_seat)
        choices = describe_choices(game.problem, seat, legal)
        facts = {"turn": len(game.session.turns) + 1, "legal": choices}
        self._print_event("ask", {"seat": game.problem.agents[seat]} | facts)
        return ""

    def prepare_end(self, game: Game) -> None:
        """Compute the verdict on a finished game, before its medal is saved."""
        game.compute_verdict()

    def report_end(self, game: Game) -> None:
        """Print the end reason, returns, seed and hidden information; or that it is paused."""
        if game.is_paused:
            self._print_event("paused", {"turns": len(game.session.turns)})
            return
        verdict = game.compute_verdict()
        facts: dict[str, object] = {"verdict": verdict.data} if verdict.has_facts else {}
        if game.predictor:
            facts["predictions"] = game.predictor.data
        self._print_event("end", game.narrator.result_facts({"seed": game.seed}) | facts)

    def _print_event(self, event: str, facts: dict[str, object]) -> None:
        """Print one JSON object with the event and its facts."""
        print(json.dumps({"event": event} | facts), file=self._output, flush=True)


def _report_start(reporter: Reporter, game: Game) -> None:
    """Report a game before its first turn, and its warning."""
    reporter.report_start(game)
    if game.warning:
        reporter.report_text(game.warning)


def _report_write_notice(reporter: Reporter, controller: GameController) -> None:
    """Report once that the transcript cannot be written, or is written again."""
    notice = controller.take_write_notice()
    if notice:
        reporter.report_text(notice)


def play_by_lines(
    controller: GameController,
    terminal: Terminal,
    stdin: TextIO,
    reporter: Reporter,
    earlier_line_count: int = 0,
) -> bool:
    """Play in lines until the game is over, the input ends or the player leaves.

    An invalid line is reported, and the next one read, at an interactive terminal, in JSON and in a
    game that is to be handed in. In other piped input it ends the game: raise BadParameter with the
    number of the line, which counts `earlier_line_count` lines that were read before. A refused
    belief is asked for again.

    Return whether a line of a script was invalid. In JSON none is, because a program reads the
    errors as events and can correct itself.
    """
    is_script = not (terminal.is_interactive or reporter.continues_after_error)
    has_invalid_line = False
    controller.is_interactive = terminal.is_interactive
    controller.on_intermediate_turn = lambda: _report_intermediate_turn(reporter, controller)
    _report_start(reporter, controller.game)
    _report_write_notice(reporter, controller)
    if controller.game.human_seats:
        lines = _iter_input_lines(controller, terminal, stdin, reporter, earlier_line_count)
        for number, line in lines:
            try:
                for part in (
                    iter_commands_until_handover(controller, line)
                    if terminal.is_interactive
                    else list_commands(controller, line)
                ):
                    _run_and_report(controller, part, reporter)
            except PlayerQuit:
                break
            except DmplayError as error:
                has_invalid_line = is_script and not _is_asked_again(controller.game)
                if has_invalid_line and not controller.game.pauses_when_left:
                    controller.end_game("illegal")
                    raise BadParameter(f"line {number}: {error}") from None
                reporter.report_error(number, error)
            except TaskCancelled:
                if not terminal.is_interactive:
                    raise
                reporter.report_text("cancelled.")
    else:
        _play_agents_only(controller, reporter)
    if controller.game.session.over:
        reporter.prepare_end(controller.game)
    controller.end_game()
    reporter.report_end(controller.game)
    return has_invalid_line


def _is_asked_again(game: Game) -> bool:
    """Return whether a refused line was a belief, which leaves its question open."""
    return bool(game.open_question and game.predictor and game.predictor.kind == STATED)


def _report_intermediate_turn(reporter: Reporter, controller: GameController) -> None:
    """Report the last turn, after which another one follows at once."""
    reporter.report_turn(controller.game)
    _report_write_notice(reporter, controller)


def _play_agents_only(controller: GameController, reporter: Reporter) -> None:
    """Play a game without people to its end and report every turn or event."""
    game = controller.game
    for turn_count in game.iter_agent_turns():
        if len(game.session.turns) < turn_count:
            reporter.report_reply(
                game, game.narrator.describe_change(game.snapshot(), turn_count), turn_count
            )
        else:
            reporter.report_turn(game)
        _report_write_notice(reporter, controller)


def _run_and_report(controller: GameController, line: str, reporter: Reporter) -> None:
    """Run one line and report its effect: a new game, a new last turn, or a reply."""
    game = controller.game
    turns = game.session.turns
    turn_count, last_turn = len(turns), turns[-1] if turns else None
    reply = run_line(controller, line)
    turns = controller.game.session.turns
    if controller.game is not game:
        reporter.report_end(game)
        _report_start(reporter, controller.game)
    elif (
        len(turns) >= max(turn_count, 1)
        and turns[-1] is not last_turn
        and not isinstance(reply, Page)
    ):
        reporter.report_turn(game)
        score = take_prediction_report(game)
        if score:
            reporter.report_reply(game, score, turn_count)
    elif reply:
        reporter.report_reply(game, reply, turn_count)
    reporter.report_medal_notice(controller.pop_medal_notice())
    _report_write_notice(reporter, controller)


def wait_for_handover(controller: GameController) -> str:
    """Wait until the next person has taken over the terminal; return that person's report.

    It is the last turn, or the situation before the first turn.
    """
    game = controller.game
    name = game.problem.agents[game.viewing_seat]
    with contextlib.suppress(EOFError):
        getpass.getpass(f"pass the keyboard to {name}; press Enter when ready. ")
    controller.complete_handover()
    snapshot = game.snapshot()
    if snapshot.turn:
        return game.narrator.describe_turn(snapshot)
    return game.narrator.describe_situation(snapshot)


def read_choice(controller: GameController, prompt: str, stdin: TextIO) -> str:
    """Return the next input line, '' at the end; it is not echoed while several people choose."""
    if not controller.is_input_hidden:
        return typed_line(prompt, stdin)
    try:
        return getpass.getpass(prompt) + "\n"
    except EOFError:
        return ""


def _clip_line(command_text: str) -> str:
    """Return a line to be echoed; clipped if it is too long to be run."""
    return command_text if len(command_text) <= MAX_LINE_CHARS else clip_message(command_text)


def _iter_input_lines(
    controller: GameController,
    terminal: Terminal,
    stdin: TextIO,
    reporter: Reporter,
    earlier_line_count: int,
) -> Iterator[tuple[int, str]]:
    """Yield the typed or piped lines with their numbers, until the game is over; skip comments."""
    number = earlier_line_count
    while not controller.game.session.over:
        prompt = reporter.start_prompt(controller.game)
        number += 1
        if terminal.is_interactive and controller.awaiting_handover:
            clear_screen()
            reporter.report_text(wait_for_handover(controller))
            _report_write_notice(reporter, controller)
        line = read_choice(controller, prompt, stdin)
        command_text = line.partition("#")[0].strip()
        if prompt and not terminal.is_interactive:
            sys.stdout.write(escape_unprintable(_clip_line(command_text)) + "\n")
        if not line:
            return
        if command_text or controller.game.open_question:
            yield number, command_text
