"""Tests of large boards with hints: the regret of each action, and forecasts of its outcomes."""

from typing import cast

import numpy as np
import pytest

import dmplay
from dmplay.draw.action_hints import format_forecast_rows, format_regret
from dmplay.draw.options import DrawOptions, Forecast
from dmplay.views import generic as module
from dmplay.views.protocol import ViewModule, fit_board, load_view_module
from tests.support.games import make_view_after

generic = cast(ViewModule, module)
LARGE_OPTIONS = DrawOptions(80, 17, allow_large=True)
ASCII_OPTIONS = LARGE_OPTIONS._replace(ascii=True)
SMALL_OPTIONS = LARGE_OPTIONS._replace(width=50, height=9)
BABY_FORECAST = Forecast(
    1, np.array([0.818, 0.182]), np.array([0, 1]), np.array([[0.0, 1.0], [0.481, 0.519]])
)
MACHINE_FORECAST = Forecast(
    1,
    np.array([0.752, 0.248]),
    np.array([0, 1]),
    np.array([[0.71, 0.265, 0.025], [0.0, 0.777, 0.223]]),
)
THROW_FORECAST = Forecast(
    5,
    np.array([0.603, 0.397]),
    np.array([1, 0]),
    np.array([[0.21, 0.42, 0.31, 0.06], [0.016, 0.167, 0.47, 0.347]]),
)
BABY_REGRET = np.array([0.4, 0.0, 3.25])
CLAIM_REGRET = np.abs(np.arange(2.0, 101.0) - 97.0) / 2
DISTANCE_REGRET = np.array([9.0, 4.5, 2.25, 1.0, 0.0, 0.5, 1.75, 4.0, 8.0, 12.5])
MACHINE_REGRET = np.array([0.0, 0.25, 1.5, 2.75])
SLIDE_REGRET = np.array([0.0, np.nan, 2000.0, 1.5])
PRISONER_REGRET = np.array([1.5, 0.0])
SLIDE_PROBABILITIES = np.array([0.25, 0.25, 0.2, 0.1, 0.1, 0.08, 0.02])
SLIDE_FORECAST = Forecast(
    0, SLIDE_PROBABILITIES, np.array([make_view_after("2048").observation] * 7)
)
CERTAIN_FORECAST = Forecast(0, np.array([1.0]), np.array([0]), np.eye(12**3)[7:8])


def make_reply_forecast(action: int) -> Forecast:
    """Return the forecast of an action whose outcome depends on the other agent."""
    return Forecast(action, np.array([1.0]), np.array([0]))


