"""Tests of the lesson files of teachers: good ones, and one clear line for each fault."""

from pathlib import Path

import pytest

from dmplay.errors import BadFile, BadParameter, DmplayError
from dmplay.guide.topics import read_topic
from dmplay.tutor.lesson_file_reader import read_lesson
from dmplay.tutor.lesson_list import find_lesson, load_lessons
from dmplay.tutor.lesson_run import LessonRun
from tests.fuzz.lesson_quantities import list_quantities
from tests.support.document_examples import extract_file
from tests.support.programs import run_dmplay

LESSON = """\
title = "Cries"
[position]
problem = "crying-baby"
turns = 10

[[steps]]
text = "The baby cries. Is it hungry?"
hint = "Use Bayes' rule."
learned = "A cry is a clue."
[steps.predict]
quantity = "belief"
state = "hungry"
history = ["ignore crying"]
tolerance = 0.01
"""
PLAY_STEP = """
[[steps]]
text = "Play."
hint = "Feed."
learned = "Good."
[steps.play]
goal = "ten turns"
regret_at_most = 2
"""


def write_lesson(folder: Path, text: str, name: str = "01-cries.toml") -> Path:
    """Write a lesson file and return its path."""
    path = folder / name
    path.write_text(text)
    return path


def test_a_teachers_lesson_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    lesson = read_lesson(write_lesson(tmp_path, LESSON + PLAY_STEP), 1)
    run = LessonRun(lesson)
    assert run.check_answer("0.907").finishes_step
    assert run.expected_answer == "ten turns"


def test_the_lesson_of_the_guide_is_valid(tmp_path: Path) -> None:
    path = write_lesson(tmp_path, extract_file(read_topic("lessons"), "01-cries.toml"))
    assert read_lesson(path, 1).steps


def test_the_guide_names_every_quantity() -> None:
    page = read_topic("lessons")
    missing = [name for name in list_quantities() if f"`{name}`" not in page]
    assert not missing


def test_every_quantity_has_a_description() -> None:
    functions = [quantity.compute for quantity in list_quantities().values()]
    assert all((function.__doc__ or "").startswith("Return ") for function in functions)


def test_lessons_of_a_folder_are_numbered_by_their_file_names(tmp_path: Path) -> None:
    for name in ("03-cries.toml", "bayes.toml", "11-more-cries.toml"):
        write_lesson(tmp_path, LESSON, name)
    lessons = load_lessons(str(tmp_path))
    assert [(lesson.number, lesson.name) for lesson in lessons.lessons] == [
        (3, "cries"),
        (11, "more-cries"),
        (3, "bayes"),
    ]
    assert find_lesson(lessons, "11").name == "more-cries"
    with pytest.raises(LookupError, match="unknown lesson 'cry'; did you mean cries"):
        find_lesson(lessons, "cry")


def test_a_problem_file_is_found_beside_the_lesson(tmp_path: Path) -> None:
    (tmp_path / "tiger.py").write_text(extract_file(read_topic("problems"), "tiger.py"))
    text = LESSON.replace('"crying-baby"', '"./tiger.py"').replace("turns = 10\n", "")
    lesson = read_lesson(write_lesson(tmp_path, text), 1)
    with pytest.raises(ValueError, match="is code outside dmplay; if you trust it, add --trust"):
        _ = LessonRun(lesson).position
    assert LessonRun(lesson, trusted=True).position.problem.partially_observable


TIGER_QUANTITY = """
from dmplay.tutor.quantity import Quantity
from dmplay.tutor.truth import Truth

def growl_odds(position, growls: int):
    return Truth(3.0 ** growls, lambda answer: "each growl multiplies the odds")

QUANTITIES = {"growl-odds": Quantity(growl_odds, {"growls": (0, 4)})}
"""


def write_tiger_lesson(folder: Path, arguments: str, code: str = TIGER_QUANTITY) -> Path:
    """Write a problem with a quantity of its own, and a lesson that asks for it."""
    (folder / "tiger.py").write_text(extract_file(read_topic("problems"), "tiger.py") + code)
    start, _, _ = LESSON.partition("quantity =")
    text = start.replace('"crying-baby"', '"tiger.py"').replace("turns = 10\n", "")
    return write_lesson(folder, text + arguments)


def test_a_lesson_asks_for_a_quantity_of_a_problem_of_the_user(tmp_path: Path) -> None:
    path = write_tiger_lesson(tmp_path, 'quantity = "growl-odds"\ngrowls = 2\n')
    with pytest.raises(ValueError, match="is code outside dmplay; if you trust it, add --trust"):
        LessonRun(read_lesson(path, 1)).check_answer("9")
    lesson = read_lesson(path, 1, trusted=True)
    (wrong, *_) = LessonRun(lesson, trusted=True).check_answer("3").lines
    assert wrong == "not yet. 3 is too low. Each growl multiplies the odds."
    assert LessonRun(lesson, trusted=True).check_answer("9").finishes_step


