"""The gallery: what it lists and tells in each room, what its keys do, and what follows."""

import sys
from collections.abc import Iterable
from pathlib import Path

import pytest
from prompt_toolkit.input import PipeInput, create_pipe_input

from dmplay import records
from dmplay.finding import problems
from dmplay.finding.names import problem_names
from dmplay.gallery import gallery as module
from dmplay.gallery.gallery import Gallery
from dmplay.gallery.offers import (
    INSTALLED_HEADING,
    KIND_HEADINGS,
    ProblemEntry,
    list_problem_entries,
)
from dmplay.game.request import GameRequest
from dmplay.game.start import start_game
from dmplay.game.table import GameController
from dmplay.painting.painter import Painter
from dmplay.screen import toolkit
from dmplay.screen.frame import compose_frame
from dmplay.screen.screen import PlayScreen
from dmplay.screen.shown import Viewport
from dmplay.terminal import Terminal as Way
from dmplay.views.style import DrawOptions
from dmplay.words.commands import PlayerQuit, run_line
from tests.support.brought import installed
from tests.support.screens import SEQUENCES, Easel, Paper
from tests.support.terminals import CTRL_C, CTRL_D, CTRL_Z, DOWN, ENTER, ESCAPE, Terminal, colours

DAY = "20261122"
SIZES = [(50, 14), (80, 24), (120, 40), (200, 60), (1, 1), (20, 2), (30, 3), (9, 5), (71, 16)]


