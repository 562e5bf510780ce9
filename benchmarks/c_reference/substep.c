/* Strict C reference of the simulation kernel: the same substep and tick, the same arithmetic in the same order.
 *
 * LANES vehicles are advanced side by side (1: scalar; 16: one loop over lanes that the compiler vectorises). layout.h
 * is written by build.py from the Python definitions: Medium, Vehicle, AirGains, WaterGains, World, Block and Row.
 * See hydrone_gym/physics for the equations and hydrone_gym/simulation/advance.py for the kernel this mirrors.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "layout.h"

#define DT 0.01
#define SUBSTEPS 5
#define TICK (DT * SUBSTEPS)
#define PI 3.141592653589793
#define INLINE static inline __attribute__((always_inline))

typedef struct { Vehicle vehicle; World world; AirGains air; WaterGains water; } Model;
typedef struct { double s_phi, c_phi, s_theta, c_theta, s_psi, c_psi; } Attitude;
typedef struct { double x, y, z; } Vector;
typedef struct { double x, y, z, psi, vx, vy, vz; } Reference;
typedef struct { double z, phi, theta, psi; } Integral;
typedef struct { double w1, w2, w3, w4; } Speeds;
typedef struct { double x, y, z, phi, theta, psi, vx, vy, vz, p, q, r; } State;

INLINE double clamp(double value, double low, double high)
{
    value = value < low ? low : value;
    return value > high ? high : value;
}

INLINE double wrap(double angle)
{
    angle = angle > PI ? angle - 2.0 * PI : angle;
    return angle < -PI ? angle + 2.0 * PI : angle;
}

INLINE void sincos_of(double angle, double *sine_out, double *cosine_out)
{
    const double round = 6755399441055744.0;
    double quarter = (angle * (2.0 / PI) + round) - round;
    double r = (angle - quarter * 1.5707963267341256) - quarter * 6.077100506506192e-11;
    double s = r * r;
    double sine = r + r * s * (-1.66666666666666324348e-01 + s * (8.33333333332248946124e-03
        + s * (-1.98412698298579493134e-04 + s * (2.75573137070700676789e-06
        + s * (-2.50507602534068634195e-08 + s * 1.58969099521155010221e-10)))));
    double cosine = (1.0 - 0.5 * s) + s * s * (4.16666666666666019037e-02 + s * (-1.38888888888741095749e-03
        + s * (2.48015872894767294178e-05 + s * (-2.75573143513906633035e-07
        + s * (2.08757232129817482790e-09 + s * -1.13596475577881948265e-11)))));
    double quadrant = quarter - 4.0 * ((quarter * 0.25 + round) - round);
    int odd = fabs(quadrant) == 1.0, half_turn = fabs(quadrant) == 2.0;
    double sn = odd ? cosine : sine, cs = odd ? sine : cosine;
    *sine_out = half_turn | (quadrant == -1.0) ? -sn : sn;
    *cosine_out = half_turn | (quadrant == 1.0) ? -cs : cs;
}

INLINE double arctan(double ratio)
{
    double x = fabs(ratio);
    int big = x > 2.414213562373095, middle = x > 0.66;
    double numerator = big ? -1.0 : (middle ? x - 1.0 : x);
    double denominator = big ? x : (middle ? x + 1.0 : 1.0);
    double offset = big ? PI / 2.0 : (middle ? PI / 4.0 : 0.0);
    double correction = big ? 6.123233995736766e-17 : (middle ? 0.5 * 6.123233995736766e-17 : 0.0);
    double t = numerator / denominator, s = t * t;
    double p = ((((-8.750608600031904122785e-1 * s - 1.615753718733365076637e1) * s - 7.500855792314704667340e1) * s)
        - 1.228866684490136173410e2) * s - 6.485021904942025371773e1;
    double q = ((((s + 2.485846490142306297962e1) * s + 1.650270098316988542046e2) * s + 4.328810604912902668951e2) * s
        + 4.853903996359136964868e2) * s + 1.945506571482613964425e2;
    double result = offset + ((t * (s * (p / q)) + t) + correction);
    return ratio < 0.0 ? -result : result;
}

INLINE Attitude attitude_of(double phi, double theta, double psi)
{
    Attitude a;
    sincos_of(phi, &a.s_phi, &a.c_phi);
    sincos_of(theta, &a.s_theta, &a.c_theta);
    sincos_of(psi, &a.s_psi, &a.c_psi);
    return a;
}

INLINE Vector to_world(Attitude a, double bx, double by, double bz)
{
    double tx = a.c_theta * bx + a.s_theta * bz, level = a.c_theta * bz - a.s_theta * bx;
    double ty = a.c_phi * by - a.s_phi * level;
    return (Vector){a.c_psi * tx - a.s_psi * ty, a.s_psi * tx + a.c_psi * ty, a.s_phi * by + a.c_phi * level};
}

INLINE Vector to_body(Attitude a, double wx, double wy, double wz)
{
    double tx = a.c_psi * wx + a.s_psi * wy, ty = a.c_psi * wy - a.s_psi * wx;
    double level = a.c_phi * wz - a.s_phi * ty;
    return (Vector){a.c_theta * tx - a.s_theta * level, a.c_phi * ty + a.s_phi * wz, a.s_theta * tx + a.c_theta * level};
}

INLINE Vector euler_rates(Attitude a, double p, double q, double r)
{
    double psi_rate = (a.c_theta * r - a.s_theta * p) / a.c_phi;
    return (Vector){a.c_theta * p + a.s_theta * r, q - a.s_phi * psi_rate, psi_rate};
}

INLINE double accumulate(double integral, double gain, double error, double limit)
{
    return clamp(integral + gain * error * DT, -limit, limit);
}

INLINE double shortening(double x, double y, double limit)
{
    double length = sqrt(x * x + y * y);
    return length > limit ? limit / length : 1.0;
}

INLINE Speeds air_control(const State *s, Attitude a, Vector rates, Integral *memory, Reference ref, int vertical,
                          double hover, const AirGains *g)
{
    double error_z = ref.z - s->z, limit = vertical ? g->zone_speed_limit : g->vertical_speed_limit;
    double wanted = ref.vz + g->altitude_p / g->altitude_d * error_z;
    double lateral = sqrt(s->vx * s->vx + s->vy * s->vy);
    double share = vertical ? clamp(2.0 - lateral / g->zone_lateral_speed, 0.0, 1.0) : 1.0;
    double climb = clamp(wanted, -limit * share, limit);
    double gain_z = wanted == climb ? g->altitude_i : 0.0;
    memory->z = accumulate(memory->z, gain_z, error_z, g->altitude_i_limit);
    double lift = (g->altitude_d * (climb - s->vz) + memory->z) / (a.c_phi * a.c_theta) + hover;

    double rate = g->position_p / g->position_d;
    double vx = ref.vx + rate * (ref.x - s->x), vy = ref.vy + rate * (ref.y - s->y);
    double scale = shortening(vx, vy, g->speed_limit);
    vx = vertical ? 0.0 : scale * vx;
    vy = vertical ? 0.0 : scale * vy;
    double ax = g->position_d * (vx - s->vx), ay = g->position_d * (vy - s->vy);
    scale = shortening(ax, ay, vertical ? g->vertical_tilt_limit : g->tilt_limit);
    ax = scale * ax;
    ay = scale * ay;
    double error_phi = (ax * a.s_psi - ay * a.c_psi) - s->phi;
    double error_theta = (ax * a.c_psi + ay * a.s_psi) - s->theta;
    double error_psi = wrap(ref.psi - s->psi);
    memory->phi = accumulate(memory->phi, g->attitude_i, error_phi, g->attitude_i_limit);
    memory->theta = accumulate(memory->theta, g->attitude_i, error_theta, g->attitude_i_limit);
    memory->psi = accumulate(memory->psi, g->attitude_i, error_psi, g->attitude_i_limit);
    double roll = g->roll_p * error_phi - g->roll_d * rates.x + memory->phi;
    double pitch = g->pitch_p * error_theta - g->pitch_d * rates.y + memory->theta;
    double yaw = clamp(g->yaw_p * error_psi - g->yaw_d * rates.z + memory->psi, -g->yaw_limit, g->yaw_limit);
    return (Speeds){lift - pitch + yaw, lift + roll - yaw, lift + pitch + yaw, lift - roll - yaw};
}

INLINE double signed_root(double value)
{
    double root = sqrt(fabs(value));
    return value < 0.0 ? -root : root;
}

INLINE Speeds water_control(const State *s, Attitude a, Vector rates, Integral *memory, Reference ref, int vertical,
                            const Medium *m, const WaterGains *g)
{
    double error_z = ref.z - s->z, limit = g->vertical_speed_limit;
    double wanted = ref.vz + g->depth_p / g->depth_d * error_z;
    double climb = clamp(wanted, -limit, limit);
    double gain_z = wanted == climb ? g->depth_i : 0.0;
    memory->z = accumulate(memory->z, gain_z, error_z, g->depth_i_limit);
    double drag = 0.5 * m->drag_z / m->inverse_mass * fabs(climb) * climb;
    double upright = 1.0 / (a.c_phi * a.c_theta);
    double lift = (g->depth_d * (climb - s->vz) + memory->z + drag) * upright + 0.5 * m->weight;

    double dx = ref.x - s->x, dy = ref.y - s->y;
    double ahead = dx * a.c_psi + dy * a.s_psi, aside = dy * a.c_psi - dx * a.s_psi;
    double distance = sqrt(dx * dx + dy * dy);
    int drive = (distance > g->hold_radius) & !vertical;
    double bearing = arctan(aside / ahead);
    double error = ahead != 0.0 ? bearing : 0.5 * PI;
    double surge = clamp(g->surge_p * distance + g->surge_misalignment * error * error, 0.0, g->surge_limit);
    surge = ahead < 0.0 ? -surge : surge;
    double speed = s->vx * a.c_psi + s->vy * a.s_psi;
    surge = drive ? surge : -g->surge_brake * speed;
    double error_psi = drive ? error : 0.0, error_theta = -s->theta;
    memory->theta = accumulate(memory->theta, g->attitude_i, error_theta, g->attitude_i_limit);
    memory->psi = accumulate(memory->psi, g->attitude_i, error_psi, g->attitude_i_limit);
    double pitch = g->pitch_p * error_theta - g->pitch_d * rates.y + memory->theta;
    double yaw = (drive ? g->yaw_p * error_psi + memory->psi : 0.0) - g->yaw_d * rates.z;
    double scale = 1.0 / m->thrust;
    return (Speeds){signed_root((lift - pitch) * scale), signed_root((surge + yaw) * scale),
                    signed_root((lift + pitch) * scale), signed_root((surge - yaw) * scale)};
}

INLINE double damped(double rate, double gain)
{
    return 2.0 * rate / (1.0 + sqrt(1.0 + 4.0 * gain * DT * fabs(rate)));
}

INLINE double thrust(double coefficient, double speed)
{
    return coefficient * speed * fabs(speed);
}

/* Body forces and moments with the medium's coefficients, then drag implicit, all else explicit. */
INLINE State step(const State *s, Attitude a, Speeds w, const Vehicle *v, const Medium *m, int air)
{
    double f1 = thrust(m->thrust, w.w1), f2 = thrust(m->thrust, w.w2);
    double f3 = thrust(m->thrust, w.w3), f4 = thrust(m->thrust, w.w4);
    double lift = f1 + f3, drive = f2 + f4, differential = v->arm * (f2 - f4);
    double fx = air ? 0.0 : drive, fz = air ? lift + drive : lift;
    double mx = air ? differential : 0.0, my = v->arm * (f3 - f1);
    double mz = air ? v->yaw_arm_air * (lift - drive) : differential;
    Vector g = to_body(a, 0.0, 0.0, -m->weight);
    double tilt_pitch = a.s_theta * (1.0 + v->restoring_roll_coupling * (a.c_phi - 1.0));
    double roll = (mx - (v->inertia_z - v->inertia_y) * s->q * s->r - m->restoring * a.s_phi) * m->inverse_inertia_x;
    double pitch = (my - (v->inertia_x - v->inertia_z) * s->r * s->p - m->restoring * tilt_pitch) * m->inverse_inertia_y;
    double yaw = (mz - (v->inertia_y - v->inertia_x) * s->p * s->q) * m->inverse_inertia_z;
    Vector body = to_body(a, s->vx, s->vy, s->vz);
    Vector n = to_world(a, damped(body.x + DT * ((fx + g.x) * m->inverse_mass), m->drag_x),
                        damped(body.y + DT * (g.y * m->inverse_mass), m->drag_y),
                        damped(body.z + DT * ((fz + g.z) * m->inverse_mass), m->drag_z));
    double p = damped(s->p + DT * roll, m->rotational_drag_x);
    double q = damped(s->q + DT * pitch, m->rotational_drag_y);
    double r = damped(s->r + DT * yaw, m->rotational_drag_z);
    Vector e = euler_rates(a, s->p + p, s->q + q, s->r + r);
    const double half = 0.5 * DT;
    return (State){s->x + half * (s->vx + n.x), s->y + half * (s->vy + n.y), s->z + half * (s->vz + n.z),
                   s->phi + half * e.x, s->theta + half * e.y, wrap(s->psi + half * e.z), n.x, n.y, n.z, p, q, r};
}

#include "tick.h"
