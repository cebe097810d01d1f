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
from dmplay.policies.kinds import Seated

SEEDS = 10**9


@dataclass(frozen=True)
class Axelrod(Seated):
    """A strategy of the Axelrod package, `axelrod:NAME`; it needs the extra `axelrod`.

    Before each choice a new player is led through the rounds played. What it would have drawn in
    them is forgotten: luck that a strategy keeps to itself is another in every round.
    """

    name: str = parameter("TitForTat", "the class of the strategy")

    unnamed = "name"
    package = "axelrod"
    draws = 1  # the seed of the player

    def __post_init__(self) -> None:
        """Refuses unknown strategies, and those that cheat."""
        super().__post_init__()
        package = _package()
        known = {each.__name__: each for each in package.all_strategies}
        if self.name not in known:
            raise UnknownName("strategy", self.name, known, where="axelrod")
        if not package.Classifiers.obey_axelrod(known[self.name]()):
            raise BadPolicy(f"axelrod: {self.name} does not keep the rules of the tournament")

    def begin(self, observation: Array) -> Memory:
        """No rounds: the actions of both `[B, 0]`."""
        none = np.zeros((len(observation), 0), np.int64)
        return (none, none)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        """One more round."""
        assert percept.actions is not None
        both = (percept.actions[:, self.seat], percept.actions[:, 1 - self.seat])
        return tuple(
            np.hstack([past, now[:, None]]) for past, now in zip(memory, both, strict=True)
        )

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """What the player does now."""
        rows = zip(*memory, u[:, 0], strict=True)
        return np.array([self._next(own, other, luck) for own, other, luck in rows], np.int64)

    def _next(self, own: Array, other: Array, luck: float) -> int:
        """What a new player does after these rounds."""
        package = _package()
        deeds = (package.Action.C, package.Action.D)
        player, partner = self._player(), package.MockPlayer()
        partner.set_match_attributes(**self._attributes)
        for mine, theirs in zip(own, other, strict=True):
            player.set_seed(round(luck * SEEDS))
            player.strategy(partner)
            player.update_history(deeds[mine], deeds[theirs])
            partner.update_history(deeds[theirs], deeds[mine])
        player.set_seed(round(luck * SEEDS))
        return deeds.index(player.strategy(partner))

    def _player(self) -> Any:
        player = getattr(_package(), self.name)()
        player.set_match_attributes(**self._attributes)
        return player

    @cached_property
    def _attributes(self) -> dict[str, object]:
        """What the players know of the match: its payoffs, and no end."""
        assert isinstance(self.problem, MatrixGame)
        own = self.problem.payoffs[:, :, 0]
        game = _package().Game(r=own[0, 0], s=own[0, 1], t=own[1, 0], p=own[1, 1])
        return {"length": math.inf, "game": game, "noise": 0}


def _package() -> ModuleType:
    try:
        import axelrod
    except ImportError:
        raise BadPolicy(
            "axelrod: the package is not installed; python -m pip install 'dmplay[axelrod]'"
        ) from None
    return axelrod  # type: ignore[no-any-return]
