"""Measures the time of one image of the same scene with several renderers, without a graphics card.

    pip install mujoco vtk pybullet
    LP_NUM_THREADS=1 python benchmarks/renderers.py [--json FILE]

Twenty spheres of 760 triangles on a plate, 256x256 pixels, one light at the camera, no shadows, with read-back. Each
renderer has a process of its own, and the processes take turns. VTK is measured with and without its FXAA pass, and
without specular light: Drake renders with VTK and with FXAA, and has no setting for either. A renderer whose package is
not installed is left out. What VTK paints without specular light must equal what it paints with a specular coefficient
of zero.
"""

import argparse
import importlib.metadata
import importlib.util
import math
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from result_tables.speed_tables import renderers_table
from shared.common import print_table, save_json

SIZE, ROUND, TURNS = 256, 60, 9
"""Width and height [px], images per turn, turns."""
RADIUS, RINGS, SECTORS = 0.05, 20, 20
PLATE = (1.2, 1.0, 0.02)
CENTRES = [(-0.4 + 0.2 * (k % 5), -0.3 + 0.2 * (k // 5), RADIUS) for k in range(20)]
COLOURS = [(0.2 + 0.03 * k, 0.4, 0.8 - 0.03 * k) for k in range(20)]
GREY = (0.6, 0.6, 0.6)
EYE, VIEW_DEG = (0.0, -0.9, 0.9), 60.0
"""Place of the camera [m], which looks at the origin, and its angle of view."""
DIFFUSE_ONLY = """
  float df = max(0.0, normalVCVSOutput.z);
  gl_FragData[0] = vec4(ambientColor + df * lightColor0 * diffuseColor, opacity);
"""
"""Light from the camera in a fragment shader, without a specular term."""
RENDERERS = {
    "Drake, RenderEngineVtk": ("drake", {}),
    "VTK, FXAA": ("vtk", {"fxaa": True}),
    "VTK, no FXAA": ("vtk", {}),
    "VTK, no FXAA, no specular term": ("vtk", {"specular": False}),
    "VTK, 4 samples": ("vtk", {"samples": 4}),
    "MuJoCo, 1 sample": ("mujoco", {"samples": 0}),
    "MuJoCo, 4 samples": ("mujoco", {"samples": 4}),
    "pybullet, TinyRenderer": ("pybullet", {}),
}
"""{row: (package, options)}."""


def write_sphere(path):
    """Writes a sphere as an OBJ file."""
    rows = [(0.0, 0.0, RADIUS), *_rings(), (0.0, 0.0, -RADIUS)]
    last = len(rows)
    faces = []
    for k in range(SECTORS):
        after = (k + 1) % SECTORS
        faces.append((1, 2 + k, 2 + after))
        for ring in range(RINGS - 2):
            a, b = 2 + ring * SECTORS + k, 2 + ring * SECTORS + after
            faces += [(a, a + SECTORS, b + SECTORS), (a, b + SECTORS, b)]
        faces.append((last, last - SECTORS + after, last - SECTORS + k))
    text = "".join(f"v {x:.6f} {y:.6f} {z:.6f}\nvn {x:.6f} {y:.6f} {z:.6f}\n" for x, y, z in rows)
    Path(path).write_text(text + "".join("f " + " ".join(f"{i}//{i}" for i in face) + "\n" for face in faces))


def _rings():
    for ring in range(1, RINGS):
        polar = math.pi * ring / RINGS
        for k in range(SECTORS):
            angle = 2.0 * math.pi * k / SECTORS
            r = RADIUS * math.sin(polar)
            yield r * math.cos(angle), r * math.sin(angle), RADIUS * math.cos(polar)


def drake_images(mesh):
    """Returns a function that renders an image with Drake."""
    from pydrake import geometry
    from pydrake.math import RigidTransform, RotationMatrix
    from pydrake.systems.sensors import CameraInfo

    scene = geometry.SceneGraph()
    source = scene.RegisterSource("scene")
    scene.AddRenderer("vtk", geometry.MakeRenderEngineVtk(geometry.RenderEngineVtkParams()))
    shapes = [(geometry.Box(*PLATE), (0.0, 0.0, -0.5 * PLATE[2]), GREY)]
    shapes += [(geometry.Mesh(str(mesh)), centre, colour) for centre, colour in zip(CENTRES, COLOURS, strict=True)]
    for k, (shape, place, colour) in enumerate(shapes):
        instance = geometry.GeometryInstance(RigidTransform(place), shape, f"shape_{k}")
        properties = geometry.PerceptionProperties()
        properties.AddProperty("phong", "diffuse", geometry.Rgba(*colour, 1.0))
        properties.AddProperty("label", "id", geometry.RenderLabel(1))
        instance.set_perception_properties(properties)
        scene.RegisterAnchoredGeometry(source, instance)
    z_axis = -np.array(EYE) / np.linalg.norm(EYE)
    x_axis = np.array([1.0, 0.0, 0.0])
    X_WC = RigidTransform(RotationMatrix(np.column_stack([x_axis, np.cross(z_axis, x_axis), z_axis])), EYE)
    intrinsics = CameraInfo(SIZE, SIZE, math.radians(VIEW_DEG))
    core = geometry.RenderCameraCore("vtk", intrinsics, geometry.ClippingRange(0.01, 5.0), RigidTransform())
    camera, context = geometry.ColorRenderCamera(core, False), scene.CreateDefaultContext()
    query = scene.get_query_output_port().Eval(context)
    # The context must live as long as the query.
    return lambda: (context, query.RenderColorImage(camera, scene.world_frame_id(), X_WC).data)[1][:, :, :3]


def vtk_images(mesh, fxaa=False, specular=True, samples=0):
    """Returns a function that renders an image with VTK."""
    import vtk
    from vtk.util.numpy_support import vtk_to_numpy

    renderer = vtk.vtkRenderer()
    renderer.SetUseFXAA(fxaa)
    reader, plate = vtk.vtkOBJReader(), vtk.vtkCubeSource()
    reader.SetFileName(str(mesh))
    for set_length, length in zip((plate.SetXLength, plate.SetYLength, plate.SetZLength), PLATE, strict=True):
        set_length(length)
    shapes = [(plate, (0.0, 0.0, -0.5 * PLATE[2]), GREY)]
    shapes += [(reader, centre, colour) for centre, colour in zip(CENTRES, COLOURS, strict=True)]
    for source, place, colour in shapes:
        mapper, actor = vtk.vtkPolyDataMapper(), vtk.vtkActor()
        mapper.SetInputConnection(source.GetOutputPort())
        actor.SetMapper(mapper)
        actor.SetPosition(*place)
        actor.GetProperty().SetColor(*colour)
        if not specular:
            actor.GetShaderProperty().AddFragmentShaderReplacement("//VTK::Light::Impl", True, DIFFUSE_ONLY, False)
        renderer.AddActor(actor)
    window = getattr(vtk, "vtkEGLRenderWindow", vtk.vtkRenderWindow)()
    window.SetOffScreenRendering(True)
    window.SetMultiSamples(samples)
    window.SetSize(SIZE, SIZE)
    window.AddRenderer(renderer)
    camera = renderer.GetActiveCamera()
    camera.SetPosition(*EYE)
    camera.SetViewUp(0.0, 0.0, 1.0)
    camera.SetViewAngle(VIEW_DEG)
    renderer.ResetCameraClippingRange()
    pixels = vtk.vtkUnsignedCharArray()

    def render():
        window.Render()
        window.GetRGBACharPixelData(0, 0, SIZE - 1, SIZE - 1, 0, pixels)
        return vtk_to_numpy(pixels).reshape(SIZE, SIZE, 4)[::-1, :, :3]

    return render


def mujoco_images(mesh, samples):
    """Returns a function that renders an image with MuJoCo."""
    os.environ["MUJOCO_GL"] = "egl"
    import mujoco

    spheres = "".join(
        f'<geom type="mesh" mesh="sphere" pos="{x} {y} {z}" rgba="{r} {g} {b} 1"/>'
        for (x, y, z), (r, g, b) in zip(CENTRES, COLOURS, strict=True)
    )
    down = math.sqrt(0.5)
    model = mujoco.MjModel.from_xml_string(
        f"""<mujoco><visual><global offwidth="{SIZE}" offheight="{SIZE}"/><quality offsamples="{samples}"/></visual>
        <asset><mesh name="sphere" file="{mesh}"/></asset><worldbody>
        <geom type="box" size="{PLATE[0] / 2} {PLATE[1] / 2} {PLATE[2] / 2}" pos="0 0 {-PLATE[2] / 2}"
              rgba="{GREY[0]} {GREY[1]} {GREY[2]} 1"/>{spheres}
        <camera name="eye" pos="{EYE[0]} {EYE[1]} {EYE[2]}" fovy="{VIEW_DEG}" xyaxes="1 0 0 0 {down} {down}"/>
        </worldbody></mujoco>"""
    )
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    renderer = mujoco.Renderer(model, SIZE, SIZE)
    renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = False

    def render():
        renderer.update_scene(data, camera="eye")
        return renderer.render()

    return render


def pybullet_images(mesh):
    """Returns a function that renders an image with pybullet's own renderer."""
    import pybullet

    pybullet.connect(pybullet.DIRECT)
    halves = [0.5 * length for length in PLATE]
    plate = pybullet.createVisualShape(pybullet.GEOM_BOX, halfExtents=halves, rgbaColor=(*GREY, 1.0))
    pybullet.createMultiBody(0, -1, plate, (0.0, 0.0, -halves[2]))
    for centre, colour in zip(CENTRES, COLOURS, strict=True):
        shape = pybullet.createVisualShape(pybullet.GEOM_MESH, fileName=str(mesh), rgbaColor=(*colour, 1.0))
        pybullet.createMultiBody(0, -1, shape, centre)
    view = pybullet.computeViewMatrix(EYE, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    lens = pybullet.computeProjectionMatrixFOV(VIEW_DEG, 1.0, 0.01, 5.0)

    def render():
        image = pybullet.getCameraImage(
            SIZE, SIZE, view, lens, shadow=0, lightDirection=EYE, renderer=pybullet.ER_TINY_RENDERER
        )[2]
        return np.reshape(image, (SIZE, SIZE, 4))[:, :, :3]

    return render


def serve(name, mesh, picture):
    """Renders a round of images for each line that arrives, and answers with the time of one image [ms]."""
    package, options = RENDERERS[name]
    render = globals()[f"{package}_images"](mesh, **options)
    image = render()
    np.save(picture, image)
    print("ready", flush=True)
    for _ in sys.stdin:
        start = time.perf_counter()
        for _ in range(ROUND):
            render()
        print(1e3 * (time.perf_counter() - start) / ROUND, flush=True)


def measure(folder):
    """Returns {row: times of an image [ms]} and the pictures."""
    mesh = Path(folder) / "sphere.obj"
    write_sphere(mesh)
    servers, pictures, times = {}, {}, {}
    for number, (name, (package, _)) in enumerate(RENDERERS.items()):
        if importlib.util.find_spec(package if package != "drake" else "pydrake") is None:
            print(f"left out: {name}, since {package} is not installed")
            continue
        picture = Path(folder) / f"{number}.npy"
        command = [sys.executable, __file__, "--serve", name, str(mesh), str(picture)]
        server = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        while (line := server.stdout.readline()) != "ready\n":
            if not line:
                raise SystemExit(f"{name}: its process ended with exit code {server.wait()}")
        servers[name], pictures[name], times[name] = server, np.load(picture), []
    for _ in range(TURNS):
        for name, server in servers.items():
            server.stdin.write("go\n")
            server.stdin.flush()
            times[name].append(float(server.stdout.readline()))
    for server in servers.values():
        server.stdin.close()
        server.wait()
    return times, pictures


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--json", type=Path, help="file for the results")
    parser.add_argument("--serve", nargs=3, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        serve(*options.serve)
        return
    with tempfile.TemporaryDirectory() as folder:
        times, pictures = measure(folder)
    plain, diffuse = (pictures.get(name) for name in ("VTK, no FXAA", "VTK, no FXAA, no specular term"))
    found = {
        "renderers": {
            name: {"ms": values, "version": importlib.metadata.version(RENDERERS[name][0])}
            for name, values in times.items()
        },
        "differing_pixels": None if plain is None else int(np.count_nonzero(np.any(plain != diffuse, axis=2))),
    }
    print_table(*renderers_table(found))
    print(f"pixels that the specular term changes: {found['differing_pixels']}")
    if options.json:
        save_json(found, options.json, [0])


if __name__ == "__main__":
    main()
