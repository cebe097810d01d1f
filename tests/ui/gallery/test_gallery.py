"""Tests of the gallery: its rows in viewports of every size, its keys and its commands."""

import sys
import time
from collections.abc import Iterable
from datetime import UTC, date, datetime
from pathlib import Path

import pytest
from prompt_toolkit.input import PipeInput, create_pipe_input

from dmplay.core.state_files import warn_once
from dmplay.draw.options import DrawOptions
from dmplay.game import player_records
from dmplay.game.game_series import GameController
from dmplay.game.game_setup import start_game
from dmplay.game.launch_requests import GameRequest
from dmplay.registry import problems
from dmplay.registry.builtin_names import problem_names
from dmplay.terminal.capabilities import Terminal as Way
from dmplay.terminal.painter import Painter
from dmplay.tutor.lesson_list import find_unplayed_first_game
from dmplay.tutor.progress import PASSED, StepRecord, current_day, save_step
from dmplay.ui.gallery import gallery as module
from dmplay.ui.gallery.gallery import Gallery
from dmplay.ui.gallery.problem_entries import (
    INSTALLED_HEADING,
    KIND_HEADINGS,
    ProblemEntry,
    list_problem_entries,
)
from dmplay.ui.screen import event_loop
from dmplay.ui.screen.frame import compose_frame
from dmplay.ui.screen.frame_state import Viewport
from dmplay.ui.screen.play_screen import PlayScreen
from dmplay.ui.shell.commands import PlayerQuit, run_line
from tests.support.screens import KEY_SEQUENCES, EmulatedPainter, EmulatedScreen
from tests.support.terminals import (
    CTRL_C,
    CTRL_D,
    CTRL_Z,
    DOWN,
    ENTER,
    ESCAPE,
    Terminal,
    list_colour_codes,
)
from tests.support.user_problems import write_package_metadata

TODAY, DAILY_SEED = date(2026, 11, 22), "2026112202"  # of hexworld; that of the date is short
FIRST_ROW, SECOND_ROW, FIRST_GOAL = "> hexworld", "> 2048", "goal: reach exit"
VIEWPORT_SIZES = [
    (50, 14),
    (80, 24),
    (120, 40),
    (200, 60),
    (1, 1),
    (20, 2),
    (30, 3),
    (9, 5),
    (71, 16),
]


@pytest.fixture(autouse=True)
def working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, which also contains the saved games; the first game was played."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    first_game = find_unplayed_first_game()
    assert first_game
    save_step(first_game, 0, StepRecord(PASSED, 1, 0))
    monkeypatch.chdir(tmp_path)
    warn_once.cache_clear()
    return tmp_path


def make_gallery(
    *, ascii_: bool = False, chosen: str = "", entries: Iterable[ProblemEntry] = ()
) -> Gallery:
    """Make a gallery in which the preview of the chosen problem is loaded."""
    gallery = Gallery(
        [*entries] or list_problem_entries(), Way(True, "", True, True, ascii_), TODAY
    )
    names = [entry.name for entry in gallery.visible_entries]
    gallery.move_cursor(names.index(chosen) if chosen else 0)
    gallery.handle_key("")
    return gallery


def render_gallery_rows(gallery: Gallery, width: int = 80, height: int = 24) -> list[str]:
    """Return the rows of a gallery in a viewport of this size."""
    viewport = Viewport(width, height, gallery.terminal.ascii)
    return [row.plain for row in gallery.compose_rows(viewport)]


def play_game(name: str, *lines: str, turns: int | None = None) -> GameController:
    """Play these lines of a game and end it."""
    controller = GameController(on_game_end=player_records.record_finished_game)
    controller.set_game(start_game(GameRequest(name, seed=7, turns=turns)))
    for line in lines:
        run_line(controller, line)
    controller.end_game()
    return controller


