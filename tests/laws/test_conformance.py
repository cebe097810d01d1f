"""The laws of every built-in problem and variant, those to come included."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import fields, replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import dmplay
from dmplay.chance import Array, Bools, Chance, Normal, Reals, Span, sample
from dmplay.core import Interval, Memory, Outcome, Percept, Policy, Problem, exact, exact_start
from dmplay.dice import Dice
from dmplay.errors import BadParameter, BadPolicy, IllegalAction, UnknownName
from dmplay.finding import agents
from dmplay.rollouts import rollout
from dmplay.session import Session, View
from dmplay.tabular import tabulate
from tests.support.brought import Heap, Key
from tests.support.cases import (
    ROWS,
    SEED,
    anything,
    draws,
    every_problem,
    frozen,
    load,
    random_play,
    same,
    small,
)
from tests.support.twins import Told, Twins, twins

MANY = 5003  # turns from one state, to count what comes of them
WALK = 12  # turns of random play behind the states of a pool
FEW_STATES = 300  # tabulated by the laws on arrays
SOME = 4  # turns of a session
LAST = 0.999999999  # the greatest draw
BRIEF = {"search": "search:simulations=6,depth=3"}  # agents that take their time, for the laws
FOREIGN = {"axelrod"}  # a package that takes long to load: it has tests of its own
SIZES = (1, 2, 3, 4, 5, 7, 8, 9, 15, 16, 17, 31, 33, 64, 100, 257, 1000, 4099, ROWS)

few_examples = settings(max_examples=25)
pytestmark = pytest.mark.usefixtures("coarse")


class Pool(NamedTuple):
    """Turns that random play comes to, write-protected."""

    opening: Reals  # [B, draws.start]
    s: Array  # [B, ...]
    a: Array  # [B, n], any actions
    u: Reals  # [B, draws.step], the least and the greatest draws among them


@cache
def pool(name: str) -> Pool:
    """Row r is what the r-th game is at after r % WALK turns."""
    problem = load(name)
    opening = draws(problem.draws.start, turn=0)
    opening[0], opening[1] = 0.0, LAST
    s = problem.start(opening)
    states = s.copy()
    for turn in range(1, WALK):
        s = problem.step(s, anything(problem, s, turn), draws(problem.draws.step, turn)).state
        here = np.arange(ROWS) % WALK == turn
        states[here] = s[here]
    u = draws(problem.draws.step, WALK)
    u[::100], u[1::100] = 0.0, LAST
    return Pool(*frozen(opening, states, anything(problem, None, WALK), u))


def strided(array: Array) -> Array:
    """The same values with gaps between them."""
    wide = np.zeros((*array.shape, 2), array.dtype)
    wide[..., 0] = array
    return frozen(wide)[0][..., 0]


def parts(values: Iterable[Array], rows: slice) -> tuple[Array, ...]:
    return tuple(value[rows] for value in values)


def everything(problem: Problem, found: Pool) -> tuple[Array, ...]:
    """All that a problem computes from a batch, each with the row as its first axis."""
    starts = problem.start(found.opening)
    outcome = problem.step(found.s, found.a, found.u)
    legal = problem.legal(found.s)
    known = () if legal is None else (legal,)
    if isinstance(problem.states, int):
        known = (*known, np.asarray(problem.index(found.s)))
    return (starts, *outcome, problem.terminal(found.s), *known)


@cache
def whole(name: str) -> tuple[Array, ...]:
    return everything(load(name), pool(name))


@every_problem
@few_examples
@given(first=st.integers(0, ROWS - 1), size=st.sampled_from(SIZES), gaps=st.booleans())
def test_a_row_has_the_same_bits_in_any_batch(name: str, first: int, size: int, gaps: bool) -> None:
    rows = slice(min(first, ROWS - size), min(first, ROWS - size) + size)
    found = Pool(*(strided(part[rows]) if gaps else part[rows] for part in pool(name)))
    assert same(everything(load(name), found), parts(whole(name), rows))


@every_problem
def test_each_of_the_first_rows_alone_has_the_same_bits(name: str) -> None:
    for row in range(3 * WALK):
        alone = slice(row, row + 1)
        found = Pool(*parts(pool(name), alone))
        assert same(everything(load(name), found), parts(whole(name), alone))


@every_problem
def test_the_same_draws_give_the_same_outcome(name: str) -> None:
    found = Pool(*(part.copy() for part in pool(name)))
    assert same(everything(load(name), found), whole(name))
    assert same(found, pool(name))  # and nothing was written into
    assert same(everything(replace(load(name)), found), whole(name))


@every_problem
def test_a_step_is_the_move_of_the_sampled_events(name: str) -> None:
    problem, (opening, s, a, u) = load(name), pool(name)
    events = sample(problem.opening(ROWS), opening)
    assert same(problem.place(ROWS, events), problem.start(opening))
    moved = problem.move(s, a, sample(problem.chance(s, a), u))
    assert same(tuple(moved), tuple(problem.step(s, a, u)))


@every_problem
def test_outcomes_have_the_shapes_and_ranges_that_the_problem_states(name: str) -> None:
    problem, (_, s, a, u) = load(name), pool(name)
    agents = len(problem.agents)
    outcome = problem.step(s, a, u)
    assert sum(chance.draws for chance in problem.chance(s, a)) == problem.draws.step
    assert outcome.state.shape == s.shape
    assert outcome.state.dtype == s.dtype
    assert outcome.rewards.shape == (ROWS, agents)
    assert outcome.rewards.dtype == float
    assert np.isfinite(outcome.rewards).all()
    if problem.shared_reward:
        assert (outcome.rewards == outcome.rewards[:, :1]).all()
    if not problem.hidden:
        assert same(outcome.observations, outcome.state)
        return
    assert outcome.observations.shape == (ROWS, agents)
    for seat, labels in enumerate(problem.observations):
        seen = outcome.observations[:, seat]
        assert ((seen >= 0) & (seen < len(labels))).all()


def lists(chances: Iterable[Chance]) -> bool:
    """Whether the outcomes of these can be listed."""
    return not any(isinstance(chance, Span | Normal) for chance in chances)


def keys(*arrays: Array) -> list[bytes]:
    """Each row as bytes, -0.0 as 0.0."""
    flat = [np.ascontiguousarray(part + 0).reshape(len(part), -1) for part in arrays]
    return [row.tobytes() for row in np.hstack([part.view(np.uint8) for part in flat])]


def odd(counts: Sequence[float], expected: Sequence[float]) -> float:
    """How many standard deviations Pearson's statistic is too large (Wilson and Hilferty)."""
    order = np.argsort(expected)
    met, due = np.array(counts, float)[order], np.array(expected)[order]
    rare = int(np.searchsorted(np.cumsum(due), 10.0)) + 1  # pooled into one cell
    met = np.append(met[rare:], met[:rare].sum())
    due = np.append(due[rare:], due[:rare].sum())
    freedom = len(due) - 1
    if freedom == 0:
        return 0.0
    spread = 2 / (9 * freedom)
    statistic = ((met - due) ** 2 / due).sum()
    return float(((statistic / freedom) ** (1 / 3) - (1 - spread)) / math.sqrt(spread))


