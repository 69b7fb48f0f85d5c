"""The folder of a run: names of its files, and how it is checked and cleared.

`summary.json` lists the tables and pictures of a run; the files below are not in its list, or are
there before it is written.
"""

from pathlib import Path

from jointlaw.support import files

HISTORY = "history.csv"
BLOCKS = "blocks.csv"
ABLATION = "ablation.csv"
STRENGTH = "strength.json"
TRIALS = "trials.json"
STATE = "state"  # folder of the state at the end
LAST_VALID_STATE = "last_valid_state"  # folder of the state before an error
_STATES = (STATE, LAST_VALID_STATE)
_STATE_FILES = ("scene.toml", "state.npz")
_VTK = "vtk"
_PATTERNS = (
    HISTORY,
    ABLATION,
    *(f"{state}/{name}" for state in _STATES for name in _STATE_FILES),
    f"{_VTK}/*.vtu",
)
_MARKS = (files.SUMMARY, HISTORY, ABLATION, *_STATES, STRENGTH)


def require_free(folder: Path) -> None:
    """Refuse a folder that holds another run. Raises ValueError with the remedy."""
    files.require_free(folder, _MARKS)


def clear_run(folder: Path) -> None:
    """Create the folder, or remove the results of an earlier run from it; other files stay."""
    files.clear_run(folder, _PATTERNS)
