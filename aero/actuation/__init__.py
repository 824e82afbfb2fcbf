"""Actuation map: conversion of simulator lengths and postures to position codes and back (paper, chapter 4)."""

from aero.actuation.coefficients import Coefficients, load_coefficients
from aero.actuation.map import ActuationMap, SaturatedCodes
from aero.actuation.window import CALIBRATIONS, UNSHIFTED, CommandWindow

__all__ = [
    "CALIBRATIONS",
    "UNSHIFTED",
    "ActuationMap",
    "Coefficients",
    "CommandWindow",
    "SaturatedCodes",
    "load_coefficients",
]
