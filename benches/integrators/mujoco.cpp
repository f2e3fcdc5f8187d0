// mujoco WORK ROUNDS: MuJoCo's Euler, implicitfast and RK4, one JSON line a run.
// mujoco WORK start: accelerations at the start.
#include <mujoco/mujoco.h>

#include <cmath>
#include <cstdlib>
#include <stdexcept>

#include "scenes.hpp"

struct Simulation {
    mjModel * m;
    mjData * d;

    Simulation(const std::string & file, size_t n)
    {
        char error[1000] = "";
        m = mj_loadXML(file.c_str(), nullptr, error, sizeof error);
        if (!m) throw std::runtime_error(error);
        if (m->nq != int(n) || m->nv != int(n) || m->njnt != int(n)) throw std::runtime_error("joints of " + file);
        for (size_t i = 0; i < n; ++i)
            if (m->dof_armature[i] != 0 || m->dof_damping[i] != 0 || m->dof_frictionloss[i] != 0)
                throw std::runtime_error("something damps or loads a joint of " + file);
        // Smooth motion under gravity: whatever else costs time is off.
        m->opt.disableflags = mjDSBL_CONSTRAINT | mjDSBL_EQUALITY | mjDSBL_FRICTIONLOSS | mjDSBL_LIMIT | mjDSBL_CONTACT |
                              mjDSBL_SPRING | mjDSBL_DAMPER | mjDSBL_CLAMPCTRL | mjDSBL_WARMSTART | mjDSBL_ACTUATION |
                              mjDSBL_SENSOR | mjDSBL_EULERDAMP | mjDSBL_AUTORESET | mjDSBL_ISLAND;
        m->opt.gravity[0] = m->opt.gravity[1] = 0, m->opt.gravity[2] = -9.81;
        d = mj_makeData(m);
    }
    Simulation(const Simulation &) = delete;
    ~Simulation() { mj_deleteData(d), mj_deleteModel(m); }

    void start(const Scene & s)
    {
        mj_resetData(m, d);
        std::copy(s.q.begin(), s.q.end(), d->qpos);
        std::copy(s.v.begin(), s.v.end(), d->qvel);
    }
};

static void race(const Scene & scene, const std::string & work, int rounds)
{
    Simulation sim(work + "/" + scene.name + ".urdf", scene.q.size());
    const struct { const char * name; int kind, evaluations; } methods[] = {
        {"euler", mjINT_EULER, 1}, {"implicitfast", mjINT_IMPLICITFAST, 1}, {"rk4", mjINT_RK4, 4}};
    for (const auto & method : methods)
        for (const double h : fixed_steps()) {
            const long steps = std::lround(scene.t_end / h);
            sim.m->opt.integrator = method.kind;
            sim.m->opt.timestep = scene.t_end / steps;
            const double seconds = least_seconds(rounds, [&] {
                sim.start(scene);
                for (long k = 0; k < steps; ++k) mj_step(sim.m, sim.d);
            });
            print_line("mujoco", mj_versionString(), scene, method.name, "h=" + number("%g", h), seconds,
                method.evaluations * steps, sim.d->qpos, sim.d->qvel);
        }
}

static void start(const Scene & scene, const std::string & work)
{
    Simulation sim(work + "/" + scene.name + ".urdf", scene.q.size());
    sim.start(scene);
    mj_forward(sim.m, sim.d);
    print_start("mujoco", scene, sim.d->qacc);
}

int main(int argc, char ** argv)
{
    if (argc != 3) return std::fprintf(stderr, "usage: mujoco WORK ROUNDS|start\n"), 2;
    const std::string work = argv[1], what = argv[2];
    for (const Scene & scene : read_scenes(work))
        if (what == "start") start(scene, work);
        else race(scene, work, std::stoi(what));
}
