"""How time is cut up."""

DT = 0.01  # s: physics and control
SUBSTEPS = 5  # physics steps a tick
TICK = DT * SUBSTEPS  # s: collision, sensing, weather and outcome
