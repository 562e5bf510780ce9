/* The substep on lane i of a block, the judgement of a tick, and rows in and out of lanes; part of substep.c. */

INLINE Medium select_medium(const Vehicle *v, int air)
{
#define EITHER(field) m.field = air ? v->air.field : v->water.field;
    Medium m;
    MEDIUM_FIELDS(EITHER)
#undef EITHER
    return m;
}

INLINE State load_state(const Block *b, int i)
{
    return (State){b->x[i], b->y[i], b->z[i], b->phi[i], b->theta[i], b->psi[i],
                   b->vx[i], b->vy[i], b->vz[i], b->p[i], b->q[i], b->r[i]};
}

INLINE void substep(Block *restrict b, int i, double fraction, double inverse_period, const Model *k)
{
    State s = load_state(b, i);
    Attitude a = attitude_of(s.phi, s.theta, s.psi);
    int air = s.z > 0.0;
    Medium m = select_medium(&k->vehicle, air);
    int vertical = (fabs(s.z) <= k->world.zone) & (k->world.vertical_mode > 0.0);
    Reference ref = {b->old_x[i] + b->move_x[i] * fraction, b->old_y[i] + b->move_y[i] * fraction,
                     b->old_z[i] + b->move_z[i] * fraction, wrap(b->old_psi[i] + b->move_psi[i] * fraction),
                     b->move_x[i] * inverse_period, b->move_y[i] * inverse_period, b->move_z[i] * inverse_period};
    Integral before = {b->integral_z[i], b->integral_phi[i], b->integral_theta[i], b->integral_psi[i]};
    Integral after = before;
    Vector rates = euler_rates(a, s.p, s.q, s.r);
    Speeds w;
    if (air)
        w = air_control(&s, a, rates, &after, ref, vertical, k->vehicle.hover_speed, &k->air);
    else
        w = water_control(&s, a, rates, &after, ref, vertical, &m, &k->water);
    Speeds l = {clamp(w.w1, m.rotor_min, m.rotor_max), clamp(w.w2, m.rotor_min, m.rotor_max),
                clamp(w.w3, m.rotor_min, m.rotor_max), clamp(w.w4, m.rotor_min, m.rotor_max)};
    int free = (l.w1 == w.w1) & (l.w2 == w.w2) & (l.w3 == w.w3) & (l.w4 == w.w4);
    State n = step(&s, a, l, &k->vehicle, &m, air);
    double a1 = fabs(l.w1), a2 = fabs(l.w2), a3 = fabs(l.w3), a4 = fabs(l.w4);
    b->energy[i] += m.power * (a1 * a1 * a1 + a2 * a2 * a2 + a3 * a3 * a3 + a4 * a4 * a4) * DT;
    int crossed = air != (n.z > 0.0);
    b->integral_z[i] = crossed ? 0.0 : (free ? after.z : before.z);
    b->integral_phi[i] = crossed ? 0.0 : (free ? after.phi : before.phi);
    b->integral_theta[i] = crossed ? 0.0 : (free ? after.theta : before.theta);
    b->integral_psi[i] = crossed ? 0.0 : (free ? after.psi : before.psi);
    double speed2 = n.vx * n.vx + n.vy * n.vy, cosine = a.c_phi * a.c_theta;
    b->crossed[i] += crossed ? 1.0 : 0.0;
    b->cross_direction[i] = crossed ? (air ? -1.0 : 1.0) : b->cross_direction[i];
    b->cross_vz[i] = crossed ? n.vz : b->cross_vz[i];
    b->cross_speed2[i] = crossed & !(speed2 <= b->cross_speed2[i]) ? speed2 : b->cross_speed2[i];
    b->cross_cos[i] = crossed & !(cosine >= b->cross_cos[i]) ? cosine : b->cross_cos[i];
#define STORE(field) b->field[i] = n.field;
    STATE_FIELDS(STORE)
#undef STORE
}

INLINE void sweep(Block *restrict b, int i, const double *restrict sphere, double *restrict closest, double radius)
{
    double dx = b->x[i] - b->saved_x[i], dy = b->y[i] - b->saved_y[i], dz = b->z[i] - b->saved_z[i];
    double ox = sphere[i] - b->saved_x[i], oy = sphere[LANES + i] - b->saved_y[i];
    double oz = sphere[2 * LANES + i] - b->saved_z[i];
    double t = (ox * dx + oy * dy + oz * dz) * b->inverse_length2[i];
    t = t > 0.0 ? t : 0.0;
    t = t < 1.0 ? t : 1.0;
    ox = ox - t * dx;
    oy = oy - t * dy;
    oz = oz - t * dz;
    double distance = sqrt(ox * ox + oy * oy + oz * oz) - sphere[3 * LANES + i];
    int running = b->outcome[i] == 0.0;
    double near = closest[i], clearance = distance - radius;
    closest[i] = running & (distance < near) ? distance : near;
    b->clearance[i] = running & (clearance < b->clearance[i]) ? clearance : b->clearance[i];
}

