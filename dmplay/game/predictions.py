"""Predictions that a person types before each outcome is shown, and their scores.

A question is asked after the action is chosen and before the turn is played. The answer to a
question on a belief or a value is known then; that to a question on an outcome after the turn.
"""

from collections.abc import Callable
from math import isfinite
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import AdviceQuestion
from dmplay.core.arrays import Reals
from dmplay.core.problem import ContinuousStates, Problem
from dmplay.core.session import Session, Turn, check_has_belief
from dmplay.core.spaces import Labels
from dmplay.core.text import format_count, format_number, format_score
from dmplay.core.typed_text import list_state_names, parse_belief
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.game.position import Position

BELIEF, OUTCOME, VALUE = "belief", "outcome", "value"
PREDICTION_KINDS = (BELIEF, OUTCOME, VALUE)
STATED = "stated belief"  # no prediction: the belief of the person before its action
SKIP_WORD = "skip"
MAX_FIXED_STATES = 4  # up to so many states, the questions are about the last one
GUESS = 0.5  # a probability that says nothing, to compare with


class Question(NamedTuple):
    """A question about the outcome of an action that is chosen but not played yet."""

    turn: int
    action: float
    text: str
    subject: str  # the quantity that is asked for; "" for an outcome
    truth: float | None  # None until the turn is played
    truth_note: str = ""  # how accurate the truth is, in brackets


class Answer(NamedTuple):
    """A typed prediction: a number, and the outcome whose probability it is."""

    number: float
    outcome: str = ""


class ScoredPrediction(NamedTuple):
    """A prediction with the truth and its score."""

    turn: int
    subject: str
    predicted: float
    truth: float
    score: float
    text: str  # both numbers and the score in a sentence
    note: str = ""

    @property
    def data(self) -> dict[str, object]:
        """The prediction as data."""
        return {
            "turn": self.turn,
            "subject": self.subject,
            "predicted": self.predicted,
            "truth": self.truth,
            "score": self.score,
        }


