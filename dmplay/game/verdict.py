"""The verdict on a finished game: the result, the quality of the choices, luck and comparisons.

Every number is about the game that was played: its players, its turn limit and the information of
each seat.
"""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, cast

import numpy as np

from dmplay.agents.base import SCRIPTED_PLAYERS, AdviceQuestion
from dmplay.agents.expected_return import compute_expected_return
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import initial_state_distribution, make_initial_observation
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.text import format_count
from dmplay.core.work_budget import ComputationStopped, limit_total_work, stop_after_seconds
from dmplay.errors import DmplayError
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.hints.ghost_agent import Ghost, describe_ghost_result
from dmplay.game.hints.hint_provider import choose_decimals, format_fixed
from dmplay.game.hints.review import (
    NOT_JUDGED,
    ReviewedAction,
    append_game,
    run_review,
    total_regret,
)
from dmplay.game.medals import GOLD_SHARE, AgentValue, Medal, award_medal
from dmplay.game.position import ADVICE_WORK_LIMIT, SEARCH_AGENT
from dmplay.registry import agents
from dmplay.registry.problem_name_kinds import names_bot

if TYPE_CHECKING:  # Most games end without being compared.
    from dmplay.simulation.rollouts import Rollout

COMPARED_GAMES = 100  # games of each agent that the score is compared with
# In every problem, the returns of its 100 random games differ by at most 0.08 (Kolmogorov-Smirnov)
# from those of 4,000 games.
COMPARISON_SEED = 1_000_005
MAX_COMPARED_TURNS = 2000  # turns after which a game of an agent must be over
MAX_SECONDS = 1.0  # seconds of processor time of each part of a verdict that nobody waits for
MEDAL_TASK = TaskInfo("finding your medal", is_after_game=True)
COMPARISON_TASK = TaskInfo("comparing your score with other games", is_after_game=True)
RETURN_TOLERANCE = 1e-9  # differences of returns that count as equal
RANDOM_AGENT = "random"
UNREPEATABLE_PLAYERS = (*SCRIPTED_PLAYERS, SEARCH_AGENT)  # too slow, or only for one game
AVERAGE_LUCK = 0.1  # of the regret of random play: less luck is average
CHOICE_WORDS = (  # by the share of the regret of random play that is not exceeded
    (GOLD_SHARE, "excellent choices"),
    (0.2, "good choices"),
    (0.5, "mixed choices"),
    (1.0, "weak choices"),
    (math.inf, "choices no better than random"),
)
COSTLY_MARKS = (("??", 0.5), ("?!", 0.2))  # marks, and the share of the stake lost from which on
NATURAL_END_REASONS = ("terminal", "horizon", "turn limit")


