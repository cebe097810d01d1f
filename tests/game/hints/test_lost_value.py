"""Tests of the parts seeing, choosing and luck, against a computation of their own."""

import math
from typing import NamedTuple

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.arrays import Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.errors import BadParameter
from dmplay.game.hints.lost_value import GameParts, ValueMeter, compute_divergence

TURNS = 4
CARER = "multicaregiver-crying-baby"
ROUNDING = 1e-7


class Arrays(NamedTuple):
    """A POMDP of one agent: T[s, a, s'], R[s, a], O[a, s', o], the belief at the start, gamma."""

    transition: Reals
    rewards: Reals
    observation: Reals
    start: Reals
    discount: float

    def update(self, b: Reals, action: int, observation: int) -> Reals:
        joint = (b @ self.transition[:, action]) * self.observation[action, :, observation]
        return np.asarray(joint / joint.sum())

    def q(self, b: Reals, turns: int) -> Reals:
        """Return Q `[A]` of a belief by a tree of all actions and observations."""
        values = b @ self.rewards
        for action in range(len(values)) if turns > 1 else ():
            chances = b @ self.transition[:, action] @ self.observation[action]
            for observation in np.flatnonzero(chances > 1e-14):
                after = self.q(self.update(b, action, int(observation)), turns - 1)
                values[action] += self.discount * chances[observation] * after.max()
        return np.asarray(values)


def tabulate_alone(problem: Problem) -> Arrays:
    tables = dmplay.tabulate(problem)
    rewards, observation = tables.rewards[..., 0], tables.observation_model
    if rewards.ndim == 3:
        rewards = np.einsum("sat,sat->sa", tables.transition, rewards)
    session = dmplay.Session(problem, dmplay.SeededUniforms(0))
    start = session.view(0).belief
    return Arrays(tables.transition, rewards, observation, start, problem.discount)


def tabulate_with_partner(problem: Problem) -> Arrays:
    """Add the partner's last observation to the state; it feeds if it heard crying, else ignores.

    States are (nothing heard, crying, quiet) times the two of the baby.
    """
    tables = dmplay.tabulate(problem)
    transition, rewards = np.zeros((3, 2, 3, 3, 2)), np.zeros((3, 2, 3))
    observation = np.zeros((3, 3, 2, 2))
    for heard in range(3):
        for action in range(3):
            joint = 3 * action + (0 if heard == 1 else 2)
            rewards[heard, :, action] = tables.rewards[:, joint, 0]
            for crying in range(2):  # index 0 is crying, 1 quiet; both hear the same
                chances = tables.observation_model[joint, :, 3 * crying]
                transition[heard, :, action, 1 + crying] = tables.transition[:, joint] * chances
    observation[:, 1, :, 0] = observation[:, 2, :, 1] = observation[:, 0, :, 0] = 1.0
    start = np.array([0.5, 0.5, 0.0, 0.0, 0.0, 0.0])
    return Arrays(
        transition.reshape(6, 3, 6), rewards.reshape(6, 3), observation.reshape(3, 6, 2), start,
        problem.discount,
    )  # fmt: skip


def make_random_problem(seed: int) -> Problem:
    random = np.random.default_rng(seed)
    state_count, action_count, observation_count = random.integers(2, 4, size=3)
    rows = random.dirichlet(np.ones(state_count), (state_count, action_count))
    noise = random.dirichlet(np.ones(observation_count), (action_count, state_count))
    rewards = random.normal(size=(state_count, action_count, 1)).round(3)

    class RandomPomdp(dmplay.Tabular):
        """A POMDP of random probabilities and rewards."""

        actions = (dmplay.Labels(tuple(f"a{i}" for i in range(action_count))),)
        observations = (dmplay.Labels(tuple(f"o{i}" for i in range(observation_count))),)
        state_names = tuple(f"s{i}" for i in range(state_count))
        initial_belief = random.dirichlet(np.ones(state_count))
        tables = dmplay.Tables(rows, rewards, noise)
        discount, horizon = 0.9, TURNS

    return RandomPomdp()


