"""Values called exact equal those of the hinted policy, evaluated outcome by outcome.

The evaluation uses only `enumerate_outcomes` and the choices of the agents. It keeps its own
distribution over the state and the other agent's memory, by Bayes' rule. No solver is called.
"""

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import cast

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion, SeatPolicy
from dmplay.agents.script import Script
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array, Reals
from dmplay.core.belief import initial_belief
from dmplay.core.policy import Memory, Percept
from dmplay.core.problem import (
    Outcome,
    Problem,
    build_percept,
    enumerate_outcomes,
    initial_state_distribution,
)
from dmplay.core.session import Session
from dmplay.formats.gambit_nfg import read_nfg
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.registry.agents import find_hint_provider, load_agent, load_roster
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_variants
from dmplay.solvers.games.bimatrix_game import build_payoffs
from tests.support.literature_dec_pomdps import (
    format_broadcast,
    format_dectiger,
    format_meeting,
    format_recycling,
    parse_team_file,
)
from tests.support.literature_pomdps import make_cheese_maze, make_random_problem, make_tiger
from tests.support.random_problems import RandomGame, RandomProblem, RandomRivalGame
from tests.support.tic_tac_toe import Toe
from tests.support.turn_based_games import Nim
from tests.support.user_problems import Heap, Key, RevealingVault, Vault

Hidden = tuple[int, int]  # the index of the state, and the key of the other agent's memory
Distribution = dict[Hidden, float]
TURNS = (1, 2, 5, 20)


class Evaluation:
    """The expected return of a policy for a number of turns, outcome by outcome."""

    def __init__(self, problem: Problem, policy: SeatPolicy, other: SeatPolicy | None) -> None:
        self.problem, self.policy, self.other = problem, policy, other
        self.states = problem.enumerate_states()
        self.other_memories: list[Memory] = []
        self.other_keys: dict[bytes, int] = {}
        self.values: dict[object, float] = {}
        self.outcomes: dict[object, tuple[Reals, Outcome]] = {}

    def key_of(self, other_memory: Memory) -> int:
        """Return the key of a memory of the other agent."""
        content = b"|".join(array.tobytes() for array in other_memory)
        if content not in self.other_keys:
            self.other_keys[content] = len(self.other_memories)
            self.other_memories.append(other_memory)
        return self.other_keys[content]

    def value(self, distribution: Distribution, memory: Memory, turns_left: int) -> float:
        """Return the expected return of the policy's choices."""
        key = (
            tuple((hidden, round(p, 10)) for hidden, p in sorted(distribution.items())),
            tuple(np.round(array.astype(float), 10).tobytes() for array in memory),
            turns_left,
        )
        if key not in self.values:
            self.values[key] = self._compute_value(distribution, memory, turns_left)
        return self.values[key]

    def _compute_value(self, distribution: Distribution, memory: Memory, turns_left: int) -> float:
        live = {
            (s, m): p for (s, m), p in distribution.items()
            if not self.problem.terminal(self.states[s : s + 1])[0]
        }  # fmt: skip
        if not turns_left or not live:
            return 0.0
        first_state = next(iter(live))[0]
        action = int(self._choose(self.policy, memory, first_state)[0])
        return self.action_value(live, memory, turns_left, action)

    def _choose(self, policy: SeatPolicy, memory: Memory, s: int) -> Reals:
        """Return the choice of a policy with the actions that are legal in a state."""
        legal = self.problem.legal_actions_mask(self.states[s : s + 1])
        legal_row = None if legal is None else legal[:, policy.seat]
        return np.asarray(policy.choose(memory, legal_row, np.full((1, 1), 0.5)))

    def action_value(
        self, distribution: Distribution, memory: Memory, turns_left: int, action: int
    ) -> float:
        """Return the expected return of an action and the policy's choices after it."""
        problem, seat = self.problem, self.policy.seat
        expected = 0.0
        futures = defaultdict[bytes, Distribution](lambda: defaultdict(float))
        percepts = {}
        for (s, other_key), p_hidden in distribution.items():
            for joint_action, p_action in self._joint_actions(s, other_key, action):
                p, outcome = self._enumerate(s, joint_action)
                joint_row = np.array([joint_action])
                for k in np.flatnonzero(p > 0).tolist():
                    weight = p_hidden * p_action * p[k]
                    expected += weight * outcome.rewards[k, seat]
                    row = Outcome(*(array[k : k + 1] for array in outcome))
                    percept = build_percept(problem, seat, joint_row, row)
                    actions = b"" if percept.actions is None else percept.actions.tobytes()
                    information = percept.observation.tobytes() + actions
                    percepts[information] = percept
                    next_s = int(problem.state_indices(row.state)[0])
                    next_other = other_key
                    if self.other:
                        other_percept = build_percept(problem, 1 - seat, joint_row, row)
                        next_other = self.key_of(
                            self.other.update_memory(self.other_memories[other_key], other_percept)
                        )
                    futures[information][next_s, next_other] += weight
        for information, future in futures.items():
            total = sum(future.values())
            posterior = {hidden: p / total for hidden, p in future.items()}
            next_memory = self.policy.update_memory(memory, percepts[information])
            expected += (
                problem.discount * total * self.value(posterior, next_memory, turns_left - 1)
            )
        return expected

    def _enumerate(self, s: int, joint_action: tuple[int, ...]) -> tuple[Reals, Outcome]:
        """Return the probability of each outcome `[K]`, and the outcomes."""
        if (s, joint_action) not in self.outcomes:
            p, outcome = enumerate_outcomes(
                self.problem, self.states[s : s + 1], np.array([joint_action])
            )
            self.outcomes[s, joint_action] = p[0], Outcome(*(array[0] for array in outcome))
        return self.outcomes[s, joint_action]

    def _joint_actions(
        self, s: int, other_key: int, action: int
    ) -> list[tuple[tuple[int, ...], float]]:
        """Return the joint actions with their probabilities."""
        if self.other is None:
            return [((action,), 1.0)]
        memory = self.other_memories[other_key]
        if self.other.uniform_count:
            probabilities = self.other.choice_probabilities(memory)
            assert probabilities is not None
            legal = self.problem.legal_actions_mask(self.states[s : s + 1])
            if legal is not None:
                probabilities = probabilities * legal[:, self.other.seat]
                probabilities /= probabilities.sum()
            pairs = [(b, float(p)) for b, p in enumerate(probabilities[0]) if p > 0]
        else:
            pairs = [(int(self._choose(self.other, memory, s)[0]), 1.0)]
        if self.policy.seat == 0:
            return [((action, b), p) for b, p in pairs]
        return [((b, action), p) for b, p in pairs]


