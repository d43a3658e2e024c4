"""Random numbers that depend on nothing but their key, and the directions that are made of them.

A number is a hash of (seed, pixel, sample index, dimension): the same on every run, thread count and backend, and any
range of samples can be rendered anywhere. Every function here works on one number, and on a vector of them for packets.
"""

import taichi as ti
import taichi.math as tm

from taichi_tracer.system import runtime

# Dimensions: what a pair of numbers is for. A new use takes a new one, so that no two are correlated.
PIXEL, BRDF_DIRECTION, LIGHT_DIRECTION = 0, 1, 2


@ti.dataclass
class SampleKey:
    """Which sample of which pixel."""

    seed: ti.u32
    pixel: ti.u32
    index: ti.u32


@ti.func
def pcg4d(a, b, c, d):
    """Four well-mixed words from four (Jarzynski & Olano, "Hash functions for GPU rendering", JCGT 9(3), 2020)."""
    a, b, c, d = _advance(a), _advance(b), _advance(c), _advance(d)
    a, b, c, d = _mix(a, b, c, d)
    a, b, c, d = a ^ (a >> 16), b ^ (b >> 16), c ^ (c >> 16), d ^ (d >> 16)
    return _mix(a, b, c, d)


@ti.func
def _advance(word):
    return word * ti.u32(1664525) + ti.u32(1013904223)


@ti.func
def _mix(a, b, c, d):
    a1 = a + b * d
    b1 = b + c * a1
    c1 = c + a1 * b1
    d1 = d + b1 * c1
    return a1, b1, c1, d1


@ti.func
def as_fraction(word):
    """A word as a number in [0, 1), never 1: its upper 24 bits, or all 32 in f64."""
    if ti.static(runtime.current().precision == "f64"):
        return ti.cast(word, ti.f64) * (1.0 / (1 << 16)) * (1.0 / (1 << 16))
    else:  # noqa: RET505 (without it, both would be compiled)
        return ti.cast(ti.cast(word >> 8, ti.i32), ti.f32) * (1.0 / (1 << 24))


@ti.func
def reverse_bits(word):
    """The 32 bits in the opposite order."""
    word = (word >> 16) | (word << 16)
    word = ((word & ti.u32(0xFF00FF00)) >> 8) | ((word & ti.u32(0x00FF00FF)) << 8)
    word = ((word & ti.u32(0xF0F0F0F0)) >> 4) | ((word & ti.u32(0x0F0F0F0F)) << 4)
    word = ((word & ti.u32(0xCCCCCCCC)) >> 2) | ((word & ti.u32(0x33333333)) << 2)
    return ((word & ti.u32(0xAAAAAAAA)) >> 1) | ((word & ti.u32(0x55555555)) << 1)


@ti.func
def scramble_reversed(word, seed):
    """Owen's nested scrambling of a number whose bits are reversed: each bit is flipped depending on those below it.

    Laine & Karras' hash with the constants of Vegdahl, as used by Burley, "Practical hash-based Owen scrambling", JCGT
    9(4), 2020, section 3.2.
    """
    word = word ^ (word * ti.u32(0x3D20ADEA))
    word = word + seed
    word = word * ((seed >> 16) | ti.u32(1))
    word = word ^ (word * ti.u32(0x05526C56))
    return word ^ (word * ti.u32(0x53A22864))


@ti.func
def pascal_matrix(word):
    """The second generator matrix of Sobol', C(j, i) mod 2, times the bits of ``word``; the result is reversed."""
    word = word ^ ((word >> 16) & ti.u32(0x0000FFFF))
    word = word ^ ((word >> 8) & ti.u32(0x00FF00FF))
    word = word ^ ((word >> 4) & ti.u32(0x0F0F0F0F))
    word = word ^ ((word >> 2) & ti.u32(0x33333333))
    return word ^ ((word >> 1) & ti.u32(0x55555555))


class IndependentSampler:
    """Independent uniform numbers: error falls with n^(−1/2), whatever the integrand."""

    name, replicated = "independent", False

    @staticmethod
    @ti.func
    def get_2d(seed, pixel, index, dimension):
        """Two numbers in [0, 1)."""
        zero = ti.u32(0) * pixel  # makes vectors of the others where the pixel is one
        a, b, _, _ = pcg4d(pixel, index + zero, dimension + zero, seed + zero)
        return as_fraction(a), as_fraction(b)


