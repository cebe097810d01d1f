"""Recorded games as pictures, screen recordings, text, tables and data; reviewed and branched."""

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rich.text import Text

from dmplay.cli.errands import execute_result
from dmplay.game.checking import verify_file
from dmplay.game.errand import Printout
from dmplay.game.request import ReplayRequest
from dmplay.reports.drawing import texts_to_animated_svg
from dmplay.reports.export import ExportOptions, export_transcript
from tests.support.games import read_transcript, recorded
from tests.support.programs import run

pytestmark = pytest.mark.slow  # starts the program again and again


@pytest.fixture
def file(tmp_path: Path) -> Path:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nundo\nw\n")
    return tmp_path / "g.dmt"


def export(file: Path, *words: str) -> str:
    done = run(file.parent, "export", "g.dmt", *words)
    assert (done.returncode, done.stderr) == (0, "")
    return done.stdout


def test_a_picture_is_the_same_every_time_and_of_the_turn_asked_for(file: Path) -> None:
    first = export(file, "--svg", "--at", "1")
    assert first == export(file, "--svg", "--at", "1")
    assert first.startswith("<svg")
    assert first != export(file, "--svg")
    assert "turn&#160;1" in first


def test_a_picture_of_any_size_shows_who_chooses_what_is_best(file: Path) -> None:
    wishes = ("--width", "100", "--height", "30", "--at", "1")
    watched, advised = export(file, "--svg", *wishes), export(file, "--svg", *wishes, "--hint")
    assert "hint&#160;(optimal)" not in watched
    assert "@&#160;agent,&#160;" in watched
    assert "you:&#160;agent" in advised
    assert "hint&#160;(optimal):&#160;sw" in advised
    assert "b&#160;sw&#160;best" in advised  # the row of keys
    assert advised.count("<clipPath") == 30
    higher = export(file, "--text", "--height", "20").split("\n dmplay")
    assert "reach +10 or +5" in higher[1]


def test_nobody_is_advised_after_the_end(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "g.dmt")
    done = run(tmp_path, "export", "g.dmt", "--svg", "--hint")
    told = "error: --hint: nobody chooses after the end; --at shows an earlier turn\n"
    assert (done.returncode, done.stderr) == (2, told)


def test_a_film_shows_every_screen_for_a_second_and_the_last_where_nothing_may_move(
    file: Path,
) -> None:
    film = export(file, "--film")
    assert film == export(file, "--film")
    root = ElementTree.fromstring(film)
    style, *screens = root
    assert [one.get("style") for one in screens] == [f"animation-delay: {n}s" for n in range(5)]
    assert "animation: turn 5s infinite" in (style.text or "")
    assert "prefers-reduced-motion" in (style.text or "")


@pytest.mark.parametrize("form", ["--svg", "--film", "--html"])
def test_a_picture_loads_nothing_from_elsewhere(file: Path, form: str) -> None:
    drawn = export(file, form)
    assert "url(http" not in drawn.replace('"', "").replace("'", "")
    assert "@font-face" not in drawn


def test_a_page_is_html(file: Path) -> None:
    assert export(file, "--html").startswith("<!DOCTYPE html>")


def test_a_screen_recording_is_an_asciicast_of_a_frame_a_turn(file: Path) -> None:
    head, *frames = map(json.loads, export(file, "--cast").splitlines())
    assert head["version"] == 2
    assert [frame[0] for frame in frames] == [0.0, 1.0, 2.0, 3.0, 4.0]
    assert all(frame[1] == "o" and "hexworld" in frame[2] for frame in frames)


def test_a_screen_recording_of_version_3_tells_how_long_each_frame_comes_after_the_last(
    file: Path,
) -> None:
    head, *frames = map(json.loads, export(file, "--cast3").splitlines())
    older = [json.loads(row) for row in export(file, "--cast").splitlines()[1:]]
    assert head == {
        "version": 3,
        "term": {"cols": 80, "rows": 24},
        "title": "dmplay hexworld",
    }
    assert [frame[0] for frame in frames] == [0.0, 1.0, 1.0, 1.0, 1.0]
    assert [frame[1:] for frame in frames] == [frame[1:] for frame in older]


def test_text_tells_every_screen(file: Path) -> None:
    told = export(file, "--text")
    assert told.count("dmplay hexworld") == 5
    assert "turn 2. at (8,2). chose NE, bumped, stayed." in told
    assert all(row == row.rstrip() for row in told.splitlines())


def test_text_is_as_wide_as_wanted_and_in_ascii_where_wanted_or_needed(file: Path) -> None:
    assert "╱" in export(file, "--text")
    assert max(map(len, export(file, "--text", "--width", "45").splitlines())) <= 45
    plain = export(file, "--text", "--ascii")
    assert plain.isascii()
    done = run(file.parent, "export", "g.dmt", "--text", PYTHONIOENCODING="ascii")
    assert done.stdout == plain
    assert export(file, "--cast", "--ascii").isascii()


def test_a_table_has_a_row_a_turn(file: Path) -> None:
    rows = list(csv.DictReader(io.StringIO(export(file, "--csv"))))
    assert [row["turn"] for row in rows] == ["0", "1", "2", "1", "2"]
    assert rows[1]["actions agent"] == "e"
    assert rows[2]["rewards agent"] == "-1"


