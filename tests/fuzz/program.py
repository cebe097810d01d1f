"""The program in this process: its command line in the folder of a case, with captured streams."""

import contextlib
import gc
import io
import os
import sys
import tempfile
import traceback
from collections.abc import Iterator, Mapping
from pathlib import Path
from random import Random
from typing import BinaryIO, cast

from dmplay.__main__ import main
from dmplay.cli import config_files
from dmplay.errors import BadTranscript
from dmplay.problems.collaborative_predator_prey import agents as hunters
from dmplay.problems.game_2048.rules import Game2048
from dmplay.transcript import format as transcripts
from dmplay.transcript.reader import parse_transcript
from tests.fuzz.case import GAME_FILE, Case, CaseOutcome
from tests.support.terminals import clean_environment

MAX_AGENT_TURNS = 500  # in a game of agents that nothing else ends, because each turn takes time
HUNT_PLAN_WORK = 1e6  # for the plan of a hunt; the searches of other agents take longer too


class TypedInput(io.TextIOWrapper):
    """Standard input with typed text, as a terminal or a pipe."""

    def __init__(self, typed: str, *, terminal: bool) -> None:
        file = tempfile.TemporaryFile()  # noqa: SIM115 - closed with what reads it
        file.write(typed.encode(errors="surrogatepass"))
        file.seek(0)
        super().__init__(cast(BinaryIO, file), "utf-8", errors="surrogateescape")
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


class CapturedStream(io.TextIOWrapper):
    """A text stream that accepts all characters and can be read again."""

    def __init__(self) -> None:
        super().__init__(io.BytesIO(), "utf-8", errors="backslashreplace", newline="\n")

    @property
    def text(self) -> str:
        """Everything that was written."""
        self.flush()
        assert isinstance(self.buffer, io.BytesIO)
        return self.buffer.getvalue().decode()


def parse_case_transcript(case: Case) -> CaseOutcome:
    """Parse the transcript of a case strictly."""
    try:
        parse_transcript(case.files[GAME_FILE], GAME_FILE)
    except BadTranscript as error:
        return CaseOutcome("refused", str(error))
    except Exception as error:
        return CaseOutcome(type(error).__name__, trace=traceback.format_exc())
    return CaseOutcome("read", "")


def run_dmplay(case: Case) -> CaseOutcome:
    """Run the command line of a case in its folder."""
    output, errors, trace = CapturedStream(), CapturedStream(), ""
    streams = contextlib.redirect_stdout(output), contextlib.redirect_stderr(errors)
    with enter_case_folder(case), _patch_process(case), streams[0], streams[1]:
        try:
            ending = _run_main()
        except Exception as error:
            ending, trace = type(error).__name__, traceback.format_exc()
        written_files = _read_written_files(case)
    return CaseOutcome(ending, output.text + errors.text, written_files, trace)


def _run_main() -> str:
    try:
        main()
    except SystemExit as end:
        return f"exit {end.code}"
    return "no exit"


@contextlib.contextmanager
def enter_case_folder(case: Case) -> Iterator[None]:
    """Write the files of a case to a new folder, and make it the current and home folder.

    Its parent folder is new too, so that `..` is not a folder of the machine.
    """
    with tempfile.TemporaryDirectory(prefix="fuzz-") as parent:
        folder = Path(parent, "case")
        folder.mkdir()
        environment = clean_environment(folder, XDG_CONFIG_HOME=f"{folder}/config", COLUMNS="80")
        old_environment = dict(os.environ)
        with contextlib.chdir(folder):
            for name, content in case.files.items():
                Path(name).parent.mkdir(parents=True, exist_ok=True)
                Path(name).write_bytes(content)
            try:
                _replace_environment({**environment, **case.variables})
                yield
            finally:
                _replace_environment(old_environment)


def _replace_environment(variables: Mapping[str, str]) -> None:
    """Replace all environment variables, and clear the cache of settings files."""
    os.environ.clear()
    os.environ.update(variables)
    config_files.load_config_files.cache_clear()


@contextlib.contextmanager
def _patch_process(case: Case) -> Iterator[None]:
    """Set the arguments and the typed input of a case, and limit the work of long computations.

    A game without a seed gets the same random bytes each time.
    """
    random_bytes = Random(str(case.words)).randbytes
    with contextlib.ExitStack() as stack:
        stack.callback(gc.set_threshold, *gc.get_threshold())
        for owner, name, value in (
            (sys, "argv", ["dmplay", *case.words]),
            (sys, "stdin", stack.enter_context(TypedInput(case.typed, terminal=case.terminal))),
            (sys, "excepthook", sys.excepthook),
            (os, "urandom", random_bytes),
            (transcripts, "DEFAULT_TURN_LIMIT", MAX_AGENT_TURNS),
            (Game2048, "can_run_forever", True),
            (hunters, "PLAN_WORK_PER_JOINT_NODE", HUNT_PLAN_WORK),
        ):
            stack.callback(setattr, owner, name, getattr(owner, name))
            setattr(owner, name, value)
        yield


def _read_written_files(case: Case) -> dict[str, bytes]:
    """Return the files that are new or changed."""
    contents = {str(path): path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    return {name: raw for name, raw in contents.items() if raw != case.files.get(name)}
