"""Tests of medals: the expected scores that they compare, their limits, and games without one."""

from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.agents.expected_return import compute_expected_return
from dmplay.core.problem import initial_state_distribution
from dmplay.game.medals import AgentValue, award_medal
from dmplay.registry import agents, problems
from tests.support.programs import run_dmplay
from tests.support.screens import make_game

RULE_OF_USER = """
from dataclasses import dataclass

import numpy as np

from dmplay import Labels, Roster, SeatPolicy, StationaryPolicy, Tables, Tabular


class Coin(Tabular):
    actions, horizon = (Labels(("heads", "tails", "edge")),), 2
    state_count, state_names = 1, ("only",)
    tables = Tables([[[1.0]] * 3], [[[10.0], [9.0], [0.0]]])


@dataclass(frozen=True)
class Tails(StationaryPolicy):
    def choose_from_states(self, s, legal):
        return np.ones(len(s), int)


AGENTS = Roster({"tails": Tails}, rule_of_thumb="tails")
"""


@pytest.mark.parametrize(
    ("name", "agent"),
    [("hexworld", "nearest-exit"), ("crying-baby", "feed-when-crying"), ("catch", "greedy"),
     ("predator-prey", "chase"), ("machine-replacement", "random")],
)  # fmt: skip
def test_the_expected_return_is_the_mean_of_many_games(name: str, agent: str) -> None:
    problem = problems.load_problem(name)
    partners = range(1, len(problem.agents))
    policies = [agents.load_agent(problem, 0, agent)] + [
        agents.load_agent(problem, seat, "random") for seat in partners
    ]
    probabilities, states = initial_state_distribution(problem)
    expected = compute_expected_return(problem, policies, 0, 8, (states, probabilities))
    returns = dmplay.rollout(problem, policies, episodes=4000, turn_limit=8, seed=3).returns[:, 0]
    assert expected == pytest.approx(returns.mean(), abs=5 * returns.std() / np.sqrt(len(returns)))


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("loss", "medal"), [(0.0, "gold"), (0.1, "gold"), (0.2, "silver"), (9.0, "bronze"), (11.0, "")]
)
def test_the_medal_is_the_same_at_every_scale_of_rewards(
    loss: float, medal: str, scale: float
) -> None:
    best, rule, random = (
        AgentValue(name, score * scale, is_exact=True)
        for name, score in (("", 10.0), ("rule", 8.0), ("random", 0.0))
    )
    earned = award_medal(loss * scale, best, rule, random, 100, scale)
    assert earned.name == medal
    assert {name: limit / scale for name, (limit, _) in earned.limits.items()} == pytest.approx(
        {"gold": 0.1, "silver": 2.0, "bronze": 10.0}
    )


def test_there_is_no_medal_if_random_play_loses_nothing() -> None:
    value = AgentValue("random", 1.0, is_exact=True)
    medal = award_medal(0.0, AgentValue("", 1.0, is_exact=True), None, value, 100, 1.0)
    assert (medal.name, medal.limits) == ("", {})
    assert "about as good" in medal.describe_score()


@pytest.mark.parametrize(
    ("rule", "missing"),
    [(("rule", 8.0), []), (("rule", 9.95), ["silver"]), (("rule", -1.0), ["silver"]),
     (None, ["silver"]), (("best", 10.0), ["gold"])],
)  # fmt: skip
def test_a_medal_that_cannot_be_won_has_a_reason(
    rule: tuple[str, float] | None, missing: list[str]
) -> None:
    values = {"best": 10.0, "random": 0.0}
    best, random = (AgentValue(*item, is_exact=False) for item in values.items())
    thumb = AgentValue(*rule, is_exact=False) if rule else None
    medal = award_medal(9.0, best, thumb, random, 100, 1.0)
    assert [*medal.missing] == missing
    is_best = next(iter(medal.limits)) == medal.name
    assert all((f"no {name}: " in str(medal)) == is_best for name in medal.missing)
    assert {*medal.limits} | {*missing} == {"gold", "silver", "bronze"}


@pytest.mark.parametrize(("random_score", "has_limits"), [(1.0, True), (1.9, False), (2.5, False)])
def test_luck_decides_if_mean_scores_differ_by_less_than_their_errors(
    random_score: float, has_limits: bool
) -> None:
    strong = AgentValue("qmdp", 2.0, is_exact=False, error=0.1)
    random = AgentValue("random", random_score, is_exact=False, error=0.1)
    medal = award_medal(-1.0, strong, None, random, 100, 1.0)
    assert medal.name == ("gold" if has_limits else "")
    assert ("no medals here" in str(medal)) != has_limits


def test_a_game_that_loses_as_much_as_random_play_earns_no_bronze() -> None:
    best, random = AgentValue("", 1.0, is_exact=True), AgentValue("random", 0.0, is_exact=True)
    losses = {1.0: "", 0.99: "bronze"}
    for loss, name in losses.items():
        medal = award_medal(loss, best, None, random, 100, 1.0)
        assert medal.name == name


