"""Tests of the built-in lessons: right and wrong answers to each, and their texts."""

import re
from collections.abc import Callable, Mapping, Sequence
from itertools import permutations, product
from pathlib import Path

import numpy as np
import pytest

from dmplay.algorithms.registry import find_algorithm
from dmplay.algorithms.step import WatchRequest
from dmplay.core.tabular import tabulate
from dmplay.errors import DmplayError
from dmplay.registry.problems import load_problem
from dmplay.tutor.game_checks import check_game_conditions
from dmplay.tutor.lesson import GameTask, PositionText, Prediction, QuantityCall, TutorLesson
from dmplay.tutor.lesson_list import find_lesson, load_builtin_lessons, load_lessons
from dmplay.tutor.lesson_run import LessonRun, TutorReply
from dmplay.tutor.positions import PositionInGame, open_position, play_ghost
from dmplay.tutor.progress import PASSED, load_progress
from dmplay.tutor.puzzles import find_puzzle, make_exercise
from dmplay.tutor.quantity import compute_truth
from tests.tutor.lesson_scripts import RIGHT_ANSWERS, WRONG_ANSWERS, WrongAnswer, list_lines

LESSONS = {lesson.name: lesson for lesson in load_builtin_lessons()}
WRONG_CASES = [(name, wrong) for name, answers in WRONG_ANSWERS.items() for wrong in answers]


@pytest.fixture(autouse=True)
def _state_in_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the progress of a test in its own folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))


def give_answer(run: LessonRun, answer: str) -> TutorReply:
    """Answer the current step: type a line, or play its game."""
    if not isinstance(run.step.task, GameTask):
        return run.check_answer(answer)
    position = run.position
    session, seat = position.session, position.seat
    for action in list_lines(answer):
        if session.over:
            break
        mask = session.legal_actions_mask(seat)
        choice = position.problem.parse_action(seat, action)
        if mask is None or mask[int(choice)]:
            actions: list[float | None] = [None] * len(position.problem.agents)
            actions[seat] = choice
            session.advance(actions)
    return run.check_game(session)


def test_the_built_in_lessons_have_consecutive_numbers() -> None:
    assert [lesson.number for lesson in LESSONS.values()] == [*range(1, 18)]
    assert {*LESSONS} == {*RIGHT_ANSWERS} == {*WRONG_ANSWERS}


@pytest.mark.parametrize("name", LESSONS)
def test_right_answers_pass_each_step_at_the_first_try(name: str) -> None:
    lesson = LESSONS[name]
    run = LessonRun(lesson)
    for answer in RIGHT_ANSWERS[name]:
        step = run.step
        reply = give_answer(run, answer)
        assert reply.finishes_step, reply.lines
        assert reply.lines[-1].startswith(step.learned)
    assert run.is_over
    assert [step and (step.result, step.tries) for step in load_progress(lesson).steps] == [
        (PASSED, 1)
    ] * len(lesson.steps)


@pytest.mark.parametrize(("name", "wrong"), WRONG_CASES)
def test_a_wrong_answer_gets_its_reason_in_numbers(name: str, wrong: WrongAnswer) -> None:
    run = LessonRun(LESSONS[name], wrong.step - 1)
    reply = give_answer(run, wrong.answer)
    assert not reply.finishes_step
    assert reply.lines[0].startswith("not yet. ")
    assert wrong.reason.lower() in reply.lines[0].lower()
    assert reply.lines[1:] == ("Try again; hint gives you a hint, and ? lists the commands.",)


def list_wrong_answers(run: LessonRun) -> list[str]:
    """Return wrong answers of several kinds to the current question."""
    task, truth = run.step.task, run.truth
    assert isinstance(task, Prediction)
    if truth is None:
        wrong_answers = WRONG_ANSWERS[run.lesson.name]
        return [wrong.answer for wrong in wrong_answers if wrong.step == run.index + 1]
    value = truth.value
    if isinstance(value, Mapping):
        return [f"{label} 1" for label in truth.labels]
    if isinstance(value, frozenset):
        return [label for label in truth.labels if label not in value]
    if isinstance(value, tuple):
        return [" ".join(order) for order in permutations(value) if order != value]
    guesses = [0.0, 0.5, 1.0, 3.0, 7.0, value / 2, value - 1, value + 1, 2 * value + 1]
    if not truth.is_cost:  # the sign of a cost does not matter
        guesses.append(-value)
    return [f"{guess:g}" for guess in guesses if abs(guess - value) > task.tolerance + 1e-5]


def find_right_parts(run: LessonRun, reply: str, typed: str) -> list[str]:
    """Return the parts of a reply that are the right answer, and that the player did not type."""
    truth = run.truth
    assert truth is not None
    task, text = run.step.task, " ".join(run.step.text)
    assert isinstance(task, Prediction)
    words = {word.rstrip(".;:") for word in re.split(r"[,;:.]? |[.]$", reply)}
    words -= {*typed.split(), *re.findall(r"[\d.]*\d", text)}
    if isinstance(truth.value, frozenset):
        return sorted(words & truth.value)
    if isinstance(truth.value, tuple):
        return [" ".join(truth.value)] if " ".join(truth.value) in reply else []
    values = [*truth.value.values()] if isinstance(truth.value, Mapping) else [truth.value]
    numbers = [word for word in words if re.fullmatch(r"-?\d+([.]\d+)?", word)]
    return [
        number
        for number in numbers
        if any(abs(float(number) - value) <= task.tolerance + 1e-9 for value in values)
    ]


PREDICTIONS = [
    (name, index)
    for name, lesson in LESSONS.items()
    for index, step in enumerate(lesson.steps)
    if isinstance(step.task, Prediction)
]


