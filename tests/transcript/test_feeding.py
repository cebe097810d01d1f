"""Turns of a transcript worked out many at once: as strict as turn by turn, and as forgiving."""

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from random import Random
from typing import ClassVar

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array, Bools, Reals
from dmplay.core import Memory, Outcome, Percept, Policy, Problem
from dmplay.dice import SeededUniforms
from dmplay.errors import BadTranscript
from dmplay.policies.general import Random as Anything
from dmplay.policies.kinds import SeatPolicy
from dmplay.problems.hexworld import HexWorld
from dmplay.problems.mountain_car import MountainCar
from dmplay.transcript import feeding
from dmplay.transcript.header import Header
from dmplay.transcript.reading import Transcript, parse_transcript, read_transcript
from dmplay.transcript.recorder import Recorder
from dmplay.transcript.replay import replay
from dmplay.transcript.verify import verify
from tests.fuzz.mutations import summed
from tests.support.games import recorded
from tests.support.turns import Nim

TURNS = 12
# Problem, the first agent, the other, settings.
GAMES: Sequence[tuple[str, str, str, list[str]]] = (
    ("hexworld", "random", "", ["rewards=[]"]),
    ("hexworld", "optimal", "", ["rewards=[]"]),
    ("predator-prey", "random", "random", []),
    ("prisoners-dilemma", "tit-for-tat", "random", []),
    ("2048", "random", "", []),
    ("mountain-car", "random", "", []),
)


class Counting(HexWorld):
    """Hex world that counts how often it moves."""

    moves: ClassVar[Counter[int]] = Counter()

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        self.moves[len(s)] += 1
        return super().resolve_events(s, a, events)


class Single(HexWorld):
    """Hex world that moves in one game at a time."""

    def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
        assert len(s) == 1
        return super().resolve_events(s, a, events)


@dataclass(frozen=True)
class Drifting(MountainCar):
    """A car that moves a little otherwise beside others, or not at all, and counts how often."""

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
class Diary(SeatPolicy):
    """Goes by all that it saw, as the number of the turn, and counts how often it is asked."""

    asked: ClassVar[Counter[int]] = Counter()

    def initial_memory(self, observation: Array) -> Memory:
        return (np.zeros(len(observation), int),)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        return (memory[0] + 1,)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        self.asked[len(u)] += 1
        return memory[0] % self.problem.action_counts[0]


@dataclass(frozen=True)
class Forgetful(Anything):
    """Remembers nothing at all."""

    def begin(self, observation: Array) -> Memory:
        return ()

    def update(self, memory: Memory, percept: Percept) -> Memory:
        return ()


