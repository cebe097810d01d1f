"""Tests of tournaments: all seatings on common random numbers, checkpoints, and the game of
entrants.
"""

import json
import os
import re
import signal
import subprocess
import sys
import time
from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest

import dmplay
from dmplay.agents.random_agent import Random
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.core import safe_files
from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.policy import Memory, Policy
from dmplay.core.return_bounds import compute_return_bounds
from dmplay.errors import BadParameter, BadPolicy, IllegalAction, UnknownName
from dmplay.evaluation.statistics import Estimate
from dmplay.evaluation.tournament import ReturnsBySeating, TournamentResult, run_tournament
from dmplay.output.tournament_checkpoint import TournamentCheckpoint
from dmplay.output.tournament_report import _build_standing_table_row
from tests.support.programs import run_dmplay
from tests.support.terminals import clean_environment
from tests.support.turn_based_games import Nim

PRISONERS_DILEMMA = dmplay.load_problem("prisoners-dilemma")
ROCK_AGENT_SOURCE = """
import numpy as np

class Rock:
    uniform_count = 0
    def __init__(self, problem, seat): pass
    def initial_memory(self, observation): return (np.zeros(len(observation)),)
    def update_memory(self, memory, percept): return memory
    def choose(self, memory, legal, u): return np.zeros(len(u), int)
    def action_values(self, memory): return None
"""
PAPER_BOT_SOURCE = """
import json, sys
for line in sys.stdin:
    said = json.loads(line)
    if said["type"] == "hello":
        print(json.dumps({"type": "hello", "protocol": 1}), flush=True)
    elif said["type"] == "act":
        print(json.dumps({"type": "act", "id": said["id"], "action": "paper"}), flush=True)
"""
ARGUMENTS = ["tournament", "prisoners-dilemma", "grim", "always-defect", "--turns", "5"]


def load_policies(*names: str) -> dict[str, list[Policy]]:
    return {
        name: [dmplay.load_agent(PRISONERS_DILEMMA, seat, name) for seat in (0, 1)]
        for name in names
    }


def play_tournament(
    *names: str, turns: int = 5, returns: ReturnsBySeating | None = None
) -> TournamentResult:
    return run_tournament(
        PRISONERS_DILEMMA,
        load_policies(*names),
        episodes=3,
        turns=turns,
        returns_by_seating=returns,
    )


def test_the_cross_table_contains_the_rewards_of_the_game() -> None:
    result = play_tournament("grim", "always-defect")
    assert result.mean_returns.tolist() == [[[-5, -5], [-16, -12]], [[-12, -16], [-15, -15]]]
    assert [summary.mean for summary in result.return_estimates] == [-10.5, -13.5]


def test_a_tournament_is_a_game_whose_actions_are_the_entrants() -> None:
    result = play_tournament("grim", "always-defect")
    assert result.best_responses == ((0,), (1,))
    assert result.equilibrium is not None
    assert result.equilibrium[0].tolist() == [1.0, 0.0]
    assert result.regrets is not None
    assert result.regrets.tolist() == [0.0, 7.0]
    assert result.exploitability == 0.0


def test_results_that_only_chance_separates_are_ties() -> None:
    """Against `nash`, every rule of rock-paper-scissors earns 0."""
    problem = dmplay.load_problem("rock-paper-scissors")
    entrants = {
        name: [dmplay.load_agent(problem, seat, name) for seat in (0, 1)]
        for name in ("nash", "beat-last", "frequency")
    }
    ties = errors = 0
    for seed in range(10):
        result = run_tournament(problem, entrants, episodes=500, seed=seed)
        assert result.best_responses is not None
        assert 2 not in result.best_responses[1]  # frequency loses 2 games to beat-last
        ties += len(result.best_responses[0]) > 1
        assert result.regret_errors is not None
        assert result.share_errors is not None
        errors += bool((result.regret_errors > 0).any() and (result.share_errors > 0).any())
    assert ties >= 8
    assert errors == 10


def test_several_equilibria_are_counted() -> None:
    result = play_tournament("grim", "tit-for-tat", "always-defect")
    assert result.equilibrium_count > 1
    assert result.has_infinite_equilibria  # because two agents play equally
    assert result.best_responses == ((0, 1), (0, 1), (2,))