class KeyFeedingGallery(Gallery):
    """A gallery that records each frame and then sends its next key."""

    def follow(
        self, keys: Iterable[str], pipe: PipeInput, paper: EmulatedScreen
    ) -> "KeyFeedingGallery":
        """Set the keys, the pipe that they are sent to and the paper that frames are read from."""
        self.keys, self.pipe, self.paper = iter(keys), pipe, paper
        self.frames: list[str] = []
        self.thinking_delay_seconds = 60.0
        return self

    def paint(self, painter: Painter) -> None:
        """Paint a frame, record it and send the next key."""
        super().paint(painter)
        self.frames.append(self.paper.text)
        if len(self.frames) > 1:  # the first frame is drawn before the preview
            key = next(self.keys, "c-d")
            self.pipe.send_text(KEY_SEQUENCES.get(key, key))


def press_keys(*keys: str, size: tuple[int, int] = (80, 24)) -> KeyFeedingGallery:
    """Press each key after the frame of the previous one; return the gallery."""
    paper = EmulatedScreen()
    with create_pipe_input() as pipe:
        gallery = KeyFeedingGallery(
            list_problem_entries(), Way(True, "", True, True, False), TODAY
        ).follow(keys, pipe, paper)
        event_loop.run_event_loop(gallery, EmulatedPainter(paper, *size), pipe)
    return gallery


def test_every_problem_is_listed_under_the_heading_of_its_kind() -> None:
    entries = list_problem_entries()
    assert sorted(entry.name for entry in entries) == sorted(problem_names())
    for name, heading, _ in entries:
        kind = problems.load_problem(name).kind
        assert heading == KIND_HEADINGS[kind]
        assert f"({kind})" in heading
        assert len(heading) <= module.LIST_COLUMNS - 2


def test_the_problems_of_a_kind_are_in_the_order_of_the_book() -> None:
    names = [entry.name for entry in list_problem_entries()]
    assert names[:2] == ["hexworld", "2048"]
    assert names[6:10] == ["crying-baby", "machine-replacement", "catch", "bandit"]


@pytest.mark.parametrize("size", VIEWPORT_SIZES)
@pytest.mark.parametrize("ascii_", [False, True])
def test_every_viewport_is_filled_and_does_not_overflow(
    size: tuple[int, int], ascii_: bool
) -> None:
    for name in ("2048", "catch", "predator-prey"):
        rows = render_gallery_rows(make_gallery(ascii_=ascii_, chosen=name), *size)
        assert len(rows) == size[1]
        assert max(map(len, rows)) <= size[0]
        assert not ascii_ or "".join(rows).isascii()


@pytest.mark.parametrize("name", problem_names())
def test_the_preview_shows_the_first_frame_the_goal_and_the_agents(name: str) -> None:
    gallery = make_gallery(chosen=name)
    preview = gallery._previews[name]
    assert not isinstance(preview, str)
    rows = render_gallery_rows(gallery)
    text = " ".join(" ".join(row[module.LIST_COLUMNS :].split()) for row in rows)
    assert f"> {name}" in "\n".join(rows)
    assert f"goal: {preview.goal}" in text
    assert "agents: " in text
    boards = preview.view_module.iter_boards(preview.view, DrawOptions(48, 12, allow_large=True))
    assert any(row in "\n".join(rows) for board in boards for row in board.plain.split("\n") if row)


def test_a_small_terminal_shows_only_the_list_and_the_goal() -> None:
    rows = render_gallery_rows(make_gallery(chosen="collaborative-predator-prey"), 50, 14)
    assert any(row.startswith("> collaborative-predator-prey") for row in rows)
    assert rows[-2].startswith(" goal: ")
    assert not any("agents" in row for row in rows)


def test_the_game_of_the_day_is_that_of_utc_in_every_time_zone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    days = set()
    for zone in ("Pacific/Kiritimati", "Pacific/Pago_Pago", "UTC"):  # 25 hours apart
        monkeypatch.setenv("TZ", zone)
        time.tzset()
        days.add(current_day())
    monkeypatch.delenv("TZ")
    time.tzset()
    assert days == {datetime.now(UTC).date()}


