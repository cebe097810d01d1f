"""The first rows of the screen: the game and how it stands, what to aim for and what it costs."""

from collections.abc import Iterator, Sequence
from functools import lru_cache

from dmplay.describe import describe_end_reason, format_score, score_label
from dmplay.game.game import Game
from dmplay.screen.shown import Viewport
from dmplay.screen.wrapping import wrap_lines
from dmplay.session import DEFAULT_TURN_LIMIT
from dmplay.styles import ScreenLine
from dmplay.terminal import escape_unprintable
from dmplay.views.kept import SeatSnapshot

CLAUSE_SEPARATOR = "; "  # clauses
UNSHOWN_TURN_LIMITS = (None, DEFAULT_TURN_LIMIT)  # limits that are not told


def title_row(game: Game, snapshot: SeatSnapshot, viewport: Viewport) -> ScreenLine:
    """The game and how it stands; closer together and without the seed where there is no room."""
    end = snapshot.end_reason and (
        "over" if snapshot.end_reason == "terminal" else describe_end_reason(snapshot.end_reason)
    )
    first, told, last = "", "", ""
    for first, gap, facts in _iter_title_forms(game, snapshot):
        told, last = gap[1:] + gap.join(facts), gap + end if end else ""
        if len(first) + len(told) + len(last) <= viewport.width:
            break
    row = (first, "bold"), (told, "")
    return (*row, (last, "bold")) if last else row


def _iter_title_forms(
    game: Game, snapshot: SeatSnapshot
) -> Iterator[tuple[str, str, Sequence[str]]]:
    """What is played, the blanks between the facts, and these; each form needs less room."""
    seed = [f"seed {game.seed}"] if game.is_seed_visible else []
    facts = _title_facts(game, snapshot, score_label(game.problem))
    yield _format_name(game), "   ", [*seed, *facts]
    close = f" {escape_unprintable(game.problem_name)} "
    yield close, "  ", facts
    facts = _title_facts(game, snapshot, "score")
    for many in range(len(facts), -1, -1):  # a fact is told whole or not at all
        yield close, "  ", facts[:many]


def _title_facts(game: Game, snapshot: SeatSnapshot, score_name: str) -> list[str]:
    """Turn, score, who you are, and who the others are."""
    limit = game.session.turn_limit
    facts = [
        f"turn {snapshot.turn}" if limit in UNSHOWN_TURN_LIMITS else f"turn {snapshot.turn}/{limit}"
    ]
    if snapshot.rewards_visible:
        facts.append(f"{score_name} {format_score(game.narrator.seat_return(snapshot))}")
    you = game.viewing_seat if game.human_seats else None
    facts += _format_players(tuple(game.problem.agents), game.player_names, you)
    return facts


@lru_cache(16)  # who changes seldom
def _format_players(
    agents: Sequence[str], player_names: Sequence[str], own_seat: int | None
) -> tuple[str, ...]:
    own = () if own_seat is None else (f"you: {agents[own_seat]}",)
    others = enumerate(zip(agents, player_names, strict=True))
    return (
        *own,
        *(
            f"{agent}: {escape_unprintable(who)}"
            for seat, (agent, who) in others
            if seat != own_seat
        ),
    )


def name_row(game: Game) -> ScreenLine:
    """What is played."""
    return ((_format_name(game), "bold"),)


def _format_name(game: Game) -> str:
    return f" dmplay {escape_unprintable(game.problem_name)}  "


def goal_row(game: Game, snapshot: SeatSnapshot, viewport: Viewport) -> ScreenLine:
    """What to aim for and what it costs, as many clauses as one row holds; one at least."""
    return game.narrator.view_cache.get_or_compute(
        "aim", snapshot, lambda now: _format_goal_row(game, now, viewport), (viewport.width,)
    )


def _format_goal_row(game: Game, snapshot: SeatSnapshot, viewport: Viewport) -> ScreenLine:
    clauses = _goal_clauses(game, snapshot)
    return f" {CLAUSE_SEPARATOR.join(clauses[: max(_count_fitting_clauses(clauses, viewport.width), 1)])}"


def remaining_goal_lines(
    game: Game, snapshot: SeatSnapshot, goal_viewport: Viewport | None, log_viewport: Viewport
) -> list[str]:
    """What of it that row does not hold whole, all where there is none, as far as there is room."""
    clauses = _goal_clauses(game, snapshot)
    rest = clauses[_count_fitting_clauses(clauses, goal_viewport.width) if goal_viewport else 0 :]
    forms = [CLAUSE_SEPARATOR.join(rest[:many]) for many in range(len(rest), 0, -1)]
    fitting = (
        form for form in forms if len(wrap_lines([form], log_viewport)) <= log_viewport.height
    )
    return [next(fitting, forms[-1])] if forms else []


def _goal_clauses(game: Game, snapshot: SeatSnapshot) -> list[str]:
    return [escape_unprintable(clause) for clause in game.narrator.view_cache.goal_lines(snapshot)]


def _count_fitting_clauses(clauses: Sequence[str], width: int) -> int:
    """How many clauses a row holds."""
    many = range(len(clauses), 0, -1)
    return next((n for n in many if len(CLAUSE_SEPARATOR.join(clauses[:n])) < width), 0)
