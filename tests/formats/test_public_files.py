"""Tests of problem files by other people, in the folder that DMPLAY_CORPUS names."""

import os
from pathlib import Path

import pytest

from dmplay.errors import BadParameter, DmplayError
from dmplay.registry.problem_name_kinds import DATA_SUFFIXES
from dmplay.registry.problems import load_problem

CORPUS_FOLDER = os.environ.get("DMPLAY_CORPUS", "")


@pytest.mark.skipif(
    not CORPUS_FOLDER, reason="DMPLAY_CORPUS names no folder of other people's files"
)
def test_corpus_files_are_read_or_refused_in_one_line(capsys: pytest.CaptureFixture[str]) -> None:
    files = [
        path
        for path in sorted(Path(CORPUS_FOLDER).rglob("*"))
        if path.suffix.lower() in DATA_SUFFIXES
    ]
    refused = []
    for path in files:
        try:
            load_problem(str(path))
        except DmplayError as error:
            refused.append(f"{path}: {error}")
    with capsys.disabled():
        print(
            f"\n{len(files) - len(refused)} of {len(files)} files of {CORPUS_FOLDER} were read",
            end="",
        )
        print("".join(f"\n  refused: {message}" for message in refused))
    assert files, f"{CORPUS_FOLDER} has no file of {', '.join(DATA_SUFFIXES)}"
    assert not any("\n" in message for message in refused)
    assert len(refused) < len(files)


def test_a_missing_file_is_refused_in_one_line(tmp_path: Path) -> None:
    for name in ("none.pomdp", str(tmp_path / "no" / "x.nfg")):
        with pytest.raises(BadParameter, match="No such file or directory"):
            load_problem(name)
