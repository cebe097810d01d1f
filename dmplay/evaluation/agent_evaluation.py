"""Evaluations of players: where they lost value, by seeing, choosing and luck, for each problem."""

import math
import os
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.core.data_frames import make_frame
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, check_problem, find_seat
from dmplay.core.safe_files import write_file
from dmplay.core.session import Session
from dmplay.core.text import (
    align_columns,
    escape_newlines,
    escape_unprintable,
    format_count,
    format_number,
)
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter, DmplayError, Forfeit
from dmplay.evaluation.interruptible_rollouts import check_episode_count
from dmplay.evaluation.lost_value import Bounds, GameParts, ValueMeter, explain_missing_parts
from dmplay.evaluation.return_bounds import count_weighty_turns
from dmplay.evaluation.solutions.solution import Row
from dmplay.evaluation.statistics import Estimate, estimate_mean, estimate_ratio
from dmplay.game.launch_requests import GameRequest
from dmplay.game.recorded_games import RecordedGame, iter_games
from dmplay.game.seats import HUMAN, list_judged_seats, make_header, shorten_player_name
from dmplay.game.transcript_verification import iter_transcript_files
from dmplay.registry.agents import (
    AgentLike,
    assign_agents,
    find_agent_name,
    format_agent_label,
    load_agent,
    load_roster,
    set_horizon_in_name,
)
from dmplay.registry.problem_name_kinds import names_bot
from dmplay.registry.problems import (
    LoadedProblem,
    ProblemLike,
    identify_problem,
    load_problem,
    resolve_problem,
)
from dmplay.transcript.format import resolve_turn_limit
from dmplay.transcript.regeneration import format_session

DEFAULT_EPISODES = 100
PART_NAMES = ("seeing", "choosing", "luck")
QUANTITIES = ("start value", "regret per turn", *PART_NAMES)
NOT_STATED = "not stated"  # 0, as the belief is assumed to be the exact one
Progress = Callable[[float], object]


class EvaluatedGame(NamedTuple):
    """A finished game of one player, and the parts of its return."""

    name: str  # its file, or its episode
    turn_count: int
    discounted_return: float
    parts: GameParts | None  # None if the values of the game are neither exact nor bounded
    hint_count: int = 0

    @property
    def choice_count(self) -> int:
        """The number of turns in which the player chose."""
        return sum(turn.has_choice for turn in self.parts.turns) if self.parts else 0

    @property
    def stated_count(self) -> int:
        """The number of turns with a stated belief."""
        return sum(turn.nats is not None for turn in self.parts.turns) if self.parts else 0

    def sum_turns(self, name: str) -> Bounds:
        """Return the sum of a quantity over all turns that have it, not discounted."""
        pairs = [getattr(turn, name) for turn in self.parts.turns] if self.parts else []
        bounds = [pair if isinstance(pair, tuple) else (pair, pair) for pair in pairs if pair]
        return math.fsum(low for low, _ in bounds), math.fsum(high for _, high in bounds)

    def make_row(self) -> Row:
        """Return the game as a row of data; its parts are sums over the game, discounted."""
        row: Row = {
            "game": self.name,
            "turns": self.turn_count,
            "return": self.discounted_return,
            "stated beliefs": self.stated_count,
        }
        quantities: dict[str, Bounds | None] = dict.fromkeys(QUANTITIES)
        if self.parts:
            count = max(self.choice_count, 1)
            low, high = self.sum_turns("regret")
            quantities |= {"start value": self.parts.start_value}
            quantities |= {"regret per turn": (low / count, high / count)}
            quantities |= {name: self.parts.sum_discounted(name) for name in PART_NAMES}
        for name, bounds in quantities.items():
            row |= _make_cells(name, bounds)
        stated = self.stated_count
        row["nats"] = self.sum_turns("nats")[0] / stated if stated else None
        regret = self.sum_turns("stated_regret")
        mean = (regret[0] / stated, regret[1] / stated) if stated else None
        return row | _make_cells("stated regret", mean)


class BoundedEstimate(NamedTuple):
    """The means of the lower and of the upper bound of a quantity; equal if it is exact."""

    low: Estimate
    high: Estimate

    @property
    def is_exact(self) -> bool:
        """True if the quantity is exact in every game."""
        return self.low == self.high


