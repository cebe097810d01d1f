"""The trial of an agent by `dmplay check --agent`: in this process, and again in others."""

import os
import random
from collections.abc import Iterator, Mapping
from contextlib import ExitStack
from multiprocessing import get_context, parent_process
from multiprocessing.connection import Connection
from threading import Thread
from typing import NamedTuple

import numpy as np

from dmplay.agents.random_agent import Random
from dmplay.core.policy import Policy, forbid_exit
from dmplay.core.problem import find_seat
from dmplay.core.user_code_locations import check_main_guard
from dmplay.core.violation import Violation
from dmplay.errors import BadParameter, BadPolicy
from dmplay.game.seats import make_seat_policy
from dmplay.registry.agents import AgentLike, load_agent
from dmplay.registry.problems import ProblemLike, load_problem
from dmplay.validation.policy_checks import (
    CheckedPolicy,
    Choices,
    agent_error_to_violation,
    play_checked_games,
)

EPISODES, TURNS = 12, 30  # number of games, and their turn limit
# Two hash seeds order a set of two elements alike with probability 1/2. With eight processes beside
# this one, the check therefore misses one such agent in 256.
PROCESSES = 8
HASH_SEED_VARIABLE = "PYTHONHASHSEED"
REMEDY = (
    "in another process; expected the same choice: take random numbers from u alone, "
    "and use no hash and no order of a set"
)


class AgentTrial(NamedTuple):
    """A problem, an agent and its seat; other processes load them if they are names."""

    problem: ProblemLike
    parameters: Mapping[str, object]
    agent: AgentLike
    seat: int | str  # "" for the first seat


def try_agent(trial: AgentTrial) -> Violation | None:
    """Return the first violation of an agent, if there is one.

    Its choices in a batch of games are checked, compared with those in other processes if problem
    and agent are names, and then with those in each game alone. Raise UnknownName or BadParameter
    for unknown names.
    """
    checked = _play_batch(trial)
    if isinstance(checked, Violation):
        return checked
    are_names = isinstance(trial.problem, str) and isinstance(trial.agent, str)
    if are_names:
        check_main_guard()
    try:
        for choices in _iter_choices_of_processes(trial) if are_names else ():
            if isinstance(choices, Violation):
                return choices._replace(what=f"{choices.what}, in another process only")
            checked.compare_choices(choices, REMEDY)
        forbid_exit(checked.check_games_alone)
    except Exception as error:
        return agent_error_to_violation(error, checked)
    return None


def _play_batch(trial: AgentTrial) -> CheckedPolicy | Violation:
    """Return the agent after a batch of games with random agents, or its first violation."""
    problem, agent = load_problem(trial.problem, **trial.parameters), trial.agent
    seat = find_seat(problem, problem.agents[0] if trial.seat == "" else trial.seat)
    checked = None
    try:
        if isinstance(agent, str):  # which may be a script
            policy = make_seat_policy(problem, seat, agent, TURNS)
        else:
            policy = load_agent(problem, seat, agent, turns=TURNS)
        if policy is None:
            raise BadParameter("agent: a person cannot be checked; name an agent")
        checked = CheckedPolicy(problem, seat, policy)
        others: list[Policy] = [Random(problem, index) for index in range(len(problem.agents))]
        play_checked_games(checked, others, EPISODES, TURNS)
    except Exception as error:
        return agent_error_to_violation(error, checked)
    return checked


def _iter_choices_of_processes(trial: AgentTrial) -> Iterator[list[Choices] | Violation]:
    """Yield the choices, or the violation, from each process; raise BadPolicy if one dies.

    All processes start at once, each with its own hash seed and random states.
    """
    hash_seed, context = os.environ.get(HASH_SEED_VARIABLE), get_context("spawn")
    with ExitStack() as stack:
        receivers = list[Connection]()
        try:
            for number in range(1, PROCESSES + 1):
                os.environ[HASH_SEED_VARIABLE] = str(number)  # read by a process when it starts
                receiver, sender = context.Pipe(duplex=False)
                process = context.Process(target=_send_choices, args=(trial, number, sender))
                process.start()
                stack.callback(process.kill)  # it may hang when dmplay ends
                sender.close()
                receivers.append(receiver)
        finally:
            del os.environ[HASH_SEED_VARIABLE]
            os.environ |= {} if hash_seed is None else {HASH_SEED_VARIABLE: hash_seed}
        for receiver in receivers:
            try:
                yield receiver.recv()
            except EOFError:
                raise BadPolicy("the process in which the agent played has died") from None


def _send_choices(trial: AgentTrial, random_state: int, sender: Connection) -> None:
    """Send the choices of an agent, or its violation; drop the output of this process."""
    Thread(target=_wait_for_parent_then_exit, daemon=True).start()
    null_device = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null_device, 1)
    os.dup2(null_device, 2)
    random.seed(random_state)
    np.random.seed(random_state)  # noqa: NPY002 - the state that an agent must not use
    checked = _play_batch(trial)
    sender.send(checked if isinstance(checked, Violation) else checked.choices)


def _wait_for_parent_then_exit() -> None:
    """Wait until the parent process ends, then exit this one, in which the agent may hang."""
    if parent := parent_process():
        parent.join()
        os._exit(1)
