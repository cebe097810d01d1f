"""Tests of disclosure: early looks at hidden information are rejected, or recorded as peeks."""

import json
import os
import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import dmplay
from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.completion.name_lists import list_saved_seeds
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import branch_game, resume_game, start_new_game
from dmplay.game.launch_requests import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.transcript_verification import format_reports, verify
from dmplay.transcript.concealment import mark_peeked_if_concealed
from dmplay.transcript.reader import read_transcript
from dmplay.ui.game_launcher import print_epilogue
from dmplay.ui.shell.commands import run_line
from tests.support.games import read_values, record_game, replace_in_file
from tests.support.programs import run_dmplay
from tests.support.terminals import CTRL_C, Terminal

OPEN_GAME_MESSAGE = "this game can still be continued: finish it first"
STRICT_GAME_MESSAGE = "this game is strict: it cannot continue after hidden information was shown"


@pytest.fixture(autouse=True)
def _isolated_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def umask() -> Iterator[None]:
    """Set the usual umask during a test."""
    before = os.umask(0o022)
    yield
    os.umask(before)


def start_hidden_game(path: Path, **options: object) -> Game:
    """Start a recorded game with hidden information and play one turn."""
    defaults: dict[str, object] = {
        "problem": "crying-baby",
        "seed": 7,
        "record_path": path / "g.dmt",
    }
    game = start_new_game(GameRequest(**{**defaults, **options}))  # type: ignore[arg-type]
    game.choose(0)
    return game


def write_killed_game(path: Path, **options: object) -> Path:
    """Write the file of a game whose process was killed; return its path."""
    game = start_hidden_game(path, **options)
    assert game.recorder is not None
    game.recorder.close()
    return game.recorder.path


def run_command_line(controller: GameController, *words: object) -> str:
    """Run these command-line words in a controller; return the output."""
    return controller.run_command_words([*map(str, words)])


def is_peeked(path: Path) -> bool:
    return read_transcript(path).header.peeked


DISCLOSING_COMMANDS = [
    ("replay", "{}"), ("export", "{}", "--csv"), ("export", "{}", "--text"), ("review", "{}"),
    ("branch", "{}", "--at", "0", "-o", "{}.copy"),
]  # fmt: skip
each_disclosing_command = pytest.mark.parametrize(
    "words", DISCLOSING_COMMANDS, ids=lambda words: " ".join(words[::2])
)


@each_disclosing_command
def test_a_game_that_can_continue_is_not_disclosed(words: tuple[str, ...], tmp_path: Path) -> None:
    path = write_killed_game(tmp_path)
    before = path.read_bytes()
    with pytest.raises(BadParameter, match=f"{path}: {OPEN_GAME_MESSAGE}, or add --peek"):
        run_command_line(
            GameController(cli_interpreter=interpret_command),
            *(word.format(path) for word in words),
        )
    assert path.read_bytes() == before
    assert not Path(f"{path}.copy").exists()


@each_disclosing_command
def test_a_peek_marks_the_game_permanently(words: tuple[str, ...], tmp_path: Path) -> None:
    path = write_killed_game(tmp_path)
    controller = GameController(cli_interpreter=interpret_command)
    run_command_line(controller, *(word.format(path) for word in words), "--peek")
    assert is_peeked(path)
    report = verify(path)
    assert (report.is_unfinished, report.peeked) == (True, True)
    assert report.summary == "1 turn, unfinished; not recomputed: human; peeked"
    resumed_game = resume_game(ResumeRequest(path))
    resumed_game.finish()
    assert verify(path).is_ok
    assert is_peeked(path)
    if words[0] == "branch":
        controller.end_game()
        assert is_peeked(Path(f"{path}.copy"))


