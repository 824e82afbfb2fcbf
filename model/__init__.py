"""MuJoCo models of the hand: geometry as data, the routed hand and the built hand."""

from model.built import build_built
from model.parameters import BuiltHandParameters
from model.plant import BuiltHandPlant
from model.routed import RoutedHand, build_routed

__all__ = ["BuiltHandParameters", "BuiltHandPlant", "RoutedHand", "build_built", "build_routed"]
