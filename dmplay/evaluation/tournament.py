"""Round-robin tournaments on common random numbers, and the empirical game of the entrants."""

import math
from collections.abc import Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from contextlib import nullcontext
from itertools import combinations_with_replacement, product
from typing import Any, NamedTuple

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.data_frames import make_frame
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, check_problem
from dmplay.core.text import format_count
from dmplay.core.user_code_locations import describe_error_location
from dmplay.core.work_budget import ProgressCallback, report_progress_to, scale_progress_to_part
from dmplay.errors import (
    BadParameter,
    BadPolicy,
    BudgetExceeded,
    DmplayError,
    UnknownName,
    find_policy_seat,
)
from dmplay.evaluation.interruptible_rollouts import (
    check_episode_count,
    run_rollouts_until_interrupted,
)
from dmplay.evaluation.statistics import Estimate, estimate_mean, make_estimate_row
from dmplay.evaluation.sweep import expand_entrants
from dmplay.game.turn_facts import Row
from dmplay.registry.agents import AgentLike, label_agents, load_agents
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.simulation.rollouts import RolloutSpec
from dmplay.simulation.worker_pool import WorkerCount
from dmplay.solvers.games import regret_matching
from dmplay.solvers.games.bimatrix_game import enumerate_equilibria
from dmplay.solvers.games.extreme_equilibria import find_extreme_equilibria, has_mixtures
from dmplay.solvers.games.lemke_howson import find_first_equilibrium

ReturnsBySeating = MutableMapping[tuple[int, ...], Reals]  # returns [E, n] by seating
# every order of entrants in the seats, or only the order in which they are named
SEATING_ORDERS = ("all", "given")
ROUNDING_TOLERANCE = 1e-12  # relative to the greatest payoff
BOOTSTRAP_RESAMPLES = 100
MAX_RESAMPLED_EQUILIBRIUM_ENTRANTS = 8  # more would take seconds for all resamples
MAX_PRINTED_ENTRANTS = 12
TIE_STANDARD_ERRORS = 2.0
UNKNOWN_ESTIMATE = Estimate(math.nan, math.inf, -math.inf, math.inf)


class TournamentResult(NamedTuple):
    """The results of a tournament, and the equilibrium of its empirical game.

    In the empirical game an action is an entrant, and its payoff is the mean return.
    """

    entrants: tuple[str, ...]
    mean_returns: Reals  # [K] * n + [n], of each seat by seating; nan if not played
    # of each entrant per game, over all its pairings and seats
    return_estimates: tuple[Estimate, ...]
    # of each entrant: the best entrants if it holds all other seats; several if they tie
    best_responses: tuple[tuple[int, ...], ...] | None
    # [K] per seat; for more than two seats, an approximate one
    equilibrium: tuple[Reals, ...] | None
    regrets: Reals | None  # [K], loss against the best response to the equilibrium, mean over seats
    exploitability: float | None  # greatest gain of a seat in the equilibrium by another entrant
    # loss of each entrant against the exact equilibrium, if that is played
    exact_regrets: tuple[Estimate, ...] | None
    share_errors: Reals | None = None  # [K], standard errors of the shares in the equilibrium
    regret_errors: Reals | None = None  # [K], standard errors of the regrets
    equilibrium_count: int = 0  # equilibria found in the empirical game; `equilibrium` is the first
    has_infinite_equilibria: bool = False  # whether mixtures of equilibria are equilibria too
    has_all_equilibria: bool = True  # whether all equilibria were found, or infinitely many
    shortfall_reason: str = ""  # why seatings are missing, or ''
    withdrawals: tuple[str, ...] = ()  # a line for each entrant that is left out after a forfeit

    def list_rows(self) -> list[Row]:
        """Return a row for each entrant, as `dmplay tournament --csv` prints it.

        The best entrant is first, and those that did not play are last.
        """
        means = [-estimate.mean for estimate in self.return_estimates]
        return [self._build_row(index) for index in np.argsort(means, kind="stable").tolist()]

    def _build_row(self, index: int) -> Row:
        """Return the row of an entrant."""
        row: Row = {"entrant": self.entrants[index]}
        row |= make_estimate_row(self.return_estimates[index])
        if self.best_responses is not None:
            replies = [self.entrants[reply] for reply in self.best_responses[index]]
            row["best reply to it"] = " or ".join(replies)
        if self.equilibrium is not None and self.regrets is not None:
            errors = [
                None if errors is None else float(errors[index])
                for errors in (self.share_errors, self.regret_errors)
            ]
            row |= {
                "share in equilibrium": float(np.mean([mix[index] for mix in self.equilibrium])),
                "share error": errors[0],
                "regret": float(self.regrets[index]),
                "regret error": errors[1],
            }
        if self.exact_regrets is not None:
            regret = self.exact_regrets[index]
            row |= {"exact regret": regret.mean, "exact error": regret.standard_error}
        return row

    def to_frame(self, library: str = "") -> Any:
        """Return the rows as a data frame of pandas, or of the `library` polars."""
        return make_frame(self.list_rows(), library)

    def __repr__(self) -> str:
        entrants = sorted(zip(self.return_estimates, self.entrants, strict=True), reverse=True)
        lines = [f"{name}: return {estimate}" for estimate, name in entrants[:MAX_PRINTED_ENTRANTS]]
        if len(entrants) > MAX_PRINTED_ENTRANTS:
            lines.append(f"and {len(entrants) - MAX_PRINTED_ENTRANTS} more entrants")
        return "\n".join([*lines, *self.withdrawals, *filter(None, [self.shortfall_reason])])


