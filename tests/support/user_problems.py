"""User-defined problems in which some actions are illegal in some states."""

import math
from abc import abstractmethod
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from dmplay import Labels, Outcome, Problem, Tables, Tabular
from dmplay.core.arrays import Array, Bools
from dmplay.core.chance import Categorical, Chance


@dataclass(frozen=True)
class Key(Tabular):
    """One who has taken the key may open; who has not may take it or wait, and is not let in."""

    actions = (Labels(("take", "wait", "open")),)
    state_names, initial_belief = ("before", "with the key", "done"), np.array([1.0, 0.0, 0.0])
    discount: float = 0.9
    tables = Tables(
        np.eye(3)[[[1, 0, 2], [1, 1, 2], [2, 2, 2]]],
        np.array([[[-1.0], [0.0], [10.0]], [[0.0], [0.0], [10.0]], [[0.0], [0.0], [0.0]]]),
    )

    def legal_actions_mask(self, s: Array) -> Bools:
        masks = np.array([[True, True, False], [False, True, True], [True, True, True]])
        return np.asarray(masks[s][:, None])

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 2)


@dataclass(frozen=True)
class IntegerStateProblem(Problem):
    """A problem whose states are integers and that has one start state."""

    @property
    @abstractmethod
    def placed(self) -> int:
        """The state in which every game starts."""

    def format_state(self, s: Array) -> str:
        return str(int(s))

    def parse_state(self, text: str) -> Array:
        return np.array(int(text))

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return ()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.full(rows, self.placed)


@dataclass(frozen=True)
class Heap(IntegerStateProblem):
    """A heap of four stones: take one or two, at most as many as there are; the last one pays."""

    discount: float = 0.9
    actions = (Labels(("one", "two")),)
    state_count, placed = 5, 4

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        """With probability 1/4 no stone is taken."""
        return (Categorical(np.full((len(s), 1), 0.25)),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        remaining = np.where(s > 0, s - (a[:, 0] + 1) * events[0], 0)
        return Outcome(remaining, ((s > 0) & (remaining == 0)).astype(float)[:, None], remaining)

    def terminal(self, s: Array) -> Bools:
        return np.asarray(s == 0)

    def legal_actions_mask(self, s: Array) -> Bools:
        return np.stack([np.ones(len(s), bool), s != 1], axis=1)[:, None]


@dataclass(frozen=True)
class Vault(Tabular):
    """The tiger problem with locked doors: a key opens one door and is then used up."""

    horizon = 9
    actions = (Labels(("listen", "take", "left", "right")),)
    observations = (Labels(("heard left", "heard right")),)
    state_names = ("left locked", "right locked", "left unlocked", "right unlocked")
    initial_belief = np.array([0.5, 0.5, 0.0, 0.0])
    tables = Tables(
        np.stack(
            [
                np.eye(4),
                np.eye(4)[[2, 3, 2, 3]],
                *2 * [np.vstack([np.eye(4)[:2], *2 * [[0.5, 0.5, 0.0, 0.0]]])],
            ],
            axis=1,
        ),
        np.array([[-1, -1, 0, 0], [-1, -1, 0, 0], [-1, -1, -9, 1], [-1, -1, 1, -9]], float)[
            :, :, None
        ],
        np.stack([np.array([[0.85, 0.15], [0.15, 0.85]] * 2)] + [np.full((4, 2), 0.5)] * 3),
    )

    def legal_actions_mask(self, s: Array) -> Bools:
        """Return the legal actions, which reveal only whether the agent has the key."""
        doors = s >= 2
        return np.stack([np.ones(len(s), bool), ~doors, doors, doors], axis=1)[:, None]


class RevealingVault(Vault):
    """A vault whose legal actions reveal the door of the tiger, because that door is stuck."""

    def legal_actions_mask(self, s: Array) -> Bools:
        """Return the legal actions, which reveal the state."""
        masks = np.array([[1, 1, 0, 0], [1, 1, 0, 0], [1, 0, 1, 0], [1, 0, 0, 1]], bool)
        return masks[s][:, None]


@dataclass(frozen=True)
class Gamble(IntegerStateProblem):
    """Of two equal actions, one pays 0; the other pays 1 with probability 0.99, and -99 else."""

    actions = (Labels(("left", "right")),)
    placed, horizon, state_count, reward_bounds = 0, 1, math.inf, (-99.0, 1.0)

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Categorical(np.full((len(s), 1), 0.99)),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s, a * np.where(events[0], -99.0, 1.0)[:, None], s)


