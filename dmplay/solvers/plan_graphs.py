"""Joint plans made better by turns: one agent's layer of nodes at a time, all else as it is.

Each node takes the action and the next nodes that are best where it is reached, beside what the
partners do; one that is not reached is made for some other case (alternating maximisation, as in
JESP, Nair et al., IJCAI 2003; on graphs of nodes: Pajarinen and Peltonen, NIPS 2011). The value
never falls, but it may stay at a plan that no agent alone can mend.
"""

from collections.abc import Iterator

import numpy as np

from dmplay.budget import ROUND, Budget
from dmplay.chance import Ints, Reals
from dmplay.dice import uniforms
from dmplay.solvers.team import Layer, Plan, Team, joined, nodes

SEED = 1
ENOUGH = 2  # sweeps in which nothing gets better
GAIN = 1e-9
CASES = 50  # of sweeps, at most


def drawn(team: Team, turns: int, width: int, number: int) -> tuple[Plan, ...]:
    """Plans of so many nodes a turn that do anything: of each number other ones."""
    plans = []
    for seat, (many, kinds) in enumerate(zip(team.actions, team.observations, strict=True)):
        u = uniforms(SEED, seat, number, first=0, rows=turns * width, count=1 + kinds)
        shaped = u.reshape(turns, width, 1 + kinds)
        actions, then = (many * shaped[:, :, 0]).astype(int), (width * shaped[:, :, 1:]).astype(int)
        then[-1] = 0
        plans.append(tuple(map(Layer, actions, then)))
    return tuple(plans)


def worth(team: Team, plans: tuple[Plan, ...], budget: Budget) -> float:
    """What agents with these plans earn."""
    return PlanGraph(team, plans, budget).value


def improved(team: Team, plans: tuple[Plan, ...], budget: Budget) -> tuple[Plan, ...]:
    """These plans, or better ones, as far as the budget goes."""
    graph = PlanGraph(team, plans, budget)
    still, best = 0, -np.inf
    with budget.to_its_end():
        for number in range(CASES):
            value = graph.sweep(number)
            still = 0 if value > best + GAIN else still + 1
            best = max(best, value)
            if still == ENOUGH:
                break
    return graph.plans


