"""`jointlaw browser`: a joint to drag, in the browser of this machine."""

import argparse
import webbrowser
from typing import Any

from ..hosts.browser.export import export_browser
from .command import add_command, add_out


def add(commands: Any) -> None:
    """Add the subcommand to the command line."""
    what = "open a joint in your browser: drag it, and see its asperities stick, slip and part"
    parser = add_command(commands, "browser", what, "jointlaw browser --out joint", _browser)
    add_out(parser, pictures=False)


def _browser(options: argparse.Namespace) -> None:
    made = export_browser(options.out).resolve()
    print(f"wrote {made}: one file, which runs without a network; open it in a browser")
    webbrowser.open(made.as_uri())
