"""The exact cases: numbers made independently, which every implementation must reproduce.

`DMPLAY_TRUTH` names another folder of the same kind of files. Each family has a module in
`truth_kinds` that maps a kind of case to a check, and lists by name the kinds that it leaves.
"""

import importlib
from collections import Counter
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.truth_kinds.case import FOLDER, Case, family

CHECKED = {path.stem for path in Path(__file__).parent.glob("truth_kinds/*.py")}
FAMILIES = sorted(path.stem for path in FOLDER.glob("*.json"))


def kinds(name: str) -> ModuleType:
    return importlib.import_module(f"tests.truth_kinds.{name}")


def asked() -> list[Any]:
    """Each family with each kind of case in it."""
    return [
        pytest.param(name, kind, id=f"{name}/{kind}")
        for name in FAMILIES
        if name in CHECKED
        for kind in dict.fromkeys(case["kind"] for case in family(name)["cases"])
        if kind not in kinds(name).LATER
    ]


@pytest.mark.parametrize(("name", "kind"), asked())
def test_the_cases_hold(name: str, kind: str) -> None:
    known = kinds(name).KINDS
    assert kind in known, f"{name}: no check knows the kind {kind!r}"
    for case in family(name)["cases"]:
        if case["kind"] == kind:
            try:
                known[kind](Case(case, family(name)["conventions"]))
            except Exception as error:
                error.add_note(f"in the case {case['id']}")
                raise


def test_every_family_and_kind_is_checked_or_left_by_name(
    capsys: pytest.CaptureFixture[str],
) -> None:
    rows = []
    for name in FAMILIES:
        if name not in CHECKED:
            rows.append(f"{name}: left, its problem is not here yet")
            continue
        for kind, count in Counter(case["kind"] for case in family(name)["cases"]).items():
            left = kind in kinds(name).LATER
            assert left or kind in kinds(name).KINDS, f"{name}: unknown kind {kind!r}"
            rows.append(f"{name}: {kind}: {count} {'left for a solver' if left else 'checked'}")
    with capsys.disabled():
        print("\ntruth cases:", *rows, sep="\n  ")
    assert FAMILIES, f"no truth files in {FOLDER}"
