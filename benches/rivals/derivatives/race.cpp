// race MODELS BUILD ROUNDS [ROBOT ...]: checks and times derivatives, one JSON line for each contestant.
//
// Pinocchio's and CasADi's are of accelerations, (q, v, tau) -> d(q'')/d(q, v, tau); ours are of the canonical rates,
// (q, p) -> d(v, p')/d(q, p). Theirs are held against Pinocchio's, ours against central differences along Pinocchio's
// retraction of rates made of its forward dynamics, and d(v)/d(p) against its inverse mass matrix.
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <functional>
#include <iostream>
#include <random>

#include "../theirs/model.hpp"

using Eigen::MatrixXd;
using Eigen::VectorXd;
using RowMatrix = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;
using Kernel = void (*)(const double *, const double *, const double *, double *);
using About = void (*)(int *, int *, int *);

constexpr int STATES = 64;

struct State {
    VectorXd q, v, tau, p;
};

struct Contestant {
    std::string name, function;
    int operations;
    double tolerance;
    std::function<void(const State &, double *)> run;
    std::function<std::vector<RowMatrix>(const State &)> wanted;
    double error = 0;
    std::vector<double> times;
};

static MatrixXd mass(const pinocchio::Model & model, pinocchio::Data & data, const VectorXd & q)
{
    MatrixXd M = pinocchio::crba(model, data, q);
    M.triangularView<Eigen::StrictlyLower>() = M.transpose().triangularView<Eigen::StrictlyLower>();
    return M;
}

// v and p' at (q, p).
static VectorXd rates(const pinocchio::Model & model, pinocchio::Data & data, const VectorXd & q, const VectorXd & p, const VectorXd & tau)
{
    const MatrixXd M = mass(model, data, q);
    const VectorXd v = M.llt().solve(p);
    const VectorXd a = pinocchio::aba(model, data, q, v, tau);
    const MatrixXd C = pinocchio::computeCoriolisMatrix(model, data, q, v);
    return (VectorXd(2 * model.nv) << v, M * a + (C + C.transpose()) * v).finished();
}

// dv/dq, dv/dp, dp'/dq, dp'/dp
static std::vector<RowMatrix> differences(const pinocchio::Model & model, pinocchio::Data & data, const State & s)
{
    const int n = model.nv;
    MatrixXd all(2 * n, 2 * n);
    for (int k = 0; k < n; ++k) {
        const double h = 1e-5;
        const VectorXd d = h * VectorXd::Unit(n, k);
        auto at = [&](double sign) { return rates(model, data, pinocchio::integrate(model, s.q, VectorXd(sign * d)), s.p, s.tau); };
        const double e = 1e-4 * std::max(1.0, s.p.cwiseAbs().maxCoeff());
        auto with = [&](double sign) { return rates(model, data, s.q, s.p + sign * e * VectorXd::Unit(n, k), s.tau); };
        // of fourth order
        all.col(k) = (8 * (at(1) - at(-1)) - (at(2) - at(-2))) / (12 * h);
        all.col(n + k) = (8 * (with(1) - with(-1)) - (with(2) - with(-2))) / (12 * e);
    }
    return {all.topLeftCorner(n, n), mass(model, data, s.q).inverse(), all.bottomLeftCorner(n, n), all.bottomRightCorner(n, n)};
}

static double slice(Contestant & c, const std::vector<State> & states, int repeats, double * out)
{
    const auto begin = std::chrono::steady_clock::now();
    for (int r = 0; r < repeats; ++r) {
        for (const auto & s : states) c.run(s, out);
        asm volatile("" ::"r"(out) : "memory");
    }
    const std::chrono::duration<double, std::nano> t = std::chrono::steady_clock::now() - begin;
    return t.count() / (double(repeats) * states.size());
}

