"""The structures that Python and the C files share, declared once.

`layout_h` writes them in C, and `dem_demo/compiled.py` makes the same structures for ctypes. Every
field takes eight bytes, so that no compiler pads between them. By the standard library alone: the
library is built with the package, where numpy may be missing.
"""

import ctypes
from typing import NamedTuple

# Columns of the law's measures for one joint, in the order of `jl.Step.measures`
MEASURES = ("sliding", "slipping", "separated", "stored_energy", "dissipated_energy", "damage")
ENERGIES = (
    "kinetic",
    "potential",
    "stored",
    "friction",
    "dashpots",
    "discarded",
    "bolts",
    "external_work",
    "turnover",
)
# Phases of a step, which several threads may share; blocks.c explains them
PHASES = ("move", "update", "finish_points", "finish_blocks")
BLOCKS_PER_PART = 16  # of a phase; energies are summed for each part
POINTS_PER_PART = 512
# Sums over a part of the blocks, of the points, for the energy balance; powers are doubled
BLOCK_SUMS = (
    "twice_kinetic",
    "gravity_work",
    "load_work",
    "absolute_work",
    "dashpot_power",
    "drive_power",
)
POINT_SUMS = ("elastic_energy", "friction_work")


class Constant(NamedTuple):
    """A number that Python and C share."""

    value: float
    about: str


CONSTANTS = {
    "PARALLEL_SINE": Constant(1e-9, "sine of an angle that differs from 0 by rounding only"),
    "FLUSH_SINE": Constant(0.03489949670250097, "sine of 2 degrees: faces that lie on each other"),
    "STRIP_SINE": Constant(0.08715574274765817, "sine of 5 degrees: a block stands on its edge"),
    "FADE_PER_GAP": Constant(0.125, "of the range of contacts: where an edge contact fades"),
    "WHOLE_EDGE_SINE": Constant(0.5, "sine of 30 degrees: an edge on an edge keeps its area"),
    "NO_EDGE_SINE": Constant(0.7071067811865476, "sine of 45 degrees: it has none"),
    "MERGE_PER_FADE": Constant(0.3, "distance of a corner from a line on which it is no corner"),
    "EDGE_SINE": Constant(0.08715574274765817, "sine of 5 degrees: an edge along a contour line"),
    "CORNER_SINE": Constant(0.17364817766693033, "sine of 10 degrees: a corner between two edges"),
    "MIN_AREA_SHARE": Constant(0.1, "of the area of a point that follows its derivatives"),
    "MAX_AREA_CHANGE": Constant(0.005, "of an area, of a closure by sliding: until a new search"),
    "DIFFERENCE": Constant(1e-6, "rad, and of the strip: motion in differences of areas"),
    "CROSSING_SINE": Constant(1e-3, "sine between two edges that cross"),
    "CROSSING_ERROR": Constant(1e-9, "of the length of an edge: rounding of a distance of blocks"),
    "MAX_SEAM_STEP": Constant(0.05, "of the skin: step between coplanar edges at a seam"),
    "LENGTH_TOLERANCE": Constant(1e-6, "relative: lengths that differ by rounding only"),
    "RANGE_TOLERANCE": Constant(1e-10, "m by which a corner may leave its range: no chatter"),
    "BLOCKS_PER_PART": Constant(BLOCKS_PER_PART, "of a phase of a step"),
    "POINTS_PER_PART": Constant(POINTS_PER_PART, "of a phase of a step"),
}


class Field(NamedTuple):
    """A field of a structure: its type in C, and the array or number that it holds."""

    c_type: str
    about: str

    @property
    def ctype(self) -> type:
        """Type for ctypes: addresses of arrays have no type there."""
        if "*" in self.c_type:
            return ctypes.c_void_p
        return {"long long": ctypes.c_longlong, "double": ctypes.c_double}[self.c_type]


