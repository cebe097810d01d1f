"""Play in plain lines: appended, never repainted, for pipes, screen readers and dumb terminals."""

import contextlib
import getpass
import json
import sys
from collections.abc import Iterator
from typing import TextIO

from dmplay.bots.protocol import describe_choices
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.answer import Page
from dmplay.game.game import Game
from dmplay.game.table import GameController
from dmplay.terminal import Terminal, clear_screen, escape_unprintable
from dmplay.terminal import read_line as typed_line
from dmplay.thought import TaskCancelled
from dmplay.words.commands import PlayerQuit, iter_commands_until_handover, run_line, split_commands


class Reporter:
    """How a game is told: not at all, as one that is only recorded; others say more."""

    continues_after_error = (
        False  # whether a piped line that cannot be done is told, and another one read
    )

    def report_start(self, game: Game) -> None:
        """Before the first turn."""

    def report_turn(self, game: Game) -> None:
        """After each turn."""

    def report_text(self, text: str) -> None:
        """What a command answers."""

    def report_reply(self, game: Game, text: str, previous_turn_count: int) -> None:
        """What a command answers that played no turn, where so many had been played before it."""
        self.report_text(text)

    def report_error(self, line_number: int, error: DmplayError) -> None:
        """What is wrong with a line."""
        self.report_text(f"error: {error}")

    def start_prompt(self, game: Game) -> str:
        """What stands before a typed line."""
        return ""

    def report_end(self, game: Game) -> None:
        """After the last turn."""


class SentenceReporter(Reporter):
    """Tells a game in sentences."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal

    def report_start(self, game: Game) -> None:
        """The first line names the switch that chose this mode."""
        seed = f", seed {game.seed}" if game.is_seed_visible else ""
        if not game.human_seats:
            print(
                f"{escape_unprintable(game.problem_name)}{seed}. {', '.join(map(escape_unprintable, game.player_names))}.",
                flush=True,
            )
            return
        help_ = "type help, look, legal, or an action."
        print(
            f"plain mode (from {self._terminal.plain_reason}). {escape_unprintable(game.problem_name)}{seed}. {help_}"
        )
        print(
            *game.picture_rows(),
            game.narrator.describe_situation(game.snapshot()),
            sep="\n",
            flush=True,
        )

    def report_turn(self, game: Game) -> None:
        """One line; one for each of several people who see different things, if none looks on."""
        if not game.has_private_views:
            print(game.narrator.describe_turn(game.snapshot()), flush=True)
        elif not self._terminal.is_interactive:
            for seat in game.human_seats:
                said = game.narrator.describe_turn(game.snapshot(seat))
                print(f"{game.problem.agents[seat]} {said}", flush=True)

    def report_text(self, text: str) -> None:
        """As they are, but for what does not print."""
        print(escape_unprintable(text), flush=True)

    def start_prompt(self, game: Game) -> str:
        """`action> `, with the agent's name where several people play."""
        agent = f"{game.problem.agents[game.viewing_seat]} " if len(game.human_seats) > 1 else ""
        return f"{agent}action> "

    def report_end(self, game: Game) -> None:
        """The result, and what was hidden."""
        for row in game.narrator.closing_lines():
            print(row, flush=True)


class JsonReporter(Reporter):
    """Tells a game as data: one JSON object a line."""

    continues_after_error = True

    def report_start(self, game: Game) -> None:
        """Problem, seats, the seed if it was given, and what is known at first."""
        seats = dict(zip(game.problem.agents, game.player_names, strict=True))
        facts: dict[str, object] = {"problem": game.problem_name, "seats": seats}
        if game.is_seed_visible:
            facts["seed"] = game.seed
        self._print_event("start", facts | game.narrator.visible_turn_facts(game.snapshot()))

    def report_turn(self, game: Game) -> None:
        """What the seat may know of the turn; everything where no person sits."""
        for seat in game.human_seats if game.has_private_views else [game.viewing_seat]:
            self._print_event("turn", game.narrator.visible_turn_facts(game.snapshot(seat)))

    def report_text(self, text: str) -> None:
        """What a command answers, under `words`."""
        self._print_event("words", {"text": text})

    def report_reply(self, game: Game, text: str, before: int) -> None:
        """Turns that were taken back, a hint, or words."""
        turns, advice = len(game.session.turns), game.hint_provider.current_hint
        if turns < before:
            self._print_event(
                "undo",
                {"turns": before - turns} | game.narrator.visible_turn_facts(game.snapshot()),
            )
        elif advice and text.startswith("hint"):
            seat = game.problem.agents[game.viewing_seat]
            self._print_event("hint", {"seat": seat} | advice.data)
        else:
            self.report_text(text)

    def report_error(self, line: int, error: DmplayError) -> None:
        """The number of the line, and what is wrong with it."""
        self._print_event("error", {"line": line, "text": str(error)})

    def start_prompt(self, game: Game) -> str:
        """Whose turn it is, and what can be done, before each line that is read."""
        seat, legal = game.viewing_seat, game.session.legal_actions_mask(game.viewing_seat)
        facts = {
            "turn": len(game.session.turns) + 1,
            "legal": describe_choices(game.problem, seat, legal),
        }
        self._print_event("ask", {"seat": game.problem.agents[seat]} | facts)
        return ""

    def report_end(self, game: Game) -> None:
        """The ending with return and total, the seed, and what was hidden."""
        self._print_event("end", game.narrator.result_facts({"seed": game.seed}))

    def _print_event(self, event: str, facts: dict[str, object]) -> None:
        print(json.dumps({"event": event} | facts), flush=True)


