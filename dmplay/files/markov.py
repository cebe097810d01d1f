"""Reading files of Cassandra's format (`.pomdp`, `.mdp`) and of MADP's (`.dpomdp`)."""

from collections.abc import Sequence

import numpy as np

from dmplay.core import Labels
from dmplay.files.names import AnyDeclaration, Declaration, make_unique_labels
from dmplay.files.payments import RewardArray
from dmplay.files.preamble import parse_preamble
from dmplay.files.problem import FileProblem, MarkovModel
from dmplay.files.shares import ProbabilityArray
from dmplay.files.statements import StatementGrammar, find_first_statement, iter_statements
from dmplay.files.words import SourceText
from dmplay.laws.sound import RESERVED_WORDS
from dmplay.tabular import SparseTables

SINGLE_OBSERVATION = Declaration("observation", ["0"])  # what is observed where states are seen


def read_markov_file(path: str, raw: bytes, *, team: bool = False) -> FileProblem:
    """The problem that a file of this content holds; of several agents if a team's."""
    text = SourceText.from_bytes(path, raw)
    end = find_first_statement(text, team=team)
    told = parse_preamble(text, end, team=team)
    actions, states = told.actions, told.states
    fields: dict[str, Sequence[AnyDeclaration]] = {"T": (actions, states, states)}
    if told.observations:
        fields["O"] = (actions, states, told.observations)
    fields["R"] = (actions, states, states, told.observations or SINGLE_OBSERVATION)
    forms = {kind: StatementGrammar(kind, named, team=team) for kind, named in fields.items()}
    shares = {
        kind: ProbabilityArray(form, told.initial_belief)
        for kind, form in forms.items()
        if kind != "R"
    }
    payments = RewardArray(forms["R"])
    for said in iter_statements(text, forms):
        if said.grammar.kind == "R":
            payments.add_statement(said)
        else:
            shares[said.grammar.kind].add_statement(said)
    rows = {kind: one.rows(text) for kind, one in shares.items()}
    rewards = payments.build_rewards(rows["T"]) * (-1.0 if told.rewards_are_costs else 1.0) + 0.0
    tables = SparseTables(
        rows["T"], np.tile(rewards[:, None], (1, len(told.agents))), rows.get("O")
    )
    model = MarkovModel(
        told.agents,
        tuple(
            Labels(make_unique_labels(axis.names, "action", RESERVED_WORDS))
            for axis in actions.declarations
        ),
        tuple(Labels(axis.names) for axis in told.observations.declarations)
        if told.observations
        else (),
        states.names,
        told.initial_belief,
        tables,
        text.leading_comment,
    )
    return FileProblem(told.discount, model=model)
