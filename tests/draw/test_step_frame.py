"""The pictures of watched algorithms: literal drawings, and their fit in every size."""

from dataclasses import replace
from functools import cache
from itertools import islice

import numpy as np
import pytest

from dmplay.algorithms import registry
from dmplay.algorithms.step import (
    AlphaVectorSet,
    BeliefTable,
    Curve,
    Picture,
    StateValues,
    Step,
    StrategyMixes,
    TreeNode,
    WatchRequest,
)
from dmplay.draw.bars import draw_bars
from dmplay.draw.options import DrawOptions
from dmplay.draw.panels import BarsPanel
from dmplay.draw.step_frame import compose_pictures, compose_step_rows
from dmplay.draw.watch_panels import draw_algorithm_picture
from dmplay.registry.builtin_names import problem_names
from dmplay.registry.problems import load_problem
from tests.support.glyphs import ASCII_CHARACTERS, GLYPHS

SIZES = [(80, 21), (50, 11), (200, 57), (30, 6), (12, 3), (1, 1), (110, 30)]
FITTING_PAIRS = [
    (name, problem)
    for name, algorithm in registry.load_algorithms().items()
    for problem in problem_names()
    if not algorithm.explain_misfit(load_problem(problem))
]
BABY = load_problem("crying-baby")


@cache
def sample_steps(name: str, problem_name: str) -> list[Step]:
    """Return the start, some early steps and the last of some steps of an algorithm."""
    request = WatchRequest(load_problem(problem_name), iterations=6)
    steps = [*islice(registry.find_algorithm(name).iterate_steps(request), 24)]
    return [*steps[:4], steps[-1]]


def draw(picture: Picture, width: int, height: int, *, ascii_: bool = False) -> list[str]:
    """Return the rows of a picture without trailing blanks."""
    text, _ = draw_algorithm_picture(picture, BABY, DrawOptions(width, height, ascii_))
    return [row.rstrip() for row in text.plain.split("\n")]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(("name", "problem_name"), FITTING_PAIRS)
def test_each_step_fits_each_size_with_known_characters(
    name: str, problem_name: str, size: tuple[int, int]
) -> None:
    problem = load_problem(problem_name)
    for step in sample_steps(name, problem_name):
        for ascii_, characters in ((False, ASCII_CHARACTERS | GLYPHS), (True, ASCII_CHARACTERS)):
            rows = compose_step_rows(step, problem, DrawOptions(*size, ascii_))
            assert len(rows) == size[1]
            assert max(len(row.plain) for row in rows) <= size[0]
            assert {*"".join(row.plain for row in rows)} <= characters


@pytest.mark.parametrize(("name", "problem_name"), FITTING_PAIRS)
def test_the_formula_is_on_the_screen(name: str, problem_name: str) -> None:
    for step in sample_steps(name, problem_name):
        rows = compose_step_rows(step, load_problem(problem_name), DrawOptions(80, 21))
        text = " ".join(row.plain for row in rows)
        assert " ".join(step.formula.split()) in " ".join(text.split())


@pytest.mark.parametrize("width", range(60, 240, 10))
def test_no_state_of_the_team_hunt_is_cut(width: int) -> None:
    problem_name = "collaborative-predator-prey"
    step = sample_steps("belief-update", problem_name)[-1]
    rows = compose_step_rows(step, load_problem(problem_name), DrawOptions(width, 57))
    text = "\n".join(row.plain for row in rows)
    for picture in step.pictures:
        assert isinstance(picture, BeliefTable)
        assert all(f"{label} " in text for label in picture.state_labels)


def test_hex_world_after_two_sweeps_in_ascii() -> None:
    problem = load_problem("hexworld:straight-line")
    steps = registry.find_algorithm("value-iteration").iterate_steps(WatchRequest(problem))
    rows = compose_step_rows([*islice(steps, 3)][-1], problem, DrawOptions(60, 14, ascii=True))
    assert [row.plain for row in rows] == [
        "V is now the value of a game with 2 turns left. 6 of 7",
        "values changed, by at most 6.219 (the residual). The best",
        "action in (5,0), where V changed most, is e; the second-best",
        "action is worth 0.2705.",
        "V(5,0) = -0.3 + 0.9 (0.7 x 10 + 0.3 x (-0.3)) = 5.919",
        "   / \\     / \\     / \\     / \\     / \\     / \\     / \\",
        " /     \\ /     \\ /     \\ /     \\ /     \\ /     \\ /     \\",
        "|       |       |       |       |       |       |       |",
        "|   E*  |   E*  |   E*  |   E*  |   E*  |  >E*< |   +   |",
        "| -0.57 | -0.57 | -0.57 | -0.57 | -0.57 |  5.92 | 10.00 |",
        " \\     / \\     / \\     / \\     / \\     / \\     / \\     /",
        "   \\ /     \\ /     \\ /     \\ /     \\ /     \\ /     \\ /",
        "",
        "residual #= 6.219",
    ]


