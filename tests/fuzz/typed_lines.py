"""Lines that people type: actions, commands with arguments, and nonsense."""

from random import Random

from dmplay.guide.topics import list_topics
from dmplay.ui.shell.commands import COMMANDS
from tests.fuzz import hostile_values
from tests.fuzz.corpus import SLOW_PROBLEMS, list_action_texts
from tests.support.problem_cases import CASE_NAMES, load_problem

FILE_NAMES = (
    "game.dmt", "other.dmt", "nowhere.dmt", "game.txt", "-", ".", "", "no/where", "/dev/null",
    "/dev/full", "/dev/stdin", "x" * 300, "a\nb.dmt", "\x1b[2J.dmt", "é.dmt", "\ud800.dmt",
)  # fmt: skip
OPTION_TEXTS = (
    "--svg", "--film", "--html", "--cast", "--text", "--csv", "--json", "--at 1",
    "--at 99", "-o other", "--help", "--width 1", "--ascii", "--nothing", "--turns 2", "--seed 5",
    "--frames", "--strict", "--reveal", "--vs random", "--seat agent=random", "--set discount=0.5",
    "--agent random", "--force",
)  # fmt: skip
SCREEN_KEYS = (
    *"abcdefhijklmnopqrstuvwxyzABCDEGHIJKLMNOPRSTUVWXYZ0123456789.-+?/*", "up", "down", "left",
    "right", "home", "end", "pageup", "pagedown", "enter", "space", "backspace", "escape", "tab",
    "delete", "c-r", "c-a", "f3", "é", "\x00", "日", "<any>",
)  # fmt: skip
SLOW_COMMANDS = ("solve", "plot")  # commands that may rightly take longer than a case


def draw_line(random: Random, name: str) -> str:
    """Draw a line that is typed in a game of this problem."""
    kind = random.random()
    if kind < 0.45:
        return random.choice(list_action_texts(name))
    if kind < 0.85:
        return _draw_command(random, name)
    if kind < 0.95:
        return hostile_values.draw_word(random)
    return "; ".join(draw_line(random, name) for _ in range(3))


def draw_lines(random: Random, name: str) -> str:
    """Draw several lines, at times without a last newline."""
    rows = [draw_line(random, name) for _ in range(random.randint(1, 6))]
    return "\n".join(rows) + random.choice(("\n", "\n", "", "\nquit\n"))


def draw_game_arguments(random: Random, name: str) -> tuple[str, ...]:
    """Draw the arguments of a game of few turns in which a person plays."""
    words = [name, "--turns", random.choice("123"), "--seed", str(random.randrange(99))]
    if len(load_problem(name).agents) > 1:
        words += ["--vs", random.choice(("random", "human"))]
    options = [
        option for option in ("--strict", "--reveal", "--frames", "--json") if random.random() < 0.1
    ]
    return (*words, *options)


def draw_keys(random: Random, name: str) -> tuple[str, ...]:
    """Draw keys of the full screen, and lines typed after `:`."""
    return tuple(
        f":{draw_line(random, name)}" if random.random() < 0.25 else random.choice(SCREEN_KEYS)
        for _ in range(random.randint(1, 8))
    )


def draw_problem_name(random: Random) -> str:
    """Draw the name of a problem, with its variant."""
    return random.choice([name for name in CASE_NAMES if name not in SLOW_PROBLEMS])


def _draw_command(random: Random, name: str) -> str:
    command_names = [command.name for command in COMMANDS if command.name not in SLOW_COMMANDS]
    command = random.choice(command_names)
    arguments = [
        _draw_argument(random, command, name) for _ in range(random.choice((0, 0, 1, 1, 2)))
    ]
    return " ".join([command, *arguments])


def _draw_argument(random: Random, command: str, name: str) -> str:
    choices = {
        "play": CASE_NAMES,
        "info": CASE_NAMES,
        "agents": CASE_NAMES,
        "list": ("mdp", "pomdp"),
        "guide": [*list_topics()],
        "help": [*(entry.name for entry in COMMANDS), "turns"],
        "act": list_action_texts(name),
        "export": (*FILE_NAMES, *OPTION_TEXTS),
        "agent": ("random", "human", "agent"),
        "undo": ("1", "2", "3", "99"),
        "redo": ("1", "2"),
        "step": ("1", "2"),
        "auto": ("1", "2"),
        "seed": ("1", "2", str(2**63)),
        "branch": ("0", "1", "9"),
        "set": ("discount", "0.5"),
    }
    if random.random() < 0.2:
        return hostile_values.draw_word(random)
    return random.choice(choices.get(command, (*FILE_NAMES, *OPTION_TEXTS)))
