"""Quantities of games of several agents: payoffs, best replies, equilibria and rules."""

import inspect
from collections.abc import Sequence

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Array, Reals
from dmplay.core.best_actions import VALUE_TOLERANCE
from dmplay.core.policy import Policy
from dmplay.core.problem import enumerate_possible_outcomes
from dmplay.core.session import SeatedPolicy, Session
from dmplay.core.tabular import Tabular
from dmplay.core.typed_text import parse_distribution, parse_number
from dmplay.core.uniforms import SeededUniforms
from dmplay.errors import BadParameter
from dmplay.game.rules_of_thumb import build_seat_payoffs
from dmplay.registry import agents
from dmplay.solvers.games import bimatrix_game
from dmplay.solvers.games.bimatrix_game import MixedProfile
from dmplay.solvers.games.extreme_equilibria import find_extreme_equilibria
from dmplay.solvers.games.lemke_howson import find_equilibrium
from dmplay.tutor.belief_quantities import describe_belief
from dmplay.tutor.positions import PositionInGame, load_agent
from dmplay.tutor.state_quantities import find_state
from dmplay.tutor.truth import Truth, format_number, format_values, list_best_labels

UNIFORM = "uniform"
EQUILIBRIUM_AGENTS = ("equilibrium", "nash")


def expected_payoff(position: PositionInGame, action: str, opponent: str) -> Truth:
    """Return the expected reward of an action in one round against a mixed strategy.

    `opponent` is an action, "uniform", or probabilities such as "rock 0.5 paper 0.5".
    """
    values = _payoff_table(position)[0] @ _parse_mixed_strategy(position, opponent)
    reason = "it is the average reward, weighted by the probabilities of the other's actions"
    return Truth(float(values[_action_index(position, action)]), lambda _: reason)


def best_reply(position: PositionInGame, opponent: str) -> Truth:
    """Return the actions with the greatest expected reward in one round against a strategy."""
    mix = _parse_mixed_strategy(position, opponent)
    payoffs = map(float, _payoff_table(position)[0] @ mix)
    values = dict(zip(_action_labels(position), payoffs, strict=True))
    average = " on average" * bool(mix.max() < 1.0)

    def explain(answer: str) -> str:
        """Return by how much the expected reward of the action is less than the greatest."""
        loss = format_number(max(values.values()) - values[answer])
        return f"{answer} pays {loss} less{average} than a best reply"

    best = list_best_labels(values, position.problem.reward_scale)
    return Truth(best, explain, tuple(values), format_values(values, f"pays{average}"))


def level_k_action(position: PositionInGame, level: int) -> Truth:
    """Return the best replies of a player who reasons `level` times; level 0 plays uniformly.

    Level k plays a best reply to level k - 1, the first one if several are best.
    """
    truth = best_reply(position, UNIFORM)
    for _ in range(level - 1):
        assert isinstance(truth.value, frozenset)
        truth = best_reply(position, min(truth.value, key=truth.labels.index))
    return truth


def equilibrium_probability(position: PositionInGame, action: str) -> Truth:
    """Return the probability of an action in a Nash equilibrium, in which no change pays."""
    probabilities = [
        profile[position.seat][_action_index(position, action)]
        for profile in _list_equilibria(position)
    ]
    explain = agent_probability(position, "nash", action).explain
    return Truth(_require_equal(probabilities, 1.0), explain)


def equilibrium_payoff(position: PositionInGame) -> Truth:
    """Return the player's expected reward of one round in a Nash equilibrium."""
    (payoffs, _), labels = _payoff_table(position), _action_labels(position)

    def explain(answer: str) -> str:
        """Return by how much a change pays if both play the action that was typed."""
        claim = answer.strip().removesuffix(".0")
        if claim not in labels:
            return f"{claim} is not an action" if labels[0].isdecimal() else ""
        index = labels.index(claim)
        value, both = (
            format_number(float(x)) for x in (payoffs[:, index].max(), payoffs[index, index])
        )
        return f"if both play {claim}, each gets {both}, and one that changes can get {value}"

    rewards = [
        float(profile[position.seat] @ payoffs @ profile[1 - position.seat])
        for profile in _list_equilibria(position)
    ]
    return Truth(_require_equal(rewards, position.problem.reward_scale), explain)


