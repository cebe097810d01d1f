"""Quantities of problems with hidden states: beliefs, observations and alpha vectors."""

from collections.abc import Sequence

import numpy as np

from dmplay.core.arrays import Reals
from dmplay.core.belief import initial_belief
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count
from dmplay.core.typed_text import find_label, parse_belief, parse_history, parse_number
from dmplay.errors import BadParameter
from dmplay.solvers.pomdp.exact_pomdp import AlphaVectorStage, compute_action_values, solve_stages
from dmplay.tutor.positions import PositionInGame
from dmplay.tutor.state_quantities import find_action
from dmplay.tutor.truth import Truth, format_number

BISECTIONS = 50
ROUNDED_DIFFERENCE = 0.002  # between a probability and the same one as it is typed
MIN_CLUE_DISTANCE = 0.05  # from the answer to another probability that a reason quotes
MAX_COMPARED_TURNS = 12
GRID_SIZE = 2001  # beliefs between which the best action is compared


def belief(position: PositionInGame, state: str, history: Sequence[str] = ()) -> Truth:
    """Return the probability of a hidden state after a history of actions and observations."""
    probabilities = compute_belief(position, history)
    return Truth(
        float(probabilities[_state_index(position, state)]),
        lambda answer: describe_implied_prior(position, history, state, parse_number(answer)),
    )


def belief_distribution(position: PositionInGame, history: Sequence[str] = ()) -> Truth:
    """Return the probability of each hidden state after a history."""
    names = _state_names(position)
    probabilities = compute_belief(position, history)
    return Truth(dict(zip(names, map(float, probabilities), strict=True)), labels=names)


def observation_probability(
    position: PositionInGame, action: str, observation: str, history: Sequence[str] = ()
) -> Truth:
    """Return the probability of an observation after an action, given a history."""
    problem, seat = position.problem, position.seat
    actions: list[int | None] = [None] * len(problem.agents)
    observations = actions.copy()
    actions[seat], observations[seat] = parse_history(problem, seat, [f"{action} {observation}"])[0]
    probabilities = compute_belief(position, history)
    chances = {
        problem.format_state(s): float(
            problem.joint_belief_update(certainty, actions, observations).sum()
        )
        for s, certainty, p in zip(
            problem.enumerate_states(), np.eye(len(probabilities)), probabilities, strict=True
        )
        if p > 0.0
    }

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

    joint = problem.joint_belief_update(probabilities, actions, observations)
    return Truth(float(joint.sum()), explain)


def best_action_boundary(
    position: PositionInGame, below: str, above: str, state: str, turns_left: int
) -> Truth:
    """Return the probability of a state at which the best action changes from one to another.

    The problem has two states. That is where two alpha vectors cross: the line of the values of a
    plan that begins with `below`, and one that begins with `above`.
    """
    stage = _solve(position, turns_left)
    low_action, high_action = (_action_index(position, text) for text in (below, above))
    index = _state_index(position, state)
    grid = np.linspace(0.0, 1.0, GRID_SIZE)
    q = compute_action_values(stage, _make_beliefs(position, index, grid))
    is_best = mark_best_actions(q, position.problem.reward_scale)
    is_low, is_high = is_best[:, low_action], is_best[:, high_action]
    changes = np.flatnonzero(is_low[:-1] & is_high[1:] & ~is_high[:-1])
    if not len(changes):
        raise BadParameter(f"the best action never changes from {below} to {above}")
    low, high = grid[changes[0]], grid[changes[0] + 1]
    for _ in range(BISECTIONS):
        middle = (low + high) / 2
        values = compute_action_values(stage, _make_beliefs(position, index, np.array([middle])))
        is_above = values[0, high_action] > values[0, low_action]
        low, high = (low, middle) if is_above else (middle, high)

    def explain(answer: str) -> str:
        """Return the values of both actions at the typed probability."""
        typed = min(max(parse_number(answer), 0.0), 1.0)
        values = compute_action_values(stage, _make_beliefs(position, index, np.array([typed])))[0]
        low_value, high_value = (format_number(float(values[a])) for a in (low_action, high_action))
        at = f"at P({state}) = {format_number(typed)}"
        return f"{at}, {below} is worth {low_value} and {above} {high_value}"

    return Truth(float(low), explain)


