"""Training reaches its optimum, is repeatable, goes on from a file and reports curves."""

import hashlib
import json
from pathlib import Path
from zipfile import ZipFile

import numpy as np
import pytest

import dmplay
from dmplay.agents.learned_file import format_learned_file, read_learned_file
from dmplay.errors import BadParameter, BadPolicy
from dmplay.training.checkpoints import Evaluator
from dmplay.training.policy_difference import compare_with_optimum
from dmplay.training.train import estimate_interquartile_mean, interquartile_mean, train
from dmplay.training.turn_data import read_turn_data
from tests.support.programs import run_dmplay
from tests.support.random_problems import RandomProblem


@pytest.fixture(scope="module")
def learned_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of an agent that learned hexworld for a moment."""
    folder = tmp_path_factory.mktemp("learned")
    options = ("--seeds", "2", "--steps", "8000", "-o", "agent.npz")
    assert run_dmplay(folder, "train", "q-learning", "hexworld", *options).returncode == 0
    return folder / "agent.npz"


def test_q_learning_reaches_the_optimum_of_hexworld() -> None:
    training = train("q-learning", "hexworld", seeds=2, steps=200_000, eval_every=100_000)
    optimum, source = training.evaluator.optimum
    assert source == "exact"
    assert optimum == pytest.approx(dmplay.solve("hexworld").value())
    assert training.curve[-1][2].mean > 0.99 * optimum
    difference = compare_with_optimum(training.evaluator, training.make_policy(training.best_run))
    assert difference is not None
    assert difference.cost == pytest.approx(optimum - training.best_run.last.value, abs=1e-9)


@pytest.mark.slow
def test_the_cross_entropy_method_balances_the_pole() -> None:
    training = train("cross-entropy", "cart-pole:gym", seeds=3, eval_every=10**9)
    assert min(run.last.value for run in training.runs) >= 495


@pytest.mark.slow
def test_policy_gradient_balances_the_pole() -> None:
    training = train("policy-gradient", "cart-pole:gym", seeds=3, eval_every=10**9)
    assert min(run.last.value for run in training.runs) >= 495


@pytest.mark.slow
def test_sarsa_lambda_drives_the_car_out_of_the_valley() -> None:
    learner = "sarsa-lambda:rows=8,alpha=1,alpha_decay=1,epsilon=0,traces=replacing"
    training = train(learner, "mountain-car:gym", seeds=3, steps=200_000, eval_every=10**9)
    assert min(run.last.value for run in training.runs) >= -112


@pytest.mark.slow
def test_beliefs_are_inputs_where_the_state_is_hidden() -> None:
    training = train("policy-gradient", "crying-baby", seeds=2, eval_every=10**9, eval_games=500)
    optimum, source = training.evaluator.optimum
    assert source == "agent optimal"
    assert training.curve[-1][2].mean > 1.05 * optimum  # both are negative


@pytest.mark.parametrize("seed", range(5))
def test_the_exact_value_of_a_policy_is_the_mean_of_its_games(seed: int) -> None:
    problem = RandomProblem(seed=seed)
    training = train("q-learning", problem, seeds=1, steps=500, eval_every=500)
    policy, evaluator = training.make_policy(training.runs[0]), training.evaluator
    exact = evaluator.evaluate(policy)
    returns = dmplay.rollout(problem, [policy], episodes=20_000).returns[:, 0]
    assert exact == pytest.approx(returns.mean(), abs=5 * returns.std() / 20_000**0.5)
    assert evaluator.optimum[0] == pytest.approx(dmplay.solve(problem).value())


def test_an_exact_value_counts_the_turns_of_a_horizon() -> None:
    problem = RandomProblem(seed=3, turns=4)
    optimum, source = Evaluator(problem).optimum
    assert source == "exact"
    assert optimum == pytest.approx(dmplay.solve(problem, turns=4).value())


def test_the_interquartile_mean_is_that_of_the_middle_half() -> None:
    sample = np.array([100.0, 1.0, 2.0, 3.0, 4.0, 5.0, -50.0, 6.0, 7.0, 8.0])
    assert interquartile_mean(sample) == pytest.approx(np.mean([2, 3, 4, 5, 6, 7]))
    estimate = estimate_interquartile_mean(sample)
    assert estimate.low < estimate.mean < estimate.high
    assert estimate_interquartile_mean(np.full(10, 2.0))[0::2] == (2.0, 2.0)


def test_a_learned_agent_plays_by_its_file(learned_path: Path) -> None:
    report = run_dmplay(learned_path.parent, "run", "hexworld", "--agent", "learned:agent.npz",
                        "--episodes", "50", "--json")  # fmt: skip
    assert json.loads(report.stdout)["runs"][0]["agent"] == "learned:agent.npz"
    policy = dmplay.load_agent("hexworld", 0, f"learned:{learned_path}")
    assert dmplay.rollout("hexworld", [policy], episodes=200).returns.mean() > 1


def test_numpy_reads_a_learned_agent_without_pickle(learned_path: Path) -> None:
    with np.load(learned_path, allow_pickle=False) as archive:
        weights, header = archive["weights"], json.loads(archive["header.json"])
    assert weights.shape == (25, 6)
    assert header["algorithm"] == "q-learning"
    assert header["problem"] == "hexworld"
    assert header["digest"].startswith("sha256:")


def test_training_again_gives_the_same_arrays(learned_path: Path) -> None:
    learned = read_learned_file(learned_path)
    training = train("q-learning", "hexworld", seeds=[learned.header["seed"]], steps=8000)
    np.testing.assert_array_equal(training.runs[0].arrays["weights"], learned.arrays["weights"])


def test_training_goes_on_from_a_file(learned_path: Path) -> None:
    options = ("--continue", "agent.npz", "--steps", "4000", "-o", "more.npz")
    assert run_dmplay(learned_path.parent, "train", *options).returncode == 0
    more = read_learned_file(learned_path.parent / "more.npz").header
    earlier = read_learned_file(learned_path).header
    assert more["curve"][: len(earlier["curve"])] == earlier["curve"]
    assert more["curve"][-1][0] == 12_000


def damage(path: Path, target: Path, change: str) -> None:
    with ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    if change == "curve":
        header = json.loads(entries["header.json"])
        entries["header.json"] = json.dumps(header | {"seed": 77}).encode()
    elif change == "pickle":
        entries["weights.npy"] = entries["weights.npy"].replace(b"'<f8'", b"'|O' ")
    elif change == "shape":
        entries["weights.npy"] = entries["weights.npy"].replace(b"(25, 6)", b"(9**9,)")
    elif change == "size":
        entries["weights.npy"] = entries["weights.npy"].replace(b"(25, 6)", b"(9025,)")
    elif change == "header":
        del entries["header.json"]
    with ZipFile(target, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ("curve", "the digest differs"),
        ("pickle", "not an array of numbers"),
        ("shape", "not the file of a learned agent"),
        ("size", "not an array of numbers"),
        ("header", "header.json"),
    ],
)
def test_a_damaged_file_is_refused_in_one_line(
    learned_path: Path, tmp_path: Path, change: str, reason: str
) -> None:
    damage(learned_path, tmp_path / "bad.npz", change)
    with pytest.raises(BadPolicy, match=reason) as error:
        read_learned_file(tmp_path / "bad.npz")
    assert "\n" not in str(error.value)


def test_a_file_that_is_no_archive_is_refused(tmp_path: Path) -> None:
    (tmp_path / "text.npz").write_text("hello", encoding="utf-8")
    with pytest.raises(BadPolicy, match="not the file of a learned agent"):
        read_learned_file(tmp_path / "text.npz")


def test_a_learned_agent_of_another_problem_is_refused(learned_path: Path) -> None:
    with pytest.raises(BadPolicy, match="it was trained on hexworld"):
        dmplay.load_agent("cart-pole", 0, f"learned:{learned_path}")
    with pytest.raises(BadPolicy, match="expected"):
        dmplay.load_agent("hexworld:straight-line", 0, f"learned:{learned_path}")


def test_the_rows_of_csv_and_json_are_the_checkpoints(tmp_path: Path) -> None:
    command = (
        "train",
        "sarsa",
        "hexworld",
        "--seeds",
        "2",
        "--steps",
        "320",
        "--eval-every",
        "160",
    )
    lines = run_dmplay(tmp_path, *command, "--csv").stdout.splitlines()
    assert lines[0] == "seed,steps,episodes,seconds,value"
    assert [line.split(",")[:2] for line in lines[1:]] == [
        ["0", "160"], ["0", "320"], ["1", "160"], ["1", "320"],
    ]  # fmt: skip
    facts = json.loads(run_dmplay(tmp_path, *command, "--json").stdout)
    assert [row["steps"] for row in facts["curve"]] == [160, 320]
    assert facts["optimum"] == pytest.approx(4.16863, abs=1e-4)
    assert facts["difference"]["states"]


@pytest.mark.parametrize(
    ("algorithm", "problem", "reason"),
    [
        ("q-learning", "predator-prey", "several agents choose"),
        ("q-learning", "simple-regulator", "its actions are real numbers"),
        ("afterstates", "hexworld", "it lists no afterstates"),
        ("maximum-likelihood", "cart-pole", "it counts states"),
        ("sarsa", "2048", "neither a list nor real numbers"),
    ],
)
def test_a_misfit_is_explained(algorithm: str, problem: str, reason: str) -> None:
    with pytest.raises(BadParameter, match=reason):
        train(algorithm, problem, seeds=1, steps=10)


def test_an_interruption_keeps_what_was_learned() -> None:
    def interrupt(share: float) -> None:
        if share > 0.5:
            raise KeyboardInterrupt

    training = train("q-learning", "hexworld", seeds=2, steps=20_000, progress=interrupt)
    assert training.is_interrupted
    assert [run.seed for run in training.runs] == [0, 1]
    assert training.runs[0].last.steps == 20_000
    assert 0 < training.runs[1].last.steps < 20_000
    assert [steps for steps, _, _ in training.curve][-1] == 20_000


@pytest.fixture(scope="module")
def data_path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The file of random turns in hexworld."""
    folder = tmp_path_factory.mktemp("data")
    options = ("--rows", "20000", "-o", "turns.csv")
    assert run_dmplay(folder, "data", "hexworld", *options).returncode == 0
    return folder / "turns.csv"