FRAMES = {
    "the baby in ascii with what is lost and heard": (
        make_view_after("crying-baby", "ignore"),
        ASCII_OPTIONS._replace(regret=BABY_REGRET, forecast=BABY_FORECAST),
        """
heard  crying

sated   ####.................................... 0.093
hungry  ####################################.... 0.907
chance of hunger, turn by turn =#

this turn: effort  reward  then hungry  value below best
s sing      -0.50   -9.57          92%  best
f feed      -5.00  -14.07           0%  #......... -0.4
i ignore    +0.00   -9.07          92%  ########## -3.25

if you sing:  belief then:
chance        sated  hungry
 82% crying    0.00    1.00
 18% quiet     0.48    0.52""",
    ),
    "the baby of the second of two": (
        make_view_after("multicaregiver-crying-baby", "ignore feed", seat=1),
        LARGE_OPTIONS._replace(revealed_state=np.array(0)),
        """
heard  quiet

sated   ████████████████████████████████████████ 1.000
hungry  ········································ 0.000
chance of hunger, turn by turn ▅▁

this turn: effort  reward  then hungry
f feed      -5.00   -5.00           0%
s sing      -0.25   -0.25          33%
i ignore    +0.00   +0.00          33%

a hungry baby cries: 90%, a sated one: 0%
singing changes neither
an unfed sated baby gets hungry: 50%; if quiet, less
true state: sated
bars: your belief, computed as if caregiver1 acted at random""",
    ),
    "the machine in ascii with what is lost and seen": (
        make_view_after("machine-replacement", "manufacture", "manufacture"),
        ASCII_OPTIONS._replace(
            regret=MACHINE_REGRET, forecast=MACHINE_FORECAST, revealed_state=np.array(1)
        ),
        r"""
saw  nondefective (no clue: unexamined)      0 failed
                                                 .
0 failed  #############....... 0.656            / \
1 failed  ######.............. 0.308           . m \
2 failed  #................... 0.036          o m m \
chance of failed parts, last turns :         /*m m m \
                                            / m m m e \
average pay now     value below best       / m m m e e \
m manufacture +0.75 best                  / m m m i i e \
e examine     +0.50 #....... -0.25       / i i i i i i i \
i interrupt   -0.88 ####.... -1.5       / i i i i i i i r \
r replace     -2.00 ######## -2.75     / i i i i i i r r r \
true state: 1 failed                  -----o-----------------
if you examine:    belief then:       1 failed       2 failed
chance                0     1     2
 75% nondefective  0.71  0.27  0.03
 25% defective     0.00  0.78  0.22""",
    ),
    "the catches in ascii with what is lost and seen": (
        make_view_after("catch", "50", "100", "60"),
        ASCII_OPTIONS._replace(regret=DISTANCE_REGRET, forecast=THROW_FORECAST),
        """
% caught at each distance in m (50% if the distance equals the skill)
skill        belief   10  20  30  40  50  60  70  80  90 100
20 m #....... 0.134  +66 =50 :34 .21 _12 _ 6 _ 3 _ 2 _ 1 _ 0
40 m ###..... 0.318  #88 *79 +66 =50 :34 .21 _12 _ 6 _ 3 _ 2
60 m ###..... 0.373  #97 #94 #88 *79 +66 =50 :34 .21 _12 _ 6
80 m #....... 0.175  #99 #98 #97 #94 #88 *79 +66 =50 :34 .21
expected reward        9  17  23  26  26  24  20  15  10   7
                      ==  --  __  __      __  __  --  ==  ##
value below best       9 4.5 2.2   1   0 0.5 1.8   4   8  12

throws 50v 100x 60x

if you throw 60 m:  belief then:
chance              20 m  40 m  60 m  80 m
 60% dropped        0.21  0.42  0.31  0.06
 40% caught         0.02  0.17  0.47  0.35""",
    ),
    "the second prisoner with what is lost and paid": (
        make_view_after("prisoners-dilemma", "defect cooperate", "defect defect", seat=1),
        LARGE_OPTIONS._replace(regret=PRISONER_REGRET, forecast=make_reply_forecast(1)),
        """
> last round  you choose
agent1      │  cooperate    │> defect
            │  1.5 less     │  best
────────────┼───────────────┼───────────────
  cooperate │  agent1   -1  │  agent1   -4
            │  you      -1  │  you       0
────────────┼───────────────┼───────────────
> defect    │  agent1    0  │ [agent1   -3]
            │  you      -4  │ [you      -3]

agent1          D    D
reward          0   -3   total -3
you             C    D
reward         -4   -3   total -7
defect: you get 0 against cooperate, -3 against defect""",
    ),
    "the hands in ascii with what is lost and paid": (
        make_view_after("rock-paper-scissors", "rock rock", "paper rock"),
        ASCII_OPTIONS._replace(regret=BABY_REGRET, forecast=make_reply_forecast(1)),
        """
> last round  agent2 chooses
you choose  |> rock         |  paper        |  scissors
------------+---------------+---------------+---------------
  rock      |  you       0  |  you      -1  |  you       1
  0.4 less  |  agent2    0  |  agent2    1  |  agent2   -1
------------+---------------+---------------+---------------
> paper     | [you       1] |  you       0  |  you      -1
  best      | [agent2   -1] |  agent2    0  |  agent2    1
------------+---------------+---------------+---------------
  scissors  |  you      -1  |  you       1  |  you       0
  3.25 less |  agent2    1  |  agent2   -1  |  agent2    0

you             R    P
reward          0    1   total 1
agent2          R    R
reward          0   -1   total -1
paper: you get 1 against rock, 0 against paper, -1 against scissors""",
    ),
    "the travelers in ascii with what is lost and paid": (
        make_view_after("travelers-dilemma", "60 99", seat=1),
        ASCII_OPTIONS._replace(regret=CLAIM_REGRET, forecast=make_reply_forecast(95)),
        """
agent1 v   agent2 (you) >   cells: pay to agent1, agent2
     |   95   |   96   |   97   |   98   |   99   |  100
-----+--------+--------+--------+--------+--------+--------
  59 | 61, 57 | 61, 57 | 61, 57 | 61, 57 | 61, 57 | 61, 57
> 60 | 62, 58 | 62, 58 | 62, 58 | 62, 58 |[62,58] | 62, 58
  61 | 63, 59 | 63, 59 | 63, 59 | 63, 59 | 63, 59 | 63, 59
  62 | 64, 60 | 64, 60 | 64, 60 | 64, 60 | 64, 60 | 64, 60
  63 | 65, 61 | 65, 61 | 65, 61 | 65, 61 | 65, 61 | 65, 61
  64 | 66, 62 | 66, 62 | 66, 62 | 66, 62 | 66, 62 | 66, 62

                                      you claimed 99, got 58
2 +------------------------------o--------------------*+ 100
                                 agent1 claimed 60, got 62
  #######******+++++++======-------::::::......._____*__
* best claim 97; bars: value lost by each claim; tallest 47.5
if you claim 97, you get 97 if equal, 99 if lower, else the other claim - 2""",
    ),
    "generic with a belief, what is lost and seen": (
        make_view_after("crying-baby", "ignore"),
        LARGE_OPTIONS._replace(regret=BABY_REGRET, forecast=BABY_FORECAST),
        """
observed  crying

sated   ███▊···································· 0.093
hungry  ████████████████████████████████████▎··· 0.907

2 sing      best
1 feed      ██▌················· -0.4
3 ignore    ████████████████████ -3.25

if you sing:  belief then:
chance        sated  hungry
 82% crying    0.00    1.00
 18% quiet     0.48    0.52""",
    ),
    "generic in few rows": (
        make_view_after("crying-baby", "ignore"),
        SMALL_OPTIONS._replace(
            height=6, regret=BABY_REGRET, forecast=BABY_FORECAST._replace(is_sampled=True)
        ),
        """
observed  crying
hint: best sing; feed ▌··· -0.4; ignore ████ -3.25
if you sing (samples):  belief then:
chance                  sated  hungry
 82% crying              0.00    1.00
 18% quiet               0.48    0.52""",
    ),
    "generic with illegal actions and many outcomes": (
        make_view_after("2048"),
        LARGE_OPTIONS._replace(regret=SLIDE_REGRET, forecast=SLIDE_FORECAST),
        """
state  . . . ./. . . ./. . . ./. 2 2 .

1 left     best
4 up       ···················· -1.5
3 right    ████████████████████ -2000
[2 down]

if you left:
 25% . . . ./. . . ./. . . ./. 2 2 .
 25% . . . ./. . . ./. . . ./. 2 2 .
 20% . . . ./. . . ./. . . ./. 2 2 .
 10% . . . ./. . . ./. . . ./. 2 2 .
 10% . . . ./. . . ./. . . ./. 2 2 .
  8% . . . ./. . . ./. . . ./. 2 2 .
     … 1 more""",
    ),
    "generic with many states to believe": (
        make_view_after("collaborative-predator-prey", "e w"),
        ASCII_OPTIONS._replace(height=40, forecast=CERTAIN_FORECAST),
        """
observed  nothing

(4,1) (-1,2) (1,1)  ........................................ 0.002
(4,1) (0,0) (1,1)   ........................................ 0.002
(4,0) (-1,2) (1,1)  ........................................ 0.002
(4,1) (-1,1) (1,1)  ........................................ 0.002
(4,1) (3,0) (1,1)   ........................................ 0.002
(4,0) (0,0) (1,1)   ........................................ 0.002
(4,1) (4,0) (1,1)   ........................................ 0.002
(4,1) (-1,1) (0,2)  ........................................ 0.002
(4,1) (3,1) (1,1)   ........................................ 0.002
(4,0) (-1,1) (1,1)  ........................................ 0.002
1190 others         #######################################. 0.976

1 e
2 ne
3 nw
4 w
5 sw
6 se

if you e:  belief then:
chance     likeliest states
100% prey  (-1,2) (-1,2) (0,0) 1.000, (-1,2) (-1,2) (-1,2) 0.000, (-1,2) (-1,2)
(0,2) 0.000""",
    ),
}


