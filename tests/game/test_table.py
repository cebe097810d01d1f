"""One game after another: each is ended in good order, and its file with it, before the next."""

import json
from pathlib import Path

import numpy as np
import pytest

from dmplay.cli.errands import interpret_command
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.checking import verify_file
from dmplay.game.playback import Playback
from dmplay.game.request import GameRequest, ResumeRequest
from dmplay.game.start import start_new_game
from dmplay.game.table import GameController, next_numbered_path
from dmplay.transcript.reading import read_transcript
from dmplay.views.style import DrawOptions
from dmplay.words.commands import run_line
from tests.files.sources import kept
from tests.support.programs import run
from tests.support.screens import game, play
from tests.support.terminals import Terminal


def table(path: Path, **options: object) -> GameController:
    """A table with a game of seed 7, or of other options."""
    wanted: dict[str, object] = {"problem": "hexworld", "seed": 7, "record_path": path / "game.dmt"}
    return GameController(start_new_game(GameRequest(**{**wanted, **options})))  # type: ignore[arg-type]


def ending(path: Path) -> tuple[object, object]:
    """Why a recorded game ended, and after how many turns; the file verifies."""
    assert verify_file(path).is_ok
    end = read_transcript(path).end_block
    assert end is not None
    facts = json.loads(json.dumps(end["end"]))
    return facts["reason"], facts["turns"]


def test_who_has_more_actions_than_keys_is_told_their_names(tmp_path: Path) -> None:
    assert run_line(table(tmp_path), "legal").startswith("legal: e (l), ne (u), ")
    many = " ".join(f"a{n}" for n in range(1, 14))
    lines = f"discount: 0.9\nstates: 1\nactions: {many}\nT: *\nuniform\n"
    wide = kept(tmp_path, "wide.mdp", lines)
    seat = table(tmp_path, problem=wide, record_path=tmp_path / "wide.dmt")
    assert run_line(seat, "legal") == f"legal: {many.replace(' ', ', ')}."


@pytest.mark.parametrize("command", ["new", "restart", "seed 8", "set slip 0.1", "agent optimal"])
def test_the_game_before_is_quit_whole_and_the_next_has_a_file_of_its_own(
    command: str, tmp_path: Path
) -> None:
    seat = table(tmp_path)
    run_line(seat, "e")
    told = run_line(seat, command)
    assert f"kept: {tmp_path / 'game.dmt'}" in told
    assert seat.game.session.turns == []
    seat.end_game()
    assert ending(tmp_path / "game.dmt") == ("quit", 1)
    assert ending(tmp_path / "game-2.dmt") == ("quit", 0)


def test_a_strict_game_has_no_branch(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match="branch: this game is strict"):
        run_line(table(tmp_path, strict=True), "branch 0")


def test_a_restart_has_the_same_dice_and_a_new_game_has_others(tmp_path: Path) -> None:
    seat = table(tmp_path)
    first = run_line(seat, "e")
    run_line(seat, "restart")
    assert run_line(seat, "e") == first
    assert (seat.game.seed, seat.game.is_seed_visible) == (7, True)
    run_line(seat, "new")
    assert seat.game.seed != 7
    assert not seat.game.is_seed_visible
    fresh = seat.game.seed
    assert str(fresh) not in run_line(seat, "restart")
    assert (seat.game.seed, seat.game.is_seed_visible) == (fresh, False)
    assert f"--seed {fresh}" in seat.game.play_again_command


def test_another_agent_or_parameter_meets_the_same_dice(tmp_path: Path) -> None:
    seat = table(tmp_path, has_rate_option=True)  # which no agent alone needs
    start = seat.game.narrator.describe_situation(seat.game.snapshot())
    for line in ("agent optimal", "set discount 0.5", "agent human"):
        run_line(seat, line)
        assert (seat.game.seed, seat.game.narrator.describe_situation(seat.game.snapshot())) == (
            7,
            start,
        )
    run_line(seat, "new")
    fresh = seat.game.seed
    run_line(seat, "agent random")
    assert (seat.game.seed, seat.game.is_seed_visible) == (fresh, False)
    assert "--seat agent=random" in seat.game.play_again_command
    assert "--set discount=0.5" in seat.game.play_again_command


