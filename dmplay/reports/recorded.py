"""Games of a run that are kept as transcripts: some of all, the worst and the best."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dmplay.errors import BadParameter
from dmplay.game.request import GameRequest
from dmplay.game.start import start_new_game
from dmplay.measure.running import RunResult
from dmplay.reports.match import SettingResult
from dmplay.solutions.solution import Row


class TranscriptSelection(NamedTuple):
    """Where games are kept, and which: each so many, so many worst and best of the first seat."""

    folder: Path | None = None
    every_nth: int = 0
    worst_count: int = 0
    best_count: int = 0

    def check_options(self) -> None:
        """Refuses a folder without games, games without a folder, and one that has files."""
        wanted = self.every_nth or self.worst_count or self.best_count
        if wanted and self.folder is None:
            raise BadParameter("--every, --worst and --best: expected --record DIR too")
        if self.folder is None:
            return
        if not wanted:
            raise BadParameter("--record: expected --every N, --worst N or --best N too")
        if self.folder.exists() and (not self.folder.is_dir() or any(self.folder.iterdir())):
            raise BadParameter(f"--record: {self.folder} is not empty; name another folder")


NO_TRANSCRIPTS = TranscriptSelection()


def record_episodes(setting_result: SettingResult, selection: TranscriptSelection) -> Iterator[Row]:
    """Plays the games of a run that are wanted again, into transcripts; a row for each."""
    if selection.folder is None:
        return
    match, (problem, names, _), result = (
        setting_result.request,
        setting_result.lineup,
        setting_result.run,
    )
    place = selection.folder / str(setting_result)
    place.mkdir(parents=True, exist_ok=True)
    seats = [f"{seat}={name}" for seat, name in zip(problem.agents, names, strict=True)]
    for row, why in _select_rows(result, selection).items():
        episode = int(result.episode_numbers[row])
        path = place / f"game-{episode}.dmt"
        game = start_new_game(
            GameRequest(
                match.problem, settings=match.settings, seed=match.seed, episode=episode,
                agent=names[0], seats=seats, turns=match.turn_limit, record_path=path, can_ask=False,
            )
        )  # fmt: skip
        list(game.iter_agent_turns())
        game.finish()
        told = ", ".join(why)
        yield {"kept": str(path), "why": told, "return": float(result.rollout.returns[row, 0])}


def _select_rows(result: RunResult, selection: TranscriptSelection) -> dict[int, list[str]]:
    """Which rows are kept, and why."""
    order = np.argsort(result.rollout.returns[:, 0], kind="stable").tolist()
    wanted: dict[int, list[str]] = {}
    every = range(0, len(order), selection.every_nth) if selection.every_nth else ()
    best = order[::-1][: selection.best_count]
    for why, rows in (("worst", order[: selection.worst_count]), ("best", best), ("every", every)):
        for row in rows:
            wanted.setdefault(row, []).append(why)
    return wanted
