"""The paper's dynamic validation: simulator and hand on one staircase, and every number that is read off it."""
