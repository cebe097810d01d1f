"""Quantities of problems with hidden states: beliefs, observations and alpha vectors."""

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count
from dmplay.core.typed_text import find_label, parse_belief, parse_history, parse_number
from dmplay.errors import BadParameter
from dmplay.game.position import Position
from dmplay.registry.problem_module_exports import get_problem_name
from dmplay.solvers.pomdp.exact_pomdp import solve_stages
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.state_quantities import find_action, list_action_values, list_state_names
from dmplay.tutor.truth import Truth, format_number, list_best_labels

BISECTIONS = 50
ROUNDED_DIFFERENCE = 0.002  # between a probability and the same one as it is typed
MIN_CLUE_DISTANCE = 0.05  # from the answer to another probability that a reason quotes
MAX_COMPARED_TURNS = 12
GRID_SIZE = 2001  # beliefs between which the best action is compared


def belief(position: Position, state: str) -> Truth:
    """Return the probability of a hidden state after a history of actions and observations."""
    names = list_state_names(position.problem)
    index = names.index(find_label(state, names))
    probability = float(get_belief(position)[index])
    return Truth(probability, lambda typed: _describe_mistake(position, index, parse_number(typed)))


def belief_distribution(position: Position) -> Truth:
    """Return the probability of each hidden state after a history."""
    names = list_state_names(position.problem)
    probabilities = map(float, get_belief(position))
    return Truth(dict(zip(names, probabilities, strict=True)), labels=names)


def observation_probability(position: Position, action: str, observation: str) -> Truth:
    """Return the probability of an observation after an action, given a history."""
    problem, seat, probabilities = position.problem, position.seat, get_belief(position)
    turn = parse_history(problem, seat, [f"{action} {observation}"])[0]
    actions, observations = (
        [part if other == seat else None for other in range(len(problem.agents))] for part in turn
    )

    def compute_chance(belief: Reals) -> float:
        """Return the probability of the observation in a belief `[S]`."""
        return float(problem.joint_belief_update(belief, actions, observations).sum())

    possible = np.flatnonzero(probabilities > 0.0)
    names, certain_beliefs = list_state_names(problem), np.eye(len(probabilities))
    chances = {names[index]: compute_chance(certain_beliefs[index]) for index in possible}

    def explain(answer: str) -> str:
        """Return the state whose chance was typed, or the chances that the typed one leaves out.

        It is empty if all states have the same chance, which is the answer.
        """
        low, high = (choose(chances, key=lambda name: chances[name]) for choose in (min, max))
        low_text, high_text = (format_number(chances[name]) for name in (low, high))
        if low_text == high_text:
            return ""
        typed = parse_number(answer)
        for name, chance in chances.items():
            if abs(typed - chance) <= ROUNDED_DIFFERENCE:
                return f"{format_number(typed)} is the chance in the state {name} alone"
        if chances[low] <= typed <= chances[high]:
            return f"in the state {high} the chance is {high_text}, but in {low} it is {low_text}"
        return f"in each possible state, the chance is from {low_text} to {high_text}"

    return Truth(compute_chance(probabilities), explain)


def best_action_boundary(position: Position, below: str, above: str, state: str) -> Truth:
    """Return the probability of a state at which the best action changes from one to another.

    The problem has two states. That is where two alpha vectors cross: the line of the values of a
    plan that begins with `below`, and one that begins with `above`.
    """
    list_action_values(position)  # which checks that they are exact
    actions = [position.labels.index(find_action(position, text)) for text in (below, above)]
    names = list_state_names(position.problem)
    is_first = find_label(state, names) == names[0]

    def compute_values(probabilities: Reals) -> Reals:
        """Return the values `[B, A]` of the actions at probabilities `[B]` of the state."""
        beliefs = np.stack([probabilities, 1.0 - probabilities], axis=1)
        q = position.values_for_belief(beliefs if is_first else beliefs[:, ::-1])
        if q is None:
            raise BadParameter("expected values of beliefs")
        return q

    grid = np.linspace(0.0, 1.0, GRID_SIZE)
    is_best = mark_best_actions(compute_values(grid), position.problem.reward_scale)
    is_low, is_high = is_best[:, actions].T
    changes = np.flatnonzero(is_low[:-1] & is_high[1:] & ~is_high[:-1])
    if not len(changes):
        raise BadParameter(f"the best action never changes from {below} to {above}")
    low, high = grid[changes[0]], grid[changes[0] + 1]
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        low_value, high_value = compute_values(np.array([middle]))[0, actions]
        low, high = (low, middle) if high_value > low_value else (middle, high)

    def explain(answer: str) -> str:
        """Return the values of both actions at the typed probability."""
        typed = min(max(parse_number(answer), 0.0), 1.0)
        low_value, high_value = map(format_number, compute_values(np.array([typed]))[0, actions])
        at = f"at P({state}) = {format_number(typed)}"
        return f"{at}, {below} is worth {low_value} and {above} {high_value}"

    return Truth(float(low), explain)