@dataclass(frozen=True)
class SeatChoices:
    """The choices of one person.

    Regret, worst choice and luck are None unless the values are exact for the game that was played.
    """

    seat: str
    count: int  # judged choices
    best_count: int
    basis: ValuesBasis  # of the values
    score: float
    regret: float | None = None  # discounted to the start, as the score is
    worst: ReviewedAction | None = None  # the choice that lost most of the score, if any did
    start_value: float | None = None  # expected score under optimal play
    luck: float | None = None  # score - (start value - regret)
    scale: float = 1.0  # of the problem's rewards
    unjudged_count: int = 0  # choices of which estimates do not tell whether they are the best

    def format_choice_lines(self, prefix: str = "") -> list[str]:
        """Return a line on the choices; with exact values also one each on luck and worst turn.

        Each line begins with the prefix.
        """
        share = f"best action {self.best_count} of {format_count(self.count, 'time')}"
        if self.regret is None:
            # ratings are not called points here
            name, _, _ = self.basis.accuracy.words.partition(",")
            text = append_game(name, self.basis.scope)
            if self.basis.scope and not self.basis._replace(ignores_turn_limit=False).scope:
                text = f"{name}, which ignore the turn limit"
            unjudged = f"{format_count(self.unjudged_count, 'choice')} {NOT_JUDGED}"
            if self.basis.accuracy.is_bound:
                share = share.replace("best action", "action of the best bound")
                text = f"{text}, which do not judge a choice"
            parts = [f"{share} by the {text}"] * bool(self.count)
            parts += [unjudged] * bool(self.unjudged_count)
            return [f"{prefix}choices: {', '.join(parts)}"]
        numbers = [self.regret, self.luck or 0.0, self.start_value or 0.0]
        decimals = choose_decimals(numbers, self.scale)
        regret_text = format_fixed(self.regret, decimals)
        worst = f"worst: {_describe_worst(self.worst)}" if self.worst else ""
        if self.luck is not None and self.start_value is not None:
            explanation = self._explain_score(self.start_value, self.luck, decimals)
            choices = "; ".join(filter(None, [share, worst]))
            return [f"{prefix}choices: {choices}", f"{prefix}{explanation}"]
        cost = f"; expected score lost: {regret_text} (regret)" * (self.regret > 0)
        if self.start_value is not None:
            cost += f"; average of best play: {format_fixed(self.start_value, decimals)}"
        return [f"{prefix}choices: {share}{cost}", *[f"{prefix}{worst}"] * bool(worst)]

    def describe_quality(self, medal: Medal | None) -> str:
        """Return the quality of choices with a known regret, and the luck; '' if unknown.

        The measure is the regret of random play, the limit of a bronze medal.
        """
        stake, _ = medal.limits.get("bronze", (0.0, "")) if medal else (0.0, "")
        if self.regret is None:
            return ""
        share = self.regret / stake if stake else math.nan
        words = next((text for limit, text in CHOICE_WORDS if share <= limit), "")
        if self.best_count == self.count:
            words = "perfect choices"
        if not (words and stake) or self.luck is None:
            return words
        is_average = abs(self.luck) < AVERAGE_LUCK * stake
        return f"{words}, {'average' if is_average else 'good' if self.luck > 0 else 'bad'} luck"

    def _explain_score(self, start_value: float, luck: float, decimals: int) -> str:
        """Return the score as the sum of its parts, which add up as printed.

        The rounding error is added to the luck, or to the start value if there is no luck.
        """
        score, regret = round(self.score, decimals), round(self.regret or 0.0, decimals)
        start = round(start_value if luck else score + regret, decimals)
        luck_part = score - start + regret
        kind = "good luck" if luck > 0 else "bad luck" if luck < 0 else "luck"
        start_text, regret_text, luck_text = (
            format_fixed(value, decimals) for value in (start, regret, abs(luck_part))
        )
        return (
            f"score {format_fixed(score, decimals)} = {start_text} (average of best play) "
            f"- {regret_text} (regret) {'-' if luck_part < 0 else '+'} {luck_text} ({kind})"
        )

    @property
    def data(self) -> dict[str, object]:
        """The choices as data; facts that are not known are left out."""
        worst = self.worst and {
            "turn": self.worst.turn,
            "chosen": self.worst.chosen,
            "best": list(self.worst.best),
            "regret": self.worst.regret,
        }
        facts = {
            "choices": self.count,
            "not_judged": self.unjudged_count or None,
            "best": self.best_count,
            **self.basis.accuracy.data,
            "scope": self.basis.scope,
            "regret": self.regret,
            "expected": self.start_value,
            "luck": self.luck,
            "worst": worst,
        }
        return {name: fact for name, fact in facts.items() if fact is not None}


@dataclass(frozen=True)
class ScoreComparison:
    """The games of an agent from the same start that scored less than this game, or equal."""

    agent: str
    game_count: int
    lower_count: int
    equal_count: int = 0

    def describe(self) -> str:
        """Return the number of lower games, and that of equal ones if there are any."""
        equal_text = f" ({self.equal_count} equal)" * (self.equal_count > 0)
        return f"{self.agent_name} in {self.lower_count}{equal_text}"

    @property
    def agent_name(self) -> str:
        """The agent without its parameters."""
        return self.agent.partition(":")[0]


@dataclass(frozen=True)
class Standing:
    """The help that a game had, and the sentence on the player's record; '' if there is none."""

    aids: tuple[str, ...] = ()  # such as "2 hints"
    record: str = ""
    is_guided: bool = False  # The notes of a lesson advised the help.


NO_STANDING = Standing()


