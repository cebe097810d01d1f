"""A program that does not keep the protocol: `abuser.py KIND FILE`, its number in the file."""

import json
import os
import signal
import sys
import time
from collections.abc import Callable

ACTION = "50"


def say(**facts: object) -> None:
    print(json.dumps(facts), flush=True)


def answer(**more: object) -> None:
    """Answers the next question; hears `turn` too, and does not mind."""
    said = {"type": ""}
    while said["type"] != "act":
        said = json.loads(sys.stdin.readline())
    say(**{"type": "act", "id": said["id"], "action": ACTION, **more})


def fork() -> None:
    if os.fork():
        os._exit(0)
    time.sleep(60)


def late() -> None:
    sys.stdin.readline()
    time.sleep(0.25)
    answer()


def garbled() -> None:
    print("ne", flush=True)
    time.sleep(60)


def ahead() -> None:
    for number in range(1, 1000):
        say(type="act", id=number, action=ACTION)
    time.sleep(60)


def ever(text: str) -> None:
    while True:
        sys.stdout.write(text)


def ended(code: int) -> None:
    answer()
    print("no more\x1b[2J of\nthis", file=sys.stderr)
    sys.exit(code)


ABUSES: dict[str, Callable[[], object]] = {
    "silent": lambda: time.sleep(60),
    "deaf": ahead,
    "dead": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "late": late,
    "garbled": garbled,
    "illegal": lambda: answer(action="101"),
    "flooding": lambda: ever('{"type": "chatter"}\n'),
    "forking": fork,
    "endless line": lambda: ever("x" * 1000),
    "wrong id": lambda: answer(id=77),
    "wrong version": lambda: None,
    "exits early": lambda: ended(3),
}

if __name__ == "__main__":
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        print(os.getpid(), file=file)
    say(type="hello", protocol=2 if sys.argv[1] == "wrong version" else 1)
    ABUSES[sys.argv[1]]()
