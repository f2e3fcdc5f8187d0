// race MODELS LIBRARIES ROUNDS [MECHANISM ...]: checks and times accelerations of mechanisms with loops, one JSON line for each
// contestant. LIBRARIES is a folder with ours_plain.so and ours_native.so.
//
// Pinocchio's: constraintDynamics and lcaba (constrainedABA of 4.1 does not compile for rigid constraints). Each runs with the
// fewest proximal iterations, and of these the regularisation, that bring the accelerations within WANTED of a dense solution in
// long double, or where none does that, within twice the best it can; mu = 0 where it allows it. Ours: accelerations, and rates of the canonical form.
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/loop-constrained-aba.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/constraints.hpp>

#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <random>

using namespace pinocchio;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Loops = std::vector<RigidConstraintModel>;
using LoopDatas = std::vector<RigidConstraintData>;

constexpr int STATES = 64;
constexpr double WANTED = 1e-10, AGREED = 1e-9;

struct Mechanism {
    Model model;
    Loops loops;
};

struct State {
    VectorXd q, v, tau, p, a;
};

struct Contestant {
    std::string name, function, settings;
    int operations;
    const std::vector<State> * states;
    std::function<void(const State &, VectorXd &)> run;
    double error = 0;
    std::vector<double> times;
};

static Mechanism read(const std::string & path)
{
    std::ifstream in(path);
    if (!in) throw std::runtime_error("cannot read " + path);
    Mechanism out;
    Model & model = out.model;
    int joints, loops;
    auto number = [&] { double x; in >> x; return x; };
    auto vector = [&] { Eigen::Vector3d x; for (auto & e : x) e = number(); return x; };
    auto matrix = [&] { Eigen::Matrix3d x; for (int k = 0; k < 9; ++k) x(k / 3, k % 3) = number(); return x; };
    auto placement = [&] { const Eigen::Matrix3d r = matrix(); return SE3(r, vector()); };
    in >> model.name >> joints >> loops;
    model.gravity.linear() = vector();
    for (int i = 1; i <= joints; ++i) {
        std::string kind;
        JointIndex parent, id;
        in >> kind >> parent;
        const SE3 place = placement();
        const Eigen::Vector3d a = vector(), b = vector();
        const std::string name = "joint" + std::to_string(i);
        auto add = [&](const JointModel & joint) { id = model.addJoint(parent, joint, place, name); };
        if (kind == "RX") add(JointModelRX());
        else if (kind == "RY") add(JointModelRY());
        else if (kind == "RZ") add(JointModelRZ());
        else if (kind == "RU") add(JointModelRevoluteUnaligned(a));
        else if (kind == "PX") add(JointModelPX());
        else if (kind == "PY") add(JointModelPY());
        else if (kind == "PZ") add(JointModelPZ());
        else if (kind == "PU") add(JointModelPrismaticUnaligned(a));
        else if (kind == "UN") add(JointModelUniversal(a, b));
        else if (kind == "FF") add(JointModelFreeFlyer());
        else throw std::runtime_error("joint " + kind);
        const double mass = number();
        const Eigen::Vector3d com = vector();
        const Eigen::Matrix3d inertia = matrix();
        model.appendBodyToJoint(id, Inertia(mass, com, Symmetric3(inertia)));
        model.armature.segment(model.idx_vs[id], model.nvs[id]).setConstant(number());
    }
    for (int k = 0; k < loops; ++k) {
        JointIndex a, b;
        in >> a;
        const SE3 on_a = placement();
        in >> b;
        const SE3 on_b = placement();
        out.loops.emplace_back(CONTACT_3D, model, a, on_a, b, on_b, LOCAL);
    }
    if (!in) throw std::runtime_error("cannot make sense of " + path);
    return out;
}

// Longer than double: the mass matrix of a long chain has a condition number of 1e9.
using Long = long double;
using LongVector = Eigen::Matrix<Long, Eigen::Dynamic, 1>;
using LongMatrix = Eigen::Matrix<Long, Eigen::Dynamic, Eigen::Dynamic>;
using LongModel = ModelTpl<Long>;
using LongData = DataTpl<Long>;

static LongMatrix mass(const LongModel & model, LongData & data, const LongVector & q)
{
    LongMatrix M = crba(model, data, q);
    M.triangularView<Eigen::StrictlyLower>() = M.transpose().triangularView<Eigen::StrictlyLower>();
    return M;
}

