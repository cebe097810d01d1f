"""The one-shot reports: the table of problems, and all there is to know of one."""

import shutil
from dataclasses import fields
from json import dumps
from textwrap import fill

from rich.console import Console
from rich.table import Table

from dmplay.core import Interval, Problem
from dmplay.describe import summary
from dmplay.errors import UnknownName
from dmplay.finding import agents, problems
from dmplay.finding.names import problem_names
from dmplay.game.keymap import AS_DRAWN, Keys, hands
from dmplay.terminal import Wishes, here

WIDE = 100  # columns of a table that goes into a pipe
GAP = 1  # columns between two
MANY = 12  # names that a line holds


def facts() -> list[dict[str, str]]:
    """Table F.1: every built-in problem with its kind."""
    rows = []
    for name in problem_names():
        problem = problems.load(name)
        rows.append({"problem": name, "kind": problem.kind} | summary(problem))
    return rows


def of_kind(kind: str) -> list[dict[str, str]]:
    """Table F.1, or its problems of one kind: the beginning of its name, as MDP or simple."""
    known = facts()
    chosen = [one for one in known if one["kind"].lower().startswith(kind.lower())]
    if not chosen:
        raise UnknownName("kind", kind, dict.fromkeys(one["kind"] for one in known))
    return chosen


def table(known: list[dict[str, str]], width: int) -> Table:
    """Table F.1 for people, in so many columns of the terminal."""
    shown = fitting(known, width)
    drawn = Table(box=None, header_style="bold", pad_edge=False, padding=(0, GAP, 0, 0))
    for heading in shown:
        drawn.add_column(heading, no_wrap=heading != "kind" and len(shown) > 1, overflow="fold")
    for one in known:
        drawn.add_row(*(_short(one[heading]) for heading in shown))
    return drawn


def fitting(known: list[dict[str, str]], width: int) -> list[str]:
    """As many headings, from the left, as there is room for, at least one; a kind may take two
    rows.
    """
    shown: list[str] = []
    left = width + GAP
    for heading in known[0]:
        cells = [_short(one[heading]) for one in known]
        words = " ".join(cells).split() if heading == "kind" else cells
        left -= max(map(len, [heading, *words])) + GAP
        if left < 0 and shown:
            break
        shown.append(heading)
    return shown


def _short(cell: str) -> str:
    return cell.replace("per agent", "each")


def about(name: str, keys: Keys = AS_DRAWN) -> dict[str, object]:
    """Everything about a problem: what it is, its spaces, parameters, agents, keys and source."""
    problem = problems.load(name)
    base = name.partition(":")[0]
    return {
        "problem": name,
        "kind": problem.kind,
        "about": problems.docs(problem),
        "agents": list(problem.agents),
        "states": summary(problem)["states"],
        "actions": _named(problem.actions[0]),
        "observations": _observed(problem),
        "turns": problem.horizon,
        "parameters": {
            one.name: {
                "default": getattr(problem, one.name),
                "meaning": one.metadata.get("meaning", ""),
            }
            for one in fields(problem)
        },
        "variants": [variant or "standard" for variant in problems.variants(base) or [""]],
        "players": {
            name: (make.__doc__ or "").partition("\n")[0]
            for name, make in agents.roster(problem).agents.items()
        },
        "keys": dict(hands(problem, keys).keys),
    }


def _named(actions: object) -> object:
    if isinstance(actions, Interval):
        return {"from": actions.low, "to": actions.high}
    return list(actions)  # type: ignore[call-overload]


def _observed(problem: Problem) -> object:
    return "the state" if problem.observations is None else list(problem.observations[0])


