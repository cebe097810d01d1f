"""Tests of settings: a flag wins over a variable, a project file, a user file and the default."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from inspect import signature
from itertools import chain
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any, Literal, NamedTuple, get_args, get_origin

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dmplay.cli import config_files
from dmplay.cli.app import root_command
from dmplay.cli.commands import COMMANDS, build_command
from dmplay.cli.config_files import GENERAL_OPTIONS, PROJECT_FILE_OPTIONS
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.cli.settings import (
    PROBLEM_OPTIONS,
    iter_effective_settings,
    list_configurable_options,
    load_command_defaults,
)
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.game_series import GameController
from tests.support import programs

GROUP: Any = root_command()
COMMAND_OPTIONS = [
    (name, option) for name in COMMANDS for option in list_configurable_options(build_command(name))
]
# four values that differ from the default
VALUES_BY_TYPE: Mapping[type, tuple[object, ...]] = {
    int: (3, 4, 5, 6),
    float: (3.0, 4.0, 5.0, 6.0),
    str: ("a", "b", "c", "d"),
}
GENERAL_VALUES: Mapping[str, object] = {
    "plain": True, "ascii": True, "speed": 7.0, "width": 60, "theme": "mono",
    "motion": False, "input": False, "keep": 500,
}  # fmt: skip


@pytest.fixture
def project_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A project folder, with the user's file in its subfolder `home`."""
    for name in [*os.environ]:
        if name.startswith("DMPLAY"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "home" / "dmplay").mkdir(parents=True)
    config_files.load_config_files.cache_clear()
    yield tmp_path
    config_files.load_config_files.cache_clear()


