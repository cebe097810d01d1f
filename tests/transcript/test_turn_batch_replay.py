"""Tests of batch replay: verifying turns in batches gives the same result as one at a time."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import SeatPolicy
from dmplay.agents.random_agent import Random as Anything
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory, Percept, Policy
from dmplay.core.problem import Outcome, Problem
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadTranscript
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.problems.mountain_car.rules import MountainCar
from dmplay.transcript import turn_batch_replay
from dmplay.transcript.header import Header
from dmplay.transcript.reader import Transcript, parse_transcript, read_transcript
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.replay import replay
from dmplay.transcript.verify import verify_transcript
from tests.fuzz.mutations import update_checksum
from tests.support.games import record_game
from tests.support.turn_based_games import Nim

TURN_COUNT = 12
# problem, agent of the first seat, agent of the other seats, settings
GAME_SPECS: Sequence[tuple[str, str, str, list[str]]] = (
    ("hexworld", "random", "", ["rewards=[]"]),
    ("hexworld", "optimal", "", ["rewards=[]"]),
    ("predator-prey", "random", "random", []),
    ("prisoners-dilemma", "tit-for-tat", "random", []),
    ("2048", "random", "", []),
    ("mountain-car", "random", "", []),
)


class MoveCountingHexWorld(HexWorld):
    """A hex world that counts its moves by batch size."""

    moves: ClassVar[Counter[int]] = Counter()

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        self.moves[len(s)] += 1
        return super().resolve_events(s, a, events)


class UnbatchedHexWorld(HexWorld):
    """A hex world that accepts only batches of one game."""

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        assert len(s) == 1
        return super().resolve_events(s, a, events)


@dataclass(frozen=True)
class DriftingCar(MountainCar):
    """A car that drifts in batches or rejects them, and counts its moves by batch size."""

    alone: bool = False
    drift: float = 1e-15
    moves: ClassVar[Counter[int]] = Counter()

    def initial_states(self, rows: int, events: tuple[Array, ...]) -> Array:
        return np.tile([-0.5, 0.0], (rows, 1))

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        self.moves[len(s)] += 1
        assert len(s) == 1 or not self.alone
        state, rewards, _ = super().resolve_events(s, a, events)
        state = state + self.drift * (len(s) > 1)
        return Outcome(state, rewards, state)


@dataclass(frozen=True)
class TurnIndexPolicy(SeatPolicy):
    """A policy that chooses by the number of the turn and counts its calls by batch size."""

    query_counts: ClassVar[Counter[int]] = Counter()

    def initial_memory(self, observation: Array) -> Memory:
        return (np.zeros(len(observation), int),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        return (memory[0] + 1,)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        self.query_counts[len(u)] += 1
        return memory[0] % self.problem.action_counts[0]


@dataclass(frozen=True)
class MemorylessPolicy(Anything):
    """A random policy without memory."""

    def begin(self, observation: Array) -> Memory:
        return ()

    def update(self, memory: Memory, percept: Percept) -> Memory:
        return ()


@dataclass(frozen=True)
class UnbatchedPolicy(Anything):
    """A random policy that supports only batches of one game."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.array([int(6 * u.item())])


@dataclass(frozen=True)
class Scribbling(Anything):
    """A random policy that modifies the observations that it receives."""

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        percept.observation[:] = 0
        return (percept.observation,)


@pytest.fixture(scope="module")
def recorded_games(
    tmp_path_factory: pytest.TempPathFactory,
) -> list[tuple[str, Problem, list[Policy]]]:
    folder = tmp_path_factory.mktemp("games")
    result = []
    for number, (name, agent, others, settings) in enumerate(GAME_SPECS):
        path = folder / f"{number}.dmt"
        text = record_game(
            path, name, agent, turns=TURN_COUNT, other_agent=others, settings=settings
        )
        problem = dmplay.load_problem(name, **({"rewards": ()} if settings else {}))
        agents = [agent, *["random"] * (len(problem.agents) - 1)]
        policies = [
            dmplay.load_agent(problem, seat, agent_name) for seat, agent_name in enumerate(agents)
        ]
        result.append((text, problem, policies))
    return result


