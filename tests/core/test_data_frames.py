"""Tables become data frames of pandas or polars, whichever is installed or named."""

import importlib.util
from importlib.machinery import ModuleSpec

import pytest

from dmplay.core import data_frames
from dmplay.core.data_frames import make_frame
from dmplay.errors import BadParameter, UnknownName

ROWS = [{"turn": 1, "action": "e"}, {"turn": 2, "action": "ne", "belief": [0.25, 0.75]}]


@pytest.mark.parametrize(
    "library",
    [pytest.param(name, marks=pytest.mark.extra(name)) for name in data_frames.FRAME_LIBRARIES],
)
def test_rows_become_a_frame_of_the_chosen_library(library: str) -> None:
    frame = make_frame(ROWS, library)
    assert type(frame).__module__.startswith(library)
    assert [*frame.columns] == ["turn", "action", "belief"]
    assert [*frame["turn"]] == [1, 2]
    missing, belief = frame["belief"]
    assert missing is None
    assert [*belief] == [0.25, 0.75]


def test_an_unknown_library_is_named() -> None:
    with pytest.raises(UnknownName, match="unknown library 'panda'; did you mean pandas"):
        make_frame(ROWS, "panda")


@pytest.mark.parametrize("library", ["", *data_frames.FRAME_LIBRARIES])
def test_the_extra_to_install_is_named(library: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def find_nothing(name: str) -> ModuleSpec | None:
        return None if name in data_frames.FRAME_LIBRARIES else importlib.util.find_spec(name)

    monkeypatch.setattr(data_frames, "find_spec", find_nothing)
    with pytest.raises(BadParameter, match=rf"not installed.*dmplay\[{library or 'pandas'}\]"):
        make_frame(ROWS, library)
