"""Our rules, and the Axelrod package's strategies played by us, against that package's matches."""

import pickle
from itertools import product
from typing import Any

import pytest

import dmplay
from dmplay.errors import BadPolicy, UnknownName

GAME = dmplay.load_problem("prisoners-dilemma")
ROUNDS = 12
OURS = {
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
THEIRS = ("Alternator", "HardTitForTat", "Gradual", "Prober", "ContriteTitForTat", "BackStabber",
          "Adaptive", "FirstByShubik")  # fmt: skip


def played(agents: list[str]) -> list[tuple[int, int]]:
    seated = [dmplay.load_agent(GAME, seat, name) for seat, name in enumerate(agents)]
    session = dmplay.Session(GAME, dmplay.SeededUniforms(1), seated, turn_limit=ROUNDS)
    turns = [session.advance() for _ in range(ROUNDS)]
    return [(int(a), int(b)) for a, b in (turn.actions for turn in turns)]


def match(axelrod: Any, names: list[str]) -> list[tuple[int, int]]:
    game = axelrod.Game(r=-1, s=-4, t=0, p=-3)
    told = {"length": float("inf"), "game": game, "noise": 0}
    players = [getattr(axelrod, name)() for name in names]
    result = axelrod.Match(players, turns=ROUNDS, game=game, match_attributes=told).play()
    return [(int(a.value), int(b.value)) for a, b in result]


@pytest.mark.slow
def test_every_match_is_that_of_the_axelrod_package() -> None:
    import axelrod

    everyone = {**OURS, **{f"axelrod:{name}": name for name in THEIRS}}
    for one, other in product(everyone, repeat=2):
        wanted = match(axelrod, [everyone[one], everyone[other]])
        assert played([one, other]) == wanted, f"{one} against {other}"


@pytest.mark.slow
def test_a_strategy_that_draws_follows_the_dice() -> None:
    both = ["axelrod:Random", "axelrod:GTFT"]
    assert played(both) == played(both)
    assert len({a for a, _ in played(both)}) == 2


@pytest.mark.slow
def test_a_strategy_can_be_sent_to_a_worker() -> None:
    players = [dmplay.load_agent(GAME, seat, "axelrod:Gradual") for seat in range(2)]
    here = dmplay.rollout(GAME, players, episodes=2, turn_limit=3)
    sent = pickle.loads(pickle.dumps(players))
    there = dmplay.rollout(GAME, sent, episodes=2, turn_limit=3)
    assert (here.returns == there.returns).all()


@pytest.mark.slow
def test_unknown_strategies_and_cheats_are_refused() -> None:
    with pytest.raises(UnknownName, match="axelrod: unknown strategy 'TitForTatt'; did you mean"):
        dmplay.load_agent(GAME, 0, "axelrod:TitForTatt")
    with pytest.raises(BadPolicy, match="Darwin does not keep the rules"):
        dmplay.load_agent(GAME, 0, "axelrod:Darwin")


def test_without_the_package_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "axelrod", None)
    with pytest.raises(BadPolicy, match=r"pip install 'dmplay\[axelrod\]'"):
        dmplay.load_agent(GAME, 0, "axelrod:TitForTat")
