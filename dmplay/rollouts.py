"""Many games at once: a problem and its policies, to returns."""

import math
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import NamedTuple

import numpy as np

from dmplay.blocks import MOST, Workers, done
from dmplay.budget import MEMORY, Budget, Watch, between, part, watched
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.columns import joined
from dmplay.core import (
    DECIMALS,
    Interval,
    Labels,
    Memory,
    Outcome,
    Policy,
    Problem,
    asked,
    check_policy,
    check_problem,
    heeded,
    own,
)
from dmplay.dice import NATURE, Dice, uniforms
from dmplay.errors import BadParameter, BadPolicy, DmplayError, LostGames, UnknownName
from dmplay.session import MOST_TURNS, actions_chosen, remembered

LEAST, SOME, PROBED = 8, 32, 2  # games of a block; games and turns that tell what they cost
HANDED = 0.006  # seconds in which an engine hands a block to a worker
COPIES = 8  # of a memory, which a policy makes while it brings it up to date
SPARE = 2**24  # bytes that are freed and kept for the next arrays
QUICK = 0.005  # seconds that these turns of one game take where many can be tried


class Rollout(NamedTuple):
    """What came of E games of n agents; what was not to be kept has no rows."""

    returns: Reals  # [E, n], discounted sums of rewards
    totals: Reals  # [E, n], plain sums
    turns: Ints  # [E]
    over: Bools  # [E], in a terminal state
    state: Array  # [E, ...], the last
    luck: Reals  # [E, n], discounted sums of what was luck


Luck = Callable[[Array, Array, Outcome], Reals]  # how much of a turn was, [B, n]
USUAL = ("returns", "totals", "turns", "over", "state")  # what is kept


class Games(NamedTuple):
    """Which games are played, how, by whose work, and what is kept of each."""

    which: range
    turns: int | None = None
    seed: int = 0
    workers: Workers = 1
    executor: Executor | None = None
    progress: Watch | None = None
    keep: Sequence[str] = USUAL
    luck: Luck | None = None


class Rest(NamedTuple):
    """What came of the games that were played where not all were, and which they are."""

    played: tuple[Rollout, ...]  # by each entrant; none where there are no games
    games: Ints


class Interrupted(KeyboardInterrupt):
    """Ctrl-C while games were played."""

    def __init__(self, rest: Rest) -> None:
        super().__init__("interrupted")
        self.rest = rest


class Lost(LostGames):
    """Games that were lost, and the rest of them."""

    def __init__(self, error: LostGames, rest: Rest) -> None:
        super().__init__(error.blocks, error.why)
        self.rest = rest


def rollout(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    policies: Sequence[Policy],
    *,
    episodes: int,
    turns: int | None = None,
    seed: int = 0,
    first: int = 0,
    workers: Workers = 1,
    executor: Executor | None = None,
    progress: Watch | None = None,
    keep: Sequence[str] = USUAL,
) -> Rollout:
    """Plays episodes `first` .. `first + episodes - 1` of a seed, one policy to a seat.

    Row r is the game that a session plays with `Dice(seed, first + r)`, whatever the workers or
    the executor, the blocks and their order. `progress` is told the share that is played. Raises
    Lost when workers died again and again, and Interrupted; what cannot be played is a BadPolicy,
    an IllegalAction or a BadParameter.
    """
    which = range(first, first + episodes)
    games = Games(which, turns, seed, workers, executor, progress, keep)
    (found,) = rollouts(problem, [policies], games)
    return found


def rollouts(
    problem: Problem, entrants: Sequence[Sequence[Policy]], games: Games
) -> tuple[Rollout, ...]:
    """The same games by each of some entrants, block by block: the policies of each, as above.

    So what was played by the time of an interruption was played by all. `luck` tells how much of
    what came of joint actions was luck: 0 where it is not given.
    """
    which, keep, workers, progress = games.which, games.keep, games.workers, games.progress
    if which.stop < which.start:
        raise BadParameter(f"episodes: got {which.stop - which.start}, expected 0 or more")
    games = games._replace(seed=Dice(games.seed, which.start).seed)
    check_problem(problem, games.turns)
    for policies in entrants:
        given: object = policies
        if not isinstance(given, Sequence) or len(given) != len(problem.agents):
            told = f"{len(given)} policies" if isinstance(given, Sequence) else f"{given!r}"
            raise BadPolicy(f"got {told}, expected one for each of {problem.agents}")
        for seat, policy in enumerate(given):
            check_policy(policy, seat)
    for name in keep:
        if name not in Rollout._fields:
            raise UnknownName("array to keep", name, Rollout._fields)
    work = partial(_blocks, problem, entrants, games._replace(executor=None, progress=None))
    alone = games.executor is None and workers == 1 and progress is None
    hands = 0 if alone else workers if isinstance(workers, int) else 1
    size = MOST if len(which) <= LEAST else _size(problem, entrants, games.seed, hands)
    kept: tuple[Rollout, ...] | None = None
    played = np.zeros(len(which), bool)
    with watched(progress) if progress else nullcontext():
        budget = Budget("a rollout", "try fewer games at a time", math.inf)
        try:
            blocks = done(work, which, size=size, workers=workers, executor=games.executor)
            for block, parts in blocks:
                kept = kept or tuple(_empty(one, keep, len(which)) for one in parts)
                rows = slice(block.start - which.start, block.stop - which.start)
                for whole, one in zip(kept, parts, strict=True):
                    for name in keep:
                        getattr(whole, name)[rows] = getattr(one, name)
                played[rows] = True
                budget.spend(0, float(played.mean()))
        except LostGames as error:
            raise Lost(error, _rest(kept, keep, which.start, played)) from None
        except KeyboardInterrupt:
            raise Interrupted(_rest(kept, keep, which.start, played)) from None
    return kept or work(which)


