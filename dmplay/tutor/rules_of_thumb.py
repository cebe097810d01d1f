"""Rules of thumb: plausible ways to choose an action that are sometimes wrong."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core import belief as beliefs
from dmplay.core.arrays import Ints, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.hexgrid import move_destinations, path_lengths
from dmplay.core.problem import Problem
from dmplay.problems._shared.hex_hunt import HexHunt
from dmplay.problems.hexworld.rules import HexWorld
from dmplay.problems.predator_prey.rules import PredatorPrey
from dmplay.registry import agents
from dmplay.registry.problem_module_exports import find_folder_name
from dmplay.tutor.game_quantities import own_payoffs
from dmplay.tutor.valued_position import (
    MIN_PROBABILITY_DIFFERENCE,
    ValuedPosition,
    is_repeated_game_without_rules,
)


class RuleOfThumb(NamedTuple):
    """A rule of thumb.

    `choose` returns None if the rule does not name exactly one action. `find_belief` returns the
    belief on which the rule acts, if it is not the player's own.
    """

    text: str  # a phrase such as "throw the farthest"
    choose: Callable[[ValuedPosition], int | None]
    find_belief: Callable[[ValuedPosition], Reals | None] | None = None


def list_rules(problem: Problem) -> list[RuleOfThumb]:
    """Return the rules of thumb for a problem: its own ones first, then the general ones."""
    rules = list(PROBLEM_RULES.get(find_folder_name(problem).replace("-", "_"), []))
    if isinstance(problem, HexWorld | PredatorPrey):  # most steps have the same reward
        return [*rules, EXPECT_LIKELIEST]
    if is_repeated_game_without_rules(problem):
        return [REPLY_TO_COUNTS, REPLY_TO_LAST]
    if len(problem.agents) > 1:
        return rules
    if problem.partially_observable:
        return [*rules, TAKE_BEST_REWARD, TRUST_LIKELIEST, TRUST_LAST_OBSERVATION]
    return [*rules, TAKE_BEST_REWARD, EXPECT_LIKELIEST]


def _choose_always(label: str) -> Callable[[ValuedPosition], int]:
    """Return the rule that always chooses the action with this label."""
    return lambda position: position.labels.index(label)


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
    likeliest = _find_single_best(belief, MIN_PROBABILITY_DIFFERENCE)
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


def _walk_to_nearest_exit(position: ValuedPosition) -> int | None:
    """Choose the step on the shortest way to the nearest exit with a positive reward."""
    return _walk_to_exit(position, lambda distance, reward: distance)


def _walk_to_richest_exit(position: ValuedPosition) -> int | None:
    """Choose the step on the shortest way to the exit with the greatest reward."""
    return _walk_to_exit(position, lambda distance, reward: -reward)


def _walk_to_exit(
    position: ValuedPosition, rank_exit: Callable[[float, float], float]
) -> int | None:
    """Choose the step towards the good exit of the lowest rank, if there is only one step."""
    problem = position.problem
    assert isinstance(problem, HexWorld)
    lengths = path_lengths(problem.hexes)
    location = int(position.session.state)
    exits = [(problem.hexes.index(hex_), pay) for hex_, pay in problem.rewards if pay > 0]
    if not exits or location in [index for index, _ in exits]:
        return None
    ranks = [rank_exit(lengths[location, index], pay) for index, pay in exits]
    goal = _find_single_best(-np.array(ranks, float))
    if goal is None:
        return None
    return _find_single_step(position, -lengths[:, exits[goal][0]])


def _step_towards_prey(position: ValuedPosition) -> int | None:
    """Choose the step after which the nearest prey is closer."""
    return _step_by_distance(position, is_predator=True)


def _step_away_from_predator(position: ValuedPosition) -> int | None:
    """Choose the step after which the nearest predator is farther away."""
    return _step_by_distance(position, is_predator=False)


def _step_by_distance(position: ValuedPosition, *, is_predator: bool) -> int | None:
    """Choose the only step that brings a predator closer to the prey, or a prey farther away."""
    problem, state = position.problem, position.session.state
    assert isinstance(problem, PredatorPrey)
    others = problem.prey_seats if is_predator else problem.predator_seats
    if (position.seat in problem.predator_seats) != is_predator:
        return None
    distances = path_lengths(problem.hexes)[:, state[list(others)]].min(axis=1)  # [H]
    return _find_single_step(position, -distances if is_predator else distances)


def _find_single_step(position: ValuedPosition, scores: Ints) -> int | None:
    """Return the direction to a hex with a greater score `[H]`, if only one direction is best."""
    location, destinations = _list_destinations(position)
    action = _find_single_best(scores[destinations].astype(float))
    is_better = action is not None and scores[destinations[action]] > scores[location]
    return action if is_better else None


def hits_wall(position: ValuedPosition, action: int) -> bool:
    """Return whether an action is a step into a wall, after which the player stays."""
    if not isinstance(position.problem, HexWorld | HexHunt):
        return False
    location, destinations = _list_destinations(position)
    return bool(destinations[action] == location)


def _list_destinations(position: ValuedPosition) -> tuple[int, Ints]:
    """Return the player's hex, and the hex after a step without a slip in each direction `[6]`."""
    problem = position.problem
    assert isinstance(problem, HexWorld | HexHunt)
    location = int(np.atleast_1d(position.session.state)[position.seat])
    return location, move_destinations(problem.hexes)[location, :, 0]


def _feed_when_crying(position: ValuedPosition) -> int | None:
    """Choose to feed if the last observation is crying, and to ignore if it is quiet."""
    sound = _get_last_observation(position)
    if sound is None:
        return None
    return position.labels.index("feed" if sound == "crying" else "ignore")


