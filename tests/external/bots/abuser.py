"""A program that violates the protocol: `abuser.py KIND FILE`; it writes its process id to the
file.
"""

import json
import os
import signal
import sys
import time
from collections.abc import Callable

ACTION = "50"


def send_message(**fields: object) -> None:
    print(json.dumps(fields), flush=True)


def answer_request(**changes: object) -> None:
    """Answer the next request; ignore `turn` messages."""
    message = {"type": ""}
    while message["type"] != "act":
        message = json.loads(sys.stdin.readline())
    send_message(**{"type": "act", "id": message["id"], "action": ACTION, **changes})


def fork_and_exit() -> None:
    if os.fork():
        os._exit(0)
    time.sleep(60)


def answer_late() -> None:
    sys.stdin.readline()
    time.sleep(0.25)
    answer_request()


def send_invalid_json() -> None:
    print("ne", flush=True)
    time.sleep(60)


def send_answers_without_reading() -> None:
    for number in range(1, 1000):
        send_message(type="act", id=number, action=ACTION)
    time.sleep(60)


def write_forever(text: str) -> None:
    while True:
        sys.stdout.write(text)


def write_error_and_exit(code: int) -> None:
    answer_request()
    print("no more\x1b[2J of\nthis", file=sys.stderr)
    sys.exit(code)


ABUSES: dict[str, Callable[[], object]] = {
    "silent": lambda: time.sleep(60),
    "deaf": send_answers_without_reading,
    "dead": lambda: os.kill(os.getpid(), signal.SIGKILL),
    "late": answer_late,
    "garbled": send_invalid_json,
    "illegal": lambda: answer_request(action="101"),
    "flooding": lambda: write_forever('{"type": "chatter"}\n'),
    "forking": fork_and_exit,
    "endless line": lambda: write_forever("x" * 1000),
    "wrong id": lambda: answer_request(id=77),
    "wrong version": lambda: None,
    "exits early": lambda: write_error_and_exit(3),
}

if __name__ == "__main__":
    with open(sys.argv[2], "w", encoding="utf-8") as file:
        print(os.getpid(), file=file)
    send_message(type="hello", protocol=2 if sys.argv[1] == "wrong version" else 1)
    ABUSES[sys.argv[1]]()