def run_tournament(  # noqa: PLR0913 - each is the caller's to choose
    problem: ProblemLike,
    entrants: Mapping[str, AgentLike | Sequence[AgentLike]] | Sequence[AgentLike],
    *,
    equilibrium_policies: AgentLike | Sequence[AgentLike] | None = None,
    episodes: int = 1000,
    turns: int | None = None,
    seed: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
    returns_by_seating: ReturnsBySeating | None = None,
    seating_order: str = SEATING_ORDERS[0],
) -> TournamentResult:
    """Play every seating of the entrants on the same uniforms and return the results.

    `entrants` is a list of agents, or a dict from a name to an agent or to one for each seat. With
    the order `given`, no entrant sits behind one that is named later, so each pairing is played
    once. `equilibrium_policies` are an equilibrium of two seats; each entrant plays against them
    too, and their index comes after all entrants. Seatings in `returns_by_seating` are not played
    again, and new ones are added to it. Ctrl-C ends the tournament with these.

    An entrant that raises an error, returns no action or forfeits a game is withdrawn, and the
    result is of the games between the others: an average over the games that it finished would
    favor one that gives up. The last two entrants are not withdrawn: an error is raised.
    """
    problem = load_problem(problem)
    check_problem(problem, turns)
    check_episode_count(episodes)
    policies_by_name = _load_entrants(problem, entrants, turns)
    seat_count, names = len(problem.agents), tuple(policies_by_name)
    policies_by_entrant = [*policies_by_name.values()]
    if seat_count == 1:
        raise BadParameter(
            "tournament: got a problem with 1 seat, expected at least 2; use compare"
        )
    if len(names) < 2:
        raise BadParameter(f"got {format_count(len(names), 'entrant')}, expected at least 2")
    if seating_order not in SEATING_ORDERS:
        raise UnknownName("order", seating_order, SEATING_ORDERS, "seats")
    returns_by_seating = {} if returns_by_seating is None else returns_by_seating
    seatings = list_seatings(len(names), seat_count, seating_order)
    if equilibrium_policies:
        policies_by_entrant.append(load_agents(problem, equilibrium_policies, turns=turns))
        seatings += list_equilibrium_pairings(len(names))
    remaining = [seating for seating in seatings if seating not in returns_by_seating]
    active = [*range(len(names))]  # entrants that are not withdrawn
    shortfall, withdrawals = "", list[str]()
    spec = RolloutSpec(range(episodes), turns, seed, workers, executor, keep=("returns",))
    with report_progress_to(progress) if progress else nullcontext():
        for index, seating in enumerate(remaining):
            if any(entrant not in active for entrant in seating if entrant < len(names)):
                continue
            policies = [policies_by_entrant[entrant][seat] for seat, entrant in enumerate(seating)]
            try:
                with scale_progress_to_part(index, len(remaining)):
                    entry = run_rollouts_until_interrupted(problem, [policies], spec)
            except Exception as error:
                seated_names = [(*names, "the equilibrium")[entrant] for entrant in seating]
                seat = find_policy_seat(error)
                entrant = len(names) if seat is None else seating[seat]
                if entrant < len(names) and len(active) > 2:
                    active.remove(entrant)
                    reason = describe_error_location(error) or error
                    line = f"{names[entrant]} is withdrawn from the tournament: {reason}"
                    withdrawals.append(line)
                    continue
                if not isinstance(error, DmplayError):
                    raise
                raise BadPolicy(f"{' and '.join(seated_names)}: {error}") from None
            if entry.interruption and not returns_by_seating:
                raise entry.interruption
            if entry.interruption:
                shortfall = str(entry.interruption)
                break
            returns_by_seating[seating] = entry.rollouts[0].returns
    new_indices = {entrant: index for index, entrant in enumerate([*active, len(names)])}
    active_returns = {
        tuple(new_indices[entrant] for entrant in seating): returns
        for seating, returns in returns_by_seating.items()
        if new_indices.keys() >= {*seating}
    }
    return _summarize_tournament(
        tuple(names[entrant] for entrant in active), seat_count, active_returns
    )._replace(shortfall_reason=shortfall, withdrawals=tuple(withdrawals))


