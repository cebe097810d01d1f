"""Verifying a transcript: do its facts follow from its inputs, and its inputs from its seed?"""

import hashlib
from collections.abc import Sequence
from itertools import zip_longest

import numpy as np

from dmplay.core import Policy, Problem
from dmplay.dice import NATURE, Dice
from dmplay.errors import BadParameter, BadPolicy, BadTranscript, TooMuch
from dmplay.session import Session, Turn
from dmplay.transcript.feeding import Ahead, feed, rows
from dmplay.transcript.format import (
    Frame,
    Writer,
    end_facts,
    framed,
    lines,
    short,
    turn_facts,
    without_notes,
)
from dmplay.transcript.header import header_facts
from dmplay.transcript.inputs import actions_of
from dmplay.transcript.reading import Block, Entry, Transcript
from dmplay.transcript.replay import start
from dmplay.transcript.report import Finding, Report, fault
from dmplay.transcript.rewriting import ended


def verify(
    transcript: Transcript,
    problem: Problem,
    policies: Sequence[Policy | None] = (),
    frame: Frame | None = None,
) -> Report:
    """Compares every fact with the replay of the inputs, and every input with seed and agents.

    `policies` are the agents to ask again; None stands for a seat that only the file can tell of.
    """
    seated = zip_longest(transcript.header.seats.values(), policies)
    unasked = dict.fromkeys(who for who, policy in seated if policy is None)
    report = Report(transcript.path, unasked=[*unasked], peeked=transcript.header.peeked)
    check = _Check(transcript, report, frame)
    try:
        check.game(problem, policies)
    except BadTranscript as error:
        report.findings.append(fault(error, "inputs"))
    except (BadParameter, TooMuch) as error:  # of a drawing
        line = transcript.header_block.line
        report.findings.append(Finding("frame", transcript.path, line, "frame", str(error)))
    return report


TOLERANCE = 1e-6  # of the scale of a fact that is a real number
REROLLS = 10  # numbers of a reroll that are tried where its draws are another's


