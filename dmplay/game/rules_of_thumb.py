"""Rules of thumb: plausible ways to choose an action that are sometimes wrong.

Explanations compare the best action with them, and puzzles are positions in which they lose.
"""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from dmplay.core import belief as beliefs
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.problem import Problem
from dmplay.core.text import format_score
from dmplay.errors import BadParameter
from dmplay.game.action_breakdown import ActionBreakdown, merge_outcomes_by_text
from dmplay.game.position import Position
from dmplay.registry.problem_module_exports import load_exported_list
from dmplay.solvers.games.bimatrix_game import build_payoffs
from dmplay.views.protocol import load_view_module

MIN_PROBABILITY_DIFFERENCE = 1e-6  # probabilities that differ by less are equal
MIN_STATE_PROBABILITY = 0.2  # smallest belief in a state that may be assumed to be certain
MIN_LIKELIHOOD_DIFFERENCE = 1e-9  # smaller differences are rounding errors
MAX_BELIEF_STATES = 64  # maximum number of states of which one is assumed to be certain


class RuleOfThumb(NamedTuple):
    """A simple rule for choosing an action, which puzzles and medals use.

    `text` is a phrase such as "throw the farthest". `choose` returns the name or the index of an
    action, or None if the rule does not choose exactly one. `find_belief` returns the belief on
    which the rule acts, if it is not the player's own. `excludes` returns whether an action of the
    rule makes no puzzle, for example a step into a wall. `describe` returns the rule as a clause
    after the name of its action, such as "which pays the most now".
    """

    text: str
    choose: Callable[[Position], int | str | None]
    find_belief: Callable[[Position], Reals | None] | None = None
    excludes: Callable[[Position, int], bool] | None = None
    describe: Callable[[Position], str] | None = None

    def describe_action(self, position: Position) -> str:
        """Return the rule as a clause after the name of the action that it chooses."""
        return (
            self.describe(position)
            if self.describe
            else f'which follows the simple rule "{self.text}"'
        )


class RuleChoice(NamedTuple):
    """An action that a rule of thumb chooses."""

    action: int
    text: str  # the rule, as a clause after the action's name


def list_rules(problem: Problem) -> list[RuleOfThumb]:
    """Return the rules of thumb in a problem's RULES_OF_THUMB, else the general ones of its kind.

    Raise BadParameter if RULES_OF_THUMB is not a list of them.
    """
    rules = load_exported_list(problem, "RULES_OF_THUMB", RuleOfThumb)
    if rules is not None:
        return rules
    if is_repeated_game(problem):
        return [REPLY_TO_COUNTS, REPLY_TO_LAST]
    if len(problem.agents) > 1:
        return []
    if problem.partially_observable:
        return [TAKE_BEST_REWARD, TRUST_LIKELIEST, TRUST_LAST_OBSERVATION]
    return [TAKE_BEST_REWARD, EXPECT_LIKELIEST]


def find_losing_rule(
    position: Position, breakdowns: Mapping[int, ActionBreakdown], best_action: int
) -> RuleChoice | None:
    """Return the first rule of thumb whose action is worth less than the best; None if all agree.

    `breakdowns` are those of all legal actions. General rules come before those of the problem.
    """
    limit = breakdowns[best_action].value - VALUE_TOLERANCE * position.problem.reward_scale
    own_rules = load_exported_list(position.problem, "RULES_OF_THUMB", RuleOfThumb) or []
    for rule in (*EXPLANATION_RULES, *(rule for rule in own_rules if not rule.find_belief)):
        action = apply_rule(position, rule)
        if action is not None and action in breakdowns and breakdowns[action].value < limit:
            return RuleChoice(action, rule.describe_action(position))
    return None


def apply_rule(position: Position, rule: RuleOfThumb) -> int | None:
    """Return the action that a rule chooses, or None; raise BadParameter if it is no action."""
    action = rule.choose(position)
    if isinstance(action, str):
        return int(position.problem.parse_action(position.seat, action))
    if action is None or action in range(len(position.labels)):
        return action
    expected = f"expected None, the name of an action, or 0 to {len(position.labels) - 1}"
    raise BadParameter(f"rule of thumb {rule.text!r}: got {action!r}, {expected}")


def is_repeated_game(problem: Problem) -> bool:
    """Return whether a problem is a game of two with one state."""
    return problem.state_count == 1 and len(problem.agents) == 2