tournament = run_tournament  # the name of the command


def _load_entrants(
    problem: Problem,
    entrants: Mapping[str, AgentLike | Sequence[AgentLike]] | Sequence[AgentLike],
    turns: int | None,
) -> dict[str, list[Policy]]:
    """Return the policies of all seats for each entrant, by name; raise an error for others."""
    if not isinstance(entrants, Mapping):
        if not isinstance(entrants, Sequence) or isinstance(entrants, str):
            expected = "expected a list of agents, or a dict of them by name"
            raise BadParameter(f"entrants: got {entrants!r}, {expected}")
        entrants = expand_entrants(entrants)
        labels = label_agents(entrants)
        if len({*labels}) < len(labels):
            twice = next(label for label in labels if labels.count(label) > 1)
            raise BadParameter(f"entrants: got {twice} twice, expected a dict of agents by name")
        entrants = dict(zip(labels, entrants, strict=True))
    loaded = {}
    for name, agents in entrants.items():
        try:
            loaded[name] = load_agents(problem, agents, turns=turns)
        except BadPolicy as error:
            raise BadPolicy(f"{name}: {error}") from None
    return loaded


def list_seatings(
    entrant_count: int, seat_count: int, seating_order: str = SEATING_ORDERS[0]
) -> list[tuple[int, ...]]:
    """Return the seatings of the entrants: for each, the index of the entrant in every seat."""
    if seating_order == "all":
        return [*product(range(entrant_count), repeat=seat_count)]
    return [*combinations_with_replacement(range(entrant_count), seat_count)]


def list_equilibrium_pairings(entrant_count: int) -> list[tuple[int, ...]]:
    """Return the pairings of each entrant, and of the exact equilibrium itself, with the latter.

    The index of the exact equilibrium is `entrant_count`.
    """
    pairs = list[tuple[int, ...]]()
    for entrant in range(entrant_count):
        pairs += [(entrant, entrant_count), (entrant_count, entrant)]
    return [*pairs, (entrant_count, entrant_count)]


