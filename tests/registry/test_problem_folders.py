"""Tests of one road: a problem built in, as a user's folder, and as a single file."""

import json
import pickle
import shutil
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.game.hints.explanation import explain_action
from dmplay.game.hints.hint_provider import HintProvider
from dmplay.problems import bandit
from dmplay.registry import agents, module_loader
from dmplay.registry import problem_module_exports as module_exports
from dmplay.registry.problem_module_exports import get_command_line_name
from dmplay.registry.problem_name_kinds import rebase_name
from dmplay.validation import check_report
from dmplay.views.protocol import load_view_module
from tests.support.problem_cases import every_problem
from tests.support.programs import run_dmplay
from tests.support.user_problems import write_package_metadata

PARTS = ("rules", "agents", "view")
# exports that load and fail when they are used, with the row that is at fault and the message
BROKEN_EXPORTS = {
    "AGENTS": (
        """
from dmplay.agents.base import ReactivePolicy
class Eager(ReactivePolicy):
    def choose(self, memory, legal, u):
        return u[99]
AGENTS = {"eager": Eager}
""",
        "[99]",
        "IndexError",
    ),
    "VIEW": (
        "def goal_lines(view): return [7]\nclass VIEW: goal_lines = staticmethod(goal_lines)",
        "def goal_lines",
        "goal_lines: got [7], expected a list of texts",
    ),
    "SOLUTION": (
        "from dmplay import Solution\nSOLUTION = lambda problem: Solution('', '', [{'arm': []}])",
        "SOLUTION =",
        "SOLUTION: returned a table with [], expected texts, numbers, None, tuples",
    ),
    "FIGURES": (
        "from dmplay import Figure, Plot\nFIGURES = {'arms': Figure('', lambda s: Plot('', [7]))}",
        "FIGURES =",
        "FIGURES: arms: got a Plot that cannot be drawn",
    ),
    "PUZZLE_GAMES": (
        "from dmplay.tutor.puzzle_mining import GameSetup\n"
        "PUZZLE_GAMES = [GameSetup({'arm': 'ucb1'})]",
        "PUZZLE_GAMES =",
        "PUZZLE_GAMES: game 1: unknown seat 'arm'",
    ),
    "RULES_OF_THUMB": (
        "from dmplay import RuleOfThumb\n"
        "RULES_OF_THUMB = [RuleOfThumb('pull the last arm', lambda position: 3)]",
        "RULES_OF_THUMB =",
        "RULES_OF_THUMB: rule of thumb 'pull the last arm': got 3, expected None, the name",
    ),
    "REASONS": (
        "REASONS = lambda position, action: 'it pays'",
        "REASONS =",
        "a: got 'it pays', expected a list of texts",
    ),
    "PUZZLE_DAY": ("PUZZLE_DAY = 'monday'", "PUZZLE_DAY", "got 'monday', expected a whole number"),
    "QUANTITIES": (
        "from dmplay.tutor.quantity import Quantity\n"
        "QUANTITIES = {'arms': Quantity(lambda position: position.arms)}",
        "QUANTITIES =",
        "QUANTITIES: arms: ",
    ),
}


def copy_folder(package: ModuleType, folder: Path) -> str:
    """Copy the folder of a built-in problem and return its name as that of a user's folder."""
    (source,) = package.__path__
    shutil.copytree(source, folder, ignore=shutil.ignore_patterns("__*"))
    return f"{folder}/"


def write_single_file(package: ModuleType, file: Path) -> str:
    """Write the parts of a problem's folder into one file and return its name."""
    texts = [Path(*package.__path__, f"{part}.py").read_text() for part in PARTS]
    lines = [line for text in texts for line in text.splitlines() if not line.startswith("from .")]
    file.write_text("\n".join([*lines, "import sys", "VIEW = sys.modules[__name__]", ""]))
    return str(file)


