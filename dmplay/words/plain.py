"""Play in plain lines: appended, never repainted, for pipes, screen readers and dumb terminals."""

import contextlib
import getpass
import json
import sys
from collections.abc import Iterator
from typing import TextIO

from dmplay.bots.protocol import choices
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.answer import Page
from dmplay.game.game import Game
from dmplay.game.table import Table
from dmplay.terminal import Terminal, clean, wipe
from dmplay.terminal import line as typed_line
from dmplay.thought import Cancelled
from dmplay.words.commands import Leave, own_parts, parts, typed


class Reporter:
    """How a game is told: not at all, as one that is only recorded; others say more."""

    patient = False  # whether a piped line that cannot be done is told, and another one read

    def start(self, game: Game) -> None:
        """Before the first turn."""

    def turn(self, game: Game) -> None:
        """After each turn."""

    def words(self, text: str) -> None:
        """What a command answers."""

    def answer(self, game: Game, text: str, before: int) -> None:
        """What a command answers that played no turn, where so many had been played before it."""
        self.words(text)

    def fault(self, line: int, error: DmplayError) -> None:
        """What is wrong with a line."""
        self.words(f"error: {error}")

    def prompt(self, game: Game) -> str:
        """What stands before a typed line."""
        return ""

    def end(self, game: Game) -> None:
        """After the last turn."""


class Sentences(Reporter):
    """Tells a game in sentences."""

    def __init__(self, terminal: Terminal) -> None:
        self._terminal = terminal

    def start(self, game: Game) -> None:
        """The first line names the switch that chose this mode."""
        seed = f", seed {game.seed}" if game.shows_seed else ""
        if not game.people:
            print(f"{clean(game.name)}{seed}. {', '.join(map(clean, game.seats))}.", flush=True)
            return
        help_ = "type help, look, legal, or an action."
        print(f"plain mode (from {self._terminal.why}). {clean(game.name)}{seed}. {help_}")
        print(*game.pictured(), game.account.situation(game.moment()), sep="\n", flush=True)

    def turn(self, game: Game) -> None:
        """One line; one for each of several people who see different things, if none looks on."""
        if not game.private:
            print(game.account.said(game.moment()), flush=True)
        elif not self._terminal.typed:
            for seat in game.people:
                said = game.account.said(game.moment(seat))
                print(f"{game.problem.agents[seat]} {said}", flush=True)

    def words(self, text: str) -> None:
        """As they are, but for what does not print."""
        print(clean(text), flush=True)

    def prompt(self, game: Game) -> str:
        """`action> `, with the agent's name where several people play."""
        agent = f"{game.problem.agents[game.watcher]} " if len(game.people) > 1 else ""
        return f"{agent}action> "

    def end(self, game: Game) -> None:
        """The result, and what was hidden."""
        for row in game.account.closing():
            print(row, flush=True)


class Objects(Reporter):
    """Tells a game as data: one JSON object a line."""

    patient = True

    def start(self, game: Game) -> None:
        """Problem, seats, the seed if it was given, and what is known at first."""
        seats = dict(zip(game.problem.agents, game.seats, strict=True))
        facts: dict[str, object] = {"problem": game.name, "seats": seats}
        if game.shows_seed:
            facts["seed"] = game.seed
        self._print("start", facts | game.account.public(game.moment()))

    def turn(self, game: Game) -> None:
        """What the seat may know of the turn; everything where no person sits."""
        for seat in game.people if game.private else [game.watcher]:
            self._print("turn", game.account.public(game.moment(seat)))

    def words(self, text: str) -> None:
        """What a command answers, under `words`."""
        self._print("words", {"text": text})

    def answer(self, game: Game, text: str, before: int) -> None:
        """Turns that were taken back, a hint, or words."""
        turns, advice = len(game.session.turns), game.adviser.given
        if turns < before:
            self._print("undo", {"turns": before - turns} | game.account.public(game.moment()))
        elif advice and text.startswith("hint"):
            seat = game.problem.agents[game.watcher]
            self._print("hint", {"seat": seat} | advice.facts)
        else:
            self.words(text)

    def fault(self, line: int, error: DmplayError) -> None:
        """The number of the line, and what is wrong with it."""
        self._print("error", {"line": line, "text": str(error)})

    def prompt(self, game: Game) -> str:
        """Whose turn it is, and what can be done, before each line that is read."""
        seat, legal = game.watcher, game.session.legal(game.watcher)
        facts = {"turn": len(game.session.turns) + 1, "legal": choices(game.problem, seat, legal)}
        self._print("ask", {"seat": game.problem.agents[seat]} | facts)
        return ""

    def end(self, game: Game) -> None:
        """The ending with return and total, the seed, and what was hidden."""
        self._print("end", game.account.end({"seed": game.seed}))

    def _print(self, event: str, facts: dict[str, object]) -> None:
        print(json.dumps({"event": event} | facts), flush=True)


