"""Every key of a scene is felt: another value changes what a short run gives, or is refused.

The keys are those of `dem_demo.scene.keys`, by path; each has a probe: a scene of tables, the place
of the key in it, and another value. A key without a probe fails `test_every_key_has_a_probe`.
"""

import copy
import json

import pytest

from dem_demo import SceneError, Simulation
from dem_demo.output.run import run
from dem_demo.scene import Files, build, read_tables
from dem_demo.scene.keys import SCENE

PLAIN = {
    "kind": "coulomb",
    "normal_stiffness": 1e9,
    "shear_stiffness": 5e8,
    "friction": 0.3,
}
STRONG = PLAIN | {"normal_stiffness": 2e9, "friction": 0.9}
RUN = {"end": 0.01, "record": 0.005}
BASE = {"name": "base", "box": [4.0, 1.0], "at": [0.5, -0.5], "fixed": True}
ONE = {"name": "one", "box": [1.0, 0.5], "at": [0.0, 0.25]}
TWO = {"name": "two", "box": [0.5, 0.4], "at": [0.1, 0.7]}
CORNERS = [[-0.2, 0.5], [0.3, 0.5], [0.2, 0.9], [-0.1, 0.9]]
LAWS = {"plain": PLAIN, "strong": STRONG}
BLOCKS = {
    "title": "blocks",
    "gravity": [1.0, -9.81],
    "density": 2600.0,
    "thickness": 1.0,
    "law": "plain",
    "laws": LAWS,
    "block": [BASE, ONE, TWO],
    "run": RUN,
}
FLYING = BLOCKS | {
    "gravity": [0.0, -9.81],
    "block": [BASE, ONE | {"at": [0.0, 1.25], "angle": 5.0}],
    "run": RUN | {"skin": 0.05},
}
DRIVEN = BLOCKS | {
    "gravity": [0.0, -9.81],
    "block": [BASE, ONE, TWO, BASE | {"name": "other", "at": [0.5, 5.0]}],
}
TURNS = {"times": [0.0, 1.0], "values": [0.0, 0.3], "ramp": 0.004}
REVERSE = {"block": "one", "slip": 1e-6, "by": -0.1, "duration": 0.01}
RECORD = "time_s,acceleration_m/s2\n0,0\n0.004,0.5\n0.01,1\n"
FILES = {"one.csv": RECORD, "two.csv": RECORD.replace("1\n", "2\n")}
SET = {"dip": 0.0, "spacing": 0.5, "scatter": 0.2, "persistence": 0.9, "law": "plain"}
CROSS = SET | {"dip": 80.0, "spacing": 0.7, "through": [1.0, 0.0]}
OUTLINE = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.4], [0.0, 1.4]]
FLOOR = [[-1.0, -1.0], [3.0, -1.0], [3.0, 0.3], [-1.0, 0.3]]
HIGH_FLOOR = [[-1.0, -1.0], [3.0, -1.0], [3.0, 0.8], [-1.0, 0.8]]
ROCK = {
    "name": "rock",
    "outline": OUTLINE,
    "set": [SET, CROSS],
    "at": [0.0, 0.0],
    "fixed": [{"corners": FLOOR}],
    "density": 2600.0,
    "seed": 1,
    "min_width": 0.1,
}
CUT = {"laws": LAWS, "rock": [ROCK], "run": RUN, "gravity": [1.0, -9.81]}
# Half of a square is a hole: the rock is cut at its inward corner
NOTCH = [[-1.0, 0.8], [1.3, 0.8], [1.3, 3.0], [-1.0, 3.0]]
NOTCHED = ROCK | {"hole": [{"corners": NOTCH}], "cut_law": "plain"}
STEEP = {"dip": 70.0, "spacing": 9.0, "through": [9.0, 0.0], "law": "plain"}
UNCUT = CUT | {"rock": [NOTCHED | {"set": [STEEP]}]}
MASS = {
    "name": "rock",
    "outline": [[0.0, 0.0], [3.0, 0.0], [3.0, 3.0], [0.0, 3.0]],
    "set": [{"dip": dip, "spacing": 1.0, "law": "plain"} for dip in (0.0, 90.0)],
}
IN_SITU = {
    "laws": LAWS,
    "rock": [MASS],
    "run": RUN,
    "in_situ": {"k0": 0.8, "surface": [[0.0, 20.0]], "bottom": "fixed"}
    | dict.fromkeys(("left", "right"), "rollers")
    | {"top": "loaded"},
}
MIDDLE = [[0.9, 0.9], [2.1, 0.9], [2.1, 2.1], [0.9, 2.1]]
DUG = IN_SITU | {"excavate": [{"corners": MIDDLE, "start": 0.0, "release_time": 0.002}]}
UNIFORM = IN_SITU | {
    "gravity": [0.0, 0.0],
    "in_situ": IN_SITU["in_situ"] | {"stress": [2e6, 1e6, 0.0]},
}
del UNIFORM["in_situ"]["k0"], UNIFORM["in_situ"]["surface"]
WET = BLOCKS | {"gravity": [0.0, -9.81], "water": {"table": [[0.0, 0.4]], "unit_weight": 9810.0}}
RISING = WET | {
    "water": {"table": [[0.0, 0.4]], "at": [{"time": 0.005, "table": [[0.0, 0.6]]}]},
    "run": RUN | {"step": 1e-4},
}
JOINTED = BLOCKS | {"joint": [{"between": ["base", "one"], "law": "strong"}]}
AROUND = BLOCKS | {"joint": [{"around": [0.1, 0.1], "law": "strong"}]}
MONITORED = BLOCKS | {
    "monitor": {
        "slip": [["one", "base"]],
        "shear": [["two", "one"]],
        "points": [[0.1, 0.1]],
        "joints": [[0.1, 0.5]],
    }
}
BOLT = {"from": [0.1, 0.7], "to": [0.1, -0.4], "stiffness": 1e7, "capacity": 2e4, "pretension": 1e3}
BOLTED = BLOCKS | {"bolt": [BOLT]}
WEAKLY_BOLTED = BLOCKS | {"gravity": [20.0, -9.81], "bolt": [BOLT | {"capacity": 2e3}]}
PUSHED = BLOCKS | {"pressure": [{"from": [-0.15, 0.9], "to": [0.35, 0.9], "value": 1e3}]}


