"""Tests of the ghost: an agent that plays beside a person on the same uniforms."""

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.session import Session
from dmplay.errors import BadParameter
from dmplay.game.hints.ghost_agent import Ghost, create_best_ghost, create_ghost, play_ghost
from tests.support.games import ScriptedUniforms


def describe_ghost_result(
    session: Session, questions: list[AdviceQuestion], ghost: Ghost | None
) -> str:
    opponent = play_ghost(session, questions, ghost)
    return opponent.describe_comparison() if opponent else ""


def play_actions(name: str, *action_names: str, seed: int = 7, limit: int | None = None) -> Session:
    """Play a game with a person in the first seat and random agents in the others."""
    problem = dmplay.load_problem(name)
    others = [dmplay.load_agent(problem, seat, "random") for seat in range(1, len(problem.agents))]
    session = Session(problem, dmplay.SeededUniforms(seed), [None, *others], turn_limit=limit)
    for action_name in action_names:
        session.advance([problem.parse_action(0, action_name), *[None] * len(others)])
    return session


def make_ghost(session: Session, name: str) -> Ghost:
    return Ghost(name, session, {0: dmplay.load_agent(session.problem, 0, name)})


def play_agent_game(name: str, agent: str, seed: int = 7, limit: int | None = None) -> Session:
    """Play an agent's whole game without a ghost."""
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


def test_a_ghost_plays_the_same_game_as_its_agent_with_this_seed() -> None:
    session = play_actions("hexworld", "w", "w")
    agent_ghost = make_ghost(session, "optimal")
    agent_ghost.play_to_end()
    expected = play_agent_game("hexworld", "optimal")
    assert [turn.state for turn in agent_ghost.session.turns] == [
        expected_turn.state for expected_turn in expected.turns
    ]
    assert agent_ghost.score == expected.returns()[0]


def test_a_ghost_follows_the_person_forward_and_back() -> None:
    session = play_actions("hexworld", "w", "w")
    agent_ghost = make_ghost(session, "optimal")
    agent_ghost.catch_up()
    assert len(agent_ghost.session.turns) == 2
    session.undo()
    agent_ghost.catch_up()
    assert len(agent_ghost.session.turns) == 1


def test_rerolled_uniforms_apply_to_the_ghost_too() -> None:
    session = play_actions("hexworld", "w", "w")
    agent_ghost = make_ghost(session, "optimal")
    agent_ghost.catch_up()
    session.reroll()
    agent_ghost.catch_up()
    for ghost_turn, player_turn in zip(agent_ghost.session.turns, session.turns, strict=True):
        assert np.array_equal(ghost_turn.uniforms, player_turn.uniforms)


def test_a_ghost_stops_when_its_game_ends() -> None:
    agent_ghost = make_ghost(play_actions("hexworld", *["w"] * 30), "optimal")
    agent_ghost.catch_up()
    assert agent_ghost.session.end_reason == "terminal"
    assert len(agent_ghost.session.turns) < 30


def test_opponents_of_the_ghost_respond_to_the_ghost_and_not_to_the_person() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    partner = dmplay.load_agent(problem, 1, "tit-for-tat")
    session = Session(problem, dmplay.SeededUniforms(7), [None, partner], turn_limit=3)
    for _ in range(3):
        session.advance([problem.parse_action(0, "defect"), None])
    agent_ghost = make_ghost(session, "always-cooperate")
    agent_ghost.play_to_end()
    assert [turn.actions.tolist() for turn in agent_ghost.session.turns] == [[0, 0]] * 3
    assert agent_ghost.player_lead == session.returns()[0] - agent_ghost.score


@pytest.mark.parametrize(
    ("name", "shown_during_play"),
    [("hexworld", True), ("2048", True), ("crying-baby", False), ("prisoners-dilemma", False),
     ("predator-prey", False)],
)  # fmt: skip
def test_a_ghost_is_shown_during_play_only_if_nothing_is_hidden(
    name: str, shown_during_play: bool
) -> None:
    assert make_ghost(play_actions(name), "random").is_shown_during_play == shown_during_play


