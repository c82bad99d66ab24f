"""Makes the bundled scene: a small garden still life with what is hard for opaque triangles.

    blender -b -noaudio -P tools/make_scene.py -- --output assets/garden

A wheel with thin spokes, a leafy bush, a glossy vase, a patterned ball and a tiled plinth, rendered by Cycles from the upper
hemisphere, in the folder layout of NeRF-Synthetic: RGBA photographs with straight alpha and camera-to-world matrices (Blender axes).
Everything is procedural and seeded: the same script makes the same scene.
"""

import argparse
import json
import math
import os
import random
import sys

import bpy
from mathutils import Matrix, Vector


def arguments():
    parser = argparse.ArgumentParser(prog="make_scene.py", description=__doc__.splitlines()[0])
    parser.add_argument("--output", default="assets/garden", help="folder for images and transforms_*.json")
    parser.add_argument("--size", type=int, default=200, help="side of the square images in pixels")
    parser.add_argument("--samples", type=int, default=64, help="Cycles samples per pixel")
    parser.add_argument("--train", type=int, default=60, help="training views")
    parser.add_argument("--test", type=int, default=10, help="test views")
    parser.add_argument("--seed", type=int, default=7, help="of leaves and camera jitter")
    own = sys.argv[sys.argv.index("--") + 1:] if "--" in sys.argv else []
    return parser.parse_args(own)


def material(name, colour, roughness=0.6, metallic=0.0, specular=0.4):
    made = bpy.data.materials.new(name)
    made.use_nodes = True
    shader = made.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1.0)
    shader.inputs["Roughness"].default_value = roughness
    shader.inputs["Metallic"].default_value = metallic
    shader.inputs["Specular"].default_value = specular
    return made


def textured(name, kind, colours, scale, roughness=0.7):
    """A material whose colour comes from a procedural texture in object coordinates."""
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


def add(primitive, matter, smooth=False, **options):
    primitive(**options)
    made = bpy.context.object
    made.data.materials.append(matter)
    if smooth:
        bpy.ops.object.shade_smooth()
    return made


def plinth():
    tiles = textured("tiles", "ShaderNodeTexBrick", [(0.62, 0.33, 0.2), (0.75, 0.52, 0.34), (0.85, 0.82, 0.76)], 5.0)
    add(bpy.ops.mesh.primitive_cylinder_add, tiles, vertices=64, radius=1.2, depth=0.12, location=(0, 0, -0.66))


def wheel(spokes=24):
    """Stands upright; the spokes are one to two pixels thick at the default size."""
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
        spoke.matrix_world = Matrix.Rotation(angle, 4, "Z") @ Matrix.Translation((radius / 2, 0, 0)) @ Matrix.Rotation(math.pi / 2, 4, "Y")
        parts.append(spoke)
    for part in parts:
        part.matrix_world = Matrix.Translation(centre) @ turn @ part.matrix_world
    return centre


def bush(rng, leaves=420):
    """A terracotta pot with a ball of single leaves: each a small rhombus, bent a little along its middle."""
    pot = add(bpy.ops.mesh.primitive_cone_add, material("pot", (0.6, 0.22, 0.1), 0.8), vertices=40, radius1=0.17, radius2=0.24,
              depth=0.34, location=(0.55, 0.2, -0.43))
    pot.name = "pot"
    greens = [material(f"leaf{i}", colour, 0.5) for i, colour in enumerate([(0.06, 0.25, 0.04), (0.13, 0.38, 0.06), (0.3, 0.48, 0.09)])]
    vertices, faces, slots = [], [], []
    for _ in range(leaves):
        direction = Vector((rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1))).normalized()
        at = Vector((0.55, 0.2, 0.02)) + direction * (0.36 * rng.uniform(0.45, 1.0)) * (1.0 if direction.z > 0 else 0.7)
        along = (direction + Vector((rng.gauss(0, 0.5), rng.gauss(0, 0.5), rng.gauss(0, 0.5)))).normalized()
        across = along.cross(Vector((rng.gauss(0, 1), rng.gauss(0, 1), rng.gauss(0, 1)))).normalized()
        length, width = rng.uniform(0.09, 0.15), rng.uniform(0.025, 0.045)
        bend = along.cross(across) * 0.2 * width
        first = len(vertices)
        vertices += [at, at + along * length * 0.5 + across * width - bend, at + along * length, at + along * length * 0.5 - across * width - bend]
        faces += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
        slots += [rng.randrange(3)] * 2
    mesh = bpy.data.meshes.new("leaves")
    mesh.from_pydata(vertices, [], faces)
    for green in greens:
        mesh.materials.append(green)
    for polygon, slot in zip(mesh.polygons, slots):
        polygon.material_index = slot
    bpy.context.collection.objects.link(bpy.data.objects.new("leaves", mesh))