def write_config_file(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
    config_files.load_config_files.cache_clear()


def write_user_file(project_folder: Path, text: str) -> None:
    write_config_file(project_folder / "home" / "dmplay" / "config.toml", text)


def write_project_file(project_folder: Path, text: str) -> None:
    write_config_file(project_folder / "dmplay.toml", text)


def make_context(*arguments: str) -> Any:
    """Make the context of the program called with these arguments, after reading its files."""
    return GROUP.make_context("dmplay", list(arguments), resilient_parsing=True)


def as_plain_value(value: Any) -> object:
    """Return a value of an option in the form that it has with every version of Typer."""
    return (
        tuple(value)
        if isinstance(value, list)
        else str(value)
        if isinstance(value, Path)
        else value
    )


def read_option(name: str, option: str, *flags: str) -> tuple[object, str]:
    """Return the value of an option as its command receives it, and the source of the value."""
    return read_options(name, *flags)[option]


def read_options(name: str, *flags: str) -> dict[str, tuple[object, str]]:
    """Return the values and sources of all options of a command."""
    command = build_command(name)
    with (
        make_context(name) as root,
        command.make_context(
            name, [*flags], parent=root, resilient_parsing=True
        ) as command_context,
    ):
        return {
            option: (
                as_plain_value(command_context.params[parameter.name]),
                command_context.get_parameter_source(parameter.name).name,
            )
            for option, parameter in list_configurable_options(command).items()
        }


class OptionValues(NamedTuple):
    """The values of an option in a flag, a variable, the project file and the user file."""

    example: Any
    values: Sequence[object]

    def value_of(self, source_index: int) -> object:
        """Return one of the values, as a file contains it and a command receives it."""
        return (self.values[source_index],) if self.example.multiple else self.values[source_index]

    def variable(self, name: str) -> tuple[str, str]:
        """Return the environment variable of a command's option, and its value."""
        value = str(int(not self.example.default) if self.example.is_bool_flag else self.values[1])
        return self.example.envvar or f"DMPLAY_{name.upper()}_{self.example.name.upper()}", value

    def flags(self, option: str) -> list[str]:
        """Return the arguments that set the option."""
        if self.example.is_bool_flag:
            return [f"--no-{option}" if self.example.default else f"--{option}"]
        return [f"--{option}", str(self.values[0])]


def make_option_values(command: Any, parameter: Any, option_index: int) -> OptionValues:
    """Return four values that differ from each other, and from those of the option before."""
    if parameter.is_bool_flag:
        return OptionValues(parameter, [not parameter.default] * 4)
    value_type = get_args(signature(command.callback).parameters[parameter.name].annotation)[0]
    parts = (value_type, *get_args(value_type))
    if choices := [*chain(*(get_args(part) for part in parts if get_origin(part) is Literal))]:
        return OptionValues(parameter, [*choices, choices[0]])
    values = next((VALUES_BY_TYPE[part] for part in parts if part in VALUES_BY_TYPE), None)
    values, first = values or VALUES_BY_TYPE[str], option_index % 4
    return OptionValues(parameter, [*values[first:], *values[:first]])


@pytest.mark.parametrize("name", COMMANDS)
def test_a_flag_wins_over_a_variable_over_the_project_over_the_user(
    name: str, project_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    parameters = list_configurable_options(build_command(name))
    values_by_option = {
        option: make_option_values(build_command(name), entry, number)
        for number, (option, entry) in enumerate(parameters.items())
    }

    def file(options: Iterable[str], source_index: int) -> str:
        rows = (
            f"{option} = {json.dumps(values_by_option[option].value_of(source_index))}\n"
            for option in options
        )
        return f"[{name}]\n{''.join(rows)}"

    def come(
        options: Iterable[str], source_index: int, source: str
    ) -> dict[str, tuple[object, str]]:
        return {
            option: (values_by_option[option].value_of(source_index), source) for option in options
        }

    assert {source for _, source in read_options(name).values()} <= {"DEFAULT"}
    file_options = values_by_option.keys() - PROBLEM_OPTIONS
    defaults = {
        option: read_options(name)[option] for option in values_by_option.keys() - file_options
    }
    write_user_file(project_folder, file(file_options, 3))
    assert read_options(name) == defaults | come(file_options, 3, "DEFAULT_MAP")
    for option in file_options - set(PROJECT_FILE_OPTIONS):
        write_project_file(project_folder, file([option], 2))
        with pytest.raises(DmplayError, match=f"^dmplay.toml: {name}.{option}: this file may set"):
            load_command_defaults(name)
    project_options = values_by_option.keys() & PROJECT_FILE_OPTIONS
    write_project_file(project_folder, file(project_options, 2))
    assert read_options(name) == (
        defaults | come(file_options, 3, "DEFAULT_MAP") | come(project_options, 2, "DEFAULT_MAP")
    )
    for entry in values_by_option.values():
        monkeypatch.setenv(*entry.variable(name))
    assert read_options(name) == come(values_by_option, 1, "ENVIRONMENT")
    flags = [word for option, entry in values_by_option.items() for word in entry.flags(option)]
    assert read_options(name, *flags) == come(values_by_option, 0, "COMMANDLINE")


@pytest.mark.parametrize("option", GENERAL_OPTIONS)
def test_a_general_setting_reaches_every_command_that_has_it(
    option: str, project_folder: Path
) -> None:
    value = GENERAL_VALUES.get(option, "never")
    write_user_file(project_folder, f"{option} = {json.dumps(value)}\n")
    command_names = [
        name for name in COMMANDS if option in list_configurable_options(build_command(name))
    ]
    assert len(command_names) > 1
    for name in command_names:
        assert read_option(name, option) == (value, "DEFAULT_MAP")


def test_a_command_table_wins_in_a_file_and_a_project_file_wins_over_both(
    project_folder: Path,
) -> None:
    write_user_file(project_folder, 'color = "never"\n[play]\ncolor = "always"\n')
    assert read_option("play", "color")[0] == "always"
    assert read_option("replay", "color")[0] == "never"
    write_project_file(project_folder, 'color = "auto"\n')
    assert read_option("play", "color")[0] == "auto"


def test_a_flag_switches_off_a_setting_of_a_file(project_folder: Path) -> None:
    write_user_file(project_folder, "plain = true\nascii = true\n")
    assert read_option("play", "plain", "--no-plain") == (False, "COMMANDLINE")
    assert read_option("play", "ascii", "--no-ascii") == (False, "COMMANDLINE")


@pytest.mark.parametrize("name", ["DMPLAY_WIDTH", "DMPLAY_PLAY_TURNS"])
def test_an_invalid_variable_is_named_in_the_error(name: str, project_folder: Path) -> None:
    result = run(project_folder, "hexworld", **{name: "wide"})
    assert result.returncode == 2
    assert result.stderr.startswith(f"error: {name}: got 'wide', expected a whole number")


def test_a_switch_of_a_variable_is_true_or_false(project_folder: Path) -> None:
    result = run(project_folder, "hexworld", DMPLAY_PLAIN="maybe")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == "error: DMPLAY_PLAIN: got 'maybe', expected true or false\n"


def test_every_setting_is_shown_with_its_source(
    project_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_user_file(project_folder, 'theme = "mono"\n[play]\nturns = 20\n')
    write_project_file(project_folder, "[play]\nspeed = 9\n")
    monkeypatch.setenv("DMPLAY_COLOR", "never")
    monkeypatch.setenv("DMPLAY_PLAY_AGENT", "random")
    rows = {
        setting.name: (setting.value, setting.source)
        for setting in iter_effective_settings(make_context("config", "show"))
    }
    assert {f"{name}.{option}" for name, option in COMMAND_OPTIONS} == set(rows)
    assert rows["play.turns"] == (20, str(project_folder / "home" / "dmplay" / "config.toml"))
    assert rows["play.speed"] == (9.0, "dmplay.toml")
    assert rows["replay.speed"] == (2.0, "default")
    assert rows["shell.theme"][0] == "mono"
    assert rows["play.color"] == ("never", "DMPLAY_COLOR")
    assert rows["play.agent"] == ("random", "DMPLAY_PLAY_AGENT")
    assert rows["play.seed"] == (None, "default")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[play]\nagent = "./evil.py:X="',
         "dmplay.toml: play.agent: a settings file applies to every problem"),
        ('[play]\nvs = "optimal"', "dmplay.toml: play.vs: a settings file applies"),
        ('[play]\nseat = ["a=./evil.py:X=1"]', "dmplay.toml: play.seat: a settings file applies"),
        ('[play]\nset = ["slip=0"]',
         "dmplay.toml: play.set: a settings file applies to every problem"),
        ("[play]\nreveal = true", "dmplay.toml: play.reveal: this file may set only"),
        ("[verify]\nallow-unfinished = true", "dmplay.toml: verify.allow-unfinished: this"),
        ("[verify]\ntrust = true", "dmplay.toml: [verify]: unknown setting 'trust'"),
        ("[aliases]\nhw = 'list'", "dmplay.toml: aliases.hw: this file may set only"),
        ('colour = "never"', "dmplay.toml: unknown setting 'colour'; did you mean color?"),
        ("seed = 3", "dmplay.toml: unknown setting 'seed'; did you mean"),
        ("[plya]\nturns = 3", "dmplay.toml: unknown table 'plya'; did you mean play"),
        ("[play]\nturn = 3", "dmplay.toml: [play]: unknown setting 'turn'; did you mean turns?"),
        ("[play]\nforce = true", "dmplay.toml: [play]: unknown setting 'force'"),
        ("[play]\nturns = 'x'", "dmplay.toml: play.turns: got 'x', expected a whole number"),
        ("[play]\nturns = true", "dmplay.toml: play.turns: got True, expected a whole number"),
        (f"speed = 1{'0' * 400}", "dmplay.toml: speed: got an integer of more than 64 bits"),
        ("speed = 0", "dmplay.toml: speed: got 0, expected a number of at least 0.1"),
        ("plain = 1", "dmplay.toml: plain: got 1, expected true or false"),
        ("keys = 'vi'", "dmplay.toml: keys: got 'vi', expected a table, [keys]"),
        ("[keys]\npreset = 3", "dmplay.toml: keys.preset: got 3, expected text"),
        ("[keys]\npreset = 'emacs'", "dmplay.toml: keys.preset: unknown value 'emacs'; expected"),
        ("[play]\nkeys = 'emacs'", "dmplay.toml: play.keys: unknown value 'emacs'; expected"),
        ("color = 'red'", "dmplay.toml: color: unknown value 'red'; expected one of auto"),
        ("[keys]\nhex = 'vi'", "dmplay.toml: keys.hex: got 'vi', expected a table"),
        ("[keys.hexwrld]\na = 'e'", "dmplay.toml: unknown keys 'hexwrld'; did you mean hexworld"),
        ("[keys.hex]\na = 3", "dmplay.toml: keys.hex.a: got 3, expected text"),
        ("x = [", "dmplay.toml: invalid value (at end of document)"),
        ("a = 1\na = 2", "dmplay.toml: cannot overwrite a value"),
        ("[aliases]\nplay = 'list'", "config.toml: aliases.play: play is a command"),
        ("[aliases]\ncatch = 'list'", "config.toml: aliases.catch: catch is a problem"),
        ("[aliases]\n'a b' = 'list'", "config.toml: aliases.a b: got 'a b', expected one plain"),
        ("[aliases]\nx = ' '", "config.toml: aliases.x: got ' ', expected a command"),
    ],
)  # fmt: skip
def test_an_invalid_file_is_reported_in_one_line(
    text: str, message: str, project_folder: Path
) -> None:
    write_user_file(project_folder, text) if message.startswith(
        "config.toml"
    ) else write_project_file(project_folder, text)
    with pytest.raises(DmplayError) as error:
        load_command_defaults("list")
    assert str(error.value).removeprefix(f"{project_folder}/home/dmplay/").startswith(message)
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_text_is_reported_in_one_line(project_folder: Path) -> None:
    (project_folder / "dmplay.toml").write_bytes(b"\xff\xfe = 1")
    with pytest.raises(DmplayError, match=r"^dmplay.toml: not UTF-8$"):
        config_files.load_config_files()


