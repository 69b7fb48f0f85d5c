"""`jointlaw browser`: an interactive joint in the web browser of this machine."""

import argparse
import webbrowser

from ..hosts.browser.export import export_browser
from .command import OUT, Command


def _run(options: argparse.Namespace) -> None:
    page = export_browser(options.out).resolve()
    print(f"wrote {page}: one file, which runs without a network; open it in a browser")
    webbrowser.open(page.as_uri())


COMMAND = Command(
    "browser",
    "open an interactive joint in your browser: drag it, and see asperities stick, slip, separate",
    "jointlaw browser --out joint",
    _run,
    OUT,
)
