"""Rollouts: batches of games, played by policies without people, and their returns."""

import math
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from contextlib import contextmanager, nullcontext
from functools import partial
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np

from dmplay.core.arrays import Array, Bools, Ints, Reals, readonly_copy
from dmplay.core.policy import (
    Memory,
    Policy,
    check_policies,
    forbid_exit,
    forbid_writes,
    required_fields,
)
from dmplay.core.problem import (
    Outcome,
    Problem,
    build_percept,
    check_problem,
    find_wait_action,
    make_initial_observation,
    mark_inactive_agents,
    validate_outcome,
)
from dmplay.core.session import DEFAULT_TURN_LIMIT, call_memory_method, validate_policy_actions
from dmplay.core.spaces import ACTION_DECIMALS
from dmplay.core.uniforms import NATURE_STREAM, SeededUniforms, generate_uniforms
from dmplay.core.work_budget import (
    DEFAULT_MEMORY_BYTES,
    Budget,
    ProgressCallback,
    report_progress_to,
    scale_progress,
    scale_progress_to_part,
)
from dmplay.errors import BadParameter, Forfeit, LostGames, UnknownName, record_seat
from dmplay.simulation.worker_pool import MAX_BLOCK_EPISODES, WorkerCount, run_blocks

T = TypeVar("T")
# minimum episodes of a block; episodes and turns of a timing probe
MIN_BLOCK_EPISODES, PROBE_EPISODES, PROBE_TURNS = 8, 32, 2
REGRET_DECIMALS = 9  # decimals of a regret at a scale of 1
DISPATCH_SECONDS = 0.006  # seconds that an executor takes to dispatch a block to a worker
OBJECT_MEMORY_BYTES = 2**16  # assumed size of a game that a policy remembers as Python objects
MEMORY_COPIES = 8  # copies of a memory that a policy makes while it updates it
# bytes that are freed at once, so that the allocator keeps them for the next arrays
PREALLOCATED_BYTES = 2**24
# seconds of the largest probe, so that the cold caches of a busy machine do not count
MIN_LARGE_PROBE_SECONDS = 0.005
MIN_GAME_SECONDS = 1e-9  # seconds that a probed game takes at least
MAX_QUICK_PROBE_SECONDS = 0.005  # seconds of a probe of one game up to which larger probes are run


class Rollout(NamedTuple):
    """The results of E games of n agents; arrays that are not kept have no rows.

    The last four arrays have entries for the T turns of the longest game. After the end of a game,
    these are 0 for rewards, -1 for other integers, nan for other reals, and else 0, "" or None.
    """

    returns: Reals  # [E, n], discounted sums of rewards
    total_rewards: Reals  # [E, n], undiscounted sums of rewards
    turn_counts: Ints  # [E]
    terminated: Bools  # [E], whether the game ended in a terminal state
    final_states: Array  # [E, ...], the final states
    control_variates: Reals  # [E, n], discounted sums of the control variate
    # [E, n, 2, 2], lower and upper bounds of the sums of regrets, discounted and undiscounted; nan
    # for a seat without a regret meter
    regrets: Reals
    choice_counts: Ints  # [E, n], the choices whose regrets these are
    states: Array  # [E, T + 1, ...], the initial state and the state after each turn
    actions: Array  # [E, T, n], joint actions
    observations: Array  # [E, T, n, ...], after each turn; the states if agents see them
    rewards: Reals  # [E, T, n]


TRAJECTORY_ARRAYS = ("states", "actions", "observations", "rewards")
TRAJECTORIES = "trajectories"  # stands in `keep` for these, and for the turn counts
# the luck [B, n] in the rewards of a turn
ControlVariateFunction = Callable[[Array, Array, Outcome], Reals]
# the arrays kept by default
DEFAULT_ARRAYS = ("returns", "total_rewards", "turn_counts", "terminated", "final_states")


class RegretMeter(Protocol):
    """A judge of the choices of one seat in a batch of games, by the values of a policy."""

    @property
    def policy(self) -> Policy:
        """The policy whose memory the judge needs."""

    @property
    def seat(self) -> int:
        """The seat whose choices are judged."""

    def bound_regrets(self, memory: Memory, legal: Bools | None, actions: Array) -> Reals | None:
        """Return a lower and an upper bound `[2, B]` of the regret of each action, if known."""


