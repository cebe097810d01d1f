"""Tests of the repeated-game rules and strategies against matches of the Axelrod package."""

import pickle
from itertools import product
from typing import Any

import pytest

import dmplay
from dmplay.errors import BadPolicy, UnknownName

pytestmark = pytest.mark.extra("axelrod")

DILEMMA = dmplay.load_problem("prisoners-dilemma")
ROUND_COUNT = 12
AXELROD_NAME_BY_RULE = {
    "tit-for-tat": "TitForTat",
    "suspicious-tit-for-tat": "SuspiciousTitForTat",
    "grim": "Grudger",
    "win-stay-lose-shift": "WinStayLoseShift",
    "always-cooperate": "Cooperator",
    "always-defect": "Defector",
    "tit-for-two-tats": "TitFor2Tats",
    "two-tits-for-tat": "TwoTitsForTat",
    "majority": "GoByMajority",
}
EXTERNAL = ("Alternator", "HardTitForTat", "Gradual", "Prober", "ContriteTitForTat", "BackStabber",
          "Adaptive", "FirstByShubik")  # fmt: skip


def play_dmplay_match(agents: list[str]) -> list[tuple[int, int]]:
    policies = [dmplay.load_agent(DILEMMA, seat, name) for seat, name in enumerate(agents)]
    session = dmplay.Session(DILEMMA, dmplay.SeededUniforms(1), policies, turn_limit=ROUND_COUNT)
    turns = [session.advance() for _ in range(ROUND_COUNT)]
    return [(int(a), int(b)) for a, b in (turn.actions for turn in turns)]


def play_axelrod_match(axelrod: Any, names: list[str]) -> list[tuple[int, int]]:
    game = axelrod.Game(r=-1, s=-4, t=0, p=-3)
    match_attributes = {"length": float("inf"), "game": game, "noise": 0}
    players = [getattr(axelrod, name)() for name in names]
    result = axelrod.Match(
        players, turns=ROUND_COUNT, game=game, match_attributes=match_attributes
    ).play()
    return [(int(a.value), int(b.value)) for a, b in result]


@pytest.mark.slow
def test_every_match_equals_the_match_of_the_axelrod_package() -> None:
    import axelrod

    axelrod_names = {**AXELROD_NAME_BY_RULE, **{f"axelrod:{name}": name for name in EXTERNAL}}
    for first, second in product(axelrod_names, repeat=2):
        expected = play_axelrod_match(axelrod, [axelrod_names[first], axelrod_names[second]])
        assert play_dmplay_match([first, second]) == expected, f"{first} against {second}"


@pytest.mark.slow
def test_a_random_strategy_is_determined_by_the_seed() -> None:
    names = ["axelrod:Random", "axelrod:GTFT"]
    assert play_dmplay_match(names) == play_dmplay_match(names)
    assert len({a for a, _ in play_dmplay_match(names)}) == 2


@pytest.mark.slow
def test_a_pickled_strategy_plays_the_same_game() -> None:
    players = [dmplay.load_agent(DILEMMA, seat, "axelrod:Gradual") for seat in range(2)]
    original = dmplay.rollout(DILEMMA, players, episodes=2, turn_limit=3)
    copies = pickle.loads(pickle.dumps(players))
    unpickled = dmplay.rollout(DILEMMA, copies, episodes=2, turn_limit=3)
    assert (original.returns == unpickled.returns).all()


@pytest.mark.slow
def test_unknown_and_cheating_strategies_are_refused() -> None:
    with pytest.raises(UnknownName, match="axelrod: unknown strategy 'TitForTatt'; did you mean"):
        dmplay.load_agent(DILEMMA, 0, "axelrod:TitForTatt")
    with pytest.raises(BadPolicy, match="Darwin breaks the rules"):
        dmplay.load_agent(DILEMMA, 0, "axelrod:Darwin")


def test_the_error_names_the_extra_if_axelrod_is_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "axelrod", None)
    with pytest.raises(BadPolicy, match=r"pip install 'dmplay\[axelrod\]'"):
        dmplay.load_agent(DILEMMA, 0, "axelrod:TitForTat")