INLINE void end_tick(Block *restrict b, int i, const World *w)
{
    State s = load_state(b, i);
    Attitude a = attitude_of(s.phi, s.theta, s.psi);
    double speed2 = s.vx * s.vx + s.vy * s.vy + s.vz * s.vz, rate2 = s.p * s.p + s.q * s.q + s.r * s.r;
    int upright = (a.c_phi * a.c_theta > 0.05) & (fabs(s.phi) < 1.6) & (fabs(s.theta) < 1.6);
    int sane = (speed2 < 900.0) & (rate2 < 10000.0) & upright & (s.x * s.x + s.y * s.y + s.z * s.z < 1e12);
    int inside = (w->x_min <= s.x) & (s.x <= w->x_max) & (w->y_min <= s.y) & (s.y <= w->y_max) & (w->z_min <= s.z)
        & (s.z <= w->z_max);
    int rough = (b->crossed[i] > 0.0) & (w->rough_fails > 0.0)
        & ((b->cross_speed2[i] > w->rough_speed * w->rough_speed) | (b->cross_cos[i] < w->rough_cos_tilt));
    double gx = s.x - b->goal_x[i], gy = s.y - b->goal_y[i], gz = s.z - b->goal_z[i];
    double outcome = gx * gx + gy * gy + gz * gz <= w->goal_radius * w->goal_radius ? GOAL : RUNNING;
    outcome = rough ? ROUGH_TRANSITION : outcome;
    outcome = inside ? outcome : OUT_OF_BOUNDS;
    outcome = b->clearance[i] <= 0.0 ? COLLISION : outcome;
    outcome = sane ? outcome : DIVERGED;
    int running = b->outcome[i] == 0.0, keep = running & sane;
    b->outcome[i] = running ? outcome : b->outcome[i];
    b->ticks[i] += running ? 1.0 : 0.0;
    b->crossed[i] = keep ? b->crossed[i] : 0.0;
#define RESTORE(field) b->field[i] = keep ? b->field[i] : b->saved_##field[i];
    SAVED_FIELDS(RESTORE)
#undef RESTORE
}

static void log_crossings(Block *b, double *log)
{
    for (int i = 0; i < LANES; i++)
        if (b->crossed[i] > 0.0) {
            int slot = (int)b->crossings[i];
            if (slot < LOGGED_CROSSINGS) {
                double *entry = log + 5 * (i * LOGGED_CROSSINGS + slot);
                entry[0] = b->ticks[i] * TICK;
                entry[1] = b->cross_direction[i];
                entry[2] = sqrt(b->cross_speed2[i]);
                entry[3] = b->cross_cos[i] < 1.0 ? b->cross_cos[i] : 1.0;
                entry[4] = b->cross_vz[i];
            }
            b->crossings[i] += 1.0;
        }
}

static void advance(Block *restrict b, double *log, const double *restrict obstacles, double *restrict closest,
                    long count, const Model *k, long first, long last, long ticks)
{
    double inverse_substeps = 1.0 / (ticks * SUBSTEPS), inverse_period = 1.0 / (ticks * TICK);
    for (long tick = first; tick < last; tick++) {
#define SAVE(field) b->saved_##field[i] = b->field[i];
        for (int i = 0; i < LANES; i++) {
            SAVED_FIELDS(SAVE)
            b->crossed[i] = 0.0;
            b->cross_speed2[i] = 0.0;
            b->cross_cos[i] = 1.0;
        }
#undef SAVE
        for (int sub = 0; sub < SUBSTEPS; sub++)
            for (int i = 0; i < LANES; i++)
                substep(b, i, (tick * SUBSTEPS + sub + 1) * inverse_substeps, inverse_period, k);
        for (int i = 0; i < LANES; i++) {
            double dx = b->x[i] - b->saved_x[i], dy = b->y[i] - b->saved_y[i], dz = b->z[i] - b->saved_z[i];
            double length2 = dx * dx + dy * dy + dz * dz, inverse = 1.0 / length2;
            b->inverse_length2[i] = length2 > 0.0 ? inverse : 0.0;
        }
        for (long j = 0; j < count; j++)
            for (int i = 0; i < LANES; i++)
                sweep(b, i, obstacles + 4 * j * LANES, closest + j * LANES, k->vehicle.radius);
        for (int i = 0; i < LANES; i++)
            end_tick(b, i, &k->world);
        log_crossings(b, log);
    }
}

/* Same arguments as hydrone_gym.simulation.rows.advance_rows, with the number of rows. */
void advance_rows(Row *rows, const double *references, const double *obstacles, double *closest, long count,
                  const double *values, long first, long last, long ticks, Block *b, double *log, long n)
{
    Model model;
    memcpy(&model, values, sizeof model);
    for (long start = 0, k = 0; start < n; start += LANES, k++) {
        for (int i = 0; i < LANES; i++) {
            long index = start + i < n ? start + i : n - 1;
            const Row *row = rows + index;
            const double *new = references + 4 * index;
            LOAD_ROW(b, i, row)
            b->old_x[i] = row->reference[0], b->old_y[i] = row->reference[1];
            b->old_z[i] = row->reference[2], b->old_psi[i] = row->reference[3];
            b->move_x[i] = new[0] - row->reference[0], b->move_y[i] = new[1] - row->reference[1];
            b->move_z[i] = new[2] - row->reference[2], b->move_psi[i] = wrap(new[3] - row->reference[3]);
            memcpy(log + 5 * LOGGED_CROSSINGS * i, row->crossing_log, sizeof row->crossing_log);
        }
        advance(b, log, obstacles + k * 4 * count * LANES, closest + k * count * LANES, count, &model, first, last, ticks);
        for (int i = 0; i < LANES && start + i < n; i++) {
            Row *row = rows + start + i;
            STORE_ROW(b, i, row)
            memcpy(row->crossing_log, log + 5 * LOGGED_CROSSINGS * i, sizeof row->crossing_log);
            if (last == ticks)
                memcpy(row->reference, references + 4 * (start + i), sizeof row->reference);
        }
    }
}
