"""The forest of this folder: an RT3 document in which one leaf stands in two million places.

``make_scenes.py`` writes it. All numbers have few digits, so that the file is the same on every machine.
"""

GOLDEN_ANGLE = 137.508  # degrees between one twig and the next: no two are above each other
LEAVES, TWIGS, TREES, GROVES = 16, 90, 24, 6  # of a twig, of a tree, of a grove, and along each side of the forest
SPACING = 24  # of groves, in metres

HEADER = """<!-- A forest. One leaf of two triangles stands in twigs, twigs stand in trees, trees in groves, and
     groves in the forest: {leaves:,} leaves. Written by make_forest.py. -->
<RT3>
<lookat look_from="8 13 -84" look_at="0 3.5 0" up="0 1 0"/>
<camera type="perspective" fovy="34"/>
<film type="image" x_res="768" y_res="432" filename="renders/forest.png" img_type="png"/>
<integrator type="direct" estimator="mis" spp="16"/>

<world_begin/>
<background type="spherical" filename="../environments/sunny.npy" rotation="110"/>
<make_named_material name="needles" type="matte" diffuse="0.13 0.24 0.07"/>
<make_named_material name="bark" type="matte" diffuse="0.24 0.17 0.11"/>
<make_named_material name="ground" type="matte" diffuse="0.3 0.27 0.18"/>
"""
GROUND = {"vertices": "-900 0 -900  900 0 -900  900 0 900  -900 0 900", "indices": "0 2 1  0 3 2"}


class Dice:
    """Numbers from 0 to 1 that look random (Lehmer; Park & Miller 1988)."""

    def __init__(self, seed):
        self.state = seed

    def roll(self, low=0.0, high=1.0):
        """-> a number between two others"""
        self.state = self.state * 48271 % (2**31 - 1)
        return low + (high - low) * self.state / (2**31 - 1)


def tag(element, **attributes):
    """-> an element without content"""
    told = "".join(f' {key}="{value}"' for key, value in attributes.items())
    return f"<{element}{told}/>"


def numbers(*values):
    """-> text with three digits behind the point, at most"""
    return " ".join(f"{value:.3f}".rstrip("0").rstrip(".") for value in values)


def called(name, *transforms):
    """-> the lines that put an instance into a place"""
    return [tag("push_CTM"), *transforms, tag("object_instance_call", name=name), tag("pop_CTM")]


def instance(name, lines):
    """-> the lines of an instance"""
    return [tag("object_instance_begin", name=name), *lines, tag("object_instance_end")]


def cone(material, radius, height):
    """-> a trunk or a stem of six sides, along y"""
    ring = [(1, 0), (0.5, 0.866), (-0.5, 0.866), (-1, 0), (-0.5, -0.866), (0.5, -0.866)]
    points = [(radius * x, 0, radius * z) for x, z in ring] + [(0, height, 0)]
    faces = [(k, 6, (k + 1) % 6) for k in range(6)]
    vertices = "  ".join(numbers(*point) for point in points)
    indices = "  ".join(" ".join(map(str, face)) for face in faces)
    return tag("object", type="trianglemesh", material=material, vertices=vertices, indices=indices)


def turn(angle, axis):
    """-> a rotation in degrees"""
    return tag("rotate", angle=numbers(angle), axis=axis)


def move(*by):
    """-> a translation"""
    return tag("translate", value=numbers(*by))


def forest():
    """-> path below this folder -> bytes"""
    dice = Dice(2026)
    leaf = tag(
        "object",
        type="trianglemesh",
        material="needles",
        vertices="0 0 0  0.11 0.03 0.2  0 0 0.55  -0.11 0.03 0.2",
        indices="0 1 2  0 2 3",
    )
    twig = [turn(90, "1 0 0"), cone("bark", 0.03, 1), turn(-90, "1 0 0")]
    for k in range(LEAVES):
        side = 58 if k % 2 else -58
        along = 0.12 + 0.88 * k / LEAVES
        aside, twist = turn(side + dice.roll(-14, 14), "0 1 0"), turn(dice.roll(-35, 35), "0 0 1")
        twig += called("leaf", move(0, 0, along), aside, twist)
    tree = [cone("bark", 0.22, 8)]
    for k in range(TWIGS):
        height = 1.2 + 6.7 * k / TWIGS
        size = 0.35 + 2.1 * (1 - k / TWIGS) * dice.roll(0.8, 1.1)
        size = tag("scale", value=numbers(size))
        droop = turn(12 + dice.roll(-8, 16), "1 0 0")
        tree += called("twig", move(0, height, 0), turn(GOLDEN_ANGLE * k, "0 1 0"), droop, size)
    grove = []
    for k in range(TREES):
        x, z = (k % 5 - 2) * 4.8 + dice.roll(-1.6, 1.6), (k // 5 - 2) * 4.8 + dice.roll(-1.6, 1.6)
        lean, size = turn(dice.roll(-3, 3), "1 0 0"), dice.roll(0.6, 1.3)
        height = tag("scale", value=numbers(size, size * dice.roll(0.85, 1.2), size))
        grove += called("tree", move(x, 0, z), turn(360 * dice.roll(), "0 1 0"), lean, height)
    world = []
    for i in range(GROVES):
        for j in range(GROVES):
            x, z = (i - (GROVES - 1) / 2) * SPACING, (j - (GROVES - 1) / 2) * SPACING
            mirrored = [tag("scale", value="-1 1 1")] if (i + j) % 2 else []
            world += called("grove", move(x, 0, z), turn(90 * int(4 * dice.roll()), "0 1 0"), *mirrored)
    lines = [tag("object", type="trianglemesh", material="ground", **GROUND), *instance("leaf", [leaf])]
    lines += [*instance("twig", twig), *instance("tree", tree), *instance("grove", grove), *world]
    leaves = LEAVES * TWIGS * TREES * GROVES**2
    text = HEADER.format(leaves=leaves) + "\n".join([*lines, "<world_end/>", "</RT3>", ""])
    return {"rt3/forest.xml": text.encode()}
