"""Strategies of the Axelrod package for the repeated prisoner's dilemma, by name."""

import math
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.matrix_game import MatrixGame
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept
from dmplay.errors import BadPolicy, UnknownName

SEED_RANGE = 10**9


@dataclass(frozen=True)
class AxelrodStrategy(SeatPolicy):
    """A strategy of the Axelrod package, `axelrod:NAME`; it needs the extra `axelrod`.

    Before each choice a new player replays the rounds so far. Its random numbers in them are not
    kept, so the hidden random state of a strategy differs in every round.
    """

    name: str = parameter("TitForTat", "class name of the strategy in the Axelrod package")

    positional_parameter = "name"
    required_package = "axelrod"
    uniform_count = 1  # the seed of the player

    def __post_init__(self) -> None:
        """Raise UnknownName for an unknown strategy, and BadPolicy for one that cheats."""
        super().__post_init__()
        package = _import_axelrod()
        strategies = {strategy.__name__: strategy for strategy in package.all_strategies}
        if self.name not in strategies:
            raise UnknownName("strategy", self.name, strategies, error_prefix="axelrod")
        if not package.Classifiers.obey_axelrod(strategies[self.name]()):
            raise BadPolicy(
                f"axelrod: {self.name} breaks the rules of Axelrod's tournament; use another one"
            )

    def initial_memory(self, observation: Array) -> Memory:
        """Return the empty action histories of both players, `[B, 0]` each."""
        empty = np.zeros((len(observation), 0), np.int64)
        return (empty, empty)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the action histories with one more round."""
        assert percept.actions is not None
        actions = (percept.actions[:, self.seat], percept.actions[:, 1 - self.seat])
        return tuple(
            np.hstack([history, action[:, None]])
            for history, action in zip(memory, actions, strict=True)
        )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the next actions of the strategy, each from a new player."""
        return np.array([*map(self._next_action, *memory, u[:, 0])], np.int64)

    def _next_action(self, own_actions: Array, opponent_actions: Array, uniform: float) -> int:
        """Return the action of a new player after these rounds."""
        package = _import_axelrod()
        actions = (package.Action.C, package.Action.D)
        player, partner = getattr(package, self.name)(), package.MockPlayer()
        player.set_match_attributes(**self._match_attributes)
        partner.set_match_attributes(**self._match_attributes)
        for own_action, opponent_action in zip(own_actions, opponent_actions, strict=True):
            player.set_seed(round(uniform * SEED_RANGE))
            player.strategy(partner)
            player.update_history(actions[own_action], actions[opponent_action])
            partner.update_history(actions[opponent_action], actions[own_action])
        player.set_seed(round(uniform * SEED_RANGE))
        return actions.index(player.strategy(partner))

    @cached_property
    def _match_attributes(self) -> dict[str, object]:
        """The attributes of the match as the players see them: its payoffs, no noise and no end."""
        assert isinstance(self.problem, MatrixGame)
        payoffs = self.problem.payoffs[:, :, 0]
        game = _import_axelrod().Game(
            r=payoffs[0, 0], s=payoffs[0, 1], t=payoffs[1, 0], p=payoffs[1, 1]
        )
        return {"length": math.inf, "game": game, "noise": 0}


def _import_axelrod() -> ModuleType:
    """Return the axelrod module; raise BadPolicy if it is not installed."""
    try:
        import axelrod
    except ImportError:
        raise BadPolicy(
            "axelrod: the package is not installed; run python -m pip install 'dmplay[axelrod]'"
        ) from None
    return axelrod  # type: ignore[no-any-return]
