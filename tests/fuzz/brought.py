"""Problems of one's own, in a file, with arrays, labels and methods that are wrong."""

from random import Random

from tests.fuzz.case import GAME, Case

FILE, NAME = "own.py", "./own.py:Own"
TABLES = """\
import numpy as np
from dmplay import Labels, Tables, Tabular

class Own(Tabular):
    agents = {agents}
    actions = {actions}
    observations = {observations}
    state_names, horizon = {names}, {horizon}
    initial_belief = {belief}
    discount = {discount}
    tables = Tables({transition}, {rewards}, {seen})
"""
METHODS = """\
import numpy as np
from dataclasses import dataclass
from dmplay import Labels, Outcome, DiscreteUniform, Problem
from dmplay.chance import Categorical, Normal, Uniform

@dataclass(frozen=True)
class Own(Problem):
    discount: float = {discount}
    actions = {actions}
    observations = {observations}
    state_count, horizon = {states}, {horizon}
    def initial_chance(self, rows): return {opening}
    def initial_states(self, rows, events): return {place}
    def chance(self, s, a): return {chance}
    def resolve_events(self, s, a, events): return Outcome({moved}, {paid}, {sight})
    def format_state(self, s): return {notation}
    def parse_state(self, text): return np.array(int(text))
    def terminal(self, s): return {terminal}
    def legal_actions_mask(self, s): return {legal}
"""
RIGHT = {  # what makes a good problem of each form
    "agents": '("agent",)',
    "actions": '(Labels(("a", "b")),)',
    "observations": '(Labels(("x", "y")),)',
    "names": '("one", "two")',
    "horizon": "3",
    "belief": "np.array([0.5, 0.5])",
    "discount": "0.9",
    "transition": "np.full((2, 2, 2), 0.5)",
    "rewards": "np.zeros((2, 2, 1))",
    "seen": "np.full((2, 2, 2), 0.5)",
    "states": "4",
    "opening": "()",
    "place": "np.zeros(rows, int)",
    "chance": "(DiscreteUniform(np.full(len(s), 2), 2),)",
    "moved": "np.minimum(s + events[0], 3)",
    "paid": "np.ones((len(s), 1))",
    "sight": "np.zeros((len(s), 1), int)",
    "notation": "str(int(s))",
    "terminal": "s == 3",
    "legal": "None",
}
SHAPES = ("(2, 2, 2)", "(2, 2)", "(3, 2, 2)", "(2, 2, 3)", "(0, 2, 2)", "(2, 2, 1)", "(2,)", "()")
ARRAYS = (
    *(f"np.full({shape}, 0.5)" for shape in SHAPES), "np.full((2, 2, 2), np.nan)",
    "np.full((2, 2, 2), np.inf)", "np.full((2, 2, 2), -0.5)", "np.full((2, 2, 2), 0.55)",
    "np.full((2, 2, 2), 1e308)", "np.array([[['a', 'b']] * 2] * 2)", "np.full((2, 2, 1), np.nan)",
    "np.full((2, 2, 2), None)", "[[[0.5, 0.5]] * 2] * 2", "None", "7", "'text'", "()",
    "np.full((2, 2, 2), 1 + 1j)", "np.array([1.15, -0.15])", "np.array([0.5, 0.6])",
    "np.array([np.nan, 1])",
)  # fmt: skip
LABELS = (
    "()", "None", "Labels(())", "(Labels(()),)", '(Labels(("a",)),)', '(Labels(("a", "a")),)',
    '(Labels(("a", "b", "c")),)', '(Labels(("quit", "hint")),)', '(Labels(("a", "\\x1b[2J")),)',
    '(Labels(("", " ")),)', '(Labels(("a", "b")), Labels(("a", "b")))', "7", '("a", "b")',
    '(Labels((1, 2)),)', '(Labels(("a\\nb", "\\u202e")),)', '(Labels(("a", "b c;#")),)',
)  # fmt: skip
RESULTS = (
    "None", "7", "s", "a", "np.zeros(0)", "np.full(len(s), np.nan)", "np.full(len(s), 99)",
    "np.full(len(s), -1)", "np.full(len(s), 0.5)", "np.zeros((len(s), 2))", "np.zeros((len(s), 1))",
    "np.full((len(s), 1), np.inf)", "np.full((len(s), 1), np.nan)", "'text'", "1 / 0", "[][1]",
    "missing", "np.zeros((9, 9))", "s.fill(1)", "np.zeros((len(s), 1, 2), bool)", "s == s",
    "(DiscreteUniform(np.zeros(len(s), int), 2),)", "(Categorical(np.full((len(s), 1), np.nan)),)",
    "(Normal(0.0, -1.0),)", "(Uniform(1.0, np.nan),)", "(7,)", "Labels(())", "a[0].item().missing",
)  # fmt: skip
TEXTS = ("None", "7", "''", "'\\x1b[2J'", "'a\\nb'", "s", "missing", "'\\u202e'", "'x' * 9000")
NAMES = ("()", "('a',)", "('a', 'a', 'b')", "None", "('', '\\x1b')", "7")
COUNTS = ("None", "0", "-1", "1", "2", "10**9", "10**400", "1.5", "np.inf", "'4'", "()", "True")
WRONG = {  # what else may be said in the place of each
    **dict.fromkeys(("transition", "rewards", "seen", "belief"), ARRAYS),
    **dict.fromkeys(("actions", "observations"), LABELS),
    **dict.fromkeys(
        ("agents", "names"), ("()", "('a',)", "('a', 'a', 'b')", "None", "('', '\\x1b')", "7")
    ),
    **dict.fromkeys(("horizon", "states", "discount"), COUNTS),
    **dict.fromkeys(("opening", "place"), tuple(one.replace("len(s)", "rows") for one in RESULTS)),
    **dict.fromkeys(("chance", "moved", "paid", "sight", "terminal", "legal"), RESULTS),
    "notation": TEXTS,
}
SYNTAX = ("import missing_module\n", "def f(:\n", "raise RuntimeError('x')\n", "\x00", "\xff", "")
SHORT = ("--turns", "3", "--seed", "1")
COMMANDS = (
    (NAME, *SHORT, "--agent", "random"), ("info", NAME),
    (NAME, *SHORT), (NAME, *SHORT, "--agent", "optimal"), (NAME, *SHORT, "--agent", "plan"),
    (NAME, *SHORT, "--agent", "random", "-o", GAME, "--frames"), ("agents", NAME), ("solve", NAME),
)  # fmt: skip
TYPED = "a\nhint\nvalues\nlook\nbelief\nb\nundo\nlegal\nquit\n"


def brought(random: Random) -> Case:
    """A problem in which one thing is wrong, or several, played, told of and solved."""
    form = random.choice((TABLES, METHODS))
    parts = dict(RIGHT)
    if random.random() < 0.3:
        parts["observations"], parts["seen"], parts["sight"] = "()", "None", "s"
    within = [key for key in WRONG if f"{{{key}}}" in form]
    for key in random.sample(within, random.choice((1, 1, 1, 2))):
        parts[key] = random.choice(WRONG[key])
    source = form.format(**parts)
    if random.random() < 0.03:
        source = random.choice(SYNTAX) + source
    return Case(random.choice(COMMANDS), {FILE: source.encode()}, typed=TYPED)