// Accelerations of the open mechanism.
static LongVector open_accelerations(const LongModel & model, LongData & data, const State & s)
{
    const LongVector q = s.q.cast<Long>(), v = s.v.cast<Long>(), tau = s.tau.cast<Long>();
    const LongVector zero = LongVector::Zero(model.nv);
    return mass(model, data, q).llt().solve(tau - rnea(model, data, q, v, zero));
}

// Accelerations by a dense solution, redundant rows left out by rank: those nearest to the open ones in the metric of the masses.
static VectorXd dense(const Mechanism & m, const LongModel & model, LongData & data, const State & s)
{
    const int n = model.nv, rows = 3 * m.loops.size();
    const LongVector open = open_accelerations(model, data, s), q = s.q.cast<Long>(), v = s.v.cast<Long>();
    const LongMatrix M = mass(model, data, q);
    const LongVector zero = LongVector::Zero(n);
    forwardKinematics(model, data, q, v, zero);
    computeJointJacobians(model, data, q);
    LongMatrix J = LongMatrix::Zero(rows, n);
    LongVector drift = LongVector::Zero(rows);
    auto end = [&](int row, Long sign, JointIndex joint, const SE3 & where) {
        if (joint == 0) return;
        const auto place = where.cast<Long>();
        LongMatrix local = LongMatrix::Zero(6, n);
        getJointJacobian(model, data, joint, LOCAL, local);
        const Eigen::Matrix<Long, 3, 3> turn = sign * data.oMi[joint].rotation() * place.rotation();
        J.middleRows<3>(row) += turn * (place.toActionMatrixInverse() * local).template topRows<3>();
        const auto u = place.actInv(data.v[joint]), a = place.actInv(data.a[joint]);
        drift.segment<3>(row) += turn * (a.linear() + u.angular().cross(u.linear()));
    };
    for (size_t k = 0; k < m.loops.size(); ++k) {
        end(3 * k, 1, m.loops[k].joint1_id, m.loops[k].joint1_placement);
        end(3 * k, -1, m.loops[k].joint2_id, m.loops[k].joint2_placement);
    }
    const auto L = M.llt();
    Eigen::CompleteOrthogonalDecomposition<LongMatrix> least;
    least.setThreshold(1e-9L);
    least.compute(L.matrixL().solve(J.transpose()).transpose());
    const LongVector y = least.solve(-(J * open + drift));
    return (open + L.matrixU().solve(y)).cast<double>();
}

// The rate of the coordinates, differences of fourth order.
static VectorXd coordinate_rate(const LongModel & model, const State & s)
{
    const LongVector q = s.q.cast<Long>(), v = s.v.cast<Long>();
    const Long h = 1e-3L / std::max(Long(1), v.cwiseAbs().maxCoeff());
    auto at = [&](Long t) -> LongVector { return integrate(model, q, LongVector(t * v)); };
    return LongVector((8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)).cast<double>();
}

// The rate of the momenta M v where multipliers are zero, that of the open mechanism: M a + dM/dt v, differences of fourth order.
static VectorXd momentum_rate(const LongModel & model, LongData & data, const State & s)
{
    const LongVector q = s.q.cast<Long>(), v = s.v.cast<Long>();
    const Long h = 1e-3L / std::max(Long(1), v.cwiseAbs().maxCoeff());
    auto at = [&](Long t) -> LongVector { return mass(model, data, integrate(model, q, LongVector(t * v))) * v; };
    const LongVector change = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h);
    return (mass(model, data, q) * open_accelerations(model, data, s) + change).cast<double>();
}

static double off(const VectorXd & got, const VectorXd & wanted)
{
    const double e = (got - wanted).cwiseAbs().maxCoeff() / std::max(1e-3, wanted.cwiseAbs().maxCoeff());
    return e == e ? e : HUGE_VAL;
}

static double slice(Contestant & c, int repeats, VectorXd & out)
{
    const auto begin = std::chrono::steady_clock::now();
    for (int r = 0; r < repeats; ++r) {
        for (const auto & s : *c.states) c.run(s, out);
        asm volatile("" ::"r"(out.data()) : "memory");
    }
    const std::chrono::duration<double, std::nano> t = std::chrono::steady_clock::now() - begin;
    return t.count() / (double(repeats) * c.states->size());
}

using Call = std::function<const VectorXd &(const State &, ProximalSettings &)>;

