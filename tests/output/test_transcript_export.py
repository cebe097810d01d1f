"""Tests of transcripts that are exported, reviewed and branched."""

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from xml.etree import ElementTree

import pytest
from rich.text import Text

from dmplay.cli.parsed_command_runner import execute_result
from dmplay.game.command_line_results import Printout
from dmplay.game.launch_requests import ReplayRequest
from dmplay.game.transcript_verification import verify
from dmplay.output.film import texts_to_animated_svg
from dmplay.output.transcript_export import ExportOptions, export_transcript
from tests.support.games import read_transcript, record_game
from tests.support.programs import run_dmplay
from tests.support.user_problems import REGULATOR_WITHOUT_AGENTS

pytestmark = pytest.mark.slow  # starts many processes


@pytest.fixture
def transcript_path(tmp_path: Path) -> Path:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="e\nne\nundo\nw\n")
    return tmp_path / "g.dmt"


def run_export(transcript_path: Path, *arguments: str) -> str:
    completed = run_dmplay(transcript_path.parent, "export", "g.dmt", *arguments)
    assert (completed.returncode, completed.stderr) == (0, "")
    return completed.stdout


def test_a_picture_is_reproducible_and_shows_the_requested_turn(transcript_path: Path) -> None:
    first = run_export(transcript_path, "--svg", "--at", "1")
    assert first == run_export(transcript_path, "--svg", "--at", "1")
    assert first.startswith("<svg")
    assert first != run_export(transcript_path, "--svg")
    assert "turn&#160;1" in first
    assert "quit" not in first  # no key works in a picture


def test_a_picture_of_any_size_shows_a_hint_to_the_player(transcript_path: Path) -> None:
    options = ("--width", "100", "--height", "30", "--at", "1")
    without_hint = run_export(transcript_path, "--svg", *options)
    with_hint = run_export(transcript_path, "--svg", *options, "--hint")
    assert "hint&#160;by" not in without_hint
    assert "@&#160;agent,&#160;" in without_hint
    assert "@&#160;agent,&#160;" not in with_hint
    assert "hint&#160;by&#160;optimal:&#160;sw" in with_hint
    assert "=sw&#160;best" in with_hint  # the row of keys
    assert with_hint.count("<clipPath") == 30
    screens = run_export(transcript_path, "--text", "--height", "20").split("\n hexworld  ")
    assert "reach exit +10 or +5" in screens[1]