def drive(**keys):
    """A scene whose base a drive moves."""
    return DRIVEN | {"drive": [{"block": "base", "motion": "x"} | keys]}


PROBES = {  # path of the key: scene, where the key is in it, another value
    "title": (BLOCKS, "title", "others"),
    "gravity": (BLOCKS, "gravity", [1.0, -9.0]),
    "seismic": (BLOCKS, "seismic", [0.1, 0.0]),
    "density": (BLOCKS, "density", 2500.0),
    "thickness": (BLOCKS, "thickness", 2.0),
    "law": (BLOCKS, "law", "strong"),
    "laws": (BLOCKS, "laws.plain.friction", 0.05),
    "block.name": (BLOCKS, "block.1.name", "uno"),
    "block.box": (BLOCKS, "block.2.box", [0.6, 0.4]),
    "block.at": (BLOCKS, "block.2.at", [0.2, 0.7]),
    "block.angle": (FLYING, "block.1.angle", 6.0),
    "block.corners": (
        BLOCKS | {"block": [BASE, ONE, {"name": "two", "corners": CORNERS}]},
        "block.2.corners.2",
        [0.25, 0.9],
    ),
    "block.density": (BLOCKS, "block.2.density", 2500.0),
    "block.fixed": (BLOCKS, "block.1.fixed", True),
    "block.velocity": (FLYING, "block.1.velocity", [0.1, 0.0]),
    "block.spin": (FLYING, "block.1.spin", 0.1),
    "block.load": (FLYING, "block.1.load", [0.0, -100.0]),
    "block.fixed_motions": (BLOCKS, "block.2.fixed_motions", ["x"]),
    "rock.name": (CUT, "rock.0.name", "other"),
    "rock.outline": (CUT, "rock.0.outline.2", [2.1, 1.4]),
    "rock.set.dip": (CUT, "rock.0.set.1.dip", 75.0),
    "rock.set.spacing": (CUT, "rock.0.set.1.spacing", 0.8),
    "rock.set.law": (CUT, "rock.0.set.0.law", "strong"),
    "rock.set.through": (CUT, "rock.0.set.1.through", [1.1, 0.0]),
    "rock.set.persistence": (CUT, "rock.0.set.0.persistence", 0.1),
    "rock.set.scatter": (CUT, "rock.0.set.0.scatter", 0.1),
    "rock.at": (CUT, "rock.0.at", [0.5, 0.0]),
    "rock.fixed.corners": (CUT, "rock.0.fixed.0.corners", HIGH_FLOOR),
    "rock.hole.corners": (UNCUT, "rock.0.hole.0.corners.0", [-1.0, 0.9]),
    "rock.density": (CUT, "rock.0.density", 2500.0),
    "rock.seed": (CUT, "rock.0.seed", 2),
    "rock.min_width": (CUT, "rock.0.min_width", 0.3),
    "rock.laws": (CUT, "rock.0.laws", {"plain": "strong"}),
    "rock.cut_law": (UNCUT, "rock.0.cut_law", "strong"),
    "drive.block": (drive(**TURNS), "drive.0.block", "other"),
    "drive.motion": (drive(**TURNS), "drive.0.motion", "y"),
    "drive.ramp": (drive(**TURNS), "drive.0.ramp", 0.002),
    "drive.times": (drive(**TURNS), "drive.0.times", [0.0, 2.0]),
    "drive.values": (drive(**TURNS), "drive.0.values", [0.0, 0.2]),
    "drive.reverse.block": (drive(**TURNS, reverse=REVERSE), "drive.0.reverse.block", "two"),
    "drive.reverse.slip": (drive(**TURNS, reverse=REVERSE), "drive.0.reverse.slip", 1.0),
    "drive.reverse.by": (drive(**TURNS, reverse=REVERSE), "drive.0.reverse.by", -0.2),
    "drive.reverse.duration": (drive(**TURNS, reverse=REVERSE), "drive.0.reverse.duration", 0.02),
    "drive.sine.acceleration": (
        drive(sine={"acceleration": 1.0, "frequency": 50.0}), "drive.0.sine.acceleration", 2.0,
    ),
    "drive.sine.frequency": (
        drive(sine={"acceleration": 1.0, "frequency": 50.0}), "drive.0.sine.frequency", 60.0,
    ),
    "drive.sine.cycles": (
        drive(sine={"acceleration": 1.0, "frequency": 500.0, "cycles": 2}),
        "drive.0.sine.cycles",
        1,
    ),
    "drive.file": (drive(file="one.csv"), "drive.0.file", "two.csv"),
    "drive.scale": (drive(file="one.csv"), "drive.0.scale", 2.0),
    "drive.baseline": (drive(file="one.csv"), "drive.0.baseline", True),
    "run.end": (BLOCKS, "run.end", 0.02),
    "run.fraction": (BLOCKS, "run.fraction", 0.1),
    "run.step": (BLOCKS, "run.step", 1e-4),
    "run.settle": (BLOCKS, "run.settle", False),
    "run.record": (BLOCKS, "run.record", 0.0025),
    "run.dashpot_normal": (BLOCKS | {"run": RUN | {"settle": False}}, "run.dashpot_normal", 0.1),
    "run.dashpot_shear": (BLOCKS | {"run": RUN | {"settle": False}}, "run.dashpot_shear", 0.1),
    "run.law_steps": (drive(**TURNS), "run.law_steps", 2),
    "run.skin": (FLYING, "run.skin", 1.2),
    "run.corner_length": (
        BLOCKS | {"block": [BASE, ONE | {"angle": 20.0, "at": [0.0, 0.41]}]},
        "run.corner_length",
        0.2,
    ),
    "run.max_overlap": (
        BLOCKS | {"block": [BASE, ONE | {"at": [0.0, 0.24]}], "run": RUN | {"settle": False}},
        "run.max_overlap",
        1e-3,
    ),
    "joint.between": (JOINTED, "joint.0.between", ["one", "two"]),
    "joint.around": (AROUND, "joint.0.around", [0.1, 0.7]),
    "joint.law": (JOINTED, "joint.0.law", "plain"),
    "excavate.corners": (DUG, "excavate.0.corners.0", [-0.1, 0.9]),
    "excavate.start": (DUG, "excavate.0.start", 0.005),
    "excavate.release_time": (DUG, "excavate.0.release_time", 0.004),
    "in_situ.k0": (IN_SITU, "in_situ.k0", 1.0),
    "in_situ.stress": (UNIFORM, "in_situ.stress", [2e6, 1e6, 1e5]),
    "in_situ.surface": (IN_SITU, "in_situ.surface", [[0.0, 25.0]]),
    "in_situ.left": (IN_SITU, "in_situ.left", "fixed"),
    "in_situ.right": (IN_SITU, "in_situ.right", "fixed"),
    "in_situ.bottom": (IN_SITU, "in_situ.bottom", "rollers"),
    "in_situ.top": (IN_SITU, "in_situ.top", "fixed"),
    "water.table": (WET, "water.table", [[0.0, 0.3]]),
    "water.at.time": (RISING, "water.at.0.time", 0.01),
    "water.at.table": (RISING, "water.at.0.table", [[0.0, 0.5]]),
    "water.unit_weight": (WET, "water.unit_weight", 9000.0),
    "bolt.from": (BOLTED, "bolt.0.from", [0.0, 0.6]),
    "bolt.to": (BOLTED, "bolt.0.to", [0.0, -0.4]),
    "bolt.stiffness": (BOLTED, "bolt.0.stiffness", 2e7),
    "bolt.capacity": (WEAKLY_BOLTED, "bolt.0.capacity", 2.5e3),
    "bolt.pretension": (BOLTED, "bolt.0.pretension", 2e3),
    "pressure.from": (PUSHED, "pressure.0.from", [0.0, 0.9]),
    "pressure.to": (PUSHED, "pressure.0.to", [0.2, 0.9]),
    "pressure.value": (PUSHED, "pressure.0.value", 2e3),
    "monitor.slip": (MONITORED, "monitor.slip", []),
    "monitor.shear": (MONITORED, "monitor.shear", []),
    "monitor.points": (MONITORED, "monitor.points", [[0.2, 0.1]]),
    "monitor.convergence": (
        MONITORED | {"monitor": {"convergence": [[[0.1, 0.1], [0.1, -0.1]]]}},
        "monitor.convergence",
        [[[0.1, 0.7], [0.1, -0.1]]],
    ),
    "monitor.joints": (MONITORED, "monitor.joints", [[0.1, 0.0]]),
    # keys beside those of `SCENE`, and of a law in a scene
    "laws.NAME.from": (
        BLOCKS | {"laws": {"plain": {"from": "biegel-rough"}, "strong": STRONG}},
        "laws.plain.from",
        "biegel-smooth",
    ),
    "laws.NAME.pressure": (BLOCKS, "laws.plain.pressure", 2e3),
    "laws.NAME.kind": (
        BLOCKS | {"laws": {"plain": {"from": "biegel-rough"}, "strong": STRONG}},
        "laws.plain",
        PLAIN,
    ),
}  # fmt: skip

