"""Tests of hints: they are counted in the transcript, and a game may forbid them."""

from pathlib import Path

import pytest

from dmplay.cli.parsed_command_runner import interpret_command
from dmplay.errors import BadParameter, BadTranscript
from dmplay.game.game import Game
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import branch_game, resume_game, start_new_game
from dmplay.game.launch_requests import BranchRequest, GameRequest, ResumeRequest
from dmplay.game.playback import Playback
from dmplay.game.transcript_verification import verify
from dmplay.terminal.capabilities import Terminal
from dmplay.transcript.reader import read_transcript
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import run_line
from tests.support.games import read_values, replace_in_file
from tests.support.programs import run_dmplay
from tests.support.screens import play_keys


def start_recorded_game(path: Path, **options: object) -> Game:
    """Start a game that is recorded."""
    defaults: dict[str, object] = {"problem": "hexworld", "seed": 7, "record_path": path / "g.dmt"}
    return start_new_game(GameRequest(**{**defaults, **options}))  # type: ignore[arg-type]


def read_end_hint_counts(path: Path) -> object:
    """Verify a file; return the hint counts of its end line, if any."""
    report = verify(path)
    assert report.is_ok, str(report)
    end = read_transcript(path).end_block
    assert end is not None
    end_facts = end["end"]
    assert isinstance(end_facts, dict)
    assert end_facts.get("help", {}) == report.hint_counts
    return end_facts.get("help")


def test_hints_and_overlays_stay_counted_after_undo(tmp_path: Path) -> None:
    controller = GameController(start_recorded_game(tmp_path))
    for command in ("hint", "why", "e", "values", "e", "policy", "undo", "undo", "look"):
        run_line(controller, command)
    controller.end_game()
    assert read_end_hint_counts(tmp_path / "g.dmt") == {"agent": 3}
    assert read_values(tmp_path / "g.dmt", "help") == ['{"agent": 1}'] * 3
    summary = "0 turns; not recomputed: human; 3 hints (agent)"
    assert verify(tmp_path / "g.dmt").summary == summary


def test_a_game_without_hints_records_no_count(tmp_path: Path) -> None:
    controller = GameController(start_recorded_game(tmp_path))
    run_line(controller, "e")
    controller.end_game()
    assert read_end_hint_counts(tmp_path / "g.dmt") is None
    assert "help" not in (tmp_path / "g.dmt").read_text()
    run_line(controller, "hint")  # hints after the end are not counted
    assert read_end_hint_counts(tmp_path / "g.dmt") is None


def test_hints_are_counted_per_person_but_not_for_agents(tmp_path: Path) -> None:
    controller = GameController(
        start_recorded_game(
            tmp_path, problem="multicaregiver-crying-baby", other_agent="human", turns=3
        )
    )
    for command in ("feed", "hint", "feed", "hint"):
        run_line(controller, command)
    agents = controller.game.problem.agents
    controller.end_game()
    assert read_end_hint_counts(tmp_path / "g.dmt") == {agents[1]: 1, agents[0]: 1}
    agent_game = GameController(
        start_recorded_game(tmp_path, agent="random", record_path=tmp_path / "a.dmt")
    )
    run_line(agent_game, "hint")
    agent_game.end_game()
    assert read_end_hint_counts(tmp_path / "a.dmt") is None


def test_hint_counts_survive_a_kill_a_resume_a_branch_and_a_copy(tmp_path: Path) -> None:
    game = start_recorded_game(tmp_path)
    run_line(GameController(game), "hint")
    assert game.recorder is not None
    game.recorder.close()
    resumed_game = resume_game(ResumeRequest(tmp_path / "g.dmt"))
    run_line(GameController(resumed_game), "values")
    run_line(GameController(resumed_game), f"save {tmp_path / 'copy.dmt'}")
    resumed_game.finish()
    assert read_end_hint_counts(tmp_path / "g.dmt") == {"agent": 2}
    assert verify(tmp_path / "copy.dmt").hint_counts == {"agent": 2}
    branch = branch_game(BranchRequest(tmp_path / "g.dmt", turn=0, record_path=tmp_path / "b.dmt"))
    branch.finish()
    assert read_end_hint_counts(tmp_path / "b.dmt") == {"agent": 2}


