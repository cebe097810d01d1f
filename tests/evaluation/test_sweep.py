"""Tests of sweeps: exact ranges with their ends, for problems and agents, in every command."""

import json
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.parameter_parsing import list_range, list_values
from dmplay.errors import BadParameter, UnknownName
from dmplay.evaluation.sweep import expand_agent_ranges
from tests.support.programs import run_dmplay


@pytest.mark.parametrize(
    ("text", "values"),
    [
        ("0:0.3:0.05", ["0", "0.05", "0.1", "0.15", "0.2", "0.25", "0.3"]),
        ("1:0:-0.5", ["1", "0.5", "0"]),
        ("0:1:0.4", ["0", "0.4", "0.8"]),
        ("100:300:100", ["100", "200", "300"]),
        ("1e-3:3e-3:1e-3", ["0.001", "0.002", "0.003"]),
        ("7:7:1", ["7"]),
        ("0.1,1:2:1,9", ["0.1", "1", "2", "9"]),
        ("a:b:c", ["a:b:c"]),
    ],
)
def test_a_range_has_exact_decimals_and_its_end(text: str, values: list[str]) -> None:
    assert list_values(text) == values


@pytest.mark.parametrize("text", ["0:1:0", "1:0:1", "0:-0.5:1", "0:1:1e-9", "0:1e999999:1"])
def test_a_range_that_does_not_reach_its_end_is_one_clear_line(text: str) -> None:
    with pytest.raises(BadParameter, match=f"^got the range '{text}', expected START:STOP:STEP"):
        list_range(text)


def test_a_sweep_has_each_combination_of_values_with_the_problem_and_the_agents() -> None:
    settings = dmplay.sweep("hexworld", "random", slip="0:0.5:0.25", discount=[0.5, np.float64(1)])
    pairs = [(slip, discount) for slip in (0.0, 0.25, 0.5) for discount in (0.5, 1.0)]
    assert [tuple(setting.parameters.values()) for setting in settings] == pairs
    for setting in settings:
        assert setting.problem == dmplay.load_problem("hexworld", **setting.parameters)
        assert setting.agents == "random"
    (single,) = dmplay.sweep("hexworld", slip=0.5)
    assert single.parameters == {"slip": 0.5}
    with pytest.raises(UnknownName, match="unknown parameter 'slop'; did you mean slip"):
        dmplay.sweep("hexworld", slop=1)
    with pytest.raises(BadParameter, match=r"slip: got 1\.5"):
        dmplay.sweep("hexworld", slip="0:2:0.5")


def test_a_range_in_the_name_of_an_agent_makes_several_agents() -> None:
    name, values = "threshold:repair=0.5:1.5:0.5", ("0.5", "1", "1.5")
    names = tuple(f"threshold:repair={value}" for value in values)
    assert tuple(expand_agent_ranges(name)) == names
    assert [item.agents for item in dmplay.sweep("machine-replacement", name)] == [*names]
    pairs = dmplay.sweep("prisoners-dilemma", ["softmax:precision=1:2:1", lambda view: 0])
    assert [item.agents[0] for item in pairs] == ["softmax:precision=1", "softmax:precision=2"]  # type: ignore[index]
    assert dmplay.compare("machine-replacement", [name], episodes=5).names == names
    result = dmplay.tournament("prisoners-dilemma", ["softmax:precision=1:3:2"], episodes=5)
    assert result.entrants == ("softmax:precision=1", "softmax:precision=3")
    assert expand_agent_ranges("bot:./play x=1:2:1") == ["bot:./play x=1:2:1"]
    assert expand_agent_ranges("./f.py:careful:a=1:2:1,b=0:1:1") == [
        f"./f.py:careful:a={a},b={b}" for a in (1, 2) for b in (0, 1)
    ]


def test_the_commands_play_compare_and_solve_each_setting(tmp_path: Path) -> None:
    options = ["--set", "slip=0:0.2:0.1", "--json"]
    few = ["--episodes", "20"]
    runs = json.loads(run_dmplay(tmp_path, "run", "hexworld", *options, *few).stdout)["runs"]
    assert [row["slip"] for row in runs] == [0.0, 0.1, 0.2]
    result = run_dmplay(tmp_path, "compare", "hexworld", "optimal", "random", *options, *few)
    settings = json.loads(result.stdout)["settings"]
    for setting, row in zip(settings, runs, strict=True):
        assert setting["parameters"] == {"slip": row["slip"]}
        assert setting["agents"][0]["mean_return"] == row["mean_return"]
    solved = json.loads(run_dmplay(tmp_path, "solve", "hexworld", *options).stdout)["settings"]
    for setting in solved:
        problem = dmplay.load_problem("hexworld", **setting["parameters"])
        assert setting["values"] == {"agent": dmplay.solve(problem).value()}
    agent = ["--agent", "threshold:repair=0.5:1:0.5", "--csv"]
    rows = run_dmplay(tmp_path, "run", "machine-replacement", *agent, *few).stdout.splitlines()
    assert [row.split(",")[1] for row in rows[1:]] == ["threshold:repair=0.5", "threshold:repair=1"]
