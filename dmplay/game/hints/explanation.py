"""Explanations of hints: a few short sentences made from the parts of an action's value."""

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.problem import ContinuousStates
from dmplay.core.session import Session
from dmplay.core.text import count_probability_decimals, format_score, join_words
from dmplay.game.action_breakdown import (
    END_PREFIX,
    ActionBreakdown,
    PossibleOutcome,
    compute_outcome_shares,
)
from dmplay.game.hints.hint_provider import Hint, HintProvider, format_fixed
from dmplay.game.hints.reasons import list_reasons
from dmplay.game.hints.rule_explanation import explain_by_simulation, format_real_action
from dmplay.game.rules_of_thumb import RuleChoice, find_losing_rule
from dmplay.views.protocol import load_view_module

MAX_LISTED_OUTCOMES = 3  # maximum number of outcomes that are listed one by one
MAX_OUTCOME_CHARS, MAX_OUTCOME_WORDS = 32, 4  # longer names of outcomes are left out
SURE_PROBABILITY = 0.9995  # a probability that is printed as certain
MAJOR_SHARE = 0.5  # share of a difference that one reason must explain
CLOSE_RATING_SHARE = 1e-3  # ratings that differ by a smaller share are called nearly equal
MIN_LEAD = 1e-9  # smaller leads of a probability over the next one are rounding errors
MIN_BELIEF_CHANGE = 0.005  # smaller changes of a probability are not mentioned
SAME_BELIEF = 1e-9  # smaller changes of a probability are rounding errors
MAX_SENTENCE_WORDS = 25
STATE_PREFIX = " in the state "
RUNNER_UP = RuleChoice(-1, "the next best")
VALUE_WORDS = {
    Accuracy.EXACT: "worth", Accuracy.CONDITIONAL: "worth", Accuracy.LOWER_BOUND: "worth at least",
    Accuracy.UPPER_BOUND: "worth at most", Accuracy.RATING: "rated",
}  # fmt: skip


class Explanation(NamedTuple):
    """The explanation of an action: its label, a few sentences, and their numbers."""

    label: str
    sentences: tuple[str, ...]
    data: dict[str, object]
    is_worse: bool = False  # whether another action is better

    def __str__(self) -> str:
        """Return the explanation as one line."""
        return f"{self.heading}: {' '.join(self.sentences)}"

    @property
    def heading(self) -> str:
        """The action, and the agent and the game that the values are about."""
        return f"why {'not ' * self.is_worse}{self.label}"


def explain_action(provider: HintProvider, action: float | None = None) -> Explanation:
    """Return the explanation of an action, by default of the recommended one.

    Raise IllegalAction for an action that is not legal.
    """
    if action is not None:
        action = provider.session.validate_action(provider.seat, action)
    provider.create_hint()
    hint = provider.current_hint
    assert hint is not None
    if hint.action is None:  # A search cannot tell the best action.
        name = "" if action is None else f"{format_real_action(provider, action)} "
        return Explanation(f"{name}({hint.basis})", (f"{hint.recommended_action}.",), hint.data)
    explained = hint.action if action is None else action
    label = (
        f"{format_real_action(provider, explained)}{_format_present_state(provider)} ({hint.basis})"
    )
    if hint.values is None:
        data: dict[str, object] = {
            "by": hint.data["by"],
            "action": provider.session.format_action(provider.seat, explained),
            "best": hint.action_name,
            "about": hint.game,
        }
        sentences, numbers, is_worse = explain_by_simulation(provider, explained, hint.action)
        position = provider.position
        reasons = list_reasons(position, int(explained) if position.labels else explained)
        data |= {**numbers, **({"reasons": [*reasons]} if reasons else {})}
        return Explanation(label, (*reasons, *sentences), data, is_worse)
    return _ValueExplainer(provider, hint, int(explained)).explain(label)