def test_the_ghost_result_compares_both_scores() -> None:
    session = play_actions("crying-baby", "sing", "sing", limit=2)
    assert (
        describe_ghost_result(session, [AdviceQuestion.of_session(session, 0, ["human"])], None)
        == "same start and luck: optimal scored -19, you -19.95"
    )


def test_there_is_no_ghost_result_if_the_uniforms_are_not_those_of_the_seed() -> None:
    session = play_actions("hexworld", "w", "w")
    assert create_best_ghost(session, [AdviceQuestion.of_session(session, 0, ["human"])])
    session.reroll()
    assert (
        describe_ghost_result(session, [AdviceQuestion.of_session(session, 0, ["human"])], None)
        == ""
    )
    problem = dmplay.load_problem("hexworld")
    scripted = Session(problem, dmplay.SeededUniforms(7), initial_uniforms=np.array([0.5]))
    assert (
        describe_ghost_result(scripted, [AdviceQuestion.of_session(scripted, 0, ["human"])], None)
        == ""
    )
    assert (
        describe_ghost_result(
            Session(problem, ScriptedUniforms([0.5])), [AdviceQuestion(0, None, ("human",))], None
        )
        == ""
    )


def test_there_is_no_ghost_result_if_people_play_against_each_other() -> None:
    dilemma, hunt = play_actions("prisoners-dilemma"), play_actions("collaborative-predator-prey")
    people = ["human", "human"]
    assert (
        create_best_ghost(dilemma, [AdviceQuestion.of_session(dilemma, i, people) for i in (0, 1)])
        is None
    )
    assert create_best_ghost(hunt, [AdviceQuestion.of_session(hunt, i, people) for i in (0, 1)])


def test_the_ghost_of_a_simultaneous_game_is_the_best_response() -> None:
    session = play_actions("prisoners-dilemma", "cooperate", limit=1)
    message = describe_ghost_result(
        session, [AdviceQuestion.of_session(session, 0, ["human", "random"])], None
    )
    assert message == "plan-rounds scored -3, you -4"


def test_a_named_ghost_plans_for_the_turns_of_the_game() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    partner = dmplay.load_agent(problem, 1, "tit-for-tat")
    session = Session(problem, dmplay.SeededUniforms(7), [None, partner], turn_limit=3)
    for _ in range(3):
        session.advance([problem.parse_action(0, "cooperate"), None])
    ghost = create_ghost(session, [0], "plan-rounds")
    ghost.play_to_end()
    assert ghost.name == "plan-rounds"  # it defects in the last round, which has no reply
    assert ghost.describe_comparison() == "plan-rounds scored -2, you -3"


@pytest.mark.parametrize(
    ("name", "agent", "turns", "label"),
    [
        ("crying-baby", "optimal", 20, "optimal (turn limit ignored)"),
        ("2048", "expectimax", 1, "expectimax (turn limit ignored)"),
        ("2048", "random", 1, "random"),
        ("catch", "optimal", 5, "optimal"),
        ("hexworld", "optimal", None, "optimal"),
    ],
)
def test_a_named_ghost_says_if_it_ignores_the_turn_limit(
    name: str, agent: str, turns: int | None, label: str
) -> None:
    ghost = create_ghost(play_actions(name, limit=turns), [0], agent)
    assert (ghost.name, ghost.label) == (agent, label)


@pytest.mark.parametrize(
    ("name", "human_seats", "agent", "message"),
    [
        ("hexworld", [], "optimal", "--ghost: needs a human player; only agents play"),
        ("prisoners-dilemma", [0, 1], "grim", "--ghost: needs one human player; several"),
        ("hexworld", [0], "human", "--ghost: got 'human', expected one of optimal, "),
        ("hexworld", [0], "script:e", "--ghost: got 'script:e', expected one of optimal, "),
    ],
)
def test_an_impossible_ghost_is_rejected(
    name: str, human_seats: list[int], agent: str, message: str
) -> None:
    with pytest.raises(BadParameter, match=message):
        create_ghost(play_actions(name), human_seats, agent)


def test_a_team_has_a_ghost_in_each_of_its_seats() -> None:
    session = Session(
        dmplay.load_problem("collaborative-predator-prey"), dmplay.SeededUniforms(7), turn_limit=2
    )
    team = create_ghost(session, [0, 1], "random")
    team.play_to_end()
    assert len(team.session.turns) == 2