def vase():
    """A turned profile with a glossy glaze: its highlights move with the camera."""
    profile = [(0.0, 0.0), (0.16, 0.0), (0.2, 0.06), (0.27, 0.2), (0.25, 0.34), (0.13, 0.47), (0.1, 0.55), (0.15, 0.62)]
    steps = 48
    vertices = [(r * math.cos(2 * math.pi * k / steps), r * math.sin(2 * math.pi * k / steps), z) for r, z in profile for k in range(steps)]
    faces = [(i * steps + k, i * steps + (k + 1) % steps, (i + 1) * steps + (k + 1) % steps, (i + 1) * steps + k)
             for i in range(len(profile) - 1) for k in range(steps)]
    mesh = bpy.data.meshes.new("vase")
    mesh.from_pydata(vertices, [], faces)
    mesh.materials.append(material("glaze", (0.02, 0.12, 0.5), 0.06, 0.0, 0.9))
    mesh.polygons.foreach_set("use_smooth", [True] * len(mesh.polygons))
    made = bpy.data.objects.new("vase", mesh)
    made.location = (-0.55, -0.35, -0.6)
    made.modifiers.new("round", "SUBSURF").render_levels = 2
    bpy.context.collection.objects.link(made)


def balls():
    checks = textured("checks", "ShaderNodeTexChecker", [(0.9, 0.75, 0.1), (0.75, 0.08, 0.08)], 9.0, 0.4)
    add(bpy.ops.mesh.primitive_uv_sphere_add, checks, True, segments=48, ring_count=24, radius=0.22, location=(0.3, -0.6, -0.38))
    add(bpy.ops.mesh.primitive_uv_sphere_add, material("steel", (0.85, 0.85, 0.88), 0.08, 1.0), True, segments=48, ring_count=24,
        radius=0.14, location=(0.72, -0.42, -0.46))


def light():
    world = bpy.data.worlds.new("sky")
    bpy.context.scene.world = world
    world.use_nodes = True
    nodes, links = world.node_tree.nodes, world.node_tree.links
    # A plain gradient from ground to sky: something for the glossy parts to reflect.
    coordinates, split, ramp = nodes.new("ShaderNodeTexCoord"), nodes.new("ShaderNodeSeparateXYZ"), nodes.new("ShaderNodeValToRGB")
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


def cameras(count, rng, offset, radius=4.0, target=Vector((0, 0, -0.15))):
    """Fibonacci lattice on the hemisphere between 5 and 75 degrees of elevation, jittered; offset shifts it between views."""
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


def render(options, split, poses, camera):
    folder = os.path.join(options.output, split)
    os.makedirs(folder, exist_ok=True)
    frames = []
    for i, pose in enumerate(poses):
        camera.matrix_world = pose
        bpy.context.scene.render.filepath = os.path.abspath(os.path.join(folder, f"r_{i}.png"))
        bpy.ops.render.render(write_still=True)
        frames.append({"file_path": f"./{split}/r_{i}", "transform_matrix": [[round(v, 8) for v in row] for row in pose]})
    with open(os.path.join(options.output, f"transforms_{split}.json"), "w", encoding="utf-8") as out:
        json.dump({"camera_angle_x": camera.data.angle_x, "frames": frames}, out, indent=1)
        out.write("\n")


def main():
    options = arguments()
    bpy.ops.wm.read_factory_settings(use_empty=True)
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.cycles.device = "CPU"
    scene.cycles.samples = options.samples
    scene.cycles.seed = options.seed
    scene.cycles.use_denoising = False  # Debian's build may have no denoiser; the same pictures everywhere
    scene.cycles.sample_clamp_indirect = 4.0  # fireflies
    scene.cycles.max_bounces = 4
    scene.render.resolution_x = scene.render.resolution_y = options.size
    scene.render.film_transparent = True
    scene.render.image_settings.file_format = "PNG"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.image_settings.compression = 100
    scene.view_settings.view_transform = "Standard"
    scene.render.use_persistent_data = True

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
