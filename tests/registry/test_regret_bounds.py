"""Bounds of the regret of a choice, by the values of the agent that gives the hints."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.agents.point_based import PointBasedPolicy
from dmplay.agents.single_agent_planning import PomdpOptimalPolicy
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.registry.agents import HintAgent, find_hint_provider
from tests.formats.sources import TIGER_TEXT, write_text_file
from tests.support.programs import run_dmplay

PUSHES = np.array([-0.3, 0.0, 1.0, -2.0])


def load_regulator_agent(turns: int, **parameters: float) -> HintAgent:
    """Return the agent that gives hints in a regulator's game of this many turns."""
    problem = replace(dmplay.load_problem("simple-regulator"), **parameters)
    agent = find_hint_provider(problem, AdviceQuestion(0, turns))
    assert agent is not None
    return agent


@pytest.mark.parametrize(("turns", "factor"), [(1, 0.0), (2, 0.9), (20, 0.9)])
def test_the_regret_of_a_push_is_the_square_of_its_aim_one_turn_later(
    turns: int, factor: float
) -> None:
    agent, s = load_regulator_agent(turns), 0.3
    memory = agent.policy.initial_memory(np.full((4, 1), s))
    regrets = agent.bound_regrets(memory, None, PUSHES)
    assert regrets == pytest.approx(np.tile(factor * (s + PUSHES) ** 2, (2, 1)), abs=1e-8)


@pytest.mark.parametrize("noise", [0.1, 4.0])
def test_the_values_of_pushes_too_far_to_undo_are_within_their_bounds(noise: float) -> None:
    agent, turns, games = load_regulator_agent(5, noise=noise), 5, 200_000
    generator = np.random.default_rng(0)
    for s, push in [(0.3, 10.0), (15.0, 9.0), (-9.5, -4.0), (30.0, -10.0)]:
        memory = agent.policy.initial_memory(np.array([[s]]))
        bounds = agent.policy.value_bounds(memory, np.array([push]))
        assert bounds is not None
        low, high = bounds
        x, returns, action = np.full(games, s), np.zeros(games), np.full(games, push)
        for turn in range(turns):
            returns -= 0.9**turn * x * x
            x = x + action + noise * generator.standard_normal(games)
            action = np.clip(-x, -10.0, 10.0)
        error = 5 * returns.std() / games**0.5
        assert low[0] - error <= returns.mean() <= high[0] + error
        assert high[0] - low[0] <= 20 * noise**2


@dataclass(frozen=True)
class BoundedPlan(PointBasedPolicy):
    """Calls its values bounds, as if there were too many states for all alpha vectors."""

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        return super().values_basis(question)._replace(accuracy=Accuracy.LOWER_BOUND)


def test_bounds_of_values_give_bounds_of_the_regret(tmp_path: Path) -> None:
    problem = dmplay.load_problem(str(write_text_file(tmp_path, "tiger.pomdp", TIGER_TEXT)))
    question = AdviceQuestion(0, 4)
    exact = HintAgent("exact", PomdpOptimalPolicy(problem, 0, horizon=4), question)
    loose = HintAgent("loose", BoundedPlan(problem, 0, horizon=4), question)
    assert (exact.has_exact_regrets, loose.has_exact_regrets) == (True, False)
    beliefs = np.random.default_rng(3).dirichlet([1.0, 1.0], 50)
    widths = 0.0
    for action in range(3):
        actions = np.full(50, action)
        memory = (beliefs, np.zeros(50, int))
        truth = exact.bound_regrets(memory, None, actions)
        bounds = loose.bound_regrets(memory, None, actions)
        assert truth is not None
        assert bounds is not None
        assert np.all(bounds[0] <= truth[0] + 1e-8)
        assert np.all(truth[1] <= bounds[1] + 1e-8)
        widths += float((bounds[1] - bounds[0]).sum())
    assert widths > 0.0


SHOUT = '''
import dmplay
import numpy as np
from dataclasses import dataclass


class Shout(dmplay.Problem):
    """Shout as loudly as the wind."""

    actions = (dmplay.Interval(0.0, 1.0),)
    state_count = dmplay.ContinuousStates(1)
    horizon = 3

    def format_state(self, s):
        return repr(float(s[0]))

    def parse_state(self, text):
        return np.array([float(text)])

    def initial_chance(self, rows):
        return (dmplay.Uniform(np.zeros(rows), np.ones(rows)),)

    def initial_states(self, rows, events):
        return np.stack(events, axis=1)

    def chance(self, s, a):
        return (dmplay.Uniform(np.zeros(len(s)), np.ones(len(s))),)

    def resolve_events(self, s, a, events):
        next_state = np.stack(events, axis=1)
        return dmplay.Outcome(next_state, -((a - s) ** 2), next_state)


@dataclass(frozen=True)
class Echo(dmplay.ReactivePolicy):
    """Shouts as loudly as the wind."""

    def choose(self, memory, legal, u):
        return memory[0][:, 0]

    def value_bounds(self, memory, actions):
        value = -((actions - memory[0][:, 0]) ** 2)  # of this turn; later ones are equal
        return value, value


PROBLEM = Shout
AGENTS = dmplay.Roster({"echo": Echo}, hint_provider="echo")
'''


def test_a_users_agent_that_values_real_numbers_reviews_them(tmp_path: Path) -> None:
    (tmp_path / "shout.py").write_text(SHOUT)
    words = ("./shout.py", "--seed", "3", "-o", "g.dmt")
    run_dmplay(tmp_path, *words, stdin="0.25\n0.5\n1\n")
    moves = dmplay.review(tmp_path / "g.dmt", trusted=True)
    game = dmplay.Playback(tmp_path / "g.dmt", trusted=True)
    list(game.iter_agent_turns())
    states = [game.session.initial_state, *(turn.state for turn in game.session.turns)]
    lost = [(push - float(s[0])) ** 2 for push, s in zip([0.25, 0.5, 1.0], states, strict=False)]
    assert [move.regret for move in moves] == pytest.approx(lost, abs=1e-7)
    problem = game.session.problem
    agent = dmplay.load_agent(problem, 0, "random")
    result = dmplay.run(problem, [agent], episodes=20, regret=True)
    assert result.rollout.regrets[:, 0, 1, 0] == pytest.approx(-result.rollout.total_rewards[:, 0])
