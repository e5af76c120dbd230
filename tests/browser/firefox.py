"""Firefox without a window, driven by its own protocol, Marionette: JSON over a socket of this machine."""

import base64
import json
import os
import shutil
import socket
import subprocess
import time
from pathlib import Path

#: Nothing of a first start, no updates, no requests to the maker, and any port that is free.
_PREFERENCES = {
    "marionette.port": 0,
    "browser.shell.checkDefaultBrowser": False,
    "browser.startup.homepage_override.mstone": "ignore",
    "datareporting.policy.dataSubmissionEnabled": False,
    "toolkit.telemetry.reportingpolicy.firstRun": False,
    "app.update.auto": False,
}


def found():
    """The program; None where it is not installed."""
    return os.environ.get("FIREFOX") or shutil.which("firefox-esr") or shutil.which("firefox")


class Firefox:
    """One browser with one tab, as a context.

    Args:
        folder: an empty folder for its profile.
        preferences: more settings of it, by name.
    """

    def __init__(self, folder: Path, **preferences):
        lines = [
            f"user_pref({json.dumps(name)}, {json.dumps(value)});"
            for name, value in (_PREFERENCES | preferences).items()
        ]
        (folder / "user.js").write_text("\n".join(lines))
        self._process = subprocess.Popen(
            [found(), "--headless", "--marionette", "--remote-allow-system-access", "--no-remote", "--profile", folder],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=os.environ | {"MOZ_HEADLESS_WIDTH": "1300", "MOZ_HEADLESS_HEIGHT": "1000", "HOME": str(folder)},
        )
        self._count = 0
        try:
            self._socket = self._connected(folder / "MarionetteActivePort")
            self._read()  # what it says of itself
            self("WebDriver:NewSession", capabilities={})
        except BaseException:
            self.__exit__()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self._process.terminate()
        self._process.wait(30.0)

    def __call__(self, command, **given):
        """Send a command and return what it gives."""
        self._count += 1
        content = json.dumps([0, self._count, command, given]).encode()
        self._socket.sendall(b"%d:%s" % (len(content), content))
        _, _, error, result = self._read()
        if error:
            raise RuntimeError(error)
        return result

    def evaluate(self, expression):
        """The value of an expression in the page."""
        return self("WebDriver:ExecuteScript", script=f"return {expression};", args=[])["value"]

    def click(self, css):
        """Click an element as a person does."""
        element = self("WebDriver:FindElement", using="css selector", value=css)["value"]
        self("WebDriver:ElementClick", id=next(iter(element.values())))

    def until(self, condition, seconds=60.0):
        """Wait for a condition of the page."""
        end = time.monotonic() + seconds
        while not self.evaluate(condition):
            assert time.monotonic() < end, f"not within {seconds:g} s: {condition}"
            time.sleep(0.1)

    def said(self, file):
        """Errors and warnings of scripts and styles of a file, one line each."""
        self("Marionette:SetContext", value="chrome")
        found = self(
            "WebDriver:ExecuteScript",
            script="""return Services.console.getMessageArray().filter((one) => one instanceof Ci.nsIScriptError
              && one.sourceName.startsWith(arguments[0])).map((one) => one.message);""",
            args=[file],
        )["value"]
        self("Marionette:SetContext", value="content")
        return found

    def screenshot(self, file):
        """Write a picture of the whole page as PNG."""
        shown = self("WebDriver:TakeScreenshot", full=True)["value"]
        Path(file).write_bytes(base64.b64decode(shown))

    def _connected(self, file, seconds=60.0):
        end = time.monotonic() + seconds
        while not file.exists() or not file.read_text():
            if self._process.poll() is not None:
                raise RuntimeError(f"Firefox has ended with {self._process.returncode}")
            assert time.monotonic() < end, "Firefox does not answer"
            time.sleep(0.1)
        return socket.create_connection(("127.0.0.1", int(file.read_text())), timeout=120.0)

    def _read(self):
        """The next message: its length, a colon, and JSON."""
        size = b""
        while not size.endswith(b":"):
            size += self._socket.recv(1)
        content = b""
        while len(content) < int(size[:-1]):
            content += self._socket.recv(65536)
        return json.loads(content)