def is_refused(read: Callable[[], object]) -> bool:
    """Return whether a file is refused; check that the error is one line that names the file."""
    message = ""
    try:
        read()
    except DmplayError as error:
        message = str(error)
    assert not message or message.startswith("dmplay.toml:")
    assert len(message.splitlines()) <= 1
    return bool(message)


# Latin letters, and characters that break lines, reverse text, are unassigned or take four bytes.
# The alphabet is small because Hypothesis would sort the characters of a larger one first.
LETTERS = "".join(map(chr, range(0x250))) + "\u2028\u202e\u3000\ue000\ufeff\ufffe\U0001f600"
CONFIG_KEYS = st.sampled_from(
    ["play", "keys", "aliases", "color", "speed", "turns", "hex", "preset", "set", "seat", "x", ""]
)
CONFIG_VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(LETTERS, max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(CONFIG_KEYS, inner, max_size=3),
    max_leaves=6,
)


def format_toml(value: Any) -> str:
    """Format a value as inline TOML; None becomes invalid TOML."""
    if isinstance(value, dict):
        return (
            f"{{{', '.join(f'{json.dumps(key)} = {format_toml(v)}' for key, v in value.items())}}}"
        )
    if isinstance(value, list):
        return f"[{', '.join(map(format_toml, value))}]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=15)
