"""The checks of `dmplay check`: every invariant of a problem, its agents and its view."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial
from typing import Any

import numpy as np
from rich.text import Text

from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array
from dmplay.core.playability_checks import CHECK_STAGES
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.core.user_code_locations import (
    describe_error_location,
    locate_function,
    replace_modules_by_files,
)
from dmplay.core.violation import CheckResult, Findings, Violation
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadPolicy, BudgetExceeded, DmplayError
from dmplay.game.key_bindings import resolve_key_maps
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.registry.agents import AgentLike, load_agent
from dmplay.registry.problem_module_exports import PART_BY_NAME, find_export, load_specific_roster
from dmplay.registry.problems import ProblemLike, make_problem
from dmplay.simulation import random_play
from dmplay.simulation.random_play import (
    SEED,
    SampledTurns,
    make_arrays_readonly,
    sample_random_turns,
    slice_rows,
)
from dmplay.solvers.pomdp.legal_action_leak import check_legal_action_leak
from dmplay.validation import invariants
from dmplay.validation.agent_trial import AgentTrial, try_agent
from dmplay.validation.module_export_trials import iter_trials
from dmplay.validation.policy_checks import find_agent_violation
from dmplay.views.protocol import FinishedGame, Lesson, ViewModule, fit_board, load_view_module

SAMPLED_TURNS = 200  # sampled turns that each invariant is checked on
# games of random play, and turns of each, that look for terminal states
RANDOM_GAMES, RANDOM_GAME_TURNS = 30, 60
ROUND_TRIP_STATES = 40  # states of random play that are formatted and parsed again
# rows that are also computed in a batch without the others
SEPARATE_BATCHES = (slice(0, 1), slice(7, 8), slice(1, 4), slice(90, 190))
AGENT_GAMES = 7  # games in which the choices of an agent are checked
DRAWN_TURNS = 4  # turns after which a view is drawn
VIEW_WIDTHS = (40, 80, 120)
Stage = list[Callable[[], Findings]]


def check(
    problem: ProblemLike, agent: AgentLike | None = None, *, seat: int | str = 0
) -> list[Violation]:
    """Return the violations of a problem's invariants, each with its source line.

    With an agent, return the first fault of its choices in a seat of the problem instead.

    The stages are checked in order, and the first with violations ends the check, because each
    relies on those before it: the files of the problem's folder, the attributes and arrays of the
    first turn, the dynamics, the agents, and the view and trials of all else that its code defines.
    Raise BadParameter for anything but a problem.
    """
    if agent is not None:
        violation = try_agent(AgentTrial(problem, {}, agent, seat))
        return [violation] if violation else []
    problem = make_problem(problem)
    for stage in _iter_check_stages(problem):
        violations = [
            Violation(violation.where, replace_modules_by_files(violation.what))
            for invariant in stage
            for violation in invariants.find_violations(type(problem), invariant)
        ]
        if violations:
            return [*dict.fromkeys(violations)]
    return []


def _iter_check_stages(problem: Problem) -> Iterator[Stage]:
    """Yield the checks of a problem in stages, each of which relies on those before it."""
    yield [partial(_load_part, problem, name) for name in PART_BY_NAME]
    for stage in (*CHECK_STAGES, (check_legal_action_leak,)):
        yield [partial(check_function, problem) for check_function in stage]
    yield from _iter_dynamics_stages(problem)
    yield [partial(_check_agents, problem, seat) for seat in range(len(problem.agents))]
    yield [partial(_check_view, problem), *iter_trials(problem)]


def _iter_dynamics_stages(problem: Problem) -> Iterator[Stage]:
    """Yield the checks of the dynamics in random play."""

    @cache
    def sampled_turns() -> SampledTurns:
        """Return the sampled turns of random play."""
        return sample_random_turns(problem, SAMPLED_TURNS)

    @cache
    def sampled_outcomes() -> tuple[Array, ...]:
        """Return the outcomes of the sampled turns, computed in one batch."""
        return invariants.compute_batch_results(problem, sampled_turns())

    @cache
    def final_states() -> Array:
        """Return the states of the sampled turns and the final states of random games."""
        ends = random_play.sample_final_states(problem, RANDOM_GAMES, RANDOM_GAME_TURNS)
        return make_arrays_readonly(np.concatenate([sampled_turns().s, ends]))[0]

    yield [lambda: invariants.check_determinism(problem, sampled_turns(), sampled_outcomes())]
    for rows in SEPARATE_BATCHES:
        yield [
            lambda rows=rows: invariants.check_row_independence(  # type: ignore[misc]
                problem,
                SampledTurns(*slice_rows(sampled_turns(), rows)),
                slice_rows(sampled_outcomes(), rows),
            )
        ]
    yield [lambda: invariants.check_shapes(problem, sampled_turns())]
    yield [
        *(
            partial(lambda invariant: invariant(problem, sampled_turns()), invariant)
            for invariant in invariants.INVARIANTS
        ),
        lambda: invariants.check_state_text(
            problem, final_states()[:: SAMPLED_TURNS // ROUND_TRIP_STATES]
        ),
        lambda: invariants.check_terminal_states(problem, final_states()),
    ]


def _load_part(problem: Problem, name: str) -> Findings:
    """Load the file of a folder that would define a name; its errors are then violations."""
    find_export(problem, name)
    yield from ()


def _check_agents(problem: Problem, seat: int) -> Findings:
    """Yield the violations of the agents of a seat that the problem's code defines."""
    roster = load_specific_roster(problem, seat)
    for name in roster.agents if roster else ():
        try:
            policy = load_agent(problem, seat, name)
        except BadPolicy:  # this agent does not play this seat
            continue
        policies: list[Policy] = [Random(problem, i) for i in range(len(problem.agents))]
        policies[seat] = policy
        with suppress(BudgetExceeded):  # too large to check, which is not a violation
            violation = find_agent_violation(problem, seat, policies, AGENT_GAMES)
            if violation:
                yield violation._replace(what=f"{name}: {violation.what}")


