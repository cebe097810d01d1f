"""Files: nothing is overwritten unasked, through links or not; what has no end is not read."""

import os
import re
import resource
import tracemalloc
from pathlib import Path

import pytest

from dmplay.disk import is_locked_elsewhere, read_bytes, user_folder, write_at_offset, write_file
from dmplay.errors import DiskFull
from tests.support.games import recorded
from tests.support.programs import run, shell

PICTURES = (("export", "g.dmt", "--csv", "-o"), ("figure", "F.2", "-o"))


@pytest.fixture
def place(tmp_path: Path) -> Path:
    """A folder with a finished game."""
    recorded(tmp_path / "g.dmt", "hexworld", "random", turns=3)
    return tmp_path


@pytest.mark.parametrize(
    ("told", "where"),
    [("/mine", "/mine"), ("mine", "/home/.local"), ("", "/home/.local")],
)
def test_a_users_folder_is_told_from_the_root_or_is_the_usual_one(
    told: str, where: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("HOME", "/home")
    assert user_folder({"XDG_KIND": told}, "XDG_KIND", ".local") == Path(where, "dmplay")


@pytest.mark.parametrize("words", PICTURES)
def test_what_is_there_is_overwritten_only_with_force(words: tuple[str, ...], place: Path) -> None:
    old = place / "out"
    old.write_text("mine")
    done = run(place, *words, "out")
    assert done.stderr == "error: out exists; give another name, or --force\n"
    assert (done.returncode, old.read_text()) == (2, "mine")
    assert run(place, *words, "out", "--force").returncode == 0
    assert old.read_text() != "mine"


@pytest.mark.parametrize("words", [*PICTURES, ("hexworld", "--agent", "random", "-o")])
@pytest.mark.parametrize("text", ["mine", "", None])
def test_no_link_is_followed_onto_something_else(
    words: tuple[str, ...], text: str | None, place: Path
) -> None:
    other, link = place / "other", place / "link"
    link.symlink_to(other)
    if text is not None:
        other.write_text(text)
    for force in ((), ("--force",)):
        done = run(place, *words, "link", *force)
        assert done.returncode == 2
        assert done.stderr.startswith("error: link ")
        assert other.exists() is (text is not None)
        assert text is None or other.read_text() == text


@pytest.mark.parametrize("name", ["g.dmt", "same.dmt", "hard.dmt"])
@pytest.mark.parametrize("words", [("export", "--csv"), ("branch", "--at", "1")])
def test_the_file_that_is_read_is_not_written(
    words: tuple[str, ...], name: str, place: Path
) -> None:
    game = place / "g.dmt"
    (place / "same.dmt").symlink_to(game)
    (place / "hard.dmt").hardlink_to(game)
    before = game.read_bytes()
    done = run(place, *words, "g.dmt", "--force", "-o", name)
    assert done.stderr == f"error: {name}: it is the transcript that is read\n"
    assert (done.returncode, game.read_bytes()) == (2, before)


def test_the_file_of_a_running_game_is_not_written(place: Path) -> None:
    told = run(
        place,
        "hexworld",
        "--seed",
        "7",
        "-o",
        "now.dmt",
        stdin="e\nexport g.dmt --csv -o now.dmt --force",
    )
    assert "now.dmt: somebody plays this game now" in told.stderr
    assert (place / "now.dmt").read_text().startswith("dmplay: 1\n")


@pytest.mark.parametrize("words", [("verify", "--update"), ("review", "--write")])
def test_a_link_stays_one_where_its_file_is_rewritten(words: tuple[str, ...], place: Path) -> None:
    run(place, "hexworld", "--seed", "7", "-o", "h.dmt", stdin="e\nquit\n")
    game, link = place / "h.dmt", place / "link.dmt"
    game.write_text(game.read_text().replace('"total": ', '"total":  '))
    link.symlink_to("h.dmt")
    before = game.read_bytes()
    assert run(place, words[0], "link.dmt", words[1]).returncode == 0
    assert link.is_symlink()
    assert game.read_bytes() != before
    assert {path.name for path in place.glob(".*")} <= {".cache"}


@pytest.mark.parametrize(
    "words",
    [
        ("verify", "pipe"), ("replay", "pipe"), ("resume", "pipe"), ("review", "pipe"),
        ("export", "pipe", "--csv"), ("export", "g.dmt", "--csv", "--force", "-o", "pipe"),
        ("hexworld", "--agent", "random", "--force", "-o", "pipe"), ("verify", "/dev/zero"),
        ("figure", "F.2", "--force", "-o", "/dev/tty"), ("hexworld", "-o", "/dev/full"),
    ],
    ids=" ".join,
)  # fmt: skip
def test_what_is_no_file_is_refused_by_name(words: tuple[str, ...], place: Path) -> None:
    os.mkfifo(place / "pipe")
    done = run(place, *words)
    assert done.returncode in (2, 3)
    told = (done.stderr + done.stdout).splitlines()[0]
    assert "a FIFO, a socket or a device, not a file" in told
    assert any(word in told for word in words[1:])


@pytest.mark.slow
def test_what_a_shell_opens_for_it_is_read(place: Path) -> None:
    done = shell("dmplay verify <(cat g.dmt)", place)
    assert re.fullmatch(r"ok /dev/fd/\d+ \(3 turns\)\n1 verified\n", done.stdout)
    done = shell("dmplay verify --update <(cat g.dmt)", place)
    assert re.fullmatch(r"error: --update: /dev/fd/\d+ cannot be rewritten\n", done.stderr)
    assert done.returncode == 2


def test_verify_tells_of_every_file_it_cannot_read_and_goes_on(place: Path) -> None:
    (place / "folder.dmt").mkdir()
    (place / "dangling.dmt").symlink_to("nowhere")
    (place / "zero.dmt").symlink_to("/dev/zero")
    os.mkfifo(place / "pipe.dmt")
    done = run(place, "verify", ".")
    assert done.returncode == 3
    assert done.stdout.splitlines() == [
        "dangling.dmt:1: cannot be read: No such file or directory",
        "folder.dmt:1: cannot be read: Is a directory",
        "ok g.dmt (3 turns)",
        "pipe.dmt:1: cannot be read: a FIFO, a socket or a device, not a file",
        "zero.dmt:1: cannot be read: a FIFO, a socket or a device, not a file",
        "1 verified, 4 failed",
    ]
    again = run(place, "verify", ".", "--update")
    assert (again.returncode, again.stdout) == (3, done.stdout)


def test_a_name_of_two_lines_forges_none(place: Path) -> None:
    (place / "a\nok b.dmt").write_text("no game\n")
    (place / "c\nok d.dmt").write_bytes((place / "g.dmt").read_bytes())
    told = run(place, "verify", ".").stdout.splitlines()
    assert [row.partition(" (")[0] for row in told if row.startswith("ok ")] == [
        "ok c\\nok d.dmt", "ok g.dmt",
    ]  # fmt: skip


def test_a_write_that_the_disk_cuts_leaves_the_old_file_or_none(tmp_path: Path) -> None:
    old = tmp_path / "old"
    old.write_text("mine")
    least, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (100, most))
    try:
        for path in (old, tmp_path / "new"):
            with pytest.raises(DiskFull, match=r"cannot write .*: File too large"):
                write_file(path, "x" * 1000, force=True)
        with pytest.raises(DiskFull, match="old: File too large"):
            write_at_offset(old, 4, "x" * 1000)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (least, most))
    assert [(path.name, path.read_text()) for path in tmp_path.iterdir()] == [("old", "mine")]


