"""The whole model: one rigid body with four rotors, in air or in water, switched abruptly at the surface z = 0.

Equation numbers in brackets are the paper's, counted through its text: (1)-(4) motion in air, (5)-(8) control in air,
(9)-(12) motion in water, (13)-(16) control in water. What is written here is what is built; where it differs from the
page, the mark E1 … E15 leads to the reason in docs/deviations.md.

State and frames
----------------
    x = [p, r, v, ω]      12 numbers
    p = (x, y, z)         position of the centre of mass, world frame                 m
    r = (φ, θ, ψ)         roll, pitch, yaw: Euler angles, order Z-X-Y                 rad
    v = (vx, vy, vz)      velocity, world frame                                       m/s
    ω = (p, q, r)         angular velocity, body frame                                rad/s
    Ω = (Ω₁ … Ω₄)         rotor speeds                                                rpm

World: x and y horizontal, z up, water at z ≤ 0.  Body: x forward, y left, z up.
Rotors sit on the arms 1: +x, 2: +y, 3: −x, 4: −y.  In water the moments are the printed ones, and a faster rotor 2
turns the vehicle left: aquatic thruster 2 is the starboard one.

    R(φ, θ, ψ) = Rz(ψ) Rx(φ) Ry(θ)      turns body vectors into world vectors

Medium
------
    ρ = 1.293 in air, 1000 in water                       density, kg/m³ (one value everywhere, E10)
    m' = m + ρ a_m          a_m = 6.441e-4 m³             mass with added mass, kg: 1.28683 and 1.9301
    J' = J + ρ a_J I        a_J = 1.174e-6 m⁵             inertia with added inertia, kg m²; diagonal only (E7)
    C = diag(C_u, C_v, C_w), N = diag(N_p, N_q, N_r)      drag per unit density, m² and m⁵ (E5, E6)

Both media
----------
    ṗ = v                                                                                       (1) (9)

    m' v̇ = − R ρ C (|v_b| ∘ v_b) − w e_z + R F,      v_b = Rᵀ v                                 (2) (10)

        Drag works along the body's axes on the velocity seen from the body, element by element (E1).
        No term ω × m v: that belongs to an equation in body axes (E2).
        w is the net weight, N:   air m g,   water (m − ρ V) g < 0: the vehicle floats (E15)

    φ̇ = p cos θ + r sin θ                                                                       (3) (11)
    ψ̇ = (r cos θ − p sin θ) / cos φ
    θ̇ = q − ψ̇ sin φ

        The printed matrix gives ω from the Euler rates; this is its inverse (E3). Singular at φ = ±90°.

    J' ω̇ = − ρ N (|ω| ∘ ω) − ω × J ω − G + M                                                    (4) (12)

        The added inertia is the same about every axis and drops out of the gyroscopic term.

Rotors
------
    f_i = ρ ζ Ω_i |Ω_i|       thrust, N: signed like the speed (E9)
                              ζ = 2.45e-7 in air, 1.6230e-9 m⁴/rpm² in water

    air:    F = [0, 0, f₁ + f₂ + f₃ + f₄]
            M = [l (f₂ − f₄), l (f₃ − f₁), l_ψ (f₁ − f₂ + f₃ − f₄)]                             (E4)
    water:  F = [f₂ + f₄, 0, f₁ + f₃]
            M = [0, l (f₃ − f₁), l (f₂ − f₄)]

        l = 0.27 m. l_ψ is l in the paper set, and 0.0125 m, the arm of a propeller's reaction torque, in the
        physical set.
        Limits, applied by the controller: 0 … 5500 rpm in air, ±2500 rpm in water.

Restoring moment, in water only
-------------------------------
    paper set:     G = c (m + ρ V) g [sin φ, sin θ, 0]
    physical set:  G = c ρ V g [sin φ, cos φ sin θ, 0]                                          (E14)

        c = 0.02 m lies between the centres of mass and of buoyancy.

Shaft power
-----------
    P = Σ ρ η |Ω_i|³ 2π/60      W;  η = κ ζ with κ = 0.0125 m in air, the tabled 1e-11 in water

Parameter sets of this one model
--------------------------------
                            HYDRONE ("paper")               HYDRONE_PHYSICAL ("physical")
    l_ψ            m        0.27                            0.0125                              E4
    N              m⁵       (1.25, 1.25, 4.99) e-2          (2.5, 2.5, 0.6) e-4                 E6
    J              kg m²    (1.4465, 2.8818, 1.5410) e-2    (1.4465, 1.5410, 2.8818) e-2        E8
    G                       as printed                      buoyancy only                       E14
    V              m³       1.6e-3 (24 % afloat)            1.35e-3 (5 %)                       E15
    in both sets: m = 1.2860 kg, g = 9.78 m/s², C = (1.25, 1.25, 4.99) e-2 m²

A third, HYDRONE_2021 ("hydrone-2021"), is the paper set with N = (0.625, 0.625, 1.25) e-2 m⁵ (E6) and with what
`immersion` adds: a hull 0.135 m high, rotors that follow within 33 ms, and in water

    ζ(n) = π r⁴ (2.3281e-11 n² − 1.4307e-7 n + 1.0654e-3),  r = 0.0275 m, n = |Ω| in rpm

Equilibria: hover at 3150.5 rpm, 3.144 N a rotor; neutral in water with rotors 1 and 3 at −972.7 rpm (paper set) or
−439.1 rpm (physical set).

Integrator
----------
Rotational drag in water has time constants down to 0.3 ms. Each step of h = 10 ms therefore takes every other force at
the start of the step and solves drag implicitly, axis by axis in the body frame, in closed form:

    b = y + h a,      y⁺ = b − h k |y⁺| y⁺      ⇒      y⁺ = 2 b / (1 + √(1 + 4 k h |b|)),      k = ρC/m' or ρN/J'

Backward Euler on drag: stable at any step, monotone, exact in steady state, first order in h. Position and angles
follow by the mean of the old and the new rates. Against SciPy (LSODA, relative tolerance 1e-9) positions stay within
2 cm over the 20 s manoeuvres of tests/simulation/test_integrator.py, in each medium and through both crossings.

Files
-----
    trigonometry    sine, cosine and arctangent as plain arithmetic, the same bits on every machine
    kinematics      State, rotation, Euler rates
    parameters      a Vehicle flattened to the coefficients above, one set a medium
    rotors          thrust, forces and moments, shaft power
    dynamics        accelerations, the step, and state_derivative for Python
    immersion       what these equations leave out: a hull partly under water, moving fluids, rotors that lag
    exponentials    exponential and logarithm as plain arithmetic
"""