def test_a_peek_preserves_notes_a_torn_tail_and_the_checksum(tmp_path: Path) -> None:
    game = start_hidden_game(tmp_path)
    game.finish("interrupted")
    path = tmp_path / "g.dmt"
    path.write_text(f"# a note\n{path.read_text()}# another\n")
    run_command_line(
        GameController(cli_interpreter=interpret_command), "export", path, "--csv", "--peek"
    )
    assert verify(path).is_ok
    assert path.read_text().startswith("# a note\ndmplay: 1\n")
    assert path.read_text().endswith("# another\n")
    torn = write_killed_game(tmp_path, record_path=tmp_path / "torn.dmt")
    torn.write_text(torn.read_text() + "turn: 2\nact")
    run_command_line(
        GameController(cli_interpreter=interpret_command), "export", torn, "--csv", "--peek"
    )
    assert torn.read_text().endswith("turn: 2\nact")


def test_a_game_in_progress_cannot_be_peeked_into(tmp_path: Path) -> None:
    game = start_hidden_game(tmp_path)
    with pytest.raises(
        BadParameter, match="this game is running, here or in another dmplay process"
    ):
        run_command_line(
            GameController(cli_interpreter=interpret_command),
            "replay",
            game.transcript_path,
            "--peek",
        )
    assert b"peeked" not in (tmp_path / "g.dmt").read_bytes()


def test_the_standard_input_cannot_be_marked(tmp_path: Path) -> None:
    text = write_killed_game(tmp_path).read_text()
    transcript = replace(read_transcript(tmp_path / "g.dmt"), path="/dev/stdin")
    with pytest.raises(BadParameter, match="--peek: got standard input, expected a file"):
        mark_peeked_if_concealed(transcript, dmplay.load_problem("crying-baby"), peek=True)
    for words, message in (((), OPEN_GAME_MESSAGE), (("--peek",), "--peek: got standard input")):
        process = run_dmplay(tmp_path, "export", "-", "--csv", *words, stdin=text)
        assert (process.returncode, process.stdout) == (2, "")
        assert message in process.stderr


@pytest.mark.parametrize(
    "options", [{"problem": "hexworld"}, {"agent": "random"}, {"reveal": True}], ids=str
)
def test_a_game_without_hidden_information_is_disclosed_without_a_mark(
    options: dict[str, object], tmp_path: Path
) -> None:
    game = start_hidden_game(tmp_path, turns=3, **options) if "agent" not in options else None
    if game and game.recorder:
        game.recorder.close()
    else:
        text = record_game(tmp_path / "g.dmt", "crying-baby", "random", turns=2)
        (tmp_path / "g.dmt").write_text(text.rpartition("end: ")[0])
    run_command_line(
        GameController(cli_interpreter=interpret_command), "export", tmp_path / "g.dmt", "--csv"
    )
    assert not is_peeked(tmp_path / "g.dmt")


def test_a_replay_agent_cannot_use_a_game_that_can_continue(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=OPEN_GAME_MESSAGE):
        start_new_game(
            GameRequest("crying-baby", agent=f"replay:{write_killed_game(tmp_path)}", seed=3)
        )


def test_an_unreplayable_game_that_can_continue_is_not_disclosed(tmp_path: Path) -> None:
    path = write_killed_game(tmp_path)
    replace_in_file(path, '"feed"', '"fed"')
    assert "did you mean feed?" in str(verify(path).findings[0])
    with pytest.raises(BadParameter, match=OPEN_GAME_MESSAGE):
        run_command_line(GameController(cli_interpreter=interpret_command), "export", path, "--csv")


def test_verify_neither_prints_values_of_an_unfinished_game_nor_rewrites_it(tmp_path: Path) -> None:
    path = write_killed_game(tmp_path)
    state = read_values(path, "state")[0]
    line = replace_in_file(path, state, '"sated"' if state == '"hungry"' else '"hungry"')
    assert str(verify(path).findings[0]) == f"{path}:{line}: turn 0: state differs"
    process = run_dmplay(tmp_path, "verify", "--update", "g.dmt")
    assert f"not rewritten: g.dmt: {OPEN_GAME_MESSAGE}\n" in process.stderr
    assert process.returncode == 3
    assert state not in process.stdout.partition("\n")[0]


# Resuming


