"""Solutions of games in which everyone sees the state: their equilibria."""

from collections.abc import Sequence

import numpy as np

from dmplay.chance import Reals
from dmplay.core import Problem
from dmplay.describe import at_most, counted
from dmplay.policies import seeing
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solutions.played import planning
from dmplay.solutions.seen import shown_of, worth
from dmplay.solutions.solution import Row, Solution, mixed
from dmplay.solvers import (
    best_replies,
    extreme_equilibria,
    graph,
    lemke_howson,
    markov_game,
    matrix_game,
    regret_matching,
)
from dmplay.solvers.matrix_game import Profile


def equilibria(problem: Problem) -> Solution:
    """Every Nash equilibrium of one round of two; where these are too many to look for, one.

    Where they are infinitely many, those of which all others are mixtures.
    """
    payoffs = matrix_game.table(problem)
    extreme = extreme_equilibria.of_degenerate(payoffs)
    found = extreme or matrix_game.nash_of_few(payoffs)
    if not found:
        one = lemke_howson.equilibrium(payoffs)
        gain = max(float(matrix_game.regrets(payoffs, one).max()), 0.0)
        pay = matrix_game.utilities(payoffs, one).tolist()
        told = f"a Nash equilibrium of one round; by another action nobody gains {_small(gain)}"
        return Solution("Lemke and Howson's pivoting", told, [_played(problem, one, pay)])
    rows = [_played(problem, one, matrix_game.utilities(payoffs, one).tolist()) for one in found]
    method = f"{'vertex' if extreme else 'support'} enumeration"
    if _mixed(extreme):
        many = f"{len(rows)} extreme Nash equilibria of one round; all others are mixtures of these"
        return Solution(method, many, rows)
    many = f"{len(rows)} Nash equilibri{'um' if len(rows) == 1 else 'a'} of one round"
    return Solution(method, many, rows)


def _mixed(extreme: Sequence[Profile]) -> bool:
    """Whether mixtures of some of these are equilibria too: an agent plays the same in both."""
    return any(
        len({mix.tobytes() for mix in mixes}) < len(extreme) for mixes in zip(*extreme, strict=True)
    )


def several(problem: Problem) -> Solution:
    """What more than two play in one round, and how far that is from an equilibrium."""
    payoffs = matrix_game.table(problem)
    found = regret_matching.equilibrium(payoffs)
    each = enumerate(found.mixes)
    pay = [float(mix @ regret_matching.replies(payoffs, found.mixes, at)) for at, mix in each]
    rounds = counted(found.rounds, "round")
    method = f"regret matching, {rounds}" if found.rounds else "pure actions"
    told = f"one round; by another action nobody gains {_small(float(found.gains.max()))}"
    return Solution(method, told, [_played(problem, found.mixes, pay)])


def _small(gain: float) -> str:
    """How much is gained at most."""
    return f"more than {at_most(gain)}" if gain > 0 else "anything"


def _played(problem: Problem, mixes: Sequence[Reals], pay: Sequence[float]) -> Row:
    """What each agent plays, and is paid."""
    row: Row = {}
    for seat, (agent, mix) in enumerate(zip(problem.agents, mixes, strict=True)):
        row[agent] = mixed(problem, seat, mix)
        row[f"pays {agent}"] = float(pay[seat])
    return row


def hunt(problem: PredatorPrey) -> Solution:
    """The equilibrium of one predator and one prey, state by state."""
    found = markov_game.equilibrium(problem)
    rows: list[Row] = []
    for place, s in enumerate(problem.enumerated()):
        row: Row = {"state": problem.notation(s)}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = float(found.values[seat][place])
        for seat, agent in enumerate(problem.agents):
            row[agent] = mixed(problem, seat, found.play[seat][place])
        rows.append(row)
    gaps = " and ".join(map(at_most, found.gaps))
    rounds = counted(len(found.changes), "round")
    told = (
        f"change {found.changes[-1]:.1g} after {rounds}; by any other policy "
        f"predator and prey gain at most {gaps}"
    )
    return Solution("equilibrium, by policy iteration over matrix games", told, rows)


def opposed(problem: Problem) -> Solution:
    """What both play in a Markov game of two who are opposed, and what that is worth."""
    horizon = planning(problem.horizon)
    found = seeing.opposed(problem, horizon)
    before = None if horizon is None else horizon - 1
    shown = shown_of(problem, found.graph)
    live = shown[np.isin(shown, found.graph.live)]
    _, both = found.played(live, problem.discount, before)
    rows: list[Row] = []
    for at, place in enumerate(live.tolist()):
        value = float(both.values[at])
        row: Row = {"state": problem.notation(found.graph.states[place])}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = value if seat == 0 else -found.share * value + 0.0
        for seat, agent in enumerate(problem.agents):
            row[agent] = mixed(problem, seat, both[1 + seat][at])
        rows.append(row)
    first = found.values_of(horizon)
    values = np.stack([first, -found.share * first + 0.0], axis=1)
    span = "without end" if horizon is None else counted(horizon, "turn")
    far = f"at most {at_most(found.gap)} from the value of the game" if found.gap else "exact"
    method = f"Shapley's iteration over {counted(len(first), 'state')}, {span}"
    return Solution(method, f"{worth(problem, found.graph, values)}, {far}", rows)


def replied(problem: Problem) -> Solution:
    """What comes of best replies in a Markov game of several, each for itself."""
    found = best_replies.equilibrium(problem, graph.explored(problem))
    rows: list[Row] = []
    for place in shown_of(problem, found.graph).tolist():
        row: Row = {"state": problem.notation(found.graph.states[place])}
        for seat, agent in enumerate(problem.agents):
            row[f"value {agent}"] = float(found.values[place, seat])
        for seat, agent in enumerate(problem.agents):
            row[agent] = mixed(problem, seat, found.play[seat][place])
        rows.append(row)
    each = zip(found.gains, problem.agents, strict=True)
    gains = ", ".join(f"{gain:.2g} by {agent}" for gain, agent in each)
    told = f"{worth(problem, found.graph, found.values)}; to be gained by another policy: {gains}"
    states, rounds = counted(len(found.values), "state"), counted(found.rounds, "round")
    return Solution(f"best replies over {states}, {rounds}", told, rows)
