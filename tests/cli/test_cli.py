"""The command line as a user types it: exit codes, one line an error, what is printed where."""

import json
import os
from pathlib import Path

import pytest

from dmplay.cli.sentence import format_error
from dmplay.errors import BadParameter
from tests.support.brought import NO_AGENT, WALK
from tests.support.programs import homeless, run

WORDS = (
    "play", "resume", "replay", "verify", "list", "info",
)  # fmt: skip


MANY = "9" * 5000


@pytest.mark.parametrize(
    ("words", "stdin", "message"),
    [
        (["hexworld", "--agent", "../1.:"], "", "error: no module '../1.' for '../1.:'"),
        (["hexworld", "--agent", ".a:b"], "", "error: no module '.a' for '.a:b'"),
        (["hexworld", "--seed", "7"], f"e\nundo {MANY}\n", "error: line 2: undo: got '9"),
        (["hexworld"], f"seed {MANY}\n", "error: line 1: seed: got '9"),
        (["shell"], "load a\0b\n", "error: line 1: got 'load a\\x00b', expected text"),
        (["hexworld"], "agent agent replay:a\0b\n", "error: line 1: got 'agent agent replay:a"),
        (["-e", "save \ud800"], "", "error: command 1: got 'save \\ud800', expected text"),
        (["predator-prey", "--set", f"predators={MANY[:400]}"], "", "error: predators: got '9"),
    ],
)
def test_what_cannot_be_meant_is_one_line(
    words: list[str], stdin: str, message: str, tmp_path: Path
) -> None:
    done = run(tmp_path, *words, stdin=stdin)
    assert (done.returncode, done.stderr.count(message)) == (2, 1)
    assert "unexpected" not in done.stderr


def test_the_middle_of_a_very_long_error_is_left_out() -> None:
    told = format_error(BadParameter("a" * 5000 + "z" * 5000))
    assert told == "a" * 1000 + " ... " + "z" * 1000


@pytest.mark.parametrize(
    "env",
    [
        {"COLUMNS": MANY},
        {"_DMPLAY_COMPLETE": "complete_bash", "COMP_WORDS": "dmplay", "COMP_CWORD": "x"},
    ],
)
def test_a_variable_that_is_no_number_is_passed_over(env: dict[str, str], tmp_path: Path) -> None:
    done = run(tmp_path, "list", **env)
    assert (done.returncode, done.stderr) == (0, "")


@pytest.mark.parametrize("word", ["tournament.nfg", "runs:Walk"])
def test_a_problem_that_is_named_like_a_command_plays_alone_and_in_the_shell(
    word: str, tmp_path: Path
) -> None:
    (tmp_path / "tournament.nfg").write_text('NFG 1 R "" {"a" "b"} {2 2} 1 1 0 0 0 0 1 1')
    (tmp_path / "runs.py").write_text(WALK)
    assert run(tmp_path, word, "-q", "--agent", "random", "--turns", "1").returncode == 0
    done = run(tmp_path, "-e", f"{word} --seed 1", "-e", "quit")
    assert done.stdout.startswith(f"new game of {word}, seed 1.\n")


def test_a_piped_game_is_played_told_and_recorded(tmp_path: Path) -> None:
    done = run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nquit\n")
    assert done.returncode == 0
    assert "turn 1. at (8,2). chose E, moved E. reward 0. score 0.\n" in done.stdout
    assert done.stderr == "transcript: g.dmt\nreplay: dmplay replay g.dmt\n"
    assert (
        run(tmp_path, "verify", "g.dmt").stdout
        == "ok g.dmt (2 turns; not re-asked: human)\n1 verified\n"
    )


def test_a_recording_tells_a_reroll_as_the_turn_that_came_of_it(tmp_path: Path) -> None:
    run(tmp_path, "2048", "--seed", "7", "-o", "g.dmt", stdin="left\nreroll\nundo\nup\n")
    told = run(tmp_path, "replay", "g.dmt").stdout.splitlines()
    assert [row.partition(". ")[0] for row in told[1:-1]] == [
        "turn 1", "turn 1, under other dice", "undone", "turn 1, under other dice",
    ]  # fmt: skip
    assert told[3] == "undone. turn 0."
    text = run(tmp_path, "export", "g.dmt", "--text").stdout
    assert text.count("turn 1, under other dice. slid left.") == 3
    assert "undone. turn 0.\n turn 1, under other dice. slid up." in text


def test_the_end_of_input_is_a_clean_end(tmp_path: Path) -> None:
    done = run(tmp_path, "2048", "--seed", "7", stdin="")
    assert done.returncode == 0
    assert "over: quit after 0 turns." in done.stdout