class RolloutSpec(NamedTuple):
    """The settings of a rollout: episodes, turn limit, seed, workers, and the arrays to keep."""

    episodes: range
    turn_limit: int | None = None
    seed: int = 0
    workers: WorkerCount = 1
    executor: Executor | None = None
    progress: ProgressCallback | None = None
    keep: Sequence[str] = DEFAULT_ARRAYS
    control_variate: ControlVariateFunction | None = None
    start_uniforms: Reals | None = None  # of all games; None if each game has its own
    regret_meters: Sequence[RegretMeter] = ()


class PartialResults(NamedTuple):
    """The results of the games that were played before a rollout was cut short."""

    rollouts: tuple[Rollout, ...]  # one for each entrant; empty if no games were played
    episodes: Ints


class RolloutInterrupted(KeyboardInterrupt):
    """A KeyboardInterrupt (Ctrl-C) during a rollout, with the partial results."""

    def __init__(self, partial_results: PartialResults) -> None:
        super().__init__("interrupted")
        self.partial_results = partial_results


class RolloutBlocksLost(LostGames):
    """Games that were lost with their workers, with the partial results of the others."""

    def __init__(self, error: LostGames, partial_results: PartialResults) -> None:
        super().__init__(error.blocks, error.reason)
        self.partial_results = partial_results


def rollout_entrants(
    problem: Problem, entrants: Sequence[Sequence[Policy]], spec: RolloutSpec
) -> tuple[Rollout, ...]:
    """Play the same games with each entrant (a policy per seat), and return a rollout for each.

    The games are played block by block, so that after an interruption all entrants have played the
    same games. `control_variate` computes the luck in the outcome of joint actions; without it the
    luck is 0.
    """
    episode_range, keep, workers, progress = spec.episodes, spec.keep, spec.workers, spec.progress
    first, stop = episode_range.start, episode_range.stop
    if stop < first:
        raise BadParameter(f"episodes: got {stop - first}, expected 0 or more")
    spec = spec._replace(seed=SeededUniforms(spec.seed, first).seed)
    check_problem(problem, spec.turn_limit)
    for policies in entrants:
        check_policies(problem.agents, policies)
    keep = [keep] if isinstance(keep, str) else keep
    for name in keep:
        if name not in {*Rollout._fields, TRAJECTORIES}:
            raise UnknownName("array", name, [*Rollout._fields, TRAJECTORIES])
    if TRAJECTORIES in keep:
        keep = [*dict.fromkeys([*keep, "turn_counts", *TRAJECTORY_ARRAYS])]
        keep.remove(TRAJECTORIES)
    spec = spec._replace(keep=keep)
    block_spec = spec._replace(executor=None, progress=None)
    block_function = partial(_run_block_for_entrants, problem, entrants, block_spec)
    in_process = spec.executor is None and workers == 1 and progress is None
    probe_workers = 0 if in_process else workers if isinstance(workers, int) else 1
    size = MAX_BLOCK_EPISODES
    if len(episode_range) > MIN_BLOCK_EPISODES:
        size = _block_size(problem, entrants, spec, probe_workers)
    results: tuple[Rollout, ...] | None = None
    finished = np.zeros(len(episode_range), bool)
    with report_progress_to(progress) if progress else nullcontext():
        budget = Budget("rollout", "try fewer games at a time", math.inf)
        try:
            blocks = run_blocks(
                block_function, episode_range, size=size, workers=workers, executor=spec.executor
            )
            for block, block_results in blocks:
                results = tuple(
                    _allocate_rollout(block_result, keep, len(episode_range), earlier)
                    for block_result, earlier in zip(
                        block_results, results or [None] * len(entrants), strict=True
                    )
                )
                block_rows = slice(block.start - first, block.stop - first)
                for result, block_result in zip(results, block_results, strict=True):
                    for name in keep:
                        _store_rows(getattr(result, name), block_rows, getattr(block_result, name))
                finished[block_rows] = True
                budget.spend_work(0, float(finished.mean()))
        except LostGames as error:
            partial_results = _collect_finished_episodes(results, keep, first, finished)
            raise RolloutBlocksLost(error, partial_results) from None
        except KeyboardInterrupt:
            partial_results = _collect_finished_episodes(results, keep, first, finished)
            raise RolloutInterrupted(partial_results) from None
    return results or block_function(episode_range)