def test_a_small_terminal_shows_the_full_daily_seed_and_goal() -> None:
    rows = render_gallery_rows(make_gallery(), 50, 14)
    count = len(problem_names())
    assert rows[0].strip() == f"dmplay  {count} problems   daily seed {DAILY_SEED}"
    assert not any("…" in row for row in rows)


def test_a_narrow_key_row_shows_the_most_important_keys() -> None:
    assert "Enter play" in render_gallery_rows(make_gallery(), 80)[-1]
    assert "c resume" not in render_gallery_rows(make_gallery(), 80)[-1]
    assert render_gallery_rows(make_gallery(), 30)[-1].split() == [
        "Enter",
        "play",
        "?",
        "help",
        "q",
        "quit",
    ]


def test_tiny_viewports_show_the_cursor_row_then_the_keys_then_the_title() -> None:
    row_lists = [render_gallery_rows(make_gallery(chosen="catch"), 20, rows) for rows in (1, 2, 3)]
    assert [[row[:7] for row in rows] for rows in row_lists] == [
        ["> catch"],
        ["> catch", " Enter "],
        [" dmplay", "> catch", " Enter "],
    ]


def test_keys_move_the_cursor_and_stop_at_either_end() -> None:
    names = [entry.name for entry in list_problem_entries()]
    for keys, index in (
        (["up"], 0), (["down"], 1), (["j", "j", "k"], 1), (["end"], -1), (["end", "down"], -1),
        (["end", "home"], 0), (["pagedown"], -1), (["pagedown", "pageup"], 0),
    ):  # fmt: skip
        assert press_keys(*keys).selected_problem == names[index], keys


def test_the_list_is_drawn_before_the_preview() -> None:
    first, second, *_ = press_keys().frames
    assert FIRST_ROW in first
    assert "goal" not in first
    assert FIRST_GOAL in second


def test_a_filter_selects_by_name_or_kind_and_escape_clears_it() -> None:
    gallery = press_keys("/", *"HEX", "enter")
    assert [entry.name for entry in gallery.visible_entries] == ["hexworld"]
    assert "filter 'HEX'; Esc shows all" in gallery.frames[-1]
    gallery = press_keys("/", *"pomdp")
    assert [entry.name for entry in gallery.visible_entries] == [
        entry.name for entry in list_problem_entries() if "POMDP" in entry.heading
    ]
    assert "crying-baby" in gallery.frames[-1]
    gallery = press_keys("/", *"hexx", "backspace", "escape")
    assert len(gallery.visible_entries) == len(list_problem_entries())
    assert gallery.selected_problem == "hexworld"
    gallery = press_keys("/", *"nothing", "enter", "enter")
    assert "no problem matches" in gallery.frames[-1]
    assert gallery.pending_command == ()


@pytest.mark.parametrize(
    ("keys", "command"),
    [
        (["enter"], ("play", "hexworld")),
        (["down", "enter"], ("play", "2048")),
        (["d"], ("play", "hexworld", "--seed", DAILY_SEED)),
        (["down", "a"], ("play", "2048", "--agent", "expectimax")),
        (["g", "enter"], ("play", "hexworld", "--ghost", "optimal")),
        (["g", "g", "g", "d"], ("play", "hexworld", "--seed", DAILY_SEED, "--ghost", "random")),
        (["g", "down", "enter"], ("play", "2048")),
        (["g"] * 5 + ["enter"], ("play", "hexworld")),
        (["/", *"paper", "enter", "a"], ("play", "rock-paper-scissors", "--agent", "plan-rounds")),
        ([":"], ("shell",)),
        (["q"], ()),
        (["/", ":", "q", "escape", "q"], ()),
    ],
)
def test_keys_play_watch_open_the_shell_and_quit(keys: list[str], command: tuple[str, ...]) -> None:
    assert press_keys(*keys).pending_command == command


