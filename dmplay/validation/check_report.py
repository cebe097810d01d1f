"""The report of `dmplay check`."""

from collections.abc import Mapping

import numpy as np

from dmplay.core.problem import Problem
from dmplay.core.text import format_count, format_json_report
from dmplay.errors import DmplayError
from dmplay.formats.file_problems import FileProblem
from dmplay.game.command_line_results import Printout
from dmplay.registry import problems
from dmplay.validation.agent_trial import EPISODES, AgentTrial, try_agent
from dmplay.validation.conformance import check
from dmplay.validation.invariants import user_error_to_violation

VIOLATION_EXIT_CODE, FAILED_AGENT_EXIT_CODE = 2, 1
EMPTY_ROW_MEANINGS = {
    "T": "no game reaches these states; they lead to themselves",
    "O": "no game reaches these states by these actions; they get the first observation",
}


def report_violations(name: str, parameters: Mapping[str, object], *, json: bool) -> Printout:
    """Check a problem against all invariants; return a report with one line per violation.

    If there are none, the report is one line that says so. The exit code is VIOLATION_EXIT_CODE if
    there is a violation, else 0. An error that the problem's code raises when it is loaded is a
    violation.
    """
    notes = list[str]()
    try:
        name, problem, *_ = problems.find_problem(name, parameters)
    except DmplayError:
        raise
    except Exception as error:
        violations = [user_error_to_violation(error)]
    else:
        violations, notes = check(problem), _note_empty_rows(problem)
    exit_code = VIOLATION_EXIT_CODE if violations else 0
    if json:
        faults = [violation._asdict() for violation in violations]
        data = {"problem": name, "faults": faults, "notes": notes}
        return Printout(format_json_report(data), exit_code=exit_code)
    if not violations:
        return Printout("\n".join([f"ok {name}: all invariants hold", *notes]))
    lines = [violation.format_with_name(name) for violation in violations]
    lines += [f"{name}: {format_count(len(violations), 'violation')}", *notes]
    return Printout("\n".join(lines), exit_code=exit_code)


def report_agent_trial(
    name: str, parameters: Mapping[str, object], agent: str, seat: str, *, json: bool
) -> Printout:
    """Try an agent; return a report of its first violation, or one line that there is none.

    The exit code is FAILED_AGENT_EXIT_CODE if there is a violation, else 0.
    """
    violation = try_agent(AgentTrial(name, parameters, agent, seat))
    exit_code = FAILED_AGENT_EXIT_CODE if violation else 0
    if json:
        faults = [violation._asdict()] if violation else []
        data = {"problem": name, "agent": agent, "faults": faults}
        return Printout(format_json_report(data), exit_code=exit_code)
    if violation:
        return Printout(violation.format_with_name(agent), exit_code=exit_code)
    games = f"{EPISODES} games of {name}"
    conditions = "the same alone, in a batch and in other processes"
    return Printout(f"ok {agent}: legal choices in {games}, {conditions}")


def _note_empty_rows(problem: Problem) -> list[str]:
    """Return a note for each kind of row that a file leaves empty because no game uses it."""
    if not isinstance(problem, FileProblem):
        return []
    start = problem.initial_belief > 0
    ended = problem.state_names[int(np.argmax(start & problem.absorbing_states_mask))]
    can_start_over = bool((start & problem.absorbing_states_mask).any())
    notes = [
        f"note: a game may start in {ended}, where it is over; start: names the first states"
    ] * (can_start_over and not problem.partially_observable)
    return notes + [
        f"note: {format_count(count, f'{kind}: row')} without probabilities, which no game uses: "
        f"{EMPTY_ROW_MEANINGS[kind]}"
        for kind, count in problem.model.empty_row_counts.items()
        if count
    ]
