"""Requests to play a problem many times, and the result of each setting of its parameters."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import product
from typing import NamedTuple, TypeVar

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.return_bounds import count_weighty_turns
from dmplay.core.user_code_locations import describe_error_location
from dmplay.errors import BadParameter
from dmplay.evaluation.many_games import RunResult
from dmplay.evaluation.sweep import expand_agent_ranges, split_values
from dmplay.game.command_line_results import Printout
from dmplay.game.game_setup import assign_players, check_turn_limit
from dmplay.game.launch_requests import parse_settings
from dmplay.game.seats import HUMAN, make_seat_policy
from dmplay.registry import agents, problems
from dmplay.simulation.worker_pool import WorkerCount
from dmplay.terminal.signals import INTERRUPTED_EXIT_CODE

T = TypeVar("T")
INTERRUPTED_REASON = "interrupted"  # the reason that rollouts gives


class EvaluationRequest(NamedTuple):
    """A request to play a problem many times: its agents, turn limit, seed and output format."""

    problem: str
    settings: Sequence[str] = ()
    agent: str = ""
    other_agent: str = ""
    seats: Sequence[str] = ()
    turn_limit: int | None = None
    seed: int = 0
    workers: WorkerCount = 1
    engine: str = ""
    output_format: str = ""  # json or csv; '' for text
    motion: bool = True

    @property
    def parameters(self) -> dict[str, object]:
        """The parameters that are set."""
        return parse_settings(self.settings, "--set")

    @property
    def parameter_values(self) -> dict[str, object]:
        """The parameters that are set, with their values in the problem."""
        all_values = problems.parameter_values(self.load_problem().problem)
        names = [problems.find_parameter_name(text, all_values) for text in self.parameters]
        return {name: all_values[name] for name in names}

    @property
    def agents(self) -> tuple[str, ...]:
        """The names of the agents that are set."""
        return tuple(filter(None, (self.agent, self.other_agent, *self.seats)))

    @property
    def title(self) -> str:
        """The problem and its settings as they are typed."""
        return " ".join([self.problem, *self.settings])

    def load_problem(self) -> problems.LoadedProblem:
        """Return the problem with these parameters; raise BadParameter for a turn limit below 1."""
        check_turn_limit(self.turn_limit)
        return problems.resolve_problem(self.problem, self.parameters)


class Lineup(NamedTuple):
    """A problem, the names of the agents that play it, and their policies."""

    problem: Problem
    agent_names: list[str]
    policies: list[Policy]


class SettingResult(NamedTuple):
    """The result of one setting of the parameters."""

    request: EvaluationRequest
    lineup: Lineup
    run: RunResult
    swept_parameters: Mapping[str, object]  # the parameters, if there are several settings
    swept_agents: Sequence[str] = ()  # the names of the agents, if they have several settings

    def __str__(self) -> str:
        parameters = [f"{key}={value}" for key, value in self.swept_parameters.items()]
        return " ".join([*parameters, *self.swept_agents])


def load_players(request: EvaluationRequest) -> Lineup:
    """Return the problem of a request with the agent and the policy of each seat.

    Seats without a named agent get a default agent. Raise BadParameter if a person has a seat.
    """
    loaded = request.load_problem()
    problem = loaded.problem
    names = assign_players(
        loaded, request.agent, request.other_agent, request.seats, request.turn_limit
    )
    if HUMAN in names:
        seat_name = problem.agents[names.index(HUMAN)]
        raise BadParameter(f"{seat_name}: a person cannot play many games; name an agent")
    return Lineup(
        problem, names, [make_policy(problem, n, name, request) for n, name in enumerate(names)]
    )


def load_entrants(
    problem: Problem, names: Sequence[str], load: Callable[[str], T], contest: str
) -> tuple[list[tuple[str, T]], list[str]]:
    """Return the loaded entrants with their names, and a line for each that is withdrawn.

    User code that cannot be loaded is withdrawn, unless fewer than two entrants remain.
    """
    entrants, withdrawals = list[tuple[str, T]](), list[str]()
    first_error: Exception | None = None
    for name in names:
        try:
            entrants.append((name, load(name)))
        except Exception as error:
            if not agents.names_user_code(problem, 0, name):
                raise
            first_error = first_error or error
            reason = describe_error_location(error) or error
            withdrawals.append(f"{name} is withdrawn from the {contest}: {reason}")
    if first_error and len(entrants) < 2:
        raise first_error
    return entrants, withdrawals


def make_policy(problem: Problem, seat: int, name: str, request: EvaluationRequest) -> Policy:
    """Return the policy of an agent or program; raise BadParameter for a person."""
    agent_policy = make_seat_policy(problem, seat, name, request.turn_limit)
    if agent_policy is None:
        raise BadParameter(f"{name}: a person cannot play many games; name an agent")
    return agent_policy


def limit_turns(request: EvaluationRequest) -> EvaluationRequest:
    """Return the request, with a turn limit if a hidden problem would never end.

    The limit is the turn whose discount falls below MIN_PLAYED_WEIGHT, at most DEFAULT_TURN_LIMIT.
    A problem with a horizon, or without discounting, gets no limit here.
    """
    problem = request.load_problem().problem
    is_bounded = request.turn_limit or problem.horizon or problem.discount == 1.0
    if is_bounded or not problem.partially_observable:
        return request
    return request._replace(turn_limit=count_weighty_turns(problem))


def iter_settings(request: EvaluationRequest) -> Iterator[EvaluationRequest]:
    """Yield the request in each setting of the parameters of its problem and its agents.

    A list such as `0.1,0.2` or a range such as `0:0.5:0.1` for a numeric parameter of the problem
    makes several settings, and so does a range in the name of an agent. With several of them, all
    combinations are made.
    """
    defaults = problems.parameter_values(problems.resolve_problem(request.problem, {}).problem)
    settings_by_name = {
        problems.find_parameter_name(text, defaults): str(values)
        for text, values in request.parameters.items()
    }
    choices = [
        [f"{name}={value}" for value in split_values(values, defaults[name])]
        for name, values in settings_by_name.items()
    ]
    for settings in product(*choices):
        for agent, other_agent, *seats in product(
            *map(expand_agent_ranges, [request.agent, request.other_agent, *request.seats])
        ):
            yield request._replace(
                settings=settings, agent=agent, other_agent=other_agent, seats=seats
            )


def make_evaluation_report(
    text: str, shortfall_reason: str, forfeits: Sequence[str] = ()
) -> Printout:
    """Return a report, with an exit code and a line for each reason why games are missing.

    The reasons are the lines `forfeits`, and `shortfall_reason` if the run was interrupted.
    """
    lines = [*forfeits]
    if shortfall_reason:
        lines.append(f"{shortfall_reason}: the report covers only the games played before")
    code = INTERRUPTED_EXIT_CODE if shortfall_reason == INTERRUPTED_REASON else 1
    return Printout(text, stderr_text="\n".join(lines), exit_code=code if lines else 0)
