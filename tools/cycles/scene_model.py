"""A scene file with its OBJ and MTL files, read into plain lists, in the meaning of `--material lambert --smoothing off`.

A reader of its own, so that no importer of the peer turns axes, smooths normals or guesses at materials. What a scene asks for
beyond diffuse surfaces is refused by name instead of left out: a picture without it would be another picture.
See: include/pathscope/scene/scene_file.hpp, docs/conventions.md.   Test: tests/system/test_cycles.py
"""
import json
from array import array
from dataclasses import dataclass, field
from pathlib import Path

READ_LIGHTS = ("emissive_mtl", "quad", "sun", "sky")
READ_OVERRIDES = ("kd", "ke", "map_kd", "map_d")
UNSEEN_OVERRIDES = ("model", "ks", "map_ks", "roughness", "map_roughness", "metallic", "ior", "opacity")  # No part of Lambert.
BLACK = (0.0, 0.0, 0.0)
NONE = -1


class Refused(Exception):
    """One sentence for the reader."""


@dataclass
class Material:
    kd: tuple = BLACK
    ke: tuple = BLACK
    map_kd: Path | None = None
    map_d: Path | None = None
    two_sided: bool = True

    def emits(self):
        return any(self.ke)


@dataclass
class Mesh:
    """Polygons by corner; `normals` and `uvs` are those of the corners. A zero normal stands for the polygon's own."""
    positions: list = field(default_factory=list)
    first_corner: list = field(default_factory=lambda: [0])
    corners: array = field(default_factory=lambda: array("i"))
    uvs: array = field(default_factory=lambda: array("f"))
    normals: list = field(default_factory=list)
    materials: list = field(default_factory=list)
    has_uvs: bool = False
    has_normals: bool = False


@dataclass
class Scene:
    name: str
    camera: dict
    lights: list
    materials: list
    mesh: Mesh


def as_number(word, path, number):
    try:
        return float(word)
    except ValueError:
        raise Refused(f"{path}:{number}: \"{word}\" is no number; mend the file.") from None


def colour(words, path, number):
    """Three numbers, or one for a grey."""
    values = [as_number(word, path, number) for word in words[:3]]
    return tuple(values) if len(values) == 3 else (values[0],) * 3


def map_path(words, path, number):
    name = " ".join(words).strip('"').replace("\\", "/")
    if not name or name.startswith("-"):
        raise Refused(f"{path}:{number}: maps with options are not compared; leave this scene out.")
    return path.parent / name


def read_mtl(path):
    """Materials by name. A map without Kd shows as it is; of two materials of one name the first counts."""
    found, current, said_kd = {}, None, False
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        keyword, *words = line.split() or [""]
        if keyword == "newmtl":
            current, said_kd = Material(), False
            found.setdefault(" ".join(words), current)
        elif keyword == "Kd":
            current.kd, said_kd = tuple(min(max(v, 0.0), 1.0) for v in colour(words, path, number)), True
        elif keyword == "Ke":
            current.ke = colour(words, path, number)
        elif keyword == "map_Kd":
            current.map_kd = map_path(words, path, number)
            current.kd = current.kd if said_kd else (1.0, 1.0, 1.0)
        elif keyword == "map_d":
            current.map_d = map_path(words, path, number)
        elif keyword == "map_Ke":
            raise Refused(f"{path}:{number}: emission with a map is not compared; leave this scene out.")
    return found