def test_an_unrecorded_game_saves_its_hint_counts(tmp_path: Path) -> None:
    recorded_game = start_recorded_game(tmp_path)
    assert recorded_game.recorder is not None
    game = Game(
        "hexworld",
        recorded_game.session,
        recorded_game.player_names,
        recorded_game.keyboard,
        None,
        recorded_game.request,
    )
    run_line(GameController(game), "hint")
    run_line(GameController(game), f"save {tmp_path / 'copy.dmt'}")
    assert verify(tmp_path / "copy.dmt").hint_counts == {"agent": 1}


def test_playback_does_not_stop_at_hint_counts(tmp_path: Path) -> None:
    controller = GameController(start_recorded_game(tmp_path))
    for command in ("hint", "e", "hint", "e"):
        run_line(controller, command)
    controller.end_game()
    playback = Playback(tmp_path / "g.dmt")
    assert [*playback.iter_agent_turns()] == [0, 1]
    playback.undo()
    assert len(playback.session.turns) == 1
    assert playback.session.hint_counts == {"agent": 2}


HINT_COUNT_LINE = 'help: {"agent": 1}\n'
FINDING_BY_REPLACEMENT = {  # replacement of the line: expected finding
    "": "end: keys",
    'help: {"agent": 2}\n': "end: help",
    'help: {"agnt": 1}\n': "inputs: help: expected counts for one or more of agent",
    'help: {"agent": 0}\n': "help: expected whole numbers of 1 or more",
    "help: 1\n": "inputs: help: expected counts for one or more of agent",
}


def test_a_changed_hint_count_is_found(tmp_path: Path) -> None:
    controller = GameController(start_recorded_game(tmp_path))
    run_line(controller, "hint")
    run_line(controller, "e")
    controller.end_game()
    path = tmp_path / "g.dmt"
    original = path.read_text()

    def verify_after_change(before: str, after: str) -> str:
        path.write_text(original)
        replace_in_file(path, before, after)
        return str(verify(path).findings[0])

    for after, finding in FINDING_BY_REPLACEMENT.items():
        assert finding in verify_after_change(
            HINT_COUNT_LINE if after else f"{HINT_COUNT_LINE}\n", after
        ), after
    assert "end: help" in verify_after_change('"help": {"agent": 1}, ', "")


def test_a_rewritten_file_preserves_its_hint_counts(tmp_path: Path) -> None:
    controller = GameController(start_recorded_game(tmp_path))
    run_line(controller, "hint")
    run_line(controller, "e")
    controller.end_game()
    before = (tmp_path / "g.dmt").read_text()
    replace_in_file(tmp_path / "g.dmt", '"(8,2)"', '"(8,1)"')
    run_dmplay(tmp_path, "verify", "g.dmt", "--update")
    assert (tmp_path / "g.dmt").read_text() == before


# Overlays


def test_an_overlay_is_counted_once_for_each_turn_that_shows_it(tmp_path: Path) -> None:
    game = start_recorded_game(tmp_path)
    # values, values and policy, states
    play_keys(game, "h", "V", "L", "h", "?", "x", "V", "V", "V", "h")
    assert game.session.hint_counts == {"agent": 2}
    catch_game = start_recorded_game(tmp_path, problem="catch", record_path=tmp_path / "c.dmt")
    play_keys(catch_game, "V", "V")
    assert not catch_game.session.hint_counts


# Games that forbid hints


@pytest.mark.parametrize("command", ["hint", "values", "policy"])
def test_a_game_may_forbid_hints(command: str, tmp_path: Path) -> None:
    controller = GameController(start_recorded_game(tmp_path, strict="hints"))
    with pytest.raises(
        BadParameter, match=rf"^{command}: this game forbids hints \(--strict=hints\)$"
    ):
        run_line(controller, command)
    with pytest.raises(BadParameter, match="undo: this game is strict"):
        run_line(controller, "undo")
    assert 'strict: "hints"\n' in (tmp_path / "g.dmt").read_text()
    controller.end_game()
    assert verify(tmp_path / "g.dmt").is_ok
    run_line(controller, "restart")
    assert controller.game.hints_forbidden


