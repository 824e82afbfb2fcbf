"""The policy that ships, and a sample of its network and of its training."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from aero.policy.network import Network
from aero.policy.shipped import DEFAULT, find_policy
from figures.inputs import ROOT
from figures.results import Rows, Shipped
from figures.sample_text import numbers
from train.cli.train import train

START = ROOT / "docs" / "training" / "steady_start.npz"
FORWARD_PASSES = 20


def actions_and_updates() -> Rows:
    """Actions of the shipped network at random observations, and the networks after two updates of its recipe."""
    random, network = np.random.default_rng(0), find_policy(DEFAULT).network
    assert isinstance(network, Network)
    observations = network.mean + network.std * random.standard_normal((FORWARD_PASSES, network.mean.size))
    actions = [network.act(one.astype(np.float32)) for one in observations]
    rows = [[f"action {place}", numbers(action)] for place, action in enumerate(actions)]
    return [("what", "numbers"), *rows, *_training()]


def _training() -> list[list[str]]:
    # Needs the extra `train`, without which this module is imported too.
    from train.recipe import STEADY  # noqa: PLC0415
    from train.run_state import CHECKPOINTS, read_curve  # noqa: PLC0415
    from train.trainer import train as trained  # noqa: PLC0415

    last = replace(STEADY.stages[-1], unroll=5, steps=80, measured=2, frozen_updates=0)
    tiny = replace(STEADY, environments=8, minibatches=2, epochs=1, stages=(last,), checkpoint_steps=80)
    with TemporaryDirectory() as folder:
        trained(tiny, "native", 1, Path(folder), threads=1, parameters=START)
        (curve,) = read_curve(Path(folder))
        (path,) = (Path(folder) / CHECKPOINTS).glob("0_*.npz")
        with np.load(path) as arrays:
            norms = {name: float(np.linalg.norm(arrays[name])) for name in arrays.files}
    rows = [[f"norm of array {name}", numbers([norm], 3)] for name, norm in norms.items()]
    return [["checkpoint", numbers([curve.rate_rad_s, curve.rotation_rad, curve.hazard_per_s], 3)], *rows]


def make() -> None:
    """Train the last stage with seed 1, half an hour of two free cores."""
    from train.run_state import CURVE, PICTURE  # noqa: PLC0415

    folder = ROOT / "build" / "steady"
    train(["steady", "--seed", "1", "--from", str(START), "--units", "60", "--out", str(folder)], standalone_mode=False)
    shutil.copy(folder / "steady.npz", ROOT / "aero" / "policy" / "shipped" / "steady.npz")
    for name in (CURVE, PICTURE):
        shutil.copy(folder / name, START.with_name(f"steady_seed1{Path(name).suffix}"))


SHIPPED = {
    "steady": Shipped(
        (
            "aero/policy/shipped/steady.npz",
            "docs/training/steady_seed1.csv",
            "docs/training/steady_seed1.png",
        ),
        ("train.cli.train", "train.trainer", "train.selection"),
        actions_and_updates,
        make,
    )
}
