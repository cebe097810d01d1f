"""Transcripts of selected episodes of a run: every n-th, the worst and the best."""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dmplay.errors import BadParameter
from dmplay.evaluation.many_games import RunResult
from dmplay.evaluation.solutions.solution import Row
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest
from dmplay.output.evaluation_request import SettingResult


class TranscriptSelection(NamedTuple):
    """The folder for transcripts, and the episodes to record: every n-th, worst and best.

    The worst and best episodes are those of the first seat's return.
    """

    folder: Path | None = None
    every_nth: int = 0
    worst_count: int = 0
    best_count: int = 0

    def check_options(self) -> None:
        """Raise BadParameter if folder and episodes are not both given, or if the folder is
        another kind of file or not empty.
        """
        selects_episodes = self.every_nth or self.worst_count or self.best_count
        if selects_episodes and self.folder is None:
            raise BadParameter("--every, --worst and --best: expected --record DIR too")
        if self.folder is None:
            return
        if not selects_episodes:
            raise BadParameter("--record: expected --every N, --worst N or --best N too")
        if self.folder.exists() and not self.folder.is_dir():
            raise BadParameter(f"--record: {self.folder} is not a folder; name another folder")
        if self.folder.exists() and any(self.folder.iterdir()):
            raise BadParameter(f"--record: {self.folder} is not empty; name another folder")


NO_TRANSCRIPTS = TranscriptSelection()


def record_episodes(setting_result: SettingResult, selection: TranscriptSelection) -> Iterator[Row]:
    """Play the selected episodes of a run again, recording transcripts; yield a row for each."""
    if selection.folder is None:
        return
    match = setting_result.request
    problem, names, _ = setting_result.lineup
    result = setting_result.run
    folder = selection.folder / str(setting_result).replace("/", "_")  # of an agent's file
    folder.mkdir(parents=True, exist_ok=True)
    seats = [f"{seat}={name}" for seat, name in zip(problem.agents, names, strict=True)]
    for row, reasons in _select_rows(result, selection).items():
        episode = int(result.episode_numbers[row])
        path = folder / f"game-{episode}.dmt"
        game = start_new_game(
            GameRequest(
                match.problem,
                settings=match.settings,
                seed=match.seed,
                episode=episode,
                seats=seats,
                turns=match.turn_limit,
                record_path=path,
                can_ask=False,
            )
        )
        list(game.iter_agent_turns())
        game.finish()
        reason_text = "; ".join(filter(None, (", ".join(reasons), game.narrator.end_explanation)))
        yield {
            "kept": str(path),
            "why": reason_text,
            "return": float(result.rollout.returns[row, 0]),
        }


def _select_rows(result: RunResult, selection: TranscriptSelection) -> dict[int, list[str]]:
    """Return the selected rows, each with its reasons: worst, best or every."""
    order = np.argsort(result.rollout.returns[:, 0], kind="stable").tolist()
    selected: dict[int, list[str]] = {}
    nth_rows = range(0, len(order), selection.every_nth) if selection.every_nth else ()
    best = order[::-1][: selection.best_count]
    for reason, rows in (
        ("worst", order[: selection.worst_count]),
        ("best", best),
        ("every", nth_rows),
    ):
        for row in rows:
            selected.setdefault(row, []).append(reason)
    return selected
