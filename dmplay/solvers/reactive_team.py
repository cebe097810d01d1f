"""Mixed rules from what a predator senses to where it goes, for a team of two that hunts (F.15).

Each in turn mixes what pays into its rule, by the natural gradient of what the team earns on
average from anywhere, while the other's rule stands (section 27.4). The gradient comes from the
values of all states and how often, discounted, each is met; both follow the rules by sweeps.
"""

from typing import NamedTuple

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.errors import BadParameter
from dmplay.problems.collaborative_predator_prey import (
    CAPTURED,
    MOVED,
    SENSES,
    CollaborativePredatorPrey,
)

LARGEST = 5000  # states
ROUNDS = 60
SWEEPS = 10  # of values and visits, a round: each goes on from the last
STEP = 1.0  # how much a move that is worth 1 more than the rule gains on it
LEAN = 0.2  # of the first rules
DIGITS = 4  # kept of a probability
TINY = 1e-12  # of a value that is left out


class Team(NamedTuple):
    """A rule for each predator, and what both earn."""

    rules: Reals  # [2, senses, 6]
    value: float  # mean over all states, where the first sense too is of the state


def team(problem: CollaborativePredatorPrey) -> Team:
    """The best of the rules that the gradient comes by from random moves: the first, those that
    seemed best and the last; `discount` below 1.
    """
    check(problem)
    hunt = _Hunt(problem)
    rules = _tilted()
    values: Reals = np.zeros(hunt.rewards.shape)
    visits: Reals = np.zeros(hunt.rewards.shape)
    tried, most = [rules.copy()], -np.inf
    for turn in range(ROUNDS):
        for seat in (0, 1):
            walks = [hunt.walks(rule) for rule in rules]
            for _ in range(SWEEPS):
                hunt.budget.spend(ROUND + 2 * hunt.sweep, (2 * turn + seat) / (2 * ROUNDS))
                values, visits = hunt.before(values, *walks), hunt.after(visits, *walks)
            worth = hunt.worth(seat, values, visits, walks[1 - seat])
            rules[seat] *= np.exp(STEP * (worth - worth.max(axis=1, keepdims=True)))
            rules[seat] /= rules[seat].sum(axis=1, keepdims=True)
        if values.mean() > most:  # about what the rules before these earn
            most, tried[1:] = values.mean(), [rules.copy()]
    return max((_measured(hunt, one) for one in [*tried, rules]), key=lambda team: team.value)


def _measured(hunt: "_Hunt", rules: Reals) -> Team:
    """A team of these rules, of a few digits, with what it earns."""
    rules = np.round(rules, DIGITS)
    rules /= rules.sum(axis=2, keepdims=True)
    return Team(rules, hunt.value(rules))


def check(problem: CollaborativePredatorPrey) -> None:
    """Refuses a hunt of other than two, of too many hexes, or without discount."""
    if problem.predators != 2 or problem.states > LARGEST:
        got = f"{problem.predators} predators in {problem.states} states"
        raise BadParameter(f"got {got}, expected 2 in at most {LARGEST}")
    if problem.discount >= 1.0:
        raise BadParameter("a hunt without end needs a discount below 1")


def paid(hunt: CollaborativePredatorPrey) -> Reals:
    """The reward `[i, j, p]` of each state."""
    size = len(hunt.hexes)
    caught = hunt.captured(hunt.enumerated()).reshape(size, size, size)
    return np.where(caught, CAPTURED, MOVED)


def _tilted() -> Reals:
    """Random moves but for a lean of each predator's own: where all directions are alike, chance
    alone would leave nothing to choose.
    """
    rules: Reals = np.ones((2, len(SENSES), 6))
    rules[0, :, 0] += LEAN
    rules[1, :, 1] += LEAN
    return np.asarray(rules / rules.sum(axis=2, keepdims=True))