LAW_JOINTS = {
    "d": Field("double *", "(places, dim): increments of the next step of the law, m"),
    "F": Field("double *", "(places, dim): tractions after it, Pa"),
    "measures": Field("double *", "(places, DEM_MEASURES + dim): measures; displacement, m"),
    "stress": Field("const double *", "(points,): normal stress of the first-loading curve, Pa"),
    "stiffness": Field("const double *", "(points,): upper bound of the stiffness there, Pa/m"),
    "points": Field("long long", "of the first-loading curve"),
    "bears_tension": Field("long long", "1 if its joints bear tension until they are damaged"),
}
STEP = {
    "n_blocks": Field("long long", "n"),
    "n_contacts": Field("long long", "k: contact points"),
    "n_driven": Field("long long", "motions of blocks that drives prescribe"),
    "dim": Field("long long", "components of a displacement of the law: 2 or 3"),
    "dof": Field("long long", "motions of a block: 3 or 6, displacements first"),
    # ------------------------------------------------------------------ numbers of a scene
    "law_steps": Field("double", "steps of the law per time step"),
    "dashpot_normal": Field("double", "fraction of critical damping"),
    "dashpot_shear": Field("double", "fraction of critical damping"),
    "max_skin_per_step": Field("double", "fraction of its skin that a block may move in a step"),
    "max_skin_until_rebuild": Field("double", "fraction until its contacts are searched again"),
    # ------------------------------------------------------------------ blocks
    "motion": Field("double *", "(2 dof, n): places, rotations; velocities that led there"),
    "velocity": Field("double *", "(dof, n): velocities of the next step"),
    "axes": Field("double *", "(n, 3, 3): principal axes of the blocks, as columns; in space"),
    "rebuilt_at": Field("double *", "(dof, n): places and rotations at the last contact search"),
    "forces": Field("double *", "(3, n, dof): total, dashpots, drives; N and N m"),
    "previous_forces": Field("double *", "(2, n, dof): dashpots, drives, one step before"),
    "inertia": Field("const double *", "(n, dof): masses, moments of inertia"),
    "gravity": Field("const double *", "(n, dof): N"),
    "loads": Field("const double *", "(n, dof): other loads, N and N m"),
    "bolt_forces": Field("const double *", "(n, dof): of rock bolts, N and N m"),
    "inverse_mass": Field("const double *", "(n,): 1/kg, 0 for a block that forces do not move"),
    "radius": Field("const double *", "(n,): m, from the centroid to the farthest corner"),
    "skin": Field("const double *", "(n,): m"),
    "max_overlap": Field("const double *", "(n,): m"),
    "is_mobile": Field("const unsigned char *", "(n,): 1 for a block that moves"),
    "needs_rebuild": Field("unsigned char *", "(n,): 1 where contacts must be searched again"),
    # ------------------------------------------------------------------ contact points as rows
    "update_geometry": Field(
        "dem_update_geometry *", "fills the rows; returns contacts that went on"
    ),
    "geometry": Field("void *", "its argument"),
    "has_parts": Field("long long", "1 if threads may update parts of the geometry"),
    "block_a": Field("const long long *", "(k,): the block with the lower number"),
    "block_b": Field("const long long *", "(k,): the other block"),
    "closure": Field("const double *", "(k,): m, depth of the overlap"),
    "area": Field("const double *", "(k,): m2, of the joint that the point stands for"),
    "kinematics": Field("const double *", "(k, dim, 2 dof): of closure, shears by motions of a, b"),
    "area_gradient": Field("const double *", "(k, 2 dof): of the area by motions of a, b"),
    "rates": Field("double *", "(k, dim): m/s, of closure and shears"),
    "closure_offset": Field("double *", "(k,): m; below 0 it acts at any depth"),
    # ------------------------------------------------------------------ joints
    "laws": Field("const dem_law_joints *", "one for each law"),
    "law": Field("const long long *", "(k,): number of the law"),
    "place": Field("const long long *", "(k,): place among the joints of that law"),
    "first_touch": Field("double *", "(k, dim): displacement of the law at first touch, m"),
    "reduction": Field("const double *", "(dim,): 1, and the factor of a strength reduction"),
    "traction": Field("double *", "(k, dim): normal, shears; Pa"),
    "delta": Field("double *", "(k, dim): closure and sliding since first touch, m"),
    "measures": Field("double *", "(DEM_MEASURES, k)"),
    "booked_area": Field("double *", "(k,): m2, at the last step"),
    "booked_dissipation": Field("double *", "(k,): J/m2, already in the energy balance"),
    "checked_stiffness": Field("double *", "(k,): N/m for which the time step is stable"),
    # ------------------------------------------------------------------ drives
    "driven_block": Field("const long long *", "(n_driven,)"),
    "driven_axis": Field("const long long *", "(n_driven,): number of the motion"),
    "driven_velocity": Field("const double *", "(n_driven,): to be reached in this step"),
    # ------------------------------------------------------------------ threads
    "n_ranges": Field("long long", "ranges of blocks, each for one thread"),
    "first_block": Field("const long long *", "(n_ranges + 1,): multiples of the blocks of a part"),
    "next_part": Field("long long", "of the present phase, which the next thread takes"),
    "point_forces": Field("double *", "(k, 2, dim): of joint, dashpots along closure, shears; N"),
    "block_sums": Field("double *", "(parts of the blocks, DEM_BLOCK_SUMS): energies"),
    "point_sums": Field("double *", "(parts of the points, DEM_POINT_SUMS): energies"),
    # ------------------------------------------------------------------ what a step reports
    "energy": Field("double *", "(DEM_ENERGIES,): J"),
    "too_fast": Field("long long", "a block that moves too far in a step; -1 for none"),
    "too_deep": Field("long long", "a contact that overlaps too much; -1 for none"),
    "transferred": Field("long long", "contacts that went on to another corner or edge"),
    "rebuild": Field("long long", "1 if contacts must be searched again"),
    "stiffened": Field("long long", "joints stiffer than `checked_stiffness`"),
}
CORNERS = {
    "n_blocks": Field("long long", "n"),
    "n_corners": Field("long long", "c"),
    "n_contacts": Field("long long", "k"),
    "thickness": Field("double", "m"),
    "corner_length": Field("double", "m: length of joint at a corner on an edge"),
    "transition_length": Field("double", "m: over which a corner gives way to another"),
    "motion": Field("const double *", "(6, n): x, y, rotation; velocities that led there"),
    "needs_rebuild": Field("unsigned char *", "(n,): 1 where contacts must be searched again"),
    # ------------------------------------------------------------------ corners; edge i starts at i
    "local_corner": Field("const dem_vector *", "(c,): from the centroid, block not rotated"),
    "local_direction": Field("const dem_vector *", "(c,): of the edge, block not rotated"),
    "neighbour_direction": Field("const dem_vector *", "(c, 2): edges before, after, in its frame"),
    "edge_length": Field("const double *", "(c,): m"),
    "block": Field("const long long *", "(c,): block of the corner"),
    "previous": Field("const long long *", "(c,): corner before it"),
    "next": Field("const long long *", "(c,): corner after it"),
    "is_junction": Field("const unsigned char *", "(c,): 1 for a point of three blocks as drawn"),
    "corner_position": Field("dem_vector *", "(c,): now, m"),
    "edge_direction": Field("dem_vector *", "(c,): now"),
    # ------------------------------------------------------------------ contacts: corner on edge
    "corner": Field("long long *", "(k,)"),
    "edge": Field("long long *", "(k,)"),
    "block_a": Field("long long *", "(k,): the block with the lower number"),
    "block_b": Field("long long *", "(k,): the other block"),
    "closure": Field("double *", "(k,): m, depth of the corner below the line of the edge"),
    "area": Field("double *", "(k,): m2"),
    "kinematics": Field("double *", "(k, 2, 6): of closure and sliding by motions of a, b"),
    "area_gradient": Field("double *", "(k, 6): of the area by motions of a, b"),
    "position": Field("dem_vector *", "(k,): m"),
    "normal": Field("dem_vector *", "(k,): from block a to block b"),
    "length": Field("double *", "(k,): m, of the joint that the contact stands for"),
    "tilt_sine": Field("double *", "(2, k): of either side of the corner against the edge"),
    "overlap_length": Field("double *", "(2, k): m, of joint where that side lies on the edge"),
    "range_margin": Field("double *", "(2, k): m, inside the corner's range; below 0 outside"),
    "corner_takes_over": Field("unsigned char *", "(2, k): beyond it, another corner or edge"),
    "previous_length": Field("double *", "(k,): m, before the corner went on to another edge"),
    "work_rows": Field("long long *", "(k,): scratch space"),
}
EDGE_LAWS = {
    "default_law": Field("long long", "number of the law of joints that nothing else names"),
    "law_of_edge": Field("const long long *", "(c,): law of the joint that cut the edge, or -1"),
    "n_tables": Field("long long", "tables of the scene that name laws of blocks"),
    "tables": Field("const long long *", "(n_tables, 3): two blocks, -1 for any; law"),
}
SEAMS = {
    "corners": Field("const void *", "dem_corners: the contacts"),
    "laws": Field("const dem_edge_laws *", ""),
    "skins": Field("const double *", "(n,): m"),
    "law": Field("const long long *", "(k,): number of the law"),
    "stored_energy": Field("const double *", "(k,): J/m2"),
    "traction": Field("const double *", "(k, 2): normal, shear; Pa"),
    "face_pairs": Field("const long long *", "(k, 2): edges between which a contact was found"),
    "is_new": Field("const unsigned char *", "(k,): 1 for a new contact"),
    # ------------------------------------------------------------------ written
    "rows": Field("long long *", "(k,): contacts whose joints continue the joints of others"),
    "edges": Field("long long *", "(k, 2): edges that meet at these contacts"),
    "sources": Field("long long *", "(k,): contacts whose joints they continue"),
    # ------------------------------------------------------------------ scratch space
    "first_side": Field("long long *", "(c,): -1 before and after a call"),
    "next_side": Field("long long *", "(2 k,)"),
    "distance": Field("double *", "(k,): m"),
}
RELAXED_LAW = {
    "advance": Field("dem_advance *", "takes a step of the law, whose states stay as they are"),
    "batch": Field("void *", "its argument: a batch of virgin joints"),
    "next_joint": Field("long long *", "a field of the batch that must be 0 before a step"),
    "contact": Field("const long long *", "(n_joints,): contact point of each joint"),
    "n_joints": Field("long long", "joints of the law"),
    "d": Field("double *", "(n_joints, dim): displacements, m"),
    "F": Field("double *", "(n_joints, dim): tractions, Pa"),
    "is_friction": Field("long long", "1 for Coulomb's law without tension and softening"),
    "normal_stiffness": Field("double", "of this law, Pa/m; so are the next ones"),
    "shear_stiffness": Field("double", "Pa/m"),
    "friction": Field("double", "coefficient"),
    "cohesion": Field("double", "Pa"),
}
RELAXATION = {
    "n_blocks": Field("long long", "n"),
    "n_laws": Field("long long", ""),
    "dim": Field("long long", "components of a displacement of the law: 2 or 3"),
    "dof": Field("long long", "motions of a block: 3 or 6"),
    "laws": Field("const dem_relaxed_law *", "(n_laws,)"),
    "block_a": Field("const long long *", "(k,): blocks that meet at a contact point"),
    "block_b": Field("const long long *", "(k,)"),
    "kinematics": Field("const double *", "(k, dim, 2 dof): J"),
    "area": Field("const double *", "(k,): m2"),
    "start": Field("const double *", "(k, dim): closure and shears at y = 0, m"),
    "reduction": Field("const double *", "(dim,): 1 for closure, the reduction factor for shears"),
    "load": Field("const double *", "(n, dof): forces that do not change"),
    "is_free": Field("const double *", "(n, dof): 1, or 0 for motions that are fixed"),
    "mass": Field("const double *", "(n, dof): more than a quarter of the row sums of stiffness"),
    "first_force": Field("const double *", "(n, dof): unbalanced force before the ramp"),
    "y": Field("double *", "(n, dof): displacements"),
    "v": Field("double *", "(n, dof): their change in an iteration"),
    "force": Field("double *", "(n, dof): unbalanced force"),
    "previous_y": Field("double *", "(n, dof): when the damping was last adapted"),
    "previous_force": Field("double *", "(n, dof): when the damping was last adapted"),
    "damping": Field("double", "c"),
    "smallest_damping": Field("double", "lower bound of c"),
    "smallest_force": Field("double", "norm of the unbalanced force, smallest of a call"),
    "largest_force": Field("double", "norm above which the iterations have diverged"),
    "done": Field("long long", "iterations"),
    "ramp": Field("long long", "iterations over which the loads come on"),
}
SOLIDS = {
    "n_blocks": Field("long long", "n"),
    "first_vertex": Field("const long long *", "(n + 1,): of each block"),
    "first_face": Field("const long long *", "(n + 1,): of each block"),
    "first_corner": Field("const long long *", "(faces + 1,): of each face, in `corner`"),
    "corner": Field("const long long *", "vertices of the faces, counter-clockwise from outside"),
    "local_vertex": Field("const double *", "(vertices, 3): from the centroid, along its axes"),
    "local_normal": Field("const double *", "(faces, 3): outward, along the axes of the block"),
    "position": Field("const double *", "(n, 3): centroids, m"),
    "rotation": Field("const double *", "(n, 3, 3): the axes of a block are the columns"),
    "is_mobile": Field("const unsigned char *", "(n,): 1 for a block that moves"),
    "vertex": Field("double *", "(vertices, 3): now, m"),
    "normal": Field("double *", "(faces, 3): now"),
    "box": Field("double *", "(n, 2, 3): lowest and highest coordinates, m"),
}
POINTS = {
    "capacity": Field("long long", "points that the arrays have room for"),
    "number": Field("long long *", "(capacity,): of the point in its contact"),
    "face_a": Field("long long *", "(capacity,): face of the block with the lower number"),
    "face_b": Field("long long *", "(capacity,): face of the other block"),
    "plane_is_of_a": Field("unsigned char *", "(capacity,): 0 where the plane belongs to b"),
    "point": Field("double *", "(capacity, 3): on the other block than the plane, m"),
    "normal": Field("double *", "(capacity, 3): of the plane, out of its block"),
    "base": Field("double *", "(capacity, 3): a point of the plane, m"),
    "area": Field("double *", "(capacity,): m2"),
    "area_rate": Field("double *", "(capacity, 6): of the area by motions of the point's block"),
    "closure_rate": Field("double *", "(capacity, 6): of the closure, as the point slides"),
}
FACE_POINTS = {
    "n_blocks": Field("long long", "n"),
    "n_points": Field("long long", "k"),
    "motion": Field("const double *", "(12, n): as in dem_step; the places are read"),
    "axes": Field("const double *", "(n, 3, 3): principal axes of the blocks, as columns"),
    "block_a": Field("const long long *", "(k,): the block with the lower number"),
    "block_b": Field("const long long *", "(k,): the other block"),
    "plane_is_of_a": Field("const unsigned char *", "(k,): 0 where the plane belongs to b"),
    "local_point": Field("const double *", "(k, 3): m, from its block, along the axes of it"),
    "local_frame": Field("const double *", "(k, 3, 3): normal, axes of shear, in the other block"),
    "plane_offset": Field("const double *", "(k,): m, of the plane from the centroid of its block"),
    "closure": Field("double *", "(k,): m, depth of the point below the plane"),
    "has_gradients": Field("const unsigned char *", "(k,): 0 where both gradients are zero"),
    "found_area": Field("const double *", "(k,): m2, when the point was found"),
    "found_at": Field("const double *", "(k, 12): motions of a, b then"),
    "area_gradient": Field("const double *", "(k, 12): of the area by motions of a, b"),
    "sliding_gradient": Field("const double *", "(k, 12): of the closure, as the point slides"),
    "area": Field("double *", "(k,): m2"),
    "kinematics": Field("double *", "(k, 3, 12): of closure and shears by motions of a, b"),
}
BOLTS = {
    "n_bolts": Field("long long", "b"),
    "n_blocks": Field("long long", "n"),
    "block_a": Field("const long long *", "(b,): blocks in which the ends are anchored"),
    "block_b": Field("const long long *", "(b,)"),
    "local_a": Field("const dem_vector *", "(b,): ends, from the centroid, block not rotated"),
    "local_b": Field("const dem_vector *", "(b,)"),
    "stiffness": Field("const double *", "(b,): N/m"),
    "capacity": Field("const double *", "(b,): N"),
    "free_length": Field("const double *", "(b,): m, without tension, before any yielding"),
    "yielding": Field("double *", "(b,): plastic elongation, m"),
    "tension": Field("double *", "(b,): N"),
    "motion": Field("const double *", "(6, n): of the blocks, as in dem_step"),
    "forces": Field("double *", "(n, 3): on the blocks, N and N m"),
}
RELAXED_BOLTS = {
    "n_bolts": Field("long long", "b"),
    "dim": Field("long long", "components of a displacement"),
    "stiffness": Field("const double *", "(b,): N/m"),
    "capacity": Field("const double *", "(b,): N"),
    "d": Field("const double *", "(b, dim): first component: minus the elongation, m"),
    "F": Field("double *", "(b, dim): first component: minus the tension, N"),
}
STRUCTURES = {
    "dem_law_joints": LAW_JOINTS,
    "dem_step": STEP,
    "dem_corners": CORNERS,
    "dem_edge_laws": EDGE_LAWS,
    "dem_seams": SEAMS,
    "dem_relaxed_law": RELAXED_LAW,
    "dem_relaxation": RELAXATION,
    "dem_solids": SOLIDS,
    "dem_points": POINTS,
    "dem_face_points": FACE_POINTS,
    "dem_bolts": BOLTS,
    "dem_relaxed_bolts": RELAXED_BOLTS,
}


