"""User-defined problems in a file, with faulty arrays, labels and methods."""

from random import Random

from tests.fuzz.case import GAME_FILE, Case

PROBLEM_FILE, PROBLEM = "own.py", "./own.py:Own"
TABULAR_TEMPLATE = """\
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
METHODS_TEMPLATE = """\
import numpy as np
from dataclasses import dataclass
from dmplay import Labels, Outcome, DiscreteUniform, Problem
from dmplay.core.chance import Categorical, Normal, Uniform

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
VALID_PARTS = {  # the parts of a valid problem of either template
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
ARRAY_SHAPES = (
    "(2, 2, 2)",
    "(2, 2)",
    "(3, 2, 2)",
    "(2, 2, 3)",
    "(0, 2, 2)",
    "(2, 2, 1)",
    "(2,)",
    "()",
)
FAULTY_ARRAYS = (
    *(f"np.full({shape}, 0.5)" for shape in ARRAY_SHAPES), "np.full((2, 2, 2), np.nan)",
    "np.full((2, 2, 2), np.inf)", "np.full((2, 2, 2), -0.5)", "np.full((2, 2, 2), 0.55)",
    "np.full((2, 2, 2), 1e308)", "np.array([[['a', 'b']] * 2] * 2)", "np.full((2, 2, 1), np.nan)",
    "np.full((2, 2, 2), None)", "[[[0.5, 0.5]] * 2] * 2", "None", "7", "'text'", "()",
    "np.full((2, 2, 2), 1 + 1j)", "np.array([1.15, -0.15])", "np.array([0.5, 0.6])",
    "np.array([np.nan, 1])",
)  # fmt: skip
FAULTY_LABELS = (
    "()", "None", "Labels(())", "(Labels(()),)", '(Labels(("a",)),)', '(Labels(("a", "a")),)',
    '(Labels(("a", "b", "c")),)', '(Labels(("quit", "hint")),)', '(Labels(("a", "\\x1b[2J")),)',
    '(Labels(("", " ")),)', '(Labels(("a", "b")), Labels(("a", "b")))', "7", '("a", "b")',
    '(Labels((1, 2)),)', '(Labels(("a\\nb", "\\u202e")),)', '(Labels(("a", "b c;#")),)',
)  # fmt: skip
FAULTY_RESULTS = (
    "None", "7", "s", "a", "np.zeros(0)", "np.full(len(s), np.nan)", "np.full(len(s), 99)",
    "np.full(len(s), -1)", "np.full(len(s), 0.5)", "np.zeros((len(s), 2))", "np.zeros((len(s), 1))",
    "np.full((len(s), 1), np.inf)", "np.full((len(s), 1), np.nan)", "'text'", "1 / 0", "[][1]",
    "missing", "np.zeros((9, 9))", "s.fill(1)", "np.zeros((len(s), 1, 2), bool)", "s == s",
    "(DiscreteUniform(np.zeros(len(s), int), 2),)", "(Categorical(np.full((len(s), 1), np.nan)),)",
    "(Normal(0.0, -1.0),)", "(Uniform(1.0, np.nan),)", "(7,)", "Labels(())", "a[0].item().missing",
)  # fmt: skip
FAULTY_TEXTS = (
    "None",
    "7",
    "''",
    "'\\x1b[2J'",
    "'a\\nb'",
    "s",
    "missing",
    "'\\u202e'",
    "'x' * 9000",
)
FAULTY_NAMES = ("()", "('a',)", "('a', 'a', 'b')", "None", "('', '\\x1b')", "7")
FAULTY_COUNTS = (
    "None",
    "0",
    "-1",
    "1",
    "2",
    "10**9",
    "10**400",
    "1.5",
    "np.inf",
    "'4'",
    "()",
    "True",
)
FAULTY_PARTS = {  # the faulty values of each part
    **dict.fromkeys(("transition", "rewards", "seen", "belief"), FAULTY_ARRAYS),
    **dict.fromkeys(("actions", "observations"), FAULTY_LABELS),
    **dict.fromkeys(
        ("agents", "names"), ("()", "('a',)", "('a', 'a', 'b')", "None", "('', '\\x1b')", "7")
    ),
    **dict.fromkeys(("horizon", "states", "discount"), FAULTY_COUNTS),
    **dict.fromkeys(
        ("opening", "place"),
        tuple(expression.replace("len(s)", "rows") for expression in FAULTY_RESULTS),
    ),
    **dict.fromkeys(("chance", "moved", "paid", "sight", "terminal", "legal"), FAULTY_RESULTS),
    "notation": FAULTY_TEXTS,
}
FAULTY_PREFIXES = (
    "import missing_module\n",
    "def f(:\n",
    "raise RuntimeError('x')\n",
    "\x00",
    "\xff",
    "",
)
SHORT_GAME = ("--turns", "3", "--seed", "1")
COMMANDS = (
    (PROBLEM, *SHORT_GAME, "--agent", "random"),
    ("info", PROBLEM),
    (PROBLEM, *SHORT_GAME),
    (PROBLEM, *SHORT_GAME, "--agent", "optimal"),
    (PROBLEM, *SHORT_GAME, "--agent", "plan"),
    (PROBLEM, *SHORT_GAME, "--agent", "random", "-o", GAME_FILE, "--frames"),
    ("agents", PROBLEM),
    ("solve", PROBLEM),
)
TYPED_INPUT = "a\nhint\nvalues\nlook\nbelief\nb\nundo\nlegal\nquit\n"


def draw_user_problem_case(random: Random) -> Case:
    """Draw a problem with one or more faulty parts, to be played, described and solved."""
    form = random.choice((TABULAR_TEMPLATE, METHODS_TEMPLATE))
    parts = dict(VALID_PARTS)
    if random.random() < 0.3:
        parts["observations"], parts["seen"], parts["sight"] = "()", "None", "s"
    keys = [key for key in FAULTY_PARTS if f"{{{key}}}" in form]
    for key in random.sample(keys, random.choice((1, 1, 1, 2))):
        parts[key] = random.choice(FAULTY_PARTS[key])
    source = form.format(**parts)
    if random.random() < 0.03:
        source = random.choice(FAULTY_PREFIXES) + source
    return Case(random.choice(COMMANDS), {PROBLEM_FILE: source.encode()}, typed=TYPED_INPUT)
