"""Reports on problems and agents: the table of problems, one problem, and its agents."""

from typing import NamedTuple

from dmplay.agents.base import SeatPolicy, summarize_agent
from dmplay.core.problem import Problem
from dmplay.core.problem_summary import problem_summary
from dmplay.core.spaces import Interval, Labels, TextLine
from dmplay.core.text import format_count, format_json_report
from dmplay.game.command_line_results import Printout
from dmplay.game.key_bindings import resolve_key_maps
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES, KeyPreferences
from dmplay.registry import agents, problems

MAX_LISTED_NAMES = 12  # maximum names in a line
SCRIPTED_AGENTS = {
    "script:a,b,c": "Plays the listed actions; script:FILE reads them from a file.",
    "replay:FILE": "Plays the seat's actions from a transcript.",
}
SpaceDescription = str | list[str] | dict[str, float]  # words, names, or the bounds of an interval


class ProblemInfo(NamedTuple):
    """All facts about a problem: kind, description, spaces, parameters, agents and keys."""

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
    players: dict[str, str]  # agent -> its description
    keys: dict[str, str]  # key -> action

    def __str__(self) -> str:
        """Return the facts as text."""
        rows = [f"{self.problem}: {self.kind}", "", *([self.about, ""] if self.about else [])]
        rows += [
            f"seats         {', '.join(self.agents)}",
            f"states        {self.states}",
            f"actions       {_format_space(self.actions)}",
            f"observations  {_format_space(self.observations)}",
            f"turn limit    {self.turns or 'none'}",
            f"variants      {', '.join(self.variants)}",
            "",
            "parameters (--set NAME=VALUE)",
        ]
        widest = max(map(len, self.parameters))
        for name, parameter in self.parameters.items():
            default = str(parameter["default"])
            default = default if len(default) <= 24 else f"{default[:21]}..."
            rows.append(f"  {name:<{widest}} {default:<24} {parameter['meaning']}")
        players = {"human": "A person at the keyboard.", **self.players, **SCRIPTED_AGENTS}
        rows += ["", "agents (--agent, --vs, --seat NAME=AGENT)"]
        rows += [f"  {name:<22} {description}" for name, description in players.items()]
        keys: dict[str, list[str]] = {}
        for key, label in self.keys.items():
            keys.setdefault(label, []).append(key)
        rows += ["", "keys"]
        rows += [f"  {label:<14} {', '.join(names)}" for label, names in keys.items()]
        return "\n".join(rows)


def load_problem_info(name: str, keys: KeyPreferences = DEFAULT_KEY_PREFERENCES) -> ProblemInfo:
    """Return all facts about a problem, with the key bindings in force."""
    problem = problems.load_problem(name)
    return ProblemInfo(
        problem=name,
        kind=problem.kind,
        about=problems.problem_docstring(problem),
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
        players={name: summarize_agent(make) for name, make in _list_agents(problem).items()},
        keys=dict(resolve_key_maps(problem, keys).first_player_keys),
    )


def _list_agents(problem: Problem) -> dict[str, type[SeatPolicy]]:
    """Return the agents by name that do not refuse the first seat of the problem."""
    return {
        name: agent_class
        for name, agent_class in agents.load_roster(problem).agents.items()
        if not agents.refuses_to_play(problem, agent_class)
    }


def _describe_observations(problem: Problem) -> SpaceDescription:
    """Return a description of the first agent's observations: words or a list of labels."""
    if not problem.partially_observable:
        return "the state"
    space = problem.observations[0]
    if isinstance(space, Labels):
        return list(space)
    return "a line of text" if isinstance(space, TextLine) else format_count(space.size, "number")


def _describe_actions(actions: Labels | Interval) -> SpaceDescription:
    """Return a description of an action space: its labels or its bounds."""
    if isinstance(actions, Interval):
        return {"from": actions.low, "to": actions.high}
    return list(actions)


def _format_space(space: SpaceDescription) -> str:
    """Return a space as text; of many names, only the first three and the last."""
    if isinstance(space, str):
        return space
    if isinstance(space, dict):
        return f"a number from {space['from']:g} to {space['to']:g}"
    return ", ".join(space if len(space) <= MAX_LISTED_NAMES else [*space[:3], "...", space[-1]])


class AgentInfo(NamedTuple):
    """An agent that can play a problem: its description, parameters and their meanings."""

    agent: str
    does: str
    parameters: dict[str, object]
    meanings: dict[str, str]
    advises: bool
    partner: bool

    def __str__(self) -> str:
        """Return the agent as text."""
        pairs = ",".join(f"{key}={value}" for key, value in self.parameters.items())
        marks = ["gives hints"] * self.advises + ["partner"] * self.partner
        note = f" ({', '.join(marks)})" if marks else ""
        rows = [f"{self.agent}{pairs and ':'}{pairs}{note}", f"    {self.does}"]
        rows += [f"    {key}: {meaning}." for key, meaning in self.meanings.items() if meaning]
        return "\n".join(rows)


def load_agent_infos(name: str) -> list[AgentInfo]:
    """Return the agents that can play a problem."""
    problem = problems.load_problem(name)
    rosters = [agents.load_roster(problem, seat) for seat in range(len(problem.agents))]
    advises = {roster.hint_provider for roster in rosters}
    partners = {roster.default_partner for roster in rosters[1:]}
    return [
        AgentInfo(
            agent,
            summarize_agent(agent_class),
            agents.default_parameters(agent_class),
            agents.parameter_meanings(agent_class),
            agent in advises,
            agent in partners,
        )
        for agent, agent_class in _list_agents(problem).items()
    ]


def report_agents(name: str, *, json: bool) -> Printout:
    """Return a report of the agents that can play a problem, as text or JSON."""
    agent_infos = load_agent_infos(name)
    text = (
        format_json_report({"agents": [agent_info._asdict() for agent_info in agent_infos]})
        if json
        else "\n".join(map(str, agent_infos))
    )
    return Printout(text, paged=not json)


def report_problem(name: str, keys: KeyPreferences, *, json: bool) -> Printout:
    """Return a report of all facts about a problem, as text or JSON."""
    problem_info = load_problem_info(name, keys)
    return Printout(
        format_json_report(problem_info._asdict()) if json else str(problem_info), paged=not json
    )
