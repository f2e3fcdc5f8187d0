// Time of Pinocchio's articulated-body algorithm for one state, ns: the least of many rounds of 64 random states.
// usage: aba FILE.model ...     (files of models.py)
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>

#include <chrono>
#include <cstdio>
#include <vector>

#include "model.hpp"

int main(int argc, char ** argv)
{
    constexpr int states = 64, rounds = 400;
    for (int file = 1; file < argc; ++file) {
        const pinocchio::Model model = read_model(argv[file]);
        pinocchio::Data data(model);
        std::vector<Eigen::VectorXd> q, v;
        for (int k = 0; k < states; ++k) {
            v.push_back(Eigen::VectorXd::Random(model.nv));
            q.push_back(pinocchio::integrate(model, pinocchio::neutral(model), v.back()));
        }
        const Eigen::VectorXd tau = Eigen::VectorXd::Zero(model.nv);
        double least[2] = {1e30, 1e30}, sum = 0;
        for (int round = 0; round < rounds; ++round)
            for (int c = 0; c < 2; ++c) {
                const auto convention = c ? pinocchio::Convention::WORLD : pinocchio::Convention::LOCAL;
                const auto from = std::chrono::steady_clock::now();
                for (int k = 0; k < states; ++k) sum += pinocchio::aba(model, data, q[k], v[k], tau, convention)[0];
                const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - from;
                least[c] = std::min(least[c], spent.count() / states);
            }
        std::printf("%s: local %.0f ns, world %.0f ns (%d)\n", model.name.c_str(), least[0], least[1], sum == 0);
    }
}
