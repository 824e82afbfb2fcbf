"""Simulator of the hand, as the paper trains on it: geometry as data, the routed hand, its scenes and its drawing."""

from simulator.routed import RoutedHand, build_routed

__all__ = ["RoutedHand", "build_routed"]
