"""A page in headless Chromium, driven over pipes by the Chrome DevTools Protocol."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from types import TracebackType
from typing import Any

import pytest

BROWSER_PATH = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
needs_browser = pytest.mark.skipif(not BROWSER_PATH, reason="needs the program chromium")
# Chromium reads commands from descriptor 3 and writes answers to descriptor 4.
LAUNCH_SCRIPT = """
import os, sys
os.dup2(int(sys.argv[1]), 3)
os.dup2(int(sys.argv[2]), 4)
os.execv(sys.argv[3], sys.argv[3:])
"""
KEY_CODES = {
    "Tab": 9, "Enter": 13, " ": 32, "End": 35, "Home": 36, "ArrowLeft": 37, "ArrowRight": 39,
}  # fmt: skip
KEY_TEXTS = {"Enter": "\r", " ": " "}


class BrowserPage:
    """A page of Chromium that runs scripts and receives the same key events as from a keyboard."""

    def __init__(self, profile_folder: Path) -> None:
        assert BROWSER_PATH
        command_pipe, self._commands = os.pipe()
        answers, answer_pipe = os.pipe()
        self._answers = os.fdopen(answers, "rb")
        with ExitStack() as pipes:
            for descriptor in (command_pipe, answer_pipe):
                pipes.callback(os.close, descriptor)
            self._process = subprocess.Popen(
                [sys.executable, "-c", LAUNCH_SCRIPT, str(command_pipe), str(answer_pipe),
                 BROWSER_PATH, "--headless", "--no-sandbox", "--disable-gpu",
                 "--remote-debugging-pipe", f"--user-data-dir={profile_folder}"],
                pass_fds=(command_pipe, answer_pipe), stderr=subprocess.DEVNULL,
            )  # fmt: skip
        self._command_count, self._session_id = 0, ""
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self._session_id = attached["sessionId"]

    def __enter__(self) -> "BrowserPage":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        os.close(self._commands)  # Chromium ends when nobody can send commands any more.
        self._process.wait(timeout=60)
        self._answers.close()

    def call(self, method: str, **parameters: object) -> Mapping[str, Any]:
        """Call a method of the protocol and return its result."""
        self._command_count += 1
        session = {"sessionId": self._session_id} if self._session_id else {}
        command = {"id": self._command_count, "method": method, "params": parameters, **session}
        os.write(self._commands, json.dumps(command).encode() + b"\0")
        while True:
            answer = json.loads(self._read_message())
            if answer.get("id") == self._command_count:
                assert "error" not in answer, answer["error"]
                return dict(answer["result"])

    def _read_message(self) -> bytes:
        """Return the next message of the browser, which ends with a zero byte."""
        message = bytearray()
        while (byte := self._answers.read(1)) != b"\0":
            assert byte, "the browser has ended"
            message += byte
        return bytes(message)

    def load(self, html: str, *, is_dark: bool = False, width: int = 1000) -> None:
        """Show a page in a window of this width, with a dark or light colour scheme."""
        scheme = {"name": "prefers-color-scheme", "value": "dark" if is_dark else "light"}
        self.call("Emulation.setEmulatedMedia", features=[scheme])
        self.call(
            "Emulation.setDeviceMetricsOverride",
            width=width, height=800, deviceScaleFactor=1, mobile=False,
        )  # fmt: skip
        self.call("Page.navigate", url="about:blank")
        frame = self.call("Page.getFrameTree")["frameTree"]["frame"]["id"]
        self.call("Page.setDocumentContent", frameId=frame, html=html)

    def evaluate(self, script: str) -> Any:
        """Return the value of a JavaScript expression, awaited if it is a promise."""
        answer = self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer["exceptionDetails"]
        return answer["result"].get("value")

    def press(self, *keys: str) -> None:
        """Press and release keys, named as in JavaScript."""
        for key in keys:
            facts = {"key": key, "code": "Space" if key == " " else key,
                     "windowsVirtualKeyCode": KEY_CODES[key]}  # fmt: skip
            text = {"text": KEY_TEXTS[key]} if key in KEY_TEXTS else {}
            self.call("Input.dispatchKeyEvent", type="keyDown", **facts, **text)
            self.call("Input.dispatchKeyEvent", type="keyUp", **facts)
