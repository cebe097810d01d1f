"""What is hidden stays so while a game can be played on; going on once it was shown is marked."""

import json
import os
import stat
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest

import dmplay
from dmplay.cli.errands import interpret_command
from dmplay.errors import BadParameter, BadTranscript
from dmplay.front import print_epilogue
from dmplay.game.checking import format_reports, verify_file
from dmplay.game.game import Game
from dmplay.game.request import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.start import branch_game, resume_game, start_new_game
from dmplay.game.table import GameController
from dmplay.transcript.reading import read_transcript
from dmplay.transcript.seal import disclose_transcript
from dmplay.words.commands import run_line
from dmplay.words.completion.lists import list_saved_seeds
from tests.support.games import altered, recorded, values
from tests.support.programs import run
from tests.support.terminals import CTRL_C, Terminal

OPEN = "this game can still be played on: finish it"
OVER = "this game is strict: once what is hidden is shown, nobody plays on"


@pytest.fixture(autouse=True)
def _own_state(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))


@pytest.fixture
def umask() -> Iterator[None]:
    """The usual umask."""
    before = os.umask(0o022)
    yield
    os.umask(before)


def begun(path: Path, **options: object) -> Game:
    """A game of a person in which much is hidden, after a turn."""
    wanted: dict[str, object] = {"problem": "crying-baby", "seed": 7, "record_path": path / "g.dmt"}
    game = start_new_game(GameRequest(**{**wanted, **options}))  # type: ignore[arg-type]
    game.choose(0)
    return game


def left(path: Path, **options: object) -> Path:
    """The file of one that a kill left."""
    game = begun(path, **options)
    assert game.recorder is not None
    game.recorder.close()
    return game.recorder.path


def dealt(table: GameController, *words: object) -> str:
    """What comes of words of the command line at a table."""
    return table.run_cli_words([*map(str, words)])


def peeked(path: Path) -> bool:
    return read_transcript(path).header.peeked


LOOKS = [
    ("replay", "{}"), ("export", "{}", "--csv"), ("export", "{}", "--text"), ("review", "{}"),
    ("branch", "{}", "--at", "0", "-o", "{}.copy"),
]  # fmt: skip
every_look = pytest.mark.parametrize("words", LOOKS, ids=lambda words: " ".join(words[::2]))


