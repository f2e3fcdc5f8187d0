/* Ten seconds of a double pendulum by the classical method of Runge and Kutta, and what the energy changes by. */
#include <stdio.h>

#include "double_pendulum.h"

enum { NQ = DOUBLE_PENDULUM_NQ, NV = DOUBLE_PENDULUM_NV, STEPS = 10000 };

/* Coordinates and momenta, or their rates. */
typedef struct {
    double q[NQ];
    double p[NV];
} state;

static state rates(const double_pendulum_inputs *in, const state *at)
{
    state out;
    double_pendulum_rates(in, at->q, at->p, out.q, out.p);
    return out;
}

/* at + h * rates. Quaternions, which this model does not have, would have to be normalised after each step. */
static state moved(const state *at, double h, const state *rates_there)
{
    state out;
    for (int k = 0; k < NQ; k++) {
        out.q[k] = at->q[k] + h * rates_there->q[k];
    }
    for (int k = 0; k < NV; k++) {
        out.p[k] = at->p[k] + h * rates_there->p[k];
    }
    return out;
}

static state step(const double_pendulum_inputs *in, const state *at, double h)
{
    const state k1 = rates(in, at);
    const state at2 = moved(at, h / 2.0, &k1);
    const state k2 = rates(in, &at2);
    const state at3 = moved(at, h / 2.0, &k2);
    const state k3 = rates(in, &at3);
    const state at4 = moved(at, h, &k3);
    const state k4 = rates(in, &at4);
    state sum = moved(at, h / 6.0, &k1);
    sum = moved(&sum, h / 3.0, &k2);
    sum = moved(&sum, h / 3.0, &k3);
    return moved(&sum, h / 6.0, &k4);
}

static double energy(const double_pendulum_inputs *in, const state *at)
{
    double parts[2];
    double_pendulum_energy(in, at->q, at->p, parts);
    return parts[0] + parts[1];
}

int main(void)
{
    const double v[NV] = { 0.5, -0.2 };
    state now = { DOUBLE_PENDULUM_NEUTRAL, { 0.0 } };
    double_pendulum_inputs in;
    double_pendulum_inputs_init(&in);
    now.q[DOUBLE_PENDULUM_Q_SHOULDER] = 1.0;
    double_pendulum_momenta(&in, now.q, v, now.p);
    const double before = energy(&in, &now);
    for (int k = 0; k < STEPS; k++) {
        now = step(&in, &now, 10.0 / STEPS);
    }
    printf("shoulder %.6f rad, elbow %.6f rad\n", now.q[DOUBLE_PENDULUM_Q_SHOULDER], now.q[DOUBLE_PENDULUM_Q_ELBOW]);
    printf("energy changed by %.1e J of %.3f J\n", energy(&in, &now) - before, before);
    return 0;
}
