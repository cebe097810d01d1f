"""Recorded games as data: the rows of their turns, their returns and their review."""

import glob
import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, overload

from dmplay.core.data_frames import make_frame
from dmplay.core.problem import find_seat
from dmplay.errors import BadParameter, BadTranscript, DmplayError
from dmplay.game.hints.review import Review
from dmplay.game.playback import Playback
from dmplay.game.seat_status import format_prompt
from dmplay.game.seats import list_human_seats
from dmplay.game.transcript_verification import iter_transcript_files
from dmplay.game.turn_facts import Row, flatten_turn_facts, join_review
from dmplay.registry.problems import LoadedProblem, ProblemLike

PathLike = str | os.PathLike[str]


class RecordedGame(Playback):
    """A recorded game at its last turn, with a row for each turn; `go_to_turn` steps through it."""

    def __init__(self, path: Path, **options: Any) -> None:
        super().__init__(path, **options)
        self.turns: list[Row] = [*map(flatten_turn_facts, self.iter_turn_facts())]
        agents, session = self.problem.agents, self.session
        self.returns = dict(zip(agents, session.returns().tolist(), strict=True))
        self.total_rewards = dict(zip(agents, session.total_rewards().tolist(), strict=True))
        self.end_reason = session.end_reason or ""

    def review(self, seat: str = "") -> Review:
        """Return the review of each choice of a seat, as `dmplay.review` does."""
        return self.review_choices(seat)

    def prompt(self, seat: str = "", *, belief: bool = False, rules: bool = False) -> str:
        """Return the knowledge of a seat at the present turn as text for a language model.

        It is that of a game of `play`; without a seat, for the first person's or the first seat.
        """
        index = (
            find_seat(self.problem, seat)
            if seat
            else (list_human_seats(self.player_names) or [0])[0]
        )
        return format_prompt(
            self.session, index, self.player_names, shows_belief=belief, shows_rules=rules
        )

    def list_rows(self, *, review: bool = False) -> list[Row]:
        """Return a row for the start and for each turn; with `review`, also values and regret."""
        return join_review(self.turns, self.review()) if review else self.turns

    def to_frame(self, library: str = "", *, review: bool = False) -> Any:
        """Return the rows as a data frame of pandas, or of the `library` polars."""
        return make_frame(self.list_rows(review=review), library)

    def __repr__(self) -> str:
        turns, path = len(self.session.turns), self.transcript.path
        return f"<RecordedGame {path}: {self.problem_name}, {turns} turns, {self.end_reason}>"


class RecordedGames(list[RecordedGame]):
    """Recorded games, and the error of each file that is none."""

    def __init__(self, games: Iterable[RecordedGame] = (), errors: Sequence[str] = ()) -> None:
        super().__init__(games)
        self.errors = [*errors]

    def list_rows(self, *, review: bool = False) -> list[Row]:
        """Return the rows of all games, with the file and the problem of each."""
        return [row for game in self for row in list_rows_with_file(game, review=review)]

    def to_frame(self, library: str = "", *, review: bool = False) -> Any:
        """Return the rows of all games as a data frame of pandas, or of the `library` polars."""
        return make_frame(self.list_rows(review=review), library)

    def __repr__(self) -> str:
        errors = f", {len(self.errors)} errors" if self.errors else ""
        return f"<{len(self)} recorded games{errors}>"


def list_rows_with_file(game: RecordedGame, *, review: bool = False) -> list[Row]:
    """Return the rows of a game, with its file and problem in the first columns."""
    names: Row = {"file": str(game.transcript.path), "problem": game.problem_name}
    return [names | row for row in game.list_rows(review=review)]


def iter_games(
    files: Iterable[Path],
    *,
    problem: ProblemLike | None = None,
    trusted: bool = False,
    peek: bool = False,
) -> Iterator[RecordedGame | DmplayError]:
    """Yield the game in each file, or the error that names the file."""
    loaded_problems: dict[object, LoadedProblem] = {}
    for file in files:
        try:
            yield RecordedGame(
                file, problem=problem, trusted=trusted, peek=peek, loaded_problems=loaded_problems
            )
        except BadTranscript as error:
            yield error
        except DmplayError as error:
            message = str(error)
            yield error if str(file) in message else BadParameter(f"{file}: {message}")


@overload
def read(
    path: PathLike,
    *,
    problem: ProblemLike | None = ...,
    trusted: bool = ...,
    peek: bool = ...,
    skip_bad: bool = ...,
) -> Any: ...
@overload
def read(
    path: Sequence[PathLike],
    *,
    problem: ProblemLike | None = ...,
    trusted: bool = ...,
    peek: bool = ...,
    skip_bad: bool = ...,
) -> RecordedGames: ...
def read(
    path: PathLike | Sequence[PathLike],
    *,
    problem: ProblemLike | None = None,
    trusted: bool = False,
    peek: bool = False,
    skip_bad: bool = False,
) -> Any:
    """Return the game in a transcript; for a folder, a pattern or a list of paths, all games.

    A pattern such as `games/*.dmt` is that of `glob`, and a folder is searched with its subfolders.
    The games are a list, `RecordedGames`. A `problem`, by name, class, function or object, takes
    the place of the recorded name. Code that a file names is imported only if it is
    `trusted`. `peek` shows hidden information of a game that can be continued, and marks its file.
    Raise BadTranscript or BadParameter for a file that cannot be read; with `skip_bad`, its message
    is in `errors` of the list instead.
    """
    single_path = Path(path) if isinstance(path, str | os.PathLike) else None
    paths = [path] if isinstance(path, str | os.PathLike) else [*path]
    files = [Path(file) for item in paths for file in _expand_pattern(os.fspath(item))]
    games = RecordedGames()
    transcripts = iter_transcript_files(files)
    for game in iter_games(transcripts, problem=problem, trusted=trusted, peek=peek):
        if isinstance(game, RecordedGame):
            games.append(game)
        elif skip_bad:
            games.errors.append(str(game))
        else:
            raise game
    is_single_file = files == [single_path] and not files[0].is_dir()
    return games[0] if is_single_file and games else games


def _expand_pattern(path: str) -> list[str]:
    """Return the sorted paths that match a pattern, or the path if it exists or is no pattern."""
    if os.path.exists(path) or not glob.has_magic(path):
        return [path]
    matches = sorted(glob.glob(path, recursive=True))
    if not matches:
        raise BadParameter(f"{path}: no file matches this pattern")
    return matches