class ObjReader:
    """One OBJ file, added to a mesh."""

    def __init__(self, path, mesh, materials):
        self.path, self.mesh, self.materials = path, mesh, materials
        self.library, self.numbers = {}, {}
        self.vertices, self.uvs, self.normals = [], [], []
        self.material = None
        self.base = len(mesh.positions)

    def run(self):
        for number, line in enumerate(self.path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
            keyword, *words = line.split("#")[0].split() or [""]
            if keyword == "v":
                self.vertices.append(tuple(as_number(word, self.path, number) for word in words[:3]))
            elif keyword == "vt":
                self.uvs.append(tuple(as_number(word, self.path, number) for word in words[:2]))
            elif keyword == "vn":
                self.normals.append(tuple(as_number(word, self.path, number) for word in words[:3]))
            elif keyword == "f":
                self.add_face(words)
            elif keyword == "usemtl":
                self.material = self.number_of(" ".join(words))
            elif keyword == "mtllib" and (self.path.parent / " ".join(words)).is_file():
                for name, material in read_mtl(self.path.parent / " ".join(words)).items():
                    self.library.setdefault(name, material)
        self.mesh.positions += self.vertices

    def number_of(self, name):
        """Materials that the MTL does not have are grey, as in src/scene/load.cpp."""
        if name not in self.numbers:
            self.numbers[name] = len(self.materials)
            self.materials.append((name, self.library.get(name, Material(kd=(0.5, 0.5, 0.5)))))
        return self.numbers[name]

    def add_face(self, words):
        if self.material is None:
            self.material = self.number_of("")
        mesh = self.mesh
        for word in words:
            position, uv, normal = self.indices(word)
            mesh.corners.append(self.base + position)
            mesh.uvs.extend(self.uvs[uv] if uv != NONE else (0.0, 0.0))
            mesh.normals.append(self.normals[normal] if normal != NONE else BLACK)
            mesh.has_uvs |= uv != NONE
            mesh.has_normals |= normal != NONE
        mesh.first_corner.append(len(mesh.corners))
        mesh.materials.append(self.material)

    def indices(self, word):
        """OBJ counts from 1, or backwards from what has been read so far."""
        parts = (word.split("/") + ["", ""])[:3]
        lists = (self.vertices, self.uvs, self.normals)
        return [NONE if not part else int(part) - 1 if int(part) > 0 else len(of) + int(part) for part, of in zip(parts, lists)]


def apply_override(material, changes, folder, name):
    for key, value in changes.items():
        if key in UNSEEN_OVERRIDES:
            continue
        if key not in READ_OVERRIDES:
            raise Refused(f"materials[\"{name}\"].{key} is not compared; leave this scene out.")
        setattr(material, key, (folder / value if value else None) if key.startswith("map") else tuple(value))
    if "kd" in changes and "map_kd" not in changes:
        material.map_kd = None  # A value replaces a map of the same quantity.


def finish_materials(named, spec, folder):
    """Who emits: Ke, if the scene names emissive_mtl or no light at all. Who emits reflects nothing."""
    lights = spec.get("lights", [])
    emissive = next((light for light in lights if light["type"] == "emissive_mtl"), None if lights else {})
    for name, material in named:
        apply_override(material, spec.get("materials", {}).get(name, {}), folder, name)
        if emissive is None:
            material.ke = BLACK
        else:
            material.two_sided = emissive.get("two_sided", True)
        if material.emits():
            material.kd, material.map_kd = BLACK, None
    return [material for _, material in named]


def default_camera(spec, path):
    camera = dict(spec.get("camera") or next(iter(spec.get("cameras", [])), None) or {})
    if not camera:
        raise Refused(f"{path}: names no camera; both renderers need the same one.")
    camera.setdefault("up", [0, 0, 1] if spec.get("up_axis", "Y") == "Z" else [0, 1, 0])
    camera.setdefault("vfov_deg", 45)
    camera.setdefault("aspect", "16:9")
    return camera


def read_spec(path):
    """The scene file alone, refused where it asks for a light that is not compared."""
    try:
        spec = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise Refused(f"{path}: cannot be read: {error.strerror}; name a scene.json.") from None
    except ValueError as error:
        raise Refused(f"{path}: is not JSON: {error}.") from None
    for light in spec.get("lights", []):
        if light.get("type") not in READ_LIGHTS:
            raise Refused(f"{path}: a light of type \"{light.get('type')}\" is not compared; scenes lit by "
                          f"{', '.join(READ_LIGHTS)} are.")
    default_camera(spec, path)
    return spec


def read_scene(path):
    spec, folder = read_spec(path), path.parent
    mesh, named = Mesh(), []
    for name in [spec["obj"]] if isinstance(spec["obj"], str) else spec["obj"]:
        obj = folder / name.replace("\\", "/")
        if not obj.is_file():
            raise Refused(f"{obj}: there is no such OBJ file; {path} names it.")
        ObjReader(obj, mesh, named).run()
    lights = [light for light in spec.get("lights", []) if light["type"] != "emissive_mtl"]
    return Scene(spec.get("name") or folder.name, default_camera(spec, path), lights, finish_materials(named, spec, folder), mesh)