class Predictor:
    """The questions about one seat's outcomes, the answers and their scores."""

    noun, verb = "prediction", "predicts"  # in the prompt, and of the Enter key

    def __init__(self, option: str, session: Session, seat: int, provider: HintProvider) -> None:
        self.kind, _, state_text = option.partition(":")
        self._session, self._seat = session, seat
        self.question: Question | None = None
        self.scored: list[ScoredPrediction] = []
        self._answer: Answer | None = None
        self._answered_question: Question | None = None
        self._last_turn = 0  # last turn about which a question was asked
        self._state = _check_belief_kind(self.kind, state_text, session, seat, provider)

    def ask(self, action: float, provider: HintProvider) -> Question | None:
        """Return the question about an action, which then waits for an answer.

        None if there is nothing to ask: the turn was asked about before it was undone, or the
        action has no value.
        """
        turn = len(self._session.turns) + 1
        if turn <= self._last_turn:
            return None
        action = self._session.validate_action(self._seat, action)
        make_question: dict[str, Callable[[], Question | None]] = {
            BELIEF: lambda: self._ask_for_belief(turn, action),
            OUTCOME: lambda: self._ask_for_outcome(turn, action),
            VALUE: lambda: self._ask_for_value(turn, action, provider),
        }
        self.question = make_question[self.kind]()
        return self.question

    def cancel(self) -> None:
        """Take back the question, and the action that it is about."""
        self.question = None

    def answer(self, text: str) -> float:
        """Store a typed prediction, and return the action to play; an empty text skips it.

        Raise BadParameter for an invalid prediction, which leaves the question open.
        """
        question = self.question
        assert question is not None
        is_skipped = text.strip().lower() in {"", SKIP_WORD}
        self._answer = None if is_skipped else self._parse_answer(text.strip())
        self._answered_question, self.question = question, None
        self._last_turn = question.turn
        return question.action

    def score_turn(self, turn: Turn) -> "ScoredPrediction | EchoedBelief | None":
        """Return the score of the prediction about the turn just played; None if there is none."""
        question, answer = self._answered_question, self._answer
        self._answered_question = self._answer = None
        if question is None or answer is None or question.turn != len(self._session.turns):
            return None
        scored = (
            self._score_outcome(question, answer, turn)
            if question.truth is None
            else self._score_number(question, answer.number, question.truth)
        )
        self.scored.append(scored)
        return scored

    # Questions

    def _ask_for_belief(self, turn: int, action: float) -> Question | None:
        """Return a question on the probability of a state after one of the observations.

        The observations take turns, so that unlikely ones come up too.
        """
        problem = self._session.problem
        question = AdviceQuestion.of_session(self._session, self._seat)
        forecast = Position.with_agent(self._session, question, None).forecast(action)
        assert forecast.beliefs is not None
        row = (turn - 1) % len(forecast.outcomes)
        belief = self._session.view(self._seat).belief
        is_fixed = self._state is None and len(belief) <= MAX_FIXED_STATES
        state = len(belief) - 1 if is_fixed else self._state
        if state is None:
            state = int(belief.argmax())
        observation = problem.observations[self._seat].format_observation(forecast.outcomes[row])
        name = problem.format_state(problem.enumerate_states()[state])
        label = self._session.format_action(self._seat, action)
        subject = f"P({name}) if {observation} follows {label}"
        others = ", if all others act at random" * (len(problem.agents) > 1)
        return Question(
            turn,
            action,
            f"predict {subject}{others}, from 0 to 1; Enter skips",
            subject,
            float(forecast.beliefs[row, state]),
        )

    def _ask_for_outcome(self, turn: int, action: float) -> Question:
        """Return a question on the next observation, state, or action of the other agents."""
        problem, seat = self._session.problem, self._seat
        if problem.partially_observable:
            labels = problem.observations[seat]
            assert isinstance(labels, Labels)
            thing, example = "the next observation", labels[0]
        elif problem.state_count == 1:
            other = 1 - seat
            thing = f"the action of {problem.agents[other]}"
            example = problem.actions[other].labels[0]
        else:
            thing, example = "the next state", problem.format_state(self._session.state)
        return Question(
            turn,
            action,
            f"predict for your choice {self._session.format_action(seat, action)} {thing} and its "
            f"probability, such as {example} 0.5; Enter skips",
            "",
            None,
        )

    def _ask_for_value(self, turn: int, action: float, provider: HintProvider) -> Question | None:
        """Return a question on the expected return of the action; None if it has no value."""
        name = self._session.format_action(self._seat, action)
        truth = provider.values_by_action().get(name)
        if truth is None:
            return None
        subject = f"the value of {name}"
        about = ", ".join(
            filter(None, (provider.values_basis.accuracy.words, provider.describe_game()))
        )
        return Question(
            turn,
            action,
            f"predict {subject}, its expected return from this turn on; Enter skips",
            subject,
            truth,
            f" ({about})",
        )

    # Answers

    def _parse_answer(self, text: str) -> Answer:
        """Return a typed prediction; raise BadParameter if it is invalid."""
        if self.kind != OUTCOME:
            return Answer(_parse_number(text, is_probability=self.kind == BELIEF))
        name, _, number = text.rpartition(" ")
        if not name.strip():
            raise BadParameter(
                f"got {text!r}, expected an outcome and its probability; Enter skips"
            )
        probability = _parse_number(number, is_probability=True)
        return Answer(probability, _parse_outcome(self._session, self._seat, name.strip()))

    # Scores

    def _score_outcome(self, question: Question, answer: Answer, turn: Turn) -> ScoredPrediction:
        """Return the Brier score of the probability of an outcome."""
        outcome = format_outcome(self._session.problem, self._seat, turn)
        happened = float(outcome == answer.outcome)
        score = (answer.number - happened) ** 2
        verb = f"{outcome} happened, as you predicted" if happened else f"{outcome} happened"
        text = (
            f"{verb}; you gave {answer.outcome} {answer.number:g}: Brier score {score:.3f} "
            f"({self._describe_mean('mean', score)})."
        )
        note = f"outcome {answer.outcome} {answer.number:g}, happened {outcome}, Brier {score:.3f}"
        return ScoredPrediction(
            question.turn, answer.outcome, answer.number, happened, score, text, note
        )

    def _score_number(self, question: Question, predicted: float, truth: float) -> ScoredPrediction:
        """Return the squared error of a probability, or the absolute error of a value."""
        is_value = self.kind == VALUE
        score = abs(predicted - truth) if is_value else (predicted - truth) ** 2
        score_text = f"{'off by' if is_value else 'squared error'} {score:.3f}"
        truth_text = format_score(truth) if is_value else f"{truth:.3f}"
        text = (
            f"{question.subject} is {truth_text}{question.truth_note}; you said {predicted:g}: "
            f"{score_text} ({self._describe_mean('mean', score)})."
        )
        note = f"{question.subject} {predicted:g}, truth {truth_text}, {score_text}"
        return ScoredPrediction(
            question.turn, question.subject, predicted, truth, score, text, note
        )

    def _describe_mean(self, name: str, score: float) -> str:
        """Return the mean of all scores with a new one, as text."""
        scores = [*(item.score for item in self.scored), score]
        return f"{name} of {len(scores)}: {np.mean(scores):.3f}"

    @property
    def summary(self) -> str:
        """The number of predictions, their mean score, and their calibration; '' if none."""
        if not self.scored:
            return ""
        count = format_count(len(self.scored), "prediction")
        mean = float(np.mean([item.score for item in self.scored]))
        if self.kind == VALUE:
            return f"{count}: mean absolute error {mean:.3f}"
        truths = np.array([item.truth for item in self.scored])
        guess = float(np.mean((GUESS - truths) ** 2))
        name = "mean Brier score" if self.kind == OUTCOME else "mean squared error"
        text = f"{count}: {name} {mean:.3f}; always saying 0.5 scores {guess:.3f}"
        if self.kind == OUTCOME:
            mean_prediction = float(np.mean([item.predicted for item in self.scored]))
            happened = f"{truths.sum():.0f} of {len(truths)} happened"
            text += f"; you said {mean_prediction:.2f} on average, and {happened}"
        return text

    @property
    def data(self) -> dict[str, object]:
        """The summary as data."""
        scores = [item.score for item in self.scored]
        mean = float(np.mean(scores)) if scores else None
        return {"kind": self.kind, "count": len(scores), "mean_score": mean}

    def pop_stated_belief(self) -> Reals | None:
        """Return the belief `[S]` that was typed since the last call; None for a prediction."""
        return None


