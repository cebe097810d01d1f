"""Hints, reviews and grades are about the game being played, or say which other game."""

import json
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion, SeatPolicy
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.core.action_values import Accuracy
from dmplay.core.session import Session
from dmplay.evaluation.grading import grade_files
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_new_game
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.hints.review import format_summary, review_actions
from dmplay.game.launch_requests import GameRequest
from dmplay.problems.multicaregiver_crying_baby.agents import BestResponse
from dmplay.registry.agents import find_hint_provider, load_roster
from dmplay.ui.shell.commands import run_line
from tests.support.literature_dec_pomdps import format_dectiger, parse_team_file
from tests.support.programs import run_dmplay
from tests.support.random_problems import RandomGame, RandomRivalGame
from tests.support.screens import make_game
from tests.support.turn_based_games import Nim

BABY = "crying-baby"


def give_hint(name: str, *, turns: int | None = None, seats: tuple[str, ...] = ()) -> str:
    """Return the first hint of a game for its first seat."""
    problem = dmplay.load_problem(name)
    session = Session(problem, dmplay.SeededUniforms(7), turn_limit=turns)
    return HintProvider(session, AdviceQuestion.of_session(session, 0, seats)).create_hint()


def play_rounds(name: str, opponent: str, actions: list[float]) -> Session:
    """Return a finished game of a person against an agent."""
    problem = dmplay.load_problem(name)
    other = "random" if opponent == "human" else opponent
    policies = [None, dmplay.load_agent(problem, 1, other)]
    session = Session(problem, dmplay.SeededUniforms(1), policies, turn_limit=len(actions))
    for action in actions:
        session.advance([action, None])
    return session


def test_feeding_in_the_last_turn_only_costs_the_effort() -> None:
    session = Session(dmplay.load_problem(BABY), dmplay.SeededUniforms(5))
    for _ in range(19):
        session.advance([2])
    hint = HintProvider(session, AdviceQuestion.of_session(session, 0, ["human"])).create_hint()
    assert hint == (
        "hint by optimal (1 turn left): ignore. "
        "exact values: feed -15.00, sing -10.50, ignore -10.00"
    )
    session.advance([2])
    (*_, last) = review_actions(session, [AdviceQuestion.of_session(session, 0, ["human"])])
    assert (last.best, last.regret) == (("ignore",), 0.0)


def test_the_values_of_the_first_turn_are_those_of_all_twenty() -> None:
    problem = dmplay.load_problem(BABY)
    policy = dmplay.load_agent(problem, 0, "optimal:horizon=20")
    endless = dmplay.load_agent(problem, 0, "optimal")
    start = np.full(1, -1)
    finite, infinite = (
        agent.action_values(agent.initial_memory(start)) for agent in (policy, endless)
    )
    assert finite is not None
    assert infinite is not None
    assert (finite > infinite).all()  # fewer turns cost less


@pytest.mark.parametrize(
    ("name", "turns", "hint"),
    [
        ("hexworld", None, "hint by optimal: "),
        ("hexworld", 2, "hint by optimal (2 turns left): "),
        ("crying-baby", 101, "hint by optimal (turn limit ignored): "),
        ("2048", None, "hint by expectimax: "),
        ("2048", 3, "hint by expectimax (turn limit ignored): "),
        ("mountain-car", 3, "hint by optimal (turn limit ignored): "),
        ("collision-avoidance", None, "hint by optimal: "),
        ("collision-avoidance", 3, "hint by optimal (turn limit ignored): "),
        ("cart-pole", None, "hint by regulate (at most 50 turns ahead): "),
        ("cart-pole", 5, "hint by regulate (5 turns left): "),
        ("cart-pole", 1, "hint by regulate (1 turn left): "),
        ("catch", None, "hint by optimal (10 turns left): "),
        ("catch", 11, "hint by optimal (11 turns left): "),
        ("catch", 21, "hint by optimal (10 turns left in plans of 10 turns): "),
        ("machine-replacement", 101, "hint by optimal (20 turns left in plans of 20 turns): "),
        (
            "predator-prey",
            2,
            "hint by best-response (2 turns left, if the other agent plays flee): ",
        ),
        (
            "collaborative-predator-prey",
            None,
            "hint by qmdp (50 turns left, belief as if partners moved at random, "
            "why lists its assumptions): sw. ",
        ),
        (
            "prisoners-dilemma",
            None,
            "hint by plan-rounds (10 turns left, if agent2 plays one of 11 rules, ",
        ),
        (
            "prisoners-dilemma",
            1,
            "hint by plan-rounds (1 turn left, if agent2 plays one of 11 rules, ",
        ),
    ],
)
def test_a_hint_is_about_the_turns_left_or_says_what_it_is_about(
    name: str, turns: int | None, hint: str
) -> None:
    assert give_hint(name, turns=turns).startswith(hint)


