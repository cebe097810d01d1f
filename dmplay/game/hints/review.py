"""The review of a player's choices: each action's value, the best action and the regret."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from math import ceil
from typing import Any, NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import UNKNOWN_BASIS, Accuracy, ActionValues, ValuesBasis
from dmplay.core.arrays import Bools
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.data_frames import make_frame
from dmplay.core.policy import Memory
from dmplay.core.session import SeatedPolicy, Session, Turn
from dmplay.core.spaces import Interval, Labels
from dmplay.core.text import align_columns, format_count, format_number
from dmplay.core.typed_text import list_state_names
from dmplay.core.work_budget import Budget, scale_progress_to_part
from dmplay.errors import DmplayError
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.hints.action_simulation import Start, can_compare, compare_returns
from dmplay.game.hints.hint_provider import (
    INTERVAL_RESOLUTION,
    SAMPLED_VALUES,
    TOO_CLOSE,
    choose_decimals,
    format_fixed,
    format_real_action,
)
from dmplay.game.hints.lost_value import ValueMeter
from dmplay.game.position import Position
from dmplay.registry import agents

BEST_ACTION = "the best action"
NOT_JUDGED = f"not judged ({TOO_CLOSE})"
REVIEW_NOTE_PREFIX = "# review "
REGRET_EXPLANATION = "regret = value of the best action minus value of the chosen one"
DISCOUNT_EXPLANATION = "discounted = the regret as it counts in the score"
MAX_BAR_COLUMNS = 20  # maximum columns of a regret bar
MAX_SHOWN_STATES = 4  # the likeliest ones of a stated belief
REVIEW_TASK = TaskInfo("reviewing your actions", is_after_game=True)
NEGLIGIBLE_SHARE = 0.005  # of the value at the start: a loss that is not worth another look
RIGHT_LOSS_PERCENT = 1  # of the best value minus the worst one: the loss of a right action


class StatedBelief(NamedTuple):
    """The belief that a player stated with an action, the exact one, and what a wrong one cost."""

    stated: dict[str, float]  # by state
    exact: dict[str, float]
    # loss of the best action for the stated belief, and of the chosen action beside that one
    seeing: tuple[float, float] | None = None  # bounds, equal if it is exact; None if unknown
    choosing: tuple[float, float] | None = None

    def format_line(self, decimal_count: int) -> str:
        """Return both beliefs and both losses on one line."""
        texts = [f"stated {_format_belief(self.stated)}", f"exact {_format_belief(self.exact)}"]
        if self.seeing and self.choosing:
            seeing, choosing = (
                format_range(x, decimal_count) for x in (self.seeing, self.choosing)
            )
            texts.append(f"lost by seeing {seeing}, by choosing {choosing}")
        return "; ".join(texts)


def _format_belief(probabilities: dict[str, float]) -> str:
    """Return the probabilities of the likeliest states above 0, in the order of the states."""
    likeliest = sorted(probabilities, key=probabilities.__getitem__)[-MAX_SHOWN_STATES:]
    pairs = [(name, probabilities[name]) for name in probabilities if name in likeliest]
    return ", ".join(f"{name} {format_number(p, 3)}" for name, p in pairs if p)


class ReviewedAction(NamedTuple):
    """One choice of a player, with the action values and its regret.

    The regret is None if the values are bounds, or guess how the other agents play. Values of real
    numbers are those of the choice, the best number and the ends of the interval.
    """

    turn: int
    seat: str
    chosen: str
    best: tuple[str, ...]
    regret: float | None
    values: dict[str, float]
    about: str = ""  # the turns left and the other players that the values are about
    basis: ValuesBasis = UNKNOWN_BASIS
    scale: float = 1.0  # of the problem's rewards
    discount_factor: float = 1.0  # gamma ** (turn - 1), by which the score counts the regret
    errors: dict[str, float] | None = None  # the standard errors of values that are sampled
    regret_bounds: tuple[float, float] | None = None  # if the regret is not known exactly
    stated_belief: StatedBelief | None = None
    is_number: bool = False  # The values are those of real numbers.

    @property
    def is_too_close(self) -> bool:
        """True if the choice is not judged, as estimates do not tell whether it is the best one.

        They do not if all actions are equally good, or if errors are too large: `best` has all
        actions that may be the best.
        """
        is_tie = len(self.best) == len(self.values) and self.basis.accuracy.is_estimate
        is_unclear = len(self.best) > 1 and (bool(self.errors) or self.basis.resolution > 0.0)
        return self.chosen in self.best and (is_tie or is_unclear)

    @property
    def is_judged(self) -> bool:
        """True if its values tell whether the choice is the best one, which bounds do not."""
        return not (self.is_too_close or self.basis.accuracy.is_bound)

    @property
    def is_estimated(self) -> bool:
        """True if the regret comes from estimated values, not from exact ones or their bounds."""
        return self.basis.accuracy.is_estimate and self.regret_bounds is None

    @property
    def is_mistake(self) -> bool:
        """True if the choice lost more than a choice that counts as right may lose."""
        limit = self._spread * RIGHT_LOSS_PERCENT / 100
        return (self.regret or 0.0) > max(limit, VALUE_TOLERANCE * self.scale)

    @property
    def discounted_regret(self) -> float:
        """The regret, discounted to the first turn as the score is; 0 if there is none."""
        return self.discount_factor * (self.regret or 0.0)

    @property
    def loss(self) -> float:
        """The discounted regret, or how much lower a choice is rated than the best action.

        It is 0 if nothing judges the choice.
        """
        is_rating = self.basis.accuracy is Accuracy.RATING and self.regret is None
        if not is_rating or self.is_too_close or self.chosen in self.best:
            return self.discounted_regret
        return max(self.values.values()) - self.values[self.chosen]

    @property
    def lost_something(self) -> bool:
        """True if the choice was a mistake, or is rated clearly lower than the best action."""
        return self.is_mistake or (self.regret is None and self.loss > 0)

    @property
    def regret_range(self) -> tuple[float, float] | None:
        """The lower and the upper bound of the regret, equal if it is known; None if unknown."""
        return self.regret_bounds if self.regret is None else (self.regret, self.regret)

    @property
    def discounted_spread(self) -> float:
        """The best value minus the worst one, discounted as the regret is."""
        return self.discount_factor * self._spread

    @property
    def _spread(self) -> float:
        """The best value minus the worst one.

        Of real numbers it is the size of the best value: the ends of an interval may be absurd.
        """
        values = [*self.values.values()] or [0.0]
        return abs(max(values)) if self.is_number else max(values) - min(values)

    @property
    def decimal_count(self) -> int:
        """The number of decimals of its values and its regret."""
        return _choose_decimals([self], [*self.values.values()])

    @property
    def data(self) -> dict[str, object]:
        """The review of this choice as data, with the basis of its values in words."""
        facts = self._asdict()
        last = {name: facts.pop(name) for name in ("about", "scale", "discount_factor")}
        del facts["basis"], facts["is_number"]
        errors = facts.pop("errors")
        last |= {} if errors is None else {"standard_errors": errors}
        belief = facts.pop("stated_belief")
        last |= {} if belief is None else {"stated_belief": belief._asdict()}
        bounds = facts.pop("regret_bounds")
        last |= {} if bounds is None else {"regret_bounds": [*bounds]}
        words = {"scope": self.basis.scope, "about": last.pop("about")}
        words["values_name"] = self.basis.accuracy.words
        return {**facts, "judged": self.is_judged, **words, **last}

    def __str__(self) -> str:
        """Return the review of this choice on one line."""
        beginning = f"turn {self.turn}, {self.seat}: chose {self.chosen}"
        decimal_count = self.decimal_count
        errors = self.errors or {}
        value_list = ", ".join(
            f"{name} {format_fixed(value, decimal_count)}"
            + (f" ({format_fixed(errors[name], decimal_count)})" if name in errors else "")
            for name, value in self.values.items()
        )
        name = SAMPLED_VALUES if errors else self.basis.accuracy.words
        if errors and not min(errors.values()):  # of games with the same random numbers
            name = f"{SAMPLED_VALUES.removesuffix(')')} of the difference from the best)"
        name = f"{name}, {self.about}" if errors and self.about else append_game(name, self.about)
        values_text = f"{name}: {value_list}"
        if self.is_too_close:
            return f"{beginning}, {NOT_JUDGED}. {values_text}"
        regret_range = self.regret_range
        regret = f", regret {format_range(regret_range, decimal_count)}" if regret_range else ""
        if self.chosen in self.best:
            rank = "the action of the best bound" if self.basis.accuracy.is_bound else BEST_ACTION
            return f"{beginning}, {rank}{regret * (self.regret is None)}. {values_text}"
        best = "action of the best bound" if self.basis.accuracy.is_bound else "best action"
        return f"{beginning}, {best}: {' or '.join(self.best)}{regret}. {values_text}"


def format_range(bounds: tuple[float, float], decimal_count: int) -> str:
    """Return a number, or the range between two different bounds."""
    return " to ".join(format_fixed(bound, decimal_count) for bound in dict.fromkeys(bounds))


def list_costly_choices(moves: Sequence[ReviewedAction]) -> list[ReviewedAction]:
    """Return the choices that lost so much that they are worth another look."""
    starts = dict[str, float]()  # by seat: the value of best play before the first choice
    for move in moves:
        starts.setdefault(move.seat, abs(max(move.values.values(), default=0.0)))
    return [
        move
        for move in moves
        if move.lost_something
        and (
            move.basis.accuracy is Accuracy.RATING
            or move.loss >= NEGLIGIBLE_SHARE * starts[move.seat]
        )
    ]


class Review(list[ReviewedAction]):
    """The reviewed choices of a game."""

    def __repr__(self) -> str:
        return "\n".join(map(str, self))

    def to_frame(self, library: str = "") -> Any:
        """Return a row per choice as a data frame of pandas, or of the `library` polars."""
        return make_frame([choice.data for choice in self], library)


def append_game(text: str, scope: str) -> str:
    """Return a text followed by the game that it is about in brackets, if that is not this one."""
    return f"{text} ({scope})" if scope else text


def review_actions(
    session: Session, questions: Sequence[AdviceQuestion], *, can_sample: bool = False
) -> Iterator[ReviewedAction]:
    """Yield a review of every choice that the hint agent can value, in order.

    If `can_sample`, they include those that a search estimates by samples. There is one question
    for each seat to review. The turns are replayed in a copy of the session. Turns of earlier
    players are left out: the values would be about players who did not play them.
    """
    problem = session.problem
    replayed = session.copy_at_start()
    hint_agents: dict[int, tuple[agents.HintAgent, SeatedPolicy]] = {}
    for question in questions:
        hint_agent = agents.find_hint_provider(problem, question)
        seat = question.seat
        if hint_agent:
            hint_agents[seat] = hint_agent, SeatedPolicy(replayed, seat, hint_agent.policy)
    budget = Budget("the review", "review a shorter game")
    starts = list[tuple[Start, ReviewedAction, Labels]]()  # of choices to compare by games
    for number, turn in enumerate(session.turns, 1):
        budget.spend_work(1.0, (number - 1) / len(session.turns))
        for seat, (hint_agent, hint_policy) in hint_agents.items():
            if number <= hint_agent.question.earlier_turns or replayed.is_inactive(seat):
                continue
            reviewed = ReviewedAction(
                number,
                problem.agents[seat],
                replayed.format_action(seat, float(turn.actions[seat])),
                (),
                None,
                {},
                hint_agent.describe_game(number - 1),
                scale=problem.reward_scale,
                discount_factor=problem.discount ** (number - 1),
            )
            labels = replayed.action_labels(seat)
            memory = hint_policy.current_memory()
            if seat in turn.stated_beliefs:
                stated_belief = _judge_belief(replayed, hint_agent, memory, turn)
                reviewed = reviewed._replace(stated_belief=stated_belief)
            if not labels:
                yield from _review_real_action(reviewed, hint_agent, memory, turn.actions[seat])
                continue
            if can_compare(hint_agent):
                starts.append((_make_start(replayed, hint_policy), reviewed, labels))
                continue
            with scale_progress_to_part(number - 1, len(session.turns)):
                values = _compute_values(replayed, hint_agent, hint_policy, can_sample=can_sample)
            if values is not None:
                move = _judge_action(reviewed, labels, values)
                legal = replayed.legal_actions_mask(seat)
                yield _bound_regret(move, hint_agent, memory, legal, turn.actions[seat])
        replayed.append_turns([turn])
    if starts:
        comparisons = compare_returns(hint_agents[0][0], [start for start, *_ in starts])
        for (_, reviewed, labels), values in zip(starts, comparisons, strict=True):
            # The games are about other turns than the values that they replace.
            yield _judge_action(reviewed._replace(about=values.basis.scope), labels, values)


def _judge_belief(
    session: Session, agent: agents.HintAgent, memory: Memory, turn: Turn
) -> StatedBelief | None:
    """Return the stated belief of a turn beside the exact one; None if that is not known."""
    exact = agent.policy.state_belief(memory)
    if exact is None:
        return None
    names = list_state_names(session.problem)
    stated = turn.stated_beliefs[agent.question.seat]
    stated_belief, exact_belief = (
        dict(zip(names, p.tolist(), strict=True)) for p in (stated, exact[0])
    )
    with suppress(DmplayError):  # without values of a belief that are about this game
        meter = ValueMeter(session.problem, agent.question, agent)
        seeing, choosing = meter.weigh_choice(session, memory, turn).split_regret()
        return StatedBelief(stated_belief, exact_belief, seeing, choosing)
    return StatedBelief(stated_belief, exact_belief)


def _make_start(session: Session, hint_policy: SeatedPolicy) -> Start:
    """Return the position of the only agent as a start of simulated games."""
    legal, limit = session.legal_actions_mask(0), session.turn_limit
    actions = np.arange(len(session.action_labels(0))) if legal is None else np.flatnonzero(legal)
    turns_left = None if limit is None else limit - len(session.turns)
    return Start(session.state, hint_policy.current_memory(), turns_left, actions)


def _compute_values(
    session: Session, hint_agent: agents.HintAgent, hint_policy: SeatedPolicy, *, can_sample: bool
) -> ActionValues | None:
    """Return the values of the hint agent in a position, or its estimates if it may sample."""
    question = hint_agent.question
    legal = session.legal_actions_mask(question.seat)
    values = hint_agent.attach_basis(hint_policy.action_values(), legal)
    if values is None and can_sample:
        memory = hint_policy.current_memory()
        return Position.with_agent(session, question, hint_agent, memory).values()
    return values


def _judge_action(
    reviewed: ReviewedAction, labels: Sequence[str], values: ActionValues
) -> ReviewedAction:
    """Return the review of an action with the best legal actions and its regret."""
    legal = np.flatnonzero(~np.isnan(values.q)).tolist()
    errors, chosen = values.errors, [*labels].index(reviewed.chosen)
    best_actions = values.best_actions
    if values.basis.resolution:
        best_actions = np.flatnonzero(values.regrets <= values.basis.resolution)
    regret = 0.0 if chosen in best_actions else float(values.regrets[chosen])
    return reviewed._replace(
        best=tuple(labels[a] for a in best_actions),
        regret=regret if values.basis.has_exact_regrets else None,
        values={labels[a]: float(values.q[a]) for a in legal},
        basis=values.basis,
        errors=None if errors is None else {labels[a]: float(errors[a]) for a in legal},
    )


def _bound_regret(
    move: ReviewedAction,
    agent: agents.HintAgent,
    memory: Memory,
    legal: Bools | None,
    action: float,
) -> ReviewedAction:
    """Return a reviewed action with the bounds of its regret, if its values are bounds."""
    if not move.basis.accuracy.is_bound:
        return move
    bounds = agent.bound_regrets(
        memory, None if legal is None else legal[None], np.array([int(action)])
    )
    if bounds is None or not np.isfinite(bounds).all():
        return move
    return move._replace(regret_bounds=(float(bounds[0, 0]), float(bounds[1, 0])))


def _review_real_action(
    move: ReviewedAction, agent: agents.HintAgent, memory: Memory, action: float
) -> Iterator[ReviewedAction]:
    """Yield the review of a choice among real numbers, if it can be valued.

    A number as close to the best one as a hint's is one of the best.
    """
    policy, number = agent.policy, np.array([action])
    interval = policy.problem.actions[policy.seat]
    bounds = agent.bound_regrets(memory, None, number)
    if bounds is None or not isinstance(interval, Interval):
        return
    best = policy.choose(memory, None, np.zeros((1, policy.uniform_count)))
    is_close = abs(best[0] - action) <= INTERVAL_RESOLUTION * (interval.high - interval.low)
    is_best = is_close or not bounds.any()
    low, high = (0.0, 0.0) if is_best else bounds[:, 0].tolist()
    ends = {interval.format_action(end): end for end in (interval.low, interval.high)}
    best_name = move.chosen if is_best else interval.format_action(best[0])
    if not is_best and best_name not in ends:
        best_name = format_real_action(interval, best[0])
    numbers = {**ends, best_name: float(best[0]), move.chosen: float(action)}
    value_bounds = [policy.value_bounds(memory, np.array([item])) for item in numbers.values()]
    lower = [float(item[0][0]) for item in value_bounds if item is not None]
    is_exact = low == high
    accuracy = Accuracy.EXACT if is_exact else Accuracy.LOWER_BOUND
    yield move._replace(
        best=(best_name,),
        regret=low if is_exact else None,
        regret_bounds=None if is_exact else (low, high),
        values=dict(zip(numbers, lower, strict=True)),
        basis=agent.basis._replace(accuracy=accuracy),
        is_number=True,
    )


def _bound_discounted_regret(move: ReviewedAction) -> float:
    """Return the lower bound of the discounted regret, which is the regret if that is known."""
    return move.discount_factor * (move.regret_range or (0.0, 0.0))[0]


def total_regret(reviewed_actions: Sequence[ReviewedAction]) -> float:
    """Return the sum of all regrets, discounted to the first turn as the score is."""
    return sum(move.discounted_regret for move in reviewed_actions)


def total_regret_range(reviewed_actions: Sequence[ReviewedAction]) -> tuple[float, float] | None:
    """Return the bounds of the total discounted regret; None if a regret has no bounds."""
    total_low = total_high = 0.0
    for move in reviewed_actions:
        if move.regret_range is None:
            return None
        total_low += move.discount_factor * move.regret_range[0]
        total_high += move.discount_factor * move.regret_range[1]
    return total_low, total_high


def format_summary(reviewed_actions: list[ReviewedAction]) -> str:
    """Return one line: the number of best choices, the total regret and the worst turn."""
    if not reviewed_actions:
        return "review: no agent can compute the values of these actions"
    judged = [move for move in reviewed_actions if not move.is_too_close]
    best_count = sum(move.chosen in move.best for move in judged)
    scopes = {move.basis.scope for move in reviewed_actions}
    are_bounds = reviewed_actions[0].basis.accuracy.is_bound
    best = "action of the best bound" if are_bounds else "best action"
    best = append_game(best, *scopes) if len(scopes) == 1 else best
    count = len(reviewed_actions) - len(judged)
    unjudged = f", {format_count(count, 'choice')} {NOT_JUDGED}" if count else ""
    text = f"review: {best} {best_count} of {format_count(len(judged), 'time')}{unjudged}"
    if not judged:
        return f"review: {unjudged.removeprefix(', ')}"
    total_range = total_regret_range(reviewed_actions)
    if total_range is None:
        if are_bounds:
            return f"{text}; bounds do not judge a choice"
        return f"{text}; no regret, because the values are not exactly about this game"
    worst = max(reviewed_actions, key=_bound_discounted_regret)
    is_estimated = any(move.is_estimated for move in reviewed_actions)
    expected = "estimated" if is_estimated else "expected"
    is_discounted = any(move.discount_factor < 1.0 for move in reviewed_actions)
    lost = "rating" if _have_ratings(reviewed_actions) else "value"
    meaning = f"{'discounted ' * is_discounted}{lost} lost"
    regret_text = format_range(total_range, _choose_decimals(reviewed_actions, total_range))
    text = f"{text}, total {expected} regret ({meaning}) {regret_text}"
    if best_count == len(judged) or not _bound_discounted_regret(worst):
        return text
    return f"{text}, largest in turn {worst.turn}"


def _have_ratings(reviewed_actions: Sequence[ReviewedAction]) -> bool:
    """Return whether the values are ratings, which are whole numbers."""
    return any(move.basis.accuracy is Accuracy.RATING for move in reviewed_actions)


def _choose_decimals(reviewed_actions: Sequence[ReviewedAction], numbers: Sequence[float]) -> int:
    """Return the decimals that tell these values or regrets apart; 0 for actions with ratings."""
    if _have_ratings(reviewed_actions):
        return 0
    return choose_decimals(numbers, reviewed_actions[0].scale if reviewed_actions else 1.0)


def run_review(
    session: Session, questions: Sequence[AdviceQuestion], *, can_sample: bool = False
) -> list[ReviewedAction]:
    """Return all reviewed choices of these seats, computed in a cancellable task."""
    return run_cancellable(
        REVIEW_TASK, lambda: [*review_actions(session, questions, can_sample=can_sample)]
    )


def format_table(reviewed_actions: list[ReviewedAction]) -> list[str]:
    """Return the review as an aligned table, largest regret first, and a line for each seat.

    The columns are turn, seat (if several), choice, best actions, regret and discounted regret,
    unless there is none, with a bar. The last lines then explain the regret.
    """
    regrets = [bound for move in reviewed_actions for bound in move.regret_range or ()]
    losses = [_bound_discounted_regret(move) for move in reviewed_actions]
    max_loss, decimal_count = (
        max(losses, default=0.0),
        _choose_decimals(reviewed_actions, [*regrets, *losses]),
    )
    is_discounted = any(move.discount_factor < 1.0 for move in reviewed_actions)
    regret_headings = ["regret", *["discounted"] * is_discounted] if regrets else []
    scopes = {move.basis.scope for move in reviewed_actions}
    has_one_scope = len(scopes) == 1
    best_heading = append_game("best", *scopes) if has_one_scope else "best"
    has_several_seats = len({move.seat for move in reviewed_actions}) > 1
    rows = [["turn", *["seat"] * has_several_seats, "chosen", best_heading, *regret_headings]]
    for move in sorted(reviewed_actions, key=_bound_discounted_regret, reverse=True):
        regret_cells: list[str] = []
        if move.regret_range is not None:
            factors = [1.0, *[move.discount_factor] * is_discounted]
            low, high = move.regret_range
            regret_cells = [format_range((x * low, x * high), decimal_count) for x in factors]
            if low:
                loss = _bound_discounted_regret(move)
                bar = "#" * ceil(MAX_BAR_COLUMNS * (loss / max_loss))
                regret_cells[-1] += f" {bar}"
        seat = [move.seat] * has_several_seats
        best = "any" if len(move.best) == len(move.values) else " or ".join(move.best)
        best = NOT_JUDGED if move.is_too_close else best
        best = best if has_one_scope else append_game(best, move.basis.scope)
        rows.append([str(move.turn), *seat, move.chosen, best, *regret_cells])
    return [
        *(align_columns(rows) if reviewed_actions else []),
        *(
            f"turn {move.turn}: {move.stated_belief.format_line(decimal_count)}"
            for move in reviewed_actions
            if move.stated_belief
        ),
        *_format_summaries(reviewed_actions),
        *([REGRET_EXPLANATION] if regrets else []),
        *([DISCOUNT_EXPLANATION] if regrets and is_discounted else []),
    ]


def format_lines(reviewed_actions: list[ReviewedAction]) -> list[str]:
    """Return the review as one line per choice, and a summary line for each seat."""
    return [*map(str, reviewed_actions), *_format_summaries(reviewed_actions)]


def _format_summaries(reviewed_actions: list[ReviewedAction]) -> list[str]:
    """Return a summary line for each seat, which it names if there are several."""
    seats = [*dict.fromkeys(move.seat for move in reviewed_actions)]
    if len(seats) < 2:
        return [format_summary(reviewed_actions)]
    parts = [[move for move in reviewed_actions if move.seat == seat] for seat in seats]
    return [
        format_summary(part).replace("review", f"review of {seat}", 1)
        for seat, part in zip(seats, parts, strict=True)
    ]


def format_notes(reviewed_actions: list[ReviewedAction]) -> list[str]:
    """Return the review as note lines for the end of a transcript."""
    return [
        f"{REVIEW_NOTE_PREFIX}{line.removeprefix('review').lstrip(': ')}\n"
        for line in format_lines(reviewed_actions)
    ]
