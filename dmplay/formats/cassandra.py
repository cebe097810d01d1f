"""Read files of Cassandra's format (`.pomdp`, `.mdp`) and of MADP's (`.dpomdp`)."""

from collections.abc import Sequence

import numpy as np

from dmplay.core.playability_checks import RESERVED_WORDS
from dmplay.core.spaces import Labels
from dmplay.core.tabular import SparseTables
from dmplay.formats.declarations import (
    AnyDeclaration,
    Declaration,
    ReadingMemory,
    make_unique_labels,
)
from dmplay.formats.lexer import SourceText
from dmplay.formats.preamble import parse_preamble
from dmplay.formats.probability_array import ProbabilityArray
from dmplay.formats.problem_classes import FileProblem, MarkovModel
from dmplay.formats.reward_array import RewardArray
from dmplay.formats.statements import StatementGrammar, find_first_statement, iter_statements

# the single observation if states are visible
SINGLE_OBSERVATION = Declaration("observation", ["0"])


def read_markov_file(path: str, raw: bytes, *, team: bool = False) -> FileProblem:
    """Return the problem in a file of this content; it is one of several agents if `team`."""
    source = SourceText.from_bytes(path, raw)
    preamble_end = find_first_statement(source, team=team)
    header = parse_preamble(source, preamble_end, team=team)
    actions, states = header.actions, header.states
    fields: dict[str, Sequence[AnyDeclaration]] = {"T": (actions, states, states)}
    if header.observations:
        fields["O"] = (actions, states, header.observations)
    fields["R"] = (actions, states, states, header.observations or SINGLE_OBSERVATION)
    grammars = {kind: StatementGrammar(kind, names, team=team) for kind, names in fields.items()}
    memory = ReadingMemory()
    name_bytes = states.byte_count + actions.byte_count
    name_bytes += header.observations.byte_count if header.observations else 0
    memory.record("names", name_bytes)
    probability_arrays = {
        kind: ProbabilityArray(grammar, header.initial_belief, memory)
        for kind, grammar in grammars.items()
        if kind != "R"
    }
    reward_array = RewardArray(grammars["R"], memory)
    for statement in iter_statements(source, grammars):
        if statement.grammar.kind == "R":
            reward_array.add_statement(statement)
        else:
            probability_arrays[statement.grammar.kind].add_statement(statement)
    matrices = {"T": probability_arrays["T"].build_transitions(source)}
    if "O" in probability_arrays:
        matrices["O"] = probability_arrays["O"].build_observations(source, matrices["T"])
    sign = -1.0 if header.rewards_are_costs else 1.0
    rewards = reward_array.build_rewards(matrices["T"]) * sign + 0.0  # no -0.0
    tables = SparseTables(
        matrices["T"], np.tile(rewards[:, None], (1, len(header.agents))), matrices.get("O")
    )
    model = MarkovModel(
        header.agents,
        tuple(
            Labels(make_unique_labels(axis.names, "action", RESERVED_WORDS))
            for axis in actions.declarations
        ),
        tuple(Labels(axis.names) for axis in header.observations.declarations)
        if header.observations
        else (),
        states.names,
        header.initial_belief,
        tables,
        source.leading_comment,
        {kind: array.empty_row_count for kind, array in probability_arrays.items()},
    )
    return FileProblem(header.discount, model=model)
