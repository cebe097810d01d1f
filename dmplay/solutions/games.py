"""Solutions of games in which everyone sees the state: their equilibria."""

from dmplay.matrix_game import MatrixGame
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.solutions.solution import Row, Solution, mixed
from dmplay.solvers import markov_game, matrix_game


def equilibria(problem: MatrixGame) -> Solution:
    """Every Nash equilibrium of one round."""
    found = matrix_game.nash(problem.payoffs)
    rows: list[Row] = []
    for profile in found:
        row: Row = {}
        pay = matrix_game.utilities(problem.payoffs, profile)
        for seat, (agent, mix) in enumerate(zip(problem.agents, profile, strict=True)):
            row[agent] = mixed(problem, seat, mix)
            row[f"pays {agent}"] = float(pay[seat])
        rows.append(row)
    return Solution(
        "support enumeration",
        f"{len(rows)} Nash equilibri{'um' if len(rows) == 1 else 'a'} of one round",
        rows,
    )


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
    gaps = " and ".join(f"{gap:.1g}" for gap in found.gaps)
    told = (
        f"change {found.changes[-1]:.1g} after {len(found.changes)} rounds; by any other policy "
        f"predator and prey gain at most {gaps}"
    )
    return Solution("equilibrium, by policy iteration over matrix games", told, rows)
