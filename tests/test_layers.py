"""The house: a module imports only what stands above it, and the rules load no screen."""

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from tests.support.programs import loaded

HERE = Path(__file__).parent
HOUSE = HERE.parent / "dmplay"
FLOORS = (
    "errors", "places", "disk", "budget", "thought", "chance", "columns", "core", "dice",
    "describe", "hexes", "tiles", "matrix_game", "rows", "tabular", "laws", "belief", "displayed",
    "rules", "knowledge", "session", "signals", "blocks", "rollouts", "problems", "files",
    "guests", "solvers", "policies", "transcript", "bots", "finding", "hand", "terminal", "styles",
    "painting", "views", "loops", "gym", "zoo", "figures", "solutions", "advice", "keys",
    "game", "timeline", "conformance", "records", "measure", "words", "screen", "gallery",
    "reports", "prompt", "front", "mcp", "cli", "pytest_plugin", "__main__",
)  # fmt: skip
SCREENS = {"rich", "typer", "prompt_toolkit"}
ALLOWED = {  # what a floor may load beside the standard library and numpy
    "styles": {"rich"},
    "painting": {"rich"},
    "views": {"rich"},
    "figures": {"rich"},
    "game": {"rich"},
    "conformance": {"rich"},
    "words": {"prompt_toolkit"},
    "screen": {"rich", "prompt_toolkit"},
    "gallery": {"rich"},
    "reports": {"rich"},
    "prompt": {"prompt_toolkit"},
    "cli": {"typer"},
    "pytest_plugin": {"pytest"},
}
MODULES = sorted(HOUSE.rglob("*.py"))
# A statement has lines of its own, as ruff demands, so that not all else needs to be parsed.
IMPORT = re.compile(r"^ *((?:from [\w.]+ )?import (?:\([^)]*\)|[\w., *]+))", re.MULTILINE)


def floor(module: Path) -> str:
    return module.relative_to(HOUSE).parts[0].removesuffix(".py")


@cache
def imported(module: Path) -> set[str]:
    """Every module that a file imports, at the top or inside a function."""
    names = set()
    for found in IMPORT.findall(module.read_text(encoding="utf-8")):
        (node,) = ast.parse(found).body
        assert isinstance(node, ast.Import | ast.ImportFrom)
        of = f"{node.module or ''}." if isinstance(node, ast.ImportFrom) else ""
        names |= {f"{of}{alias.name}" for alias in node.names}
    return names


def edges() -> Iterator[tuple[Path, str]]:
    """Every module of the house, with each name that it imports."""
    return ((module, name) for module in MODULES for name in imported(module))


def test_a_module_imports_only_floors_above_its_own() -> None:
    for module, name in edges():
        own, parts = floor(module), name.split(".")
        if own == "__init__":
            continue
        if name.startswith("dmplay.") and parts[1] in FLOORS:
            assert FLOORS.index(parts[1]) <= FLOORS.index(own), f"{module} imports {name}"
        elif parts[0] in SCREENS | {"pytest"}:
            assert parts[0] in ALLOWED.get(own, set()), f"{module} imports {name}"


def test_what_a_room_names_with_an_underscore_is_imported_by_no_other() -> None:
    for module, name in edges():
        package, _, inside = name.partition(".")
        if package == "dmplay" and inside.split(".")[0] != floor(module):
            private = [part for part in inside.split(".") if re.match("_[a-z]", part)]
            assert not private, f"{module} imports {name}"


def test_no_modules_import_each_other_in_a_circle() -> None:
    paths = {
        ".".join(module.relative_to(HOUSE.parent).with_suffix("").parts): module
        for module in MODULES
    }
    known = {
        name: (_beginnings(imported(module)) & paths.keys()) - {name}
        for name, module in paths.items()
    }
    while leaves := {name for name, needs in known.items() if not needs}:
        known = {name: needs - leaves for name, needs in known.items() if name not in leaves}
    assert not known, f"a circle: {known}"


def _beginnings(names: set[str]) -> set[str]:
    """The modules that these imported names may be, or may be of."""
    return names | {name.rpartition(".")[0] for name in names}


def test_no_test_imports_a_test() -> None:
    wanted = re.compile(r"^ *(?:from|import) .*\btest_.*", re.MULTILINE)
    for module in HERE.rglob("*.py"):
        found = wanted.search(module.read_text(encoding="utf-8"))
        assert not found, f"{module.relative_to(HERE)}: {found}"


def test_every_module_has_a_floor() -> None:
    assert {floor(module) for module in MODULES} - {"__init__"} == set(FLOORS)


@pytest.mark.parametrize(
    ("words", "never"),
    [
        ("--version", {"typer", "numpy", "rich", "prompt_toolkit"}),
        ("--help; play --help", {"numpy", "rich", "prompt_toolkit"}),
        (
            "hexworld --agent optimal --quiet",
            {
                "prompt_toolkit",
                "multiprocessing",
                "importlib.metadata",
                "dmplay.files.markov",
                "dmplay.bots.bot",
                "dmplay.rollouts",
            },
        ),
    ],
)
def test_start_up_loads_no_more_than_it_needs(words: str, never: set[str]) -> None:
    code = (
        "import sys\nfrom dmplay.__main__ import main\n"
        f"for sys.argv[1:] in {[line.split() for line in words.split(';')]!r}:\n"
        "    try:\n        main()\n"
        "    except SystemExit as end:\n        assert not end.code, end.code\n"
    )
    assert not loaded(code, never)


def test_threads_of_arithmetic_that_wait_for_one_another_are_not_started() -> None:
    code = (
        "import os, sys\nfrom dmplay.__main__ import main\nsys.argv[1:] = ['--version']\n"
        "try:\n    main()\nexcept SystemExit:\n"
        "    print(os.environ['OPENBLAS_DEFAULT_NUM_THREADS'])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "1"


def test_first_frames_are_drawn_without_the_toolkit_and_without_agents() -> None:
    """Of the gallery, which needs the views of no problem but those it shows, and of a game."""
    never = {
        "prompt_toolkit", "dmplay.policies.game_2048", "dmplay.views.game_2048",
        "dmplay.policies.hexworld", "dmplay.solvers.alpha_vectors",
    }  # fmt: skip
    code = (
        "from pathlib import Path\n"
        "from dmplay.terminal import Terminal\n"
        "from dmplay.screen.shown import FrameState, Viewport\n"
        "from dmplay.gallery.gallery import Gallery\n"
        "from dmplay.gallery.offers import list_problem_entries\n"
        "from dmplay.screen import show\n"
        "way = Terminal(True, '', True, True, False)\n"
        "Gallery(list_problem_entries(), way, '20261122').compose_rows(Viewport(80, 24))\n"
        "from dmplay.screen.frame import compose_frame\n"
        "from dmplay.game.request import GameRequest\nfrom dmplay.game.start import start_new_game\n"
        "from dmplay.game import table\nfrom dmplay.screen import screen\n"
        "game = start_new_game(GameRequest('hexworld', seed=7, record_path=Path('/dev/null')))\n"
        "compose_frame(game, Viewport(80, 24), FrameState(), [])\n"
    )
    assert not loaded(code, never)


def test_the_stub_and_the_lazy_names_agree() -> None:
    import dmplay

    stub = ast.parse((HOUSE / "__init__.pyi").read_text())
    homes = {
        alias.name: (node.module or "").removeprefix("dmplay.")
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert homes == vars(dmplay)["_PUBLIC_MODULES"]
    assert {*homes} <= {*dir(dmplay)}
    for name in homes:
        assert getattr(dmplay, name)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = dmplay.nothing  # type: ignore[attr-defined]
