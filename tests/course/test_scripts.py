"""Scripts of the course: the names that they import, what they read and write, and their loops, without a window."""

import numpy as np
import pytest
import taichi as ti
import taichi.math as tm

import taichi_tracer as tt
from taichi_tracer.renderer import A2Renderer, A3Renderer, A4Renderer, EnvISRenderer
from taichi_tracer.sampler import ortho_frames, reflect
from taichi_tracer.scene_data_loader import EnvironmentName, SceneName, load_scene_data


@pytest.mark.slow
def test_modes_counters_and_intensity_of_the_second_assignment(f32):
    scene = load_scene_data(SceneName.SPECULAR_SPHERES, EnvironmentName.GREY)
    renderer = A2Renderer(width=16, height=16, scene_data=scene)
    renderer.set_sample_uniform()
    assert renderer.sample_mode[None] == A2Renderer.SampleMode.UNIFORM == 1
    renderer.sample_mode[None] = A2Renderer.SampleMode.BRDF.value
    for _ in range(2):
        renderer.render()
    dark = renderer.canvas.to_numpy().mean()
    scene.environment.intensity[None] = 2.0
    renderer.render()
    assert (renderer.sample_mode[None], renderer.iter_counter[None], scene.environment.intensity) == (2, 1, 2.0)
    assert renderer.canvas.to_numpy().mean() == pytest.approx(2 * dark, rel=0.1)
    renderer.iter_counter[None] = 0
    assert renderer.samples == 0
    renderer.set_sample_microfacet()
    assert renderer.sample_mode[None] == A2Renderer.SampleMode.MICROFACET == 3
    renderer.set_sample_brdf()
    assert renderer.sample_mode[None] == A2Renderer.SampleMode.BRDF


@ti.kernel
def read_in_a_kernel(a3: ti.template(), a4: ti.template(), x: int, y: int) -> tm.vec4:
    bounces = 0
    for _ in range(a4.max_bounces[None]):
        bounces += 1
    environment = a3.scene_data.environment
    red = environment.image[x, y].x * environment.intensity[None]
    return tm.vec4(a3.mis_plight[None] + 2 * a3.mis_pbrdf[None], bounces, a4.rr_termination_probabilty[None], red)


@pytest.mark.slow
def test_kernels_read_live_values(f32):
    image = np.zeros((2, 4, 3))
    image[1, 3] = 5
    scene = tt.load_scene_data("cube", environment=image)
    a3, a4 = (kind(width=4, height=4, scene_data=scene) for kind in (A3Renderer, A4Renderer))
    a3._one_sample.prepare(scene, a3.camera)
    for light, bounces, q, intensity in ((0.5, 5, 0.0, 1.0), (0.25, 2, 0.5, 2.0)):
        a3.mis_plight[None], a4.max_bounces[None], a4.rr_termination_probabilty[None] = light, bounces, q
        scene.environment.intensity[None] = intensity
        expected = [light + 2 * (1 - light), bounces, q, 5 * intensity]
        np.testing.assert_allclose(read_in_a_kernel(a3, a4, 3, 0).to_list(), expected, rtol=1e-6)
    assert scene.environment.image[3, 0].tolist() == [5, 5, 5]


def test_environment_samples_are_counted_where_light_is(f32):
    image = np.ones((8, 16, 3))
    image[2, 5] = 1000
    scene = tt.load_scene_data("cube", environment=image)
    scene.environment.precompute_envmap()
    renderer = EnvISRenderer(width=16, height=8, scene_data=scene)
    renderer.render_background()
    assert renderer.background.to_numpy()[5, 5].tolist() == [1000, 1000, 1000]
    renderer.sample_env(samples=12800)
    counts = renderer.count_map.to_numpy()
    assert counts.sum() == 12800
    assert counts.std() < 3 * np.sqrt(100)
    renderer.set_sample_envmap()
    renderer.sample_env(samples=12800)
    share = renderer.count_map.to_numpy() / 12800
    edges = np.cos(np.pi * np.arange(9) / 8)
    weight = (image[..., 0] * (edges[:-1] - edges[1:])[:, None])[::-1].T
    expected = weight / weight.sum()
    assert share[5, 5] == pytest.approx(expected[5, 5], abs=4 * np.sqrt(0.25 / 12800))  # within 4 standard deviations


def test_the_arguments_of_the_course_have_their_names(f32):
    scene = load_scene_data(scene_name=SceneName.CUBE, environment_name=EnvironmentName.GREY)
    assert scene.environment.constant == pytest.approx((0.12, 0.12, 0.12))
    black = load_scene_data(SceneName.CUBE)
    assert black.environment.is_black
    black.environment.set_intensity(2.0)
    assert black.environment.intensity[None] == 2
    with pytest.raises(tt.InputError, match="give the name of a shipped scene"):
        load_scene_data()


@ti.kernel
def frame_and_mirror(n: tm.vec3, w_o: tm.vec3) -> tm.mat4:
    frame = ortho_frames(n)
    product, w_r = frame.transpose() @ frame, reflect(w_o, n)
    off = abs(product - ti.Matrix.identity(float, 3)).max()
    z = frame @ tm.vec3(0, 0, 1)
    return tm.mat4([[off, frame.determinant(), 0, 0], [z.x, z.y, z.z, 0], [w_r.x, w_r.y, w_r.z, 0], [0, 0, 0, 0]])


def test_frames_and_mirrored_directions(f32):
    n, w_o = np.array([0.6, 0.0, -0.8]), np.array([0.0, 0.6, 0.8])
    found = frame_and_mirror(tm.vec3(*n), tm.vec3(*w_o)).to_numpy()
    np.testing.assert_allclose(found[0, :2], [0, 1], atol=1e-6)
    np.testing.assert_allclose(found[1, :3], n, atol=1e-6)
    np.testing.assert_allclose(found[2, :3], 2 * (n @ w_o) * n - w_o, atol=1e-6)


@pytest.mark.parametrize("variable", ["", "TAICHI_TRACER_SCENES"])
def test_a_file_of_the_course_is_found(variable, f32, tmp_path, monkeypatch):
    folder = tmp_path / ("elsewhere" if variable else "scene_data_dir")
    folder.mkdir()
    monkeypatch.chdir(tmp_path)
    with pytest.raises(tt.InputError, match=r"SceneName.BUNNY: bunny.obj is not shipped: put it into .*scene_data_dir"):
        load_scene_data(SceneName.BUNNY)
    (folder / "bunny.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    if variable:
        monkeypatch.setenv(variable, str(folder))
    assert load_scene_data(SceneName.BUNNY).num_triangles == 1
