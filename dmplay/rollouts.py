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

from dmplay.blocks import MAX_BLOCK_EPISODES, WorkerCount, run_blocks
from dmplay.budget import (
    DEFAULT_MEMORY_BYTES,
    Budget,
    ProgressCallback,
    report_progress_to,
    scale_progress,
    scale_progress_part,
)
from dmplay.chance import Array, Bools, Ints, Reals
from dmplay.columns import stack_columns
from dmplay.core import (
    ACTION_DECIMALS,
    Interval,
    Labels,
    Memory,
    Outcome,
    Policy,
    Problem,
    call_policy,
    check_policy,
    check_problem,
    readonly_copy,
    required_fields,
)
from dmplay.dice import NATURE_STREAM, SeededUniforms, generate_uniforms
from dmplay.errors import BadParameter, BadPolicy, DmplayError, LostGames, UnknownName
from dmplay.session import DEFAULT_TURN_LIMIT, call_memory_method, validate_choices

MIN_BLOCK_EPISODES, PROBE_EPISODES, PROBE_TURNS = (
    8,
    32,
    2,
)  # games of a block; games and turns that tell what they cost
DISPATCH_SECONDS = 0.006  # seconds in which an engine hands a block to a worker
MEMORY_COPIES = 8  # of a memory, which a policy makes while it brings it up to date
PREALLOCATED_BYTES = 2**24  # bytes that are freed and kept for the next arrays
MAX_QUICK_PROBE_SECONDS = 0.005  # seconds that these turns of one game take where many can be tried


class Rollout(NamedTuple):
    """What came of E games of n agents; what was not to be kept has no rows."""

    returns: Reals  # [E, n], discounted sums of rewards
    total_rewards: Reals  # [E, n], plain sums
    turn_counts: Ints  # [E]
    terminated: Bools  # [E], in a terminal state
    final_states: Array  # [E, ...], the last
    control_variates: Reals  # [E, n], discounted sums of what was luck


ControlVariateFunction = Callable[[Array, Array, Outcome], Reals]  # how much of a turn was, [B, n]
DEFAULT_ARRAYS = (
    "returns",
    "total_rewards",
    "turn_counts",
    "terminated",
    "final_states",
)  # what is kept


class RolloutSpec(NamedTuple):
    """Which games are played, how, by whose work, and what is kept of each."""

    episodes: range
    turn_limit: int | None = None
    seed: int = 0
    workers: WorkerCount = 1
    executor: Executor | None = None
    progress: ProgressCallback | None = None
    keep: Sequence[str] = DEFAULT_ARRAYS
    control_variate: ControlVariateFunction | None = None


class PartialResults(NamedTuple):
    """What came of the games that were played where not all were, and which they are."""

    rollouts: tuple[Rollout, ...]  # by each entrant; none where there are no games
    episodes: Ints


class RolloutInterrupted(KeyboardInterrupt):
    """Ctrl-C while games were played."""

    def __init__(self, partial_results: PartialResults) -> None:
        super().__init__("interrupted")
        self.partial_results = partial_results


class RolloutBlocksLost(LostGames):
    """Games that were lost, and the rest of them."""

    def __init__(self, error: LostGames, partial_results: PartialResults) -> None:
        super().__init__(error.blocks, error.reason)
        self.partial_results = partial_results


def rollout(  # noqa: PLR0913 - each is the caller's to choose
    problem: Problem,
    policies: Sequence[Policy],
    *,
    episodes: int,
    turn_limit: int | None = None,
    seed: int = 0,
    first_episode: int = 0,
    workers: WorkerCount = 1,
    executor: Executor | None = None,
    progress: ProgressCallback | None = None,
    keep: Sequence[str] = DEFAULT_ARRAYS,
) -> Rollout:
    """Plays episodes `first` .. `first + episodes - 1` of a seed, one policy to a seat.

    Row r is the game that a session plays with `Dice(seed, first + r)`, whatever the workers or
    the executor, the blocks and their order. `progress` is told the share that is played. Raises
    Lost when workers died again and again, and Interrupted; what cannot be played is a BadPolicy,
    an IllegalAction or a BadParameter.
    """
    which = range(first_episode, first_episode + episodes)
    games = RolloutSpec(which, turn_limit, seed, workers, executor, progress, keep)
    (found,) = rollout_entrants(problem, [policies], games)
    return found