def _repeat_success(position: ValuedPosition) -> int | None:
    """Repeat the last action if the ball was caught, which is the last observation."""
    is_caught = _get_last_observation(position) == "caught"
    return int(position.session.view(position.seat).actions[-1]) if is_caught else None


def _get_last_observation(position: ValuedPosition) -> str | None:
    """Return the label of the last observation; None before the first turn."""
    view = position.session.view(position.seat)
    if not view.turns_played:
        return None
    return position.problem.observations[position.seat].format_observation(view.observation)


def _get_last_actions(position: ValuedPosition) -> tuple[int, int] | None:
    """Return the player's and the other agent's last action; None in the first round."""
    if not position.session.turns:
        return None
    actions = position.session.turns[-1].actions
    return int(actions[position.seat]), int(actions[1 - position.seat])


def _copy_last(position: ValuedPosition) -> int | None:
    """Choose the other agent's last action."""
    last = _get_last_actions(position)
    return None if last is None else last[1]


def _win_stay_lose_shift(position: ValuedPosition) -> int | None:
    """Repeat the last action if the other agent cooperated, else change it."""
    last = _get_last_actions(position)
    if last is None:
        return None
    has_cooperated = position.labels[last[1]] == "cooperate"
    return last[0] if has_cooperated else 1 - last[0]


def _reply_to_last(position: ValuedPosition) -> int | None:
    """Choose the best reply to the other agent's last action."""
    last = _get_last_actions(position)
    if last is None:
        return None
    return _find_best_value(position, own_payoffs(position.position)[:, last[1]])


def _undercut(position: ValuedPosition) -> int | None:
    """Choose the claim below the other agent's last one, if there is one."""
    last = _get_last_actions(position)
    return last[1] - 1 if last is not None and last[1] else None


def _reply_to_counts(position: ValuedPosition) -> int | None:
    """Choose the best reply to how often the other agent chose each action, from two rounds on."""
    payoffs, turns = own_payoffs(position.position), position.session.turns
    replies = [int(turn.actions[1 - position.seat]) for turn in turns]
    if len(replies) < 2:
        return None
    return _find_best_value(position, payoffs[:, replies].sum(axis=1))


def _play_pure_equilibrium(position: ValuedPosition) -> int | None:
    """Choose the action of the Nash equilibrium, if it is not mixed."""
    nash = agents.load_agent(position.problem, position.seat, "nash")
    assert isinstance(nash, SeatPolicy)
    probabilities = nash.choice_probabilities(nash.initial_memory(position.session.state[None]))
    assert probabilities is not None
    is_mixed = probabilities.max() < 1.0 - MIN_PROBABILITY_DIFFERENCE
    return None if is_mixed else int(np.argmax(probabilities))


def _find_best_value(position: ValuedPosition, values: Reals) -> int | None:
    """Return the action with the greatest value `[A]`; None if there are several."""
    return _find_single_best(values, VALUE_TOLERANCE * position.problem.reward_scale)


def _find_single_best(values: Reals, tolerance: float = VALUE_TOLERANCE) -> int | None:
    """Return the index of the greatest value; None if there are several."""
    (best,) = np.nonzero(values >= values.max() - tolerance)
    return int(best[0]) if len(best) == 1 else None


TAKE_BEST_REWARD = RuleOfThumb(
    "take the greatest expected reward of this turn, and leave later turns aside",
    _take_best_reward,
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
FEED_WHEN_CRYING = RuleOfThumb(
    "feed the baby after crying, and ignore it after quiet", _feed_when_crying
)
REPLY_TO_LAST = RuleOfThumb("reply best to the other's last action", _reply_to_last)
REPLY_TO_COUNTS = RuleOfThumb(
    "reply best to how often the other chose each action", _reply_to_counts
)
# By the file name of the problem.
PROBLEM_RULES: Mapping[str, Sequence[RuleOfThumb]] = {
    "catch": [
        RuleOfThumb("throw the farthest, as it pays most", _choose_always("100")),
        RuleOfThumb("repeat the last throw if it was caught", _repeat_success),
    ],
    "crying_baby": [FEED_WHEN_CRYING],
    "hexworld": [
        RuleOfThumb("walk straight to the nearest good exit", _walk_to_nearest_exit),
        RuleOfThumb("walk straight to the richest exit", _walk_to_richest_exit),
    ],
    "machine_replacement": [
        RuleOfThumb("manufacture, as it earns most", _choose_always("manufacture")),
    ],
    "multicaregiver_crying_baby": [FEED_WHEN_CRYING],
    "predator_prey": [
        RuleOfThumb("step towards the prey", _step_towards_prey),
        RuleOfThumb("step away from the predator", _step_away_from_predator),
    ],
    "prisoners_dilemma": [
        RuleOfThumb("do what the other did last", _copy_last),
        RuleOfThumb(
            "repeat your last action if the other cooperated, else change it "
            "(win-stay, lose-shift)",
            _win_stay_lose_shift,
        ),
        RuleOfThumb("cooperate, whatever the other does", _choose_always("cooperate")),
        RuleOfThumb("defect, as it pays more in each single round", _choose_always("defect")),
    ],
    "rock_paper_scissors": [
        REPLY_TO_COUNTS,
        RuleOfThumb("beat the other's last action", _reply_to_last),
    ],
    "travelers_dilemma": [
        RuleOfThumb("claim one less than the other's last claim", _undercut),
        RuleOfThumb("claim the highest amount", _choose_always("100")),
        RuleOfThumb(
            "play the Nash equilibrium, from which no agent gains by a change of its own",
            _play_pure_equilibrium,
        ),
    ],
}