class _ValueExplainer:
    """The writer of an explanation from the values of actions."""

    def __init__(self, provider: HintProvider, hint: Hint, action: int) -> None:
        self._provider, self._hint, self._action = provider, hint, action
        self._session: Session = provider.session
        assert hint.values is not None
        assert hint.action is not None
        self._values, self._tolerance = hint.values.q, VALUE_TOLERANCE * hint.values.scale
        self._decimals, self._errors = hint.value_decimals, hint.values.errors
        order = np.argsort(-self._values, kind="stable").tolist()
        ranked = [action for action in order if np.isfinite(self._values[action])]
        self._legal_actions = ranked
        self._suggested = self._best = int(hint.action)
        if self._values[self._best] < self._values[ranked[0]] - self._tolerance:
            # A search keeps its usual action unless another is clearly better.
            self._best = ranked[0]
        self._breakdowns = self._break_down_actions()
        self._reasons = list_reasons(provider.position, action)

    def _break_down_actions(self) -> dict[int, ActionBreakdown]:
        """Return the parts of each legal action's value; of slow values, of few actions."""
        actions = self._legal_actions
        if self._hint.values_basis.accuracy is Accuracy.UNKNOWN:  # may be slow
            actions = [*dict.fromkeys([self._best, self._action, *actions[:2]])]
        breakdowns: dict[int, ActionBreakdown] = {}
        for action in actions:
            parts = self._provider.position.break_down(action)
            if parts is None:
                return {}
            breakdowns[action] = parts
        return breakdowns

    def explain(self, label: str) -> Explanation:
        """Return the explanation."""
        parts = self._breakdowns.get(self._action)
        other, comparison, reason = self._compare_with_alternative()
        data, reasons = self._build_data(parts, other), self._reasons
        if reasons:  # in the problem's words, which say more than the parts of the value
            data["reasons"] = [*reasons]
            sentences = [*reasons, self._describe_value(None), comparison]
        else:
            outcomes = self._describe_outcomes(parts) if parts else ""
            sentences = [self._describe_value(parts), outcomes, comparison, reason]
        lost = self._values[self._best] - self._values[self._action]
        is_worse = bool(self._round_as_printed(lost) > 0.0)
        return Explanation(label, tuple(filter(None, sentences)), data, is_worse)

    # Names and numbers

    def _format_action(self, action: int) -> str:
        """Return the name of an action."""
        return self._session.format_action(self._provider.seat, action)

    def _format(self, value: float) -> str:
        """Return a value with the decimals of the hint."""
        return format_fixed(value, self._decimals)

    def _round_as_printed(self, value: float) -> float:
        """Return a value as printed, so that printed sums are right."""
        return float(self._format(value))

    @property
    def _value_verb(self) -> str:
        """The verb phrase of a value, which says how accurate it is."""
        return VALUE_WORDS.get(self._hint.values_basis.accuracy, "worth about")

    def _adds_up_as_printed(self, parts: ActionBreakdown) -> bool:
        """Return whether the parts of a value sum to it, to the digits printed."""
        difference = parts.value - parts.reward - parts.later_value
        return parts.adds_up or abs(difference) < 0.5 * 10.0**-self._decimals

    # The sentences

    def _describe_value(self, parts: ActionBreakdown | None) -> str:
        """Return a sentence on the value of the action: the reward now, and later turns."""
        name, best_value = self._format_action(self._action), self._values[self._best]
        best_count = sum(
            self._values[a] >= best_value - self._tolerance for a in self._legal_actions
        )
        subject = f"The {'suggested ' * (self._action == self._suggested)}action {name}"
        if self._action == self._best:
            is_bound = self._hint.values_basis.accuracy.is_bound
            subject = (
                f"The action of the best bound, {name}," if is_bound else f"The best action {name}"
            )
            if best_count > 1:
                subject = f"The suggested action {name}, one of {best_count} best,"
        value, errors = self._values[self._action], self._errors
        beginning = f"{subject} is {self._value_verb} {self._format(value)}"
        if errors is not None and np.isfinite(errors[self._action]):
            beginning += f" (standard error {errors[self._action]:.2g})"
        if self._hint.values_basis.accuracy is Accuracy.RATING:
            beginning += "; ratings compare actions, and are not points"
        if parts is None:
            return f"{beginning}."
        reward = self._format(parts.reward)
        if parts.is_last_turn:
            return f"{beginning}, the expected reward of this turn; {self._describe_last_turn()}."
        if not self._adds_up_as_printed(parts):
            return f"{beginning}. Its expected reward in this turn is {reward}."
        later = self._format(self._round_as_printed(value) - self._round_as_printed(parts.reward))
        text = f"{beginning}: reward {reward} now and {later} later"
        product = f" (discount {parts.discount:g} x mean value {self._format(parts.value_after)})"
        product = product if parts.discount < 1.0 else ""
        return f"{text}{product}."

    def _describe_last_turn(self) -> str:
        """Return why no later turn counts: in a repeated game, the others can no longer answer."""
        others, position = self._format_other_names(), self._provider.position
        if position.turns_left == 1 and position.problem.state_count == 1 and others:
            return f"it is the last turn, so {others} cannot answer it"
        return "no later turn counts"

    def _describe_outcomes(self, parts: ActionBreakdown) -> str:
        """Return a sentence on the possible outcomes: a list of few, or the range of many."""
        replies = self._describe_replies(parts)
        if self._session.problem.state_count == 1 and len(parts.outcomes) == 1:
            return f"{replies}." if replies else ""
        beginning = f"{replies}; " if replies and self._session.problem.state_count != 1 else ""
        texts = [f"{beginning}{text}" for text in self._iter_outcome_lists(parts) if text]
        return _choose_short([f"{text[:1].upper()}{text[1:]}." for text in texts])

    def _format_other_names(self) -> str:
        """Return the names of the other agents."""
        agents = self._session.problem.agents
        return " and ".join(
            agent for seat, agent in enumerate(agents) if seat != self._provider.seat
        )

    def _describe_replies(self, parts: ActionBreakdown) -> str:
        """Return the expected action of the only other agent as a clause; '' if not modelled."""
        if parts.replies is None:
            return ""
        agent = self._session.problem.agents[1 - self._provider.seat]
        chances = [parts.replies]
        if parts.next_replies is not None and self._session.problem.state_count == 1:
            chances.append(parts.next_replies)
        is_expected = min(map(np.max, chances)) >= MAJOR_SHARE
        verb = "is expected to choose" if is_expected else "most often chooses"
        names = [*map(self._format_likeliest, chances)]
        times = [" now", " next turn"] if len(chances) > 1 else [""]
        if len({*names}) < len(names):  # the same action twice, with the same probability
            names[1], times[1] = "", "again next turn"
        clause = " and ".join(map("".join, zip(names, times, strict=True)))
        return f"{agent[:1].upper()}{agent[1:]} {verb} {clause}"

    def _format_likeliest(self, probabilities: Reals) -> str:
        """Return the other agent's likeliest action, with its probability if it is not sure."""
        action = int(probabilities.argmax())
        name = self._session.format_action(1 - self._provider.seat, action)
        if probabilities[action] >= SURE_PROBABILITY:
            return name
        count = int((probabilities > probabilities[action] - MIN_LEAD).sum())
        if count > 1:
            return f"any of {count} actions (probability {probabilities[action]:.2f} each)"
        return f"{name} (probability {probabilities[action]:.2f})"

    def _iter_outcome_lists(self, parts: ActionBreakdown) -> Iterator[str]:
        """Yield clauses on the outcomes: each one with its value, then without, then the range."""
        outcomes = parts.outcomes
        has_short_names = all(_is_short(outcome.label) for outcome in outcomes)
        is_observed = outcomes[0].belief is not None
        if outcomes[0].probability >= SURE_PROBABILITY:
            if outcomes[0].label.startswith(END_PREFIX):
                yield "the game then ends"
                return
            if is_observed:
                belief_text = self._describe_belief(parts, outcomes[0])
                details = f"; then {belief_text}" if belief_text else ""
                if has_short_names:
                    label = outcomes[0].label
                    yield f"you then observe {label} in any case, which tells nothing{details}"
                yield f"the observation is certain, so it tells nothing{details}"
            elif has_short_names and not isinstance(
                self._session.problem.state_count, ContinuousStates
            ):
                yield f"the next state is {outcomes[0].label} in any case"
            return
        if has_short_names and len(outcomes) <= MAX_LISTED_OUTCOMES:
            verb = "you observe" if is_observed else "next is"
            if self._session.problem.state_count == 1:
                verb = f"{self._format_other_names()} chooses"
            yield f"{verb} {self._format_outcomes(parts, ' with probability', has_belief=True)}"
            yield f"{verb} {self._format_outcomes(parts, ' with probability')}"
            yield f"probabilities: {self._format_outcomes(parts, '')}"
        yield from self._iter_outcome_ranges(parts)

    def _format_outcomes(
        self, parts: ActionBreakdown, noun: str, *, has_belief: bool = False
    ) -> str:
        """Return each outcome with its probability, its value and perhaps the belief after it."""
        decimals = count_probability_decimals([item.probability for item in parts.outcomes])
        entries = []
        for outcome in parts.outcomes:
            belief_text = self._describe_belief(parts, outcome) if has_belief else ""
            # Bounds after the outcomes may be closer than that of the action, and not sum to it.
            worth = (
                self._describe_value_after(outcome, parts)
                if self._adds_up_as_printed(parts)
                else ""
            )
            details = ", ".join(filter(None, (belief_text, worth)))
            probability = f"{outcome.probability:.{decimals}f}"
            again = "again " * (outcome.label == self._present_state)
            details = f" ({details})" if details else ""
            entries.append(f"{again}{outcome.label}{noun} {probability}{details}")
        return " or ".join(filter(None, (", ".join(entries[:-1]), entries[-1])))

    def _describe_belief(self, parts: ActionBreakdown, outcome: PossibleOutcome) -> str:
        """Return the probability of one hidden state after an observation; '' without a belief.

        It is the state about which the observations say most.
        """
        if outcome.belief is None:
            return ""
        beliefs = np.array([other.belief for other in parts.outcomes])
        state = int((np.ptp(beliefs, axis=0) if len(beliefs) > 1 else beliefs[0]).argmax())
        name = self._name_state_probability(state)
        return f"{name} = {outcome.belief[state]:.2f}" * bool(name)

    def _name_state_probability(self, state: int) -> str:
        """Return the name of the probability of a hidden state, `P(hungry)`; '' if it is long."""
        problem, view = self._session.problem, self._session.view(self._provider.seat)
        state_name = load_view_module(problem).lesson(view).state_name
        name = state_name.format(problem.describe_state(problem.enumerate_states()[state]))
        if not _is_short(name):
            return ""
        return f"P({name})" if any(map(str.isalpha, name)) else f"P(state {name})"

    def _describe_value_after(self, outcome: PossibleOutcome, *breakdowns: ActionBreakdown) -> str:
        """Return the value after an outcome, and its reward if those of the actions differ."""
        problem = self._session.problem
        differ = _has_different_rewards(*breakdowns)
        shows_reward = differ and problem.rewards_observable
        reward = f"reward {format_score(outcome.reward)}" * shows_reward
        after = f"then {self._value_verb} {self._format(outcome.value_after)}" * (
            not breakdowns[0].is_last_turn
        )
        return ", ".join(filter(None, (reward, after)))

    @property
    def _present_state(self) -> str:
        """The present state as text; '' if the agent does not see it, or it is not short."""
        return _format_present_state(self._provider).removeprefix(STATE_PREFIX)

    def _iter_outcome_ranges(self, parts: ActionBreakdown) -> Iterator[str]:
        """Yield clauses on many outcomes: the likeliest one and their range, then the range.

        There is no range if the values after the outcomes do not sum to that of the action.
        """
        problem = self._session.problem
        if problem.state_count == 1:
            yield from self._iter_reply_ranges(parts)
            return
        text = f"{len(parts.outcomes)} outcomes are possible"
        if not self._adds_up_as_printed(parts):
            yield text
            return
        # As the values after the outcomes in other sentences, these are without this turn's reward.
        uses_values_after = not (_has_different_rewards(parts) or parts.is_last_turn)
        totals = [
            outcome.value_after if uses_values_after else parts.outcome_total(outcome)
            for outcome in parts.outcomes
        ]
        subject = "what follows is" if uses_values_after else "they are"
        worst, best = self._format(min(totals)), self._format(max(totals))
        text = f"{text}; {subject} {self._value_verb} {worst} to {best}"
        likeliest, second = parts.outcomes[:2]
        if likeliest.probability > second.probability + MIN_LEAD:
            has_name = _is_short(likeliest.label) and not isinstance(
                problem.state_count, ContinuousStates
            )
            yield (
                f"{text}; the likeliest{f', {likeliest.label},' * has_name} has probability "
                f"{likeliest.probability:.2f} and is {self._value_verb} {self._format(totals[0])}"
            )
        yield text

    def _iter_reply_ranges(self, parts: ActionBreakdown) -> Iterator[str]:
        """Yield clauses on many actions of the others: the likeliest and the range, the range."""
        others = self._format_other_names()
        if not self._adds_up_as_printed(parts):
            yield f"{others} can choose {len(parts.outcomes)} actions"
            return
        totals = [parts.outcome_total(outcome) for outcome in parts.outcomes]
        name, worst, best = self._format_action(parts.action), min(totals), max(totals)
        text = (
            f"depending on the choice of {others}, {name} is {self._value_verb} "
            f"{self._format(worst)} to {self._format(best)}"
        )
        likeliest, second = parts.outcomes[:2]
        if likeliest.probability > second.probability + MIN_LEAD and _is_short(likeliest.label):
            yield (
                f"{text}; if it chooses {'also ' * (likeliest.label == name)}{likeliest.label} "
                f"(probability {likeliest.probability:.2f}), {self._format(totals[0])}"
            )
        yield text

    def _compare_with_alternative(self) -> tuple[RuleChoice | None, str, str]:
        """Return the action to compare with, and sentences on the difference and its reason."""
        best, value = self._best, self._values[self._best]
        if self._action != best:
            gap = value - self._values[self._action]
            if not self._round_as_printed(gap):
                text = f"The suggested action {self._format_action(best)} is as good."
                return RuleChoice(best, ""), text, ""
            subject = f"The best action {self._format_action(best)}"
            if self._action == self._suggested:
                subject = f"By these values, {self._format_action(best)}"
            accuracy = self._hint.values_basis.accuracy
            if accuracy.is_bound:
                text = f"The bound of {self._format_action(best)} is {self._format(gap)} higher."
                return RuleChoice(best, ""), text, ""
            is_rating = accuracy is Accuracy.RATING
            verb, comparative = ("rated", "higher") if is_rating else ("worth", "more")
            text = f"{subject} is {verb} {self._format(gap)} {comparative}"
            text += self._describe_closeness(value, self._values[self._action])
            return RuleChoice(best, ""), text, self._describe_reason(self._action)
        rule = self._choose_alternative()
        if rule is None:
            is_only_one = len(self._legal_actions) == 1
            text = "No other action is legal."
            if not is_only_one:
                text = f"All {len(self._legal_actions)} actions are equally good."
                if self._hint.values_basis.accuracy.is_estimate:
                    number = "either" if len(self._legal_actions) == 2 else "any"
                    text = f"By these values, {number} action is fine."
            return None, text, ""
        other_value = self._values[rule.action]
        name = self._format_action(rule.action)
        is_bound = self._hint.values_basis.accuracy.is_bound  # whose differences are no values
        text = (
            f"The action {name}, {rule.text}, is {self._value_verb} "
            f"{self._format(other_value)}, {'a bound ' * is_bound}"
            f"{self._format(value - other_value)} {'lower' if is_bound else 'less'} than "
            f"{'that of ' * is_bound}{self._format_action(best)}"
        )
        printed = self._round_as_printed(value) - self._round_as_printed(other_value)
        if self._format(printed) != self._format(value - other_value):
            text += " before rounding"  # The printed numbers seem to differ otherwise.
        text += self._describe_closeness(value, other_value)
        return rule, text, self._describe_reason(rule.action)

    def _describe_closeness(self, best_value: float, value: float) -> str:
        """Return the end of a sentence on two values, which says whether ratings differ little."""
        is_rating = self._hint.values_basis.accuracy is Accuracy.RATING
        is_close = is_rating and best_value - value < CLOSE_RATING_SHARE * abs(best_value)
        return ", which is nearly equal." if is_close else "."

    def _describe_reason(self, action: int) -> str:
        """Return a sentence with the reason why an action is worth less than the best one.

        If it explains the worse action, the reason says what the best action brings instead.
        """
        best, other = self._breakdowns.get(self._best), self._breakdowns.get(action)
        reasons = [*self._iter_reasons(best, other)] if best and other else []
        return _choose_short([f"{reason[:1].upper()}{reason[1:]}." for reason in reasons])

    def _choose_alternative(self) -> RuleChoice | None:
        """Return a rule of thumb that disagrees with the hint, else the best of the worse actions.

        None if no legal action is worse.
        """
        best_value = self._values[self._best]
        worse = [a for a in self._legal_actions if self._values[a] < best_value - self._tolerance]
        if not worse:
            return None
        rule = None
        if set(self._breakdowns) == set(self._legal_actions) and all(
            self._adds_up_as_printed(parts) for parts in self._breakdowns.values()
        ):
            rule = find_losing_rule(self._provider.position, self._breakdowns, self._best)
        return rule or RUNNER_UP._replace(action=worse[0])

    def _iter_reasons(self, best: ActionBreakdown, other: ActionBreakdown) -> Iterator[str]:
        """Yield reasons why an action is worth less than the best one, the most telling first."""
        if not (self._adds_up_as_printed(best) and self._adds_up_as_printed(other)):
            return
        if best.information_value - other.information_value >= MAJOR_SHARE * (
            best.value - other.value
        ):
            name = self._format_action(other.action) if self._action == other.action else "it"
            yield (
                "what you then observe helps you to choose later: that is worth "
                f"{self._format(other.information_value)} after {name}, and "
                f"{self._format(best.information_value)} after {self._format_action(best.action)}"
            )
        difference, later = self._compare_now_and_later(best, other)
        has_causes = later or _has_different_rewards(best) or _has_different_rewards(other)
        if has_causes:
            reply = self._describe_changed_reply(best, other)
            belief = self._describe_changed_belief(best, other, later)
            for cause in filter(None, (reply, *self._iter_decisive_states(best, other), belief)):
                yield f"it {difference}{cause}"
        if not best.is_last_turn:  # else it is the difference of the values
            yield f"it {difference}"

    def _describe_changed_reply(self, best: ActionBreakdown, other: ActionBreakdown) -> str:
        """Return the other agent's next action if it differs from that after the best action."""
        if best.next_replies is None or other.next_replies is None:
            return ""
        reply = int(other.next_replies.argmax())
        is_same = reply == int(best.next_replies.argmax())
        if is_same or self._session.problem.state_count != 1:
            return ""
        seat = 1 - self._provider.seat
        chances = (best.next_replies, other.next_replies)
        described, reference = chances if self._action == other.action else chances[::-1]
        action = int(described.argmax())
        text = f", as {self._session.problem.agents[seat]} then chooses "
        text += self._session.format_action(seat, action)
        if described[action] >= SURE_PROBABILITY:
            return text
        return f"{text} with probability {described[action]:.2f}, not {reference[action]:.2f}"

    def _iter_decisive_states(self, best: ActionBreakdown, other: ActionBreakdown) -> Iterator[str]:
        """Yield clauses on the next states that explain most of the difference of two values.

        One that explains half of it is the main cause. Else the three or two largest are named
        with their shares.
        """
        problem = self._session.problem
        if (
            problem.partially_observable
            or problem.state_count == 1
            or isinstance(problem.state_count, ContinuousStates)
        ):
            return  # An observation reports a bad state, but does not cause it.
        shares = compute_outcome_shares(best, other)
        main_count = sum(item.share >= MAJOR_SHARE for item in shares)
        main = shares[0]
        if main_count == 1 and _is_short(main.outcome.label):
            chances = [main.better_probability, main.worse_probability]
            decimals = count_probability_decimals([*chances, *(1.0 - p for p in chances)])
            described, reference = chances[:: 1 if self._action == other.action else -1]
            worth = self._describe_value_after(main.outcome, best, other)
            details = f" ({worth})" * bool(worth)
            yield (
                f", mainly because it leads to {main.outcome.label}{details} with probability "
                f"{described:.{decimals}f}, not {reference:.{decimals}f}"
            )
        counts = [main_count] if main_count else range(MAX_LISTED_OUTCOMES, 1, -1)
        for count in [count for count in counts if count > 1]:
            largest = [item for item in shares[:count] if item.share > 0.0]
            if all(_is_short(item.outcome.label) for item in largest):
                texts = [item.outcome.label for item in shares]
                entries = list[str]()
                for item in largest:
                    text, noun = item.outcome.label, " of the difference" * (not entries)
                    is_named_twice = texts.count(text) > 1 and problem.rewards_observable
                    reward = f"reward {format_score(item.outcome.reward)}, " * is_named_twice
                    entries.append(f"{text} ({reward}{100 * item.share:.0f} %{noun})")
                start = "mainly because of" if main_count else "because of"
                yield f", {start} {join_words(entries)}"

    def _describe_changed_belief(
        self, best: ActionBreakdown, other: ActionBreakdown, later: float
    ) -> str:
        """Return a clause on the hidden state in which the actions differ most; '' if little.

        If the beliefs are equal on average, only their spread explains that later turns are worth
        more or less: what the observations tell.
        """
        if best.mean_belief is None or other.mean_belief is None:
            return ""
        described, reference = (best, other) if self._action == other.action else (other, best)
        assert described.mean_belief is not None
        assert reference.mean_belief is not None
        change = described.mean_belief - reference.mean_belief
        # Of states that change as much, the one that becomes likelier is the consequence.
        state = int((np.abs(change) + SAME_BELIEF * (change > 0.0)).argmax())
        is_alone = len(self._session.problem.agents) == 1
        goes_on = not any(item.ends_problem for item in (*best.outcomes, *other.outcomes))
        if abs(change[state]) < SAME_BELIEF and is_alone and goes_on and later:
            return f", as what you then observe tells {'more' if later > 0 else 'less'}"
        name = self._name_state_probability(state)
        if abs(change[state]) < MIN_BELIEF_CHANGE or not name:
            return ""
        return (
            f", as {name} becomes {described.mean_belief[state]:.2f} on average, "
            f"not {reference.mean_belief[state]:.2f}"
        )

    def _compare_now_and_later(
        self, best: ActionBreakdown, other: ActionBreakdown
    ) -> tuple[str, float]:
        """Return the differences of the reward now and of later turns, and that of later turns.

        They are called costs if no reward is positive. The printed numbers sum to the printed
        difference of the values. They are those of the best action if the sentence explains the
        worse one.
        """
        parts = best.reward, best.later_value, other.reward, other.later_value
        verb = "bring" if max(parts) > 0.0 else "cost"
        sign_of_more = 1.0 if verb == "bring" else -1.0
        sign = -1.0 if self._action == other.action else 1.0
        gap = sign * self._round_as_printed(other.value - best.value)
        reward_change = sign * self._round_as_printed(other.reward - best.reward)
        if not self._round_as_printed(other.later_value - best.later_value):
            reward_change = gap
        later = self._round_as_printed(gap - reward_change)
        more_now, more_later = (
            f"{self._format(abs(change))} {'more' if sign_of_more * change > 0 else 'less'}"
            for change in (reward_change, later)
        )
        if best.is_last_turn:
            return f"{verb}s {more_now} now", 0.0
        if not later:
            return f"{verb}s {more_now} now, and later turns {verb} as much", 0.0
        if not self._round_as_printed(reward_change):
            return f"{verb}s the same now and {more_later} later", later
        conjunction = "but" if reward_change * later < 0 else "and"
        return f"{verb}s {more_now} now {conjunction} {more_later} later", later

    # The numbers as data

    def _build_data(
        self, parts: ActionBreakdown | None, other: RuleChoice | None
    ) -> dict[str, object]:
        """Return the numbers of the explanation."""
        data: dict[str, object] = {
            "by": self._hint.data["by"],
            "action": self._format_action(self._action),
            "best": self._format_action(self._best),
            "about": self._hint.game,
            "value": float(self._values[self._action]),
            **self._hint.values_basis.accuracy.data,
        }
        if self._errors is not None and np.isfinite(self._errors[self._action]):
            data["standard_error"] = float(self._errors[self._action])
        if parts:
            data |= _breakdown_data(parts)
        if other:
            other_parts = self._breakdowns.get(other.action)
            data["compared_with"] = {
                "action": self._format_action(other.action),
                **({"rule": other.text} if other.text else {}),
                "value": float(self._values[other.action]),
                **(_breakdown_data(other_parts) if other_parts else {}),
            }
            worse, best = self._action if self._action != self._best else other.action, self._best
            if {worse, best} <= {*self._breakdowns} and self._values[worse] < self._values[best]:
                shares = compute_outcome_shares(self._breakdowns[best], self._breakdowns[worse])
                data["shares"] = [
                    {
                        "outcome": item.outcome.label,
                        "reward": item.outcome.reward,
                        "share": item.share,
                    }
                    for item in shares
                ]
        return data