class _Hunt:
    """The hunt of two as arrays over their hexes i and j and the prey's p."""

    def __init__(self, problem: CollaborativePredatorPrey) -> None:
        size = len(problem.hexes)
        self.budget = Budget("a reactive team", "try a smaller map or discount", 2e10)
        self.sweep = 20.0 * size**4  # operations of one
        states = problem.enumerated()
        self.discount = problem.discount
        self.ends = problem.walks  # [6, i, i']
        self.flights = problem.flights.reshape(size, size, size, size)  # [i, j, p, p']
        seen = problem.observe(states)[:, 0].reshape(size, size, size)[:, 0]
        self.sense: Ints = seen // (problem.observation_counts[0] // len(SENSES))  # [i, p]
        self.feeds = np.eye(size, dtype=bool)
        self.rewards = paid(problem)

    def walks(self, rule: Reals) -> Reals:
        """Where a predator with this rule goes `[p, i, i']`; on the prey it stays."""
        walked = np.einsum("ipa,air->pir", rule[self.sense], self.ends)
        return np.where(self.feeds[:, :, None], np.eye(len(self.feeds)), walked)

    def before(self, values: Reals, first: Reals, second: Reals) -> Reals:
        """The values `[i, j, p]` one turn earlier."""
        met = _over(second, _over(first, values[None]).swapaxes(1, 2)).swapaxes(1, 2)
        return np.asarray(
            self.rewards + self.discount * np.einsum("pijz,ijpz->ijp", met, self.flights)
        )

    def after(self, visits: Reals, first: Reals, second: Reals) -> Reals:
        """How often each state is met `[i, j, p]`, discounted, from visits that begin anywhere."""
        left = np.einsum("ijp,ijpz->pijz", visits, self.flights)
        back = first.swapaxes(1, 2), second.swapaxes(1, 2)
        moved = _over(back[1], _over(back[0], left).swapaxes(1, 2)).swapaxes(1, 2)
        return np.asarray(1.0 / visits.size + self.discount * moved.sum(axis=0))

    def worth(self, seat: int, values: Reals, visits: Reals, other: Reals) -> Reals:
        """What each move `[senses, 6]` is worth on average where a sense is had."""
        turned = (0, 1, 2) if seat == 0 else (1, 0, 2)
        values, visits = values.transpose(turned), visits.transpose(turned)
        flights = self.flights if seat == 0 else self.flights.swapaxes(0, 1)
        met = np.einsum("pjy,xyz->pjxz", other, values)
        left = np.einsum("ijp,ijpz->pijz", visits, flights)
        gain = self.discount * np.einsum("pijz,pjxz,aix->pia", left, met, self.ends, optimize=True)
        gain[self.feeds] = 0.0  # who feeds does not move
        often = np.where(self.feeds.T, 0.0, visits.sum(axis=1))
        worth = np.zeros((len(SENSES), len(self.ends)))
        for sense in range(len(SENSES)):
            here = self.sense == sense
            met_here = often[here].sum()
            if met_here > 0:
                worth[sense] = gain.swapaxes(0, 1)[here].sum(axis=0) / met_here
        return worth

    def value(self, rules: Reals) -> float:
        """What a team with these rules earns, on average from anywhere."""
        values: Reals = np.zeros(self.rewards.shape)
        walks = [self.walks(rule) for rule in rules]
        sweeps = int(np.ceil(np.log(TINY) / np.log(max(self.discount, TINY))))
        self.budget.expect(sweeps * (ROUND + self.sweep))
        for _ in range(sweeps):
            self.budget.spend(ROUND + self.sweep)
            values = self.before(values, *walks)
        return float(values.mean())


def _over(walks: Reals, values: Reals) -> Reals:
    """The mean of values `[p or 1, i', k, z]` over where walks `[p, i, i']` lead."""
    size = walks.shape[0]
    flat = values.reshape(values.shape[0], size, -1)
    return np.asarray(np.matmul(walks, flat).reshape(size, *values.shape[1:]))
