"""Transcripts to begin with: short games of every problem, and the goldens that are short."""

from functools import cache
from pathlib import Path

from tests.fuzz.case import GAME, Case
from tests.fuzz.program import dmplay
from tests.support.cases import CASES, load

GOLDENS = Path(__file__).parent.parent.parent / "transcripts"
SHORT = 3000  # characters of a golden that is mutated
# Hunts that are planned for longer than a case may take: the triangle stands for them.
HUNT = "collaborative-predator-prey"
PONDEROUS = (HUNT, f"{HUNT}:sighted", f"{HUNT}:circle")
SLOW = (HUNT.encode(), b'"equilibrium"')  # long to verify, however short


@cache
def transcripts() -> tuple[bytes, ...]:
    """All of them, as they are written."""
    names = [(seed, name) for seed, name in enumerate(CASES) if name not in PONDEROUS]
    made = [_of_agents(name, seed) for seed, name in names]
    made += [_of_people(name, seed) for seed, name in names]
    kept = [path.read_bytes() for path in sorted(GOLDENS.rglob("*.dmt"))]
    goldens = [raw for raw in kept if len(raw) < SHORT and not any(slow in raw for slow in SLOW)]
    return (*made, *goldens)


@cache
def of_people() -> tuple[bytes, ...]:
    """Those in which people play."""
    return tuple(raw for raw in transcripts() if b'"human"' in raw)


def actions(name: str) -> list[str]:
    """What can be typed as an action of a problem's first seat."""
    known = load(name).actions[0]
    return list(known.labels) or ["0", "0.5", "-1"]


def _of_agents(name: str, seed: int) -> bytes:
    return _played(name, seed, "--agent", "random", *["--frames"] * (seed % 2))


def _of_people(name: str, seed: int) -> bytes:
    first, *_, last = actions(name)
    return _played(name, seed, typed=f"{first}\n{last}\nundo\n{first}\nreroll\nquit\n")


def _played(name: str, seed: int, *words: str, typed: str = "") -> bytes:
    """A game of three turns."""
    others = ["--vs", "random"] * (len(load(name).agents) > 1)
    told = ["--seed", str(seed), "--turns", "3", "-o", GAME, "--quiet"]
    return dmplay(Case((name, *told, *words, *others), typed=typed)).files[GAME]