def test_an_action_that_cannot_be_done_in_a_pipe_ends_with_2_and_keeps_the_turns(
    tmp_path: Path,
) -> None:
    done = run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\n# a note\nnee\ne\n")
    assert done.returncode == 2
    assert done.stderr.endswith("error: line 3: unknown action 'nee'; did you mean ne or e?\n")
    text = (tmp_path / "g.dmt").read_text()
    assert "turn: 1\n" in text
    assert '"reason": "illegal"' in text
    assert run(tmp_path, "verify", "g.dmt").returncode == 0
    slid = run(tmp_path, "2048", "--seed", "5", stdin="look\ndown\n")
    assert slid.returncode == 2
    assert "error: line 2: turn 1, agent: down is not legal now" in slid.stderr


def test_the_seed_is_told_with_the_command_that_plays_again(tmp_path: Path) -> None:
    done = run(tmp_path, "crying-baby", "--set", "discount=0.8", "--turns", "2", stdin="f\nf\n")
    assert "seed" not in done.stdout.splitlines()[0]
    again = done.stderr.splitlines()[-1].removeprefix("again: dmplay ").split()
    assert again[:5] == ["crying-baby", "--set", "discount=0.8", "--turns", "2"]
    assert (
        run(tmp_path, *again, stdin="f\nf\n").stdout.splitlines()[2:]
        == (done.stdout.splitlines()[2:])
    )


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["hexwrold"], "unknown problem 'hexwrold'; did you mean hexworld?"),
        (["verfy", "x"], "unknown command 'verfy'; did you mean verify"),
        (["hexworld", "--sed", "3"], "no such option: --sed"),
        (["solve"], "missing argument 'PROBLEM'; see dmplay solve --help"),
        (["hexworld", "--sed", "7"], "no such option: --sed; did you mean --seed or --"),
        (["config", "shw"], "no such command 'shw'; did you mean show?"),
        (["hexworld", "--seed", "x"], "invalid value for '--seed'"),
        (["hexworld", "--ghost", "--seed", "3"], "--ghost: got '--seed', expected a value; see"),
        (["hexworld", "a", "b"], "got 'a b' besides, expected no more words; see dmplay play"),
        (["hexworld", "--seed", "-1"], "--seed: got -1, expected 0 to"),
        (
            ["hexworld", "--strict=hint"],
            "--strict: got 'hint', expected --strict or --strict=hints",
        ),
        (["hexworld", "--turns", "0"], "--turns: got 0, expected at least 1"),
        (["hexworld", "--vs", "random"], "--vs: hexworld has one seat only; use --agent"),
        (["hexworld", "--set", "slip"], "--set: got 'slip', expected NAME=VALUE"),
        (["hexworld", "--agent", "bst"], "unknown agent 'bst'"),
        (["hexworld", "--agent", "script:e,x"], "script action 2: unknown action 'x'"),
        (["hexworld", "--seat", "prey=random"], "unknown seat 'prey'; expected one of agent"),
        (["hexworld", "--color", "red"], "invalid value for '--color': 'red' is not one of 'auto'"),
        (["hexworld", "--width", "x"], "invalid value for '--width': 'x' is not a whole number"),
        (["hexworld", "--width", "0"], "invalid value for '--width': 0 is not in the range"),
        (["hexworld", "-o", "no/g.dmt"], "cannot write no/g.dmt: No such file or directory"),
        (["verify", "nothing.dmt"], "nothing.dmt: no such file or folder"),
        (["verify", "."], ".: no .dmt file in this folder"),
        (["replay", "nothing.dmt"], "nothing.dmt: No such file or directory"),
        (["resume", "nothing.dmt"], "nothing.dmt: No such file or directory"),
        (["resume"], "no unfinished game in "),
        (["info", "chess"], "unknown problem 'chess'"),
        (["info", "own.py"], "no such file: own.py"),
    ],
)
def test_bad_input_is_one_clear_line_and_exit_code_2(
    tmp_path: Path, words: list[str], message: str
) -> None:
    done = run(tmp_path, *words)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {message}")
    assert done.stderr.count("\n") == 1
    assert done.stdout == ""


