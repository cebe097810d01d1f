"""Play in plain lines: appended, never repainted, for pipes, screen readers and dumb terminals."""

import getpass
import json
import sys
from collections.abc import Iterator
from typing import Protocol, TextIO

from dmplay.errors import BadParameter, DmplayError
from dmplay.shell.commands import Leave, typed
from dmplay.shell.game import Game, sentence
from dmplay.shell.terminal import Terminal, clean
from dmplay.transcript.format import end_facts


class Reporter(Protocol):
    """How a game is told: in sentences, as data, or not at all."""

    def start(self, game: Game, terminal: Terminal) -> None:
        """Before the first turn."""

    def turn(self, game: Game) -> None:
        """After each turn."""

    def words(self, text: str) -> None:
        """What a command answers."""

    def prompt(self, game: Game) -> str:
        """What stands before a typed line."""

    def end(self, game: Game) -> None:
        """After the last turn."""


class Sentences:
    """Tells a game in sentences."""

    def start(self, game: Game, terminal: Terminal) -> None:
        """The first line names the switch that chose this mode."""
        seed = f", seed {game.seed}" if game.shows_seed else ""
        if not game.people:
            print(f"{clean(game.name)}{seed}. {', '.join(map(clean, game.seats))}.", flush=True)
            return
        help_ = "type help, look, legal, or an action."
        print(f"plain mode (from {terminal.why}). {clean(game.name)}{seed}. {help_}")
        print(game.situation(), flush=True)

    def turn(self, game: Game) -> None:
        """One line."""
        print(game.said(), flush=True)

    def words(self, text: str) -> None:
        """As they are."""
        print(text, flush=True)

    def prompt(self, game: Game) -> str:
        """`action> `, with the agent's name where several people play."""
        agent = f"{game.problem.agents[game.watcher]} " if len(game.people) > 1 else ""
        return f"{agent}action> "

    def end(self, game: Game) -> None:
        """The result, and what was hidden."""
        for row in [f"over: {game.result()}", *map(sentence, game.debrief())]:
            print(row, flush=True)


class Objects:
    """Tells a game as data: one JSON object a line."""

    def start(self, game: Game, terminal: Terminal) -> None:
        """Problem, seats, the seed if it was given, and what is known at first."""
        seats = dict(zip(game.problem.agents, game.seats, strict=True))
        facts: dict[str, object] = {"problem": game.name, "seats": seats}
        if game.shows_seed:
            facts["seed"] = game.seed
        self._print("start", facts | game.public())

    def turn(self, game: Game) -> None:
        """What the seat may know of the turn; everything where no person sits."""
        self._print("turn", game.public())

    def words(self, text: str) -> None:
        """What a command answers, under `words`."""
        self._print("words", {"text": text})

    def prompt(self, game: Game) -> str:
        """Nothing: the output is data."""
        return ""

    def end(self, game: Game) -> None:
        """The ending with return and total, the seed, and what was hidden."""
        facts = end_facts(game.session) | {"seed": game.seed}
        rows = game.debrief()
        self._print("end", facts | ({"debrief": rows} if rows else {}))

    def _print(self, event: str, facts: dict[str, object]) -> None:
        print(json.dumps({"event": event} | facts), flush=True)


class Silence:
    """Tells nothing: for games that are only recorded."""

    def start(self, game: Game, terminal: Terminal) -> None:
        """Nothing."""

    def turn(self, game: Game) -> None:
        """Nothing."""

    def words(self, text: str) -> None:
        """Nothing."""

    def prompt(self, game: Game) -> str:
        """Nothing."""
        return ""

    def end(self, game: Game) -> None:
        """Nothing."""


def play(game: Game, terminal: Terminal, stdin: TextIO, reporter: Reporter) -> None:
    """Plays a game in lines until it is over, its input ends or its player leaves.

    A line that cannot be done is told and asked again where a person types; piped, it ends the
    game and raises BadParameter with the line's number.
    """
    reporter.start(game, terminal)
    if game.people:
        for number, line in _lines(game, terminal, stdin, reporter):
            try:
                for part in filter(None, map(str.strip, line.split(";"))):
                    _do(game, part, reporter)
            except Leave:
                break
            except DmplayError as error:
                if not terminal.typed:
                    game.finish("illegal")
                    raise BadParameter(f"line {number}: {error}") from None
                reporter.words(f"error: {error}")
    else:
        before = 0
        while game.unattended():
            now = len(game.session.turns)
            if now > before:
                reporter.turn(game)
            else:  # a recording may take turns back
                reporter.words(f"undone. turn {now}.")
            before = now
    game.finish("quit")
    reporter.end(game)


def _do(game: Game, line: str, reporter: Reporter) -> None:
    before = len(game.session.turns)
    words = typed(game, line)
    if len(game.session.turns) > before:
        reporter.turn(game)
    elif words:
        reporter.words(words)


def _lines(
    game: Game, terminal: Terminal, stdin: TextIO, reporter: Reporter
) -> Iterator[tuple[int, str]]:
    """The lines typed or piped, with their numbers; `#` begins a comment."""
    number = 0
    while not game.session.over:
        prompt = reporter.prompt(game)
        number += 1
        if terminal.typed and len(game.people) > 1:  # nobody reads the other's choice
            try:
                line = getpass.getpass(prompt) + "\n"
            except EOFError:
                return
        else:
            sys.stdout.write(prompt)
            sys.stdout.flush()
            line = stdin.readline()
        shown = line.partition("#")[0].strip()
        if prompt and not terminal.typed:
            sys.stdout.write(clean(shown) + "\n")
        if not line:
            return
        if shown:
            yield number, shown
