"""Which key plays what: presets, a player's own keys, and what may not be bound."""

import pytest

import dmplay
from dmplay.errors import DmplayError
from dmplay.finding.names import problem_names
from dmplay.game.game import Game
from dmplay.game.seats import HUMAN
from dmplay.game.table import GameController
from dmplay.keys.keyboard import describe_number_range, find_action_by_key
from dmplay.keys.keymap import (
    DEFAULT_KEY_PREFERENCES,
    KEY_PRESETS,
    KeyPreferences,
    resolve_key_maps,
)
from dmplay.reports.problems import load_problem_info
from dmplay.screen.footer import format_footer
from dmplay.screen.shown import Viewport
from dmplay.views.style import load_view_module
from dmplay.words.commands import COMMANDS, run_line
from tests.support.screens import SEQUENCES, game, play

PRESSED = [
    name for name in problem_names() if 1 <= dmplay.load_problem(name).action_counts[0] <= 10
]


def held(problem: str, wanted: KeyPreferences, *seats: str) -> Game:
    """A game in which these keys play."""
    return game(problem, *seats, keys=wanted)


def legal(played: Game) -> list[tuple[str, str, bool]]:
    return played.keyboard.list_actions_with_keys(played.view())


def own(family: str, **bound: str) -> KeyPreferences:
    return KeyPreferences("", {family: ("dmplay.toml", bound)})


@pytest.mark.parametrize("preset", KEY_PRESETS)
@pytest.mark.parametrize("name", PRESSED)
def test_every_preset_plays_every_action_and_no_key_plays_two(name: str, preset: str) -> None:
    problem = dmplay.load_problem(name)
    labels = problem.actions[0].labels
    plain, preferred = (
        resolve_key_maps(problem, DEFAULT_KEY_PREFERENCES).first_player_keys,
        resolve_key_maps(problem, KeyPreferences(preset)).first_player_keys,
    )
    assert {**preferred, **plain} == {**plain, **preferred}  # what a key plays stays the same
    for number, label in enumerate(labels):
        assert find_action_by_key(problem, 0, str((number + 1) % 10), preferred) == number
        for key, bound in preferred.items():
            if bound == label and not key.isdigit():
                assert find_action_by_key(problem, 0, key, preferred) == number


@pytest.mark.parametrize(
    ("name", "preset", "first"),
    [
        ("hexworld", "", "l u y h b n"), ("hexworld", "vi", "l u y h b n"),
        ("hexworld", "left", "d e w a z x"),
        ("hexworld", "arrows", "right|up right|up left|left|down left|down right"),
        ("hexworld", "digits", "1 2 3 4 5 6"), ("2048", "vi", "h j l k"),
        ("2048", "left", "a s d w"), ("2048", "arrows", "left down right up"),
        ("cart-pole", "left", "a d"), ("mountain-car", "left", "a space d"),
        ("collision-avoidance", "vi", "j space k"),
        ("crying-baby", "left", "f s i"),  # their letters say what they do
        ("rock-paper-scissors", "digits", "1 2 3"), ("machine-replacement", "arrows", "m e i r"),
    ],
)  # fmt: skip
def test_a_preset_leads(name: str, preset: str, first: str) -> None:
    shown = [key for key, _, _ in legal(held(name, KeyPreferences(preset)))]
    assert shown == first.split("|" if "|" in first else " ")


@pytest.mark.parametrize("preset", ["left", "arrows", "digits"])
def test_the_board_the_key_row_help_and_info_show_the_keys_in_force(preset: str) -> None:
    hex_ = held("hexworld", KeyPreferences(preset))
    east = {"left": "d", "arrows": "→", "digits": "1"}[preset]
    shown = play(hex_, "?").frames
    assert f"  @  │  {east}  │" in shown[0]
    assert f" {east} e  " in shown[0].split("\n")[-1]
    assert f"actions: {east} e,  " in shown[1]
    assert f"e {legal(hex_)[0][0]}" in run_line(GameController(hex_), "keys")
    told = load_problem_info("hexworld", KeyPreferences(preset)).keys
    assert next(key for key, label in told.items() if label == "e") == legal(hex_)[0][0]
    assert f"{east} " in format_footer(hex_, Viewport(80, 24)).plain


def test_a_key_of_ones_own_plays_and_is_shown_and_the_others_go_on() -> None:
    made = held("hexworld", own("hex", k="nw", h="e", j="w"))
    shown = play(made, "k", "h", "j", "n")
    names = [made.problem.format_action(0, turn.actions[0]) for turn in made.session.turns]
    assert names == ["nw", "e", "w", "se"]
    assert " h e  u ne  k nw  j w  b sw  n se" in shown.frames[0].split("\n")[-1]


