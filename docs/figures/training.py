"""Tables of docs/training.md."""

from __future__ import annotations

from aero.policy.shipped import find_policy
from figures.cells import Cell, Tolerance
from figures.sources import Cost, Row, Source
from figures.stored import plain, stored
from hil.lab.policies.byte_evaluation import run_trials
from hil.lab.policies.cube_trial import CubeTrial
from hil.lab.policies.deployment import load_deployments
from hil.lab.policies.prediction import Prediction, of_trials

POLICIES = ("steady", "fast")
SEED, TRIALS, SECONDS = 70000, 20, 15.0
SEEDED_CONTACTS = Tolerance(
    "the same seed gives the same bytes; with another MuJoCo contacts go another way, so only the order is kept",
    last_place=0.1,
    other_physics=1.0,
)


def predictions() -> list[Row]:
    """How the shipped policies would turn the paper's cube, by deployment, with intervals of 95 %."""
    heads = (head for name in POLICIES for head in (f"`{name}` keeps, %", f"`{name}`, rad/s"))
    rows: list[Row] = [("deployment", *heads)]
    for name in load_deployments():
        rows.append((f"`{name}`", *(cell for policy in POLICIES for cell in _cells(predict(policy, name)))))
    return rows


def predict(policy_name: str, deployment_name: str) -> Prediction:
    """Run the trials through the bytes that `aero-hil predict POLICY --as DEPLOYMENT --seed 70000` runs."""
    policy, made = find_policy(policy_name), dict[str, list[CubeTrial]]()
    cases = load_deployments()[deployment_name].cases(policy, TRIALS, seconds=SECONDS, seed=SEED)
    run_trials(policy, cases, made, lambda _done, _name: None)
    return of_trials(deployment_name, [trial for trials in made.values() for trial in trials], SEED)


def _cells(found: Prediction) -> tuple[Cell, Cell]:
    kept = (100.0 * value for value in (found.kept / found.trials, *found.kept_interval))
    return (
        Cell.of("{:.0f} ({:.0f} to {:.0f})", *kept),
        Cell.of("{:.2f} ({:.2f} to {:.2f})", found.rate_rad_s, *found.rate_interval),
    )


PREDICT = f"`aero-hil predict POLICY --as DEPLOYMENT --seed {SEED}`"
TABLES = {
    "predictions": Source(predictions, PREDICT, SEEDED_CONTACTS, Cost.SLOW),
    "shipped": stored("shipped_policies", plain),
    "cubes": stored("drawn_cubes", plain),
    "bytes": stored("steady_by_bytes", plain),
    "lost": stored("lost_cube", plain),
}