def _summarize_tournament(
    names: tuple[str, ...], seat_count: int, returns_by_seating: ReturnsBySeating
) -> TournamentResult:
    """Return the cross table and the standings of the seatings that were played."""
    entrant_count = len(names)
    table = np.full((entrant_count,) * seat_count + (seat_count,), np.nan)
    samples: list[list[Reals]] = [[] for _ in names]
    for seating, returns in returns_by_seating.items():
        if entrant_count in seating:
            continue
        table[seating] = returns.mean(axis=0)
        for seat, entrant in enumerate(seating):
            samples[entrant].append(returns[:, seat])
    # Games on the same uniforms are not independent: together they are one observation.
    estimates = tuple(
        estimate_mean(np.mean(sample, axis=0)) if sample else UNKNOWN_ESTIMATE for sample in samples
    )
    if np.isnan(table).any():
        return TournamentResult(names, table, estimates, None, None, None, None, None)
    resampled_tables = _resample_tables(table, returns_by_seating)
    equilibria, has_all_equilibria = _find_equilibria(table)
    equilibrium, regrets, gain = next(iter(equilibria), None), None, None
    share_errors = regret_errors = None
    if equilibrium is not None:
        regrets = _compute_regrets(table, equilibrium)
        share_errors, regret_errors = _estimate_equilibrium_errors(equilibrium, resampled_tables)
        gains = regret_matching.compute_regrets(table, equilibrium)
        gain = float(_clear_rounding_errors(gains, table).max())
    exact_regrets = None
    if seat_count == 2:
        exact_regrets = _estimate_exact_regrets(entrant_count, returns_by_seating)
    best_responses = _find_best_responses(table, resampled_tables)
    return TournamentResult(
        names, table, estimates, best_responses, equilibrium, regrets, gain, exact_regrets,
        share_errors, regret_errors, len(equilibria), _has_infinite_equilibria(table),
        has_all_equilibria,
    )  # fmt: skip


def _resample_tables(table: Reals, returns_by_seating: ReturnsBySeating) -> Reals:
    """Return bootstrap resamples `[R, ...]` of the table of mean returns.

    Each resample draws episodes with replacement. Games on the same uniforms are drawn together.
    """
    seatings = [seating for seating in returns_by_seating if len(table) not in seating]
    returns = np.stack([returns_by_seating[seating] for seating in seatings], axis=1)  # [E, *, n]
    episode_count, generator = len(returns), np.random.default_rng(0)
    shares = np.full(episode_count, 1 / episode_count)
    weights = generator.multinomial(episode_count, shares, BOOTSTRAP_RESAMPLES)
    means = (weights / episode_count) @ (returns - returns[0]).reshape(episode_count, -1)
    tables = np.empty((BOOTSTRAP_RESAMPLES, *table.shape))
    for index, seating in enumerate(seatings):
        offset = index * returns.shape[2]
        entry: tuple[slice | int, ...] = (slice(None), *seating)
        tables[entry] = returns[0, index] + means[:, offset : offset + returns.shape[2]]
    return tables


def _find_best_responses(table: Reals, resampled_tables: Reals) -> tuple[tuple[int, ...], ...]:
    """Return the entrants that earn most, over all seats, if each entrant holds all others.

    The best one is the first; others tie with it if they earn less by at most two standard errors.
    """
    returns = _sum_reply_returns(table)
    resampled_returns = np.stack([_sum_reply_returns(resample) for resample in resampled_tables])
    replies = []
    for entrant, values in enumerate(returns):
        best = int(values.argmax())
        resampled_gaps = resampled_returns[:, entrant, best, None] - resampled_returns[:, entrant]
        tolerance = TIE_STANDARD_ERRORS * resampled_gaps.std(axis=0, ddof=1)
        tied = values[best] - values <= tolerance + ROUNDING_TOLERANCE * np.abs(table).max()
        replies.append((best, *(int(i) for i in np.flatnonzero(tied) if i != best)))
    return tuple(replies)


def _sum_reply_returns(table: Reals) -> Reals:
    """Return the return `[K, K]` of each reply to each entrant, summed over the reply's seats."""
    entrant_count, seat_count = len(table), table.shape[-1]
    returns = np.zeros((entrant_count, entrant_count))
    for entrant, reply, seat in np.ndindex(entrant_count, entrant_count, seat_count):
        seating = [reply if position == seat else entrant for position in range(seat_count)]
        returns[entrant, reply] += table[(*seating, seat)]
    return returns