def follows(met: list[bytes], p: Reals, listed: list[bytes]) -> None:
    """Sampled keys occur as often as the listed probabilities say, and no others do."""
    expected: dict[bytes, float] = {}
    for weight, key in zip(p, listed, strict=True):
        if weight > 0:
            expected[key] = expected.get(key, 0.0) + weight * len(met)
    counts = dict.fromkeys(expected, 0)
    for key in met:
        assert key in counts, "an outcome of probability 0 came up"
        counts[key] += 1
    assert odd(list(counts.values()), list(expected.values())) < 4.5


def cumulative(chance: Span | Normal, x: Array) -> Reals:
    if isinstance(chance, Span):
        return np.asarray((x - chance.low[0]) / (chance.high[0] - chance.low[0]))
    scaled = (x - chance.mean[0]) / (chance.deviation[0] * math.sqrt(2))
    return np.array([(1 + math.erf(one)) / 2 for one in scaled])


def spreads(chance: Chance, u: Reals) -> None:
    """The events of one chance, the same in every row, have its distribution."""
    events = np.sort(np.asarray(chance.sample(u)))
    if not isinstance(chance, Span | Normal):
        p = chance.probabilities()[0]
        assert odd(np.bincount(events, minlength=len(p)).tolist(), (p * len(u)).tolist()) < 4.5
        return
    width = chance.high - chance.low if isinstance(chance, Span) else chance.deviation
    if width[0] == 0:
        assert (events == events[0]).all()
        return
    # Kolmogorov and Smirnov: 2.2 is passed by one in eight thousand.
    rank = np.arange(len(u) + 1) / len(u)
    under = cumulative(chance, events)
    gap = np.maximum(under - rank[:-1], rank[1:] - under).max()
    assert gap * math.sqrt(len(u)) < 2.2