def test_an_agent_takes_the_seat_of_a_person_who_had_a_name_and_a_ghost(tmp_path: Path) -> None:
    seat = table(tmp_path, problem="prisoners-dilemma", player="ann", ghost_agent="grim")
    run_line(seat, "agent agent2 random")
    assert seat.game.request is not None
    assert (seat.game.request.player, seat.game.request.ghost_agent) == ("ann", "grim")
    run_line(seat, "agent grim")
    assert seat.game.human_seats == []
    assert read_transcript(tmp_path / "game-3.dmt").header.player == ""
    assert seat.game.ghost is None


def test_a_game_begins_anew_with_what_was_set_before(tmp_path: Path) -> None:
    seat = table(tmp_path, problem="predator-prey", strict=True, turns=9)
    run_line(seat, "agent predator random")
    run_line(seat, "set discount=0.5")
    run_line(seat, "new")
    asked = seat.game.request
    assert asked is not None
    assert (asked.strict, asked.turns, seat.game.player_names[0]) == (True, 9, "random")
    assert seat.game.problem.discount == 0.5


def test_what_cannot_begin_leaves_the_game_as_it_is(tmp_path: Path) -> None:
    seat = table(tmp_path)
    run_line(seat, "e")
    for line in ("seed x", "set slip 3", "set slop 1", "agent bst", "agent prey random"):
        with pytest.raises((BadParameter, UnknownName)):
            run_line(seat, line)
    assert len(seat.game.session.turns) == 1
    assert seat.game.session.end_reason is None


def test_a_resumed_game_can_begin_anew(tmp_path: Path) -> None:
    from dmplay.game.start import resume_game

    seat = table(tmp_path, settings=["slip=0.1"])
    run_line(seat, "e")
    seat.end_game()
    again = GameController(resume_game(ResumeRequest(tmp_path / "game.dmt")))
    run_line(again, "restart")
    assert again.game.seed == 7
    assert not again.game.is_seed_visible
    again.end_game()
    assert ending(tmp_path / "game-2.dmt") == ("quit", 0)
    assert read_transcript(tmp_path / "game-2.dmt").header.parameters == {"slip": 0.1}


def test_a_recording_is_not_begun_anew(tmp_path: Path) -> None:
    seat = table(tmp_path)
    seat.end_game()
    for command in ("new", "restart", "seed 3"):
        with pytest.raises(BadParameter, match="a recording is only looked at"):
            run_line(GameController(Playback(tmp_path / "game.dmt")), command)


def test_a_recording_goes_back_by_turns_and_rerolled_turns_to_its_beginning(
    tmp_path: Path,
) -> None:
    seat = table(tmp_path)
    run_line(seat, "e")
    run_line(seat, "reroll")
    seat.end_game()
    shown = GameController(Playback(tmp_path / "game.dmt"))
    with pytest.raises(BadParameter, match=r"^this is the beginning$"):
        run_line(shown, "undo")
    run_line(shown, "step 2")
    with pytest.raises(BadParameter, match=r"^undo 3: the beginning is 2 steps back$"):
        run_line(shown, "undo 3")
    assert run_line(shown, "undo 2") == "undone. turn 0."
    assert run_line(shown, "step").startswith("turn 1. at (8,2). chose E, moved E.")


def test_a_recording_tells_where_it_is(tmp_path: Path) -> None:
    seat, path = table(tmp_path), tmp_path / "game.dmt"
    run_line(seat, "e")
    seat.end_game()
    shown = GameController(Playback(path))
    assert run_line(shown, "transcript").startswith(f"transcript: 0 turns shown of {path}\n")
    with pytest.raises(BadParameter, match=rf"^save: a recording is only looked at; it is {path}$"):
        run_line(shown, "save")


def test_a_saved_copy_goes_on_or_is_whole(tmp_path: Path) -> None:
    seat = table(tmp_path, turns=2)
    run_line(seat, "e")
    run_line(seat, f"save {tmp_path / 'one.dmt'}")
    run_line(seat, "e")
    run_line(seat, f"save {tmp_path / 'two.dmt'}")
    assert verify_file(tmp_path / "one.dmt").is_unfinished
    assert ending(tmp_path / "two.dmt") == ("turn limit", 2)
    with pytest.raises(BadParameter, match="exists; give another name"):
        run_line(seat, f"save {tmp_path / 'two.dmt'}")
    assert (tmp_path / "game.dmt").read_text() in (tmp_path / "two.dmt").read_text()