@pytest.mark.parametrize(("name", "index"), PREDICTIONS)
def test_no_reply_reveals_the_answer_before_the_third_try(name: str, index: int) -> None:
    wrong_answers = list_wrong_answers(LessonRun(LESSONS[name], index))
    for wrong_answer in wrong_answers:
        run = LessonRun(LESSONS[name], index)
        for _ in range(2):  # the second reply contains the hint
            reply = run.check_answer(wrong_answer)
            assert not reply.finishes_step, (wrong_answer, reply.lines)
            right_answer = RIGHT_ANSWERS[name][index]
            text = " ".join(reply.lines)
            if run.truth is None:
                assert right_answer not in re.split(r"[,;:.]? |[.]$", text)
            else:
                assert not find_right_parts(run, text, wrong_answer), (wrong_answer, text)


@pytest.mark.parametrize(
    ("name", "step", "answer"),
    [
        ("first-walk", 1, "8,2 0.7 7,2 0.15 8,1 0.15"),
        ("first-walk", 1, "(8, 2) 0.7, (7, 2) 0.15, (8, 1) 0.15"),
        ("first-walk", 1, "(8,2)=70%, (7,2)=15%, (8,1)=15%"),
        ("first-walk", 3, "5,2"),
        ("first-walk", 3, "5 2"),
        ("first-walk", 3, "( 5, 2 )"),
        ("discount", 1, "8,1 5,2 1,1 1,2"),
        ("discount", 1, "(8, 1), (5, 2), (1, 1), (1, 2)"),
        ("discount", 1, "(8,1) > (5,2) > (1,1) > (1,2)"),
        ("straight-to-the-exit", 1, "15%"),
        ("straight-to-the-exit", 3, "1,0"),
        ("when-to-look", 3, "0: 0.25, 1: 0, 2: 0.75"),
        ("when-to-look", 3, "0 0.25 1 0 2 0.75"),
        ("when-to-look", 3, "25%, 0, 75%"),
        ("when-to-look", 3, "0.27 0 0.73"),
    ],
)
def test_states_are_read_as_students_type_them(name: str, step: int, answer: str) -> None:
    assert LessonRun(LESSONS[name], step - 1).check_answer(answer).finishes_step


def test_a_line_that_cannot_be_read_does_not_show_a_right_belief() -> None:
    run = LessonRun(LESSONS["when-to-look"], 2)
    with pytest.raises(ValueError, match=r"expected 3 numbers: the probabilities of 0, 1 and 2"):
        run.check_answer("0.5")


def test_a_distribution_that_lacks_a_state_gets_a_reason_without_its_name() -> None:
    for typed in ("(8,2) 0.7 (7,2) 0.3", "(8,2) 0.85 (7,2) 0.15", "(8,2) 0.85 (6,2) 0.15"):
        reply = LessonRun(LESSONS["first-walk"]).check_answer(typed).lines[0]
        assert "(8,1)" not in reply
        assert "2 next states a probability, and 3 are possible" in reply
        assert ("1 of yours cannot follow" in reply) == ("(6,2)" in typed)


def test_an_undone_turn_slips_to_the_same_side_when_it_is_played_again() -> None:
    session = LessonRun(LESSONS["first-walk"], 2).position.session
    problem = session.problem
    assert problem.format_state(session.state) == "(7,1)"  # to the right of east
    session.undo()
    session.advance([problem.parse_action(0, "sw")])
    assert problem.format_state(session.state) == "(5,2)"  # west, to the right of south-west


@pytest.mark.parametrize(
    ("name", "step"), [("first-walk", 2), ("discount", 3), ("straight-to-the-exit", 4)]
)
def test_a_walk_is_not_passed_by_one_action_again_and_again(name: str, step: int) -> None:
    for action in ("e", "ne", "nw", "w", "sw", "se"):
        run = LessonRun(LESSONS[name], step - 1)
        assert not give_answer(run, f"game: 200*{action}").finishes_step, action


def test_the_numbers_in_the_text_on_residuals_are_those_of_the_sweeps() -> None:
    step = LESSONS["watch-v-converge"].steps[3]
    problem = load_problem("hexworld")
    tables = tabulate(problem)
    sweeps = [np.zeros(len(tables.transition))]
    actions = []
    for _ in range(300):
        q = tables.rewards[:, :, 0] + 0.9 * np.einsum("sat,t->sa", tables.transition, sweeps[-1])
        sweeps.append(q.max(axis=1))
        actions.append((q > q.max(axis=1, keepdims=True) - 1e-9).tolist())
    residual = np.abs(sweeps[10] - sweeps[9]).max()
    assert f"V changes by up to {residual:.4f} in sweep 10" in " ".join(step.text)
    assert f"V changes by at most {np.abs(sweeps[-1] - sweeps[10]).max():.2f} more" in step.learned
    assert [sweep for sweep, best in enumerate(actions, 1) if best != actions[-1]][-1] == 9


def test_the_searches_in_the_text_choose_as_badly_as_it_says() -> None:
    step = LESSONS["look-ahead"].steps[1]
    position = LessonRun(LESSONS["look-ahead"], 1).position
    for simulations, wrong_count in ((8, 17), (200, 1)):
        arguments = {"state": "(2,1)", "simulations": simulations}
        share = compute_truth(position, QuantityCall("search-error-share", arguments)).value
        assert share == wrong_count / 20
    assert "With 8 simulations, 17 of 20 searches at (2,1)" in " ".join(step.text)
    assert "With 200 of them, only 1 of 20 searches" in step.learned


def test_the_numbers_of_simulations_that_pass_are_those_of_the_formula() -> None:
    right = []
    for count in range(1, 60):
        run = LessonRun(LESSONS["look-ahead"], 1)
        right += [count] * run.check_answer(str(count)).finishes_step
    assert right == [n for n in range(1, 60) if 0.02 <= 0.85**n <= 0.05] == [*range(19, 25)]


def test_tries_of_bad_actions_cost_most_beside_the_bad_exit() -> None:
    """Compare the best action with the mean of all actions, in the hexes after sw and after w."""
    position = LessonRun(LESSONS["look-ahead"], 2).position
    actions = position.problem.actions[0].labels

    def list_values(state: str) -> list[float]:
        """Return the value of each action in a state."""
        calls = (QuantityCall("action-value", {"action": a, "state": state}) for a in actions)
        values = [compute_truth(position, call).value for call in calls]
        return [value for value in values if isinstance(value, float)]

    near, away = list_values("(1,1)"), list_values("(0,2)")
    assert max(near) == pytest.approx(max(away), abs=0.02)
    assert max(near) - np.mean(near) > 3 * (max(away) - np.mean(away))
    assert max(list_values("(1,2)")) == list_values("(1,2)")[actions.index("sw")]


