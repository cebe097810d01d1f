"""Advice assumes one policy of the other agents, and a person can choose another one."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay import SeededUniforms, Session
from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import Accuracy
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.game import Game
from dmplay.game.game_setup import start_new_game
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.hints.review import format_table, review_actions
from dmplay.game.launch_requests import GameRequest
from dmplay.ui.shell.game_commands import (
    assume_player,
    preview_typed_action,
    show_belief,
    show_hint,
    show_values,
)
from tests.support.screens import make_game
from tests.support.soccer import Soccer

COOPERATE, DEFECT = 0, 1
FEED, SING, IGNORE = 0, 1, 2
SATED, HUNGRY = 0, 1


def test_an_outcome_is_forecast_with_the_rule_that_the_opponent_plays() -> None:
    game = make_game("prisoners-dilemma", "human", "tit-for-tat")
    assert preview_typed_action(game, "defect") == (
        "if defect against tit-for-tat: reward 0, as the other agent chooses cooperate"
    )
    game.choose(DEFECT)
    assert preview_typed_action(game, "cooperate") == (
        "if cooperate against tit-for-tat: reward -4, as the other agent chooses defect"
    )


def test_the_known_choices_of_several_agents_are_listed(tmp_path: Path) -> None:
    path = tmp_path / "three.nfg"
    payoffs = "1 1 1 0 2 0 2 0 0 1 1 3 0 0 0 4 4 1 1 0 2 3 3 3"
    path.write_text(f'NFG 1 R "" {{ "a" "b" "c" }} {{ 2 2 2 }}\n{payoffs}\n')
    game = make_game(str(path), "human", "equilibrium", "equilibrium", turns=1)
    assert preview_typed_action(game, "1") == (
        "if 1 against equilibrium: reward 1, as the other agents choose 1 and 1"
    )


def test_an_unknown_opponent_is_forecast_from_the_posterior_over_the_rules() -> None:
    # Of the eleven rules two defect first: suspicious-tit-for-tat and always-defect. Random and
    # nash defect in half of the games and always.
    game = make_game("prisoners-dilemma", "human", "human")
    line = preview_typed_action(game, "cooperate")
    assert line.startswith(
        "if cooperate and agent2 plays one of 11 rules: reward -1 if cooperate ("
    )
    assert line.endswith("; -1.682 on average")  # (8 + 0.5) / 11 cooperate, 2.5 / 11 defect
    assert pytest.approx(-1 * 8.5 / 11 - 4 * 2.5 / 11, abs=5e-4) == -1.682


@pytest.mark.parametrize("prey", ["flee", "random", "chase"])
def test_a_prey_is_forecast_with_the_policy_that_the_hint_assumes(prey: str) -> None:
    game = make_game("predator-prey", "human", prey)
    outcomes = forecast(game, "e")
    assert sum(outcomes.values()) == pytest.approx(1.0)
    expected: dict[tuple[int, ...], float] = {}
    problem, state = game.problem, game.session.state
    policy = dmplay.load_agent(problem, 1, prey)
    moves = (
        np.arange(6)
        if prey == "random"
        else policy.choose(policy.initial_memory(state[None]), None, np.zeros((1, 0)))
    )
    for move in moves:
        p, outcome = dmplay.enumerate_outcomes(problem, state[None], np.array([[0, move]]))
        for probability, successor in zip(p[0], outcome.state[0], strict=True):
            key = tuple(successor.tolist())
            expected[key] = expected.get(key, 0.0) + probability / len(moves)
    assert outcomes == pytest.approx({key: p for key, p in expected.items() if p})


def forecast(game: Game, action: str) -> dict[tuple[int, ...], float]:
    """Return the probability of each next state after an action."""
    preview_typed_action(game, action)
    outlook = game.hint_provider.current_forecast
    assert outlook is not None
    states = map(tuple, outlook.outcomes.tolist())
    return dict(zip(states, outlook.probabilities.tolist(), strict=True))


def test_hint_values_and_forecast_assume_the_agent_that_a_person_chooses() -> None:
    game = make_game("prisoners-dilemma", "human", "tit-for-tat", turns=5)
    assert "against tit-for-tat): cooperate. " in show_hint(game, "")
    assert assume_player(game, "always-defect") == "hints now give advice against always-defect"
    assert show_hint(game, "").startswith(
        "hint by plan-rounds (5 turns left, against always-defect): defect. "
    )
    assert show_values(game, "") == (
        "conditional values (5 turns left, against always-defect): cooperate -16.00, defect -15.00"
    )
    assert preview_typed_action(game, "cooperate") == (
        "if cooperate against always-defect: reward -4, as the other agent chooses defect"
    )
    assert assume_player(game, "actual") == "hints now give advice against tit-for-tat"
    assert show_values(game, "") == (
        "exact values (5 turns left, against tit-for-tat): cooperate -4.00, defect -6.00"
    )


@pytest.mark.parametrize("opponent", ["", "random"])
@pytest.mark.parametrize(
    ("name", "partner", "assumed"),
    [
        ("multicaregiver-crying-baby", "feed-when-crying", "joint-plan"),
        ("predator-prey:triangle", "flee", "equilibrium"),
        ("prisoners-dilemma", "tit-for-tat", "always-defect"),
        ("chicken.nfg", "frequency", "always-cooperate"),
    ],
)
def test_the_word_actual_returns_to_the_agent_that_plays(
    tmp_path: Path, name: str, partner: str, assumed: str, opponent: str
) -> None:
    if name.endswith(".nfg"):
        path = tmp_path / name
        path.write_text('NFG 1 R "" { "a" "b" } { 2 2 }\n6 6 7 2 2 7 0 0\n')
        name = str(path)
    game = start_new_game(GameRequest(name, seed=3, turns=4, other_agent=opponent))
    actual = show_hint(game, "")
    players = f" {opponent or partner}"
    assert actual.partition(")")[0].partition(", belief ")[0].endswith(players)
    assert "exact values: " in actual
    what_if = preview_typed_action(game, "1")
    assert f" {assumed}" in assume_player(game, assumed)
    assert f" {assumed}" in show_hint(game, "").partition(")")[0]
    assert "conditional values: " in show_hint(game, "")
    assert f" {assumed}" in preview_typed_action(game, "1")
    assert assume_player(game, "actual").endswith(players)
    assert show_hint(game, "") == actual
    assert preview_typed_action(game, "1") == what_if
    game.finish()


def test_a_caregiver_may_assume_a_partner_that_feeds_a_crying_baby() -> None:
    # Both hear the same. After crying the partner feeds, so the baby is sated after the next turn.
    game = make_game("multicaregiver-crying-baby", "human", "human", turns=6)
    reply = assume_player(game, "feed-when-crying")
    assert reply == "hints now give advice if the partner plays feed-when-crying"
    while not game.session.turns or game.session.observation_after(0, len(game.session.turns)) != 0:
        game.session.advance([IGNORE, IGNORE])
    assert preview_typed_action(game, "ignore") == (
        "if ignore and the partner plays feed-when-crying: 1.00 quiet (then belief sated: 1.00)"
    )
    assert "if the partner plays feed-when-crying, belief " in show_hint(game, "")


def test_the_belief_beside_a_known_partner_is_that_of_the_hint() -> None:
    game = make_game("multicaregiver-crying-baby", "human", "feed-when-crying", turns=20)
    crying, quiet = range(2)
    heard = [quiet]
    while heard[-2:] != [crying, quiet]:  # The partner feeds after the crying.
        game.choose(IGNORE)
        heard = [int(o) for o in game.view().observations]
    assert game.view().belief.tolist() == [1.0, 0.0]
    assert game.session.current_beliefs()[0].tolist() != [1.0, 0.0]  # as in a transcript
    assert show_belief(game, "") == (
        "belief, as caregiver2 plays feed-when-crying: sated 1.000, hungry 0.000."
    )
    assert "belief sated 1.000, hungry 0.000" in show_hint(game, "")
    game.undo()
    assert len(game.view().beliefs or ()) == len(game.view().observations)


def test_a_belief_names_the_partner_that_it_assumes() -> None:
    game = make_game("multicaregiver-crying-baby", "human", "human", seed=3, turns=6)
    game.session.advance([FEED, IGNORE])
    game.session.advance([IGNORE, IGNORE])
    random_belief = show_belief(game, "")
    assert random_belief.startswith("belief, if the other agent acts at random: sated 0.")
    assume_player(game, "feed-when-crying")
    belief, assumed = show_belief(game, "").split(". ")
    assert f"{belief}." == random_belief
    assert assumed.startswith("if the partner plays feed-when-crying: belief sated ")
    assert assumed.removesuffix(".").replace(": ", ", ") in show_hint(game, "")
    assert assumed.partition("belief ")[2] != belief.partition(": ")[2]
    assert show_belief(make_game("crying-baby"), "") == "belief: sated 0.500, hungry 0.500."


@pytest.mark.parametrize(
    ("problem", "agent", "message"),
    [
        ("crying-baby", "feed", "assume: no other agent plays in this game"),
        ("predator-prey", "search", "the advice in this game cannot assume search"),
        ("collaborative-predator-prey", "qmdp", "the advice in this game cannot assume qmdp"),
    ],
)
def test_an_agent_that_the_advice_cannot_assume_is_refused(
    problem: str, agent: str, message: str
) -> None:
    game = make_game(problem)
    with pytest.raises(BadParameter, match=message):
        assume_player(game, agent)
    assert not game.assumed_players


def test_an_unknown_agent_is_refused_with_the_nearest_name() -> None:
    game = make_game("prisoners-dilemma")
    with pytest.raises(UnknownName, match="tit-for-tat"):
        assume_player(game, "tit-for-tot")
    assert not game.assumed_players


def test_a_zero_sum_hint_says_that_it_assumes_a_maximin_opponent() -> None:
    session = Session(Soccer(), SeededUniforms(3), turn_limit=3)
    players = ["human", "human"]
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, players))
    opponent = Soccer().agents[1]
    assert f"3 turns left, if {opponent} plays its maximin strategy): " in provider.create_hint()
    assert f" and {opponent} plays its maximin strategy: " in provider.forecast_action(0)
    session.advance([0, 0])
    (reviewed,) = review_actions(session, [AdviceQuestion.of_session(session, 0, players)])
    assert reviewed.basis.scope == f"if {opponent} plays its maximin strategy"


def test_bounds_give_no_regret() -> None:
    session = make_game("collaborative-predator-prey", turns=2).session
    session.advance([0, 0])
    question = AdviceQuestion.of_session(session, 0, ["human", "human"])
    (reviewed,) = review_actions(session, [question])
    assert reviewed.basis.accuracy is Accuracy.UPPER_BOUND
    assert reviewed.regret is None


def test_the_review_of_two_people_names_the_assumption_of_each() -> None:
    session = make_game("prisoners-dilemma", turns=1).session
    session.advance([DEFECT, COOPERATE])
    people = ["human", "human"]
    questions = [AdviceQuestion.of_session(session, seat, people) for seat in (0, 1)]
    header, *rows = format_table([*review_actions(session, questions)])
    assert "one of" not in header
    assert any("agent2 plays one of 11 rules" in row and "agent1" in row for row in rows)
    assert any("agent1 plays one of 11 rules" in row and "agent2" in row for row in rows)