// A contestant of Pinocchio's with the fewest iterations that are enough; where nothing is, that come within twice its best.
static Contestant tuned(const std::string & name, const std::vector<State> & states, bool zero, double wanted, const Call & call)
{
    struct Choice {
        double mu;
        int iterations;
        double error;
    };
    std::vector<Choice> tried;
    auto consider = [&](double mu, int iterations) {
        double error = 0;
        for (const auto & s : states) {
            ProximalSettings settings(0, 0, mu, iterations);
            error = std::max(error, off(call(s, settings), s.a));
        }
        tried.push_back({mu, iterations, error});
    };
    if (zero) consider(0, 1);
    for (int iterations = 1; iterations <= 20; ++iterations)
        for (int k = -14; k <= -1; ++k) consider(std::pow(10.0, k), iterations);
    auto worse = [](const Choice & a, const Choice & b) { return a.error < b.error; };
    const double enough = std::max(wanted, 2 * std::min_element(tried.begin(), tried.end(), worse)->error);
    const auto first = std::find_if(tried.begin(), tried.end(), [=](const Choice & c) { return c.error <= enough; });
    // Of the settings that take as long, the best.
    const Choice best = *std::min_element(first, std::find_if(first, tried.end(), [=](const Choice & c) {
        return c.iterations > first->iterations || (c.mu > 0) != (first->mu > 0);
    }), worse);
    char text[64];
    std::snprintf(text, sizeof text, "mu %.0e, iterations %d", best.mu, best.iterations);
    return {name, "accelerations", text, 0, &states, [=](const State & s, VectorXd &) {
        ProximalSettings settings(0, 0, best.mu, best.iterations);
        asm volatile("" ::"r"(call(s, settings).data()) : "memory");
    }, best.error, {}};
}

static void theirs(const Mechanism & m, const std::vector<State> & states, double wanted, std::vector<Contestant> & all)
{
    const Model & model = m.model;
    auto fresh = [&] { return std::make_shared<std::pair<Data, LoopDatas>>(Data(model), LoopDatas()); };
    auto add = [&](const std::string & name, bool zero, auto prepare, auto solve) {
        auto room = fresh();
        for (const auto & loop : m.loops) room->second.emplace_back(loop.createData());
        prepare(room->first, room->second);
        all.push_back(tuned(name, states, zero, wanted, [&model, &m, room, solve](const State & s, ProximalSettings & settings) -> const VectorXd & {
            return solve(model, room->first, s, m.loops, room->second, settings);
        }));
    };
    add("constraintDynamics", true,
        [&](Data & data, LoopDatas & datas) { initConstraintDynamics(model, data, m.loops, datas); },
        [](const Model & model, Data & data, const State & s, const Loops & loops, LoopDatas & datas, ProximalSettings & settings)
            -> const VectorXd & { return constraintDynamics(model, data, s.q, s.v, s.tau, loops, datas, settings); });
    add("lcaba", false, [&](Data & data, LoopDatas &) { computeJointMinimalOrdering(model, data, m.loops); },
        [](const Model & model, Data & data, const State & s, const Loops & loops, LoopDatas & datas, ProximalSettings & settings)
            -> const VectorXd & { return lcaba(model, data, s.q, s.v, s.tau, loops, datas, settings); });
}

