"""The program in this process: its words in a folder of a case, between streams of text."""

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
from dmplay.cli import config
from dmplay.errors import BadTranscript
from dmplay.policies import collaborative_predator_prey as hunters
from dmplay.problems.game_2048 import Game2048
from dmplay.transcript import format as transcripts
from dmplay.transcript.reading import parse_transcript
from tests.fuzz.case import GAME, Case, Told
from tests.support.terminals import clean_environment

TURNS = 500  # of a game that nothing else ends, as each turn takes its honest time
PLANNED = 1e6  # work for the plan of a hunt, beside which searchers act, which takes longer too


class Keyboard(io.TextIOWrapper):
    """What is typed, at a terminal or into a pipe."""

    def __init__(self, typed: str, *, terminal: bool) -> None:
        file = tempfile.TemporaryFile()  # noqa: SIM115 - closed with what reads it
        file.write(typed.encode(errors="surrogatepass"))
        file.seek(0)
        super().__init__(cast(BinaryIO, file), "utf-8", errors="surrogateescape")
        self._terminal = terminal

    def isatty(self) -> bool:
        return self._terminal


class Paper(io.TextIOWrapper):
    """A stream that takes all characters and can be read again."""

    def __init__(self) -> None:
        super().__init__(io.BytesIO(), "utf-8", errors="backslashreplace", newline="\n")

    @property
    def text(self) -> str:
        """All that was written."""
        self.flush()
        assert isinstance(self.buffer, io.BytesIO)
        return self.buffer.getvalue().decode()


def reads(case: Case) -> Told:
    """The transcript of a case, read strictly."""
    try:
        parse_transcript(case.files[GAME], GAME)
    except BadTranscript as error:
        return Told("refused", str(error))
    except Exception as error:
        return Told(type(error).__name__, trace=traceback.format_exc())
    return Told("read", "")


def dmplay(case: Case) -> Told:
    """The words of a case, said in its folder."""
    paper, errors, trace = Paper(), Paper(), ""
    streams = contextlib.redirect_stdout(paper), contextlib.redirect_stderr(errors)
    with laid_out(case), _spoken(case), streams[0], streams[1]:
        try:
            ending = _code()
        except Exception as error:
            ending, trace = type(error).__name__, traceback.format_exc()
        written = _written(case)
    return Told(ending, paper.text + errors.text, written, trace)


def _code() -> str:
    try:
        main()
    except SystemExit as end:
        return f"exit {end.code}"
    return "no exit"


@contextlib.contextmanager
def laid_out(case: Case) -> Iterator[None]:
    """The files of a case in a folder of its own, which is the current one and home to all.

    It is alone in another, so that `..` is no folder of the machine's.
    """
    with tempfile.TemporaryDirectory(prefix="fuzz-") as parent:
        folder = Path(parent, "case")
        folder.mkdir()
        here = clean_environment(folder, XDG_CONFIG_HOME=f"{folder}/config", COLUMNS="80")
        before = dict(os.environ)
        with contextlib.chdir(folder):
            for name, content in case.files.items():
                Path(name).parent.mkdir(parents=True, exist_ok=True)
                Path(name).write_bytes(content)
            try:
                _surrounded({**here, **case.variables})
                yield
            finally:
                _surrounded(before)


def _surrounded(variables: Mapping[str, str]) -> None:
    """Puts these variables in the place of all, and forgets what files of settings said."""
    os.environ.clear()
    os.environ.update(variables)
    config.load_config_files.cache_clear()


@contextlib.contextmanager
def _spoken(case: Case) -> Iterator[None]:
    """Its words, what is typed, less work where much is done rightly, and the same luck each time
    for a game without a seed.
    """
    luck = Random(str(case.words)).randbytes
    with contextlib.ExitStack() as stack:
        stack.callback(gc.set_threshold, *gc.get_threshold())
        for place, name, value in (
            (sys, "argv", ["dmplay", *case.words]),
            (sys, "stdin", stack.enter_context(Keyboard(case.typed, terminal=case.terminal))),
            (sys, "excepthook", sys.excepthook),
            (os, "urandom", luck),
            (transcripts, "DEFAULT_TURN_LIMIT", TURNS),
            (Game2048, "can_run_forever", True),
            (hunters, "PLAN_WORK_PER_JOINT_NODE", PLANNED),
        ):
            stack.callback(setattr, place, name, getattr(place, name))
            setattr(place, name, value)
        yield


def _written(case: Case) -> dict[str, bytes]:
    """The files there are now, but for those that are as they were."""
    found = {str(path): path.read_bytes() for path in Path().rglob("*") if path.is_file()}
    return {name: raw for name, raw in found.items() if raw != case.files.get(name)}
