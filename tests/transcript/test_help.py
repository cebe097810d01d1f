"""Advice that a person was given is counted; a game may forbid it."""

from pathlib import Path

import pytest

from dmplay.cli.errands import interpret_command
from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.checking import verify_file
from dmplay.game.game import Game
from dmplay.game.playback import Playback
from dmplay.game.request import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.start import branch_game, resume_game, start_new_game
from dmplay.game.table import GameController
from dmplay.screen.screen import PlayScreen
from dmplay.terminal import Terminal
from dmplay.transcript.reading import read_transcript
from dmplay.words.commands import run_line
from tests.support.games import altered, values
from tests.support.programs import run
from tests.support.screens import play


def begun(path: Path, **options: object) -> Game:
    """A game that is recorded."""
    wanted: dict[str, object] = {"problem": "hexworld", "seed": 7, "record_path": path / "g.dmt"}
    return start_new_game(GameRequest(**{**wanted, **options}))  # type: ignore[arg-type]


def counted(path: Path) -> object:
    """The help that the end line tells of; the file verifies."""
    report = verify_file(path)
    assert report.is_ok, str(report)
    end = read_transcript(path).end_block
    assert end is not None
    told = end["end"]
    assert isinstance(told, dict)
    assert told.get("help", {}) == report.hint_counts
    return told.get("help")


def test_hints_values_and_policies_are_counted_and_no_undo_takes_them_back(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path))
    for command in ("hint", "e", "values", "policy", "undo", "look"):
        run_line(table, command)
    table.end_game()
    assert counted(tmp_path / "g.dmt") == {"agent": 3}
    assert values(tmp_path / "g.dmt", "help") == ['{"agent": 1}'] * 3
    told = "0 turns; not re-asked: human; help: agent 3"
    assert verify_file(tmp_path / "g.dmt").summary == told


def test_a_game_without_help_says_nothing_of_it(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path))
    run_line(table, "e")
    table.end_game()
    assert counted(tmp_path / "g.dmt") is None
    assert "help" not in (tmp_path / "g.dmt").read_text()
    run_line(table, "hint")  # after the end there is none
    assert counted(tmp_path / "g.dmt") is None


def test_each_persons_help_is_counted_and_none_of_agents(tmp_path: Path) -> None:
    table = GameController(
        begun(tmp_path, problem="multicaregiver-crying-baby", other_agent="human", turns=3)
    )
    for command in ("feed", "hint", "feed", "hint"):
        run_line(table, command)
    agents = table.game.problem.agents
    table.end_game()
    assert counted(tmp_path / "g.dmt") == {agents[1]: 1, agents[0]: 1}
    watched = GameController(begun(tmp_path, agent="random", record_path=tmp_path / "a.dmt"))
    run_line(watched, "hint")
    watched.end_game()
    assert counted(tmp_path / "a.dmt") is None


def test_a_kill_a_resumption_a_branch_and_a_copy_lose_no_help(tmp_path: Path) -> None:
    game = begun(tmp_path)
    run_line(GameController(game), "hint")
    assert game.recorder is not None
    game.recorder.close()
    again = resume_game(ResumeRequest(tmp_path / "g.dmt"))
    run_line(GameController(again), "values")
    run_line(GameController(again), f"save {tmp_path / 'copy.dmt'}")
    again.finish()
    assert counted(tmp_path / "g.dmt") == {"agent": 2}
    assert verify_file(tmp_path / "copy.dmt").hint_counts == {"agent": 2}
    branch = branch_game(BranchRequest(tmp_path / "g.dmt", turn=0, record_path=tmp_path / "b.dmt"))
    branch.finish()
    assert counted(tmp_path / "b.dmt") == {"agent": 2}


def test_a_game_that_is_not_kept_saves_its_help_too(tmp_path: Path) -> None:
    kept = begun(tmp_path)
    assert kept.recorder is not None
    game = Game("hexworld", kept.session, kept.player_names, kept.keyboard, None, kept.request)
    run_line(GameController(game), "hint")
    run_line(GameController(game), f"save {tmp_path / 'copy.dmt'}")
    assert verify_file(tmp_path / "copy.dmt").hint_counts == {"agent": 1}


def test_a_recording_is_stepped_through_without_a_stop_at_the_help(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path))
    for command in ("hint", "e", "hint", "e"):
        run_line(table, command)
    table.end_game()
    shown = Playback(tmp_path / "g.dmt")
    assert [*shown.iter_agent_turns()] == [0, 1]
    shown.undo()
    assert len(shown.session.turns) == 1
    assert shown.session.hint_counts == {"agent": 2}


COUNT = 'help: {"agent": 1}\n'
CHANGED = {  # what stands in its place, and what is found
    "": "end: keys",
    'help: {"agent": 2}\n': "end: help",
    'help: {"agnt": 1}\n': "inputs: help: expected some of agent",
    'help: {"agent": 0}\n': "help: expected whole numbers, as 1",
    "help: 1\n": "inputs: help: expected some of agent",
}


def test_a_changed_count_is_found(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path))
    run_line(table, "hint")
    run_line(table, "e")
    table.end_game()
    path = tmp_path / "g.dmt"
    told = path.read_text()

    def found(before: str, after: str) -> str:
        path.write_text(told)
        altered(path, before, after)
        return str(verify_file(path).findings[0])

    for after, fault in CHANGED.items():
        assert fault in found(COUNT if after else f"{COUNT}\n", after), after
    assert "end: help" in found('"help": {"agent": 1}, ', "")


