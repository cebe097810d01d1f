"""The training loop: several seeds of one learner, evaluated at checkpoints."""

import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from dmplay.agents.learned_file import LearnedFile
from dmplay.agents.learned_policy import (
    LearnedPolicy,
    build_features,
    describe_features,
    make_follower,
)
from dmplay.algorithms.learner import Learner, LearningTask
from dmplay.algorithms.registry import load_learners
from dmplay.core.arrays import Array, Reals
from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.uniforms import make_numpy_generator
from dmplay.errors import BadParameter, UnknownName
from dmplay.evaluation.statistics import Estimate
from dmplay.registry.agents import parse_agent_parameters
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.simulation.learning_games import LearningGames
from dmplay.training.checkpoints import Evaluator
from dmplay.training.turn_data import RecordedTurns, TurnData, read_turn_data

DEFAULT_SEEDS, DEFAULT_CHECKPOINTS = 10, 10
BOOTSTRAP_SAMPLES = 2000
SEED_BITS = 64  # of a seed, below the steps after which a run goes on


class Checkpoint(NamedTuple):
    """The progress of one seed: what it has played, and how good its policy is."""

    steps: int
    episodes: int
    seconds: float  # of the processor, in the training loop alone
    value: float  # expected return, or mean return


@dataclass
class TrainingRun:
    """One seed of a training: its checkpoints, and what it has learned."""

    seed: int
    arrays: dict[str, Array] = field(default_factory=dict)
    checkpoints: list[Checkpoint] = field(default_factory=list)
    # the steps after each part of the training; there are several parts if it was continued
    part_steps: list[int] = field(default_factory=list)

    @classmethod
    def of_file(cls, file: LearnedFile) -> "TrainingRun":
        """Return the run that goes on where a file was written."""
        checkpoints = [Checkpoint(*point) for point in file.header["curve"]]
        arrays = {name: array.copy() for name, array in file.arrays.items()}
        return cls(int(file.header["seed"]), arrays, checkpoints, [*file.header["part_steps"]])

    @property
    def last(self) -> Checkpoint:
        """The last checkpoint."""
        return self.checkpoints[-1]


@dataclass
class Training:
    """A learner on a problem, with one run for each seed."""

    problem: Problem
    learner: Learner
    evaluator: Evaluator
    features: dict[str, Any]
    runs: list[TrainingRun] = field(default_factory=list)
    data: TurnData | None = None  # recorded turns, instead of games
    is_interrupted: bool = False

    def make_policy(self, run: TrainingRun) -> LearnedPolicy:
        """Return the policy that a run has learned."""
        features = build_features(self.problem, self.features)
        follower = make_follower(self.problem)
        return LearnedPolicy(self.problem, 0, features, run.arrays["weights"], follower)

    @property
    def curve(self) -> list[tuple[int, float, Estimate]]:
        """The steps, mean seconds and interquartile mean of each checkpoint.

        A run that was interrupted after fewer checkpoints than the others is left out.
        """
        count = max(len(run.checkpoints) for run in self.runs)
        complete = [run.checkpoints for run in self.runs if len(run.checkpoints) == count]
        rows = zip(*complete, strict=True)
        return [
            (row[0].steps, float(np.mean([point.seconds for point in row])),
             estimate_interquartile_mean(np.array([point.value for point in row])))
            for row in rows
        ]  # fmt: skip

    @cached_property
    def best_run(self) -> TrainingRun:
        """The run with the highest last value."""
        return max(self.runs, key=lambda run: run.last.value)


def parse_learner(text: str) -> Learner:
    """Return the learner of a name such as `q-learning:alpha=0.2`; raise UnknownName."""
    name, _, parameters = text.partition(":")
    learners = load_learners()
    if name not in learners:
        raise UnknownName("learning algorithm", name, learners)
    make: Callable[..., Learner] = learners[name]
    return make(**parse_agent_parameters(make, parameters, name))


