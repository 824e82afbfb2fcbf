"""The 33 grasps of the GRASP taxonomy (Feix et al. 2016) for this hand. Masses are assumed."""

from __future__ import annotations

from aero.channels import Channel
from examples.grasps.grasp import Grasp
from examples.grasps.object_plant import HeldObject as Thing

I, M, R, P, A, C, F = Channel
X, Y, Z = (1, 0, 0), (0, 1, 0), (0, 0, 1)
ALL = ("index", "middle", "ring", "pinky", "thumb")
THREE = ("index", "middle", "thumb")

# fmt: off
GRASPS = (
    Grasp(1, "large diameter", "power", Thing("cylinder", (70, 120), 0.3), (135, 11, -16), (0, 0.96, 0.26), (0.84, 0.72, 0.77, 0.82, 1, 0.49, 0.62), ALL),
    Grasp(2, "small diameter", "power", Thing("cylinder", (25, 120), 0.15), (126, 9, -30), (-0.01, 1, 0.05), (1, 1, 1, 1, 1, 0.75, 0.8), ALL),
    Grasp(3, "medium wrap", "power", Thing("cylinder", (50, 120), 0.25), (135, 10, -20), Y, (1, 1, 1, 1, 1, 0.6, 0.6), ALL),
    Grasp(4, "adducted thumb", "power", Thing("cylinder", (25, 120), 0.15), (125, -10, -34), Y, (1, 1, 1, 1, 0.25, 0.9, 0.35), ALL),
    Grasp(5, "light tool", "power", Thing("cylinder", (15, 120), 0.08), (129, 9, -41), (0.03, 0.98, -0.19), (0.97, 0.88, 0.98, 0.96, 0.6, 0.6, 0.73), ALL),
    Grasp(6, "prismatic 4 finger", "precision", Thing("cylinder", (20, 100), 0.05), (150, 9, 12), (-0.21, 0.98, 0.02), (0.52, 0.52, 0.52, 0.52, 0.9, 0.7, 0.09), ALL),
    Grasp(7, "prismatic 3 finger", "precision", Thing("cylinder", (20, 80), 0.04), (152, 0, 11), Y, (0.52, 0.52, 0.52, 0, 0.84, 0.68, 0.11), ("index", "middle", "ring", "thumb"), (I, M, R, C, F)),
    Grasp(8, "prismatic 2 finger", "precision", Thing("cylinder", (20, 60), 0.03), (155, -11, 10), Y, (0.5, 0.5, 0, 0, 0.75, 0.66, 0.11), THREE, (I, M, C, F)),
    Grasp(9, "palmar pinch", "precision", Thing("box", (20, 20, 10), 0.02), (156, -20, 8), (0.7, 0.2, -0.7), (0.51, 0, 0, 0, 0.67, 0.66, 0.09), ("index", "thumb"), (I, C, F)),
    Grasp(10, "power disk", "power", Thing("cylinder", (80, 25), 0.15), (129, 1, -32), (0.12, 0.26, 0.96), (1, 0.93, 0.95, 0.91, 0.86, 0.76, 0.56), ALL),
    Grasp(11, "power sphere", "power", Thing("sphere", (65,), 0.15), (145, 7, 0), Z, (0.67, 0.92, 0.8, 0.6, 0.96, 0.68, 0.59), ALL),
    Grasp(12, "precision disk", "precision", Thing("cylinder", (65, 15), 0.08), (152, 3, 18), (0.7, 0, 0.7), (0.46, 0.46, 0.46, 0.46, 0.9, 0.17, 0.2), ALL),
    Grasp(13, "precision sphere", "precision", Thing("sphere", (60,), 0.06), (152, 3, 18), Z, (0.46, 0.46, 0.46, 0.46, 0.9, 0.17, 0.2), ALL),
    Grasp(14, "tripod", "precision", Thing("sphere", (30,), 0.03), (152, -9, 15), Z, (0.5, 0.5, 0, 0, 0.82, 0.49, 0.14), THREE, (I, M, C, F)),
    Grasp(15, "fixed hook", "power", Thing("cylinder", (20, 120), 0.3), (155, 10, -55), Y, (0.9, 0.9, 0.9, 0.9, 0, 0, 0), ALL[:4], (I, M, R, P)),
    Grasp(16, "lateral", "intermediate", Thing("box", (50, 30, 3), 0.02), (148, -30, -37), (-0.25, 0.95, 0.16), (0.65, 0.63, 0.65, 0.65, 0.17, 0.53, 0.59), ("index", "thumb"), (C, F)),
    Grasp(17, "index finger extension", "power", Thing("cylinder", (20, 120), 0.1), (137, 22, -38), Y, (0.31, 1, 0.99, 0.9, 0.84, 0.77, 0.59), ALL[1:], (M, R, P, C, F)),
    Grasp(18, "extension type", "power", Thing("box", (80, 100, 20), 0.1), (150, 9, 14), (0.7, 0.2, -0.7), (0.5, 0.5, 0.5, 0.5, 0.92, 0.66, 0.09), ALL),
    Grasp(19, "distal type", "power", Thing("cylinder", (20, 120), 0.1), (146, 16, -40), Y, (0.8, 0.84, 0.86, 0.87, 0.83, 0.6, 0.48), ALL),
    Grasp(20, "writing tripod", "precision", Thing("cylinder", (10, 130), 0.015), (172, -11, 25), (0.6, 0, 0.7), (0.5, 0.5, 0.9, 0.9, 0.73, 0.76, 0.06), THREE, (I, M, C, F)),
    Grasp(21, "tripod variation", "intermediate", Thing("cylinder", (10, 130), 0.015), (165, -18, 18), (0.6, -0.5, 0.6), (0.5, 0.5, 0.9, 0.9, 0.7, 0.76, 0.06), THREE, (I, M, C, F)),
    Grasp(22, "parallel extension", "precision", Thing("box", (60, 60, 15), 0.08), (155, 9, 14), (0.7, 0.2, -0.7), (0.5, 0.5, 0.5, 0.5, 0.92, 0.66, 0.09), ALL),
    Grasp(23, "adduction grip", "intermediate", Thing("cylinder", (12, 60), 0.01), (190, -12, -75), Z, (.15, .15, 0, 0, 0, 0, 0), ("index", "middle"), (I, M)),
    Grasp(24, "tip pinch", "precision", Thing("sphere", (12,), 0.01), (156, -20, 8), Z, (0.51, 0, 0, 0, 0.67, 0.75, 0.07), ("index", "thumb"), (I, C, F)),
    Grasp(25, "lateral tripod", "intermediate", Thing("cylinder", (20, 60), 0.03), (155, -15, 12), (0.4, -0.6, 0.6), (0.5, 0.5, 0.9, 0.9, 0.7, 0.61, 0.09), THREE, (I, M, C, F)),
    Grasp(26, "sphere 4 finger", "power", Thing("sphere", (60,), 0.1), (155, 1, 12), Z, (0.48, 0.48, 0.48, 0, 0.9, 0.36, 0.16), ("index", "middle", "ring", "thumb"), (I, M, R, C, F)),
    Grasp(27, "quadpod", "precision", Thing("sphere", (40,), 0.03), (152, 1, 15), Z, (0.48, 0.48, 0.48, 0, 0.9, 0.41, 0.19), ("index", "middle", "ring", "thumb"), (I, M, R, C, F)),
    Grasp(28, "sphere 3 finger", "power", Thing("sphere", (55,), 0.1), (160, -15, 13), Z, (0.44, 0.44, 0, 0, 0.76, 0.48, 0.09), THREE, (I, M, C, F)),
    Grasp(29, "stick", "intermediate", Thing("cylinder", (12, 150), 0.03), (145, 10, -38), (.2, 1, .1), (.9, .9, .9, .9, .3, .6, .4), ("index", "middle", "thumb")),
    Grasp(30, "palmar", "power", Thing("box", (60, 70, 12), 0.05), (118, 10, -38), Z, (0.75, 0.75, 0.75, 0.75, 0, 0, 0), ("index", "middle", "ring", "pinky", "palm"), (I, M, R, P)),
    Grasp(31, "ring", "power", Thing("cylinder", (45, 80), 0.1), (140, -20, -15), Y, (.85, 0, 0, 0, .8, .6, .6), ("index", "thumb"), (I, C, F)),
    Grasp(32, "ventral", "intermediate", Thing("cylinder", (20, 140), 0.08), (130, 0, -35), (.3, 1, 0), (1, 1, 1, 1, .3, .8, .6), ("middle", "ring", "pinky", "thumb")),
    Grasp(33, "inferior pincer", "precision", Thing("sphere", (25,), 0.02), (157, -23, 10), Z, (0.49, 0, 0, 0, 0.68, 0.53, 0.15), ("index", "thumb"), (I, C, F)),
)
# fmt: on
"""In the taxonomy's order."""
