"""Tests of the seeds of new games: those of people do not end almost at once, if others last."""

from collections.abc import Callable
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import pytest

import dmplay
from dmplay import Outcome
from dmplay.agents.random_agent import Random
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.core.arrays import Array
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.evaluation.assignment import read_assignment
from dmplay.evaluation.many_games import rollout
from dmplay.game.command_line_results import McpServerConfig
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import resume_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.start_seeds import choose_daily_seed, draw_seed
from dmplay.registry.problems import load_problem
from dmplay.servers.mcp.language_model_games import ModelGames
from dmplay.transcript.reader import read_transcript
from tests.formats.sources import write_text_file

GAMES = 60  # Without a second draw, all of them last with probability 0.75**60.
# A problem of a user: a quarter of the games ends in the first turn, and the others in the fifth.
STAIRS = """\
from dataclasses import dataclass
import numpy as np
from dmplay import Labels, Tables, Tabular

@dataclass(frozen=True)
class Stairs(Tabular):
    "Six stairs to climb down; a quarter of the games starts on the last one but one."

    last_share: float = 0.25
    actions = (Labels(("climb", "slide")),)
    state_names = tuple("abcdef")
    tables = Tables(np.eye(6)[[[min(s + 1, 5)] * 2 for s in range(6)]], np.zeros((6, 2, 1)))

    @property
    def initial_belief(self):
        return np.array([1 - self.last_share, 0, 0, 0, self.last_share, 0])

    def terminal(self, s):
        return s == 5
"""


@pytest.fixture
def stairs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """Write a problem whose games are sometimes short, and return its name."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    return write_text_file(tmp_path, "stairs.py", STAIRS)


def starts_short(problem: Problem, seed: int, episode: int = 0) -> bool:
    """Return whether a game of the stairs begins on the last stair but one."""
    state = Session(problem, SeededUniforms(seed, episode)).initial_state
    return problem.format_state(state) == "e"


def test_no_game_that_a_person_starts_without_a_seed_is_short(stairs: str) -> None:
    request = GameRequest(stairs)
    for changed in (replace(request, episode=3), replace(request, turns=1), request):
        for _ in range(GAMES // 4):
            game = start_new_game(changed)
            assert not starts_short(game.problem, game.seed, changed.episode)
    controller = GameController(start_new_game(request))
    for _ in range(GAMES // 4):
        controller.restart_with_new_seed()
        assert not starts_short(controller.game.problem, controller.game.seed)


def test_no_walk_over_the_hexes_begins_on_an_exit() -> None:
    problem = load_problem("hexworld")
    for _ in range(100):
        state = Session(problem, SeededUniforms(draw_seed(problem))).initial_state
        assert problem.format_state(state) not in ("(0,1)", "(2,0)", "(9,0)")


def read_seed(session: Session | None) -> int:
    """Return the seed of a session."""
    assert session
    assert isinstance(session.uniform_source, SeededUniforms)
    return session.uniform_source.seed


def draw_in_assignments(name: str) -> list[int]:
    """Return the new seeds of an assignment."""
    interpret_command(["assign", name, "--games", str(GAMES), "-o", "assignment"])
    return [*read_assignment(Path("assignment")).seeds]


def draw_for_models(name: str) -> list[int]:
    """Return the new seeds of games that a language model plays."""
    games = ModelGames(McpServerConfig((name,), transcript_folder=Path("games")))
    (problem,) = games.list_problems()
    for _ in range(GAMES):
        games.end_game(str(games.start_game(problem["problem"])["game"]))
    return [read_transcript(file).header.seed for file in Path("games").glob("*.dmt")]


def draw_in_environments(name: str) -> list[int]:
    """Return the new seeds of environments for programs that learn."""
    from dmplay.gym import Env

    envs = [Env(name) for _ in range(GAMES)]
    for env in envs:
        env.reset()
    return [read_seed(env.session) for env in envs]


def draw_for_agents(name: str) -> list[int]:
    """Return the new seeds of games of agents."""
    return [start_new_game(GameRequest(name, agent="random")).seed for _ in range(GAMES)]


def draw_in_python(name: str) -> list[int]:
    """Return the new seeds of games from Python."""
    return [read_seed(dmplay.play(name).session) for _ in range(GAMES)]


DRAWS = [
    draw_for_agents,
    draw_in_python,
    pytest.param(draw_in_environments, marks=pytest.mark.extra("gymnasium")),
    draw_in_assignments,
    draw_for_models,
]


@pytest.mark.parametrize("draw", DRAWS)
def test_other_games_keep_their_first_draw(stairs: str, draw: Callable[[str], list[int]]) -> None:
    problem, seeds = load_problem(stairs), draw(stairs)
    assert len({*seeds}) == GAMES
    assert any(starts_short(problem, seed) for seed in seeds)


def test_a_chosen_seed_is_kept_and_so_are_games_that_are_usually_short(stairs: str) -> None:
    seed = next(seed for seed in range(GAMES) if starts_short(load_problem(stairs), seed))
    assert start_new_game(GameRequest(stairs, seed=seed)).seed == seed
    short = replace(load_problem(stairs), last_share=0.9)  # type: ignore[call-arg]
    assert any(starts_short(short, draw_seed(short)) for _ in range(GAMES))


def test_runs_and_resumed_games_keep_the_games_of_their_seeds(stairs: str) -> None:
    problem = load_problem(stairs)
    games = rollout(problem, [Random(problem, 0)], episodes=GAMES)
    is_short = [starts_short(problem, 0, episode) for episode in range(GAMES)]
    assert any(is_short)
    assert [count == 1 for count in games.turn_counts] == is_short
    request = GameRequest(stairs, seed=0, episode=is_short.index(True), record_path=Path("a.dmt"))
    start_new_game(request).pause()
    resumed = resume_game(ResumeRequest(Path("a.dmt"), trusted=True))
    assert starts_short(problem, resumed.seed, is_short.index(True))


def test_the_seed_of_the_day_is_the_date_or_the_first_number_after_it_with_a_longer_game(
    stairs: str,
) -> None:
    problem = load_problem(stairs)
    for day in (date(2026, 11, 1) + timedelta(n) for n in range(20)):
        seed = int(f"{day:%Y%m%d}")
        seeds = [seed, *range(100 * seed + 1, 100 * seed + 21)]
        expected = next(seed for seed in seeds if not starts_short(problem, seed))
        assert choose_daily_seed(problem, day) == expected
    short = replace(problem, last_share=0.9)  # type: ignore[call-arg]
    assert choose_daily_seed(short, date(2026, 11, 22)) == 20261122


def test_a_problem_that_fails_keeps_its_first_draw(stairs: str) -> None:
    class Broken(type(load_problem(stairs))):  # type: ignore[misc]
        def resolve_events(self, s: Array, a: Array, events: tuple[Array, ...]) -> Outcome:
            raise OSError

    assert draw_seed(Broken()) >= 0
    assert choose_daily_seed(Broken(), date(2026, 11, 22)) == 20261122