def test_the_rows_of_data_are_the_turns_of_the_games_of_a_seed(data_path: Path) -> None:
    lines = data_path.read_text(encoding="utf-8").splitlines()
    assert lines[0] == "game,s,a,r,s',done"
    assert len(lines) == 20_001
    data = read_turn_data(data_path, dmplay.load_problem("hexworld"))
    policy = dmplay.load_agent("hexworld", 0, "random")
    games = dmplay.rollout("hexworld", [policy], episodes=5, keep=("trajectories",))
    turns = [
        (int(games.states[game, turn]), int(games.actions[game, turn, 0]),
         float(games.rewards[game, turn, 0]), int(games.states[game, turn + 1]))
        for game in range(5) for turn in range(games.turn_counts[game])
    ]  # fmt: skip
    columns = data.inputs, data.actions, data.rewards, data.next_inputs
    assert [*zip(*(column[: len(turns)].tolist() for column in columns), strict=True)] == turns
    assert data.done[: len(turns)].sum() == 5


@pytest.mark.parametrize("algorithm", ["q-learning", "maximum-likelihood:rows=64,update=dyna"])
def test_batch_training_reaches_the_optimum(data_path: Path, algorithm: str) -> None:
    training = train(algorithm, "hexworld", data=data_path, seeds=1, steps=64_000)
    assert training.curve[-1][2].mean > 0.97 * training.evaluator.optimum[0]


