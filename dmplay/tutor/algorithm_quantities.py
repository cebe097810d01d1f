"""Quantities of algorithms: sweeps of value iteration, searches, and the games of agents."""

from collections import Counter
from collections.abc import Mapping

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import Problem, enumerate_possible_outcomes
from dmplay.core.tabular import tabulate
from dmplay.core.text import format_count
from dmplay.core.typed_text import parse_number
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.game.position import Position
from dmplay.registry import agents
from dmplay.solvers.mdp.mdp_values import (
    compute_action_values,
    compute_finite_horizon_values,
    compute_optimal_q,
)
from dmplay.tutor.positions import PositionInGame, play_ghost
from dmplay.tutor.state_quantities import (
    describe_worst_outcome,
    find_state_index,
    list_action_values,
    list_state_names,
)
from dmplay.tutor.truth import Truth, format_number, format_values, list_best_labels

MAX_SWEEPS = 1000
MAX_SIMULATIONS = 2000  # of one search, so that an answer is checked within seconds
MIN_ERROR = 0.05  # smallest regret of a choice that counts as wrong, at a scale of 1
MAX_SEARCH_DEPTH = 3  # of a forward search, whose outcomes are all listed
SEARCH_RUNS = 20  # searches with different random numbers whose choices are compared


def last_policy_change(position: PositionInGame, state: str = "") -> Truth:
    """Return the first sweep from which the greedy actions are optimal for good.

    They are those of one state; without `state`, those of every state. The greedy actions of a
    sweep are the best ones under V before it, as `dmplay watch` draws them. An action that is not
    optimal counts as an error also if it ties with an optimal one.
    """
    problem = position.problem
    tables, discount, scale = tabulate(problem), problem.discount, problem.reward_scale
    best = mark_best_actions(compute_optimal_q(tables, discount), scale)
    rows = [find_state_index(position, state)] if state else [*range(len(best))]
    best_two: list[str] = []  # in `state`, by sweep
    wrong_counts: list[int] = []  # states with a wrong greedy action, by sweep
    values, last_wrong, last_wrong_anywhere = np.zeros(len(best)), 0, 0
    while len(wrong_counts) < min(MAX_SWEEPS, 2 * last_wrong_anywhere + 11):
        q = compute_action_values(tables, discount, values)
        is_wrong: Bools = np.any(mark_best_actions(q, scale) & ~best, axis=1)
        values = q.max(axis=1)
        best_two.append(_describe_two_best_values(q[rows[0]]))
        wrong_counts.append(int(is_wrong[rows].sum()))
        last_wrong = len(wrong_counts) if wrong_counts[-1] else last_wrong
        last_wrong_anywhere = len(wrong_counts) if is_wrong.any() else last_wrong_anywhere

    def explain(answer: str) -> str:
        """Return the two best actions of the state in the typed sweep, or how many are wrong."""
        typed = parse_number(answer)
        if typed < 1:
            return "the first sweep has the number 1"
        if state:
            sweep = min(int(typed), len(best_two))
            return f"in sweep {sweep}, {best_two[sweep - 1]}"
        if typed > last_wrong:
            return "the greedy policy is optimal earlier"
        states = format_count(wrong_counts[int(typed) - 1], "state")
        return f"in sweep {int(typed)}, a wrong action is best or ties with the best in {states}"

    sweeps = (number for number in (last_wrong, last_wrong + 1) if number)
    parts = [f"in sweep {number}, {best_two[number - 1]}" for number in sweeps]
    return Truth(float(last_wrong + 1), explain, comparison="; ".join(parts) * bool(state))


def largest_later_change(position: PositionInGame, sweep: int) -> Truth:
    """Return the largest possible change of a value after this sweep, as its residual says.

    The residual of a sweep is the largest change of a value in it. Each later one is at most the
    discount times the residual before it (section 7.5).
    """
    tables, discount = tabulate(position.problem), position.problem.discount
    if discount >= 1.0:
        raise BadParameter(f"{position.problem_name} has the discount 1, expected less for a bound")
    previous, values = (
        compute_finite_horizon_values(tables, discount, count) for count in (sweep - 1, sweep)
    )
    residual = float(np.abs(values - previous).max())

    def explain(answer: str) -> str:
        """Return the answer as a multiple of the residual, and which sweeps count."""
        sweeps = f"all later sweeps count, sweep {sweep} does not"
        if not residual:
            return sweeps
        times = format_number(parse_number(answer) / residual)
        return f"that is {times} times the residual of sweep {sweep}; {sweeps}"

    bound, factor = residual * discount / (1.0 - discount), format_number(discount)
    calculation = f"{format_number(residual)} x {factor} / (1 - {factor}) = {format_number(bound)}"
    return Truth(bound, explain, comparison=calculation)


def search_error_share(position: Position, simulations: int) -> Truth:
    """Return the share of 20 tree searches that choose an action with a regret of 0.05 or more.

    With rewards below 1 the limit is as much smaller.
    """
    q, counts = list_action_values(position), _count_choices(position, simulations)
    min_loss = MIN_ERROR * position.problem.reward_scale
    wrong_count = sum(
        count for label, count in counts.items() if max(q.values()) - q[label] >= min_loss
    )
    searches = _describe_choices(simulations, ", ", counts)
    reason = f"{searches}; {_describe_two_best_values(np.array([*q.values()]))}"
    return Truth(wrong_count / SEARCH_RUNS, lambda _: reason)


