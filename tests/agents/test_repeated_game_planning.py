"""Plans of repeated games: exact against a known rule, and a posterior over rules else."""

from collections.abc import Callable
from itertools import product

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion, SeatPolicy
from dmplay.agents.repeated_game_planning import RepeatedGamePlan
from dmplay.agents.repeated_game_rules import REPEATED_GAME_RULES
from dmplay.core.policy import Policy
from dmplay.core.session import SeatedPolicy, Session
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.hints.review import format_summary, review_actions
from dmplay.registry.agents import find_hint_provider

COOPERATE, DEFECT = 0, 1
PAYOFFS = ((-1.0, -4.0), (0.0, -3.0))  # of agent1, by its own action and the other's
DETERMINISTIC_RULES = sorted({*REPEATED_GAME_RULES} - {"generous-tit-for-tat"})


def plan_against(
    name: str, turns: int, seat: int = 0, problem: str = "prisoners-dilemma"
) -> SeatPolicy:
    """Return the hint provider's policy in a game against one agent."""
    players = ["human", name] if seat == 0 else [name, "human"]
    agent = find_hint_provider(
        dmplay.load_problem(problem), AdviceQuestion(seat, turns, tuple(players))
    )
    assert agent is not None
    assert agent.name.startswith("plan-rounds")
    return agent.policy


def first_values(policy: SeatPolicy) -> list[float]:
    """Return the values of all actions before the first round."""
    values = policy.action_values(policy.initial_memory(np.zeros(1, np.int64)))
    assert values is not None
    return [float(value) for value in values[0]]


def play_script(rule: str, actions: tuple[int, ...], seat: int, problem: str) -> float:
    """Return the return of these actions against a rule, played out in a session."""
    loaded = dmplay.load_problem(problem)
    policies: list[Policy | None] = [None, None]
    policies[1 - seat] = dmplay.load_agent(loaded, 1 - seat, rule)
    session = Session(loaded, dmplay.SeededUniforms(1), policies, turn_limit=len(actions))
    for action in actions:
        choices: list[float | None] = [None, None]
        choices[seat] = action
        session.advance(choices)
    return float(sum(turn.rewards[seat] for turn in session.turns))


@pytest.mark.parametrize("seat", [0, 1])
@pytest.mark.parametrize("rule", DETERMINISTIC_RULES)
def test_values_equal_the_best_of_all_plans_against_a_deterministic_rule(
    rule: str, seat: int
) -> None:
    for turns in (1, 2, 5):
        returns = {
            actions: play_script(rule, actions, seat, "prisoners-dilemma")
            for actions in product((COOPERATE, DEFECT), repeat=turns)
        }
        best_returns = [
            max(value for actions, value in returns.items() if actions[0] == first)
            for first in (COOPERATE, DEFECT)
        ]
        assert first_values(plan_against(rule, turns, seat)) == pytest.approx(best_returns)


def test_values_against_beat_last_equal_the_best_of_all_plans() -> None:
    returns = {
        actions: play_script("beat-last", actions, 0, "rock-paper-scissors")
        for actions in product(range(3), repeat=4)
    }
    best_returns = [
        max(value for actions, value in returns.items() if actions[0] == first)
        for first in range(3)
    ]
    policy = plan_against("beat-last", 4, problem="rock-paper-scissors")
    assert first_values(policy) == pytest.approx(best_returns)


def best_value(
    turns: int, last_own_action: int, chance_of_defection: Callable[[int], float]
) -> float:
    """Return the best expected return against an opponent that reacts to the last action."""
    return max(
        value_of(action, turns, last_own_action, chance_of_defection)
        for action in (COOPERATE, DEFECT)
    )


def value_of(
    action: int, turns: int, last_own_action: int, chance_of_defection: Callable[[int], float]
) -> float:
    """Return the expected return of an action and the best ones after it."""
    if turns == 0:
        return 0.0
    defects = chance_of_defection(last_own_action)
    reward = (1 - defects) * PAYOFFS[action][COOPERATE] + defects * PAYOFFS[action][DEFECT]
    return reward + (best_value(turns - 1, action, chance_of_defection) if turns > 1 else 0.0)


@pytest.mark.parametrize("turns", [1, 2, 5, 20])
def test_values_against_a_rule_that_forgives_at_random_are_expectations(turns: int) -> None:
    if turns == 20:  # 19 rounds of cooperation cost 1 each, and the last defection is free
        assert first_values(plan_against("generous-tit-for-tat", 20)) == pytest.approx([-19, -20])
        return
    expected = [
        value_of(action, turns, COOPERATE, lambda last: 2 / 3 * (last == DEFECT))
        for action in (COOPERATE, DEFECT)
    ]
    assert first_values(plan_against("generous-tit-for-tat", turns)) == pytest.approx(expected)


def test_fifty_rounds_against_an_unknown_rule_are_planned() -> None:
    """The mean of 0 against `nash`, and of 49 to 50 against the two rules that can be guessed."""
    policy = plan_against("human", 50, problem="rock-paper-scissors")
    assert first_values(policy) == pytest.approx([98 / 3, 100 / 3, 96 / 3])


def test_cooperation_against_tit_for_tat_is_best_until_the_last_round() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    policies = [None, dmplay.load_agent(problem, 1, "tit-for-tat")]
    session = Session(problem, dmplay.SeededUniforms(1), policies)
    for _ in range(10):
        session.advance([COOPERATE, None])
    reviewed = [
        *review_actions(session, [AdviceQuestion.of_session(session, 0, ["human", "tit-for-tat"])])
    ]
    assert format_summary(reviewed).startswith("review: ")
    assert [move.regret for move in reviewed] == [0.0] * 9 + [1.0]


def test_nine_cooperations_and_one_defection_are_optimal_against_grim() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    policies = [None, dmplay.load_agent(problem, 1, "grim")]
    session = Session(problem, dmplay.SeededUniforms(1), policies)
    for action in [COOPERATE] * 9 + [DEFECT]:
        session.advance([action, None])
    assert (
        sum(
            move.regret or 0.0
            for move in review_actions(
                session, [AdviceQuestion.of_session(session, 0, ["human", "grim"])]
            )
        )
        == 0
    )


def test_against_a_person_the_hint_shows_the_posterior_over_the_rules_and_no_regret() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    session = Session(problem, dmplay.SeededUniforms(1), turn_limit=6)
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, ["human", "human"]))
    assert "if agent2 plays one of 11 rules, tit-for-tat 0.09, " in provider.create_hint()
    for own_action, other_action in ((DEFECT, COOPERATE), (DEFECT, DEFECT), (DEFECT, DEFECT)):
        session.advance([own_action, other_action])
    hint = provider.create_hint()
    assert "always-defect" not in hint
    assert "by plan-rounds (3 turns left, if agent2 plays one of 11 rules, " in hint
    assert provider.current_hint is not None
    assert provider.current_hint.regrets is None
    seated = SeatedPolicy(session, 0, plan_against("human", 6))
    policy = seated.policy
    assert isinstance(policy, RepeatedGamePlan)
    posterior = policy._infer_posterior(seated.current_memory())[0]
    by_rule = dict(zip(policy.candidate_rules, posterior.tolist(), strict=True))
    # tit-for-tat, grim and two-tits-for-tat answer D with D; one of three defections is forgiven
    weights = {name: 1.0 for name in ("tit-for-tat", "grim", "two-tits-for-tat", "majority")}
    weights |= {"generous-tit-for-tat": (2 / 3) ** 2, "random": 1 / 8}
    total = sum(weights.values())
    for name, probability in by_rule.items():
        assert probability == pytest.approx(weights.get(name, 0.0) / total), name