class _Check:
    """One pass over a transcript, beside what would be written of it today."""

    def __init__(self, transcript: Transcript, report: Report, frame: Frame | None) -> None:
        self.transcript = transcript
        self.report = report
        self.frame = frame
        self.place = 0  # up to which the file is as it would be written today
        self.digest = hashlib.sha256()  # of what would be written
        self.differs: str | None = None  # what would be written from there on
        self.event: Block | None = None  # the last undo or reroll
        self.drawn: list[bool] = []  # whether each block's draws are the seed's

    def game(self, problem: Problem, policies: Sequence[Policy | None]) -> None:
        """Plays the transcript again and compares block by block."""
        transcript = self.transcript
        header = transcript.header
        dice = header.dice
        if self._limit_differs():
            return
        session = start(transcript, problem, dice, policies)
        self._as_written(transcript.header_block, lines(header_facts(header)))
        writer = Writer(session)
        self._block(transcript.blocks[0], session, dice, writer)
        blocks, place = transcript.blocks, 1
        ahead = Ahead(transcript, blocks, session)
        while place < len(blocks):
            turns = ahead.turns(place) if writer.plain and self.differs is None else None
            many = len(turns.state) if turns else 1
            if turns is None or not self._at_once(turns, session, dice, writer):
                for block in blocks[place : place + many]:
                    self._one(block, session, dice, writer)
            place += many
        self.report.turns, self.report.help = len(session.turns), dict(session.help)
        if len(self.drawn) > 1 and not any(self.drawn):
            self._blame_seed()
        self._end(session)

    def _at_once(self, turns: Turn, session: Session, dice: Dice, writer: Writer) -> bool:
        """Plays turns that are as they would be written today, by this seed and these agents;
        whether they are.
        """
        written = writer.turns(turns)
        if not self.transcript.content.startswith(written, self.place):
            return False
        many, count = turns.draws.shape
        thrown = session.rerolls
        seeds = [dice.draw(NATURE, n, thrown.get(n, 0), count) for n in session.numbers(many)]
        if not np.array_equal(turns.draws, np.concatenate(seeds)) or not session.agrees(turns):
            return False
        session.repeat(rows(turns))
        self.digest.update(written.encode())
        self.place += len(written)
        self.drawn += [True] * many * bool(count)
        return True

    def _one(self, block: Block, session: Session, dice: Dice, writer: Writer) -> None:
        """Plays a turn or an event, and compares it."""
        if block.kind == "turn":
            told = actions_of(self.transcript, block, session.problem)
            self._agents(block, session, told)
            feed(self.transcript, block, session, told)
            self._block(block, session, dice, writer)
        else:
            feed(self.transcript, block, session)
            self.event = block
            self._as_written(block, lines({block.kind: block[block.kind]}))

    def _as_written(self, block: Block, rows: list[str]) -> bool:
        """Whether a block stands in the file as it would be written today, with these lines."""
        text = block.anew(rows)
        self.digest.update((without_notes(text) if block.notes else text).encode())
        if self.differs is None and not self.transcript.content.startswith(text, self.place):
            self.differs = text
        if self.differs is None:
            self.place += len(text)
        return self.differs is None

    def _found(self, level: str, line: int, where: str, what: str, *pair: object) -> None:
        self.report.findings.append(Finding(level, self.transcript.path, line, where, what, *pair))

    def _limit_differs(self) -> bool:
        """A limit other than the one that ended the game: every later finding would follow."""
        end, header = self.transcript.end, self.transcript.header_block
        told = end["end"] if end else None
        if not isinstance(told, dict) or told.get("reason") != "turn limit":
            return False
        entry = header.entries.get("turns")
        last = self.transcript.blocks[-1].get("turn")
        if entry is None or entry.value == last or told.get("turns") != last:
            return False
        self._found("facts", entry.line, "header", "turns", entry.value, last)
        return True

    def _agents(self, block: Block, session: Session, told: Sequence[float]) -> None:
        """Asks the agents of this turn again."""
        try:
            choices = session.choices()
        except (BadPolicy, TooMuch) as error:
            raise self.transcript.fault(block.line, str(error)) from None
        for seat, (action, chosen) in enumerate(zip(told, choices, strict=True)):
            if chosen is not None and chosen != action:
                name = session.problem.agents[seat]
                did, does = (session.problem.action_name(seat, x) for x in (action, chosen))
                line = block.line_of("actions")
                where = f"turn {block['turn']}, {name}"
                self._found("inputs", line, where, "action", did, does)

    def _block(self, block: Block, session: Session, dice: Dice, writer: Writer) -> None:
        """Compares the facts, the frame and the draws of a turn or the opening."""
        turn = len(session.turns)
        self._luck(block, session, dice, turn)
        frame = self.frame(session) if block.frame and self.frame else ""
        if self._as_written(block, framed(writer.turn(), frame)):
            return
        facts = turn_facts(session)
        for key, got in facts.items():
            entry = block.entries.get(key)
            if entry is None:
                self._found("facts", block.line, f"turn {turn}", key, "nothing", got)
            elif key != "draws":
                self._fact(entry, turn, key, got)
        for key, entry in block.entries.items():
            if key not in facts:
                self._found("facts", entry.line, f"turn {turn}", key, entry.value, "nothing")
        if block.frame and self.frame:
            drawn = [row.rstrip() for row in frame.split("\n")]
            self._frame(block, turn, drawn)

    def _fact(self, entry: Entry, turn: int, key: str, got: object) -> None:
        """Compares one fact, seat by seat where it has seats."""
        told = entry.value
        if isinstance(told, dict) and isinstance(got, dict) and told.keys() == got.keys():
            for seat, value in got.items():
                if not _close(told[seat], value):
                    what = key.removesuffix("s") if key != "rewards" else "reward"
                    where = f"turn {turn}, {seat}"
                    self._found("facts", entry.line, where, what, told[seat], value)
        elif not _close(told, got):
            self._found("facts", entry.line, f"turn {turn}", key, told, got)

    def _frame(self, block: Block, turn: int, drawn: list[str]) -> None:
        for place, (told, row) in enumerate(zip_longest(block.frame, drawn)):
            if told != row:
                line = block.at(len(block.keys) + min(place, len(block.frame) - 1))
                shown = ("no more lines" if one is None else one for one in (told, row))
                self._found("frame", line, f"turn {turn}", "frame", *shown)
                return

    def _luck(self, block: Block, session: Session, dice: Dice, turn: int) -> None:
        """Compares a block's draws with the seed's."""
        draws = session.turns[-1].draws if turn else session.opening
        if not len(draws):
            return
        thrown = session.rerolls.get(turn, 0)
        seeds = dice.draw(NATURE, turn, thrown, len(draws))[0]
        self.drawn.append(seeds.tolist() == draws.tolist())
        if self.drawn[-1]:
            return
        event = self.event
        if thrown and event and event.kind == "reroll":
            for number in range(1, REROLLS):
                if (dice.draw(NATURE, turn, number, len(draws))[0] == draws).all():
                    self._found("inputs", event.line, f"turn {turn}", "reroll", thrown, number)
                    return
        line = block.line_of("draws")
        self._found("inputs", line, f"turn {turn}", "draws", draws.tolist(), seeds.tolist())

    def _blame_seed(self) -> None:
        """Every draw differs: then it is the seed that is wrong, not each of them."""
        findings = self.report.findings
        findings[:] = [one for one in findings if one.level != "inputs"]
        entry = self.transcript.header_block.entries["seed"]
        self._found(
            "inputs", entry.line, "every turn", "seed", "the seed of these draws", entry.value
        )

    def _end(self, session: Session) -> None:
        """Compares the end line, or says that there is none."""
        transcript = self.transcript
        end = transcript.end
        if end is None:
            torn = "a torn last turn" if transcript.torn else "no end line"
            line = transcript.content.count("\n") + 1
            where = f"turn {len(session.turns)}"
            self._found("unfinished", line, where, f"unfinished: {torn}")
            return
        entry = end.entries["end"]
        told = entry.value if isinstance(entry.value, dict) else {}
        if transcript.chosen:
            session.end(transcript.chosen)
        for key, got in end_facts(session).items():
            if not _close(told.get(key), got):
                self._found("facts", entry.line, "end", key, told.get(key), got)
            elif got is None:  # neither the file nor the game says why it ended
                self._found("facts", entry.line, "end", f"no {key}")
        if told.keys() - end_facts(session).keys() != {"sha256"}:
            self._found("facts", entry.line, "end", "keys", sorted(told), "... and sha256")
        if self.report.ok:
            self._checksum(end, session)

    def _checksum(self, end: Block, session: Session) -> None:
        """Where all facts hold, the checksum still says whether a line was touched."""
        content = self.transcript.content
        told = content[self.place :] + self.transcript.last
        written = self.differs or ended(end, session, short(self.digest))
        if told == written:
            return
        rows = zip_longest(told.split("\n"), written.split("\n"))
        first = content.count("\n", 0, self.place) + 1
        line, (row, right) = next(one for one in enumerate(rows, first) if one[1][0] != one[1][1])
        self._found("checksum", line, "line", "text", row or "nothing", right or "nothing")


def _close(told: object, got: object) -> bool:
    """Whether two facts agree: reals within the tolerance, everything else exactly."""
    if isinstance(told, list) and isinstance(got, list):
        return len(told) == len(got) and all(map(_close, told, got))
    if isinstance(told, dict) and isinstance(got, dict):
        return told.keys() == got.keys() and all(_close(told[key], got[key]) for key in got)
    if isinstance(told, bool) or isinstance(got, bool):
        return told is got
    if isinstance(told, float | int) and isinstance(got, float | int):
        return abs(told - got) <= TOLERANCE * max(1.0, abs(told), abs(got))
    return told == got
