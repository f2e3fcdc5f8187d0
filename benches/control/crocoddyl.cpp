// Crocoddyl's control-limited DDP on a problem of scenes.py, timed in this process, on one thread.
//
// usage: crocoddyl MODEL PROBLEM RULE SOLVES     (RULE: midpoint, euler)
// Prints one JSON object: the cost after every iteration and how many trajectories it tried, the processor seconds of every
// solve, those of one direction and one short step at the solution (as much work as a full one), and the last trajectory.
#include "../rivals/theirs/model.hpp"

#include <crocoddyl/core/activations/weighted-quadratic.hpp>
#include <crocoddyl/core/costs/cost-sum.hpp>
#include <crocoddyl/core/costs/residual.hpp>
#include <crocoddyl/core/integrator/euler.hpp>
#include <crocoddyl/core/integrator/rk.hpp>
#include <crocoddyl/core/residuals/control.hpp>
#include <crocoddyl/core/solvers/box-ddp.hpp>
#include <crocoddyl/multibody/actions/free-fwddyn.hpp>
#include <crocoddyl/multibody/actuations/full.hpp>
#include <crocoddyl/multibody/residuals/state.hpp>
#include <crocoddyl/multibody/states/multibody.hpp>

#include <cmath>
#include <cstdio>
#include <ctime>
#include <fstream>
#include <memory>

using namespace crocoddyl;
using Eigen::VectorXd;

struct Problem
{
    int nodes, nx, nu;
    double length;
    VectorXd start, goal, running, end, effort, low, high, guess, driven;

    explicit Problem(const char * path)
    {
        std::ifstream in(path);
        in >> nodes >> length >> nx >> nu;
        for (VectorXd * x : {&start, &goal, &running, &end}) read(in, *x, nx);
        for (VectorXd * x : {&effort, &low, &high, &guess, &driven}) read(in, *x, nu);
        if (!in) throw std::runtime_error(std::string("cannot make sense of ") + path);
    }

    static void read(std::istream & in, VectorXd & x, int n)
    {
        x.resize(n);
        for (int i = 0; i < n; ++i) in >> x[i];
    }
};

// Motors at some of the joints; Crocoddyl's own models drive all joints, or all but a floating base.
class SomeJoints : public ActuationModelAbstract
{
public:
    SomeJoints(std::shared_ptr<StateAbstract> state, const VectorXd & driven)
        : ActuationModelAbstract(state, driven.size()), driven_(driven.cast<int>())
    {
    }

    void calc(const std::shared_ptr<ActuationDataAbstract> & data, const Eigen::Ref<const VectorXd> &,
              const Eigen::Ref<const VectorXd> & u) override
    {
        for (int i = 0; i < driven_.size(); ++i) data->tau[driven_[i]] = u[i];
    }

    // The derivative is constant, and stands in the data from the start, as in Crocoddyl's own models.
    void calcDiff(const std::shared_ptr<ActuationDataAbstract> &, const Eigen::Ref<const VectorXd> &,
                  const Eigen::Ref<const VectorXd> &) override
    {
    }

    void commands(const std::shared_ptr<ActuationDataAbstract> & data, const Eigen::Ref<const VectorXd> &,
                  const Eigen::Ref<const VectorXd> & tau) override
    {
        for (int i = 0; i < driven_.size(); ++i) data->u[i] = tau[driven_[i]];
    }

    std::shared_ptr<ActuationModelBase> cloneAsDouble() const override { return std::make_shared<SomeJoints>(*this); }
    std::shared_ptr<ActuationModelBase> cloneAsFloat() const override { throw std::runtime_error("double only"); }

    std::shared_ptr<ActuationDataAbstract> createData() override
    {
        auto data = ActuationModelAbstract::createData();
        for (int i = 0; i < driven_.size(); ++i) {
            data->dtau_du(driven_[i], i) = 1;
            data->Mtau(i, driven_[i]) = 1;
        }
        return data;
    }

private:
    Eigen::VectorXi driven_;
};

// One node: the weights are those of the problem, divided by the length of a step, with which Crocoddyl multiplies.
std::shared_ptr<ActionModelAbstract> node(const Problem & p, std::shared_ptr<StateMultibody> state,
                                          std::shared_ptr<ActuationModelAbstract> actuation, const std::string & rule, bool last)
{
    auto costs = std::make_shared<CostModelSum>(state, p.nu);
    const double scale = last ? 1 : 1 / p.length;
    const VectorXd & weights = last ? p.end : p.running;
    if (weights.cwiseAbs().maxCoeff() > 0) {
        costs->addCost("state",
                       std::make_shared<CostModelResidual>(state,
                                                           std::make_shared<ActivationModelWeightedQuad>(weights * scale),
                                                           std::make_shared<ResidualModelState>(state, p.goal, p.nu)),
                       1);
    }
    if (!last) {
        costs->addCost("effort",
                       std::make_shared<CostModelResidual>(state,
                                                           std::make_shared<ActivationModelWeightedQuad>(p.effort * scale),
                                                           std::make_shared<ResidualModelControl>(state, p.nu)),
                       1);
    }
    auto motion = std::make_shared<DifferentialActionModelFreeFwdDynamics>(state, actuation, costs);
    std::shared_ptr<ActionModelAbstract> action;
    if (rule == "midpoint")
        action = std::make_shared<IntegratedActionModelRK>(motion, RKType::two, last ? 0 : p.length);
    else if (rule == "euler")
        action = std::make_shared<IntegratedActionModelEuler>(motion, last ? 0 : p.length);
    else
        throw std::runtime_error("rule " + rule);
    action->set_u_lb(p.low);
    action->set_u_ub(p.high);
    return action;
}

