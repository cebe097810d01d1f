"""Tests of games that are to be handed in: who leaves one pauses it, and nothing ends it early."""

import json
import signal
from pathlib import Path

import pytest

from dmplay.errors import BadParameter
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import format_resume_command, start_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.ui.shell.commands import run_line
from tests.support.games import assert_verified, read_values
from tests.support.programs import run_dmplay
from tests.support.terminals import Terminal

PLAY = ("play", "--assignment", "baby", "--player", "Max")
HIDDEN_WORDS = ("turn 0. state", "reward -", "return", "debrief", "seed")


@pytest.fixture(autouse=True)
def assignment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write an assignment of two strict games of three turns; return its folder."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    run_dmplay(
        tmp_path,
        *[
            "assign",
            "crying-baby",
            "--seeds",
            "8,9",
            "--strict-hints",
            "--turns",
            "3",
            "-o",
            "baby",
        ],
    )
    return tmp_path


def start_assigned_game(**options: object) -> GameController:
    """Start a game of the crying baby that is to be handed in, and play its first turn."""
    defaults: dict[str, object] = {
        "problem": "crying-baby",
        "seed": 8,
        "player": "Max",
        "is_handed_in": True,
        "record_path": Path("max.dmt"),
    }
    request = GameRequest(**{**defaults, **options})  # type: ignore[arg-type]
    controller = GameController(start_new_game(request))
    controller.game.choose(1)
    return controller


def resume(controller: GameController, path: str = "max.dmt") -> Game:
    """Resume a game in the same sitting; return it."""
    controller.set_game(start_game(ResumeRequest(Path(path)), controller._list_known_games))
    return controller.game


def test_q_pauses_an_assigned_game_and_the_same_command_resumes_it(assignment: Path) -> None:
    with Terminal(*PLAY, folder=assignment) as terminal:
        terminal.until("heard  nothing yet").ready().press("i", "turn 1/3").press("q")
        assert terminal.ended() == 0
        assert "paused after 1 turn." in terminal.printed
        assert "resume: dmplay resume max-8.dmt" in terminal.printed
    with Terminal(*PLAY, folder=assignment) as terminal:
        terminal.until("turn 1/3").ready().press("ff", "over: the baby went hungry for ").press("q")
        assert terminal.ended() == 0
    end_line = read_values(assert_verified(assignment / "max-8.dmt"), "end")[0]
    assert '"reason": "turn limit", "turns": 3' in end_line
    assert not (assignment / "max-9.dmt").exists()


def test_keys_that_start_another_game_pause_the_assigned_one(assignment: Path) -> None:
    with Terminal(*PLAY, folder=assignment) as terminal:
        terminal.until("heard  nothing yet").ready().press("i", "turn 1/3").press("N", "turn 0/3")
        terminal.press("q")
        assert terminal.ended() == 0
    assert '"reason": "interrupted"' in (assignment / "max-8.dmt").read_text()


def test_a_hang_up_uses_nothing_up(assignment: Path) -> None:
    with Terminal(*PLAY, folder=assignment) as terminal:
        terminal.until("heard  nothing yet").ready().press("i", "turn 1/3")
        terminal.signal(signal.SIGHUP)
        assert terminal.ended() == 128 + signal.SIGHUP
    result = run_dmplay(assignment, *PLAY, stdin="i\ni\n")
    assert "over: the baby went hungry for " in result.stdout


def test_no_input_uses_nothing_up(assignment: Path) -> None:
    for _ in range(2):
        result = run_dmplay(assignment, *PLAY, stdin="")
        assert result.stdout.endswith("paused after 0 turns.\n")
        assert result.stderr == "transcript: max-8.dmt\nresume: dmplay resume max-8.dmt\n"
    assert not (assignment / "max-9.dmt").exists()


@pytest.mark.parametrize("options", [(), ("--json",)])
def test_a_paused_game_shows_nothing_that_is_hidden(
    options: tuple[str, ...], assignment: Path
) -> None:
    result = run_dmplay(assignment, *PLAY, *options, stdin="ignore\nquit\n")
    assert not [word for word in HIDDEN_WORDS if word in result.stdout]
    for words in ("replay", "export --text", "review", "branch -o x.dmt --at 1"):
        command, *arguments = words.split()
        assert run_dmplay(assignment, command, "max-8.dmt", *arguments).returncode == 2