def test_data_and_tables_name_what_is_no_turn(tmp_path: Path) -> None:
    run(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nreroll\nundo\ne\n")
    data = json.loads(export(tmp_path / "g.dmt", "--json"))
    assert [turn.get("event") for turn in data["turns"]] == [None, None, "reroll", "undo", None]
    rows = list(csv.DictReader(io.StringIO(export(tmp_path / "g.dmt", "--csv"))))
    assert [row["event"] for row in rows] == ["", "", "reroll", "undo", ""]


def test_data_is_one_object(file: Path) -> None:
    game = json.loads(export(file, "--json"))
    assert game["seed"] == 7
    assert game["end"]["turns"] == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "export: choose one of --svg, --film, --html"),
        (["--svg", "--csv"], "export: choose one of"),
        (["--svg", "--at", "9"], "--at: got 9, the game has 2 turns"),
        (["--text", "--at", "1"], "--at: a turn of --svg or --html, not of --text"),
        (["--film", "--hint"], "--hint: on a picture, --svg, not on --film"),
        (["--csv", "--width", "60"], "--width: of a screen, which --csv does not have"),
        (["--json", "--ascii"], "--ascii: of a screen, which --json does not have"),
        (["--json", "-o", "g.csv"], "-o g.csv: it is written as JSON; name it g.json"),
        (["--csv", "-o", "no/g.csv"], "cannot write no/g.csv: No such file or directory"),
    ],
)
def test_a_wish_that_cannot_be_met_is_one_line(file: Path, words: list[str], message: str) -> None:
    done = run(file.parent, "export", "g.dmt", *words)
    assert done.returncode == 2
    assert done.stderr.startswith(f"error: {message}")


def test_a_review_values_every_move_and_is_kept_as_notes(file: Path) -> None:
    told = run(file.parent, "review", "g.dmt", "--write").stdout.splitlines()
    assert told == [
        "turn  yours  best  regret",
        "1     e      se    0.78 ####################",
        "2     w      sw    0.58 ###############",
        "review: 0 of 2 moves the best, regret 1.36 in all, most in turn 1",
    ]
    assert verify_file(file).is_ok
    notes = [row for row in file.read_text().splitlines() if row.startswith("# review ")]
    assert notes[0].startswith("# review turn 1, agent: chose e, best se, regret 0.78. values: e ")
    assert len(notes) == 3
    before = file.read_text()
    run(file.parent, "review", "g.dmt", "--write")
    assert file.read_text() == before
    data = json.loads(run(file.parent, "review", "g.dmt", "--json").stdout)
    assert data[0]["best"] == ["se"]


def test_a_review_without_values_says_so(tmp_path: Path) -> None:
    run(tmp_path, "simple-regulator", "--seed", "7", "-o", "g.dmt", stdin="0\n1\n")
    told = run(tmp_path, "review", "g.dmt").stdout
    assert told == "review: no agent here knows the values of these moves\n"


def test_a_branch_shares_the_first_turns_and_its_dice(file: Path) -> None:
    done = run(file.parent, "branch", "g.dmt", "--at", "1", "-o", "b.dmt", stdin="ne\nquit\n")
    assert done.returncode == 0
    other = file.parent / "b.dmt"
    assert verify_file(other).is_ok
    kept, new = read_transcript(file), read_transcript(other)
    assert kept.blocks[1]["draws"] == new.blocks[1]["draws"]
    assert kept.blocks[2]["draws"] == new.blocks[2]["draws"]
    assert new.blocks[2]["actions"] == {"agent": "ne"}
    late = run(file.parent, "branch", "g.dmt", "--at", "9", "-o", "c.dmt")
    assert late.stderr == "error: --at: got 9, g.dmt has 2 turns\n"


def test_a_branch_keeps_the_dice_that_were_thrown_anew(tmp_path: Path) -> None:
    moves = "w\nw\nreroll\nreroll\nw\n"
    run(tmp_path, "hexworld", "--seed", "3", "-o", "g.dmt", stdin=moves)
    run(tmp_path, "branch", "g.dmt", "--at", "2", "-o", "b.dmt", stdin="e\nundo 2\nw\n")
    assert verify_file(tmp_path / "b.dmt").is_ok
    draws = [
        block["draws"]
        for block in read_transcript(tmp_path / "g.dmt").blocks
        if block.kind == "turn"
    ]
    told = [
        block["draws"]
        for block in read_transcript(tmp_path / "b.dmt").blocks
        if block.kind == "turn"
    ]
    assert told == [*draws[:3], *draws[4:], draws[4]]


def test_a_film_holds_one_of_its_pictures_at_a_time() -> None:
    drawn: list[int] = []
    parts = texts_to_animated_svg((drawn.append(n) or Text("x") for n in range(3)), 3, "three", 9)  # type: ignore[func-returns-value]
    seen = [(len(drawn), part.count("</svg>")) for part in parts]
    assert seen == [(1, 0), (1, 0), (1, 1), (2, 1), (3, 1), (3, 1)]


@pytest.mark.parametrize("form", ["text", "cast", "film"])
def test_what_is_printed_is_drawn_when_it_is_told(form: str, tmp_path: Path) -> None:
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=9)
    parts = export_transcript(
        ReplayRequest(tmp_path / "g.dmt"), [form], ExportOptions()
    ).text_chunks
    assert iter(parts) is parts  # made one by one, and by nobody before


def test_what_is_told_part_by_part_is_printed_so(capsys: pytest.CaptureFixture[str]) -> None:
    def parts() -> Iterator[str]:
        yield "one\n"
        assert capsys.readouterr().out == "one\n"
        yield "t\x1bwo"

    assert execute_result(Printout("", text_chunks=parts())) == 0
    assert capsys.readouterr().out == "t\\x1bwo\n"