def _size(problem: Problem, entrants: Sequence[Sequence[Policy]], seed: int, workers: int) -> int:
    """The games of a block: so many that their memories fit, and no more than suits workers."""
    size = MOST
    for place, policies in enumerate(entrants):
        with _games_of(place):
            size = min(size, _room(problem, policies, seed))
            if workers:
                size = min(size, _grain(problem, policies, seed, workers))
    return size


def _room(problem: Problem, policies: Sequence[Policy], seed: int) -> int:
    """The games whose memories may be held at a time, by what one game's take."""
    state = problem.start(uniforms(seed, NATURE, 0, first=0, rows=1, count=problem.draws.start))
    held = sum(
        part.nbytes
        for seat, one in enumerate(policies)
        for part in remembered("turn 1", one.begin, 1, problem.first_sight(state, seat))
    )
    return int(np.clip(MEMORY / (COPIES * max(held, 1)), LEAST, MOST))


def _grain(problem: Problem, policies: Sequence[Policy], seed: int, workers: int) -> int:
    """The games of a block of which all but a twentieth of the time is the games' own.

    And which takes so long that blocks can be handed to all workers meanwhile. Measured by the
    first turns of one game and of some: of few where one takes long.
    """

    def seconds(many: int) -> float:
        since = time.perf_counter()
        _block(problem, policies, Games(range(many), PROBED, seed, keep=()))
        return time.perf_counter() - since

    seconds(1)  # what is made once
    quick = seconds(1) < QUICK
    few, some, tries = (2, SOME, 3) if quick else (1, LEAST, 1)  # one may go a way of its own
    less, more = (min(seconds(many) for _ in range(tries)) for many in (few, some))
    while quick and more < 2 * less and some < MOST:  # too few to tell what one more costs
        some *= 4
        more = min(seconds(some) for _ in range(tries))
    each = max((more - less) / (some - few), 0.05 * more / some)  # a busy machine may say nothing
    wanted = max(19.0 * (less - few * each), HANDED * workers) / each
    return int(np.clip(wanted, LEAST, MOST))


def _empty(like: Rollout, keep: Sequence[str], episodes: int) -> Rollout:
    """Room for so many games, in the arrays that are kept."""
    many = [episodes if name in keep else 0 for name in Rollout._fields]
    return Rollout(
        *(
            np.empty((rows, *part.shape[1:]), part.dtype)
            for rows, part in zip(many, like, strict=True)
        )
    )


def _rest(kept: tuple[Rollout, ...] | None, keep: Sequence[str], first: int, played: Bools) -> Rest:
    """The games that were played."""
    found = (
        one._replace(**{name: getattr(one, name)[played] for name in keep}) for one in kept or ()
    )
    return Rest(tuple(found), first + np.flatnonzero(played))


def _blocks(
    problem: Problem, entrants: Sequence[Sequence[Policy]], games: Games, which: range
) -> tuple[Rollout, ...]:
    """Has each of the entrants play these of the games."""
    np.empty(SPARE, np.uint8)  # until as much is freed at once, glibc returns arrays page by page
    games = games._replace(which=which)
    found = []
    for place, policies in enumerate(entrants):
        with part(place, len(entrants)), _games_of(place):
            found.append(_block(problem, policies, games))
    return tuple(found)


@contextmanager
def _games_of(place: int) -> Iterator[None]:
    """Has errors tell in whose games they came up."""
    try:
        yield
    except DmplayError as error:
        error.entrant = place
        raise


