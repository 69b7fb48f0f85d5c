"""The command line of the scripts of this folder: the folder for the pictures."""

import argparse
from pathlib import Path


def output_folder(description):
    """The folder that the command line names, created if missing.

    description: text of --help, the docstring of the script.
    """
    parser = argparse.ArgumentParser(
        description=description, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="for the pictures")
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    return folder
