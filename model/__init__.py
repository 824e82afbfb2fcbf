"""The hand as a MuJoCo model: geometry as data, the routed hand and the built hand."""

from model.routed import build_routed
from model.routed_hand import RoutedHand

__all__ = ["RoutedHand", "build_routed"]
