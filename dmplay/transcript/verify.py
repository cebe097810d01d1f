"""Verification of a transcript: of its facts by its inputs, and of its inputs by its seed."""

import hashlib
from collections.abc import Sequence
from itertools import zip_longest

import numpy as np

from dmplay.core.policy import Policy
from dmplay.core.problem import Problem
from dmplay.core.session import Session, Turn, can_reproduce_turns, number_next_turns
from dmplay.core.uniforms import NATURE_STREAM, SeededUniforms, generate_uniforms_of_turns
from dmplay.errors import BadParameter, BadPolicy, BadTranscript, BudgetExceeded
from dmplay.transcript.draws_and_actions import read_actions
from dmplay.transcript.format import (
    FrameRenderer,
    TurnFormatter,
    collect_end_facts,
    collect_turn_facts,
    format_lines,
    format_with_frame,
    shorten_digest,
    strip_notes,
)
from dmplay.transcript.header import collect_header_facts
from dmplay.transcript.reader import Block, Entry, Transcript
from dmplay.transcript.regeneration import rewrite_end
from dmplay.transcript.replay import start_session
from dmplay.transcript.turn_batch_replay import BatchReplayer, apply_block, split_turns
from dmplay.transcript.verification_report import Finding, VerificationReport, make_finding


def verify_transcript(
    transcript: Transcript,
    problem: Problem,
    policies: Sequence[Policy | None] = (),
    frame: FrameRenderer | None = None,
) -> VerificationReport:
    """Return a report that compares facts with a replay, and inputs with the seed and agents.

    The `policies` choose again; None stands for a seat whose actions only the file records.
    """
    pairs = zip_longest(transcript.header.seats.values(), policies)
    unchecked_players = dict.fromkeys(player for player, policy in pairs if policy is None)
    for entry in transcript.header.earlier:
        unchecked_players |= dict.fromkeys(entry["seats"].values())
    report = VerificationReport(
        transcript.path,
        unchecked_players=[*unchecked_players],
        peeked=transcript.header.peeked,
        has_changed_line_ends=transcript.has_changed_line_ends,
    )
    check = _Verifier(transcript, report, frame)
    try:
        check.check_game(problem, policies)
    except BadTranscript as error:
        report.findings.append(make_finding(error, "inputs"))
    except (BadParameter, BudgetExceeded) as error:  # raised when a frame is rendered
        line = transcript.header_block.line
        report.findings.append(Finding("frame", transcript.path, line, "frame", str(error)))
    return report


RELATIVE_TOLERANCE = 1e-6  # relative to the magnitude of a real-valued fact
MAX_TRIED_REROLLS = 10  # numbers that are tried if the uniforms belong to another reroll


