"""Tests of the command `dmplay watch`: its list, its errors and its output in a pipe."""

import json
from pathlib import Path

import pytest

from dmplay.algorithms.registry import load_algorithms
from tests.support.programs import run_dmplay

SHOP = '''
import numpy as np
import dmplay

class Shop(dmplay.Problem):
    """Sell or wait; selling may close the shop."""
    discount = 0.5
    actions = (dmplay.Labels(("wait", "sell")),)
    state_count = 2

    def initial_chance(self, rows):
        return ()

    def initial_states(self, rows, events):
        return np.zeros(rows, int)

    def resolve_events(self, s, a, events):
        reward = np.where((s == 0) & (a[:, 0] == 1), 8.0, 0.0)
        next_state = np.where(a[:, 0] == 1, 1, s)
        return dmplay.Outcome(next_state, reward[:, None], next_state)

    def format_state(self, s):
        return ("open", "closed")[int(s)]

    def parse_state(self, text):
        return np.array(("open", "closed").index(text))
'''


def test_watch_alone_lists_each_algorithm_with_the_problems_it_fits(tmp_path: Path) -> None:
    text = run_dmplay(tmp_path, "watch").stdout
    for name, algorithm in load_algorithms().items():
        assert f"{name}: {algorithm.description}\n" in text
    assert "\n  problems: collision-avoidance, hexworld, mountain-car\n" in text


def test_the_list_as_json(tmp_path: Path) -> None:
    report = json.loads(run_dmplay(tmp_path, "watch", "--json").stdout)
    names = [row["name"] for row in report["algorithms"]]
    assert names == [*load_algorithms()]
    assert report["algorithms"][names.index("policy-iteration")]["problems"] == ["hexworld"]


def test_the_same_json_lines_each_time(tmp_path: Path) -> None:
    runs = [
        run_dmplay(tmp_path, "watch", "tree-search", "hexworld", "--json").stdout for _ in range(2)
    ]
    assert runs[0] == runs[1]
    first, *_, last = map(json.loads, runs[0].splitlines())
    assert first["step"] == 1
    assert last["pictures"][0]["kind"] == "search tree"


def test_the_seed_changes_a_search(tmp_path: Path) -> None:
    first, second = (
        run_dmplay(tmp_path, "watch", "tree-search", "hexworld", "--seed", seed).stdout
        for seed in "12"
    )
    assert first != second


def test_a_problem_of_a_user_is_watched_like_a_built_in_one(tmp_path: Path) -> None:
    file = tmp_path / "shop.py"
    file.write_text(SHOP)
    text = run_dmplay(tmp_path, "watch", "value-iteration", str(file)).stdout
    assert "V(open) = 8 + 0.5 (1 x 0) = 8\n" in text
    assert text.rstrip().split("\n")[-2] == "values: open 8 sell; closed 0 wait."


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("hexworld",), "watch: got the problem hexworld, expected an algorithm before it"),
        (("value-iteration",), "watch value-iteration: expected a problem"),
        (("value-iteratio", "hexworld"), "unknown algorithm 'value-iteratio'; did you mean value"),
        (("value-iteration", "hexwold"), "unknown problem 'hexwold'; did you mean hexworld"),
        (("value-iteration", "crying-baby"),
         "value-iteration does not fit crying-baby: the algorithm needs"),
        (("value-iteration", "hexworld", "--step", "99"), "got step 99, expected 1 to 22"),
        (("value-iteration", "hexworld", "--svg", "--film"), "watch: choose one of --svg, --film"),
        (("value-iteration", "hexworld", "--json", "--html"),
         "watch: choose one of --html, --json"),
        (("value-iteration", "hexworld", "-o", "a.svg"), "-o: choose a format"),
        (("value-iteration", "hexworld", "--iterations", "0"), "--iterations: got '0', expected"),
        (("value-iteration", "hexworld", "--seat", "pilot"), "unknown seat 'pilot'"),
        (("belief-update", "missing.dmt"), "missing.dmt: No such file"),
    ],
)  # fmt: skip
def test_wrong_words_get_one_line_and_exit_code_2(
    tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    result = run_dmplay(tmp_path, "watch", *words)
    assert result.returncode == 2
    assert result.stderr.startswith(f"error: {message}"), result.stderr
    assert result.stderr.count("\n") == 1
    assert not result.stdout
