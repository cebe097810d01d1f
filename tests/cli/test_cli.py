"""Tests of the command line: exit codes, one-line errors, and the streams that are written."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

import dmplay
from dmplay.cli.error_messages import format_error
from dmplay.errors import BadParameter
from tests.support.programs import run_dmplay, run_without_home
from tests.support.terminals import clean_environment
from tests.support.user_problems import BROKEN_AGENT_SOURCE, WALK_SOURCE

COMMANDS_WITH_EXAMPLES = (
    "play", "resume", "replay", "verify", "list", "info",
)  # fmt: skip


HUGE_NUMBER = "9" * 5000


@pytest.mark.parametrize(
    ("arguments", "stdin", "message"),
    [
        (["hexworld", "--agent", "../1.:"], "", "error: ../1.:: no module '../1.'"),
        (["hexworld", "--agent", ".a:b"], "", "error: .a:b: no module '.a'"),
        (["hexworld", "--seed", "7"], f"e\nundo {HUGE_NUMBER}\n", "error: line 2: undo: got '9"),
        (["hexworld"], f"seed {HUGE_NUMBER}\n", "error: line 1: seed: got '9"),
        (["shell"], "load a\0b\n", "error: line 1: got 'load a\\x00b', expected text"),
        (["hexworld"], "agent agent replay:a\0b\n", "error: line 1: got 'agent agent replay:a"),
        (["-e", "save \ud800"], "", "error: command 1: got 'save \\ud800', expected text"),
        (
            ["predator-prey", "--set", f"predators={HUGE_NUMBER[:400]}"],
            "",
            "error: predators: got '9",
        ),
    ],
)
def test_malformed_input_is_reported_in_one_line(
    arguments: list[str], stdin: str, message: str, tmp_path: Path
) -> None:
    result = run_dmplay(tmp_path, *arguments, stdin=stdin)
    assert (result.returncode, result.stderr.count(message)) == (2, 1)
    assert "unexpected" not in result.stderr


def test_the_middle_of_a_very_long_error_is_left_out() -> None:
    message = format_error(BadParameter("a" * 5000 + "z" * 5000))
    assert message == "a" * 1000 + " ... " + "z" * 1000


@pytest.mark.parametrize(
    "env",
    [
        {"COLUMNS": HUGE_NUMBER},
        {"_DMPLAY_COMPLETE": "complete_bash", "COMP_WORDS": "dmplay", "COMP_CWORD": "x"},
    ],
)
def test_a_variable_that_is_not_a_number_is_ignored(env: dict[str, str], tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "list", **env)
    assert (result.returncode, result.stderr) == (0, "")


@pytest.mark.parametrize("word", ["tournament.nfg", "runs:Walk"])
def test_a_problem_named_like_a_command_is_played_with_and_without_the_shell(
    word: str, tmp_path: Path
) -> None:
    (tmp_path / "tournament.nfg").write_text('NFG 1 R "" {"a" "b"} {2 2} 1 1 0 0 0 0 1 1')
    (tmp_path / "runs.py").write_text(WALK_SOURCE)
    assert run_dmplay(tmp_path, word, "-q", "--agent", "random", "--turns", "1").returncode == 0
    result = run_dmplay(tmp_path, "-e", f"{word} --seed 1", "-e", "quit")
    assert result.stdout.startswith(f"new game of {word}, seed 1.\n")


def test_a_piped_game_is_played_printed_and_recorded(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nquit\n")
    assert result.returncode == 0
    assert "turn 1. chose E, moved E to (8,2). reward 0. score 0.\n" in result.stdout
    assert result.stderr.split("\n") == [
        "transcript: g.dmt",
        "replay: dmplay replay g.dmt",
        "resume: dmplay resume g.dmt",
        "",
    ]
    assert (
        run_dmplay(tmp_path, "verify", "g.dmt").stdout
        == "ok g.dmt (2 turns; not recomputed: human)\n1 verified\n"
    )


def test_a_replay_shows_a_reroll_as_the_resulting_turn(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "2048", "--seed", "7", "-o", "g.dmt", stdin="left\nreroll\nundo\nup\n")
    rows = run_dmplay(tmp_path, "replay", "g.dmt").stdout.splitlines()
    assert [row.partition(". ")[0] for row in rows[1:-1]] == [
        "turn 1", "turn 1, rerolled", "undone", "turn 1, rerolled",
    ]  # fmt: skip
    assert rows[3] == "undone. turn 0."
    text = run_dmplay(tmp_path, "export", "g.dmt", "--text").stdout
    assert text.count("turn 1, rerolled. slid left.") == 3
    assert "undone. turn 0.\n turn 1, rerolled. slid up." in text


def test_the_end_of_input_quits_the_game(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "2048", "--seed", "7", stdin="")
    assert result.returncode == 0
    assert "over: quit after 0 turns." in result.stdout


def test_an_invalid_action_in_a_pipe_exits_with_2_and_keeps_the_turns(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\n# a note\nnee\ne\n"
    )
    assert result.returncode == 2
    assert result.stderr.endswith("error: line 3: unknown action 'nee'; did you mean ne or e?\n")
    text = (tmp_path / "g.dmt").read_text()
    assert "turn: 1\n" in text
    assert '"reason": "illegal"' in text
    assert run_dmplay(tmp_path, "verify", "g.dmt").returncode == 0
    illegal_result = run_dmplay(tmp_path, "2048", "--seed", "5", stdin="look\ndown\n")
    assert illegal_result.returncode == 2
    assert "error: line 2: turn 1, agent: down moves no tile" in illegal_result.stderr


def test_the_printed_command_plays_the_same_game_again(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "crying-baby", "--set", "discount=0.8", "--turns", "2", stdin="f\nf\n"
    )
    assert "seed" not in result.stdout.splitlines()[0]
    arguments = result.stderr.splitlines()[-1].partition(": dmplay ")[2].split()
    assert arguments[:5] == ["crying-baby", "--set", "discount=0.8", "--turns", "2"]
    lines, lines_again = (
        [line for line in stdout.splitlines()[2:] if "record: " not in line]
        for stdout in (result.stdout, run_dmplay(tmp_path, *arguments, stdin="f\nf\n").stdout)
    )
    assert lines_again == lines


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hexwrold"], "unknown problem 'hexwrold'; did you mean hexworld?"),
        (["verfy", "x"], "unknown command 'verfy'; did you mean verify"),
        (["hexworld", "--sed", "3"], "no such option: --sed"),
        (["solve"], "missing argument 'PROBLEM'; see dmplay solve --help"),
        (["hexworld", "--sed", "7"], "no such option: --sed; did you mean --seed or --"),
        (["config", "shw"], "no such command 'shw'; did you mean show?"),
        (["hexworld", "--seed", "x"], "--seed: got 'x', expected a whole number"),
        (["hexworld", "--ghost", "--seed", "3"], "--ghost: got '--seed', expected a value; see"),
        (["hexworld", "a", "b"], "unexpected argument 'a b'; see dmplay play"),
        (["hexworld", "--seed", "-1"], "--seed: got -1, expected 0 to"),
        (
            ["hexworld", "--strict=hint"],
            "--strict: got 'hint', expected --strict or --strict=hints",
        ),
        (["hexworld", "--turns", "0"], "--turns: got 0, expected at least 1"),
        (["hexworld", "--vs", "random"], "--vs: hexworld has only one seat; use --agent"),
        (["hexworld", "--set", "slip"], "--set: got 'slip', expected NAME=VALUE"),
        (["hexworld", "--agent", "bst"], "unknown agent 'bst'"),
        (["hexworld", "--agent", "script:e,x"], "script action 2: unknown action 'x'"),
        (["hexworld", "--seat", "prey=random"], "unknown seat 'prey'; expected one of agent"),
        (["hexworld", "--color", "red"], "--color: unknown value 'red'; expected one of auto"),
        (["hexworld", "--width", "0"], "--width: got '0', expected a whole number of at least 1"),
        (["hexworld", "--seed"], "--seed: expected a value"),
        (["hexworld", "--quiet=1"], "--quiet: expected no value"),
        (["hexworld", "-o", "no/g.dmt"], "cannot write no/g.dmt: No such file or directory"),
        (["verify", "nothing.dmt"], "nothing.dmt: no such file or folder"),
        (["verify", "."], ".: no .dmt file in this folder"),
        (["replay", "nothing.dmt"], "nothing.dmt: No such file or directory"),
        (["resume", "nothing.dmt"], "nothing.dmt: No such file or directory"),
        (["resume"], "no unfinished game in "),
        (["info", "chess"], "unknown problem 'chess'"),
        (["info", "own.py"], "no such file: own.py"),
        (["cart-pole", "--rate", "x"], "--rate: got 'x', expected a number from 0.1 to 1000"),
        (["play", "cart-pole", "--rate", "fast"], "--rate: got 'fast', expected a number"),
        (["play", "--rate", "cart-pole", "x"], "unexpected argument 'x'"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(
    tmp_path: Path, arguments: list[str], message: str
) -> None:
    result = run_dmplay(tmp_path, *arguments)
    assert result.returncode == 2
    assert result.stderr.startswith(f"error: {message}")
    assert result.stderr.count("\n") == 1
    assert result.stdout == ""


@pytest.mark.parametrize(
    ("arguments", "player"),
    [
        ("catch --agent optimal --turns 3", "optimal:horizon=3"),
        ("catch --agent optimal:horizon=7 --turns 3", "optimal:horizon=7"),
        ("catch --agent optimal --turns 30", "optimal"),  # more throws than it can plan
        ("machine-replacement --agent qmdp --turns 30", "qmdp:horizon=30"),
        ("crying-baby --agent plan --turns 3", "plan"),  # plans only a few turns ahead
    ],
)
def test_an_agent_that_plans_whole_games_gets_the_turn_limit_as_its_horizon(
    arguments: str, player: str, tmp_path: Path
) -> None:
    run_dmplay(tmp_path, *arguments.split(), "--seed", "1", "-o", "g.dmt", "-q")
    assert f'seats: {{"agent": "{player}"}}\n' in (tmp_path / "g.dmt").read_text()
    assert run_dmplay(tmp_path, "verify", "g.dmt").returncode == 0


def test_the_error_for_a_number_out_of_bounds_states_the_bounds(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "travelers-dilemma", stdin="101\n")
    assert (
        "error: line 1: action: got '101', expected a whole number from 2 to 100\n" in result.stderr
    )
    result = run_dmplay(tmp_path, "catch", "--agent", "script:50,105")
    message = (
        "script action 2: action: got '105', expected a whole number from 10 to 100 in steps of 10"
    )
    assert result.stderr.startswith(f"error: {message}\n")
    result = run_dmplay(tmp_path, "simple-regulator", stdin="1_0\n")
    assert "error: line 1: action: got '1_0', expected a number from -10 to 10\n" in result.stderr


def test_a_file_that_is_not_a_transcript_fails_verification(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--agent", "optimal", "--turns", "1", "-o", "g.dmt", "-q")
    (tmp_path / "junk.dmt").write_text("no transcript\n")
    result = run_dmplay(tmp_path, "verify", "g.dmt", "junk.dmt")
    assert result.returncode == 3
    assert result.stdout.startswith("ok g.dmt (1 turn)\n")
    assert result.stdout.endswith("1 verified, 1 failed\n")


def test_a_transcript_that_differs_exits_with_3_and_is_named(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "g.dmt", "-q")
    path = tmp_path / "g.dmt"
    path.write_text(path.read_text().replace('"(8,1)"', '"(8,2)"'))
    result = run_dmplay(tmp_path, "verify", ".")
    assert result.returncode == 3
    assert result.stdout.startswith("g.dmt:13: turn 1: state: expected (8,2), got (8,1)\n")
    data = json.loads(run_dmplay(tmp_path, "verify", "g.dmt", "--json").stdout)
    assert data["ok"] is False
    assert data["findings"][0]["line"] == 13
    update_result = run_dmplay(tmp_path, "verify", "g.dmt", "--update")
    assert '-state: "(8,2)"\n+state: "(8,1)"' in update_result.stdout
    assert update_result.returncode == 0


def test_an_unfinished_file_is_accepted_only_with_its_option(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "g.dmt", "-q")
    path = tmp_path / "g.dmt"
    path.write_text(path.read_text().rpartition("end:")[0])
    assert run_dmplay(tmp_path, "verify", "g.dmt").returncode == 3
    result = run_dmplay(tmp_path, "verify", "g.dmt", "--allow-unfinished")
    assert (result.returncode, result.stdout) == (0, "ok g.dmt (3 turns, unfinished)\n1 verified\n")


def test_a_json_game_prints_one_object_per_line(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "crying-baby", "--seed", "7", "--turns", "2", "--json", stdin="i\ni\n"
    )
    events = [json.loads(line) for line in result.stdout.splitlines()]
    start, request, turn, _, _, end = events
    expected = ["start", "ask", "turn", "ask", "turn", "end"]
    assert [event["event"] for event in events] == expected
    legal = ["feed", "sing", "ignore"]
    assert request == {"event": "ask", "seat": "agent", "turn": 1, "legal": legal}
    for event in (start, request, turn):
        assert "state" not in event
        assert "rewards" not in event
    assert end["debrief"][1]["state"] == "hungry"
    assert end["total"] == {"agent": -20}


def test_a_json_game_reports_an_error_and_reads_the_next_line(tmp_path: Path) -> None:
    result = run_dmplay(
        tmp_path, "hexworld", "--seed", "7", "--json", stdin="fly\nhint\ne\nundo\nlook\n"
    )
    events = [json.loads(line) for line in result.stdout.splitlines()]
    request_turns = [event["turn"] for event in events if event["event"] == "ask"]
    assert (result.returncode, request_turns) == (0, [1, 1, 1, 2, 1, 1])
    error, hint, turn, undo, message = (event for event in events[1:-1] if event["event"] != "ask")
    error_text = "unknown action 'fly'; did you mean play?"
    assert error == {"event": "error", "line": 1, "text": error_text}
    assert (hint["seat"], hint["by"], hint["action"]) == ("agent", "optimal", "se")
    assert max(hint["values"], key=hint["values"].get) == "se"
    assert turn["actions"] == {"agent": "e"}
    assert undo == {"event": "undo", "turns": 1, "turn": 0, "state": events[0]["state"]}
    assert message["text"].startswith("at (7,2)")
    assert (events[-1]["event"], events[-1]["reason"]) == ("end", "quit")


def test_reveal_shows_the_hidden_state(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "crying-baby", "--seed", "7", "--reveal", stdin="state\nlook\n")
    assert "state: hungry\n" in result.stdout
    assert "hidden state: hungry." in result.stdout
    concealed_result = run_dmplay(tmp_path, "crying-baby", "--seed", "7", stdin="state\n")
    assert "state: hidden until the game is over, or with --reveal.\n" in concealed_result.stdout


def test_a_strict_game_refuses_undo(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", "--strict", stdin="e\nundo\n")
    assert result.returncode == 2
    assert "error: line 2: undo: this game is strict" in result.stderr


def test_a_game_without_a_file_is_saved_and_no_small_save_is_deleted(tmp_path: Path) -> None:
    folder = tmp_path / "state" / "dmplay" / "games"
    folder.mkdir(parents=True)
    for number in range(30):
        (folder / f"old{number:02}.dmt").write_text("turn: 1\n")
        os.utime(folder / f"old{number:02}.dmt", (number, number))
    run_dmplay(tmp_path, "hexworld", "--seed", "7", stdin="e\n")
    names = sorted(path.name for path in folder.iterdir())
    assert names == ["000001-hexworld.dmt", *(f"old{number:02}.dmt" for number in range(30))]


def test_a_state_folder_that_cannot_be_written_causes_one_warning(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", stdin="e\n")
    assert result.returncode == 0
    assert result.stderr.count("warning: this game is not saved") == 1


def test_replay_prints_the_game_again(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nundo\nw\n")
    result = run_dmplay(tmp_path, "replay", "g.dmt")
    assert result.returncode == 0
    assert "turn 2. chose NE, bumped, stayed at (8,2)." in result.stdout
    assert result.stdout.splitlines()[-1].startswith("over: quit after 2 turns.")


def test_replayed_and_scripted_seats_play_the_same_game(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nw\n")
    (tmp_path / "moves.txt").write_text("e  # first\nne, w\n")
    replay = run_dmplay(tmp_path, "hexworld", "--seed", "7", "--agent", "replay:g.dmt")
    script = run_dmplay(tmp_path, "hexworld", "--seed", "7", "--agent", "script:moves.txt")
    assert replay.stdout.splitlines()[1:] == script.stdout.splitlines()[1:]
    assert "over: quit after 3 turns." in script.stdout


@pytest.mark.parametrize("command", COMMANDS_WITH_EXAMPLES)
def test_every_command_has_help_with_examples(tmp_path: Path, command: str) -> None:
    for flag in ("--help", "-h"):
        result = run_dmplay(tmp_path, command, flag)
        assert result.returncode == 0
        assert "env var" not in result.stdout
        assert f"dmplay {command}" in result.stdout.partition("Options")[0]


def test_no_sentence_of_a_command_list_is_cut_or_wrapped(tmp_path: Path) -> None:
    for arguments in ([], ["learn"], ["config"]):
        text = run_dmplay(tmp_path, *arguments, "--help").stdout.partition("Commands:\n")[2]
        assert text.strip()
        assert all(row.endswith(".") and "..." not in row for row in text.splitlines())


def test_subcommands_hide_their_environment_variables_and_useless_options(tmp_path: Path) -> None:
    text = run_dmplay(tmp_path, "learn", "puzzle", "--help").stdout
    assert "--no-input" in text
    assert "env var" not in text
    assert "--motion" not in text


def test_the_help_command_equals_the_help_option(tmp_path: Path) -> None:
    for arguments, options in ((["help"], ["--help"]), (["help", "verify"], ["verify", "--help"])):
        result = run_dmplay(tmp_path, *arguments)
        assert (result.returncode, result.stdout) == (0, run_dmplay(tmp_path, *options).stdout)


def test_no_arguments_without_a_terminal_print_help_on_the_error_stream(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path)
    assert (result.returncode, result.stdout) == (2, "")
    assert "dmplay hexworld" in result.stderr
    assert "env var" not in result.stderr


def test_the_version_is_printed(tmp_path: Path) -> None:
    from dmplay import __version__

    for arguments in (["--version"], ["--version", "please"]):
        assert run_dmplay(tmp_path, *arguments).stdout == f"dmplay {__version__}\n"


@pytest.mark.slow
def test_info_and_list_print_json(tmp_path: Path) -> None:
    problems = json.loads(run_dmplay(tmp_path, "list", "--json").stdout)["problems"]
    assert {"problem", "kind", "states", "discount"} <= set(problems[0])
    for problem in problems:
        info = json.loads(run_dmplay(tmp_path, "info", problem["problem"], "--json").stdout)
        assert info["kind"] == problem["kind"]
        assert "Source: " in info["about"]


def test_an_internal_error_prints_one_line_and_writes_a_log(tmp_path: Path) -> None:
    arguments = ("hexworld", "--agent", "./broken.py:Agent", "--seed", "1")
    (tmp_path / "broken.py").write_text(BROKEN_AGENT_SOURCE)
    result = run_dmplay(tmp_path, *arguments, TMPDIR=str(tmp_path))
    assert result.returncode == 1
    assert result.stderr.startswith("error: unexpected TypeError; ")
    (log,) = tmp_path.glob("dmplay-*.log")
    assert "session.py" in log.read_text()
    debug_result = run_dmplay(tmp_path, *arguments, "--debug")
    assert "Traceback" in debug_result.stderr


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("raise ZeroDivisionError('inside')\n", "broken.py:1: ZeroDivisionError: inside"),
        ("import dmplay\nimport nothing_such\n", "broken.py:2: ModuleNotFoundError: No module"),
        ("Game = 1\ndef f(:\n", "broken.py:2: invalid syntax"),
    ],
)
def test_an_error_in_a_user_defined_problem_is_reported_with_its_line(
    tmp_path: Path, code: str, message: str
) -> None:
    (tmp_path / "broken.py").write_text(code)
    result = run_dmplay(tmp_path, "./broken.py:Game")
    assert result.returncode == 2
    assert message in result.stderr
    assert result.stderr.count("\n") == 1


def test_an_agent_that_ends_the_program_is_reported_with_its_line(tmp_path: Path) -> None:
    code = ["import sys", "from dmplay.agents.random_agent import Random", "class Agent(Random):"]
    code += ["    def choose(self, memory, legal, u):", "        sys.exit()", ""]
    (tmp_path / "leaver.py").write_text("\n".join(code))
    result = run_dmplay(tmp_path, "run", "hexworld", "--agent", "./leaver.py:Agent")
    assert result.returncode == 2
    message = "error: ./leaver.py:5: SystemExit; user code must not exit the program\n"
    assert result.stderr == message


def test_each_of_two_players_sees_only_its_own_observations(tmp_path: Path) -> None:
    arguments = ("multicaregiver-crying-baby", "--vs", "human", "--seed", "3")
    output = run_dmplay(tmp_path, *arguments, stdin="feed\nsing\n").stdout
    for seat, other, action, belief in (
        ("caregiver1", "caregiver2", "feed", "sated 1.000, hungry 0.000"),
        ("caregiver2", "caregiver1", "sing", "sated 0.909, hungry 0.091"),
    ):
        is_certain = "1.000" in belief
        model = "" if is_certain else f" as if {other} acted at random"
        row = f"{seat} turn 1. chose {action}, heard quiet. belief{model}: "
        assert f"{row}{belief}. you do not see what {other} did.\n" in output
    events = map(
        json.loads,
        run_dmplay(tmp_path, *arguments, "--json", stdin="feed\nsing\n").stdout.split("\n")[:-1],
    )
    turns = [event["actions"] for event in events if event["event"] == "turn"]
    assert turns == [{"caregiver1": "feed"}, {"caregiver2": "sing"}]


def test_a_dash_is_the_standard_input_or_output(tmp_path: Path) -> None:
    arguments = ("hexworld", "--agent", "optimal", "--seed", "7", "--quiet", "-o")
    transcript = run_dmplay(tmp_path, *arguments, "-").stdout
    run_dmplay(tmp_path, *arguments, "game.dmt")
    assert transcript == (tmp_path / "game.dmt").read_text()
    assert not (tmp_path / "-").exists()
    for command in ("verify", "replay"):
        assert run_dmplay(tmp_path, command, "-", stdin=transcript).returncode == 0
    damaged = transcript.replace("turn: 1", "turn: 2", 1)
    assert run_dmplay(tmp_path, "verify", "-", stdin=damaged).returncode == 3


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["hexworld", "-o", "-"], "-o -: expected --quiet too, because the game also prints there"),
        (["verify", "--update", "-"], "--update: standard input cannot be rewritten"),
    ],
)
def test_a_dash_that_makes_no_sense_is_refused(
    arguments: list[str], message: str, tmp_path: Path
) -> None:
    result = run_dmplay(tmp_path, *arguments, stdin="")
    assert (result.returncode, result.stderr) == (2, f"error: {message}\n")


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be a user without a name")
@pytest.mark.parametrize(
    ("arguments", "stdin"),
    [
        (("list",), ""), (("config", "path"), ""), (("solve", "crying-baby"), ""),
        (("info", "hexworld"), ""), (("resume",), ""), (("hexworld", "--seed", "7"), "e\n"),
        (("shell",), "play hexworld --seed 7\ne\nnew\n"),
    ],
)  # fmt: skip
def test_a_user_without_a_home_can_run_everything_and_is_warned_once(
    arguments: tuple[str, ...], stdin: str
) -> None:
    result = run_without_home(*arguments, stdin=stdin)
    warning = "warning: this game is not saved: no home folder; set HOME\n" if stdin else ""
    error = "no unfinished game in" if arguments == ("resume",) else ""
    assert result.stderr.count(warning) == 1 or not warning
    assert result.returncode == (2 if error else 0), result.stderr
    assert error in result.stderr


def test_an_agent_that_would_be_ignored_is_an_error(tmp_path: Path) -> None:
    result = run_dmplay(tmp_path, "run", "hexworld", "--agent", "optimal", "--agent=random")
    assert result.returncode == 2
    assert result.stderr.startswith("error: --agent: got 2, expected one; --seat NAME=AGENT sets")
    for command, option in (
        ("plot returns hexworld --compare random --compare optimal", "--compare"),
        ("run hexworld --seed 1 --seed=2", "--seed"),
        ("solve hexworld -V standard --variant straight-line", "--variant"),
    ):
        result = run_dmplay(tmp_path, *command.split())
        assert result.returncode == 2
        assert result.stderr.startswith(f"error: {option}: got 2, expected one; ")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--seat", "agent1=grim", "--seat=agent1=tit-for-tat"), "--seat: got agent1 2 times"),
        (("--set", "discount=0.9", "--set", "discount=0.8"), "--set: got discount 2 times"),
    ],
)
def test_a_setting_that_would_be_ignored_is_an_error(
    tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    result = run_dmplay(tmp_path, "run", "prisoners-dilemma", *words, "--episodes", "2")
    assert result.returncode == 2
    assert result.stderr == f"error: {message}, expected each name once\n"


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("run", "hexworld", "--agent", "optimal", "--seat", "agent=random"), "--agent: --seat"),
        (("hexworld", "--seat", "agent=random", "--agent", "optimal"), "--agent: --seat"),
        (
            ("assign", "hexworld", "--agent=random", "--seat=agent=human", "-o", "x"),
            "--agent: --se",
        ),
        (("prisoners-dilemma", "--vs", "grim", "--seat", "agent2=random"), "--vs: --seat also set"),
    ],
)
def test_an_agent_without_a_seat_is_an_error(
    tmp_path: Path, words: tuple[str, ...], message: str
) -> None:
    result = run_dmplay(tmp_path, *words)
    assert (result.returncode, result.stderr.startswith(f"error: {message}")) == (2, True)
    assert result.stderr.endswith("; leave out one of the options\n")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("hexworld", "-o", ""), "--record: got an empty path, expected FILE"),
        (("run", "hexworld", "--record="), "--record: got an empty path, expected DIR"),
        (("verify", "games", ""), "PATH: got an empty path, expected PATH"),
        (("replay", ""), "FILE: got an empty path, expected FILE"),
        (("learn", "from", ""), "GAME: got an empty path, expected GAME"),
    ],
)
def test_an_empty_path_is_an_error(tmp_path: Path, words: tuple[str, ...], message: str) -> None:
    result = run_dmplay(tmp_path, *words)
    assert (result.returncode, result.stderr) == (2, f"error: {message}\n")


def test_a_problem_may_follow_two_hyphens(tmp_path: Path) -> None:
    for words in (["hexworld", "--agent", "random", "--seed", "1"], ["list"], ["guide", "mcp"]):
        expected = run_dmplay(tmp_path, *words)
        result = run_dmplay(tmp_path, "--", *words)
        assert expected.returncode == 0
        assert (result.returncode, result.stdout) == (0, expected.stdout)
    assert "unknown problem 'hexword'" in run_dmplay(tmp_path, "--", "hexword").stderr


def test_a_zip_archive_is_refused_with_a_reason(tmp_path: Path) -> None:
    package = Path(dmplay.__file__).parent
    with zipfile.ZipFile(tmp_path / "d.pyz", "w") as archive:
        archive.writestr("__main__.py", "from dmplay.__main__ import main\nmain()\n")
        for path in package.rglob("*.py"):
            archive.write(path, path.relative_to(package.parent))
    for words in (["hexworld"], ["learn"], ["list"], ["guide"], []):
        program = subprocess.run(
            [sys.executable, "d.pyz", *words], stdin=subprocess.DEVNULL, capture_output=True,
            text=True, cwd=tmp_path, env=clean_environment(tmp_path), check=False,
        )  # fmt: skip
        assert program.returncode == 2
        assert program.stderr.startswith("error: dmplay cannot run from a zip archive; ")
        assert program.stdout == ""