def verify_text(
    text: str, problem: Problem, policies: list[Policy], *, max_batch_turns: int = 256
) -> list[str]:
    """Verify a text in batches of at most this many turns; return its findings and summary."""
    try:
        transcript = parse_transcript(text.encode())
    except BadTranscript as error:
        return [str(error)]
    with pytest.MonkeyPatch.context() as context:
        context.setattr(turn_batch_replay, "MAX_BATCH_TURNS", max_batch_turns)
        report = verify_transcript(transcript, problem, policies)
    return [*map(str, report.findings), report.summary]


def iter_damaged_texts(text: str) -> Iterator[str]:
    """Yield damaged copies of the text, each with one change to its lines and a valid checksum."""
    random, rows = Random(4), text.split("\n")
    for index in random.sample(range(5, len(rows)), 2):
        similar_rows = [row for row in rows if row[:4] == rows[index][:4]]
        changed_row = rows[index].translate(str.maketrans("012345", "123450"))
        for replacement in (
            [random.choice(similar_rows)],
            [],
            [changed_row],
            [f"{rows[index]} "],
            ["# a note", rows[index]],
        ):
            yield update_checksum(
                "\n".join([*rows[:index], *replacement, *rows[index + 1 :]]).encode()
            ).decode()


def test_batches_are_verified_as_strictly_as_single_turns(
    recorded_games: list[tuple[str, Problem, list[Policy]]],
) -> None:
    for text, problem, policies in recorded_games:
        expected = verify_text(text, problem, policies)
        assert len(expected) == 1
        assert expected == verify_text(text, problem, policies, max_batch_turns=1)
        for damaged in iter_damaged_texts(text):
            one_by_one = verify_text(damaged, problem, policies, max_batch_turns=1)
            assert verify_text(damaged, problem, policies) == one_by_one


def test_a_game_with_repeated_states_is_replayed_in_few_moves(tmp_path: Path) -> None:
    record_game(tmp_path / "long.dmt", "hexworld", "random", turns=300, settings=["rewards=[]"])
    problem, transcript = MoveCountingHexWorld(rewards=()), read_transcript(tmp_path / "long.dmt")
    MoveCountingHexWorld.moves.clear()
    assert verify_transcript(transcript, problem, [Anything(problem, 0)]).is_ok
    assert MoveCountingHexWorld.moves.total() < 60
    assert MoveCountingHexWorld.moves[256] == 1  # A new state ends no batch.
    MoveCountingHexWorld.moves.clear()
    assert verify_transcript(transcript, problem).is_ok
    assert len(replay(transcript, problem).turns) == 300
    assert MoveCountingHexWorld.moves.total() < 120
    assert verify_transcript(transcript, UnbatchedHexWorld(rewards=())).is_ok


