// casadi MODEL NAME OUT.c HOW: C of (q, v, tau) -> d(q'')/d(q, v, tau) from CasADi's symbols.
// HOW is `algorithm` (sent through Pinocchio's computeABADerivatives) or `jacobian` (CasADi differentiates forward
// dynamics; for models on a fixed base, where increments of q are those of its entries).
#include <pinocchio/autodiff/casadi.hpp>
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>

#include <iostream>
#include <regex>
#include "../theirs/model.hpp"

using casadi::SX;
using Vector = Eigen::Matrix<SX, Eigen::Dynamic, 1>;

static Vector vector(const SX & s)
{
    Vector x(s.size1());
    for (int k = 0; k < s.size1(); ++k) x[k] = s(k);
    return x;
}

int main(int, char ** argv)
{
    const auto model = read_model(argv[1]).cast<SX>();
    pinocchio::DataTpl<SX> data(model);
    const int n = model.nv;
    const SX q = SX::sym("q", model.nq), v = SX::sym("v", n), tau = SX::sym("tau", n);
    SX out;
    if (std::string(argv[4]) == "jacobian") {
        pinocchio::aba(model, data, vector(q), vector(v), vector(tau), pinocchio::Convention::LOCAL);
        SX a(n, 1);
        for (int k = 0; k < n; ++k) a(k) = data.ddq[k];
        // By rows, as the others give them; the mass matrix is symmetric.
        out = SX::vertcat({SX::vec(jacobian(a, q).T()), SX::vec(jacobian(a, v).T()), SX::vec(jacobian(a, tau))});
    } else {
        pinocchio::computeABADerivatives(model, data, vector(q), vector(v), vector(tau));
        out = SX(3 * n * n, 1);
        for (int r = 0; r < n; ++r)
            for (int c = 0; c < n; ++c) {
                out(r * n + c) = data.ddq_dq(r, c);
                out(n * n + r * n + c) = data.ddq_dv(r, c);
                out(2 * n * n + r * n + c) = r <= c ? data.Minv(r, c) : data.Minv(c, r);
            }
    }
    casadi::Function f(std::string(argv[2]) + "_function", {q, v, tau}, {cse(densify(out))});
    int operations = 0;
    for (int k = 0; k < f.n_instructions(); ++k) {
        const auto op = f.instruction_id(k);
        using namespace casadi;
        operations += op == OP_ADD || op == OP_SUB || op == OP_MUL || op == OP_DIV || op == OP_SQ || op == OP_TWICE || op == OP_INV;
    }
    casadi::Dict options;
    options["with_header"] = false;
    options["casadi_real"] = "real";
    casadi::CodeGenerator generator(argv[2], options);
    generator.add(f);
    // Without the tests for absent arguments, and behind the door that all contestants have.
    std::string text = generator.dump();
    text = std::regex_replace(text, std::regex("arg\\[\\d\\]\\? (arg\\[\\d\\]\\[\\d+\\]) : 0;"), "$1;");
    text = std::regex_replace(text, std::regex("if \\(res\\[0\\]!=0\\) "), "");
    std::ofstream(argv[3]) << "#include \"lanes.h\"\n" << text << "\nvoid " << argv[2]
        << "(const real * q, const real * v, const real * tau, real * out)\n{\n"
        << "    const real * arg[] = {q, v, tau};\n    real * res[] = {out};\n    casadi_f0(arg, res, 0, 0, 0);\n}\n";
    std::cout << operations << "\n";
}