def each_spreads(chances: tuple[Chance, ...], u: Reals) -> None:
    at = 0
    for chance in chances:
        spreads(chance, u[:, at : at + chance.draws])
        at += chance.draws
    assert at == u.shape[1]


@every_problem
def test_starts_come_up_as_often_as_they_should(name: str) -> None:
    problem = load(name)
    u = draws(problem.draws.start, turn=1000, rows=MANY)
    if not lists(problem.opening(1)):
        each_spreads(problem.opening(MANY), u)
        return
    p, states = exact_start(problem)
    assert p.sum() == pytest.approx(1, abs=1e-12)
    follows(keys(problem.start(u)), p, keys(states))


@every_problem
@pytest.mark.parametrize("row", [WALK - 1, WALK, 2 * WALK + 5])
def test_outcomes_come_up_as_often_as_they_should(name: str, row: int) -> None:
    problem, found = load(name), pool(name)
    s, a = found.s[row : row + 1], found.a[row : row + 1]
    u = draws(problem.draws.step, turn=1000 + row, rows=MANY)
    many, acts = np.repeat(s, MANY, axis=0), np.repeat(a, MANY, axis=0)
    if not lists(problem.chance(s, a)):
        each_spreads(problem.chance(many, acts), u)
        return
    listed = exact(problem, s, a)
    follows(
        keys(*problem.step(many, acts, u)),
        listed.probabilities[0],
        keys(*(part[0] for part in listed.outcome)),
    )


@every_problem
def test_the_least_and_the_greatest_draw_give_outcomes_that_can_happen(name: str) -> None:
    problem, found = load(name), pool(name)
    for row in (0, 1, 100, 101):
        s, a = found.s[row : row + 1], found.a[row : row + 1]
        outcome = problem.step(s, a, found.u[row : row + 1])
        if lists(problem.chance(s, a)):
            listed = exact(problem, s, a)
            possible = listed.probabilities[0] > 0
            assert keys(*outcome)[0] in keys(*(part[0][possible] for part in listed.outcome))
        else:
            assert np.isfinite(outcome.state).all()


@every_problem
def test_probabilities_sum_to_one(name: str) -> None:
    problem, found = load(name), pool(name)
    s, a = found.s[:24], found.a[:24]
    if lists(problem.chance(s, a)):
        p = exact(problem, s, a).probabilities
        assert (p >= -1e-15).all()
        np.testing.assert_allclose(p.sum(axis=1), 1, atol=1e-12)
    if isinstance(problem.states, int) and problem.states <= FEW_STATES:
        tables = tabulate(problem)
        np.testing.assert_allclose(tables.transition.sum(axis=2), 1, atol=1e-12)
        assert (tables.transition >= -1e-15).all()
        if tables.observation is not None:
            np.testing.assert_allclose(tables.observation.sum(axis=2), 1, atol=1e-12)
            assert (tables.observation >= -1e-15).all()


@every_problem
def test_the_tables_are_what_the_outcomes_amount_to(name: str) -> None:
    problem, s = load(name), pool(name).s[:24]
    if isinstance(problem.states, int) and problem.states <= FEW_STATES:
        amounts_to(problem, s, anything(problem, s, WALK, len(s)))


@pytest.mark.parametrize("problem", [Key(), Heap()])
def test_the_tables_are_what_the_outcomes_of_legal_actions_amount_to(problem: Problem) -> None:
    s, a = np.nonzero(allowed(problem)[:, 0])
    amounts_to(problem, problem.enumerated()[s], a[:, None])


@pytest.mark.parametrize("problem", [Key(), Heap()])
def test_an_action_that_is_not_legal_stands_in_the_tables_for_the_first_that_is(
    problem: Problem,
) -> None:
    transition, rewards, _ = tabulate(problem)
    closed = np.argwhere(~allowed(problem)[:, 0])
    assert len(closed)
    for s, a in closed:
        first = int(np.flatnonzero(allowed(problem)[s, 0])[0])
        assert transition[s, a].tolist() == transition[s, first].tolist()
        assert rewards[s, a] == rewards[s, first]


def allowed(problem: Problem) -> Bools:
    """What every state of a problem that forbids something allows `[S, n, A]`."""
    legal = problem.legal(problem.enumerated())
    assert legal is not None
    return legal


