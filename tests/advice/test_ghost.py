"""An agent on a person's dice: the same draws, the same others, an end of its own."""

import numpy as np
import pytest

import dmplay
from dmplay.advice.ghost import Ghost, create_best_ghost, create_ghost, describe_ghost_result
from dmplay.errors import BadParameter
from dmplay.session import Session
from tests.support.games import Scripted


def played(name: str, *words: str, seed: int = 7, limit: int | None = None) -> Session:
    """A game of a person in the first seat, and of random agents in the others."""
    problem = dmplay.load_problem(name)
    others = [dmplay.load_agent(problem, seat, "random") for seat in range(1, len(problem.agents))]
    session = Session(problem, dmplay.SeededUniforms(seed), [None, *others], turn_limit=limit)
    for word in words:
        session.advance([problem.parse_action(0, word), *[None] * len(others)])
    return session


def ghost(session: Session, name: str) -> Ghost:
    return Ghost(name, session, {0: dmplay.load_agent(session.problem, 0, name)})


def alone(name: str, agent: str, seed: int = 7, limit: int | None = None) -> Session:
    """The game that an agent plays with nobody beside."""
    problem = dmplay.load_problem(name)
    session = Session(
        problem,
        dmplay.SeededUniforms(seed),
        [dmplay.load_agent(problem, 0, agent)],
        turn_limit=limit,
    )
    while not session.over:
        session.advance()
    return session


def test_a_ghost_plays_the_game_that_the_agent_plays_under_this_seed() -> None:
    session = played("hexworld", "w", "w")
    other = ghost(session, "optimal")
    other.play_to_end()
    expected = alone("hexworld", "optimal")
    assert [turn.state for turn in other.session.turns] == [one.state for one in expected.turns]
    assert other.score == expected.returns()[0]


def test_a_ghost_comes_as_far_as_the_person_and_back() -> None:
    session = played("hexworld", "w", "w")
    other = ghost(session, "optimal")
    other.catch_up()
    assert len(other.session.turns) == 2
    session.undo()
    other.catch_up()
    assert len(other.session.turns) == 1


def test_dice_that_are_thrown_anew_are_thrown_for_the_ghost_too() -> None:
    session = played("hexworld", "w", "w")
    other = ghost(session, "optimal")
    other.catch_up()
    session.reroll()
    other.catch_up()
    for own, theirs in zip(other.session.turns, session.turns, strict=True):
        assert np.array_equal(own.uniforms, theirs.uniforms)


def test_a_ghost_that_is_at_its_end_waits_there() -> None:
    other = ghost(played("hexworld", *["w"] * 30), "optimal")
    other.catch_up()
    assert other.session.end_reason == "terminal"
    assert len(other.session.turns) < 30


def test_others_answer_the_ghost_and_not_the_person() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    partner = dmplay.load_agent(problem, 1, "tit-for-tat")
    session = Session(problem, dmplay.SeededUniforms(7), [None, partner], turn_limit=3)
    for _ in range(3):
        session.advance([problem.parse_action(0, "defect"), None])
    other = ghost(session, "always-cooperate")
    other.play_to_end()
    assert [turn.actions.tolist() for turn in other.session.turns] == [[0, 0]] * 3
    assert other.player_lead == session.returns()[0] - other.score


@pytest.mark.parametrize(
    ("name", "early"),
    [("hexworld", True), ("2048", True), ("crying-baby", False), ("prisoners-dilemma", False),
     ("predator-prey", False)],
)  # fmt: skip
def test_a_ghost_is_seen_early_only_where_nothing_is_secret(name: str, early: bool) -> None:
    assert ghost(played(name), "random").is_shown_during_play == early


def test_the_same_dice_tell_what_both_came_to() -> None:
    session = played("crying-baby", "sing", "sing", limit=2)
    assert (
        describe_ghost_result(session, [0], ["human"], None)
        == "optimal on the same dice: -15; you -19.95"
    )


def test_the_same_dice_are_silent_where_the_draws_are_not_those_of_the_seed() -> None:
    session = played("hexworld", "w", "w")
    assert create_best_ghost(session, [0], ["human"])
    session.reroll()
    assert describe_ghost_result(session, [0], ["human"], None) == ""
    problem = dmplay.load_problem("hexworld")
    scripted = Session(problem, dmplay.SeededUniforms(7), initial_uniforms=np.array([0.5]))
    assert describe_ghost_result(scripted, [0], ["human"], None) == ""
    assert describe_ghost_result(Session(problem, Scripted([0.5])), [0], ["human"], None) == ""


def test_the_same_dice_are_silent_where_people_play_against_each_other() -> None:
    assert create_best_ghost(played("prisoners-dilemma"), [0, 1], ["human", "human"]) is None
    assert create_best_ghost(played("collaborative-predator-prey"), [0, 1], ["human"] * 2)


def test_where_two_choose_at_once_the_best_reply_plays_the_same_dice() -> None:
    game = played("prisoners-dilemma", "cooperate", limit=1)
    told = describe_ghost_result(game, [0], ["human", "random"], None)
    assert told == "best-response on the same dice: -3; you -4"


@pytest.mark.parametrize(
    ("name", "who", "agent", "why"),
    [
        ("hexworld", [], "optimal", "--ghost: it plays beside a person, and here agents play"),
        ("prisoners-dilemma", [0, 1], "grim", "--ghost: it plays beside one person, and here"),
        ("hexworld", [0], "human", "--ghost: got 'human', expected one of optimal, "),
        ("hexworld", [0], "script:e", "--ghost: got 'script:e', expected one of optimal, "),
    ],
)
def test_where_no_ghost_can_be_it_is_refused(
    name: str, who: list[int], agent: str, why: str
) -> None:
    with pytest.raises(BadParameter, match=why):
        create_ghost(played(name), who, agent)


def test_a_team_has_a_ghost_in_each_of_its_seats() -> None:
    session = Session(
        dmplay.load_problem("collaborative-predator-prey"), dmplay.SeededUniforms(7), turn_limit=2
    )
    team = create_ghost(session, [0, 1], "random")
    team.play_to_end()
    assert len(team.session.turns) == 2
