"""Transcripts to mutate: short games of every problem, and the short goldens."""

from functools import cache
from pathlib import Path

from tests.fuzz.case import GAME_FILE, Case
from tests.fuzz.program import run_dmplay
from tests.support.problem_cases import CASE_NAMES, load_problem

GOLDENS_FOLDER = Path(__file__).parent.parent.parent / "transcripts"
SHORT = 3000  # maximum characters of a golden that is mutated
# Planning these hunts takes longer than a case may; the triangle variant represents them.
HUNT_NAME = "collaborative-predator-prey"
SLOW_PROBLEMS = (HUNT_NAME, f"{HUNT_NAME}:sighted", f"{HUNT_NAME}:circle")
SLOW_TRANSCRIPT_PARTS = (HUNT_NAME.encode(), b'"equilibrium"')  # slow to verify, however short


@cache
def list_transcripts() -> tuple[bytes, ...]:
    """Return the bytes of all transcripts to mutate."""
    names = [(seed, name) for seed, name in enumerate(CASE_NAMES) if name not in SLOW_PROBLEMS]
    generated = [_play_agents(name, seed) for seed, name in names]
    generated += [_play_person(name, seed) for seed, name in names]
    golden_files = [path.read_bytes() for path in sorted(GOLDENS_FOLDER.rglob("*.dmt"))]
    goldens = [
        raw
        for raw in golden_files
        if len(raw) < SHORT and not any(slow in raw for slow in SLOW_TRANSCRIPT_PARTS)
    ]
    return (*generated, *goldens)


@cache
def list_human_transcripts() -> tuple[bytes, ...]:
    """Return the transcripts in which people play."""
    return tuple(raw for raw in list_transcripts() if b'"human"' in raw)


def list_action_texts(name: str) -> list[str]:
    """Return texts that can be typed as an action of the first seat of a problem."""
    action_set = load_problem(name).actions[0]
    return list(action_set.labels) or ["0", "0.5", "-1"]


def _play_agents(name: str, seed: int) -> bytes:
    return _record_game(name, seed, "--agent", "random", *["--frames"] * (seed % 2))


def _play_person(name: str, seed: int) -> bytes:
    first, *_, last = list_action_texts(name)
    return _record_game(name, seed, typed=f"{first}\n{last}\nundo\n{first}\nreroll\nquit\n")


def _record_game(name: str, seed: int, *words: str, typed: str = "") -> bytes:
    """Play a game of three turns and return its transcript."""
    opponents = ["--vs", "random"] * (len(load_problem(name).agents) > 1)
    options = ["--seed", str(seed), "--turns", "3", "-o", GAME_FILE, "--quiet"]
    return run_dmplay(Case((name, *options, *words, *opponents), typed=typed)).files[GAME_FILE]
