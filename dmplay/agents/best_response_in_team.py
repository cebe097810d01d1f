"""Best responses to a partner whose rule is known, in games whose state is hidden.

The game becomes a POMDP whose state is that of the game with the node of the partner. The node is
the partner's memory, which depends on the partner's own actions and observations.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import ClassVar, Self

import numpy as np

from dmplay.agents.base import AdviceQuestion, GreedyPolicy, PolicyMaker, SeatPolicy
from dmplay.agents.belief_policy import BeliefPolicy
from dmplay.agents.horizon import HorizonPolicy
from dmplay.agents.partner_machine import PartnerMachine, build_partner_machine
from dmplay.agents.random_agent import Random
from dmplay.core import belief
from dmplay.core.action_values import Accuracy, ValuesBasis
from dmplay.core.arrays import Array, Reals
from dmplay.core.chance import weighted_sum
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory
from dmplay.core.problem import enumerate_possible_outcomes
from dmplay.core.spaces import Labels
from dmplay.core.work_budget import ARRAY_CALL_WORK, Budget
from dmplay.errors import BadPolicy

MAX_WORK = 1e9
BELIEF_WORK = 2e3  # operations to look up the values of one belief
BELIEF_DECIMALS = 12  # decimals: beliefs that are equal after rounding are valued once
MAX_DESCRIBED_STATES = 4  # maximum number of states in the description of a belief


@dataclass(frozen=True)
class PartnerBeliefPolicy(BeliefPolicy):
    """A belief policy that follows the rule of its only partner.

    Its memory is the probability `[B, N * S]` of each node of the partner with each state.
    """

    to: str = parameter("random", "assumed partner: an agent or an action")
    policy_maker: PolicyMaker | None = field(default=None, compare=False, repr=False)

    max_belief_size: ClassVar[int] = 20_000  # maximum number of nodes times states
    splits_observations: ClassVar[bool] = False  # whether a node has one last observation

    def with_policy_maker(self, policy_maker: PolicyMaker) -> Self:
        """Return this policy with a function that makes the partner named by `to`."""
        policy = replace(self, policy_maker=policy_maker)
        _ = policy.partner_machine  # raises an error for an unknown name
        return policy

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return the basis with the partner's model, unless this partner plays so."""
        partner = self.describe_partner(question.actual_opponents)
        basis = super().values_basis(question)
        return basis._replace(preposition="with", assumed_players=partner)

    def describe_partner(self, opponents: tuple[str, ...]) -> str:
        """Return the model of the partner, '' if it is how this partner plays."""
        if (self.to,) == opponents:
            return ""
        is_random = self.to == "random"
        return "assuming a random partner" if is_random else f"if the partner plays {self.to}"

    def make_partner(self, seat: int) -> SeatPolicy | None:
        """Return the policy `to` of the partner in its seat; None if there is none."""
        if self.to == "random":
            return Random(self.problem, seat)
        return self.policy_maker(seat, self.to) if self.policy_maker else None

    @cached_property
    def partner_machine(self) -> PartnerMachine:
        """The partner's rule; raises BadPolicy if it is not known or has too many nodes."""
        is_pair = len(self.problem.agents) == 2
        partner = self.make_partner(1 - self.seat) if is_pair else None
        if partner is None:
            raise BadPolicy(f"cannot plan with {self.to!r}: no known rule of a single partner")
        max_nodes = self.max_belief_size // len(self.problem.enumerate_states())
        return build_partner_machine(
            self.to, partner, max_nodes, splits_observations=self.splits_observations
        )

    @cached_property
    def _with_random_partner(self) -> Self:
        """This policy with a partner that acts at random in each of its nodes."""
        policy, chances = replace(self), self.partner_machine.probabilities
        uniform = np.full_like(chances, 1.0 / chances.shape[1])
        vars(policy)["partner_machine"] = self.partner_machine._replace(probabilities=uniform)
        return policy

    @property
    def partner_node_count(self) -> int:
        """The number of nodes of the partner."""
        return len(self.partner_machine.observations)

    def _follow_partners(
        self, joint: tuple[int, ...], observations: Array
    ) -> tuple[Array, Array, Array]:
        """Return the partner's nodes before and after each outcome, and the action's chances."""
        seat, machine = 1 - self.seat, self.partner_machine
        chances = machine.probabilities[:, joint[seat]]
        nodes = np.flatnonzero(chances)[:, None]
        return nodes, machine.next_nodes[nodes, joint[seat], observations[:, seat]], chances[nodes]

    def initial_memory(self, observation: Array) -> Memory:
        """Return the beliefs before the first turn, at the partner's first node."""
        (first,) = super().initial_memory(observation)
        nodes = np.zeros((len(first), self.partner_node_count, first.shape[1]))
        nodes[:, 0] = first
        return (nodes.reshape(len(first), -1),)

    def split_nodes(self, beliefs: Reals) -> Reals:
        """Return the probabilities of nodes and states `[B, N, S]`."""
        return np.asarray(beliefs).reshape(len(beliefs), self.partner_node_count, -1)

    def current_belief(self, memory: Memory) -> Reals | None:
        """Return None, as the values depend on the partner's node too."""
        return None

    def state_belief(self, memory: Memory) -> Reals:
        """Return the beliefs `[B, S]` over the states, beside this partner."""
        return np.asarray(self.split_nodes(memory[0]).sum(axis=1))

    def replace_state_belief(self, memory: Memory, belief: Reals) -> Memory:
        """Return the memory of one row as if the belief over states were `belief` `[S]`.

        In each state, the partner's nodes keep their probabilities. In a state that was impossible
        before, they have those of all states together.
        """
        (nodes,) = self.split_nodes(memory[0])
        totals = nodes.sum(axis=0)
        shares = np.where(totals > 0.0, nodes / np.where(totals > 0.0, totals, 1.0), 0.0)
        shares = np.where(totals > 0.0, shares, nodes.sum(axis=1, keepdims=True))
        return ((shares * belief).reshape(1, -1), *memory[1:])

    def _update_beliefs(self, beliefs: Reals, turn_index: int) -> Reals:
        """Return the beliefs `[R, N * S]` after the same action and observation in each row.

        A random partner is assumed for a turn in which the partner rules out the observation.
        """
        action, observation = divmod(turn_index, self.problem.observation_counts[self.seat])
        joint = self._joint_belief_update(beliefs, action, observation)
        ruled_out = ~joint.any(axis=1)
        if ruled_out.any():
            partner = self._with_random_partner
            joint[ruled_out] = partner._joint_belief_update(beliefs[ruled_out], action, observation)
        return belief.apply_bayes_rule(joint).belief


