"""Settings: flag over variable over the project's file over the user's over the default."""

import json
import os
import subprocess
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any, NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from dmplay.cli import config
from dmplay.cli.app import root_command
from dmplay.cli.config import GENERAL_OPTIONS, PROJECT_FILE_OPTIONS
from dmplay.cli.errands import interpret_command
from dmplay.cli.settings import config_defaults, configurable_options, iter_effective_settings
from dmplay.errors import BadParameter, DmplayError
from dmplay.game.errand import PlayCommand
from dmplay.game.request import GameRequest
from dmplay.game.table import GameController
from tests.support import programs

GROUP: Any = root_command()
EVERY = [
    (name, option)
    for name, command in GROUP.commands.items()
    for option in configurable_options(command)
]
VALUES: Mapping[str, tuple[object, ...]] = {  # four apart from the default, by click's type
    "int": (3, 4, 5, 6),
    "float": (3.0, 4.0, 5.0, 6.0),
    "choice": (),
    "": ("a", "b", "c", "d"),
}
SET: Mapping[str, object] = {
    "plain": True, "ascii": True, "speed": 7.0, "width": 60, "theme": "mono",
    "motion": False, "input": False,
}  # fmt: skip


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A project folder, with the user's file in `home`."""
    for name in [*os.environ]:
        if name.startswith("DMPLAY"):
            monkeypatch.delenv(name)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "home"))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "home" / "dmplay").mkdir(parents=True)
    config.load_config_files.cache_clear()
    yield tmp_path
    config.load_config_files.cache_clear()


def write(path: Path, text: str) -> None:
    path.write_text(text, encoding="utf-8")
    config.load_config_files.cache_clear()


def users(place: Path, text: str) -> None:
    write(place / "home" / "dmplay" / "config.toml", text)


def projects(place: Path, text: str) -> None:
    write(place / "dmplay.toml", text)


def context(*words: str) -> Any:
    """The context of the program called with these words, its files read."""
    return GROUP.make_context("dmplay", list(words), resilient_parsing=True)


def found(name: str, option: str, *flags: str) -> tuple[object, str]:
    """The value of an option as its command takes it, and where it came from."""
    return every(name, *flags)[option]


def every(name: str, *flags: str) -> dict[str, tuple[object, str]]:
    """The same of all options of a command."""
    command = GROUP.commands[name]
    with (
        context(name) as root,
        command.make_context(name, [*flags], parent=root, resilient_parsing=True) as made,
    ):
        return {
            option: (made.params[one.name], made.get_parameter_source(one.name).name)
            for option, one in configurable_options(command).items()
        }


class Asked(NamedTuple):
    """What an option is given by a flag, by a variable, by the project and by the user."""

    one: Any
    values: Sequence[object]

    def told(self, by: int) -> object:
        """One of them as a file has it and a command takes it."""
        return (self.values[by],) if self.one.multiple else self.values[by]

    def variable(self, name: str) -> tuple[str, str]:
        """The variable of a command's option, and what it holds."""
        value = str(int(not self.one.default) if self.one.is_bool_flag else self.values[1])
        return self.one.envvar or f"DMPLAY_{name.upper()}_{self.one.name.upper()}", value

    def flags(self, option: str) -> list[str]:
        """What is typed."""
        if self.one.is_bool_flag:
            return [f"--no-{option}" if self.one.default else f"--{option}"]
        return [f"--{option}", str(self.values[0])]


def four(one: Any, number: int) -> Asked:
    """Four values that differ, and differ from those of the option before it."""
    kind = next(kind for kind in VALUES if one.type.name.startswith(kind))
    if one.is_bool_flag:
        return Asked(one, [not one.default] * 4)
    if kind == "choice":
        return Asked(one, [*one.type.choices, one.type.choices[0]])
    first = number % 4
    return Asked(one, [*VALUES[kind][first:], *VALUES[kind][:first]])


