"""Acts that a kill interrupts, and what must hold of their files afterwards."""

import re
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from subprocess import CompletedProcess

from tests.crash_tests.games import Game, count_events, play_without_kill, truncate_transcript
from tests.support.programs import run_dmplay

TRANSCRIPT_NAME, COPY_NAME = "g.dmt", "s.dmt"
PRINTED_TURN = re.compile(r"^(turn \d+\.|undone)", re.MULTILINE)
END_OF_GAME = re.compile(r"^(?:over|turn 0\. )", re.MULTILINE)
RESUME_EVENTS, BRANCH_EVENTS = 17, 9  # turns and events in a file that is resumed or branched
NO_FILE, EMPTY, PART, WHOLE = "no file", "empty", "part", "whole"


class Act(ABC):
    """Something done with a game in its own folder; `faults` yields what a kill broke."""

    by: Sequence[str] = ("agent", "person")
    grows = True  # whether its file grows turn by turn; otherwise it is complete when it appears

    def fits(self, game: Game) -> bool:
        """Return whether the act can be done with a game."""
        return game.by in self.by

    @abstractmethod
    def words(self, game: Game) -> Sequence[str]:
        """Return the arguments of the program."""

    def typed(self, game: Game, folder: Path) -> Sequence[str]:
        """Return the lines that are piped to the program."""
        return ()

    def before(self, game: Game) -> Mapping[str, bytes]:
        """Return the files that exist before the act, by name."""
        return {}

    def prepare(self, game: Game, folder: Path) -> None:
        """Write the files that exist before the act."""
        for name, content in self.before(game).items():
            (folder / name).write_bytes(content)

    def file(self, folder: Path) -> Path:
        """Return the path of the file that the act writes."""
        return folder / TRANSCRIPT_NAME

    @abstractmethod
    def faults(self, game: Game, folder: Path, output: str) -> Iterator[str]:
        """Yield the faults after a kill and a new attempt; `output` was printed before the kill."""

    @abstractmethod
    def left(self, game: Game, folder: Path) -> str:
        """Classify how much of the file exists."""

    def again(self, game: Game, folder: Path) -> CompletedProcess[str]:
        """Repeat the act."""
        return run_dmplay(folder, *self.words(game), stdin=join_lines(self.typed(game, folder)))


class Play(Act):
    """A new game with a given transcript path."""

    prior_event_count = 0  # turns and events before the first one that is played

    def words(self, game: Game) -> Sequence[str]:
        return (*game.words, "-o", TRANSCRIPT_NAME)

    def script(self, game: Game) -> Sequence[str]:
        """Return a line for each turn and event of the complete file."""
        return game.script

    def whole(self, game: Game) -> bytes:
        """Return the content of the file after an act that is not killed."""
        return play_without_kill(game)

    def typed(self, game: Game, folder: Path) -> Sequence[str]:
        return self.script(game)[
            max(count_events(_read_if_exists(self.file(folder))), self.prior_event_count) :
        ]

    def left(self, game: Game, folder: Path) -> str:
        content = _read_if_exists(self.file(folder))
        if not content:
            return EMPTY if self.file(folder).exists() else NO_FILE
        return WHOLE if content == self.whole(game) else PART

    def faults(self, game: Game, folder: Path, output: str) -> Iterator[str]:
        content, complete = _read_if_exists(self.file(folder)), self.whole(game)
        if not complete.startswith(content):
            yield "unequal: what is left is not how the game began"
        # After the game, the output repeats all turns with their hidden facts.
        printed_turns = len(PRINTED_TURN.findall(END_OF_GAME.split(output)[0]))
        if printed_turns and count_events(content) < self.prior_event_count + printed_turns:
            yield (
                f"lost: {self.prior_event_count + printed_turns} turns "
                f"were told, {count_events(content)} are kept"
            )
        process = self.resumed(game, folder) if content != complete else None
        if process and process.returncode:
            yield f"lost: not resumed: {process.stderr.strip()}"
        if _read_if_exists(self.file(folder)) != complete:
            yield "unequal: the game that was gone on with"

    def resumed(self, game: Game, folder: Path) -> CompletedProcess[str]:
        """Resume the game, or start it again if nothing was left."""
        if not _read_if_exists(self.file(folder)):
            return self.again(game, folder)
        remaining = self.script(game)[count_events(_read_if_exists(self.file(folder))) :]
        return run_dmplay(folder, "resume", self.file(folder).name, stdin=join_lines(remaining))


class Keep(Play):
    """A new game that is saved in the state folder."""

    by = ("person",)

    def words(self, game: Game) -> Sequence[str]:
        return game.words

    def file(self, folder: Path) -> Path:
        # The last one: a game that is killed before its first turn is not resumed, but begun anew.
        save_paths = [
            path for path in (folder / "state/dmplay/games").glob("*.dmt") if path.stat().st_size
        ]
        return max(save_paths, default=folder / "none")

    def resumed(self, game: Game, folder: Path) -> CompletedProcess[str]:
        remaining = self.script(game)[count_events(_read_if_exists(self.file(folder))) :]
        process = run_dmplay(folder, "resume", stdin=join_lines(remaining))
        if process.returncode == 2 and not count_events(_read_if_exists(self.file(folder))):
            return run_dmplay(folder, *game.words, stdin=join_lines(self.script(game)))
        return process