def train(  # noqa: PLR0913 - the options of a training
    algorithm: str | Learner,
    problem: ProblemLike,
    *,
    seeds: int | Sequence[int] = DEFAULT_SEEDS,
    steps: int | None = None,
    episodes: int | None = None,
    eval_every: int | None = None,
    eval_games: int = 1000,
    data: str | Path | None = None,
    start: LearnedFile | None = None,
    progress: Callable[[float], None] | None = None,
    **parameters: object,
) -> Training:
    """Train an algorithm on a problem once for each seed, and return the runs.

    `seeds` is a number of seeds, 0 and so on, or a list of them. A run ends after this many `steps`
    of the environment, or `episodes`. Each run is evaluated every `eval_every` steps, by default
    ten times: exactly if the states can be listed, else in the same `eval_games` games each time.
    Ctrl-C ends the training and keeps what was learned. With `start`, one run goes on from a file.
    With `data`, runs learn from the turns in a file, and each learned turn counts as a step.
    """
    loaded = load_problem(problem, **parameters)
    learner = parse_learner(algorithm) if isinstance(algorithm, str) else algorithm
    obstacle = explain_misfit(learner, loaded, has_data=data is not None)
    if obstacle:
        raise BadParameter(f"{learner.name} cannot learn {type(loaded).__name__}: {obstacle}")
    kind = learner.features if learner.features != "auto" else learner.default_features
    features = describe_features(loaded, kind, learner.tilings, learner.tiles)
    training = Training(loaded, learner, Evaluator(loaded, eval_games), features)
    numbers = range(seeds) if isinstance(seeds, int) else seeds
    training.runs = [TrainingRun(seed) for seed in numbers]
    if data is not None:
        training.data = read_turn_data(Path(data), loaded)
    if start is not None:
        start.make_policy(loaded, "the file")  # checks that it fits
        training.runs = [TrainingRun.of_file(start)]
    length = TrainingLength.choose(learner, steps, episodes, eval_every)
    try:
        for index, run in enumerate(training.runs):
            for share in iterate_checkpoints(training, run, length):
                if progress:
                    progress((index + share) / len(training.runs))
    except KeyboardInterrupt:
        training.is_interrupted = True
        training.runs = [run for run in training.runs if run.checkpoints]
        if not training.runs:
            raise
    return training


def explain_misfit(learner: Learner, problem: Problem, *, has_data: bool = False) -> str:
    """Return the reason why a problem cannot be learned; '' if it can."""
    if len(problem.agents) > 1:
        return "several agents choose; it trains one agent"
    if learner.default_features != "afterstates" and not isinstance(
        problem.state_count, int | ContinuousStates
    ):
        return "its states are neither a list nor real numbers"
    if has_data and not learner.data_use:
        return "it must choose its own actions, so it cannot learn from recorded turns"
    if not has_data and learner.data_use == "required":
        return "it learns from recorded turns; give them with --data FILE"
    return learner.explain_misfit(problem)


