"""Tests of the package's layers: allowed imports, no cycles, and the modules loaded at start."""

import ast
import os
import re
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from dmplay.registry.builtin_names import name_to_stem, problem_names
from tests.support.programs import list_loaded_modules

TESTS_FOLDER = Path(__file__).parent
PACKAGE_FOLDER = TESTS_FOLDER.parent / "dmplay"
# From the lowest to the highest: a folder imports only itself and the folders before it.
LAYERS = (
    "errors", "guide", "core", "terminal", "formats", "simulation", "algorithms", "solvers",
    "agents", "draw", "transcript", "external", "registry", "views", "gym", "zoo", "game",
    "evaluation", "training", "tutor", "ui", "output", "plots", "validation", "problems",
    "servers", "cli", "pytest_plugin", "__main__",
)  # fmt: skip
UI_LIBRARIES = {"rich", "typer", "prompt_toolkit"}
ALLOWED_LIBRARIES = {  # beyond the standard library and NumPy
    "terminal": {"rich"},
    "draw": {"rich"},
    "views": {"rich"},
    "problems": {"rich"},
    "game": {"rich"},
    "validation": {"rich"},
    "ui": {"rich", "prompt_toolkit"},
    "output": {"rich"},
    "plots": {"rich"},
    "cli": {"typer"},
    "pytest_plugin": {"pytest"},
}
MODULE_PATHS = sorted(PACKAGE_FOLDER.rglob("*.py"))
# Ruff puts each import statement on its own lines, so a pattern finds them without parsing files.
IMPORT_PATTERN = re.compile(r"^ *((?:from [\w.]+ )?import (?:\([^)]*\)|[\w., *]+))", re.MULTILINE)
FOLDERS_OF_SOLVERS = {"mdp", "pomdp", "decpomdp", "games", "search"}
DOTTED_NAME_PATTERN = re.compile(r"(?<![\w./])dmplay\.\w+(?:\.\w+)*")


def layer_of(module: Path) -> str:
    return module.relative_to(PACKAGE_FOLDER).parts[0].removesuffix(".py")


@cache
def imported_names(module: Path) -> set[str]:
    """Return the names that a file imports, at the top or inside a function."""
    names = set()
    for statement in IMPORT_PATTERN.findall(module.read_text(encoding="utf-8")):
        (node,) = ast.parse(statement).body
        assert isinstance(node, ast.Import | ast.ImportFrom)
        prefix = f"{node.module or ''}." if isinstance(node, ast.ImportFrom) else ""
        if isinstance(node, ast.ImportFrom) and node.level:
            folder = module.relative_to(PACKAGE_FOLDER.parent).parts[: -node.level]
            prefix = f"{'.'.join(folder)}.{prefix}".rstrip(".") + "."
        names |= {f"{prefix}{alias.name}" for alias in node.names}
    return names


@cache
def dynamic_imports(module: Path) -> set[str]:
    """Return the modules of the package that the strings of a file name, as for `import_module`."""
    strings = (
        node.value
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8")))
        if isinstance(node, ast.Constant) and isinstance(node.value, str)
    )
    return {name for text in strings for name in DOTTED_NAME_PATTERN.findall(text)}


def iter_imports() -> Iterator[tuple[Path, str]]:
    """Iterate over the imports of the package, as pairs of a module and a name."""
    return (
        (module, name)
        for module in MODULE_PATHS
        for name in imported_names(module) | dynamic_imports(module)
    )


def test_a_module_imports_only_its_own_and_earlier_layers() -> None:
    for module, name in iter_imports():
        layer, parts = layer_of(module), name.split(".")
        if layer == "__init__":
            continue
        if name.startswith("dmplay.") and parts[1] in LAYERS:
            is_earlier = LAYERS.index(parts[1]) <= LAYERS.index(layer)
            is_group = name == "dmplay.problems"  # of entry points
            assert is_earlier or is_group, f"{module} imports {name}"
        elif parts[0] in UI_LIBRARIES | {"pytest"}:
            assert parts[0] in ALLOWED_LIBRARIES.get(layer, set()), f"{module} imports {name}"


def test_no_module_outside_the_problems_knows_one_by_name() -> None:
    """Docstrings may name problems, and so may examples in longer texts."""
    names = {*problem_names(), *map(name_to_stem, problem_names())}
    for module in MODULE_PATHS:
        if layer_of(module) == "problems":
            continue
        for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Constant) and isinstance(node.value, str):
                assert node.value.partition(":")[0] not in names, f"{module}:{node.lineno}"


def test_private_names_are_not_imported_by_other_subpackages() -> None:
    for module, name in iter_imports():
        package, _, inside = name.partition(".")
        if package == "dmplay" and inside.split(".")[0] not in (layer_of(module), "problems"):
            private = [part for part in inside.split(".") if re.match("_[a-z]", part)]
            assert not private, f"{module} imports {name}"