class Resume(Play):
    """A game that is resumed."""

    prior_event_count = RESUME_EVENTS

    def words(self, game: Game) -> Sequence[str]:
        return ("resume", TRANSCRIPT_NAME)

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {TRANSCRIPT_NAME: truncate_transcript(play_without_kill(game), RESUME_EVENTS)}


class Branch(Play):
    """A new game that branches from another one."""

    prior_event_count = BRANCH_EVENTS

    def words(self, game: Game) -> Sequence[str]:
        return ("branch", "other.dmt", "--at", str(BRANCH_EVENTS), "-o", TRANSCRIPT_NAME)

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {"other.dmt": play_without_kill(game)}

    def script(self, game: Game) -> Sequence[str]:
        return game.actions

    def whole(self, game: Game) -> bytes:
        return run_without_kill(self, game)


class Save(Play):
    """A game that saves a copy of itself on the way."""

    by = ("person",)

    def typed(self, game: Game, folder: Path) -> Sequence[str]:
        event_count = count_events(_read_if_exists(folder / TRANSCRIPT_NAME))
        script = [*game.script[event_count:]]
        if event_count <= RESUME_EVENTS and not (folder / COPY_NAME).exists():
            script.insert(RESUME_EVENTS - event_count, f"save {COPY_NAME}")
        return script

    def faults(self, game: Game, folder: Path, output: str) -> Iterator[str]:
        copy_was_reported = f"saved {COPY_NAME}" in output
        copy, complete = folder / COPY_NAME, truncate_transcript(self.whole(game), RESUME_EVENTS)
        if copy.exists() and copy.read_bytes() != complete:
            yield "unequal: the copy is not whole"
        if copy_was_reported and not copy.exists():
            yield "lost: the copy that was told of"
        yield from super().faults(game, folder, output)

    def resumed(self, game: Game, folder: Path) -> CompletedProcess[str]:
        words = (
            ("resume", TRANSCRIPT_NAME)
            if _read_if_exists(folder / TRANSCRIPT_NAME)
            else self.words(game)
        )
        return run_dmplay(folder, *words, stdin=join_lines(self.typed(game, folder)))


class Replace(Act):
    """A file that replaces an old one."""

    grows = False

    def old(self, game: Game) -> bytes:
        """Return the content of the old file."""
        return b"mine"

    def left(self, game: Game, folder: Path) -> str:
        return WHOLE if self.file(folder).read_bytes() == run_without_kill(self, game) else "old"

    def faults(self, game: Game, folder: Path, output: str) -> Iterator[str]:
        path, complete = self.file(folder), run_without_kill(self, game)
        if _read_if_exists(path) not in (self.old(game), complete):
            yield "unequal: neither the old file nor the new one"
        process = self.again(game, folder)
        if process.returncode:
            yield f"lost: cannot be done again, {process.returncode}: {process.stderr.strip()}"
        if _read_if_exists(path) != complete:
            yield "unequal: what was done again"


class Update(Replace):
    """A transcript that is rewritten in the current format."""

    def words(self, game: Game) -> Sequence[str]:
        return ("verify", TRANSCRIPT_NAME, "--update")

    def old(self, game: Game) -> bytes:
        return play_without_kill(game).replace(b'"total": ', b'"total":  ')

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {TRANSCRIPT_NAME: self.old(game)}


class Export(Replace):
    """A game that is exported as a screen recording."""

    def words(self, game: Game) -> Sequence[str]:
        return ("export", TRANSCRIPT_NAME, "--cast", "--force", "-o", "out")

    def before(self, game: Game) -> Mapping[str, bytes]:
        return {TRANSCRIPT_NAME: play_without_kill(game), "out": self.old(game)}

    def file(self, folder: Path) -> Path:
        return folder / "out"


ACTS: dict[str, Act] = {
    "play": Play(), "keep": Keep(), "resume": Resume(), "branch": Branch(), "save": Save(),
    "update": Update(), "export": Export(),
}  # fmt: skip


@cache
def run_without_kill(act: Act, game: Game) -> bytes:
    """Do an act without a kill, and return the content of its file."""
    with tempfile.TemporaryDirectory() as folder_name:
        folder = Path(folder_name)
        act.prepare(game, folder)
        process = act.again(game, folder)
        assert process.returncode == 0, process.stderr
        return act.file(folder).read_bytes()


def find_temporary_files(folder: Path) -> list[str]:
    """Return the names of temporary files of unfinished writes."""
    return [path.name for path in folder.rglob("*.tmp")]


def join_lines(input_lines: Sequence[str]) -> str:
    """Join the lines that are piped to the program."""
    return "".join(f"{line}\n" for line in input_lines)


def _read_if_exists(path: Path) -> bytes:
    return path.read_bytes() if path.exists() else b""
