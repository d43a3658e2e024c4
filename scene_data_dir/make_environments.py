"""Environment maps: radiance from every direction, as float16 .npy of shape (height, width, 3), linear RGB.

Equirectangular, top row first. The centre of texel (row, column) looks along the direction d with
    1/2 + atan2(d.z, d.x) / 2 pi = (column + 1/2) / width          u, across
    1/2 + asin(d.y) / pi         = 1 - (row + 1/2) / height        v, up          (A2-5, C-1)

Half floats hold 11 bits and up to 65,504: enough for a sun, and numpy reads them without another library.
"""

import numpy as np


def smoothstep(low, high, x):
    t = np.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def direction(u, v):
    """Unit vectors (..., 3) for map coordinates u (from 0 on the left) and v (from 0 at the bottom)."""
    azimuth = 2 * np.pi * (u - 0.5)
    elevation = np.pi * (v - 0.5)
    flat = np.cos(elevation)
    return np.stack([flat * np.cos(azimuth), np.sin(elevation) + 0 * azimuth, flat * np.sin(azimuth)], axis=-1)


def texel_coordinates(width, height, samples=1):
    """u and v, each (height * samples, width * samples), of a grid of samples inside every texel."""
    u = (np.arange(width * samples) + 0.5) / (width * samples)
    v = 1 - (np.arange(height * samples) + 0.5) / (height * samples)
    return np.meshgrid(u, v)


def box_filter(image, samples):
    height, width = image.shape[0] // samples, image.shape[1] // samples
    return image.reshape(height, samples, width, samples, -1).mean(axis=(1, 3))


def npy_bytes(image):
    """Version 1.0 of numpy's format, spelled out: np.save pads its header differently from version to version."""
    header = f"{{'descr': '<f2', 'fortran_order': False, 'shape': {image.shape}, }}"
    header += " " * (-(10 + len(header) + 1) % 64) + "\n"
    start = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little")
    return start + header.encode("ascii") + image.astype("<f2").tobytes()


# --- studio -----------------------------------------------------------------------------------------------------------


def soft_box(d, towards, half_width, half_height, radiance, edge=0.05):
    """A rectangle facing the origin at distance 1, hot in the middle, with smooth edges. -> (..., 3) radiance"""
    n = np.array(towards) / np.linalg.norm(towards)
    right = np.cross([0, 1, 0] if abs(n[1]) < 0.9 else [0, 0, 1], n)
    right /= np.linalg.norm(right)
    above = np.cross(n, right)

    facing = d @ n
    safe = np.where(facing > 1e-3, facing, 1e-3)
    x, y = np.abs(d @ right) / safe, np.abs(d @ above) / safe
    inside = smoothstep(0, edge, half_width - x) * smoothstep(0, edge, half_height - y) * (facing > 1e-3)
    falloff = 1 - 0.45 * smoothstep(0, 1, np.hypot(x / half_width, y / half_height) / np.sqrt(2))
    return (inside * falloff)[..., None] * np.array(radiance)


def studio(width=512, height=256):
    """A dark grey room with a lit backdrop at -z and three soft boxes.

    key: large and warm, up and to the side of the viewer at +z; rim: a narrow cool strip, behind, on the other side;
    top: wide and neutral, overhead.
    """
    samples = 4
    d = direction(*texel_coordinates(width, height, samples))
    up = d[..., 1]

    wall = 0.035 + 0.03 * smoothstep(-0.3, 0.9, up)
    floor = 0.05 * smoothstep(0.05, -0.5, up)
    backdrop = 0.22 * np.exp(-((np.arccos(np.clip(-d[..., 2], -1, 1)) / 0.55) ** 2)) * smoothstep(-0.75, 0.0, up)
    image = (wall + floor)[..., None] * np.array([0.95, 0.98, 1.05]) + backdrop[..., None] * np.array([0.9, 0.97, 1.1])

    image += soft_box(d, (-0.75, 0.62, 0.62), 0.40, 0.40, (8.5, 7.0, 5.4))
    image += soft_box(d, (0.95, 0.18, -0.30), 0.11, 0.55, (22.0, 26.0, 30.0), edge=0.03)
    image += soft_box(d, (0.10, 1.00, -0.10), 0.42, 0.26, (3.4, 3.5, 3.6), edge=0.08)
    return box_filter(image, samples)


# --- sunny ------------------------------------------------------------------------------------------------------------

TURBIDITY = 2.5
SUN_LUMINANCE = 2.0e6  # kcd / m^2, outside the atmosphere, mean over the disc
SUN_RADIUS = np.radians(0.2665)  # as seen from the earth
SUN_VALUE = 45000.0  # the brightest channel of the disc in the map; the largest half float is 65,504
GROUND_ALBEDO = np.array([0.20, 0.18, 0.14])
RGB_WAVELENGTHS = np.array([0.61, 0.55, 0.465])  # micrometres
XYZ_TO_SRGB = np.array(
    [[3.2404542, -1.5371385, -0.4985314], [-0.9692660, 1.8760108, 0.0415560], [0.0556434, -0.2040259, 1.0572252]]
)