@pytest.fixture(autouse=True)
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where games are kept."""
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path / "state"))
    monkeypatch.chdir(tmp_path)
    records._warn_once.cache_clear()
    return tmp_path


def hung(*, ascii_: bool = False, chosen: str = "", listed: Iterable[ProblemEntry] = ()) -> Gallery:
    """A gallery, the preview of the chosen one made."""
    shown = Gallery([*listed] or list_problem_entries(), Way(True, "", True, True, ascii_), DAY)
    names = [one.name for one in shown.visible_entries]
    shown.move_cursor(names.index(chosen) if chosen else 0)
    shown.handle_key("")
    return shown


def drawn(shown: Gallery, width: int = 80, height: int = 24) -> list[str]:
    """The rows in a room."""
    room = Viewport(width, height, shown.terminal.ascii)
    return [row.plain for row in shown.compose_rows(room)]


def played(name: str, *lines: str, turns: int | None = None) -> GameController:
    """A game that was played and left."""
    table = GameController(on_game_end=records.record_finished_game)
    table.set_game(start_game(GameRequest(name, seed=7, turns=turns)))
    for line in lines:
        run_line(table, line)
    table.end_game()
    return table


class Looked(Gallery):
    """A gallery that is looked at after each frame, and then given its next key."""

    def follow(self, keys: Iterable[str], pipe: PipeInput, paper: Paper) -> "Looked":
        """What keys to press, into what, and where to look."""
        self.keys, self.pipe, self.paper = iter(keys), pipe, paper
        self.frames: list[str] = []
        self.thinking_delay_seconds = 60.0
        return self

    def paint(self, painter: Painter) -> None:
        """Paints, and looks."""
        super().paint(painter)
        self.frames.append(self.paper.text)
        if len(self.frames) > 1:  # the first is that before anything is told
            key = next(self.keys, "c-d")
            self.pipe.send_text(SEQUENCES.get(key, key))


def pressed(*keys: str, size: tuple[int, int] = (80, 24)) -> Looked:
    """What came of keys, each pressed after the frame of the one before."""
    paper = Paper()
    with create_pipe_input() as pipe:
        shown = Looked(list_problem_entries(), Way(True, "", True, True, False), DAY).follow(
            keys, pipe, paper
        )
        toolkit.run_event_loop(shown, Easel(paper, *size), pipe)
    return shown


def test_every_problem_stands_under_its_kind_and_every_kind_has_words() -> None:
    listed = list_problem_entries()
    assert sorted(one.name for one in listed) == [*problem_names()]
    for name, heading in listed:
        assert heading == KIND_HEADINGS[problems.load_problem(name).kind]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("ascii_", [False, True])
def test_every_room_is_filled_to_the_row_and_never_overflows(
    size: tuple[int, int], ascii_: bool
) -> None:
    for name in ("2048", "catch", "predator-prey"):
        rows = drawn(hung(ascii_=ascii_, chosen=name), *size)
        assert len(rows) == size[1]
        assert max(map(len, rows)) <= size[0]
        assert not ascii_ or "".join(rows).isascii()


@pytest.mark.parametrize("name", problem_names())
def test_beside_the_list_stand_the_first_frame_the_goal_and_the_agents(name: str) -> None:
    shown = hung(chosen=name)
    made = shown._previews[name]
    assert not isinstance(made, str)
    rows = drawn(shown)
    text = " ".join(" ".join(row[module.LIST_COLUMNS :].split()) for row in rows)
    assert f"> {name}" in "\n".join(rows)
    assert f"goal: {made.goal}" in text
    assert "agents: " in text
    board = made.view_module.iter_boards(made.view, DrawOptions(48, 12, allow_large=True))
    assert any(row in "\n".join(rows) for one in board for row in one.plain.split("\n") if row)


def test_a_small_terminal_has_the_list_alone_and_the_goal_below() -> None:
    rows = drawn(hung(chosen="collaborative-predator-prey"), 50, 14)
    assert any(row.startswith("> collaborative-predator-prey") for row in rows)
    assert rows[-2].startswith(" goal: ")
    assert not any("agents" in row for row in rows)


def test_a_small_terminal_has_the_whole_seed_of_the_day_and_a_whole_goal() -> None:
    shown = drawn(hung(), 50, 14)
    assert shown[0].strip() == f"dmplay  15 problems   today's seed {hung().daily_seed}"
    assert not any("…" in row for row in shown)


def test_a_row_of_keys_that_has_no_room_keeps_the_most_important() -> None:
    assert "Enter play" in drawn(hung(), 80)[-1]
    assert "c go on" in drawn(hung(), 80)[-1]
    assert drawn(hung(), 30)[-1].split() == ["Enter", "play", "?", "help", "q", "quit"]


def test_the_fewest_rows_hold_the_chosen_one_then_the_keys_below_it_then_the_title_above() -> None:
    few = [drawn(hung(chosen="catch"), 20, rows) for rows in (1, 2, 3)]
    assert [[row[:7] for row in rows] for rows in few] == [
        ["> catch"],
        ["> catch", " Enter "],
        [" dmplay", "> catch", " Enter "],
    ]


def test_keys_choose_and_stop_at_either_end() -> None:
    names = [one.name for one in list_problem_entries()]
    for keys, at in (
        (["up"], 0), (["down"], 1), (["j", "j", "k"], 1), (["end"], -1), (["end", "down"], -1),
        (["end", "home"], 0), (["pagedown"], -1), (["pagedown", "pageup"], 0),
    ):  # fmt: skip
        assert pressed(*keys).selected_problem == names[at], keys


def test_the_list_is_drawn_before_what_stands_beside_it() -> None:
    first, second, *_ = pressed().frames
    assert "> 2048" in first
    assert "goal" not in first
    assert "goal: merge equal tiles" in second


def test_a_filter_narrows_the_list_by_name_or_kind_and_escape_widens_it() -> None:
    shown = pressed("/", *"HEX", "enter")
    assert [one.name for one in shown.visible_entries] == ["hexworld"]
    assert "only 'HEX'; Esc shows all" in shown.frames[-1]
    shown = pressed("/", *"pomdp")
    assert len(shown.visible_entries) == 4
    shown = pressed("/", *"hexx", "backspace", "escape")
    assert len(shown.visible_entries) == len(list_problem_entries())
    assert shown.selected_problem == "hexworld"
    shown = pressed("/", *"nothing", "enter", "enter")
    assert "nothing of this name or kind" in shown.frames[-1]
    assert shown.pending_command == ()


@pytest.mark.parametrize(
    ("keys", "wants"),
    [
        (["enter"], ("play", "2048")),
        (["down", "enter"], ("play", "cart-pole")),
        (["d"], ("play", "2048", "--seed", DAY)),
        (["a"], ("play", "2048", "--agent", "expectimax")),
        (["/", *"paper", "enter", "a"], ("play", "rock-paper-scissors", "--agent", "frequency")),
        ([":"], ("shell",)),
        (["q"], ()),
        (["/", ":", "q", "escape", "q"], ()),
    ],
)
def test_keys_play_watch_type_and_leave(keys: list[str], wants: tuple[str, ...]) -> None:
    assert pressed(*keys).pending_command == wants


def test_c_goes_on_with_the_game_that_was_left_the_chosen_problems_own_first() -> None:
    assert pressed("c").pending_command == ()
    assert "no game is unfinished" in pressed("c").frames[-1]
    hexworld, car = played("hexworld", "e"), played("mountain-car", "left", "left")
    assert hexworld.game.transcript_path
    assert car.game.transcript_path
    shown = pressed("c")
    assert shown.pending_command[0] == "resume"
    assert Path(shown.pending_command[1]) in (
        hexworld.game.transcript_path,
        car.game.transcript_path,
    )
    shown = pressed("down", "down", "down", "down", "c")
    assert "left after 2 turns; c goes on" in shown.frames[-1]
    assert shown.pending_command == ("resume", str(car.game.transcript_path))


def test_your_best_and_your_last_result_stand_beside_the_problem() -> None:
    assert "best -" not in "\n".join(drawn(hung(chosen="prisoners-dilemma")))
    played("prisoners-dilemma", *["c"] * 10)
    text = "\n".join(drawn(hung(chosen="prisoners-dilemma")))
    assert "best -10 in 10 turns, seed 7" in text
    assert "last" not in text
    played("prisoners-dilemma", *["d"] * 10)
    assert "last -27 in 10 turns, seed 7" in "\n".join(drawn(hung(chosen="prisoners-dilemma")))


def test_the_side_panel_of_a_game_has_the_best_before_it() -> None:
    for turns in (1, 2):
        played("2048", *["left", "down", "right"][:turns], turns=2)
    table = GameController()
    table.set_game(start_game(GameRequest("2048", seed=8, turns=2)))
    screen = PlayScreen(table, Way(True, "", True, True, False))
    best = records.record_for_game(table.game)
    assert best
    assert best.best
    rows = compose_frame(table.game, Viewport(80, 24), screen.frame_state, []).plain.split("\n")
    assert any(row.split()[-2:] == ["best", f"{best.best.discounted_return:g}"] for row in rows)
    table.set_game(start_game(GameRequest("2048", seed=8)))
    screen.log_new_turns()
    assert "best" not in compose_frame(table.game, Viewport(80, 24), screen.frame_state, []).plain


def test_the_help_names_every_key_and_any_key_closes_it() -> None:
    shown = pressed("?")
    for key in module.GALLERY_KEYS:
        assert key.help in shown.frames[-1]
    assert "> 2048" in pressed("?", "x").frames[-1]
    assert len(drawn(pressed("?"), 40, 8)) == 8


def test_the_help_of_a_small_screen_goes_on_in_pages_and_nothing_of_it_is_cut() -> None:
    shown = pressed("?", *["space"] * 3, size=(50, 14))
    helps = [frame.split("\n") for frame in shown.frames if " of 3. " in frame]
    assert [rows[-3].split(". ")[0] for rows in helps] == [f" part {n} of 3" for n in (1, 2, 3)]
    assert {rows[-2] for rows in helps} == {""}
    told = " ".join(" ".join(row.strip() for row in rows[1:-3]) for rows in helps)
    for key in module.GALLERY_KEYS:
        assert key.help in told
    assert "> 2048" in shown.frames[-1]


def test_an_installed_problem_is_listed_last_and_one_that_is_broken_says_so(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    installed(place, "maze", "maze = broken_maze\n")
    (place / "broken_maze.py").write_text("")
    monkeypatch.syspath_prepend(place)
    listed = list_problem_entries()
    assert listed[-1] == ProblemEntry("maze", INSTALLED_HEADING)
    shown = hung(listed=listed, chosen="maze")
    assert "maze offers no Problem" in "\n".join(drawn(shown))
    with pytest.raises(PlayerQuit):
        shown.handle_key("enter")
    assert shown.pending_command == ("play", "maze")
    shown.handle_key("a")


@pytest.mark.slow
def test_a_game_is_played_from_the_gallery_which_comes_back_with_its_result(place: Path) -> None:
    with Terminal(folder=place) as terminal:
        terminal.until("goal: merge").ready().press("/dilemma" + ENTER, "> prisoners-dilemma")
        terminal.press("k", "goal: ").press(ENTER, "turn 0/10").calm()
        for turn in range(1, 11):
            terminal.press("c", f"turn {turn}/10")
        terminal.press("q", "prisoners-dilemma: turn limit after 10 turns. agent1 score -10").calm()
        assert "best -10 in 10 turns" in terminal.text
        terminal.press("d", "seed 2").calm().press("q", "> prisoners-dilemma").calm()
        assert terminal.press("q").ended() == 0
        assert terminal.left_clean()
        assert "transcript: " in terminal.text


@pytest.mark.slow
def test_the_typed_shell_opens_and_gives_way_to_the_gallery_again(place: Path) -> None:
    with Terminal(folder=place) as terminal:
        terminal.until("goal: merge").ready().press(":", "dmplay>").calm()
        terminal.press("hexworld --seed 7\r", "t0]>").press("e\r", "t1]>").calm()
        terminal.press("quit\r", "> 2048").until("hexworld: quit after 1 turn").calm()
        assert terminal.press(DOWN, "> cart-pole").press("q").ended() == 0
        assert terminal.left_clean()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("leave", "code"), [("q", 0), (CTRL_D, 0), (CTRL_C, 130), ("TERM", 143), ("HUP", 129)]
)
def test_however_it_is_left_the_terminal_is_as_it_was(place: Path, leave: str, code: int) -> None:
    with Terminal(folder=place) as terminal:
        terminal.until("goal: merge").ready().calm()
        for size in ((50, 14), (200, 60), (20, 3), (80, 24)):
            terminal.resize(*size).calm()
        assert "> 2048" in terminal.text
        if len(leave) == 1:
            terminal.press(leave)
        else:
            terminal.signal({"TERM": 15, "HUP": 1}[leave])
        assert terminal.ended() == code
        assert terminal.left_clean()
        assert "Traceback" not in terminal.printed


@pytest.mark.slow
def test_it_stops_and_goes_on_as_other_programs_do(place: Path) -> None:
    bash = ("bash", "--norc", "--noprofile", "-i")
    with Terminal(command=bash, folder=place, env={"PS1": "ready> "}) as terminal:
        start = f"{sys.executable} -m dmplay\r"
        terminal.until("ready>").press(start, "goal: merge").ready().calm()
        terminal.press(CTRL_Z, "Stopped").calm().press("fg\r", "> 2048").calm(0.5)
        terminal.press(DOWN, "> cart-pole").press("q").calm()
        terminal.press("echo code=$?\r", "code=0").press("exit\r")
        assert terminal.ended() == 0


@pytest.mark.slow
@pytest.mark.parametrize("env", [{"TERM": "dumb"}, {"ACCESSIBLE": "1"}, {"DMPLAY_PLAIN": "1"}])
def test_where_nothing_can_be_drawn_it_is_the_typed_shell(place: Path, env: dict[str, str]) -> None:
    with Terminal(folder=place, env=env) as terminal:
        terminal.until("dmplay>").press("list games\r", "no game is kept").press(CTRL_D)
        assert terminal.ended() == 0
        assert "\x1b[?1049h" not in terminal.printed


@pytest.mark.slow
def test_without_colour_no_code_of_a_colour_is_written(place: Path) -> None:
    with Terminal(folder=place, env={"NO_COLOR": "1"}) as terminal:
        terminal.until("goal: merge").ready().press(DOWN, "> cart-pole").press(ESCAPE).calm()
        terminal.press("q").ended()
        assert not colours(terminal.printed)