class TrainingLength(NamedTuple):
    """The steps or episodes after which a run ends, and the steps between checkpoints."""

    steps: int | None
    episodes: int | None
    eval_every: int

    @classmethod
    def choose(
        cls, learner: Learner, steps: int | None, episodes: int | None, eval_every: int | None
    ) -> "TrainingLength":
        """Return the length of these options; by default it is the learner's own number."""
        if steps is None and episodes is None:
            steps = learner.default_steps
        for name, number in (("steps", steps), ("episodes", episodes), ("eval_every", eval_every)):
            if number is not None and number < 1:
                raise BadParameter(f"{name}: got {number}, expected 1 or more")
        total = steps or episodes or 1
        return cls(steps, episodes, eval_every or max(total // DEFAULT_CHECKPOINTS, 1))

    def after(self, earlier: Checkpoint) -> "TrainingLength":
        """Return the length of a run that goes on after a checkpoint."""
        return self._replace(
            steps=self.steps and self.steps + earlier.steps,
            episodes=self.episodes and self.episodes + earlier.episodes,
        )

    def share(self, games: LearningGames) -> float:
        """Return the share of the length that was played, 1 at the end."""
        shares = [games.step_count / self.steps] if self.steps else []
        shares += [games.episode_count / self.episodes] if self.episodes else []
        return min(max(shares), 1.0)


def iterate_checkpoints(
    training: Training, run: TrainingRun, length: TrainingLength
) -> Iterator[float]:
    """Train one seed; yield the share that is done after each update of some milliseconds."""
    problem, learner = training.problem, training.learner
    earlier = run.checkpoints[-1] if run.checkpoints else Checkpoint(0, 0, 0.0, 0.0)
    # what continues a run has other random numbers than its beginning
    generator = make_numpy_generator(run.seed + (earlier.steps << SEED_BITS))
    games: Any = LearningGames(problem, learner.rows, generator, make_follower(problem))
    if training.data is not None:
        games = RecordedTurns(problem, training.data, learner.rows, generator)
    games.step_count, games.episode_count = earlier.steps, earlier.episodes
    length = length.after(earlier)
    task = LearningTask(problem, games, build_features(problem, training.features), run.arrays)
    updates = learner.learn(task)
    counts_steps, seconds, update_count = length.steps is not None, earlier.seconds, 0
    due = earlier.steps if counts_steps else earlier.episodes
    try:
        while True:
            share = length.share(games)
            played = games.step_count if counts_steps else games.episode_count
            if share == 1.0:
                run.part_steps.append(games.step_count)
                return
            due += length.eval_every
            start_time = time.process_time()
            while played < due and share < 1.0:
                next(updates)
                update_count += 1
                played = games.step_count if counts_steps else games.episode_count
                share = length.share(games)
                if update_count % 256 == 0:
                    seconds += time.process_time() - start_time
                    yield share
                    start_time = time.process_time()
            seconds += time.process_time() - start_time
            value = training.evaluator.evaluate(training.make_policy(run))
            point = Checkpoint(games.step_count, games.episode_count, seconds, value)
            run.checkpoints.append(point)
            yield share
    except KeyboardInterrupt:
        value = training.evaluator.evaluate(training.make_policy(run))
        run.checkpoints.append(Checkpoint(games.step_count, games.episode_count, seconds, value))
        run.part_steps.append(games.step_count)
        raise


def repeat_training(file: LearnedFile, problem: Problem) -> TrainingRun:
    """Return the run that the header of a file describes, trained again from its seed.

    Raise BadParameter if it was trained on recorded turns, which the file does not have.
    """
    header = file.header
    if header.get("data"):
        raise BadParameter("it was trained on recorded turns, which the file does not have")
    learner = parse_learner(header["learner"])
    training = Training(problem, learner, Evaluator(problem, games=1), header["features"])
    run = TrainingRun(int(header["seed"]))
    for steps in header["part_steps"]:
        done = run.checkpoints[-1].steps if run.checkpoints else 0
        length = TrainingLength.choose(learner, steps - done, None, steps)
        for _ in iterate_checkpoints(training, run, length):
            pass
    return run


def interquartile_mean(sample: Reals) -> Reals:
    """Return the mean `[...]` of the middle half of samples `[..., E]`.

    As in SciPy's `trim_mean` with 0.25, which rliable uses, a quarter is cut off on both sides,
    rounded down.
    """
    cut = sample.shape[-1] // 4
    middle = np.sort(sample, axis=-1)[..., cut : sample.shape[-1] - cut]
    return np.asarray(middle.mean(axis=-1))


def estimate_interquartile_mean(sample: Reals, seed: int = 0) -> Estimate:
    """Return the interquartile mean of seeds `[E]` with a 95 % percentile bootstrap interval.

    Source: Agarwal et al., Deep Reinforcement Learning at the Edge of the Statistical Precipice
    (2021), the library rliable. With one problem, the strata of the bootstrap are one.
    """
    generator = make_numpy_generator(seed)
    draws = generator.integers(len(sample), size=(BOOTSTRAP_SAMPLES, len(sample)))
    means = interquartile_mean(sample[draws])
    low, high = np.quantile(means, (0.025, 0.975))
    mean = float(interquartile_mean(sample))
    return Estimate(mean, float(means.std()), float(low), float(high))
