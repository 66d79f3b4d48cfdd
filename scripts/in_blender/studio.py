# SPDX-License-Identifier: GPL-3.0-or-later
"""The demo's studio: clay, a light that grazes the surface, a camera, Cycles on the CPU.

Everything is placed about the bounding sphere of the field, so any field fills the picture.
"""

from pathlib import Path
from typing import Any

import bpy
from mathutils import Vector

SIZE = (900, 700)
SAMPLES = 12
EVEN = (0.34, 0.35, 0.37, 1.0)  # light from everywhere, brighter than that of the dark studio
SEEN_FROM = Vector((0.5, -1.0, 0.28)).normalized()
LENS = 70.0  # mm on Blender's 36 mm sensor
DISTANCE = 3.6  # of the camera, in radii of the field
LIGHTS = (  # from, size in radii of the field, power per radius squared, color
    (Vector((-1.0, -0.55, 1.1)), 0.7, 95.0, (1.0, 0.94, 0.86)),  # key: from the side, for relief
    (Vector((1.2, -0.9, 0.1)), 2.5, 26.0, (0.8, 0.88, 1.0)),  # fill
    (Vector((0.3, 1.2, 0.9)), 1.0, 60.0, (0.9, 0.95, 1.0)),  # rim: parts the shape from the ground
)


def set_up(ob: bpy.types.Object, seen_from: Vector = SEEN_FROM) -> bpy.types.Object:
    """Give the field a material and put lights and a camera about it, which is returned.

    seen_from: unit direction from the field to the camera
    """
    bpy.context.view_layer.update()
    center, radius = _bounds(ob)
    assert isinstance(ob.data, bpy.types.Mesh)
    ob.data.materials.append(_clay())
    camera = _camera(center, radius, seen_from)
    for number, (direction, size, power, color) in enumerate(LIGHTS):
        light = bpy.data.lights.new(f"Light {number + 1}", "AREA")
        assert isinstance(light, bpy.types.AreaLight)
        light.size, light.energy, light.color = size * radius, power * radius**2, color
        place = center + direction.normalized() * 3.2 * radius
        _aim(bpy.data.objects.new(light.name, light), place, center)
    world = bpy.data.worlds.new("Studio")
    world.use_nodes = True
    _set(world, "Background", "Color", (0.07, 0.08, 0.095, 1.0))
    scene = bpy.context.scene
    scene.world = world
    scene.render.engine = "CYCLES"
    scene.cycles.samples = SAMPLES
    scene.cycles.max_bounces = 2
    scene.cycles.use_denoising = True
    scene.cycles.denoising_prefilter = "FAST"
    scene.render.resolution_x, scene.render.resolution_y = SIZE
    scene.view_settings.view_transform = "AgX"
    scene.view_settings.look = "AgX - Medium High Contrast"
    return camera


def read(path: Path) -> bpy.types.Object:
    """The mesh of a PLY file, shaded smooth, alone in an empty file."""
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.wm.ply_import(filepath=str(path))
    ob = bpy.context.active_object
    assert ob is not None and isinstance(ob.data, bpy.types.Mesh)
    ob.data.shade_smooth()
    return ob


def on_nothing(size: tuple[int, int]) -> None:
    """Render without a ground, in even light, so many pixels wide and high."""
    scene = bpy.context.scene
    _set(scene.world, "Background", "Color", EVEN)
    scene.render.resolution_x, scene.render.resolution_y = size
    scene.render.film_transparent = True
    scene.render.image_settings.color_mode = "RGBA"


def render(path: Path) -> None:
    """Render what the camera sees into a PNG."""
    bpy.context.scene.render.filepath = str(path)
    bpy.ops.render.render(write_still=True)


def _bounds(ob: Any) -> tuple[Vector, float]:
    """Center and radius of the object's bounding box, in the scene."""
    corners = [ob.matrix_world @ Vector(corner) for corner in ob.bound_box]
    center = sum(corners, Vector()) / 8
    return center, max((corner - center).length for corner in corners)


def _camera(center: Vector, radius: float, seen_from: Vector) -> bpy.types.Object:
    lens = bpy.data.cameras.new("Camera")
    lens.lens = LENS
    camera = bpy.data.objects.new(lens.name, lens)
    _aim(camera, center + seen_from * DISTANCE * radius, center)
    bpy.context.scene.camera = camera
    return camera


def _aim(ob: bpy.types.Object, place: Vector, target: Vector) -> None:
    ob.location = place
    ob.rotation_euler = (target - place).to_track_quat("-Z", "Y").to_euler()
    bpy.context.scene.collection.objects.link(ob)
    bpy.context.view_layer.update()


def _clay() -> bpy.types.Material:
    material = bpy.data.materials.new("Clay")
    material.use_nodes = True
    _set(material, "Principled BSDF", "Base Color", (0.62, 0.36, 0.24, 1.0))
    _set(material, "Principled BSDF", "Roughness", 0.45)
    return material


def _set(owner: Any, node: str, socket: str, value: object) -> None:
    """Set an input of a shader node of a world or a material."""
    owner.node_tree.nodes[node].inputs[socket].default_value = value