def test_the_watched_search_also_takes_the_way_that_avoids_the_bad_exit() -> None:
    position = LessonRun(LESSONS["look-ahead"], 2).position
    assert position.problem.format_state(position.session.state) == "(1,2)"
    request = WatchRequest(position.problem, position.seat, position.session)
    *_, last = find_algorithm("tree-search").iterate_steps(request)
    assert last.sentences[0].startswith("The search ends, and chooses w,")


def slide_right(row: list[int]) -> tuple[list[int], int]:
    """Return a row of 2048 after a slide to the right, and the points of its merges."""
    tiles, points = [tile for tile in row if tile], 0
    merged: list[int] = []
    while tiles:
        tile = tiles.pop()
        if tiles and tiles[-1] == tile:
            tile += tiles.pop()
            points += tile
        merged.insert(0, tile)
    return [0] * (4 - len(merged)) + merged, points


def test_the_slide_that_pays_nothing_now_is_the_best_of_two_slides() -> None:
    position = LessonRun(LESSONS["look-ahead"], 3).position
    board = "2 . . ./4 . . ./8 4 . 2/16 8 4 2"
    assert position.problem.format_state(position.session.state) == board
    rows = [[int(tile.replace(".", "0")) for tile in row.split()] for row in board.split("/")]
    slid = [slide_right(row) for row in rows]
    assert sum(points for _, points in slid) == 0
    columns = [list(column) for column in zip(*(row for row, _ in slid), strict=True)]
    certain_points = sum(slide_right(column)[1] for column in columns)  # down; no new tile stops it
    truth = compute_truth(position, QuantityCall("forward-search-action", {"depth": 2}))
    assert truth.value == frozenset(["right"])
    assert certain_points == 28
    assert truth.comparison.startswith("the values are right: 28, down: 14.2")
    greedy = compute_truth(position, QuantityCall("forward-search-action", {"depth": 1}))
    assert greedy.value == frozenset(["down", "up"])


def test_the_answer_of_a_question_for_an_action_is_shown() -> None:
    run = LessonRun(LESSONS["two-at-the-cradle"], 1)
    for _ in range(3):
        run.check_answer("ignore")
    assert run.show_answer().lines[0] == "answer: feed."


NO_LOOK = "manufacture nondefective"


@pytest.mark.parametrize(
    ("name", "step", "games"),
    [
        ("momentum", 3, ["20*right 36*left 60*right", "15*right 40*left 60*right"]),
        ("how-good-is-the-catcher", 4, ["50 30 8*20", "50 30 8*10", "50 20 30 7*20"]),
        ("bayes-at-the-cradle", 4, ["feed 3*ignore feed 5*ignore"]),
        (
            "when-to-look",
            4,
            [
                *(f"{n}*manufacture interrupt 20*manufacture" for n in range(4, 12)),
                *(f"{n}*manufacture examine interrupt 20*manufacture" for n in range(4, 9)),
            ],
        ),
        (
            "collision-course",
            4,
            [f"{n}*no-advisory 8*descend 41*no-advisory" for n in range(0, 24, 3)],
        ),
    ],
)
def test_a_game_is_passed_by_plays_that_follow_its_idea(
    name: str, step: int, games: list[str]
) -> None:
    for game in games:
        assert give_answer(LessonRun(LESSONS[name], step - 1), f"game: {game}").finishes_step, game


@pytest.mark.parametrize(
    ("name", "step", "games"),
    [
        ("momentum", 2, ["220*right", "220*left", "220*coast"]),
        (
            "momentum",
            3,
            ["220*right", "30*right 50*left 60*right", "36*right 36*left 60*right 90*left"],
        ),
        ("push-to-zero", 2, ["10*0", "10*-0.27", "10*0.1"]),
        (
            "how-good-is-the-catcher",
            4,
            ["50 9*70", "50 9*30", *(f"10*{throw}" for throw in range(10, 101, 10))],
        ),
        ("bayes-at-the-cradle", 4, ["10*feed", "10*ignore", "10*sing"]),
        (
            "when-to-look",
            4,
            [
                *(f"20*{action}" for action in ("manufacture", "examine", "interrupt", "replace")),
                "6*manufacture interrupt 6*manufacture interrupt 6*manufacture",
                *(4 * f"{n}*manufacture interrupt " + "20*manufacture" for n in range(3, 8)),
                "13*manufacture interrupt 6*manufacture",
            ],
        ),
        (
            "collision-course",
            4,
            [
                "41*no-advisory",
                "41*climb",
                "41*descend",
                "10*climb 31*no-advisory",
                "31*no-advisory 10*descend",
            ],
        ),
    ],
)
def test_no_constant_action_and_no_late_or_early_one_passes_a_game(
    name: str, step: int, games: list[str]
) -> None:
    for game in games:
        assert not give_answer(LessonRun(LESSONS[name], step - 1), f"game: {game}").finishes_step


def play_rule(run: LessonRun, choose: Callable[[PositionInGame], str]) -> bool:
    """Play the game of the current step by a rule; return whether it is passed."""
    position = run.position
    while not position.session.over:
        action = position.problem.parse_action(position.seat, choose(position))
        position.session.advance([action])
    return run.check_game(position.session).finishes_step


@pytest.mark.parametrize(("share", "passes"), [(1.0, True), (0.9, False), (0.5, False)])
def test_only_the_whole_number_is_the_best_push(share: float, passes: bool) -> None:
    def push(position: PositionInGame) -> str:
        """Return a push of minus a share of the number, as the screen shows it."""
        return f"{-share * float(position.session.state[0]):.3f}"

    assert play_rule(LessonRun(LESSONS["push-to-zero"], 1), push) == passes