@pytest.mark.parametrize("name", GROUP.commands)
def test_a_flag_wins_over_a_variable_over_the_project_over_the_user(
    name: str, place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = configurable_options(GROUP.commands[name])
    asked = {option: four(one, number) for number, (option, one) in enumerate(known.items())}

    def file(options: Iterable[str], by: int) -> str:
        rows = (f"{option} = {json.dumps(asked[option].told(by))}\n" for option in options)
        return f"[{name}]\n{''.join(rows)}"

    def come(options: Iterable[str], by: int, source: str) -> dict[str, tuple[object, str]]:
        return {option: (asked[option].told(by), source) for option in options}

    assert {source for _, source in every(name).values()} <= {"DEFAULT"}
    users(place, file(asked, 3))
    assert every(name) == come(asked, 3, "DEFAULT_MAP")
    for option in asked.keys() - PROJECT_FILE_OPTIONS:
        projects(place, file([option], 2))
        with pytest.raises(DmplayError, match=f"^dmplay.toml: {name}.{option}: a folder's file"):
            config_defaults(GROUP.commands)
    free = asked.keys() & PROJECT_FILE_OPTIONS
    projects(place, file(free, 2))
    assert every(name) == come(asked, 3, "DEFAULT_MAP") | come(free, 2, "DEFAULT_MAP")
    for one in asked.values():
        monkeypatch.setenv(*one.variable(name))
    assert every(name) == come(asked, 1, "ENVIRONMENT")
    flags = [word for option, one in asked.items() for word in one.flags(option)]
    assert every(name, *flags) == come(asked, 0, "COMMANDLINE")


@pytest.mark.parametrize("option", GENERAL_OPTIONS)
def test_a_general_setting_reaches_every_command_that_has_it(option: str, place: Path) -> None:
    value = SET.get(option, "never")
    users(place, f"{option} = {json.dumps(value)}\n")
    having = [
        name for name, command in GROUP.commands.items() if option in configurable_options(command)
    ]
    assert len(having) > 1
    for name in having:
        assert found(name, option) == (value, "DEFAULT_MAP")


def test_a_command_of_its_own_wins_in_a_file_and_a_project_over_both(place: Path) -> None:
    users(place, 'color = "never"\n[play]\ncolor = "always"\n')
    assert found("play", "color")[0] == "always"
    assert found("replay", "color")[0] == "never"
    projects(place, 'color = "auto"\n')
    assert found("play", "color")[0] == "auto"


def test_what_a_file_switches_on_a_flag_switches_off(place: Path) -> None:
    users(place, "plain = true\nascii = true\n")
    assert found("play", "plain", "--no-plain") == (False, "COMMANDLINE")
    assert found("play", "ascii", "--no-ascii") == (False, "COMMANDLINE")


@pytest.mark.parametrize("name", ["DMPLAY_WIDTH", "DMPLAY_PLAY_TURNS"])
def test_a_variable_that_is_wrong_is_named(name: str, place: Path) -> None:
    done = run(place, "hexworld", **{name: "wide"})
    assert done.returncode == 2
    option = f"--{name.rpartition('_')[2].lower()}"
    told = f"error: {name}: invalid value for '{option}': 'wide' is not a whole number; see"
    assert done.stderr.startswith(told)


def test_every_setting_is_shown_with_its_source(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    users(place, 'theme = "mono"\n[play]\nturns = 20\n')
    projects(place, "[play]\nspeed = 9\n")
    monkeypatch.setenv("DMPLAY_COLOR", "never")
    monkeypatch.setenv("DMPLAY_PLAY_AGENT", "random")
    rows = {
        one.name: (one.value, one.source)
        for one in iter_effective_settings(context("config", "show"))
    }
    assert {f"{name}.{option}" for name, option in EVERY} == set(rows)
    assert rows["play.turns"] == (20, str(place / "home" / "dmplay" / "config.toml"))
    assert rows["play.speed"] == (9.0, "dmplay.toml")
    assert rows["replay.speed"] == (2.0, "default")
    assert rows["shell.theme"][0] == "mono"
    assert rows["play.color"] == ("never", "DMPLAY_COLOR")
    assert rows["play.agent"] == ("random", "DMPLAY_PLAY_AGENT")
    assert rows["play.seed"] == (None, "default")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ('[play]\nagent = "./evil.py:X="', "dmplay.toml: play.agent: a folder's file sets looks"),
        ('[play]\nvs = "optimal"', "dmplay.toml: play.vs: a folder's file sets looks"),
        ('[play]\nseat = ["a=./evil.py:X=1"]', "dmplay.toml: play.seat: a folder's file sets"),
        ('[play]\nset = ["slip=0"]', "dmplay.toml: play.set: a folder's file sets looks"),
        ("[play]\nreveal = true", "dmplay.toml: play.reveal: a folder's file sets looks"),
        ("[verify]\nallow-unfinished = true", "dmplay.toml: verify.allow-unfinished: a folder's"),
        ("[verify]\ntrust = true", "dmplay.toml: [verify]: unknown setting 'trust'"),
        ("[aliases]\nhw = 'list'", "dmplay.toml: aliases.hw: a folder's file sets looks"),
        ('colour = "never"', "dmplay.toml: unknown setting 'colour'; did you mean color?"),
        ("seed = 3", "dmplay.toml: unknown setting 'seed'; did you mean"),
        ("[plya]\nturns = 3", "dmplay.toml: unknown table 'plya'; did you mean play"),
        ("[play]\nturn = 3", "dmplay.toml: [play]: unknown setting 'turn'; did you mean turns?"),
        ("[play]\nforce = true", "dmplay.toml: [play]: unknown setting 'force'"),
        ("[play]\nturns = 'x'", "dmplay.toml: play.turns: got 'x', expected a whole number"),
        ("[play]\nturns = true", "dmplay.toml: play.turns: got True, expected a whole number"),
        (f"speed = 1{'0' * 400}", "dmplay.toml: speed: expected a number, which is not as large"),
        ("speed = 0", "dmplay.toml: speed: 0.0 is not in the range"),
        ("plain = 1", "dmplay.toml: plain: got 1, expected true or false"),
        ("[play]\nset = 'a=1'", "dmplay.toml: play.set: got 'a=1', expected a list"),
        ("[play]\nset = [1]", "dmplay.toml: play.set: got 1, expected text"),
        ("keys = 'vi'", "dmplay.toml: keys: got 'vi', expected a table, [keys]"),
        ("[keys]\npreset = 3", "dmplay.toml: keys.preset: got 3, expected text"),
        ("[keys]\npreset = 'emacs'", "dmplay.toml: keys.preset: 'emacs' is not one of 'vi'"),
        ("[play]\nkeys = 'emacs'", "dmplay.toml: play.keys: 'emacs' is not one of 'vi', 'left'"),
        ("color = 'red'", "dmplay.toml: color: 'red' is not one of 'auto', 'always', 'never'"),
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
)
def test_a_wrong_file_is_one_clear_line(text: str, message: str, place: Path) -> None:
    users(place, text) if message.startswith("config.toml") else projects(place, text)
    with pytest.raises(DmplayError) as error:
        config_defaults(GROUP.commands)
    assert str(error.value).removeprefix(f"{place}/home/dmplay/").startswith(message)
    assert "\n" not in str(error.value)


def test_a_file_that_is_not_text_is_one_clear_line(place: Path) -> None:
    (place / "dmplay.toml").write_bytes(b"\xff\xfe = 1")
    with pytest.raises(DmplayError, match=r"^dmplay.toml: not UTF-8$"):
        config.load_config_files()


def refused(read: Callable[[], object]) -> bool:
    """Whether a file is refused, which must be one line that names it."""
    message = ""
    try:
        read()
    except DmplayError as error:
        message = str(error)
    assert not message or message.startswith("dmplay.toml: ")
    assert len(message.splitlines()) <= 1
    return bool(message)


# Latin, and what breaks lines, turns them round, is no character or takes four bytes: to draw from
# all that there are, all would be sorted first.
LETTERS = "".join(map(chr, range(0x250))) + "\u2028\u202e\u3000\ue000\ufeff\ufffe\U0001f600"
WORDS = st.sampled_from(
    ["play", "keys", "aliases", "color", "speed", "turns", "hex", "preset", "set", "seat", "x", ""]
)
VALUE = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(LETTERS, max_size=4),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(WORDS, inner, max_size=3),
    max_leaves=6,
)


