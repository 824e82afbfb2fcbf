"""The hand as a MuJoCo model: geometry as data, the routed hand and the built hand."""