def belief_loss(position: PositionInGame, action: str, belief: str, turns_left: int) -> Truth:
    """Return the regret of an action in a belief, such as "hungry 0.3 sated 0.7"."""
    q = compute_action_values(_solve(position, turns_left), _parse_belief(position, belief))[0]
    index = _action_index(position, action)

    labels = position.problem.actions[position.seat].labels
    is_best = mark_best_actions(q, position.problem.reward_scale)[index]

    loss = float(q.max() - q[index])

    def explain(answer: str) -> str:
        """Return the value of the action, and the name of the best one.

        If another loss is typed, return the value that the best action would then have instead.
        """
        best, value = labels[int(q.argmax())], float(q[index])
        if answer != format_number(loss):
            implied = format_number(value + parse_number(answer))
            return f"if it were right, {best} would be worth {implied} in this belief"
        worth = f"in this belief, {labels[index]} is worth {format_number(value)}"
        return worth if is_best else f"{worth}, and {best} is best"

    return Truth(loss, explain)


def belief_value(position: PositionInGame, action: str, belief: str, turns_left: int) -> Truth:
    """Return the expected return after an action in a belief, if you play best afterwards."""
    stage, index = _solve(position, turns_left), _action_index(position, action)
    value = float(compute_action_values(stage, _parse_belief(position, belief))[0, index])
    names = _state_names(position)

    def explain(answer: str) -> str:
        """Return the value in each state if the player were sure of it, and where the answer is."""
        values = compute_action_values(stage, np.eye(len(names)))[:, index]
        listed = [
            f"{format_number(float(v))} (sure of {name})"
            for name, v in zip(names, values, strict=True)
        ]
        if len(names) != 2 or not np.ptp(values):
            return f"the values in the states are {', '.join(listed)}"
        share = format_number(float((parse_number(answer) - values[0]) / (values[1] - values[0])))
        return f"it is {share} of the way from {listed[0]} to {listed[1]}"

    return Truth(value, explain)


def fewest_turns(position: PositionInGame, action: str, belief: str) -> Truth:
    """Return the fewest turns left with which an action is best in a belief."""
    beliefs, index = _parse_belief(position, belief), _action_index(position, action)
    problem = position.problem
    stages = solve_stages(problem, MAX_COMPARED_TURNS)
    q = [compute_action_values(stage, beliefs)[0] for stage in stages]
    is_best = mark_best_actions(np.array(q), problem.reward_scale)[:, index]  # [turns]
    turns = int(np.argmax(is_best)) + 1 if is_best.any() else 0
    if not turns:
        raise BadParameter(f"{action} is not best with 1 to {MAX_COMPARED_TURNS} turns left")

    def explain(answer: str) -> str:
        """Return the values of the action and of the best one with this many turns."""
        typed = min(max(round(parse_number(answer)), 1), MAX_COMPARED_TURNS)
        values = q[typed - 1]
        value, best = (format_number(float(v)) for v in (values[index], values.max()))
        comparison = f"and another action is worth {best}"
        if is_best[typed - 1]:
            comparison = "and is already best"
        return f"with {format_count(typed, 'turn')} left, {action} is worth {value}, {comparison}"

    return Truth(float(turns), explain)


def alpha_vector_count(position: PositionInGame, turns_left: int) -> Truth:
    """Return the number of alpha vectors that are best for some belief."""
    stage = _solve(position, turns_left)
    plans = sum(len(plans.alpha_vectors) for plans in stage.plans_by_action)
    return Truth(
        float(len(stage.alpha_vectors)),
        lambda _: f"{plans} plans are compared; a line that is never highest does not count",
    )


