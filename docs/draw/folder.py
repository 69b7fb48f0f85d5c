"""The folder that a drawing script is asked to write into."""

import argparse
from pathlib import Path


def asked(about):
    """Its path, made if missing; `about`, the text of the script, is what --help shows."""
    parser = argparse.ArgumentParser(
        description=about, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="for the pictures")
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    return folder
