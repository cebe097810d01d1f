"""Quantities of algorithms: sweeps of value iteration, rules of thumb, and tree search."""

from collections.abc import Iterable

import numpy as np

from dmplay.core.arrays import Array, Bools, Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.problem import Problem, enumerate_possible_outcomes
from dmplay.core.tabular import Tables, tabulate
from dmplay.core.text import format_count
from dmplay.core.typed_text import parse_number
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.solvers.mdp.mdp_values import (
    compute_action_values,
    compute_finite_horizon_values,
    compute_optimal_q,
)
from dmplay.tutor.positions import PositionInGame, load_agent, play_ghost
from dmplay.tutor.state_quantities import (
    compute_q,
    describe_worst_outcome,
    find_state,
    find_state_index,
    list_outcomes,
)
from dmplay.tutor.truth import Truth, format_number, list_best_labels, list_values

MAX_SWEEPS = 1000
MAX_SIMULATIONS = 2000  # of one search, so that an answer is checked within seconds
MIN_ERROR = 0.05  # smallest regret of a choice that counts as wrong, at a scale of 1
MAX_SEARCH_DEPTH = 3  # of a forward search, whose outcomes are all listed
SEARCH_RUNS = 20  # searches with different random numbers whose choices are compared


def sweep_value(position: PositionInGame, state: str, sweep: int) -> Truth:
    """Return the value of a state after this many sweeps of value iteration from V = 0."""
    problem = position.problem
    tables, index = _tabulate(position), find_state_index(position, state)
    values = compute_finite_horizon_values(tables, problem.discount, sweep)
    previous = compute_finite_horizon_values(tables, problem.discount, sweep - 1)

    def explain(_: str) -> str:
        """Return the number of next states of the best action, without their names."""
        q = compute_action_values(tables, problem.discount, previous)[index]
        action = problem.format_action(0, int(np.argmax(q)))
        next_states = list_outcomes(position, action, find_state(position, state))
        count = format_count(len(next_states), "next state")
        listed = " and ".join(
            format_number(float(previous[find_state_index(position, name)])) for name in next_states
        )
        values = f"with V = {listed} before sweep {sweep}"
        return f"the best action has {count}, {values}; each of these steps also has a reward"

    q = compute_action_values(tables, problem.discount, previous)[index]
    best = np.array([[int(np.argmax(q))]])
    _, p, outcome = enumerate_possible_outcomes(problem, find_state(position, state)[None], best)
    later = previous[problem.state_indices(outcome.state)]
    terms: dict[str, float] = {}
    for probability, reward, value in zip(p, outcome.rewards[:, 0], later, strict=True):
        old = f"{format_number(problem.discount)} x {format_number(float(value))}"
        term = f"({format_number(float(reward))} + {old})"
        terms[term] = terms.get(term, 0.0) + float(probability)
    calculation = " + ".join(f"{format_number(share)} x {term}" for term, share in terms.items())
    label, value = problem.format_action(0, int(best[0, 0])), format_number(float(values[index]))
    return Truth(
        float(values[index]),
        explain,
        comparison=f"the best action, {label}, is worth {calculation} = {value}",
    )


def last_policy_change(position: PositionInGame, state: str = "") -> Truth:
    """Return the first sweep from which the greedy actions are optimal for good.

    They are those of one state; without `state`, those of every state. The greedy actions of a
    sweep are the best ones under V before it, as `dmplay watch` draws them. An action that is not
    optimal counts as an error also if it ties with an optimal one.
    """
    tables, discount = _tabulate(position), position.problem.discount
    scale = position.problem.reward_scale
    best = mark_best_actions(compute_optimal_q(tables, discount), scale)
    rows = [find_state_index(position, state)] if state else [*range(len(best))]
    action_values: list[Reals] = []  # before each sweep, in `state`
    values = np.zeros(len(tables.transition))
    last_wrong, last_wrong_anywhere, wrong_counts = 0, 0, []
    for sweep in range(1, MAX_SWEEPS + 1):
        q = compute_action_values(tables, discount, values)
        is_wrong: Bools = np.any(mark_best_actions(q, scale) & ~best, axis=1)
        wrong_count = int(is_wrong[rows].sum())
        action_values.append(q[rows[0]])
        values = q.max(axis=1)
        wrong_counts.append(wrong_count)
        last_wrong = sweep if wrong_count else last_wrong
        last_wrong_anywhere = sweep if is_wrong.any() else last_wrong_anywhere
        if sweep > 2 * last_wrong_anywhere + 10:
            break

    def explain(answer: str) -> str:
        """Return the two best actions of the state in the typed sweep, or how many are wrong."""
        typed = parse_number(answer)
        if typed < 1:
            return "the first sweep has the number 1"
        if state:
            sweep = min(int(typed), len(action_values))
            return f"in sweep {sweep}, {_describe_best_two(action_values[sweep - 1])}"
        if typed > last_wrong:
            return "the greedy policy is optimal earlier"
        states = format_count(wrong_counts[int(typed) - 1], "state")
        return f"in sweep {int(typed)}, a wrong action is best or ties with the best in {states}"

    sweeps = (number for number in (last_wrong, last_wrong + 1) if number)
    parts = [f"in sweep {n}, {_describe_best_two(action_values[n - 1])}" for n in sweeps]
    return Truth(float(last_wrong + 1), explain, comparison="; ".join(parts) * bool(state))