def test_behaviour_cloning_plays_like_its_expert(tmp_path: Path) -> None:
    options = ("--agent", "optimal", "--rows", "2000", "-o", "turns.csv")
    run_dmplay(tmp_path, "data", "crying-baby", *options)
    path = tmp_path / "turns.csv"
    training = train("behaviour-cloning", "crying-baby", data=path, seeds=1, steps=60_000)
    optimum, _ = training.evaluator.optimum
    assert training.runs[0].last.value > 1.05 * optimum  # both are negative


def test_beliefs_in_data_are_those_of_the_games(tmp_path: Path) -> None:
    problem = dmplay.load_problem("crying-baby")
    options = ("--rows", "60", "-o", "turns.csv")
    run_dmplay(tmp_path, "data", "crying-baby", *options)
    data = read_turn_data(tmp_path / "turns.csv", problem)
    np.testing.assert_allclose(data.inputs.sum(axis=1), 1.0)
    np.testing.assert_array_equal(data.inputs[0], [0.5, 0.5])
    np.testing.assert_array_equal(data.inputs[1:20], data.next_inputs[:19])


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ('0,"(0,0)",e,1,"(1,0)",0,7', "got 7 cells, expected 6"),
        ('0,"(0,0)",up,1,"(1,0)",0', "up"),
        ('0,"(99,0)",e,1,"(1,0)",0', "99"),
        ('0,"(0,0)",e,nan,"(1,0)",0', "finite reward"),
        ('0,"(0,0)",e,1,"(1,0)",maybe', "expected 0 or 1"),
    ],
)
def test_a_wrong_row_of_data_is_named_by_its_line(tmp_path: Path, line: str, reason: str) -> None:
    path = tmp_path / "turns.csv"
    path.write_text(f"game,s,a,r,s',done\n{line}\n", encoding="utf-8")
    with pytest.raises(BadParameter, match=reason) as error:
        read_turn_data(path, dmplay.load_problem("hexworld"))
    assert f"{path}:2:" in str(error.value)