def test_c_resumes_an_unfinished_game_of_the_selected_problem_first() -> None:
    assert press_keys("c").pending_command == ()
    assert "there is no unfinished game" in press_keys("c").frames[-1]
    hexworld, car = play_game("hexworld", "e"), play_game("mountain-car", "left", "left")
    assert hexworld.game.transcript_path
    assert car.game.transcript_path
    gallery = press_keys("c")
    assert gallery.pending_command[0] == "resume"
    assert Path(gallery.pending_command[1]) in (
        hexworld.game.transcript_path,
        car.game.transcript_path,
    )
    gallery = press_keys("down", "down", "down", "c")
    assert "unfinished after 2 turns; c resumes it" in gallery.frames[-1]
    assert gallery.pending_command == ("resume", str(car.game.transcript_path))


def test_the_preview_shows_your_best_and_last_results() -> None:
    assert "best -" not in "\n".join(render_gallery_rows(make_gallery(chosen="prisoners-dilemma")))
    play_game("prisoners-dilemma", *["c"] * 10)
    text = "\n".join(render_gallery_rows(make_gallery(chosen="prisoners-dilemma")))
    assert "record -10 in 10 turns, seed 7" in text
    assert "last" not in text
    play_game("prisoners-dilemma", *["d"] * 10)
    assert "last -27 in 10 turns, seed 7" in "\n".join(
        render_gallery_rows(make_gallery(chosen="prisoners-dilemma"))
    )


def test_the_side_panel_of_a_game_shows_the_best_earlier_result() -> None:
    for turns in (1, 2):
        play_game("2048", *["left", "down", "right"][:turns], turns=2)
    controller = GameController()
    controller.set_game(start_game(GameRequest("2048", seed=8, turns=2)))
    screen = PlayScreen(controller, Way(True, "", True, True, False))
    record = player_records.find_game_record(controller.game)
    assert record
    assert record.best
    rows = compose_frame(controller.game, Viewport(80, 24), screen.frame_state, []).plain.split(
        "\n"
    )
    assert any(row.split()[-2:] == ["record", f"{record.best.discounted_return:g}"] for row in rows)
    controller.set_game(start_game(GameRequest("2048", seed=8)))
    screen.log_new_turns()
    assert (
        "record"
        not in compose_frame(controller.game, Viewport(80, 24), screen.frame_state, []).plain
    )


def test_the_help_lists_every_key_and_any_key_closes_it() -> None:
    gallery = press_keys("?")
    for key in module.GALLERY_KEYS:
        assert key.help in gallery.frames[-1]
    assert FIRST_ROW in press_keys("?", "x").frames[-1]
    assert len(render_gallery_rows(press_keys("?"), 40, 8)) == 8


def test_the_help_of_a_small_screen_is_split_into_pages_without_loss() -> None:
    gallery = press_keys("?", *["space"] * 3, size=(50, 14))
    pages = [frame.split("\n") for frame in gallery.frames if " of 3; " in frame]
    assert [rows[-3].split("; ")[0] for rows in pages] == [f" page {n} of 3" for n in (1, 2, 3)]
    assert {rows[-2] for rows in pages} == {""}
    text = " ".join(" ".join(row.strip() for row in rows[1:-3]) for rows in pages)
    for key in module.GALLERY_KEYS:
        assert key.help in text
    assert FIRST_ROW in gallery.frames[-1]