class PlayerEvaluation(NamedTuple):
    """The games of one player in one seat of one problem."""

    problem: str
    player: str
    seat: str
    games: tuple[EvaluatedGame, ...]
    has_hidden_states: bool
    has_other_seats: bool
    remarks: tuple[str, ...] = ()  # why parts or games are missing

    @property
    def returns(self) -> Estimate:
        """The mean discounted return of a game; without games, all its numbers are nan."""
        return _estimate([game.discounted_return for game in self.games])

    def estimate_part(self, name: str) -> BoundedEstimate | None:
        """Return the mean of `start value`, `seeing`, `choosing` or `luck` of a game.

        Parts are discounted. None if the values are neither exact nor bounded.
        """
        parts = [game.parts for game in self.games if game.parts]
        pairs = [
            part.start_value if name == "start value" else part.sum_discounted(name)
            for part in parts
        ]
        if not pairs:
            return None
        return BoundedEstimate(*(_estimate(side) for side in zip(*pairs, strict=True)))

    @property
    def regret_per_turn(self) -> BoundedEstimate | None:
        """The mean regret of a turn in which the player chose; None if it is unknown."""
        return self._estimate_per_turn("regret", [game.choice_count for game in self.games])

    @property
    def stated_regret(self) -> BoundedEstimate | None:
        """The mean regret of an action if the stated belief were true; None if none is stated."""
        return self._estimate_per_turn("stated_regret", [game.stated_count for game in self.games])

    @property
    def nats(self) -> BoundedEstimate | None:
        """The mean divergence of stated beliefs from the exact ones; None if none is stated."""
        return self._estimate_per_turn("nats", [game.stated_count for game in self.games])

    @property
    def stated_count(self) -> int:
        """The number of turns with a stated belief, in all games."""
        return sum(game.stated_count for game in self.games)

    def _estimate_per_turn(self, name: str, counts: Sequence[int]) -> BoundedEstimate | None:
        """Return the mean of a quantity over turns, with standard errors over games."""
        if not any(counts):
            return None
        low, high = zip(*(game.sum_turns(name) for game in self.games), strict=True)
        if math.inf in high:
            return BoundedEstimate(*(Estimate(math.inf, math.nan, math.nan, math.nan),) * 2)
        turn_counts = np.array(counts)
        return BoundedEstimate(
            *(estimate_ratio(np.array(side), turn_counts) for side in (low, high))
        )

    def make_row(self) -> Row:
        """Return the evaluation as a row of data."""
        returns = self.returns
        row: Row = {
            "problem": self.problem,
            "player": self.player,
            "seat": self.seat,
            "games": len(self.games),
            "mean return": returns.mean,
            "standard error": returns.standard_error,
            "low": returns.low,
            "high": returns.high,
        }
        for name, estimate in self.list_estimates().items():
            row |= _make_estimate_cells(name, estimate)
        return row | {
            "stated beliefs": self.stated_count,
            "choices": sum(game.choice_count for game in self.games),
            "remarks": "; ".join(self.remarks),
        }

    def list_estimates(self) -> dict[str, BoundedEstimate | None]:
        """Return the estimate of each quantity but the return, None if it is unknown."""
        return {
            "start value": self.estimate_part("start value"),
            "regret per turn": self.regret_per_turn,
            **{name: self.estimate_part(name) for name in PART_NAMES},
            "nats": self.nats,
            "stated regret": self.stated_regret,
        }


class Evaluation(NamedTuple):
    """The evaluation of players: one row for each player, seat and problem."""

    players: tuple[PlayerEvaluation, ...]
    errors: tuple[str, ...] = ()  # of files that could not be read

    def list_rows(self, *, games: bool = False) -> list[Row]:
        """Return a row for each player and problem, or with `games` for each game."""
        if not games:
            return [player.make_row() for player in self.players]
        return [
            {"problem": player.problem, "player": player.player, "seat": player.seat}
            | game.make_row()
            for player in self.players
            for game in player.games
        ]

    def to_frame(self, library: str = "", *, games: bool = False) -> Any:
        """Return the rows as a data frame of pandas, or of the `library` polars."""
        return make_frame(self.list_rows(games=games), library)

    def format_table(self, *, games: bool = False) -> str:
        """Return the evaluation as a table, with `games` a row for each game."""
        rows = [row for player in self.players for row in _iter_table_rows(player, games=games)]
        used = [name for name in (rows[0] if rows else ()) if any(row[name] for row in rows)]
        cells = [used, *([row[name] or "-" for name in used] for row in rows)]
        return "\n".join(align_columns(cells))

    def __str__(self) -> str:
        """Return the table, with a row for each player and problem."""
        return self.format_table()

    def __repr__(self) -> str:
        counts = sum(len(player.games) for player in self.players)
        return f"<Evaluation: {format_count(len(self.players), 'row')}, {counts} games>"