def _report_start(reporter: Reporter, game: Game) -> None:
    """Tells of a game before its first turn, and what there is to warn of."""
    reporter.report_start(game)
    if game.warning:
        reporter.report_text(game.warning)


def play_by_lines(
    controller: GameController, terminal: Terminal, stdin: TextIO, reporter: Reporter
) -> None:
    """Plays at a table in lines until the game is over, the input ends or the player leaves.

    A line that cannot be done is told and asked again where a person types, and as data; piped
    else, it ends the game and raises BadParameter with the line's number.
    """
    controller.is_interactive = terminal.is_interactive
    controller.on_intermediate_turn = lambda: reporter.report_turn(controller.game)
    _report_start(reporter, controller.game)
    if controller.game.human_seats:
        for number, line in _iter_input_lines(controller, terminal, stdin, reporter):
            try:
                for part in (
                    iter_commands_until_handover(controller, line)
                    if terminal.is_interactive
                    else split_commands(line)
                ):
                    _run_and_report(controller, part, reporter)
            except PlayerQuit:
                break
            except DmplayError as error:
                if not (terminal.is_interactive or reporter.continues_after_error):
                    controller.end_game("illegal")
                    raise BadParameter(f"line {number}: {error}") from None
                reporter.report_error(number, error)
            except TaskCancelled:
                if not terminal.is_interactive:
                    raise
                reporter.report_text("cancelled.")
    else:
        _play_agents_only(controller.game, reporter)
    controller.end_game()
    reporter.report_end(controller.game)


def _play_agents_only(game: Game, reporter: Reporter) -> None:
    """Plays a game without people to its end."""
    for before in game.iter_agent_turns():
        if len(game.session.turns) < before:
            reporter.report_reply(
                game, game.narrator.describe_change(game.snapshot(), before), before
            )
        else:
            reporter.report_turn(game)


def _run_and_report(controller: GameController, line: str, reporter: Reporter) -> None:
    """Does a line, and reports what came of it: another last turn, under other dice too."""
    game = controller.game
    turns = game.session.turns
    before, last = len(turns), turns[-1] if turns else None
    words = run_line(controller, line)
    turns = controller.game.session.turns
    if controller.game is not game:
        reporter.report_end(game)
        _report_start(reporter, controller.game)
    elif len(turns) >= max(before, 1) and turns[-1] is not last and not isinstance(words, Page):
        reporter.report_turn(game)
    elif words:
        reporter.report_reply(game, words, before)


def wait_for_handover(controller: GameController) -> str:
    """Waits for the one who is next to sit down; what this one learned."""
    game = controller.game
    name = game.problem.agents[game.viewing_seat]
    with contextlib.suppress(EOFError):
        getpass.getpass(f"{name} is next: nobody else should look now. Enter goes on.")
    controller.complete_handover()
    now = game.snapshot()
    return game.narrator.describe_turn(now) if now.turn else game.narrator.describe_situation(now)


def read_choice(controller: GameController, prompt: str, stdin: TextIO) -> str:
    """The next line, '' at the end; unseen where nobody may read the other's choice."""
    if not controller.is_input_hidden:
        return typed_line(prompt, stdin)
    try:
        return getpass.getpass(prompt) + "\n"
    except EOFError:
        return ""


def _iter_input_lines(
    controller: GameController, terminal: Terminal, stdin: TextIO, reporter: Reporter
) -> Iterator[tuple[int, str]]:
    """The lines typed or piped, with their numbers; `#` begins a comment."""
    number = 0
    while not controller.game.session.over:
        prompt = reporter.start_prompt(controller.game)
        number += 1
        if terminal.is_interactive and controller.awaiting_handover:
            clear_screen()
            reporter.report_text(wait_for_handover(controller))
        line = read_choice(controller, prompt, stdin)
        shown = line.partition("#")[0].strip()
        if prompt and not terminal.is_interactive:
            sys.stdout.write(escape_unprintable(shown) + "\n")
        if not line:
            return
        if shown:
            yield number, shown
