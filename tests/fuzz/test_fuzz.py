"""Tests of the fuzzer itself: it finds a planted fault of each class and can repeat a case."""

import os
import signal
from collections.abc import Iterator
from random import Random

import pytest

from dmplay.transcript.format import compute_checksum
from tests.fuzz import changed_facts, corpus, mutations, user_problems
from tests.fuzz.case import GAME_FILE, Case, CaseOutcome
from tests.fuzz.case_kinds import KINDS, Kind, count_cases, draw_case
from tests.fuzz.case_runner import run_case
from tests.fuzz.mutations import MUTATIONS, Mutation
from tests.fuzz.program import MAX_AGENT_TURNS, run_dmplay
from tests.fuzz.verdicts import find_faults
from tests.fuzz.worker_pool import Task, run_tasks
from tests.support.problem_cases import CASE_NAMES

KINDS_BY_NAME = {kind.name: kind for kind in KINDS}


@pytest.fixture(autouse=True, scope="module")
def few_transcripts() -> Iterator[None]:
    """Limit the transcripts to those of a few problems, which are enough for these tests."""
    with pytest.MonkeyPatch.context() as monkeypatch:
        monkeypatch.setattr(corpus, "CASE_NAMES", CASE_NAMES[::5])
        monkeypatch.setattr(corpus, "SHORT", 900)
        yield
    for cached_function in (
        corpus.list_transcripts,
        corpus.list_human_transcripts,
        changed_facts.list_valid_transcripts,
    ):
        cached_function.cache_clear()


def first_transcript() -> bytes:
    """Return a valid transcript."""
    return corpus.list_transcripts()[0]


def make_kind(outcome: CaseOutcome | None = None, *, changed: str = "") -> Kind:
    """Make a kind whose cases all have this outcome."""
    fixed_outcome = outcome or CaseOutcome("exit 0")
    return Kind("planted", 1, lambda random: Case(changed=changed), lambda drawn: fixed_outcome)


def find_fault_kinds(kind: Kind) -> list[str]:
    """Return the kinds of the faults in the first case of a kind."""
    return [fault.kind for fault in run_case(kind, 1, 0, seconds=0.05).faults]


def _run_forever(fuzz_case: Case) -> CaseOutcome:
    while True:
        pass


def _allocate_too_much(fuzz_case: Case) -> CaseOutcome:
    try:
        bytearray(2**30)
    except MemoryError:
        return CaseOutcome("MemoryError", trace="MemoryError")
    return CaseOutcome("exit 0")


def test_a_correct_outcome_has_no_faults() -> None:
    assert find_fault_kinds(make_kind()) == []


@pytest.mark.parametrize(
    ("kind", "expected"),
    [
        (make_kind(CaseOutcome("ValueError", trace="Traceback ...")), ["traceback"]),
        (
            make_kind(
                CaseOutcome("exit 1", "error: unexpected ValueError; the traceback is in x.log")
            ),
            ["traceback"],
        ),
        (make_kind(CaseOutcome("exit 77")), ["traceback"]),
        (make_kind(CaseOutcome("exit 0", "fine\x1b[2J")), ["escape"]),
        (make_kind(CaseOutcome("exit 0", "fine\u202e")), ["escape"]),
        (make_kind(CaseOutcome("exit 0", files={"out.svg": b"\x9b"})), ["escape"]),
        (make_kind(changed="a reward"), ["verified"]),
        (make_kind()._replace(program=_run_forever), ["slow"]),
        (make_kind()._replace(program=_allocate_too_much), ["traceback"]),
    ],
)
def test_a_fault_of_each_class_is_found(kind: Kind, expected: list[str]) -> None:
    assert find_fault_kinds(kind) == expected


def test_lines_that_were_in_a_file_before_are_not_judged() -> None:
    row = b"# \x1b[2J\n"
    fuzz_case = Case(files={GAME_FILE: row})
    assert not list(
        find_faults(fuzz_case, CaseOutcome("exit 0", files={GAME_FILE: row + b"turn: 1\n"}))
    )


def test_a_verifier_that_accepts_everything_is_detected() -> None:
    blind = KINDS_BY_NAME["fact"]._replace(program=lambda drawn: CaseOutcome("exit 0"))
    fault_lists = [run_case(blind, 1, number).faults for number in range(6)]
    assert sum(map(bool, fault_lists)) > 3


@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_case_is_reproducible(kind: Kind) -> None:
    assert draw_case(kind, 1, 7) == draw_case(kind, 1, 7)
    assert any(draw_case(kind, 1, 7) != draw_case(kind, other, 7) for other in (2, 3, 4))


def test_results_do_not_depend_on_the_number_of_workers() -> None:
    tasks = [Task(kind, 1, range(5, 6)) for kind in KINDS[::3]]
    assert sorted(run_tasks(tasks, 1)) == sorted(run_tasks(tasks, 2))


