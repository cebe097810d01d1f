"""A poker player cannot tell apart games in which the opponent holds another card."""

import shutil
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Array
from dmplay.core.problem import find_wait_action
from dmplay.core.session import Session
from dmplay.external.history_problem import ExternalProblem
from tests.privacy.command_arguments import FOLLOW_UP_COMMANDS, QUERY_ARGUMENTS, list_queries
from tests.privacy.front_ends import (
    FRONT_ENDS,
    TRANSCRIPT_PATH,
    Response,
    assert_indistinguishable,
    play_both,
)
from tests.privacy.indistinguishable_pairs import Pair, Side
from tests.privacy.other_terminals import assert_no_leak_outside

pytestmark = pytest.mark.extra("openspiel")

KUHN_POKER, FILE_POKER = "openspiel:kuhn_poker", "full_poker.efg"
PASS, BET = range(2)
SEEDS = range(100)
# the states after the deals that give the person the middle card, as OpenSpiel writes them
MIDDLE_CARD_STATES = {KUHN_POKER: ("1 0", "1 2"), FILE_POKER: ("3:", "4:")}
SLOW_FRONT_ENDS = {
    front_end: pytest.param(front_end, marks=pytest.mark.slow)
    for front_end in FRONT_ENDS
    if front_end != "screen"
}
every_poker = pytest.mark.parametrize("name", MIDDLE_CARD_STATES)


@pytest.fixture(autouse=True)
def poker_file(game_folder: Path) -> None:
    """Put the game in extensive form into the folder; tests empty the folder itself."""
    shutil.copy(Path(__file__).parent / FILE_POKER, game_folder)


def find_twin_deals(name: str) -> Pair:
    """Find two deals: the person passes with one card, the opponent bets with different ones."""
    problem = dmplay.load_problem(name)
    other = dmplay.load_agent(problem, 1, "random")
    wait, seed_by_deal = find_wait_action(problem, 0), dict[str, int]()
    for seed in SEEDS:
        game = Session(problem, dmplay.SeededUniforms(seed), [None, other])
        game.advance([PASS, None])
        game.advance([wait, None])
        if game.turns[-1].actions[1] == BET:
            deal = problem.format_transcript_state(game.initial_state)
            seed_by_deal.setdefault(deal[: len(MIDDLE_CARD_STATES[name][0])], seed)
    first_seed, second_seed = (seed_by_deal[deal] for deal in MIDDLE_CARD_STATES[name])
    actions = ((PASS, wait), (wait, BET), (BET, wait))
    return Pair(name, problem, 0, Side(first_seed, actions), Side(second_seed, actions))


@every_poker
@pytest.mark.parametrize("front", ["screen", *SLOW_FRONT_ENDS.values()])
def test_no_query_reveals_the_opponents_card(front: str, name: str, game_folder: Path) -> None:
    pair = find_twin_deals(name)
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


@pytest.mark.parametrize("killed", [False, True])
def test_no_command_in_another_terminal_reveals_the_opponents_card(
    killed: bool, game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for command in ("play", "resume", "replay", "verify", "export", "review", "branch"):
        assert_no_leak_outside(find_twin_deals(FILE_POKER), monkeypatch, command, killed=killed)


@pytest.mark.parametrize("front", ["screen", "json"])
def test_no_ghost_reveals_the_opponents_card(front: str, game_folder: Path) -> None:
    pair = find_twin_deals(FILE_POKER)
    lines = ["pass", *FOLLOW_UP_COMMANDS]

    def play(side: Side) -> list[Response]:
        return FRONT_ENDS[front](pair.begun(side, TRANSCRIPT_PATH, ghost="random"), lines)

    assert_indistinguishable(*play_both(pair, game_folder, play))


def test_a_game_that_reveals_the_opponents_card_is_detected(
    game_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def first(self: ExternalProblem, s: Array) -> Array:
        return np.array([[self.format_transcript_state(state)] * 2 for state in s])

    pair = find_twin_deals(KUHN_POKER)
    monkeypatch.setattr(ExternalProblem, "initial_observations", first)
    with pytest.raises(AssertionError, match="can be told apart"):
        assert_indistinguishable(
            *play_both(
                pair,
                game_folder,
                lambda side: FRONT_ENDS["plain"](pair.begun(side, TRANSCRIPT_PATH), ["pass"]),
            )
        )
