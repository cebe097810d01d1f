"""A player of Kuhn poker cannot tell apart games in which the opponent holds another card."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array
from dmplay.external.history_problem import ExternalProblem
from dmplay.session import Session
from tests.privacy.command_arguments import FOLLOW_UP_COMMANDS, QUERY_ARGUMENTS, list_queries
from tests.privacy.front_ends import (
    FRONT_ENDS,
    TRANSCRIPT_PATH,
    assert_indistinguishable,
    play_both,
)
from tests.privacy.indistinguishable_pairs import Pair, Side

KUHN_POKER = "openspiel:kuhn_poker"
PASS, BET, WAIT = range(3)
SEEDS = range(100)
SLOW_FRONT_ENDS = {
    front_end: pytest.param(front_end, marks=pytest.mark.slow)
    for front_end in FRONT_ENDS
    if front_end != "screen"
}


def find_twin_deals() -> Pair:
    """Find two deals: the person passes with one card, the opponent bets with different ones."""
    problem = dmplay.load_problem(KUHN_POKER)
    other = dmplay.load_agent(problem, 1, "random")
    seed_by_deal: dict[str, int] = {}
    for seed in SEEDS:
        game = Session(problem, dmplay.SeededUniforms(seed), [None, other])
        game.advance([PASS, None])
        game.advance([WAIT, None])
        deal, _, history = problem.format_transcript_state(game.state).rpartition(" ")
        if history == "pb" and deal[0] == "1":
            seed_by_deal.setdefault(deal, seed)
    first_seed, second_seed = seed_by_deal["1 0"], seed_by_deal["1 2"]
    actions = ((PASS, WAIT), (WAIT, BET), (BET, WAIT))
    return Pair(KUHN_POKER, problem, 0, Side(first_seed, actions), Side(second_seed, actions))


@pytest.mark.parametrize("front", ["screen", *SLOW_FRONT_ENDS.values()])
def test_no_query_reveals_the_opponents_card(front: str, game_folder: Path) -> None:
    pair = find_twin_deals()
    lines = (
        ["pass", *list_queries(pair, 2, QUERY_ARGUMENTS), *FOLLOW_UP_COMMANDS]
        if front != "screen"
        else ["1", *FOLLOW_UP_COMMANDS]
    )
    assert_indistinguishable(
        *play_both(
            pair,
            game_folder,
            lambda side: FRONT_ENDS[front](pair.begun(side, TRANSCRIPT_PATH), lines),
        )
    )


def test_a_game_that_reveals_the_opponents_card_is_detected(
    game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def first(self: ExternalProblem, s: Array) -> Array:
        return np.array([[self.format_transcript_state(state)] * 2 for state in s])

    pair = find_twin_deals()
    monkeypatch.setattr(ExternalProblem, "initial_observations", first)
    with pytest.raises(AssertionError, match="can be told apart"):
        assert_indistinguishable(
            *play_both(
                pair,
                game_folder,
                lambda side: FRONT_ENDS["plain"](pair.begun(side, TRANSCRIPT_PATH), ["pass"]),
            )
        )
