"""The one-shot reports: the table of problems, and all there is to know of one."""

import shutil
from json import dumps
from textwrap import fill
from typing import NamedTuple

from rich.console import Console
from rich.table import Table
from rich.text import Text

from dmplay.core import Interval, Labels, Problem, TextLine
from dmplay.describe import format_count, problem_summary
from dmplay.errors import UnknownName
from dmplay.finding import agents, problems
from dmplay.finding.names import problem_names
from dmplay.game.errand import Printout
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES, KeyPreferences, resolve_key_maps
from dmplay.policies.kinds import SeatPolicy
from dmplay.terminal import TerminalOptions

PIPE_COLUMNS = 100  # columns of a table that goes into a pipe
COLUMN_GAP = 1  # columns between two
MAX_LISTED_NAMES = 12  # names that a line holds
SCRIPTED_AGENTS = {
    "script:a,b,c": "Written actions, or script:FILE.",
    "replay:FILE": "The seat's actions from a transcript.",
}
SpaceDescription = (
    str | list[str] | dict[str, float]
)  # what can be done or seen: words, names, a span


def problem_table_rows() -> list[dict[str, str]]:
    """Table F.1: every built-in problem with its kind; those that are installed come last."""
    known = [(name, problems.load_problem(name)) for name in problem_names()]
    known += [
        (name, one) for name, one in problems.iter_installed_problems() if isinstance(one, Problem)
    ]
    return [{"problem": name, "kind": one.kind} | problem_summary(one) for name, one in known]


def format_load_failures() -> str:
    """The installed problems that cannot be loaded, a line each."""
    told = [
        f"{name}: {why}" for name, why in problems.iter_installed_problems() if isinstance(why, str)
    ]
    return "\n".join(told)


def rows_of_kind(kind: str) -> list[dict[str, str]]:
    """Table F.1, or its problems of one kind: the beginning of its name, as MDP or simple."""
    known = problem_table_rows()
    chosen = [one for one in known if one["kind"].lower().startswith(kind.lower())]
    if not chosen:
        raise UnknownName("kind", kind, [*dict.fromkeys(one["kind"] for one in known), "games"])
    return chosen


def _render_table(rows: list[dict[str, str]], headings: list[str], width: int) -> Text:
    """These columns of table F.1 for people."""
    grid = Table(box=None, header_style="bold", pad_edge=False, padding=(0, COLUMN_GAP, 0, 0))
    for heading in headings:
        grid.add_column(heading, no_wrap=heading != "kind" and len(headings) > 1, overflow="fold")
    for one in rows:
        grid.add_row(*(_shorten_cell(one[heading]) for heading in headings))
    pieces = Console(width=width, highlight=False).render(grid)
    drawn = Text.assemble(*((piece.text, piece.style or "") for piece in pieces))
    drawn.right_crop(1)  # the end of its last row
    return drawn


def fitting_headings(rows: list[dict[str, str]], width: int) -> list[str]:
    """As many headings, from the left, as there is room for, at least one; a kind may take two
    rows.
    """
    shown: list[str] = []
    left = width + COLUMN_GAP
    for heading in rows[0]:
        cells = [_shorten_cell(one[heading]) for one in rows]
        words = " ".join(cells).split() if heading == "kind" else cells
        left -= max(map(len, [heading, *words])) + COLUMN_GAP
        if left < 0 and shown:
            break
        shown.append(heading)
    return shown


def _shorten_cell(cell: str) -> str:
    return cell.replace("per agent", "each")


class ProblemInfo(NamedTuple):
    """Everything about a problem: what it is, its spaces, parameters, agents, keys and source."""

    problem: str
    kind: str
    about: str
    agents: list[str]
    states: str
    actions: SpaceDescription
    observations: SpaceDescription
    turns: int | None
    parameters: dict[str, dict[str, object]]  # name -> default and meaning
    variants: list[str]
    players: dict[str, str]  # agent -> what it does
    keys: dict[str, str]  # key -> action

    def __str__(self) -> str:
        """The same for people."""
        rows = [f"{self.problem}: {self.kind}", "", *([self.about, ""] if self.about else [])]
        rows += [
            f"seats         {', '.join(self.agents)}",
            f"states        {self.states}",
            f"actions       {_format_space(self.actions)}",
            f"observations  {_format_space(self.observations)}",
            f"turns         {self.turns or 'until it ends'}",
            f"variants      {', '.join(self.variants)}",
            "",
            "parameters (--set NAME=VALUE)",
        ]
        widest = max(map(len, self.parameters))
        for name, one in self.parameters.items():
            shown = str(one["default"])
            shown = shown if len(shown) <= 24 else f"{shown[:21]}..."
            rows.append(f"  {name:<{widest}} {shown:<24} {one['meaning']}")
        players = {"human": "You.", **self.players, **SCRIPTED_AGENTS}
        rows += ["", "agents (--agent, --vs, --seat NAME=AGENT)"]
        rows += [f"  {name:<22} {does}" for name, does in players.items()]
        keys: dict[str, list[str]] = {}
        for key, label in self.keys.items():
            keys.setdefault(label, []).append(key)
        rows += ["", "keys"]
        rows += [f"  {label:<14} {', '.join(names)}" for label, names in keys.items()]
        return "\n".join(rows)


