"""The law of each contact of faces, and the rough direction that its axis 2 follows.

A `[[joint]]` table of both blocks comes first. Else the set of the face of block b names the law,
else the set of the face of block a, else the scene has a default. The rough direction belongs to a
face as drawn and moves with its block: the direction of the set, or an angle from the dip line of
the face. A joint takes one direction, from the face of block b, or from the face of a where only a
lies on a joint of a set. So two faces that meet anew in a run, each with a rough direction of its
own, follow the face of b, the block with the higher number.
"""

import numpy as np

from .contacts import ContactPoints, Surfaces, turned_from_dip
from .scene import SpaceScene


class FaceLaws:
    """Laws and rough directions of the faces of a scene, f in all.

    surfaces: of the blocks as drawn when this is made. law_of_face (f,): number of the law, -1 for
    a face on no joint of a set; axis_of_face (f, 3): its axis 2 as drawn.
    """

    def __init__(self, scene: SpaceScene, surfaces: Surfaces) -> None:
        self.scene = scene
        self.surfaces = surfaces
        self.number = {name: i for i, name in enumerate(scene.laws)}
        number = self.number | {None: -1}
        self.law_of_face = np.array(
            [number[law] for block in scene.blocks for law in block.face_laws]
        )
        self.axis_of_face = np.concatenate([block.face_axes for block in scene.blocks])
        self.drawn_normal = surfaces.normal.copy()
        self.drawn_rotation = surfaces.rotation.copy()

    def law_and_axis(self, points: ContactPoints) -> tuple[np.ndarray, np.ndarray]:
        """Number of the law (k,) of each contact point, and its axis 2 (k, 3) at the present
        places, which is not yet projected on the face of b."""
        scene = self.scene
        is_of_a = self.law_of_face[points.face_b] < 0
        face = np.where(is_of_a, points.face_a, points.face_b)
        block = np.where(is_of_a, points.block_a, points.block_b)
        law = self.law_of_face[face]
        axis_2 = self.axis_of_face[face]
        is_default = law < 0
        angle = np.full(len(law), scene.rough)
        law[is_default] = self.number[scene.default_law]
        for pair, (name, degrees) in scene.pairs.items():
            low, high = sorted(pair)
            is_pair = (points.block_a == low) & (points.block_b == high)
            law[is_pair] = self.number[name]
            angle[is_pair] = degrees
            is_default |= is_pair
        block[is_default] = points.block_b[is_default]
        normal = self.drawn_normal[points.face_b[is_default]]
        axis_2[is_default] = turned_from_dip(normal, angle[is_default])
        local = np.einsum("kji,kj->ki", self.drawn_rotation[block], axis_2)
        return law, np.einsum("kij,kj->ki", self.surfaces.rotation[block], local)