def test_there_are_no_import_cycles() -> None:
    paths = {
        ".".join(module.relative_to(PACKAGE_FOLDER.parent).with_suffix("").parts): module
        for module in MODULE_PATHS
    }
    imports = {
        name: (_possible_modules(imported_names(module)) & paths.keys()) - {name}
        for name, module in paths.items()
    }
    while leaves := {name for name, needs in imports.items() if not needs}:
        imports = {name: needs - leaves for name, needs in imports.items() if name not in leaves}
    assert not imports, f"a circle: {imports}"


def _possible_modules(names: set[str]) -> set[str]:
    """Return the modules that these imported names may be or may belong to."""
    return names | {name.rpartition(".")[0] for name in names}


def test_no_test_module_imports_another() -> None:
    pattern = re.compile(r"^ *(?:from|import) .*\btest_.*", re.MULTILINE)
    for module in TESTS_FOLDER.rglob("*.py"):
        match = pattern.search(module.read_text(encoding="utf-8"))
        assert not match, f"{module.relative_to(TESTS_FOLDER)}: {match}"


def test_every_module_has_a_layer() -> None:
    assert {layer_of(module) for module in MODULE_PATHS} - {"__init__"} == set(LAYERS)


@pytest.mark.parametrize(
    ("words", "never"),
    [
        ("--version", {"typer", "numpy", "rich", "prompt_toolkit"}),
        ("--help; play --help", {"numpy", "rich", "prompt_toolkit"}),
        ("guide; guide play --raw", {"numpy", "rich", "prompt_toolkit"}),
        ("learn; learn --json; config path", {"numpy", "rich", "dmplay.tutor.lesson_file_reader"}),
        ("list; list pomdp --json",
         {"rich", "dmplay.agents", "dmplay.draw", "dmplay.views", "dmplay.transcript.format",
          "dmplay.solvers"}),
        ("solve --help",
         {f"dmplay.cli.{name}" for name in ("games", "learn", "evaluation", "grading", "plots")}),
        (
            "hexworld --agent optimal --quiet",
            {
                "prompt_toolkit",
                "multiprocessing",
                "dmplay.formats.cassandra",
                "dmplay.external.bots.bot_policy",
                "dmplay.simulation.rollouts",
            },
        ),
    ],
)  # fmt: skip
def test_start_up_loads_no_more_than_it_needs(words: str, never: set[str]) -> None:
    code = (
        "import sys\nfrom dmplay.__main__ import main\n"
        f"for sys.argv[1:] in {[line.split() for line in words.split(';')]!r}:\n"
        "    try:\n        main()\n"
        "    except SystemExit as end:\n        assert not end.code, end.code\n"
    )
    assert not list_loaded_modules(code, never)


@pytest.mark.parametrize(
    ("second_line", "solvers"),
    [
        ("T: * identity", {"methods", "pomdp.exact_pomdp", "pomdp.upper_envelope"}),
        ("T: * identty", {"methods"}),
    ],
)
def test_solve_loads_only_the_method_that_it_uses(
    second_line: str, solvers: set[str], tmp_path: Path
) -> None:
    """Solve a file with two hidden states by alpha vectors; one with a syntax error, not at all."""
    file = tmp_path / "two.pomdp"
    file.write_text(
        "discount: 0.9\nvalues: reward\nstates: 2\nactions: 2\nobservations: 2\n"
        f"{second_line}\nO: * uniform\nR: 0 : 0 : * : * 1\nR: 1 : 1 : * : * 1\n"
    )
    code = (
        "import sys\nfrom dmplay.__main__ import main\n"
        f"sys.argv[1:] = ['solve', {str(file)!r}]\n"
        "try:\n    main()\nexcept SystemExit as end:\n    assert end.code in (None, 0, 2)\n"
        "for name in sorted(sys.modules):\n"
        "    if name.startswith('dmplay.'):\n        print('loaded', name[7:])\n"
    )
    result = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"XDG_CACHE_HOME": str(tmp_path)},
    )
    lines = (line.split() for line in result.stdout.splitlines())
    loaded = {words[1] for words in lines if words[:1] == ["loaded"]}
    assert not [
        name
        for name in loaded
        if name.split(".")[0] in {"draw", "views", "ui", "external", "servers"}
    ]
    modules = {name.removeprefix("solvers.") for name in loaded if name.startswith("solvers.")}
    checks = {"pomdp.legal_action_leak", "double_description"}  # before and below the method
    assert modules - FOLDERS_OF_SOLVERS - checks == solvers


