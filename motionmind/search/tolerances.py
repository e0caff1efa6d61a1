"""Tolerances for comparing costs: each is far above the errors that it covers, and far below the next one."""

SAME_COST_NATS = 1e-9  # sums of the same costs in another order differ by far less
ROUNDING_NATS = 1e-8  # covers the rounding of a path's cost and of its bound
OPTIMAL_WITHIN_NATS = 1e-6  # a path within this of its lower bound is reported as optimal
