"""What is played many times, and what came of it: who sits where, how many turns, which dice."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from math import ceil, log
from typing import NamedTuple

from dmplay.blocks import WorkerCount
from dmplay.core import Policy, Problem
from dmplay.errors import BadParameter
from dmplay.finding import agents, problems
from dmplay.game.errand import Printout
from dmplay.game.request import GameRequest, parse_settings
from dmplay.game.seats import HUMAN, make_seat_policy
from dmplay.game.start import assign_players, check_turn_limit
from dmplay.measure.estimate import Estimate
from dmplay.measure.running import RunResult
from dmplay.session import DEFAULT_TURN_LIMIT
from dmplay.signals import INTERRUPTED_EXIT_CODE
from dmplay.solutions.solution import Row

NEGLIGIBLE_WEIGHT = 1e-9  # share that a turn counts for, and is not played
INTERRUPTED_REASON = "interrupted"  # as rollouts says it


class EvaluationRequest(NamedTuple):
    """What is played many times: a problem, who sits where, which dice; and how it is told."""

    problem: str
    settings: Sequence[str] = ()
    agent: str = ""
    other_agent: str = ""
    seats: Sequence[str] = ()
    turn_limit: int | None = None
    seed: int = 0
    workers: WorkerCount = 1
    engine: str = ""
    output_format: str = ""  # json or csv; '' for people
    motion: bool = True

    @property
    def parameters(self) -> dict[str, object]:
        """Those that are set."""
        return parse_settings(self.settings, "--set")

    @property
    def parameter_values(self) -> dict[str, object]:
        """The same as the problem has them."""
        known = problems.parameter_values(self.load_problem().problem)
        return {name: known[name] for name in self.parameters}

    @property
    def title(self) -> str:
        """What is played, for people."""
        return " ".join([self.problem, *self.settings])

    def load_problem(self) -> problems.LoadedProblem:
        """The problem with these parameters; raises BadParameter for games of no turns."""
        check_turn_limit(self.turn_limit)
        return problems.resolve_problem(self.problem, self.parameters)


class Lineup(NamedTuple):
    """A problem, the names of those who play it, and themselves."""

    problem: Problem
    agent_names: list[str]
    policies: list[Policy]


class SettingResult(NamedTuple):
    """What came of one setting of the parameters."""

    request: EvaluationRequest
    lineup: Lineup
    run: RunResult
    swept_parameters: Mapping[str, object]  # the parameters, where there are other settings

    def __str__(self) -> str:
        return " ".join(f"{key}={value}" for key, value in self.swept_parameters.items())


def make_lineup(request: EvaluationRequest) -> Lineup:
    """Who plays; where nobody was named, the agent that knows best, or one that is soon done."""
    found = request.load_problem()
    problem = found.problem
    agent = request.agent or agents.default_agent(problem, 0, request.turn_limit)
    asked = GameRequest(
        "",
        agent=agent,
        other_agent=request.other_agent,
        seats=request.seats,
        turns=request.turn_limit,
    )
    names = assign_players(asked, found)
    if HUMAN in names:
        where = problem.agents[names.index(HUMAN)]
        raise BadParameter(f"{where}: a person cannot play so many games; name an agent")
    return Lineup(
        problem, names, [make_policy(problem, n, who, request) for n, who in enumerate(names)]
    )


def make_policy(problem: Problem, seat: int, name: str, request: EvaluationRequest) -> Policy:
    """The agent of this name, or the program; raises BadParameter for a person."""
    found = make_seat_policy(problem, seat, name, request.turn_limit)
    if found is None:
        raise BadParameter(f"{name}: a person cannot play so many games; name an agent")
    return found


def limit_turns(request: EvaluationRequest) -> EvaluationRequest:
    """The same, no longer than turns count where somebody's hidden problem has no end."""
    problem = request.load_problem().problem
    ends = (
        request.turn_limit
        or problem.horizon
        or problem.discount == 1.0
        or problems.builtin_stem(problem)
    )
    if ends or not problem.partially_observable:
        return request
    turns = log(NEGLIGIBLE_WEIGHT) / log(problem.discount) if problem.discount else 1
    return request._replace(turn_limit=min(ceil(turns), DEFAULT_TURN_LIMIT))


def expand_sweep(request: EvaluationRequest) -> Iterator[EvaluationRequest]:
    """The match in each setting: a list `0.1,0.2` of a parameter that takes a number is several."""
    usual = problems.parameter_values(problems.resolve_problem(request.problem, {}).problem)
    each = [
        [f"{key}={one}" for one in _split_values(str(value), usual.get(key))]
        for key, value in request.parameters.items()
    ]
    return (request._replace(settings=settings) for settings in product(*each))


def _split_values(value: str, default: object) -> list[str]:
    return value.split(",") if isinstance(default, int | float) else [value]


def estimate_row(estimate: Estimate) -> Row:
    """A mean as programs are told it."""
    return {
        "mean return": estimate.mean,
        "standard error": estimate.standard_error,
        "low": estimate.low,
        "high": estimate.high,
    }


def make_report(text: str, shortfall_reason: str) -> Printout:
    """A report, with what cut it short where something did."""
    if not shortfall_reason:
        return Printout(text)
    code = INTERRUPTED_EXIT_CODE if shortfall_reason == INTERRUPTED_REASON else 1
    return Printout(
        text, stderr_text=f"{shortfall_reason}: this is what was played by then", exit_code=code
    )
