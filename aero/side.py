"""Side of a hand."""

from typing import Literal

Side = Literal["right", "left"]