def fewest_turns(position: PositionInGame, action: str, belief: str) -> Truth:
    """Return the fewest turns left with which an action is best in a belief."""
    label, scale = find_action(position, action), position.problem.reward_scale
    parse_belief(position.problem, belief)  # which checks that it is not empty
    values_by_turns = [  # the longest plan first, which contains the others
        list_action_values(position.ask(belief=belief, turns_left=turns))
        for turns in range(MAX_COMPARED_TURNS, 0, -1)
    ][::-1]
    is_best = [label in list_best_labels(values, scale) for values in values_by_turns]
    if True not in is_best:
        raise BadParameter(f"{action} is not best with 1 to {MAX_COMPARED_TURNS} turns left")

    def explain(answer: str) -> str:
        """Return the values of the action and of the best one with this many turns."""
        typed = min(max(round(parse_number(answer)), 1), MAX_COMPARED_TURNS)
        values = values_by_turns[typed - 1]
        value, best = format_number(values[label]), format_number(max(values.values()))
        comparison = "is already best" if is_best[typed - 1] else f"another action is worth {best}"
        turns = f"with {format_count(typed, 'turn')} left"
        return f"{turns}, {action} is worth {value}, and {comparison}"

    return Truth(float(is_best.index(True) + 1), explain)


def alpha_vector_count(position: PositionInGame, turns_left: int) -> Truth:
    """Return the number of alpha vectors that are best for some belief."""
    if turns_left < 1:
        raise BadParameter(f"turns_left: got {turns_left}, expected 1 or more")
    stage = solve_stages(position.problem, turns_left)[-1]
    plans = sum(len(plans.alpha_vectors) for plans in stage.plans_by_action)
    reason = f"{plans} plans are compared; a line that is never highest does not count"
    return Truth(float(len(stage.alpha_vectors)), lambda _: reason)


def _describe_mistake(position: Position, index: int, answer: float) -> str:
    """Return the other probability that was typed, else its prior, in words; '' without a belief.

    Usual mistakes are the probability before the last observation, its likelihood in a state, and
    the product of both. The prior is found by Bayes' rule backwards, with the true proportions of
    the other states.
    """
    problem, view = position.problem, position.view
    if not view.actions or view.beliefs is None or len(problem.agents) > 1:
        return ""
    tables, action, observation = tabulate(problem), int(view.actions[-1]), int(view.observation)
    predicted = view.beliefs[-2] @ tables.transition[:, action]
    likelihoods = tables.observation_model[action, :, observation]
    observed = problem.observations[position.seat].format_observation(view.observation)
    if not np.ptp(likelihoods):
        text = "your last action showed nothing about the state; only changes of the state count"
        first = float(view.beliefs[1][index])
        is_clue = len(view.actions) > 2 and abs(first - predicted[index]) > MIN_CLUE_DISTANCE
        return f"{text}. After the first action, it was {format_number(first)}" if is_clue else text
    names, typed = list_state_names(problem), format_number(answer)
    name, posterior = names[index], f"P({names[index]} | {observed})"
    usual_mistakes = {
        f"P({name}) just before {observed!r}": predicted[index],
        **{f"P({observed} | {other})": p for other, p in zip(names, likelihoods, strict=True)},
        f"P({name} and {observed})": predicted[index] * likelihoods[index],
    }
    if not 0.0 < answer < 1.0:
        return ""
    for mistake, probability in usual_mistakes.items():
        if abs(answer - probability) <= ROUNDED_DIFFERENCE:
            return f"{typed} is {mistake}; the question is {posterior}"
    others = np.arange(len(predicted)) != index
    weight, own_likelihood = float(predicted[others].sum()), float(likelihoods[index])
    if not (weight and own_likelihood):
        return ""
    other_likelihood = float(predicted[others] @ likelihoods[others]) / weight
    odds = answer / (1.0 - answer) * other_likelihood / own_likelihood
    before = format_number(odds / (1.0 + odds))
    return f"{typed} would follow if P({name}) were {before} just before {observed!r}"


def get_belief(position: Position) -> Reals:
    """Return the belief `[S]` of a position; raise BadParameter if it has none."""
    if position.view.beliefs is None:
        raise BadParameter(f"{get_problem_name(position.problem)} has no beliefs at this position")
    return position.view.belief


def describe_belief(position: Position) -> str:
    """Return the probability of each state as text."""
    pairs = zip(list_state_names(position.problem), map(float, get_belief(position)), strict=True)
    listed = [f"P({name}) = {format_number(p)}" for name, p in pairs]
    return f"the probabilities of the hidden states are {', '.join(listed)}"