@every_look
def test_a_game_that_can_be_played_on_is_not_looked_into(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    path = left(tmp_path)
    before = path.read_bytes()
    with pytest.raises(BadParameter, match=f"{path}: {OPEN}, or say --peek, which marks it"):
        dealt(
            GameController(cli_interpreter=interpret_command),
            *(word.format(path) for word in words),
        )
    assert path.read_bytes() == before
    assert not Path(f"{path}.copy").exists()


@every_look
def test_who_peeks_into_it_marks_it_for_good(words: tuple[str, ...], tmp_path: Path) -> None:
    path = left(tmp_path)
    table = GameController(cli_interpreter=interpret_command)
    dealt(table, *(word.format(path) for word in words), "--peek")
    assert peeked(path)
    report = verify_file(path)
    assert (report.is_unfinished, report.peeked) == (True, True)
    assert report.summary == "1 turn, unfinished; not re-asked: human; peeked"
    again = resume_game(ResumeRequest(path))
    again.finish()
    assert verify_file(path).is_ok
    assert peeked(path)
    if words[0] == "branch":
        table.end_game()
        assert peeked(Path(f"{path}.copy"))


def test_a_peek_keeps_notes_a_torn_tail_and_the_checksum(tmp_path: Path) -> None:
    game = begun(tmp_path)
    game.finish("interrupted")
    path = tmp_path / "g.dmt"
    path.write_text(f"# a note\n{path.read_text()}# another\n")
    dealt(GameController(cli_interpreter=interpret_command), "export", path, "--csv", "--peek")
    assert verify_file(path).is_ok
    assert path.read_text().startswith("# a note\ndmplay: 1\n")
    assert path.read_text().endswith("# another\n")
    torn = left(tmp_path, record_path=tmp_path / "torn.dmt")
    torn.write_text(torn.read_text() + "turn: 2\nact")
    dealt(GameController(cli_interpreter=interpret_command), "export", torn, "--csv", "--peek")
    assert torn.read_text().endswith("turn: 2\nact")


def test_the_game_somebody_plays_now_is_not_peeked_into(tmp_path: Path) -> None:
    game = begun(tmp_path)
    with pytest.raises(BadParameter, match="somebody plays this game now"):
        dealt(
            GameController(cli_interpreter=interpret_command),
            "replay",
            game.transcript_path,
            "--peek",
        )
    assert b"peeked" not in (tmp_path / "g.dmt").read_bytes()


def test_the_standard_input_cannot_be_marked(tmp_path: Path) -> None:
    text = left(tmp_path).read_text()
    piped = replace(read_transcript(tmp_path / "g.dmt"), path="/dev/stdin")
    with pytest.raises(BadParameter, match="--peek: name the file, so that it can be marked"):
        disclose_transcript(piped, dmplay.load_problem("crying-baby"), peek=True)
    for words, told in (((), OPEN), (("--peek",), "--peek: name the file")):
        done = run(tmp_path, "export", "-", "--csv", *words, stdin=text)
        assert (done.returncode, done.stdout) == (2, "")
        assert told in done.stderr


@pytest.mark.parametrize(
    "options", [{"problem": "hexworld"}, {"agent": "random"}, {"reveal": True}], ids=str
)
def test_a_game_without_secrets_is_looked_into_as_it_is(
    options: dict[str, object], tmp_path: Path
) -> None:
    game = begun(tmp_path, turns=3, **options) if "agent" not in options else None
    if game and game.recorder:
        game.recorder.close()
    else:
        text = recorded(tmp_path / "g.dmt", "crying-baby", "random", turns=2)
        (tmp_path / "g.dmt").write_text(text.rpartition("end: ")[0])
    dealt(GameController(cli_interpreter=interpret_command), "export", tmp_path / "g.dmt", "--csv")
    assert not peeked(tmp_path / "g.dmt")


def test_a_seat_cannot_be_played_by_the_actions_of_a_game_that_goes_on(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match=OPEN):
        start_new_game(GameRequest("crying-baby", agent=f"replay:{left(tmp_path)}", seed=3))


def test_a_file_that_cannot_be_played_again_is_not_looked_into_either(tmp_path: Path) -> None:
    path = left(tmp_path)
    altered(path, '"feed"', '"fed"')
    assert "did you mean feed?" in str(verify_file(path).findings[0])
    with pytest.raises(BadParameter, match=OPEN):
        dealt(GameController(cli_interpreter=interpret_command), "export", path, "--csv")


def test_verify_tells_no_values_of_a_game_that_goes_on_and_does_not_rewrite_it(
    tmp_path: Path,
) -> None:
    path = left(tmp_path)
    hidden = values(path, "state")[0]
    line = altered(path, hidden, '"sated"' if hidden == '"hungry"' else '"hungry"')
    assert str(verify_file(path).findings[0]) == f"{path}:{line}: turn 0: state differs"
    done = run(tmp_path, "verify", "--update", "g.dmt")
    assert f"not rewritten: g.dmt: {OPEN}\n" in done.stderr
    assert done.returncode == 3
    assert hidden not in done.stdout.partition("\n")[0]


# Going on


@pytest.mark.parametrize(
    ("reason", "mark"), [("", False), ("interrupted", False), ("quit", True), ("illegal", True)]
)
def test_going_on_after_the_debrief_is_marked_and_after_a_kill_is_not(
    reason: str, mark: bool, tmp_path: Path
) -> None:
    game = begun(tmp_path)
    assert game.recorder is not None
    (game.finish(reason) if reason else game.recorder.close())
    again = resume_game(ResumeRequest(tmp_path / "g.dmt"))
    assert peeked(tmp_path / "g.dmt") is mark
    again.choose(0)
    again.finish()
    assert verify_file(tmp_path / "g.dmt").is_ok
    assert verify_file(tmp_path / "g.dmt").peeked is mark


def test_a_game_that_came_to_its_end_is_open_though_its_file_does_not_say_so(
    tmp_path: Path,
) -> None:
    path = left(tmp_path, turns=1, strict=True)
    dealt(GameController(cli_interpreter=interpret_command), "export", path, "--csv")
    resume_game(ResumeRequest(path)).finish()
    assert verify_file(path).is_ok
    assert not peeked(path)


def test_a_strict_game_whose_secrets_were_shown_is_over(tmp_path: Path) -> None:
    begun(tmp_path, strict=True).finish()
    path = tmp_path / "g.dmt"
    before = path.read_bytes()
    with pytest.raises(BadParameter, match=OVER):
        resume_game(ResumeRequest(path))
    with pytest.raises(BadParameter, match=OVER):
        branch_game(BranchRequest(path, turn=0, record_path=tmp_path / "b.dmt"))
    assert path.read_bytes() == before
    assert not (tmp_path / "b.dmt").exists()
    killed = left(tmp_path, strict=True, record_path=tmp_path / "k.dmt")
    with pytest.raises(BadParameter, match=OVER):
        branch_game(BranchRequest(killed, turn=0, record_path=tmp_path / "b.dmt", peek=True))
    assert resume_game(ResumeRequest(killed)).strict


def test_a_branch_of_a_strict_game_is_strict(tmp_path: Path) -> None:
    begun(tmp_path, problem="hexworld", strict="hints").finish()
    copy = branch_game(BranchRequest(tmp_path / "g.dmt", turn=0, record_path=tmp_path / "b.dmt"))
    assert (copy.strict, copy.hints_forbidden) == (True, True)
    assert read_transcript(tmp_path / "b.dmt").header.strict == "hints"


AGAIN = ["branch", "branch 0", "restart", "seed 7", "set discount 0.5", "play crying-baby --seed 7"]


@pytest.mark.parametrize("command", AGAIN)
def test_the_same_dice_after_a_game_that_was_left_are_marked(command: str, tmp_path: Path) -> None:
    table = GameController(begun(tmp_path), interpret_command)
    run_line(table, command)
    source = table.game.transcript_path
    assert source is not None
    assert source != tmp_path / "g.dmt"
    table.game.choose(0)
    table.end_game()
    assert (peeked(source), verify_file(source).is_ok) == (True, True)
    assert not peeked(tmp_path / "g.dmt")


@pytest.mark.parametrize("command", AGAIN[2:])
def test_the_same_dice_are_refused_where_the_game_is_strict(command: str, tmp_path: Path) -> None:
    table = GameController(begun(tmp_path, strict=True), interpret_command)
    with pytest.raises(BadParameter, match=OVER):
        run_line(table, f"{command} --strict" if command.startswith("play") else command)
    assert len(table.game.session.turns) == 1
    assert not table.game.session.over
    run_line(table, "new")
    assert not peeked(table.game.transcript_path or Path())


def test_fresh_dice_other_dice_and_open_games_are_not_marked(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path), interpret_command)
    for command in ("new", "seed 8", "play catch --seed 7"):
        run_line(table, command)
        assert not peeked(table.game.transcript_path or Path())
    run_line(table, "play crying-baby --seed 7")  # once more, some games later
    assert peeked(table.game.transcript_path or Path())
    run_line(table, "new")
    assert not peeked(table.game.transcript_path or Path())
    other = GameController(
        begun(tmp_path, problem="hexworld", record_path=tmp_path / "h.dmt"), interpret_command
    )
    run_line(other, "restart")
    assert not peeked(other.game.transcript_path or Path())


