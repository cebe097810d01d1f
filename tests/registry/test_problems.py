"""Tests of problem names: variants, parameters, actions, seats, and suggestions for wrong names."""

from pathlib import Path
from typing import Any

import pytest

import dmplay
from dmplay.core.problem import find_seat
from dmplay.errors import BadParameter, DmplayError, UnknownName
from dmplay.registry import problems
from dmplay.registry.builtin_names import problem_names


def test_a_problem_is_loaded_with_variant_and_parameters() -> None:
    problem = dmplay.load_problem("hexworld:straight-line", slip=0.2)
    assert (problem.state_count, getattr(problem, "slip")) == (8, 0.2)  # noqa: B009 - any Problem
    assert dmplay.load_problem("Hex_World".replace("_", "")) == dmplay.load_problem(
        "hexworld:standard"
    )


def test_a_path_loads_a_problem_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "lamp.mdp").write_text(
        "discount: 0.9\nvalues: cost\nstates: 2\nactions: go\nT: *\nuniform\n"
    )
    monkeypatch.chdir(tmp_path)
    for path in (Path("lamp.mdp"), tmp_path / "lamp.mdp"):
        assert dmplay.load_problem(path).state_count == 2
        assert dmplay.play(path, turns=1).act("go")["observation"] in ("0", "1")
    with pytest.raises(DmplayError, match=r"\./hexworld"):
        dmplay.load_problem(Path("hexworld"))


def test_a_number_can_be_typed_in_any_common_notation() -> None:
    for text in (".5", "+0.5", "0.50", "5e-1", ".5E0", "00.5"):
        assert dmplay.load_problem("hexworld", slip=text) == dmplay.load_problem(
            "hexworld", slip=0.5
        )


def test_the_discount_can_be_set_by_the_symbol_that_screens_show() -> None:
    assert dmplay.load_problem("hexworld", gamma=0.5) == dmplay.load_problem(
        "hexworld", discount=0.5
    )
    problem = problems.with_parameters(dmplay.load_problem("catch"), {"gamma": ".25"})
    assert problem.discount == 0.25


def test_every_built_in_problem_loads_under_its_name() -> None:
    for name in problem_names():
        assert problems.resolve_problem(name, {}).name == name
        assert problems.load_variants(name)[""] == dmplay.load_problem(name)


@pytest.mark.parametrize(
    ("name", "parameters", "message"),
    [
        ("hexwrold", {}, "unknown problem 'hexwrold'; did you mean hexworld?"),
        ("zzz", {}, "unknown problem 'zzz'; expected one of "),
        ("hexworld:strait-line", {},
         "hexworld: unknown variant 'strait-line'; did you mean straig"),
        ("hexworld", {"slop": 1}, "unknown parameter 'slop'; did you mean slip"),
        ("hexworld", {"slip": 2}, "slip: got 2, expected a number at least 0 and at most 1"),
        ("hexworld", {"slip": "a lot"}, "slip: got 'a lot', expected a number, such as 0.3"),
        ("hexworld", {"slip": True}, "slip: got True, expected a number"),
        ("hexworld", {"slip": "NaN"}, "slip: got 'NaN', expected a number"),
        ("hexworld", {"slip": float("nan")}, "slip: got nan, expected a number"),
        ("hexworld", {"hexes": "7"}, "hexes: got '7', expected a list"),
        ("hexworld", {"hexes": "[]"}, "hexes: got [], expected hexes"),
        ("hexworld", {"hexes": "[[1, 2], [3]]"}, "hexes: got [3], expected a pair"),
        ("hexworld", {"hexes": "[[1, 2], [1, 2]]"},
         "hexes: got a hex twice, expected different hexes"),
        ("hexworld", {"rewards": "[[[50, 2], 1]]"},
         "rewards: got (50,2), expected a hex of the map"),
        ("hexworld", {"rewards": "[7]"}, "rewards: got "),
        ("2048", {"p_two": -0.1}, "p_two: got -0.1, expected a number"),
        ("./nothing.py:Game", {}, "no such file: ./nothing.py"),
        ("no.such.module:Game", {}, "no.such.module:Game: no module 'no'"),
        ("dmplay.core.problem:Problm", {},
         "dmplay.core.problem: unknown problem or variant 'Problm'; did you mean Problem"),
        ("dmplay.core.problem:Labels", {},
         "dmplay.core.problem:Labels: got Labels, expected a dmplay Problem"),
    ],
)  # fmt: skip
def test_a_wrong_name_or_value_is_one_clear_line(
    name: str, parameters: dict[str, object], message: str
) -> None:
    with pytest.raises(DmplayError) as caught:
        dmplay.load_problem(name, **parameters)
    assert str(caught.value).startswith(message)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("text", "action"),
    [("e", 0), ("E", 0), (" East ", 0), ("north_west", 2), ("SE", 5), ("southeast", 5)],
)
def test_an_action_is_read_by_name_and_alias(text: str, action: int) -> None:
    assert dmplay.load_problem("hexworld").parse_action(0, text) == action


def test_a_seat_is_found_by_name() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    assert find_seat(problem, "agent2") == 1
    with pytest.raises(UnknownName, match=r"unknown seat 'agent3'; did you mean agent"):
        find_seat(problem, "agent3")


def test_a_rollout_needs_a_policy_for_each_seat() -> None:
    problem = dmplay.load_problem("prisoners-dilemma")
    with pytest.raises(DmplayError, match=r"got 1 agent, expected one for each of agent1, "):
        dmplay.rollout(problem, [dmplay.load_agent(problem, 0, "grim")], episodes=1)
    grim: Any = dmplay.load_agent(problem, 0, "grim")
    with pytest.raises(DmplayError, match=r"got Grim\(.*\), expected one for each"):
        dmplay.rollout(problem, grim, episodes=1)
    with pytest.raises(DmplayError, match="episodes: got -3, expected 0 or more"):
        dmplay.rollout(problem, [grim, grim], episodes=-3)


def test_a_problem_without_a_finite_list_of_states_has_no_tables() -> None:
    with pytest.raises(BadParameter, match="Game2048 has no finite list of states"):
        dmplay.load_problem("2048").enumerate_states()


def test_the_error_for_an_unknown_file_type_lists_the_supported_ones(tmp_path: Path) -> None:
    file = tmp_path / "tiger.pomdpx"
    file.write_text("<pomdpx/>")
    with pytest.raises(
        BadParameter, match=r"another kind, expected a name that ends in \.py, \.pomdp, "
    ):
        dmplay.load_problem(str(file))
