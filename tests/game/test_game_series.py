"""Tests of consecutive games: each game and its file end properly before the next game starts."""

import json
from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.draw.options import DrawOptions
from dmplay.errors import BadParameter, UnknownName
from dmplay.game.game_series import GameController, next_numbered_path
from dmplay.game.game_setup import resume_game, start_new_game
from dmplay.game.launch_requests import GameRequest, ResumeRequest
from dmplay.game.playback import Playback
from dmplay.game.transcript_verification import verify
from dmplay.transcript.reader import read_transcript
from dmplay.ui.shell.commands import run_line
from tests.formats.sources import write_text_file
from tests.support.programs import run_dmplay
from tests.support.screens import make_game, play_keys
from tests.support.terminals import Terminal


def create_controller(path: Path, **options: object) -> GameController:
    """Create a controller with a recorded game of hexworld and seed 7, or with other options."""
    defaults: dict[str, object] = {
        "problem": "hexworld",
        "seed": 7,
        "record_path": path / "game.dmt",
    }
    return GameController(start_new_game(GameRequest(**{**defaults, **options})))  # type: ignore[arg-type]


def verify_and_read_end(path: Path) -> tuple[object, object]:
    """Verify a transcript; return its end reason and its number of turns."""
    assert verify(path).is_ok
    end = read_transcript(path).end_block
    assert end is not None
    end_facts = json.loads(json.dumps(end["end"]))
    return end_facts["reason"], end_facts["turns"]


def test_legal_lists_action_names_if_there_are_more_actions_than_keys(tmp_path: Path) -> None:
    assert run_line(create_controller(tmp_path), "legal").startswith("legal: e (l), ne (u), ")
    names = " ".join(f"a{n}" for n in range(1, 14))
    lines = f"discount: 0.9\nstates: 1\nactions: {names}\nT: *\nuniform\n"
    problem_file = write_text_file(tmp_path, "wide.mdp", lines)
    controller = create_controller(
        tmp_path, problem=problem_file, record_path=tmp_path / "wide.dmt"
    )
    assert run_line(controller, "legal") == f"legal: {names.replace(' ', ', ')}."


def test_a_game_that_was_left_without_a_turn_does_not_take_the_file_of_the_next_game() -> None:
    controller = GameController(start_new_game(GameRequest("hexworld", seed=7)))
    controller.end_game()  # as when a player leaves the game for the gallery
    controller.set_game(start_new_game(GameRequest("hexworld", seed=8)))
    controller.game.choose(0)
    assert controller.take_write_notice() == ""
    controller.end_game()
    (recorder,) = controller.finished_games
    assert verify_and_read_end(recorder.path) == ("quit", 1)


@pytest.mark.parametrize("command", ["new", "restart", "seed 8", "set slip 0.1", "agent optimal"])
def test_a_new_game_ends_the_previous_one_and_has_a_separate_file(
    command: str, tmp_path: Path
) -> None:
    controller = create_controller(tmp_path)
    run_line(controller, "e")
    message = run_line(controller, command)
    assert f"saved: {tmp_path / 'game.dmt'}" in message
    assert controller.game.session.turns == []
    controller.end_game()
    assert verify_and_read_end(tmp_path / "game.dmt") == ("quit", 1)
    assert verify_and_read_end(tmp_path / "game-2.dmt") == ("quit", 0)


def test_a_strict_game_cannot_be_branched(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match="branch: this game is strict"):
        run_line(create_controller(tmp_path, strict=True), "branch 0")


def test_a_restart_has_the_same_seed_and_a_new_game_another(tmp_path: Path) -> None:
    controller = create_controller(tmp_path)
    first = run_line(controller, "e")
    run_line(controller, "restart")
    assert run_line(controller, "e") == first
    assert (controller.game.seed, controller.game.is_seed_visible) == (7, True)
    run_line(controller, "new")
    assert controller.game.seed != 7
    assert not controller.game.is_seed_visible
    new_seed = controller.game.seed
    assert str(new_seed) not in run_line(controller, "restart")
    assert (controller.game.seed, controller.game.is_seed_visible) == (new_seed, False)
    assert f"--seed {new_seed}" in controller.game.play_again_command


def test_another_agent_or_parameter_has_the_same_seed(tmp_path: Path) -> None:
    # not needed by agents alone
    controller = create_controller(tmp_path, typed_options=frozenset({"rate"}))
    start = controller.game.narrator.describe_situation(controller.game.snapshot())
    for line in ("agent optimal", "set discount 0.5", "agent human"):
        run_line(controller, line)
        assert (
            controller.game.seed,
            controller.game.narrator.describe_situation(controller.game.snapshot()),
        ) == (7, start)
    run_line(controller, "new")
    new_seed = controller.game.seed
    run_line(controller, "agent random")
    assert (controller.game.seed, controller.game.is_seed_visible) == (new_seed, False)
    assert "--seat agent=random" in controller.game.play_again_command
    assert "--set discount=0.5" in controller.game.play_again_command


