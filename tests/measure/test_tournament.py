"""Tournaments: every seating on the same dice, kept, and the game that they make."""

import json
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.cli.errands import understood
from dmplay.core import Policy
from dmplay.errors import BadParameter
from dmplay.measure.tournament import Played, Tournament, tournament
from dmplay.reports.kept import Kept

DILEMMA = dmplay.load("prisoners-dilemma")
WORDS = ["tournament", "prisoners-dilemma", "grim", "always-defect", "--turns", "5"]


def policies(*names: str) -> dict[str, list[Policy]]:
    return {name: [dmplay.agent(DILEMMA, seat, name) for seat in (0, 1)] for name in names}


def met(*names: str, turns: int = 5, played: Played | None = None) -> Tournament:
    return tournament(DILEMMA, policies(*names), episodes=3, turns=turns, played=played)


def test_the_cross_table_is_what_the_rules_of_the_game_pay() -> None:
    found = met("grim", "always-defect")
    assert found.table.tolist() == [[[-5, -5], [-16, -12]], [[-12, -16], [-15, -15]]]
    assert [one.mean for one in found.earned] == [-10.5, -13.5]


def test_the_entrants_are_the_actions_of_a_game() -> None:
    found = met("grim", "always-defect")
    assert found.replies == (0, 1)
    assert found.equilibrium is not None
    assert found.equilibrium.first.tolist() == [1.0, 0.0]
    assert found.regrets is not None
    assert found.regrets.tolist() == [0.0, 7.0]


def test_what_was_played_is_not_played_again(tmp_path: Path) -> None:
    kept = Kept(tmp_path / "cup.jsonl", {"seed": 0})
    whole = met("grim", "always-defect", played=kept)
    again = Kept(tmp_path / "cup.jsonl", {"seed": 0})
    assert {seats: returns.tolist() for seats, returns in again.items()} == {
        seats: returns.tolist() for seats, returns in kept.items()
    }
    again[0, 0] = np.full((3, 2), 7.0)  # as if it had been played so
    found = met("grim", "always-defect", played=again)
    assert found.table[0, 0].tolist() == [7.0, 7.0]
    assert np.array_equal(found.table[0, 1], whole.table[0, 1])


def test_a_file_of_another_tournament_is_refused(tmp_path: Path) -> None:
    Kept(tmp_path / "cup.jsonl", {"seed": 0})[0, 0] = np.zeros((1, 2))
    with pytest.raises(BadParameter, match=r"cup.jsonl: of another tournament; name another file"):
        Kept(tmp_path / "cup.jsonl", {"seed": 1})


def test_a_tournament_is_told_as_data(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    told = understood([*WORDS, "--episodes", "2", "--json", "-o", "cup.jsonl"])
    assert isinstance(told, str)
    assert told == understood([*WORDS, "--episodes", "2", "--json", "-o", "cup.jsonl"])
    best, other = json.loads(told)["standings"]
    assert (best["entrant"], best["mean return"], best["regret"]) == ("grim", -10.5, 0.0)
    assert other["best reply to it"] == "always-defect"


def test_three_who_hunt_have_a_table_for_each_seat() -> None:
    hunt = dmplay.load("predator-prey:circle", predators=2)
    assert len(hunt.agents) == 3
    both = ("random", "search:simulations=2,depth=1")
    names = {name: [dmplay.agent(hunt, seat, name) for seat in range(3)] for name in both}
    found = tournament(hunt, names, episodes=2, turns=2)
    assert found.table.shape == (2, 2, 2, 3)
    assert found.equilibrium is None


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["tournament", "hexworld", "optimal", "random"], "a tournament wants two seats or more"),
        ([*WORDS[:3]], "got 1 entrant, expected two or more"),
        ([*WORDS[:3], "grim"], "an entrant is named twice"),
        ([*WORDS[:3], "human"], "human: a person cannot play so many games"),
    ],
)
def test_what_is_no_tournament_is_one_line(words: list[str], told: str) -> None:
    with pytest.raises(BadParameter, match=told):
        understood(words)


@pytest.mark.slow
def test_the_standings_are_those_of_the_axelrod_package() -> None:
    import axelrod

    ours = {"grim": "Grudger", "tit-for-tat": "TitForTat", "always-defect": "Defector",
            "always-cooperate": "Cooperator", "tit-for-two-tats": "TitFor2Tats"}  # fmt: skip
    found = met(*ours, turns=20)
    players = [getattr(axelrod, name)() for name in ours.values()]
    game = axelrod.Game(r=-1, s=-4, t=0, p=-3)
    result = axelrod.Tournament(players, turns=20, repetitions=1, game=game).play(
        progress_bar=False
    )
    assert np.allclose(found.table[:, :, 0] / 20, result.payoff_matrix)
