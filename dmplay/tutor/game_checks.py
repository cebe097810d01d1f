"""Checks of a finished game against the conditions of a lesson's step."""

from collections import Counter
from collections.abc import Iterator
from itertools import groupby

from dmplay.core.action_values import Accuracy
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.session import Session
from dmplay.core.text import describe_end_reason, format_count
from dmplay.errors import BadParameter
from dmplay.game.hints.ghost_agent import Ghost
from dmplay.game.hints.review import ReviewedAction, run_review, total_regret
from dmplay.registry import agents
from dmplay.transcript.format import NATURAL_END_REASONS
from dmplay.tutor.answers import AnswerCheck
from dmplay.tutor.lesson import GameTask
from dmplay.tutor.positions import PositionInGame, finish_ghost, play_ghost
from dmplay.tutor.truth import format_number


def check_game_conditions(position: PositionInGame, task: GameTask) -> AnswerCheck:
    """Return whether the game satisfies all conditions, with a sentence on each that fails.

    If all are satisfied, the sentences contain the numbers that were compared.
    """
    session = position.session
    if session.end_reason not in NATURAL_END_REASONS:
        return AnswerCheck(False, "the game was left before its end")
    results = [*_iter_condition_results(position, task)]
    failed = [result.reason for result in results if not result.is_right]
    sentences = failed or [result.reason for result in results if result.reason]
    return AnswerCheck(not failed, "; ".join(sentences))


def _iter_condition_results(position: PositionInGame, task: GameTask) -> Iterator[AnswerCheck]:
    """Yield the result of each condition of a task."""
    session = position.session
    turn_count = len(session.turns) - position.first_turn
    if task.ends:
        is_end = session.end_reason == "terminal"
        reason = "" if is_end else f" ({describe_end_reason(session.end_reason)})"
        turns = format_count(turn_count, "turn")
        yield AnswerCheck(is_end, f"the game ended after {turns}{reason}")
    if task.reaches:
        yield _check_visit(session, task.reaches)
    if task.turns_at_most is not None:
        yield AnswerCheck(
            turn_count <= task.turns_at_most,
            f"you took {format_count(turn_count, 'turn')}, and {task.turns_at_most} are allowed",
        )
    if task.turns_at_least is not None:
        yield AnswerCheck(
            turn_count >= task.turns_at_least,
            f"the game lasted {format_count(turn_count, 'turn')}; {task.turns_at_least} are needed",
        )
    if task.return_at_least is not None:
        score = session.seat_return(position.seat)
        yield AnswerCheck(
            score >= task.return_at_least - _get_tolerance(position),
            f"you scored {format_number(score)}; the goal is at least {task.return_at_least:g}",
        )
    if task.beats:
        yield _compare_with_agent(position, task)
    if task.regret_at_most is not None:
        yield check_regret(position, task.regret_at_most)
    if task.hints_at_most is not None:
        hint_count = session.hint_counts[position.problem.agents[position.seat]]
        yield AnswerCheck(
            hint_count <= task.hints_at_most,
            f"you asked for {format_count(hint_count, 'hint')}; {task.hints_at_most} are allowed"
            if hint_count > task.hints_at_most
            else "",
        )
    yield from _check_choices(position, task)


def _get_tolerance(position: PositionInGame) -> float:
    """Return the difference up to which returns are equal."""
    return VALUE_TOLERANCE * position.problem.reward_scale


def _check_visit(session: Session, state_text: str) -> AnswerCheck:
    """Return whether the game visited a state."""
    names = [session.problem.format_state(turn.state) for turn in session.turns]
    goal = session.problem.format_state(session.problem.parse_state(state_text))
    if goal in names:
        return AnswerCheck(True, f"you reached {goal} in turn {names.index(goal) + 1}")
    return AnswerCheck(False, f"you did not reach {goal}; the last state was {names[-1]}")


def _compare_with_agent(position: PositionInGame, task: GameTask) -> AnswerCheck:
    """Return whether the return is at least that of an agent on the same draws."""
    ghost = play_ghost(position, task.beats)
    is_enough = ghost.player_lead >= -task.margin - _get_tolerance(position)
    score = format_number(position.session.seat_return(position.seat))
    scores = f"{task.beats} scored {format_number(ghost.score)} and you {score}"
    less, more = f"at most {task.margin:g} less", f"at least {-task.margin:g} more"
    goal = f"; the goal is {less if task.margin > 0 else more}"
    margin_text = goal if task.margin and not is_enough else ""
    return AnswerCheck(is_enough, f"with the same random numbers, {scores}{margin_text}")


def check_regret(position: PositionInGame, regret_at_most: float) -> AnswerCheck:
    """Return whether the total regret of the player's choices is small enough.

    The reason names the worst choice and what it loses, but no better action. Raise BadParameter
    if the exact values of this game are not known.
    """
    moves = run_review(position.session, [position.question])
    if len(moves) < len(position.session.turns) or any(
        move.regret is None or move.basis.accuracy is not Accuracy.EXACT for move in moves
    ):
        raise BadParameter("regret_at_most: the exact values of this game are not known")
    moves = [move for move in moves if move.turn > position.first_turn]
    discount = position.problem.discount
    total = total_regret(moves)
    kind = "discounted regret" if discount < 1.0 else "regret"
    text = f"the {kind} is {format_number(total)}; the limit is {regret_at_most:g}"
    if total <= regret_at_most + _get_tolerance(position):
        return AnswerCheck(True, text)
    return AnswerCheck(False, f"{text}. {describe_worst_choice(moves)}")


def describe_worst_choice(moves: list[ReviewedAction]) -> str:
    """Return a sentence on the choice that lost most, in the unit of the total regret.

    It names no better action.
    """
    worst = max(moves, key=lambda move: move.discounted_regret)
    lost = format_number(worst.discounted_regret)
    return f"The largest loss was in turn {worst.turn}: {lost}, by the action {worst.chosen}"


def _check_choices(position: PositionInGame, task: GameTask) -> Iterator[AnswerCheck]:
    """Yield whether each action was chosen often enough, and not too often."""
    problem, seat = position.problem, position.seat
    counts = Counter(
        problem.format_action(seat, turn.actions[seat])
        for turn in position.session.turns[position.first_turn :]
    )
    for name, count in task.choices.items():
        label = problem.format_action(seat, problem.parse_action(seat, name))
        text = f"you chose {label} {format_count(counts[label], 'time')}, and {count} are needed"
        yield AnswerCheck(counts[label] >= count, text)
    for name, count in task.choices_at_most.items():
        label = problem.format_action(seat, problem.parse_action(seat, name))
        text = f"you chose {label} {format_count(counts[label], 'time')}; {count} are allowed"
        yield AnswerCheck(counts[label] <= count, text)


def describe_model_game(position: PositionInGame) -> str:
    """Return the actions of the agent that gives hints on the same draws as text.

    '' if there is no such agent.
    """
    provider = agents.find_hint_provider(position.problem, position.question)
    if provider is None:
        return ""
    name = provider.name.partition(":")[0]
    seat = position.seat
    ghost = finish_ghost(position, Ghost(name, position.session, {seat: provider.policy}))
    labels = [
        position.problem.format_action(seat, turn.actions[seat])
        for turn in ghost.session.turns[position.first_turn :]
    ]
    runs = [(label, len([*group])) for label, group in groupby(labels)]
    actions = ", ".join(f"{count} x {label}" if count > 1 else label for label, count in runs)
    score = format_number(ghost.score)
    return f"with the same random numbers, {name} plays {actions}, and scores {score}"