def toml(value: Any) -> str:
    """A value as TOML has it inline; None as nonsense."""
    if isinstance(value, dict):
        return f"{{{', '.join(f'{json.dumps(key)} = {toml(v)}' for key, v in value.items())}}}"
    if isinstance(value, list):
        return f"[{', '.join(map(toml, value))}]"
    if isinstance(value, float):
        return repr(value)
    return json.dumps(value)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=15)
@given(told=st.dictionaries(WORDS, VALUE, max_size=4))
def test_any_file_is_read_or_refused_in_one_line(told: dict[str, Any], place: Path) -> None:
    projects(place, "\n".join(f"{json.dumps(key)} = {toml(v)}" for key, v in told.items()))
    read: dict[str, dict[str, object]] = {}
    if not refused(lambda: read.update(config_defaults(GROUP.commands))):
        assert set(told) <= {*GENERAL_OPTIONS, "keys", "aliases", *GROUP.commands}
        for name, values in read.items():
            assert values.keys() <= {one.name for one in GROUP.commands[name].params}


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(text=st.text(LETTERS, max_size=60))
def test_any_text_is_read_or_refused_in_one_line(text: str, place: Path) -> None:
    projects(place, text)
    refused(config.load_config_files)


# The program


def run(place: Path, *words: str, stdin: str = "", **env: str) -> CompletedProcess[str]:
    return programs.run(place, *words, stdin=stdin, XDG_CONFIG_HOME=str(place / "home"), **env)