def load_problem_info(name: str, keys: KeyPreferences = DEFAULT_KEY_PREFERENCES) -> ProblemInfo:
    """Everything about a problem, with the keys in force."""
    problem = problems.load_problem(name)
    return ProblemInfo(
        problem=name,
        kind=problem.kind,
        about=problems.full_description(problem),
        agents=list(problem.agents),
        states=problem_summary(problem)["states"],
        actions=_describe_actions(problem.actions[0]),
        observations=_describe_observations(problem),
        turns=problem.horizon,
        parameters={
            name: {"default": getattr(problem, name), "meaning": meaning}
            for name, meaning in problems.parameter_meanings(problem).items()
        },
        variants=[variant or "standard" for variant in problems.load_variants(name) or [""]],
        players={name: _first_doc_line(make) for name, make in _willing_agents(problem).items()},
        keys=dict(resolve_key_maps(problem, keys).first_player_keys),
    )


def _willing_agents(problem: Problem) -> dict[str, type[SeatPolicy]]:
    """The agents of the first seat that do not refuse the problem."""
    return {
        name: make
        for name, make in agents.load_roster(problem).agents.items()
        if not agents.refuses_problem(problem, make)
    }


def _describe_observations(problem: Problem) -> SpaceDescription:
    """What the first agent observes."""
    if not problem.partially_observable:
        return "the state"
    known = problem.observations[0]
    if isinstance(known, Labels):
        return list(known)
    return "a line of text" if isinstance(known, TextLine) else format_count(known.size, "number")


def _first_doc_line(agent_class: object) -> str:
    """What an agent does."""
    return (agent_class.__doc__ or "").partition("\n")[0]


def _describe_actions(actions: Labels | Interval) -> SpaceDescription:
    if isinstance(actions, Interval):
        return {"from": actions.low, "to": actions.high}
    return list(actions)


def _format_space(space: SpaceDescription) -> str:
    """Names with commas between, of many the first and the last; the span of reals."""
    if isinstance(space, str):
        return space
    if isinstance(space, dict):
        return f"a number from {space['from']:g} to {space['to']:g}"
    return ", ".join(space if len(space) <= MAX_LISTED_NAMES else [*space[:3], "...", space[-1]])


class AgentInfo(NamedTuple):
    """An agent that fits a problem: what it does, its parameters and what they mean."""

    agent: str
    does: str
    parameters: dict[str, object]
    meanings: dict[str, str]
    advises: bool
    partner: bool

    def __str__(self) -> str:
        """The same for people."""
        pairs = ",".join(f"{key}={value}" for key, value in self.parameters.items())
        marks = [word for word in ("advises", "partner") if getattr(self, word)]
        note = f" ({', '.join(marks)})" if marks else ""
        rows = [f"{self.agent}{pairs and ':'}{pairs}{note}", f"    {self.does}"]
        rows += [f"    {key}: {meaning}." for key, meaning in self.meanings.items() if meaning]
        return "\n".join(rows)


def load_agent_infos(name: str) -> list[AgentInfo]:
    """The agents that fit a problem."""
    problem = problems.load_problem(name)
    rosters = [agents.load_roster(problem, seat) for seat in range(len(problem.agents))]
    advises = {roster.hint_provider for roster in rosters}
    partners = {roster.default_partner for roster in rosters[1:]}
    return [
        AgentInfo(
            agent, _first_doc_line(make), agents.default_parameters(make), agents.parameter_meanings(make),
            agent in advises, agent in partners,
        )
        for agent, make in _willing_agents(problem).items()
    ]  # fmt: skip


def report_agents(name: str, *, json: bool) -> Printout:
    """The agents that fit a problem, as text or data."""
    known = load_agent_infos(name)
    told = dumps([one._asdict() for one in known]) if json else "\n".join(map(str, known))
    return Printout(told, paged=not json)


def report_problem_table(kind: str, terminal_options: TerminalOptions) -> Text | str:
    """Table F.1, or its problems of one kind, and what there was no room for."""
    rows = rows_of_kind(kind)
    if terminal_options.json:
        return dumps(rows)
    width = terminal_options.width or shutil.get_terminal_size((PIPE_COLUMNS, 0)).columns
    headings = fitting_headings(rows, width)
    shown = _render_table(rows, headings, width)
    left_out = [*rows[0]][len(headings) :]
    if left_out:
        told = f"no room for {', '.join(left_out)}; --width or --json has all"
        shown.append(f"\n{fill(told, width)}")
    return shown


def report_problem(name: str, keys: KeyPreferences, *, json: bool) -> Printout:
    """All about a problem, as text or data."""
    known = load_problem_info(name, keys)
    return Printout(dumps(known._asdict()) if json else str(known), paged=not json)
