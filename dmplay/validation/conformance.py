"""The checks of `dmplay check`: every invariant of a problem, its agents and its view."""

from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import cache, partial

import numpy as np
from rich.text import Text

from dmplay.agents.random_agent import Random
from dmplay.core.arrays import Array
from dmplay.core.playability_checks import CHECK_STAGES
from dmplay.core.policy import Policy
from dmplay.core.problem import Problem, check_problem, find_seat
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.core.violation import CheckResult, CheckResults, Findings, Violation
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded, DmplayError
from dmplay.evaluation.solutions.solve import find_own_function
from dmplay.game.key_bindings import resolve_key_maps
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES
from dmplay.game.plot_kinds import load_figures
from dmplay.registry import agents
from dmplay.registry.problem_module_exports import (
    PART_BY_NAME,
    find_export,
    load_exported_list,
    load_specific_roster,
    locate_export,
)
from dmplay.simulation import random_play
from dmplay.simulation.random_play import (
    SEED,
    SampledTurns,
    make_arrays_readonly,
    sample_turns,
    slice_rows,
)
from dmplay.solvers.pomdp.legal_action_leak import check_legal_action_leak
from dmplay.tutor.puzzle_mining import GameSetup, list_setups
from dmplay.tutor.quantity import load_problem_quantities
from dmplay.tutor.rules_of_thumb import list_rules
from dmplay.validation import invariants
from dmplay.validation.policy_checks import find_agent_violation
from dmplay.views.protocol import DrawOptions, ViewModule, fit_board, load_view_module

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


def _load_puzzle_players(problem: Problem) -> None:
    """Load the players of PUZZLE_GAMES; raise BadParameter for an unknown seat or player."""
    for setup in load_exported_list(problem, "PUZZLE_GAMES", GameSetup) or ():
        for seat_name, player in setup.seats.items():
            try:
                agents.load_agent(problem, find_seat(problem, seat_name), player)
            except DmplayError as error:
                location = locate_export(problem, "PUZZLE_GAMES")
                raise BadParameter(f"{location}: {error}") from None


EXPORT_LOADERS: tuple[Callable[[Problem], object], ...] = (
    find_own_function,
    list_rules,
    list_setups,
    _load_puzzle_players,
    load_problem_quantities,
    load_figures,
)


def check(problem: Problem) -> list[Violation]:
    """Return the violations of a problem's invariants, each with its source line.

    The stages are checked in order, and the first with violations ends the check, because each
    relies on those before it: the files of the problem's folder, the attributes and arrays of the
    first turn, the dynamics, the agents, and all else that its code defines. Raise BadParameter for
    anything but a problem.
    """
    check_problem(problem, None)
    for stage in _iter_stages(problem):
        violations = [
            violation
            for invariant in stage
            for violation in invariants.find_violations(type(problem), invariant)
        ]
        if violations:
            return [*dict.fromkeys(violations)]
    return []


def _iter_stages(problem: Problem) -> Iterator[Stage]:
    """Yield the checks of a problem in stages, each of which relies on those before it."""
    yield [partial(_try_loading, partial(find_export, problem, name)) for name in PART_BY_NAME]
    for stage in (*CHECK_STAGES, (check_legal_action_leak,)):
        yield [partial(check_function, problem) for check_function in stage]
    yield from _iter_dynamics_stages(problem)
    yield [partial(_check_agents, problem, seat) for seat in range(len(problem.agents))]
    yield [partial(_check_view, problem)]
    yield [partial(_try_loading, partial(load, problem)) for load in EXPORT_LOADERS]


def _iter_dynamics_stages(problem: Problem) -> Iterator[Stage]:
    """Yield the checks of the dynamics in random play."""

    @cache
    def sampled_turns() -> SampledTurns:
        """Return the sampled turns of random play."""
        return sample_turns(problem, SAMPLED_TURNS)

    @cache
    def sampled_outcomes() -> tuple[Array, ...]:
        """Return the outcomes of the sampled turns, computed in one batch."""
        return invariants.evaluate_batch(problem, sampled_turns())

    @cache
    def final_states() -> Array:
        """Return the states of the sampled turns and the final states of random games."""
        ends = random_play.final_states(problem, RANDOM_GAMES, RANDOM_GAME_TURNS)
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


def _try_loading(load: Callable[[], object]) -> Findings:
    """Load a file or an object of the problem's code, whose errors are then violations."""
    load()
    yield from ()


def _check_agents(problem: Problem, seat: int) -> Findings:
    """Yield the violations of the agents of a seat that the problem's code defines."""
    roster = load_specific_roster(problem, seat)
    for name in roster.agents if roster else ():
        try:
            policy = agents.load_agent(problem, seat, name)
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


def _check_game_display(session: Session) -> CheckResults:
    """Check that the boards and texts of a game fit their width and are text, after each turn."""
    resolve_key_maps(session.problem, DEFAULT_KEY_PREFERENCES)
    style = load_view_module(session.problem)
    while True:
        for seat in range(len(session.problem.agents)):
            yield from _check_seat_display(style, session, seat)
        if session.over:
            return
        session.advance()


def _check_seat_display(style: ViewModule, session: Session, seat: int) -> CheckResults:
    """Check the boards of one seat at several widths, and the texts shown next to them."""
    view = session.view(seat)
    state = session.state if session.over else None
    for width in VIEW_WIDTHS:
        board = fit_board(style, view, DrawOptions(width, 24, revealed_state=state))
        message = f"iter_boards: got {type(board).__name__}, expected rich.text.Text"
        yield CheckResult(isinstance(board, Text), "draw_state", message)
    describe_turn = [style.describe_turn] if view.turns_played else []
    for method in (*describe_turn, style.describe_situation):
        text = method(view)
        message = f"{method.__name__}: got {text!r}, expected a sentence"
        yield CheckResult(isinstance(text, str) and bool(text), "draw_state", message)
    message = "goal_lines: expected a list of texts; panel_rows: expected a list of pairs of texts"
    is_valid = _is_text_list(style.goal_lines(view)) and _is_pair_list(style.panel_rows(view))
    yield CheckResult(is_valid, "draw_state", message)


def _is_text_list(value: object) -> bool:
    """Return whether a value is a list or tuple of strings."""
    return isinstance(value, list | tuple) and all(isinstance(text, str) for text in value)


def _is_pair_list(value: object) -> bool:
    """Return whether a value is a list or tuple of pairs of strings."""
    if not isinstance(value, list | tuple):
        return False
    return all(_is_text_list(pair) and len(pair) == 2 for pair in value)
