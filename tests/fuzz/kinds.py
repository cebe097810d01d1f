"""The kinds of cases: how many of a hundred, how one is drawn, and what it is given to."""

from collections.abc import Callable
from random import Random
from typing import NamedTuple

from dmplay.game.formats import EXPORT_FORMATS
from tests.fuzz import brought, facts, lines, options
from tests.fuzz.case import GAME, Case, Program
from tests.fuzz.corpus import of_people, transcripts
from tests.fuzz.mutations import named, spoilt
from tests.fuzz.program import dmplay, reads
from tests.fuzz.screens import screen

SIZES = ((80, 24), (80, 24), (40, 12), (120, 40), (20, 5), (1, 1), (50, 14), (300, 2))
SELDOM = (0, 0, 1, 1, 2)  # mutations of what is gone on with


class Kind(NamedTuple):
    """Cases of one kind."""

    name: str
    share: int  # of a hundred cases
    draw: Callable[[Random], Case]
    program: Program = dmplay


def read(random: Random) -> Case:
    """A spoilt transcript."""
    return Case(files={GAME: spoilt(random, random.choice(transcripts()))})


def verify(random: Random) -> Case:
    """A spoilt transcript, verified, at times rewritten."""
    more = random.choice(((), (), (), ("--json",), ("--allow-unfinished",), ("--update",)))
    return Case(("verify", GAME, *more), read(random).files)


def resume(random: Random) -> Case:
    """A spoilt transcript without its end, gone on with."""
    raw = random.choice(of_people())
    left = raw[: raw.rfind(b"\n\nend: ") + 2] if random.random() < 0.9 else raw
    typed = lines.lines(random, named(raw))
    return Case(("resume", GAME), {GAME: spoilt(random, left, SELDOM)}, typed=typed)


def replay(random: Random) -> Case:
    """A spoilt transcript, looked at."""
    more = random.choice(((), ("--json",), ("--plain",), ("--width", "7")))
    return Case(("replay", GAME, *more), read(random).files)


def review(random: Random) -> Case:
    """A spoilt transcript of people, looked back at."""
    more = random.choice(((), (), ("--json",), ("--write",)))
    return Case(("review", GAME, *more), {GAME: spoilt(random, random.choice(of_people()))})


def branch(random: Random) -> Case:
    """A spoilt transcript, played on from some turn."""
    turn = random.choice(("0", "1", "2", "3", "9", "-1", "x"))
    raw = random.choice(transcripts())
    typed = lines.lines(random, named(raw))
    words = ("branch", GAME, "--at", turn, "-o", "other.dmt")
    return Case(words, {GAME: spoilt(random, raw, SELDOM)}, typed=typed)


def export(random: Random) -> Case:
    """A spoilt transcript in another form, printed or in a file."""
    form = f"--{random.choice([*EXPORT_FORMATS])}"
    more = random.choice(((), (), ("-o", "out"), ("--at", "1"), ("--width", "10"), ("--ascii",)))
    return Case(("export", GAME, form, *more), read(random).files)


def shell(random: Random) -> Case:
    """Lines typed or piped into the shell, where a transcript lies about."""
    name = lines.problem(random)
    first = f"play {' '.join(lines.begun(random, name))}\n".replace(" --json", "")
    files = read(random).files if random.random() < 0.5 else {}
    typed = first + lines.lines(random, name)
    return Case(("shell",), files, typed=typed, terminal=random.random() < 0.5)


def plain(random: Random) -> Case:
    """Lines typed or piped into a game."""
    name = lines.problem(random)
    typed = lines.lines(random, name)
    return Case(lines.begun(random, name), typed=typed, terminal=random.random() < 0.5)


def drawn(random: Random) -> Case:
    """Keys of the screen."""
    name = lines.problem(random)
    words = tuple(word for word in lines.begun(random, name) if word != "--json")
    return Case(words, keys=lines.keys(random, name), size=random.choice(SIZES))


KINDS = (
    Kind("read", 23, read, reads),
    Kind("verify", 20, verify),
    Kind("fact", 16, facts.changed),
    Kind("resume", 5, resume),
    Kind("replay", 5, replay),
    Kind("review", 4, review),
    Kind("branch", 5, branch),
    Kind("export", 3, export),
    Kind("shell", 3, shell),
    Kind("plain", 3, plain),
    Kind("screen", 3, drawn, screen),
    Kind("set", 3, options.parameter),
    Kind("agent", 2, options.agent),
    Kind("words", 1, options.words),
    Kind("complete", 1, options.completed),
    Kind("settings", 1, options.settings),
    Kind("own", 2, brought.brought),
)


def case(kind: Kind, seed: int, number: int) -> Case:
    """The case of this number, the same in every run."""
    return kind.draw(Random(f"{seed}:{kind.name}:{number}"))


def count(kind: Kind, cases: int) -> int:
    """How many of so many cases are of a kind."""
    return round(cases * kind.share / sum(one.share for one in KINDS))
