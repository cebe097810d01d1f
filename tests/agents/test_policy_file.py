"""Policies in files play as written, and files that do not fit are refused in one line."""

import json
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.arrays import Reals
from dmplay.errors import BadPolicy

HEXWORLD = dmplay.load_problem("hexworld")
LABELS = [*HEXWORLD.actions[0].labels]
STATES = HEXWORLD.enumerate_states()


def solve_hexworld() -> Reals:
    solution = dmplay.solve("hexworld")
    return np.array([solution.action_values(HEXWORLD.format_state(s)) for s in STATES[:24]])


def play(agent: str) -> Reals:
    policy = dmplay.load_agent(HEXWORLD, 0, agent)
    return dmplay.rollout(HEXWORLD, [policy], episodes=100).returns


@pytest.mark.parametrize("form", ["actions", "rows", "json list", "json rows", "json object"])
def test_the_optimal_policy_in_a_file_plays_like_the_optimal_agent(
    tmp_path: Path, form: str
) -> None:
    q = [*solve_hexworld().tolist(), [0.0] * 6]
    best = [LABELS[int(np.argmax(row))] for row in q]
    names = [HEXWORLD.format_state(s) for s in STATES]
    text = {
        "actions": "# one action for each hex\n" + "\n".join(best),
        "rows": "\n".join(", ".join(map(str, row)) for row in q),
        "json list": json.dumps(best),
        "json rows": json.dumps(q),
        "json object": json.dumps(dict(zip(names[:-1], best, strict=False))),
    }[form]
    (tmp_path / "mine").write_text(text, encoding="utf-8")
    np.testing.assert_array_equal(play(f"policy:{tmp_path / 'mine'}"), play("optimal"))


@pytest.mark.parametrize("form", ["sarsop", "pomdp-solve"])
def test_alpha_vectors_choose_the_action_of_the_greatest_one(tmp_path: Path, form: str) -> None:
    vectors = [(0, "-10 5"), (1, "2 1")]
    lines = [f'<Vector action="{a}" obsValue="0">{v} </Vector>' for a, v in vectors]
    if form == "pomdp-solve":
        lines = [f"{a}\n{v}\n" for a, v in vectors]
    (tmp_path / "out").write_text("\n".join(lines), encoding="utf-8")
    policy = dmplay.load_agent("crying-baby", 0, f"policy:{tmp_path / 'out'}")
    beliefs = np.array([[0.2, 0.8], [0.5, 0.5], [0.24, 0.76], [0.26, 0.74]])
    # -10 b + 5 (1 - b) is above 2 b + (1 - b) below b = 4 / 16
    assert policy.choose((beliefs,), None, np.zeros((4, 0))).tolist() == [0, 1, 0, 1]


@pytest.mark.parametrize(
    ("text", "problem", "reason"),
    [
        ("e\nw", "hexworld", "got 2 states, expected 25"),
        ("up\n" * 25, "hexworld", "up"),
        ("1 2\n" * 25, "hexworld", "expected an action, or 6 numbers"),
        ("[" * 99999, "hexworld", "recursion"),
        ('{"(0,0)": "e"}', "hexworld", "is missing"),
        ("[1, 2", "hexworld", "delimiter"),
        ("e", "cart-pole", "states can be listed"),
        ("0\n1 2 3", "crying-baby", "vectors of length 3, expected 2"),
        ("9\n1 2", "crying-baby", "got action 9"),
        ("", "crying-baby", "expected alpha vectors"),
        ("e", "predator-prey", "one agent"),
    ],
)
def test_a_file_that_does_not_fit_is_refused_in_one_line(
    tmp_path: Path, text: str, problem: str, reason: str
) -> None:
    (tmp_path / "bad").write_text(text, encoding="utf-8")
    with pytest.raises(BadPolicy, match=reason) as error:
        dmplay.load_agent(problem, 0, f"policy:{tmp_path / 'bad'}")
    assert "\n" not in str(error.value)
