"""Settings from files: the user's `config.toml`, the project's `dmplay.toml` over it.

A project's file may come with a download: it sets looks and numbers, and keys, but nothing that
runs code, chooses what is played or weakens a check.

color = "never"                     for every command that has the option
[play]                              for one command
turns = 20
[keys]                              which keys play
preset = "left"
[keys.hex]
k = "nw"
[aliases]                           more commands
hw = "play hexworld --seed 7"
"""

import os
import shlex
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import NamedTuple

from dmplay import disk
from dmplay.errors import BadParameter, UnknownName
from dmplay.finding.names import problem_names

PROJECT = "dmplay.toml"
# Set once for every command that has them.
GENERAL = ("plain", "color", "ascii", "theme", "speed", "width", "motion", "input")
LOOKS_AND_NUMBERS = (*GENERAL, "keys", "rate", "turns", "seed", "episode")
Section = dict[str, object]


class File(NamedTuple):
    """A file of settings."""

    path: str
    own: bool  # the user's; a project's may come from anywhere
    options: Section  # for every command that has them
    commands: dict[str, Section]  # for one
    preset: str | None
    keys: dict[str, dict[str, str]]  # family -> key -> action
    aliases: dict[str, str]


def entrusted(option: str, where: str) -> None:
    """Refuses what a project's file may not set."""
    if option not in LOOKS_AND_NUMBERS:
        raise BadParameter(
            f"{where}: a folder's file sets looks and numbers; "
            "only your own config.toml and the command line set this"
        )


def paths(env: Mapping[str, str]) -> tuple[Path, Path]:
    """Where the user's file is, by the base directory specification, and the project's, here."""
    return disk.user_folder(env, "XDG_CONFIG_HOME", ".config") / "config.toml", Path(PROJECT)


@cache
def files() -> tuple[File, ...]:
    """The files there are, the user's first."""
    user, project = paths(os.environ)
    found = [(user, True), (project, False)]
    return tuple(read(path, own=own) for path, own in found if os.path.isfile(path))


def aliases() -> dict[str, str]:
    """Every alias with what it stands for."""
    return {name: line for file in files() for name, line in file.aliases.items()}


def keys() -> dict[str, tuple[str, dict[str, str]]]:
    """The keys set for each family with the last file to do it; a project's replace a user's."""
    merged: dict[str, tuple[str, dict[str, str]]] = {}
    for file in files():
        for family, own in file.keys.items():
            merged[family] = file.path, {**merged.get(family, ("", {}))[1], **own}
    return merged


def read(path: Path, *, own: bool) -> File:
    """A file's settings; raises BadParameter or UnknownName, which name the file."""
    import tomllib  # only where there is a file

    name = str(path)
    try:
        content = tomllib.loads(disk.content(path).decode())
    except OSError as error:
        raise BadParameter(f"{name}: {error.strerror}") from None
    except (ValueError, RecursionError) as error:  # not TOML, or not UTF-8
        raise BadParameter(f"{name}: {_plainly(error)}") from None
    for key in ("keys", "aliases"):
        if not isinstance(content.setdefault(key, {}), dict):
            raise BadParameter(f"{name}: {key}: got {content[key]!r}, expected a table, [{key}]")
    set_keys, given = content.pop("keys"), content.pop("aliases")
    preset = _text(set_keys.pop("preset"), f"{name}: keys.preset") if "preset" in set_keys else None
    sections = {key: value for key, value in content.items() if isinstance(value, dict)}
    options = {key: value for key, value in content.items() if key not in sections}
    if given and not own:
        entrusted("aliases", f"{name}: aliases.{next(iter(given))}")
    return File(name, own, options, sections, preset, _keys(set_keys, name), _aliases(given, name))


def _plainly(error: Exception) -> str:
    told = "not UTF-8" if isinstance(error, UnicodeDecodeError) else str(error).partition("\n")[0]
    return f"{told[:1].lower()}{told[1:]}" if told else type(error).__name__


def _keys(told: Section, name: str) -> dict[str, dict[str, str]]:
    """The keys of each family, checked for form."""
    known = ["hex", *problem_names()]
    found = {}
    for family, own in told.items():
        if family not in known:
            raise UnknownName("keys", family, ["preset", *known], where=name)
        if not isinstance(own, dict):
            raise BadParameter(f"{name}: keys.{family}: got {own!r}, expected a table")
        where = f"{name}: keys.{family}"
        found[family] = {key: _text(label, f"{where}.{key}") for key, label in own.items()}
    return found


def _aliases(told: Section, name: str) -> dict[str, str]:
    """The aliases, checked for form."""
    found = {}
    for alias, line in told.items():
        where = f"{name}: aliases.{alias}"
        if not alias or not alias.isprintable() or set(alias) & set(" -;#'\"\\:./"):
            raise BadParameter(f"{where}: got {alias!r}, expected one plain word")
        if alias in problem_names():
            raise BadParameter(f"{where}: {alias} is a problem; give another name")
        found[alias] = _text(line, where)
        try:
            words = shlex.split(found[alias])
        except ValueError:  # a quotation without end
            words = []
        if not words:
            raise BadParameter(f"{where}: got {line!r}, expected a command")
    return found


def _text(value: object, where: str) -> str:
    if not isinstance(value, str):
        raise BadParameter(f"{where}: got {value!r}, expected text")
    return value
