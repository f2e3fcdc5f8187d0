// Scenes as scenes.py writes them, and the line that every program here prints.
#pragma once
#include <time.h>

#include <algorithm>
#include <cstdio>
#include <fstream>
#include <limits>
#include <string>
#include <vector>

struct Scene {
    std::string name;
    double t_end;
    std::vector<double> q, v;
};

inline std::vector<Scene> read_scenes(const std::string & work)
{
    std::vector<Scene> all;
    std::ifstream in(work + "/scenes.txt");
    Scene s;
    for (size_t n; in >> s.name >> s.t_end >> n;) {
        s.q.resize(n), s.v.resize(n);
        for (double & x : s.q) in >> x;
        for (double & x : s.v) in >> x;
        all.push_back(s);
    }
    return all;
}

// Processor time of this thread, s: what others do on the machine is not counted.
inline double cpu_seconds()
{
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

// Shortest time that is measured, s: shorter runs are repeated for so long, as this project's are.
inline constexpr double shortest = 0.02;

// Least processor time of `run` over `rounds` or more, or over as many as fit into some seconds.
template <class Run> double least_seconds(int rounds, Run run)
{
    double least = std::numeric_limits<double>::infinity();
    const double begin = cpu_seconds();
    const auto spent = [&] { return cpu_seconds() - begin; };
    for (int r = 0; r == 0 || (spent() < 4 && (r < rounds || spent() < shortest)); ++r) {
        const double from = cpu_seconds();
        run();
        least = std::min(least, cpu_seconds() - from);
    }
    return least;
}

// Fixed steps of the work-precision curves, s.
inline const std::vector<double> & fixed_steps()
{
    static const std::vector<double> steps = {1e-2, 5e-3, 2e-3, 1e-3, 5e-4, 2e-4, 1e-4, 5e-5, 2e-5, 1e-5};
    return steps;
}

inline std::string number(const char * format, double x)
{
    char text[64];
    std::snprintf(text, sizeof text, format, x);
    return text;
}

// JSON knows no NaN.
inline std::string list(const double * x, size_t n)
{
    std::string text = "[";
    for (size_t i = 0; i < n; ++i) text += (i ? ", " : "") + (x[i] - x[i] == 0 ? number("%.17g", x[i]) : std::string("null"));
    return text + "]";
}

inline void print_line(const char * tool, const std::string & version, const Scene & scene, const char * method,
                       const std::string & setting, double seconds, long evaluations, const double * q, const double * v)
{
    std::printf("{\"tool\": \"%s\", \"version\": \"%s\", \"scene\": \"%s\", \"method\": \"%s\", \"setting\": \"%s\", "
                "\"cpu_s\": %.9g, \"evaluations\": %ld, \"t_end\": %.17g, \"q\": %s, \"v\": %s}\n",
        tool, version.c_str(), scene.name.c_str(), method, setting.c_str(), seconds, evaluations, scene.t_end,
        list(q, scene.q.size()).c_str(), list(v, scene.v.size()).c_str());
    std::fflush(stdout);
}

inline void print_start(const char * tool, const Scene & scene, const double * a)
{
    std::printf("{\"tool\": \"%s\", \"scene\": \"%s\", \"a\": %s}\n", tool, scene.name.c_str(), list(a, scene.v.size()).c_str());
}
