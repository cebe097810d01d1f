from dataclasses import replace
from functools import partial

import numpy as np
import pytest

import dmplay
from dmplay.agents.best_response_in_team import PartnerBeliefPolicy
from dmplay.draw.options import DrawOptions, Forecast
from dmplay.game.position import Position
from dmplay.views.protocol import fit_board, load_view_module
from tests.support import games

multicaregiver_crying_baby = load_view_module(dmplay.load_problem("multicaregiver-crying-baby"))

LARGE_OPTIONS = DrawOptions(80, 24, allow_large=True)
make_view_after = partial(games.make_view_after, "multicaregiver-crying-baby")


def test_the_board_shows_the_belief_of_the_second_caregiver() -> None:
    board = fit_board(
        multicaregiver_crying_baby,
        make_view_after("ignore ignore", "sing feed", seat=1),
        DrawOptions(80, 24),
    ).plain
    assert (
        board
        == """\
heard  quiet

sated   ████████████████████ 1.000
hungry  ···················· 0.000
chance of hunger, turn by turn ▅█▁
bars: your belief, computed as if caregiver1 acted at random"""
    )


def test_the_belief_on_a_small_ascii_board() -> None:
    board = fit_board(
        multicaregiver_crying_baby, make_view_after("ignore feed"), DrawOptions(40, 8, ascii=True)
    ).plain
    assert (
        board
        == """\
heard  quiet

sated   ##################.. 0.909
hungry  ##.................. 0.091
chance of hunger, turn by turn =_
belief as if caregiver2 acted at random"""
    )


def test_the_description_states_the_assumed_policy_of_the_other_caregiver() -> None:
    assert multicaregiver_crying_baby.describe_situation(make_view_after()) == (
        "heard nothing yet. belief as if caregiver2 acted at random: sated 0.500, hungry 0.500. "
        "what caregiver2 does is hidden."
    )


def test_without_a_belief_the_board_shows_what_was_heard_and_how_likely_cries_are() -> None:
    view = replace(make_view_after("ignore ignore"), beliefs=None)
    board = fit_board(multicaregiver_crying_baby, view, DrawOptions(80, 24)).plain
    assert (
        board
        == """\
heard  crying

a hungry baby cries: 90%, a sated one: 0%
singing changes neither
an unfed sated baby gets hungry: 50%; if quiet, less"""
    )
    assert multicaregiver_crying_baby.describe_situation(view) == (
        "heard crying. what caregiver2 does is hidden."
    )


def test_a_forecast_with_another_partner_than_the_belief_names_both() -> None:
    quiet = np.array([[1.0, 0.0]])
    forecast = Forecast(2, np.array([1.0]), np.array([1]), quiet)
    view = make_view_after("feed ignore")
    for other_players, note in [
        ("with a random partner", "bars: your belief, computed as if caregiver2 acted at random"),
        (
            "if the partner plays feed-when-crying",
            "bars: caregiver2 acts at random; forecast: the partner plays feed-when-crying",
        ),
    ]:
        options = DrawOptions(80, 24, forecast=forecast._replace(other_players=other_players))
        board = fit_board(multicaregiver_crying_baby, view, options).plain
        assert board.endswith(f"\n{note}")


@pytest.mark.parametrize("partner", ["feed-when-crying", "random", "sing"])
@pytest.mark.parametrize("sound", ["crying", "quiet"])
def test_the_table_forecasts_hunger_beside_a_partner_whose_rule_is_known(
    partner: str, sound: str
) -> None:
    position = Position.from_text(
        "multicaregiver-crying-baby", history=[f"ignore {sound}"], players=["random", partner]
    )
    assert position.agent is not None
    policy = position.agent.policy
    assert isinstance(policy, PartnerBeliefPolicy)
    belief = policy.state_belief(position.memory)[0]
    view = replace(position.view, beliefs=(belief, belief), known_partner=partner)
    rows = multicaregiver_crying_baby.iter_boards(view, LARGE_OPTIONS)
    table = next(rows).plain.split("then hungry")[1].split("\n")[1:4]
    for action, row in enumerate(table):
        forecast = position.forecast(action)
        assert forecast.beliefs is not None
        hungry = forecast.probabilities @ forecast.beliefs[:, -1]
        assert row.split()[-1] == f"{hungry:.0%}"


def test_the_table_forecasts_no_hunger_beside_a_partner_of_another_rule() -> None:
    view = replace(make_view_after("ignore ignore"), known_partner="joint-plan")
    board = next(iter(multicaregiver_crying_baby.iter_boards(view, LARGE_OPTIONS))).plain
    assert "this turn: effort  reward\n" in board