def test_aliases_are_commands_on_the_command_line_and_in_the_shell(place: Path) -> None:
    users(place, '[aliases]\nhw = "play hexworld --seed 7"\neast = "act e; look"\n')
    done = run(place, "hw", "--turns", "1", stdin="e\n")
    assert "turn 1. at (8,2)." in done.stdout
    done = run(place, stdin="hw --turns 3\neast\n")
    assert done.returncode == 0
    assert "turn 1. at (8,2)." in done.stdout
    assert "at (8,2). E wall." in done.stdout


def test_an_alias_does_not_hide_a_command_of_the_shell(place: Path) -> None:
    users(place, '[aliases]\nundo = "list"\n')
    done = run(place, "shell", "-e", "list")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr == "error: aliases.undo: undo is a command; give another name\n"


def test_an_alias_leads_nowhere_but_once_and_an_action_wins_over_it(place: Path) -> None:
    users(place, '[aliases]\ntwice = "e; twice"\ne = "quit"\n')
    done = run(place, "hexworld", "--seed", "7", "--turns", "1", stdin="e\n")
    assert "turn 1. at (8,2)." in done.stdout
    done = run(place, "hexworld", "--seed", "7", stdin="twice\n")
    assert done.returncode == 2
    assert "error: line 1: unknown action 'twice'" in done.stderr


def test_a_wrong_file_stops_the_program_but_not_the_command_that_finds_it(place: Path) -> None:
    projects(place, 'colour = "never"\n')
    done = run(place, "hexworld")
    assert (done.returncode, done.stdout) == (2, "")
    assert done.stderr.count("\n") == 1
    shown = run(place, "config", "path")
    assert shown.stdout == f"{place}/home/dmplay/config.toml\ndmplay.toml\n"


def test_what_is_set_is_played(place: Path) -> None:
    users(place, '[play]\nturns = 1\nset = ["slip=0"]\n[keys]\npreset = "left"\n')
    done = run(place, "hexworld", "--seed", "7", stdin="keys\na\n")
    assert "keys: e d, ne e, nw w, w a, sw z, se x." in done.stdout
    assert "turn 1. at (6,2). chose W, moved W." in done.stdout
    assert "over: turn limit after 1 turn." in done.stdout
    shown = json.loads(run(place, "config", "show", "--json", DMPLAY_ASCII="1").stdout)
    told = {one["name"]: (one["value"], one["source"]) for one in shown}
    assert told["play.ascii"] == (True, "DMPLAY_ASCII")
    assert told["play.keys"] == ("left", f"{place}/home/dmplay/config.toml")


def test_a_parameter_that_a_file_sets_is_for_the_problems_that_have_it(place: Path) -> None:
    users(place, '[play]\nset = ["slip=0", "cries_sated=0.2"]\n')
    for words, fitting in (
        (["hexworld"], ["slip=0"]),
        (["crying-baby"], ["cries_sated=0.2"]),
        (["crying-baby", "--set", "slip=0"], ["slip=0"]),  # typed, so told that it is none
        (["hexword"], ["slip=0", "cries_sated=0.2"]),
        (["2048"], []),
    ):
        sitting = interpret_command(["play", *words])
        assert isinstance(sitting, PlayCommand)
        assert isinstance(sitting.request, GameRequest)
        assert [*sitting.request.settings] == fitting