def _enumeration(names: tuple[str, ...], count: str) -> str:
    return f"enum {{ {', '.join(f'DEM_{name.upper()}' for name in names)}, DEM_{count} }};"


def layout_h() -> str:
    """The text of layout.h."""
    lines = [
        "/* Made from dem_demo/native/layout.py; change it there. */",
        "#ifndef DEM_LAYOUT_H",
        "#define DEM_LAYOUT_H",
        *(
            f"#define DEM_{name} {value!r} /* {about} */"
            for name, (value, about) in CONSTANTS.items()
        ),
        _enumeration(MEASURES, "MEASURES"),
        _enumeration(ENERGIES, "ENERGIES"),
        _enumeration(PHASES, "PHASES"),
        _enumeration(BLOCK_SUMS, "BLOCK_SUMS"),
        _enumeration(POINT_SUMS, "POINT_SUMS"),
        "typedef struct { double x, y; } dem_vector;",
        "typedef int dem_advance(void *batch, int operation);",
        "typedef long long dem_update_geometry(void *geometry, long long begin, long long end);",
    ]
    for name, fields in STRUCTURES.items():
        lines += [
            "typedef struct {",
            *(f"  {field.c_type} {key}; /* {field.about} */" for key, field in fields.items()),
            f"}} {name};",
        ]
    return "\n".join([*lines, "#endif\n"])