@pytest.mark.parametrize(
    ("reason", "is_marked"),
    [("", False), ("interrupted", False), ("quit", True), ("illegal", True)],
)
def test_resuming_is_marked_after_the_debrief_but_not_after_a_kill(
    reason: str, is_marked: bool, tmp_path: Path
) -> None:
    game = start_hidden_game(tmp_path)
    assert game.recorder is not None
    (game.finish(reason) if reason else game.recorder.close())
    resumed_game = resume_game(ResumeRequest(tmp_path / "g.dmt"))
    assert is_peeked(tmp_path / "g.dmt") is is_marked
    resumed_game.choose(0)
    resumed_game.finish()
    assert verify(tmp_path / "g.dmt").is_ok
    assert verify(tmp_path / "g.dmt").peeked is is_marked


def test_a_finished_game_without_an_end_line_can_be_disclosed(tmp_path: Path) -> None:
    path = write_killed_game(tmp_path, turns=1, strict=True)
    run_command_line(GameController(cli_interpreter=interpret_command), "export", path, "--csv")
    resume_game(ResumeRequest(path)).finish()
    assert verify(path).is_ok
    assert not is_peeked(path)


def test_a_disclosed_strict_game_cannot_continue(tmp_path: Path) -> None:
    start_hidden_game(tmp_path, strict=True).finish()
    path = tmp_path / "g.dmt"
    before = path.read_bytes()
    with pytest.raises(BadParameter, match=STRICT_GAME_MESSAGE):
        resume_game(ResumeRequest(path))
    with pytest.raises(BadParameter, match=STRICT_GAME_MESSAGE):
        branch_game(BranchRequest(path, turn=0, record_path=tmp_path / "b.dmt"))
    assert path.read_bytes() == before
    assert not (tmp_path / "b.dmt").exists()
    killed_path = write_killed_game(tmp_path, strict=True, record_path=tmp_path / "k.dmt")
    with pytest.raises(BadParameter, match=STRICT_GAME_MESSAGE):
        branch_game(BranchRequest(killed_path, turn=0, record_path=tmp_path / "b.dmt", peek=True))
    assert resume_game(ResumeRequest(killed_path)).strict


def test_a_branch_of_a_strict_game_is_strict(tmp_path: Path) -> None:
    start_hidden_game(tmp_path, problem="hexworld", strict="hints").finish()
    branch = branch_game(BranchRequest(tmp_path / "g.dmt", turn=0, record_path=tmp_path / "b.dmt"))
    assert (branch.strict, branch.hints_forbidden) == (True, True)
    assert read_transcript(tmp_path / "b.dmt").header.strict == "hints"


REPEATING_COMMANDS = [
    "branch",
    "branch 0",
    "restart",
    "seed 7",
    "set discount 0.5",
    "play crying-baby --seed 7",
]


@pytest.mark.parametrize("command", REPEATING_COMMANDS)
def test_repeating_the_uniforms_of_a_disclosed_game_is_marked(command: str, tmp_path: Path) -> None:
    controller = GameController(start_hidden_game(tmp_path), interpret_command)
    run_line(controller, command)
    source = controller.game.transcript_path
    assert source is not None
    assert source != tmp_path / "g.dmt"
    controller.game.choose(0)
    controller.end_game()
    assert (is_peeked(source), verify(source).is_ok) == (True, True)
    assert not is_peeked(tmp_path / "g.dmt")


@pytest.mark.parametrize("command", REPEATING_COMMANDS[2:])
def test_repeating_the_uniforms_of_a_strict_game_is_rejected(command: str, tmp_path: Path) -> None:
    controller = GameController(start_hidden_game(tmp_path, strict=True), interpret_command)
    with pytest.raises(BadParameter, match=STRICT_GAME_MESSAGE):
        run_line(controller, f"{command} --strict" if command.startswith("play") else command)
    assert len(controller.game.session.turns) == 1
    assert not controller.game.session.over
    run_line(controller, "new")
    assert not is_peeked(controller.game.transcript_path or Path())


def test_new_uniforms_and_fully_observable_games_are_not_marked(tmp_path: Path) -> None:
    controller = GameController(start_hidden_game(tmp_path), interpret_command)
    for command in ("new", "seed 8", "play catch --seed 7"):
        run_line(controller, command)
        assert not is_peeked(controller.game.transcript_path or Path())
    run_line(controller, "play crying-baby --seed 7")  # the same seed again, some games later
    assert is_peeked(controller.game.transcript_path or Path())
    run_line(controller, "new")
    assert not is_peeked(controller.game.transcript_path or Path())
    second_controller = GameController(
        start_hidden_game(tmp_path, problem="hexworld", record_path=tmp_path / "h.dmt"),
        interpret_command,
    )
    run_line(second_controller, "restart")
    assert not is_peeked(second_controller.game.transcript_path or Path())


