"""MuJoCo model of the built hand, which stands for a physical one, and its units."""

from model.built import build_built
from model.parameters import BuiltHandParameters
from model.plant import BuiltHandPlant

__all__ = ["BuiltHandParameters", "BuiltHandPlant", "build_built"]
