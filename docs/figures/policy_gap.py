"""What lies between a policy's rate in process and its rate through the bytes: the path, or the hands?

`python -m figures.policy_gap` runs the shipped policy with the same cubes on hands of the healthy population, in
process and through every byte, then in process on hands as `HandRanges` draws them, and then on healthy ones of which
one number is as drawn. What a row gains over the first is what the policy loses by that number of healthy hands.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import click
import numpy as np

from aero.policy.shipped import DEFAULT, find_policy
from model.units import Unit
from train.actuation import BUS
from train.built import BuiltSimulator, build_scene
from train.evaluation.cube_trial import CubeTrial
from train.evaluation.rollouts import run, task_of
from train.evaluation.trials import ANY_CUBE, over_hands, run_trials
from train.hands import HANDS, corrections, draw_hand
from train.recipe import AS_PLACED

SEED, SECONDS = 62_000_000, 15.0
NUMBERS = (
    ("spring_open", "spring_closed"),
    ("joint_damping",),
    ("joint_friction",),
    ("spool_friction",),
    ("cable_friction",),
    ("cable_take_up",),
    ("rotor_inertia", "back_emf"),
    ("abduction_winding",),
    ("closed_stop",),
    ("thenar_radius",),
)


@click.command()
@click.option("--hands", default=60, show_default=True)
def main(*, hands: int) -> None:
    """Print a line for each kind of hand: kept, mean rate and its standard error, rad/s."""
    policy = find_policy(DEFAULT)
    task = replace(task_of(policy), actuation=BUS, reset=AS_PLACED)
    cases = over_hands(policy, hands, seconds=SECONDS, seed=SEED)
    healthy = [case.unit for case in cases]
    drawn = [draw_hand(HANDS, np.random.default_rng((SEED + k, 1))) for k in range(hands)]

    def in_process(name: str, units: Sequence[Unit]) -> None:
        limit, cubes = policy.settings.torque_limit, [case.surroundings.cube for case in cases]
        scenes = [build_scene(unit, limit, cube) for unit, cube in zip(units, cubes, strict=True)]
        known = corrections(units, policy.settings, np.random.default_rng(0))
        with BuiltSimulator(scenes, known) as batch:
            episodes = run(policy, task, batch, SECONDS, seed=1)
        say(name, episodes.kept, episodes.rate_rad_s)

    in_process("healthy, in process", healthy)
    made: dict[str, list[CubeTrial]] = {}
    run_trials(policy, cases, made, lambda _share, _name: None)
    say("healthy, through the bytes", [t.kept for t in made[ANY_CUBE]], [t.rate_rad_s for t in made[ANY_CUBE]])
    in_process("drawn, in process", drawn)
    for names in NUMBERS:
        swapped = [
            replace(one, hand=replace(one.hand, **{name: getattr(other.hand, name) for name in names}))
            for one, other in zip(healthy, drawn, strict=True)
        ]
        in_process(f"healthy, drawn {' and '.join(names)}", swapped)


def say(name: str, kept: Sequence[bool] | np.ndarray, rates_rad_s: Sequence[float] | np.ndarray) -> None:
    """Print one line."""
    error = np.std(rates_rad_s, ddof=1) / np.sqrt(len(rates_rad_s))
    click.echo(f"{name:45} keeps {np.mean(kept):4.0%}  {np.mean(rates_rad_s):.2f} +- {error:.2f} rad/s")


if __name__ == "__main__":
    main()
