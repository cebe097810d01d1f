"""Rules of thumb: plausible ways to choose an action that are sometimes wrong."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from dmplay.core import belief as beliefs
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.problem import Problem
from dmplay.registry.problem_module_exports import load_exported_list
from dmplay.tutor.game_quantities import own_payoffs
from dmplay.tutor.valued_position import (
    MIN_PROBABILITY_DIFFERENCE,
    ValuedPosition,
    is_repeated_game,
)


class RuleOfThumb(NamedTuple):
    """A rule of thumb.

    `choose` returns None if the rule does not name exactly one action. `find_belief` returns the
    belief on which the rule acts, if it is not the player's own. `excludes` returns whether an
    action of the rule makes no puzzle, for example a step into a wall.
    """

    text: str  # a phrase such as "throw the farthest"
    choose: Callable[[ValuedPosition], int | None]
    find_belief: Callable[[ValuedPosition], Reals | None] | None = None
    excludes: Callable[[ValuedPosition, int], bool] | None = None


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


def choose_always(label: str) -> Callable[[ValuedPosition], int]:
    """Return the rule that always chooses the action with this label."""
    return lambda position: int(position.problem.parse_action(position.seat, label))


def _take_best_reward(position: ValuedPosition) -> int | None:
    """Choose the action with the greatest expected reward of this turn."""
    return _find_best_value(position, position.compute_rewards())


def _expect_likeliest(position: ValuedPosition) -> int | None:
    """Choose the action whose likeliest outcome is worth most."""
    values = np.full(len(position.labels), -np.inf)
    for action in np.flatnonzero(position.legal_actions_mask).tolist():
        outcome = position.find_likeliest_outcome(action)
        if outcome is None:
            return None
        values[action] = position.sum_outcomes([outcome._replace(probability=1.0)])
    return _find_best_value(position, values)


def _trust_likeliest(position: ValuedPosition) -> int | None:
    """Choose the action that is best if the likeliest state is the true one."""
    belief = position.session.view(position.seat).belief
    likeliest = find_single_best(belief, MIN_PROBABILITY_DIFFERENCE)
    if likeliest is None or belief[likeliest] >= 1.0 - MIN_PROBABILITY_DIFFERENCE:
        return None
    return _find_best_for_belief(position, np.eye(len(belief))[likeliest])


def _trust_last_observation(position: ValuedPosition) -> int | None:
    """Choose the action that is best if nothing but the last turn is known."""
    belief = _find_belief_of_last_turn(position)
    return None if belief is None else _find_best_for_belief(position, belief)


def _find_belief_of_last_turn(position: ValuedPosition) -> Reals | None:
    """Return the belief after the last turn if all states were equally likely before it.

    Return None if it is the player's own belief.
    """
    problem, seat, view = position.problem, position.seat, position.session.view(position.seat)
    if not view.turns_played:
        return None
    actions: list[int | None] = [None] * len(problem.agents)
    observations = list(actions)
    actions[seat], observations[seat] = int(view.actions[-1]), int(view.observation)
    uniform = np.full(len(view.belief), 1.0 / len(view.belief))
    posterior, likelihood = beliefs.update_belief(problem, uniform, actions, observations)
    is_own = np.allclose(posterior, view.belief, atol=MIN_PROBABILITY_DIFFERENCE)
    return None if is_own or not likelihood else posterior


def _find_best_for_belief(position: ValuedPosition, belief: Reals) -> int | None:
    """Return the best action if the belief were this one `[S]`.

    Return None if the values are not those of the belief, as the first array of the memory.
    """
    if not position.memory or position.memory[0].shape != (1, len(belief)):
        return None
    values = position.hint_agent.policy.action_values((belief[None], *position.memory[1:]))
    assert values is not None
    return _find_best_value(position, np.where(position.legal_actions_mask, values[0], -np.inf))


def get_last_observation(position: ValuedPosition) -> str | None:
    """Return the label of the last observation; None before the first turn."""
    view = position.session.view(position.seat)
    if not view.turns_played:
        return None
    return position.problem.observations[position.seat].format_observation(view.observation)


def get_last_actions(position: ValuedPosition) -> tuple[int, int] | None:
    """Return the player's and the other agent's last action; None in the first round."""
    if not position.session.turns:
        return None
    actions = position.session.turns[-1].actions
    return int(actions[position.seat]), int(actions[1 - position.seat])


def _reply_to_last(position: ValuedPosition) -> int | None:
    """Choose the best reply to the other agent's last action."""
    last = get_last_actions(position)
    if last is None:
        return None
    return _find_best_value(position, own_payoffs(position.position)[:, last[1]])


def _reply_to_counts(position: ValuedPosition) -> int | None:
    """Choose the best reply to how often the other agent chose each action, from two rounds on."""
    payoffs, turns = own_payoffs(position.position), position.session.turns
    replies = [int(turn.actions[1 - position.seat]) for turn in turns]
    if len(replies) < 2:
        return None
    return _find_best_value(position, payoffs[:, replies].sum(axis=1))


def _find_best_value(position: ValuedPosition, values: Reals) -> int | None:
    """Return the action with the greatest value `[A]`; None if there are several."""
    return find_single_best(values, VALUE_TOLERANCE * position.problem.reward_scale)


def find_single_best(values: Reals, tolerance: float = VALUE_TOLERANCE) -> int | None:
    """Return the index of the greatest value; None if there are several."""
    (best,) = np.nonzero(values >= values.max() - tolerance)
    return int(best[0]) if len(best) == 1 else None


TAKE_BEST_REWARD = RuleOfThumb(
    "take the greatest expected reward of this turn, and leave later turns aside", _take_best_reward
)
TRUST_LIKELIEST = RuleOfThumb("act as if the likeliest hidden state were certain", _trust_likeliest)
TRUST_LAST_OBSERVATION = RuleOfThumb(
    "act on the last turn alone, as if all states had been equally likely before it",
    _trust_last_observation,
    _find_belief_of_last_turn,
)
EXPECT_LIKELIEST = RuleOfThumb(
    "look only at the likeliest outcome of each action, and take the action whose likeliest "
    "outcome is worth most",
    _expect_likeliest,
)
REPLY_TO_LAST = RuleOfThumb("reply best to the other's last action", _reply_to_last)
REPLY_TO_COUNTS = RuleOfThumb(
    "reply best to how often the other chose each action", _reply_to_counts
)
