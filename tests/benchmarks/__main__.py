"""Run benchmarks of speed: `python -m tests.benchmarks [start] [keys] [batch] [long] [bots] [loops]
[honest] [simulations] [solving] [teams] [beliefs] [rollouts]
[guard [--write]] [--runs N]`; measure how well agents play:
`python -m tests.benchmarks league [--problem NAME] [--agent NAME] [--games N]`.

Each number is a median of interleaved runs, so that a busy moment of the machine affects all
measurements equally. The benchmarks do not pass or fail.
"""

import argparse
import compileall
from pathlib import Path

import dmplay
from tests.benchmarks import (
    batch,
    beliefs,
    bots,
    dec_pomdps,
    environments,
    guard,
    interval_coverage,
    keys,
    league,
    long_games,
    rollouts,
    simulations,
    solving,
    startup,
)

BENCHMARKS = {
    "start": startup.report,
    "keys": keys.report,
    "batch": batch.report,
    "long": long_games.report,
    "bots": bots.report,
    "loops": environments.report,
    "honest": interval_coverage.report,
    "simulations": simulations.report,
    "solving": solving.report,
    "teams": dec_pomdps.report,
    "beliefs": beliefs.report,
    "rollouts": rollouts.report,
    "guard": guard.report,
}
DEFAULT_RUN_COUNTS = {
    "start": 15, "keys": 60, "batch": 7, "long": 3, "bots": 3, "loops": 7, "honest": 400,
    "simulations": 5, "solving": 3, "teams": 6, "beliefs": 1,
    "rollouts": 5, "guard": 3,
}  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.benchmarks", description=__doc__)
    parser.add_argument("part", nargs="*", help=f"league, or {', '.join(BENCHMARKS)}; all these")
    parser.add_argument(
        "--runs", type=int, help=f"runs, or keys, of each kind; now {DEFAULT_RUN_COUNTS}"
    )
    parser.add_argument("--problem", action="append", default=[], help="of the league")
    parser.add_argument("--agent", action="append", default=[], help="of the league")
    parser.add_argument(
        "--games", type=int, default=league.DEFAULT_GAMES, help="of each agent of the league"
    )
    parser.add_argument("--workers", type=int, default=1, help="of the league")
    parser.add_argument(
        "--write",
        action="store_true",
        help="replace the lines of the league in the guide, or the ratios of guard",
    )
    options = parser.parse_args()
    if options.part == ["guard"]:
        guard.report(options.runs or DEFAULT_RUN_COUNTS["guard"], write=options.write)
        return
    if options.part == ["league"]:
        if options.write and options.agent:
            parser.error("--write needs all agents; leave out --agent")
        league.report(
            options.games, options.problem, options.agent, options.workers, write=options.write
        )
        return
    unknown = set(options.part) - set(BENCHMARKS)
    if unknown:
        parser.error(f"unknown part {unknown.pop()}, expected {', '.join(BENCHMARKS)}")
    compileall.compile_dir(str(Path(dmplay.__file__).parent), quiet=2)
    for name, report in BENCHMARKS.items():
        if name in (options.part or BENCHMARKS):
            report(options.runs or DEFAULT_RUN_COUNTS[name])


if __name__ == "__main__":
    main()
