"""A headless Chromium, controlled by the DevTools protocol."""

from __future__ import annotations

import base64
import json
import re
import subprocess
import tempfile
from typing import TYPE_CHECKING, Any

from websockets.sync.client import connect

if TYPE_CHECKING:
    from pathlib import Path


class Browser:
    """One page of a browser; `with` closes it."""

    def __init__(self, program: str, address: str, *, width: int = 1300, height: int = 900) -> None:
        self.profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        options = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--hide-scrollbars",
            "--remote-debugging-port=0",
            f"--user-data-dir={self.profile.name}",
            f"--window-size={width},{height}",
        ]
        self.process = subprocess.Popen(
            [program, *options, "about:blank"], stderr=subprocess.PIPE, text=True
        )
        assert self.process.stderr is not None
        found = next(
            found for line in self.process.stderr if (found := re.search(r"ws://\S+", line))
        )
        self.socket = connect(found.group(), max_size=None)
        self.number = 0
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=target, flatten=True)
        self.session = attached["sessionId"]
        self.errors: list[str] = []
        self.call("Runtime.enable")
        self.call("Page.navigate", url=address)

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """Calls a method of the protocol."""
        self.number += 1
        message = {"id": self.number, "method": method, "params": parameters}
        if hasattr(self, "session"):
            message["sessionId"] = self.session
        self.socket.send(json.dumps(message))
        while True:
            answer = json.loads(self.socket.recv(timeout=30.0))
            if answer.get("method") == "Runtime.exceptionThrown":
                self.errors.append(answer["params"]["exceptionDetails"]["text"])
            if answer.get("id") == self.number:
                assert "error" not in answer, answer
                return dict(answer["result"])

    def evaluate(self, expression: str) -> Any:
        """Returns the value of a JavaScript expression; a promise is awaited."""
        answer = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait_for(self, expression: str, *, seconds: float = 10.0) -> None:
        """Waits until an expression is true."""
        look = f"if ({expression}) done(true); else if (Date.now() > end) done(false);"
        found = self.evaluate(
            f"new Promise(done => {{ const end = Date.now() + {1000 * seconds};"
            f" (function look() {{ {look} else setTimeout(look, 50); }})(); }})"
        )
        assert found, f"{expression}: not within {seconds} s: {self.text()}"

    def text(self) -> str:
        """Text of the page."""
        return str(self.evaluate("document.body.innerText"))

    def resize(self, width: int, height: int, *, look: str = "light") -> None:
        """Sets the size of the window, and the scheme ``light`` or ``dark``, or ``print``."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self.call("Emulation.setDeviceMetricsOverride", **metrics)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if look == "dark" else "light"}
        media = "print" if look == "print" else ""
        self.call("Emulation.setEmulatedMedia", media=media, features=[scheme])

    def picture(self, file: Path) -> None:
        """Writes a picture of the window."""
        answer = self.call("Page.captureScreenshot", format="png")
        file.write_bytes(base64.b64decode(answer["data"]))

    def close(self) -> None:
        """Closes the browser."""
        self.socket.close()
        self.process.terminate()
        self.process.communicate(timeout=10.0)
        self.profile.cleanup()

    def __enter__(self) -> Browser:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()
