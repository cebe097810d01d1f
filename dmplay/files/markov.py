"""Reading files of Cassandra's format (`.pomdp`, `.mdp`) and of MADP's (`.dpomdp`)."""

from collections.abc import Sequence

import numpy as np

from dmplay.core import Labels
from dmplay.files.names import Axis, Field, plainly
from dmplay.files.payments import Payments
from dmplay.files.preamble import preamble
from dmplay.files.problem import FromFile, Model
from dmplay.files.shares import Shares
from dmplay.files.statements import Form, beginning, statements
from dmplay.files.words import Text
from dmplay.laws.sound import COMMANDS
from dmplay.tabular import Sparse

NOTHING = Axis("observation", ["0"])  # what is observed where states are seen


def read(path: str, raw: bytes, *, team: bool = False) -> FromFile:
    """The problem that a file of this content holds; of several agents if a team's."""
    text = Text.of(path, raw)
    end = beginning(text, team=team)
    told = preamble(text, end, team=team)
    actions, states = told.actions, told.states
    fields: dict[str, Sequence[Field]] = {"T": (actions, states, states)}
    if told.observations:
        fields["O"] = (actions, states, told.observations)
    fields["R"] = (actions, states, states, told.observations or NOTHING)
    forms = {kind: Form(kind, named, team=team) for kind, named in fields.items()}
    shares = {kind: Shares(form, told.start) for kind, form in forms.items() if kind != "R"}
    payments = Payments(forms["R"])
    for said in statements(text, forms):
        if said.form.kind == "R":
            payments.tell(said)
        else:
            shares[said.form.kind].tell(said)
    rows = {kind: one.rows(text) for kind, one in shares.items()}
    rewards = payments.rewards(rows["T"]) * (-1.0 if told.cost else 1.0) + 0.0
    tables = Sparse(rows["T"], np.tile(rewards[:, None], (1, len(told.agents))), rows.get("O"))
    model = Model(
        told.agents,
        tuple(Labels(plainly(axis.names, "action", COMMANDS)) for axis in actions.each),
        tuple(Labels(axis.names) for axis in told.observations.each) if told.observations else (),
        states.names,
        told.start,
        tables,
        text.about,
    )
    return FromFile(told.discount, model=model)