class PlanGraph:
    """The plans of all agents, turn by turn."""

    def __init__(self, team: Team, plans: tuple[Plan, ...], budget: Budget) -> None:
        self.team, self.budget, self.turns = team, budget, len(plans[0])
        self._layers = [list(layers) for layers in zip(*plans, strict=True)]

    @property
    def plans(self) -> tuple[Plan, ...]:
        """As they are now."""
        return tuple(tuple(plan) for plan in zip(*self._layers, strict=True))

    @property
    def value(self) -> float:
        """What they earn."""
        values: Reals = np.zeros((1, len(self.team.start)))
        for turn in reversed(range(self.turns)):
            values = self._before(turn, values)
        return float(values[0] @ self.team.start)

    def reached(self) -> list[Reals]:
        """How likely each joint node and state `[Q, S]` of each turn are, and what comes after."""
        found = [np.zeros((self._many(turn), len(self.team.start))) for turn in range(self.turns)]
        found.append(np.zeros((1, len(self.team.start))))
        found[0][0] = self.team.start
        for turn in range(self.turns):
            then = self._then(turn)
            for action, rows in self._rows(turn):
                came = self.team.onward(found[turn][rows], action)
                joint = came[:, :, None] * self.team.seen[action]
                np.add.at(found[turn + 1], then[rows], joint.swapaxes(1, 2))
        return found

    def sweep(self, number: int) -> float:
        """Makes each layer better, the last first; what the plans then earn."""
        reached, values = self.reached(), np.zeros((1, len(self.team.start)))
        for turn in reversed(range(self.turns)):
            for seat in range(len(self.team.actions)):
                self._settle(turn, seat, self._met(turn, seat, reached[turn], number), values)
            values = self._before(turn, values)
        return float(values[0] @ self.team.start)

    def action_values(self, seat: int) -> list[Reals]:
        """What each action `[K, A]` at an agent's nodes is worth beside the partners, by turn."""
        reached, values = self.reached(), np.zeros((1, len(self.team.start)))
        found: list[Reals] = []
        for turn in reversed(range(self.turns)):
            total, _ = self._weighed(turn, seat, reached[turn], values)
            own = nodes(self._counts(turn))[:, seat]
            mass = np.bincount(own, reached[turn].sum(axis=1), len(total))
            found.append(total / np.where(mass > 0, mass, 1.0)[:, None])
            values = self._before(turn, values)
        return found[::-1]

    def _counts(self, turn: int) -> tuple[int, ...]:
        """How many nodes each agent has; one when all is over."""
        if turn == self.turns:
            return (1,) * len(self.team.actions)
        return tuple(len(layer.actions) for layer in self._layers[turn])

    def _many(self, turn: int) -> int:
        return int(np.prod(self._counts(turn)))

    def _rows(self, turn: int, seat: int | None = None) -> Iterator[tuple[int, Ints]]:
        """Each joint action that is taken, and in which joint nodes; but for what a seat does."""
        each = nodes(self._counts(turn)).T
        chosen = [layer.actions[own] for layer, own in zip(self._layers[turn], each, strict=True)]
        if seat is not None:
            chosen[seat] = np.zeros_like(chosen[seat])
        actions = joined(chosen, self.team.actions)
        for action in np.unique(actions).tolist():
            rows = np.flatnonzero(actions == action)
            self.budget.spend(ROUND + 2.0 * len(rows) * self.team.work)
            yield action, rows

    def _then(self, turn: int) -> Ints:
        """The joint node `[Q, O]` to which a joint observation leads."""
        each, seen = nodes(self._counts(turn)).T, self.team.joint_observations.T
        steps = zip(self._layers[turn], each, seen, strict=True)
        return joined(
            [layer.then[own[:, None], o] for layer, own, o in steps], self._counts(turn + 1)
        )

    def _before(self, turn: int, values: Reals) -> Reals:
        """The values `[Q, S]` of a turn from those `[Q', S']` of the next."""
        found = np.empty((self._many(turn), len(self.team.start)))
        then = self._then(turn)
        for action, rows in self._rows(turn):
            ahead = (values[then[rows]] * self.team.seen[action].T).sum(axis=1)
            later = self.team.back(ahead, action)
            found[rows] = self.team.rewards[:, action] + self.team.discount * later
        return found

    def _met(self, turn: int, seat: int, reached: Reals, number: int) -> Reals:
        """The joint nodes and states that each node of an agent is made for."""
        counts = self._counts(turn)
        met = np.moveaxis(reached.reshape(*counts, -1), seat, 0).copy()
        idle = np.flatnonzero(~met.reshape(len(met), -1).any(axis=1))
        if len(idle):
            u = uniforms(SEED, turn, number, first=0, rows=len(idle), count=1 + reached.shape[1])
            others = met.reshape(len(met), -1, reached.shape[1])
            place = (others.shape[1] * u[:, 0]).astype(int)
            others[idle, place] = -np.log1p(-u[:, 1:]) * reached.sum(axis=0)
        return np.moveaxis(met, 0, seat).reshape(reached.shape)

    def _settle(self, turn: int, seat: int, met: Reals, values: Reals) -> None:
        """Gives an agent's nodes of a turn their best actions and next nodes."""
        total, then = self._weighed(turn, seat, met, values)
        actions = total.argmax(axis=1)
        self._layers[turn][seat] = Layer(actions, then[np.arange(len(actions)), actions])

    def _weighed(self, turn: int, seat: int, met: Reals, values: Reals) -> tuple[Reals, Ints]:
        """What each action `[K, A]` is worth where a node is met, and the best nodes next."""
        team, later = self.team, self._counts(turn + 1)
        own = nodes(self._counts(turn))[:, seat]
        many, kinds = team.actions[seat], team.observations[seat]
        paid = np.zeros((own.max() + 1, many))
        ahead = np.zeros((len(paid), many, kinds, later[seat]))
        values = np.moveaxis(values.reshape(*later, -1), seat, -1)  # [others' K', S', K']
        values = values.reshape(-1, len(team.start), later[seat])
        then = self._others_then(turn, seat)
        able = np.asarray(met.any(axis=1))
        for action, alike in self._rows(turn, seat):
            rows = alike[able[alike]]
            each = team.varied(action, seat)
            self.budget.spend(many * len(rows) * (ROUND + 2.0 * team.work))
            came = team.onward_each(met[rows], action, seat)
            seen = self._seen(each, seat)
            for place, row in enumerate(rows.tolist()):
                paid[own[row]] += met[row] @ team.rewards[:, each]
                joint = came[:, place, None, None] * seen
                flat = values[then[row]].reshape(-1, later[seat])
                score = joint.reshape(many * kinds, -1) @ flat
                ahead[own[row]] += score.reshape(many, kinds, -1)
        total = paid + team.discount * ahead.max(axis=3).sum(axis=2)
        return total, ahead.argmax(axis=3)

    def _seen(self, actions: list[int], seat: int) -> Reals:
        """How likely an agent and the others observe what they do `[A, O, R, S']`."""
        many, kinds = len(actions), self.team.observations[seat]
        seen = self.team.seen[actions].swapaxes(1, 2).reshape(many, *self.team.observations, -1)
        seen = np.moveaxis(seen, seat + 1, 1)
        return np.asarray(seen.reshape(many, kinds, -1, len(self.team.start)))

    def _others_then(self, turn: int, seat: int) -> Ints:
        """Where the others' observations lead them `[Q, R]`, jointly."""
        others = [other for other in range(len(self.team.actions)) if other != seat]
        seen = nodes([self.team.observations[other] for other in others]).T
        each, later = nodes(self._counts(turn)).T, self._counts(turn + 1)
        steps = [
            self._layers[turn][other].then[each[other][:, None], seen[k]]
            for k, other in enumerate(others)
        ]
        return joined(steps, tuple(later[other] for other in others))
