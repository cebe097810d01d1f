"""Tests of the shell: typed lines, completion, scripts, and real sessions on a terminal."""

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

from dmplay.cli.commands import build_command
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import UnknownName
from dmplay.game.game_series import GameController
from dmplay.game.transcript_verification import verify
from dmplay.registry.builtin_names import problem_names
from dmplay.terminal.capabilities import Terminal as Wished
from dmplay.terminal.capabilities import TerminalOptions
from dmplay.transcript.reader import read_transcript
from dmplay.ui.shell import interactive_shell
from dmplay.ui.shell.command_shell import Shell
from dmplay.ui.shell.commands import COMMANDS, COMMANDS_BY_TOPIC, run_line
from dmplay.ui.shell.completer import CommandCompleter, complete_line
from tests.support.games import read_values
from tests.support.programs import run_dmplay
from tests.support.terminals import CTRL_C, CTRL_D, CTRL_Z, ENTER, TAB, Terminal, list_colour_codes

TERMINAL_SETTINGS = Wished(True, "", True, False, False)


@pytest.fixture
def state_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A temporary state folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    return tmp_path


def create_shell(*lines: str) -> Shell:
    """Return a shell after running these lines."""
    new_shell = Shell(
        GameController(cli_interpreter=interpret_command, aliases={"hw": "play hexworld --seed 7"}),
        TERMINAL_SETTINGS,
    )
    for line in lines:
        new_shell.run_line(line)
    return new_shell


def type_at_prompt(keys: str, current_shell: Shell | None = None) -> int:
    """Type these keys at the prompt and return the exit code."""
    with create_pipe_input() as pipe, create_app_session(input=pipe, output=DummyOutput()):
        pipe.send_text(keys)
        return interactive_shell.run_prompt(current_shell or create_shell(), pipe, DummyOutput())


def list_transcripts(folder: Path) -> list[Path]:
    """List the saved transcripts in the order of their names."""
    return sorted((folder / "dmplay" / "games").glob("*.dmt"))


def test_a_branch_from_an_earlier_turn_is_recorded_in_a_new_file(tmp_path: Path) -> None:
    commands = ("play hexworld --seed 7 -o g.dmt", "e", "ne", "branch 1", "w", "quit")
    completed = run_dmplay(tmp_path, *(word for command in commands for word in ("-e", command)))
    assert completed.returncode == 0
    assert "branched at turn 1. new game of hexworld. saved: g.dmt" in completed.stdout
    actions_by_file = {
        name: read_values(tmp_path / name, "actions") for name in ("g.dmt", "g-2.dmt")
    }
    assert actions_by_file == {
        "g.dmt": ['{"agent": "e"}', '{"agent": "ne"}'],
        "g-2.dmt": ['{"agent": "e"}', '{"agent": "w"}'],
    }
    assert all(verify(tmp_path / name).is_ok for name in actions_by_file)


def test_a_replay_is_branched_at_its_current_turn(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nw\n")
    commands = ("replay g.dmt", "step 2", "branch", "e", "quit")
    completed = run_dmplay(tmp_path, *(word for command in commands for word in ("-e", command)))
    assert "branched at turn 2." in completed.stdout
    assert "turn 3. chose E, bumped" in completed.stdout
    (file,) = (tmp_path / "state" / "dmplay" / "games").glob("*.dmt")
    assert verify(file).is_ok


def test_a_path_with_a_blank_is_printed_with_quotes(tmp_path: Path) -> None:
    commands = ("play hexworld --seed 7 -o 'a b.dmt'", "e", "save 'c d.dmt'")
    completed = run_dmplay(tmp_path, *(word for command in commands for word in ("-e", command)))
    assert "dmplay resume 'c d.dmt' continues the game" in completed.stdout
    assert "replay: dmplay replay 'a b.dmt'\n" in completed.stderr


def test_a_plot_is_the_same_inside_and_outside_the_shell(tmp_path: Path) -> None:
    for env in ({}, {"PYTHONIOENCODING": "ascii"}, {"DMPLAY_ASCII": "1"}):
        direct_output = run_dmplay(tmp_path, "plot", "F.2", **env).stdout
        assert (
            run_dmplay(tmp_path, "-e", "plot F.2", **env).stdout.rstrip() == direct_output.rstrip()
        )


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("branch 9", "--at: got 9, g.dmt has 1 turn"),
        ("branch one", "branch: got 'one', expected a turn, 0 to 1"),
    ],
)
def test_a_branch_at_an_invalid_turn_is_refused(line: str, message: str, tmp_path: Path) -> None:
    completed = run_dmplay(tmp_path, "-e", "play hexworld -o g.dmt", "-e", "e", "-e", line)
    assert (completed.returncode, completed.stderr.splitlines()[0]) == (2, "transcript: g.dmt")
    assert f"error: command 3: {message}\n" in completed.stderr


