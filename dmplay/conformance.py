"""`dmplay check`: every law that a problem, its agents and its look are to keep."""

from collections.abc import Callable, Iterator
from functools import cache, partial

import numpy as np
from rich.text import Text

from dmplay.chance import Array
from dmplay.core import Policy, Problem
from dmplay.dice import SeededUniforms
from dmplay.errors import BadPolicy
from dmplay.finding import agents, modules, problems
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES, resolve_key_maps
from dmplay.laws import play, samples
from dmplay.laws.breach import CheckResult, CheckResults, Violation
from dmplay.laws.choices import check_policy_choices
from dmplay.laws.samples import (
    SEED,
    SampledTurns,
    make_arrays_readonly,
    sample_turns,
    slice_rows,
)
from dmplay.laws.secret import check_legal_action_leak
from dmplay.laws.sound import CHECK_STAGES
from dmplay.policies.general import Random
from dmplay.session import Session
from dmplay.views.style import DrawOptions, ViewModule, fit_board, load_view_module

SAMPLED_TURNS = 200  # turns that each law is asked of
RANDOM_GAMES, RANDOM_GAME_TURNS = 30, 60  # of random play, to meet its ends
ROUND_TRIP_STATES = 40  # states of random play that are written and read
SEPARATE_BATCHES = (
    slice(0, 1),
    slice(7, 8),
    slice(1, 4),
    slice(90, 190),
)  # rows apart from the others
AGENT_GAMES = 7  # games in which an agent is asked
DRAWN_TURNS = 4  # turns after which a look is drawn
VIEW_WIDTHS = (40, 80, 120)


def check(problem: Problem) -> list[Violation]:
    """What of a problem breaks a law, each with the line that does; nothing where all hold.

    First its facts, arrays and first turn, then what comes of them, then agents and look that its
    module brings: each rests on those before.
    """
    for kind in (_check_attributes, _check_dynamics, _check_agents, _check_problem_view):
        found = [*dict.fromkeys(kind(problem))]
        if found:
            return found
    return []


def _check_attributes(problem: Problem) -> Iterator[Violation]:
    """What it says of itself."""
    for stage in (*CHECK_STAGES, (check_legal_action_leak,)):
        found = [
            one
            for facts in stage
            for one in play.find_violations(type(problem), partial(facts, problem))
        ]
        yield from found
        if found:
            return


def _check_dynamics(problem: Problem) -> Iterator[Violation]:
    """The laws of what happens, over turns of random play; each group rests on those before."""

    @cache
    def sampled_turns() -> SampledTurns:
        return sample_turns(problem, SAMPLED_TURNS)

    @cache
    def sampled_outcomes() -> tuple[Array, ...]:
        return play.evaluate_batch(problem, sampled_turns())

    @cache
    def final_states() -> Array:
        return make_arrays_readonly(
            np.concatenate(
                [sampled_turns().s, samples.final_states(problem, RANDOM_GAMES, RANDOM_GAME_TURNS)]
            )
        )[0]

    def check_batch_independence(rows: slice) -> CheckResults:
        return play.check_row_independence(
            problem,
            SampledTurns(*slice_rows(sampled_turns(), rows)),
            slice_rows(sampled_outcomes(), rows),
        )

    singly: list[list[Callable[[], CheckResults]]] = [
        [partial(check_batch_independence, rows)] for rows in SEPARATE_BATCHES
    ]
    groups: list[list[Callable[[], CheckResults]]] = [
        [lambda: play.check_determinism(problem, sampled_turns(), sampled_outcomes())],
        *singly,
        [lambda: play.check_shapes(problem, sampled_turns())],
        [
            *(partial(lambda law: law(problem, sampled_turns()), law) for law in play.INVARIANTS),
            lambda: play.check_state_text(
                problem, final_states()[:: SAMPLED_TURNS // ROUND_TRIP_STATES]
            ),
            lambda: play.check_terminal_states(problem, final_states()),
        ],
    ]
    for group in groups:
        broken = [one for law in group for one in play.find_violations(type(problem), law)]
        yield from broken
        if broken:
            return


def _check_agents(problem: Problem) -> Iterator[Violation]:
    """The agents that its module brings, in the seats that they fit."""
    for seat in range(len(problem.agents)):
        for name in modules.module_agent_names(problem):
            try:
                policy = agents.load_agent(problem, seat, name)
            except BadPolicy:  # not for this seat
                continue
            policies: list[Policy] = [Random(problem, at) for at in range(len(problem.agents))]
            policies[seat] = policy
            law = partial(check_policy_choices, problem, seat, policies, AGENT_GAMES)
            for breach in play.find_violations(type(policy), law):
                yield breach._replace(what=f"{name}: {breach.what}")


def _check_problem_view(problem: Problem) -> Iterator[Violation]:
    """The look of a problem that is not built in: each part in turn, while a game is played."""
    if not problems.builtin_stem(problem):
        policies = [Random(problem, at) for at in range(len(problem.agents))]
        session = Session(problem, SeededUniforms(SEED), policies, turn_limit=DRAWN_TURNS)
        yield from play.find_violations(type(problem), partial(_check_game_display, session))


def _check_game_display(session: Session) -> CheckResults:
    """What is drawn and told of a game fits and is text."""
    resolve_key_maps(session.problem, DEFAULT_KEY_PREFERENCES)
    style = load_view_module(session.problem)
    while True:
        for seat in range(len(session.problem.agents)):
            yield from _check_seat_display(style, session, seat)
        if session.over:
            return
        session.advance()


def _check_seat_display(style: ViewModule, session: Session, seat: int) -> CheckResults:
    """A board, and the words beside it."""
    view = session.view(seat)
    state = session.state if session.over else None
    for width in VIEW_WIDTHS:
        drawn = fit_board(style, view, DrawOptions(width, 24, revealed_state=state))
        told = f"iter_boards: got {type(drawn).__name__}, expected Text of rich"
        yield CheckResult(isinstance(drawn, Text), "draw_state", told)
    for part in (
        (style.describe_turn, style.describe_situation)
        if view.turns_played
        else (style.describe_situation,)
    ):
        words = part(view)
        told = f"{part.__name__}: got {words!r}, expected a sentence"
        yield CheckResult(isinstance(words, str) and bool(words), "draw_state", told)
    told = "goal_lines: expected a list of clauses, panel_rows: a list of pairs, all text"
    yield CheckResult(
        _is_text_list(style.goal_lines(view)) and _is_pair_list(style.panel_rows(view)),
        "draw_state",
        told,
    )


def _is_text_list(value: object) -> bool:
    return isinstance(value, list | tuple) and all(isinstance(word, str) for word in value)


def _is_pair_list(value: object) -> bool:
    if not isinstance(value, list | tuple):
        return False
    return all(_is_text_list(pair) and len(pair) == 2 for pair in value)
