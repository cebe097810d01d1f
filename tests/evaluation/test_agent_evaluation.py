"""Tests of `evaluate`: a row for each player and problem, from games or from transcripts."""

import csv
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory
from dmplay.errors import BadParameter
from dmplay.evaluation.player_evaluation import BoundedEstimate
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


@dataclass(frozen=True)
class Repeater(dmplay.ReactivePolicy):
    """Repeats the action with this number."""

    number: int = 0

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.full(len(memory[0]), self.number)


def read_mean(estimate: BoundedEstimate | None) -> float:
    assert estimate is not None
    assert estimate.is_exact
    return estimate.low.mean


def read_csv(folder: Path, *words: str) -> list[dict[str, str]]:
    return [*csv.DictReader(run_dmplay(folder, *words, "--csv").stdout.splitlines())]


@pytest.mark.parametrize(
    ("agent", "problem"),
    [(Feeder, "crying-baby"), ("random", "hexworld"), ("random", "prisoners-dilemma")],
)
def test_the_parts_add_up_to_the_mean_return(agent: object, problem: str) -> None:
    (row,) = dmplay.evaluate(agent, problem, GAMES, turns=6).players  # type: ignore[arg-type]
    total = read_mean(row.estimates["start value"]) + read_mean(row.estimates["luck"])
    for name in ("seeing", "choosing"):
        total -= read_mean(row.estimates[name])
    assert row.returns.mean == pytest.approx(total)
    assert row.stated_count == (6 * GAMES if problem == "crying-baby" else 0)


def test_the_best_agent_loses_nothing_and_its_games_are_those_of_run() -> None:
    evaluation = dmplay.evaluate("optimal:horizon=6", "crying-baby", GAMES, seed=3, turns=6)
    (row,) = evaluation.players
    assert read_mean(row.estimates["regret per turn"]) == pytest.approx(0.0)
    result = dmplay.run("crying-baby", "optimal:horizon=6", episodes=GAMES, seed=3, turns=6)
    assert row.returns == pytest.approx(result.seat_summaries[0].returns)
    assert not row.remarks
    (row,) = dmplay.evaluate("optimal", "crying-baby", GAMES, seed=3, turns=6).players
    assert read_mean(row.estimates["regret per turn"]) > 0.0
    assert row.remarks == ["optimal ignores the turn limit (optimal:horizon=6 does not)"]


def test_anybody_can_compute_the_table_again_from_the_transcripts(tmp_path: Path) -> None:
    folder = tmp_path / "games"
    problems = ["crying-baby", "multicaregiver-crying-baby"]
    evaluation = dmplay.evaluate("feed-when-crying", problems, GAMES, folder=folder)
    for path in folder.iterdir():
        assert_verified(path)
    assert dmplay.evaluate_transcripts(folder).list_rows() == evaluation.list_rows()
    with pytest.raises(BadParameter, match="games is not empty"):
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


def test_any_seat_can_be_evaluated_from_games_and_from_transcripts(tmp_path: Path) -> None:
    folder = tmp_path / "games"
    evaluation = dmplay.evaluate(
        "random", "predator-prey", 2, seat="prey", others="random", turns=5, folder=folder
    )
    (row,) = evaluation.players
    assert row.seat == "prey"
    assert read_mean(row.estimates["regret per turn"]) > 0.0
    assert dmplay.evaluate_transcripts(folder, seat="prey").list_rows() == evaluation.list_rows()
    words = ["evaluate", "random", "predator-prey", "--episodes", "2", "--turns", "5"]
    seats = ["--seat", "prey", "--seat", "predator=random", "--json"]
    (printed,) = json.loads(run_dmplay(tmp_path, *words, *seats).stdout)["players"]
    assert printed["mean_return"] == row.returns.mean


def test_the_workers_do_not_change_the_evaluation() -> None:
    agent = "feed-when-crying"
    expected = dmplay.evaluate(agent, "crying-baby", 20).list_rows(games=True)
    with ThreadPoolExecutor(2) as executor:
        evaluation = dmplay.evaluate(agent, "crying-baby", 20, workers=2, executor=executor)
    assert evaluation.list_rows(games=True) == expected


def test_a_row_says_why_it_has_no_parts_or_only_bounds(tmp_path: Path) -> None:
    problems = ["collaborative-predator-prey", "2048"]
    bounded, unknown = dmplay.evaluate("random", problems, 2, turns=6).players
    luck = bounded.estimates["luck"]
    assert luck is not None
    assert luck.low.mean < luck.high.mean
    assert bounded.remarks
    assert unknown.estimates["luck"] is None
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


def test_the_command_prints_rows_for_problems_settings_or_games(tmp_path: Path) -> None:
    words = ["evaluate", "random", "crying-baby", "hexworld", "--episodes", "3", "--turns", "4"]
    heading, table, *rows = run_dmplay(tmp_path, *words).stdout.splitlines()
    assert heading == "random, 3 games"
    assert table.split()[:2] == ["problem", "return"]
    assert [row.split()[0] for row in rows] == ["crying-baby", "hexworld"]
    assert "not stated" in rows[0]
    by_game = read_csv(tmp_path, *words, "--games")
    assert [row["game"] for row in by_game] == 2 * ["episode 0", "episode 1", "episode 2"]
    words = ["evaluate", "random", "hexworld", "--episodes", "2", "--set", "slip=0.1,0.2"]
    settings = read_csv(tmp_path, *words, "-o", "games")
    assert [row["problem"] for row in settings] == ["hexworld slip=0.1", "hexworld slip=0.2"]
    again = read_csv(tmp_path, "evaluate", "games")
    assert [row["choosing"] for row in again] == [row["choosing"] for row in settings]


