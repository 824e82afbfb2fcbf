"""The drawn hand has the shapes of the model."""

from collections import Counter

import mujoco
import numpy as np
import pytest

from simulator.drawn_parts import PosedHand
from simulator.routed import build_routed
from simulator.skeleton import COLLISION_GROUP, GUIDE_GROUP


@pytest.mark.parametrize("side", ["right", "left"])
def test_each_geom_is_drawn_in_its_shape_and_size(side):
    """A capsule is a cylinder and two balls, whose centres are at its ends."""
    model = build_routed(side).compile()
    shown = [geom for geom in range(model.ngeom) if model.geom_group[geom] not in (COLLISION_GROUP, GUIDE_GROUP)]
    kinds = Counter(mujoco.mjtGeom(model.geom_type[geom]) for geom in shown)
    capsules, boxes = kinds[mujoco.mjtGeom.mjGEOM_CAPSULE], kinds[mujoco.mjtGeom.mjGEOM_BOX]
    parts = list(PosedHand(side).parts())
    drawn = Counter(part.shape for part in parts)
    assert (drawn["ball"], drawn["box"]) == (2 * capsules, boxes)
    assert drawn["cylinder"] == len(shown) - boxes
    assert boxes + capsules > 0
    box = next(geom for geom in shown if model.geom_type[geom] == mujoco.mjtGeom.mjGEOM_BOX) if boxes else None
    if box is not None:
        assert any(np.allclose(part.size, 2.0 * model.geom_size[box]) for part in parts if part.shape == "box")
    ball = next((k for k, part in enumerate(parts) if part.shape == "ball"), None)
    if ball is not None:
        first, second, whole = parts[ball], parts[ball + 1], parts[ball - 1]
        assert np.linalg.norm(first.position - second.position) == pytest.approx(whole.size[2])
        np.testing.assert_allclose((first.position + second.position) / 2.0, whole.position)