def amounts_to(problem: Problem, s: Array, a: Array) -> None:
    """The rows of the tables for these turns are sums over the listed outcomes."""
    tables = tabulate(problem)
    p, outcome = exact(problem, s, a)
    joint = np.ravel_multi_index(tuple(a.T), [len(labels) for labels in problem.actions])
    rewards = (p[:, :, None] * outcome.rewards).sum(axis=1)
    np.testing.assert_allclose(tables.rewards[problem.index(s), joint], rewards, atol=1e-12)
    for row, transition in enumerate(tables.transition[problem.index(s), joint]):
        reached = np.bincount(problem.index(outcome.state[row]), p[row], len(transition))
        np.testing.assert_allclose(transition, reached, atol=1e-12)


@every_problem
def test_a_belief_is_carried_as_the_listed_outcomes_say(name: str) -> None:
    problem, found = load(name), pool(name)
    if not problem.hidden or not isinstance(problem.states, int):
        return
    belief = np.bincount(problem.index(found.s[::700]), minlength=problem.states) / 29
    agents = len(problem.agents)
    for seat, labels in enumerate(problem.observations):
        action: list[int | None] = [None] * agents
        action[seat] = int(found.a[seat, seat])
        for kind in (0, len(labels) - 1):
            observation: list[int | None] = [None] * agents
            observation[seat] = kind
            for actions, seen in ((action, observation), (action, [None] * agents)):
                told = problem.carry(belief, actions, seen)
                listed = Problem.carry(problem, belief, actions, seen)
                np.testing.assert_allclose(told, listed, atol=1e-15)
    everyone: list[int | None] = [int(a) for a in found.a[0]]
    told = problem.carry(belief, everyone, [None] * agents)
    np.testing.assert_allclose(told.sum(), 1, atol=1e-12)


def made(problem: Problem, seat: int, agent: str) -> Policy | None:
    """The agent of this name, or None where it refuses the seat."""
    try:
        return dmplay.agent(problem, seat, BRIEF.get(agent, agent))
    except (BadPolicy, BadParameter, UnknownName):
        return None


@cache
def seated(name: str) -> list[tuple[int, list[Policy]]]:
    """Each built-in agent in each seat that it fits, random play in the others."""
    problem = small(name)
    found: list[tuple[int, list[Policy]]] = []
    for agent in agents.roster(problem).agents:
        if agent in FOREIGN:
            continue
        before = len(found)
        for seat in range(len(problem.agents)):
            policy = made(problem, seat, agent)
            if policy is not None:
                others = random_play(problem)
                others[seat] = policy
                found.append((seat, others))
        assert len(found) > before, f"{agent} fits no seat"
    return found


@every_problem
def test_an_agent_says_what_it_does_and_what_its_parameters_mean(name: str) -> None:
    for agent, make in agents.roster(load(name)).agents.items():
        assert (make.__doc__ or "").strip(), agent
        assert all(agents.meanings(make).values()), agent


@cache
def final_states(name: str) -> Array:
    """States at the end of long games: of random play or, where none ends, of the other agents."""
    problem = load(name)
    found = []
    for policies in (random_play(problem), *(policies for _, policies in seated(name))):
        played = rollout(problem, policies, episodes=100, turns=300, seed=SEED)
        found.append(played.state)
        if played.over.any() or type(problem).terminal is Problem.terminal:
            break
    return np.concatenate(found)


@every_problem
def test_notation_and_parse_are_inverse(name: str) -> None:
    problem = load(name)
    for s in (*pool(name).s[:100], *final_states(name)[:50]):
        text = problem.notation(s)
        assert text == text.strip()
        assert len(text.splitlines()) == 1
        again = problem.parse(text)
        assert again.shape == s.shape
        assert np.array_equal(again, s)
        assert problem.notation(again) == text


@every_problem
def test_index_and_enumerated_are_inverse(name: str) -> None:
    problem, s = load(name), pool(name).s
    if not isinstance(problem.states, int):
        with pytest.raises(BadParameter):
            problem.enumerated()
        return
    states = problem.enumerated()
    assert np.array_equal(problem.index(states), np.arange(problem.states))
    assert np.array_equal(states[problem.index(s)], s)