def _find_equilibria(table: Reals) -> tuple[list[tuple[Reals, ...]], bool]:
    """Return the equilibria of the empirical game, and whether there may be no others.

    For more than two seats, one approximate equilibrium is returned. The list is empty if none is
    found.
    """
    try:
        if table.shape[-1] == 2:
            return [*enumerate_equilibria(table)], True
        return [regret_matching.find_equilibrium(table).mixed_strategies], False
    except BudgetExceeded:
        return ([find_first_equilibrium(table)] if table.shape[-1] == 2 else []), False


def _has_infinite_equilibria(table: Reals) -> bool:
    """Return whether the empirical game of two seats has infinitely many equilibria."""
    try:
        return table.shape[-1] == 2 and has_mixtures(find_extreme_equilibria(table))
    except BudgetExceeded:
        return False


def _compute_regrets(table: Reals, equilibrium: tuple[Reals, ...]) -> Reals:
    """Return the regret `[K]` of each entrant in an equilibrium, as a mean over the seats."""
    values_by_seat = [
        regret_matching.compute_response_values(table, equilibrium, seat)
        for seat in range(table.shape[-1])
    ]
    regrets = np.mean([values.max() - values for values in values_by_seat], axis=0)
    return _clear_rounding_errors(regrets, table)


def _estimate_equilibrium_errors(
    equilibrium: tuple[Reals, ...], resampled_tables: Reals
) -> tuple[Reals | None, Reals]:
    """Return the standard errors `[K]` of the shares in an equilibrium and of the regrets.

    The equilibrium is computed again in each resample, as that one of its equilibria that is
    nearest. For many entrants or seats it is kept, and the errors of the shares are None.
    """
    entrant_count = resampled_tables.shape[1]
    can_resample = len(equilibrium) == 2 and entrant_count <= MAX_RESAMPLED_EQUILIBRIUM_ENTRANTS
    if not can_resample:
        regrets = [_compute_regrets(table, equilibrium) for table in resampled_tables]
        return None, np.std(regrets, axis=0, ddof=1)
    mixes = np.array(equilibrium)
    resamples = []
    for table in resampled_tables:
        candidates = [np.array(mix) for mix in enumerate_equilibria(table)]
        if candidates:
            nearest = min(candidates, key=lambda candidate: np.abs(candidate - mixes).sum())
            resamples.append((nearest.mean(axis=0), _compute_regrets(table, tuple(nearest))))
    share_errors, regret_errors = np.std(resamples, axis=0, ddof=1)
    return share_errors, regret_errors


def _clear_rounding_errors(regrets: Reals, table: Reals) -> Reals:
    """Return the regrets, with those that are only rounding errors set to 0."""
    return np.where(regrets > ROUNDING_TOLERANCE * np.abs(table).max(), regrets, 0.0)


def _estimate_exact_regrets(
    entrant_count: int, returns_by_seating: ReturnsBySeating
) -> tuple[Estimate, ...] | None:
    """Return the loss of each entrant against the exact equilibrium, None if not all is played.

    The index of the exact equilibrium is `entrant_count`.
    """
    equilibrium_returns = returns_by_seating.get((entrant_count, entrant_count))
    if equilibrium_returns is None:
        return None
    first = [returns_by_seating.get((entrant, entrant_count)) for entrant in range(entrant_count)]
    second = [returns_by_seating.get((entrant_count, entrant)) for entrant in range(entrant_count)]
    pairs = [(a, b) for a, b in zip(first, second, strict=True) if a is not None and b is not None]
    losses = [
        (equilibrium_returns[:, 0] - a[:, 0] + equilibrium_returns[:, 1] - b[:, 1]) / 2
        for a, b in pairs
    ]
    return tuple(map(estimate_mean, losses)) if len(losses) == entrant_count else None
