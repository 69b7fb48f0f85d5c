"""Chromium without a window, driven by its DevTools protocol over a pipe."""

import json
import socket
import subprocess

from programs import find_program


class Chromium:
    """A browser with one page. `errors`: errors of its console."""

    def __init__(self, folder):
        self.pipe, theirs = socket.socketpair()
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]
        # Chromium reads from 3 and writes to 4
        command = ["bash", "-c", f'exec "$@" 3<&{theirs.fileno()} 4>&{theirs.fileno()}', "bash"]
        self.process = subprocess.Popen(
            [*command, find_program("chromium"), *flags, f"--user-data-dir={folder}"],
            pass_fds=[theirs.fileno()], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        theirs.close()
        self.count = 0
        self.errors = []
        self.session = {}
        self.rest = b""
        page = self.call("Target.createTarget", url="about:blank")["targetId"]
        attached = self.call("Target.attachToTarget", targetId=page, flatten=True)
        self.session = {"sessionId": attached["sessionId"]}
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")
        self.call("Emulation.setDeviceMetricsOverride", width=390, height=900,  # as of a phone
                 deviceScaleFactor=2, mobile=True)  # fmt: skip

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.pipe.close()
        self.process.wait(30)

    def call(self, method, **parameters):
        """Call a method of the protocol; returns its result."""
        self.count += 1
        call = {"id": self.count, "method": method, "params": parameters, **self.session}
        self.pipe.sendall(json.dumps(call).encode() + b"\0")
        while (answer := self._answer()).get("id") != self.count:
            self._listen(answer)
        assert "error" not in answer, answer
        return answer["result"]

    def _answer(self):
        while b"\0" not in self.rest:
            more = self.pipe.recv(1 << 20)
            assert more, "Chromium has ended"
            self.rest += more
        one, _, self.rest = self.rest.partition(b"\0")
        return json.loads(one)

    def _listen(self, event):
        parameters = event.get("params", {})
        level = parameters.get("type") or parameters.get("entry", {}).get("level")
        if event.get("method") == "Runtime.exceptionThrown" or level in ("error", "assert"):
            self.errors.append(json.dumps(parameters))

    def run(self, script):
        """Evaluate a script in the page and return its value, after a promise is resolved."""
        answer = self.call(
            "Runtime.evaluate", expression=script, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in answer, answer
        return answer["result"].get("value")

    def wait(self, condition):
        """Wait until a condition in the page is true, one minute at most."""
        check = f"if ({condition}) done(true); else setTimeout(check, 20)"
        timeout = "setTimeout(() => done(false), 60000)"
        body = f"const check = () => {{ {check} }}; check(); {timeout};"
        script = f"new Promise((done) => {{ {body} }})"
        assert self.run(script), f"never true: {condition}; errors of the console: {self.errors}"