def _begin(reporter: Reporter, game: Game) -> None:
    """Tells of a game before its first turn, and what there is to warn of."""
    reporter.start(game)
    if game.warning:
        reporter.words(game.warning)


def by_lines(table: Table, terminal: Terminal, stdin: TextIO, reporter: Reporter) -> None:
    """Plays at a table in lines until the game is over, the input ends or the player leaves.

    A line that cannot be done is told and asked again where a person types, and as data; piped
    else, it ends the game and raises BadParameter with the line's number.
    """
    table.typed = terminal.typed
    table.tells = lambda: reporter.turn(table.game)
    _begin(reporter, table.game)
    if table.game.people:
        for number, line in _lines(table, terminal, stdin, reporter):
            try:
                for part in own_parts(table, line) if terminal.typed else parts(line):
                    _do(table, part, reporter)
            except Leave:
                break
            except DmplayError as error:
                if not (terminal.typed or reporter.patient):
                    table.end("illegal")
                    raise BadParameter(f"line {number}: {error}") from None
                reporter.fault(number, error)
            except Cancelled:
                if not terminal.typed:
                    raise
                reporter.words("cancelled.")
    else:
        _watch(table.game, reporter)
    table.end()
    reporter.end(table.game)


def _watch(game: Game, reporter: Reporter) -> None:
    """Plays a game without people to its end."""
    for before in game.run():
        if len(game.session.turns) < before:
            reporter.answer(game, game.account.change(game.moment(), before), before)
        else:
            reporter.turn(game)


def _do(table: Table, line: str, reporter: Reporter) -> None:
    """Does a line, and reports what came of it: another last turn, under other dice too."""
    game = table.game
    turns = game.session.turns
    before, last = len(turns), turns[-1] if turns else None
    words = typed(table, line)
    turns = table.game.session.turns
    if table.game is not game:
        reporter.end(game)
        _begin(reporter, table.game)
    elif len(turns) >= max(before, 1) and turns[-1] is not last and not isinstance(words, Page):
        reporter.turn(game)
    elif words:
        reporter.answer(game, words, before)


def handed_over(table: Table) -> str:
    """Waits for the one who is next to sit down; what this one learned."""
    game = table.game
    name = game.problem.agents[game.watcher]
    with contextlib.suppress(EOFError):
        getpass.getpass(f"{name} is next: nobody else should look now. Enter goes on.")
    table.change_places()
    now = game.moment()
    return game.account.said(now) if now.turn else game.account.situation(now)


def asked(table: Table, prompt: str, stdin: TextIO) -> str:
    """The next line, '' at the end; unseen where nobody may read the other's choice."""
    if not table.secret:
        return typed_line(prompt, stdin)
    try:
        return getpass.getpass(prompt) + "\n"
    except EOFError:
        return ""


def _lines(
    table: Table, terminal: Terminal, stdin: TextIO, reporter: Reporter
) -> Iterator[tuple[int, str]]:
    """The lines typed or piped, with their numbers; `#` begins a comment."""
    number = 0
    while not table.game.session.over:
        prompt = reporter.prompt(table.game)
        number += 1
        if terminal.typed and table.curtained:
            wipe()
            reporter.words(handed_over(table))
        line = asked(table, prompt, stdin)
        shown = line.partition("#")[0].strip()
        if prompt and not terminal.typed:
            sys.stdout.write(clean(shown) + "\n")
        if not line:
            return
        if shown:
            yield number, shown
