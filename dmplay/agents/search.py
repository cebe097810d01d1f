"""Tree search for any problem."""

from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from itertools import chain
from typing import Self

import numpy as np

from dmplay.agents._particle_filter import N_PARTICLES, ParticleFilter, sample_states
from dmplay.agents.available_agents import HINT_PROVIDER_ROLE, PARTNER_ROLE
from dmplay.agents.base import AdviceQuestion, PolicyMaker
from dmplay.agents.belief_policy import BeliefPolicy
from dmplay.core import belief
from dmplay.core.action_values import UNKNOWN_BASIS, Accuracy, ActionValues, ValuesBasis
from dmplay.core.arrays import Array, Bools, Ints, Reals
from dmplay.core.best_actions import mark_best_actions
from dmplay.core.chance import sample_masked_index
from dmplay.core.parameters import parameter
from dmplay.core.policy import Memory, Percept, Policy
from dmplay.core.problem import build_percept, enumerate_outcomes, make_initial_observation
from dmplay.core.uniforms import expand_uniforms
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.solvers.search import leaf_values, uct
from dmplay.solvers.search.leaf_values import LeafValues
from dmplay.solvers.search.search_config import LeafEvaluator, SearchConfig, SearchRequest
from dmplay.solvers.search.simulated_opponents import OpponentModel, SeatPolicies, make_start_state
from dmplay.solvers.search.uct import UctResult

# hidden states up to which random playouts are better than values of fully observed states
MAX_ROLLOUT_STATES = 30
MAX_GAME_TURNS = 10**6  # maximum number of turns of a game
# outcomes that are sampled to estimate first actions: of all actions, and of one
MAX_SAMPLED_OUTCOMES, MIN_SAMPLES, MAX_SAMPLES = 128, 16, 64
OUTCOME_SIMULATIONS = 16  # simulations of each search after one of these outcomes
USUAL_AGENT = "usual"
UNLIMITED_TURNS = 10**9  # turns left in a game without an end


@dataclass(frozen=True)
class PolicyStateValue:
    """A leaf evaluator that takes the value of a policy's best action."""

    policy: Policy

    def __call__(self, s: Array, memory: Memory, turns_left: Ints) -> Reals:
        """Return the value `[N]` of the policy's best action in each state."""
        q = self.policy.action_values(memory)
        assert q is not None
        return np.asarray(q.max(axis=1))