def _format_present_state(provider: HintProvider) -> str:
    """Return the present state as ` in the state STATE`; '' if it is hidden or too long."""
    problem = provider.session.problem
    is_named = isinstance(problem.state_count, int) and problem.state_count > 1
    if problem.partially_observable or not is_named:
        return ""
    text = problem.describe_state(provider.session.state)
    return f"{STATE_PREFIX}{text}" if _is_short(text) else ""


def _choose_short(sentences: Sequence[str]) -> str:
    """Return the first sentence that is not too long, else the last; '' if there is none."""
    short = (text for text in sentences if len(text.split()) <= MAX_SENTENCE_WORDS)
    return next(short, sentences[-1] if sentences else "")


def _is_short(name: str) -> bool:
    """Return whether the name of a state or observation fits into a sentence."""
    return len(name) <= MAX_OUTCOME_CHARS and len(name.split()) <= MAX_OUTCOME_WORDS


def _has_different_rewards(*breakdowns: ActionBreakdown) -> bool:
    """Return whether the rewards of the outcomes of these actions differ."""
    rewards = [outcome.reward for parts in breakdowns for outcome in parts.outcomes]
    return bool(np.ptp(rewards) > VALUE_TOLERANCE * breakdowns[0].scale)


def _breakdown_data(parts: ActionBreakdown) -> dict[str, object]:
    """Return the parts of a value as data."""
    return {
        "reward": parts.reward,
        "discount": parts.discount,
        "value_after": parts.value_after,
        "adds_up": parts.adds_up,
        "information_value": parts.information_value,
        "outcomes": [
            {
                "outcome": outcome.label,
                "probability": outcome.probability,
                "reward": outcome.reward,
                "value_after": outcome.value_after,
            }
            for outcome in parts.outcomes
        ],
    }
