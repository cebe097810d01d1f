"""Commands that play many games: what agents earn, and who is ahead."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from dmplay.cli import options
from dmplay.errors import BadParameter
from dmplay.terminal import Wishes, here

Episodes = Annotated[int, typer.Option("--episodes", metavar="N", min=1, help="games")]
Csv = Annotated[bool, typer.Option("--csv", help="as comma-separated values")]
Dice = Annotated[int, typer.Option("--seed", metavar="N", min=0, help="the dice of all games")]
Engine = Annotated[
    str,
    typer.Option("--executor", metavar="ENGINE", help="dask, dask:tcp://HOST:PORT, MODULE:FACTORY"),
]
MATCH: Mapping[str, tuple[Any, object]] = {
    "variant": (options.Variant, ""),
    "set_": (options.Set, []),
    "vs": (options.Others, ""),
    "seat": (options.Seats, []),
    "turns": (options.Unattended, None),
    "seed": (Dice, 0),
    "workers": (options.Workers, "auto"),
    "executor": (Engine, ""),
    "csv": (Csv, False),
}
Form = Literal["", "json", "csv"]


def _of_matches(*without: str) -> Callable[[options.Command], options.Command]:
    """Gives a command, in place of its parameter `given`, the options of games that are many."""
    some = {name: one for name, one in MATCH.items() if name not in without}
    return options.spread("given", some, lambda given: given)


def _match(problem: str, given: Mapping[str, Any], wishes: Wishes, agent: str = "") -> Any:
    """What is played, by what was given."""
    from dmplay.game.request import Request
    from dmplay.reports.match import Match

    return Match(
        Request(problem, given["variant"]).name, given["set_"], agent,
        others=given.get("vs", ""), seats=given.get("seat", ()), turns=given["turns"],
        seed=given["seed"], workers=options.many(given["workers"]), engine=given["executor"],
        form=form_of(json=wishes.json, csv=given["csv"]), motion=wishes.motion,
    )  # fmt: skip


@_of_matches()
@options.wishes("json", "motion", "ascii")
def run(
    problem: options.Name,
    agent: options.Agent = "",
    episodes: Annotated[
        int | None,
        typer.Option("--episodes", metavar="N", min=1, help="games; 10000 unless it is said"),
    ] = None,
    until_se: Annotated[
        float | None, typer.Option("--until-se", metavar="X", help="until errors are so small")
    ] = None,
    record: Annotated[
        Path | None, typer.Option("--record", metavar="DIR", help="keeps some as transcripts")
    ] = None,
    every: Annotated[
        int, typer.Option("--every", metavar="N", min=0, help="of them, each Nth")
    ] = 0,
    worst: Annotated[int, typer.Option("--worst", metavar="N", min=0, help="the N worst")] = 0,
    best: Annotated[int, typer.Option("--best", metavar="N", min=0, help="the N best")] = 0,
    *,
    given: Mapping[str, Any],
    wishes: Wishes,
) -> object:
    """Play many games: what each seat earns, how sure that is, and how it is spread.

    A list of numbers for a parameter is a sweep. The dice are those of --seed, 0 if
    not given: the same games on every machine, whatever the workers.

    \b
      dmplay run hexworld --agent optimal
      dmplay run hexworld --set slip=0.1,0.2,0.3 --until-se 0.01
      dmplay run 2048 --agent corner --episodes 200 --record games --worst 2 --best 2
      dmplay run prisoners-dilemma --agent grim --vs tit-for-tat --turns 20 --json
    """
    from dmplay.reports import measuring
    from dmplay.reports.recorded import Keeping

    match = _match(problem, given, wishes, agent)
    keeping = Keeping(record, every, worst, best)
    return measuring.ran(
        match, episodes=episodes, until=until_se, keeping=keeping, ascii_=here(wishes).ascii
    )


@_of_matches()
@options.wishes("json", "motion")
def compare(
    problem: options.Name,
    agents: Annotated[list[str], typer.Argument(metavar="AGENT...", help="two or more agents")],
    episodes: Episodes = 10_000,
    decide: Annotated[
        float | None,
        typer.Option("--decide", metavar="P", help="stop when it is clear, wrong in at most P"),
    ] = None,
    *,
    given: Mapping[str, Any],
    wishes: Wishes,
) -> object:
    """Compare agents in the first seat on the same dice: who earns more, and how sure that is.

    \b
      dmplay compare hexworld optimal search --episodes 1000
      dmplay compare crying-baby optimal feed-when-crying --decide 0.05
    """
    from dmplay.reports import measuring

    match = _match(problem, given, wishes)
    return measuring.compared(match, agents, episodes=episodes, decide=decide)


@_of_matches("vs", "seat")
@options.wishes("json", "motion")
def tournament(
    problem: options.Name,
    entrants: Annotated[list[str], typer.Argument(metavar="AGENT...", help="two or more agents")],
    episodes: Episodes = 1000,
    seats: Annotated[
        str, typer.Option("--seats", metavar="ORDER", help="all, or given: as they are named")
    ] = "all",
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="FILE", help="keeps what is played, to go on with"),
    ] = None,
    *,
    given: Mapping[str, Any],
    wishes: Wishes,
) -> object:
    """Seat everybody against everybody, in every order, on the same dice.

    The cross table, who replies best to whom, the equilibrium of the game in which
    an action is an entrant, and what each loses in it: of --seats given, where nobody
    sits behind whoever is named later, only the first.

    \b
      dmplay tournament prisoners-dilemma grim tit-for-tat always-defect --turns 50
      dmplay tournament rock-paper-scissors nash random beat-last --json
    """
    from dmplay.reports import tournaments

    match = _match(problem, given, wishes)
    return tournaments.met(match, entrants, episodes=episodes, orders=seats, kept=output)


def form_of(*, json: bool, csv: bool) -> Form:
    """Which of two forms is wanted, or neither: for people."""
    if json and csv:
        raise BadParameter("--json and --csv: expected one of them")
    return "json" if json else "csv" if csv else ""