def _block_size(
    problem: Problem, entrants: Sequence[Sequence[Policy]], spec: RolloutSpec, workers: int
) -> int:
    """Return the episodes per block: few enough for memory, and not more than suits the workers."""
    size = MAX_BLOCK_EPISODES
    for index, policies in enumerate(entrants):
        with _name_entrant_in_errors(index):
            size = min(size, _max_episodes_in_memory(problem, policies, spec))
            try:
                if workers:
                    size = min(size, _efficient_block_size(problem, policies, spec, workers))
            except Forfeit:  # A game of the probe does not count.
                size = MIN_BLOCK_EPISODES
    return size


def _list_memory_keepers(policies: Sequence[Policy], spec: RolloutSpec) -> list[tuple[int, Policy]]:
    """Return the seat and the policy of each memory: those of players, then of regret meters."""
    return [*enumerate(policies), *((meter.seat, meter.policy) for meter in spec.regret_meters)]


def _max_episodes_in_memory(problem: Problem, policies: Sequence[Policy], spec: RolloutSpec) -> int:
    """Return the largest number of episodes whose memories fit, measured by those of one game."""
    start_count = problem.uniform_counts.start
    u = generate_uniforms(spec.seed, NATURE_STREAM, 0, first_episode=0, rows=1, count=start_count)
    state, memory_bytes = problem.sample_initial_states(u), 0
    for seat, policy in _list_memory_keepers(policies, spec):
        observation = make_initial_observation(problem, state, seat)
        memory = call_memory_method("turn 1", policy.initial_memory, 1, observation)
        memory_bytes += sum(array.nbytes for array in memory)
        if any(array.dtype == object for array in memory):  # Its size is unknown, and grows.
            memory_bytes = max(memory_bytes, OBJECT_MEMORY_BYTES)
    max_episodes = DEFAULT_MEMORY_BYTES / (MEMORY_COPIES * max(memory_bytes, 1))
    return int(np.clip(max_episodes, MIN_BLOCK_EPISODES, MAX_BLOCK_EPISODES))


def _efficient_block_size(
    problem: Problem, policies: Sequence[Policy], spec: RolloutSpec, workers: int
) -> int:
    """Return the episodes per block for which at most a twentieth of the time is overhead.

    A block also takes long enough to dispatch blocks to all workers in the meantime. Both are
    measured by the first turns of one game and of several; of few if one game is slow.

    The time is that of this thread, so that other programs do not count, or the waiting for them.
    """

    # A script may have no action after the last turn of the game.
    limit = problem.horizon if spec.turn_limit is None else spec.turn_limit
    turns = PROBE_TURNS if limit is None else min(PROBE_TURNS, limit)

    def measure_seconds(episode_count: int) -> float:
        """Return the seconds that the first turns of this many episodes take."""
        start_time = time.thread_time()
        _play_block(problem, policies, RolloutSpec(range(episode_count), turns, spec.seed, keep=()))
        return time.thread_time() - start_time

    measure_seconds(1)  # The first call computes what is cached later.
    start_time = time.perf_counter()
    measure_seconds(1)
    is_quick = time.perf_counter() - start_time < MAX_QUICK_PROBE_SECONDS
    # a single game may be unusual
    small_count, large_count, repeats = (
        (2, PROBE_EPISODES, 3) if is_quick else (1, MIN_BLOCK_EPISODES, 1)
    )
    small_seconds, large_seconds = (
        min(measure_seconds(count) for _ in range(repeats)) for count in (small_count, large_count)
    )
    while (
        is_quick
        and large_seconds < max(2 * small_seconds, MIN_LARGE_PROBE_SECONDS)
        and large_count < MAX_BLOCK_EPISODES
    ):  # too few games to measure the cost of one more, beside that of cold caches
        large_count = min(4 * large_count, MAX_BLOCK_EPISODES)
        large_seconds = min(measure_seconds(large_count) for _ in range(repeats))
    # The difference may be too small, and the clock of a thread too coarse.
    seconds_per_game = max(
        (large_seconds - small_seconds) / (large_count - small_count),
        0.05 * large_seconds / large_count,
        MIN_GAME_SECONDS,
    )
    overhead = small_seconds - small_count * seconds_per_game
    block_size = max(19.0 * overhead, DISPATCH_SECONDS * workers) / seconds_per_game
    return int(np.clip(block_size, MIN_BLOCK_EPISODES, MAX_BLOCK_EPISODES))