@pytest.mark.parametrize(
    ("loss", "rank"),
    [(-1.0, "above the average of optimal"), (0.05, "close to the average of optimal"),
     (2.0, "above the average of the rule rule, below that of optimal"),
     (9.0, "above the average of random play, below that of the rule rule"),
     (10.0, "not above the average of random play")],
)  # fmt: skip
def test_a_score_without_known_regret_is_ranked_among_mean_scores(loss: float, rank: str) -> None:
    best, rule, random = (
        AgentValue(name, score, is_exact=False, error=0.1)
        for name, score in (("optimal", 10.0), ("rule", 8.0), ("random", 0.0))
    )
    medal = award_medal(loss, best, rule, random, 100, 1.0)
    assert medal.describe_score() == f"score {rank}"


def test_hints_and_undone_turns_cost_the_medal_and_the_end_says_so() -> None:
    game = make_game("crying-baby", turns=2)
    game.record_hint()
    game.choose(0.0)
    game.undo()
    game.choose(0.0)
    game.choose(2.0)
    verdict = game.compute_verdict()
    assert verdict.earned_medal is None
    assert verdict.lines[:2] == [
        f"verdict: {verdict.summary}",
        "would be bronze; no medal and no record, because of 1 hint and 1 undo; a new game counts",
    ]


@pytest.mark.parametrize("front_end", ["lines", "shell", "json"])
def test_lines_and_shell_say_once_that_help_costs_the_medal(front_end: str, tmp_path: Path) -> None:
    words = ["hexworld", "--seed", "7", "-o", "g.dmt", *["--json"] * (front_end == "json")]
    typed = "hint\nhint\ne\nundo\n"
    if front_end == "shell":
        words, typed = ["shell"], f"play hexworld --seed 7\n{typed}"
    output = run_dmplay(tmp_path, *words, stdin=typed).stdout
    assert output.count("counts for no medal") == (front_end != "json")


def test_a_game_against_other_players_than_the_default_ones_is_no_record(tmp_path: Path) -> None:
    words = ("prisoners-dilemma", "--vs", "grim", "--turns", "1", "-o", "g.dmt")
    end = run_dmplay(tmp_path, *words, stdin="d\n").stdout
    assert "gold medal: your choices lost nothing" in end
    assert "no record: records are against the default players" in end


def test_a_user_names_a_rule_of_thumb_and_records_list_the_medal(tmp_path: Path) -> None:
    (tmp_path / "coin.py").write_text(RULE_OF_USER)
    end = run_dmplay(tmp_path, "./coin.py", stdin="tails\nheads\n").stdout
    assert "silver medal: your choices lost 1.00 (the regret); " in end
    assert "gold is for at most " in end
    end = run_dmplay(
        tmp_path, "crying-baby", "--seed", "7", "-o", "g.dmt", stdin="feed\n" * 20
    ).stdout
    assert " medal: your choices lost " in end
    assert "new record: " in end
    assert "the loss of random play" in end
    columns = run_dmplay(tmp_path, "records").stdout.splitlines()
    assert columns[0].split() == [
        "problem", "seat", "record", "turns", "seed", "day", "last", "best", "medal", "remark",
    ]  # fmt: skip
    assert columns[1].split()[-1] in ("gold", "silver", "bronze", "-")


def test_a_finished_game_ends_with_a_line_to_share(tmp_path: Path) -> None:
    arguments = ("hexworld", "--seed", "7", "--turns", "4", "-o", "walk.dmt", "--ascii")
    result = run_dmplay(tmp_path, *arguments, stdin="e\nsw\nse\nse\n")
    (line,) = (row for row in result.stderr.splitlines() if row.startswith("share: "))
    assert line.startswith("share: hexworld seed 7, score 7.29, bronze medal, ")
    marks, _, command = line.rpartition(", ")[2].partition(": ")
    assert len(marks) == 4
    assert marks[1:] == "___"
    assert marks[0] in "=#"
    assert command == "dmplay hexworld --turns 4 --seed 7"
    unfinished = run_dmplay(tmp_path, *arguments, "--force", stdin="e\nquit\n").stderr
    assert "share: " not in unfinished


def test_a_second_try_leaves_the_line_to_share_of_the_first(tmp_path: Path) -> None:
    moves = "e\nsw\nse\nse\nbranch 0\nse\nse\nse\nse\n"
    shell = run_dmplay(tmp_path, "shell", stdin=f"play hexworld --seed 7\n{moves}")
    shares = [row for row in shell.stderr.splitlines() if row.startswith("share: ")]
    assert ["medal" in row for row in shares] == [True, False]
    assert all("hexworld seed 7, score " in row for row in shares)


def test_an_equal_score_is_no_new_record(tmp_path: Path) -> None:
    """The score has more digits than the screen shows."""
    arguments, moves = ("hexworld", "--seed", "7"), "e\nse\nse\nse\nse\nse\n"
    first, second = (run_dmplay(tmp_path, *arguments, stdin=moves).stdout for _ in range(2))
    assert "new record: 4.195, your first" in first
    assert "new record" not in second
    assert "your record: 4.195" in second


def test_the_command_of_a_continued_game_names_no_default_player(tmp_path: Path) -> None:
    path = tmp_path / "walk.dmt"
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", path.name, stdin="e\nse\n")
    result = run_dmplay(tmp_path, "resume", path.name, stdin="se\nse\nse\nse\n")
    assert result.stderr.rstrip().endswith(": dmplay hexworld --seed 7")
