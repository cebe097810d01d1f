"""The shell: typed lines, scripts, and a real session on a terminal."""

import json
import signal
import sys
from collections.abc import Sequence
from pathlib import Path

import pytest
from prompt_toolkit.application import create_app_session
from prompt_toolkit.completion import CompleteEvent, FuzzyCompleter
from prompt_toolkit.document import Document
from prompt_toolkit.input import create_pipe_input
from prompt_toolkit.output import DummyOutput

from dmplay import prompt
from dmplay.cli.app import root_command
from dmplay.cli.errands import interpret_command
from dmplay.errors import UnknownName
from dmplay.finding.names import problem_names
from dmplay.game.checking import verify_file
from dmplay.game.table import GameController
from dmplay.terminal import Terminal as Wished
from dmplay.terminal import TerminalOptions
from dmplay.transcript.reading import read_transcript
from dmplay.words.commands import COMMANDS, COMMANDS_BY_TOPIC, run_line
from dmplay.words.completion.candidates import CommandCompleter, complete_line
from dmplay.words.shell import Shell
from tests.support.games import values
from tests.support.programs import run
from tests.support.terminals import (
    CTRL_C,
    CTRL_D,
    CTRL_Z,
    ENTER,
    TAB,
    Terminal,
    colours,
)

ON_A_TERMINAL = Wished(True, "", True, False, False)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A state folder of this test's own."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def shell(*lines: str) -> Shell:
    """A shell in which these lines were done."""
    made = Shell(
        GameController(cli_interpreter=interpret_command, aliases={"hw": "play hexworld --seed 7"}),
        ON_A_TERMINAL,
    )
    for line in lines:
        made.run_line(line)
    return made


