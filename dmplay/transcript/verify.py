"""Verifying a transcript: do its facts follow from its inputs, and its inputs from its seed?"""

import hashlib
from collections.abc import Sequence
from itertools import zip_longest

import numpy as np

from dmplay.core import Policy, Problem
from dmplay.dice import NATURE_STREAM, SeededUniforms
from dmplay.errors import BadParameter, BadPolicy, BadTranscript, BudgetExceeded
from dmplay.session import Session, Turn
from dmplay.transcript.feeding import BatchReplayer, apply_block, split_turns
from dmplay.transcript.format import (
    FrameRenderer,
    TurnFormatter,
    append_frame,
    collect_end_facts,
    collect_turn_facts,
    format_lines,
    shorten_digest,
    strip_notes,
)
from dmplay.transcript.header import collect_header_facts
from dmplay.transcript.inputs import read_actions
from dmplay.transcript.reading import Block, Entry, Transcript
from dmplay.transcript.replay import start_session
from dmplay.transcript.report import Finding, VerificationReport, make_finding
from dmplay.transcript.rewriting import rewrite_end


def verify(
    transcript: Transcript,
    problem: Problem,
    policies: Sequence[Policy | None] = (),
    frame: FrameRenderer | None = None,
) -> VerificationReport:
    """Compares every fact with the replay of the inputs, and every input with seed and agents.

    `policies` are the agents to ask again; None stands for a seat that only the file can tell of.
    """
    seated = zip_longest(transcript.header.seats.values(), policies)
    unasked = dict.fromkeys(who for who, policy in seated if policy is None)
    report = VerificationReport(
        transcript.path, unchecked_players=[*unasked], peeked=transcript.header.peeked
    )
    check = _Verifier(transcript, report, frame)
    try:
        check.check_game(problem, policies)
    except BadTranscript as error:
        report.findings.append(make_finding(error, "inputs"))
    except (BadParameter, BudgetExceeded) as error:  # of a drawing
        line = transcript.header_block.line
        report.findings.append(Finding("frame", transcript.path, line, "frame", str(error)))
    return report


RELATIVE_TOLERANCE = 1e-6  # of the scale of a fact that is a real number
MAX_TRIED_REROLLS = 10  # numbers of a reroll that are tried where its draws are another's