def _iter_table_rows(player: PlayerEvaluation, *, games: bool) -> Iterator[dict[str, str]]:
    """Yield the rows of a player's table: one, or one for each game; "" is an empty cell."""
    names = {"problem": player.problem, "player": player.player, "seat": player.seat}
    names = {key: escape_unprintable(escape_newlines(name)) for key, name in names.items()}
    names["seat"] *= player.has_other_seats
    if not games:
        cells = {name: _format_estimate(item) for name, item in player.list_estimates().items()}
        returns = BoundedEstimate(player.returns, player.returns)
        counts = {"games": str(len(player.games)), "return": _format_estimate(returns)}
        notes = player.remarks
        if player.has_hidden_states and not player.stated_count and cells["seeing"]:
            cells["seeing"] = NOT_STATED
        yield names | counts | cells | {"notes": "; ".join(notes)}
        return
    for game in player.games:
        row = game.make_row()
        cells = {name: _format_bounds(row, name) for name in (*QUANTITIES, "stated regret")}
        if player.has_hidden_states and not game.stated_count and cells["seeing"]:
            cells["seeing"] = NOT_STATED
        nats = row["nats"]
        cells["nats"] = f"{nats:.3g}" if isinstance(nats, float) else ""
        counts = {"game": game.name, "turns": str(game.turn_count)}
        yield names | counts | {"return": format_number(game.discounted_return, 5)} | cells


def _format_bounds(row: Row, name: str) -> str:
    """Return a quantity of a game as a cell: a number, or the range between its bounds."""
    bounds = dict.fromkeys((row[f"{name} lower bound"], row[f"{name} upper bound"]))
    return " to ".join(format_number(x, 4) for x in bounds if isinstance(x, float | int))


def _format_estimate(estimate: BoundedEstimate | None) -> str:
    """Return a mean with its standard error as a cell, or the range between bounds; '' if none."""
    if estimate is None or math.isnan(estimate.low.mean):
        return ""
    if not estimate.is_exact:
        return " to ".join(format_number(side.mean, 4) for side in estimate)
    text, error = format_number(estimate.low.mean, 4), estimate.low.standard_error
    return f"{text} ± {format_number(error, 2)}" if error and math.isfinite(error) else text


def evaluate(  # noqa: PLR0913 - each is the caller's to choose
    agent: AgentLike,
    problems: ProblemLike | Sequence[ProblemLike],
    episodes: int = DEFAULT_EPISODES,
    *,
    seat: int | str = 0,
    others: AgentLike | None = None,
    turns: int | None = None,
    seed: int = 0,
    folder: str | os.PathLike[str] | None = None,
    progress: Progress = lambda share: None,
) -> Evaluation:
    """Play games of an agent in each problem, and return where it lost value.

    The agent has one `seat`; `others` play the other seats, by default the usual agents. The games
    are those of `seed`, as in `run`. If a `folder` is given, their transcripts are written there,
    and `evaluate_transcripts` computes the same numbers from them. Raise BadParameter if a file
    exists there.
    """
    check_episode_count(episodes)
    is_list = isinstance(problems, list | tuple)
    items = cast("list[ProblemLike]", problems if is_list else [problems])
    players = []
    for index, item in enumerate(items):

        def report(share: float, index: int = index) -> None:
            """Report the progress of one of the problems."""
            progress((index + share) / len(items))

        lineup = _Lineup.load(item, agent, seat, others, turns)
        sessions, digits = lineup.iter_sessions(seed, episodes, report), len(str(episodes - 1))
        group = _GameGroup(lineup.problem_name, lineup.names[lineup.seat], lineup.problem)
        for episode, session in sessions:
            if folder is not None:
                lineup.write_transcript(session, Path(folder), f"{episode:0{digits}}")
            question = AdviceQuestion.of_session(session, lineup.seat, lineup.names)
            group.add(f"episode {episode}", session, question)
        players.append(group.summarize())
    return Evaluation(tuple(players))