def told(facts_: dict[str, object]) -> str:
    """The same for people."""
    keys: dict[str, list[str]] = {}
    for key, label in facts_["keys"].items():  # type: ignore[attr-defined]
        keys.setdefault(label, []).append(key)
    rows = [f"{facts_['problem']}: {facts_['kind']}", "", str(facts_["about"]), ""]
    rows += [
        f"seats         {', '.join(facts_['agents'])}",  # type: ignore[arg-type]
        f"states        {facts_['states']}",
        f"actions       {_listed(facts_['actions'])}",
        f"observations  {_listed(facts_['observations'])}",
        f"turns         {facts_['turns'] or 'until it ends'}",
        f"variants      {', '.join(facts_['variants'])}",  # type: ignore[arg-type]
        "",
        "parameters (--set NAME=VALUE)",
    ]
    parameters: dict[str, dict[str, object]] = facts_["parameters"]  # type: ignore[assignment]
    widest = max(map(len, parameters))
    for name, one in parameters.items():
        shown = str(one["default"])
        shown = shown if len(shown) <= 24 else f"{shown[:21]}..."
        rows.append(f"  {name:<{widest}} {shown:<24} {one['meaning']}")
    rows += ["", "agents (--agent, --vs, --seat NAME=AGENT)"]
    rows += [
        f"  {name:<22} {doc}"
        for name, doc in {
            "human": "You.",
            **facts_["players"],  # type: ignore[dict-item]
            "script:a,b,c": "Written actions, or script:FILE.",
            "replay:FILE": "The seat's actions from a transcript.",
        }.items()
    ]
    rows += ["", "keys"]
    rows += [f"  {label:<14} {', '.join(names)}" for label, names in keys.items()]
    return "\n".join(rows)


def _listed(known: object) -> str:
    """Names with commas between, of many the first and the last; the span of reals."""
    if isinstance(known, dict):
        return f"a number from {known['from']:g} to {known['to']:g}"
    if not isinstance(known, list):
        return str(known)
    return ", ".join(known if len(known) <= MANY else [*known[:3], "...", known[-1]])


def players(name: str) -> list[dict[str, object]]:
    """The agents that fit a problem: name, what each does, its parameters and their meanings."""
    problem = problems.load(name)
    advises = {agents.roster(problem, seat).adviser for seat in range(len(problem.agents))}
    partners = {agents.roster(problem, seat).partner for seat in range(1, len(problem.agents))}
    rows: list[dict[str, object]] = []
    for agent, make in agents.roster(problem).agents.items():
        rows.append(
            {
                "agent": agent,
                "does": (make.__doc__ or "").partition("\n")[0],
                "parameters": agents.settings(make),
                "meanings": agents.meanings(make),
                "advises": agent in advises,
                "partner": agent in partners,
            }
        )
    return rows


def print_agents(name: str, *, json: bool) -> None:
    """Prints the agents that fit a problem."""
    known = players(name)
    if json:
        print(dumps(known))
        return
    for one in known:
        parts = one["parameters"].items()  # type: ignore[attr-defined]
        given = f":{','.join(f'{key}={value}' for key, value in parts)}" if parts else ""
        marks = [word for word in ("advises", "partner") if one[word]]
        note = f" ({', '.join(marks)})" if marks else ""
        print(f"{one['agent']}{given}{note}\n    {one['does']}")
        for key, meaning in one["meanings"].items():  # type: ignore[attr-defined]
            if meaning:
                print(f"    {key}: {meaning}.")


def print_list(kind: str, wishes: Wishes) -> None:
    """Prints table F.1, or its problems of one kind, and what there was no room for."""
    known = of_kind(kind)
    if wishes.json:
        print(dumps(known))
        return
    wide, color = wishes.width or shutil.get_terminal_size((WIDE, 0)).columns, here(wishes).color
    drawn = Console(width=wide, force_terminal=color, no_color=not color, highlight=False)
    drawn.print(table(known, wide))
    left_out = [*known[0]][len(fitting(known, wide)) :]
    if left_out:
        print(fill(f"no room for {', '.join(left_out)}; --width or --json has all", wide))


def print_info(name: str, keys: Keys, *, json: bool) -> None:
    """Prints all about a problem, with the keys in force."""
    found = about(name, keys)
    print(dumps(found) if json else told(found))