@dataclass(frozen=True)
class BestResponseInTeam(HorizonPolicy, GreedyPolicy, PartnerBeliefPolicy):
    """Takes the best action beside a partner whose rule is known, with the turns left.

    It values the beliefs that can be reached, by the seat's own actions and observations.
    """

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return exact values beside the partner."""
        return super().values_basis(question)._replace(accuracy=Accuracy.EXACT)

    def __post_init__(self) -> None:
        """Raise BadPolicy for games that it cannot plan."""
        super().__post_init__()
        problem = self.problem
        spaces = (*problem.actions, *problem.observations)
        if not problem.observations or not all(isinstance(space, Labels) for space in spaces):
            raise BadPolicy(
                "best-response: needs hidden states, and labelled actions and observations"
            )
        states = problem.enumerate_states()
        starts_unobserved = (problem.initial_observations(states) == -1).all()
        is_free = problem.legal_actions_mask(states) is None and not problem.terminal(states).any()
        if problem.rewards_observable or not (starts_unobserved and is_free):
            raise BadPolicy("best-response: needs a game whose rewards and first states are hidden")

    @cached_property
    def rewards(self) -> Reals:
        """The expected reward `[A, N * S]` of each action."""
        problem, chances = self.problem, self.partner_machine.probabilities
        states = problem.enumerate_states()
        rewards = np.zeros((problem.action_counts[self.seat], len(chances), len(states)))
        for joint in np.ndindex(problem.action_counts):
            actions = np.tile(joint, (len(states), 1))
            source, p, outcome = enumerate_possible_outcomes(problem, states, actions)
            means = np.bincount(source, p * outcome.rewards[:, self.seat], len(states))
            rewards[joint[self.seat]] += np.outer(chances[:, joint[1 - self.seat]], means)
        return rewards.reshape(len(rewards), -1)

    def expected_reward(self, memory: Memory, action: int) -> float:
        """Return the expected reward of an action beside the partner."""
        return float(memory[0][0] @ self.rewards[action])

    def forecast_observations(self, memory: Memory, action: int) -> tuple[Reals, Reals]:
        """Return the probability `[O]` of each observation, and the belief `[O, S]` after it."""
        observations = range(self.problem.observation_counts[self.seat])
        after = [self._joint_belief_update(memory[0][:1], action, item)[0] for item in observations]
        posterior = belief.apply_bayes_rule(self.split_nodes(np.array(after)).sum(axis=1))
        return posterior.likelihood, posterior.belief

    def describe_model(self, memory: Memory) -> str:
        """Return the belief, which differs from the board's; '' with a random partner."""
        if self.to == "random":
            return ""
        b, states = self.state_belief(memory)[0], self.problem.enumerate_states()
        listed = np.sort(np.argsort(-b, kind="stable")[:MAX_DESCRIBED_STATES]).tolist()
        parts = [f"{self.problem.format_state(states[i])} {b[i]:.3f}" for i in listed]
        has_more = bool((np.delete(b, listed) > 0.0).any())
        return f"belief {', '.join(parts)}{', ...' * has_more}"

    def values_with_turns_left(self, info_state: Reals, turns_left: int | None) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, N * S]` with these rewards to come."""
        if turns_left is None:
            raise BadPolicy("best-response: needs a number of turns")
        budget = Budget("best response", "try fewer turns", MAX_WORK)
        return self._find_or_compute_values(info_state, turns_left, budget)

    @cached_property
    def _cached_values(self) -> dict[tuple[int, bytes], Reals]:
        """The values of each action by turns left and belief that were computed before."""
        return {}

    def _find_or_compute_values(self, b: Reals, turns_left: int, budget: Budget) -> Reals:
        """Return Q `[B, A]` of beliefs `[B, N * S]`, of equal beliefs computed once."""
        budget.spend_work(BELIEF_WORK * len(b))
        keys = [(turns_left, row.tobytes()) for row in np.round(b, BELIEF_DECIMALS)]
        new = {key: row for row, key in enumerate(keys) if key not in self._cached_values}
        if new:
            q = self._compute_action_values(b[[*new.values()]], turns_left, budget)
            self._cached_values.update(zip(new, q, strict=True))
        return np.stack([self._cached_values[key] for key in keys])

    def _compute_action_values(self, b: Reals, turns_left: int, budget: Budget) -> Reals:
        """Return the rewards `[B, A]` of beliefs and, discounted, the best values after them."""
        q = weighted_sum(b, self.rewards.T)
        if turns_left == 1:
            return q
        cells, likelihoods, beliefs = [], [], []
        for action in range(q.shape[1]):
            for transition in self._cached_transitions(action).values():
                budget.spend_work(ARRAY_CALL_WORK + 10.0 * len(b) * len(transition.source))
                posterior, likelihood = belief.apply_bayes_rule(transition.propagate(b))
                rows = np.flatnonzero(likelihood)
                cells.append(rows * q.shape[1] + action)
                likelihoods.append(likelihood[rows])
                beliefs.append(posterior[rows])
                budget.check_memory(32.0 * len(beliefs) * b.size)
        next_beliefs = np.concatenate(beliefs)
        if not len(next_beliefs):  # The script of the partner is over, and so is the game.
            return q
        next_q = self._find_or_compute_values(next_beliefs, turns_left - 1, budget)
        weights = np.concatenate(likelihoods) * next_q.max(axis=1)
        future = np.bincount(np.concatenate(cells), weights, q.size).reshape(q.shape)
        return np.asarray(q + self.problem.discount * future)