def rollout_entrants(
    problem: Problem, entrants: Sequence[Sequence[Policy]], spec: RolloutSpec
) -> tuple[Rollout, ...]:
    """The same games by each of some entrants, block by block: the policies of each, as above.

    So what was played by the time of an interruption was played by all. `luck` tells how much of
    what came of joint actions was luck: 0 where it is not given.
    """
    which, keep, workers, progress = spec.episodes, spec.keep, spec.workers, spec.progress
    if which.stop < which.start:
        raise BadParameter(f"episodes: got {which.stop - which.start}, expected 0 or more")
    spec = spec._replace(seed=SeededUniforms(spec.seed, which.start).seed)
    check_problem(problem, spec.turn_limit)
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
    work = partial(
        _run_block_for_entrants, problem, entrants, spec._replace(executor=None, progress=None)
    )
    alone = spec.executor is None and workers == 1 and progress is None
    hands = 0 if alone else workers if isinstance(workers, int) else 1
    size = (
        MAX_BLOCK_EPISODES
        if len(which) <= MIN_BLOCK_EPISODES
        else _block_size(problem, entrants, spec.seed, hands)
    )
    kept: tuple[Rollout, ...] | None = None
    played = np.zeros(len(which), bool)
    with report_progress_to(progress) if progress else nullcontext():
        budget = Budget("a rollout", "try fewer games at a time", math.inf)
        try:
            blocks = run_blocks(work, which, size=size, workers=workers, executor=spec.executor)
            for block, parts in blocks:
                kept = kept or tuple(_allocate_rollout(one, keep, len(which)) for one in parts)
                rows = slice(block.start - which.start, block.stop - which.start)
                for whole, one in zip(kept, parts, strict=True):
                    for name in keep:
                        getattr(whole, name)[rows] = getattr(one, name)
                played[rows] = True
                budget.spend_work(0, float(played.mean()))
        except LostGames as error:
            raise RolloutBlocksLost(
                error, _partial_results(kept, keep, which.start, played)
            ) from None
        except KeyboardInterrupt:
            raise RolloutInterrupted(_partial_results(kept, keep, which.start, played)) from None
    return kept or work(which)


def _block_size(
    problem: Problem, entrants: Sequence[Sequence[Policy]], seed: int, workers: int
) -> int:
    """The games of a block: so many that their memories fit, and no more than suits workers."""
    size = MAX_BLOCK_EPISODES
    for place, policies in enumerate(entrants):
        with _set_error_entrant(place):
            size = min(size, _max_episodes_in_memory(problem, policies, seed))
            if workers:
                size = min(size, _efficient_block_size(problem, policies, seed, workers))
    return size


def _max_episodes_in_memory(problem: Problem, policies: Sequence[Policy], seed: int) -> int:
    """The games whose memories may be held at a time, by what one game's take."""
    state = problem.sample_initial_states(
        generate_uniforms(
            seed, NATURE_STREAM, 0, first_episode=0, rows=1, count=problem.uniform_counts.start
        )
    )
    held = sum(
        part.nbytes
        for seat, one in enumerate(policies)
        for part in call_memory_method(
            "turn 1", one.initial_memory, 1, problem.initial_observation(state, seat)
        )
    )
    return int(
        np.clip(
            DEFAULT_MEMORY_BYTES / (MEMORY_COPIES * max(held, 1)),
            MIN_BLOCK_EPISODES,
            MAX_BLOCK_EPISODES,
        )
    )


def _efficient_block_size(
    problem: Problem, policies: Sequence[Policy], seed: int, workers: int
) -> int:
    """The games of a block of which all but a twentieth of the time is the games' own.

    And which takes so long that blocks can be handed to all workers meanwhile. Measured by the
    first turns of one game and of some: of few where one takes long.
    """

    def measure_seconds(episode_count: int) -> float:
        since = time.perf_counter()
        _run_block(problem, policies, RolloutSpec(range(episode_count), PROBE_TURNS, seed, keep=()))
        return time.perf_counter() - since

    measure_seconds(1)  # what is made once
    quick = measure_seconds(1) < MAX_QUICK_PROBE_SECONDS
    few, some, tries = (
        (2, PROBE_EPISODES, 3) if quick else (1, MIN_BLOCK_EPISODES, 1)
    )  # one may go a way of its own
    less, more = (min(measure_seconds(many) for _ in range(tries)) for many in (few, some))
    while (
        quick and more < 2 * less and some < MAX_BLOCK_EPISODES
    ):  # too few to tell what one more costs
        some *= 4
        more = min(measure_seconds(some) for _ in range(tries))
    each = max((more - less) / (some - few), 0.05 * more / some)  # a busy machine may say nothing
    wanted = max(19.0 * (less - few * each), DISPATCH_SECONDS * workers) / each
    return int(np.clip(wanted, MIN_BLOCK_EPISODES, MAX_BLOCK_EPISODES))


