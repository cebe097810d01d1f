"""No problem goes without its goldens: a transcript in its own folder, and exact cases."""

import json
from pathlib import Path

import pytest

from dmplay.finding.names import name_to_stem, problem_names
from dmplay.transcript.reading import read_transcript

TESTS = Path(__file__).parent
TRANSCRIPTS = sorted(TESTS.parent.glob("transcripts/*/*.dmt"))
STEMS = [name_to_stem(name) for name in problem_names()]
FAMILIES = {  # of exact cases that are not called as their problem is
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


@pytest.mark.parametrize("stem", STEMS)
def test_a_problem_has_a_transcript(stem: str) -> None:
    assert [path for path in TRANSCRIPTS if path.parent.name == stem]


def test_a_transcript_lies_in_the_folder_of_its_problem() -> None:
    for path in TRANSCRIPTS:
        assert path.parent.name == name_to_stem(
            read_transcript(path).header.problem.partition(":")[0]
        ), path


@pytest.mark.parametrize("stem", STEMS)
def test_a_problem_has_exact_cases_and_a_module_that_checks_them(stem: str) -> None:
    family = FAMILIES.get(stem, stem)
    assert json.loads((TESTS / "truth" / f"{family}.json").read_text())["cases"]
    assert (TESTS / "truth_kinds" / f"{family}.py").exists()