def test_a_copy_that_was_saved_is_marked_where_its_game_was_left_before(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path), interpret_command)
    run_line(table, f"save {tmp_path / 'copy.dmt'}")
    with pytest.raises(BadParameter, match=OPEN):
        run_line(table, f"export {tmp_path / 'copy.dmt'} --csv")
    with pytest.raises(BadParameter, match="--peek is for after this game"):
        run_line(table, f"export {tmp_path / 'copy.dmt'} --csv --peek")
    run_line(table, "play hexworld")
    run_line(table, f"load {tmp_path / 'copy.dmt'}")
    assert peeked(tmp_path / "copy.dmt")


def test_a_strict_game_with_secrets_has_no_copies(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path, strict=True), interpret_command)
    with pytest.raises(BadParameter, match=r"save: this game is strict, and has no copies"):
        run_line(table, f"save {tmp_path / 'copy.dmt'}")
    assert run_line(table, "save") == f"kept as you play: {tmp_path / 'g.dmt'}"


def test_two_people_who_branch_are_told_all_and_marked(tmp_path: Path) -> None:
    words = ("multicaregiver-crying-baby", "--vs", "human", "--seed", "7", "-o", "g.dmt", "--plain")
    done = run(tmp_path, *words, stdin="feed\nfeed\nbranch\nfeed\nfeed\nquit\n")
    assert done.returncode == 0
    assert (peeked(tmp_path / "g.dmt"), peeked(tmp_path / "g-2.dmt")) == (False, True)


# What is told


def test_verify_review_and_data_tell_of_the_mark(tmp_path: Path) -> None:
    begun(tmp_path).finish()
    path = tmp_path / "g.dmt"
    resume_game(ResumeRequest(path)).finish()
    report = verify_file(path)
    assert format_reports([report], [True], json=False, quiet=False)[0] == (
        f"ok {path} (1 turn; not re-asked: human; peeked)"
    )
    data = json.loads(format_reports([report], [True], json=True, quiet=False)[0])
    assert (data["peeked"], data["help"]) == (True, {})
    table = GameController(cli_interpreter=interpret_command)
    assert dealt(table, "review", path).splitlines()[-1] == "peeked"
    assert json.loads(dealt(table, "review", path, "--json"))[-1] == {"peeked": True, "help": {}}
    assert json.loads(dealt(table, "export", path, "--json"))["peeked"] is True