def _allocate_rollout(template: Rollout, keep: Sequence[str], episodes: int) -> Rollout:
    """Room for so many games, in the arrays that are kept."""
    many = [episodes if name in keep else 0 for name in Rollout._fields]
    return Rollout(
        *(
            np.empty((rows, *part.shape[1:]), part.dtype)
            for rows, part in zip(many, template, strict=True)
        )
    )


def _partial_results(
    results: tuple[Rollout, ...] | None, keep: Sequence[str], first_episode: int, finished: Bools
) -> PartialResults:
    """The games that were played."""
    found = (
        one._replace(**{name: getattr(one, name)[finished] for name in keep})
        for one in results or ()
    )
    return PartialResults(tuple(found), first_episode + np.flatnonzero(finished))


def _run_block_for_entrants(
    problem: Problem, entrants: Sequence[Sequence[Policy]], spec: RolloutSpec, episodes: range
) -> tuple[Rollout, ...]:
    """Has each of the entrants play these of the games."""
    np.empty(
        PREALLOCATED_BYTES, np.uint8
    )  # until as much is freed at once, glibc returns arrays page by page
    spec = spec._replace(episodes=episodes)
    found = []
    for place, policies in enumerate(entrants):
        with scale_progress_part(place, len(entrants)), _set_error_entrant(place):
            found.append(_run_block(problem, policies, spec))
    return tuple(found)


@contextmanager
def _set_error_entrant(entrant_index: int) -> Iterator[None]:
    """Has errors tell in whose games they came up."""
    try:
        yield
    except DmplayError as error:
        error.entrant_index = entrant_index
        raise


