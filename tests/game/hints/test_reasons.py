"""Tests of the reasons for actions in the words of their problems."""

import pytest

from dmplay.agents.base import AdviceQuestion
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.hints.explanation import MAX_SENTENCE_WORDS, explain_action
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.registry.problems import load_problem
from tests.game.hints.reason_claims import CLAIMS, check_sentence, iter_positions


@pytest.mark.parametrize("name", CLAIMS)
def test_each_claim_of_each_reason_is_true_in_the_dynamics(name: str) -> None:
    for provider in iter_positions(name, 2):
        for action in (None, *provider.position.legal_actions):
            explanation = explain_action(provider, action)
            reasons = explanation.data["reasons"]
            assert isinstance(reasons, list)
            assert explanation.sentences[: len(reasons)] == tuple(reasons)
            if str(explanation.data.get("accuracy")).endswith("bounds"):
                assert not any("best action" in text for text in explanation.sentences)
            explained = provider.position.labels.index(str(explanation.data["action"]))
            for sentence in reasons:
                assert len(sentence.split()) <= MAX_SENTENCE_WORDS
                assert check_sentence(provider.session, explained, sentence, CLAIMS[name])


def test_no_reason_warns_of_a_collision_after_the_end_of_the_game() -> None:
    problem = load_problem("collision-avoidance")
    session = Session(problem, SeededUniforms(3), turn_limit=5)
    explanation = explain_action(HintProvider(session, AdviceQuestion.of_session(session, 0)))
    assert "The game ends before the pass, so it has no collision." in explanation.sentences
    assert not any("probability" in sentence for sentence in explanation.sentences)