def session(keys: str, made: Shell | None = None) -> int:
    """Types these keys at the prompt; the exit code."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys)
        return prompt.run_prompt(made or shell(), pipe, DummyOutput())


def kept(folder: Path) -> list[Path]:
    """The transcripts kept, in the order of their names."""
    return sorted((folder / "dmplay" / "games").glob("*.dmt"))


def test_a_game_is_played_on_from_an_earlier_turn_in_a_file_of_its_own(tmp_path: Path) -> None:
    words = ("play hexworld --seed 7 -o g.dmt", "e", "ne", "branch 1", "w", "quit")
    done = run(tmp_path, *(w for line in words for w in ("-e", line)))
    assert done.returncode == 0
    assert "on from turn 1. new game of hexworld. kept: g.dmt" in done.stdout
    told = {name: values(tmp_path / name, "actions") for name in ("g.dmt", "g-2.dmt")}
    assert told == {
        "g.dmt": ['{"agent": "e"}', '{"agent": "ne"}'],
        "g-2.dmt": ['{"agent": "e"}', '{"agent": "w"}'],
    }
    assert all(verify_file(tmp_path / name).is_ok for name in told)


def test_a_recording_that_is_looked_at_is_played_on_from_where_it_stands(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nw\n")
    words = ("replay g.dmt", "step 2", "branch", "e", "quit")
    done = run(tmp_path, *(w for line in words for w in ("-e", line)))
    assert "on from turn 2." in done.stdout
    assert "turn 3. at (8,2). chose E, bumped" in done.stdout
    (file,) = (tmp_path / "state" / "dmplay" / "games").glob("*.dmt")
    assert verify_file(file).is_ok


def test_a_path_with_a_blank_is_told_as_a_shell_takes_it(tmp_path: Path) -> None:
    words = ("play hexworld --seed 7 -o 'a b.dmt'", "e", "save 'c d.dmt'")
    done = run(tmp_path, *(w for line in words for w in ("-e", line)))
    assert "dmplay resume 'c d.dmt' goes on" in done.stdout
    assert "replay: dmplay replay 'a b.dmt'\n" in done.stderr


def test_a_figure_is_drawn_as_outside_the_shell(tmp_path: Path) -> None:
    for env in ({}, {"PYTHONIOENCODING": "ascii"}, {"DMPLAY_ASCII": "1"}):
        alone = run(tmp_path, "figure", "F.2", **env).stdout
        assert run(tmp_path, "-e", "figure F.2", **env).stdout.rstrip() == alone.rstrip()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("branch 9", "--at: got 9, g.dmt has 1 turn"),
        ("branch one", "branch: got 'one', expected a turn, 0 to 1"),
    ],
)
def test_a_turn_that_is_not_there_is_told(line: str, message: str, tmp_path: Path) -> None:
    done = run(tmp_path, "-e", "play hexworld -o g.dmt", "-e", "e", "-e", line)
    assert (done.returncode, done.stderr.splitlines()[0]) == (2, "transcript: g.dmt")
    assert f"error: command 3: {message}\n" in done.stderr


# At the prompt


WALKED = "turn 1. at (8,2). chose E, moved E.", "turn 2. at (8,2). chose NE, bumped, stayed."


@pytest.mark.parametrize(
    ("keys", "code", "told"),
    [
        ("play hexworld --seed 7\re\rne; hint\r\x04", 0, (*WALKED, "hint (optimal): sw")),
        ("play hexworld --seed 7\re\rne\r\x04", 0, ("  @  ",) * 3),  # one board a line
        # Ctrl-C cancels a line, and twice on an empty one leaves.
        (
            "play hexwo\x03list\r\x03help act\r\x03\x03",
            130,
            ("problem  ", *["Ctrl-C once more"] * 2),
        ),
        # Lines that are pasted together are done one after the other.
        ("\x1b[200~play hexworld --seed 7\ne # east\nne\n\x1b[201~\r\x04", 0, WALKED),
    ],
)
def test_what_is_typed_is_done(
    keys: str, code: int, told: tuple[str, ...], place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert session(keys) == code
    shown = capsys.readouterr().out
    assert [shown.count(one) for one in told] == [told.count(one) for one in told]


def test_quit_leaves_with_0_and_so_does_its_key_and_help_is_its_key_too(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert session("quit\r") == 0
    assert session("? keys\rq\r") == 0
    assert "keys: which key does what" in capsys.readouterr().out


def test_an_error_is_told_and_asked_again(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert session("hexwrold\rlegal\rplay\rhexworld\rnee\rplay '\r\x04") == 0
    told = capsys.readouterr()
    for error in (
        "unknown command 'hexwrold'; did you mean hexworld or reroll or help?",
        "no game is played; play PROBLEM begins one, list names them",
        "play: expected a problem, as play hexworld --seed 7",
        "unknown action 'nee'; did you mean ne or e?",
        'got "\'": no closing quotation',
    ):
        assert f"error: {error}\n" in told.err


def test_f1_is_help_that_fits_a_screen_and_names_every_command(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert session("\x1bOP\x04") == 0
    told = capsys.readouterr().out
    assert told.count("\n") < 20
    for topic, commands in COMMANDS_BY_TOPIC.items():
        assert f"{topic}: {', '.join(command.name for command in commands)}" in " ".join(
            told.split()
        )


def test_help_knows_actions_and_problems(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = shell()
    made.run_line("help hexworld")
    made.run_line("play hexworld")
    made.run_line("help ne")
    told = capsys.readouterr().out.splitlines()
    assert told[0] == "hexworld: a problem; play hexworld begins it, info hexworld tells of it"
    assert told[-1] == "ne: an action; its name alone plays it"


@pytest.mark.parametrize("topic", COMMANDS_BY_TOPIC)
def test_help_tells_of_a_topic_what_each_command_does(
    topic: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    shell().run_line(f"help {topic}")
    told = capsys.readouterr().out.splitlines()
    wanted = [
        f"{c.name} {c.argument_help}".strip() + f": {c.help}" for c in COMMANDS_BY_TOPIC[topic]
    ]
    assert told == wanted
    with pytest.raises(UnknownName, match="did you mean files or"):
        shell().run_line("help file")


def test_the_prompt_and_the_toolbar_tell_where_the_game_stands(place: Path) -> None:
    made = shell()
    assert (made.prompt, prompt.toolbar_text(made)) == ("dmplay> ", " F1 help")
    made.run_line("hw; e")
    assert made.prompt == "dmplay [hexworld t1]> "
    assert prompt.toolbar_text(made) == " score 0.00 · at (8,2) · F1 help"
    made.run_line("play crying-baby --turns 1")
    assert prompt.toolbar_text(made) == " F1 help"
    made.run_line("feed")
    assert made.prompt == "dmplay [crying-baby t1 over]> "
    made.run_line("play prisoners-dilemma --vs human")
    made.run_line("c")
    assert made.prompt == "dmplay [prisoners-dilemma t0 agent2]> "


def test_lines_are_remembered_but_not_the_choices_of_several(place: Path) -> None:
    session("hw\re\rplay prisoners-dilemma --vs human\rcooperate\rdefect\r\x04")
    typed_ = (place / "dmplay" / "history").read_text()
    assert [line[1:] for line in typed_.splitlines() if line[:1] == "+"] == [
        "hw", "e", "play prisoners-dilemma --vs human",
    ]  # fmt: skip
    assert session("\x1b[A\x1b[A\r\x04") == 0  # two up: `e`, which no game takes


def test_a_choice_that_is_hidden_is_neither_completed_nor_echoed_where_it_is_wrong(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    session("play rock-paper-scissors --vs human\rscisors\rsci\t\r\x04")
    told = capsys.readouterr().err
    assert told.count("error: that cannot be played; help and legal tell what can be typed") == 2
    assert "sci" not in told


def test_a_game_that_ends_is_told_once(place: Path, capsys: pytest.CaptureFixture[str]) -> None:
    shell("play crying-baby --seed 7 --turns 1", "feed", "look", "state")
    told = capsys.readouterr().out
    assert told.count("over: turn limit after 1 turn.") == 1
    assert "turn 1. action feed. state " in told


@pytest.mark.parametrize("name", problem_names())
def test_every_problem_is_played_by_an_agent_step_by_step(
    name: str, place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = shell(f"play {name} --seed 7 --agent random --turns 5", "step", "step 2", "auto")
    assert len(made.controller.game.session.turns) <= 5
    assert made.controller.game.session.over
    made.controller.end_game()
    (path,) = kept(place)
    assert verify_file(path).is_ok
    with pytest.raises((LookupError, ValueError), match="'nonsense'"):
        made.run_line("nonsense")


def test_a_recording_is_looked_at_and_gone_on_with(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    made = shell("hw", "e; ne", f"save {place / 'g.dmt'}")
    made.run_line(f"replay {place / 'g.dmt'}")
    made.run_line("step; step; undo")
    assert len(made.controller.game.session.turns) == 1
    made.run_line(f"load {place / 'g.dmt'}")
    assert "resumed hexworld. turn 2." in capsys.readouterr().out
    made.run_line("w")
    made.controller.end_game()
    end = read_transcript(place / "g.dmt").end_block
    assert end is not None
    assert json.loads(json.dumps(end["end"]))["turns"] == 3


def test_a_hidden_game_is_not_exported_before_its_end(place: Path) -> None:
    made = shell("play crying-baby --seed 3 --turns 2", "feed")
    with pytest.raises(ValueError, match="would tell what is hidden"):
        made.run_line("export --csv")
    made.run_line("feed; export --csv")


def test_the_screen_opens_from_a_terminal_only(place: Path) -> None:
    with pytest.raises(ValueError, match="opens from the shell, on a terminal"):
        shell("hw", "screen")


# Completion


@pytest.mark.parametrize(
    ("line", "among"),
    [
        ("", "play list hexworld 2048 hw"),
        ("play ", "hexworld hexworld:straight-line cart-pole:gym"),
        ("play hexworld ", "--seed --agent --set"),
        ("play hexworld --agent ", "human optimal random"),
        ("play prisoners-dilemma --vs ", "grim"),
        ("play prisoners-dilemma --seat ", "agent2=grim"),
        ("play hexworld --set ", "slip= discount="),
        ("info ", "catch"),
        ("help ", "undo restart files"),
        ("list ", "POMDP"),
        ("figure ", "F.2 T.1"),
    ],
)
def test_what_can_follow_is_offered(line: str, among: str, place: Path) -> None:
    assert set(among.split()) <= set(complete_line(shell().controller, line))


def test_the_options_of_the_command_line_are_offered_but_for_how_a_game_is_shown(
    place: Path,
) -> None:
    table = shell().controller
    known = {
        name: {max(one.opts, key=len) for one in root_command().commands[name].params}
        - {"file", "problem"}
        for name in ("play", "export")
    }
    look = {f"--{name}" for name in (*TerminalOptions._fields, "quiet", "speed", "rate")}
    play = known["play"] - look - {"--strict-hints"} | {"--strict=hints"}
    assert {*complete_line(table, "play hexworld ")} == play
    assert {one for one in complete_line(table, "export ") if one.startswith("-")} == known[
        "export"
    ]


@pytest.mark.parametrize(
    ("line", "among"),
    [
        ("", "e nw undo restart"),
        ("act ", "e nw"),
        ("agent ", "agent"),
        ("agent agent ", "optimal"),
        ("set ", "slip"),
        ("seed ", "7"),
    ],
)
def test_what_can_follow_in_a_game_is_offered(line: str, among: str, place: Path) -> None:
    assert set(among.split()) <= set(complete_line(shell("hw").controller, line))


def test_files_are_offered(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "a.dmt").touch()
    (place / "b.txt").touch()
    monkeypatch.chdir(place)
    for command in ("load", "replay", "export"):
        found = complete_line(shell().controller, f"{command} ")
        assert "a.dmt" in found
        assert "b.txt" not in found


@pytest.mark.parametrize(
    ("line", "first"),
    [
        ("play hexw:st", "hexworld:straight-line"),
        ("play hexworld --sd", "--seed"),
        ("list; pla", "play"),
        ("play prisoners-dilemma --vs tft", "tit-for-tat"),
    ],
)
def test_completion_is_fuzzy_and_takes_the_word_under_the_cursor(
    line: str, first: str, place: Path
) -> None:
    completer = FuzzyCompleter(CommandCompleter(shell().controller), WORD=True)
    found = [*completer.get_completions(Document(line), CompleteEvent())]
    assert found[0].text == first
    assert -found[0].start_position == len(line.rpartition(" ")[2])


# Scripts

SCRIPT = "# a game\nplay hexworld --seed 7\n\ne  # east\nact NE; look\nquit\nnever\n"


@pytest.mark.parametrize("words", [(), ("shell",)])
def test_a_script_is_echoed_after_the_prompts_and_played(
    words: Sequence[str], tmp_path: Path
) -> None:
    done = run(tmp_path, *words, stdin=SCRIPT)
    assert done.returncode == 0
    prompts = [line for line in done.stdout.splitlines() if line.startswith("dmplay")]
    assert prompts == [
        "dmplay> play hexworld --seed 7",
        "dmplay [hexworld t0]> e  # east",
        "dmplay [hexworld t1]> act NE; look",
        "dmplay [hexworld t2]> quit",
    ]
    assert "│" not in done.stdout
    assert done.stderr.startswith("transcript: ")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("nee", "line 3: unknown action 'nee'; did you mean ne or e?"),
        ("act e e", "line 3: act: got 'e e', expected one action; ';' stands between"),
        ("act", "line 3: act: expected an action"),
        ("new 5", "line 3: new: got '5', expected nothing after it"),
        ("quit now", "line 3: quit: got 'now', expected nothing after it"),
        ("undo 3", "line 3: undo 3: 1 turn was played"),
        ("play chess", "line 3: unknown problem 'chess'"),
        ("play hexworld --sed 3", "line 3: no such option: --sed"),
        ("step", "line 3: step: people play here; agent SEAT NAME seats an agent"),
    ],
)
def test_a_bad_line_ends_a_script_with_2_and_is_named(
    line: str, message: str, tmp_path: Path
) -> None:
    done = run(tmp_path, "shell", stdin=f"play hexworld --seed 7\ne\n{line}\ne\n")
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1].startswith(f"error: {message}")
    (path,) = kept(tmp_path / "state")
    assert '"reason": "illegal", "turns": 1' in path.read_text()


def test_commands_of_the_command_line_are_done_in_order(tmp_path: Path) -> None:
    words = ("-e", "play hexworld --seed 7", "-e", "e", "-e", "quit", "-e", "never")
    done = run(tmp_path, *words)
    assert done.returncode == 0
    assert "turn 1. at (8,2)." in done.stdout
    assert "dmplay>" not in done.stdout
    bad = run(tmp_path, "shell", "--execute", "list", "-e", "legal")
    assert bad.returncode == 2
    assert bad.stderr.startswith("error: command 2: no game is played")


def test_what_is_no_text_is_no_command(tmp_path: Path) -> None:
    done = run(tmp_path, "shell", stdin="play hexworld\n\udcff\n")
    assert done.returncode == 2
    assert "error: line 2: unknown action '\\\\xff'" in done.stderr


@pytest.mark.parametrize("stdin", [None, ""])
def test_nothing_to_read_is_help_on_the_error_stream(stdin: str | None, tmp_path: Path) -> None:
    done = run(tmp_path, stdin=stdin)
    assert (done.returncode, done.stdout) == (2, "")
    assert "dmplay hexworld" in done.stderr


def test_every_command_is_asked_without_a_fault(
    place: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for game in ("hexworld", "crying-baby", "simple-regulator", "predator-prey"):
        made = shell(f"play {game} --seed 7")
        for command in COMMANDS:
            if command.name not in ("quit", "load"):
                try:
                    words = run_line(made.controller, command.name)
                except (ValueError, LookupError) as error:
                    words = str(error)
                assert words


# On a real terminal


@pytest.mark.slow
def test_a_session_on_a_terminal(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready()
        assert len(terminal.text.partition("dmplay>")[0].splitlines()) <= 3
        terminal.press("play hexw").calm().press(TAB).calm()
        terminal.press(" --seed 7" + ENTER, "dmplay [hexworld t0]>").press("e" + ENTER, "t1]>")
        terminal.press("screen" + ENTER, " dmplay hexworld    seed 7   turn 1").calm()
        terminal.press("N", "new game").press("l", "turn 1 ").press("q", "again in words").calm()
        terminal.press("restart" + ENTER, "t0]>").calm().press(CTRL_C, "once more").calm().press(
            CTRL_C
        )
        assert terminal.ended() == 130
        assert terminal.left_clean()
        assert "transcript: " in terminal.text
    assert len(kept(tmp_path / "state")) == 2  # the last had no turns
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play h", "play hexworld --seed 7").press("\x1b[C" + ENTER, "t0]>")
        assert terminal.press(CTRL_D).ended() == 0


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_ends_a_session_in_good_order(number: int, code: int, tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play hexworld --seed 7" + ENTER, "t0]>").press(
            "e" + ENTER, "t1]>"
        ).calm()
        terminal.signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    (path,) = kept(tmp_path / "state")
    assert verify_file(path).is_ok
    assert '"reason": "interrupted"' in path.read_text()


@pytest.mark.slow
@pytest.mark.parametrize("env", [{"TERM": "dumb"}, {"ACCESSIBLE": "1"}])
def test_a_shell_that_cannot_draw_asks_in_lines(env: dict[str, str], tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path, env=env) as terminal:
        terminal.until("dmplay>").press("play hexworld --seed 7\n", "[hexworld t0]>")
        terminal.press("nee\n", "error: unknown action 'nee'").press("e\n", "t1]>").calm()
        terminal.press(CTRL_C, "once more").press("w\n", "t2]>").calm().press(CTRL_C).calm()
        terminal.press(CTRL_C)
        assert terminal.ended() == 130
        assert "\x1b" not in terminal.printed
        assert "│" not in terminal.printed


@pytest.mark.slow
def test_no_color_gives_no_colour_codes(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path, env={"NO_COLOR": "1"}) as terminal:
        terminal.ready().press("play hexworld --seed 7" + ENTER, "t0]>").press("he" + TAB).calm()
        terminal.press("\x15quit" + ENTER)
        assert terminal.ended() == 0
        assert colours(terminal.printed) == set()


@pytest.mark.slow
def test_ctrl_z_gives_the_terminal_back_and_fg_goes_on(tmp_path: Path) -> None:
    bash = ("bash", "--norc", "--noprofile", "-i")
    with Terminal(command=bash, folder=tmp_path, env={"PS1": "ready> "}) as terminal:
        terminal.until("ready>").press(f"{sys.executable} -m dmplay shell\r").ready().calm()
        terminal.press("play hexworld --seed 7" + ENTER, "t0]>").calm()
        terminal.press(CTRL_Z, "Stopped").calm().press("fg\r").calm(0.5)
        terminal.press("e" + ENTER, "t1]>").calm().press(CTRL_D, "transcript: ").calm()
        terminal.press("echo code=$?\r", "code=0").press("exit\r")
        assert terminal.ended() == 0


@pytest.mark.slow
def test_a_prompt_follows_the_size_of_its_terminal(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play hexworld --seed 7" + ENTER, "t0]>").calm()
        for columns, rows in ((50, 14), (200, 60), (20, 6)):
            terminal.resize(columns, rows).calm().press("e" + ENTER).calm()
        terminal.press(CTRL_D)
        assert terminal.ended() == 0
        assert "Traceback" not in terminal.printed
