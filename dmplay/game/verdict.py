"""The verdict on a finished game: the result, the quality of the choices, luck and comparisons.

Every number is about the game that was played: its players, its turn limit and the information of
each seat.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.session import Session
from dmplay.core.text import format_count, join_words
from dmplay.core.work_budget import ComputationStopped, limit_total_work, stop_after_seconds
from dmplay.errors import DmplayError
from dmplay.game.background_tasks import TaskInfo, run_cancellable
from dmplay.game.hints.ghost_agent import Ghost, play_ghost
from dmplay.game.hints.hint_provider import TOO_CLOSE, choose_decimals, format_fixed
from dmplay.game.hints.review import (
    NOT_JUDGED,
    ReviewedAction,
    append_game,
    list_costly_choices,
    run_review,
    total_regret,
)
from dmplay.game.medals import Medal
from dmplay.game.position import ADVICE_WORK_LIMIT
from dmplay.game.score_comparison import RETURN_TOLERANCE, ScoreComparer, ScoreComparison
from dmplay.registry import agents
from dmplay.transcript.format import NATURAL_END_REASONS

MAX_SECONDS = 1.0  # seconds of processor time of each part of a verdict that nobody waits for
COMPARISON_TASK = TaskInfo(
    "comparing your score with other games", is_after_game=True, delays_quit=True
)
AVERAGE_LUCK = 0.1  # of the regret of careless play: less luck is not named
CHOICE_WORDS = {"gold": "excellent choices", "silver": "good choices", "bronze": "fair choices"}
GOOD_WORDS = ("perfect", "excellent", "good")  # before `choices`
MIN_ROUNDED_ESTIMATE = 10.0  # losses that are estimates and at least this have no decimals
COSTLY_MARKS = (("??", 0.5), ("?!", 0.2))  # marks, and the share of the stake lost from which on


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
    near_count: int = 0  # other choices that lost so little that they count as right
    has_hidden_states: bool = False
    others: tuple[str, ...] = ()  # the other players, whose choices are luck to this one

    def name_worst_choice(self, costly: Sequence[ReviewedAction]) -> "SeatChoices":
        """Return the choices with the seat's costliest one as the worst, if the regret is known."""
        seat_moves = [move for move in costly if move.seat == self.seat]
        if self.regret is None or not seat_moves:
            return self
        return replace(self, worst=max(seat_moves, key=lambda move: move.loss))

    def format_choice_lines(self, prefix: str = "") -> list[str]:
        """Return a line on the choices; with exact values also one each on luck and worst turn.

        Each line begins with the prefix.
        """
        nearly = "or nearly best " * (self.near_count > 0)
        right_count, times = self.best_count + self.near_count, format_count(self.count, "time")
        share = f"best {nearly}action {right_count} of {times}"
        if self.regret is None:
            # ratings are not called points here
            name, _, _ = self.basis.accuracy.words.partition(",")
            text = append_game(name, self.basis.scope)
            if self.basis.scope and not self.basis._replace(ignores_turn_limit=False).scope:
                text = f"{name}, which ignore the turn limit"
            if self.basis.accuracy.is_bound:
                line = f"not judged, because only {text} of their values are known"
                return [f"{prefix}choices: {line}"]
            if not self.count:
                return [f"{prefix}choices: none is judged, their values are {TOO_CLOSE}"]
            parts = [f"{share} by the {text}"]
            parts += [f"{self.unjudged_count} {NOT_JUDGED}"] * bool(self.unjudged_count)
            if self.basis.accuracy is Accuracy.RATING:  # how much a lower rating costs is not known
                parts = [] if self.worst else ["no action was clearly rated higher"]
            parts += [f"worst: {_describe_worst(self.worst)}"] if self.worst else []
            return [f"{prefix}choices: {'; '.join(parts)}"]
        numbers = [self.regret, self.luck or 0.0, self.start_value or 0.0]
        decimals = choose_decimals(numbers, self.scale)
        regret_text = format_fixed(self.regret, decimals)
        then = ", by what you knew then" * self.has_hidden_states
        worst = f"worst: {_describe_worst(self.worst)}{then}" if self.worst else ""
        if self.luck is not None and self.start_value is not None:
            explanation = self._explain_score(self.start_value, self.luck, decimals)
            lines = [f"choices: {'; '.join(filter(None, [share, worst]))}"]
            lines += [explanation] if self.regret or self.luck else []
            return [f"{prefix}{line}" for line in lines]
        cost = f"; on average they lost {regret_text} (the regret)" * (self.regret > 0)
        if self.start_value is not None:
            cost += f"; best play averages {format_fixed(self.start_value, decimals)}"
        return [f"{prefix}choices: {share}{cost}", *[f"{prefix}{worst}"] * bool(worst)]

    def describe_quality(self, medal: Medal | None) -> str:
        """Return the quality of choices with a known regret, and the luck; '' if unknown.

        The medal says how good they are.
        """
        if self.regret is None:
            return ""
        words, luck = "", ""
        if medal and medal.limits:
            words = CHOICE_WORDS.get(medal.name, f"choices no better than {medal.random}")
            luck = self._describe_luck(medal.limits["bronze"][0])
        if self.best_count == self.count:
            words = "perfect choices"
        return ", ".join(filter(None, [words, luck and f"{luck} luck"]))

    def _describe_luck(self, stake: float) -> str:
        """Return the word before `luck`; '' if there was hardly any, or if it is not known."""
        if not self.luck or abs(self.luck) < AVERAGE_LUCK * stake:
            return ""
        return "good" if self.luck > 0 else "bad"

    def _explain_score(self, start_value: float, luck: float, decimals: int) -> str:
        """Return the score as the sum of its parts, which add up as printed.

        The rounding error is added to the luck, or to the start value if there is no luck.
        """
        score, regret = round(self.score, decimals), round(self.regret or 0.0, decimals)
        start = round(start_value if luck else score + regret, decimals)
        luck_part = score - start + regret
        text = f"score {format_fixed(score, decimals)} = best play's average "
        text += format_fixed(start, decimals)
        if self.regret:
            text += f" - your choices {format_fixed(regret, decimals)}"
        if luck:
            sign, amount = "-" if luck_part < 0 else "+", format_fixed(abs(luck_part), decimals)
            names = [f"{name}'s" for name in self.others]
            others = f", {join_words(names)} choices included" if names else ""
            text += f" {sign} luck {amount}{others}"
        return text

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
    matched_ghost: str = ""  # the agent, if the person scored as much as it did
    leader: str = ""  # another player who scored more, in a game that is not about that
    limit_turns: int = 0  # turns of a game that its turn limit ended
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
            rows.append(f"{would_be}no medal and no record, because of {aids}; a new game counts")
        elif not aids:
            rows += [self._describe_medal(self.medal)] if self.medal else []
            rows += [self.standing.record] if self.standing.record else []
        has_effect = not (self._is_score_fixed or (self.medal and not self.medal.limits))
        rows += [
            row
            for choices in self.choices
            if choices.count or has_effect
            for row in choices.format_choice_lines(f"{choices.seat} " if has_several_seats else "")
        ]
        explains_score = any(choices.luck is not None for choices in self.choices)
        if self.comparisons and not explains_score:
            # An agent with the same random numbers tells more than the games of a strong one.
            compared = self.comparisons[:1] if self.ghost_line else self.comparisons
            rows.append("; ".join(comparison.describe() for comparison in compared))
        rows += [self.ghost_line] if self.ghost_line else []
        return rows + ([f"review: {self.error}"] if self.error else [])

    @property
    def summary(self) -> str:
        """The quality of the choices and the luck, or else the rank of the score; '' if unknown."""
        if len(self.choices) == 1 and self.choices[0].regret is not None:
            words = self.choices[0].describe_quality(self.medal)
            if words and self.leader and words.partition(" ")[0] in GOOD_WORDS:
                words += f"; your aim is a high score, and not to have more than {self.leader}"
            if words:
                return words
        if self._is_score_fixed:
            period = f"in {format_count(self.limit_turns, 'turn')}" if self.limit_turns else "here"
            return f"{period} no choice changes the score"
        if self.medal and self.medal.loss > 0 and self.matched_ghost == self.medal.best.agent != "":
            return f"score as good as that of {self.matched_ghost} in the same game"
        return self.medal.describe_score(self.limit_turns) if self.medal else ""

    @property
    def _is_score_fixed(self) -> bool:
        """True if random play and the best agent always score what the person did."""
        counts = {comparison.game_count - comparison.equal_count for comparison in self.comparisons}
        return counts == {0} and self.medal is not None and not self.medal.limits

    def _describe_medal(self, medal: Medal) -> str:
        """Return the medal as a line that explains no rule that the summary explains."""
        text = str(medal)
        for agent in (medal.rule, medal.random):
            if agent and agent.explanation and f"{agent}" in self.summary:
                text = text.replace(agent.explanation, "")
        return text

    @property
    def _stake(self) -> float:
        """The loss that limits the lowest medal; 0 if it is not known."""
        return self.medal.limits.get("bronze", (0.0, ""))[0] if self.medal else 0.0

    @property
    def earned_medal(self) -> Medal | None:
        """The medal, which a game with help does not earn."""
        return None if self.standing.aids else self.medal

    @cached_property
    def costly_choices(self) -> list[ReviewedAction]:
        """The choices that lost so much that they are worth another look.

        If none did, they are those that together cost a gold medal.
        """
        costly = list_costly_choices(self.moves)
        is_short_of_gold = self.medal and self.medal.best.is_exact and not self.medal.is_best
        return costly or [move for move in self.moves if is_short_of_gold and move.loss > 0]

    @cached_property
    def marks(self) -> dict[int, str]:
        """The marks of the turns in which a choice lost much: ?? for very much, ?! for much.

        A loss is relative to the stake: the largest of the loss for the lowest medal, the loss in
        all turns, and the greatest difference between two actions in a turn.
        """
        spread = max((move.discounted_spread for move in self.moves), default=0.0)
        lost = sum(move.discounted_regret for move in self.costly_choices)
        stake = max(self._stake, lost, spread)
        marks = dict[int, str]()
        for move in sorted(self.costly_choices, key=lambda move: move.discounted_regret):
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
    limit_turns = len(session.turns) if session.end_reason == "turn limit" else 0
    verdict = replace(
        verdict,
        standing=standing,
        limit_turns=limit_turns,
        leader=_find_leader(session, questions[0].seat) if len(questions) == 1 else "",
    )
    yield verdict
    comparer = ScoreComparer(session, questions)
    if comparer.is_possible:
        verdict = run_cancellable(COMPARISON_TASK, lambda: _compare_score(verdict, comparer))
        yield verdict
    opponent, line = None, ""
    with _stop_quietly_after(
        max_seconds
    ):  # Last, because it may take long, and players may skip it.
        opponent = play_ghost(session, questions, ghost)
        line = opponent.describe_comparison() if opponent else ""
    if opponent and line:
        tolerance = RETURN_TOLERANCE * max(abs(opponent.score), session.problem.reward_scale)
        matched = opponent.name * (opponent.player_lead >= -tolerance)
        verdict = replace(verdict, ghost_line=line, matched_ghost=matched)
    yield verdict


