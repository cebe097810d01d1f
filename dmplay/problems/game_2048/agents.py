"""Policies for 2048."""

from dataclasses import dataclass

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import AdviceQuestion, GreedyPolicy, ReactivePolicy, SeatPolicy
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, requires_fields

from . import expectimax
from .packed_boards import DOWN, LEFT, RIGHT, UP
from .rules import Game2048

MAX_DEPTH_PLIES = 20  # plies
# A search that follows paths of a thirtieth of the probability finds another slide better on 600
# boards: for 1 of 4 differences of 200 to 1000, 1 of 8 up to 2000, and 1 of 30 of the larger ones.
RATING_RESOLUTION = 2000.0
MAX_MILLISECONDS = 10_000.0  # milliseconds


@dataclass(frozen=True)
class Corner(SeatPolicy):
    """Slides left and down alternately; right or up only if neither is legal (section F.2)."""

    def initial_memory(self, observation: Array) -> Memory:
        """Return the direction that is due."""
        return (np.full(len(observation), LEFT),)

    @requires_fields("action")
    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the direction that is due: down after left, else left."""
        return (np.where(percept.action == LEFT, DOWN, LEFT),)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the first legal direction of the due one, left or down, right and up."""
        due = memory[0]
        if legal is None:
            return due
        left, down, right, _ = np.ascontiguousarray(legal.T)
        alternating = np.where(np.where(due == LEFT, left, down), due, LEFT + DOWN - due)
        return np.where(left | down, alternating, np.where(right, RIGHT, UP))


@dataclass(frozen=True)
class Expectimax(GreedyPolicy, ReactivePolicy):
    """Looks ahead at slides and likely new tiles (expectimax), further if few cells are empty.

    The boards at the end are rated by a network that learned from games. It learned the points to
    come, but of a weaker player, which looks one slide ahead. The ratings therefore compare slides;
    this agent earns many more points. With a time limit the search is as deep as the time allows,
    so two searches may differ.
    """

    problem: Game2048

    depth: int = parameter(
        12, "search depth in plies (a slide or a tile), if no time limit", 1, MAX_DEPTH_PLIES
    )
    milliseconds: float = parameter(
        0.0, "time limit per choice, ms; 0: none", 0.0, MAX_MILLISECONDS
    )

    @property
    def depends_on_clock(self) -> bool:
        """True if its choice depends on the speed of the machine."""
        return self.milliseconds > 0

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return ratings that ignore the turn limit and the discount."""
        basis = super().values_basis(question)
        return basis._replace(
            accuracy=Accuracy.RATING,
            resolution=RATING_RESOLUTION,
            ignores_turn_limit=question.turn_limit is not None,
            ignores_discount=self.problem.discount < 1.0,
        )

    def action_values(self, memory: Memory) -> Reals:
        """Return the rating of each slide; -inf for a slide that moves nothing."""
        (board,) = memory
        p_two = self.problem.p_two
        if not self.depends_on_clock:
            return expectimax.compute_action_values(board, p_two, self.depth)
        return expectimax.search_by_iterative_deepening(
            board, p_two, MAX_DEPTH_PLIES, self.milliseconds / 1000
        )


AGENTS = Roster(
    {"corner": Corner, "expectimax": Expectimax},
    hint_provider="expectimax",
    batch_agent="corner",
    rule_of_thumb="corner",
)
