"""Tree search: it beats random play, plays any problem, and knows no more than its seat."""

from dataclasses import dataclass

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array, Chance, DiscreteUniform, Normal, Reals, Uniform
from dmplay.core import ContinuousStates, Labels, Memory, Outcome, Percept, Policy, Problem
from dmplay.dice import expand_uniforms
from dmplay.errors import BadParameter, BadPolicy, DmplayError
from dmplay.finding.agents import load_roster, plan_for_turn_limit
from dmplay.problems._reals import RealStateProblem
from dmplay.problems.collaborative_predator_prey import CollaborativePredatorPrey
from dmplay.solvers.search_tree import SearchConfig
from dmplay.solvers.uct import UctResult
from tests.support.brought import Counted
from tests.support.teams import dectiger, read


@dataclass(frozen=True)
class Walk(Counted):
    """A step to the right pays at the end of a corridor of seven."""

    actions = (Labels(("left", "right")),)
    state_count, placed = 7, 3
    discount = 0.9

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (DiscreteUniform(np.full(len(s), 5), 5),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        ahead = np.where((events[0] > 0) == (a[:, 0] == 1), 1, -1)  # one step in five goes astray
        moved = np.where(self.terminal(s), s, np.clip(s + ahead, 0, 6))
        pays = ((moved == 6) & (s < 6)).astype(float)
        return Outcome(moved, pays[:, None], moved)

    def terminal(self, s: Array) -> Array:
        return np.asarray(s == 6)


class Foggy(Walk):
    """The same where nothing is seen, and the corridor is real: there is no list of states."""

    observations = (Labels(("fog",)),)
    state_count = ContinuousStates(1)  # type: ignore[assignment] # of a Walk they could be listed

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Normal(s, s),)


@dataclass(frozen=True)
class Dial(Counted):
    """One of 500 numbers opens the safe a little, the nearer to 311 the more."""

    actions = (Labels(map(str, range(500))),)
    state_count, placed, horizon = 1, 0, 1

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        return Outcome(s, -np.abs(a - 311.0), s)


@dataclass(frozen=True)
class Tide(RealStateProblem):
    """To leave at once pays 0.55; who stays sees a drawn number, and its sign told pays 1."""

    actions = (Labels(("low", "high", "leave")),)
    state_count = ContinuousStates(2)
    horizon = 2

    def initial_chance(self, rows: int) -> tuple[Chance, ...]:
        return (Uniform(np.zeros(rows), np.zeros(rows)), Uniform(np.zeros(rows), np.zeros(rows)))

    def chance(self, s: Array, a: Array) -> tuple[Chance, ...]:
        return (Uniform(-np.ones(len(s)), np.ones(len(s))),)

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        turn, (number, act) = s[:, 0], (s[:, 1], a[:, 0])
        pays = np.where(turn == 0, 0.55 * (act == 2), (number > 0) == (act == 1))
        after = np.where((turn == 0) & (act != 2), 1.0, 2.0)
        moved = np.stack([after, events[0]], axis=1)
        return Outcome(moved, np.where(turn < 2, pays, 0.0)[:, None].astype(float), moved)

    def terminal(self, s: Array) -> Array:
        return np.asarray(s[:, 0] == 2)


def played(problem: Problem, agent: str, episodes: int, turns: int | None) -> np.ndarray:
    policy = dmplay.load_agent(problem, 0, agent)
    found = dmplay.rollout(problem, [policy], episodes=episodes, turn_limit=turns, seed=1)
    return np.asarray(found.returns[:, 0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "agent", "episodes", "turns", "margin"),
    [
        ("hexworld", "search:simulations=80", 40, 50, 3.0),
        ("crying-baby", "search:simulations=60,depth=10", 40, 20, 10.0),
        ("catch", "search:simulations=100", 60, 10, 20.0),
        ("machine-replacement", "search:simulations=60", 40, 20, 8.0),
        ("cart-pole", "search:simulations=40", 10, 60, 25.0),
        ("mountain-car", "search:simulations=60,depth=60", 40, 150, 10.0),
    ],
)
def test_search_beats_random_play(
    name: str, agent: str, episodes: int, turns: int, margin: float
) -> None:
    problem = dmplay.load_problem(name)
    search = played(problem, agent, episodes, turns).mean()
    assert search > played(problem, "random", episodes, turns).mean() + margin


def test_search_plays_a_problem_that_it_was_not_written_for() -> None:
    found = played(Walk(), "search:simulations=60", 40, 30)
    assert (found > 0).all()
    assert found.mean() > played(Walk(), "random", 40, 30).mean() + 0.1


def first_choices(problem: Problem, seat: int, agent: str, rows: int) -> np.ndarray:
    """The first choices in games that start alike, by one luck each."""
    search = dmplay.load_agent(problem, seat, agent)
    s = problem.sample_initial_states(np.full((rows, problem.uniform_counts.start), 0.5))
    chosen = search.choose(
        search.initial_memory(problem.initial_observation(s, seat)),
        None,
        np.linspace(0, 0.9, rows)[:, None],
    )
    return np.asarray(chosen)