def test_a_quantity_of_a_user_can_be_about_a_position_that_the_lesson_describes(
    tmp_path: Path,
) -> None:
    code = (
        "from dmplay.game.position import Position\n"
        "from dmplay.tutor.quantity import Quantity\n"
        "from dmplay.tutor.truth import Truth\n"
        "def doubt(position: Position) -> Truth:\n"
        "    return Truth(1.0 - max(position.view.belief))\n"
        'QUANTITIES = {"doubt": Quantity(doubt)}\n'
    )
    question = 'quantity = "doubt"\nbelief = "0.3 0.7"\n'
    lesson = read_lesson(write_tiger_lesson(tmp_path, question, code), 1, trusted=True)
    assert LessonRun(lesson, trusted=True).check_answer("0.3").finishes_step


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ('quantity = "growl-ods"\ngrowls = 2', "unknown quantity 'growl-ods'; did you mean growl-"),
        ('quantity = "growl-odds"\ngrowls = 5', "predict.growls: got 5, expected 0 to 4"),
        ('quantity = "growl-odds"\ngrowls = "x"', "predict.growls: got 'x', expected a whole numb"),
        ('quantity = "growl-odds"', "predict.growls: missing, expected an argument of the quanti"),
        (
            'quantity = "noise-cost"\nturns_left = 3',
            "tiger.py does not fit the quantity noise-cost, expected the problem simple-regulator",
        ),
    ],
)
def test_a_faulty_question_for_a_quantity_of_a_problem_is_refused(
    arguments: str, message: str, tmp_path: Path
) -> None:
    path = write_tiger_lesson(tmp_path, arguments)
    with pytest.raises(BadParameter) as error:
        read_lesson(path, 1, trusted=True)
    assert str(error.value).startswith(f"{path}: steps[1].predict")
    assert message in str(error.value)


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("QUANTITIES = 3", "QUANTITIES: got 3, expected a mapping of names to Quantity"),
        ("QUANTITIES = {'growl-odds': 3}", "QUANTITIES: growl-odds: got 3, expected a Quantity"),
        (
            TIGER_QUANTITY.replace("growl-odds", "belief"),
            "QUANTITIES: belief: expected a name that no general quantity has",
        ),
    ],
)
def test_invalid_quantities_of_a_problem_are_refused(
    code: str, message: str, tmp_path: Path
) -> None:
    path = write_tiger_lesson(tmp_path, 'quantity = "growl-odds"\ngrowls = 2\n', code)
    with pytest.raises(BadParameter, match=message):
        read_lesson(path, 1, trusted=True)