class EchoedBelief(NamedTuple):
    """A belief that a person stated, repeated after the turn."""

    turn: int
    stated: dict[str, float]
    note: str = ""  # the transcript has the belief as a line of the turn

    @property
    def text(self) -> str:
        """The probabilities above 0 in a sentence."""
        pairs = (f"{name} {format_number(p)}" for name, p in self.stated.items() if p)
        return f"you stated the belief {', '.join(pairs)}."

    @property
    def data(self) -> dict[str, object]:
        """The belief as data."""
        return {**self._asdict(), "note": self.text}


class BeliefPrompt(Predictor):
    """The question about one seat's belief, asked after each choice of its player."""

    noun, verb = "belief", "states it"

    def __init__(self, session: Session, seat: int) -> None:
        check_has_belief(session)
        self.kind, self.question = STATED, None
        self._session, self._seat = session, seat
        self._names = list_state_names(session.problem)
        self._typed: Reals | None = None
        self._count = 0

    def ask(self, action: float, provider: HintProvider) -> Question:
        """Return the question about the player's belief before an action."""
        turn = len(self._session.turns) + 1
        action = self._session.validate_action(self._seat, action)
        first, *_, last = self._names
        example = f"{first}=0.3 {last}=0.7"
        chosen = self._session.format_action(self._seat, action)
        text = f"you chose {chosen}: state the probability of each state, such as {example}; "
        text += "Enter skips"
        self.question = Question(turn, action, text, "", None)
        return self.question

    def answer(self, text: str) -> float:
        """Store a typed belief, and return the action to play; an empty text states none.

        Raise BadParameter for an invalid belief, which leaves the question open.
        """
        assert self.question is not None
        is_skipped = text.strip().lower() in {"", SKIP_WORD}
        self._typed = None if is_skipped else parse_belief(self._session.problem, text)
        action, self.question = self.question.action, None
        return action

    def pop_stated_belief(self) -> Reals | None:
        """Return the belief `[S]` that was typed since the last call, if any."""
        typed, self._typed = self._typed, None
        return typed

    def score_turn(self, turn: Turn) -> EchoedBelief | None:
        """Return the belief that was stated in the turn just played, if any."""
        belief = turn.stated_beliefs.get(self._seat)
        if belief is None:
            return None
        stated = dict(zip(self._names, belief.tolist(), strict=True))
        return EchoedBelief(len(self._session.turns), stated)

    @property
    def summary(self) -> str:
        """An empty text: the beliefs have no score while the game is played."""
        return ""

    @property
    def data(self) -> dict[str, object]:
        """The number of stated beliefs."""
        turns = self._session.turns
        return {"kind": STATED, "count": sum(self._seat in t.stated_beliefs for t in turns)}