def test_where_a_draft_needs_a_name_it_is_gone_after_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delattr(os, "O_TMPFILE")  # as on other systems
    path = tmp_path / "new"
    write_file(path, "one")
    path.chmod(0o640)
    write_file(path, "two", force=True)
    assert [*tmp_path.iterdir()] == [path]
    assert (read_bytes(path), path.stat().st_mode & 0o777) == (b"two", 0o640)


def test_the_draft_of_a_killed_write_is_gone_with_the_next(tmp_path: Path) -> None:
    for name in (f".dmplay-{os.getpid()}.tmp", ".dmplay-1.tmp", ".dmplay-2.tmp"):
        (tmp_path / name).write_text("half a li")
    old = tmp_path / "old"
    old.write_text("one")
    with (tmp_path / ".dmplay-2.tmp").open() as another:
        assert not is_locked_elsewhere(another.fileno())  # as a write that is under way
        write_file(old, "two", force=True)
        write_file(tmp_path / "new", "two")
    assert {path.name for path in tmp_path.iterdir()} == {".dmplay-2.tmp", "old", "new"}
    assert old.read_text() == "two"


def test_what_a_kill_left_empty_is_in_nobodys_way(place: Path) -> None:
    (place / "s.dmt").touch()
    done = run(place, "hexworld", "--seed", "7", "-o", "h.dmt", stdin="e\nsave s.dmt\nquit\n")
    assert done.returncode == 0, done.stderr
    assert "turn: 1\n" in (place / "s.dmt").read_text()


def test_what_is_written_part_by_part_is_never_held_as_a_whole(tmp_path: Path) -> None:
    part, many = "x" * 10_000, 500
    tracemalloc.start()
    try:
        write_file(tmp_path / "new", (part for _ in range(many)))
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert (tmp_path / "new").stat().st_size == many * len(part)
    assert most < 50 * len(part)
