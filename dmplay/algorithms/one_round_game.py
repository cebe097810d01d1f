"""One round of a matrix game: its payoffs, and best responses to mixed strategies.

Source: sections 24.1 and 24.2, Simple Games and Response Models. A mixed strategy is a probability
for each action of an agent.
"""

from collections.abc import Sequence
from math import prod

import numpy as np

from dmplay.algorithms.formula_text import format_weighted_sum
from dmplay.algorithms.step import StrategyMixes
from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import compute_reward_scale, mark_best_actions, select_greedy_actions
from dmplay.core.chance import FINITE_CHANCE_TYPES
from dmplay.core.problem import Problem, enumerate_outcomes
from dmplay.core.tabular import joint_actions
from dmplay.core.text import format_score

MAX_JOINT_ACTIONS = 2**16
MAX_NAMED_TIES = 4  # equally good actions that a sentence lists
ONE_ROUND_SENTENCE = "The game is played once; the rounds here are steps of thinking."
BEST_RESPONSE_SENTENCE = (
    "Best responses (>) maximize U = sum of (probability of the others' actions x payoff)."
)


def explain_matrix_game_misfit(problem: Problem, algorithm: str) -> str:
    """Return why a problem is not a matrix game that can be listed; '' if it is one."""
    joint_action_count = prod(problem.action_counts)
    mismatch = ""
    if len(problem.agents) < 2:
        mismatch = "at least two agents, but this problem has one"
    elif problem.partially_observable or problem.state_count != 1:
        mismatch = "a game of one state, played in rounds, but this problem has more states"
    elif not joint_action_count:
        mismatch = "actions with names, but some actions of this game are real numbers"
    elif joint_action_count > MAX_JOINT_ACTIONS:
        limit = f"{MAX_JOINT_ACTIONS:,}"
        mismatch = f"at most {limit} joint actions, but this game has {joint_action_count:,}"
    elif not _has_listed_payoffs(problem):
        mismatch = "payoffs of all joint actions, but this game cannot list them"
    return mismatch and f"{algorithm} needs {mismatch}"


def _has_listed_payoffs(problem: Problem) -> bool:
    """Return whether all actions are legal and no chance draws real numbers."""
    state = problem.enumerate_states()
    legal = problem.legal_actions_mask(state)
    chances = problem.chance(state, joint_actions(problem)[:1])
    is_finite = all(isinstance(chance, FINITE_CHANCE_TYPES) for chance in chances)
    return is_finite and (legal is None or bool(legal.all()))


def compute_payoffs(problem: Problem) -> Reals:
    """Return the expected payoffs `[A1, ..., An, n]` of one round."""
    actions = joint_actions(problem)
    states = np.repeat(problem.enumerate_states(), len(actions), axis=0)
    p, outcome = enumerate_outcomes(problem, states, actions)
    expected = np.einsum("bk,bkn->bn", p, outcome.rewards)
    return np.asarray(expected.reshape(*problem.action_counts, len(problem.agents)))


def compute_response_values(payoffs: Reals, mixes: Sequence[Reals], seat: int) -> Reals:
    """Return the expected payoff `[A]` of each action of a seat against the mixes of the others."""
    own_payoffs, weights = _list_weighted_payoffs(payoffs, mixes, seat)
    return np.asarray((own_payoffs * weights).sum(axis=1))


def choose_best_responses(payoffs: Reals, mixes: Sequence[Reals]) -> list[int]:
    """Return the best response of each agent to the mixes of the others; the first if several."""
    scale = compute_reward_scale(payoffs)
    return [
        int(select_greedy_actions(compute_response_values(payoffs, mixes, seat), scale))
        for seat in range(len(mixes))
    ]


def compute_largest_gain(payoffs: Reals, mixes: Sequence[Reals]) -> float:
    """Return the most that an agent gains by a best response; 0 in a Nash equilibrium."""
    values = [compute_response_values(payoffs, mixes, seat) for seat in range(len(mixes))]
    return max(float(v.max() - mix @ v) for v, mix in zip(values, mixes, strict=True))


def describe_payoffs(problem: Problem) -> list[str]:
    """Return the rule of the payoffs, which is the first line of the problem's description."""
    first_line = problem.description().strip().partition("\n")[0]
    return [first_line] if first_line.endswith(".") else []


def describe_ties(problem: Problem, payoffs: Reals, mixes: Sequence[Reals]) -> list[str]:
    """Return sentences about the agents with several best responses, of which the first counts."""
    seats_by_actions: dict[str, list[str]] = {}
    for seat, agent in enumerate(problem.agents):
        values = compute_response_values(payoffs, mixes, seat)
        is_best = mark_best_actions(values[None], compute_reward_scale(payoffs))[0]
        best = np.flatnonzero(is_best).tolist()
        if len(best) < 2:
            continue
        names = [problem.format_action(seat, action) for action in best[:MAX_NAMED_TIES]]
        if len(best) == len(is_best):
            names = ["all actions"]
        elif len(best) > MAX_NAMED_TIES:
            names[-1] = f"{len(best) - MAX_NAMED_TIES + 1} others"
        seats_by_actions.setdefault(" and ".join(names), []).append(agent)
    return [
        f"For {_format_agent_names(problem, agents)}, {names} are equally good; the first is taken."
        for names, agents in seats_by_actions.items()
    ]


def _format_agent_names(problem: Problem, agents: Sequence[str]) -> str:
    """Return the names of agents, or "each agent" if these are all."""
    return "each agent" if len(agents) == len(problem.agents) else " and ".join(agents)


def make_pure_strategies(problem: Problem, actions: Sequence[int]) -> list[Reals]:
    """Return the mixed strategies in which each agent always plays one action."""
    return [np.eye(count)[a] for count, a in zip(problem.action_counts, actions, strict=True)]


def format_actions(problem: Problem, actions: Sequence[int] | Ints) -> str:
    """Return the actions of all agents as text: "agent1 rock, agent2 paper"."""
    return ", ".join(
        f"{agent} {problem.format_action(seat, action)}"
        for seat, (agent, action) in enumerate(zip(problem.agents, actions, strict=True))
    )


def format_response_value(
    problem: Problem, payoffs: Reals, mixes: Sequence[Reals], seat: int, action: int
) -> str:
    """Return the expected payoff of a seat's action as a formula with its numbers."""
    own_payoffs, weights = _list_weighted_payoffs(payoffs, mixes, seat)
    value = compute_response_values(payoffs, mixes, seat)[action]
    terms = format_weighted_sum(weights.tolist(), own_payoffs[action].tolist())
    name = f"U({problem.agents[seat]} {problem.format_action(seat, action)})"
    return f"{name} = {terms} = {format_score(float(value))}"


def draw_mixed_strategies(
    problem: Problem, mixes: Sequence[Reals], best_responses: Sequence[int] = ()
) -> StrategyMixes:
    """Return the mixed strategies of all agents as a picture."""
    labels = [action_set.labels for action_set in problem.actions]
    return StrategyMixes(problem.agents, labels, list(mixes), best_responses)


def _list_weighted_payoffs(
    payoffs: Reals, mixes: Sequence[Reals], seat: int
) -> tuple[Reals, Reals]:
    """Return a seat's payoffs `[A, M]` against M joint actions of the others, and their weights."""
    own_payoffs = np.moveaxis(payoffs[..., seat], seat, 0).reshape(payoffs.shape[seat], -1)
    weights = np.ones(1)
    for other, mix in enumerate(mixes):
        if other != seat:
            weights = np.multiply.outer(weights, mix).reshape(-1)
    return own_payoffs, weights
