"""The provenance of what dmplay writes, and the command that repeats and compares."""

import hashlib
import html
import json
import re
import struct
from pathlib import Path

import pytest

import dmplay
from tests.support.programs import run_dmplay

RUN = ("run", "hexworld", "--set", "slip=0.2", "--episodes", "20")


def write_output(folder: Path, name: str, *words: str, **variables: str) -> Path:
    """Write what a command prints to a file."""
    outcome = run_dmplay(folder, *words, **variables)
    assert outcome.returncode == 0, outcome.stderr
    (folder / name).write_text(outcome.stdout)
    return folder / name


def compute_digest(text: str) -> str:
    return f"sha256:{hashlib.sha256(text.encode()).hexdigest()}"


def test_a_report_has_versions_command_parameters_seed_and_digest(tmp_path: Path) -> None:
    path = write_output(tmp_path, "a.json", *RUN, "--agent", "search:depth=5", "--json")
    report = json.loads(path.read_text())
    provenance = report.pop("provenance")
    assert provenance["dmplay"] == dmplay.__version__
    assert {"python", "numpy"} <= {*provenance}
    assert provenance["command"][:3] == ["run", "hexworld", "--agent"]
    assert (provenance["seed"], provenance["options"]["until_se"]) == (0, None)
    assert (provenance["parameters"]["slip"], provenance["parameters"]["discount"]) == (0.2, 0.9)
    assert provenance["agents"]["search:depth=5"]["simulations"] == 400
    assert provenance["digest"] == compute_digest(json.dumps(report))


def assert_picture_has_provenance(folder: Path, name: str, *command: str) -> None:
    """Make an SVG, and assert that it has its command and the digest of the rest."""
    run_dmplay(folder, *command, "-o", name)
    text = (folder / name).read_text()
    (metadata,) = re.findall(r'<metadata id="provenance">.*?</metadata>\n', text)
    provenance = json.loads(html.unescape(metadata.partition(">")[2].rpartition("<")[0]))
    assert provenance["command"][: len(command)] == [*command]
    assert provenance["digest"] == compute_digest(text.replace(metadata, ""))


@pytest.mark.extra("plot")
def test_plots_have_provenance_and_the_digest_of_the_rest(tmp_path: Path) -> None:
    assert_picture_has_provenance(tmp_path, "plot.svg", "plot", "values", "hexworld")
    run_dmplay(tmp_path, "plot", "values", "hexworld", "-o", "plot.png")
    data = (tmp_path / "plot.png").read_bytes()
    start = data.index(b"iTXtprovenance") - 4
    (size,) = struct.unpack(">I", data[start : start + 4])
    provenance = json.loads(data[start + 8 : start + 8 + size].partition(b"\0\0\0\0\0")[2])
    content = data[:start] + data[start + size + 12 :]
    assert provenance["digest"] == f"sha256:{hashlib.sha256(content).hexdigest()}"


def test_pictures_and_games_have_provenance_and_the_digest_of_the_rest(tmp_path: Path) -> None:
    run_dmplay(tmp_path, "hexworld", "--agent", "random", "--seed", "3", "-o", "g.dmt", "-q")
    assert_picture_has_provenance(tmp_path, "game.svg", "export", "g.dmt", "--svg")
    assert_picture_has_provenance(tmp_path, "film.svg", "export", "g.dmt", "--film")
    game = json.loads(run_dmplay(tmp_path, "export", "g.dmt", "--json").stdout)
    assert [*game][-2:] == ["end", "provenance"]


@pytest.mark.parametrize(
    "command",
    [
        RUN,
        ("compare", "hexworld", "optimal", "random", "--episodes", "20"),
        ("tournament", "prisoners-dilemma", "grim", "tit-for-tat", "--turns", "3", "-o", "cup"),
        ("solve", "crying-baby", "--turns", "3"),
        ("evaluate", "random", "hexworld", "predator-prey", "--episodes", "3", "--turns", "3"),
        (
            "evaluate",
            "chase",
            "predator-prey",
            "--seat",
            "prey=random",
            "--turns",
            "3",
            "--episodes",
            "3",
            "-o",
            "games",
        ),
    ],
)
def test_a_repeated_command_has_the_same_results(tmp_path: Path, command: tuple[str, ...]) -> None:
    write_output(tmp_path, "a.json", *command, "--json")
    outcome = run_dmplay(tmp_path, "rerun", "a.json")
    assert (outcome.returncode, outcome.stdout) == (0, "a.json: same results\n")


def test_environment_and_settings_do_not_change_what_is_repeated(tmp_path: Path) -> None:
    command = ("run", "hexworld", "--episodes", "20", "--json")
    write_output(tmp_path, "a.json", *command, DMPLAY_SET="slip=0.5")
    outcome = run_dmplay(tmp_path, "rerun", "a.json", DMPLAY_SET="slip=0.1")
    assert outcome.stdout == "a.json: same results\n"


