"""The first rows of the play screen: the title with the game's status, and the goal."""

from collections.abc import Iterator, Sequence

from dmplay.core.problem_summary import score_label
from dmplay.core.session import DEFAULT_TURN_LIMIT
from dmplay.core.text import describe_end_reason, escape_unprintable, format_reward
from dmplay.game.game import Game
from dmplay.game.player_records import can_earn_medal
from dmplay.game.seat_snapshot import SeatSnapshot
from dmplay.terminal.styles import ScreenLine
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.post_game_timeline import GameTimeline
from dmplay.ui.screen.text_wrapping import wrap_lines

CLAUSE_SEPARATOR = "; "  # between clauses of the goal
UNSHOWN_TURN_LIMITS = (None, DEFAULT_TURN_LIMIT)  # turn limits that are not displayed


def title_row(game: Game, snapshot: SeatSnapshot, viewport: Viewport) -> ScreenLine:
    """Return the title row in the fullest form that fits; the last form has no facts at all."""
    end = snapshot.end_reason and (
        "over" if snapshot.end_reason == "terminal" else describe_end_reason(snapshot.end_reason)
    )
    name_text, status, end_text = "", "", ""
    for name_text, gap, facts in _iter_title_forms(game, snapshot):
        status, end_text = gap[1:] + gap.join(facts), gap + end if end else ""
        if len(name_text) + len(status) + len(end_text) <= viewport.width:
            break
    row = (name_text, "bold"), (status, "")
    return (*row, (end_text, "bold")) if end_text else row


def _iter_title_forms(
    game: Game, snapshot: SeatSnapshot
) -> Iterator[tuple[str, str, Sequence[str]]]:
    """Yield (name, gap, facts) for the title, from the fullest form to the shortest."""
    seed = [f"seed {game.seed}"] if game.is_seed_visible else []
    facts = _title_facts(game, snapshot, score_label(game.problem))
    yield _format_name(game), "   ", [*seed, *facts]
    short_name = f" {escape_unprintable(game.problem_name)} "
    yield short_name, "  ", facts
    facts = _title_facts(game, snapshot, "score")
    yield short_name, "  ", facts
    facts = _title_facts(game, snapshot, "score", are_seats_short=True)
    for fact_count in range(len(facts), -1, -1):  # A fact is shown whole or not at all.
        yield short_name, "  ", facts[:fact_count]


def _title_facts(
    game: Game, snapshot: SeatSnapshot, score_name: str, *, are_seats_short: bool = False
) -> list[str]:
    """Return the facts of the title: turn, return, own seat and the other players."""
    limit = game.session.turn_limit
    is_lookback = isinstance(game, GameTimeline)
    turn_text = f"before turn {snapshot.turn + 1}" if is_lookback else f"turn {snapshot.turn}"
    facts = [turn_text if limit in UNSHOWN_TURN_LIMITS else f"{turn_text}/{limit}"]
    if snapshot.rewards_visible:
        facts.append(f"{score_name} {format_reward(game.narrator.seat_return(snapshot))}")
    elif game.human_seats:
        facts.append("score hidden")
    own_seat = game.viewing_seat if game.human_seats else None
    facts += _format_players(
        tuple(game.problem.agents), game.player_names, own_seat, is_short=are_seats_short
    )
    return facts


def _format_players(
    agents: Sequence[str], player_names: Sequence[str], own_seat: int | None, *, is_short: bool
) -> tuple[str, ...]:
    """Return the person's own seat as 'you are SEAT', then each other seat with its player.

    The short forms are 'you: SEAT' and 'SEAT: PLAYER'. A person alone has no entry.
    """
    own_verb, other_verb = (":", ":") if is_short else (" are", " played by")
    own_entry = (
        () if own_seat is None or len(agents) == 1 else (f"you{own_verb} {agents[own_seat]}",)
    )
    others = enumerate(zip(agents, player_names, strict=True))
    return (
        *own_entry,
        *(
            f"{agent}{other_verb} {escape_unprintable(player_name)}"
            for seat, (agent, player_name) in others
            if seat != own_seat
        ),
    )