@pytest.mark.parametrize(("first", "turn_count"), [("right", 128), ("left", 206)])
def test_pushing_in_the_direction_of_the_speed_reaches_the_flag_but_not_fast(
    first: str, turn_count: int
) -> None:
    def push(position: PositionInGame) -> str:
        """Return the direction of the speed, or the first one at rest."""
        speed = float(position.session.state[1])
        return first if speed == 0.0 else "right" if speed > 0.0 else "left"

    run = LessonRun(LESSONS["momentum"], 1)
    assert play_rule(run, push)
    assert not play_rule(LessonRun(LESSONS["momentum"], 2), push)
    ghost = LessonRun(LESSONS["momentum"], 1).position
    while not ghost.session.over:
        ghost.session.advance([ghost.problem.parse_action(0, push(ghost))])
    assert len(ghost.session.turns) == turn_count


def test_feeding_after_each_cry_is_not_enough_but_a_threshold_of_the_belief_is() -> None:
    def feed_after_cry(position: PositionInGame) -> str:
        """Feed if the last sound was a cry."""
        turns = position.session.turns
        heard = int(turns[-1].observations[0]) if turns else 1
        return ("feed", "ignore")[heard]

    def feed_likely_hungry(position: PositionInGame) -> str:
        """Feed if P(hungry) is above 0.3."""
        return "feed" if position.session.view(0).belief[1] > 0.3 else "ignore"

    assert not play_rule(LessonRun(LESSONS["bayes-at-the-cradle"], 3), feed_after_cry)
    assert play_rule(LessonRun(LESSONS["bayes-at-the-cradle"], 3), feed_likely_hungry)


def test_the_throw_that_pays_most_now_does_not_pass_the_game_with_a_sharp_limit() -> None:
    def throw_greedily(position: PositionInGame) -> str:
        """Return the distance with the greatest expected reward of this turn."""
        rewards = tabulate(position.problem).rewards[:, :, 0]
        best = int(np.argmax(position.session.view(0).belief @ rewards))
        return position.problem.format_action(0, best)

    assert not play_rule(LessonRun(LESSONS["how-good-is-the-catcher"], 3), throw_greedily)


def test_the_agent_threshold_repairs_twice_and_the_best_play_once() -> None:
    def count_repairs(agent: str) -> int:
        """Return the number of repairs of an agent in the game of the lesson."""
        ghost = play_ghost(LessonRun(LESSONS["when-to-look"], 3).position, agent)
        return sum(int(turn.actions[0]) == 2 for turn in ghost.session.turns)

    assert (count_repairs("threshold"), count_repairs("optimal")) == (2, 1)
    learned = LESSONS["when-to-look"].steps[3].learned
    assert "threshold repairs at a fixed chance of a failure, so twice here" in learned


def test_the_values_of_plans_in_the_text_are_those_of_the_baby() -> None:
    """Compute the alpha vectors (sated, hungry) of plans A, B and C by hand."""
    tables, discount = tabulate(load_problem("crying-baby")), 0.9
    feed, _, ignore = 0, 1, 2
    cry, quiet = 0, 1

    def precede(action: int, after_cry: np.ndarray, after_quiet: np.ndarray) -> np.ndarray:
        """Return the alpha vector of an action, and then a plan after each sound."""
        sounds = tables.observation_model[action]
        later = sounds[:, cry] * after_cry + sounds[:, quiet] * after_quiet
        return np.asarray(
            tables.rewards[:, action, 0] + discount * tables.transition[:, action] @ later
        )

    last = tables.rewards[:, ignore, 0]
    plan_a, plan_b = precede(feed, last, last), precede(ignore, last, last)
    plan_c, longer_a = precede(ignore, plan_a, plan_b), precede(feed, plan_b, plan_b)
    texts = [" ".join([*step.text, step.hint]) for step in LESSONS["alpha-vectors"].steps]
    assert plan_a.tolist() == [-5, -15]
    assert "worth -5 if the baby is sated now, and -15 if it is hungry" in texts[0]
    assert np.allclose(plan_b, [-0.9, -19])
    assert "worth -0.9 if sated now (0.9 x 0.1 x -10), and -19 if hungry (-10 - 9)" in texts[1]
    assert "line A is -5 - 10 P, and line B is -0.9 - 18.1 P" in texts[1].replace("Line", "line")
    assert plan_c.round(2).tolist() == [-2.48, -24.22]
    assert "worth -2.48 if sated now, -24.22 if hungry" in texts[2]
    assert np.allclose(longer_a, [-5 - 0.9 * 0.9, -15 - 0.9 * 0.9])
    assert "worth -5.81 if sated now (-5 - 0.9 x 0.9 x 0.1 x 10), and 10 less if hungry" in texts[2]
    sing = 1
    sounds = tables.observation_model[sing]
    later = sounds[:, cry] * plan_a + sounds[:, quiet] * plan_b
    plan_d = last + discount * tables.transition[:, sing] @ later  # without the price of singing
    assert np.allclose(plan_d, [-2.115, -23.86])
    assert "-2.115 if sated now, -23.86 if hungry" in texts[3]
    gain, gain_over_c = ((plan_d - plan) @ [0.7, 0.3] for plan in (longer_a, plan_c))
    assert round(float(gain), 2) == 0.17
    assert gain < gain_over_c  # plan A is better than C at this belief
    assert passes("alpha-vectors", 4, f"{gain}")
    assert not any(passes("alpha-vectors", 4, f"{end}") for end in plan_d - longer_a)
    crossing = (plan_c[0] - longer_a[0]) / np.ptp(plan_c - longer_a)
    assert compute_truth(
        open_position(PositionText("crying-baby", turns=10), Path()),
        QuantityCall(
            "best-action-boundary",
            {"below": "ignore", "above": "feed", "state": "hungry", "turns_left": 3},
        ),
    ).value == pytest.approx(crossing)


def passes(name: str, step: int, answer: str) -> bool:
    """Return whether an answer passes a step, counted from 1."""
    return give_answer(LessonRun(LESSONS[name], step - 1), answer).finishes_step