@dataclass(frozen=True)
class Verdict:
    """The verdict on a game that has ended by its rules; its parts are empty until known."""

    moves: tuple[ReviewedAction, ...] = ()
    choices: tuple[SeatChoices, ...] = ()
    comparisons: tuple[ScoreComparison, ...] = ()
    ghost_line: str = ""  # an agent's score with the same random numbers
    error: str = ""  # why the choices could not be reviewed
    medal: Medal | None = None
    standing: Standing = NO_STANDING

    @property
    def lines(self) -> list[str]:
        """The verdict in lines of text, the most important first."""
        has_several_seats = len(self.choices) > 1
        rows = [f"verdict: {self.summary}"] if self.summary else []
        aids = " and ".join(self.standing.aids)
        if aids and not self.standing.is_guided:
            would_be = f"would be {self.medal.name}; " if self.medal and self.medal.name else ""
            rows.append(f"{would_be}no medal and no record, because of {aids}")
        elif not aids:
            rows += [str(self.medal)] if self.medal else []
            rows += [self.standing.record] if self.standing.record else []
        rows += [
            row
            for choices in self.choices
            for row in choices.format_choice_lines(f"{choices.seat} " if has_several_seats else "")
        ]
        if self.comparisons:
            # An agent with the same random numbers tells more than the games of a strong one.
            compared = self.comparisons[:1] if self.ghost_line else self.comparisons
            parts = ", ".join(comparison.describe() for comparison in compared)
            games = format_count(self.comparisons[0].game_count, "game")
            rows.append(f"in {games} from the same start, you beat {parts}")
        rows += [self.ghost_line] if self.ghost_line else []
        return rows + ([f"review: {self.error}"] if self.error else [])

    @property
    def summary(self) -> str:
        """The quality of the choices and the luck, or else the rank of the score; '' if unknown."""
        if len(self.choices) == 1 and self.choices[0].regret is not None:
            return self.choices[0].describe_quality(self.medal)
        return self.medal.describe_score() if self.medal else ""

    @property
    def earned_medal(self) -> Medal | None:
        """The medal, which a game with help does not earn."""
        return None if self.standing.aids else self.medal

    @cached_property
    def marks(self) -> dict[int, str]:
        """The marks of the turns in which a choice lost much: ?? for very much, ?! for much.

        A loss is relative to the stake: the greatest difference between two actions in a turn.
        """
        stake = max((move.discounted_spread for move in self.moves), default=0.0)
        marks = dict[int, str]()
        for move in sorted(self.moves, key=lambda move: move.discounted_regret):
            for mark, share in reversed(COSTLY_MARKS):
                if _is_costly(move, share * stake):
                    marks[move.turn] = mark
        return marks

    @property
    def has_facts(self) -> bool:
        """True if there is anything to say about the score."""
        return bool(self.choices or self.comparisons)

    @property
    def data(self) -> dict[str, object]:
        """The verdict as data."""
        return {
            "seats": {choices.seat: choices.data for choices in self.choices},
            "medal": self.earned_medal and self.earned_medal.data,
            "aids": [*self.standing.aids],
            "marks": {str(turn): mark for turn, mark in sorted(self.marks.items())},
            "comparisons": [
                {
                    "agent": comparison.agent,
                    "games": comparison.game_count,
                    "lower": comparison.lower_count,
                    "equal": comparison.equal_count,
                }
                for comparison in self.comparisons
            ],
        }


def _is_costly(move: ReviewedAction, limit: float) -> bool:
    """Return whether a choice was a mistake that lost at least this much of the score."""
    return move.is_mistake and move.discounted_regret >= limit * (1.0 - RETURN_TOLERANCE)


def compute_verdict(
    session: Session,
    questions: Sequence[AdviceQuestion],
    ghost: Ghost | None = None,
    standing: Standing = NO_STANDING,
) -> Verdict:
    """Return the verdict on a game that people played to its end; else an empty one.

    There is one question for the seat of each person.

    Parts that take more than about a second are left out.
    """
    if session.end_reason not in NATURAL_END_REASONS:
        return Verdict()
    with limit_total_work(ADVICE_WORK_LIMIT):
        verdicts = [*iter_verdicts(session, questions, ghost, standing, MAX_SECONDS)]
    return verdicts[-1] if verdicts else Verdict()


def iter_verdicts(
    session: Session,
    questions: Sequence[AdviceQuestion],
    ghost: Ghost | None = None,
    standing: Standing = NO_STANDING,
    max_seconds: float | None = None,
) -> Iterator[Verdict]:
    """Yield the verdict on a finished game, each time with one part more.

    The review and the ghost take at most `max_seconds` each, the comparisons MAX_SECONDS. Yield
    nothing if no person played.
    """
    if not questions or not session.turns:
        return
    verdict = Verdict()
    with _stop_quietly_after(max_seconds):
        try:
            moves = run_review(session, questions)
            choices = assess_choices(session, questions, moves)
            verdict = Verdict(tuple(moves), choices)
        except DmplayError as error:
            verdict = Verdict(error="" if max_seconds else str(error))
    verdict = replace(verdict, standing=standing)
    yield verdict
    comparisons = run_cancellable(COMPARISON_TASK, lambda: compare_score(session, questions))
    verdict = replace(verdict, comparisons=comparisons)
    yield verdict
    medal = run_cancellable(MEDAL_TASK, lambda: find_medal(session, questions, verdict))
    verdict = replace(verdict, medal=medal)
    yield verdict
    ghost_line = ""
    with _stop_quietly_after(
        max_seconds
    ):  # Last, because it may take long, and players may skip it.
        ghost_line = describe_ghost_result(session, questions, ghost)
    yield replace(verdict, ghost_line=ghost_line)


