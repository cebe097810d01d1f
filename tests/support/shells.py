"""The real bash, zsh and fish, in which the installed completion of dmplay is asked."""

import shutil
import sys
from pathlib import Path

from tests.support.programs import run_fresh_interpreter
from tests.support.terminals import ENTER, TAB, Terminal

SHELL_COMMANDS = {"bash": ("bash", "-i"), "zsh": ("zsh", "-i"), "fish": ("fish", "-i")}
CLEAR_LINE = "\x15"  # Ctrl-U


def is_installed(shell: str) -> bool:
    """Return whether this machine has a shell."""
    return shutil.which(shell) is not None


class CompletingShell:
    """A shell in a pseudo-terminal in which dmplay has installed its completion."""

    def __init__(self, shell: str, folder: Path) -> None:
        """Install the completion in a home folder, and start the shell in it."""
        home = folder / "home"
        package_folder = Path(__file__).parents[2]
        program = home / "bin" / "dmplay"
        program.parent.mkdir(parents=True)
        # completion is asked of dmplay; a line that is run only shows its words
        program.write_text(
            '#!/bin/sh\n[ -n "$_DMPLAY_COMPLETE" ] || { printf "<%s>" "$@"; exit; }\n'
            f'exec "{sys.executable}" -m dmplay "$@"\n'
        )
        program.chmod(0o755)
        # without this folder, fish begins to read all manual pages of the machine
        (home / ".local" / "share" / "fish" / "generated_completions").mkdir(parents=True)
        installed = run_fresh_interpreter(
            "--install-completion", shell, folder=home, env={"PYTHONPATH": str(package_folder)}
        )
        assert installed.returncode == 0, installed.stderr
        path = f"{program.parent}:/usr/local/bin:/usr/bin:/bin"
        self._terminal = Terminal(
            folder=folder,
            size=(200, 40),
            command=SHELL_COMMANDS[shell],
            env={
                "PATH": path,
                "HOME": str(home),
                "XDG_STATE_HOME": str(home / "state"),
                "PYTHONPATH": str(package_folder),
                "DMPLAY_PLAIN": "1",
            },
        )
        self._question_count = 0
        self._type("")  # The shell reads its start-up files first.
        self.complete("dmplay ")  # The first completion of zsh only loads the script.

    def __enter__(self) -> "CompletingShell":
        return self

    def __exit__(self, *error: object) -> None:
        self._terminal.__exit__(*error)

    def complete(self, line: str, *, tabs: int = 1) -> str:
        """Type a line, press Tab, clear the line, and return all that was printed meanwhile."""
        return self._type(line + TAB * tabs + CLEAR_LINE)

    def complete_and_run(self, line: str) -> str:
        """Type a line, press Tab and Enter, and return what was printed, with each word in <>."""
        return self._type(line + TAB + ENTER)

    def _type(self, keys: str) -> str:
        """Type keys and a question, and return what is printed until the shell answers it.

        The shell answers only once it has finished everything typed before. The quotation marks
        keep the answer out of the echo of the question.
        """
        self._question_count += 1
        start, answer = len(self._terminal.raw), f"answer{self._question_count}.".encode()
        self._terminal.press(f"{keys}echo ans'wer'{self._question_count}.{ENTER}")
        self._terminal.until(lambda: answer in self._terminal.raw[start:])
        self._terminal.calm()
        return self._terminal.raw[start:].decode(errors="replace")