def _check_view(problem: Problem) -> Findings:
    """Check a problem's view and keys while a short game is played."""
    policies = [Random(problem, at) for at in range(len(problem.agents))]
    session = Session(problem, SeededUniforms(SEED), policies, turn_limit=DRAWN_TURNS)
    return _check_game_display(session)


def _check_game_display(session: Session) -> Findings:
    """Check that the boards and texts of a game fit their width and are text, after each turn."""
    resolve_key_maps(session.problem, DEFAULT_KEY_PREFERENCES)
    style = load_view_module(session.problem)
    while True:
        for seat in range(len(session.problem.agents)):
            errors = [*_iter_display_errors(style, session, seat)]
            for function_name, message in errors:
                location = locate_function(getattr(style, function_name))
                if location:
                    yield Violation(location, f"{function_name}: {message}")
                else:  # of the general view, which draws what a method of the problem returns
                    yield CheckResult(False, "draw_state", f"{function_name}: {message}", True)
            if errors:
                return
        if session.over:
            return
        session.advance()


def _iter_display_errors(
    style: ViewModule, session: Session, seat: int
) -> Iterator[tuple[str, str]]:
    """Yield the functions of a view that return no valid board or text for a seat, with messages.

    Boards are drawn at several widths.
    """
    view = session.view(seat)
    state = session.state if session.over else None
    all_options = [DrawOptions(width, 24, revealed_state=state) for width in VIEW_WIDTHS]
    checks: tuple[tuple[str, Callable[[], object], Callable[[Any], bool], str], ...] = (
        (
            "iter_boards",
            lambda: [fit_board(style, view, options) for options in all_options],
            lambda boards: all(isinstance(board, Text) for board in boards),
            "rich.text.Text",
        ),
        ("describe_situation", lambda: style.describe_situation(view), _is_sentence, "a sentence"),
        ("goal_lines", lambda: style.goal_lines(view), _is_text_list, "a list of texts"),
        ("panel_rows", lambda: style.panel_rows(view), _is_pair_list, "a list of pairs of texts"),
        ("lesson", lambda: style.lesson(view), lambda x: isinstance(x, Lesson), "a Lesson"),
        ("describe_turn", lambda: style.describe_turn(view), _is_sentence, "a sentence"),
        (
            "describe_end",
            lambda: style.describe_end(FinishedGame.of_session(session, seat, "you")),
            _is_sentence,
            "a sentence",
        ),
    )
    count = len(checks) if session.over and view.turns_played else -1 if view.turns_played else -2
    for name, call, is_valid, expected in checks[:count]:
        try:
            returned = call()
        except Exception as error:
            if isinstance(error, DmplayError) or describe_error_location(error):
                raise
            yield name, f"raised {type(error).__name__}: {error}; expected {expected}"
            continue
        if not is_valid(returned):
            yield name, f"got {returned!r}, expected {expected}"


def _is_text_list(value: object) -> bool:
    """Return whether a value is a list or tuple of strings."""
    return isinstance(value, list | tuple) and all(isinstance(text, str) for text in value)


def _is_pair_list(value: object) -> bool:
    """Return whether a value is a list or tuple of pairs of strings."""
    if not isinstance(value, list | tuple):
        return False
    return all(_is_text_list(pair) and len(pair) == 2 for pair in value)


def _is_sentence(value: object) -> bool:
    """Return whether a value is a text that is not empty."""
    return isinstance(value, str) and bool(value)
