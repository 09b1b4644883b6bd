"""Runs inside Blender: builds a scene from plain lists, with coordinates as they stand in the files.

Blender's own conventions that matter here: a camera looks along its -z with +y up; a sun shines along its -z; textures have their
first row at the bottom, as v = 0 of OBJ; an Emission shader shines from both sides of a face unless it asks for Backfacing.
"""
import math
from array import array

import bpy
from mathutils import Matrix, Vector
from mathutils.geometry import tessellate_polygon

CUTOUT_THRESHOLD = 0.5
NO_LIMIT = 1e6


# ---- Triangles.

def is_left_turn(a, b, c, normal):
    return (b - a).cross(c - a).dot(normal) > 0


def cut_quad(p):
    """By the shorter diagonal, as src/scene/triangulate.cpp; of a quad that is not convex by the one inside."""
    normal = (p[2] - p[0]).cross(p[3] - p[1])
    cuts_02 = is_left_turn(p[0], p[1], p[2], normal) and is_left_turn(p[0], p[2], p[3], normal)
    cuts_13 = is_left_turn(p[0], p[1], p[3], normal) and is_left_turn(p[1], p[2], p[3], normal)
    shorter_02 = (p[2] - p[0]).length <= (p[3] - p[1]).length
    by_02 = shorter_02 if cuts_02 == cuts_13 else cuts_02
    return [(0, 1, 2), (0, 2, 3)] if by_02 else [(0, 1, 3), (1, 2, 3)]


def cut(points):
    """The triangles of a polygon, in its own turning direction."""
    if len(points) == 3:
        return [(0, 1, 2)]
    if len(points) == 4:
        return cut_quad(points)
    normal = sum((a.cross(b) for a, b in zip(points, points[1:] + points[:1])), Vector())
    triangles = tessellate_polygon([points])
    return [t if is_left_turn(points[t[0]], points[t[1]], points[t[2]], normal) else t[::-1] for t in triangles]


def triangles_of(mesh):
    """Corners of all triangles, three each, and their materials. Of triangles that coincide only the first stays: rays of
    the peer that start on one of them may or may not meet the other."""
    positions = [Vector(p) for p in mesh.positions]
    corners, materials, seen = array("i"), array("i"), set()
    for face, material in enumerate(mesh.materials):
        first, last = mesh.first_corner[face], mesh.first_corner[face + 1]
        for triangle in cut([positions[i] for i in mesh.corners[first:last]]):
            places = frozenset(mesh.positions[mesh.corners[first + i]] for i in triangle)
            if len(places) == 3 and places not in seen:
                seen.add(places)
                corners.extend(first + i for i in triangle)
                materials.append(material)
    return corners, materials


def add_mesh(model, materials):
    source = model.mesh
    corners, numbers = triangles_of(source)
    mesh = bpy.data.meshes.new("scene")
    indices = [source.corners[i] for i in corners]
    mesh.from_pydata(source.positions, [], list(zip(indices[0::3], indices[1::3], indices[2::3])))
    mesh.polygons.foreach_set("material_index", numbers)
    for material in materials:
        mesh.materials.append(material)
    if source.has_uvs:
        flat = array("f", (source.uvs[2 * i + axis] for i in corners for axis in (0, 1)))
        mesh.uv_layers.new(name="uv").data.foreach_set("uv", flat)
    if source.has_normals:  # A triangle without is flat: left smooth, Blender would make up normals for it.
        mesh.use_auto_smooth = True
        mesh.polygons.foreach_set("use_smooth", [any(source.normals[i]) for i in corners[::3]])
        mesh.normals_split_custom_set([source.normals[i] for i in corners])
    add_object("scene", mesh)


def add_object(name, data):
    thing = bpy.data.objects.new(name, data)
    thing.cycles.shadow_terminator_geometry_offset = 0  # Shadow rays start on the triangle, as ours.
    bpy.context.scene.collection.objects.link(thing)
    return thing


# ---- Materials: small graphs of nodes.

class Graph:
    def __init__(self, name):
        self.material = bpy.data.materials.new(name)
        self.material.use_nodes = True
        self.tree = self.material.node_tree
        self.tree.nodes.clear()

    def add(self, kind, **values):
        """A node with these values on its inputs: a value, or a socket to be linked."""
        node = self.tree.nodes.new(kind)
        for name, value in values.items():
            if isinstance(value, bpy.types.NodeSocket):
                self.tree.links.new(value, node.inputs[name])
            else:
                node.inputs[name].default_value = value
        return node

    def image(self, path, colour_space):
        """Alpha is kept apart: it changes no colour."""
        node = self.tree.nodes.new("ShaderNodeTexImage")
        node.image = bpy.data.images.load(str(path))
        node.image.colorspace_settings.name = colour_space
        node.image.alpha_mode = "CHANNEL_PACKED"
        node.interpolation, node.extension = "Linear", "REPEAT"
        return node

    def mix(self, weight, first, second):
        node = self.tree.nodes.new("ShaderNodeMixShader")
        for place, socket in enumerate((weight, first, second)):
            self.tree.links.new(socket, node.inputs[place])
        return node.outputs[0]


