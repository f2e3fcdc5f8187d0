// driver MODELS BUILD ROUNDS [ROBOT ...]: checks and times every contestant, one JSON line each.
//
// One process holds everything. In each round every contestant goes through the same 256 states, in an order drawn anew;
// the figures are quartiles, least and greatest of the rounds. Contestants with one state a call go through them twice: once
// one evaluation does not depend on another, once each state is moved a little by the results of the one before, as those of an
// integrator are, so that an evaluation waits for the last one.
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <dlfcn.h>

#include <algorithm>
#include <cstdio>
#include <functional>
#include <iostream>
#include <numeric>
#include <random>
#include <sstream>

#include <time.h>

#include "model.hpp"

using Eigen::VectorXd;
using pinocchio::Convention;
using Kernel = void (*)(const double *, const double *, const double *, double *);
using About = void (*)(int *, int *, int *);

constexpr int STATES = 256;
// Every contestant is to agree with Pinocchio to this, relative to the
// largest entry. It leaves room for the condition of the mass matrix, not for a wrong term.
constexpr double TOLERANCE = 1e-9;

struct Contestant {
    std::string name, function;
    int lanes, operations;
    Kernel kernel;                     // null for Pinocchio itself
    std::function<void(int)> state;    // evaluates state k; used where there is no kernel
    std::vector<double> second;        // p or v of all states, in the kernel's order
    std::vector<double> q, tau, wanted;
    int nq, nv, nout;
    double error = 0;
    std::vector<double> times, dependent;
};

struct States {
    std::vector<VectorXd> q, v, tau, p, a, qd, pd;
};

static VectorXd quaternion_rate(const Eigen::Vector4d & q, const Eigen::Vector3d & w)
{
    const double x = q[0], y = q[1], z = q[2], s = q[3];
    return 0.5 * Eigen::Vector4d(s * w[0] + y * w[2] - z * w[1], s * w[1] + z * w[0] - x * w[2],
                     s * w[2] + x * w[1] - y * w[0], -x * w[0] - y * w[1] - z * w[2]);
}

// Random states with what Pinocchio says of them: q'' by ABA, p = M v, p' = M a + (C + C^T) v, q'.
static States make_states(const pinocchio::Model & model, pinocchio::Data & data)
{
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    States s;
    for (int k = 0; k < STATES; ++k) {
        VectorXd q(model.nq), v(model.nv), tau(model.nv);
        for (auto & x : q) x = M_PI * uniform(random);
        for (auto & x : v) x = uniform(random);
        for (auto & x : tau) x = 5 * uniform(random);
        const bool floating = model.nq != model.nv;
        if (floating) q.segment<4>(3).normalize();
        const VectorXd a = pinocchio::aba(model, data, q, v, tau);
        Eigen::MatrixXd M = pinocchio::crba(model, data, q);
        M.triangularView<Eigen::StrictlyLower>() = M.transpose().triangularView<Eigen::StrictlyLower>();
        const Eigen::MatrixXd C = pinocchio::computeCoriolisMatrix(model, data, q, v);
        VectorXd qd(model.nq);
        qd.tail(model.nv) = v;
        if (floating) {
            qd.head<3>() = Eigen::Quaterniond(q[6], q[3], q[4], q[5]) * Eigen::Vector3d(v.head<3>());
            qd.segment<4>(3) = quaternion_rate(q.segment<4>(3), v.segment<3>(3));
            qd.tail(model.nv - 6) = v.tail(model.nv - 6);
        }
        s.q.push_back(q), s.v.push_back(v), s.tau.push_back(tau), s.a.push_back(a), s.qd.push_back(qd);
        s.p.push_back(M * v), s.pd.push_back(M * a + (C + C.transpose()) * v);
    }
    return s;
}

static std::vector<double> aligned(size_t n)
{
    return std::vector<double>(n + 8);
}

static double * start(std::vector<double> & x)
{
    return reinterpret_cast<double *>((reinterpret_cast<size_t>(x.data()) + 63) & ~size_t(63));
}

// Reorders and, for lanes, interleaves: entry i of state k stands at ((k / lanes) n + i) lanes + k % lanes.
static std::vector<double> arrange(const std::vector<VectorXd> & states, const std::vector<int> & order, int lanes)
{
    const int n = order.size();
    auto out = aligned(states.size() * n);
    double * x = start(out);
    for (size_t k = 0; k < states.size(); ++k)
        for (int i = 0; i < n; ++i) x[((k / lanes) * n + i) * lanes + k % lanes] = states[k][order[i]];
    return out;
}

static void evaluate_all(Contestant & c, double * out, bool keep)
{
    if (!c.kernel) {
        for (int k = 0; k < STATES; ++k) c.state(k);
        return;
    }
    const double *q = start(c.q), *second = start(c.second), *tau = start(c.tau);
    const int step = c.lanes;
    for (int k = 0; k < STATES / step; ++k) {
        c.kernel(q, second, tau, out);
        q += c.nq * step, second += c.nv * step, tau += c.nv * step;
        if (keep) out += c.nout * step;
    }
}

