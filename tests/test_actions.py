"""Sets of actions: what is typed, named, played, drawn and told is said by the set itself."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dmplay.core import Interval, Labels
from dmplay.errors import BadParameter, IllegalAction, UnknownName

CARE = Labels(("feed", "sing", "no-advisory"))
PUSH = Interval(-10.0, 10.0)
U = np.array([0.0, 0.25, 0.5, 0.999])


@pytest.mark.parametrize(("text", "action"), [("feed", 0), (" SING ", 1), ("no_advisory", 2)])
def test_a_label_is_read_in_any_case_and_either_hyphen(text: str, action: int) -> None:
    assert CARE.parse_action(text) == action


def test_a_word_that_is_no_label_is_told_with_the_nearest() -> None:
    with pytest.raises(UnknownName, match=r"^unknown action 'feet'; did you mean feed\?$"):
        CARE.parse_action(" feet ")


@pytest.mark.parametrize(("text", "action"), [("-10", -10.0), ("1e-3", 0.001), ("-0", 0.0)])
def test_a_number_of_an_interval_is_read(text: str, action: float) -> None:
    assert repr(PUSH.parse_action(text)) == repr(action)


@pytest.mark.parametrize("text", ["10.1", "nan", "inf", "1_0", "٣", "left", ""])
def test_what_is_no_number_of_an_interval_is_refused(text: str) -> None:
    told = rf"^action: got '{text}', expected a number from -10 to 10$"
    with pytest.raises(BadParameter, match=told):
        PUSH.parse_action(text)


@given(st.lists(st.from_regex(r"[a-z0-9-]+", fullmatch=True), min_size=1, unique=True), st.data())
def test_a_label_is_read_as_it_is_named(names: list[str], data: st.DataObject) -> None:
    labels = Labels(names)
    action = data.draw(st.integers(0, len(names) - 1))
    assert labels.parse_action(labels.format_action(action)) == action


@given(st.integers(-10 * 10**9, 10 * 10**9))
def test_a_number_of_nine_decimals_is_read_as_a_transcript_has_it(billionths: int) -> None:
    action = billionths / 1e9
    assert PUSH.parse_action(str(PUSH.to_json_value(action))) == action
    assert PUSH.validate_action(action, "turn 1, agent") == action


@given(st.integers(-999_999_999, 999_999_999))
def test_a_number_below_1_is_read_as_it_is_named(billionths: int) -> None:
    action = billionths / 1e9
    assert PUSH.parse_action(PUSH.format_action(action)) == action


def test_an_action_is_named_as_people_and_as_transcripts_have_it() -> None:
    assert (CARE.format_action(1), CARE.to_json_value(1)) == ("sing", "sing")
    assert (PUSH.format_action(0.30000000001), PUSH.to_json_value(0.25)) == ("0.3", 0.25)


def test_an_action_is_checked_before_it_acts() -> None:
    assert CARE.validate_action(2.0, "turn 1, agent") == 2
    assert PUSH.validate_action(0.1234567891, "turn 1, agent") == 0.123456789
    with pytest.raises(IllegalAction, match=r"^turn 1, agent: got action 3, expected 0 to 2$"):
        CARE.validate_action(3, "turn 1, agent")
    told = r"^turn 1, agent: got 11, expected a number from -10 to 10$"
    with pytest.raises(IllegalAction, match=told):
        PUSH.validate_action(11.0, "turn 1, agent")


def test_every_legal_label_is_drawn_as_often() -> None:
    assert CARE.sample_actions(U, None).tolist() == [0, 0, 1, 2]
    legal = np.array([[True, False, True]] * 4)
    assert CARE.sample_actions(U, legal).tolist() == [0, 0, 2, 2]


def test_a_number_is_drawn_from_the_whole_interval() -> None:
    assert PUSH.sample_actions(U, None).tolist() == [-10.0, -5.0, 0.0, 9.98]


def test_a_grid_stands_for_a_set_in_a_search() -> None:
    assert CARE.candidate_actions().tolist() == [0, 1, 2]
    assert PUSH.candidate_actions().tolist() == [float(number) for number in range(-10, 11)]


def test_the_nearest_action_to_a_number_lies_in_the_interval() -> None:
    assert PUSH.clip_actions(np.array([-11.0, 0.12345678951, 99.0])).tolist() == [
        -10,
        0.12345679,
        10,
    ]


def test_a_set_is_told_in_words() -> None:
    assert CARE.describe_actions() == "feed, sing, no-advisory"
    assert CARE.describe_actions(np.array([True, False, True])) == "feed, no-advisory"
    assert CARE.describe_actions(np.zeros(3, bool)) == ""
    assert PUSH.describe_actions() == "a number from -10 to 10"


def test_only_labels_are_names_to_choose_from() -> None:
    assert CARE.labels == CARE
    assert PUSH.labels == ()


def test_of_a_very_long_name_the_beginning_is_told() -> None:
    with pytest.raises(UnknownName) as error:
        CARE.parse_action("5" * 100_000)
    assert str(error.value).startswith(f"unknown action '{'5' * 200}...'; expected one of feed")
