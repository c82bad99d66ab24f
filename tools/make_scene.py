"""Makes the bundled scene: a small garden still life with parts that are hard to show with opaque triangles.

    blender -b -noaudio -P tools/make_scene.py -- --output assets/garden

A wheel with thin spokes, a leafy bush, a glossy vase, a patterned ball and a tiled plinth, rendered by Cycles from the
upper hemisphere. The folder has the layout of NeRF-Synthetic: RGBA photographs with straight alpha, and camera-to-world
matrices (Blender's axes). The scene is procedural; the same seed makes the same scene.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import random
import sys
from typing import Any, Callable

import bpy
from mathutils import Matrix, Vector

Colour = tuple[float, float, float]

PLINTH_COLOURS: list[Colour] = [(0.62, 0.33, 0.2), (0.75, 0.52, 0.34), (0.85, 0.82, 0.76)]
LEAF_COLOURS: list[Colour] = [(0.06, 0.25, 0.04), (0.13, 0.38, 0.06), (0.3, 0.48, 0.09)]
# Radius and height along the profile of the vase.
VASE_PROFILE = [
    (0.0, 0.0), (0.16, 0.0), (0.2, 0.06), (0.27, 0.2), (0.25, 0.34), (0.13, 0.47), (0.1, 0.55), (0.15, 0.62)]


def arguments() -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make_scene.py", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--output", default="assets/garden",
                        help="folder for images and transforms_*.json [assets/garden]")
    parser.add_argument("--size", type=int, default=200, help="side of the square images, pixels [200]")
    parser.add_argument("--samples", type=int, default=64, help="Cycles samples per pixel [64]")
    parser.add_argument("--train", type=int, default=60, help="training views [60]")
    parser.add_argument("--test", type=int, default=10, help="test views [10]")
    parser.add_argument("--seed", type=int, default=7, help="seed of leaves and camera jitter [7]")
    own = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    return parser.parse_args(own)


def material(name: str, colour: Colour, roughness: float = 0.6, metallic: float = 0.0,
             specular: float = 0.4) -> bpy.types.Material:
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Metallic"].default_value = metallic
    shader.inputs["Specular"].default_value = specular
    return made


def textured(name: str, kind: str, colours: list[Colour], scale: float, roughness: float = 0.7) -> bpy.types.Material:
    """A material with the colours of a procedural texture in object coordinates. kind: type of the texture node."""
    made = material(name, colours[0], roughness)
    nodes, links = made.node_tree.nodes, made.node_tree.links
    coordinates = nodes.new("ShaderNodeTexCoord")
    texture = nodes.new(kind)
    texture.inputs["Scale"].default_value = scale
    if kind == "ShaderNodeTexBrick":
        for socket, colour in zip(("Color1", "Color2", "Mortar"), colours):
            texture.inputs[socket].default_value = (*colour, 1.0)
    elif kind == "ShaderNodeTexChecker":
        for socket, colour in zip(("Color1", "Color2"), colours):
            texture.inputs[socket].default_value = (*colour, 1.0)
    links.new(coordinates.outputs["Object"], texture.inputs["Vector"])
    links.new(texture.outputs["Color"], nodes["Principled BSDF"].inputs["Base Color"])
    return made


def add(primitive: Callable[..., Any], matter: bpy.types.Material, smooth: bool = False,
        **options: Any) -> bpy.types.Object:
    """Adds an object with an operator such as bpy.ops.mesh.primitive_cone_add and its options."""
    primitive(**options)
    made = bpy.context.object
    made.data.materials.append(matter)
    if smooth:
        bpy.ops.object.shade_smooth()
    return made


def plinth() -> None:
    tiles = textured("tiles", "ShaderNodeTexBrick", PLINTH_COLOURS, 5.0)
    add(bpy.ops.mesh.primitive_cylinder_add, tiles, vertices=64, radius=1.2, depth=0.12, location=(0, 0, -0.66))


def wheel(spokes: int = 24) -> None:
    """An upright wheel. Its spokes are one to two pixels thick at the default image size."""
    wood, iron = material("wood", (0.45, 0.2, 0.07), 0.5), material("iron", (0.12, 0.12, 0.14), 0.35, 0.8)
    centre, radius = Vector((-0.25, 0.45, -0.02)), 0.56
    turn = Matrix.Rotation(math.radians(20), 4, "Z") @ Matrix.Rotation(math.radians(90), 4, "X")
    parts = [
        add(bpy.ops.mesh.primitive_torus_add, wood, True, major_radius=radius, minor_radius=0.035, major_segments=64),
        add(bpy.ops.mesh.primitive_cylinder_add, iron, radius=0.06, depth=0.14),
    ]
    for i in range(spokes):
        angle = 2 * math.pi * i / spokes
        spoke = add(bpy.ops.mesh.primitive_cylinder_add, wood, vertices=8, radius=0.011, depth=radius)
        placed = Matrix.Rotation(angle, 4, "Z") @ Matrix.Translation((radius / 2, 0, 0))
        spoke.matrix_world = placed @ Matrix.Rotation(math.pi / 2, 4, "Y")
        parts.append(spoke)
    for part in parts:
        part.matrix_world = Matrix.Translation(centre) @ turn @ part.matrix_world


def random_vector(rng: random.Random, deviation: float) -> Vector:
    return Vector((rng.gauss(0, deviation), rng.gauss(0, deviation), rng.gauss(0, deviation)))


def leaf(rng: random.Random) -> list[Vector]:
    """Corners of a leaf: a small rhombus, bent a little along its middle."""
    direction = random_vector(rng, 1).normalized()
    radius = 0.36 * rng.uniform(0.45, 1.0)
    at = Vector((0.55, 0.2, 0.02)) + direction * radius * (1.0 if direction.z > 0 else 0.7)
    along = (direction + random_vector(rng, 0.5)).normalized()
    across = along.cross(random_vector(rng, 1)).normalized()
    length, width = rng.uniform(0.09, 0.15), rng.uniform(0.025, 0.045)
    bend = along.cross(across) * 0.2 * width
    middle = at + along * length * 0.5
    return [at, middle + across * width - bend, at + along * length, middle - across * width - bend]


def bush(rng: random.Random, leaves: int = 420) -> None:
    """A terracotta pot with a ball of single leaves."""
    clay = material("pot", (0.6, 0.22, 0.1), 0.8)
    pot = add(bpy.ops.mesh.primitive_cone_add, clay, vertices=40, radius1=0.17, radius2=0.24, depth=0.34,
              location=(0.55, 0.2, -0.43))
    pot.name = "pot"
    greens = [material(f"leaf{i}", colour, 0.5) for i, colour in enumerate(LEAF_COLOURS)]
    vertices: list[Vector] = []
    faces: list[tuple[int, int, int]] = []
    slots: list[int] = []
    for _ in range(leaves):
        first = len(vertices)
        vertices += leaf(rng)
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
        slots += [rng.randrange(3)] * 2
    mesh = bpy.data.meshes.new("leaves")
    mesh.from_pydata(vertices, [], faces)
    for green in greens:
        mesh.materials.append(green)
    for polygon, slot in zip(mesh.polygons, slots):
        polygon.material_index = slot
    bpy.context.collection.objects.link(bpy.data.objects.new("leaves", mesh))


def vase() -> None:
    """A solid of revolution with a glossy glaze, whose highlights move with the camera."""
    steps = 48
    vertices = [(r * math.cos(2 * math.pi * k / steps), r * math.sin(2 * math.pi * k / steps), z)
                for r, z in VASE_PROFILE for k in range(steps)]
    faces = [(i * steps + k, i * steps + (k + 1) % steps, (i + 1) * steps + (k + 1) % steps, (i + 1) * steps + k)
             for i in range(len(VASE_PROFILE) - 1) for k in range(steps)]
    mesh = bpy.data.meshes.new("vase")
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material("glaze", (0.02, 0.12, 0.5), 0.06, 0.0, 0.9))
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    made = bpy.data.objects.new("vase", mesh)
    made.location = (-0.55, -0.35, -0.6)
    made.modifiers.new("round", "SUBSURF").render_levels = 2
    bpy.context.collection.objects.link(made)


def balls() -> None:
    checks = textured("checks", "ShaderNodeTexChecker", [(0.9, 0.75, 0.1), (0.75, 0.08, 0.08)], 9.0, 0.4)
    steel = material("steel", (0.85, 0.85, 0.88), 0.08, 1.0)
    for matter, radius, location in ((checks, 0.22, (0.3, -0.6, -0.38)), (steel, 0.14, (0.72, -0.42, -0.46))):
        add(bpy.ops.mesh.primitive_uv_sphere_add, matter, True, segments=48, ring_count=24, radius=radius,
            location=location)


def light() -> None:
    """The sun, and a gradient from ground to sky, which the glossy parts reflect."""
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    coordinates, split = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeSeparateXYZ")
    ramp = nodes.new("ShaderNodeValToRGB")
    ramp.color_ramp.elements[0].color = (0.25, 0.2, 0.15, 1)
    ramp.color_ramp.elements[0].position = 0.45
    ramp.color_ramp.elements[1].color = (0.45, 0.65, 1.0, 1)
    ramp.color_ramp.elements[1].position = 0.6
    shift = nodes.new("ShaderNodeMapRange")
    shift.inputs["From Min"].default_value = -1.0
    links.new(coordinates.outputs["Generated"], split.inputs["Vector"])
    links.new(split.outputs["Z"], shift.inputs["Value"])
    links.new(shift.outputs["Result"], ramp.inputs["Fac"])
    links.new(ramp.outputs["Color"], nodes["Background"].inputs["Color"])
    nodes["Background"].inputs["Strength"].default_value = 0.7
    bpy.ops.object.light_add(type="SUN", rotation=(math.radians(40), math.radians(15), math.radians(30)))
    bpy.context.object.data.energy = 2.6
    bpy.context.object.data.angle = math.radians(4)


def cameras(count: int, rng: random.Random, offset: float, radius: float = 4.0) -> list[Matrix]:
    """Poses on a Fibonacci lattice of the hemisphere, between 5 and 75 degrees of elevation, with jitter. offset: shift
    of the lattice, in views."""
    target = Vector((0, 0, -0.15))
    poses = []
    low, high = math.sin(math.radians(5)), math.sin(math.radians(75))
    for i in range(count):
        z = low + (high - low) * (i + 0.5) / count
        angle = (i + offset) * math.pi * (3 - math.sqrt(5)) + rng.uniform(-0.1, 0.1)
        flat = math.sqrt(1 - z * z)
        position = radius * Vector((flat * math.cos(angle), flat * math.sin(angle), z))
        turn = (target - position).to_track_quat("-Z", "Y").to_matrix().to_4x4()
        poses.append(Matrix.Translation(position) @ turn)
    return poses


def render(options: argparse.Namespace, split: str, poses: list[Matrix], camera: bpy.types.Object) -> None:
    """Renders a view from each pose, and writes transforms_*.json."""
    folder = os.path.join(options.output, split)
    os.makedirs(folder, exist_ok=True)
    frames = []
    for i, pose in enumerate(poses):
        camera.matrix_world = pose
        bpy.context.scene.render.filepath = os.path.abspath(os.path.join(folder, f"r_{i}.png"))
        bpy.ops.render.render(write_still=True)
        matrix = [[round(v, 8) for v in row] for row in pose]
        frames.append({"file_path": f"./{split}/r_{i}", "transform_matrix": matrix})
    with open(os.path.join(options.output, f"transforms_{split}.json"), "w", encoding="utf-8") as out:
        json.dump({"camera_angle_x": camera.data.angle_x, "frames": frames}, out, indent=1)
        out.write("\n")


def set_up(options: argparse.Namespace) -> bpy.types.Scene:
    """An empty scene with the settings of the renderer."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = options.samples
    scene.cycles.seed = options.seed
    scene.cycles.use_denoising = False  # Debian's Blender may lack a denoiser
    scene.cycles.sample_clamp_indirect = 4.0  # against fireflies
    scene.cycles.max_bounces = 4
    scene.render.resolution_x = scene.render.resolution_y = options.size
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.image_settings.compression = 100
    scene.view_settings.view_transform = "Standard"
    scene.render.use_persistent_data = True
    return scene


def main() -> None:
    options = arguments()
    scene = set_up(options)
    rng = random.Random(options.seed)
    plinth()
    wheel()
    bush(rng)
    vase()
    balls()
    light()
    data = bpy.data.cameras.new("camera")
    data.angle = math.radians(38)
    camera = bpy.data.objects.new("camera", data)
    bpy.context.collection.objects.link(camera)
    scene.camera = camera
    render(options, "train", cameras(options.train, rng, 0.0), camera)
    render(options, "test", cameras(options.test, rng, 0.37), camera)


main()