def largest_later_change(position: PositionInGame, sweep: int) -> Truth:
    """Return the largest possible change of a value after this sweep, as its residual says.

    The residual of a sweep is the largest change of a value in it. Each later one is at most the
    discount times the residual before it (section 7.5).
    """
    tables, discount = _tabulate(position), position.problem.discount
    if discount >= 1.0:
        raise BadParameter(f"{position.problem_name} has the discount 1, expected less for a bound")
    previous = compute_finite_horizon_values(tables, discount, sweep - 1)
    values = compute_finite_horizon_values(tables, discount, sweep)
    residual = float(np.abs(values - previous).max())

    def explain(answer: str) -> str:
        """Return the answer as a multiple of the residual, and which sweeps count."""
        sweeps = f"all later sweeps count, sweep {sweep} does not"
        if not residual:
            return sweeps
        times = format_number(parse_number(answer) / residual)
        return f"that is {times} times the residual of sweep {sweep}; {sweeps}"

    bound = residual * discount / (1.0 - discount)
    factor = format_number(discount)
    calculation = f"{format_number(residual)} x {factor} / (1 - {factor}) = {format_number(bound)}"
    return Truth(bound, explain, comparison=calculation)


def worst_outcome(position: PositionInGame, action: str, state: str = "") -> Truth:
    """Return the possible next states with the smallest value after an action."""
    problem = position.problem
    probabilities = list_outcomes(position, action, find_state(position, state))
    values = {name: max(compute_q(position, name).values()) for name in probabilities}
    costs = {name: -value for name, value in values.items()}
    worst = list_best_labels(costs, problem.reward_scale)

    def explain(answer: str) -> str:
        """Return the probability and the value of the named state."""
        if answer not in probabilities:
            return f"the probability that {action} leads to {answer} is 0"
        probability = format_number(probabilities[answer])
        return (
            f"{answer} has probability {probability} and is worth {format_number(values[answer])}"
        )

    return Truth(worst, explain, tuple(map(problem.format_state, problem.enumerate_states())))


def search_error_share(position: PositionInGame, state: str, simulations: int) -> Truth:
    """Return the share of 20 tree searches that choose an action with a regret of 0.05 or more.

    With rewards below 1 the limit is as much smaller.
    """
    q = compute_q(position, state)
    choices = _run_searches(position, state, simulations)
    min_error = MIN_ERROR * position.problem.reward_scale
    share = sum(max(q.values()) - q[choice] >= min_error for choice in choices) / SEARCH_RUNS

    def explain(_: str) -> str:
        """Return the number of searches that chose each action, and the best two values."""
        tally = ", ".join(f"{choices.count(name)} chose {name}" for name in dict.fromkeys(choices))
        searches = f"of {SEARCH_RUNS} searches with {simulations} simulations, {tally}"
        return f"{searches}; {_describe_best_two(q.values())}"

    return Truth(share, explain)


def search_choice(position: PositionInGame, state: str, simulations: int) -> Truth:
    """Return the action that most of 20 tree searches choose."""
    q = compute_q(position, state)
    choices = _run_searches(position, state, simulations)
    counts = {name: choices.count(name) for name in q}
    most = frozenset(name for name, count in counts.items() if count == max(counts.values()))
    searches = f"of {SEARCH_RUNS} searches with {simulations} simulations"

    def describe(names: Iterable[str]) -> str:
        """Return the number of searches that chose these actions, and the values."""
        tally = " and ".join(f"{counts[name]} chose {name}" for name in names)
        return f"{searches}, {tally}; {list_values(q)}"

    def explain(answer: str) -> str:
        """Return the value of the answer, and its worst outcome, without its count."""
        value = f"{answer} is worth {format_number(q[answer])}"
        worst = describe_worst_outcome(position, answer, state, 0)
        return f"{value}, but the averages of the searches contain bad actions later; {worst}"

    return Truth(most, explain, tuple(q), describe(sorted(most)))


