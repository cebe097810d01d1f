"""The fuzzer itself: it finds a planted fault of each class, and shows a case again."""

import os
import signal
from collections.abc import Iterator
from random import Random

import pytest

from dmplay.transcript.format import compute_checksum
from tests.fuzz import brought, corpus, facts, mutations
from tests.fuzz.case import GAME, Case, Told
from tests.fuzz.crew import Task, results
from tests.fuzz.judging import faults
from tests.fuzz.kinds import KINDS, Kind, case, count
from tests.fuzz.mutations import MUTATIONS, Mutation
from tests.fuzz.program import TURNS, dmplay
from tests.fuzz.trial import tried
from tests.support.cases import CASES

BY_NAME = {kind.name: kind for kind in KINDS}


@pytest.fixture(autouse=True, scope="module")
def few() -> Iterator[None]:
    """Transcripts of a few problems to begin with: what is tried here is true of however many."""
    with pytest.MonkeyPatch.context() as here:
        here.setattr(corpus, "CASES", CASES[::5])
        here.setattr(corpus, "SHORT", 900)
        yield
    for known in (corpus.transcripts, corpus.of_people, facts.honest):
        known.cache_clear()


def good() -> bytes:
    """A transcript in which all is right."""
    return corpus.transcripts()[0]


def planted(told: Told | None = None, *, changed: str = "") -> Kind:
    """A kind of cases of which each comes out so."""
    found = told or Told("exit 0")
    return Kind("planted", 1, lambda random: Case(changed=changed), lambda drawn: found)


def classes(kind: Kind) -> list[str]:
    """The faults that are found in its first case."""
    return [fault.kind for fault in tried(kind, 1, 0, seconds=0.05).faults]


def _spins(drawn: Case) -> Told:
    while True:
        pass


def _hoards(drawn: Case) -> Told:
    try:
        bytearray(2**30)
    except MemoryError:
        return Told("MemoryError", trace="MemoryError")
    return Told("exit 0")


def test_nothing_is_wrong_with_what_is_right() -> None:
    assert classes(planted()) == []


@pytest.mark.parametrize(
    ("kind", "found"),
    [
        (planted(Told("ValueError", trace="Traceback ...")), ["traceback"]),
        (planted(Told("exit 1", "error: unexpected ValueError; x.log tells where")), ["traceback"]),
        (planted(Told("exit 77")), ["traceback"]),
        (planted(Told("exit 0", "fine\x1b[2J")), ["escape"]),
        (planted(Told("exit 0", "fine\u202e")), ["escape"]),
        (planted(Told("exit 0", files={"out.svg": b"\x9b"})), ["escape"]),
        (planted(changed="a reward"), ["verified"]),
        (planted()._replace(program=_spins), ["slow"]),
        (planted()._replace(program=_hoards), ["traceback"]),
    ],
)
def test_a_fault_of_each_class_is_found(kind: Kind, found: list[str]) -> None:
    assert classes(kind) == found


def test_what_a_file_held_before_is_not_said_to_be_written() -> None:
    row = b"# \x1b[2J\n"
    drawn = Case(files={GAME: row})
    assert not list(faults(drawn, Told("exit 0", files={GAME: row + b"turn: 1\n"})))


def test_a_verifier_that_always_says_ok_is_found_out() -> None:
    blind = BY_NAME["fact"]._replace(program=lambda drawn: Told("exit 0"))
    found = [tried(blind, 1, number).faults for number in range(6)]
    assert sum(map(bool, found)) > 3


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_case_is_the_same_each_time(kind: Kind) -> None:
    assert case(kind, 1, 7) == case(kind, 1, 7)
    assert any(case(kind, 1, 7) != case(kind, other, 7) for other in (2, 3, 4))


def test_a_case_ends_the_same_however_many_workers_there_are() -> None:
    tasks = [Task(kind, 1, range(5, 6)) for kind in KINDS[::3]]
    assert sorted(results(tasks, 1)) == sorted(results(tasks, 2))


def test_the_shares_are_those_of_a_hundred() -> None:
    assert sum(kind.share for kind in KINDS) == 100
    assert sum(count(kind, 20_000) for kind in KINDS) == 20_000


@pytest.mark.parametrize("mutation", dict.fromkeys(MUTATIONS), ids=lambda one: one.__name__)
def test_a_mutation_changes_what_it_is_given(mutation: Mutation) -> None:
    changed = [mutation(Random(number), good()) for number in range(40)]
    assert sum(raw != good() for raw in changed) > 20
    assert len({*changed}) > 15


def test_a_value_of_many_digits_has_others_near() -> None:
    assert {mutations.near(Random(number), 10**400) for number in range(9)} == {
        str(10**400 + 1),
        str(10**400 - 1),
    }


def test_a_checksum_is_that_of_what_stands_there() -> None:
    other = mutations.summed(good().replace(b"turn: 1\n", b"turn: 7\n"))
    above = other.decode().partition("end: ")[0]
    assert compute_checksum(above) in other.decode()
    assert mutations.summed(good()) == good()


def test_what_is_spoilt_is_often_still_read() -> None:
    read = BY_NAME["read"]
    endings = [tried(read, 1, number).ending for number in range(60)]
    assert 10 < endings.count("read") < 50


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        (1, 1.0, True), (1.0, 1.0000001, True), (1.0, 1.00001, False), (1, True, False),
        ("a", "a", True), ("a", "A", False), ([1], [1, 1], False), ({"a": 1}, {"b": 1}, False),
        (None, 0, False),
    ],
)  # fmt: skip
def test_facts_are_the_same_within_the_tolerance(one: object, other: object, same: bool) -> None:
    assert facts.same(one, other) is same


def test_a_problem_that_is_not_made_wrong_is_right() -> None:
    for form in (brought.TABLES, brought.METHODS):
        source = form.format(**brought.RIGHT).encode()
        assert dmplay(Case(brought.COMMANDS[0], {brought.FILE: source})).ending == "exit 0"


def test_a_game_among_agents_that_nothing_ends_ends_sooner_than_elsewhere() -> None:
    idle = ("mountain-car", "--agent", "always-coast", "--quiet", "-o", GAME)
    told = dmplay(Case(idle))
    assert f'"turns": {TURNS}, ' in told.files[GAME].decode()


def _ends(drawn: Case) -> Told:
    if drawn.typed == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if drawn.typed == "hang":
        signal.pause()
    return Told("exit 0")


@pytest.mark.parametrize(("how", "ending"), [("die", "died"), ("hang", "died"), ("", "exit 0")])
def test_a_worker_that_dies_or_hangs_is_told_and_all_else_is_done(how: str, ending: str) -> None:
    kind = Kind("ends", 1, lambda random: Case(typed=random.choice((how, "", ""))), _ends)
    lost = [number for number in range(6) if how and case(kind, 1, number).typed == how]
    found = sorted(results([Task(kind, 1, range(6))], 2, patience=0.1))
    assert [result.number for result in found] == [*range(6)]
    assert [result.number for result in found if result.faults] == lost
    assert {result.ending for result in found if result.faults or not how} <= {ending}
