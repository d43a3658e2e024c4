"""Parts with one mistake each, as somebody writes them, and what must be told: for tests of ``system.own_code``.

The wrong line ends with "# here". A text that begins with "note: " is a warning, and the picture is made.
"""

# ruff: noqa: E501  (a row for each mistake)

HEAD = """import math
import random

import numpy as np
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt

TABLE = [0.1, 0.5, 0.9]
ARRAY = np.array(TABLE)
"""
INDENT = "    "


def method(signature, *lines, decorator="@ti.func"):
    """The text of a method in a class."""
    body = [f"{INDENT}{line}" for line in lines]
    return "\n".join(f"{INDENT}{line}" for line in [*filter(None, [decorator]), f"def {signature}:", *body]) + "\n"


def part(base, *members, before=""):
    """The text of a file with a part called "mine"."""
    whole = [HEAD, before, f'\n@tt.register\nclass Mine(tt.{base}):\n{INDENT}name = "mine"\n', *members]
    return "\n".join(whole)


def view(*lines, before="", members=(), signature="color(self, hit)", **more):
    """A view whose colour is made by some lines."""
    return part("View", *members, method(signature, *lines, **more), before=before)


def integrator(*lines, **more):
    """An integrator whose radiance is made by some lines."""
    return part("Integrator", method("radiance(self, scene, ray, hit, rng)", *lines, **more))


METHODS = {
    "describes": method("describes(self, material, dtype)", "return True", decorator=""),
    "eval": method("eval(self, material, w_o, w_i, n)", "return material.Kd / tm.pi"),
    "pdf": method("pdf(self, material, w_o, w_i, n)", "return 1 / (2 * tm.pi)"),
    "sample": method("sample(self, material, w_o, n, xi)", "return n"),
}


def brdf(**others):
    """A BRDF with some methods that are not the right ones; None leaves one out."""
    return part("Brdf", *filter(None, (METHODS | others).values()))


def intersector(*lines):
    """An intersector whose test of a triangle is made by some lines."""
    return part("RayIntersector", method("intersect_triangle(self, ray, triangle_id)", *lines))


def function(text):
    """A function with @ti.func before the class."""
    return f"\n@ti.func\n{text}\n"


FAC = "def fac(n):\n    r = 1\n    if n > 1:\n        r = n * fac(n - 1)  # here\n    return r"
WITH_IF = ("p = 0.0", "if tm.dot(n, w_i) > 0:", "    p = 0.3", "return p")

