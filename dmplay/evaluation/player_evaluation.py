"""The results of an evaluation: what seeing, choosing and luck cost the players of games."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple, Self, cast

import numpy as np

from dmplay.agents.base import AdviceQuestion, SeatPolicy, find_values_basis
from dmplay.core.data_frames import make_frame
from dmplay.core.problem import Problem
from dmplay.core.text import format_count
from dmplay.evaluation.statistics import Estimate, estimate_mean, estimate_ratio, make_estimate_row
from dmplay.game.hints.lost_value import Bounds, GameParts
from dmplay.game.turn_facts import Row
from dmplay.registry.agents import find_agent_name, load_agent, load_roster

PART_NAMES = ("seeing", "choosing", "luck")
UNKNOWN = Estimate(math.nan, math.nan, math.nan, math.nan)


class EvaluatedGame(NamedTuple):
    """A game of one player, and the parts of its return."""

    name: str  # its file, or its episode
    turn_count: int
    discounted_return: float
    hint_count: int = 0
    turn_limit: int | None = None
    parts: GameParts | None = None
    fault: str = ""  # why it is not counted
    missing_parts: str = ""  # why it has no parts although it is counted

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
        items = [getattr(turn, name) for turn in self.parts.turns] if self.parts else []
        bounds = [x if isinstance(x, tuple) else (x, x) for x in items if x is not None]
        return math.fsum(low for low, _ in bounds), math.fsum(high for _, high in bounds)

    def make_row(self) -> Row:
        """Return the game as a row of data; its parts are sums over the game, discounted."""
        row: Row = {
            "game": self.name,
            "turns": self.turn_count,
            "return": self.discounted_return,
            "stated beliefs": self.stated_count,
        }
        for name, bounds in self._bound_quantities().items():
            row |= _make_cells(name, bounds)
        stated = self.stated_count
        row["nats"] = self.sum_turns("nats")[0] / stated if stated else None
        return row | _make_cells("stated regret", self._average("stated_regret", stated))

    def _bound_quantities(self) -> dict[str, Bounds | None]:
        """Return the start value, the regret per turn and the parts, None if they are unknown."""
        if self.parts is None:
            return dict.fromkeys(("start value", "regret per turn", *PART_NAMES))
        return {
            "start value": self.parts.start_value,
            "regret per turn": self._average("regret", max(self.choice_count, 1)),
            **{name: self.parts.sum_discounted(name) for name in PART_NAMES},
        }

    def _average(self, name: str, count: int) -> Bounds | None:
        """Return the mean of a quantity over this number of turns, None for no turns."""
        low, high = self.sum_turns(name)
        return (low / count, high / count) if count else None


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
    all_games: tuple[EvaluatedGame, ...]  # also those that are not counted
    has_hidden_states: bool
    has_other_seats: bool
    plan_remark: str = ""  # of an agent that plans for other turns than those of its games

    @classmethod
    def of_games(
        cls, problem: Problem, title: str, player: str, seat: int, games: Sequence[EvaluatedGame]
    ) -> Self:
        """Return the evaluation of all games of a player."""
        is_hidden, has_others = problem.partially_observable, len(problem.agents) > 1
        limits = sorted({game.turn_limit for game in games if game.turn_limit})
        remark = _explain_ignored_limit(problem, seat, player, limits[0]) if limits else ""
        return cls(title, player, problem.agents[seat], (*games,), is_hidden, has_others, remark)

    def __repr__(self) -> str:
        games = format_count(len(self.games), "game", ",")
        return f"{self.problem}, {self.player}: {games}, return {self.returns}"

    @property
    def games(self) -> tuple[EvaluatedGame, ...]:
        """The games that are counted."""
        return tuple(game for game in self.all_games if not game.fault)

    @property
    def returns(self) -> Estimate:
        """The mean discounted return of a game; without games, all its numbers are nan."""
        sample = np.array([game.discounted_return for game in self.games])
        return estimate_mean(sample) if len(sample) else UNKNOWN

    @property
    def estimates(self) -> dict[str, BoundedEstimate | None]:
        """The means of the start value, regret, parts, nats and stated regret by name.

        Start value and parts are means of games, discounted; the others are means of turns, with
        standard errors over games. A mean is None if no game has the quantity.
        """
        measured = [game.parts for game in self.games if game.parts]
        parts = {
            name: _estimate_games([item.sum_discounted(name) for item in measured])
            for name in PART_NAMES
        }
        choices = [game.choice_count for game in self.games]
        stated = [game.stated_count for game in self.games]
        return {
            "start value": _estimate_games([item.start_value for item in measured]),
            "regret per turn": self._estimate_turns("regret", choices),
            **parts,
            "nats": self._estimate_turns("nats", stated),
            "stated regret": self._estimate_turns("stated_regret", stated),
        }

    @property
    def stated_count(self) -> int:
        """The number of turns with a stated belief, in all games."""
        return sum(game.stated_count for game in self.games)

    @property
    def choice_count(self) -> int:
        """The number of turns in which the player chose, in all games."""
        return sum(game.choice_count for game in self.games)

    @property
    def remarks(self) -> list[str]:
        """Why parts or games are missing, what the player ignores, and the hints that it got."""
        reasons = dict.fromkeys(game.missing_parts for game in self.games if game.missing_parts)
        remarks = [f"no parts: {reason}" for reason in reasons]
        if not all(item.is_exact for item in self.estimates.values() if item):
            remarks.append("bounds, because the values are bounds")
        faults = [game.fault for game in self.all_games if game.fault]
        for fault in dict.fromkeys(faults):
            remarks.append(f"{format_count(faults.count(fault), 'game')} left out: {fault}")
        regret = self.estimates["regret per turn"]
        remarks += [self.plan_remark] if self.plan_remark and regret and regret.high.mean else []
        hints = sum(game.hint_count for game in self.games)
        remarks += [format_count(hints, "hint")] if hints else []
        if 0 < self.stated_count < self.choice_count:
            choices = format_count(self.choice_count, "choice")
            remarks.append(f"beliefs stated in {self.stated_count} of {choices}")
        return remarks

    def _estimate_turns(self, name: str, counts: Sequence[int]) -> BoundedEstimate | None:
        """Return the mean of a quantity over turns, of which each game has a count."""
        if not any(counts):
            return None
        low, high = zip(*(game.sum_turns(name) for game in self.games), strict=True)
        if math.inf in high:
            infinite = UNKNOWN._replace(mean=math.inf)
            return BoundedEstimate(infinite, infinite)
        turn_counts = np.array(counts)
        low_mean, high_mean = (estimate_ratio(np.array(side), turn_counts) for side in (low, high))
        return BoundedEstimate(low_mean, high_mean)

    def make_row(self) -> Row:
        """Return the evaluation as a row of data."""
        names = {"problem": self.problem, "player": self.player, "seat": self.seat}
        row: Row = names | {"games": len(self.games)} | make_estimate_row(self.returns)
        for name, estimate in self.estimates.items():
            is_exact = estimate is not None and estimate.is_exact
            row |= _make_cells(name, estimate and (estimate.low.mean, estimate.high.mean))
            row[f"{name} standard error"] = (
                estimate.low.standard_error if estimate and is_exact else None
            )
        return row | {
            "stated beliefs": self.stated_count,
            "choices": self.choice_count,
            "remarks": "; ".join(self.remarks),
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

    def __repr__(self) -> str:
        return "\n".join([*map(repr, self.players), *self.errors])


def _explain_ignored_limit(problem: Problem, seat: int, name: str, turn_limit: int) -> str:
    """Return the remark on an agent of the roster that ignores a turn limit; '' of any other."""
    if name.partition(":")[0] not in load_roster(problem, seat).agents:
        return ""
    policy, question = load_agent(problem, seat, name), AdviceQuestion(seat, turn_limit)
    if not find_values_basis(policy, question).ignores_turn_limit:
        return ""
    adapted = find_agent_name(problem, seat, cast(SeatPolicy, policy).adapt_to_game(question))
    return f"{name} ignores the turn limit" + (f" ({adapted} does not)" if adapted != name else "")


def _estimate_games(pairs: Sequence[Bounds]) -> BoundedEstimate | None:
    """Return the mean of a quantity of games, each with its bounds; None for no games."""
    if not pairs:
        return None
    low, high = (estimate_mean(np.array(side)) for side in zip(*pairs, strict=True))
    return BoundedEstimate(low, high)


def _make_cells(name: str, bounds: Bounds | None) -> Row:
    """Return the cells of a quantity: itself if it is exact, and its bounds."""
    low, high = bounds or (None, None)
    return {
        name: low if low == high else None,
        f"{name} lower bound": low,
        f"{name} upper bound": high,
    }
