"""Tests of the exact cases: independent numbers that every implementation must reproduce.

`DMPLAY_TRUTH` names another folder with files of the same format. Each family has a module in
`truth_cases` that maps a kind of case to a check, and lists by name the kinds that it skips.
"""

import importlib
from collections import Counter
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.truth_cases import prisoners
from tests.truth_cases.case import TRUTH_FOLDER, Case, load_family

CHECKED_FAMILIES = {path.stem for path in Path(__file__).parent.glob("truth_cases/*.py")}
FAMILIES = sorted(path.stem for path in TRUTH_FOLDER.glob("*.json"))


def load_family_module(name: str) -> ModuleType:
    return importlib.import_module(f"tests.truth_cases.{name}")


def list_family_kinds() -> list[Any]:
    """Return a pytest parameter for each family and kind of case."""
    return [
        pytest.param(name, kind, id=f"{name}/{kind}")
        for name in FAMILIES
        if name in CHECKED_FAMILIES
        for kind in dict.fromkeys(case["kind"] for case in load_family(name)["cases"])
        if kind not in load_family_module(name).LATER
    ]


@pytest.mark.parametrize(("name", "kind"), list_family_kinds())
def test_the_exact_cases_pass(name: str, kind: str) -> None:
    checks = load_family_module(name).KINDS
    assert kind in checks, f"{name}: no check knows the kind {kind!r}"
    for case in load_family(name)["cases"]:
        if case["kind"] == kind:
            try:
                checks[kind](Case(case, load_family(name)["conventions"]))
            except Exception as error:
                error.add_note(f"in the case {case['id']}")
                raise


def test_every_family_and_kind_is_checked_or_skipped_by_name(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = []
    for name in FAMILIES:
        if name not in CHECKED_FAMILIES:
            rows.append(f"{name}: left, its problem is not here yet")
            continue
        for kind, count in Counter(case["kind"] for case in load_family(name)["cases"]).items():
            left = kind in load_family_module(name).LATER
            assert left or kind in load_family_module(name).KINDS, f"{name}: unknown kind {kind!r}"
            rows.append(f"{name}: {kind}: {count} {'left for a solver' if left else 'checked'}")
    with capsys.disabled():
        print("\ntruth cases:", *rows, sep="\n  ")
    assert FAMILIES, f"no truth files in {TRUTH_FOLDER}"


@pytest.mark.parametrize("discount", [0.5, 0.9, 0.99])
def test_the_rounds_left_out_of_a_repeated_dilemma_are_within_the_tolerance(
    discount: float,
) -> None:
    # No payoff is larger than 4: the sucker loses 4, and the traitor loses nothing.
    rounds = prisoners.count_rounds(discount, tolerance=1e-9)
    largest_rest = 4 * sum(discount**n for n in range(rounds, rounds + 10_000))
    assert 0 < largest_rest < 1e-9