// How far a result moves the next state: enough for the processor, nothing to mechanics.
constexpr double MOVE = 1e-12;

static void evaluate_chain(Contestant & c, double * out)
{
    const double *q = start(c.q), *second = start(c.second), *tau = start(c.tau);
    alignas(64) double moved[512], moved_second[512];
    for (int k = 0; k < STATES; ++k) {
        // Rates begin with those of the coordinates and end with those of the momenta; accelerations move both.
        const double *first = out, *last = out + c.nout - c.nv;
        const int n = c.nout == c.nv ? c.nv : c.nq;
        for (int i = 0; i < n; ++i) moved[i] = q[i] + MOVE * first[i];
        for (int i = n; i < c.nq; ++i) moved[i] = q[i];
        for (int i = 0; i < c.nv; ++i) moved_second[i] = second[i] + MOVE * last[i];
        c.kernel(moved, moved_second, tau, out);
        q += c.nq, second += c.nv, tau += c.nv;
    }
}

static void check(Contestant & c)
{
    if (!c.kernel) return;
    auto got = aligned(STATES * c.nout);
    double *x = start(got), *y = start(c.wanted);
    evaluate_all(c, x, true);
    // Each state and each half of the rates by its own largest entry.
    const int parts = c.nout == c.nv ? 1 : 2;
    for (int k = 0; k < STATES; ++k)
        for (int part = 0; part < parts; ++part) {
            const int from = part ? c.nout - c.nv : 0, to = parts == 2 && !part ? c.nout - c.nv : c.nout;
            double size = 1e-3, off = 0;
            for (int i = from; i < to; ++i) {
                const int at = ((k / c.lanes) * c.nout + i) * c.lanes + k % c.lanes;
                size = std::max(size, std::abs(y[at]));
                const double d = std::abs(x[at] - y[at]);
                off = std::max(off, d == d ? d : HUGE_VAL);
            }
            c.error = std::max(c.error, off / size);
        }
}

// Processor time of this thread, ns: what others do on the machine is not counted.
static double now()
{
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return 1e9 * t.tv_sec + t.tv_nsec;
}

static double slice(Contestant & c, int repeats, double * out, bool chain = false)
{
    const double begin = now();
    for (int r = 0; r < repeats; ++r) {
        chain ? evaluate_chain(c, out) : evaluate_all(c, out, false);
        asm volatile("" ::"r"(out) : "memory");
    }
    return (now() - begin) / (double(repeats) * STATES);
}

struct Libraries {
    std::string build;

    // A function of a library, or null where either is missing.
    void * find(const std::string & library, const std::string & symbol) const
    {
        void * handle = dlopen((build + "/" + library).c_str(), RTLD_NOW | RTLD_LOCAL);
        return handle ? dlsym(handle, symbol.c_str()) : nullptr;
    }
};

static std::vector<Contestant> contestants(const std::string & robot, const pinocchio::Model & model,
                                           pinocchio::Data & data, const States & s, const Libraries & libraries)
{
    const int nq = model.nq, nv = model.nv;
    std::vector<Contestant> all;
    for (auto convention : {Convention::LOCAL, Convention::WORLD}) {
        Contestant c{convention == Convention::LOCAL ? "pinocchio_local" : "pinocchio_world", "accelerations", 1, 0, nullptr};
        c.state = [&, convention](int k) {
            const auto & a = pinocchio::aba(model, data, s.q[k], s.v[k], s.tau[k], convention);
            asm volatile("" ::"r"(a.data()) : "memory");
        };
        all.push_back(c);
    }
    std::vector<int> same_q(nq), same_v(nv), ours_q(nq), ours_v(nv);
    std::iota(same_q.begin(), same_q.end(), 0), std::iota(same_v.begin(), same_v.end(), 0);
    int operations[2] = {};
    auto about = reinterpret_cast<About>(libraries.find("ours_" + robot + ".so", robot + "_about"));
    if (!about) throw std::runtime_error(std::string("no generated code for ") + robot + ": " + dlerror());
    about(ours_q.data(), ours_v.data(), operations);

    auto add = [&](const std::string & name, const std::string & library, const std::string & symbol, int lanes,
                   bool ours, bool rates, int ops) {
        auto kernel = reinterpret_cast<Kernel>(libraries.find(library, symbol));
        if (!kernel) return;
        const auto & oq = ours ? ours_q : same_q;
        const auto & ov = ours ? ours_v : same_v;
        Contestant c{name, rates ? "rates" : "accelerations", lanes, ops, kernel};
        c.nq = nq, c.nv = nv, c.nout = rates ? nq + nv : nv;
        c.q = arrange(s.q, oq, lanes), c.tau = arrange(s.tau, ov, lanes);
        c.second = arrange(rates ? s.p : s.v, ov, lanes);
        if (rates) {
            std::vector<VectorXd> both;
            std::vector<int> order = oq;
            for (int i : ov) order.push_back(nq + i);
            for (int k = 0; k < STATES; ++k) both.push_back((VectorXd(nq + nv) << s.qd[k], s.pd[k]).finished());
            c.wanted = arrange(both, order, lanes);
        } else {
            c.wanted = arrange(s.a, ov, lanes);
        }
        all.push_back(std::move(c));
    };
    for (const std::string tool : {"casadi", "cppadcg"}) {
        int ops = 0;
        std::ifstream(libraries.build + "/" + robot + "_" + tool + ".ops") >> ops;
        const std::string symbol = robot + "_" + tool;
        add(tool, "theirs.so", symbol, 1, false, false, ops);
        add(tool + "_lanes", "theirs_lanes.so", symbol, 8, false, false, ops);
    }
    // One state a call, eight, all of them.
    const std::vector<std::pair<std::string, int>> doors = {{"", 1}, {"_lanes", 8}, {"_batch", STATES}};
    for (const auto & [door, lanes] : doors)
        for (const bool rates : {true, false}) {
            const std::string what = rates ? "_rates" : "_accelerations";
            add("ours" + door + what, "ours_" + robot + ".so", robot + what + door, lanes, true, rates, operations[rates ? 0 : 1]);
        }
    return all;
}