def test_one_equilibrium_of_three_seats_may_not_be_the_only_one() -> None:
    problem = dmplay.load_problem("collaborative-predator-prey", predators=3)
    returns: ReturnsBySeating = {
        seating: np.zeros((2, 3)) for seating in product(range(2), repeat=3)
    }
    policies = [dmplay.load_agent(problem, seat, "random") for seat in range(3)]
    result = run_tournament(problem, dict.fromkeys("ab", policies), returns_by_seating=returns)
    assert result.equilibrium_count == 1
    assert not result.has_all_equilibria
    assert play_tournament("grim", "always-defect").has_all_equilibria


def test_entrants_of_the_equilibrium_have_no_regret() -> None:
    problem = dmplay.load_problem("rock-paper-scissors")
    rows = [[0.0, 1.7, -1.0], [-1.0, 0.0, 1.3], [1.0, -1.7, 0.0]]
    returns: ReturnsBySeating = {
        (i, j): np.array([[reward, -reward]] * 2)
        for i, row in enumerate(rows)
        for j, reward in enumerate(row)
    }
    policy = dmplay.load_agent(problem, 0, "random")
    result = run_tournament(problem, dict.fromkeys("abc", [policy] * 2), returns_by_seating=returns)
    assert result.regrets is not None
    assert result.regrets.tolist() == [0.0, 0.0, 0.0]


def open_checkpoint(path: Path, episodes: int, seed: int = 0) -> TournamentCheckpoint:
    """Open the file of a tournament of two entrants in two seats."""
    return TournamentCheckpoint(path, {"seed": seed}, [*product((0, 1), (0, 1))], episodes)


@pytest.mark.parametrize(
    ("row", "explanation"),
    [
        ('{"seats": [-1, 0], "returns": [[0, 0]]}', "the seating [-1, 0] is not in this"),
        ('{"seats": [0, 2], "returns": [[0, 0]]}', "the seating [0, 2] is not in this"),
        ('{"seats": [0], "returns": [[0]]}', "the seating [0] is not in this"),
        ('{"seats": [false, 0], "returns": [[0, 0]]}', "not a seating"),
        ('{"seats": [0.0, 0], "returns": [[0, 0]]}', "not a seating"),
        ('{"seats": "01", "returns": [[0, 0]]}', "not a seating"),
        ("[]", "not a seating"),
        ("[" * 5000, "not a seating"),
        ('{"seats": [0, 0], "returns": [[1' + "0" * 400 + ", 0]]}", "not a seating"),
        ('{"seats": [0, 0], "returns": [[NaN, 0]]}', "not a seating"),
        ('{"seats": [0, 0], "returns": [[null, 0]]}', "got the return null, expected a number"),
        ('{"seats": [0, 0], "returns": [[0, true]]}', "got the return true, expected a number"),
        ('{"seats": [0, 0], "returns": [["7", 0]]}', 'got the return "7", expected a number'),
        (
            '{"seats": [0, 0], "returns": [[0, 1e300]]}',
            "got the return 1e+300, expected a number from -1e+100 to 1e+100",
        ),
        ('{"seats": [0, 0], "returns": [[0], [0, 0]]}', "not a seating"),
        ('{"seats": [0, 0], "returns": [0, 0]}', "got returns of shape [2], expected 1 games"),
        ('{"seats": [0, 0], "returns": []}', "got returns of shape [0], expected 1 games"),
        ('{"seats": [0, 1], "returns": [[0, 0]]}', "the seating [0, 1] occurs twice"),
    ],
)
def test_a_line_of_the_checkpoint_that_was_changed_by_hand_is_named(
    row: str, explanation: str, tmp_path: Path
) -> None:
    path = tmp_path / "cup"
    open_checkpoint(path, 1)[0, 1] = np.ones((1, 2))
    before = path.read_text()
    path.write_text(f"{before}{row}\n")
    with pytest.raises(BadParameter, match=rf"cup:3: {re.escape(explanation)}.*; remove the line$"):
        open_checkpoint(path, 1)
    assert path.read_text() == f"{before}{row}\n"