def test_refused_lines_of_a_script_do_not_end_an_assigned_game(assignment: Path) -> None:
    result = run_dmplay(assignment, *PLAY, stdin="hint\nfeet\nundo\nfeed\n")
    assert result.stdout.endswith("paused after 1 turn.\n")
    assert result.stderr.split("\n")[:3] == [
        "error: line 1: hint: this game forbids hints (--strict=hints)",
        "error: line 2: unknown action 'feet'; did you mean feed?",
        "error: line 3: undo: this game is strict, so turns cannot be undone",
    ]
    quiet = run_dmplay(assignment, *PLAY, "--quiet", stdin="values\n")
    assert (quiet.stdout, quiet.stderr) == (
        "",
        "error: line 1: values: this game forbids hints (--strict=hints)\n",
    )
    events = [
        json.loads(line)
        for line in run_dmplay(assignment, *PLAY, "--json", stdin="hint\n").stdout.splitlines()
    ]
    assert [event["event"] for event in events] == ["start", "ask", "error", "ask", "paused"]
    assert events[-1] == {"event": "paused", "turns": 1}


@pytest.mark.parametrize(
    ("options", "typed", "code"),
    [
        ((), "foo\ni\n", 2),
        ((), "i\nhint\n", 2),
        ((), "foo\ni\ni\ni\n", 2),  # the game ends
        ((), "i\nundo\nquit\n", 2),
        (("--quiet",), "foo\ni\n", 2),
        (("--json",), "foo\ni\n", 0),  # a program reads the errors and corrects itself
        ((), "i\n", 0),
        ((), "# foo\n\nlegal\ni\n", 0),
    ],
)
def test_a_refused_line_of_a_script_is_exit_code_2(
    options: tuple[str, ...], typed: str, code: int, assignment: Path
) -> None:
    assert run_dmplay(assignment, *PLAY, *options, stdin=typed).returncode == code
    (assignment / "max-8.dmt").unlink()
    resumed = run_dmplay(assignment, *PLAY, stdin="i\n")
    assert resumed.returncode == 0
    resumed = run_dmplay(assignment, "resume", "max-8.dmt", *options, stdin=typed)
    assert resumed.returncode == code


@pytest.mark.parametrize("turns", ["9", "3", "1", "0"])
def test_turns_cannot_be_changed_where_a_person_plays(turns: str, assignment: Path) -> None:
    run_dmplay(assignment, *PLAY, stdin="i\n")
    before = (assignment / "max-8.dmt").read_bytes()
    result = run_dmplay(assignment, "resume", "max-8.dmt", "--turns", turns, stdin="i\n")
    assert (result.returncode, result.stdout) == (2, "")
    assert result.stderr == (
        f"error: --turns: got {turns}, but a person plays this game and its turn limit cannot "
        "change; leave --turns out\n"
    )
    assert (assignment / "max-8.dmt").read_bytes() == before


def test_a_wrong_word_on_a_terminal_is_exit_code_0(assignment: Path) -> None:
    with Terminal(*PLAY, "--plain", folder=assignment) as terminal:
        terminal.until("action>").press("foo\r", "unknown action").press("quit\r")
        assert terminal.ended() == 0


def test_refused_lines_do_not_end_an_assigned_game_in_the_shell(assignment: Path) -> None:
    play = " ".join(PLAY)
    result = run_dmplay(assignment, "shell", stdin=f"{play}\nfeet\nfeed\nplay hexworld\n{play}\n")
    assert result.returncode == 2
    assert "error: line 2: unknown action 'feet'" in result.stderr
    assert "resumed crying-baby. turn 1." in result.stdout
    assert result.stderr.endswith("resume: dmplay resume max-8.dmt\n")
    one_line = run_dmplay(assignment, "-e", play, "-e", "feet", "-e", "feed", "-e", "state")
    assert one_line.returncode == 2
    assert "error: command 2: unknown action 'feet'" in one_line.stderr
    assert "state: hidden until the game is over" in one_line.stdout


def test_other_scripts_still_end_with_their_first_bad_line(assignment: Path) -> None:
    result = run_dmplay(assignment, "crying-baby", "-o", "g.dmt", stdin="feet\nfeed\n")
    assert result.returncode == 2
    assert '"reason": "illegal", "turns": 0' in (assignment / "g.dmt").read_text()