def _run_block(problem: Problem, policies: Sequence[Policy], spec: RolloutSpec) -> Rollout:
    """Plays these games side by side.

    All rows draw every turn, finished or not, so that two policies meet the same luck.
    """
    which, seed, luck, many = spec.episodes, spec.seed, spec.control_variate, len(spec.episodes)
    usual = problem.horizon or (DEFAULT_TURN_LIMIT if problem.can_run_forever else sys.maxsize)
    limit = usual if spec.turn_limit is None else spec.turn_limit
    budget = Budget("a rollout", "try fewer games at a time", math.inf)
    budget.check_memory(
        24.0 * many * max(*problem.uniform_counts, *(policy.uniform_count for policy in policies))
    )

    row = np.arange(many)  # the games that go on

    def generate_block_uniforms(stream: int, turn: int, count: int) -> Reals:
        only = row if len(row) < many else None
        return generate_uniforms(
            seed,
            stream,
            turn,
            first_episode=which.start,
            rows=many,
            count=count,
            selected_rows=only,
        )

    state = problem.sample_initial_states(
        generate_block_uniforms(NATURE_STREAM, 0, problem.uniform_counts.start)
    )
    discounted = problem.discount != 1.0
    sums = [np.zeros((many, len(policies))) for _ in range(1 + discounted + bool(luck))]
    ended = list[tuple[int, Memory]]()  # after so many turns: games, and what came of them
    weight, played = 1.0, 0
    memories = [
        call_memory_method(
            "turn 1", one.initial_memory, many, problem.initial_observation(state, seat)
        )
        for seat, one in enumerate(policies)
    ]
    for turn in range(1, limit + 1):
        over = problem.terminal(state)
        (off,) = over.nonzero()
        if len(off):  # these games are kept, and the others go on
            live, (on,) = (row, state, *sums), (~over).nonzero()
            ended.append((played, _take_rows(live, off)))
            row, state, *sums = _take_rows(live, on)
            memories = [_take_rows(memory, on) for memory in memories]
        if not len(row):
            break
        far = (turn - 1) / (limit if limit < sys.maxsize else DEFAULT_TURN_LIMIT + turn)
        share = 1.0 - (1.0 - far) * len(row) / many  # what is over is played
        budget.spend_work(0, share)
        drawn = [
            generate_block_uniforms(1 + seat, turn, policy.uniform_count)
            for seat, policy in enumerate(policies)
        ]
        where = [f"turn {turn}, {agent}" for agent in problem.agents]
        each = zip(where, policies, memories, strict=True)
        choosers = [partial(_choose_for_seat, *one) for one in each]
        with scale_progress(share, share):
            actions = _choose_joint_actions(problem, choosers, state, drawn, where)
        outcome = problem.step(
            state,
            actions,
            generate_block_uniforms(NATURE_STREAM, turn, problem.uniform_counts.step),
        )
        memories = [
            call_memory_method(
                at, one.update_memory, len(row), memory,
                problem.build_percept(seat, actions, outcome, required_fields(one)),
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
    length, state, totals, *others = _merge_in_episode_order(ended)
    lucky = others.pop() if luck else np.zeros_like(totals)
    returns = others.pop() if discounted else totals.copy()
    found = Rollout(returns, totals, length, over, state, lucky)
    unkept = {*Rollout._fields} - {*spec.keep}
    return found._replace(**{name: getattr(found, name)[:0] for name in unkept})


def _merge_in_episode_order(ended: Sequence[tuple[int, Memory]]) -> Memory:
    """How many turns each game lasted, and what came of it, in the order of the games."""
    lasted, parts = zip(*ended, strict=True)
    row, *rest = map(np.concatenate, zip(*parts, strict=True))
    length = np.repeat(lasted, [len(part[0]) for part in parts])
    place = np.empty_like(row)
    place[row] = np.arange(len(row))
    return _take_rows((length, *rest), place)


def _take_rows(arrays: Memory, indices: Ints) -> Memory:
    return tuple([part.take(indices, axis=0) for part in arrays])


def _choose_for_seat(
    error_prefix: str, policy: Policy, memory: Memory, legal: Bools | None, u: Reals
) -> Array:
    """What a policy chooses, an action for each game."""
    return validate_choices(
        policy, call_policy(error_prefix, policy.choose, memory, legal, u), len(u), error_prefix
    )


def _validate_actions(
    action_set: Labels | Interval, choices: Array, legal: Bools | None, error_prefix: str
) -> Array:
    """Actions `[B]` as they will act; raises IllegalAction where a session would."""
    if action_set.labels and choices.dtype.kind == "f":
        for one in np.unique(choices):
            action_set.validate_action(one.item(), error_prefix)
    done = choices.astype(np.int64, copy=False) if action_set.labels else choices
    # Read without a sign, what is below 0 is beyond the last label.
    if not action_set.labels or np.maximum.reduce(done.view(np.uint64)) >= len(action_set.labels):
        for one in (done.min(), done.max()):
            action_set.validate_action(one.item(), error_prefix)
    if action_set.labels and legal is not None:
        able = legal.reshape(-1).take(np.arange(0, legal.size, legal.shape[1]) + done)
        if not able.all():
            row = able.argmin()
            action_set.validate_action(done[row].item(), error_prefix, legal[row])
    return done


def _choose_joint_actions(
    problem: Problem,
    choosers: Sequence[Callable[[Bools | None, Reals], Array]],
    state: Array,
    uniforms: Sequence[Reals],
    error_prefixes: Sequence[str],
) -> Array:
    """The joint actions `[B, n]` that the policies choose, reals to so many decimals."""
    legal = problem.legal_actions_mask(state)
    chosen = [
        choose(None if legal is None else readonly_copy(legal[:, seat]), u)
        for seat, (choose, u) in enumerate(zip(choosers, uniforms, strict=True))
    ]
    if legal is not None:  # whoever only waits is not asked
        waiting = problem.inactive_agents(state)
        for seat, waits in enumerate(waiting.T):
            if waits.any():
                chosen[seat] = np.where(waits, problem.wait_action(seat), chosen[seat])
    able = [
        _validate_actions(
            problem.actions[seat],
            one,
            None if legal is None else legal[:, seat],
            error_prefixes[seat],
        )
        for seat, one in enumerate(chosen)
    ]
    actions = stack_columns(able, int if all(problem.action_counts) else float)
    # As in a session, so that the text of an action is the action.
    return np.round(actions, ACTION_DECIMALS) + 0.0 if actions.dtype.kind == "f" else actions
