"""Colours are erased with only where the terminal's description says that erasing fills."""

import os
import subprocess
import sys

import pytest

CODE = "import sys; from dmplay.terminal import fills; print(fills(sys.__stdout__))"


@pytest.mark.slow
@pytest.mark.parametrize(("term", "able"), [("linux", True), ("vt100", False), ("nosuch", False)])
def test_a_terminal_fills_if_its_description_says_so(term: str, able: bool) -> None:
    env = {**os.environ, "TERM": term}
    done = subprocess.run(
        [sys.executable, "-c", CODE], capture_output=True, text=True, check=True, env=env
    )
    assert done.stdout == f"{able}\n"