def evaluate_transcripts(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    trusted: bool = False,
    progress: Progress = lambda share: None,
) -> Evaluation:
    """Return the parts of the value that the players of recorded games lost.

    In each game, these are its people and language models, else its programs, else the agent of
    the first seat. `paths` are files and folders. Code that a file names is imported only if it is
    `trusted`. A file that cannot be read is in `errors`, unless it is the only one.
    """
    single = isinstance(paths, str | os.PathLike)
    files = [*iter_transcript_files([*map(Path, [paths] if single else paths)])]  # type: ignore[arg-type]
    groups: dict[object, _GameGroup] = {}
    errors = []
    for index, game in enumerate(iter_games(files, trusted=trusted)):
        progress(index / len(files))
        if not isinstance(game, RecordedGame):
            if len(files) == 1:
                raise game
            errors.append(str(game))
            continue
        names = game.player_names
        for seat in list_judged_seats(names):
            key = game.problem_name, repr(game.settings), names, seat, game.transcript.header.player
            if key not in groups:
                title = " ".join([game.problem_name, *game.settings])
                name = game.transcript.header.player or names[seat]
                groups[key] = _GameGroup(title, name, game.problem)
            groups[key].add(game.transcript.path, game.session, game.advice_question(seat))
    return Evaluation(tuple(group.summarize() for group in groups.values()), tuple(errors))


class _Lineup(NamedTuple):
    """A problem with the agent of each seat, and the seat that is evaluated."""

    problem: Problem
    problem_name: str
    loaded: LoadedProblem | None  # None for an object, which is identified when a file is written
    seat: int
    agents: Sequence[AgentLike]
    names: tuple[str, ...]
    policies: Sequence[Policy]
    turn_limit: int | None

    @classmethod
    def load(
        cls,
        problem_like: ProblemLike,
        agent: AgentLike,
        seat: int | str,
        others: AgentLike | None,
        turns: int | None,
    ) -> "_Lineup":
        """Return the lineup of a problem; raise an error for what cannot be played."""
        loaded, name = None, ""
        if isinstance(problem_like, str):
            loaded = resolve_problem(problem_like, {})
            name = loaded.name
        problem = loaded.problem if loaded else load_problem(problem_like)
        check_problem(problem, turns)
        index = find_seat(problem, seat)
        players = [
            agent if other == index else others or load_roster(problem, other).default_partner
            for other in range(len(problem.agents))
        ]
        if turns is None and problem.horizon is None and problem.can_run_forever:
            turns = count_weighty_turns(problem)
        agents = [
            set_horizon_in_name(problem, other, player, turns)
            if turns and isinstance(player, str)
            else player
            for other, player in enumerate(assign_agents(problem, players))
        ]
        players = [player for player in agents if player is not None]
        policies = [
            load_agent(problem, other, player, turns=turns) for other, player in enumerate(players)
        ]
        names = tuple(
            _find_label(problem, other, player, policies[other])
            for other, player in enumerate(players)
        )
        limit = resolve_turn_limit(problem, names, turns)
        name = name or type(problem).__name__
        return cls(problem, name, loaded, index, players, names, policies, limit)

    def iter_sessions(
        self, seed: int, episodes: int, progress: Progress
    ) -> Iterator[tuple[int, Session]]:
        """Yield the number and the session of each episode, played to its end."""
        try:
            for episode in range(episodes):
                progress(episode / episodes)
                uniforms = SeededUniforms(seed, episode)
                session = Session(self.problem, uniforms, self.policies, turn_limit=self.turn_limit)
                try:
                    while not session.over:
                        session.advance()
                except Forfeit:
                    session.end("forfeit")
                yield episode, session
        finally:
            if any(map(names_bot, self.names)):
                from dmplay.external.bots.bot_policy import Bot  # imported only if one plays

                for policy in self.policies:
                    if isinstance(policy, Bot):
                        policy.close()

    def write_transcript(self, session: Session, folder: Path, number: str) -> None:
        """Write a session as transcript `number`; agents without a name are recorded as people."""
        uniforms = cast("SeededUniforms", session.uniform_source)
        loaded = self.loaded or identify_problem(self.problem)
        players = [agent if isinstance(agent, str) else HUMAN for agent in self.agents]
        limit = session.turn_limit if session.turn_limit != self.problem.horizon else None
        stem = "".join(c if c.isalnum() else "-" for c in self.problem_name).strip("-")
        path = folder / f"{stem}-{number}.dmt"
        request = GameRequest(
            loaded.name, seed=uniforms.seed, episode=uniforms.episode, turns=limit
        )
        header = make_header(loaded, players, request, path)
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise BadParameter(f"{folder}: {error.strerror}") from None
        write_file(path, [format_session(header, session)])