def _allocate_rollout(
    template: Rollout, keep: Sequence[str], episodes: int, earlier: Rollout | None = None
) -> Rollout:
    """Return arrays `[episodes, ...]` with the rows of earlier blocks; else they have no rows.

    Arrays with an entry for each turn grow with the longest game, and are padded. Raise
    BudgetExceeded if they take more memory than results may.
    """
    arrays = []
    for name in Rollout._fields:
        array, old = getattr(template, name), earlier and getattr(earlier, name)
        if name not in keep:
            arrays.append(array[:0])
        elif name not in TRAJECTORY_ARRAYS:
            new = np.empty((episodes, *array.shape[1:]), array.dtype) if old is None else old
            arrays.append(new)
        else:
            turns = array.shape[1] if old is None else max(array.shape[1], old.shape[1])
            dtype = array.dtype if old is None else np.result_type(array, old)
            if old is None or (turns, dtype) != (old.shape[1], old.dtype):
                shape = (episodes, turns, *array.shape[2:])
                _check_trajectory_memory(math.prod(shape) * dtype.itemsize)
                padded = _make_padding(shape, dtype, name)
                if old is not None:
                    _store_rows(padded, slice(None), old)
                old = padded
            arrays.append(old)
    return Rollout(*arrays)


def _store_rows(target: Array, rows: slice, array: Array) -> None:
    """Store rows, those of trajectories with at most as many turns as the target."""
    if array.ndim > 1 and array.shape[1] != target.shape[1]:
        target[rows, : array.shape[1]] = array
    else:
        target[rows] = array


def _check_trajectory_memory(byte_count: float) -> None:
    """Raise BudgetExceeded if an array of all turns takes more memory than a computation may."""
    remedy = "keep fewer arrays, or play fewer games at a time, with first_episode"
    Budget("trajectories", remedy).check_memory(byte_count)


def _make_padding(shape: tuple[int, ...], dtype: np.dtype[Any], name: str) -> Array:
    """Return an array with the entries that stand for no turn."""
    fill: dict[str, object] = {} if name == "rewards" else {"i": -1, "f": math.nan, "O": None}
    padding: Array = np.full(shape, fill.get(dtype.kind, np.zeros((), dtype).item()), dtype)
    return padding


def merge_rollouts(parts: Sequence[Rollout]) -> Rollout:
    """Return the games of several rollouts without trajectories as one rollout."""
    return Rollout(*map(np.concatenate, zip(*parts, strict=True)))


class _TrajectoryRecorder:
    """The arrays of each turn of a block of games, as far as they are kept."""

    def __init__(self, keep: Sequence[str], episode_count: int) -> None:
        self.names = [name for name in TRAJECTORY_ARRAYS if name in keep]
        self._turns: dict[str, list[Array]] = {name: [] for name in self.names}
        self._episode_count, self._byte_count = episode_count, 0

    def add_turn(self, rows: Ints, **arrays: Array) -> None:
        """Add the arrays `[rows, ...]` of a turn of the running games."""
        for name in self.names:
            if name in arrays:
                array = arrays[name]
                shape = (self._episode_count, *array.shape[1:])
                padded = _make_padding(shape, array.dtype, name)
                padded[rows] = array
                self._turns[name].append(padded)
                self._byte_count += padded.nbytes
        _check_trajectory_memory(self._byte_count)

    def stack_turns(self, templates: Mapping[str, Array]) -> list[Array]:
        """Return each array `[B, T, ...]`; an array that is not kept has no rows.

        An array without turns gets its shape from a template `[B, ...]` of one turn.
        """
        arrays = []
        for name in TRAJECTORY_ARRAYS:
            turns = self._turns.get(name)
            if turns:
                arrays.append(np.stack(turns, axis=1))
            else:
                row_count = 0 if turns is None else self._episode_count
                shape = (row_count, int(name == "states"), *templates[name].shape[1:])
                arrays.append(np.zeros(shape, templates[name].dtype))
        return arrays