static bool race(const std::string & name, const std::string & models, const std::string & libraries, int rounds)
{
    const Mechanism m = read(models + "/" + name + ".loop");
    const LongModel model = m.model.cast<Long>();
    LongData data(model);
    const int nq = m.model.nq, n = m.model.nv;
    auto find = [&](const std::string & what, const std::string & symbol) {
        void * handle = dlopen((libraries + "/" + what + ".so").c_str(), RTLD_NOW | RTLD_LOCAL);
        void * door = handle ? dlsym(handle, (name + "_" + symbol).c_str()) : nullptr;
        if (!door) throw std::runtime_error("no " + symbol + " of " + name + " in " + what);
        return door;
    };
    using Solve = void (*)(const double *, const double *, const double *, double *);
    using Rates = void (*)(const double *, const double *, const double *, double *, double *);
    using Momenta = void (*)(const double *, const double *, double *);
    using Random = double (*)(uint64_t, double *, double *);
    // The numbers, and the states of the mechanism whose model Pinocchio has.
    const std::string giver = name == "delta" ? "delta_rods" : name;
    void * library = dlopen((libraries + "/ours_plain.so").c_str(), RTLD_NOW | RTLD_LOCAL);
    auto door = [&](const std::string & symbol) { return library ? dlsym(library, symbol.c_str()) : nullptr; };
    auto about = [&](const std::string & of) {
        auto call = reinterpret_cast<void (*)(int *)>(door(of + "_about"));
        if (!call) throw std::runtime_error("no generated code for " + of);
        std::vector<int> x(5 + nq + n + 64);
        call(x.data());
        return x;
    };
    const auto x = about(name), given = about(giver);
    const std::vector<int> oq(x.begin() + 5, x.begin() + 5 + x[0]), ov(x.begin() + 5 + x[0], x.begin() + 5 + x[0] + x[1]);
    std::mt19937_64 random(7);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<State> states(STATES), ours(STATES);
    double residual = 0;
    for (int k = 0; k < STATES; ++k) {
        State & s = states[k];
        VectorXd q(nq), v(n);
        residual = std::max(residual, reinterpret_cast<Random>(door(giver + "_state"))(k, q.data(), v.data()));
        s.q.resize(nq), s.v.resize(n), s.tau.setZero(n);
        for (int i = 0; i < nq; ++i) s.q[given[5 + i]] = q[i];
        for (int i = 0; i < n; ++i) s.v[given[5 + nq + i]] = v[i];
        // Joint forces act where ours has joints too.
        for (int i : ov) s.tau[i] = 0.1 * uniform(random);
        s.a = dense(m, model, data, s);
        ours[k] = {s.q(oq), s.v(ov), s.tau(ov), VectorXd(ov.size()), s.a(ov)};
        reinterpret_cast<Momenta>(door(name + "_momenta"))(ours[k].q.data(), ours[k].v.data(), ours[k].p.data());
    }
    std::vector<Contestant> all;
    bool sound = residual < 1e-12;
    for (const std::string what : {"ours_plain", "ours_native"}) {
        const auto solve = reinterpret_cast<Solve>(find(what, "accelerations"));
        const auto rates = reinterpret_cast<Rates>(find(what, "rates"));
        const int at = x[0];
        all.push_back({what, "accelerations", "", x[4], &ours, [=](const State & s, VectorXd & out) {
            solve(s.q.data(), s.v.data(), s.tau.data(), out.data());
        }, 0, {}});
        all.push_back({what, "rates", "", x[3], &ours, [=](const State & s, VectorXd & out) {
            rates(s.q.data(), s.p.data(), s.tau.data(), out.data(), out.data() + at);
        }, 0, {}});
    }
    VectorXd out = VectorXd::Zero(2 * (nq + n) + 16);
    std::vector<int> repeats, order;
    for (auto & c : all) {
        for (int k = 0; k < STATES; ++k) {
            c.run(ours[k], out);
            if (c.function == "accelerations") {
                c.error = std::max(c.error, off(out.head(x[1]), ours[k].a));
                continue;
            }
            c.error = std::max(c.error, off(out.head(x[0]), VectorXd(coordinate_rate(model, states[k])(oq))));
            // Of the same mechanism the momenta are the same.
            if (name == giver) c.error = std::max(c.error, off(out.segment(x[0], x[1]), VectorXd(momentum_rate(model, data, states[k])(ov))));
        }
        sound &= c.error <= AGREED;
        if (c.error > AGREED) std::fprintf(stderr, "%s: %s %s is off by %.1e\n", name.c_str(), c.name.c_str(), c.function.c_str(), c.error);
    }
    theirs(m, states, WANTED, all);
    for (auto & c : all) {
        order.push_back(order.size());
        slice(c, 2, out);
        repeats.push_back(std::max(1, int(2e5 / (slice(c, 2, out) * STATES))));
    }
    std::mt19937 shuffled(1);
    for (int r = 0; r < rounds; ++r) {
        std::shuffle(order.begin(), order.end(), shuffled);
        for (int i : order) {
            slice(all[i], 1, out); // code and data back into the caches
            all[i].times.push_back(slice(all[i], repeats[i], out));
        }
    }
    for (auto & c : all) {
        std::printf("{\"mechanism\":\"%s\",\"nv\":%d,\"rows\":%d,\"contestant\":\"%s\",\"function\":\"%s\",\"settings\":\"%s\","
                    "\"operations\":%d,\"wanted\":%.1e,\"error\":%.1e,\"ns\":[", name.c_str(), c.states == &ours ? x[1] : n,
            c.states == &ours ? x[2] : int(3 * m.loops.size()), c.name.c_str(), c.function.c_str(), c.settings.c_str(), c.operations, WANTED, c.error);
        for (size_t k = 0; k < c.times.size(); ++k) std::printf(k ? ",%.0f" : "%.0f", c.times[k]);
        std::printf("]}\n");
    }
    std::fflush(stdout);
    return sound;
}

int main(int argc, char ** argv)
{
    bool sound = true;
    for (int k = 4; k < argc; ++k) sound &= race(argv[k], argv[1], argv[2], std::stoi(argv[3]));
    return sound ? 0 : 1;
}