def test_a_search_tree_marks_the_simulation_and_hides_what_does_not_fit() -> None:
    leaf = TreeNode("quiet", 0)
    feed = TreeNode("feed", 3, -0.009525, -4.25, is_on_path=True, children=(leaf, leaf))
    sing = TreeNode("sing", 0)
    root = TreeNode("belief", 12345, is_on_path=True, children=(feed, sing))
    assert draw(root, 66, 8) == [
        "N: tries  Q: mean return  UCB: Q + c sqrt(ln N / n)  > simulation",
        "                N          Q        UCB",
        "> belief    12345",
        "> ├ feed        3  -0.009525      -4.25",
        "  │ ├ quiet     0",
        "  │ └ quiet     0",
        "  └ sing        0",
    ]
    assert draw(root, 50, 4)[-1] == "… 4 more nodes"
    assert draw(root, 50, 4)[0] == "N: tries  Q: mean  UCB: score  > simulation"


def test_a_belief_table_shows_its_columns_with_bars_and_without_a_number_that_is_unknown() -> None:
    table = BeliefTable(
        ("sated", "hungry"),
        (("prior", np.array([0.25, 0.75])), ("likelihood", np.array([np.nan, 0.5]))),
    )
    assert draw(table, 60, 4, ascii_=True) == [
        "state   prior                      likelihood",
        "sated   ####.............. 0.2500                     -",
        "hungry  ##############.... 0.7500  #########......... 0.5000",
    ]


def test_alpha_vectors_of_two_states_are_lines_and_the_belief_is_marked() -> None:
    vectors = AlphaVectorSet(
        ("sated", "hungry"),
        np.array([[0.0, 8.0], [8.0, 0.0], [1.0, 1.0]]),
        ("feed", "ignore", "sing"),
        np.array([False, False, True]),
        np.array([0.5, 0.5]),
    )
    assert draw(vectors, 53, 9, ascii_=True) == [
        "V",
        "  |ooo            |            ***  (sated, hungry):",
        "  |   oooooooo    |    ********     * feed (0, 8)",
        "5 +           ooooooooo             o ignore (8, 0)",
        "  |...********.........oooooooo...  . 1 removed",
        "0 +***            |            ooo  | belief",
        "  ++--------------+--------------+",
        "   0             0.5             1",
        "              P(hungry)",
    ]
    assert draw(vectors, 42, 8, ascii_=True)[-1] == "* feed   o ignore   . 1 removed   | belief"


def test_alpha_vectors_of_three_states_are_a_triangle() -> None:
    vectors = AlphaVectorSet(
        ("good", "worn", "bad"),
        np.array([[4.0, 0.0, 0.0], [0.0, 4.0, 0.0], [0.0, 0.0, 4.0]]),
        ("use", "examine", "replace"),
        np.zeros(3, bool),
        np.array([0.0, 0.0, 1.0]),
    )
    assert draw(vectors, 40, 8, ascii_=True) == [
        "   good      (good, worn, bad):",
        "             u use (4, 0, 0)",
        "    /u\\      e examine (0, 4, 0)",
        "   /uuu\\     r replace (0, 0, 4)",
        "  /euuur\\    * belief",
        " /eeeerrr\\",
        "----------*",
        "worn    bad",
    ]


def test_bars_that_do_not_fit_leave_out_the_smallest_numbers() -> None:
    numbers = np.array([0.4, 0.1, 0.1, 0.1, 0.3])
    panel = BarsPanel("", [*"abcde"], [("", numbers)])
    assert draw_bars(panel, 20, 3).to_text().plain.split("\n") == [
        "a  ████▍······ 0.400",
        "e  ███▎······· 0.300",
        "3 others 0.300",
    ]
    marked = replace(panel, marked_row=2)
    assert [row[:3] for row in draw_bars(marked, 20, 3).to_text().plain.split("\n")] == [
        "  a",
        "> c",
        "  3",
    ]
    assert draw_bars(panel, 10, 5).to_text().plain.split("\n")[0] == "a  0.400"


def test_mixes_mark_the_best_responses() -> None:
    mixes = StrategyMixes(
        ("agent1", "agent2"),
        (("rock", "paper"), ("rock", "paper")),
        (np.array([0.25, 0.75]), np.array([1.0, 0.0])),
        (1, 0),
    )
    assert draw(mixes, 60, 4, ascii_=True) == [
        "agent1  > best response       agent2  > best response",
        "  rock   ###.......... 0.250  > rock   ############# 1.000",
        "> paper  ##########... 0.750    paper  ............. 0.000",
    ]


