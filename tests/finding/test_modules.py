"""What a module of somebody's own brings is found under every name that it can be given."""

import pickle
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest
from rich.text import Text

import dmplay
from dmplay.core import Problem
from dmplay.errors import BadParameter, DmplayError
from dmplay.finding import agents, problems
from dmplay.game.account import render_transcript_frame
from dmplay.game.game import Game
from dmplay.game.table import GameController
from dmplay.keys.keymap import DEFAULT_KEY_PREFERENCES, resolve_key_maps
from dmplay.reports import problems as reports
from dmplay.transcript.format import collect_turn_facts
from dmplay.views.style import DrawOptions, fit_board, load_view_module
from dmplay.words.commands import run_line
from dmplay.words.completion import lists
from tests.support.blocks import TIGER
from tests.support.brought import WALK, installed
from tests.support.programs import run
from tests.support.screens import game

VIEW = """\
from rich.text import Text

KEYS = {"g": "listen"}


def iter_boards(view, options):
    yield Text("a door to the left, a door to the right")


def goal_lines(view):
    return ["live"]
"""
SECRET = """
    def draw_state(self, s):
        return "\\x1b[31mtiger\\x1b[0m\\tbehind " + "left right".split()[int(s)] + "\\x07"
"""
MORE = '''

@dataclass(frozen=True)
class Long(Walk):
    """A longer walk."""

    slip = 0.3


VARIANTS = {"icy": Walk(slip=0.5)}
'''


@pytest.fixture(autouse=True)
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("sys.dont_write_bytecode", True)
    Path("walk.py").write_text(WALK)


def values(problem: Problem) -> Mapping[str, object]:
    return problems.parameter_values(problem)


def test_a_problem_is_found_by_file_by_class_and_by_variant() -> None:
    assert values(dmplay.load_problem("./walk.py")) == {"discount": 0.9, "slip": 0.1}
    assert values(dmplay.load_problem("./walk.py:Walk", slip=0.2))["slip"] == 0.2
    Path("walks.py").write_text(WALK + MORE)
    assert values(dmplay.load_problem("./walks.py:Long")) == {"discount": 0.9, "slip": 0.3}
    assert values(dmplay.load_problem("./walks.py:icy"))["slip"] == 0.5
    assert [*problems.load_variants("./walks.py:icy")] == ["icy"]
    with pytest.raises(BadParameter, match=r"got several problems, expected one, as ./walks.py:Wa"):
        dmplay.load_problem("./walks.py")
    with pytest.raises(DmplayError, match=r"./walks.py: unknown attribute 'Lon'; did you mean Lo"):
        dmplay.load_problem("./walks.py:Lon")


def test_a_module_in_the_current_folder_needs_no_dot() -> None:
    Path("a_walk_here.py").write_text(WALK)
    assert values(dmplay.load_problem("a_walk_here:Walk"))["slip"] == 0.1
    with pytest.raises(DmplayError, match="unknown problem 'a_wlak_here'"):
        dmplay.load_problem("a_wlak_here:Walk")


def test_a_file_that_changed_is_read_again() -> None:
    assert values(dmplay.load_problem("./walk.py"))["slip"] == 0.1
    Path("walk.py").write_text(WALK.replace("slip: float = 0.1", "slip: float = 0.125"))
    assert values(dmplay.load_problem("./walk.py"))["slip"] == 0.125


def test_what_a_file_defines_can_be_pickled() -> None:
    problem = dmplay.load_problem("./walk.py", slip=0.2)
    agent = dmplay.load_agent(problem, 0, "patient:edge=3")
    for made in (problem, agent):
        assert pickle.loads(pickle.dumps(made)) == made


@pytest.mark.slow
def test_a_worker_that_begins_anew_unpickles_what_a_file_defines(tmp_path: Path) -> None:
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    problem = dmplay.load_problem("./walk.py")
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        assert pool.submit(type(problem).format_state, problem, np.array(3)).result() == "at 3"


def test_plain_attributes_and_fields_without_a_decorator_are_parameters() -> None:
    plain = TIGER.replace(
        "    state_names, horizon",
        "    discount = 0.95\n    hush: int = 3\n    state_names, horizon",
    )
    Path("plain.py").write_text(plain)
    assert values(dmplay.load_problem("./plain.py")) == {"discount": 0.95, "hush": 3}
    assert values(dmplay.load_problem("./plain.py", discount=0.5, hush="4"))["hush"] == 4


def test_agents_of_a_module_sit_advise_and_have_parameters() -> None:
    problem = dmplay.load_problem("./walk.py")
    assert [*agents.load_roster(problem).agents] == [
        "patient",
        "optimal",
        "plan",
        "random",
        "search",
    ]
    assert agents.load_roster(problem).hint_provider == "patient"
    assert dmplay.load_agent(problem, 0, "patient:edge=3").edge == 3  # type: ignore[attr-defined]
    found = dmplay.load_agent(problem, 0, "./walk.py:Patient:edge=4")
    assert found.edge == 4  # type: ignore[attr-defined]
    with pytest.raises(DmplayError, match="unknown parameter 'egde'; did you mean edge"):
        dmplay.load_agent(problem, 0, "patient:egde=3")


def test_keys_of_a_module_play(tmp_path: Path) -> None:
    assert dict(
        resolve_key_maps(
            dmplay.load_problem("./walk.py"), DEFAULT_KEY_PREFERENCES
        ).first_player_keys
    ) == {"l": "right"}
    played = game("./walk.py")
    assert played.keyboard.find_key_action(0, "l") == (0, 1)