def _collect_finished_episodes(
    results: tuple[Rollout, ...] | None, keep: Sequence[str], first_episode: int, finished: Bools
) -> PartialResults:
    """Return the results and the numbers of the episodes that were finished."""
    rollouts_so_far = (
        result._replace(**{name: getattr(result, name)[finished] for name in keep})
        for result in results or ()
    )
    return PartialResults(tuple(rollouts_so_far), first_episode + np.flatnonzero(finished))


def _run_block_for_entrants(
    problem: Problem, entrants: Sequence[Sequence[Policy]], spec: RolloutSpec, episodes: range
) -> tuple[Rollout, ...]:
    """Return the rollout of each entrant for one block of episodes."""
    # Until this much is freed at once, glibc gives the memory of arrays back page by page.
    np.empty(PREALLOCATED_BYTES, np.uint8)
    spec = spec._replace(episodes=episodes)
    results = []
    for index, policies in enumerate(entrants):
        with scale_progress_to_part(index, len(entrants)), _name_entrant_in_errors(index):
            try:
                results.append(_play_block(problem, policies, spec))
            except Forfeit as error:
                if error.episode is not None:
                    error.episode += episodes.start
                raise
    return tuple(results)


def _call_recording_seat(seat: int, method: Callable[..., T], *args: object) -> T:
    """Return the result of a call, and record the seat in an error that its policy raises.

    Raise BadPolicy if it would end the program.
    """
    try:
        return forbid_exit(method, *args)
    except Exception as error:
        record_seat(error, seat)
        raise


@contextmanager
def _name_entrant_in_errors(entrant_index: int) -> Iterator[None]:
    """Run the block and record the index of the entrant in errors that it raises."""
    try:
        yield
    except Exception as error:
        vars(error)["entrant_index"] = entrant_index
        raise


