"""Renders a model.glb with Blender's Cycles from one of the model's cameras (docs/viewer.md).

    blender -b -P blender_picture.py -- model.glb CAMERA out.png
"""

from __future__ import annotations

import json
import struct
import sys
from typing import Any, NamedTuple

import bpy
import mathutils
import numpy

numpy.bool = bool  # Blender's importer of Debian 12 uses a name that its numpy no longer has


class Extension(NamedTuple):
    """The extension of a model (docs/formats.md), and the contents of its bufferViews."""

    soup: dict[str, Any]
    views: list[bytes]


def read_extension(path: str) -> Extension:
    with open(path, "rb") as file:
        data = file.read()
    length = struct.unpack("<I", data[12:16])[0]
    document = json.loads(data[20:20 + length])
    views = [data[28 + length + view["byteOffset"]:][:view["byteLength"]] for view in document["bufferViews"]]
    return Extension(document["extensions"]["TRISOUP_neural_textures"], views)


def cut_off(material: bpy.types.Material) -> None:
    """Makes opacity 0 or 1. Cycles ignores the alphaMode MASK of the file."""
    tree = material.node_tree
    picture = next(node for node in tree.nodes if node.type == "TEX_IMAGE")
    step = tree.nodes.new("ShaderNodeMath")
    step.operation = "GREATER_THAN"
    step.inputs[1].default_value = 0.5
    for link in [link for link in tree.links if link.from_socket == picture.outputs["Alpha"]]:
        target = link.to_socket
        tree.links.remove(link)
        tree.links.new(step.outputs[0], target)
    tree.links.new(picture.outputs["Alpha"], step.inputs[0])


def add_camera(extension: Extension, which: int, mesh: bpy.types.Object) -> bpy.types.Object:
    """Adds a camera of the model. mesh: the imported object."""
    soup = extension.soup
    cameras = soup["cameras"]
    lens = cameras["lenses"][cameras["lens"][which] if "lens" in cameras else 0]
    x, y, z, w, *place = struct.unpack_from("<7f", extension.views[cameras["poses"]], 28 * which)
    pose = (mathutils.Matrix.Translation(place) @ mathutils.Quaternion((w, x, y, z)).to_matrix().to_4x4()).inverted()
    origin = soup.get("origin", [0, 0, 0])
    pose.translation = [pose.translation[i] / soup["scale"] + soup["centre"][i] - origin[i] for i in range(3)]
    # The importer turns the model from +Y up to +Z up.
    turned = mathutils.Matrix([[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
    data = bpy.data.cameras.new("camera")
    data.sensor_width, data.lens = 36, 36 * lens["focal"][0] / lens["size"][0]
    data.clip_start, data.clip_end = 0.01 / soup["scale"], 10 / soup["scale"]
    camera = bpy.data.objects.new("camera", data)
    camera.matrix_world = mesh.matrix_world @ turned @ pose @ mathutils.Matrix.Diagonal([1, -1, -1, 1])
    bpy.context.scene.collection.objects.link(camera)
    return camera


def main() -> None:
    path, which, out = sys.argv[sys.argv.index("--") + 1:]
    extension = read_extension(path)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.import_scene.gltf(filepath=path)
    for material in bpy.data.materials:
        cut_off(material)
    scene = bpy.context.scene
    mesh = next(thing for thing in bpy.data.objects if thing.type == "MESH")
    scene.camera = add_camera(extension, int(which), mesh)
    scene.world = bpy.data.worlds.new("world")
    scene.world.use_nodes = True
    scene.world.node_tree.nodes["Background"].inputs[0].default_value = (*extension.soup["background"], 1)
    scene.view_settings.view_transform = "Standard"  # keeps the colours of the photographs
    scene.render.engine = "CYCLES"
    scene.cycles.samples = 8
    scene.cycles.use_denoising = False  # Debian's Blender may lack a denoiser
    scene.cycles.transparent_max_bounces = 64
    scene.render.resolution_x = scene.render.resolution_y = 400
    scene.render.filepath = out
    bpy.ops.render.render(write_still=True)


main()
