"""Who acts in each seat of simulated games: agents with memories of their own, or random play."""

from dataclasses import dataclass
from functools import cached_property, partial
from itertools import pairwise

import numpy as np

from dmplay.chance import Array, Reals
from dmplay.columns import joined
from dmplay.core import Memory, Outcome, Policy, Problem

Actors = tuple[Policy | None, ...]  # of each seat; None for any action, each as likely


@dataclass(frozen=True)
class Cast:
    """Those who act beside one seat, and in it where it does not choose for itself."""

    problem: Problem
    seat: int
    given: Actors = ()

    @cached_property
    def actors(self) -> Actors:
        """Who acts in each seat."""
        return self.given or (None,) * len(self.problem.agents)

    @cached_property
    def places(self) -> tuple[slice, ...]:
        """Which uniforms of a turn are whose: those of each seat, then nature's."""
        each = [1 if one is None else one.draws for one in self.actors]
        each[self.seat] = max(each[self.seat], 1)  # where it chooses they are its own
        ends = np.cumsum([0, *each, self.problem.draws.step]).tolist()
        return tuple(slice(a, b) for a, b in pairwise(ends))

    @property
    def draws(self) -> int:
        """How many uniforms a turn consumes."""
        return int(self.places[-1].stop)

    @cached_property
    def parts(self) -> list[slice]:
        """Where in what they remember, one after another, each actor's is."""
        ends = np.cumsum([0, *map(len, self.begun(some(self.problem)))]).tolist()
        return [slice(a, b) for a, b in pairwise(ends)]

    def split(self, memory: Memory) -> tuple[Memory, ...]:
        """What each actor remembers, of what all do."""
        return tuple(memory[part] for part in self.parts)

    def begun(self, s: Array) -> tuple[Memory, ...]:
        """What the actors remember before the first turn of games that begin so."""
        return tuple(
            () if actor is None else actor.begin(self.problem.first_sight(s, seat))
            for seat, actor in enumerate(self.actors)
        )

    def acted(self, s: Array, memories: tuple[Memory, ...], own: Array | None, u: Reals) -> Array:
        """Joint actions `[N, n]`: the seat's where they are given, else as its actor has it."""
        problem = self.problem
        legal = problem.legal(s)
        chosen: list[Array] = []
        for seat, actor in enumerate(self.actors):
            able = None if legal is None else legal[:, seat]
            now = u[:, self.places[seat]]
            if seat == self.seat and own is not None:
                column = own
                if able is not None and problem.action_counts[seat]:  # what unlike states share
                    fits = able[np.arange(len(own)), own]
                    column = np.where(fits, own, problem.actions[seat].draw(now[:, 0], able))
            elif actor is None:
                column = problem.actions[seat].draw(now[:, 0], able)
            else:
                column = actor.choose(memories[seat], able, now[:, : actor.draws])
            chosen.append(column)
        alone = len(chosen) == 1
        joint = chosen[0][:, None] if alone else joined(chosen, np.result_type(*chosen).type)
        if legal is not None and any(self.actors):
            for seat, waits in enumerate(problem.waiting(s).T):
                if waits.any():
                    joint[waits, seat] = problem.waits(seat)
        return joint

    def stepped(self, s: Array, joint: Array, u: Reals) -> Outcome:
        """What comes of joint actions."""
        return self.problem.step(s, joint, u[:, self.places[-1]])

    def told(
        self, memories: tuple[Memory, ...], joint: Array, outcome: Outcome
    ) -> tuple[Memory, ...]:
        """What the actors remember after a turn."""
        if not any(self.actors):
            return memories
        percept = partial(self.problem.percept, actions=joint, outcome=outcome)
        return tuple(
            () if actor is None else actor.update(memory, percept(seat))
            for seat, (actor, memory) in enumerate(zip(self.actors, memories, strict=True))
        )


def some(problem: Problem) -> Array:
    """Some start state `[1, ...]`."""
    return problem.start(np.zeros((1, problem.draws.start)))
