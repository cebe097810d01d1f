"""Looking back at a person's moves: what each action was worth, the best, and the regret."""

from collections.abc import Iterator, Sequence
from math import ceil
from typing import NamedTuple

import numpy as np

from dmplay.advice.adviser import count_decimals, format_fixed
from dmplay.budget import Budget, scale_progress_part
from dmplay.chance import Reals
from dmplay.describe import align_columns, format_count
from dmplay.finding import agents
from dmplay.session import SeatedPolicy, Session
from dmplay.solvers.value_iteration import mark_best_actions
from dmplay.thought import TaskInfo, run_cancellable

REVIEW_NOTE_PREFIX = "# review "
MAX_BAR_COLUMNS = 20  # columns of a bar of regret
REVIEW_TASK = TaskInfo("looking back at your moves")


class ReviewedAction(NamedTuple):
    """One move of a person, valued."""

    turn: int
    seat: str
    chosen: str
    best: tuple[str, ...]
    regret: float
    values: dict[str, float]

    def __str__(self) -> str:
        """One line."""
        told = f"turn {self.turn}, {self.seat}: chose {self.chosen}"
        places = count_decimals([*self.values.values()])
        each = ", ".join(
            f"{name} {format_fixed(value, places)}" for name, value in self.values.items()
        )
        if self.chosen in self.best:
            return f"{told}, the best. values: {each}"
        names = " or ".join(self.best)
        return f"{told}, best {names}, regret {format_fixed(self.regret, places)}. values: {each}"


def review_actions(
    session: Session, human_seats: Sequence[int], player_names: Sequence[str] = ()
) -> Iterator[ReviewedAction]:
    """Every move of these people that the adviser can value, in order; `seats` says who plays."""
    problem = session.problem
    past = session.copy_at_start()
    advisers = {}
    for seat in human_seats:
        found = agents.find_hint_provider(problem, seat, session.turn_limit, player_names)
        if found and problem.actions[seat].labels:
            advisers[seat] = SeatedPolicy(past, seat, found[1])
    budget = Budget("the review", "a shorter game")
    for number, turn in enumerate(session.turns, 1):
        budget.spend_work(1.0, (number - 1) / len(session.turns))
        for seat, adviser in advisers.items():
            with scale_progress_part(number - 1, len(session.turns)):
                values = adviser.action_values()
            if values is not None and not past.is_inactive(seat):
                yield _review_action(past, seat, number, int(turn.actions[seat]), values)
        past.append_turns([turn])


def _review_action(
    session: Session, seat: int, turn: int, action: int, values: Reals
) -> ReviewedAction:
    """A move valued against the best that was open."""
    labels = session.action_labels(seat)
    legal = session.legal_actions_mask(seat)
    able = np.ones(len(labels), bool) if legal is None else legal
    known = np.where(able, values, -np.inf)
    top = tuple(labels[a] for a in np.flatnonzero(mark_best_actions(known)))
    each = {labels[a]: float(known[a]) for a in np.flatnonzero(able)}
    regret = 0.0 if labels[action] in top else float(known.max() - known[action])
    return ReviewedAction(turn, session.problem.agents[seat], labels[action], top, regret, each)


def format_summary(reviewed_actions: list[ReviewedAction]) -> str:
    """How many moves were the best, and what the others lost."""
    if not reviewed_actions:
        return "review: no agent here knows the values of these moves"
    right = sum(move.chosen in move.best for move in reviewed_actions)
    lost = sum(move.regret for move in reviewed_actions)
    worst = max(reviewed_actions, key=lambda move: move.regret)
    total = format_fixed(lost, count_decimals([lost]))
    told = f"review: {right} of {format_count(len(reviewed_actions), 'move')} the best, regret {total} in all"
    return told if right == len(reviewed_actions) else f"{told}, most in turn {worst.turn}"


def run_review(
    session: Session, human_seats: Sequence[int], player_names: Sequence[str]
) -> list[ReviewedAction]:
    """The moves of these people, for whom it may take long."""
    return run_cancellable(
        REVIEW_TASK, lambda: [*review_actions(session, human_seats, player_names)]
    )


def format_table(reviewed_actions: list[ReviewedAction]) -> list[str]:
    """The review as columns: turn, choice, best and regret, the worst first; and its sum."""
    most = max((move.regret for move in reviewed_actions), default=0.0)
    places = count_decimals([move.regret for move in reviewed_actions])
    seats = len({move.seat for move in reviewed_actions}) > 1
    rows = [["turn", *["seat"] * seats, "yours", "best", "regret"]]
    for move in sorted(reviewed_actions, key=lambda move: -move.regret):
        bar = "#" * ceil(MAX_BAR_COLUMNS * (move.regret / most)) if move.regret else ""
        regret = f"{format_fixed(move.regret, places)} {bar}".strip()
        seat = [move.seat] * seats
        best = "any" if len(move.best) == len(move.values) else " or ".join(move.best)
        rows.append([str(move.turn), *seat, move.chosen, best, regret])
    return [*(align_columns(rows) if reviewed_actions else []), format_summary(reviewed_actions)]


def format_lines(reviewed_actions: list[ReviewedAction]) -> list[str]:
    """The review, a line a move, and its sum."""
    return [*map(str, reviewed_actions), format_summary(reviewed_actions)]


def format_notes(reviewed_actions: list[ReviewedAction]) -> list[str]:
    """The review as notes for the end of a transcript."""
    return [
        f"{REVIEW_NOTE_PREFIX}{line.removeprefix('review: ')}\n"
        for line in format_lines(reviewed_actions)
    ]
