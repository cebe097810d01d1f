"""The comparison of a finished game with games of agents from the same start, and its medal."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from dmplay.agents.available_agents import Roster
from dmplay.agents.base import SCRIPTED_PLAYERS, AdviceQuestion, describe_rule
from dmplay.agents.expected_return import compute_expected_return
from dmplay.core.action_values import Accuracy
from dmplay.core.arrays import Array, Reals
from dmplay.core.policy import Policy
from dmplay.core.problem import initial_state_distribution, make_initial_observation
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.work_budget import ComputationStopped, stop_after_seconds
from dmplay.errors import DmplayError
from dmplay.game.medals import AgentValue, Medal, award_medal
from dmplay.game.position import SEARCH_AGENT
from dmplay.registry import agents
from dmplay.registry.problem_name_kinds import names_bot
from dmplay.transcript.format import NATURAL_END_REASONS

if TYPE_CHECKING:  # Most games end without being compared.
    from dmplay.simulation.rollouts import Rollout

COMPARED_GAMES = 100  # games of each agent that the score is compared with
# In every problem, the returns of its 100 random games differ by at most 0.08 (Kolmogorov-Smirnov)
# from those of 4,000 games.
COMPARISON_SEED = 1_000_005
MAX_COMPARED_TURNS = 2000  # turns after which a game of an agent must be over
MAX_SECONDS = 1.0  # seconds of processor time of the games, or the value, of each agent
RETURN_TOLERANCE = 1e-9  # differences of returns that count as equal
RANDOM_AGENT = "random"
UNREPEATABLE_PLAYERS = (*SCRIPTED_PLAYERS, SEARCH_AGENT)  # too slow, or only for one game


class ScoreComparison(NamedTuple):
    """The games of an agent from the same start that scored less than this game, or equal."""

    agent: str
    game_count: int
    lower_count: int
    equal_count: int = 0
    has_same_start: bool = False  # where chance decides the start

    def describe(self) -> str:
        """Return the counts of games that scored less than this one, the same and more."""
        counts = {
            "scored less than you": self.lower_count,
            "the same": self.equal_count,
            "more": self.game_count - self.lower_count - self.equal_count,
        }
        parts = [f"{count} {words}" for words, count in counts.items() if count]
        if not self.lower_count:
            parts[0] = parts[0].replace("the same", "scored as much as you")
            parts[0] = parts[0].replace("more", "scored more than you")
        start = " (same start)" * self.has_same_start
        return f"{self.game_count} {self.agent.partition(':')[0]} games{start}: {', '.join(parts)}"


@dataclass(frozen=True)
class ScoreComparer:
    """Agents that play as the people of a finished game did, to be compared with its score.

    Their games have the same start, hidden states included, turn limit and other players; their
    later random numbers differ. An agent that takes too long is left out.
    """

    session: Session
    questions: Sequence[AdviceQuestion]  # one for the seat of each person

    @property
    def is_possible(self) -> bool:
        """True if agents can play many games as this one.

        It must have ended by its rules, the same players have played all turns, and all people have
        the same reward.
        """
        session, questions = self.session, self.questions
        if any(question.earlier_turns for question in questions):
            return False
        has_common_reward = len(questions) == 1 or session.problem.shared_reward
        others = [seated.policy for seated in session.seated_policies if seated]
        is_repeatable = not any(
            names_bot(name) or name.partition(":")[0] in UNREPEATABLE_PLAYERS
            for name in questions[0].players
        ) and not any(getattr(policy, "depends_on_clock", False) for policy in others)
        return session.end_reason in NATURAL_END_REASONS and has_common_reward and is_repeatable

    def compare_score(self) -> tuple[ScoreComparison, ...]:
        """Return the counts of games of careless play, and of a strong agent, that scored less."""
        names = [self._baseline, *[self._strong_agent] * (not self._plans_longer_game)]
        comparisons = (self._compare_agent(name) for name in dict.fromkeys(names) if name)
        return tuple(comparison for comparison in comparisons if comparison)

    def find_medal(self, regret: float | None, start_value: float) -> Medal | None:
        """Return the medal of the only person; None without values of agents.

        With the regret of all choices and the value of best play, the values of the agents are
        exact if they can be listed. Else they are mean scores.
        """
        if len(self.questions) != 1:
            return None
        seat, scale = self.questions[0].seat, self.session.problem.reward_scale
        rule_name = self._roster.rule_of_thumb
        is_exact = regret is not None
        baseline = self._value_agent(self._baseline, is_exact=is_exact)
        if baseline is None:
            return None
        rule = self._value_agent(rule_name, is_exact=is_exact) if rule_name else None
        if regret is not None:
            best = AgentValue("", start_value, is_exact=True)
            return award_medal(regret, best, rule, baseline, COMPARED_GAMES, scale)
        name = self._strong_agent
        strong = (self._value_agent(name, is_exact=False) if name else None) or rule
        if strong is None:
            return None
        loss = strong.score - self.session.seat_return(seat)
        return award_medal(loss, strong, rule, baseline, COMPARED_GAMES, scale)

    @property
    def _roster(self) -> Roster:
        """The agents of the first person's seat."""
        return agents.load_roster(self.session.problem, self.questions[0].seat)

    @property
    def _baseline(self) -> str:
        """The careless agent by which bronze and the words on choices are measured."""
        return self._roster.baseline

    @cached_property
    def _strong_agent(self) -> str:
        """The agent that gives hints to all people, or a quicker one; '' if there is none."""
        name = ""
        for question in self.questions:
            provider = agents.find_hint_provider(self.session.problem, question)
            name = find_compared_agent(provider) if provider else SEARCH_AGENT
            if name == SEARCH_AGENT:
                return ""
        return name

    @cached_property
    def _plans_longer_game(self) -> bool:
        """True if the strong agent plans for turns after the turn limit that ended this game."""
        if self.session.end_reason != "turn limit":
            return False
        providers = [
            agents.find_hint_provider(self.session.problem, question) for question in self.questions
        ]
        return any(
            provider.base_name == self._strong_agent and provider.basis.ignores_turn_limit
            for provider in providers
            if provider
        )

    @cached_property
    def _can_only_fall(self) -> bool:
        """True if no reward is positive: then the return of a game that goes on can only fall."""
        bounds = self.session.problem.reward_bounds
        return bounds is not None and bounds[1] <= 0.0

    @cached_property
    def _has_same_limit(self) -> bool:
        """True if the compared games have the turn limit of this one."""
        return (self.session.turn_limit or math.inf) <= MAX_COMPARED_TURNS

    def _compare_agent(self, name: str) -> ScoreComparison | None:
        """Return the comparison with an agent; None if games go on that may still score more."""
        games, seat = self._play_games(name), self.questions[0].seat
        if games is None:
            return None
        score = self.session.seat_return(seat)
        difference = games.returns[:, seat] - score
        tolerance = RETURN_TOLERANCE * max(abs(score), self.session.problem.reward_scale)
        is_lower = difference < -tolerance
        is_decided = games.terminated | (is_lower & self._can_only_fall)
        if not (self._has_same_limit or is_decided.all()):
            return None
        equal_count = int((np.abs(difference) <= tolerance).sum())
        start = bool(self.session.problem.uniform_counts.start)
        return ScoreComparison(name, COMPARED_GAMES, int(is_lower.sum()), equal_count, start)

    def _value_agent(self, name: str, *, is_exact: bool) -> AgentValue | None:
        """Return the expected score of an agent in the person's seat, or its mean score.

        None if it takes too long, or if games go on that may still score more.
        """
        session, seat = self.session, self.questions[0].seat
        rule = describe_rule(self._roster.agents.get(name.partition(":")[0]))
        if is_exact:
            with suppress(DmplayError, ComputationStopped), stop_after_seconds(MAX_SECONDS):
                score = compute_expected_return(
                    session.problem,
                    self._seat_agent(name),
                    seat,
                    session.turn_limit,
                    self._list_starts(seat),
                )
                if score is not None:
                    return AgentValue(name, score, is_exact=True, rule=rule)
        has_other_starts = is_exact and session.problem.partially_observable
        games = self._play_games(name, has_same_start=not has_other_starts)
        if games is None or not (
            self._has_same_limit or self._can_only_fall or games.terminated.all()
        ):
            return None
        scores = games.returns[:, seat]
        error = float(scores.std(ddof=1)) / math.sqrt(len(scores))
        mean, median = float(scores.mean()), float(np.median(scores))
        return AgentValue(name, mean, is_exact=False, error=error, rule=rule, median=median)

    def _list_starts(self, seat: int) -> tuple[Array, Reals]:
        """Return the start as the seat knows it: states `[K, ...]` and probabilities `[K]`."""
        problem, start = self.session.problem, self.session.initial_state[None]
        if not problem.partially_observable:
            return start, np.ones(1)
        probabilities, states = initial_state_distribution(problem)
        observation = make_initial_observation(problem, start, seat)
        is_possible = make_initial_observation(problem, states, seat) == observation
        weights = probabilities * is_possible
        return states, weights / weights.sum()

    @cached_property
    def _games(self) -> dict[tuple[str, bool], "Rollout | None"]:
        """The games of each agent that were played, from the same start or from any."""
        return {}

    def _play_games(self, name: str, *, has_same_start: bool = True) -> "Rollout | None":
        """Return COMPARED_GAMES of an agent, from the start of this game or from any.

        They are played once. None if they take too long.
        """
        # imported only if a person finished a game
        from dmplay.simulation.rollouts import RolloutSpec, rollout_entrants

        session, key = self.session, (name, has_same_start)
        if key not in self._games:
            self._games[key] = None
            with suppress(DmplayError, ComputationStopped), stop_after_seconds(MAX_SECONDS):
                spec = RolloutSpec(
                    range(COMPARED_GAMES),
                    turn_limit=min(session.turn_limit or MAX_COMPARED_TURNS, MAX_COMPARED_TURNS),
                    seed=COMPARISON_SEED,
                    keep=("returns", "terminated"),
                    start_uniforms=session.initial_uniforms if has_same_start else None,
                )
                policies = self._seat_agent(name)
                (self._games[key],) = rollout_entrants(session.problem, [policies], spec)
        return self._games[key]

    def _seat_agent(self, name: str) -> list[Policy]:
        """Return the policies of all seats, with an agent in people's seats."""
        problem = self.session.problem
        by_seat = {question.seat: question for question in self.questions}
        policies: list[Policy] = []
        for seat, seated in enumerate(self.session.seated_policies):
            question = by_seat.get(seat)
            provider = agents.find_hint_provider(problem, question) if question else None
            if question is None:
                policies.append(cast(SeatedPolicy, seated).policy)
            elif provider and name == provider.base_name:
                policies.append(provider.policy)
            else:
                policies.append(agents.load_agent(problem, seat, name))
        return policies


def find_compared_agent(provider: agents.HintAgent) -> str:
    """Return the agent whose scores are compared with a person's: a hint agent or a quicker one."""
    policy = provider.policy
    substitute = agents.load_roster(policy.problem, policy.seat).batch_agent
    is_exact = provider.basis.accuracy in {Accuracy.EXACT, Accuracy.CONDITIONAL}
    is_quick = is_exact or not substitute
    return provider.base_name if is_quick else cast(str, substitute)
