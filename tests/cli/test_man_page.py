"""Tests of the manual page: it has the text of the help, and is complete."""

import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from dmplay.cli import man_page
from dmplay.cli.app import root_command

MANUAL_PATH = Path(man_page.__file__).with_name("dmplay.1")
GROUP: Any = root_command()
COMMANDS = GROUP.commands | GROUP.commands["config"].commands


def test_the_shipped_page_equals_the_current_help() -> None:
    assert MANUAL_PATH.read_text(encoding="utf-8") == man_page.format_man_page()


@pytest.mark.parametrize("name", COMMANDS)
def test_the_page_names_every_option_of_every_command(name: str) -> None:
    page = MANUAL_PATH.read_text(encoding="utf-8").replace("\\-", "-")
    assert f".SS dmplay {name} " in page or f".SS dmplay config {name} " in page
    for parameter in COMMANDS[name].params:
        for option in parameter.opts if parameter.param_type_name == "option" else ():
            assert option in page


@pytest.mark.skipif(not shutil.which("groff"), reason="no typesetter here")
def test_the_page_prints_without_a_warning() -> None:
    arguments = ["groff", "-man", "-Tutf8", "-ww", str(MANUAL_PATH)]
    result = subprocess.run(arguments, capture_output=True, text=True, check=True)
    assert result.stderr == ""
    assert "printf 'e\\nne\\nquit\\n' | dmplay play hexworld" in result.stdout
