"""Python files and folders of problems as modules under this one, whose names contain their paths.

A process that unpickles what a file defines, such as a worker, can therefore find the file.
"""

import contextlib
import importlib
import sys
from collections.abc import Sequence
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from dmplay.core import safe_files
from dmplay.core.user_code_locations import (
    describe_error_location,
    describe_user_exit,
    format_location,
)
from dmplay.errors import BadParameter, DmplayError

FILE_MODULE_PREFIX = f"{__name__}."
RULES = "rules"  # the file of a problem's folder that defines the problem
PARTS = (RULES, "view", "agents", "solution", "teach", "figures")  # its files
_versions: dict[str, list[tuple[Path, int, int]]] = {}  # of the files of the modules
__path__: list[str] = []  # allows modules under this one


class _FileModuleFinder(MetaPathFinder):
    """An import finder that finds the file or folder whose path a module's name contains."""

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """Return the spec of a module under this one; None for any other, or one of a folder."""
        name = fullname.removeprefix(FILE_MODULE_PREFIX)
        if name == fullname or "." in name:
            return None
        file = Path(bytes.fromhex(name.rpartition("_")[2]).decode())
        if not file.is_dir():
            return spec_from_file_location(fullname, file)
        spec = ModuleSpec(fullname, None, is_package=True)
        spec.submodule_search_locations = [str(file)]
        return spec


sys.meta_path.append(_FileModuleFinder())


def load_module_from_file(path: str) -> ModuleType:
    """Return the module of a Python file, imported again if the file has changed.

    It can import from the folder of the file. A file of a problem's folder is a module of that
    folder. Raises BadParameter if there is no such file, or if the path is a folder or may be
    endless.
    """
    file = Path(path).resolve()
    if not file.is_file():
        raise BadParameter(_describe_missing_file(path))
    if file.stem in PARTS and (file.parent / f"{RULES}.py").is_file():
        return _import_from_folder(file.parent, file.stem)
    name = _module_name("file", file)
    _forget_changed_modules(name, [file])
    return _import_module(name, file)


def load_module_from_folder(path: str) -> ModuleType:
    """Return the module `rules.py` of a problem's folder; all is imported again after a change.

    Raises BadParameter if the path is not a folder with this file.
    """
    folder = Path(path).resolve()
    if not (folder / f"{RULES}.py").is_file():
        reason = "got a folder without" if folder.is_dir() else "no such folder; expected one with"
        raise BadParameter(f"{path}: {reason} the file {RULES}.py, which defines a problem")
    return _import_from_folder(folder, RULES)


def _import_from_folder(folder: Path, part: str) -> ModuleType:
    """Return a file of a problem's folder as a module."""
    name = _module_name("folder", folder)
    _forget_changed_modules(name, sorted(folder.glob("*.py")))
    return import_module_quietly(f"{name}.{part}")


def _module_name(kind: str, path: Path) -> str:
    """Return the name of the module of a file or folder."""
    return f"{FILE_MODULE_PREFIX}{kind}_{str(path).encode().hex()}"


def _forget_changed_modules(name: str, files: Sequence[Path]) -> None:
    """Forget a module and the modules under it if one of its files has changed."""
    version = [(file, file.stat().st_mtime_ns, file.stat().st_size) for file in files]
    if _versions.setdefault(name, version) != version:
        for loaded in [*sys.modules]:
            if f"{loaded}.".startswith(f"{name}."):
                del sys.modules[loaded]
    _versions[name] = version
    for file in files:
        safe_files.register_input_file(file)


def _describe_missing_file(path: str) -> str:
    """Return the reason why a path is not a file that can be imported."""
    if not Path(path).exists():
        return f"no such file: {path}"
    try:
        safe_files.refuse_endless_file(Path(path))
    except OSError as error:
        return f"{path}: {error.strerror}"
    return f"{path}: a folder, not a file"


def load_module_by_name(module_name: str, name: str) -> ModuleType:
    """Return the module of a dotted name, which may be in the current folder.

    Raises BadParameter if there is no such module, for the full `name` that contains it.
    """
    if not all(map(str.isidentifier, module_name.split("."))):
        raise BadParameter(f"{name}: no module {module_name!r}")
    try:
        return load_rules(_import_module(module_name, Path.cwd() / module_name))
    except ModuleNotFoundError as error:
        if error.name and f"{module_name}.".startswith(f"{error.name}."):
            raise BadParameter(f"{name}: no module {error.name!r}") from None
        raise


def load_rules(module: ModuleType) -> ModuleType:
    """Return the rules of a package that is a problem's folder; the module itself if it is none."""
    name = f"{module.__name__}.{RULES}"
    is_folder = hasattr(module, "__path__") and find_spec(name) is not None
    return import_module_quietly(name) if is_folder else module


def is_importable(name: str) -> bool:
    """Return whether there is a module of this name, in the current folder too."""
    _add_folder_to_path(Path.cwd() / name)
    try:
        return name.isidentifier() and find_spec(name) is not None
    except (ImportError, ValueError):
        return False


def _add_folder_to_path(file: Path) -> None:
    """Append a file's folder to the import path, at the end so that it hides no other module."""
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))
    importlib.invalidate_caches()


def _import_module(name: str, file: Path) -> ModuleType:
    """Return an imported module, which can import from its file's folder."""
    _add_folder_to_path(file)
    return import_module_quietly(name, str(file))


def import_module_quietly(name: str, file: str = "") -> ModuleType:
    """Return an imported module of user code, whose output goes to standard error.

    Raises BadParameter if it exits the program, has a syntax error, is not text or misuses dmplay;
    `file` is named if the error does not say where it is.
    """
    try:
        with contextlib.redirect_stdout(sys.stderr):
            return importlib.import_module(name)
    except SystemExit as error:
        if not describe_user_exit(error):  # a signal ends dmplay
            raise
        advice = 'put the code that runs the script under `if __name__ == "__main__":`'
        raise BadParameter(f"{describe_error_location(error)}; {advice}") from None
    except SyntaxError as error:
        location = format_location(error.filename or file, error.lineno)
        raise BadParameter(f"{location}: {error.msg}") from None
    except DmplayError as error:
        location = describe_error_location(error)
        if not location or str(error).startswith(location.partition(":")[0]):
            raise
        raise BadParameter(location) from error
    except ValueError as error:  # the file is not text
        if describe_error_location(error):
            raise
        raise BadParameter(f"{format_location(file or name, 1)}: {error}") from None
