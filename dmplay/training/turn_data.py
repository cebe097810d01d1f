"""Turns as data: written from games of an agent, and read for batch training.

A row has the game, the state s, the action a, the reward r, the next state s' and whether the game
is done. If the state is hidden, the columns o and o' are the observations before and after it.
"""

import csv
from collections.abc import Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from dmplay.agents.learned_policy import make_follower
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.policy import Percept, Policy
from dmplay.core.problem import Problem
from dmplay.core.safe_files import read_bytes
from dmplay.core.spaces import Labels
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.recorded_games import read
from dmplay.game.transcript_verification import TRANSCRIPT_SUFFIX
from dmplay.simulation.learning_games import Transition
from dmplay.simulation.rollouts import TRAJECTORIES, RolloutSpec, rollout_entrants

GAMES_PER_BLOCK = 256
MAX_ROWS = 2_000_000
# game, state or observation, action, reward, next state or observation, done
ParsedRow = tuple[str, Array, int, float, Array, bool]


class TurnData(NamedTuple):
    """N turns: what the learner saw, what it did, and what followed."""

    inputs: Array  # [N, ...], states or beliefs
    actions: Ints  # [N]
    rewards: Reals  # [N]
    next_inputs: Array  # [N, ...]
    next_legal: Bools | None  # [N, A]
    done: Bools  # [N], after which no reward can follow


def column_names(problem: Problem) -> list[str]:
    """Return the columns of the turns of a problem."""
    before = "o" if problem.partially_observable else "s"
    return ["game", before, "a", "r", f"{before}'", "done"]


def collect_rows(problem: Problem, policy: Policy, count: int, seed: int) -> list[list[object]]:
    """Return `count` turns of games of a policy; the last game may be incomplete."""
    return [*islice(_iterate_rows(problem, policy, seed), count)]


def _iterate_rows(problem: Problem, policy: Policy, seed: int) -> Iterator[list[object]]:
    """Yield the turns of games without end."""
    first = 0
    while True:
        games = range(first, first + GAMES_PER_BLOCK)
        (block,) = rollout_entrants(
            problem, [[policy]], RolloutSpec(games, seed=seed, keep=(TRAJECTORIES, "terminated"))
        )
        hidden = problem.partially_observable
        for row, game in enumerate(games):
            last = int(block.turn_counts[row]) - 1
            start = problem.initial_observations(block.states[row, :1])[0, 0] if hidden else None
            for turn in range(last + 1):
                percepts = [start, *block.observations[row, :, 0]] if hidden else block.states[row]
                yield [
                    game,
                    _format_percept(problem, percepts[turn]),
                    problem.format_action(0, block.actions[row, turn, 0]),
                    float(block.rewards[row, turn, 0]),
                    _format_percept(problem, percepts[turn + 1]),
                    int(turn == last and _is_done(problem, block.terminated[row])),
                ]
        first += GAMES_PER_BLOCK


def _is_done(problem: Problem, terminated: bool) -> bool:
    """Return whether no reward can follow the last turn of a game."""
    return bool(terminated) or problem.is_finite_horizon


def _format_percept(problem: Problem, percept: Array) -> str:
    """Return a state, or the observation of a hidden state, as text; '' for none."""
    if not problem.partially_observable:
        return problem.format_state(percept)
    is_null = bool(np.all(percept == problem.observations[0].null_observation(1)[0]))
    return "" if is_null else problem.observations[0].format_observation(percept)


def read_turn_data(path: Path, problem: Problem) -> TurnData:
    """Return the turns in a file of `dmplay data`, or in transcripts.

    Raise BadParameter with the line of the first error.
    """
    is_transcript = path.suffix == TRANSCRIPT_SUFFIX or path.is_dir()
    parsed = [*(_iterate_recorded_rows if is_transcript else _iterate_file_rows)(path, problem)]
    if not 0 < len(parsed) <= MAX_ROWS:
        raise BadParameter(f"{path}: got {len(parsed)} turns, expected 1 to {MAX_ROWS}")
    games, before, actions, rewards, after, done = zip(*parsed, strict=True)
    a = np.array(actions, np.int64)
    if problem.partially_observable:
        inputs, next_inputs = _compute_beliefs(problem, games, a, before, after)
        next_legal = None
    else:
        inputs, next_inputs = np.array(before), np.array(after)
        mask = problem.legal_actions_mask(next_inputs)
        next_legal = None if mask is None else mask[:, 0]
    return TurnData(inputs, a, np.array(rewards), next_inputs, next_legal, np.array(done, bool))


