// pinocchio WORK ROUNDS: Pinocchio's articulated-body algorithm under RK4 and DOP853, one JSON line a run.
// pinocchio WORK reference: the end states in long double, from which the errors are measured.
// pinocchio WORK start: accelerations at the start.
// pinocchio WORK evaluation: the time of one evaluation, by convention.
#include <pinocchio/algorithm/aba.hpp>

#include <cstdlib>

#include "../rivals/theirs/model.hpp"
#include "dop853.hpp"
#include "scenes.hpp"

using pinocchio::Convention;

// y = (q, v), y' = (v, ABA(q, v, 0)). All joints are pins: q' = v.
template <class S, int N> struct Field {
    using Model = pinocchio::ModelTpl<S>;
    using Vector = Eigen::Matrix<S, Eigen::Dynamic, 1>;
    Model model;
    pinocchio::DataTpl<S> data;
    Vector q, v, tau;
    Convention convention;

    Field(const pinocchio::Model & from, Convention how)
        : model(from.cast<S>()), data(model), q(N), v(N), tau(Vector::Zero(N)), convention(how)
    {
    }

    void operator()(const State<S, 2 * N> & y, State<S, 2 * N> & dy)
    {
        for (int i = 0; i < N; ++i) q[i] = y[i], v[i] = y[N + i];
        const auto & a = pinocchio::aba(model, data, q, v, tau, convention);
        for (int i = 0; i < N; ++i) dy[i] = y[N + i], dy[N + i] = a[i];
    }
};

template <class S, int N> State<S, 2 * N> start(const Scene & scene)
{
    State<S, 2 * N> y;
    for (int i = 0; i < N; ++i) y[i] = S(scene.q[i]), y[N + i] = S(scene.v[i]);
    return y;
}

template <int N> double evaluation_seconds(Field<double, N> & f, const Scene & scene)
{
    State<double, 2 * N> y = start<double, N>(scene), dy;
    const int many = 2000;
    double least = HUGE_VAL;
    for (int round = 0; round < 200; ++round) {
        const double from = cpu_seconds();
        for (int k = 0; k < many; ++k) {
            // The next state hangs on this one's result, as in an integrator.
            f(y, dy);
            for (int i = 0; i < 2 * N; ++i) y[i] += 1e-6 * dy[i];
        }
        least = std::min(least, (cpu_seconds() - from) / many);
    }
    return least;
}

template <int N> Convention faster(const pinocchio::Model & model, const Scene & scene, bool tell)
{
    double seconds[2];
    const Convention both[] = {Convention::LOCAL, Convention::WORLD};
    for (int c = 0; c < 2; ++c) {
        Field<double, N> f(model, both[c]);
        seconds[c] = evaluation_seconds(f, scene);
        if (tell)
            std::printf("{\"tool\": \"pinocchio\", \"version\": \"%s\", \"scene\": \"%s\", \"evaluation\": \"ABA, %s\", \"ns\": %.1f}\n",
                PINOCCHIO_VERSION, scene.name.c_str(), c ? "world" : "local", 1e9 * seconds[c]);
    }
    return seconds[0] <= seconds[1] ? both[0] : both[1];
}

template <int N> void race(const pinocchio::Model & model, const Scene & scene, int rounds)
{
    Field<double, N> f(model, faster<N>(model, scene, false));
    using Y = State<double, 2 * N>;
    Y y;
    auto line = [&](const char * method, const std::string & setting, double seconds, long evaluations) {
        print_line("pinocchio", PINOCCHIO_VERSION, scene, method, setting, seconds, evaluations, &y[0], &y[N]);
    };
    for (const double h : fixed_steps()) {
        const long steps = std::lround(scene.t_end / h);
        long evaluations = 0;
        const double seconds = least_seconds(rounds, [&] {
            y = start<double, N>(scene);
            evaluations = rk4<double, 2 * N>(f, y, scene.t_end, steps);
        });
        line("rk4", "h=" + number("%g", h), seconds, evaluations);
    }
    for (const double beta : {0.0, 0.04})
        for (int digits = 3; digits <= 14; ++digits) {
            const double tolerance = std::pow(10, -digits);
            long evaluations = 0;
            bool done = false;
            const double seconds = least_seconds(rounds, [&] {
                y = start<double, N>(scene);
                Dop853<double, 2 * N, Field<double, N>> method{f, tolerance, tolerance, beta};
                done = method.run(y, scene.t_end);
                evaluations = method.evaluations;
            });
            if (done) line(beta == 0 ? "dop853" : "dop853 pi", "tol=" + number("%g", tolerance), seconds, evaluations);
            else std::fprintf(stderr, "%s: dop853 fails at tolerance %g\n", scene.name.c_str(), tolerance);
        }
}

template <int N> void reference(const pinocchio::Model & model, const Scene & scene)
{
    using S = long double;
    Field<S, N> f(model, Convention::LOCAL);
    for (const S tolerance : {1e-15L, 1e-17L}) {
        auto y = start<S, N>(scene);
        Dop853<S, 2 * N, Field<S, N>> method{f, tolerance, tolerance, 0};
        const double from = cpu_seconds();
        if (!method.run(y, scene.t_end)) throw std::runtime_error("no reference for " + scene.name);
        double out[2 * N];
        std::copy(y.begin(), y.end(), out);
        print_line("pinocchio", PINOCCHIO_VERSION, scene, "dop853 long double", "tol=" + number("%g", double(tolerance)),
            cpu_seconds() - from, method.evaluations, out, out + N);
    }
}

template <int N> void handle(const pinocchio::Model & model, const Scene & scene, const std::string & what)
{
    if (what == "reference") reference<N>(model, scene);
    else if (what == "start") {
        State<double, 2 * N> y = start<double, N>(scene), dy;
        Field<double, N>(model, Convention::LOCAL)(y, dy);
        print_start("pinocchio", scene, &dy[N]);
    } else if (what == "evaluation") faster<N>(model, scene, true);
    else race<N>(model, scene, std::stoi(what));
}

int main(int argc, char ** argv)
{
    if (argc != 3) return std::fprintf(stderr, "usage: pinocchio WORK ROUNDS|reference|start|evaluation\n"), 2;
    const std::string work = argv[1];
    for (const Scene & scene : read_scenes(work)) {
        const auto model = read_model(work + "/" + scene.name + ".model");
        switch (scene.q.size()) {
        case 6: handle<6>(model, scene, argv[2]); break;
        case 7: handle<7>(model, scene, argv[2]); break;
        default: throw std::runtime_error("not compiled for the joints of " + scene.name);
        }
    }
}