def test_an_action_keeps_its_glyph_in_all_steps_of_alpha_vectors() -> None:
    steps = registry.find_algorithm("alpha-vectors").iterate_steps(WatchRequest(BABY))
    legends = {
        f"{row.rpartition(label)[0][-2]} {label}"
        for step in steps
        for row in draw(step.pictures[0], 80, 16, ascii_=True)
        for label in BABY.actions[0].labels
        if f" {label} (" in row
    }
    assert legends == {"* feed", "o sing", "+ ignore"}


def test_each_changed_cell_of_a_hex_map_has_a_star_exits_included() -> None:
    problem = load_problem("hexworld")
    steps = registry.find_algorithm("value-iteration").iterate_steps(WatchRequest(problem))
    step = [*islice(steps, 2)][1]
    text, _ = draw_algorithm_picture(step.pictures[0], problem, DrawOptions(80, 17))
    map_text, _, caption = text.plain.rpartition("* changed")
    assert caption.strip() == "> < formula  ◆ ✗ exit: any action ends the game"
    assert step.sentences[1].startswith(f"{map_text.count('*')} of 24 values changed")


def test_a_curve_has_a_log_scale_if_its_numbers_differ_much_in_size() -> None:
    assert draw(Curve("residual", (10.0, 1.0, 0.001)), 40, 8)[0] == "residual (log scale)"
    assert draw(Curve("residual", (10.0, 9.0, 8.0)), 40, 8)[0] == "residual"
    assert draw(Curve("residual", (4.0, 2.0, 0.0)), 40, 1) == ["residual █▅▁ 0"]


def test_a_small_number_of_a_curve_is_not_drawn_on_the_line_of_zero() -> None:
    rows = draw(Curve("gain", (40.0, 1.0, 0.0)), 40, 9)
    zero = next(row for row, text in enumerate(rows) if text.startswith(" 0"))
    assert rows[zero].count("●") == 1
    assert rows[zero].endswith("●")
    assert rows[zero - 1].count("●") == 1


def test_values_over_two_numbers_are_a_map_with_the_actions_beside_it() -> None:
    states = np.array([[x, v] for x in (-1.0, 0.0, 0.5) for v in (-0.1, 0.1)])
    picture = StateValues(
        states,
        np.array([-8.0, -7.0, -4.0, -3.0, 0.0, 0.0]),
        np.array([0, 0, 1, 2, -1, -1]),
        focus=1,
    )
    text, _ = draw_algorithm_picture(picture, load_problem("mountain-car"), DrawOptions(64, 9))
    assert [row.rstrip() for row in text.plain.split("\n")] == [
        "speed                           speed",
        " 0.1 ┤✗▂▂▂▂▂▆▆▆▆▆▆▆▆▆▆▆▆██████   0.1 ┤✗←←←←←→→→→→→→→→→→→",
        "-0.1 ┤▁▁▁▁▁▁▅▅▅▅▅▅▅▅▅▅▅▅██████  -0.1 ┤←←←←←←············",
        "     └┴──────────────┴────────       └┴──────────────┴────────",
        "     -1              0               -1              0",
        "              position                        position",
        "V: ▁ -8  █ 0   ✗ formula        ← left   · coast   → right",
        "                                ✗ formula",
    ]


def test_other_states_are_a_table_around_the_state_of_the_formula() -> None:
    picture = StateValues(
        np.arange(2), np.array([-3.5, 2.0]), np.array([2, 0]), np.array([True, False]), 1
    )
    assert draw(picture, 50, 8) == [
        "  state   V     action",
        "* sated   -3.5  ignore",
        "> hungry  2     feed",
        "> state of the formula, * changed",
    ]
    assert draw(picture, 40, 3)[1:] == [
        "> hungry  2     feed",
        "1 of 2 rows; > state of the formula, * c",
    ]
    assert draw(picture, 60, 3)[1] == "* sated   -3.5  ignore   > hungry  2     feed"


def test_a_picture_that_does_not_fit_tells_so() -> None:
    mixes = StrategyMixes(("agent1",), (("rock", "paper"),), (np.array([0.25, 0.75]),))
    assert draw(mixes, 20, 6) == ["a picture needs a la"]


def test_a_picture_with_fewer_panels_than_in_a_large_window_says_how_many_are_left_out() -> None:
    problem = load_problem("mountain-car")
    steps = registry.find_algorithm("value-iteration").iterate_steps(WatchRequest(problem))
    step = [*islice(steps, 2)][1]
    large, small = (
        "\n".join(row.plain for row in compose_pictures(step, problem, DrawOptions(*size)))
        for size in ((80, 14), (49, 7))
    )
    assert ("← left" in large, "1 more picture" in large) == (True, True)
    assert ("← left" in small, "2 more pictures" in small) == (False, True)