def format_outcome(problem: Problem, seat: int, turn: Turn) -> str:
    """Return the outcome of a turn that a seat sees: an observation, actions, or the state."""
    if problem.partially_observable:
        return problem.observations[seat].format_observation(turn.observations[seat])
    if problem.state_count == 1:
        return problem.format_action(1 - seat, turn.actions[1 - seat])
    return problem.format_state(turn.state)


def _parse_number(text: str, *, is_probability: bool) -> float:
    """Return a typed number; raise BadParameter unless it is finite, and from 0 to 1 if needed."""
    expected = "a probability from 0 to 1" if is_probability else "a number"
    try:
        number = float(text)
    except ValueError:
        raise BadParameter(f"got {text!r}, expected {expected}; Enter skips") from None
    if not isfinite(number) or (is_probability and not 0.0 <= number <= 1.0):
        raise BadParameter(f"got {text!r}, expected {expected}; Enter skips")
    return number


def _parse_outcome(session: Session, seat: int, name: str) -> str:
    """Return the name of a typed outcome; raise BadParameter or UnknownName for any other text."""
    problem = session.problem
    if problem.partially_observable or problem.state_count == 1:
        space = (
            problem.observations[seat]
            if problem.partially_observable
            else problem.actions[1 - seat].labels
        )
        assert isinstance(space, Labels)
        noun = "observation" if problem.partially_observable else "action"
        by_name = {label.lower(): label for label in space}
        if name.lower() not in by_name:
            raise UnknownName(noun, name, space)
        return by_name[name.lower()]
    try:
        return problem.format_state(problem.parse_state(name))
    except (DmplayError, ValueError, LookupError):
        example = problem.format_state(session.state)
        raise BadParameter(f"got {name!r}, expected a state such as {example}") from None


def _check_belief_kind(
    kind: str, state_text: str, session: Session, seat: int, provider: HintProvider
) -> int | None:
    """Return the state that questions on a belief are about, None if none is named.

    Raise BadParameter if predictions of this kind are not possible in the game.
    """
    problem = session.problem
    if kind not in PREDICTION_KINDS:
        raise UnknownName("prediction", kind, PREDICTION_KINDS)
    if state_text and kind != BELIEF:
        raise BadParameter(f"--predict {kind}: got {state_text!r}, expected nothing after {kind}")
    if kind == BELIEF:
        if session.view(seat).beliefs is None:
            raise BadParameter("--predict belief: this problem has no belief over hidden states")
        if not state_text:
            return None
        names = [problem.format_state(state) for state in problem.enumerate_states()]
        if state_text not in names:
            raise UnknownName("state", state_text, names)
        return names.index(state_text)
    if kind == OUTCOME:
        _check_outcomes_have_names(problem, seat)
    elif provider.explain_unavailable() or not provider.values_by_action():
        raise BadParameter("--predict value: no agent computes action values in this game")
    return None


def _check_outcomes_have_names(problem: Problem, seat: int) -> None:
    """Raise BadParameter if a person cannot type the outcomes of this problem."""
    if problem.partially_observable:
        has_names = isinstance(problem.observations[seat], Labels)
    elif problem.state_count == 1:
        has_names = len(problem.agents) == 2 and bool(problem.actions[1 - seat].labels)
    else:
        has_names = not isinstance(problem.state_count, ContinuousStates)
    if not has_names:
        raise BadParameter("--predict outcome: the outcomes of this problem have no names to type")
