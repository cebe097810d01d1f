"""The arguments typed after each command: those that leave the game as it is, and those that do
not.

The names in braces are filled in for the game: action, seat, other agent, problem, file, trust.
"""

from collections.abc import Mapping, Sequence

from dmplay.game.export_formats import EXPORT_FORMATS
from dmplay.ui.screen.key_handlers import SCREEN_KEYS
from dmplay.ui.shell.commands import COMMANDS
from tests.privacy.front_ends import TRANSCRIPT_PATH
from tests.privacy.indistinguishable_pairs import SHARED_TURNS, USER_PROBLEM, Pair

Arguments = Mapping[str, Sequence[str]]

# These do not change the game.
QUERY_ARGUMENTS: Arguments = {
    "act": ("", "nonsense", "{action} {action}"),
    "agent": ("", "nobody nothing"),
    "auto": ("", "2"),
    "belief": ("", "of all"),
    "branch": ("x",),
    "export": ("--csv", "--json", "--text --at 1", "", "{file} --csv {trust}"),
    "help": ("", "turns", "{action}", "{problem}", "undo", "nonsense"),
    "hint": ("", "now"),
    "keys": ("",),
    "legal": ("",),
    "look": ("",),
    "play": ("",),
    "policy": ("",),
    "redo": ("x", ""),
    "review": ("",),
    "save": ("", "copy.dmt", "copy.dmt"),
    "screen": ("",),
    "seat": ("", "{seat}", "nobody=human"),
    "seed": ("", "x"),
    "set": ("", "discount 7", "nothing 7"),
    "state": ("",),
    "step": ("", "3"),
    "transcript": ("",),
    "undo": ("0", "99", "x"),
    "values": ("",),
    "whatif": ("", "{action}", "nonsense"),
    "why": ("", "{action}", "nonsense"),
    "assume": ("", "random", "actual", "nonsense"),
    "watch": ("", "belief-update", "tree-search", "alpha-vectors", "nonsense"),
}

# These do not change it either; they are also commands of the program.
READING_ARGUMENTS: Arguments = {
    "agents": ("{problem}", ""),
    "branch": ("99",),
    "export": ("--svg -o game.dmt", *(f"{{file}} --{name} {{trust}}" for name in EXPORT_FORMATS)),
    "guide": ("", "agents --raw", "nothing"),
    "info": ("{problem}", "nothing"),
    "learn": ("", "first", "nonsense"),
    "list": ("", "POMDP", "games", "nonsense"),
    "load": ("", "nothing.dmt", "{file}"),
    "play": ("nothing", "{problem} --turns 0"),
    "plot": ("", "F.99", "belief {file} {trust}", "regret {file} {trust}"),
    "records": ("",),
    "replay": ("", "nothing.dmt"),
    "solve": ("rock-paper-scissors", "nothing"),
}

# These go to another turn or start another game; the number is that of the turns played by then.
CHANGING_COMMANDS: Mapping[str, Mapping[str, int]] = {
    "undo": {"undo": 1, "undo 2": 0},
    "redo": {"undo; redo": SHARED_TURNS},
    "reroll": {"reroll": SHARED_TURNS},
    "restart": {"restart": 0},
    "new": {"new": 0},
    "seed": {"seed 5": 0},
    "set": {"set discount 0.5; set discount 0.5": 0},
    "agent": {"agent {seat} human; agent {seat} human": 0},
    "play": {"play {problem} --turns 3": 0},
    "load": {"load copy.dmt {trust}": SHARED_TURNS},
    "branch": {"branch": SHARED_TURNS, "branch 1": 1, "branch 0": 0},
    "seat": {"seat {seat}=human": SHARED_TURNS},
    "replay": {
        "replay copy.dmt {trust}": SHARED_TURNS,
        "replay copy.dmt {trust}; auto": SHARED_TURNS,
    },
    "quit": {"quit": SHARED_TURNS},
}

# Commands typed after them.
FOLLOW_UP_COMMANDS = ("look", "state", "belief", "legal", "transcript", "seed")

# Lines that are typed in addition to the command names, most of them mistyped.
MISTYPED_LINES = (
    "nonsense", "{action}x", "hin", "look look", "hint; belief; look", "{other}", "12345", "-1", "",
)  # fmt: skip

