"""Tests of background-colour erase, used only if the terminal's description supports it."""

import os
import subprocess
import sys

import pytest

PRINT_FILLS_CODE = (
    "import sys; from dmplay.terminal_capabilities import has_background_erase; "
    "print(has_background_erase(sys.__stdout__))"
)


@pytest.mark.slow
@pytest.mark.parametrize(("term", "fills"), [("linux", True), ("vt100", False), ("nosuch", False)])
def test_a_terminal_fills_erased_cells_if_its_description_says_so(term: str, fills: bool) -> None:
    env = {**os.environ, "TERM": term}
    completed = subprocess.run(
        [sys.executable, "-c", PRINT_FILLS_CODE],
        capture_output=True,
        text=True,
        check=True,
        env=env,
    )
    assert completed.stdout == f"{fills}\n"