CASES = [
    *("catch", "crying-baby", "machine-replacement", "bandit", CARER),
    *map(make_random_problem, range(10)),
]


def play_at_random(problem: Problem, seed: int) -> dmplay.Session:
    """Play random actions with random stated beliefs, beside the usual partner."""
    random = np.random.default_rng(seed)
    policies: list[Policy | None] = [None]
    if len(problem.agents) > 1:
        policies.append(dmplay.load_agent(problem, 1, "feed-when-crying"))
    session = dmplay.Session(problem, dmplay.SeededUniforms(seed), policies, turn_limit=TURNS)
    size = len(problem.enumerate_states())
    while not session.over:
        stated = {0: random.dirichlet(np.ones(size))}
        action = float(random.integers(problem.action_counts[0]))
        session.advance([action, *[None] * (len(policies) - 1)], stated_beliefs=stated)
    return session


def divide(session: dmplay.Session, *partners: str) -> GameParts:
    question = AdviceQuestion.of_session(session, 0, ("mcp", *partners) if partners else ())
    return ValueMeter(session.problem, question).divide_game(session)


@pytest.mark.parametrize("case", CASES, ids=str)
def test_the_parts_are_those_of_the_exact_beliefs_and_values(case: str | Problem) -> None:
    problem = dmplay.load_problem(case)
    is_team = case == CARER
    arrays = tabulate_with_partner(problem) if is_team else tabulate_alone(problem)
    for seed in range(3):
        session = play_at_random(problem, seed)
        parts = divide(session, *["feed-when-crying"] * is_team)
        b, total = arrays.start, 0.0
        assert parts.start_value[0] == pytest.approx(arrays.q(b, TURNS).max(), abs=ROUNDING)
        for index, (turn, part) in enumerate(zip(session.turns, parts.turns, strict=True)):
            left, action = TURNS - index, int(turn.actions[0])
            c = turn.stated_beliefs[0]
            exact = b.reshape(-1, len(c)).sum(axis=0)
            shares = b.reshape(-1, len(c)) / np.where(exact > 0, exact, 1.0)
            nodes = b.reshape(-1, len(c)).sum(axis=1, keepdims=True)
            stated = (np.where(exact > 0, shares, nodes) * c).reshape(-1)
            q, stated_q = arrays.q(b, left), arrays.q(stated, left)
            best_by_stated = float(np.mean(q[stated_q >= stated_q.max() - 1e-9]))
            b = arrays.update(b, action, int(turn.observations[0]))
            after = arrays.q(b, left - 1).max() if left > 1 else 0.0
            luck = turn.rewards[0] + problem.discount * after - q[action]
            seeing, choosing = q.max() - best_by_stated, best_by_stated - q[action]
            for got, expected in (
                (part.seeing, seeing), (part.choosing, choosing), (part.luck, luck),
                (part.regret, q.max() - q[action]),
                (part.stated_regret, stated_q.max() - stated_q[action]),
            ):  # fmt: skip
                assert got == pytest.approx((expected, expected), abs=ROUNDING)
            possible = exact > 0
            nats = np.sum(exact[possible] * np.log(exact[possible] / c[possible]))
            assert part.nats == pytest.approx(nats, abs=ROUNDING)
            total += problem.discount**index * (luck - seeing - choosing)
        value = parts.start_value[0] + total
        assert session.seat_return(0) == pytest.approx(value, abs=ROUNDING)


def test_a_player_that_sees_perfectly_and_chooses_at_random_loses_by_choosing() -> None:
    random = np.random.default_rng(0)
    session = dmplay.Session(
        dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(1), turn_limit=8
    )
    while not session.over:
        belief = session.view(0).belief
        session.advance([float(random.integers(3))], stated_beliefs={0: belief})
    for part in divide(session).turns:
        assert part.seeing == (0.0, 0.0)
        assert part.choosing == part.regret == pytest.approx(part.stated_regret)
        assert part.nats == pytest.approx(0.0, abs=ROUNDING)
    assert divide(session).sum_discounted("choosing")[0] > 0.0