def test_a_hint_after_the_end_is_refused(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--agent", "optimal", "--seed", "7", "-o", "g.dmt")
    completed = run_dmplay(tmp_path, "export", "g.dmt", "--svg", "--hint")
    message = "error: --hint: the game is over; choose an earlier turn with --at\n"
    assert (completed.returncode, completed.stderr) == (2, message)


def test_a_film_shows_every_screen_for_a_second_and_respects_reduced_motion(
    transcript_path: Path,
) -> None:
    svg = run_export(transcript_path, "--film")
    assert svg == run_export(transcript_path, "--film")
    root = ElementTree.fromstring(svg)
    style, *_, screens, _ = root
    assert [screen.get("style") for screen in screens] == [
        f"animation-delay: {n}s" for n in range(5)
    ]
    assert "animation: turn 5s infinite" in (style.text or "")
    assert "prefers-reduced-motion" in (style.text or "")


@pytest.mark.parametrize("form", ["--svg", "--film", "--html"])
def test_a_picture_loads_no_external_files(transcript_path: Path, form: str) -> None:
    picture = run_export(transcript_path, form)
    assert "url(http" not in picture.replace('"', "").replace("'", "")
    assert "@font-face" not in picture


def test_a_page_is_html(transcript_path: Path) -> None:
    assert run_export(transcript_path, "--html").startswith("<!DOCTYPE html>")


def test_the_other_exports_show_no_keys(transcript_path: Path) -> None:
    for form in ("--film", "--text", "--cast"):
        assert "quit" not in run_export(transcript_path, form)


def test_a_screen_recording_is_an_asciicast_with_a_frame_per_turn(transcript_path: Path) -> None:
    head, *frames = map(json.loads, run_export(transcript_path, "--cast").splitlines())
    assert head == {"version": 3, "term": {"cols": 80, "rows": 24}, "title": "dmplay hexworld"}
    assert [frame[0] for frame in frames] == [0.0, 1.0, 1.0, 1.0, 1.0]  # after the frame before
    assert all(frame[1] == "o" and "hexworld" in frame[2] for frame in frames)


def test_text_contains_every_screen(transcript_path: Path) -> None:
    text = run_export(transcript_path, "--text")
    assert text.count(" hexworld  turn ") == 5
    assert "turn 2. chose NE, bumped, stayed at (8,2)." in text
    assert all(row == row.rstrip() for row in text.splitlines())


def test_text_respects_the_width_and_is_ascii_on_request_or_if_needed(
    transcript_path: Path,
) -> None:
    assert "╱" in run_export(transcript_path, "--text")
    assert max(map(len, run_export(transcript_path, "--text", "--width", "45").splitlines())) <= 45
    plain = run_export(transcript_path, "--text", "--ascii")
    assert plain.isascii()
    completed = run_dmplay(
        transcript_path.parent, "export", "g.dmt", "--text", PYTHONIOENCODING="ascii"
    )
    assert completed.stdout == plain
    assert run_export(transcript_path, "--cast", "--ascii").isascii()


def test_a_table_has_a_row_per_turn(transcript_path: Path) -> None:
    rows = list(csv.DictReader(io.StringIO(run_export(transcript_path, "--csv"))))
    assert [row["turn"] for row in rows] == ["0", "1", "2", "1", "2"]
    assert rows[1]["actions agent"] == "e"
    assert rows[2]["rewards agent"] == "-1"


def test_states_and_actions_of_a_user_s_problem_are_no_formulas_in_a_table(tmp_path: Path) -> None:
    (tmp_path / "cells.py").write_text(
        "from dataclasses import dataclass\n"
        "import numpy as np\n"
        "from dmplay import Labels, Tables, Tabular\n"
        "@dataclass(frozen=True)\n"
        "class Cells(Tabular):\n"
        "    actions = (Labels(('@go', '-1')),)\n"
        "    state_names, initial_belief = ('=1+1', '-0.5'), np.array([1.0, 0.0])\n"
        "    tables = Tables(np.array([[[0, 1], [0, 1]]] * 2, float), -np.ones((2, 2, 1)))\n"
    )
    arguments = ("play", "./cells.py", "--agent", "script:@go,-1", "--turns", "2", "--seed", "1")
    run_dmplay(tmp_path, *arguments, "-o", "g.dmt", "-q")
    table = run_dmplay(tmp_path, "export", "g.dmt", "--csv", "--trust").stdout
    rows = list(csv.DictReader(io.StringIO(table)))
    assert [row["state"] for row in rows] == ["'=1+1", "-0.5", "-0.5"]
    assert [row["actions agent"] for row in rows] == ["", "'@go", "-1"]
    assert [row["rewards agent"] for row in rows] == ["", "-1", "-1"]


def test_json_and_csv_name_events_that_are_not_turns(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--seed", "7", "-o", "g.dmt", stdin="w\nreroll\nundo\ne\n")
    data = json.loads(run_export(tmp_path / "g.dmt", "--json"))
    assert [turn.get("event") for turn in data["turns"]] == [None, None, "reroll", "undo", None]
    rows = list(csv.DictReader(io.StringIO(run_export(tmp_path / "g.dmt", "--csv"))))
    assert [row["event"] for row in rows] == ["", "", "reroll", "undo", ""]


def test_json_is_a_single_object(transcript_path: Path) -> None:
    game = json.loads(run_export(transcript_path, "--json"))
    assert game["seed"] == 7
    assert game["end"]["turns"] == 2


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "export: choose one of --svg, --film, --html"),
        (["--svg", "--csv"], "export: choose one of"),
        (["--svg", "--at", "9"], "--at: got 9, the game has 2 turns"),
        (["--text", "--at", "1"], "--at: only with --svg or --html, not with --text"),
        (["--film", "--hint"], "--hint: only with --svg, not with --film"),
        (["--csv", "--width", "60"], "--width: only with formats that show the screen, not with"),
        (["--json", "--ascii"], "--ascii: only with formats that show the screen, not with --json"),
        (["--json", "-o", "g.csv"], "-o g.csv: the format is JSON; name the file g.json"),
        (["--csv", "-o", "no/g.csv"], "cannot write no/g.csv: No such file or directory"),
    ],
)
def test_an_invalid_option_is_reported_in_one_line(
    transcript_path: Path, arguments: list[str], message: str
) -> None:
    completed = run_dmplay(transcript_path.parent, "export", "g.dmt", *arguments)
    assert completed.returncode == 2
    assert completed.stderr.startswith(f"error: {message}")