WRONG = {
    # ── methods ──
    "no return": (view("c = abs(hit.normal)"), r"Mine.color has no return with a value. It gives: The RGB colour"),
    "no return in a helper method": (
        view("return 0.5 * self.shade(hit)", members=[method("shade(self, hit)  ", "c = hit.normal")]),
        r"self.shade has no return with a value, and \S+:\d+ needs one",
    ),
    "no return in a helper": (
        view("return 0.5 * shade(hit.normal)", before=function("def shade(n):\n    c = abs(n)")),
        r"shade has no return with a value, and \S+:\d+ needs one",
    ),
    "no such member": (
        intersector("return tt.HitData(is_hit=1, dist=2.0)  # here"),
        r"unknown member of HitData 'dist': did you mean 'distance'\?",
    ),
    "bare return": (view("c = tm.vec3(1)", "return"), r"Mine.color has no return with a value"),
    "None is returned": (view("return None"), r"Mine.color has no return with a value"),
    "no argument": (view("return tm.vec3(1)", signature="color(self)"), r"called as Mine.color\(hit\), but it takes"),
    "an argument too many": (
        view("return tm.vec3(1)", signature="color(self, hit, ray)"),
        r"is called as Mine.color\(hit\), but ray comes from nowhere",
    ),
    "an argument too few": (
        brdf(eval=method("eval(self, material, w_o, w_i)", "return material.Kd")),
        r"MyBrdf|Mine.eval is called as Mine.eval\(material, w_o, w_i, n\), but it takes only material, w_o, w_i",
    ),
    "arguments in another order": (
        brdf(sample=method("sample(self, material, n, w_o, xi)", "return n")),
        r"its arguments stand in another order, material, n, w_o, xi",
    ),
    "no self": (view("return abs(hit.normal)", signature="color(hit)"), r"color has no self"),
    "no @ti.func": (view("return abs(hit.normal)", decorator=""), r"Mine.color runs in kernels: write @ti.func above"),
    "no @ti.func, and an if": (
        brdf(pdf=method("pdf(self, material, w_o, w_i, n)", *WITH_IF, decorator="")),
        r"Mine.pdf runs in kernels: write @ti.func above it",
    ),
    "no @ti.func at a helper": (
        view("return shade(hit.normal)", before="\ndef shade(n):\n    return -n if n.z > 0 else n  # here\n"),
        r"a number of a kernel has no attribute 'z': does a function lack @ti.func\?",
    ),
    "no @ti.func at a helper that decides": (
        view("return tm.vec3(shade(hit.distance))", before="\ndef shade(t):\n    return 1 if t > 2 else t\n"),
        r"shade is called in a kernel: write @ti.func above it",
    ),
    "a method is missing": (brdf(pdf=None), r"Mine lacks pdf\(self, material, w_o, w_i, n\). It gives: The density of"),
    "a plain method is missing": (brdf(describes=None), r"Mine lacks describes\(self, material, dtype\)"),
    "an integrator without a method": (
        part("Integrator", "    pass"),
        r"Mine lacks radiance\(self, scene, ray, hit, rng",
    ),
    "a sampler without a method": (part("Sampler", "    pass"), r"Mine lacks get_2d\(self, seed, pixel, index, dim"),
    "a misspelt method": (
        brdf(sample=method("sampel(self, material, w_o, n, xi)", "return n")),
        r"Mine lacks sample\(self, material, w_o, n, xi\): is 'sampel' misspelt\?",
    ),
    "a British method": (view("return tm.vec3(1)", signature="colour(self, hit)"), r"is 'colour' misspelt\?"),
    "a misspelt method that is optional": (
        brdf(wieght=method("wieght(self, material, w_o, w_i, n)", "return material.Kd")),
        r"note: .*nothing calls Mine.wieght: did you mean 'weight'\?",
    ),
    # ── what is returned ──
    "a number for a colour": (
        view("return hit.normal.z  # here"),
        r"returns a number, but a vec3 is needed: tm.vec3\(x\)",
    ),
    "a number for f_r": (
        brdf(eval=method("eval(self, material, w_o, w_i, n)", "return 0.3  # here")),
        r"Mine.eval returns a number, but a vec3 is needed",
    ),
    "a vector for a density": (
        brdf(pdf=method("pdf(self, material, w_o, w_i, n)", "return tm.vec3(1)  # here")),
        r"Mine.pdf returns a vec3, but a number is needed: is it one component, a length or a dot product\?",
    ),
    "a truth for a density": (
        brdf(pdf=method("pdf(self, material, w_o, w_i, n)", "return n.z > 0  # here")),
        r"Mine.pdf returns True or False, but a number is needed: ti.select",
    ),
    "two numbers for three": (view("return hit.normal.xy  # here"), r"returns a vec2, but a vec3 is needed"),
    "a tuple": (
        view("return hit.normal.x, 0.0, 1.0  # here"),
        r"returns 3 values, but a vec3 .*write tm.vec3\(a, b, c\)",
    ),
    "a list": (view("return [hit.normal.x, 0.0, 1.0]  # here"), r"returns 3 values, but a vec3 is needed"),
    "a struct": (view("return hit  # here"), r"returns a struct with the members is_hit, .* but a vec3 is needed"),
    "a number for a hit": (intersector("return 1.0  # here"), r"returns a number, but a tt.HitData is needed"),
    "a vector for a ray": (
        part("Camera", method("generate_ray(self, pixel_x, pixel_y)", "return tm.vec3(1)  # here")),
        r"Mine.generate_ray returns a vec3, but a tt.Ray is needed",
    ),
    "three results for five": (
        HEAD
        + function("def mine(o, d, v0, v1, v2):\n    return 1, 1.0, 0.2  # here")
        + 'tt.register(tt.TriangleTest("mine", mine))\n',
        r"mine returns 3 values, but 5 are needed: \(True or False, a number, a number, a number, a number\)",
    ),
    # ── names ──
    "an unknown name": (view("return abs(hitt.normal)  # here"), r"hitt is not defined: did you mean 'hit'\?"),
    "a name of a module": (
        view("return tm.vec3(ti.sine(1.0))  # here"),
        r"module taichi has no attribute 'sine': .*'sin'",
    ),
    "a name without its module": (view("return vec3(1)  # here"), r"vec3 is not defined: did you mean 'tm.vec3'\?"),
    "a member of a hit": (
        view("return abs(hit.norml)  # here"),
        r"the struct has no member 'norml': .*'normal'\? It has",
    ),
    "a member in small letters": (
        brdf(eval=method("eval(self, material, w_o, w_i, n)", "return material.kd  # here")),
        r"no member 'kd': did you mean 'Kd'\?",
    ),
    "a member of a ray": (
        intersector("hit = tt.HitData()", "hit.distance = ray.dir.x  # here", "return hit"),
        r"write ray.direction",
    ),
    "an attribute of self": (
        view("return hit.normal * self.scal  # here", members=["    scale = 0.5\n"]),
        r"Mine has no attribute 'scal': did you mean 'scale'\?",
    ),
    "a method of rng": (
        integrator("return tm.vec3(rng.next2d().x)  # here"),
        r"has no attribute 'next2d': .*'next_2d'",
    ),
    "a name of one branch": (
        view("if hit.normal.z > 0:", "    c = tm.vec3(1)", "return c  # here"),
        r"c is known only in the if or loop of line \d+: give it a value before",
    ),
    "a fourth component": (view("return tm.vec3(hit.normal.w)  # here"), r"vec3 only has attributes=\('x', 'y', 'z'\)"),
    # ── the language of kernels ──
    "more than 32 bits": (
        view("return tm.vec3(12345678901)  # here"),
        r"12345678901 has more than 32 bits: write ti.u64",
    ),
    "recursion": (view("return fac(3) * hit.normal", before=function(FAC)), r"a function calls itself, .*write a loop"),
    "a text": (view('mode = "red"  # here', "return hit.normal"), r"a text is no value of a kernel: use a number"),
    "a struct that becomes a vector": (view("hit = tm.vec3(0)  # here", "return hit"), r"holds a struct, and the new"),
    "a number that becomes a vector": (
        view("c = 0.0", "c = abs(hit.normal)  # here", "return c"),
        r"a variable that holds a number cannot get a vec3: begin with tm.vec3\(0\)",
    ),
    "an early return": (
        view("if hit.normal.z > 0:", "    return tm.vec3(1)  # here", "return tm.vec3(0)"),
        r"a return stands in an if or in a loop: keep the value in a variable",
    ),
    "try": (
        view("try:  # here", "    c = 1", "except ValueError:", "    pass", "return hit.normal"),
        r"no try in kernels",
    ),
    "lambda": (view("f = lambda x: 2 * x  # here", "return f(hit.normal)"), r"no lambda in kernels: write a function"),
    "global": (view("global TABLE  # here", "return hit.normal"), r"there is no global in kernels"),
    "is not": (
        view("return hit.normal if hit is not None else tm.vec3(0)  # here"),
        r"there is no `is not` in kernels",
    ),
    "a function of numpy": (
        view("return tm.vec3(np.sqrt(hit.distance))  # here"),
        r"numpy.sqrt is a .*: write ti.sqrt",
    ),
    "a function of math": (
        view("return tm.vec3(math.sqrt(hit.distance))  # here"),
        r"math.sqrt is a .*: write ti.sqrt",
    ),
    "an array of numpy": (view("return tm.vec3(ARRAY[hit.triangle_id])  # here"), r"no index of a numpy array comes"),
    "a list of Python": (
        view("return tm.vec3(TABLE[hit.triangle_id])  # here"),
        r"no index of a list comes from",
    ),
    "a format": (view('print(f"{hit.distance:.2g} {hit}")  # here', "return hit.normal"), r"a format such as :.2g"),
    "a change of self": (
        view("self.scale = hit.distance  # here", "return hit.normal", members=["    scale = 0.5\n"]),
        r"self.scale is a value of Python: a kernel changes variables and ti.fields",
    ),
    "a lambda as a method": (
        HEAD + 'tt.register(tt.View("mine", "Mine", ti.func(lambda hit: hit.normal)))  # here\n',
        r"kernels call no lambda: write a function with def",
    ),
    # ── notes ──
    "a fraction for a whole number": (
        view("c = 0", "c += abs(hit.normal.x)  # here", "return tm.vec3(c)"),
        r"note: .*a whole number gets a number with a fraction, which is cut off",
    ),
    "a random number of Python": (view("return tm.vec3(random.random())  # here"), r"note: .*random.random runs once"),
}
