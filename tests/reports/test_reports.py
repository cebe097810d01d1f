"""The table of problems equals table F.1 of the book, but where a decision says otherwise."""

import json
import sys
from pathlib import Path

import pytest

import dmplay
from dmplay.cli.errands import execute_result
from dmplay.describe import problem_summary
from dmplay.errors import UnknownName
from dmplay.game.errand import Printout
from dmplay.game.request import GameRequest, ReplayRequest
from dmplay.game.start import start_new_game
from dmplay.reports import games
from dmplay.reports import problems as reports
from dmplay.reports.reviewing import review_transcript
from dmplay.reports.tables import format_table
from dmplay.terminal import TerminalOptions
from tests.files.sources import TIGER, kept

# Table F.1 as printed: agents, states, actions, observations, discount.
PRINTED = {
    "hexworld": ("-", "varies", "6", "-", "0.9"),
    "2048": ("-", "unbounded", "4", "-", "1"),
    "cart-pole": ("-", "in R^4", "2", "-", "1"),
    "mountain-car": ("-", "in R^2", "3", "-", "1"),
    "simple-regulator": ("-", "in R", "in R", "-", "1 or 0.9"),
    "collision-avoidance": ("-", "in R^3", "3", "-", "1"),
    "crying-baby": ("-", "2", "3", "2", "0.9"),
    "machine-replacement": ("-", "3", "4", "2", "1"),
    "catch": ("-", "4", "10", "2", "0.9"),
    "prisoners-dilemma": ("2", "-", "2 per agent", "-", "1"),
    "rock-paper-scissors": ("2", "-", "3 per agent", "-", "1"),
    "travelers-dilemma": ("2", "-", "99 per agent", "-", "1"),
    "predator-prey": ("varies", "varies", "6 per agent", "-", "0.9"),
    "multicaregiver-crying-baby": ("2", "2", "3 per agent", "2 per agent", "0.9"),
    "collaborative-predator-prey": ("varies", "varies", "6 per agent", "2 per agent", "0.9"),
}
EXCEPTIONS = {
    ("collision-avoidance", "states"): "in R^4",  # decision 6.9: four variables are listed
    ("simple-regulator", "discount"): "0.9",  # the variant `undiscounted` has the other
}
KINDS = {
    "MDP": {"hexworld", "2048", "cart-pole", "mountain-car", "simple-regulator"}
    | {"collision-avoidance"},
    "POMDP": {"crying-baby", "machine-replacement", "catch"},
    "simple game": {"prisoners-dilemma", "rock-paper-scissors", "travelers-dilemma"},
    "Markov game": {"predator-prey"},
    "POMG": {"multicaregiver-crying-baby"},
    "Dec-POMDP": {"collaborative-predator-prey"},
}


@pytest.mark.parametrize("name", PRINTED)
def test_a_line_of_the_list_is_the_printed_line(name: str) -> None:
    columns = ("agents", "states", "actions", "observations", "discount")
    expected = dict(zip(columns, PRINTED[name], strict=True))
    expected |= {column: told for (one, column), told in EXCEPTIONS.items() if one == name}
    assert problem_summary(dmplay.load_problem(name)) == expected


def test_the_list_has_every_problem_with_its_derived_kind() -> None:
    listed = {row["problem"]: row["kind"] for row in reports.problem_table_rows()}
    assert listed == {name: kind for kind, names in KINDS.items() for name in names}
    assert set(listed) == set(PRINTED)


@pytest.mark.parametrize(
    ("name", "actions"),
    [
        ("crying-baby", "feed, sing, ignore"),
        ("travelers-dilemma", "2, 3, 4, ..., 100"),
        ("simple-regulator", "a number from -10 to 10"),
    ],
)
def test_info_lists_the_actions_in_words(name: str, actions: str) -> None:
    assert f"\nactions       {actions}\n" in str(reports.load_problem_info(name))


@pytest.mark.parametrize("name", PRINTED)
def test_info_says_source_decisions_parameters_agents_and_keys(name: str) -> None:
    told = str(reports.load_problem_info(name))
    assert "Source: appendix F." in told
    assert "Decision" in told
    for word in ("parameters", "agents", "random", "keys", "variants"):
        assert word in told
    for one in reports.load_problem_info(name).parameters.values():
        assert one["meaning"]


def test_info_loads_no_package_of_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "axelrod", None)  # who loads it fails
    assert "axelrod" in reports.load_problem_info("prisoners-dilemma").players


def listed(kind: str, width: int) -> str:
    return str(reports.report_problem_table(kind, TerminalOptions(width=width)))


def test_a_list_without_room_says_what_it_leaves_out() -> None:
    assert "no room for discount; --width or --json has all" in listed("POMDP", 60)
    assert "no room" not in listed("POMDP", 100)
    rows = listed("", 12).replace(" ", "").split("\n")
    assert {"2048", "cart-pole", "travelers-di"} <= {*rows}


@pytest.mark.parametrize(
    ("env", "wish", "drawn"),
    [
        ({"CLICOLOR_FORCE": "1"}, "auto", True),
        ({"NO_COLOR": "1", "FORCE_COLOR": "1"}, "auto", False),
        ({"NO_COLOR": "1"}, "always", True),
        ({}, "auto", False),
    ],
)
def test_the_list_is_coloured_as_everything_is(
    env: dict[str, str],
    wish: str,
    drawn: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE"):
        monkeypatch.delenv(name, raising=False)
    for name, value in env.items():
        monkeypatch.setenv(name, value)
    wishes = TerminalOptions(color=wish, width=80)
    execute_result(Printout(reports.report_problem_table("MDP", wishes), wishes))
    assert ("\x1b[" in capsys.readouterr().out) == drawn


def test_a_kept_game_is_listed_by_the_names_that_find_its_problem_and_agents_from_here(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "a" / "state"))
    monkeypatch.chdir(tmp_path)
    kept(tmp_path, "tiger.pomdp", TIGER)
    start_new_game(GameRequest("./tiger.pomdp", seed=7)).finish()
    (told,) = json.loads(games.report_saved_games(json=True))
    assert (told["problem"], told["seats"]) == ("tiger.pomdp", {"agent": "human"})
    with pytest.raises(UnknownName, match="unknown kind 'gams'; did you mean games"):
        listed("gams", 80)


def test_a_review_says_that_nobody_played(tmp_path: Path) -> None:
    start_new_game(
        GameRequest("hexworld", seed=7, agent="random", turns=1, record_path=tmp_path / "g.dmt")
    ).finish()
    told = review_transcript(ReplayRequest(tmp_path / "g.dmt"))
    assert told == "review: no person plays in this game"


@pytest.mark.parametrize("width", [40, 50, 80, 100, 200])
def test_the_list_has_as_many_columns_as_there_is_room_for(width: int) -> None:
    known = reports.problem_table_rows()
    headings, *rows = listed("", width).partition("\nno room")[0].split("\n")
    many = {40: 2, 50: 3, 80: 6, 100: 7, 200: 7}[width]
    assert headings.split() == list(known[0])[:many]
    assert len(rows) == len(known)
    assert not any("…" in row or len(row) > width for row in rows)


def test_a_column_is_as_wide_as_what_a_terminal_shows_of_it() -> None:
    names = ("a\x1b[31mb", "\u540d\u524d", "e\u0301", "plain")
    told = format_table([{"file": name, "n": 1} for name in names]).split("\n")
    assert told == [
        "file        n", "a\\x1b[31mb  1", "\u540d\u524d        1", "e\u0301           1",
        "plain       1",
    ]  # fmt: skip