@every_problem
def test_a_terminal_state_absorbs_and_pays_nothing(name: str) -> None:
    problem = load(name)
    known = final_states(name)
    if isinstance(problem.states, int):
        known = np.concatenate([known, problem.enumerated()])
    ends = frozen(known[problem.terminal(known)])[0]
    if type(problem).terminal is not Problem.terminal:
        assert len(ends), "no agent came to a terminal state"
    for turn in range(SOME):
        a = anything(problem, None, turn, len(ends))
        moved, rewards, _ = problem.step(ends, a, draws(problem.draws.step, turn, len(ends)))
        assert same(moved, ends)
        assert (rewards == 0).all()
        assert problem.terminal(moved).all()


def outside(actions: Interval | Sequence[str]) -> tuple[float, ...]:
    if isinstance(actions, Interval):
        return (actions.low - 1e-6, actions.high + 1e-6, math.nan, math.inf)
    return (-1, len(actions), 0.5, math.nan)


@every_problem
def test_an_illegal_action_is_refused_and_changes_nothing(name: str) -> None:
    problem = load(name)
    agents = random_play(problem)
    session, other = (Session(problem, Dice(SEED), agents, limit=99) for _ in range(2))
    for _ in range(SOME):
        if session.over:
            break
        before = [session.view(seat) for seat in range(len(agents))]
        for seat in range(len(agents)):
            legal = session.legal(seat)
            closed = () if legal is None else tuple(map(float, np.flatnonzero(~legal)))
            for bad in (*outside(problem.actions[seat]), *closed):
                joint: list[float | None] = [None] * len(agents)
                joint[seat] = bad
                with pytest.raises(IllegalAction, match=f"turn {len(session.turns) + 1}"):
                    session.advance(joint)
        assert same([session.view(seat) for seat in range(len(agents))], before)
        assert same(session.advance(), other.advance())


@every_problem
def test_undo_then_the_same_actions_give_the_same_turns(name: str) -> None:
    problem = small(name)
    for _, policies in seated(name):
        session = Session(problem, Dice(SEED, 3), policies, limit=SOME)
        views = []
        while not session.over:
            views.append([session.view(seat) for seat in range(len(policies))])
            session.advance()
        played, returns = list(session.turns), session.returns()
        assert played
        for back in {1, len(played)}:
            taken = session.undo(back)
            assert same(taken, played[-back:])
            now = [session.view(seat) for seat in range(len(policies))]
            assert same(now, views[len(played) - back])
            assert same(session.choices(), list(map(float, taken[0].actions)))
            for turn in taken:
                assert same(session.advance(list(turn.actions)), turn)
        assert same(session.returns(), returns)


@every_problem
def test_a_session_is_a_row_of_the_rollout(name: str) -> None:
    problem = small(name)
    for _, policies in seated(name):
        many = rollout(problem, policies, episodes=4, turns=SOME, seed=SEED, first=2)
        for row in (0, 3):
            session = Session(problem, Dice(SEED, 2 + row), policies, limit=SOME)
            while not session.over:
                session.advance()
            assert same(session.state, np.asarray(many.state[row]))
            assert same(session.returns(), many.returns[row])
            assert same(session.totals(), many.totals[row])
            assert len(session.turns) == many.turns[row]
            assert (session.ending == "terminal") == many.over[row]


class Asked(NamedTuple):
    """One choice of a policy over a batch, and what it rested on."""

    memory: Memory
    legal: Bools | None
    u: Reals
    chosen: Array
    values: Reals | None


def asked(policy: Policy, memory: Memory, legal: Bools | None, u: Reals) -> Asked:
    return Asked(memory, legal, u, policy.choose(memory, legal, u), policy.values(memory))


def course(problem: Problem, seat: int, policies: list[Policy], rows: int) -> list[Asked]:
    """What a seat's policy is asked in the first turns of a batch of games."""
    s = problem.start(draws(problem.draws.start, 0, rows))
    memories = [policy.begin(problem.first_sight(s)) for policy in policies]
    found = []
    for turn in range(1, SOME):
        going = ~problem.terminal(s)
        s = frozen(s[going])[0]
        memories = [frozen(*(part[going] for part in memory)) for memory in memories]
        if not len(s):
            break
        legal = problem.legal(s)
        asks = []
        for i, (policy, memory) in enumerate(zip(policies, memories, strict=True)):
            u = frozen(draws(policy.draws, turn, len(s), 1 + i))[0]
            asks.append(asked(policy, memory, None if legal is None else legal[:, i], u))
        found.append(asks[seat])
        a = np.stack([ask.chosen for ask in asks], axis=1)
        outcome = problem.step(s, a, draws(problem.draws.step, turn, len(s)))
        learnt = percepts(problem, a, outcome)
        memories = [
            policy.update(memory, percept)
            for policy, memory, percept in zip(policies, memories, learnt, strict=True)
        ]
        one = slice(0, 1)
        alone = policies[seat].update(parts(asks[seat].memory, one), row_of(learnt[seat], one))
        assert same(alone, parts(memories[seat], one))
        s = outcome.state
    return found