def told(played: Game, width: int = 80) -> str:
    return played.draw_board(DrawOptions(width, 24)).plain


def test_a_picture_is_the_board_and_told_in_words_and_frames() -> None:
    played = game("./walk.py")
    assert told(played).startswith("@\n\n[1 left]\n2 ")
    played.choose(1)
    assert run_line(GameController(played), "look").startswith(".@\nat 1.")
    assert render_transcript_frame(played.session).startswith(".@\n")


def test_a_picture_of_a_hidden_state_is_drawn_only_once_it_is_told() -> None:
    Path("secret.py").write_text(TIGER + SECRET)
    played = game("./secret.py", turns=2)
    for _ in range(2):
        assert "tiger" not in told(played) + render_transcript_frame(played.session)
        assert not played.picture_rows()
        played.choose(0)
    (row,) = played.picture_rows()
    assert row in ("tiger   behind left", "tiger   behind right")
    assert row in told(played)


def test_a_look_of_a_module_is_drawn_and_the_rest_is_the_generic_one() -> None:
    Path("doors_view.py").write_text(VIEW)
    Path("doors.py").write_text(f"import doors_view as VIEW\n{TIGER}")
    played = game("./doors.py")
    assert told(played) == "a door to the left, a door to the right"
    assert played.view_module.goal_lines(played.view()) == ["live"]
    assert played.narrator.describe_situation(played.snapshot()).startswith("nothing yet.")
    assert played.keyboard.find_key_action(0, "g") == (0, 0)


def test_a_picture_is_as_it_is_drawn_without_what_moves_or_leads_elsewhere() -> None:
    Path("coloured.py").write_text(
        WALK.replace(
            'return "." * int(s) + "@"', "return Text.from_ansi('\\x1b[41m@\\x1b[0m')"
        ).replace("import numpy as np\n", "import numpy as np\nfrom rich.text import Text\n")
    )
    problem = dmplay.load_problem("./coloured.py")
    drawn = fit_board(load_view_module(problem), game("./coloured.py").view(0), DrawOptions())
    assert isinstance(drawn, Text)
    assert drawn.plain.startswith("@")
    assert str(drawn.spans[0].style) == "on color(1)"


@pytest.mark.slow
def test_a_file_imports_what_is_beside_it_under_the_program_too(tmp_path: Path) -> None:
    folder = tmp_path / "elsewhere"
    folder.mkdir()
    (folder / "doors_view.py").write_text(VIEW)
    (folder / "doors.py").write_text(f"import doors_view as VIEW\n{TIGER}")
    done = run(tmp_path, "elsewhere/doors.py", "--agent", "random", "--seed", "3", "-o", "g.dmt")
    assert done.returncode == 0, done.stderr
    assert run(folder, "verify", "../g.dmt", "--trust").returncode == 0


def test_installed_problems_are_listed_completed_and_played(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = "stroll = stroll_module\nlong = stroll_module:Long\nlame = lame_module\n"
    installed(tmp_path, "walks", points)
    (tmp_path / "stroll_module.py").write_text(WALK + MORE)
    (tmp_path / "lame_module.py").write_text("raise ValueError('no leg')\n")
    monkeypatch.syspath_prepend(tmp_path)
    assert values(dmplay.load_problem("long"))["slip"] == 0.3
    assert values(dmplay.load_problem("stroll:icy"))["slip"] == 0.5
    assert [row["problem"] for row in reports.problem_table_rows()][-1] == "long"
    stroll, lame = sorted(reports.format_load_failures().split("\n"), reverse=True)
    assert stroll.endswith("got several problems, expected one, as stroll:Walk or stroll:Long")
    assert lame == "lame: ./lame_module.py:1: ValueError: no leg"
    assert {"stroll", "long", "lame"} <= {*lists.complete_problems()}


def test_what_is_made_of_arrays_has_as_many_states_as_names() -> None:
    Path("tiger.py").write_text(TIGER)
    assert reports.load_problem_info("./tiger.py").states == "2"
    assert reports.load_problem_info("hexworld").states == "varies"
    assert "\n\n\n" not in str(reports.load_problem_info("./tiger.py"))  # it tells nothing


CALLED = """
    def action_labels(self, s):
        return (Labels((f"down-to-{int(s) - 1}", f"up-to-{int(s) + 1}")),)

    def format_state"""


def test_what_actions_are_called_may_depend_on_the_state() -> None:
    Path("steps.py").write_text(WALK.replace("\n    def format_state", CALLED))
    assert not dmplay.check(dmplay.load_problem("./steps.py"))
    played = game("./steps.py")
    table = GameController(played)
    assert run_line(table, "up-to-1") == "turn 1. at 1. chose up-to-1. reward 0. score 0."
    assert run_line(table, "right") == "turn 2. at 2. chose up-to-2. reward 0. score 0."
    assert run_line(table, "legal") == "legal: down-to-1 (1), up-to-3 (l)."
    assert run_line(table, "hint") == "hint (patient): up-to-3"
    assert "1 down-to-1\n2 up-to-3" in told(played)
    with pytest.raises(DmplayError, match="unknown action 'up-to-4'; did you mean up-to-3"):
        run_line(table, "up-to-4")
    played.undo(2)
    assert played.view().last_action_label == ""
    assert run_line(table, "up-to-1").endswith("chose up-to-1. reward 0. score 0.")
    assert collect_turn_facts(played.session)["actions"] == {"agent": "right"}
