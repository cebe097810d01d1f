"""Other people's files, of a folder that DMPLAY_CORPUS names."""

import os
from pathlib import Path

import pytest

from dmplay.errors import BadParameter, DmplayError
from dmplay.finding.problems import load_problem
from dmplay.finding.ways import DATA_SUFFIXES

FOLDER = os.environ.get("DMPLAY_CORPUS", "")


@pytest.mark.skipif(not FOLDER, reason="DMPLAY_CORPUS names no folder of other people's files")
def test_files_of_others_are_read_or_refused_in_one_line(
    capsys: pytest.CaptureFixture[str],
) -> None:
    files = [
        path for path in sorted(Path(FOLDER).rglob("*")) if path.suffix.lower() in DATA_SUFFIXES
    ]
    refused = []
    for path in files:
        try:
            load_problem(str(path))
        except DmplayError as error:
            refused.append(f"{path}: {error}")
    with capsys.disabled():
        print(f"\n{len(files) - len(refused)} of {len(files)} files of {FOLDER} were read", end="")
        print("".join(f"\n  refused: {one}" for one in refused))
    assert files, f"{FOLDER} has no file of {', '.join(DATA_SUFFIXES)}"
    assert not any("\n" in one for one in refused)
    assert len(refused) < len(files)


def test_what_is_no_file_is_refused_in_one_line(tmp_path: Path) -> None:
    for name in ("none.pomdp", str(tmp_path / "no" / "x.nfg")):
        with pytest.raises(BadParameter, match="No such file or directory"):
            load_problem(name)
