"""Tests of the verdict on a finished game, on literal games with known numbers."""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Reals
from dmplay.core.tabular import tabulate
from dmplay.game import score_comparison, verdict
from dmplay.game.game import Game
from dmplay.game.hints.review import run_review
from dmplay.game.score_comparison import COMPARED_GAMES, MAX_COMPARED_TURNS, ScoreComparison
from dmplay.game.verdict import SeatChoices, Verdict, compute_verdict
from tests.support.programs import run_dmplay
from tests.support.screens import make_game

BABY_ACTIONS = ("sing", "ignore", "feed")


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let no part of a verdict be left out because the machine is slow."""
    for module in (verdict, score_comparison):
        monkeypatch.setattr(module, "MAX_SECONDS", 600.0)


def play(
    name: str, actions: Sequence[str], *opponents: str, seed: int = 7, turns: int | None = None
) -> Game:
    """Play a game of a person with these actions, against these agents."""
    game = make_game(name, "human", *opponents, seed=seed, turns=turns or len(actions))
    for action in actions:
        if game.session.over:
            break
        game.choose(game.keyboard.parse_action(game.view(), action))
    return game


def judge(game: Game) -> Verdict:
    return compute_verdict(game.session, game.advice_questions, game.ghost)


def compute_hexworld_q(turn_count: int) -> list[Reals]:
    """Return Q `[S, A]` with 0, 1, ... turns left, by backward induction."""
    problem = dmplay.load_problem("hexworld")
    tables = tabulate(problem)
    stages = [np.zeros(tables.rewards.shape[:2])]
    for _ in range(turn_count):
        values = stages[-1].max(axis=1)
        stages.append(tables.rewards[:, :, 0] + problem.discount * tables.transition @ values)
    return stages


def compute_baby_q(belief: Reals, turns_left: int) -> Reals:
    """Return Q `[A]` of a belief `[S]` by searching all actions and observations."""
    problem = dmplay.load_problem("crying-baby")
    tables = tabulate(problem)
    q = belief @ tables.rewards[:, :, 0]
    if turns_left > 1:
        for action in range(len(q)):
            for next_belief in _next_joint_beliefs(belief, action):
                share = next_belief.sum()
                if share > 0:
                    next_q = compute_baby_q(next_belief / share, turns_left - 1)
                    q[action] += problem.discount * share * next_q.max()
    return q


def _next_joint_beliefs(belief: Reals, action: int) -> list[Reals]:
    """Return P(o, s' | b, a) as one array `[S']` for each observation."""
    tables = tabulate(dmplay.load_problem("crying-baby"))
    assert tables.observation is not None
    joint = (belief @ tables.transition[:, action])[:, None] * tables.observation[action]
    return [*joint.T]


@pytest.mark.parametrize("seed", [1, 7, 11])
def test_luck_and_regret_in_hexworld_are_those_of_backward_induction(seed: int) -> None:
    game = play("hexworld", ["e", "w", "sw", "se"], seed=seed)
    problem, session = game.problem, game.session
    q, regret, luck = compute_hexworld_q(4), 0.0, 0.0
    states = [session.initial_state, *(turn.state for turn in session.turns)]
    indices = problem.state_indices(np.array(states))
    for t, turn in enumerate(session.turns):
        weight, left = problem.discount**t, 4 - t
        before, after = q[left][indices[t]], q[left - 1][indices[t + 1]].max()
        action = int(turn.actions[0])
        regret += weight * (before.max() - before[action])
        luck += weight * (turn.rewards[0] + problem.discount * after - before[action])
    (choices,) = judge(game).choices
    assert choices.regret == pytest.approx(regret)
    assert choices.luck == pytest.approx(luck)
    assert choices.start_value == pytest.approx(q[4][indices[0]].max())
    assert choices.score == pytest.approx(q[4][indices[0]].max() - regret + luck)


def test_luck_and_regret_in_the_crying_baby_are_those_of_a_search_of_all_beliefs() -> None:
    game = play("crying-baby", BABY_ACTIONS)
    problem, belief = game.problem, np.array([0.5, 0.5])
    q_by_turn = []
    for left, turn in zip((3, 2, 1), game.session.turns, strict=True):
        q_by_turn.append(compute_baby_q(belief, left))
        joint = _next_joint_beliefs(belief, int(turn.actions[0]))[int(turn.observations[0])]
        belief = joint / joint.sum()
    chosen = [int(turn.actions[0]) for turn in game.session.turns]
    weights = problem.discount ** np.arange(3)
    regret = sum(
        weight * (q.max() - q[a]) for weight, q, a in zip(weights, q_by_turn, chosen, strict=True)
    )
    (choices,) = judge(game).choices
    assert choices.regret == pytest.approx(regret)
    assert choices.start_value == pytest.approx(q_by_turn[0].max())
    assert choices.luck == pytest.approx(choices.score - q_by_turn[0].max() + regret)


def test_the_lines_of_a_game_of_hexworld() -> None:
    assert judge(play("hexworld", ["e", "e", "w"])).lines == [
        "verdict: fair choices, bad luck",
        "bronze medal: your choices lost 4.07 (the regret); silver is for at most 0.12, the loss "
        "of the rule nearest-exit (walks by a shortest path to the nearest good exit, as if no "
        "step slipped)",
        "choices: best action 1 of 3 times; worst: turn 1, chose e, not se: 3.20 lost",
        "score -0.90 = best play's average 3.75 - your choices 4.07 - luck 0.58",
        "same start and luck: optimal scored 8.1, you -0.9",
    ]


@pytest.mark.parametrize(
    ("score", "start", "regret", "numbers"),
    [
        (7.29, 7.0444, 0.7766, ("7.29", "7.04", "0.78", " + luck 1.03")),
        (-1.0, 0.504, 0.504, ("-1.00", "0.50", "0.50", " - luck 1.00")),
        (0.5, 1.004, 0.504, ("0.50", "1.00", "0.50", "")),
    ],
)  # fmt: skip
def test_the_parts_of_a_score_add_up_as_printed(
    score: float, start: float, regret: float, numbers: Sequence[str]
) -> None:
    luck = round(score - start + regret, 9)
    choices = SeatChoices(
        "agent", 4, 3, ValuesBasis(Accuracy.EXACT), score, regret, start_value=start, luck=luck
    )
    total, best, lost, luck_text = numbers
    assert choices.format_choice_lines()[1] == (
        f"score {total} = best play's average {best} - your choices {lost}{luck_text}"
    )


def test_choices_that_lost_next_to_nothing_are_counted_apart() -> None:
    (choices,) = judge(play("travelers-dilemma", ["95", "96", "2"], "level-k")).choices
    assert choices.regret is not None
    assert (choices.best_count, choices.near_count, choices.count) == (1, 1, 3)
    assert "best or nearly best action 2 of 3 times" in choices.format_choice_lines()[0]


def test_the_mean_luck_of_many_games_is_zero() -> None:
    lucks = []
    for seed in range(60):
        game = play("hexworld", ["se", "se"], seed=seed)
        (choices,) = judge(game).choices
        lucks.append(choices.luck or 0.0)
    standard_error = np.std(lucks) / np.sqrt(len(lucks))
    assert standard_error > 0
    assert abs(np.mean(lucks)) < 3 * standard_error


def test_a_flawless_game_has_no_worst_action() -> None:
    (choices,) = judge(play("prisoners-dilemma", ["cooperate", "defect"], "tit-for-tat")).choices
    assert (choices.best_count, choices.count, choices.regret) == (2, 2, 0.0)
    assert choices.worst is None
    assert choices.format_choice_lines() == ["choices: best action 2 of 2 times"]


@pytest.mark.parametrize(
    ("name", "opponent", "actions"),
    [
        ("prisoners-dilemma", "search", ["cooperate", "defect"]),  # no known rule
        ("predator-prey", "search", ["e", "w"]),  # the values assume another opponent
        ("multicaregiver-crying-baby", "search", ["feed", "sing"]),  # assumed to be random
        ("collaborative-predator-prey", "sweep", ["e", "w", "e"]),  # bounds
    ],
)
def test_no_regret_is_stated_where_the_values_are_about_another_game(
    name: str, opponent: str, actions: Sequence[str]
) -> None:
    game = play(name, actions, opponent)
    run_review(game.session, game.advice_questions)  # solves the problem, without a time limit
    (choices,) = judge(game).choices
    assert (choices.regret, choices.luck, choices.worst) == (None, None, None)
    assert "regret" not in choices.data
    (line,) = choices.format_choice_lines()
    assert " by the " in line or "judged" in line


@pytest.mark.parametrize(
    ("name", "opponent", "actions", "has_luck"),
    [
        ("prisoners-dilemma", "tit-for-tat", ["cooperate", "cooperate"], False),
        ("predator-prey", "flee", ["e", "w"], False),
        ("multicaregiver-crying-baby", "random", ["feed", "sing"], True),
        ("multicaregiver-crying-baby", "feed-when-crying", ["feed", "sing"], True),
    ],
)
def test_the_choices_of_known_opponents_are_luck(
    name: str, opponent: str, actions: Sequence[str], *, has_luck: bool
) -> None:
    game = play(name, actions, opponent)
    (choices,) = judge(game).choices
    assert choices.regret is not None
    assert (choices.luck != 0.0) == has_luck
    other = game.problem.agents[1]
    lines = choices.format_choice_lines()
    assert any(f"{other}'s choices included" in line for line in lines) == has_luck


def test_the_mean_luck_against_a_known_opponent_is_zero() -> None:
    lucks = []
    for seed in range(60):
        game = play("multicaregiver-crying-baby", ["feed", "sing"], "feed-when-crying", seed=seed)
        (choices,) = judge(game).choices
        lucks.append(choices.luck or 0.0)
    assert abs(np.mean(lucks)) < 3 * np.std(lucks) / np.sqrt(len(lucks))


def test_regrets_against_a_known_rule_count_all_turns_of_a_long_game() -> None:
    game = play("prisoners-dilemma", ["cooperate"] * 101, "tit-for-tat")
    (choices,) = judge(game).choices
    assert (choices.regret, choices.best_count) == (1.0, 100)  # in the last turn, defect is best


def test_values_of_a_shorter_plan_than_the_game_give_no_regret() -> None:
    game = play("catch", ["50"] * 21, turns=21)
    assert all(choices.regret is None for choices in judge(game).choices)


def test_a_good_game_in_which_the_other_earns_more_says_what_the_aim_is() -> None:
    claims = ["96"] * 20
    assert (
        "not to have more than agent2"
        in judge(play("travelers-dilemma", claims, "level-k")).summary
    )
    rounds = judge(
        play("rock-paper-scissors", ["scissors"], "nash")
    )  # a contest, in which the lead counts
    assert "not to have more" not in rounds.summary


def test_a_game_too_short_for_a_choice_to_matter_says_so() -> None:
    verdict = judge(play("cart-pole", ["left"] * 4, turns=4))
    assert verdict.summary == "in 4 turns no choice changes the score"
    assert not any(line.startswith("choices: ") for line in verdict.lines)


def test_a_score_that_most_random_games_reach_earns_no_medal() -> None:
    verdict = judge(play("cart-pole", ["right", "left"] * 6, turns=12))
    assert verdict.medal is not None
    assert not verdict.medal.name
    assert not verdict.medal.limits
    assert verdict.summary.startswith("12 turns are too few")


def test_a_worst_choice_is_the_seats_own_and_needs_a_known_regret() -> None:
    judged = judge(play("simple-regulator", ["0.3"] * 3))
    choices = replace(judged.choices[0], worst=None)
    assert choices.name_worst_choice(judged.moves).worst in judged.moves
    assert replace(choices, seat="another").name_worst_choice(judged.moves).worst is None
    assert replace(choices, regret=None).name_worst_choice(judged.moves).worst is None


@pytest.mark.parametrize("push", ["0.3", "0.005"])
def test_a_medal_below_gold_names_a_choice_that_cost_it(push: str) -> None:
    verdict = judge(play("simple-regulator", [push] * 3))
    assert verdict.medal is not None
    (choices,) = verdict.choices
    assert (verdict.medal.is_best, choices.worst is None) in {(True, True), (False, False)}
    assert choices.near_count == 0


def test_a_careless_player_measures_choices_where_random_play_is_absurd() -> None:
    verdict = judge(play("simple-regulator", ["-0.5"] * 4))
    assert verdict.summary.startswith("choices no better than the rule no-push (never pushes)")
    assert verdict.medal is not None
    assert not verdict.medal.name
    assert [*verdict.medal.limits] == ["gold", "silver", "bronze"]


def test_every_mark_has_a_worst_choice_with_its_cost() -> None:
    game = play("collision-avoidance", ["climb", "descend", "climb", "descend"], turns=4)
    verdict = judge(game)
    assert verdict.marks
    assert any("worst: turn " in line and " lost" in line for line in verdict.lines)


def test_a_loss_next_to_nothing_is_no_costly_choice() -> None:
    (move, *_) = run_review((game := play("hexworld", ["w", "se"])).session, game.advice_questions)
    best = max(move.values.values())
    little = move._replace(regret=0.004 * best, values=move.values)
    assert [len(Verdict((item,)).costly_choices) for item in (move, little)] == [1, 0]


def test_rerolled_random_numbers_are_not_luck() -> None:
    game = play("hexworld", ["e", "e"], turns=3)
    game.reroll()
    game.choose(0)
    (choices,) = judge(game).choices
    assert choices.regret is not None
    assert choices.luck is None


def test_a_game_that_was_left_has_no_verdict() -> None:
    game = play("hexworld", ["e"], turns=3)
    game.finish()
    assert judge(game) == Verdict()
    assert len(game.closing_lines()) == 1


def test_two_people_with_different_rewards_are_not_compared() -> None:
    game = make_game("rock-paper-scissors", turns=1)
    game.choose(0)
    game.choose(1)
    verdict = judge(game)
    assert verdict.comparisons == ()
    assert [choices.regret for choices in verdict.choices] == [None, None]


def test_a_script_is_known_in_the_game_and_in_its_review(tmp_path: Path) -> None:
    moves = "cooperate,defect,cooperate"
    game = play("prisoners-dilemma", ["cooperate", "defect", "cooperate"], f"script:{moves}")
    (choices,) = judge(game).choices
    assert (choices.count, choices.best_count, choices.regret) == (3, 1, 2.0)
    arguments = ("prisoners-dilemma", "--turns", "3", "--vs", f"script:{moves}", "-o", "p.dmt")
    run_dmplay(tmp_path, *arguments, stdin=moves.replace(",", "\n"))
    reviewed = json.loads(run_dmplay(tmp_path, "review", "p.dmt", "--json").stdout)
    assert [move["regret"] for move in reviewed["actions"]] == [1.0, 0.0, 1.0]
    learned = run_dmplay(tmp_path, "learn", "from", "p.dmt", stdin="defect\ndefect\n").stdout
    assert f"agent2 plays this list of actions: {moves.replace(',', ', ')}." in learned
    run_dmplay(tmp_path, *arguments, "--force", stdin="cooperate\nquit\n")
    summary = run_dmplay(tmp_path, "review", "p.dmt").stdout
    assert "and not script" in summary  # what it would have played is not in the file


@pytest.mark.parametrize("opponent", ["script:cooperate", "search"])
def test_a_score_is_not_compared_if_the_opponents_cannot_play_many_games(opponent: str) -> None:
    game = play("prisoners-dilemma", ["cooperate"], opponent)
    assert judge(game).comparisons == ()


def test_a_game_that_goes_on_scores_less_if_its_return_can_only_fall() -> None:
    game = play("mountain-car", [*["left"] * 23, *["right"] * 57], turns=10_000)
    assert game.session.end_reason == "terminal"
    assert game.problem.reward_bounds == (-1.0, 0.0)
    counts = {comparison.agent: comparison.lower_count for comparison in judge(game).comparisons}
    returns = dmplay.rollout(
        game.problem,
        [dmplay.load_agent(game.problem, 0, "random")],
        episodes=COMPARED_GAMES,
        turn_limit=100,
        seed=1_000_005,
        start_uniforms=game.session.initial_uniforms,
    ).returns[:, 0]
    assert counts["random"] == (returns < -80).sum()


def test_games_that_go_on_and_may_still_score_more_are_not_compared() -> None:
    game = play("rock-paper-scissors", ["rock"] * (MAX_COMPARED_TURNS + 1), "random")
    assert game.session.over
    assert judge(game).comparisons == ()


def test_equal_scores_are_not_better() -> None:
    problem = "simple-regulator"
    game = play(problem, ["0"], seed=7)
    (comparison, _) = judge(game).comparisons
    returns = dmplay.rollout(
        game.problem,
        [dmplay.load_agent(game.problem, 0, "no-push")],
        episodes=COMPARED_GAMES,
        turn_limit=1,
        seed=1_000_005,
        start_uniforms=game.session.initial_uniforms,
    ).returns[:, 0]
    score = game.session.seat_return(0)
    assert comparison.agent == "no-push"
    assert comparison.lower_count == (returns < score).sum()
    assert comparison.equal_count == (returns == score).sum()
    assert (
        ScoreComparison("random", 100, 0).describe() == "100 random games: 100 scored more than you"
    )


def test_a_score_that_every_game_has_is_equal_and_not_worse() -> None:
    game = play("cart-pole", ["left"], turns=1)  # a pole cannot fall in one turn
    assert [item.describe() for item in judge(game).comparisons] == [
        "100 random games (same start): 100 scored as much as you",
        "100 regulate games (same start): 100 scored as much as you",
    ]


def test_json_games_end_with_the_verdict_as_an_object(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "hexworld", "--seed", "7", "--turns", "3", "--json", stdin="e\ne\nw\n"
    )
    end = json.loads(result.stdout.splitlines()[-1])
    facts = end["verdict"]["seats"]["agent"]
    assert (facts["choices"], facts["best"], facts["accuracy"], facts["scope"]) == (
        3, 1, "exact", "",
    )  # fmt: skip
    assert facts["worst"]["turn"] == 1
    assert facts["worst"]["best"] == ["se"]
    assert end["return"]["agent"] == pytest.approx(
        facts["expected"] - facts["regret"] + facts["luck"]
    )
    assert end["verdict"]["comparisons"] == [
        {"agent": "random", "games": 100, "lower": 54, "equal": 19},
        {"agent": "optimal", "games": 100, "lower": 0, "equal": 26},
    ]


def test_an_unfinished_json_game_ends_without_a_verdict(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", "--json", stdin="e\nquit\n")
    assert "verdict" not in json.loads(result.stdout.splitlines()[-1])
