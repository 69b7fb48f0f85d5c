"""`jointlaw browser`: a joint to drag, in the browser of this machine."""

import argparse
import webbrowser

from ..hosts.browser.export import export_browser
from .command import OUT, Command


def _browser(options: argparse.Namespace) -> None:
    made = export_browser(options.out).resolve()
    print(f"wrote {made}: one file, which runs without a network; open it in a browser")
    webbrowser.open(made.as_uri())


COMMAND = Command(
    "browser",
    "open a joint in your browser: drag it, and see its asperities stick, slip and part",
    "jointlaw browser --out joint",
    _browser,
    OUT,
)
