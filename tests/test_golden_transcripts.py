"""Tests that every problem has golden transcripts and exact cases."""

import json
from pathlib import Path

import pytest

from dmplay.registry.builtin_names import name_to_stem, problem_names
from dmplay.transcript.reader import read_transcript

TESTS_FOLDER = Path(__file__).parent
TRANSCRIPT_PATHS = sorted(TESTS_FOLDER.parent.glob("transcripts/*/*.dmt"))
PROBLEM_STEMS = [name_to_stem(name) for name in problem_names()]
CASE_FAMILIES = {  # families of exact cases that have another name than their problem
    "cart_pole": "cartpole",
    "collaborative_predator_prey": "collab",
    "collision_avoidance": "collision",
    "crying_baby": "cryingbaby",
    "game_2048": "twenty48",
    "machine_replacement": "machine",
    "mountain_car": "mountaincar",
    "multicaregiver_crying_baby": "caregivers",
    "predator_prey": "predatorprey",
    "prisoners_dilemma": "prisoners",
    "rock_paper_scissors": "rps",
    "simple_regulator": "regulator",
    "travelers_dilemma": "travelers",
}


@pytest.mark.parametrize("stem", PROBLEM_STEMS)
def test_a_problem_has_a_transcript(stem: str) -> None:
    assert [path for path in TRANSCRIPT_PATHS if path.parent.name == stem], (
        f"no transcript in transcripts/{stem}/; `dmplay guide architecture` says how to record one"
    )


def test_a_transcript_is_in_the_folder_of_its_problem() -> None:
    for path in TRANSCRIPT_PATHS:
        assert path.parent.name == name_to_stem(
            read_transcript(path).header.problem.partition(":")[0]
        ), path


@pytest.mark.parametrize("stem", PROBLEM_STEMS)
def test_a_problem_has_exact_cases_and_a_module_that_checks_them(stem: str) -> None:
    family = CASE_FAMILIES.get(stem, stem)
    case_path = TESTS_FOLDER / "truth" / f"{family}.json"
    advice = f"no exact cases in tests/truth/{family}.json; tests/truth/README.md describes them"
    assert case_path.exists(), advice
    assert json.loads(case_path.read_text())["cases"], advice
    assert (TESTS_FOLDER / "truth_cases" / f"{family}.py").exists(), (
        f"no module tests/truth_cases/{family}.py that checks the exact cases; "
        "tests/truth/README.md describes it"
    )
