"""The one kernel that advances one vehicle by one period, its storage, and its drivers.

`storage` declares what a vehicle, its episode and a block of lanes hold, and copies none of it by name; `advance` is
the kernel: reference ramp, control, dynamics and energy every 10 ms, collision, crossings and outcome every 50 ms,
compiled once for each law and number of lanes and called by its address; `rows` runs rows through it, one or sixteen
lanes at a time with equal bits; `simulation` is Python's handle on that and plays trajectories; `rollout` flies one
vehicle, or many, from a state against known obstacles, for whoever predicts; `outcome` names how an episode, a period
or a tree edge ended; `time_to_go` estimates the seconds left to a goal.
"""