def _find_label(problem: Problem, seat: int, agent: AgentLike, policy: Policy) -> str:
    """Return the name of an agent, which is that in the roster for a policy of a roster."""
    name = find_agent_name(problem, seat, policy)
    is_named = not isinstance(agent, str) and name != type(policy).__name__
    return name if is_named else shorten_player_name(format_agent_label(agent))


class _GameGroup:
    """The games of one player in one problem, while they are evaluated."""

    def __init__(self, problem_name: str, player: str, problem: Problem) -> None:
        self._names, self._problem = (problem_name, player), problem
        self._seat = ""
        self._games: list[EvaluatedGame] = []
        self._meters: dict[AdviceQuestion, ValueMeter] = {}
        self._omitted: dict[str, int] = {}  # reason -> number of games that are left out
        self._reasons: dict[str, None] = {}  # why games have no parts

    def add(self, name: str, session: Session, question: AdviceQuestion) -> None:
        """Evaluate a game of the player."""
        self._seat = self._problem.agents[question.seat]
        reason = explain_missing_parts(session)
        if question.earlier_turns:
            reason = "another player played the first turns"
        if reason:
            self._omitted[reason] = self._omitted.get(reason, 0) + 1
            return
        parts = None
        try:
            if question not in self._meters:
                self._meters[question] = ValueMeter(self._problem, question)
            parts = self._meters[question].divide_game(session)
        except DmplayError as error:
            self._reasons[f"no parts: {error}"] = None
        self._games.append(
            EvaluatedGame(
                name,
                len(session.turns),
                session.seat_return(question.seat),
                parts,
                session.hint_counts[self._seat],
            )
        )

    def summarize(self) -> PlayerEvaluation:
        """Return the evaluation of all games."""
        remarks = [*self._reasons]
        if any(meter.is_exact is False for meter in self._meters.values()) and not remarks:
            remarks.append("bounds, because the values are bounds")
        for reason, count in self._omitted.items():
            remarks.append(f"{format_count(count, 'game')} left out: {reason}")
        hints = sum(game.hint_count for game in self._games)
        remarks += [format_count(hints, "hint")] if hints else []
        is_hidden = self._problem.partially_observable
        has_others = len(self._problem.agents) > 1
        evaluation = PlayerEvaluation(
            *self._names, self._seat, tuple(self._games), is_hidden, has_others
        )
        choices = sum(game.choice_count for game in self._games)
        if 0 < evaluation.stated_count < choices:
            turns = format_count(choices, "choice")
            remarks.append(f"beliefs stated in {evaluation.stated_count} of {turns}")
        return evaluation._replace(remarks=tuple(remarks))


def _estimate(sample: Sequence[float]) -> Estimate:
    """Return the mean of a sample with its standard error and interval; nan if it is empty."""
    if not sample:
        return Estimate(math.nan, math.nan, math.nan, math.nan)
    return estimate_mean(np.array(sample))


def _make_cells(name: str, bounds: Bounds | None) -> Row:
    """Return the cells of a quantity: itself if it is exact, and its bounds."""
    low, high = bounds or (None, None)
    return {
        name: low if low == high else None,
        f"{name} lower bound": low,
        f"{name} upper bound": high,
    }


def _make_estimate_cells(name: str, estimate: BoundedEstimate | None) -> Row:
    """Return the cells of a mean: itself and its standard error if it is exact, and its bounds."""
    is_exact = estimate is not None and estimate.is_exact
    bounds = (estimate.low.mean, estimate.high.mean) if estimate else None
    error = estimate.low.standard_error if estimate and is_exact else None
    return {**_make_cells(name, bounds), f"{name} standard error": error}