// Keeps the cost of every iteration, and how many trajectories were tried: lengths are halved, at most down to 2^-9.
struct Trace : CallbackAbstract
{
    std::vector<double> costs, tried;
    void operator()(SolverAbstract & solver) override
    {
        costs.push_back(solver.get_cost());
        tried.push_back(1 - std::log2(solver.get_steplength()));
    }
};

// Whether the library reads this model as Pinocchio does: joint forces that hold it still must hold it still.
void check_gravity(const pinocchio::Model & model, const Problem & p, std::shared_ptr<StateMultibody> state)
{
    pinocchio::Data data(model);
    const VectorXd q = p.goal.head(model.nq) + VectorXd::Constant(model.nq, 0.3), still = VectorXd::Zero(model.nv);
    VectorXd x(p.nx);
    x << q, still;
    const VectorXd hold = pinocchio::rnea(model, data, q, still, still);
    auto actuation = std::make_shared<ActuationModelFull>(state);
    DifferentialActionModelFreeFwdDynamics motion(state, actuation, std::make_shared<CostModelSum>(state));
    auto moved = motion.createData();
    motion.calc(moved, x, hold);
    if (moved->xout.norm() > 1e-6) throw std::runtime_error("the library does not know gravity: was it built for this Pinocchio?");
}

double seconds()
{
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

template <typename Numbers> void print(const char * name, const Numbers & x)
{
    printf("\"%s\": [", name);
    for (size_t i = 0; i < (size_t)x.size(); ++i) printf(i ? ", %.17g" : "%.17g", (double)x[i]);
    printf("]");
}

int main(int count, char ** arguments)
try {
    if (count != 5) throw std::runtime_error("usage: crocoddyl MODEL PROBLEM RULE SOLVES");
    auto model = std::make_shared<pinocchio::Model>(read_model(arguments[1]));
    const Problem p(arguments[2]);
    auto state = std::make_shared<StateMultibody>(model);
    check_gravity(*model, p, state);
    std::shared_ptr<ActuationModelAbstract> actuation = std::make_shared<SomeJoints>(state, p.driven);
    std::vector<std::shared_ptr<ActionModelAbstract>> nodes;
    for (int k = 0; k + 1 < p.nodes; ++k) nodes.push_back(node(p, state, actuation, arguments[3], false));
    auto problem = std::make_shared<ShootingProblem>(p.start, nodes, node(p, state, actuation, arguments[3], true));
    problem->set_nthreads(1);
    SolverBoxDDP solver(problem);
    const std::vector<VectorXd> us(p.nodes - 1, p.guess);
    const std::vector<VectorXd> xs = problem->rollout_us(us);
    const size_t most = 500;

    auto trace = std::make_shared<Trace>();
    solver.setCallbacks({trace});
    const double first = problem->calc(xs, us);
    solver.solve(xs, us, most, true);
    solver.setCallbacks({});
    std::vector<double> times;
    for (int k = 0; k < atoi(arguments[4]); ++k) {
        const double before = seconds();
        solver.solve(xs, us, most, true);
        times.push_back(seconds() - before);
    }
    std::vector<double> full;
    for (size_t k = 0; k < 20 * times.size(); ++k) {
        const double before = seconds();
        solver.computeDirection(true);
        solver.tryStep(1. / 512);
        full.push_back(seconds() - before);
    }
    printf("{\"first\": %.17g, ", first);
    print("costs", trace->costs);
    printf(", ");
    print("tried", trace->tried);
    printf(", ");
    print("seconds", times);
    printf(", ");
    print("full", full);
    std::vector<double> x, u;
    for (const VectorXd & v : solver.get_xs()) x.insert(x.end(), v.data(), v.data() + v.size());
    for (const VectorXd & v : solver.get_us()) u.insert(u.end(), v.data(), v.data() + v.size());
    printf(", ");
    print("x", x);
    printf(", ");
    print("u", u);
    printf("}\n");
} catch (const std::exception & e) {
    fprintf(stderr, "crocoddyl: %s\n", e.what());
    return 1;
}