# At the prompt


WALK_LINES = "turn 1. chose E, moved E to (8,2).", "turn 2. chose NE, bumped, stayed at (8,2)."


@pytest.mark.parametrize(
    ("keys", "code", "expected"),
    [
        ("play hexworld --seed 7\re\rne; hint\r\x04", 0, (*WALK_LINES, "hint by optimal: sw")),
        ("play hexworld --seed 7\re\rne\r\x04", 0, ("  @  ",) * 3),  # a board after each line
        # Ctrl-C cancels a line; a second Ctrl-C on an empty line leaves.
        (
            "play hexwo\x03list\r\x03help act\r\x03\x03",
            130,
            ("problem  ", *["press Ctrl-C again"] * 2),
        ),
        # Lines that are pasted together run one after the other.
        ("\x1b[200~play hexworld --seed 7\ne # east\nne\n\x1b[201~\r\x04", 0, WALK_LINES),
    ],
)
def test_typed_lines_are_executed(
    keys: str,
    code: int,
    expected: tuple[str, ...],
    state_folder: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert type_at_prompt(keys) == code
    output = capsys.readouterr().out
    assert [output.count(text) for text in expected] == [expected.count(text) for text in expected]


def test_quit_and_its_key_exit_with_code_0_and_help_has_a_key(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert type_at_prompt("quit\r") == 0
    assert type_at_prompt("? keys\rq\r") == 0
    assert "keys: list the keys" in capsys.readouterr().out


def test_an_error_is_printed_and_the_prompt_returns(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert type_at_prompt("hexwrold\rlegal\rplay\rhexworld\rnee\rplay '\r\x04") == 0
    captured = capsys.readouterr()
    for error in (
        "unknown command 'hexwrold'; did you mean hexworld or reroll or help?",
        "no game is running; play PROBLEM starts one, list shows the problems",
        "play: expected a problem, such as play hexworld --seed 7",
        "unknown action 'nee'; did you mean ne or e?",
        'got "\'": no closing quotation',
    ):
        assert f"error: {error}\n" in captured.err


def test_f1_prints_help_that_fits_a_screen_and_names_every_command(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert type_at_prompt("\x1bOP\x04") == 0
    output = capsys.readouterr().out
    assert output.count("\n") < 20
    for topic, commands in COMMANDS_BY_TOPIC.items():
        assert f"{topic}: {', '.join(command.name for command in commands)}" in " ".join(
            output.split()
        )


def test_help_explains_actions_and_problems(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    current_shell = create_shell()
    current_shell.run_line("help hexworld")
    current_shell.run_line("play hexworld")
    current_shell.run_line("help ne")
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "hexworld: a problem; play hexworld starts it, info hexworld describes it"
    assert lines[-1] == "ne: an action; type its name to play it"


@pytest.mark.parametrize("topic", COMMANDS_BY_TOPIC)
def test_help_for_a_topic_explains_each_command(
    topic: str, state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    create_shell().run_line(f"help {topic}")
    lines = capsys.readouterr().out.splitlines()
    expected = [
        f"{c.name} {c.argument_help}".strip() + f": {c.help}" for c in COMMANDS_BY_TOPIC[topic]
    ]
    assert lines == expected
    with pytest.raises(UnknownName, match=r"did you mean files\?"):
        create_shell().run_line("help file")


def test_the_prompt_and_the_toolbar_show_the_state_of_the_game(state_folder: Path) -> None:
    current_shell = create_shell()
    assert (current_shell.prompt, interactive_shell.toolbar_text(current_shell)) == (
        "dmplay> ",
        " F1 help",
    )
    current_shell.run_line("hw; e")
    assert current_shell.prompt == "dmplay [hexworld t1]> "
    assert interactive_shell.toolbar_text(current_shell) == " score 0.00 · state (8,2) · F1 help"
    current_shell.run_line("play crying-baby --turns 1")
    assert interactive_shell.toolbar_text(current_shell) == " F1 help"
    current_shell.run_line("feed")
    assert current_shell.prompt == "dmplay [crying-baby t1 over]> "
    current_shell.run_line("play prisoners-dilemma --vs human")
    current_shell.run_line("c")
    assert current_shell.prompt == "dmplay [prisoners-dilemma t0 agent2]> "


def test_the_history_contains_lines_but_no_simultaneous_choices(state_folder: Path) -> None:
    type_at_prompt("hw\re\rplay prisoners-dilemma --vs human\rcooperate\rdefect\r\x04")
    history = (state_folder / "dmplay" / "history").read_text()
    assert [line[1:] for line in history.splitlines() if line[:1] == "+"] == [
        "hw", "e", "play prisoners-dilemma --vs human",
    ]  # fmt: skip
    # two lines up is `e`, which has no effect without a game
    assert type_at_prompt("\x1b[A\x1b[A\r\x04") == 0


def test_a_hidden_choice_is_neither_completed_nor_echoed_in_errors(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    type_at_prompt("play rock-paper-scissors --vs human\rscisors\rsci\t\r\x04")
    errors = capsys.readouterr().err
    assert (
        errors.count("error: not a legal action; type legal to list the legal actions, or help")
        == 2
    )
    assert "sci" not in errors


def test_the_end_of_a_game_is_reported_once(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    create_shell("play crying-baby --seed 7 --turns 1", "feed", "look", "state")
    output = capsys.readouterr().out
    assert output.count("over: the baby went hungry for ") == 1
    assert "turn 1. action feed. state " in output


@pytest.mark.parametrize("name", problem_names())
def test_every_problem_is_played_by_an_agent_step_by_step(
    name: str, state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    current_shell = create_shell(
        f"play {name} --seed 7 --agent random --turns 5", "step", "step 2", "auto"
    )
    assert len(current_shell.controller.game.session.turns) <= 5
    assert current_shell.controller.game.session.over
    current_shell.controller.end_game()
    (path,) = list_transcripts(state_folder)
    assert verify(path).is_ok
    with pytest.raises((LookupError, ValueError), match="'nonsense'"):
        current_shell.run_line("nonsense")


def test_a_transcript_can_be_replayed_and_resumed(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    current_shell = create_shell("hw", "e; ne", f"save {state_folder / 'g.dmt'}")
    current_shell.run_line(f"replay {state_folder / 'g.dmt'}")
    current_shell.run_line("step; step; undo")
    assert len(current_shell.controller.game.session.turns) == 1
    current_shell.run_line(f"load {state_folder / 'g.dmt'}")
    assert "resumed hexworld. turn 2." in capsys.readouterr().out
    current_shell.run_line("w")
    current_shell.controller.end_game()
    end = read_transcript(state_folder / "g.dmt").end_block
    assert end is not None
    assert json.loads(json.dumps(end["end"]))["turns"] == 3


def test_a_hidden_game_is_not_exported_before_its_end(state_folder: Path) -> None:
    current_shell = create_shell("play crying-baby --seed 3 --turns 2", "feed")
    with pytest.raises(ValueError, match="would show hidden states"):
        current_shell.run_line("export --csv")
    current_shell.run_line("feed; export --csv")


def test_the_screen_opens_only_on_a_terminal(state_folder: Path) -> None:
    with pytest.raises(ValueError, match="only available in the shell, on a terminal"):
        create_shell("hw", "screen")


# Completion


@pytest.mark.parametrize(
    ("line", "expected"),
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
        ("plot ", "F.2 values"),
    ],
)
def test_valid_completions_are_offered(line: str, expected: str, state_folder: Path) -> None:
    assert set(expected.split()) <= set(complete_line(create_shell().controller, line))


def test_all_options_except_display_options_are_offered(state_folder: Path) -> None:
    table = create_shell().controller
    option_names = {
        name: {max(option.opts, key=len) for option in build_command(name).params}
        - {"paths", "problem"}
        for name in ("play", "export")
    }
    display_options = {f"--{name}" for name in (*TerminalOptions._fields, "quiet", "speed", "rate")}
    play_options = option_names["play"] - display_options - {"--strict-hints"} | {"--strict=hints"}
    assert {*complete_line(table, "play hexworld ")} == play_options
    assert {
        option for option in complete_line(table, "export ") if option.startswith("-")
    } == option_names["export"]


@pytest.mark.parametrize(
    ("line", "expected"),
    [
        ("", "e nw undo restart"),
        ("act ", "e nw"),
        ("agent ", "agent"),
        ("agent agent ", "optimal"),
        ("set ", "slip"),
        ("seed ", "7"),
    ],
)
def test_valid_completions_in_a_game_are_offered(
    line: str, expected: str, state_folder: Path
) -> None:
    assert set(expected.split()) <= set(complete_line(create_shell("hw").controller, line))


def test_transcript_files_are_offered(state_folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (state_folder / "a.dmt").touch()
    (state_folder / "b.txt").touch()
    monkeypatch.chdir(state_folder)
    for command in ("load", "replay", "export"):
        completions = complete_line(create_shell().controller, f"{command} ")
        assert "a.dmt" in completions
        assert "b.txt" not in completions


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
    line: str, first: str, state_folder: Path
) -> None:
    completer = FuzzyCompleter(CommandCompleter(create_shell().controller), WORD=True)
    completions = [*completer.get_completions(Document(line), CompleteEvent())]
    assert completions[0].text == first
    assert -completions[0].start_position == len(line.rpartition(" ")[2])


# Scripts

SCRIPT_TEXT = "# a game\nplay hexworld --seed 7\n\ne  # east\nact NE; look\nquit\nnever\n"


@pytest.mark.parametrize("arguments", [(), ("shell",)])
def test_a_script_is_echoed_after_the_prompts_and_played(
    arguments: Sequence[str], tmp_path: Path
) -> None:
    completed = run_dmplay(tmp_path, *arguments, stdin=SCRIPT_TEXT)
    assert completed.returncode == 0
    prompts = [line for line in completed.stdout.splitlines() if line.startswith("dmplay")]
    assert prompts == [
        "dmplay> play hexworld --seed 7",
        "dmplay [hexworld t0]> e  # east",
        "dmplay [hexworld t1]> act NE; look",
        "dmplay [hexworld t2]> quit",
    ]
    assert "│" not in completed.stdout
    assert completed.stderr.startswith("transcript: ")


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("nee", "line 3: unknown action 'nee'; did you mean ne or e?"),
        ("act e e", "line 3: act: got 'e e', expected one action; separate several"),
        ("act", "line 3: act: expected an action"),
        ("new 5", "line 3: new: got '5', expected no argument"),
        ("quit now", "line 3: quit: got 'now', expected no argument"),
        ("undo 3", "line 3: undo: only 1 turn was played"),
        ("play chess", "line 3: unknown problem 'chess'"),
        ("play hexworld --sed 3", "line 3: no such option: --sed"),
        ("step", "line 3: step: a person plays this game; agent SEAT NAME lets an agent play"),
    ],
)
def test_an_invalid_line_ends_a_script_with_code_2_and_is_named(
    line: str, message: str, tmp_path: Path
) -> None:
    completed = run_dmplay(tmp_path, "shell", stdin=f"play hexworld --seed 7\ne\n{line}\ne\n")
    assert completed.returncode == 2
    assert completed.stderr.splitlines()[-1].startswith(f"error: {message}")
    (path,) = list_transcripts(tmp_path / "state")
    assert '"reason": "illegal", "turns": 1' in path.read_text()


def test_execute_options_run_in_order(tmp_path: Path) -> None:
    arguments = ("-e", "play hexworld --seed 7", "-e", "e", "-e", "quit", "-e", "never")
    completed = run_dmplay(tmp_path, *arguments)
    assert completed.returncode == 0
    assert "turn 1. chose E, moved E to (8,2)." in completed.stdout
    assert "dmplay>" not in completed.stdout
    failed = run_dmplay(tmp_path, "shell", "--execute", "list", "-e", "legal")
    assert failed.returncode == 2
    assert failed.stderr.startswith("error: command 2: no game is running")


def test_undecodable_input_is_refused(tmp_path: Path) -> None:
    completed = run_dmplay(tmp_path, "shell", stdin="play hexworld\n\udcff\n")
    assert completed.returncode == 2
    assert "error: line 2: unknown action '\\\\xff'" in completed.stderr


@pytest.mark.parametrize("stdin", [None, ""])
def test_empty_input_prints_help_on_standard_error(stdin: str | None, tmp_path: Path) -> None:
    completed = run_dmplay(tmp_path, stdin=stdin)
    assert (completed.returncode, completed.stdout) == (2, "")
    assert "dmplay hexworld" in completed.stderr


def test_every_command_returns_text_or_a_described_error(
    state_folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("hexworld", "crying-baby", "simple-regulator", "predator-prey"):
        current_shell = create_shell(f"play {name} --seed 7")
        for command in COMMANDS:
            if command.name not in ("quit", "load"):
                try:
                    output = run_line(current_shell.controller, command.name)
                except (ValueError, LookupError) as error:
                    output = str(error)
                assert output


# On a real terminal


@pytest.mark.slow
def test_a_session_on_a_terminal(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready()
        assert len(terminal.text.partition("dmplay>")[0].splitlines()) <= 3
        terminal.press("play hexw").calm().press(TAB).calm()
        terminal.press(" --seed 7" + ENTER, "dmplay [hexworld t0]>").press("e" + ENTER, "t1]>")
        terminal.press("screen" + ENTER, " dmplay hexworld    seed 7   turn 1").calm()
        # With another seed the game might end, or the message be wrapped where the cursor was.
        terminal.press(":seed 8" + ENTER, "turn 0 ").press("l", "turn 1 ")
        terminal.press("q", "back in the shell").calm()
        terminal.press("restart" + ENTER, "t0]>").calm().press(
            CTRL_C, "press Ctrl-C again"
        ).calm().press(CTRL_C)
        assert terminal.ended() == 130
        assert terminal.left_clean()
        assert "transcript: " in terminal.text
    assert len(list_transcripts(tmp_path / "state")) == 2  # the last game had no turns
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play h", "play hexworld --seed 7").press("\x1b[C" + ENTER, "t0]>")
        assert terminal.press(CTRL_D).ended() == 0


@pytest.mark.slow
@pytest.mark.parametrize(("number", "code"), [(signal.SIGTERM, 143), (signal.SIGHUP, 129)])
def test_a_signal_ends_a_session_cleanly(number: int, code: int, tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play hexworld --seed 7" + ENTER, "t0]>").press(
            "e" + ENTER, "t1]>"
        ).calm()
        terminal.signal(number)
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed
    (path,) = list_transcripts(tmp_path / "state")
    assert verify(path).is_ok
    assert '"reason": "interrupted"' in path.read_text()


@pytest.mark.slow
@pytest.mark.parametrize("env", [{"TERM": "dumb"}, {"ACCESSIBLE": "1"}])
def test_a_shell_without_drawing_prompts_in_plain_lines(
    env: dict[str, str], tmp_path: Path
) -> None:
    with Terminal("shell", folder=tmp_path, env=env) as terminal:
        terminal.until("dmplay>").press("play hexworld --seed 7\n", "[hexworld t0]>")
        terminal.press("nee\n", "error: unknown action 'nee'").press("e\n", "t1]>").calm()
        terminal.press(CTRL_C, "press Ctrl-C again").press("w\n", "t2]>").calm().press(
            CTRL_C
        ).calm()
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
        assert list_colour_codes(terminal.printed) == set()


@pytest.mark.slow
def test_ctrl_z_suspends_the_shell_and_fg_continues_it(tmp_path: Path) -> None:
    bash_command = ("bash", "--norc", "--noprofile", "-i")
    with Terminal(command=bash_command, folder=tmp_path, env={"PS1": "ready> "}) as terminal:
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


def test_the_shell_runs_a_lesson_between_two_lines(tmp_path: Path) -> None:
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.until("dmplay>").press(f"learn 1{ENTER}").until("answer>")
        terminal.press(f"quit{ENTER}").until("is not finished").until("dmplay>")
        terminal.press(f"quit{ENTER}")
        assert terminal.ended() == 0


def test_a_script_of_the_shell_says_where_lessons_run(tmp_path: Path) -> None:
    completed = run_dmplay(tmp_path, "shell", stdin="learn first\n")
    assert completed.returncode == 2
    assert "leave, then run dmplay learn" in completed.stderr
