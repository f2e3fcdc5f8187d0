#!/usr/bin/env python3
"""Coefficients of collocation methods, as they stand in src/integrate/tableau/implicit.rs.

Needs mpmath. The nodes are the zeros of a Legendre polynomial (Gauss) or of P_s(2c - 1) - P_(s-1)(2c - 1) (Radau IIA);
row i of A are the integrals of the Lagrange polynomials from 0 to c_i, b those from 0 to 1. The modes of A, its eigenvalues
with right and left eigenvectors, stand in src/integrate/tableau/modes.rs.
"""
from mpmath import eig, im, legendre, matrix, mp, mpf, nstr, polyroots, re, taylor

mp.dps = 80


def shifted_legendre(s):
    """Coefficients of P_s(2 x - 1), constant first."""
    return [mpf(round(c)) for c in taylor(lambda x: legendre(s, 2 * x - 1), 0, s)]


def lagrange(c, j):
    """Coefficients of the polynomial that is 1 at node j and 0 at the others, constant first."""
    p = [mpf(1)]
    for k, ck in enumerate(c):
        if k != j:
            p = [(a - ck * b) / (c[j] - ck) for a, b in zip([0] + p, p + [0])]
    return p


def text(x):
    """36 digits behind the first that counts, without zeros at the end."""
    if abs(x) < mpf(10) ** -60:
        return "0"
    return nstr(x, 36, strip_zeros=True, min_fixed=-30, max_fixed=30).removesuffix(".0")


def modes(a):
    """Eigenvalues of A, of a pair the one with positive imaginary part, the real one first. Products of left with right
    eigenvectors are 1, of pairs 2; the largest component of a right one is 1."""
    values, left, right = eig(matrix(a), left=True, right=True)
    s = len(a)
    order = sorted((k for k in range(s) if im(values[k]) > -mpf(10) ** -60), key=lambda k: abs(im(values[k])))
    for k in order:
        r, l = [right[i, k] for i in range(s)], [left[k, i] for i in range(s)]
        largest = max(r, key=abs)
        r = [x / largest for x in r]
        scale = sum(x * y for x, y in zip(l, r)) / (1 if abs(im(values[k])) < mpf(10) ** -60 else 2)
        l = [x / scale for x in l]
        print("value:", text(re(values[k])), text(im(values[k])))
        for name, v in (("right", r), ("left", l)):
            print(f"{name}:", " ".join(text(re(x)) for x in v), "|", " ".join(text(im(x)) for x in v))


def show(title, polynomial):
    c = sorted(polyroots(polynomial[::-1], maxsteps=500, extraprec=500))
    s = len(c)
    polynomials = [lagrange(c, j) for j in range(s)]
    integral = lambda p, x: sum(a * x ** (k + 1) / (k + 1) for k, a in enumerate(p))
    print(f"{title}, {s} stages")
    print("c:", " ".join(map(text, c)))
    a = [[integral(p, x) for p in polynomials] for x in c]
    for row in a:
        print("a:", " ".join(map(text, row)))
    print("b:", " ".join(text(integral(p, 1)) for p in polynomials))
    modes(a)


for s in (2, 3, 6):
    show("Gauss", shifted_legendre(s))
high, low = shifted_legendre(3), shifted_legendre(2) + [mpf(0)]
show("Radau IIA", [a - b for a, b in zip(high, low)])
