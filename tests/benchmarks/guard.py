"""Compare the speed of the main paths with stored ratios to floors on the same machine.

Each figure is processor time divided by that of a floor: plain Python and NumPy that does nothing
of dmplay. The ratio is compared with the one in `guard_ratios.json`, so that a change that makes a
path slower is seen at once, on any machine.
"""

import json
import sys
import tempfile
import time
from collections.abc import Callable
from itertools import count, cycle
from pathlib import Path
from statistics import median

import numpy as np

from dmplay.game.game_series import GameController
from dmplay.ui.screen.key_handlers import handle_key
from dmplay.ui.screen.play_screen import PlayScreen
from tests.benchmarks.long_games import BASELINE_SCRIPT, GAME_ARGUMENTS, measure_command
from tests.benchmarks.terminal import DMPLAY
from tests.support.screens import make_game
from tests.ui.screen.frames import BASE_TERMINAL, FrameRecorder

RATIOS_PATH = Path(__file__).parent / "guard_ratios.json"
LOST_SHARE = 0.3  # a figure that is slower by this share is marked
FLOOR_OPERATIONS = 20  # NumPy operations of a floor, for each turn
SHORT_TURNS, LONG_TURNS = 200, 5_200
ENV_PROBLEMS = ("cart-pole", "mountain-car", "hexworld", "2048", "crying-baby")
BATCHES = (("cart-pole", 64), ("cart-pole", 10_000), ("hexworld", 1_024))

Measure = Callable[[], float]  # returns seconds of processor time
Figure = tuple[Measure, Measure]  # the path, and its floor


def _time_calls(function: Callable[[], object], call_count: int) -> Measure:
    """Return a measurement of this many calls."""

    def measure() -> float:
        start_time = time.process_time()
        for _ in range(call_count):
            function()
        return time.process_time() - start_time

    return measure


def _make_array_floor(rows: int) -> Callable[[], None]:
    """Return a turn of plain NumPy: FLOOR_OPERATIONS additions of arrays with this many rows."""
    numbers = np.arange(float(rows))

    def add_arrays() -> None:
        for _ in range(FLOOR_OPERATIONS):
            numbers + numbers

    return add_arrays


def _make_env_figure(name: str) -> Figure:
    """Return the steps of an `Env`, and arrays of one number."""
    from dmplay.gym import Env

    env = Env(name)
    env.reset(seed=1)
    actions = cycle(
        np.random.default_rng(1).integers(0, env.problem.action_counts[0], 997).tolist()
    )

    def step() -> None:
        _, _, terminated, truncated, _ = env.step(next(actions))
        if terminated or truncated:
            env.reset()

    return _time_calls(step, 1_000), _time_calls(_make_array_floor(1), 1_000)


def _make_batch_figure(name: str, rows: int) -> Figure:
    """Return the steps of a `VectorEnv`, and arrays with as many rows."""
    from dmplay.gym import VectorEnv

    env = VectorEnv(name, rows, uniforms="fast")
    env.reset(seed=1)
    actions = np.random.default_rng(1).integers(0, env.problem.action_counts[0], rows)
    turns = 300_000 // (rows + 1_000)
    return (
        _time_calls(lambda: env.step(actions), turns),
        _time_calls(_make_array_floor(rows), turns),
    )


def _make_key_figure() -> Figure:
    """Return keys of hexworld with their frames, and arrays of one number."""
    screen = PlayScreen(
        GameController(make_game("hexworld", parameters={"rewards": ()}, turns=100_000)),
        BASE_TERMINAL,
    )
    painter, keys = FrameRecorder(), cycle("hlhl")

    def press_key() -> None:
        handle_key(screen, next(keys))
        screen.paint(painter)

    return _time_calls(press_key, 60), _time_calls(_make_array_floor(1), 2_000)


def _make_hint_figure() -> Figure:
    """Return hints of a search in 2048, and arrays of one number."""
    seeds = count(1)  # A hint is computed once for each state.

    def give_hint() -> None:
        make_game("2048", seed=next(seeds)).hint_provider.create_hint()

    give_hint()  # loads the weights of the agent
    return _time_calls(give_hint, 3), _time_calls(_make_array_floor(1), 2_000)