def test_only_claims_near_the_best_reply_earn_what_the_game_asks_for() -> None:
    claims = [claim for claim in range(2, 101) if passes("undercutting", 4, f"game: 10*{claim}")]
    assert claims == [94, 95, 96, 97]


def test_the_claims_of_the_opponent_are_those_in_the_text() -> None:
    claims = np.arange(2, 101)
    payoffs = np.minimum.outer(claims, claims) + 2 * np.sign(claims - claims[:, None])
    mix = np.full(99, 1 / 99)
    means = payoffs @ mix
    assert claims[np.isclose(means, means.max())].tolist() == [96, 97]
    assert round(means.max(), 2) == 49.08
    for _ in range(2):  # each level draws a reply by a softmax of precision 3
        weights = np.exp(3 * (payoffs @ mix - (payoffs @ mix).max()))
        mix = weights / weights.sum()
    assert claims[mix.argmax()] == 96
    assert round(mix[(claims >= 93) & (claims <= 99)].sum(), 2) == 0.94
    text = " ".join(LESSONS["undercutting"].steps[3].text)
    assert "94% of its claims are from 93 to 99, and 96 is the most frequent" in text


@pytest.mark.parametrize("move", ["e", "ne", "nw", "w", "sw", "se"])
@pytest.mark.parametrize(
    ("lesson", "step"), [("hunt-and-hide", 1), ("hunt-and-hide", 2), ("two-at-the-cradle", 4)]
)
def test_one_move_again_and_again_passes_no_hunt(lesson: str, step: int, move: str) -> None:
    assert not passes(lesson, step, f"game: 12*{move}")


RING = ((-1, 2), (0, 2), (1, 1), (1, 0), (0, 0), (-1, 1))
STEPS = {"e": (1, 0), "ne": (0, 1), "nw": (-1, 1), "w": (-1, 0), "sw": (0, -1), "se": (1, -1)}


def walk_round(run: LessonRun, turns: Sequence[int]) -> bool:
    """Play the hunt by steps round the ring, 1 or -1, or 0 to stay; return whether it passes."""
    session = run.position.session
    for turn in turns:
        names = session.problem.format_state(session.state).split()
        start = next(hex_ for hex_ in RING if names[0] == f"({hex_[0]},{hex_[1]})")
        goal = RING[(RING.index(start) + turn) % 6]
        difference = (goal[0] - start[0], goal[1] - start[1])
        blocked = next(
            name for name, (q, r) in STEPS.items() if (start[0] + q, start[1] + r) not in RING
        )
        name = next((name for name, step in STEPS.items() if step == difference), blocked)
        session.advance([session.problem.parse_action(0, name), None])
    return run.check_game(session).finishes_step


def test_no_walk_round_the_ring_without_a_look_passes_the_hunt() -> None:
    for length in (1, 2, 3, 4):
        for cycle in product((-1, 0, 1), repeat=length):
            turns = [cycle[turn % length] for turn in range(8)]
            assert not walk_round(LessonRun(LESSONS["two-at-the-cradle"], 3), turns), cycle


def test_the_partner_of_the_hunt_guards_its_hex_and_the_player_starts_where_the_text_says() -> None:
    run = LessonRun(LESSONS["two-at-the-cradle"], 3)
    assert "You start at (0,2), and your partner stays at (1,1)" in " ".join(run.step.text)
    assert run.position.problem.format_state(run.position.session.state).startswith("(0,2) (1,1)")
    session = run.position.session
    for _ in range(8):
        session.advance([0, None])
        assert session.problem.format_state(session.state).split()[1] == "(1,1)"


@pytest.mark.parametrize(("step", "goal", "rule"), [(1, -6, "chase"), (2, 0, "flee")])
def test_running_straight_fails_where_foresight_passes(step: int, goal: int, rule: str) -> None:
    run = LessonRun(LESSONS["hunt-and-hide"], step - 1)
    assert run.expected_answer == f"10 turns; score at least {goal}"
    assert play_ghost(run.position, rule).score < goal
    assert play_ghost(run.position, "best-response").score >= goal


def test_the_prey_that_steps_as_far_away_as_it_can_is_caught_when_the_text_says() -> None:
    run = LessonRun(LESSONS["hunt-and-hide"], 1)
    assert "it catches you in turn 6" in " ".join(run.step.text)
    assert play_ghost(run.position, "flee").score == pytest.approx(-100 * 0.9**5)


def test_no_shortest_way_to_the_prey_reaches_it_in_time() -> None:
    """Follow all shortest ways round the holes, by a model of the hunt of a few lines."""
    run = LessonRun(LESSONS["hunt-and-hide"], 0)
    hexes: list[tuple[int, int]] = [*run.position.problem.hexes]  # type: ignore[attr-defined]

    def step(hex_: tuple[int, int], name: str) -> tuple[int, int]:
        """Return the hex after a move, which stays if there is no hex."""
        goal = (hex_[0] + STEPS[name][0], hex_[1] + STEPS[name][1])
        return goal if goal in hexes else hex_

    def measure(start: tuple[int, int]) -> dict[tuple[int, int], int]:
        """Return the number of steps from a hex to each hex."""
        steps = {start: 0}
        for hex_ in (queue := [start]):
            for goal in (step(hex_, name) for name in STEPS):
                if goal not in steps:
                    steps[goal] = steps[hex_] + 1
                    queue.append(goal)
        return steps

    distances = {hex_: measure(hex_) for hex_ in hexes}
    assert run.position.problem.format_state(run.position.session.state) == "(1,0) (0,2)"
    pairs = {((1, 0), (0, 2))}
    for _ in range(9):  # a catch in turn 10 is paid in turn 11
        next_pairs = set()
        for predator, prey in pairs:
            fled = max((step(prey, name) for name in STEPS), key=distances[predator].__getitem__)
            ways = [step(predator, name) for name in STEPS]
            nearest = min(distances[prey][way] for way in ways)
            next_pairs |= {(way, fled) for way in ways if distances[prey][way] == nearest}
        pairs = next_pairs
        assert all(predator != prey for predator, prey in pairs)
    assert passes("hunt-and-hide", 1, "game: w nw ne e e 5*e")  # the other way round, then straight


