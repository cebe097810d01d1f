"""The values of actions by trying all of them: all events, all replies, all later turns.

It reads the problem's dynamics and the other players' policies, and no solver.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.arrays import Array
from dmplay.core.policy import Memory, Policy
from dmplay.core.problem import Outcome, Problem, build_percept, enumerate_possible_outcomes
from dmplay.core.session import Session


class Particle(NamedTuple):
    """A possible state, with the memories of the other players."""

    weight: float
    state: Array
    memories: tuple[Memory, ...]  # of each seat, () of the own one


class ExhaustiveValues:
    """The values of a seat's actions with so many turns left, computed and remembered."""

    def __init__(self, problem: Problem, seat: int, policies: Sequence[Policy | None]) -> None:
        self.problem, self.seat, self.policies = problem, seat, policies
        self._cache: dict[object, dict[str, float]] = {}

    def compute_values(self, session: Session) -> dict[str, float]:
        """Return the value of each legal action in the game of a session, which has a turn limit.

        The beliefs of the player are computed again from the player's own history.
        """
        assert session.turn_limit is not None
        return self.evaluate(self.replay(session), session.turn_limit - len(session.turns))

    def evaluate(self, particles: list[Particle], turns_left: int) -> dict[str, float]:
        """Return the value of each legal action."""
        key = turns_left, self._describe(particles)
        if key not in self._cache:
            legal = self.problem.legal_actions_mask(particles[0].state[None])
            labels = self.problem.actions[self.seat].labels
            self._cache[key] = {
                label: self._value_of(particles, action, turns_left)
                for action, label in enumerate(labels)
                if legal is None or legal[0, self.seat, action]
            }
        return self._cache[key]

    def _value_of(self, particles: list[Particle], action: int, turns_left: int) -> float:
        """Return the expected reward of an action plus the discounted value after it."""
        total = 0.0
        for reward, later in self.expand(particles, action).values():
            total += reward
            is_over = self.problem.terminal(np.array([p.state for p in later])).all()
            if turns_left > 1 and not is_over:
                best = max(self.evaluate(later, turns_left - 1).values())
                total += self.problem.discount * self._total(later) * best
        return total

    @staticmethod
    def _total(particles: list[Particle]) -> float:
        """Return the sum of the weights."""
        return sum(particle.weight for particle in particles)

    def expand(
        self, particles: list[Particle], action: int
    ) -> dict[object, tuple[float, list[Particle]]]:
        """Return the part of the reward and the next particles, by what the player perceives."""
        result: dict[object, tuple[float, list[Particle]]] = {}
        total = self._total(particles)
        for particle in particles:
            for weight, joint in self._list_replies(particle, action):
                self._add_outcomes(result, particle, weight / total, joint)
        return result

    def _list_replies(self, particle: Particle, action: int) -> list[tuple[float, list[int]]]:
        """Return the joint actions with this own action, each with its weight."""
        joints = [(particle.weight, [0] * len(self.policies))]
        legal = self.problem.legal_actions_mask(particle.state[None])
        for seat, policy in enumerate(self.policies):
            if seat == self.seat:
                options = [(1.0, action)]
            else:
                assert policy is not None
                row = policy.choice_probabilities(particle.memories[seat])  # type: ignore[attr-defined]
                chances = row[0] * (1.0 if legal is None else legal[0, seat])
                options = [(p / chances.sum(), a) for a, p in enumerate(chances) if p > 0]
            joints = [
                (weight * p, [*joint[:seat], a, *joint[seat + 1 :]])
                for weight, joint in joints
                for p, a in options
            ]
        return joints

    def _add_outcomes(
        self,
        result: dict[object, tuple[float, list[Particle]]],
        particle: Particle,
        weight: float,
        joint: list[int],
    ) -> None:
        """Add the outcomes of a joint action to those that the player perceives alike."""
        problem, actions = self.problem, np.array([joint])
        _, p, outcome = enumerate_possible_outcomes(problem, particle.state[None], actions)
        for event, chance in enumerate(p):
            row = Outcome(*(array[event : event + 1] for array in outcome))
            memories = tuple(
                ()
                if policy is None
                else policy.update_memory(memory, build_percept(problem, seat, actions, row))
                for seat, (policy, memory) in enumerate(
                    zip(self.policies, particle.memories, strict=True)
                )
            )
            percept: object = (problem.format_state(row.state[0]), *joint)
            if problem.partially_observable:
                percept = int(row.observations[0, self.seat])
            reward, later = result.get(percept, (0.0, []))
            reward += weight * chance * float(row.rewards[0, self.seat])
            result[percept] = reward, [*later, Particle(weight * chance, row.state[0], memories)]

    def _describe(self, particles: list[Particle]) -> object:
        """Return a key that is equal for equal beliefs."""
        total = self._total(particles)
        weights: dict[object, float] = {}
        for particle in particles:
            memories = tuple(a.tobytes() for memory in particle.memories for a in memory)
            key = self.problem.format_state(particle.state), memories
            weights[key] = weights.get(key, 0.0) + particle.weight / total
        return tuple(sorted((key, round(weight, 10)) for key, weight in weights.items()))

    def replay(self, session: Session) -> list[Particle]:
        """Return the particles after the history of the player's seat."""
        problem = self.problem
        start = session.initial_state
        states = problem.enumerate_states() if problem.partially_observable else start[None]
        weights = session.view(self.seat).beliefs[0] if problem.partially_observable else [1.0]  # type: ignore[index]
        particles = [
            Particle(float(weight), state, self._start_memories(state))
            for weight, state in zip(weights, states, strict=True)
            if weight > 0
        ]
        for turn in session.turns:
            percept: object = (problem.format_state(turn.state), *map(int, turn.actions))
            if problem.partially_observable:
                percept = int(turn.observations[self.seat])
            _, particles = self.expand(particles, int(turn.actions[self.seat]))[percept]
        return particles

    def _start_memories(self, state: Array) -> tuple[Memory, ...]:
        """Return the memories of the other players at the start."""
        observations = (
            self.problem.initial_observations(state[None])[0]
            if self.problem.partially_observable
            else [state] * len(self.policies)
        )
        return tuple(
            () if policy is None else policy.initial_memory(np.asarray(observation)[None])
            for policy, observation in zip(self.policies, observations, strict=True)
        )
