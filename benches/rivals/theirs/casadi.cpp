// casadi MODEL NAME OUT.c: C of (q, v, tau) -> a from CasADi's symbols sent through Pinocchio's forward dynamics.
#include <pinocchio/autodiff/casadi.hpp>
#include <pinocchio/algorithm/aba.hpp>

#include <iostream>
#include <regex>
#include "model.hpp"

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
    const SX q = SX::sym("q", model.nq), v = SX::sym("v", model.nv), tau = SX::sym("tau", model.nv);
    pinocchio::aba(model, data, vector(q), vector(v), vector(tau), pinocchio::Convention::LOCAL);
    SX a(model.nv, 1);
    for (int k = 0; k < model.nv; ++k) a(k) = data.ddq[k];
    // Common subexpressions: CasADi's symbols are not shared by themselves.
    casadi::Function f(std::string(argv[2]) + "_function", {q, v, tau}, {cse(a)});
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