class _Verifier:
    """One pass over a transcript, compared with the file that the current code would write."""

    def __init__(
        self, transcript: Transcript, report: VerificationReport, frame: FrameRenderer | None
    ) -> None:
        self.transcript = transcript
        self.report = report
        self.frame = frame
        self.matched_chars = 0  # length of the text in which the file equals its rewriting
        self.rewritten_digest = hashlib.sha256()  # of the rewriting
        self.first_mismatch: str | None = None  # first block of the rewriting that differs
        # last block that is not a turn, such as an undo or a reroll
        self.last_event: Block | None = None
        # for each block, whether its uniforms follow from the seed
        self.uniforms_match: list[bool] = []

    def check_game(self, problem: Problem, policies: Sequence[Policy | None]) -> None:
        """Replay the transcript and compare it block by block."""
        transcript = self.transcript
        header = transcript.header
        uniform_source = header.uniform_source
        if self._check_turn_limit():
            return
        session = start_session(transcript, problem, uniform_source, policies)
        self._matches_rewriting(transcript.header_block, format_lines(collect_header_facts(header)))
        formatter = TurnFormatter(session)
        self._compare_turn(transcript.blocks[0], session, uniform_source, formatter)
        blocks, position = transcript.blocks, 1
        replayer = BatchReplayer(transcript, blocks, session)
        while position < len(blocks):
            turns = None
            if formatter.omits_belief and self.first_mismatch is None:
                turns = replayer.compute_turns_at_once(position)
            turn_count = len(turns.state) if turns else 1
            if turns is None or not self._check_batch(turns, session, uniform_source, formatter):
                for block in blocks[position : position + turn_count]:
                    self._check_block(block, session, uniform_source, formatter)
            position += turn_count
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
        """Play turns if they equal their rewriting by seed and agents; return whether they do."""
        new_text = formatter.format_turns(turns)
        if not self.transcript.content.startswith(new_text, self.matched_chars):
            return False
        turn_count, uniform_count = turns.uniforms.shape
        rerolls = session.reroll_counts
        numbers = [(n, rerolls.get(n, 0)) for n in number_next_turns(session, turn_count)]
        seed_uniforms = generate_uniforms_of_turns(
            uniform_source, NATURE_STREAM, numbers, uniform_count
        )
        if not np.array_equal(turns.uniforms, seed_uniforms) or not can_reproduce_turns(
            session, turns, uniform_source
        ):
            return False
        session.append_turns(split_turns(turns))
        self.rewritten_digest.update(new_text.encode())
        self.matched_chars += len(new_text)
        self.uniforms_match += [True] * turn_count * bool(uniform_count)
        return True

    def _check_block(
        self,
        block: Block,
        session: Session,
        uniform_source: SeededUniforms,
        formatter: TurnFormatter,
    ) -> None:
        """Play a turn or an event, and compare it."""
        if block.kind == "turn":
            actions = read_actions(self.transcript, block, session.problem)
            self._compare_agent_actions(block, session, actions)
            apply_block(self.transcript, block, session, actions)
            self._compare_turn(block, session, uniform_source, formatter)
        else:
            apply_block(self.transcript, block, session)
            self.last_event = block
            self._matches_rewriting(block, format_lines({block.kind: block[block.kind]}))

    def _matches_rewriting(self, block: Block, rows: list[str]) -> bool:
        """Return whether the file equals its rewriting up to this block, with these new lines."""
        text = block.replace_lines(rows)
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
        """Append a finding to the report."""
        self.report.findings.append(
            Finding(level, self.transcript.path, line, location, subject, *pair)
        )

    def _check_turn_limit(self) -> bool:
        """Return whether the turn limit differs from the one that ended the game, and report it.

        All later findings would follow from it.
        """
        end, header = self.transcript.end_block, self.transcript.header_block
        end_facts = end["end"] if end else None
        if not isinstance(end_facts, dict) or end_facts.get("reason") != "turn limit":
            return False
        entry = header.entries.get("turns")
        last = self.transcript.blocks[-1].get_value("turn")
        if entry is None or entry.value == last or end_facts.get("turns") != last:
            return False
        self._add_finding("facts", entry.line, "header", "turns", entry.value, last)
        return True

    def _compare_agent_actions(
        self, block: Block, session: Session, recorded: Sequence[float]
    ) -> None:
        """Compare the agents' actions in a turn with those that they choose now.

        Raises BadTranscript if an agent fails.
        """
        try:
            choices = session.choose_policy_actions()
        except (BadPolicy, BudgetExceeded) as error:
            raise self.transcript.error_at(block.line, str(error)) from None
        earlier_turns = self.transcript.header.count_turns_of_earlier_players()
        for seat, (action, choice) in enumerate(zip(recorded, choices, strict=True)):
            if (
                choice is not None
                and choice != action
                and len(session.turns) >= earlier_turns[seat]
            ):
                agent = session.problem.agents[seat]
                recorded_name, chosen_name = (
                    session.problem.format_action(seat, x) for x in (action, choice)
                )
                line = block.line_of_key("actions")
                location = f"turn {block['turn']}, {agent}"
                self._add_finding("inputs", line, location, "action", recorded_name, chosen_name)

    def _compare_turn(
        self,
        block: Block,
        session: Session,
        uniform_source: SeededUniforms,
        formatter: TurnFormatter,
    ) -> None:
        """Add a finding for each fact, frame or uniform of a turn, or the start, that differs."""
        turn = len(session.turns)
        self._compare_uniforms(block, session, uniform_source, turn)
        recorded_frame = "\n".join(block.frame)
        frame = self.frame(session) if block.frame and self.frame else recorded_frame
        if self._matches_rewriting(block, format_with_frame(formatter.format_turn(), frame)):
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
            frame_rows = [row.rstrip() for row in frame.split("\n")]
            self._compare_frame(block, turn, frame_rows)

    def _compare_fact(self, entry: Entry, turn: int, key: str, replayed: object) -> None:
        """Compare one fact, seat by seat if it has a value for each seat."""
        recorded = entry.value
        if (
            isinstance(recorded, dict)
            and isinstance(replayed, dict)
            and recorded.keys() == replayed.keys()
        ):
            for seat, value in replayed.items():
                if not _is_close(recorded[seat], value):
                    fact_name = key.removesuffix("s") if key != "rewards" else "reward"
                    location = f"turn {turn}, {seat}"
                    self._add_finding(
                        "facts", entry.line, location, fact_name, recorded[seat], value
                    )
        elif not _is_close(recorded, replayed):
            self._add_finding("facts", entry.line, f"turn {turn}", key, recorded, replayed)

    def _compare_frame(self, block: Block, turn: int, rendered: list[str]) -> None:
        """Compare a frame line by line, and report the first difference."""
        for index, (recorded_row, row) in enumerate(zip_longest(block.frame, rendered)):
            if recorded_row != row:
                line = block.file_line(len(block.keys) + min(index, len(block.frame) - 1))
                row_texts = (
                    "no more lines" if text is None else text for text in (recorded_row, row)
                )
                self._add_finding("frame", line, f"turn {turn}", "frame", *row_texts)
                return

    def _compare_uniforms(
        self, block: Block, session: Session, uniform_source: SeededUniforms, turn: int
    ) -> None:
        """Compare a block's uniforms with those of the seed.

        If those of a reroll differ, report another number of the reroll that would match.
        """
        uniforms = session.turns[-1].uniforms if turn else session.initial_uniforms
        if not len(uniforms):
            return
        reroll = session.reroll_counts.get(turn, 0)
        seed_uniforms = uniform_source.generate_uniforms(
            NATURE_STREAM, turn, reroll, len(uniforms)
        )[0]
        self.uniforms_match.append(seed_uniforms.tolist() == uniforms.tolist())
        if self.uniforms_match[-1]:
            return
        event = self.last_event
        if reroll and event and event.kind == "reroll":
            for number in range(1, MAX_TRIED_REROLLS):
                if (
                    uniform_source.generate_uniforms(NATURE_STREAM, turn, number, len(uniforms))[0]
                    == uniforms
                ).all():
                    self._add_finding(
                        "inputs", event.line, f"turn {turn}", "reroll", reroll, number
                    )
                    return
        line = block.line_of_key("draws")
        self._add_finding(
            "inputs", line, f"turn {turn}", "draws", uniforms.tolist(), seed_uniforms.tolist()
        )

    def _report_wrong_seed(self) -> None:
        """Replace the findings on inputs by one on the seed, because all uniforms differ."""
        findings = self.report.findings
        findings[:] = [finding for finding in findings if finding.level != "inputs"]
        entry = self.transcript.header_block.entries["seed"]
        self._add_finding(
            "inputs",
            entry.line,
            "every turn",
            "seed",
            "the seed that produces these draws",
            entry.value,
        )

    def _compare_end(self, session: Session) -> None:
        """Compare the end line, or report that there is none."""
        transcript = self.transcript
        end = transcript.end_block
        if end is None:
            explanation = "the last turn is incomplete" if transcript.torn_tail else "no end line"
            line = transcript.content.count("\n") + 1
            location = f"turn {len(session.turns)}"
            self._add_finding("unfinished", line, location, f"unfinished: {explanation}")
            return
        entry = end.entries["end"]
        recorded = entry.value if isinstance(entry.value, dict) else {}
        if transcript.player_end_reason:
            session.end(transcript.player_end_reason)
        for key, got in collect_end_facts(session).items():
            if not _is_close(recorded.get(key), got):
                self._add_finding("facts", entry.line, "end", key, recorded.get(key), got)
            elif got is None:  # neither the file nor the replay has an end reason
                self._add_finding(
                    "facts", entry.line, "end", f"no {key}, because the game is not over"
                )
        if recorded.keys() - collect_end_facts(session).keys() != {"sha256"}:
            self._add_finding(
                "facts",
                entry.line,
                "end",
                "keys",
                sorted(recorded),
                sorted([*collect_end_facts(session), "sha256"]),
            )
        if self.report.is_ok:
            self._compare_checksum(end, session)

    def _compare_checksum(self, end: Block, session: Session) -> None:
        """Report the first line that differs from the rewriting, though all facts are right."""
        content = self.transcript.content
        recorded = content[self.matched_chars :] + self.transcript.end_text
        rewritten_text = self.first_mismatch or rewrite_end(
            end, session, shorten_digest(self.rewritten_digest)
        )
        if recorded == rewritten_text:
            return
        rows = zip_longest(recorded.split("\n"), rewritten_text.split("\n"))
        first_line = content.count("\n", 0, self.matched_chars) + 1
        line, (row, rewritten_row) = next(
            item for item in enumerate(rows, first_line) if item[1][0] != item[1][1]
        )
        self._add_finding(
            "checksum", line, "line", "text", row or "nothing", rewritten_row or "nothing"
        )


def _is_close(recorded: object, replayed: object) -> bool:
    """Return whether two facts are equal: reals within the tolerance, all others exactly."""
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