def test_a_player_that_sees_wrongly_and_chooses_perfectly_loses_by_seeing() -> None:
    """It always believes that the baby is hungry, and does what is best then."""
    problem = dmplay.load_problem("crying-baby")
    session = dmplay.Session(problem, dmplay.SeededUniforms(1), turn_limit=8)
    while not session.over:
        left = 8 - len(session.turns)
        position = dmplay.Position.from_text(problem, belief="0.01 0.99", turns_left=left)
        action = problem.parse_action(0, position.best_actions()[0])
        session.advance([action], stated_beliefs={0: np.array([0.01, 0.99])})
    parts = divide(session)
    assert {part.choosing for part in parts.turns} == {(0.0, 0.0)}
    assert {part.stated_regret for part in parts.turns} == {(0.0, 0.0)}
    assert parts.sum_discounted("seeing")[0] > 0.0


def test_without_a_stated_belief_and_in_visible_problems_all_loss_is_choosing() -> None:
    for name, turns in (("crying-baby", 5), ("hexworld", 5)):
        session = dmplay.Session(
            dmplay.load_problem(name), dmplay.SeededUniforms(3), turn_limit=turns
        )
        while not session.over:
            session.advance([1.0])
        parts = divide(session)
        assert all(part.seeing == (0.0, 0.0) and part.nats is None for part in parts.turns)
        parts_sum = sum(
            part.luck[0] * parts.discount**index - part.choosing[0] * parts.discount**index
            for index, part in enumerate(parts.turns)
        )
        value = parts.start_value[0] + parts_sum
        assert session.seat_return(0) == pytest.approx(value, abs=ROUNDING)


def test_bounded_values_bound_the_parts() -> None:
    problem = dmplay.load_problem("collaborative-predator-prey")
    partner = dmplay.load_agent(problem, 1, "sweep")
    session = dmplay.Session(problem, dmplay.SeededUniforms(1), [None, partner], turn_limit=6)
    size = len(problem.enumerate_states())
    while not session.over:
        session.advance([0.0, None], stated_beliefs={0: np.full(size, 1 / size)})
    parts = divide(session, "sweep")
    low, high = parts.start_value
    for name, sign in (("luck", 1), ("seeing", -1), ("choosing", -1)):
        bounds = sorted(sign * bound for bound in parts.sum_discounted(name))
        low, high = low + bounds[0], high + bounds[1]
    assert parts.start_value[0] < parts.start_value[1]
    assert low <= session.seat_return(0) <= high
    assert all(0.0 <= part.seeing[0] <= part.seeing[1] for part in parts.turns)


@pytest.mark.parametrize("name", ["mountain-car", "2048"])
def test_values_that_are_no_bounds_have_no_parts(name: str) -> None:
    problem = dmplay.load_problem(name)
    agent = dmplay.load_agent(problem, 0, "random")
    session = dmplay.Session(problem, dmplay.SeededUniforms(1), [agent], turn_limit=3)
    while not session.over:
        session.advance()
    with pytest.raises(BadParameter):
        divide(session)


def test_a_game_that_was_left_has_no_parts() -> None:
    session = dmplay.Session(dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(1))
    session.advance([0.0])
    session.end("quit")
    with pytest.raises(BadParameter, match="not finished"):
        divide(session)


def test_a_possible_state_that_is_stated_as_impossible_costs_infinite_nats() -> None:
    assert compute_divergence(np.array([0.5, 0.5]), np.array([1.0, 0.0])) == math.inf
    assert compute_divergence(np.array([1.0, 0.0]), np.array([0.5, 0.5])) == pytest.approx(
        math.log(2)
    )
