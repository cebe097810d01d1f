"""Files of state that are torn or changed: whatever they contain must not be lost."""

import contextlib
import io
import json
import os
import re
import traceback
from datetime import date
from functools import cache
from random import Random

import pytest

from dmplay.core.state_files import StateFile, warn_once
from dmplay.game import player_records
from dmplay.tutor import progress
from dmplay.tutor.lesson_list import LessonOutline, list_builtin_outlines
from dmplay.tutor.progress import PASSED, StepRecord, load_progress, save_step
from dmplay.tutor.spaced_repetition import load_question_progress, save_first_answer
from tests.fuzz.case import Case, CaseOutcome
from tests.fuzz.program import enter_case_folder

PROGRESS_NAME, RECORDS_NAME = "dmplay/lessons.json", "dmplay/records.json"
STEP = {"result": "passed", "tries": 2, "hints": 0}
PROGRESS = {
    "dmplay": 1,
    "lessons": {"bayes-at-the-cradle": {"steps": [STEP, None, STEP, None], "date": "2026-11-28"}},
    "steps": {"0123456789abcdef": {**STEP, "date": "2026-11-28"}},
    "questions": {
        "puzzle hexworld:2": {"right": 1, "due": "2026-11-28"},
        "puzzle catch:7": {"right": 3, "due": ""},
    },
}
RESULT = {"return": -2.5, "turns": 10, "seed": 7, "day": "2026-11-28"}
RECORD = {"problem": "catch", "parameters": {}, "turns": None, "seat": "agent", "last": RESULT}
RECORDS = {
    "dmplay": 1,
    "records": [{**RECORD, "best": RESULT}, {**RECORD, "turns": 3, "best": None}],
}
VALUES = (
    "null", "true", "-10", "4", "1e400", "NaN", "9" * 30, "9" * 5000, '""', '"\\u0000"', "[]", "{}",
    '"\\ud800"', '"a\\nb"', "[" * 2000, "2", "1.0",
)  # fmt: skip
VALUE_PATTERN = re.compile(rb'(?<=: )("[^"]*"|-?[\d.]+|null|\{\}|\[\])')


@cache
def find_lesson() -> LessonOutline:
    """Return the lesson of which an older version wrote the progress."""
    return next(it for it in list_builtin_outlines() if it.name == "bayes-at-the-cradle")


def draw_state_case(random: Random) -> Case:
    """Draw a file of state that is torn at any byte, changed, or of a later version."""
    name, content = random.choice(((PROGRESS_NAME, PROGRESS), (RECORDS_NAME, RECORDS)))
    raw = json.dumps(content, indent=random.choice((None, 1))).encode()
    position = random.randrange(len(raw))
    match random.randrange(6):
        case 0:
            raw = raw[:position]
        case 1:
            raw = (
                raw[:position] + random.choice((b"\0", b"\xff", b"}", b'"', b"9")) + raw[position:]
            )
        case 2:
            raw = raw[:position] + bytes([random.randrange(256)]) + raw[position + 1 :]
        case 3:
            raw = raw + random.choice((b"x", b"\0", raw))
        case 4:
            raw = raw.replace(b'"dmplay": 1', b'"dmplay": ' + random.choice(VALUES).encode())
        case _:
            matches = [*VALUE_PATTERN.finditer(raw)]
            match = random.choice(matches)
            raw = raw[: match.start()] + random.choice(VALUES).encode() + raw[match.end() :]
    return Case((name,), {name: raw})


def run_state_case(case: Case) -> CaseOutcome:
    """Read and change a file of state; report it as lost if its contents are nowhere any more."""
    [name] = case.words
    raw, errors = case.files[name], io.StringIO()
    warn_once.cache_clear()
    with enter_case_folder(case), pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_STATE_HOME", os.getcwd())
        try:
            with contextlib.redirect_stderr(errors):
                _use_files()
        except Exception as error:
            return CaseOutcome(type(error).__name__, trace=traceback.format_exc())
        file = progress.PROGRESS_FILE if name == PROGRESS_NAME else player_records.RECORDS_FILE
        is_kept = any(path.read_bytes() == raw for path in file.path.parent.iterdir())
        lost = "" if is_kept else _find_lost_entry(raw, file)
    return CaseOutcome(lost or "refused", errors.getvalue())


def _use_files() -> None:
    """Read and change both files as lessons, puzzles and games do."""
    lesson = find_lesson()
    load_progress(lesson)
    load_question_progress()
    save_first_answer("puzzle hexworld:2", is_right=True, today=date(2026, 11, 28))
    save_step(lesson, 3, StepRecord(PASSED, 1, 0))
    player_records.load_records()
    player_records.save_record(
        player_records.ProblemRecord(
            "catch", {}, 5, "agent", player_records.GameResult(1.0, 5, 1, "2026-11-29")
        )
    )


def _find_lost_entry(raw: bytes, file: StateFile) -> str:
    """Return the first entry of a changed file that it does not contain any more, '' if none."""
    text = file.path.read_text()
    content, old_content = json.loads(text), json.loads(raw)
    if lost_sections := old_content.keys() - content.keys():
        return f"lost {sorted(lost_sections)}"
    if file.name == "records.json":
        last_results = [entry["last"] for entry in content["records"]]
        old = [entry["last"] for entry in old_content.get("records", [])]
        return next((f"lost {entry}" for entry in old if entry not in last_results), "")
    for section in ("steps", "questions"):
        for key in old_content.get(section, {}):
            if key not in content.get(section, {}):
                return f"lost {section} {key}"
    old_count = sum(
        step is not None
        for entry in old_content.get("lessons", {}).values()
        for step in entry["steps"]
    )
    is_complete = len(content["steps"]) + len(content.get("lessons", {})) > old_count
    return "" if is_complete else "lost steps"
