"""A program with mistakes, one in each line that ends with the words of the type checker; see ``test_typed.py``."""

import taichi_tracer as tt

scene = tt.load_scene_data("cornell_box", enviroment="studio")  # Unexpected keyword argument "enviroment"
cube = tt.scene_from_mesh([[0, 0, 0]], [[0, 0, 0]], triangletest="watertight")  # Unexpected keyword argument
number = tt.load_scene_data(7)  # incompatible type "int"
renderer = tt.A1Renderer("cornell_box")  # incompatible type "str"
picture = tt.A2Renderer(cube, width="512")  # incompatible type "str"
noisy = tt.A2Renderer(cube, 64, 64, sampller="sobol")  # Unexpected keyword argument "sampller"
camera = tt.Camera(64, 64, fow=60)  # Unexpected keyword argument "fow"
camera.set_camera_parameters(eye=3)  # incompatible type "int"
picture.render(ssp=16)  # Unexpected keyword argument "ssp"
picture.set_sample_mies()  # has no attribute "set_sample_mies"
hits = cube.intersect([[0, 1, 3]], [[0, 0, -1]]).distances  # has no attribute "distances"
tt.studies.accuracy("cube", estimator=("mis",))  # Unexpected keyword argument "estimator"
tt.init(precision=32)  # incompatible type "int"
tt.A5Renderer(cube)  # has no attribute "A5Renderer"
