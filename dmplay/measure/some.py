"""Games of which, where somebody interrupts them or workers die, those that were played count."""

from collections.abc import Sequence
from concurrent.futures import Executor
from typing import NamedTuple

import numpy as np

from dmplay.blocks import Workers
from dmplay.budget import Watch
from dmplay.chance import Ints
from dmplay.core import Policy, Problem
from dmplay.rollouts import Interrupted, Lost, Luck, Rollout, rollouts


class Some(NamedTuple):
    """What was played of some games, and what cut it short."""

    played: tuple[Rollout, ...]  # by each entrant; none where there are no games
    games: Ints  # which they are
    short: Interrupted | Lost | None


def some(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    entrants: Sequence[Sequence[Policy]],
    *,
    games: range,
    turns: int | None,
    seed: int,
    workers: Workers,
    executor: Executor | None,
    progress: Watch | None,
    keep: Sequence[str],
    luck: Luck | None = None,
) -> Some:
    """These games by each of some entrants, as far as they come."""
    try:
        played = rollouts(
            problem, entrants, episodes=len(games), first=games.start, turns=turns, seed=seed,
            workers=workers, executor=executor, progress=progress, keep=keep, luck=luck,
        )  # fmt: skip
    except (Interrupted, Lost) as error:
        return Some(*error.rest, error)
    return Some(played, np.array(games), None)
