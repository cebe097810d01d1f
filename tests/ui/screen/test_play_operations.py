"""Tests of action sets: parsing, formatting, validating and sampling actions."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmplay.core.spaces import Interval, Labels
from dmplay.errors import BadParameter, IllegalAction, UnknownName

CARE_ACTIONS = Labels(("feed", "sing", "no-advisory"))
FORCE_INTERVAL = Interval(-10.0, 10.0)
UNIFORMS = np.array([0.0, 0.25, 0.5, 0.999])


@pytest.mark.parametrize(("text", "action"), [("feed", 0), (" SING ", 1), ("no_advisory", 2)])
def test_a_label_is_parsed_in_any_case_with_hyphen_or_underscore(text: str, action: int) -> None:
    assert CARE_ACTIONS.parse_action(text) == action


def test_an_unknown_label_error_suggests_the_nearest_label() -> None:
    with pytest.raises(UnknownName, match=r"^unknown action 'feet'; did you mean feed\?$"):
        CARE_ACTIONS.parse_action(" feet ")


@pytest.mark.parametrize(("text", "action"), [("-10", -10.0), ("1e-3", 0.001), ("-0", 0.0)])
def test_a_number_in_the_interval_is_parsed(text: str, action: float) -> None:
    assert repr(FORCE_INTERVAL.parse_action(text)) == repr(action)


@pytest.mark.parametrize("text", ["10.1", "nan", "inf", "1_0", "٣", "left", ""])
def test_text_that_is_not_a_number_in_the_interval_is_refused(text: str) -> None:
    message = rf"^action: got '{text}', expected a number from -10 to 10$"
    with pytest.raises(BadParameter, match=message):
        FORCE_INTERVAL.parse_action(text)


@given(st.lists(st.from_regex(r"[a-z0-9-]+", fullmatch=True), min_size=1, unique=True), st.data())
def test_parsing_a_formatted_label_returns_the_same_action(
    names: list[str], data: st.DataObject
) -> None:
    labels = Labels(names)
    action = data.draw(st.integers(0, len(names) - 1))
    assert labels.parse_action(labels.format_action(action)) == action


@given(st.integers(-10 * 10**9, 10 * 10**9))
def test_a_number_of_nine_decimals_survives_the_transcript_format(billionths: int) -> None:
    action = billionths / 1e9
    assert FORCE_INTERVAL.parse_action(str(FORCE_INTERVAL.to_json_value(action))) == action
    assert FORCE_INTERVAL.validate_action(action, "turn 1, agent") == action


@given(st.integers(-999_999_999, 999_999_999))
def test_parsing_a_formatted_number_below_1_returns_the_same_number(billionths: int) -> None:
    action = billionths / 1e9
    assert FORCE_INTERVAL.parse_action(FORCE_INTERVAL.format_action(action)) == action


def test_an_action_is_formatted_for_people_and_for_transcripts() -> None:
    assert (CARE_ACTIONS.format_action(1), CARE_ACTIONS.to_json_value(1)) == ("sing", "sing")
    assert (FORCE_INTERVAL.format_action(0.30000000001), FORCE_INTERVAL.to_json_value(0.25)) == (
        "0.3",
        0.25,
    )


def test_an_action_is_validated_and_rounded() -> None:
    assert CARE_ACTIONS.validate_action(2.0, "turn 1, agent") == 2
    assert FORCE_INTERVAL.validate_action(0.1234567891, "turn 1, agent") == 0.123456789
    with pytest.raises(IllegalAction, match=r"^turn 1, agent: got action 3, expected 0 to 2$"):
        CARE_ACTIONS.validate_action(3, "turn 1, agent")
    message = r"^turn 1, agent: got 11, expected a number from -10 to 10$"
    with pytest.raises(IllegalAction, match=message):
        FORCE_INTERVAL.validate_action(11.0, "turn 1, agent")


def test_legal_labels_are_sampled_uniformly() -> None:
    assert CARE_ACTIONS.sample_actions(UNIFORMS, None).tolist() == [0, 0, 1, 2]
    legal = np.array([[True, False, True]] * 4)
    assert CARE_ACTIONS.sample_actions(UNIFORMS, legal).tolist() == [0, 0, 2, 2]


def test_numbers_are_sampled_from_the_whole_interval() -> None:
    assert FORCE_INTERVAL.sample_actions(UNIFORMS, None).tolist() == [-10.0, -5.0, 0.0, 9.98]


def test_candidate_actions_are_all_labels_or_a_grid_of_the_interval() -> None:
    assert CARE_ACTIONS.candidate_actions().tolist() == [0, 1, 2]
    assert FORCE_INTERVAL.candidate_actions().tolist() == [
        float(number) for number in range(-10, 11)
    ]


def test_numbers_are_clipped_and_rounded_to_actions_of_the_interval() -> None:
    assert FORCE_INTERVAL.clip_actions(np.array([-11.0, 0.12345678951, 99.0])).tolist() == [
        -10,
        0.12345679,
        10,
    ]


def test_an_action_set_is_described_in_words() -> None:
    assert CARE_ACTIONS.describe_actions() == "feed, sing, no-advisory"
    assert CARE_ACTIONS.describe_actions(np.array([True, False, True])) == "feed, no-advisory"
    assert CARE_ACTIONS.describe_actions(np.zeros(3, bool)) == ""
    assert FORCE_INTERVAL.describe_actions() == "a number from -10 to 10"


def test_only_label_sets_have_labels() -> None:
    assert CARE_ACTIONS.labels == CARE_ACTIONS
    assert FORCE_INTERVAL.labels == ()


def test_a_very_long_name_is_truncated_in_the_error() -> None:
    with pytest.raises(UnknownName) as error:
        CARE_ACTIONS.parse_action("5" * 100_000)
    assert str(error.value).startswith(f"unknown action '{'5' * 200}...'; expected one of feed")