def test_the_first_difference_is_named(tmp_path: Path) -> None:
    path = write_output(tmp_path, "a.json", *RUN, "--json")
    path.write_text(path.read_text().replace('"games": 20', '"games": 21'))
    outcome = run_dmplay(tmp_path, "rerun", "a.json")
    assert outcome.returncode == 1
    assert outcome.stdout.splitlines() == [
        "a.json: different results",
        "the file was changed after it was written: it does not have its digest",
        "runs[0].games: got 20, expected 21",
    ]


def test_csv_has_its_provenance_in_a_file_of_its_own(tmp_path: Path) -> None:
    name = "a.csv.meta.json"
    path = write_output(tmp_path, "a.csv", *RUN, "--csv", "--meta", name)
    assert "provenance" not in path.read_text()
    assert run_dmplay(tmp_path, "rerun", name).stdout == f"{name}: same results\n"
    path.write_text(path.read_text().replace("agent,optimal,20", "agent,optimal,21"))
    outcome = run_dmplay(tmp_path, "rerun", name)
    assert outcome.returncode == 1
    assert outcome.stdout.splitlines()[2].startswith("line 2: got 'agent,optimal,20,")
    (tmp_path / "keep").write_text("mine")
    outcome = run_dmplay(tmp_path, *RUN, "--csv", "--meta", "keep")
    assert outcome.stderr == "error: --meta keep: the file exists, and it has no provenance\n"


AGENT = """
from dmplay.agents.random_agent import Random as Mine
print("loaded")
"""


def test_an_evaluation_of_transcripts_is_repeated(tmp_path: Path) -> None:
    words = ("evaluate", "random", "hexworld", "--episodes", "3", "-o", "games")
    path = write_output(tmp_path, "a.json", *words, "--json")
    provenance = json.loads(path.read_text())["provenance"]
    assert provenance["parameters"]["hexworld"]["discount"] == 0.9
    write_output(tmp_path, "b.json", "evaluate", "games", "--json")
    assert run_dmplay(tmp_path, "rerun", "b.json").stdout == "b.json: same results\n"
    (tmp_path / "games" / "hexworld-0.dmt").unlink()
    assert run_dmplay(tmp_path, "rerun", "b.json").returncode == 1


@pytest.mark.parametrize(
    "words",
    [("run", "hexworld", "--agent", "./mine.py:Mine"), ("evaluate", "./mine.py:Mine", "hexworld")],
)
def test_code_and_programs_are_run_only_if_they_are_trusted(
    tmp_path: Path, words: tuple[str, ...]
) -> None:
    (tmp_path / "mine.py").write_text(AGENT)
    path = write_output(tmp_path, "a.json", *words, "--episodes", "5", "--json")
    outcome = run_dmplay(tmp_path, "rerun", "a.json")
    assert outcome.returncode == 2
    assert outcome.stderr.endswith("is code outside dmplay; if you trust it, add --trust\n")
    assert run_dmplay(tmp_path, "rerun", "a.json", "--trust").returncode == 0
    for old, new in (("./mine.py:Mine", "bot:touch x"), ('"hexworld"', '"./mine.py:Mine"')):
        path.write_text(path.read_text().replace(old, new))
        outcome = run_dmplay(tmp_path, "rerun", "a.json")
        assert (outcome.returncode, outcome.stdout) == (2, "")
    assert not (tmp_path / "x").exists()


@pytest.mark.parametrize(
    "changes",
    [{"problem": ["./mine.py:Mine"]}, {"problem": "", "regret": "./mine.py:Mine"},
     {"agent": "--trust"}, {"agent": ["./mine.py:Mine"]}, {"agent": 2}, {"variant": "-ox"}],
)  # fmt: skip
def test_a_changed_value_cannot_be_another_option_or_argument(
    tmp_path: Path, changes: dict[str, object]
) -> None:
    (tmp_path / "mine.py").write_text(f"open('x', 'w')\n{AGENT}")
    path = write_output(tmp_path, "a.json", "run", "hexworld", "--episodes", "5", "--json")
    report = json.loads(path.read_text())
    report["provenance"]["options"] |= changes
    path.write_text(json.dumps(report))
    outcome = run_dmplay(tmp_path, "rerun", "a.json")
    assert (outcome.returncode, outcome.stdout, outcome.stderr.count("\n")) == (2, "", 1)
    assert not (tmp_path / "x").exists()


def test_a_file_of_another_command_cannot_be_repeated(tmp_path: Path) -> None:
    write_output(tmp_path, "a.json", "list", "--json")
    outcome = run_dmplay(tmp_path, "rerun", "a.json")
    assert outcome.returncode == 2
    assert "a.json: made by the command list, expected one of run, compare, " in outcome.stderr
