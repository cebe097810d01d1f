"""Tests that a program that forfeits a game does not end the games of others."""

import json
import shlex
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.errors import BadPolicy, Forfeit
from dmplay.evaluation.comparison import compare
from dmplay.evaluation.many_games import RunResult, run
from dmplay.evaluation.tournament import run_tournament
from dmplay.external.bots.bot_policy import Bot
from tests.support.programs import run_dmplay

# It chooses the first legal action, and ends when it is asked in one of the games that its command
# names by their first observation, or when it was asked a certain number of times.
BOT_SOURCE = """
import json, sys
from pathlib import Path
fatal, limit = sys.argv[1].split(";"), int(sys.argv[2])
for line in sys.stdin:
    message = json.loads(line)
    if message["type"] == "hello":
        print(json.dumps({"type": "hello", "protocol": 1, "wants": ["history"]}), flush=True)
    elif message["type"] == "act":
        limit -= 1
        starts = [turn["observation"] for turn in message["history"]] + [message["observation"]]
        if starts[0] in fatal or limit < 0:
            sys.exit(3)
        answer = {"type": "act", "id": message["id"], "action": message["legal"][0]}
        print(json.dumps(answer), flush=True)
"""
BOTS = list[Bot]()
DEAD = "dead: the bot ended with exit code 3"