def test_several_players_are_evaluated_on_the_same_games(tmp_path: Path) -> None:
    def feed(view: dmplay.View[dmplay.Problem]) -> str:
        return "feed"

    def ignore(view: dmplay.View[dmplay.Problem]) -> str:
        return "ignore"

    folder, options = tmp_path / "games", {"turns": 5}
    names = ["optimal:horizon=2:4:2", feed, ignore]
    evaluation = dmplay.evaluate(names, "crying-baby", 2, folder=folder, **options)  # type: ignore[arg-type]
    rows = evaluation.list_rows()
    players = ["optimal:horizon=2", "optimal:horizon=4", "feed", "ignore"]
    assert [row["player"] for row in rows] == players
    (alone,) = dmplay.evaluate(ignore, "crying-baby", 2, **options).list_rows()  # type: ignore[arg-type]
    assert rows[3] == alone
    assert dmplay.evaluate_transcripts(folder).list_rows() == rows
    lineup = dmplay.evaluate([["grim", "random"]], "prisoners-dilemma", 3)
    assert lineup == dmplay.evaluate("grim", "prisoners-dilemma", 3, others="random")


def test_players_of_one_class_are_told_apart_in_games_and_transcripts(tmp_path: Path) -> None:
    problem = dmplay.load_problem("crying-baby", feed_reward=-4.0)
    agents = [Repeater(problem, 0, number) for number in (2, 2, 1, 0)]
    players = ["Repeater:number=2 1", "Repeater:number=2 2", "Repeater:number=1", "Repeater"]
    folder = tmp_path / "games"
    rows = dmplay.evaluate(agents, problem, 2, turns=5, folder=folder).list_rows()
    assert [row["player"] for row in rows] == players
    assert {row["problem"] for row in rows} == {"crying-baby feed_reward=-4.0"}
    assert dmplay.evaluate_transcripts(folder).list_rows() == rows
    functions = [lambda view: "feed", lambda view: "sing"]
    names = ["<lambda> 1", "<lambda> 2", "random"]
    compared = dmplay.compare(problem, [*functions, "random"], episodes=3, turns=5)
    assert list(compared.names) == names
    dilemma, actions = "prisoners-dilemma", ["cooperate", "defect"]
    choices = [lambda view: actions[0], lambda view: actions[1]]
    result = dmplay.tournament(dilemma, [*choices, "random"], episodes=3)
    assert list(result.entrants) == names


def test_an_agent_of_a_file_has_the_same_name_in_transcripts_of_another_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("feeder.py").write_text("def feed(view):\n    return 'feed'\n")
    rows = dmplay.evaluate("./feeder.py:feed", "crying-baby", 2, folder="games").list_rows()
    assert rows[0]["player"] == "./feeder.py:feed"
    assert dmplay.evaluate_transcripts("games", trusted=True).list_rows() == rows


@pytest.mark.parametrize("problem", ["hexworld", dmplay.load_problem("catch"), dmplay.MatrixGame])
def test_a_problem_in_the_place_of_the_agent_is_an_error_that_says_the_order(
    problem: object,
) -> None:
    for agents in problem, ["random", problem]:
        with pytest.raises(BadParameter, match=r"expected evaluate\(agent, problems\)"):
            dmplay.evaluate(agents, "optimal")  # type: ignore[arg-type]


@pytest.mark.parametrize("columns", [50, 80])
def test_the_table_fits_the_terminal_and_names_what_it_leaves_out(
    tmp_path: Path, columns: int
) -> None:
    words = ["evaluate", "feed-when-crying", "crying-baby", "collaborative-predator-prey"]
    words = [*words[:1], "random", *words[2:], "--episodes", "2", "--turns", "3"]
    lines = run_dmplay(tmp_path, *words, "--width", str(columns)).stdout.splitlines()
    assert max(map(len, lines)) <= columns
    assert "columns left out: " in " ".join(lines)


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
     ["random", "hexworld", "--trust"], ["random", "hexworld", "--json", "--csv"],
     ["random", "hexworld", "--set", "slip=0.5:0:0.1"], ["random", "hexworld", "--set", "slip=x"],
     ["random", "hexworld", "--seat", "nobody"], ["random", "hexworld", "--vs", "random"],
     ["random", "predator-prey", "--seat", "prey", "--seat", "prey=random"],
     ["human", "hexworld"], ["games.dmt", "--seat", "prey=random"]],
)  # fmt: skip
def test_arguments_that_do_not_fit_are_one_error(tmp_path: Path, words: list[str]) -> None:
    completed = run_dmplay(tmp_path, "evaluate", *words)
    assert completed.returncode == 2
    assert completed.stderr.count("\n") == 1