def describe_answers(problem: Problem) -> dict[str, object]:
    """Return the answers about a problem that a user sees: solution, hints, agents and drawings."""
    hint_agent = agents.find_hint_provider(problem, AdviceQuestion(0, problem.horizon))
    assert hint_agent
    session = Session(problem, SeededUniforms(3), [None])
    solution, belief = dmplay.solve(problem), [0.1, 0.2, 0.3, 0.4]
    return {
        "solution": replace(solution, method=""),
        "values": [*solution.action_values(belief), *solution.bounds(belief)],
        "hints": (hint_agent.name, hint_agent.basis),
        "agents": [*agents.load_roster(problem).agents],
        "situation": load_view_module(problem).describe_situation(session.view(0)),
    }


@pytest.fixture(params=["folder", "file"])
def users_bandit(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """The name of the bandit as a user's folder, or as a user's file."""
    if request.param == "folder":
        return copy_folder(bandit, tmp_path / "bandit")
    return write_single_file(bandit, tmp_path / "arms.py")


def test_a_users_bandit_gives_the_same_answers_as_the_built_in_one(
    users_bandit: str, tmp_path: Path
) -> None:
    problem = dmplay.load_problem(users_bandit)
    assert describe_answers(problem) == describe_answers(dmplay.load_problem("bandit"))
    check = run_dmplay(tmp_path, "check", users_bandit)
    assert check.returncode == 0
    assert check.stdout == f"ok {users_bandit}: all invariants hold\n"


def test_equal_arms_are_all_best(users_bandit: str) -> None:
    for name in (users_bandit, "bandit"):
        problem = dmplay.load_problem(f"{name}:equal")
        assert "a b c" in str(dmplay.solve(problem).rows)


def test_an_import_error_in_any_file_of_a_folder_is_a_violation(tmp_path: Path) -> None:
    name = copy_folder(bandit, tmp_path / "bandit")
    for part in module_loader.PARTS:
        file = tmp_path / "bandit" / f"{part}.py"
        text = file.read_text() if file.exists() else ""
        file.write_text(f"import no_such_module\n{text}")
        (violation,) = list_violations(name)
        assert violation["where"].endswith(f"{part}.py:1")
        assert "no_such_module" in violation["what"]
        file.write_text(text)


def test_an_import_error_in_a_folder_names_the_users_files(tmp_path: Path) -> None:
    copy_folder(bandit, tmp_path / "arms")
    for imported, part in (("Nothing", "rules"), ("x", "nothing")):
        (tmp_path / "arms" / "agents.py").write_text(f"from .{part} import {imported}\n")
        for command in ("agents", "check"):
            result = run_dmplay(tmp_path, command, "./arms/")
            (line, *_) = (result.stdout + result.stderr).splitlines()
            assert f"'./arms/{part}.py'" in line
            assert "module_loader" not in line


def list_violations(name: str) -> list[dict[str, str]]:
    """Return the violations that `dmplay check --json` reports."""
    report = check_report.report_violations(name, {}, json=True)
    violations: list[dict[str, str]] = json.loads(str(report.text))["faults"]
    return violations


@pytest.mark.parametrize("export", BROKEN_EXPORTS)
def test_an_export_that_fails_when_it_is_used_is_a_violation(
    export: str, users_bandit: str
) -> None:
    source, faulty_row, message = BROKEN_EXPORTS[export]
    file = append_export(users_bandit, export, source)
    rows = file.read_text().splitlines()
    number = max(number for number, row in enumerate(rows, 1) if faulty_row in row)
    (violation,) = list_violations(users_bandit)
    line = " ".join(filter(None, violation.values()))
    assert f"{file.name}:{number}" in line
    assert message in line


def append_export(name: str, export: str, source: str) -> Path:
    """Append a definition to the file that defines an export, and return the file."""
    part = module_exports.PART_BY_NAME[export]
    file = Path(name, f"{part}.py") if name.endswith("/") else Path(name)
    text = file.read_text() if file.exists() else ""
    file.write_text(f"{text}\n{source}\n")
    return file


@pytest.mark.parametrize(
    "export", sorted(module_exports.PART_BY_NAME.keys() - {"VIEW", "PUZZLE_DAY"})
)
def test_an_invalid_export_is_a_violation_in_a_folder_and_in_a_file(
    export: str, users_bandit: str
) -> None:
    file = append_export(users_bandit, export, f"{export} = 7")
    line = len(file.read_text().splitlines())
    (violation,) = list_violations(users_bandit)
    assert f"{file.name}:{line}: {export}: got 7" in violation["what"]


def test_an_explanation_begins_with_the_reasons_of_a_users_problem(users_bandit: str) -> None:
    source = "REASONS = lambda position, action: [f'Arm {position.labels[action]} is free.']"
    append_export(users_bandit, "REASONS", source)
    session = Session(dmplay.load_problem(users_bandit), SeededUniforms(3))
    provider = HintProvider(session, AdviceQuestion(0, session.turn_limit))
    explanation = explain_action(provider, 1)
    assert explanation.sentences[0] == "Arm b is free."
    assert explanation.data["reasons"] == ["Arm b is free."]


def test_a_folder_is_loaded_again_after_a_change_of_any_file(tmp_path: Path) -> None:
    name = copy_folder(bandit, tmp_path / "bandit")
    before = dmplay.load_problem(name)
    assert type(dmplay.load_problem(name)) is type(before)
    file = tmp_path / "bandit" / "agents.py"
    file.write_text(file.read_text().replace('"ucb1"', '"bounds"'))
    problem = dmplay.load_problem(name)
    assert "bounds" in agents.load_roster(problem).agents
    assert pickle.loads(pickle.dumps(problem)) == problem


def test_a_folder_is_named_by_its_last_part(tmp_path: Path) -> None:
    problem = dmplay.load_problem(copy_folder(bandit, tmp_path / "three_arms"))
    assert get_command_line_name(problem) == "three-arms"
    assert rebase_name("a/bandit/:equal", Path(), Path("b")) == "../a/bandit/:equal"


def test_an_installed_package_may_be_a_folder_of_this_shape(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy_folder(bandit, tmp_path / "installed_arms")
    write_package_metadata(tmp_path, "arms", "arms = installed_arms\none = installed_arms:Bandit\n")
    monkeypatch.syspath_prepend(tmp_path)
    for name in ("arms", "one", "arms:equal", "installed_arms:Bandit"):
        assert "ucb1" in agents.load_roster(dmplay.load_problem(name)).agents


def test_an_agent_of_a_folder_is_named_by_its_file(tmp_path: Path) -> None:
    name = copy_folder(bandit, tmp_path / "bandit")
    agent = dmplay.load_agent(dmplay.load_problem(name), 0, f"{name}agents.py:Ucb1")
    assert type(agent) is agents.load_roster(dmplay.load_problem(name)).agents["ucb1"]


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("arms", "got a folder, expected ./arms/ for the problem in it"),
        ("./arms", "got a folder, expected ./arms/ for the problem in it"),
        ("./arms/:equl", "unknown problem or variant 'equl'; did you mean equal?"),
        ("./arms/:Bandot", "unknown problem or variant 'Bandot'; did you mean Bandit?"),
        ("./none/", "expected one with the file rules.py, which defines a problem"),
        ("./", "got a folder without the file rules.py, which defines a problem"),
    ],
)
def test_a_wrong_name_of_a_folder_is_one_clear_line(
    name: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    copy_folder(bandit, tmp_path / "arms")
    monkeypatch.chdir(tmp_path)
    result = run_dmplay(tmp_path, "info", name)
    assert result.returncode == 2
    assert message in result.stderr


@every_problem
def test_a_copy_of_a_built_in_folder_is_a_problem_of_the_user(name: str, tmp_path: Path) -> None:
    problem = dmplay.load_problem(name)
    package = __import__(type(problem).__module__.removesuffix(".rules"), fromlist=["rules"])
    variant = name.partition(":")[2]
    folder = copy_folder(package, tmp_path / "copy")
    copied = dmplay.load_problem(f"{folder}:{variant}" if variant else folder)
    expected, roster = agents.load_roster(problem), agents.load_roster(copied)
    assert [*roster.agents] == [*expected.agents]
    assert roster.hint_provider == expected.hint_provider
    assert copied.kind == problem.kind