def test_a_name_goes_on_counting_from_its_number(tmp_path: Path) -> None:
    for name, after in (("a.dmt", "a-2.dmt"), ("run-7.dmt", "run-8.dmt")):
        assert next_numbered_path(tmp_path / name) == tmp_path / after
    (tmp_path / "a-2.dmt").touch()
    assert next_numbered_path(tmp_path / "a.dmt") == tmp_path / "a-3.dmt"
    assert next_numbered_path(Path("/dev/null")) == Path("/dev/null")


def test_a_kept_game_in_which_nothing_was_done_makes_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    seat = table(tmp_path, record_path=None)
    run_line(seat, "new")
    run_line(seat, "e")
    run_line(seat, "undo")
    run_line(seat, "new")
    assert len([*(tmp_path / "dmplay" / "games").iterdir()]) == 2


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("load", "no unfinished game"),
        ("load {}", "somebody plays this game now"),
        ("play catch -o {} --force", "somebody plays this game now"),
    ],
)
def test_the_file_of_the_game_that_is_played_is_left_alone(
    line: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    seat = GameController(start_new_game(GameRequest("hexworld", seed=7)), interpret_command)
    assert seat.game.recorder is not None
    path = seat.game.recorder.path
    run_line(seat, "e")
    with pytest.raises(BadParameter, match=message):
        run_line(seat, line.format(path))
    run_line(seat, "w")
    seat.end_game()
    assert ending(path) == ("quit", 2)


def test_a_review_is_for_people_after_the_game_and_is_kept_with_it(tmp_path: Path) -> None:
    seat = table(tmp_path, problem="crying-baby", turns=2)
    run_line(seat, "feed")
    with pytest.raises(BadParameter, match="once the game is over"):
        run_line(seat, "review")
    run_line(seat, "feed")
    told = run_line(seat, "review").splitlines()
    assert told == [
        "turn  yours  best    regret",
        "2     feed   ignore  3.37 ####################",
        "1     feed   feed    0.00",
        "review: 1 of 2 moves the best, regret 3.37 in all, most in turn 2",
    ]
    seat.end_game()
    path = tmp_path / "game.dmt"
    notes = path.read_text().splitlines()[-3:]
    assert notes[0].startswith("# review turn 1, agent: chose feed, the best. values: feed -")
    assert notes[1].startswith("# review turn 2, agent: chose feed, best ignore, regret 3.37. ")
    assert notes[2] == "# review 1 of 2 moves the best, regret 3.37 in all, most in turn 2"
    assert ending(path) == ("turn limit", 2)
    watched = table(tmp_path, agent="optimal", record_path=tmp_path / "other.dmt")
    run_line(watched, "auto")
    with pytest.raises(BadParameter, match="it values the moves of people"):
        run_line(watched, "review")


# On the screen


@pytest.mark.parametrize("key", ["N", "f2", "R", ":new", ":restart"])
def test_a_key_begins_anew_on_the_screen(key: str, tmp_path: Path) -> None:
    seat = table(tmp_path)
    shown = play(seat.game, "h", *([":", f"{key[1:]} enter"] if key[0] == ":" else [key]), "h")
    assert "turn 1. " in shown.frames[1]
    fresh = shown.frames[-2]
    assert "turn 0 " in fresh
    assert "turn 1. " not in fresh
    assert "new game of hexworld" in fresh
    assert "turn 1 " in shown.last
    assert ending(tmp_path / "game.dmt") == ("quit", 1)


def test_the_transcript_opens_on_a_page_that_any_key_closes(tmp_path: Path) -> None:
    shown = play(table(tmp_path).game, "h", "T", "h", "S")
    assert "1 turn in" in shown.frames[2]
    assert 'actions: {"agent": "w"}' in shown.frames[2]
    assert "turn 1 " in shown.frames[3]
    assert "1 turn in" not in shown.frames[3]
    assert "kept as you play:" in shown.last


@pytest.mark.slow
def test_games_begun_on_the_screen_are_all_kept(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press("N", "new game").press("h", "turn 1 ")
        terminal.press("R", "game-2.dmt").press("h", "turn 1 ").press("q")
        assert terminal.ended() == 0
        for name in ("game.dmt", "game-2.dmt", "game-3.dmt"):
            assert f"transcript: {name}" in terminal.text
            assert ending(tmp_path / name)[1] == 1  # fresh dice may begin at an exit
    told = [(tmp_path / name).read_text() for name in ("game-2.dmt", "game-3.dmt")]
    note = "# again: under dice that were played before\n"
    assert told[1] == told[0].replace("turn: 1\n", f"{note}turn: 1\n")


def test_words_of_several_lines_open_a_page_and_several_commands_are_done(tmp_path: Path) -> None:
    seat = table(tmp_path)
    shown = play(seat.game, ":", "help space turns enter", "x", ":", "w;w enter")
    assert "act ACTION: play an action" in shown.frames[2]
    assert "act ACTION: play an action" not in shown.frames[3]
    assert "turn 2 " in shown.last


def test_the_command_row_completes_what_it_can(tmp_path: Path) -> None:
    shown = play(table(tmp_path).game, ":", "rest", "tab")
    assert " :restart" in shown.last


# In lines


def test_a_game_begun_in_lines_is_told_from_its_start(tmp_path: Path) -> None:
    words = ("hexworld", "--seed", "7", "-o", "game.dmt")
    done = run(tmp_path, *words, stdin="e\nrestart\ne\nplay catch --seed 3\nquit\n")
    assert done.returncode == 0
    told = [line for line in done.stdout.splitlines() if not line.startswith("action>")]
    assert told[2:6] == [
        "turn 1. at (8,2). chose E, moved E. reward 0. score 0.",
        "over: quit after 1 turn. agent score (discounted) 0, total 0.",
        *told[:2],
    ]
    assert told[6] == told[2]
    assert "catch, seed 3." in told[8]
    assert "transcript: game.dmt\ntranscript: game-2.dmt\n" in done.stderr
    assert ending(tmp_path / "game-2.dmt") == ("quit", 1)


def test_as_data_the_end_of_one_game_stands_before_the_start_of_the_next(tmp_path: Path) -> None:
    words = ("crying-baby", "--seed", "7", "--json")
    done = run(tmp_path, *words, stdin="feed\nnew\nfeed\n")
    every = [json.loads(line) for line in done.stdout.splitlines()]
    events = [one for one in every if one["event"] != "ask"]
    told = [one["event"] for one in events]
    assert told == ["start", "turn", "end", "start", "turn", "end"]
    assert "seed" in events[0]
    assert "seed" not in events[3]


@pytest.mark.parametrize("words", [("hexworld", "--seed", "7"), ("shell",)])
def test_a_state_folder_that_cannot_be_had_is_one_warning_for_all_games(
    words: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    typed_ = "play hexworld --seed 7\ne\nnew\nrestart\nplay catch\n"
    done = run(tmp_path, *words, stdin=typed_)
    assert done.returncode == 0
    warnings = [line for line in done.stderr.splitlines() if line.startswith("warning: ")]
    assert len(warnings) == 1
    assert "not kept" in warnings[0]
    assert "transcript: " not in done.stderr


@pytest.mark.slow
def test_without_a_state_folder_the_shell_plays_on_and_remembers_no_lines(tmp_path: Path) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play hexworld --seed 7\r", "t0]>").press("e\r", "t1]>")
        terminal.calm().press("new\r", "new game of hexworld.").calm()
        terminal.press("\x1b[A", lambda: terminal.text.count("]> new") == 2).press("\x15\x04")
        assert terminal.ended() == 0
        assert terminal.printed.count("warning: ") == 1


def test_a_board_is_drawn_anew_only_for_another_view_or_look() -> None:
    played, look = game("2048"), DrawOptions(80, 24)
    drawn = played.draw_board(look._replace(regret=np.arange(4.0)))
    assert played.draw_board(look._replace(regret=np.arange(4.0))) is drawn
    assert played.draw_board(look._replace(regret=np.arange(4.0) / 2)) is not drawn
    before = played.draw_board(look)
    assert before is not drawn
    assert played.draw_board(look) is before
    played.choose(0)
    after = played.draw_board(look)
    assert after.plain != before.plain
    played.undo()
    assert played.draw_board(look).plain == before.plain