def row_of(percept: Percept, rows: slice) -> Percept:
    action, observation, actions, reward = percept
    return Percept(
        action[rows],
        observation[rows],
        None if actions is None else actions[rows],
        None if reward is None else reward[rows],
    )


def percepts(problem: Problem, a: Array, outcome: Outcome) -> list[Percept]:
    return [problem.percept(seat, a, outcome) for seat in range(len(problem.agents))]


@every_problem
def test_policies_choose_legal_actions_the_same_alone_as_in_a_batch(name: str) -> None:
    problem = small(name)
    for seat, policies in seated(name):
        policy, known = policies[seat], problem.actions[seat]
        for ask in course(problem, seat, policies, 23):
            rows = len(ask.u)
            assert isinstance(ask.memory, tuple)
            assert all(len(part) == rows for part in ask.memory)
            assert ask.chosen.shape == (rows,)
            if isinstance(known, Interval):
                assert ((ask.chosen >= known.low) & (ask.chosen <= known.high)).all()
            else:
                assert ask.chosen.dtype.kind in "iu"
                assert ((ask.chosen >= 0) & (ask.chosen < len(known))).all()
                assert ask.values is None or ask.values.shape == (rows, len(known))
            if ask.legal is not None:
                assert ask.legal[np.arange(rows), ask.chosen].all()
            for some in (slice(0, 1), slice(rows - 1, rows), slice(rows // 3, rows // 2 + 1)):
                alone = asked(
                    policy,
                    parts(ask.memory, some),
                    None if ask.legal is None else ask.legal[some],
                    ask.u[some],
                )
                assert same(alone.chosen, ask.chosen[some])
                assert same(alone.values, None if ask.values is None else ask.values[some])


class Watched:
    """A policy that writes down all that it is given."""

    def __init__(self, policy: Policy) -> None:
        self.policy, self.draws = policy, policy.draws
        self.given: list[Any] = []

    def begin(self, observation: Array) -> Memory:
        self.given.append(observation)
        return self.policy.begin(observation)

    def update(self, memory: Memory, percept: Percept) -> Memory:
        self.given.append(percept)
        return self.policy.update(memory, percept)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        chosen = self.policy.choose(memory, legal, u)
        self.given.append((memory, legal, u, chosen))
        return chosen

    def values(self, memory: Memory) -> Reals | None:
        return self.policy.values(memory)


@every_problem
def test_a_seat_is_shown_nothing_that_it_may_not_know(name: str) -> None:
    problem = small(name)
    for seat, policies in seated(name):
        assert twins(name, seat)
        for pair in twins(name, seat):
            alike(problem, seat, policies, pair)


def alike(problem: Problem, seat: int, policies: list[Policy], pair: Twins) -> None:
    """A seat's views, and all that its policy is given and chooses, are equal in both games."""
    watched = [Watched(policies[seat]) for _ in pair]
    sessions = []
    for watcher, game, others in zip(watched, pair, (11, 12), strict=True):
        players: list[Policy] = [*policies]
        players[seat] = watcher
        sessions.append(Session(problem, Told(game, seat, 10, others), players, limit=99))
    for turn in range(len(pair.one.actions) + 1):
        views = [session.view(seat) for session in sessions]
        for each in fields(View):
            shown = [getattr(view, each.name) for view in views]
            assert same(*shown), f"{each.name} of the view differs"
        if sessions[0].over:
            break
        for session in sessions:
            session.choices()
        assert same(watched[0].given, watched[1].given)
        if turn < len(pair.one.actions):
            for session, game in zip(sessions, pair, strict=True):
                session.advance(list(game.actions[turn]))


@every_problem
def test_the_twins_of_the_privacy_law_differ_where_they_can(name: str) -> None:
    problem = small(name)
    finite = lists(problem.chance(pool(name).s[:1], pool(name).a[:1]))
    for seat in range(len(problem.agents)):
        for one, other in twins(name, seat):
            if problem.hidden:
                assert not same((one.opening, one.draws), (other.opening, other.draws))
                assert len(problem.agents) == 1 or not same(one.actions, other.actions)
            elif problem.draws.step and finite:
                assert not same(one.draws, other.draws)
