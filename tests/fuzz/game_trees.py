"""Game trees in `.efg` files: of any depth, with equal and odd labels, faulty nodes and ends."""

from random import Random

from tests.fuzz import hostile_values
from tests.fuzz.case import GAME_FILE, Case

TREE_FILE = "tree.efg"
PATH_LENGTHS = (1, 2, 5, 5, 20, 499, 500, 501, 3000, 30_000)  # nodes on the longest path
LABELS = ("", "1", "1", "1 (2)", "a", "A", "a  b", "wait", "quit", "it's", '\\"x\\"')
TRANSCRIPT = f"""dmplay: 1
problem: "{TREE_FILE}"
seats: {{"player-0": "random", "player-1": "random"}}
seed: 1

turn: 0
draws: [0.5]
"""
SHORT_GAME = ("--agent", "random", "--vs", "random", "--seed", "1", "--turns", "3")
COMMANDS = (
    ("info", TREE_FILE),
    (TREE_FILE, *SHORT_GAME),
    (TREE_FILE, "--seed", "1", "--turns", "3"),
    ("verify", GAME_FILE),
    ("grade", "."),
    ("info", f"openspiel:misere(game=efg_game(filename={TREE_FILE}))"),
    ("convert", TREE_FILE, "-o", "tree.nfg"),
)
TYPED_INPUT = "1\nlegal\n1 (2)\n1-(2)\nundo\nquit\n"


def draw_tree_case(random: Random) -> Case:
    """Draw a game tree, at times a faulty one, and a command that reads it."""
    length = random.choice(PATH_LENGTHS)
    nodes = [_draw_node(random, n + 1) for n in range(length)]
    # Each node lists its other branches after the path below its first one.
    ends = [f't "" {n + 1} "" {{ {n} {-n} }}' for n in range(1 + sum(n for _, n in nodes))]
    rows = ['EFG 2 R "tree" { "ann" "bob" }', *(row for row, _ in nodes), *ends]
    if random.random() < 0.2:
        rows[random.randrange(len(rows))] = hostile_values.draw_word(random)
    if random.random() < 0.1:
        del rows[random.randrange(1, len(rows)) :]
    content = "\n".join(rows).encode(errors="surrogatepass")
    files = {TREE_FILE: content, GAME_FILE: TRANSCRIPT.encode()}
    return Case(random.choice(COMMANDS), files, typed=TYPED_INPUT)


def _draw_node(random: Random, number: int) -> tuple[str, int]:
    """Draw a node, and return its line and the number of branches besides the first."""
    count = random.choice((1, 1, 2, 2, 3))
    labels = [f'"{random.choice(LABELS)}"' for _ in range(count)]
    if random.random() < 0.2:
        branches = " ".join(f"{label} 1/{count}" for label in labels)
        return f'c "" {number} "" {{ {branches} }} 0', count - 1
    return f'p "" {random.choice((1, 2))} {number} "" {{ {" ".join(labels)} }} 0', count - 1
