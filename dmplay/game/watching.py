"""The steps of a watched algorithm, computed when they are first needed, and the choice of it."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import count, islice
from pathlib import Path

from dmplay.algorithms import registry
from dmplay.algorithms.step import Algorithm, Step, WatchRequest
from dmplay.core.problem import Problem, find_seat
from dmplay.core.text import format_count
from dmplay.errors import BadParameter
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.game import Game
from dmplay.game.launch_requests import format_variant_name, parse_settings
from dmplay.game.playback import Playback
from dmplay.registry.problems import is_problem_name, load_problem

TRANSCRIPT_EXTENSION = ".dmt"


class WatchedSteps:
    """The steps of an algorithm on a problem; each is computed once, when it is first needed."""

    def __init__(self, algorithm: Algorithm, request: WatchRequest, problem_name: str) -> None:
        registry.check_algorithm_fits(algorithm, request.problem, problem_name)
        self.algorithm, self.request, self.problem_name = algorithm, request, problem_name
        self.steps: list[Step] = []
        self.note = ""  # how this algorithm was chosen
        self.is_complete = False  # whether the last step is known
        self._iterator: Iterator[Step] | None = None

    @property
    def problem(self) -> Problem:
        """The problem on which the algorithm runs."""
        return self.request.problem

    @property
    def title(self) -> str:
        """The algorithm and the problem in words."""
        return f"{self.algorithm.name} on {self.problem_name}"

    def compute_until(self, index: int) -> int:
        """Compute the steps up to an index; return it, or that of the last step if it is lower."""
        while len(self.steps) <= index and not self.is_complete:
            self._compute_next()
        return min(index, len(self.steps) - 1)

    def iter_steps(self) -> Iterator[Step]:
        """Yield all steps, from the first on."""
        for index in count():
            if self.compute_until(index) < index:
                return
            yield self.steps[index]

    def _compute_next(self) -> None:
        """Compute one more step; after a computation that was stopped, start again before it."""
        if self._iterator is None:
            steps = self.algorithm.iterate_steps(self.request)
            self._iterator = islice(steps, len(self.steps), None)
        iterator, self._iterator = self._iterator, None
        step = next(iterator, None)
        if step is None:
            self.is_complete = True
        else:
            self.steps.append(step)
        self._iterator = iterator

    def find_typed_step(self, number: int) -> int:
        """Return the index of a typed step number, from 1; raise BadParameter if there is none."""
        index = self.compute_until(number - 1)
        if not number or index < number - 1:
            expected = f"expected 1 to {len(self.steps)}, the last step of {self.algorithm.name}"
            raise BadParameter(f"got step {number}, {expected}")
        return index


@dataclass(frozen=True)
class WatchTarget:
    """The problem or the recorded game on which an algorithm is watched."""

    name: str  # a problem, or the file of a transcript
    variant: str = ""
    settings: Sequence[str] = ()  # NAME=VALUE
    seat: str = ""  # the agent; '' for the first
    turn: int | None = None  # the turn of a transcript; None for the last
    trusted: bool = False  # whether code that a transcript names may run

    @property
    def is_transcript(self) -> bool:
        """True if the name is that of a transcript."""
        return self.name.endswith(TRANSCRIPT_EXTENSION)


def load_watched_steps(
    algorithm_name: str, target: WatchTarget, iterations: int | None = None, seed: int = 0
) -> WatchedSteps:
    """Return the steps of an algorithm on a problem, or on a position of a recorded game.

    Raise BadParameter with what fits if the words are in the wrong order, or if one is missing.
    """
    if not target.name and is_problem_name(algorithm_name):
        fitting = ", ".join(registry.list_fitting_algorithms(load_problem(algorithm_name)))
        expected = f"expected an algorithm before it; algorithms that fit it: {fitting or 'none'}"
        raise BadParameter(f"watch: got the problem {algorithm_name}, {expected}")
    algorithm = registry.find_algorithm(algorithm_name)
    if not target.name:
        raise BadParameter(
            f"watch {algorithm.name}: expected a problem; dmplay watch lists those that fit"
        )
    session = None
    if target.is_transcript:
        if target.variant or target.settings:
            raise BadParameter("--variant and --set: a transcript has its own parameters")
        playback = Playback(Path(target.name), trusted=target.trusted)
        turn_count = playback.count_turns()
        turn = turn_count if target.turn is None else target.turn
        if not 0 <= turn <= turn_count:
            turns = format_count(turn_count, "turn")
            raise BadParameter(f"--at: got {turn}, the game has {turns}")
        playback.go_to_turn(turn)
        problem, session, name = playback.problem, playback.session, playback.problem_name
    else:
        if target.turn is not None:
            raise BadParameter("--at: only with a transcript")
        name = format_variant_name(target.name, target.variant)
        problem = load_problem(name, **parse_settings(target.settings, "--set"))
    seat = find_seat(problem, target.seat) if target.seat else 0
    return WatchedSteps(algorithm, WatchRequest(problem, seat, session, iterations, seed), name)


BELIEF_UPDATE, TREE_SEARCH = "belief-update", "tree-search"
GAME_ALGORITHMS = (BELIEF_UPDATE, "fictitious-play", TREE_SEARCH)  # the first that fits is shown
LAST_TURN_ONLY = 1  # iterations of the belief update in a game


def choose_algorithm(game: Game) -> Algorithm:
    """Return the algorithm that suits the position of a game best.

    Before the first turn there is no observation, and after the last one no turn to search. Raise
    BadParameter if no algorithm fits.
    """
    fitting = registry.list_fitting_algorithms(game.problem)
    if not fitting:
        raise BadParameter("watch: no algorithm fits this problem; dmplay watch lists the others")
    unsuitable = {TREE_SEARCH} if game.session.over else set[str]()
    unsuitable |= set() if game.session.turns else {BELIEF_UPDATE}
    suitable = [name for name in (*GAME_ALGORITHMS, *fitting) if name in {*fitting} - unsuitable]
    return registry.find_algorithm([*suitable, *fitting][0])


def make_game_steps(game: Game, name: str = "") -> WatchedSteps:
    """Return the steps of an algorithm on the present position of a game.

    The first step is computed. An algorithm that shows good actions counts as a hint. Raise
    BadParameter if the game forbids hints, or if the algorithm does not fit.
    """
    algorithm = registry.find_algorithm(name) if name else choose_algorithm(game)
    iterations = LAST_TURN_ONLY if algorithm.name == BELIEF_UPDATE else None
    request = WatchRequest(game.problem, game.viewing_seat, game.session, iterations)
    watched = WatchedSteps(algorithm, request, game.problem_name)
    if not name:
        fitting = registry.list_fitting_algorithms(game.problem)
        others = ", ".join(other for other in fitting if other != algorithm.name)
        watched.note = f"chosen: {algorithm.name}{f'; :watch NAME for {others}' if others else ''}"
    is_hint = algorithm.shows_actions and not game.session.over
    if is_hint:
        game.check_hints_allowed("watch")
    run_cancellable(TaskInfo(f"running {algorithm.name}"), lambda: watched.compute_until(0))
    if is_hint:
        game.record_hint()
    return watched