def agent_action(position: PositionInGame, agent: str, rounds: Sequence[str]) -> Truth:
    """Return the action of an agent after these rounds of a repeated game.

    A round is the player's action and the agent's, such as "cooperate defect".
    """
    seat, labels = 1 - position.seat, _action_labels(position, 1)
    policy, session = load_agent(position, seat, agent), _replay_rounds(position, rounds)
    choice = SeatedPolicy(session, seat, policy).choose()

    def explain(answer: str) -> str:
        """Return the rule of the agent, and what the answer earns it against the last action."""
        sentence = f"{agent} {_summarize_policy(policy)}; this is round {len(rounds) + 1}"
        if not rounds or position.problem.state_count != 1:
            return sentence
        last = rounds[-1].split()[position.seat]
        cell = _action_index(position, last), labels.index(answer)
        player_reward, earned = (
            format_number(float(table[cell])) for table in _payoff_table(position)
        )
        change = f"Had it played {answer} in that round, it would have got {earned}"
        return f"{sentence}. Your last action was {last}. {change}, and you {player_reward}"

    return Truth(frozenset([position.problem.format_action(seat, choice)]), explain, labels)


def repeated_payoff(position: PositionInGame, agent: str, actions: Sequence[str]) -> Truth:
    """Return the player's total reward for these actions, one a round, against an agent.

    The agent must not act at random.
    """
    seat = position.seat
    if load_agent(position, 1 - seat, agent).uniform_count:
        raise BadParameter(f"agent: got {agent}, expected one that does not act at random")
    indices = [position.problem.parse_action(seat, action) for action in actions]
    turns = _play_against(position, agent, indices).turns
    rewards = [float(turn.rewards[seat]) for turn in turns]

    def explain(_: str) -> str:
        """Return the smallest and the largest reward, without their rounds; '' if they are few."""
        least, most = min(rewards), max(rewards)
        if len(rewards) < 4 or least == most:
            return ""
        limits = f"from {format_number(least)} to {format_number(most)}"
        return f"the {len(rewards)} rounds do not all pay you the same, but {limits}"

    return Truth(sum(rewards), explain)


def matching_agents(
    position: PositionInGame, rounds: Sequence[str], candidates: Sequence[str]
) -> Truth:
    """Return the candidates that would have played all actions of the opponent in these rounds."""
    problem, seat = position.problem, position.seat
    played = np.array([turn.actions for turn in _replay_rounds(position, rounds).turns])

    def describe_mismatch(agent: str) -> str:
        """Return the first round in which an agent would have played another action, '' if none."""
        game = _play_against(position, agent, played[:, seat]) if rounds else None
        for number, turn in enumerate(game.turns if game else (), 1):
            pair = turn.actions[1 - seat], played[number - 1, 1 - seat]
            if pair[0] != pair[1]:
                label, other = (problem.format_action(1 - seat, action) for action in pair)
                return f"{agent} would have played {label} in round {number}, not {other}"
        return ""

    mismatches = {agent: describe_mismatch(agent) for agent in candidates}
    matching = frozenset(agent for agent, mismatch in mismatches.items() if not mismatch)
    return Truth(matching, lambda answer: mismatches[answer], tuple(candidates))