def test_a_paused_game_that_was_looked_into_is_not_played_on(assignment: Path) -> None:
    run_dmplay(assignment, *PLAY, stdin="ignore\n")
    assert run_dmplay(assignment, "replay", "max-8.dmt", "--peek", "--plain").returncode == 0
    result = run_dmplay(assignment, "resume", "max-8.dmt", stdin="ignore\n")
    assert (
        "this game is strict: it cannot continue after hidden information was shown"
        in result.stderr
    )
    run_dmplay(assignment, *PLAY, stdin="ignore\n")
    assert (assignment / "max-9.dmt").exists()


@pytest.mark.parametrize("strict", [False, True, "hints"])
def test_a_paused_game_is_resumed_in_the_same_sitting_without_a_mark(strict: bool | str) -> None:
    controller = start_assigned_game(strict=strict)
    controller.set_game(start_new_game(GameRequest("hexworld", seed=1)))
    game = resume(controller)
    game.choose(1)
    controller.end_game()
    assert "peeked" not in Path("max.dmt").read_text()
    assert not game.session.over


def test_a_game_that_was_shown_is_marked_when_it_is_played_again_in_the_same_sitting() -> None:
    controller = start_assigned_game(player="", is_handed_in=False)
    controller.end_game()
    assert resume(controller).request.peeked  # type: ignore[union-attr]


def test_the_dice_of_an_assigned_game_are_not_tried_out_by_a_restart() -> None:
    controller = start_assigned_game()
    for line in ("restart", "seed 8", "set hungry_reward -9"):
        with pytest.raises(
            BadParameter, match="this game is to be handed in, so its random numbers are"
        ):
            run_line(controller, line)
    assert run_line(controller, "seed 9").startswith("new game of crying-baby, seed 9.")


def test_an_agent_that_takes_the_seat_under_the_same_dice_ends_the_assigned_game() -> None:
    controller = start_assigned_game()
    run_line(controller, "agent feed-when-crying")
    assert '"reason": "quit"' in Path("max.dmt").read_text()


def test_a_running_game_is_not_resumed_or_marked_a_second_time() -> None:
    controller = start_assigned_game()
    before = Path("max.dmt").read_bytes()
    with pytest.raises(
        BadParameter, match=r"max.dmt: this game is running, here or in another dmplay process"
    ):
        resume(controller)
    assert Path("max.dmt").read_bytes() == before
    controller.end_game()


def test_a_paused_game_stays_paused_however_the_program_ends() -> None:
    controller = start_assigned_game()
    controller.end_game()
    controller.end_game("interrupted")
    assert not controller.game.session.over
    assert controller.game.narrator.debrief_rows() == []
    assert controller.game.narrator.closing_lines() == ["paused after 1 turn."]


@pytest.mark.parametrize(
    ("options", "command"),
    [
        ({}, "dmplay resume max.dmt"),
        ({"is_handed_in": False, "problem": "hexworld"}, "dmplay resume max.dmt"),
        ({"is_handed_in": False},
         "dmplay resume max.dmt  # no medal: its hidden states can now be seen"),
        ({"is_handed_in": False, "strict": True}, ""),
        ({"is_handed_in": False, "record_path": Path("a b.dmt")},
         "dmplay resume 'a b.dmt'  # no medal"),
        ({"turns": 1}, ""),
        ({"problem": "prisoners-dilemma", "other_agent": "grim"}, "dmplay resume max.dmt"),
        ({"problem": "travelers-dilemma", "other_agent": "script:2,2"}, ""),
        ({"problem": "prisoners-dilemma", "other_agent": "./mine.py:Mine"},
         "dmplay resume max.dmt --trust"),
    ],
)  # fmt: skip
def test_leaving_names_the_command_that_resumes_the_game(
    options: dict[str, object], command: str
) -> None:
    Path("mine.py").write_text(
        "from dmplay.agents.repeated_game_rules import REPEATED_GAME_RULES\n\n"
        "Mine = REPEATED_GAME_RULES['grim']\n"
    )
    controller = start_assigned_game(**options)
    controller.end_game()
    resume_command = format_resume_command(controller.game)
    assert resume_command.startswith(command) if command else not resume_command


def test_a_long_game_of_agents_is_resumed_with_its_turn_limit() -> None:
    request = GameRequest(
        "cart-pole", agent="random", seed=1, turns=20_000, record_path=Path("max.dmt")
    )
    controller = GameController(start_new_game(request))
    controller.end_game("interrupted")
    command = format_resume_command(controller.game)
    assert command == "dmplay resume max.dmt --turns 20000"
