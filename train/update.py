"""One update of a run: act for an unroll in every environment, learn from it, and let the price of a drop follow."""

from __future__ import annotations

from dataclasses import replace

import jax
import numpy as np

from train.environment import Prices
from train.ppo import averaged, batched
from train.run_state import Standing
from train.stage_run import Reached, StageRun, StopCheck


def updated(prepared: StageRun, standing: Standing, reached: Reached, check: StopCheck) -> tuple[Standing, Reached]:
    """Return where a run stands after one more update.

    Nothing that goes in is changed, so that a run which `check` ends in the middle has still reached what it had.
    """
    stage, ppo = prepared.stage, prepared.ppo
    learner, environment = reached
    if stage.redraw and standing.updates and standing.updates % stage.redraw.every == 0:
        environment = prepared.renew(environment, standing.new_hands, stage.redraw.hands)
        standing = replace(standing, new_hands=standing.new_hands + stage.redraw.hands)
    done = standing.updates * prepared.batch
    weights = stage.rewarded.weights
    fall = weights.fall if standing.drop_price is None else -standing.drop_price
    action_rate = stage.action_rate.at(done) if stage.action_rate else weights.action_rate
    prices = Prices(np.float32(fall), np.float32(action_rate))
    key = jax.random.fold_in(prepared.key, standing.updates)
    steps, means = [], []
    for k in range(stage.unroll):
        check()
        environment, (step, *of_batch) = ppo.act(learner, environment, prices, jax.random.fold_in(key, k))
        steps.append(step)
        means.append([float(mean) for mean in of_batch])
    data = batched(steps)
    learner = ppo.observe(learner, data)
    entropy_cost = np.float32(stage.entropy_cost.at(done))
    for k in range(ppo.epochs):
        check()
        learner = ppo.learn(learner, data, jax.random.fold_in(key, stage.unroll + k), entropy_cost)
    rate_rad_s, lost = np.mean(means, axis=0).tolist()
    tendency = standing.tendency.after(rate_rad_s, lost / prepared.period_s)
    price = standing.drop_price
    if stage.drop_price and price is not None:
        price = stage.drop_price.after(price, hazard_per_s=tendency.hazard_per_s, rate_rad_s=tendency.rate_rad_s)
    standing = replace(
        standing,
        steps=standing.steps + prepared.batch,
        updates=standing.updates + 1,
        tendency=tendency,
        drop_price=price,
    )
    return standing, Reached(averaged(learner), environment)
