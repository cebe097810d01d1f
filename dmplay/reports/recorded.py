"""Games of a run that are kept as transcripts: some of all, the worst and the best."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dmplay.errors import BadParameter
from dmplay.game.request import Request
from dmplay.game.start import new
from dmplay.measure.running import Run
from dmplay.reports.match import Setting
from dmplay.solutions.solution import Row


class Keeping(NamedTuple):
    """Where games are kept, and which: each so many, so many worst and best of the first seat."""

    folder: Path | None = None
    every: int = 0
    worst: int = 0
    best: int = 0

    def check(self) -> None:
        """Refuses a folder without games, games without a folder, and one that has files."""
        wanted = self.every or self.worst or self.best
        if wanted and self.folder is None:
            raise BadParameter("--every, --worst and --best: expected --record DIR too")
        if self.folder is None:
            return
        if not wanted:
            raise BadParameter("--record: expected --every N, --worst N or --best N too")
        if self.folder.exists() and (not self.folder.is_dir() or any(self.folder.iterdir())):
            raise BadParameter(f"--record: {self.folder} is not empty; name another folder")


NONE = Keeping()


def recorded(played: Setting, keeping: Keeping) -> Iterator[Row]:
    """Plays the games of a run that are wanted again, into transcripts; a row for each."""
    if keeping.folder is None:
        return
    match, (problem, names, _), result = played.match, played.lineup, played.run
    place = keeping.folder / str(played)
    place.mkdir(parents=True, exist_ok=True)
    seats = [f"{seat}={name}" for seat, name in zip(problem.agents, names, strict=True)]
    for row, why in _wanted(result, keeping).items():
        episode = int(result.games[row])
        path = place / f"game-{episode}.dmt"
        game = new(
            Request(
                match.problem, settings=match.settings, seed=match.seed, episode=episode,
                agent=names[0], seats=seats, turns=match.turns, record=path, asks=False,
            )
        )  # fmt: skip
        list(game.run())
        game.finish()
        told = ", ".join(why)
        yield {"kept": str(path), "why": told, "return": float(result.played.returns[row, 0])}


def _wanted(result: Run, keeping: Keeping) -> dict[int, list[str]]:
    """Which rows are kept, and why."""
    order = np.argsort(result.played.returns[:, 0], kind="stable").tolist()
    wanted: dict[int, list[str]] = {}
    every = range(0, len(order), keeping.every) if keeping.every else ()
    best = order[::-1][: keeping.best]
    for why, rows in (("worst", order[: keeping.worst]), ("best", best), ("every", every)):
        for row in rows:
            wanted.setdefault(row, []).append(why)
    return wanted
