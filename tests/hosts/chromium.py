"""Chromium without a window, driven by its DevTools protocol over a pipe."""

import json
import socket
import subprocess

from programs import found


class Chromium:
    """One page. `said`: the errors of its console."""

    def __init__(self, folder):
        self.pipe, theirs = socket.socketpair()
        flags = ["--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-pipe"]
        # Chromium reads from 3 and writes to 4
        command = ["bash", "-c", f'exec "$@" 3<&{theirs.fileno()} 4>&{theirs.fileno()}', "bash"]
        self.process = subprocess.Popen(
            [*command, found("chromium"), *flags, f"--user-data-dir={folder}"],
            pass_fds=[theirs.fileno()], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        theirs.close()
        self.count, self.said, self.session, self.rest = 0, [], {}, b""
        page = self.ask("Target.createTarget", url="about:blank")["targetId"]
        attached = self.ask("Target.attachToTarget", targetId=page, flatten=True)
        self.session = {"sessionId": attached["sessionId"]}
        for domain in ("Page", "Runtime", "Log"):
            self.ask(f"{domain}.enable")
        self.ask("Emulation.setDeviceMetricsOverride", width=390, height=900,  # as of a phone
                 deviceScaleFactor=2, mobile=True)  # fmt: skip

    def __enter__(self):
        return self

    def __exit__(self, *error):
        self.pipe.close()
        self.process.wait(30)

    def ask(self, method, **parameters):
        """The result of a call of the protocol."""
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
        told = event.get("params", {})
        level = told.get("type") or told.get("entry", {}).get("level")
        if event.get("method") == "Runtime.exceptionThrown" or level in ("error", "assert"):
            self.said.append(json.dumps(told))

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