@contextmanager
def _stop_quietly_after(seconds: float | None) -> Iterator[None]:
    """Run the block and stop it quietly after that many seconds; without a limit if None."""
    if seconds is None:
        yield
        return
    with suppress(ComputationStopped), stop_after_seconds(seconds):
        yield


def assess_choices(
    session: Session, questions: Sequence[AdviceQuestion], moves: Sequence[ReviewedAction]
) -> tuple[SeatChoices, ...]:
    """Return the choices of each person whose actions were reviewed."""
    return tuple(
        _assess_seat(session, question, own_moves)
        for question in questions
        if (
            own_moves := [
                move for move in moves if move.seat == session.problem.agents[question.seat]
            ]
        )
    )


def _assess_seat(
    session: Session, question: AdviceQuestion, moves: Sequence[ReviewedAction]
) -> SeatChoices:
    """Return the choices of one person, with regret and luck if the values are exact."""
    judged = [move for move in moves if not move.is_too_close]
    choices = SeatChoices(
        session.problem.agents[question.seat],
        len(judged),
        sum(move.chosen in move.best for move in judged),
        moves[0].basis,
        session.seat_return(question.seat),
        scale=session.problem.reward_scale,
        unjudged_count=len(moves) - len(judged),
    )
    regrets = [move.regret for move in moves if move.regret is not None]
    is_exact = len(regrets) == len(moves) and all(
        move.basis.accuracy is Accuracy.EXACT for move in moves
    )
    if not (is_exact and _are_about_game(session, question, moves[0].basis)):
        return choices
    regret = total_regret(moves)
    worst = max(moves, key=lambda move: move.discounted_regret)
    choices = replace(choices, regret=regret, worst=worst if worst.regret else None)
    if moves[0].turn > 1:
        return choices
    start_value = max(moves[0].values.values())
    choices = replace(choices, start_value=start_value)
    if not _is_luck_known(session, moves):
        return choices
    luck = choices.score - (start_value - regret)
    is_zero = abs(luck) <= RETURN_TOLERANCE * max(
        abs(start_value), abs(choices.score), choices.scale
    )
    return replace(choices, luck=0.0 if is_zero else luck)


def has_exact_verdict(session: Session, question: AdviceQuestion) -> bool:
    """Return whether the regret of a person's choices in this game will be known exactly."""
    provider = agents.find_hint_provider(session.problem, question)
    return (
        provider is not None
        and provider.basis.accuracy is Accuracy.EXACT
        and _are_about_game(session, question, provider.basis)
    )


def _are_about_game(session: Session, question: AdviceQuestion, basis: ValuesBasis) -> bool:
    """Return whether exact values are about these players and this turn limit.

    Beside other agents they must come from a model of those that play.
    """
    is_modelled = len(session.problem.agents) == 1 or bool(basis.opponents)
    return is_modelled and not (basis.scope or question.assumes_players)


def _is_luck_known(session: Session, moves: Sequence[ReviewedAction]) -> bool:
    """Return whether exact values of one agent's every turn divide its score into skill and luck.

    Rerolled random numbers are not luck.
    """
    return (
        len(session.problem.agents) == 1
        and session.end_reason in NATURAL_END_REASONS
        and [move.turn for move in moves] == [*range(1, len(session.turns) + 1)]
        and not session.reroll_counts
    )


def _describe_worst(move: ReviewedAction) -> str:
    """Return the worst choice as a sentence without its end."""
    lost = format_fixed(move.discounted_regret, move.decimal_count)
    return f"turn {move.turn}, chose {move.chosen}, not {' or '.join(move.best)}: {lost} lost"


