"""What is typed after each command: those that leave the game as it is, and those that do not.

In braces stands what the game knows: an action, another action, the seat, the problem.
"""

from collections.abc import Mapping, Sequence

from dmplay.game.formats import EXPORT_FORMATS
from dmplay.screen.press import SCREEN_KEYS
from dmplay.words.commands import COMMANDS
from tests.privacy.fronts import FILE
from tests.privacy.pairs import BROUGHT, LOOKED_AT, Pair

Arguments = Mapping[str, Sequence[str]]

# The game stands after them as before.
ASKING: Arguments = {
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
    "seed": ("", "x"),
    "set": ("", "discount 7", "nothing 7"),
    "state": ("",),
    "step": ("", "3"),
    "transcript": ("",),
    "undo": ("0", "99", "x"),
    "values": ("",),
    "whatif": ("", "{action}", "nonsense"),
}

# So it does after these, which are words of the command line.
READING: Arguments = {
    "agents": ("{problem}", ""),
    "branch": ("99",),
    "export": ("--svg -o game.dmt", *(f"{{file}} --{name} {{trust}}" for name in EXPORT_FORMATS)),
    "figure": ("", "F.99"),
    "guide": ("", "agents --raw", "nothing"),
    "info": ("{problem}", "nothing"),
    "list": ("", "POMDP", "games", "nonsense"),
    "load": ("", "nothing.dmt", "{file}"),
    "play": ("nothing", "{problem} --turns 0"),
    "records": ("",),
    "replay": ("", "nothing.dmt"),
    "solve": ("rock-paper-scissors", "nothing"),
}

# The game stands elsewhere after them, or another one is played: before which turn.
MOVING: Mapping[str, Mapping[str, int]] = {
    "undo": {"undo": 1, "undo 2": 0},
    "redo": {"undo; redo": LOOKED_AT},
    "reroll": {"reroll": LOOKED_AT},
    "restart": {"restart": 0},
    "new": {"new": 0},
    "seed": {"seed 5": 0},
    "set": {"set discount 0.5; set discount 0.5": 0},
    "agent": {"agent {seat} human; agent {seat} human": 0},
    "play": {"play {problem} --turns 3": 0},
    "load": {"load copy.dmt {trust}": LOOKED_AT},
    "branch": {"branch": LOOKED_AT, "branch 1": 1, "branch 0": 0},
    "replay": {"replay copy.dmt {trust}": LOOKED_AT, "replay copy.dmt {trust}; auto": LOOKED_AT},
    "quit": {"quit": LOOKED_AT},
}

# What is asked once more then.
AFTER = ("look", "state", "belief", "legal", "transcript", "seed")

# Beside the names of commands, what else is typed, or mistyped.
BESIDE = (
    "nonsense", "{action}x", "hin", "look look", "hint; belief; look", "{other}", "12345", "-1", "",
)  # fmt: skip

# What is typed at another terminal while the game is played, or was left by a kill.
OUTSIDE: Mapping[str, Sequence[str]] = {
    "play": (
        "{problem} --seed 5 --turns 2",
        "{problem} --turns 3 --seed 5 {replayed}",
        "{problem} --turns 3 --seed 5 {replayed} --json",
    ),
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
    "branch": (
        "{file} --at 2 -o branch.dmt",
        "{file} --at 1 -o branch.dmt --json",
        "{file} --at 0 -o branch.dmt --quiet",
        "{file} --at 99 -o branch.dmt",
    ),
    "list": ("", "POMDP --json", "games", "games --json"),
    "records": ("", "--json"),
    "solve": ("rock-paper-scissors",),
    "run": ("{problem} --episodes 3 --turns 2 --agent random --json",),
    "tournament": ("rock-paper-scissors nash random --episodes 3 --turns 2",),
    "assign": ("{problem} --seeds 1 -o walks --force",),
    "grade": ("{file}", "{file} --json", ". --csv"),
    "convert": ("crying-baby -o out.pomdp --force",),
    "compare": ("{problem} random random --episodes 3 --turns 2 --csv",),
    "figure": ("F.2", ""),
    "agents": ("{problem}", "{problem} --json"),
    "info": ("{problem}", "{problem} --json"),
    "check": ("{problem}", "{problem} --json"),
    "guide": ("", "agents --raw"),
    "config show": ("", "--json"),
    "config path": ("",),
}

# What is typed there where a game is gone on with.
TYPED = "look\nstate\nbelief\nlegal\ntranscript\nhint\nseed\n"

# The keys of the screen that neither play, nor begin a game, nor leave.
KEYS_ASKED = [
    f"<{key}>"
    for key in (
        "enter",
        *(key for one in SCREEN_KEYS for key in one.keys if one.name != "quit"),
        *(one.key for one in COMMANDS if one.key and one.name not in ("new", "restart", "quit")),
        *("up", "down", "left", "right", "home", "end", "x", "=", "escape", "backspace", "c-r"),
    )
]


def words(pair: Pair, turn: int) -> dict[str, str]:
    """What the lines to be typed before a turn speak of."""
    agents, seat = pair.problem.agents, pair.seat_index
    return {
        "action": pair.problem.format_action(seat, pair.one.actions[turn][seat]),
        "seat": agents[seat],
        "other": agents[-1],
        "problem": pair.name,
        "file": str(FILE),
        "trust": "--trust" if pair.name == BROUGHT else "",
    }


def questions(pair: Pair, turn: int, *tables: Arguments) -> list[str]:
    """All lines that leave a game as it stands."""
    every = [f"{name} {rest}" for table in tables for name, told in table.items() for rest in told]
    return [line.format(**words(pair, turn)).strip() for line in (*every, *BESIDE)]


def moves(pair: Pair, first: int = 0, after: int = LOOKED_AT) -> list[str]:
    """What the seat does in some turns."""
    return [words(pair, turn)["action"] for turn in range(first, after)]