def test_the_screen_of_a_game_that_forbids_hints_shows_none(tmp_path: Path) -> None:
    game = start_recorded_game(tmp_path, strict="hints")
    screen = play_keys(game, "tab", "V")
    assert "hint" not in screen.frames[0]
    assert "? help  q quit  : command" in screen.frames[0]
    assert "hint: this game forbids hints (--strict=hints)" in screen.frames[1]
    assert "overlay: this game forbids hints (--strict=hints)" in screen.last
    assert not game.session.hint_counts


def test_an_overlay_is_closed_by_a_game_that_forbids_hints(tmp_path: Path) -> None:
    screen = PlayScreen(
        GameController(start_recorded_game(tmp_path)), Terminal(True, "", True, True, False)
    )
    screen.show_next_overlay()
    assert screen.frame_state.overlay == "values"
    screen.controller.set_game(
        start_recorded_game(tmp_path, strict="hints", record_path=tmp_path / "s.dmt")
    )
    assert not screen.frame_state.overlay


def test_hints_in_a_transcript_that_forbids_them_are_rejected(tmp_path: Path) -> None:
    controller = GameController(start_recorded_game(tmp_path))
    run_line(controller, "hint")
    controller.end_game()
    replace_in_file(tmp_path / "g.dmt", "seed: 7\n", 'seed: 7\nstrict: "hints"\n')
    with pytest.raises(BadTranscript, match="got help, but the game is strict"):
        read_transcript(tmp_path / "g.dmt")


@pytest.mark.parametrize(
    ("options", "strict"),
    [
        ((), False), (("--strict",), True), (("--strict=hints",), "hints"),
        (("--strict", "--reveal"), True), (("--strict", "--strict=hints"), "hints"),
    ],
)  # fmt: skip
def test_strict_has_an_optional_value(
    options: tuple[str, ...], strict: object, tmp_path: Path
) -> None:
    controller = GameController(cli_interpreter=interpret_command)
    controller.run_command_words(
        ["play", "hexworld", "--seed", "7", "-o", str(tmp_path / "s.dmt"), *options]
    )
    assert read_transcript(tmp_path / "s.dmt").header.strict == strict


def test_an_unknown_value_of_strict_is_rejected(tmp_path: Path) -> None:
    with pytest.raises(BadParameter, match="--strict"):
        GameController(cli_interpreter=interpret_command).run_command_words(
            ["play", "hexworld", "--strict=hint"]
        )


@pytest.mark.parametrize(
    ("value", "expected"),
    [
        ("true", '"strict": true'), ('"hints"', '"strict": "hints"'), ("false", ""),
        ("3", "play.strict: got 3, expected true or false"), ('"x"', "play.strict: got 'x'"),
    ],
)  # fmt: skip
def test_the_config_file_sets_strictness(value: str, expected: str, tmp_path: Path) -> None:
    (tmp_path / ".config" / "dmplay").mkdir(parents=True)
    (tmp_path / ".config" / "dmplay" / "config.toml").write_text(f"[play]\nstrict = {value}\n")
    process = run_dmplay(
        tmp_path, "hexworld", "--agent", "random", "--turns", "1", "-o", "g.dmt", "-q"
    )
    if process.returncode:
        assert expected in process.stderr
    else:
        text = (tmp_path / "g.dmt").read_text()
        assert expected.replace('"strict"', "strict") in text
        assert ("strict" in text) == bool(expected)


def test_the_play_again_command_preserves_strictness(tmp_path: Path) -> None:
    game = start_recorded_game(tmp_path, seed=None, strict="hints")
    assert " --strict=hints " in game.play_again_command
    assert (
        " --strict "
        in start_recorded_game(
            tmp_path, seed=None, strict=True, record_path=tmp_path / "s.dmt"
        ).play_again_command
    )