@given(options_by_name=st.dictionaries(CONFIG_KEYS, CONFIG_VALUES, max_size=4))
def test_any_file_is_read_or_refused_in_one_line(
    options_by_name: dict[str, Any], project_folder: Path
) -> None:
    write_project_file(
        project_folder,
        "\n".join(f"{json.dumps(key)} = {format_toml(v)}" for key, v in options_by_name.items()),
    )
    values: dict[str, object] = {}
    if not is_refused(lambda: values.update(load_command_defaults("play")["play"])):
        assert set(options_by_name) <= {*GENERAL_OPTIONS, "keys", "aliases", *COMMANDS}
        assert values.keys() <= {parameter.name for parameter in build_command("play").params}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.text(LETTERS, max_size=60))
def test_any_text_is_read_or_refused_in_one_line(text: str, project_folder: Path) -> None:
    write_project_file(project_folder, text)
    is_refused(config_files.load_config_files)


# The program


def run(
    project_folder: Path, *arguments: str, stdin: str = "", **env: str
) -> CompletedProcess[str]:
    return programs.run_dmplay(
        project_folder, *arguments, stdin=stdin, XDG_CONFIG_HOME=str(project_folder / "home"), **env
    )


def test_aliases_are_commands_on_the_command_line_and_in_the_shell(project_folder: Path) -> None:
    write_user_file(
        project_folder, '[aliases]\nhw = "play hexworld --seed 7"\neast = "act e; look"\n'
    )
    result = run(project_folder, "hw", "--turns", "1", stdin="e\n")
    assert "turn 1. chose E, moved E to (8,2)." in result.stdout
    result = run(project_folder, stdin="hw --turns 3\neast\n")
    assert result.returncode == 0
    assert "turn 1. chose E, moved E to (8,2)." in result.stdout
    assert "at (8,2). E wall." in result.stdout


def test_an_alias_does_not_hide_a_command_of_the_shell(project_folder: Path) -> None:
    write_user_file(project_folder, '[aliases]\nundo = "list"\n')
    result = run(project_folder, "shell", "-e", "list")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == "error: aliases.undo: undo is a command; choose another name\n"


def test_an_alias_is_expanded_only_once_and_an_action_wins_over_it(project_folder: Path) -> None:
    write_user_file(project_folder, '[aliases]\ntwice = "e; twice"\ne = "quit"\n')
    result = run(project_folder, "hexworld", "--seed", "7", "--turns", "1", stdin="e\n")
    assert "turn 1. chose E, moved E to (8,2)." in result.stdout
    result = run(project_folder, "hexworld", "--seed", "7", stdin="twice\n")
    assert result.returncode == 2
    assert "error: line 1: unknown action 'twice'" in result.stderr