def test_no_reader_of_files_is_loaded_where_there_is_none(place: Path) -> None:
    code = (
        "import sys\nfrom pathlib import Path\n"
        "from dmplay.__main__ import main\nfrom dmplay.cli import config\n"
        "for text in ('', 'plain = true'):\n"
        "    text and Path('dmplay.toml').write_text(text)\n"
        "    config.files.cache_clear()\n"
        "    sys.argv[1:] = ['list', '--help']\n"
        "    try:\n        main()\n"
        "    except SystemExit:\n        print('tomllib' in sys.modules)"
    )
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, capture_output=True, text=True, check=True, cwd=place)
    told = [row for row in done.stdout.splitlines() if row in ("False", "True")]
    assert told == ["False", "True"]


def test_an_agent_that_a_file_names_sits_where_it_plays_and_is_refused_with_the_file(
    place: Path,
) -> None:
    users(
        place, '[play]\nagent = "optimal"\nvs = "grim"\nghost = "optimal"\nseat = ["agent2=nash"]'
    )
    for words, sitting in (
        (["hexworld"], ("optimal", "", "", [])),
        (["2048"], ("human", "", "", [])),
        (["hexworld", "--agent", "human"], ("human", "", "optimal", [])),
        (["hexworld", "--agent", "random", "--vs", "chase"], ("random", "chase", "", [])),
        (
            ["hexworld", "--agent", "human", "--seat", "agent=random"],
            ("human", "", "", ["agent=random"]),
        ),
        (["travelers-dilemma"], ("human", "", "", ["agent2=nash"])),
        (["prisoners-dilemma"], ("human", "grim", "", ["agent2=nash"])),
    ):
        found = interpret_command(["play", *words])
        assert isinstance(found, PlayCommand)
        assert isinstance(found.request, GameRequest)
        told = found.request
        assert (told.agent, told.other_agent, told.ghost_agent, [*told.seats]) == sitting
    wrong = {"agent": '"grimm"', "vs": '"grimm"', "ghost": '"grimm"', "seat": '["agent2=grimm"]'}
    for option, name in wrong.items():
        users(place, f"[play]\n{option} = {name}\n")
        refused = rf"config\.toml: play\.{option}: unknown agent 'grimm'; did you mean grim\?"
        with pytest.raises(BadParameter, match=refused):
            interpret_command(["play", "prisoners-dilemma"])


def test_real_time_off_the_screen_is_refused_unless_only_a_file_wishes_it(place: Path) -> None:
    refused = "error: --rate: real time is for the full screen; there is none (from --plain)\n"
    assert run(place, "cart-pole", "--rate", "--plain").stderr == refused
    with pytest.raises(BadParameter, match="--rate: real time is for the screen"):
        GameController(cli_interpreter=interpret_command).run_cli_words(
            ["play", "cart-pole", "--rate"]
        )
    users(place, "[play]\nrate = 20.0\n")
    GameController(cli_interpreter=interpret_command).run_cli_words(["play", "cart-pole"])
    assert run(place, "cart-pole", "--plain", "--no-motion", stdin="left\n").returncode == 0


def test_what_a_file_wishes_for_people_and_transcripts_is_for_games_with_them(place: Path) -> None:
    users(place, "[play]\nrate = 20.0\nframes = true\nplayer = 'ann'\n")
    for words, granted in (
        (["hexworld"], (20.0, True, "ann")),
        (["hexworld", "--agent", "random"], (None, False, "")),
        (["hexworld", "--agent", "random", "-o", "g.dmt"], (None, True, "")),
        (["hexworld", "--seat", "agent=random"], (None, False, "")),
        (["catch", "--seat", "nobody=random"], (None, False, "")),  # which is refused later
    ):
        found = interpret_command(["play", *words])
        assert isinstance(found, PlayCommand)
        assert isinstance(found.request, GameRequest)
        assert (found.realtime_rate, found.request.record_frames, found.request.player) == granted