def agent_probability(position: PositionInGame, agent: str, action: str, state: str = "") -> Truth:
    """Return the probability of an action of an agent in the seat of the player, in a state."""
    problem, s, index = (
        position.problem,
        find_state(position, state),
        _action_index(position, action),
    )
    policy = agents.load_hint_agent(problem, position.question, agent).policy
    probabilities = policy.choice_probabilities(policy.initial_memory(s[None]))
    if probabilities is None:
        raise BadParameter(f"agent {agent!r} has no known probabilities")
    mix = probabilities[0]

    def explain(answer: str) -> str:
        """Return the gain of the other agent if this one takes the action as often as typed."""
        typed = min(max(parse_number(answer), 0.0), 1.0)
        is_equilibrium = agent.partition(":")[0] in EQUILIBRIUM_AGENTS and len(problem.agents) == 2
        others = np.arange(len(mix)) != index
        if not is_equilibrium or problem.partially_observable or not others.any():
            return ""
        shares = mix * others if mix[others].any() else others.astype(float)
        changed = shares / shares.sum() * (1.0 - typed)
        changed[index] = typed
        values = _reply_values(position, agent, s)
        gains = changed @ values - (mix @ values).max()
        if gains.max() < VALUE_TOLERANCE * problem.reward_scale:
            return ""
        name, opponent = (problem.agents[seat] for seat in (position.seat, 1 - position.seat))
        how = "in proportion" if mix[others].any() else "equally"
        reply = _action_labels(position, 1)[int(gains.argmax())]
        return (
            f"if {name} plays {action} with {format_number(typed)}, and shares out the rest {how}, "
            f"the reply {reply} earns {opponent} {format_number(float(gains.max()))} more on "
            "average than in the equilibrium"
        )

    return Truth(float(mix[index]), explain)


def team_cost(position: PositionInGame, state: str, actions: str) -> Truth:
    """Return the expected total of the agents' costs in one turn, from a state.

    `actions` has an action of each agent, such as "feed ignore".
    """
    problem, words = position.problem, actions.split()
    if len(words) != len(problem.agents):
        raise BadParameter(f"actions: got {actions!r}, expected an action of each agent")
    joint = np.array([[problem.parse_action(seat, word) for seat, word in enumerate(words)]])

    def compute_costs(states: Array) -> Reals:
        """Return the expected total cost `[B]` in each state."""
        rows, p, outcome = enumerate_possible_outcomes(
            problem, states, np.tile(joint, (len(states), 1))
        )
        return np.asarray(np.bincount(rows, -p * outcome.rewards.sum(axis=1), len(states)), float)

    s = find_state(position, state)

    def explain(_: str) -> str:
        """Return the cost of the same actions in the cheapest state."""
        if not isinstance(problem, Tabular):
            return ""
        states = problem.enumerate_states()
        costs = compute_costs(states)
        name, cheapest = map(problem.format_state, (s, states[costs.argmin()]))
        least = format_number(float(costs.min()))
        reason = f"the same actions cost {least} in all if the state is {cheapest}"
        return reason * (cheapest != name)

    return Truth(float(compute_costs(s[None])[0]), explain, is_cost=True)


def planned_action(position: PositionInGame, agent: str, history: Sequence[str] = ()) -> Truth:
    """Return the action of an agent in the player's seat after a history."""
    provider = agents.load_hint_agent(position.problem, position.question, agent)
    knowledge, policy = position.ask(provider, history=history), provider.policy
    choice = policy.choose(knowledge.memory, None, np.zeros((1, policy.uniform_count)))
    label, labels = knowledge.format_action(float(choice[0])), _action_labels(position)
    values = knowledge.values()

    def explain(answer: str) -> str:
        """Return the loss of value by the answer, or the belief if the agent has no values."""
        if values is None:
            return describe_belief(knowledge)
        loss = format_number(float(values.regrets[labels.index(answer)]))
        basis = provider.basis
        source = ", ".join(filter(None, [basis.method or agent, basis.turns_scope]))
        return f"{answer} is worth {loss} less than the best action; source of the values: {source}"

    return Truth(frozenset([label]), explain, labels)


def _summarize_policy(policy: Policy) -> str:
    """Return the first sentence on a policy, said to its opponent, without its full stop."""
    rule = (inspect.getdoc(type(policy)) or "").partition("\n")[0].rstrip(".")
    rule = rule.replace("the opponent's", "your").replace("the opponent", "you")
    return f"{rule[:1].lower()}{rule[1:]}"