@pytest.mark.parametrize(
    ("name", "turns", "hint"),
    [
        (BABY, 2000, "hint by plan (10 turns ahead): "),
        (
            "multicaregiver-crying-baby",
            20,
            "hint by best-response (20 turns left, assuming a random partner): ",
        ),
    ],
)
def test_without_a_discount_a_hint_says_how_far_it_looks(name: str, turns: int, hint: str) -> None:
    problem = dmplay.load_problem(name, discount=1.0)
    session = Session(problem, dmplay.SeededUniforms(7), turn_limit=turns)
    assert (
        HintProvider(
            session, AdviceQuestion.of_session(session, 0, ["human"] * len(problem.agents))
        )
        .create_hint()
        .startswith(hint)
    )


def test_an_equilibrium_of_a_game_without_end_says_so_in_a_game_with_an_end() -> None:
    session = Session(RandomGame(), dmplay.SeededUniforms(7), turn_limit=3)
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, ["human", "human"]))
    assert provider.create_hint().startswith(
        "hint by equilibrium (turn limit ignored, if the other "
    )
    overlay = provider.build_overlay("values")
    assert overlay is not None
    assert np.isfinite(overlay.action_values).any()


def test_the_last_move_of_a_hunt_pays_only_itself() -> None:
    problem = dmplay.load_problem("predator-prey")
    policy = dmplay.load_agent(problem, 0, "best-response:horizon=3")
    states = problem.enumerate_states()
    last = policy.action_values((states, np.full(len(states), 2)))
    assert last is not None
    assert last.min() >= -1.0 - 1e-9
    first = policy.action_values(policy.initial_memory(states))
    assert first is not None
    assert first.min() < last.min()


def test_a_plan_of_a_team_has_no_values_after_the_person_left_it() -> None:
    listen, open_left = 0, 1
    players = ["human", "human"]
    session = Session(parse_team_file(format_dectiger()), dmplay.SeededUniforms(1), turn_limit=3)
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, players))
    assumption = "if the whole team follows the plan"
    assert provider.create_hint().startswith(
        f"hint by joint-plan (3 turns left, {assumption}): listen. conditional "
    )
    session.advance([listen, listen])
    assert "conditional values: listen " in provider.create_hint()
    session.undo()
    session.advance([open_left, listen])  # the tiger moves, which the plan does not expect
    assert provider.create_hint() == (
        f"hint by joint-plan (2 turns left, {assumption}, "
        "no values since the plan was left or began again): listen"
    )
    session.advance([listen, listen])
    question = AdviceQuestion.of_session(session, 0, players)
    assert [move.turn for move in review_actions(session, [question])] == [1]


def test_advice_beside_a_plan_goes_on_after_the_person_left_the_plan() -> None:
    listen, open_left = 0, 1
    players = ["human", "joint-plan:horizon=3"]
    session = Session(parse_team_file(format_dectiger()), dmplay.SeededUniforms(1), turn_limit=3)
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, players))
    session.advance([open_left, listen])
    hint = provider.create_hint()
    assert hint.startswith("hint by best-response (2 turns left, with joint-plan:horizon=3, belief")
    assert ": listen. exact values: listen " in hint
    session.advance([listen, listen])
    question = AdviceQuestion.of_session(session, 0, players)
    assert [move.turn for move in review_actions(session, [question])] == [1, 2]