def test_no_capture_and_one_in_the_last_turn_score_what_the_goal_is_between() -> None:
    no_capture = -sum(0.9**turn for turn in range(10))
    capture_in_turn_10 = no_capture + 2 * 0.9**9
    assert round(no_capture, 2) == -6.51
    assert no_capture < -6 <= capture_in_turn_10


@pytest.mark.parametrize("action", ["feed", "sing", "ignore"])
def test_one_action_again_and_again_does_not_pass_the_shared_care(action: str) -> None:
    assert not passes("two-at-the-cradle", 3, f"game: 10*{action}")


def test_feeding_only_after_cries_does_not_pass_the_shared_care() -> None:
    run = LessonRun(LESSONS["two-at-the-cradle"], 2)
    assert play_ghost(run.position, "feed-when-crying").score < -21


def test_the_plan_of_the_caregivers_passes_and_leaves_all_meals_to_the_player() -> None:
    plan = play_ghost(LessonRun(LESSONS["two-at-the-cradle"], 2).position, "joint-plan")
    problem = plan.session.problem
    actions = [
        tuple(problem.format_action(seat, turn.actions[seat]) for seat in (0, 1))
        for turn in plan.session.turns
    ]
    assert {partner for _, partner in actions} == {"ignore"}
    assert [action for action, _ in actions].count("feed") == 2
    assert plan.score >= -21


def test_the_earnings_in_the_text_are_those_of_the_machine() -> None:
    first, replacing, looking, game = (" ".join(s.text) for s in LESSONS["when-to-look"].steps)
    problem = load_problem("machine-replacement")
    tables = tabulate(problem)
    earnings = tables.rewards[:, 0, 0]
    assert "each good part fails with probability 0.1" in first
    assert np.allclose(tables.transition[0, 0], [0.9**2, 2 * 0.9 * 0.1, 0.1**2])
    assert f"manufacture earns only {earnings[2]:g} in each turn" in replacing
    assert (tables.transition[2, 0] == [0.0, 0.0, 1.0]).all()
    assert np.allclose(earnings - tables.rewards[:, 1, 0], 0.25)
    assert "To examine a product costs 0.25" in looking
    assert tables.observation_model[1, 0, 1] == 0.0  # no defect without a failed part
    assert np.allclose(tables.rewards[:, 2, 0], [-0.5, -1.5, -2.5])
    assert "repairs all parts for 0.5, and 1 more for each failed one" in game
    assert (tables.rewards[:, 3, 0] == -2).all()
    assert "To replace the machine costs 2 and takes a turn" in replacing
    belief = np.array([1.0, 0.0, 0.0])
    means = []
    for _ in range(8):
        means.append(float(belief @ earnings))
        belief = belief @ tables.transition[:, 0]
    listed = ", ".join(f"{mean:.3f}" for mean in means[1:])
    assert f"earns {means[0]:g}, {listed} and so on" in replacing
    assert f"you earn {sum(means):.2f} with 0 failed parts and {8 * earnings[2]:g}" in looking
    assert f"If you replace first, you earn {sum(means[:7]) - 2:.2f}" in looking


def test_an_examination_is_best_where_manufacturing_and_replacing_earn_the_same() -> None:
    equal = (2.92 - 2.0) / (5.43 - 2.0)
    for tenths, is_best in ((-1, False), (0, True), (1, True), (2, False)):
        p = equal + tenths / 10
        assert passes("when-to-look", 3, f"{p:.2f} 0 {1 - p:.2f}") == is_best


def test_a_repair_two_turns_from_the_best_one_loses_at_most_what_the_text_says() -> None:
    """Compare the expected earnings of 20 turns with one repair after some products."""
    tables = tabulate(load_problem("machine-replacement"))
    manufacture, interrupt = 0, 2

    def earn(products: int) -> float:
        """Return the expected earnings with a repair after these products."""
        belief, total = np.array([1.0, 0.0, 0.0]), 0.0
        for turn in range(20):
            action = interrupt if turn == products else manufacture
            total += float(belief @ tables.rewards[:, action, 0])
            belief = belief @ tables.transition[:, action]
        return total

    earnings = [earn(products) for products in range(20)]
    assert int(np.argmax(earnings)) == 8
    assert 0.11 < max(earnings) - min(earnings[6], earnings[10]) < 0.12
    text = " ".join(LESSONS["when-to-look"].steps[3].text)
    assert "A repair 2 turns early or late loses at most 0.12" in text


@pytest.mark.parametrize("name", LESSONS)
def test_three_kinds_of_wrong_answers_are_tested(name: str) -> None:
    assert len({wrong.reason for wrong in WRONG_ANSWERS[name]}) == 3


@pytest.mark.parametrize("lesson", LESSONS.values(), ids=LESSONS)
def test_a_lesson_is_short(lesson: TutorLesson) -> None:
    assert lesson.minutes <= 10
    assert 3 <= len(lesson.steps) <= 6
    for step in lesson.steps:
        assert 1 <= len(step.text) <= 4
        assert all(len(row) <= 80 for row in step.text)
        assert len(step.hint) <= 160
        assert len(step.learned) <= 160
        assert step.book


@pytest.mark.parametrize("lesson", LESSONS.values(), ids=LESSONS)
def test_each_sentence_of_a_lesson_is_short(lesson: TutorLesson) -> None:
    for step in lesson.steps:
        text = " ".join([*step.text, step.hint, step.learned])
        sentences = text.replace("?", ".").replace(":", ".").replace(";", ".").split(". ")
        assert max(len(sentence.split()) for sentence in sentences) <= 25