static bool race(const std::string & robot, const std::string & models, const std::string & build, int rounds)
{
    const auto model = read_model(models + "/" + robot + ".model");
    pinocchio::Data data(model);
    const int nq = model.nq, n = model.nv;
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<State> states(STATES);
    for (auto & s : states) {
        s.q.resize(nq), s.v.resize(n), s.tau.resize(n);
        for (auto & x : s.q) x = M_PI * uniform(random);
        for (auto & x : s.v) x = uniform(random);
        for (auto & x : s.tau) x = 5 * uniform(random);
        if (nq != n) s.q.segment<4>(3).normalize();
        s.p = mass(model, data, s.q) * s.v;
    }
    auto find = [&](const std::string & library, const std::string & symbol) -> void * {
        void * handle = dlopen((build + "/" + library).c_str(), RTLD_NOW | RTLD_LOCAL);
        return handle ? dlsym(handle, symbol.c_str()) : nullptr;
    };
    auto accelerations = [&](const State & s) -> std::vector<RowMatrix> {
        pinocchio::computeABADerivatives(model, data, s.q, s.v, s.tau);
        MatrixXd Minv = data.Minv;
        Minv.triangularView<Eigen::StrictlyLower>() = Minv.transpose().triangularView<Eigen::StrictlyLower>();
        return {data.ddq_dq, data.ddq_dv, Minv};
    };
    std::vector<Contestant> all;
    all.push_back({"pinocchio", "accelerations", 0, 0, [&](const State & s, double *) {
        pinocchio::computeABADerivatives(model, data, s.q, s.v, s.tau);
        asm volatile("" ::"r"(data.ddq_dq.data()) : "memory");
    }, nullptr});
    for (const std::string how : {"algorithm", "jacobian"}) {
        const std::string symbol = robot + "_casadi_" + how;
        int operations = 0;
        std::ifstream(build + "/" + symbol + ".ops") >> operations;
        if (auto kernel = reinterpret_cast<Kernel>(find("theirs_derivatives.so", symbol)))
            all.push_back({"casadi_" + how, "accelerations", operations, 1e-9, [=](const State & s, double * out) {
                kernel(s.q.data(), s.v.data(), s.tau.data(), out);
            }, accelerations});
    }
    std::vector<int> oq(nq), ov(n);
    std::vector<std::vector<State>> ours;
    for (const std::string what : {"ours_plain", "ours_native"}) {
        auto about = reinterpret_cast<About>(find(what + "_derivatives.so", robot + "_about"));
        auto kernel = reinterpret_cast<Kernel>(find(what + "_derivatives.so", robot + "_derivatives"));
        if (!about || !kernel) throw std::runtime_error("no generated code for " + robot + ": " + dlerror());
        int operations = 0;
        about(oq.data(), ov.data(), &operations);
        all.push_back({what, "rates", operations, 1e-6, [=](const State & s, double * out) {
            kernel(s.q.data(), s.p.data(), s.tau.data(), out);
        }, [&](const State & s) {
            auto blocks = differences(model, data, s);
            for (auto & b : blocks) b = RowMatrix(b(ov, ov));
            return blocks;
        }});
    }
    // Ours takes its own order of coordinates: its states are arranged beforehand.
    std::vector<State> arranged = states;
    for (auto & s : arranged) s.q = VectorXd(s.q(oq)), s.p = VectorXd(s.p(ov)), s.tau = VectorXd(s.tau(ov));
    std::vector<double> sink(4 * n * n + 2 * n + 1024);
    std::vector<int> repeats, order;
    bool sound = true;
    auto its = [&](const Contestant & c) -> const std::vector<State> & { return c.function == "rates" ? arranged : states; };
    for (auto & c : all) {
        for (int k = 0; c.wanted && k < STATES; k += 4) {
            c.run(its(c)[k], sink.data());
            // Ours writes v and p' before the blocks.
            int at = c.function == "rates" ? 2 * n : 0;
            for (const auto & block : c.wanted(states[k])) {
                const Eigen::Map<const RowMatrix> got(sink.data() + at, n, n);
                const double off = (got - block).cwiseAbs().maxCoeff() / std::max(1e-3, block.cwiseAbs().maxCoeff());
                c.error = std::max(c.error, off == off ? off : HUGE_VAL);
                at += n * n;
            }
        }
        sound &= c.error <= c.tolerance;
        order.push_back(order.size());
        slice(c, its(c), 4, sink.data());
        repeats.push_back(std::max(1, int(2e5 / (slice(c, its(c), 4, sink.data()) * STATES))));
    }
    std::mt19937 shuffled(1);
    for (int r = 0; r < rounds; ++r) {
        std::shuffle(order.begin(), order.end(), shuffled);
        double * out = sink.data() + 8 * (shuffled() % 64);
        for (int i : order) {
            slice(all[i], its(all[i]), 1, out); // code and data back into the caches
            all[i].times.push_back(slice(all[i], its(all[i]), repeats[i], out));
        }
    }
    for (auto & c : all) {
        std::sort(c.times.begin(), c.times.end());
        std::printf("{\"robot\":\"%s\",\"nv\":%d,\"contestant\":\"%s\",\"function\":\"%s\",\"operations\":%d,\"error\":%.1e,"
                    "\"ns_median\":%.1f,\"ns_min\":%.1f,\"ns_max\":%.1f}\n",
            robot.c_str(), n, c.name.c_str(), c.function.c_str(), c.operations, c.error, c.times[c.times.size() / 2],
            c.times.front(), c.times.back());
        if (c.error > c.tolerance) std::fprintf(stderr, "%s: %s is off by %.1e\n", robot.c_str(), c.name.c_str(), c.error);
    }
    std::fflush(stdout);
    return sound;
}

int main(int argc, char ** argv)
{
    const std::string models = argv[1], build = argv[2];
    const std::vector<std::string> chosen(argv + 4, argv + argc);
    std::ifstream list(models + "/robots.txt");
    bool sound = true;
    for (std::string line; std::getline(list, line);) {
        std::string robot = line.substr(0, line.find(' '));
        if (chosen.empty() || std::count(chosen.begin(), chosen.end(), robot)) sound &= race(robot, models, build, std::stoi(argv[3]));
    }
    return sound ? 0 : 1;
}
