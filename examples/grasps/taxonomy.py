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
    Grasp(1, "large diameter", "power", Thing("cylinder", (70, 120), 0.3), (140, 10, -10), Y, (.8, .8, .8, .8, 1, .6, .5), ALL),
    Grasp(2, "small diameter", "power", Thing("cylinder", (25, 120), 0.15), (128, 10, -32), Y, (1, 1, 1, 1, 1, .8, .8), ALL),
    Grasp(3, "medium wrap", "power", Thing("cylinder", (50, 120), 0.25), (135, 10, -20), Y, (1, 1, 1, 1, 1, .6, .6), ALL),
    Grasp(4, "adducted thumb", "power", Thing("cylinder", (25, 120), 0.15), (128, 10, -32), Y, (1, 1, 1, 1, .3, .2, .1), ALL),
    Grasp(5, "light tool", "power", Thing("cylinder", (15, 120), 0.08), (128, 10, -36), Y, (1, 1, 1, 1, .6, .6, .6), ALL),
    Grasp(6, "prismatic 4 finger", "precision", Thing("cylinder", (20, 100), 0.05), (148, 8, -22), Y, (.75, .75, .75, .75, .6, .95, .3), ALL),
    Grasp(7, "prismatic 3 finger", "precision", Thing("cylinder", (20, 80), 0.04), (150, -5, -24), Y, (.72, .72, .72, .2, .4, .95, .3), ("index", "middle", "ring", "thumb"), (I, M, R, C, F)),
    Grasp(8, "prismatic 2 finger", "precision", Thing("cylinder", (20, 60), 0.03), (155, -16, -28), Y, (.65, .65, .1, .1, .3, .97, .25), THREE, (I, M, C, F)),
    Grasp(9, "palmar pinch", "precision", Thing("box", (20, 20, 10), 0.02), (149, -24, -30), (-.2, .6, .8), (.78, 0, 0, 0, .22, .95, .3), ("index", "thumb"), (I, C, F)),
    Grasp(10, "power disk", "power", Thing("cylinder", (80, 25), 0.15), (140, 10, -25), Z, (.8, .8, .8, .8, .7, .6, .5), ALL),
    Grasp(11, "power sphere", "power", Thing("sphere", (65,), 0.15), (140, 5, -12), Z, (.9, .9, .9, .9, .9, .6, .6), ALL),
    Grasp(12, "precision disk", "precision", Thing("cylinder", (65, 15), 0.08), (170, 8, -12), (.6, 0, .8), (.42, .42, .42, .42, .8, .85, .1), ALL),
    Grasp(13, "precision sphere", "precision", Thing("sphere", (60,), 0.06), (170, 8, -12), Z, (.42, .42, .42, .42, .8, .85, .1), ALL),
    Grasp(14, "tripod", "precision", Thing("sphere", (30,), 0.03), (166, -22, -23), Z, (.56, .56, 0, 0, .36, .97, .12), THREE, (I, M, C, F)),
    Grasp(15, "fixed hook", "power", Thing("cylinder", (20, 120), 0.3), (155, 10, -55), Y, (.9, .9, .9, .9, 0, 0, 0), ALL[:4], (I, M, R, P)),
    Grasp(16, "lateral", "intermediate", Thing("box", (50, 30, 3), 0.02), (150, -35, -45), (0, 1, .3), (.75, .75, .75, .75, .2, .6, .5), ("index", "thumb"), (C, F)),
    Grasp(17, "index finger extension", "power", Thing("cylinder", (20, 120), 0.1), (128, 20, -34), Y, (.2, 1, 1, 1, .8, .8, .6), ALL[1:], (M, R, P, C, F)),
    Grasp(18, "extension type", "power", Thing("box", (80, 100, 15), 0.1), (160, 10, -40), Z, (.4, .4, .4, .4, .9, .6, .2), ALL),
    Grasp(19, "distal type", "power", Thing("cylinder", (20, 120), 0.1), (150, 10, -40), Y, (.9, .9, .9, .9, .9, .6, .5), ALL),
    Grasp(20, "writing tripod", "precision", Thing("cylinder", (10, 130), 0.015), (147, -22, -25), (-.5, -.3, 1), (.72, .72, .9, .9, .25, .92, .3), THREE, (I, M, C, F)),
    Grasp(21, "tripod variation", "intermediate", Thing("cylinder", (10, 130), 0.015), (147, -22, -25), (.3, -.5, 1), (.72, .78, .9, .9, .25, .92, .3), THREE, (I, M, C, F)),
    Grasp(22, "parallel extension", "precision", Thing("box", (60, 80, 40), 0.08), (170, 10, -20), (.7, .3, -.6), (.4, .4, .4, .4, .6, .8, .1), ALL),
    Grasp(23, "adduction grip", "intermediate", Thing("cylinder", (12, 60), 0.01), (190, -12, -75), Z, (.15, .15, 0, 0, 0, 0, 0), ("index", "middle"), (I, M)),
    Grasp(24, "tip pinch", "precision", Thing("sphere", (12,), 0.01), (147, -23, -33), Z, (.75, 0, 0, 0, .22, .92, .3), ("index", "thumb"), (I, C, F)),
    Grasp(25, "lateral tripod", "intermediate", Thing("cylinder", (20, 60), 0.03), (143, -22, -33), (0, .3, 1), (.75, .8, .9, .9, .22, .92, .35), THREE, (I, M, C, F)),
    Grasp(26, "sphere 4 finger", "power", Thing("sphere", (60,), 0.1), (150, 2, -10), Z, (.7, .7, .7, 0, .9, .7, .3), ("index", "middle", "ring", "thumb"), (I, M, R, C, F)),
    Grasp(27, "quadpod", "precision", Thing("sphere", (40,), 0.03), (168, -8, -18), Z, (.5, .5, .5, 0, .6, .9, .15), ("index", "middle", "ring", "thumb"), (I, M, R, C, F)),
    Grasp(28, "sphere 3 finger", "power", Thing("sphere", (55,), 0.1), (150, -10, -12), Z, (.7, .7, 0, 0, .8, .7, .3), THREE, (I, M, C, F)),
    Grasp(29, "stick", "intermediate", Thing("cylinder", (12, 150), 0.03), (145, 10, -38), (.2, 1, .1), (.9, .9, .9, .9, .3, .6, .4), ("index", "middle", "thumb")),
    Grasp(30, "palmar", "power", Thing("box", (70, 70, 12), 0.05), (125, 10, -36), Z, (.8, .8, .8, .8, 0, 0, 0), ("index", "middle", "ring", "pinky", "palm"), (I, M, R, P)),
    Grasp(31, "ring", "power", Thing("cylinder", (45, 80), 0.1), (140, -20, -15), Y, (.85, 0, 0, 0, .8, .6, .6), ("index", "thumb"), (I, C, F)),
    Grasp(32, "ventral", "intermediate", Thing("cylinder", (20, 140), 0.08), (130, 0, -35), (.3, 1, 0), (1, 1, 1, 1, .3, .8, .6), ("middle", "ring", "pinky", "thumb")),
    Grasp(33, "inferior pincer", "precision", Thing("sphere", (25,), 0.02), (165, -30, -26), Z, (.56, 0, 0, 0, .28, .92, .15), ("index", "thumb"), (I, C, F)),
)
# fmt: on
"""In the taxonomy's order."""
