"""Two people at one terminal: neither learns what the other may not tell."""

from pathlib import Path

import pytest

from tests.privacy.arguments import ASKING, KEYS_ASKED, questions
from tests.privacy.fronts import alike, both
from tests.privacy.handing_over import sat
from tests.privacy.pairs import LOOKED_AT, TOGETHER, pair

KEYS_KEPT = [key for key in KEYS_ASKED if key != "<backspace>"]  # which takes a choice back


@pytest.mark.parametrize("seat", [pytest.param(0, marks=pytest.mark.slow), 1])
@pytest.mark.parametrize("name", TOGETHER)
def test_nobody_learns_the_choice_or_the_state_of_the_other(
    name: str, seat: int, place: Path
) -> None:
    twins = pair(name, seat)
    alike(*both(twins, place, lambda side: sat(twins, side, KEYS_KEPT)))


@pytest.mark.slow
@pytest.mark.parametrize("name", TOGETHER)
def test_no_question_of_the_second_person_tells_the_first_choice(name: str, place: Path) -> None:
    twins = pair(name, 1)
    asked = [line for line in questions(twins, LOOKED_AT, ASKING) if line != "undo 99"]
    alike(*both(twins, place, lambda side: sat(twins, side, asked)))