def test_the_algorithms_to_watch_fit_their_positions() -> None:
    watched = set()
    for lesson in LESSONS.values():
        for index, step in enumerate(lesson.steps):
            if not isinstance(step.task, GameTask) and step.task.watch:
                problem = LessonRun(lesson, index).position.problem
                assert not find_algorithm(step.task.watch).explain_misfit(problem)
                watched.add((lesson.number, index))
    assert watched == {(3, 3), (5, 2), (10, 0), (10, 1), (10, 2), (13, 3), (15, 2)}


@pytest.mark.parametrize("lesson", LESSONS.values(), ids=LESSONS)
def test_an_unplayed_game_passes_no_check(lesson: TutorLesson) -> None:
    for index, step in enumerate(lesson.steps):
        if isinstance(step.task, GameTask):
            position = LessonRun(lesson, index).position
            position.session.end("quit")
            assert not check_game_conditions(position, step.task).is_right


def test_the_answer_is_shown_only_after_the_hint_and_three_wrong_tries() -> None:
    run = LessonRun(LESSONS["straight-to-the-exit"], 1)
    for number in range(3):
        with pytest.raises(ValueError, match=f"wrong tries so far: {number}"):
            run.show_answer()
        reply = run.check_answer("w")
    assert reply.lines[-1] == "show prints the answer, and the progress records that."
    assert run.show_answer().lines[0] == "answer: nw."
    step = load_progress(run.lesson).steps[1]
    assert step == ("revealed", 3, 1)


def test_the_answer_of_a_game_is_how_the_best_agent_plays() -> None:
    run = LessonRun(LESSONS["rounds-matter"], 1)
    for _ in range(3):
        game = LessonRun(run.lesson, 1).position.session
        for _ in range(10):
            game.advance([0, None])
        run.check_game(game)
    assert run.show_answer().lines[0] == (
        "answer: with the same random numbers, plan-rounds plays 9 x cooperate, defect, and "
        "scores -9."
    )


def test_steps_that_are_finished_are_not_repeated() -> None:
    run = LessonRun(LESSONS["watch-v-converge"], 0, {1})
    run.check_answer("-0.3")
    assert run.index == 2
    run.skip_step()
    run.check_answer("4.256")
    assert run.is_over
    assert not run.is_passed


def test_the_second_wrong_try_gives_the_hint() -> None:
    run = LessonRun(LESSONS["discount"])
    run.check_answer("(1,1) (1,2) (5,2) (8,1)")
    reply = run.check_answer("(1,1) (1,2) (5,2) (8,1)")
    assert reply.lines[1] == f"hint: {run.step.hint}"


def test_a_game_with_other_draws_or_undone_first_turns_is_not_the_game_of_the_step() -> None:
    run = LessonRun(LESSONS["first-walk"], 2)  # its position is after one turn
    session = run.position.session
    assert run.is_game_of_step(session)
    changed = session.copy_at_start()
    changed.advance([1])
    assert not run.is_game_of_step(changed)
    assert not run.is_game_of_step(LessonRun(LESSONS["discount"]).position.session)
    rerolled = session.copy_at_start()
    rerolled.append_turns(session.turns)
    rerolled.reroll()
    assert not run.is_game_of_step(rerolled)


@pytest.mark.parametrize(
    ("step", "throw", "fragment"),
    [(1, "50", "0.119, 0.339, 0.661 and 0.881"), (2, "100", "0.005, 0.018, 0.065, 0.209")],
)
def test_the_chances_in_the_text_are_those_of_catch(step: int, throw: str, fragment: str) -> None:
    text = LESSONS["how-good-is-the-catcher"].steps[step - 1].text
    assert fragment in " ".join(text)
    problem = load_problem("catch")
    action = problem.actions[0].parse_action(throw)
    chances = tabulate(problem).observation_model[int(action), :, 0]
    written = [float(number) for number in fragment.replace(" and", ",").split(", ")]
    decimals = len(fragment.split(",", maxsplit=1)[0]) - 2
    assert np.round(chances, decimals).tolist() == written


@pytest.mark.parametrize(
    ("problem", "name", "texts"),
    [
        ("hexworld", "discount", {"discount": "discount is 0.9"}),
        (
            "hexworld",
            "watch-v-converge",
            {"slip": "slip has probability 0.3", "bump_cost": "always bumps, which costs 1"},
        ),
        ("hexworld", "first-walk", {"slip": "probability 0.3", "bump_cost": "each bump costs 1"}),
        (
            "crying-baby",
            "bayes-at-the-cradle",
            {
                "becomes_hungry": "becomes hungry with probability 0.1",
                "cries_hungry": "hungry baby cries with probability 0.8",
                "cries_sated": "sated one with 0.1",
                "hungry_reward": "hungry turn costs 10",
                "feed_reward": "feeding 5",
                "sing_reward": "Singing costs 0.5",
                "discount": "counts 0.9",
            },
        ),
        (
            "crying-baby",
            "alpha-vectors",
            {
                "hungry_reward": "begins hungry costs 10",
                "feed_reward": "feeding costs 5",
                "discount": "later turn counts 0.9",
                "becomes_hungry": "becomes hungry with 0.1",
            },
        ),
        (
            "simple-regulator",
            "push-to-zero",
            {"noise": "deviation is 0.1", "discount": "costs count less: 0.9"},
        ),
        (
            "multicaregiver-crying-baby",
            "two-at-the-cradle",
            {
                "feed_reward1": "costs you 2.5",
                "feed_reward2": "costs your partner 5",
                "hungry_reward": "each of you 10",
                "sing_reward1": "Singing costs you 0.5",
                "cries_hungry": "hungry baby cries with probability 0.9",
            },
        ),
    ],
)
def test_the_parameters_in_the_text_are_those_of_the_problem(
    problem: str, name: str, texts: dict[str, str]
) -> None:
    text = " ".join(" ".join([*step.text, step.hint]) for step in LESSONS[name].steps)
    for parameter, fragment in texts.items():
        value = getattr(load_problem(problem), parameter)
        assert fragment in text
        assert abs(value) == float(fragment.split()[-1]), parameter