def build_seat_payoffs(problem: Problem, seat: int) -> tuple[Reals, Reals]:
    """Return the rewards of a seat and of the other, each `[A, A']`.

    Raise BadParameter unless the problem is a game of two with one state.
    """
    if not is_repeated_game(problem):
        raise BadParameter("expected a problem with a payoff table of two agents")
    payoffs = build_payoffs(problem)
    seat_payoffs, other_payoffs = payoffs[:, :, seat], payoffs[:, :, 1 - seat]
    return (seat_payoffs, other_payoffs) if seat == 0 else (seat_payoffs.T, other_payoffs.T)


def get_last_observation(position: Position) -> str | None:
    """Return the label of the last observation; None before the first turn."""
    view = position.view
    if not view.turns_played:
        return None
    return position.problem.observations[position.seat].format_observation(view.observation)


def get_last_actions(position: Position) -> tuple[int, int] | None:
    """Return the player's and the other agent's last action; None in the first round."""
    joint_actions = position.view.joint_actions
    if not joint_actions:
        return None
    return int(joint_actions[-1][position.seat]), int(joint_actions[-1][1 - position.seat])


def _choose_best_reward(position: Position) -> int | None:
    """Choose the action with the greatest expected reward of this turn; None if several have."""
    return _find_best_value(position, position.expected_rewards())


def _assume_likeliest_outcome(position: Position) -> int | None:
    """Choose the action whose likeliest outcome is worth most, if not all outcomes are sure."""
    if position.problem.partially_observable or position.problem.state_count == 1:
        return None
    values = np.full(len(position.labels), -np.inf)
    for action in position.legal_actions:
        likeliest, *others = merge_outcomes_by_text(position.outcomes(action))
        if others and likeliest.probability - others[0].probability < MIN_PROBABILITY_DIFFERENCE:
            return None
        values[action] = likeliest.reward + position.problem.discount * likeliest.value_after
    return _find_best_value(position, values)


def _assume_likeliest_state(position: Position) -> int | None:
    """Choose the action that is best if the likeliest state is the true one."""
    belief = position.current_belief
    if belief is None:
        return None
    likeliest = find_single_best(belief, MIN_PROBABILITY_DIFFERENCE)
    if likeliest is None or belief[likeliest] >= 1.0 - MIN_PROBABILITY_DIFFERENCE:
        return None
    return _find_best_for_belief(position, np.eye(len(belief))[likeliest])


def _trust_last_observation(position: Position) -> int | None:
    """Choose the action that is best if nothing but the last turn is known."""
    belief = _find_belief_of_last_turn(position)
    return None if belief is None else _find_best_for_belief(position, belief)


def _find_belief_of_last_turn(position: Position) -> Reals | None:
    """Return the belief after the last turn if all states were equally likely before it.

    Return None if it is the player's own belief, or if there is none.
    """
    problem, seat, view = position.problem, position.seat, position.view
    current = position.current_belief
    if current is None or len(current) != problem.state_count or not view.turns_played:
        return None
    actions: list[int | None] = [None] * len(problem.agents)
    observations = list(actions)
    actions[seat], observations[seat] = int(view.actions[-1]), int(view.observation)
    uniform = np.full(len(current), 1.0 / len(current))
    posterior, likelihood = beliefs.update_belief(problem, uniform, actions, observations)
    is_own = np.allclose(posterior, current, atol=MIN_PROBABILITY_DIFFERENCE)
    return None if is_own or not likelihood else posterior


def _find_best_for_belief(position: Position, belief: Reals) -> int | None:
    """Return the best action if the belief were this one `[S]`; None if it is not known."""
    values = position.values_for_belief(belief)
    if values is None:
        return None
    return _find_best_value(position, np.where(np.isnan(values), -np.inf, values))


def _assume_observed_state(position: Position) -> int | None:
    """Choose the best action if the state that explains the last observation best were certain.

    There is none if the belief says that this state is unlikely.
    """
    state = _find_best_explanation(position)
    if state is None:
        return None
    assert isinstance(position.problem.state_count, int)
    values = position.values_for_belief(np.eye(position.problem.state_count)[state])
    return None if values is None else int(np.nanargmax(values))


