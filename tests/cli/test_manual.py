"""The manual page: the same text as the help, and whole."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from dmplay.cli import manual
from dmplay.cli.app import root_command

FILE = Path(manual.__file__).with_name("dmplay.1")
GROUP: Any = root_command()
COMMANDS = GROUP.commands | GROUP.commands["config"].commands


def test_the_page_that_is_shipped_is_the_help_of_today() -> None:
    assert FILE.read_text(encoding="utf-8") == manual.format_man_page()


@pytest.mark.parametrize("name", COMMANDS)
def test_the_page_names_every_option_of_every_command(name: str) -> None:
    page = FILE.read_text(encoding="utf-8").replace("\\-", "-")
    assert f".SS dmplay {name} " in page or f".SS dmplay config {name} " in page
    for one in COMMANDS[name].params:
        for option in one.opts if one.param_type_name == "option" else ():
            assert option in page


@pytest.mark.skipif(not shutil.which("groff"), reason="no typesetter here")
def test_the_page_prints_without_a_warning() -> None:
    words = ["groff", "-man", "-Tutf8", "-ww", str(FILE)]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    assert "printf 'e\\nne\\nquit\\n' | dmplay play hexworld" in done.stdout
