# SPDX-License-Identifier: GPL-3.0-or-later
"""What a field is fitted to: the mesh as modifiers, geometry nodes and simulations make it."""

import bpy
import numpy as np
from bpy.types import Node, NodeTree
from harness import SculptCase, fit, in_world, module, push_undo
from mathutils import Matrix


def geometry_nodes() -> tuple[NodeTree, Node, Node]:
    """Nodes for a modifier, and those of what they are given and of what they make."""
    nodes = bpy.data.node_groups.new("Nodes", "GeometryNodeTree")
    for side in ("INPUT", "OUTPUT"):
        nodes.interface.new_socket("Geometry", in_out=side, socket_type="NodeSocketGeometry")
    return nodes, nodes.nodes.new("NodeGroupInput"), nodes.nodes.new("NodeGroupOutput")


class SourceMesh(SculptCase):
    def test_modifiers_are_applied(self) -> None:
        bpy.ops.mesh.primitive_cube_add()
        source = bpy.context.active_object
        modifier = source.modifiers.new("Array", "ARRAY")
        modifier.relative_offset_displace = (2.0, 0.0, 0.0)
        read = module("blender.operators.fields.source_mesh").read
        for hidden in (False, True):  # when Blender does not evaluate it
            source.hide_viewport = hidden
            points, triangles = read(source, Matrix())
            self.assertEqual((len(points), len(triangles)), (16, 24))
            self.assertEqual(points[:, 0].max(), 5.0)
        self.assertEqual([*bpy.data.objects], [source])

    def test_instances_of_geometry_nodes_are_a_part(self) -> None:
        """A cube, and on each side of it a ball, which the nodes make an instance of: three pieces,
        the balls in the material of their object. The ball itself is not in the scene."""
        bpy.ops.mesh.primitive_uv_sphere_add(radius=0.8)
        ball = bpy.context.active_object
        ball.data.materials.append(bpy.data.materials.new("Gold"))
        bpy.context.collection.objects.unlink(ball)
        bpy.ops.mesh.primitive_cube_add()
        source = bpy.context.active_object
        source.data.materials.append(bpy.data.materials.new("Iron"))
        nodes, given, made = geometry_nodes()
        line, info, instances, join = (
            nodes.nodes.new(f"GeometryNode{kind}")
            for kind in ("MeshLine", "ObjectInfo", "InstanceOnPoints", "JoinGeometry")
        )
        line.inputs["Count"].default_value = 2
        line.inputs["Start Location"].default_value = (-3, 0, 0)
        line.inputs["Offset"].default_value = (6, 0, 0)
        info.inputs["Object"].default_value = ball
        info.inputs["As Instance"].default_value = True
        nodes.links.new(line.outputs[0], instances.inputs["Points"])
        nodes.links.new(info.outputs["Geometry"], instances.inputs["Instance"])
        nodes.links.new(instances.outputs[0], join.inputs[0])
        nodes.links.new(given.outputs[0], join.inputs[0])
        nodes.links.new(join.outputs[0], made.inputs[0])
        source.modifiers.new("Balls", "NODES").node_group = nodes
        push_undo("Nodes")
        objects, groups = len(bpy.data.objects), len(bpy.data.node_groups)
        ob = fit(source)
        self.assertEqual(len(bpy.data.objects), objects + 1)
        self.assertEqual(len(bpy.data.node_groups), groups)
        self.assertIn('"components": 3,', ob.neural_sculpt.report)
        low, high = in_world(ob).min(axis=0), in_world(ob).max(axis=0)
        np.testing.assert_allclose([low, high], [(-3.8, -1, -1), (3.8, 1, 1)], atol=0.05)
        names = [slot.material.name for slot in ob.material_slots]
        for face in list(ob.data.polygons)[::20]:
            x = abs((ob.matrix_world @ face.center).x)
            self.assertEqual(names[face.material_index], "Gold" if x > 1.6 else "Iron")

    def test_what_a_simulation_has_come_to_is_fitted(self) -> None:
        """Nodes that move a cube by one in each of five frames, and make an instance of it. Its own
        slot has another material than its mesh."""
        bpy.ops.mesh.primitive_cube_add()
        source = bpy.context.active_object
        source.data.materials.append(bpy.data.materials.new("Iron"))
        source.material_slots[0].link = "OBJECT"
        source.material_slots[0].material = bpy.data.materials.new("Wax")
        nodes, given, made = geometry_nodes()
        begin, end, move, instance = (
            nodes.nodes.new(f"GeometryNode{kind}")
            for kind in ("SimulationInput", "SimulationOutput", "SetPosition", "GeometryToInstance")
        )
        begin.pair_with_output(end)
        move.inputs["Offset"].default_value = (1, 0, 0)
        for one, other in ((given, begin), (begin, move), (move, end), (end, instance)):
            outputs = [each for each in one.outputs if each.type == "GEOMETRY"]
            inputs = [each for each in other.inputs if each.type == "GEOMETRY"]
            nodes.links.new(outputs[0], inputs[0])
        nodes.links.new(instance.outputs[0], made.inputs[0])
        source.modifiers.new("Simulation", "NODES").node_group = nodes
        for frame in range(1, 6):
            bpy.context.scene.frame_set(frame)
        shown = module("blender.operators.fields.source_mesh").read_dressed(source, Matrix())
        middle = shown.vertices.mean(axis=0)
        np.testing.assert_allclose(middle, (5, 0, 0), atol=1e-5)
        self.assertEqual(shown.materials, (bpy.data.materials["Wax"].session_uid,))

    def test_materials_that_modifiers_give_stay(self) -> None:
        """The nodes paint what lies right of the middle."""
        bpy.ops.mesh.primitive_uv_sphere_add()
        source = bpy.context.active_object
        source.data.materials.append(bpy.data.materials.new("Iron"))
        nodes, given, made = geometry_nodes()
        paint = nodes.nodes.new("GeometryNodeSetMaterial")
        paint.inputs["Material"].default_value = bpy.data.materials.new("Gold")
        place = nodes.nodes.new("GeometryNodeInputPosition")
        axes = nodes.nodes.new("ShaderNodeSeparateXYZ")
        nodes.links.new(place.outputs[0], axes.inputs[0])
        nodes.links.new(axes.outputs["X"], paint.inputs["Selection"])  # above 0 is true
        nodes.links.new(given.outputs[0], paint.inputs[0])
        nodes.links.new(paint.outputs[0], made.inputs[0])
        source.modifiers.new("Paint", "NODES").node_group = nodes
        ob = fit(source)
        names = [slot.material.name for slot in ob.material_slots]
        self.assertEqual(names, ["Iron", "Gold"])
        for face in list(ob.data.polygons)[::20]:
            if abs(x := (ob.matrix_world @ face.center).x) > 0.2:
                self.assertEqual(face.material_index, int(x > 0))