def _iterate_recorded_rows(path: Path, problem: Problem) -> Iterator[ParsedRow]:
    """Yield the turns of the first seat in transcripts of this problem."""
    for game in read([path]):
        session = game.session
        if type(session.problem) is not type(problem):
            raise BadParameter(f"{game.transcript.path}: a game of {game.problem_name}")
        hidden, last = problem.partially_observable, len(session.turns) - 1
        reasons = ("terminal", "horizon") if problem.is_finite_horizon else ("terminal",)
        percept = session.initial_state
        if hidden:
            percept = problem.initial_observations(percept[None])[0, 0]
        for number, turn in enumerate(session.turns):
            following = turn.observations[0] if hidden else turn.state
            done = number == last and session.end_reason in reasons
            action, reward = int(turn.actions[0]), float(turn.rewards[0])
            yield str(game.transcript.path), percept, action, reward, following, done
            percept = following


def _iterate_file_rows(path: Path, problem: Problem) -> Iterator[ParsedRow]:
    """Yield the turns in a file of comma-separated values."""
    try:
        lines = read_bytes(path).decode().splitlines()
    except OSError as error:
        raise BadParameter(f"{path}: {error.strerror}") from None
    except UnicodeDecodeError:
        raise BadParameter(f"{path}: not UTF-8, expected comma-separated values") from None
    rows, names = [*csv.reader(lines)], column_names(problem)
    if not rows or rows[0] != names:
        got = ",".join(rows[0])[:40] if rows else "an empty file"
        raise BadParameter(f"{path}:1: got {got}, expected {','.join(names)}")
    for number, row in enumerate(rows[1:], 2):
        try:
            yield _parse_row(problem, row)
        except (ValueError, LookupError, OverflowError, DmplayError) as error:
            raise BadParameter(f"{path}:{number}: {','.join(row)[:60]}: {error}") from None


def _parse_row(problem: Problem, row: Sequence[str]) -> ParsedRow:
    """Return a row as values; raise ValueError, or another error of a parser."""
    if len(row) != len(column_names(problem)):
        raise ValueError(f"got {len(row)} cells, expected {len(column_names(problem))}")
    game, before, action, reward, after, done = row
    number = float(reward)
    if not np.isfinite(number):
        raise ValueError("expected a finite reward")
    if done not in ("0", "1"):
        raise ValueError(f"done: got {done}, expected 0 or 1")
    percepts = [_parse_percept(problem, text) for text in (before, after)]
    return game, percepts[0], int(problem.parse_action(0, action)), number, percepts[1], done == "1"


def _parse_percept(problem: Problem, text: str) -> Array:
    """Return the state or the observation that `_format_percept` wrote."""
    if not problem.partially_observable:
        return problem.parse_state(text)
    space = problem.observations[0]
    if not text:
        return np.asarray(space.null_observation(1)[0])
    if not isinstance(space, Labels):
        raise BadParameter("its observations are not labels")
    return np.array(space.index(text))


def _compute_beliefs(
    problem: Problem, games: Sequence[str], actions: Ints, before: Sequence[Array],
    after: Sequence[Array],
) -> tuple[Reals, Reals]:  # fmt: skip
    """Return the beliefs `[N, S]` before and after each turn; a new game begins a new belief."""
    follower = make_follower(problem)
    assert follower is not None
    inputs, next_inputs, last_game = [], [], None
    memory = follower.initial_memory(before[0][None])
    for game, action, old, new in zip(games, actions, before, after, strict=True):
        if game != last_game:
            memory = follower.initial_memory(old[None])
        inputs.append(memory[0][0])
        memory = follower.update_memory(memory, Percept(action[None], new[None], None, None))
        next_inputs.append(memory[0][0])
        last_game = game
    return np.array(inputs), np.array(next_inputs)


class RecordedTurns:
    """Turns of a file in place of games: random ones, again and again (section 17.7)."""

    def __init__(
        self, problem: Problem, data: TurnData, rows: int, generator: np.random.Generator
    ) -> None:
        self.problem, self.generator, self._data, self._rows = problem, generator, data, rows
        self.step_count = self.episode_count = 0
        self.legal: Bools | None = None
        self._choose_turns()

    def _choose_turns(self) -> None:
        """Choose the turns that are learned from next."""
        self._chosen = self.generator.integers(len(self._data.actions), size=self._rows)

    @property
    def inputs(self) -> Array:
        """The states or beliefs `[B, ...]` of the chosen turns."""
        return self._data.inputs[self._chosen]

    @property
    def recorded_actions(self) -> Ints:
        """The actions `[B]` of the chosen turns."""
        return self._data.actions[self._chosen]

    def step(self, actions: Ints) -> Transition:
        """Return the results of the chosen turns, whose actions were `recorded_actions`."""
        chosen, data = self._chosen, self._data
        next_legal = None if data.next_legal is None else data.next_legal[chosen]
        self.step_count += self._rows
        self._choose_turns()
        is_over = np.ones(self._rows, bool)  # the next turns do not follow these
        return Transition(
            data.rewards[chosen], data.next_inputs[chosen], next_legal, data.done[chosen], is_over
        )