def test_an_agent_can_replace_a_person_with_a_name_and_a_ghost(tmp_path: Path) -> None:
    controller = create_controller(
        tmp_path, problem="prisoners-dilemma", player="ann", ghost_agent="grim"
    )
    run_line(controller, "agent agent2 random")
    assert controller.game.request is not None
    assert (controller.game.request.player, controller.game.request.ghost_agent) == ("ann", "grim")
    run_line(controller, "agent grim")
    assert controller.game.human_seats == []
    assert read_transcript(tmp_path / "game-3.dmt").header.player == ""
    assert controller.game.ghost is None


def test_a_new_game_has_the_same_options_as_the_previous_one(tmp_path: Path) -> None:
    controller = create_controller(tmp_path, problem="predator-prey", strict=True, turns=9)
    run_line(controller, "agent predator random")
    run_line(controller, "set discount=0.5")
    run_line(controller, "new")
    request = controller.game.request
    assert request is not None
    assert (request.strict, request.turns, controller.game.player_names[0]) == (True, 9, "random")
    assert controller.game.problem.discount == 0.5


def test_a_game_that_cannot_start_leaves_the_current_game_unchanged(tmp_path: Path) -> None:
    controller = create_controller(tmp_path)
    run_line(controller, "e")
    for line in ("seed x", "set slip 3", "set slop 1", "agent bst", "agent prey random"):
        with pytest.raises((BadParameter, UnknownName)):
            run_line(controller, line)
    assert len(controller.game.session.turns) == 1
    assert controller.game.session.end_reason is None


def test_a_resumed_game_can_be_restarted(tmp_path: Path) -> None:
    from dmplay.game.game_setup import resume_game

    controller = create_controller(tmp_path, settings=["slip=0.1"])
    run_line(controller, "e")
    controller.end_game()
    resumed_controller = GameController(resume_game(ResumeRequest(tmp_path / "game.dmt")))
    run_line(resumed_controller, "restart")
    assert resumed_controller.game.seed == 7
    assert not resumed_controller.game.is_seed_visible
    resumed_controller.end_game()
    assert verify_and_read_end(tmp_path / "game-2.dmt") == ("quit", 0)
    assert read_transcript(tmp_path / "game-2.dmt").header.parameters == {"slip": 0.1}


def test_a_replay_cannot_be_restarted(tmp_path: Path) -> None:
    controller = create_controller(tmp_path)
    controller.end_game()
    for command in ("new", "restart", "seed 3"):
        with pytest.raises(BadParameter, match="this is a replay"):
            run_line(GameController(Playback(tmp_path / "game.dmt")), command)


def test_undo_in_a_replay_goes_back_by_turns_and_rerolls_to_the_start(tmp_path: Path) -> None:
    controller = create_controller(tmp_path)
    run_line(controller, "e")
    run_line(controller, "reroll")
    controller.end_game()
    replay = GameController(Playback(tmp_path / "game.dmt"))
    with pytest.raises(BadParameter, match=r"^this is the start of the replay$"):
        run_line(replay, "undo")
    run_line(replay, "step 2")
    with pytest.raises(BadParameter, match=r"^undo 3: the start is only 2 steps back$"):
        run_line(replay, "undo 3")
    assert run_line(replay, "undo 2") == "undone. turn 0."
    assert run_line(replay, "step").startswith("turn 1. chose E, moved E to (8,2).")


def test_a_replay_reports_the_path_of_its_transcript(tmp_path: Path) -> None:
    controller, path = create_controller(tmp_path), tmp_path / "game.dmt"
    run_line(controller, "e")
    controller.end_game()
    replay = GameController(Playback(path))
    assert run_line(replay, "transcript").startswith(f"transcript: 0 turns replayed from {path}\n")
    with pytest.raises(BadParameter, match=rf"^save: this is a replay; its transcript is {path}$"):
        run_line(replay, "save")


def test_a_saved_copy_is_unfinished_or_complete(tmp_path: Path) -> None:
    controller = create_controller(tmp_path, turns=2)
    run_line(controller, "e")
    run_line(controller, f"save {tmp_path / 'one.dmt'}")
    run_line(controller, "e")
    run_line(controller, f"save {tmp_path / 'two.dmt'}")
    assert verify(tmp_path / "one.dmt").is_unfinished
    assert verify_and_read_end(tmp_path / "two.dmt") == ("turn limit", 2)
    with pytest.raises(BadParameter, match="exists; give another name"):
        run_line(controller, f"save {tmp_path / 'two.dmt'}")
    assert (tmp_path / "game.dmt").read_text() in (tmp_path / "two.dmt").read_text()