@pytest.mark.parametrize(
    ("opponent", "players"),
    [
        ("optimal:horizon=2", ""),
        ("optimal", "against optimal"),
        ("random", "against random"),
        ("search", "if "),
    ],
)
def test_values_assume_the_opponent_of_the_game_unless_it_searches(
    opponent: str, players: str
) -> None:
    for game in (RandomRivalGame(), Nim()):
        agent = find_hint_provider(game, AdviceQuestion(0, 2, ("human", opponent)))
        assert agent is not None
        assert agent.basis.players.startswith(players)
        assert (agent.basis.accuracy is Accuracy.EXACT) is (opponent != "search")
        assert (agent.basis.scope == "") is (opponent != "search")


def test_values_of_all_states_are_those_of_the_turns_left() -> None:
    problem = dmplay.load_problem("hexworld")
    session = Session(problem, dmplay.SeededUniforms(7), turn_limit=2)
    provider = HintProvider(session, AdviceQuestion.of_session(session, 0, ["human"]))
    before = provider.build_overlay("values")
    assert provider.is_overlay_ready
    session.advance([0])
    after = provider.build_overlay("values")
    assert before is not None
    assert after is not None
    assert not np.array_equal(before.action_values, after.action_values)
    first_again = provider.build_overlay("values", 0)
    assert first_again is not None
    assert np.array_equal(first_again.action_values, before.action_values)
    session.advance([0])
    assert provider.build_overlay("values") is None  # no turn is left
    assert provider.describe_game(1) == "1 turn left"


def test_listed_values_say_what_they_are_about() -> None:
    session = Session(dmplay.load_problem(BABY), dmplay.SeededUniforms(5), turn_limit=300)
    assert (
        HintProvider(session, AdviceQuestion.of_session(session, 0))
        .format_values()
        .full_values_text.startswith("exact values (turn limit ignored): feed ")
    )
    session = Session(dmplay.load_problem(BABY), dmplay.SeededUniforms(5))
    assert (
        HintProvider(session, AdviceQuestion.of_session(session, 0))
        .format_values()
        .full_values_text.startswith("exact values (20 turns left): feed ")
    )


@pytest.mark.parametrize(
    ("opponent", "first_values", "regrets"),
    [
        ("tit-for-tat", "cooperate -9.00, defect -11.00", [0.0] * 9 + [1.0]),
        ("grim", "cooperate -9.00, defect -27.00", [0.0] * 9 + [1.0]),
        ("best-response", "cooperate -31.00, defect -30.00", [1.0] * 10),
    ],
)
def test_regrets_count_the_rounds_left_against_a_known_rule(
    opponent: str, first_values: str, regrets: list[float]
) -> None:
    session = play_rounds("prisoners-dilemma", opponent, [0.0] * 10)
    reviewed = list(
        review_actions(session, [AdviceQuestion.of_session(session, 0, ["human", opponent])])
    )
    assert [move.regret for move in reviewed] == regrets
    assert str(reviewed[0]).endswith(
        f"exact values (10 turns left, against {opponent}): {first_values}"
    )


@pytest.mark.parametrize("opponent", ["human", "search"])
def test_no_move_has_a_regret_against_an_unknown_rule(opponent: str) -> None:
    session = play_rounds("prisoners-dilemma", opponent, [0.0] * 10)
    reviewed = list(
        review_actions(session, [AdviceQuestion.of_session(session, 0, ["human", opponent])])
    )
    assert {move.regret for move in reviewed} == {None}
    unknown = " and not search" * (opponent != "human")
    assert f"(if agent2 plays one of 11 rules{unknown})" in format_summary(reviewed)
    assert format_summary(reviewed).endswith(
        "no regret, because the values are not exactly about this game"
    )