@pytest.mark.parametrize("case", FRAMES)
def test_large_boards_show_regrets_and_forecasts(case: str) -> None:
    view, options, expected = FRAMES[case]
    view_module = generic if case.startswith("generic") else load_view_module(view.problem)
    assert fit_board(view_module, view, options).plain == expected[1:]


PROBLEMS_WITH_PANEL = (
    "catch", "crying-baby", "machine-replacement", "multicaregiver-crying-baby",
    "prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma",
)  # fmt: skip


@pytest.mark.parametrize("name", PROBLEMS_WITH_PANEL)
def test_the_panel_fits_in_17_columns_and_does_not_repeat_the_board(name: str) -> None:
    problem = dmplay.load_problem(name)
    first_actions = " ".join(problem.format_action(seat, 0) for seat in range(len(problem.agents)))
    view = make_view_after(name, first_actions, first_actions)
    panel = load_view_module(problem).panel_rows(view)
    label_columns = max(len(label) for label, _ in panel)
    assert all(label_columns + 1 + len(value) <= 17 for _, value in panel)
    assert not {label for label, _ in panel} & {"heard", "last", *problem.agents}


@pytest.mark.parametrize("name", ["crying-baby", "machine-replacement"])
def test_rewards_are_hidden_until_the_game_is_over(name: str) -> None:
    problem = dmplay.load_problem(name)
    game = dmplay.Session(problem, dmplay.SeededUniforms(5), turn_limit=1)
    rewards = [dict(load_view_module(problem).panel_rows(game.view(0)))["reward"]]
    game.advance([0])
    rewards.append(dict(load_view_module(problem).panel_rows(game.view(0)))["reward"])
    assert rewards == ["hidden", {"crying-baby": "-15", "machine-replacement": "0.9025"}[name]]


