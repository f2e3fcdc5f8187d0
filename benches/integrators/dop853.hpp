// Dormand and Prince's method of order 8(5,3) with Hairer's step control.
//
// Coefficients and control: E. Hairer, S. P. Nørsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed.,
// section II.10, and the program DOP853 that goes with it; no stiffness detection, no dense output.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

struct Term {
    int stage;
    long double weight;
};

namespace dop853 {
constexpr int STAGES = 12;
// Rows end with a stage of -1. After the stages: the weights of the result, the error estimator of order 5, the solution of
// order 3, which is the other estimator when the result is taken from it.
constexpr int RESULT = 11, ERROR5 = 12, LOW = 13;
constexpr Term A[STAGES + 2][13] = {
    {{0, 5.26001519587677318785587544488e-2L}, {-1, 0}},
    {{0, 1.97250569845378994544595329183e-2L}, {1, 5.91751709536136983633785987549e-2L}, {-1, 0}},
    {{0, 2.95875854768068491816892993775e-2L}, {2, 8.87627564304205475450678981324e-2L}, {-1, 0}},
    {{0, 2.41365134159266685502369798665e-1L}, {2, -8.84549479328286085344864962717e-1L},
     {3, 9.24834003261792003115737966543e-1L}, {-1, 0}},
    {{0, 3.7037037037037037037037037037e-2L}, {3, 1.70828608729473871279604482173e-1L},
     {4, 1.25467687566822425016691814123e-1L}, {-1, 0}},
    {{0, 3.7109375e-2L}, {3, 1.70252211019544039314978060272e-1L}, {4, 6.02165389804559606850219397283e-2L},
     {5, -1.7578125e-2L}, {-1, 0}},
    {{0, 3.70920001185047927108779319836e-2L}, {3, 1.70383925712239993810214054705e-1L},
     {4, 1.07262030446373284651809199168e-1L}, {5, -1.53194377486244017527936158236e-2L},
     {6, 8.27378916381402288758473766002e-3L}, {-1, 0}},
    {{0, 6.24110958716075717114429577812e-1L}, {3, -3.36089262944694129406857109825L},
     {4, -8.68219346841726006818189891453e-1L}, {5, 2.75920996994467083049415600797e1L},
     {6, 2.01540675504778934086186788979e1L}, {7, -4.34898841810699588477366255144e1L}, {-1, 0}},
    {{0, 4.77662536438264365890433908527e-1L}, {3, -2.48811461997166764192642586468L},
     {4, -5.90290826836842996371446475743e-1L}, {5, 2.12300514481811942347288949897e1L},
     {6, 1.52792336328824235832596922938e1L}, {7, -3.32882109689848629194453265587e1L},
     {8, -2.03312017085086261358222928593e-2L}, {-1, 0}},
    {{0, -9.3714243008598732571704021658e-1L}, {3, 5.18637242884406370830023853209L},
     {4, 1.09143734899672957818500254654L}, {5, -8.14978701074692612513997267357L},
     {6, -1.85200656599969598641566180701e1L}, {7, 2.27394870993505042818970056734e1L},
     {8, 2.49360555267965238987089396762L}, {9, -3.0467644718982195003823669022L}, {-1, 0}},
    {{0, 2.27331014751653820792359768449L}, {3, -1.05344954667372501984066689879e1L},
     {4, -2.00087205822486249909675718444L}, {5, -1.79589318631187989172765950534e1L},
     {6, 2.79488845294199600508499808837e1L}, {7, -2.85899827713502369474065508674L},
     {8, -8.87285693353062954433549289258L}, {9, 1.23605671757943030647266201528e1L},
     {10, 6.43392746015763530355970484046e-1L}, {-1, 0}},
    {{0, 5.42937341165687622380535766363e-2L}, {5, 4.45031289275240888144113950566L},
     {6, 1.89151789931450038304281599044L}, {7, -5.8012039600105847814672114227L},
     {8, 3.1116436695781989440891606237e-1L}, {9, -1.52160949662516078556178806805e-1L},
     {10, 2.01365400804030348374776537501e-1L}, {11, 4.47106157277725905176885569043e-2L}, {-1, 0}},
    {{0, 0.1312004499419488073250102996e-1L}, {5, -0.1225156446376204440720569753e1L},
     {6, -0.4957589496572501915214079952L}, {7, 0.1664377182454986536961530415e1L},
     {8, -0.3503288487499736816886487290L}, {9, 0.3341791187130174790297318841L},
     {10, 0.8192320648511571246570742613e-1L}, {11, -0.2235530786388629525884427845e-1L}, {-1, 0}},
    {{0, 0.244094488188976377952755905512L}, {8, 0.733846688281611857341361741547L},
     {11, 0.220588235294117647058823529412e-1L}, {-1, 0}},
};

constexpr int terms(int row)
{
    int n = 0;
    while (A[row][n].stage >= 0) ++n;
    return n;
}
} // namespace dop853

template <class S, int N> using State = std::array<S, N>;

// Sum of a row of the table over the stages, unrolled by the compiler.
template <int ROW, class S, int N, int... I>
void combine(const State<S, N> * k, State<S, N> & out, std::integer_sequence<int, I...>)
{
    for (int i = 0; i < N; ++i) out[i] = (... + (static_cast<S>(dop853::A[ROW][I].weight) * k[dop853::A[ROW][I].stage][i]));
}

