"""Tournaments: every seating on the same dice, kept, and the game that they make."""

import json
import os
import re
import signal
import subprocess
import sys
import time
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import disk
from dmplay.chance import Array, Bools, Reals
from dmplay.cli.errands import interpret_command
from dmplay.core import Memory, Policy
from dmplay.errors import BadParameter, BadPolicy, IllegalAction, UnknownName
from dmplay.measure.estimate import Estimate
from dmplay.measure.tournament import ReturnsBySeating, TournamentResult, run_tournament
from dmplay.policies.general import Random
from dmplay.reports.kept import TournamentCheckpoint
from dmplay.reports.tournaments import _standing_rows, _standing_table_row
from tests.support.programs import run
from tests.support.terminals import clean_environment

DILEMMA = dmplay.load_problem("prisoners-dilemma")
ROCK = """
import numpy as np

class Rock:
    uniform_count = 0
    def __init__(self, problem, seat): pass
    def initial_memory(self, observation): return (np.zeros(len(observation)),)
    def update_memory(self, memory, percept): return memory
    def choose(self, memory, legal, u): return np.zeros(len(u), int)
    def action_values(self, memory): return None
"""
BOT = """
import json, sys
for line in sys.stdin:
    said = json.loads(line)
    if said["type"] == "hello":
        print(json.dumps({"type": "hello", "protocol": 1}), flush=True)
    elif said["type"] == "act":
        print(json.dumps({"type": "act", "id": said["id"], "action": "paper"}), flush=True)
"""
WORDS = ["tournament", "prisoners-dilemma", "grim", "always-defect", "--turns", "5"]


def policies(*names: str) -> dict[str, list[Policy]]:
    return {name: [dmplay.load_agent(DILEMMA, seat, name) for seat in (0, 1)] for name in names}


def met(*names: str, turns: int = 5, played: ReturnsBySeating | None = None) -> TournamentResult:
    return run_tournament(
        DILEMMA, policies(*names), episodes=3, turns=turns, returns_by_seating=played
    )


def test_the_cross_table_is_what_the_rules_of_the_game_pay() -> None:
    found = met("grim", "always-defect")
    assert found.mean_returns.tolist() == [[[-5, -5], [-16, -12]], [[-12, -16], [-15, -15]]]
    assert [one.mean for one in found.return_estimates] == [-10.5, -13.5]


def test_the_entrants_are_the_actions_of_a_game() -> None:
    found = met("grim", "always-defect")
    assert found.best_replies == (0, 1)
    assert found.equilibrium is not None
    assert found.equilibrium[0].tolist() == [1.0, 0.0]
    assert found.regrets is not None
    assert found.regrets.tolist() == [0.0, 7.0]
    assert found.exploitability == 0.0


def test_nobody_loses_anything_by_its_part_of_the_equilibrium() -> None:
    problem = dmplay.load_problem("rock-paper-scissors")
    rows = [[0.0, 1.7, -1.0], [-1.0, 0.0, 1.3], [1.0, -1.7, 0.0]]
    played: ReturnsBySeating = {
        (i, j): np.array([[paid, -paid]] * 2)
        for i, row in enumerate(rows)
        for j, paid in enumerate(row)
    }
    policy = dmplay.load_agent(problem, 0, "random")
    found = run_tournament(problem, dict.fromkeys("abc", [policy] * 2), returns_by_seating=played)
    assert found.regrets is not None
    assert found.regrets.tolist() == [0.0, 0.0, 0.0]


def test_what_was_played_is_not_played_again(tmp_path: Path) -> None:
    kept = TournamentCheckpoint(tmp_path / "cup.jsonl", {"seed": 0})
    whole = met("grim", "always-defect", played=kept)
    again = TournamentCheckpoint(tmp_path / "cup.jsonl", {"seed": 0})
    assert {seats: returns.tolist() for seats, returns in again.items()} == {
        seats: returns.tolist() for seats, returns in kept.items()
    }
    again[0, 0] = np.full((3, 2), 7.0)  # as if it had been played so
    found = met("grim", "always-defect", played=again)
    assert found.mean_returns[0, 0].tolist() == [7.0, 7.0]
    assert np.array_equal(found.mean_returns[0, 1], whole.mean_returns[0, 1])


def test_a_file_of_another_tournament_is_refused(tmp_path: Path) -> None:
    TournamentCheckpoint(tmp_path / "cup.jsonl", {"seed": 0})[0, 0] = np.zeros((1, 2))
    with pytest.raises(BadParameter, match=r"cup.jsonl: of another tournament; name another file"):
        TournamentCheckpoint(tmp_path / "cup.jsonl", {"seed": 1})


