
import json, sys, time, taichi_tracer as tt
tt.init("cpu", threads=int(sys.argv[1]))
renderer = tt.A4Renderer(tt.load_scene_data("cornell_box"), 512, 512).use("path")
renderer.render(2)
start = time.perf_counter()
renderer.render(time=float(sys.argv[2]))
print(json.dumps([renderer.samples - 2, time.perf_counter() - start]))
