"""Reads an exported model with Blender (the module bpy of pip) and looks for the time and the stroke at its vertices.

    python3 tests/gltf_validator/blender.py MODEL.glb
"""

import sys

import bpy

path = sys.argv[1]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=path)
meshes = [thing.data for thing in bpy.data.objects if thing.type == "MESH"]
assert meshes, f"{path}: expected meshes"
for mesh in meshes:
    for name in ("_TIMESTAMP", "_STROKE"):
        attribute = mesh.attributes.get(name)
        assert attribute is not None, f"{path}: {mesh.name} has no {name}"
        assert (attribute.domain, attribute.data_type) == ("POINT", "FLOAT"), f"{path}: {name}"
        values = [entry.value for entry in attribute.data]
        assert len(values) == len(mesh.vertices), f"{path}: {name}"
        assert len(set(values)) > 1, f"{path}: all of {name} is {values[0]}"
print(f"{path}: Blender {bpy.app.version_string} reads the time and the stroke of {len(meshes)} meshes")