def compare_score(
    session: Session, questions: Sequence[AdviceQuestion]
) -> tuple[ScoreComparison, ...]:
    """Return the counts of games of random play and of a strong agent that scored less or equal.

    They are games from the same start, hidden states included, with the same turn limit and other
    players; their later random numbers differ. Empty unless the game ended by its rules, the same
    players played all turns, and all people have the same reward. A comparison that takes too long
    is left out.
    """
    human_seats = [question.seat for question in questions]
    if not _is_comparable(session, questions):
        return ()
    comparisons = []
    for name, policies in _iter_compared_players(session, questions):
        with suppress(DmplayError, ComputationStopped), stop_after_seconds(MAX_SECONDS):
            counts = _count_games(session, policies, human_seats[0])
            if counts is not None:
                comparisons.append(ScoreComparison(name, COMPARED_GAMES, *counts))
    return tuple(comparisons)


def find_medal(
    session: Session, questions: Sequence[AdviceQuestion], verdict: Verdict
) -> Medal | None:
    """Return the medal of the only person, from a verdict with the review; None without values.

    Losses are about the same start, turn limit and other players. If the regret of all choices is
    known, the values of the agents are exact if they can be listed. Else they are mean scores.
    """
    if len(questions) != 1 or not _is_comparable(session, questions):
        return None
    (question,), problem = questions, session.problem
    seat = question.seat
    roster = agents.load_roster(problem, seat)
    choices = verdict.choices[0] if verdict.choices else None
    is_exact = bool(choices and choices.regret is not None and choices.count == len(session.turns))

    def value_agent(name: str) -> AgentValue | None:
        """Return the value of an agent of the roster in the person's seat; None if unknown."""
        policy = agents.load_agent(problem, seat, name)
        return _value_policy(session, seat, name, policy, is_exact=is_exact)

    random = value_agent(RANDOM_AGENT)
    if random is None:
        return None
    rule = value_agent(roster.rule_of_thumb) if roster.rule_of_thumb else None
    score, scale = session.seat_return(seat), problem.reward_scale
    if is_exact and choices:
        best = AgentValue("", max(verdict.moves[0].values.values()), is_exact=True)
        return award_medal(choices.regret or 0.0, best, rule, random, COMPARED_GAMES, scale)
    provider = agents.find_hint_provider(problem, question)
    strong, name = rule, find_compared_agent(provider) if provider else SEARCH_AGENT
    if provider and name != SEARCH_AGENT:
        is_provider = name == provider.base_name
        policy = provider.policy if is_provider else agents.load_agent(problem, seat, name)
        strong = _value_policy(session, seat, name, policy, is_exact=False) or rule
    if strong is None:
        return None
    return award_medal(strong.score - score, strong, rule, random, COMPARED_GAMES, scale)


def _value_policy(
    session: Session, seat: int, name: str, policy: Policy, *, is_exact: bool
) -> AgentValue | None:
    """Return the expected score of a policy in a seat of this game, or its mean score.

    None if it takes too long, or if games go on that may still score more.
    """
    problem = session.problem
    policies = [
        policy if index == seat else cast(SeatedPolicy, seated).policy
        for index, seated in enumerate(session.seated_policies)
    ]
    with suppress(DmplayError, ComputationStopped), stop_after_seconds(MAX_SECONDS):
        starts = _list_starts(session, seat) if is_exact else None
        score = starts and compute_expected_return(
            problem, policies, seat, session.turn_limit, starts
        )
        if score is not None:
            return AgentValue(name, score, is_exact=True)
    with suppress(DmplayError, ComputationStopped), stop_after_seconds(MAX_SECONDS):
        has_other_starts = is_exact and problem.partially_observable
        games = _play_games(
            session, policies, MAX_COMPARED_TURNS, has_same_start=not has_other_starts
        )
        can_only_fall = problem.reward_bounds is not None and problem.reward_bounds[1] <= 0.0
        has_same_limit = (session.turn_limit or math.inf) <= MAX_COMPARED_TURNS
        if has_same_limit or can_only_fall or games.terminated.all():
            scores = games.returns[:, seat]
            error = float(scores.std(ddof=1)) / math.sqrt(len(scores))
            return AgentValue(name, float(scores.mean()), is_exact=False, error=error)
    return None


def _list_starts(session: Session, seat: int) -> tuple[Array, Reals]:
    """Return the start as the seat knows it: states `[K, ...]` and probabilities `[K]`."""
    problem, start = session.problem, session.initial_state[None]
    if not problem.partially_observable:
        return start, np.ones(1)
    probabilities, states = initial_state_distribution(problem)
    observation = make_initial_observation(problem, start, seat)
    is_possible = make_initial_observation(problem, states, seat) == observation
    weights = probabilities * is_possible
    return states, weights / weights.sum()