def make_matrix_game(*action_counts: int) -> Problem:
    """Return a game of one state with random payoffs, read from the text of an .nfg file."""
    payoffs = np.random.default_rng(5).integers(-9, 9, (np.prod(action_counts), len(action_counts)))
    names, counts = '"player" ' * len(action_counts), " ".join(map(str, action_counts))
    numbers = " ".join(map(str, payoffs.flatten().tolist()))
    text = f'NFG 1 R "" {{ {names}}} {{ {counts} }}\n{numbers}\n'
    return read_nfg("random.nfg", text.encode())


def check_first_values(
    problem: Problem, turns: int, other: str = "", *, seat: int = 0
) -> Accuracy | None:
    """Compare the first values of the hint provider with an evaluation of its policy.

    Exact values are equal to those of the policy, and lower bounds are at most as large. Of many
    actions, some are evaluated. Return the
    accuracy of the values that were compared, None for estimates and for values of another game.
    """
    players = [other] * len(problem.agents)
    players[seat] = "human"
    agent = find_hint_provider(problem, AdviceQuestion(seat, turns, tuple(players)))
    assert agent is not None
    policy, accuracy = agent.policy, agent.basis.accuracy
    if accuracy not in {Accuracy.EXACT, Accuracy.LOWER_BOUND} or agent.basis.turns_scope:
        return None
    assert not agent.basis.assumed_players
    session = Session(problem, dmplay.SeededUniforms(7), turn_limit=turns)
    memory = policy.initial_memory(np.asarray(session.observation_after(seat, 0))[None])
    values = policy.action_values(memory)
    assert values is not None
    evaluation = Evaluation(
        problem, policy, cast(SeatPolicy, load_agent(problem, 1 - seat, other)) if other else None
    )
    other_key = 0
    if evaluation.other:
        first = np.asarray(session.observation_after(1 - seat, 0))[None]
        other_key = evaluation.key_of(evaluation.other.initial_memory(first))
    start = (
        enumerate(session.view(seat).belief.tolist())
        if problem.partially_observable
        else [(int(problem.state_indices(np.asarray(session.state)[None])[0]), 1.0)]
    )
    distribution = {(s, other_key): p for s, p in start if p > 0}
    legal = session.legal_actions_mask(seat)
    for action, value in enumerate(values[0].tolist()):
        if (legal is None or legal[action]) and action % max(len(values[0]) // 4, 1) == 0:
            expected = evaluation.action_value(distribution, memory, turns, action)
            assert value <= expected + 1e-6, (turns, action)
            assert accuracy is Accuracy.LOWER_BOUND or value == pytest.approx(expected, abs=1e-6)
    return accuracy


@pytest.mark.parametrize("turns", TURNS)
@pytest.mark.parametrize("name", ["hexworld", "crying-baby"])
def test_exact_values_of_built_in_problems_and_variants(name: str, turns: int) -> None:
    for problem in load_variants(name).values():
        assert check_first_values(problem, turns) == Accuracy.EXACT


@pytest.mark.parametrize(
    ("name", "turns"),
    [("catch", 1), ("catch", 2), ("catch", 5), ("machine-replacement", 1),
     ("machine-replacement", 2), ("machine-replacement", 5),
     pytest.param("machine-replacement", 20, marks=pytest.mark.slow),
     pytest.param("catch", 10, marks=pytest.mark.slow)],
)  # fmt: skip
def test_exact_values_of_problems_with_many_beliefs(name: str, turns: int) -> None:
    assert check_first_values(dmplay.load_problem(name), turns) == Accuracy.EXACT


@pytest.mark.parametrize("turns", [1, 2, 5, pytest.param(20, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    ("seat", "other"), [(0, "flee"), (0, "random"), (1, "chase"), (1, "random")]
)
@pytest.mark.parametrize("variant", ["triangle", "circle"])
def test_exact_values_of_a_hunt_against_a_known_policy(
    variant: str, seat: int, other: str, turns: int
) -> None:
    problem = dmplay.load_problem(f"predator-prey:{variant}")
    assert check_first_values(problem, turns, other, seat=seat) == Accuracy.EXACT


@pytest.mark.parametrize(
    ("seat", "other", "turns"),
    [(0, "flee", 1), (0, "flee", 5), (1, "chase", 2), (1, "random", 1),
     pytest.param(0, "flee", 20, marks=pytest.mark.slow),
     pytest.param(1, "chase", 20, marks=pytest.mark.slow),
     pytest.param(0, "random", 5, marks=pytest.mark.slow),
     pytest.param(1, "random", 5, marks=pytest.mark.slow)],
)  # fmt: skip
def test_exact_values_of_a_hunt_on_the_map_of_the_book(seat: int, other: str, turns: int) -> None:
    problem = dmplay.load_problem("predator-prey")
    assert check_first_values(problem, turns, other, seat=seat) == Accuracy.EXACT


@pytest.mark.parametrize("turns", [1, 2, 5, 10])
@pytest.mark.parametrize("seat", [0, 1])
@pytest.mark.parametrize("partner", ["feed-when-crying", "random", "best-response", "joint-plan"])
def test_exact_values_of_a_caregiver_are_those_with_the_partner_of_the_game(
    partner: str, seat: int, turns: int
) -> None:
    problem = dmplay.load_problem("multicaregiver-crying-baby")
    assert check_first_values(problem, turns, partner, seat=seat) == Accuracy.EXACT


def test_a_caregiver_that_follows_the_hints_earns_the_value_of_the_best_response() -> None:
    problem = dmplay.load_problem("multicaregiver-crying-baby")
    for seat, value in ((0, -20.314), (1, -27.290)):
        players = ["feed-when-crying"] * 2
        policies = [load_agent(problem, i, name) for i, name in enumerate(players)]
        agent = find_hint_provider(problem, AdviceQuestion(seat, 10, tuple(players)))
        assert agent is not None
        policies[seat] = agent.policy
        result = dmplay.rollout(problem, policies, episodes=20_000, turn_limit=10, seed=5)
        mean, error = result.returns[:, seat].mean(), result.returns[:, seat].std() / 20_000**0.5
        assert abs(mean - value) < 4 * error + 1e-3


@pytest.mark.parametrize("turns", TURNS)
@pytest.mark.parametrize(
    ("name", "rules"),
    [
        ("prisoners-dilemma", ["tit-for-tat", "suspicious-tit-for-tat", "grim",
                               "win-stay-lose-shift", "always-cooperate", "always-defect",
                               "generous-tit-for-tat", "tit-for-two-tats", "two-tits-for-tat",
                               "majority", "nash", "best-response", "softmax", "random"]),
        ("rock-paper-scissors", ["uniform", "nash", "beat-last", "frequency", "random"]),
        ("travelers-dilemma", ["nash", "claim"]),
    ],
)  # fmt: skip
def test_exact_values_of_a_repeated_game_against_a_known_rule(
    name: str, rules: Sequence[str], turns: int
) -> None:
    problem = dmplay.load_problem(name)
    for rule in rules:
        for seat in (0, 1):
            assert check_first_values(problem, turns, rule, seat=seat) == Accuracy.EXACT


@pytest.mark.slow
@pytest.mark.parametrize("turns", [1, 2])
@pytest.mark.parametrize("rule", ["level-k", "random"])
def test_exact_values_of_a_dilemma_with_99_random_replies(rule: str, turns: int) -> None:
    assert (
        check_first_values(dmplay.load_problem("travelers-dilemma"), turns, rule) == Accuracy.EXACT
    )


UNPREDICTED = {"search", "human"}  # agents that no advice can predict
BELIEF_AGENTS = {"qmdp", "chase-belief", "point-based"}  # partners in a hunt with too many memories
CHICKEN_SOURCE = """\
import numpy as np
from dmplay import Labels, Outcome, Problem, SeatPolicy
from dmplay.agents.available_agents import Roster


class SwitchAfterLoss(SeatPolicy):
    '''Changes its action after a negative reward.'''

    def initial_memory(self, observation):
        return (np.zeros(len(observation), int),)

    def update_memory(self, memory, percept):
        return (np.where(percept.reward < 0, 1 - percept.action, percept.action),)

    def choose(self, memory, legal, u):
        return memory[0]


class Chicken(Problem):
    '''A game of chicken.'''

    agents = ("one", "two")
    actions = (Labels(("dare", "swerve")),) * 2
    state_count = 1

    def initial_chance(self, rows):
        return ()

    def initial_states(self, rows, events):
        return np.zeros(rows, int)

    def resolve_events(self, s, a, events):
        payoffs = np.array([[[-9, -9], [2, 0]], [[0, 2], [1, 1]]], float)
        return Outcome(s, payoffs[a[:, 0], a[:, 1]], s)

    def format_state(self, s):
        return "start"

    def parse_state(self, text):
        return np.array(0)


AGENTS = Roster({"switch-after-loss": SwitchAfterLoss})
"""
GAMES = {
    **{name: dmplay.load_problem(name) for name in problem_names()},
    "predator-prey": dmplay.load_problem("predator-prey:triangle"),
    "two rows": make_matrix_game(2, 2), "three rows": make_matrix_game(3, 3),
    "three players": make_matrix_game(2, 3, 2),
    "turns": Nim(), "board": Toe(), "opposed": RandomRivalGame(), "simultaneous": RandomGame(),
    "team": parse_team_file(format_dectiger()),
}  # fmt: skip


@pytest.mark.parametrize("name", [name for name, game in GAMES.items() if len(game.agents) > 1])
def test_advice_assumes_each_agent_of_a_game_that_can_be_computed_with(name: str) -> None:
    problem = GAMES[name]
    for seat in range(len(problem.agents))[:2]:
        for other in {*load_roster(problem, 1 - seat).agents, "human"} - {"axelrod"}:
            players = [other] * len(problem.agents)
            players[seat] = "human"
            agent = find_hint_provider(problem, AdviceQuestion(seat, 2, tuple(players)))
            assert agent is not None
            is_known = agent.basis.players in {f"against {other}", f"with {other}"}
            assert is_known is (other not in UNPREDICTED | BELIEF_AGENTS), (seat, other)
            if agent.basis.accuracy is Accuracy.EXACT:
                assert is_known, (seat, other)
            if (
                is_known
                and len(problem.agents) == 2
                and agent.basis.accuracy not in {Accuracy.UPPER_BOUND, Accuracy.ESTIMATED}
            ):
                turns = 1 if problem.action_counts[0] > 9 else 2
                assert check_first_values(problem, turns, other, seat=seat) == Accuracy.EXACT


@pytest.mark.parametrize("seat", [0, 1])
def test_advice_assumes_a_rule_of_the_module_that_defines_the_game(
    tmp_path: Path, seat: int
) -> None:
    path = tmp_path / "chicken.py"
    path.write_text(CHICKEN_SOURCE)
    problem = dmplay.load_problem(f"{path}:Chicken")
    for turns in (1, 2, 3):
        assert check_first_values(problem, turns, "switch-after-loss", seat=seat) == Accuracy.EXACT


def test_three_players_are_advised_for_the_two_agents_of_the_game() -> None:
    problem = make_matrix_game(2, 3, 2)
    players = ("random", "human", "equilibrium")
    agent = find_hint_provider(problem, AdviceQuestion(1, 2, players))
    assert agent is not None
    assert agent.basis.players == "against random and equilibrium"
    values = agent.policy.action_values(agent.policy.initial_memory(np.zeros(1, int)))
    assert values is not None
    equilibrium = cast(SeatPolicy, load_agent(problem, 2, "equilibrium"))
    replies = equilibrium.choice_probabilities((np.zeros(1, int),))
    assert replies is not None
    rewards = build_payoffs(problem)[..., 1].mean(axis=0) @ replies[0]
    assert values[0] == pytest.approx(rewards + rewards.max())


@pytest.mark.parametrize("turns", TURNS)
def test_exact_values_of_user_defined_problems(turns: int) -> None:
    problems = [
        Key(), Heap(), *(RandomProblem(seed=n) for n in range(6)),
        *(RandomProblem(seed=n, ends=False, turns=turns) for n in range(2)),
    ]  # fmt: skip
    for problem in problems:
        assert check_first_values(problem, turns) == Accuracy.EXACT
    for game in (Nim(), Toe()):
        assert check_first_values(game, turns, f"optimal:horizon={turns}") == Accuracy.EXACT
    assert check_first_values(RevealingVault(), turns) is None  # a search has no values


@pytest.mark.parametrize(
    ("turns", "accuracy"),
    [(1, Accuracy.EXACT), (2, Accuracy.EXACT), (5, Accuracy.EXACT),
     pytest.param(20, Accuracy.LOWER_BOUND, marks=pytest.mark.slow)],
)  # fmt: skip
def test_values_of_a_user_defined_problem_with_hidden_states(
    turns: int, accuracy: Accuracy
) -> None:
    assert check_first_values(Vault(), turns) is accuracy


@pytest.mark.parametrize("turns", [1, 2, 5])
def test_values_of_problem_files(turns: int) -> None:
    problems = [make_tiger(), make_cheese_maze(), *(make_random_problem(n, 0.9) for n in range(3))]
    assert Accuracy.EXACT in {check_first_values(problem, turns) for problem in problems}


@pytest.mark.parametrize("turns", [1, 2, 3])
@pytest.mark.parametrize("text", [format_dectiger(), format_broadcast(), format_recycling()])
def test_exact_values_of_a_team_that_follows_one_plan(text: str, turns: int) -> None:
    problem = parse_team_file(text)
    for seat in (0, 1):
        other = f"joint-plan:horizon={turns}"
        assert check_first_values(problem, turns, other, seat=seat) == Accuracy.EXACT


TEAMS = {
    "dectiger": parse_team_file(format_dectiger()),
    "broadcast": parse_team_file(format_broadcast()),
    "recycling": parse_team_file(format_recycling()),
    "meeting": parse_team_file(format_meeting()),
}
History = list[tuple[int, int]]  # the actions and observations of one seat
Node = tuple[Array, Memory]  # a state, and the memory of the partner
Particle = tuple[float, bytes]  # a weight, and the key of a node
Step = tuple[float, int, bytes]  # a probability, what the seat observes, and the next node


class BestReply:
    """The best return of a seat beside a partner, by expectimax over the seat's own histories."""

    def __init__(self, problem: Problem, seat: int, partner: str | Script) -> None:
        self.problem, self.seat = problem, seat
        self.partner = (
            cast(SeatPolicy, load_agent(problem, 1 - seat, partner))
            if isinstance(partner, str)
            else partner
        )
        self.nodes: dict[bytes, Node] = {}
        self.steps: dict[tuple[bytes, int], tuple[float, list[Step]]] = {}

    def add_node(self, state: Array, memory: Memory) -> bytes:
        """Return the key of a node."""
        key = b"|".join(array.tobytes() for array in (state, *memory))
        self.nodes[key] = state, memory
        return key

    def find_steps(self, key: bytes, action: int) -> tuple[float, list[Step]]:
        """Return the expected reward of an action in a node, and what can follow."""
        if (key, action) not in self.steps:
            self.steps[key, action] = self._compute_steps(*self.nodes[key], action)
        return self.steps[key, action]

    def _compute_steps(self, state: Array, memory: Memory, action: int) -> tuple[float, list[Step]]:
        steps, reward = [], 0.0
        chances = self.partner.choice_probabilities(memory)
        assert chances is not None
        for reply in np.flatnonzero(chances[0]).tolist():
            joint = np.array([[action, reply] if self.seat == 0 else [reply, action]])
            p, outcome = enumerate_outcomes(self.problem, state[None], joint)
            for k in np.flatnonzero(p[0]).tolist():
                total = float(chances[0, reply] * p[0, k])
                reward += total * float(outcome.rewards[0, k, self.seat])
                observed, heard = outcome.observations[0, k][[self.seat, 1 - self.seat]]
                percept = Percept(np.array([reply]), heard[None], None, None)
                next_memory = self.partner.update_memory(memory, percept)
                next_key = self.add_node(outcome.state[0, k], next_memory)
                steps.append((total, int(observed), next_key))
        return reward, steps

    def expect_reward(self, particles: list[Particle], action: int) -> float:
        """Return the expected reward of an action, times the weight of the particles."""
        return sum(weight * self.find_steps(key, action)[0] for weight, key in particles)

    def split(self, particles: list[Particle], action: int) -> dict[int, list[Particle]]:
        """Return the particles after each observation."""
        weights = defaultdict[int, dict[bytes, float]](lambda: defaultdict(float))
        for weight, key in particles:
            for p, observed, next_key in self.find_steps(key, action)[1]:
                weights[observed][next_key] += weight * p
        return {
            observed: [(weight, key) for key, weight in group.items()]
            for observed, group in weights.items()
        }

    def follow(self, history: History) -> list[Particle]:
        """Return the particles after a history, whose weights add up to 1."""
        p, states = initial_state_distribution(self.problem)
        memory = self.partner.initial_memory(np.full(1, -1))
        particles = [
            (weight, self.add_node(state, memory))
            for weight, state in zip(p.tolist(), states, strict=True)
        ]
        for action, observation in history:
            particles = self.split(particles, action)[observation]
        total = sum(weight for weight, _ in particles)
        return [(weight / total, key) for weight, key in particles]

    def values(self, particles: list[Particle], turns_left: int) -> list[float]:
        """Return the value of each action, times the weight of the particles."""
        values = []
        for action in range(self.problem.action_counts[self.seat]):
            value = self.expect_reward(particles, action)
            if turns_left > 1:
                groups = self.split(particles, action).values()
                best = [max(self.values(group, turns_left - 1)) for group in groups]
                value += self.problem.discount * sum(best)
            values.append(value)
        return values


def check_best_reply(problem: Problem, seat: int, partner: str | Script, turns: int) -> None:
    """Compare values, forecasts and beliefs with those of the best reply, along one game."""
    name, scripts = (partner, ()) if isinstance(partner, str) else ("script", (partner,))
    players = ("human", name) if seat == 0 else (name, "human")
    agent = find_hint_provider(problem, AdviceQuestion(seat, turns, players, scripts=scripts))
    assert agent is not None
    count = "".join(f" of {len(script.actions)} actions" for script in scripts)
    assert (agent.base_name, agent.basis.players) == ("best-response", f"with {name}{count}")
    assert agent.basis.accuracy is Accuracy.EXACT
    policy, reply = agent.policy, BestReply(problem, seat, partner)
    rng, memory = np.random.default_rng(7), policy.initial_memory(np.full(1, -1))
    history: History = []
    for turns_left in range(turns, 0, -1):
        values, particles = policy.action_values(memory), reply.follow(history)
        assert values is not None
        assert values[0] == pytest.approx(reply.values(particles, turns_left), abs=1e-9)
        action = int(rng.integers(problem.action_counts[seat]))
        reward = reply.expect_reward(particles, action)
        assert policy.expected_reward(memory, action) == pytest.approx(reward)
        forecast = policy.forecast_observations(memory, action)
        assert forecast is not None
        joint = np.zeros(forecast[1].shape)
        for heard, group in reply.split(particles, action).items():
            for weight, key in group:
                state, _ = reply.nodes[key]
                joint[heard, problem.state_indices(state[None])[0]] += weight
        np.testing.assert_allclose(forecast[0][:, None] * forecast[1], joint, atol=1e-12)
        observation = int(rng.choice(np.flatnonzero(forecast[0])))
        percept = Percept(np.array([action]), np.array([observation]), None, None)
        memory = policy.update_memory(memory, percept)
        history.append((action, observation))


@pytest.mark.parametrize(
    ("name", "turns"),
    # Four turns of the meeting would take 30 times as long as three.
    [(name, turns) for name in TEAMS for turns in (1, 2, 3, 4) if (name, turns) != ("meeting", 4)],
)
@pytest.mark.parametrize("partner", ["random", "optimal", "joint-plan:horizon=2"])
def test_exact_values_in_a_team_are_those_of_the_best_reply_to_the_partner(
    name: str, partner: str, turns: int
) -> None:
    for seat in (0, 1):
        check_best_reply(TEAMS[name], seat, partner, turns)


@pytest.mark.parametrize("name", TEAMS)
def test_exact_values_in_a_team_are_those_of_the_best_reply_to_a_script(name: str) -> None:
    problem, rng = TEAMS[name], np.random.default_rng(7)
    for seat in (0, 1):
        actions = rng.integers(problem.action_counts[1 - seat], size=3)
        check_best_reply(problem, seat, Script(problem, 1 - seat, tuple(actions.tolist())), 3)


def find_script_values(problem: Problem, seat: int, turns: int | None, *actions: str) -> Reals:
    """Return the exact values of a seat's first actions beside a script of these actions."""
    script = Script(
        problem, 1 - seat, tuple(problem.parse_action(1 - seat, action) for action in actions)
    )
    players = ("human", "script") if seat == 0 else ("script", "human")
    agent = find_hint_provider(problem, AdviceQuestion(seat, turns, players, scripts=(script,)))
    assert agent is not None
    assert (agent.base_name, agent.basis.scope) == ("best-response", "")
    assert agent.basis.accuracy is Accuracy.EXACT
    _, states = initial_state_distribution(problem)
    observation = np.full(1, -1) if problem.partially_observable else states
    values = agent.policy.action_values(agent.policy.initial_memory(observation))
    assert values is not None
    return np.asarray(values[0])


def test_a_script_is_answered_with_the_turn_in_mind() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    turns = ("cooperate", "defect", "cooperate")
    assert find_script_values(problem, 0, 3, *turns).tolist() == [-4.0, -3.0]
    assert find_script_values(problem, 1, 3, *turns).tolist() == [-4.0, -3.0]


@pytest.mark.parametrize(
    ("name", "action"), [("prisoners-dilemma", "defect"), ("multicaregiver-crying-baby", "feed")]
)
def test_a_game_is_over_when_a_script_ends(name: str, action: str) -> None:
    problem = dmplay.load_problem(name)
    values = find_script_values(problem, 0, 2, action, action).tolist()
    assert find_script_values(problem, 0, 10, action, action).tolist() == values
    if name == "multicaregiver-crying-baby":
        assert find_script_values(problem, 0, None, action, action).tolist() == values


def test_a_script_has_no_action_for_the_turns_of_others() -> None:
    """Beside a script that takes one stone a turn, each move is worth what a search finds."""

    def find_value(stones: int) -> float:
        """Return 1 if the left player, to move, takes the last stone, else -1."""
        return max(find_action_value(stones, taken) for taken in (1, 2) if taken <= stones)

    def find_action_value(stones: int, taken: int) -> float:
        remaining = stones - taken
        return (1.0 if remaining == 0 else -1.0) if remaining < 2 else find_value(remaining - 1)

    values = find_script_values(Nim(), 0, None, *["one"] * 7)
    assert values[:2].tolist() == [find_action_value(7, 1), find_action_value(7, 2)]


LIGHTHOUSE_SOURCE = """\
import numpy as np
from dmplay import Categorical, Labels, Outcome, Problem
from dmplay.agents.available_agents import Roster
from dmplay.agents.base import ConstantPolicy, ReactivePolicy


class Light(ConstantPolicy):
    '''Always signals.'''

    action = 1


class Echo(ReactivePolicy):
    '''Signals after it heard a horn.'''

    def choose(self, memory, legal, u):
        return np.maximum(memory[0], 0)


class Lighthouse(Problem):
    '''A ship that two keepers guide; what they hear depends on where it was.'''

    agents = ("north", "south")
    actions = (Labels(("wait", "signal")),) * 2
    observations = (Labels(("silence", "horn")),) * 2
    state_count, discount, shared_reward = 2, 0.9, SHARED

    def initial_chance(self, rows):
        return (Categorical(np.full((rows, 1), 0.5)),)

    def initial_states(self, rows, events):
        return events[0]

    def chance(self, s, a):
        return tuple(Categorical(np.full((len(s), 1), p)) for p in (0.8, 0.7, 0.6))

    def resolve_events(self, s, a, events):
        moved, *errors = events
        signals = a.sum(axis=1)
        after = np.where(signals == 1, 1 - s, np.where(moved == 1, s, s ^ (signals == 2)))
        heard = np.stack([np.where(error == 1, 1 - s, s) for error in errors], axis=1)
        rewards = 3.0 * s[:, None] - a * [1, 2]
        return Outcome(after, rewards[:, [0, 0]] if SHARED else rewards, heard)

    def format_state(self, s):
        return ("near", "far")[int(s)]

    def parse_state(self, text):
        return np.array(("near", "far").index(text))


AGENTS = Roster({"light": Light, "echo": Echo})
"""


@pytest.mark.parametrize("turns", [1, 2, 4])
@pytest.mark.parametrize("partner", ["light", "echo", "random"])
@pytest.mark.parametrize("shared", ["True", "False"])
def test_exact_values_in_a_game_of_a_module_are_those_of_the_best_reply_to_its_agents(
    tmp_path: Path, shared: str, partner: str, turns: int
) -> None:
    path = tmp_path / "lighthouse.py"
    path.write_text(LIGHTHOUSE_SOURCE.replace("SHARED", shared))
    for seat in (0, 1):
        check_best_reply(dmplay.load_problem(f"{path}:Lighthouse"), seat, partner, turns)


def test_a_best_response_too_large_to_plan_leaves_the_joint_plan_and_says_so() -> None:
    for partner, turns in (("random", 40), ("search", 3), ("human", 3)):
        question = AdviceQuestion(0, turns, ("human", partner))
        agent = find_hint_provider(parse_team_file(format_dectiger()), question)
        assert agent is not None
        assert agent.basis.players == "if the whole team follows the plan"
        assert agent.basis.accuracy is not Accuracy.EXACT


@pytest.mark.parametrize("partner", ["optimal", "random"])
def test_a_hint_does_not_depend_on_what_the_partner_observes(partner: str) -> None:
    problem, hints = parse_team_file(format_dectiger()), defaultdict[bytes, set[str]](set)
    partner_observations = set()
    for seed in range(40):
        seated = [None, load_agent(problem, 1, partner)]
        session = Session(problem, dmplay.SeededUniforms(seed), seated, turn_limit=4)
        for _ in range(2):
            session.advance([0, None])
        provider = HintProvider(session, AdviceQuestion.of_session(session, 0, ["human", partner]))
        observed, others = (
            np.array([session.observation_after(seat, turn) for turn in (1, 2)]).tobytes()
            for seat in (0, 1)
        )
        hints[observed].add(f"{provider.create_hint()} {provider.forecast_action(1)}")
        partner_observations.add((observed, others))
    assert [len(texts) for texts in hints.values()] == [1] * 4
    assert len(partner_observations) > 8


@pytest.mark.parametrize("seat", [0, 1])
@pytest.mark.parametrize("other", ["sweep", "random", "reactive"])
def test_advice_in_a_hunt_follows_the_belief_and_the_action_of_the_partner(
    other: str, seat: int
) -> None:
    hunt = dmplay.load_problem("collaborative-predator-prey", hexes=((0, 0), (1, 0), (1, 1)))
    players = ("human", other) if seat == 0 else (other, "human")
    partner = cast(SeatPolicy, load_agent(hunt, 1 - seat, other))
    for turns in (1, 3):
        agent = find_hint_provider(hunt, AdviceQuestion(seat, turns, players))
        assert agent is not None
        assert (agent.basis.players, agent.basis.accuracy) == (f"with {other}", Accuracy.ESTIMATED)
        evaluation = Evaluation(hunt, agent.policy, partner)
        memory = agent.policy.initial_memory(np.array([-1]))
        key = evaluation.key_of(partner.initial_memory(np.array([-1])))
        belief = initial_belief(hunt)
        distribution = {(s, key): p for s, p in enumerate(belief.tolist())}
        values = agent.policy.action_values(memory)
        assert values is not None
        for action, value in enumerate(values[0].tolist()):
            expected = evaluation.action_value(distribution, memory, turns, action)
            assert value == pytest.approx(expected)  # Plans of a few turns are the best ones.
            bounds = agent.policy.value_bounds(memory, np.array([action]))
            assert bounds is not None
            assert (bounds[0][0], bounds[1][0]) == pytest.approx((expected, expected))
            forecast = agent.policy.forecast_observations(memory, action)
            assert forecast is not None
            joint = np.zeros((len(forecast[0]), len(belief)))
            reward = 0.0
            for (s, _), p_state in distribution.items():
                for joint_action, p_action in evaluation._joint_actions(s, key, action):
                    p, outcome = evaluation._enumerate(s, joint_action)
                    next_states = hunt.state_indices(outcome.state)
                    cells = outcome.observations[:, seat], next_states
                    np.add.at(joint, cells, p_state * p_action * p)
                    reward += p_state * p_action * float(p @ outcome.rewards[:, seat])
            assert agent.policy.expected_reward(memory, action) == pytest.approx(reward)
            np.testing.assert_allclose(forecast[0][:, None] * forecast[1], joint, atol=1e-12)


def test_upper_bounds_are_no_smaller_than_the_returns_of_constant_teams() -> None:
    problem = dmplay.load_problem("collaborative-predator-prey:circle")
    agent = find_hint_provider(problem, AdviceQuestion(0, None, ("human", "random")))
    assert agent is not None
    assert agent.basis.accuracy is Accuracy.UPPER_BOUND
    bounds = agent.policy.action_values(agent.policy.initial_memory(np.array([0])))
    assert bounds is not None
    states = problem.enumerate_states()
    belief = Session(problem, dmplay.SeededUniforms(7)).view(0).belief
    for action, partner_action in [(0, 0), (0, 3), (1, 4), (2, 5), (3, 3), (5, 2)]:
        p, outcome = enumerate_outcomes(
            problem, states, np.tile([action, partner_action], (len(states), 1))
        )
        transition = np.zeros((len(states), len(states)))
        next_states = problem.state_indices(outcome.state.reshape(-1, *states.shape[1:]))
        rows = np.arange(len(states)).repeat(p.shape[1])
        np.add.at(transition, (rows, next_states), p.reshape(-1))
        rewards = (p * outcome.rewards[..., 0]).sum(axis=1)
        returns = np.linalg.solve(np.eye(len(states)) - problem.discount * transition, rewards)
        assert belief @ returns <= bounds[0, action]


def test_every_hint_provider_says_how_accurate_its_values_are() -> None:
    for name in problem_names():
        for variant in load_variants(name).values():
            for turns in (*TURNS, None):
                people = ("human",) * len(variant.agents)
                agent = find_hint_provider(variant, AdviceQuestion(0, turns, people))
                assert agent is not None
                if agent.basis.accuracy is Accuracy.UNKNOWN:
                    session = Session(variant, dmplay.SeededUniforms(7), turn_limit=turns)
                    memory = agent.policy.initial_memory(
                        np.asarray(session.observation_after(0, 0))[None]
                    )
                    assert agent.policy.action_values(memory) is None