@pytest.mark.parametrize(
    ("words", "seated"),
    [
        ("catch --agent optimal --turns 3", "optimal:horizon=3"),
        ("catch --agent optimal:horizon=7 --turns 3", "optimal:horizon=7"),
        ("catch --agent optimal --turns 30", "optimal"),  # more throws than it can plan
        ("machine-replacement --agent qmdp --turns 30", "qmdp:horizon=30"),
        ("crying-baby --agent plan --turns 3", "plan"),  # which only looks ahead
    ],
)
def test_who_plans_a_whole_game_plans_this_one(words: str, seated: str, tmp_path: Path) -> None:
    run(tmp_path, *words.split(), "--seed", "1", "-o", "g.dmt", "-q")
    assert f'seats: {{"agent": "{seated}"}}\n' in (tmp_path / "g.dmt").read_text()
    assert run(tmp_path, "verify", "g.dmt").returncode == 0


def test_a_number_that_is_no_action_is_told_the_bounds(tmp_path: Path) -> None:
    done = run(tmp_path, "travelers-dilemma", stdin="101\n")
    assert (
        "error: line 1: action: got '101', expected a whole number from 2 to 100\n" in done.stderr
    )
    done = run(tmp_path, "catch", "--agent", "script:50,105")
    told = (
        "script action 2: action: got '105', expected a whole number from 10 to 100 in steps of 10"
    )
    assert done.stderr.startswith(f"error: {told}\n")
    done = run(tmp_path, "simple-regulator", stdin="1_0\n")
    assert "error: line 1: action: got '1_0', expected a number from -10 to 10\n" in done.stderr


