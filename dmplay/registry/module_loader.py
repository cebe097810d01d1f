"""Python files as modules under this one, with names that contain the path of each file.

A process that unpickles what a file defines, such as a worker, can therefore find the file.
"""

import contextlib
import importlib
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from dmplay.core import safe_files
from dmplay.core.user_code_locations import describe_error_location, format_location
from dmplay.errors import BadParameter

FILE_MODULE_PREFIX = f"{__name__}."
__path__: list[str] = []  # allows modules under this one


class _FileModuleFinder(MetaPathFinder):
    """An import finder that finds the file whose path a module's name contains."""

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """Return the spec of a module under this one; None for any other module."""
        if not fullname.startswith(FILE_MODULE_PREFIX):
            return None
        return spec_from_file_location(
            fullname, bytes.fromhex(fullname.rpartition("_")[2]).decode()
        )


sys.meta_path.append(_FileModuleFinder())


def load_module_from_file(path: str) -> ModuleType:
    """Return the module of a Python file, imported again if the file has changed.

    It can import from the folder of the file. Raises BadParameter if there is no such file, or if
    the path is a folder or may be endless.
    """
    file = Path(path).resolve()
    if not file.is_file():
        raise BadParameter(_describe_missing_file(path))
    name = f"{FILE_MODULE_PREFIX}file_{str(file).encode().hex()}"
    version = file.stat().st_mtime_ns, file.stat().st_size
    if getattr(sys.modules.get(name), "__changed__", version) != version:
        del sys.modules[name]
    safe_files.register_source(file)
    module = _import_module(name, file)
    vars(module)["__changed__"] = version
    return module


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
        return _import_module(module_name, Path.cwd() / module_name)
    except ModuleNotFoundError as error:
        if error.name and f"{module_name}.".startswith(f"{error.name}."):
            raise BadParameter(f"{name}: no module {error.name!r}") from None
        raise


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

    Raises BadParameter if it exits the program, has a syntax error or is not text; `file` is named
    if the error does not say where it is.
    """
    try:
        with contextlib.redirect_stdout(sys.stderr):
            return importlib.import_module(name)
    except SystemExit as error:
        advice = 'put the code that runs the script under `if __name__ == "__main__":`'
        raise BadParameter(f"{describe_error_location(error)}; {advice}") from None
    except SyntaxError as error:
        location = format_location(error.filename or file, error.lineno)
        raise BadParameter(f"{location}: {error.msg}") from None
    except ValueError as error:  # the file is not text
        if describe_error_location(error):
            raise
        raise BadParameter(f"{format_location(file or name, 1)}: {error}") from None