def _play_block(  # noqa: PLR0915 - the steps of one loop
    problem: Problem, policies: Sequence[Policy], spec: RolloutSpec
) -> Rollout:
    """Play a block of games in parallel rows and return their rollout.

    All rows consume uniforms every turn, finished or not, so that two policies meet the same random
    events.
    """
    episodes, control_variate, episode_count = (
        spec.episodes, spec.control_variate, len(spec.episodes)
    )  # fmt: skip
    endless_limit = DEFAULT_TURN_LIMIT if problem.can_run_forever else sys.maxsize
    default_limit = problem.horizon or endless_limit
    limit = default_limit if spec.turn_limit is None else spec.turn_limit
    budget = Budget("rollout", "try fewer games at a time", math.inf)
    policy_counts = (policy.uniform_count for policy in policies)
    budget.check_memory(24.0 * episode_count * max(*problem.uniform_counts, *policy_counts))

    running = np.arange(episode_count)  # the games that are still running

    def generate_block_uniforms(stream: int, turn: int, count: int) -> Reals:
        """Return the uniforms of the running games."""
        selected_rows = running if len(running) < episode_count else None
        return generate_uniforms(
            spec.seed, stream, turn, first_episode=episodes.start, rows=episode_count,
            count=count, selected_rows=selected_rows,
        )  # fmt: skip

    u = generate_block_uniforms(NATURE_STREAM, 0, problem.uniform_counts.start)
    if spec.start_uniforms is not None:
        u = np.tile(spec.start_uniforms, (episode_count, 1))
    state, discounted = problem.sample_initial_states(u), problem.discount != 1.0
    shape = 1 + discounted + bool(control_variate), episode_count, len(policies)
    sums, meters = [*np.zeros(shape)], spec.regret_meters
    regret_sums = np.full((episode_count, len(policies), 2, 2), np.nan)
    regret_sums[:, [meter.seat for meter in meters]] = 0.0
    judgments = [regret_sums, np.zeros((episode_count, len(policies)), int)] if meters else []
    keepers = _list_memory_keepers(policies, spec)
    # turns played -> arrays of the games that ended then
    finished_groups = list[tuple[int, Memory]]()
    recorder = _TrajectoryRecorder(spec.keep, episode_count)
    recorder.add_turn(running, states=state)
    weight, turns_played = 1.0, 0
    memories = []
    for seat, player in keepers:
        observation = make_initial_observation(problem, state, seat)
        memory = _call_recording_seat(
            seat, call_memory_method, "turn 1", player.initial_memory, episode_count, observation
        )
        memories.append(memory)
    for turn in range(1, limit + 1):
        terminal = problem.terminal(state)
        (finished_rows,) = terminal.nonzero()
        if len(finished_rows):  # Finished games are stored, and the others continue.
            arrays = (running, state, *sums, *judgments)
            (running_rows,) = (~terminal).nonzero()
            finished_groups.append((turns_played, _take_rows(arrays, finished_rows)))
            running, state, *all_sums = _take_rows(arrays, running_rows)
            sums, judgments = all_sums[: len(sums)], all_sums[len(sums) :]
            memories = [_take_rows(memory, running_rows) for memory in memories]
        if not len(running):
            break
        progress = (turn - 1) / (limit if limit < sys.maxsize else DEFAULT_TURN_LIMIT + turn)
        # finished games count as fully played
        share = 1.0 - (1.0 - progress) * len(running) / episode_count
        budget.spend_work(0, share)
        choice_uniforms = [
            generate_block_uniforms(1 + seat, turn, policy.uniform_count)
            for seat, policy in enumerate(policies)
        ]
        error_prefixes = [f"turn {turn}, {agent}" for agent in problem.agents]
        players = zip(error_prefixes, policies, memories, strict=False)
        choosers = [partial(_choose_for_seat, *player) for player in players]
        with scale_progress(share, share):
            actions = _choose_joint_actions(
                problem, choosers, state, choice_uniforms, error_prefixes
            )
        for meter, memory in zip(meters, memories[len(policies) :], strict=True):
            _add_regrets(problem, meter, memory, state, actions, weight, judgments)
        u = generate_block_uniforms(NATURE_STREAM, turn, problem.uniform_counts.step)
        outcome = problem.step(state, actions, u)
        validate_outcome(problem, outcome)
        for index, (seat, player) in enumerate(keepers):
            percept = build_percept(problem, seat, actions, outcome, required_fields(player))
            memories[index] = _call_recording_seat(
                seat, call_memory_method, error_prefixes[seat], player.update_memory, len(running),
                memories[index], percept,
            )  # fmt: skip
        if recorder.names:
            recorder.add_turn(
                running,
                states=outcome.state,
                actions=actions,
                observations=outcome.observations
                if problem.partially_observable
                else outcome.state,
                rewards=outcome.rewards + 0.0,
            )
        sums[0] += outcome.rewards
        if discounted:
            sums[1] += weight * outcome.rewards
        if control_variate:
            sums[-1] += weight * control_variate(state, actions, outcome)
        state, turns_played = outcome.state, turn
        weight *= problem.discount
    finished_groups.append((turns_played, (running, state, *sums, *judgments)))
    terminal = np.ones(episode_count, bool)
    terminal[running] = problem.terminal(state)
    turn_counts, state, totals, *other_sums = _merge_in_episode_order(finished_groups)
    counts = other_sums.pop() if meters else np.zeros(totals.shape, int)
    regrets = other_sums.pop() if meters else np.full((*totals.shape, 2, 2), np.nan)
    control_variates = other_sums.pop() if control_variate else np.zeros_like(totals)
    returns = other_sums.pop() if discounted else totals.copy()
    no_turn = {"states": state, "actions": totals, "observations": totals, "rewards": totals}
    trajectories = recorder.stack_turns(no_turn)
    result = Rollout(
        returns, totals, turn_counts, terminal, state, control_variates, regrets, counts,
        *trajectories,
    )  # fmt: skip
    omitted = {*Rollout._fields} - {*spec.keep}
    return result._replace(**{name: getattr(result, name)[:0] for name in omitted})


