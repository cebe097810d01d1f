"""Tests of the problem list, which equals table F.1 of the book with documented exceptions."""

import json
import sys
from pathlib import Path

import pytest

import dmplay
from dmplay.cli.parsed_command_runner import execute_result
from dmplay.core.problem_summary import problem_summary
from dmplay.errors import UnknownName
from dmplay.evaluation.solutions.solution import Row
from dmplay.game.command_line_results import Printout
from dmplay.game.game_setup import start_new_game
from dmplay.game.launch_requests import GameRequest, ReplayRequest
from dmplay.output import problem_and_agent_reports as reports
from dmplay.output import problem_table, saved_games
from dmplay.output.review_report import report_review
from dmplay.output.tables import format_csv, format_csv_row, format_table
from dmplay.registry.builtin_names import name_to_stem, problem_names
from dmplay.terminal.capabilities import TerminalOptions
from tests.formats.sources import TIGER_TEXT, write_text_file

# The kind of each problem, then table F.1 as printed: agents, states, actions, observations,
# discount. A problem that is not from appendix F has no row here.
TABLE_F1 = {
    "hexworld": ("MDP", "-", "varies", "6", "-", "0.9"),
    "2048": ("MDP", "-", "unbounded", "4", "-", "1"),
    "cart-pole": ("MDP", "-", "in R^4", "2", "-", "1"),
    "mountain-car": ("MDP", "-", "in R^2", "3", "-", "1"),
    "simple-regulator": ("MDP", "-", "in R", "in R", "-", "1 or 0.9"),
    "collision-avoidance": ("MDP", "-", "in R^3", "3", "-", "1"),
    "crying-baby": ("POMDP", "-", "2", "3", "2", "0.9"),
    "machine-replacement": ("POMDP", "-", "3", "4", "2", "1"),
    "catch": ("POMDP", "-", "4", "10", "2", "0.9"),
    "prisoners-dilemma": ("simple game", "2", "-", "2 per agent", "-", "1"),
    "rock-paper-scissors": ("simple game", "2", "-", "3 per agent", "-", "1"),
    "travelers-dilemma": ("simple game", "2", "-", "99 per agent", "-", "1"),
    "predator-prey": ("Markov game", "varies", "varies", "6 per agent", "-", "0.9"),
    "multicaregiver-crying-baby": ("POMG", "2", "2", "3 per agent", "2 per agent", "0.9"),
    "collaborative-predator-prey": ("Dec-POMDP", "varies", "varies", "6 per agent", "2 per agent",
        "0.9"),
}  # fmt: skip
TABLE_F1_EXCEPTIONS = {
    ("collision-avoidance", "states"): "in R^4",  # decision 6.9: four variables are listed
    ("simple-regulator", "discount"): "0.9",  # the variant `undiscounted` has the other
}


@pytest.mark.parametrize("name", TABLE_F1)
def test_a_summary_equals_its_row_of_table_f1(name: str) -> None:
    columns = ("kind", "agents", "states", "actions", "observations", "discount")
    expected = dict(zip(columns, TABLE_F1[name], strict=True))
    expected |= {
        column: value for (problem, column), value in TABLE_F1_EXCEPTIONS.items() if problem == name
    }
    problem = dmplay.load_problem(name)
    assert {"kind": problem.kind, **problem_summary(problem)} == expected


def test_the_list_has_every_problem_with_its_derived_kind() -> None:
    kind_by_problem = {row["problem"]: row["kind"] for row in problem_table.problem_table_rows()}
    expected = {name: dmplay.load_problem(name).kind for name in problem_names()}
    assert kind_by_problem == expected


def test_table_f1_has_exactly_the_problems_whose_source_is_appendix_f() -> None:
    from_appendix = {
        name
        for name in problem_names()
        if "Source: appendix F." in str(reports.load_problem_info(name))
    }
    assert from_appendix == {*TABLE_F1}, (
        "edit TABLE_F1 in this file, or the line `Source:` in the docstring of the problem's module"
    )


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


@pytest.mark.parametrize("name", problem_names())
def test_info_contains_source_decisions_parameters_agents_and_keys(name: str) -> None:
    info = str(reports.load_problem_info(name))
    module = f"dmplay/problems/{name_to_stem(name)}/rules.py"
    assert "Source: " in info, f"the docstring of {module} names no `Source:`"
    assert "Decision" in info, f"the docstring of {module} lists no `Decisions:`"
    for word in ("parameters", "agents", "random", "keys", "variants"):
        assert word in info
    for parameter in reports.load_problem_info(name).parameters.values():
        assert parameter["meaning"]


def test_info_imports_no_optional_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "axelrod", None)  # an import would fail
    assert "axelrod" in reports.load_problem_info("prisoners-dilemma").players


def format_list(kind: str, width: int) -> str:
    return str(problem_table.report_problem_table(kind, TerminalOptions(width=width)))


def test_a_narrow_list_names_the_columns_it_omits() -> None:
    assert "columns left out: discount; --width N or --json shows" in format_list("POMDP", 60)
    assert "left out" not in format_list("POMDP", 100)
    rows = format_list("", 12).replace(" ", "").split("\n")
    assert {"2048", "cart-pole", "travelers-di"} <= {*rows}