def describe_implied_prior(
    position: PositionInGame, history: Sequence[str], state: str, answer: float
) -> str:
    """Return which other probability was typed, or else the prior from which it would follow.

    Usual mistakes are the probability before the last observation, its likelihood in a state, and
    the product of both. The prior is found by Bayes' rule backwards, with the true proportions of
    the other states.
    """
    if not history or len(position.problem.agents) > 1:
        return ""
    action, observation = parse_history(position.problem, position.seat, history[-1:])[0]
    tables, index = tabulate(position.problem), _state_index(position, state)
    prior = (
        compute_belief(position, history[:-1]) if history[1:] else initial_belief(position.problem)
    )
    predicted = prior @ tables.transition[:, action]
    likelihoods = tables.observation_model[action, :, observation]
    observed = history[-1].rpartition(" ")[2]
    if not np.ptp(likelihoods):
        text = "your last action showed nothing about the state; only changes of the state count"
        first = float(compute_belief(position, history[:1])[index])
        is_clue = len(history) > 2 and abs(first - predicted[index]) > MIN_CLUE_DISTANCE
        return f"{text}. After the first action, it was {format_number(first)}" if is_clue else text
    names, typed = _state_names(position), format_number(answer)
    posterior = f"P({names[index]} | {observed})"
    usual_mistakes = {
        f"P({names[index]}) just before {observed!r}": predicted[index],
        **{f"P({observed} | {name})": p for name, p in zip(names, likelihoods, strict=True)},
        f"P({names[index]} and {observed})": predicted[index] * likelihoods[index],
    }
    for mistake, probability in usual_mistakes.items():
        if 0.0 < answer < 1.0 and abs(answer - probability) <= ROUNDED_DIFFERENCE:
            return f"{typed} is {mistake}; the question is {posterior}"
    others = np.arange(len(predicted)) != index
    weight = float(predicted[others].sum())
    own_likelihood = float(likelihoods[index])
    if not (0.0 < answer < 1.0 and weight and own_likelihood):
        return ""
    other_likelihood = float(predicted[others] @ likelihoods[others]) / weight
    odds = answer / (1.0 - answer) * other_likelihood / own_likelihood
    before = format_number(odds / (1.0 + odds))
    return f"{typed} would follow if P({names[index]}) were {before} just before {observed!r}"


def _solve(position: PositionInGame, turns_left: int) -> AlphaVectorStage:
    """Return the exact values of all beliefs with this many turns left."""
    problem = position.problem
    if turns_left < 1:
        raise BadParameter(f"turns_left: got {turns_left}, expected 1 or more")
    return solve_stages(problem, turns_left)[-1]


def _make_beliefs(position: PositionInGame, index: int, probabilities: Reals) -> Reals:
    """Return beliefs `[B, 2]` with these probabilities `[B]` of a state."""
    beliefs = np.stack([probabilities, 1.0 - probabilities], axis=1)
    return beliefs if index == 0 else beliefs[:, ::-1]


def compute_belief(position: PositionInGame, history: Sequence[str]) -> Reals:
    """Return the belief `[S]` after a history from the start; if it is empty, at the position."""
    view = position.ask(history=history).view
    if view.beliefs is None:
        raise BadParameter(f"{position.problem_name} has no beliefs at this position")
    return view.belief


def describe_belief(position: PositionInGame, history: Sequence[str]) -> str:
    """Return the probability of each state after a history as text."""
    belief = compute_belief(position, history)
    pairs = zip(_state_names(position), belief, strict=True)
    listed = [f"P({name}) = {format_number(float(p))}" for name, p in pairs]
    return f"the probabilities of the hidden states are {', '.join(listed)}"


def _parse_belief(position: PositionInGame, text: str) -> Reals:
    """Return the belief `[1, S]` that a text describes."""
    return parse_belief(position.problem, text)[None]


def _state_names(position: PositionInGame) -> tuple[str, ...]:
    """Return the names of all states."""
    problem = position.problem
    return tuple(map(problem.format_state, problem.enumerate_states()))


def _state_index(position: PositionInGame, text: str) -> int:
    """Return the index of the state that a text names."""
    names = _state_names(position)
    return names.index(find_label(text, names))


def _action_index(position: PositionInGame, text: str) -> int:
    """Return the index of the action that a text names."""
    label = find_action(position, text)
    return position.problem.actions[position.seat].labels.index(label)
