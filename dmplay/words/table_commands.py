"""What can be done at a table, in words: games begun, gone on with, kept and looked at."""

from pathlib import Path
from shlex import quote

from dmplay.errors import BadParameter
from dmplay.finding import problems
from dmplay.finding.typed import whole
from dmplay.game.answer import answer
from dmplay.game.formats import FORMATS
from dmplay.game.request import words_of
from dmplay.game.saves import copied
from dmplay.game.seats import people, seat_policy, told_in
from dmplay.game.start import retold
from dmplay.game.table import Table


def play(table: Table, argument: str) -> str:
    """Begins a game, with the options of the command line."""
    words = words_of(argument)
    if not words:
        raise BadParameter("play: expected a problem, as play hexworld --seed 7")
    return table.ask(["play", *words]) or table.began()


def load(table: Table, argument: str) -> str:
    """Goes on with a recorded game."""
    said = table.ask(["resume", *words_of(argument)])
    turn = f"turn {len(table.game.session.turns)}."
    return said or _warned(table, f"resumed {table.game.name}. {turn}")


def replay(table: Table, argument: str) -> str:
    """Looks at a recorded game."""
    said = table.ask(["replay", *words_of(argument)])
    return said or _warned(table, f"replaying {table.game.name}. step, auto and undo move in it.")


def _warned(table: Table, answer: str) -> str:
    """An answer, with what there is to warn of."""
    return f"{answer} {table.game.warning}." if table.game.warning else answer


def seed(table: Table, argument: str) -> str:
    """Begins the same game under these dice; alone, tells them."""
    if not argument:
        return f"seed: {table.game.seed if table.game.shows_seed else 'told after the game'}"
    number = whole(argument)
    if number is None:
        raise BadParameter(f"seed: got {argument!r}, expected a whole number, as 7")
    return table.begin(seed=number)


def agent(table: Table, argument: str) -> str:
    """Begins the game again with somebody else in a seat; alone, tells who sits where."""
    game = table.game
    words = argument.split()
    if not words:
        told = zip(game.problem.agents, game.seats, strict=True)
        return f"seats: {', '.join(f'{name} {who}' for name, who in told)}."
    name, who = (game.problem.agents[0], words[0]) if len(words) == 1 else words[:2]
    seat_policy(game.problem, game.problem.seat(name), who)  # refuses what cannot sit there
    seats = [*(game.request.seats if game.request else ()), f"{name}={who}"]
    sitting = [*game.seats]
    sitting[game.problem.seat(name)] = who
    for_people = {} if people(sitting) else {"player": "", "ghost": ""}
    return table.asks(f"agent {argument}") or table.restart(seats=seats, **for_people)


def set_(table: Table, argument: str) -> str:
    """Begins the game again with another parameter; alone, tells them all."""
    game = table.game
    if not argument:
        known = problems.parameters(game.problem)
        return answer([f"{name} {value}" for name, value in known.items()])
    key, _, value = argument.replace("=", " ", 1).partition(" ")
    problems.configured(game.problem, {key: value.strip()})  # refuses what cannot be
    settings = [*(game.request.settings if game.request else ()), f"{key}={value.strip()}"]
    return table.asks(f"set {argument}") or table.restart(settings=settings)


def save(table: Table, argument: str) -> str:
    """Copies the transcript so far to a file; alone, tells where it is kept."""
    game, recorder = table.game, table.game.recorder
    if recorder is None and not (argument and game.request):
        looked_at = f"a recording is only looked at; it is {game.source}" if game.source else ""
        none = "no transcript is written; --record FILE writes one"
        raise BadParameter(f"save: {looked_at or none}")
    if recorder and not argument:
        return f"kept as you play: {recorder.path}"
    name, *more = words_of(argument)
    if more:
        raise BadParameter(f"save: got {argument!r}, expected one file; quotes hold one together")
    if recorder and game.strict and game.sealed:
        raise BadParameter(f"save: this game is strict, and has no copies; it is {recorder.path}")
    if recorder and recorder.kept and _near(game.name, recorder.path, Path(name)):
        copied(recorder, Path(name))
    else:
        retold(game, Path(name))
    return f"saved {name}; dmplay resume {quote(name)} goes on"


def _near(problem: str, *paths: Path) -> bool:
    """Whether transcripts there tell of a problem by the same name."""
    return len({told_in(problem, path) for path in paths}) == 1


def branch(table: Table, argument: str) -> str:
    """Plays on from an earlier turn, this one if none is named, in a file of its own."""
    game, turns = table.game, len(table.game.session.turns)
    if game.strict:
        raise BadParameter("branch: this game is strict")
    if argument and whole(argument) is None:
        raise BadParameter(f"branch: got {argument!r}, expected a turn, 0 to {turns}")
    source = game.source
    if source is None:
        raise BadParameter("branch: no transcript is written; --record FILE writes one")
    at = argument or str(turns)
    trust = ["--trust"] if problems.brought(game.name) else []  # what is played was trusted
    table.ask(["branch", str(source), "--at", at, "-o", str(table.free(source)), *trust])
    return f"on from turn {at}. {table.began()}"


def export(table: Table, argument: str) -> str:
    """Writes a game, this one if no file is named, as a picture, a table or data."""
    words = words_of(argument)
    if not words or words[0].startswith("-"):
        recorder, hidden = table.game.recorder, table.game.problem.hidden
        if recorder is None:
            raise BadParameter("export: no transcript is written; name a file")
        if hidden and not (table.game.session.over or table.game.reveal):
            raise BadParameter("export: it would tell what is hidden until the game is over")
        asked = [(name, one) for name, one in FORMATS.items() if f"--{name}" in words]
        for name, one in asked:
            if table.typed and not one.plain and not {"-o", "--output"} & {*words}:
                told = f"--{name} is for a file; -o game.{one.ending} names it"
                raise BadParameter(f"export: {told}")
        words = [str(recorder.path), *words]
    elif "--peek" in words and table.playing and table.game.sealed:
        raise BadParameter("export: --peek is for after this game, in which much is hidden")
    return table.ask(["export", *words]) or "written."


def screen(table: Table, argument: str) -> str:
    """Opens the full screen; back in the shell after it."""
    game = table.game
    if table.open_screen is None:
        raise BadParameter("screen: it opens from the shell, on a terminal")
    return table.open_screen() or f"{game.name} again in words."
