"""Tests of key bindings: presets, user-defined keys, and keys that are refused."""

import pytest

import dmplay
from dmplay.errors import DmplayError
from dmplay.game.action_input import describe_number_range, find_action_by_key
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.key_bindings import resolve_key_maps
from dmplay.game.key_preferences import DEFAULT_KEY_PREFERENCES, KEY_PRESETS, KeyPreferences
from dmplay.game.seats import HUMAN
from dmplay.output.problem_and_agent_reports import load_problem_info
from dmplay.registry.builtin_names import problem_names
from dmplay.ui.screen.footer import format_footer
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.shell.commands import COMMANDS, run_line
from dmplay.views.protocol import load_view_module
from tests.support.screens import KEY_SEQUENCES, make_game, play_keys

KEY_PLAYED_PROBLEMS = [
    name for name in problem_names() if 1 <= dmplay.load_problem(name).action_counts[0] <= 10
]


def create_game_with_keys(problem: str, preferences: KeyPreferences, *seats: str) -> Game:
    """Return a game with these key preferences."""
    return make_game(problem, *seats, keys=preferences)


def list_legal_actions(game: Game) -> list[tuple[str, str, bool]]:
    return game.keyboard.list_actions_with_keys(game.view())


def bind_keys(family: str, **bindings: str) -> KeyPreferences:
    return KeyPreferences("", {family: ("dmplay.toml", bindings)})


@pytest.mark.parametrize("preset", KEY_PRESETS)
@pytest.mark.parametrize("name", KEY_PLAYED_PROBLEMS)
def test_every_preset_binds_every_action_and_no_key_twice(name: str, preset: str) -> None:
    problem = dmplay.load_problem(name)
    labels = problem.actions[0].labels
    default_bindings = resolve_key_maps(problem, DEFAULT_KEY_PREFERENCES).first_player_keys
    preset_bindings = resolve_key_maps(problem, KeyPreferences(preset)).first_player_keys
    # a key in both maps plays the same action
    assert {**preset_bindings, **default_bindings} == {**default_bindings, **preset_bindings}
    for action, label in enumerate(labels):
        assert find_action_by_key(problem, 0, str((action + 1) % 10), preset_bindings) == action
        for key, bound_label in preset_bindings.items():
            if bound_label == label and not key.isdigit():
                assert find_action_by_key(problem, 0, key, preset_bindings) == action


@pytest.mark.parametrize(
    ("name", "preset", "expected"),
    [
        ("hexworld", "", "l u y h b n"), ("hexworld", "vi", "l u y h b n"),
        ("hexworld", "left", "d e w a z x"),
        ("hexworld", "arrows", "right|up right|up left|left|down left|down right"),
        ("hexworld", "digits", "1 2 3 4 5 6"), ("2048", "vi", "h j l k"),
        ("2048", "left", "a s d w"), ("2048", "arrows", "left down right up"),
        ("cart-pole", "left", "a d"), ("mountain-car", "left", "a space d"),
        ("collision-avoidance", "vi", "j space k"),
        ("crying-baby", "left", "f s i"),  # initials of the actions
        ("rock-paper-scissors", "digits", "1 2 3"), ("machine-replacement", "arrows", "m e i r"),
    ],
)  # fmt: skip
def test_a_preset_determines_the_key_displayed_for_each_action(
    name: str, preset: str, expected: str
) -> None:
    displayed = [
        key for key, _, _ in list_legal_actions(create_game_with_keys(name, KeyPreferences(preset)))
    ]
    assert displayed == expected.split("|" if "|" in expected else " ")


@pytest.mark.parametrize("preset", ["left", "arrows", "digits"])
def test_board_key_row_help_and_info_show_the_active_keys(preset: str) -> None:
    hex_game = create_game_with_keys("hexworld", KeyPreferences(preset))
    east = {"left": "d", "arrows": "→", "digits": "1"}[preset]
    frames = play_keys(hex_game, "?").frames
    assert f"  @  │  {east}  │" in frames[0]
    assert f" {east}=e  " in frames[0].split("\n")[-1]
    assert f"actions: {east} = e,  " in frames[1]
    assert f"e {list_legal_actions(hex_game)[0][0]}" in run_line(GameController(hex_game), "keys")
    bindings = load_problem_info("hexworld", KeyPreferences(preset)).keys
    assert (
        next(key for key, label in bindings.items() if label == "e")
        == list_legal_actions(hex_game)[0][0]
    )
    assert f"{east}=" in format_footer(hex_game, Viewport(80, 24)).plain


def test_a_user_defined_key_works_and_is_shown_and_the_default_keys_still_work() -> None:
    game = create_game_with_keys("hexworld", bind_keys("hex", k="nw", h="e", j="w"))
    result = play_keys(game, "k", "h", "j", "n")
    names = [game.problem.format_action(0, turn.actions[0]) for turn in game.session.turns]
    assert names == ["nw", "e", "w", "se"]
    assert " h=e  u=ne (wall)  k=nw (wall)  j=w  b=sw  n=se" in result.frames[0].split("\n")[-1]