@dataclass(frozen=True)
class Alone(Anything):
    """Is written for one game at a time."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.array([int(6 * u.item())])


@dataclass(frozen=True)
class Scribbling(Anything):
    """Writes into what it is given."""

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        percept.observation[:] = 0
        return (percept.observation,)


@pytest.fixture(scope="module")
def games(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, Problem, list[Policy]]]:
    place = tmp_path_factory.mktemp("games")
    found = []
    for number, (name, agent, others, settings) in enumerate(GAMES):
        path = place / f"{number}.dmt"
        text = recorded(path, name, agent, turns=TURNS, other_agent=others, settings=settings)
        problem = dmplay.load_problem(name, **({"rewards": ()} if settings else {}))
        who = [agent, *["random"] * (len(problem.agents) - 1)]
        seats = [dmplay.load_agent(problem, seat, one) for seat, one in enumerate(who)]
        found.append((text, problem, seats))
    return found


def told(text: str, problem: Problem, policies: list[Policy], *, many: int = 256) -> list[str]:
    """What verifying finds, so many turns at once."""
    try:
        transcript = parse_transcript(text.encode())
    except BadTranscript as error:
        return [str(error)]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(feeding, "MAX_BATCH_TURNS", many)
        report = verify(transcript, problem, policies)
    return [*map(str, report.findings), report.summary]


def spoilt(text: str) -> Iterator[str]:
    """The text with two lines exchanged, one gone, another digit or blank in one; summed anew."""
    random, rows = Random(4), text.split("\n")
    for at in random.sample(range(5, len(rows)), 2):
        like = [row for row in rows if row[:4] == rows[at][:4]]
        digit = rows[at].translate(str.maketrans("012345", "123450"))
        for other in ([random.choice(like)], [], [digit], [f"{rows[at]} "], ["# a note", rows[at]]):
            yield summed("\n".join([*rows[:at], *other, *rows[at + 1 :]]).encode()).decode()


def test_many_turns_at_once_are_held_against_the_file_as_strictly_as_one(
    games: list[tuple[str, Problem, list[Policy]]],
) -> None:
    for text, problem, policies in games:
        right = told(text, problem, policies)
        assert len(right) == 1
        assert right == told(text, problem, policies, many=1)
        for other in spoilt(text):
            one_by_one = told(other, problem, policies, many=1)
            assert told(other, problem, policies) == one_by_one


def test_a_game_whose_states_come_again_is_worked_out_in_few_moves(tmp_path: Path) -> None:
    recorded(tmp_path / "long.dmt", "hexworld", "random", turns=300, settings=["rewards=[]"])
    counting, transcript = Counting(rewards=()), read_transcript(tmp_path / "long.dmt")
    Counting.moves.clear()
    assert verify(transcript, counting, [Anything(counting, 0)]).is_ok
    assert Counting.moves.total() < 60
    Counting.moves.clear()
    assert verify(transcript, counting).is_ok
    assert len(replay(transcript, counting).turns) == 300
    assert Counting.moves.total() < 120
    assert verify(transcript, Single(rewards=())).is_ok


def test_what_a_file_says_of_states_is_not_believed(
    games: list[tuple[str, Problem, list[Policy]]],
) -> None:
    for text, problem, _ in games[:3]:
        rows, random = text.split("\n"), Random(2)
        states = [row for row in rows if row.startswith("state: ")]
        lies = [random.choice(states) if row.startswith("state: ") else row for row in rows]
        found = replay(parse_transcript("\n".join(lies).encode()), problem).turns
        for lie, truth in zip(
            found, replay(parse_transcript(text.encode()), problem).turns, strict=True
        ):
            assert all(map(np.array_equal, lie, truth))


def transcribed(path: Path, problem: Problem, policies: Sequence[Policy], turns: int) -> Transcript:
    """A game of so many turns by these agents, read again."""
    session = dmplay.Session(problem, SeededUniforms(5), policies, turn_limit=turns)
    seats = dict.fromkeys(problem.agents, "somebody")
    recorder = Recorder.create(path, Header(problem="x", seats=seats, seed=5, turns=turns), session)
    while not session.over:
        session.advance()
        recorder.write_turn()
    recorder.write_end()
    return read_transcript(path)


@pytest.mark.parametrize("kind", [Anything, Forgetful, Alone, Diary])
def test_agents_are_asked_again_whatever_they_remember_and_however_many_they_play(
    kind: type[SeatPolicy], tmp_path: Path
) -> None:
    problem = HexWorld(rewards=())
    transcript = transcribed(tmp_path / "game.dmt", problem, [kind(problem, 0)], 40)
    assert verify(transcript, problem, [kind(problem, 0)]).is_ok
    assert not verify(transcript, problem, [dmplay.load_agent(problem, 0, "optimal")]).is_ok


@pytest.mark.parametrize("problem", [HexWorld(rewards=()), MountainCar()])
def test_an_agent_that_counts_its_turns_is_asked_of_many_at_once(
    problem: Problem, tmp_path: Path
) -> None:
    diary = Diary(problem, 0)
    transcript = transcribed(tmp_path / "game.dmt", problem, [diary], 40)
    Diary.asked.clear()
    assert verify(transcript, problem, [diary]).is_ok
    assert Diary.asked.total() <= 10  # of 40 turns


@pytest.mark.parametrize("car", [Drifting(), Drifting(alone=True), Drifting(drift=0.0)])
def test_real_states_that_cannot_be_worked_out_at_once_are_soon_worked_out_one_by_one(
    car: Drifting, tmp_path: Path
) -> None:
    transcript = transcribed(tmp_path / "game.dmt", car, [Diary(car, 0)], 40)
    Drifting.moves.clear()
    assert verify(transcript, car, [Diary(car, 0)]).is_ok
    assert Drifting.moves.total() < 150
    content = transcript.content.replace('"left"', '"lift"').rpartition("lift")
    Drifting.moves.clear()
    with pytest.raises(BadTranscript, match="unknown action 'lift'"):
        replay(
            parse_transcript((content[0].replace("lift", "left") + "".join(content[1:])).encode()),
            car,
        )
    assert Drifting.moves.total() < 150


def test_an_agent_that_writes_into_what_it_is_given_is_named(tmp_path: Path) -> None:
    problem = HexWorld(rewards=())
    transcript = transcribed(tmp_path / "game.dmt", problem, [Anything(problem, 0)], 40)
    found = verify(transcript, problem, [Scribbling(problem, 0)]).findings
    assert "turn 2, agent: Scribbling.update_memory writes into" in found[0].what


def test_a_game_in_turns_and_one_played_beyond_its_end_are_told_as_ever(tmp_path: Path) -> None:
    nim = Nim()
    policies = [Anything(nim, seat) for seat in range(2)]
    transcript = transcribed(tmp_path / "game.dmt", nim, policies, 20)
    assert verify(transcript, nim, policies).is_ok
    *blocks, last, _ = transcript.content.split("\n\n")
    played = len(blocks) - 1  # without the header, but for the last
    more = [last.replace(f"turn: {played}", f"turn: {played + n}") for n in range(1, 7)]
    beyond = parse_transcript("\n\n".join([*blocks, last, *more, ""]).encode())
    with pytest.raises(BadTranscript, match=f"turn {played + 1}: the game is over"):
        replay(beyond, nim)