def test_search_replies_to_whom_it_takes_the_others_to_be() -> None:
    problem, defect = dmplay.load_problem("prisoners-dilemma"), 1
    assert problem.format_action(1, defect) == "defect"
    for others in ("random", "always-cooperate", "always-defect"):
        assert (first_choices(problem, 1, f"search:others={others}", 8) == defect).all()
    assert (first_choices(problem, 1, "search", 8) != defect).all()  # to tit-for-tat


def test_search_betrays_tit_for_tat_in_the_last_round_alone() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    others = [dmplay.load_agent(problem, 0, "search"), dmplay.load_agent(problem, 1, "tit-for-tat")]
    assert dmplay.rollout(problem, others, episodes=3, seed=1).returns[:, 0].tolist() == [-9.0] * 3


def test_search_finds_a_number_between_those_of_a_grid() -> None:
    problem = dmplay.load_problem("simple-regulator")
    search = dmplay.load_agent(problem, 0, "search:depth=2,rollout=random")
    s = np.array([[4.43], [-3.21]])
    chosen = search.choose(search.initial_memory(s), None, np.array([[0.1], [0.2]]))
    assert np.abs(s[:, 0] + chosen).max() < 0.4
    assert (chosen == np.round(chosen, 9)).all()


def test_search_comes_near_the_best_of_many_actions() -> None:
    chosen = first_choices(Dial(), 0, "search", 3)
    assert np.abs(chosen - 311).max() <= 12  # 20 of the 500 are tried


def test_search_tells_numbers_apart_that_nature_draws() -> None:
    """Blind to the number to come, to stay would be worth a half."""
    assert 2 not in first_choices(Tide(), 0, "search:simulations=800", 8)


def test_search_keeps_to_the_adviser_unless_another_action_is_surely_better() -> None:
    means, actions = np.array([[1.0, 1.5, 0.0], [1.0, 1.5, 0.0]]), np.tile([4, 5, 6], (2, 1))
    found = UctResult(actions, means, np.array([[0.01] * 3, [0.04] * 3]))
    able = np.array([[False, True, False]] * 2)
    kept = found.keep_usual_unless_better(able, np.array([4, 4]))
    assert kept.tolist() == [[False, True, False], [True, False, False]]
    assert (
        found.keep_usual_unless_better(able, np.array([7, 7])).tolist() == able.tolist()
    )  # was not tried


@pytest.mark.parametrize(
    "name", ["machine-replacement", "simple-regulator", "predator-prey", "rock-paper-scissors"]
)
def test_a_choice_is_the_same_alone_and_beside_others(name: str) -> None:
    problem, rows = dmplay.load_problem(name), 4
    search = dmplay.load_agent(problem, 0, "search:simulations=120,depth=6")
    s = problem.sample_initial_states(
        np.linspace(0, 0.9, rows * problem.uniform_counts.start).reshape(rows, -1)
    )
    memory, u = (
        search.initial_memory(problem.initial_observation(s, 0)),
        np.linspace(0.1, 0.8, rows)[:, None],
    )
    together = search.choose(memory, None, u)
    for row in range(rows):
        alone = search.choose(tuple(part[[row]] for part in memory), None, u[[row]])
        assert alone.tolist() == together[[row]].tolist()


def test_any_number_of_rows_is_searched_that_could_be_searched_alone() -> None:
    for name in ("crying-baby", "prisoners-dilemma", "rock-paper-scissors", "hexworld"):
        tree = SearchConfig(
            dmplay.load_problem(name), 0, simulations=400, depth=20, ucb_constant=1.0
        )
        tree.make_budget(1)
        tree.make_budget(tree.rows_per_block)


REFUSED = {  # a problem, whom a search is to have beside it, and what is told
    "prisoners-dilemma others=search": "others: got 'search'",
    "hexworld rollout=search:depth=2": "rollout: got 'search:depth=2'",
    "hexworld rollout=optimol": "did you mean optimal",
    "2048 rollout=expectimax:milliseconds=5": "depend on the clock",
    "prisoners-dilemma others=tit-for-tut": "did you mean tit-for-tat",
}


def test_search_refuses_companions_that_it_cannot_have() -> None:
    for asked, told in REFUSED.items():
        name, given = asked.split()
        with pytest.raises(DmplayError, match=told):
            dmplay.load_agent(dmplay.load_problem(name), 0, f"search:{given}")


def test_search_gives_no_values() -> None:
    search = dmplay.load_agent(Walk(), 0, "search")
    assert search.action_values(search.initial_memory(np.array([3]))) is None


def test_search_needs_a_belief_where_states_are_hidden() -> None:
    with pytest.raises(BadPolicy, match="search needs a belief, as states are hidden: Foggy"):
        dmplay.load_agent(Foggy(), 0, "search")


