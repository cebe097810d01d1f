"""Tests of `evaluate`: a row for each player and problem, from games or from transcripts."""

import csv
import json
import sys
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory
from dmplay.errors import BadParameter
from dmplay.evaluation.agent_evaluation import BoundedEstimate
from tests.support.games import assert_verified
from tests.support.programs import run_dmplay

GAMES = 12
BOT = """
import json, sys
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        print(json.dumps({"type": "hello", "protocol": 1}), flush=True)
    elif message["type"] == "act":
        answer = {"type": "act", "id": message["id"], "action": "feed"}
        print(json.dumps({**answer, "belief": {"hungry": 0.75, "sated": 0.25}}), flush=True)
"""


class Feeder(dmplay.ReactivePolicy):
    """Feeds the baby, whose hunger it believes to be probable."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.zeros(len(memory[0]), int)

    def stated_belief(self, memory: Memory) -> Reals:
        return np.tile([0.2, 0.8], (len(memory[0]), 1))


def read_mean(estimate: BoundedEstimate | None) -> float:
    assert estimate is not None
    assert estimate.is_exact
    return estimate.low.mean


@pytest.mark.parametrize(
    ("agent", "problem"),
    [(Feeder, "crying-baby"), ("random", "hexworld"), ("random", "prisoners-dilemma")],
)
def test_the_parts_add_up_to_the_mean_return(agent: object, problem: str) -> None:
    (row,) = dmplay.evaluate(agent, problem, GAMES, turns=6).players  # type: ignore[arg-type]
    total = read_mean(row.estimate_part("start value")) + read_mean(row.estimate_part("luck"))
    for name in ("seeing", "choosing"):
        total -= read_mean(row.estimate_part(name))
    assert row.returns.mean == pytest.approx(total)
    assert row.stated_count == (6 * GAMES if problem == "crying-baby" else 0)


def test_the_best_agent_loses_nothing_and_its_games_are_those_of_run() -> None:
    evaluation = dmplay.evaluate("optimal:horizon=6", "crying-baby", GAMES, seed=3, turns=6)
    (row,) = evaluation.players
    assert read_mean(row.regret_per_turn) == pytest.approx(0.0)
    result = dmplay.run("crying-baby", "optimal:horizon=6", episodes=GAMES, seed=3, turns=6)
    assert row.returns == pytest.approx(result.seat_summaries[0].returns)


def test_anybody_can_compute_the_table_again_from_the_transcripts(tmp_path: Path) -> None:
    folder = tmp_path / "games"
    problems = ["crying-baby", "multicaregiver-crying-baby"]
    evaluation = dmplay.evaluate("feed-when-crying", problems, GAMES, folder=folder)
    for path in folder.iterdir():
        assert_verified(path)
    assert dmplay.evaluate_transcripts(folder).list_rows() == evaluation.list_rows()
    with pytest.raises(BadParameter, match="exists"):
        dmplay.evaluate("feed-when-crying", problems, GAMES, folder=folder)


def test_stated_beliefs_are_in_the_transcripts_too(tmp_path: Path) -> None:
    folder = tmp_path / "games"
    rows = dmplay.evaluate(Feeder, "crying-baby", 3, folder=folder).list_rows(games=True)
    recorded = dmplay.evaluate_transcripts(folder).list_rows(games=True)
    names = [name for name in rows[0] if name not in {"player", "game"}]
    assert [[row[name] for name in names] for row in rows] == [
        [row[name] for name in names] for row in recorded
    ]
    assert rows[0]["stated beliefs"] == 20


def test_any_seat_can_be_evaluated() -> None:
    (row,) = dmplay.evaluate("random", "predator-prey", 2, seat="prey", turns=5).players
    assert row.seat == "prey"
    assert read_mean(row.regret_per_turn) > 0.0


def test_a_row_says_why_it_has_no_parts_or_only_bounds(tmp_path: Path) -> None:
    problems = ["collaborative-predator-prey", "2048"]
    bounded, unknown = dmplay.evaluate("random", problems, 2, turns=3).players
    luck = bounded.estimate_part("luck")
    assert luck is not None
    assert luck.low.mean < luck.high.mean
    assert bounded.remarks
    assert unknown.estimate_part("luck") is None
    assert unknown.remarks
    assert unknown.returns.mean > 0.0


def test_a_program_is_evaluated_by_the_beliefs_that_it_states(tmp_path: Path) -> None:
    (tmp_path / "bot.py").write_text(BOT)
    bot, options = f"bot:{sys.executable} bot.py", ["--episodes", "2", "-o", "games", "--json"]
    completed = run_dmplay(tmp_path, "evaluate", bot, "crying-baby", *options)
    assert not completed.stderr
    (row,) = json.loads(completed.stdout)["players"]
    assert row["stated_beliefs"] == row["choices"] == 40
    assert row["seeing"] > 0.0
    again = json.loads(run_dmplay(tmp_path, "evaluate", "games", "--json").stdout)["players"]
    assert again == [row]


def test_the_command_prints_rows_for_problems_or_for_games(tmp_path: Path) -> None:
    words = ["evaluate", "random", "crying-baby", "hexworld", "--episodes", "3", "--turns", "4"]
    table = run_dmplay(tmp_path, *words).stdout.splitlines()
    assert [row.split()[0] for row in table] == ["problem", "crying-baby", "hexworld"]
    assert "not stated" in table[1]
    rows = [*csv.DictReader(run_dmplay(tmp_path, *words, "--csv", "--games").stdout.splitlines())]
    assert [row["game"] for row in rows] == 2 * ["episode 0", "episode 1", "episode 2"]


def test_games_that_were_left_are_not_counted_and_bad_files_are_named(tmp_path: Path) -> None:
    options = ["--seed", "7", "--turns", "2"]
    run_dmplay(tmp_path, "crying-baby", *options, "-o", "left.dmt", stdin="feed\nquit\n")
    run_dmplay(tmp_path, "crying-baby", *options, "-o", "done.dmt", stdin="feed\nfeed\n")
    (tmp_path / "bad.dmt").write_text("nothing\n")
    completed = run_dmplay(tmp_path, "evaluate", "left.dmt", "done.dmt", "bad.dmt", "--json")
    (row,) = json.loads(completed.stdout)["players"]
    assert (row["games"], row["player"]) == (1, "human")
    assert "not finished" in row["remarks"]
    assert completed.returncode == 1
    assert completed.stderr.startswith("bad.dmt:1")


@pytest.mark.parametrize(
    "words",
    [["random"], ["random", "nowhere"], ["nobody", "hexworld"], ["games.dmt", "--vs", "random"],
     ["random", "hexworld", "--trust"], ["random", "hexworld", "--json", "--csv"]],
)  # fmt: skip
def test_arguments_that_do_not_fit_are_one_error(tmp_path: Path, words: list[str]) -> None:
    completed = run_dmplay(tmp_path, "evaluate", *words)
    assert completed.returncode == 2
    assert completed.stderr.count("\n") == 1