def test_an_invalid_file_stops_the_program_but_not_config_path(project_folder: Path) -> None:
    write_project_file(project_folder, 'colour = "never"\n')
    result = run(project_folder, "hexworld")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr.count("\n") == 1
    path_result = run(project_folder, "config", "path")
    assert path_result.stdout == f"{project_folder}/home/dmplay/config.toml\ndmplay.toml\n"


def test_a_game_uses_the_settings_of_a_file(project_folder: Path) -> None:
    write_user_file(project_folder, '[play]\nturns = 1\n[keys]\npreset = "left"\n')
    result = run(project_folder, "hexworld", "--seed", "7", stdin="keys\na\n")
    assert "keys: e d, ne e, nw w, w a, sw z, se x." in result.stdout
    assert "turn 1. chose W, moved W to (6,2)." in result.stdout
    assert "over: you took no exit in 1 turn." in result.stdout
    entries = json.loads(run(project_folder, "config", "show", "--json", DMPLAY_ASCII="1").stdout)
    value_and_source = {
        entry["name"]: (entry["value"], entry["source"]) for entry in entries["settings"]
    }
    assert value_and_source["play.ascii"] == (True, "DMPLAY_ASCII")
    assert value_and_source["play.keys"] == ("left", f"{project_folder}/home/dmplay/config.toml")


def test_tomllib_is_loaded_only_if_there_is_a_file(project_folder: Path) -> None:
    code = (
        "import sys\nfrom pathlib import Path\n"
        "from dmplay.__main__ import main\nfrom dmplay.cli import config_files\n"
        "for text in ('', 'plain = true'):\n"
        "    text and Path('dmplay.toml').write_text(text)\n"
        "    config_files.load_config_files.cache_clear()\n"
        "    sys.argv[1:] = ['list', '--help']\n"
        "    try:\n        main()\n"
        "    except SystemExit:\n        print('tomllib' in sys.modules)"
    )
    arguments = [sys.executable, "-c", code]
    result = subprocess.run(
        arguments, capture_output=True, text=True, check=True, cwd=project_folder
    )
    rows = [row for row in result.stdout.splitlines() if row in ("False", "True")]
    assert rows == ["False", "True"]


@pytest.mark.parametrize(
    "setting",
    ['agent = "optimal"', 'vs = "grim"', 'ghost = "optimal"', 'seat = ["agent2=nash"]',
     'set = ["slip=0"]', 'variant = "circle"'],
)  # fmt: skip
def test_an_option_of_some_problems_is_refused_in_a_file_and_named(
    setting: str, project_folder: Path
) -> None:
    option = setting.partition(" ")[0]
    write_user_file(project_folder, f"[play]\n{setting}\n")
    result = run(project_folder, "hexworld")
    assert (result.returncode, result.stdout) == (2, "")
    assert f"config.toml: play.{option}: a settings file applies to every problem" in result.stderr
    assert f"type --{option}, or define an alias" in result.stderr


def test_real_time_without_the_screen_is_refused_unless_only_a_file_sets_it(
    project_folder: Path,
) -> None:
    message = "error: --rate: real time needs the full screen, which is off here (--plain)\n"
    assert run(project_folder, "cart-pole", "--rate", "--plain").stderr == message
    with pytest.raises(BadParameter, match="--rate: the shell cannot play in real time"):
        GameController(cli_interpreter=interpret_command).run_command_words(
            ["play", "cart-pole", "--rate"]
        )
    write_user_file(project_folder, "[play]\nrate = 20.0\n")
    GameController(cli_interpreter=interpret_command).run_command_words(["play", "cart-pole"])
    assert (
        run(project_folder, "cart-pole", "--plain", "--no-motion", stdin="left\n").returncode == 0
    )


def test_file_settings_for_people_are_not_used_when_agents_play_alone(project_folder: Path) -> None:
    write_user_file(project_folder, "[play]\nrate = 20.0\nframes = true\nplayer = 'ann'\n")
    seeded = ["hexworld", "--seed", "7", "--turns", "1"]
    watched = run(project_folder, *seeded, "--agent", "random")
    assert (watched.returncode, watched.stderr) == (0, "")
    run(project_folder, *seeded, "--agent", "random", "-o", "agent.dmt")
    run(project_folder, *seeded, "-o", "ann.dmt", stdin="e\n")
    for name, has_player in (("agent.dmt", False), ("ann.dmt", True)):
        text = (project_folder / name).read_text()
        assert ('player: "ann"' in text) == has_player
        assert "\n| " in text
    for option in ("--player=bob", "--frames"):
        refused = run(project_folder, *seeded, "--agent", "random", option)
        assert refused.returncode == 2
        assert f"error: {option.partition('=')[0]}: " in refused.stderr