@pytest.mark.parametrize("width", [1, 3])
def test_a_board_without_space_for_hints_stays_within_its_width(width: int) -> None:
    view = make_view_after("crying-baby")
    board = fit_board(
        load_view_module(view.problem),
        view,
        DrawOptions(width, 1, allow_large=True, regret=BABY_REGRET),
    )
    assert len(board.plain) <= width


@pytest.mark.parametrize(
    ("suggested_action", "labels"),
    [
        (None, ["best", "best", "-2"]),
        (1, ["equal", "best", "-2"]),
        (2, ["best", "best", "-2"]),  # the suggested action is not optimal
    ],
)
def test_the_suggested_action_is_the_best_of_equal_actions(
    suggested_action: float | None, labels: list[str]
) -> None:
    options = LARGE_OPTIONS._replace(
        regret=np.array([0.0, 0.0, 2.0]), suggested_action=suggested_action
    )
    assert [format_regret(options, action, 12) for action in range(3)] == labels
    assert format_regret(options, 0, 4) == "best"  # too narrow for the longer label


def test_the_percentages_of_a_forecast_sum_to_a_hundred() -> None:
    view = make_view_after("crying-baby", "ignore")
    forecast = Forecast(1, np.array([0.505, np.nextafter(0.495, 1.0)]), np.array([0, 1]))
    assert format_forecast_rows(view, LARGE_OPTIONS._replace(forecast=forecast), ()) == [
        "if you sing:",
        "50.5% crying",
        "49.5% quiet",
    ]