def opaque(image):
    if image.channels < 4 or image.depth in (8, 24):
        return True
    pixels = array("f", bytes(4 * len(image.pixels)))
    image.pixels.foreach_get(pixels)
    return min(pixels[3::4]) >= 1


def surface(graph, source):
    if source.emits():
        brightest = max(source.ke)
        shine = graph.add("ShaderNodeEmission", Color=(*(value / brightest for value in source.ke), 1), Strength=brightest).outputs[0]
        if source.two_sided:
            return shine
        behind = graph.tree.nodes.new("ShaderNodeNewGeometry").outputs["Backfacing"]
        return graph.mix(behind, shine, graph.add("ShaderNodeEmission", Strength=0.0).outputs[0])
    colour = (*source.kd, 1)
    if source.map_kd:
        texture = graph.image(source.map_kd, "sRGB").outputs["Color"]
        tint = graph.add("ShaderNodeMixRGB", Fac=1.0, Color1=texture, Color2=colour)
        tint.blend_type = "MULTIPLY"
        colour = tint.outputs[0]
    return graph.add("ShaderNodeBsdfDiffuse", Color=colour, Roughness=0.0).outputs[0]


def cut_out(graph, source, shader):
    """Where map_d is below the threshold, light goes straight on."""
    mask = graph.image(source.map_d, "Non-Color")
    value = mask.outputs["Color"] if opaque(mask.image) else mask.outputs["Alpha"]
    hole = graph.tree.nodes.new("ShaderNodeMath")
    hole.operation = "LESS_THAN"
    graph.tree.links.new(value, hole.inputs[0])
    hole.inputs[1].default_value = CUTOUT_THRESHOLD
    return graph.mix(hole.outputs[0], shader, graph.add("ShaderNodeBsdfTransparent").outputs[0])


def make_material(number, source):
    graph = Graph(f"material {number}")
    shader = surface(graph, source)
    if source.map_d:
        shader = cut_out(graph, source, shader)
    graph.add("ShaderNodeOutputMaterial", Surface=shader)
    return graph.material


# ---- Lights and camera.

def facing(direction, up):
    """The rotation that turns -z to `direction` and +y as near to `up` as it goes."""
    back = -Vector(direction).normalized()
    right = Vector(up).cross(back).normalized()
    return Matrix((right, back.cross(right), back)).transposed().to_4x4()


def add_quad(light):
    """A black parallelogram that shines on the side of edge_u x edge_v."""
    from scene_model import Material
    corner, u, v = (Vector(light[key]) for key in ("corner", "edge_u", "edge_v"))
    mesh = bpy.data.meshes.new("quad")
    mesh.from_pydata([corner, corner + u, corner + u + v, corner + v], [], [(0, 1, 2, 3)])
    mesh.materials.append(make_material("quad", Material(ke=tuple(light["radiance"]), two_sided=False)))
    add_object("quad", mesh)


def add_sun(light):
    """Blender's strength of a sun is irradiance on a plane that faces it, its angle the diameter."""
    to_sun = Vector(light["to_sun"])
    sun = bpy.data.lights.new("sun", "SUN")
    sun.energy = max(light["irradiance"])
    sun.color = [value / sun.energy for value in light["irradiance"]]
    sun.angle = math.radians(light.get("angle_deg", 0.53))
    across = (1, 0, 0) if abs(to_sun.normalized().x) < 0.9 else (0, 1, 0)
    add_object("sun", sun).matrix_world = facing(-to_sun, across)


def set_sky(lights):
    """One colour from all directions; black where the scene names no sky."""
    radiance = [sum(light["radiance"][i] for light in lights if light["type"] == "sky") for i in range(3)]
    world = bpy.data.worlds.new("sky")
    world.use_nodes = True
    background = world.node_tree.nodes["Background"].inputs
    brightest = max(radiance) or 1
    background["Color"].default_value = (*(value / brightest for value in radiance), 1)
    background["Strength"].default_value = brightest
    bpy.context.scene.world = world


def add_camera(spec):
    """The near and the far plane, which we do not have, are put out of the way."""
    camera = bpy.data.cameras.new("camera")
    camera.sensor_fit = "VERTICAL"
    camera.angle = math.radians(spec["vfov_deg"])
    position, look_at = Vector(spec["position"]), Vector(spec["look_at"])
    distance = (look_at - position).length
    camera.clip_start, camera.clip_end = distance / NO_LIMIT, distance * NO_LIMIT
    eye = add_object("camera", camera)
    eye.matrix_world = Matrix.Translation(position) @ facing(look_at - position, spec["up"])
    bpy.context.scene.camera = eye


def build(model):
    for thing in list(bpy.data.objects):
        bpy.data.objects.remove(thing)
    add_mesh(model, [make_material(number, source) for number, source in enumerate(model.materials)])
    for light in model.lights:
        if light["type"] == "quad":
            add_quad(light)
        if light["type"] == "sun":
            add_sun(light)
    set_sky(model.lights)
    add_camera(model.camera)
