"""Tree search for any problem."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import chain
from typing import Self

import numpy as np

from dmplay import belief
from dmplay.chance import Array, Bools, Ints, Reals, sample_masked_index
from dmplay.core import Memory, Percept, Policy, enumerate_outcomes, parameter
from dmplay.dice import expand_uniforms
from dmplay.errors import BadParameter, BadPolicy, BudgetExceeded
from dmplay.policies._believing import BeliefPolicy
from dmplay.policies._guessing import N_PARTICLES, ParticleFilter, sample_states
from dmplay.policies.kinds import PolicyLookup
from dmplay.policies.roster import HINT_PROVIDER_ROLE, PARTNER_ROLE
from dmplay.solvers import rewards_ahead, uct
from dmplay.solvers.cast import OpponentModel, SeatPolicies, make_start_state
from dmplay.solvers.rewards_ahead import LeafValues
from dmplay.solvers.search_nodes import TreeBatch
from dmplay.solvers.search_subtree import extract_subtrees, pack_trees
from dmplay.solvers.search_tree import GOLDEN_RATIO, LeafEvaluator, SearchConfig, SearchRequest
from dmplay.solvers.uct import UctResult
from dmplay.solvers.value_iteration import mark_best_actions

MAX_ROLLOUT_STATES = (
    30  # states that random play comes to soon: there it tells more than seeing them all
)
MAX_GAME_TURNS = 10**6  # turns of a game that are counted
USUAL_AGENT = "usual"
N_RESULT_ARRAYS = len(UctResult._fields)
UNLIMITED_TURNS = 10**9  # turns left where a game has no end of its own


@dataclass(frozen=True)
class PolicyStateValue:
    """What an adviser that knows values holds of a state."""

    policy: Policy

    def __call__(self, s: Array, memory: Memory, turns_left: Ints) -> Reals:
        """The value of its best action."""
        q = self.policy.action_values(memory)
        assert q is not None
        return np.asarray(q.max(axis=1))


@dataclass(frozen=True)
class TreeSearch(BeliefPolicy):
    """Simulates many games ahead and does what went best (UCT).

    It takes the others to act as their usual partners do, a team to follow its plan, else at
    random. Where states are hidden it starts its games in states drawn from its belief, never in
    the true one, and guesses what its partners saw and remember. What lies beyond its tree is worth
    what a few sweeps over a small problem say, else what the adviser says or earns, else what
    random play earns.
    """

    simulations: int = parameter(400, "games simulated before a choice", 1, 1e6)
    depth: int = parameter(20, "turns that each of them looks ahead", 1, 1e5)
    exploration: float = parameter(1.0, "weight of trying what was tried seldom", 0.0)
    others: str = parameter(
        USUAL_AGENT, "who the others are taken to be: usual, random or an agent"
    )
    rollout: str = parameter(USUAL_AGENT, "who plays on beyond the tree: usual, random or an agent")
    horizon: int = parameter(
        0, "turns of a game; 0: those of the problem, if any", 0, MAX_GAME_TURNS
    )
    reuse: bool = parameter(False, "whether a turn goes on with the tree of the turn before")
    policy_lookup: PolicyLookup | None = field(default=None, compare=False, repr=False)

    plans_whole_game = True
    uniform_count = 1  # from which all of its own luck follows

    def __post_init__(self) -> None:
        """Refuses numbers out of bounds, and problems without a belief to search from."""
        super().__post_init__()
        if self.problem.partially_observable:
            try:
                belief.initial_belief(self.problem)
                _ = self.problem.observation_counts
                first = self.problem.enumerate_states()[:1]
                enumerate_outcomes(
                    self.problem, first, np.zeros((1, len(self.problem.agents)), np.int64)
                )
            except (BadParameter, BudgetExceeded) as error:
                raise BadPolicy(f"search needs a belief, as states are hidden: {error}") from None
            if self.reuse and self.problem.legal_actions_mask(first) is not None:
                raise BadPolicy("search: reuse needs states that are seen, or all actions legal")
        for part, name in (("others", self.others), ("rollout", self.rollout)):
            if name.partition(":")[0] == "search":
                raise BadParameter(f"{part}: got {name!r}, expected an agent that does not search")

    @property
    def game_turns(self) -> int | None:
        """How many turns a game has; None for no end."""
        return self.horizon or self.problem.horizon

    def adapt_to_game(self, turns: int | None, rivals: Sequence[str]) -> Self:
        """One that searches to the end of the game."""
        if turns is None or turns == self.game_turns or turns > MAX_GAME_TURNS:
            return self
        return replace(self, horizon=turns)

    def with_policy_lookup(self, company: PolicyLookup) -> Self:
        """The same, who finds other agents there."""
        found = replace(self, policy_lookup=company)
        if (self.others, self.rollout) != (USUAL_AGENT, USUAL_AGENT):
            _ = found._opponent_model  # refuses names that nobody has
        return found

    @cached_property
    def _config(self) -> SearchConfig:
        parts = self.simulations, self.depth, self.exploration
        return SearchConfig(
            self.problem,
            self.seat,
            *parts,
            self._opponent_model.seat_policies,
            self._leaf_value,
            self.reuse,
        )

    @cached_property
    def _sweep_values(self) -> LeafValues | None:
        problem = self.problem
        many = isinstance(problem.state_count, int) and problem.state_count > MAX_ROLLOUT_STATES
        asked = (
            many and not any(self._other_policies)
            if problem.partially_observable
            else len(problem.agents) == 1
        )
        asked = asked and self.rollout == USUAL_AGENT
        return (
            rewards_ahead.estimate_leaf_values(problem, self.seat, self.game_turns)
            if asked
            else None
        )

    @cached_property
    def _other_policies(self) -> SeatPolicies:
        """Who acts in the other seats; nobody in the own one."""
        seats = range(len(self.problem.agents))
        return tuple(
            None if seat == self.seat else self._resolve_policy(seat, self.others, PARTNER_ROLE)
            for seat in seats
        )

    @cached_property
    def _own_rollout_policy(self) -> Policy | None:
        """Who plays on in the own seat beyond the tree; nobody where one alone cannot plan that."""
        alone = self.problem.partially_observable and not any(self._other_policies)
        unasked = self._sweep_values is not None or alone or self.problem.state_count == 1
        found = self._resolve_policy(
            self.seat, self.rollout, "random" if unasked else HINT_PROVIDER_ROLE
        )
        if found and self.rollout == USUAL_AGENT and len(self.problem.agents) == 1:
            try:
                found.action_values(
                    found.initial_memory(
                        self.problem.initial_observation(make_start_state(self.problem), self.seat)
                    )
                )
            except BudgetExceeded:
                return None
        return found

    @cached_property
    def _opponent_model(self) -> OpponentModel:
        """Who acts in each seat."""
        before, after = self._other_policies[: self.seat], self._other_policies[self.seat + 1 :]
        return OpponentModel(self.problem, self.seat, (*before, self._own_rollout_policy, *after))

    def _resolve_policy(self, seat: int, name: str, default_name: str) -> Policy | None:
        """Who acts in a seat; None for any action, each as likely."""
        wanted = default_name if name == USUAL_AGENT else name
        found = (
            self.policy_lookup(seat, wanted) if self.policy_lookup and wanted != "random" else None
        )
        return found.adapt_to_game(self.game_turns, ()) if found and self.horizon else found

    @property
    def _leaf_value(self) -> LeafEvaluator | None:
        """What a state beyond the tree is worth; None where the simulation plays on.

        A plan is worth what it is as long as all of a team follow it: here it is played.
        """
        ahead, actor = self._sweep_values, self._own_rollout_policy
        planned = self.problem.shared_reward and any(self._other_policies)
        if (
            ahead
            or actor is None
            or planned
            or (self.rollout, self.others) != (USUAL_AGENT, USUAL_AGENT)
        ):
            return ahead
        first = self._opponent_model.begin_memories(make_start_state(self.problem))[self.seat]
        return None if actor.action_values(first) is None else PolicyStateValue(actor)

    @cached_property
    def _particle_filter(self) -> ParticleFilter | None:
        """What partners remember who see something else; None where they act at random."""
        cast = OpponentModel(self.problem, self.seat, self._other_policies)
        return (
            ParticleFilter(cast)
            if self.problem.partially_observable and any(self._other_policies)
            else None
        )

    def initial_memory(self, observation: Array) -> Memory:
        """The state, or the belief where it is hidden; no turn done; what the cast remembers.

        Where states are hidden that is what the own part of it does, and guesses of the rest.
        Where trees are used again, also the tree, and what it tells of the choice to come.
        """
        memory = self._initial_memory(observation)
        return self._grow_trees(memory) if self.reuse else memory

    def update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """The same after one more turn."""
        if not self.reuse:
            return self._update_memory(memory, percept)
        tree, saw = self._config, percept.observation
        first = len(memory) - tree.packed_array_count - N_RESULT_ARRAYS
        memory, trees = memory[:first], memory[first:-N_RESULT_ARRAYS]
        if not tree.observation_count:
            saw = uct.hash_observations(self.problem, saw)
        elif not self.problem.partially_observable:
            saw = self.problem.state_indices(saw)
        trees = extract_subtrees(tree, trees, percept.action, saw)
        return self._grow_trees(self._update_memory(memory, percept), trees)

    def _grow_trees(self, memory: Memory, trees: Memory = ()) -> Memory:
        """What is known, then the trees that grow from some that were kept, and what they tell.

        Their luck is the same in all games, so that the same history always leads to the same ones.
        """
        luck = (1 + memory[1]) * GOLDEN_RATIO % 1.0
        self._config.check_memory(len(luck))
        grown = []
        for rows in self._config.split_rows(len(luck)):
            now, before = (tuple(part[rows] for part in each) for each in (memory, trees))
            found, nodes, _ = self._run_search(now, None, luck[rows], before)
            grown.append((*pack_trees(nodes), *found))
        return (*memory, *map(np.concatenate, zip(*grown, strict=True)))

    def _initial_memory(self, observation: Array) -> Memory:
        """What is known before the first turn."""
        done = np.zeros(len(observation), np.int64)
        if not self.problem.partially_observable:
            return (observation, done, *chain(*self._opponent_model.begin_memories(observation)))
        (beliefs,) = super().initial_memory(observation)
        own = (
            self._own_rollout_policy.initial_memory(observation) if self._own_rollout_policy else ()
        )
        guesses = self._particle_filter.begin(beliefs) if self._particle_filter else ()
        return (beliefs, done, *own, *guesses)

    def _update_memory(self, memory: Memory, percept: Percept) -> Memory:
        """What is known after one more turn."""
        known, done, *rest = memory
        if not self.problem.partially_observable:
            cast = zip(
                self._opponent_model.seat_policies,
                self._opponent_model.split_memory(tuple(rest)),
                strict=True,
            )
            told = (
                one.update_memory(kept, self._percept_for_seat(seat, percept))
                for seat, (one, kept) in enumerate(cast)
                if one
            )
            return (percept.observation, done + 1, *chain(*told))
        (beliefs,) = super().update_memory((known,), percept)
        own, guesses = self._split_memory(tuple(rest))
        own = (
            self._own_rollout_policy.update_memory(own, percept) if self._own_rollout_policy else ()
        )
        if self._particle_filter:
            guesses = self._particle_filter.update(guesses, percept, done, beliefs)
        return (beliefs, done + 1, *own, *guesses)

    def _split_memory(self, policy_memory: Memory) -> tuple[Memory, Memory]:
        """What the own part of the cast remembers, and the guesses."""
        part = self._opponent_model.memory_slices[self.seat]
        many = part.stop - part.start
        return policy_memory[:many], policy_memory[many:]

    def _percept_for_seat(self, seat: int, percept: Percept) -> Percept:
        """What a turn taught another seat, as far as this one knows."""
        if seat == self.seat:
            return percept
        assert percept.actions is not None  # where all is seen
        return percept._replace(action=percept.actions[:, seat], reward=None)

    def choose(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """An action with the greatest mean return; of several, any."""
        parts = [
            self._choose_rows(
                tuple(part[some] for part in memory),
                None if legal is None else legal[some],
                u[some, 0],
            )
            for some in self._config.split_rows(len(u))
        ]
        return np.concatenate(parts)

    def _choose_rows(self, memory: Memory, legal: Bools | None, u: Reals) -> Array:
        """The actions `[B]` for some rows that are searched together."""
        if self.reuse:
            found = UctResult(*memory[-N_RESULT_ARRAYS:])
            told = expand_uniforms(
                u, self._own_rollout_policy.uniform_count if self._own_rollout_policy else 0
            )
        else:
            found, _, told = self._run_search(memory, legal, u)
        able = mark_best_actions(found.mean_returns)
        if self._own_rollout_policy:
            usual = self._own_rollout_policy.choose(
                self._own_policy_memory(memory),
                legal,
                told[:, : self._own_rollout_policy.uniform_count],
            )
            able = found.keep_usual_unless_better(able, usual)
        return np.asarray(found.actions[np.arange(len(u)), sample_masked_index(able, u)])

    def _run_search(
        self, memory: Memory, legal: Bools | None, u: Reals, trees: Memory = ()
    ) -> tuple[UctResult, TreeBatch, Reals]:
        """What a search finds out, the trees that it grows, and what its uniforms `[B]` told."""
        tree, problem, turns = self._config, self.problem, self.game_turns
        tree.make_budget(len(u))  # refuses too much before it is drawn for
        told = expand_uniforms(u, self.simulations + tree.uniforms_per_row)
        roots, cast = self._prepare_roots(memory, told[:, : self.simulations])
        left = np.full(len(u), UNLIMITED_TURNS) if turns is None else turns - memory[1] % turns
        if self.reuse:
            able = problem.legal_actions_mask(roots[:, 0])
            legal = None if able is None else able[:, self.seat]
            over = problem.terminal(roots.reshape(-1, *roots.shape[2:])).reshape(len(u), -1)
            left = np.where(over.all(axis=1), 0, left)
        asked = SearchRequest(roots, left, cast, legal, trees)
        return *uct.run_uct(tree, asked, told[:, self.simulations :]), told

    def _own_policy_memory(self, memory: Memory) -> Memory:
        """What the own part of the cast remembers."""
        rest = memory[2:]
        return (
            self._split_memory(rest)[0]
            if self.problem.partially_observable
            else self._opponent_model.split_memory(rest)[self.seat]
        )

    def _prepare_roots(self, memory: Memory, u: Reals) -> tuple[Array, tuple[Memory, ...]]:
        """States `[B, N, ...]` in which simulations start, and what the cast remembers there."""
        known, _, *rest = memory
        each = range(len(self.problem.agents))
        if not self.problem.partially_observable:
            copies = (_repeat_per_simulation(part, u.shape[1]) for part in rest)
            return _repeat_per_simulation(known, u.shape[1]), self._opponent_model.split_memory(
                tuple(copies)
            )
        own, guesses = self._split_memory(tuple(rest))
        mine = tuple(_repeat_per_simulation(part, u.shape[1]) for part in own)
        if not self._particle_filter:
            return sample_states(self.problem, known, u), tuple(
                mine if seat == self.seat else () for seat in each
            )
        row, place = np.arange(len(u))[:, None], (u * N_PARTICLES).astype(np.int64)
        s, *parts = (part[row, place] for part in guesses)
        others = self._particle_filter.opponent_model.split_memory(tuple(parts))
        return s, tuple(mine if seat == self.seat else others[seat] for seat in each)


def _repeat_per_simulation(part: Array, simulation_count: int) -> Array:
    """The same in each of so many simulations `[B, N, ...]`."""
    return np.broadcast_to(part[:, None], (len(part), simulation_count, *part.shape[1:]))
