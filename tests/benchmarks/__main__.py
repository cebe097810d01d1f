"""How fast it is: `python -m tests.benchmarks [start] [keys] [batch] [long] [bots] [loops]
[honest] [simulations] [solving] [teams] [beliefs] [rollouts]
[--runs N]`; how well agents play:
`python -m tests.benchmarks league [--problem NAME] [--agent NAME] [--games N]`.

Every number is a median of runs that take turns with one another, so that a busy moment of the
machine hits all of them alike. Nothing here passes or fails.
"""

import argparse
import compileall
from pathlib import Path

import dmplay
from tests.benchmarks import (
    batch,
    beliefs,
    bots,
    honest,
    keys,
    league,
    long,
    loops,
    rollouts,
    simulations,
    solving,
    start,
    teams,
)

PARTS = {
    "start": start.report,
    "keys": keys.report,
    "batch": batch.report,
    "long": long.report,
    "bots": bots.report,
    "loops": loops.report,
    "honest": honest.report,
    "simulations": simulations.report,
    "solving": solving.report,
    "teams": teams.report,
    "beliefs": beliefs.report,
    "rollouts": rollouts.report,
}
RUNS = {
    "start": 15, "keys": 60, "batch": 7, "long": 3, "bots": 3, "loops": 7, "honest": 400,
    "simulations": 5, "solving": 3, "teams": 6, "beliefs": 1,
    "rollouts": 5,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("part", nargs="*", help=f"league, or {', '.join(PARTS)}; all these")
    parser.add_argument("--runs", type=int, help=f"runs, or keys, of each kind; now {RUNS}")
    parser.add_argument("--problem", action="append", default=[], help="of the league")
    parser.add_argument("--agent", action="append", default=[], help="of the league")
    parser.add_argument(
        "--games", type=int, default=league.GAMES, help="of each agent of the league"
    )
    parser.add_argument("--workers", type=int, default=1, help="of the league")
    wanted = parser.parse_args()
    if wanted.part == ["league"]:
        league.report(wanted.games, wanted.problem, wanted.agent, wanted.workers)
        return
    unknown = set(wanted.part) - set(PARTS)
    if unknown:
        parser.error(f"unknown part {unknown.pop()}, expected {', '.join(PARTS)}")
    compileall.compile_dir(str(Path(dmplay.__file__).parent), quiet=2)
    for name, report in PARTS.items():
        if name in (wanted.part or PARTS):
            report(wanted.runs or RUNS[name])


if __name__ == "__main__":
    main()
