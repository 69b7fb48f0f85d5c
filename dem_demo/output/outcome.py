"""What became of each rock mass of a run: does it stand, and how far did its blocks move?"""

import numpy as np

from ..scene import usual_size
from .record import Record

FAILED = 0.1  # of the usual size of a rock's blocks: one that has moved farther has failed
CREEP = 1e-6  # m/s: faster is not at rest
LOOK_BACK = 1.0  # s over which creep is measured


def displacement(record: Record, i: int) -> np.ndarray:
    """Displacement (n, 2) of the blocks in frame i since they were drawn, without weight (m)."""
    drawn = np.array([block.centroid for block in record.scene.blocks])
    return record.motion[i][:2].T - drawn


def outcomes(record: Record) -> list[dict]:
    """One entry for each `[[rock]]` of the scene.

    settled_m: largest displacement from the drawing to step 0; moved_m: largest since
    then; failed: blocks that moved more than failed_beyond_m; creep_m_per_s: largest mean speed
    over the last second (or the whole run, if shorter).
    """
    out = []
    first, last = displacement(record, 0), displacement(record, -1)
    times = np.array(record.times)
    before = int(np.searchsorted(times, times[-1] - LOOK_BACK + 1e-9)) if len(times) > 1 else 0
    before = min(before, max(len(times) - 2, 0))
    crept = np.hypot(*(last - displacement(record, before)).T)
    crept /= max(times[-1] - times[before], 1e-300)
    for rock in record.scene.rocks:
        free = rock.free
        moved, creep = np.hypot(*(last - first)[free].T), float(crept[free].max())
        limit = FAILED * usual_size(record.scene.blocks[i] for i in free)
        failed = int((moved > limit).sum())
        out.append(
            {
                "rock": rock.name,
                "state": "fails" if failed else "stands" if creep < CREEP else "moves",
                "blocks": len(free),
                "settled_m": float(np.hypot(*first[free].T).max()),
                "moved_m": float(moved.max()),
                "failed": failed,
                "failed_beyond_m": limit,
                "creep_m_per_s": creep,
            }
        )
    return out


def far(record: Record) -> bool:
    """Has a block moved by more than the usual size of a block?"""
    size = usual_size(block for block in record.scene.blocks if not block.fixed)
    return bool(record.moved.max() > size)


def slip_per_cycle(record: Record) -> dict[str, list[float]]:
    """Slip (m) of each watched joint in each whole cycle of the sine that shakes the scene.

    By the name of the moving block; empty without a sine. Between frames slip is interpolated.
    """
    period = next((drive.period for drive in record.scene.drives if drive.period), None)
    if period is None:
        return {}
    t, watched = np.array(record.times), record.scene.monitors
    ends = period * np.arange(np.ceil(t[0] / period), np.floor(t[-1] / period) + 1)
    names = [record.scene.blocks[moving].name for moving, _ in (*watched.slip, *watched.shear)]
    slid = {name: np.interp(ends, t, record.column(f"{name}: slid_m")) for name in names}
    return {name: np.diff(there).tolist() for name, there in slid.items()}


def sentence(entry: dict) -> str:
    """One line for a person."""
    start = f"{entry['rock']}: {entry['state']}; "
    if entry["failed"]:
        many = f"{entry['failed']} of {entry['blocks']} blocks moved more than "
        many += f"{entry['failed_beyond_m']:.2g} m"
        return f"{start}{many}, the farthest {entry['moved_m']:.2f} m"
    moved = max(1e3 * entry["moved_m"], 1e-3)
    return (
        f"{start}no block of {entry['blocks']} moved more than {moved:.2g} mm, "
        f"creep {entry['creep_m_per_s']:.1e} m/s"
    )