def test_keys_of_a_problem_come_before_those_of_its_family() -> None:
    both = {"hex": ("a.toml", {"k": "nw"}), "predator-prey": ("b.toml", {"k": "ne"})}
    assert (
        resolve_key_maps(
            dmplay.load_problem("predator-prey"), KeyPreferences("", both)
        ).first_player_keys["k"]
        == "ne"
    )
    assert (
        resolve_key_maps(
            dmplay.load_problem("hexworld"), KeyPreferences("", both)
        ).first_player_keys["k"]
        == "nw"
    )
    feed = own("crying-baby", x="feed")
    assert (
        resolve_key_maps(dmplay.load_problem("multicaregiver-crying-baby"), feed).first_player_keys[
            "x"
        ]
        == "feed"
    )


def test_typed_words_are_names_before_they_are_keys() -> None:
    made = held("hexworld", KeyPreferences("left"))
    assert made.keyboard.parse_action(made.view(), "e") == made.problem.parse_action(0, "e")
    assert made.keyboard.find_key_action(0, "e") == (0, made.problem.parse_action(0, "ne"))


@pytest.mark.parametrize(
    ("labels", "told"),
    [
        (("10", "20", "30"), "a whole number from 10 to 30 in steps of 10"),
        (("2", "3", "4"), "a whole number from 2 to 4"),
        (("1", "2", "5"), "1, 2, 5"),
        (("1", "2", "many"), "1, 2, many"),
        (("7",), "7"),
    ],
)
def test_numbers_that_are_actions_are_told_as_they_lie(labels: tuple[str, ...], told: str) -> None:
    assert describe_number_range(labels) == told


def test_numbers_have_no_keys_to_tell_of() -> None:
    throws = GameController(game("catch"))
    assert run_line(throws, "legal") == "legal: a whole number from 10 to 100 in steps of 10."
    assert run_line(throws, "keys").startswith(
        "keys: 10, 20, 30, 40, 50, 60, 70, 80, 90, 100. hint"
    )


def test_two_people_are_each_shown_the_keys_of_their_hand() -> None:
    for preset, hands_ in (("", ("l", "d")), ("left", ("d", "l"))):
        made = held("predator-prey", KeyPreferences(preset), HUMAN, HUMAN)
        first, second = play(made, hands_[0]).frames
        for shown, key in zip((first, second), hands_, strict=True):
            assert f" {key} e  " in shown.split("\n")[-1]
        assert f" {hands_[1]}  " in second


def test_words_are_told_no_key_that_is_another_actions_name() -> None:
    made = held("hexworld", KeyPreferences("left"))
    assert run_line(GameController(made), "legal") == "legal: e (d), ne, nw, w (a), sw (z), se (x)."


def test_with_the_left_hand_taken_a_second_person_has_the_right() -> None:
    for preset, keys_ in (("", "hd"), ("left", "al")):
        made = held("predator-prey", KeyPreferences(preset), HUMAN, HUMAN)
        play(made, *keys_)
        (turn,) = made.session.turns
        names = [made.problem.format_action(seat, turn.actions[seat]) for seat in range(2)]
        assert names == ["w", "e"]


@pytest.mark.parametrize(
    ("problem", "wanted", "message"),
    [
        ("hexworld", own("hex", h="e"), "dmplay.toml: keys.hex: h plays w already; give w a key"),
        ("hexworld", own("hex", up="e"), "keys.hex: up begins 'up"),
        (
            "hexworld",
            own("hex", k="north"),
            "keys.hex.k: unknown action 'north'; expected one of e",
        ),
        ("hexworld", own("hex", K="e"), "keys.hex: 'K' is the shell's or a number"),
        ("hexworld", own("hex", q="e"), "keys.hex: 'q' is the shell's or a number"),
        ("hexworld", own("hex", **{"3": "e"}), "keys.hex: '3' is the shell's or a number"),
        ("hexworld", own("hex", **{":": "e"}), "keys.hex: ':' is the shell's or a number"),
        ("hexworld", own("hex", tab="e"), "keys.hex: 'tab' is the shell's or a number"),
        ("hexworld", own("hex", lft="e"), "keys.hex: unknown key 'lft'; did you mean left"),
        ("simple-regulator", own("simple-regulator", x="1"), "a number is typed here"),
        (
            "hexworld",
            KeyPreferences("emacs"),
            "--keys: got 'emacs', expected one of vi, left, arrows",
        ),
    ],
)
def test_what_cannot_be_bound_is_refused_in_one_line(
    problem: str, wanted: KeyPreferences, message: str
) -> None:
    with pytest.raises(DmplayError) as error:
        resolve_key_maps(dmplay.load_problem(problem), wanted)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", problem_names())
def test_no_key_of_a_view_is_a_key_of_the_shell(name: str) -> None:
    style = load_view_module(dmplay.load_problem(name))
    bound = {*style.KEYS, *getattr(style, "LEFT", {}), *getattr(style, "NUDGES", {})}
    assert not bound & {command.key for command in COMMANDS}
    assert all(len(word) == 1 or word in SEQUENCES for key in bound for word in key.split())