@pytest.mark.parametrize(
    ("value", "words", "expected"),
    [
        ("1e30", ["prisoners-dilemma"], "-40 to 0"),
        ("-1e30", ["prisoners-dilemma"], "-40 to 0"),
        ("-40.5", ["prisoners-dilemma"], "-40 to 0"),
        ("-20.5", ["prisoners-dilemma", "--turns", "5"], "-20 to 0"),
        ("-40.5", ["prisoners-dilemma", "--set", "discount=0.9", "--turns", "400"], "-40 to 0"),
        ("10.5", ["rock-paper-scissors"], "-10 to 10"),
    ],
)
def test_a_return_beyond_the_rewards_of_the_problem_is_refused(
    value: str, words: list[str], expected: str, tmp_path: Path
) -> None:
    agent = "grim" if words[0] == "prisoners-dilemma" else "frequency"
    path = tmp_path / "cup"
    arguments = ["tournament", *words, agent, "random", "--episodes", "1", "-o", str(path)]
    interpret_command(arguments)
    header, row, *others = path.read_text().splitlines(keepends=True)
    path.write_text(header + re.sub(r"\[\[[^,]*", f"[[{value}", row) + "".join(others))
    message = f"cup:2: got the return {float(value):g}, expected a number from {expected}; remove"
    with pytest.raises(BadParameter, match=re.escape(message)):
        interpret_command(arguments)


class BoundedNim(Nim):
    """A game whose rewards are known to be from -1 to 1, and which ends after unknown turns."""

    reward_bounds = (-1.0, 1.0)
    can_run_forever = False


def test_the_bounds_of_returns_follow_from_those_of_rewards() -> None:
    assert compute_return_bounds(Nim(), 5) is None
    assert compute_return_bounds(BoundedNim(), 5) == pytest.approx((-5, 5))
    assert compute_return_bounds(BoundedNim(), 0) == (0, 0)
    assert compute_return_bounds(BoundedNim(), None) is None
    assert compute_return_bounds(BoundedNim(discount=0.5), None) == pytest.approx((-2, 2))


def test_seatings_in_the_checkpoint_are_not_played_again(tmp_path: Path) -> None:
    checkpoint = open_checkpoint(tmp_path / "cup.jsonl", 3)
    first = play_tournament("grim", "always-defect", returns=checkpoint)
    reloaded = open_checkpoint(tmp_path / "cup.jsonl", 3)
    assert {seats: returns.tolist() for seats, returns in reloaded.items()} == {
        seats: returns.tolist() for seats, returns in checkpoint.items()
    }
    reloaded[0, 0] = np.full((3, 2), 7.0)  # as if these games had been played
    result = play_tournament("grim", "always-defect", returns=reloaded)
    assert result.mean_returns[0, 0].tolist() == [7.0, 7.0]
    assert np.array_equal(result.mean_returns[0, 1], first.mean_returns[0, 1])


def test_a_file_of_another_tournament_is_refused(tmp_path: Path) -> None:
    open_checkpoint(tmp_path / "cup.jsonl", 1)[0, 0] = np.zeros((1, 2))
    with pytest.raises(BadParameter, match=r"cup.jsonl: got a file of another tournament"):
        open_checkpoint(tmp_path / "cup.jsonl", 1, seed=1)


