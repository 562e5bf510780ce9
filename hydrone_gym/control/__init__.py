"""Control: from state, reference and memory to four rotor speeds, every 10 ms.

`reference` holds what a law looks at (an instant, a moving reference) and its memory; `law` says what a law is, applies
the rotor limits and stops the memory from winding up; `paper` is the paper's law (eqs. 5-8, 13-16), `robust` the second
one, with its `approach` to rest and to the surface and its `mixing` of rotors; `laws` lists the laws there are;
`envelope` is what a law publishes of itself, which is all that anybody else reads. Inside the transition zone laws hold
still laterally (vertical mode). Gains live in `hydrone_gym.vehicle`; docs/deviations.md says where the paper's law
leaves the paper.
"""