def search_choice(position: Position, simulations: int) -> Truth:
    """Return the action that most of 20 tree searches choose."""
    q, counts = list_action_values(position), _count_choices(position, simulations)
    most = {label: count for label, count in counts.items() if count == max(counts.values())}

    def explain(answer: str) -> str:
        """Return the value of the answer, and its worst outcome, without its count."""
        value, worst = format_number(q[answer]), describe_worst_outcome(position, answer)
        averages = "the averages of the searches contain bad actions later"
        return f"{answer} is worth {value}, but {averages}; {worst}"

    searches = _describe_choices(simulations, " and ", most)
    return Truth(frozenset(most), explain, tuple(q), f"{searches}; {format_values(q)}")


def _count_choices(position: Position, simulations: int) -> dict[str, int]:
    """Return the number of 20 tree searches that choose each action, if any do.

    The searches have different random numbers. Each tries every action once at least.
    """
    problem, seat, action_count = position.problem, position.seat, len(position.legal_actions)
    if not action_count <= simulations <= MAX_SIMULATIONS:
        expected = f"{action_count} (one for each action) to {MAX_SIMULATIONS}"
        raise BadParameter(f"got {simulations} simulations, expected {expected}")
    policy = agents.load_agent(problem, seat, f"search:simulations={simulations}")
    states = np.repeat(position.state[None], SEARCH_RUNS, axis=0)
    source = SeededUniforms(0)
    u = [source.generate_uniforms(1, turn, 0, policy.uniform_count) for turn in range(SEARCH_RUNS)]
    choices = policy.choose(policy.initial_memory(states), None, np.concatenate(u))
    return Counter(problem.format_action(seat, choice) for choice in sorted(choices))


def _describe_choices(simulations: int, link: str, counts: Mapping[str, int]) -> str:
    """Return the number of searches that chose each action as text."""
    tally = link.join(f"{count} chose {label}" for label, count in counts.items())
    return f"of {SEARCH_RUNS} searches with {simulations} simulations, {tally}"


def forward_search_action(position: Position, depth: int) -> Truth:
    """Return the best actions by forward search over the next `depth` turns (section 9.3).

    Rewards after these turns count 0.
    """
    problem = position.problem
    if problem.terminal(position.state[None])[0]:
        raise BadParameter("the game is over in this state; expected turns to search")
    values = _search_forward(problem, position.state[None], depth)[0]
    q, rewards = (
        {position.labels[action]: float(numbers[action]) for action in position.legal_actions}
        for numbers in (values, position.expected_rewards())
    )

    def explain(answer: str) -> str:
        """Return the expected reward of the action now, and of the best later ones."""
        reward, later = (format_number(x) for x in (rewards[answer], q[answer] - rewards[answer]))
        turns = format_count(depth - 1, "more turn")
        return f"{answer} scores {reward} now, and the best play adds {later} on average in {turns}"

    return Truth(list_best_labels(q, problem.reward_scale), explain, tuple(q), format_values(q))


def _search_forward(problem: Problem, s: Array, depth: int) -> Reals:
    """Return the value `[B, A]` of each action over `depth` turns, -inf for illegal ones."""
    mask = problem.legal_actions_mask(s)
    legal = np.ones((len(s), problem.action_counts[0]), bool) if mask is None else mask[:, 0]
    rows, actions = np.nonzero(legal & ~problem.terminal(s)[:, None])
    q = np.full(legal.shape, -np.inf)
    if not len(rows):
        return q
    pairs, p, outcome = enumerate_possible_outcomes(problem, s[rows], actions[:, None])
    returns = outcome.rewards[:, 0]
    if depth > 1:
        later = _search_forward(problem, outcome.state, depth - 1).max(axis=1)
        returns = returns + problem.discount * np.where(np.isfinite(later), later, 0.0)
    q[rows, actions] = np.bincount(pairs, p * returns, len(rows))
    return q


def agent_return(position: PositionInGame, agent: str) -> Truth:
    """Return the return of a game that an agent plays on from the position, with its draws."""
    ghost = play_ghost(position, agent)
    return Truth(ghost.score, lambda _: f"{agent} plays {len(ghost.session.turns)} turns")


def furthest_number(position: PositionInGame, action: str, turns: int, component: int = 1) -> Truth:
    """Return the largest value of one number of the state while an action is repeated."""
    session = position.session.copy_at_start()
    session.append_turns(position.session.turns)
    if component > session.state.size:
        count = format_count(session.state.size, "number")
        raise BadParameter(f"component: got {component}, but a state has {count}")
    index, numbers = position.problem.parse_action(position.seat, action), list[float]()
    while len(numbers) < turns and not session.over:
        numbers.append(float(session.advance([index]).state.flat[component - 1]))
    if not numbers:
        raise BadParameter("the game is over at this position; expected turns to repeat the action")
    turn = numbers.index(max(numbers)) + 1
    reason = f"the greatest one is reached after {turn} of {len(numbers)} turns"
    return Truth(max(numbers), lambda _: reason)


def state_after_undo(position: PositionInGame, action: str) -> Truth:
    """Return the state after this action in place of the last one, with the same draws."""
    session, problem = position.session, position.problem
    if not session.turns:
        raise BadParameter("state-after-undo: expected a position with a last turn, see after")
    replayed, turn = session.copy_at_start(), session.turns[-1]
    replayed.append_turns(session.turns[:-1])
    actions = turn.actions.tolist()
    actions[position.seat] = problem.parse_action(position.seat, action)
    replayed.advance(actions, turn.uniforms)
    draws = ", ".join(format_number(float(u)) for u in turn.uniforms)
    reason = f"the random number of that turn is {draws}, before and after the undo"
    state = frozenset([problem.format_state(replayed.state)])
    return Truth(state, lambda _: reason, list_state_names(problem))


def _describe_two_best_values(values: Reals) -> str:
    """Return a clause with the two greatest values of actions, without the actions."""
    greatest = sorted(map(float, values), reverse=True)[:2]
    return f"the best two actions are worth {' and '.join(map(format_number, greatest))}"