def _run_searches(position: PositionInGame, state: str, simulations: int) -> list[str]:
    """Return the choices of 20 tree searches from a state, with different random numbers.

    Each search tries every action once at least.
    """
    problem = position.problem
    q = compute_q(position, state)
    if not len(q) <= simulations <= MAX_SIMULATIONS:
        expected = f"{len(q)} (one for each action) to {MAX_SIMULATIONS}"
        raise BadParameter(f"got {simulations} simulations, expected {expected}")
    policy = load_agent(position, position.seat, f"search:simulations={simulations}")
    s = find_state(position, state)
    memory = policy.initial_memory(np.repeat(s[None], SEARCH_RUNS, axis=0))
    source = SeededUniforms(0)
    u = np.concatenate(
        [source.generate_uniforms(1, turn, 0, policy.uniform_count) for turn in range(SEARCH_RUNS)]
    )
    return [
        problem.format_action(position.seat, choice) for choice in policy.choose(memory, None, u)
    ]


def forward_search_action(position: PositionInGame, depth: int) -> Truth:
    """Return the best actions by forward search over the next `depth` turns (section 9.3).

    Rewards after these turns count 0.
    """
    problem = position.problem
    s = position.session.state[None]
    labels = [problem.format_action(0, action) for action in range(problem.action_counts[0])]

    def list_legal(values: Reals) -> dict[str, float]:
        """Return the value of each legal action by label."""
        pairs = zip(labels, map(float, values), strict=True)
        return {label: value for label, value in pairs if value > -np.inf}

    q = list_legal(_search_forward(problem, s, depth)[0])
    rewards = list_legal(_search_forward(problem, s, 1)[0])
    best = list_best_labels(q, problem.reward_scale)

    def explain(answer: str) -> str:
        """Return the expected reward of the action now, and of the best later ones."""
        reward, later = (format_number(x) for x in (rewards[answer], q[answer] - rewards[answer]))
        turns = format_count(depth - 1, "more turn")
        return f"{answer} scores {reward} now, and the best play adds {later} on average in {turns}"

    return Truth(best, explain, tuple(q), list_values(q))


def _search_forward(problem: Problem, s: Array, depth: int) -> Reals:
    """Return the value `[B, A]` of each action over `depth` turns, -inf for illegal ones."""
    action_count = problem.action_counts[0]
    mask = problem.legal_actions_mask(s)
    legal = np.ones((len(s), action_count), bool) if mask is None else mask[:, 0]
    legal = legal & ~problem.terminal(s)[:, None]
    rows, actions = np.nonzero(legal)
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
    turns = len(ghost.session.turns)
    return Truth(ghost.score, lambda _: f"{agent} plays {turns} turns")


def furthest_number(position: PositionInGame, action: str, turns: int, component: int = 1) -> Truth:
    """Return the largest value of one number of the state while an action is repeated."""
    session = position.session.copy_at_start()
    session.append_turns(position.session.turns)
    index = position.problem.parse_action(position.seat, action)
    if component > session.state.size:
        count = format_count(session.state.size, "number")
        raise BadParameter(f"component: got {component}, but a state has {count}")
    numbers = []
    for _ in range(turns):
        if session.over:
            break
        numbers.append(float(session.advance([index]).state.flat[component - 1]))
    if not numbers:
        raise BadParameter("the game is over at this position; expected turns to repeat the action")
    turn = int(np.argmax(numbers)) + 1
    return Truth(
        max(numbers), lambda _: f"the greatest one is reached after {turn} of {len(numbers)} turns"
    )


def state_after_undo(position: PositionInGame, action: str) -> Truth:
    """Return the state after this action in place of the last one, with the same draws."""
    session, problem = position.session, position.problem
    if not session.turns:
        raise BadParameter("state-after-undo: expected a position with a last turn, see after")
    replayed = session.copy_at_start()
    replayed.append_turns(session.turns[:-1])
    actions = session.turns[-1].actions.tolist()
    actions[position.seat] = problem.parse_action(position.seat, action)
    replayed.advance(actions, session.turns[-1].uniforms)

    def explain(_: str) -> str:
        """Return the random numbers of the turn."""
        draws = ", ".join(format_number(float(u)) for u in session.turns[-1].uniforms)
        return f"the random number of that turn is {draws}, before and after the undo"

    names = tuple(map(problem.format_state, problem.enumerate_states()))
    return Truth(frozenset([problem.format_state(replayed.state)]), explain, names)


def _describe_best_two(values: Iterable[float]) -> str:
    """Return a clause with the two greatest values of actions, without the actions."""
    greatest = sorted(map(float, values), reverse=True)[:2]
    return f"the best two actions are worth {' and '.join(map(format_number, greatest))}"


def _tabulate(position: PositionInGame) -> Tables:
    """Return the arrays of a problem with one agent and visible states."""
    return tabulate(position.problem)