@dataclass(frozen=True)
class TreeSearch(BeliefPolicy):
    """Simulates games and takes the action with the best mean return (Monte Carlo search, UCT).

    The other agents are assumed to play as their default partners, a team to follow its joint plan,
    else at random. If states are hidden, simulated games start in states drawn from its belief,
    never in the true state. The partners' observations and memories are estimated by a particle
    filter. The value of a state beyond the tree comes from a few sweeps over a small problem, else
    from the hint provider's values or playouts, else from random play.
    """

    simulations: int = parameter(400, "number of games simulated per choice", 1, 1e6)
    depth: int = parameter(20, "maximum number of turns of a simulated game", 1, 1e5)
    exploration: float = parameter(
        1.0, "UCB constant; higher: rarely tried actions more often", 0.0
    )
    others: str = parameter(
        USUAL_AGENT, "assumed policy of the other agents: usual, random or an agent"
    )
    rollout: str = parameter(USUAL_AGENT, "own policy beyond the tree: usual, random or an agent")
    horizon: int = parameter(
        0, "turns of a game; 0: the problem's horizon, if any", 0, MAX_GAME_TURNS
    )
    policy_maker: PolicyMaker | None = field(default=None, compare=False, repr=False)

    plans_whole_game = True
    uniform_count = 1  # one uniform, from which all its random numbers are derived

    def __post_init__(self) -> None:
        """Raise an error for invalid parameters and for problems that cannot be searched.

        BadParameter: a number is out of bounds, or `others` or `rollout` names a search. BadPolicy:
        states are hidden and the problem has no belief to search from.
        """
        super().__post_init__()
        if self.problem.partially_observable:
            try:
                belief.initial_belief(self.problem)
                _ = self.problem.observation_counts
                first_state = self.problem.enumerate_states()[:1]
                first_actions = np.zeros((1, len(self.problem.agents)), np.int64)
                enumerate_outcomes(self.problem, first_state, first_actions)
            except (BadParameter, BudgetExceeded) as error:
                message = f"search: cannot compute the belief over hidden states: {error}"
                raise BadPolicy(message) from None
        for field_name, name in (("others", self.others), ("rollout", self.rollout)):
            if name.partition(":")[0] == "search":
                expected = "expected an agent other than search"
                raise BadParameter(f"{field_name}: got {name!r}, {expected}")

    @property
    def game_turns(self) -> int | None:
        """The number of turns of a game; None if it has no end."""
        return self.horizon or self.problem.horizon

    def adapt_to_game(self, question: AdviceQuestion) -> Self:
        """Return a policy that searches to the end of the game."""
        turns = question.turn_limit
        if turns is None or turns == self.game_turns or turns > MAX_GAME_TURNS:
            return self
        return replace(self, horizon=turns)

    def values_basis(self, question: AdviceQuestion) -> ValuesBasis:
        """Return estimated values with the policies by which it simulates the other agents."""
        basis = super().values_basis(question)._replace(accuracy=Accuracy.ESTIMATED)
        if len(self.problem.agents) == 1:
            return basis
        if not any(self._other_policies):
            return basis._replace(assumed_players="with random other agents")
        names = "their default agents" if self.others == USUAL_AGENT else self.others
        return basis._replace(assumed_players=f"if the other agents play {names}")

    def with_policy_maker(self, policy_maker: PolicyMaker) -> Self:
        """Return a policy that gets the other agents and its rollout policy from `policy_maker`.

        Raises an error if `others` or `rollout` names an unknown agent.
        """
        policy = replace(self, policy_maker=policy_maker)
        if (self.others, self.rollout) != (USUAL_AGENT, USUAL_AGENT):
            _ = policy._opponent_model  # raises an error for unknown names
        return policy

    @cached_property
    def _config(self) -> SearchConfig:
        """The configuration of the search."""
        limits = self.simulations, self.depth, self.exploration
        return SearchConfig(
            self.problem, self.seat, *limits, self._opponent_model.seat_policies, self._leaf_value
        )

    @cached_property
    def _swept_leaf_values(self) -> LeafValues | None:
        """The leaf values by sweeps over all states; None if they do not apply or cost too much."""
        problem, count = self.problem, self.problem.state_count
        applies = len(problem.agents) == 1
        if problem.partially_observable:
            has_many_states = isinstance(count, int) and count > MAX_ROLLOUT_STATES
            applies = has_many_states and not any(self._other_policies)
        if not applies or self.rollout != USUAL_AGENT:
            return None
        return leaf_values.estimate_leaf_values(problem, self.seat, self.game_turns)

    @cached_property
    def _other_policies(self) -> SeatPolicies:
        """The policies of the other seats; None for random play, and for the own seat."""
        seats = range(len(self.problem.agents))
        return tuple(
            None if seat == self.seat else self._resolve_policy(seat, self.others, PARTNER_ROLE)
            for seat in seats
        )

    @cached_property
    def _own_rollout_policy(self) -> Policy | None:
        """The policy of the own seat beyond the tree; None for random play.

        It is random play if leaf values replace playouts, if the problem has one state, or if the
        hint provider cannot be used: hidden states with random partners, or values that cost too
        much.
        """
        has_random_partners = self.problem.partially_observable and not any(self._other_policies)
        has_leaf_values = self._swept_leaf_values is not None
        plays_randomly = has_leaf_values or has_random_partners or self.problem.state_count == 1
        usual_name = "random" if plays_randomly else HINT_PROVIDER_ROLE
        policy = self._resolve_policy(self.seat, self.rollout, usual_name)
        if policy and self.rollout == USUAL_AGENT and len(self.problem.agents) == 1:
            start = make_start_state(self.problem)
            observation = make_initial_observation(self.problem, start, self.seat)
            try:
                policy.action_values(policy.initial_memory(observation))
            except BudgetExceeded:
                return None
        return policy

    @cached_property
    def _opponent_model(self) -> OpponentModel:
        """The policies of all seats in simulations."""
        earlier, later = self._other_policies[: self.seat], self._other_policies[self.seat + 1 :]
        return OpponentModel(self.problem, self.seat, (*earlier, self._own_rollout_policy, *later))

    def _resolve_policy(self, seat: int, name: str, default_name: str) -> Policy | None:
        """Return the policy of a seat by name; None for uniformly random play."""
        policy_name = default_name if name == USUAL_AGENT else name
        if not self.policy_maker or policy_name == "random":
            return None
        policy = self.policy_maker(seat, policy_name)
        if not policy or not self.horizon:
            return policy
        return policy.adapt_to_game(AdviceQuestion(seat, self.game_turns))

    @property
    def _leaf_value(self) -> LeafEvaluator | None:
        """The evaluator of states beyond the tree; None if playouts are used instead.

        The values of a joint plan hold only while the whole team follows it, so a joint plan is
        played.
        """
        sweep_values, policy = self._swept_leaf_values, self._own_rollout_policy
        follows_joint_plan = self.problem.shared_reward and any(self._other_policies)
        is_usual = (self.rollout, self.others) == (USUAL_AGENT, USUAL_AGENT)
        if sweep_values or policy is None or follows_joint_plan or not is_usual:
            return sweep_values
        first_memories = self._opponent_model.begin_memories(make_start_state(self.problem))
        first_memory = first_memories[self.seat]
        return None if policy.action_values(first_memory) is None else PolicyStateValue(policy)

    @cached_property
    def _particle_filter(self) -> ParticleFilter | None:
        """The particle filter of partners' memories; None if they are random, or all is visible."""
        if not self.problem.partially_observable or not any(self._other_policies):
            return None
        return ParticleFilter(OpponentModel(self.problem, self.seat, self._other_policies))

    def initial_memory(self, observation: Array) -> Memory:
        """Return the state or belief, zero turns done, and the memories of the policies.

        If states are hidden, the memories are that of the own seat's policy and the particles.
        """
        turns_done, policy = np.zeros(len(observation), np.int64), self._own_rollout_policy
        if not self.problem.partially_observable:
            policy_memory = chain(*self._opponent_model.begin_memories(observation))
            return (observation, turns_done, *policy_memory)
        (beliefs,) = super().initial_memory(observation)
        own_memory = policy.initial_memory(observation) if policy else ()
        particles = self._particle_filter.begin(beliefs) if self._particle_filter else ()
        return (beliefs, turns_done, *own_memory, *particles)

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """Return the memory after one more turn."""
        state_or_belief, turns_done, *policy_memory = memory
        if not self.problem.partially_observable:
            arrays, memories = list[Array](), self._opponent_model.split_memory((*policy_memory,))
            for seat, policy in enumerate(self._opponent_model.seat_policies):
                if policy:
                    seat_percept = self._make_percept_for_seat(seat, percept)
                    arrays += policy.update_memory(memories[seat], seat_percept)
            return (percept.observation, turns_done + 1, *arrays)
        (beliefs,) = super().update_memory((state_or_belief,), percept)
        own_memory, particles = self._split_memory(tuple(policy_memory))
        if self._own_rollout_policy:
            own_memory = self._own_rollout_policy.update_memory(own_memory, percept)
        if self._particle_filter:
            particles = self._particle_filter.update(particles, percept, turns_done, beliefs)
        return (beliefs, turns_done + 1, *own_memory, *particles)

    def _split_memory(self, policy_memory: Memory) -> tuple[Memory, Memory]:
        """Return the memory of the own seat's policy and the particles, which share one tuple."""
        own_slice = self._opponent_model.memory_slices[self.seat]
        own_count = own_slice.stop - own_slice.start
        return policy_memory[:own_count], policy_memory[own_count:]

    def _make_percept_for_seat(self, seat: int, percept: Percept) -> Percept:
        """Return the percept of a turn for a seat, without the reward if it is another seat."""
        if seat == self.seat:
            return percept
        assert percept.actions is not None  # always given if all agents see the state
        return percept._replace(action=percept.actions[:, seat], reward=None)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return actions with the greatest mean return; ties are broken at random."""
        blocks = []
        for rows in self._config.make_row_slices(len(u)):
            block_memory = tuple(array[rows] for array in memory)
            block_legal = None if legal is None else legal[rows]
            blocks.append(self._choose_for_rows(block_memory, block_legal, u[rows, 0]))
        return np.concatenate(blocks)

    def _choose_for_rows(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """Return the actions `[B]` of rows that are searched together.

        An action of the own seat's policy is kept unless another one is significantly better.
        """
        result, uniforms = self._run_search(memory, legal, u)
        is_best = mark_best_actions(result.mean_returns, self.problem.reward_scale)
        policy = self._own_rollout_policy
        if policy:
            own_memory = self._get_rollout_policy_memory(memory)
            usual_actions = policy.choose(own_memory, legal, uniforms[:, : policy.uniform_count])
            is_best = result.prefer_usual_action(is_best, usual_actions)
        return np.asarray(result.actions[np.arange(len(u)), sample_masked_index(is_best, u)])

    def estimate_returns(
        self, memory: Memory, legal: Bools | None, u: Reals
    ) -> ActionValues | None:
        """Return the mean return of each legal action over sampled outcomes; None for real actions.

        One search tries actions that begin badly too seldom, stores only some of the random
        outcomes, and counts its own trials of bad actions. Here each sample is an outcome of its
        own: one search chooses the action after it, and another one values that choice.
        """
        action_count = self.problem.action_counts[self.seat]
        if not action_count:
            return None
        actions = np.arange(action_count) if legal is None else np.flatnonzero(legal[0])
        count = min(max(MAX_SAMPLED_OUTCOMES // len(actions), MIN_SAMPLES), MAX_SAMPLES)
        first_actions = np.repeat(actions, count)
        # The n-th sample of each action has the same uniforms.
        uniforms = np.tile(expand_uniforms(u[:, 0], 3 * count).reshape(count, 3), (len(actions), 1))
        search = self._search_after_outcome
        samples = [
            search._sample_returns(memory, first_actions[rows], uniforms[rows])
            for rows in search._config.make_row_slices(len(first_actions))
        ]
        returns = np.concatenate(samples).reshape(len(actions), count)
        # Rare outcomes may be missing: the extreme ones count once more.
        extremes = np.stack([returns.min(axis=1), returns.max(axis=1)], axis=1)
        deviations = np.hstack([returns, extremes]).std(axis=1, ddof=1)
        q, errors = np.full(action_count, np.nan), np.full(action_count, np.inf)
        q[actions], errors[actions] = returns.mean(axis=1), deviations / np.sqrt(count)
        scale, bounds = self.problem.reward_scale, self.problem.return_bounds
        return ActionValues(q, UNKNOWN_BASIS, scale, errors, bounds, count)

    @cached_property
    def _search_after_outcome(self) -> "TreeSearch":
        """The search after one sampled outcome of a first action."""
        return replace(self, simulations=min(self.simulations, OUTCOME_SIMULATIONS))

    def _sample_returns(self, memory: Memory, first_actions: Ints, u: Reals) -> Reals:
        """Return a sampled return `[B]` of each first action, by uniforms `[B, 3]`."""
        model, seat, turns = self._opponent_model, self.seat, self.game_turns
        memory = tuple(array.repeat(len(u), axis=0) for array in memory)
        first_uniforms = expand_uniforms(u[:, 0], 1 + model.uniforms_per_turn)
        roots, memories = self._make_start_states(memory, first_uniforms[:, :1])
        memories = tuple(tuple(part[:, 0] for part in parts) for parts in memories)
        turn_uniforms = first_uniforms[:, 1:]
        joint = model.choose_joint_actions(roots[:, 0], memories, first_actions, turn_uniforms)
        outcome = model.step_states(roots[:, 0], joint, turn_uniforms)
        percept = build_percept(self.problem, seat, joint, outcome)
        goes_on = ~self.problem.terminal(outcome.state)
        if turns is not None:
            goes_on &= turns - memory[1] % turns > 1
        returns = outcome.rewards[:, seat].copy()
        rows = np.flatnonzero(goes_on)
        if len(rows):
            after = tuple(part[rows] for part in self.update_memory(memory, percept))
            mask = self.problem.legal_actions_mask(outcome.state[rows])
            legal = None if mask is None else mask[:, seat]
            choice, _ = self._run_search(after, legal, u[rows, 1])
            value, _ = self._run_search(after, legal, u[rows, 2])
            best = choice.mean_returns.argmax(axis=1)
            values = value.mean_returns[np.arange(len(rows)), best]
            values = np.where(np.isfinite(values), values, choice.mean_returns.max(axis=1))
            returns[rows] += self.problem.discount * values
        return returns

    def _run_search(self, memory: Memory, legal: Bools | None, u: Reals) -> tuple[UctResult, Reals]:
        """Return the result of a search, and the uniforms `[B, K]` expanded from `u`."""
        config, turns = self._config, self.game_turns
        config.make_budget(len(u))  # raises BudgetExceeded before any uniforms are generated
        uniforms = expand_uniforms(u, self.simulations + config.uniforms_per_row)
        roots, memories = self._make_start_states(memory, uniforms[:, : self.simulations])
        turns_left = np.full(len(u), UNLIMITED_TURNS)
        if turns is not None:
            turns_left = turns - memory[1] % turns
        request = SearchRequest(roots, turns_left, memories, legal)
        return uct.run_uct(config, request, uniforms[:, self.simulations :]), uniforms

    def _get_rollout_policy_memory(self, memory: Memory) -> Memory:
        """Return the memory of the policy that plays this seat beyond the tree."""
        if self.problem.partially_observable:
            return self._split_memory(memory[2:])[0]
        return self._opponent_model.split_memory(memory[2:])[self.seat]

    def _make_start_states(self, memory: Memory, u: Reals) -> tuple[Array, tuple[Memory, ...]]:
        """Return the states `[B, N, ...]` where simulations start, and each seat's memory there."""
        state_or_belief, _, *policy_memory = memory
        seats, repeat = range(len(self.problem.agents)), partial(_repeat_per_row, u.shape[1])
        if not self.problem.partially_observable:
            memories = self._opponent_model.split_memory((*map(repeat, policy_memory),))
            return repeat(state_or_belief), memories
        own_memory, particles = self._split_memory(tuple(policy_memory))
        own_copies = (*map(repeat, own_memory),)
        if not self._particle_filter:
            memories = tuple(own_copies if seat == self.seat else () for seat in seats)
            return sample_states(self.problem, state_or_belief, u), memories
        row, particle_index = np.arange(len(u))[:, None], (u * N_PARTICLES).astype(np.int64)
        s, *memory_arrays = (array[row, particle_index] for array in particles)
        others = self._particle_filter.opponent_model.split_memory(tuple(memory_arrays))
        return s, tuple(own_copies if seat == self.seat else others[seat] for seat in seats)


def _repeat_per_row(simulation_count: int, part: Array) -> Array:
    """Return an array repeated for each simulation, of shape `[B, N, ...]`."""
    return np.broadcast_to(part[:, None], (len(part), simulation_count, *part.shape[1:]))