def test_a_checkpoint_of_any_size_is_resumed_after_a_kill(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    path = tmp_path / "cup"
    open_checkpoint(path, 9)[0, 0] = np.zeros((9, 2))
    content = path.read_bytes()
    monkeypatch.setattr(safe_files, "MAX_FILE_BYTES", 100)
    assert len(content) > 100
    path.write_bytes(content + content[30:60])  # an incomplete last line
    reloaded = open_checkpoint(path, 9)
    assert [*reloaded] == [(0, 0)]
    reloaded[0, 1] = np.ones((1, 2))
    assert path.read_bytes() == content + b'{"seats": [0, 1], "returns": [[1.0, 1.0]]}\n'
    for text, message in (
        (b"no end of line", "cup: not a tournament file; name another"),
        (b"no text \xff\n", "cup: got a file of another tournament; name another"),
        (b'{"seed": 0}\n\xff\n', "cup:2: not a seating; remove the line"),
        (b'{"seed": 0}\n{"seats": 3}\n', "cup:2: not a seating; remove the line"),
    ):
        path.write_bytes(text)
        with pytest.raises(BadParameter, match=message):
            open_checkpoint(path, 9)


def test_a_tournament_is_written_as_json(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    output = interpret_command([*ARGUMENTS, "--episodes", "2", "--json", "-o", "cup.jsonl"])
    assert isinstance(output, str)
    assert output == interpret_command([*ARGUMENTS, "--episodes", "2", "--json", "-o", "cup.jsonl"])
    best, other = json.loads(output)["standings"]
    assert (best["entrant"], best["mean_return"], best["regret"]) == ("grim", -10.5, 0.0)
    assert other["best_reply_to_it"] == "always-defect"


def test_all_entrants_play_against_the_exact_equilibrium() -> None:
    nash = load_policies("nash")["nash"]
    result = run_tournament(
        PRISONERS_DILEMMA,
        load_policies("grim", "always-defect"),
        equilibrium_policies=nash,
        episodes=3,
        turns=5,
    )
    assert result.exact_regrets is not None
    assert [estimate.mean for estimate in result.exact_regrets] == [
        1.0,
        0.0,
    ]  # Cooperating once costs one year.
    arguments = [
        "tournament",
        "rock-paper-scissors",
        "random",
        "beat-last",
        "--turns",
        "2",
        "--json",
    ]
    rows = json.loads(str(interpret_command([*arguments, "--episodes", "3"])))
    assert rows["equilibrium"] == "nash"
    assert all("exact_regret" in row for row in rows["standings"])


def test_an_interrupted_tournament_reports_the_games_played() -> None:
    shares: list[float] = []

    def stop(share: float) -> None:
        shares.append(share)
        if share > 0.3:
            raise KeyboardInterrupt

    entrants = load_policies("grim", "always-defect")
    result = run_tournament(PRISONERS_DILEMMA, entrants, episodes=3, turns=5, progress=stop)
    assert result.shortfall_reason == "interrupted"
    assert result.mean_returns[0, 0].tolist() == [-5, -5]
    assert np.isnan(result.mean_returns[1, 1]).all()
    assert (result.equilibrium, result.exact_regrets) == (None, None)
    first = result._replace(
        return_estimates=(Estimate(np.nan, np.inf, -np.inf, np.inf), result.return_estimates[0])
    )
    rows = [_build_standing_table_row(row) for row in first.list_rows()]
    assert [row["entrant"] for row in rows] == ["always-defect", "grim"]
    assert rows[1]["mean return"] == "-"


class IllegalPolicy(Random):
    """A policy that chooses an action that does not exist."""

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        return np.full(len(u), 9)


def test_an_error_names_the_entrants_of_the_game() -> None:
    classes = {"fair": Random, "wrong": IllegalPolicy}
    entrants = {
        name: [make(PRISONERS_DILEMMA, seat) for seat in range(2)] for name, make in classes.items()
    }
    with pytest.raises(BadPolicy, match=r"^fair and wrong: turn 1, agent2: got action 9, expected"):
        run_tournament(PRISONERS_DILEMMA, entrants, episodes=2)
    for progress in (None, lambda share: None):  # without and with a timing probe
        compare_entrants = partial(
            dmplay.compare, PRISONERS_DILEMMA, [*entrants.values()], episodes=2, progress=progress
        )
        with pytest.raises(BadPolicy, match=r"^wrong: turn 1, agent1: got action 9"):
            compare_entrants(names=[*entrants])
        with pytest.raises(IllegalAction, match=r"^turn 1, agent1: got action 9"):
            compare_entrants()


def test_entrants_may_keep_the_order_in_which_they_are_named(tmp_path: Path) -> None:
    arguments = [*ARGUMENTS, "--episodes", "2", "--seats", "given", "-o", str(tmp_path / "cup")]
    output = str(interpret_command(arguments))
    assert output.startswith("prisoners-dilemma: 3 seatings of 2 games")
    assert str(interpret_command([*arguments, "--json"])).count("[null, null]") == 1
    assert (tmp_path / "cup").read_text().count("returns") == 3
    with pytest.raises(BadParameter, match="a file of another tournament"):
        interpret_command([*arguments, "--seats", "all"])


@pytest.mark.slow
def test_bots_and_files_take_part_and_a_killed_tournament_resumes(tmp_path: Path) -> None:
    (tmp_path / "rock.py").write_text(ROCK_AGENT_SOURCE)
    (tmp_path / "bot.py").write_text(PAPER_BOT_SOURCE)
    entrants = ["nash", "./rock.py:Rock", f"bot:{sys.executable} bot.py"]
    arguments = [
        "tournament",
        "rock-paper-scissors",
        *entrants,
        "--episodes",
        "40",
        "--turns",
        "20",
    ]
    expected = run_dmplay(tmp_path, *arguments, "--workers", "2", "--csv")
    assert expected.returncode == 0, expected.stderr
    environment = clean_environment(tmp_path)
    process = subprocess.Popen(
        [sys.executable, "-m", "dmplay", *arguments, "-o", "cup"], cwd=tmp_path, env=environment,
        stdout=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip
    checkpoint = tmp_path / "cup"
    while process.poll() is None and not (
        checkpoint.exists() and checkpoint.read_text().count("seats") > 2
    ):
        time.sleep(0.01)
    os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    assert 2 < checkpoint.read_text().count('"seats"') < 16
    resumed = run_dmplay(tmp_path, *arguments, "-o", "cup", "--csv")
    assert resumed.stdout == expected.stdout


def test_three_seats_have_a_cross_table_each() -> None:
    hunt = dmplay.load_problem("predator-prey:circle", predators=2)
    assert len(hunt.agents) == 3
    agent_names = ("random", "search:simulations=2,depth=1")
    entrants = {
        name: [dmplay.load_agent(hunt, seat, name) for seat in range(3)] for name in agent_names
    }
    result = run_tournament(hunt, entrants, episodes=2, turns=2)
    assert result.mean_returns.shape == (2, 2, 2, 3)
    assert result.exact_regrets is None


def test_three_seats_have_an_approximate_equilibrium_with_a_small_gain() -> None:
    """The first two seats get the same reward; the last seat gets its negative."""
    hunt = dmplay.load_problem("predator-prey:circle", predators=2)
    policy = [dmplay.load_agent(hunt, seat, "random") for seat in range(3)]
    returns: ReturnsBySeating = {
        seats: np.array([[reward, reward, -reward]] * 2)
        for seats in product(range(2), repeat=3)
        for reward in [float(len({*seats}) == 1) + 0.5 * (seats == (1, 1, 1))]
    }
    result = run_tournament(hunt, {"a": policy, "b": policy}, returns_by_seating=returns)
    assert result.best_responses == ((0,), (1,))
    assert result.equilibrium is not None
    assert result.regrets is not None
    assert result.exploitability is not None
    assert 0.0 <= result.exploitability < 0.05
    for seat, strategy in enumerate(result.equilibrium):
        values = np.einsum(
            "ijk,jk->i", *_get_opponent_table(result.mean_returns, result.equilibrium, seat)
        )
        assert values.max() - strategy @ values <= result.exploitability + 1e-12


def _get_opponent_table(
    table: Reals, strategies: tuple[Reals, ...], seat: int
) -> tuple[Reals, Reals]:
    """Return the rewards of a seat's entrants against each pair, and the pairs' probabilities."""
    first, second = [strategy for index, strategy in enumerate(strategies) if index != seat]
    return np.moveaxis(table[..., seat], seat, 0), np.outer(first, second)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["tournament", "hexworld", "optimal", "random"],
            "tournament: got a problem with 1 seat, expected at least 2",
        ),
        ([*ARGUMENTS[:3]], "got 1 entrant, expected at least 2"),
        ([*ARGUMENTS[:3], "grim"], "an entrant is named twice"),
        ([*ARGUMENTS[:3], "human"], "human: a person cannot play many games"),
        ([*ARGUMENTS, "--seats", "gven"], "seats: unknown order 'gven'; did you mean given?"),
    ],
)
def test_a_bad_tournament_command_gives_a_clear_error(arguments: list[str], message: str) -> None:
    with pytest.raises((BadParameter, UnknownName), match=re.escape(message)):
        interpret_command(arguments)