def test_an_algorithm_that_must_act_refuses_data(data_path: Path) -> None:
    with pytest.raises(BadParameter, match="must choose its own actions"):
        train("sarsa", "hexworld", data=data_path)
    with pytest.raises(BadParameter, match="--data FILE"):
        train("behaviour-cloning", "hexworld")


def test_a_transcript_has_the_digest_of_a_learned_agent(learned_path: Path) -> None:
    folder = learned_path.parent
    command = ("play", "hexworld", "--agent", "learned:agent.npz", "--seed", "3")
    assert run_dmplay(folder, *command, "-o", "game.dmt").returncode == 0
    digest = hashlib.sha256(learned_path.read_bytes()).hexdigest()[:16]
    name = f"learned:agent.npz,digest={digest}"
    assert name in (folder / "game.dmt").read_text(encoding="utf-8")
    assert run_dmplay(folder, "verify", "game.dmt").returncode == 0
    dmplay.load_agent("hexworld", 0, f"learned:{learned_path},digest={digest}")
    with pytest.raises(BadPolicy, match="another digest"):
        dmplay.load_agent("hexworld", 0, f"learned:{learned_path},digest={digest[::-1]}")


def test_a_path_in_a_transcript_is_relative_to_its_folder(learned_path: Path) -> None:
    folder = learned_path.parent
    (folder / "games").mkdir()
    command = ("play", "hexworld", "--agent", "learned:agent.npz", "-o", "games/game.dmt")
    assert run_dmplay(folder, *command).returncode == 0
    text = (folder / "games" / "game.dmt").read_text(encoding="utf-8")
    assert "learned:../agent.npz," in text
    assert run_dmplay(folder, "verify", "games/game.dmt").returncode == 0


def test_verify_trains_a_learned_agent_again(learned_path: Path, tmp_path: Path) -> None:
    folder = learned_path.parent
    run_dmplay(folder, "train", "--continue", "agent.npz", "--steps", "800", "-o", "second.npz")
    result = run_dmplay(folder, "verify", "second.npz", "agent.npz", "--retrain")
    assert result.returncode == 0, result.stdout
    assert result.stdout.count("trained again, equal") == 2
    file = read_learned_file(learned_path)
    arrays = {"weights": file.arrays["weights"] + 1e-12}
    (tmp_path / "fake.npz").write_bytes(format_learned_file(file.header, arrays))
    assert run_dmplay(tmp_path, "verify", "fake.npz").returncode == 0
    result = run_dmplay(tmp_path, "verify", "fake.npz", "--retrain")
    assert result.returncode == 3
    assert "DIFFERENT" in result.stdout


@pytest.mark.parametrize("problem", ["hexworld", "crying-baby"])
def test_turns_of_transcripts_equal_those_of_data(tmp_path: Path, problem: str) -> None:
    options = ("--agent", "random", "--seed", "0", "--turns", "7", "-o", "games/game.dmt")
    (tmp_path / "games").mkdir()
    assert run_dmplay(tmp_path, "play", problem, *options).returncode == 0
    run_dmplay(tmp_path, "data", problem, "--rows", "7", "-o", "turns.csv")
    loaded = dmplay.load_problem(problem)
    recorded = read_turn_data(tmp_path / "games", loaded)
    collected = read_turn_data(tmp_path / "turns.csv", loaded)
    count = len(recorded.actions)
    assert 0 < count <= 7
    for name in ("inputs", "actions", "rewards", "next_inputs"):
        np.testing.assert_array_equal(getattr(recorded, name), getattr(collected, name)[:count])


def test_transcripts_of_another_problem_are_refused(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "play", "catch", "--agent", "random", "--turns", "2", "-o", "game.dmt")
    with pytest.raises(BadParameter, match="a game of catch"):
        read_turn_data(tmp_path / "game.dmt", dmplay.load_problem("hexworld"))
