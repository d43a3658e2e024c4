"""Hashes and Sobol' points by their definitions, in Python integers."""

MASK = 0xFFFFFFFF


def pcg4d(a, b, c, d):
    """Jarzynski & Olano 2020, listing of pcg4d."""
    v = [(x * 1664525 + 1013904223) & MASK for x in (a, b, c, d)]
    for _ in range(2):
        v[0] = (v[0] + v[1] * v[3]) & MASK
        v[1] = (v[1] + v[2] * v[0]) & MASK
        v[2] = (v[2] + v[0] * v[1]) & MASK
        v[3] = (v[3] + v[1] * v[2]) & MASK
        if _ == 0:
            v = [x ^ (x >> 16) for x in v]
    return v


def sobol(index):
    """The first two Sobol' numbers of an index, 32 bits each; direction numbers 2^31, and v_k = v_(k−1) ⊕ v_(k−1)/2."""
    x = int(f"{index:032b}"[::-1], 2)
    y, v = 0, 1 << 31
    while index:
        if index & 1:
            y ^= v
        index >>= 1
        v ^= v >> 1
    return x, y
