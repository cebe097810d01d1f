"""Tests of file safety: no overwriting without --force, no links, no endless files."""

import os
import re
import resource
import socket
import tracemalloc
from pathlib import Path

import pytest

from dmplay.core.safe_files import (
    is_locked_elsewhere,
    read_bytes,
    user_folder,
    write_at_offset,
    write_file,
)
from dmplay.errors import DiskFull
from dmplay.game.saves import saves_folder
from tests.support.document_examples import TIGER_SOURCE
from tests.support.games import record_game
from tests.support.programs import UNNAMED_USER_ID, run_dmplay, run_shell_line

DRAFT_NAME = ".dmplay-0123456789abcdef.tmp"  # a name of an unfinished file
OUTPUT_COMMANDS = (("export", "g.dmt", "--csv", "-o"), ("export", "g.dmt", "--svg", "-o"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder with a finished game."""
    record_game(tmp_path / "g.dmt", "hexworld", "random", turns=3)
    return tmp_path


@pytest.mark.parametrize(
    ("value", "expected"), [("/mine", "/mine"), ("mine", "/home/.local"), ("", "/home/.local")]
)
def test_the_user_folder_is_an_absolute_path_or_the_default(
    value: str, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home")
    assert user_folder({"XDG_KIND": value}, "XDG_KIND", ".local") == Path(expected, "dmplay")


@pytest.mark.parametrize("words", OUTPUT_COMMANDS)
def test_an_existing_file_is_overwritten_only_with_force(
    words: tuple[str, ...], folder: Path
) -> None:
    old = folder / "out"
    old.write_text("mine")
    result = run_dmplay(folder, *words, "out")
    assert result.stderr == "error: out exists; give another name or use --force\n"
    assert (result.returncode, old.read_text()) == (2, "mine")
    assert run_dmplay(folder, *words, "out", "--force").returncode == 0
    assert old.read_text() != "mine"


@pytest.mark.parametrize("words", [*OUTPUT_COMMANDS, ("hexworld", "--agent", "random", "-o")])
@pytest.mark.parametrize("text", ["mine", "", None])
def test_output_is_not_written_through_a_link(
    words: tuple[str, ...], text: str | None, folder: Path
) -> None:
    other, link = folder / "other", folder / "link"
    link.symlink_to(other)
    if text is not None:
        other.write_text(text)
    for force in ((), ("--force",)):
        result = run_dmplay(folder, *words, "link", *force)
        assert result.returncode == 2
        assert result.stderr.startswith("error: link ")
        assert other.exists() is (text is not None)
        assert text is None or other.read_text() == text


GAME_OF_AGENTS = ("--agent", "random", "--turns", "2", "-o")
# commands, and the file that each of them reads; it is written to the path that follows
READING_COMMANDS = (
    (("export", "g.dmt", "--csv", "--force", "-o"), "g.dmt"),
    (("export", "g.dmt", "--html", "--force", "-o"), "g.dmt"),
    (("branch", "g.dmt", "--at", "1", "--force", "-o"), "g.dmt"),
    (("watch", "value-iteration", "g.dmt", "--svg", "--force", "-o"), "g.dmt"),
    (("watch", "belief-update", "./t.pomdp", "--svg", "--force", "-o"), "t.pomdp"),
    pytest.param(
        ("plot", "belief", "{}", "--force", "-o", "{}"), "baby.svg", marks=pytest.mark.extra("plot")
    ),
    (("convert", "./t.pomdp", "--force", "-o"), "t.pomdp"),
    (("assign", "./t.pomdp", "--force", "-o"), "t.pomdp"),
    (("play", "./t.pomdp", "--force", *GAME_OF_AGENTS), "t.pomdp"),
    (("play", "./tiger.py", "--force", *GAME_OF_AGENTS), "tiger.py"),
    (("play", "./tiger.py", "--force", *GAME_OF_AGENTS), "helper.py"),
    (("play", "tiger:Tiger", "--force", *GAME_OF_AGENTS), "tiger.py"),
    (("play", "hexworld", "--seat", "agent=script:moves", "--force", "-o"), "moves"),
    (("play", "hexworld", "--seat", "agent=replay:g.dmt", "--force", "-o"), "g.dmt"),
    (("play", "hexworld", "--seat", "agent=bot:sh moves", "--force", "-o"), "moves"),
    (("play", "hexworld", "--force", *GAME_OF_AGENTS), "config/dmplay/config.toml"),
    (("shell", "-e", "export g.dmt --csv --force -o {}"), "g.dmt"),
    (("shell", "-e", "export g.dmt --csv --force -o {}"), "config/dmplay/config.toml"),
    (("shell", "-e", "play hexworld --force -o {}"), "config/dmplay/config.toml"),
)


@pytest.fixture
def source_folder(folder: Path) -> Path:
    """A folder with files of each kind that dmplay reads."""
    run_dmplay(folder, "convert", "crying-baby", "-o", "t.pomdp")
    record_game(folder / "baby.svg", "crying-baby", "random", turns=3)
    (folder / "tiger.py").write_text(f"import helper\n{TIGER_SOURCE}")
    (folder / "helper.py").touch()
    (folder / "moves").write_text("e\n" * 9)
    (folder / "config/dmplay").mkdir(parents=True)
    (folder / "config/dmplay/config.toml").write_text('theme = "mono"\n')
    return folder


@pytest.mark.parametrize("link", ["", "symbolic", "hard"])
@pytest.mark.parametrize(("words", "source"), READING_COMMANDS)
def test_no_command_overwrites_a_file_that_it_reads(
    words: tuple[str, ...], source: str, link: str, source_folder: Path
) -> None:
    path = source_folder / source
    name = f"linked{path.suffix}" if link else source
    if link == "symbolic":
        (source_folder / name).symlink_to(path)
    elif link:
        (source_folder / name).hardlink_to(path)
    content = path.read_bytes()
    arguments = [word.format(name) for word in words]
    arguments += [name] if arguments == [*words] else []
    environment = {"XDG_CONFIG_HOME": str(source_folder / "config")}
    result = run_dmplay(source_folder, *arguments, **environment)
    assert f" {name} is a file that dmplay reads; give another path\n" in result.stderr
    assert (result.returncode, path.read_bytes()) == (2, content)


def test_a_file_that_another_command_read_can_be_overwritten(source_folder: Path) -> None:
    for command in ("verify", "review"):
        option = {"verify": "--update", "review": "--write"}[command]
        assert run_dmplay(source_folder, command, "g.dmt", option).returncode == 0


def test_the_file_of_a_running_game_is_not_overwritten(folder: Path) -> None:
    result = run_dmplay(
        folder,
        "hexworld",
        "--seed",
        "7",
        "-o",
        "now.dmt",
        stdin="e\nexport g.dmt --csv -o now.dmt --force",
    )
    assert "now.dmt: this game is running, here or in another dmplay process" in result.stderr
    assert (folder / "now.dmt").read_text().startswith("dmplay: 1\n")


@pytest.mark.parametrize("words", [("verify", "--update"), ("review", "--write")])
def test_rewriting_a_linked_file_preserves_the_link(words: tuple[str, ...], folder: Path) -> None:
    run_dmplay(folder, "hexworld", "--seed", "7", "-o", "h.dmt", stdin="e\nquit\n")
    game, link = folder / "h.dmt", folder / "link.dmt"
    game.write_text(game.read_text().replace('"total": ', '"total":  '))
    link.symlink_to("h.dmt")
    before = game.read_bytes()
    assert run_dmplay(folder, words[0], "link.dmt", words[1]).returncode == 0
    assert link.is_symlink()
    assert game.read_bytes() != before
    assert {path.name for path in folder.glob(".*")} <= {".cache"}


@pytest.mark.parametrize(
    "words",
    [
        ("verify", "pipe"), ("replay", "pipe"), ("resume", "pipe"), ("review", "pipe"),
        ("export", "pipe", "--csv"), ("export", "g.dmt", "--csv", "--force", "-o", "pipe"),
        ("hexworld", "--agent", "random", "--force", "-o", "pipe"), ("verify", "/dev/zero"),
        ("export", "g.dmt", "--svg", "--force", "-o", "/dev/tty"), ("hexworld", "-o", "/dev/full"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_a_path_that_is_not_a_regular_file_is_refused_by_name(
    words: tuple[str, ...], folder: Path
) -> None:
    os.mkfifo(folder / "pipe")
    result = run_dmplay(folder, *words)
    assert result.returncode in (2, 3)
    first_line = (result.stderr + result.stdout).splitlines()[0]
    assert "a FIFO, a socket or a device, not a file" in first_line
    assert any(word in first_line for word in words[1:])


@pytest.mark.slow
def test_a_file_descriptor_opened_by_the_shell_is_read(folder: Path) -> None:
    result = run_shell_line("dmplay verify <(cat g.dmt)", folder)
    assert re.fullmatch(r"ok /dev/fd/\d+ \(3 turns\)\n1 verified\n", result.stdout)
    result = run_shell_line("dmplay verify --update <(cat g.dmt)", folder)
    assert re.fullmatch(r"error: --update: /dev/fd/\d+ cannot be rewritten\n", result.stderr)
    assert result.returncode == 2


def test_verify_reports_each_unreadable_file_and_continues(folder: Path) -> None:
    (folder / "folder.dmt").mkdir()
    (folder / "dangling.dmt").symlink_to("nowhere")
    (folder / "zero.dmt").symlink_to("/dev/zero")
    os.mkfifo(folder / "pipe.dmt")
    result = run_dmplay(folder, "verify", ".")
    assert result.returncode == 3
    assert result.stdout.splitlines() == [
        "dangling.dmt:1: cannot be read: No such file or directory",
        "folder.dmt:1: cannot be read: Is a directory",
        "ok g.dmt (3 turns)",
        "pipe.dmt:1: cannot be read: a FIFO, a socket or a device, not a file",
        "zero.dmt:1: cannot be read: a FIFO, a socket or a device, not a file",
        "1 verified, 4 failed",
    ]
    second_run = run_dmplay(folder, "verify", ".", "--update")
    assert (second_run.returncode, second_run.stdout) == (3, result.stdout)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("tournament", "prisoners-dilemma", "grim", "random", "-o", "pipe"),
         "pipe: a FIFO, a socket or a device, not a file"),
        (("tournament", "prisoners-dilemma", "grim", "random", "-o", "folder.py"),
         "folder.py: Is a directory"),
        (("run", "hexworld", "--episodes", "2", "--every", "1", "--record", "pipe"),
         "--record: pipe is not a folder; name another folder"),
        (("run", "hexworld", "--episodes", "2", "--every", "1", "--record", "g.dmt"),
         "--record: g.dmt is not a folder; name another folder"),
        (("solve", "./pipe.py"), "./pipe.py: a FIFO, a socket or a device, not a file"),
        (("hexworld", "--agent", "./pipe.py:Agent"),
         "./pipe.py: a FIFO, a socket or a device, not a file"),
        (("check", "./folder.py"), "./folder.py: a folder, not a file"),
        (("check", "./nothing.py"), "no such file: ./nothing.py"),
    ],
)  # fmt: skip
def test_a_path_that_is_not_a_file_is_named_for_what_it_is(
    words: tuple[str, ...], message: str, folder: Path
) -> None:
    for name in ("pipe", "pipe.py"):
        os.mkfifo(folder / name)
    (folder / "folder.py").mkdir()
    result = run_dmplay(folder, *words)
    assert (result.returncode, result.stdout, result.stderr) == (2, "", f"error: {message}\n")


def test_a_file_name_with_a_newline_cannot_forge_a_line(folder: Path) -> None:
    (folder / "a\nok b.dmt").write_text("no game\n")
    (folder / "c\nok d.dmt").write_bytes((folder / "g.dmt").read_bytes())
    rows = run_dmplay(folder, "verify", ".").stdout.splitlines()
    assert [row.partition(" (")[0] for row in rows if row.startswith("ok ")] == [
        "ok c\\nok d.dmt", "ok g.dmt",
    ]  # fmt: skip


def test_a_write_that_exceeds_the_disk_leaves_the_old_file_or_none(tmp_path: Path) -> None:
    old = tmp_path / "old"
    old.write_text("mine")
    soft_limit, hard_limit = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, hard_limit))
    try:
        for path in (old, tmp_path / "new"):
            with pytest.raises(DiskFull, match=r"cannot write .*: File too large"):
                write_file(path, "x" * 1000, force=True)
        with pytest.raises(DiskFull, match="old: File too large"):
            write_at_offset(old, 4, "x" * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft_limit, hard_limit))
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("old", "mine")]


def test_a_named_draft_file_is_removed_after_the_write(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "O_TMPFILE")  # not available on other systems
    path = tmp_path / "new"
    write_file(path, "one")
    path.chmod(0o640)
    write_file(path, "two", force=True)
    assert [*tmp_path.iterdir()] == [path]
    assert (read_bytes(path), path.stat().st_mode & 0o777) == (b"two", 0o640)


def test_the_next_write_removes_the_draft_of_a_killed_write(tmp_path: Path) -> None:
    stale, unfinished = f".dmplay-{'1' * 16}.tmp", f".dmplay-{'2' * 16}.tmp"
    for name in (stale, unfinished):
        (tmp_path / name).write_text("half a li")
    old = tmp_path / "old"
    old.write_text("one")
    with (tmp_path / unfinished).open() as draft:
        assert not is_locked_elsewhere(draft.fileno())  # takes the lock, like a write in progress
        write_file(old, "two", force=True)
        write_file(tmp_path / "new", "two")
    assert {path.name for path in tmp_path.iterdir()} == {unfinished, "old", "new"}
    assert old.read_text() == "two"


@pytest.mark.parametrize("name", [".dmplay-x.tmp", DRAFT_NAME])
def test_a_write_does_not_wait_for_a_fifo_with_the_name_of_a_draft(name: str, folder: Path) -> None:
    os.mkfifo(folder / name)
    result = run_dmplay(folder, "export", "g.dmt", "--csv", "-o", "game.csv")
    assert (result.returncode, result.stderr) == (0, "")
    assert (folder / "game.csv").read_text().startswith("turn,")
    assert (folder / name).is_fifo()


@pytest.mark.parametrize(
    "name",
    [".dmplay-notes.tmp", ".dmplay-1.tmp", DRAFT_NAME.upper(), f"{DRAFT_NAME}.tmp", ".dmplay-.tmp"],
)
def test_a_write_keeps_a_file_whose_name_is_only_similar_to_that_of_a_draft(
    name: str, tmp_path: Path
) -> None:
    (tmp_path / name).write_text("mine")
    write_file(tmp_path / "new", "one")
    assert (tmp_path / name).read_text() == "mine"


def test_a_write_keeps_links_folders_and_sockets_with_the_name_of_a_draft(tmp_path: Path) -> None:
    notes, link, broken_link, folder, socket_path = (
        tmp_path / name for name in ("notes", *(f".dmplay-{digit * 16}.tmp" for digit in "1234"))
    )
    notes.write_text("mine")
    link.symlink_to(notes)
    broken_link.symlink_to("nowhere")
    folder.mkdir()
    with socket.socket(socket.AF_UNIX) as listener:
        listener.bind(str(socket_path))
        write_file(tmp_path / "new", "one")
    assert (link.is_symlink(), broken_link.is_symlink()) == (True, True)
    assert (folder.is_dir(), socket_path.is_socket()) == (True, True)
    assert notes.read_text() == "mine"


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file to another user")
def test_a_write_keeps_the_draft_of_another_user(tmp_path: Path) -> None:
    draft = tmp_path / DRAFT_NAME
    draft.write_text("half a li")
    os.chown(draft, UNNAMED_USER_ID, -1)
    write_file(tmp_path / "new", "one")
    assert draft.read_text() == "half a li"


def test_a_new_game_does_not_wait_for_a_fifo_among_the_saved_games(tmp_path: Path) -> None:
    games = saves_folder({"XDG_STATE_HOME": str(tmp_path / "state")})
    games.mkdir(parents=True)
    os.mkfifo(games / "x.dmt")
    result = run_dmplay(tmp_path, "hexworld", "--seed", "7", stdin="e\nquit\n")
    assert (result.returncode, (games / "x.dmt").is_fifo()) == (0, True)


def test_an_empty_file_left_by_a_kill_can_be_overwritten(folder: Path) -> None:
    (folder / "s.dmt").touch()
    result = run_dmplay(
        folder, "hexworld", "--seed", "7", "-o", "h.dmt", stdin="e\nsave s.dmt\nquit\n"
    )
    assert result.returncode == 0, result.stderr
    assert "turn: 1\n" in (folder / "s.dmt").read_text()


def test_a_file_written_in_parts_is_never_in_memory_as_a_whole(tmp_path: Path) -> None:
    part, part_count = "x" * 10_000, 500
    tracemalloc.start()
    try:
        write_file(tmp_path / "new", (part for _ in range(part_count)))
        peak_bytes = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (tmp_path / "new").stat().st_size == part_count * len(part)
    assert peak_bytes < 50 * len(part)
