"""Games of ours as trees that OpenSpiel reads, in Gambit's format; it knows no rule of ours.

A node of the tree is a history of all that was done and drawn; an agent tells histories apart by
what it did and observed.
"""

from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np
import pyspiel

from dmplay.chance import Array, Reals
from dmplay.core import Problem, enumerate_possible_outcomes, initial_state_distribution

Histories = tuple[tuple[object, ...], ...]  # of each agent


class Tree:
    """The tree of so many turns of a problem."""

    def __init__(self, problem: Problem, turns: int) -> None:
        self.problem, self.turns = problem, turns
        self._sets: list[dict[tuple[object, ...], int]] = [{} for _ in problem.agents]
        self._numbers = count(1)
        self._known: dict[tuple[object, ...], tuple[Reals, list[tuple[Array, Reals, Array]]]] = {}

    def game(self) -> Any:
        """The game, as OpenSpiel has it."""
        agents = " ".join(f'"{agent}"' for agent in self.problem.agents)
        return pyspiel.load_efg_game("\n".join([f'EFG 2 R "ours" {{ {agents} }}', *self._start()]))

    def _start(self) -> Iterator[str]:
        chances, states = initial_state_distribution(self.problem)
        nothing = np.zeros(len(self.problem.agents))
        yield from self._drawn(chances)
        for state in states:
            first = () if self.problem.partially_observable else (state.tobytes(),)
            yield from self._node(state, tuple(first for _ in nothing), nothing, 0)

    def _drawn(self, chances: Reals) -> Iterator[str]:
        """A node of chance, where there is any."""
        if len(chances) > 1:
            each = " ".join(f'"{n}" {chance!r}' for n, chance in enumerate(chances.tolist()))
            yield f'c "" {next(self._numbers)} "" {{ {each} }} 0'

    def _node(self, state: Array, known: Histories, paid: Reals, turn: int) -> Iterator[str]:
        """What follows a turn: the choices of the agents, or the end."""
        if turn == self.turns or self.problem.terminal(state[None])[0]:
            pays = " ".join(map(repr, paid.tolist()))
            yield f't "" {next(self._numbers)} "" {{ {pays} }}'
        else:
            yield from self._choices(state, known, paid, turn, [])

    def _choices(
        self, state: Array, known: Histories, paid: Reals, turn: int, chosen: list[int]
    ) -> Iterator[str]:
        """The next agent's choices, which the others do not see; then what comes of them all."""
        problem, seat = self.problem, len(chosen)
        if seat == len(problem.agents):
            yield from self._outcomes(state, known, paid, turn, chosen)
            return
        place = self._sets[seat].setdefault(known[seat], len(self._sets[seat]) + 1)
        names = " ".join(f'"{name}"' for name in problem.actions[seat].labels)
        yield f'p "" {seat + 1} {place} "{place}" {{ {names} }} 0'
        for action in range(problem.action_counts[seat]):
            yield from self._choices(state, known, paid, turn, [*chosen, action])

    def _outcomes(
        self, state: Array, known: Histories, paid: Reals, turn: int, chosen: list[int]
    ) -> Iterator[str]:
        problem, key = self.problem, (state.tobytes(), *chosen)
        if key not in self._known:
            _, chances, outcome = enumerate_possible_outcomes(
                problem, state[None], np.array([chosen])
            )
            self._known[key] = chances, [*zip(*outcome, strict=True)]
        chances, every = self._known[key]
        yield from self._drawn(chances)
        for s2, rewards, seen in every:
            told = [
                (chosen[seat], int(seen[seat]))
                if problem.partially_observable
                else (*chosen, s2.tobytes())
                for seat in range(len(known))
            ]
            after = tuple((*before, new) for before, new in zip(known, told, strict=True))
            worth = paid + problem.discount**turn * rewards
            yield from self._node(s2, after, worth, turn + 1)
