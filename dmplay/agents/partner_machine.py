"""The rule of another agent as a finite machine, for a belief about what this agent will do."""

from itertools import product
from typing import NamedTuple

import numpy as np

from dmplay.agents.base import SeatPolicy
from dmplay.core.arrays import Ints, Reals
from dmplay.core.policy import Memory, Percept
from dmplay.errors import BadPolicy


class PartnerMachine(NamedTuple):
    """A partner as a finite machine; a node is its memory, maybe with its last observation."""

    observations: Ints  # [N], the last observation of each node, -1 if it has none or several
    probabilities: Reals  # [N, A], of each action
    next_nodes: Ints  # [N, A, O], after an action of the partner and its observation


def build_partner_machine(
    name: str, policy: SeatPolicy, max_nodes: int, *, splits_observations: bool
) -> PartnerMachine:
    """Return the machine of the policy of an agent, whose first observation is empty.

    With `splits_observations`, a node has one last observation. Memories that lead to the same play
    are one node. Raises BadPolicy if the choices are not known, or if there are more than
    `max_nodes` memories.
    """
    action_count = policy.problem.action_counts[policy.seat]
    observation_count = policy.problem.observation_counts[policy.seat]
    memory = policy.initial_memory(np.full(1, -1))
    nodes, pending = {_node_bytes(-1, memory): 0}, [(-1, memory)]
    observations, probabilities, next_nodes = [], [], []
    while pending:
        observation, memory = pending.pop(0)
        chances = policy.choice_probabilities(memory)
        if chances is None or len(nodes) > max_nodes:
            raise BadPolicy(f"cannot plan with the partner {name}: its rule is unknown or too long")
        observations.append(observation)
        probabilities.append(chances[0])
        next_nodes.append(np.zeros((action_count, observation_count), np.int64))
        for action, observed in product(np.flatnonzero(chances[0]), range(observation_count)):
            percept = Percept(np.array([action]), np.array([observed]), None, None)
            after = observed if splits_observations else -1, policy.update_memory(memory, percept)
            key = _node_bytes(*after)
            if key not in nodes:
                nodes[key] = len(nodes)
                pending.append(after)
            next_nodes[-1][action, observed] = nodes[key]
        # An action that the rule never takes leads where its usual action leads.
        next_nodes[-1][chances[0] == 0.0] = next_nodes[-1][chances[0].argmax()]
    return _merge_equal_nodes(
        PartnerMachine(np.array(observations), np.array(probabilities), np.array(next_nodes))
    )


def _merge_equal_nodes(machine: PartnerMachine) -> PartnerMachine:
    """Return the smallest machine with the same choices, by partition refinement (Moore)."""
    features = np.column_stack([machine.observations, machine.probabilities])
    block_count = 0
    while True:
        _, first, block = np.unique(features, axis=0, return_index=True, return_inverse=True)
        block = np.argsort(np.argsort(first))[block.reshape(-1)]  # the first node stays the first
        if len(first) == block_count:
            first.sort()
            next_nodes = block[machine.next_nodes[first]]
            return PartnerMachine(
                machine.observations[first], machine.probabilities[first], next_nodes
            )
        block_count = len(first)
        features = np.column_stack([block, block[machine.next_nodes].reshape(len(block), -1)])


def _node_bytes(observation: int, memory: Memory) -> bytes:
    """Return the last observation and a memory of one row as bytes."""
    return b"".join([np.int64(observation).tobytes(), *(array.tobytes() for array in memory)])