def test_a_game_with_more_actions_than_are_cached_verifies(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "g.dmt"
    record_game(path, "travelers-dilemma", "random", other_agent="random", turns=50)
    monkeypatch.setattr(turn_batch_replay, "MAX_CACHED_LINES", 3)
    problem = dmplay.load_problem("travelers-dilemma")
    assert verify_transcript(read_transcript(path), problem).is_ok


def test_replay_does_not_trust_the_states_in_the_file(
    recorded_games: list[tuple[str, Problem, list[Policy]]],
) -> None:
    for text, problem, _ in recorded_games[:3]:
        rows, random = text.split("\n"), Random(2)
        states = [row for row in rows if row.startswith("state: ")]
        false_rows = [random.choice(states) if row.startswith("state: ") else row for row in rows]
        turns = replay(parse_transcript("\n".join(false_rows).encode()), problem).turns
        for turn, expected in zip(
            turns, replay(parse_transcript(text.encode()), problem).turns, strict=True
        ):
            assert all(map(np.array_equal, turn[:5], expected[:5]))


def record_transcript(
    path: Path, problem: Problem, policies: Sequence[Policy], turns: int
) -> Transcript:
    """Record a game of at most this many turns by these policies; return its transcript."""
    session = dmplay.Session(problem, SeededUniforms(5), policies, turn_limit=turns)
    seats = dict.fromkeys(problem.agents, "somebody")
    recorder = Recorder.create(path, Header(problem="x", seats=seats, seed=5, turns=turns), session)
    while not session.over:
        session.advance()
        recorder.write_turn()
    recorder.write_end()
    return read_transcript(path)


@pytest.mark.parametrize(
    "policy_class", [Anything, MemorylessPolicy, UnbatchedPolicy, TurnIndexPolicy]
)
def test_policies_are_checked_whatever_their_memory_and_batch_size(
    policy_class: type[SeatPolicy], tmp_path: Path
) -> None:
    problem = HexWorld(rewards=())
    transcript = record_transcript(tmp_path / "game.dmt", problem, [policy_class(problem, 0)], 40)
    assert verify_transcript(transcript, problem, [policy_class(problem, 0)]).is_ok
    assert not verify_transcript(
        transcript, problem, [dmplay.load_agent(problem, 0, "optimal")]
    ).is_ok


@pytest.mark.parametrize("problem", [HexWorld(rewards=()), MountainCar()])
def test_a_policy_that_counts_turns_is_called_in_batches(problem: Problem, tmp_path: Path) -> None:
    policy = TurnIndexPolicy(problem, 0)
    transcript = record_transcript(tmp_path / "game.dmt", problem, [policy], 40)
    TurnIndexPolicy.query_counts.clear()
    assert verify_transcript(transcript, problem, [policy]).is_ok
    assert TurnIndexPolicy.query_counts.total() <= 10  # calls for 40 turns


@pytest.mark.parametrize("car", [DriftingCar(), DriftingCar(alone=True), DriftingCar(drift=0.0)])
def test_real_states_that_differ_in_batches_are_replayed_one_by_one(
    car: DriftingCar, tmp_path: Path
) -> None:
    transcript = record_transcript(tmp_path / "game.dmt", car, [TurnIndexPolicy(car, 0)], 40)
    DriftingCar.moves.clear()
    assert verify_transcript(transcript, car, [TurnIndexPolicy(car, 0)]).is_ok
    assert DriftingCar.moves.total() < 150
    parts = transcript.content.replace('"left"', '"lift"').rpartition("lift")
    DriftingCar.moves.clear()
    with pytest.raises(BadTranscript, match="unknown action 'lift'"):
        replay(
            parse_transcript((parts[0].replace("lift", "left") + "".join(parts[1:])).encode()), car
        )
    assert DriftingCar.moves.total() < 150


def test_a_policy_that_modifies_its_observations_is_reported(tmp_path: Path) -> None:
    problem = HexWorld(rewards=())
    transcript = record_transcript(tmp_path / "game.dmt", problem, [Anything(problem, 0)], 40)
    findings = verify_transcript(transcript, problem, [Scribbling(problem, 0)]).findings
    assert "turn 2, agent: Scribbling.update_memory modifies an array" in findings[0].what


def test_sequential_games_and_turns_after_the_end_are_checked(tmp_path: Path) -> None:
    nim = Nim()
    policies = [Anything(nim, seat) for seat in range(2)]
    transcript = record_transcript(tmp_path / "game.dmt", nim, policies, 20)
    assert verify_transcript(transcript, nim, policies).is_ok
    *blocks, last, _ = transcript.content.split("\n\n")
    last_turn = len(blocks) - 1  # the blocks are the header and the turns before the last
    extra_blocks = [
        last.replace(f"turn: {last_turn}", f"turn: {last_turn + n}") for n in range(1, 7)
    ]
    overlong_transcript = parse_transcript("\n\n".join([*blocks, last, *extra_blocks, ""]).encode())
    with pytest.raises(BadTranscript, match=f"turn {last_turn + 1}: the game is over"):
        replay(overlong_transcript, nim)