def test_the_shares_of_all_kinds_add_up_to_100() -> None:
    assert sum(kind.share for kind in KINDS) == 100
    assert sum(count_cases(kind, 20_000) for kind in KINDS) == 20_000


@pytest.mark.parametrize(
    "mutation", dict.fromkeys(MUTATIONS), ids=lambda mutation: mutation.__name__
)
def test_a_mutation_usually_changes_the_transcript(mutation: Mutation) -> None:
    changed = [mutation(Random(number), first_transcript()) for number in range(40)]
    assert sum(raw != first_transcript() for raw in changed) > 20
    assert len({*changed}) > 15


def test_a_replaced_value_is_the_drawn_one() -> None:
    replaced = {mutations.replace_value(Random(number), {"turn": 1}) for number in range(400)}
    assert {'{"turn": 2}', '{"turn": NaN}', '{"turn": null}'} <= replaced
    assert not any(mutations.VALUE_MARK in text for text in replaced)


def test_changed_lines_of_json_are_often_still_accepted() -> None:
    for name in ("cup", "bot"):
        endings = [run_case(KINDS_BY_NAME[name], 1, number).ending for number in range(20)]
        assert 2 < endings.count("exit 0") < 20
        assert "exit 2" in endings


def test_a_very_large_integer_has_similar_values() -> None:
    assert {mutations.draw_similar_value(Random(number), 10**400) for number in range(9)} == {
        str(10**400 + 1),
        str(10**400 - 1),
    }


def test_an_updated_checksum_is_that_of_the_text() -> None:
    other = mutations.update_checksum(first_transcript().replace(b"turn: 1\n", b"turn: 7\n"))
    above = other.decode().partition("end: ")[0]
    assert compute_checksum(above) in other.decode()
    assert mutations.update_checksum(first_transcript()) == first_transcript()


def test_a_mutated_transcript_can_often_still_be_parsed() -> None:
    read = KINDS_BY_NAME["read"]
    endings = [run_case(read, 1, number).ending for number in range(60)]
    assert 10 < endings.count("read") < 50


@pytest.mark.parametrize(
    ("first", "second", "expected"),
    [
        (1, 1.0, True), (1.0, 1.0000001, True), (1.0, 1.00001, False), (1, True, False),
        ("a", "a", True), ("a", "A", False), ([1], [1, 1], False), ({"a": 1}, {"b": 1}, False),
        (None, 0, False),
    ],
)  # fmt: skip
def test_facts_are_the_same_within_the_tolerance(
    first: object, second: object, expected: bool
) -> None:
    assert changed_facts.is_same_fact(first, second) is expected


@pytest.mark.extra("openspiel")
def test_trees_are_drawn_that_are_played_and_that_are_too_deep() -> None:
    tree = KINDS_BY_NAME["tree"]
    results = [run_case(tree, 1, number) for number in range(20)]
    assert {"exit 0", "exit 2"} <= {result.ending for result in results}
    assert not any(result.faults for result in results)


def test_a_problem_without_faulty_parts_runs() -> None:
    for form in (user_problems.TABULAR_TEMPLATE, user_problems.METHODS_TEMPLATE):
        source = form.format(**user_problems.VALID_PARTS).encode()
        assert (
            run_dmplay(Case(user_problems.COMMANDS[0], {user_problems.PROBLEM_FILE: source})).ending
            == "exit 0"
        )


def test_an_endless_game_of_agents_ends_at_the_turn_limit_of_the_fuzzer() -> None:
    idle = ("mountain-car", "--agent", "always-coast", "--quiet", "-o", GAME_FILE)
    outcome = run_dmplay(Case(idle))
    assert f'"turns": {MAX_AGENT_TURNS}, ' in outcome.files[GAME_FILE].decode()


def _die_or_hang(fuzz_case: Case) -> CaseOutcome:
    if fuzz_case.typed == "die":
        os.kill(os.getpid(), signal.SIGKILL)
    if fuzz_case.typed == "hang":
        signal.pause()
    return CaseOutcome("exit 0")


@pytest.mark.parametrize(
    ("behavior", "ending"), [("die", "died"), ("hang", "died"), ("", "exit 0")]
)
def test_a_dead_or_hanging_worker_is_reported_and_other_cases_finish(
    behavior: str, ending: str
) -> None:
    kind = Kind(
        "ends", 1, lambda random: Case(typed=random.choice((behavior, "", ""))), _die_or_hang
    )
    lost = [
        number for number in range(6) if behavior and draw_case(kind, 1, number).typed == behavior
    ]
    all_results = sorted(run_tasks([Task(kind, 1, range(6))], 2, patience=0.1))
    assert [result.number for result in all_results] == [*range(6)]
    assert [result.number for result in all_results if result.faults] == lost
    assert {result.ending for result in all_results if result.faults or not behavior} <= {ending}