BROKEN_AGENT_SOURCE = """\
from json import loads


class Agent:
    uniform_count = 0

    def __init__(self, problem, seat):
        self.initial_memory = self.update_memory = self.choose = loads
"""

WALK_SOURCE = '''\
from dataclasses import dataclass

import numpy as np
from dmplay import Categorical, Labels, Outcome, Problem
from dmplay.core.parameters import parameter
from dmplay.core.problem import ContinuousStates
from dmplay.core.spaces import RealVector, TextLine
from dmplay.agents.base import ReactivePolicy
from dmplay.agents.available_agents import Roster


@dataclass(frozen=True)
class Walk(Problem):
    """Walk to the right end."""

    discount: float = parameter(0.9, "what a later turn counts", 0.0, 1.0)
    slip: float = 0.1
    actions = (Labels(("left", "right")),)
    state_count, horizon = 5, 20
    reward_bounds = (0.0, 1.0)

    def initial_chance(self, rows):
        return ()

    def initial_states(self, rows, events):
        return np.zeros(rows, int)

    def chance(self, s, a):
        return (Categorical(np.full((len(s), 1), self.slip)),)

    def resolve_events(self, s, a, events):
        way = np.where(events[0] == 0, 0, 2 * a[:, 0] - 1)
        moved = np.where(s == 4, 4, np.clip(s + way, 0, 4))
        paid = ((s < 4) & (moved == 4)).astype(float)
        return Outcome(moved, paid[:, None], moved)

    def terminal(self, s):
        return s == 4

    def legal_actions_mask(self, s):
        return np.stack([s > 0, s >= 0], axis=1)[:, None]

    def format_state(self, s):
        return f"at {int(s)}"

    def parse_state(self, text):
        return np.array(int(text.split()[1]))

    def draw_state(self, s):
        return "." * int(s) + "@"


@dataclass(frozen=True)
class Patient(ReactivePolicy):
    """Waits for its time."""

    edge: int = parameter(2, "where it turns")

    def choose(self, memory, legal, u):
        return np.ones(len(u), int)


AGENTS = Roster({"patient": Patient}, hint_provider="patient")
KEYS = {"l": "right"}
'''


# a problem that draws itself; PICTURE is replaced by the drawing
STYLED_SOURCE = """
from dataclasses import dataclass
import numpy as np
from dmplay import Labels, Tables, Tabular
from rich.style import Style
from rich.text import Text

@dataclass(frozen=True)
class Styled(Tabular):
    actions = (Labels(("go", "stay")),)
    state_names, initial_belief = ("here",), np.array([1.0])
    tables = Tables(np.ones((1, 2, 1)), np.ones((1, 2, 1)))

    def draw_state(self, s):
        return PICTURE
"""


def write_package_metadata(folder: Path, name: str, entry_points: str) -> None:
    """Write the metadata of an installed package that offers these problems into a folder."""
    metadata_folder = folder / f"{name}-1.dist-info"
    metadata_folder.mkdir()
    (metadata_folder / "METADATA").write_text(f"Name: {name}\nVersion: 1\n")
    (metadata_folder / "entry_points.txt").write_text(f"[dmplay.problems]\n{entry_points}")


# No agent of this file knows the value of a push.
REGULATOR_WITHOUT_AGENTS = """
from dmplay.problems.simple_regulator.rules import SimpleRegulator


class Push(SimpleRegulator):
    pass
"""