def _reply_values(position: PositionInGame, agent: str, s: Array) -> Reals:
    """Return the value `[own actions, replies]` of a turn from a state to the other agent.

    From the next turn on, both play the equilibrium.
    """
    problem, seat, other = position.problem, position.seat, 1 - position.seat
    policy = load_agent(position, other, agent)
    assert isinstance(policy, SeatPolicy)
    joint = np.array([*np.ndindex(*problem.action_counts)])
    rows, p, outcome = enumerate_possible_outcomes(problem, s[None].repeat(len(joint), 0), joint)
    q = policy.action_values(policy.initial_memory(outcome.state))
    later_values = 0.0 if q is None else q.max(axis=1)  # rounds alone have no later values
    totals = outcome.rewards[:, other] + problem.discount * later_values
    values = np.bincount(rows, p * totals).astype(float).reshape(problem.action_counts)
    return values if seat == 0 else values.T


def _play_against(
    position: PositionInGame, agent: str, actions: Sequence[float] | Reals
) -> Session:
    """Return a session in which the player takes these actions against an agent."""
    policies: list[Policy | None] = [None, None]
    policies[1 - position.seat] = load_agent(position, 1 - position.seat, agent)
    session = Session(position.problem, SeededUniforms(0), policies, turn_limit=len(actions))
    for action in actions:
        choices: list[float | None] = [None, None]
        choices[position.seat] = float(action)
        session.advance(choices)
    return session


def _replay_rounds(position: PositionInGame, rounds: Sequence[str]) -> Session:
    """Return a session in which these rounds were played, each seat's action in order."""
    problem = position.problem
    session = Session(problem, SeededUniforms(0), turn_limit=len(rounds) + 1)
    for text in rounds:
        words = text.split()
        if len(words) != len(problem.agents):
            raise BadParameter(f"rounds: got {text!r}, expected an action of each agent")
        session.advance([problem.parse_action(seat, word) for seat, word in enumerate(words)])
    return session


def _payoff_table(position: PositionInGame) -> tuple[Reals, Reals]:
    """Return the player's and the other's rewards `[own actions, other actions]`."""
    return build_seat_payoffs(position.problem, position.seat)


def _list_equilibria(position: PositionInGame) -> list[MixedProfile]:
    """Return the equilibria of one round, or the extreme ones; one if they are too many."""
    payoffs = bimatrix_game.build_payoffs(position.problem)
    profiles = find_extreme_equilibria(payoffs)
    return (
        profiles
        or bimatrix_game.enumerate_equilibria_if_small(payoffs)
        or [find_equilibrium(payoffs)]
    )


def _require_equal(numbers: Sequence[float], scale: float) -> float:
    """Return a number of several equilibria; raise BadParameter if it is not the same in all."""
    if max(numbers) - min(numbers) > VALUE_TOLERANCE * scale:
        low, high = format_number(float(min(numbers))), format_number(float(max(numbers)))
        raise BadParameter(
            f"the game has several equilibria: got {low} to {high}, expected one answer"
        )
    return float(numbers[0])


def _parse_mixed_strategy(position: PositionInGame, text: str) -> Reals:
    """Return the mixed strategy `[A]` of the other agent: `uniform`, an action or probabilities.

    Raise BadParameter for any other text.
    """
    labels = _action_labels(position, 1)
    if text == UNIFORM:
        return np.full(len(labels), 1.0 / len(labels))
    is_action = text.strip() in labels
    typed = {text.strip(): 1.0} if is_action else parse_distribution(text, labels)
    return np.array([typed.get(label, 0.0) for label in labels])


def _action_labels(position: PositionInGame, other: int = 0) -> tuple[str, ...]:
    """Return the labels of the player's actions, or with 1 those of the other agent."""
    return tuple(position.problem.actions[abs(position.seat - other)].labels)


def _action_index(position: PositionInGame, action: str) -> int:
    """Return the index of the action that a text names."""
    return int(position.problem.parse_action(position.seat, action))