@pytest.fixture
def source(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    (tmp_path / "bot.py").write_text(BOT_SOURCE)
    monkeypatch.chdir(tmp_path)
    yield tmp_path
    while BOTS:
        BOTS.pop().close()


def make_bot(problem: dmplay.Problem, seat: int, fatal_states: str, max_answers: int) -> Bot:
    """Return a bot that ends in games with these first states, or after so many answers."""
    words = [sys.executable, "-S", "-E", "bot.py", fatal_states, str(max_answers)]
    bot = Bot(problem, seat, shlex.join(words))
    BOTS.append(bot)
    return bot


def run_hexworld(
    fatal_states: str = "", *, max_answers: int = 10**9, workers: int = 1
) -> RunResult:
    """Return the summary of 12 games of 3 turns."""
    problem = dmplay.load_problem("hexworld")
    bot = make_bot(problem, 0, fatal_states, max_answers)
    return run(problem, [bot], episodes=12, turns=3, workers=workers)


@pytest.mark.parametrize("workers", [1, 2])
@pytest.mark.usefixtures("source")
def test_games_in_which_a_program_forfeits_are_left_out_and_listed(workers: int) -> None:
    # The games of seed 0 begin in (6,2), (5,2), (3,2), (9,0), (7,1), (5,2), (4,1), ...
    result = run_hexworld("(9,0);(4,1)", workers=workers)
    assert [(error.episode, str(error)) for error in result.forfeits] == [
        (3, f"agent forfeits, {DEAD}"),
        (6, f"agent forfeits, {DEAD}"),
    ]
    assert result.episode_numbers.tolist() == [0, 1, 2, 4, 5, 7, 8, 9, 10, 11]
    whole = run_hexworld()
    assert not whole.forfeits
    assert np.array_equal(result.rollout.returns, np.delete(whole.rollout.returns, [3, 6], axis=0))
    assert result.shortfall_reason == ""


@pytest.mark.usefixtures("source")
def test_a_run_ends_with_the_fourth_forfeit_and_reports_the_games_before() -> None:
    result = run_hexworld("(6,2);(3,2);(7,1);(0,0)")
    assert [error.episode for error in result.forfeits] == [0, 2, 4]
    assert result.shortfall_reason == f"agent forfeits, {DEAD}"
    assert result.episode_numbers.tolist() == [1, 3]


@pytest.mark.parametrize(
    ("fatal_states", "max_answers", "episodes"),
    [("", 0, 12), ("(6,2)", 10**9, 1)],
    ids=["it never answers", "its only game"],
)
@pytest.mark.usefixtures("source")
def test_a_run_without_a_finished_game_is_an_error(
    fatal_states: str, max_answers: int, episodes: int
) -> None:
    problem = dmplay.load_problem("hexworld")
    bot = make_bot(problem, 0, fatal_states, max_answers)
    with pytest.raises(Forfeit, match=DEAD):
        run(problem, [bot], episodes=episodes, turns=3)


@pytest.mark.usefixtures("source")
def test_a_program_that_cannot_start_again_ends_the_run_with_the_games_before(
    tmp_path: Path,
) -> None:
    problem = dmplay.load_problem("hexworld")
    once = tmp_path / "once.sh"
    once.write_text(f'[ -e started ] && exit 4; touch started; exec {sys.executable} bot.py "$@"')
    bot = Bot(problem, 0, "bash once.sh '(9,0)' 1000")
    with pytest.raises(Forfeit, match="dead: the bot ended with exit code 4"):
        run(problem, [bot], episodes=12, turns=3)


@pytest.mark.usefixtures("source")
def test_a_comparison_goes_on_without_an_entrant_that_forfeits() -> None:
    problem = dmplay.load_problem("hexworld")
    bot = make_bot(problem, 0, "(9,0)", 10**9)
    random, optimal = (dmplay.load_agent(problem, 0, name) for name in ("random", "optimal"))
    result = compare(problem, [[random], [bot], [optimal]], episodes=12, turns=3)
    assert result.active == (0, 2)
    withdrawal = f"Bot:command={bot.command} is withdrawn from the comparison"
    assert result.withdrawals == (f"{withdrawal}: agent forfeits, {DEAD}",)
    without_bot = compare(problem, [[random], [optimal]], episodes=12, turns=3)
    assert np.array_equal(result.returns, without_bot.returns)
    with pytest.raises(BadPolicy, match=f"theirs: agent forfeits, {DEAD}"):
        compare(problem, [[random], [bot]], episodes=12, turns=3, names=["random", "theirs"])


@pytest.mark.usefixtures("source")
def test_a_forfeit_of_the_common_opponent_ends_a_comparison() -> None:
    problem = dmplay.load_problem("rock-paper-scissors")
    bot = make_bot(problem, 1, "", 0)
    agents = [dmplay.load_agent(problem, 0, "random") for _ in range(3)]
    with pytest.raises(BadPolicy, match=f"agent2 forfeits, {DEAD}"):
        compare(problem, [[agent, bot] for agent in agents], episodes=5, turns=3)


@pytest.mark.usefixtures("source")
def test_a_tournament_goes_on_without_an_entrant_that_forfeits() -> None:
    problem = dmplay.load_problem("rock-paper-scissors")
    entrants: dict[str, list[dmplay.Policy]] = {
        "random": [dmplay.load_agent(problem, seat, "random") for seat in (0, 1)],
        "theirs": [make_bot(problem, seat, "", 40) for seat in (0, 1)],
        "nash": [dmplay.load_agent(problem, seat, "nash") for seat in (0, 1)],
    }
    result = run_tournament(problem, entrants, episodes=5)
    assert result.entrants == ("random", "nash")
    assert result.withdrawals == (
        f"theirs is withdrawn from the tournament: agent2 forfeits, {DEAD}",
    )
    del entrants["theirs"]
    without_bot = run_tournament(problem, entrants, episodes=5)
    assert np.array_equal(result.mean_returns, without_bot.mean_returns)
    entrants = {
        "random": entrants["random"],
        "theirs": [make_bot(problem, n, "", 0) for n in (0, 1)],
    }
    with pytest.raises(BadPolicy, match="random and theirs: agent2 forfeits"):
        run_tournament(problem, entrants, episodes=5)


@pytest.mark.slow
@pytest.mark.usefixtures("source")
def test_reports_name_what_a_forfeit_leaves_out(tmp_path: Path) -> None:
    python = f"{sys.executable} -S -E bot.py"
    options = ("--episodes", "8", "--turns", "3")
    result = run_dmplay(
        tmp_path, "run", "hexworld", "--agent", f"bot:{python} '(9,0)' 99", *options
    )
    assert (result.returncode, result.stderr) == (
        1,
        f"game 3 is not counted: agent forfeits, {DEAD}\n",
    )
    assert result.stdout.startswith("hexworld: 7 games with seed 0")
    agents = ("random", f"bot:{python} '(9,0)' 99", "optimal")
    result = run_dmplay(tmp_path, "compare", "hexworld", *agents, *options, "--json")
    withdrawal = f"{agents[1]} is withdrawn from the comparison: agent forfeits, {DEAD}"
    report = json.loads(result.stdout)
    assert (result.returncode, result.stderr) == (1, f"{withdrawal}\n")
    assert report["withdrawals"] == [withdrawal]
    assert [row["agent"] for row in report["agents"]] == ["random", "optimal"]
    agents = ("random", f"bot:{python} - 40", "nash")
    result = run_dmplay(tmp_path, "tournament", "rock-paper-scissors", *agents, "--episodes", "5")
    assert result.returncode == 1
    assert result.stdout.startswith("rock-paper-scissors: 4 seatings of 5 games with seed 0")
    assert "is withdrawn from the tournament: agent2 forfeits" in result.stderr
