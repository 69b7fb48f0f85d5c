"""The tables of a scene with one of its rocks."""

from typing import Any

import numpy as np

Tables = dict[str, Any]


def alone(data: Tables, name: str, seed: int | None = None) -> Tables:
    """A scene's tables with one of its rocks, cut with a seed (default its own), nothing watched.

    Of the [[joint]] tables those of this rock stay; those that name its blocks only with its own
    seed, for with another there are other blocks.
    """
    known: dict[str, Tables] = {}
    for table in data["rock"]:
        known[table["name"]] = {**known.get(table.get("like", ""), {}), **table, "like": ""}
    rock = known[name]
    same = seed is None or seed == rock.get("seed", 0)
    blocks = {block["name"] for block in data.get("block", [])}
    low, high = np.quantile(np.add(rock["outline"], rock.get("at", [0, 0])), [0, 1], axis=0)

    def belongs(joint: Tables) -> bool:
        if around := joint.get("around"):
            return bool((low < around).all() and (around < high).all())
        others = set(joint["between"]) - blocks
        return all(other.rpartition(" ")[0] == name for other in others) and (same or not others)

    joints = [joint for joint in data.get("joint", []) if belongs(joint)]
    rock = rock if same else {**rock, "seed": seed}
    return {**data, "rock": [rock], "watch": {}, "joint": joints}
