"""Tests of the review of a game as a table."""

import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.hints.review import ReviewedAction, format_table, review_actions, total_regret

FEED = 0
UP = 3  # of 2048


def make_reviewed_action(turn: int, seat: str, chosen: str, regret: float) -> ReviewedAction:
    """Return a reviewed action whose best alternatives were left and up."""
    return ReviewedAction(turn, seat, chosen, ("left", "up"), regret, {})


def test_the_worst_actions_come_first_and_equal_ones_in_order_of_turns() -> None:
    actions = [
        make_reviewed_action(1, "agent", "up", 0.0),
        make_reviewed_action(2, "agent", "right", 0.5),
        make_reviewed_action(3, "agent", "d", 2.0),
    ]
    assert format_table([*actions, make_reviewed_action(4, "agent", "left", 0.0)]) == [
        "turn  chosen  best        regret",
        "3     d       left or up  2.00 ####################",
        "2     right   left or up  0.50 #####",
        "1     up      left or up  0.00",
        "4     left    left or up  0.00",
        "review: best action 2 of 4 times, total expected regret (value lost) 2.50, "
        "largest in turn 3",
        "regret = value of the best action minus value of the chosen one",
    ]


def test_the_total_regret_is_discounted_as_the_score_is() -> None:
    actions = [
        make_reviewed_action(1, "agent", "d", 1.0),
        make_reviewed_action(3, "agent", "d", 2.0)._replace(discount_factor=0.25),
    ]
    assert total_regret(actions) == 1.5
    assert format_table(actions)[:3] == [
        "turn  chosen  best        regret  discounted",
        "1     d       left or up  1.00    1.00 ####################",
        "3     d       left or up  2.00    0.50 ##########",
    ]
    assert format_table(actions)[-3] == (
        "review: best action 0 of 2 times, total expected regret (discounted value lost) 1.50, "
        "largest in turn 1"
    )


def test_the_total_regret_is_the_expected_return_that_the_actions_lose() -> None:
    session = Session(dmplay.load_problem("crying-baby"), dmplay.SeededUniforms(5), turn_limit=2)
    for _ in range(2):
        session.advance([FEED])
    moves = [*review_actions(session, [AdviceQuestion.of_session(session, 0)])]
    feeding_twice = (-5 - 10 * 0.5) + 0.9 * -5  # the baby is sated after the first turn
    assert total_regret(moves) == pytest.approx(max(moves[0].values.values()) - feeding_twice)


@pytest.mark.parametrize(
    ("accuracy", "word"), [(Accuracy.EXACT, "expected"), (Accuracy.ESTIMATED, "estimated")]
)
def test_a_regret_of_estimates_is_called_estimated(accuracy: Accuracy, word: str) -> None:
    basis = ValuesBasis(accuracy)
    action = make_reviewed_action(1, "agent", "down", 1.0)._replace(basis=basis)
    assert f", total {word} regret (value lost) 1.00, " in format_table([action])[2]


def test_the_data_of_a_review_name_the_basis_of_its_values() -> None:
    basis = ValuesBasis(Accuracy.UPPER_BOUND, ignores_turn_limit=True)
    data = make_reviewed_action(1, "agent", "down", 1.0)._replace(basis=basis, about="2 left").data
    assert [*data][-5:] == ["scope", "about", "values_name", "scale", "discount_factor"]
    assert (data["scope"], data["values_name"]) == ("turn limit ignored", "upper bounds")


def test_ratings_of_2048_are_whole_numbers_and_not_points() -> None:
    session = Session(dmplay.load_problem("2048"), SeededUniforms(3))
    session.advance([UP])
    (move,) = review_actions(session, [AdviceQuestion.of_session(session, 0)])
    assert all(value == round(value) for value in move.values.values())
    beginning = "turn 1, agent: chose up, not judged (too close to call). "
    assert str(move).startswith(f"{beginning}ratings, not points: left 107339, ")
    worse = move._replace(best=("left",), regret=900.0)
    assert ", total estimated regret (rating lost) 900, " in format_table([worse])[2]


def test_bars_have_a_maximum_length_and_equally_good_actions_are_called_any() -> None:
    action = make_reviewed_action(1, "agent", "down", 1.69)._replace(
        values={"left": 1.0, "up": 1.0}
    )
    assert format_table([action])[1] == "1     down    any   1.69 ####################"


def test_a_review_of_several_people_has_a_seat_column() -> None:
    lines = format_table(
        [
            make_reviewed_action(1, "agent1", "up", 0.0),
            make_reviewed_action(1, "agent2", "down", 1.0),
        ]
    )
    assert lines[0] == "turn  seat    chosen  best        regret"
    assert lines[1] == "1     agent2  down    left or up  1.00 ####################"


def test_a_review_without_values_has_no_columns() -> None:
    assert format_table([]) == ["review: no agent can compute the values of these actions"]


def play_and_review(name: str, actions: list[int], turn_limit: int = 50) -> list[ReviewedAction]:
    """Return the review of a game with these actions."""
    session = Session(dmplay.load_problem(name), SeededUniforms(3), turn_limit=turn_limit)
    for action in actions:
        session.advance([action])
    return [*review_actions(session, [AdviceQuestion.of_session(session, 0)])]


def test_a_push_is_judged_only_if_it_changes_how_soon_the_game_ends() -> None:
    moves = play_and_review("cart-pole", [0] * 9)
    judged = [move for move in moves if not move.is_too_close]
    assert [move.chosen in move.best for move in judged] == [False] * len(judged)
    assert 0 < len(judged) < len(moves)
    worst = max(moves, key=lambda move: move.regret or 0.0)
    assert worst.values["right"] == 50 - worst.turn + 1  # turns until the end
    assert worst.regret == worst.values["right"] - worst.values["left"]
    assert all(move.about == move.basis.scope == "if regulate plays on" for move in moves)
    assert "estimated values (if regulate plays on): left" in str(worst)
    summary = format_table(moves)[-2]
    assert f" 0 of {len(judged)} times, {len(moves) - len(judged)} choices not judged" in summary


def test_choices_with_random_events_are_compared_on_the_same_random_numbers() -> None:
    moves = play_and_review("collision-avoidance", [0, 0, 1, 0, 1, 0], 6)  # no collision so soon
    assert [move.regret for move in moves] == pytest.approx([0.01] + [0.0] * 5, abs=0.02)
    assert all(0.0 in (move.errors or {}).values() for move in moves)


def test_a_choice_among_equally_rated_actions_is_not_judged() -> None:
    basis = ValuesBasis(Accuracy.RATING)
    move = make_reviewed_action(1, "agent", "up", 0.0)._replace(
        basis=basis, values={"left": 7.0, "up": 7.0}
    )
    assert move.is_too_close
    assert move.data["judged"] is False
    assert format_table([move])[2] == "review: 1 choice not judged (too close to call)"
    assert not move._replace(basis=ValuesBasis(Accuracy.EXACT)).is_too_close


def test_bounds_do_not_judge_a_choice() -> None:
    basis = ValuesBasis(Accuracy.UPPER_BOUND)
    action = make_reviewed_action(1, "agent", "left", 0.0)._replace(
        basis=basis, regret=None, values={"left": 2.0, "up": 2.0, "down": 1.0}
    )
    assert not action.is_judged
    assert format_table([action])[-1].endswith("1 of 1 time; bounds do not judge a choice")
