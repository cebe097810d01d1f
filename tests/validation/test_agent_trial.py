"""`dmplay check --agent` finds illegal, unsteady and failing agents, and passes the others."""

import json
from pathlib import Path

import pytest

from dmplay.validation.agent_trial import AgentTrial, try_agent
from tests.support.programs import run_dmplay

AGENTS_SOURCE = """\
import os, random
import numpy as np
class Steady:
    uniform_count = 1
    def __init__(self, problem, seat):
        self.labels, self.calls = list(problem.actions[seat]), 0
    def initial_memory(self, observation):
        return (np.zeros(len(observation), int),)
    def update_memory(self, memory, percept):
        return (memory[0] + 1,)
    def choose(self, memory, legal, u):
        return (2 * u[:, 0]).astype(int)
class Illegal(Steady):
    def choose(self, memory, legal, u): return np.where(memory[0] > 2, 9, 0)
class Nan(Steady):
    def choose(self, memory, legal, u): return np.full(len(u), np.nan)
class Word(Steady):
    def choose(self, memory, legal, u): return "feed"
class GlobalNumPy(Steady):
    def choose(self, memory, legal, u): return np.random.randint(0, 2, len(u))
class GlobalRandom(Steady):
    def __init__(self, problem, seat): self.plan = [random.randrange(2) for _ in range(50)]
    def choose(self, memory, legal, u): return np.array(self.plan)[memory[0]]
class Hash(Steady):
    def choose(self, memory, legal, u): return np.full(len(u), hash(self.labels[0]) % 2)
class SetOrder(Steady):
    def choose(self, memory, legal, u):
        return np.full(len(u), self.labels.index(next(iter(set(self.labels)))))
class Counter(Steady):
    def update_memory(self, memory, percept):
        self.calls += 1
        return memory
    def choose(self, memory, legal, u): return np.full(len(u), min(self.calls // 5, 1))
class Row(Steady):
    def choose(self, memory, legal, u): return np.arange(len(u)) % 2
class MeanMemory(Steady):
    def update_memory(self, memory, percept): return (memory[0] * 0 + int(percept.action.sum()),)
    def choose(self, memory, legal, u): return np.where(u[:, 0] < 0.5, 1, memory[0] % 2)
class Single(Steady):
    def choose(self, memory, legal, u): return [1 if memory[0] > 2 else 0]
class Mutating(Steady):
    def update_memory(self, memory, percept):
        memory[0][:] += 1
        return memory
class Raising(Steady):
    def update_memory(self, memory, percept): raise RuntimeError("two\\nlines")
class Exiting(Steady):
    def choose(self, memory, legal, u): raise SystemExit
class Arguments(Steady):
    def choose(self): pass
class Ragged(Steady):
    def choose(self, memory, legal, u): return [[0], [0, 1]]
class Dying(Steady):
    def choose(self, memory, legal, u):
        if os.environ.get("PYTHONHASHSEED") == "3": os._exit(1)
        return super().choose(memory, legal, u)
class Unmakeable(Steady):
    def __init__(self, problem, seat): problem.parse_action(seat, "nothing")
class Bare: pass
"""
OTHER_PROCESS, ALONE = "in another process; expected the same choice", "alone; expected the same"
FAULTS = {
    "Illegal": "episode 0, turn 4, agent1: got action 9, expected 0 to 1",
    "Nan": "episode 0, turn 1, agent1: got action nan, expected 0 to 1",
    "Word": "episodes 0 to 11, turn 1, agent1: Word chose 'feed', expected an array of 12 actions",
    "GlobalNumPy": OTHER_PROCESS,
    "GlobalRandom": OTHER_PROCESS,
    "Hash": OTHER_PROCESS,
    "SetOrder": OTHER_PROCESS,
    "Counter": ALONE,
    "Row": ALONE,
    "MeanMemory": ALONE,
    "Single": "episodes 0 to 11, turn 1, agent1: ValueError: The truth value",
    "Mutating": "turn 1, agent1: Mutating.update_memory modifies an array that it received",
    "Raising": "episodes 0 to 11, turn 1, agent1: RuntimeError: two",
    "Exiting": "SystemExit; user code must not exit the program",
    "Arguments": "turn 1, agent1: TypeError: Arguments.choose() takes 1 positional argument",
    "Ragged": "turn 1, agent1: ValueError: setting an array element with a sequence",
    "Dying": "the process in which the agent played has died",
    "Unmakeable": "unknown action 'nothing'",
    "Bare": "cannot construct a policy from (problem, seat)",
}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "own.py").write_text(AGENTS_SOURCE)
    (tmp_path / "raising.py").write_text("import math\nmath.nothing\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("name", FAULTS)
def test_the_first_fault_of_an_agent_is_found_and_located(name: str, folder: Path) -> None:
    violation = try_agent(AgentTrial("prisoners-dilemma", {}, f"./own.py:{name}", ""))
    assert violation
    assert FAULTS[name] in violation.what
    assert "\n" not in str(violation)
    if name != "Bare":
        _, line = violation.where.split(":")
        class_line = AGENTS_SOURCE[: AGENTS_SOURCE.index(f"class {name}(")].count("\n") + 1
        assert name == "Dying" or 0 < int(line) - class_line <= 4


@pytest.mark.parametrize(
    ("problem", "agent", "seat"),
    [
        ("hexworld", "./own.py:Steady", ""),
        ("prisoners-dilemma", "./own.py:Steady", "agent2"),
        ("multicaregiver-crying-baby", "feed-when-crying", "caregiver2"),
        ("simple-regulator", "random", ""),
        ("crying-baby", "optimal", "agent"),
    ],
)
def test_a_correct_agent_passes(problem: str, agent: str, seat: str, folder: Path) -> None:
    assert try_agent(AgentTrial(problem, {}, agent, seat)) is None


@pytest.mark.parametrize(
    ("words", "code", "message"),
    [
        (("--agent", "./own.py:Steady", "--seat", "agent2"), 0, "ok ./own.py:Steady: legal"),
        (("--agent", "./own.py:Illegal"), 1, "./own.py:14 seed 7, episode 0, turn 4, agent1: got"),
        (("--agent", "./raising.py:Any"), 1, "./raising.py:2 AttributeError: "),
        (("--agent", "./own.py:Staedy"), 2, "did you mean Steady"),
        (("--agent", "./nothing.py:Steady"), 2, "no such file: ./nothing.py"),
        (("--agent", "optimall"), 2, "unknown agent 'optimall'; "),
        (("--agent", "human"), 2, "agent: a person cannot be checked; name an agent"),
        (("--agent", "tit-for-tat", "--seat", "agnet2"), 2, "did you mean agent2 or agent1?"),
        (("--seat", "agent2"), 2, "--seat: expected --agent too"),
        ((), 0, "ok prisoners-dilemma: all invariants hold\n"),
    ],
)
def test_check_prints_one_line_and_its_exit_code_tells_a_fault_from_bad_input(
    words: tuple[str, ...], code: int, message: str, folder: Path
) -> None:
    result = run_dmplay(folder, "check", "prisoners-dilemma", *words)
    printed = result.stderr if code == 2 else result.stdout
    assert (result.returncode, message in printed, printed.count("\n")) == (code, True, 1)


def test_the_fault_of_an_agent_in_json(folder: Path) -> None:
    words = ("--agent", "./own.py:Illegal", "--seat", "agent2", "--json")
    result = run_dmplay(folder, "check", "prisoners-dilemma", *words)
    (fault,) = json.loads(result.stdout)["faults"]
    assert (result.returncode, fault["where"]) == (1, "./own.py:14")
    assert fault["what"].startswith("seed 7, episode 0, turn 4, agent2: got action 9")