# Commands typed in another terminal while the game is played or after it was killed.
PROGRAM_ARGUMENTS: Mapping[str, Sequence[str]] = {
    "play": ("{problem} --seed 5 --turns 2", "{problem} --turns 3 --seed 5 {replayed}",
             "{problem} --turns 3 --seed 5 {replayed} --json"),
    "resume": ("{file} --plain", "{file} --json", "{file} --quiet", "", "{file} --keys left"),
    "replay": ("{file}", "{file} --json", "nothing.dmt"),
    "shell": ("-e 'load {file}' -e state", "-e 'replay {file}' -e auto -e state", "-e list"),
    "verify": ("{file}", "{file} --json", "{file} --allow-unfinished", "{file} --update", "."),
    "export": (
        *(f"{{file}} --{name}" for name in EXPORT_FORMATS),
        *(f"{{file}} --{name} -o out.{name}" for name in EXPORT_FORMATS),
        "{file} --svg --at 1",
        "{file}",
    ),
    "review": ("{file}", "{file} --json", "{file} --write"),
    "bot": ("random --problem {problem}",),
    "mcp": ("nothing", "{file}", "--output {file}"),
    "branch": ("{file} --at 2 -o branch.dmt", "{file} --at 1 -o branch.dmt --json",
               "{file} --at 0 -o branch.dmt --quiet", "{file} --at 99 -o branch.dmt"),
    "list": ("", "POMDP --json", "games", "games --json"),
    "records": ("", "--json"),
    "solve": ("rock-paper-scissors",),
    "run": ("{problem} --episodes 3 --turns 2 --agent random --json",),
    "tournament": ("rock-paper-scissors nash random --episodes 3 --turns 2",),
    "assign": ("{problem} --seeds 1 -o walks --force",),
    "grade": ("{file}", "{file} --json", ". --csv"),
    "convert": ("crying-baby -o out.pomdp --force",),
    "compare": ("{problem} random random --episodes 3 --turns 2 --csv",),
    "evaluate": ("random {problem} --episodes 3 --turns 2 --json", "{file}", "{file} --csv", "."),
    "rerun": ("", "{file}", "nothing.json"),
    "plot": ("F.2", "", "belief {file}", "regret {file}"),
    "watch": ("", "belief-update {problem}", "belief-update {file}", "tree-search {file} --json"),
    "train": ("", "q-learning {problem} --seeds 1 --steps 10 --json"),
    "data": ("{problem} --rows 3",),
    "learn lesson": ("", "10 --json"),
    "learn from": ("{file}", "{file} --json", ""),
    "learn puzzle": ("crying-baby:1 --json",),
    "agents": ("{problem}", "{problem} --json"),
    "info": ("{problem}", "{problem} --json"),
    "check": ("{problem}", "{problem} --json"),
    "guide": ("", "agents --raw"),
    "config show": ("", "--json"),
    "config path": ("",),
}  # fmt: skip

# Standard input of these commands, for those that resume a game.
STDIN_TEXT = "look\nstate\nbelief\nlegal\ntranscript\nhint\nseed\n"

# The keys of the screen that do not play an action, start a game or quit.
QUERY_KEYS = [
    f"<{key}>"
    for key in (
        *(key for entry in SCREEN_KEYS for key in entry.keys if entry.name != "quit"),
        *(
            entry.key
            for entry in COMMANDS
            if entry.key and entry.name not in ("new", "restart", "quit")
        ),
        *("up", "down", "left", "right", "home", "end", "x", "=", "escape", "backspace", "c-r"),
    )
]


def make_placeholders(pair: Pair, turn: int) -> dict[str, str]:
    """Return the values of the names in braces, for lines that are typed before a turn."""
    agents, seat = pair.problem.agents, pair.seat_index
    return {
        "action": pair.problem.format_action(seat, pair.first.actions[turn][seat]),
        "seat": agents[seat],
        "other": agents[-1],
        "problem": pair.name,
        "file": str(TRANSCRIPT_PATH),
        "trust": "--trust" if pair.name == USER_PROBLEM else "",
    }


def list_queries(pair: Pair, turn: int, *tables: Arguments) -> list[str]:
    """Return all lines that leave a game as it is."""
    templates = [
        f"{name} {argument}"
        for table in tables
        for name, arguments in table.items()
        for argument in arguments
    ]
    return [
        line.format(**make_placeholders(pair, turn)).strip()
        for line in (*templates, *MISTYPED_LINES)
    ]


def list_actions(pair: Pair, first: int = 0, end: int = SHARED_TURNS) -> list[str]:
    """Return the actions of the seat in a range of turns."""
    return [make_placeholders(pair, turn)["action"] for turn in range(first, end)]
