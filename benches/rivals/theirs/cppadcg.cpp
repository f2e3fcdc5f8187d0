// cppadcg MODEL NAME OUT.c: C of (q, v, tau) -> a from CppADCodeGen's numbers sent through Pinocchio's forward dynamics.
#include <cppad/cg.hpp>

// CppADCodeGen 2.4.3 lacks what this CppAD asks of its numbers.
namespace CppAD {
template <>
class numeric_limits<AD<cg::CG<double>>> {
    using Number = AD<cg::CG<double>>;
    using Limits = std::numeric_limits<double>;
    static Number of(double x) { return Number(cg::CG<double>(x)); }

public:
    static Number epsilon() { return of(Limits::epsilon()); }
    static Number min() { return of(Limits::min()); }
    static Number max() { return of(Limits::max()); }
    static Number quiet_NaN() { return of(Limits::quiet_NaN()); }
    static Number infinity() { return of(Limits::infinity()); }
    static const int digits10 = Limits::digits10;
    static const int max_digits10 = Limits::max_digits10;
};
} // namespace CppAD

#include <pinocchio/codegen/cppadcg.hpp>
#include <pinocchio/algorithm/aba.hpp>

#include <iostream>
#include <regex>
#include <sstream>
#include "model.hpp"

using CG = CppAD::cg::CG<double>;
using AD = CppAD::AD<CG>;
using Vector = Eigen::Matrix<AD, Eigen::Dynamic, 1>;

int main(int, char ** argv)
{
    const auto model = read_model(argv[1]).cast<AD>();
    pinocchio::DataTpl<AD> data(model);
    const int nq = model.nq, nv = model.nv;
    Vector x(nq + 2 * nv), y(nv);
    x.setOnes();
    CppAD::Independent(x);
    const Vector q = x.head(nq), v = x.segment(nq, nv), tau = x.tail(nv);
    y = pinocchio::aba(model, data, q, v, tau, pinocchio::Convention::LOCAL);
    CppAD::ADFun<CG> function(x, y);
    function.optimize("no_compare_op");
    // Its own generator would take the WORLD convention; the steps from here on are those it takes.
    CppAD::cg::CodeHandler<double> handler;
    std::vector<CG> inputs(x.size());
    handler.makeVariables(inputs);
    auto outputs = function.Forward(0, inputs);
    CppAD::cg::LanguageC<double> language("double");
    CppAD::cg::LangCDefaultVariableNameGenerator<double> names("y", "x", "w");
    std::ostringstream body;
    handler.generateCode(body, language, outputs, names);
    const std::string text = body.str();
    // One array of inputs becomes three, behind the door that all contestants have.
    const size_t temporaries = std::max<size_t>(handler.getTemporaryVariableCount(), 1);
    std::ofstream out(argv[3]);
    out << "#include \"lanes.h\"\nvoid " << argv[2]
        << "(const real * q, const real * v, const real * tau, real * restrict y)\n{\n    real w[" << temporaries << "];\n";
    const std::regex input("\\bx\\[(\\d+)\\]"), operation(" [-+*/] ");
    size_t at = 0;
    for (std::sregex_iterator m(text.begin(), text.end(), input), end; m != end; ++m) {
        const int k = std::stoi((*m)[1]);
        out << text.substr(at, m->position() - at);
        if (k < nq) out << "q[" << k << "]";
        else if (k < nq + nv) out << "v[" << k - nq << "]";
        else out << "tau[" << k - nq - nv << "]";
        at = m->position() + m->length();
    }
    out << text.substr(at) << "}\n";
    std::cout << std::distance(std::sregex_iterator(text.begin(), text.end(), operation), {}) << "\n";
}