@pytest.mark.parametrize("given", ["simulations=0", "depth=0", "exploration=-1"])
def test_search_refuses_numbers_out_of_bounds(given: str) -> None:
    with pytest.raises(BadParameter, match=f"{given.partition('=')[0]}: got"):
        dmplay.load_agent(Walk(), 0, f"search:{given}")


def test_the_luck_of_a_search_follows_from_its_uniform() -> None:
    u = np.array([0.25, 0.5, 0.999999999])
    many = expand_uniforms(u, 5)
    assert many.shape == (3, 5)
    assert len(np.unique(many)) == 15
    assert (expand_uniforms(u[1:2], 5) == many[1]).all()


@pytest.mark.parametrize("name", ["hexworld", "crying-baby", "catch"])
def test_a_choice_is_no_more_work_than_its_simulations(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, turns = dmplay.load_problem(name), [0]
    search = dmplay.load_agent(problem, 0, "search:simulations=50,depth=7")
    s = problem.sample_initial_states(np.full((1, problem.uniform_counts.start), 0.4))
    memory = search.initial_memory(problem.initial_observation(s, 0))
    kind, step = type(problem), type(problem).step

    def counted(self: Problem, s: Array, a: Array, u: Reals) -> Outcome:
        turns.append(len(s))
        return step(self, s, a, u)

    monkeypatch.setattr(kind, "step", counted)
    search.choose(memory, None, np.array([[0.5]]))
    assert 0 < sum(turns) <= 50 * 7


CARE = "multicaregiver-crying-baby"
CRYING, IGNORE = 0, 2


def cared(agent: str, seat: int, turns: list[tuple[int, int]]) -> tuple[Policy, Memory]:
    """What a caregiver remembers who did and heard this."""
    policy = dmplay.load_agent(dmplay.load_problem(CARE), seat, agent)
    memory = policy.initial_memory(np.full(1, -1))
    for did, heard in turns:
        told = Percept(np.full(1, did), np.full(1, heard), None, None)
        memory = policy.update_memory(memory, told)
    return policy, memory


def test_search_believes_what_its_partners_make_of_what_they_hear() -> None:
    """As exactly as 500 guesses can: the same as Bayes' rule beside the usual partner."""
    quiet = 1
    for turns in ([(IGNORE, quiet)] * 2, [(IGNORE, CRYING), (IGNORE, quiet)]):
        _, guesses = cared("search", 1, turns)
        _, (exact,) = cared("best-response", 1, turns)
        hungry = float(exact[0, 3:].sum())
        assert abs(float((guesses[-2] == 1).mean()) - hungry) < 0.05
        assert (guesses[-1] == quiet).all()  # what the partner heard, too


def test_search_follows_its_belief_where_partners_do_what_nobody_guessed() -> None:
    """The partner feeds a baby that cries, and then it cannot cry: here it did not feed."""
    _, guesses = cared("search", 0, [(IGNORE, CRYING)] * 2)
    assert (guesses[-2] == 1).all()


def test_guesses_are_the_same_alone_and_beside_others() -> None:
    problem, rows = dmplay.load_problem(CARE), 5
    search = dmplay.load_agent(problem, 0, "search:simulations=60,depth=4")
    turns = [Percept(np.full(rows, IGNORE), np.arange(rows) % 2, None, None)] * 2
    together = search.initial_memory(np.full(rows, -1))
    alone = [tuple(part[[row]] for part in together) for row in range(rows)]
    for turn in turns:
        together = search.update_memory(together, turn)
        for row in range(rows):
            one = Percept(turn.action[[row]], turn.observation[[row]], None, None)
            alone[row] = search.update_memory(alone[row], one)
    for each, *parts in zip(together, *alone, strict=True):
        np.testing.assert_array_equal(each, np.concatenate(parts))


@pytest.mark.parametrize("turns", [3, 4])
def test_search_in_a_team_does_as_well_as_its_plan_of_so_many_turns(turns: int) -> None:
    problem = read(dectiger())
    earned = []
    for agent in ("joint-plan", "search:simulations=60"):
        names = [plan_for_turn_limit(problem, seat, agent, turns) for seat in range(2)]
        team = [dmplay.load_agent(problem, seat, name) for seat, name in enumerate(names)]
        found = dmplay.rollout(problem, team, episodes=12, turn_limit=turns, seed=1)
        earned.append(found.returns[:, 0].mean())
    assert earned[1] >= earned[0] > 0


def test_two_who_search_hunt_by_the_plan_that_all_can_follow() -> None:
    assert load_roster(CollaborativePredatorPrey()).simulation_agent == "joint-plan"
    for hunt in (CollaborativePredatorPrey(sighted=True), CollaborativePredatorPrey(predators=1)):
        assert load_roster(hunt).simulation_agent is None
