"""Tests of the arguments of `dmplay learn`."""

from pathlib import Path

import pytest

from dmplay.cli import learn


def test_numbers_and_names_of_lessons_are_completed() -> None:
    assert learn._complete_lessons("1") == ["1", *map(str, range(10, 18))]
    assert learn._complete_lessons("fi") == ["first", "first-walk"]
    assert learn._complete_lessons("co") == ["collision-course"]


def test_folders_and_files_of_lessons_are_completed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "week3").mkdir()
    for name in ("01-cries.toml", "notes.txt"):
        (tmp_path / "week3" / name).write_text("")
    assert learn._complete_lessons("./we") == ["./week3/"]
    assert learn._complete_lessons("./week3/") == ["./week3/01-cries.toml"]


def test_a_word_is_a_lesson_unless_it_is_a_path(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "9").mkdir()
    assert learn._split_lesson_arguments([]) == ("", "")
    assert learn._split_lesson_arguments(["9"]) == ("", "9")
    assert learn._split_lesson_arguments(["9", "2"]) == ("9", "2")
    assert learn._split_lesson_arguments(["./9/", "2"]) == ("./9/", "2")
