"""Tests of the reasons for actions in the words of their problems."""

import pytest

from dmplay.game.hints.explanation import explain_action
from tests.game.hints.reason_claims import CLAIMS, check_sentence, iter_positions


@pytest.mark.parametrize("name", CLAIMS)
def test_each_claim_of_each_reason_is_true_in_the_dynamics(name: str) -> None:
    for provider in iter_positions(name, 2):
        for action in (None, *provider.position.legal_actions):
            explanation = explain_action(provider, action)
            reasons = explanation.data["reasons"]
            assert isinstance(reasons, list)
            assert explanation.sentences[: len(reasons)] == tuple(reasons)
            explained = provider.position.labels.index(str(explanation.data["action"]))
            for sentence in reasons:
                assert check_sentence(provider.session, explained, sentence, CLAIMS[name])
