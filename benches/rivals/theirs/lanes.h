/* Numbers of the generated C: one double, or eight at once with -DLANES=8. */
#pragma once
#include <math.h>

#if defined(LANES)
typedef double real __attribute__((ext_vector_type(8)));
#define sqrt __builtin_elementwise_sqrt
/* Sines and cosines of the C library's vector half (libmvec). */
#if defined(__AVX512F__)
real _ZGVeN8v_sin(real);
real _ZGVeN8v_cos(real);
#define sin _ZGVeN8v_sin
#define cos _ZGVeN8v_cos
#else
typedef double half __attribute__((ext_vector_type(4)));
half _ZGVdN4v_sin(half);
half _ZGVdN4v_cos(half);
static inline real both(half f(half), real x)
{
    const half lo = f(x.lo), hi = f(x.hi);
    return (real){lo[0], lo[1], lo[2], lo[3], hi[0], hi[1], hi[2], hi[3]};
}
#define sin(x) both(_ZGVdN4v_sin, x)
#define cos(x) both(_ZGVdN4v_cos, x)
#endif
#else
typedef double real;
#endif
