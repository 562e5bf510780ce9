"""The one kernel that advances one vehicle by one period, and its drivers.

`advance` is the kernel: reference ramp, control, dynamics and energy every 10 ms; collision, sensing, crossings and
outcome every 50 ms. `block` is its working storage, one lane a vehicle; `rows` stores vehicles plainly and runs them
through the kernel, one or sixteen lanes at a time with equal bits; `simulation` is Python's handle on it and plays
trajectories; `model` packs vehicle, gains and world into one array; `outcome` names how an episode, a period or a tree
edge ended; `time_to_go` estimates the seconds left to a goal.
"""