def _find_leader(session: Session, seat: int) -> str:
    """Return the player who scored more than a seat; '' if there is none.

    Only players of repeated rounds are compared, and not if the rewards of every round have the
    same sum: there, to lead is the aim.
    """
    if session.problem.state_count != 1 or session.problem.shared_reward:
        return ""
    returns = session.returns()
    best = int(np.argmax(returns))
    sums = [float(np.sum(turn.rewards)) for turn in session.turns]
    tolerance = RETURN_TOLERANCE * session.problem.reward_scale
    is_contest = max(sums) - min(sums) <= tolerance
    is_behind = returns[best] > returns[seat] + tolerance
    return session.problem.agents[best] * bool(is_behind and not is_contest)


def _compare_score(verdict: Verdict, comparer: ScoreComparer) -> Verdict:
    """Return a verdict with the comparisons and the medal."""
    choices = verdict.choices[0] if verdict.choices else None
    is_complete = choices and choices.count == len(comparer.session.turns)
    regret = choices.regret if choices and is_complete else None
    start_value = max(verdict.moves[0].values.values()) if verdict.moves else 0.0
    medal = comparer.find_medal(regret, start_value)
    verdict = replace(verdict, comparisons=comparer.compare_score(), medal=medal)
    seats = tuple(seat.name_worst_choice(verdict.costly_choices) for seat in verdict.choices)
    return replace(verdict, choices=seats)


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
        has_hidden_states=session.problem.partially_observable,
        others=tuple(
            name
            for name, seated in zip(session.problem.agents, session.seated_policies, strict=True)
            if seated
        ),
        unjudged_count=len(moves) - len(judged),
        near_count=sum(
            move.chosen not in move.best and move.regret is not None and not move.is_mistake
            for move in judged
        ),
    )
    regrets = [move.regret for move in moves if move.regret is not None]
    worst = max(list_costly_choices(moves), key=lambda move: move.loss, default=None)
    is_exact = len(regrets) == len(moves) and all(
        move.basis.accuracy is Accuracy.EXACT for move in moves
    )
    if not (is_exact and _are_about_game(session, question, moves[0].basis)):
        is_judged = moves[0].basis.accuracy in {Accuracy.ESTIMATED, Accuracy.RATING}
        is_alone = len(session.problem.agents) == 1
        is_about_game = is_judged and (is_alone or not moves[0].basis.assumed_players)
        return replace(choices, worst=worst if is_about_game else None)
    regret = total_regret(moves)
    choices = replace(choices, regret=regret, worst=worst)
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
    """Return whether exact values of an agent's every turn divide its score into skill and luck.

    The choices of other players, which the values expect, are luck. Rerolled random numbers are
    not.
    """
    return (
        session.end_reason in NATURAL_END_REASONS
        and [move.turn for move in moves] == [*range(1, len(session.turns) + 1)]
        and not session.reroll_counts
    )


def _describe_worst(move: ReviewedAction) -> str:
    """Return the worst choice as a sentence without its end."""
    text = f"turn {move.turn}, chose {move.chosen}, not {' or '.join(move.best)}"
    if move.basis.accuracy is Accuracy.RATING:
        return f"{text}, which is rated higher"
    lost, about = move.discounted_regret, ""
    decimals = max(move.decimal_count, choose_decimals([lost], move.scale))
    if move.basis.accuracy.is_estimate:
        about, decimals = "about ", 0 if lost >= MIN_ROUNDED_ESTIMATE else decimals
    share = " of the score" * (move.discount_factor < 1.0)
    return f"{text}: {about}{format_fixed(lost, decimals)}{share} lost"
