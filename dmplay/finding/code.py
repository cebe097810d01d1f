"""Python files as modules under this one, by names that tell where each file is.

So whoever unpickles what a file defines, as a worker process, finds the file again.
"""

import importlib
import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec, spec_from_file_location
from pathlib import Path
from types import ModuleType

from dmplay.errors import BadParameter
from dmplay.places import describe_error_location, format_location

FILE_MODULE_PREFIX = f"{__name__}."
__path__: list[str] = []  # a module may be under this one


class _FileModuleFinder(MetaPathFinder):
    """Finds the file that a name tells of."""

    def find_spec(self, fullname: str, path: object, target: object = None) -> ModuleSpec | None:
        """How to load a module under this one; of any other, nothing."""
        if not fullname.startswith(FILE_MODULE_PREFIX):
            return None
        return spec_from_file_location(
            fullname, bytes.fromhex(fullname.rpartition("_")[2]).decode()
        )


sys.meta_path.append(_FileModuleFinder())


def load_module_from_file(path: str) -> ModuleType:
    """The module that a file is, as it is now; it can import what is beside it."""
    file = Path(path).resolve()
    if not file.is_file():
        raise BadParameter(f"no such file: {path}")
    name = f"{FILE_MODULE_PREFIX}file_{str(file).encode().hex()}"
    changed = file.stat().st_mtime_ns, file.stat().st_size
    if getattr(sys.modules.get(name), "__changed__", changed) != changed:
        del sys.modules[name]
    module = _import_module(name, file)
    vars(module)["__changed__"] = changed
    return module


def load_module_by_name(module_name: str, name: str) -> ModuleType:
    """The module of a dotted name, in the current folder too, in which `name` is looked up."""
    if not all(map(str.isidentifier, module_name.split("."))):
        raise BadParameter(f"no module {module_name!r} for {name!r}")
    try:
        return _import_module(module_name, Path.cwd() / module_name)
    except ModuleNotFoundError as error:
        if error.name and f"{module_name}.".startswith(f"{error.name}."):
            raise BadParameter(f"no module {error.name!r} for {name!r}") from None
        raise


def is_importable(name: str) -> bool:
    """Whether there is a module of this name, in the current folder too."""
    _add_folder_to_path(Path.cwd() / name)
    try:
        return name.isidentifier() and find_spec(name) is not None
    except (ImportError, ValueError):
        return False


def _add_folder_to_path(file: Path) -> None:
    """Has what is beside a file found; its folder comes last, so that it hides nothing."""
    if str(file.parent) not in sys.path:
        sys.path.append(str(file.parent))
    importlib.invalidate_caches()


def _import_module(name: str, file: Path) -> ModuleType:
    """A module, which can import what is beside its file."""
    _add_folder_to_path(file)
    try:
        return importlib.import_module(name)
    except SystemExit as error:
        told = 'put what runs under `if __name__ == "__main__":`'
        raise BadParameter(f"{describe_error_location(error)}; {told}") from None
    except SyntaxError as error:
        where = format_location(error.filename or str(file), error.lineno)
        raise BadParameter(f"{where}: {error.msg}") from None
    except ValueError as error:  # of a file that is no text
        if describe_error_location(error):
            raise
        raise BadParameter(f"{format_location(str(file), 1)}: {error}") from None