def test_a_saved_copy_is_marked_after_its_game_was_disclosed(tmp_path: Path) -> None:
    controller = GameController(start_hidden_game(tmp_path), interpret_command)
    run_line(controller, f"save {tmp_path / 'copy.dmt'}")
    with pytest.raises(BadParameter, match=OPEN_GAME_MESSAGE):
        run_line(controller, f"export {tmp_path / 'copy.dmt'} --csv")
    with pytest.raises(BadParameter, match="--peek shows hidden states"):
        run_line(controller, f"export {tmp_path / 'copy.dmt'} --csv --peek")
    run_line(controller, "play hexworld")
    run_line(controller, f"load {tmp_path / 'copy.dmt'}")
    assert is_peeked(tmp_path / "copy.dmt")


def test_a_strict_game_with_hidden_information_cannot_be_copied(tmp_path: Path) -> None:
    controller = GameController(start_hidden_game(tmp_path, strict=True), interpret_command)
    with pytest.raises(BadParameter, match=r"save: this game is strict, so no copy is written"):
        run_line(controller, f"save {tmp_path / 'copy.dmt'}")
    assert run_line(controller, "save") == f"saved as you play: {tmp_path / 'g.dmt'}"


def test_a_branch_of_a_game_of_two_people_is_marked(tmp_path: Path) -> None:
    arguments = (
        "multicaregiver-crying-baby",
        "--vs",
        "human",
        "--seed",
        "7",
        "-o",
        "g.dmt",
        "--plain",
    )
    process = run_dmplay(tmp_path, *arguments, stdin="feed\nfeed\nbranch\nfeed\nfeed\nquit\n")
    assert process.returncode == 0
    assert (is_peeked(tmp_path / "g.dmt"), is_peeked(tmp_path / "g-2.dmt")) == (False, True)


# Reports


def test_verify_review_and_export_report_the_mark(tmp_path: Path) -> None:
    start_hidden_game(tmp_path).finish()
    path = tmp_path / "g.dmt"
    resume_game(ResumeRequest(path)).finish()
    report = verify(path)
    assert format_reports([report], [True], json=False, quiet=False)[0] == (
        f"ok {path} (1 turn; not recomputed: human; peeked)"
    )
    data = json.loads(format_reports([report], [True], json=True, quiet=False)[0])
    assert (data["peeked"], data["help"]) == (True, {})
    controller = GameController(cli_interpreter=interpret_command)
    assert run_command_line(controller, "review", path).splitlines()[-1] == "peeked"
    review = json.loads(run_command_line(controller, "review", path, "--json"))
    assert (review["schema"], review["peeked"], review["help"]) == (1, True, {})
    assert [action["chosen"] for action in review["actions"]] == ["feed"]
    assert json.loads(run_command_line(controller, "export", path, "--json"))["peeked"] is True


def test_the_list_of_saved_games_shows_marks_and_hint_counts() -> None:
    controller = GameController(cli_interpreter=interpret_command)
    assert run_command_line(controller, "list", "games") == "no saved games"
    game = start_new_game(GameRequest("crying-baby", seed=7))
    for command in ("hint", "feed"):
        run_line(GameController(game), command)
    expected = f"{game.transcript_path}: crying-baby, agent human; unfinished; 1 hint (agent)"
    assert run_command_line(controller, "list", "games") == expected
    game.finish()
    resume_game(ResumeRequest(game.transcript_path or Path())).finish()
    expected = f"{game.transcript_path}: crying-baby, agent human; quit; peeked; 1 hint (agent)"
    assert run_command_line(controller, "list", "games") == expected
    (data,) = json.loads(run_command_line(controller, "list", "games", "--json"))["games"]
    assert (data["peeked"], data["help"], data["path"]) == (
        True,
        {"agent": 1},
        str(game.transcript_path),
    )