def _block(problem: Problem, policies: Sequence[Policy], games: Games) -> Rollout:
    """Plays these games side by side.

    All rows draw every turn, finished or not, so that two policies meet the same luck.
    """
    which, seed, luck, many = games.which, games.seed, games.luck, len(games.which)
    usual = problem.horizon or (MOST_TURNS if problem.endless else sys.maxsize)
    limit = usual if games.turns is None else games.turns
    budget = Budget("a rollout", "try fewer games at a time", math.inf)
    budget.hold(24.0 * many * max(*problem.draws, *(policy.draws for policy in policies)))

    row = np.arange(many)  # the games that go on

    def draw(stream: int, turn: int, count: int) -> Reals:
        only = row if len(row) < many else None
        return uniforms(seed, stream, turn, first=which.start, rows=many, count=count, only=only)

    state = problem.start(draw(NATURE, 0, problem.draws.start))
    discounted = problem.discount != 1.0
    sums = [np.zeros((many, len(policies))) for _ in range(1 + discounted + bool(luck))]
    ended = list[tuple[int, Memory]]()  # after so many turns: games, and what came of them
    weight, played = 1.0, 0
    memories = [
        remembered("turn 1", one.begin, many, problem.first_sight(state, seat))
        for seat, one in enumerate(policies)
    ]
    for turn in range(1, limit + 1):
        over = problem.terminal(state)
        (off,) = over.nonzero()
        if len(off):  # these games are kept, and the others go on
            live, (on,) = (row, state, *sums), (~over).nonzero()
            ended.append((played, _rows(live, off)))
            row, state, *sums = _rows(live, on)
            memories = [_rows(memory, on) for memory in memories]
        if not len(row):
            break
        far = (turn - 1) / (limit if limit < sys.maxsize else MOST_TURNS + turn)
        share = 1.0 - (1.0 - far) * len(row) / many  # what is over is played
        budget.spend(0, share)
        drawn = [draw(1 + seat, turn, policy.draws) for seat, policy in enumerate(policies)]
        where = [f"turn {turn}, {agent}" for agent in problem.agents]
        each = zip(where, policies, memories, strict=True)
        choosers = [partial(_choice, *one) for one in each]
        with between(share, share):
            actions = _chosen(problem, choosers, state, drawn, where)
        outcome = problem.step(state, actions, draw(NATURE, turn, problem.draws.step))
        memories = [
            remembered(
                at, one.update, len(row), memory,
                problem.percept(seat, actions, outcome, heeded(one)),
            )
            for seat, (at, one, memory) in enumerate(zip(where, policies, memories, strict=True))
        ]  # fmt: skip
        sums[0] += outcome.rewards
        if discounted:
            sums[1] += weight * outcome.rewards
        if luck:
            sums[-1] += weight * luck(state, actions, outcome)
        state, played = outcome.state, turn
        weight *= problem.discount
    ended.append((played, (row, state, *sums)))
    over = np.ones(many, bool)
    over[row] = problem.terminal(state)
    length, state, totals, *others = _whole(ended)
    lucky = others.pop() if luck else np.zeros_like(totals)
    returns = others.pop() if discounted else totals.copy()
    found = Rollout(returns, totals, length, over, state, lucky)
    unkept = {*Rollout._fields} - {*games.keep}
    return found._replace(**{name: getattr(found, name)[:0] for name in unkept})


def _whole(ended: Sequence[tuple[int, Memory]]) -> Memory:
    """How many turns each game lasted, and what came of it, in the order of the games."""
    lasted, parts = zip(*ended, strict=True)
    row, *rest = map(np.concatenate, zip(*parts, strict=True))
    length = np.repeat(lasted, [len(part[0]) for part in parts])
    place = np.empty_like(row)
    place[row] = np.arange(len(row))
    return _rows((length, *rest), place)


def _rows(arrays: Memory, which: Ints) -> Memory:
    return tuple([part.take(which, axis=0) for part in arrays])


def _choice(where: str, policy: Policy, memory: Memory, legal: Bools | None, u: Reals) -> Array:
    """What a policy chooses, an action for each game."""
    return actions_chosen(policy, asked(where, policy.choose, memory, legal, u), len(u), where)


def _able(known: Labels | Interval, chosen: Array, legal: Bools | None, where: str) -> Array:
    """Actions `[B]` as they will act; raises IllegalAction where a session would."""
    if known.labels and chosen.dtype.kind == "f":
        for one in np.unique(chosen):
            known.check(one.item(), where)
    done = chosen.astype(np.int64, copy=False) if known.labels else chosen
    # Read without a sign, what is below 0 is beyond the last label.
    if not known.labels or np.maximum.reduce(done.view(np.uint64)) >= len(known.labels):
        for one in (done.min(), done.max()):
            known.check(one.item(), where)
    if known.labels and legal is not None:
        able = legal.reshape(-1).take(np.arange(0, legal.size, legal.shape[1]) + done)
        if not able.all():
            row = able.argmin()
            known.check(done[row].item(), where, legal[row])
    return done


def _chosen(
    problem: Problem,
    choosers: Sequence[Callable[[Bools | None, Reals], Array]],
    state: Array,
    drawn: Sequence[Reals],
    where: Sequence[str],
) -> Array:
    """The joint actions `[B, n]` that the policies choose, reals to so many decimals."""
    legal = problem.legal(state)
    chosen = [
        choose(None if legal is None else own(legal[:, seat]), u)
        for seat, (choose, u) in enumerate(zip(choosers, drawn, strict=True))
    ]
    if legal is not None:  # whoever only waits is not asked
        waiting = problem.waiting(state)
        for seat, waits in enumerate(waiting.T):
            if waits.any():
                chosen[seat] = np.where(waits, problem.waits(seat), chosen[seat])
    able = [
        _able(problem.actions[seat], one, None if legal is None else legal[:, seat], where[seat])
        for seat, one in enumerate(chosen)
    ]
    actions = joined(able, int if all(problem.action_counts) else float)
    # As in a session, so that the text of an action is the action.
    return np.round(actions, DECIMALS) + 0.0 if actions.dtype.kind == "f" else actions
