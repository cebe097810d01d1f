"""Rules of thumb: plausible ways to choose an action that are sometimes wrong."""

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from dmplay.core import belief as beliefs
from dmplay.core.arrays import Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.problem import Problem
from dmplay.core.session import SeatedPolicy
from dmplay.problems.hexworld import HexWorld
from dmplay.problems.predator_prey import PredatorPrey
from dmplay.problems.shared.hexgrid import move_destinations, path_lengths
from dmplay.registry import agents
from dmplay.registry.problems import builtin_stem
from dmplay.tutor.valued_position import ValuedPosition

Chooser = Callable[[], int | None]  # returns None if the rule names no single action


class RuleOfThumb(NamedTuple):
    """A rule of thumb; `start` returns a function that follows it in a game."""

    text: str  # a phrase such as "throw the farthest"
    start: Callable[[ValuedPosition], Chooser]


# Agents that follow a rule, with the rule in words, by the file name of the problem.
AGENT_RULES: Mapping[str, Mapping[str, str]] = {
    "catch": {},
    "crying_baby": {
        "feed-when-crying": "feed the baby if it cries, and ignore it if it is quiet",
    },
    "machine_replacement": {
        "always-manufacture": "manufacture, as only that earns money",
    },
    "multicaregiver_crying_baby": {
        "feed-when-crying": "feed the baby if it cries, and ignore it if it is quiet",
    },
    "predator_prey": {
        "chase": "step towards the prey",
        "flee": "step away from the predator",
    },
    "prisoners_dilemma": {
        "always-cooperate": "cooperate, whatever the other does",
        "always-defect": "defect, as it pays more in each single round",
        "tit-for-tat": "do what the other did last",
        "win-stay-lose-shift": "repeat the action if it paid well, else change it",
    },
    "rock_paper_scissors": {
        "beat-last": "beat the other's last action",
        "frequency": "reply best to the other's actions so far, counted",
    },
    "travelers_dilemma": {
        "claim": "claim the highest amount",
        "nash": "claim the amount of the Nash equilibrium, from which nobody gains by changing",
    },
}
QMDP_TEXT = "plan as if the state will be visible from the next turn on (QMDP)"


def list_rules(problem: Problem, seat: int) -> list[RuleOfThumb]:
    """Return the rules of thumb for a seat: those of the problem first, then the general ones."""
    roster = agents.load_roster(problem, seat).agents
    texts = dict(AGENT_RULES.get(builtin_stem(problem), {}))
    if isinstance(problem, PredatorPrey):
        del texts["flee" if seat in problem.predator_seats else "chase"]
    if problem.partially_observable and "qmdp" in roster:
        texts["qmdp"] = QMDP_TEXT
    rules = [
        RuleOfThumb(text, _follow_agent(name)) for name, text in texts.items() if name in roster
    ]
    if isinstance(problem, HexWorld):
        rules += [
            RuleOfThumb("walk straight to the nearest good exit", _walk_to_nearest_exit),
            RuleOfThumb("walk straight to the richest exit", _walk_to_richest_exit),
        ]
    stem = builtin_stem(problem)
    if stem == "catch":
        rules.append(RuleOfThumb("throw the farthest, as it pays most", _take_last_action))
        rules.append(RuleOfThumb("repeat a throw that was caught", _repeat_success))
    if stem == "travelers_dilemma":
        rules.append(RuleOfThumb("claim one less than the other's last claim", _undercut))
    return rules + (_list_general_rules(problem) if len(problem.agents) == 1 else [])


def _list_general_rules(problem: Problem) -> list[RuleOfThumb]:
    """Return the rules of thumb for any problem of one agent."""
    rules = []
    if not isinstance(problem, HexWorld):  # its rewards are paid at the exits only
        rules.append(RuleOfThumb("take the most that this turn alone can pay", _take_best_reward))
    if problem.partially_observable:
        rules.append(RuleOfThumb("act as if the likeliest state were certain", _trust_likeliest))
        rules.append(RuleOfThumb("act on the last observation alone", _trust_last_observation))
    else:
        rules.append(
            RuleOfThumb("count on the likeliest outcome of each action", _expect_likeliest)
        )
    return rules


def _follow_agent(name: str) -> Callable[[ValuedPosition], Chooser]:
    """Return the start of a rule that an agent follows."""

    def start(position: ValuedPosition) -> Chooser:
        policy = agents.load_agent(position.problem, position.seat, name)
        follower = SeatedPolicy(position.session, position.seat, policy)
        return lambda: int(follower.choose())

    return start


def _take_best_reward(position: ValuedPosition) -> Chooser:
    """Choose the action with the greatest expected reward of this turn."""
    return lambda: _find_single_best(position.compute_rewards())