def test_the_next_file_name_has_the_next_number(tmp_path: Path) -> None:
    for name, next_name in (("a.dmt", "a-2.dmt"), ("run-7.dmt", "run-8.dmt")):
        assert next_numbered_path(tmp_path / name) == tmp_path / next_name
    (tmp_path / "a-2.dmt").touch()
    assert next_numbered_path(tmp_path / "a.dmt") == tmp_path / "a-3.dmt"
    assert next_numbered_path(Path("/dev/null")) == Path("/dev/null")


def test_a_saved_game_without_turns_is_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    controller = create_controller(tmp_path, record_path=None)
    run_line(controller, "new")
    run_line(controller, "e")
    run_line(controller, "undo")
    run_line(controller, "new")
    assert len([*(tmp_path / "dmplay" / "games").iterdir()]) == 2


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("load", "no unfinished game"),
        ("load {}", "this game is running, here or in another dmplay process"),
        ("play catch -o {} --force", "this game is running, here or in another dmplay process"),
    ],
)
def test_the_file_of_the_current_game_cannot_be_loaded_or_overwritten(
    line: str, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    controller = GameController(start_new_game(GameRequest("hexworld", seed=7)), interpret_command)
    assert controller.game.recorder is not None
    path = controller.game.recorder.path
    run_line(controller, "e")
    with pytest.raises(BadParameter, match=message):
        run_line(controller, line.format(path))
    run_line(controller, "w")
    controller.end_game()
    assert verify_and_read_end(path) == ("quit", 2)


def test_a_review_is_for_people_after_the_game_and_is_saved_with_it(tmp_path: Path) -> None:
    controller = create_controller(tmp_path, problem="crying-baby", turns=2)
    run_line(controller, "feed")
    with pytest.raises(BadParameter, match="available after the game"):
        run_line(controller, "review")
    run_line(controller, "feed")
    lines = run_line(controller, "review").splitlines()
    assert lines == [
        "turn  chosen  best    regret  discounted",
        "2     feed    ignore  5.00    4.50 ####################",
        "1     feed    ignore  0.05    0.05 #",
        "review: best action 0 of 2 times, total expected regret (discounted value lost) "
        "4.55, largest in turn 2",
        "regret = value of the best action minus value of the chosen one",
        "discounted = the regret as it counts in the score",
    ]
    controller.end_game()
    path = tmp_path / "game.dmt"
    notes = path.read_text().splitlines()[-3:]
    assert notes[0].startswith(
        "# review turn 1, agent: chose feed, best action: ignore, regret 0.05. "
    )
    assert notes[1].startswith(
        "# review turn 2, agent: chose feed, best action: ignore, regret 5.00. "
    )
    assert (
        notes[2]
        == "# review best action 0 of 2 times, total expected regret (discounted value lost) "
        "4.55, largest in turn 2"
    )
    assert verify_and_read_end(path) == ("turn limit", 2)
    agent_controller = create_controller(
        tmp_path, agent="optimal", record_path=tmp_path / "other.dmt"
    )
    run_line(agent_controller, "auto")
    with pytest.raises(BadParameter, match="available after the game"):
        run_line(agent_controller, "review")


# On the screen


@pytest.mark.parametrize("key", ["N", "f2", "R", ":new", ":restart"])
def test_a_key_starts_a_new_game_on_the_screen(key: str, tmp_path: Path) -> None:
    controller = create_controller(tmp_path)
    screens = play_keys(
        controller.game, "h", *([":", f"{key[1:]} enter"] if key[0] == ":" else [key]), "h"
    )
    assert "turn 1. " in screens.frames[1]
    new_frame = screens.frames[-2]
    assert "turn 0 " in new_frame
    assert "turn 1. " not in new_frame
    assert "new game of hexworld" in new_frame
    assert "turn 1 " in screens.last
    assert verify_and_read_end(tmp_path / "game.dmt") == ("quit", 1)


def test_the_transcript_opens_as_a_page_that_escape_closes(tmp_path: Path) -> None:
    screens = play_keys(create_controller(tmp_path).game, "h", "T", "escape", "S")
    assert "1 turn in" in screens.frames[2]
    assert 'actions: {"agent": "w"}' in screens.frames[2]
    assert "turn 1 " in screens.frames[3]
    assert "1 turn in" not in screens.frames[3]
    assert "saved as you play:" in screens.last


@pytest.mark.slow
def test_all_games_started_on_the_screen_are_recorded(tmp_path: Path) -> None:
    with Terminal("hexworld", "--seed", "7", "-o", "game.dmt", folder=tmp_path) as terminal:
        terminal.ready().press("h", "turn 1 ").press("N", "new game").press("h", "turn 1 ")
        terminal.press("R", "game-2.dmt").press("h", "turn 1 ").press("q")
        assert terminal.ended() == 0
        for name in ("game.dmt", "game-2.dmt", "game-3.dmt"):
            assert f"transcript: {name}" in terminal.text
            # the first turn of a new seed can already end the game
            assert verify_and_read_end(tmp_path / name)[1] == 1
    texts = [(tmp_path / name).read_text() for name in ("game-2.dmt", "game-3.dmt")]
    note = "# again: an earlier game had the same random numbers\n"
    assert texts[1] == texts[0].replace("turn: 1\n", f"{note}turn: 1\n")


def test_the_note_of_an_older_version_about_repeated_uniforms_is_read(tmp_path: Path) -> None:
    path = tmp_path / "game.dmt"
    game = start_new_game(GameRequest("hexworld", seed=7, record_path=path))
    game.choose(0)
    game.finish("interrupted")
    old_note = "# again: under dice that were played before\n"
    path.write_text(path.read_text().replace("turn: 1\n", f"{old_note}turn: 1\n"))
    assert resume_game(ResumeRequest(path)).repeats_uniforms


def test_output_of_several_lines_opens_a_page_and_a_row_can_hold_several_commands(
    tmp_path: Path,
) -> None:
    controller = create_controller(tmp_path)
    screens = play_keys(controller.game, ":", "help space turns enter", "x", ":", "w;w enter")
    assert "act ACTION: play an action" in screens.frames[2]
    assert "act ACTION: play an action" not in screens.frames[3]
    assert "turn 2 " in screens.last


def test_the_command_row_completes_commands(tmp_path: Path) -> None:
    screens = play_keys(create_controller(tmp_path).game, ":", "rest", "tab")
    assert " :restart" in screens.last


# In line mode


def test_a_game_started_in_line_mode_is_reported_from_its_start(tmp_path: Path) -> None:
    arguments = ("hexworld", "--seed", "7", "-o", "game.dmt")
    result = run_dmplay(tmp_path, *arguments, stdin="e\nrestart\ne\nplay catch --seed 3\nquit\n")
    assert result.returncode == 0
    lines = [line for line in result.stdout.splitlines() if not line.startswith("action>")]
    assert lines[2:6] == [
        "turn 1. chose E, moved E to (8,2). reward 0. score 0.",
        "over: quit after 1 turn. your score 0 (undiscounted 0).",
        *lines[:2],
    ]
    assert lines[6] == lines[2]
    assert "catch, seed 3." in lines[8]
    assert "transcript: game.dmt\ntranscript: game-2.dmt\n" in result.stderr
    assert verify_and_read_end(tmp_path / "game-2.dmt") == ("quit", 1)


def test_in_json_the_end_of_a_game_precedes_the_start_of_the_next(tmp_path: Path) -> None:
    arguments = ("crying-baby", "--seed", "7", "--json")
    result = run_dmplay(tmp_path, *arguments, stdin="feed\nnew\nfeed\n")
    objects = [json.loads(line) for line in result.stdout.splitlines()]
    events = [item for item in objects if item["event"] != "ask"]
    event_names = [item["event"] for item in events]
    assert event_names == ["start", "turn", "end", "start", "turn", "end"]
    assert "seed" in events[0]
    assert "seed" not in events[3]


@pytest.mark.parametrize("arguments", [("hexworld", "--seed", "7"), ("shell",)])
def test_an_unusable_state_folder_causes_one_warning_for_all_games(
    arguments: tuple[str, ...], tmp_path: Path
) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    commands = "play hexworld --seed 7\ne\nnew\nrestart\nplay catch\n"
    result = run_dmplay(tmp_path, *arguments, stdin=commands)
    assert result.returncode == 0
    warnings = [line for line in result.stderr.splitlines() if line.startswith("warning: ")]
    assert len(warnings) == 1
    assert "not saved" in warnings[0]
    assert "transcript: " not in result.stderr


@pytest.mark.slow
def test_without_a_state_folder_the_shell_plays_and_has_only_its_current_history(
    tmp_path: Path,
) -> None:
    (tmp_path / "state").write_text("a file where the folder should be")
    with Terminal("shell", folder=tmp_path) as terminal:
        terminal.ready().press("play hexworld --seed 7\r", "t0]>").press("e\r", "t1]>")
        terminal.calm().press("new\r", "new game of hexworld.").calm()
        terminal.press("\x1b[A", lambda: terminal.text.count("]> new") == 2).press("\x15\x04")
        assert terminal.ended() == 0
        assert terminal.printed.count("warning: ") == 1


def test_a_board_follows_the_turns_and_their_undo() -> None:
    new_game, options = make_game("2048"), DrawOptions(80, 24)
    before = new_game.draw_board(options)
    new_game.choose(0)
    after = new_game.draw_board(options)
    assert after.plain != before.plain
    new_game.undo()
    assert new_game.draw_board(options).plain == before.plain
