"""Files that people have and MotionMind does not read: what to do instead."""

from __future__ import annotations

_EXPORT = "and export glTF (.glb), or BVH"
_FROM_MARKERS = "holds markers on the skin, not joints: solve a skeleton from them, and export that as BVH"
_UNPACK = "an archive: unpack it, and give a file from it"

# Collada left Blender in version 5.0. MMD Tools imports VMD and VPD onto an MMD model that is already in the scene.
_WAYS_OUT = {
    ".c3d": f"C3D {_FROM_MARKERS}",
    ".trc": f"TRC {_FROM_MARKERS}",
    ".csv": "tables are not read: export BVH from the program that wrote it (in OptiTrack's Motive, of a skeleton)",
    ".tak": "a take of OptiTrack's Motive: open it there, and export its skeleton as BVH",
    ".fbx": f"FBX is not read: open it in Blender (File, Import, FBX) {_EXPORT}",
    **dict.fromkeys(
        (".usd", ".usda", ".usdc", ".usdz"),
        f"USD is not read: open it in Blender (File, Import, Universal Scene Description) {_EXPORT}",
    ),
    ".dae": f"Collada is not read: open it in Blender 4.5 or earlier (File, Import, Collada) {_EXPORT}",
    **dict.fromkeys(
        (".vmd", ".vpd"),
        f"MikuMikuDance is not read: import its model and this into Blender with the add-on MMD Tools, {_EXPORT}",
    ),
    ".blend": "a scene of Blender: open it there, select its armature, and export glTF (.glb), or BVH",
    ".abc": "Alembic holds meshes, not joints: export the armature that moved them as glTF (.glb), or BVH",
    **dict.fromkeys((".ma", ".mb"), f"a scene of Maya: export FBX there, open that in Blender {_EXPORT}"),
    ".max": "a scene of 3ds Max: export FBX there, open that in Blender and export glTF (.glb), or BVH",
    ".bip": "a Biped of 3ds Max: load it there, export FBX, open that in Blender and export glTF (.glb), or BVH",
    **dict.fromkeys(
        (".pth", ".ckpt"),
        "PyTorch's files are not read: load it there, and save its poses as .npz, in the form of AMASS",
    ),
    **dict.fromkeys((".zip", ".gz", ".tgz", ".bz2", ".xz", ".zst", ".7z", ".rar", ".tar"), _UNPACK),
}


def way_out(suffix: str) -> str | None:
    """Return what to do with a file of a suffix that is not read; None for an unknown suffix.

    >>> from motionmind.formats.refused import way_out
    >>> way_out(".zip")
    'an archive: unpack it, and give a file from it'
    """
    return _WAYS_OUT.get(suffix)