def make_name_row(game: Game) -> ScreenLine:
    """Return the row with the name of the game alone."""
    return ((_format_name(game), "bold"),)


def _format_name(game: Game) -> str:
    """Return the program's and the problem's name for the title."""
    return f" dmplay {escape_unprintable(game.problem_name)}  "


def goal_row(game: Game, snapshot: SeatSnapshot, viewport: Viewport) -> ScreenLine:
    """Return the goal row: as many clauses of the goal and its costs as fit, at least one."""
    clauses = _goal_clauses(game, snapshot)
    count = max(_count_fitting_clauses(clauses, viewport.width), 1)
    return f" {CLAUSE_SEPARATOR.join(clauses[:count])}"


def remaining_goal_lines(
    game: Game, snapshot: SeatSnapshot, goal_viewport: Viewport | None, log_viewport: Viewport
) -> list[str]:
    """Return the clauses that the goal row does not show whole, joined and cut to fit the log.

    All clauses if `goal_viewport` is None, because there is no goal row then.
    """
    clauses = _goal_clauses(game, snapshot)
    if goal_viewport:
        first, *others = clauses[_count_fitting_clauses(clauses, goal_viewport.width) :] or [""]
        terms = _explain_terms(game, snapshot, has_panel=True)
        aids = ["Tab gives a hint, but costs the medal"] * (
            can_earn_medal(game) and not game.hints_forbidden
        )
        remaining = [*filter(None, [first, *terms, *others, *aids])]
    else:  # Then there is hardly a side panel either, which has the other players' rules.
        rules = [
            escape_unprintable(f"{agent} ({name}) {rule}")
            for agent, name, rule in game.other_players[:1]
            if rule
        ]
        terms = _explain_terms(game, snapshot, has_panel=False)
        remaining = [*clauses[:1], *rules, *clauses[1:], *terms]
    fitting = remaining[:1]
    for clause in remaining[1:]:
        text = CLAUSE_SEPARATOR.join([*fitting, clause])
        if len(wrap_lines([text], log_viewport)) <= log_viewport.height:
            fitting.append(clause)
    return [CLAUSE_SEPARATOR.join(fitting)] if fitting else []


def _explain_terms(game: Game, snapshot: SeatSnapshot, *, has_panel: bool) -> Iterator[str]:
    """Yield clauses on terms of the screen: a hidden score, a discount, and a belief.

    The side panel explains a hidden score, if there is one.
    """
    if not (snapshot.rewards_visible or has_panel):
        yield f"score hidden: {explain_hidden_reward(game)}"
    discount = game.problem.discount
    if discount < 1.0:
        yield (
            f"discounted: a reward of turn 2 counts {discount:.3g}, of turn 3 {discount**2:.3g}, "
            "and so on"
        )
    if snapshot.view.beliefs is not None:
        yield "belief: how likely each state is"


def explain_hidden_reward(game: Game) -> str:
    """Return the reason why rewards are hidden, with the fact that the view names."""
    return f"it would tell {getattr(game.view_module, 'HIDDEN_FACT', 'the state')}"


def _goal_clauses(game: Game, snapshot: SeatSnapshot) -> list[str]:
    """Return the clauses of the goal, with unprintable characters escaped."""
    clauses = [game.lesson_goal] if game.lesson_goal else []
    clauses += game.view_module.goal_lines(snapshot.view)
    return [escape_unprintable(clause) for clause in clauses]


def _count_fitting_clauses(clauses: Sequence[str], width: int) -> int:
    """Return the number of leading clauses that fit in one row."""
    counts = range(len(clauses), 0, -1)
    return next((n for n in counts if len(CLAUSE_SEPARATOR.join(clauses[:n])) < width), 0)
