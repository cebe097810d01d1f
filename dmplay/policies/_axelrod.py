"""Strategies of the Axelrod package for the repeated prisoner's dilemma, by name."""

import math
from dataclasses import dataclass
from functools import cached_property
from types import ModuleType
from typing import Any

import numpy as np

from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Percept, parameter
from dmplay.errors import BadPolicy, UnknownName
from dmplay.matrix_game import MatrixGame
from dmplay.policies.kinds import SeatPolicy

SEED_RANGE = 10**9


@dataclass(frozen=True)
class AxelrodStrategy(SeatPolicy):
    """A strategy of the Axelrod package, `axelrod:NAME`; it needs the extra `axelrod`.

    Before each choice a new player is led through the rounds played. What it would have drawn in
    them is forgotten: luck that a strategy keeps to itself is another in every round.
    """

    name: str = parameter("TitForTat", "the class of the strategy")

    positional_parameter = "name"
    required_package = "axelrod"
    uniform_count = 1  # the seed of the player

    def __post_init__(self) -> None:
        """Refuses unknown strategies, and those that cheat."""
        super().__post_init__()
        package = _import_axelrod()
        known = {each.__name__: each for each in package.all_strategies}
        if self.name not in known:
            raise UnknownName("strategy", self.name, known, error_prefix="axelrod")
        if not package.Classifiers.obey_axelrod(known[self.name]()):
            raise BadPolicy(f"axelrod: {self.name} does not keep the rules of the tournament")

    def initial_memory(self, observation: Array) -> Memory:
        """No rounds: the actions of both `[B, 0]`."""
        none = np.zeros((len(observation), 0), np.int64)
        return (none, none)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """One more round."""
        assert percept.actions is not None
        both = (percept.actions[:, self.seat], percept.actions[:, 1 - self.seat])
        return tuple(
            np.hstack([past, now[:, None]]) for past, now in zip(memory, both, strict=True)
        )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the player does now."""
        rows = zip(*memory, u[:, 0], strict=True)
        return np.array(
            [self._next_action(own, other, luck) for own, other, luck in rows], np.int64
        )

    def _next_action(self, own_actions: Array, opponent_actions: Array, uniform: float) -> int:
        """What a new player does after these rounds."""
        package = _import_axelrod()
        deeds = (package.Action.C, package.Action.D)
        player, partner = self._create_player(), package.MockPlayer()
        partner.set_match_attributes(**self._match_attributes)
        for mine, theirs in zip(own_actions, opponent_actions, strict=True):
            player.set_seed(round(uniform * SEED_RANGE))
            player.strategy(partner)
            player.update_history(deeds[mine], deeds[theirs])
            partner.update_history(deeds[theirs], deeds[mine])
        player.set_seed(round(uniform * SEED_RANGE))
        return deeds.index(player.strategy(partner))

    def _create_player(self) -> Any:
        player = getattr(_import_axelrod(), self.name)()
        player.set_match_attributes(**self._match_attributes)
        return player

    @cached_property
    def _match_attributes(self) -> dict[str, object]:
        """What the players know of the match: its payoffs, and no end."""
        assert isinstance(self.problem, MatrixGame)
        own = self.problem.payoffs[:, :, 0]
        game = _import_axelrod().Game(r=own[0, 0], s=own[0, 1], t=own[1, 0], p=own[1, 1])
        return {"length": math.inf, "game": game, "noise": 0}


def _import_axelrod() -> ModuleType:
    try:
        import axelrod
    except ImportError:
        raise BadPolicy(
            "axelrod: the package is not installed; python -m pip install 'dmplay[axelrod]'"
        ) from None
    return axelrod  # type: ignore[no-any-return]
