"""The known mistakes of assignment 1: each is a small change of the solution."""

X_NDC = "ndc_coords.x = 2 * (pixel_x + 0.5) / self.width - 1"
Y_NDC = "ndc_coords.y = 2 * (pixel_y + 0.5) / self.height - 1"
TAN = "ti.tan(self.fov * tm.pi / 180 / 2)"
DIRECTION = "world_coords = self.camera_to_world[None] @ camera_coords"
INSIDE = "u >= 0 and v >= 0 and u + v <= 1 and t > self.EPSILON"
NORMAL = "tm.normalize(w * n0 + u * n1 + v * n2)"
CLOSER = "hit.is_hit and hit.distance < nearest.distance"
# The mistake of four views; that of the id −1 is black by itself.
MISS = "Which colour has a ray that hits nothing?", ("if hit_data.is_hit:", "if True:")

MISTAKES = {
    "Camera.generate_ndc_coords": {
        "pixel corner instead of centre": (
            "Through which point of the pixel does the ray pass?",
            ("(pixel_x + 0.5)", "pixel_x"),
            ("(pixel_y + 0.5)", "pixel_y"),
        ),
        "y axis points down": (
            "Where is pixel (0, 0), and in which direction does y grow in NDC?",
            (Y_NDC, "ndc_coords.y = 1 - 2 * (pixel_y + 0.5) / self.height"),
        ),
        "x axis mirrored": (
            "At which edge of the picture is x = -1?",
            (X_NDC, "ndc_coords.x = 1 - 2 * (pixel_x + 0.5) / self.width"),
        ),
        "width and height exchanged": (
            "By which size is each coordinate divided?",
            ("self.width", "self.HEIGHT"),
            ("self.height", "self.width"),
            ("self.HEIGHT", "self.height"),
        ),
        "range [0, 1] instead of [-1, 1]": (
            "Which numbers do the corners of the picture have?",
            (X_NDC, "ndc_coords.x = (pixel_x + 0.5) / self.width"),
            (Y_NDC, "ndc_coords.y = (pixel_y + 0.5) / self.height"),
        ),
        "centres of the outer pixels at the corners": (
            "How many pixels wide is the picture, from edge to edge?",
            (X_NDC, "ndc_coords.x = 2 * pixel_x / (self.width - 1) - 1"),
            (Y_NDC, "ndc_coords.y = 2 * pixel_y / (self.height - 1) - 1"),
        ),
        "divided by the size less 1": (
            "How many pixels wide is the picture, from edge to edge?",
            (X_NDC, "ndc_coords.x = 2 * (pixel_x + 0.5) / (self.width - 1) - 1"),
            (Y_NDC, "ndc_coords.y = 2 * (pixel_y + 0.5) / (self.height - 1) - 1"),
        ),
    },
    "Camera.generate_camera_coords": {
        "fov taken as the horizontal angle": (
            "Does fov span the width or the height of the picture?",
            ("ndc_coords.x * tan_half_fov * aspect", "ndc_coords.x * tan_half_fov"),
            ("camera_coords.y = ndc_coords.y * tan_half_fov", "camera_coords.y = ndc_coords.y * tan_half_fov / aspect"),
        ),
        "degrees given to tan": ("Which unit does tan expect?", (TAN, "ti.tan(self.fov / 2)")),
        "fov not halved": (
            "Which part of fov lies above the centre of the picture?",
            (TAN, "ti.tan(self.fov * tm.pi / 180)"),
        ),
        "the angle instead of its tangent": (
            "The image plane is flat: which function turns an angle into a length on it?",
            (TAN, "self.fov * tm.pi / 180 / 2"),
        ),
        "aspect inverted": ("Is a wide picture wider in x?", ("self.width / self.height", "self.height / self.width")),
        "aspect forgotten": ("What happens to a circle in a wide picture?", (" * aspect", "")),
        "w = 1 instead of 0": (
            "What does a translation do to a direction?",
            ("camera_coords.z = 1", "camera_coords.z = 1\n        camera_coords.w = 1"),
        ),
        "looks along -z": (
            "Along which axis of its own does this camera look?",
            ("camera_coords.z = 1", "camera_coords.z = -1"),
        ),
    },
    "Camera.compute_matrix": {
        "x_c not normalised": (
            "How long is a cross product of vectors that are not perpendicular?",
            ("x_c = side / np.linalg.norm(side)", "x_c = side"),
        ),
        "up x z_c turned round": (
            "The order of the factors of a cross product matters.",
            ("np.cross(self.up, z_c)", "np.cross(z_c, self.up)"),
        ),
        "y_c turned round": (
            "The order of the factors of a cross product matters.",
            ("np.cross(z_c, x_c)", "np.cross(x_c, z_c)"),
        ),
        "matrix transposed": (
            "Are the axes of the camera the rows or the columns?",
            ("matrix[:3, 3] = self.eye", "matrix[:3, 3] = self.eye\n        matrix = matrix.T"),
        ),
        "z_c points backwards": (
            "Does the camera look along +z or along -z?",
            ("(self.at - self.eye) / ", "(self.eye - self.at) / "),
        ),
        "z_c not normalised": (
            "How long is the vector from the eye to the point that it looks at?",
            (" / np.linalg.norm(self.at - self.eye)", ""),
        ),
        "translation forgotten": (
            "Where in the world is the origin of the camera's coordinates?",
            ("matrix[:3, 3] = self.eye", ""),
        ),
        "up taken as y_c": (
            "Is up perpendicular to the gaze?",
            ("np.cross(z_c, x_c)", "self.up / np.linalg.norm(self.up)"),
        ),
    },
    "Camera.generate_ray": {
        "direction not normalised": (
            "How long should the direction be?",
            ("tm.normalize(world_coords.xyz)", "world_coords.xyz"),
        ),
        "direction transformed as a point (w = 1)": (
            "What does a translation do to a direction?",
            (DIRECTION, DIRECTION.replace("camera_coords", "tm.vec4(camera_coords.xyz, 1)")),
        ),
        "origin at 0 instead of the eye": ("Where do eye rays start?", ("ray.origin = self.eye", "")),
        "direction left in camera coordinates": (
            "In which coordinates does the scene stand?",
            (DIRECTION, "world_coords = camera_coords"),
        ),
        "matrix multiplied from the wrong side": (
            "Does the vector stand to the left or to the right of the matrix?",
            (DIRECTION, "world_coords = self.camera_to_world[None].transpose() @ camera_coords"),
        ),
        "pixel x and y exchanged": ("Which coordinate comes first?", ("(pixel_x, pixel_y)", "(pixel_y, pixel_x)")),
        "direction reversed": (
            "Does the direction lead away from the eye?",
            ("tm.normalize(world_coords.xyz)", "-tm.normalize(world_coords.xyz)"),
        ),
        "origin on the image plane": (
            "Which point do all rays of this camera share?",
            ("ray.origin = self.eye", "ray.origin = self.eye + world_coords.xyz"),
        ),
    },
    "RayIntersector.intersect_triangle": {
        "one-sided test: det > epsilon": (
            "Which sign does det have if the ray meets the back?",
            ("abs(det) > self.EPSILON", "det > self.EPSILON"),
        ),
        "u and v exchanged": ("Which of u and v belongs to v1?", ("tm.vec2(u, v)", "tm.vec2(v, u)")),
        "u + v <= 1 forgotten": (
            "Which shape is 0 <= u <= 1, 0 <= v <= 1?",
            (INSIDE, "u >= 0 and v >= 0 and u <= 1 and v <= 1 and t > self.EPSILON"),
        ),
        "t not tested": ("What does a negative t mean?", (" and t > self.EPSILON", "")),
        "flat normal instead of the interpolated one": (
            "Which normals vary within a triangle?",
            (NORMAL, "tm.normalize(tm.cross(e1, e2))"),
        ),
        "normal not normalised again": ("How long is a mean of unit vectors?", (NORMAL, "w * n0 + u * n1 + v * n2")),
        "weights of the normals in the wrong order": (
            "Which weight belongs to which corner?",
            (NORMAL, "tm.normalize(u * n0 + v * n1 + w * n2)"),
        ),
        "normal not turned round on the back": (
            "Should the normal face the origin of the ray?",
            ("normal = -normal", "normal = normal"),
        ),
    },
    "RayIntersector.query_ray": {
        "the last hit is kept": ("Which of several hits counts?", (CLOSER, "hit.is_hit")),
        "the first hit is kept": (
            "Is the first triangle of the list the nearest?",
            (CLOSER, "hit.is_hit and not nearest.is_hit"),
        ),
        "the farthest hit is kept": (
            "Which of several hits does the eye see?",
            (CLOSER, "hit.is_hit and (not nearest.is_hit or hit.distance > nearest.distance)"),
        ),
        "back-facing hits treated as misses": (
            "Is a triangle visible from behind?",
            (CLOSER, CLOSER + " and not hit.is_backfacing"),
        ),
        "the last triangles are not tried": (
            "Where does range end?",
            ("range(self.geometry.n_triangles)", "range(self.geometry.n_triangles // 2)"),
        ),
        "material of the loop's last triangle": (
            "Whose material is recorded?",
            (
                "nearest = hit",
                "nearest = hit\n"
                "        nearest.material_id = self.geometry.triangle_material_ids[self.geometry.n_triangles - 1]",
            ),
        ),
        "the last triangle is skipped": (
            "Where does range end?",
            ("range(self.geometry.n_triangles)", "range(self.geometry.n_triangles - 1)"),
        ),
        "the first triangle is skipped": (
            "Which id has the first triangle?",
            ("range(self.geometry.n_triangles)", "range(1, self.geometry.n_triangles)"),
        ),
    },
    "A1Renderer.shade_hit": {
        "colours of front and back exchanged": (
            "Which side is white?",
            ("if hit_data.is_backfacing", "if not hit_data.is_backfacing"),
        ),
        "misses are not black": MISS,
    },
    "A1Renderer.shade_triangle_id": {
        "id_color of the material": ("Which id is shown?", ("triangle_id)", "material_id)")),
        "1 added twice": ("What does id_color add itself?", ("triangle_id)", "triangle_id + 1)")),
    },
    "A1Renderer.shade_distance": {
        "distance not limited": (
            "What is the largest number of a colour?",
            ("tm.clamp(hit_data.distance / self.max_distance, 0, 1)", "hit_data.distance / self.max_distance"),
        ),
        "near is white": ("Is the eye black or white?", ("tm.vec3(tm.clamp", "tm.vec3(1 - tm.clamp")),
        "distance not divided": ("Which distance is white?", (" / self.max_distance", "")),
        "misses are not black": MISS,
    },
    "A1Renderer.shade_barycentric": {
        "w shown first": ("Which weight is red?", ("(u, v, 1 - u - v)", "(1 - u - v, u, v)")),
        "w missing": ("What is the third weight?", ("(u, v, 1 - u - v)", "(u, v, 0)")),
        "misses are not black": MISS,
    },
    "A1Renderer.shade_normal": {
        "normal not mapped to [0, 1]": ("Can a colour be negative?", ("(hit_data.normal + 1) / 2", "hit_data.normal")),
        "absolute value of the normal": (
            "Do opposite normals have different colours?",
            ("(hit_data.normal + 1) / 2", "abs(hit_data.normal)"),
        ),
        "misses are not black": MISS,
    },
    "A1Renderer.shade_material_id": {
        "id_color of the triangle": ("Which id is shown?", ("material_id)", "triangle_id)"))
    },
}