@pytest.mark.parametrize(
    ("name", "opponent", "is_exact"),
    [
        ("rock-paper-scissors", "nash", True),
        ("rock-paper-scissors", "human", False),
        ("rock-paper-scissors", "gradient-ascent", True),
        ("rock-paper-scissors", "search", False),
        ("travelers-dilemma", "random", True),
        ("travelers-dilemma", "best-response", False),  # it has too many memories to plan against
        ("prisoners-dilemma", "always-defect", True),
        ("prisoners-dilemma", "generous-tit-for-tat:forgiveness=0.5", True),
        ("prisoners-dilemma", "script:cooperate", False),
        ("prisoners-dilemma", "bot:./mine", False),
    ],
)
@pytest.mark.parametrize("turns", [1, 10])
def test_values_have_regrets_only_against_a_rule_that_can_be_planned_against(
    name: str, opponent: str, turns: int, *, is_exact: bool
) -> None:
    hint_agent = find_hint_provider(
        dmplay.load_problem(name), AdviceQuestion(0, turns, ("human", opponent))
    )
    assert hint_agent is not None
    assert hint_agent.basis.has_regrets is (is_exact or (turns, opponent) == (1, "best-response"))


@pytest.mark.parametrize(
    ("name", "opponent", "players"),
    [
        ("predator-prey", "flee", "against flee"),
        ("predator-prey", "random", "against random"),
        ("predator-prey", "human", "if the other agent plays flee"),
        ("predator-prey", "search", "if the other agent plays flee"),
        ("predator-prey", "equilibrium", "against equilibrium"),
        ("multicaregiver-crying-baby", "random", "with random"),
        ("multicaregiver-crying-baby", "feed-when-crying", "with feed-when-crying"),
        ("multicaregiver-crying-baby", "search", "assuming a random partner"),
        ("multicaregiver-crying-baby", "human", "assuming a random partner"),
    ],
)
def test_hint_values_and_review_name_the_other_players(
    name: str, opponent: str, players: str
) -> None:
    seats = ["human", opponent]
    session = play_rounds(name, opponent, [0.0] * 2)
    provider = HintProvider(session.copy_at_start(), AdviceQuestion.of_session(session, 0, seats))
    by, _, _ = provider.create_hint().partition("): ")
    assert by.partition(", belief ")[0] == f"hint by best-response (2 turns left, {players}"
    is_real = players.startswith(("against", "with"))
    name = "exact values" if is_real else "conditional values"
    assert provider.format_values().full_values_text.startswith(
        f"{name} (2 turns left, {players}): "
    )
    reviewed = [*review_actions(session, [AdviceQuestion.of_session(session, 0, seats)])]
    assert [move.about for move in reviewed] == [
        f"2 turns left, {players}",
        f"1 turn left, {players}",
    ]
    assert {move.basis.scope for move in reviewed} == {players * (not is_real)}


@pytest.mark.parametrize(
    ("name", "turns", "unknown"),
    [
        ("prisoners-dilemma", 10, {"search"}),
        ("rock-paper-scissors", 10, {"search"}),
        ("travelers-dilemma", 2, {"search"}),
        ("travelers-dilemma", 3, {"gradient-ascent", "search", "best-response", "plan-rounds"}),
    ],
)
def test_values_against_an_agent_without_a_known_rule_say_that_it_plays_none_of_the_rules(
    name: str, turns: int, unknown: set[str]
) -> None:
    problem = dmplay.load_problem(name)
    for opponent in {*load_roster(problem, 1).agents} - {"axelrod"}:
        agent = find_hint_provider(problem, AdviceQuestion(0, turns, ("human", opponent)))
        assert agent is not None
        assert (agent.basis.accuracy is Accuracy.EXACT) == (opponent not in unknown), opponent
        note = f" rules and not {opponent}" if opponent in unknown else f"against {opponent}"
        assert agent.basis.players.endswith(note)
    for player in ("human", "bot:./player"):
        agent = find_hint_provider(problem, AdviceQuestion(0, turns, ("human", player)))
        assert agent is not None
        assert agent.basis.players.endswith(" rules")


def test_the_turns_ahead_of_a_cart_are_those_that_are_left() -> None:
    game = make_game("cart-pole", turns=30)
    for turns_left in (30, 29, 28):
        hint = game.hint_provider.create_hint()
        assert hint.startswith(f"hint by regulate ({turns_left} turns left): ")
        assert game.hint_provider.current_hint is not None
        values = game.hint_provider.current_hint.values
        assert values is not None
        assert values.q.max() == turns_left
        game.choose(1)