def test_a_broken_installed_problem_is_listed_last_and_shows_its_error(
    working_folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_package_metadata(working_folder, "maze", "maze = broken_maze\n")
    (working_folder / "broken_maze.py").write_text("")
    monkeypatch.syspath_prepend(working_folder)
    entries = list_problem_entries()
    assert entries[-1] == ProblemEntry("maze", INSTALLED_HEADING)
    gallery = make_gallery(entries=entries, chosen="maze")
    assert "maze defines no Problem" in "\n".join(render_gallery_rows(gallery))
    with pytest.raises(PlayerQuit):
        gallery.handle_key("enter")
    assert gallery.pending_command == ("play", "maze")
    gallery.handle_key("a")


@pytest.mark.slow
def test_the_gallery_returns_after_a_game_and_shows_its_result(working_folder: Path) -> None:
    with Terminal(folder=working_folder) as terminal:
        terminal.until(FIRST_GOAL).ready().press("/dilemma" + ENTER, "> prisoners-dilemma")
        terminal.press("k", "goal: ").press(ENTER, "turn 0/10").calm()
        for turn in range(1, 11):
            terminal.press("c", f"turn {turn}/10")
        terminal.until("next game: rock-paper-scissors; q, then Enter plays it")
        terminal.press("q", "next: rock-paper-scissors, Enter plays it").calm()
        terminal.until("prisoners-dilemma: both cooperated").press("k", "record -10 in 10 turns")
        terminal.press("d", "seed 2").calm().press("q", "> prisoners-dilemma").calm()
        assert terminal.press("q").ended() == 0
        assert terminal.left_clean()
        assert "transcript: " in terminal.text


@pytest.mark.slow
def test_the_shell_opens_from_the_gallery_and_returns_to_it(working_folder: Path) -> None:
    with Terminal(folder=working_folder) as terminal:
        terminal.until(FIRST_GOAL).ready().press(":", "dmplay>").calm()
        terminal.press("hexworld --seed 7\r", "t0]>").press("e\r", "t1]>").calm()
        terminal.press("quit\r", FIRST_ROW).until("hexworld: quit after 1 turn").calm()
        assert terminal.press(DOWN, SECOND_ROW).press("q").ended() == 0
        assert terminal.left_clean()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("quit_input", "exit_code"), [("q", 0), (CTRL_D, 0), (CTRL_C, 130), ("TERM", 143), ("HUP", 129)]
)
def test_the_terminal_is_restored_however_the_gallery_ends(
    working_folder: Path, quit_input: str, exit_code: int
) -> None:
    with Terminal(folder=working_folder) as terminal:
        terminal.until(FIRST_GOAL).ready().calm()
        for size in ((50, 14), (200, 60), (20, 3), (80, 24)):
            terminal.resize(*size).calm()
        assert FIRST_ROW in terminal.text
        if len(quit_input) == 1:
            terminal.press(quit_input)
        else:
            terminal.signal({"TERM": 15, "HUP": 1}[quit_input])
        assert terminal.ended() == exit_code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed


@pytest.mark.slow
def test_ctrl_z_suspends_the_gallery_and_fg_resumes_it(working_folder: Path) -> None:
    bash = ("bash", "--norc", "--noprofile", "-i")
    with Terminal(command=bash, folder=working_folder, env={"PS1": "ready> "}) as terminal:
        start = f"{sys.executable} -m dmplay\r"
        terminal.until("ready>").press(start, FIRST_GOAL).ready().calm()
        terminal.press(CTRL_Z, "Stopped").calm().press("fg\r", FIRST_ROW).calm(0.5)
        terminal.press(DOWN, SECOND_ROW).press("q").calm()
        terminal.press("echo code=$?\r", "code=0").press("exit\r")
        assert terminal.ended() == 0


@pytest.mark.slow
@pytest.mark.parametrize("env", [{"TERM": "dumb"}, {"ACCESSIBLE": "1"}, {"DMPLAY_PLAIN": "1"}])
def test_the_shell_starts_on_terminals_without_full_screen_support(
    working_folder: Path, env: dict[str, str]
) -> None:
    with Terminal(folder=working_folder, env=env) as terminal:
        terminal.until("dmplay>").press("list games\r", "no saved games").press(CTRL_D)
        assert terminal.ended() == 0
        assert "\x1b[?1049h" not in terminal.printed


@pytest.mark.slow
def test_no_color_suppresses_all_colour_codes(working_folder: Path) -> None:
    with Terminal(folder=working_folder, env={"NO_COLOR": "1"}) as terminal:
        terminal.until(FIRST_GOAL).ready().press(DOWN, SECOND_ROW).press(ESCAPE).calm()
        terminal.press("q").ended()
        assert not list_colour_codes(terminal.printed)