def _expect_likeliest(position: ValuedPosition) -> Chooser:
    """Choose the action whose likeliest outcome is worth most."""

    def choose() -> int | None:
        values = np.full(len(position.labels), -np.inf)
        for action in np.flatnonzero(position.legal_actions_mask).tolist():
            values[action] = position.sum_outcomes(
                [position.list_outcomes(action)[0]._replace(probability=1.0)]
            )
        return _find_single_best(values)

    return choose


def _trust_likeliest(position: ValuedPosition) -> Chooser:
    """Choose the action that is best if the likeliest state is the true one."""

    def choose() -> int | None:
        (belief,) = position.memory[0]
        likeliest = _find_single_best(belief)
        if likeliest is None:
            return None
        return _find_best_for_belief(position, np.eye(len(belief))[likeliest])

    return choose if _plans_by_belief(position) else _choose_nothing


def _trust_last_observation(position: ValuedPosition) -> Chooser:
    """Choose the action that is best if nothing but the last turn is known."""
    problem, seat = position.problem, position.seat

    def choose() -> int | None:
        view = position.session.view(seat)
        if view.turns_played < 2:
            return None
        actions: list[int | None] = [None] * len(problem.agents)
        observations = list(actions)
        actions[seat], observations[seat] = int(view.actions[-1]), int(view.observation)
        uniform = np.full(len(view.belief), 1.0 / len(view.belief))
        posterior, likelihood = beliefs.update_belief(problem, uniform, actions, observations)
        return _find_best_for_belief(position, posterior) if likelihood else None

    return choose if _plans_by_belief(position) else _choose_nothing


def _plans_by_belief(position: ValuedPosition) -> bool:
    """Return whether the values are those of the belief, as the first array of the memory."""
    memory, belief = position.memory, position.session.view(position.seat).belief
    return bool(memory) and memory[0].shape == (1, *belief.shape)


def _choose_nothing() -> None:
    """Return None, as the rule does not apply."""


def _find_best_for_belief(position: ValuedPosition, belief: Reals) -> int | None:
    """Return the best action if the belief were this one `[S]`."""
    values = position.hint_agent.policy.action_values((belief[None], *position.memory[1:]))
    assert values is not None
    return _find_single_best(np.where(position.legal_actions_mask, values[0], -np.inf))


def _walk_to_nearest_exit(position: ValuedPosition) -> Chooser:
    """Choose the step on the shortest way to the nearest exit with a positive reward."""
    return _walk_to_exit(position, lambda distance, reward: distance)


def _walk_to_richest_exit(position: ValuedPosition) -> Chooser:
    """Choose the step on the shortest way to the exit with the greatest reward."""
    return _walk_to_exit(position, lambda distance, reward: -reward)


def _walk_to_exit(position: ValuedPosition, rank_exit: Callable[[float, float], float]) -> Chooser:
    """Choose the step towards the good exit of the lowest rank, if there is only one step."""
    problem = position.problem
    assert isinstance(problem, HexWorld)
    lengths = path_lengths(problem.hexes)
    destinations = move_destinations(problem.hexes)[:, :, 0]
    exits = [(problem.hexes.index(hex_), pay) for hex_, pay in problem.rewards if pay > 0]

    def choose() -> int | None:
        location = int(position.session.state)
        if not exits or location in [index for index, _ in exits]:
            return None
        ranks = [rank_exit(lengths[location, index], pay) for index, pay in exits]
        goal = _find_single_best(-np.array(ranks, float))
        if goal is None:
            return None
        return _find_single_best(-lengths[destinations[location], exits[goal][0]].astype(float))

    return choose


def _take_last_action(position: ValuedPosition) -> Chooser:
    """Choose the last of the actions, such as the farthest throw."""
    return lambda: len(position.labels) - 1


def _repeat_success(position: ValuedPosition) -> Chooser:
    """Repeat the last action if the ball was caught, which is the last observation."""

    def choose() -> int | None:
        view = position.session.view(position.seat)
        if not view.turns_played:
            return None
        observation = position.problem.observations[position.seat]
        is_caught = observation.format_observation(view.observation) == "caught"
        return int(view.actions[-1]) if is_caught else None

    return choose


def _undercut(position: ValuedPosition) -> Chooser:
    """Choose the action just below the other agent's last one."""

    def choose() -> int | None:
        turns = position.session.turns
        last_claim = int(turns[-1].actions[1 - position.seat]) if turns else 0
        return last_claim - 1 if last_claim else None

    return choose


def _find_single_best(values: Reals) -> int | None:
    """Return the index of the greatest value; None if there are several."""
    (best,) = np.nonzero(values >= values.max() - VALUE_TOLERANCE)
    return int(best[0]) if len(best) == 1 else None