def test_a_quantity_that_returns_no_truth_is_refused(tmp_path: Path) -> None:
    code = TIGER_QUANTITY.replace("Truth(3.0 ** growls", "(growls")
    path = write_tiger_lesson(tmp_path, 'quantity = "growl-odds"\ngrowls = 2\n', code)
    run = LessonRun(read_lesson(path, 1, trusted=True), trusted=True)
    with pytest.raises(BadParameter, match=r"growl-odds: got \(2, .*, expected a Truth"):
        run.check_answer("9")


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('title = "Cries"', "title = 5", "title: got 5, expected a text"),
        ('title = "Cries"\n', "", "title: missing, expected a text"),
        ('title = "Cries"', 'titel = "Cries"', "title: missing, expected a text; got the key"),
        ('title =', 'titel = 1\ntitle =', "unknown key 'titel'; did you mean title"),
        ("turns = 10", "turns = 0", "steps[1].position.turns: got 0, expected 1 to 10000"),
        ("turns = 10", "turns = true", "turns: got True, expected a whole number, 1 or more"),
        ('problem = "crying-baby"\n', "", "steps[1].position.problem: missing"),
        ('hint = "Use Bayes\' rule."\n', "", "steps[1].hint: missing, expected a text"),
        ('text = "The', 'texts = "The', "steps[1].text: missing, expected a text"),
        ('"belief"', '"belif"', "predict: unknown quantity 'belif'; did you mean belief"),
        ('state = "hungry"\n', "", "state: missing, expected an argument of the quantity"),
        ("tolerance = 0.01", "watch_first = true", "watch_first: expected watch too"),
        ("tolerance = 0.01", 'watch = "sweeps"', "predict: unknown algorithm 'sweeps'"),
        ("tolerance = 0.01", 'tolerance = "x"', "predict.tolerance: got 'x', expected a number"),
        ("tolerance = 0.01", "tolerence = 0.01", "unknown key 'tolerence'; did you mean tolerance"),
        ("tolerance = 0.01", 'asks = "stat"', "asks: unknown parameter 'stat'; did you mean state"),
        ('state = "hungry"', 'asks = "state"', "asks: expected at_least or at_most too"),
        ('["ignore crying"]', '"ignore"', "history: got 'ignore', expected a list of texts"),
        ("[steps.predict]", "[steps.guess]", "expected one of the tables predict and play"),
        ("[[steps]]", "[steps]", "steps: got {'text': "),
        ("is it hungry?", "?" * 90, "text: line 1: got"),
        ('"A cry is a clue."', f'"{"a" * 161}"', "learned: got 161 characters, expected 1 to 160"),
    ],
)  # fmt: skip
def test_a_faulty_lesson_gets_one_clear_line(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    text = LESSON.replace("Is it hungry?", "is it hungry?")
    assert old in text
    path = write_lesson(tmp_path, text.replace(old, new))
    with pytest.raises(DmplayError) as error:
        read_lesson(path, 1)
    assert str(error.value).startswith(f"{path}: ")
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_a_step_needs_a_condition(tmp_path: Path) -> None:
    text = LESSON + PLAY_STEP.replace("regret_at_most = 2\n", "")
    with pytest.raises(ValueError, match=r"steps\[2\].play: expected a condition, such as ends"):
        read_lesson(write_lesson(tmp_path, text), 1)


def test_a_return_of_zero_is_a_condition(tmp_path: Path) -> None:
    text = LESSON + PLAY_STEP.replace("regret_at_most = 2", "return_at_least = 0")
    assert len(read_lesson(write_lesson(tmp_path, text), 1).steps) == 2


def test_a_file_that_is_not_toml_names_line_and_column(tmp_path: Path) -> None:
    path = write_lesson(tmp_path, 'title = "Cries\n')
    with pytest.raises(BadFile, match=rf"{path}:1:15: "):
        read_lesson(path, 1)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("title", f"{'.'.join(['a'] * 30_000)} = 1\ntitle", r"line 1: got 29999 dots"),
        (
            "turns = 10",
            f"seed = 0x{'f' * 20_000}",
            r"position: seed: got an integer of more than 64",
        ),
        (
            "[position]",
            f"minutes = 0b{'1' * 20_000}\n[position]",
            r"minutes: got an integer of more than 64",
        ),
        (
            "[position]",
            f"minutes = 0o{'7' * 9_000}\n[position]",
            r"minutes: got an integer of more than 64",
        ),
        ("[position]", f"minutes = {'9' * 9_000}\n[position]", r"got an integer of more than 64"),
        ("[position]", f"minutes = {'[' * 9_000}\n[position]", r"nested too deeply"),
    ],
)
def test_keys_numbers_and_arrays_of_any_size_are_refused_soon(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    with pytest.raises(BadParameter, match=message):
        read_lesson(write_lesson(tmp_path, LESSON.replace(old, new, 1)), 1)


def test_arguments_beyond_their_bounds_are_refused_with_their_place(tmp_path: Path) -> None:
    text = LESSON.replace('history = ["ignore crying"]', f"history = {['ignore crying'] * 101}")
    message = r"steps\[1\]\.predict\.history: got 101 texts, expected at most 100"
    with pytest.raises(BadParameter, match=message):
        read_lesson(write_lesson(tmp_path, text), 1)


def test_files_that_cannot_be_read_are_named(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match=r"absent\.toml: No such file or directory"):
        read_lesson(tmp_path / "absent.toml", 1)
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(ValueError, match=r"binary.toml: not UTF-8"):
        read_lesson(tmp_path / "binary.toml", 1)
    with pytest.raises(ValueError, match=r"expected lessons, files that end with .toml"):
        load_lessons(str(tmp_path / "empty"))


def test_one_bad_file_does_not_hide_the_other_lessons(tmp_path: Path) -> None:
    write_lesson(tmp_path, LESSON)
    bad_path = write_lesson(tmp_path, 'title = "Cries\n', "02-bad\nlesson.toml")
    lessons = load_lessons(str(tmp_path))
    assert [lesson.number for lesson in lessons.lessons] == [1]
    with pytest.raises(BadFile):
        find_lesson(lessons, "2")
    for arguments in ([], ["--json"]):
        run = run_dmplay(tmp_path, "learn", "./", *arguments)
        assert "Cries" in run.stdout
        [error] = run.stderr.splitlines()
        assert error.startswith("error: ")
        assert "02-bad\\nlesson.toml:1:15: " in error
        assert run.returncode == 2
    bad_path.unlink()
    assert run_dmplay(tmp_path, "learn", "./").returncode == 0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"Cries"', '"Cries\\n  2  Forged  1/1"', r"title: got the character '\\n'"),
        ('"Cries"', '"Cries\\u001b[2J"', r"title: got the character '\\x1b'"),
        ('"Cries"', '"' + "C" * 30_000 + '"', "title: got 30000 columns, expected at most 60"),
        ("[position]", 'chapter = "a\\nb"\n[position]', "chapter: got the character"),
        ('state = "hungry"', 'state = "hun\\ngry"', "state: got the character"),
        ('"ignore crying"', '"ignore crying\\r"', None),
        ('"ignore crying"', '"ignore\\u0085crying"', "history: got the character"),
        ("A cry is a clue.", "A cry\\u0007 is a clue.", "learned: got the character"),
        ("A cry is a clue.", "A cry is\\na clue.", None),
        ("tolerance = 0.01", '"tol\\nerance" = 0.01', "predict: got the character"),
        ("tolerance = 0.01", "tolerance = inf", "tolerance: got inf, expected a finite number"),
        ("tolerance = 0.01", f'result = "{"r" * 161}"', "result: got 161 columns"),
        ("turns = 10", "turns = 1000000000", "turns: got 1000000000, expected 1 to 10000"),
        ("turns = 10", f"after = {['feed'] * 1001}", "after: got 1001 texts"),
        (
            'history = ["ignore crying"]',
            "history = 7",
            r"history: got 7, expected a list of texts, for example history = \[.feed crying.\]",
        ),
        (
            'quantity = "belief"\nstate = "hungry"\nhistory = ["ignore crying"]',
            'quantity = "belief-value"\naction = "feed"\nturns_left = 2\nbelief = [0.5, 0.5]',
            r"belief: got \[0.5, 0.5\], expected a text, for example belief = .hungry 0.3 sated",
        ),
    ],
)
def test_texts_are_short_lines_without_control_characters(
    tmp_path: Path, old: str, new: str, message: str | None
) -> None:
    assert old in LESSON
    path = write_lesson(tmp_path, LESSON.replace(old, new))
    if message is None:
        assert read_lesson(path, 1).steps
        return
    with pytest.raises(DmplayError, match=message) as error:
        read_lesson(path, 1)
    assert str(error.value).isprintable()


