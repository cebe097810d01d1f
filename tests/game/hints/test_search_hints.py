"""Tests of the hints of a search, which says when its estimates are too close to call."""

from pathlib import Path

import numpy as np
import pytest

from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import ActionValues
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.hints.explanation import explain_action
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.hints.review import format_summary, review_actions
from dmplay.registry.problems import load_problem

LOTTERY = """EFG 2 R "one player with chance" { "Solo" }
p "buy?" 1 1 "" { "buy" "pass" } 0
c "" 1 "" { "win" 1/10 "lose" 9/10 } 1 "price" { -2 }
t "" 2 "prize" { 25 }
t "" 3 "nothing" { 0 }
t "" 4 "none" { 0 }
"""
TWO_STAGES = """EFG 2 R "two stages" { "Solo" }
p "" 1 1 "" { "drill" "sell" } 0
c "" 1 "" { "oil" 0.1 "dry" 0.9 } 1 "cost" { -3 }
p "" 1 2 "" { "pump" "stop" } 0
t "" 2 "" { 40 }
t "" 3 "" { 10 }
t "" 4 "" { 0 }
t "" 5 "" { 0.5 }
"""
SURE_GAIN = LOTTERY.replace('1/10 "lose" 9/10', '9/10 "lose" 1/10')


RARE_GAIN = """EFG 2 R "a rare gain" { "Solo" }
p "" 1 1 "" { "risk" "sure" } 0
c "" 1 "" { "win" 1/100 "lose" 99/100 } 0
t "" 1 "" { 1000 }
t "" 2 "" { 0 }
t "" 3 "" { 9 }
"""
RARE_LOSS = RARE_GAIN.replace("{ 1000 }", "{ -1000 }").replace("{ 9 }", "{ -9 }")
RARER_GAIN = RARE_GAIN.replace("1/100", "1/100000").replace("99/100", "99999/100000")
RARER_GAIN = RARER_GAIN.replace("{ 1000 }", "{ 1000000 }")
LATE_GAIN = """EFG 2 R "a rare gain after a second choice" { "Solo" }
p "" 1 1 "" { "risk" "sure" } 0
p "" 1 2 "" { "on" "back" } 0
c "" 1 "" { "win" 1/100 "lose" 99/100 } 0
t "" 1 "" { 1000 }
t "" 2 "" { 0 }
t "" 3 "" { 0 }
t "" 4 "" { 9 }
"""


def make_provider(folder: Path, text: str, seed: int) -> HintProvider:
    pytest.importorskip("pyspiel")
    path = folder / "game.efg"
    path.write_text(text)
    session = Session(load_problem(str(path)), SeededUniforms(seed), [None])
    return HintProvider(session, AdviceQuestion(0, None))


@pytest.mark.parametrize(("text", "wrong"), [(LOTTERY, "pass"), (TWO_STAGES, "sell")])
def test_a_search_recommends_no_action_that_chance_made_look_good(
    tmp_path: Path, text: str, wrong: str
) -> None:
    providers = [make_provider(tmp_path, text, seed) for seed in range(8)]
    hints = [provider.create_hint() for provider in providers]
    assert not any(hint.endswith(f": {wrong}") for hint in hints)
    assert sum("too close to call; mean return (standard error): " in hint for hint in hints) >= 6


@pytest.mark.parametrize(
    ("text", "wrong"),
    [(RARE_GAIN, "sure"), (RARE_LOSS, "risk"), (RARER_GAIN, "sure"), (LATE_GAIN, "sure")],
)
def test_a_search_claims_nothing_that_a_missed_outcome_could_change(
    tmp_path: Path, text: str, wrong: str
) -> None:
    hints = [make_provider(tmp_path, text, seed).create_hint() for seed in range(10)]
    assert not any(hint.endswith(f": {wrong}") for hint in hints)
    assert any(hint.endswith("; 64 samples of each may miss rare outcomes") for hint in hints)


def test_a_search_recommends_an_action_that_leads_clearly(tmp_path: Path) -> None:
    for seed in range(4):
        provider = make_provider(tmp_path, SURE_GAIN, seed)
        assert provider.create_hint().startswith(
            "hint by search: buy. mean return (standard error): "
        )
        hint = provider.current_hint
        assert hint is not None
        assert hint.data["accuracy"] == "estimated"
        assert [*hint.values_data["standard_errors"]] == ["buy", "pass"]
        assert hint.ranked_actions == []  # differences of estimates are no regrets
        reasons = explain_action(provider)
        assert reasons.data["standard_error"] == hint.values_data["standard_errors"]["buy"]
        assert reasons.sentences[0].startswith("The best action buy is worth about ")


def test_every_question_says_that_estimates_are_too_close(tmp_path: Path) -> None:
    provider = make_provider(tmp_path, LOTTERY, 1)
    provider.create_hint()
    hint = provider.current_hint
    assert hint is not None
    assert hint.action is None
    assert hint.data["action"] is None
    assert str(hint.data["reason"]).startswith("too close to call; mean return")
    assert "too close to call" in provider.describe_choice()
    assert "too close to call" in str(explain_action(provider))
    assert "too close to call" in str(explain_action(provider, 0))


def test_an_estimate_must_lead_by_two_standard_errors() -> None:
    values = np.array([np.nan, 1.0, 2.0])
    for q, error, best in (
        (values, 0.3, [2]),
        (values, 0.4, [1, 2]),
        (values[[0, 1, 1]], 0, [1, 2]),
    ):
        estimates = ActionValues(q, errors=np.array([np.inf, error, error]))
        assert estimates.best_actions.tolist() == best


@pytest.mark.parametrize(
    ("text", "verdict"),
    [
        (SURE_GAIN, "chose buy, the best action. "),
        (LOTTERY, "chose buy, not judged (too close to call). "),
    ],
)
def test_a_review_by_a_search_calls_no_overlapping_estimate_best(
    tmp_path: Path, text: str, verdict: str
) -> None:
    provider = make_provider(tmp_path, text, 1)
    provider.session.advance([0])
    assert not [*review_actions(provider.session, [provider.question])]
    (move,) = review_actions(provider.session, [provider.question], can_sample=True)
    assert verdict in str(move)
    assert move.regret == 0.0
    assert ("too close to call" in format_summary([move])) is move.is_too_close
    assert isinstance(move.data["standard_errors"], dict)