def test_what_is_kept_may_be_of_any_size_and_is_gone_on_with_after_a_kill(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "cup"
    TournamentCheckpoint(path, {"seed": 0})[0, 0] = np.zeros((9, 2))
    whole = path.read_bytes()
    monkeypatch.setattr(disk, "MAX_FILE_BYTES", 100)
    assert len(whole) > 100
    path.write_bytes(whole + whole[30:60])  # a line that was not written to its end
    again = TournamentCheckpoint(path, {"seed": 0})
    assert [*again] == [(0, 0)]
    again[0, 1] = np.ones((1, 2))
    assert path.read_bytes() == whole + b'{"seats": [0, 1], "returns": [[1.0, 1.0]]}\n'
    for text, told in (
        (b"no end of line", "cup: of no tournament; name another file"),
        (b"no text \xff\n", "cup: of another tournament; name another file"),
        (b'{"seed": 0}\n\xff\n', "cup:2: not a seating; remove the line"),
        (b'{"seed": 0}\n{"seats": 3}\n', "cup:2: not a seating; remove the line"),
    ):
        path.write_bytes(text)
        with pytest.raises(BadParameter, match=told):
            TournamentCheckpoint(path, {"seed": 0})


def test_a_tournament_is_told_as_data(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    told = interpret_command([*WORDS, "--episodes", "2", "--json", "-o", "cup.jsonl"])
    assert isinstance(told, str)
    assert told == interpret_command([*WORDS, "--episodes", "2", "--json", "-o", "cup.jsonl"])
    best, other = json.loads(told)["standings"]
    assert (best["entrant"], best["mean return"], best["regret"]) == ("grim", -10.5, 0.0)
    assert other["best reply to it"] == "always-defect"


def test_the_exact_equilibrium_is_met_by_all() -> None:
    nash = policies("nash")["nash"]
    found = run_tournament(
        DILEMMA, policies("grim", "always-defect"), equilibrium_policies=nash, episodes=3, turns=5
    )
    assert found.exact_regrets is not None
    assert [one.mean for one in found.exact_regrets] == [
        1.0,
        0.0,
    ]  # who cooperates once loses a year
    words = ["tournament", "rock-paper-scissors", "random", "beat-last", "--turns", "2", "--json"]
    rows = json.loads(str(interpret_command([*words, "--episodes", "3"])))
    assert rows["equilibrium"] == "nash"
    assert all("exact regret" in row for row in rows["standings"])


def test_a_tournament_that_is_interrupted_tells_what_was_played() -> None:
    told: list[float] = []

    def stop(share: float) -> None:
        told.append(share)
        if share > 0.3:
            raise KeyboardInterrupt

    entrants = policies("grim", "always-defect")
    found = run_tournament(DILEMMA, entrants, episodes=3, turns=5, progress=stop)
    assert found.shortfall_reason == "interrupted"
    assert found.mean_returns[0, 0].tolist() == [-5, -5]
    assert np.isnan(found.mean_returns[1, 1]).all()
    assert (found.equilibrium, found.exact_regrets) == (None, None)
    first = found._replace(
        return_estimates=(Estimate(np.nan, np.inf, -np.inf, np.inf), found.return_estimates[0])
    )
    rows = [_standing_table_row(row) for row in _standing_rows(first)]
    assert [row["entrant"] for row in rows] == ["always-defect", "grim"]
    assert rows[1]["mean return"] == "-"


class Ninth(Random):
    """Does what there is not."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.full(len(u), 9)


def test_an_error_tells_in_whose_games_it_came_up() -> None:
    sides = {"fair": Random, "wrong": Ninth}
    each = {name: [make(DILEMMA, seat) for seat in range(2)] for name, make in sides.items()}
    with pytest.raises(BadPolicy, match=r"^fair and wrong: turn 1, agent2: got action 9, expected"):
        run_tournament(DILEMMA, each, episodes=2)
    for watch in (None, lambda share: None):  # played at once, and tried before
        playing = partial(dmplay.compare, DILEMMA, [*each.values()], episodes=2, progress=watch)
        with pytest.raises(BadPolicy, match=r"^wrong: turn 1, agent1: got action 9"):
            playing(names=[*each])
        with pytest.raises(IllegalAction, match=r"^turn 1, agent1: got action 9"):
            playing()


def test_entrants_may_keep_the_order_in_which_they_are_named(tmp_path: Path) -> None:
    words = [*WORDS, "--episodes", "2", "--seats", "given", "-o", str(tmp_path / "cup")]
    told = str(interpret_command(words))
    assert told.startswith("prisoners-dilemma: 3 seatings of 2 games")
    assert str(interpret_command([*words, "--json"])).count("[null, null]") == 1
    assert (tmp_path / "cup").read_text().count("returns") == 3
    with pytest.raises(BadParameter, match="of another tournament"):
        interpret_command([*words, "--seats", "all"])


@pytest.mark.slow
def test_programs_and_files_enter_and_a_killed_tournament_goes_on(tmp_path: Path) -> None:
    (tmp_path / "rock.py").write_text(ROCK)
    (tmp_path / "bot.py").write_text(BOT)
    entrants = ["nash", "./rock.py:Rock", f"bot:{sys.executable} bot.py"]
    words = ["tournament", "rock-paper-scissors", *entrants, "--episodes", "40", "--turns", "20"]
    whole = run(tmp_path, *words, "--workers", "2", "--csv")
    assert whole.returncode == 0, whole.stderr
    world = clean_environment(tmp_path)
    killed = subprocess.Popen(
        [sys.executable, "-m", "dmplay", *words, "-o", "cup"], cwd=tmp_path, env=world,
        stdout=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    cup = tmp_path / "cup"
    while killed.poll() is None and not (cup.exists() and cup.read_text().count("seats") > 2):
        time.sleep(0.01)
    os.killpg(killed.pid, signal.SIGKILL)
    killed.wait()
    assert 2 < cup.read_text().count('"seats"') < 16
    again = run(tmp_path, *words, "-o", "cup", "--csv")
    assert again.stdout == whole.stdout


def test_three_who_hunt_have_a_table_for_each_seat() -> None:
    hunt = dmplay.load_problem("predator-prey:circle", predators=2)
    assert len(hunt.agents) == 3
    both = ("random", "search:simulations=2,depth=1")
    names = {name: [dmplay.load_agent(hunt, seat, name) for seat in range(3)] for name in both}
    found = run_tournament(hunt, names, episodes=2, turns=2)
    assert found.mean_returns.shape == (2, 2, 2, 3)
    assert found.exact_regrets is None


def test_three_seats_have_an_equilibrium_too_and_what_is_to_be_gained_in_it() -> None:
    """All but the last seat want what the first does; the last wants it the other way round."""
    hunt = dmplay.load_problem("predator-prey:circle", predators=2)
    policy = [dmplay.load_agent(hunt, seat, "random") for seat in range(3)]
    played: ReturnsBySeating = {
        seats: np.array([[paid, paid, -paid]] * 2)
        for seats in product(range(2), repeat=3)
        for paid in [float(len({*seats}) == 1) + 0.5 * (seats == (1, 1, 1))]
    }
    found = run_tournament(hunt, {"a": policy, "b": policy}, returns_by_seating=played)
    assert found.best_replies == (0, 1)
    assert found.equilibrium is not None
    assert found.regrets is not None
    assert found.exploitability is not None
    assert 0.0 <= found.exploitability < 0.05
    for seat, mix in enumerate(found.equilibrium):
        worth = np.einsum("ijk,jk->i", *_others(found.mean_returns, found.equilibrium, seat))
        assert worth.max() - mix @ worth <= found.exploitability + 1e-12


def _others(table: Reals, mixes: tuple[Reals, ...], seat: int) -> tuple[Reals, Reals]:
    """What each entrant of a seat is paid beside each pair, and how often that pair sits there."""
    first, second = [mix for place, mix in enumerate(mixes) if place != seat]
    return np.moveaxis(table[..., seat], seat, 0), np.outer(first, second)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["tournament", "hexworld", "optimal", "random"], "a tournament wants two seats or more"),
        ([*WORDS[:3]], "got 1 entrant, expected two or more"),
        ([*WORDS[:3], "grim"], "an entrant is named twice"),
        ([*WORDS[:3], "human"], "human: a person cannot play so many games"),
        ([*WORDS, "--seats", "gven"], "seats: unknown order 'gven'; did you mean given?"),
    ],
)
def test_what_is_no_tournament_is_one_line(words: list[str], told: str) -> None:
    with pytest.raises((BadParameter, UnknownName), match=re.escape(told)):
        interpret_command(words)


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
    assert np.allclose(found.mean_returns[:, :, 0] / 20, result.payoff_matrix)
