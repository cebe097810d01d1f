"""A player of Kuhn's poker cannot tell games apart in which the other holds another card."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.chance import Array
from dmplay.guests.history import ExternalProblem
from dmplay.session import Session
from tests.privacy.arguments import AFTER, ASKING, questions
from tests.privacy.fronts import FILE, FRONTS, alike, both
from tests.privacy.pairs import Pair, Side

KUHN = "openspiel:kuhn_poker"
PASS, BET, WAIT = range(3)
SEEDS = range(100)
SLOWLY = {one: pytest.param(one, marks=pytest.mark.slow) for one in FRONTS if one != "screen"}


def twins() -> Pair:
    """Two deals in which the person has the same card and passes; the other bets on another."""
    problem = dmplay.load_problem(KUHN)
    other = dmplay.load_agent(problem, 1, "random")
    found: dict[str, int] = {}
    for seed in SEEDS:
        game = Session(problem, dmplay.SeededUniforms(seed), [None, other])
        game.advance([PASS, None])
        game.advance([WAIT, None])
        deal, _, played = problem.format_transcript_state(game.state).rpartition(" ")
        if played == "pb" and deal[0] == "1":
            found.setdefault(deal, seed)
    one, two = found["1 0"], found["1 2"]
    actions = ((PASS, WAIT), (WAIT, BET), (BET, WAIT))
    return Pair(KUHN, problem, 0, Side(one, actions), Side(two, actions))


@pytest.mark.parametrize("front", ["screen", *SLOWLY.values()])
def test_nothing_that_is_asked_tells_the_other_card(front: str, place: Path) -> None:
    pair = twins()
    lines = ["pass", *questions(pair, 2, ASKING), *AFTER] if front != "screen" else ["1", *AFTER]
    alike(*both(pair, place, lambda side: FRONTS[front](pair.begun(side, FILE), lines)))


def test_a_game_that_tells_the_other_card_is_found(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def first(self: ExternalProblem, s: Array) -> Array:
        return np.array([[self.format_transcript_state(one)] * 2 for one in s])

    pair = twins()
    monkeypatch.setattr(ExternalProblem, "initial_observations", first)
    with pytest.raises(AssertionError, match="can be told apart"):
        alike(*both(pair, place, lambda side: FRONTS["plain"](pair.begun(side, FILE), ["pass"])))
