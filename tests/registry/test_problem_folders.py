"""Tests of one road: a problem built in, as a user's folder, and as a single file."""

import json
import pickle
import shutil
from pathlib import Path
from types import ModuleType

import pytest

import dmplay
from dmplay.agents.base import AdviceQuestion
from dmplay.core.problem import Problem
from dmplay.core.session import Session
from dmplay.core.uniforms import SeededUniforms
from dmplay.output import check_report
from dmplay.problems import bandit
from dmplay.registry import agents, module_loader
from dmplay.registry import problem_module_exports as module_exports
from dmplay.registry.problem_module_exports import find_folder_name
from dmplay.registry.problem_name_kinds import rebase_name
from dmplay.views.protocol import load_view_module
from tests.support.problem_cases import every_problem
from tests.support.programs import run_dmplay
from tests.support.user_problems import write_package_metadata

PARTS = ("rules", "agents", "view")


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
    return {
        "solution": dmplay.solve(problem)._replace(method=""),
        "hints": (hint_agent.name, hint_agent.values_name),
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
        assert "a b c" in str(dmplay.solve(problem))


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


def list_violations(name: str) -> list[dict[str, str]]:
    """Return the violations that `dmplay check --json` reports."""
    report = check_report.report_violations(name, {}, json=True)
    violations: list[dict[str, str]] = json.loads(str(report.text))["faults"]
    return violations


def test_an_unknown_player_of_a_puzzle_game_is_a_violation(users_bandit: str) -> None:
    is_folder = users_bandit.endswith("/")
    file = Path(users_bandit, "teach.py") if is_folder else Path(users_bandit)
    text = file.read_text() if file.exists() else ""
    setup = "GameSetup({'agent': 'ucb2'})"
    file.write_text(
        f"{text}\nfrom dmplay.tutor.puzzle_mining import GameSetup\nPUZZLE_GAMES = [{setup}]\n"
    )
    (violation,) = list_violations(users_bandit)
    assert f"{file.name}: PUZZLE_GAMES: unknown agent 'ucb2'" in violation["what"]


@pytest.mark.parametrize(
    "export", sorted(module_exports.PART_BY_NAME.keys() - {"VIEW", "PUZZLE_DAY"})
)
def test_an_invalid_export_is_a_violation_in_a_folder_and_in_a_file(
    export: str, users_bandit: str
) -> None:
    part = module_exports.PART_BY_NAME[export]
    file = Path(users_bandit, f"{part}.py") if users_bandit.endswith("/") else Path(users_bandit)
    text = file.read_text() if file.exists() else ""
    file.write_text(f"{text}\n{export} = 7\n")
    (violation,) = list_violations(users_bandit)
    assert f"{file.name}: {export}: got 7" in violation["what"]


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
    assert find_folder_name(problem) == "three-arms"
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