@pytest.mark.parametrize(
    ("env", "color_option", "coloured"),
    [
        ({"CLICOLOR_FORCE": "1"}, "auto", True),
        ({"NO_COLOR": "1", "FORCE_COLOR": "1"}, "auto", False),
        ({"NO_COLOR": "1"}, "always", True),
        ({}, "auto", False),
    ],
)
def test_the_list_respects_the_colour_settings(
    env: dict[str, str],
    color_option: str,
    coloured: bool,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    for name in ("NO_COLOR", "FORCE_COLOR", "CLICOLOR_FORCE"):
        monkeypatch.delenv(name, raising=False)
    for name, value in env.items():
        monkeypatch.setenv(name, value)
    options = TerminalOptions(color=color_option, width=80)
    execute_result(Printout(problem_table.report_problem_table("MDP", options), options))
    assert ("\x1b[" in capsys.readouterr().out) == coloured


def test_a_saved_game_is_listed_with_names_relative_to_the_current_folder(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "a" / "state"))
    monkeypatch.chdir(tmp_path)
    write_text_file(tmp_path, "tiger.pomdp", TIGER_TEXT)
    start_new_game(GameRequest("./tiger.pomdp", seed=7)).finish()
    (row,) = json.loads(saved_games.report_saved_games(all_games=True, json=True))["games"]
    assert (row["problem"], row["seats"]) == ("tiger.pomdp", {"agent": "human"})
    with pytest.raises(UnknownName, match="unknown kind 'gams'; did you mean games"):
        format_list("gams", 80)


def test_a_review_of_agents_has_all_seats_or_the_named_one(tmp_path: Path) -> None:
    path = tmp_path / "g.dmt"
    request = GameRequest(
        "prisoners-dilemma", seed=7, agent="random", other_agent="tit-for-tat", turns=4,
        record_path=path,
    )  # fmt: skip
    game = start_new_game(request)
    list(game.iter_agent_turns())
    game.finish()
    text = report_review(ReplayRequest(path))
    assert [line.partition(":")[0] for line in text.splitlines() if line.startswith("review")] == [
        "review of agent1",
        "review of agent2",
    ]
    assert {choice.seat for choice in dmplay.review(path, seat="agent2")} == {"agent2"}
    with pytest.raises(UnknownName, match="unknown seat 'agent3'"):
        report_review(ReplayRequest(path), seat="agent3")


@pytest.mark.parametrize("width", [40, 50, 80, 100, 200])
def test_the_list_has_the_columns_that_fit_the_width(width: int) -> None:
    facts = problem_table.problem_table_rows()
    headings, *rows = format_list("", width).partition("\ncolumns left out")[0].split("\n")
    column_count = {40: 2, 50: 3, 80: 6, 100: 7, 200: 7}[width]
    assert headings.split() == list(facts[0])[:column_count]
    assert len(rows) == len(facts)
    assert not any("…" in row or len(row) > width for row in rows)


def test_a_column_is_as_wide_as_its_displayed_text() -> None:
    names = ("a\x1b[31mb", "\u540d\u524d", "e\u0301", "plain")
    lines = format_table([{"file": name, "n": 1} for name in names]).split("\n")
    assert lines == [
        "file        n", "a\\x1b[31mb  1", "\u540d\u524d        1", "e\u0301           1",
        "plain       1",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("x;=1+1", '"x;\'=1+1"'),
        ("x; =1+1;@y", "\"x; '=1+1;'@y\""),
        ("x\t+SUM(A1)", '"x\t\'+SUM(A1)"'),
        ("x\n=1+1", '"x\n\'=1+1"'),
        ("=a;-b", "\"'=a;'-b\""),
        ("x;＝1", '"x;\'＝1"'),
        ("x;-0.5;+2", '"x;-0.5;+2"'),
        ("x;y", '"x;y"'),
        ("x, =1", '"x, =1"'),
    ],
)
def test_a_cell_that_is_split_at_semicolons_has_no_formula(text: str, cell: str) -> None:
    assert format_csv_row([1, text, "z"]) == f"1,{cell},z\n"


def test_numbers_in_csv_are_never_prefixed_and_formulas_always_are() -> None:
    row: Row = {"=agent": "=cmd|' /C calc'!A1", "return": -1.5, "turns": -3, "state": "-0.5"}
    row |= {"action": "-1e-9", "gap": "-", "seat": "\uff1d1+1", "mean": float("nan"), "no": None}
    head, cells = format_csv([row]).split("\n")
    assert head == "'=agent,return,turns,state,action,gap,seat,mean,no"
    assert cells == "'=cmd|' /C calc'!A1,-1.5,-3,-0.5,-1e-9,'-,'\uff1d1+1,,"
    text_that_looks_like_numbers: Row = {
        "a": "-1+1",
        "b": "+-1",
        "c": "-1 ",
        "d": "-inf",
        "e": "-1_0",
    }
    assert (
        format_csv([text_that_looks_like_numbers]).split("\n")[1] == "'-1+1,'+-1,'-1 ,'-inf,'-1_0"
    )