class SobolSampler:
    """Owen-scrambled Sobol' points, one pair of dimensions for each use, shuffled against each other (Burley 2020).

    Samples of even and of odd index belong to two sequences, scrambled independently, whose difference tells the error
    (``error_estimate``). The first 2^m samples of each are a (0, m, 2)-net in every pair: one in each box of volume
    2^−m. Error falls towards n^(−3/2) where the integrand is smooth, and hardly ever above that of the other sampler.
    """

    name, replicated = "sobol", True

    @staticmethod
    @ti.func
    def get_2d(seed, pixel, index, dimension):
        """Two numbers in [0, 1)."""
        zero = ti.u32(0) * pixel  # as above
        replica, place = index & ti.u32(1), index >> 1
        shuffle, seed_x, seed_y, _ = pcg4d(pixel, dimension + zero, seed + zero, replica + zero)
        shuffled = reverse_bits(scramble_reversed(reverse_bits(place + zero), shuffle))
        x = reverse_bits(scramble_reversed(shuffled, seed_x))
        y = reverse_bits(scramble_reversed(pascal_matrix(shuffled), seed_y))
        return as_fraction(x), as_fraction(y)


ALL = (SobolSampler, IndependentSampler)


@ti.func
def get_2d(sampler: ti.template(), key, dimension):
    """Two numbers in [0, 1) for one use in one sample of one pixel."""
    x, y = sampler.get_2d(key.seed, key.pixel, key.index, ti.u32(dimension))
    return tm.vec2(x, y)


@ti.func
def frame_about(n):
    """Two unit vectors that make a right-handed frame with the unit vector n (Duff et al., JCGT 6(1), 2017)."""
    sign = ti.select(n.z >= 0, 1.0, -1.0)
    a = -1 / (sign + n.z)
    b = n.x * n.y * a
    return tm.vec3(1 + sign * n.x * n.x * a, sign * b, -sign * n.x), tm.vec3(b, sign + n.y * n.y * a, -n.y)


@ti.func
def from_frame(n, cosine, sine, phi):
    """The unit vector at an angle from n, turned by φ about it."""
    x_axis, y_axis = frame_about(n)
    return sine * ti.cos(phi) * x_axis + sine * ti.sin(phi) * y_axis + cosine * n


@ti.func
def uniform_sphere(xi):
    """A direction uniform on the sphere; pdf 1/(4π) per solid angle (A2-6)."""
    z = 2 * xi.x - 1
    r = ti.sqrt(ti.max(0.0, 1 - z * z))
    phi = 2 * tm.pi * xi.y
    return tm.vec3(r * ti.cos(phi), r * ti.sin(phi), z)


@ti.func
def uniform_hemisphere(n, xi):
    """A direction uniform on the hemisphere about n; pdf 1/(2π) per solid angle."""
    return from_frame(n, xi.x, ti.sqrt(ti.max(0.0, 1 - xi.x * xi.x)), 2 * tm.pi * xi.y)


@ti.func
def cosine_hemisphere(n, xi):
    """A direction about n with pdf max(0, ω·n)/π per solid angle: ω_z = √ξ (A2-7, α = 1)."""
    return from_frame(n, ti.sqrt(xi.x), ti.sqrt(1 - xi.x), 2 * tm.pi * xi.y)


@ti.func
def power_cosine(axis, exponent, xi):
    """A direction about ``axis`` with pdf (α+1)/(2π) max(0, ω·axis)^α per solid angle (A2-7, ω_z = ξ^(1/(α+1))).

    sin² comes first, from 1 − exp(2 ln ξ/(α+1)): in f32, ξ^(1/(α+1)) near 1 has only a few hundred values for α = 10⁶.
    """
    a = -2 * ti.log(ti.max(xi.x, SMALLEST_XI)) / (exponent + 1)
    sine_squared = ti.select(a < 1e-2, a - a * a / 2 + a * a * a / 6, 1 - ti.exp(-a))
    cosine = ti.sqrt(ti.max(0.0, 1 - sine_squared))
    return from_frame(axis, cosine, ti.sqrt(ti.max(0.0, sine_squared)), 2 * tm.pi * xi.y)


SMALLEST_XI = 2.0**-25  # in place of 0, whose logarithm is infinite: half of the next number