def test_keys_of_a_problem_override_keys_of_its_family() -> None:
    bindings = {"hex": ("a.toml", {"k": "nw"}), "predator-prey": ("b.toml", {"k": "ne"})}
    assert (
        resolve_key_maps(
            dmplay.load_problem("predator-prey"), KeyPreferences("", bindings)
        ).first_player_keys["k"]
        == "ne"
    )
    assert (
        resolve_key_maps(
            dmplay.load_problem("hexworld"), KeyPreferences("", bindings)
        ).first_player_keys["k"]
        == "nw"
    )
    feed = bind_keys("crying-baby", x="feed")
    assert (
        resolve_key_maps(dmplay.load_problem("multicaregiver-crying-baby"), feed).first_player_keys[
            "x"
        ]
        == "feed"
    )


def test_a_typed_word_is_an_action_name_before_it_is_a_key() -> None:
    game = create_game_with_keys("hexworld", KeyPreferences("left"))
    assert game.keyboard.parse_action(game.view(), "e") == game.problem.parse_action(0, "e")
    assert game.keyboard.find_key_action(0, "e") == (0, game.problem.parse_action(0, "ne"))


@pytest.mark.parametrize(
    ("labels", "expected"),
    [
        (("10", "20", "30"), "a whole number from 10 to 30 in steps of 10"),
        (("2", "3", "4"), "a whole number from 2 to 4"),
        (("1", "2", "5"), "1, 2, 5"),
        (("1", "2", "many"), "1, 2, many"),
        (("7",), "7"),
    ],
)
def test_numeric_action_labels_are_described_as_a_range_if_evenly_spaced(
    labels: tuple[str, ...], expected: str
) -> None:
    assert describe_number_range(labels) == expected


def test_legal_lists_no_keys_for_numeric_actions() -> None:
    controller = GameController(make_game("catch"))
    assert run_line(controller, "legal") == "legal: a whole number from 10 to 100 in steps of 10."
    assert run_line(controller, "keys").startswith(
        "keys: 10 to 100 in steps of 10; type a number, then Enter; the arrow keys change it. hint"
    )


def test_each_of_two_people_is_shown_the_keys_of_their_seat() -> None:
    for preset, action_keys in (("", ("l", "d")), ("left", ("d", "l"))):
        game = create_game_with_keys("predator-prey", KeyPreferences(preset), HUMAN, HUMAN)
        first, second = play_keys(game, action_keys[0]).frames
        for frame, key in zip((first, second), action_keys, strict=True):
            assert f" {key}=e " in frame.split("\n")[-1]
        assert f" {action_keys[1]}  " in second


def test_legal_omits_keys_that_are_names_of_other_actions() -> None:
    game = create_game_with_keys("hexworld", KeyPreferences("left"))
    assert run_line(GameController(game), "legal") == "legal: e (d), ne, nw, w (a), sw (z), se (x)."


def test_the_second_person_gets_the_keys_that_the_first_does_not_use() -> None:
    for preset, pressed_keys in (("", "hd"), ("left", "al")):
        game = create_game_with_keys("predator-prey", KeyPreferences(preset), HUMAN, HUMAN)
        play_keys(game, *pressed_keys)
        (turn,) = game.session.turns
        names = [game.problem.format_action(seat, turn.actions[seat]) for seat in range(2)]
        assert names == ["w", "e"]


@pytest.mark.parametrize(
    ("problem", "preferences", "message"),
    [
        ("hexworld", bind_keys("hex", h="e"),
         "dmplay.toml: keys.hex: h already plays w; set another key for w"),
        ("hexworld", bind_keys("hex", up="e"), "keys.hex: up is the first key of 'up"),
        ("hexworld", bind_keys("hex", k="north"),
         "keys.hex.k: unknown action 'north'; expected one of e"),
        ("hexworld", bind_keys("hex", K="e"), "keys.hex: 'K' is reserved for commands or numbers"),
        ("hexworld", bind_keys("hex", q="e"), "keys.hex: 'q' is reserved for commands or numbers"),
        ("hexworld", bind_keys("hex", **{"3": "e"}),
         "keys.hex: '3' is reserved for commands or numbers"),
        ("hexworld", bind_keys("hex", **{":": "e"}),
         "keys.hex: ':' is reserved for commands or numbers"),
        ("hexworld", bind_keys("hex", tab="e"),
         "keys.hex: 'tab' is reserved for commands or numbers"),
        ("hexworld", bind_keys("hex", lft="e"), "keys.hex: unknown key 'lft'; did you mean left"),
        ("simple-regulator", bind_keys("simple-regulator", x="1"),
         "actions are typed as numbers in this problem"),
        ("hexworld", KeyPreferences("emacs"),
         "--keys: got 'emacs', expected one of vi, left, arrows"),
    ],
)  # fmt: skip
def test_an_invalid_key_binding_is_reported_in_one_line(
    problem: str, preferences: KeyPreferences, message: str
) -> None:
    with pytest.raises(DmplayError) as error:
        resolve_key_maps(dmplay.load_problem(problem), preferences)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", problem_names())
def test_no_key_of_a_view_is_a_key_of_the_shell(name: str) -> None:
    view = load_view_module(dmplay.load_problem(name))
    view_keys = {*view.KEYS, *getattr(view, "LEFT", {}), *getattr(view, "NUDGES", {})}
    assert not view_keys & {command.key for command in COMMANDS}
    assert all(len(word) == 1 or word in KEY_SEQUENCES for key in view_keys for word in key.split())