class _Verifier:
    """One pass over a transcript, beside what would be written of it today."""

    def __init__(
        self, transcript: Transcript, report: VerificationReport, frame: FrameRenderer | None
    ) -> None:
        self.transcript = transcript
        self.report = report
        self.frame = frame
        self.matched_chars = 0  # up to which the file is as it would be written today
        self.rewritten_digest = hashlib.sha256()  # of what would be written
        self.first_mismatch: str | None = None  # what would be written from there on
        self.last_event: Block | None = None  # the last undo or reroll
        self.uniforms_match: list[bool] = []  # whether each block's draws are the seed's

    def check_game(self, problem: Problem, policies: Sequence[Policy | None]) -> None:
        """Plays the transcript again and compares block by block."""
        transcript = self.transcript
        header = transcript.header
        dice = header.uniform_source
        if self._check_turn_limit():
            return
        session = start_session(transcript, problem, dice, policies)
        self._matches_rewriting(transcript.header_block, format_lines(collect_header_facts(header)))
        writer = TurnFormatter(session)
        self._compare_turn(transcript.blocks[0], session, dice, writer)
        blocks, place = transcript.blocks, 1
        ahead = BatchReplayer(transcript, blocks, session)
        while place < len(blocks):
            turns = (
                ahead.compute_turns(place)
                if writer.omits_belief and self.first_mismatch is None
                else None
            )
            many = len(turns.state) if turns else 1
            if turns is None or not self._check_batch(turns, session, dice, writer):
                for block in blocks[place : place + many]:
                    self._check_block(block, session, dice, writer)
            place += many
        self.report.turns, self.report.hint_counts = len(session.turns), dict(session.hint_counts)
        if len(self.uniforms_match) > 1 and not any(self.uniforms_match):
            self._report_wrong_seed()
        self._compare_end(session)

    def _check_batch(
        self,
        turns: Turn,
        session: Session,
        uniform_source: SeededUniforms,
        formatter: TurnFormatter,
    ) -> bool:
        """Plays turns that are as they would be written today, by this seed and these agents;
        whether they are.
        """
        written = formatter.format_turns(turns)
        if not self.transcript.content.startswith(written, self.matched_chars):
            return False
        many, count = turns.uniforms.shape
        thrown = session.reroll_counts
        seeds = [
            uniform_source.generate_uniforms(NATURE_STREAM, n, thrown.get(n, 0), count)
            for n in session.next_turn_numbers(many)
        ]
        if not np.array_equal(
            turns.uniforms, np.concatenate(seeds)
        ) or not session.can_reproduce_turns(turns):
            return False
        session.append_turns(split_turns(turns))
        self.rewritten_digest.update(written.encode())
        self.matched_chars += len(written)
        self.uniforms_match += [True] * many * bool(count)
        return True

    def _check_block(
        self,
        block: Block,
        session: Session,
        uniform_source: SeededUniforms,
        formatter: TurnFormatter,
    ) -> None:
        """Plays a turn or an event, and compares it."""
        if block.kind == "turn":
            told = read_actions(self.transcript, block, session.problem)
            self._compare_agent_actions(block, session, told)
            apply_block(self.transcript, block, session, told)
            self._compare_turn(block, session, uniform_source, formatter)
        else:
            apply_block(self.transcript, block, session)
            self.last_event = block
            self._matches_rewriting(block, format_lines({block.kind: block[block.kind]}))

    def _matches_rewriting(self, block: Block, rows: list[str]) -> bool:
        """Whether a block stands in the file as it would be written today, with these lines."""
        text = block.rewrite(rows)
        self.rewritten_digest.update((strip_notes(text) if block.notes else text).encode())
        if self.first_mismatch is None and not self.transcript.content.startswith(
            text, self.matched_chars
        ):
            self.first_mismatch = text
        if self.first_mismatch is None:
            self.matched_chars += len(text)
        return self.first_mismatch is None

    def _add_finding(
        self, level: str, line: int, location: str, subject: str, *pair: object
    ) -> None:
        self.report.findings.append(
            Finding(level, self.transcript.path, line, location, subject, *pair)
        )

    def _check_turn_limit(self) -> bool:
        """A limit other than the one that ended the game: every later finding would follow."""
        end, header = self.transcript.end_block, self.transcript.header_block
        told = end["end"] if end else None
        if not isinstance(told, dict) or told.get("reason") != "turn limit":
            return False
        entry = header.entries.get("turns")
        last = self.transcript.blocks[-1].get("turn")
        if entry is None or entry.value == last or told.get("turns") != last:
            return False
        self._add_finding("facts", entry.line, "header", "turns", entry.value, last)
        return True

    def _compare_agent_actions(
        self, block: Block, session: Session, recorded: Sequence[float]
    ) -> None:
        """Asks the agents of this turn again."""
        try:
            choices = session.choose_policy_actions()
        except (BadPolicy, BudgetExceeded) as error:
            raise self.transcript.error_at(block.line, str(error)) from None
        for seat, (action, chosen) in enumerate(zip(recorded, choices, strict=True)):
            if chosen is not None and chosen != action:
                name = session.problem.agents[seat]
                did, does = (session.problem.format_action(seat, x) for x in (action, chosen))
                line = block.line_of_key("actions")
                where = f"turn {block['turn']}, {name}"
                self._add_finding("inputs", line, where, "action", did, does)

    def _compare_turn(
        self,
        block: Block,
        session: Session,
        uniform_source: SeededUniforms,
        formatter: TurnFormatter,
    ) -> None:
        """Compares the facts, the frame and the draws of a turn or the opening."""
        turn = len(session.turns)
        self._compare_uniforms(block, session, uniform_source, turn)
        frame = self.frame(session) if block.frame and self.frame else ""
        if self._matches_rewriting(block, append_frame(formatter.format_turn(), frame)):
            return
        facts = collect_turn_facts(session)
        for key, got in facts.items():
            entry = block.entries.get(key)
            if entry is None:
                self._add_finding("facts", block.line, f"turn {turn}", key, "nothing", got)
            elif key != "draws":
                self._compare_fact(entry, turn, key, got)
        for key, entry in block.entries.items():
            if key not in facts:
                self._add_finding("facts", entry.line, f"turn {turn}", key, entry.value, "nothing")
        if block.frame and self.frame:
            drawn = [row.rstrip() for row in frame.split("\n")]
            self._compare_frame(block, turn, drawn)

    def _compare_fact(self, entry: Entry, turn: int, key: str, replayed: object) -> None:
        """Compares one fact, seat by seat where it has seats."""
        told = entry.value
        if isinstance(told, dict) and isinstance(replayed, dict) and told.keys() == replayed.keys():
            for seat, value in replayed.items():
                if not _is_close(told[seat], value):
                    what = key.removesuffix("s") if key != "rewards" else "reward"
                    where = f"turn {turn}, {seat}"
                    self._add_finding("facts", entry.line, where, what, told[seat], value)
        elif not _is_close(told, replayed):
            self._add_finding("facts", entry.line, f"turn {turn}", key, told, replayed)

    def _compare_frame(self, block: Block, turn: int, rendered: list[str]) -> None:
        for place, (told, row) in enumerate(zip_longest(block.frame, rendered)):
            if told != row:
                line = block.file_line(len(block.keys) + min(place, len(block.frame) - 1))
                shown = ("no more lines" if one is None else one for one in (told, row))
                self._add_finding("frame", line, f"turn {turn}", "frame", *shown)
                return

    def _compare_uniforms(
        self, block: Block, session: Session, uniform_source: SeededUniforms, turn: int
    ) -> None:
        """Compares a block's draws with the seed's."""
        draws = session.turns[-1].uniforms if turn else session.initial_uniforms
        if not len(draws):
            return
        thrown = session.reroll_counts.get(turn, 0)
        seeds = uniform_source.generate_uniforms(NATURE_STREAM, turn, thrown, len(draws))[0]
        self.uniforms_match.append(seeds.tolist() == draws.tolist())
        if self.uniforms_match[-1]:
            return
        event = self.last_event
        if thrown and event and event.kind == "reroll":
            for number in range(1, MAX_TRIED_REROLLS):
                if (
                    uniform_source.generate_uniforms(NATURE_STREAM, turn, number, len(draws))[0]
                    == draws
                ).all():
                    self._add_finding(
                        "inputs", event.line, f"turn {turn}", "reroll", thrown, number
                    )
                    return
        line = block.line_of_key("draws")
        self._add_finding("inputs", line, f"turn {turn}", "draws", draws.tolist(), seeds.tolist())

    def _report_wrong_seed(self) -> None:
        """Every draw differs: then it is the seed that is wrong, not each of them."""
        findings = self.report.findings
        findings[:] = [one for one in findings if one.level != "inputs"]
        entry = self.transcript.header_block.entries["seed"]
        self._add_finding(
            "inputs", entry.line, "every turn", "seed", "the seed of these draws", entry.value
        )

    def _compare_end(self, session: Session) -> None:
        """Compares the end line, or says that there is none."""
        transcript = self.transcript
        end = transcript.end_block
        if end is None:
            torn = "a torn last turn" if transcript.torn_tail else "no end line"
            line = transcript.content.count("\n") + 1
            where = f"turn {len(session.turns)}"
            self._add_finding("unfinished", line, where, f"unfinished: {torn}")
            return
        entry = end.entries["end"]
        told = entry.value if isinstance(entry.value, dict) else {}
        if transcript.player_end_reason:
            session.end(transcript.player_end_reason)
        for key, got in collect_end_facts(session).items():
            if not _is_close(told.get(key), got):
                self._add_finding("facts", entry.line, "end", key, told.get(key), got)
            elif got is None:  # neither the file nor the game says why it ended
                self._add_finding("facts", entry.line, "end", f"no {key}")
        if told.keys() - collect_end_facts(session).keys() != {"sha256"}:
            self._add_finding("facts", entry.line, "end", "keys", sorted(told), "... and sha256")
        if self.report.is_ok:
            self._compare_checksum(end, session)

    def _compare_checksum(self, end: Block, session: Session) -> None:
        """Where all facts hold, the checksum still says whether a line was touched."""
        content = self.transcript.content
        told = content[self.matched_chars :] + self.transcript.end_text
        written = self.first_mismatch or rewrite_end(
            end, session, shorten_digest(self.rewritten_digest)
        )
        if told == written:
            return
        rows = zip_longest(told.split("\n"), written.split("\n"))
        first = content.count("\n", 0, self.matched_chars) + 1
        line, (row, right) = next(one for one in enumerate(rows, first) if one[1][0] != one[1][1])
        self._add_finding("checksum", line, "line", "text", row or "nothing", right or "nothing")


def _is_close(recorded: object, replayed: object) -> bool:
    """Whether two facts agree: reals within the tolerance, everything else exactly."""
    if isinstance(recorded, list) and isinstance(replayed, list):
        return len(recorded) == len(replayed) and all(map(_is_close, recorded, replayed))
    if isinstance(recorded, dict) and isinstance(replayed, dict):
        return recorded.keys() == replayed.keys() and all(
            _is_close(recorded[key], replayed[key]) for key in replayed
        )
    if isinstance(recorded, bool) or isinstance(replayed, bool):
        return recorded is replayed
    if isinstance(recorded, float | int) and isinstance(replayed, float | int):
        return abs(recorded - replayed) <= RELATIVE_TOLERANCE * max(
            1.0, abs(recorded), abs(replayed)
        )
    return recorded == replayed
