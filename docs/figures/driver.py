"""Tables of docs/driver.md, from runs of a million readings."""

from __future__ import annotations

from figures.stored import plain, stored

TABLES = {"faults": stored("link_faults", plain), "schedules": stored("link_out_of_step", plain)}