template <int ROW, class S, int N> void combine(const State<S, N> * k, State<S, N> & out)
{
    combine<ROW, S, N>(k, out, std::make_integer_sequence<int, dop853::terms(ROW)>());
}

template <class S, int N, class F> struct Dop853 {
    F & f;          // f(y, dy)
    S atol, rtol;
    S beta;         // 0: Hairer's default; 0.04: with memory of the last error
    long evaluations = 0, accepted = 0, rejected = 0;

    S scale(S a, S b) const { return atol + rtol * std::max(std::abs(a), std::abs(b)); }

    // Hairer's HINIT.
    S first_step(const State<S, N> & y, const State<S, N> & k, S longest)
    {
        S dnf = 0, dny = 0;
        for (int i = 0; i < N; ++i) {
            const S s = scale(y[i], y[i]);
            dnf += (k[i] / s) * (k[i] / s), dny += (y[i] / s) * (y[i] / s);
        }
        S h = dnf <= S(1e-10) || dny <= S(1e-10) ? S(1e-6) : std::sqrt(dny / dnf) * S(0.01);
        h = std::min(h, longest);
        State<S, N> next, there;
        for (int i = 0; i < N; ++i) next[i] = y[i] + h * k[i];
        f(next, there), ++evaluations;
        S der2 = 0;
        for (int i = 0; i < N; ++i) {
            const S d = (there[i] - k[i]) / scale(y[i], y[i]);
            der2 += d * d;
        }
        const S steep = std::max(std::sqrt(der2) / h, std::sqrt(dnf));
        const S h1 = steep <= S(1e-15) ? std::max(S(1e-6), h * S(1e-3)) : std::pow(S(0.01) / steep, S(1) / 8);
        return std::min({100 * h, h1, longest});
    }

    template <int ROW> void stage(const State<S, N> & y, S h, State<S, N> * k)
    {
        State<S, N> x;
        combine<ROW, S, N>(k, x);
        for (int i = 0; i < N; ++i) x[i] = y[i] + h * x[i];
        f(x, k[ROW + 1]), ++evaluations;
    }

    template <int... ROW> void stages(const State<S, N> & y, S h, State<S, N> * k, std::integer_sequence<int, ROW...>)
    {
        (stage<ROW>(y, h, k), ...);
    }

    // False where the step becomes too small or the error is no number.
    bool run(State<S, N> & y, S end)
    {
        const S safety = S(0.9), slower = 1 / S(0.333), faster = 1 / S(6);
        const S power = S(1) / 8 - beta * S(0.2);
        State<S, N> k[dop853::STAGES], sum, next, low;
        S t = 0, last_error = S(1e-4);
        f(y, k[0]), ++evaluations;
        S h = first_step(y, k[0], end);
        bool rejecting = false;
        for (bool last = false; !last;) {
            if (S(0.1) * h <= t * std::numeric_limits<S>::epsilon()) return false;
            if (t + S(1.01) * h >= end) h = end - t, last = true;
            stages(y, h, k, std::make_integer_sequence<int, dop853::STAGES - 1>());
            combine<dop853::RESULT, S, N>(k, sum);
            for (int i = 0; i < N; ++i) next[i] = y[i] + h * sum[i];
            combine<dop853::LOW, S, N>(k, low);
            S err3 = 0;
            for (int i = 0; i < N; ++i) {
                const S e = (sum[i] - low[i]) / scale(y[i], next[i]);
                err3 += e * e;
            }
            combine<dop853::ERROR5, S, N>(k, low);
            S err5 = 0;
            for (int i = 0; i < N; ++i) {
                const S e = low[i] / scale(y[i], next[i]);
                err5 += e * e;
            }
            S both = err5 + S(0.01) * err3;
            if (both <= 0) both = 1;
            const S error = h * err5 * std::sqrt(1 / (N * both));
            if (!(error == error)) return false;
            const S plain = std::pow(error, power);
            const S factor = std::clamp(plain / (beta == 0 ? S(1) : std::pow(last_error, beta)) / safety, faster, slower);
            if (error <= 1) {
                last_error = std::max(error, S(1e-4));
                ++accepted;
                t += h;
                y = next;
                if (last) return true;
                f(y, k[0]), ++evaluations;
                h = rejecting ? std::min(h / factor, h) : h / factor;
                rejecting = false;
            } else {
                h /= std::min(slower, plain / safety);
                ++rejected;
                rejecting = true, last = false;
            }
        }
        return true;
    }
};

// The classical method of order 4 with `steps` equal steps.
template <class S, int N, class F> long rk4(F & f, State<S, N> & y, S end, long steps)
{
    const S h = end / steps;
    State<S, N> k1, k2, k3, k4, x;
    for (long n = 0; n < steps; ++n) {
        f(y, k1);
        for (int i = 0; i < N; ++i) x[i] = y[i] + h / 2 * k1[i];
        f(x, k2);
        for (int i = 0; i < N; ++i) x[i] = y[i] + h / 2 * k2[i];
        f(x, k3);
        for (int i = 0; i < N; ++i) x[i] = y[i] + h * k3[i];
        f(x, k4);
        for (int i = 0; i < N; ++i) y[i] += h / 6 * (k1[i] + 2 * (k2[i] + k3[i]) + k4[i]);
    }
    return 4 * steps;
}