static bool race(const std::string & robot, const std::string & models, const Libraries & libraries, int rounds)
{
    const auto model = read_model(models + "/" + robot + ".model");
    pinocchio::Data data(model);
    const States states = make_states(model, data);
    auto all = contestants(robot, model, data, states, libraries);
    // Where the results go moves from round to round: some places are unlucky for some contestants.
    auto sink = aligned((model.nq + model.nv) * STATES + 512);
    std::vector<int> repeats;
    bool sound = true;
    for (auto & c : all) {
        check(c);
        sound &= c.error <= TOLERANCE;
        slice(c, 4, start(sink));
        // A slice lasts some 100 us: long beside the clock, short beside what disturbs.
        repeats.push_back(std::max(1, int(1e5 / (slice(c, 4, start(sink)) * STATES))));
    }
    std::vector<int> order(all.size());
    std::iota(order.begin(), order.end(), 0);
    std::mt19937 random(1);
    for (int r = 0; r < rounds; ++r) {
        std::shuffle(order.begin(), order.end(), random);
        double * out = start(sink) + 8 * (random() % 64);
        for (int i : order) {
            slice(all[i], 1, out); // code and data back into the caches
            all[i].times.push_back(slice(all[i], repeats[i], out));
            if (all[i].kernel && all[i].lanes == 1 && model.nq <= 512) {
                slice(all[i], 1, out, true);
                all[i].dependent.push_back(slice(all[i], repeats[i], out, true));
            }
        }
    }
    for (auto & c : all) {
        std::sort(c.times.begin(), c.times.end());
        std::sort(c.dependent.begin(), c.dependent.end());
        const auto quartile = [](const std::vector<double> & x, int n) { return x.empty() ? 0.0 : x[(x.size() - 1) * n / 4]; };
        std::printf("{\"robot\":\"%s\",\"nv\":%d,\"contestant\":\"%s\",\"function\":\"%s\",\"lanes\":%d,\"operations\":%d,"
                    "\"error\":%.1e,\"ns_median\":%.2f,\"ns_min\":%.2f,\"ns_max\":%.2f,\"ns_quartiles\":[%.2f,%.2f],"
                    "\"ns_dependent\":%.2f,\"ns_dependent_quartiles\":[%.2f,%.2f]}\n",
            robot.c_str(), model.nv, c.name.c_str(), c.function.c_str(), c.lanes, c.operations, c.error,
            c.times[c.times.size() / 2], c.times.front(), c.times.back(), quartile(c.times, 1), quartile(c.times, 3),
            quartile(c.dependent, 2), quartile(c.dependent, 1), quartile(c.dependent, 3));
        if (c.error > TOLERANCE) std::fprintf(stderr, "%s: %s differs from Pinocchio by %.1e\n", robot.c_str(), c.name.c_str(), c.error);
    }
    std::fflush(stdout);
    return sound;
}

int main(int argc, char ** argv)
{
    const std::string models = argv[1];
    const Libraries libraries{argv[2]};
    const int rounds = std::stoi(argv[3]);
    const std::vector<std::string> chosen(argv + 4, argv + argc);
    std::ifstream list(models + "/robots.txt");
    bool sound = true;
    for (std::string line; std::getline(list, line);) {
        std::string robot = line.substr(0, line.find(' '));
        if (chosen.empty() || std::count(chosen.begin(), chosen.end(), robot))
            sound &= race(robot, models, libraries, rounds);
    }
    return sound ? 0 : 1;
}