def _add_regrets(  # noqa: PLR0913, PLR0917 - the facts of one turn
    problem: Problem,
    meter: RegretMeter,
    memory: Memory,
    state: Array,
    actions: Array,
    weight: float,
    judgments: Sequence[Array],
) -> None:
    """Add the regrets of one seat's choices in a turn to the sums and counts of the games."""
    seat, (sums, counts) = meter.seat, judgments
    legal = problem.legal_actions_mask(state)
    bounds = meter.bound_regrets(
        memory, None if legal is None else legal[:, seat], actions[:, seat]
    )
    if bounds is None:
        sums[:, seat] = np.nan
        return
    # Rounded, as the last digits depend on which games are played together.
    scale, is_choice = problem.reward_scale, ~mark_inactive_agents(problem, state)[:, seat]
    rounded = scale * np.round(bounds / scale, REGRET_DECIMALS)
    regrets = np.where(is_choice, rounded, 0.0).T
    sums[:, seat, 0] += weight * regrets
    sums[:, seat, 1] += regrets
    counts[:, seat] += is_choice


def _merge_in_episode_order(ended: Sequence[tuple[int, Memory]]) -> Memory:
    """Return the turn counts and the arrays of all finished games, in episode order."""
    turns_played, parts = zip(*ended, strict=True)
    indices, *arrays = map(np.concatenate, zip(*parts, strict=True))
    turn_counts = np.repeat(turns_played, [len(group[0]) for group in parts])
    order = np.empty_like(indices)
    order[indices] = np.arange(len(indices))
    return _take_rows((turn_counts, *arrays), order)


def _take_rows(arrays: Memory, indices: Ints) -> Memory:
    """Return the rows at these indices of each array."""
    return tuple([array.take(indices, axis=0) for array in arrays])


def _choose_for_seat(
    error_prefix: str, policy: Policy, memory: Memory, legal: Bools | None, u: Reals
) -> Array:
    """Return the actions that a policy chooses, one for each game; raise BadPolicy if invalid."""
    answer = forbid_writes(error_prefix, policy.choose, memory, legal, u)
    return validate_policy_actions(policy, answer, len(u), error_prefix)


def _validate_actions(
    problem: Problem, seat: int, choices: Array, legal: Bools | None, error_prefix: str
) -> Array:
    """Return valid actions `[B]`, labels as integers; raise IllegalAction where a session would."""
    action_set = problem.actions[seat]
    if action_set.labels and choices.dtype.kind == "f":
        for action in np.unique(choices):
            action_set.validate_action(action.item(), error_prefix)
    actions = choices.astype(np.int64, copy=False) if action_set.labels else choices
    # As an unsigned number, a negative action is larger than the last index.
    label_count = len(action_set.labels)
    if not label_count or np.maximum.reduce(actions.view(np.uint64)) >= label_count:
        for action in (actions.min(), actions.max()):
            action_set.validate_action(action.item(), error_prefix)
    if action_set.labels and legal is not None:
        is_legal = legal.reshape(-1).take(np.arange(0, legal.size, legal.shape[1]) + actions)
        if not is_legal.all():
            row = is_legal.argmin()
            action, reason = actions[row].item(), problem.illegal_reason
            action_set.validate_action(action, error_prefix, legal[row], reason)
    return actions


def _choose_joint_actions(
    problem: Problem,
    choosers: Sequence[Callable[[Bools | None, Reals], Array]],
    state: Array,
    uniforms: Sequence[Reals],
    error_prefixes: Sequence[str],
) -> Array:
    """Return the joint actions `[B, n]` that the policies choose, real numbers rounded."""
    legal = problem.legal_actions_mask(state)
    choices = [
        _call_recording_seat(
            seat, choose, None if legal is None else readonly_copy(legal[:, seat]), u
        )
        for seat, (choose, u) in enumerate(zip(choosers, uniforms, strict=True))
    ]
    if legal is not None:  # Inactive agents wait, whatever their policy chose.
        for seat, is_inactive in enumerate(mark_inactive_agents(problem, state).T):
            if is_inactive.any():
                wait_action = find_wait_action(problem, seat)
                choices[seat] = np.where(is_inactive, wait_action, choices[seat])
    valid_actions = []
    for seat, seat_actions in enumerate(choices):
        seat_legal = None if legal is None else legal[:, seat]
        call = problem, seat, seat_actions, seat_legal, error_prefixes[seat]
        valid_actions.append(_call_recording_seat(seat, _validate_actions, *call))
    actions = np.stack(valid_actions, axis=1).astype(int if all(problem.action_counts) else float)
    # Rounded as in a session, so that the text of an action is exactly the action.
    return np.round(actions, ACTION_DECIMALS) + 0.0 if actions.dtype.kind == "f" else actions