@pytest.mark.slow
@pytest.mark.extra("axelrod")
def test_the_cross_table_matches_the_axelrod_package() -> None:
    import axelrod

    axelrod_names = {"grim": "Grudger", "tit-for-tat": "TitForTat", "always-defect": "Defector",
            "always-cooperate": "Cooperator", "tit-for-two-tats": "TitFor2Tats"}  # fmt: skip
    measured = play_tournament(*axelrod_names, turns=20)
    players = [getattr(axelrod, name)() for name in axelrod_names.values()]
    game = axelrod.Game(r=-1, s=-4, t=0, p=-3)
    result = axelrod.Tournament(players, turns=20, repetitions=1, game=game).play(
        progress_bar=False
    )
    assert np.allclose(measured.mean_returns[:, :, 0] / 20, result.payoff_matrix)


FAULTY_AGENTS = """
import sys
import numpy as np

class First:
    uniform_count = 0
    def __init__(self, problem, seat): pass
    def initial_memory(self, observation): return ()
    def update_memory(self, memory, percept): return ()
    def choose(self, memory, legal, u): return np.zeros(len(u), int)
    def action_values(self, memory): return None

class Seven(First):
    def choose(self, memory, legal, u): return np.full(len(u), 7)

class Word(First):
    def choose(self, memory, legal, u): return "word"

class Nothing(First):
    def choose(self, memory, legal, u): return None

class Nan(First):
    def choose(self, memory, legal, u): return np.full(len(u), np.nan)

class Raises(First):
    def choose(self, memory, legal, u): raise ValueError("boom")

class Forgets(First):
    def update_memory(self, memory, percept): return 1 / 0

class Exits(First):
    def choose(self, memory, legal, u): exit()

class Quits(First):
    def update_memory(self, memory, percept): quit("no more")

class Unmade(First):
    def __init__(self, problem, seat): sys.exit(0)

class Wrong: pass
"""