def test_a_review_values_every_action_and_is_written_as_notes(transcript_path: Path) -> None:
    lines = run_dmplay(transcript_path.parent, "review", "g.dmt", "--write").stdout.splitlines()
    assert lines == [
        "turn  chosen  best  regret  discounted",
        "1     e       se    0.78    0.78 ####################",
        "2     w       sw    0.58    0.52 ##############",
        "review: best action 0 of 2 times, total expected regret (discounted value lost) 1.30, "
        "largest in turn 1",
        "regret = value of the best action minus value of the chosen one",
        "discounted = the regret as it counts in the score",
    ]
    assert verify(transcript_path).is_ok
    notes = [row for row in transcript_path.read_text().splitlines() if row.startswith("# review ")]
    assert notes[0].startswith(
        "# review turn 1, agent: chose e, best action: se, regret 0.78. exact values: e "
    )
    assert len(notes) == 3
    before = transcript_path.read_text()
    run_dmplay(transcript_path.parent, "review", "g.dmt", "--write")
    assert transcript_path.read_text() == before
    data = json.loads(run_dmplay(transcript_path.parent, "review", "g.dmt", "--json").stdout)
    assert data["actions"][0]["best"] == ["se"]


def test_a_review_reports_if_no_agent_knows_the_values(tmp_path: Path) -> None:
    (tmp_path / "push.py").write_text(REGULATOR_WITHOUT_AGENTS)
    run_dmplay(tmp_path, "./push.py", "--seed", "7", "-o", "g.dmt", stdin="0\n1\n")
    output = run_dmplay(tmp_path, "review", "g.dmt", "--trust").stdout
    assert output == "review: no agent can compute the values of these actions\n"


def test_a_branch_has_the_first_turns_and_uniforms_of_the_original(transcript_path: Path) -> None:
    completed = run_dmplay(
        transcript_path.parent, "branch", "g.dmt", "--at", "1", "-o", "b.dmt", stdin="ne\nquit\n"
    )
    assert completed.returncode == 0
    branch_path = transcript_path.parent / "b.dmt"
    assert verify(branch_path).is_ok
    original, branch = read_transcript(transcript_path), read_transcript(branch_path)
    assert original.blocks[1]["draws"] == branch.blocks[1]["draws"]
    assert original.blocks[2]["draws"] == branch.blocks[2]["draws"]
    assert branch.blocks[2]["actions"] == {"agent": "ne"}
    refused = run_dmplay(transcript_path.parent, "branch", "g.dmt", "--at", "9", "-o", "c.dmt")
    assert refused.stderr == "error: --at: got 9, g.dmt has 2 turns\n"


def test_a_branch_copies_the_rerolled_uniforms(tmp_path: Path) -> None:
    commands = "w\nw\nreroll\nreroll\nw\n"
    run_dmplay(tmp_path, "hexworld", "--seed", "3", "-o", "g.dmt", stdin=commands)
    run_dmplay(tmp_path, "branch", "g.dmt", "--at", "2", "-o", "b.dmt", stdin="e\nundo 2\nw\n")
    assert verify(tmp_path / "b.dmt").is_ok
    draws = [
        block["draws"]
        for block in read_transcript(tmp_path / "g.dmt").blocks
        if block.kind == "turn"
    ]
    branch_draws = [
        block["draws"]
        for block in read_transcript(tmp_path / "b.dmt").blocks
        if block.kind == "turn"
    ]
    assert branch_draws == [*draws[:3], *draws[4:], draws[4]]


def test_a_film_holds_one_picture_in_memory_at_a_time() -> None:
    rendered: list[int] = []

    def render_texts() -> Iterator[Text]:
        for number in range(3):
            rendered.append(number)
            yield Text("x")

    parts = texts_to_animated_svg(render_texts(), 3, "three", 9)
    progress = [(len(rendered), part.count("animation-delay")) for part in parts]
    assert progress == [(1, 0), (1, 1), (2, 1), (3, 1), (3, 0)]


@pytest.mark.parametrize("form", ["text", "cast", "film"])
def test_exported_parts_are_rendered_only_when_they_are_read(form: str, tmp_path: Path) -> None:
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=9)
    parts = export_transcript(
        ReplayRequest(tmp_path / "g.dmt"), [form], ExportOptions()
    ).text_chunks
    assert iter(parts) is parts  # an iterator: no part is rendered in advance


def test_a_printout_is_printed_part_by_part(capsys: pytest.CaptureFixture[str]) -> None:
    def parts() -> Iterator[str]:
        yield "one\n"
        assert capsys.readouterr().out == "one\n"
        yield "t\x1bwo"

    assert execute_result(Printout("", text_chunks=parts())) == 0
    assert capsys.readouterr().out == "t\\x1bwo\n"
