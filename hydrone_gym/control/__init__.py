"""The paper's control laws: from state, reference and memory to four rotor speeds, every 10 ms.

`reference` holds what a law tracks (a moving point and a heading) and the controller's memory; `air` holds altitude,
attitude and position (eqs. 5-8), with commanded velocity limited so that any reference is safe to send; `water` holds
depth, pitch, heading and surge (eqs. 13-16), mixed in newtons, with driving both ways and holding still; `law` picks
the medium's law, applies the rotor limits and stops the memory from winding up. Inside the transition zone both laws
hold still laterally (vertical mode). Gains live in `hydrone_gym.vehicle`; docs/deviations.md says where the laws leave
the paper.
"""