def test_a_rewritten_file_keeps_its_help(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path))
    run_line(table, "hint")
    run_line(table, "e")
    table.end_game()
    before = (tmp_path / "g.dmt").read_text()
    altered(tmp_path / "g.dmt", '"(8,2)"', '"(8,1)"')
    run(tmp_path, "verify", "g.dmt", "--update")
    assert (tmp_path / "g.dmt").read_text() == before


# Overlays


def test_an_overlay_is_counted_for_each_turn_that_it_lies_on(tmp_path: Path) -> None:
    game = begun(tmp_path)
    play(game, "h", "V", "L", "h", "?", "x", "V", "V", "V", "h")  # values, values, policy, states
    assert game.session.hint_counts == {"agent": 3}
    bare = begun(tmp_path, problem="catch", record_path=tmp_path / "c.dmt")
    play(bare, "V", "V")
    assert not bare.session.hint_counts


# Games without help


@pytest.mark.parametrize("command", ["hint", "values", "policy"])
def test_a_game_may_forbid_help(command: str, tmp_path: Path) -> None:
    table = GameController(begun(tmp_path, strict="hints"))
    with pytest.raises(BadParameter, match=f"^{command}: this game is strict about help$"):
        run_line(table, command)
    with pytest.raises(BadParameter, match="undo: this game is strict"):
        run_line(table, "undo")
    assert 'strict: "hints"\n' in (tmp_path / "g.dmt").read_text()
    table.end_game()
    assert verify_file(tmp_path / "g.dmt").is_ok
    run_line(table, "restart")
    assert table.game.hints_forbidden


def test_the_screen_of_such_a_game_shows_no_help(tmp_path: Path) -> None:
    game = begun(tmp_path, strict="hints")
    shown = play(game, "tab", "V")
    assert "hint" not in shown.frames[0]
    assert "? help  q quit  : command" in shown.frames[0]
    assert "hint: this game is strict about help" in shown.frames[1]
    assert "overlay: this game is strict about help" in shown.last
    assert not game.session.hint_counts


def test_an_overlay_does_not_stay_over_such_a_game(tmp_path: Path) -> None:
    screen = PlayScreen(GameController(begun(tmp_path)), Terminal(True, "", True, True, False))
    screen.show_next_overlay()
    assert screen.frame_state.overlay == "values"
    screen.controller.set_game(begun(tmp_path, strict="hints", record_path=tmp_path / "s.dmt"))
    assert not screen.frame_state.overlay


def test_help_in_such_a_transcript_is_refused(tmp_path: Path) -> None:
    table = GameController(begun(tmp_path))
    run_line(table, "hint")
    table.end_game()
    altered(tmp_path / "g.dmt", "seed: 7\n", 'seed: 7\nstrict: "hints"\n')
    with pytest.raises(BadTranscript, match="got help, but the game is strict"):
        read_transcript(tmp_path / "g.dmt")


@pytest.mark.parametrize(
    ("words", "strict"),
    [
        ((), False), (("--strict",), True), (("--strict=hints",), "hints"),
        (("--strict", "--reveal"), True), (("--strict", "--strict=hints"), "hints"),
    ],
)  # fmt: skip
def test_strict_stands_alone_or_says_more(
    words: tuple[str, ...], strict: object, tmp_path: Path
) -> None:
    table = GameController(cli_interpreter=interpret_command)
    table.run_cli_words(["play", "hexworld", "--seed", "7", "-o", str(tmp_path / "s.dmt"), *words])
    assert read_transcript(tmp_path / "s.dmt").header.strict == strict


def test_another_word_after_strict_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match="--strict"):
        GameController(cli_interpreter=interpret_command).run_cli_words(
            ["play", "hexworld", "--strict=hint"]
        )


@pytest.mark.parametrize(
    ("value", "told"),
    [
        ("true", '"strict": true'), ('"hints"', '"strict": "hints"'), ("false", ""),
        ("3", "play.strict: got 3, expected true or false"), ('"x"', "play.strict: got 'x'"),
    ],
)  # fmt: skip
def test_a_file_of_settings_says_how_strict_games_are(
    value: str, told: str, tmp_path: Path
) -> None:
    (tmp_path / ".config" / "dmplay").mkdir(parents=True)
    (tmp_path / ".config" / "dmplay" / "config.toml").write_text(f"[play]\nstrict = {value}\n")
    done = run(tmp_path, "hexworld", "--agent", "random", "--turns", "1", "-o", "g.dmt", "-q")
    if done.returncode:
        assert told in done.stderr
    else:
        text = (tmp_path / "g.dmt").read_text()
        assert told.replace('"strict"', "strict") in text
        assert ("strict" in text) == bool(told)


def test_the_command_that_plays_it_again_is_as_strict(tmp_path: Path) -> None:
    game = begun(tmp_path, seed=None, strict="hints")
    assert " --strict=hints " in game.play_again_command
    assert (
        " --strict "
        in begun(
            tmp_path, seed=None, strict=True, record_path=tmp_path / "s.dmt"
        ).play_again_command
    )