def test_a_review_leaves_out_the_turns_of_earlier_players(tmp_path: Path) -> None:
    arguments = ["prisoners-dilemma", "--vs", "grim", "--seed", "3", "--turns", "3"]
    actions = "defect\nseat agent2=always-cooperate\ndefect\ncooperate\n"
    finished = run_dmplay(tmp_path, *arguments, "-o", "game.dmt", stdin=actions)
    branch = tmp_path / "game-2.dmt"
    moves = dmplay.review(branch)
    assert [(move.turn, move.best, move.regret) for move in moves] == [
        (2, ("defect",), 0.0), (3, ("defect",), 1.0)
    ]  # fmt: skip
    assert (
        "\nchoices: best action 1 of 2 times; on average they lost 1.00 (the regret)"
        in finished.stdout
    )
    assert "same seed:" not in finished.stdout
    assert "same start" not in finished.stdout
    (grade,) = grade_files([branch]).grades
    assert (grade.regret, grade.best_count, grade.valued_count) == (1.0, 1, 2)


def test_a_prey_is_assumed_to_be_chased() -> None:
    hint_agent = find_hint_provider(
        dmplay.load_problem("predator-prey"), AdviceQuestion(1, 5, ("human", "human"))
    )
    assert hint_agent is not None
    assert hint_agent.basis.scope == "if the other agent plays chase"
    two_prey = dmplay.load_problem("predator-prey", prey=2)
    policy = dmplay.load_agent(two_prey, 0, "best-response")
    assert isinstance(policy, SeatPolicy)
    for players, scope in (
        (("human", "flee", "search"), "if the other agents play flee"),
        (("human", "flee", "flee"), ""),
    ):
        assert policy.values_basis(AdviceQuestion(0, None, players)).scope == scope


@pytest.mark.parametrize(
    ("opponent", "regrets"), [("grim", [0.0, 1.0]), ("always-defect", [1.0, 1.0])]
)
def test_review_and_grade_report_the_regret_of_a_repeated_game(
    tmp_path: Path, opponent: str, regrets: list[float]
) -> None:
    file = tmp_path / "game.dmt"
    request = GameRequest(
        "prisoners-dilemma", seed=1, turns=2, other_agent=opponent, record_path=file
    )
    table = GameController(start_new_game(request))
    for _ in range(2):
        run_line(table, "cooperate")
    table.end_game()
    data = json.loads(str(interpret_command(["review", str(file), "--json"])))
    assert [action["regret"] for action in data["actions"]] == regrets
    assert [action["about"] for action in data["actions"]] == [
        f"2 turns left, against {opponent}",
        f"1 turn left, against {opponent}",
    ]
    (grade,) = grade_files([file]).grades
    assert grade.regret == sum(regrets)


def test_a_hint_beside_a_partner_without_a_known_rule_uses_the_belief_of_the_board() -> None:
    problem = dmplay.load_problem("multicaregiver-crying-baby")
    for partner in ("search", "human"):
        seated = [None, None if partner == "human" else dmplay.load_agent(problem, 1, partner)]
        session = Session(problem, dmplay.SeededUniforms(1), seated, turn_limit=6)
        provider = HintProvider(session, AdviceQuestion.of_session(session, 0, ["human", partner]))
        hint = provider.create_hint()
        assert hint.startswith("hint by best-response (6 turns left, assuming a random partner): ")
        agent = find_hint_provider(problem, AdviceQuestion(0, 6, ("human", partner)))
        assert agent is not None
        policy = agent.policy
        assert isinstance(policy, BestResponse)
        memory = policy.initial_memory(session.observation_after(0, 0)[None])
        for turn in range(1, 5):
            session.advance([2, 2 if partner == "human" else None])
            memory = policy.update_memory(memory, session.build_percept(0, turn))
            marginal = memory[0].reshape(3, 2).sum(axis=0)
            assert marginal == pytest.approx(session.view(0).belief)


def test_the_board_says_what_a_song_does() -> None:
    single, double = (make_game(name) for name in (BABY, "multicaregiver-crying-baby"))
    texts = [str(game.view_module.lesson(game.view())) for game in (single, double)]
    assert "singing makes its crying a better clue" in texts[0]
    assert "singing makes" not in texts[1]
