"""Results of many games print in a few lines, and are tables for data frames."""

import csv
import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import dmplay
from tests.support.programs import run_dmplay

DILEMMA = "prisoners-dilemma"
AGENTS = ["grim", "tit-for-tat", "random"]
RESULTS: dict[str, Callable[[], Any]] = {
    "run": lambda: dmplay.run(DILEMMA, ["grim", "random"], episodes=500),
    "compare": lambda: dmplay.compare(DILEMMA, AGENTS, others="random", episodes=500),
    "tournament": lambda: dmplay.tournament(DILEMMA, AGENTS, episodes=500),
    "rollout": lambda: dmplay.rollout(DILEMMA, "random", episodes=500),
    "evaluate": lambda: dmplay.evaluate("grim", DILEMMA, 20).players[0],
    "play": lambda: dmplay.play(DILEMMA, "random", seed=7),
    "position": lambda: dmplay.Position.from_text("hexworld", state="(3,2)"),
    "solve": lambda: dmplay.solve("hexworld"),
}
COMMANDS = {
    "run": (DILEMMA, "--agent", "grim", "--vs", "random"),
    "compare": (DILEMMA, *AGENTS, "--vs", "random"),
    "tournament": (DILEMMA, *AGENTS),
}


@pytest.mark.parametrize("name", RESULTS)
def test_a_result_prints_in_a_few_lines(name: str) -> None:
    lines = str(RESULTS[name]()).splitlines()
    assert len(lines) <= 4
    assert all(len(line) <= 160 for line in lines)


def test_a_review_prints_a_line_for_each_choice() -> None:
    game = dmplay.play(DILEMMA, "random", seed=7, turns=2)
    while not game.over:
        game.act()
    lines = repr(game.review("agent1")).splitlines()
    assert [line.partition(",")[0] for line in lines] == ["turn 1", "turn 2"]


def test_the_result_of_a_comparison_names_agents_and_interval() -> None:
    text = repr(RESULTS["compare"]())
    assert "grim minus tit-for-tat: " in text
    assert "500 games of each agent with the same random numbers" in text


@pytest.mark.parametrize("name", COMMANDS)
def test_rows_are_those_of_the_command_line(name: str, tmp_path: Path) -> None:
    result = RESULTS[name]()
    options = ("--episodes", "500", "--seed", "0", "--csv")
    table = run_dmplay(tmp_path, name, *COMMANDS[name], *options).stdout
    printed, rows = [*csv.DictReader(io.StringIO(table))], result.list_rows()
    assert {*rows[0]} <= {*printed[0]}
    for printed_row, row in zip(printed, rows, strict=True):
        assert {key: printed_row[key] for key in row} == {k: str(v) for k, v in row.items()}


@pytest.mark.extra("pandas")
@pytest.mark.parametrize(
    ("name", "columns"),
    [
        ("run", ["seat", "mean return"]),
        ("compare", ["agent", "against", "difference"]),
        ("tournament", ["entrant", "mean return"]),
        ("rollout", ["episode", "return agent1", "turns"]),
    ],
)
def test_a_result_becomes_a_frame(name: str, columns: list[str]) -> None:
    frame = RESULTS[name]().to_frame()
    assert {*columns} <= {*frame.columns}
    assert len(frame) == {"run": 2, "compare": 3, "tournament": 3, "rollout": 500}[name]


@pytest.mark.extra("pandas")
def test_reviews_and_reports_become_frames(tmp_path: Path) -> None:
    game = dmplay.play("crying-baby", seed=7, turns=2)
    game.act("feed")
    game.act("sing")
    path = tmp_path / "game.dmt"
    game.save(path)
    assert [*dmplay.review(path).to_frame()["chosen"]] == ["feed", "sing"]
    assert dmplay.verify(path).to_frame().empty
    path.write_text(path.read_text().replace("-15", "-5"))
    frame = dmplay.verify(path).to_frame()
    assert frame["what"].tolist() == ["reward", "return", "total"]
