"""What people type: actions, commands with what may follow them, and what nobody means."""

from random import Random

from dmplay.finding.topics import list_topics
from dmplay.words.commands import COMMANDS
from tests.fuzz import absurd
from tests.fuzz.corpus import PONDEROUS, actions
from tests.support.cases import CASES, load

FILES = (
    "game.dmt", "other.dmt", "nowhere.dmt", "game.txt", "-", ".", "", "no/where", "/dev/null",
    "/dev/full", "/dev/stdin", "x" * 300, "a\nb.dmt", "\x1b[2J.dmt", "é.dmt", "\ud800.dmt",
)  # fmt: skip
OPTIONS = (
    "--svg", "--film", "--html", "--cast", "--cast3", "--text", "--csv", "--json", "--at 1",
    "--at 99", "-o other", "--help", "--width 1", "--ascii", "--nothing", "--turns 2", "--seed 5",
    "--frames", "--strict", "--reveal", "--vs random", "--seat agent=random", "--set discount=0.5",
    "--agent random", "--force",
)  # fmt: skip
KEYS = (
    *"abcdefhijklmnopqrstuvwxyzABCDEGHIJKLMNOPRSTUVWXYZ0123456789.-+?/*", "up", "down", "left",
    "right", "home", "end", "pageup", "pagedown", "enter", "space", "backspace", "escape", "tab",
    "delete", "c-r", "c-a", "f3", "é", "\x00", "日", "<any>",
)  # fmt: skip
LONG = ("solve", "figure")  # commands that may take longer than a case, rightly


def line(random: Random, name: str) -> str:
    """A typed line in a game of a problem."""
    kind = random.random()
    if kind < 0.45:
        return random.choice(actions(name))
    if kind < 0.85:
        return _command(random, name)
    if kind < 0.95:
        return absurd.word(random)
    return "; ".join(line(random, name) for _ in range(3))


def lines(random: Random, name: str) -> str:
    """Several, and at times no last newline."""
    rows = [line(random, name) for _ in range(random.randint(1, 6))]
    return "\n".join(rows) + random.choice(("\n", "\n", "", "\nquit\n"))


def begun(random: Random, name: str) -> tuple[str, ...]:
    """The words of a game of few turns in which a person plays."""
    words = [name, "--turns", random.choice("123"), "--seed", str(random.randrange(99))]
    if len(load(name).agents) > 1:
        words += ["--vs", random.choice(("random", "human"))]
    more = [one for one in ("--strict", "--reveal", "--frames", "--json") if random.random() < 0.1]
    return (*words, *more)


def keys(random: Random, name: str) -> tuple[str, ...]:
    """Keys of the screen, and lines after `:`."""
    return tuple(
        f":{line(random, name)}" if random.random() < 0.25 else random.choice(KEYS)
        for _ in range(random.randint(1, 8))
    )


def problem(random: Random) -> str:
    """A problem with its variant."""
    return random.choice([name for name in CASES if name not in PONDEROUS])


def _command(random: Random, name: str) -> str:
    known = [command.name for command in COMMANDS if command.name not in LONG]
    command = random.choice(known)
    said = [_argument(random, command, name) for _ in range(random.choice((0, 0, 1, 1, 2)))]
    return " ".join([command, *said])


def _argument(random: Random, command: str, name: str) -> str:
    fitting = {
        "play": CASES, "info": CASES, "agents": CASES, "list": ("mdp", "pomdp"),
        "guide": [*list_topics()], "help": [*(one.name for one in COMMANDS), "turns"],
        "act": actions(name), "export": (*FILES, *OPTIONS), "agent": ("random", "human", "agent"),
        "undo": ("1", "2", "3", "99"), "redo": ("1", "2"), "step": ("1", "2"), "auto": ("1", "2"),
        "seed": ("1", "2", str(2**63)), "branch": ("0", "1", "9"), "set": ("discount", "0.5"),
    }  # fmt: skip
    if random.random() < 0.2:
        return absurd.word(random)
    return random.choice(fitting.get(command, (*FILES, *OPTIONS)))