@pytest.mark.parametrize("kind", ["script", "replay"])
def test_an_agent_that_reads_a_file_needs_trust(tmp_path: Path, kind: str) -> None:
    (tmp_path / "secret").write_text("word")
    seated = LESSON.replace('"crying-baby"', '"multicaregiver-crying-baby"')
    agent = f"{kind}:{tmp_path / 'secret'}"
    seated = seated.replace("turns = 10", f'seats = {{ caregiver2 = "{agent}" }}')
    with pytest.raises(ValueError, match="reads a file; if you trust it, add --trust") as error:
        _ = LessonRun(read_lesson(write_lesson(tmp_path, seated), 1)).position
    assert "word" not in str(error.value)


@pytest.mark.parametrize("agent", ["./spy.py:Spy", "bot:touch spied"])
def test_an_agent_outside_dmplay_needs_trust(tmp_path: Path, agent: str) -> None:
    play_step = PLAY_STEP.replace("regret_at_most = 2", f'beats = "{agent}"')
    run = LessonRun(read_lesson(write_lesson(tmp_path, LESSON + play_step), 1), 1)
    session = run.position.session
    for _ in range(10):
        session.advance([0])
    with pytest.raises(ValueError, match="is code outside dmplay; if you trust it, add --trust"):
        run.check_game(session)
    seated = LESSON.replace('"crying-baby"', '"multicaregiver-crying-baby"')
    seated = seated.replace("turns = 10", f'seats = {{ caregiver2 = "{agent}" }}')
    with pytest.raises(ValueError, match="is code outside dmplay; if you trust it, add --trust"):
        _ = LessonRun(read_lesson(write_lesson(tmp_path, seated), 1)).position


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('"crying-baby"', '"crying-bab"', "unknown problem 'crying-bab'; did you mean crying-baby"),
        ('"ignore crying"', '"ignore smiling"', "smiling"),
        ('"ignore crying"', '"crying"', "expected an action and an observation"),
        ('"hungry"', '"hungri"', "unknown answer 'hungri'; did you mean hungry"),
        ("turns = 10", 'seats = { nurse = "random" }', "unknown seat 'nurse'"),
        ("turns = 10", 'after = ["dance"]', "unknown action 'dance'"),
        ("turns = 10", "parameters = { hunger = 1 }", "unknown parameter 'hunger'"),
    ],
)
def test_faults_that_only_the_problem_shows_name_the_step(
    tmp_path: Path, old: str, new: str, message: str
) -> None:
    lesson = read_lesson(write_lesson(tmp_path, LESSON.replace(old, new)), 1)
    with pytest.raises(DmplayError) as error:
        LessonRun(lesson).check_answer("0.5")
    assert str(error.value).startswith(f"{lesson.path}: steps[1]: ")
    assert message in str(error.value)