PRESENT = {}  # outcomes of scenes as they are, which several probes share
VARIANT_LINES = ('variant = "long"\n', 'variant = "short"\n')


def key_paths(rules, above=""):
    """Paths of all keys that hold a value."""
    for key, rule in rules.items():
        path = above + key.rstrip("!")
        inner = rule[0] if isinstance(rule, list) else rule
        if isinstance(inner, dict):
            yield from key_paths(inner, f"{path}.")
        else:
            yield path


def changed(tables, path, value):
    """Tables with another value at a path of keys and numbers."""
    tables = copy.deepcopy(tables)
    *above, last = (int(part) if part.isdigit() else part for part in path.split("."))
    place = tables
    for part in above:
        place = place[part]
    assert isinstance(place, list) or place.get(last) != value, "the same value again"
    place[last] = value
    return tables


def outcome(tables, folder):
    """What a run of a scene gives: summary, tables and final state, or the message of an error."""
    files = Files(known=dict(FILES))
    try:
        sim = Simulation(build(copy.deepcopy(tables), files=files))
        record, summary = run(sim, None, pictures=None)
    except SceneError as error:
        return str(error)
    del summary["wall_time_s"]
    record.write_history(folder / "history.csv")
    record.write_blocks(folder / "blocks.csv")
    state = {name: array.tolist() for name, array in sim.state().items()}
    texts = [path.read_text() for path in sorted(folder.glob("*.csv"))]
    return json.dumps(summary), texts, json.dumps(state)


def test_every_key_has_a_probe():
    assert {*key_paths(SCENE)} == {path for path in PROBES if not path.startswith("laws.NAME")}


@pytest.mark.parametrize("path", PROBES)
def test_every_key_is_felt(path, tmp_path):
    scene, place, value = PROBES[path]
    key = json.dumps(scene)
    if key not in PRESENT:
        PRESENT[key] = outcome(scene, tmp_path)
    assert not isinstance(PRESENT[key], str), PRESENT[key]
    assert outcome(changed(scene, place, value), tmp_path) != PRESENT[key]


def test_variants_and_rocks_like_others_are_felt():
    """The keys that are resolved before all others."""
    text = 'title = "t"\n[variants.long]\ntitle = "l"\n[variants.short]\ntitle = "s"\n'
    titles = [read_tables(line + text)["title"] for line in ("", *VARIANT_LINES)]
    assert titles == ["t", "l", "s"]
    rocks = '[[rock]]\nname = "a"\nseed = 1\n[[rock]]\nname = "b"\nseed = 2\n[[rock]]\n'
    seeds = [
        read_tables(f'{rocks}name = "c"\nlike = "{like}"\n')["rock"][2]["seed"] for like in "ab"
    ]
    assert seeds == [1, 2]
