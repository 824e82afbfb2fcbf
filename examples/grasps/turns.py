"""Search several grasps in turns, and keep the best posture of each in a folder, so that a later search goes on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

from model.units import Unit

from .grasp import Grasp
from .search import Found, search
from .store import read_grasps, write_grasps

ENOUGH = 0.8
"""A worth that is not bettered: on average the object moves by 5 mm."""
TURN = 400
"""Postures that are looked at for one grasp before the next has its turn."""


def search_in_turns(grasps: Sequence[Grasp], units: Sequence[Unit], folder: Path, seed: int = 0) -> Iterator[Found]:
    """Search until all are good enough; give the best so far of the grasp whose turn it is, after each generation.

    Args:
        grasps: where to begin, unless the folder has something better.
        units: hands on which a posture has to hold.
        folder: a file a grasp, `NN.toml`, written whenever something better is found.
        seed: of the search.
    """
    folder.mkdir(parents=True, exist_ok=True)
    searches = {grasp.number: search(kept(grasp, folder), units, seed) for grasp in grasps}
    while searches:
        for number, running in list(searches.items()):
            turn_ends, written = None, None
            for found in running:
                if found.worth != written and found.tries > 1:
                    write_grasps([replace(found.grasp, margin=round(found.worth, 3))], file_of(number, folder))
                    written = found.worth
                yield found
                turn_ends = turn_ends or found.tries + TURN
                if found.worth >= ENOUGH:
                    del searches[number]
                    break
                if found.tries >= turn_ends:
                    break


def file_of(number: int, folder: Path) -> Path:
    """Return the file of one grasp."""
    return folder / f"{number:02}.toml"


def kept(grasp: Grasp, folder: Path) -> Grasp:
    """Return what a search found for this grasp, or the grasp itself."""
    path = file_of(grasp.number, folder)
    return read_grasps(path)[0] if path.exists() else grasp