def _find_best_explanation(position: Position) -> int | None:
    """Return the index of the state in which the last observation is likeliest, if it is likely."""
    problem, seat, view = position.problem, position.seat, position.view
    if not (problem.partially_observable and view.turns_played):
        return None
    current = position.current_belief
    if current is None or len(current) != problem.state_count or len(current) > MAX_BELIEF_STATES:
        return None
    actions: list[int | None] = [None] * len(problem.agents)
    observations = actions.copy()
    actions[seat] = int(view.actions[-1])
    prior = np.full(len(current), 1.0 / len(current))
    reached = problem.joint_belief_update(prior, actions, observations)
    observations[seat] = int(view.observation)
    joint = problem.joint_belief_update(prior, actions, observations)
    likelihoods = np.where(reached > 0.0, joint / np.where(reached > 0.0, reached, 1.0), 0.0)
    state = int(likelihoods.argmax())
    is_clue = np.ptp(likelihoods) > MIN_LIKELIHOOD_DIFFERENCE
    return state if is_clue and current[state] >= MIN_STATE_PROBABILITY else None


def _describe_certainty(position: Position) -> str:
    """Return the assumption of `_assume_observed_state` as a clause."""
    problem, state = position.problem, _find_best_explanation(position)
    state_name = load_view_module(problem).lesson(position.view).state_name
    name = state_name.format(problem.format_state(problem.enumerate_states()[state]))
    return f"the best if {name} were certain"


def _repeat_success(position: Position) -> int | None:
    """Choose the last action if its visible reward was positive."""
    rewards = position.view.rewards
    if not rewards or rewards[-1] <= 0.0 or not position.labels:
        return None
    return int(position.view.actions[-1])


def _reply_to_last_action(position: Position) -> int | None:
    """Choose the best response to the other agent's last action; None if no single one is."""
    last = get_last_actions(position)
    if last is None:
        return None
    payoffs, _ = build_seat_payoffs(position.problem, position.seat)
    return _find_best_value(position, payoffs[:, last[1]])


def _reply_to_frequencies(position: Position) -> int | None:
    """Choose the best response to the other agent's frequencies of actions, from two rounds on."""
    replies = [int(actions[1 - position.seat]) for actions in position.view.joint_actions or ()]
    if len(replies) < 2:
        return None
    payoffs, _ = build_seat_payoffs(position.problem, position.seat)
    return _find_best_value(position, payoffs[:, replies].sum(axis=1))


def _find_best_value(position: Position, values: Reals) -> int | None:
    """Return the action with the greatest value `[A]`; None if there are several."""
    return find_single_best(values, VALUE_TOLERANCE * position.problem.reward_scale)


def find_single_best(values: Reals, tolerance: float = VALUE_TOLERANCE) -> int | None:
    """Return the index of the greatest value; None if there are several."""
    (best,) = np.nonzero(values >= values.max() - tolerance)
    return int(best[0]) if len(best) == 1 else None


TAKE_BEST_REWARD = RuleOfThumb(
    "take the greatest expected reward of this turn, and leave later turns aside",
    _choose_best_reward,
    describe=lambda _: "which pays the most now",
)
TRUST_OBSERVATION = RuleOfThumb(
    "act as if the state that explains the last observation best were certain",
    _assume_observed_state,
    describe=_describe_certainty,
)
TRUST_LIKELIEST = RuleOfThumb(
    "act as if the likeliest hidden state were certain", _assume_likeliest_state
)
TRUST_LAST_OBSERVATION = RuleOfThumb(
    "act on the last turn alone, as if all states had been equally likely before it",
    _trust_last_observation,
    _find_belief_of_last_turn,
)
EXPECT_LIKELIEST = RuleOfThumb(
    "look only at the likeliest outcome of each action, and take the action whose likeliest "
    "outcome is worth most",
    _assume_likeliest_outcome,
    describe=lambda _: "the best if every action surely had its likeliest outcome",
)
REPEAT_SUCCESS = RuleOfThumb(
    "repeat an action that paid",
    _repeat_success,
    describe=lambda position: f"which just paid {format_score((position.view.rewards or [0])[-1])}",
)
REPLY_TO_LAST = RuleOfThumb("reply best to the other's last action", _reply_to_last_action)
REPLY_TO_COUNTS = RuleOfThumb(
    "reply best to how often the other chose each action", _reply_to_frequencies
)
# the general ones of explanations, which fit any problem
EXPLANATION_RULES = (TRUST_OBSERVATION, EXPECT_LIKELIEST, TAKE_BEST_REWARD, REPEAT_SUCCESS)