def test_an_interrupted_game_reports_how_to_resume_but_no_totals(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    controller = GameController(start_hidden_game(tmp_path, seed=None))
    controller.end_game("interrupted")
    assert controller.game.narrator.describe_result() == "interrupted after 1 turn."
    print_epilogue(controller)
    stderr = capsys.readouterr().err
    assert f"resume: dmplay resume {tmp_path / 'g.dmt'}\n" in stderr
    assert "replay:" not in stderr
    assert "again:" not in stderr


@pytest.mark.slow
def test_an_interrupted_screen_shows_no_hidden_information(tmp_path: Path) -> None:
    with Terminal("machine-replacement", "--seed", "7", "-o", "g.dmt", folder=tmp_path) as screen:
        screen.ready().press("m", "turn 1/").press(CTRL_C)
        assert screen.ended() == 130
        assert "interrupted after 1 turn.\n" in screen.printed
        assert "resume: dmplay resume g.dmt" in screen.printed
    with Terminal("resume", "g.dmt", folder=tmp_path) as screen:
        screen.ready().press("q")
        assert screen.ended() == 0
    assert not is_peeked(tmp_path / "g.dmt")
    with Terminal("replay", "g.dmt", folder=tmp_path) as screen:
        screen.ready().press("q")
        assert screen.ended() == 0


def test_completion_omits_the_seeds_of_unfinished_games() -> None:
    game = start_new_game(GameRequest("crying-baby", seed=23))
    game.choose(0)
    assert list_saved_seeds() == []
    game.finish()
    assert list_saved_seeds() == ["23"]


# File permissions


def read_file_mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.usefixtures("umask")
def test_a_file_with_hidden_information_is_private_until_the_end(tmp_path: Path) -> None:
    path = write_killed_game(tmp_path)
    assert read_file_mode(path) == 0o600
    path.chmod(0o644)
    game = resume_game(ResumeRequest(path))
    assert read_file_mode(path) == 0o600
    run_line(GameController(game), f"save {tmp_path / 'copy.dmt'}")
    assert read_file_mode(tmp_path / "copy.dmt") == 0o600
    game.finish()
    assert read_file_mode(path) == 0o644
    interrupted_game = start_hidden_game(tmp_path, record_path=tmp_path / "stopped.dmt")
    interrupted_game.finish("interrupted")
    assert read_file_mode(tmp_path / "stopped.dmt") == 0o600
    observable_path = write_killed_game(
        tmp_path, problem="hexworld", record_path=tmp_path / "h.dmt"
    )
    assert read_file_mode(observable_path) == 0o644
    old_path = tmp_path / "old.dmt"
    old_path.write_text("an old file")
    write_killed_game(tmp_path, record_path=old_path, force=True)
    assert read_file_mode(old_path) == 0o600


@pytest.mark.usefixtures("umask")
def test_saved_games_stay_private_after_the_end(tmp_path: Path) -> None:
    path = write_killed_game(tmp_path, record_path=None)
    folders = path.parent, path.parent.parent
    assert (read_file_mode(path), *map(read_file_mode, folders)) == (0o600, 0o700, 0o700)
    resume_game(ResumeRequest(path)).finish()
    branch_path = path.with_stem("other")
    branch_game(BranchRequest(path, turn=0, record_path=branch_path)).finish()
    assert (read_file_mode(path), read_file_mode(branch_path)) == (0o600, 0o600)


@pytest.mark.usefixtures("umask")
def test_a_peek_preserves_the_file_permissions(tmp_path: Path) -> None:
    path = write_killed_game(tmp_path)
    run_command_line(
        GameController(cli_interpreter=interpret_command), "export", path, "--csv", "--peek"
    )
    assert read_file_mode(path) == 0o600


# Format of the mark


def test_the_mark_is_true_or_false(tmp_path: Path) -> None:
    path = write_killed_game(tmp_path)
    replace_in_file(path, "seed: 7\n", "seed: 7\npeeked: 1\n")
    with pytest.raises(BadTranscript, match="peeked: expected true or false"):
        read_transcript(path)
