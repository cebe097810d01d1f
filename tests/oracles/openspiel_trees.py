"""Games of dmplay as trees in Gambit's format, which OpenSpiel reads without our rules.

A node of the tree is a history of all actions and chance events. An agent distinguishes histories
by its own actions and observations.
"""

from collections.abc import Iterator
from itertools import count
from typing import Any

import numpy as np
import pyspiel

from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import Problem, enumerate_possible_outcomes, initial_state_distribution

Histories = tuple[tuple[object, ...], ...]  # one history for each agent


class GameTree:
    """The tree of the first turns of a problem."""

    def __init__(self, problem: Problem, turns: int) -> None:
        self.problem, self.turns = problem, turns
        self._sets: list[dict[tuple[object, ...], int]] = [{} for _ in problem.agents]
        self._numbers = count(1)
        self._cached_outcomes: dict[
            tuple[object, ...], tuple[Reals, list[tuple[Array, Reals, Array]]]
        ] = {}

    def game(self) -> Any:
        """Return the game as an OpenSpiel game."""
        agents = " ".join(f'"{agent}"' for agent in self.problem.agents)
        return pyspiel.load_efg_game("\n".join([f'EFG 2 R "ours" {{ {agents} }}', *self._start()]))

    def _start(self) -> Iterator[str]:
        probabilities, states = initial_state_distribution(self.problem)
        zeros = np.zeros(len(self.problem.agents))
        yield from self._drawn(probabilities)
        for state in states:
            initial_history = () if self.problem.partially_observable else (state.tobytes(),)
            yield from self._node(state, tuple(initial_history for _ in zeros), zeros, 0)

    def _drawn(self, probabilities: Reals) -> Iterator[str]:
        """Yield a chance node unless there is a single outcome."""
        if len(probabilities) > 1:
            branches = " ".join(
                f'"{n}" {probability!r}' for n, probability in enumerate(probabilities.tolist())
            )
            yield f'c "" {next(self._numbers)} "" {{ {branches} }} 0'

    def _node(self, state: Array, histories: Histories, returns: Reals, turn: int) -> Iterator[str]:
        """Yield the nodes after a turn: the choices of the agents, or a terminal node."""
        if turn == self.turns or self.problem.terminal(state[None])[0]:
            payoffs = " ".join(map(repr, returns.tolist()))
            yield f't "" {next(self._numbers)} "" {{ {payoffs} }}'
        else:
            yield from self._choices(state, histories, returns, turn, [])

    def _choices(
        self, state: Array, histories: Histories, returns: Reals, turn: int, chosen: list[int]
    ) -> Iterator[str]:
        """Yield the next agent's choices, hidden from the other agents, then the outcomes."""
        problem, seat = self.problem, len(chosen)
        if seat == len(problem.agents):
            yield from self._outcomes(state, histories, returns, turn, chosen)
            return
        set_number = self._sets[seat].setdefault(histories[seat], len(self._sets[seat]) + 1)
        names = " ".join(f'"{name}"' for name in problem.actions[seat].labels)
        yield f'p "" {seat + 1} {set_number} "{set_number}" {{ {names} }} 0'
        for action in range(problem.action_counts[seat]):
            yield from self._choices(state, histories, returns, turn, [*chosen, action])

    def _outcomes(
        self, state: Array, histories: Histories, returns: Reals, turn: int, chosen: list[int]
    ) -> Iterator[str]:
        problem, key = self.problem, (state.tobytes(), *chosen)
        if key not in self._cached_outcomes:
            _, probabilities, outcome = enumerate_possible_outcomes(
                problem, state[None], np.array([chosen])
            )
            self._cached_outcomes[key] = probabilities, [*zip(*outcome, strict=True)]
        probabilities, outcomes = self._cached_outcomes[key]
        yield from self._drawn(probabilities)
        for s2, rewards, observations in outcomes:
            updates = [
                (chosen[seat], int(observations[seat]))
                if problem.partially_observable
                else (*chosen, s2.tobytes())
                for seat in range(len(histories))
            ]
            next_histories = tuple(
                (*history, update) for history, update in zip(histories, updates, strict=True)
            )
            next_returns = returns + problem.discount**turn * rewards
            yield from self._node(s2, next_histories, next_returns, turn + 1)
