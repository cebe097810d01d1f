"""Two people at one terminal: neither learns what the other must not reveal."""

from pathlib import Path

import pytest

from tests.privacy.command_arguments import QUERY_ARGUMENTS, QUERY_KEYS, list_queries
from tests.privacy.front_ends import assert_indistinguishable, play_both
from tests.privacy.handover import play_handover
from tests.privacy.indistinguishable_pairs import MULTI_AGENT_PARAMS, SHARED_TURNS, find_pair

QUERY_KEYS_WITHOUT_UNDO = [key for key in QUERY_KEYS if key != "<backspace>"]


@pytest.mark.parametrize("seat", [pytest.param(0, marks=pytest.mark.slow), 1])
@pytest.mark.parametrize("name", MULTI_AGENT_PARAMS)
def test_neither_person_learns_the_choice_or_hidden_state_of_the_other(
    name: str, seat: int, game_folder: Path
) -> None:
    twins = find_pair(name, seat)
    assert_indistinguishable(
        *play_both(
            twins, game_folder, lambda side: play_handover(twins, side, QUERY_KEYS_WITHOUT_UNDO)
        )
    )


@pytest.mark.slow
@pytest.mark.parametrize("name", MULTI_AGENT_PARAMS)
def test_no_query_of_the_second_person_reveals_the_first_choice(
    name: str, game_folder: Path
) -> None:
    twins = find_pair(name, 1)
    queries = [
        line for line in list_queries(twins, SHARED_TURNS, QUERY_ARGUMENTS) if line != "undo 99"
    ]
    assert_indistinguishable(
        *play_both(twins, game_folder, lambda side: play_handover(twins, side, queries))
    )