def _is_comparable(session: Session, questions: Sequence[AdviceQuestion]) -> bool:
    """Return whether agents can play many games as this one, to be compared with its score."""
    problem, human_seats = session.problem, [question.seat for question in questions]
    if any(question.earlier_turns for question in questions):
        return False
    has_common_reward = len(human_seats) == 1 or problem.shared_reward
    others = [seated.policy for seated in session.seated_policies if seated]
    is_repeatable = not any(
        names_bot(name) or name.partition(":")[0] in UNREPEATABLE_PLAYERS
        for name in questions[0].players
    ) and not any(getattr(policy, "depends_on_clock", False) for policy in others)
    return session.end_reason in NATURAL_END_REASONS and has_common_reward and is_repeatable


def find_compared_agent(provider: agents.HintAgent) -> str:
    """Return the agent whose scores are compared with a person's: a hint agent or a quicker one."""
    policy = provider.policy
    substitute = agents.load_roster(policy.problem, policy.seat).batch_agent
    is_exact = provider.basis.accuracy in {Accuracy.EXACT, Accuracy.CONDITIONAL}
    is_quick = is_exact or not substitute
    return provider.base_name if is_quick else cast(str, substitute)


def _iter_compared_players(
    session: Session, questions: Sequence[AdviceQuestion]
) -> Iterator[tuple[str, list[Policy]]]:
    """Yield an agent's name and the policies of all seats with that agent in people's seats.

    These are the random agent, then the agent that gives hints, or its quicker substitute.
    """
    problem = session.problem
    seated = [seated_policy and seated_policy.policy for seated_policy in session.seated_policies]

    def fill_seats(by_seat: dict[int, Policy]) -> list[Policy]:
        """Return the policies of all seats, with these in people's seats."""
        return [by_seat.get(seat) or cast(Policy, policy) for seat, policy in enumerate(seated)]

    yield (
        RANDOM_AGENT,
        fill_seats(
            {
                question.seat: agents.load_agent(problem, question.seat, RANDOM_AGENT)
                for question in questions
            }
        ),
    )
    strong: dict[int, Policy] = {}
    label = ""
    for question in questions:
        seat = question.seat
        provider = agents.find_hint_provider(problem, question)
        if provider is None:
            return
        label = find_compared_agent(provider)
        strong[seat] = (
            provider.policy
            if label == provider.base_name
            else agents.load_agent(problem, seat, label)
        )
    if label != SEARCH_AGENT:
        yield label, fill_seats(strong)


def _count_games(session: Session, policies: Sequence[Policy], seat: int) -> tuple[int, int] | None:
    """Count the games of these policies that score less than this game, and those that score equal.

    None if a game goes on after MAX_COMPARED_TURNS and might still score more.
    """
    problem, score = session.problem, session.seat_return(seat)
    # Without positive rewards, the return of a game that goes on can only fall.
    can_only_fall = problem.reward_bounds is not None and problem.reward_bounds[1] <= 0.0
    for turn_count in [*[len(session.turns) + 1] * can_only_fall, MAX_COMPARED_TURNS]:
        games = _play_games(session, policies, turn_count)
        difference = games.returns[:, seat] - score
        tolerance = RETURN_TOLERANCE * max(abs(score), problem.reward_scale)
        is_lower = difference < -tolerance
        is_decided = games.terminated | (is_lower & can_only_fall)
        has_same_limit = session.turn_limit is not None and session.turn_limit <= turn_count
        if has_same_limit or is_decided.all():
            return int(is_lower.sum()), int((np.abs(difference) <= tolerance).sum())
    return None


def _play_games(
    session: Session, policies: Sequence[Policy], turn_count: int, *, has_same_start: bool = True
) -> "Rollout":
    """Play COMPARED_GAMES of at most so many turns, from the start of this game or from any."""
    from dmplay.simulation.rollouts import rollout  # imported only if a person finished a game

    return rollout(
        session.problem,
        policies,
        episodes=COMPARED_GAMES,
        turn_limit=min(session.turn_limit or turn_count, turn_count),
        seed=COMPARISON_SEED,
        keep=("returns", "terminated"),
        start_uniforms=session.initial_uniforms if has_same_start else None,
    )