def _measure_difference(folder: Path, make_command: Callable[[int], tuple[str, ...]]) -> Measure:
    """Return a measurement of a command on a long game, less that on a short one."""
    return lambda: (
        measure_command(make_command(LONG_TURNS), folder).seconds
        - measure_command(make_command(SHORT_TURNS), folder).seconds
    )


def _list_command_figures(folder: Path) -> dict[str, Figure]:
    """Return recording, verification and export of long games, a start and a solution."""
    floor = _measure_difference(
        folder, lambda turns: (sys.executable, "-c", BASELINE_SCRIPT, f"{turns}.dmt", "out")
    )

    def record(turns: int) -> tuple[str, ...]:
        options = ("--turns", str(turns), "--quiet", "--force", "-o", f"{turns}.dmt")
        return (*DMPLAY, *GAME_ARGUMENTS, *options)

    for turns in (SHORT_TURNS, LONG_TURNS):
        measure_command(record(turns), folder)
    cast = ("--cast", "-o", "out.cast", "--force")

    def start(*command: str) -> Measure:
        return lambda: measure_command(command, folder).seconds

    python = start(sys.executable, "-c", "import numpy")
    return {
        "record a turn": (_measure_difference(folder, record), floor),
        "verify a turn": (
            _measure_difference(folder, lambda turns: (*DMPLAY, "verify", f"{turns}.dmt")),
            floor,
        ),
        "export a turn with --cast": (
            _measure_difference(folder, lambda turns: (*DMPLAY, "export", f"{turns}.dmt", *cast)),
            floor,
        ),
        "start: --version": (start(*DMPLAY, "--version"), python),
        "start: hexworld --help": (start(*DMPLAY, "hexworld", "--help"), python),
        "start: list": (start(*DMPLAY, "list"), python),
        "solve crying-baby": (_measure_solution, python),
    }


def _measure_solution() -> float:
    """Return the processor time of solving a problem whose solution is not in the cache."""
    with tempfile.TemporaryDirectory() as folder:
        return measure_command((*DMPLAY, "solve", "crying-baby"), Path(folder)).seconds


def report(runs: int, *, write: bool = False) -> None:
    """Print each ratio beside the stored one; with `write`, store the new ratios."""
    stored = json.loads(RATIOS_PATH.read_text()) if RATIOS_PATH.exists() else {}
    with tempfile.TemporaryDirectory() as folder:
        figures = {f"step Env of {name}": _make_env_figure(name) for name in ENV_PROBLEMS}
        figures |= {
            f"step {name}, {rows} rows": _make_batch_figure(name, rows) for name, rows in BATCHES
        }
        figures |= {"key to frame": _make_key_figure(), "hint in 2048": _make_hint_figure()}
        figures |= _list_command_figures(Path(folder))
        ratios: dict[str, list[float]] = {name: [] for name in figures}
        for _ in range(runs):
            for name, (measure, measure_floor) in figures.items():
                seconds = measure()
                ratios[name].append(seconds / measure_floor())
    medians = {name: round(median(samples), 2) for name, samples in ratios.items()}
    print(f"times a floor of this machine, medians of {runs} interleaved runs, and as stored")
    for name, ratio in medians.items():
        print(format_figure(name, ratio, stored.get(name)))
    if write:
        RATIOS_PATH.write_text(f"{json.dumps(medians, indent=1)}\n")


def format_figure(name: str, ratio: float, stored: float | None) -> str:
    """Return a row with a ratio and the stored one, marked if more than LOST_SHARE is lost."""
    if stored is None:
        return f"  {name:<28}{ratio:9.2f}      new"
    change = ratio / stored - 1
    mark = "  SLOWER" if change > LOST_SHARE else ""
    return f"  {name:<28}{ratio:9.2f}{stored:9.2f}{100 * change:+6.0f} %{mark}"