def test_openblas_starts_only_one_thread() -> None:
    code = (
        "import os, sys\nfrom dmplay.__main__ import main\nsys.argv[1:] = ['--version']\n"
        "try:\n    main()\nexcept SystemExit:\n"
        "    print(os.environ['OPENBLAS_DEFAULT_NUM_THREADS'])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.splitlines()[-1] == "1"


def test_first_frames_load_neither_prompt_toolkit_nor_agents() -> None:
    """Draw a frame of the gallery, which needs only the views of shown problems, and of a game."""
    never = {
        "prompt_toolkit", "dmplay.problems.game_2048.agents", "dmplay.problems.game_2048.view",
        "dmplay.problems.hexworld.agents", "dmplay.solvers.pomdp.exact_pomdp",
    }  # fmt: skip
    code = (
        "from pathlib import Path\n"
        "from dmplay.terminal.capabilities import Terminal\n"
        "from dmplay.ui.screen.frame_state import FrameState, Viewport\n"
        "from dmplay.ui.gallery.gallery import Gallery\n"
        "from dmplay.ui.gallery.problem_entries import list_problem_entries\n"
        "from dmplay.ui.screen import full_screen\n"
        "way = Terminal(True, '', True, True, False)\n"
        "Gallery(list_problem_entries(), way, '20261122').compose_rows(Viewport(80, 24))\n"
        "from dmplay.ui.screen.frame import compose_frame\n"
        "from dmplay.game.launch_requests "
        "import GameRequest\nfrom "
        "dmplay.game.game_setup "
        "import start_new_game\n"
        "from dmplay.game import game_series\nfrom "
        "dmplay.ui.screen import play_screen\n"
        "game = start_new_game(GameRequest('hexworld', "
        "seed=7, record_path=Path('/dev/null')))\n"
        "compose_frame(game, Viewport(80, 24), FrameState(), [])\n"
    )
    assert not list_loaded_modules(code, never)


def test_a_built_in_problem_starts_without_a_slow_scan_of_installed_packages() -> None:
    code = (
        "import importlib.metadata, sys\nimportlib.metadata.entry_points = None\n"
        "sys.argv[1:] = ['hexworld', '--agent', 'random', '--quiet']\n"
        "from dmplay.__main__ import main\nmain()"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


# Public in spite of their underscore: methods of named tuples, and functions of the standard
# library that its documentation describes or that have no other name. `mcp` gives its server of
# other streams no public name.
DOCUMENTED_NAMES = {
    "_replace", "_asdict", "_fields", "_field_defaults", "_make", "_exit", "_run_exitfuncs",
    "_lowlevel_server",
}  # fmt: skip


def test_no_module_uses_a_private_name_of_a_library() -> None:
    """A private name is one that begins with an underscore, and that dmplay does not define."""
    trees = {module: ast.parse(module.read_text(encoding="utf-8")) for module in MODULE_PATHS}
    own_names = DOCUMENTED_NAMES | {
        part for path in MODULE_PATHS for part in path.with_suffix("").parts
    }
    uses: list[tuple[Path, int, str]] = []
    for module, tree in trees.items():
        for node in ast.walk(tree):
            match node:
                case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                    own_names.add(node.name)
                case ast.Name(id=name, ctx=ast.Store()) | ast.Attribute(attr=name, ctx=ast.Store()):
                    own_names.add(name)
                case ast.Attribute(attr=name):
                    uses.append((module, node.lineno, name))
                case ast.ImportFrom(module=source, names=aliases, level=0):
                    words = [
                        word for alias in aliases for word in f"{source}.{alias.name}".split(".")
                    ]
                    uses += [(module, node.lineno, word) for word in words]
                case ast.Import(names=aliases):
                    words = [word for alias in aliases for word in alias.name.split(".")]
                    uses += [(module, node.lineno, word) for word in words if word != "_thread"]
    private = re.compile(r"_(?!_).*")
    assert not [use for use in uses if private.fullmatch(use[2]) and use[2] not in own_names]


def test_the_stub_and_the_lazy_names_agree() -> None:
    import dmplay

    stub = ast.parse((PACKAGE_FOLDER / "__init__.pyi").read_text())
    modules = {
        alias.name: (node.module or "").removeprefix("dmplay.")
        for node in stub.body
        if isinstance(node, ast.ImportFrom)
        for alias in node.names
    }
    assert modules == vars(dmplay)["_PUBLIC_MODULES"]
    assert {*modules} <= {*dir(dmplay)}
    for name in modules:
        assert getattr(dmplay, name)
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        _ = dmplay.nothing  # type: ignore[attr-defined]
    page = (PACKAGE_FOLDER / "guide" / "70-python.md").read_text(encoding="utf-8")
    assert not [name for name in modules if f"`{name}`" not in page]