@pytest.mark.parametrize("command", ["tournament", "compare"])
def test_agents_that_fail_are_withdrawn_and_the_others_play_on(
    command: str, tmp_path: Path
) -> None:
    (tmp_path / "a.py").write_text(FAULTY_AGENTS)
    (tmp_path / "b.py").write_text("import nothing_of_this_name")
    classes = (
        "Seven",
        "Word",
        "Nothing",
        "Nan",
        "Raises",
        "Forgets",
        "Wrong",
        "Missing",
        "Exits",
        "Quits",
        "Unmade",
    )
    faulty = [*(f"./a.py:{name}" for name in classes), "./a.py", "./b.py:A", "./c.py:A"]
    options = ["--turns", "3", "--episodes", "20", "--json"]
    outcome = run_dmplay(
        tmp_path, command, "prisoners-dilemma", "grim", *faulty, "./a.py:First", *options
    )
    contest = {"compare": "comparison"}.get(command, command)
    lines = outcome.stderr.splitlines()
    prefix = f" is withdrawn from the {contest}: "
    assert sorted(line.partition(prefix)[0] for line in lines) == sorted(faulty)
    assert any(line.endswith(": ValueError: boom") and "a.py:" in line for line in lines)
    assert outcome.returncode == 1
    expected = run_dmplay(tmp_path, command, "prisoners-dilemma", "grim", "./a.py:First", *options)
    assert expected.returncode == 0
    ignored = {"withdrawals", "provenance"}
    result, reference = (
        {key: value for key, value in json.loads(run.stdout).items() if key not in ignored}
        for run in (outcome, expected)
    )
    assert result == reference
    unknown = run_dmplay(tmp_path, command, "prisoners-dilemma", "grim", "grimm", "random")
    assert unknown.returncode == 2
