"""3D scene of the page: links of the model, cables, and bones of the commanded posture."""

import math
from collections.abc import Iterable
from typing import Any

import numpy as np
import viser
from numpy.typing import NDArray

from aero.actuation.window import COUNTS_PER_TURN
from aero.channels import Channel
from aero.floats import Floats
from aero.side import Side
from simulator.appearance import CABLE_WIDTH
from simulator.drawn_parts import DrawnPart, PosedHand
from simulator.geometry.winding import SPOOL_RADIUS

Rgb = tuple[int, int, int]
TAUT, SLACK, UNSEEN, OTHER, COMMANDED = (214, 69, 32), (38, 110, 214), (120, 120, 128), (196, 190, 176), (140, 60, 200)
"""Colours of: taut cable, slack cable, cable of unknown tension, springs and couplings, commanded posture. Red and
blue are distinguishable for the colour-blind."""
JUST_LOOSE_M = 2.0 * math.pi * SPOOL_RADIUS / COUNTS_PER_TURN
"""Threshold of cable slack, m; above it the cable is drawn slack. Source: one encoder count on the spool, 14 µm."""
CABLE_M = 3.0 * CABLE_WIDTH
"""Drawn diameter of a cable, m: 1.5 times that in pictures of the model."""
CABLE_POINTS = 16
"""Number of points of every padded cable path, two per pulley; constant, as the number of segments must be."""
STILL_M = 1e-5
"""Threshold of cable motion, m; below it no update is sent."""
COMMANDED_OPACITY, PAD_OPACITY = 0.45, 0.22
"""Opacity of the commanded bones, and of the pads above the cables."""
COMMANDED_THICKNESS = 0.8
"""Relative thickness of a commanded bone, which is hidden inside the true bone if both postures agree."""
UP, FIELD_OF_VIEW_RAD = (1.0, 0.0, 0.0), 0.62
WIDE = np.array([(0.05, -0.24, 0.40), (0.088, -0.018, 0.0)])
"""Camera position and target on a landscape page, m: above the palm of a right hand, thumb side, fingers up."""
NARROW = np.array([(-0.04, -0.37, 0.72), (-0.04, -0.018, 0.0)])
"""Camera position and target on a portrait page, m; viser covers its lower 60 % with the panel."""


def cable_colour(loose_m: float) -> Rgb:
    """Return the colour of a cable by its slack, m (NaN: unknown)."""
    if math.isnan(loose_m):
        return UNSEEN
    return SLACK if loose_m >= JUST_LOOSE_M else TAUT


class DrawnHand:
    """Hand on the page, overlaid with the bones of the commanded posture."""

    def __init__(self, server: viser.ViserServer, side: Side) -> None:
        self._server, self._mirror = server, np.array([1.0, 1.0 if side == "right" else -1.0, 1.0])
        self._hand, self._commanded = PosedHand(side), PosedHand(side)
        server.scene.set_up_direction(UP)
        camera = server.initial_camera
        camera.position, camera.look_at = WIDE * self._mirror
        camera.up, camera.fov = UP, FIELD_OF_VIEW_RAD
        server.on_client_connect(self._make_room)
        self._links = self._draw("hand", self._hand)
        self._bones = self._draw("commanded", self._commanded, only_bones=True)
        points, colours = self._cable_pieces(np.full(len(Channel), np.nan))
        self._cables = server.scene.add_line_segments("/cables", points, colours, thickness=CABLE_M)

    def pose(self, joints: Floats, commanded: Floats, loose: Floats) -> None:
        """Show the posture, (16,) rad, the commanded posture, (16,) rad or NaN, and the slack, (7,) m or NaN."""
        known = bool(np.isfinite(commanded).all())
        self._hand.pose(joints)
        if known:
            self._commanded.pose(commanded)
        with self._server.atomic():
            for links, posed in ((self._links, self._hand), (self._bones, self._commanded)):
                for body, position, quaternion in posed.frames():
                    if body in links:
                        links[body].position, links[body].wxyz = position, quaternion
            for bone in self._bones.values():
                bone.visible = known
            points, colours = self._cable_pieces(loose)
            if not np.allclose(points, self._cables.points, atol=STILL_M):
                self._cables.points = points
            if not np.array_equal(colours, self._cables.colors):
                self._cables.colors = colours

    def _make_room(self, client: viser.ClientHandle) -> None:
        if client.camera.aspect < 1.0:
            client.camera.position, client.camera.look_at = NARROW * self._mirror

    def _draw(self, root: str, posed: PosedHand, *, only_bones: bool = False) -> dict[str, viser.FrameHandle]:
        """Draw a hand with one frame a body, and return the frames by body."""
        parts = [part for part in posed.parts() if part.is_bone or not only_bones]
        names = dict.fromkeys(part.body for part in parts)
        frames = {body: self._server.scene.add_frame(f"/{root}/{body}", show_axes=False) for body in names}
        for number, part in enumerate(parts):
            self._draw_part(f"/{root}/{part.body}/{number}", part, commanded=only_bones)
        return frames

    def _draw_part(self, name: str, part: DrawnPart, *, commanded: bool) -> None:
        (red, green, blue, alpha), size = np.array(part.rgba), part.size
        look: dict[str, Any] = {
            "color": COMMANDED if commanded else np.array([red, green, blue]),
            "opacity": COMMANDED_OPACITY if commanded else None if alpha == 1.0 else PAD_OPACITY,
            "position": part.position,
            "wxyz": part.quaternion,
            "cast_shadow": False,
            "receive_shadow": False,
        }
        radius = size[0] / 2.0 * (COMMANDED_THICKNESS if commanded else 1.0)
        if part.shape == "box":
            self._server.scene.add_box(name, dimensions=size, **look)
        elif part.shape == "cylinder":
            self._server.scene.add_cylinder(name, radius, size[2], radial_segments=24, **look)
        else:
            self._server.scene.add_icosphere(name, radius, subdivisions=2, **look)

    def _cable_pieces(self, loose: Floats) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
        """Return the line segments of all cables and springs, (n, 2, 3) m, and their colours, (n, 2, 3)."""
        points, colours = [], []
        for channel, path in self._hand.paths():
            filled = np.pad(path, ((0, CABLE_POINTS - len(path)), (0, 0)), mode="edge")
            points.append(np.stack([filled[:-1], filled[1:]], axis=1))
            colour = _linear(OTHER if channel is None else cable_colour(loose[channel]))
            colours.append(np.broadcast_to(colour, points[-1].shape))
        return np.concatenate(points).astype(np.float32), np.concatenate(colours).astype(np.uint8)


def _linear(colour: Iterable[int]) -> list[float]:
    """Return a colour as linear light, 0 to 255, as viser 1.1 interprets the colours of line segments."""
    return [255.0 * (value / 255.0) ** 2.2 for value in colour]