def perez(cos_zenith, gamma, a, b, c, d, e):
    """Perez et al. 1993: sky distribution over the zenith angle and gamma, the angle to the sun."""
    return (1 + a * np.exp(b / cos_zenith)) * (1 + c * np.exp(d * gamma) + e * np.cos(gamma) ** 2)


def clear_sky(d, sun):
    """Preetham, Shirley and Smits 1999, "A Practical Analytic Model for Daylight": linear sRGB, kcd / m^2."""
    t = TURBIDITY
    s = np.arccos(sun[1])  # zenith angle of the sun
    zenith_luminance = (4.0453 * t - 4.9710) * np.tan((4 / 9 - t / 120) * (np.pi - 2 * s)) - 0.2155 * t + 2.4192
    powers_t, powers_s = np.array([t * t, t, 1]), np.array([s**3, s**2, s, 1])
    zenith_x = powers_t @ [
        [0.00166, -0.00375, 0.00209, 0],
        [-0.02903, 0.06377, -0.03202, 0.00394],
        [0.11693, -0.21196, 0.06052, 0.25886],
    ] @ powers_s  # fmt: skip
    zenith_y = powers_t @ [
        [0.00275, -0.00610, 0.00317, 0],
        [-0.04214, 0.08970, -0.04153, 0.00516],
        [0.15346, -0.26756, 0.06670, 0.26688],
    ] @ powers_s  # fmt: skip
    perez_luminance = [0.1787 * t - 1.4630, -0.3554 * t + 0.4275, -0.0227 * t + 5.3251, 0.1206 * t - 2.5771]
    perez_luminance += [-0.0670 * t + 0.3703]
    perez_x = [-0.0193 * t - 0.2592, -0.0665 * t + 0.0008, -0.0004 * t + 0.2125, -0.0641 * t - 0.8989]
    perez_x += [-0.0033 * t + 0.0452]
    perez_y = [-0.0167 * t - 0.2608, -0.0950 * t + 0.0092, -0.0079 * t + 0.2102, -0.0441 * t - 1.6537]
    perez_y += [-0.0109 * t + 0.0529]

    gamma = np.arccos(np.clip(d @ sun, -1, 1))

    def relative(coefficients, lowest):
        return perez(np.maximum(d[..., 1], lowest), gamma, *coefficients) / perez(1.0, s, *coefficients)

    # The model has no value at the horizon, and its colour turns pink there: colour is held below 7 degrees.
    luminance = zenith_luminance * relative(perez_luminance, lowest=0.01)
    x = zenith_x * relative(perez_x, lowest=0.12)
    y = zenith_y * relative(perez_y, lowest=0.12)
    xyz = np.stack([x / y, np.ones_like(x), (1 - x - y) / y], axis=-1) * luminance[..., None]
    return np.maximum(xyz @ XYZ_TO_SRGB.T, 0)


def sun_colour(sun):
    """Linear RGB of the disc, kcd / m^2, after Rayleigh and aerosol extinction (Preetham et al. 1999)."""
    zenith_degrees = np.degrees(np.arccos(sun[1]))
    air_mass = 1 / (sun[1] + 0.15 * (93.885 - zenith_degrees) ** -1.253)
    rayleigh = np.exp(-0.008735 * RGB_WAVELENGTHS**-4.08 * air_mass)
    aerosol = np.exp(-(0.04608 * TURBIDITY - 0.04586) * RGB_WAVELENGTHS**-1.3 * air_mass)
    return SUN_LUMINANCE * rayleigh * aerosol


def sunny(width=768, height=384, sun_row=104, sun_column=608):
    """A clear sky with its sun, above a Lambertian ground that they light.

    One scale serves sun and sky, so that their ratio is that of a real day. The sun's centre is a texel's centre;
    texels that the disc covers in part get that part of its radiance, so that its irradiance is right.
    """
    u, v = texel_coordinates(width, height)
    d = direction(u, v)
    sun = d[sun_row, sun_column]
    disc = sun_colour(sun)

    samples = 32
    near = (slice(sun_row - 2, sun_row + 3), slice(sun_column - 2, sun_column + 3))
    offset = (np.arange(samples) + 0.5) / samples - 0.5
    fine = direction(
        u[near][:, None, :, None] + offset / width + 0 * offset[:, None, None],
        v[near][:, None, :, None] + offset[:, None, None] / height,
    )
    coverage = np.zeros((height, width, 1))
    coverage[near] = (fine @ sun > np.cos(SUN_RADIUS)).mean(axis=(1, 3))[..., None]

    image = (clear_sky(d, sun) + coverage * disc) * (SUN_VALUE / disc.max())

    # The horizon runs between two rows of texels, so that each texel is all sky or all ground.
    solid_angle = (2 * np.pi / width) * (np.pi / height) * np.cos(np.pi * (v - 0.5))
    above = d[..., 1] > 0
    irradiance = (image * (np.maximum(d[..., 1], 0) * solid_angle)[..., None]).sum(axis=(0, 1))
    return np.where(above[..., None], image, GROUND_ALBEDO * irradiance / np.pi)


def environments():
    """Path below scene_data_dir -> bytes."""
    images = {"white": np.ones((2, 4, 3)), "black": np.zeros((2, 4, 3)), "studio": studio(), "sunny": sunny()}
    return {f"environments/{name}.npy": npy_bytes(image) for name, image in images.items()}