def test_only_files_that_hold_are_verified(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--agent", "optimal", "--turns", "1", "-o", "g.dmt", "-q")
    (tmp_path / "junk.dmt").write_text("no transcript\n")
    done = run(tmp_path, "verify", "g.dmt", "junk.dmt")
    assert done.returncode == 3
    assert done.stdout.startswith("ok g.dmt (1 turn)\n")
    assert done.stdout.endswith("1 verified, 1 failed\n")


def test_a_transcript_that_differs_ends_with_3_and_is_named(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "g.dmt", "-q")
    path = tmp_path / "g.dmt"
    path.write_text(path.read_text().replace('"(8,1)"', '"(8,2)"'))
    done = run(tmp_path, "verify", ".")
    assert done.returncode == 3
    assert done.stdout.startswith("g.dmt:13: turn 1: state: expected (8,2), got (8,1)\n")
    data = json.loads(run(tmp_path, "verify", "g.dmt", "--json").stdout)
    assert data["ok"] is False
    assert data["findings"][0]["line"] == 13
    told = run(tmp_path, "verify", "g.dmt", "--update")
    assert '-state: "(8,2)"\n+state: "(8,1)"' in told.stdout
    assert told.returncode == 0


def test_an_unfinished_file_is_allowed_only_when_asked(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "g.dmt", "-q")
    path = tmp_path / "g.dmt"
    path.write_text(path.read_text().rpartition("end:")[0])
    assert run(tmp_path, "verify", "g.dmt").returncode == 3
    done = run(tmp_path, "verify", "g.dmt", "--allow-unfinished")
    assert (done.returncode, done.stdout) == (0, "ok g.dmt (3 turns, unfinished)\n1 verified\n")


def test_a_game_of_data_is_one_object_a_line(tmp_path: Path) -> None:
    done = run(tmp_path, "crying-baby", "--seed", "7", "--turns", "2", "--json", stdin="i\ni\n")
    told = [json.loads(line) for line in done.stdout.splitlines()]
    start, asked, turn, _, _, end = told
    every = ["start", "ask", "turn", "ask", "turn", "end"]
    assert [one["event"] for one in told] == every
    legal = ["feed", "sing", "ignore"]
    assert asked == {"event": "ask", "seat": "agent", "turn": 1, "legal": legal}
    for one in (start, asked, turn):
        assert "state" not in one
        assert "rewards" not in one
    assert end["debrief"][1]["state"] == "hungry"
    assert end["total"] == {"agent": -20}


def test_as_data_what_cannot_be_done_is_told_and_the_next_line_read(tmp_path: Path) -> None:
    done = run(tmp_path, "hexworld", "--seed", "7", "--json", stdin="fly\nhint\ne\nundo\nlook\n")
    told = [json.loads(line) for line in done.stdout.splitlines()]
    asked = [one["turn"] for one in told if one["event"] == "ask"]
    assert (done.returncode, asked) == (0, [1, 1, 1, 2, 1, 1])
    fault, hint, turn, undo, words = (one for one in told[1:-1] if one["event"] != "ask")
    wrong = "unknown action 'fly'; did you mean play?"
    assert fault == {"event": "error", "line": 1, "text": wrong}
    assert (hint["seat"], hint["by"], hint["action"]) == ("agent", "optimal", "se")
    assert max(hint["values"], key=hint["values"].get) == "se"
    assert turn["actions"] == {"agent": "e"}
    assert undo == {"event": "undo", "turns": 1, "turn": 0, "state": told[0]["state"]}
    assert words["text"].startswith("at (7,2)")
    assert (told[-1]["event"], told[-1]["reason"]) == ("end", "quit")


def test_reveal_shows_what_is_hidden(tmp_path: Path) -> None:
    done = run(tmp_path, "crying-baby", "--seed", "7", "--reveal", stdin="state\nlook\n")
    assert "state: hungry\n" in done.stdout
    assert "truly hungry." in done.stdout
    hidden = run(tmp_path, "crying-baby", "--seed", "7", stdin="state\n")
    assert "state: hidden until the game is over, or with --reveal.\n" in hidden.stdout


def test_a_strict_game_takes_nothing_back(tmp_path: Path) -> None:
    done = run(tmp_path, "hexworld", "--seed", "7", "--strict", stdin="e\nundo\n")
    assert done.returncode == 2
    assert "error: line 2: undo: this game is strict" in done.stderr


def test_a_game_without_a_file_is_kept_and_the_last_twenty_stay(tmp_path: Path) -> None:
    kept = tmp_path / "state" / "dmplay" / "games"
    kept.mkdir(parents=True)
    for number in range(30):
        (kept / f"old{number:02}.dmt").write_text("turn: 1\n")
        os.utime(kept / f"old{number:02}.dmt", (number, number))
    run(tmp_path, "hexworld", "--seed", "7", stdin="e\n")
    names = sorted(path.name for path in kept.iterdir())
    assert len(names) == 20
    assert names[-1] == "old29.dmt"
    assert "old10.dmt" not in names


def test_a_state_folder_that_cannot_be_written_is_one_warning(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file")
    done = run(tmp_path, "hexworld", "--seed", "7", stdin="e\n")
    assert done.returncode == 0
    assert done.stderr.count("warning: this game is not kept") == 1


def test_replay_tells_the_game_again(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nundo\nw\n")
    done = run(tmp_path, "replay", "g.dmt")
    assert done.returncode == 0
    assert "turn 2. at (8,2). chose NE, bumped, stayed." in done.stdout
    assert done.stdout.splitlines()[-1].startswith("over: quit after 2 turns.")


def test_replayed_and_scripted_seats_do_the_same_again(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nw\n")
    (tmp_path / "moves.txt").write_text("e  # first\nne, w\n")
    again = run(tmp_path, "hexworld", "--seed", "7", "--agent", "replay:g.dmt")
    script = run(tmp_path, "hexworld", "--seed", "7", "--agent", "script:moves.txt")
    assert again.stdout.splitlines()[1:] == script.stdout.splitlines()[1:]
    assert "over: quit after 3 turns." in script.stdout


@pytest.mark.parametrize("command", WORDS)
def test_every_command_has_help_with_examples(tmp_path: Path, command: str) -> None:
    for flag in ("--help", "-h"):
        done = run(tmp_path, command, flag)
        assert done.returncode == 0
        assert "env var" not in done.stdout
        assert f"dmplay {command}" in done.stdout.partition("Options")[0]


def test_help_is_asked_for_by_its_word_too(tmp_path: Path) -> None:
    for words, asked in ((["help"], ["--help"]), (["help", "verify"], ["verify", "--help"])):
        done = run(tmp_path, *words)
        assert (done.returncode, done.stdout) == (0, run(tmp_path, *asked).stdout)


def test_no_words_off_a_terminal_is_help_on_the_error_stream(tmp_path: Path) -> None:
    done = run(tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "dmplay hexworld" in done.stderr
    assert "env var" not in done.stderr


def test_version_is_told(tmp_path: Path) -> None:
    from dmplay import __version__

    for words in (["--version"], ["--version", "please"]):
        assert run(tmp_path, *words).stdout == f"dmplay {__version__}\n"


@pytest.mark.slow
def test_info_and_list_are_data_too(tmp_path: Path) -> None:
    listed = json.loads(run(tmp_path, "list", "--json").stdout)
    assert {"problem", "kind", "states", "discount"} <= set(listed[0])
    for one in listed:
        about = json.loads(run(tmp_path, "info", one["problem"], "--json").stdout)
        assert about["kind"] == one["kind"]
        assert "Source: appendix F" in about["about"]


def test_a_fault_of_our_own_is_one_line_and_a_file(tmp_path: Path) -> None:
    words = ("hexworld", "--agent", "./broken.py:Agent", "--seed", "1")
    (tmp_path / "broken.py").write_text(NO_AGENT)
    done = run(tmp_path, *words, TMPDIR=str(tmp_path))
    assert done.returncode == 1
    assert done.stderr.startswith("error: unexpected TypeError; ")
    (log,) = tmp_path.glob("dmplay-*.log")
    assert "session.py" in log.read_text()
    shown = run(tmp_path, *words, "--debug")
    assert "Traceback" in shown.stderr


@pytest.mark.parametrize(
    ("code", "told"),
    [
        ("raise ZeroDivisionError('inside')\n", "broken.py:1: ZeroDivisionError: inside"),
        ("import dmplay\nimport nothing_such\n", "broken.py:2: ModuleNotFoundError: No module"),
        ("Game = 1\ndef f(:\n", "broken.py:2: invalid syntax"),
    ],
)
def test_a_fault_of_what_is_brought_is_told_with_its_line(
    tmp_path: Path, code: str, told: str
) -> None:
    (tmp_path / "broken.py").write_text(code)
    done = run(tmp_path, "./broken.py:Game")
    assert done.returncode == 2
    assert told in done.stderr
    assert done.stderr.count("\n") == 1


def test_an_agent_that_ends_the_program_is_told_with_its_line(tmp_path: Path) -> None:
    code = ["import sys", "from dmplay.policies.general import Random", "class Agent(Random):"]
    code += ["    def choose(self, memory, legal, u):", "        sys.exit()", ""]
    (tmp_path / "leaver.py").write_text("\n".join(code))
    done = run(tmp_path, "run", "hexworld", "--agent", "./leaver.py:Agent")
    assert done.returncode == 2
    told = "error: ./leaver.py:5: SystemExit; only dmplay may end the program\n"
    assert done.stderr == told


def test_two_who_hear_different_things_are_each_told_their_own(tmp_path: Path) -> None:
    words = ("multicaregiver-crying-baby", "--vs", "human", "--seed", "3")
    told = run(tmp_path, *words, stdin="feed\nsing\n").stdout
    assert "caregiver1 turn 1. quiet. chose feed. belief: sated 1.000, hungry 0.000.\n" in told
    assert "caregiver2 turn 1. quiet. chose sing. belief: sated 0.909, hungry 0.091.\n" in told
    events = map(
        json.loads, run(tmp_path, *words, "--json", stdin="feed\nsing\n").stdout.split("\n")[:-1]
    )
    turns = [event["actions"] for event in events if event["event"] == "turn"]
    assert turns == [{"caregiver1": "feed"}, {"caregiver2": "sing"}]


def test_a_dash_is_the_standard_input_or_output(tmp_path: Path) -> None:
    game = ("hexworld", "--agent", "optimal", "--seed", "7", "--quiet", "-o")
    piped = run(tmp_path, *game, "-").stdout
    run(tmp_path, *game, "game.dmt")
    assert piped == (tmp_path / "game.dmt").read_text()
    assert not (tmp_path / "-").exists()
    for command in ("verify", "replay"):
        assert run(tmp_path, command, "-", stdin=piped).returncode == 0
    torn = piped.replace("turn: 1", "turn: 2", 1)
    assert run(tmp_path, "verify", "-", stdin=torn).returncode == 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["hexworld", "-o", "-"], "-o -: only with --quiet; else the game itself is told there"),
        (["verify", "--update", "-"], "--update: the standard input cannot be rewritten"),
    ],
)
def test_a_dash_that_makes_no_sense_is_refused(
    words: list[str], message: str, tmp_path: Path
) -> None:
    done = run(tmp_path, *words, stdin="")
    assert (done.returncode, done.stderr) == (2, f"error: {message}\n")


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be a user without a name")
@pytest.mark.parametrize(
    ("words", "typed"),
    [
        (("list",), ""), (("config", "path"), ""), (("solve", "crying-baby"), ""),
        (("info", "hexworld"), ""), (("resume",), ""), (("hexworld", "--seed", "7"), "e\n"),
        (("shell",), "play hexworld --seed 7\ne\nnew\n"),
    ],
)  # fmt: skip
def test_who_has_no_home_can_do_all_and_is_warned_once(words: tuple[str, ...], typed: str) -> None:
    done = homeless(*words, stdin=typed)
    kept = "warning: this game is not kept: no home; set HOME\n" if typed else ""
    lost = "no unfinished game in" if words == ("resume",) else ""
    assert done.stderr.count(kept) == 1 or not kept
    assert done.returncode == (2 if lost else 0), done.stderr
    assert lost in done.stderr