ODD_LINES = (
    "nan", "inf", "-1e308", "1e999", "1/0", "1/3", "%", "50%", "0x10", "٣", "é", "\x00", "9" * 5000,
    "-1", "0", "1", "2.5", "1000000", "a", "(8,2)", "(8,2) nan", "(8,2) 0.5 (8,2) 0.5", "( , )",
    "(8,2) 2 (7,2) -1", "hungry 1", "hungry -1 sated 2", "hungry 0.5", "0 1 1 0 2 0", "1 2 3 4",
    "0 0 0 1e9", "nan 0 0 0", "feed feed", "e ne", "=", "a=b", "🂡", "[]", "None", "--help",
)  # fmt: skip


@pytest.mark.parametrize("lesson", LESSONS.values(), ids=LESSONS)
def test_odd_lines_are_answers_or_clear_errors(lesson: TutorLesson) -> None:
    for index, step in enumerate(lesson.steps):
        if isinstance(step.task, GameTask):
            continue
        run = LessonRun(lesson, index)
        for line in ODD_LINES:
            try:
                reply = run.check_answer(line)
                lines = reply.lines
                run = LessonRun(lesson, index) if reply.finishes_step else run
            except DmplayError as error:
                lines = (str(error),)
                assert str(lesson.path) not in lines[0]  # the line is at fault, not the lesson
            assert all("\n" not in text for text in lines)


@pytest.mark.parametrize("turns", [12, 20])
def test_the_best_play_from_a_new_machine_never_examines(turns: int) -> None:
    assert LESSONS["when-to-look"].steps[3].learned.endswith("is best, without a look.")
    position = open_position(PositionText("machine-replacement", turns=turns), Path())
    history: list[str] = []
    while len(history) < turns:
        best = compute_truth(
            position, QuantityCall("best-action", {"history": history} if history else {})
        ).value
        assert isinstance(best, frozenset)
        assert "examine" not in best
        assert turns != 12 or best == {"manufacture"}
        history.append(f"{min(best)} nondefective")  # without an examination, nothing is seen
    assert turns != 20 or history.count(NO_LOOK) == 19


def test_the_best_action_of_the_baby_changes_at_the_belief_of_step_three_also_with_five() -> None:
    position = open_position(PositionText("crying-baby", turns=10), Path())
    borders = [
        compute_truth(
            position,
            QuantityCall(
                "best-action-boundary",
                {"below": "ignore", "above": "feed", "state": "hungry", "turns_left": turns},
            ),
        ).value
        for turns in (3, 5)
    ]
    assert borders == pytest.approx([0.2834, 0.2831], abs=1e-4)


def test_singing_never_pays_with_the_usual_costs() -> None:
    assert LESSONS["alpha-vectors"].steps[3].learned.endswith("costs 0.5, so it does not pay.")
    assert load_problem("crying-baby").sing_reward == -0.5  # type: ignore[attr-defined]
    position = open_position(PositionText("crying-baby", turns=10), Path())
    for turns in range(1, 11):
        for percent in range(0, 101, 4):
            belief = f"hungry {percent / 100} sated {1 - percent / 100}"
            arguments = {"action": "sing", "belief": belief, "turns_left": turns}
            loss = compute_truth(position, QuantityCall("belief-loss", arguments)).value
            assert isinstance(loss, float)
            assert loss > 0.03


def show_answers(number: int) -> list[str]:
    """Return the lines that `show` prints at each prediction of a built-in lesson."""
    lesson = find_lesson(load_lessons(""), str(number))
    lines = list[str]()
    for index, step in enumerate(lesson.steps):
        if isinstance(step.task, Prediction):
            run = LessonRun(lesson, index)
            run.give_hint()
            for _ in range(3):
                run.check_answer("99")
            lines += run.show_answer().lines
    return lines


def test_show_prints_the_calculation_of_the_answer() -> None:
    lines = show_answers(3)
    east = "The best action, e, is worth 0.7 x (0 + 0.9 x 10) + 0.3 x (-1 + 0.9 x -0.3) = 5.919."
    assert lines[lines.index("answer: 5.919.") + 1] == east
    assert lines[lines.index("answer: 4.256.") + 1] == "0.473 x 0.9 / (1 - 0.9) = 4.256."
    assert "in sweep 6, the best two actions are" in lines[lines.index("answer: 6.") + 1]


def test_a_wrong_cost_keeps_the_sign_that_was_typed() -> None:
    run = LessonRun(find_lesson(load_lessons(""), "push-to-zero"), 2)
    assert run.check_answer("-1").lines[0].startswith("not yet. -1, a cost of 1, is too high. ")
    assert run.check_answer("1").lines[0].startswith("not yet. 1 is too high. ")
    assert run.check_answer("-0.01").lines[0].startswith("not yet. -0.01, a cost of 0.01, is too ")
    run.give_hint()
    answer, calculation, _ = run.show_answer().lines
    assert calculation.startswith("0.01 x (0.9 + 0.81 + 0.729 + ")
    assert calculation.endswith(f"= {answer.removeprefix('answer: ')}")


def test_a_meal_at_one_half_pays_from_three_turns_on() -> None:
    """The lesson on beliefs says so in a hint."""
    position = open_position(PositionText("crying-baby", turns=10), Path())
    is_better = []
    for turns_left in range(1, 11):
        values = [
            compute_truth(
                position,
                QuantityCall(
                    "belief-value",
                    {"action": action, "belief": "hungry 0.5 sated 0.5", "turns_left": turns_left},
                ),
            ).value
            for action in ("feed", "ignore")
        ]
        is_better.append(values[0] > values[1])  # type: ignore[operator]  # numbers
    assert is_better == [False] * 2 + [True] * 8
    hint = find_lesson(load_lessons(""), "bayes-at-the-cradle").steps[3].hint
    assert "at P(hungry) = 0.5, but not in the last two turns" in hint


def test_a_puzzle_names_the_formula_of_the_opponent() -> None:
    question = make_exercise(find_puzzle("travelers-dilemma:1")).question
    text = " ".join(question.describe_game())
    assert "proportional to exp(0.5 u); u is the expected reward of that action" in text
