"""Chromium without a window, driven by its DevTools protocol over a pipe."""

import json
import os
import shutil
import subprocess

import pytest


class Chromium:
    """One page. `said`: the errors of its console."""

    def __init__(self, folder):
        program = shutil.which("chromium")
        if program is None:
            pytest.skip("no chromium on this machine (Debian: apt-get install chromium)")
        ours, theirs = os.pipe(), os.pipe()
        ends = {3: theirs[0], 4: ours[1]}  # where Chromium reads and writes

        def connect():
            high = {to: os.dup(end) for to, end in ends.items()}
            for to, end in high.items():
                os.dup2(end, to)

        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]
        self.process = subprocess.Popen(
            [program, *flags, f"--user-data-dir={folder}"], preexec_fn=connect, pass_fds=(3, 4),
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        for end in ends.values():
            os.close(end)
        self.to, self.answers = os.fdopen(theirs[1], "wb"), os.fdopen(ours[0], "rb")
        self.count, self.said, self.session, self.rest = 0, [], None, b""
        page = self.ask("Target.createTarget", url="about:blank")["targetId"]
        found = self.ask("Target.attachToTarget", targetId=page, flatten=True)
        self.session = found["sessionId"]
        for domain in ("Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.to.close()
        self.process.wait(30)
        self.answers.close()

    def ask(self, method, **parameters):
        """The result of a call of the protocol."""
        self.count += 1
        call = {"id": self.count, "method": method, "params": parameters}
        if self.session:
            call["sessionId"] = self.session
        self.to.write(json.dumps(call).encode() + b"\0")
        self.to.flush()
        while True:
            answer = self._answer()
            if answer.get("id") == self.count:
                assert "error" not in answer, answer
                return answer["result"]
            self._listen(answer)

    def _answer(self):
        while b"\0" not in self.rest:
            more = os.read(self.answers.fileno(), 1 << 20)
            assert more, "Chromium has ended"
            self.rest += more
        one, _, self.rest = self.rest.partition(b"\0")
        return json.loads(one)

    def _listen(self, event):
        what, told = event.get("method"), event.get("params", {})
        wrong = what == "Runtime.consoleAPICalled" and told["type"] in ("error", "assert")
        if wrong or what == "Runtime.exceptionThrown":
            self.said.append(json.dumps(told))
        if what == "Log.entryAdded" and told["entry"]["level"] == "error":
            self.said.append(told["entry"]["text"])

    def window(self, wide, high):
        """Size in pixels of the page, as of a phone."""
        self.ask("Emulation.setDeviceMetricsOverride", width=wide, height=high,
                 deviceScaleFactor=2, mobile=True)  # fmt: skip

    def run(self, script):
        """The value of a script in the page; a promise is waited for."""
        told = self.ask(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in told, told
        return told["result"].get("value")

    def wait(self, condition):
        """Until a condition in the page is true, a minute at most."""
        look = f"if ({condition}) done(true); else setTimeout(look, 20)"
        late = "setTimeout(() => done(false), 60000)"
        script = f"new Promise((done) => {{ const look = () => {{ {look} }}; look(); {late}; }})"
        assert self.run(script), f"never: {condition}; the console says {self.said}"

    def mouse(self, kind, x, y, button="left"):
        """`mousePressed`, `mouseMoved` or `mouseReleased` at a place of the window."""
        self.ask("Input.dispatchMouseEvent", type=kind, x=x, y=y, button=button, clickCount=1,
                 buttons={"left": 1, "right": 2}[button])  # fmt: skip

    def touch(self, kind, places):
        """`Start`, `Move` or `End`, with a finger at each place."""
        self.ask("Emulation.setTouchEmulationEnabled", enabled=True)
        points = [{"x": x, "y": y, "id": i} for i, (x, y) in enumerate(places)]
        self.ask("Input.dispatchTouchEvent", type=f"touch{kind}", touchPoints=points)

    def key(self, name):
        """Press a key and let go."""
        for kind in ("keyDown", "keyUp"):
            self.ask("Input.dispatchKeyEvent", type=kind, key=name)