def test_the_list_of_kept_games_tells_of_the_mark_and_of_help() -> None:
    table = GameController(cli_interpreter=interpret_command)
    assert dealt(table, "list", "games") == "no game is kept"
    game = start_new_game(GameRequest("crying-baby", seed=7))
    for command in ("hint", "feed"):
        run_line(GameController(game), command)
    told = f"{game.transcript_path}: crying-baby, agent human; unfinished; help: agent 1"
    assert dealt(table, "list", "games") == told
    game.finish()
    resume_game(ResumeRequest(game.transcript_path or Path())).finish()
    told = f"{game.transcript_path}: crying-baby, agent human; quit; peeked; help: agent 1"
    assert dealt(table, "list", "games") == told
    (data,) = json.loads(dealt(table, "list", "games", "--json"))
    assert (data["peeked"], data["help"], data["path"]) == (
        True,
        {"agent": 1},
        str(game.transcript_path),
    )


def test_an_interrupted_game_is_told_without_its_sums_and_how_to_go_on(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = GameController(begun(tmp_path, seed=None))
    table.end_game("interrupted")
    assert table.game.narrator.describe_result() == "interrupted after 1 turn."
    print_epilogue(table)
    told = capsys.readouterr().err
    assert f"resume: dmplay resume {tmp_path / 'g.dmt'}\n" in told
    assert "replay:" not in told
    assert "again:" not in told


@pytest.mark.slow
def test_a_screen_that_is_interrupted_shows_nothing_hidden(tmp_path: Path) -> None:
    with Terminal("machine-replacement", "--seed", "7", "-o", "g.dmt", folder=tmp_path) as screen:
        screen.ready().press("m", "turn 1/").press(CTRL_C)
        assert screen.ended() == 130
        assert "interrupted after 1 turn.\n" in screen.printed
        assert "resume: dmplay resume g.dmt" in screen.printed
    with Terminal("resume", "g.dmt", folder=tmp_path) as screen:
        screen.ready().press("q")
        assert screen.ended() == 0
    assert not peeked(tmp_path / "g.dmt")
    with Terminal("replay", "g.dmt", folder=tmp_path) as screen:
        screen.ready().press("q")
        assert screen.ended() == 0


def test_completion_names_no_seed_of_a_game_that_goes_on() -> None:
    game = start_new_game(GameRequest("crying-baby", seed=23))
    game.choose(0)
    assert list_saved_seeds() == []
    game.finish()
    assert list_saved_seeds() == ["23"]


# Who may read the files


def mode(path: Path) -> int:
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.usefixtures("umask")
def test_nobody_else_reads_a_file_with_secrets_before_the_end(tmp_path: Path) -> None:
    path = left(tmp_path)
    assert mode(path) == 0o600
    path.chmod(0o644)
    game = resume_game(ResumeRequest(path))
    assert mode(path) == 0o600
    run_line(GameController(game), f"save {tmp_path / 'copy.dmt'}")
    assert mode(tmp_path / "copy.dmt") == 0o600
    game.finish()
    assert mode(path) == 0o644
    stopped = begun(tmp_path, record_path=tmp_path / "stopped.dmt")
    stopped.finish("interrupted")
    assert mode(tmp_path / "stopped.dmt") == 0o600
    open_ = left(tmp_path, problem="hexworld", record_path=tmp_path / "h.dmt")
    assert mode(open_) == 0o644
    old = tmp_path / "old.dmt"
    old.write_text("an old file")
    left(tmp_path, record_path=old, force=True)
    assert mode(old) == 0o600


@pytest.mark.usefixtures("umask")
def test_kept_games_are_their_owners_alone_also_after_the_end(tmp_path: Path) -> None:
    path = left(tmp_path, record_path=None)
    folders = path.parent, path.parent.parent
    assert (mode(path), *map(mode, folders)) == (0o600, 0o700, 0o700)
    resume_game(ResumeRequest(path)).finish()
    other = path.with_stem("other")
    branch_game(BranchRequest(path, turn=0, record_path=other)).finish()
    assert (mode(path), mode(other)) == (0o600, 0o600)


@pytest.mark.usefixtures("umask")
def test_a_peek_leaves_the_file_as_private_as_it_was(tmp_path: Path) -> None:
    path = left(tmp_path)
    dealt(GameController(cli_interpreter=interpret_command), "export", path, "--csv", "--peek")
    assert mode(path) == 0o600


# The form of the mark


def test_a_mark_is_true_or_false(tmp_path: Path) -> None:
    path = left(tmp_path)
    altered(path, "seed: 7\n", "seed: 7\npeeked: 1\n")
    with pytest.raises(BadTranscript, match="peeked: expected true or false"):
        read_transcript(path)
